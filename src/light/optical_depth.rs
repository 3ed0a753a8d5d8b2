//! §5 Optical depth between a cell and a light. Twins: `shaders/light/optical_depth.wgsl` and
//! `shaders/light/visibility.wgsl`.

use glam::{IVec3, Vec3};

use super::visibility::{DARK_BITS, Form, LightVolume, Medium, transmittance_code};
use crate::trace::SheetDensity;
use crate::trace::lookup::Level;
use crate::walk::{NEVER, Walk};

/// Value that a light volume of the given form stores for a cell: a code as a number (0 to 255), or an
/// optical depth.
pub fn light_volume_value(
    level: &Level,
    cell: IVec3,
    light_volume: &LightVolume,
    medium: Medium,
    form: Form,
) -> f32 {
    let depth = |enough: f32| {
        let direction = light_volume.direction * level.scale;
        optical_depth(level, &SheetDensity::WHOLE, cell, direction, medium, enough, &mut 0)
    };
    let bits = if medium.per_cell { light_volume.bits * level.depth_in_cells() } else { light_volume.bits };
    match form {
        Form::Codes => transmittance_code(depth(DARK_BITS / bits.max(1e-20)) * bits).into(),
        Form::Depths => depth(NEVER),
    }
}

/// Optical depth from the centre of cell `start` of a level to the point where the light ray leaves the slab.
///
/// The depth is Σ ρ code × length, in units of `direction`. With per-cell attenuation it is Σ ρ code, and the
/// first cell counts only by the half of its other cells, if it is coarse. ρ is the sheet's
/// ([`SheetDensity::rho`]).
///
/// The walk ends early once the depth exceeds `enough`. `walked` grows by the number of cells visited.
pub fn optical_depth(
    level: &Level,
    matter: &SheetDensity,
    start: IVec3,
    direction: Vec3,
    medium: Medium,
    enough: f32,
    walked: &mut u32,
) -> f32 {
    let mut depth = 0.0f32;
    let mut n = 0;
    let mut walk = Walk::new(level.size, start.as_vec3() + 0.5, direction, f32::INFINITY);
    while n < medium.max_cells && (0..level.size.z).contains(&walk.cell().z) {
        let cell = level.cell(walk.cell());
        let Some(crossing) = walk.next() else { break };
        let rho = matter.rho(cell.rho_code() as f32);
        if medium.per_cell {
            // A cell of the volume does not shadow itself. In a coarse cell, half of the other cells do.
            let own = 0.5 - 0.5 * level.scale.z;
            depth += rho * if n == 0 { own } else { 1.0 };
        } else {
            depth += rho * (crossing.t_exit - crossing.t_enter);
        }
        n += 1;
        if depth > enough {
            break;
        }
    }
    *walked += n.min(medium.max_cells);
    depth
}
