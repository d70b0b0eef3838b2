//! How tasks end without a picture.

use super::records::Failure;
use crate::error::CliError;
use lanecast_io::SaveError;
use std::any::Any;

/// The exit code of Rust's programs that panic.
const PANIC: u8 = 101;

/// How a task ends without a picture.
pub enum End {
    /// It failed; others go on.
    Failed(Failure),
    /// Others would fail, too.
    Stop(CliError),
}

impl From<CliError> for End {
    fn from(error: CliError) -> End {
        match error {
            CliError::Interrupted | CliError::Save(SaveError::Write { .. }) => End::Stop(error),
            error => End::Failed(Failure {
                code: Some(error.exit_code()),
                message: error.to_string(),
                again: matches!(error, CliError::Memory(_)),
            }),
        }
    }
}

/// Returns the failure of a panic.
pub fn panicked(panic: &(dyn Any + Send)) -> Failure {
    let text = panic.downcast_ref::<&str>().map(|text| text.to_string());
    let text = text.or_else(|| panic.downcast_ref::<String>().cloned());
    Failure {
        code: Some(PANIC),
        message: format!(
            "a mistake of the program: {}; please report it with the scene",
            text.as_deref().unwrap_or("it panicked")
        ),
        again: true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::panic::catch_unwind;

    #[test]
    fn a_panic_is_a_failure_that_is_tried_again() {
        let panic = catch_unwind(|| panic!("at {}", 3)).unwrap_err();
        let failure = panicked(&*panic);
        assert_eq!((failure.code, failure.again), (Some(101), true));
        assert!(failure.message.contains("at 3"), "{}", failure.message);
    }
}
