// §5 Optics of shells in which light scatters many times, and the surface of skin. Twin:
// src/light/scatter/optics.rs, which holds the reasoning.

#import layout
#import light::scatter
#import mapping::shell
#import trace::lookup

const SURFACE_EXTINCTION: f32 = 24.0;
const LEAST_VISIBLE: f32 = 5.9604644775390625e-8;
const LEAST_UPRIGHT: f32 = 0.01;

struct Optics {
    // a; 0 where light scatters once.
    extinction: vec3<f32>,
    g: f32,
    // ω' over the cell's colour.
    albedo: vec3<f32>,
    // Index of refraction of the surface; 0 for fibres.
    eta: f32,
    // b over the cell's colour.
    isotropic: vec3<f32>,
    roughness: f32,
}

// Optics of a cell with its colour.
struct CellOptics {
    extinction: vec3<f32>,
    albedo: vec3<f32>,
    reduced: vec3<f32>,
    isotropic: vec3<f32>,
    whole: vec3<f32>,
}

// Way of a view ray through a cell: T at the shell's start times the level's share, and depths in bits from
// the shell's start to the cell and in the cell.
struct Passage {
    start: f32,
    view: f32,
    cell: f32,
}

// Mean normal of a cell, and the sum of the variances of its slopes.
struct CellNormal {
    m: vec3<f32>,
    variance: f32,
}

fn optics_of_cell(optics: Optics, color: vec3<f32>) -> CellOptics {
    let albedo = optics.albedo * color;
    let isotropic = optics.isotropic * color;
    let whole = isotropic * (4.0 / (1.0 - optics.g));
    return CellOptics(optics.extinction, albedo, albedo * 0.25, isotropic, whole);
}

// w'.
fn passage_weight(passage: Passage, extinction: vec3<f32>) -> vec3<f32> {
    let passed = exp2(extinction * -passage.view);
    return (passed - exp2(extinction * -(passage.view + passage.cell))) * passage.start;
}

fn passage_surface_weight(passage: Passage) -> f32 {
    let passed = exp2(-SURFACE_EXTINCTION * passage.view);
    return (passed - exp2(-SURFACE_EXTINCTION * (passage.view + passage.cell))) * passage.start;
}

// Positions that stand for a cell of so many bits: of light from a light, and of diffuse light.
fn cell_within(bits: f32) -> vec2<f32> {
    let tau = bits * LN_2;
    let passed = exp2(-bits);
    let thick = vec2<f32>((1.0 - log2(1.0 + passed)) / bits, 1.0 / tau - passed / (1.0 - passed));
    return select(thick, 0.5 - tau * vec2<f32>(1.0 / 8.0, 1.0 / 12.0), bits < 0.1);
}

// Optical depth from a cell to a light, where V in the shell is `through`.
fn arriving_depth(through: f32) -> f32 {
    return -log2(max(through, 1e-30));
}

// V' in a medium with this extinction. `arriving` is V in the shell, and the share past opaque matter.
fn arriving_reduced(arriving: vec2<f32>, extinction: vec3<f32>, depth: f32) -> vec3<f32> {
    return exp2(extinction * -depth) * select(0.0, arriving.y, arriving.x > LEAST_VISIBLE);
}

// Radiance of a cell of fibres for a light of intensity 1, without single scattering and diffuse light.
fn optics_more(own: CellOptics, weight: vec3<f32>, once: f32, peak: Peak, arriving: vec2<f32>) -> vec3<f32> {
    let depth = arriving_depth(arriving.x);
    let s = own.whole * (depth * LN_2);
    // Σ h_n s^(n−1)/(n−1)! by Horner's rule.
    var forward = vec3<f32>(peak.last * 0.2);
    forward = (forward * s + peak.first.w) * 0.25;
    forward = (forward * s + peak.first.z) * (1.0 / 3.0);
    forward = (forward * s + peak.first.y) * 0.5;
    forward = (forward * s + peak.first.x) * s;
    let sum = weight * (own.reduced * arriving_reduced(arriving, own.extinction, depth))
        + (own.whole * forward - own.isotropic) * once;
    return max(sum, vec3<f32>(0.0));
}

fn surface_refracted(eta: f32, mu: f32) -> f32 {
    return sqrt(max(1.0 - (1.0 - mu * mu) / (eta * eta), 0.0));
}

fn surface_fresnel(eta: f32, mu: f32) -> f32 {
    let inside = surface_refracted(eta, mu);
    let across = (mu - eta * inside) / max(mu + eta * inside, 1e-6);
    let along = (eta * mu - inside) / max(eta * mu + inside, 1e-6);
    return 0.5 * (across * across + along * along);
}

fn surface_stretch(eta: f32, mu: f32) -> f32 {
    return mu / max(surface_refracted(eta, mu), 1e-6);
}

// Share of the radiance inside that leaves, and the factor of the way inside.
fn surface_leaving(eta: f32, mu: f32) -> vec2<f32> {
    return vec2<f32>((1.0 - surface_fresnel(eta, mu)) / (eta * eta), surface_stretch(eta, mu));
}

// Factor of the radiance of light that scatters once below the surface, and of its way inside.
fn surface_entering(eta: f32, mu: f32) -> vec2<f32> {
    let stretch = surface_stretch(eta, mu);
    return vec2<f32>((1.0 - surface_fresnel(eta, mu)) * stretch, stretch);
}

// π·f·(m·l).
fn surface_lobe(eta: f32, m: vec3<f32>, l: vec3<f32>, e: vec3<f32>, alpha2: f32) -> f32 {
    let m_l = max(dot3(m, l), 0.0);
    let m_e = max(dot3(m, e), 1e-4);
    let sum = l + e;
    let h = sum * (1.0 / sqrt(max(dot3(sum, sum), 1e-12)));
    let m_h = dot3(m, h);
    let s = m_h * m_h * (alpha2 - 1.0) + 1.0;
    let normals = alpha2 / max(s * s, 1e-12);
    let smith = m_l * sqrt(alpha2 + (1.0 - alpha2) * m_e * m_e)
        + m_e * sqrt(alpha2 + (1.0 - alpha2) * m_l * m_l);
    return surface_fresnel(eta, max(dot3(e, h), 0.0)) * normals * 0.5 * m_l / max(smith, 1e-6);
}

fn cell_normal(moments: Moments, j: ShellJacobian) -> CellNormal {
    let all = moments.diagonal;
    let inverse = 1.0 / max(max(all.z, LEAST_UPRIGHT * (all.x + all.y + all.z)), 1e-30);
    let x = moments.mixed.y * inverse;
    let y = moments.mixed.z * inverse;
    let row_x = cross3(j.y, j.z);
    let row_y = cross3(j.z, j.x);
    let row_z = cross3(j.x, j.y);
    let inward = row_x * x + row_y * y + row_z;
    let squared = max(dot3(inward, inward), 1e-30);
    let scale = 1.0 / sqrt(squared);
    let sum = dot3(row_x, row_x) * (all.x * inverse - x * x)
        + dot3(row_x, row_y) * (2.0 * (moments.mixed.x * inverse - x * y))
        + dot3(row_y, row_y) * (all.y * inverse - y * y);
    return CellNormal(inward * select(-scale, scale, dot3(j.x, row_x) < 0.0), max(sum / squared, 0.0));
}
