//! Name patterns for many files, such as `out/fall.####.exr`, `fall.%04d.png` or `h{h}.png`.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use crate::output::frame::{Format, check_regular};
use crate::output::movie::MovieKind;
use crate::util::error::{Error, Result};
use crate::util::numbering::{Notation, padded};

/// The advice to number files.
pub(crate) const NUMBER_IT: &str = "put #### where the frame's number goes, such as fall.####.png";

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

impl Pattern {
    /// Parses a path. In its file name, `####`, `%04d`, `$F4` or `@@@@` stands for the frame's number and, if
    /// there are sweeps, `{NAME}` for a sweep's value. `names` lists by sweep every name it may have.
    ///
    /// # Errors
    /// [`Error::Usage`] if the path has no file name, names a sweep that does not exist, or has a folder with
    /// the frame's number.
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
        let numbered = |part: &&str| Notation::of(part).is_some();
        let mut folders = folder.components().filter_map(|part| part.as_os_str().to_str());
        if let Some(part) = folders.find(numbered).filter(|_| !folder.exists()) {
            return Err(Error::Usage(format!(
                "-o {}: the frame's number stands in a file's name, not in that of the folder {part}; \
                 {NUMBER_IT}",
                path.display()
            )));
        }
        Ok(Pattern { given: path.to_owned(), folder, parts })
    }

    /// Returns the path of a still: `path` with the number of its frame, where the name has a place for it.
    ///
    /// # Errors
    /// Errors of [`Pattern::check_placeholders`].
    pub fn numbered(path: &Path, frame: i32) -> Result<PathBuf> {
        if path.file_name().is_none() {
            // It is refused where it is opened.
            return Ok(path.to_owned());
        }
        let pattern = Pattern::new(path, &[])?;
        pattern.check_placeholders()?;
        Ok(if pattern.has_frame() { pattern.at(frame, &[]) } else { path.to_owned() })
    }

    /// Refuses a name without the frame's number that has something in its place: a placeholder of another
    /// program, or of a sweep that is not given.
    ///
    /// # Errors
    /// [`Error::Usage`] for such a name.
    pub fn check_placeholders(&self) -> Result<()> {
        if self.has_frame() {
            return Ok(());
        }
        let texts = self.parts.iter().filter_map(|part| match part {
            Part::Text(text) => text.to_str(),
            _ => None,
        });
        let why = texts.into_iter().find_map(slip).map(|slip| match slip.strip_prefix('{') {
            Some(name) => format!(
                "{slip} stands for a value of taki batch --sweep {}=…, which is not given",
                name.trim_end_matches('}')
            ),
            None => format!("{slip} does not stand for the frame's number"),
        });
        let emptied = || {
            let stem = self.given.file_stem()?.to_str()?.ends_with('.');
            stem.then(|| "nothing stands between its two dots, as where a shell replaced \"$F4\"".into())
        };
        match why.or_else(emptied) {
            Some(why) => Err(Error::Usage(format!("-o {}: {why}; {NUMBER_IT}", self.given.display()))),
            None => Ok(()),
        }
    }

    /// Refuses a path whose ending is that of no picture and no movie.
    ///
    /// # Errors
    /// [`Error::Usage`] for such an ending, [`Error::CannotCreate`] for a device.
    pub fn check_kind(path: &Path) -> Result<()> {
        if Format::of(path).is_some() || MovieKind::of(path).is_some() {
            return Ok(());
        }
        check_regular(path)?;
        let [others @ .., last] = MovieKind::ALL.map(|kind| format!(".{}", kind.extension()));
        Err(Error::Usage(format!(
            "-o {}: unknown kind of file; pictures are {}, movies {} or {last}",
            path.display(),
            Format::EXTENSIONS,
            others.join(", ")
        )))
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
                Part::Frame(digits) => name.push(padded(frame.into(), *digits)),
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

/// Returns the part of a name that looks like a placeholder but is none.
fn slip(text: &str) -> Option<&str> {
    text.char_indices().find_map(|(at, first)| {
        let whole = &text[at..];
        let rest = &whole[first.len_utf8()..];
        let until = |close: char| rest.find(close).map(|end| &whole[..=end + close.len_utf8()]);
        match first {
            '{' => until('}'),
            '<' => until('>'),
            // A range of frames, as other programs list it; a single number is part of many names.
            '[' => until(']').filter(|part| {
                let inner = &part[1..part.len() - 1];
                inner.starts_with(|c: char| c.is_ascii_digit())
                    && inner.contains(['-', ':', ','])
                    && inner.chars().all(|c| c.is_ascii_digit() || "-:,".contains(c))
            }),
            '%' => {
                let digits = rest.len() - rest.trim_start_matches(|c: char| c.is_ascii_digit()).len();
                let mut after = rest[digits..].chars();
                let number = after.next().is_some_and(|c| "dDius".contains(c));
                let ends = digits > 0 || !after.next().is_some_and(char::is_alphanumeric);
                // Digits after a zero pad a number, whatever follows.
                let pads = digits > 1 && rest.starts_with('0');
                (number && ends).then(|| &whole[..digits + 2]).or(pads.then(|| &whole[..digits + 1]))
            }
            '$' if rest.starts_with('{') => rest.find('}').map(|end| &whole[..=end + 1]),
            '$' => {
                let end = rest.find(|c: char| !c.is_ascii_alphanumeric()).unwrap_or(rest.len());
                let word = rest[..end].to_ascii_lowercase();
                let digits = word.trim_start_matches('f');
                let frame = digits.len() < word.len() && digits.chars().all(|c| c.is_ascii_digit());
                (frame || word == "frame").then(|| &whole[..1 + end])
            }
            '*' => Some(&whole[..1]),
            '?' if rest.starts_with('?') => Some(&whole[..whole.len() - rest.trim_start_matches('?').len()]),
            _ => None,
        }
    })
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
            let sweep = sweep.ok_or_else(|| {
                let number = "the frame's number is ####";
                format!("there is no --sweep for {{{name}}}; there is {}, and {number}", known())
            })?;
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
