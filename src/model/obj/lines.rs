//! Lines of OBJ and MTL, and what they will take.

use std::borrow::Cow;

use super::super::{ModelMesh, ModelNode, Primitive};

/// Logical lines: those that end with a backslash go on in the next, comments and blank lines are skipped.
/// A line that is not UTF-8 keeps what is.
pub struct Lines<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Number of the last line that was read, from 1.
    line: usize,
}

impl<'a> Lines<'a> {
    pub fn new(bytes: &'a [u8]) -> Lines<'a> {
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        Lines { bytes, at: 0, line: 0 }
    }

    /// Bytes that were read.
    pub fn done(&self) -> usize {
        self.at
    }

    fn physical(&mut self) -> Option<&'a [u8]> {
        if self.at >= self.bytes.len() {
            return None;
        }
        let rest = &self.bytes[self.at..];
        let end = rest.iter().position(|byte| *byte == b'\n').unwrap_or(rest.len());
        self.at += end + 1;
        self.line += 1;
        Some(rest[..end].trim_ascii())
    }
}

impl<'a> Iterator for Lines<'a> {
    /// Number of the line, from 1, and its text.
    type Item = (usize, Cow<'a, str>);

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let first = self.physical()?;
            let number = self.line;
            if first.is_empty() || first.starts_with(b"#") {
                continue;
            }
            let Some(start) = first.strip_suffix(b"\\") else {
                return Some((number, String::from_utf8_lossy(first)));
            };
            let mut whole = start.to_vec();
            while let Some(more) = self.physical() {
                whole.push(b' ');
                match more.strip_suffix(b"\\") {
                    Some(more) => whole.extend(more),
                    None => {
                        whole.extend(more);
                        break;
                    }
                }
            }
            return Some((number, Cow::Owned(String::from_utf8_lossy(&whole).trim().to_owned())));
        }
    }
}

/// Reads the first `N` numbers of a text. Returns them, with zeros where there are fewer, and how many there
/// are.
///
/// # Errors
/// The word that is no finite number.
pub fn numbers<const N: usize>(text: &str) -> Result<([f64; N], usize), &str> {
    let mut values = [0.0; N];
    let mut found = 0;
    for (value, word) in values.iter_mut().zip(text.split_ascii_whitespace()) {
        *value = word.parse().ok().filter(|x: &f64| (*x as f32).is_finite()).ok_or(word)?;
        found += 1;
    }
    Ok((values, found))
}

/// Numbers of the things in a file, counted before any of them is read.
#[derive(Default)]
pub struct Counts {
    pub positions: usize,
    pub uvs: usize,
    pub normals: usize,
    /// Corners of faces.
    corners: u128,
    pub objects: usize,
    /// Lines that may begin a mesh, a primitive or a material.
    heads: u128,
}

impl Counts {
    pub fn of(bytes: &[u8]) -> Counts {
        let mut counts = Counts::default();
        // A face may go on in the next lines, and words there are counted too.
        let mut goes_on = false;
        for line in bytes.split(|byte| *byte == b'\n') {
            let line = line.strip_prefix(b"\xef\xbb\xbf").unwrap_or(line).trim_ascii();
            let end = line.iter().position(|byte| matches!(byte, b' ' | b'\t')).unwrap_or(line.len());
            match &line[..end] {
                b"v" => counts.positions += 1,
                b"vt" => counts.uvs += 1,
                b"vn" => counts.normals += 1,
                b"o" => {
                    counts.objects += 1;
                    counts.heads += 1;
                }
                b"g" | b"usemtl" | b"mtllib" => counts.heads += 1,
                _ => {}
            }
            if goes_on || line.starts_with(b"f") {
                counts.corners += line.split(u8::is_ascii_whitespace).count() as u128;
            }
            goes_on = line.ends_with(b"\\");
        }
        counts
    }

    /// Bytes that the file's content takes at most.
    pub fn bytes(&self) -> u128 {
        // The map of a part's vertices (48), the vertex (12 of the corner and 48 of its attributes), and a
        // triangle as a face and in the model.
        const CORNER: u128 = 48 + 12 + 48 + 20 + 12;
        const HEAD: u128 =
            (size_of::<ModelMesh>() + size_of::<ModelNode>() + size_of::<Primitive>() + 512) as u128;
        self.positions as u128 * 40
            + self.uvs as u128 * 8
            + self.normals as u128 * 12
            + self.corners * CORNER
            + self.heads * HEAD
    }
}
