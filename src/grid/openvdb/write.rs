//! Writing of OpenVDB's files: version 224, trees 5_4_3, zlib with the mask of active samples.

use std::io::{Result, Seek, SeekFrom, Write};

use flate2::{Compress, Compression, FlushCompress, Status};

use super::super::branches::{LOWER, Slot, Slots, Tree, UPPER, children, for_each_in_order};
use super::super::{Class, Grid};
use super::MAGIC;

const VERSION: u32 = 224;
/// Version of the library whose files have this version.
const LIBRARY: [u32; 2] = [10, 0];
/// zlib and the mask of active samples.
const FLAGS: u32 = 3;
/// Writes grids as a file of OpenVDB to `out`, with their float32 as they are. The bytes depend on the grids
/// alone.
///
/// # Errors
/// Returns the first error of `out`, or one about a tile too large for the format.
pub fn encode_vdb(grids: &[Grid], mut out: impl Write + Seek) -> Result<()> {
    let out = &mut out;
    out.write_all(&MAGIC)?;
    u32s(out, &[VERSION, LIBRARY[0], LIBRARY[1]])?;
    // The descriptors have positions.
    out.write_all(&[1])?;
    out.write_all(b"00000000-0000-4000-8000-000000000000")?;
    u32s(out, &[0, grids.len() as u32])?;
    for (i, grid) in grids.iter().enumerate() {
        let twins = grids.iter().filter(|other| other.name == grid.name).count();
        let number = grids[..i].iter().filter(|other| other.name == grid.name).count();
        let unique = if twins > 1 { format!("{}\u{1e}{number}", grid.name) } else { grid.name.clone() };
        write_grid(out, grid, &unique)?;
    }
    out.flush()
}

fn write_grid(out: &mut (impl Write + Seek), grid: &Grid, unique: &str) -> Result<()> {
    let kind = if grid.channels() == 3 { "vec3s" } else { "float" };
    text(out, unique)?;
    text(out, &format!("Tree_{kind}_5_4_3"))?;
    text(out, "")?;
    let positions = out.stream_position()?;
    out.write_all(&[0; 24])?;
    let start = out.stream_position()?;
    u32s(out, &[FLAGS])?;
    write_metadata(out, grid)?;
    write_transform(out, grid)?;
    let tree = Tree::of(grid)?;
    let leaves = Writer::new(grid).write_tree(out, &tree)?;
    let end = out.stream_position()?;
    out.seek(SeekFrom::Start(positions))?;
    for position in [start, leaves, end] {
        out.write_all(&(position as i64).to_le_bytes())?;
    }
    out.seek(SeekFrom::Start(end)).map(drop)
}

fn u32s(out: &mut impl Write, numbers: &[u32]) -> Result<()> {
    numbers.iter().try_for_each(|number| out.write_all(&number.to_le_bytes()))
}

fn index(out: &mut impl Write, index: [i32; 3]) -> Result<()> {
    index.iter().try_for_each(|number| out.write_all(&number.to_le_bytes()))
}

fn text(out: &mut impl Write, text: &str) -> Result<()> {
    u32s(out, &[text.len() as u32])?;
    out.write_all(text.as_bytes())
}

fn write_metadata(out: &mut impl Write, grid: &Grid) -> Result<()> {
    let bytes = |numbers: [i32; 3]| numbers.map(i32::to_le_bytes).concat();
    // The box of an empty grid is turned inside out.
    let [min, max] = grid.bounds().map_or([[i32::MAX; 3], [i32::MIN; 3]], |b| [b.min, b.max]);
    let active = i64::try_from(grid.active_count()).unwrap_or(i64::MAX);
    let entries: [(&str, &str, Vec<u8>); 6] = [
        ("class", "string", grid.class.words().into()),
        ("file_bbox_max", "vec3i", bytes(max)),
        ("file_bbox_min", "vec3i", bytes(min)),
        ("file_compression", "string", "zip + active values".into()),
        ("file_voxel_count", "int64", active.to_le_bytes().into()),
        ("name", "string", grid.name.clone().into()),
    ];
    let known = entries.iter().filter(|(name, ..)| *name != "class" || grid.class != Class::Unknown);
    u32s(out, &[known.clone().count() as u32])?;
    for (name, kind, value) in known {
        text(out, name)?;
        text(out, kind)?;
        u32s(out, &[value.len() as u32])?;
        out.write_all(value)?;
    }
    Ok(())
}

/// Writes the simplest transform that is the grid's.
fn write_transform(out: &mut impl Write, grid: &Grid) -> Result<()> {
    let matrix = grid.to_world.matrix3.to_cols_array_2d();
    let translation = grid.to_world.translation.to_array();
    let scale = [matrix[0][0], matrix[1][1], matrix[2][2]];
    let is_scale = (0..3).all(|a| (0..3).all(|b| a == b || matrix[a][b] == 0.0) && scale[a] > 0.0);
    let is_uniform = scale[1] == scale[0] && scale[2] == scale[0];
    let is_moved = translation != [0.0; 3];
    let mut numbers: Vec<f64> = Vec::new();
    let name = if is_scale {
        if is_moved {
            numbers.extend(translation);
        }
        numbers.extend(scale);
        numbers.extend(scale);
        numbers.extend(scale.map(|x| 1.0 / x));
        numbers.extend(scale.map(|x| 1.0 / (x * x)));
        numbers.extend(scale.map(|x| 0.5 / x));
        match (is_uniform, is_moved) {
            (true, false) => "UniformScaleMap",
            (true, true) => "UniformScaleTranslateMap",
            (false, false) => "ScaleMap",
            (false, true) => "ScaleTranslateMap",
        }
    } else {
        for row in matrix {
            numbers.extend(row);
            numbers.push(0.0);
        }
        numbers.extend(translation);
        numbers.push(1.0);
        "AffineMap"
    };
    text(out, name)?;
    numbers.iter().try_for_each(|number| out.write_all(&number.to_le_bytes()))
}

/// Writes nodes of one grid, and keeps what it needs for that.
struct Writer {
    channels: usize,
    background: [f32; 3],
    zlib: Compress,
    values: Vec<f32>,
    mask: Vec<u8>,
}

impl Writer {
    fn new(grid: &Grid) -> Writer {
        Writer {
            channels: grid.channels(),
            background: grid.background,
            zlib: Compress::new(Compression::new(6), true),
            values: Vec::new(),
            mask: Vec::new(),
        }
    }

    fn value(&self, out: &mut impl Write, value: [f32; 3]) -> Result<()> {
        value[..self.channels].iter().try_for_each(|x| out.write_all(&x.to_le_bytes()))
    }

    /// Writes the topology and the leaves. Returns where the leaves start.
    fn write_tree(&mut self, out: &mut (impl Write + Seek), tree: &Tree) -> Result<u64> {
        u32s(out, &[1])?;
        self.value(out, self.background)?;
        // A tile cannot stand where a node is.
        let tiles = tree.tiles.iter().filter(|(origin, _)| !tree.nodes.contains_key(*origin));
        u32s(out, &[tiles.clone().count() as u32, tree.nodes.len() as u32])?;
        for (origin, (value, is_active)) in tiles {
            index(out, *origin)?;
            self.value(out, *value)?;
            out.write_all(&[u8::from(*is_active)])?;
        }
        for (origin, upper) in &tree.nodes {
            index(out, *origin)?;
            self.write_node(out, UPPER, upper)?;
            for lower in children(upper) {
                self.write_node(out, LOWER, lower)?;
                for (_, active) in children(lower) {
                    self.set_leaf(None, active);
                    out.write_all(&self.mask)?;
                }
            }
        }
        let leaves = out.stream_position()?;
        for (values, active) in tree.nodes.values().flat_map(children).flat_map(children) {
            self.set_leaf(Some(values), active);
            out.write_all(&self.mask)?;
            self.write_values(out)?;
        }
        Ok(leaves)
    }

    /// Writes the masks and the tiles of a node.
    fn write_node<N>(&mut self, out: &mut impl Write, log: u32, node: &Slots<N>) -> Result<()> {
        let count = 1usize << (3 * log);
        let background = &self.background[..self.channels];
        self.values.clear();
        self.values.extend(background.iter().copied().cycle().take(count * self.channels));
        let mut nodes = vec![0u8; count / 8];
        self.mask.clear();
        self.mask.resize(count / 8, 0);
        for (&i, slot) in node {
            match slot {
                Slot::Node(_) => nodes[i / 8] |= 1 << (i % 8),
                Slot::Tile(value, is_active) => {
                    self.values[self.channels * i..][..self.channels]
                        .copy_from_slice(&value[..self.channels]);
                    self.mask[i / 8] |= u8::from(*is_active) << (i % 8);
                }
            }
        }
        out.write_all(&nodes)?;
        out.write_all(&self.mask)?;
        self.write_values(out)
    }

    /// Takes a leaf to the order of the file.
    fn set_leaf(&mut self, values: Option<&[f32]>, active: &[u64; 8]) {
        self.mask.clear();
        self.mask.resize(64, 0);
        self.values.clear();
        for_each_in_order(active, |n, i, is_active| {
            self.mask[n / 8] |= u8::from(is_active) << (n % 8);
            if let Some(values) = values {
                self.values.extend_from_slice(&values[self.channels * i..][..self.channels]);
            }
        });
    }

    /// Writes the values, without those that are not active where these have the background or its negative.
    fn write_values(&mut self, out: &mut impl Write) -> Result<()> {
        let bit = |i: usize| self.mask[i / 8] >> (i % 8) & 1 != 0;
        let all = self.values.chunks_exact(self.channels).enumerate();
        let off_is = |value: [f32; 3]| {
            let same = |own: &[f32]| own.iter().zip(&value).all(|(a, b)| a.to_bits() == b.to_bits());
            all.clone().all(|(i, own)| bit(i) || same(own))
        };
        let code = if off_is(self.background) {
            0
        } else if !self.background[..self.channels].contains(&0.0) && off_is(self.background.map(|x| -x)) {
            1
        } else {
            6
        };
        let kept = all.clone().filter(|(i, _)| code == 6 || bit(*i));
        let raw: Vec<u8> = kept.flat_map(|(_, own)| own).flat_map(|x| x.to_le_bytes()).collect();
        out.write_all(&[code])?;
        let mut packed = vec![0u8; raw.len()];
        self.zlib.reset();
        let status = self.zlib.compress(&raw, &mut packed, FlushCompress::Finish);
        let length = self.zlib.total_out() as usize;
        match matches!(status, Ok(Status::StreamEnd)) && length < raw.len() {
            true => {
                out.write_all(&(length as i64).to_le_bytes())?;
                out.write_all(&packed[..length])
            }
            false => {
                out.write_all(&(-(raw.len() as i64)).to_le_bytes())?;
                out.write_all(&raw)
            }
        }
    }
}
