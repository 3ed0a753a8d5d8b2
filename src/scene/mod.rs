//! Reading of scenes: files, presets and `--set`, all checked before any work begins.

mod animation;
mod boxes;
mod budget;
mod build;
mod effect;
mod ground;
mod keyframes;
mod matter;
mod measured;
mod meshes;
mod names;
mod open;
mod origin;
mod param;
mod presets;
mod print;
mod quads;
mod read;
mod record;
mod remove;
mod sequence;
mod shot;
mod slips;
mod typed;
mod value;
mod volumes;

use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::Vec3;

pub use animation::Animation;
pub use boxes::SceneBox;
pub use build::resolve;
pub use effect::{is_of_other_builder, settings_without_effect, settings_without_file, without_effect};
pub use meshes::{
    Becomes, Loaded, ModelMemo, PartSummary, Projection, SceneMesh, box_corners, mesh_place, turn_of,
};
pub use names::{NAMED, check_names, full_key, likeliest, unknown_key};
pub use param::{
    Cost, GROUPS, Group, Kind, PARAMS, Param, WATER, key_of_volume, parameters_markdown, split_volume_key,
};
pub use presets::{DEFAULT as DEFAULT_PRESET, list as presets};
pub use read::{STDIN, Source, has_reference_by_hand, read_stdin, reference_keys};
pub use record::{MAP_COMMENT, Record, VOLUME_COMMENT};
pub use remove::REMOVE;
pub use sequence::numbers_in;
pub use typed::{fraction, parse_value};
pub use value::{Key, Place, Raw, Value, Values};
pub use volumes::{MAX_VOLUMES, Recipe};

use crate::grid;
use crate::light::environment::{self, Environment, EnvironmentMemo};
use crate::light::haze::Haze;
use crate::light::scatter::media::{Media, scattering};
use crate::light::scatter::optics::ShellOptics;
use crate::light::visibility::{LightVolumes, LitQuads};
use crate::light::{AngleFrame, Background, Light, Reflection, Scattering, Visibility, VolumeReflection};
use crate::mapping::Quad;
use crate::mapping::shell::{HullFace, Shell};
use crate::picture::camera::DepthRange;
use crate::picture::{AutoExposure, Camera, Image, Lens, check_image};
use crate::place::paint::coarsened;
use crate::place::paint::texture::MOST_BYTES;
use crate::place::{
    DiffuseKey, DiffuseOfShells, Ground, Mesh, MeshShade, Pool, Rock, ShadeMemo, ShadedWater, ShellShadows,
    Triangles, Veil, WaterFaces,
};
use crate::trace::{Attenuation, Trace, pyramid_spec};
use crate::util::cache::Cache;
use crate::util::error::Result;
use crate::util::monitor::Monitor;
use crate::volume::{PyramidSpec, StorageChoice, VolumeTexture};

/// Largest number of lights in a scene. No buffer has this size. Every cell walks to every light, and with
/// more lights even the smallest tile of a picture would run into the driver's timeout.
pub const MAX_LIGHTS: usize = 4096;

/// A complete, valid scene: the values that were written, and the [`Parts`] they resolve to.
///
/// It dereferences to its parts. They change only with the values, by [`Scene::with`]; or by [`Scene::edit`],
/// which gives up the values. So the two never disagree.
#[derive(Clone, Debug)]
pub struct Scene {
    /// None after the parts were edited.
    values: Option<Values>,
    parts: Parts,
    /// Record of the picture that the scene was read from.
    record: Option<Record>,
}

impl Deref for Scene {
    type Target = Parts;

    fn deref(&self) -> &Parts {
        &self.parts
    }
}

/// The resolved parts of a scene.
#[derive(Clone, Debug)]
pub struct Parts {
    /// Name: the preset's, or the stem of the file.
    pub name: String,
    /// Volumes that the quads show, at least one. A quad's material has the number of its volume.
    pub recipes: Vec<Recipe>,
    /// Distance that the waves of pools have moved, in lengths of the volume `water`, with which they move.
    pub wave_flow: f32,
    /// Distance that they move while the shutter is open, in the same lengths.
    pub wave_moves: f32,
    /// Quads that the volumes are mapped to.
    pub quads: Vec<Quad>,
    /// Shells of the volume: those of meshes, then those of boxes.
    pub shells: Vec<Arc<Shell>>,
    /// Boxes that a volume fills once.
    pub boxes: Vec<SceneBox>,
    /// Lights with an intensity above 0; the environment's sun is the last.
    pub lights: Vec<Light>,
    /// Light of the surroundings. It lights rock and is seen in place of the background.
    pub environment: Option<Environment>,
    /// Directional lights that stand for the environment in the volume; they follow `lights`.
    pub environment_lights: Vec<Light>,
    /// Light from everywhere, linear RGB.
    pub ambient: Vec3,
    /// Shares of the surroundings' light and of the sun's that falling water loses where rocks and meshes
    /// hide them, 0 to 1. The second is also the strength of the water's own shadow.
    pub water_shade: [f32; 2],
    /// Opaque rocks.
    pub rocks: Vec<Rock>,
    /// Level water, opaque too.
    pub pools: Vec<Pool>,
    /// Opaque triangles of other programs' meshes.
    pub triangles: Vec<Triangles>,
    /// What the shade of the triangles and the shadows on shells were made of; scenes of one run share it.
    pub shades: ShadeMemo,
    /// Meshes of other programs, with what their parts became: quads, shells and triangles.
    pub meshes: Vec<SceneMesh>,
    /// Names of meshes with faces that carry no volume because they have no area in the texture, and the
    /// number of those faces.
    pub unmapped: Vec<(String, u64)>,
    /// Sentences about textures whose coordinates a mesh lacks.
    pub untextured: Vec<String>,
    /// Settings of the walk through the volume.
    pub trace: Trace,
    /// Space in which angles are measured.
    pub angles: AngleFrame,
    /// Attenuation between light and cell.
    pub visibility: Visibility,
    /// Budget of the light volumes, bytes; at most half of [`Limits::memory`].
    pub light_cache: u64,
    /// Reflection of a cell.
    pub reflection: Reflection,
    /// Single or multiple scattering.
    pub scattering: Scattering,
    /// Exponent of the specular term.
    pub p: f32,
    /// Camera.
    pub camera: Camera,
    /// Lens of the camera; `None` for a pinhole.
    pub lens: Option<Lens>,
    /// Radiance where a ray meets nothing.
    pub background: Background,
    /// Haze between the eye and everything else.
    pub haze: Haze,
    /// Size, samples and tone of the picture.
    pub image: Image,
}

/// What the raster pass finds under a pixel: a surface through which a ray enters a volume.
#[derive(Clone, Copy, Debug)]
pub enum Face<'a> {
    /// A quad.
    Quad(&'a Quad),
    /// A face of the hull of a shell, and the shell's number.
    Hull(usize, &'a HullFace),
}

impl Parts {
    /// Returns a face by its number: quads come first, then the hulls of the shells.
    ///
    /// # Panics
    /// If there is no such face.
    pub fn face(&self, number: usize) -> Face<'_> {
        if let Some(quad) = self.quads.get(number) {
            return Face::Quad(quad);
        }
        let mut left = number - self.quads.len();
        for (i, shell) in self.shells.iter().enumerate() {
            match shell.hull.get(left) {
                Some(face) => return Face::Hull(i, face),
                None => left -= shell.hull.len(),
            }
        }
        panic!("the scene has no face {number}")
    }

    /// Returns the unit normal of a face at the coordinates `uv` on it, on the side that the eye sees.
    ///
    /// # Panics
    /// If there is no such face.
    pub fn seen_normal(&self, number: usize, uv: [f32; 2]) -> Vec3 {
        match self.face(number) {
            Face::Quad(Quad { map, .. }) => {
                let to_eye = self.camera.eye_local().as_vec3() - map.point_world(uv[0], uv[1]);
                map.n_world * if map.n_world.dot(to_eye) < 0.0 { -1.0 } else { 1.0 }
            }
            Face::Hull(_, face) if face.is_eye() => -self.camera.forward.as_vec3(),
            // Only faces that the eye sees from outside are drawn.
            Face::Hull(shell, face) => {
                let [a, b, c] = self.shells[shell].corners(face).map(|p| p.as_dvec3());
                (b - a).cross(c - a).normalize_or_zero().as_vec3()
            }
        }
    }

    /// Returns the number of the volume that a face shows.
    ///
    /// # Panics
    /// If there is no such face.
    pub fn volume_of_face(&self, number: usize) -> usize {
        match self.face(number) {
            Face::Quad(quad) => quad.material.volume as usize,
            Face::Hull(shell, _) => self.shells[shell].volume as usize,
        }
    }
}

/// Limits that the command line sets for a scene.
#[derive(Clone, Debug)]
pub struct Limits {
    /// Folders, besides the scene's own, that references may lead into.
    pub allow_paths: Vec<PathBuf>,
    /// Memory that the work may use, bytes.
    pub memory: u64,
    /// Environments that the scenes share.
    pub environments: EnvironmentMemo,
    /// Files of meshes that the scenes share.
    pub models: ModelMemo,
    /// Disk cache of volumes and meshes, shared with later processes.
    pub cache: Option<Cache>,
}

impl Default for Limits {
    fn default() -> Self {
        Limits {
            allow_paths: Vec::new(),
            memory: 4 << 30,
            environments: EnvironmentMemo::default(),
            models: ModelMemo::default(),
            cache: None,
        }
    }
}

/// Component of a light's colour above which it is taken for one from 0 to 255: `intensity` is for
/// brightness.
const BRIGHT_COLOUR: f32 = 64.0;

/// Returns an exposure with more stops, within the range of `image.exposure`.
fn exposure_with(exposure: f32, stops: f32) -> f32 {
    (exposure + stops).clamp(-32.0, 32.0)
}

/// Replaces an automatic exposure by `stops` added to `image.exposure`. Returns the resulting exposure, in
/// stops.
fn expose(values: &mut Values, stops: f32) -> f32 {
    let exposure = exposure_with(values.float("image.exposure"), stops);
    let place = Place("image.auto_exposure".into());
    let none = AutoExposure::None.word();
    for (key, raw) in
        [("image.exposure", Raw::Float(exposure.into())), ("image.auto_exposure", Raw::Text(none.into()))]
    {
        values.set(key, &raw, &place).expect("inside the table's range");
    }
    exposure
}

impl Scene {
    /// Reads a preset or file, applies the `--set`s in order and checks the result.
    ///
    /// # Errors
    /// `Error::Usage` where a `--set` has no value. `Error::Io` where a file cannot be read. Otherwise those
    /// of [`Scene::from_values`].
    pub fn load(scene: &Path, sets: &[String], limits: &Limits) -> Result<Scene> {
        Scene::of_source(&Source::find(scene)?, sets, limits)
    }

    /// Makes a scene of its text, as [`Scene::load`] does.
    ///
    /// # Errors
    /// Those of [`Scene::load`].
    pub fn of_source(source: &Source, sets: &[String], limits: &Limits) -> Result<Scene> {
        let mut values = source.values()?;
        let record = Record::of(&source.text, &mut values);
        let folder = read::apply_sets(&mut values, sets, source, limits)?;
        record.as_ref().map_or(Ok(()), |record| record.check_map(&values))?;
        Ok(Scene::from_values(&source.name, values, folder.as_deref(), limits)?.recorded(record))
    }

    /// Makes a scene of values that the table accepted, and checks them against one another.
    ///
    /// References resolve inside `folder`. Without a folder they are trusted.
    ///
    /// # Errors
    /// `Error::Input` where values do not fit one another or a file is unusable, `Error::Memory` where the
    /// work needs more than [`Limits::memory`].
    pub fn from_values(name: &str, values: Values, folder: Option<&Path>, limits: &Limits) -> Result<Scene> {
        let v = &values;
        let recipes = volumes::recipes(v, folder, limits)?;
        let image = build::image(v);
        check_image(&image, limits.memory)?;
        let meshes = meshes::read(v, folder, limits)?;
        let boxes = boxes::read(v, &recipes)?;
        let origin = origin::origin(v, &meshes, &boxes);
        let of_file = meshes::with_camera(v, &meshes, 0.0)?;
        let of_camera = of_file.as_ref().unwrap_or(v);
        let camera = build::camera(of_camera, origin)?;
        let environment = build::environment(v, folder, limits)?;
        let sun = environment.as_ref().and_then(Environment::sunlight);
        let environment_lights = environment.as_ref().map_or(Vec::new(), Environment::volume_lights);
        let mut quads = quads::quads(v, origin, camera.eye_local().as_vec3(), &recipes)?;
        let surfaces = meshes::build(v, &meshes, origin, &recipes, quads.len(), limits)?;
        quads.extend(surfaces.quads);
        let mut shells = surfaces.shells;
        shells.extend(boxes::shells(v, &boxes, origin, &recipes)?);
        let lights = meshes::lights(&meshes, origin)?;
        let mut parts = Parts {
            name: name.into(),
            quads,
            shells,
            boxes,
            recipes,
            wave_flow: v.float("volume.flow"),
            wave_moves: volumes::exposed_flow(v),
            lights: build::lights(v, origin, lights, sun, environment_lights.len())?,
            environment_lights,
            environment,
            ambient: v.triple("light.ambient"),
            water_shade: [v.float("light.occlusion"), v.float("light.shadow")],
            rocks: ground::rocks(v, origin, limits.memory)?,
            pools: ground::pools(v, origin)?,
            triangles: surfaces.triangles,
            shades: limits.models.shades.clone(),
            meshes,
            unmapped: surfaces.unmapped,
            untextured: surfaces.untextured,
            trace: build::trace(v),
            angles: v.choice("light.frame", AngleFrame::from_word),
            visibility: v.choice("light.visibility", Visibility::from_word),
            light_cache: (u64::from(v.count("light.cache")) << 20).min(limits.memory / 2),
            reflection: build::reflection(v)?,
            scattering: build::scattering(v)?,
            p: v.float("light.p"),
            camera,
            lens: build::lens(of_camera, &camera),
            background: build::background(v),
            haze: build::haze(v, origin),
            image,
        };
        parts.choose_storages(limits.memory)?;
        Ok(Scene { values: Some(values), parts, record: None })
    }

    /// Returns the values that the scene was made from; `None` after [`Scene::edit`].
    pub fn values(&self) -> Option<&Values> {
        self.values.as_ref()
    }

    /// Returns the parts to change them freely, as no scene file could. The scene has no values from then on,
    /// and the pictures made of it do not tell a scene.
    pub fn edit(&mut self) -> &mut Parts {
        self.values = None;
        &mut self.parts
    }

    /// Returns the values of a scene that only files and [`Scene::with`] have changed.
    ///
    /// # Panics
    /// After [`Scene::edit`].
    pub(crate) fn written(&self) -> &Values {
        self.values.as_ref().expect("the scene was not edited by code")
    }

    /// Replaces the automatic exposure by `stops` added to the scene's exposure.
    pub fn exposed(mut self, stops: f32) -> Scene {
        let look = &mut self.parts.image.look;
        look.auto_exposure = AutoExposure::None;
        match &mut self.values {
            Some(values) => look.exposure = expose(values, stops),
            None => look.exposure = exposure_with(look.exposure, stops),
        }
        self
    }

    /// Returns [`Scene::mesh`], from the cache where it is stored there.
    pub fn cached_mesh(&self, cache: Option<&Cache>) -> Mesh {
        let ground = self.ground();
        match cache {
            Some(cache) => ground.cached_mesh(&self.shades, cache),
            None => ground.mesh(&self.shades),
        }
    }

    /// Returns the files that the scene refers to, resolved, with the keys that name them.
    pub fn references(&self) -> Vec<(String, PathBuf)> {
        let on_disk = |file: &PathBuf| grid::own(file).is_none();
        let volume = |recipe: &Recipe| Some((recipe.file_key(), recipe.file.clone().filter(on_disk)?));
        let map = self.environment.as_ref().and_then(|e| match &e.source {
            environment::Source::File(path) => Some(("environment.file".to_owned(), path.clone())),
            environment::Source::Sky(_) => None,
        });
        // The program brings the presets' own meshes and grids.
        let own = self.meshes.iter().filter(|mesh| presets::mesh(&mesh.file).is_none());
        let meshes = own.map(|m| (format!("meshes.{}.file", m.name), m.file.clone()));
        self.recipes.iter().filter_map(volume).chain(map).chain(meshes).collect()
    }

    /// Returns the lights that shine on the volume: the scene's own, then those that stand for its
    /// environment.
    pub fn volume_lights(&self) -> Vec<Light> {
        self.lights.iter().chain(&self.environment_lights).copied().collect()
    }

    /// Returns the specification of the coarse levels of the first volume.
    pub fn pyramid_spec(&self, volume: &VolumeTexture) -> PyramidSpec {
        pyramid_spec(&self.trace, &self.quads, &self.shells, 0, volume)
    }

    /// Returns the specification of the coarse levels of each volume.
    pub fn pyramid_specs(&self, volumes: &[VolumeTexture]) -> Vec<PyramidSpec> {
        let spec = |(volume, number)| pyramid_spec(&self.trace, &self.quads, &self.shells, number, volume);
        volumes.iter().zip(0..).map(spec).collect()
    }

    /// Plans the light volumes of a frame, within the budget of the scene: with cached visibility, and in
    /// place of walks to the lights where light volumes equal them. `None` where rays walk, or nothing is
    /// attenuated.
    ///
    /// # Errors
    /// With cached visibility, `Error::Memory` where even the coarsest light volumes need more than the
    /// budget.
    pub fn light_plan(
        &self,
        volumes: &(impl AsRef<[VolumeTexture]> + ?Sized),
    ) -> Result<Option<LightVolumes>> {
        let volumes = volumes.as_ref();
        match self.visibility {
            Visibility::None => Ok(None),
            Visibility::Cached => self.light_volumes(volumes, self.light_cache).map(Some),
            // Cells of a sparse volume are filled one by one, as they are walked.
            Visibility::March if volumes.iter().any(VolumeTexture::is_sparse) => Ok(None),
            Visibility::March => {
                let lights = self.volume_lights();
                let lit = self.lit_quads(&lights, volumes);
                let Image { width, height, samples, .. } = self.image;
                let rays = u64::from(width) * u64::from(height) * u64::from(samples);
                Ok(LightVolumes::exact(&lit, rays, self.light_cache))
            }
        }
    }

    /// Plans the light volumes of a frame with volumes of these sizes and scales of the density.
    ///
    /// # Errors
    /// `Error::Memory` where even the coarsest light volumes need more than `budget` bytes.
    pub fn light_volumes(
        &self,
        volumes: &(impl AsRef<[VolumeTexture]> + ?Sized),
        budget: u64,
    ) -> Result<LightVolumes> {
        LightVolumes::new(&self.lit_quads(&self.volume_lights(), volumes.as_ref()), budget)
    }

    fn lit_quads<'a>(&'a self, lights: &'a [Light], volumes: &'a [VolumeTexture]) -> LitQuads<'a> {
        LitQuads {
            quads: &self.quads,
            lights,
            own_lights: self.lights.len(),
            eye: self.camera.eye_local(),
            trace: &self.trace,
            scattering: self.scattering,
            volumes,
        }
    }

    /// Returns the media of diffuse light, one for each material in its volume; `None` with single
    /// scattering.
    pub fn media(&self, volumes: &(impl AsRef<[VolumeTexture]> + ?Sized)) -> Option<Media> {
        let volumes = volumes.as_ref();
        let reflections: Vec<&Reflection> =
            (0..volumes.len()).map(|volume| self.reflection_of(volume)).collect();
        let make = || Media::new(&self.quads, &self.trace.attenuation, &reflections, self.p, volumes);
        (self.scattering == Scattering::Multiple).then(make)
    }

    /// Returns how the matter of each volume scatters light many times where shells show it; `None` where
    /// light scatters once.
    pub fn shell_optics(&self, volumes: &[VolumeTexture]) -> Vec<Option<ShellOptics>> {
        let is_multiple = self.scattering == Scattering::Multiple && !self.shells.is_empty();
        let of = |(i, (recipe, volume)): (usize, (&Recipe, &VolumeTexture))| {
            let reflection = self.reflection_of(i);
            let fibres = || scattering(reflection, self.p, volume, recipe.ramp.even_k_s());
            let of_fibres = || is_multiple.then(|| ShellOptics::of_fibres(&fibres().similarity()));
            recipe.skin.or_else(of_fibres)
        };
        self.recipes.iter().zip(volumes).enumerate().map(of).collect()
    }

    /// Returns the reflection model of the cells of volume number `volume`.
    pub fn reflection_of(&self, volume: usize) -> &Reflection {
        match self.recipes[volume].reflection {
            VolumeReflection::Scene => &self.reflection,
            VolumeReflection::KajiyaKay => &Reflection::KajiyaKay,
        }
    }

    /// Whether the cells of any volume keep the lines of their strands.
    pub fn keeps_lines(&self) -> bool {
        self.recipes.iter().any(Recipe::has_lines)
    }

    /// Whether the cells of any volume reflect as strands do.
    pub fn has_strands(&self) -> bool {
        (0..self.recipes.len()).any(|volume| self.reflection_of(volume).strands().is_some())
    }

    /// Whether the cells of all volumes do.
    pub fn has_strands_alone(&self) -> bool {
        (0..self.recipes.len()).all(|volume| self.reflection_of(volume).strands().is_some())
    }

    /// Whether light scatters many times where shells show the volume of this number.
    pub fn scatters_many_times(&self, volume: usize) -> bool {
        self.scattering == Scattering::Multiple || self.recipes[volume].skin.is_some()
    }

    /// Returns everything that determines the opaque mesh.
    pub fn ground(&self) -> Ground {
        let shades = || self.triangles.iter().map(|own| own.shade);
        let wet = self.rocks.iter().any(|rock| rock.wet > 0.0) || shades().any(|shade| shade.wet > 0.0);
        let [hides_sky, hides_sun] = self.hides_light();
        let sun = self.shadow_light().filter(|_| hides_sun).map(|i| self.lights[i].at(Vec3::ZERO).0);
        let [occlusion, shadow] = self.water_shade;
        let occlusion = if hides_sky { occlusion } else { 0.0 };
        let shadow = if sun.is_some() { shadow } else { 0.0 };
        let veils = match occlusion > 0.0 || shadow > 0.0 {
            true => self.quads.iter().map(Veil::of).collect(),
            false => Vec::new(),
        };
        Ground {
            shaded_water: ShadedWater { occlusion, shadow, veils },
            rocks: self.rocks.clone(),
            pools: self.pools.clone(),
            triangles: self.triangles.clone(),
            water: if wet || !self.pools.is_empty() { self.falls() } else { Vec::new() },
            water_faces: if wet { self.water_faces() } else { WaterFaces::default() },
            sun,
            origin: self.camera.origin,
        }
    }

    /// Whether any rock or mesh hides the surroundings' light, and the sun's.
    fn hides_light(&self) -> [bool; 2] {
        let any = |of_rock: fn(&Rock) -> f32, of_mesh: fn(&MeshShade) -> f32| {
            self.rocks.iter().any(|rock| of_rock(rock) > 0.0)
                || self.triangles.iter().any(|own| of_mesh(&own.shade) > 0.0)
        };
        [any(|rock| rock.occlusion, |mesh| mesh.occlusion), any(|rock| rock.shadow, |mesh| mesh.shadow)]
    }

    /// Returns the corners of the quads that are not mist, metres.
    pub fn falls(&self) -> Vec<[Vec3; 4]> {
        self.quads.iter().filter(|quad| quad.mist == 0.0).map(|quad| quad.corners).collect()
    }

    /// Returns the triangles around the shells that hold water. Fibres that stand out of a surface are none,
    /// and the sides of a box are no surface of water.
    fn water_faces(&self) -> WaterFaces {
        let holds_water = |shell: &Shell| self.recipes[shell.volume as usize].matter.is_none();
        let is_water = |shell: &&Arc<Shell>| !shell.is_single && holds_water(shell);
        let shells = self.shells.iter().filter(is_water);
        WaterFaces(shells.flat_map(|shell| shell.hull.iter().map(|face| shell.corners(face))).collect())
    }

    /// Returns the depths of the scene, whose opaque mesh is `mesh`.
    pub fn depth_range(&self, mesh: &Mesh) -> DepthRange {
        let quads = self.quads.iter().map(|quad| {
            let [a, b, c, d] = quad.corners;
            [a.min(b).min(c).min(d), a.max(b).max(c).max(d)]
        });
        let shells = self.shells.iter().map(|shell| shell.bounds());
        let tiles = mesh.tiles.iter().map(|tile| [tile.low, tile.high]);
        self.camera.depth_range(quads.chain(shells).chain(tiles))
    }

    /// Returns the shadows that the scene's opaque `mesh` and the skins of shells cast on shells. They are
    /// kept until the mesh, the shells or the lights change. `None` without shadows: nothing hides a light,
    /// or `light.visibility` is `none`.
    ///
    /// # Errors
    /// Errors of `monitor`, which may stop the work.
    pub fn shadows_on_shells(&self, mesh: &Mesh, monitor: &dyn Monitor) -> Result<Option<Arc<ShellShadows>>> {
        let lights = self.volume_lights();
        if self.shells.is_empty() || self.visibility == Visibility::None || lights.is_empty() {
            return Ok(None);
        }
        self.shades.shadows_on_shells(mesh, &self.shells, &lights, monitor)
    }

    /// Returns the diffuse light in the shells with optics ([`Scene::shell_optics`]), shell by shell. `mesh`
    /// is the scene's opaque mesh, and `shadows` are those of [`Scene::shadows_on_shells`]. It is kept until
    /// something else than the camera changes. `None` where no shell has optics.
    ///
    /// # Errors
    /// Errors of `monitor`, which may stop the work.
    pub fn diffuse_on_shells(
        &self,
        volumes: &[VolumeTexture],
        mesh: &Mesh,
        shadows: Option<&Arc<ShellShadows>>,
        monitor: &dyn Monitor,
    ) -> Result<Option<Arc<DiffuseOfShells>>> {
        let optics = self.shell_optics(volumes);
        if !self.shells.iter().any(|shell| optics[shell.volume as usize].is_some()) {
            return Ok(None);
        }
        let Attenuation::PathLength { sigma } = self.trace.attenuation else { return Ok(None) };
        let key = DiffuseKey {
            shells: self.shells.clone(),
            volumes: volumes.to_vec(),
            ramps: self.recipes.iter().map(|recipe| recipe.ramp).collect(),
            optics,
            sigma,
            lights: self.volume_lights(),
            ambient: self.ambient,
            shadows: shadows.cloned(),
            vertices: mesh.vertices.clone(),
        };
        self.shades.diffuse_in_shells(key, monitor).map(Some)
    }

    /// Builds all opaque geometry as one mesh.
    pub fn mesh(&self) -> Mesh {
        self.ground().mesh(&self.shades)
    }

    /// Returns the index in `lights` of the light whose shadows rocks and meshes cast on one another: the
    /// brightest directional one.
    pub fn shadow_light(&self) -> Option<usize> {
        let bright = |light: &Light| match light {
            Light::Directional { intensity, .. } => Some(intensity.element_sum()),
            _ => None,
        };
        let lights = self.lights.iter().enumerate();
        let directional = lights.filter_map(|(i, light)| Some((i, bright(light)?)));
        directional.rev().max_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i)
    }

    /// Returns notes on how the scene is rendered.
    pub fn notes(&self, volumes: &(impl AsRef<[VolumeTexture]> + ?Sized)) -> Vec<String> {
        let mut notes = self.environment.iter().map(Environment::words).collect::<Vec<_>>();
        let volumes = volumes.as_ref().iter().enumerate();
        notes.extend(volumes.filter_map(|(number, volume)| self.note_on_volume(number, volume)));
        notes
    }

    /// Returns the note on the storage of volume `number`, if the user did not ask for it.
    pub(crate) fn note_on_volume(&self, number: usize, volume: &VolumeTexture) -> Option<String> {
        let recipe = &self.recipes[number];
        let [nx, ny, nz] = volume.size;
        let note = || {
            format!(
                "{} of {}'s {nx}×{ny}×{nz} cells are stored (sparse): all of them would not fit into memory",
                volume.cells.stored().len(),
                self.volume_words(recipe),
            )
        };
        (volume.is_sparse() && recipe.asked_storage == StorageChoice::Auto).then(note)
    }

    /// Returns what sentences call a volume. Its name is said only where there are several.
    fn volume_words(&self, recipe: &Recipe) -> String {
        match self.recipes.len() {
            1 => "the volume".into(),
            _ => format!("the volume {}", recipe.name),
        }
    }

    /// Whether the eye sees the back of a rock's patch.
    fn is_behind(&self, rock: &Rock) -> bool {
        let [a, b, c, d] = rock.corners;
        let eye = self.camera.eye_local().as_vec3();
        (c - a).cross(d - b).dot(eye - (a + b + c + d) / 4.0) < 0.0
    }

    /// Returns warnings about what is valid but probably a mistake.
    pub fn warnings(&self, volumes: &(impl AsRef<[VolumeTexture]> + ?Sized)) -> Vec<String> {
        let volumes = volumes.as_ref();
        let mut warnings = self.environment.as_ref().map_or(Vec::new(), Environment::warnings);
        for (recipe, volume) in self.recipes.iter().zip(volumes) {
            let [alpha, file] = ["volume.alpha", "volume.file"].map(|key| key_of_volume(&recipe.name, key));
            if let Some(values) = self.values.as_ref().filter(|v| v.is_set_by_user(&alpha))
                && recipe.file.is_some()
                && recipe.measured.is_none()
                && recipe.matter.is_none()
                && values.float(&alpha) != volume.alpha
            {
                warnings.push(format!(
                    "{alpha} = {} has no effect: {file} gives the density as it is; change trace.sigma or \
                     trace.tau, or multiply rho in the file by a number",
                    values.float(&alpha),
                ));
            }
        }
        warnings.extend(self.recipes.iter().filter_map(matter::too_thick));
        warnings.extend(self.recipes.iter().flat_map(matter::notes_on_strands));
        warnings.extend(self.other_files(volumes));
        warnings.extend(self.values.iter().flat_map(quads::unused_materials));
        warnings.extend(self.values.iter().flat_map(volumes::unused));
        warnings.extend(self.values.iter().flat_map(bright_colours));
        warnings.extend(self.values.iter().flat_map(effect::told));
        let coarse = |pool: &Pool| {
            let cell = pool.too_coarse()?;
            let name = &pool.name;
            Some(format!(
                "pool {name} is so large that its foam is computed in cells of {cell:.3} m, too coarse for \
                 pools.{name}.foam_reach = {}: bring its corners nearer, or set pools.{name}.waves=sum",
                pool.foam_reach
            ))
        };
        warnings.extend(self.pools.iter().filter_map(coarse));
        if !self.rocks.is_empty() && self.rocks.iter().all(|rock| self.is_behind(rock)) {
            warnings.push(
                "all rock is seen from behind, and has the wrong light: list its corners counter-clockwise \
                 as you look at the side that is seen"
                    .into(),
            );
        }
        let is_holdout =
            self.rocks.iter().any(|rock| rock.holdout) || self.pools.iter().any(|pool| pool.holdout);
        if is_holdout && !self.image.alpha {
            warnings.push("a holdout is a hole only in a picture with an alpha channel: add --alpha".into());
        }
        let has_map = |v: &&Values| !v.text("environment.file").is_empty();
        let map = self.values.as_ref().filter(has_map);
        warnings.extend(map.and_then(|values| without_effect(values, "environment.file")));
        let dark = self.environment.as_ref().is_none_or(|e| e.irradiance.0[0] == Vec3::ZERO);
        let unlit = self.lights.is_empty() && self.ambient == Vec3::ZERO && dark;
        for mesh in &self.meshes {
            let notes = mesh.loaded.model.notes.iter();
            warnings.extend(notes.map(|note| format!("mesh {}: {note}", mesh.name)));
        }
        warnings.extend(self.unmapped.iter().map(|(name, count)| {
            format!("mesh {name}: {count} faces carry no volume, as their texture coordinates span no area")
        }));
        let strengths = ["occlusion", "shadow"].into_iter().zip(self.hides_light());
        warnings.extend(strengths.filter(|(_, hides)| !hides).filter_map(|(name, _)| {
            let key = format!("light.{name}");
            let is_asked = |values: &&Values| values.is_set_by_user(&key) && values.float(&key) > 0.0;
            self.values
                .as_ref()
                .filter(is_asked)
                .map(|_| format!("{key} has no effect: no rock and no mesh of the scene has {name} above 0"))
        }));
        let turned = |values| meshes::turned_over(&self.shells, &self.recipes, values);
        warnings.extend(self.values.iter().flat_map(turned));
        warnings.extend(self.untextured.iter().cloned());
        let paintings = self.triangles.iter().filter_map(|own| own.painting.as_deref());
        if let (textures @ 1.., levels) = coarsened(paintings, MOST_BYTES) {
            warnings.push(format!(
                "the meshes' textures would take more than {} MiB: {textures} of them are shown up to {} \
                 times coarser",
                MOST_BYTES >> 20,
                1u64 << levels.min(32),
            ));
        }
        let has_water = !self.quads.is_empty() || !self.shells.is_empty();
        let is_bare = self.rocks.is_empty() && self.pools.is_empty() && self.triangles.is_empty();
        if !has_water && is_bare {
            warnings.extend(self.why_empty().map(str::to_owned));
        } else if unlit {
            warnings.push("the scene has no light: add [lights.NAME] or light.ambient".into());
        } else if has_water {
            let is_empty = |volume: &VolumeTexture| {
                volume.alpha == 0.0 || !volume.cells.stored().iter().any(|c| c.rho_code() > 0)
            };
            let empty = self.recipes.iter().zip(volumes).filter(|(_, volume)| is_empty(volume));
            let words = |(recipe, _)| {
                format!(
                    "{} is empty: no cell has density{}",
                    self.volume_words(recipe),
                    matter::why_empty(recipe)
                )
            };
            warnings.extend(empty.map(words));
        }
        warnings.extend(shot::warnings(self));
        warnings.extend(origin::rounded(self));
        warnings
    }
}

impl Scene {
    /// Returns why a scene without any surface is empty; `None` where notes of its meshes say so already.
    fn why_empty(&self) -> Option<&'static str> {
        let is_silent = |mesh: &SceneMesh| mesh.loaded.model.notes.is_empty();
        match &self.meshes[..] {
            [] => Some("the scene is empty: add [[quads]] or a rock to see more than the background"),
            all if all.iter().any(SceneMesh::has_triangles) => {
                Some("the meshes show nothing: all their parts are none")
            }
            all if all.iter().all(is_silent) => {
                Some("the meshes show nothing: no node of their files places a mesh")
            }
            _ => None,
        }
    }
}

/// Returns a warning about each light whose colour seems to be written from 0 to 255.
fn bright_colours(values: &Values) -> Vec<String> {
    let keys = values.names("lights").into_iter().map(|name| format!("lights.{name}.color"));
    let bright = keys.filter(|key| values.triple(key).max_element() > BRIGHT_COLOUR);
    let said = |key: String| {
        let [r, g, b] = values.triple(&key).to_array().map(|x| x.clamp(0.0, 255.0).round() as u8);
        format!("{key} is linear, with 1 for full; for numbers up to 255 write \"#{r:02x}{g:02x}{b:02x}\"")
    };
    bright.map(said).collect()
}
