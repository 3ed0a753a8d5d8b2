//! Name patterns for many files, such as `out/fall.####.exr` or `h{h}.png`.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use crate::util::error::{Error, Result};

/// A file name with placeholders for the frame's number and the values of sweeps.
#[derive(Clone, Debug, PartialEq)]
pub struct Pattern {
    given: PathBuf,
    folder: PathBuf,
    parts: Vec<Part>,
}

#[derive(Clone, Debug, PartialEq)]
enum Part {
    Text(OsString),
    /// The frame's number, padded with zeros to at least this many digits.
    Frame(usize),
    /// The value of the sweep with this index.
    Sweep(usize),
}

impl Pattern {
    /// Parses a path. In its file name, `####` stands for the frame's number and, if there are sweeps,
    /// `{NAME}` for a sweep's value. `names` lists by sweep every name it may have.
    ///
    /// # Errors
    /// [`Error::Usage`] if the path has no file name, or names a sweep that does not exist.
    pub fn new(path: &Path, names: &[Vec<String>]) -> Result<Pattern> {
        let Some(file) = path.file_name() else {
            return Err(Error::Usage(format!("-o {}: it has no file name", path.display())));
        };
        let mut parts = Vec::new();
        match file.to_str() {
            // A name that is not UTF-8 has no placeholders.
            None => parts.push(Part::Text(file.to_owned())),
            Some(text) => read(text, names, &mut parts)
                .map_err(|why| Error::Usage(format!("-o {}: {why}", path.display())))?,
        }
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        Ok(Pattern { given: path.to_owned(), folder, parts })
    }

    /// The pattern as the user wrote it.
    pub fn given(&self) -> &Path {
        &self.given
    }

    /// Whether its files are EXR files, which hold layers.
    pub fn is_exr(&self) -> bool {
        self.given.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"))
    }

    /// Whether the name contains the frame's number.
    pub fn has_frame(&self) -> bool {
        self.parts.iter().any(|part| matches!(part, Part::Frame(_)))
    }

    /// Whether the name contains the value of the sweep with this index.
    pub fn has_sweep(&self, sweep: usize) -> bool {
        self.parts.contains(&Part::Sweep(sweep))
    }

    /// Path of the file of a frame at the sweeps' `values`.
    pub fn at(&self, frame: u32, values: &[String]) -> PathBuf {
        let mut name = OsString::new();
        for part in &self.parts {
            match part {
                Part::Text(text) => name.push(text),
                Part::Frame(digits) => name.push(format!("{frame:0digits$}")),
                Part::Sweep(sweep) => name.push(safe(&values[*sweep])),
            }
        }
        self.folder.join(name)
    }
}

/// Replaces or removes characters of a value that file names of some system cannot hold, or that need
/// quoting.
fn safe(value: &str) -> String {
    value.replace(|c: char| c.is_control() || r#"/\:*?"<>|"#.contains(c), "_").replace([' ', '[', ']'], "")
}

/// Splits a file name into its parts.
fn read(text: &str, names: &[Vec<String>], parts: &mut Vec<Part>) -> std::result::Result<(), String> {
    let mut rest = text;
    let mut literal = String::new();
    let flush = |literal: &mut String, parts: &mut Vec<Part>| {
        if !literal.is_empty() {
            parts.push(Part::Text(std::mem::take(literal).into()));
        }
    };
    while let Some(c) = rest.chars().next() {
        if c == '#' {
            let digits = rest.len() - rest.trim_start_matches('#').len();
            flush(&mut literal, parts);
            parts.push(Part::Frame(digits));
            rest = &rest[digits..];
        } else if let Some((name, after)) = rest.strip_prefix('{').and_then(|r| r.split_once('}'))
            && !names.is_empty()
        {
            let known = || names.iter().map(|n| format!("{{{}}}", n[0])).collect::<Vec<_>>().join(", ");
            let sweep = names.iter().position(|all| all.iter().any(|n| n == name));
            let sweep =
                sweep.ok_or_else(|| format!("there is no --sweep for {{{name}}}; there is {}", known()))?;
            flush(&mut literal, parts);
            parts.push(Part::Sweep(sweep));
            rest = after;
        } else {
            literal.push(c);
            rest = &rest[c.len_utf8()..];
        }
    }
    flush(&mut literal, parts);
    Ok(())
}
