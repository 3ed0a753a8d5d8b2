//! Writing of NanoVDB's files: version 32.4.2, one segment, `Float` and `Vec3f`.

use std::io::{Result, Seek, SeekFrom, Write};

use flate2::Compression;
use flate2::write::ZlibEncoder;

use super::super::branches::{LOWER, Slot, Slots, Tree, UPPER, for_each_in_order};
use super::super::{Class, Grid};
use super::MAGICS;
use super::layout::{GRID_BYTES, TREE_BYTES};
use super::plan::{Entry, Plan};
use super::stats::Stats;

/// Version 32.4.2, as its parts are packed. Newer versions have another checksum.
const VERSION: u32 = 32 << 21 | 4 << 10 | 2;
/// zlib.
const CODEC: u16 = 1;
/// Bytes of the record of a grid before its name.
const RECORD_BYTES: usize = 176;
/// Bytes of a name in the head of a grid, with the 0 at its end.
const NAME_BYTES: usize = 256;
/// Least and greatest value, mean and deviation stand in the nodes, which are in breadth-first order.
const FLAGS: u32 = 0b11_1100;
/// The nodes have the boxes of their active samples.
const HAS_BOX: u32 = 0b10;
/// Checksum that stands for none.
const NO_CHECKSUM: u32 = u32::MAX;

/// Writes grids as a file of NanoVDB to `out`, with their float32 as they are. The bytes depend on the grids
/// alone.
///
/// # Errors
/// Returns the first error of `out`, or one about a tile too large or grids too many for the format.
pub fn encode_nvdb(grids: &[Grid], mut out: impl Write + Seek) -> Result<()> {
    let out = &mut out;
    let count = u16::try_from(grids.len());
    let count = count.map_err(|_| std::io::Error::other("more grids than a file of NanoVDB takes"))?;
    let trees: Vec<Tree> = grids.iter().map(Tree::of).collect::<Result<_>>()?;
    let plans = grids.iter().zip(&trees).map(|(grid, tree)| Plan::of(grid, tree));
    let plans: Vec<Plan> = plans.collect::<Result<_>>()?;
    out.write_all(MAGICS[0])?;
    out.write_all(&VERSION.to_le_bytes())?;
    out.write_all(&count.to_le_bytes())?;
    out.write_all(&CODEC.to_le_bytes())?;
    let mut records = Vec::new();
    for (grid, plan) in grids.iter().zip(&plans) {
        records.push(out.stream_position()?);
        out.write_all(&record(grid, plan))?;
    }
    for ((grid, plan), record) in grids.iter().zip(&plans).zip(records) {
        let start = out.stream_position()?;
        out.write_all(&[0; 8])?;
        let mut packed = ZlibEncoder::new(&mut *out, Compression::new(6));
        write_grid(&mut packed, grid, plan)?;
        packed.finish()?;
        let end = out.stream_position()?;
        for (at, length) in [(start, end - start - 8), (record + 8, end - start)] {
            out.seek(SeekFrom::Start(at))?;
            out.write_all(&length.to_le_bytes())?;
        }
        out.seek(SeekFrom::Start(end))?;
    }
    out.flush()
}

/// Bytes that are set at their places.
struct Bytes(Vec<u8>);

impl Bytes {
    fn zeros(count: usize) -> Bytes {
        Bytes(vec![0; count])
    }

    fn set(&mut self, at: usize, bytes: &[u8]) {
        self.0[at..at + bytes.len()].copy_from_slice(bytes);
    }

    fn u32s(&mut self, at: usize, numbers: &[u32]) {
        numbers.iter().enumerate().for_each(|(i, x)| self.set(at + 4 * i, &x.to_le_bytes()));
    }

    fn u64s(&mut self, at: usize, numbers: &[u64]) {
        numbers.iter().enumerate().for_each(|(i, x)| self.set(at + 8 * i, &x.to_le_bytes()));
    }

    fn f32s(&mut self, at: usize, numbers: &[f32]) {
        numbers.iter().enumerate().for_each(|(i, x)| self.set(at + 4 * i, &x.to_le_bytes()));
    }

    fn f64s(&mut self, at: usize, numbers: &[f64]) {
        numbers.iter().enumerate().for_each(|(i, x)| self.set(at + 8 * i, &x.to_le_bytes()));
    }

    fn index(&mut self, at: usize, index: [i32; 3]) {
        self.u32s(at, &index.map(|x| x as u32));
    }

    /// Sets least and greatest value, mean and deviation. Where nothing is active, the background stands for
    /// the values.
    fn stats(&mut self, at: usize, stats: &Stats, grid: &Grid) {
        let channels = grid.channels();
        let [min, max] = match stats.count {
            0 => [grid.background; 2],
            _ => [stats.min, stats.max],
        };
        self.f32s(at, &min[..channels]);
        self.f32s(at + 4 * channels, &max[..channels]);
        self.f32s(at + 8 * channels, &stats.mean_and_deviation());
    }
}

/// Name up to a 0, which would end it for other programs.
fn name(grid: &Grid) -> &str {
    grid.name.split('\0').next().unwrap_or_default()
}

/// Number of the class. Fog volumes and level sets have numbers, and staggered grids vectors.
fn class(grid: &Grid) -> u32 {
    match (grid.class, grid.channels()) {
        (Class::LevelSet, 1) => 1,
        (Class::FogVolume, 1) => 2,
        (Class::Staggered, 3) => 3,
        _ => 0,
    }
}

fn kind(grid: &Grid) -> u32 {
    if grid.channels() == 3 { 6 } else { 1 }
}

/// Box of the active samples in the world, from the index of the first to that behind the last.
fn world_box(grid: &Grid, stats: &Stats) -> [f64; 6] {
    if stats.count == 0 {
        return [f64::MAX, f64::MAX, f64::MAX, f64::MIN, f64::MIN, f64::MIN];
    }
    let mut all = [f64::INFINITY; 6];
    all[3..].fill(f64::NEG_INFINITY);
    for corner in 0..8 {
        let at = [0, 1, 2].map(|a| match corner >> a & 1 {
            0 => f64::from(stats.low[a]),
            _ => f64::from(stats.high[a]) + 1.0,
        });
        let place = grid.to_world.transform_point3(at.into()).to_array();
        for a in 0..3 {
            all[a] = all[a].min(place[a]);
            all[3 + a] = all[3 + a].max(place[a]);
        }
    }
    all
}

fn voxel_size(grid: &Grid) -> [f64; 3] {
    let matrix = grid.to_world.matrix3;
    [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(|axis| axis.length())
}

/// Entry of a grid in the segment's head, with its name. The bytes in the file are set later.
fn record(grid: &Grid, plan: &Plan) -> Vec<u8> {
    let name = name(grid);
    let mut out = Bytes::zeros(RECORD_BYTES);
    // Hash by which NanoVDB finds names.
    let hash = name.bytes().fold(0u64, |hash, byte| {
        hash.wrapping_mul(67).wrapping_add(u64::from(byte)).wrapping_add(hash >> 56)
    });
    out.u64s(0, &[plan.bytes(), 0, hash, plan.stats.count]);
    out.u32s(32, &[kind(grid), class(grid)]);
    out.f64s(40, &world_box(grid, &plan.stats));
    out.index(88, plan.stats.low);
    out.index(100, plan.stats.high);
    out.f64s(112, &voxel_size(grid));
    out.u32s(136, &[name.len() as u32 + 1]);
    out.u32s(140, &plan.counts());
    out.u32s(152, &[1]);
    out.u32s(156, &plan.tiles);
    out.set(168, &CODEC.to_le_bytes());
    out.u32s(172, &[VERSION]);
    out.0.extend_from_slice(name.as_bytes());
    out.0.push(0);
    out.0
}

fn write_grid(out: &mut impl Write, grid: &Grid, plan: &Plan) -> Result<()> {
    out.write_all(&head(grid, plan))?;
    let [leaf, lower, upper, _] = plan.places();
    let mut place = upper;
    let mut next = lower;
    for node in &plan.upper {
        let stats = (node.origin, &node.stats);
        out.write_all(&inner(grid, plan, UPPER, node.content, stats, next - place))?;
        place += plan.node_bytes(UPPER) as u64;
        next += nodes(node.content) * plan.node_bytes(LOWER) as u64;
    }
    next = leaf;
    for node in &plan.lower {
        let stats = (node.origin, &node.stats);
        out.write_all(&inner(grid, plan, LOWER, node.content, stats, next - place))?;
        place += plan.node_bytes(LOWER) as u64;
        next += nodes(node.content) * plan.values.leaf()[1] as u64;
    }
    let channels = grid.channels();
    let [before, bytes] = plan.values.leaf();
    for node in &plan.leaves {
        let mut own = Bytes::zeros(bytes);
        let (stats, (values, active)) = (&node.stats, node.content);
        if stats.count > 0 {
            own.index(0, stats.low);
            own.set(12, &[0, 1, 2].map(|a| (stats.high[a] - stats.low[a]) as u8));
            own.set(15, &[2]);
        } else {
            own.index(0, node.origin);
        }
        own.stats(80, stats, grid);
        for_each_in_order(active, |n, i, is_active| {
            own.0[16 + n / 8] |= u8::from(is_active) << (n % 8);
            own.f32s(before + 4 * channels * n, &values[channels * i..][..channels]);
        });
        out.write_all(&own.0)?;
    }
    Ok(())
}

/// Number of the nodes of a node.
fn nodes<N>(node: &Slots<N>) -> u64 {
    node.values().filter(|slot| matches!(slot, Slot::Node(_))).count() as u64
}

/// Head of a grid, of its tree and its root, with the checksum of all three.
fn head(grid: &Grid, plan: &Plan) -> Vec<u8> {
    let [grid_bytes, tree_bytes] = [GRID_BYTES, TREE_BYTES].map(|n| n as usize);
    let mut out = Bytes::zeros(grid_bytes + tree_bytes + plan.root_bytes());
    let stats = &plan.stats;
    out.set(0, MAGICS[0]);
    out.u32s(16, &[VERSION, FLAGS | if stats.count > 0 { HAS_BOX } else { 0 }, 0, 1]);
    out.u64s(32, &[plan.bytes()]);
    let name = name(grid);
    let cut = (0..NAME_BYTES.min(name.len() + 1)).rev().find(|&at| name.is_char_boundary(at));
    out.set(40, &name.as_bytes()[..cut.unwrap_or(0)]);
    // Matrix, inverse and translation, the rows of the matrices one after the other, in float32 and float64.
    let inverse = grid.to_world.matrix3.inverse();
    let [rows, back] = [grid.to_world.matrix3, inverse].map(|matrix| matrix.transpose().to_cols_array());
    let moved = grid.to_world.translation.to_array();
    let map = [&rows[..], &back, &moved, &[1.0]].concat();
    let rounded: Vec<f32> = map.iter().map(|x| *x as f32).collect();
    out.f32s(296, &rounded);
    out.f64s(296 + 4 * map.len(), &map);
    out.f64s(560, &world_box(grid, stats));
    out.f64s(608, &voxel_size(grid));
    out.u32s(632, &[class(grid), kind(grid)]);

    let tree = grid_bytes;
    out.u64s(tree, &plan.places());
    out.u32s(tree + 32, &plan.counts());
    out.u32s(tree + 44, &plan.tiles);
    out.u64s(tree + 56, &[stats.count]);

    let root = tree + tree_bytes;
    out.index(root, stats.low);
    out.index(root + 12, stats.high);
    out.u32s(root + 24, &[plan.table.len() as u32]);
    let channels = grid.channels();
    out.f32s(root + 28, &grid.background[..channels]);
    out.stats(root + 28 + 4 * channels, stats, grid);
    let [before, entry_bytes] = plan.values.root();
    let mut child = plan.root_bytes() as u64;
    for (i, (key, entry)) in plan.table.iter().enumerate() {
        let at = root + before + entry_bytes * i;
        out.u64s(at, &[*key]);
        match entry {
            Entry::Node => {
                out.u64s(at + 8, &[child]);
                child += plan.node_bytes(UPPER) as u64;
            }
            Entry::Tile(value, is_active) => {
                out.u32s(at + 16, &[u32::from(*is_active)]);
                out.f32s(at + 20, &value[..channels]);
            }
        }
    }
    let checksum = crc32fast::hash(&out.0[16..]);
    out.u32s(8, &[checksum, NO_CHECKSUM]);
    out.0
}

/// An upper or lower node with 2^`log` children along each axis, whose first child lies `child` bytes behind
/// it.
fn inner<N>(
    grid: &Grid,
    plan: &Plan,
    log: u32,
    content: &Slots<N>,
    (origin, stats): ([i32; 3], &Stats),
    mut child: u64,
) -> Vec<u8> {
    let mut out = Bytes::zeros(plan.node_bytes(log));
    let mask = 1 << (3 * log - 3);
    let channels = grid.channels();
    // The origin is found from the box, also where that is empty.
    let [low, high] = match stats.count {
        0 => [origin, origin.map(|x| x - 1)],
        _ => [stats.low, stats.high],
    };
    out.index(0, low);
    out.index(12, high);
    out.u64s(24, &[if stats.count > 0 { 2 } else { 1 }]);
    out.stats(32 + 2 * mask, stats, grid);
    let [before, entry] = plan.values.node(log);
    let child_bytes = if log == UPPER { plan.node_bytes(LOWER) } else { plan.values.leaf()[1] } as u64;
    for i in 0..8 * mask {
        let at = before + entry * i;
        match content.get(&i) {
            None => out.f32s(at, &grid.background[..channels]),
            Some(Slot::Tile(value, is_active)) => {
                out.f32s(at, &value[..channels]);
                out.0[32 + i / 8] |= u8::from(*is_active) << (i % 8);
            }
            Some(Slot::Node(_)) => {
                out.0[32 + mask + i / 8] |= 1 << (i % 8);
                out.u64s(at, &[child]);
                child += child_bytes;
            }
        }
    }
    out.0
}
