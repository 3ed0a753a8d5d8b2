//! MTL: the materials of an OBJ file.

use std::path::{Path, PathBuf};

use super::super::budget::Budget;
use super::super::paths::{Refusal, read_whole, resolve, shorten};
use super::super::{File, ImageSource, ModelMaterial, TextureRef, TextureTransform, Wrap};
use super::Reader;
use super::lines::{Lines, numbers};
use crate::util::error::Result;

/// A material about which nothing is known: no metal, as OBJ has none.
pub fn plain() -> ModelMaterial {
    ModelMaterial { metallic: 0.0, ..ModelMaterial::default() }
}

/// Finds the file that a line of OBJ or MTL names. Programs on Windows write backslashes.
fn find(file: &File, name: &str) -> std::result::Result<PathBuf, Refusal> {
    let found = resolve(file, name);
    if found.is_err() && name.contains('\\') {
        resolve(file, &name.replace('\\', "/")).or(found)
    } else {
        found
    }
}

impl Reader<'_> {
    /// Reads the libraries that a line names: one whose name may have blanks, or several. Where a library
    /// cannot be had, its materials have only their names.
    pub fn library(&mut self, names: &str, budget: &mut Budget) -> Result<()> {
        if !self.libraries.insert(names.to_owned()) {
            return Ok(());
        }
        let refusal = match find(self.file, names) {
            Ok(path) => return self.read_library(names, &path, budget),
            Err(refusal) => refusal,
        };
        let words: Vec<&str> = names.split_ascii_whitespace().collect();
        let found: Vec<_> =
            words.iter().filter_map(|word| Some((word, find(self.file, word).ok()?))).collect();
        if found.len() < words.len() || words.is_empty() {
            let why = format!("{}; materials of that library have no colours: {}", refusal.why, refusal.fix);
            self.model.note(format!("mtllib: {why}"));
        }
        for (word, path) in found {
            if self.libraries.insert((*word).to_owned()) || words.len() == 1 {
                self.read_library(word, &path, budget)?;
            }
        }
        Ok(())
    }

    /// Reads a library. `name` is its path as the OBJ file writes it: textures lie relative to it.
    fn read_library(&mut self, name: &str, path: &Path, budget: &mut Budget) -> Result<()> {
        let bytes = read_whole(path, budget)?;
        // Materials and names of images: no line takes more.
        let lines = bytes.iter().filter(|byte| **byte == b'\n').count() as u128 + 1;
        budget
            .take(lines * 512 + 4 * bytes.len() as u128, || format!("the materials of {}", path.display()))?;
        let library = File { path, limits: self.file.limits };
        let folder = name.replace('\\', "/");
        let folder = Path::new(&folder).parent().unwrap_or(Path::new("")).to_owned();
        let mut current = None;
        // Roughness that is given as such goes before the one of the highlight.
        let mut is_rough = false;
        for (line, text) in Lines::new(&bytes) {
            let (keyword, rest) = text.split_once([' ', '\t']).unwrap_or((&text, ""));
            let rest = rest.trim();
            if keyword == "newmtl" {
                current = Some(self.material_named(rest));
                is_rough = false;
                continue;
            }
            let Some(material) = current else { continue };
            let number = || -> Result<f32> { Ok(values::<1>(&library, line, keyword, rest)?.0[0]) };
            match keyword {
                "Kd" if !rest.starts_with(|c: char| c.is_ascii_alphabetic()) => {
                    let ([r, g, b], found) = values::<3>(&library, line, keyword, rest)?;
                    let [r, g, b] = if found < 3 { [r; 3] } else { [r, g, b] };
                    let own = &mut self.model.materials[material].base_color;
                    *own = [r.max(0.0), g.max(0.0), b.max(0.0), own[3]];
                }
                "d" if !rest.starts_with('-') => {
                    self.model.materials[material].base_color[3] = number()?.clamp(0.0, 1.0);
                }
                "Tr" => self.model.materials[material].base_color[3] = 1.0 - number()?.clamp(0.0, 1.0),
                "Pr" => {
                    is_rough = true;
                    let own = &mut self.model.materials[material];
                    (own.roughness, own.says_roughness) = (number()?.clamp(0.0, 1.0), true);
                }
                "Pm" => {
                    let own = &mut self.model.materials[material];
                    (own.metallic, own.says_roughness) = (number()?.clamp(0.0, 1.0), true);
                }
                // As Blender reads and writes it: an exponent of 1000 is a mirror.
                "Ns" if !is_rough => {
                    let exponent = number()?.clamp(0.0, 1000.0);
                    let own = &mut self.model.materials[material];
                    (own.roughness, own.says_roughness) = (1.0 - (exponent / 1000.0).sqrt(), true);
                }
                "map_Kd" => {
                    let texture = self.texture(&library, line, &folder, rest)?;
                    self.model.materials[material].base_color_texture = texture;
                }
                "norm" => {
                    let texture = self.texture(&library, line, &folder, rest)?;
                    self.model.materials[material].normal_texture = texture;
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Reads the options and the file of a texture.
    fn texture(
        &mut self,
        library: &File,
        line: usize,
        folder: &Path,
        text: &str,
    ) -> Result<Option<TextureRef>> {
        let mut transform = TextureTransform::default();
        let mut wrap = Wrap::Repeat;
        let mut rest = text.trim_start();
        while rest.starts_with('-') {
            let (option, after) = word(rest);
            rest = after;
            let mut take = |most: usize| {
                let mut taken = Vec::new();
                while taken.len() < most && word(rest).0.parse::<f64>().is_ok() {
                    let (number, after) = word(rest);
                    taken.push(number);
                    rest = after;
                }
                taken.join(" ")
            };
            match option {
                "-o" | "-s" => {
                    let given = take(3);
                    let ([u, v, _], found) = values::<3>(library, line, option, &given)?;
                    let missing = if option == "-s" { 1.0 } else { 0.0 };
                    let pair = [if found > 0 { u } else { missing }, if found > 1 { v } else { missing }];
                    *(if option == "-s" { &mut transform.scale } else { &mut transform.offset }) = pair;
                }
                "-t" => drop(take(3)),
                "-mm" => drop(take(2)),
                "-bm" | "-boost" | "-texres" => drop(take(1)),
                "-clamp" => {
                    let (value, after) = word(rest);
                    rest = after;
                    wrap = if value == "on" { Wrap::Clamp } else { Wrap::Repeat };
                }
                "-blendu" | "-blendv" | "-cc" | "-imfchan" | "-type" => rest = word(rest).1,
                _ => {
                    let why = format!("the option {} of a texture is unknown", shorten(option));
                    return Err(library.fault(&format!("line {line}"), why));
                }
            }
        }
        if rest.is_empty() {
            return Ok(None);
        }
        // The options are for OBJ's v, which runs up.
        transform.offset[1] = 1.0 - transform.scale[1] - transform.offset[1];
        let image = self.image(library, line, folder, rest);
        Ok(Some(TextureRef { image, set: 0, wrap: [wrap; 2], nearest: false, transform }))
    }

    /// Returns the index of an image, which is listed once for each file.
    fn image(&mut self, library: &File, line: usize, folder: &Path, name: &str) -> usize {
        let beside = folder.join(name);
        let beside = if has_root(name) { name.into() } else { beside.to_string_lossy() };
        if let Some(known) = self.images.get(beside.as_ref()) {
            return *known;
        }
        let image = match find(self.file, &beside) {
            Ok(path) => ImageSource::File(path),
            Err(refusal) => ImageSource::Refused {
                what: format!("{}: line {line}: {}", library.path.display(), refusal.why),
                fix: refusal.fix,
            },
        };
        let index = self.model.images.len();
        self.model.images.push(image);
        self.images.insert(beside.into_owned(), index);
        index
    }
}

/// Tells whether a path starts at a root or a drive.
fn has_root(name: &str) -> bool {
    name.starts_with(['/', '\\']) || name.get(1..2) == Some(":")
}

/// Splits a text after its first word.
fn word(text: &str) -> (&str, &str) {
    let (word, rest) = text.split_once([' ', '\t']).unwrap_or((text, ""));
    (word, rest.trim_start())
}

/// Reads up to `N` numbers of a line, at least one. Returns how many there are.
fn values<const N: usize>(library: &File, line: usize, key: &str, text: &str) -> Result<([f32; N], usize)> {
    match numbers::<N>(text) {
        Ok((_, 0)) => Err(library.fault(&format!("line {line}"), format!("{key}: a number is missing"))),
        Ok((values, found)) => Ok((values.map(|x| x as f32), found)),
        Err(word) => {
            let why = format!("{key}: {:?} is no finite number", shorten(word));
            Err(library.fault(&format!("line {line}"), why))
        }
    }
}
