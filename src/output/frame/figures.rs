//! Figures of a picture that add up from those of its parts.

use std::path::Path;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{ExrLines, Format, PictureRows};
use crate::picture::Frame;
use crate::util::error::Result;

/// Units of a sum in 1. Sums are whole numbers, which add up to the same value in any order.
const UNIT: f64 = 65536.0;
/// Largest value that is added. Brighter ones are clamped, so that the sum over the largest picture fits.
const BRIGHTEST: f32 = 1_048_576.0;

/// Figures of a picture or of a part of one. The figures of parts that do not overlap add up exactly to those
/// of the whole.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Figures {
    /// Number of pixels.
    pub pixels: u64,
    /// Number of pixels with a volume quad in any sample.
    pub covered_pixels: u64,
    /// Number of cells that view rays walk, over all samples.
    pub cells_walked: u64,
    /// Number of cells that light rays walk, over all samples.
    pub light_cells_walked: u64,
    /// Number of pixels whose radiance or transmittance is infinite or not a number.
    pub non_finite_pixels: u64,
    /// Sum over the pixels of linear R, G, B, each at most 2²⁰ and rounded, in units of 2⁻¹⁶.
    pub radiance_sum: [i128; 3],
    /// Sum over the pixels of the transmittance, rounded, in units of 2⁻¹⁶.
    pub transmittance_sum: i128,
}

impl Figures {
    /// Returns the figures of a frame.
    pub fn of(frame: &Frame) -> Figures {
        const CHUNK: usize = 1 << 14;
        let chunks = frame.radiance.par_chunks(CHUNK).zip(frame.counts.par_chunks(CHUNK));
        let sums = chunks.map(|(radiance, counts)| {
            let mut sum = Figures { pixels: radiance.len() as u64, ..Default::default() };
            let mut light = [0i64; 4];
            for (value, count) in radiance.iter().zip(counts) {
                sum.covered_pixels += u64::from(count[0] > 0);
                sum.cells_walked += u64::from(count[0]);
                sum.light_cells_walked += u64::from(count[1]);
                sum.non_finite_pixels += u64::from(!value.iter().all(|x| x.is_finite()));
                (0..4).for_each(|c| light[c] += fixed(value[c]));
            }
            let [r, g, b, transmittance] = light.map(i128::from);
            (sum.radiance_sum, sum.transmittance_sum) = ([r, g, b], transmittance);
            sum
        });
        sums.reduce(Figures::default, |mut a, b| {
            a.add(&b);
            a
        })
    }

    /// Adds the figures of another part.
    pub fn add(&mut self, other: &Figures) {
        self.pixels = self.pixels.saturating_add(other.pixels);
        self.covered_pixels = self.covered_pixels.saturating_add(other.covered_pixels);
        self.cells_walked = self.cells_walked.saturating_add(other.cells_walked);
        self.light_cells_walked = self.light_cells_walked.saturating_add(other.light_cells_walked);
        self.non_finite_pixels = self.non_finite_pixels.saturating_add(other.non_finite_pixels);
        for (sum, more) in self.radiance_sum.iter_mut().zip(other.radiance_sum) {
            *sum = sum.saturating_add(more);
        }
        self.transmittance_sum = self.transmittance_sum.saturating_add(other.transmittance_sum);
    }

    /// Returns the mean linear R, G, B of the pixels.
    pub fn mean_radiance(&self) -> [f64; 3] {
        self.radiance_sum.map(|sum| mean(sum, self.pixels))
    }

    /// Returns the mean transmittance of the pixels.
    pub fn mean_transmittance(&self) -> f64 {
        mean(self.transmittance_sum, self.pixels)
    }
}

/// Figures that a file contains; `None` for those that it lacks.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct KnownFigures {
    /// Number of pixels in the file.
    pub pixels: u64,
    /// See [`Figures::covered_pixels`].
    pub covered_pixels: Option<u64>,
    /// See [`Figures::cells_walked`].
    pub cells_walked: Option<u64>,
    /// See [`Figures::light_cells_walked`].
    pub light_cells_walked: Option<u64>,
    /// See [`Figures::non_finite_pixels`].
    pub non_finite_pixels: Option<u64>,
    /// See [`Figures::radiance_sum`].
    pub radiance_sum: Option<[i128; 3]>,
    /// See [`Figures::transmittance_sum`].
    pub transmittance_sum: Option<i128>,
}

impl From<Figures> for KnownFigures {
    fn from(f: Figures) -> Self {
        KnownFigures {
            pixels: f.pixels,
            covered_pixels: Some(f.covered_pixels),
            cells_walked: Some(f.cells_walked),
            light_cells_walked: Some(f.light_cells_walked),
            non_finite_pixels: Some(f.non_finite_pixels),
            radiance_sum: Some(f.radiance_sum),
            transmittance_sum: Some(f.transmittance_sum),
        }
    }
}

impl KnownFigures {
    /// Adds the figures that another file of the same picture has.
    pub fn join(self, other: KnownFigures) -> KnownFigures {
        KnownFigures {
            pixels: self.pixels,
            covered_pixels: self.covered_pixels.or(other.covered_pixels),
            cells_walked: self.cells_walked.or(other.cells_walked),
            light_cells_walked: self.light_cells_walked.or(other.light_cells_walked),
            non_finite_pixels: self.non_finite_pixels.or(other.non_finite_pixels),
            radiance_sum: self.radiance_sum.or(other.radiance_sum),
            transmittance_sum: self.transmittance_sum.or(other.transmittance_sum),
        }
    }

    /// Returns the mean linear R, G, B of the pixels.
    pub fn mean_radiance(&self) -> Option<[f64; 3]> {
        self.radiance_sum.map(|sums| sums.map(|sum| mean(sum, self.pixels)))
    }

    /// Returns the mean transmittance of the pixels.
    pub fn mean_transmittance(&self) -> Option<f64> {
        self.transmittance_sum.map(|sum| mean(sum, self.pixels))
    }
}

fn mean(sum: i128, pixels: u64) -> f64 {
    sum as f64 / UNIT / pixels.max(1) as f64
}

/// Converts a value to whole units of 1 / [`UNIT`], less than 2³⁷ of them. Halves are rounded away from 0.
fn fixed(value: f32) -> i64 {
    // NaN becomes 0 in the conversion to i64. `f64::round` would be a call.
    let units = f64::from(value.clamp(-BRIGHTEST, BRIGHTEST)) * UNIT;
    let whole = units as i64;
    whole + ((units - whole as f64) * 2.0) as i64
}

/// Returns the figures of a developed picture from its text, or of an EXR from its layers. Reads and checks
/// the whole file.
///
/// # Errors
/// The errors of [`super::verify`].
pub fn figures_of(path: &Path) -> Result<KnownFigures> {
    if Format::of_file(path)? == Format::Exr {
        return figures_of_exr(ExrLines::open(path)?);
    }
    let mut rows = PictureRows::open(path)?;
    let pixels = rows.window.pixels();
    rows.skip_rows()?;
    let unknown = KnownFigures { pixels, ..Default::default() };
    Ok(rows.finish()?.map_or(unknown, KnownFigures::from))
}

fn figures_of_exr(mut lines: ExrLines) -> Result<KnownFigures> {
    let width = lines.window.width as usize;
    let rgb = lines.colours();
    let (transmittance, cells) = (lines.channel("transmittance.T"), lines.channel("cells.N"));
    let (mut radiance_sum, mut transmittance_sum) = ([0i128; 3], 0i128);
    let (mut covered, mut walked, mut non_finite) = (0u64, 0u64, 0u64);
    let mut line = Vec::new();
    for _ in 0..lines.window.height {
        lines.read_line(&mut line)?;
        let value = |channel: usize, x: usize| lines.value(&line, channel, x);
        for x in 0..width {
            let mut finite = true;
            if let Some(colours) = &rgb {
                for (sum, value) in radiance_sum.iter_mut().zip(lines.rec709(&line, colours, x)) {
                    finite &= value.is_finite();
                    *sum += i128::from(fixed(value));
                }
            }
            if let Some(t) = transmittance {
                finite &= value(t, x).is_finite();
                transmittance_sum += i128::from(fixed(value(t, x)));
            }
            if let Some(n) = cells {
                covered += u64::from(value(n, x) > 0.0);
                walked = walked.saturating_add(value(n, x) as u64);
            }
            non_finite += u64::from(!finite);
        }
    }
    let pixels = lines.window.pixels();
    lines.finish()?;
    Ok(KnownFigures {
        pixels,
        covered_pixels: cells.map(|_| covered),
        cells_walked: cells.map(|_| walked),
        light_cells_walked: None,
        non_finite_pixels: rgb.as_ref().and(transmittance).map(|_| non_finite),
        radiance_sum: rgb.map(|_| radiance_sum),
        transmittance_sum: transmittance.map(|_| transmittance_sum),
    })
}
