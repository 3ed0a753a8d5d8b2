//! Output of the command line, and what happens when something fails.

pub mod faults;
mod slips;
