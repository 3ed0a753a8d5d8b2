//! Rays through a smooth dielectric cylinder: Fresnel reflectance, the modified index, the exit direction and
//! the power that leaves.
//!
//! θ is the inclination against the plane across the cylinder, with sin θ = t·w for a ray's direction w. h is
//! the offset of a ray from the axis in radii, and γ the angle to the surface normal in that plane, with h =
//! sin γ_i.

use glam::DVec3;

/// Number of lobes: R, TT, TRT, and a residual for all longer paths.
pub const LOBES: usize = 4;

/// Share of the power that a plane interface reflects (Fresnel 1823), for light polarised perpendicular (s)
/// and parallel (p) to the plane of incidence. `cos_i` is the cosine outside, `cos_t` the cosine inside, and
/// `eta` the index inside divided by the index outside.
pub fn fresnel(cos_i: f64, cos_t: f64, eta: f64) -> [f64; 2] {
    let s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    let p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    [s * s, p * p]
}

/// Cosine of the angle of refraction (Snell's law).
pub fn refracted_cosine(cos_i: f64, eta: f64) -> f64 {
    (1.0 - (1.0 - cos_i * cos_i) / (eta * eta)).max(0.0).sqrt()
}

/// Modified index η′: the index that a ray inclined by θ_d meets in the plane across the cylinder (Bravais;
/// Marschner et al. 2003, §4). It is infinite for a ray along the cylinder.
pub fn modified_index(eta: f64, cos_d: f64) -> f64 {
    (eta * eta - 1.0 + cos_d * cos_d).sqrt() / cos_d
}

/// Exit azimuth Φ_p(h) = 2pγ_t − 2γ_i + pπ in radians, measured from the light, of a ray that has crossed the
/// cylinder p times (Marschner et al. 2003, eq. 5). `sin_t` = h / η′.
pub fn exit_azimuth(p: usize, h: f64, sin_t: f64) -> f64 {
    let p = p as f64;
    2.0 * p * sin_t.asin() - 2.0 * h.asin() + p * std::f64::consts::PI
}

/// Passage of one ray of inclination θ_d and offset h through the cylinder.
#[derive(Clone, Copy, Debug)]
pub struct Passage {
    /// A_p of R, TT, TRT and the residual: the share of the ray's power that leaves after p crossings, linear
    /// RGB. The sum is 1 without absorption.
    pub attenuation: [DVec3; LOBES],
    /// Φ_p of R, TT and TRT, radians.
    pub azimuth: [f64; 3],
}

impl Passage {
    /// Traces a ray. `cos_d` is the cosine of θ_d and `depth` the optical depth σ_a · 2r of a diameter.
    ///
    /// Half the light is polarised s and half p, and it keeps its polarisation from one interface to the
    /// next. That is exact for rays across the cylinder, which make the rainbow. For inclined rays the plane
    /// of incidence turns between interfaces; this rotation is neglected.
    pub fn new(eta: f64, cos_d: f64, h: f64, depth: DVec3) -> Self {
        // The formula avoids η′, which is infinite for a ray along the cylinder.
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
            // At grazing incidence no light enters. The bound makes the quotient 0 instead of 0/0.
            attenuation[3] += 0.5 * a * inward / (DVec3::ONE - inward).max(DVec3::splat(1e-300));
        }
        Passage { attenuation, azimuth: [0, 1, 2].map(|p| exit_azimuth(p, h, sin_t)) }
    }
}
