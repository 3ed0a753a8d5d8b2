//! §5 V_i(k) in light volumes: which light volumes a scene needs, and in which form they store visibility.
//!
//! A light volume stores one value for every cell of the volume texture. The value describes the optical
//! depth from the cell's centre to the point where the light's ray leaves the slab, for one direction of
//! light in cells. Copies of the slab continue without end, so one light volume equals exact walks from every
//! cell for a directional light and a parallelogram.
//!
//! Where the direction in cells changes over a quad, the quad is cut into patches. If it changes little (the
//! quad is not a parallelogram), each patch has one light volume. If it changes more (a point light), each
//! patch has one at every corner, and rays interpolate between them. Where the light is so close that even a
//! patch is too large for that, every cell of a ray walks to the light.
//!
//! A value is normally a code of the transmittance T to the light, √T in 255ths. A code takes one byte, so
//! many patches fit into a processor's caches, and the view ray computes no exponential. With multiple
//! scattering the value is the optical depth, because the scattering formula needs it.
//!
//! Light volumes are filled on the GPU by `src/engine/gpu/visibility.rs` with
//! `shaders/light/visibility.wgsl`, or on the host by `src/light/fill.rs`.

use std::collections::HashMap;

use glam::{DVec3, Vec2, Vec3};

use super::{Light, Scattering};
use crate::mapping::{CellFrame, Quad};
use crate::trace::{Attenuation, Trace, extinction, level_atlas};
use crate::util::error::{Error, Result};
use crate::util::powers::exp2;
use crate::volume::VolumeTexture;

/// Transmittance codes in one word of a light volume; their cells follow one another along z.
pub const CELLS_A_WORD: u32 = 4;

/// Maximum turn of the light's direction (in cells) over a patch with one light volume, and between the
/// corners of a patch with four, in degrees.
///
/// With these values, pictures of directional lights on quads that fan out are within 2 % of exact walks;
/// doubled values make it 3 %. A point light half a quad's width away gives 5 % RMSE, with errors the size of
/// single cells.
const PATCH_ANGLES: [f64; 2] = [1.0, 4.0];

/// Direction tolerance, as [`DIRECTION_TOLERANCE`], of lights that stand for a part of the environment: 14°.
/// Their light comes from many directions anyway.
const ENVIRONMENT_DIRECTION_TOLERANCE: f32 = 1.0 / 4.0;

/// Maximum number of cells in one walk that fills a light volume. One shader invocation makes four walks at
/// four cells per loop turn, and software Vulkan allows an invocation 65535 loop turns in total.
const MAX_WALK_CELLS: u32 = 65_000;

/// Maximum number of times that the angles are doubled until the light volumes fit into the budget.
///
/// The limit is three because shadows in the middle of a patch appear double at 8 and 32 degrees. Where quads
/// share light volumes one more doubling is allowed, because otherwise there would be no picture.
const MAX_DOUBLINGS: i32 = 3;

/// Maximum number of patches on a quad with one light volume each. A quad that needs more gets fewer, larger
/// patches with four light volumes each.
const MAX_PATCHES: u32 = 16;

/// Maximum number of patches with four light volumes along one side of a quad.
const MAX_CORNERED_SIDE: u32 = 16;

/// Maximum turn between the corners of a patch with four light volumes, in degrees; with larger patches,
/// twice their planned turn. Where the light's direction turns more, rays walk to the light.
///
/// A point light that is closer than a patch is wide turns its direction by more than 90° over the patches
/// below it. With this limit, a light 8 cm before `front` gives 2 % RMSE instead of 27 %; with 24° it is 4 %,
/// and with 12° 1 %.
const MARCH_ANGLE: f64 = 16.0;

/// Largest value of `light.cache`, MiB.
const MOST_CACHE: u128 = 65_536;

/// Relative difference of directions below which they share a light volume. At this value rays diverge by a
/// thousandth of a cell over a slab of 1000 cells.
const DIRECTION_TOLERANCE: f32 = 1e-6;

/// Columns of cells along z whose light volume is filled in the time in which a view ray's walks to a light
/// are taken. Rows of cells are summed side by side, and a ray walks from all its cells.
const COLUMNS_A_RAY: u64 = 2;

/// Plan of a frame's light volumes.
#[derive(Clone, Debug, PartialEq)]
pub struct LightVolumes {
    /// The distinct light volumes.
    pub volumes: Vec<LightVolume>,
    /// Indices into `volumes`, one for each patch or for each patch corner, row by row along u. 0 at
    /// corners between marched patches.
    pub numbers: Vec<u32>,
    /// Whether rays walk to the light in the patch that starts at the corner, for each of `numbers`.
    pub marched: Vec<bool>,
    /// Patches of each quad and light; quad q and light i have the entry q·lights + i.
    pub patches: Vec<Patches>,
    /// Number of lights.
    pub lights: usize,
    /// Medium that the light passes through.
    pub medium: Medium,
    /// Form of the stored values.
    pub form: Form,
}

/// One light volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightVolume {
    /// Number of the volume whose cells it has.
    pub volume: u32,
    /// Direction towards the light, in cells per cell depth: J⁻¹l·(H/nz).
    pub direction: Vec3,
    /// Bits of transmittance (−log₂ T) per unit of depth, Σ ρ code × length; 1 for [`Form::Depths`].
    pub bits: f32,
}

/// Form of the value that a light volume stores for a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// Transmittance code: √T in 255ths.
    Codes,
    /// Optical depth: Σ ρ code × length, with lengths in cell depths, or Σ ρ code with per-cell attenuation.
    Depths,
}

/// Depth in bits (−log₂ T) at which the code of T is 0: 255·2^(−9) is less than a half.
pub const DARK_BITS: f32 = 18.0;

/// Transmittance of a code, over the code's square: 1/255².
pub const TRANSMITTANCE_OF_CODE: f32 = 1.0 / 65025.0;

/// Code of a transmittance, √T in 255ths, from its depth −log₂ T. The steps of T are finest in the dark.
pub fn transmittance_code(depth_bits: f32) -> u8 {
    (255.0 * exp2(-0.5 * depth_bits) + 0.5) as u8
}

/// Patches into which a quad is cut for one light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Patches {
    /// Index of the first entry in [`LightVolumes::numbers`].
    pub first: u32,
    /// Number of patches along u and along v.
    pub count: [u32; 2],
    /// Whether every patch corner has a light volume, between which rays interpolate; otherwise every patch
    /// has one.
    pub cornered: bool,
}

impl Patches {
    /// Whether the quad has one light volume.
    pub fn is_whole(&self) -> bool {
        self.count == [1, 1] && !self.cornered
    }
}

/// Properties, besides cells and direction, that an optical depth depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Medium {
    /// Whether a cell's ρ counts once, whatever the length of the ray inside the cell.
    pub per_cell: bool,
    /// Maximum number of cells in one walk.
    pub max_cells: u32,
}

impl Medium {
    /// Medium of a trace.
    pub fn of(trace: &Trace) -> Self {
        Medium {
            per_cell: matches!(trace.attenuation, Attenuation::PerCell { .. }),
            max_cells: trace.max_cells,
        }
    }
}

/// Quads of a frame with the lights that shine on them.
#[derive(Clone, Copy)]
pub struct LitQuads<'a> {
    /// Quads that the volume is mapped to.
    pub quads: &'a [Quad],
    /// Lights that shine on the volume: first the scene's own, then those that stand for its environment.
    pub lights: &'a [Light],
    /// Number of the scene's own lights.
    pub own_lights: usize,
    /// Position of the eye, metres.
    pub eye: DVec3,
    /// Settings of the trace.
    pub trace: &'a Trace,
    /// Single or multiple scattering.
    pub scattering: Scattering,
    /// Volumes that the quads show, of which size and α count.
    pub volumes: &'a [VolumeTexture],
}

impl LitQuads<'_> {
    /// Number of texels in the levels of each volume along x, y and z.
    fn extents(&self) -> Vec<[u32; 3]> {
        self.volumes.iter().map(|volume| level_atlas(self.trace, volume.size).extent()).collect()
    }
}

impl LightVolumes {
    /// Plans the light volumes of a frame.
    ///
    /// # Errors
    /// Returns [`Error::Memory`] if even the coarsest plan needs more than `budget` bytes.
    pub fn new(lit: &LitQuads, budget: u64) -> Result<Self> {
        let mut need = 0;
        // Quads share light volumes only if separate ones do not fit, as on sheets of many small quads.
        for shared in [false, true] {
            for doubling in 0..=MAX_DOUBLINGS + i32::from(shared) {
                let angles = PATCH_ANGLES.map(|degrees| (degrees * 2f64.powi(doubling)).to_radians());
                let tolerance = if shared { angles[0] as f32 } else { DIRECTION_TOLERANCE };
                let volumes = LightVolumes::at_angles(lit, angles, tolerance);
                need = volumes.bytes(&lit.extents());
                if need <= u128::from(budget) {
                    return Ok(volumes);
                }
            }
        }
        Err(Error::memory(
            format!("cached visibility of {} lights on {} quads", lit.lights.len(), lit.quads.len()),
            need,
            budget,
            advice(need),
        ))
    }

    /// Plans light volumes of optical depths that equal the walk from every cell to every light. `None` where
    /// there are none (a light that is not directional, a quad that is no parallelogram, matter that a sheet
    /// makes thinner), where they take more than `budget` bytes, or where filling them would take longer than
    /// the walks of `rays` view rays.
    pub fn exact(lit: &LitQuads, rays: u64, budget: u64) -> Option<Self> {
        let is_directional = |light: &Light| matches!(light, Light::Directional { .. });
        let is_even = |quad: &Quad| quad.mist > 0.0 || !quad.changes_matter() && quad.map.is_parallelogram();
        let fits = lit.trace.max_cells <= MAX_WALK_CELLS
            && lit.lights.iter().all(is_directional)
            && lit.quads.iter().all(is_even);
        let columns_of = |volume: &VolumeTexture| u64::from(volume.size[0]) * u64::from(volume.size[1]);
        // More light volumes are not planned than there are quads and lights.
        if !fits || lit.volumes.iter().any(|volume| columns_of(volume) > COLUMNS_A_RAY * rays) {
            return None;
        }
        let whole = LightVolumes::planned(lit, Form::Depths, |_| 0.0, [f64::INFINITY; 2]);
        let columns =
            whole.volumes.iter().map(|own| columns_of(&lit.volumes[own.volume as usize])).sum::<u64>();
        let pays = columns <= COLUMNS_A_RAY * rays * lit.lights.len() as u64;
        let bytes = whole.bytes(&lit.extents());
        (pays && bytes <= u128::from(budget)).then_some(whole)
    }

    /// Memory of all light volumes in bytes. `extents` are the sizes of each volume's levels, texels.
    pub fn bytes(&self, extents: &[[u32; 3]]) -> u128 {
        let bytes = |extent: &[u32; 3]| self.words(*extent).map(u128::from).iter().product::<u128>() * 4;
        let each: Vec<u128> = extents.iter().map(bytes).collect();
        self.volumes.iter().map(|own| each[own.volume as usize]).sum()
    }

    /// Number of four-byte words in one light volume along x, y and z, for a texture of that many cells.
    pub fn words(&self, [nx, ny, nz]: [u32; 3]) -> [u32; 3] {
        match self.form {
            Form::Codes => [nx, ny, nz.div_ceil(CELLS_A_WORD)],
            Form::Depths => [nx, ny, nz],
        }
    }

    /// Whether any patch interpolates between light volumes at its corners.
    pub fn cornered(&self) -> bool {
        self.patches.iter().any(|patches| patches.cornered)
    }

    /// Whether rays walk to a light in any patch.
    pub fn marches(&self) -> bool {
        self.marched.contains(&true)
    }

    /// Plan for patches of the given maximum turns, in radians. Directions that differ by less than
    /// `tolerance` times their length share a light volume.
    fn at_angles(lit: &LitQuads, angles: [f64; 2], tolerance: f32) -> Self {
        let form = match lit.scattering {
            Scattering::Single => Form::Codes,
            Scattering::Multiple => Form::Depths,
        };
        let own =
            |i| if i < lit.own_lights { tolerance } else { tolerance.max(ENVIRONMENT_DIRECTION_TOLERANCE) };
        LightVolumes::planned(lit, form, own, angles)
    }

    /// Plan of light volumes of a form. Directions to light `i` that differ by less than `tolerance(i)` times
    /// their length share a light volume; with 0, equal ones do.
    fn planned(lit: &LitQuads, form: Form, tolerance: impl Fn(usize) -> f32, angles: [f64; 2]) -> Self {
        let &LitQuads { quads, lights, eye, trace, volumes: textures, .. } = lit;
        let mut medium = Medium::of(trace);
        medium.max_cells = medium.max_cells.min(MAX_WALK_CELLS);
        let mut volumes: Vec<LightVolume> = Vec::new();
        let mut known: HashMap<([i64; 3], u32, u32), u32> = HashMap::new();
        let mut number_of = |volume: u32, direction: Vec3, bits: f32, tolerance: f32| {
            let step = tolerance * direction.length().max(1e-30);
            // The step is rounded to a power of two. Directions that are nearly equal then round to the same
            // grid.
            let step = step.log2().floor().exp2();
            let place = |x: f32| match tolerance {
                0.0 => i64::from(x.to_bits()),
                _ => (x / step).round() as i64,
            };
            let key = (direction.to_array().map(place), bits.to_bits(), volume);
            *known.entry(key).or_insert_with(|| {
                volumes.push(LightVolume { volume, direction, bits });
                volumes.len() as u32 - 1
            })
        };
        let (mut numbers, mut marched, mut patches) = (Vec::new(), Vec::new(), Vec::new());
        let widest = MARCH_ANGLE.to_radians().max(2.0 * angles[1]);
        for quad in quads {
            let volume = quad.material.volume;
            let &VolumeTexture { size, alpha, .. } = &textures[volume as usize];
            let cell_depth = if medium.per_cell { 1.0 } else { quad.material.thickness_m / size[2] as f32 };
            let bits = match form {
                Form::Codes => extinction(&trace.attenuation, alpha) * cell_depth,
                Form::Depths => 1.0,
            };
            let side_seen = if quad_seen_from_behind(quad, eye) { -1.0 } else { 1.0 };
            for (i, light) in lights.iter().enumerate() {
                let tolerance = tolerance(i);
                if quad.mist > 0.0 {
                    // Mist computes its light without light volumes; the entry only keeps the indices
                    // regular.
                    patches.push(Patches { first: numbers.len() as u32, count: [1, 1], cornered: false });
                    numbers.push(0);
                    marched.push(false);
                    continue;
                }
                let at = |u: f32, v: f32| direction(quad, light, side_seen, size, Vec2::new(u, v));
                let (count, cornered) = cut(&at, angles);
                patches.push(Patches { first: numbers.len() as u32, count, cornered });
                let [nu, nv] = count.map(|n| n + u32::from(cornered));
                let offset = if cornered { 0.0 } else { 0.5 };
                let coordinate = |i: u32, n: u32| (i as f32 + offset) / n as f32;
                let places = (0..nv).flat_map(|j| (0..nu).map(move |i| [i, j]));
                let directions: Vec<Vec3> =
                    places.map(|[i, j]| at(coordinate(i, count[0]), coordinate(j, count[1]))).collect();
                let (walked, needed) = match cornered {
                    true => walked_and_needed(&directions, [nu, nv], widest),
                    false => (vec![false; directions.len()], vec![true; directions.len()]),
                };
                let number = |(&d, needed): (&Vec3, bool)| {
                    if needed { number_of(volume, d, bits, tolerance) } else { 0 }
                };
                numbers.extend(directions.iter().zip(needed).map(number));
                marched.extend(walked);
            }
        }
        if volumes.is_empty() && !numbers.is_empty() {
            volumes.push(LightVolume { volume: 0, direction: Vec3::Z, bits: 1.0 });
        }
        LightVolumes { volumes, numbers, marched, patches, lights: lights.len(), medium, form }
    }
}

/// Advice for light volumes of `need` bytes that do not fit.
fn advice(need: u128) -> String {
    let mib = need.div_ceil(1 << 20);
    match mib <= MOST_CACHE {
        true => format!(
            "set light.cache={mib}, with --memory={}MiB or more, or use light.visibility=march",
            2 * mib
        ),
        false => "use light.visibility=march, fewer lights or a smaller volume".into(),
    }
}

/// Whether the eye is behind the plane of a quad. All its rays then meet the quad from behind.
fn quad_seen_from_behind(quad: &Quad, eye: DVec3) -> bool {
    (eye - quad.map.a_world.as_dvec3()).dot(quad.map.n_world.as_dvec3()) < 0.0
}

/// Direction from a point of a quad towards a light, in cells per cell depth. `side` is −1 for a quad seen
/// from behind, else 1.
fn direction(quad: &Quad, light: &Light, side: f32, size: [u32; 3], uv: Vec2) -> Vec3 {
    let map = &quad.map;
    let frame = CellFrame::new(map, &quad.material, size, uv);
    let (l, _) = light.at(map.point_world(uv.x, uv.y));
    let plane = Vec3::new(l.dot(map.e1_world), l.dot(map.e2_world), l.dot(map.n_world) * side);
    frame.cell_from_plane(plane) * frame.depth
}

/// Whether rays walk to a light in each patch, by its first corner, and whether each corner needs a light
/// volume. `directions` are those at the `nu` times `nv` corners; patches that turn by more than `widest`
/// radians are walked.
fn walked_and_needed(directions: &[Vec3], [nu, nv]: [u32; 2], widest: f64) -> (Vec<bool>, Vec<bool>) {
    let (mut walked, mut needed) = (vec![false; directions.len()], vec![false; directions.len()]);
    for (j, i) in (0..nv - 1).flat_map(|j| (0..nu - 1).map(move |i| (j, i))) {
        let first = (j * nu + i) as usize;
        let corners = [first, first + 1, first + nu as usize, first + nu as usize + 1];
        walked[first] = turn_between(corners.map(|n| directions[n].as_dvec3())) > widest;
        if !walked[first] {
            corners.iter().for_each(|&n| needed[n] = true);
        }
    }
    (walked, needed)
}

/// Largest angle between two of four directions, radians.
fn turn_between(directions: [DVec3; 4]) -> f64 {
    let angle = |a: usize, b: usize| directions[a].angle_between(directions[b]);
    (0..4).flat_map(|a| (0..a).map(move |b| angle(a, b))).fold(0.0, f64::max)
}

/// Number of patches along u and v, and whether they are cornered. The direction turns by at most `whole`
/// over a plain patch and by at most `cornered` over a cornered one, in radians.
fn cut(at: &impl Fn(f32, f32) -> Vec3, [whole, cornered]: [f64; 2]) -> ([u32; 2], bool) {
    // Total turn of the direction along the quad's sides and centre lines, in eight steps each.
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
    let [nu, nv] = patches(whole, MAX_PATCHES + 1);
    if nu * nv <= MAX_PATCHES { ([nu, nv], false) } else { (patches(cornered, MAX_CORNERED_SIDE), true) }
}
