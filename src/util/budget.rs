//! Memory that a file takes, counted before it is taken.

use super::error::{Error, Result};

/// Memory left to the reading of a file.
#[derive(Debug)]
pub struct Budget {
    limit: u64,
    taken: u128,
    fix: &'static str,
}

impl Budget {
    /// A budget of `limit` bytes. `fix` says what helps where it does not suffice.
    pub fn new(limit: u64, fix: &'static str) -> Budget {
        Budget { limit, taken: 0, fix }
    }

    /// Counts `bytes` that `what` is about to take. They add up with all that were counted before.
    ///
    /// # Errors
    /// [`Error::Memory`] where the sum is over the limit.
    pub fn take(&mut self, bytes: u128, what: impl FnOnce() -> String) -> Result<()> {
        self.taken = self.taken.saturating_add(bytes);
        if self.taken > u128::from(self.limit) {
            return Err(Error::memory(what(), self.taken, self.limit, self.fix));
        }
        Ok(())
    }
}
