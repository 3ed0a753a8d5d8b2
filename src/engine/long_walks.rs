//! Walks that software Vulkan would end early.
//!
//! lavapipe (Mesa 22.3.6) ends all loops of an invocation after 65,535 turns together. A pixel can need more
//! where light is marched from many lights. Reading the picture back finds the holes, but only after all the
//! work. So the cells of a few rays are counted before.

use super::cpu;
use super::gpu::walks_ended;
use crate::light::{Reflection, Scattering, Visibility};
use crate::place::Mesh;
use crate::scene::Scene;
use crate::trace::Prefilter;
use crate::util::error::Result;
use crate::util::monitor::Unwatched;
use crate::volume::VolumeTexture;

/// Turns after which lavapipe ends the loops of an invocation.
const MOST_TURNS: u64 = 65_535;
/// Cells of a light ray that the integrate pass walks in one turn.
const CELLS_A_TURN: u64 = 4;
/// Longest side of the picture whose rays are counted, pixels.
const SIDE: u32 = 48;
/// Share of [`MOST_TURNS`] that a cautious check allows. Between the counted pixels, others take more turns.
const CAUTION: f64 = 0.75;

/// Returns an error if a pixel of the scene needs more turns than lavapipe allows. Counts the cells of some
/// pixels with the CPU engine. Rock is left out, so a pixel whose water is hidden counts too. A `cautious`
/// check refuses walks that come near the limit.
///
/// # Errors
/// [`Error::Device`] with the advice for the user, and errors of [`cpu::render`].
///
/// [`Error::Device`]: crate::util::error::Error::Device
pub fn check(scene: &Scene, volume: &VolumeTexture, device: &str, cautious: bool) -> Result<()> {
    if scene.visibility != Visibility::March {
        return Ok(());
    }
    let mut small = scene.clone();
    let parts = small.edit();
    let longest = parts.image.width.max(parts.image.height).max(SIDE);
    let side = |n: u32| ((u64::from(n) * u64::from(SIDE)).div_ceil(u64::from(longest)) as u32).max(1);
    let image = &mut parts.image;
    (image.width, image.height, image.samples) = (side(image.width), side(image.height), 1);
    // The number of cells does not depend on what takes long to prepare.
    parts.reflection = Reflection::KajiyaKay;
    parts.scattering = Scattering::Single;
    parts.trace.filter = Prefilter::None;
    let frame = cpu::render(&small, volume, &Mesh::default(), false, &Unwatched)?;
    let turns = |&[own, light]: &[u32; 2]| u64::from(own) + u64::from(light) / CELLS_A_TURN;
    let allowed = if cautious { (MOST_TURNS as f64 * CAUTION) as u64 } else { MOST_TURNS };
    match frame.counts.iter().map(turns).max() {
        Some(most) if most > allowed => Err(walks_ended(device, &format!("some pixels take {most} turns"))),
        _ => Ok(()),
    }
}
