//! Scene files and `--set`. Every key of the parameter table can be set, every wrong value is refused with
//! its key, range and line, and no text makes the reader panic.

pub mod animation;
pub mod boxes;
mod fur;
mod hair;
mod mesh_faults;
pub mod meshes;
pub mod presets;
mod sequences;
mod skin;
pub mod slips;
mod told;
pub mod volumes;

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::cli::faults::{run, taki};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use serde_json::json;
use taki::scene::{Kind, Limits, PARAMS, Param, Place, Raw, Scene, Source, Value, Values, presets};
use tempfile::tempdir;

use crate::model::Doc;

const FIG5: &str = include_str!("../../../assets/scenes/fig5.toml");
/// A scene with one of everything that a scene can name.
const ONE_OF_EACH: &str = "version = 1
[lights.a]
kind = \"directional\"
[rocks.a]
corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
[pools.a]
corners = [[0, 0, 0], [1, 0, 0], [1, 0, -1], [0, 0, -1]]
[materials.a]
repeat_u = 2.0
[materials.b]
volume = \"a\"
[volumes.a]
nx = 8
[meshes.a]
file = \"a.glb\"
[boxes.a]
volume = \"water\"
[sheets.a]
points = [[0, 1, 0], [0, 0, 1]]
material = \"a\"
[splashes.a]
material = \"a\"
[[quads]]
corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
material = \"a\"
[[quads]]
corners = [[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
material = \"b\"
[[animate.tracks]]
key = \"trace.sigma\"
frames = [0]
values = [1.5]
";

fn source(text: &str) -> Source {
    Source { name: "s".into(), origin: "s.toml".into(), folder: PathBuf::from("."), text: text.into() }
}

/// Reads and checks a scene from text.
fn read(text: &str) -> Result<Scene, String> {
    let checked = source(text)
        .values()
        .and_then(|values| Scene::from_values("s", values, Some(Path::new(".")), &Limits::default()));
    checked.map_err(|e| {
        assert!(matches!(e.exit_code(), 65 | 33), "{e}");
        e.to_string()
    })
}

fn preset(name: &str, sets: &[&str]) -> Result<Scene, String> {
    let sets: Vec<String> = sets.iter().map(|s| (*s).into()).collect();
    Scene::load(name.as_ref(), &sets, &Limits::default()).map_err(|e| {
        assert_eq!(e.exit_code(), 65, "{e}");
        e.to_string()
    })
}

/// Asserts that the result is an error that contains all of `words`.
fn refused<T>(result: Result<T, String>, words: &[&str]) {
    let Err(error) = result else { panic!("accepted: {words:?}") };
    words.iter().for_each(|word| assert!(error.contains(word), "no {word:?} in: {error}"));
}

/// Parameters with values that do not go with boxes.
const NOT_IN_BOXES: [&str; 2] = ["light.scattering", "trace.attenuation"];

/// Writes `ONE_OF_EACH` and its mesh into a folder, and returns the path of the scene.
fn one_of_each(folder: &Path) -> PathBuf {
    let mut mesh = Doc::square();
    mesh.json["materials"][0]["name"] = json!("a");
    mesh.json["cameras"] = json!([{"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}]);
    mesh.json["nodes"][0]["camera"] = json!(0);
    fs::write(folder.join("a.glb"), mesh.glb()).unwrap();
    let file = folder.join("one.toml");
    fs::write(&file, ONE_OF_EACH).unwrap();
    file
}

/// Key of a parameter in `ONE_OF_EACH`.
fn concrete(param: &Param) -> String {
    param.key.replace(
        '*',
        if param.key.starts_with("quads") || param.key.starts_with("animate") { "0" } else { "a" },
    )
}

/// A valid value that is not the default, as TOML.
fn another(param: &Param) -> String {
    match param.kind {
        Kind::Float(min, max, d) => Value::Float(if d == min { 0.5 * max } else { min }).to_toml(),
        Kind::Int(min, max, d) => (if d == min { max.min(min + 1) } else { min }).to_string(),
        Kind::Choice(words) => words[1].into(),
        Kind::Switch(on) => (!on).to_string(),
        // Colours of pools, rocks and cells are albedos.
        Kind::Color(_)
            if param.key.starts_with("pools")
                || param.key.starts_with("volume")
                || ["rocks.*.color", "meshes.*.color"].contains(&param.key) =>
        {
            "[0.25, 0.5, 1.0]".into()
        }
        Kind::Color(_) => "[0.25, 3.0, 10000.0]".into(),
        Kind::Point(_) if param.key == "boxes.*.size" => "[2.5, 3.25, 77.0]".into(),
        Kind::Point(_) => "[-2.5, 3.25, 77.0]".into(),
        Kind::Text(_) if param.key.ends_with("material") => "water".into(),
        Kind::Text(_) if param.key == "meshes.*.materials.*" => "water".into(),
        Kind::Text(_) if ["boxes.*.volume", "materials.*.volume", "camera.from"].contains(&param.key) => {
            "a".into()
        }
        Kind::Text(_) if param.key == "meshes.*.file" => {
            format!("{:?}", concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/model/trimesh.glb"))
        }
        // A volume file is to be there.
        Kind::Text(_) => format!("{:?}", concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml")),
        Kind::Corners if param.key.starts_with("pools") => {
            "[[0, 1, 0], [2, 1, 0], [2, 1, -2], [0, 1, -2]]".into()
        }
        Kind::Corners => "[[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]]".into(),
        Kind::Frames => "[0, 7, 999999999]".into(),
        Kind::Series if param.key.ends_with("widths") => "[0.25, 3.0]".into(),
        Kind::Series => "[[0.25, -3.0, 10000.0], [1.0, 2.0, 3.0]]".into(),
    }
}

#[test]
fn every_parameter_can_be_set_and_is_printed() {
    let dir = tempdir().unwrap();
    let file = one_of_each(dir.path());
    let before = Scene::load(&file, &[], &Limits::default()).unwrap();
    for param in PARAMS {
        let (key, text) = (concrete(param), another(param));
        if key.ends_with(".builder") {
            // It needs the file of a simulation.
            continue;
        }
        let mut sets = vec![format!("{key} = {text}")];
        if NOT_IN_BOXES.contains(&param.key) {
            sets.push("remove = boxes".into());
        }
        if param.key == "materials.*.carrier" {
            // A shell lies on meshes alone.
            sets.extend(["quads.0", "sheets.a", "splashes.a"].map(|user| format!("{user}.material = water")));
        }
        let scene =
            Scene::load(&file, &sets, &Limits::default()).unwrap_or_else(|e| panic!("{key} = {text}: {e}"));
        assert!(scene.values().unwrap().is_set(&key), "{key}");
        assert_ne!(scene.values().unwrap().get(&key), before.values().unwrap().get(&key), "{key} = {text}");
        let line =
            format!("{} = {}", key.rsplit('.').next().unwrap(), scene.values().unwrap().get(&key).to_toml());
        assert!(scene.to_toml().lines().any(|l| l == line), "{line} is not in {}", scene.to_toml());
        assert_ne!(scene.to_toml(), before.to_toml());
        let printed = source(&scene.to_toml()).values().unwrap();
        assert_eq!(printed.get(&key), scene.values().unwrap().get(&key), "{key}");
    }
}

/// The word of `show` of a table that is a holdout or is not, or of one that the scene left out.
fn shown(holdout: Option<bool>) -> &'static str {
    match holdout {
        None => "hidden",
        Some(true) => "holdout",
        Some(false) => "visible",
    }
}

#[test]
fn every_word_of_a_choice_gives_the_variant_of_its_name() {
    let dir = tempdir().unwrap();
    let file = one_of_each(dir.path());
    for param in PARAMS {
        // The scene's values do not tell the kind of its environment or its animation. Those of carriers and
        // projections are told by the surfaces of a mesh, which the tests of meshes compare; those of
        // measured volumes need the file of a simulation, as the tests of boxes have it.
        let of_measured = ["builder", "velocity_at", "rho", "reflect", "level_set_unit", "up"];
        let is_measured = of_measured.iter().any(|last| param.key.ends_with(&format!(".{last}")));
        let is_kept = !is_measured
            && ![
                "environment.kind",
                "animate.tracks.*.interpolation",
                "materials.*.carrier",
                "materials.*.side",
                "materials.*.thickness_from",
                "meshes.*.projection",
            ]
            .contains(&param.key);
        let Kind::Choice(words) = param.kind else { continue };
        for word in words.iter().filter(|_| is_kept) {
            let setting = format!("{} = {word}", concrete(param));
            let mut sets = vec![setting.clone()];
            if NOT_IN_BOXES.contains(&param.key) {
                sets.push("remove = boxes".into());
            }
            let scene =
                Scene::load(&file, &sets, &Limits::default()).unwrap_or_else(|e| panic!("{setting}: {e}"));
            let variant = match param.key {
                "image.auto_exposure" => scene.image.look.auto_exposure.word(),
                "image.dither" => scene.image.look.dither.word(),
                "image.filter" => scene.image.filter.word(),
                "image.primaries" => scene.image.gamut.word(),
                "image.tone" => scene.image.look.tone.word(),
                "light.frame" => scene.angles.word(),
                "light.reflection" => scene.reflection.kind().word(),
                "light.scattering" => scene.scattering.word(),
                "light.visibility" => scene.visibility.word(),
                "lights.*.kind" => scene.lights[0].kind().word(),
                "meshes.*.show" => shown(scene.triangles.first().map(|own| own.holdout)),
                "pools.*.show" => shown(scene.pools.first().map(|pool| pool.holdout)),
                "rocks.*.kind" => scene.rocks[0].kind.word(),
                "pools.*.waves" => scene.pools[0].waves.word(),
                "rocks.*.show" => shown(scene.rocks.first().map(|rock| rock.holdout)),
                "trace.attenuation" => scene.trace.attenuation.kind().word(),
                "trace.filter" => scene.trace.filter.word(),
                "trace.lookup" => scene.trace.lookup.word(),
                "volume.storage" => scene.recipes[0].asked_storage.word(),
                "volumes.*.storage" => scene.recipes[1].asked_storage.word(),
                "volume.reflection" => scene.recipes[0].reflection.word(),
                "volumes.*.reflection" => scene.recipes[1].reflection.word(),
                other => panic!("the variant of {other} is not compared"),
            };
            assert_eq!(variant, *word, "{setting}");
        }
    }
}

#[test]
fn ranges_include_their_ends_and_nothing_outside() {
    let set = |key: &str, raw: Raw| Values::default().set(key, &raw, &Place("here:7".into()));
    for param in PARAMS {
        let key = concrete(param);
        let (inside, outside): (Vec<Raw>, Vec<Raw>) = match param.kind {
            Kind::Float(min, max, d) => (
                [min, max, d].map(Raw::Float).into(),
                [min.next_down(), max.next_up(), f64::INFINITY, -f64::INFINITY, f64::NAN, 1e-40, 1e300]
                    .map(Raw::Float)
                    .into(),
            ),
            Kind::Int(min, max, d) => {
                let past = [min.checked_sub(1), max.checked_add(1), Some(i64::MIN)];
                (
                    [min, max, d].map(Raw::Int).into(),
                    past.into_iter().flatten().map(Raw::Int).chain([Raw::Float(1.0)]).collect(),
                )
            }
            Kind::Choice(words) => (
                words.iter().map(|w| Raw::Text((*w).into())).collect(),
                ["", "None", "march "].map(|w| Raw::Text(w.into())).into(),
            ),
            Kind::Switch(_) => (
                [false, true].map(Raw::Switch).into(),
                vec![Raw::Int(1), Raw::Text("true".into()), Raw::Text(String::new())],
            ),
            Kind::Color(c) => (vec![list(c), list([0.0, 1e4, 1.0])], odd_triples(-1e-3, 10_000.1)),
            Kind::Point(c) => (vec![list(c), list([-1e7, 1e7, 0.0])], odd_triples(-1e7 - 1.0, 1e7 + 1.0)),
            Kind::Text(_) => (vec![Raw::Text("滝 \"'\n".into())], vec![Raw::Int(1), Raw::List(vec![])]),
            Kind::Corners => {
                let p = || list([0.0, 1.0, 2.0]);
                let corners = |n: usize| Raw::List((0..n).map(|_| p()).collect());
                let long = Raw::List(vec![p(), p(), p(), Raw::List(vec![Raw::Int(1); 4])]);
                (vec![corners(4)], vec![corners(3), corners(5), corners(0), p(), long])
            }
            Kind::Frames => {
                let list = |n: &[i64]| Raw::List(n.iter().copied().map(Raw::Int).collect());
                let many = |n: i64| list(&(0..n).collect::<Vec<_>>());
                (
                    vec![list(&[]), list(&[0]), list(&[-999_999_999, 999_999_999]), many(10_000)],
                    vec![
                        list(&[-1_000_000_000]),
                        list(&[1_000_000_000]),
                        list(&[2, 2]),
                        list(&[2, 1]),
                        many(10_001),
                        Raw::Int(1),
                    ],
                )
            }
            Kind::Series => {
                let numbers = |n: usize| Raw::List(vec![Raw::Float(0.5); n]);
                let corners = || Raw::List(vec![list([0.0, 1.0, 2.0]); 4]);
                (
                    vec![
                        numbers(0),
                        numbers(10_000),
                        Raw::List(vec![list([1.0; 3]); 2]),
                        Raw::List(vec![corners(); 2]),
                    ],
                    vec![
                        numbers(10_001),
                        Raw::List(vec![Raw::Float(f64::NAN)]),
                        Raw::List(vec![numbers(2); 2]),
                        Raw::List(vec![list([1.0; 3]), Raw::Int(1)]),
                        Raw::List(vec![Raw::List(vec![numbers(2); 4])]),
                        Raw::Float(1.0),
                    ],
                )
            }
        };
        for raw in inside {
            set(&key, raw.clone()).unwrap_or_else(|e| panic!("{key} = {raw:?}: {e}"));
        }
        for raw in outside.into_iter().chain([Raw::Other("a boolean")]) {
            let result = set(&key, raw.clone()).map_err(|e| e.to_string());
            assert!(result.is_err(), "accepted {key} = {raw:?}");
            refused(result, &["here:7: ", &format!("{key} = "), &format!("allowed: {}", param.range())]);
        }
    }
}

fn list(c: [f64; 3]) -> Raw {
    Raw::List(c.map(Raw::Float).into())
}

/// Lists that are not three numbers inside a range.
fn odd_triples(below: f64, above: f64) -> Vec<Raw> {
    let wrong = [below, above, f64::NAN, f64::INFINITY, 1e-40];
    let mut lists: Vec<Raw> = wrong.map(|x| list([0.5, x, 0.5])).into();
    lists.extend([vec![], vec![Raw::Int(1); 2], vec![Raw::Int(1); 4]].map(Raw::List));
    lists.extend([Raw::Int(1), Raw::Text("red".into()), Raw::List(vec![Raw::Text("1".into()); 3])]);
    lists
}

#[test]
fn a_wrong_value_is_refused_with_its_file_line_and_range() {
    let cases = [
        ("trace.sigma", "nan", "0 to 1e5"),
        ("trace.sigma", "inf", "0 to 1e5"),
        ("trace.sigma", "-inf", "0 to 1e5"),
        ("trace.sigma", "-1.0", "0 to 1e5"),
        ("trace.tau", "1e-40", "0 to 1000"),
        ("curves.h", "8.0001", "0 to 8"),
        ("curves.h", "1e400", "0 to 8"),
        ("volume.nx", "2.5", "1 to 1000000"),
        ("volume.nx", "99999999999999999999", "1 to 1000000"),
        ("volume.seed", "-1", "0 to 2^63−1"),
        ("light.frame", "\"word\"", "world, texture"),
        ("image.tone", "true", "filmic, agx, none"),
        ("camera.eye", "[0.0, nan, 0.0]", "three numbers, ±1e7"),
        ("light.ambient", "[0.1, -0.1, 0.1]", "three numbers, 0 to 10000"),
        ("light.p", "1979-05-27", "1 to 10000"),
        ("camera.near", "{}", "1e-4 to 10000"),
    ];
    for (key, value, range) in cases {
        let (section, name) = key.split_once('.').unwrap();
        let text = format!("version = 1\n\n[{section}]\n# a comment\n{name} = {value}\n");
        refused(read(&text), &["s.toml:5: ", &format!("{key} = "), &format!("allowed: {range}")]);
        if value != "{}" {
            refused(preset("fig5", &[&format!("{key}={value}")]), &["--set: ", key, range]);
        }
    }
    let dir = tempdir().unwrap();
    let file = dir.path().join("a b.toml");
    fs::write(&file, "version = 1\ncurves.h = nan\n").unwrap();
    run(taki(["scene"]).arg(&file)).refused(65, &["a b.toml:2: ", "curves.h = NaN", "allowed: 0 to 8"]);
}

#[test]
fn misspelt_keys_and_presets_suggest_the_right_one() {
    for (wrong, right) in [
        ("curves.hh", "curves.h"),
        ("sgima", "trace.sigma"),
        ("light.ambiant", "light.ambient"),
        ("volume.aplha", "volume.alpha"),
        ("lights.sun.colour", "lights.sun.color"),
        ("camera.fovy", "camera.fov"),
        ("quads.0.corner", "quads.0.corners"),
        ("image.sample", "image.samples"),
    ] {
        let suggestion = format!("did you mean {right}?");
        refused(preset("fig5", &[&format!("{wrong}=1")]), &["unknown key", wrong, &suggestion]);
    }
    refused(read("version = 1\n[curves]\nhh = 1\n"), &["s.toml:3: ", "curves.hh", "did you mean curves.h?"]);
    for (wrong, right) in [("fig55", "did you mean fig5?"), ("waterfal", "did you mean waterfall?")] {
        run(&mut taki(["scene", wrong])).refused(65, &[wrong, right]);
    }
    run(&mut taki(["scene", "xyz"])).refused(65, &["xyz", "presets: waterfall, evening"]);
    run(&mut taki(["scene", "fig5", "--set", "curves.h"])).refused(2, &["--set KEY=VALUE"]);
}

#[test]
fn set_makes_no_new_names() {
    for (setting, known) in [
        ("lights.sum.intensity=1", "there are: sun"),
        ("rocks.wal.levels=1", "there are: foot, left, right, wall"),
        ("materials.watre.thickness=1", "there are: water"),
        ("quads.8.material=water", "there are: 0, 1, 2"),
    ] {
        refused(preset("fig5", &[setting]), &["the scene has no", known]);
    }
    refused(read("version = 1\nquads.0.corners = []\n"), &["s.toml:2: ", "[[quads]]"]);
}

#[test]
fn tables_without_keys_are_defaults_or_mistakes() {
    let scene = read("version = 1\n[curves]\n[lights.a]\n[lights]\n[materials.m]\n").unwrap();
    assert_eq!((scene.lights.len(), scene.values().unwrap().names("materials")), (1, vec!["m".into()]));
    // Tables without keys change nothing over a base.
    let base = "version = 1\nbase = \"fig5\"\n";
    let same = read(&format!("{base}[lights.sun]\n[rocks.wall]\n")).unwrap();
    assert_eq!(same.lights, preset("fig5", &[]).unwrap().lights);
    for (text, word) in [
        ("[ligths]", "ligths"),
        ("[lights.a.b]", "lights.a.b"),
        ("[lights.\"\"]", "lights."),
        ("[rocks.a]", "rocks.a has no corners"),
        ("[[quads]]", "quads.0 has no corners"),
        ("[[quads]]\nmaterial = \"water\"", "quads.0 has no corners"),
        ("[[lights]]", "unknown key lights"),
    ] {
        refused(read(&format!("version = 1\n{text}\n")), &[word]);
    }
}

#[test]
fn a_scene_replaces_its_bases_quads_and_merges_its_lights() {
    let text = "version = 1\nbase = \"fig5\"\n[lights.moon]\nintensity = 0.5\n[lights.sun]\nintensity = 3.0
[[quads]]\ncorners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]\n";
    let scene = read(text).unwrap();
    let base = preset("fig5", &[]).unwrap();
    assert_eq!((base.quads.len(), scene.quads.len()), (8, 1));
    assert_eq!(scene.values().unwrap().names("lights"), ["moon", "sun"]);
    assert_eq!(scene.values().unwrap().float("lights.sun.intensity"), 3.0);
    assert_eq!(
        scene.values().unwrap().get("lights.sun.direction"),
        base.values().unwrap().get("lights.sun.direction")
    );
    assert_eq!(scene.rocks, base.rocks);
    for wrong in ["\"fig55\"", "5", "\"s.toml\"", "[\"fig5\"]"] {
        refused(read(&format!("version = 1\nbase = {wrong}\n")), &["s.toml:2: base is no preset", "fig5"]);
    }
}

#[test]
fn versions_1_and_2_are_read() {
    refused(read("[volume]\nnx = 4\n"), &["s.toml", "no version", "version = 2"]);
    refused(read("\nversion = 3\n"), &["s.toml:2: ", "needs taki ≥ 3"]);
    for wrong in ["\"x\"", "0", "-1", "1.0", "2.0", "[1]", "99999999999999999999"] {
        refused(read(&format!("version = {wrong}\n")), &["s.toml:1: ", "version = 2"]);
    }
    read("version = 1\n").unwrap();
}

#[test]
fn a_file_of_version_2_begins_with_the_look_of_water() {
    let sheet = "[sheets.a]\npoints = [[0, 1, 0], [0, -1, 0]]\n";
    let values = |top: &str| {
        let scene = read(&format!("{top}\n{sheet}")).unwrap();
        scene.values().unwrap().to_toml()
    };
    let plain = values("version = 1");
    let water = values("version = 1\nbase = \"water\"");
    assert_eq!(values("version = 2"), water);
    assert_ne!(plain, water);
    for base in ["fig5", "waterfall"] {
        let of = |version: u32| values(&format!("version = {version}\nbase = \"{base}\""));
        assert_eq!(of(1), of(2));
    }
    // What is printed means the same whatever it began with.
    assert!(water.starts_with("version = 1\n"));
    assert_eq!(read(&water).unwrap().values().unwrap().to_toml(), water);
}

#[test]
fn no_prefix_of_a_scene_makes_the_reader_panic() {
    let prefixes: Vec<&str> = FIG5.char_indices().map(|(end, _)| &FIG5[..end]).collect();
    assert!(prefixes.len() > 2000);
    let faults = prefixes.iter().filter(|text| read(text).is_err()).count();
    // Prefixes that end between two lines are scenes, the others are not.
    assert!((prefixes.len() / 2..prefixes.len()).contains(&faults), "{faults}");
    read(FIG5).unwrap();
}

#[test]
fn no_flipped_byte_makes_the_reader_panic() {
    let mut rng = Pcg64Mcg::seed_from_u64(5);
    let mut faults = 0;
    for _ in 0..500 {
        let mut bytes = FIG5.as_bytes().to_vec();
        for _ in 0..1 + rng.random_range(0..3) {
            let at = rng.random_range(0..bytes.len());
            bytes[at] = rng.random_range(0..128u8);
        }
        // Bytes that are not UTF-8 are refused before they are parsed.
        faults += usize::from(read(&String::from_utf8_lossy(&bytes)).is_err());
    }
    assert!((50..500).contains(&faults), "{faults}");
}

#[test]
fn hostile_files_are_refused_in_little_time_and_stack() {
    let dir = tempdir().unwrap();
    let file = dir.path().join("s.toml");
    let deep = |text: &str| text.repeat(100_000);
    let cases: [(Vec<u8>, &str); 8] = [
        (format!("version = 1\na = {}", deep("[")).into(), "s.toml:2"),
        (format!("version = 1\na = {}", deep("{a=")).into(), "s.toml:2"),
        (format!("version = 1\n{}a = 1\n", deep("a.")).into(), "s.toml:"),
        (format!("version = 1\n[{}a]\nb = 1\n", deep("a.")).into(), "s.toml:"),
        (format!("version = 1\n{}", deep("[[a.b]]\n")).into(), "s.toml:"),
        (vec![b'#'; 17 << 20], "at most 16777216"),
        (b"version = 1\n# \xff\n".into(), "byte 14 is not UTF-8"),
        (vec![0; 1 << 20], "s.toml:1"),
    ];
    for (text, words) in cases {
        fs::write(&file, text).unwrap();
        let start = Instant::now();
        run(taki(["scene"]).arg(&file)).refused(65, &[words]);
        assert!(start.elapsed() < Duration::from_secs(10), "{words}: {:?}", start.elapsed());
    }
}

#[test]
fn scenes_with_many_parts_are_read_in_time_that_grows_with_their_size() {
    let quad = "[[quads]]\ncorners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]\nmaterial = \"m\"\n";
    let start = Instant::now();
    let scene =
        read(&format!("version = 1\n[materials.m]\nrepeat_u = 2.0\n{}", quad.repeat(20_000))).unwrap();
    assert_eq!(scene.quads.len(), 20_000);
    assert_eq!(source(&scene.to_toml()).values().unwrap().names("quads").len(), 20_000);
    // This takes milliseconds. It would take a minute if each part looked at all others.
    assert!(start.elapsed() < Duration::from_secs(10), "{:?}", start.elapsed());
    refused(read(&format!("version = 1\n{}", quad.repeat(65_537))), &["65537 quads", "at most 65536"]);
    let lights: String = (0..4097).map(|i| format!("[lights.l{i}]\n")).collect();
    refused(read(&format!("version = 1\n{lights}")), &["4097 lights", "at most 4096"]);
}

#[test]
fn the_printed_scene_is_the_same_scene() {
    let odd = "version = 1\n[lights.\"a b\"]\n[lights.007]\n\
               [lights.\"x]\\n\\\"\\u007f\"]\n[lights.\"滝\"]\n[lights.7]\n";
    let mut texts: Vec<(String, String)> = presets()
        .map(|(name, _)| (name.into(), fs::read_to_string(format!("assets/scenes/{name}.toml")).unwrap()))
        .collect();
    texts.push(("odd names".into(), odd.into()));
    for (name, text) in texts {
        let scene = read(&text).unwrap();
        let again = read(&scene.to_toml()).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(scene.keys(), again.keys(), "{name}");
        for key in scene.keys() {
            assert_eq!(scene.values().unwrap().get(&key), again.values().unwrap().get(&key), "{name}: {key}");
        }
        assert_eq!(scene.to_toml(), again.to_toml(), "{name}");
        assert_eq!((&scene.quads, &scene.lights), (&again.quads, &again.lights), "{name}");
    }
    assert_eq!(read(odd).unwrap().lights.len(), 5);
}

#[test]
fn faults_of_a_quad_name_its_index() {
    let good = "[[quads]]\ncorners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]\n";
    for (name, corners) in [
        ("no area", "[[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]]"),
        ("one point", "[[1, 1, 1], [1, 1, 1], [1, 1, 1], [1, 1, 1]]"),
        ("a corner twice", "[[0, 0, 0], [0, 0, 0], [1, 1, 0], [0, 1, 0]]"),
        ("concave", "[[0, 0, 0], [1, 0, 0], [0.2, 0.2, 0], [0, 1, 0]]"),
        ("bow-tie", "[[0, 0, 0], [1, 1, 0], [1, 0, 0], [0, 1, 0]]"),
        ("not planar", "[[0, 0, 0], [1, 0, 0], [1, 1, 0.5], [0, 1, 0]]"),
    ] {
        let text = format!("version = 1\n{good}[[quads]]\ncorners = {corners}\n{good}");
        let Err(error) = read(&text) else { panic!("accepted a quad: {name}") };
        assert!(error.contains("quad 1 (quads.1.corners)"), "{name}: {error}");
    }
    let unknown = format!("version = 1\n{good}{good}material = \"mud\"\n");
    refused(read(&unknown), &["s.toml:6: quads.1.material", "\"mud\"", "water"]);
}

#[test]
fn scenes_that_contradict_themselves_are_refused() {
    for (sets, words) in [
        (&["camera.eye=[1, 2, 3]", "camera.target=[1, 2, 3]"][..], "camera.eye and camera.target"),
        (&["camera.up=[0, 0, 0]"], "camera.up"),
        (&["camera.eye=[0, 9, 0]", "camera.target=[0, 0, 0]"], "camera.up"),
        (&["lights.sun.direction=[0, 0, 0]"], "lights.sun.direction"),
        (&["curves.across=65536", "curves.deep=65536", "curves.levels=16"], "curve points"),
    ] {
        refused(preset("fig5", sets), &[words]);
    }
    // A number slightly above 0 gives no direction. A number far below the others still does.
    preset("fig5", &["lights.sun.direction=[0, 1e-9, 0]"]).unwrap();
}

#[test]
fn the_paper_figures_differ_in_one_value_each() {
    let values = |name: &str| preset(name, &[]).unwrap().values().unwrap().clone();
    for (name, key) in [("fig6", "volume.alpha"), ("fig7", "curves.h")] {
        let (fig5, mut other) = (values("fig5"), values(name));
        assert_ne!(fig5.get(key), other.get(key), "{name}");
        let (key, value) = fig5.0.iter().find(|(k, _)| k.to_string() == key).unwrap();
        other.0.insert(key.clone(), value.clone());
        assert_eq!(fig5, other, "{name} differs from fig5 in more");
    }
}

#[test]
fn the_scene_as_json_has_all_that_an_independent_program_needs() {
    let text = run(&mut taki(["scene", "fig5", "--json", "--set=volume.alpha=0.25"]));
    let json: serde_json::Value = serde_json::from_str(text.done()).unwrap();
    assert_eq!(json["quads"].as_array().unwrap().len(), 8);
    assert_eq!(json["quads"][0]["corners"].as_array().unwrap().len(), 4);
    assert_eq!(json["volume"]["alpha"], 0.25);
    assert_eq!(json["lights"]["sun"]["intensity"], 2.0);
    assert_eq!(json["camera"]["fov"], 38.0);
    let derived = &json["derived"];
    let offsets = derived["camera"]["sample_offsets"].as_array().unwrap().len() as u64;
    assert_eq!(json["image"]["samples"], offsets);
    assert_eq!(derived["lights"].as_array().unwrap().len(), 1);
    let mesh = |column: &str| derived["mesh"][column].as_array().unwrap().clone();
    let vertices = mesh("positions").len();
    assert_eq!([mesh("normals").len(), mesh("albedos").len()], [vertices; 2]);
    let squares: u64 = json["rocks"]
        .as_object()
        .unwrap()
        .values()
        .map(|r| 4u64.pow(r["levels"].as_u64().unwrap() as u32))
        .sum();
    assert_eq!(mesh("triangles").len() as u64, 2 * squares);
    let last =
        mesh("triangles").iter().flat_map(|t| t.as_array().unwrap().clone()).filter_map(|i| i.as_u64()).max();
    assert_eq!(last, Some(vertices as u64 - 1));
}

#[test]
fn a_scene_that_code_has_edited_has_no_written_values() {
    let mut scene = Scene::preset("fig5").unwrap().with(&["trace.tau=7", "curves.h=1.1"]).unwrap();
    assert_eq!(scene.values().unwrap().float("trace.tau"), 7.0);
    assert_eq!(scene.trace.attenuation, taki::trace::Attenuation::PerCell { tau: 7.0 });
    scene.edit().p = 3.0;
    assert_eq!((scene.p, scene.values()), (3.0, None));
    assert_eq!(scene.with(&["trace.sigma=8"]).unwrap_err().exit_code(), 65);
}

#[test]
fn what_code_asks_of_a_preset_is_checked_as_set_is() {
    assert_eq!(Scene::preset("fig8").unwrap_err().exit_code(), 65);
    let fig5 = Scene::preset("fig5").unwrap();
    for (set, code) in [("trace.sigma", 2), ("trace.sigma=-1", 65), ("trace.sgima=1", 65)] {
        assert_eq!(fig5.with(&[set]).unwrap_err().exit_code(), code, "{set}");
    }
}
