// §3 Textures, roughness and relief of opaque triangles. Twins: src/place/paint/sample.rs for the lookup,
// src/engine/cpu/paint.rs for the light.

#import engine::gbuffer
#import engine::opaque
#import layout
#import light::environment

@group(0) @binding(13) var<storage, read> paints: array<Paint>;
// Texture coordinates of triangles' corners.
@group(0) @binding(14) var<storage, read> corner_uvs: array<vec2<f32>>;
// Textures: each begins with the places of its levels, relative to its own; texels follow, red in the lowest
// byte.
@group(0) @binding(15) var<storage, read> texels: array<u32>;

// A texture as a paint uses it.
struct TextureUse {
    // Its place in `texels`.
    first: u32,
    // Width of the finest level, and above 16 bits its height.
    size: u32,
    // Number of levels; 0: no texture.
    levels: u32,
    // Bits: 2 for the number of its texture coordinates among those of a corner, 2 each for the continuation
    // along u and v, 1 for texels that are enlarged without interpolation, 1 for codes of sRGB.
    rule: u32,
}

// Look of the triangles of one material: Paint of src/place/paint/mod.rs.
struct Paint {
    // Factor of the albedo.
    color: TextureUse,
    // Factors of roughness (green) and of how metallic it is (blue).
    surface: TextureUse,
    // Normals in tangent space.
    relief: TextureUse,
    relief_scale: f32,
    roughness: f32,
    metallic: f32,
    // 0: it is Lambertian.
    has_gloss: u32,
    // Sets of texture coordinates that each corner has.
    slots: u32,
}

const MIRROR: u32 = 1u;
const CLAMP: u32 = 2u;

// Most lookups along the longer axis of a sample's footprint.
const MOST_TAPS: f32 = 4.0;
// Largest ratio between the axes of a lookup's own footprint.
const MOST_STRETCH: f32 = 8.0;

// A triangle as a sample sees it.
struct Sight {
    // First corner from the eye, and the edges to the other two, metres.
    corner: vec3<f32>,
    e1: vec3<f32>,
    e2: vec3<f32>,
    // Vector from the eye to the sample's point of the image plane at distance 1.
    ray: vec3<f32>,
    // Unit normal, interpolated between the corners, on the eye's side.
    normal: vec3<f32>,
    // Number of its first texture coordinates.
    coordinates: u32,
}

// A sample's point on a triangle and its footprint there, in shares of the edges from the first corner.
struct Footprint {
    point: vec2<f32>,
    across: vec2<f32>,
    along: vec2<f32>,
}

// Values of the textures at a point.
struct Painted {
    color: vec3<f32>,
    roughness: f32,
    metallic: f32,
    normal: vec3<f32>,
}

fn shares_of(d: vec3<f32>, s: Sight, normal: vec3<f32>, n2: f32) -> vec2<f32> {
    return vec2<f32>(dot3(d, cross3(s.e2, normal)), dot3(d, cross3(normal, s.e1))) / n2;
}

fn footprint_on(s: Sight) -> Footprint {
    let normal = cross3(s.e1, s.e2);
    let n2 = max(dot3(normal, normal), 1e-37);
    let towards = dot3(normal, s.ray);
    let depth = dot3(normal, s.corner) / towards;
    let side = cross3(normal, s.ray);
    let sideways = select(s.e1, side, dot3(side, side) > 1e-12 * n2);
    let across = sideways / sqrt(max(dot3(sideways, sideways), 1e-37));
    let along = cross3(across, normal) / sqrt(n2);
    let cos_angle = abs(towards) / sqrt(n2 * dot3(s.ray, s.ray));
    let radius = abs(depth) * sqrt(frame.footprint);
    var out: Footprint;
    let point = shares_of(s.ray * depth - s.corner, s, normal, n2);
    out.point = min(max(point, vec2<f32>(0.0)), vec2<f32>(1.0));
    out.across = shares_of(across * radius, s, normal, n2);
    out.along = shares_of(along * (radius / max(cos_angle, 1e-3)), s, normal, n2);
    return out;
}

fn texture_size(used: TextureUse, level: u32) -> vec2<i32> {
    return max(vec2<i32>(vec2<u32>(used.size & 0xffffu, used.size >> 16u) >> vec2<u32>(level)), vec2<i32>(1));
}

// Lookups that stand for a footprint, evenly along its longer axis.
struct Filter {
    level: f32,
    taps: u32,
    // Texture coordinates from the first lookup to the last.
    spread: vec2<f32>,
}

// The lookups of a texture. `step_1` and `step_2` are the differences of its coordinates along the edges.
fn texture_filter(f: Footprint, step_1: vec2<f32>, step_2: vec2<f32>, size: vec2<f32>) -> Filter {
    let across = step_1 * f.across.x + step_2 * f.across.y;
    let along = step_1 * f.along.x + step_2 * f.along.y;
    let a = sqrt(dot2(across * size, across * size));
    let b = sqrt(dot2(along * size, along * size));
    let long = max(a, b);
    let short = max(min(a, b), 1.0);
    let ratio = clamp(long / short, 1.0, MOST_TAPS);
    var out: Filter;
    out.level = log2(max(min(long / ratio, MOST_STRETCH * short), 1e-9));
    out.taps = select(u32(ceil(ratio)), 1u, ratio < 1.2);
    out.spread = select(across, along, b >= a) * (1.0 - 1.0 / ratio);
    return out;
}

// Index of a texel inside a row of `n`.
fn wrapped(i: i32, n: i32, wrap: u32) -> i32 {
    if wrap == CLAMP {
        return clamp(i, 0, n - 1);
    }
    let period = select(n, 2 * n, wrap == MIRROR);
    let k = (i % period + period) % period;
    return min(k, 2 * n - 1 - k);
}

// Colour of a texel, whose column and row may lie outside.
fn texel(used: TextureUse, level: u32, at: vec2<i32>) -> vec3<f32> {
    let size = texture_size(used, level);
    let x = wrapped(at.x, size.x, (used.rule >> 2u) & 3u);
    let y = wrapped(at.y, size.y, (used.rule >> 4u) & 3u);
    let place = used.first + texels[used.first + level] + u32(y * size.x + x);
    let code = unpack4x8unorm(texels[place]).xyz;
    if ((used.rule >> 7u) & 1u) == 0u {
        return code;
    }
    let high = pow((code + 0.055) / 1.055, vec3<f32>(2.4));
    return select(high, code / 12.92, code <= vec3<f32>(0.04045));
}

fn bilinear(used: TextureUse, uv: vec2<f32>, level: u32) -> vec3<f32> {
    let at = uv * vec2<f32>(texture_size(used, level)) - 0.5;
    let low = floor(at);
    let f = at - low;
    let cell = vec2<i32>(low);
    let top = mix(texel(used, level, cell), texel(used, level, cell + vec2<i32>(1, 0)), f.x);
    let bottom =
        mix(texel(used, level, cell + vec2<i32>(0, 1)), texel(used, level, cell + vec2<i32>(1, 1)), f.x);
    return mix(top, bottom, f.y);
}

// Colour of a texture at texture coordinates: trilinear between texels and levels.
fn texture_color(used: TextureUse, uv: vec2<f32>, level: f32) -> vec3<f32> {
    if level <= 0.0 && ((used.rule >> 6u) & 1u) == 1u {
        return texel(used, 0u, vec2<i32>(floor(uv * vec2<f32>(texture_size(used, 0u)))));
    }
    let bounded = clamp(level, 0.0, f32(used.levels - 1u));
    let whole = floor(bounded);
    let near = bilinear(used, uv, u32(whole));
    if bounded == whole {
        return near;
    }
    return mix(near, bilinear(used, uv, u32(whole) + 1u), bounded - whole);
}

// Number of the texture coordinates of a corner, of three.
fn uv_of(paint: Paint, used: TextureUse, s: Sight, corner: u32) -> vec2<f32> {
    return corner_uvs[s.coordinates + paint.slots * corner + (used.rule & 3u)];
}

fn look_up(paint: Paint, used: TextureUse, s: Sight, f: Footprint) -> vec3<f32> {
    let uv = uv_of(paint, used, s, 0u);
    let step_1 = uv_of(paint, used, s, 1u) - uv;
    let step_2 = uv_of(paint, used, s, 2u) - uv;
    let filtered = texture_filter(f, step_1, step_2, vec2<f32>(texture_size(used, 0u)));
    let at = uv + step_1 * f.point.x + step_2 * f.point.y;
    let first = select(at, at - filtered.spread * 0.5, filtered.taps > 1u);
    var sum = texture_color(used, first, filtered.level);
    for (var tap = 1u; tap < filtered.taps; tap++) {
        let share = f32(tap) / f32(filtered.taps - 1u);
        sum += texture_color(used, at + filtered.spread * (share - 0.5), filtered.level);
    }
    return sum / f32(filtered.taps);
}

// A normal in tangent space as a unit vector of the world. The first axis of that space runs with u on the
// surface, the second against v, which runs down an image, and the third is the normal.
fn bent(paint: Paint, s: Sight, m: vec3<f32>) -> vec3<f32> {
    let uv = uv_of(paint, paint.relief, s, 0u);
    let step_1 = uv_of(paint, paint.relief, s, 1u) - uv;
    let step_2 = uv_of(paint, paint.relief, s, 2u) - uv;
    let n = s.normal;
    let turned = select(1.0, -1.0, cross2(step_1, step_2) < 0.0);
    let u = (s.e1 * step_2.y - s.e2 * step_1.y) * turned;
    let v = (s.e2 * step_1.x - s.e1 * step_2.x) * turned;
    let flat_u = u - n * dot3(n, u);
    let length_u = sqrt(dot3(flat_u, flat_u));
    if !(length_u > 1e-30) {
        return n;
    }
    let t = flat_u / length_u;
    let up = cross3(n, t);
    let b = select(up, -up, dot3(up, v) > 0.0);
    let sum = t * m.x + b * m.y + n * m.z;
    let length_sum = sqrt(dot3(sum, sum));
    return select(n, sum / max(length_sum, 1e-6), length_sum > 1e-6);
}

// Reads the textures of a paint at a point. Twin: Paints::at.
fn painted_at(paint: Paint, s: Sight) -> Painted {
    var out = Painted(vec3<f32>(1.0), paint.roughness, paint.metallic, s.normal);
    if paint.slots == 0u {
        return out;
    }
    let f = footprint_on(s);
    if paint.color.levels > 0u {
        out.color = look_up(paint, paint.color, s, f);
    }
    if paint.surface.levels > 0u {
        let factors = look_up(paint, paint.surface, s, f);
        out.roughness *= factors.y;
        out.metallic *= factors.z;
    }
    if paint.relief.levels > 0u {
        let m = look_up(paint, paint.relief, s, f) * 2.0 - 1.0;
        out.normal = bent(paint, s, m * vec3<f32>(paint.relief_scale, paint.relief_scale, 1.0));
    }
    return out;
}
