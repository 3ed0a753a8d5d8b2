//! §5 Colours of a volume's cells.
//!
//! In the paper cells are white, and the light alone has a colour. Fur, cloth and soil need more. Three
//! numbers in every cell would double the volume, so a cell keeps one: its place on a ramp of up to four
//! colours, 0 to 1, in the byte that holds k_s elsewhere. k_s is then the same in all cells of the volume. A
//! single colour needs no place, and leaves each cell its own k_s.
//!
//! The ramp is piecewise linear. So the mean of places is the place of the mean colour, as long as they lie
//! between two neighbouring colours, and coarse levels need nothing more. The colour tints what a cell
//! reflects diffusely, and the ambient light. Highlights keep the colour of the light.
//!
//! Twin: `shaders/light/ramp.wgsl`. The CPU's lanes have their own in
//! `src/engine/cpu/integrate/lockstep/ink.rs`.

use glam::Vec3;

/// Largest number of colours.
pub const MOST_COLORS: usize = 4;

/// Colours of a volume's cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ramp {
    /// Colour at place 0, linear RGB.
    pub first: Vec3,
    /// Differences from colour to colour; 0 behind the last.
    pub steps: [Vec3; MOST_COLORS - 1],
    /// Number of colours after the first.
    pub count: f32,
    /// Factor and summand that make k_s, in 255ths, of a cell's byte.
    pub k_s: [f32; 2],
}

impl Ramp {
    /// White cells, each with a k_s of its own.
    pub const WHITE: Ramp =
        Ramp { first: Vec3::ONE, steps: [Vec3::ZERO; MOST_COLORS - 1], count: 0.0, k_s: [1.0, 0.0] };

    /// Ramp through up to [`MOST_COLORS`] colours at equal distances; more are left out. `k_s` is that of all
    /// cells where there are several colours.
    pub fn new(colors: &[Vec3], k_s: f32) -> Ramp {
        let colors = &colors[..colors.len().min(MOST_COLORS)];
        let mut ramp = Ramp { first: colors.first().copied().unwrap_or(Vec3::ONE), ..Ramp::WHITE };
        ramp.steps.iter_mut().zip(colors.windows(2)).for_each(|(step, pair)| *step = pair[1] - pair[0]);
        if colors.len() > 1 {
            ramp.count = (colors.len() - 1) as f32;
            ramp.k_s = [0.0, k_s * 255.0];
        }
        ramp
    }

    /// k_s of all cells, if their bytes are places on the ramp.
    pub fn even_k_s(&self) -> Option<f32> {
        (self.count > 0.0).then_some(self.k_s[1] * (1.0 / 255.0))
    }

    /// Ink of a cell with this byte in the place of k_s.
    #[inline]
    pub fn ink(&self, code: f32) -> Ink {
        let at = code * (1.0 / 255.0) * self.count;
        let mut color = self.first;
        for (i, step) in self.steps.iter().enumerate() {
            color += *step * (at - i as f32).clamp(0.0, 1.0);
        }
        Ink { color, k_s: code * self.k_s[0] + self.k_s[1] }
    }
}

/// Colour and k_s that a ramp gives a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ink {
    /// Colour of what is reflected diffusely, linear RGB.
    pub color: Vec3,
    /// k_s in 255ths.
    pub k_s: f32,
}

impl Ink {
    /// Light of the diffuse and specular part of Ψ, in their units.
    #[inline]
    pub fn lit(&self, [diffuse, specular]: [f32; 2]) -> Vec3 {
        self.color * diffuse + Vec3::splat(specular)
    }
}
