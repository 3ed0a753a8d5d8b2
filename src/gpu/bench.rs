//! Single passes on a prepared frame, for `taki bench`.

use super::gbuffer::Targets;
use super::integrate::{Integrate, Sums, Tiler, Variant};
use super::layout::{self, Tile};
use super::{GpuRenderer, Inputs, Resident, Uploaded, readback};
use crate::error::Result;
use crate::frame::Window;
use crate::overlap;
use crate::scene::{Mesh, Scene};
use crate::volume::VolumeTexture;

/// What can be measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BenchPass {
    /// Raster pass.
    Gbuffer,
    /// The walk without light: `shaders/bare.wgsl`.
    BareWalk,
    /// Walk and direct light.
    Integrate,
    /// Walk and light attenuated by an exact walk to the light.
    IntegrateMarch,
}

impl BenchPass {
    /// All, in the order of the frame.
    pub const ALL: [BenchPass; 4] =
        [BenchPass::Gbuffer, BenchPass::BareWalk, BenchPass::Integrate, BenchPass::IntegrateMarch];

    /// Its name in the table.
    pub fn name(self) -> &'static str {
        match self {
            BenchPass::Gbuffer => "gbuffer",
            BenchPass::BareWalk => "bare walk",
            BenchPass::Integrate => "integrate",
            BenchPass::IntegrateMarch => "integrate march",
        }
    }
}

/// A renderer with a scene on its device.
pub struct GpuBench {
    renderer: GpuRenderer,
    prepared: Option<Prepared>,
}

struct Prepared {
    up: Uploaded,
    targets: Targets,
    sums: Sums,
    window: Window,
    frame: layout::Frame,
    passes: [(Integrate, Tiler, Option<u64>); 3],
}

impl GpuBench {
    /// From an open renderer.
    pub fn new(renderer: GpuRenderer) -> Self {
        GpuBench { renderer, prepared: None }
    }

    /// Uploads a scene (the second one differs in its visibility only).
    pub fn prepare(
        &mut self,
        direct: &Scene,
        marched: &Scene,
        volume: &VolumeTexture,
        mesh: &Mesh,
    ) -> Result<()> {
        let gpu = &self.renderer.gpu;
        let window = Window::whole([direct.image.width, direct.image.height]);
        let layers = overlap::sheets(direct);
        let frame = layout::Frame::new(direct, volume, window, &(0..1), 0, layers);
        let pass = |pass| (pass, Tiler::new(None, None), None);
        self.prepared = Some(Prepared {
            up: Uploaded::new(gpu, &mut Resident::default(), direct, volume, mesh)?,
            targets: Targets::new(gpu, window.width, window.height, layers),
            sums: Sums::new(gpu, window.pixels()),
            window,
            frame,
            passes: [
                pass(Integrate::bare(gpu, Variant::of(direct))),
                pass(Integrate::new(gpu, Variant::of(direct))),
                pass(Integrate::new(gpu, Variant::of(marched))),
            ],
        });
        self.run(BenchPass::Gbuffer).map(drop)
    }

    /// Runs one pass: seconds on the device, and the cells it walked.
    ///
    /// # Panics
    /// Before [`GpuBench::prepare`].
    pub fn run(&mut self, pass: BenchPass) -> Result<(f64, u64)> {
        let GpuRenderer { gpu, timer, gbuffer, .. } = &self.renderer;
        let p = self.prepared.as_mut().expect("prepare comes first");
        let (window, area) = (p.window, Tile::whole(p.window));
        let inputs = Inputs { gpu, timer, up: &p.up, targets: &p.targets, window, area, frame: &p.frame };
        let number = match pass {
            BenchPass::Gbuffer => return Ok((gbuffer.run(&inputs, || Ok(()))?, 0)),
            BenchPass::BareWalk => 0,
            BenchPass::Integrate => 1,
            BenchPass::IntegrateMarch => 2,
        };
        let (integrate, tiler, cells) = &mut p.passes[number];
        let seconds = integrate.run(&inputs, &p.sums, tiler, |_| Ok(()))?;
        let cells = match cells {
            Some(cells) => *cells,
            None => {
                let mut sum = 0;
                readback::read_rows(gpu, &p.sums.counts, 8, window.width, area, |_, bytes| {
                    sum += bytes
                        .chunks_exact(4)
                        .map(|c| bytemuck::pod_read_unaligned::<u32>(c) as u64)
                        .sum::<u64>();
                })?;
                *cells.insert(sum)
            }
        };
        Ok((seconds, cells))
    }
}
