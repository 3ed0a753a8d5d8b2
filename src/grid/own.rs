//! Grids that the program brings, for its presets.

use std::path::Path;

/// Files by the path that a scene names them by. All are OpenVDB.
const OWN: &[(&str, &[u8])] = &[("taki:pour.vdb", include_bytes!("../../assets/volumes/pour.vdb"))];

/// Returns the content of a file that the program brings: no file of the disk has its path.
pub fn own(path: &Path) -> Option<&'static [u8]> {
    OWN.iter().find(|(name, _)| Path::new(name) == path).map(|(_, bytes)| *bytes)
}
