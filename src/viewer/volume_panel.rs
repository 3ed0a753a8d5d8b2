//! The volume inspector: three slices through the cells, the histogram of ρ, and statistics compared to
//! theory.

mod figures;
mod histogram;
mod slice;

use std::sync::{Arc, OnceLock};

use eframe::egui::{self, Color32, RichText};

use crate::volume::{RhoHistogram, Statistics, VolumeTexture};
use slice::Slice;

/// Steps between 0 and α in the histogram. With few steps, each bar is tall enough to see beside the bars of
/// the clamped ends, which hold eight times as many cells.
const BINS: usize = 10;
/// Most cells that are counted within a frame, which takes a few milliseconds. A larger volume than 64³ is
/// counted on another thread.
const COUNT_AT_ONCE: usize = 1 << 18;
/// Smallest width of a panel with the three slices in one row, points.
const ROW_WIDTH: f32 = 620.0;
/// Smallest width of a panel with a title and its key on one line, points.
const ONE_LINE_WIDTH: f32 = 350.0;
/// Smallest width of a slice whose caption names its directions, points.
const FULL_CAPTION_WIDTH: f32 = 115.0;
/// Smallest width and height of the sliders beside slices, points.
const SLIDERS_BESIDE: f32 = 150.0;
/// Largest height of all slices together, points.
const MAX_HEIGHT: f32 = 430.0;
/// Gap between slices, points.
const GAP: f32 = 8.0;

/// The quantity that the slices show.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Quantity {
    #[default]
    Rho,
    V,
    KD,
    KS,
}

impl Quantity {
    const ALL: [(Quantity, &str); 4] =
        [(Quantity::Rho, "ρ"), (Quantity::V, "v"), (Quantity::KD, "k_d"), (Quantity::KS, "k_s")];
}

/// The volume inspector. It keeps the cell in which its three planes meet, their pictures, and the
/// statistics.
#[derive(Default)]
pub struct VolumePanel {
    volume: Option<VolumeTexture>,
    /// x, y and z of the cell in which the three planes meet.
    cell: [u32; 3],
    quantity: Quantity,
    slices: [Slice; 3],
    counts: Arc<OnceLock<Counts>>,
}

/// Statistics over all cells.
struct Counts {
    statistics: Statistics,
    rho: RhoHistogram,
}

impl VolumePanel {
    /// Shows `volume`. A new volume (by the address of its cells) is counted again. The planes stay where
    /// they are if its size is the same.
    pub fn show(&mut self, ui: &mut egui::Ui, volume: &VolumeTexture) {
        self.set_volume(ui.ctx(), volume);
        self.selector(ui, volume);
        ui.add_space(2.0);
        let size = volume.size.map(|n| n as f32);
        let width = ui.available_width();
        if width >= ROW_WIDTH {
            self.row(ui, volume, size, width);
        } else {
            self.three_views(ui, volume, size, width);
        }
        ui.add_space(8.0);
        match self.counts.get() {
            Some(counts) => {
                histogram::show(ui, counts);
                ui.add_space(8.0);
                figures::show(ui, &counts.statistics);
            }
            None => {
                ui.horizontal(|ui| {
                    ui.spinner();
                    ui.label("Counting cells …");
                });
            }
        }
    }

    /// x, y and z of the cell in which the three planes meet.
    pub fn cell(&self) -> [u32; 3] {
        self.cell
    }

    fn set_volume(&mut self, ctx: &egui::Context, volume: &VolumeTexture) {
        let is_last = |last: &VolumeTexture| last.cells.same(&volume.cells) && last.alpha == volume.alpha;
        if self.volume.as_ref().is_some_and(is_last) {
            return;
        }
        if self.volume.as_ref().is_none_or(|last| last.size != volume.size) {
            self.cell = volume.size.map(|n| n / 2);
        }
        self.volume = Some(volume.clone());
        self.slices = Default::default();
        // Counts of the last volume that are still being made go to the old `OnceLock`, which is dropped
        // here.
        self.counts = Arc::default();
        let (counts, volume, cells) = (self.counts.clone(), volume.clone(), volume.cells.len());
        let count = move || {
            counts
                .get_or_init(|| Counts { statistics: volume.statistics(), rho: volume.rho_histogram(BINS) });
        };
        if cells <= COUNT_AT_ONCE {
            count();
            return;
        }
        let ctx = ctx.clone();
        let counting = move || {
            count();
            ctx.request_repaint();
        };
        // On a thread of its own, because the thread pool may be busy rendering. If the thread cannot start,
        // only the statistics are missing.
        let _ = std::thread::Builder::new().name("count cells".into()).spawn(counting);
    }

    fn selector(&mut self, ui: &mut egui::Ui, volume: &VolumeTexture) {
        let one_line = ui.available_width() >= ONE_LINE_WIDTH;
        ui.horizontal(|ui| {
            for (quantity, name) in Quantity::ALL {
                ui.selectable_value(&mut self.quantity, quantity, name);
            }
            if one_line {
                ui.add_space(6.0);
                self.key(ui, volume);
            }
        });
        if !one_line {
            ui.horizontal(|ui| self.key(ui, volume));
        }
    }

    /// Shows the meaning of the slices' colours.
    fn key(&self, ui: &mut egui::Ui, volume: &VolumeTexture) {
        ui.spacing_mut().item_spacing.x = 6.0;
        match self.quantity {
            Quantity::V => {
                for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
                    let mut n = [0.0; 3];
                    n[axis] = 1.0;
                    swatch(ui, super::layer_image::direction_colour(n));
                    ui.label(format!("+{name}"));
                }
            }
            Quantity::Rho | Quantity::KD | Quantity::KS => {
                ui.label("0");
                let bar = egui::vec2(60.0, 11.0);
                super::layer_image::colour_bar(ui, bar, super::layer_image::sequential);
                let high = if self.quantity == Quantity::Rho { volume.alpha } else { 1.0 };
                ui.label(short(high as f64));
            }
        }
        swatch(ui, slice::empty_colour(ui.visuals().dark_mode));
        ui.label("no flow").on_hover_text("Cells that no curve passes through: ρ, v and k are 0");
    }

    /// The slices side by side, with the sliders below.
    fn row(&mut self, ui: &mut egui::Ui, volume: &VolumeTexture, [nx, ny, nz]: [f32; 3], width: f32) {
        let scale = ((width - 2.0 * GAP) / (nz + nx + nx)).min(MAX_HEIGHT / ny.max(nz));
        let columns = width.min((nz + nx + nx) * scale + 2.0 * GAP);
        ui.horizontal_top(|ui| {
            ui.set_max_width(columns);
            ui.spacing_mut().item_spacing.x = GAP;
            for axis in 0..3 {
                self.slice(ui, volume, axis, scale);
            }
        });
        self.sliders(ui, volume);
    }

    /// The slices as in a technical drawing: the front view (across z), the side view (across x) to its right
    /// with the same y, and the top view (across y) below with the same x.
    fn three_views(&mut self, ui: &mut egui::Ui, volume: &VolumeTexture, [nx, ny, nz]: [f32; 3], width: f32) {
        let scale = ((width - GAP) / (nx + nz)).min((MAX_HEIGHT - GAP) / (ny + nz));
        ui.spacing_mut().item_spacing = egui::Vec2::splat(GAP);
        // The sliders go where there is room: to the right of a long volume, under the side view of a square
        // one, below everything in a narrow panel.
        let right_of_all = width - (nx + nz) * scale - 2.0 * GAP;
        let under_side = if nz * scale >= SLIDERS_BESIDE { width - nx * scale - GAP } else { 0.0 };
        let beside = |panel: &mut Self, ui: &mut egui::Ui, room: f32| {
            if room >= SLIDERS_BESIDE {
                ui.vertical(|ui| {
                    ui.set_max_width(room);
                    ui.spacing_mut().item_spacing.y = 4.0;
                    panel.sliders(ui, volume);
                    ui.label(slice::cell_text(volume, panel.cell));
                });
            }
        };
        ui.horizontal_top(|ui| {
            self.slice(ui, volume, 2, scale);
            self.slice(ui, volume, 0, scale);
            beside(self, ui, right_of_all);
        });
        ui.horizontal_top(|ui| {
            self.slice(ui, volume, 1, scale);
            if right_of_all < SLIDERS_BESIDE {
                beside(self, ui, under_side);
            }
        });
        if right_of_all.max(under_side) < SLIDERS_BESIDE {
            self.sliders(ui, volume);
        }
    }

    fn slice(&mut self, ui: &mut egui::Ui, volume: &VolumeTexture, axis: usize, scale: f32) {
        let right = volume.size[slice::PLANES[axis][0]] as f32 * scale;
        ui.vertical(|ui| {
            ui.set_max_width(right);
            ui.spacing_mut().item_spacing.y = 2.0;
            let captions =
                ["across x: z right, y down", "across y: x right, z down", "across z: x right, y down"];
            let caption = captions[axis];
            let caption = if right >= FULL_CAPTION_WIDTH { caption } else { &caption[.."across x".len()] };
            ui.add(egui::Label::new(RichText::new(caption).small()).truncate());
            self.slices[axis].show(ui, volume, axis, self.quantity, &mut self.cell, scale);
        });
    }

    fn sliders(&mut self, ui: &mut egui::Ui, volume: &VolumeTexture) {
        ui.spacing_mut().item_spacing.y = 4.0;
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            ui.scope(|ui| {
                ui.spacing_mut().slider_width = (ui.available_width() - 78.0).clamp(60.0, 420.0);
                let text = RichText::new(name).strong().color(axis_colour(axis, ui.visuals().dark_mode));
                let range = 0..=volume.size[axis] - 1;
                ui.add(egui::Slider::new(&mut self.cell[axis], range).text(text));
            });
        }
    }
}

/// Colour of an axis and of the plane across it: x red, y green, z blue.
pub(super) fn axis_colour(axis: usize, dark_mode: bool) -> Color32 {
    let colours = if dark_mode {
        [(255, 110, 100), (120, 215, 110), (110, 170, 255)]
    } else {
        [(205, 40, 35), (20, 130, 30), (30, 90, 215)]
    };
    let (r, g, b) = colours[axis % 3];
    Color32::from_rgb(r, g, b)
}

fn swatch(ui: &mut egui::Ui, [r, g, b]: [u8; 3]) {
    let (rect, _) = ui.allocate_exact_size(egui::Vec2::splat(11.0), egui::Sense::hover());
    ui.painter().rect_filled(rect, 2.0, Color32::from_rgb(r, g, b));
    let stroke = ui.visuals().widgets.noninteractive.bg_stroke;
    ui.painter().rect_stroke(rect, 2.0, stroke, egui::StrokeKind::Inside);
}

/// A number with at most four decimals, without trailing zeros.
fn short(x: f64) -> String {
    let text = format!("{x:.4}");
    text.trim_end_matches('0').trim_end_matches('.').into()
}
