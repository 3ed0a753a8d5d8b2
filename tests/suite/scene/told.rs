//! Values that hide something, or have no effect in a scene file: each is told once, and defaults are not.

use std::fs;

use taki::scene::{Limits, Scene, presets, without_effect};
use taki::util::monitor::Unwatched;
use taki::volume::VolumeTexture;

use super::meshes::Folder;
use crate::cli::faults::{run, taki};

/// A ring of fur with three colours.
const RING: &str = "version = 1
[volumes.coat]
builder = \"fur\"
nx = 16
ny = 16
nz = 10
hairs = 100
color = [0.1, 0.2, 0.3]
color_2 = [0.2, 0.2, 0.3]
color_3 = [0.3, 0.2, 0.3]
[materials.coat]
volume = \"coat\"
carrier = \"shell\"
thickness = 0.05
[meshes.ring]
file = \"taki:torus.glb\"
material = \"coat\"
[trace]
sigma = 400.0
[lights.key]
direction = [0.0, 1.0, 0.0]
";

const NO_VOLUMES: &[VolumeTexture] = &[];

fn warnings(text: &str, sets: &[&str]) -> Vec<String> {
    let folder = Folder::new();
    folder.write("s.toml", text);
    let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
    let scene = Scene::load(&folder.path("s.toml"), &sets, &Limits::default());
    scene.unwrap_or_else(|e| panic!("{sets:?}: {e}")).warnings(NO_VOLUMES)
}

/// Checks that there is one warning, and that it has these words.
fn one(text: &str, sets: &[&str], words: &[&str]) {
    let said = warnings(text, sets);
    assert!(said.len() == 1 && words.iter().all(|word| said[0].contains(word)), "{sets:?}: {said:?}");
}

#[test]
fn strands_that_no_volume_keeps_are_told() {
    one(RING, &["trace.lookup=strand"], &["trace.lookup", "finds no strands"]);
    let scene = Scene::preset("fig5").expect("a preset").with(&["trace.lookup=strand"]).expect("valid");
    assert_eq!(scene.warnings(NO_VOLUMES), Vec::<String>::new());
}

#[test]
fn a_shutter_before_nothing_that_moves_is_told() {
    one(RING, &["camera.shutter=0.1"], &["camera.shutter", "shows none"]);
    let scene = Scene::preset("fig5").expect("a preset").with(&["camera.shutter=0.1"]).expect("valid");
    assert!(!scene.warnings(NO_VOLUMES).concat().contains("shows none"));
}

#[test]
fn an_extinction_of_nothing_is_told() {
    assert_eq!(warnings(RING, &[]), Vec::<String>::new());
    one(RING, &["trace.sigma=0"], &["trace.sigma = 0 makes all volumes transparent", "1.5 ÷"]);
    let per_cell = ["trace.attenuation=per-cell", "trace.tau=0"];
    let scene = Scene::preset("fig5").expect("a preset").with(&per_cell).expect("valid");
    assert!(scene.warnings(NO_VOLUMES).concat().contains("trace.tau = 0 makes all volumes transparent"));
}

#[test]
fn colours_behind_a_removed_one_are_told() {
    let words = ["volumes.coat.color_3 has no effect", "volumes.coat.color_2 is not set", "gap"];
    one(RING, &["remove=volumes.coat.color_2"], &words);
    // So are those of a preset, which the user has not set.
    let preset = Scene::preset("torus").expect("a preset").with(&["remove=volumes.fur.color_2"]);
    let said = preset.expect("valid").warnings(NO_VOLUMES).concat();
    assert!(said.contains("volumes.fur.color_3 has no effect"), "{said}");
    let all = "remove=[\"volumes.coat.color\", \"volumes.coat.color_2\", \"volumes.coat.color_3\"]";
    assert_eq!(warnings(RING, &[all]), Vec::<String>::new());
}

#[test]
fn more_clumps_than_hairs_are_told() {
    one(
        RING,
        &["volumes.coat.clumps=101"],
        &["volumes.coat.clumps = 101 is more than volumes.coat.hairs = 100"],
    );
    assert_eq!(warnings(RING, &["volumes.coat.clumps=100"]), Vec::<String>::new());
    let hair = RING.replace("\"fur\"", "\"hair\"").replace("hairs = 100", "strand_count = 20\nlocks = 21");
    one(&hair, &[], &["volumes.coat.locks = 21", "volumes.coat.strand_count = 20"]);
}

#[test]
fn a_key_of_a_volume_without_effect_is_told_in_a_file_too() {
    let with = |more: &str| RING.replace("hairs = 100", &format!("hairs = 100\n{more}"));
    one(&with("twist = 3.0"), &[], &["volumes.coat.twist has no effect", "it needs cloth"]);
    one(&with("clumping = 0.7"), &[], &["volumes.coat.clumping has no effect", "clumps is 0"]);
    // A default says nothing, as in a printed scene.
    assert_eq!(warnings(&with("clumping = 0.5\ngrain_size = 1.0"), &[]), Vec::<String>::new());
    // A setting of the command line is told once.
    let folder = Folder::new();
    folder.write("s.toml", RING);
    let out = folder.path("a.png");
    let run = run(taki(["render"])
        .arg(folder.path("s.toml"))
        .args(["--set=volumes.coat.twist=3", "--size=8x8"])
        .args(["--samples=1", "-o"])
        .arg(&out));
    run.done();
    assert_eq!(run.lines("taki: warning: volumes.coat.twist").len(), 1);
    assert!(fs::exists(&out).expect("a folder"));
}

#[test]
fn no_preset_has_a_value_without_effect() {
    for (name, text) in presets() {
        let scene = Scene::preset(name).expect("a preset");
        let words = ["has no effect", "transparent", "is more than", "turns over"];
        let own: Vec<String> = scene
            .warnings(NO_VOLUMES)
            .into_iter()
            .filter(|said| words.iter().any(|word| said.contains(word)))
            .collect();
        assert!(own.is_empty() && !text.is_empty(), "{name}: {own:?}");
    }
}

#[test]
fn coefficients_beside_a_file_of_cells_are_told() {
    let (folder, scene) = with_cells("");
    let why = |key: &str| without_effect(scene.values().expect("values"), key);
    for key in ["volumes.mat.k_d", "volumes.mat.k_s", "volumes.mat.coverage", "volumes.mat.crest"] {
        let said = why(key).unwrap_or_else(|| panic!("{key} is not told"));
        assert!(said.contains("a file brings its own"), "{said}");
    }
    for key in ["volumes.mat.alpha", "volumes.mat.flow", "volumes.mat.color"] {
        assert_eq!(why(key), None);
    }
    drop(folder);
    // With colours, the place of k_s in the file is that on the ramp.
    let (_folder, scene) = with_cells("color = [0.5, 0.4, 0.3]\nk_s = 0.2\n");
    assert_eq!(without_effect(scene.values().expect("values"), "volumes.mat.k_s"), None);
}

/// A scene with a volume of a file, and more in its table.
fn with_cells(more: &str) -> (Folder, Scene) {
    let folder = Folder::new();
    let water = Scene::preset("front").expect("a preset");
    let small = water.with(&["volume.nx=4", "volume.ny=4", "volume.nz=4"]).expect("valid");
    let volumes = small.volumes(1 << 30, &Unwatched).expect("volumes");
    let mut bytes = Vec::new();
    taki::volume::write_npz(&volumes[0], std::io::Cursor::new(&mut bytes)).expect("written");
    fs::write(folder.path("mat.npz"), bytes).expect("written");
    let text = format!("version = 1\n[volumes.mat]\nfile = \"mat.npz\"\n{more}[boxes.b]\nvolume = \"mat\"\n");
    folder.write("s.toml", &text);
    let scene = Scene::load(&folder.path("s.toml"), &[], &Limits::default()).expect("a scene");
    (folder, scene)
}

#[test]
fn a_shell_that_turns_over_itself_is_told() {
    let skin = "version = 1\n[volumes.s]\nbuilder = \"skin\"\nnx = 8\nny = 8\nnz = 8\n[materials.s]\n\
        volume = \"s\"\ncarrier = \"shell\"\nside = \"inward\"\n[meshes.ring]\nfile = \"taki:torus.glb\"\n\
        material = \"s\"\n[lights.key]\ndirection = [0.0, 1.0, 0.0]\n[trace]\nsigma = 30.0\n";
    // The tube of the ring has a radius of 0.4 m.
    assert_eq!(warnings(skin, &["materials.s.thickness=0.2"]), Vec::<String>::new());
    one(skin, &["materials.s.thickness=0.6"], &["the shell of the volume s turns over itself", "thickness"]);
}

#[test]
fn an_empty_volume_names_its_cause() {
    let said = |set: &str| {
        let folder = Folder::new();
        folder.write("s.toml", RING);
        let scene =
            Scene::load(&folder.path("s.toml"), &[set.to_owned()], &Limits::default()).expect("valid");
        scene.warnings(&scene.volumes(1 << 30, &Unwatched).expect("volumes")).concat()
    };
    let empty = said("volumes.coat.alpha=0");
    assert!(empty.contains("the volume is empty: no cell has density; volumes.coat.alpha is 0"), "{empty}");
}

#[test]
fn a_pool_too_large_for_the_cells_of_its_foam_is_told() {
    let lake = |side: f32, waves: &str| {
        format!(
            "version = 2\n[pools.lake]\nwaves = \"{waves}\"\nfoam_reach = 2.4\ncorners = [[0, -9, {side}], \
             [{side}, -9, {side}], [{side}, -9, 0], [0, -9, 0]]\n"
        )
    };
    one(
        &lake(1e4, "field"),
        &[],
        &["pool lake is so large", "cells of 39.", "foam_reach = 2.4", "waves=sum"],
    );
    for (side, waves) in [(40.0, "field"), (1e4, "sum")] {
        assert!(!warnings(&lake(side, waves), &[]).concat().contains("lake"), "{side} {waves}");
    }
}
