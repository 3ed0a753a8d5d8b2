//! `taki compare`: measures how much two pictures differ.

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;
use serde_json::json;

use super::terminal::say;
use super::{crop, developed, window};
use crate::job::check_replaced;
use crate::output::frame::streaks::{Flicker, Streaks, bands, decoded, luminance, streaks};
use crate::output::frame::{
    Difference, Encoding, Format, Head, Output, ReadPicture, Tolerance, encode, read_exr, read_picture,
};
use crate::picture::resolve::srgb;
use crate::util::error::{Error, Result};
use crate::util::window::Window;

#[derive(Args)]
pub struct CompareArgs {
    /// Two pictures of the same size. PNG, JPEG, TIFF and WebP files are compared by encoded values (0 to 1),
    /// EXR files by linear radiance. With --eye, any number of pictures, in order of time.
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Relative tolerance, as a share of the larger value. Two values count as equal if they differ by at
    /// most the relative plus the absolute tolerance.
    #[arg(long, value_name = "X", default_value_t = 1e-3)]
    relative: f32,
    /// Absolute tolerance, in the picture's values. Default: 1e-4 for .exr, 2/255 for the others.
    #[arg(long, value_name = "X")]
    absolute: Option<f32>,
    /// Share of the pixels that may lie outside the tolerances. If more do, taki exits with code 1.
    #[arg(long, value_name = "X", default_value_t = 1e-3)]
    share: f64,
    /// Largest root mean square error. If it is exceeded, taki exits with code 1.
    #[arg(long, value_name = "X")]
    rmse: Option<f64>,
    /// Writes a picture (.png, .jpg, .tif or .webp) of the absolute difference, scaled so that the largest
    /// difference is white.
    #[arg(long, value_name = "FILE")]
    difference: Option<PathBuf>,
    /// Replaces an existing file of --difference even if it is no picture.
    #[arg(long, requires = "difference")]
    overwrite: bool,
    /// Instead of comparing, measures how the pictures look to the eye. Streaks: the mean difference of
    /// luminance between horizontal neighbours, divided by that between vertical neighbours, for water that
    /// flows down the picture. Flicker: of three pictures or more, how much the luminance flickers in time.
    #[arg(long, conflicts_with_all = ["relative", "absolute", "share", "rmse", "difference"])]
    eye: bool,
    /// Measures only this part of the pictures: column and row of its top left pixel, width and height.
    #[arg(long, value_name = "X,Y,W,H", value_parser = crop, requires = "eye")]
    region: Option<[u32; 4]>,
    /// Also prints the streaks of N horizontal bands, from the top of the region to its bottom.
    #[arg(long, value_name = "N", default_value_t = 1, requires = "eye")]
    bands: u32,
    /// Prints the figures as one JSON object on stdout.
    #[arg(long)]
    json: bool,
}

/// Width, height, and R, G, B of each pixel.
type Picture = (u32, u32, Vec<[f32; 3]>);

pub fn run(args: &CompareArgs) -> Result<()> {
    if args.eye {
        return eye(args);
    }
    let [path_a, path_b] = &args.files[..] else {
        let what = format!("{} pictures given; compare two, or use --eye for any number", args.files.len());
        return Err(Error::Usage(what));
    };
    if let Some(path) = &args.difference {
        developed("--difference", path)?;
        if !args.overwrite {
            check_replaced(path)?;
        }
    }
    let (width, height, a) = read(path_a)?;
    let (other_width, other_height, b) = read(path_b)?;
    if (width, height) != (other_width, other_height) {
        return Err(Error::Comparison(format!(
            "the pictures differ in size: {width}×{height} and {other_width}×{other_height}; render both at \
             the same size"
        )));
    }
    one_kind(&args.files)?;
    let absolute = args.absolute.unwrap_or(if is_exr(path_a) { 1e-4 } else { 2.0 / 255.0 });
    let d = Difference::new(width, &a, &b, Tolerance { relative: args.relative, absolute });
    if let Some(path) = &args.difference {
        let format = developed("--difference", path)?;
        let head = Head { format, encoding: Encoding::DISPLAY, size: [width, height], texts: Vec::new() };
        let bytes = encode(&head, difference_picture(&a, &b, d.max)).map_err(|e| Error::write(path, e))?;
        Output::create(path)?.finish_with(&bytes)?;
    }
    let share = d.share_outside();
    if args.json {
        say(&json!({"figures": d, "share_outside": share}).to_string())?;
    } else {
        let [x, y] = d.worst;
        say(&format!("rmse {:.6}  mean {:.6}  max {:.6} at ({x}, {y})", d.rmse, d.mean, d.max))?;
        say(&format!("{} of {} pixels outside the tolerance ({:.4} %)", d.outside, d.pixels, share * 100.0))?;
    }
    if share > args.share {
        return Err(Error::Comparison(format!(
            "{share:.6} of the pixels lie outside the tolerance; --share allows {}",
            args.share
        )));
    }
    match args.rmse {
        Some(most) if d.rmse > most || most.is_nan() => Err(Error::Comparison(format!(
            "the root mean square error is {:.6}; --rmse allows {most}",
            d.rmse
        ))),
        _ => Ok(()),
    }
}

/// Prints how the pictures look to the eye: streaks and flicker.
fn eye(args: &CompareArgs) -> Result<()> {
    one_kind(&args.files)?;
    let mut first: Option<([u32; 2], Window)> = None;
    let mut flicker = Flicker::default();
    let mut pictures = Vec::new();
    for path in &args.files {
        let (width, height, pixels) = read(path)?;
        let size = [width, height];
        let (first_size, part) = match first {
            Some(first) => first,
            None => *first.insert((size, part(args, size)?)),
        };
        if first_size != size {
            return Err(Error::Comparison(format!(
                "{} has {width}×{height} pixels, but {} has {}×{}; render them at the same size",
                path.display(),
                args.files[0].display(),
                first_size[0],
                first_size[1]
            )));
        }
        let linear = |p: &[f32; 3]| luminance(if is_exr(path) { *p } else { p.map(decoded) });
        let luminances: Vec<f32> = pixels.iter().map(linear).collect();
        let streaks_in = |part| streaks(&luminances, width as usize, part);
        let in_bands: Vec<Streaks> = match args.bands {
            1 => Vec::new(),
            n => bands(part, n).into_iter().map(streaks_in).collect(),
        };
        pictures.push(EyeFigures {
            file: path.display().to_string(),
            streaks: streaks_in(part),
            bands: in_bands,
        });
        let rows = (part.y..part.bottom()).flat_map(|y| {
            let row = y as usize * width as usize;
            luminances[row + part.x as usize..row + part.right() as usize].iter().copied()
        });
        flicker.push(rows.collect());
    }
    if args.json {
        let (mean, flicker) = (flicker.mean(), flicker.share());
        say(&json!({"pictures": pictures, "mean_luminance": mean, "flicker": flicker}).to_string())?;
        return Ok(());
    }
    let ratio = |s: &Streaks| s.ratio.map_or("–".into(), |ratio| format!("{ratio:.4}"));
    for EyeFigures { file, streaks, bands } in &pictures {
        let down: Vec<String> = bands.iter().map(ratio).collect();
        let down = if down.is_empty() { String::new() } else { format!("  bands {}", down.join(" ")) };
        let (across, along) = (streaks.across, streaks.along);
        say(&format!("{file}: streaks {}  across {across:.6}  along {along:.6}{down}", ratio(streaks)))?;
    }
    if let Some(share) = flicker.share() {
        say(&format!("flicker {share:.6} of the mean luminance {:.6}", flicker.mean()))?;
    }
    Ok(())
}

/// Figures of one picture.
#[derive(Serialize)]
struct EyeFigures {
    file: String,
    streaks: Streaks,
    bands: Vec<Streaks>,
}

/// Returns the part of the pictures to measure. Every band must have two columns and two rows, so that its
/// pixels have neighbours both ways.
fn part(args: &CompareArgs, size: [u32; 2]) -> Result<Window> {
    let part = window("--region", args.region, size)?;
    if part.width < 2 || args.bands == 0 || part.height / 2 < args.bands {
        return Err(Error::Usage(format!(
            "--bands {} of {}×{} pixels: a band needs two columns and two rows; use fewer bands or a larger \
             region",
            args.bands, part.width, part.height
        )));
    }
    Ok(part)
}

fn is_exr(path: &Path) -> bool {
    Format::of(path) == Some(Format::Exr)
}

fn one_kind(files: &[PathBuf]) -> Result<()> {
    if files.iter().any(|path| is_exr(path) != is_exr(&files[0])) {
        return Err(Error::Usage(
            "PNG values are encoded and EXR values linear; compare files of the same format".into(),
        ));
    }
    Ok(())
}

/// Reads a picture: encoded values, or the linear radiance of an EXR.
fn read(path: &Path) -> Result<Picture> {
    std::fs::metadata(path).map_err(|e| Error::open(path, e))?;
    if !is_exr(path) {
        let ReadPicture { width, height, encoding, pixels } = read_picture(path)?;
        let encoded = |p: [f32; 3]| if encoding.linear { p.map(srgb) } else { p };
        return Ok((width, height, pixels.into_iter().map(encoded).collect()));
    }
    let (width, height, channels) = read_exr(path)?;
    let channel = |name: &str| {
        channels.iter().find(|(n, _)| n == name).map(|(_, values)| values).ok_or_else(|| {
            Error::input(
                format!("{} has no channel {name}", path.display()),
                "compare files with the layer rgb",
            )
        })
    };
    let (r, g, b) = (channel("R")?, channel("G")?, channel("B")?);
    Ok((width, height, r.iter().zip(g).zip(b).map(|((&r, &g), &b)| [r, g, b]).collect()))
}

/// Draws the absolute difference of `a` and `b`, scaled so that `max` is 255.
fn difference_picture(a: &[[f32; 3]], b: &[[f32; 3]], max: f64) -> Vec<u8> {
    let scale = if max > 0.0 { 255.0 / max } else { 0.0 };
    let apart = |(x, y): (&f32, &f32)| ((x - y).abs() as f64 * scale) as u8;
    a.as_flattened().iter().zip(b.as_flattened()).map(apart).collect()
}
