//! Nodes of a grid in the order of a file, with their places and statistics.

use std::io::Result;

use super::super::Grid;
use super::super::branches::{LEAF, LOWER, Leaf, Slot, Slots, Tree, UPPER, for_each_in_order};
use super::layout::{GRID_BYTES, TREE_BYTES, Values};
use super::stats::Stats;

/// A node: its origin, what it holds, and the statistics of its active samples.
pub(super) struct Node<N> {
    pub origin: [i32; 3],
    pub content: N,
    pub stats: Stats,
}

/// Entry of the root's table.
pub(super) enum Entry {
    /// The next upper node.
    Node,
    /// A tile with its value, and whether it is active.
    Tile([f32; 3], bool),
}

/// Nodes of a grid, level by level. The children of a node stand side by side, in the order of its table.
pub(super) struct Plan<'t> {
    pub values: Values,
    /// Table of the root by its keys, which rise.
    pub table: Vec<(u64, Entry)>,
    pub upper: Vec<Node<&'t Slots<Slots<Leaf<'t>>>>>,
    pub lower: Vec<Node<&'t Slots<Leaf<'t>>>>,
    pub leaves: Vec<Node<Leaf<'t>>>,
    /// Active tiles of lower nodes, of upper nodes and of the root.
    pub tiles: [u32; 3],
    pub stats: Stats,
}

/// Key of a place in the root's table: 21 bits for each axis.
fn key(origin: [i32; 3]) -> u64 {
    let [x, y, z] = origin.map(|x| u64::from(x as u32 >> (UPPER + LOWER + LEAF)));
    x << 42 | y << 21 | z
}

/// Place of child `i` of a node with 2^`log` children along each axis, each 2^`bits` samples long.
fn child(origin: [i32; 3], log: u32, bits: u32, i: usize) -> [i32; 3] {
    let local = [i >> (2 * log), i >> log, i].map(|x| (x & ((1 << log) - 1)) as i32);
    std::array::from_fn(|a| origin[a] + (local[a] << bits))
}

/// Statistics of a leaf.
fn leaf_stats(origin: [i32; 3], (values, active): Leaf, channels: usize) -> Stats {
    let mut stats = Stats::none();
    for_each_in_order(active, |n, i, is_active| {
        if is_active {
            let value = super::super::tree::padded(&values[channels * i..][..channels]);
            stats.add(&Stats::cube(child(origin, LEAF, 0, n), 1, value, channels));
        }
    });
    stats
}

impl<'t> Plan<'t> {
    /// Nodes of the tree of a grid.
    ///
    /// # Errors
    /// An error about more nodes than the format counts.
    pub fn of(grid: &Grid, tree: &'t Tree<'t>) -> Result<Plan<'t>> {
        let channels = grid.channels();
        let mut plan = Plan {
            values: if channels == 3 { Values::Vec3f } else { Values::Float },
            table: Vec::new(),
            upper: Vec::new(),
            lower: Vec::new(),
            leaves: Vec::new(),
            tiles: [0; 3],
            stats: Stats::none(),
        };
        // A tile cannot stand where a node is.
        let tiles = tree.tiles.iter().filter(|(origin, _)| !tree.nodes.contains_key(*origin));
        let tiles = tiles.map(|(origin, tile)| (*origin, Err(*tile)));
        let nodes = tree.nodes.iter().map(|(origin, node)| (*origin, Ok(node)));
        let mut entries: Vec<_> = tiles.chain(nodes).collect();
        entries.sort_by_key(|(origin, _)| key(*origin));
        for (origin, entry) in entries {
            let (entry, stats) = match entry {
                Ok(node) => {
                    let stats = plan.enter_upper(origin, node, channels);
                    (Entry::Node, stats)
                }
                Err((value, is_active)) => {
                    plan.tiles[2] += u32::from(is_active);
                    let cube = Stats::cube(origin, 1 << (UPPER + LOWER + LEAF), value, channels);
                    (Entry::Tile(value, is_active), if is_active { cube } else { Stats::none() })
                }
            };
            plan.table.push((key(origin), entry));
            plan.stats.add(&stats);
        }
        match u32::try_from(plan.leaves.len()) {
            Ok(_) => Ok(plan),
            Err(_) => Err(std::io::Error::other("it has more leaves than NanoVDB counts")),
        }
    }

    fn enter_upper(&mut self, origin: [i32; 3], node: &'t Slots<Slots<Leaf<'t>>>, channels: usize) -> Stats {
        let mut stats = Stats::none();
        for (&i, slot) in node {
            let place = child(origin, UPPER, LOWER + LEAF, i);
            match slot {
                Slot::Node(lower) => stats.add(&self.enter_lower(place, lower, channels)),
                Slot::Tile(value, true) => {
                    self.tiles[1] += 1;
                    stats.add(&Stats::cube(place, 1 << (LOWER + LEAF), *value, channels));
                }
                Slot::Tile(..) => {}
            }
        }
        self.upper.push(Node { origin, content: node, stats });
        stats
    }

    fn enter_lower(&mut self, origin: [i32; 3], node: &'t Slots<Leaf<'t>>, channels: usize) -> Stats {
        let mut stats = Stats::none();
        for (&i, slot) in node {
            let place = child(origin, LOWER, LEAF, i);
            match slot {
                Slot::Node(leaf) => {
                    let own = leaf_stats(place, *leaf, channels);
                    self.leaves.push(Node { origin: place, content: *leaf, stats: own });
                    stats.add(&own);
                }
                Slot::Tile(value, true) => {
                    self.tiles[0] += 1;
                    stats.add(&Stats::cube(place, 1 << LEAF, *value, channels));
                }
                Slot::Tile(..) => {}
            }
        }
        self.lower.push(Node { origin, content: node, stats });
        stats
    }

    /// Bytes of the root with its table.
    pub fn root_bytes(&self) -> usize {
        let [before, entry] = self.values.root();
        before + entry * self.table.len()
    }

    /// Bytes of a node with 2^`log` children along each axis.
    pub fn node_bytes(&self, log: u32) -> usize {
        let [before, entry] = self.values.node(log);
        before + (entry << (3 * log))
    }

    /// Places of the first leaf, lower node, upper node and the root, bytes behind the start of the tree.
    pub fn places(&self) -> [u64; 4] {
        let root = TREE_BYTES;
        let upper = root + self.root_bytes() as u64;
        let lower = upper + (self.node_bytes(UPPER) * self.upper.len()) as u64;
        let leaf = lower + (self.node_bytes(LOWER) * self.lower.len()) as u64;
        [leaf, lower, upper, root]
    }

    /// Bytes of the grid.
    pub fn bytes(&self) -> u64 {
        let [_, leaf] = self.values.leaf();
        GRID_BYTES + self.places()[0] + (leaf * self.leaves.len()) as u64
    }

    /// Number of leaves, lower and upper nodes.
    pub fn counts(&self) -> [u32; 3] {
        [self.leaves.len(), self.lower.len(), self.upper.len()].map(|n| n as u32)
    }
}
