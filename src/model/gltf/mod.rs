//! glTF 2.0: the container, the buffers, and the extensions that a file requires.

mod accessor;
mod animations;
mod json;
mod looks;
mod meshes;
mod nodes;

use std::sync::Arc;

use super::budget::Budget;
use super::paths::{DataUri, read_start, resolve_uri, shorten};
use super::{File, ImageSource, Model};
use crate::util::error::{Error, Result};
use crate::util::monitor::Monitor;
use json::Document;

/// Reads a `.gltf` or `.glb` whose bytes are already counted.
pub(super) fn read(file: &File, bytes: Vec<u8>, budget: &mut Budget, monitor: &dyn Monitor) -> Result<Model> {
    let (text, binary) = container(file, bytes)?;
    budget.take(json::most_bytes(&text), || format!("the document of {}", file.path.display()))?;
    let document = parse(file, &text)?;
    drop(text);
    let mut notes = Vec::new();
    check_version(file, &document)?;
    check_extensions(file, &document, &mut notes)?;
    let buffers = read_buffers(file, &document, binary, budget)?;
    let gltf = Gltf { file, document, buffers };
    let mut model = Model { notes, ..Model::default() };
    gltf.read_looks(&mut model, budget)?;
    gltf.read_nodes(&mut model, budget)?;
    gltf.read_meshes(&mut model, budget, monitor)?;
    gltf.read_animations(&mut model, budget)?;
    Ok(model)
}

/// A document and its buffers.
struct Gltf<'a> {
    file: &'a File<'a>,
    document: Document,
    /// Bytes of each buffer; `None` where the file has none, as for the fall-back of a compressed one.
    buffers: Vec<Option<Vec<u8>>>,
}

impl Gltf<'_> {
    fn fault(&self, place: &str, why: impl std::fmt::Display) -> Error {
        self.file.fault(place, why)
    }

    /// Checks an index at `place` that must lead into a list.
    fn index(&self, place: &str, index: usize, count: usize, list: &str) -> Result<usize> {
        if index < count {
            return Ok(index);
        }
        Err(self.fault(place, format!("{list}[{index}] does not exist, there are {count} {list}")))
    }

    /// Returns the bytes of a buffer view.
    fn view(&self, place: &str, index: usize) -> Result<&[u8]> {
        let views = &self.document.buffer_views;
        let view = &views[self.index(place, index, views.len(), "bufferViews")?];
        let own = format!("bufferViews[{index}]");
        let buffer = self.index(&own, view.buffer, self.buffers.len(), "buffers")?;
        let Some(bytes) = &self.buffers[buffer] else {
            if view.extensions.meshopt.is_some() {
                return Err(compressed(self.file, &own, "EXT_meshopt_compression"));
            }
            return Err(self.fault(&format!("buffers[{buffer}]"), "it has no uri"));
        };
        let end = view.byte_offset.checked_add(view.byte_length);
        match end.filter(|end| *end <= bytes.len() as u64) {
            Some(end) => Ok(&bytes[view.byte_offset as usize..end as usize]),
            None => Err(self.fault(
                &own,
                format!(
                    "{} bytes from byte {} reach past the end of buffers[{buffer}], which has {}",
                    view.byte_length,
                    view.byte_offset,
                    bytes.len()
                ),
            )),
        }
    }
}

const JSON_CHUNK: u32 = 0x4e4f_534a;
const BINARY_CHUNK: u32 = 0x004e_4942;

/// Splits a file into its document and the binary chunk of a `.glb`.
fn container(file: &File, bytes: Vec<u8>) -> Result<(Vec<u8>, Option<Vec<u8>>)> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes, None));
    }
    let word = |at: usize| -> Result<u32> {
        let found = bytes.get(at..).and_then(|rest| rest.first_chunk::<4>());
        found.map(|four| u32::from_le_bytes(*four)).ok_or_else(|| {
            file.fault(&format!("byte {at}"), format!("the file ends there, after {} bytes", bytes.len()))
        })
    };
    let version = word(4)?;
    if version != 2 {
        return Err(file.fault_with(
            "byte 4",
            format!("it is a container of version {version}"),
            "export the model as glTF 2.0",
        ));
    }
    let length = word(8)? as usize;
    if length > bytes.len() {
        return Err(
            file.fault("byte 8", format!("the file should have {length} bytes and has {}", bytes.len()))
        );
    }
    let (mut at, mut document, mut binary) = (12, None, None);
    while at + 8 <= length && (document.is_none() || binary.is_none()) {
        let (size, kind) = (word(at)? as usize, word(at + 4)?);
        let start = at + 8;
        let Some(end) = start.checked_add(size).filter(|end| *end <= length) else {
            return Err(file.fault(
                &format!("byte {at}"),
                format!("a chunk of {size} bytes reaches past the end of the file"),
            ));
        };
        match kind {
            JSON_CHUNK if document.is_none() => document = Some(start..end),
            BINARY_CHUNK if binary.is_none() => binary = Some(start..end),
            _ => {}
        }
        at = end;
    }
    let Some(document) = document else { return Err(file.fault("byte 12", "there is no chunk of JSON")) };
    let text = bytes[document].to_vec();
    // The binary chunk is most of the file: it is moved to the front instead of copied.
    let binary = binary.map(|range| {
        let mut bytes = bytes;
        bytes.truncate(range.end);
        bytes.drain(..range.start);
        bytes
    });
    Ok((text, binary))
}

fn parse(file: &File, text: &[u8]) -> Result<Document> {
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    let mut source = serde_json::Deserializer::from_slice(text);
    let document = serde_path_to_error::deserialize(&mut source).map_err(|e| {
        let path = e.path().to_string();
        let place = if path == "." { "the document".to_owned() } else { path };
        file.fault(&place, shorten_reason(&e.into_inner().to_string()))
    })?;
    source.end().map_err(|e| file.fault("the document", e))?;
    Ok(document)
}

/// A reason of the JSON reader may quote a text of the file, which may be long.
fn shorten_reason(why: &str) -> String {
    if why.chars().count() <= 160 { why.into() } else { shorten(why) }
}

fn check_version(file: &File, document: &Document) -> Result<()> {
    let asset = &document.asset;
    let version = asset.min_version.as_ref().unwrap_or(&asset.version);
    if version == "2.0" || asset.min_version.is_none() && version.starts_with("2.") {
        return Ok(());
    }
    Err(file.fault_with(
        "asset.version",
        format!("it is glTF {}", shorten(version)),
        "export the model as glTF 2.0, or convert it: npx gltf-pipeline -i old.gltf -o new.glb",
    ))
}

/// Extensions that are read.
const READ: [&str; 5] = [
    "KHR_texture_transform",
    "KHR_lights_punctual",
    "KHR_mesh_quantization",
    "EXT_mesh_gpu_instancing",
    "EXT_texture_webp",
];

/// Beginnings of the names of extensions that change how a surface looks, but not where it is.
const LOOKS: [&str; 10] = [
    "KHR_materials_",
    "EXT_materials_",
    "ADOBE_materials_",
    "KHR_texture_",
    "EXT_texture_",
    "MSFT_texture_",
    "MSFT_packing_",
    "KHR_lights_",
    "EXT_lights_",
    "KHR_xmp",
];

/// Extensions that compress geometry.
const COMPRESSED: [&str; 3] =
    ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"];

fn check_extensions(file: &File, document: &Document, notes: &mut Vec<String>) -> Result<()> {
    for name in &document.extensions_required {
        let known = |list: &[&str]| list.contains(&name.as_str());
        if known(&READ) {
            continue;
        }
        if known(&COMPRESSED) {
            return Err(compressed(file, "extensionsRequired", name));
        }
        if !LOOKS.iter().any(|start| name.starts_with(start)) {
            return Err(file.fault_with(
                "extensionsRequired",
                format!("the file needs the extension {}, which taki does not read", shorten(name)),
                "export the model without it",
            ));
        }
        notes.push(format!("the extension {} is ignored: surfaces may look different", shorten(name)));
    }
    Ok(())
}

/// The error for compressed geometry.
fn compressed(file: &File, place: &str, extension: &str) -> Error {
    let how = if extension.contains("draco") {
        "export without compression (Blender: Data, Compression off), or decompress it: npx \
         @gltf-transform/cli copy in.glb out.glb"
    } else {
        "export without compression, or decompress it: npx @gltf-transform/cli copy in.glb out.glb"
    };
    file.fault_with(place, format!("the geometry is compressed with {extension}"), how)
}

/// Reads the buffers: the binary chunk, files beside the document, and `data:` URIs.
fn read_buffers(
    file: &File,
    document: &Document,
    mut binary: Option<Vec<u8>>,
    budget: &mut Budget,
) -> Result<Vec<Option<Vec<u8>>>> {
    let mut buffers = Vec::new();
    for (i, buffer) in document.buffers.iter().enumerate() {
        let place = format!("buffers[{i}]");
        let bytes = match &buffer.uri {
            None if i == 0 => binary.take(),
            None => None,
            Some(uri) => Some(read_buffer(file, &place, uri, buffer.byte_length, budget)?),
        };
        if let Some(bytes) = &bytes
            && (bytes.len() as u64) < buffer.byte_length
        {
            return Err(file.fault(
                &place,
                format!("it should have {} bytes and has {}", buffer.byte_length, bytes.len()),
            ));
        }
        buffers.push(bytes);
    }
    Ok(buffers)
}

fn read_buffer(file: &File, place: &str, uri: &str, length: u64, budget: &mut Budget) -> Result<Vec<u8>> {
    let place = format!("{place}.uri");
    if let Some(data) = DataUri::parse(uri) {
        budget.take(u128::from(data.most_bytes()), || format!("{}: {place}", file.path.display()))?;
        return data.decode().map_err(|why| file.fault(&place, why));
    }
    let path = resolve_uri(file, uri).map_err(|refusal| file.fault_with(&place, refusal.why, refusal.fix))?;
    read_start(&path, length, budget)
}

impl Gltf<'_> {
    /// Finds the image at an index. One that cannot be had becomes [`ImageSource::Refused`].
    fn image(&self, index: usize, budget: &mut Budget) -> Result<ImageSource> {
        let image = &self.document.images[index];
        let place = format!("images[{index}]");
        let name = if image.name.is_empty() { String::new() } else { format!(" ({})", shorten(&image.name)) };
        let refused = |why: String, fix: String| ImageSource::Refused {
            what: format!("{}: {place}{name}: {why}", self.file.path.display()),
            fix,
        };
        let ktx = |text: &str| text.to_ascii_lowercase().ends_with("ktx2");
        let mime = image.mime_type.as_deref().unwrap_or("");
        if ktx(mime) || image.uri.as_deref().is_some_and(ktx) {
            return Ok(basisu(&refused));
        }
        if let Some(view) = image.buffer_view {
            let bytes = match self.view(&place, view) {
                Ok(bytes) => bytes,
                Err(why) => {
                    return Ok(ImageSource::Refused { what: why.cause(), fix: super::EXPORT_AGAIN.into() });
                }
            };
            if bytes.starts_with(b"\xabKTX 20") {
                return Ok(basisu(&refused));
            }
            return self.image_bytes(&place, bytes.to_vec(), budget);
        }
        let Some(uri) = &image.uri else {
            return Ok(refused("it has neither uri nor bufferView".into(), super::EXPORT_AGAIN.into()));
        };
        if let Some(data) = DataUri::parse(uri) {
            budget
                .take(u128::from(data.most_bytes()), || format!("{}: {place}", self.file.path.display()))?;
            if ktx(data.mime) {
                return Ok(basisu(&refused));
            }
            return Ok(match data.decode() {
                Ok(bytes) => ImageSource::Bytes { place: self.place(&place), bytes: Arc::new(bytes) },
                Err(why) => refused(why, super::EXPORT_AGAIN.into()),
            });
        }
        Ok(match resolve_uri(self.file, uri) {
            Ok(path) => ImageSource::File(path),
            Err(refusal) => refused(refusal.why, refusal.fix),
        })
    }

    fn image_bytes(&self, place: &str, bytes: Vec<u8>, budget: &mut Budget) -> Result<ImageSource> {
        budget.take(bytes.len() as u128, || format!("{}: {place}", self.file.path.display()))?;
        Ok(ImageSource::Bytes { place: self.place(place), bytes: Arc::new(bytes) })
    }

    /// Name of a place with that of the file.
    fn place(&self, place: &str) -> String {
        format!("{}: {place}", self.file.path.display())
    }
}

fn basisu(refused: &dyn Fn(String, String) -> ImageSource) -> ImageSource {
    refused(
        "the image is compressed with KTX2 (KHR_texture_basisu), which taki does not read".into(),
        "export the images as PNG, JPEG or WebP files".into(),
    )
}
