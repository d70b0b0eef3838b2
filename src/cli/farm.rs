//! Lines on standard output that engines of farms read: how far a command is, and why it failed.
//!
//! Open Job Description, "How Jobs Are Run": `openjd_progress: 37.0`, `openjd_status: TEXT` and
//! `openjd_fail: TEXT`. Afanasy's generic parser: `PROGRESS: 37%`.

use super::output::{print, printable_line};

/// An engine that runs the command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Engine {
    OpenJd,
    Afanasy,
}

impl Engine {
    /// Says a failure; Afanasy takes the exit code.
    pub fn tell_failure(self, message: &str) {
        if self == Engine::OpenJd {
            say(&format!("openjd_fail: {}", printable_line(message)));
        }
    }
}

/// The lines of a stage of work.
pub struct FarmLines {
    engine: Engine,
    /// The time of the last line, in seconds.
    last: f64,
    /// What it said; engines show what goes back as an error.
    percent: f64,
}

impl FarmLines {
    pub fn of(engine: Engine) -> FarmLines {
        FarmLines {
            engine,
            last: f64::NEG_INFINITY,
            percent: f64::NEG_INFINITY,
        }
    }

    /// Shows a percentage at a time, unless a line was shown just before or it does not differ.
    pub fn show(&mut self, seconds: f64, percent: f64, status: impl Fn() -> String) {
        /// Seconds from one line to the next: engines keep all of them.
        const PAUSE: f64 = 1.0;
        let percent = match self.engine {
            Engine::OpenJd => (percent * 10.0).floor() / 10.0,
            Engine::Afanasy => percent.floor(),
        };
        if seconds - self.last < PAUSE || percent <= self.percent {
            return;
        }
        (self.last, self.percent) = (seconds, percent);
        match self.engine {
            Engine::OpenJd => say(&format!(
                "openjd_progress: {percent:.1}\nopenjd_status: {}",
                status()
            )),
            Engine::Afanasy => say(&format!("PROGRESS: {percent:.0}%")),
        }
    }
}

/// Prints lines; that nobody reads them is no failure of the work.
fn say(lines: &str) {
    let _unread = print(&format!("{lines}\n"));
}
