// §4 and §5: the walk through the volume's cells under each pixel, and the light they send to the eye.
//
// One invocation a pixel. Twin: src/cpu/integrate.rs, the same operations in the same order; the reasoning
// stands there.

#import engine::integrate_light
#import layout
#import light::fibre
#import light::haze
#import light::optical_depth
#import light::scatter
#import light::strand
#import mapping
#import trace::levels
#import trace::lookup
#import trace::matter
#import volume::cells
#import walk

// None, one, or (2) several.
override LIGHTS: u32 = 1u;
override MARCH: bool = false;
override CACHED: bool = false;
// Light volumes hold codes of transmittances, not optical depths.
override CODES: bool = false;
// Light volumes at the corners of patches.
override CORNERED: bool = false;
// The reflection model of flowing water in place of fibres.
override STRAND: bool = false;
// Light that is scattered more than once.
override MULTIPLE: bool = false;
// A cell's light has a colour of its own.
override IN_COLOUR: bool = STRAND || MULTIPLE;
// Mist has a walk of its own, in which no cell is empty and all shine alike.
override MIST_APART: bool = ERODED & (LIGHTS == 1u) & !MULTIPLE & !TRILINEAR;

@group(0) @binding(0) var<uniform> frame: FrameUniforms;
@group(0) @binding(1) var<storage, read> lights: array<Light>;
@group(0) @binding(2) var<storage, read> quads: array<Quad>;
@group(0) @binding(3) var<uniform> groups: Groups;
@group(0) @binding(4) var volume: texture_storage_3d<rg32uint, read>;
@group(0) @binding(5) var surface: texture_2d<f32>;
@group(0) @binding(6) var quad_id: texture_2d_array<u32>;
@group(0) @binding(7) var opaque_radiance: texture_2d<f32>;
// Sum over samples of radiance, and of transmittance.
@group(0) @binding(8) var<storage, read_write> radiance: array<vec4<f32>>;
// Sum over samples of cells walked by view rays, and by light rays.
@group(0) @binding(9) var<storage, read_write> counts: array<vec2<u32>>;
// Light volumes, src/gpu/visibility.rs, and where each is.
@group(0) @binding(10) var light_volumes: texture_storage_3d<r32uint, read>;
@group(0) @binding(11) var<storage, read> light_places: array<vec4<i32>>;
// Strand model and scattering, src/gpu/reflection.rs.
@group(0) @binding(12) var<uniform> reflection: Reflection;
@group(0) @binding(13) var strand_table: texture_3d<f32>;
@group(0) @binding(14) var linear: sampler;
// P of every material, one profile after the other.
@group(0) @binding(15) var<storage, read> profiles: array<vec4<f32>>;
// Places of workgroups, src/gpu/groups.rs.
@group(0) @binding(16) var<storage, read> group_list: array<u32>;
// Of sparse storage, shaders/cells.wgsl.
@group(0) @binding(17) var bricks: texture_storage_3d<rgba32uint, read>;

// Instead of a number of cells, where the device ended a walk before it was done: software Vulkan grants all loops of a
// pixel 65535 turns.
const CUT: u32 = 0xffffffffu;

struct Reflection {
    strand: Strand,
    similarity: Similarity,
}

@compute @workgroup_size(WORKGROUP, WORKGROUP)
fn integrate(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) local: vec3<u32>) {
    let place = group_list[listed(groups, group.x)];
    let id = vec2<u32>(place & 0xffffu, place >> 16u) * WORKGROUP + local.xy;
    if id.x >= groups.area.width || id.y >= groups.area.height {
        return;
    }
    let pixel = vec2<u32>(groups.area.x, groups.area.y) + id;
    let quad_number = textureLoad(quad_id, pixel, 0u, 0).x;
    let behind = textureLoad(opaque_radiance, pixel, 0).rgb;
    var result = vec4<f32>(behind, 1.0);
    var count = vec2<u32>(0u);
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

// Where no water lies.
@compute @workgroup_size(WORKGROUP, WORKGROUP)
fn dry(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) local: vec3<u32>) {
    let place = group_list[groups.first + group.x];
    let id = vec2<u32>(place & 0xffffu, place >> 16u) * WORKGROUP + local.xy;
    if id.x >= groups.area.width || id.y >= groups.area.height {
        return;
    }
    let pixel = vec2<u32>(groups.area.x, groups.area.y) + id;
    add_sample(pixel, vec4<f32>(textureLoad(opaque_radiance, pixel, 0).rgb, 1.0), vec2<u32>(0u));
}

fn add_sample(pixel: vec2<u32>, sample: vec4<f32>, cells: vec2<u32>) {
    let index = pixel.y * frame.window_width + pixel.x;
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

// One ray on its way: what changes from cell to cell.
struct Ray {
    transmittance: f32,
    t: f32,
    // The lights' sum, in colour with more than one of them or where light has a colour of its own in every cell;
    // else of the one light's share, in x.
    light: vec3<f32>,
    cells: u32,
    light_cells: u32,
    done: bool,
    // Whether a light walk was ended by the device.
    cut: bool,
    // Optical depth so far, in bits; only where light is scattered more than once.
    depth: f32,
}

// What is constant along a ray. The frame's values stand here again because a uniform read inside a loop
// is gathered lane by lane on software Vulkan, about 25 instructions each time.
struct View {
    extinction: f32,
    // Bits of transmittance in one unit of a light volume's depth.
    depth_bits: f32,
    early_end: f32,
    p: f32,
    max_cells: u32,
    // The level that is walked, and where on its face and along which way.
    level: Level,
    origin: vec3<f32>,
    d_cell: vec3<f32>,
    // The model's constants, where they are asked for.
    strand: Strand,
    similarity: Similarity,
    // What the sheet makes of the cells.
    matter: SheetDensity,
    // Whether it leaves empty cells empty; mist does not.
    leaps: bool,
    // Where the quad's profile begins.
    profile: u32,
    // (M₀₀, 2M₀₁, M₁₁, M₂₂), see shading.rs, Metric.
    metric: vec4<f32>,
    e_v: vec3<f32>,
    // The only light's, or those of any.
    light: RayLight,
    lights: u32,
    place: Place,
}

// One sheet: `before` is the radiance of those in front of it, and what they let through.
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
    let jacobian = cell_frame(quad, hit.xy, frame.cells);
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
        view.similarity = reflection.similarity;
    }
    view.place = Place(jacobian, quad.e1, quad.e2, quad.n, side, d_world, frame.eye_world + d_world * hit.z,
        view.e_v, hit.xy, quad_number, frame.texture_frame != 0u, view.similarity.g, frame.cells.z);
    view.lights = arrayLength(&lights);

    // The level whose cells are as large as the sample's footprint lies between two; both are walked.
    var finer = 0.0;
    if PYRAMID {
        finer = clamp(level_at(jacobian, d_world, d_cell, hit.z), 0.0, f32(frame.levels - 1u));
    }
    let share = fract(finer);
    let ways = select(1u, 2u, share > 0.0);
    var end = 0.0;
    var light = vec3<f32>(0.0);
    for (var way = 0u; way < ways; way++) {
        let weight = select(share, 1.0 - share, way == 0u);
        view.level = level_new(frame.cells, u32(finer) + way);
        view.origin = face_point(quad, hit.xy, frame.cells, frame.flow_cells);
        view.d_cell = d_cell;
        view.extinction = frame.extinction;
        view.matter = matter_at(quad, hit.xy, view.level.number > 0u);
        view.leaps = view.matter.shift <= 0.0;
        if PYRAMID {
            view.origin *= view.level.scale;
            view.d_cell *= view.level.scale;
            view.extinction *= select(1.0, view.level.deep, PER_CELL);
        }
        view.depth_bits = view.extinction * view.matter.left * select(jacobian.depth, 1.0, PER_CELL);
        if LIGHTS == 1u {
            view.light = ray_light(0u, view.place, view.level, view.lights);
        }
        var ray = ray_new(before.w);
        if MIST_APART {
            if is_mist(view) {
                walk_mist(view, &ray);
            } else {
                walk_level(view, &ray);
            }
        } else {
            walk_level(view, &ray);
        }
        end += ray.transmittance * weight;
        light += ray.light * weight;
        *count += vec2<u32>(ray.cells, ray.light_cells);
        if ray.cut | !ray.done {
            *count = vec2<u32>(CUT);
        }
    }

    // Σ_k T_k (1 − e^(−τ_k)) = T_before − T_end carries the ambient light.
    let ends = is_last | (end < view.early_end);
    let passed = select(vec3<f32>(0.0), behind * end, ends);
    var color = frame.ambient * (before.w - end) + passed;
    if (LIGHTS == 1u) & IN_COLOUR {
        color += view.light.intensity * light;
    } else if LIGHTS == 1u {
        color += view.light.intensity * (light.x * (1.0 / 255.0));
    } else {
        color += light;
    }
    return vec4<f32>(before.rgb + color, end);
}

// 4^level cells lie across the ray in a sample's footprint, `t` metres away.
fn level_at(jacobian: CellFrame, d_world: vec3<f32>, d_cell: vec3<f32>, t: f32) -> f32 {
    let c = dot3(d_world, frame.forward);
    let area = frame.footprint * (c * c * c) * (t * t);
    let across = area / (abs(jacobian.det) * jacobian.depth * sqrt(dot3(d_cell, d_cell)));
    return 0.5 * log2(max(across, 1e-30));
}

fn ray_new(before: f32) -> Ray {
    var ray: Ray;
    ray.depth = -log2(max(before, 1e-30));
    ray.transmittance = before;
    return ray;
}

// Through one level of the volume, to its end.
fn walk_level(view: View, ray: ptr<function, Ray>) {
    var walk = walk_new(view.level.size, view.origin, view.d_cell);
    // Four cells a turn: the loop's own cost on software Vulkan is a third of a bare step.
    while !(*ray).done {
        if MARCH {
            // Rays of one SIMD group meet occupied cells at different steps; those that found one wait
            // for the others, so that all walk to the light at once.
            var seeking = true;
            while seeking {
                seek(&walk, ray, &seeking, view);
                seek(&walk, ray, &seeking, view);
            }
            visit(&walk, ray, view);
        } else if LIGHTS > 1u {
            // With a loop in it, once: there is little left to gain, and each would be compiled anew.
            visit(&walk, ray, view);
        } else {
            visit(&walk, ray, view);
            visit(&walk, ray, view);
            visit(&walk, ray, view);
            visit(&walk, ray, view);
        }
    }
}

// Goes on by one cell if the one it is in is empty; ends the seeking if not.
fn seek(walk: ptr<function, Walk>, ray: ptr<function, Ray>, seeking: ptr<function, bool>, view: View) {
    var rho = 0.0;
    var texel = vec2<u32>(0u);
    if !TRILINEAR | LEAPS {
        texel = cell_words(in_level((*walk).cell, view.level));
    }
    if TRILINEAR {
        rho = found_between(*walk, *ray, view).rho;
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

// Through mist, to its end.
fn walk_mist(view: View, ray: ptr<function, Ray>) {
    var walk = walk_new(view.level.size, view.origin, view.d_cell);
    while !(*ray).done {
        visit_mist(&walk, ray, view);
        visit_mist(&walk, ray, view);
        visit_mist(&walk, ray, view);
        visit_mist(&walk, ray, view);
    }
}

// What `visit` is to a cell of mist.
fn visit_mist(walk: ptr<function, Walk>, ray: ptr<function, Ray>, view: View) {
    let code = cell_words(in_level((*walk).cell, view.level)).x & 0xffffu;
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

// Half way through the cell the ray is in.
fn found_between(walk: Walk, ray: Ray, view: View) -> CellSample {
    let middle = view.origin + view.d_cell * ((ray.t + walk_exit(walk)) * 0.5);
    return between(view.level, view.matter, walk.cell, middle);
}

// The light of one cell, and the step to the next. Past the end of the walk nothing changes.
fn visit(walk: ptr<function, Walk>, ray: ptr<function, Ray>, view: View) {
    let texel = cell_words(in_level((*walk).cell, view.level));
    var passed_by = 0u;
    if LEAPS {
        passed_by = walk_leap(walk, texel, view.leaps);
    }
    let t_exit = walk_exit(*walk);
    var found: CellSample;
    if TRILINEAR {
        found = found_between(*walk, *ray, view);
    } else {
        found.rho = matter_rho(f32(texel.x & 0xffffu), view.matter);
        found.k_d = f32((texel.x >> 16u) & 0xffu);
        found.k_s = f32(texel.x >> 24u);
        if PYRAMID {
            // Boxes are no moments: their means need not be finite.
            found.moments = moments_of(select(texel.y, 0u, LEAPS & ((texel.x & 0xffffu) == 0u)), view.level);
        }
    }
    let rho = select(found.rho, 0.0, (*ray).done);
    var tau_bits = rho * view.extinction;
    if !PER_CELL {
        tau_bits *= t_exit - (*ray).t;
    }
    let passed = (*ray).transmittance * exp2(-tau_bits);

    var seen: CellShading;
    seen.cell = (*walk).cell;
    seen.occupied = rho > 0.0;
    seen.tau_bits = tau_bits;
    seen.weight = (*ray).transmittance - passed;
    seen.k_d = found.k_d;
    seen.k_s = found.k_s;
    if MANY_DIRECTIONS {
        seen.spread = spread_new(view.metric, found.moments, view.e_v);
    }
    let v = v_code(texel.y);
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
        // What a light is to the ray is worked out again in every cell: arrays indexed in a loop become trees of
        // selects on software Vulkan, which take seconds to compile.
        if seen.occupied {
            for (var i = 0u; i < view.lights; i++) {
                let light = ray_light(i, view.place, view.level, view.lights);
                if IN_COLOUR {
                    (*ray).light += light.intensity * lit_in_colour(seen, light, view, ray);
                } else {
                    (*ray).light += light.intensity * (lit(seen, light, view, ray) * (1.0 / 255.0));
                }
            }
        }
    }
    if MULTIPLE {
        (*ray).depth += tau_bits;
    }

    (*ray).cells += select(1u + passed_by, 0u, (*ray).done);
    if LEAPS {
        (*ray).cells = min((*ray).cells, view.max_cells);
    }
    (*ray).transmittance = passed;
    (*ray).t = t_exit;
    walk_step(walk, true);
    (*ray).done |= ((*walk).cell.z >= view.level.size.z) | (passed < view.early_end)
        | ((*ray).cells >= view.max_cells);
}
