//! Header of a file, descriptors and metadata of its grids.

use glam::DAffine3;

use super::super::Class;
use super::super::source::Source;
use super::transform::read_transform;
use super::values::Kind;
use super::{MAGIC, TreeKind};
use crate::util::error::Result;

/// Versions of files that are read.
const OLDEST: u32 = 222;
const NEWEST: u32 = 225;
/// Character between the name of a grid and its number, where several have the name.
const SEPARATOR: char = '\u{1e}';
/// Ending of the type of a grid whose numbers are stored as float16.
const HALF: &str = "_HalfFloat";
/// Most grids of a file.
const MOST_GRIDS: i32 = 1 << 16;

const CONVERT: &str = "convert it to a float or a vec3s grid in the program that made it";

/// Reason and advice.
pub(super) type Refusal = (String, String);

/// What the file says of a grid before the grid.
pub(super) struct Descriptor {
    /// Name for people: `density`, or `density[1]` where several have it.
    pub name: String,
    /// Name in the file.
    pub unique: String,
    /// Type of the tree, such as `Tree_float_5_4_3`.
    pub tree: String,
    pub is_half: bool,
    /// Unique name of the grid whose tree this one shares, or nothing.
    pub parent: String,
    /// Position of the grid.
    pub start: u64,
}

impl Descriptor {
    /// Type of the values for people.
    pub fn kind_words(&self) -> String {
        let parts: Vec<&str> = self.tree.split('_').collect();
        let kind = match parts[..] {
            ["Tree", kind, "5", "4", "3"] => kind,
            _ => &self.tree,
        };
        // Blender marks its integers and points, too.
        let is_half = self.is_half && !["int32", "int64", "bool", "ptdataidx32"].contains(&kind);
        let kind: String = kind.chars().take(48).collect();
        if is_half { format!("{kind} as half") } else { kind }
    }

    /// Type of the values and shape of the tree.
    pub fn kind(&self) -> std::result::Result<TreeKind, Refusal> {
        let refuse = |why: String| Err((why, CONVERT.into()));
        let mut parts = self.tree.split('_');
        let (Some("Tree"), Some(name)) = (parts.next(), parts.next()) else {
            return refuse(format!("its type is {:?}, which is not read", self.kind_words()));
        };
        if name.starts_with("ptdata") || name.starts_with("ptidx") {
            let fix = "rasterise the points to a float grid (in Blender: Points to Volume)";
            return Err(("it holds points, which are not read".into(), fix.into()));
        }
        let Some(kind) = Kind::of(name, self.is_half) else {
            return refuse(format!("its type is {}, which is not read", self.kind_words()));
        };
        let dims: Option<Vec<u32>> = parts.map(|part| part.parse().ok()).collect();
        match dims.as_deref() {
            Some(&[upper @ 1..=6, lower @ 1..=5, leaf @ 3..=5]) => Ok((kind, [upper, lower, leaf])),
            _ => refuse(format!("its tree is {}, where three levels as 5_4_3 are read", self.kind_words())),
        }
    }
}

/// Reads the header and the descriptors of all grids.
pub(super) fn read_descriptors(source: &mut Source) -> Result<Vec<Descriptor>> {
    if source.array::<8>()? != MAGIC {
        return Err(source.fault(0, "it does not start as OpenVDB does"));
    }
    let (at, version) = (source.at(), source.u32()?);
    if !(OLDEST..=NEWEST).contains(&version) {
        let what = format!("the file is of version {version}, where {OLDEST} to {NEWEST} are read");
        let fix = "open it in Blender or Houdini of today and write it again";
        return Err(source.fault_with(at, what, fix));
    }
    source.skip(8)?;
    let at = source.at();
    if source.u8()? == 0 {
        let what = "the file was written as a stream, without the positions of its grids";
        return Err(source.fault_with(at, what, "write it to a file, not to a pipe"));
    }
    source.skip(36)?;
    Meta::read(source)?;
    let (at, count) = (source.at(), source.i32()?);
    if !(0..=MOST_GRIDS).contains(&count) {
        return Err(source.fault(at, format!("it counts {count} grids")));
    }
    let mut found = Vec::new();
    for _ in 0..count {
        let unique = source.text()?;
        source.enter(&unique);
        let kind = source.text()?;
        let parent = source.text()?;
        let at = source.at();
        // One that shares a tree has no leaves, and no position of them.
        let [start, _, end] = [source.i64()?, source.i64()?, source.i64()?];
        if !(source.at() as i64 <= start && start <= end) || end as u64 > source.end() {
            let why =
                format!("the grid lies at bytes {start} to {end}, but the file has {} bytes", source.end());
            return Err(source.fault(at, why));
        }
        let (tree, is_half) = match kind.strip_suffix(HALF) {
            Some(tree) => (tree.to_owned(), true),
            None => (kind, false),
        };
        let name = match unique.split_once(SEPARATOR) {
            Some((name, number)) => format!("{}[{number}]", super::super::named(name.into())),
            None => super::super::named(unique.clone()),
        };
        found.push(Descriptor { name, unique, tree, is_half, parent, start: start as u64 });
        source.seek(end as u64)?;
        source.enter("");
    }
    Ok(found)
}

/// What stands between the descriptor of a grid and its tree.
pub(super) struct GridHead {
    pub flags: u32,
    pub meta: Meta,
    pub transform: std::result::Result<DAffine3, Refusal>,
}

/// Reads the head of a grid, and leaves the source at the tree.
pub(super) fn read_grid_head(source: &mut Source, descriptor: &Descriptor) -> Result<GridHead> {
    source.seek(descriptor.start)?;
    let flags = source.u32()?;
    let meta = Meta::read(source)?;
    let transform = read_transform(source)?;
    Ok(GridHead { flags, meta, transform })
}

/// Metadata that is of use here.
#[derive(Default)]
pub(super) struct Meta {
    pub class: Class,
    pub active: Option<u64>,
    pub least: Option<[i32; 3]>,
    pub greatest: Option<[i32; 3]>,
}

impl Meta {
    /// Reads metadata. Every value stands after its length, so those of unknown types are skipped.
    fn read(source: &mut Source) -> Result<Meta> {
        let mut meta = Meta::default();
        let (at, count) = (source.at(), source.i32()?);
        if count < 0 {
            return Err(source.fault(at, format!("it counts {count} values of metadata")));
        }
        let mut value = Vec::new();
        for _ in 0..count {
            let (name, kind) = (source.text()?, source.text()?);
            let length = source.u32()?;
            match (name.as_str(), kind.as_str(), length) {
                ("class", "string", 0..=64) => {
                    source.bytes(length.into(), &mut value)?;
                    meta.class = match &value[..] {
                        b"fog volume" => Class::FogVolume,
                        b"level set" => Class::LevelSet,
                        b"staggered" => Class::Staggered,
                        _ => Class::Unknown,
                    };
                }
                ("file_voxel_count", "int64", 8) => meta.active = u64::try_from(source.i64()?).ok(),
                ("file_bbox_min", "vec3i", 12) => meta.least = Some(source.index()?),
                ("file_bbox_max", "vec3i", 12) => meta.greatest = Some(source.index()?),
                _ => source.skip(length.into())?,
            }
        }
        Ok(meta)
    }
}
