//! `taki stitch`: joins crops to the whole picture.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;

use super::ExrOptions;
use super::terminal::Terminal;
use crate::job::{StitchOptions, stitch_with};
use crate::util::error::Result;

#[derive(Args)]
pub struct StitchArgs {
    /// Files that `taki render --crop` wrote, all .png, all .tif, all .webp or all .exr. They must show one
    /// scene at one size and cover the whole picture; overlaps are allowed. Numbers and compression of EXR
    /// files stay as they are unless --half or --compression is given.
    #[arg(required = true, value_name = "PART")]
    parts: Vec<PathBuf>,
    /// File of the whole picture, with the same extension as the parts.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Replaces an existing file even if it is one of the parts, or no picture.
    #[arg(long)]
    overwrite: bool,
    #[command(flatten)]
    exr: ExrOptions,
}

pub fn run(args: &StitchArgs, terminal: &Terminal) -> Result<()> {
    terminal.watch();
    let start = Instant::now();
    let ExrOptions { half, compression } = args.exr;
    let options = StitchOptions { overwrite: args.overwrite, half, compression };
    stitch_with(&args.parts, &args.output, &options, terminal)?;
    terminal.close();
    let (parts, seconds) = (args.parts.len(), start.elapsed().as_secs_f64());
    terminal.note(&format!("taki: wrote {} from {parts} parts in {seconds:.2} s", args.output.display()));
    Ok(())
}
