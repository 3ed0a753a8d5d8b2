//! §2.2 Cells of matter that is made of threads with a width: hairs, yarns, blades.
//!
//! The paper's curves have no width, and ρ is drawn at random. A thread that is d cells wide hides d·ℓ of a
//! cell's face where it passes ℓ cells through it, seen from the side. That is the ρ of the cell, at most 1;
//! the threads of a cell are added up. So a finer volume of the same threads lets as much light pass. A
//! thread that is wider than a cell is cut into strips, which fill all cells of its round.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::bricks::parted;
use super::flow::{Part, walk_curve};
use super::{Cell, Cells};
use crate::util::error::Result;
use crate::util::monitor::Monitor;

/// Parts that are in memory at once, about: 30 MB of them.
const PARTS_PER_ROUND: usize = 1 << 20;
/// Number of threads of the first round, and most of any round.
const FIRST_ROUND: usize = 8;
const LARGEST_ROUND: usize = 4096;
/// Number of tasks of a round.
const TASKS_PER_ROUND: usize = 64;
/// Most strips across a thread. Wider ones have gaps.
const MOST_STRIPS: u32 = 64;
/// Bytes that building takes for each cell beside the cell itself.
pub(super) const BYTES_PER_CELL: usize = size_of::<Sum>();

/// A thread as a row of points.
#[derive(Default)]
pub(super) struct Thread {
    /// Points, cells. x and y wrap around, and what lies outside in z is cut off.
    pub points: Vec<Vec3>,
    /// Look of each segment; the last is that of all that follow.
    pub looks: Vec<Look>,
}

impl Thread {
    /// Number of strips, across and deep, into which a thread is cut so that none is wider than a cell.
    fn strips(&self) -> u32 {
        let width = self.looks.iter().map(|look| look.width).fold(0.0, f32::max);
        (width.ceil() as u32).clamp(1, MOST_STRIPS)
    }

    /// Writes the points in the middle of a strip. Returns whether it lies in the round of the thread.
    fn strip(&self, strip: u32, strips: u32, points: &mut Vec<Vec3>) -> bool {
        let middle = |i: u32| (i as f32 + 0.5) / strips as f32 - 0.5;
        let at = Vec2::new(middle(strip % strips), middle(strip / strips));
        points.clear();
        if at.length() > 0.5 {
            return false;
        }
        let [Some(&first), Some(&last)] = [self.points.first(), self.points.last()] else { return false };
        let (a, b) = (last - first).try_normalize().unwrap_or(Vec3::Z).any_orthonormal_pair();
        let aside = a * at.x + b * at.y;
        let width = |i: usize| self.looks.get(i).or(self.looks.last()).map_or(0.0, |look| look.width);
        points.extend(self.points.iter().enumerate().map(|(i, point)| *point + aside * width(i)));
        true
    }

    /// Mean of the looks of two segments.
    fn mean_look(&self, first: usize, last: usize) -> Look {
        let of = |segment: usize| self.looks.get(segment).or(self.looks.last()).copied().unwrap_or_default();
        let (a, b) = (of(first), of(last));
        let mean = |a: f32, b: f32| 0.5 * (a + b);
        Look { width: mean(a.width, b.width), place: mean(a.place, b.place), k_d: mean(a.k_d, b.k_d) }
    }

    /// Forgets the points.
    pub fn clear(&mut self) {
        self.points.clear();
        self.looks.clear();
    }
}

/// Width and colour of a thread.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Look {
    /// Diameter, cells.
    pub width: f32,
    /// Place on the volume's ramp of colours, 0 to 1.
    pub place: f32,
    /// k_d.
    pub k_d: f32,
}

/// Sums over the threads in a cell.
#[derive(Clone, Copy, Default)]
struct Sum {
    /// Length × width × direction.
    direction: Vec3,
    /// Length × width: the part of the cell's face that is hidden.
    hidden: f32,
    /// Sums of `hidden` × place and of `hidden` × k_d.
    place: f32,
    k_d: f32,
}

/// Parts of the threads of one task in one slab: the cell's index there, length × direction, and the look.
type Parts = Vec<(u32, Vec3, Look)>;

/// All threads of a volume.
pub(super) struct Threads<Draw: Fn(usize, &mut Thread) + Sync> {
    /// Number of threads.
    pub count: usize,
    /// Writes the thread with a number into an empty one.
    pub draw: Draw,
}

/// Builds the cells of threads in dense storage. Without `k_s`, each cell has its place on the ramp of
/// colours where k_s stands elsewhere.
///
/// The sums depend neither on the number of processors nor on the order in which they work.
///
/// # Errors
/// Errors of `monitor`, which may stop the work.
pub(super) fn cells_of_threads(
    size: [u32; 3],
    Threads { count, draw }: Threads<impl Fn(usize, &mut Thread) + Sync>,
    k_s: Option<f32>,
    monitor: &dyn Monitor,
) -> Result<Cells> {
    let [nx, ny, nz] = size.map(|n| n as usize);
    let layers = nz.div_ceil(16);
    let slab = nx * ny * layers;
    let lengths: Vec<usize> = (0..nz.div_ceil(layers)).map(|i| slab.min(nx * ny * nz - i * slab)).collect();
    let mut sums = vec![Sum::default(); nx * ny * nz];
    let (mut done, mut round) = (0, FIRST_ROUND);
    while done < count {
        monitor.progress("threads", done as u64, count as u64)?;
        let end = (done + round).min(count);
        let starts: Vec<usize> = (done..end).step_by(round.div_ceil(TASKS_PER_ROUND)).collect();
        let tasks: Vec<Vec<Parts>> = starts
            .par_iter()
            .map(|&first| {
                let mut parts = vec![Parts::new(); lengths.len()];
                let (mut thread, mut points) = (Thread::default(), Vec::new());
                for number in first..(first + round.div_ceil(TASKS_PER_ROUND)).min(end) {
                    thread.clear();
                    draw(number, &mut thread);
                    let mut add = |part: Part, last: usize, strips: u32| {
                        let [x, y, z] = part.cell.to_array().map(|c| c as usize);
                        let in_slab = ((z % layers) * ny + y) * nx + x;
                        let look = thread.mean_look(part.segment, last);
                        // A strip stands for its part of the round, or of what a thinner thread hides.
                        let share = look.width.max(look.width * look.width) / (strips * strips) as f32;
                        let look = Look { width: share, ..look };
                        parts[z / layers].push((in_slab as u32, part.way, look));
                    };
                    // The segment that enters the next cell is the last one in this cell.
                    let strips = thread.strips();
                    for strip in 0..strips * strips {
                        if !thread.strip(strip, strips, &mut points) {
                            continue;
                        }
                        let mut open = None;
                        walk_curve(size, &points, &mut |part: Part| {
                            if let Some(before) = open.replace(part) {
                                add(before, part.segment, strips);
                            }
                        });
                        if let Some(before) = open {
                            add(before, usize::MAX, strips);
                        }
                    }
                }
                parts
            })
            .collect();
        parted(&mut sums, &lengths).into_par_iter().enumerate().for_each(|(slab, sums)| {
            for &(index, part, look) in tasks.iter().flat_map(|parts| &parts[slab]) {
                let sum = &mut sums[index as usize];
                let hidden = part.length() * look.width;
                sum.direction += part * look.width;
                sum.hidden += hidden;
                sum.place += hidden * look.place;
                sum.k_d += hidden * look.k_d;
            }
        });
        // Long or wide threads have many parts, and then few of them are drawn at once.
        let parts = tasks.iter().flatten().map(Vec::len).sum::<usize>();
        let each = parts.div_ceil(end - done).max(1);
        (done, round) = (end, (PARTS_PER_ROUND / each).clamp(1, LARGEST_ROUND));
    }
    let packed = |sum: &Sum| {
        if sum.hidden <= 0.0 {
            return Cell::default();
        }
        let second = k_s.unwrap_or(sum.place / sum.hidden);
        Cell::from_direction(sum.direction).with_density(sum.hidden.min(1.0), sum.k_d / sum.hidden, second)
    };
    Ok(sums.par_iter().map(packed).collect::<Vec<Cell>>().into())
}
