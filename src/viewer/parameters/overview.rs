//! A small picture of the environment beside its parameters.

use std::sync::{Arc, Weak};

use eframe::egui;
use egui::{Color32, ColorImage, Pos2, Sense, Stroke, TextureHandle, TextureOptions, Ui, Vec2};

use super::name;
use crate::light::environment::{Environment, Map};
use crate::picture::resolve::Resolver;
use crate::picture::{Image, Look};

/// Columns and rows.
const SIZE: [usize; 2] = [256, 128];

/// The picture, and what it was made from.
#[derive(Default)]
pub(super) struct Overview {
    made: Option<Made>,
}

struct Made {
    of: Of,
    texture: TextureHandle,
    strongest: Option<[f32; 2]>,
}

/// What the picture depends on.
struct Of {
    /// Weak: a large map that is no longer used is to go.
    map: Weak<Map>,
    numbers: [f32; 2],
    lights: usize,
    sun: Option<[f32; 3]>,
    look: Look,
}

impl Of {
    fn new(environment: &Environment, image: &Image) -> Of {
        Of {
            map: Arc::downgrade(&environment.map),
            numbers: [environment.intensity, environment.turn],
            lights: environment.volume_lights().len(),
            sun: environment.sun.map(|sun| sun.to_sun.to_array()),
            look: image.look,
        }
    }
}

impl PartialEq for Of {
    fn eq(&self, other: &Of) -> bool {
        self.map.ptr_eq(&other.map)
            && (self.numbers, self.lights, self.sun, self.look)
                == (other.numbers, other.lights, other.sun, other.look)
    }
}

impl Overview {
    /// Shows the environment as the background has it, with the picture's exposure and tone.
    pub fn show(&mut self, ui: &mut Ui, environment: &Environment, image: &Image) {
        let of = Of::new(environment, image);
        if self.made.as_ref().is_none_or(|made| made.of != of) {
            let resolver = Resolver::new(&image.look);
            let pixels = environment.overview(SIZE[0], SIZE[1]);
            let pixels = pixels.iter().map(|radiance| {
                let [r, g, b, _] = resolver.pixel(radiance.extend(1.0).to_array());
                Color32::from_rgb(r, g, b)
            });
            let picture = ColorImage::new(SIZE, pixels.collect());
            let texture = ui.ctx().load_texture("environment", picture, TextureOptions::LINEAR);
            self.made = Some(Made { of, texture, strongest: environment.strongest() });
        }
        let Some(made) = &self.made else { return };
        let width = ui.available_width().min(SIZE[0] as f32);
        let (rect, response) = ui.allocate_exact_size(Vec2::new(width, 0.5 * width), Sense::hover());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Environment"));
        name(&response, "Environment");
        let whole = egui::Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
        let painter = ui.painter_at(rect);
        painter.image(made.texture.id(), rect, whole, Color32::WHITE);
        if let Some([u, v]) = made.strongest {
            let at = rect.lerp_inside(Vec2::new(u, v));
            // Seen on white and on black.
            painter.circle_stroke(at, 5.5, Stroke::new(3.0, Color32::from_black_alpha(170)));
            painter.circle_stroke(at, 5.5, Stroke::new(1.5, Color32::WHITE));
        }
        let mark = match (made.strongest, environment.sun) {
            (None, _) => "",
            (_, Some(_)) => "; the ring is the sun",
            (_, None) => "; the ring is its strongest light",
        };
        response.on_hover_text(format!(
            "{}\nIn the middle what is seen looking along −z, +x to its right{mark}.",
            environment.words()
        ));
    }
}
