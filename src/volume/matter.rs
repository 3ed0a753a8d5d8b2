//! §2 Recipes of matter that is made of threads with a width.

use super::threads::BYTES_PER_CELL;
use super::{ClothSpec, FurSpec, HairSpec, VolumeTexture};
use crate::util::error::Result;
use crate::util::monitor::Monitor;

/// Recipe of a volume of hairs or yarns. Equal recipes build equal bytes.
#[derive(Clone, Debug, PartialEq)]
pub enum Matter {
    /// Hairs on a skin.
    Fur(FurSpec),
    /// Woven yarns.
    Cloth(ClothSpec),
    /// Long hair along the flow.
    Hair(HairSpec),
}

impl Matter {
    /// Bytes that building takes for each cell beside the cell itself.
    pub const BYTES_PER_CELL: usize = BYTES_PER_CELL;

    /// Builds the volume texture in dense storage.
    ///
    /// # Errors
    /// Returns an error if `monitor` ends the work.
    pub fn build(&self, monitor: &dyn Monitor) -> Result<VolumeTexture> {
        match self {
            Matter::Fur(fur) => fur.build(monitor),
            Matter::Cloth(cloth) => cloth.build(monitor),
            Matter::Hair(hair) => hair.build(monitor),
        }
    }
}
