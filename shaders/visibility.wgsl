// §5 V_i(k) kept: the optical depth from the centre of every occupied cell to where a light's ray leaves the
// slab. One invocation a cell. Twin: src/cpu/visibility.rs; why and in which units: src/visibility.rs.

override PER_CELL: bool = false;

// One light volume, or a part of it.
struct LightVolume {
    direction: vec3<f32>,
    // The cells [first_cell, first_cell + cell_count) of the list.
    first_cell: u32,
    // Where its cells are in the texture that holds them all.
    offset: vec3<i32>,
    cell_count: u32,
}

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> light_volume: LightVolume;
@group(0) @binding(2) var volume: texture_storage_3d<rg32uint, read>;
// Linear indices of the cells with density.
@group(0) @binding(3) var<storage, read> occupied: array<u32>;
@group(0) @binding(4) var depths: texture_storage_3d<r32float, write>;

struct DepthWalk {
    depth: f32,
    t: f32,
    cells: u32,
    done: bool,
}

fn optical_depth(cell: vec3<i32>, direction: vec3<f32>, layers: i32, max_cells: u32) -> f32 {
    var ray: DepthWalk;
    var walk = walk_new(frame.cells, vec3<f32>(cell) + 0.5, direction);
    while !ray.done {
        visit_depth(&walk, &ray, layers, max_cells);
        visit_depth(&walk, &ray, layers, max_cells);
        visit_depth(&walk, &ray, layers, max_cells);
        visit_depth(&walk, &ray, layers, max_cells);
    }
    return ray.depth * (1.0 / 65535.0);
}

fn visit_depth(walk: ptr<function, Walk>, ray: ptr<function, DepthWalk>, layers: i32, max_cells: u32) {
    let t_exit = walk_exit(*walk);
    let rho = f32(textureLoad(volume, (*walk).cell).x & 0xffffu);
    if PER_CELL {
        // The cell itself does not hide its own light.
        (*ray).depth += select(rho, 0.0, (*ray).done | ((*ray).cells == 0u));
    } else {
        (*ray).depth += select(rho * (t_exit - (*ray).t), 0.0, (*ray).done);
    }
    (*ray).cells += select(1u, 0u, (*ray).done);
    (*ray).t = t_exit;
    walk_step(walk, true);
    let z = (*walk).cell.z;
    (*ray).done |= (z < 0) | (z >= layers) | ((*ray).cells >= max_cells);
}

@compute @workgroup_size(64)
fn visibility(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= light_volume.cell_count {
        return;
    }
    let index = occupied[light_volume.first_cell + id.x];
    let size = vec3<u32>(frame.cells);
    let cell = vec3<i32>(vec3<u32>(index % size.x, (index / size.x) % size.y, index / (size.x * size.y)));
    let depth = optical_depth(cell, light_volume.direction, frame.cells.z, frame.max_cells);
    textureStore(depths, cell + light_volume.offset, vec4<f32>(depth, 0.0, 0.0, 0.0));
}
