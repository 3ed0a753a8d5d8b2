//! Volumes of a scene: which of them its surfaces show, the recipe of each, and how they share the memory.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use glam::{DAffine3, Vec3};

use super::measured::Builder;
use super::meshes::Carrier;
use super::names::likeliest;
use super::param::{COLORS, PARAMS, WATER, key_of_volume, split_volume_key};
use super::sequence::Sequence;
use super::{Limits, Parts, Scene, Values, animation, boxes, build, matter, measured, meshes};
use crate::light::ramp::Ramp;
use crate::light::scatter::optics::ShellOptics;
use crate::light::{ReflectionKind, Scattering, VolumeReflection};
use crate::picture::SampleTimes;
use crate::trace::Prefilter;
use crate::util::cache::Cache;
use crate::util::error::{Error, Result};
use crate::util::monitor::Monitor;
use crate::volume::{
    Bricks, Cell, Matter, MeasuredSpec, ReadOptions, Storage, StorageChoice, VolumeTexture, WaterSpec,
    build_measured, build_sparse_water, build_water, dense_bytes, expected_cells, kept_water, read_npz,
    sparse_bytes,
};

/// Largest number of volumes that a scene shows. The GPU engine holds their constants in one uniform buffer,
/// for which WebGPU guarantees 64 KiB.
pub const MAX_VOLUMES: usize = 64;

/// One volume of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Recipe {
    /// Name: `water`, or that of its table in `volumes`.
    pub name: String,
    /// Recipe of the cells, used where there is no `file`.
    pub water: WaterSpec,
    /// Recipe of the cells of other matter, in place of `water`, whose size and α are theirs too.
    pub matter: Option<Matter>,
    /// Colours of the cells.
    pub ramp: Ramp,
    /// Reflection model of the cells.
    pub reflection: VolumeReflection,
    /// How skin scatters light; `None` for other matter.
    pub skin: Option<ShellOptics>,
    /// Recipe of the cells from a simulation's grids, in place of `water`, whose size is theirs too.
    pub measured: Option<MeasuredSpec>,
    /// Path of the volume's file, resolved and inside the allowed folders: an `.npz`, the simulation's, or
    /// that of the strands in `matter`.
    pub file: Option<PathBuf>,
    /// Whether the file is one of a sequence, in which each frame has its own.
    pub is_sequence: bool,
    /// Storage of the cells.
    pub storage: Storage,
    /// Storage that the scene asks for.
    pub asked_storage: StorageChoice,
    /// Distance that the volume has moved down the flow, in lengths of the volume.
    pub flow: f32,
    /// Distance that it moves while the shutter is open, in lengths of the volume; the middle of it is
    /// `flow`.
    pub moves: f32,
}

impl Recipe {
    /// Whether the volume's cells keep the lines of their strands.
    pub fn has_lines(&self) -> bool {
        self.water.structure.lines && self.file.is_none() && self.matter.is_none()
    }

    /// Reads the recipe of the volume `name`. Its storage is not chosen yet.
    fn new(v: &Values, name: &str, folder: Option<&Path>, limits: &Limits) -> Result<Recipe> {
        let mut water = build::water(v, name);
        matter::no_strands_elsewhere(v, name)?;
        let measured = measured::measured(v, name, folder, limits).map_err(|e| of_volume(name, e))?;
        if let Some(measured) = &measured {
            water.size = measured.size;
        }
        let mut colors = colors(v, name)?;
        let matter = matter::matter(v, name, &water, colors.len() > 1)?;
        let skin = match &matter {
            Some(Matter::Skin(spec)) => Some(matter::skin_light(v, name, spec, &mut colors)),
            _ => None,
        };
        let strands = matter::strands(v, name, &water, colors.len() > 1, folder, limits);
        let matter = matter.or(strands.map_err(|e| of_volume(name, e))?);
        if let Some(Matter::Strands(strands)) = &matter {
            water.size = strands.size;
        }
        let file = match &measured {
            Some(measured) => Some(measured.path.clone()),
            None if let Some(Matter::Strands(strands)) = &matter => Some(strands.path.clone()),
            None if matter.is_some() => None,
            None => build::volume_file(v, name, folder, limits)?,
        };
        // What was measured stands where it was; only copies of a volume can flow.
        let is_placed = measured.is_some() || matches!(matter, Some(Matter::Strands(_)));
        let flow = if is_placed { 0.0 } else { v.float(&key_of_volume(name, "volume.flow")) };
        let moves = if is_placed || name != WATER { 0.0 } else { exposed_flow(v) };
        Ok(Recipe {
            name: name.into(),
            ramp: Ramp::new(&colors, water.k_s),
            reflection: own_reflection(v, name),
            skin,
            water,
            matter,
            measured,
            file,
            is_sequence: Sequence::of(v, name, folder).is_some(),
            storage: Storage::Dense,
            asked_storage: build::asked_storage(v, name)?,
            flow,
            moves,
        })
    }

    /// Whether the cells are read from a file, and not built.
    fn is_read(&self) -> bool {
        self.file.is_some() && self.matter.is_none()
    }

    /// Whether the number of cells is known before the volume is read.
    pub(super) fn knows_size(&self) -> bool {
        !self.is_read() || self.measured.is_some()
    }

    /// Transform from texture coordinates, 0 to 1, to the world, metres, if the volume has a place of its
    /// own.
    pub fn world_from_texture(&self) -> Option<DAffine3> {
        match &self.matter {
            Some(Matter::Strands(strands)) => Some(strands.world_from_texture()),
            _ => self.measured.as_ref().map(MeasuredSpec::world_from_texture),
        }
    }

    /// Key that names the file.
    pub(super) fn file_key(&self) -> String {
        let is_source = self.measured.is_some() || self.matter.is_some();
        key_of_volume(&self.name, if is_source { "volume.source" } else { "volume.file" })
    }

    /// Returns the storage of the cells within `memory` bytes, of which the picture needs `beside` for other
    /// things.
    fn storage_within(&self, memory: u64, beside: u64) -> Result<Storage> {
        let Some(matter) = &self.matter else {
            return build::water_storage(&self.water, self.asked_storage, memory, beside);
        };
        let [nx, ny, nz] = self.water.size;
        let cells = u128::from(nx) * u128::from(ny) * u128::from(nz);
        let building = cells * (size_of::<Cell>() + Matter::BYTES_PER_CELL) as u128 + matter.bytes_beside();
        let need = building.max(dense_bytes(self.water.size, false) + u128::from(beside));
        if need > u128::from(memory) {
            let (keys, fix) = match self.matter {
                Some(Matter::Strands(_)) => ("import.longest", "lower import.longest, or raise --memory"),
                _ => ("volume.nx, ny, nz", "lower volume.nx, volume.ny or volume.nz, or raise --memory"),
            };
            let what = format!("a volume of {nx}×{ny}×{nz} cells ({keys})");
            return Err(Error::memory(what, need, memory, fix));
        }
        Ok(Storage::Dense)
    }

    /// Bytes that the cells take in a storage while a picture is rendered.
    fn bytes_in(&self, storage: Storage, pyramid: bool) -> u128 {
        match storage {
            Storage::Dense => dense_bytes(self.water.size, pyramid),
            Storage::Sparse => sparse_bytes(self.water.size, expected_cells(&self.water), 0),
        }
    }

    /// Bytes that the cells take once they are built, on the host, and most bytes while they are built.
    fn bytes_to_build(&self) -> [u128; 2] {
        let cells: u128 = self.water.size.iter().map(|&n| u128::from(n)).product();
        let extra = match self.matter {
            Some(_) => Matter::BYTES_PER_CELL,
            None => size_of::<glam::Vec3>() + self.water.strand_bytes(),
        };
        let built = match self.storage {
            Storage::Dense => cells * size_of::<Cell>() as u128,
            Storage::Sparse => Bricks::bytes_of(self.water.size, expected_cells(&self.water))[0],
        };
        let building = match self.storage {
            Storage::Dense => {
                built + cells * extra as u128 + self.matter.as_ref().map_or(0, Matter::bytes_beside)
            }
            Storage::Sparse => sparse_bytes(self.water.size, expected_cells(&self.water), extra),
        };
        if self.is_read() { [0; 2] } else { [built, building] }
    }

    /// Bytes that the volume takes while a picture is rendered, if it is built. Those of a file are counted
    /// when it is read.
    pub(crate) fn bytes(&self, pyramid: bool) -> u128 {
        if self.is_read() { 0 } else { self.bytes_in(self.storage, pyramid) }
    }
}

/// Returns the reflection model of the volume `name`.
fn own_reflection(v: &Values, name: &str) -> VolumeReflection {
    v.choice(&key_of_volume(name, "volume.reflection"), VolumeReflection::from_word)
}

/// Returns the colours of the volume `name` that the scene gives.
fn colors(v: &Values, name: &str) -> Result<Vec<Vec3>> {
    let keys = COLORS.map(|key| key_of_volume(name, key));
    let colors: Vec<Vec3> = keys.iter().take_while(|key| v.is_set(key)).map(|key| v.triple(key)).collect();
    if let Some((key, color)) = keys.iter().zip(&colors).find(|(_, color)| color.max_element() > 1.0) {
        return Err(Error::input(
            format!("{key} = {color} reflects more light than it receives"),
            "choose components of at most 1; for more light raise lights.*.intensity",
        ));
    }
    let of_light = |key: &str, word: &str, other: &str| {
        Err(Error::input(
            format!("{} with {key} = {word:?}, which has colours of its own", keys[0]),
            format!("set {key}={other}, or leave the colours out"),
        ))
    };
    if colors.is_empty() {
        return Ok(colors);
    }
    let builder = key_of_volume(name, "volume.builder");
    // Its light is not that of fibres.
    if v.choice(&builder, Builder::from_word) == Builder::Skin {
        return Ok(colors);
    }
    let reflection = v.choice("light.reflection", ReflectionKind::from_word);
    let is_of_scene = own_reflection(v, name) == VolumeReflection::Scene;
    if is_of_scene && reflection != ReflectionKind::KajiyaKay {
        return of_light("light.reflection", reflection.word(), ReflectionKind::KajiyaKay.word());
    }
    let is_multiple = v.choice("light.scattering", Scattering::from_word) == Scattering::Multiple;
    if is_multiple && is_on_quads(v, name) {
        return Err(Error::input(
            format!("{} with light.scattering = \"multiple\" on quads, where it knows no colours", keys[0]),
            "set light.scattering=single, leave the colours out, or show the volume by shells of meshes",
        ));
    }
    let is_of_curves = v.choice(&builder, Builder::from_word) == Builder::Curves
        && v.text(&key_of_volume(name, "volume.file")).is_empty();
    if is_of_curves && colors.len() > 1 {
        return Err(Error::input(
            format!("{}: cells of curves have no place on a ramp of colours", keys[1]),
            format!("leave all but {} out, or set {builder} to another word", keys[0]),
        ));
    }
    Ok(colors)
}

/// Returns the names of all volumes of a scene, `water` first.
pub(super) fn names(v: &Values) -> Vec<String> {
    std::iter::once(WATER.to_owned()).chain(v.names("volumes")).collect()
}

/// Returns the names of the materials that quads, sheets, splashes and parts of meshes have.
pub(super) fn used_materials(v: &Values) -> BTreeSet<String> {
    let users = ["quads", "sheets", "splashes"].into_iter().flat_map(|section| {
        v.names(section).into_iter().map(move |name| v.text(&format!("{section}.{name}.material")))
    });
    users.chain(meshes::named_materials(v)).collect()
}

/// Whether quads or faces of meshes show the volume `name`.
fn is_on_quads(v: &Values, name: &str) -> bool {
    let of_shells: BTreeSet<String> = meshes::named_materials(v).into_iter().collect();
    used_materials(v).into_iter().any(|material| {
        // Quads refuse a material of shells.
        let carrier = v.choice(&format!("materials.{material}.carrier"), Carrier::from_word);
        let is_shell = carrier == Carrier::Shell && of_shells.contains(&material);
        volume_of(v, &material) == name && !is_shell
    })
}

/// Refuses skin on quads and in boxes, in which its light is not known.
fn skin_is_on_shells(v: &Values) -> Result<()> {
    let is_skin = |name: &str| {
        let builder = v.choice(&key_of_volume(name, "volume.builder"), Builder::from_word);
        builder == Builder::Skin
    };
    let refused = |what: String, fix: &str| {
        Err(Error::input(format!("{what} shows skin, which only the shells of meshes do"), fix))
    };
    for name in names(v).iter().filter(|name| is_skin(name)) {
        if is_on_quads(v, name) {
            return refused(
                format!("a quad or face with the volume {name}"),
                "set carrier = \"shell\" in its material, and give it to a mesh",
            );
        }
        let own = |other: &String| v.text(&format!("boxes.{other}.volume")) == *name;
        if let Some(own) = v.names("boxes").into_iter().find(own) {
            return refused(format!("the box {own}"), "give it another volume");
        }
    }
    Ok(())
}

/// Returns the name of the volume that a material shows.
pub(super) fn volume_of(v: &Values, material: &str) -> String {
    v.text(&format!("materials.{material}.volume"))
}

/// Returns the names of the volumes that the scene's surfaces show, in the order of their numbers. A scene
/// without surfaces has `water`.
pub(super) fn shown(v: &Values) -> Vec<String> {
    let of_materials = used_materials(v).into_iter().map(|material| volume_of(v, &material));
    let used: BTreeSet<String> = of_materials.chain(boxes::volumes(v)).collect();
    let mut shown = names(v);
    shown.retain(|name| used.contains(name) || (used.is_empty() && name == WATER));
    shown
}

/// Whether the scene's surfaces show the volume `name`.
pub(super) fn is_shown(v: &Values, name: &str) -> bool {
    shown(v).iter().any(|other| other == name)
}

/// Returns advice on the name of a volume; `None` where the scene has it.
pub(super) fn unknown(v: &Values, name: &str) -> Option<String> {
    let known = names(v);
    (!known.iter().any(|own| own == name)).then(|| match likeliest(name, known.iter().map(String::as_str)) {
        Some(near) => format!("did you mean {near}? Otherwise add [volumes.{name}]"),
        None => format!("add [volumes.{name}], or use one of these: {}", known.join(", ")),
    })
}

/// Returns a warning about each volume of the user's own that nothing shows.
pub(super) fn unused(v: &Values) -> Vec<String> {
    let shown = shown(v);
    let unused = v.names("volumes").into_iter().filter(|name| {
        // A scene without water of its own uses none of the volumes of its base.
        !shown.contains(name) && !v.has_base_under(&format!("volumes.{name}"))
    });
    unused.map(|name| why_unused(v, &name)).collect()
}

/// Returns why a volume that nothing shows has no effect, and what shows it.
fn why_unused(v: &Values, name: &str) -> String {
    match v.names("materials").iter().find(|material| volume_of(v, material) == name) {
        Some(material) => format!("nothing has the material {material}, which shows the volume {name}"),
        None => format!("no material or box shows the volume {name}: give one volume = {name:?}"),
    }
}

/// Returns why the value of a volume's key has no effect, because nothing shows the volume; `None` where
/// something does.
pub(super) fn without_effect(v: &Values, key: &str) -> Option<String> {
    let (name, of_water) = split_volume_key(key)?;
    // The waves of pools move with `volume.flow`.
    let is_waves = name == WATER && of_water == "volume.flow";
    (!is_shown(v, name) && !is_waves).then(|| format!("{key} has no effect: {}", why_unused(v, name)))
}

/// Returns the distance that the volume `water`, and the waves with it, move while the shutter is open, in
/// lengths of the volume.
pub(super) fn exposed_flow(v: &Values) -> f32 {
    (f64::from(v.float("camera.shutter")) * animation::speed(v)) as f32
}

/// Reads the recipes of the volumes that the scene shows.
///
/// # Errors
/// [`Error::Input`] where a material names a volume that the scene does not have, or a file is unusable;
/// [`Error::Memory`] for a volume that is too large by itself.
pub(super) fn recipes(v: &Values, folder: Option<&Path>, limits: &Limits) -> Result<Vec<Recipe>> {
    for material in v.names("materials") {
        let name = volume_of(v, &material);
        if let Some(fix) = unknown(v, &name) {
            let what = format!("materials.{material}.volume = {name:?}: the scene has no such volume");
            return Err(Error::input(what, fix));
        }
    }
    for name in v.names("boxes") {
        let key = format!("boxes.{name}.volume");
        let volume = v.text(&key);
        if let Some(fix) = unknown(v, &volume) {
            return Err(Error::input(format!("{key} = {volume:?}: the scene has no such volume"), fix));
        }
    }
    skin_is_on_shells(v)?;
    let shown = shown(v);
    if shown.len() > MAX_VOLUMES {
        return Err(Error::input(
            format!("the scene shows {} volumes", shown.len()),
            format!("at most {MAX_VOLUMES}"),
        ));
    }
    let recipes = shown.iter().map(|name| {
        let recipe = Recipe::new(v, name, folder, limits)?;
        if !recipe.is_read() {
            // A volume that is too large by itself is refused with its own numbers.
            recipe.storage_within(limits.memory, 0).map_err(|e| of_volume(name, e))?;
        }
        Ok(recipe)
    });
    recipes.collect()
}

/// Puts the keys of the volume `name` into an error that names those of `water`.
fn of_volume(name: &str, error: Error) -> Error {
    if name == WATER {
        return error;
    }
    // Other words with a dot are left alone, such as the name of a file.
    let keys = PARAMS.iter().map(|param| param.key).filter(|key| split_volume_key(key).is_some());
    let keys: Vec<&str> = keys.filter(|key| !key.starts_with("volumes.")).collect();
    let own = |text: String| keys.iter().fold(text, |text, key| text.replace(key, &key_of_volume(name, key)));
    match error {
        Error::Memory { what, need, budget, fix } => {
            Error::Memory { what: own(what), need, budget, fix: own(fix) }
        }
        Error::Input { what, fix } => Error::Input { what: own(what), fix: own(fix) },
        other => other,
    }
}

impl Parts {
    /// Whether rays read coarse levels too.
    pub(crate) fn has_pyramid(&self) -> bool {
        self.trace.filter == Prefilter::Pyramid
    }

    /// Chooses the storage of every volume within `memory` bytes, all volumes taken together. As long as they
    /// do not fit, the largest dense one that may be sparse becomes so.
    ///
    /// # Errors
    /// [`Error::Memory`] where they do not fit.
    pub(super) fn choose_storages(&mut self, memory: u64) -> Result<()> {
        let (beside, pyramid) = (self.least_bytes_beside_volume(), self.has_pyramid());
        if let [recipe] = &mut self.recipes[..] {
            if !recipe.is_read() {
                recipe.storage =
                    recipe.storage_within(memory, beside).map_err(|e| of_volume(&recipe.name, e))?;
            }
            return Ok(());
        }
        for recipe in &mut self.recipes {
            recipe.storage = match recipe.asked_storage {
                StorageChoice::Sparse => Storage::Sparse,
                StorageChoice::Dense | StorageChoice::Auto => Storage::Dense,
            };
        }
        loop {
            let drawn = self.recipes.iter().map(|recipe| recipe.bytes(pyramid)).sum::<u128>();
            // One volume is built while the others are there.
            let built: Vec<[u128; 2]> = self.recipes.iter().map(Recipe::bytes_to_build).collect();
            let all = built.iter().map(|[built, _]| built).sum::<u128>();
            let building = built.iter().map(|[built, building]| all - built + building).max().unwrap_or(0);
            let need = (drawn + u128::from(beside)).max(building);
            if need <= u128::from(memory) {
                return Ok(());
            }
            let saved = |recipe: &Recipe| {
                let may = recipe.file.is_none()
                    && recipe.matter.is_none()
                    && recipe.asked_storage == StorageChoice::Auto
                    && recipe.storage == Storage::Dense;
                let [dense, sparse] = [Storage::Dense, Storage::Sparse].map(|s| recipe.bytes_in(s, pyramid));
                if may { dense.saturating_sub(sparse) } else { 0 }
            };
            match self.recipes.iter_mut().max_by_key(|recipe| saved(recipe)).filter(|r| saved(r) > 0) {
                Some(largest) => largest.storage = Storage::Sparse,
                None => {
                    return Err(Error::memory(
                        format!("the picture with its {} volumes", self.recipes.len()),
                        need,
                        memory,
                        "lower their nx, ny or nz, or raise --memory",
                    ));
                }
            }
        }
    }
}

impl Scene {
    /// Builds the volume textures, or reads them from the scene's files, within `memory` bytes. They have the
    /// order of `recipes`, in which quads number them.
    ///
    /// # Errors
    /// [`Error::Memory`] where they do not fit, [`Error::Input`] or [`Error::Io`] where a file is unusable,
    /// and those of `monitor`.
    pub fn volumes(&self, memory: u64, monitor: &dyn Monitor) -> Result<Vec<VolumeTexture>> {
        self.cached_volumes(None, memory, monitor)
    }

    /// Returns [`Scene::volumes`], each from the cache where it is stored there.
    ///
    /// # Errors
    /// The errors of [`Scene::volumes`].
    pub fn cached_volumes(
        &self,
        cache: Option<&Cache>,
        memory: u64,
        monitor: &dyn Monitor,
    ) -> Result<Vec<VolumeTexture>> {
        let mut volumes = Vec::with_capacity(self.recipes.len());
        for number in 0..self.recipes.len() {
            let memory = self.memory_for(number, &volumes, memory);
            volumes.push(self.cached_volume(number, cache, memory, monitor)?);
        }
        Ok(volumes)
    }

    /// Builds or reads the first volume, which is the only one of most scenes.
    ///
    /// # Errors
    /// The errors of [`Scene::volumes`].
    pub fn volume(&self, memory: u64, monitor: &dyn Monitor) -> Result<VolumeTexture> {
        self.cached_volume(0, None, memory, monitor)
    }

    /// Returns the flow of each volume, in its lengths.
    ///
    /// # Panics
    /// If the scene has another number of volumes than `volumes`.
    pub(crate) fn flows(&self, volumes: &[VolumeTexture]) -> Vec<f32> {
        assert_eq!(volumes.len(), self.recipes.len(), "one volume for each recipe of the scene");
        self.recipes.iter().map(|recipe| recipe.flow).collect()
    }

    /// Returns the distance that each volume moves while the shutter is open, in cells.
    ///
    /// # Panics
    /// If the scene has another number of volumes than `volumes`.
    pub(crate) fn flow_moves(&self, volumes: &[VolumeTexture]) -> Vec<f32> {
        assert_eq!(volumes.len(), self.recipes.len(), "one volume for each recipe of the scene");
        let cells = |(recipe, volume): (&Recipe, &VolumeTexture)| recipe.moves * volume.size[1] as f32;
        self.recipes.iter().zip(volumes).map(cells).collect()
    }

    /// Whether any volume moves while the shutter is open.
    pub(crate) fn moves(&self) -> bool {
        self.recipes.iter().any(|recipe| recipe.moves != 0.0)
    }

    /// Whether what a sample sees depends on the number of samples, among which time and lens are divided.
    pub fn counts_samples(&self) -> bool {
        self.lens.is_some() || self.moves() || self.wave_moves != 0.0
    }

    /// Returns the times of a sample in all pixels; zeros if nothing moves while the shutter is open.
    pub(crate) fn sample_times(&self, sample: u32) -> SampleTimes {
        match self.moves() || self.wave_moves != 0.0 {
            true => SampleTimes::new(&self.image, sample),
            false => SampleTimes::default(),
        }
    }

    /// Whether any volume has colours.
    pub(crate) fn is_colored(&self) -> bool {
        self.recipes.iter().any(|recipe| recipe.ramp != Ramp::WHITE)
    }

    /// Returns the bytes that are left for volume `number`: those before it are `made`, and those behind it
    /// are built later.
    pub(crate) fn memory_for(&self, number: usize, made: &[VolumeTexture], memory: u64) -> u64 {
        let held = made.iter().map(|volume| volume.cells.bytes()).sum::<u64>();
        let pyramid = self.has_pyramid();
        let later = self.recipes[number + 1..].iter().map(|recipe| recipe.bytes(pyramid)).sum::<u128>();
        memory.saturating_sub(held).saturating_sub(u64::try_from(later).unwrap_or(u64::MAX))
    }

    /// Transform from texture coordinates of a built volume to the world, metres: that of the first box that
    /// shows it, or its own place, or a box around the origin whose longest side is 1.
    pub(crate) fn place_of(&self, number: usize, volume: &VolumeTexture) -> DAffine3 {
        let shown = self.boxes.iter().find(|own| own.volume as usize == number);
        let shown = shown.map(|own| own.world_from_texture);
        let own = || self.recipes[number].world_from_texture();
        shown.or_else(own).unwrap_or_else(|| VolumeTexture::unit_box(volume.size))
    }

    /// Builds or reads volume `number`, or takes it from the cache where it is stored there.
    ///
    /// # Errors
    /// The errors of [`Scene::volumes`].
    pub(crate) fn cached_volume(
        &self,
        number: usize,
        cache: Option<&Cache>,
        memory: u64,
        monitor: &dyn Monitor,
    ) -> Result<VolumeTexture> {
        let Recipe { name, water, matter, measured, file, storage, asked_storage, .. } =
            &self.recipes[number];
        let volume = match (file, storage, cache) {
            _ if let Some(measured) = measured => build_measured(measured, *asked_storage, memory, monitor),
            _ if let Some(matter) = matter => matter.build(monitor),
            (Some(path), ..) => {
                let k = [water.k_d, water.k_s];
                read_npz(path, &ReadOptions { storage: *asked_storage, budget: memory, k }, monitor)
            }
            (None, Storage::Dense, Some(cache)) => kept_water(water, cache, monitor),
            (None, Storage::Dense, None) => build_water(water, monitor),
            // A sparse volume's cache file would be large enough to evict every other.
            (None, Storage::Sparse, _) => build_sparse_water(water, memory, monitor),
        };
        let volume = volume.map_err(|e| of_volume(name, e))?;
        self.check_built(number, &volume)?;
        Ok(volume)
    }
}
