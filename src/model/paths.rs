//! Files that a model's file names: confined to its folder, regular, and no larger than the memory allows.

use std::borrow::Cow;
use std::io::Read;
use std::path::{Path, PathBuf};

use base64::Engine;
use base64::engine::DecodePaddingMode::Indifferent;
use base64::engine::general_purpose::{GeneralPurpose, GeneralPurposeConfig};
use percent_encoding::percent_decode_str;

use super::budget::Budget;
use super::{EXPORT_AGAIN, File};
use crate::util::confine::confine;
use crate::util::error::{Error, Result};

/// Reads a regular file whole, after its size was counted.
pub(super) fn read_whole(path: &Path, budget: &mut Budget) -> Result<Vec<u8>> {
    read_start(path, u64::MAX, budget)
}

/// Reads the first `most` bytes of a regular file, or all where it is shorter.
pub(super) fn read_start(path: &Path, most: u64, budget: &mut Budget) -> Result<Vec<u8>> {
    let meta = std::fs::metadata(path).map_err(|e| Error::open(path, e))?;
    if !meta.is_file() {
        return Err(Error::input(
            format!("{} is not a regular file", path.display()),
            "give a file of glTF or OBJ",
        ));
    }
    let length = meta.len().min(most);
    budget.take(u128::from(length), || format!("the file {}", path.display()))?;
    let file = std::fs::File::open(path).map_err(|e| Error::open(path, e))?;
    let mut bytes = Vec::with_capacity(length as usize);
    file.take(length).read_to_end(&mut bytes).map_err(|e| Error::read(path, e))?;
    Ok(bytes)
}

/// The reason why a reference is not followed, and the way out.
pub(super) struct Refusal {
    pub why: String,
    pub fix: String,
}

/// Finds the file that a URI of glTF names. `%20` and the like are decoded once. Where there is no such file,
/// the URI is tried as it stands, as exporters write names with spaces or percent signs without encoding
/// them.
pub(super) fn resolve_uri(file: &File, uri: &str) -> std::result::Result<PathBuf, Refusal> {
    let decoded = percent_decode_str(uri).decode_utf8().unwrap_or(Cow::Borrowed(uri));
    let found = resolve(file, &decoded);
    if found.is_err() && decoded != uri { resolve(file, uri).or(found) } else { found }
}

/// Finds the file that a relative path names, inside the folder of `file` or one that the limits allow.
pub(super) fn resolve(file: &File, name: &str) -> std::result::Result<PathBuf, Refusal> {
    let shown = shorten(name);
    let beside = || format!("put the file beside {}", file.path.display());
    let refuse = |why: String, fix: String| Err(Refusal { why, fix });
    if name.contains('\0') || name.trim().is_empty() {
        return refuse(format!("{shown:?} is no path"), EXPORT_AGAIN.into());
    }
    if has_scheme(name) {
        return refuse(
            format!("{shown:?} is not a relative path"),
            beside() + ", and name it without a scheme",
        );
    }
    if name.starts_with(['/', '\\']) {
        return refuse(
            format!("{shown:?} is an absolute path"),
            beside() + ", and export with relative paths",
        );
    }
    let folder = match file.path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    match confine(Path::new(name), folder, &file.limits.allow_paths) {
        Err(why) => refuse(format!("cannot find {shown:?} in {}: {why}", folder.display()), beside()),
        Ok(None) => {
            let real = folder.join(name);
            let real = real.canonicalize().unwrap_or(real);
            let parent = real.parent().unwrap_or(&real).display().to_string();
            refuse(
                format!("{shown:?} leads out of the folder {}", folder.display()),
                format!("{}, or allow it with --allow-path {parent}", beside()),
            )
        }
        Ok(Some(real)) if !real.is_file() => {
            refuse(format!("{shown:?} is not a regular file"), "name a file".into())
        }
        Ok(Some(real)) => Ok(real),
    }
}

/// Tells whether a reference begins with a scheme (`file:`, `http:`) or a drive (`C:`).
fn has_scheme(name: &str) -> bool {
    let Some((scheme, _)) = name.split_once(':') else { return false };
    scheme.starts_with(|c: char| c.is_ascii_alphabetic())
        && scheme.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c))
}

/// Cuts a text from a file to 60 characters.
pub(super) fn shorten(text: &str) -> String {
    match text.char_indices().nth(60) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.into(),
    }
}

/// Media type and text of a `data:` URI, with a mark where it is coded in base64.
pub(super) struct DataUri<'a> {
    pub mime: &'a str,
    base64: bool,
    text: &'a str,
}

impl<'a> DataUri<'a> {
    /// Returns `None` where the URI is not of the scheme `data:`, and an empty text where it has no comma.
    pub fn parse(uri: &'a str) -> Option<DataUri<'a>> {
        if !uri.get(..5).is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:")) {
            return None;
        }
        let (head, text) = uri[5..].split_once(',').unwrap_or((&uri[5..], ""));
        let base64 = head.len() >= 7
            && head.is_char_boundary(head.len() - 7)
            && head[head.len() - 7..].eq_ignore_ascii_case(";base64");
        Some(DataUri { mime: head.split(';').next().unwrap_or(""), base64, text })
    }

    /// Most bytes that the text can decode to.
    pub fn most_bytes(&self) -> u64 {
        if self.base64 { self.text.len() as u64 / 4 * 3 + 3 } else { self.text.len() as u64 }
    }

    /// Decodes the text.
    ///
    /// # Errors
    /// The reason where it is no base64.
    pub fn decode(&self) -> std::result::Result<Vec<u8>, String> {
        if !self.base64 {
            return Ok(percent_decode_str(self.text).collect());
        }
        let config = GeneralPurposeConfig::new().with_decode_padding_mode(Indifferent);
        let engine = GeneralPurpose::new(&base64::alphabet::STANDARD, config);
        let text: Cow<[u8]> = percent_decode_str(self.text).into();
        engine.decode(&text).map_err(|e| format!("its base64 is broken: {e}"))
    }
}
