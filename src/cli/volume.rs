//! `taki volume`: writes volume textures as NumPy arrays and prints their statistics.

use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use clap::{Args, Subcommand};
use glam::DVec3;

use super::parse::memory;
use super::terminal::{Terminal, say};
use super::{SceneOptions, default_output, grids};
use crate::grid::{GridFile, is_grid};
use crate::job::{check_volume_replaced, is_hair};
use crate::model::StrandFile;
use crate::output::frame::Output;
use crate::scene::{Scene, key_of_volume, likeliest};
use crate::util::error::{Error, Result};
use crate::util::monitor::Monitor;
use crate::volume::{ReadOptions, Statistics, VolumeTexture, read_npz, write_npz};

#[derive(Args)]
pub struct VolumeArgs {
    #[command(subcommand)]
    command: VolumeCommand,
}

#[derive(Subcommand)]
enum VolumeCommand {
    /// Builds a scene's volume texture and writes it: as an .npz file with the arrays rho, v, k and alpha, or
    /// as a .vdb or .nvdb file with the grids density, velocity, kd and ks. As a .hair, fur, cloth and hair
    /// are written as the strands that their cells are made of.
    Build {
        #[command(flatten)]
        scene: SceneOptions,
        /// Volume to build, where the scene shows several: water, or the name of a table in [volumes].
        #[arg(long = "volume", value_name = "NAME")]
        volume: Option<String>,
        /// File to write: an .npz, a .vdb, an .nvdb or a .hair. Default: the scene's name with .npz, in the
        /// current folder.
        #[arg(short, long, value_name = "FILE")]
        output: Option<PathBuf>,
        /// Replaces an existing file even if it is no volume.
        #[arg(long)]
        overwrite: bool,
    },
    /// Prints statistics of a volume file, the grids of a simulation, or what strands a file has.
    Info {
        /// The file to read: an .npz with a volume or with grids, a .vdb, an .nvdb, a .hair, or curves of
        /// USD.
        file: PathBuf,
        /// Prints the statistics as one JSON object.
        #[arg(long)]
        json: bool,
        /// Memory budget, such as 6GiB (2^30 bytes each), 6GB (10^9 bytes each) or 512MiB. A number alone
        /// counts MiB. A volume that would need more is refused.
        #[arg(long, value_name = "SIZE", value_parser = memory, default_value = "4GiB")]
        memory: u64,
    },
}

pub fn run(args: &VolumeArgs, terminal: &Terminal) -> Result<()> {
    match &args.command {
        VolumeCommand::Build { scene: options, volume: name, output, overwrite } => {
            options.begin(terminal);
            let scene = options.load(&[])?;
            let number = number_of(&scene, name.as_deref())?;
            let path = output.clone().unwrap_or_else(|| default_output(&scene, "npz"));
            let as_grids = GridFile::of(&path);
            let is_known = as_grids.is_some() || is_hair(&path);
            if !is_known && !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("npz")) {
                let npz = path.with_extension("npz");
                return Err(Error::Usage(format!(
                    "-o {}: a volume is an .npz file, or a .vdb, .nvdb or .hair for other programs; use \
                     -o {}",
                    path.display(),
                    npz.display()
                )));
            }
            let same = |file: &PathBuf| {
                file.canonicalize().ok().is_some_and(|f| path.canonicalize().ok() == Some(f))
            };
            if scene.recipes[number].file.as_ref().is_some_and(same) {
                let what = format!("-o {}: the scene reads its volume from this file", path.display());
                return Err(Error::Usage(format!("{what}; give another name with -o")));
            }
            if is_hair(&path) {
                return write_strands(&scene, number, &path, *overwrite, options.limits().memory, terminal);
            }
            if !overwrite {
                check_volume_replaced(&path)?;
            }
            let mut out = Output::create(&path)?;
            let memory = options.limits().memory;
            let volume = scene.cached_volume(number, None, memory, terminal)?;
            if volume.alpha > 1.0 && as_grids.is_none() {
                let scale = key_of_volume(&scene.recipes[number].name, "volume.rho_scale");
                return Err(Error::input(
                    format!("ρ reaches {}, and a volume file holds at most 1", volume.alpha),
                    format!("divide {scale} by that number, and multiply trace.sigma by it, or write a .vdb"),
                ));
            }
            let notes = scene.environment.iter().map(|environment| environment.words());
            let notes = notes.chain(scene.note_on_volume(number, &volume));
            notes.for_each(|n| terminal.note(&format!("taki: {n}")));
            terminal.progress("saving", 0, 1)?;
            let writer = BufWriter::with_capacity(1 << 20, out.file());
            let written = match as_grids {
                None => write_npz(&volume, writer),
                Some(format) => {
                    let left = memory.saturating_sub(volume.cells.bytes());
                    format.encode(&volume.grids(scene.place_of(number, &volume), left)?, writer)
                }
            };
            written.map_err(|e| Error::write(&path, e))?;
            out.finish()?;
            terminal.close();
            let [nx, ny, nz] = volume.size;
            terminal.note(&format!("taki: wrote {} ({nx}×{ny}×{nz} cells)", path.display()));
            Ok(())
        }
        VolumeCommand::Info { file, json, memory } => {
            terminal.watch();
            if StrandFile::is_named(file) {
                return strand_info(file, *json, *memory);
            }
            if is_grid(file) {
                return grids::info(file, *json, *memory, terminal);
            }
            let options = ReadOptions { budget: *memory, ..Default::default() };
            let notes = Notes { terminal, texts: Mutex::default() };
            let statistics = read_npz(file, &options, &notes)?.statistics();
            let prefix = format!("{}: ", file.display());
            let notes = notes.texts.into_inner().unwrap_or_else(|e| e.into_inner());
            let converted: Vec<&str> = notes.iter().map(|n| n.strip_prefix(&prefix).unwrap_or(n)).collect();
            if *json {
                let mut object = serde_json::json!(statistics);
                object["converted"] = serde_json::json!(converted);
                return say(&object.to_string());
            }
            say(&in_words(&statistics))?;
            if !converted.is_empty() {
                say("converted on reading:")?;
                converted.iter().try_for_each(|text| say(&format!("  {text}")))?;
            }
            Ok(())
        }
    }
}

/// Prints what strands a file has, in its own unit.
fn strand_info(file: &Path, json: bool, memory: u64) -> Result<()> {
    let StrandFile { strands, unit, is_z_up, notes } = StrandFile::read(file, None, memory)?;
    let [low, high] = strands.bounds().unwrap_or_default();
    let (thin, thick) =
        strands.widths.iter().fold((f32::INFINITY, 0.0f32), |(a, b), w| (a.min(*w), b.max(*w)));
    let up = is_z_up.map(|is_z| if is_z { "z" } else { "y" });
    if json {
        return say(&serde_json::json!({
            "strands": strands.count(),
            "points": strands.points.len(),
            "bounds": [low.to_array(), high.to_array()],
            "thickness": [thin, thick],
            "unit": unit,
            "up": up,
            "notes": notes,
        })
        .to_string());
    }
    say(&format!("strands    {}", strands.count()))?;
    say(&format!("points     {}", strands.points.len()))?;
    say(&format!("bounds     {low} to {high}, in the file's unit"))?;
    say(&format!("thickness  {thin} to {thick}"))?;
    if let Some((unit, up)) = unit.zip(up) {
        say(&format!("unit       {unit} m, {up} points up"))?;
    }
    notes.iter().try_for_each(|note| say(&format!("note       {note}")))
}

/// Writes the strands of a scene's volume as a `.hair`, in metres, where a box shows them.
fn write_strands(
    scene: &Scene,
    number: usize,
    path: &Path,
    overwrite: bool,
    memory: u64,
    terminal: &Terminal,
) -> Result<()> {
    let recipe = &scene.recipes[number];
    if !overwrite {
        check_volume_replaced(path)?;
    }
    let strands = recipe.matter.as_ref().map(|matter| matter.strands(memory, terminal)).transpose()?;
    let Some(mut strands) = strands.flatten() else {
        return Err(Error::Usage(format!(
            "-o {}: the volume {} is not made of strands with a width; use -o {}",
            path.display(),
            recipe.name,
            path.with_extension("npz").display()
        )));
    };
    let mut out = Output::create(path)?;
    let size = recipe.water.size;
    let place = recipe.world_from_texture().unwrap_or_else(|| VolumeTexture::unit_box(size));
    let cell = DVec3::ONE / DVec3::from_array(size.map(f64::from));
    // Cells are cubes in both places.
    let edge = (place.matrix3.x_axis.length() * cell.x) as f32;
    strands.points.iter_mut().for_each(|p| *p = place.transform_point3(p.as_dvec3() * cell).as_vec3());
    strands.widths.iter_mut().for_each(|width| *width *= edge);
    terminal.progress("saving", 0, 1)?;
    strands.write(BufWriter::with_capacity(1 << 20, out.file())).map_err(|e| Error::write(path, e))?;
    out.finish()?;
    terminal.close();
    let (count, points) = (strands.count(), strands.points.len());
    terminal.note(&format!("taki: wrote {} ({count} strands, {points} points)", path.display()));
    Ok(())
}

/// Returns the number of the volume `name` of a scene, or of its only volume.
fn number_of(scene: &Scene, name: Option<&str>) -> Result<usize> {
    let names: Vec<&str> = scene.recipes.iter().map(|recipe| recipe.name.as_str()).collect();
    match name {
        None if names.len() == 1 => Ok(0),
        None => Err(Error::Usage(format!(
            "the scene shows the volumes {}; choose one with --volume NAME",
            names.join(", ")
        ))),
        Some(name) => names.iter().position(|own| *own == name).ok_or_else(|| {
            let fix = match likeliest(name, names.iter().copied()) {
                Some(near) => format!("did you mean {near}?"),
                None => format!("it shows {}", names.join(", ")),
            };
            Error::Usage(format!("--volume {name}: the scene shows no volume of this name; {fix}"))
        }),
    }
}

/// Monitor that keeps the notes, to print them with the statistics.
struct Notes<'a> {
    terminal: &'a Terminal,
    texts: Mutex<Vec<String>>,
}

impl Monitor for Notes<'_> {
    fn progress(&self, stage: &'static str, done: u64, total: u64) -> Result<()> {
        self.terminal.progress(stage, done, total)
    }

    fn warn(&self, text: &str) {
        self.texts.lock().unwrap_or_else(|e| e.into_inner()).push(text.into());
    }
}

/// Formats the statistics as text for people.
fn in_words(s: &Statistics) -> String {
    let [nx, ny, nz] = s.size;
    let percent = |x: f64| format!("{:.2} %", 100.0 * x);
    let share = |n: u64| percent(n as f64 / s.cells.max(1) as f64);
    [
        format!(
            "size            {nx} × {ny} × {nz} cells, {} packed",
            crate::util::error::human_bytes(s.bytes.into())
        ),
        format!("flow cells      {} ({} of all)", s.flow_cells, share(s.flow_cells)),
        format!("occupied cells  {} ({} of all)", s.occupied_cells, share(s.occupied_cells)),
        format!("alpha           {}", s.alpha),
        "over the flow cells (in brackets: theory for a built volume):".into(),
        format!("  mean rho      {:.4} (alpha/2 = {:.4})", s.rho_mean, s.alpha / 2.0),
        format!("  rho = 0       {} (30.85 %)", percent(s.rho_share_at_zero)),
        format!("  rho = alpha   {} (30.85 %)", percent(s.rho_share_at_alpha)),
        format!("  mean k_d, k_s {:.4}, {:.4}", s.k_d_mean, s.k_s_mean),
        format!("  mean v        ({:.4}, {:.4}, {:.4})", s.v_mean[0], s.v_mean[1], s.v_mean[2]),
    ]
    .join("\n")
}
