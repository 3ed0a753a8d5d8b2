// §4 and §5: the walk through the volume's cells under each pixel, and the light that they send to the eye.
//
// One invocation per pixel. Twin: src/engine/cpu/integrate.rs and integrate/walk.rs, with the same operations
// in the same order; they hold the reasoning.

#import engine::integrate_light
#import engine::integrate_shell
#import engine::integrate_strands
#import engine::shell_scatter
#import layout
#import light::fibre
#import light::haze
#import light::optics
#import light::optical_depth
#import light::ramp
#import light::scatter
#import light::strand
#import mapping
#import mapping::shell
#import trace::billow
#import trace::levels
#import trace::lines
#import trace::lookup
#import trace::matter
#import trace::tear
#import volume::cells
#import walk

// Number of lights: 0, 1, or 2 for several.
override LIGHTS: u32 = 1u;
override MARCH: bool = false;
override CACHED: bool = false;
// Light volumes hold codes of transmittances, not optical depths.
override CODES: bool = false;
// Light volumes stand at the corners of patches.
override CORNERED: bool = false;
// Whether rays walk to a light in some patches, because it is too close for light volumes.
override MARCHED: bool = false;
// The strand model of flowing water and hair replaces fibres.
override STRAND: bool = false;
// Whether other volumes beside them reflect as Kajiya and Kay's fibres do.
override FIBRES_TOO: bool = false;
// The strands are hairs, whose colour the ambient light takes.
override HAIR: bool = false;
// Light is scattered more than once.
override MULTIPLE: bool = false;
// A cell's light has a colour of its own.
override IN_COLOUR: bool = STRAND || MULTIPLE || COLORED;
// The water moves while the shutter is open.
override SHUTTER: bool = false;
// The picture has an alpha channel.
override ALPHA: bool = false;
// Mist has its own walk, in which no cell is empty and all reflect alike.
override MIST_APART: bool = ERODED & (LIGHTS == 1u) & !MULTIPLE & !TRILINEAR;

@group(0) @binding(0) var<uniform> frame: FrameUniforms;
@group(0) @binding(1) var<storage, read> lights: array<Light>;
@group(0) @binding(2) var<storage, read> quads: array<Quad>;
@group(0) @binding(3) var<uniform> groups: Groups;
@group(0) @binding(4) var volume: texture_storage_3d<rg32uint, read>;
@group(0) @binding(5) var surface: texture_2d<f32>;
@group(0) @binding(6) var quad_id: texture_2d_array<u32>;
@group(0) @binding(7) var opaque_radiance: texture_2d<f32>;
// Sums over samples of radiance and transmittance.
@group(0) @binding(8) var<storage, read_write> radiance: array<vec4<f32>>;
// Sums over samples of cells walked by view rays and by light rays.
@group(0) @binding(9) var<storage, read_write> counts: array<vec2<u32>>;
// Light volumes, and the table of their origins: FilledVolumes of src/engine/gpu/visibility.rs.
@group(0) @binding(10) var light_volumes: texture_storage_3d<r32uint, read>;
@group(0) @binding(11) var<storage, read> light_places: array<vec4<i32>>;
// Strand model and scattering: src/engine/gpu/reflection.rs.
@group(0) @binding(12) var<uniform> reflection: Reflection;
@group(0) @binding(13) var strand_table: texture_3d<f32>;
@group(0) @binding(14) var linear: sampler;
// Profiles of multiple scattering, one after the other.
@group(0) @binding(15) var<storage, read> profiles: array<vec4<f32>>;
// Positions of workgroups: src/engine/gpu/groups.rs.
@group(0) @binding(16) var<storage, read> group_list: array<u32>;
// Bricks of sparse storage: shaders/volume/cells.wgsl.
@group(0) @binding(17) var bricks: texture_storage_3d<rgba32uint, read>;
// Normal of the opaque scene, and in w the share of a backdrop behind it that shows.
@group(0) @binding(18) var opaque_normal: texture_2d<f32>;
// Sums over samples of the share of a backdrop that shows through the whole scene: 1 − alpha.
@group(0) @binding(19) var<storage, read_write> uncovered: array<f32>;
// Constants of the volumes, if there are several. A single volume has those of `frame` and `reflection`.
@group(0) @binding(20) var<uniform> volumes: array<VolumeConstants, MAX_VOLUMES>;
// Shells: src/engine/gpu/shells.rs. V at their vertices.
@group(0) @binding(21) var shells: texture_2d<u32>;
@group(0) @binding(22) var shell_light: texture_2d<f32>;

// Largest number of volumes. Twin: MAX_VOLUMES of src/scene/volumes.rs.
const MAX_VOLUMES: u32 = 64u;

// Marker in place of the numbers of cells if the device ended a walk early: software Vulkan limits all loops
// of a pixel to 65535 turns. Twin: CUT of src/engine/gpu/integrate.rs.
const CUT: u32 = 0xffffffffu;

struct Reflection {
    strand: Strand,
    similarity: Similarity,
    ramp: Ramp,
    optics: Optics,
    // Ambient light that hairs send on.
    ambient: vec3<f32>,
    pad: f32,
}

struct VolumeConstants {
    // nx, ny, nz.
    cells: vec3<i32>,
    // As in `frame`.
    extinction: f32,
    // Position of the first cell in the texture.
    base: vec3<i32>,
    flow_cells: f32,
    similarity: Similarity,
    ramp: Ramp,
    optics: Optics,
    levels: u32,
    // Whether its cells reflect as strands do.
    strands: u32,
    // Whether its cells keep the lines of their strands.
    lines: u32,
    // As in `frame`.
    flow_moves: f32,
}

// Time of the pixel's sample: see shutter_time.
var<private> sample_time: f32;

// Whether the cells of a volume reflect as strands do, in a scene where any do.
fn is_strand(own: VolumeConstants) -> bool {
    return !FIBRES_TOO || own.strands != 0u;
}

// Level that a ray through a quad walks, from the one whose cells are as large as its sample's footprint.
// Twin: StrandTurn::level of src/trace/lookup.rs.
fn walked_level(level: f32, own: VolumeConstants, quad: Quad) -> f32 {
    let cells = clamp(level, 0.0, f32(own.levels - 1u));
    if !LINES {
        return cells;
    }
    let keeps_lines = (!SEVERAL || own.lines != 0u) && quad.mist == 0.0;
    let in_turn = level * frame.strand_scale + frame.strand_shift;
    return select(cells, max(in_turn, f32(STRANDS)), keeps_lines && in_turn < 0.0);
}

// Ambient light that cells send on: all of it, as mist and fibres do, or the hair's share.
fn ambient_of(is_all: bool) -> vec3<f32> {
    if HAIR {
        return select(reflection.ambient, frame.ambient, is_all);
    }
    return frame.ambient;
}

// Constants of the volume with this number, at the time of the sample.
fn volume_of(number: u32) -> VolumeConstants {
    if SEVERAL {
        if SHUTTER {
            var moved = volumes[number];
            moved.flow_cells += sample_time * moved.flow_moves;
            return moved;
        }
        return volumes[number];
    }
    var only: VolumeConstants;
    only.cells = frame.cells;
    only.extinction = frame.extinction;
    only.flow_cells = frame.flow_cells;
    if SHUTTER {
        only.flow_cells += sample_time * frame.flow_moves;
    }
    only.levels = frame.levels;
    if IN_COLOUR {
        only.similarity = reflection.similarity;
        only.ramp = reflection.ramp;
    }
    if SHELL_SCATTER {
        only.optics = reflection.optics;
    }
    return only;
}

@compute @workgroup_size(WORKGROUP, WORKGROUP)
fn integrate(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) local: vec3<u32>) {
    let position = group_list[listed(groups, group.x)];
    let id = vec2<u32>(position & 0xffffu, position >> 16u) * WORKGROUP + local.xy;
    if id.x >= groups.area.width || id.y >= groups.area.height {
        return;
    }
    let pixel = vec2<u32>(groups.area.x, groups.area.y) + id;
    let quad_number = textureLoad(quad_id, pixel, 0u, 0).x;
    let behind = textureLoad(opaque_radiance, pixel, 0).rgb;
    var result = vec4<f32>(behind, 1.0);
    var count = vec2<u32>(0u);
    if SHUTTER {
        sample_time = shutter_time(frame, frame.window_x + pixel.x, frame.window_y + pixel.y);
    }
    if quad_number != 0u {
        result = sheets(quad_number, pixel, behind, &count);
        if frame.haze_density != 0.0 {
            let d_world = view_ray(frame, frame.window_x + pixel.x, frame.window_y + pixel.y);
            let t = textureLoad(surface, pixel, 0).z;
            result = haze_over_water(frame, result, behind, d_world.y, t);
        }
    }
    add_sample(pixel, result, count);
}

// Adds a sample of the opaque scene in workgroups without water.
@compute @workgroup_size(WORKGROUP, WORKGROUP)
fn dry(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) local: vec3<u32>) {
    let position = group_list[groups.first + group.x];
    let id = vec2<u32>(position & 0xffffu, position >> 16u) * WORKGROUP + local.xy;
    if id.x >= groups.area.width || id.y >= groups.area.height {
        return;
    }
    let pixel = vec2<u32>(groups.area.x, groups.area.y) + id;
    add_sample(pixel, vec4<f32>(textureLoad(opaque_radiance, pixel, 0).rgb, 1.0), vec2<u32>(0u));
}

// Adds a sample to the sums of a pixel; the first sample begins them.
fn add_sample(pixel: vec2<u32>, sample: vec4<f32>, cells: vec2<u32>) {
    let index = pixel.y * frame.window_width + pixel.x;
    if ALPHA {
        let shows = sample.w * textureLoad(opaque_normal, pixel, 0).w;
        uncovered[index] = shows + select(0.0, uncovered[index], frame.sample_index != 0u);
    }
    var result = sample;
    var count = cells;
    if frame.sample_index != 0u {
        result += radiance[index];
        let before = counts[index];
        count = select(count + before, vec2<u32>(CUT), (count.x == CUT) | (before.x == CUT));
    }
    radiance[index] = result;
    counts[index] = count;
}

// Traces the face number `number` of the raster pass: a quad, or one of a shell's hull, which needs neither
// `quad` nor `hit`. The arguments are those of `trace`.
fn trace_face(
    quad: Quad,
    number: u32,
    pixel: vec2<u32>,
    hit: vec3<f32>,
    behind: vec3<f32>,
    before: vec4<f32>,
    is_last: bool,
    count: ptr<function, vec2<u32>>,
) -> vec4<f32> {
    if SHELLS {
        if !QUADS {
            return trace_shell(number, pixel, behind, before, is_last, count);
        }
        if number >= first_hull_face() {
            return trace_shell(number, pixel, behind, before, is_last, count);
        }
    }
    return trace(quad, number, pixel, hit, behind, before, is_last, count);
}

// State of a ray that changes from cell to cell.
struct Ray {
    transmittance: f32,
    t: f32,
    // Light sent to the eye so far. With several lights, their sum in colour. With one light, relative to its
    // intensity: in colour if a cell's light has a colour of its own, otherwise in x, in 255ths.
    light: vec3<f32>,
    cells: u32,
    light_cells: u32,
    done: bool,
    // Whether the device ended a light walk early.
    cut: bool,
    // Optical depth so far, in bits; only if light is scattered more than once.
    depth: f32,
    // Colour that the cells give to the ambient light, minus that of white ones.
    tint: vec3<f32>,
}

// Values that are constant along a ray. The frame's uniforms are copied here because software Vulkan gathers
// a uniform that is read inside a loop lane by lane, with about 25 instructions each time.
struct View {
    extinction: f32,
    // Bits of transmittance in one unit of a light volume's depth.
    depth_bits: f32,
    early_end: f32,
    p: f32,
    max_cells: u32,
    // The level that is walked, and the ray's origin on its face and direction in its cells.
    level: Level,
    origin: vec3<f32>,
    d_cell: vec3<f32>,
    // Constants of the strand model and of multiple scattering, if the scene uses them.
    strand: Strand,
    // Whether the cells reflect as strands do, where any do.
    is_strand: bool,
    similarity: Similarity,
    // Colours of the cells.
    ramp: Ramp,
    // The sheet's erosion and mist.
    matter: SheetDensity,
    // Whether the sheet leaves empty cells empty; mist does not.
    leaps: bool,
    // Index at which the quad's profile begins.
    profile: u32,
    // (M₀₀, 2M₀₁, M₁₁, M₂₂): Metric of src/light/fibre.rs.
    metric: vec4<f32>,
    e_v: vec3<f32>,
    // Terms of the only light, if there is one.
    light: RayLight,
    // Number of lights.
    lights: u32,
    hit: SheetHit,
}

// Traces one sheet. `before` is the radiance of the sheets in front of it, and their transmittance.
fn trace(
    quad: Quad,
    quad_number: u32,
    pixel: vec2<u32>,
    hit: vec3<f32>,
    behind: vec3<f32>,
    before: vec4<f32>,
    is_last: bool,
    count: ptr<function, vec2<u32>>,
) -> vec4<f32> {
    let own = volume_of(quad.volume);
    let jacobian = cell_frame(quad, hit.xy, own.cells);
    let d_world = view_ray(frame, frame.window_x + pixel.x, frame.window_y + pixel.y);
    let side = seen_side(quad, d_world);
    let d = view_in_plane(quad, side, d_world);
    let d_cell = cell_from_plane(jacobian, d);

    var view: View;
    view.early_end = frame.early_end;
    view.p = frame.p;
    view.max_cells = frame.max_cells;
    view.profile = quad.profile;
    let cx = jacobian.cx;
    let cy = jacobian.cy;
    let depth = jacobian.depth;
    view.metric = vec4<f32>(dot2(cx, cx), 2.0 * dot2(cx, cy), dot2(cy, cy), depth * depth);
    view.e_v = -transposed(jacobian, d);
    if frame.texture_frame != 0u {
        view.metric = vec4<f32>(1.0, 0.0, 1.0, 1.0);
        view.e_v = -d_cell / sqrt(dot3(d_cell, d_cell));
    }
    if IN_COLOUR {
        view.strand = reflection.strand;
        view.is_strand = is_strand(own);
        view.similarity = scatter_similarity(own.similarity, quad.mist);
    }
    if COLORED {
        view.ramp = own.ramp;
    }
    var column: GainColumn;
    if MULTIPLE {
        column = scatter_column(slab_cosine(d.z, -d_cell));
    }
    view.hit = SheetHit(jacobian, quad.e1, quad.e2, quad.n, side, d_world, point_world(quad, hit.xy),
        view.e_v, hit.xy, quad_number, frame.texture_frame != 0u, view.similarity.g, own.cells.z,
        view.profile, column, light_left(quad, hit.xy));
    view.lights = arrayLength(&lights);

    // The level whose cells match the sample's footprint lies between two levels; both are walked.
    var finer = 0.0;
    var seen_level = 0.0;
    if PYRAMID | LINES {
        seen_level = level_at(jacobian, d_world, d_cell, hit.z);
        finer = walked_level(seen_level, own, quad);
    }
    let on_face = face_point(quad, hit.xy, own.cells, own.flow_cells);
    var torn = 0.0;
    if TEARS {
        let cells = vec2<f32>(own.cells.xy);
        torn = tear_erosion(quad, hit.xy, on_face.xy / cells, cells.x, seen_level);
    }
    let share = fract(finer);
    let walks = select(1u, 2u, share > 0.0);
    var end = 0.0;
    var light = vec3<f32>(0.0);
    var tint = vec3<f32>(0.0);
    var i = 0u;
    for (; i < walks; i++) {
        let weight = select(share, 1.0 - share, i == 0u);
        let number = i32(floor(finer)) + i32(i);
        view.level = level_new(own.cells, own.base, u32(max(number, 0)));
        view.origin = on_face;
        view.d_cell = d_cell;
        view.extinction = own.extinction;
        view.matter = matter_at(quad, hit.xy, torn, view.level.number > 0u);
        if BILLOWS && quad.mist > 0.0 {
            let factor = billow_factor(quad.billow, frame.billow, view.hit.point);
            view.matter.scale *= factor;
            view.matter.shift *= factor;
        }
        view.leaps = view.matter.shift <= 0.0;
        if PYRAMID {
            view.origin *= view.level.scale;
            view.d_cell *= view.level.scale;
            view.extinction *= select(1.0, view.level.deep, PER_CELL);
        }
        view.depth_bits = view.extinction * view.matter.left * select(jacobian.depth, 1.0, PER_CELL);
        if LIGHTS == 1u {
            view.light = ray_light(0u, view.hit, view.level, view.lights);
        }
        var ray = ray_new(before.w);
        if MIST_APART && is_mist(view) {
            walk_mist(view, &ray);
        } else if LINES && number == STRANDS {
            walk_strands(view, &ray);
        } else {
            walk_level(view, &ray);
        }
        end += ray.transmittance * weight;
        light += ray.light * weight;
        tint += ray.tint * weight;
        *count += vec2<u32>(ray.cells, ray.light_cells);
        if ray.cut | !ray.done {
            *count = vec2<u32>(CUT);
        }
    }
    // The device ends this loop too.
    if i < walks {
        *count = vec2<u32>(CUT);
    }

    // The weights of the ambient light add up: Σ_k T_k (1 − e^(−τ_k)) = T_before − T_end.
    let ends = is_last | (end < view.early_end);
    let passed = select(vec3<f32>(0.0), behind * end, ends);
    let sky_left = view.hit.left.sky;
    var color = ambient_of((quad.mist > 0.0) | !is_strand(own)) * sky_left * (before.w - end) + passed;
    if COLORED {
        color += frame.ambient * sky_left * tint;
    }
    if (LIGHTS == 1u) & IN_COLOUR {
        color += view.light.intensity * light;
    } else if LIGHTS == 1u {
        color += view.light.intensity * (light.x * (1.0 / 255.0));
    } else {
        color += light;
    }
    return vec4<f32>(before.rgb + color, end);
}

// Level at which one cell fills a sample's footprint across the ray, `t` metres from the eye: 4^level cells
// of the volume lie in it. Twin: level_at of src/trace/lookup.rs.
fn level_at(jacobian: CellFrame, d_world: vec3<f32>, d_cell: vec3<f32>, t: f32) -> f32 {
    let c = dot3(d_world, frame.forward);
    let area = frame.footprint * (c * c * c) * (t * t);
    let across = area / (abs(jacobian.det) * jacobian.depth * sqrt(dot3(d_cell, d_cell)));
    return 0.5 * log2(max(across, 1e-30));
}

// A ray at the face of a sheet, with the transmittance `before`.
fn ray_new(before: f32) -> Ray {
    var ray: Ray;
    ray.depth = -log2(max(before, 1e-30));
    ray.transmittance = before;
    return ray;
}

// Walks one level of the volume to the end of the slab or of the ray.
fn walk_level(view: View, ray: ptr<function, Ray>) {
    var walk = walk_new(view.level.size, view.origin, view.d_cell);
    // Four cells per turn: on software Vulkan the loop itself costs a third of a bare step.
    while !(*ray).done {
        if MARCH {
            // Rays of one SIMD group meet occupied cells at different steps. Those that have found one wait
            // for the others, so that all walk to the light at once.
            var seeking = true;
            while seeking {
                seek(&walk, ray, &seeking, view);
                seek(&walk, ray, &seeking, view);
            }
            visit(&walk, ray, view);
        } else if LIGHTS > 1u {
            // Once per turn: `visit` contains a loop, so unrolling gains little, and every call is compiled
            // again.
            visit(&walk, ray, view);
        } else {
            visit(&walk, ray, view);
            visit(&walk, ray, view);
            visit(&walk, ray, view);
            visit(&walk, ray, view);
        }
    }
}

// Steps to the next cell if the current one is empty; otherwise ends the seeking.
fn seek(walk: ptr<function, Walk>, ray: ptr<function, Ray>, seeking: ptr<function, bool>, view: View) {
    var rho = 0.0;
    var texel = vec2<u32>(0u);
    if !TRILINEAR | LEAPS {
        texel = cell_words(in_texture((*walk).cell, view.level));
    }
    if TRILINEAR {
        rho = sample_on_ray(*walk, *ray, view).rho;
    } else {
        rho = matter_rho(f32(texel.x & 0xffffu), view.matter);
    }
    let empty = rho == 0.0;
    let on = *seeking & empty & !(*ray).done;
    (*ray).cells += select(0u, 1u, on);
    if LEAPS {
        (*ray).cells = min((*ray).cells + walk_leap(walk, texel, on & view.leaps), view.max_cells);
    }
    (*ray).t = select((*ray).t, walk_exit(*walk), on);
    walk_step(walk, on);
    (*ray).done |= ((*walk).cell.z >= view.level.size.z) | ((*ray).cells >= view.max_cells);
    *seeking = on & !(*ray).done;
}

// Walks mist to the end of the slab or of the ray.
fn walk_mist(view: View, ray: ptr<function, Ray>) {
    var walk = walk_new(view.level.size, view.origin, view.d_cell);
    while !(*ray).done {
        visit_mist(&walk, ray, view);
        visit_mist(&walk, ray, view);
        visit_mist(&walk, ray, view);
        visit_mist(&walk, ray, view);
    }
}

// As `visit`, for a cell of mist.
fn visit_mist(walk: ptr<function, Walk>, ray: ptr<function, Ray>, view: View) {
    let code = cell_words(in_texture((*walk).cell, view.level)).x & 0xffffu;
    let t_exit = walk_exit(*walk);
    let rho = select(matter_rho(f32(code), view.matter), 0.0, (*ray).done);
    var tau_bits = rho * view.extinction;
    if !PER_CELL {
        tau_bits *= t_exit - (*ray).t;
    }
    let passed = (*ray).transmittance * exp2(-tau_bits);
    let weight = (*ray).transmittance - passed;
    var visible = 1.0;
    if MARCH | CACHED {
        visible = exp2(-select(0.0, mist_depth((*walk).cell.z, view.light.l_cell, view), rho > 0.0));
    }
    if IN_COLOUR {
        (*ray).light += weight * visible * view.matter.mist * (1.0 / 255.0);
    } else {
        (*ray).light.x += weight * view.matter.mist * visible;
    }
    (*ray).cells += select(1u, 0u, (*ray).done);
    (*ray).transmittance = passed;
    (*ray).t = t_exit;
    walk_step(walk, true);
    (*ray).done |= ((*walk).cell.z >= view.level.size.z) | (passed < view.early_end)
        | ((*ray).cells >= view.max_cells);
}

// Sample between cells, half way along the ray through the current cell.
fn sample_on_ray(walk: Walk, ray: Ray, view: View) -> CellSample {
    let middle = view.origin + view.d_cell * ((ray.t + walk_exit(walk)) * 0.5);
    return sample_trilinear(view.level, view.matter, walk.cell, middle, false);
}

// Adds the light of one cell and steps to the next. After the end of the walk, nothing changes.
fn visit(walk: ptr<function, Walk>, ray: ptr<function, Ray>, view: View) {
    let texel = cell_words(in_texture((*walk).cell, view.level));
    var skipped = 0u;
    if LEAPS {
        skipped = walk_leap(walk, texel, view.leaps);
    }
    let t_exit = walk_exit(*walk);
    var sample: CellSample;
    if TRILINEAR {
        sample = sample_on_ray(*walk, *ray, view);
    } else {
        sample.rho = matter_rho(f32(texel.x & 0xffffu), view.matter);
        sample.k_d = f32((texel.x >> 16u) & 0xffu);
        sample.k_s = f32(texel.x >> 24u);
        if PYRAMID {
            // The word of an empty cell holds a box, not moments; means computed from it need not be finite.
            sample.moments = moments_of(select(texel.y, 0u, LEAPS & ((texel.x & 0xffffu) == 0u)), view.level);
        }
    }
    let rho = select(sample.rho, 0.0, (*ray).done);
    var tau_bits = rho * view.extinction;
    if !PER_CELL {
        tau_bits *= t_exit - (*ray).t;
    }
    let passed = (*ray).transmittance * exp2(-tau_bits);

    let weight = (*ray).transmittance - passed;
    light_cell((*walk).cell, texel.y, sample, vec2<f32>(tau_bits, weight), rho > 0.0, view, ray);
    if MULTIPLE {
        (*ray).depth += tau_bits;
    }

    (*ray).cells += select(1u + skipped, 0u, (*ray).done);
    if LEAPS {
        (*ray).cells = min((*ray).cells, view.max_cells);
    }
    (*ray).transmittance = passed;
    (*ray).t = t_exit;
    walk_step(walk, true);
    (*ray).done |= ((*walk).cell.z >= view.level.size.z) | (passed < view.early_end)
        | ((*ray).cells >= view.max_cells);
}

// Adds the light of a cell. `hides` is its optical depth, and T before the cell minus T behind it;
// `direction` is its second word.
fn light_cell(
    cell: vec3<i32>,
    direction: u32,
    sample: CellSample,
    hides: vec2<f32>,
    occupied: bool,
    view: View,
    ray: ptr<function, Ray>,
) {
    var seen: CellShading;
    seen.cell = cell;
    seen.occupied = occupied;
    seen.tau_bits = hides.x;
    seen.weight = hides.y;
    seen.k_d = sample.k_d;
    seen.k_s = sample.k_s;
    if COLORED {
        if !is_mist(view) {
            let ink = ramp_ink(view.ramp, sample.k_s);
            seen.k_s = ink.w;
            seen.color = ink.rgb;
            (*ray).tint += (ink.rgb - 1.0) * seen.weight;
        }
    }
    if MANY_DIRECTIONS {
        seen.spread = spread_new(view.metric, sample.moments, view.e_v);
    }
    let v = v_code(direction);
    let m = view.metric;
    let q = (m.x * v.x + m.y * v.y) * v.x + m.z * v.y * v.y + m.w * v.z * v.z;
    let inverse_q = 1.0 / max(q, 1e-30);
    seen.v = v;
    seen.t_dot_e = dot3(v, view.e_v);
    seen.sin2_e = max(1.0 - seen.t_dot_e * seen.t_dot_e * inverse_q, 0.0);
    seen.inverse_q = inverse_q;
    if (LIGHTS == 1u) & IN_COLOUR {
        (*ray).light += lit_in_colour(seen, view.light, view, ray);
    } else if LIGHTS == 1u {
        (*ray).light.x += lit(seen, view.light, view, ray);
    } else if LIGHTS > 1u {
        // The terms of a light are recomputed in every cell: on software Vulkan an array indexed in a loop
        // becomes a tree of selects that takes seconds to compile.
        if seen.occupied {
            var i = 0u;
            for (; i < view.lights; i++) {
                let light = ray_light(i, view.hit, view.level, view.lights);
                if IN_COLOUR {
                    (*ray).light += light.intensity * lit_in_colour(seen, light, view, ray);
                } else {
                    (*ray).light += light.intensity * (lit(seen, light, view, ray) * (1.0 / 255.0));
                }
            }
            (*ray).cut |= i < view.lights;
        }
    }
}
