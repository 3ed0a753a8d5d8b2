//! Recipes of matter other than water: fur, cloth, hair, strands of a file, mountain, grains,
//! skin.

use std::path::Path;
use std::sync::Arc;

use glam::Vec3;

use super::measured::Builder;
use super::param::key_of_volume;
use super::{Limits, Recipe, Values, sequence};
use crate::light::scatter::optics::{ShellOptics, Surface};
use crate::light::skin::Tissue;
use crate::model::StrandFile;
use crate::util::error::{Error, Result};
use crate::volume::{
    ClothSpec, FurSpec, GrainsSpec, HairSpec, Matter, MountainSpec, SkinSpec, StorageChoice, StrandsSpec, Up,
    WaterSpec, Weave, WeaveName,
};

/// Returns the recipe of the volume `name`, whose size, seed and coefficients `water` has; `None` for water
/// and simulations. With a ramp of colours, cells hold their places on it.
///
/// # Errors
/// [`Error::Input`] for sparse storage, and for a weave that does not fit the yarns.
pub(super) fn matter(v: &Values, name: &str, water: &WaterSpec, has_ramp: bool) -> Result<Option<Matter>> {
    let k_s = (!has_ramp).then_some(water.k_s);
    let matter = match v.choice(&key_of_volume(name, "volume.builder"), Builder::from_word) {
        Builder::Curves | Builder::Flow | Builder::Strands => return Ok(None),
        Builder::Fur => Matter::Fur(fur(v, name, water, k_s)),
        Builder::Cloth => Matter::Cloth(cloth(v, name, water, k_s)?),
        Builder::Hair => Matter::Hair(hair(v, name, water, k_s)),
        Builder::Mountain => Matter::Mountain(mountain(v, name, water, k_s)),
        Builder::Grains => Matter::Grains(grains(v, name, water, k_s)),
        Builder::Skin => Matter::Skin(skin(v, name, water)),
    };
    not_sparse(v, name)?;
    Ok(Some(matter))
}

/// Refuses sparse storage.
fn not_sparse(v: &Values, name: &str) -> Result<()> {
    let storage = key_of_volume(name, "volume.storage");
    if v.choice(&storage, StorageChoice::from_word) == StorageChoice::Sparse {
        return Err(Error::input(
            format!("{storage} = \"sparse\": only curves and simulations are stored so"),
            format!("set {storage}=auto"),
        ));
    }
    Ok(())
}

/// Refuses a file of hair where another builder would make the cells, or read it as something else.
pub(super) fn no_strands_elsewhere(v: &Values, name: &str) -> Result<()> {
    let key = |own: &str| key_of_volume(name, own);
    let is_hair = |own: &&str| StrandFile::is_named(Path::new(&v.text(&key(own))));
    let builder = key("volume.builder");
    let reads = v.choice(&builder, Builder::from_word) == Builder::Strands;
    let given = ["volume.source", "volume.file"].into_iter().find(is_hair);
    match given {
        Some(own) if !(reads && own == "volume.source") => Err(Error::input(
            format!(
                "{} = {:?}: a file of hair is read by the builder \"strands\"",
                key(own),
                v.text(&key(own))
            ),
            format!("set {builder}=strands, and name the file in {}", key("volume.source")),
        )),
        _ => Ok(()),
    }
}

/// Returns the recipe of the volume `name` if it is made of the strands of a file. The other arguments are
/// those of [`matter`], and what the file may be.
///
/// # Errors
/// Errors of [`StrandFile::read`] and of paths; [`Error::Input`] for strands without extent or thickness,
/// and for sparse storage.
pub(super) fn strands(
    v: &Values,
    name: &str,
    water: &WaterSpec,
    has_ramp: bool,
    folder: Option<&Path>,
    limits: &Limits,
) -> Result<Option<Matter>> {
    let key = |own: &str| key_of_volume(name, own);
    if v.choice(&key("volume.builder"), Builder::from_word) != Builder::Strands {
        return Ok(None);
    }
    not_sparse(v, name)?;
    let source = key("volume.source");
    if v.text(&source).is_empty() {
        return Err(Error::input(
            format!("{} = \"strands\" without a file", key("volume.builder")),
            format!("give {source} the .hair or the .usdc of another program"),
        ));
    }
    let path = sequence::file(v, name, &source, folder, limits)?;
    let is_sequence = sequence::Sequence::of(v, name, folder).is_some();
    let time = is_sequence.then(|| v.int(&key("volume.frame")) as f64);
    let file = StrandFile::read(&path, time, limits.memory)?;
    let strands = file.strands;
    // What the scene says wins over the file.
    let [unit, up] = ["import.file_unit", "volume.up"].map(key);
    let unit = match file.unit {
        Some(own) if !v.is_set(&unit) => own,
        _ => f64::from(v.float(&unit)),
    };
    let up = match file.is_z_up {
        Some(true) if !v.is_set(&up) => Up::Z,
        Some(false) if !v.is_set(&up) => Up::Y,
        _ => v.choice(&up, Up::from_word),
    };
    let [diameter, longest] = ["import.strand_diameter", "import.longest"].map(key);
    let width = Some(v.float(&diameter)).filter(|width| *width > 0.0).map(|width| width / unit as f32);
    if width.is_none() && strands.widths.iter().all(|width| *width == 0.0) {
        return Err(Error::input(
            format!("{}: the strands have no thickness", path.display()),
            format!("give them one with {diameter}, metres"),
        ));
    }
    let rest = StrandsSpec {
        path: path.clone(),
        strands: Arc::new(strands),
        size: [0; 3],
        corner: Vec3::ZERO,
        edge: 0.0,
        width,
        unit,
        scene_from_file: up.scene_from_file(),
        notes: file.notes,
        alpha: water.alpha,
        k_d: water.k_d,
        k_s: (!has_ramp).then_some(water.k_s),
    };
    let spec = StrandsSpec::around(v.count(&longest), rest).ok_or_else(|| {
        let fix = format!("check the points in the program that wrote them, or set {diameter}, metres");
        Error::input(format!("{}: the strands have no extent, or an endless one", path.display()), fix)
    })?;
    Ok(Some(Matter::Strands(spec)))
}

fn fur(v: &Values, name: &str, water: &WaterSpec, k_s: Option<f32>) -> FurSpec {
    let float = |own: &str| v.float(&key_of_volume(name, own));
    let count = |own: &str| v.count(&key_of_volume(name, own));
    FurSpec {
        size: water.size,
        hairs: count("fur.hairs"),
        length: float("fur.hair_length"),
        spread: float("fur.hair_spread"),
        width_cells: float("fur.hair_width") * water.size[0] as f32,
        taper: float("fur.taper"),
        undercoat: float("fur.undercoat"),
        undercoat_length: float("fur.undercoat_length"),
        lean: float("fur.lean"),
        h: water.shape.h,
        amplitude: float("curves.amplitude"),
        clumps: count("fur.clumps"),
        clumping: float("fur.clumping"),
        seed: water.seed,
        alpha: water.alpha,
        k_d: water.k_d,
        shade: float("fur.hair_shade"),
        k_s,
    }
}

fn hair(v: &Values, name: &str, water: &WaterSpec, k_s: Option<f32>) -> HairSpec {
    let float = |own: &str| v.float(&key_of_volume(name, own));
    let count = |own: &str| v.count(&key_of_volume(name, own));
    let [nx, ny] = [water.size[0] as f32, water.size[1] as f32];
    HairSpec {
        size: water.size,
        strands: count("tress.strand_count"),
        reach: float("tress.reach"),
        spread: float("tress.reach_spread"),
        width_cells: float("tress.strand_width") * nx,
        thinning: float("tress.thinning"),
        locks: count("tress.locks"),
        gathering: float("tress.gathering"),
        stray: float("tress.stray"),
        wave_cells: float("tress.wave") * nx,
        waves: float("tress.waves"),
        h: water.shape.h,
        amplitude_cells: float("curves.amplitude") * ny,
        seed: water.seed,
        alpha: water.alpha,
        k_d: water.k_d,
        shade: float("tress.strand_shade"),
        k_s,
    }
}

fn cloth(v: &Values, name: &str, water: &WaterSpec, k_s: Option<f32>) -> Result<ClothSpec> {
    let key = |own: &str| key_of_volume(name, own);
    let float = |own: &str| v.float(&key(own));
    let text = v.text(&key("cloth.weave"));
    let named = WeaveName::from_word(&text).map(Weave::named);
    let weave = named.or_else(|| Weave::of_text(&text)).ok_or_else(|| {
        Error::input(
            format!("{} = {text:?} is no weave, nor rows of equal length", key("cloth.weave")),
            format!(
                "use {}, or rows of 0 and 1 (the warp on top) such as \"10/01\"",
                WeaveName::WORDS.join(", ")
            ),
        )
    })?;
    let yarns = ["cloth.warp", "cloth.weft"].map(|own| v.count(&key(own)));
    for (axis, own) in ["cloth.warp", "cloth.weft"].into_iter().enumerate() {
        let (count, repeat) = (yarns[axis], weave.repeat()[axis]);
        if count % repeat != 0 {
            return Err(Error::input(
                format!("{} = {count}: the weave repeats after {repeat} yarns", key(own)),
                format!("set it to {} or another multiple of {repeat}", count.next_multiple_of(repeat)),
            ));
        }
    }
    Ok(ClothSpec {
        size: water.size,
        yarns,
        weave,
        thickness: float("cloth.yarn"),
        fibres: v.count(&key("cloth.fibres")),
        fibre_width: float("cloth.fibre_width"),
        twist: float("cloth.twist"),
        crimp: float("cloth.crimp"),
        fuzz: float("cloth.fuzz"),
        seed: water.seed,
        alpha: water.alpha,
        k_d: water.k_d,
        shade: float("cloth.yarn_shade"),
        k_s,
    })
}

/// Returns a warning about cloth that does not fit into the depth of its volume.
pub(super) fn too_thick(recipe: &Recipe) -> Option<String> {
    let Some(Matter::Cloth(cloth)) = &recipe.matter else { return None };
    let (depth, nz) = (cloth.depth_cells(), cloth.size[2]);
    let key = |own: &str| key_of_volume(&recipe.name, own);
    (depth > nz as f32 + 0.5).then(|| {
        format!(
            "{} = {nz} cuts the cloth off, which is {depth:.0} cells thick: raise it, and the thickness of \
             the material with it, or lower {} or {}",
            key("volume.nz"),
            key("cloth.crimp"),
            key("cloth.yarn"),
        )
    })
}

/// Returns why no cell of a volume has density, as the end of a sentence; empty where it is not known.
pub(super) fn why_empty(recipe: &Recipe) -> String {
    let key = |own: &str| key_of_volume(&recipe.name, own);
    match &recipe.matter {
        matter if recipe.water.alpha == 0.0 && (matter.is_some() || recipe.file.is_none()) => {
            format!("; {} is 0", key("volume.alpha"))
        }
        Some(Matter::Strands(_)) => format!(
            "; the strands are too thin for the cells: raise {}, metres, or {}",
            key("import.strand_diameter"),
            key("import.longest")
        ),
        None if recipe.measured.is_some() => {
            format!("; check {} and {}", key("volume.rho"), key("volume.rho_scale"))
        }
        None if recipe.file.is_some() => format!("; every rho of {} is 0", key("volume.file")),
        _ => String::new(),
    }
}

/// Returns what the file of strands has and the volume lacks, a warning each.
pub(super) fn notes_on_strands(recipe: &Recipe) -> Vec<String> {
    let Some(Matter::Strands(strands)) = &recipe.matter else { return Vec::new() };
    strands.notes.iter().map(|note| format!("{}: {note}", strands.path.display())).collect()
}

fn mountain(v: &Values, name: &str, water: &WaterSpec, k_s: Option<f32>) -> MountainSpec {
    let float = |own: &str| v.float(&key_of_volume(name, own));
    let width = water.size[0] as f32;
    MountainSpec {
        size: water.size,
        relief: float("mountain.relief"),
        h: water.shape.h,
        block: float("mountain.block_size"),
        fracture: float("mountain.fracture"),
        beds: float("mountain.beds"),
        scree: float("mountain.scree"),
        stone_cells: float("mountain.stone_size") * width,
        moss: float("mountain.moss"),
        soil: float("mountain.soil"),
        blades: v.count(&key_of_volume(name, "mountain.blades")),
        blade_length: float("mountain.blade_length"),
        blade_width_cells: float("mountain.blade_width") * width,
        blade_lean: float("mountain.blade_lean"),
        seed: water.seed,
        alpha: water.alpha,
        k_d: water.k_d,
        k_s,
    }
}

fn grains(v: &Values, name: &str, water: &WaterSpec, k_s: Option<f32>) -> GrainsSpec {
    let float = |own: &str| v.float(&key_of_volume(name, own));
    GrainsSpec {
        size: water.size,
        filled: float("grains.filled"),
        settled: float("grains.settled"),
        grain_cells: float("grains.grain_size"),
        shade: float("grains.grain_shade"),
        seed: water.seed,
        alpha: water.alpha,
        k_d: water.k_d,
        k_s,
    }
}

fn skin(v: &Values, name: &str, water: &WaterSpec) -> SkinSpec {
    let float = |own: &str| v.float(&key_of_volume(name, own));
    let depth = water.size[2] as f32;
    SkinSpec {
        size: water.size,
        plates: v.count(&key_of_volume(name, "skin.plates")),
        furrow_cells: float("skin.furrow") * depth,
        epidermis_cells: float("skin.epidermis") * depth,
        freckles: float("skin.freckles"),
        flush: float("skin.flush"),
        seed: water.seed,
        alpha: water.alpha,
    }
}

/// Returns how the skin of the volume `name` scatters light. Colours that the scene does not give become
/// those of the tissue.
pub(super) fn skin_light(v: &Values, name: &str, spec: &SkinSpec, colors: &mut Vec<Vec3>) -> ShellOptics {
    let float = |own: &str| v.float(&key_of_volume(name, own));
    let tissue =
        Tissue { melanin: float("skin.melanin"), blood: float("skin.blood"), oxygen: float("skin.oxygen") };
    if colors.is_empty() {
        colors.extend(tissue.albedos(spec.epidermis_share()));
    }
    ShellOptics {
        extinction: tissue.extinction(),
        albedo: Vec3::ONE,
        isotropic: Vec3::ZERO,
        g: 0.0,
        surface: Some(Surface { eta: float("skin.eta"), roughness: float("skin.roughness") }),
    }
}
