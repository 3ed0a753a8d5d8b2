// §3 Shading of a pool's surface in the raster pass. Twin: src/engine/cpu/pool.rs, which holds the reasoning.
// src/engine/pool_surface computes the surface once per picture.

#import engine::gbuffer
#import engine::opaque
#import layout
#import light::environment
#import light::haze
#import mapping

const WAVES: u32 = 32u;
const AROUND_COLUMNS: u32 = 64u;
const AROUND_ROWS: u32 = 12u;

struct Wave {
    // x and z of a straight wave's unit direction, or of a ring's centre in metres.
    toward: vec2<f32>,
    // Waves per metre, and phase in turns at the scene's origin or the ring's centre.
    k: f32,
    phase: f32,
    // Steepest slope.
    slope: f32,
    // 1 for a ring, 0 for a straight wave.
    ring: f32,
    // Decay of a ring with the distance from its centre, 1/m.
    decay: f32,
    // Turns of the phase while the shutter is open.
    moves: f32,
}

// Place of the scene's origin in a lattice that is fixed to the world.
struct Foam {
    // Whole cells along x and z.
    cells: vec2<i32>,
    // The rest, 0 to 1.
    rest: vec2<f32>,
    // Cells per metre along x: cosine and sine of the lattice's turn times its scale. Used by fields.
    axis: vec2<f32>,
    pad: vec2<f32>,
}

struct Surface {
    color: vec3<f32>,
    // Radius in metres of the sphere that the surroundings are projected on.
    radius: f32,
    bottom: vec3<f32>,
    // 1: a hole in a picture with alpha.
    holdout: f32,
    absorption: vec3<f32>,
    // Scale of the foam's pattern, relative to that of a pool without a field.
    foam_scale: f32,
    middle: vec3<f32>,
    // Metres along a view ray beyond which points of the pool's plane are not used.
    far: f32,
    // The plane as the eye sees it, with the axes x and z, and the eye's height over it: PlaneView of
    // src/mapping/view.rs.
    across: vec3<f32>,
    height: f32,
    along: vec3<f32>,
    // Metres by which noise moves fine waves.
    bend: f32,
    normal: vec3<f32>,
    // Turns per metre at which the field's waves fade as a pixel grows.
    field_blur: f32,
    // x and z of the corner of the field's grid, metres, and its cells per metre.
    field_origin: vec2<f32>,
    field_scale: f32,
    pad: f32,
    // Seconds by which both patterns of foam are carried, and their shares.
    carry: vec4<f32>,
    foam: array<Foam, 4>,
    waves: array<Wave, 32>,
    // Map of the surroundings: radiance × cover, and the cover.
    around: array<vec4<f32>, 768>,
}

@group(0) @binding(7) var<uniform> pool: Surface;

// sin(2πt) with an error below 3e-5. WGSL leaves the error of its own `sin` open.
fn sin_turns(t: f32) -> f32 {
    let x = t - floor(t + 0.5);
    let x2 = x * x;
    var sum = 3.8199526;
    sum = sum * x2 - 15.094643;
    sum = sum * x2 + 42.058694;
    sum = sum * x2 - 76.70586;
    sum = sum * x2 + 81.60525;
    sum = sum * x2 - 41.3417;
    sum = sum * x2 + 6.2831855;
    return sum * x;
}

// Hash of a lattice point, 0 to 1.
fn lattice(x: u32, y: u32) -> f32 {
    var h = (x * 0x8da6b343u) ^ (y * 0xd8163841u);
    h = (h ^ (h >> 13u)) * 0x9e3779b1u;
    h = h ^ (h >> 16u);
    return f32(h >> 8u) / 16777216.0;
}

// Value noise between the values of the lattice. `cells` counts from the scene's origin.
fn value_noise(cells: vec2<f32>, origin: Foam) -> f32 {
    let p = cells + origin.rest;
    let cell = floor(p);
    let f = p - cell;
    let s = f * f * (vec2<f32>(3.0) - f * 2.0);
    let x = bitcast<u32>(i32(cell.x) + origin.cells.x);
    let y = bitcast<u32>(i32(cell.y) + origin.cells.y);
    let near = lattice(x, y) + (lattice(x + 1u, y) - lattice(x, y)) * s.x;
    let far = lattice(x, y + 1u) + (lattice(x + 1u, y + 1u) - lattice(x, y + 1u)) * s.x;
    return near + (far - near) * s.y;
}

// Noise of the foam at a point, measured from the scene's origin. Twin: FOAM of src/engine/pool_surface.
fn foam_noise(p: vec2<f32>) -> f32 {
    return 0.45 * value_noise(p * 2.3, pool.foam[0]) + 0.27 * value_noise(p * 5.1, pool.foam[1])
        + 0.17 * value_noise(p * 11.0, pool.foam[2]) + 0.11 * value_noise(p * 23.0, pool.foam[3]);
}

// Moves a point to where the view ray meets the pool's plane.
fn on_pool(in: OpaquePoint) -> OpaquePoint {
    let at = image_point(frame, frame.window_x + in.pixel.x, frame.window_y + in.pixel.y);
    let hit = plane_hit(pool.across, pool.along, pool.normal, pool.height, at);
    let metres = hit.z * ray_length(frame, at);
    var out = in;
    if metres > 0.0 && metres < pool.far {
        out.position_world = pool.middle + vec3<f32>(hit.x, 0.0, hit.y);
    }
    return out;
}

fn to_eye_unit(in: OpaquePoint) -> vec3<f32> {
    let to_eye = frame.eye_world - in.position_world;
    return to_eye / max(sqrt(dot3(to_eye, to_eye)), 1e-6);
}

// Place of the surface whose waves are added up.
struct WavePlace {
    p: vec2<f32>,
    // Factor of the slopes.
    churn: f32,
    // Width of a pixel on the surface, metres.
    footprint: f32,
    // Time of the sample: see shutter_time.
    time: f32,
}

// Slopes and lift of one wave. The host generates `waves`, which adds up those of all
// (src/engine/gpu/gbuffer.rs).
fn rise(wave: Wave, toward: vec2<f32>, along: f32, steepest: f32, at: WavePlace) -> vec3<f32> {
    let wide = 3.0 * wave.k * at.footprint;
    let blur = 1.0 + wide * wide;
    let steep = steepest / (blur * blur);
    let t = wave.k * along + wave.phase + wave.moves * at.time;
    return vec3<f32>(toward * (steep * sin_turns(t + 0.25)), steep * sin_turns(t));
}

fn straight_wave(wave: Wave, at: WavePlace) -> vec3<f32> {
    return rise(wave, wave.toward, dot2(wave.toward, at.p), wave.slope * at.churn, at);
}

fn ring_wave(wave: Wave, at: WavePlace) -> vec3<f32> {
    let away = at.p - wave.toward;
    let along = max(sqrt(dot2(away, away)), 1e-3);
    let fall = 1.0 + along * wave.decay;
    return rise(wave, away / along, along, wave.slope * at.churn / (fall * fall), at);
}

// Unit normal of the waves.
fn pool_normal(in: OpaquePoint) -> vec3<f32> {
    let to_eye = frame.eye_world - in.position_world;
    let e = to_eye_unit(in);
    let pixel = 2.0 * sqrt(dot3(frame.up, frame.up)) / frame.image_height;
    let footprint = sqrt(dot3(to_eye, to_eye)) * pixel / max(e.y, 0.05);
    let churn = 1.0 + 1.5 * in.albedo.y;
    let time = shutter_time(frame, frame.window_x + in.pixel.x, frame.window_y + in.pixel.y);
    let sum = waves(WavePlace(in.position_world.xz, churn, footprint, time));
    let n = vec3<f32>(-sum.x, max(1.0 - sum.z, 0.3), -sum.y);
    return n / sqrt(dot3(n, n));
}

// View direction mirrored at `n`, never into the water.
fn pool_mirrored(in: OpaquePoint, n: vec3<f32>) -> vec3<f32> {
    let e = to_eye_unit(in);
    let r = n * (2.0 * dot3(n, e)) - e;
    let up = vec3<f32>(r.x, max(abs(r.y), 0.01), r.z);
    return up / sqrt(dot3(up, up));
}

// Position of a direction about the vertical, 0 to 1. Twin: `turn` of src/engine/pool_surface/mod.rs.
fn turn(d: vec3<f32>) -> f32 {
    let p = d.x / max(abs(d.x) + abs(d.z), 1e-20);
    return select(0.25 * (3.0 + p), 0.25 * (1.0 - p), d.z >= 0.0);
}

// Surroundings that a ray from `position` along `r` meets: radiance × cover, and the cover.
fn around(position: vec3<f32>, r: vec3<f32>) -> vec4<f32> {
    let o = position - pool.middle;
    let b = dot3(o, r);
    let radius = pool.radius;
    let c = dot3(o, o) - radius * radius;
    let far = o + r * max(sqrt(max(b * b - c, 0.0)) - b, 0.0);
    let d = far / sqrt(max(dot3(far, far), 1e-12));
    let s = turn(d) * f32(AROUND_COLUMNS) - 0.5;
    let t = clamp(d.y * f32(AROUND_ROWS) - 0.5, 0.0, f32(AROUND_ROWS) - 1.0);
    let f = s - floor(s);
    let g = t - floor(t);
    let x0 = u32(floor(s) + f32(AROUND_COLUMNS)) % AROUND_COLUMNS;
    let x1 = (x0 + 1u) % AROUND_COLUMNS;
    let y0 = u32(floor(t)) * AROUND_COLUMNS;
    let y1 = min(u32(floor(t)) + 1u, AROUND_ROWS - 1u) * AROUND_COLUMNS;
    let low = pool.around[y0 + x0] * (1.0 - f) + pool.around[y0 + x1] * f;
    let high = pool.around[y1 + x0] * (1.0 - f) + pool.around[y1 + x1] * f;
    return low * (1.0 - g) + high * g;
}

// Adds light `i` to the light that reaches a point of the surface; `gloss` is its glint.
fn pool_lit_by(sum: Lit, in: OpaquePoint, n: vec3<f32>, e: vec3<f32>, i: u32) -> Lit {
    let light = lights[i];
    let arrives = light_from(light, in.position_world);
    let lit = select(1.0, 1.0 - in.shade.y, i == frame.shadow_light);
    let both = arrives.xyz + e;
    let h = both / sqrt(max(dot3(both, both), 1e-12));
    let c = max(dot3(n, h), 0.0);
    let c2 = c * c;
    let c4 = c2 * c2;
    let c8 = c4 * c4;
    let c16 = c8 * c8;
    let c32 = c16 * c16;
    let c64 = c32 * c32;
    let c128 = c64 * c64;
    let lobe = 33.0 * fresnel(dot3(arrives.xyz, h)) * (c128 * c128) * max(dot3(n, arrives.xyz), 0.0);
    var out = sum;
    out.irradiance += light.intensity * (arrives.w * lit * max(arrives.y, 0.0));
    out.gloss += light.intensity * (arrives.w * lit * lobe);
    return out;
}

// Light of a point of the surface without foam.
struct PoolLight {
    // Radiance of clear water.
    clear: vec3<f32>,
    // Light that reaches the surface: the radiance of white foam.
    irradiance: vec3<f32>,
}

// Light of a point of the surface. `sky` is the radiance of the sky along the mirrored view.
fn pool_light(in: OpaquePoint, n: vec3<f32>, ambient: vec3<f32>, sky: vec3<f32>) -> PoolLight {
    let e = to_eye_unit(in);
    var sum = Lit(ambient * (1.0 - in.shade.x), vec3<f32>(0.0));
    if ONE_LIGHT {
        sum = pool_lit_by(sum, in, n, e, 0u);
    } else {
        for (var i = 0u; i < frame.light_count; i++) {
            sum = pool_lit_by(sum, in, n, e, i);
        }
    }
    let mirrors = around(in.position_world, pool_mirrored(in, n));
    let mirror = mirrors.rgb + sky * (1.0 - mirrors.a);
    let through = exp2(pool.absorption * (-3.174 * in.albedo.x));
    let body = pool.color * (1.0 - through) + pool.bottom * through;
    let back = fresnel(max(dot3(n, e), 0.02));
    return PoolLight(mirror * back + sum.gloss + body * sum.irradiance * (1.0 - back), sum.irradiance);
}

// Shades a point of the surface. `sky` is the radiance of the sky along the mirrored view.
fn shade_pool(in: OpaquePoint, n: vec3<f32>, ambient: vec3<f32>, sky: vec3<f32>) -> OpaqueTargets {
    let to_eye = frame.eye_world - in.position_world;
    let water = pool_light(in, n, ambient, sky);
    let p = in.position_world.xz + vec2<f32>(n.x, n.z) * 0.3;
    let noise = foam_noise(p);
    let cover = clamp((1.6 * in.albedo.y + noise - 1.05) * 2.2, 0.0, 1.0);
    let foam = water.irradiance * ((0.25 + 0.5 * noise) * cover);
    return opaque_targets(water.clear * (1.0 - cover) + foam, n, to_eye, pool.holdout != 0.0);
}

// Values in full vectors, because software Vulkan interpolates whole vectors.
struct PoolVarying {
    @builtin(position) clip: vec4<f32>,
    @location(0) position_world_occlusion: vec4<f32>,
    @location(1) shadow_depth_foam: vec4<f32>,
}

@vertex
fn pool_vertex(@builtin(vertex_index) corner: u32, @builtin(instance_index) number: u32) -> PoolVarying {
    let row = corner / TILE_ROW;
    let column = corner - row * TILE_ROW;
    let vertex = tiles[number].first + row * tiles[number].pitch + column;
    let coat = coats[vertex];
    let shade = unpack2x16unorm(coat.occlusion_shadow);
    let position = positions[vertex].xyz;
    var out: PoolVarying;
    out.clip = frame.clip_from_world * vec4<f32>(position, 1.0);
    out.position_world_occlusion = vec4<f32>(position, shade.x);
    out.shadow_depth_foam = vec4<f32>(shade.y, coat.albedo_r, coat.albedo_g, 0.0);
    return out;
}

fn pool_point(in: PoolVarying) -> OpaquePoint {
    var out: OpaquePoint;
    out.pixel = vec2<u32>(in.clip.xy);
    out.position_world = in.position_world_occlusion.xyz;
    out.albedo = vec3<f32>(in.shadow_depth_foam.yz, 0.0);
    out.shade = vec3<f32>(in.position_world_occlusion.w, in.shadow_depth_foam.x, 0.0);
    return out;
}

@fragment
fn pool_fragment(in: PoolVarying) -> OpaqueTargets {
    let at = on_pool(pool_point(in));
    let n = pool_normal(at);
    return shade_pool(at, n, frame.ambient, background_radiance(pool_mirrored(at, n)));
}

@fragment
fn pool_environment_fragment(in: PoolVarying) -> OpaqueTargets {
    let at = on_pool(pool_point(in));
    let n = pool_normal(at);
    let ambient = frame.ambient + environment_irradiance(environment, vec3<f32>(0.0, 1.0, 0.0));
    return shade_pool(at, n, ambient, environment_irradiance(environment, pool_mirrored(at, n)));
}
