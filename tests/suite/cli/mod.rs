//! What the command line prints and does when something fails.

pub mod faults;
