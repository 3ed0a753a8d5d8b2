//! The volume's figures, with theory's where there is one.

use eframe::egui::{self, RichText};

use crate::error::human_bytes;
use crate::volume::Statistics;

/// One row a figure: name, value, theory.
pub(super) fn show(ui: &mut egui::Ui, s: &Statistics) {
    let [nx, ny, nz] = s.size;
    let of_all = |n: u64| format!("{} ({:.1} %)", thousands(n), 100.0 * n as f64 / s.cells.max(1) as f64);
    let percent = |x: f64| format!("{:.2} %", 100.0 * x);
    let [vx, vy, vz] = s.v_mean;
    let half = format!("α/2 = {:.4}", s.alpha / 2.0);
    let rows = [
        ("size", format!("{nx} × {ny} × {nz}"), ""),
        ("cells", format!("{}, {}", thousands(s.cells), human_bytes(s.bytes.into())), ""),
        ("flow cells", of_all(s.flow_cells), ""),
        ("occupied cells", of_all(s.occupied_cells), ""),
        ("mean ρ", format!("{:.4}", s.rho_mean), half.as_str()),
        ("ρ = 0", percent(s.rho_share_at_zero), "30.85 %"),
        ("ρ = α", percent(s.rho_share_at_alpha), "30.85 %"),
        ("mean k_d, k_s", format!("{:.3}, {:.3}", s.k_d_mean, s.k_s_mean), ""),
        ("mean v", format!("({vx:.3}, {vy:.3}, {vz:.3})"), ""),
    ];
    egui::Grid::new("volume figures").num_columns(3).spacing([14.0, 3.0]).striped(true).show(ui, |ui| {
        for title in ["", "this volume", "theory"] {
            ui.label(RichText::new(title).weak());
        }
        ui.end_row();
        for (name, value, theory) in rows {
            ui.label(name);
            ui.label(RichText::new(value).strong());
            ui.label(theory);
            ui.end_row();
        }
    });
}

/// With a thin space between thousands.
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
