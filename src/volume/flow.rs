//! §2 Sums over the curves in every cell they pass, from which direction and density follow.

use glam::{IVec3, Vec3};
use rayon::prelude::*;

use super::bricks::{BRICK, Bricks, Marks, parted};
use super::bundle::curve_points;
use super::cell::Cell;
use super::ripple::Ripple;
use super::spec::WaterSpec;
use crate::util::error::Result;
use crate::util::monitor::Monitor;
use crate::util::random::{Family, Stream};
use crate::walk::{Walk, floor_cell};

/// Number of curves that one task builds before it hands over their contributions.
const CURVES_PER_TASK: usize = 64;
/// Number of tasks whose contributions are in memory at once: about 40 MB if a curve passes 600 cells.
const TASKS_PER_ROUND: usize = 64;
/// Number of curves from which [`expected_cells`] estimates how many cells all of them pass.
const SAMPLE_CURVES: usize = 32;

/// Length of a strand in a cell from which no later strand takes the cell's line from it, cells.
const LINE_LENGTH: f32 = 0.5;

/// Bytes of the line that a cell keeps while curves are walked.
pub(super) const LINE_BYTES: usize = size_of::<Line>();

/// Part of a curve inside one cell: index of the cell in its slab, and length × direction, cells.
type Contribution = (u32, Vec3);

/// A run of a curve's segments inside one cell.
#[derive(Clone, Copy)]
pub(super) struct Part {
    /// The cell; x and y wrapped into the tile.
    pub cell: IVec3,
    /// Length × direction, cells.
    pub way: Vec3,
    /// Number of the segment that enters.
    pub segment: usize,
    /// Length, and length × place of the middle in the cell, summed over the segments, cells.
    length: f32,
    places: Vec3,
}

impl Part {
    /// Place of the middle, cells from the cell's corner.
    fn middle(&self) -> Vec3 {
        self.places / self.length.max(1e-20)
    }
}

/// Contributions of one task to one slab.
#[derive(Clone, Default)]
struct Bucket {
    parts: Vec<Contribution>,
    /// Noise of the strand in each part; empty if ρ does not follow the strands.
    noises: Vec<f32>,
    /// Place of the middle of each part in its cell; empty if cells keep no lines.
    places: Vec<Vec3>,
}

/// Sums over all curves, for each cell.
pub(super) struct Flow {
    /// Sum of length × direction of the parts inside the cell, cells.
    pub directions: Vec<Vec3>,
    /// Sums of length × noise and of length² of the parts inside the cell; empty if ρ does not follow the
    /// strands.
    pub strands: Vec<[f32; 2]>,
    /// The strand that each cell keeps; empty if cells keep no lines.
    lines: Vec<Line>,
}

/// The strand that a cell keeps: the first curve that passes half a cell of it, otherwise the longest. So a
/// strand stays one line through all cells that other strands pass too.
#[derive(Clone, Copy, Default)]
struct Line {
    /// Length × direction inside the cell, cells.
    way: Vec3,
    /// Place of its middle, cells from the cell's corner.
    place: Vec3,
}

impl Flow {
    /// Packs the direction of a cell, or its strand's direction and line if cells keep lines.
    fn cell(&self, index: usize) -> Cell {
        match self.lines.get(index) {
            Some(line) => Cell::with_line(line.way, line.place),
            None => Cell::from_direction(self.directions[index]),
        }
    }

    /// Packs the directions of all cells, in their order.
    pub fn cells(&self) -> Vec<Cell> {
        (0..self.directions.len()).into_par_iter().map(|index| self.cell(index)).collect()
    }

    /// Noise of the strands in a cell: their mean weighted by length, scaled to variance 1.
    pub fn noise(&self, index: usize) -> f32 {
        self.strands.get(index).map_or(0.0, |[sum, squares]| sum / squares.max(1e-30).sqrt())
    }

    /// Sums over the curves of a specification for every cell of the volume, in the order of dense storage.
    ///
    /// # Errors
    /// Returns an error if `monitor` ends the work.
    pub fn new(spec: &WaterSpec, monitor: &dyn Monitor) -> Result<Flow> {
        Flow::along(spec, |curve, points| curve_points(spec, curve, points), monitor)
    }

    /// As [`Flow::new`], over other curves: `draw` writes the points of a curve, given its number.
    ///
    /// # Errors
    /// Returns an error if `monitor` ends the work.
    pub fn along(
        spec: &WaterSpec,
        draw: impl Fn(usize, &mut Vec<Vec3>) + Sync,
        monitor: &dyn Monitor,
    ) -> Result<Flow> {
        let [nx, ny, nz] = spec.size.map(|n| n as usize);
        let layers_per_slab = nz.div_ceil(16);
        let slab = nx * ny * layers_per_slab;
        let lengths: Vec<usize> =
            (0..nz.div_ceil(layers_per_slab)).map(|i| slab.min(nx * ny * nz - i * slab)).collect();
        let position = |cell: IVec3| {
            let z = cell.z as usize;
            let in_slab = ((z % layers_per_slab) * ny + cell.y as usize) * nx + cell.x as usize;
            (z / layers_per_slab, in_slab as u32)
        };
        Flow::summed(spec, &draw, &lengths, position, [0, 1], monitor)
    }

    /// Sums over all curves for the cells that `bricks` will store, in their order. Each sum equals that of
    /// [`Flow::new`].
    ///
    /// # Errors
    /// Returns an error if `monitor` ends the work.
    pub fn packed(spec: &WaterSpec, bricks: &Bricks, monitor: &dyn Monitor) -> Result<Flow> {
        let layers = bricks.layers();
        let layers_per_slab = layers.len().div_ceil(16);
        let lengths: Vec<usize> = layers.chunks(layers_per_slab).map(|part| part.iter().sum()).collect();
        let sums = lengths.iter().scan(0, |sum, length| {
            *sum += length;
            Some(*sum - length)
        });
        let firsts: Vec<usize> = sums.collect();
        let position = |cell: IVec3| {
            let [x, y, z] = cell.to_array().map(|c| c as u32);
            let slab = (z / BRICK) as usize / layers_per_slab;
            let stored = bricks.stored_index(x, y, z).expect("the same walk marked the cell");
            (slab, (stored - firsts[slab]) as u32)
        };
        let draw = |curve: usize, points: &mut Vec<Vec3>| curve_points(spec, curve, points);
        Flow::summed(spec, &draw, &lengths, position, [1, 2], monitor)
    }

    /// Sums over all curves. `lengths` are the numbers of cells of the slabs, and `position` gives the slab
    /// of a cell and its index there. The curves are walked `walks` times in all, `walks_before` times before
    /// this one.
    ///
    /// Curves are walked in parallel. Their contributions are added slab by slab in z, and inside a slab in
    /// the order of the curves, so the sums depend neither on the number of threads nor on the slabs.
    fn summed(
        spec: &WaterSpec,
        draw: &(impl Fn(usize, &mut Vec<Vec3>) + Sync),
        lengths: &[usize],
        position: impl Fn(IVec3) -> (usize, u32) + Sync,
        [walks_before, walks]: [u64; 2],
        monitor: &dyn Monitor,
    ) -> Result<Flow> {
        let cells = lengths.iter().sum();
        let strand_cells = if spec.structure.coherence > 0.0 { cells } else { 0 };
        let line_cells = if spec.structure.lines { cells } else { 0 };
        let mut flow = Flow {
            directions: vec![Vec3::ZERO; cells],
            strands: vec![[0.0; 2]; strand_cells],
            lines: vec![Line::default(); line_cells],
        };
        let curves = spec.across as usize * spec.deep as usize;
        let starts: Vec<usize> = (0..curves).step_by(CURVES_PER_TASK).collect();
        for (round, starts) in starts.chunks(TASKS_PER_ROUND).enumerate() {
            let done = (round * TASKS_PER_ROUND * CURVES_PER_TASK) as u64;
            monitor.progress("curves", walks_before * curves as u64 + done, walks * curves as u64)?;
            let tasks: Vec<Vec<Bucket>> = starts
                .par_iter()
                .map(|&first| {
                    let own = first..(first + CURVES_PER_TASK).min(curves);
                    contributions(spec, draw, own, lengths.len(), &position)
                })
                .collect();
            flow.add(&tasks, lengths);
        }
        Ok(flow)
    }

    /// Adds the contributions of `tasks` to the cells of the slabs, in the order of the tasks.
    fn add(&mut self, tasks: &[Vec<Bucket>], lengths: &[usize]) {
        parted(&mut self.directions, lengths).into_par_iter().enumerate().for_each(|(slab, cells)| {
            for &(index, v) in tasks.iter().flat_map(|buckets| &buckets[slab].parts) {
                cells[index as usize] += v;
            }
        });
        if !self.lines.is_empty() {
            parted(&mut self.lines, lengths).into_par_iter().enumerate().for_each(|(slab, cells)| {
                for bucket in tasks.iter().map(|buckets| &buckets[slab]) {
                    for (&(index, way), &place) in bucket.parts.iter().zip(&bucket.places) {
                        let line = &mut cells[index as usize];
                        let [kept, own] = [line.way, way].map(Vec3::length_squared);
                        if kept < LINE_LENGTH * LINE_LENGTH && own > kept {
                            *line = Line { way, place };
                        }
                    }
                }
            });
        }
        if self.strands.is_empty() {
            return;
        }
        parted(&mut self.strands, lengths).into_par_iter().enumerate().for_each(|(slab, cells)| {
            for bucket in tasks.iter().map(|buckets| &buckets[slab]) {
                for (&(index, v), w) in bucket.parts.iter().zip(&bucket.noises) {
                    let [sum, squares] = &mut cells[index as usize];
                    *sum += v.length() * w;
                    *squares += v.length_squared();
                }
            }
        });
    }
}

/// Walks `curves` and sorts their contributions into one bucket for each slab.
fn contributions(
    spec: &WaterSpec,
    draw: &impl Fn(usize, &mut Vec<Vec3>),
    curves: std::ops::Range<usize>,
    slabs: usize,
    position: &impl Fn(IVec3) -> (usize, u32),
) -> Vec<Bucket> {
    let coherent = spec.structure.coherence > 0.0;
    let mut buckets = vec![Bucket::default(); slabs];
    let (mut points, mut noise) = (Vec::new(), Vec::new());
    for curve in curves {
        draw(curve, &mut points);
        if coherent {
            strand_noise(spec, curve, points.len().saturating_sub(1), &mut noise);
        }
        walk_curve(spec.size, &points, &mut |part: Part| {
            let (slab, in_slab) = position(part.cell);
            let bucket = &mut buckets[slab];
            bucket.parts.push((in_slab, part.way));
            if coherent {
                bucket.noises.push(noise[part.segment]);
            }
            if spec.structure.lines {
                bucket.places.push(part.middle());
            }
        });
    }
    buckets
}

/// Marks every cell that a curve passes.
///
/// # Errors
/// Returns an error if `monitor` ends the work.
pub(super) fn marked(spec: &WaterSpec, monitor: &dyn Monitor) -> Result<Marks> {
    let marks = Marks::new(spec.size);
    let curves = spec.across as usize * spec.deep as usize;
    let starts: Vec<usize> = (0..curves).step_by(CURVES_PER_TASK).collect();
    for (round, tasks) in starts.chunks(TASKS_PER_ROUND).enumerate() {
        let done = (round * TASKS_PER_ROUND * CURVES_PER_TASK) as u64;
        monitor.progress("curves", done, 2 * curves as u64)?;
        tasks.par_iter().for_each(|&first| {
            let mut points = Vec::new();
            for curve in first..(first + CURVES_PER_TASK).min(curves) {
                curve_points(spec, curve, &mut points);
                walk_curve(spec.size, &points, &mut |part: Part| marks.add(part.cell));
            }
        });
    }
    Ok(marks)
}

/// Estimates how many cells the curves pass: extrapolates from some of the curves, as if the cells of all
/// were strewn independently.
pub(super) fn expected_cells(spec: &WaterSpec) -> u64 {
    let curves = spec.across as usize * spec.deep as usize;
    let sample: Vec<usize> = (0..curves).step_by(curves.div_ceil(SAMPLE_CURVES)).collect();
    let passed: u64 = sample
        .par_iter()
        .map(|&curve| {
            let (mut points, mut passed) = (Vec::new(), 0);
            curve_points(spec, curve, &mut points);
            walk_curve(spec.size, &points, &mut |_: Part| passed += 1);
            passed
        })
        .sum();
    let all = spec.size.iter().map(|&n| f64::from(n)).product::<f64>();
    let passed = passed as f64 / sample.len() as f64 * curves as f64;
    (all * -(-passed / all).exp_m1()) as u64
}

/// Writes the noise that a curve carries at the start of each of its segments into `noise`.
fn strand_noise(spec: &WaterSpec, curve: usize, segments: usize, noise: &mut Vec<f32>) {
    let mut rng = Family::new(spec.seed, Stream::Strand).member(curve as u64);
    noise.clear();
    Ripple::new(spec.structure.strand_length, &mut rng).sample(segments, noise);
}

/// Reports the parts of the curve, cell by cell. Successive segments inside one cell are one part. x and y
/// wrap around; cells outside the slab in z are dropped.
pub(super) fn walk_curve(size: [u32; 3], points: &[Vec3], report: &mut impl FnMut(Part)) {
    let size = IVec3::from_array(size.map(|n| n as i32));
    let mut open: Option<Part> = None;
    let mut add = |cell: IVec3, way: Vec3, start: Vec3, segment: usize| {
        let middle = start + way * 0.5;
        let places = (middle - middle.floor()) * way.length();
        match &mut open {
            Some(last) if last.cell == cell => {
                last.way += way;
                last.places += places;
                last.length += way.length();
            }
            _ => {
                let part = Part { cell, way, places, length: way.length(), segment };
                if let Some(last) = open.replace(part)
                    && (0..size.z).contains(&last.cell.z)
                {
                    report(last);
                }
            }
        }
    };
    for (segment, ends) in points.windows(2).enumerate() {
        let d = ends[1] - ends[0];
        let cell = cell_of(ends[0]);
        if cell == cell_of(ends[1]) {
            // Many segments lie in one cell, and then the walk would find that cell alone.
            let wrapped = IVec3::new(cell.x.rem_euclid(size.x), cell.y.rem_euclid(size.y), cell.z);
            add(wrapped, d, ends[0], segment);
            continue;
        }
        for crossing in Walk::new(size, ends[0], d, 1.0) {
            let way = d * (crossing.t_exit - crossing.t_enter);
            add(crossing.cell, way, ends[0] + d * crossing.t_enter, segment);
        }
    }
    if let Some(last) = open
        && (0..size.z).contains(&last.cell.z)
    {
        report(last);
    }
}

/// Cell that holds the point `p`, not wrapped around.
#[inline]
fn cell_of(p: Vec3) -> IVec3 {
    IVec3::new(floor_cell(p.x), floor_cell(p.y), floor_cell(p.z))
}
