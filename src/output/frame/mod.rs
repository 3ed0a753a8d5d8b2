//! Picture files: PNG and EXR, written and read row by row, with their checks and figures.

mod difference;
mod exr_file;
mod figures;
mod output;
mod owner;
mod png_file;
mod save;
pub mod streaks;
mod verify;

pub use difference::{Difference, Tolerance};
pub use exr_file::{ExrLines, ExrWriter, channel_names, lines_of, read_exr};
pub use figures::{Figures, KnownFigures, figures_of};
pub use output::{Output, folder_of, real_file, remove_left_by, remove_stale};
pub use owner::{Life, Owner};
pub use png_file::{PngRows, PngWriter, crop_text, encode_png, read_png, rgb_rows};
pub use verify::{Kind, Verified, verify};

/// Key of the text that contains the scene, as a scene file.
pub const SCENE_TEXT: &str = "taki.scene";
/// Key of the text that gives the part of the image that a PNG shows.
pub const CROP_TEXT: &str = "taki.crop";
/// Key of the text that contains the figures of a PNG, as JSON.
pub const FIGURES_TEXT: &str = "taki.figures";

/// Largest side of an image, pixels: the limit of the parameter table.
const MAX_SIDE: u32 = 1_000_000;
