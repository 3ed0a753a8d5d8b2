// §5 Multiple scattering. Twin: src/light/scatter/mod.rs, which explains the formula.

const COSINES: u32 = 16u;
const VIEWS: u32 = 12u;
const LN_2: f32 = 0.693147180559945309;

// Reduced medium, per colour: extinction a = 1 − ωg, albedo ω, reduced b' = ω'/4, isotropic b = ω(1 − g)/4.
struct Similarity {
    extinction: vec3<f32>,
    g: f32,
    albedo: vec3<f32>,
    pad_0: f32,
    reduced: vec3<f32>,
    pad_1: f32,
    isotropic: vec3<f32>,
    pad_2: f32,
}

// Position of a light in a profile: two rows of `layers` values, the first gain of the nearer row, and the
// share between the rows.
struct Row {
    near: u32,
    far: u32,
    gain: u32,
    share: f32,
}

// Position of the eye in a row of gains.
struct GainColumn {
    below: u32,
    share: f32,
}

// Forward peak: h₂ … h₅, and h₆.
struct Peak {
    first: vec4<f32>,
    last: f32,
}

fn scatter_row(l_n: f32, layers: u32) -> Row {
    let position = sqrt(min(abs(l_n), 1.0)) * f32(COSINES - 1u);
    let below = min(u32(position), COSINES - 2u);
    let row = select(0u, COSINES, l_n < 0.0) + below;
    let near = row * layers;
    return Row(near, near + layers, 2u * COSINES * layers + row * VIEWS, position - f32(below));
}

fn scatter_column(e_n: f32) -> GainColumn {
    let position = sqrt(min(abs(e_n), 1.0)) * f32(VIEWS - 1u);
    let below = min(u32(position), VIEWS - 2u);
    return GainColumn(below, position - f32(below));
}

// Gain and fill, from the profile's values in the column and the next, in the row of the light and the next.
fn scatter_gain(
    near: array<vec4<f32>, 2>, far: array<vec4<f32>, 2>, row: Row, column: GainColumn,
) -> vec4<f32> {
    let n = near[0] + (near[1] - near[0]) * column.share;
    let f = far[0] + (far[1] - far[0]) * column.share;
    return n + (f - n) * row.share;
}

// Reduced medium of mist of that Ψ, or with 0 that of flowing water.
fn scatter_similarity(water: Similarity, mist: f32) -> Similarity {
    var out = water;
    if mist > 0.0 {
        let isotropic = vec3<f32>(min(4.0 * mist, 1.0) * 0.25);
        out = Similarity(vec3<f32>(1.0), 0.0, isotropic * 4.0, 0.0, isotropic, 0.0, isotropic, 0.0);
    }
    return out;
}

// P, from the profile's values at row.near + z and row.far + z.
fn scatter_diffuse(near: vec3<f32>, far: vec3<f32>, row: Row) -> vec3<f32> {
    return near + (far - near) * row.share;
}

fn scatter_peak(g: f32, cos: f32) -> Peak {
    let g2 = g * g;
    let power = vec4<f32>(g2, g2 * g, g2 * g * g, g2 * g * g * g);
    let last = power.w * g;
    let s = 1.0 + power * power - 2.0 * power * cos;
    let s_last = 1.0 + last * last - 2.0 * last * cos;
    let peak = (1.0 - power * power) / (s * sqrt(s)) - (1.0 - power);
    let peak_last = (1.0 - last * last) / (s_last * sqrt(s_last)) - (1.0 - last);
    return Peak(0.25 * peak, 0.25 * peak_last);
}

fn scatter_multiple(
    similarity: Similarity,
    peak: Peak,
    diffuse: vec3<f32>,
    view: f32,
    cell: f32,
    light: f32,
) -> vec3<f32> {
    let passed = exp2(similarity.extinction * -view);
    let weight_reduced = passed - exp2(similarity.extinction * -(view + cell));
    let seen_reduced = exp2(similarity.extinction * -light);
    let once = exp2(-(view + light)) * (1.0 - exp2(-cell));
    let s = similarity.albedo * (light * LN_2);
    // Σ h_n s^(n−1)/(n−1)! by Horner's rule.
    var forward = vec3<f32>(peak.last * 0.2);
    forward = (forward * s + peak.first.w) * 0.25;
    forward = (forward * s + peak.first.z) * (1.0 / 3.0);
    forward = (forward * s + peak.first.y) * 0.5;
    forward = (forward * s + peak.first.x) * s;
    let sum = weight_reduced * (diffuse + similarity.reduced * seen_reduced)
        + (similarity.albedo * forward - similarity.isotropic) * once;
    return max(sum, vec3<f32>(0.0));
}
