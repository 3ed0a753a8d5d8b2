//! `taki compare`: measures how much two pictures differ.

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;
use serde_json::json;

use super::parse::{memory, share, tolerance, whole};
use super::terminal::{Terminal, say};
use super::{crop, developed, window};
use crate::job::{check_replaced, is_same_file};
use crate::output::frame::streaks::{Flicker, Streaks, bands, decoded, luminance, streaks};
use crate::output::frame::{
    Difference, Encoding, ExrColours, ExrPicture, Format, Head, Output, ReadPicture, Tolerance, encode,
    read_picture,
};
use crate::util::error::{Error, Result};
use crate::util::monitor::Monitor;
use crate::util::window::Window;

#[derive(Args)]
pub struct CompareArgs {
    /// Two pictures of the same size. PNG, JPEG, TIFF and WebP files are compared by encoded values (0 to 1),
    /// EXR files of any program by linear radiance in Rec. 709; those with alpha over black and over white.
    /// With --eye, any number of pictures, in order of time.
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Relative tolerance, as a share of the larger value. Two values count as equal if they differ by at
    /// most the relative plus the absolute tolerance.
    #[arg(long, value_name = "X", default_value_t = 1e-3, value_parser = tolerance::<f32>)]
    relative: f32,
    /// Absolute tolerance, in the picture's values. Default: 1e-4 for .exr, 2/255 for the others.
    #[arg(long, value_name = "X", value_parser = tolerance::<f32>)]
    absolute: Option<f32>,
    /// Share of the pixels that may lie outside the tolerances. If more do, taki exits with code 1.
    #[arg(long, value_name = "X", default_value_t = 1e-3, value_parser = share)]
    share: f64,
    /// Largest root mean square error. If it is exceeded, taki exits with code 1.
    #[arg(long, value_name = "X", value_parser = tolerance::<f64>)]
    rmse: Option<f64>,
    /// Writes a picture (.png, .jpg, .tif or .webp) of the absolute difference, scaled so that the largest
    /// difference is white.
    #[arg(long, value_name = "FILE")]
    difference: Option<PathBuf>,
    /// Replaces an existing file of --difference even if it is one of the two, or no picture.
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
    #[arg(long, value_name = "N", default_value_t = 1, requires = "eye", value_parser = whole::<u32>)]
    bands: u32,
    /// Largest memory for one EXR file, such as 6GiB or 512MiB. A number alone counts MiB.
    #[arg(long, value_name = "SIZE", value_parser = memory, default_value = "4GiB")]
    memory: u64,
    /// Prints the figures as one JSON object on stdout.
    #[arg(long)]
    json: bool,
}

/// A picture to compare.
struct Picture {
    /// Width and height, pixels.
    size: [u32; 2],
    /// R, G, B of each pixel, over black where they are transparent.
    pixels: Vec<[f32; 3]>,
    /// The same over white, if the picture has alpha.
    over_white: Option<Vec<[f32; 3]>>,
}

pub fn run(args: &CompareArgs, terminal: &Terminal) -> Result<()> {
    let read_in = |area: Option<Window>| move |path: &Path| read(path, area, args.memory, terminal);
    if args.eye {
        one_kind(&args.files)?;
        return eye(args, &read_in(area(&args.files)?));
    }
    let [path_a, path_b] = &args.files[..] else {
        let what = format!("{} pictures given; compare two, or use --eye for any number", args.files.len());
        return Err(Error::Usage(what));
    };
    if let Some(path) = &args.difference {
        developed("--difference", path)?;
        if !args.overwrite {
            if args.files.iter().any(|file| is_same_file(file, path)) {
                let what = "is one of the pictures; choose another name, or replace it with --overwrite";
                return Err(Error::Usage(format!("--difference {} {what}", path.display())));
            }
            check_replaced(path)?;
        }
    }
    one_kind(&args.files)?;
    let read = read_in(area(&args.files)?);
    let (mut a, mut b) = (read(path_a)?, read(path_b)?);
    let ([width, height], [other_width, other_height]) = (a.size, b.size);
    if a.size != b.size {
        return Err(Error::Comparison(format!(
            "the pictures differ in size: {width}×{height} and {other_width}×{other_height}; render both at \
             the same size"
        )));
    }
    let absolute = args.absolute.unwrap_or(if is_exr(path_a) { 1e-4 } else { 2.0 / 255.0 });
    let tolerance = Tolerance { relative: args.relative, absolute };
    let mut d = Difference::new(width, &a.pixels, &b.pixels, tolerance);
    if a.over_white.is_some() || b.over_white.is_some() {
        // Over black and over white, no difference of colour or alpha stays unseen.
        let whites = [&a, &b].map(|p| p.over_white.clone().unwrap_or_else(|| p.pixels.clone()));
        let white = Difference::new(width, &whites[0], &whites[1], tolerance);
        if (white.outside, white.rmse) > (d.outside, d.rmse) {
            d = white;
            [a.pixels, b.pixels] = whites;
        }
    }
    if let Some(path) = &args.difference {
        let format = developed("--difference", path)?;
        let head = Head { format, encoding: Encoding::DISPLAY, size: [width, height], texts: Vec::new() };
        let bytes = encode(&head, difference_picture(&a.pixels, &b.pixels, d.max))
            .map_err(|e| Error::write(path, e))?;
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
        Some(most) if d.rmse > most => Err(Error::Comparison(format!(
            "the root mean square error is {:.6}; --rmse allows {most}",
            d.rmse
        ))),
        _ => Ok(()),
    }
}

/// Prints how the pictures look to the eye: streaks and flicker.
fn eye(args: &CompareArgs, read: &dyn Fn(&Path) -> Result<Picture>) -> Result<()> {
    let mut first: Option<([u32; 2], Window)> = None;
    let mut flicker = Flicker::default();
    let mut pictures = Vec::new();
    for path in &args.files {
        let Picture { size, pixels, .. } = read(path)?;
        let width = size[0];
        let (first_size, part) = match first {
            Some(first) => first,
            None => *first.insert((size, part(args, size)?)),
        };
        if first_size != size {
            return Err(sizes_differ(path, size, &args.files[0], first_size));
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
            "one of the files holds linear light and the other values as shown; compare two of one kind"
                .into(),
        ));
    }
    Ok(())
}

/// Returns the part of the picture in which one of the EXR files has data; `None` without such files. The
/// rest is black in all of them.
fn area(files: &[PathBuf]) -> Result<Option<Window>> {
    let mut all: Option<([u32; 2], Window)> = None;
    for path in files.iter().filter(|path| is_exr(path)) {
        let own = open(path)?;
        all = Some(match all {
            None => (own.size, own.data),
            Some((size, _)) if size != own.size => return Err(sizes_differ(path, own.size, &files[0], size)),
            Some((size, data)) => (size, data.around(&own.data)),
        });
    }
    Ok(all.map(|(_, area)| area))
}

fn sizes_differ(path: &Path, size: [u32; 2], first: &Path, other: [u32; 2]) -> Error {
    let [[width, height], [other_width, other_height]] = [size, other];
    Error::Comparison(format!(
        "{} has {width}×{height} pixels, but {} has {other_width}×{other_height}; render them at the same \
         size",
        path.display(),
        first.display()
    ))
}

fn open(path: &Path) -> Result<ExrColours> {
    check_file(path)?;
    ExrColours::open(path)
}

/// Refuses what is no regular file: a pipe without a writer would block for ever.
fn check_file(path: &Path) -> Result<()> {
    if std::fs::metadata(path).map_err(|e| Error::open(path, e))?.is_file() {
        return Ok(());
    }
    Err(Error::input(format!("{} is not a regular file", path.display()), "give a PNG or EXR"))
}

/// Reads a picture: encoded values, or the linear radiance of an EXR.
fn read(path: &Path, area: Option<Window>, memory: u64, terminal: &Terminal) -> Result<Picture> {
    let Some(area) = area.filter(|_| is_exr(path)) else {
        check_file(path)?;
        let picture = read_picture(path)?;
        let ReadPicture { width, height, encoding, .. } = picture;
        let over = |grey: f32| picture.over(grey).into_iter().map(encoding.shown()).collect();
        let over_white = encoding.alpha.then(|| over(1.0));
        return Ok(Picture { size: [width, height], pixels: over(0.0), over_white });
    };
    let ExrPicture { width, height, pixels, alpha, notes } = open(path)?.read(area, memory)?;
    notes.iter().for_each(|note| terminal.warn(&format!("{}: {note}", path.display())));
    // The colours of an EXR are multiplied by alpha.
    let over_white = alpha.map(|alpha| {
        let white = |(p, a): (&[f32; 3], &f32)| p.map(|x| x + 1.0 - a);
        pixels.iter().zip(&alpha).map(white).collect()
    });
    Ok(Picture { size: [width, height], pixels, over_white })
}

/// Draws the absolute difference of `a` and `b`, scaled so that `max` is 255.
fn difference_picture(a: &[[f32; 3]], b: &[[f32; 3]], max: f64) -> Vec<u8> {
    let scale = if max > 0.0 { 255.0 / max } else { 0.0 };
    let apart = |(x, y): (&f32, &f32)| ((x - y).abs() as f64 * scale) as u8;
    a.as_flattened().iter().zip(b.as_flattened()).map(apart).collect()
}
