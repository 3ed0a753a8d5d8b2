//! Sweeps: their grid, file names, contact sheet and manifests.

use std::collections::BTreeMap;
use std::fs;

use super::{batch, files, folder};
use crate::cli::faults::{run, taki};

#[test]
fn every_point_of_the_grid_is_the_single_render_of_its_values() {
    let dir = folder();
    let grid = ["--sweep", "alpha=0.5:1:0.25", "--sweep", "curves.h=0.6,1.4", "-o", "{alpha}-{h}.png"];
    run(&mut batch(dir.path(), grid)).done();
    let made: BTreeMap<String, Vec<u8>> = files(dir.path());
    for alpha in ["0.5", "0.75", "1"] {
        for h in ["0.6", "1.4"] {
            let alone = folder();
            let mut command = taki(["render"]);
            command.args(super::TINY).args(["--set", &format!("volume.alpha={alpha}")]);
            command.args(["--set", &format!("curves.h={h}"), "-o", "s.png"]).current_dir(alone.path());
            run(&mut command).done();
            let alone = fs::read(alone.path().join("s.png")).unwrap();
            assert!(made[&format!("{alpha}-{h}.png")] == alone, "{alpha} {h}");
        }
    }
}

#[test]
fn sweeps_that_cannot_be_are_refused_with_the_reason() {
    let dir = folder();
    let cases = [
        ("alpha", 2, "the values are missing"),
        ("alpha=", 2, "0 values"),
        ("alpha=0.25:1", 2, "the step is missing: write alpha=0.25:1:STEP"),
        ("alpha=0:1:0", 2, "steps of 0 do not lead"),
        ("alpha=1:0:0.1", 2, "steps of 0.1 do not lead"),
        ("alpha=0:1:0.00001", 2, "at most 1000"),
        ("alpha=0.5,0.5", 2, "given twice"),
        ("alpha=0.5:2:0.5", 65, "allowed: 0 to 1"),
        ("alfa=1", 65, "unknown key"),
        ("camera.eye=4.5,-2.4,15", 2, "write each value in brackets: camera.eye=[4.5,-2.4,15]"),
        ("h=x", 65, "allowed: 0 to 8"),
        ("width=8,16", 2, "cannot be swept"),
        ("animate.fps=1,2", 2, "cannot be swept"),
        ("lights.moon.intensity=1", 65, "no moon"),
    ];
    for (sweep, code, words) in cases {
        let name = format!("{{{}}}.png", sweep.split('=').next().unwrap());
        let refused = run(&mut batch(dir.path(), ["--sweep", sweep, "-o", &name]));
        assert_eq!(refused.exit_code(), Some(code), "{sweep}: {refused:?}");
        assert!(refused.stderr().contains(words), "no {words:?} in {refused:?}");
    }
}

#[test]
fn two_pictures_of_one_name_are_refused_before_the_work() {
    let dir = folder();
    let refused =
        |arguments: &[&str], words: &[&str]| run(&mut batch(dir.path(), arguments)).refused(2, words);
    let run_on = ["--sweep", "curves.h=1,1.1", "--sweep", "alpha=1,0.1", "-o"];
    refused(
        &["--sweep", "max_cells=1,11", "--sweep", "across=1,11", "-o", "{max_cells}{across}.png"],
        &["111.png", "trace.max_cells=1", "trace.max_cells=11", "to separate two values"],
    );
    refused(&["--sweep", "volume.file=a/b.npz,a_b.npz", "-o", "{file}.png"], &["a_b.npz.png"]);
    run(batch(dir.path(), run_on).arg("{h}-{alpha}.png")).done();
}

#[test]
fn a_sweep_leaves_a_sheet_and_manifests_that_agree_with_its_pictures() {
    let dir = folder();
    let grid = [
        "--sweep",
        "alpha=0.5,1",
        "--sweep",
        "h=0.6,1,1.4",
        "-o",
        "{alpha}-{h}.png",
        "-o",
        "{alpha}-{h}.exr",
    ];
    run(&mut batch(dir.path(), grid)).done();
    let made = files(dir.path());
    assert_eq!(made.len(), 6 * 2 + 3, "{:?}", made.keys());

    let json: serde_json::Value = serde_json::from_slice(&made["front.manifest.json"]).unwrap();
    let rows = json.as_array().unwrap();
    assert_eq!(rows.len(), 6);
    let text = String::from_utf8(made["front.manifest.csv"].clone()).unwrap();
    let lines: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
    let column = |name: &str| lines[0].iter().position(|n| *n == name).unwrap_or_else(|| panic!("no {name}"));
    for (row, line) in rows.iter().zip(&lines[1..]) {
        let (alpha, h) =
            (row["parameters"]["volume.alpha"].to_string(), row["parameters"]["curves.h"].to_string());
        assert_eq!([line[column("volume.alpha")], line[column("curves.h")]], [alpha.as_str(), h.as_str()]);
        let exr = line[column("exr")];
        assert_eq!(row["files"][1], exr);
        // The numbers are those of the picture's own linear values.
        let (_, _, channels) = taki::output::frame::read_exr(&dir.path().join(exr), 1 << 30).unwrap();
        let mean = |name: &str| {
            let (_, values) = channels.iter().find(|(n, _)| n == name).unwrap();
            values.iter().map(|&x| f64::from(x)).sum::<f64>() / values.len() as f64
        };
        for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
            let told = row["mean_radiance"][c].as_f64().unwrap();
            assert!((told - mean(name)).abs() < 1e-4, "{exr} {name}: {told} {}", mean(name));
        }
        assert_eq!(row["cells_walked"].as_f64().unwrap(), mean("cells.N") * 16.0 * 12.0);
        assert!((row["mean_transmittance"].as_f64().unwrap() - mean("transmittance.T")).abs() < 1e-4);
    }
    // The denser volume is less transparent, and the manifest says so.
    let transmittance = |n: usize| rows[n]["mean_transmittance"].as_f64().unwrap();
    assert!(transmittance(0) > transmittance(3));

    // The sheet shows each picture itself, once.
    let sheet = image::load_from_memory(&made["front.sheet.png"]).unwrap().to_rgb8();
    let mut places = Vec::new();
    for alpha in ["0.5", "1"] {
        for h in ["0.6", "1", "1.4"] {
            let picture = image::load_from_memory(&made[&format!("{alpha}-{h}.png")]).unwrap().to_rgb8();
            let at = find(&sheet, &picture).unwrap_or_else(|| panic!("{alpha}-{h} is not on the sheet"));
            places.push(at);
        }
    }
    // The first sweep runs across the sheet, the second down.
    assert!(places[0].1 == places[3].1 && places[0].0 < places[3].0, "{places:?}");
    assert!(
        places[0].0 == places[1].0 && places[0].1 < places[1].1 && places[1].1 < places[2].1,
        "{places:?}"
    );

    // A second run changes nothing.
    run(&mut batch(dir.path(), grid)).done();
    assert!(files(dir.path()) == made);
}

/// Position at which `part` lies in `whole`, pixel for pixel.
fn find(whole: &image::RgbImage, part: &image::RgbImage) -> Option<(u32, u32)> {
    let (w, h) = part.dimensions();
    let is_at = |x: u32, y: u32| {
        (0..h).all(|j| (0..w).all(|i| whole.get_pixel(x + i, y + j) == part.get_pixel(i, j)))
    };
    let columns = 0..=whole.width().checked_sub(w)?;
    let rows = 0..=whole.height().checked_sub(h)?;
    rows.flat_map(|y| columns.clone().map(move |x| (x, y))).find(|&(x, y)| is_at(x, y))
}

#[test]
fn frames_of_a_sweep_have_a_table_too() {
    let dir = folder();
    let arguments = [
        "--frames",
        "3-4",
        "--sweep",
        "h=0.6,1",
        "-o",
        "{h}.#.png",
        "--manifest",
        "m.csv",
        "--sheet",
        "s.png",
    ];
    run(&mut batch(dir.path(), arguments)).done();
    let made: Vec<String> = files(dir.path()).into_keys().collect();
    assert_eq!(made, ["0.6.3.png", "0.6.4.png", "1.3.png", "1.4.png", "m.csv", "s.png"]);
    let text = fs::read_to_string(dir.path().join("m.csv")).unwrap();
    let starts: Vec<&str> =
        text.lines().skip(1).map(|l| l.split(",1.").next().unwrap().split(",0.6.").next().unwrap()).collect();
    assert_eq!(starts.len(), 4, "{text}");
}

#[test]
fn a_sweep_replaces_its_own_sheet_and_manifests_and_no_others() {
    let dir = folder();
    let sweep = |arguments: &[&str]| run(&mut batch(dir.path(), arguments));
    let alpha = ["--sweep", "alpha=0.5,1", "-o", "a{alpha}.png"];
    sweep(&alpha).done();
    let first = files(dir.path());
    let h = ["--sweep", "h=0.6,1", "-o", "h{h}.png"];
    sweep(&h).refused(73, &["front.sheet.png", "a file of another batch", "--sheet"]);
    let named = [&h[..], &["--sheet", "h.png"]].concat();
    sweep(&named).refused(73, &["front.manifest.csv", "a file of another batch"]);
    assert!(files(dir.path()) == first, "nothing was written");
    sweep(&[&named[..], &["--manifest", "h.csv"]].concat()).done();
    // A picture of taki is no sheet.
    let picture = ["--sheet", "a1.png", "--manifest", "h.csv"];
    sweep(&[&h[..], &picture].concat()).refused(73, &["a1.png"]);
    // More values make the same sheet larger.
    sweep(&["--sweep", "alpha=0.25,0.5,1", "-o", "a{alpha}.png"]).done();
    let second = files(dir.path());
    assert!(second["front.manifest.csv"].len() > first["front.manifest.csv"].len());
    assert!(second["front.sheet.png"] != first["front.sheet.png"]);
    sweep(&[&h[..], &["--overwrite"]].concat()).done();
    assert!(files(dir.path())["front.manifest.json"] != second["front.manifest.json"]);
}
