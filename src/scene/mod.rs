//! What is asked for: the scene, read strictly, checked whole before any work.

mod animation;
mod build;
mod ground;
mod keyframes;
mod open;
mod param;
mod presets;
mod print;
mod quads;
mod read;
mod value;

use std::path::{Path, PathBuf};

use glam::Vec3;

pub use animation::Animation;
pub use build::resolve;
pub use param::{Cost, GROUPS, Group, Kind, PARAMS, Param, parameters_markdown};
pub use presets::{DEFAULT as DEFAULT_PRESET, list as presets};
pub use read::{REFERENCES, Source, check_names, parse_value, set_by_hand};
pub use value::{Key, Place, Raw, Value, Values};

use crate::curve::{CurveShape, levels_for};
use crate::light::environment::{self, Environment, EnvironmentStock};
use crate::light::haze::Haze;
use crate::light::scatter::media::Media;
use crate::light::visibility::{LightVolumes, LitQuads};
use crate::light::{AngleFrame, Background, Light, Reflection, Scattering, Visibility};
use crate::mapping::Quad;
use crate::picture::{AutoExposure, Camera, Image, check_image};
use crate::place::{Ground, Mesh, Pool, Rock};
use crate::trace::{Attenuation, Lookup, Prefilter, Trace, pyramid_spec};
use crate::util::cache::Cache;
use crate::util::error::{Error, Result};
use crate::util::monitor::Monitor;
use crate::volume::{
    PyramidSpec, Storage, StorageChoice, VolumeTexture, WaterSpec, build_sparse_water, build_water,
    kept_water, read_npz, storage_of,
};

/// Most lights of a scene. No buffer is of this size: with more, and a walk to each from every cell, the least
/// tile of a picture would take longer than drivers wait.
pub const MAX_LIGHTS: usize = 4096;

/// A whole scene, valid.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Its name: the preset's, or the file's stem.
    pub name: String,
    /// The values it was made from.
    pub values: Values,
    /// How the volume is built, unless it comes from `volume_file`.
    pub water: WaterSpec,
    /// The `.npz` to take the volume from, resolved and inside the allowed folders.
    pub volume_file: Option<PathBuf>,
    /// How the volume's cells are stored.
    pub storage: Storage,
    /// What the scene says of it.
    pub asked_storage: StorageChoice,
    /// How far the volume has moved down the flow, in lengths of the volume.
    pub flow: f32,
    /// The volume's quads.
    pub quads: Vec<Quad>,
    /// The lights, those without intensity left out; the environment's sun is the last.
    pub lights: Vec<Light>,
    /// Light of the surroundings: rock's irradiance, and seen instead of the background.
    pub environment: Option<Environment>,
    /// The lights that stand for the environment in the volume, after `lights`.
    pub environment_lights: Vec<Light>,
    /// Light of the whole surroundings.
    pub ambient: Vec3,
    /// Opaque geometry.
    pub rocks: Vec<Rock>,
    /// Level water, opaque too.
    pub pools: Vec<Pool>,
    /// The walk through the volume.
    pub trace: Trace,
    /// Where angles are measured.
    pub angles: AngleFrame,
    /// Attenuation between light and cell.
    pub visibility: Visibility,
    /// Bytes that light volumes may take: at most half of what the work may use.
    pub light_cache: u64,
    /// How a cell reflects.
    pub reflection: Reflection,
    /// Whether light may be scattered more than once.
    pub scattering: Scattering,
    /// Exponent of the specular term.
    pub p: f32,
    /// The camera.
    pub camera: Camera,
    /// What is seen where nothing is.
    pub background: Background,
    /// What lies between the eye and everything.
    pub haze: Haze,
    /// Size, samples and tone.
    pub image: Image,
}

/// What the command line allows a scene.
#[derive(Clone, Debug)]
pub struct Limits {
    /// Folders besides the scene's own that references may lead into.
    pub allow_paths: Vec<PathBuf>,
    /// Bytes the work may use.
    pub memory: u64,
    /// Environments that its scenes share.
    pub environments: EnvironmentStock,
    /// Where volumes and meshes are kept for the next process.
    pub cache: Option<Cache>,
}

impl Default for Limits {
    fn default() -> Self {
        Limits {
            allow_paths: Vec::new(),
            memory: 4 << 30,
            environments: EnvironmentStock::default(),
            cache: None,
        }
    }
}

/// Puts `stops` more in place of an automatic exposure; the exposure that comes of it.
fn expose(values: &mut Values, stops: f32) -> f32 {
    let exposure = (values.float("image.exposure") + stops).clamp(-32.0, 32.0);
    let place = Place("image.auto_exposure".into());
    for (key, raw) in
        [("image.exposure", Raw::Float(exposure.into())), ("image.auto_exposure", Raw::Text("none".into()))]
    {
        values.set(key, &raw, &place).expect("inside the table's range");
    }
    exposure
}

impl Scene {
    /// Reads a preset or file, applies `--set`s in order, and checks the whole.
    pub fn load(scene: &Path, sets: &[String], limits: &Limits) -> Result<Scene> {
        let source = Source::find(scene)?;
        let mut values = source.values()?;
        let folder = read::apply_sets(&mut values, sets, &source, limits)?;
        Scene::from_values(&source.name, values, folder.as_deref(), limits)
    }

    /// Checks values that passed the table against one another. References resolve inside `folder`;
    /// without one they are trusted.
    pub fn from_values(name: &str, values: Values, folder: Option<&Path>, limits: &Limits) -> Result<Scene> {
        let v = &values;
        let size = [v.count("volume.nx"), v.count("volume.ny"), v.count("volume.nz")];
        let levels = match v.count("curves.levels") {
            0 => levels_for(size[1]).min(16),
            n => n,
        };
        let water = WaterSpec {
            size,
            across: v.count("curves.across"),
            deep: v.count("curves.deep"),
            shape: CurveShape {
                h: v.float("curves.h"),
                sigma_g_cells: v.float("curves.amplitude") * size[1] as f32,
                levels,
            },
            structure: build::structure(v),
            seed: v.int("volume.seed") as u64,
            alpha: v.float("volume.alpha"),
            k_d: v.float("volume.k_d"),
            k_s: v.float("volume.k_s"),
            k_noise: v.float("volume.k_noise"),
        };
        let volume_file = match v.text("volume.file") {
            file if file.is_empty() => None,
            file => Some(build::confine("volume.file", Path::new(&file), folder, &limits.allow_paths)?),
        };
        let asked = build::storage(v)?;
        let mut storage = Storage::Dense;
        if volume_file.is_none() {
            storage = storage_of(&water, asked, limits.memory)?;
            let curves = water.across as u128 * water.deep as u128;
            let points = curves << levels;
            if points > 1 << 36 {
                return Err(Error::input(
                    format!("curves.across × curves.deep × 2^levels makes {points} curve points"),
                    "lower curves.across, curves.deep or curves.levels: at most 6.8e10",
                ));
            }
        }
        let image = Image {
            width: v.count("image.width"),
            height: v.count("image.height"),
            samples: v.count("image.samples"),
            filter: build::filter(v),
            rock_error: v.float("image.rock_error"),
            look: build::look(v),
        };
        check_image(&image, limits.memory)?;
        let camera = build::camera(v)?;
        let trace = Trace {
            attenuation: match v.text("trace.attenuation").as_str() {
                "per-cell" => Attenuation::PerCell { tau: v.float("trace.tau") },
                _ => Attenuation::PathLength { sigma: v.float("trace.sigma") },
            },
            max_cells: v.count("trace.max_cells"),
            early_end: v.float("trace.early_end"),
            layers: v.count("trace.layers"),
            filter: match v.text("trace.filter").as_str() {
                "pyramid" => Prefilter::Pyramid,
                _ => Prefilter::None,
            },
            lookup: match v.text("trace.lookup").as_str() {
                "trilinear" => Lookup::Trilinear,
                _ => Lookup::Nearest,
            },
        };
        let environment = build::environment(v, folder, limits)?;
        let sun = environment.as_ref().and_then(Environment::sunlight);
        let environment_lights = environment.as_ref().map_or(Vec::new(), Environment::volume_lights);
        Ok(Scene {
            name: name.into(),
            water,
            volume_file,
            storage,
            asked_storage: asked,
            flow: v.float("volume.flow"),
            quads: quads::quads(v)?,
            lights: build::lights(v, sun, environment_lights.len())?,
            environment_lights,
            environment,
            ambient: v.triple("light.ambient"),
            rocks: ground::rocks(v, limits.memory)?,
            pools: ground::pools(v)?,
            trace,
            angles: if v.text("light.frame") == "texture" { AngleFrame::Texture } else { AngleFrame::World },
            visibility: match v.text("light.visibility").as_str() {
                "none" => Visibility::None,
                "cached" => Visibility::Cached,
                _ => Visibility::March,
            },
            light_cache: (u64::from(v.count("light.cache")) << 20).min(limits.memory / 2),
            reflection: match v.text("light.reflection").as_str() {
                "strand" => Reflection::Strand(build::strand(v)),
                _ => Reflection::KajiyaKay,
            },
            scattering: build::scattering(v)?,
            p: v.float("light.p"),
            camera,
            background: Background {
                zenith: v.triple("background.zenith"),
                horizon: v.triple("background.horizon"),
            },
            haze: build::haze(v),
            image,
            values,
        })
    }

    /// The same scene with `stops` more in place of an automatic exposure.
    pub fn exposed(mut self, stops: f32) -> Scene {
        let look = &mut self.image.look;
        look.exposure = expose(&mut self.values, stops);
        look.auto_exposure = AutoExposure::None;
        self
    }

    /// Builds the volume texture, or reads it from the scene's file.
    pub fn volume(&self, memory: u64, monitor: &dyn Monitor) -> Result<VolumeTexture> {
        match (&self.volume_file, self.storage) {
            (Some(path), _) => read_npz(path, self.asked_storage, memory),
            (None, Storage::Dense) => build_water(&self.water, monitor),
            (None, Storage::Sparse) => build_sparse_water(&self.water, memory, monitor),
        }
    }

    /// As [`Scene::volume`], from the cache where there is one.
    pub fn kept_volume(
        &self,
        cache: Option<&Cache>,
        memory: u64,
        monitor: &dyn Monitor,
    ) -> Result<VolumeTexture> {
        match cache {
            // A file of the size of those that are sparse would push all others out.
            Some(cache) if self.volume_file.is_none() && self.storage == Storage::Dense => {
                kept_water(&self.water, cache, monitor)
            }
            _ => self.volume(memory, monitor),
        }
    }

    /// As [`Scene::mesh`], from the cache where there is one.
    pub fn kept_mesh(&self, cache: Option<&Cache>) -> Mesh {
        cache.map_or_else(|| self.mesh(), |cache| self.ground().kept_mesh(cache))
    }

    /// The files it is made from besides its own, resolved, and the keys that name them.
    pub fn references(&self) -> Vec<(&'static str, PathBuf)> {
        let map = self.environment.as_ref().and_then(|e| match &e.source {
            environment::Source::File(path) => Some(path.clone()),
            environment::Source::Sky(_) => None,
        });
        let files = [self.volume_file.clone(), map];
        REFERENCES.into_iter().zip(files).filter_map(|(key, file)| Some((key, file?))).collect()
    }

    /// The lights that shine on the volume: the scene's own, then those that stand for its environment.
    pub fn volume_lights(&self) -> Vec<Light> {
        self.lights.iter().chain(&self.environment_lights).copied().collect()
    }

    /// What the levels of its volume are made for.
    pub fn pyramid_spec(&self, volume: &VolumeTexture) -> PyramidSpec {
        pyramid_spec(&self.trace, &self.quads, volume)
    }

    /// Plans the light volumes of a frame with a volume of `size` cells whose density is scaled by `alpha`.
    ///
    /// # Errors
    /// [`Error::Memory`] where even the coarsest need more than `budget` bytes.
    pub fn light_volumes(&self, size: [u32; 3], alpha: f32, budget: u64) -> Result<LightVolumes> {
        let lit = LitQuads {
            quads: &self.quads,
            lights: &self.volume_lights(),
            own_lights: self.lights.len(),
            eye: self.camera.eye,
            trace: &self.trace,
            scattering: self.scattering,
            size,
            alpha,
        };
        LightVolumes::new(&lit, budget)
    }

    /// The diffuse light of its materials in a volume, where light is scattered more than once.
    pub fn media(&self, volume: &VolumeTexture) -> Option<Media> {
        let make = || Media::new(&self.quads, &self.trace.attenuation, &self.reflection, self.p, volume);
        (self.scattering == Scattering::Multiple).then(make)
    }

    /// What the opaque mesh follows from.
    pub fn ground(&self) -> Ground {
        let wet = !self.pools.is_empty() || self.rocks.iter().any(|rock| rock.wet > 0.0);
        let shaded = self.rocks.iter().any(|rock| rock.shadow > 0.0);
        let sun = self.shadow_light().filter(|_| shaded).map(|i| self.lights[i].at(Vec3::ZERO).0);
        Ground {
            rocks: self.rocks.clone(),
            pools: self.pools.clone(),
            water: if wet { self.falls() } else { Vec::new() },
            sun,
        }
    }

    /// The quads that are no mist.
    pub fn falls(&self) -> Vec<[Vec3; 4]> {
        self.quads.iter().filter(|quad| quad.mist == 0.0).map(|quad| quad.corners).collect()
    }

    /// All opaque geometry as one mesh.
    pub fn mesh(&self) -> Mesh {
        self.ground().mesh()
    }

    /// Which of `lights` rock keeps from rock: the brightest directional one.
    pub fn shadow_light(&self) -> Option<usize> {
        let bright = |light: &Light| match light {
            Light::Directional { intensity, .. } => Some(intensity.element_sum()),
            _ => None,
        };
        let lights = self.lights.iter().enumerate();
        let directional = lights.filter_map(|(i, light)| Some((i, bright(light)?)));
        directional.rev().max_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i)
    }

    /// What the user may want to know about how it is rendered.
    pub fn notes(&self, volume: &VolumeTexture) -> Vec<String> {
        let mut notes = self.environment.iter().map(Environment::words).collect::<Vec<_>>();
        if volume.is_sparse() && self.asked_storage == StorageChoice::Auto {
            let [nx, ny, nz] = volume.size;
            notes.push(format!(
                "the volume of {nx}×{ny}×{nz} cells is stored sparse, {} of them: all would not fit the memory",
                volume.cells.stored().len()
            ));
        }
        notes
    }

    /// What is valid but surely not meant.
    pub fn warnings(&self, volume: &VolumeTexture) -> Vec<String> {
        let mut warnings = self.environment.as_ref().map_or(Vec::new(), Environment::warnings);
        let dark = self.environment.as_ref().is_none_or(|e| e.irradiance.0[0] == Vec3::ZERO);
        let unlit = self.lights.is_empty() && self.ambient == Vec3::ZERO && dark;
        if self.quads.is_empty() && self.rocks.is_empty() && self.pools.is_empty() {
            warnings
                .push("the scene is empty: add [[quads]] or a rock to see more than the background".into());
        } else if unlit {
            warnings.push("the scene has no light: add [lights.NAME] or light.ambient".into());
        } else if !self.quads.is_empty()
            && (volume.alpha == 0.0 || !volume.cells.stored().iter().any(|c| c.rho_code() > 0))
        {
            warnings.push("the volume is empty: no cell has density".into());
        }
        warnings
    }
}
