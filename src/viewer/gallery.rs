//! The gallery of presets. Its thumbnails are rendered when it is first opened.

use std::collections::HashMap;
use std::path::Path;
use std::sync::mpsc::{Receiver, channel};

use eframe::egui;

use super::parameters::name;
use crate::engine::cpu;
use crate::light::Visibility;
use crate::scene::{Limits, Scene, presets};
use crate::util::monitor::Unwatched;

/// Size of a thumbnail, pixels.
const WIDTH: u32 = 192;
const HEIGHT: u32 = 108;
/// Thumbnails in a row.
const COLUMNS: usize = 3;

/// The gallery window.
#[derive(Default)]
pub struct Gallery {
    /// Whether it is shown.
    pub open: bool,
    thumbnails: HashMap<&'static str, egui::TextureHandle>,
    /// Thumbnails of the thread that renders them; `None` until the gallery is opened.
    rendering: Option<Receiver<(&'static str, egui::ColorImage)>>,
}

impl Gallery {
    /// Shows the window. Returns the preset that was chosen.
    pub fn show(&mut self, ctx: &egui::Context) -> Option<&'static str> {
        if !self.open {
            return None;
        }
        self.receive(ctx);
        let mut chosen = None;
        let mut open = self.open;
        let window = egui::Window::new("Scenes").open(&mut open).resizable(false).collapsible(false);
        let middle = ctx.content_rect().center();
        window.pivot(egui::Align2::CENTER_CENTER).default_pos(middle).show(ctx, |ui| {
            let height = (ctx.content_rect().height() - 80.0).max(160.0);
            egui::ScrollArea::vertical().max_height(height).show(ui, |ui| {
                egui::Grid::new("gallery").num_columns(COLUMNS).spacing([12.0, 12.0]).show(ui, |ui| {
                    for (i, (preset, about)) in presets().enumerate() {
                        ui.vertical(|ui| {
                            if self.entry(ui, preset, about) {
                                chosen = Some(preset);
                            }
                        });
                        if i % COLUMNS == COLUMNS - 1 {
                            ui.end_row();
                        }
                    }
                });
            });
        });
        self.open = open && chosen.is_none();
        chosen
    }

    /// Shows one preset: its thumbnail, name and description. Returns whether it was clicked.
    fn entry(&self, ui: &mut egui::Ui, preset: &str, about: &str) -> bool {
        ui.set_width(WIDTH as f32);
        let size = egui::vec2(WIDTH as f32, HEIGHT as f32);
        let response = match self.thumbnails.get(preset) {
            Some(texture) => ui.add_sized(size, egui::Button::image((texture.id(), size)).frame(false)),
            None => ui.add_sized(size, egui::Button::new("…")),
        };
        name(&response, &format!("Open {preset}"));
        let response = response.on_hover_cursor(egui::CursorIcon::PointingHand);
        let clicked = response.on_hover_text(format!("Open {preset}")).clicked();
        ui.strong(preset);
        ui.weak(about);
        clicked
    }

    /// Takes the thumbnails that are ready. Starts the thread that renders them on the first call.
    fn receive(&mut self, ctx: &egui::Context) {
        let rendering = self.rendering.get_or_insert_with(|| {
            let (send, receive) = channel();
            let wake = ctx.clone();
            // If the thread cannot start, the gallery shows grey boxes.
            let _ = std::thread::Builder::new().name("thumbnails".into()).spawn(move || {
                for (preset, _) in presets() {
                    let Some(image) = thumbnail(preset) else { continue };
                    if send.send((preset, image)).is_err() {
                        return;
                    }
                    wake.request_repaint();
                }
            });
            receive
        });
        while let Ok((preset, image)) = rendering.try_recv() {
            self.thumbnails.insert(preset, ctx.load_texture(preset, image, egui::TextureOptions::LINEAR));
        }
    }
}

/// Renders a preset at the gallery's size and aspect, on the CPU: the picture is small, and the GPU stays
/// free for the renderer. Light volumes are replaced by light rays: for so few pixels, filling them would
/// take longer than the rays that they save.
fn thumbnail(preset: &str) -> Option<egui::ColorImage> {
    let mut sets =
        vec![format!("image.width={WIDTH}"), format!("image.height={HEIGHT}"), "image.samples=3".into()];
    let limits = Limits::default();
    let mut scene = Scene::load(Path::new(preset), &sets, &limits).ok()?;
    if scene.visibility == Visibility::Cached {
        sets.push("light.visibility=march".into());
        scene = Scene::load(Path::new(preset), &sets, &limits).ok()?;
    }
    let volumes = scene.volumes(limits.memory, &Unwatched).ok()?;
    let frame = cpu::render(&scene, &volumes, &scene.mesh(), false, &Unwatched).ok()?;
    Some(egui::ColorImage::from_rgba_unmultiplied(
        [frame.width as usize, frame.height as usize],
        bytemuck::cast_slice(&frame.picture),
    ))
}
