//! `taki render`: one image.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use serde_json::json;

use super::terminal::{Terminal, say};
use super::{EngineOptions, SceneOptions, default_output, size};
use crate::error::{Error, Result};
use crate::frame::{Frame, Layer};
use crate::gpu::RenderOptions;
use crate::job::{Engine, Monitor, Still};
use crate::scene::Scene;

#[derive(Args)]
pub struct RenderArgs {
    #[command(flatten)]
    scene: SceneOptions,
    /// The picture: .png (sRGB, 8 bits) or .exr (float32, linear, with layers). May be given twice.
    /// Default: the scene's name with .png, in the current folder.
    #[arg(short, long = "output", value_name = "FILE")]
    outputs: Vec<PathBuf>,
    /// Size of the picture in pixels.
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<[u32; 2]>,
    /// Jittered samples a pixel.
    #[arg(long, value_name = "N")]
    samples: Option<u32>,
    #[command(flatten)]
    engine: EngineOptions,
    /// Layers of the EXR file.
    #[arg(long, value_enum, value_delimiter = ',', value_name = "A,B,…")]
    layers: Option<Vec<Layer>>,
    /// Prints what was done as one JSON object on stdout.
    #[arg(long)]
    json: bool,
}

pub fn run(args: &RenderArgs, terminal: &Terminal) -> Result<()> {
    let start = Instant::now();
    let mut more = Vec::new();
    if let Some([w, h]) = args.size {
        more.extend([format!("image.width={w}"), format!("image.height={h}")]);
    }
    more.extend(args.samples.map(|n| format!("image.samples={n}")));
    let scene = args.scene.load(&more)?;
    let outputs = match args.outputs.as_slice() {
        [] => vec![default_output(&scene, "png")],
        given => given.to_vec(),
    };
    let still = Still::create(&outputs)?;
    let has_exr = still.has_exr();
    if args.layers.is_some() && !has_exr {
        return Err(Error::Usage("--layers is for EXR files; add -o FILE.exr".into()));
    }
    let layers = args.layers.clone().unwrap_or(Layer::ALL.to_vec());
    let surface = has_exr && layers.iter().any(|l| l.of_surface());

    let clock = Instant::now();
    let volume = scene.volume(args.scene.limits().memory, terminal)?;
    let volume_seconds = clock.elapsed().as_secs_f64();
    scene.warnings(&volume).iter().for_each(|w| terminal.warn(w));
    let clock = Instant::now();
    let (mut engine, line) = Engine::open(args.engine.engine, &args.engine.device())?;
    terminal.note(&format!("taki: {line}"));
    let device_seconds = clock.elapsed().as_secs_f64();
    let mesh = scene.mesh();
    let options = RenderOptions { surface, ..Default::default() };
    let mut frame = engine.render(&scene, &volume, &mesh, &options, terminal)?;
    frame.seconds.volume = volume_seconds;
    frame.seconds.device = device_seconds;
    if frame.non_finite_pixels() > 0 {
        terminal
            .warn(&format!("{} pixels are not finite: please report this scene", frame.non_finite_pixels()));
    }

    let clock = Instant::now();
    terminal.progress("saving", 0, 1)?;
    still.save(&frame, &layers, &scene, &volume)?;
    frame.seconds.output = clock.elapsed().as_secs_f64();
    terminal.close();
    let total = start.elapsed().as_secs_f64();
    if args.json {
        say(&report(&scene, &engine, &frame, has_exr.then_some(&layers), &outputs, total).to_string());
    } else {
        let names: Vec<String> = outputs.iter().map(|p| p.display().to_string()).collect();
        terminal.note(&format!("taki: wrote {} in {total:.2} s", names.join(", ")));
    }
    Ok(())
}

fn report(
    scene: &Scene,
    engine: &Engine,
    frame: &Frame,
    layers: Option<&Vec<Layer>>,
    outputs: &[PathBuf],
    total: f64,
) -> serde_json::Value {
    let [view, light] = frame.cells_walked();
    json!({
        "scene": scene.name,
        "engine": engine.word(),
        "adapter": engine.adapter(),
        "width": frame.width,
        "height": frame.height,
        "samples": scene.image.samples,
        "seconds": frame.seconds,
        "seconds_total": total,
        "rays": frame.width as u64 * frame.height as u64 * scene.image.samples as u64,
        "covered_pixels": frame.covered_pixels(),
        "cells_walked": view,
        "light_cells_walked": light,
        "non_finite_pixels": frame.non_finite_pixels(),
        "layers": layers.map(|l| l.iter().map(|l| l.name()).collect::<Vec<_>>()).unwrap_or_default(),
        "outputs": outputs.iter().map(|p| p.display().to_string()).collect::<Vec<_>>(),
    })
}
