//! Progress, warnings, and the way to stop long work.

use super::error::Result;

/// Watches a job: told of progress and warnings, asked between pieces of work whether to go on.
pub trait Monitor: Sync {
    /// `done` of `total` pieces of `stage` are finished. An error ends the job at once; nothing
    /// unfinished is kept.
    fn progress(&self, stage: &'static str, done: u64, total: u64) -> Result<()>;
    /// Something the user should know that does not stop the work.
    fn warn(&self, text: &str);
}

/// Watches nothing and never stops.
pub struct Unwatched;

impl Monitor for Unwatched {
    fn progress(&self, _: &'static str, _: u64, _: u64) -> Result<()> {
        Ok(())
    }
    fn warn(&self, _: &str) {}
}
