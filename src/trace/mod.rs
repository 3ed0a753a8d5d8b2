//! §4 The trace: what view rays find on their way through the volume.

mod levels;
pub mod lookup;
mod matter;
mod settings;

pub use levels::{level_atlas, pyramid_spec};
pub use matter::{MIST_OF_CELLS, MIST_RHO, SheetDensity};
pub use settings::{Attenuation, AttenuationKind, Lookup, Prefilter, Trace, extinction, flow_cells};
