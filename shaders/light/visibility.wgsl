// §5 V_i(k) in light volumes: for every occupied cell, the optical depth from its centre to the point where
// the light ray leaves the slab. One invocation fills one word: up to four cells along z. Twin:
// light_volume_value in src/light/optical_depth.rs; src/light/visibility.rs describes the forms of the
// values.

#import layout
#import light::optical_depth
#import trace::levels
#import trace::matter
#import volume::cells
#import walk

// Whether light volumes store transmittance codes; otherwise they store optical depths.
override CODES: bool = false;
// Whether empty cells are computed too, for rays that interpolate between cells.
override EVERYWHERE: bool = false;

// One light volume, or a part of it.
struct LightVolume {
    direction: vec3<f32>,
    // Columns [first_column, first_column + column_count) of the list.
    first_column: u32,
    // Position in the texture that holds all light volumes.
    offset: vec3<i32>,
    column_count: u32,
    // nx, ny, nz of the volume whose cells are filled.
    cells: vec3<i32>,
    // Bits of transmittance (−log₂ T) per unit of depth.
    bits: f32,
    // Position of the volume's first cell in the texture.
    base: vec3<i32>,
    // Texels of the volume's levels along x and y.
    width: u32,
    height: u32,
}

@group(0) @binding(0) var<uniform> frame: FrameUniforms;
@group(0) @binding(1) var<uniform> light_volume: LightVolume;
@group(0) @binding(2) var volume: texture_storage_3d<rg32uint, read>;
// Linear indices, among the levels of their volume, of the columns (of four cells along z) that contain a
// cell with density.
@group(0) @binding(3) var<storage, read> columns: array<u32>;
@group(0) @binding(4) var light_volumes: texture_storage_3d<r32uint, write>;
// Bricks of sparse storage, see shaders/volume/cells.wgsl.
@group(0) @binding(5) var bricks: texture_storage_3d<rgba32uint, read>;

// Level whose cells lie at (y, z) among the levels of the volume.
fn level_with(size: vec3<i32>, y: i32, z: i32) -> Level {
    let base = light_volume.base;
    var level = level_new(size, base, 0u);
    if PYRAMID {
        if z >= ((size.z + 3) & ~3) {
            level = level_new(size, base, 1u);
            while y >= level.offset.y + level.size.y && level.number < 32u {
                level = level_new(size, base, level.number + 1u);
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
    let max_cells = frame.max_cells;
    let index = columns[light_volume.first_column + id.x];
    let slice_columns = light_volume.width * light_volume.height;
    let x = i32(index % light_volume.width);
    let y = i32((index % slice_columns) / light_volume.width);
    let column = i32(index / slice_columns);
    // All sheets share a light volume, so erosion and mist are left out here.
    let whole = SheetDensity(1.0, 0.0, 0.0, 0.0, 1.0);
    let level = level_with(light_volume.cells, y, column * CELLS_A_WORD);
    let direction = light_volume.direction * level.scale;
    let bits = light_volume.bits * select(1.0, level.deep, PER_CELL);
    let enough = select(NEVER, DARK_BITS / max(bits, 1e-20), CODES);
    var word = 0u;
    for (var i = 0; i < CELLS_A_WORD; i++) {
        let texel = vec3<i32>(x, y, column * CELLS_A_WORD + i);
        let cell = texel - level.offset;
        if any(cell >= level.size) {
            continue;
        }
        if !EVERYWHERE && (cell_words(in_texture(cell, level)).x & 0xffffu) == 0u {
            continue;
        }
        let depth = optical_depth(level, whole, cell, direction, max_cells, enough).depth;
        if CODES {
            word |= transmittance_code(depth * bits) << u32(8 * i);
        } else {
            textureStore(light_volumes, texel + light_volume.offset, vec4<u32>(bitcast<u32>(depth)));
        }
    }
    if CODES {
        textureStore(light_volumes, vec3<i32>(x, y, column) + light_volume.offset, vec4<u32>(word));
    }
}
