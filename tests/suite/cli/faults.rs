//! Faults from outside the program: folders that cannot be written, signals, files of the wrong kind, huge
//! sizes, GPU devices that are missing or lost. Each ends with one line on stderr and an exit code, and
//! leaves no incomplete file.

mod device;
mod inputs;
mod outputs;
mod streams;

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{Read, Seek};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use tempfile::{TempDir, tempdir};

/// Longest time that a run may take. Every command of these tests ends within seconds; one that hangs must
/// not hang the suite.
const LONGEST: Duration = Duration::from_secs(120);
const TINY: [&str; 6] = ["--engine", "cpu", "--size", "16x16", "--samples", "1"];
/// A render that takes hours, for tests that stop it.
const ENDLESS: [&str; 7] = ["render", "fig5", "--engine", "cpu", "--samples", "4096", "-o"];

/// Result of one run of the program.
#[derive(Debug)]
pub struct Run {
    code: Option<i32>,
    out: String,
    err: String,
}

impl Run {
    /// Asserts that the run ended with `code` and one error line that contains all of `words`.
    pub fn refused(&self, code: i32, words: &[&str]) {
        let lines = self.lines("taki: error:");
        assert_eq!((self.code, lines.len()), (Some(code), 1), "{}", self.err);
        for word in words {
            assert!(lines[0].contains(word), "no {word:?} in: {}", lines[0]);
        }
    }

    /// Asserts that the run succeeded, and returns its stdout.
    pub fn done(&self) -> &str {
        assert_eq!((self.code, self.lines("taki: error:").len()), (Some(0), 0), "{}", self.err);
        &self.out
    }

    /// Exit code; `None` after a signal.
    pub fn exit_code(&self) -> Option<i32> {
        self.code
    }

    /// Text on stdout.
    pub fn stdout(&self) -> &str {
        &self.out
    }

    /// Text on stderr.
    pub fn stderr(&self) -> &str {
        &self.err
    }

    /// Lines of stderr that begin with `start`.
    pub fn lines(&self, start: &str) -> Vec<&str> {
        self.err.lines().filter(|line| line.starts_with(start)).collect()
    }
}

/// Runs the command to its end, for at most `LONGEST`. Fails if the program panics.
pub fn run(command: &mut Command) -> Run {
    let (mut out, mut err) = (tempfile::tempfile().unwrap(), tempfile::tempfile().unwrap());
    command.stdin(Stdio::null()).stdout(out.try_clone().unwrap()).stderr(err.try_clone().unwrap());
    let mut child = command.spawn().unwrap();
    let code = wait(&mut child);
    let text = |file: &mut File| {
        let mut bytes = Vec::new();
        file.rewind().unwrap();
        file.read_to_end(&mut bytes).unwrap();
        String::from_utf8_lossy(&bytes).into_owned()
    };
    let run = Run { code, out: text(&mut out), err: text(&mut err) };
    assert!(!run.err.contains("panicked") && !run.err.contains("overflowed its stack"), "{}", run.err);
    run
}

/// Waits for the end of the process and returns its exit code.
pub fn wait(child: &mut Child) -> Option<i32> {
    let start = Instant::now();
    loop {
        if let Some(status) = child.try_wait().unwrap() {
            return status.code();
        }
        if start.elapsed() > LONGEST {
            child.kill().unwrap();
            panic!("still running after {LONGEST:?}");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Command that runs `taki` with `arguments`.
pub fn taki<A: AsRef<OsStr>>(arguments: impl IntoIterator<Item = A>) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_taki"));
    command.env("XDG_CACHE_HOME", env!("CARGO_TARGET_TMPDIR"));
    command.args(arguments);
    command
}

/// Command for a tiny render on the CPU.
pub fn render(scene: impl AsRef<OsStr>, output: impl AsRef<OsStr>) -> Command {
    let mut command = taki(["render"]);
    command.arg(scene).args(TINY).arg("-o").arg(output);
    command
}

/// Command that runs `before` in a shell and then the program.
fn in_shell(before: &str, redirect: &str, command: &Command) -> Command {
    let mut shell = Command::new("bash");
    shell.args(["-c", &format!("{before} exec \"$@\" {redirect}"), "bash"]);
    shell.arg(command.get_program()).args(command.get_args());
    shell
}

/// Names of the files in a folder.
fn names(folder: &Path) -> BTreeSet<String> {
    let entries = fs::read_dir(folder).unwrap();
    entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect()
}

fn has_only(folder: &Path, expected: &[&str]) {
    assert_eq!(names(folder), expected.iter().map(|s| (*s).to_owned()).collect());
}

fn is_picture(path: &Path) {
    let bytes = fs::read(path).unwrap();
    let picture = image::load_from_memory(&bytes).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    assert_eq!((picture.width(), picture.height()), (16, 16));
}

/// Makes a folder with a scene file that takes its volume from `volume`.
fn scene_with_volume(volume: &str) -> (TempDir, PathBuf) {
    let dir = tempdir().unwrap();
    let folder = dir.path().join("scene");
    fs::create_dir(&folder).unwrap();
    let text = format!("version = 1\nbase = \"front\"\n[volume]\nfile = {volume:?}\n");
    fs::write(folder.join("s.toml"), text).unwrap();
    (dir, folder)
}

pub fn small_volume(path: &Path) {
    let small = ["nx", "ny", "nz"].map(|axis| format!("--set=volume.{axis}=4"));
    run(taki(["volume", "build", "front"]).args(small).arg("-o").arg(path)).done();
}

#[test]
fn outputs_that_cannot_be_made_are_known_before_work() {
    let dir = tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    fs::create_dir(at("taken.png")).unwrap();
    fs::write(at("file"), "").unwrap();
    let cases = [
        (at("absent/x.png"), 73, "make the folder"),
        (at("taken.png"), 73, "a folder has this name"),
        (at("file/x.png"), 73, "file/x.png"),
        ("/proc/x.png".into(), 73, "/proc/x.png"),
        (at("x.bmp"), 2, "use .png, .jpg, .tif, .webp or .exr"),
        (at("x"), 2, "use .png, .jpg, .tif, .webp or .exr"),
        ("..".into(), 2, ".."),
    ];
    for (path, code, words) in cases {
        // The work takes hours, so the fault must be reported before the work begins.
        let start = Instant::now();
        run(taki(ENDLESS).arg(&path)).refused(code, &[words, &path.display().to_string()]);
        assert!(start.elapsed() < Duration::from_secs(30), "{} was known late", path.display());
    }
    has_only(dir.path(), &["file", "taken.png"]);
    run(taki(["volume", "build", "front", "-o"]).arg(at("absent/v.npz"))).refused(73, &["absent/v.npz"]);
}

#[test]
fn a_full_disk_leaves_the_old_file_and_no_other() {
    // A limit on the size of files acts as a full disk does: it fails in the middle of a write.
    for name in ["x.png", "x.jpg", "x.tif", "x.webp", "x.exr", "x.npz"] {
        let dir = tempdir().unwrap();
        let path = dir.path().join(name);
        fs::write(&path, "old").unwrap();
        let mut command = match name {
            "x.npz" => taki(["volume", "build", "front", "-o"]),
            _ => render("front", &path),
        };
        if name == "x.npz" {
            command.arg(&path);
        }
        command.arg("--overwrite");
        let full = run(&mut in_shell("trap '' XFSZ; ulimit -f 1;", "", &command));
        // The limit also applies to the run's own stderr, but its lines are far shorter than the limit.
        full.refused(74, &["cannot write", name, "free some space"]);
        assert_eq!(full.err.matches("drop failed").count(), 0, "{}", full.err);
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        has_only(dir.path(), &[name]);
    }
}

#[test]
fn an_output_is_replaced_by_a_whole_file() {
    let dir = tempdir().unwrap();
    let path = dir.path().join("x.png");
    run(&mut render("fig5", &path)).done();
    run(&mut render("front", &path)).done();
    is_picture(&path);
    has_only(dir.path(), &["x.png"]);
}

#[test]
fn an_output_may_be_read_as_the_umask_says() {
    use std::os::unix::fs::PermissionsExt;
    let dir = tempdir().unwrap();
    let path = dir.path().join("x.png");
    for (umask, mode) in [("022", 0o644), ("077", 0o600), ("002", 0o664)] {
        run(&mut in_shell(&format!("umask {umask};"), "", &render("front", &path))).done();
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, mode, "umask {umask}");
        // A file that is there keeps its own.
        fs::remove_file(&path).unwrap();
    }
}

#[test]
fn temporary_files_of_the_dead_are_removed_and_those_of_the_living_kept() {
    let dir = tempdir().unwrap();
    let mut dead = Command::new("true").spawn().unwrap();
    dead.wait().unwrap();
    let machine = &taki::output::frame::Owner::me().machine;
    let hash = |target: &str| xxhash_rust::xxh3::xxh3_64(target.as_bytes());
    let name = |target: &str, pid: u32| format!(".taki-abc.{machine}-{pid}.{:016x}.tmp", hash(target));
    let (stale, living) = (name("x.png", dead.id()), name("x.png", std::process::id()));
    let (other, foreign) = (name("y.png", dead.id()), ".x.png.taki-notes".to_owned());
    // Another machine's processes cannot be asked: its files are stale after a day without a write.
    let elsewhere = |n: &str| format!(".taki-{n}.00000000-{}.{:016x}.tmp", dead.id(), hash("x.png"));
    let (recent, ancient) = (elsewhere("a"), elsewhere("b"));
    for file in [&stale, &living, &other, &foreign, &recent, &ancient] {
        fs::write(dir.path().join(file), "").unwrap();
    }
    let day_before = std::time::SystemTime::now() - Duration::from_secs(25 * 3600);
    File::options().write(true).open(dir.path().join(&ancient)).unwrap().set_modified(day_before).unwrap();
    run(&mut render("front", dir.path().join("x.png"))).done();
    has_only(dir.path(), &[&living, &other, &foreign, &recent, "x.png"]);
}

/// Starts endless work and waits until it has its temporary file.
fn started(folder: &Path) -> Child {
    let mut command = taki(ENDLESS);
    command.arg(folder.join("x.png")).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
    let child = command.spawn().unwrap();
    let start = Instant::now();
    while names(folder).is_empty() {
        assert!(start.elapsed() < LONGEST, "no temporary file");
        std::thread::sleep(Duration::from_millis(5));
    }
    std::thread::sleep(Duration::from_millis(200));
    child
}

#[test]
fn a_killed_run_leaves_no_picture_and_the_next_one_cleans_up() {
    let dir = tempdir().unwrap();
    let mut child = started(dir.path());
    child.kill().unwrap();
    assert_eq!(wait(&mut child), None);
    assert_eq!(names(dir.path()).len(), 1);
    assert!(!dir.path().join("x.png").exists());
    run(&mut render("front", dir.path().join("x.png"))).done();
    is_picture(&dir.path().join("x.png"));
    has_only(dir.path(), &["x.png"]);
}

#[test]
fn signals_end_the_wait_for_a_scene_on_stdin() {
    let dir = tempdir().unwrap();
    for arguments in [&["render", "-"][..], &["batch", "-"], &["scene", "-"], &["volume", "build", "-"]] {
        for (signal, code) in [("-INT", 130), ("-TERM", 143)] {
            let mut command = taki(arguments);
            command.current_dir(&dir).stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::null());
            let mut child = command.spawn().unwrap();
            // It has begun to wait when it sleeps.
            let stat = format!("/proc/{}/stat", child.id());
            let handler = format!("/proc/{}/status", child.id());
            let waits = || {
                let caught = fs::read_to_string(&handler).unwrap_or_default();
                let caught = caught.lines().find_map(|line| line.strip_prefix("SigCgt:"));
                let caught = u64::from_str_radix(caught.unwrap_or("0").trim(), 16).unwrap();
                let state = fs::read_to_string(&stat).unwrap_or_default();
                caught & 1 << 14 != 0
                    && state.rsplit_once(')').is_some_and(|(_, s)| s.trim().starts_with('S'))
            };
            let begun = Instant::now();
            while !waits() {
                assert!(begun.elapsed() < LONGEST, "it never waits");
                std::thread::sleep(Duration::from_millis(5));
            }
            std::thread::sleep(Duration::from_millis(50));
            let pid = child.id().to_string();
            assert!(Command::new("kill").args([signal, &pid]).status().unwrap().success());
            assert_eq!(wait(&mut child), Some(code), "{arguments:?} {signal}");
        }
    }
    has_only(dir.path(), &[]);
}

#[test]
fn signals_end_the_work_with_their_code_and_no_file() {
    for (signal, code) in [("-INT", 130), ("-TERM", 143)] {
        let dir = tempdir().unwrap();
        let mut child = started(dir.path());
        let pid = child.id().to_string();
        assert!(Command::new("kill").args([signal, &pid]).status().unwrap().success());
        assert_eq!(wait(&mut child), Some(code));
        let mut err = String::new();
        child.stderr.take().unwrap().read_to_string(&mut err).unwrap();
        Run { code: Some(code), out: String::new(), err }.refused(code, &["run the same command again"]);
        has_only(dir.path(), &[]);
    }
}

#[test]
fn closed_streams_do_not_stop_the_work() {
    for (redirect, code) in [
        (">&-", 0),
        ("2>&-", 0),
        (">&- 2>&-", 0),
        ("2>/dev/full", 0),
        (">/dev/full 2>/dev/full", 74),
        ("> >(true) 2> >(true)", 0),
    ] {
        let dir = tempdir().unwrap();
        let path = dir.path().join("x.png");
        let shell = &mut in_shell("", redirect, render("front", &path).arg("--json"));
        assert_eq!(run(shell).code, Some(code), "{redirect}");
        is_picture(&path);
        has_only(dir.path(), &["x.png"]);
    }
}

#[test]
fn paths_of_every_kind_work() {
    use std::os::unix::ffi::OsStrExt;
    let dir = tempdir().unwrap();
    let odd = [&b"a b.png"[..], b"a\nb.png", b"\xff\xfe.png", "滝.png".as_bytes(), b"a'\"$x.PNG"];
    for name in odd.map(OsStr::from_bytes) {
        run(&mut render("front", dir.path().join(name))).done();
        is_picture(&dir.path().join(name));
    }
    for (argument, name) in [("-o./-x.png", "-x.png"), ("-o=-y.png", "-y.png"), ("-o=z.png", "z.png")] {
        run(taki(["render", "front", argument]).args(TINY).current_dir(&dir)).done();
        is_picture(&dir.path().join(name));
    }
    // The scene's own path may also be odd: its name is in the name of the default picture.
    let scene = dir.path().join(OsStr::from_bytes(b"\xff s.v2.toml"));
    fs::write(&scene, "version = 1\nbase = \"front\"\n").unwrap();
    run(taki(["render"]).arg(&scene).args(TINY).current_dir(&dir)).done();
    is_picture(&dir.path().join("\u{fffd} s.v2.png"));
    assert_eq!(names(dir.path()).len(), odd.len() + 5);
}

#[test]
fn no_home_and_a_folder_that_cannot_be_written_work() {
    let dir = tempdir().unwrap();
    let mut command = render("front", dir.path().join("x.png"));
    run(command.env_remove("HOME").env_remove("XDG_CACHE_HOME").current_dir("/proc")).done();
    has_only(dir.path(), &["x.png"]);
}

#[test]
fn an_error_is_one_line_whatever_the_path_holds() {
    let run = run(&mut render("a\nb\u{1b}[2J.toml", "x.png"));
    run.refused(65, &["no preset and no file"]);
    assert!(!run.err.contains('\u{1b}'), "{:?}", run.err);
}

#[test]
fn only_regular_files_are_read() {
    let (dir, folder) = scene_with_volume("v.npz");
    let fifo = folder.join("v.npz");
    assert!(Command::new("mkfifo").arg(&fifo).status().unwrap().success());
    let out = dir.path().join("x.png");
    for path in [&fifo, &folder, Path::new("/dev/zero")] {
        run(&mut render(path, &out)).refused(65, &["not a regular file"]);
        run(taki(["volume", "info"]).arg(path)).refused(65, &["not a regular file"]);
        let set = format!("volume.file={}", path.display());
        run(render("front", &out).args(["--set", &set])).refused(65, &["not a regular file"]);
    }
    run(&mut render(folder.join("s.toml"), &out)).refused(65, &["not a regular file", "v.npz"]);
    has_only(dir.path(), &["scene"]);
}

#[test]
fn references_stay_in_the_scenes_folder_unless_allowed() {
    let outside = tempdir().unwrap();
    small_volume(&outside.path().join("v.npz"));
    let absolute = outside.path().join("v.npz");
    for (volume, allowed) in [("../v.npz", false), (absolute.to_str().unwrap(), true), ("link.npz", true)] {
        let (dir, folder) = scene_with_volume(volume);
        fs::copy(&absolute, dir.path().join("v.npz")).unwrap();
        std::os::unix::fs::symlink(&absolute, folder.join("link.npz")).unwrap();
        let (scene, out) = (folder.join("s.toml"), dir.path().join("x.png"));
        run(&mut render(&scene, &out)).refused(65, &["volume.file", "leads out", "--allow-path"]);
        has_only(dir.path(), &["scene", "v.npz"]);
        let allow = if allowed { outside.path() } else { dir.path() };
        run(render(&scene, &out).arg("--allow-path").arg(allow)).done();
        is_picture(&out);
    }
    let (dir, folder) = scene_with_volume("v.npz");
    fs::copy(&absolute, folder.join("v.npz")).unwrap();
    run(&mut render(folder.join("s.toml"), dir.path().join("x.png"))).done();
}

#[test]
fn corrupt_volume_files_are_refused() {
    let good = tempdir().unwrap();
    small_volume(&good.path().join("v.npz"));
    let bytes = fs::read(good.path().join("v.npz")).unwrap();
    let mut flipped = bytes.clone();
    flipped[bytes.len() / 3] ^= 0xff;
    let cases: [&[u8]; 5] = [b"", b"PK", &bytes[..bytes.len() / 2], &bytes[1..], &flipped];
    for corrupt in cases {
        let (dir, folder) = scene_with_volume("v.npz");
        fs::write(folder.join("v.npz"), corrupt).unwrap();
        run(&mut render(folder.join("s.toml"), dir.path().join("x.png"))).refused(65, &["v.npz"]);
        has_only(dir.path(), &["scene"]);
    }
}

#[test]
fn sizes_without_measure_are_refused_with_need_and_budget() {
    let dir = tempdir().unwrap();
    let out = dir.path().join("x.png");
    let huge = ["--set=volume.nx=100000", "--set=volume.ny=100000", "--set=volume.nz=100000"];
    let volume = ["100000×100000×100000", "needs 17.8 PiB", "the budget is 4.0 GiB", "--memory"];
    run(render("front", &out).args(huge)).refused(33, &volume);
    let image = ["1000000×1000000", "needs 43.7 TiB", "the budget is 4.0 GiB", "--memory"];
    run(taki(["render", "front", "--size", "1000000x1000000", "-o"]).arg(&out)).refused(33, &image);
    run(render("front", &out).arg("--memory=0")).refused(33, &["the budget is 0 B"]);
    run(taki(["volume", "build", "front", "--memory=1", "--set=volume.storage=dense", "-o"])
        .arg(dir.path().join("v.npz")))
    .refused(33, &["40×40×40", "the budget is 1.0 MiB"]);
    has_only(dir.path(), &[]);
}

#[test]
fn sizes_of_zero_are_refused() {
    let dir = tempdir().unwrap();
    let out = dir.path().join("x.png");
    let zeros = [
        ("--set=image.width=0", "image.width"),
        ("--set=image.samples=0", "image.samples"),
        ("--set=volume.nx=0", "volume.nx"),
        ("--set=curves.deep=0", "curves.deep"),
        ("--set=camera.fov=0", "camera.fov"),
        ("--set=trace.max_cells=0", "trace.max_cells"),
        ("--set=trace.layers=0", "trace.layers"),
    ];
    for (argument, key) in zeros {
        let run = run(taki(["render", "front", argument, "-o"]).arg(&out));
        run.refused(65, &[&format!("{key} = 0"), "allowed: "]);
    }
    for option in ["--size=0x16", "--size=16x0", "--samples=0"] {
        let run = run(taki(["render", "front", option, "-o"]).arg(&out));
        assert_eq!(run.exit_code(), Some(2), "{option}: {run:?}");
    }
    has_only(dir.path(), &[]);
}

#[test]
fn the_same_input_gives_the_same_bytes_on_any_number_of_threads() {
    let dir = tempdir().unwrap();
    let bytes = |threads: &str| {
        ["png", "exr"].map(|extension| {
            let out = dir.path().join(format!("{threads}.{extension}"));
            let sets = ["--set=light.visibility=march", "--set=image.samples=3"];
            run(taki(["render", "front", "--engine=cpu", "--size=33x17", "-o"])
                .arg(&out)
                .args(sets)
                .env("RAYON_NUM_THREADS", threads))
            .done();
            fs::read(out).unwrap()
        })
    };
    let one = bytes("1");
    assert!(one == bytes("3") && one == bytes("3"));
}

#[test]
fn cameras_in_odd_places_see_finite_pictures() {
    // The quad of `front` lies at z = 0.5. The volume reaches 1 m below it.
    let places = [
        ("on the surface", "[0.0, 0.0, 0.5]", "[0.0, 0.0, 0.0]"),
        ("on the surface, along it", "[0.0, 0.0, 0.5]", "[1.0, 0.0, 0.5]"),
        ("inside", "[0.1, 0.2, 0.0]", "[0.0, 0.0, 5.0]"),
        ("on a corner", "[-0.5, -0.5, 0.5]", "[0.5, 0.5, 0.5]"),
        ("along an axis", "[0.0, 0.0, 3.0]", "[0.0, 0.0, 0.0]"),
        ("along a cell's face", "[0.025, 0.025, 3.0]", "[0.025, 0.025, 0.0]"),
        ("behind", "[0.0, 0.0, -3.0]", "[0.0, 0.0, 0.0]"),
        ("far away", "[0.0, 0.0, 1e7]", "[0.0, 0.0, 0.0]"),
        ("far from everything", "[1e7, 1e7, 1e7]", "[1e7, 1e7, 0.0]"),
    ];
    let dir = tempdir().unwrap();
    for (place, eye, target) in places {
        for fov in ["0.01", "170"] {
            let sets =
                [format!("camera.eye={eye}"), format!("camera.target={target}"), format!("camera.fov={fov}")];
            // With an odd size, one ray passes through the exact middle.
            let mut command = taki(["render", "front", "--engine=cpu", "--size=17x17", "--json", "-o"]);
            command.arg(dir.path().join("x.png")).args(sets.map(|s| format!("--set={s}")));
            let json: serde_json::Value = serde_json::from_str(run(&mut command).done()).unwrap();
            assert_eq!(json["non_finite_pixels"], 0, "{place}, fov {fov}: {json}");
            assert_eq!(json["rays"], 17 * 17, "{place}");
        }
    }
}

#[test]
fn scenes_with_nothing_to_see_are_rendered_with_one_warning() {
    let dir = tempdir().unwrap();
    let empty = dir.path().join("empty.toml");
    fs::write(&empty, "version = 1\n").unwrap();
    let dark: &[&str] = &["--set=lights.key.intensity=0", "--set=light.ambient=[0, 0, 0]"];
    let cases: [(&Path, &[&str], &str); 5] = [
        (Path::new("front"), dark, "no light"),
        (Path::new("front"), &["--set=volume.alpha=0"], "the volume is empty"),
        (Path::new("front"), &["--set=curves.across=1", "--set=curves.deep=1", "--seed=1"], ""),
        (&empty, &[], "the scene is empty"),
        (&empty, &dark[1..], "the scene is empty"),
    ];
    for (scene, sets, words) in cases {
        let out = dir.path().join("x.png");
        let run = run(render(scene, &out).args(sets));
        run.done();
        let warnings = run.lines("taki: warning:");
        assert_eq!(warnings.len(), usize::from(!words.is_empty()), "{}", run.err);
        assert!(warnings.iter().all(|line| line.contains(words)), "{}", run.err);
        is_picture(&out);
        fs::remove_file(out).unwrap();
    }
}
