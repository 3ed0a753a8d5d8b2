//! Figures for properties by which the eye judges moving water: streaks and flicker, computed from pictures
//! alone.

use serde::Serialize;

use crate::util::window::Window;

/// Streakiness of a part of a picture whose flow runs down the image: the mean absolute luminance difference
/// of neighbours across the flow (in a row) and along it (in a column).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Streaks {
    /// Mean difference of pixels side by side.
    pub across: f64,
    /// Mean difference of pixels one above the other.
    pub along: f64,
    /// `across` / `along`: 1 for matter without a direction, large for long threads; `None` where nothing
    /// changes along the flow.
    pub ratio: Option<f64>,
}

/// Returns the luminance (Rec. 709) of linear RGB.
pub fn luminance([r, g, b]: [f32; 3]) -> f32 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// Decodes an sRGB value (IEC 61966-2-1), 0 to 1, to linear light.
pub fn decoded(x: f32) -> f32 {
    if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

/// Measures the streaks in a part of a picture. `luminance` is that of the whole picture, `width` pixels
/// wide, row by row.
pub fn streaks(luminance: &[f32], width: usize, part: Window) -> Streaks {
    let at = |x: u32, y: u32| f64::from(luminance[y as usize * width + x as usize]);
    let (mut across, mut along) = (0.0, 0.0);
    for y in part.y..part.bottom() {
        for x in part.x..part.right() {
            if x + 1 < part.right() {
                across += (at(x + 1, y) - at(x, y)).abs();
            }
            if y + 1 < part.bottom() {
                along += (at(x, y + 1) - at(x, y)).abs();
            }
        }
    }
    let pairs = |a: u32, b: u32| (f64::from(a.saturating_sub(1)) * f64::from(b)).max(1.0);
    let (across, along) = (across / pairs(part.width, part.height), along / pairs(part.height, part.width));
    Streaks { across, along, ratio: (along > 0.0).then_some(across / along) }
}

/// Cuts a part into `count` bands of rows, from the top, as evenly as whole rows allow.
pub fn bands(part: Window, count: u32) -> Vec<Window> {
    let edge = |i: u32| part.y + (u64::from(part.height) * u64::from(i) / u64::from(count)) as u32;
    (0..count).map(|i| Window { y: edge(i), height: edge(i + 1) - edge(i), ..part }).collect()
}

/// Flicker of a sequence of frames.
///
/// The luminance of each pixel passes the filter (−¼, ½, −¼) over three frames. The figure is the root mean
/// square of the result over pixels and time, divided by the mean luminance. The filter passes an alternation
/// by ±a whole, a swing by ω per frame by sin²(ω/2), and steady change not at all.
#[derive(Clone, Debug, Default)]
pub struct Flicker {
    last: Vec<Vec<f32>>,
    squares: f64,
    values: u64,
    sum: f64,
    seen: u64,
}

impl Flicker {
    /// Adds the luminance of the next frame's part. All parts have the same size.
    pub fn push(&mut self, luminance: Vec<f32>) {
        self.sum += luminance.iter().map(|&x| f64::from(x)).sum::<f64>();
        self.seen += luminance.len() as u64;
        if let [a, b] = &self.last[..] {
            for ((&a, &b), &c) in a.iter().zip(b).zip(&luminance) {
                let high = 0.5 * f64::from(b) - 0.25 * (f64::from(a) + f64::from(c));
                self.squares += high * high;
            }
            self.values += luminance.len() as u64;
            self.last.remove(0);
        }
        self.last.push(luminance);
    }

    /// Returns the mean luminance of all frames.
    pub fn mean(&self) -> f64 {
        self.sum / self.seen.max(1) as f64
    }

    /// Returns the flicker; `None` for fewer than three frames or for black ones.
    pub fn share(&self) -> Option<f64> {
        let mean = self.mean();
        (self.values > 0 && mean > 0.0).then(|| (self.squares / self.values as f64).sqrt() / mean)
    }
}
