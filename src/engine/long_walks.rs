//! Scenes most of whose walks software Vulkan would end early.
//!
//! lavapipe (Mesa 22.3.6) ends all loops of an invocation after 65,535 turns together. A pixel can need more
//! where light is marched from many lights. The CPU engine finishes such pixels, so what the device did for
//! them is lost. Where they are most of the work, the whole picture is better left to the CPU engine. So the
//! cells of a few rays are counted before.

use super::cpu;
use super::gpu::{MOST_TURNS, walks_ended};
use crate::light::{Reflection, Scattering, Visibility};
use crate::place::Mesh;
use crate::scene::Scene;
use crate::trace::Prefilter;
use crate::util::error::Result;
use crate::util::monitor::Unwatched;
use crate::volume::VolumeTexture;

/// Cells of a light ray that the integrate pass walks in one turn.
const CELLS_A_TURN: u64 = 4;
/// Longest side of the picture whose rays are counted, pixels.
const SIDE: u32 = 48;

/// Returns an error if more than half of a picture's work would be done for pixels that lavapipe ends early.
/// Counts the cells of some pixels with the CPU engine. Rock is left out, so a pixel whose water is hidden
/// counts too.
///
/// # Errors
/// [`Error::Device`] with the advice for the user, and errors of [`cpu::render`].
///
/// [`Error::Device`]: crate::util::error::Error::Device
pub fn check(scene: &Scene, volume: &VolumeTexture, device: &str) -> Result<()> {
    if scene.visibility != Visibility::March {
        return Ok(());
    }
    let mut small = scene.clone();
    let parts = small.edit();
    parts.image.shrink(SIDE);
    // The number of cells does not depend on what takes long to prepare.
    parts.reflection = Reflection::KajiyaKay;
    parts.scattering = Scattering::Single;
    parts.trace.filter = Prefilter::None;
    let frame = cpu::render(&small, volume, &Mesh::default(), false, &Unwatched)?;
    let turns = frame.counts.iter().map(|&[own, light]| u64::from(own) + u64::from(light) / CELLS_A_TURN);
    let (all, ended) = turns.fold((0, 0), |(all, ended), turns| {
        (all + turns, ended + if turns > MOST_TURNS { turns } else { 0 })
    });
    match 2 * ended > all {
        true => Err(walks_ended(device, &format!("{} % of the cells are in such pixels", 100 * ended / all))),
        false => Ok(()),
    }
}
