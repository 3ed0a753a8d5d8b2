// §5 V_i(k): optical depth between a cell and a light. Shared by the stages visibility and integrate. Twins:
// src/light/optical_depth.rs, and transmittance_code in src/light/visibility.rs.

#import trace::levels
#import trace::matter
#import volume::cells
#import walk

// Whether a cell's ρ counts once, whatever the length of the ray inside the cell.
override PER_CELL: bool = false;

// State of the walk from the centre of a cell to the point where the light ray leaves the slab.
struct LightWalk {
    // Σ ρ code × length, or Σ ρ code.
    depth: f32,
    t: f32,
    cells: u32,
    done: bool,
}

// Walks from `cell` along `direction`, both in the level's cells. Ends early once the depth exceeds `enough`.
fn optical_depth(
    level: Level,
    matter: SheetDensity,
    cell: vec3<i32>,
    direction: vec3<f32>,
    max_cells: u32,
    enough: f32,
) -> LightWalk {
    var ray: LightWalk;
    var walk = walk_new(level.size, vec3<f32>(cell) + 0.5, direction);
    while !ray.done {
        pass_cell(matter, &walk, &ray, level, max_cells, enough);
        pass_cell(matter, &walk, &ray, level, max_cells, enough);
        pass_cell(matter, &walk, &ray, level, max_cells, enough);
        pass_cell(matter, &walk, &ray, level, max_cells, enough);
    }
    return ray;
}

fn pass_cell(
    matter: SheetDensity,
    walk: ptr<function, Walk>,
    ray: ptr<function, LightWalk>,
    level: Level,
    max_cells: u32,
    enough: f32,
) {
    let texel = cell_words(in_texture((*walk).cell, level));
    var passed_by = 0u;
    if LEAPS {
        passed_by = walk_leap(walk, texel, matter.shift <= 0.0);
    }
    let t_exit = walk_exit(*walk);
    let rho = matter_rho(f32(texel.x & 0xffffu), matter);
    if PER_CELL {
        // A cell of the volume does not shadow itself. In a coarse cell, half of the other cells do.
        let own = 0.5 - 0.5 * level.scale.z;
        (*ray).depth += select(rho * select(1.0, own, (*ray).cells == 0u), 0.0, (*ray).done);
    } else {
        (*ray).depth += select(rho * (t_exit - (*ray).t), 0.0, (*ray).done);
    }
    (*ray).cells += select(1u + passed_by, 0u, (*ray).done);
    if LEAPS {
        (*ray).cells = min((*ray).cells, max_cells);
    }
    (*ray).t = t_exit;
    walk_step(walk, true);
    let z = (*walk).cell.z;
    (*ray).done |= (z < 0) | (z >= level.size.z) | ((*ray).cells >= max_cells) | ((*ray).depth > enough);
}

// Transmittance codes in one word of a light volume; their cells follow one another along z.
const CELLS_A_WORD: i32 = 4;

// Depth in bits (−log₂ T) at which the code of T is 0.
const DARK_BITS: f32 = 18.0;
// Transmittance of a code, over the code's square.
const TRANSMITTANCE_OF_CODE: f32 = 1.0 / 65025.0;

// Code of a transmittance, √T in 255ths, from its depth −log₂ T. The steps of T are finest in the dark.
fn transmittance_code(depth_bits: f32) -> u32 {
    return u32(255.0 * exp2(-0.5 * depth_bits) + 0.5);
}

// Code of the cell in layer `z` of its column, as a number.
fn code_in_word(word: u32, z: i32) -> f32 {
    return f32((word >> u32(8 * (z & 3))) & 0xffu);
}
