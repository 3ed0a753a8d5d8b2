//! The viewer, driven without a window. Tests find widgets by the names that screen readers read, send keys
//! and pointer events as a window does, and check the document and the picture.

mod costs;
mod files;
mod hand;
mod handles;
mod kept;
mod lights;
mod lobes;
mod look;
mod looking;
mod mesh_handles;
mod meshes;
mod overview;
mod picture;
mod projection;
mod soak;
mod volumes;
mod widgets;
#[cfg(target_os = "linux")]
mod window;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use eframe::egui::{self, Key, Modifiers, Pos2, Rect, Role, Vec2, pos2};
use egui_kittest::{Harness, HarnessBuilder, Node, kittest::NodeT, kittest::Queryable};
use taki::engine::EngineChoice;
use taki::engine::gpu::DeviceOptions;
use taki::scene::{Limits, Raw, Value};
use taki::viewer::worker::Picture;
use taki::viewer::{Loss, Options, Viewer, metrics};
use tempfile::TempDir;

/// Longest time to wait for a picture. With so few pixels it takes milliseconds, so a picture that takes this
/// long hangs.
const LONGEST: Duration = Duration::from_secs(60);

/// A scene of eight quads, four rocks and a light, all of them coarse.
pub const SCENE: &str = r#"
version = 1
base = "fig5"
[curves]
across = 6
deep = 6
[volume]
nx = 16
ny = 16
nz = 16
[rocks]
wall.levels = 3
left.levels = 3
right.levels = 3
foot.levels = 3
[trace]
attenuation = "path-length"
sigma = 3.0
[image]
width = 160
height = 90
samples = 1
"#;

/// Aspect ratio of the scene's image.
const ASPECT: f32 = 160.0 / 90.0;

/// Settings of a window that a test may choose.
pub struct Setup {
    pub scene: String,
    pub settings: String,
    pub engine: EngineChoice,
    pub device: DeviceOptions,
    pub sets: Vec<String>,
    pub memory: Option<u64>,
    pub size: [f32; 2],
}

impl Default for Setup {
    fn default() -> Self {
        Setup {
            scene: SCENE.into(),
            // One sample per pixel, because these tests need no more than the first.
            settings: r#"{"refine_to": 1}"#.into(),
            engine: EngineChoice::Cpu,
            device: DeviceOptions::default(),
            sets: Vec::new(),
            memory: None,
            size: [620.0, 420.0],
        }
    }
}

impl Setup {
    /// A window that hides the parameters beside the picture.
    pub fn bare() -> Setup {
        Setup {
            settings: r#"{"refine_to": 1, "parameters": false}"#.into(),
            size: [240.0, 240.0],
            ..Setup::default()
        }
    }

    pub fn open(self) -> Window {
        self.open_with(|builder| builder)
    }

    pub fn open_with(self, more: impl FnOnce(HarnessBuilder<Viewer>) -> HarnessBuilder<Viewer>) -> Window {
        let folder = tempfile::tempdir().expect("a folder");
        let scene = folder.path().join("small.toml");
        std::fs::write(&scene, &self.scene).expect("written");
        std::fs::write(folder.path().join("viewer.json"), &self.settings).expect("written");
        let mut limits = Limits::default();
        limits.memory = self.memory.unwrap_or(limits.memory);
        let options = Options {
            sets: self.sets,
            limits,
            engine: self.engine,
            device: self.device,
            ..options(&scene, &folder.path().join("viewer.json"))
        };
        Window::new(folder, options, self.size, more)
    }
}

fn options(scene: &Path, settings: &Path) -> Options {
    Options {
        scene: scene.to_owned(),
        sets: Vec::new(),
        limits: Limits::default(),
        window: Default::default(),
        engine: EngineChoice::Cpu,
        device: DeviceOptions::default(),
        settings: Some(settings.to_owned()),
        signal: Default::default(),
        exit_after: None,
        screenshot: None,
        measure: false,
        lose_window_after: None,
    }
}

/// A viewer, with the folder of its scene and settings.
pub struct Window {
    pub harness: Harness<'static, Viewer>,
    pub folder: TempDir,
}

impl Window {
    fn new(
        folder: TempDir,
        options: Options,
        size: [f32; 2],
        more: impl FnOnce(HarnessBuilder<Viewer>) -> HarnessBuilder<Viewer>,
    ) -> Window {
        let builder = Harness::builder().with_size(size).with_pixels_per_point(1.0);
        let harness = more(builder).build_eframe(|context| {
            let measured = metrics::Shared::default();
            Viewer::new(&context.egui_ctx, options, measured, Loss::default()).expect("a valid scene")
        });
        let mut window = Window { harness, folder };
        window.settle();
        window
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Draws frames until the current picture is shown.
    pub fn settle(&mut self) {
        self.until("the picture", |viewer| viewer.is_settled());
        // This frame shows the render thread's last result.
        self.harness.run_steps(2);
        if !self.viewer().is_settled() {
            self.settle();
        }
    }

    /// Draws frames until `done` returns true.
    #[track_caller]
    pub fn until(&mut self, what: &str, done: impl Fn(&Viewer) -> bool) {
        let start = Instant::now();
        loop {
            self.harness.step();
            if done(self.viewer()) {
                return;
            }
            assert!(start.elapsed() < LONGEST, "{what} did not come");
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    pub fn viewer(&self) -> &Viewer {
        self.harness.state()
    }

    pub fn picture(&self) -> &Picture {
        self.viewer().picture().expect("a picture")
    }

    pub fn value(&self, key: &str) -> Value {
        self.viewer().document().values().get(key)
    }

    pub fn float(&self, key: &str) -> f64 {
        f64::from(self.viewer().document().values().float(key))
    }

    pub fn point(&self, key: &str) -> glam::DVec3 {
        self.viewer().document().values().point(key)
    }

    pub fn set(&mut self, key: &str, raw: Raw) {
        self.harness.state_mut().document_mut().set(key, &raw, None).expect("a value the table allows");
    }

    pub fn key(&mut self, key: Key) {
        self.chord(Modifiers::NONE, key);
    }

    pub fn chord(&mut self, modifiers: Modifiers, key: Key) {
        self.harness.key_press_modifiers(modifiers, key);
        self.harness.run_steps(2);
    }

    pub fn undo(&mut self) {
        self.chord(Modifiers::COMMAND, Key::Z);
    }

    pub fn redo(&mut self) {
        self.chord(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    }

    /// The only widget of this role and name, even if it is scrolled out of view.
    #[track_caller]
    pub fn widget<'a>(&'a self, role: Role, label: &'a str) -> Node<'a> {
        self.harness.get_by_role_and_label(role, label)
    }

    /// Names of all widgets of a role, in the order of the window.
    pub fn names(&self, role: Role) -> Vec<String> {
        let nodes = self.harness.root().children_recursive();
        nodes
            .map(|node| node.accesskit_node())
            .filter(|node| node.role() == role)
            .filter_map(|node| node.label())
            .collect()
    }

    /// Chooses an option of a combo box as a user does: opens the box, then clicks the option.
    #[track_caller]
    pub fn choose(&mut self, combo: &str, option: &str) {
        self.widget(Role::ComboBox, combo).click_accesskit();
        self.harness.run_steps(2);
        let found = self.harness.root().children_recursive().filter(|node| {
            let node = node.accesskit_node();
            node.role() == Role::Button && node.label().as_deref() == Some(option)
        });
        let found: Vec<_> = found.collect();
        assert_eq!(found.len(), 1, "{option} in {combo}");
        found[0].click_accesskit();
        drop(found);
        self.harness.run_steps(2);
        // The click of a screen reader leaves the list open.
        if self.names(Role::Button).iter().any(|name| name == option) {
            self.widget(Role::ComboBox, combo).click_accesskit();
            self.harness.run_steps(2);
        }
    }

    /// Types into a field and leaves the field.
    #[track_caller]
    pub fn enter(&mut self, field: &str, text: &str) {
        self.widget(Role::TextInput, field).set_text_value_accesskit(text);
        self.harness.run_steps(2);
    }

    /// Whether the window shows a text.
    pub fn reads(&self, text: &str) -> bool {
        self.harness.query_all_by_label_contains(text).next().is_some()
    }

    #[track_caller]
    pub fn press(&mut self, label: &str) {
        self.widget(Role::Button, label).click_accesskit();
        // A banner or window is measured in its first frame and shown in its second.
        self.harness.run_steps(4);
    }

    /// Rectangle of the picture in the window.
    pub fn image_rect(&self) -> Rect {
        let outer = self.harness.get_by_label("Picture").rect();
        let [width, height] =
            [outer.width().min(outer.height() * ASPECT), outer.height().min(outer.width() / ASPECT)];
        Rect::from_center_size(outer.center(), egui::vec2(width, height))
    }

    /// Drags the pointer, frame by frame.
    pub fn drag(&mut self, from: Pos2, by: Vec2, modifiers: Modifiers) {
        self.press_at(from, modifiers);
        for part in 1..=4 {
            self.harness.hover_at(from + by * (part as f32 / 4.0));
            self.harness.step();
        }
        self.release_at(from + by, modifiers);
    }

    pub fn press_at(&mut self, at: Pos2, modifiers: Modifiers) {
        self.harness.event(egui::Event::ModifiersChanged(modifiers));
        self.harness.hover_at(at);
        self.pointer(at, true, modifiers);
    }

    pub fn release_at(&mut self, at: Pos2, modifiers: Modifiers) {
        self.pointer(at, false, modifiers);
        self.harness.event(egui::Event::ModifiersChanged(Modifiers::NONE));
        self.harness.run_steps(2);
    }

    fn pointer(&mut self, pos: Pos2, pressed: bool, modifiers: Modifiers) {
        let button = egui::PointerButton::Primary;
        self.harness.event(egui::Event::PointerButton { pos, button, pressed, modifiers });
        self.harness.step();
    }
}
