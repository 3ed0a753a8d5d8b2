//! Curves of hair in files of [USD](https://openusd.org): binary (`.usdc`), text (`.usda`), either (`.usd`),
//! and packed (`.usdz`).
//!
//! The crate `openusd` decodes a single file. What it must not be given is refused before: its checks do not
//! suffice for files that are damaged. Composition is left out, so nothing outside the file is read: layers,
//! references, payloads, and variants are told and not followed.

mod bytes;
mod curves;
mod layer;
mod nurbs;
mod prim;
mod sizes;
mod stage;
mod text;
mod transform;
mod values;

use std::io::{Cursor, Read};
use std::path::Path;

use openusd::sdf::Value;

use super::budget::Budget;
use super::strand_file::StrandFile;
use super::strands::Strands;
use super::{paths, strand_file};
use crate::util::error::{Error, Result};
use layer::Layer;
use prim::{Curves, Told};

/// Metres in the unit of a file that does not say it.
const CENTIMETRE: f64 = 0.01;
/// Advice on a file that is broken.
const AGAIN: &str = "export the curves again, or check the file with `usdchecker`";
/// Advice on a file that is too large.
const SMALLER: &str = "export fewer curves, as .usdc, or raise --memory";

/// A file that is read, and what it may take.
struct File<'a> {
    path: &'a Path,
    budget: Budget,
}

impl File<'_> {
    fn name(&self) -> String {
        self.path.display().to_string()
    }

    /// Words about what takes the memory.
    fn what(&self) -> String {
        format!("the curves of {}", self.name())
    }

    fn broken(&self, what: impl std::fmt::Display) -> Error {
        Error::input(format!("{}: {what}", self.name()), AGAIN)
    }

    fn take(&mut self, bytes: u128) -> Result<()> {
        let path = self.path;
        self.budget.take(bytes, || format!("the curves of {}", path.display()))
    }
}

/// Reads the curves of a file within `budget` bytes. `time` chooses among the samples of an attribute: the
/// last one that is not behind it. Without a time, or before the first, it is the first.
///
/// # Errors
/// [`Error::Input`] for a file of another kind, one that is broken, and one without curves; [`Error::Io`]
/// where it cannot be read; [`Error::Memory`] for one that is too large.
pub(super) fn read(path: &Path, time: Option<f64>, budget: u64) -> Result<StrandFile> {
    strand_file::check_is_file(path, "give a .usdc, .usda, .usd or .usdz with curves")?;
    let mut file = File { path, budget: Budget::new(budget, SMALLER) };
    let bytes = paths::read_whole(path, &mut file.budget)?;
    let mut layer = layer(bytes, &mut file, true)?;
    let (shown, left_out) = stage::walk(&mut layer, time, &mut file)?;
    let mut all = Vec::new();
    for prim in &shown {
        all.extend(Curves::read(&mut layer, prim, time, &mut file)?);
    }
    let mut notes = left_out.notes();
    let points = || all.iter().flat_map(|curves| &curves.points);
    let Some(first) = points().next() else {
        let why = if notes.is_empty() { String::new() } else { format!(" ({})", notes.join("; ")) };
        return Err(Error::input(
            format!("{}: it has no curves{why}", file.name()),
            "export hair as curves: BasisCurves or NurbsCurves",
        ));
    };
    let [low, high] = points().fold([*first; 2], |[low, high], p| [low.min(*p), high.max(*p)]);
    let deviation = curves::DEVIATION * (high - low).max_element();
    let (mut strands, mut told) = (Strands::default(), Told::default());
    let told_in = File { path, budget: Budget::new(u64::MAX, SMALLER) };
    for curves in all {
        curves.strands(deviation, &mut told, &told_in, |strand| {
            // Vectors double when they grow.
            file.take(2 * (16 * strand.len() as u128 + 4))?;
            if strands.points.len() + strand.len() > u32::MAX as usize {
                return Err(file.broken("its curves have more than 4294967295 points"));
            }
            strands.push(strand);
            Ok(())
        })?;
    }
    if strands.count() == 0 {
        return Err(file.broken(format!("its {} curves have too few points", told.too_short)));
    }
    if told.too_short > 0 {
        notes.push(format!("{} curves have too few points, and are left out", told.too_short));
    }
    if told.uneven > 0 {
        notes.push(format!(
            "{} Bézier curves have points behind their last segment, which are left out: there are 3n + 1 \
             points in a curve, and 3n in a periodic one",
            told.uneven
        ));
    }
    if told.without_width > 0 && told.without_width < strands.count() {
        notes.push(format!("{} curves have no widths, and count as thin as nothing", told.without_width));
    }
    let unit = layer.field("/", "metersPerUnit", &mut file)?.as_deref().and_then(transform::number);
    if unit.is_none() {
        notes.push("it does not say metersPerUnit, so its unit is a centimetre, as USD has it".into());
    }
    let unit = unit.unwrap_or(CENTIMETRE);
    if !(unit.is_finite() && unit > 0.0) {
        return Err(file.broken(format!("metersPerUnit = {unit} is no length")));
    }
    let is_z_up = match layer.field("/", "upAxis", &mut file)?.as_deref() {
        Some(Value::Token(axis)) => axis.as_str() == "Z",
        _ => false,
    };
    Ok(StrandFile { strands, unit: Some(unit), is_z_up: Some(is_z_up), notes })
}

/// Reads the content of a file, which decides its kind. Only the file itself may be a package.
fn layer(bytes: Vec<u8>, file: &mut File, is_outside: bool) -> Result<Layer> {
    if bytes.starts_with(sizes::MAGIC) {
        return Layer::of_crate(bytes, file);
    }
    if bytes.starts_with(b"#usda ") {
        return Layer::of_text(bytes, file);
    }
    if is_outside && bytes.starts_with(b"PK\x03\x04") {
        return layer(unpacked(bytes, file)?, file, false);
    }
    Err(Error::input(
        format!("{}: it is no USD: it begins neither with PXR-USDC nor with #usda", file.name()),
        "export the curves as .usdc, .usda or .usdz",
    ))
}

/// First layer of a package: its first file, as USD demands.
fn unpacked(bytes: Vec<u8>, file: &mut File) -> Result<Vec<u8>> {
    let fault = |file: &File, what: &dyn std::fmt::Display| file.broken(format!("the package: {what}"));
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).map_err(|error| fault(file, &error))?;
    let first = archive.by_index(0).map_err(|error| fault(file, &error))?;
    let ends = [".usd", ".usdc", ".usda"];
    let is_layer =
        first.name().is_ok_and(|name| ends.iter().any(|end| name.to_ascii_lowercase().ends_with(end)));
    if !is_layer || first.compression() != zip::CompressionMethod::Stored {
        return Err(fault(file, &"its first file is no layer of USD that is stored as it is"));
    }
    let length = first.size();
    file.take(u128::from(length))?;
    let mut content = Vec::new();
    first.take(length).read_to_end(&mut content).map_err(|error| fault(file, &error))?;
    Ok(content)
}
