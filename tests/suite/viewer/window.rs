//! A real window on a virtual display with a real mouse: `taki view` as a user starts it.
//!
//! Needs Xvfb and xdotool, which `tests/run` installs.

use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use tempfile::TempDir;

const SIZE: [u32; 2] = [900, 560];
/// A window opens within seconds, even on software Vulkan.
const LONGEST: Duration = Duration::from_secs(60);
/// Middle of the picture, right of the parameters.
const PICTURE: [u32; 2] = [620, 320];

/// A process that does not outlive its test.
struct Owned(Child);

impl Drop for Owned {
    fn drop(&mut self) {
        // The process may have ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A display of its own with a viewer on it.
struct Desk {
    viewer: Owned,
    name: String,
    window: String,
    folder: TempDir,
    _server: Owned,
}

fn has(program: &str) -> bool {
    let found =
        Command::new(program).arg("-version").stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok();
    assert!(
        found || std::env::var_os("CI").is_none(),
        "continuous integration needs {program}: see tests/run"
    );
    if !found {
        eprintln!("not run: there is no {program} (tests/run installs it)");
    }
    found
}

/// Starts a server on a free display. Returns it with the display's name.
fn server() -> (Owned, String) {
    let mut server = Command::new("Xvfb")
        // Without -noreset the server restarts when xdotool leaves, and refuses the viewer meanwhile.
        .args(["-displayfd", "1", "-screen", "0", "1280x800x24", "-nolisten", "tcp", "-noreset"])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("Xvfb starts");
    let out = server.stdout.take().expect("a pipe");
    let server = Owned(server);
    let mut number = String::new();
    BufReader::new(out).read_line(&mut number).expect("a display");
    (server, format!(":{}", number.trim()))
}

impl Desk {
    /// Opens a viewer with these arguments. Returns `None` if a program is missing.
    fn open(arguments: &[&str]) -> Option<Desk> {
        if !(has("Xvfb") && has("xdotool")) {
            return None;
        }
        let (server, name) = server();
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::create_dir(folder.path().join("taki")).expect("a folder");
        let settings =
            format!(r#"{{"window": [{}, {}], "position": [0, 0], "refine_to": 1}}"#, SIZE[0], SIZE[1]);
        std::fs::write(folder.path().join("taki/viewer.json"), settings).expect("written");
        let viewer = Command::new(env!("CARGO_BIN_EXE_taki"))
            .args(["view", "fig5", "--json"])
            .args(
                ["image.width=160", "image.height=90", "image.samples=1"]
                    .iter()
                    .flat_map(|set| ["--set", set]),
            )
            .args(arguments)
            .current_dir(folder.path())
            .env("DISPLAY", &name)
            .env("XDG_CONFIG_HOME", folder.path())
            .env("XDG_CACHE_HOME", env!("CARGO_TARGET_TMPDIR"))
            .env_remove("WAYLAND_DISPLAY")
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the viewer starts");
        let mut desk = Desk { viewer: Owned(viewer), name, window: String::new(), folder, _server: server };
        let start = Instant::now();
        while desk.window.is_empty() {
            assert!(start.elapsed() < LONGEST, "no window came");
            if let Some(status) = desk.viewer.0.try_wait().expect("a process") {
                panic!("the viewer ended with {status}: {}", desk.end().1);
            }
            std::thread::sleep(Duration::from_millis(100));
            desk.window = desk
                .xdotool(&["search", "--onlyvisible", "--name", "taki"])
                .lines()
                .next()
                .unwrap_or_default()
                .into();
        }
        Some(desk)
    }

    /// Output of xdotool.
    fn xdotool(&self, words: &[&str]) -> String {
        let out =
            Command::new("xdotool").args(words).env("DISPLAY", &self.name).output().expect("xdotool runs");
        String::from_utf8_lossy(&out.stdout).into_owned()
    }

    fn drag(&self, from: [u32; 2], by: [i32; 2]) {
        let [x, y] = from.map(|x| x.to_string());
        self.xdotool(&["mousemove", &x, &y, "mousedown", "1"]);
        for _ in 0..6 {
            let [dx, dy] = by.map(|x| (x / 6).to_string());
            self.xdotool(&["mousemove_relative", "--sync", "--", &dx, &dy]);
            std::thread::sleep(Duration::from_millis(60));
        }
        self.xdotool(&["mouseup", "1"]);
    }

    fn key(&self, key: &str) {
        // No window manager runs that would give the keyboard focus to a new window.
        self.xdotool(&["windowfocus", &self.window, "key", key]);
        std::thread::sleep(Duration::from_millis(150));
    }

    fn title(&self) -> String {
        self.xdotool(&["getwindowname", &self.window])
    }

    /// Waits until the title says that the scene has changed.
    fn until_changed(&self, what: &str) {
        let start = Instant::now();
        while !self.title().starts_with('•') {
            assert!(start.elapsed() < LONGEST, "{what}: the title is {:?}", self.title());
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Waits until the viewer ends. Returns its exit code and its output.
    fn end(&mut self) -> (Option<i32>, String) {
        let start = Instant::now();
        let code = loop {
            if let Some(status) = self.viewer.0.try_wait().expect("a process") {
                break status.code();
            }
            assert!(start.elapsed() < LONGEST, "the viewer does not end");
            std::thread::sleep(Duration::from_millis(50));
        };
        let mut said = String::new();
        if let Some(mut out) = self.viewer.0.stdout.take() {
            out.read_to_string(&mut said).expect("text");
        }
        if let Some(mut err) = self.viewer.0.stderr.take() {
            err.read_to_string(&mut said).expect("text");
        }
        assert!(!said.contains("panicked"), "{said}");
        (code, said)
    }
}

/// Number of different colours in a part of a picture, at 5 bits per channel.
fn colours(width: u32, pixels: &[[f32; 3]], from: [u32; 2], to: [u32; 2]) -> usize {
    let mut seen = std::collections::BTreeSet::new();
    for y in from[1]..to[1] {
        for x in from[0]..to[0] {
            seen.insert(pixels[(y * width + x) as usize].map(|c| (c * 31.0) as u8));
        }
    }
    seen.len()
}

#[test]
fn a_window_is_worked_with_mouse_and_keys_and_leaves_a_screenshot_and_its_measurements() {
    let arguments = ["--exit-after", "14", "--screenshot", "shot.png"];
    let Some(mut desk) = Desk::open(&arguments) else { return };
    desk.until_changed("values set on the command line are changes");
    std::thread::sleep(Duration::from_millis(1500));
    desk.drag(PICTURE, [60, 12]);
    let [x, y] = PICTURE.map(|x| x.to_string());
    desk.xdotool(&["mousemove", &x, &y, "click", "4", "click", "4", "click", "5"]);
    desk.drag([180, 150], [48, 0]);
    desk.key("2");
    desk.key("1");
    desk.key("space");
    std::thread::sleep(Duration::from_millis(400));
    desk.key("space");
    desk.key("ctrl+z");
    let shot = desk.folder.path().join("shot.png");
    let (code, said) = desk.end();
    assert_eq!(code, Some(0), "{said}");
    let json = said.lines().find(|line| line.starts_with('{')).unwrap_or_else(|| panic!("no JSON: {said}"));
    let json: serde_json::Value = serde_json::from_str(json).expect("JSON");
    assert!(json["pictures"].as_u64().expect("pictures") >= 8, "{json}");
    assert!(json["frames"].as_u64().expect("frames") >= 20 && json["first_picture_ms"].is_number(), "{json}");
    let (width, height, pixels) = taki::output::frame::read_png(&shot).expect("a screenshot");
    assert_eq!([width, height], SIZE);
    assert!(colours(width, &pixels, [0, 0], SIZE) > 60, "not blank");
    let [low, high] = [[PICTURE[0] - 100, PICTURE[1] - 60], [PICTURE[0] + 100, PICTURE[1] + 60]];
    assert!(colours(width, &pixels, low, high) > 12, "a picture is in its place");
    let kept = std::fs::read_to_string(desk.folder.path().join("taki/viewer.json")).expect("settings");
    assert!(serde_json::from_str::<serde_json::Value>(&kept).is_ok(), "{kept}");
    assert!(leftovers(desk.folder.path()).is_empty(), "{:?}", leftovers(desk.folder.path()));
}

/// Files that were not asked for.
fn leftovers(folder: &Path) -> Vec<std::ffi::OsString> {
    let files = std::fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("a file").file_name());
    files.filter(|name| name != "taki" && name != "shot.png").collect()
}

#[test]
fn a_window_without_changes_closes_when_asked_and_one_with_changes_asks_first() {
    let Some(mut desk) = Desk::open(&[]) else { return };
    desk.until_changed("values set on the command line are changes");
    std::thread::sleep(Duration::from_millis(1500));
    let [x, y] = PICTURE.map(|x| x.to_string());
    desk.xdotool(&["mousemove", &x, &y]);
    desk.key("ctrl+q");
    std::thread::sleep(Duration::from_millis(1000));
    assert!(desk.viewer.0.try_wait().expect("a process").is_none(), "unsaved changes are asked about");
    // After a save under the proposed name, nothing is left to ask about.
    let start = Instant::now();
    while desk.title().starts_with('•') {
        assert!(start.elapsed() < LONGEST, "not saved: the title is {:?}", desk.title());
        // A frame of a software GPU takes long on a busy machine, so the dialog may not be open yet.
        desk.key("Escape");
        desk.key("ctrl+s");
        std::thread::sleep(Duration::from_millis(800));
        desk.key("Return");
        std::thread::sleep(Duration::from_millis(800));
    }
    assert!(desk.folder.path().join("fig5.toml").is_file());
    desk.key("ctrl+q");
    let (code, said) = desk.end();
    assert_eq!(code, Some(0), "{said}");
}

#[test]
fn a_window_whose_device_is_lost_is_opened_anew_with_its_scene() {
    if crate::engine::gpu::renderer("a lost window").is_none() {
        return;
    }
    let arguments = [
        ["--window", "wgpu"],
        ["--lose-window-after", "2"],
        ["--exit-after", "5"],
        ["--screenshot", "shot.png"],
    ];
    let Some(mut desk) = Desk::open(arguments.as_flattened()) else { return };
    let (code, said) = desk.end();
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("the window is reopened"), "{said}");
    // The second window shows the scene with the changes of the command line.
    let shot = desk.folder.path().join("shot.png");
    let (width, height, pixels) = taki::output::frame::read_png(&shot).expect("a screenshot");
    assert_eq!([width, height], SIZE);
    let [low, high] = [[PICTURE[0] - 100, PICTURE[1] - 60], [PICTURE[0] + 100, PICTURE[1] + 60]];
    assert!(colours(width, &pixels, low, high) > 12, "a picture is in its place");
}

#[test]
fn an_interrupted_window_closes_with_the_signals_own_code() {
    for (signal, code) in [("-INT", 130), ("-TERM", 143)] {
        let Some(mut desk) = Desk::open(&[]) else { return };
        desk.until_changed("values set on the command line are changes");
        let pid = desk.viewer.0.id().to_string();
        assert!(Command::new("kill").args([signal, &pid]).status().expect("kill runs").success());
        let (ended, said) = desk.end();
        assert_eq!(ended, Some(code), "{said}");
        assert!(said.contains("interrupted"), "{said}");
    }
}
