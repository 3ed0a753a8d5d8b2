//! Trees 5_4_3, in which OpenVDB and NanoVDB write a grid.

use std::collections::BTreeMap;
use std::io::Result;

use super::{BlockData, Grid};

/// log₂ of the children of upper and lower nodes and of the samples of leaves along an axis.
pub(super) const UPPER: u32 = 5;
pub(super) const LOWER: u32 = 4;
pub(super) const LEAF: u32 = 3;
/// Most tiles that one larger tile is divided into.
const MOST_PARTS: u64 = 1 << 20;

/// Content of a place of a node.
pub(super) enum Slot<N> {
    Tile([f32; 3], bool),
    Node(N),
}

pub(super) type Slots<N> = BTreeMap<usize, Slot<N>>;
/// A leaf: its values and its active samples.
pub(super) type Leaf<'a> = (&'a [f32], &'a [u64; 8]);

/// Tree of a grid, in the order of the file.
#[derive(Default)]
pub(super) struct Tree<'a> {
    /// Upper nodes by their origins.
    pub nodes: BTreeMap<[i32; 3], Slots<Slots<Leaf<'a>>>>,
    /// Tiles of 4096 samples along an axis by their origins.
    pub tiles: BTreeMap<[i32; 3], ([f32; 3], bool)>,
}

/// Number of a place in a node of 2^`log` places along each axis, each 2^`bits` samples long.
fn place(origin: [i32; 3], bits: u32, log: u32) -> usize {
    let [x, y, z] = origin.map(|x| (x >> bits) as usize & ((1 << log) - 1));
    z | y << log | x << (2 * log)
}

impl<'a> Tree<'a> {
    /// Tree of a grid. Tiles of other sizes become several.
    ///
    /// # Errors
    /// An error about a tile too large for the format.
    pub fn of(grid: &'a Grid) -> Result<Tree<'a>> {
        let mut tree = Tree::default();
        for block in grid.blocks() {
            match block.data {
                BlockData::Leaf { values, active } => {
                    let lower = tree.lower(block.origin);
                    lower.insert(place(block.origin, LEAF, LOWER), Slot::Node((values, active)));
                }
                BlockData::Tile { value, is_active } => {
                    let bits = block.side.trailing_zeros();
                    let own = [12, 7, 3].into_iter().find(|own| *own <= bits).unwrap_or(3);
                    let parts = 1u64 << (bits - own);
                    if parts.saturating_pow(3) > MOST_PARTS {
                        let why = format!("a tile of {} samples along an axis is too large", block.side);
                        return Err(std::io::Error::other(why));
                    }
                    for i in 0..parts.pow(3) {
                        let local = [i % parts, i / parts % parts, i / parts / parts];
                        let origin = std::array::from_fn(|a| block.origin[a] + ((local[a] as i32) << own));
                        tree.add_tile(origin, own, value, is_active);
                    }
                }
            }
        }
        Ok(tree)
    }

    fn upper(&mut self, origin: [i32; 3]) -> &mut Slots<Slots<Leaf<'a>>> {
        self.nodes.entry(origin.map(|x| x & !4095)).or_default()
    }

    fn lower(&mut self, origin: [i32; 3]) -> &mut Slots<Leaf<'a>> {
        let slot = self.upper(origin).entry(place(origin, LOWER + LEAF, UPPER));
        let slot = slot.or_insert_with(|| Slot::Node(BTreeMap::new()));
        if let Slot::Tile(..) = slot {
            *slot = Slot::Node(BTreeMap::new());
        }
        match slot {
            Slot::Node(lower) => lower,
            Slot::Tile(..) => unreachable!("a node stands there now"),
        }
    }

    fn add_tile(&mut self, origin: [i32; 3], bits: u32, value: [f32; 3], is_active: bool) {
        match bits {
            12 => drop(self.tiles.insert(origin, (value, is_active))),
            7 => {
                let slot = place(origin, LOWER + LEAF, UPPER);
                self.upper(origin).entry(slot).or_insert(Slot::Tile(value, is_active));
            }
            _ => drop(self.lower(origin).insert(place(origin, LEAF, LOWER), Slot::Tile(value, is_active))),
        }
    }
}

/// Nodes of a node.
pub(super) fn children<N>(node: &Slots<N>) -> impl Iterator<Item = &N> {
    node.values().filter_map(|slot| match slot {
        Slot::Node(node) => Some(node),
        Slot::Tile(..) => None,
    })
}

/// Gives the samples of a leaf in the order of the files, z fastest: the number there, the number in the
/// grid's own leaf, and whether the sample is active.
pub(super) fn for_each_in_order(active: &[u64; 8], mut sample: impl FnMut(usize, usize, bool)) {
    for n in 0..512 {
        let i = n >> 6 | n & 0o70 | (n & 7) << 6;
        sample(n, i, active[i >> 6] >> (i & 63) & 1 != 0);
    }
}
