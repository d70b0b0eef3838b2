//! Ctrl-C and SIGTERM: the first asks the work to stop, the second ends it.
//!
//! The command that is asked to stop writes nothing and exits 130. Work asks only now
//! and then whether it is to go on, and a single ray may keep it for minutes; so what has
//! not stopped of itself after a while is ended, unless its files are getting their names.
//! So is a wait for a pipe that nobody reads. Ended at once, the process still takes its unfinished
//! files with it.

use super::error::CliError;
use super::output::complain;
use crate::io::discard_unfinished;
use crate::render::Progress;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::time::Duration;

/// For work to stop of itself.
const PATIENCE: Duration = Duration::from_secs(3);

/// Who says how the process ends: nobody yet, its work, or lost patience.
static ENDS: AtomicU8 = AtomicU8::new(OPEN);
const OPEN: u8 = 0;
const BY_WORK: u8 = 1;
const BY_PATIENCE: u8 = 2;

/// Results go to standard output, a device or a pipe, which may have part of them.
static SENDING: AtomicBool = AtomicBool::new(false);

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
        // Without it the second signal is left.
        let _ = std::thread::Builder::new().spawn(lose_patience);
    });
    progress
}

fn lose_patience() {
    std::thread::sleep(PATIENCE);
    let taken = ENDS.compare_exchange(OPEN, BY_PATIENCE, Ordering::SeqCst, Ordering::SeqCst);
    if taken.is_ok() {
        let _nothing_begins = discard_unfinished();
        let error = match SENDING.load(Ordering::SeqCst) {
            true => CliError::Unread,
            false => CliError::Interrupted,
        };
        complain(&format!("error: {error}"));
        std::process::exit(error.exit_code().into());
    }
}

/// From here on results are written where they cannot be taken back. No file has its
/// name yet.
pub fn sending() {
    SENDING.store(true, Ordering::SeqCst);
}

/// From here on files appear, or an error is told: no lost patience comes between.
/// Does not return where that came first.
pub fn settle() {
    let before = ENDS.compare_exchange(OPEN, BY_WORK, Ordering::SeqCst, Ordering::SeqCst);
    while before == Err(BY_PATIENCE) {
        std::thread::park();
    }
}

/// Between two stages: stop here if asked to.
pub fn check(progress: &Progress) -> Result<(), CliError> {
    if progress.is_cancelled() {
        Err(CliError::Interrupted)
    } else {
        Ok(())
    }
}
