//! `taki compare`: how far two pictures are apart.

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;

use super::terminal::say;
use crate::error::{Error, Result};
use crate::frame::{Difference, Frame, Output, Tolerance, encode_png, read_exr, read_png};

#[derive(Args)]
pub struct CompareArgs {
    /// One picture: .png, compared as encoded (0 to 1), or .exr, compared in linear radiance.
    a: PathBuf,
    /// The other, of the same kind and size.
    b: PathBuf,
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
    /// Prints the figures as one JSON object.
    #[arg(long)]
    json: bool,
}

type Picture = (u32, u32, Vec<[f32; 3]>);

pub fn run(args: &CompareArgs) -> Result<()> {
    let (width, height, a) = read(&args.a)?;
    let (other_width, other_height, b) = read(&args.b)?;
    if (width, height) != (other_width, other_height) {
        return Err(Error::Comparison(format!(
            "the pictures differ in size: {width}×{height} and {other_width}×{other_height}; render them at one size"
        )));
    }
    let exr = |path: &Path| extension(path).as_deref() == Some("exr");
    if exr(&args.a) != exr(&args.b) {
        return Err(Error::Usage("a .png is encoded and an .exr linear: compare two of one kind".into()));
    }
    let absolute = args.absolute.unwrap_or(if exr(&args.a) { 1e-4 } else { 2.0 / 255.0 });
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

fn extension(path: &Path) -> Option<String> {
    path.extension().map(|e| e.to_string_lossy().to_lowercase())
}

fn read(path: &Path) -> Result<Picture> {
    if extension(path).as_deref() != Some("exr") {
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
