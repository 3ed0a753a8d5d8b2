//! Sweeps: the grid, its names, its sheet and its manifests.

use std::collections::BTreeMap;
use std::fs;

use super::{batch, files, folder};
use crate::faults::{run, taki};

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
        ("alpha", 2, "it has no values"),
        ("alpha=", 2, "0 values"),
        ("alpha=0:1:0", 2, "no steps of 0"),
        ("alpha=1:0:0.1", 2, "no steps of 0.1"),
        ("alpha=0:1:0.00001", 2, "at most 1000"),
        ("alpha=0.5,0.5", 2, "given twice"),
        ("alpha=0.5:2:0.5", 65, "allowed: 0 to 1"),
        ("alfa=1", 65, "unknown key"),
        ("h=x", 65, "allowed: 0 to 8"),
        ("kind=point", 2, "--sweep"),
        ("width=8,16", 2, "cannot be swept"),
        ("animate.fps=1,2", 2, "cannot be swept"),
        ("lights.moon.intensity=1", 65, "no moon"),
    ];
    for (sweep, code, words) in cases {
        let refused = run(&mut batch(dir.path(), ["--sweep", sweep, "-o", "{h}{alpha}.png"]));
        assert_eq!(refused.exit_code(), Some(code), "{sweep}: {refused:?}");
        assert!(refused.stderr().contains(words), "no {words:?} in {refused:?}");
    }
}
