//! The volume inspector: three slices through the cells, how ρ is spread, and figures beside theory's.

mod figures;
mod histogram;
mod slice;

use std::sync::{Arc, OnceLock};

use eframe::egui::{self, Color32, RichText};

use crate::volume::{RhoHistogram, Statistics, VolumeTexture};
use slice::Slice;

/// Steps between 0 and α in the histogram: few enough that a step stands clear of the axis beside the
/// clamped ends, which hold eight times as many cells.
const BINS: usize = 10;
/// Cells that are counted at once, a few milliseconds; a larger volume (than 64³) is counted beside the
/// frames.
const COUNT_AT_ONCE: usize = 1 << 18;
/// Narrowest panel with the three slices in one row, points.
const ROW_WIDTH: f32 = 620.0;
/// Narrowest panel with a title and its key in one line, points.
const ONE_LINE_WIDTH: f32 = 350.0;
/// Narrowest slice with its directions named, points.
const FULL_CAPTION_WIDTH: f32 = 115.0;
/// Least width and height of the scrubbers beside slices, points.
const SCRUBBERS_BESIDE: f32 = 150.0;
/// Largest height of all slices together, points.
const MAX_HEIGHT: f32 = 430.0;
/// Between slices, points.
const GAP: f32 = 8.0;

/// What the slices show.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Shown {
    #[default]
    Rho,
    V,
    KD,
    KS,
}

impl Shown {
    const ALL: [(Shown, &str); 4] =
        [(Shown::Rho, "ρ"), (Shown::V, "v"), (Shown::KD, "k_d"), (Shown::KS, "k_s")];
}

/// The volume inspector. It keeps the cell its three planes meet in, their pictures and the counts.
#[derive(Default)]
pub struct VolumePanel {
    volume: Option<Arc<VolumeTexture>>,
    /// x, y, z of the cell the three planes meet in.
    cell: [u32; 3],
    shown: Shown,
    slices: [Slice; 3],
    counts: Arc<OnceLock<Counts>>,
}

/// What is counted over all cells.
struct Counts {
    statistics: Statistics,
    rho: RhoHistogram,
}

impl VolumePanel {
    /// Shows `volume`. Another one (by pointer) is counted anew, and keeps the planes where they are
    /// if it is of the same size.
    pub fn show(&mut self, ui: &mut egui::Ui, volume: &Arc<VolumeTexture>) {
        self.take(ui.ctx(), volume);
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
                    ui.label("Counting cells");
                });
            }
        }
    }

    /// The cell the three planes meet in: x, y, z.
    pub fn cell(&self) -> [u32; 3] {
        self.cell
    }

    fn take(&mut self, ctx: &egui::Context, volume: &Arc<VolumeTexture>) {
        if self.volume.as_ref().is_some_and(|known| Arc::ptr_eq(known, volume)) {
            return;
        }
        if self.volume.as_ref().is_none_or(|known| known.size != volume.size) {
            self.cell = volume.size.map(|n| n / 2);
        }
        self.volume = Some(volume.clone());
        self.slices = Default::default();
        // Counts of the volume before, if they still come, go to the cell nobody looks at any more.
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
        // A thread of its own: the pool's may be rendering for long. Where none is to be had the
        // figures are missing, the slices are not.
        let _ = std::thread::Builder::new().name("count cells".into()).spawn(counting);
    }

    fn selector(&mut self, ui: &mut egui::Ui, volume: &VolumeTexture) {
        let one_line = ui.available_width() >= ONE_LINE_WIDTH;
        ui.horizontal(|ui| {
            for (shown, name) in Shown::ALL {
                ui.selectable_value(&mut self.shown, shown, name);
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

    /// What the slices' colours mean.
    fn key(&self, ui: &mut egui::Ui, volume: &VolumeTexture) {
        ui.spacing_mut().item_spacing.x = 6.0;
        match self.shown {
            Shown::V => {
                for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
                    let mut n = [0.0; 3];
                    n[axis] = 1.0;
                    swatch(ui, super::layer_image::direction_colour(n));
                    ui.label(format!("+{name}"));
                }
            }
            Shown::Rho | Shown::KD | Shown::KS => {
                ui.label("0");
                let bar = egui::vec2(60.0, 11.0);
                super::layer_image::colour_bar(ui, bar, super::layer_image::sequential);
                let high = if self.shown == Shown::Rho { volume.alpha } else { 1.0 };
                ui.label(short(high as f64));
            }
        }
        swatch(ui, slice::empty_colour(ui.visuals().dark_mode));
        ui.label("no flow").on_hover_text("Cells no curve passes: ρ, v and k are 0");
    }

    /// Side by side, each with its scrubber below.
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
        self.scrubbers(ui, volume);
    }

    /// As in a technical drawing: the front (across z) with the side (across x) to its right, on the
    /// same y, and the top (across y) below, on the same x.
    fn three_views(&mut self, ui: &mut egui::Ui, volume: &VolumeTexture, [nx, ny, nz]: [f32; 3], width: f32) {
        let scale = ((width - GAP) / (nx + nz)).min((MAX_HEIGHT - GAP) / (ny + nz));
        ui.spacing_mut().item_spacing = egui::Vec2::splat(GAP);
        // The scrubbers go where there is room: beside a long volume, under the side view of a square
        // one, below all in a narrow panel.
        let right_of_all = width - (nx + nz) * scale - 2.0 * GAP;
        let under_side = if nz * scale >= SCRUBBERS_BESIDE { width - nx * scale - GAP } else { 0.0 };
        let beside = |panel: &mut Self, ui: &mut egui::Ui, room: f32| {
            if room >= SCRUBBERS_BESIDE {
                ui.vertical(|ui| {
                    ui.set_max_width(room);
                    ui.spacing_mut().item_spacing.y = 4.0;
                    panel.scrubbers(ui, volume);
                    ui.label(slice::in_words(volume, panel.cell));
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
            if right_of_all < SCRUBBERS_BESIDE {
                beside(self, ui, under_side);
            }
        });
        if right_of_all.max(under_side) < SCRUBBERS_BESIDE {
            self.scrubbers(ui, volume);
        }
    }

    fn slice(&mut self, ui: &mut egui::Ui, volume: &VolumeTexture, axis: usize, scale: f32) {
        let right = volume.size[slice::PLANES[axis][0]] as f32 * scale;
        ui.vertical(|ui| {
            ui.set_max_width(right);
            ui.spacing_mut().item_spacing.y = 2.0;
            let words =
                ["across x: z right, y down", "across y: x right, z down", "across z: x right, y down"];
            let words =
                if right >= FULL_CAPTION_WIDTH { words[axis] } else { &words[axis][.."across x".len()] };
            ui.add(egui::Label::new(RichText::new(words).small()).truncate());
            self.slices[axis].show(ui, volume, axis, self.shown, &mut self.cell, scale);
        });
    }

    fn scrubbers(&mut self, ui: &mut egui::Ui, volume: &VolumeTexture) {
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

/// The colour of an axis and of the plane across it: x red, y green, z blue.
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

/// At most four digits, without zeros at the end.
fn short(x: f64) -> String {
    let text = format!("{x:.4}");
    text.trim_end_matches('0').trim_end_matches('.').into()
}
