//! x
use eframe::egui;
/// x
pub fn show(_: &mut egui::Ui, _: &crate::cpu::ray::RayReport) {}
