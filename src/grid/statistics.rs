//! Least, greatest and mean values of a grid.

use super::{BlockData, Grid};

/// What the active samples of a grid hold. A scalar stands in the first component.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statistics {
    /// Least value of each component.
    pub min: [f32; 3],
    /// Greatest value of each component.
    pub max: [f32; 3],
    /// Mean of each component.
    pub mean: [f64; 3],
}

impl Grid {
    /// Tells of numbers that were not finite where nothing is active; `None` where all were.
    pub fn note(&self) -> Option<String> {
        let count = self.mended;
        (count > 0).then(|| {
            format!(
                "the grid {:?} has {count} numbers outside of its active samples that are not finite; the \
                 background stands for them",
                self.name
            )
        })
    }

    /// Statistics of the active samples; `None` where there are none.
    pub fn statistics(&self) -> Option<Statistics> {
        let channels = self.channels();
        let (mut min, mut max) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        let (mut sum, mut count) = ([0f64; 3], 0f64);
        let mut add = |value: &[f32], times: f64| {
            count += times;
            for (a, &x) in value.iter().enumerate() {
                (min[a], max[a]) = (min[a].min(x), max[a].max(x));
                sum[a] += f64::from(x) * times;
            }
        };
        for block in self.blocks() {
            match block.data {
                BlockData::Leaf { values, active } => {
                    for (i, value) in values.chunks_exact(channels).enumerate() {
                        if active[i >> 6] >> (i & 63) & 1 != 0 {
                            add(value, 1.0);
                        }
                    }
                }
                BlockData::Tile { value, is_active: true } => {
                    add(&value[..channels], f64::from(block.side).powi(3));
                }
                BlockData::Tile { .. } => {}
            }
        }
        if count == 0.0 {
            return None;
        }
        let component = |a: usize, x: f32| if a < channels { x } else { 0.0 };
        Some(Statistics {
            min: std::array::from_fn(|a| component(a, min[a])),
            max: std::array::from_fn(|a| component(a, max[a])),
            mean: sum.map(|sum| sum / count),
        })
    }
}
