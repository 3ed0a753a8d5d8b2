//! The window's title and position, its screenshot, and its end.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use eframe::egui;

use super::{Leaving, Screenshot, Viewer};
use crate::output::frame::{Encoding, Format, Head, Output, encode};
use crate::util::error::{Error, Result};
use crate::viewer::Handover;

impl Viewer {
    /// Updates the title and the kept position, and closes the window where that is due.
    pub(super) fn lifecycle(&mut self, ctx: &egui::Context) {
        if self.options.signal.load(Ordering::Relaxed) != 0 {
            self.closing = true;
        }
        if self.loss.happened() && !self.closing {
            self.loss.hand_over(Handover { document: self.document.clone(), device_lost: true });
            self.closing = true;
        }
        let mark = if self.document.is_changed() { "• " } else { "" };
        let title = format!("{mark}{} — taki", self.document.name);
        if title != self.title {
            ctx.send_viewport_cmd(egui::ViewportCommand::Title(title.clone()));
            self.title = title;
        }
        let (close, inner, outer) = ctx.input(|i| {
            let v = i.viewport();
            (v.close_requested(), v.inner_rect, v.outer_rect)
        });
        if let Some(rect) = inner {
            self.settings.window = Some(rect.size().into());
        }
        if let Some(rect) = outer {
            self.settings.position = Some(rect.min.into());
        }
        self.settings.zoom = ctx.zoom_factor();
        if close && self.document.is_changed() && !self.closing {
            ctx.send_viewport_cmd(egui::ViewportCommand::CancelClose);
            self.leaving = Some(Leaving::Close);
        }
        if let Some(after) = self.options.exit_after {
            let left = after.saturating_sub(self.opened.elapsed());
            if !left.is_zero() {
                ctx.request_repaint_after(left);
            } else if self.take_screenshot(ctx) {
                self.closing = true;
            }
        }
        if self.closing {
            ctx.send_viewport_cmd(egui::ViewportCommand::Close);
        }
    }

    /// Requests the window's picture, and writes it once it has arrived. Returns whether it is written, or
    /// none is wanted.
    pub(super) fn take_screenshot(&mut self, ctx: &egui::Context) -> bool {
        let Some(path) = &self.options.screenshot else { return true };
        let id = egui::Id::unique("screenshot");
        match self.screenshot {
            Screenshot::Done => true,
            Screenshot::NotRequested => {
                let callback_ctx = ctx.clone();
                ctx.request_screenshot(move |image| {
                    callback_ctx.data_mut(|d| d.insert_temp(id, image));
                    callback_ctx.request_repaint();
                });
                self.screenshot = Screenshot::Requested;
                ctx.request_repaint();
                false
            }
            Screenshot::Requested => {
                let Some(image) = ctx.data_mut(|d| d.remove_temp::<Arc<egui::ColorImage>>(id)) else {
                    ctx.request_repaint();
                    return false;
                };
                let written = write_image(&image, path);
                self.screenshot = Screenshot::Done;
                if let Err(e) = written {
                    // The window closes, so nobody would read a banner.
                    eprintln!("taki: error: {e}");
                }
                true
            }
        }
    }
}

/// Writes the window's picture in the format that the extension names.
fn write_image(image: &egui::ColorImage, path: &Path) -> Result<()> {
    let format = Format::wanted("--screenshot", path)?;
    let size = image.size.map(|n| n as u32);
    let samples = image.pixels.iter().flat_map(|p| [p.r(), p.g(), p.b()]).collect();
    let head = Head { format, encoding: Encoding::DISPLAY, size, texts: Vec::new() };
    let bytes = encode(&head, samples).map_err(|e| Error::write(path, e))?;
    Output::create(path)?.finish_with(&bytes)
}
