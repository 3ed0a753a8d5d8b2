//! OpenEXR files as environment maps; [`crate::util::open_exr`] reads them.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use exr::prelude::attribute::EnvironmentMap;

use super::{DAMAGED, FileMap, bad, bad_with, check_size, checked, unreadable};
use crate::light::environment::map::Map;
use crate::util::error::{Error, Result};
use crate::util::open_exr::{Fault, OpenExr};

/// Value that an infinite one becomes: the largest that a half can hold.
const HALF_MAX: f32 = 65504.0;

pub fn read(path: &Path, file: BufReader<File>, budget: u64) -> Result<FileMap> {
    let fault = |fault: Fault| -> Error {
        match fault {
            Fault::Bad { why, fix: Some(fix) } => bad_with(path, why, fix),
            // The library says so of contents that contradict themselves.
            Fault::Bad { why, fix: None } if why.starts_with("invalid: ") => bad_with(path, why, DAMAGED),
            Fault::Bad { why, fix: None } => bad(path, why),
            Fault::Io(e) => unreadable(path, e),
        }
    };
    let colours = OpenExr::open(file).and_then(OpenExr::colours).map_err(fault)?;
    if colours.header().own_attributes.environment_map == Some(EnvironmentMap::Cube) {
        return Err(bad_with(
            path,
            "its envmap attribute says that it is a cube",
            "make it equirectangular: exrenvmap -latlong map.exr new.exr",
        ));
    }
    let [display, _] = colours.windows().map_err(fault)?;
    let (width, height) = (display.size.0, display.size.1);
    check_size(path, width as u64, height as u64, colours.block_bytes(), budget)?;
    let mut pixels = colours.read(display).map_err(fault)?;
    let infinite = clamp_infinite(&mut pixels.values);
    pixels.notes.extend(infinite);
    pixels.to_rec709();
    let map = Map { width: width as u32, height: height as u32, texels: pixels.values };
    checked(path, map, pixels.notes)
}

/// Replaces infinite values, which a half makes of a bright sun, by the largest that it can hold.
fn clamp_infinite(texels: &mut [[f32; 4]]) -> Option<String> {
    let mut count = 0u64;
    for value in texels.iter_mut().flatten().filter(|value| **value == f32::INFINITY) {
        *value = HALF_MAX;
        count += 1;
    }
    (count > 0).then(|| format!("{count} infinite values were replaced by {HALF_MAX}"))
}
