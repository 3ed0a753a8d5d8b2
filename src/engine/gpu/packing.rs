//! Boxes of different sizes side by side in one 3-D texture.

/// Arrangement of boxes in a texture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Packing {
    /// Size of the texture, texels.
    pub extent: [u32; 3],
    /// First texel of each box.
    pub origins: Vec<[u32; 3]>,
}

impl Packing {
    /// Arranges boxes in a texture of at most `most` texels a side: in rows along the axis `order[0]`, the
    /// rows side by side along `order[1]`, and layers of rows along `order[2]`. `None` where they do not fit.
    pub fn along(order: [usize; 3], sizes: &[[u32; 3]], most: u32) -> Option<Packing> {
        let [row, side, layer] = order;
        let (mut at, mut extent) = ([0; 3], [1; 3]);
        // Ends of the row and of the layer.
        let (mut row_end, mut layer_end) = (0, 0);
        let mut origins = Vec::with_capacity(sizes.len());
        for size in sizes {
            if at[row] + size[row] > most {
                (at[row], at[side]) = (0, row_end);
            }
            if at[side] + size[side] > most {
                (at[row], at[side], at[layer]) = (0, 0, layer_end);
                row_end = 0;
            }
            if (0..3).any(|axis| at[axis] + size[axis] > most) {
                return None;
            }
            origins.push(at);
            extent = [0, 1, 2].map(|axis| extent[axis].max(at[axis] + size[axis]));
            row_end = row_end.max(at[side] + size[side]);
            layer_end = layer_end.max(at[layer] + size[layer]);
            at[row] += size[row];
        }
        Some(Packing { extent, origins })
    }

    /// Arranges boxes in the smallest texture that rows along any axis need.
    pub fn smallest(sizes: &[[u32; 3]], most: u32) -> Option<Packing> {
        let orders = [[2, 0, 1], [2, 1, 0], [1, 0, 2], [1, 2, 0], [0, 1, 2], [0, 2, 1]];
        let texels = |packing: &Packing| packing.extent.iter().map(|&n| u64::from(n)).product::<u64>();
        orders.into_iter().filter_map(|order| Packing::along(order, sizes, most)).min_by_key(texels)
    }
}
