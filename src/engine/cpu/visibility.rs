//! §5 Light volumes on the CPU, kept from frame to frame. Twin: `shaders/light/visibility.wgsl`. The walk
//! from a cell to a light is in `src/light/optical_depth.rs`.

use std::sync::Arc;

use rayon::prelude::*;

use super::integrate::{Integrator, ShellLight};
use super::rasters::Rasters;
use crate::light::Light;
use crate::light::fill::{Numbers, Rows};
use crate::light::visibility::{LightVolume, LightVolumes};
use crate::mapping::shell::Shell;
use crate::trace::Lookup;
use crate::util::error::Result;
use crate::util::monitor::Monitor;
use crate::volume::{Leaps, LevelSets, Levels, LevelsCache};

/// Cells of all light volumes that are filled together. Threads wait for one another once for each such lot.
const CELLS_AT_ONCE: usize = 1 << 22;

/// The light volumes of the last frame, the volumes' levels, and results of the raster pass.
pub struct LightVolumeCache {
    /// Results of the raster pass.
    pub rasters: Box<Rasters>,
    /// Levels of the last volumes.
    pub levels: LevelsCache,
    last: Option<FilledCache>,
    last_in_shells: Option<Box<(ShellInputs, Arc<ShellLight>)>>,
}

impl Default for LightVolumeCache {
    /// Keeps nothing yet. Rays in lockstep do not leap, so empty cells hold no boxes.
    fn default() -> Self {
        LightVolumeCache {
            rasters: Box::default(),
            levels: LevelsCache::with_leaps(Leaps::Never),
            last: None,
            last_in_shells: None,
        }
    }
}

/// Light volumes, and the inputs they were filled from.
struct FilledCache {
    levels: LevelSets,
    lookup: Lookup,
    plan: LightVolumes,
    filled: Filled,
}

/// Inputs of the light in shells.
pub(super) struct ShellInputs {
    pub levels: Vec<Levels>,
    pub shells: Vec<Arc<Shell>>,
    pub lights: Vec<Light>,
    /// Cells that each volume has moved down the flow, and its extinction.
    pub volumes: Vec<[f32; 2]>,
    pub max_cells: u32,
}

impl ShellInputs {
    fn is(&self, other: &ShellInputs) -> bool {
        self.levels.len() == other.levels.len()
            && self.levels.iter().zip(&other.levels).all(|(a, b)| Arc::ptr_eq(a, b))
            && self.shells.len() == other.shells.len()
            && self.shells.iter().zip(&other.shells).all(|(a, b)| Shell::is_same(a, b))
            && self.lights == other.lights
            && self.volumes == other.volumes
            && self.max_cells == other.max_cells
    }
}

/// All light volumes of a plan, by their numbers. Each holds the values of every level, in the level's order
/// of cells.
pub type Filled = Arc<Vec<Vec<Numbers>>>;

impl LightVolumeCache {
    /// Drops the light volumes.
    pub fn forget(&mut self) {
        self.last = None;
    }

    /// Returns the light at the vertices of shells. It is walked unless it is that of the last call.
    pub(super) fn shell_light(&mut self, integrator: &Integrator) -> Arc<ShellLight> {
        let inputs = integrator.shell_inputs();
        if let Some((last, kept)) = self.last_in_shells.as_deref()
            && last.is(&inputs)
        {
            return kept.clone();
        }
        self.last_in_shells = None;
        let kept = Arc::new(integrator.shell_light());
        self.last_in_shells = Some(Box::new((inputs, kept.clone())));
        kept
    }

    /// Returns the planned light volumes. They are filled unless they are those of the last call.
    ///
    /// # Errors
    /// Errors of `monitor`, which may stop the work.
    pub fn get(
        &mut self,
        plan: &LightVolumes,
        levels: &LevelSets,
        lookup: Lookup,
        monitor: &dyn Monitor,
    ) -> Result<Filled> {
        if let Some(last) = &self.last
            && Arc::ptr_eq(&last.levels, levels)
            && last.lookup == lookup
            && last.plan.volumes == plan.volumes
            && (last.plan.medium, last.plan.form) == (plan.medium, plan.form)
        {
            return Ok(last.filled.clone());
        }
        // The old ones are dropped first, because both might not fit.
        self.last = None;
        let mut all = Vec::with_capacity(plan.volumes.len());
        // A volume whose sheets are all mist has no light volume.
        let is_lit = |volume: usize| plan.volumes.iter().any(|own| own.volume as usize == volume);
        let rows = |(volume, levels)| is_lit(volume).then(|| Rows::new(levels, lookup));
        let rows: Vec<Option<Rows>> = levels.iter().map(|levels| &**levels).enumerate().map(rows).collect();
        let cells = levels.iter().map(|levels| levels.iter().map(|level| level.cells.len()).sum::<usize>());
        let cells = cells.max().unwrap_or(1);
        for volumes in plan.volumes.chunks((CELLS_AT_ONCE / cells).max(1)) {
            monitor.progress("light volumes", all.len() as u64, plan.volumes.len() as u64)?;
            let fill = |light_volume: &LightVolume| {
                let rows = rows[light_volume.volume as usize].as_ref();
                rows.map_or(Vec::new(), |rows| rows.fill(light_volume, plan.medium, plan.form))
            };
            all.par_extend(volumes.par_iter().map(fill));
        }
        let filled = Arc::new(all);
        let (levels, plan) = (levels.clone(), plan.clone());
        self.last = Some(FilledCache { levels, lookup, plan, filled: filled.clone() });
        Ok(filled)
    }
}
