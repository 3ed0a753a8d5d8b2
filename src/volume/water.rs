//! §2.2 The builder for gushing water: spatial fractal curves from the face y = 0 to their twins on
//! y = ny give every cell they pass its direction; ρ and k are random per cell.

use glam::{IVec3, Vec3};
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

use super::{Cell, VolumeTexture};
use crate::curve::{CurveShape, spatial_fractal_curve};
use crate::error::Result;
use crate::job::Monitor;
use crate::random::{Family, Stream};
use crate::walk::{Walk, floor_cell};

/// Everything the water builder needs; equal specs give equal bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WaterSpec {
    /// nx, ny, nz.
    pub size: [u32; 3],
    /// Jitter grid on the face y = 0: columns in x.
    pub across: u32,
    /// Jitter grid on the face y = 0: rows in z.
    pub deep: u32,
    /// The curves.
    pub shape: CurveShape,
    /// Seed of all randomness.
    pub seed: u64,
    /// Scale of ρ; kept beside the cells, not in them.
    pub alpha: f32,
    /// Base of k_d.
    pub k_d: f32,
    /// Base of k_s.
    pub k_s: f32,
    /// Standard deviation of the noise of k.
    pub k_noise: f32,
}

/// Curves a task builds before it hands its contributions over.
const CURVES_PER_TASK: usize = 64;
/// Tasks whose contributions are held at once; with 600 cells a curve these are about 40 MB.
const TASKS_PER_ROUND: usize = 64;

/// Part of a curve inside one cell: index of the cell within its slab, length × direction in cells.
type Contribution = (u32, Vec3);

/// Builds the volume texture.
pub fn build_water(spec: &WaterSpec, monitor: &dyn Monitor) -> Result<VolumeTexture> {
    let directions = flow_directions(spec, monitor)?;
    let mut cells: Vec<Cell> = directions.into_par_iter().map(Cell::from_direction).collect();
    set_density_and_reflection(spec, &mut cells);
    Ok(VolumeTexture { size: spec.size, alpha: spec.alpha, cells: cells.into() })
}

/// Element 2: per cell the sum of (length inside the cell × direction) over all curves.
///
/// Curves are walked in parallel; their contributions are added slab by slab in z, within a slab in
/// the curves' order, so the sums do not depend on the number of threads.
fn flow_directions(spec: &WaterSpec, monitor: &dyn Monitor) -> Result<Vec<Vec3>> {
    let [nx, ny, nz] = spec.size.map(|n| n as usize);
    let mut directions = vec![Vec3::ZERO; nx * ny * nz];
    let layers_per_slab = nz.div_ceil(16);
    let slab_cells = nx * ny * layers_per_slab;
    let slabs = nz.div_ceil(layers_per_slab);
    let curves = spec.across as usize * spec.deep as usize;
    let starts: Vec<usize> = (0..curves).step_by(CURVES_PER_TASK).collect();
    for (round, tasks) in starts.chunks(TASKS_PER_ROUND).enumerate() {
        monitor.progress("curves", (round * TASKS_PER_ROUND * CURVES_PER_TASK) as u64, curves as u64)?;
        let parts: Vec<Vec<Vec<Contribution>>> = tasks
            .par_iter()
            .map(|&first| {
                let mut buckets = vec![Vec::new(); slabs];
                let mut points = Vec::new();
                for curve in first..(first + CURVES_PER_TASK).min(curves) {
                    walk_curve(spec, curve, &mut points, &mut |cell: IVec3, part: Vec3| {
                        let z = cell.z as usize;
                        let in_slab = ((z % layers_per_slab) * ny + cell.y as usize) * nx + cell.x as usize;
                        buckets[z / layers_per_slab].push((in_slab as u32, part));
                    });
                }
                buckets
            })
            .collect();
        directions.par_chunks_mut(slab_cells).enumerate().for_each(|(slab, cells)| {
            for part in &parts {
                for &(index, v) in &part[slab] {
                    cells[index as usize] += v;
                }
            }
        });
    }
    Ok(directions)
}

/// Writes the points of curve number `curve` of the jitter grid (column + row·across) into `points`, in
/// cells, unwrapped: just the curve the volume is built from.
///
/// The curve is drawn level by level, so a spec with fewer `shape.levels` gives every
/// 2^(difference)-th point of the same curve.
pub fn curve_points(spec: &WaterSpec, curve: usize, points: &mut Vec<Vec3>) {
    let [nx, ny, nz] = spec.size.map(|n| n as f32);
    let mut rng = Family::new(spec.seed, Stream::Curve).member(curve as u64);
    let column = (curve % spec.across as usize) as f32;
    let row = (curve / spec.across as usize) as f32;
    let x = (column + rng.random::<f32>()) / spec.across as f32 * nx;
    let z = (row + rng.random::<f32>()) / spec.deep as f32 * nz;
    let p1 = Vec3::new(x, 0.0, z);
    let p2 = Vec3::new(x, ny, z);
    spatial_fractal_curve(&spec.shape, p1, p2, &mut rng, points);
}

/// Builds curve number `curve` of the jitter grid and reports each cell it passes; parts of
/// neighbouring segments inside one cell come as one. x and y wrap; what leaves in z is dropped.
fn walk_curve(spec: &WaterSpec, curve: usize, points: &mut Vec<Vec3>, report: &mut impl FnMut(IVec3, Vec3)) {
    let size = IVec3::from_array(spec.size.map(|n| n as i32));
    curve_points(spec, curve, points);
    let mut open: Option<(IVec3, Vec3)> = None;
    let mut add = |cell: IVec3, part: Vec3| match &mut open {
        Some((last, sum)) if *last == cell => *sum += part,
        _ => {
            if let Some((last, sum)) = open.replace((cell, part))
                && (0..size.z).contains(&last.z)
            {
                report(last, sum);
            }
        }
    };
    for ends in points.windows(2) {
        let d = ends[1] - ends[0];
        let cell = cell_of(ends[0]);
        if cell == cell_of(ends[1]) {
            // Many segments lie in one cell: the walk would find just that.
            add(IVec3::new(cell.x.rem_euclid(size.x), cell.y.rem_euclid(size.y), cell.z), d);
            continue;
        }
        for crossing in Walk::new(size, ends[0], d, 1.0) {
            add(crossing.cell, d * (crossing.t_exit - crossing.t_enter));
        }
    }
    if let Some((cell, sum)) = open
        && (0..size.z).contains(&cell.z)
    {
        report(cell, sum);
    }
}

#[inline]
fn cell_of(p: Vec3) -> IVec3 {
    IVec3::new(floor_cell(p.x), floor_cell(p.y), floor_cell(p.z))
}

/// Elements 1 and 3: ρ = clamp(N(0,1) + 0.5, 0, 1) (before α) and k = clamp(base + noise, 0, 1) in
/// every cell with a direction. Needs no curves, so a change of k's base costs a re-packing only.
pub fn set_density_and_reflection(spec: &WaterSpec, cells: &mut [Cell]) {
    let family = Family::new(spec.seed, Stream::Cell);
    cells.par_iter_mut().enumerate().with_min_len(4096).for_each(|(index, cell)| {
        if cell.has_direction() {
            let mut rng = family.member(index as u64);
            let mut normal = || normal_rand(&mut rng);
            let rho = normal() + 0.5;
            let k_d = spec.k_d + normal() * spec.k_noise;
            let k_s = spec.k_s + normal() * spec.k_noise;
            *cell = cell.with_density(rho, k_d, k_s);
        }
    });
}

/// The paper's normal_rand(): mean 0, variance 1.
fn normal_rand(rng: &mut Pcg64Mcg) -> f32 {
    StandardNormal.sample(rng)
}
