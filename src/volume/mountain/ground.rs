//! §2 Ground of a mountain face: rock, soil in its hollows, stones, and where moss lies.

use glam::{Vec2, Vec3};
use rand::{Rng, RngExt};
use rayon::prelude::*;

use super::MountainSpec;
use crate::util::error::Result;
use crate::util::monitor::Monitor;
use crate::util::random::{Family, Stream, normal};
use crate::volume::field::{Field, blocks, fractal};

/// Place of moss on the ramp: the third of four colours.
pub(super) const MOSS: f32 = 2.0 / 3.0;
/// Places of clean rock, of the darkest cracks, and of soil, between the first and the third colour.
const ROCK: f32 = 0.1;
const DARK: f32 = 0.36;
const SOIL: f32 = 0.44;
/// Least height of the rock, cells. Under less, the skin would show.
const LEAST: f32 = 1.5;
/// Depth from which hollows are filled, standard deviations.
const SHALLOW: f32 = 1.4;
/// Depth of an open crack, standard deviations of the height.
const CRACK_DEPTH: f32 = 0.8;
/// Reach of the hollows that count as dark, and of those that gather soil, in sizes of the largest blocks.
const NEAR_HOLLOW: f32 = 0.06;
const WIDE_HOLLOW: f32 = 0.3;
/// Exponent of the numbers of stones by their radius, and the smallest by the largest.
const STONE_EXPONENT: f32 = 1.6;
const SMALLEST_STONE: f32 = 0.16;
/// Standard deviation of the tilt of a stone's faces.
const FACE_TILT: f32 = 0.6;
/// Share of the columns, by the depth of their hollow, in which stones come to rest, and that in shares of
/// `scree` where they cover more.
const RESTING: f32 = 0.5;
const RESTING_OF_SCREE: f32 = 1.5;
/// Most stones: smaller ones than cells would never cover their share.
const MOST_STONES: usize = 1 << 20;
/// Largest thickness of moss, cells.
const MOSS_CELLS: f32 = 1.6;
/// Steepest surface that directions follow, cells a cell. A step of the height field is a wall.
const STEEPEST: f32 = 4.0;

/// Matter on one column of cells.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Column {
    /// Height of rock, soil and stones above the skin, cells.
    pub height: f32,
    /// Thickness of the moss on it, cells.
    pub moss: f32,
    /// Place of the surface on the ramp.
    pub place: f32,
    /// Factors on k_d of the surface and of moss.
    pub shade: f32,
    pub moss_shade: f32,
    /// Change of the height from column to column.
    slope: Vec2,
}

impl Column {
    /// Tangent of the surface. `side` is its direction in a plane with two orthonormal tangents.
    pub fn tangent(&self, side: Vec2) -> Vec3 {
        let normal = self.slope.extend(1.0).normalize();
        let (a, b) = normal.any_orthonormal_pair();
        a * side.x + b * side.y
    }
}

/// The ground of a mountain face.
pub(super) struct Ground {
    pub columns: Vec<Column>,
    /// Numbers of the columns with soil.
    pub soil: Vec<u32>,
}

impl Ground {
    /// Makes the ground, in the order in which it came to be: rock, soil, stones, moss.
    ///
    /// # Errors
    /// Returns an error if `monitor` ends the work.
    pub fn new(spec: &MountainSpec, monitor: &dyn Monitor) -> Result<Ground> {
        let done = |stages: u64| monitor.progress("rock", stages, 4);
        done(0)?;
        let cells = [spec.size[0] as usize, spec.size[1] as usize];
        let noise = |index: u64, size: f32, h: f32| {
            let family = Family::new(spec.seed ^ (index << 56), Stream::Rock);
            fractal(cells, size.min(1.0), h, family).standard()
        };
        let [broken, crack] =
            blocks(cells, spec.block, spec.h, spec.beds, Family::new(spec.seed, Stream::Stratum));
        let (smooth, broken) = (noise(0, spec.block, spec.h), broken.standard());
        let share = spec.fracture;
        let rock = smooth.map(|i, smooth| smooth + share * (broken.values[i] - smooth)).standard();
        let deviation = spec.relief * spec.size[2] as f32;
        let most = spec.size[2] as f32;
        let height = rock.map(|i, f| {
            let f = f - share * CRACK_DEPTH * crack.values[i];
            ((shallow(f) + MountainSpec::MEAN) * deviation).clamp(LEAST.min(most), most)
        });

        done(1)?;
        // Soil lies on what tilts out of the slope, in wide hollows, and in patches.
        let reach = |blocks: f32| blocks * spec.block * spec.size[0] as f32;
        let wide = height.blurred(reach(WIDE_HOLLOW));
        let even = height.blurred(reach(0.5 * NEAR_HOLLOW));
        let gentle = Field::new(cells, |x, y| {
            let slope = even.slope(x, y);
            slope.y - 0.7 * slope.length()
        });
        let gentle = gentle.blurred(reach(NEAR_HOLLOW)).standard();
        let hollow = even.map(|i, even| wide.values[i] - even).standard();
        let patches = noise(1, 0.5, 0.6);
        let fertile = hollow.map(|i, hollow| 0.7 * hollow + gentle.values[i] + 0.8 * patches.values[i]);
        let limit = fertile.quantile(spec.soil);
        let has_soil = |i: usize| fertile.values[i] >= limit;
        let soil: Vec<u32> = (0..fertile.values.len()).filter(|&i| has_soil(i)).map(|i| i as u32).collect();

        let grain = noise(2, 0.1, 0.3);
        let stain = noise(3, 0.3, 0.7);
        let near = height.blurred(reach(NEAR_HOLLOW));
        let mut columns: Vec<Column> = (0..height.values.len())
            .into_par_iter()
            .map(|i| {
                let own = height.values[i];
                let dark = ((near.values[i] - own) / (0.5 * deviation).max(0.5)).clamp(-0.5, 1.0);
                let dark = dark.max(share * crack.values[i]);
                let place = ROCK + 0.22 * dark + 0.05 * stain.values[i] + 0.03 * grain.values[i];
                let shade = 1.0 - 0.35 * dark.max(0.0) + 0.08 * grain.values[i];
                let mut column =
                    Column { height: own, place: place.clamp(0.0, DARK), shade, ..Column::default() };
                if has_soil(i) {
                    let deep = (2.0 * (fertile.values[i] - limit)).clamp(0.0, 1.0);
                    let filled = near.values[i].max(own) + 0.5 * grain.values[i];
                    column.height = own + (filled - own).max(0.0) * deep;
                    column.place = (SOIL + 0.05 * grain.values[i] + 0.1 * deep).clamp(DARK + 0.04, MOSS);
                    column.shade = 0.85 + 0.1 * grain.values[i];
                }
                column
            })
            .collect();

        done(2)?;
        let low = hollow.map(|i, hollow| hollow + 0.5 * stain.values[i]);
        scree(spec, &low, &mut columns);

        done(3)?;
        let surface = Field::new(cells, |x, y| columns[y * cells[0] + x].height);
        let flat = Field::new(cells, |x, y| -surface.slope(x, y).length()).blurred(1.0).standard();
        let mossy = flat.map(|i, flat| match has_soil(i) {
            true => f32::NEG_INFINITY,
            false => flat + 1.2 * patches.values[i] + 0.7 * grain.values[i] + 0.4 * hollow.values[i],
        });
        let rock_share = 1.0 - soil.len() as f32 / columns.len() as f32;
        let limit = mossy.quantile(spec.moss * rock_share);
        columns.par_iter_mut().enumerate().for_each(|(i, column)| {
            let slope = surface.slope(i % cells[0], i / cells[0]);
            column.slope = slope.clamp_length_max(STEEPEST);
            column.moss_shade = 0.8 + 0.15 * grain.values[i];
            if mossy.values[i] >= limit {
                column.moss = MOSS_CELLS * (0.3 + 0.7 * (mossy.values[i] - limit).clamp(0.0, 1.0));
            }
        });
        done(4)?;
        Ok(Ground { columns, soil })
    }
}

/// Height of a hollow's floor, standard deviations: deep hollows are filled, so that none is cut off flat.
fn shallow(f: f32) -> f32 {
    let below = (-SHALLOW - f).max(0.0);
    f.max(-SHALLOW) - (MountainSpec::MEAN - SHALLOW) * (below / (MountainSpec::MEAN - SHALLOW)).tanh()
}

/// Strews stones on the columns where `low` is large, until they cover their share.
fn scree(spec: &MountainSpec, low: &Field, columns: &mut [Column]) {
    let [nx, ny] = low.size;
    let limit = low.quantile((spec.scree * RESTING_OF_SCREE).clamp(RESTING, 1.0));
    let places: Vec<u32> = (0..columns.len()).filter(|&i| low.values[i] >= limit).map(|i| i as u32).collect();
    let wanted = (spec.scree * columns.len() as f32) as usize;
    let mut covered = vec![false; columns.len()];
    let mut count = 0;
    let family = Family::new(spec.seed, Stream::RockForm);
    for number in 0..MOST_STONES {
        if count >= wanted || places.is_empty() {
            break;
        }
        let mut rng = family.member(number as u64);
        let place = places[rng.random_range(0..places.len())] as usize;
        let stone = Stone::draw(spec, &mut rng);
        let reach = stone.reach().min(0.5 * nx.min(ny) as f32);
        let middle = Vec2::new((place % nx) as f32 + 0.5, (place / nx) as f32 + 0.5);
        let foot = columns[place].height - stone.sunk;
        let r = reach.ceil() as i64;
        for (dx, dy) in (-r..=r).flat_map(|dy| (-r..=r).map(move |dx| (dx, dy))) {
            let Some(top) = stone.top(Vec2::new(dx as f32, dy as f32)) else { continue };
            let x = (middle.x as i64 + dx).rem_euclid(nx as i64) as usize;
            let y = (middle.y as i64 + dy).rem_euclid(ny as i64) as usize;
            let column = &mut columns[y * nx + x];
            if foot + top > column.height {
                column.height = (foot + top).min(spec.size[2] as f32);
                column.place = stone.place;
                column.shade = stone.shade * (0.75 + 0.25 * (top / stone.axes.z).clamp(0.0, 1.0));
                count += usize::from(!std::mem::replace(&mut covered[y * nx + x], true));
            }
        }
    }
}

/// A stone: an ellipsoid with flat faces.
struct Stone {
    /// Direction of its long axis.
    turn: Vec2,
    /// Half of its axes, cells.
    axes: Vec3,
    /// Depth of its middle below the ground, cells.
    sunk: f32,
    /// Faces that cut it: tilt, and height at the middle, in half axes.
    faces: [(Vec2, f32); 4],
    place: f32,
    shade: f32,
}

impl Stone {
    fn draw(spec: &MountainSpec, rng: &mut impl Rng) -> Stone {
        let least = SMALLEST_STONE.powf(-STONE_EXPONENT);
        let radius =
            (least + rng.random::<f32>() * (1.0 - least)).powf(-1.0 / STONE_EXPONENT) * spec.stone_cells;
        let axes = Vec3::new(1.0, 0.6 + 0.35 * rng.random::<f32>(), 0.5 + 0.3 * rng.random::<f32>()) * radius;
        let mut face = || (Vec2::new(normal(rng), normal(rng)) * FACE_TILT, 0.55 + 0.4 * rng.random::<f32>());
        let faces = [face(), face(), face(), face()];
        Stone {
            turn: Vec2::from_angle(rng.random::<f32>() * std::f32::consts::TAU),
            sunk: axes.z * (0.1 + 0.4 * rng.random::<f32>()),
            axes,
            faces,
            place: (ROCK + 0.06 * normal(rng)).clamp(0.0, 0.3),
            shade: (0.95 + 0.12 * normal(rng)).clamp(0.4, 1.2),
        }
    }

    fn reach(&self) -> f32 {
        self.axes.x
    }

    /// Height of its surface above its middle at a place beside it, cells.
    fn top(&self, way: Vec2) -> Option<f32> {
        let q = Vec2::new(self.turn.dot(way), self.turn.perp().dot(way))
            / self.axes.truncate().max(Vec2::splat(1e-6));
        let round = 1.0 - q.length_squared();
        (round > 0.0).then(|| {
            let faces = self.faces.iter().map(|(tilt, height)| height + tilt.dot(q));
            faces.fold(round.sqrt(), f32::min) * self.axes.z
        })
    }
}
