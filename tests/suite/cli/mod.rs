//! What the command line says and does where things go wrong.

pub mod faults;
