//! Export of a still picture at any size.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::Renderer;
use crate::engine::RenderOptions;
use crate::job::{Still, beside_encoders, check_bloom, strips};
use crate::output::frame::Exr;
use crate::picture::Layer;
use crate::util::error::{Error, Result};
use crate::util::monitor::Monitor;
use crate::util::window::Window;
use crate::viewer::worker::{Export, MessageKind, Request};

impl Renderer {
    /// Exports a picture and reports the result. Returns an error only for a device that was lost or hangs,
    /// so that the export is tried again.
    pub(super) fn export(&mut self, export: &Export) -> Result<()> {
        let clock = Instant::now();
        let result = self.export_files(export);
        let names: Vec<String> = export.paths.iter().map(|p| p.display().to_string()).collect();
        let names = names.join(", ");
        match &result {
            Ok(()) => {
                let seconds = clock.elapsed().as_secs_f64();
                self.say(MessageKind::Note, format!("wrote {names} in {seconds:.1} s"));
            }
            Err(Error::Interrupted { .. }) => {
                self.say(MessageKind::Note, format!("export cancelled; {names} not written"));
            }
            Err(Error::DeviceLost(_) | Error::Watchdog { .. }) => return result,
            Err(e) => self.say(MessageKind::Error, format!("export failed: {e}")),
        }
        Ok(())
    }

    fn export_files(&mut self, export: &Export) -> Result<()> {
        let still = Still::create(&export.paths)?.with_depth(export.depth);
        if !export.overwrite {
            still.check_replaced()?;
        }
        let request = Request {
            // No request is newer, so the volumes of the export are never abandoned.
            serial: u64::MAX,
            asked: Instant::now(),
            scene: Arc::new(export.scene.clone()),
            size: [export.scene.image.width, export.scene.image.height],
            samples: export.scene.image.samples,
            layer: Layer::Rgb,
        };
        let (volumes, _) = self.volumes(&request)?;
        let (mesh, _) = self.mesh(&export.scene);
        let watch = self.watch("export", u64::MAX, Duration::MAX);
        let options = RenderOptions { surface: still.has_exr(), ..Default::default() };
        let scene = &self.exposed(&export.scene, &volumes, &mesh, u64::MAX)?;
        let image = &scene.image;
        let window = Window::whole([image.width, image.height]);
        still.check(image, window)?;
        let memory = beside_encoders(self.memory, &still.formats(), window)?;
        let strips = strips(scene, window, options.surface, memory)?;
        if still.has_developed() {
            check_bloom(scene, window, strips.len())?;
        }
        let mut writer = still.begin(scene, &*volumes, window, &Exr::of(&Layer::ALL))?;
        writer.fill(&strips, image.samples, &options, &watch, |options, watch| {
            self.run_engine(scene, &volumes, &mesh, options, watch)
        })?;
        watch.progress("saving", 1, 1)?;
        writer.finish().map(drop)
    }
}
