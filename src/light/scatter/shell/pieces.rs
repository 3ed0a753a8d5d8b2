//! Parts of a column that have one layer of cells, one value of J and one interval between two values.

/// A part of a column below a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// Number of the layer of cells.
    pub layer: usize,
    /// Number of the value of J that stands for the piece: the nearest.
    pub value: usize,
    /// Number of the interval between two values.
    pub interval: usize,
    /// Depths of its ends, 0 to 1.
    pub ends: [f32; 2],
}

/// Cuts a column with `layers` intervals between values of J and `cells` layers of cells.
pub fn pieces(layers: usize, cells: usize) -> Vec<Piece> {
    // Places in units of 1/(2·layers·cells) are whole numbers.
    let all = 2 * layers * cells;
    let mut cuts: Vec<usize> =
        (0..=2 * layers).map(|i| i * cells).chain((0..=cells).map(|k| k * 2 * layers)).collect();
    cuts.sort_unstable();
    cuts.dedup();
    let piece = |pair: &[usize]| {
        let at = pair[0];
        let half = at / cells;
        Piece {
            layer: at / (2 * layers),
            value: half.div_ceil(2),
            interval: half / 2,
            ends: [pair[0], pair[1]].map(|cut| cut as f32 / all as f32),
        }
    };
    cuts.windows(2).map(piece).collect()
}
