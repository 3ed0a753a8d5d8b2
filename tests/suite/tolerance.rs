//! The only tolerances of the project. Other comparisons are exact, or have a bound that their test derives
//! from float32 rounding or from the size of its sample.

use std::sync::LazyLock;

use taki::engine::gpu::{DeviceOptions, Gpu};

/// GPU against CPU: largest relative difference of a pixel's linear radiance that counts as equal. Both run
/// the same float32 operations in the same order. `exp2`, `sqrt`, division and fused products differ by some
/// ulp each, over a few hundred cells.
pub const PARITY_RELATIVE: f32 = 1e-3;

/// GPU against CPU: largest absolute difference that counts as equal in dark pixels.
pub const PARITY_ABSOLUTE: f32 = 1e-4;

/// GPU against CPU: share of pixels that must be equal. The others may lie on an edge between two quads or on
/// a ray through a cell's corner, where one ulp selects another cell.
pub const PARITY_SHARE: f64 = 0.999;

/// GPU against CPU, where the device snaps corners to 1/16 pixel and not, as the CPU engine and most devices
/// do, to 1/256. Corners then lie up to 1/32 pixel elsewhere: what rock shows varies by a few hundredths
/// inside a pixel, and one pixel in sixteen along an edge lies on its other side
/// (`findings/swiftshader-sub-pixels.sh`).
pub const COARSE_CORNERS: Parity = Parity { relative: 0.05, absolute: 0.005, share: 0.985 };

/// GPU against CPU on all other devices.
pub const FINE_CORNERS: Parity =
    Parity { relative: PARITY_RELATIVE, absolute: PARITY_ABSOLUTE, share: PARITY_SHARE };

/// Tolerances of a comparison between the engines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parity {
    /// Largest relative difference that counts as equal.
    pub relative: f32,
    /// Largest absolute difference that counts as equal.
    pub absolute: f32,
    /// Share of pixels that must be equal.
    pub share: f64,
}

impl Parity {
    /// Tolerances for the adapter that tests run on. wgpu does not tell its sub-pixel bits; among the drivers
    /// for desktops, only SwiftShader has 4.
    pub fn of_adapter() -> Parity {
        static PARITY: LazyLock<Parity> = LazyLock::new(|| match Gpu::open(&DeviceOptions::default()) {
            Ok(gpu) if gpu.info.driver.contains("SwiftShader") => COARSE_CORNERS,
            _ => FINE_CORNERS,
        });
        *PARITY
    }

    /// Whether corners are snapped coarsely.
    pub fn is_coarse(&self) -> bool {
        *self == COARSE_CORNERS
    }
}

/// One ray in float32 against a closed form in float64. The transmittance is a product over up to about 500
/// cells. Each factor is good to about 2^-24 of itself and of its exponent: 500 · 6e-8 = 3e-5 if all round
/// the same way, and a tenth of that in practice. Twice this tolerance would hide a lost cell of 1e-5.
pub const CLOSED_FORM_RELATIVE: f64 = 1e-5;

/// Whether `a` and `b` differ by at most a share `relative` of the larger one or by at most `absolute`. Never
/// true for NaN.
pub fn close(a: f64, b: f64, relative: f64, absolute: f64) -> bool {
    a == b || (a - b).abs() <= absolute.max(relative * a.abs().max(b.abs()))
}

#[test]
fn close_tells_near_from_far_and_never_accepts_nan() {
    assert!(close(1.0, 1.0 + 0.9e-5, 1e-5, 0.0));
    assert!(!close(1.0, 1.0 + 1.1e-5, 1e-5, 0.0));
    assert!(close(0.0, 1e-7, 1e-5, 1e-6) && !close(0.0, 2e-6, 1e-5, 1e-6));
    assert!(!close(1.0, -1.0, 1e-5, 1e-6));
    assert!(!close(f64::NAN, f64::NAN, 1.0, 1.0) && !close(0.0, f64::NAN, 1.0, 1.0));
    assert!(!close(f64::INFINITY, 1.0, 0.0, 1e-6));
}
