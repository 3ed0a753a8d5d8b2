//! Where the parts of a grid lie in its memory. All numbers are little-endian.

use glam::{DAffine3, DMat3, DVec3};

use super::super::Bounds;

/// Bytes of the head of a grid, and of its tree's.
pub(super) const GRID_BYTES: u64 = 672;
pub(super) const TREE_BYTES: u64 = 64;

/// Type of the values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Values {
    Float,
    Vec3f,
    /// Codes of 4, 8 or 16 bits.
    Fixed(u32),
    /// Codes whose bits each leaf chooses.
    Adaptive,
}

impl Values {
    /// Numbers of a sample.
    pub fn channels(self) -> usize {
        if self == Values::Vec3f { 3 } else { 1 }
    }

    /// Bytes of a value.
    fn bytes(self) -> usize {
        4 * self.channels()
    }

    /// Bytes from the start of a node or of a table to the next multiple of its alignment.
    fn aligned(bytes: usize) -> usize {
        bytes.next_multiple_of(32)
    }

    /// Layout of the root: bytes before its table, and of each entry.
    pub fn root(self) -> [usize; 2] {
        [Self::aligned(28 + 3 * self.bytes() + 8), Self::aligned(20 + self.bytes())]
    }

    /// Layout of a node with 2^`log` children along each axis: bytes before its table, and of each entry.
    pub fn node(self, log: u32) -> [usize; 2] {
        let mask = 1usize << (3 * log - 3);
        let before = Self::aligned(32 + 2 * mask + 2 * self.bytes() + 8);
        [before, self.bytes().next_multiple_of(8)]
    }

    /// Bytes before the values of a leaf, and of the smallest leaf.
    pub fn leaf(self) -> [usize; 2] {
        match self {
            Values::Float => [96, 96 + 2048],
            Values::Vec3f => [128, 128 + 6144],
            Values::Fixed(bits) => [96, 96 + 64 * bits as usize],
            Values::Adaptive => [96, 96],
        }
    }
}

/// Type of a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Known(Values),
    Unknown(u32),
}

impl Kind {
    pub fn of(number: u32) -> Kind {
        Kind::Known(match number {
            1 => Values::Float,
            6 => Values::Vec3f,
            13 => Values::Fixed(4),
            14 => Values::Fixed(8),
            15 => Values::Fixed(16),
            16 => Values::Adaptive,
            other => return Kind::Unknown(other),
        })
    }

    pub fn is_known(self) -> bool {
        matches!(self, Kind::Known(_))
    }

    pub fn words(self) -> String {
        const NAMES: [&str; 27] = [
            "unknown",
            "Float",
            "Double",
            "Int16",
            "Int32",
            "Int64",
            "Vec3f",
            "Vec3d",
            "Mask",
            "Half",
            "UInt32",
            "Boolean",
            "RGBA8",
            "Fp4",
            "Fp8",
            "Fp16",
            "FpN",
            "Vec4f",
            "Vec4d",
            "Index",
            "OnIndex",
            "IndexMask",
            "OnIndexMask",
            "PointIndex",
            "Vec3u8",
            "Vec3u16",
            "UInt8",
        ];
        match self {
            Kind::Known(Values::Float) => "Float".into(),
            Kind::Known(Values::Vec3f) => "Vec3f".into(),
            Kind::Known(Values::Fixed(bits)) => format!("Fp{bits}"),
            Kind::Known(Values::Adaptive) => "FpN".into(),
            Kind::Unknown(number) => match NAMES.get(number as usize) {
                Some(name) => (*name).into(),
                None => format!("number {number}"),
            },
        }
    }
}

/// Numbers of a grid, read at offsets that are checked.
#[derive(Clone, Copy)]
pub(super) struct Memory<'a>(pub &'a [u8]);

impl<'a> Memory<'a> {
    pub fn array<const N: usize>(self, at: usize) -> Option<[u8; N]> {
        self.0.get(at..)?.first_chunk().copied()
    }

    pub fn bytes(self, at: usize, count: usize) -> Option<&'a [u8]> {
        self.0.get(at..)?.get(..count)
    }

    pub fn u32(self, at: usize) -> Option<u32> {
        self.array(at).map(u32::from_le_bytes)
    }

    pub fn u64(self, at: usize) -> Option<u64> {
        self.array(at).map(u64::from_le_bytes)
    }

    pub fn f32(self, at: usize) -> Option<f32> {
        self.array(at).map(f32::from_le_bytes)
    }

    pub fn index(self, at: usize) -> Option<[i32; 3]> {
        Some([at, at + 4, at + 8].map(|at| self.u32(at).unwrap_or(0) as i32))
            .filter(|_| self.bytes(at, 12).is_some())
    }

    fn f64s<const N: usize>(self, at: usize) -> Option<[f64; N]> {
        let bytes = self.bytes(at, 8 * N)?;
        Some(std::array::from_fn(|i| f64::from_le_bytes(std::array::from_fn(|b| bytes[8 * i + b]))))
    }
}

/// What the head of a grid says.
#[derive(Clone, Debug)]
pub(super) struct GridData {
    pub name: String,
    pub kind: Kind,
    pub active: u64,
    pub bounds: Option<Bounds>,
    pub to_world: Result<DAffine3, (String, String)>,
}

impl GridData {
    /// Reads the head of a grid, with the box in its root.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn of(bytes: &[u8]) -> Result<GridData, String> {
        let memory = Memory(bytes);
        let broken = || "the head of the grid is broken".to_owned();
        if !super::is_magic(&memory.array::<8>(0).ok_or_else(broken)?) {
            return Err("the grid does not start as NanoVDB does".into());
        }
        let version = memory.u32(16).ok_or_else(broken)?;
        if version >> 21 != 32 {
            return Err(format!("the grid is of version {}, where 32 is read", version >> 21));
        }
        let name = memory.bytes(40, 256).ok_or_else(broken)?;
        let name = name.split(|&byte| byte == 0).next().unwrap_or_default();
        // The matrix by rows, its inverse, and the translation, after the same in float32.
        let matrix: [f64; 9] = memory.f64s(296 + 88).ok_or_else(broken)?;
        let translation: [f64; 3] = memory.f64s(296 + 88 + 144).ok_or_else(broken)?;
        let to_world = DAffine3::from_mat3_translation(
            DMat3::from_cols_array(&matrix).transpose(),
            DVec3::from_array(translation),
        );
        let tree = GRID_BYTES as usize;
        let active = memory.u64(tree + 56).ok_or_else(broken)?;
        let root = memory.u64(tree + 24).and_then(|root| usize::try_from(root).ok());
        let root = root.and_then(|root| root.checked_add(tree));
        let corners = root.and_then(|root| Some([memory.index(root)?, memory.index(root.checked_add(12)?)?]));
        let bounds = corners.map(|[min, max]| Bounds { min, max });
        Ok(GridData {
            name: String::from_utf8_lossy(name).into_owned(),
            kind: Kind::of(memory.u32(636).ok_or_else(broken)?),
            active,
            bounds: bounds.filter(|b| (0..3).all(|a| b.min[a] <= b.max[a])),
            to_world: super::super::checked(to_world),
        })
    }
}
