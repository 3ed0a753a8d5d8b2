//! Output of the command line, and what happens when something fails.

mod again;
pub mod faults;
mod quality;
mod slips;
