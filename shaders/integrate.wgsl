// §4 and §5: the walk through the volume's cells under each pixel, and the light they send to the eye.
//
// One invocation a pixel. Twin: src/cpu/integrate.rs, the same operations in the same order; the reasoning
// stands there.

// Most lights of one walk: rays keep what they need to know of each, and are walked again for more.
const LIGHTS_A_WALK: u32 = 16u;

override LIGHTS: u32 = 1u;
override PER_CELL: bool = false;
override MARCH: bool = false;
override CACHED: bool = false;
// Light volumes at the corners of patches.
override CORNERED: bool = false;
// The reflection model of flowing water in place of fibres.
override STRAND: bool = false;
// Light that is scattered more than once.
override MULTIPLE: bool = false;

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> lights: array<Light>;
@group(0) @binding(2) var<storage, read> quads: array<Quad>;
@group(0) @binding(3) var<uniform> tile: Tile;
@group(0) @binding(4) var volume: texture_storage_3d<rg32uint, read>;
@group(0) @binding(5) var surface: texture_2d<f32>;
@group(0) @binding(6) var quad_id: texture_2d_array<u32>;
@group(0) @binding(7) var opaque_radiance: texture_2d<f32>;
// Sum over samples of radiance, and of transmittance.
@group(0) @binding(8) var<storage, read_write> radiance: array<vec4<f32>>;
// Sum over samples of cells walked by view rays, and by light rays.
@group(0) @binding(9) var<storage, read_write> counts: array<vec2<u32>>;
// Light volumes, src/gpu/visibility.rs: optical depths, and where each light volume is.
@group(0) @binding(10) var light_depths: texture_storage_3d<r32float, read>;
@group(0) @binding(11) var<storage, read> light_places: array<vec4<i32>>;
// Strand model and scattering, src/gpu/reflection.rs.
@group(0) @binding(12) var<uniform> reflection: Reflection;
@group(0) @binding(13) var strand_table: texture_3d<f32>;
@group(0) @binding(14) var linear: sampler;
// P of every material, one profile after the other.
@group(0) @binding(15) var<storage, read> profiles: array<vec4<f32>>;

struct Reflection {
    strand: Strand,
    similarity: Similarity,
}

@compute @workgroup_size(WORKGROUP, WORKGROUP)
fn integrate(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= tile.width || id.y >= tile.height {
        return;
    }
    let pixel = vec2<u32>(tile.x + id.x, tile.y + id.y);
    let index = pixel.y * frame.window_width + pixel.x;
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
    if frame.sample_index != 0u {
        result += radiance[index];
        count += counts[index];
    }
    radiance[index] = result;
    counts[index] = count;
}

// One ray on its way: what changes from cell to cell.
struct Ray {
    transmittance: f32,
    t: f32,
    // The first light's sum lives apart from the others': indexed arrays cost a tenth of the pass.
    first: f32,
    cells: u32,
    light_cells: u32,
    done: bool,
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
    layers: i32,
    // The model's constants, where they are asked for.
    strand: Strand,
    similarity: Similarity,
    // Lights of this walk.
    lights: u32,
    // Where the quad's profile begins.
    profile: u32,
    // (M₀₀, 2M₀₁, M₁₁, M₂₂), see shading.rs, Metric.
    metric: vec4<f32>,
    e_v: vec3<f32>,
    first: RayLight,
}

var<private> others: array<RayLight, LIGHTS_A_WALK>;
var<private> sums: array<f32, LIGHTS_A_WALK>;
// Where light has a colour of its own in every cell.
var<private> colours: array<vec3<f32>, LIGHTS_A_WALK>;

fn in_colour() -> bool {
    return STRAND || MULTIPLE;
}

fn lights_of(view: View) -> u32 {
    // Known when the shader is compiled, in all but a few scenes.
    return select(view.lights, LIGHTS, LIGHTS <= LIGHTS_A_WALK);
}

// One sheet: `before` is the radiance of those in front of it, and what they let through.
fn trace(
    quad_number: u32,
    pixel: vec2<u32>,
    hit: vec3<f32>,
    behind: vec3<f32>,
    before: vec4<f32>,
    is_last: bool,
    first: u32,
    count: ptr<function, vec2<u32>>,
) -> vec4<f32> {
    let quad = quads[quad_number];
    let jacobian = cell_frame(quad, hit.xy, frame.cells);
    let d_world = view_ray(frame, frame.window_x + pixel.x, frame.window_y + pixel.y);
    let side = seen_side(quad, d_world);
    let d = view_in_plane(quad, side, d_world);
    let d_cell = cell_from_plane(jacobian, d);

    var view: View;
    view.extinction = frame.extinction;
    view.depth_bits = frame.extinction * 65535.0 * select(jacobian.depth, 1.0, PER_CELL);
    view.early_end = frame.early_end;
    view.p = frame.p;
    view.max_cells = frame.max_cells;
    view.layers = frame.cells.z;
    view.lights = min(LIGHTS - first, LIGHTS_A_WALK);
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
    if in_colour() {
        view.strand = reflection.strand;
        view.similarity = reflection.similarity;
        for (var i = 0u; i < lights_of(view); i++) {
            others[i] = ray_light(first + i, quad, jacobian, side, d_world, hit.z);
            colours[i] = vec3<f32>(0.0);
            let light = &others[i];
            if CACHED {
                (*light).places = light_places_of(quad_number, first + i, hit.xy);
            }
            let l = light_at(first + i, d_world, hit.z).xyz;
            (*light).l_dot_e = -dot3(l, d_world);
            if MULTIPLE {
                (*light).peak = scatter_peak(view.similarity.g, (*light).l_dot_e * -1.0);
                var l_n = dot3(l, quad.n) * side;
                if PER_CELL {
                    let c = abs((*light).l_cell);
                    l_n = -(*light).l_cell.z / (c.x + c.y + c.z);
                }
                (*light).row = scatter_row(l_n, u32(frame.cells.z));
            }
            if frame.texture_frame != 0u {
                (*light).l_dot_e = dot3((*light).l_v, view.e_v);
            }
        }
    } else if LIGHTS > 0u {
        view.first = ray_light(first, quad, jacobian, side, d_world, hit.z);
        if CACHED {
            view.first.places = light_places_of(quad_number, first, hit.xy);
        }
    }
    for (var i = 1u; !in_colour() && i < lights_of(view); i++) {
        others[i] = ray_light(first + i, quad, jacobian, side, d_world, hit.z);
        if CACHED {
            others[i].places = light_places_of(quad_number, first + i, hit.xy);
        }
        sums[i] = 0.0;
    }

    var ray: Ray;
    var walk = walk_new(frame.cells, face_point(quad, hit.xy, frame.cells, frame.flow_cells), d_cell);
    ray.depth = -log2(max(before.w, 1e-30));
    ray.transmittance = before.w;
    // Four cells a turn: the loop's own cost on software Vulkan is a third of a bare step.
    while !ray.done {
        if MARCH {
            // Rays of one SIMD group meet occupied cells at different steps; those that found one wait
            // for the others, so that all walk to the light at once.
            var seeking = true;
            while seeking {
                seek(&walk, &ray, &seeking, view);
                seek(&walk, &ray, &seeking, view);
                seek(&walk, &ray, &seeking, view);
                seek(&walk, &ray, &seeking, view);
            }
            visit(&walk, &ray, view);
        } else {
            visit(&walk, &ray, view);
            visit(&walk, &ray, view);
            visit(&walk, &ray, view);
            visit(&walk, &ray, view);
        }
    }

    // Σ_k T_k (1 − e^(−τ_k)) = T_before − T_end carries the ambient light.
    var color = vec3<f32>(0.0);
    if first == 0u {
        let ends = is_last | (ray.transmittance < view.early_end);
        let passed = select(vec3<f32>(0.0), behind * ray.transmittance, ends);
        color = frame.ambient * (before.w - ray.transmittance) + passed;
        (*count).x += ray.cells;
    }
    if LIGHTS > 0u && !in_colour() {
        color += light_intensity(first, d_world, hit.z) * (ray.first * (1.0 / 255.0));
    }
    for (var i = select(1u, 0u, in_colour()); i < lights_of(view); i++) {
        var sum = colours[i];
        if !in_colour() {
            sum = vec3<f32>(sums[i] * (1.0 / 255.0));
        }
        color += light_intensity(first + i, d_world, hit.z) * sum;
    }
    (*count).y += ray.light_cells;
    return vec4<f32>(before.rgb + color, ray.transmittance);
}

// Goes on by one cell if the one it is in is empty; ends the seeking if not.
fn seek(walk: ptr<function, Walk>, ray: ptr<function, Ray>, seeking: ptr<function, bool>, view: View) {
    let empty = (textureLoad(volume, (*walk).cell).x & 0xffffu) == 0u;
    let on = *seeking & empty & !(*ray).done;
    (*ray).cells += select(0u, 1u, on);
    (*ray).t = select((*ray).t, walk_exit(*walk), on);
    walk_step(walk, on);
    (*ray).done |= ((*walk).cell.z >= view.layers) | ((*ray).cells >= view.max_cells);
    *seeking = on & !(*ray).done;
}

// The light of one cell, and the step to the next. Past the end of the walk nothing changes.
fn visit(walk: ptr<function, Walk>, ray: ptr<function, Ray>, view: View) {
    let texel = textureLoad(volume, (*walk).cell);
    let t_exit = walk_exit(*walk);
    let rho = f32(select(texel.x & 0xffffu, 0u, (*ray).done));
    var tau_bits = rho * view.extinction;
    if !PER_CELL {
        tau_bits *= t_exit - (*ray).t;
    }
    let passed = (*ray).transmittance * exp2(-tau_bits);
    let weight = (*ray).transmittance - passed;

    let k_d = f32((texel.x >> 16u) & 0xffu);
    let k_s = f32(texel.x >> 24u);
    let v = v_code(texel.y);
    let m = view.metric;
    let q = (m.x * v.x + m.y * v.y) * v.x + m.z * v.y * v.y + m.w * v.z * v.z;
    let inverse_q = 1.0 / max(q, 1e-30);
    let t_dot_e = dot3(v, view.e_v);
    let sin2_e = max(1.0 - t_dot_e * t_dot_e * inverse_q, 0.0);
    if in_colour() {
        let root = sqrt(inverse_q);
        for (var i = 0u; i < lights_of(view); i++) {
            let depth = light_depth(rho, (*walk).cell, others[i], view, ray);
            let t_dot_l = dot3(v, others[i].l_v);
            let seen = weight * exp2(-depth);
            var lit: vec3<f32>;
            if STRAND {
                let l_dot_e = others[i].l_dot_e;
                lit = seen * strand_psi(strand_table, linear, view.strand, k_d, k_s, t_dot_l * root, t_dot_e * root, l_dot_e);
            } else {
                let fibre = psi(view.p, k_d, k_s, v, others[i].l_v, t_dot_e, sin2_e, inverse_q);
                lit = vec3<f32>(seen * fibre * (1.0 / 255.0));
            }
            if MULTIPLE {
                let row = others[i].row;
                let z = u32((*walk).cell.z) + view.profile;
                let diffuse = scatter_diffuse(profiles[row.near + z].rgb, profiles[row.far + z].rgb, row);
                lit += scatter_multiple(view.similarity, others[i].peak, diffuse, (*ray).depth, tau_bits, depth);
            }
            colours[i] += lit;
        }
    } else if LIGHTS > 0u {
        let lit = weight * psi(view.p, k_d, k_s, v, view.first.l_v, t_dot_e, sin2_e, inverse_q);
        (*ray).first += lit * exp2(-light_depth(rho, (*walk).cell, view.first, view, ray));
    }
    for (var i = 1u; !in_colour() && i < lights_of(view); i++) {
        let lit = weight * psi(view.p, k_d, k_s, v, others[i].l_v, t_dot_e, sin2_e, inverse_q);
        sums[i] += lit * exp2(-light_depth(rho, (*walk).cell, others[i], view, ray));
    }
    if MULTIPLE {
        (*ray).depth += tau_bits;
    }

    (*ray).cells += select(1u, 0u, (*ray).done);
    (*ray).transmittance = passed;
    (*ray).t = t_exit;
    walk_step(walk, true);
    (*ray).done |= ((*walk).cell.z >= view.layers) | (passed < view.early_end)
        | ((*ray).cells >= view.max_cells);
}
