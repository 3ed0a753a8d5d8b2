//! One plane of cells as a picture, in which the user clicks and drags to choose a cell.

use eframe::egui::{
    self, Color32, ColorImage, Pos2, Rect, Sense, Stroke, TextureHandle, TextureOptions, Vec2,
};

use super::{Quantity, axis_colour};
use crate::viewer::layer_image::{direction_colour, sequential};
use crate::volume::{Cell, VolumeTexture};

/// Axes that point right and down in the plane across each axis. y points down, as the water flows. z, into
/// the surface, points right in the side view and down in the top view.
pub(super) const PLANES: [[usize; 2]; 3] = [[2, 1], [0, 2], [0, 1]];

/// Colour of a cell that no curve passes through.
pub(super) fn empty_colour(dark_mode: bool) -> [u8; 3] {
    if dark_mode { [46, 47, 51] } else { [178, 180, 186] }
}

/// The picture of one plane, drawn again when its contents change.
#[derive(Default)]
pub(super) struct Slice {
    texture: Option<TextureHandle>,
    /// Plane, quantity and dark mode of the texture.
    key: Option<(u32, Quantity, bool)>,
}

impl Slice {
    /// Shows the plane across `axis` through `cell`, with `scale` points per cell. A click or drag moves
    /// `cell` within the plane.
    pub(super) fn show(
        &mut self,
        ui: &mut egui::Ui,
        volume: &VolumeTexture,
        axis: usize,
        quantity: Quantity,
        cell: &mut [u32; 3],
        scale: f32,
    ) {
        let [right, down] = PLANES[axis];
        let cells = Vec2::new(volume.size[right] as f32, volume.size[down] as f32);
        let (rect, response) = ui.allocate_exact_size(cells * scale, Sense::click_and_drag());
        let name = ["x", "y", "z"][axis];
        response.widget_info(|| {
            egui::WidgetInfo::labeled(egui::Role::Image, true, format!("Slice across {name}"))
        });
        let at = |mut at: [u32; 3], p: Pos2| {
            let q = (p - rect.min) / scale;
            let inside = |x: f32, n: u32| (x.max(0.0) as u32).min(n - 1);
            at[right] = inside(q.x, volume.size[right]);
            at[down] = inside(q.y, volume.size[down]);
            at
        };
        if (response.dragged() || response.clicked())
            && let Some(pointer) = response.interact_pointer_pos()
        {
            *cell = at(*cell, pointer);
        }
        let hovered = response.hover_pos().filter(|_| !response.dragged()).map(|p| at(*cell, p));
        if ui.is_rect_visible(rect) {
            let texture = self.texture(ui, volume, axis, quantity, cell[axis]);
            let whole = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
            ui.painter().image(texture, rect, whole, Color32::WHITE);
            self.lines(ui, rect, axis, cell, scale);
        }
        let response = response.on_hover_cursor(egui::CursorIcon::Crosshair);
        if let Some(cell) = hovered {
            response.on_hover_text_at_pointer(cell_text(volume, cell));
        }
    }

    fn texture(
        &mut self,
        ui: &egui::Ui,
        volume: &VolumeTexture,
        axis: usize,
        quantity: Quantity,
        plane: u32,
    ) -> egui::TextureId {
        let key = (plane, quantity, ui.visuals().dark_mode);
        if let Some(texture) = &self.texture
            && self.key == Some(key)
        {
            return texture.id();
        }
        self.key = Some(key);
        let image = picture(volume, axis, plane, quantity, empty_colour(key.2));
        match &mut self.texture {
            Some(texture) => {
                texture.set(image, TextureOptions::NEAREST);
                texture.id()
            }
            None => {
                let name = format!("slice {axis}");
                let texture = ui.ctx().load_texture(name, image, TextureOptions::NEAREST);
                self.texture.insert(texture).id()
            }
        }
    }

    /// Draws a frame in the colour of the axis, and the intersections with the other two planes in theirs.
    fn lines(&self, ui: &egui::Ui, rect: Rect, axis: usize, cell: &[u32; 3], scale: f32) {
        let [right, down] = PLANES[axis];
        let colour = |axis: usize| axis_colour(axis, ui.visuals().dark_mode);
        let painter = ui.painter_at(rect.expand(2.0));
        let x = rect.left() + (cell[right] as f32 + 0.5) * scale;
        let y = rect.top() + (cell[down] as f32 + 0.5) * scale;
        // A dark line under the coloured one makes it visible on every colour of the map.
        for (width, dim) in [(3.0, true), (1.0, false)] {
            let stroke =
                |axis| Stroke::new(width, if dim { Color32::from_black_alpha(110) } else { colour(axis) });
            painter.vline(x, rect.y_range(), stroke(right));
            painter.hline(rect.x_range(), y, stroke(down));
        }
        painter.rect_stroke(rect, 0.0, Stroke::new(1.5, colour(axis)), egui::StrokeKind::Outside);
    }
}

/// Draws plane number `plane` across `axis`, with one pixel per cell.
fn picture(
    volume: &VolumeTexture,
    axis: usize,
    plane: u32,
    quantity: Quantity,
    empty: [u8; 3],
) -> ColorImage {
    let [right, down] = PLANES[axis];
    let size = [volume.size[right], volume.size[down]];
    let mut at = [plane; 3];
    let mut pixels = Vec::with_capacity(size[0] as usize * size[1] as usize);
    // ρ and k are drawn with 256 steps, so their colours are tabulated.
    let table: Vec<[u8; 3]> = (0..=255).map(|i| sequential(i as f32 / 255.0)).collect();
    for y in 0..size[1] {
        for x in 0..size[0] {
            at[right] = x;
            at[down] = y;
            let cell = volume.cell(at[0], at[1], at[2]);
            let [r, g, b] = if cell.has_direction() { colour(cell, quantity, &table) } else { empty };
            pixels.push(Color32::from_rgb(r, g, b));
        }
    }
    ColorImage::new(size.map(|n| n as usize), pixels)
}

fn colour(cell: Cell, quantity: Quantity, table: &[[u8; 3]]) -> [u8; 3] {
    match quantity {
        Quantity::Rho => table[(cell.rho_code() >> 8) as usize],
        Quantity::V => direction_colour(cell.v().to_array()),
        Quantity::KD => table[cell.k_codes().0 as usize],
        Quantity::KS => table[cell.k_codes().1 as usize],
    }
}

/// A cell's values as text.
pub(super) fn cell_text(volume: &VolumeTexture, [x, y, z]: [u32; 3]) -> String {
    let cell = volume.cell(x, y, z);
    if !cell.has_direction() {
        return format!("cell ({x}, {y}, {z})\nno flow");
    }
    let v = cell.v();
    let (k_d, k_s) = cell.k();
    format!(
        "cell ({x}, {y}, {z})\nρ {:.3}\nv ({:.2}, {:.2}, {:.2})\nk_d {k_d:.2}  k_s {k_s:.2}",
        cell.rho() * volume.alpha,
        v.x,
        v.y,
        v.z
    )
}
