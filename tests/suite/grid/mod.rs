//! Grids of simulations. Reference truth: every sample against the formula that made it.

mod tree;
