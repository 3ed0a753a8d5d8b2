//! Picture files, written and read row by row, with their checks and figures.

mod difference;
mod exr_file;
mod exr_head;
mod exr_lines;
mod exr_read;
mod figures;
mod format;
mod icc;
mod jpeg_file;
mod output;
mod owner;
mod png_file;
mod read;
mod rows;
mod samples;
mod save;
pub mod streaks;
mod texts;
mod tiff_file;
mod verify;
mod webp_file;
mod writer;

pub use difference::{Difference, Tolerance};
pub use exr_file::{Exr, ExrWriter, channels_of, half_of, lines_of};
pub use exr_head::{Channel, Compression, ExrCamera, ExrHead, fits_half, listed};
pub use exr_lines::ExrLines;
pub use exr_read::{Channels, ExrColours, ExrPicture, read_exr, read_exr_picture};
pub use figures::{Figures, KnownFigures, figures_of};
pub use format::Format;
pub use output::{Output, check_regular, folder_of, real_file, remove_left_by, remove_stale};
pub use owner::{Life, Owner};
pub use png_file::encode_png;
pub use read::{ReadPicture, read_picture, read_png};
pub use rows::PictureRows;
pub use samples::{Encoding, rgb_rows, samples_of};
pub use texts::crop_text;
pub use verify::{Verified, scene_in, verify};
pub use writer::{Head, RowWriter, encode};

/// Key of the text that contains the scene, as a scene file.
pub const SCENE_TEXT: &str = "taki.scene";
/// Key of the text that gives the part of the image that a developed picture shows.
pub const CROP_TEXT: &str = "taki.crop";
/// Key of the text that contains the figures of a developed picture, as JSON.
pub const FIGURES_TEXT: &str = "taki.figures";
/// Key of the text that marks a developed picture whose samples are linear.
pub const LINEAR_TEXT: &str = "taki.linear";

/// Largest side of an image, pixels: the limit of the parameter table.
const MAX_SIDE: u32 = 1_000_000;
