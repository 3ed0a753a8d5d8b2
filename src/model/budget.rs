//! Memory that a file takes, counted before it is taken.

use crate::util::error::{Error, Result};

/// Advice on a model that is too large.
pub(super) const SMALLER: &str =
    "simplify the mesh in the program that made it, or allow more memory with --memory";

/// Memory left to the reading of a file.
pub(super) struct Budget {
    limit: u64,
    taken: u128,
}

impl Budget {
    pub fn new(limit: u64) -> Budget {
        Budget { limit, taken: 0 }
    }

    /// Counts `bytes` that `what` is about to take. They add up with all that were counted before.
    ///
    /// # Errors
    /// [`Error::Memory`] where the sum is over the limit.
    pub fn take(&mut self, bytes: u128, what: impl FnOnce() -> String) -> Result<()> {
        self.taken = self.taken.saturating_add(bytes);
        if self.taken > u128::from(self.limit) {
            return Err(Error::memory(what(), self.taken, self.limit, SMALLER));
        }
        Ok(())
    }
}
