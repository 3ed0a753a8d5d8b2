//! Diffusion (P1) along one column below a vertex: finite volumes, a tridiagonal system for each colour.
//!
//! With H = −(dJ/dτ)/3 the net flux over 4π, dH/dτ + (1 − ω')J = ω'·J_beam. What leaves the outer surface is
//! H = (J − η²·ambient)/(2A) (Marshak's condition), with A = (1 + R₂)/(1 − R₁) from the moments R₁ = ∫2μR dμ
//! and R₂ = ∫3μ²R dμ of Fresnel's reflectance from inside.

use glam::Vec3;

use super::{Below, Piece, ShellMatter, fresnel_moments};

/// Least optical depth between two values of J. Across less they are equal anyway.
const THINNEST: f32 = 1e-4;

/// A column below a vertex.
pub struct Column<'a> {
    /// Matter.
    pub matter: &'a ShellMatter,
    /// Pieces of the column.
    pub pieces: &'a [Piece],
    /// Number of intervals between values of J.
    pub layers: usize,
    /// Length of the column, metres.
    pub thickness: f32,
}

impl Column<'_> {
    /// Optical depth of a piece by colour.
    fn depth(&self, piece: &Piece) -> Vec3 {
        self.matter.extinction[piece.layer] * ((piece.ends[1] - piece.ends[0]) * self.thickness)
    }

    /// Share of J that leaves through the outer surface as net flux H.
    fn leaves_above(&self) -> f32 {
        let [first, second] = fresnel_moments(self.matter.eta);
        0.5 * (1.0 - first) / (1.0 + second)
    }

    /// Share of J that leaves through the inner surface.
    fn leaves_below(&self) -> Vec3 {
        match self.matter.below {
            Below::Open => Vec3::splat(0.5),
            Below::Opaque { albedo } => 0.5 * (Vec3::ONE - albedo) / (Vec3::ONE + albedo),
            Below::Core => {
                let albedo = self.matter.albedo.last().copied().unwrap_or_default();
                ((Vec3::ONE - albedo).max(Vec3::ZERO) * (1.0 / 3.0)).powf(0.5)
            }
        }
    }

    /// Adds the sources of light from everywhere.
    pub fn add_ambient(&self, ambient: Vec3, sources: &mut [Vec3]) {
        let eta2 = self.matter.eta * self.matter.eta;
        sources[0] += ambient * (eta2 * self.leaves_above());
        if self.matter.below == Below::Open {
            sources[self.layers] += ambient * 0.5;
        }
    }

    /// Adds the sources of a beam whose direction has the cosine `mu` with the outward normal. `shares` of
    /// it reach the outer and the inner surface.
    pub fn add_beam(&self, mu: f32, intensity: Vec3, shares: [f32; 2], sources: &mut [Vec3]) {
        let from_below = mu < 0.0;
        if mu == 0.0 || (from_below && self.matter.below != Below::Open) {
            return;
        }
        let surface = super::Surface { eta: self.matter.eta, roughness: 1.0 };
        let (inside, enters) = match from_below {
            true => (-mu, 1.0),
            false => (surface.refracted(mu), (1.0 - surface.fresnel(mu)) * surface.stretch(mu)),
        };
        let mut left = intensity * enters;
        let mut pass = |piece: &Piece| {
            let passed = left * (self.depth(piece) * (-1.0 / inside)).exp();
            let middle = 0.5 * (piece.ends[0] + piece.ends[1]);
            let share = shares[0] + (shares[1] - shares[0]) * middle;
            let albedo = self.matter.albedo[piece.layer];
            sources[piece.value] += albedo * (left - passed) * (0.25 * inside * share);
            left = passed;
        };
        match from_below {
            true => self.pieces.iter().rev().for_each(&mut pass),
            false => self.pieces.iter().for_each(&mut pass),
        }
        if let Below::Opaque { albedo } = self.matter.below {
            sources[self.layers] += left * albedo / (Vec3::ONE + albedo) * (0.5 * inside * shares[1]);
        }
    }
}

/// The tridiagonal matrix of a column, factored.
pub struct Factored {
    /// Conductances between values, and inverse pivots.
    between: Vec<Vec3>,
    inverse: Vec<Vec3>,
}

impl Factored {
    /// Factors the matrix of a column.
    pub fn new(column: &Column) -> Factored {
        let mut across = vec![Vec3::ZERO; column.layers];
        let mut diagonal = vec![Vec3::ZERO; column.layers + 1];
        for piece in column.pieces {
            let depth = column.depth(piece);
            across[piece.interval] += depth;
            diagonal[piece.value] += depth * (Vec3::ONE - column.matter.albedo[piece.layer]);
        }
        let between: Vec<Vec3> =
            across.iter().map(|depth| (depth.max(Vec3::splat(THINNEST)) * 3.0).recip()).collect();
        diagonal[0] += Vec3::splat(column.leaves_above());
        diagonal[column.layers] += column.leaves_below();
        for (i, own) in between.iter().enumerate() {
            diagonal[i] += *own;
            diagonal[i + 1] += *own;
        }
        let mut inverse: Vec<Vec3> = Vec::with_capacity(diagonal.len());
        for (i, own) in diagonal.iter().enumerate() {
            let above = i.checked_sub(1).map_or(Vec3::ZERO, |k| between[k] * between[k] * inverse[k]);
            inverse.push((*own - above).max(Vec3::splat(1e-12)).recip());
        }
        Factored { between, inverse }
    }

    /// Replaces sources by J.
    pub fn solve(&self, values: &mut [Vec3]) {
        for i in 1..values.len() {
            let above = values[i - 1] * self.inverse[i - 1] * self.between[i - 1];
            values[i] += above;
        }
        for i in (0..values.len()).rev() {
            let below = if i + 1 < values.len() { values[i + 1] * self.between[i] } else { Vec3::ZERO };
            values[i] = (values[i] + below) * self.inverse[i];
        }
    }
}
