//! Ctrl-C and SIGTERM: the first asks the work to stop, the second ends it.
//!
//! The command that is asked to stop writes nothing and exits 130. Work asks only now
//! and then whether it is to go on, and a single ray may keep it for minutes; so what has
//! not stopped of itself after a while is ended as by a second signal. Ended at once, the
//! process still takes its unfinished files with it.

use super::error::CliError;
use super::output::complain;
use crate::io::discard_unfinished;
use crate::render::Progress;
use std::sync::Arc;
use std::time::Duration;

/// For work to stop of itself.
const PATIENCE: Duration = Duration::from_secs(3);

/// A progress whose `cancel` is set by the first signal. Call it once.
pub fn watch() -> Arc<Progress> {
    let progress = Arc::new(Progress::default());
    let watched = Arc::clone(&progress);
    // If there can be no handler, a signal ends the process as it always would.
    let _ = ctrlc::set_handler(move || {
        if watched.is_cancelled() {
            end();
        }
        watched.cancel();
        std::thread::spawn(|| {
            std::thread::sleep(PATIENCE);
            end();
        });
    });
    progress
}

fn end() -> ! {
    let _nothing_begins = discard_unfinished();
    let error = CliError::Interrupted;
    complain(&format!("error: {error}"));
    std::process::exit(error.exit_code().into());
}

/// Between two stages: stop here if asked to.
pub fn check(progress: &Progress) -> Result<(), CliError> {
    if progress.is_cancelled() {
        Err(CliError::Interrupted)
    } else {
        Ok(())
    }
}
