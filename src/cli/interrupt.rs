//! Ctrl-C and SIGTERM: the first asks the work to stop, the second ends it.
//!
//! The command that is asked to stop writes nothing and exits 130. Ended at
//! once, the process still takes its unfinished files with it.

use super::error::CliError;
use crate::io::discard_unfinished;
use crate::render::Progress;
use std::sync::Arc;

/// A progress whose `cancel` is set by the first signal. Call it once.
pub fn watch() -> Arc<Progress> {
    let progress = Arc::new(Progress::default());
    let watched = Arc::clone(&progress);
    // If there can be no handler, a signal ends the process as it always would.
    let _ = ctrlc::set_handler(move || {
        if watched.is_cancelled() {
            let _nothing_begins = discard_unfinished();
            std::process::exit(130);
        }
        watched.cancel();
    });
    progress
}

/// Between two stages: stop here if asked to.
pub fn check(progress: &Progress) -> Result<(), CliError> {
    if progress.is_cancelled() {
        Err(CliError::Interrupted)
    } else {
        Ok(())
    }
}
