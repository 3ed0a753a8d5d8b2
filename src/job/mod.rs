//! Long-running work: stills rendered in strips, batches of pictures, claims on shared folders, stitching.

mod ahead;
pub mod batch;
mod claim;
mod depth;
mod memo;
mod still;
mod stitch;
mod strips;

pub use claim::{Asked, Claim, Claims};
pub use depth::Depth;
pub(crate) use depth::{beside_encoders, check_alpha, check_side, held_bytes};
pub use memo::VolumeMemo;
pub(crate) use still::{About, Sink, check_kind, check_replaced, check_volume_replaced, is_hair};
pub use still::{STDOUT, Still, StillWriter};
pub(crate) use stitch::is_same_file;
pub use stitch::{StitchOptions, stitch, stitch_with};
pub use strips::{check_bloom, memory_of, spare_for_next, spare_for_rasters, strips};
