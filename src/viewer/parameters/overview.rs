//! The overview: a small picture of the environment below its parameters.

use std::sync::{Arc, Weak};

use eframe::egui;
use egui::{Color32, ColorImage, Pos2, Sense, Stroke, TextureHandle, TextureOptions, Ui, Vec2};

use super::name;
use crate::light::environment::{Environment, Map};
use crate::picture::resolve::Resolver;
use crate::picture::{Image, Look};

/// Columns and rows of the picture.
const SIZE: [usize; 2] = [256, 128];

/// The overview of the environment, drawn again when the environment or the look of the picture changes.
#[derive(Default)]
pub(super) struct Overview {
    cached: Option<OverviewCache>,
}

struct OverviewCache {
    key: OverviewKey,
    texture: TextureHandle,
    /// Position of the sun or the strongest light, 0 to 1.
    strongest: Option<[f32; 2]>,
}

/// Everything that the picture depends on.
struct OverviewKey {
    /// A weak reference does not keep a large unused map alive.
    map: Weak<Map>,
    intensity_and_turn: [f32; 2],
    lights: usize,
    sun: Option<[f32; 3]>,
    look: Look,
}

impl OverviewKey {
    fn new(environment: &Environment, image: &Image) -> OverviewKey {
        OverviewKey {
            map: Arc::downgrade(&environment.map),
            intensity_and_turn: [environment.intensity, environment.turn],
            lights: environment.volume_lights().len(),
            sun: environment.sun.map(|sun| sun.to_sun.to_array()),
            look: image.look,
        }
    }
}

impl PartialEq for OverviewKey {
    fn eq(&self, other: &OverviewKey) -> bool {
        self.map.ptr_eq(&other.map)
            && self.intensity_and_turn == other.intensity_and_turn
            && (self.lights, self.sun, self.look) == (other.lights, other.sun, other.look)
    }
}

impl Overview {
    /// Shows the environment as the background shows it, with the picture's exposure and tone.
    pub fn show(&mut self, ui: &mut Ui, environment: &Environment, image: &Image) {
        let key = OverviewKey::new(environment, image);
        if self.cached.as_ref().is_none_or(|cached| cached.key != key) {
            let resolver = Resolver::new(&Look { grain: 0.0, ..image.look });
            let pixels = environment.overview(SIZE[0], SIZE[1]);
            let pixels = pixels.iter().zip(0..).map(|(radiance, i)| {
                let at = [i % SIZE[0] as u32, i / SIZE[0] as u32];
                let [r, g, b, _] = resolver.pixel(radiance.extend(1.0).to_array(), at);
                Color32::from_rgb(r, g, b)
            });
            let picture = ColorImage::new(SIZE, pixels.collect());
            let texture = ui.ctx().load_texture("environment", picture, TextureOptions::LINEAR);
            self.cached = Some(OverviewCache { key, texture, strongest: environment.strongest() });
        }
        let Some(cached) = &self.cached else { return };
        let width = ui.available_width().min(SIZE[0] as f32);
        let (rect, response) = ui.allocate_exact_size(Vec2::new(width, 0.5 * width), Sense::hover());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Environment"));
        name(&response, "Environment");
        let whole = egui::Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
        let painter = ui.painter_at(rect);
        painter.image(cached.texture.id(), rect, whole, Color32::WHITE);
        if let Some([u, v]) = cached.strongest {
            let at = rect.lerp_inside(Vec2::new(u, v));
            // The ring is visible on white and on black.
            painter.circle_stroke(at, 5.5, Stroke::new(3.0, Color32::from_black_alpha(170)));
            painter.circle_stroke(at, 5.5, Stroke::new(1.5, Color32::WHITE));
        }
        let mark = match (cached.strongest, environment.sun) {
            (None, _) => "",
            (_, Some(_)) => ". The ring marks the sun",
            (_, None) => ". The ring marks the strongest light",
        };
        response.on_hover_text(format!(
            "{}\nThe middle is the view along −z, with +x to its right{mark}.",
            environment.words()
        ));
    }
}
