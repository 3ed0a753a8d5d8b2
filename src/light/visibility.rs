//! §5 V_i(k) kept: which light volumes a scene needs, and in which units their depths are.
//!
//! A light volume has a number for every cell of the volume texture: the optical depth from the cell's centre
//! to where the light's ray leaves the slab, for one direction of light in cells. The slab's copies go on for
//! ever, so for a directional light and a parallelogram one light volume says what an exact walk from every
//! cell would. Where the direction in cells changes over a quad it is cut into patches: a little (the map is
//! no parallelogram's), and each has a light volume; more (a point light), and they have one at each corner,
//! between which is interpolated.
//!
//! What is kept of a cell is a code of its transmittance T to the light, √T in 255ths: a byte, so that many
//! patches fit into a processor's caches, with no exponential left to the view ray. Where light is scattered
//! more than once optical depths are kept, for its formula asks for them. Passes:
//! `src/engine/gpu/visibility.rs` with `shaders/light/visibility.wgsl`, and `src/engine/cpu/visibility.rs`.

use std::collections::HashMap;

use glam::{Vec2, Vec3};

use super::{Light, Scattering};
use crate::mapping::{CellFrame, Quad};
use crate::trace::{Attenuation, Trace, extinction, level_atlas};
use crate::util::error::{Error, Result};

/// Codes in one word of a light volume, of cells that follow one another along z.
pub const CELLS_A_WORD: u32 = 4;

/// Angles, in degrees, that the light's direction (in cells) may turn by over a patch with one light volume,
/// and between the corners of a patch with four. With these, pictures of directional lights are within 2 % of
/// exact walks on quads that fan out; twice as much makes it 3 %. A point light half a quad's width away
/// gives 5 % RMSE, of the size of single cells.
const PATCH_ANGLES: [f64; 2] = [1.0, 4.0];

/// The same of lights that stand for a part of the environment, which comes from many directions: 14°.
const ENVIRONMENT_SAME_DIRECTION: f32 = 1.0 / 4.0;

/// Most cells of a walk that is kept: one invocation makes four of them, four cells a turn, and software
/// Vulkan grants all its loops 65535 turns.
const MOST_CELLS: u32 = 65_000;

/// Where the light volumes do not fit into the budget the angles are doubled so many times (once more where
/// quads share light volumes, for else there would be no picture): at 8 and 32 degrees shadows in the middle
/// of a patch are seen double.
const DOUBLINGS: i32 = 3;

/// Most patches of a quad with one light volume each; where it would need more it has fewer and larger ones
/// with four, for those may be larger.
const MOST_PATCHES: u32 = 16;

/// Most patches with four light volumes along one side of a quad.
const MOST_CORNERED: u32 = 16;

/// Directions that differ by less, relative to their length, share a light volume: over a slab of 1000 cells
/// they part by a thousandth of a cell.
const SAME_DIRECTION: f32 = 1e-6;

/// The light volumes of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct LightVolumes {
    /// Each of them once.
    pub volumes: Vec<LightVolume>,
    /// Numbers of light volumes: of patches, or of their corners, row by row along u.
    pub numbers: Vec<u32>,
    /// Of quad q and light i the entry q·lights + i.
    pub patches: Vec<Patches>,
    /// Number of lights.
    pub lights: usize,
    /// What the light goes through.
    pub medium: Medium,
    /// What is kept.
    pub form: Form,
}

/// One light volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightVolume {
    /// Towards the light, in cells per cell depth: J⁻¹l·(H/nz).
    pub direction: Vec3,
    /// Bits of transmittance in one unit of optical depth; of optical depths, 1.
    pub bits: f32,
}

/// What a light volume holds for a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// √T in 255ths.
    Codes,
    /// Optical depth: Σ ρ code × length, in depths of a cell; or Σ ρ code.
    Depths,
}

/// −log₂ of a T whose code is 0: 255·2^(−9) is less than a half.
pub const DARK_BITS: f32 = 18.0;

/// √T in 255ths, from −log₂ T: steps are finest where it is dark.
pub fn transmittance_code(depth_bits: f32) -> u8 {
    (255.0 * (-0.5 * depth_bits).exp2() + 0.5) as u8
}

/// How a quad is cut for one light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Patches {
    /// Where its numbers begin.
    pub first: u32,
    /// Patches along u and along v.
    pub count: [u32; 2],
    /// Whether there is a light volume for each corner, between which is interpolated, or one for each
    /// patch.
    pub cornered: bool,
}

/// What an optical depth depends on besides cells and direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Medium {
    /// Whether cells count whole, not by the length of the way in them.
    pub per_cell: bool,
    /// Most cells of one walk.
    pub max_cells: u32,
}

impl Medium {
    /// The medium that a trace goes through.
    pub fn of(trace: &Trace) -> Self {
        Medium {
            per_cell: matches!(trace.attenuation, Attenuation::PerCell { .. }),
            max_cells: trace.max_cells,
        }
    }
}

/// The quads of a frame and the lights that shine on them.
#[derive(Clone, Copy)]
pub struct LitQuads<'a> {
    /// The volume's quads.
    pub quads: &'a [Quad],
    /// The lights that shine on the volume: the scene's own, then those that stand for its environment.
    pub lights: &'a [Light],
    /// Number of the scene's own lights.
    pub own_lights: usize,
    /// The eye, metres.
    pub eye: Vec3,
    /// How rays go through the volume.
    pub trace: &'a Trace,
    /// How often light is scattered.
    pub scattering: Scattering,
    /// Cells of the volume.
    pub size: [u32; 3],
    /// Scale of its density.
    pub alpha: f32,
}

impl LightVolumes {
    /// Plans the light volumes of a frame.
    ///
    /// # Errors
    /// [`Error::Memory`] where even the coarsest need more than `budget` bytes.
    pub fn new(lit: &LitQuads, budget: u64) -> Result<Self> {
        let mut need = 0;
        // Sheets of many small quads: only where each cannot have its own do they share light volumes.
        for shared in [false, true] {
            for doubling in 0..=DOUBLINGS + i32::from(shared) {
                let angles = PATCH_ANGLES.map(|degrees| (degrees * 2f64.powi(doubling)).to_radians());
                let same = if shared { angles[0] as f32 } else { SAME_DIRECTION };
                let volumes = LightVolumes::at_angles(lit, angles, same);
                need = volumes.bytes(level_atlas(lit.trace, lit.size).extent());
                if need <= u128::from(budget) {
                    return Ok(volumes);
                }
            }
        }
        Err(Error::memory(
            format!("cached visibility of {} lights on {} quads", lit.lights.len(), lit.quads.len()),
            need,
            budget,
            "raise light.cache (at most half of --memory counts), or use light.visibility=march",
        ))
    }

    /// Bytes of all light volumes, of textures of `size` cells.
    pub fn bytes(&self, size: [u32; 3]) -> u128 {
        let [nx, ny, nz] = self.words(size).map(u128::from);
        nx * ny * nz * 4 * self.volumes.len() as u128
    }

    /// Words of four bytes in one of them, along x, y and z.
    pub fn words(&self, [nx, ny, nz]: [u32; 3]) -> [u32; 3] {
        match self.form {
            Form::Codes => [nx, ny, nz.div_ceil(CELLS_A_WORD)],
            Form::Depths => [nx, ny, nz],
        }
    }

    /// Whether is interpolated anywhere.
    pub fn cornered(&self) -> bool {
        self.patches.iter().any(|patches| patches.cornered)
    }

    /// Directions that differ by less than `same` of their length share a light volume.
    fn at_angles(lit: &LitQuads, angles: [f64; 2], same: f32) -> Self {
        let &LitQuads { quads, lights, own_lights, eye, trace, scattering, size, alpha } = lit;
        let mut medium = Medium::of(trace);
        medium.max_cells = medium.max_cells.min(MOST_CELLS);
        let form = match scattering {
            Scattering::Single => Form::Codes,
            Scattering::Multiple => Form::Depths,
        };
        let mut volumes: Vec<LightVolume> = Vec::new();
        let mut known: HashMap<([i64; 3], u32), u32> = HashMap::new();
        let mut number = |direction: Vec3, bits: f32, same: f32| {
            let step = same * direction.length().max(1e-30);
            // The step is a power of two, so that equal directions fall into equal squares.
            let step = step.log2().floor().exp2();
            let key = (direction.to_array().map(|x| (x / step).round() as i64), bits.to_bits());
            *known.entry(key).or_insert_with(|| {
                volumes.push(LightVolume { direction, bits });
                volumes.len() as u32 - 1
            })
        };
        let (mut numbers, mut patches) = (Vec::new(), Vec::new());
        for quad in quads {
            let cell_depth = if medium.per_cell { 1.0 } else { quad.material.thickness_m / size[2] as f32 };
            let bits = match form {
                Form::Codes => extinction(&trace.attenuation, alpha) * cell_depth,
                Form::Depths => 1.0,
            };
            let side_seen = if quad_seen_from_behind(quad, eye) { -1.0 } else { 1.0 };
            for (i, light) in lights.iter().enumerate() {
                let same = if i < own_lights { same } else { same.max(ENVIRONMENT_SAME_DIRECTION) };
                if quad.mist > 0.0 {
                    // Its light is not asked for.
                    patches.push(Patches { first: numbers.len() as u32, count: [1, 1], cornered: false });
                    numbers.push(0);
                    continue;
                }
                let at = |u: f32, v: f32| direction(quad, light, side_seen, size, Vec2::new(u, v));
                let (count, cornered) = cut(&at, angles);
                patches.push(Patches { first: numbers.len() as u32, count, cornered });
                let [nu, nv] = count.map(|n| n + u32::from(cornered));
                let offset = if cornered { 0.0 } else { 0.5 };
                for (j, i) in (0..nv).flat_map(|j| (0..nu).map(move |i| (j, i))) {
                    let place = |i: u32, n: u32| (i as f32 + offset) / n as f32;
                    numbers.push(number(at(place(i, count[0]), place(j, count[1])), bits, same));
                }
            }
        }
        if volumes.is_empty() && !numbers.is_empty() {
            volumes.push(LightVolume { direction: Vec3::Z, bits: 1.0 });
        }
        LightVolumes { volumes, numbers, patches, lights: lights.len(), medium, form }
    }
}

/// Whether the eye is behind the plane of a quad; then all its rays are.
fn quad_seen_from_behind(quad: &Quad, eye: Vec3) -> bool {
    (eye.as_dvec3() - quad.map.a_world.as_dvec3()).dot(quad.map.n_world.as_dvec3()) < 0.0
}

/// Towards a light from a point of a quad, in cells per cell depth.
fn direction(quad: &Quad, light: &Light, side: f32, size: [u32; 3], uv: Vec2) -> Vec3 {
    let map = &quad.map;
    let frame = CellFrame::new(map, &quad.material, size, uv);
    let (l, _) = light.at(map.point_world(uv.x, uv.y));
    let plane = Vec3::new(l.dot(map.e1_world), l.dot(map.e2_world), l.dot(map.n_world) * side);
    frame.cell_from_plane(plane) * frame.depth
}

/// Patches along u and v over which the direction turns by no more than the first angle; or cornered ones and
/// the second.
fn cut(at: &impl Fn(f32, f32) -> Vec3, [whole, cornered]: [f64; 2]) -> ([u32; 2], bool) {
    // The way of the direction along the quad's sides and middles, in eight steps each.
    const STEPS: u32 = 8;
    let turn = |point: &dyn Fn(f32, f32) -> Vec3| {
        let along = |across: f32| -> f64 {
            let step = |i: u32| point(i as f32 / STEPS as f32, across).as_dvec3();
            (0..STEPS).map(|i| step(i).angle_between(step(i + 1))).sum()
        };
        [0.0, 0.5, 1.0].map(along).into_iter().fold(0.0, f64::max)
    };
    let turns = [turn(&|u, v| at(u, v)), turn(&|v, u| at(u, v))];
    let patches =
        |angle: f64, most: u32| turns.map(|turn| (turn / angle).ceil().clamp(1.0, most as f64) as u32);
    let [nu, nv] = patches(whole, MOST_PATCHES + 1);
    if nu * nv <= MOST_PATCHES { ([nu, nv], false) } else { (patches(cornered, MOST_CORNERED), true) }
}
