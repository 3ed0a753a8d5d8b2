//! §5 V_i(k) kept: which light volumes a scene needs, and in which units their depths are.
//!
//! A light volume has a number for every cell of the volume texture: the optical depth from the cell's centre to
//! where the light's ray leaves the slab, for one direction of light in cells. The slab's copies go on for ever,
//! so for a directional light and a parallelogram one light volume says what an exact walk from every cell
//! would. Where the direction in cells changes over a quad (a point light; a map that is no parallelogram's) the
//! quad is cut into patches with a light volume at each corner, between which depths are interpolated.
//!
//! Depths are in units of one cell's depth at ρ = 1, so that they depend neither on σ nor on α. Passes:
//! `src/gpu/visibility.rs` with `shaders/visibility.wgsl`, and `src/cpu/visibility.rs`.

use std::collections::HashMap;

use glam::{Vec2, Vec3};

use crate::error::{Error, Result};
use crate::mapping::CellFrame;
use crate::scene::{Attenuation, Light, Quad, Scene};

/// Bytes of a cell in one light volume.
pub const DEPTH_BYTES: u64 = 4;

/// Angles between the light's directions (in cells) at neighbouring corners of a patch, in degrees: the smallest
/// whose light volumes fit into the budget is taken. At 4° a point light half a quad's width away gives 5 % RMSE
/// against exact walks, of the size of single cells; beyond 32° shadows at the middle of a patch are seen double.
const CORNER_ANGLES: [f32; 4] = [4.0, 8.0, 16.0, 32.0];

/// Most patches along one side of a quad.
const MAX_PATCHES: u32 = 16;

/// Directions that differ by less, relative to their length, share a light volume: over a slab of 1000 cells they
/// part by a thousandth of a cell.
const SAME_DIRECTION: f32 = 1e-6;

/// The light volumes of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct LightVolumes {
    /// Towards the light, in cells per cell depth: J⁻¹l·(H/nz). One light volume for each.
    pub directions: Vec<Vec3>,
    /// Number of the light volume at each corner of each patch, row by row along u.
    pub corners: Vec<u32>,
    /// Of quad q and light i the entry q·lights + i.
    pub patches: Vec<Patches>,
    /// Number of lights.
    pub lights: usize,
    /// What the depths are of.
    pub medium: Medium,
}

/// How a quad is cut for one light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Patches {
    /// Its first corner.
    pub first: u32,
    /// Patches along each side; 0: one light volume for the whole quad.
    pub side: u32,
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
    /// Of a scene.
    pub fn of(scene: &Scene) -> Self {
        Medium {
            per_cell: matches!(scene.trace.attenuation, Attenuation::PerCell { .. }),
            max_cells: scene.trace.max_cells,
        }
    }
}

impl LightVolumes {
    /// For a scene and a volume of `size` cells; refused if even the coarsest need more than `budget` bytes.
    pub fn new(scene: &Scene, size: [u32; 3], budget: u64) -> Result<Self> {
        let mut need = 0;
        for angle in CORNER_ANGLES {
            let volumes = LightVolumes::at_angle(scene, size, angle);
            need = volumes.bytes(size);
            if need <= u128::from(budget) {
                return Ok(volumes);
            }
        }
        Err(Error::memory(
            format!(
                "cached visibility of {} lights on {} quads",
                scene.volume_lights().len(),
                scene.quads.len()
            ),
            need,
            budget,
            "raise light.cache, or use light.visibility=march",
        ))
    }

    /// Bytes of all light volumes.
    pub fn bytes(&self, size: [u32; 3]) -> u128 {
        let cells = size.iter().map(|&n| u128::from(n)).product::<u128>();
        cells * u128::from(DEPTH_BYTES) * self.directions.len() as u128
    }

    /// Whether any quad is cut into patches.
    pub fn varying(&self) -> bool {
        self.patches.iter().any(|patches| patches.side > 0)
    }

    fn at_angle(scene: &Scene, size: [u32; 3], degrees: f32) -> Self {
        let mut directions: Vec<Vec3> = Vec::new();
        let mut known: HashMap<[i64; 3], u32> = HashMap::new();
        let mut number = |d: Vec3| {
            let step = SAME_DIRECTION * d.length().max(1e-30);
            // The step is a power of two, so that equal directions fall into equal squares.
            let step = step.log2().floor().exp2();
            let key = d.to_array().map(|x| (x / step).round() as i64);
            *known.entry(key).or_insert_with(|| {
                directions.push(d);
                directions.len() as u32 - 1
            })
        };
        let (mut corners, mut patches) = (Vec::new(), Vec::new());
        let lights = scene.volume_lights();
        for quad in &scene.quads {
            let side_seen = if quad_seen_from_behind(quad, scene.camera.eye) { -1.0 } else { 1.0 };
            for light in &lights {
                let at = |u: f32, v: f32| direction(quad, light, side_seen, size, Vec2::new(u, v));
                let side = patches_a_side(&at, degrees);
                patches.push(Patches { first: corners.len() as u32, side });
                if side == 0 {
                    corners.push(number(at(0.5, 0.5)));
                } else {
                    let step = 1.0 / side as f32;
                    for i in 0..(side + 1) * (side + 1) {
                        let (u, v) = ((i % (side + 1)) as f32 * step, (i / (side + 1)) as f32 * step);
                        corners.push(number(at(u, v)));
                    }
                }
            }
        }
        let medium = Medium::of(scene);
        LightVolumes { directions, corners, patches, lights: lights.len(), medium }
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

/// Patches along each side so that directions at neighbouring corners are within `degrees`.
fn patches_a_side(at: &impl Fn(f32, f32) -> Vec3, degrees: f32) -> u32 {
    let least = degrees.to_radians().cos();
    let mut side = 0;
    loop {
        let n = side.max(1);
        let point = |i: u32, j: u32| at(i as f32 / n as f32, j as f32 / n as f32);
        let near = |a: Vec3, b: Vec3, least: f32| {
            let (a, b) = (a.as_dvec3(), b.as_dvec3());
            a.dot(b) >= least as f64 * a.length() * b.length()
        };
        let even = |least: f32| {
            (0..=n).all(|i| {
                (0..=n).all(|j| {
                    (i == n || near(point(i, j), point(i + 1, j), least))
                        && (j == n || near(point(i, j), point(i, j + 1), least))
                })
            })
        };
        // One light volume for the whole quad only where nothing would be seen of it.
        let whole = side == 0 && even((degrees * 2.0).to_radians().cos());
        if whole || (side > 0 && even(least)) || side == MAX_PATCHES {
            return side;
        }
        side = if side == 0 { 1 } else { side * 2 };
    }
}
