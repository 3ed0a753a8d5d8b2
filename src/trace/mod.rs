//! §4 The trace: how view rays sample the volume, cell by cell.

pub mod billow;
mod levels;
pub mod lines;
pub mod lookup;
mod matter;
pub(crate) mod noise;
mod settings;
pub mod tear;

pub use billow::BillowTimes;
pub use levels::{level_atlas, pyramid_spec};
pub use matter::{MEAN_EROSION, MIST_OF_CELLS, MIST_RHO, SheetDensity};
pub use settings::{Attenuation, AttenuationKind, Lookup, Prefilter, Trace, extinction, flow_cells};
