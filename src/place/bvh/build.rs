//! Builds the tree: binned surface area heuristic (Wald 2007), then four children a node.

use glam::{Vec3, Vec4};

use super::{Bvh, Face, Node};

/// Level from which on the halves are equal in number, so that the tree stays flat whatever the triangles.
pub(super) const MAX_UNEVEN: usize = 48;
/// Triangles of a leaf at most.
const LEAF: usize = 4;
/// Bins along the longest axis.
const BINS: usize = 16;
/// Triangles from which on two threads build the halves.
const PARALLEL: usize = 8192;

/// A triangle that blocks rays.
#[derive(Clone, Copy, Debug)]
pub struct Caster {
    /// Corners, metres.
    pub corners: [Vec3; 3],
    /// Bits by which rays choose what they meet.
    pub kinds: u8,
}

/// A triangle while the tree is built.
#[derive(Clone, Copy)]
struct Item {
    low: Vec3,
    high: Vec3,
    number: u32,
}

impl Item {
    /// Twice the middle of the box.
    fn middle(&self) -> Vec3 {
        self.low + self.high
    }
}

/// A binary tree over a range of items.
enum Tree {
    Leaf { low: Vec3, high: Vec3, first: u32, count: u32 },
    Inner { low: Vec3, high: Vec3, halves: Box<[Tree; 2]> },
}

impl Tree {
    fn bounds(&self) -> [Vec3; 2] {
        match self {
            Tree::Leaf { low, high, .. } | Tree::Inner { low, high, .. } => [*low, *high],
        }
    }
}

fn half_area([low, high]: [Vec3; 2]) -> f32 {
    let size = high - low;
    size.x * size.y + size.y * size.z + size.z * size.x
}

fn bounds<'a>(items: impl Iterator<Item = &'a Item>) -> [Vec3; 2] {
    items.fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[low, high], item| {
        [low.min(item.low), high.max(item.high)]
    })
}

impl Bvh {
    /// Builds the tree of triangles. Those that are not finite are left out.
    pub fn new(triangles: &[Caster]) -> Bvh {
        let items = triangles.iter().enumerate().filter(|(_, t)| t.corners.iter().all(|c| c.is_finite()));
        let mut items: Vec<Item> = items
            .map(|(number, Caster { corners: [a, b, c], .. })| Item {
                low: a.min(*b).min(*c),
                high: a.max(*b).max(*c),
                number: number as u32,
            })
            .collect();
        let [low, high] = bounds(items.iter());
        let mut bvh = Bvh { nodes: Vec::new(), faces: Vec::new(), low, high };
        if !items.is_empty() {
            let tree = split(&mut items, 0, 0);
            bvh.nodes.reserve(items.len() / 4);
            bvh.add(&tree);
        }
        let face = |item: &Item| {
            let Caster { corners: [a, b, c], kinds } = triangles[item.number as usize];
            Face { corner: a, edges: [b - a, c - a], number: item.number, kinds }
        };
        bvh.faces = items.iter().map(face).collect();
        bvh
    }

    /// Adds a node whose children are the four largest below `tree`. Returns its number.
    fn add(&mut self, tree: &Tree) -> u32 {
        let mut children: Vec<&Tree> = vec![tree];
        while children.len() < 4 {
            let area = |child: &&Tree| half_area(child.bounds());
            let inner = children.iter().enumerate().filter(|(_, child)| matches!(child, Tree::Inner { .. }));
            let Some((widest, _)) = inner.max_by(|a, b| area(a.1).total_cmp(&area(b.1))) else { break };
            let Tree::Inner { halves, .. } = children.swap_remove(widest) else { break };
            children.extend(halves.iter());
        }
        let number = self.nodes.len();
        let (low, high) = ([Vec4::INFINITY; 3], [Vec4::NEG_INFINITY; 3]);
        self.nodes.push(Node { low, high, first: [0; 4], count: [0; 4] });
        for (i, child) in children.into_iter().enumerate() {
            let (first, count) = match child {
                Tree::Leaf { first, count, .. } => (*first, *count),
                Tree::Inner { .. } => (self.add(child), 0),
            };
            let node = &mut self.nodes[number];
            let [low, high] = child.bounds();
            for axis in 0..3 {
                node.low[axis][i] = low[axis];
                node.high[axis][i] = high[axis];
            }
            (node.first[i], node.count[i]) = (first, count);
        }
        number as u32
    }
}

/// Sorts items into a tree. `first` is the number of the first of them.
fn split(items: &mut [Item], first: u32, level: usize) -> Tree {
    let [low, high] = bounds(items.iter());
    if items.len() <= LEAF {
        return Tree::Leaf { low, high, first, count: items.len() as u32 };
    }
    let middle = if level < MAX_UNEVEN { partition(items, [low, high]) } else { None };
    let middle = middle.unwrap_or(items.len() / 2);
    let (left, right) = items.split_at_mut(middle);
    let is_large = left.len() + right.len() >= PARALLEL;
    let mut left = || split(left, first, level + 1);
    let mut right = || split(right, first + middle as u32, level + 1);
    let halves = if is_large { rayon::join(left, right) } else { (left(), right()) };
    Tree::Inner { low, high, halves: Box::new([halves.0, halves.1]) }
}

/// Moves items to the side of the cheapest plane between two bins that they belong to. Returns the number of
/// those on the left; `None` where all middles are in one place.
fn partition(items: &mut [Item], [low, high]: [Vec3; 2]) -> Option<usize> {
    let all = [Vec3::INFINITY, Vec3::NEG_INFINITY];
    let [least, most] = items.iter().fold(all, |[a, b], item| [a.min(item.middle()), b.max(item.middle())]);
    let size = most - least;
    let axis = (0..3).max_by(|a, b| size[*a].total_cmp(&size[*b])).unwrap_or(0);
    let scale = BINS as f32 / size[axis];
    if !scale.is_finite() || !half_area([low, high]).is_finite() {
        return None;
    }
    let bin = |item: &Item| (((item.middle()[axis] - least[axis]) * scale) as usize).min(BINS - 1);
    let mut bins = [([Vec3::INFINITY, Vec3::NEG_INFINITY], 0usize); BINS];
    for item in items.iter() {
        let (own, count) = &mut bins[bin(item)];
        *own = [own[0].min(item.low), own[1].max(item.high)];
        *count += 1;
    }
    let mut costs = [0.0f32; BINS];
    let mut sweep = |order: &mut dyn Iterator<Item = (usize, usize)>| {
        let (mut around, mut count) = ([Vec3::INFINITY, Vec3::NEG_INFINITY], 0);
        for (own, plane) in order {
            let (bounds, inside) = bins[own];
            around = [around[0].min(bounds[0]), around[1].max(bounds[1])];
            count += inside;
            if count > 0 {
                costs[plane] += half_area(around) * count as f32;
            }
        }
    };
    // Plane i lies before bin i.
    sweep(&mut (0..BINS - 1).map(|i| (i, i + 1)));
    sweep(&mut (1..BINS).rev().map(|i| (i, i)));
    let plane = (1..BINS).min_by(|a, b| costs[*a].total_cmp(&costs[*b]))?;
    let mut left = 0;
    for i in 0..items.len() {
        if bin(&items[i]) < plane {
            items.swap(left, i);
            left += 1;
        }
    }
    (left > 0 && left < items.len()).then_some(left)
}
