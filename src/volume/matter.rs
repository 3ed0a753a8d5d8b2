//! §2 Recipes of matter other than water and simulations.

use super::mountain::BYTES_PER_COLUMN;
use super::threads::BYTES_PER_CELL;
use super::{ClothSpec, FurSpec, GrainsSpec, MountainSpec, VolumeTexture};
use crate::util::error::Result;
use crate::util::monitor::Monitor;

/// Recipe of a volume of other matter. Equal recipes build equal bytes.
#[derive(Clone, Debug, PartialEq)]
pub enum Matter {
    /// Hairs on a skin.
    Fur(FurSpec),
    /// Woven yarns.
    Cloth(ClothSpec),
    /// A face of rock with grass.
    Mountain(MountainSpec),
    /// Loose grains.
    Grains(GrainsSpec),
}

impl Matter {
    /// Bytes that building takes for each cell beside the cell itself.
    pub const BYTES_PER_CELL: usize = BYTES_PER_CELL;

    /// Bytes that building takes beside those of the cells.
    pub fn bytes_beside(&self) -> u128 {
        match self {
            Matter::Mountain(MountainSpec { size: [nx, ny, _], .. }) => {
                u128::from(*nx) * u128::from(*ny) * BYTES_PER_COLUMN as u128
            }
            _ => 0,
        }
    }

    /// Builds the volume texture in dense storage.
    ///
    /// # Errors
    /// Returns an error if `monitor` ends the work.
    pub fn build(&self, monitor: &dyn Monitor) -> Result<VolumeTexture> {
        match self {
            Matter::Fur(fur) => fur.build(monitor),
            Matter::Cloth(cloth) => cloth.build(monitor),
            Matter::Mountain(mountain) => mountain.build(monitor),
            Matter::Grains(grains) => grains.build(monitor),
        }
    }
}
