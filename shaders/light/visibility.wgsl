// §5 V_i(k) kept: for every occupied cell, what lies between its centre and where a light's ray leaves the
// slab. One invocation a column of cells along z. Twin: src/engine/cpu/visibility.rs. Reasons and form:
// src/light/visibility.rs.

#import layout
#import light::optical_depth
#import trace::levels
#import trace::matter
#import volume::cells
#import walk

// Whether codes of transmittances are kept, or optical depths.
override CODES: bool = false;
// Of empty cells too, for rays that look between cells.
override EVERYWHERE: bool = false;

// One light volume, or a part of it.
struct LightVolume {
    direction: vec3<f32>,
    // The columns [first_column, first_column + column_count) of the list.
    first_column: u32,
    // Where it is in the texture that holds them all.
    offset: vec3<i32>,
    column_count: u32,
    // Bits of transmittance in one unit of optical depth.
    bits: f32,
}

@group(0) @binding(0) var<uniform> frame: FrameUniforms;
@group(0) @binding(1) var<uniform> light_volume: LightVolume;
@group(0) @binding(2) var volume: texture_storage_3d<rg32uint, read>;
// Linear indices of the columns in which any cell has density.
@group(0) @binding(3) var<storage, read> columns: array<u32>;
@group(0) @binding(4) var light_volumes: texture_storage_3d<r32uint, write>;
// Of sparse storage, shaders/volume/cells.wgsl.
@group(0) @binding(5) var bricks: texture_storage_3d<rgba32uint, read>;

// The level that has cells at (y, z) of the texture.
fn level_with(size: vec3<i32>, y: i32, z: i32) -> Level {
    var level = level_new(size, 0u);
    if PYRAMID {
        if z >= ((size.z + 3) & ~3) {
            level = level_new(size, 1u);
            while y >= level.offset.y + level.size.y && level.number < 32u {
                level = level_new(size, level.number + 1u);
            }
        }
    }
    return level;
}

@compute @workgroup_size(64)
fn visibility(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= light_volume.column_count {
        return;
    }
    var extent = frame.cells;
    if !SPARSE {
        extent = vec3<i32>(textureDimensions(volume));
    }
    let max_cells = frame.max_cells;
    let index = columns[light_volume.first_column + id.x];
    let of_slice = u32(extent.x * extent.y);
    let x = i32(index % u32(extent.x));
    let y = i32((index % of_slice) / u32(extent.x));
    let column = i32(index / of_slice);
    // Sheets of one volume share a light volume, whatever they make of it.
    let whole = SheetDensity(1.0, 0.0, 0.0, 0.0, 1.0);
    let level = level_with(frame.cells, y, column * CELLS_A_WORD);
    let direction = light_volume.direction * level.scale;
    let bits = light_volume.bits * select(1.0, level.deep, PER_CELL);
    let enough = select(NEVER, DARK_BITS / max(bits, 1e-20), CODES);
    var word = 0u;
    for (var i = 0; i < CELLS_A_WORD; i++) {
        let place = vec3<i32>(x, y, column * CELLS_A_WORD + i);
        let cell = place - level.offset;
        if any(cell >= level.size) || (!EVERYWHERE && (cell_words(place).x & 0xffffu) == 0u) {
            continue;
        }
        let depth = optical_depth(level, whole, cell, direction, max_cells, enough).depth;
        if CODES {
            word |= transmittance_code(depth * bits) << u32(8 * i);
        } else {
            textureStore(light_volumes, place + light_volume.offset, vec4<u32>(bitcast<u32>(depth)));
        }
    }
    if CODES {
        textureStore(light_volumes, vec3<i32>(x, y, column) + light_volume.offset, vec4<u32>(word));
    }
}
