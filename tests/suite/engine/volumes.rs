//! Several volumes in a scene: each looks as it does alone, and the engines agree.

use super::gpu::{assert_parity, both, renderer};
use taki::engine::RenderOptions;
use taki::engine::cpu;
use taki::engine::gpu::packing::Packing;
use taki::job::VolumeMemo;
use taki::picture::Frame;
use taki::scene::{Cost, Limits, Scene};
use taki::util::monitor::Unwatched;
use taki::volume::{Bricks, Cells, Leaps, VolumeTexture};

/// Keys of the three volumes, which have different sizes. The first is `water`.
const KEYS: [(&str, [&str; 12]); 3] = [
    ("water", ["13", "17", "9", "9", "5", "0.9", "3", "1.0", "0.7", "0.4", "0.0", "0.2"]),
    ("fur", ["20", "11", "14", "12", "9", "1.4", "7", "0.6", "0.2", "0.8", "0.1", "0.55"]),
    ("grass", ["8", "30", "6", "5", "4", "0.5", "11", "0.8", "0.9", "0.1", "0.0", "0.0"]),
];
const NAMES: [&str; 12] = [
    "volume.nx",
    "volume.ny",
    "volume.nz",
    "curves.across",
    "curves.deep",
    "curves.h",
    "volume.seed",
    "volume.alpha",
    "volume.k_d",
    "volume.k_s",
    "volume.k_noise",
    "volume.flow",
];

/// Tables of volume `number`, under the name `name`.
fn tables(number: usize, name: &str) -> String {
    let keys: Vec<(&str, &str)> = NAMES.into_iter().zip(KEYS[number].1).collect();
    let table = |section: &str| {
        let own = keys.iter().filter_map(|(key, value)| Some((key.strip_prefix(section)?, value)));
        own.map(|(key, value)| format!("{key} = {value}\n")).collect::<String>()
    };
    let [curves, volume] = [table("curves."), table("volume.")];
    match name {
        "water" => format!("[curves]\n{curves}[volume]\n{volume}"),
        name => format!("[volumes.{name}]\n{curves}{volume}"),
    }
}

/// Quad `number` of three beside one another, and the material of it, which shows the volume `volume`. The
/// second may be no parallelogram.
fn strip(number: usize, volume: &str, is_even: bool) -> String {
    let [left, right] = [number as f32 * 0.5 - 0.75, number as f32 * 0.5 - 0.27];
    let low = if number == 1 && !is_even { left + 0.08 } else { left };
    let thickness = [0.4, 0.25, 0.6][number];
    format!(
        "[materials.m{number}]\nthickness = {thickness}\nrepeat_u = {}\nvolume = \"{volume}\"\n[[quads]]\n\
         corners = [[{left}, 0.6, 0], [{right}, 0.6, 0], [{right}, -0.6, 0], [{low}, -0.6, 0]]\n\
         material = \"m{number}\"\n",
        1.0 + 0.5 * number as f32
    )
}

const PLACE: &str = "version = 1\nbase = \"front\"\n[camera]\neye = [0.3, 0.2, 2.4]\nfov = 36.0\n[image]\n\
                     width = 72\nheight = 60\nsamples = 1\n[trace]\nsigma = 12.0\n";

fn load(text: &str, sets: &[&str]) -> Scene {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("scene.toml");
    std::fs::write(&file, text).expect("written");
    let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
    Scene::load(&file, &sets, &Limits::default()).unwrap_or_else(|e| panic!("{sets:?}: {e}"))
}

/// The scene of all volumes, `count` of them, side by side.
fn together(count: usize, sets: &[&str]) -> Scene {
    let tables: String = (0..count).map(|number| tables(number, KEYS[number].0)).collect();
    let strips: String =
        (0..count).map(|number| strip(number, KEYS[number].0, sets.contains(&MARCH))).collect();
    load(&[PLACE, &tables, &strips].concat(), sets)
}

/// The scene of two of them.
pub fn two(sets: &[&str]) -> Scene {
    together(2, sets)
}

/// The scene of one of them alone, where it is the volume `water`.
fn alone(number: usize, sets: &[&str]) -> Scene {
    // Settings of `volumes.*` are those of the other volumes.
    let own = format!("volumes.{}.", KEYS[number].0);
    let sets: Vec<String> = sets
        .iter()
        .filter_map(|set| match set.strip_prefix("volumes.") {
            Some(_) => set.strip_prefix(&own).map(|rest| format!("volume.{rest}")),
            None if set.starts_with("volume.") => (number == 0).then(|| set.to_string()),
            None if set.starts_with("materials.m") => {
                set.starts_with(&format!("materials.m{number}.")).then(|| set.to_string())
            }
            None => Some(set.to_string()),
        })
        .collect();
    let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
    load(&[PLACE, &tables(number, "water"), &strip(number, "water", sets.contains(&MARCH))].concat(), &sets)
}

fn on_cpu(scene: &Scene) -> Frame {
    let volumes = scene.volumes(1 << 30, &Unwatched).expect("the volumes");
    cpu::render(scene, &volumes, &scene.mesh(), true, &Unwatched).expect("a frame")
}

const POINT: [&str; 2] = ["lights.key.kind=point", "lights.key.position=[0.1,0.3,0.5]"];
const CACHED: &str = "light.visibility=cached";
const MARCH: &str = "light.visibility=march";
const STRAND: &str = "light.reflection=strand";
const HAIR: &str = "light.reflection=hair";
const MULTIPLE: &str = "light.scattering=multiple";
const PYRAMID: &str = "trace.filter=pyramid";
const FAR: &str = "camera.eye=[4,3,20]";

/// Settings under which the volumes are compared.
const CASES: [&[&str]; 18] = [
    &[CACHED, HAIR],
    &[PYRAMID, MARCH, HAIR, FAR],
    &[],
    &[MARCH],
    &[CACHED],
    &[CACHED, POINT[0], POINT[1]],
    &[MARCH, "trace.lookup=trilinear"],
    &[CACHED, STRAND],
    &[MARCH, STRAND, "trace.attenuation=per-cell", "trace.tau=0.4"],
    &[CACHED, MULTIPLE],
    &[MARCH, MULTIPLE, STRAND, "light.frame=texture"],
    &[MARCH, MULTIPLE, "trace.attenuation=per-cell", "trace.tau=0.4"],
    &[PYRAMID, MARCH],
    &[PYRAMID, CACHED, FAR],
    &[PYRAMID, CACHED, FAR, "trace.attenuation=per-cell", "trace.tau=0.4", MULTIPLE],
    &[MARCH, POINT[0], POINT[1], "volumes.fur.storage=sparse", "volume.storage=dense"],
    &[CACHED, "volume.storage=sparse", "volumes.fur.storage=sparse", "volumes.grass.storage=sparse"],
    &[CACHED, "materials.m1.mist=0.3", "environment.kind=sky"],
];

#[test]
fn each_of_several_volumes_has_the_bits_that_it_has_alone() {
    for sets in CASES {
        let scene = together(3, sets);
        assert_eq!(scene.recipes.len(), 3);
        let frame = on_cpu(&scene);
        let quads = &frame.surface.as_ref().expect("asked for").quad;
        for number in 0..3 {
            let own = on_cpu(&alone(number, sets));
            let own_quads = &own.surface.as_ref().expect("asked for").quad;
            let mut compared = 0;
            for pixel in (0..quads.len()).filter(|&pixel| quads[pixel] == number as u32 + 1) {
                assert_eq!(own_quads[pixel], 1, "{sets:?}");
                let same =
                    frame.radiance[pixel] == own.radiance[pixel] && frame.counts[pixel] == own.counts[pixel];
                assert!(
                    same,
                    "{sets:?}, volume {number}: {:?} {:?}",
                    frame.radiance[pixel], own.radiance[pixel]
                );
                compared += 1;
            }
            // From far away the quads are small.
            assert!(compared > if sets.contains(&FAR) { 4 } else { 300 }, "{compared} pixels, {sets:?}");
        }
    }
}

#[test]
fn the_engines_agree_on_several_volumes() {
    let Some(mut renderer) = renderer("several volumes") else { return };
    for sets in CASES {
        for count in [2, 3] {
            // Settings of a volume that the scene does not have are left out.
            let sets: Vec<&str> =
                sets.iter().copied().filter(|set| count == 3 || !set.contains("grass")).collect();
            let frames = both(&mut renderer, &together(count, &sets));
            assert_parity(&format!("{count} volumes, {sets:?}"), &frames);
        }
    }
}

#[test]
fn volumes_overlap_under_one_pixel() {
    let behind = "quads.1.corners=[[-0.5,0.6,-0.3],[0.4,0.6,-0.3],[0.4,-0.6,-0.3],[-0.5,-0.6,-0.3]]";
    let sets = [MARCH, "camera.eye=[0.9,0.2,2.2]", behind];
    let scene = together(3, &sets);
    assert!(taki::engine::overlap::sheets(&scene) > 1);
    let Some(mut renderer) = renderer("overlapping volumes") else { return };
    assert_parity("overlapping volumes", &both(&mut renderer, &scene));
}

#[test]
fn the_storage_of_volumes_changes_no_picture() {
    // Light volumes would stand for walks to a directional light, but not in a sparse volume.
    let light = [MARCH, POINT[0], POINT[1]];
    let dense = on_cpu(&together(3, &light));
    for sets in [
        &["volumes.fur.storage=sparse"][..],
        &["volume.storage=sparse", "volumes.grass.storage=sparse"],
        &["volume.storage=sparse", "volumes.fur.storage=sparse", "volumes.grass.storage=sparse"],
    ] {
        let sets = [sets, &light].concat();
        let scene = together(3, &sets);
        assert!(on_cpu(&scene).radiance == dense.radiance, "{sets:?}");
        // The device holds all volumes in one storage.
        if let Some(mut renderer) = renderer("mixed storage") {
            let volumes = scene.volumes(1 << 30, &Unwatched).expect("the volumes");
            let whole: Vec<VolumeTexture> = volumes.iter().map(in_bricks).collect();
            let options = RenderOptions::default();
            let mesh = scene.mesh();
            let mixed = renderer.render(&scene, &volumes, &mesh, &options, &Unwatched).expect("a frame");
            let sparse = renderer.render(&scene, &whole, &mesh, &options, &Unwatched).expect("a frame");
            assert!(mixed.radiance == sparse.radiance, "{sets:?}");
        }
    }
}

fn in_bricks(volume: &VolumeTexture) -> VolumeTexture {
    let cells: Vec<_> = volume.cells.iter().copied().collect();
    VolumeTexture { cells: Cells::from(Bricks::of(volume.size, &cells)), ..volume.clone() }
}

#[test]
fn leaps_through_several_volumes_change_no_picture() {
    let Some(mut renderer) = renderer("leaps of several volumes") else { return };
    let scene = together(3, &[CACHED]);
    let volumes = scene.volumes(1 << 30, &Unwatched).expect("the volumes");
    let mut frame = |leaps| {
        let options = RenderOptions { leaps, ..RenderOptions::default() };
        renderer.render(&scene, &volumes, &scene.mesh(), &options, &Unwatched).expect("a frame")
    };
    let [walked, leapt] = [Leaps::Never, Leaps::Always].map(&mut frame);
    assert!(walked.radiance == leapt.radiance && walked.counts == leapt.counts);
}

#[test]
fn a_change_of_one_volume_leaves_the_others_as_they_are() {
    let mut memo = VolumeMemo::default();
    let mut volumes = |sets: &[&str]| memo.volumes(&together(3, sets), 1 << 30, &Unwatched).expect("volumes");
    let (first, cost) = volumes(&[]);
    assert_eq!(cost, Some(Cost::Volume));
    assert_eq!(volumes(&["trace.sigma=3"]).1, None);
    let (thin, cost) = volumes(&["volumes.fur.alpha=0.3"]);
    assert_eq!((cost, thin[1].alpha), (Some(Cost::Uniform), 0.3));
    assert!((0..3).all(|i| thin[i].cells.same(&first[i].cells)));
    let (other, cost) = volumes(&["volumes.fur.alpha=0.3", "volumes.grass.k_d=0.1"]);
    assert_eq!(cost, Some(Cost::Upload));
    assert!(other[0].cells.same(&first[0].cells) && !other[2].cells.same(&first[2].cells));
    let (other, cost) = volumes(&["volumes.fur.seed=8"]);
    assert_eq!(cost, Some(Cost::Volume));
    assert!(other[0].cells.same(&first[0].cells) && other[1] != first[1] && other[2] == first[2]);
    // A volume that is shown no more, and then again.
    assert_eq!(volumes(&["volumes.fur.seed=8", "materials.m2.volume=fur"]).0.len(), 2);
    assert_eq!(volumes(&["volumes.fur.seed=8"]).0.len(), 3);
}

#[test]
fn every_uniform_key_of_a_volume_acts_on_its_own_quads_alone() {
    let before = on_cpu(&together(3, &[MARCH]));
    let quads = before.surface.as_ref().expect("asked for").quad.clone();
    for (set, changed) in [
        ("volume.alpha=0.2", 1),
        ("volumes.fur.alpha=0.2", 2),
        ("volumes.grass.alpha=0.2", 3),
        ("volume.flow=0.7", 1),
        ("volumes.fur.flow=0.9", 2),
        ("volumes.grass.flow=0.4", 3),
    ] {
        let after = on_cpu(&together(3, &[MARCH, set]));
        let differ = (0..quads.len()).filter(|&i| before.radiance[i] != after.radiance[i]);
        let differ: Vec<usize> = differ.collect();
        assert!(differ.len() > 100 && differ.iter().all(|&i| quads[i] == changed), "{set}");
    }
}

#[test]
fn the_ray_of_a_pixel_tells_the_density_of_its_own_volume() {
    let scene = together(3, &[MARCH]);
    let volumes = scene.volumes(1 << 30, &Unwatched).expect("the volumes");
    let frame = on_cpu(&scene);
    let quads = &frame.surface.as_ref().expect("asked for").quad;
    for quad in 1..=3 {
        let rays = (0..quads.len()).filter(|&i| quads[i] == quad).step_by(37).map(|i| {
            let pixel = [i as u32 % scene.image.width, i as u32 / scene.image.width];
            cpu::ray::inspect(&scene, &volumes, &scene.mesh(), pixel)
        });
        let steps: Vec<_> = rays.flat_map(|ray| ray.steps).collect();
        let volume = &volumes[quad as usize - 1];
        let highest = steps.iter().map(|step| step.rho).fold(0.0, f32::max);
        assert!(highest > 0.0 && highest <= volume.alpha, "{highest} in volume {quad}");
        for step in steps {
            let [x, y, z] = step.cell;
            assert_eq!(step.rho, volume.cell(x, y, z).rho() * volume.alpha);
        }
    }
}

#[test]
#[should_panic(expected = "one volume for each recipe of the scene")]
fn a_scene_of_several_volumes_needs_all_of_them() {
    let scene = together(2, &[]);
    let volume = scene.volume(1 << 30, &Unwatched).expect("the first volume");
    let _ = cpu::render(&scene, &volume, &scene.mesh(), false, &Unwatched);
}

#[test]
fn packed_boxes_do_not_overlap_and_stay_within_the_largest_texture() {
    let sizes = [[40, 40, 40], [256, 64, 12], [8, 30, 6], [1, 1, 1], [100, 7, 90], [40, 40, 40], [3, 255, 2]];
    for most in [256, 300, 512, 2048] {
        let Packing { extent, origins } = Packing::smallest(&sizes, most).expect("they fit");
        assert!(extent.iter().all(|&n| n <= most), "{extent:?}");
        let boxes: Vec<_> = origins.iter().zip(&sizes).collect();
        for (i, (a, size_a)) in boxes.iter().enumerate() {
            assert!((0..3).all(|axis| a[axis] + size_a[axis] <= extent[axis]));
            for (b, size_b) in &boxes[..i] {
                let apart =
                    |axis: usize| a[axis] >= b[axis] + size_b[axis] || b[axis] >= a[axis] + size_a[axis];
                assert!((0..3).any(apart), "{a:?} and {b:?}");
            }
        }
    }
    // One box takes its own size, and rows along one axis are as small as they can be.
    assert_eq!(Packing::smallest(&[[40, 30, 20]], 2048).expect("fits").extent, [40, 30, 20]);
    assert_eq!(Packing::smallest(&[[40, 30, 20], [40, 30, 7]], 2048).expect("fits").extent, [40, 30, 27]);
    assert_eq!(Packing::along([2, 0, 1], &[[4, 4, 4]; 5], 8).expect("fits").origins[4], [0, 4, 0]);
    assert_eq!(Packing::smallest(&[[40, 30, 20]], 39), None);
    assert_eq!(Packing::smallest(&[[8, 8, 8]; 9], 16), None);
}
