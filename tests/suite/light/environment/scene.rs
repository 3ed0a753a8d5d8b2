//! Environments in scenes: both engines agree, all parts share one map, and invalid ones are refused.

use std::path::Path;
use std::sync::Arc;

use super::uneven;
use crate::cli::faults::{run, taki};
use crate::engine::gpu::{COARSE_PLACE, assert_parity, both, renderer, scene};
use glam::{DVec3, Vec3};
use taki::engine::{RenderOptions, cpu};
use taki::job::VolumeMemo;
use taki::light::Light;
use taki::light::environment::{Environment, Source, luminance};
use taki::scene::{Animation, Limits, Scene};
use taki::util::monitor::Unwatched;
use tempfile::{TempDir, tempdir};

/// Settings of a small picture of rock, water and open background.
const SMALL: [&str; 4] = ["image.width=80", "image.height=60", "image.samples=2", "environment.lights=5"];

fn hdr(folder: &Path, width: u32, height: u32, radiance: impl Fn(DVec3) -> DVec3) -> String {
    let map = super::map(width, height, radiance);
    let pixels: Vec<image::Rgb<f32>> = map.texels.iter().map(|&[r, g, b, _]| image::Rgb([r, g, b])).collect();
    let path = folder.join("map.hdr");
    let file = std::fs::File::create(&path).expect("a file");
    let encoder = image::codecs::hdr::HdrEncoder::new(file);
    encoder.encode(&pixels, width as usize, height as usize).expect("written");
    path.to_str().expect("UTF-8").to_owned()
}

fn lit(more: &[&str]) -> Scene {
    lit_within(more, &Limits::default())
}

fn lit_within(more: &[&str], limits: &Limits) -> Scene {
    let sets: Vec<String> = SMALL.iter().chain(&COARSE_PLACE).chain(more).map(|s| s.to_string()).collect();
    Scene::load(Path::new("waterfall"), &sets, limits).expect("a valid scene")
}

fn environment(scene: &Scene) -> &Environment {
    scene.environment.as_ref().expect("an environment")
}

#[test]
fn the_engines_agree_on_background_rock_and_water_under_an_environment() {
    let Some(mut renderer) = renderer("environment") else { return };
    let folder = tempdir().expect("a folder");
    let file = format!("environment.file={}", hdr(folder.path(), 96, 48, uneven));
    let one =
        format!("environment.file={}", hdr(tempdir().expect("a folder").keep().as_path(), 1, 1, uneven));
    let sky = "environment.kind=sky";
    let map = "environment.kind=file";
    let variants: [&[&str]; 9] = [
        &[sky],
        &[sky, "sky.elevation=2", "sky.azimuth=170", "camera.fov=100"],
        // The sun and the pole are in the picture.
        &[sky, "sky.elevation=80", "camera.target=[0,60,-10]", "camera.fov=60"],
        &[map, &file, "camera.fov=140"],
        // The map's edge is in the middle of the picture.
        &[map, &file, "camera.fov=140", "environment.turn=180"],
        &[map, &file, "environment.turn=77", "environment.intensity=3", "light.visibility=none"],
        &[map, &file, "environment.turn=-200", "camera.target=[0,1,60]", "environment.lights=37"],
        &[map, &one],
        &[sky, "light.visibility=cached"],
    ];
    for variant in variants {
        assert_parity(&variant.join(" "), &both(&mut renderer, &lit(variant)));
    }
}

#[test]
fn parity_can_fail_where_the_environment_is_turned_on_one_engine() {
    let Some(mut renderer) = renderer("environment") else { return };
    let folder = tempdir().expect("a folder");
    let file = format!("environment.file={}", hdr(folder.path(), 96, 48, uneven));
    let of = |turn: &str| lit(&["environment.kind=file", &file, turn, "camera.fov=140"]);
    let [a, _] = both(&mut renderer, &of("environment.turn=0"));
    let [_, b] = both(&mut renderer, &of("environment.turn=1"));
    assert!(std::panic::catch_unwind(|| assert_parity("turned", &[a, b])).is_err());
}

#[test]
fn without_an_environment_its_parameters_change_no_bit() {
    let volume = lit(&[]).volume(1 << 30, &Unwatched).expect("a volume");
    let radiance = |scene: &Scene| {
        cpu::render(scene, &volume, &scene.mesh(), false, &Unwatched).expect("a frame").radiance
    };
    let plain = radiance(&lit(&[]));
    let set =
        lit(&["environment.intensity=7", "environment.turn=9", "sky.elevation=1", "environment.lights=99"]);
    assert!(set.environment.is_none() && set.environment_lights.is_empty());
    assert!(radiance(&set) == plain);
}

#[test]
fn a_white_surface_under_even_light_is_as_bright_as_the_light_and_the_background_is_it() {
    let folder = tempdir().expect("a folder");
    let file = format!("environment.file={}", hdr(folder.path(), 8, 4, |_| DVec3::splat(0.5)));
    let mut sets = vec!["environment.kind=file", &file, "light.ambient=[0,0,0]", "lights.sun.intensity=0"];
    let white = [
        "rocks.wall.color=[1,1,1]",
        "rocks.wall.color_noise=0",
        "rocks.wall.cavity=0",
        "materials.water.thickness=0.5",
        "image.width=40",
        "image.height=64",
    ];
    sets.extend(white);
    let mut scene = scene("fig5", &sets);
    scene.edit().rocks.retain(|rock| rock.name == "wall");
    scene.edit().quads.clear();
    let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
    let frame = cpu::render(&scene, &volume, &scene.mesh(), true, &Unwatched).expect("a frame");
    let depth = &frame.surface.as_ref().expect("asked for").depth;
    assert!(depth.iter().any(|d| *d > 0.0 && d.is_finite()), "the rock is seen");
    for pixel in &frame.radiance {
        assert!(Vec3::from_slice(pixel).abs_diff_eq(Vec3::splat(0.5), 2e-6), "{pixel:?}");
    }
}

#[test]
fn the_volumes_lights_are_the_scenes_own_the_sun_and_those_of_the_map() {
    let of = |more: &[&str]| lit(&[&["environment.kind=sky", "environment.lights=24"], more].concat());
    let sky = of(&[]);
    let own = lit(&[]).lights.len();
    assert_eq!((sky.lights.len(), sky.environment_lights.len()), (own + 1, 24));
    assert_eq!(sky.volume_lights().len(), own + 25);
    // The map's lights do not contain the sun: they are the same in a sky without it.
    let shade = of(&["sky.sun=0", "sky.ground=[0,0,0]"]);
    assert_eq!(shade.lights.len(), own);
    assert_eq!(shade.environment_lights, of(&["sky.ground=[0,0,0]"]).environment_lights);
    // The sun stands where its angles place it, turns with the environment, and has its own angular size.
    let low = of(&["sky.elevation=30", "sky.azimuth=50", "environment.turn=40", "environment.intensity=0.5"]);
    let sun = environment(&low).sun.expect("a sun");
    assert!((sun.to_sun - Vec3::new(0.75f32.sqrt(), 0.5, 0.0)).length() < 1e-6, "{}", sun.to_sun);
    let brightest = |scene: &Scene, d: Vec3| environment(scene).radiance(d).x;
    let up = sun.to_sun.cross(Vec3::Z).normalize();
    let off = |degrees: f32| (sun.to_sun + up * degrees.to_radians().tan()).normalize();
    assert!(brightest(&low, off(0.26)) > 1e3 && brightest(&low, off(0.275)) < 10.0);
    // The lower half of a sun on the horizon is not seen.
    let setting = of(&["sky.elevation=0", "sky.azimuth=0", "sky.turbidity=1"]);
    let at = |degrees: f32| Vec3::new(0.0, degrees.to_radians().sin(), degrees.to_radians().cos());
    assert!(brightest(&setting, at(0.1)) > 1e2 && brightest(&setting, at(-0.1)) < 10.0);
    // The sun's radiance times its solid angle is its irradiance.
    let omega = 2.0 * std::f64::consts::PI * (1.0 - taki::light::environment::ANGULAR_RADIUS.cos());
    let ratio = f64::from(sun.radiance.x) * omega / (f64::from(sun.intensity.x) * std::f64::consts::PI);
    assert!((ratio - 1.0).abs() < 1e-5, "{ratio}");
    let Light::Directional { intensity, .. } = low.lights[own] else { panic!("a sun") };
    assert_eq!(intensity, sun.intensity);
}

#[test]
fn the_lights_come_from_where_the_background_is_bright_and_the_rock_is_lit_from_there() {
    let folder = tempdir().expect("a folder");
    // One bright spot, at u = 0.7, v = 0.3.
    let spot = taki::light::environment::direction_at(0.7, 0.3);
    let near = |d: DVec3| if d.dot(spot) > 0.999 { DVec3::splat(200.0) } else { DVec3::ZERO };
    let file = format!("environment.file={}", hdr(folder.path(), 200, 100, near));
    for turn in ["0", "100", "-77.5"] {
        let turn = format!("environment.turn={turn}");
        let scene = lit(&["environment.kind=file", &file, &turn, "environment.lights=1"]);
        let [light] = scene.environment_lights[..] else { panic!("one light") };
        let (to_light, intensity) = light.at(Vec3::ZERO);
        let environment = environment(&scene);
        // The radius of the spot is 2.6°.
        assert_eq!(environment.radiance(to_light), Vec3::splat(200.0), "{turn}");
        for d in super::directions(300).map(|d| d.as_vec3()).filter(|d| d.dot(to_light) < 0.99) {
            assert_eq!(environment.radiance(d), Vec3::ZERO, "{turn} {d}");
        }
        // Where the rock faces a spot, the three orders sum to ¼ + ½ + 5/16 of E/π. The orders that are left
        // out sum to −1/16.
        let facing = environment.irradiance.at(to_light);
        assert!((facing / intensity - Vec3::splat(1.0625)).abs().max_element() < 0.01, "{turn} {facing}");
    }
}

#[test]
fn a_map_of_one_texel_is_even_light_from_everywhere() {
    let folder = tempfile::tempdir().expect("a folder");
    for [width, height] in [[1, 1], [2, 1], [4, 2]] {
        let file = hdr(folder.path(), width, height, |_| DVec3::ONE);
        let limits = Limits { allow_paths: vec![folder.path().to_owned()], ..Limits::default() };
        let file = format!("environment.file={file}");
        let scene = lit_within(&["environment.kind=file", &file, "environment.lights=32"], &limits);
        let environment = environment(&scene);
        assert!(scene.environment_lights.len() > 4, "{width}×{height}: {}", scene.environment_lights.len());
        assert!(environment.error() < 0.1, "{width}×{height}: {}", environment.error());
        assert!(
            environment.irradiance_error() < 0.01,
            "{width}×{height}: {}",
            environment.irradiance_error()
        );
    }
}

#[test]
fn intensity_is_a_factor_on_everything() {
    let of = |more: &str| lit(&["environment.kind=sky", more]);
    let (one, three) = (of("environment.intensity=1"), of("environment.intensity=3"));
    let sum = |scene: &Scene| -> DVec3 {
        let power = |light: &Light| light.at(Vec3::ZERO).1.as_dvec3();
        scene.environment_lights.iter().map(power).sum()
    };
    assert!((sum(&three) / sum(&one) / 3.0 - DVec3::ONE).length() < 1e-6);
    // ∫ L dω of the map, which the zeroth order of its irradiance also gives.
    let mean = environment(&one).irradiance.0[0].as_dvec3() * 4.0;
    assert!((sum(&one) / mean - DVec3::ONE).length() < 1e-6);
    for d in super::directions(40) {
        let [a, b] = [&one, &three].map(|s| environment(s).radiance(d.as_vec3()));
        assert!((b - a * 3.0).length() <= 1e-5 * b.length(), "{d}");
        let [a, b] = [&one, &three].map(|s| environment(s).irradiance.at(d.as_vec3()));
        assert!((b - a * 3.0).length() <= 1e-5 * b.length(), "{d}");
    }
    let dark = of("environment.intensity=0");
    assert!(dark.environment_lights.is_empty() && environment(&dark).sun.is_none());
}

#[test]
fn the_map_is_made_once_for_all_scenes_and_frames_of_a_run() {
    let folder = tempdir().expect("a folder");
    let path = hdr(folder.path(), 32, 16, uneven);
    let sets =
        ["environment.kind=file".to_owned(), format!("environment.file={path}"), "animate.turn=10".into()];
    let animation = Animation::load(Path::new("waterfall"), &sets, &Limits::default()).expect("an animation");
    let maps: Vec<_> = (0..3).map(|f| environment(&animation.at(f).expect("a frame")).map.clone()).collect();
    assert!(Arc::ptr_eq(&maps[0], &maps[1]) && Arc::ptr_eq(&maps[1], &maps[2]));
    // Another file of the same name is another map.
    hdr(folder.path(), 16, 8, uneven);
    let anew = animation.at(3).expect("a frame");
    assert_eq!((environment(&anew).map.width, environment(&anew).map.height), (16, 8));
    let sky = ["environment.kind=sky".to_owned()];
    let limits = Limits::default();
    let of = |more: &str| {
        let sets = [&sky[..], &[more.to_owned()]].concat();
        Scene::load(Path::new("front"), &sets, &limits).expect("a scene")
    };
    let (a, b) = (of("sky.azimuth=10"), of("environment.intensity=2"));
    assert!(Arc::ptr_eq(&environment(&a).map, &environment(&b).map), "neither changes the sky");
    assert!(!Arc::ptr_eq(&environment(&a).map, &environment(&of("sky.elevation=3")).map));
}

#[test]
fn kept_results_of_the_raster_pass_know_the_environment() {
    let Some(mut keeping) = renderer("rasters") else { return };
    let folder = tempdir().expect("a folder");
    let other = tempdir().expect("a folder");
    let [a, b] =
        [&folder, &other].map(|f: &TempDir| format!("environment.file={}", hdr(f.path(), 32, 16, uneven)));
    hdr(other.path(), 32, 16, |d| DVec3::splat(0.5 + 0.5 * d.y));
    let changes: [&[&str]; 8] = [
        &["environment.kind=none"],
        &["environment.kind=sky"],
        &["environment.kind=sky", "sky.elevation=20"],
        &["environment.kind=sky", "environment.turn=20"],
        &["environment.kind=sky", "environment.intensity=2"],
        &["environment.kind=sky", "sky.sun=2", "sky.ground=[0,0,0]"],
        &["environment.kind=file", &a],
        &["environment.kind=file", &b],
    ];
    let options = RenderOptions { keep_rasters: 64 << 20, ..Default::default() };
    let mut fresh = renderer("rasters").expect("an adapter");
    let mut volumes = VolumeMemo::default();
    let mesh = lit(&[]).mesh();
    let (mut spared, limits) = (0, Limits::default());
    for change in changes.iter().flat_map(|c| [c, c, c]) {
        let sets = [change, &["light.visibility=none", "image.samples=1"][..]].concat();
        let scene = lit_within(&sets, &limits);
        let (volumes, _) = volumes.volumes(&scene, 1 << 30, &Unwatched).expect("a volume");
        let kept = keeping.render(&scene, &*volumes, &mesh, &options, &Unwatched).expect("a frame");
        let drawn = fresh.render(&scene, &*volumes, &mesh, &RenderOptions::default(), &Unwatched);
        assert!(kept.radiance == drawn.expect("a frame").radiance, "{change:?}");
        spared += u32::from(kept.seconds.gbuffer == 0.0);
    }
    assert_eq!(spared, 8, "each third frame finds what the second has kept");
}

#[test]
fn json_holds_what_another_program_needs_to_light_the_scene() {
    let arguments = ["scene", "front", "--json", "--set=environment.kind=sky", "--set=environment.lights=7"];
    let json: serde_json::Value = serde_json::from_str(run(&mut taki(arguments)).done()).expect("JSON");
    let derived = &json["derived"]["environment"];
    assert_eq!(derived["lights"].as_array().map(Vec::len), Some(7));
    assert_eq!(derived["irradiance"].as_array().map(Vec::len), Some(9));
    let number = |key: &str| derived[key].as_f64().expect("a number");
    assert!((0.0..0.2).contains(&number("lights_error")) && (0.0..0.1).contains(&number("irradiance_error")));
    assert_eq!(derived["map"]["width"], 1024);
    assert!(derived["sun"]["angular_radius"].as_f64().is_some_and(|r| (0.0046..0.0047).contains(&r)));
    let lights = json["derived"]["lights"].as_array().expect("lights");
    assert_eq!(lights.last().expect("the sun")["to_light"], derived["sun"]["to_sun"]);
    let none: serde_json::Value =
        serde_json::from_str(run(&mut taki(["scene", "front", "--json"])).done()).expect("JSON");
    assert!(none["derived"]["environment"].is_null());
}

#[test]
fn a_render_says_in_one_line_how_far_its_lights_are_off() {
    let folder = tempdir().expect("a folder");
    let out = folder.path().join("x.png");
    let mut command =
        taki(["render", "front", "--engine=cpu", "--size=16x16", "--set=environment.kind=sky", "-o"]);
    let run = run(command.arg(&out));
    run.done();
    let lines = run.lines("taki: environment sky of 1024×512: 24 lights");
    assert!(lines.len() == 1 && lines[0].contains("irradiance error"), "{}", run.stderr());
}

#[test]
fn bad_environments_are_refused_by_their_key_and_file() {
    let folder = tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    let out = at("x.png");
    hdr(folder.path(), 4, 2, uneven);
    std::fs::write(at("short.hdr"), "#?RADIANCE\n\n-Y 4 +X 8\n").expect("written");
    std::fs::write(at("text.txt"), "a").expect("written");
    std::fs::write(at("zero.hdr"), "#?RADIANCE\n\n-Y 0 +X 8\n").expect("written");
    std::fs::write(at("huge.hdr"), "#?RADIANCE\n\n-Y 1000000 +X 1000000\n").expect("written");
    std::fs::create_dir(at("folder.hdr")).expect("made");
    assert!(std::process::Command::new("mkfifo").arg(at("fifo.hdr")).status().expect("run").success());
    let refused = |code: i32, sets: &[String], words: &[&str]| {
        let mut command = taki(["render", "front", "--engine=cpu", "--size=16x16", "-o"]);
        command.arg(&out).args(sets.iter().map(|s| format!("--set={s}")));
        run(&mut command).refused(code, words);
        assert!(!out.exists());
    };
    let file =
        |name: &str| ["environment.kind=file".to_owned(), format!("environment.file={}", at(name).display())];
    for (name, words) in [
        ("missing.hdr", "missing.hdr"),
        ("short.hdr", "short.hdr"),
        ("text.txt", "neither .hdr nor .exr"),
        ("zero.hdr", "8×0 texels"),
        ("folder.hdr", "not a regular file"),
        ("fifo.hdr", "not a regular file"),
    ] {
        refused(65, &file(name), &[words, "environment map", name]);
    }
    refused(33, &file("huge.hdr"), &["1000000×1000000", "the budget is 4.0 GiB", "--memory"]);
    refused(65, &["environment.kind=file".into()], &["environment.kind", "without a file"]);
    for (set, range) in [
        ("environment.kind=cloud", "none, sky, file"),
        ("environment.intensity=-1", "0 to 10000"),
        ("environment.intensity=nan", "0 to 10000"),
        ("environment.turn=40000", "-36000 to 36000"),
        ("environment.lights=0", "1 to 1024"),
        ("environment.lights=1025", "1 to 1024"),
        ("sky.elevation=91", "0 to 90"),
        ("sky.elevation=-1", "0 to 90"),
        ("sky.azimuth=inf", "-360 to 360"),
        ("sky.turbidity=0.5", "1 to 10"),
        ("sky.ground=[1,2]", "three numbers"),
        ("sky.sun=-2", "0 to 10000"),
    ] {
        let key = set.split('=').next().expect("a key");
        refused(65, &[set.to_owned()], &[key, "allowed: ", range]);
    }
    let bright = ["environment.kind=sky".to_owned(), "sky.ground=[1.5,0,0]".into()];
    refused(65, &bright, &["sky.ground", "at most 1"]);
    let all = [&file("map.hdr")[..], &["environment.intensity=10000".to_owned()]].concat();
    let mut command = taki(["render", "front", "--engine=cpu", "--size=16x16", "-o"]);
    run(command.arg(&out).args(all.iter().map(|s| format!("--set={s}")))).done();
}

/// Makes a folder with a scene file, beside a map and a volume.
fn scene_folder(map: &str) -> (TempDir, std::path::PathBuf) {
    let dir = tempdir().expect("a folder");
    let folder = dir.path().join("scene");
    std::fs::create_dir(&folder).expect("made");
    hdr(&folder, 8, 4, uneven);
    let text = format!(
        "version = 1\nbase = \"front\"\n[environment]\nkind = \"file\"\nfile = {map:?}\n\
         [image]\nwidth = 16\nheight = 16\n"
    );
    std::fs::write(folder.join("s.toml"), text).expect("written");
    (dir, folder)
}

#[test]
fn maps_stay_in_the_scenes_folder_unless_allowed() {
    let (_dir, folder) = scene_folder("map.hdr");
    let load =
        |folder: &Path, sets: &[String], limits: &Limits| Scene::load(&folder.join("s.toml"), sets, limits);
    assert!(load(&folder, &[], &Limits::default()).is_ok());
    let (dir, folder) = scene_folder("../map.hdr");
    hdr(dir.path(), 8, 4, uneven);
    let error = load(&folder, &[], &Limits::default()).expect_err("outside").to_string();
    assert!(error.contains("environment.file") && error.contains("--allow-path"), "{error}");
    let allowed = Limits { allow_paths: vec![dir.path().to_owned()], ..Limits::default() };
    assert!(load(&folder, &[], &allowed).is_ok());
    // A map given on the command line may lie anywhere. Files that the scene itself names are still confined.
    let by_hand = |path: &Path| vec![format!("environment.file={}", path.display())];
    assert!(load(&folder, &by_hand(&dir.path().join("map.hdr")), &Limits::default()).is_ok());
    let volume = [format!("volume.file={}", dir.path().join("map.hdr").display())];
    let error = load(&folder, &volume, &Limits::default()).expect_err("outside").to_string();
    assert!(error.contains("environment.file"), "{error}");
    // The scene's map is found from any folder, even if another file is given on the command line.
    let (_map, folder) = scene_folder("map.hdr");
    assert!(load(&folder, &volume, &Limits::default()).is_ok());
}

#[test]
fn a_picture_tells_its_map_by_its_contents_and_not_by_its_path() {
    let (dir, folder) = scene_folder("map.hdr");
    let out = |name: &str| dir.path().join(name);
    let batch = |name: &str| {
        let mut command = taki(["batch"]);
        let pattern = out(name).join("f.##.png");
        std::fs::create_dir_all(out(name)).expect("made");
        run(command.arg(folder.join("s.toml")).args(["--engine=cpu", "--frames=0-1", "-o"]).arg(pattern))
    };
    batch("a").done();
    let text = std::fs::read(out("a").join("f.00.png")).expect("a picture");
    let text = String::from_utf8_lossy(&text);
    assert!(text.contains("# environment map: crc32") && !text.contains("map.hdr"), "{text}");
    // Complete pictures are kept. With another map of the same name they belong to another scene.
    assert!(batch("a").done().is_empty());
    hdr(&folder, 8, 4, |_| DVec3::ONE);
    batch("a").refused(73, &["environment map"]);
}

#[test]
fn what_is_odd_about_a_map_is_told() {
    let folder = tempdir().expect("a folder");
    let path = hdr(folder.path(), 9, 9, uneven);
    let scene = lit(&["environment.kind=file", &format!("environment.file={path}")]);
    let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
    let warnings = scene.warnings(&volume);
    assert!(warnings.iter().any(|w| w.contains("9×9") && w.contains("twice as wide")), "{warnings:?}");
    assert!(matches!(environment(&scene).source, Source::File(_)));
    // A scene that only its environment lights does not count as unlit.
    let sets = ["environment.kind=sky", "light.ambient=[0,0,0]", "lights.sun.intensity=0", "sky.sun=0"];
    assert!(lit(&sets).warnings(&volume).is_empty());
    let e = environment(&lit(&sets)).irradiance.at(Vec3::Y);
    assert!(luminance(e.as_dvec3()) > 0.1);
}
