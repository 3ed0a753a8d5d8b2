//! Options that several commands share.

use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::Args;

use super::choice;
use super::parse::{memory, wait, whole};
use super::quiet::without_noise;
use super::terminal::Terminal;
use crate::engine::gpu::DeviceOptions;
use crate::engine::{Engine, EngineChoice};
use crate::job::Depth;
use crate::output::frame::{Compression, Exr, Format};
use crate::picture::Layer;
use crate::scene::{
    Animation, DEFAULT_PRESET, Limits, REMOVE, STDIN, Scene, Values, full_key, presets, read_stdin,
    settings_without_effect, settings_without_file,
};
use crate::util::cache::Cache;
use crate::util::error::{Error, Result};
use crate::util::monitor::Monitor;

/// Options of every command that reads a scene.
#[derive(Args, Clone)]
pub struct SceneOptions {
    /// Name of a preset (see `taki presets`), path of a scene file, such as fall.toml, or of a picture that
    /// taki wrote, or - to read the scene from stdin.
    #[arg(default_value = DEFAULT_PRESET)]
    pub scene: PathBuf,
    /// Sets a parameter of the scene, such as `--set curves.h=1.4`. The last part of a key is enough where it
    /// means one parameter: `--set h=1.4`. Can be given more than once. docs/parameters.md explains all
    /// parameters; `taki scene` prints their values.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub sets: Vec<String>,
    /// Removes a part of the scene, such as `--remove rocks.wall` or `--remove pools`, before the settings of
    /// --set apply. Can be given more than once. Short for --set remove=NAME.
    #[arg(long = "remove", value_name = "NAME")]
    pub removes: Vec<String>,
    /// Seed of the volume's random numbers. Short for --set volume.seed=N.
    #[arg(long, value_name = "N", value_parser = whole::<u64>)]
    pub seed: Option<u64>,
    /// Allows the scene to read files in this folder too. Can be given more than once.
    #[arg(long = "allow-path", value_name = "DIR")]
    pub allow_paths: Vec<PathBuf>,
    /// Memory budget, such as 6GiB (2^30 bytes each), 6GB (10^9 bytes each) or 512MiB. A number alone counts
    /// MiB. Work that would need more is refused before it starts.
    #[arg(long, value_name = "SIZE", value_parser = memory, default_value = "4GiB")]
    pub memory: u64,
    /// Settings that all others win over.
    #[arg(skip)]
    pub first: Vec<String>,
}

impl SceneOptions {
    /// Begins work that a signal asks to stop. A scene on stdin is read before: it may take any time to
    /// come, and until then a signal has nothing to clean up.
    pub fn begin(&self, terminal: &Terminal) {
        if self.scene == Path::new(STDIN) {
            read_stdin();
        }
        terminal.watch();
    }

    pub fn limits(&self) -> Limits {
        Limits { allow_paths: self.allow_paths.clone(), memory: self.memory, ..Limits::default() }
    }

    /// Loads the scene. `more` holds settings from other options; they override --set.
    pub fn load(&self, more: &[String]) -> Result<Scene> {
        self.check_sets()?;
        Scene::load(&self.scene, &self.all_sets(more), &self.limits())
    }

    /// Loads the scene's animation. `more` is as in [`SceneOptions::load`].
    pub fn animation(&self, more: &[String], limits: &Limits) -> Result<Animation> {
        self.check_sets()?;
        Animation::load(&self.scene, &self.all_sets(more), limits)
    }

    /// Refuses a setting written with a space, as in `--set h 1.2`, whose value was taken for the scene.
    fn check_sets(&self) -> Result<()> {
        let scene = self.scene.to_string_lossy();
        if presets().any(|(name, _)| name == scene) || scene == STDIN || self.scene.exists() {
            return Ok(());
        }
        match self.sets.iter().find(|set| !set.contains('=')) {
            Some(set) => Err(Error::Usage(format!("--set {set} has no value; write --set {set}={scene}"))),
            None => Ok(()),
        }
    }

    /// Warns of settings and sweeps that have no effect.
    pub fn warn_of_settings(&self, values: &Values, sweeps: &[String], terminal: &Terminal) {
        let without = settings_without_effect(values, &self.own_sets(), sweeps);
        // A map without effect is warned of by the scene itself, wherever it comes from.
        let said_later = |text: &&String| text.starts_with("environment.file ");
        without.iter().filter(|text| !said_later(text)).for_each(|text| terminal.warn(text));
    }

    /// Warns of settings that `more`, the settings of other options, replace.
    pub fn warn_of_replaced(&self, values: &Values, more: &[String], terminal: &Terminal) {
        let key = |setting: &str| full_key(setting.split('=').next()?.trim(), values).ok();
        for setting in self.own_sets() {
            let replaces = |other: &&String| key(other).is_some() && key(other) == key(&setting);
            if let Some(other) = more.iter().find(replaces) {
                terminal.warn(&format!("{setting} has no effect: another option sets {other}"));
            }
        }
    }

    /// Warns of settings that have no effect on files of these kinds: pictures `as_shown`, and those of
    /// `linear` light.
    pub fn warn_of_files(&self, values: &Values, as_shown: bool, linear: bool, terminal: &Terminal) {
        let without = settings_without_file(values, &self.own_sets(), as_shown, linear);
        without.iter().for_each(|text| terminal.warn(text));
    }

    /// Warns where a picture stands in place of its scene and is asked for another frame than its own.
    pub fn warn_of_moved(&self, frame: i32, terminal: &Terminal) {
        if frame != 0 && Format::of(&self.scene).is_some() {
            terminal.warn(&format!(
                "{} holds the scene of its own frame, and frame {frame} counts from there; leave the frame \
                 out to get that picture again, or give the scene file for a frame of its animation",
                self.scene.display()
            ));
        }
    }

    /// Returns the settings of --remove, `first`, those of --set and --seed, and then `more`.
    pub fn all_sets(&self, more: &[String]) -> Vec<String> {
        let removes = self.removes.iter().map(|name| format!("{REMOVE}={name}"));
        let first = self.first.iter().cloned();
        removes.chain(first).chain(self.own_sets()).chain(more.iter().cloned()).collect()
    }

    /// Returns the settings of --set and --seed.
    pub fn own_sets(&self) -> Vec<String> {
        let seed = self.seed.map(|n| format!("volume.seed={n}"));
        self.sets.iter().cloned().chain(seed).collect()
    }
}

/// Options of commands that render.
#[derive(Args, Clone)]
pub struct CacheOptions {
    /// Rebuilds volumes and meshes instead of reusing those of earlier runs, and stores none for later runs.
    #[arg(long)]
    pub no_cache: bool,
}

impl CacheOptions {
    pub fn add_to(&self, limits: Limits) -> Limits {
        let cache = (!self.no_cache).then(Cache::of_user).flatten();
        Limits { cache, ..limits }
    }
}

/// Options of commands that write developed pictures.
#[derive(Args, Clone)]
pub struct DepthOptions {
    /// Bits per channel of .png and .tif files: 8 or 16. Default: 8 for .png, 16 for .tif. The other formats
    /// of developed pictures always have 8.
    #[arg(long, value_name = "N", value_parser = choice::bits())]
    pub bits: Option<u8>,
    /// Writes .png and .tif files with 16 bits of linear light, for programs that grade or composite. Needs
    /// --set image.tone=none; light above 1 is cut off, so prefer .exr where you can.
    #[arg(long)]
    pub linear: bool,
}

impl DepthOptions {
    pub fn depth(&self) -> Depth {
        Depth { bits: self.bits, linear: self.linear }
    }
}

/// Options of commands that write EXR files.
#[derive(Args, Clone)]
pub struct ExrOptions {
    /// Stores colours, transmittance and normals of EXR files as half floats: half of the size, three digits.
    /// Depths, numbers and texture coordinates stay floats.
    #[arg(long)]
    pub half: bool,
    /// Compression of EXR files. All methods are lossless. Default: zip; zips where 16 lines of the picture
    /// take more than 8 MiB.
    #[arg(long, value_parser = choice::compression(), value_name = "METHOD")]
    pub compression: Option<Compression>,
}

/// Options that choose the layers of EXR files.
#[derive(Args, Clone)]
pub struct LayerOptions {
    /// Layers of EXR files, separated by commas. Default: all. Example: --layers rgb,depth
    #[arg(long, value_parser = choice::layer(), value_delimiter = ',', value_name = "A,B,…")]
    pub layers: Option<Vec<Layer>>,
    /// Writes each layer into an EXR file of its own: -o fall.exr gives fall.rgb.exr, fall.depth.exr and so
    /// on.
    #[arg(long)]
    pub split_layers: bool,
    #[command(flatten)]
    pub pixels: ExrOptions,
}

impl LayerOptions {
    pub fn exr(&self) -> Exr {
        let ExrOptions { half, compression } = self.pixels;
        let mut layers = Vec::new();
        for layer in self.layers.as_deref().unwrap_or(&Layer::ALL) {
            // A layer given twice is written once.
            if !layers.contains(layer) {
                layers.push(*layer);
            }
        }
        Exr { half, compression, split: self.split_layers, ..Exr::of(&layers) }
    }

    /// Refuses the options where no EXR is written.
    pub fn check(&self, has_exr: bool) -> Result<()> {
        let given = [
            ("--layers", self.layers.is_some()),
            ("--half", self.pixels.half),
            ("--compression", self.pixels.compression.is_some()),
            ("--split-layers", self.split_layers),
        ];
        match given.into_iter().find(|(_, given)| *given && !has_exr) {
            Some((option, _)) => Err(Error::Usage(format!("{option} needs an EXR file; add -o FILE.exr"))),
            None => Ok(()),
        }
    }
}

/// Options that choose the engine and its device.
#[derive(Args, Clone)]
pub struct EngineOptions {
    /// Engine that renders. auto uses a GPU if there is one, otherwise the CPU; software Vulkan is slower.
    #[arg(long, value_parser = choice::engine(), default_value = "auto")]
    pub engine: EngineChoice,
    /// Uses the GPU adapter whose name contains this text, such as `--adapter nvidia`. `taki devices` lists
    /// all.
    #[arg(long, value_name = "NAME")]
    pub adapter: Option<String>,
    /// Longest wait for one piece of GPU work, in seconds. After that, taki exits with code 124.
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0, value_parser = wait)]
    pub watchdog: f64,
}

impl EngineOptions {
    /// Opens the engine. Returns it with a line that tells what it runs on.
    pub fn open(&self) -> Result<(Engine, String)> {
        self.check()?;
        without_noise(|| Engine::open(self.engine, &self.device()))
    }

    /// Checks that the options fit one another.
    pub fn check(&self) -> Result<()> {
        if self.engine == EngineChoice::Cpu && self.adapter.is_some() {
            let what = "--adapter chooses a GPU, which --engine cpu does not use; leave out one of them";
            return Err(Error::Usage(what.into()));
        }
        Ok(())
    }

    pub fn device(&self) -> DeviceOptions {
        DeviceOptions { adapter: self.adapter.clone(), watchdog: Duration::from_secs_f64(self.watchdog) }
    }
}
