//! Progress reports, warnings, and a way to stop long work.

use super::error::Result;

/// Observer of a job: receives progress and warnings, and decides between pieces of work whether to go on.
pub trait Monitor: Sync {
    /// Reports that `done` of `total` pieces of `stage` are finished.
    ///
    /// # Errors
    /// Returns an error to end the job at once; nothing unfinished is kept.
    fn progress(&self, stage: &'static str, done: u64, total: u64) -> Result<()>;
    /// Reports something that the user should know and that does not stop the work.
    fn warn(&self, text: &str);
}

/// Monitor that ignores every report and never stops the job.
pub struct Unwatched;

impl Monitor for Unwatched {
    fn progress(&self, _: &'static str, _: u64, _: u64) -> Result<()> {
        Ok(())
    }
    fn warn(&self, _: &str) {}
}

/// Monitor that passes on progress but no warnings, for work that is done once more later.
pub struct Unwarned<'a>(pub &'a dyn Monitor);

impl Monitor for Unwarned<'_> {
    fn progress(&self, stage: &'static str, done: u64, total: u64) -> Result<()> {
        self.0.progress(stage, done, total)
    }
    fn warn(&self, _: &str) {}
}
