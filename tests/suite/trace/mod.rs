//! §4 The trace.

pub mod billow;
pub mod closed_forms;
pub mod flow;
pub mod limits;
pub mod lines;
pub mod shell_diffuse;
pub mod shell_shadows;
pub mod shells;
pub mod tear;
