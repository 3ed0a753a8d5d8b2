//! Name patterns for many files, such as `out/fall.####.exr`, `fall.%04d.png` or `h{h}.png`.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use crate::output::frame::Format;
use crate::util::error::{Error, Result};

/// Most digits that a placeholder may ask for. File systems allow names of 255 bytes.
const MOST_DIGITS: usize = 200;

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
    /// The frame's number, padded with zeros to at least this many characters.
    Frame(usize),
    /// The value of the sweep with this index.
    Sweep(usize),
}

/// Notation of the frame's number in a file name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Notation {
    /// `####`: one digit for each.
    Hashes,
    /// `%04d` or `%d`, as in C, FFmpeg and Nuke.
    Percent,
    /// `$F4` or `$F`, as in Houdini.
    Dollar,
    /// `@@@@`: one digit for each, at least two, as in Houdini's and RV's file sequences.
    Ats,
}

impl Notation {
    /// All notations. The first one that a name contains counts; the others are text in it.
    const ALL: [Notation; 4] = [Notation::Hashes, Notation::Percent, Notation::Dollar, Notation::Ats];

    /// Parses a placeholder at the start of a text. Returns its digits and its length in bytes.
    fn parse(self, text: &str) -> Option<(usize, usize)> {
        let run = |c: char, least: usize| {
            let count = text.len() - text.trim_start_matches(c).len();
            (count >= least).then_some((count, count))
        };
        let digits = |text: &str| text.len() - text.trim_start_matches(|c: char| c.is_ascii_digit()).len();
        let found = match self {
            Notation::Hashes => run('#', 1),
            Notation::Ats => run('@', 2),
            Notation::Percent => {
                let rest = text.strip_prefix('%')?;
                let count = digits(rest);
                let wide = count == 0 || rest.starts_with('0');
                (wide && rest[count..].starts_with('d'))
                    .then(|| (rest[..count].parse().unwrap_or(1), count + 2))
            }
            Notation::Dollar => {
                let rest = text.strip_prefix("$F")?;
                let count = digits(rest);
                let ends = !rest[count..].starts_with(|c: char| c.is_alphanumeric());
                (count > 0 || ends).then(|| (rest[..count].parse().unwrap_or(1), count + 2))
            }
        };
        found.map(|(digits, bytes)| (digits.clamp(1, MOST_DIGITS), bytes))
    }

    /// Returns the notation of a file name, if it has one.
    fn of(name: &str) -> Option<Notation> {
        let occurs =
            |notation: &Notation| name.char_indices().any(|(i, _)| notation.parse(&name[i..]).is_some());
        Notation::ALL.into_iter().find(occurs)
    }
}

impl Pattern {
    /// Parses a path. In its file name, `####`, `%04d`, `$F4` or `@@@@` stands for the frame's number and, if
    /// there are sweeps, `{NAME}` for a sweep's value. `names` lists by sweep every name it may have.
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

    /// The format of its files by their extension; `None` if they are no pictures.
    pub fn format(&self) -> Option<Format> {
        Format::of(&self.given)
    }

    /// Whether its files are EXR files, which hold layers.
    pub fn is_exr(&self) -> bool {
        self.format() == Some(Format::Exr)
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
    pub fn at(&self, frame: i32, values: &[String]) -> PathBuf {
        let mut name = OsString::new();
        for part in &self.parts {
            match part {
                Part::Text(text) => name.push(text),
                // As in C, the sign of a frame before 0 counts among the characters.
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
    let notation = Notation::of(text);
    let mut rest = text;
    let mut literal = String::new();
    let flush = |literal: &mut String, parts: &mut Vec<Part>| {
        if !literal.is_empty() {
            parts.push(Part::Text(std::mem::take(literal).into()));
        }
    };
    while let Some(c) = rest.chars().next() {
        if let Some((digits, bytes)) = notation.and_then(|notation| notation.parse(rest)) {
            flush(&mut literal, parts);
            parts.push(Part::Frame(digits));
            rest = &rest[bytes..];
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
