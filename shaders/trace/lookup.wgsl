// §4 Values interpolated between eight cell centres, and §5 the light reflected by a distribution of
// directions. Part of the stage integrate. Twins: src/trace/lookup.rs, Moments in src/volume/pyramid.rs, and
// Spread in src/light/fibre.rs.

#import layout
#import light::fibre
#import trace::levels
#import trace::matter
#import volume::cells

// Whether rays interpolate between cell centres.
override TRILINEAR: bool = false;
// Whether a sample can have more than one direction.
override MANY_DIRECTIONS: bool = PYRAMID || TRILINEAR;

// Second moments of directions: xx, yy, zz and xy, xz, yz.
struct Moments {
    diagonal: vec3<f32>,
    mixed: vec3<f32>,
}

// Values that a ray reads in one cell: ρ on the sheet in codes (0 to 65535), k_d and k_s in codes (0 to 255).
struct CellSample {
    rho: f32,
    k_d: f32,
    k_s: f32,
    moments: Moments,
}

fn moments_times(m: Moments, v: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(
        m.diagonal.x * v.x + m.mixed.x * v.y + m.mixed.y * v.z,
        m.mixed.x * v.x + m.diagonal.y * v.y + m.mixed.z * v.z,
        m.mixed.y * v.x + m.mixed.z * v.y + m.diagonal.z * v.z,
    );
}

fn moments_of_one(v: vec3<f32>) -> Moments {
    return Moments(v * v, v.xxy * v.yzz);
}

fn moments_of(word: u32, level: Level) -> Moments {
    let one = moments_of_one(v_code(word));
    if !PYRAMID {
        return one;
    }
    let x = f32(word & 127u) * (1.0 / 127.0);
    let z = f32((word >> 7u) & 127u) * (1.0 / 127.0);
    let yy = max(1.0 - x * x - z * z, 0.0);
    let y = sqrt(yy);
    let bits = vec3<u32>(word << 12u, word << 6u, word);
    let r = vec3<f32>(bitcast<vec3<i32>>(bits) >> vec3<u32>(26u)) * (1.0 / 31.0);
    let is_whole = level.number == 0u;
    return Moments(
        select(vec3<f32>(x * x, yy, z * z), one.diagonal, is_whole),
        select(r * vec3<f32>(x * y, x * z, y * z), one.mixed, is_whole),
    );
}

// Values interpolated between the eight cell centres around `middle`, the midpoint of the ray's segment in a
// cell, in the level's cells. Twin: Level::sample_trilinear.
fn sample_trilinear(
    level: Level,
    matter: SheetDensity,
    cell: vec3<i32>,
    middle: vec3<f32>,
    is_single: bool,
) -> CellSample {
    let inside = middle - floor(middle) - 0.5;
    let side = select(vec3<i32>(1), vec3<i32>(-1), inside < vec3<f32>(0.0));
    let far = abs(inside);
    var rho = 0.0;
    var k = vec2<f32>(0.0);
    var moments = Moments(vec3<f32>(0.0), vec3<f32>(0.0));
    for (var corner = 0; corner < 8; corner++) {
        let away = vec3<i32>(corner & 1, (corner >> 1u) & 1, corner >> 2u);
        let shares = select(far, 1.0 - far, away == vec3<i32>(0));
        var index = cell + side * away;
        let inside = clamp(index, vec3<i32>(0), level.size - 1);
        index = select(index, level.size - 1, index < vec3<i32>(0));
        index = select(index, vec3<i32>(0), index >= level.size);
        index.z = inside.z;
        index = select(index, inside, is_single);
        let texel = cell_words(in_texture(index, level));
        let weight = shares.x * shares.y * shares.z * f32(texel.x & 0xffffu);
        rho += weight;
        k += vec2<f32>(f32((texel.x >> 16u) & 0xffu), f32(texel.x >> 24u)) * weight;
        // The direction's code is not of unit length; dividing by the trace keeps that from acting as a
        // weight.
        let own = moments_of(texel.y, level);
        let share = weight / max(own.diagonal.x + own.diagonal.y + own.diagonal.z, 1e-20);
        moments.diagonal += own.diagonal * share;
        moments.mixed += own.mixed * share;
    }
    let inverse = 1.0 / max(rho, 1e-20);
    k *= inverse;
    moments.diagonal *= inverse;
    moments.mixed *= inverse;
    return CellSample(matter_rho(rho, matter), k.x, k.y, moments);
}

// Terms of the fibre model that a ray and a distribution of directions share. `metric` and `e_v` as in View.
struct Spread {
    moments: Moments,
    // S·e / tr(M·S).
    s_e: vec3<f32>,
    inverse_q: f32,
    // Mean of (t·e)² over the distribution.
    cos2_e: f32,
    // Variance of the directions in the world, radians²; see Spread::variance.
    variance: f32,
}

// `metric` = (M₀₀, 2M₀₁, M₁₁, M₂₂).
fn spread_new(metric: vec4<f32>, moments: Moments, e_v: vec3<f32>) -> Spread {
    let s = moments.diagonal;
    let m = moments.mixed;
    let b = 0.5 * metric.y;
    // P = M·S.
    let p0 = vec3<f32>(metric.x * s.x + b * m.x, metric.x * m.x + b * s.y, metric.x * m.y + b * m.z);
    let p1 = vec3<f32>(b * s.x + metric.z * m.x, b * m.x + metric.z * s.y, b * m.y + metric.z * m.z);
    let p2 = vec3<f32>(metric.w * m.y, metric.w * m.z, metric.w * s.z);
    let inverse_q = 1.0 / max(p0.x + p1.y + p2.z, 1e-30);
    let crossed = p0.y * p1.x + p0.z * p2.x + p1.z * p2.y;
    let squares = p0.x * p0.x + p1.y * p1.y + p2.z * p2.z + 2.0 * crossed;
    let s_e = moments_times(moments, e_v) * inverse_q;
    let variance = max(0.5 - 0.5 * squares * inverse_q * inverse_q, 0.0);
    return Spread(moments, s_e, inverse_q, dot3(s_e, e_v), variance);
}

// Means of (t·l)² and of (t·l)(t·e) over the distribution.
fn spread_cosines(spread: Spread, l_v: vec3<f32>) -> vec2<f32> {
    let cos2_l = dot3(moments_times(spread.moments, l_v), l_v) * spread.inverse_q;
    return vec2<f32>(cos2_l, dot3(spread.s_e, l_v));
}

// t·l and t·e of a single direction with these means. The sign common to both is arbitrary.
fn spread_of_one(spread: Spread, l_v: vec3<f32>) -> vec2<f32> {
    let cosines = spread_cosines(spread, l_v);
    let e = sqrt(clamp(spread.cos2_e, 0.0, 1.0));
    return vec2<f32>(sqrt(clamp(cosines.x, 0.0, 1.0)), select(e, -e, cosines.y < 0.0));
}

// Cosines of spread_of_one with the sign by which the direction runs along `way`, a covector as `l_v`. Twin:
// Spread::along.
fn spread_along(spread: Spread, l_v: vec3<f32>, way: vec3<f32>) -> vec2<f32> {
    let one = spread_of_one(spread, l_v);
    let mean = moments_times(spread.moments, l_v) * spread.inverse_q + spread.s_e;
    return select(one, -one, (dot3(mean, way) < 0.0) != (one.x + one.y < 0.0));
}

// Whether a cell of the level has one direction, whose sign is known.
fn has_one_direction(level: Level) -> bool {
    return !TRILINEAR & (level.number == 0u);
}

// Summands of Ψ of a distribution of directions. Twin: Spread::psi_parts, where the highlight's widening is
// derived.
fn spread_psi_parts(
    spread: Spread,
    k_d: f32,
    k_s: f32,
    p: f32,
    l_v: vec3<f32>,
    l_dot_e: f32,
) -> vec2<f32> {
    let cosines = spread_cosines(spread, l_v);
    let sin2_l = max(1.0 - cosines.x, 0.0);
    let sin2_e = max(1.0 - spread.cos2_e, 0.0);
    let root = sqrt(sin2_l * sin2_e);
    let cos_phi = clamp((l_dot_e - cosines.y) / max(root, 1e-6), -1.0, 1.0);
    let variance = spread.variance * (1.0 + cos_phi);
    let base = clamp(root - cosines.y + 0.5 * variance, 0.0, 1.0);
    let wide = 1.0 + p * variance;
    return vec2<f32>(k_d * sqrt(sin2_l), k_s * pow(base, p / wide) / sqrt(wide));
}
