//! `taki render`: renders one picture.

use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use serde_json::json;

use super::quality::QualityOptions;
use super::terminal::{Terminal, say};
use super::{CacheOptions, DepthOptions, EngineOptions, LayerOptions, SceneOptions};
use super::{crop, default_output, frame, measured_words, samples, size, window};
use crate::engine::exposure::exposed;
use crate::engine::{Engine, RenderOptions};
use crate::job::batch::Pattern;
use crate::job::{STDOUT, Still, beside_encoders, check_bloom, strips};
use crate::output::frame::{Exr, Figures, Format, folder_of, real_file};
use crate::output::movie::{MovieKind, fraction};
use crate::picture::Layer;
use crate::scene::Scene;
use crate::util::error::{Error, Result};
use crate::util::monitor::{Monitor, Unwarned};
use crate::util::window::Window;

#[derive(Args)]
pub struct RenderArgs {
    #[command(flatten)]
    scene: SceneOptions,
    /// File to write: .png, .jpg, .tif or .webp (the picture as shown, sRGB) or .exr (linear, half or float,
    /// with layers). Give -o several times to write several; - is stdout, as PNG. In a name, '####', '%04d',
    /// '$F4' and '@@@@' stand for the number of --frame. Default: the scene's name with .png, in the current
    /// folder.
    #[arg(short, long = "output", value_name = "FILE")]
    outputs: Vec<PathBuf>,
    #[command(flatten)]
    depth: DepthOptions,
    /// Replaces an existing file even if it is no picture.
    #[arg(long)]
    overwrite: bool,
    /// Size of the picture in pixels, such as 1280x720.
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<[u32; 2]>,
    /// Renders only a part of the picture: column and row of its top left pixel, width and height. Its
    /// pixels equal those of the whole picture bit for bit; `taki stitch` joins such parts.
    #[arg(long, value_name = "X,Y,W,H", value_parser = crop)]
    crop: Option<[u32; 4]>,
    /// Number of samples per pixel. More samples give smoother edges and take longer.
    #[arg(long, value_name = "N", value_parser = samples)]
    samples: Option<u32>,
    /// Makes the background transparent: the same as --set image.alpha=true. The picture can then be put over
    /// a photograph: an .exr exactly, other files only roughly, and too dark over a dark one.
    #[arg(long)]
    alpha: bool,
    /// Frame of the scene's animation to render. It may lie before 0.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = frame, allow_negative_numbers = true)]
    frame: i32,
    #[command(flatten)]
    quality: QualityOptions,
    #[command(flatten)]
    engine: EngineOptions,
    #[command(flatten)]
    cache: CacheOptions,
    #[command(flatten)]
    layers: LayerOptions,
    /// Prints a report with sizes, figures and times as one JSON object on stdout.
    #[arg(long)]
    json: bool,
}

pub fn run(args: &RenderArgs, terminal: &Terminal) -> Result<()> {
    args.scene.begin(terminal);
    args.engine.check()?;
    let start = Instant::now();
    let limits = args.cache.add_to(args.scene.limits());
    let mut more = Vec::new();
    if let Some([w, h]) = args.size {
        more.extend([format!("image.width={w}"), format!("image.height={h}")]);
    }
    more.extend(args.samples.map(|n| format!("image.samples={n}")));
    more.extend(args.alpha.then(|| "image.alpha=true".to_owned()));
    // The volumes are made once more for the picture, and warn then.
    let animation = args.quality.before(&args.scene).animation(&more, &limits)?;
    args.quality.tell(animation.values(), &[args.scene.own_sets(), more.clone()].concat(), terminal);
    args.scene.warn_of_settings(animation.values(), &[], terminal);
    args.scene.warn_of_replaced(animation.values(), &more, terminal);
    args.scene.warn_of_moved(args.frame, terminal);
    let (animation, measured) = exposed(animation, &Unwarned(terminal))?;
    let scene = animation.at(args.frame)?;
    let window = window("--crop", args.crop, [scene.image.width, scene.image.height])?;
    let outputs = match args.outputs.as_slice() {
        [] => vec![beside_its_scene(default_output(&scene, "png"), &args.scene.scene)?],
        given => given.to_vec(),
    };
    check_stdout(&outputs, args.json, std::io::stdout().is_terminal())?;
    let exr = Exr { rate: Some(fraction(animation.fps)), ..args.layers.exr() };
    exr.check(scene.image.width, scene.image.alpha)?;
    let files = |path: PathBuf| -> Vec<PathBuf> {
        match Format::of(&path) {
            Some(Format::Exr) => exr.files(&path).into_iter().map(|(file, _)| file).collect(),
            _ => vec![path],
        }
    };
    let outputs = outputs.into_iter().flat_map(files);
    let outputs: Vec<PathBuf> = match args.outputs.is_empty() {
        true => outputs.collect(),
        false => outputs.map(|path| Pattern::numbered(&path, args.frame)).collect::<Result<_>>()?,
    };
    check_twice(&outputs)?;
    if let Some(movie) = outputs.iter().find(|path| MovieKind::of(path).is_some()) {
        let movie = movie.display();
        return Err(Error::Usage(format!(
            "-o {movie}: taki batch makes movies, and taki render one picture"
        )));
    }
    let still = Still::create(&outputs)?.with_depth(args.depth.depth());
    still.check(&scene.image, window)?;
    if !args.overwrite {
        still.check_replaced()?;
    }
    let has_exr = still.has_exr();
    args.layers.check(has_exr)?;
    let linear = has_exr || args.depth.depth().linear;
    args.scene.warn_of_files(animation.values(), still.has_developed(), linear, terminal);
    let surface = has_exr && exr.layers.iter().any(|l| l.of_surface());

    // Opening the device is slow, so the CPU builds the volumes and the mesh at the same time.
    let cache = limits.cache.as_ref();
    let (made, (opened, device_seconds)) = std::thread::scope(|scope| {
        let made = scope.spawn(|| {
            let clock = Instant::now();
            let volumes = scene.cached_volumes(cache, limits.memory, terminal)?;
            let seconds = clock.elapsed().as_secs_f64();
            Ok((volumes, seconds, scene.cached_mesh(cache)))
        });
        let clock = Instant::now();
        let mut opened = args.engine.open();
        if let Ok((engine, _)) = &mut opened {
            engine.prepare(&scene);
        }
        let opened = (opened, clock.elapsed().as_secs_f64());
        (made.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)), opened)
    });
    let (volumes, volume_seconds, mesh) = made?;
    scene.warnings(&volumes).iter().for_each(|w| terminal.warn(w));
    scene.notes(&volumes).iter().for_each(|n| terminal.note(&format!("taki: {n}")));
    if let Some(stops) = measured {
        terminal.note(&measured_words(stops));
    }
    let (mut engine, line) = opened?;
    terminal.note(&format!("taki: {line}"));
    if scene.image.alpha && !has_exr {
        terminal.note(
            "taki: over a dark backdrop bright water becomes too dark in this file; write .exr to composite \
             (docs/compositing.md)",
        );
    }
    let options = RenderOptions { surface, ..Default::default() };
    let memory = beside_encoders(limits.memory, &still.formats(), window)?;
    let strips = strips(&scene, window, surface, memory)?;
    if still.has_developed() {
        check_bloom(&scene, window, strips.len())?;
    }
    let mut writer = still.begin(&scene, &volumes, window, &exr)?;
    let mut seconds = writer.fill(&strips, scene.image.samples, &options, terminal, |options, monitor| {
        engine.render_volume(&scene, &volumes, &mesh, options, monitor)
    })?;
    let Figures { non_finite_pixels: not_finite, covered_pixels, .. } = *writer.figures();
    if covered_pixels == 0 && args.crop.is_none() && !scene.quads.is_empty() {
        terminal.warn(
            "no water is in the picture: it is outside the view, or behind rock; turn the camera to it \
             with camera.target",
        );
    }
    if not_finite > 0 {
        terminal.warn(&format!("{not_finite} pixels are not finite; please report this scene as a bug"));
    }

    let clock = Instant::now();
    terminal.progress("saving", 0, 1)?;
    let figures = writer.finish()?;
    seconds.output += clock.elapsed().as_secs_f64();
    (seconds.volume, seconds.device) = (volume_seconds, device_seconds);
    terminal.close();
    let total = start.elapsed().as_secs_f64();
    if args.json {
        let layers = if has_exr { exr.layers.as_slice() } else { &[] };
        let mut report = report(&scene, &engine, window, &figures, layers, &outputs);
        report["auto_exposure"] = json!(measured);
        report["seconds"] = json!(seconds);
        report["seconds_total"] = json!(total);
        say(&report.to_string())?;
    } else {
        let name = |p: &PathBuf| if is_stdout(p) { "stdout".into() } else { p.display().to_string() };
        let names: Vec<String> = outputs.iter().map(name).collect();
        terminal.note(&format!("taki: wrote {} in {total:.2} s", names.join(", ")));
    }
    Ok(())
}

/// Returns the default output, unless it is the picture that the scene was read from.
fn beside_its_scene(output: PathBuf, scene: &Path) -> Result<PathBuf> {
    let real = |path: &Path| path.canonicalize().ok();
    if real(&output).is_some_and(|output| real(scene) == Some(output)) {
        let name = output.display();
        let what =
            format!("{name} holds the scene, and the new picture would replace it; give a name with -o");
        return Err(Error::Usage(what));
    }
    Ok(output)
}

/// Checks that no two outputs are one file.
fn check_twice(outputs: &[PathBuf]) -> Result<()> {
    let file = |path: &PathBuf| {
        let real = real_file(path).ok()?;
        Some((folder_of(&real).canonicalize().ok()?, real.file_name()?.to_owned()))
    };
    let files: Vec<_> = outputs.iter().map(file).collect();
    for (i, path) in outputs.iter().enumerate().filter(|(_, path)| !is_stdout(path)) {
        if let Some(first) = files[..i].iter().position(|other| other.is_some() && *other == files[i]) {
            let (first, path) = (outputs[first].display(), path.display());
            return Err(Error::Usage(format!(
                "-o {first} and -o {path} are one file; leave out one of them"
            )));
        }
    }
    Ok(())
}

fn is_stdout(path: &Path) -> bool {
    path.as_os_str() == STDOUT
}

/// Checks that at most one picture goes to stdout, alone, and not to a terminal.
fn check_stdout(outputs: &[PathBuf], json: bool, is_terminal: bool) -> Result<()> {
    let pictures = outputs.iter().filter(|path| is_stdout(path)).count();
    let why = match pictures {
        0 => return Ok(()),
        1 if json => "and --json would both write to stdout; leave out one of them",
        1 if is_terminal => {
            "would print a PNG on the terminal; give a file, or send stdout to a program or file"
        }
        1 => return Ok(()),
        _ => "is given twice",
    };
    Err(Error::Usage(format!("-o {STDOUT} {why}")))
}

fn report(
    scene: &Scene,
    engine: &Engine,
    window: Window,
    figures: &Figures,
    layers: &[Layer],
    outputs: &[PathBuf],
) -> serde_json::Value {
    let image = &scene.image;
    let crop = (window != Window::whole([image.width, image.height]))
        .then(|| json!({"x": window.x, "y": window.y, "of": {"width": image.width, "height": image.height}}));
    json!({
        "scene": scene.name,
        "engine": engine.word(),
        "adapter": engine.adapter(),
        "width": window.width,
        "height": window.height,
        "crop": crop,
        "samples": image.samples,
        "exposure": image.look.exposure,
        "rays": figures.pixels * u64::from(image.samples),
        "covered_pixels": figures.covered_pixels,
        "cells_walked": figures.cells_walked,
        "light_cells_walked": figures.light_cells_walked,
        "non_finite_pixels": figures.non_finite_pixels,
        "layers": layers.iter().map(|l| l.name()).collect::<Vec<_>>(),
        "outputs": outputs.iter().map(|p| p.display().to_string()).collect::<Vec<_>>(),
    })
}
