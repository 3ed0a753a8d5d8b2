//! Radiance pictures: RGBE and XYZE in the format's eight orientations.
//!
//! The header is read here. The decoder sees the pixels behind a header of its own kind, and its lines are
//! put where the picture's orientation wants them.

use std::fs::File;
use std::io::{BufReader, Cursor, ErrorKind, Read, Seek, SeekFrom};
use std::path::Path;

use image::ImageDecoder;
use image::codecs::hdr::HdrDecoder;

use super::{DAMAGED, FileMap, bad, bad_with, check_size, checked, start_of};
use crate::light::environment::map::Map;
use crate::util::colour::{Curve, Primaries, Space, outside};
use crate::util::error::{Error, Result};

/// First bytes of an OpenEXR file.
const OPEN_EXR: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];
/// Luminance of a unit of radiance, lm/W: XYZE holds cd/m².
const LUMENS_PER_WATT: f32 = 179.0;

/// Header of a file: the lines before the pixels.
struct Header {
    /// Length, bytes.
    length: u64,
    divisors: [f32; 3],
    xyz: bool,
    primaries: Option<Primaries>,
    order: Order,
}

/// Order of the texels in the file.
struct Order {
    /// Whether a line of the file is a row. It is a column otherwise.
    rows: bool,
    /// Number of lines.
    lines: u32,
    /// Number of texels in a line.
    length: u32,
    leftwards: bool,
    upwards: bool,
}

impl Order {
    /// Reads a line such as `-Y 512 +X 1024`.
    fn parse(line: &str) -> Option<Order> {
        let words: Vec<&str> = line.split_whitespace().collect();
        let [first, lines, second, length] = words[..] else { return None };
        let rows = match (first, second) {
            ("-Y" | "+Y", "-X" | "+X") => true,
            ("-X" | "+X", "-Y" | "+Y") => false,
            _ => return None,
        };
        let has = |axis| first == axis || second == axis;
        let (lines, length) = (lines.parse().ok()?, length.parse().ok()?);
        Some(Order { rows, lines, length, leftwards: has("-X"), upwards: has("+Y") })
    }

    /// Width and height of the map.
    fn size(&self) -> [u32; 2] {
        if self.rows { [self.length, self.lines] } else { [self.lines, self.length] }
    }

    /// Index in the map of a texel of the file.
    fn index(&self, i: usize) -> usize {
        let (line, at) = (i / self.length as usize, i % self.length as usize);
        let [width, height] = self.size().map(|n| n as usize);
        let (x, y) = if self.rows { (at, line) } else { (line, at) };
        let x = if self.leftwards { width - 1 - x } else { x };
        let y = if self.upwards { height - 1 - y } else { y };
        y * width + x
    }
}

impl Header {
    /// Reads a header. Lines end with LF or CR LF. The error says what is wrong.
    fn parse(start: &[u8]) -> std::result::Result<Header, String> {
        let mut length = 0;
        let mut lines = start.split_inclusive(|byte| *byte == b'\n').map(|line| {
            length += line.len() as u64;
            let line = line.strip_suffix(b"\n").ok_or("its header has no end")?;
            Ok::<_, String>(String::from_utf8_lossy(line.strip_suffix(b"\r").unwrap_or(line)))
        });
        let (mut divisors, mut xyz, mut primaries) = ([1.0f32; 3], false, None);
        loop {
            let line = lines.next().ok_or("its header has no end")??;
            if line.is_empty() {
                break;
            }
            let Some((key, value)) = line.split_once('=').filter(|_| !line.starts_with('#')) else {
                continue;
            };
            let numbers = || value.split_whitespace().filter_map(|word| word.parse::<f64>().ok());
            match key.trim() {
                "FORMAT" => match value.trim() {
                    "32-bit_rle_rgbe" => xyz = false,
                    "32-bit_rle_xyze" => xyz = true,
                    other => return Err(format!("its FORMAT is {other:.40}, not 32-bit_rle_rgbe or _xyze")),
                },
                "EXPOSURE" => {
                    let factor = numbers().next().unwrap_or(1.0) as f32;
                    divisors.iter_mut().for_each(|d| *d *= factor);
                }
                "COLORCORR" => divisors.iter_mut().zip(numbers()).for_each(|(d, factor)| *d *= factor as f32),
                "PRIMARIES" => primaries = Primaries::try_from(numbers().collect::<Vec<_>>()).ok(),
                _ => {}
            }
        }
        let line = lines.next().ok_or("its header has no end")??;
        let order = Order::parse(&line)
            .ok_or_else(|| format!("its size is \"{line:.60}\", not such as \"-Y 512 +X 1024\""))?;
        if !divisors.iter().all(|d| d.is_normal() && *d > 0.0) {
            return Err(format!("its EXPOSURE and COLORCORR give the divisors {divisors:?}"));
        }
        // Some programs write zeros.
        let primaries = primaries.filter(|p| p.iter().any(|x| *x != 0.0));
        Ok(Header { length, divisors, xyz, primaries, order })
    }
}

pub fn read(path: &Path, mut file: BufReader<File>, budget: u64) -> Result<FileMap> {
    let io = |e| Error::read(path, e);
    let start = start_of(path, &mut file)?;
    if !start.starts_with(b"#?RADIANCE") && !start.starts_with(b"#?RGBE") {
        let fix = match start.starts_with(&OPEN_EXR) {
            true => "it is an OpenEXR file: name it .exr",
            false => "export the map again, as Radiance (.hdr) or OpenEXR (.exr)",
        };
        return Err(bad_with(path, "it does not start with #?RADIANCE or #?RGBE", fix));
    }
    let Header { length, mut divisors, xyz, primaries, order } =
        Header::parse(&start).map_err(|why| bad(path, why))?;
    drop(start);
    file.seek(SeekFrom::Start(length)).map_err(io)?;
    let fault = |e: image::ImageError| match e {
        image::ImageError::IoError(e) if e.kind() != ErrorKind::UnexpectedEof => Error::read(path, e),
        other => bad_with(path, other, DAMAGED),
    };
    let head = format!("FORMAT=32-bit_rle_rgbe\n\n-Y {} +X {}\n", order.lines, order.length);
    let decoder = HdrDecoder::new_nonstrict(Cursor::new(head).chain(file)).map_err(fault)?;
    let [width, height] = order.size();
    check_size(path, width.into(), height.into(), 0, budget)?;
    let mut values = vec![0.0f32; width as usize * height as usize * 3];
    decoder.read_image(bytemuck::cast_slice_mut(&mut values)).map_err(fault)?;

    let mut notes = Vec::new();
    let space = if xyz {
        divisors = divisors.map(|d| d * LUMENS_PER_WATT);
        Space::radiance_xyz()
    } else {
        let space = primaries.as_ref().map(|p| Space::new(Curve::Linear, p));
        if matches!(space, Some(None)) {
            notes.push("its PRIMARIES span no colours: they are taken for those of Rec. 709".into());
        }
        space.flatten()
    };
    let mut texels = vec![[0.0; 4]; width as usize * height as usize];
    for (i, t) in values.chunks_exact(3).enumerate() {
        texels[order.index(i)] = [t[0] / divisors[0], t[1] / divisors[1], t[2] / divisors[2], 0.0];
    }
    drop(values);
    let clipped = space.map_or(0, |space| space.convert(&mut texels));
    notes.extend(outside(clipped));
    checked(path, Map { width, height, texels }, notes)
}
