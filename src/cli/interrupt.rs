//! Ctrl-C and SIGTERM: the first signal cancels the work, the second ends the process.
//!
//! A cancelled command writes nothing and exits with 130. The work reads the flag only
//! now and then, and a single ray may take minutes; a process that has not stopped
//! after [`GRACE_PERIOD`] is therefore ended, unless its files are being renamed into
//! place: from then on signals are without effect. The same applies to a wait for a pipe that nobody reads. A process that is
//! ended this way still removes its unfinished files, and ends the programs that run for it.

use super::error::CliError;
use super::output::complain;
use lanecast_io::{discard_unfinished, end_children};
use lanecast_picture::render::Progress;
#[cfg(unix)]
use signal_hook::consts::SIGXFSZ;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::Duration;

/// Time that cancelled work gets to stop by itself.
const GRACE_PERIOD: Duration = Duration::from_secs(3);

/// The party that ends the process: undecided, its work, or the timeout.
static ENDED_BY: AtomicU8 = AtomicU8::new(UNDECIDED);
const UNDECIDED: u8 = 0;
const BY_WORK: u8 = 1;
const BY_TIMEOUT: u8 = 2;

/// Set while results go to standard output, a device or a pipe, which may already have
/// received part of them.
static SENDING: AtomicBool = AtomicBool::new(false);

/// Set by a command whose finished parts stay.
static KEEPS: AtomicBool = AtomicBool::new(false);

/// Set once a signal has come to a process that [`watch`] looks after.
static SIGNALLED: AtomicBool = AtomicBool::new(false);

/// Returns the error that counts: what fails after a signal may have failed by it, as another
/// program that the terminal has interrupted, too.
pub fn cause(error: CliError) -> CliError {
    match error {
        CliError::Load(_) if SIGNALLED.load(Ordering::SeqCst) => CliError::Interrupted,
        other => other,
    }
}

/// Returns the progress whose `cancel` the first signal sets: always the same one, so that a command
/// of several stages is ended in any of them.
pub fn watch() -> Arc<Progress> {
    static WATCHED: OnceLock<Arc<Progress>> = OnceLock::new();
    Arc::clone(WATCHED.get_or_init(watched))
}

fn watched() -> Arc<Progress> {
    let progress = Arc::new(Progress::default());
    let watched = Arc::clone(&progress);
    // Without a handler, a signal ends the process by default.
    let _ = ctrlc::set_handler(move || {
        if watched.is_cancelled() {
            end();
        }
        watched.cancel();
        SIGNALLED.store(true, Ordering::SeqCst);
        // Without this thread the second signal still works.
        let _ = std::thread::Builder::new().spawn(|| {
            std::thread::sleep(GRACE_PERIOD);
            end();
        });
    });
    progress
}

/// Lets the first signal end the process, for commands whose work cannot be cancelled.
/// Call this once, instead of [`watch`].
pub fn end_at_signal() {
    let _ = ctrlc::set_handler(end);
}

/// Lets the first signal end the process as done, for a server that works until it is ended. Call
/// this once, instead of [`watch`].
#[cfg(feature = "view")]
pub fn leave_at_signal() {
    let _ = ctrlc::set_handler(|| {
        let _nothing_begins = (end_children(), discard_unfinished());
        std::process::exit(0);
    });
}

/// Lets a file that grows beyond the limit of the shell's `ulimit -f` be an error of
/// writing; by default the signal ends the process.
pub fn survive_file_size_limit() {
    #[cfg(unix)]
    let _ = signal_hook::flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false)));
}

/// Ends the process, unless its work has ended and files are being renamed.
fn end() {
    let taken =
        ENDED_BY.compare_exchange(UNDECIDED, BY_TIMEOUT, Ordering::SeqCst, Ordering::SeqCst);
    if taken.is_ok() {
        let _nothing_begins = (end_children(), discard_unfinished());
        let keeps = || {
            CliError::Stopped(
                "interrupted; what is done stays, and the same command goes on".into(),
            )
        };
        let error = match SENDING.load(Ordering::SeqCst) {
            true => CliError::Unread,
            false if KEEPS.load(Ordering::SeqCst) => keeps(),
            false => CliError::Interrupted,
        };
        complain(&format!("error: {error}"));
        std::process::exit(error.exit_code().into());
    }
}

/// Records that what is done stays if the process is ended.
pub fn keep_what_is_done() {
    KEEPS.store(true, Ordering::SeqCst);
}

/// Records that results are now written where they cannot be taken back; no file has
/// its final name yet.
pub fn begin_sending() {
    SENDING.store(true, Ordering::SeqCst);
}

/// Disables the timeout before files get their names or an error is reported. Does not
/// return if the timeout came first.
pub fn disable_timeout() {
    let before = ENDED_BY.compare_exchange(UNDECIDED, BY_WORK, Ordering::SeqCst, Ordering::SeqCst);
    while before == Err(BY_TIMEOUT) {
        std::thread::park();
    }
}

/// Returns an error between two stages if the work was cancelled.
pub fn check(progress: &Progress) -> Result<(), CliError> {
    if progress.is_cancelled() {
        Err(CliError::Interrupted)
    } else {
        Ok(())
    }
}
