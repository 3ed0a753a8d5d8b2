//! Multiple scattering: the model of `taki::light::scatter` against a path tracer, and both against closed
//! forms.

mod closed_forms;
mod flux;
mod optics;
mod parity;
mod pictures;
mod renderer;
mod shell;
mod tracer;

use glam::DVec3;
use tracer::Phase;

const ISOTROPIC: Phase = Phase::HenyeyGreenstein(0.0);

/// Unit vector at `degrees` from the normal. `side` is −1 on the seen side and 1 behind.
fn toward(degrees: f64, turn: f64, side: f64) -> DVec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    DVec3::new(sin * turn.cos(), sin * turn.sin(), side * cos)
}
