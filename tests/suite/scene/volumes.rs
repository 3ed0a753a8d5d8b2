//! Volumes with names: their keys are those of `water`, every slip is told, and what nothing shows is not
//! built.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use crate::cli::faults::{Run, run, taki};
use taki::job::memory_of;
use taki::scene::{Animation, GROUPS, Limits, PARAMS, Param, Scene, split_volume_key};
use taki::util::monitor::Unwatched;
use taki::util::window::Window;
use taki::volume::Storage;
use tempfile::{TempDir, tempdir};

/// A scene with fur beside the water, on a quad each.
const FUR: &str = "version = 1
base = \"front\"
[volume]
nx = 12
ny = 10
nz = 8
[volumes.fur]
nx = 9
ny = 16
nz = 5
across = 7
deep = 4
alpha = 0.5
[materials.pelt]
thickness = 0.2
volume = \"fur\"
[[quads]]
corners = [[-1, 1, 0], [0, 1, 0], [0, -1, 0], [-1, -1, 0]]
[[quads]]
corners = [[0, 1, 0], [1, 1, 0], [1, -1, 0], [0, -1, 0]]
material = \"pelt\"
[image]
width = 24
height = 16
samples = 1
";

/// Writes a scene into a folder of its own.
fn file(text: &str) -> (TempDir, std::path::PathBuf) {
    let dir = tempdir().unwrap();
    let file = dir.path().join("s.toml");
    fs::write(&file, text).unwrap();
    (dir, file)
}

fn load(text: &str, sets: &[&str]) -> taki::Result<Scene> {
    let (_dir, file) = file(text);
    let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
    Scene::load(&file, &sets, &Limits::default())
}

fn fault(text: &str, sets: &[&str]) -> String {
    load(text, sets).expect_err("refused").to_string()
}

fn names(scene: &Scene) -> Vec<&str> {
    scene.recipes.iter().map(|recipe| recipe.name.as_str()).collect()
}

#[test]
fn a_volume_has_every_key_of_water_with_the_same_texts() {
    let of = |title: &str| GROUPS.iter().find(|group| group.title == title).expect("a group").params;
    let groups =
        ["Curves", "Volume", "Fur", "Cloth", "Long hair", "Strands of a file", "Mountain", "Grains", "Skin"];
    let own: Vec<&Param> = groups.into_iter().flat_map(of).collect();
    let named = of("Volumes");
    assert_eq!(own.len(), named.len());
    let mut lasts = BTreeSet::new();
    for (own, named) in own.into_iter().zip(named) {
        let last = own.key.rsplit('.').next().unwrap();
        assert_eq!(named.key, format!("volumes.*.{last}"));
        assert_eq!(format!("{:?}", Param { key: own.key, ..*named }), format!("{own:?}"));
        assert!(lasts.insert(last), "{last} is in both tables");
        assert_eq!(split_volume_key(&format!("volumes.fur.{last}")), Some(("fur", own.key)));
        assert_eq!(split_volume_key(own.key), Some(("water", own.key)));
    }
    assert!(PARAMS.iter().filter(|param| split_volume_key(param.key).is_some()).count() == 2 * named.len());
    assert_eq!(split_volume_key("trace.sigma"), None);
    assert_eq!(split_volume_key("volumes.fur.sigma"), None);
}

#[test]
fn every_key_of_a_volume_acts_as_that_of_water_does() {
    let of = |name: &str, set: &str| {
        let scene = load(FUR, &[set]).unwrap();
        scene.recipes.iter().find(|recipe| recipe.name == name).expect("shown").clone()
    };
    let same = "volume.nx=9 volume.ny=16 volume.nz=5 curves.across=7 curves.deep=4 volume.alpha=0.5 \
                volume.k_d=0.5 volume.k_s=0.5 volume.k_noise=0.1 curves.h=1.3 curves.bundles=3 \
                curves.radius=0.1 curves.wander=0.2 curves.breathe=0.3 curves.loose=0.25 \
                volume.coherence=0.5 volume.strand_length=0.3 volume.coverage=0.4 volume.crest=0.2 \
                volume.seed=5 volume.flow=0.25 \
                curves.amplitude=0.07 curves.levels=3 volume.storage=sparse";
    let twin = |set: &str| format!("volumes.fur.{}", set.split_once('.').unwrap().1);
    let (water, fur): (Vec<&str>, Vec<String>) =
        (same.split_whitespace().collect(), same.split_whitespace().map(twin).collect());
    let fur: Vec<&str> = fur.iter().map(String::as_str).collect();
    let scene = load(FUR, &[water, fur].concat()).unwrap();
    let [water, fur] = &scene.recipes[..] else { panic!("two volumes") };
    assert_eq!((water.water, water.storage, water.flow), (fur.water, fur.storage, fur.flow));
    let volumes = scene.volumes(1 << 30, &Unwatched).unwrap();
    assert!(volumes[0] == volumes[1]);
    assert_ne!(of("fur", "volumes.fur.seed=3").water, of("fur", "volumes.fur.seed=4").water);
    assert_eq!(of("water", "volumes.fur.seed=3").water, of("water", "volumes.fur.seed=4").water);
}

#[test]
fn a_scene_of_today_shows_water_alone() {
    // The others have volumes of their own.
    for (name, _) in taki::scene::presets().filter(|(name, _)| {
        !["torus", "bear", "cloth", "hair", "pour", "slope", "sugar", "skin"].contains(name)
    }) {
        let scene = Scene::preset(name).unwrap();
        assert_eq!(names(&scene), ["water"], "{name}");
        assert!(scene.quads.iter().all(|quad| quad.material.volume == 0));
        assert!(!scene.to_toml().contains("[volumes"), "{name}");
    }
    // So does one without quads.
    assert_eq!(names(&load("version = 1\n[volumes.fur]\nnx = 3", &[]).unwrap()), ["water"]);
}

#[test]
fn only_volumes_that_a_surface_shows_are_built_and_the_others_are_told() {
    let scene = load(FUR, &[]).unwrap();
    assert_eq!(names(&scene), ["water", "fur"]);
    assert_eq!(scene.quads.iter().map(|quad| quad.material.volume).collect::<Vec<_>>(), [0, 1]);
    let sizes: Vec<[u32; 3]> =
        scene.volumes(1 << 30, &Unwatched).unwrap().iter().map(|volume| volume.size).collect();
    assert_eq!(sizes, [[12, 10, 8], [9, 16, 5]]);
    let fur = load(FUR, &["quads.0.material=pelt"]).unwrap();
    assert_eq!((names(&fur), fur.quads[0].material.volume), (vec!["fur"], 0));
    let water = load(FUR, &["materials.pelt.volume=water"]).unwrap();
    assert_eq!(names(&water), ["water"]);
    let warnings = |scene: &Scene| scene.warnings(&scene.volumes(1 << 30, &Unwatched).unwrap()).concat();
    assert_eq!(warnings(&scene), "");
    let said = warnings(&water);
    assert!(said.contains("no material or box shows the volume fur: give one volume = \"fur\""), "{said}");
    let unused = format!("{FUR}[volumes.moss]\nnx = 4\n[materials.green]\nvolume = \"moss\"\n");
    let said = warnings(&load(&unused, &[]).unwrap());
    assert!(said.contains("nothing has the material green, which shows the volume moss"), "{said}");
    assert!(warnings(&load(FUR, &["volumes.fur.alpha=0"]).unwrap()).contains("the volume fur is empty"));
}

#[test]
fn settings_of_a_volume_without_effect_are_told() {
    let (_dir, path) = file(FUR);
    let said = |sets: &[&str]| {
        let run = run(taki(["scene"]).arg(&path).args(sets.iter().flat_map(|set| ["--set", set])));
        run.done();
        run.lines("taki: warning:").concat()
    };
    for (sets, words) in [
        (&["fur.loose=0.5"][..], "volumes.fur.loose has no effect while volumes.fur.bundles is 0"),
        (
            &["volumes.fur.nx=7", "materials.pelt.volume=water"],
            "volumes.fur.nx has no effect: no material or box shows",
        ),
        (
            &["volume.seed=7", "quads.0.material=pelt"],
            "volume.seed has no effect: nothing has the material water, which shows the volume water",
        ),
    ] {
        assert!(said(sets).contains(words), "{sets:?}: {}", said(sets));
    }
    assert_eq!(said(&["fur.loose=0.5", "fur.bundles=3", "fur.nx=7", "h=1.2"]), "");
    // The waves of pools move with the flow of water.
    assert_eq!(said(&["volume.flow=0.5", "quads.0.material=pelt"]), "");
}

#[test]
fn the_keys_of_water_have_no_table_among_the_volumes() {
    let table = FUR.replace("volumes.fur", "volumes.water").replace("\"fur\"", "\"water\"");
    let words = "the keys of the volume water are in [curves] and [volume]";
    let said = fault(&table, &[]);
    assert!(said.contains("s.toml:11: there is no table volumes.water"), "{said}");
    assert!(said.contains(words) && said.contains("write curves.across"), "{said}");
    let said = fault(&format!("{FUR}[volumes.water]\n"), &[]);
    assert!(said.contains("s.toml:26: there is no table volumes.water") && said.contains(words), "{said}");
    for set in ["volumes.water.nx=3", "volumes.water.h=1"] {
        assert!(fault(FUR, &[set]).contains(words), "{}", fault(FUR, &[set]));
    }
    assert!(fault(FUR, &["volumes.water.h=1"]).contains("write curves.h"));
    let track =
        format!("{FUR}[[animate.tracks]]\nkey = \"volumes.water.alpha\"\nframes = [0]\nvalues = [1]\n");
    let (_dir, path) = file(&track);
    let said = Animation::load(&path, &[], &Limits::default()).expect_err("refused").to_string();
    assert!(said.contains(words), "{said}");
    // Another name that begins so is a name.
    assert!(load(&FUR.replace("fur", "water2"), &[]).is_ok());
}

#[test]
fn an_unknown_volume_is_told_with_the_one_that_was_meant() {
    let said = fault(&FUR.replace("volume = \"fur\"", "volume = \"furr\""), &[]);
    assert!(
        said.contains("s.toml:16: materials.pelt.volume = \"furr\": the scene has no such volume"),
        "{said}"
    );
    assert!(said.contains("did you mean fur? Otherwise add [volumes.furr]"), "{said}");
    let said = fault(FUR, &["materials.pelt.volume=moss"]);
    assert!(said.contains("add [volumes.moss], or use one of these: water, fur"), "{said}");
    let said = fault(FUR, &["remove=volumes.fur"]);
    assert!(said.contains("materials.pelt.volume = \"fur\": the scene has no such volume"), "{said}");
    // `--set` adds no volume, and knows the end of a key.
    let said = fault(FUR, &["volumes.moss.nx=3"]);
    assert!(said.contains("the scene has no moss in volumes; there are: fur"), "{said}");
    assert_eq!(load(FUR, &["fur.nx=64"]).unwrap().recipes[1].water.size[0], 64);
    assert_eq!(load(FUR, &["nx=64"]).unwrap().recipes[0].water.size[0], 64);
    // Tables are read by their names, `volumes` before `wool`.
    let wool = FUR.replace("fur", "wool") + "[wool]\nnx = 3\n";
    assert!(fault(&wool, &[]).contains("did you mean volumes.wool.nx?"), "{}", fault(&wool, &[]));
    for (text, words) in [
        ("[volumes]\nnx = 3", "each of them has a table of its own: [volumes.NAME]"),
        ("[volumes.fur.curves]\nnx = 3", "write volumes.fur.nx: a volume has all its keys in one table"),
        ("[volumes.moss]\nacros = 3", "did you mean volumes.moss.across?"),
        ("[volumes.moss]\ndensity = 0.3", "did you mean volumes.moss.alpha?"),
        ("[volumes.moss]\nsigma = 3", "did you mean trace.sigma?"),
    ] {
        let said = fault(&format!("{FUR}{text}\n"), &[]);
        assert!(said.contains(words), "{text}: {said}");
    }
}

#[test]
fn too_many_volumes_are_refused() {
    let volumes = |count: usize| {
        let one = |i: usize| {
            format!(
                "[volumes.v{i}]\nnx = 2\nny = 2\nnz = 2\n[materials.m{i}]\nvolume = \"v{i}\"\n[[quads]]\n\
                 corners = \
                 [[0, 0, {i}], [1, 0, {i}], [1, 1, {i}], [0, 1, {i}]]\nmaterial = \"m{i}\"\n"
            )
        };
        "version = 1\n".to_owned() + &(0..count).map(one).collect::<String>()
    };
    assert_eq!(load(&volumes(64), &[]).unwrap().recipes.len(), 64);
    assert!(fault(&volumes(65), &[]).contains("the scene shows 65 volumes; at most 64"));
}

#[test]
fn the_printed_scene_has_its_volumes() {
    let scene = load(FUR, &["volumes.fur.h=1.25"]).unwrap();
    let printed = load(&scene.to_toml(), &[]).unwrap();
    assert_eq!(printed.to_toml(), scene.to_toml());
    assert_eq!(printed.recipes, scene.recipes);
    for line in ["[volumes.fur]", "h = 1.25", "volume = \"fur\""] {
        assert!(scene.to_toml().lines().any(|own| own == line), "{line}");
    }
    let json = scene.to_json();
    assert_eq!(json["volumes"]["fur"]["ny"], 16);
    assert_eq!(json["derived"]["volumes"][1]["name"], "fur");
    assert_eq!(json["derived"]["quads"][1]["volume"], 1);
}

#[test]
fn keyframes_move_a_volume_and_the_speed_moves_water_alone() {
    let text = format!(
        "{FUR}[animate]\nspeed = 1.0\nfps = 10.0\n[[animate.tracks]]\nkey = \"volumes.fur.alpha\"\n\
         frames = [0, \
         10]\nvalues = [0.5, 1.0]\ninterpolation = \"linear\"\n"
    );
    let (_dir, path) = file(&text);
    let animation = Animation::load(&path, &[], &Limits::default()).unwrap();
    let at = |frame: i32| animation.at(frame).unwrap().recipes.clone();
    assert_eq!([0, 5, 10].map(|frame| at(frame)[1].water.alpha), [0.5, 0.75, 1.0]);
    assert_eq!([0, 5].map(|frame| at(frame)[0].water.alpha), [1.0, 1.0]);
    assert_eq!([0, 5].map(|frame| at(frame)[0].flow), [0.0, 0.5]);
    assert_eq!([0, 5].map(|frame| at(frame)[1].flow), [0.0, 0.0]);
    // A flow that moves by a whole length closes a loop.
    let flow =
        "key = \"volumes.fur.flow\"\nframes = [0, 8]\nvalues = [0.0, 2.0]\ninterpolation = \"linear\"\n";
    let text = format!("{FUR}[animate]\nloop = 8\n[[animate.tracks]]\n{flow}");
    let (_dir, path) = file(&text);
    let animation = Animation::load(&path, &[], &Limits::default()).unwrap();
    assert_eq!(animation.at(3).unwrap().recipes[1].flow, 0.75);
}

/// The program with a scene and more arguments, in the folder of the scene.
fn on(path: &Path, command: &[&str], more: &[&str]) -> Run {
    let folder = path.parent().unwrap();
    run(taki(command.iter().copied()).arg(path).args(more).current_dir(folder))
}

#[test]
fn volumes_are_written_and_read_by_name_and_a_picture_knows_its_own() {
    let (dir, path) = file(FUR);
    let several = on(&path, &["volume", "build"], &["-o", "v.npz"]);
    several.refused(2, &["the scene shows the volumes water, fur; choose one with --volume NAME"]);
    on(&path, &["volume", "build"], &["--volume", "furr", "-o", "v.npz"]).refused(2, &["did you mean fur?"]);
    on(&path, &["volume", "build"], &["--volume", "fur", "-o", "fur.npz"]).done();
    let info = run(taki(["volume", "info", "--json"]).arg(dir.path().join("fur.npz")));
    assert!(info.done().contains("[9,16,5]"), "{}", info.stdout());
    let small = ["--engine=cpu", "-o"];
    on(&path, &["render"], &[&small[..], &["built.png"]].concat()).done();
    // The file in place of the recipe shows the same.
    let by_file = FUR.replace("alpha = 0.5\n", "file = \"fur.npz\"\n");
    fs::write(dir.path().join("file.toml"), &by_file).unwrap();
    let with_file = dir.path().join("file.toml");
    on(&with_file, &["render"], &[&small[..], &["read.png"]].concat()).done();
    run(taki(["compare", "built.png", "read.png", "--absolute=0", "--relative=0"]).current_dir(dir.path()))
        .done();
    let scene = Scene::load(&with_file, &[], &Limits::default()).unwrap();
    assert_eq!(scene.references()[0].0, "volumes.fur.file");
    // Paths of the scene are confined, those of --set are the user's own.
    let elsewhere = tempdir().unwrap();
    fs::copy(dir.path().join("fur.npz"), elsewhere.path().join("v.npz")).unwrap();
    let outside = elsewhere.path().join("v.npz").display().to_string();
    let escaped = by_file.replace("fur.npz", &outside);
    fs::write(&with_file, escaped).unwrap();
    on(&with_file, &["scene"], &[]).refused(65, &["volumes.fur.file", "leads out of the scene's folder"]);
    on(&path, &["scene"], &["--set", &format!("fur.file={outside}")]).done();
    // A picture is rendered again with its own volumes. Those of files are to be given again.
    let picture = dir.path().join("built.png");
    on(&picture, &["render"], &[&small[..], &["again.png"]].concat()).done();
    assert!(fs::read(&picture).unwrap() == fs::read(dir.path().join("again.png")).unwrap());
    let read = dir.path().join("read.png");
    let missing = on(&read, &["render"], &[&small[..], &["lost.png"]].concat());
    missing.refused(65, &["another volume", "--set volumes.fur.file=FILE"]);
    let given = ["--set", "volumes.fur.file=fur.npz"];
    on(&read, &["render"], &[&small[..], &["found.png"], &given[..]].concat()).done();
    assert!(fs::read(&read).unwrap() == fs::read(dir.path().join("found.png")).unwrap());
}

#[test]
fn a_batch_finds_its_pictures_of_several_volumes() {
    let (dir, path) = file(FUR);
    let arguments = ["--frames", "0-1", "--engine=cpu", "-o", "f.####.png"];
    on(&path, &["batch"], &arguments).done();
    let written = |name: &str| fs::metadata(dir.path().join(name)).unwrap().modified().unwrap();
    let before = written("f.0000.png");
    on(&path, &["batch"], &arguments).done();
    assert_eq!(written("f.0000.png"), before, "it is known again");
    on(&path, &["batch"], &[&arguments[..], &["--set", "fur.seed=9", "--overwrite"]].concat()).done();
    assert_ne!(written("f.0000.png"), before);
}

#[test]
fn the_memory_counts_all_volumes_together() {
    let large = FUR
        .replace("nx = 12\nny = 10\nnz = 8", "nx = 96\nny = 96\nnz = 96")
        .replace("nx = 9\nny = 16\nnz = 5", "nx = 64\nny = 64\nnz = 64")
        + "[trace]\nlayers = 1\n";
    let (_dir, path) = file(&large);
    let load = |sets: &[&str], memory: u64| {
        let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
        Scene::load(&path, &sets, &Limits { memory, ..Limits::default() })
    };
    let storages = |sets: &[&str], memory: u64| {
        load(sets, memory).map(|scene| scene.recipes.iter().map(|recipe| recipe.storage).collect::<Vec<_>>())
    };
    let window = Window::whole([24, 16]);
    let all = load(&[], 1 << 32).unwrap();
    let (need, _) = memory_of(&all, window, true, 1 << 32).unwrap();
    // 24 bytes for each cell, beside what the picture takes.
    let cells = 96u64.pow(3) + 64u64.pow(3);
    assert!((24 * cells + (64 << 20)..24 * cells + (65 << 20)).contains(&need), "{need}");
    use Storage::{Dense, Sparse};
    assert_eq!(storages(&[], need).unwrap(), [Dense, Dense]);
    assert_eq!(storages(&[], need - 1).unwrap(), [Sparse, Dense], "the larger one goes first");
    assert_eq!(storages(&["volume.storage=dense"], need - 1).unwrap(), [Dense, Sparse]);
    let refused = storages(&["volume.storage=dense", "volumes.fur.storage=dense"], need - 1).unwrap_err();
    assert_eq!(refused.exit_code(), 33);
    assert!(refused.to_string().contains("the picture with its 2 volumes needs"), "{refused}");
    // Coarse levels need all cells of every volume.
    let pyramid = "trace.filter=pyramid";
    assert_eq!(storages(&[pyramid], 1 << 32).unwrap(), [Dense, Dense]);
    assert_eq!(storages(&[pyramid], need).unwrap_err().exit_code(), 33);
    let refused = storages(&[pyramid, "volumes.fur.storage=sparse"], 1 << 32).unwrap_err().to_string();
    assert!(
        refused.contains("volumes.fur.storage = \"sparse\"") && refused.contains("volumes.fur.storage=dense")
    );
    // A volume that is too large by itself is named.
    let refused = storages(&["volumes.fur.nx=100000", "volumes.fur.storage=dense"], 1 << 28).unwrap_err();
    assert!(refused.to_string().contains("volumes.fur.nx"), "{refused}");
}
