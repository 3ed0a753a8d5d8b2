//! A still's files: opened before the work, written after it, whole or not at all.

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::frame::{Frame, Layer, Output, encode_png, write_exr};
use crate::scene::Scene;
use crate::volume::VolumeTexture;

/// The outputs of one still.
pub struct Still(Vec<Sink>);

/// An output and how to write it.
enum Sink {
    Png(Output),
    Exr(Output),
}

impl Still {
    /// Opens every output, so that a folder that is not there is known before any work.
    pub fn create(paths: &[PathBuf]) -> Result<Still> {
        paths.iter().map(|path| open(path)).collect::<Result<Vec<Sink>>>().map(Still)
    }

    /// Whether one of them holds layers.
    pub fn has_exr(&self) -> bool {
        self.0.iter().any(|s| matches!(s, Sink::Exr(_)))
    }

    /// Writes the frame of a scene; EXR files get `layers`.
    pub fn save(self, frame: &Frame, layers: &[Layer], scene: &Scene, volume: &VolumeTexture) -> Result<()> {
        let resolved = metadata(scene, volume);
        let texts =
            [("Software", concat!("taki ", env!("CARGO_PKG_VERSION"))), ("taki.scene", resolved.as_str())];
        self.0.into_iter().try_for_each(|sink| save(sink, frame, layers, &texts))
    }
}

/// The scene that made a picture, as a scene file. A volume file stands in it by its contents, not by its
/// path: equal pictures are equal files, and nobody's folders are published.
fn metadata(scene: &Scene, volume: &VolumeTexture) -> String {
    let mut scene = scene.clone();
    scene.values.clear_under("volume.file");
    format!("# volume texture: crc32 {:08x}\n{}", volume.checksum(), scene.to_toml())
}

fn open(path: &Path) -> Result<Sink> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    match extension.as_deref() {
        Some("png") => Ok(Sink::Png(Output::create(path)?)),
        Some("exr") => Ok(Sink::Exr(Output::create(path)?)),
        _ => Err(Error::Usage(format!("-o {}: unknown kind of picture; use .png or .exr", path.display()))),
    }
}

fn save(sink: Sink, frame: &Frame, layers: &[Layer], texts: &[(&str, &str)]) -> Result<()> {
    match sink {
        Sink::Png(output) => {
            let bytes = encode_png(frame, texts).map_err(|e| Error::write(output.path(), e))?;
            output.finish_with(&bytes)
        }
        Sink::Exr(mut output) => {
            let path = output.path().to_owned();
            let writer = std::io::BufWriter::with_capacity(1 << 20, output.file());
            write_exr(frame, layers, texts, writer).map_err(|e| Error::write(&path, e))?;
            output.finish()
        }
    }
}
