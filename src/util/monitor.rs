//! Progress, warnings, and the way to stop long work.

use super::error::Result;

/// Observer of a job: receives progress and warnings, and can stop the job between pieces of work.
pub trait Monitor: Sync {
    /// Reports that `done` of `total` pieces of `stage` are finished.
    ///
    /// # Errors
    /// An error ends the job at once; nothing unfinished is kept.
    fn progress(&self, stage: &'static str, done: u64, total: u64) -> Result<()>;
    /// Reports a warning that does not stop the work.
    fn warn(&self, text: &str);
}

/// A monitor that ignores all reports and never stops the job.
pub struct Unwatched;

impl Monitor for Unwatched {
    fn progress(&self, _: &'static str, _: u64, _: u64) -> Result<()> {
        Ok(())
    }
    fn warn(&self, _: &str) {}
}
