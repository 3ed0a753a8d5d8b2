//! Standard output that cannot be written, and readers that have gone.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use tempfile::tempdir;

use super::{TINY, in_shell, is_picture, run, small_volume, taki};

/// Runs a command in `folder` while stdout is on a full disk.
fn on_a_full_disk(folder: &Path, command: &mut Command) {
    let run = run(in_shell("", ">/dev/full", command).current_dir(folder));
    run.refused(74, &["cannot write stdout", "No space left"]);
}

#[test]
fn stdout_that_cannot_be_written_ends_every_command_with_an_error() {
    let dir = tempdir().unwrap();
    small_volume(&dir.path().join("v.npz"));
    run(taki(["render", "front", "-o", "p.png"]).args(TINY).current_dir(&dir)).done();
    let commands: [&[&str]; 16] = [
        &["--help"],
        &["--version"],
        &["scene", "fig5"],
        &["scene", "fig5", "--json"],
        &["presets"],
        &["devices"],
        &["completions", "bash"],
        &["volume", "info", "v.npz"],
        &["volume", "info", "v.npz", "--json"],
        &["compare", "p.png", "p.png"],
        &["compare", "p.png", "p.png", "--json"],
        &["compare", "--eye", "p.png"],
        &["batch", "front", "--dry-run"],
        &["farm", "slurm", "--", "front", "-o", "x.####.png"],
        &["bench", "--engine=cpu", "--cells=4", "--size=16x16", "--runs=1"],
        &["bench", "--engine=cpu", "--cells=4", "--size=16x16", "--runs=1", "--json"],
    ];
    for arguments in commands {
        on_a_full_disk(dir.path(), &mut taki(arguments));
    }
}

#[test]
fn work_whose_report_cannot_be_written_is_done_all_the_same() {
    let dir = tempdir().unwrap();
    for (file, arguments) in [
        ("r.png", &["render", "front", "--json", "-o", "r.png"][..]),
        ("j.0000.png", &["batch", "front", "--frames=0", "--json", "-o", "j.####.png"]),
        ("e.0000.png", &["batch", "front", "--frames=0", "--events=json", "-o", "e.####.png"]),
    ] {
        on_a_full_disk(dir.path(), taki(arguments).args(TINY));
        is_picture(&dir.path().join(file));
        fs::remove_file(dir.path().join(file)).unwrap();
    }
}

#[test]
fn lines_of_system_libraries_that_tell_nothing_are_not_shown() {
    let dir = tempdir().unwrap();
    for arguments in [
        &["devices"][..],
        &["render", "front", "--size=16x16", "--samples=1", "-o=p.png"],
        &["batch", "front", "--size=16x16", "--samples=1", "--frames=0"],
        &["render", "front", "--adapter", "no such adapter", "-o=p.png"],
        // Without a display it ends with an error of its own.
        &["view", "front", "--exit-after=1"],
    ] {
        if arguments[0] == "view" && !cfg!(feature = "viewer") {
            continue;
        }
        let mut command = taki(arguments);
        for name in ["XDG_RUNTIME_DIR", "DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
            command.env_remove(name);
        }
        let run = run(command.current_dir(&dir));
        let foreign: Vec<&str> = run.stderr().lines().filter(|line| !line.starts_with("taki: ")).collect();
        assert_eq!(foreign, [""; 0], "{arguments:?}");
        assert_eq!(run.lines("taki: error").len(), usize::from(run.exit_code() != Some(0)), "{run:?}");
    }
}

#[test]
fn a_reader_that_has_gone_is_no_error() {
    let dir = tempdir().unwrap();
    for arguments in [
        &["scene", "fig5"][..],
        &["presets"],
        &["--help"],
        &["batch", "front", "--engine=cpu", "--size=16x16", "--frames=0", "--events=json"],
    ] {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let mut command = taki(arguments);
        command.current_dir(&dir).stdin(Stdio::null()).stdout(writer);
        let output = command.stderr(Stdio::piped()).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {said}");
        assert!(!said.contains("error"), "{arguments:?}: {said}");
    }
    is_picture(&dir.path().join("front.0000.png"));
}

#[test]
fn a_file_that_grows_past_the_users_limit_is_an_error_and_leaves_nothing() {
    let dir = tempdir().unwrap();
    let mut command = taki(["render", "front", "-o", "p.exr"]);
    command.args(["--engine=cpu", "--size=256x256", "--samples=1"]);
    let limited = run(in_shell("ulimit -f 16;", "", &command).current_dir(&dir));
    limited.refused(74, &["cannot write p.exr", "File too large"]);
    assert!(fs::read_dir(dir.path()).unwrap().next().is_none());
}
