//! Slips in `--set` or a scene file are understood, or answered with the right way to write the value.

use std::collections::BTreeSet;
use std::fs;

use crate::cli::faults::{Run, run, taki};
use taki::engine::{Engine, RenderOptions};
use taki::scene::{Kind, Limits, Param, Scene, without_effect};
use tempfile::tempdir;

/// `taki scene` of a scene with settings.
fn scene(name: &str, sets: &[&str]) -> Run {
    run(taki(["scene", name]).args(sets.iter().flat_map(|set| ["--set", set])))
}

/// The error line of a scene file with this text.
fn fault(text: &str) -> Run {
    let dir = tempdir().unwrap();
    let file = dir.path().join("s.toml");
    fs::write(&file, text).unwrap();
    run(taki(["scene"]).arg(&file))
}

#[test]
fn the_last_part_of_a_key_is_enough_for_set() {
    for (short, full) in [
        ("sigma=7.5", "trace.sigma=7.5"),
        // A scene has these once, and other things have keys of the same last part.
        ("h=1.2", "curves.h=1.2"),
        ("seed=9", "volume.seed=9"),
        // The scene has one light.
        ("softness=0.5", "lights.sun.softness=0.5"),
        ("fps=12", "animate.fps=12"),
        ("eyes=[[0, 1, 9], [4, 2, 7]]", "animate.path.eyes=[[0, 1, 9], [4, 2, 7]]"),
        // The end of a key is enough too.
        ("sun.softness=0.5", "lights.sun.softness=0.5"),
        ("wall.show=hidden", "rocks.wall.show=hidden"),
    ] {
        assert_eq!(scene("fig5", &[short]).done(), scene("fig5", &[full]).done(), "{short}");
    }
    assert_ne!(scene("fig5", &["h=1.2"]).done(), scene("fig5", &[]).done());
    // The message names the key in full.
    scene("fig5", &["h=9"]).refused(65, &["--set: curves.h = 9", "allowed: 0 to 8"]);
}

#[test]
fn a_last_part_of_several_keys_is_refused_with_the_candidates() {
    let two_walls = ["rocks.foot.wet", "rocks.wall.wet", "write one of them in full"];
    scene("fig5", &["wet=1"]).refused(2, &two_walls);
    scene("fig5", &["file=v.npz"]).refused(2, &["file can mean volume.file, environment.file"]);
    // Twenty rocks are not listed one by one.
    let rock = |i: usize| format!("[rocks.r{i}]\ncorners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]\n");
    let dir = tempdir().unwrap();
    let file = dir.path().join("s.toml");
    fs::write(&file, "version = 1\n".to_owned() + &(0..20).map(rock).collect::<String>()).unwrap();
    run(taki(["scene"]).arg(&file).args(["--set", "wet=1"])).refused(2, &["rocks.r0.wet", "and 12 more"]);
}

#[test]
fn suggestions_are_keys_of_the_scene() {
    for (wrong, right) in [
        ("sgima=1", "did you mean trace.sigma?"),
        // No light is named NAME, or after the key's own parts.
        ("softnes=1", "did you mean lights.sun.softness?"),
        ("lights.intensity=1", "did you mean lights.sun.intensity?"),
        ("light.sun.color=1", "did you mean lights.sun.color?"),
        ("animate.pth.eyes=1", "did you mean animate.path.eyes?"),
        ("xyzzy=1", "docs/parameters.md lists every key"),
    ] {
        scene("fig5", &[wrong]).refused(65, &["unknown key", right]);
    }
    // A scene file may name a light as it likes.
    fault("version = 1\n[lights.moon]\ncolour = 1\n").refused(65, &["did you mean lights.moon.color?"]);
    fault("version = 1\n[[quads]]\ncorner = 1\n").refused(65, &["did you mean quads.0.corners?"]);
}

/// The scene that is printed has this line.
fn has(run: &Run, line: &str) {
    assert!(run.done().lines().any(|l| l == line), "no {line:?} in {}", run.done());
}

#[test]
fn points_and_colours_of_set_need_no_brackets() {
    for form in ["0,0,5", "[0,0,5]", "0, 0, 5", "0.0,0e3,5.0"] {
        has(&scene("fig5", &[&format!("camera.eye={form}")]), "eye = [0, 0, 5]");
    }
    has(&scene("fig5", &["eye=-1,0.5,9"]), "eye = [-1, 0.5, 9]");
    has(&scene("fig5", &["lights.sun.color=1,0.5,0"]), "color = [1, 0.5, 0]");
    for form in ["0,5", "0,0,5,1", "0;0;5", "1,nan,0", "a,b,c"] {
        scene("fig5", &[&format!("camera.eye={form}")])
            .refused(65, &["camera.eye", "allowed: three numbers"]);
    }
}

#[test]
fn hexadecimal_colours_are_decoded_from_srgb() {
    // Values of IEC 61966-2-1: 0x80 is 0.2158605, 0x0a lies on the straight part.
    for (hex, linear) in [
        ("#ffffff", "color = [1, 1, 1]"),
        ("#000000", "color = [0, 0, 0]"),
        ("#80FF00", "color = [0.2158605, 1, 0]"),
        ("#0a0a0b", "color = [0.00303527, 0.00303527, 0.0033465358]"),
    ] {
        has(&scene("fig5", &[&format!("lights.sun.color={hex}")]), linear);
        let dir = tempdir().unwrap();
        let file = dir.path().join("s.toml");
        fs::write(&file, format!("version = 1\n[lights.a]\ncolor = \"{hex}\"\n")).unwrap();
        has(&run(taki(["scene"]).arg(&file)), linear);
    }
    for wrong in ["#fff", "#ffffffff", "#ggffff", "ffffff", "#+fffff", "red", "#"] {
        let allowed = "allowed: three numbers, 0 to 10000 or \"#rrggbb\"";
        scene("fig5", &[&format!("lights.sun.color={wrong}")]).refused(65, &["lights.sun.color", allowed]);
    }
    // A point is no colour.
    scene("fig5", &["eye=#ffffff"]).refused(65, &["camera.eye", "allowed: three numbers, ±1e7"]);
}

#[test]
fn a_slip_in_a_value_is_named_with_the_right_way_to_write_it() {
    for (set, advice) in [
        ("h=", "write a value behind the =;"),
        ("h=0,5", "use a decimal point: 0.5; allowed: 0 to 8"),
        ("fov=90deg", "no unit: 90 (in degrees)"),
        ("fov=90 °", "no unit: 90 (in degrees)"),
        ("camera.near=0,5m", "no unit: 0.5 (in metres)"),
        ("camera.near=10cm", "no unit: the number is in metres"),
        ("curves.h=5m", "no unit: 5;"),
        ("width=640px", "no unit: 640 (in pixels)"),
        ("width=640.5", "write a whole number"),
        ("width=640,5", "write a whole number"),
        ("h='1.2'", "write the number without quotes: 1.2"),
        ("camera.eye=0 0 5", "write the list in brackets: [0, 0, 5]"),
        ("camera.eye=(0; 0; 5)", "write the list in brackets: [0, 0, 5]"),
        ("lights.sun.color=ffffff", "write \"#ffffff\""),
        ("lights.sun.color=#fff", "give six hexadecimal digits"),
        ("light.visibility=Cache", "did you mean cached?"),
    ] {
        scene("fig5", &[set]).refused(65, &[" = ", advice, "allowed: "]);
    }
    for (set, understood) in [("h=.5", "h = 0.5"), ("h=+1.", "h = 1.0"), ("fov=045", "fov = 45.0")] {
        has(&scene("fig5", &[set]), understood);
    }
    // What is no known slip gets no advice.
    for set in ["h=x", "h=1/2", "h=inf", "camera.eye=1 2", "light.visibility=xyz"] {
        let refused = scene("fig5", &[set]);
        refused.refused(65, &["; allowed: "]);
        assert_eq!(refused.stderr().matches("; ").count(), 1, "{refused:?}");
    }
}

#[test]
fn a_slip_in_a_scene_file_is_named_with_its_line() {
    let wall = "[rocks.wall]\ncorners = [\n    [0, 0, 0], [1, 0, 0],\n    [1, 1, 0], [0, 1, 0],\n]\n";
    for (section, line, advice) in [
        ("[curves]", "h = 0,5", "curves.h = 0,5; use a decimal point: 0.5; allowed: 0 to 8"),
        ("[curves]", "h = 0,5  # a comment", "curves.h = 0,5; use a decimal point: 0.5"),
        ("[curves]", "h = .5", "curves.h = .5; write 0.5"),
        ("[curves]", "h = \"1.2\"", "write the number without quotes: 1.2"),
        ("[camera]", "fov = 90deg", "camera.fov = 90deg; no unit: 90 (in degrees)"),
        ("[camera] # the eye", "near = 5 m", "camera.near = 5 m; no unit: 5 (in metres)"),
        ("[camera]", "eye = 0, 0, 5", "camera.eye = 0, 0, 5; write the list in brackets: [0, 0, 5]"),
        ("[camera]", "eye = (0, 0, 5)", "write the list in brackets: [0, 0, 5]"),
        (
            "[lights.sun]",
            "color = #ff8000",
            "lights.sun.color = #ff8000; write the colour in quotes: \"#ff8000\"",
        ),
        ("[lights.sun]", "kind = point", "lights.sun.kind = point; write the word in quotes: \"point\""),
        ("[volume]", "file = v.npz", "volume.file = v.npz; write the text in quotes: \"v.npz\""),
        (
            "[sheets.fall]",
            "widths = 1, 2.5",
            "sheets.fall.widths = 1, 2.5; write the list in brackets: [1, 2.5]",
        ),
        ("[[quads]]", "material = water", "quads.0.material = water; write the text in quotes"),
        ("[[quads]]", "\n[[quads]]\nmaterial = water", "quads.1.material = water; write the text in quotes"),
    ] {
        let text = format!("version = 1\n{wall}{section}\n{line}\n");
        let place = format!("s.toml:{}: ", 8 + line.matches('\n').count());
        fault(&text).refused(65, &[&place, advice]);
    }
    // A fault that is no slip of a value keeps the parser's words.
    for (text, words) in
        [("h = [1", "a scene file is TOML"), ("h", "a scene file is TOML"), ("x = 0,5", "TOML")]
    {
        fault(&format!("version = 1\n[curves]\n{text}\n")).refused(65, &["s.toml:", words]);
    }
}

#[test]
fn what_stands_in_the_wrong_place_is_told_where_it_belongs() {
    let scene = |text: &str| fault(&format!("version = 1\nbase = \"front\"\n{text}\n"));
    for (text, words) in [
        ("[curves]\nbase = \"fig5\"", &["s.toml:4", "curves.base", "base = … above the first table"][..]),
        ("[curves]\nversion = 1", &["version = … above the first table"]),
        ("lights = 5", &["unknown key lights;", "[lights.NAME]"]),
        ("[[rocks]]\ncorners = 1", &["unknown key rocks;", "[rocks.NAME]"]),
        ("[animate]\ntracks = 3", &["unknown key animate.tracks;", "[[animate.tracks]]"]),
        ("animate = 3", &["it is a table, with the keys animate.frames, animate.fps"]),
        ("[animate]\npath = 3", &["it is a table, with the keys animate.path.frames"]),
        ("[lights.\"a.b\"]\nkind = \"point\"", &["the name \"a.b\" has a dot"]),
        ("[lights.\"\"]\nkind = \"point\"", &["give it a name: [lights.NAME]"]),
        ("[CURVES]\nH = 1", &["did you mean curves.h?"]),
        ("[curves]\nh =", &["s.toml:4: curves.h", "write a value behind the =; allowed: 0 to 8"]),
        ("[curves]\nh = # none", &["write a value behind the ="]),
        ("[volume]\nnx = 1e3", &["write a whole number: 1000;"]),
    ] {
        scene(text).refused(65, words);
    }
    for (base, words) in [
        ("\"fronnt\"", "did you mean front?"),
        ("\"Fig5\"", "did you mean fig5?"),
        ("\"front.toml\"", "a base is no file; presets: waterfall"),
        ("5", "presets: waterfall"),
    ] {
        fault(&format!("version = 1\nbase = {base}\n")).refused(65, &["s.toml:2: base is no preset", words]);
    }
    for (setting, words) in [
        ("=1", "write the key before the ="),
        ("base=fig5", "name the preset in place of the scene"),
        ("version=2", "a scene file alone has a version"),
        ("curves=1", "it is a table, with the keys curves.across"),
        ("CURVES.H=1", "did you mean curves.h?"),
        ("curves.h=", "write a value behind the ="),
    ] {
        self::scene("front", &[setting]).refused(65, &["--set", words]);
    }
}

#[test]
fn settings_without_effect_are_told() {
    let said = |arguments: &[&str]| {
        let run = run(&mut taki(arguments));
        run.done();
        run.lines("taki: warning:").into_iter().map(str::to_owned).collect::<Vec<_>>()
    };
    for (setting, words) in [
        ("sky.elevation=5", "while environment.kind is \"none\": it needs sky"),
        ("turn=3", "environment.turn has no effect while environment.kind is \"none\""),
        ("strand.g=0.5", "light.reflection"),
        ("hair.tilt=1", "light.reflection"),
        ("tau=3", "trace.tau has no effect while trace.attenuation is \"path-length\": it needs per-cell"),
        ("lights.key.position=[0,0,1]", "lights.key.kind is \"directional\": it needs point or spot"),
        ("haze.color=1,0,0", "haze.density is 0.0: it needs a number above 0"),
        ("curves.loose=0.5", "curves.bundles is 0"),
        ("bloom_radius=0.1", "image.bloom"),
    ] {
        let warnings = said(&["scene", "front", "--set", setting]);
        assert!(warnings.len() == 1 && warnings[0].contains(words), "{setting}: {warnings:?}");
    }
    let none: &[&str] = &[];
    assert_eq!(said(&["scene", "front", "--set=sky.elevation=5", "--set=environment.kind=sky"]), none);
    assert_eq!(said(&["scene", "front", "--set=h=1", "--set=sigma=3"]), none);
    let sky = "environment.kind=sky";
    let under_a_sky = said(&["scene", "front", "--set", sky, "--set=zenith=1,0,0"]);
    assert!(under_a_sky[0].contains("background.zenith has no effect while environment.kind is"));
    let single = said(&["scene", "front", "--set=image.samples=1", "--set=image.filter=gaussian"]);
    assert!(single[0].contains("image.filter has no effect while image.samples is 1: it needs 2 or more"));
    // What is printed has every parameter, and is no reason for a warning.
    let dir = tempdir().unwrap();
    let file = dir.path().join("s.toml");
    fs::write(&file, run(&mut taki(["scene", "front"])).done()).unwrap();
    let scene = file.to_str().unwrap();
    assert_eq!(said(&["scene", scene]), none);
    // The pictures of such a sweep would be equal, unless the switch is swept too.
    let sweep = |more: &[&str]| {
        let out = dir.path().join("{elevation}{kind}.png");
        let start = ["batch", "front", "--size=8x8", "--dry-run", "--sweep=sky.elevation=5,10", "-o"];
        said(&[&start[..], &[out.to_str().unwrap()], more].concat())
    };
    let out = dir.path().join("{elevation}.png");
    let plain = ["batch", "front", "--dry-run", "--sweep=sky.elevation=5,10", "-o", out.to_str().unwrap()];
    assert_eq!(said(&plain).len(), 1);
    assert_eq!(sweep(&["--sweep=environment.kind=sky,none"]), none);
}

#[test]
fn a_setting_that_is_told_to_have_no_effect_has_none() {
    let dir = tempdir().unwrap();
    let file = dir.path().join("s.toml");
    let kinds = ["directional", "point", "spot"];
    let lights = kinds.map(|kind| format!("[lights.{kind}]\nkind = \"{kind}\"\nposition = [0, 1, 3]\n"));
    fs::write(&file, format!("version = 1\nbase = \"front\"\n{}", lights.concat())).unwrap();
    let switches: [&[&str]; 3] = [
        &[],
        &["environment.kind=sky", "light.reflection=strand", "attenuation=per-cell", "haze.density=0.1"],
        &["light.visibility=cached", "image.bloom=0.1", "curves.bundles=3"],
    ];
    let mut silent = BTreeSet::new();
    for switches in switches {
        let load = |more: &str| {
            let size = ["image.width=8", "image.height=8", "image.samples=1"];
            let sets: Vec<String> =
                switches.iter().chain(&size).chain([&more]).map(ToString::to_string).collect();
            Scene::load(&file, &sets, &Limits::default()).expect("a scene")
        };
        let picture = |scene: &Scene| {
            let frame = Engine::cpu().render(scene, &RenderOptions::default()).expect("a frame");
            (frame.radiance, frame.picture)
        };
        let base = load("curves.h=0.9");
        let expected = picture(&base);
        assert!(picture(&load("volume.seed=77")) != expected, "pictures tell nothing");
        for key in base.keys() {
            if let Some(why) = without_effect(base.values().unwrap(), &key)
                && let Some(other) = another(&key)
            {
                assert!(picture(&load(&format!("{key}={other}"))) == expected, "{why}, but it shows");
                silent.insert(key);
            }
        }
    }
    assert!(silent.len() > 25, "{silent:?}");
}

#[test]
fn a_key_in_the_wrong_table_is_told_its_own() {
    let front = |text: &str| fault(&format!("version = 1\nbase = \"front\"\n{text}\n"));
    for (text, words) in [
        ("[image]\nfov = 40", "did you mean camera.fov?"),
        ("[camera]\nelevation = 5", "did you mean sky.elevation?"),
        ("[camera]\nexposure = 1", "did you mean image.exposure?"),
        ("[render]\nalpha = true", "did you mean image.alpha?"),
        ("[render]\nalpha = 0.5", "did you mean volume.alpha?"),
        ("h = 1.2", "did you mean curves.h?"),
        ("[image]\nsize = [640, 360]", "write image.width and image.height"),
        ("[image]\nbackground = [1, 0, 0]", "[background] is a table of its own, with the keys background."),
        ("[camera]\nrocks = 1", "[rocks.NAME]"),
        ("[sheets]\npoints = [[0, 0, 0], [0, 1, 0]]", "each of them has a table of its own: [sheets.NAME]"),
        ("[sheets.fall]\nrepeat_v = 2", "did you mean materials.water.repeat_v?"),
        ("[materials.jet]\n[sheets.fall]\nrepeat_v = 2", "did you mean materials.NAME.repeat_v?"),
        ("[rocks.wall]\nholdout = true", "write show = \"holdout\""),
        ("[environment]\nsky = true", "write kind = \"sky\""),
        ("[animate.tracks]\nkey = \"curves.h\"", "each of them has a table of its own: [[animate.tracks]]"),
        ("[[sheets.fall]]\nsegments = 3", "write [sheets.fall] in single brackets"),
        ("[[camera]]\nfov = 40", "write [camera] in single brackets"),
        // The table has the name of one part of the scene.
        ("[key]\nintensity = 2", "did you mean lights.key.intensity?"),
        ("[key]\nColour = [1, 1, 1]", "did you mean lights.key.color?"),
        ("[key]\nintensty = 2", "did you mean lights.key.intensity?"),
        // Its own table has nearly this key, or one that other programs call so.
        ("[sheets.fall]\nwidth = 3", "did you mean sheets.fall.widths?"),
        ("[camera]\nposition = [0, 0, 9]", "did you mean camera.eye?"),
        ("[camera]\nlook_at = [0, 0, 9]", "did you mean camera.target?"),
        ("[lights.key]\nstrength = 9", "did you mean lights.key.intensity?"),
        ("[environment]\nmap = \"sky.hdr\"", "did you mean environment.file?"),
        ("[materials.water]\ndepth = 1", "did you mean materials.water.thickness?"),
        ("[volume]\ndensity = 1", "did you mean volume.alpha?"),
        ("[volume]\nrandom = 1", "did you mean volume.seed?"),
    ] {
        front(text).refused(65, &["s.toml:", "unknown key", words]);
    }
    for (setting, words) in [
        ("image.fov=40", "did you mean camera.fov?"),
        ("camera.elevation=5", "did you mean sky.elevation?"),
        // A table that is misspelt goes before one with another name.
        ("light.sun.color=1", "did you mean lights.sun.color?"),
        ("lght.ambient=1", "did you mean light.ambient?"),
        ("sun.strength=1", "did you mean lights.sun.intensity?"),
        ("sun.elevation=8", "did you mean sky.elevation?"),
        // A switch comes last, as for `alpha` alone.
        ("aplha=0.4", "did you mean volume.alpha?"),
    ] {
        scene("fig5", &[setting]).refused(65, &["--set", "unknown key", words]);
    }
}

#[test]
fn a_misspelt_name_is_told_with_its_line() {
    for (text, words) in [
        (
            "base = \"waterfall\"\n[rocks.wal]\nlevels = 3",
            &["s.toml:3: rocks.wal has no corners", "did you mean [rocks.wall]?"][..],
        ),
        ("base = \"waterfall\"\n[rocks.wal]", &["s.toml:3: rocks.wal has no", "did you mean [rocks.wall]?"]),
        ("[rocks.a]\nlevels = 3", &["s.toml:2: rocks.a has no corners", "give rocks.a.corners four points"]),
        ("[pools.a]\nfoam = 0.5", &["s.toml:2: pools.a has no corners", "give pools.a.corners four points"]),
        (
            "base = \"waterfall\"\n[sheets.threa]\nsegments = 3",
            &["s.toml:3: sheets.threa has no points", "did you mean [sheets.thread]?"],
        ),
        (
            "[materials.water]\n[sheets.a]\npoints = [[0, 1, 0], [0, 0, 0]]\nmaterial = \"wter\"",
            &[
                "s.toml:5: sheets.a.material = \"wter\": the scene has no such material",
                "did you mean water?",
            ],
        ),
        (
            "[[quads]]\ncorners = [[0, 1, 0], [1, 1, 0], [1, 0, 0], [0, 0, 0]]\nmaterial = \"mud\"",
            &["s.toml:4: quads.0.material = \"mud\"", "add [materials.mud], or use one of these: water"],
        ),
    ] {
        fault(&format!("version = 1\n{text}\n")).refused(65, words);
    }
    let names = |run: &Run| run.stderr().matches("water").count();
    let set = scene("fig5", &["quads.0.material=wxyz"]);
    set.refused(65, &["add [materials.wxyz], or use one of these: water"]);
    assert_eq!(names(&set), 1, "{set:?}");
}

#[test]
fn a_slip_in_a_list_of_points_is_named() {
    let sheet = |points: &str| fault(&format!("version = 1\n[sheets.a]\npoints = {points}\n"));
    let comma = "write decimals with a point: 6.3, not 6,3";
    for (points, words) in [
        ("[[0, 6,3, -3,4], [0, 0, 0]]", comma),
        ("[[0, 1, 0], [0, 2]]", "[0, 2] has 2 numbers, and a point has 3: x, y and z"),
    ] {
        sheet(points).refused(65, &["s.toml:3: sheets.a.points", words, "allowed: "]);
    }
    for (line, words) in [
        ("[camera]\neye = [0, 6,3, -3,4]", comma),
        ("[camera]\neye = [0, 6]", "[0, 6] has 2 numbers, and a point has 3: x, y and z"),
        ("[lights.a]\ncolor = [1, 0]", "[1, 0] has 2 numbers, and a colour has 3: red, green and blue"),
        ("[rocks.a]\ncorners = [[0, 0, 0], [1, 0], [1, 1, 0], [0, 1, 0]]", "[1, 0] has 2 numbers"),
        ("[rocks.a]\ncorners = [[0, 0, 0], [1, 0, 0], [1, 1, 0]]", "3 points: give four"),
    ] {
        fault(&format!("version = 1\n{line}\n")).refused(65, &["s.toml:3: ", words, "allowed: "]);
    }
    scene("fig5", &["eye=0,6,3,-3,4"]).refused(65, &["camera.eye", comma]);
}

#[test]
fn signs_of_other_programs_are_named() {
    for (line, words) in [
        ("h = 1 // as before", "a comment begins with #, not with //"),
        ("// the water", "a comment begins with #, not with //"),
        ("h = \u{2212}1", "write a plain - in place of \u{2212}"),
        ("base = \u{201c}front\u{201d}", "write plain quotes, \""),
        ("h = \u{2018}1\u{2019}", "write plain quotes, \""),
    ] {
        fault(&format!("version = 1\n[curves]\n{line}\n")).refused(65, &["s.toml:3: ", words]);
    }
    let list = "version = 1\n[sheets.a]\npoints = [\n  [0, 1, 0], // top\n  [0, 0, 0],\n]\n";
    fault(list).refused(65, &["s.toml:4: ", "a comment begins with #, not with //"]);
    scene("fig5", &["camera.near=\u{2212}1"]).refused(65, &["write a plain - in place of \u{2212}"]);
    scene("fig5", &["eye=0,\u{2212}1,5"]).refused(65, &["write a plain - in place of \u{2212}"]);
    // A string may hold any of them.
    let odd = fault("version = 1\n[volume]\nfile = \"a//b \u{201c}\u{2212}.npz\" x\n");
    odd.refused(65, &["s.toml:3: "]);
    assert!(!odd.stderr().contains("write ") && !odd.stderr().contains("begins with #"), "{odd:?}");
}

/// A value of a number, point or colour that is allowed and rare.
fn another(key: &str) -> Option<String> {
    Some(match Param::find(key)?.kind {
        Kind::Float(min, max, d) => (0.6180339 * min + 0.3819661 * max.min(d.abs() * 4.0 + 1.0)).to_string(),
        Kind::Int(min, max, d) => (d + 1).clamp(min, max).to_string(),
        Kind::Color(_) | Kind::Point(_) => "[0.125, 0.375, 0.625]".into(),
        _ => return None,
    })
}

#[test]
fn a_list_of_one_number_needs_no_brackets_for_set_and_is_told_them_in_a_file() {
    let dir = tempdir().unwrap();
    let file = dir.path().join("s.toml");
    let sheet = |widths: &str| {
        let points = "points = [[0, 1, 0], [0, 0, 0]]";
        fs::write(&file, format!("version = 1\n[sheets.fall]\n{points}\nwidths = {widths}\n")).unwrap();
        run(taki(["scene"]).arg(&file))
    };
    sheet("3").refused(65, &["s.toml:4: sheets.fall.widths = 3", "write the list in brackets: [3]"]);
    let listed = sheet("[3]").done().to_owned();
    sheet("[2]").done();
    let set = |widths: &str| run(taki(["scene"]).arg(&file).args(["--set", widths])).done().to_owned();
    assert_eq!(set("sheets.fall.widths=3"), listed);
    assert_eq!(set("widths=2,3"), set("widths=[2, 3]"));
    assert_eq!(set("eyes=[0, 1, 9], [4, 2, 7]"), set("eyes=[[0, 1, 9], [4, 2, 7]]"));
}

#[test]
fn a_key_or_table_that_is_given_twice_is_told_with_its_first_line() {
    for (text, words) in [
        (
            "[curves]\nh = 1\nlevels = 3\nh = 2",
            &["s.toml:5: duplicate key", "h stands already in line 3"][..],
        ),
        // The same key of another table is another key.
        (
            "[volume]\nseed = 1\n[rocks.a]\nseed = 1\nseed = 2",
            &["s.toml:6: duplicate key", "seed stands already in line 5"],
        ),
        (
            "[curves]\nh = 1\n[volume]\nnx = 8\n[curves]\nlevels = 3",
            &["s.toml:6", "[curves]", "in line 2; join"],
        ),
    ] {
        fault(&format!("version = 1\n{text}\n")).refused(65, words);
    }
}

#[test]
fn what_a_scene_has_and_does_not_use_is_told() {
    let dir = tempdir().unwrap();
    let file = dir.path().join("s.toml");
    let said = |text: &str, more: &[&str]| {
        fs::write(&file, format!("version = 1\n{text}\n")).unwrap();
        let small = ["--engine=cpu", "--size=16x16", "--samples=1", "-o", "p.png"];
        let run = run(taki(["render"]).arg(&file).args(small).args(more).current_dir(&dir));
        run.done();
        run.lines("taki: warning:").concat()
    };
    let watter = said("base = \"waterfall\"\n[materials.watter]\nthickness = 1", &[]);
    assert!(watter.contains("nothing has the material watter: did you mean water?"), "{watter}");
    let other = said("base = \"waterfall\"\n[materials.slime]\nthickness = 1", &[]);
    assert!(other.contains("give a sheet, splash, quad or mesh material = \"slime\""), "{other}");
    // The base's own materials may be left over, and a scene without water needs none.
    let none = "remove = [\"sheets.mist_foot\", \"sheets.mist_low\"]\n[materials.mist]\nmist = 0.1";
    assert_eq!(said(&format!("base = \"waterfall\"\n{none}"), &[]), "");
    assert_eq!(said("base = \"waterfall\"\nremove = [\"sheets\"]\n[materials.fur]\nthickness = 1", &[]), "");
    // A hole needs an alpha channel.
    let holdout = "base = \"waterfall\"\n[rocks.wall]\nshow = \"holdout\"";
    assert!(said(holdout, &[]).contains("add --alpha"));
    assert_eq!(said(holdout, &["--alpha", "--overwrite"]), "");
    // The camera looks away.
    let away = "base = \"waterfall\"\n[camera]\ntarget = [0, 0, 100]";
    assert!(said(away, &[]).contains("no water is in the picture"), "{}", said(away, &[]));
}

#[test]
fn corners_of_rock_go_around_it() {
    let rock = |corners: &str| fault(&format!("version = 1\n[rocks.a]\ncorners = [{corners}]\n"));
    rock("[0, 0, 0], [1, 1, 0], [1, 0, 0], [0, 1, 0]")
        .refused(65, &["rock a", "two of its edges cross", "around"]);
    rock("[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]").refused(65, &["two of its edges cross"]);
    for corners in [
        "[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]",
        // Hollow, and bent.
        "[0, 0, 0], [4, 0, 0], [1, 1, 0], [0, 4, 0]",
        "[0, 0, 0], [1, 0, 1], [1, 1, 0], [0, 1, 1]",
    ] {
        rock(corners).done();
    }
}

#[test]
fn colours_from_0_to_255_are_told_to_be_linear() {
    scene("fig5", &["rocks.wall.color=128,120,100"])
        .refused(65, &["rocks.wall.color", "at most 1", "#rrggbb"]);
    let dir = tempdir().unwrap();
    let picture = |color: &str| {
        let mut command =
            taki(["render", "front", "--engine=cpu", "--size=16x16", "--samples=1", "--overwrite"]);
        let run = run(command.args(["-o", "p.png", "--set", color]).current_dir(&dir));
        run.done();
        run.lines("taki: warning:").concat()
    };
    let bright = picture("lights.key.color=255,240,220");
    assert!(bright.contains("lights.key.color is linear") && bright.contains("\"#fff0dc\""), "{bright}");
    assert_eq!(picture("lights.key.color=3,2,1"), "");
}

#[test]
fn rock_that_is_all_seen_from_behind_is_told() {
    let dir = tempdir().unwrap();
    let file = dir.path().join("s.toml");
    let said = |corners: &str| {
        let text = format!("version = 1\nbase = \"front\"\n[rocks.a]\nlevels = 1\ncorners = [{corners}]\n");
        fs::write(&file, text).unwrap();
        let small = ["--engine=cpu", "--size=16x16", "--samples=1", "--overwrite", "-o", "p.png"];
        let run = run(taki(["render"]).arg(&file).args(small).current_dir(&dir));
        run.done();
        run.lines("taki: warning:").concat()
    };
    let corners = ["[-1, -1, -1]", "[1, -1, -1]", "[1, 1, -1]", "[-1, 1, -1]"];
    assert_eq!(said(&corners.join(", ")), "");
    let turned: Vec<&str> = corners.into_iter().rev().collect();
    assert!(said(&turned.join(", ")).contains("all rock is seen from behind"));
}

#[test]
fn a_misspelt_scene_file_is_told_the_one_beside_it() {
    let dir = tempdir().unwrap();
    fs::write(dir.path().join("film.toml"), "version = 1\n").unwrap();
    for name in ["film.tml", "fim.toml", "./flim.toml"] {
        let near =
            if name.starts_with('.') { "did you mean ./film.toml?" } else { "did you mean film.toml?" };
        run(taki(["scene", name]).current_dir(&dir)).refused(65, &[name, near]);
    }
}
