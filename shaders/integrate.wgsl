// §4 and §5: the walk through the volume's cells under each pixel, and the light they send to the eye.
//
// One invocation a pixel. Twins: src/cpu/integrate.rs (same order of operations), src/walk.rs (the
// DDA and its edge cases), src/mapping.rs (CellFrame), src/shading.rs (fibre model: Kajiya and Kay 1989).
// The reasoning stands there.

override LIGHTS: u32 = 1u;
override PER_CELL: bool = false;
override MARCH: bool = false;
// The specular exponent where it is a whole number up to 255, else 0: `pow` costs three times as much.
override EXPONENT: u32 = 0u;

const NEVER: f32 = 1.0e30;
const PARALLEL: f32 = 1.0e-20;

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> lights: Lights;
@group(0) @binding(2) var<storage, read> quads: array<Quad>;
@group(0) @binding(3) var<uniform> tile: Tile;
@group(0) @binding(4) var volume: texture_storage_3d<rg32uint, read>;
@group(0) @binding(5) var surface: texture_2d<f32>;
@group(0) @binding(6) var quad_id: texture_2d<u32>;
@group(0) @binding(7) var opaque_radiance: texture_2d<f32>;
// Sum over samples of radiance, and of transmittance.
@group(0) @binding(8) var<storage, read_write> radiance: array<vec4<f32>>;
// Sum over samples of cells walked by view rays, and by light rays.
@group(0) @binding(9) var<storage, read_write> counts: array<vec2<u32>>;

struct Walk {
    cell: vec3<i32>,
    step: vec3<i32>,
    origin: vec3<f32>,
    inverse: vec3<f32>,
    boundary: vec3<f32>,
    t_next: vec3<f32>,
}

fn start_cell(x: vec3<f32>, direction: vec3<f32>) -> vec3<f32> {
    return select(floor(x), ceil(x) - 1.0, direction < vec3<f32>(0.0));
}

fn walk_new(origin: vec3<f32>, direction: vec3<f32>) -> Walk {
    var walk: Walk;
    let start = start_cell(origin, direction);
    let moves = abs(direction) >= vec3<f32>(PARALLEL);
    let forward = direction > vec3<f32>(0.0);
    walk.origin = origin;
    walk.step = select(vec3<i32>(0), select(vec3<i32>(-1), vec3<i32>(1), forward), moves);
    walk.inverse = select(vec3<f32>(0.0), vec3<f32>(1.0) / direction, moves);
    walk.boundary = start + select(vec3<f32>(0.0), vec3<f32>(1.0), forward);
    walk.t_next = select(vec3<f32>(NEVER), (walk.boundary - origin) * walk.inverse, moves);
    let cell = vec3<i32>(start);
    walk.cell = vec3<i32>(wrap(cell.x, frame.cells.x), wrap(cell.y, frame.cells.y), cell.z);
    return walk;
}

fn wrap(x: i32, n: i32) -> i32 {
    return select(select(x, 0, x >= n), n - 1, x < 0);
}

fn walk_step(walk: ptr<function, Walk>, t_exit: f32) {
    let x = (*walk).t_next.x <= t_exit;
    let y = !x && (*walk).t_next.y <= t_exit;
    let z = !x && !y;
    let moved = vec3<bool>(x, y, z);
    let step = select(vec3<i32>(0), (*walk).step, moved);
    (*walk).boundary += vec3<f32>(step);
    (*walk).t_next = select((*walk).t_next, ((*walk).boundary - (*walk).origin) * (*walk).inverse, moved);
    let cell = (*walk).cell + step;
    (*walk).cell = vec3<i32>(wrap(cell.x, frame.cells.x), wrap(cell.y, frame.cells.y), cell.z);
}

fn t_exit_of(walk: Walk) -> f32 {
    return min(min(walk.t_next.x, walk.t_next.y), walk.t_next.z);
}

fn v_code(word: u32) -> vec3<f32> {
    let bits = vec3<u32>(word << 22u, word << 12u, word << 2u);
    return vec3<f32>(bitcast<vec3<i32>>(bits) >> vec3<u32>(22u));
}

fn specular_power(x: f32) -> f32 {
    if EXPONENT == 0u {
        return pow(x, frame.p);
    }
    var power = x;
    var result = 1.0;
    if (EXPONENT & 1u) != 0u { result *= power; }
    power *= power;
    if (EXPONENT & 2u) != 0u { result *= power; }
    power *= power;
    if (EXPONENT & 4u) != 0u { result *= power; }
    power *= power;
    if (EXPONENT & 8u) != 0u { result *= power; }
    power *= power;
    if (EXPONENT & 16u) != 0u { result *= power; }
    power *= power;
    if (EXPONENT & 32u) != 0u { result *= power; }
    power *= power;
    if (EXPONENT & 64u) != 0u { result *= power; }
    power *= power;
    if (EXPONENT & 128u) != 0u { result *= power; }
    return result;
}

// V_i(k): from the middle of `cell` to where the light ray leaves the slab.
fn visibility(cell: vec3<i32>, direction: vec3<f32>, light_cells: ptr<function, u32>) -> f32 {
    var walk = walk_new(vec3<f32>(cell) + 0.5, direction);
    var depth = 0.0;
    var t = 0.0;
    for (var n = 0u; n < frame.max_cells; n++) {
        let t_exit = t_exit_of(walk);
        let rho = f32(textureLoad(volume, walk.cell).x & 0xffffu);
        if PER_CELL {
            // The cell itself does not hide its own light.
            depth += select(rho, 0.0, n == 0u);
        } else {
            depth += rho * (t_exit - t);
        }
        t = t_exit;
        walk_step(&walk, t_exit);
        *light_cells += 1u;
        if walk.cell.z < 0 || walk.cell.z >= frame.cells.z {
            break;
        }
    }
    return exp2(-depth * frame.extinction);
}

@compute @workgroup_size(WORKGROUP, WORKGROUP)
fn integrate(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= tile.width || id.y >= tile.height {
        return;
    }
    let pixel = vec2<u32>(tile.x + id.x, tile.y + id.y);
    let index = pixel.y * frame.window_width + pixel.x;
    let quad_number = textureLoad(quad_id, pixel, 0).x;
    let behind = textureLoad(opaque_radiance, pixel, 0).rgb;
    var result = vec4<f32>(behind, 1.0);
    var count = vec2<u32>(0u);
    if quad_number != 0u {
        let hit = textureLoad(surface, pixel, 0);
        result = trace(quads[quad_number - 1u], pixel, hit.xyz, behind, &count);
    }
    if frame.sample_index != 0u {
        result += radiance[index];
        count += counts[index];
    }
    radiance[index] = result;
    counts[index] = count;
}

fn trace(quad: Quad, pixel: vec2<u32>, hit: vec3<f32>, behind: vec3<f32>, count: ptr<function, vec2<u32>>) -> vec4<f32> {
    // CellFrame::new: world_from_cell at (u, v), in the axes e1, e2, n of the quad's plane.
    let cells = vec3<f32>(frame.cells);
    let cx = (quad.e + quad.g * hit.y) / (quad.repeat_u * cells.x);
    let cy = (quad.f + quad.g * hit.x) / (quad.repeat_v * cells.y);
    let depth = quad.thickness / cells.z;
    let det = cross2(cx, cy);

    let d_world = view_ray(frame, frame.window_x + pixel.x, frame.window_y + pixel.y);
    let d_n = dot3(d_world, quad.n);
    let side = select(1.0, -1.0, d_n > 0.0);
    let d = vec3<f32>(dot3(d_world, quad.e1), dot3(d_world, quad.e2), min(d_n * side, -1e-6));
    let d_cell = vec3<f32>(cross2(d.xy, cy) / det, cross2(cx, d.xy) / det, -d.z / depth);

    // What angles are measured with (shading.rs, Metric): (M₀₀, 2M₀₁, M₁₁, M₂₂), Jᵀl and Jᵀe.
    let texture_frame = frame.texture_frame != 0u;
    var metric = vec4<f32>(dot2(cx, cx), 2.0 * dot2(cx, cy), dot2(cy, cy), depth * depth);
    var e_v = -vec3<f32>(dot2(cx, d.xy), dot2(cy, d.xy), -depth * d.z);
    if texture_frame {
        metric = vec4<f32>(1.0, 0.0, 1.0, 1.0);
        e_v = -d_cell / sqrt(dot3(d_cell, d_cell));
    }
    var l_v: array<vec3<f32>, MAX_LIGHTS>;
    var l_cell: array<vec3<f32>, MAX_LIGHTS>;
    var sum: array<f32, MAX_LIGHTS>;
    for (var i = 0u; i < LIGHTS; i++) {
        let to_light = light_at(i, d_world, hit.z).xyz;
        let l = vec3<f32>(dot3(to_light, quad.e1), dot3(to_light, quad.e2), dot3(to_light, quad.n) * side);
        l_cell[i] = vec3<f32>(cross2(l.xy, cy) / det, cross2(cx, l.xy) / det, -l.z / depth);
        l_v[i] = vec3<f32>(dot2(cx, l.xy), dot2(cy, l.xy), -depth * l.z);
        if texture_frame {
            l_v[i] = l_cell[i] / sqrt(dot3(l_cell[i], l_cell[i]));
        }
        sum[i] = 0.0;
    }

    let x = hit.x * quad.repeat_u * cells.x;
    let y = hit.y * quad.repeat_v * cells.y;
    let origin = vec3<f32>(x - cells.x * floor(x / cells.x), y - cells.y * floor(y / cells.y), 0.0);
    var walk = walk_new(origin, d_cell);
    var transmittance = 1.0;
    var t = 0.0;
    var n = 0u;
    var light_cells = 0u;
    for (; n < frame.max_cells; n++) {
        let texel = textureLoad(volume, walk.cell);
        let t_exit = t_exit_of(walk);
        let rho = f32(texel.x & 0xffffu);
        var tau_bits = rho * frame.extinction;
        if !PER_CELL {
            tau_bits *= t_exit - t;
        }
        let passed = transmittance * exp2(-tau_bits);
        let weight = transmittance - passed;

        let k_d = f32((texel.x >> 16u) & 0xffu);
        let k_s = f32(texel.x >> 24u);
        let v = v_code(texel.y);
        let q = (metric.x * v.x + metric.y * v.y) * v.x + metric.z * v.y * v.y + metric.w * v.z * v.z;
        let inverse_q = 1.0 / max(q, 1e-30);
        let t_dot_e = dot3(v, e_v);
        let sin2_e = max(1.0 - t_dot_e * t_dot_e * inverse_q, 0.0);
        for (var i = 0u; i < LIGHTS; i++) {
            let t_dot_l = dot3(v, l_v[i]);
            let sin2_l = max(1.0 - t_dot_l * t_dot_l * inverse_q, 0.0);
            let base = sqrt(sin2_l * sin2_e) - t_dot_l * t_dot_e * inverse_q;
            let psi = k_d * sqrt(sin2_l) + k_s * specular_power(max(base, 0.0));
            var seen = 1.0;
            if MARCH {
                if rho > 0.0 {
                    seen = visibility(walk.cell, l_cell[i], &light_cells);
                }
            }
            sum[i] += weight * seen * psi;
        }

        transmittance = passed;
        t = t_exit;
        walk_step(&walk, t_exit);
        if walk.cell.z >= frame.cells.z || transmittance < frame.early_end {
            n++;
            break;
        }
    }

    // Σ_k T_k (1 − e^(−τ_k)) = 1 − T_end carries the ambient light.
    var color = frame.ambient * (1.0 - transmittance) + behind * transmittance;
    for (var i = 0u; i < LIGHTS; i++) {
        let light = light_at(i, d_world, hit.z);
        color += lights.list[i].intensity * (light.w * sum[i] * (1.0 / 255.0));
    }
    *count = vec2<u32>(n, light_cells);
    return vec4<f32>(color, transmittance);
}

// Unit direction from the mapped point to light i, and its falloff there (the paper maps the light
// vectors at the point, not in every cell).
fn light_at(i: u32, d_world: vec3<f32>, t_hit: f32) -> vec4<f32> {
    let light = lights.list[i];
    if light.is_point == 0u {
        return vec4<f32>(light.vector, 1.0);
    }
    let away = light.vector - (frame.eye_world + d_world * t_hit);
    let d2 = max(dot3(away, away), 1e-12);
    return vec4<f32>(away / sqrt(d2), 1.0 / d2);
}
