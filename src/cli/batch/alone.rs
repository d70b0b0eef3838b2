//! Tasks that have ended their process before: each is done last, by a process of its own, so that
//! one that ends it again is known for certain, and takes nothing with it.

use super::records::Failure;
use crate::args::BatchArgs;
use crate::error::CliError;
use lanecast_picture::render::Progress;
use std::process::{Command, ExitStatus, Stdio};
use std::time::Duration;

/// How often the end of the process is looked for.
const PAUSE: Duration = Duration::from_millis(20);

/// How a task ended that was done alone.
pub enum Ended {
    Done,
    /// It failed, and its process has recorded why.
    Failed,
    /// It ended its process, too.
    Died(Failure),
}

/// Does a task in a process of its own, and waits for its end.
pub fn done(
    args: &BatchArgs,
    number: u32,
    threads: u32,
    progress: &Progress,
) -> Result<Ended, CliError> {
    let failed = |e: std::io::Error| {
        CliError::Input(format!("no process can be started for task {number}: {e}"))
    };
    let program = std::env::current_exe().map_err(failed)?;
    let mut command = Command::new(program);
    command.arg("batch").arg(&args.job);
    command.args(
        args.out
            .iter()
            .flat_map(|out| ["--out".as_ref(), out.as_os_str()]),
    );
    let (number_text, threads) = (number.to_string(), threads.to_string());
    command.args(["--tasks", &number_text, "--threads", &threads]);
    command.args(["--progress", "none", "--alone"]);
    command.stdin(Stdio::null()).stdout(Stdio::null());
    let mut child = command.spawn().map_err(failed)?;
    loop {
        if let Some(status) = child.try_wait().map_err(failed)? {
            return ended(status);
        }
        if progress.is_cancelled() {
            let _ = child.kill();
            let _ = child.wait();
            return Err(CliError::Interrupted);
        }
        std::thread::sleep(PAUSE);
    }
}

fn ended(status: ExitStatus) -> Result<Ended, CliError> {
    match status.code() {
        Some(0) => Ok(Ended::Done),
        Some(1) => Ok(Ended::Failed),
        Some(130) => Err(CliError::Interrupted),
        Some(4) => Err(CliError::Stopped(
            "a task's process could not write its output; see above".into(),
        )),
        _ => Ok(Ended::Died(Failure {
            code: None,
            message: format!(
                "poisoned: it has ended its process each time, and again in one of its own \
                 ({status})"
            ),
            again: false,
        })),
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::os::unix::process::ExitStatusExt;

    #[test]
    fn a_process_that_is_killed_has_poison() {
        let of = |raw| ended(ExitStatus::from_raw(raw));
        assert!(matches!(of(0), Ok(Ended::Done)));
        assert!(matches!(of(1 << 8), Ok(Ended::Failed)));
        assert!(matches!(of(130 << 8), Err(CliError::Interrupted)));
        for killed in [9, 11, 134 << 8] {
            let Ok(Ended::Died(failure)) = of(killed) else {
                panic!("{killed}");
            };
            assert!(failure.message.contains("poisoned") && !failure.again);
        }
    }
}
