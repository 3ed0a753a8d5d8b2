//! §5 Light in skin: absorption and scattering by its layers.
//!
//! Collagen scatters light in the dermis and the blood in it absorbs green and blue; melanin darkens the
//! epidermis above. A renderer needs three numbers for each, so the spectra are taken at one wavelength in
//! each of red, green and blue:
//!
//! - **Reduced scattering** of skin: 46 cm⁻¹ · (λ / 500 nm)^−1.421 (Jacques, "Optical properties of
//!   biological tissues: a review", Physics in Medicine and Biology 58, 2013, table 1). The scattering is
//!   reduced by similarity, so it is isotropic.
//! - **Absorption** without melanin and blood: 0.244 + 85.3 · e^(−(λ − 154 nm) / 66.2 nm) cm⁻¹, and of
//!   melanosomes: 6.6·10¹¹ · (λ / nm)^−3.33 cm⁻¹ (Jacques, "Skin optics", Oregon Medical Laser Center News,
//!   January 1998).
//! - **Absorption of blood** with 150 g of haemoglobin a litre, from the molar extinction with and without
//!   oxygen that Prahl compiled ("Optical absorption of hemoglobin", Oregon Medical Laser Center, 1999).

use glam::Vec3;

/// Wavelengths that stand for red, green and blue, nm.
pub const WAVELENGTHS: [f32; 3] = [610.0, 550.0, 466.0];

/// Molar extinction of haemoglobin at [`WAVELENGTHS`] with oxygen and without, cm⁻¹/(mol/l).
const WITH_OXYGEN: Vec3 = Vec3::new(1506.0, 43016.0, 37073.2);
const WITHOUT_OXYGEN: Vec3 = Vec3::new(9443.6, 53412.0, 18142.4);
/// ln 10 · 150 g/l ÷ 64,500 g/mol: absorption, cm⁻¹, of a molar extinction.
const MOLES: f32 = std::f32::consts::LN_10 * 150.0 / 64_500.0;

/// Centimetres in a metre.
const CM: f32 = 100.0;

/// Factor on melanin in freckles, and on blood where skin is flushed.
const FRECKLED: f32 = 4.0;
const FLUSHED: f32 = 3.0;

/// Composition of skin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tissue {
    /// Share of the epidermis that melanosomes fill, 0 to 1.
    pub melanin: f32,
    /// Share of the dermis that blood fills, 0 to 1.
    pub blood: f32,
    /// Share of the haemoglobin that carries oxygen, 0 to 1.
    pub oxygen: f32,
}

impl Tissue {
    /// Reduced scattering coefficient of all layers, 1/m, by colour.
    pub fn scattering() -> Vec3 {
        by_wavelength(|nm| 46.0 * CM * (nm / 500.0).powf(-1.421))
    }

    /// Absorption coefficient of the dermis, 1/m, by colour.
    pub fn dermis(&self) -> Vec3 {
        let blood = (WITH_OXYGEN * self.oxygen + WITHOUT_OXYGEN * (1.0 - self.oxygen)) * (MOLES * CM);
        baseline() * (1.0 - self.blood) + blood * self.blood
    }

    /// Absorption coefficient of the epidermis, 1/m, by colour.
    pub fn epidermis(&self) -> Vec3 {
        let melanosomes = by_wavelength(|nm| 6.6e11 * CM * nm.powf(-3.33));
        baseline() * (1.0 - self.melanin) + melanosomes * self.melanin
    }

    /// Extinction by colour, relative to that of green, in the reduced dermis.
    pub fn extinction(&self) -> Vec3 {
        let extinction = Tissue::scattering() + self.dermis();
        extinction / extinction.y
    }

    /// Albedo of the reduced matter, by colour, at the four places on the ramp of a volume of skin: freckled
    /// epidermis, epidermis, dermis, and flushed dermis. The epidermis fills `share` of a layer of cells, and
    /// dermis the rest.
    pub fn albedos(&self, share: f32) -> [Vec3; 4] {
        let freckled = Tissue { melanin: (self.melanin * FRECKLED).min(1.0), ..*self };
        let flushed = Tissue { blood: (self.blood * FLUSHED).min(1.0), ..*self };
        let with = |epidermis: Vec3| albedo(self.dermis().lerp(epidermis, share));
        [with(freckled.epidermis()), with(self.epidermis()), albedo(self.dermis()), albedo(flushed.dermis())]
    }
}

/// Absorption coefficient of skin without melanin and blood, 1/m, by colour.
fn baseline() -> Vec3 {
    by_wavelength(|nm| (0.244 + 85.3 * (-(nm - 154.0) / 66.2).exp()) * CM)
}

/// Albedo of reduced matter with this absorption coefficient, 1/m.
fn albedo(absorption: Vec3) -> Vec3 {
    Tissue::scattering() / (Tissue::scattering() + absorption)
}

fn by_wavelength(of: impl Fn(f32) -> f32) -> Vec3 {
    Vec3::from_array(WAVELENGTHS.map(of))
}
