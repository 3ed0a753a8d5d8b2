//! Kinds of stone: the look of rock below the squares of its mesh, as both engines evaluate it sample by
//! sample. Twins of the evaluation: `shaders/engine/stone.wgsl` and [`crate::engine::cpu::stone`].
//!
//! A stone is a sum of octaves of simplex noise (Perlin 2001; Gustavson 2005) on a lattice that is fixed to
//! the world. Octave k has cells of [`COARSEST`]·2^−k. Its value changes the albedo, its gradient tilts the
//! normal, and its zeros are cracks.

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};

use super::Rock;
use crate::util::words::words;

/// Kind of stone that a rock is made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum StoneKind {
    /// Nothing but the mesh.
    #[default]
    Plain,
    /// Coarse grains of light and dark minerals, and few long cracks.
    Granite,
    /// Dark, fine and rough, broken by many cracks.
    Basalt,
    /// Pale and even, in beds.
    Limestone,
    /// Dark and thinly bedded.
    Slate,
}

words! {
    StoneKind {
        Plain => "plain", Granite => "granite", Basalt => "basalt", Limestone => "limestone",
        Slate => "slate",
    }
}

/// Number of octaves: from cells of 1 m to cells of 2 mm.
pub const OCTAVES: usize = 10;
/// Side of the coarsest octave's cells, metres.
pub const COARSEST: f32 = 1.0;
/// Root mean square of each component of the noise's gradient, per cell. The noise itself has a deviation
/// of 1.
pub const GRADIENT: f32 = 4.471;
/// Half the width of a crack, in cells of its octave.
pub const CRACK: f32 = 0.011;
/// Mean of the tent max(0, 1 − d/w) around the noise's zeros per w, where d is the distance from a zero and
/// w half the width of the tent, both in cells.
pub const CRACK_SHARE: f32 = 2.62;
/// Half the width of the transition at the edge of moss and lichen, in deviations of their noise.
pub const EDGE: f32 = 0.35;
/// Columns of water that run down: width and height of the coarser of two octaves' cells, metres.
pub const STREAK: [f32; 2] = [0.45, 4.5];

/// One octave of a stone.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Octave {
    /// Deviation of the albedo, relative to its mean.
    pub tone: f32,
    /// Deviation of each component of the slope.
    pub slope: f32,
    /// Share of the albedo that cracks lose.
    pub crack: f32,
    /// Share of the relief that is folded into grooves at the noise's zeros.
    pub fold: f32,
    /// Weight in the noise that places moss.
    pub moss: f32,
    /// Weight in the noise that places lichen.
    pub lichen: f32,
    /// Share of `tone` that has the stone's tint; the rest is grey.
    pub tinted: f32,
    /// Not used.
    pub pad: f32,
}

/// A stone as shaders read it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Stone {
    /// Skewed cell of the coarsest octave in which the scene's origin lies.
    pub cells: [i32; 3],
    /// Scale of lengths along the beds; 1 has no beds.
    pub along: f32,
    /// Place of the origin relative to a corner of that lattice, cells.
    pub rest: [f32; 3],
    /// Amount of moss, 0 to 1.
    pub moss: f32,
    /// As `cells`, for the noise of streaks.
    pub streak_cells: [i32; 3],
    /// Deviation of the albedo by streaks.
    pub streaks: f32,
    /// As `rest`, for the noise of streaks.
    pub streak_rest: [f32; 3],
    /// Squared roughness α² of a film of water on it.
    pub film: f32,
    /// Unit vector across the beds.
    pub up: [f32; 3],
    /// Deviation of lichen's noise above which lichen grows.
    pub bare: f32,
    /// Change of the albedo's components with the tinted tone.
    pub tint: [f32; 3],
    /// Sum of the squared slopes of all octaves.
    pub slope2: f32,
    /// Albedo of moss.
    pub moss_color: [f32; 3],
    /// Sum of the squared weights of moss's noise.
    pub moss2: f32,
    /// Factor of the albedo under lichen.
    pub lichen: [f32; 3],
    /// Sum of the squared weights of lichen's noise.
    pub lichen2: f32,
    /// The octaves, the coarsest first.
    pub octaves: [Octave; OCTAVES],
}

/// Numbers by which kinds differ.
struct Recipe {
    albedo: Vec3,
    tone: [f32; OCTAVES],
    slope: [f32; OCTAVES],
    crack: [f32; OCTAVES],
    fold: [f32; OCTAVES],
    tint: Vec3,
    along: f32,
    streaks: f32,
    film: f32,
    bare: f32,
}

/// Weights of the octaves in the noises that place moss and lichen. Signs alternate, so that moss grows on
/// bright and dark grain alike, however many octaves a sample shows: otherwise the mean albedo would change
/// with the distance.
const MOSS: [f32; OCTAVES] = [0.0, 0.45, -0.45, 0.45, -0.4, 0.35, -0.25, 0.2, 0.0, 0.0];
const LICHEN: [f32; OCTAVES] = [0.0, 0.5, 0.0, 0.6, 0.5, 0.35, 0.2, 0.1, 0.0, 0.0];
/// Shares of the octaves' tones that have the stone's tint.
const TINTED: [f32; OCTAVES] = [1.0, 1.0, 1.0, 0.8, 0.5, 0.3, 0.2, 0.3, 0.3, 0.2];
/// Albedo of a mat of moss that is moist, as near falling water.
///
/// It is a choice: the libraries of spectra that the kinds' albedos come from have no moss on rock.
const MOSS_ALBEDO: Vec3 = Vec3::new(0.036, 0.048, 0.016);
/// Albedo of grey and grey-green lichen: the median of four spectra, two of *Lecidea* in place on its rocks
/// and two of *Xanthoparmelia* (Kokaly and others 2017, USGS Spectral Library 7).
///
/// Each component of the four lies within 0.04 and 0.24. Yellow *Acarospora* and orange *Xanthoria* are left
/// out: a median with them is a colour that none of them has.
const LICHEN_ALBEDO: Vec3 = Vec3::new(0.201, 0.185, 0.107);

impl StoneKind {
    /// Returns the mean albedo of the dry stone, linear RGB; `None` for plain rock.
    ///
    /// Those of granite, basalt and limestone are medians of measured spectra of solid samples: the ECOSTRESS
    /// library (Meerdink and others 2019; Baldridge and others 2009) and KLUM (Ilehag and others 2019), under
    /// the illuminant D65, by the CIE's observer of 1931. docs/method.md has their spread.
    pub fn albedo(self) -> Option<Vec3> {
        self.recipe().map(|recipe| recipe.albedo)
    }

    fn recipe(self) -> Option<Recipe> {
        Some(match self {
            StoneKind::Plain => return None,
            StoneKind::Granite => Recipe {
                // Median of 13 solid samples: 8 hand samples (ECOSTRESS), and 5 unpolished, weathered stones
                // of buildings and pavements (KLUM).
                albedo: Vec3::new(0.228, 0.202, 0.182),
                tone: [0.08, 0.09, 0.08, 0.07, 0.08, 0.09, 0.12, 0.22, 0.3, 0.2],
                slope: [0.06, 0.09, 0.11, 0.11, 0.11, 0.13, 0.15, 0.17, 0.16, 0.1],
                crack: [0.75, 0.5, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
                fold: [0.5, 0.6, 0.5, 0.3, 0.2, 0.0, 0.0, 0.0, 0.0, 0.0],
                tint: Vec3::new(1.1, 1.0, 0.88),
                along: 1.0,
                streaks: 0.16,
                film: 0.05,
                bare: 1.6,
            },
            StoneKind::Basalt => Recipe {
                // Median of 20 solid samples (ECOSTRESS), of which 9 are called fresh and 1 weathered.
                // Weathered faces are about twice as pale.
                albedo: Vec3::new(0.101, 0.097, 0.09),
                tone: [0.1, 0.12, 0.12, 0.11, 0.11, 0.12, 0.12, 0.12, 0.1, 0.08],
                slope: [0.08, 0.14, 0.18, 0.18, 0.16, 0.16, 0.17, 0.18, 0.16, 0.1],
                crack: [0.6, 0.7, 0.65, 0.5, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0],
                fold: [0.9, 0.9, 0.9, 0.8, 0.6, 0.4, 0.2, 0.0, 0.0, 0.0],
                tint: Vec3::new(1.12, 1.0, 0.88),
                along: 1.0,
                streaks: 0.18,
                film: 0.045,
                bare: 2.1,
            },
            StoneKind::Limestone => Recipe {
                // Median of 27 solid samples: 18 of ECOSTRESS and 9 of KLUM.
                albedo: Vec3::new(0.347, 0.323, 0.283),
                tone: [0.08, 0.09, 0.09, 0.08, 0.08, 0.08, 0.08, 0.08, 0.07, 0.05],
                slope: [0.05, 0.1, 0.13, 0.14, 0.14, 0.14, 0.13, 0.12, 0.1, 0.06],
                crack: [0.5, 0.55, 0.45, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
                fold: [0.6, 0.7, 0.7, 0.6, 0.4, 0.2, 0.0, 0.0, 0.0, 0.0],
                tint: Vec3::new(1.05, 1.0, 0.85),
                along: 1.5,
                streaks: 0.24,
                film: 0.05,
                bare: 1.5,
            },
            StoneKind::Slate => Recipe {
                // A choice: measured grey slates are three, two of them tiles of roofs. Their median, 0.100,
                // 0.096, 0.099, is as dark, but less blue.
                albedo: Vec3::new(0.105, 0.11, 0.118),
                tone: [0.08, 0.1, 0.12, 0.13, 0.13, 0.12, 0.1, 0.08, 0.06, 0.04],
                slope: [0.06, 0.14, 0.2, 0.22, 0.21, 0.18, 0.15, 0.11, 0.08, 0.05],
                crack: [0.4, 0.6, 0.65, 0.55, 0.35, 0.0, 0.0, 0.0, 0.0, 0.0],
                fold: [0.8, 0.9, 0.95, 0.9, 0.8, 0.5, 0.3, 0.0, 0.0, 0.0],
                tint: Vec3::new(1.15, 1.0, 0.86),
                along: 2.2,
                streaks: 0.15,
                film: 0.03,
                bare: 2.3,
            },
        })
    }
}

impl Stone {
    /// Makes the stone of a rock; `None` for plain rock. Points are measured from `origin`, and the noise is
    /// fixed to the world.
    pub fn new(rock: &Rock, origin: DVec3) -> Option<Stone> {
        let recipe = rock.kind.recipe()?;
        let (up, _) = rock.bed_axes();
        let along = f64::from(recipe.along);
        let far = origin / along + up.as_dvec3() * (up.as_dvec3().dot(origin) * (1.0 - 1.0 / along));
        let (cells, rest) = place(far / f64::from(COARSEST));
        let [wide, high] = STREAK.map(f64::from);
        let (streak_cells, streak_rest) = place(origin / DVec3::new(wide, high, wide));
        // Without its part along the grain's tone, moss has no correlation with it.
        let product =
            |a: &[f32; OCTAVES], b: &[f32; OCTAVES]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f32>();
        let shared = product(&MOSS, &recipe.tone) / product(&recipe.tone, &recipe.tone);
        let octave = |k: usize| Octave {
            tone: rock.grain * recipe.tone[k],
            slope: rock.grain * recipe.slope[k],
            crack: (rock.grain * recipe.crack[k]).min(1.0),
            fold: recipe.fold[k],
            moss: MOSS[k] - shared * recipe.tone[k],
            lichen: LICHEN[k],
            tinted: TINTED[k],
            pad: 0.0,
        };
        let octaves = std::array::from_fn(octave);
        let sum = |of: fn(&Octave) -> f32| octaves.iter().map(|octave| of(octave) * of(octave)).sum();
        Some(Stone {
            cells,
            along: recipe.along,
            rest,
            moss: rock.moss,
            streak_cells,
            streaks: rock.grain * recipe.streaks,
            streak_rest,
            film: recipe.film,
            up: up.to_array(),
            bare: recipe.bare,
            tint: recipe.tint.to_array(),
            slope2: sum(|octave| octave.slope),
            moss_color: MOSS_ALBEDO.to_array(),
            moss2: sum(|octave| octave.moss),
            lichen: (LICHEN_ALBEDO / recipe.albedo).to_array(),
            lichen2: sum(|octave| octave.lichen),
            octaves,
        })
    }
}

/// Returns the skewed cell near a point of a lattice, and the point relative to a corner of that cell, cells.
///
/// The skew of simplex noise adds a third of the sum of the coordinates to each. At corners whose coordinates
/// are multiples of 3, that is a whole number.
fn place(at: DVec3) -> ([i32; 3], [f32; 3]) {
    let corner = (at / 3.0).floor() * 3.0;
    let skewed = (corner + corner.element_sum() / 3.0).to_array();
    // Lattices repeat after 2^32 cells.
    (skewed.map(|c| (c as i64) as i32), (at - corner).as_vec3().to_array())
}
