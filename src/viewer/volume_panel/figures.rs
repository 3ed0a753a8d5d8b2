//! The volume's statistics, compared to theory where it predicts a value.

use eframe::egui::{self, RichText};

use crate::util::error::human_bytes;
use crate::volume::Statistics;

/// Shows one row per figure: name, value, and the value predicted by theory.
pub(super) fn show(ui: &mut egui::Ui, s: &Statistics) {
    let [nx, ny, nz] = s.size;
    let count_of_all =
        |n: u64| format!("{} ({:.1} %)", thousands(n), 100.0 * n as f64 / s.cells.max(1) as f64);
    let percent = |x: f64| format!("{:.2} %", 100.0 * x);
    let [vx, vy, vz] = s.v_mean;
    let half = format!("{:.4} (α/2)", s.alpha / 2.0);
    let rows = [
        ("size", format!("{nx} × {ny} × {nz}"), ""),
        ("cells", format!("{}, {}", thousands(s.cells), human_bytes(s.bytes.into())), ""),
        ("flow cells", count_of_all(s.flow_cells), ""),
        ("occupied cells", count_of_all(s.occupied_cells), ""),
        ("mean ρ", format!("{:.4}", s.rho_mean), half.as_str()),
        ("ρ = 0", percent(s.rho_share_at_zero), "30.85 %"),
        ("ρ = α", percent(s.rho_share_at_alpha), "30.85 %"),
        ("mean k_d, k_s", format!("{:.3}, {:.3}", s.k_d_mean, s.k_s_mean), ""),
        ("mean v", format!("({vx:.3}, {vy:.3}, {vz:.3})"), ""),
    ];
    // In a narrow panel, the value of theory is below the volume's.
    let beside = ui.available_width() >= super::ONE_LINE_WIDTH;
    egui::Grid::new("volume figures").spacing([10.0, 3.0]).striped(true).min_row_height(0.0).show(ui, |ui| {
        if beside {
            for title in ["", "this volume", "theory"] {
                ui.label(RichText::new(title).weak());
            }
            ui.end_row();
        }
        for (name, value, theory) in rows {
            ui.label(name);
            ui.label(RichText::new(value).strong());
            if beside {
                ui.label(theory);
            } else if !theory.is_empty() {
                ui.end_row();
                ui.label("    in theory");
                ui.label(theory);
            }
            ui.end_row();
        }
    });
}

/// A number with thin spaces between groups of three digits.
fn thousands(n: u64) -> String {
    let digits = n.to_string();
    let mut out = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push('\u{2009}');
        }
        out.push(digit);
    }
    out
}
