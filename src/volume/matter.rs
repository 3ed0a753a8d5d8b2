//! §2 Recipes of matter other than water and simulations.

use super::mountain;
use super::skin;
use super::threads::{BYTES_PER_CELL, Thread, Threads};
use super::{ClothSpec, FurSpec, GrainsSpec, HairSpec, MountainSpec, SkinSpec, StrandsSpec, VolumeTexture};
use crate::model::Strands;
use crate::util::error::{Error, Result};
use crate::util::monitor::Monitor;

/// Recipe of a volume of other matter. Equal recipes build equal bytes.
#[derive(Clone, Debug, PartialEq)]
pub enum Matter {
    /// Hairs on a skin.
    Fur(FurSpec),
    /// Woven yarns.
    Cloth(ClothSpec),
    /// Long hair along the flow.
    Hair(HairSpec),
    /// Strands of a file.
    Strands(StrandsSpec),
    /// A face of rock with grass.
    Mountain(MountainSpec),
    /// Loose grains.
    Grains(GrainsSpec),
    /// Skin.
    Skin(SkinSpec),
}

impl Matter {
    /// Bytes that building takes for each cell beside the cell itself.
    pub const BYTES_PER_CELL: usize = BYTES_PER_CELL;

    /// Bytes that building takes beside those of the cells.
    pub fn bytes_beside(&self) -> u128 {
        let ([nx, ny, _], per_column) = match self {
            Matter::Mountain(MountainSpec { size, .. }) => (*size, mountain::BYTES_PER_COLUMN),
            Matter::Skin(SkinSpec { size, .. }) => (*size, skin::BYTES_PER_COLUMN),
            _ => return 0,
        };
        u128::from(nx) * u128::from(ny) * per_column as u128
    }

    /// Builds the volume texture in dense storage.
    ///
    /// # Errors
    /// Returns an error if `monitor` ends the work.
    pub fn build(&self, monitor: &dyn Monitor) -> Result<VolumeTexture> {
        match self {
            Matter::Fur(fur) => fur.build(monitor),
            Matter::Cloth(cloth) => cloth.build(monitor),
            Matter::Mountain(mountain) => mountain.build(monitor),
            Matter::Grains(grains) => grains.build(monitor),
            Matter::Skin(skin) => skin.build(monitor),
            Matter::Hair(hair) => hair.build(monitor),
            Matter::Strands(strands) => strands.build(monitor),
        }
    }

    /// Draws all threads as strands, in cells; `None` for matter that is not made of threads alone. They may
    /// reach beyond the volume, where copies of it would stand.
    ///
    /// # Errors
    /// [`Error::Memory`] if they take more than `budget` bytes, and errors of `monitor`.
    pub fn strands(&self, budget: u64, monitor: &dyn Monitor) -> Result<Option<Strands>> {
        let strands = match self {
            Matter::Fur(fur) => drawn(fur.threads(), budget, monitor),
            Matter::Cloth(cloth) => drawn(cloth.threads(), budget, monitor),
            Matter::Hair(hair) => drawn(hair.threads(), budget, monitor),
            Matter::Strands(strands) => drawn(strands.threads(), budget, monitor),
            Matter::Mountain(_) | Matter::Grains(_) | Matter::Skin(_) => return Ok(None),
        };
        strands.map(Some)
    }
}

/// Threads between two reports of progress.
const THREADS_PER_REPORT: usize = 1024;

fn drawn(
    threads: Threads<impl Fn(usize, &mut Thread) + Sync>,
    budget: u64,
    monitor: &dyn Monitor,
) -> Result<Strands> {
    let (mut strands, mut thread) = (Strands::default(), Thread::default());
    for number in 0..threads.count {
        if number % THREADS_PER_REPORT == 0 {
            monitor.progress("strands", number as u64, threads.count as u64)?;
        }
        thread.clear();
        (threads.draw)(number, &mut thread);
        let width = |i: usize| thread.looks.get(i).or(thread.looks.last()).map_or(0.0, |look| look.width);
        strands.push(thread.points.iter().enumerate().map(|(i, point)| (*point, width(i))));
        // The first strands tell how much all will take.
        let drawn = 16 * strands.points.len() as u128;
        let expected = drawn * threads.count as u128 / (number as u128 + 1);
        let need = if (number + 1) % THREADS_PER_REPORT == 0 { expected } else { drawn };
        if need > u128::from(budget) {
            let what = format!("the list of {} strands", threads.count);
            return Err(Error::memory(what, need, budget, "write fewer strands, or raise --memory"));
        }
    }
    Ok(strands)
}
