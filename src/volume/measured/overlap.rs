//! Shares of cells that voxels cover, along one axis.

/// Shares of the cells that each voxel along an axis covers.
pub(super) struct Overlap {
    /// First cell that each voxel covers a part of.
    first: Vec<u32>,
    /// Where the shares of each voxel begin in `shares`, and the end of the last.
    starts: Vec<usize>,
    /// Share of a cell that the voxel covers, cell by cell.
    shares: Vec<f64>,
}

impl Overlap {
    /// Shares of `cells` cells over `voxels` voxels, both at least 1. Lengths are whole numbers: a voxel has
    /// `cells` of them and a cell has `voxels`.
    pub fn new(voxels: u64, cells: u32) -> Overlap {
        let count = u64::from(cells);
        let mut all = Overlap { first: Vec::new(), starts: vec![0], shares: Vec::new() };
        for voxel in 0..voxels {
            let [low, high] = [voxel * count, (voxel + 1) * count];
            let [first, last] = [low / voxels, (high - 1) / voxels];
            all.first.push(first as u32);
            all.shares.extend((first..=last).map(|cell| {
                let common = high.min((cell + 1) * voxels) - low.max(cell * voxels);
                common as f64 / voxels as f64
            }));
            all.starts.push(all.shares.len());
        }
        all
    }

    /// First cell that a voxel covers, and the shares of that one and those behind it.
    #[inline]
    pub fn of(&self, voxel: usize) -> (u32, &[f64]) {
        (self.first[voxel], &self.shares[self.starts[voxel]..self.starts[voxel + 1]])
    }

    /// Voxels that cover a part of the cells from `low` on before `high`.
    pub fn voxels(&self, low: u32, high: u32) -> std::ops::Range<usize> {
        let last = |voxel: usize| self.first[voxel] as usize + self.starts[voxel + 1] - self.starts[voxel];
        let count = self.first.len();
        let begin = partition(count, |voxel| last(voxel) <= low as usize);
        let end = partition(count, |voxel| self.first[voxel] < high);
        begin..end
    }
}

/// Cells that a voxel covers in some layers of a volume.
pub(super) struct Covered<'a> {
    /// First cell and shares along each axis.
    pub axes: [(u32, &'a [f64]); 3],
    /// Cells along x and y.
    pub across: [usize; 2],
    /// The layers.
    pub layers: std::ops::Range<u32>,
}

impl Covered<'_> {
    /// Gives the index of every cell among those of the layers, and the share of it that the voxel covers.
    #[inline]
    pub fn each(&self, mut cell: impl FnMut(usize, f64)) {
        let [(x, along_x), (y, along_y), (z, along_z)] = self.axes;
        let [nx, ny] = self.across;
        for (z, share_z) in (z..).zip(along_z).filter(|(z, _)| self.layers.contains(z)) {
            for (y, share_y) in (y as usize..).zip(along_y) {
                let row = ((z - self.layers.start) as usize * ny + y) * nx + x as usize;
                let share = share_z * share_y;
                along_x.iter().enumerate().for_each(|(i, share_x)| cell(row + i, share * share_x));
            }
        }
    }
}

/// Number of the first items for which `is_before` holds.
fn partition(count: usize, is_before: impl Fn(usize) -> bool) -> usize {
    let (mut low, mut high) = (0, count);
    while low < high {
        let middle = (low + high) / 2;
        if is_before(middle) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    low
}
