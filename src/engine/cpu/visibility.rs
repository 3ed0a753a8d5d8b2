//! §5 What lies between cells and lights, and light volumes on the CPU. Twins: `shaders/optical_depth.wgsl` and
//! `shaders/visibility.wgsl`.

use std::sync::Arc;

use crate::light::fill::{Numbers, Rows};
use crate::light::visibility::LightVolumes;
use crate::trace::Lookup;
use crate::util::error::Result;
use crate::util::monitor::Monitor;
use crate::volume::{Levels, LevelsCache};

/// Light volumes that are kept from frame to frame.
#[derive(Default)]
pub struct LightVolumeCache {
    /// What they are of.
    pub levels: LevelsCache,
    kept: Option<Kept>,
}

struct Kept {
    levels: Levels,
    lookup: Lookup,
    plan: LightVolumes,
    filled: Filled,
}

/// All light volumes, number by number: of every level, in its order of cells.
pub type Filled = Arc<Vec<Vec<Numbers>>>;

impl LightVolumeCache {
    /// Lets go of the light volumes.
    pub fn forget(&mut self) {
        self.kept = None;
    }

    /// The light volumes that are planned, walked unless they are those of the last call.
    pub fn get(
        &mut self,
        plan: &LightVolumes,
        levels: &Levels,
        lookup: Lookup,
        monitor: &dyn Monitor,
    ) -> Result<Filled> {
        if let Some(kept) = &self.kept
            && Arc::ptr_eq(&kept.levels, levels)
            && kept.lookup == lookup
            && kept.plan.volumes == plan.volumes
            && (kept.plan.medium, kept.plan.form) == (plan.medium, plan.form)
        {
            return Ok(kept.filled.clone());
        }
        // The old ones go first: both might not fit.
        self.kept = None;
        let total = plan.volumes.len() as u64;
        let mut all = Vec::with_capacity(plan.volumes.len());
        let rows = Rows::new(levels, lookup);
        for (number, light_volume) in plan.volumes.iter().enumerate() {
            monitor.progress("light volumes", number as u64, total)?;
            all.push(rows.fill(light_volume, plan.medium, plan.form));
        }
        let filled = Arc::new(all);
        let (levels, plan) = (levels.clone(), plan.clone());
        self.kept = Some(Kept { levels, lookup, plan, filled: filled.clone() });
        Ok(filled)
    }
}
