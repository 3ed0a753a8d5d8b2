//! What the curves leave in the cells they pass: the sums that direction and density are made of.

use glam::{IVec3, Vec3};
use rayon::prelude::*;

use super::bundle::curve_points;
use super::ripple::Ripple;
use super::water::WaterSpec;
use crate::error::Result;
use crate::job::Monitor;
use crate::random::{Family, Stream};
use crate::walk::{Walk, floor_cell};

/// Curves a task builds before it hands its contributions over.
const CURVES_PER_TASK: usize = 64;
/// Tasks whose contributions are held at once; with 600 cells a curve these are about 40 MB.
const TASKS_PER_ROUND: usize = 64;

/// Part of a curve inside one cell: index of the cell within its slab, length × direction in cells.
type Contribution = (u32, Vec3);

/// Contributions of one task to one slab.
#[derive(Clone, Default)]
struct Bucket {
    parts: Vec<Contribution>,
    /// The strands' noise in each of them; none where ρ does not follow the strands.
    noises: Vec<f32>,
}

/// Sums over the curves, cell by cell.
pub(super) struct Flow {
    /// Length inside the cell × direction, cells.
    pub directions: Vec<Vec3>,
    /// Length × noise of the strand, and length²; empty where ρ does not follow the strands.
    pub strands: Vec<[f32; 2]>,
}

impl Flow {
    /// Noise of the strands in a cell: their mean by length, made one of variance 1 again.
    pub fn noise(&self, index: usize) -> f32 {
        self.strands.get(index).map_or(0.0, |[sum, squares]| sum / squares.max(1e-30).sqrt())
    }

    /// Walks all curves.
    ///
    /// They are walked in parallel; their contributions are added slab by slab in z, within a slab in
    /// the curves' order, so the sums do not depend on the number of threads.
    pub fn new(spec: &WaterSpec, monitor: &dyn Monitor) -> Result<Flow> {
        let [nx, ny, nz] = spec.size.map(|n| n as usize);
        let coherent = spec.structure.coherence > 0.0;
        let cells = nx * ny * nz;
        let mut directions = vec![Vec3::ZERO; cells];
        let mut strands = vec![[0.0; 2]; if coherent { cells } else { 0 }];
        let layers_per_slab = nz.div_ceil(16);
        let slab_cells = nx * ny * layers_per_slab;
        let slabs = nz.div_ceil(layers_per_slab);
        let curves = spec.across as usize * spec.deep as usize;
        let starts: Vec<usize> = (0..curves).step_by(CURVES_PER_TASK).collect();
        for (round, tasks) in starts.chunks(TASKS_PER_ROUND).enumerate() {
            monitor.progress("curves", (round * TASKS_PER_ROUND * CURVES_PER_TASK) as u64, curves as u64)?;
            let tasks: Vec<Vec<Bucket>> = tasks
                .par_iter()
                .map(|&first| {
                    let mut buckets = vec![Bucket::default(); slabs];
                    let (mut points, mut noise) = (Vec::new(), Vec::new());
                    for curve in first..(first + CURVES_PER_TASK).min(curves) {
                        curve_points(spec, curve, &mut points);
                        if coherent {
                            strand_noise(spec, curve, points.len() - 1, &mut noise);
                        }
                        walk_curve(spec, &points, &mut |cell: IVec3, part: Vec3, segment: usize| {
                            let z = cell.z as usize;
                            let in_slab =
                                ((z % layers_per_slab) * ny + cell.y as usize) * nx + cell.x as usize;
                            let bucket = &mut buckets[z / layers_per_slab];
                            bucket.parts.push((in_slab as u32, part));
                            if coherent {
                                bucket.noises.push(noise[segment]);
                            }
                        });
                    }
                    buckets
                })
                .collect();
            directions.par_chunks_mut(slab_cells).enumerate().for_each(|(slab, cells)| {
                for &(index, v) in tasks.iter().flat_map(|buckets| &buckets[slab].parts) {
                    cells[index as usize] += v;
                }
            });
            strands.par_chunks_mut(slab_cells).enumerate().for_each(|(slab, cells)| {
                for bucket in tasks.iter().map(|buckets| &buckets[slab]) {
                    for (&(index, v), w) in bucket.parts.iter().zip(&bucket.noises) {
                        let [sum, squares] = &mut cells[index as usize];
                        *sum += v.length() * w;
                        *squares += v.length_squared();
                    }
                }
            });
        }
        Ok(Flow { directions, strands })
    }
}

/// The noise that a curve carries, at the start of each of its segments.
fn strand_noise(spec: &WaterSpec, curve: usize, segments: usize, noise: &mut Vec<f32>) {
    let mut rng = Family::new(spec.seed, Stream::Strand).member(curve as u64);
    noise.clear();
    Ripple::new(spec.structure.strand_length, &mut rng).sample(segments, noise);
}

/// Reports each cell the curve passes, its part there and the segment that came in; parts of
/// neighbouring segments inside one cell come as one. x and y wrap; what leaves in z is dropped.
fn walk_curve(spec: &WaterSpec, points: &[Vec3], report: &mut impl FnMut(IVec3, Vec3, usize)) {
    let size = IVec3::from_array(spec.size.map(|n| n as i32));
    let mut open: Option<(IVec3, Vec3, usize)> = None;
    let mut add = |cell: IVec3, part: Vec3, segment: usize| match &mut open {
        Some((last, sum, _)) if *last == cell => *sum += part,
        _ => {
            if let Some((last, sum, first)) = open.replace((cell, part, segment))
                && (0..size.z).contains(&last.z)
            {
                report(last, sum, first);
            }
        }
    };
    for (segment, ends) in points.windows(2).enumerate() {
        let d = ends[1] - ends[0];
        let cell = cell_of(ends[0]);
        if cell == cell_of(ends[1]) {
            // Many segments lie in one cell: the walk would find just that.
            add(IVec3::new(cell.x.rem_euclid(size.x), cell.y.rem_euclid(size.y), cell.z), d, segment);
            continue;
        }
        for crossing in Walk::new(size, ends[0], d, 1.0) {
            add(crossing.cell, d * (crossing.t_exit - crossing.t_enter), segment);
        }
    }
    if let Some((cell, sum, first)) = open
        && (0..size.z).contains(&cell.z)
    {
        report(cell, sum, first);
    }
}

#[inline]
fn cell_of(p: Vec3) -> IVec3 {
    IVec3::new(floor_cell(p.x), floor_cell(p.y), floor_cell(p.z))
}
