//! `taki compare`: how far two pictures are apart.

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;
use serde_json::json;

use super::terminal::say;
use super::{crop, window};
use crate::output::frame::streaks::{Flicker, Streaks, bands, decoded, luminance, streaks};
use crate::output::frame::{Difference, Output, Tolerance, encode_png, read_exr, read_png};
use crate::picture::Frame;
use crate::util::error::{Error, Result};
use crate::util::window::Window;

#[derive(Args)]
pub struct CompareArgs {
    /// Two pictures of one size: .png, compared as encoded (0 to 1), or .exr, compared in linear radiance. With --eye
    /// any number, in the order of time.
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Difference that still counts as the same, as a share of the larger value.
    #[arg(long, value_name = "X", default_value_t = 1e-3)]
    relative: f32,
    /// Difference that still counts as the same. Default: 1e-4 for .exr, two of 255 steps for .png.
    #[arg(long, value_name = "X")]
    absolute: Option<f32>,
    /// Share of the pixels that may be outside; past it the comparison fails with exit code 1.
    #[arg(long, value_name = "X", default_value_t = 1e-3)]
    share: f64,
    /// Fails past this root mean square error too.
    #[arg(long, value_name = "X")]
    rmse: Option<f64>,
    /// Writes the absolute difference, brightened so that the largest is white, as a PNG.
    #[arg(long, value_name = "FILE.png")]
    difference: Option<PathBuf>,
    /// Tells figures for the eye of each picture instead: its streaks, the mean difference of luminance between
    /// neighbours across the flow over that along it, where the flow goes down the image; and the flicker of three
    /// pictures or more.
    #[arg(long, conflicts_with_all = ["relative", "absolute", "share", "rmse", "difference"])]
    eye: bool,
    /// Figures for the eye of this part of the pictures only.
    #[arg(long, value_name = "X,Y,W,H", value_parser = crop, requires = "eye")]
    region: Option<[u32; 4]>,
    /// Tells the streaks of so many bands too, from the top of the region to its foot.
    #[arg(long, value_name = "N", default_value_t = 1, requires = "eye")]
    bands: u32,
    /// Prints the figures as one JSON object.
    #[arg(long)]
    json: bool,
}

type Picture = (u32, u32, Vec<[f32; 3]>);

pub fn run(args: &CompareArgs) -> Result<()> {
    if args.eye {
        return eye(args);
    }
    let [path_a, path_b] = &args.files[..] else {
        let what = format!("{} pictures; compare two, or look at them with --eye", args.files.len());
        return Err(Error::Usage(what));
    };
    let (width, height, a) = read(path_a)?;
    let (other_width, other_height, b) = read(path_b)?;
    if (width, height) != (other_width, other_height) {
        return Err(Error::Comparison(format!(
            "the pictures differ in size: {width}×{height} and {other_width}×{other_height}; render them at one size"
        )));
    }
    one_kind(&args.files)?;
    let absolute = args.absolute.unwrap_or(if is_exr(path_a) { 1e-4 } else { 2.0 / 255.0 });
    let d = Difference::new(width, &a, &b, Tolerance { relative: args.relative, absolute });
    if let Some(path) = &args.difference {
        let bytes = encode_png(&difference_picture(width, height, &a, &b, d.max), &[])
            .map_err(|e| Error::write(path, e))?;
        Output::create(path)?.finish_with(&bytes)?;
    }
    let share = d.share_outside();
    if args.json {
        say(&json!({"figures": d, "share_outside": share}).to_string());
    } else {
        let [x, y] = d.worst;
        say(&format!("rmse {:.6}  mean {:.6}  max {:.6} at ({x}, {y})", d.rmse, d.mean, d.max));
        say(&format!("{} of {} pixels outside the tolerance ({:.4} %)", d.outside, d.pixels, share * 100.0));
    }
    if share > args.share {
        return Err(Error::Comparison(format!(
            "{share:.6} of the pixels are outside; --share allows {}",
            args.share
        )));
    }
    match args.rmse {
        Some(most) if d.rmse > most || most.is_nan() => {
            Err(Error::Comparison(format!("the rmse is {:.6}; --rmse allows {most}", d.rmse)))
        }
        _ => Ok(()),
    }
}

/// Figures for the eye.
fn eye(args: &CompareArgs) -> Result<()> {
    one_kind(&args.files)?;
    let mut first: Option<([u32; 2], Window)> = None;
    let mut flicker = Flicker::default();
    let mut pictures = Vec::new();
    for path in &args.files {
        let (width, height, pixels) = read(path)?;
        let size = [width, height];
        let (of, part) = match first {
            Some(first) => first,
            None => *first.insert((size, part(args, size)?)),
        };
        if of != size {
            return Err(Error::Comparison(format!(
                "{} has {width}×{height} pixels and {} {}×{}; render them at one size",
                path.display(),
                args.files[0].display(),
                of[0],
                of[1]
            )));
        }
        let linear = |p: &[f32; 3]| luminance(if is_exr(path) { *p } else { p.map(decoded) });
        let luminances: Vec<f32> = pixels.iter().map(linear).collect();
        let of = |part| streaks(&luminances, width as usize, part);
        let each: Vec<Streaks> = match args.bands {
            1 => Vec::new(),
            n => bands(part, n).into_iter().map(of).collect(),
        };
        pictures.push(Looked { file: path.display().to_string(), streaks: of(part), bands: each });
        let rows = (part.y..part.bottom()).flat_map(|y| {
            let row = y as usize * width as usize;
            luminances[row + part.x as usize..row + part.right() as usize].iter().copied()
        });
        flicker.push(rows.collect());
    }
    if args.json {
        let (mean, flicker) = (flicker.mean(), flicker.share());
        say(&json!({"pictures": pictures, "mean_luminance": mean, "flicker": flicker}).to_string());
        return Ok(());
    }
    let ratio = |s: &Streaks| s.ratio.map_or("–".into(), |ratio| format!("{ratio:.4}"));
    for Looked { file, streaks, bands } in &pictures {
        let down: Vec<String> = bands.iter().map(ratio).collect();
        let down = if down.is_empty() { String::new() } else { format!("  bands {}", down.join(" ")) };
        let (across, along) = (streaks.across, streaks.along);
        say(&format!("{file}: streaks {}  across {across:.6}  along {along:.6}{down}", ratio(streaks)));
    }
    if let Some(share) = flicker.share() {
        say(&format!("flicker {share:.6} of the mean luminance {:.6}", flicker.mean()));
    }
    Ok(())
}

/// What is told of one picture.
#[derive(Serialize)]
struct Looked {
    file: String,
    streaks: Streaks,
    bands: Vec<Streaks>,
}

/// The part that is looked at: every band of it has neighbours both ways.
fn part(args: &CompareArgs, size: [u32; 2]) -> Result<Window> {
    let part = window("--region", args.region, size)?;
    if part.width < 2 || args.bands == 0 || part.height / 2 < args.bands {
        return Err(Error::Usage(format!(
            "--bands {} of {}×{} pixels: a band needs two columns and two rows; take fewer bands or a larger region",
            args.bands, part.width, part.height
        )));
    }
    Ok(part)
}

fn is_exr(path: &Path) -> bool {
    extension(path).as_deref() == Some("exr")
}

fn one_kind(files: &[PathBuf]) -> Result<()> {
    if files.iter().any(|path| is_exr(path) != is_exr(&files[0])) {
        return Err(Error::Usage(
            "a .png is encoded and an .exr linear: compare pictures of one kind".into(),
        ));
    }
    Ok(())
}

fn extension(path: &Path) -> Option<String> {
    path.extension().map(|e| e.to_string_lossy().to_lowercase())
}

fn read(path: &Path) -> Result<Picture> {
    if !is_exr(path) {
        return read_png(path);
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

fn difference_picture(width: u32, height: u32, a: &[[f32; 3]], b: &[[f32; 3]], max: f64) -> Frame {
    let scale = if max > 0.0 { 255.0 / max } else { 0.0 };
    let mut frame = Frame::new(width, height, false);
    for (out, (p, q)) in frame.picture.iter_mut().zip(a.iter().zip(b)) {
        let channel = |c: usize| ((p[c] - q[c]).abs() as f64 * scale) as u8;
        *out = [channel(0), channel(1), channel(2), 255];
    }
    frame
}
