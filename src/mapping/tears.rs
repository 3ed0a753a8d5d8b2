//! Holes in falling water: where a sheet is torn, and how far. What a hole looks like is in
//! `src/trace/tear.rs`.

/// Largest number of holes across a copy of the volume, and along it.
const MOST: f64 = 4096.0;

/// Holes of a sheet.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tears {
    /// Share of the sheet that is torn once it has been stretched without end, 0 to 1.
    pub strength: f32,
    /// Width of a hole where the sheet has its mean width, metres.
    pub size: f32,
    /// Length of a hole in its widths, in the mean over the sheet.
    pub length: f32,
}

/// Holes of a quad.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tear {
    /// Share of the water that is torn at the quad's edges v = 0 and v = 1, linear between them.
    pub open: [f32; 2],
    /// Number of the holes' cells across a copy of the volume, and along it. Without holes it is 0.
    pub lattice: [u32; 2],
}

impl Tears {
    /// Share of the water that is torn where the sheet is `thinned` times as thick as at its beginning, at
    /// the share `time` of the water's time. It takes both: thin water tears, and tears need time to grow.
    pub fn open(&self, thinned: f64, time: f64) -> f32 {
        (f64::from(self.strength) * (1.0 - thinned).max(0.0) * time.clamp(0.0, 1.0)) as f32
    }

    /// Number of the holes' cells across a copy of the volume and along it. The copy has this `width` and
    /// `length`, metres. Both are whole, so that copies fit together.
    pub fn lattice(&self, width: f64, length: f64) -> [u32; 2] {
        if self.strength <= 0.0 {
            return [0; 2];
        }
        let size = f64::from(self.size);
        let count = |copy: f64, hole: f64| (copy / hole).round().clamp(1.0, MOST) as u32;
        [count(width, size), count(length, size * f64::from(self.length))]
    }
}
