//! Outputs onto what is there already: links, files with permissions of their own, devices.

use std::fs;
use std::os::unix::fs::{FileTypeExt, PermissionsExt, symlink};
use std::path::Path;
use std::process::Command;

use tempfile::tempdir;

use super::{Run, TINY, has_only, is_picture, names, render, run, taki};

/// Writes a job file: the quickest output that passes through the one place that makes outputs.
fn job(folder: &Path, output: &str) -> Run {
    let farm = ["farm", "slurm", "--overwrite", "-o", output, "--", "front", "-o", "x.####.png"];
    run(taki(farm).current_dir(folder))
}

fn is_job(path: &Path) {
    assert!(fs::read_to_string(path).unwrap().starts_with("#!"), "{}", path.display());
}

fn mode(path: &Path) -> u32 {
    fs::metadata(path).unwrap().permissions().mode() & 0o7777
}

#[test]
fn an_output_through_a_link_replaces_the_file_behind_it() {
    let dir = tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    fs::create_dir_all(at("links")).unwrap();
    fs::create_dir_all(at("disk/deep")).unwrap();
    fs::write(at("disk/old.sh"), "#SBATCH").unwrap();
    // A relative link starts in its own folder, not in the current one.
    symlink("../disk/old.sh", at("links/relative.sh")).unwrap();
    symlink(at("disk/deep/absent.sh"), at("links/dangling.sh")).unwrap();
    symlink("dangling.sh", at("links/chain.sh")).unwrap();
    symlink("disk", at("folder")).unwrap();
    let cases = [
        ("folder/new.sh", "disk/new.sh"),
        ("links/relative.sh", "disk/old.sh"),
        ("links/dangling.sh", "disk/deep/absent.sh"),
        ("links/chain.sh", "disk/deep/absent.sh"),
    ];
    for (link, file) in cases {
        fs::write(at("disk/old.sh"), "#SBATCH").unwrap();
        let _ = fs::remove_file(at("disk/deep/absent.sh"));
        job(dir.path(), link).done();
        assert!(!at(file).is_symlink(), "{link}");
        is_job(&at(file));
    }
    for link in ["links/relative.sh", "links/dangling.sh", "links/chain.sh", "folder"] {
        assert!(at(link).is_symlink(), "{link} was replaced");
    }
    has_only(&at("links"), &["chain.sh", "dangling.sh", "relative.sh"]);
    has_only(&at("disk"), &["deep", "new.sh", "old.sh"]);
    has_only(&at("disk/deep"), &["absent.sh"]);
}

#[test]
fn every_writer_follows_links_and_keeps_the_mode() {
    let dir = tempdir().unwrap();
    let disk = dir.path().join("disk");
    fs::create_dir(&disk).unwrap();
    let linked = |names: &[&str]| {
        for name in names {
            fs::write(disk.join(name), "").unwrap();
            fs::set_permissions(disk.join(name), PermissionsExt::from_mode(0o600)).unwrap();
            symlink(Path::new("disk").join(name), dir.path().join(name)).unwrap();
        }
    };
    let command = |arguments: &[&str]| {
        run(taki(arguments).current_dir(&dir)).done();
    };
    let stills = ["p.png", "p.exr", "whole.png", "d.png", "v.npz", "j.sh"];
    let batches = ["m.gif", "m.apng", "f.1.png", "f.2.png", "f.sheet.png", "f.csv", "f.json"];
    let all = [&stills[..], &batches].concat();
    linked(&all);
    let picture = [&["render", "front"], &TINY[..]].concat();
    command(&[&picture[..], &["-o", "p.png", "-o", "p.exr"]].concat());
    command(&["volume", "build", "front", "-o", "v.npz"]);
    command(&["farm", "slurm", "--overwrite", "-o", "j.sh", "--", "front", "-o", "x.####.png"]);
    command(&["compare", "p.png", "p.png", "--difference", "d.png"]);
    command(&["stitch", "p.png", "-o", "whole.png"]);
    let batch = [&["batch", "front"], &TINY[..]].concat();
    command(&[&batch[..], &["--frames", "0-1", "-o", "m.gif", "-o", "m.apng", "--overwrite"]].concat());
    let sweep = ["--sweep", "light.p=1,2", "-o", "f.{p}.png", "--overwrite"];
    let wholes = ["--sheet", "f.sheet.png", "--manifest", "f.csv", "--manifest", "f.json"];
    command(&[&batch[..], &sweep, &wholes].concat());
    for name in &all {
        assert!(dir.path().join(name).is_symlink(), "{name} was replaced");
        assert!(fs::metadata(disk.join(name)).unwrap().len() > 0, "{name} was not written");
        assert_eq!(mode(&disk.join(name)), 0o600, "{name}");
    }
    is_picture(&disk.join("p.png"));
    is_picture(&disk.join("whole.png"));
    assert_eq!(names(&disk).len(), all.len(), "{:?}", names(&disk));
}

#[test]
fn a_batch_takes_a_link_to_nothing_for_a_missing_picture() {
    let dir = tempdir().unwrap();
    let (disk, link) = (dir.path().join("disk"), dir.path().join("f.0000.png"));
    fs::create_dir(&disk).unwrap();
    symlink("disk/a.png", &link).unwrap();
    let batch = || {
        let mut command = taki(["batch", "front"]);
        command.args(TINY).args(["--frames", "0", "-o", "f.####.png", "--json"]).current_dir(&dir);
        serde_json::from_str::<serde_json::Value>(run(&mut command).done()).unwrap()
    };
    assert_eq!(batch()["rendered"], 1);
    assert!(link.is_symlink());
    is_picture(&disk.join("a.png"));
    assert_eq!(batch()["kept"], 1);
}

#[test]
fn a_replaced_file_hands_on_its_mode() {
    let dir = tempdir().unwrap();
    let path = dir.path().join("j.sh");
    for wanted in [0o600, 0o640, 0o755, 0o444] {
        fs::write(&path, "#SBATCH").unwrap();
        fs::set_permissions(&path, PermissionsExt::from_mode(wanted)).unwrap();
        job(dir.path(), "j.sh").done();
        is_job(&path);
        assert_eq!(mode(&path), wanted, "{wanted:o}");
        fs::remove_file(&path).unwrap();
    }
}

#[test]
fn a_loop_of_links_is_refused_before_work() {
    let dir = tempdir().unwrap();
    symlink("b.png", dir.path().join("a.png")).unwrap();
    symlink("a.png", dir.path().join("b.png")).unwrap();
    run(&mut render("front", dir.path().join("a.png"))).refused(73, &["a.png", "links form a loop"]);
    let mut batch = taki(["batch", "front", "--frames", "0", "-o"]);
    run(batch.arg(dir.path().join("a.png"))).refused(73, &["a.png", "links form a loop"]);
    has_only(dir.path(), &["a.png", "b.png"]);
}

#[test]
fn a_device_or_pipe_is_not_replaced() {
    let dir = tempdir().unwrap();
    let pipe = dir.path().join("p.sh");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    job(dir.path(), "p.sh").refused(73, &["p.sh", "not a regular file"]);
    assert!(fs::metadata(&pipe).unwrap().file_type().is_fifo());
    symlink("/dev/null", dir.path().join("n.sh")).unwrap();
    job(dir.path(), "n.sh").refused(73, &["n.sh", "not a regular file"]);
    assert!(fs::metadata("/dev/null").unwrap().file_type().is_char_device());
    has_only(dir.path(), &["n.sh", "p.sh"]);
}

#[test]
fn names_as_long_as_the_file_system_allows_work() {
    let dir = tempdir().unwrap();
    let named = |length: usize, end: &str| format!("{}{end}", "n".repeat(length - end.len()));
    for length in [224, 225, 255] {
        let name = named(length, ".png");
        run(&mut render("front", dir.path().join(&name))).done();
        is_picture(&dir.path().join(&name));
        fs::remove_file(dir.path().join(&name)).unwrap();
    }
    // A batch claims its pictures too. Its pattern has as many characters as the name.
    let batch = |name: &str| {
        let mut command = taki(["batch", "front"]);
        command.args(TINY).args(["--frames", "0-1", "-o", name]).current_dir(&dir);
        run(&mut command)
    };
    batch(&named(255, ".####.png")).done();
    batch(&named(255, ".gif")).done();
    is_picture(&dir.path().join(named(255, ".0001.png")));
    assert_eq!(names(dir.path()).len(), 3, "{:?}", names(dir.path()));
    // A longer name is known before the work.
    let long = named(256, ".png");
    run(&mut render("front", dir.path().join(&long))).refused(73, &[&long, "choose a shorter name"]);
    batch(&named(256, ".####.png")).refused(73, &["choose a shorter name"]);
    assert_eq!(names(dir.path()).len(), 3, "{:?}", names(dir.path()));
}

#[test]
fn messages_name_the_output_and_no_temporary_file() {
    let dir = tempdir().unwrap();
    fs::write(dir.path().join("file"), "").unwrap();
    for output in ["absent/x.png", "file/x.png", "/proc/x.png"] {
        for command in ["render", "batch"] {
            let mut command = taki([command, "front"]);
            let run = run(command.args(TINY).args(["-o", output]).current_dir(&dir));
            run.refused(73, &[output]);
            assert!(!run.stderr().contains("taki-") && !run.stderr().contains(".tmp"), "{}", run.stderr());
        }
    }
}

#[test]
fn a_still_replaces_pictures_but_no_other_file_unless_told_to() {
    let dir = tempdir().unwrap();
    let (path, exr) = (dir.path().join("x.png"), dir.path().join("y.exr"));
    let render = |more: &[&str]| run(render("front", &path).arg("-o").arg(&exr).args(more));
    render(&[]).done();
    render(&[]).done();
    let part = dir.path().join("part.png");
    fs::copy(&path, &part).unwrap();
    let stitch = |more: &[&str]| run(taki(["stitch"]).arg(&part).arg("-o").arg(&path).args(more));
    stitch(&[]).done();
    for other in ["notes", "P", "GIMP"] {
        fs::write(&path, other).unwrap();
        for run in [render(&[]), stitch(&[])] {
            run.refused(73, &["x.png", "no picture", "--overwrite"]);
            assert_eq!(fs::read_to_string(&path).unwrap(), other);
        }
    }
    stitch(&["--overwrite"]).done();
    is_picture(&path);
    fs::write(&exr, "notes").unwrap();
    render(&[]).refused(73, &["y.exr", "no picture"]);
    render(&["--overwrite"]).done();
    // An empty file holds nothing that could be lost.
    fs::write(&path, "").unwrap();
    render(&[]).done();
    is_picture(&path);
    has_only(dir.path(), &["part.png", "x.png", "y.exr"]);
}

#[test]
fn a_picture_of_a_difference_a_volume_and_a_screenshot_replace_their_own_kind_alone() {
    let dir = tempdir().unwrap();
    let at = |arguments: &[&str]| run(taki(arguments).current_dir(dir.path()));
    run(render("front", dir.path().join("a.png")).arg("-o").arg(dir.path().join("b.png"))).done();
    let difference = ["compare", "a.png", "b.png", "--difference", "d.png"];
    let volume = ["volume", "build", "front", "-o", "v.npz"];
    let mut commands: Vec<(&str, &[&str], &str)> =
        vec![("d.png", &difference, "no picture"), ("v.npz", &volume, "no volume")];
    let screenshot = ["view", "front", "--exit-after", "1", "--screenshot", "s.png"];
    if cfg!(feature = "viewer") {
        commands.push(("s.png", &screenshot, "no picture"));
    }
    for (file, command, why) in commands {
        let path = dir.path().join(file);
        fs::write(&path, "notes").unwrap();
        at(command).refused(73, &[file, why, "--overwrite"]);
        assert_eq!(fs::read_to_string(&path).unwrap(), "notes");
        if file == "s.png" {
            // Whether a window opens is another matter.
            continue;
        }
        at(&[command, &["--overwrite"]].concat()).done();
        assert!(fs::metadata(&path).unwrap().len() > 50);
        at(command).done();
    }
    for [command, path] in [["--difference", "d.exr"], ["--difference", "d"]] {
        at(&["compare", "a.png", "b.png", command, path]).refused(2, &[path, "use .png, .jpg"]);
    }
    at(&["compare", "a.png", "b.png", "--difference", "d.webp"]).done();
    assert!(fs::read(dir.path().join("d.webp")).unwrap().starts_with(b"RIFF"));
    // A folder that is missing is known before the window opens.
    if cfg!(feature = "viewer") {
        at(&["view", "front", "--exit-after", "1", "--screenshot", "none/s.png"])
            .refused(73, &["none/s.png"]);
    }
}
