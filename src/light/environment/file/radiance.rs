//! Radiance pictures (RGBE).

use std::fs::File;
use std::io::{BufReader, Seek, SeekFrom};
use std::path::Path;

use image::ImageDecoder;
use image::codecs::hdr::HdrDecoder;

use super::{FileMap, bad, check_size, checked, start_of};
use crate::light::environment::map::Map;
use crate::util::error::{Error, Result};

pub fn read(path: &Path, mut file: BufReader<File>, budget: u64) -> Result<FileMap> {
    let io = |e| Error::read(path, e);
    let start = start_of(path, &mut file)?;
    if !start.starts_with(b"#?RADIANCE") && !start.starts_with(b"#?RGBE") {
        return Err(bad(path, "it does not start with #?RADIANCE or #?RGBE"));
    }
    // The decoder does not limit the length of a header line, so the end of the header is checked here.
    if !start.windows(2).any(|pair| pair == b"\n\n") {
        return Err(bad(path, "its header has no end"));
    }
    file.seek(SeekFrom::Start(0)).map_err(io)?;
    let fault = |e: image::ImageError| match e {
        image::ImageError::IoError(e) if e.kind() != std::io::ErrorKind::UnexpectedEof => {
            Error::read(path, e)
        }
        other => bad(path, other),
    };
    let decoder = HdrDecoder::new_nonstrict(file).map_err(fault)?;
    let meta = decoder.metadata();
    let (width, height) = decoder.dimensions();
    check_size(path, width.into(), height.into(), 0, budget)?;
    let exposure = meta.exposure.unwrap_or(1.0);
    let (r, g, b) = meta.color_correction.unwrap_or((1.0, 1.0, 1.0));
    let divisors = [r * exposure, g * exposure, b * exposure];
    if !divisors.iter().all(|d| d.is_normal() && *d > 0.0) {
        return Err(bad(path, format!("its EXPOSURE and COLORCORR give the divisors {divisors:?}")));
    }
    let mut values = vec![0.0f32; width as usize * height as usize * 3];
    decoder.read_image(bytemuck::cast_slice_mut(&mut values)).map_err(fault)?;
    let texels = values
        .chunks_exact(3)
        .map(|t| [t[0] / divisors[0], t[1] / divisors[1], t[2] / divisors[2], 0.0])
        .collect();
    checked(path, Map { width, height, texels }, Vec::new())
}
