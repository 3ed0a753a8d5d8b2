//! §2 Builder of strands that another program made: a wig, a fleece, a field of grass.

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3, Vec3};

use super::VolumeTexture;
use super::threads::{Look, Thread, Threads, cells_of_threads};
use crate::model::Strands;
use crate::util::error::Result;
use crate::util::monitor::Monitor;

/// Recipe of a volume of given strands. Equal recipes build equal bytes.
#[derive(Clone, Debug, PartialEq)]
pub struct StrandsSpec {
    /// File of the strands.
    pub path: PathBuf,
    /// The strands.
    pub strands: Arc<Strands>,
    /// nx, ny, nz, cells, which are cubes.
    pub size: [u32; 3],
    /// Corner of the cell at the origin, in the unit of the strands.
    pub corner: Vec3,
    /// Edge of a cell, in the unit of the strands.
    pub edge: f32,
    /// Diameter of all strands, in the unit of the strands. `None`: that of each point.
    pub width: Option<f32>,
    /// Metres in the unit of the strands.
    pub unit: f64,
    /// Turn from the axes of the file to those of the scene.
    pub scene_from_file: DMat3,
    /// What the file has and the strands lack, one sentence each.
    pub notes: Vec<String>,
    /// Scale α of the density, kept beside the cells and not in them.
    pub alpha: f32,
    /// k_d.
    pub k_d: f32,
    /// k_s of all cells. `None`: each cell has its place on a ramp of colours there, the way from root to
    /// tip.
    pub k_s: Option<f32>,
}

impl StrandsSpec {
    /// Recipe for strands with `longest` cells along the longest side of their bounds, and the rest as in
    /// `rest`, whose size, corner and edge are chosen here. `None` for strands without extent.
    pub fn around(longest: u32, rest: StrandsSpec) -> Option<StrandsSpec> {
        let [low, high] = rest.strands.bounds()?;
        let wide = rest.width.unwrap_or_else(|| rest.strands.widths.iter().copied().fold(0.0, f32::max));
        // Half a strand beside its middle, and a cell, so that nothing is cut.
        let sides = high - low + Vec3::splat(wide);
        let edge = sides.max_element() / longest.saturating_sub(2).max(1) as f32;
        if !(edge.is_finite() && edge > 0.0) {
            return None;
        }
        let size = (sides / edge).to_array().map(|side| side.ceil() as u32 + 2);
        let middle = low + 0.5 * (high - low);
        let corner = middle - Vec3::from_array(size.map(|n| n as f32)) * (0.5 * edge);
        Some(StrandsSpec { size, corner, edge, ..rest })
    }

    /// Transform from texture coordinates, 0 to 1, to the scene, metres.
    pub fn world_from_texture(&self) -> DAffine3 {
        let sides = DVec3::from_array(self.size.map(f64::from)) * f64::from(self.edge);
        let place = DAffine3::from_translation(self.corner.as_dvec3()) * DAffine3::from_scale(sides);
        DAffine3::from_mat3(self.scene_from_file * self.unit) * place
    }

    /// Builds the volume texture in dense storage.
    ///
    /// # Errors
    /// Returns an error if `monitor` ends the work.
    pub fn build(&self, monitor: &dyn Monitor) -> Result<VolumeTexture> {
        let cells = cells_of_threads(self.size, self.threads(), self.k_s, monitor)?;
        Ok(VolumeTexture { size: self.size, alpha: self.alpha, cells })
    }

    /// The strands.
    pub(super) fn threads(&self) -> Threads<impl Fn(usize, &mut Thread) + Sync> {
        Threads {
            count: self.strands.count(),
            draw: |number, thread: &mut Thread| self.strand(number, thread),
        }
    }

    /// Writes the strand with a number.
    fn strand(&self, number: usize, thread: &mut Thread) {
        let (points, widths) = self.strands.strand(number);
        let segments = points.len().saturating_sub(1).max(1) as f32;
        for (i, (point, width)) in points.iter().zip(widths).enumerate() {
            thread.points.push((*point - self.corner) / self.edge);
            let width = self.width.unwrap_or(*width) / self.edge;
            thread.looks.push(Look { width, place: i as f32 / segments, k_d: self.k_d });
        }
    }
}
