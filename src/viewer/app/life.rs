//! The window's life: its title and place, its picture, its end.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use eframe::egui;

use super::{Leaving, Shot, Viewer};
use crate::util::error::{Error, Result};
use crate::viewer::Kept;

impl Viewer {
    pub(super) fn life(&mut self, ctx: &egui::Context) {
        if self.options.signal.load(Ordering::Relaxed) != 0 {
            self.closing = true;
        }
        if self.loss.happened() && !self.closing {
            self.loss.keep(Kept { document: self.document.clone(), device_lost: true });
            self.closing = true;
        }
        let title =
            format!("{}{} — taki", if self.document.is_changed() { "• " } else { "" }, self.document.name);
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

    /// Asks for the window's picture; true when it is written, or none is wanted.
    pub(super) fn take_screenshot(&mut self, ctx: &egui::Context) -> bool {
        let Some(path) = &self.options.screenshot else { return true };
        let id = egui::Id::unique("screenshot");
        match self.shot {
            Shot::Done => true,
            Shot::NotYet => {
                let ctx_of_callback = ctx.clone();
                ctx.request_screenshot(move |image| {
                    ctx_of_callback.data_mut(|d| d.insert_temp(id, image));
                    ctx_of_callback.request_repaint();
                });
                self.shot = Shot::Asked;
                ctx.request_repaint();
                false
            }
            Shot::Asked => {
                let Some(image) = ctx.data_mut(|d| d.remove_temp::<Arc<egui::ColorImage>>(id)) else {
                    ctx.request_repaint();
                    return false;
                };
                let written = write_image(&image, path);
                self.shot = Shot::Done;
                if let Err(e) = written {
                    // There is no one to read a banner any more.
                    eprintln!("taki: error: {e}");
                }
                true
            }
        }
    }
}

/// Writes the window's picture.
fn write_image(image: &egui::ColorImage, path: &Path) -> Result<()> {
    let [width, height] = image.size.map(|n| n as u32);
    let bytes: Vec<u8> = image.pixels.iter().flat_map(|p| p.to_array()).collect();
    let picture = image::RgbaImage::from_raw(width, height, bytes)
        .ok_or_else(|| Error::write(path, "the window has no picture"))?;
    picture.save_with_format(path, image::ImageFormat::Png).map_err(|e| Error::write(path, e))
}
