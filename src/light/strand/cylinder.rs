//! Rays through a smooth dielectric cylinder: Fresnel, the modified index, where a ray leaves and how much of
//! it is left.
//!
//! θ is the inclination against the plane across the cylinder (sin θ = t·w), h the offset of a ray from the
//! axis in radii, γ the angle to the surface's normal in that plane (h = sin γ_i).

use glam::DVec3;

/// Index of refraction of water at 20 °C in yellow light.
pub const ETA: f64 = 1.333;

/// Number of lobes: R, TT, TRT, and the residual of all longer ways.
pub const LOBES: usize = 4;

/// Share of the power that a plane interface reflects, polarised across (s) and in (p) the plane of
/// incidence; `cos_i` outside, `cos_t` inside, `eta` the index inside over that outside (Fresnel 1823).
pub fn fresnel(cos_i: f64, cos_t: f64, eta: f64) -> [f64; 2] {
    let s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    let p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    [s * s, p * p]
}

/// Cosine of the angle of refraction (Snell).
pub fn refracted_cosine(cos_i: f64, eta: f64) -> f64 {
    (1.0 - (1.0 - cos_i * cos_i) / (eta * eta)).max(0.0).sqrt()
}

/// η′, the index a ray inclined by θ_d seems to meet in the plane across the cylinder (Bravais; Marschner et
/// al. 2003, §4): infinite for a ray along it.
pub fn modified_index(eta: f64, cos_d: f64) -> f64 {
    (eta * eta - 1.0 + cos_d * cos_d).sqrt() / cos_d
}

/// Φ_p(h), azimuth from the light to the direction in which the ray leaves that has crossed the cylinder p
/// times: 2pγ_t − 2γ_i + pπ (Marschner et al. 2003, eq. 5). `sin_t` = h / η′.
pub fn exit_azimuth(p: usize, h: f64, sin_t: f64) -> f64 {
    let p = p as f64;
    2.0 * p * sin_t.asin() - 2.0 * h.asin() + p * std::f64::consts::PI
}

/// One ray of inclination θ_d and offset h on its way through the cylinder.
#[derive(Clone, Copy, Debug)]
pub struct Passage {
    /// A_p of R, TT, TRT and the residual: what of the ray's power leaves after p passages, linear RGB. Their
    /// sum is 1 where nothing is absorbed.
    pub attenuation: [DVec3; LOBES],
    /// Φ_p of R, TT and TRT.
    pub azimuth: [f64; 3],
}

impl Passage {
    /// `depth` is σ_a · 2r, the optical depth of a diameter.
    ///
    /// The light is half s, half p, and keeps its polarisation from one interface to the next: exact across
    /// the cylinder, where the bow is; further along it the planes of incidence turn, which is left out.
    pub fn new(eta: f64, cos_d: f64, h: f64, depth: DVec3) -> Self {
        // Written without η′ itself, which is infinite for a ray along the cylinder.
        let inside = (eta * eta - 1.0 + cos_d * cos_d).sqrt();
        let sin_t = h * cos_d / inside;
        let cos_gamma_t = (1.0 - sin_t * sin_t).sqrt();
        let cos_theta_t = inside / eta;
        let transmittance = (depth * (-cos_gamma_t / cos_theta_t)).map(f64::exp);
        let cos_i = cos_d * (1.0 - h * h).max(0.0).sqrt();
        let mut attenuation = [DVec3::ZERO; LOBES];
        for f in fresnel(cos_i, refracted_cosine(cos_i, eta), eta) {
            let inward = transmittance * f;
            let mut a = transmittance * ((1.0 - f) * (1.0 - f));
            attenuation[0] += 0.5 * f;
            attenuation[1] += 0.5 * a;
            a *= inward;
            attenuation[2] += 0.5 * a;
            // At grazing incidence nothing gets in: 0, not 0/0.
            attenuation[3] += 0.5 * a * inward / (DVec3::ONE - inward).max(DVec3::splat(1e-300));
        }
        Passage { attenuation, azimuth: [0, 1, 2].map(|p| exit_azimuth(p, h, sin_t)) }
    }
}
