//! Grids of a volume texture, for programs that read OpenVDB.

use glam::{DAffine3, DMat3, DVec3};

use super::VolumeTexture;
use crate::grid::{Builder, Class, Grid};
use crate::util::error::{Error, Result};

/// Samples of a leaf along an axis.
const LEAF: u32 = 8;
/// Names of the grids, and the numbers of a sample.
const GRIDS: [(&str, usize); 4] = [("density", 1), ("velocity", 3), ("kd", 1), ("ks", 1)];
/// Memory of a leaf of all grids with their masks and places, bytes: six numbers a sample.
const LEAF_BYTES: u64 = 4 * 6 * 512 + 4 * (8 * 8 + 12 + 4);

impl VolumeTexture {
    /// Transform from texture coordinates, 0 to 1 along each axis, to a box with cubic cells around the
    /// origin, whose longest side is 1.
    pub fn unit_box(size: [u32; 3]) -> DAffine3 {
        let size = DVec3::from_array(size.map(f64::from));
        let sides = size / size.max_element();
        DAffine3::from_scale_rotation_translation(sides, glam::DQuat::IDENTITY, -sides / 2.0)
    }

    /// Grids with a voxel for each cell that has a direction, which are the active ones: `density` (ρ with
    /// α), `velocity` (v as a unit vector in the axes of the world), `kd` and `ks`. `world_from_texture`
    /// takes texture coordinates, 0 to 1 along each axis, to the world. Where it only moves and scales, all
    /// axes alike, `velocity` has the bits of v.
    ///
    /// # Errors
    /// [`Error::Memory`] where the grids take more than `budget` bytes.
    pub fn grids(&self, world_from_texture: DAffine3, budget: u64) -> Result<Vec<Grid>> {
        let cells = DVec3::from_array(self.size.map(f64::from));
        let to_world = world_from_texture
            * DAffine3::from_scale(1.0 / cells)
            * DAffine3::from_translation(DVec3::splat(0.5));
        let axes = (!is_even(&to_world.matrix3)).then_some(to_world.matrix3);
        let mut builders = GRIDS.map(|(_, channels)| Builder::new(channels, [0.0; 3]));
        let [nx, ny, nz] = self.size.map(|n| n.div_ceil(LEAF));
        let mut taken = 0;
        let mut numbers = vec![[0.0f32; 6]; 512];
        for z in 0..nz {
            for y in 0..ny {
                for x in 0..nx {
                    let low = [x, y, z].map(|n| n * LEAF);
                    let active = self.leaf(low, axes.as_ref(), &mut numbers);
                    if active == [0; 8] {
                        continue;
                    }
                    taken += LEAF_BYTES;
                    if taken > budget {
                        return Err(Error::memory(
                            "the grids of the volume",
                            taken.into(),
                            budget,
                            "raise --memory, or write an .npz",
                        ));
                    }
                    let mut first = 0;
                    for (builder, (_, channels)) in builders.iter_mut().zip(GRIDS) {
                        let own = first..first + channels;
                        let fill = |into: &mut [f32]| {
                            let parts = into.chunks_exact_mut(channels);
                            parts.zip(&numbers).for_each(|(to, from)| to.copy_from_slice(&from[own.clone()]));
                        };
                        let placed = builder.leaf(low.map(|n| n as i32), active, fill);
                        placed.expect("leaves have places of their own");
                        first += channels;
                    }
                }
            }
        }
        let class = |name: &str| if name == "density" { Class::FogVolume } else { Class::Unknown };
        let finish =
            |(builder, (name, _)): (Builder, (&str, usize))| builder.finish(name, class(name), to_world);
        Ok(builders.into_iter().zip(GRIDS).map(finish).collect())
    }

    /// Writes the numbers of the 8×8×8 cells from `low` on: ρ, v, k_d and k_s. Returns those with a
    /// direction. `axes` takes v to the world, where its direction is another there.
    fn leaf(&self, low: [u32; 3], axes: Option<&DMat3>, numbers: &mut [[f32; 6]]) -> [u64; 8] {
        let mut active = [0u64; 8];
        for (i, out) in numbers.iter_mut().enumerate() {
            *out = [0.0; 6];
            let local = [i & 7, i >> 3 & 7, i >> 6];
            let at: [u32; 3] = std::array::from_fn(|a| low[a] + local[a] as u32);
            if (0..3).any(|a| at[a] >= self.size[a]) {
                continue;
            }
            let cell = self.cell(at[0], at[1], at[2]);
            if cell.has_direction() {
                active[i >> 6] |= 1 << (i & 63);
                let v = match axes {
                    Some(axes) => (*axes * cell.v().as_dvec3()).normalize_or_zero().as_vec3(),
                    None => cell.v(),
                };
                let (k_d, k_s) = cell.k();
                *out = [cell.rho() * self.alpha, v.x, v.y, v.z, k_d, k_s];
            }
        }
        active
    }
}

/// Largest difference of two sides, as a share, that the rounding of a transform explains.
const ROUNDING: f64 = 1e-12;

/// Whether a matrix scales all axes alike and turns nothing, so that directions stay.
fn is_even(matrix: &DMat3) -> bool {
    let scale = matrix.x_axis.x;
    let rest = *matrix - DMat3::from_diagonal(DVec3::splat(scale));
    scale > 0.0 && rest.to_cols_array().iter().all(|x| x.abs() <= ROUNDING * scale)
}
