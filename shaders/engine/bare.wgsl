// The bare walk, for `taki bench` only: the rays and cells of the integrate pass with one fetch and one
// addition per cell and no light; with LEAPS it leaps. Its time is a lower bound for the integrate pass. No
// twin.

#import layout
#import mapping
#import volume::cells
#import walk

@group(0) @binding(0) var<uniform> frame: FrameUniforms;
@group(0) @binding(2) var<storage, read> quads: array<Quad>;
@group(0) @binding(3) var<uniform> groups: Groups;
@group(0) @binding(4) var volume: texture_storage_3d<rg32uint, read>;
@group(0) @binding(5) var surface: texture_2d<f32>;
@group(0) @binding(6) var quad_id: texture_2d_array<u32>;
@group(0) @binding(8) var<storage, read_write> radiance: array<vec4<f32>>;
@group(0) @binding(9) var<storage, read_write> counts: array<vec2<u32>>;

@group(0) @binding(16) var<storage, read> group_list: array<u32>;
@group(0) @binding(17) var bricks: texture_storage_3d<rgba32uint, read>;

@compute @workgroup_size(WORKGROUP, WORKGROUP)
fn integrate(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) local: vec3<u32>) {
    let position = group_list[listed(groups, group.x)];
    let id = vec2<u32>(position & 0xffffu, position >> 16u) * WORKGROUP + local.xy;
    if id.x >= groups.area.width || id.y >= groups.area.height {
        return;
    }
    let pixel = vec2<u32>(groups.area.x, groups.area.y) + id;
    let at = image_point(frame, frame.window_x + pixel.x, frame.window_y + pixel.y);
    let d_world = view_ray(frame, frame.window_x + pixel.x, frame.window_y + pixel.y);
    var sum = 0u;
    var n = 0u;
    for (var layer = 0u; layer < frame.layers; layer++) {
        let quad_number = textureLoad(quad_id, pixel, layer, 0).x;
        if quad_number == 0u {
            break;
        }
        var hit = textureLoad(surface, pixel, 0).xyz;
        if layer != 0u {
            hit = quad_hit(quads[quad_number - 1u], at, ray_length(frame, at));
        }
        sheet(quads[quad_number - 1u], hit, d_world, &sum, &n);
    }
    let index = pixel.y * frame.window_width + pixel.x;
    radiance[index] = vec4<f32>(f32(sum), 0.0, 0.0, 1.0);
    counts[index] = vec2<u32>(n, 0u);
}

fn sheet(
    quad: Quad,
    hit: vec3<f32>,
    d_world: vec3<f32>,
    sum: ptr<function, u32>,
    total: ptr<function, u32>,
) {
    let d = view_in_plane(quad, seen_side(quad, d_world), d_world);
    let d_cell = cell_from_plane(cell_frame(quad, hit.xy, frame.cells), d);
    var walk = walk_new(frame.cells, face_point(quad, hit.xy, frame.cells, frame.flow_cells), d_cell);
    var n = 0u;
    var done = false;
    // Software Vulkan would gather uniforms read inside the loop lane by lane.
    let layers = frame.cells.z;
    let max_cells = frame.max_cells;
    while !done {
        visit(&walk, sum, &n, &done, layers, max_cells);
        visit(&walk, sum, &n, &done, layers, max_cells);
        visit(&walk, sum, &n, &done, layers, max_cells);
        visit(&walk, sum, &n, &done, layers, max_cells);
    }
    *total += n;
}

fn visit(
    walk: ptr<function, Walk>,
    sum: ptr<function, u32>,
    n: ptr<function, u32>,
    done: ptr<function, bool>,
    layers: i32,
    max_cells: u32,
) {
    let texel = cell_words((*walk).cell);
    *sum += select(texel.x + texel.y, 0u, *done);
    var skipped = 0u;
    if LEAPS {
        skipped = walk_leap(walk, texel, true);
    }
    *n += select(1u + skipped, 0u, *done);
    if LEAPS {
        *n = min(*n, max_cells);
    }
    walk_step(walk, true);
    *done |= ((*walk).cell.z >= layers) | (*n >= max_cells);
}
