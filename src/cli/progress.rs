//! Progress on standard error: rays per second and the time left, as a bar for people or as JSON
//! for programs; and on standard output for farms (`farm.rs`).
//!
//! The time left is what the tiles that are done took, for those that are not. Tiles are rendered
//! in an order that spreads them over the picture (`render/picture.rs`), so that a tenth of them is a
//! fair sample of all.

use super::farm::{Engine, FarmLines};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use lanecast_picture::render::Progress;
use serde::Serialize;
use std::io::IsTerminal;
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// How progress is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Style {
    /// A bar on a terminal, else nothing.
    #[default]
    Auto,
    /// A bar on a terminal, else a line at each tenth.
    Bar,
    /// A line of JSON about every half second, and one at the end of each stage.
    Json,
    /// Lines on standard output as a farm's engine reads them.
    Farm(Engine),
    None,
}

impl Style {
    pub fn parse(text: &str) -> Result<Style, String> {
        match text {
            "auto" => Ok(Style::Auto),
            "bar" => Ok(Style::Bar),
            "json" => Ok(Style::Json),
            "openjd" => Ok(Style::Farm(Engine::OpenJd)),
            "afanasy" => Ok(Style::Farm(Engine::Afanasy)),
            "none" => Ok(Style::None),
            _ => Err("expected auto, bar, json, openjd, afanasy or none".into()),
        }
    }

    /// Says a failure as a farm's engine reads it, if one does.
    pub fn tell_failure(self, message: &str) {
        if let Style::Farm(engine) = self {
            engine.tell_failure(message);
        }
    }
}

/// Progress that is being shown; dropping the value ends it.
pub struct Drawing {
    running: Option<(Sender<()>, JoinHandle<()>)>,
}

impl Drawing {
    pub fn start(progress: &Arc<Progress>, style: Style) -> Drawing {
        Drawing::start_part(progress, style, (0, 1))
    }

    /// Starts with a stage that is the I-th of N alike.
    pub fn start_part(progress: &Arc<Progress>, style: Style, part: (u32, u32)) -> Drawing {
        let running = Painter::of(style).map(|mut painter| {
            let (stop, stopped) = channel();
            let progress = Arc::clone(progress);
            let thread = std::thread::spawn(move || {
                let start = Instant::now();
                let pause = Duration::from_millis(100);
                // Nothing is ever sent: dropping the sender is the signal.
                while stopped.recv_timeout(pause) == Err(RecvTimeoutError::Timeout) {
                    painter.show(&State::of(&progress, start.elapsed(), part));
                }
                painter.end(&State::of(&progress, start.elapsed(), part));
            });
            (stop, thread)
        });
        Drawing { running }
    }
}

impl Drop for Drawing {
    fn drop(&mut self) {
        if let Some((stop, thread)) = self.running.take() {
            drop(stop);
            let _ = thread.join();
        }
    }
}

/// How far a stage is.
#[derive(Clone, Copy, Debug, Serialize)]
struct State {
    event: &'static str,
    /// Tiles that are done, of `total`; 0 of 0 before their number is known.
    done: u32,
    total: u32,
    rays: u64,
    seconds: f64,
    /// Seconds left; null before the first tile is done.
    eta: Option<f64>,
    #[serde(skip)]
    stopping: bool,
    /// The stage is the I-th of N alike.
    #[serde(skip)]
    part: (u32, u32),
}

impl State {
    fn of(progress: &Progress, elapsed: Duration, part: (u32, u32)) -> State {
        let (done, total) = (
            progress.tiles_done.load(Relaxed),
            progress.tiles.load(Relaxed),
        );
        // A picture of passes takes its last look at all tiles after its work is done.
        let done = done.min(total);
        let seconds = elapsed.as_secs_f64();
        State {
            event: "progress",
            done,
            total,
            rays: progress.rays.load(Relaxed),
            seconds,
            eta: seconds_left(done, total, seconds),
            stopping: progress.is_cancelled(),
            part,
        }
    }

    /// Returns how much of all stages alike is done, from 0 to 100.
    fn percent(&self) -> f64 {
        let stage = f64::from(self.done) / f64::from(self.total.max(1));
        (f64::from(self.part.0) + stage) / f64::from(self.part.1.max(1)) * 100.0
    }

    /// Says how far the stage is in words.
    fn told(&self) -> String {
        let left = self.eta.map(|eta| format!(", {} left", clock(eta)));
        let parts = match self.part {
            (_, 1) => String::new(),
            (part, parts) => format!("{} of {parts}: ", part + 1),
        };
        let (done, total, left) = (self.done, self.total, left.unwrap_or_default());
        format!("{parts}{done} of {total}, {}{left}", self.rate())
    }

    fn rate(&self) -> String {
        rate(self.rays as f64 / self.seconds.max(1e-3))
    }
}

fn seconds_left(done: u32, total: u32, seconds: f64) -> Option<f64> {
    let left = f64::from(total.saturating_sub(done));
    (done > 0).then(|| seconds * left / f64::from(done))
}

/// What shows the states.
enum Painter {
    Bar(ProgressBar),
    /// The tenths that were shown.
    Lines(u32),
    /// The time of the last line, in seconds.
    Json(f64),
    Farm(FarmLines),
}

impl Painter {
    fn of(style: Style) -> Option<Painter> {
        let terminal = std::io::stderr().is_terminal();
        match style {
            Style::Auto | Style::Bar if terminal => Some(Painter::Bar(bar())),
            Style::Bar => Some(Painter::Lines(0)),
            Style::Json => Some(Painter::Json(f64::NEG_INFINITY)),
            Style::Farm(engine) => Some(Painter::Farm(FarmLines::of(engine))),
            Style::Auto | Style::None => None,
        }
    }

    fn show(&mut self, state: &State) {
        /// Seconds from one line of JSON to the next.
        const PAUSE: f64 = 0.5;
        if state.total == 0 {
            return;
        }
        match self {
            Painter::Bar(bar) => draw(bar, state),
            Painter::Lines(shown) => {
                let tenth = (u64::from(state.done) * 10 / u64::from(state.total)) as u32;
                if tenth > *shown && tenth < 10 {
                    let left = clock(state.eta.unwrap_or_default());
                    eprintln!("{:>3} %  {}  {left} left", tenth * 10, state.rate());
                }
                *shown = tenth;
            }
            Painter::Json(last) if state.seconds - *last >= PAUSE => {
                *last = state.seconds;
                print_json(state);
            }
            Painter::Json(_) => {}
            Painter::Farm(lines) => lines.show(state.seconds, state.percent(), || state.told()),
        }
    }

    fn end(self, state: &State) {
        match self {
            Painter::Bar(bar) => bar.finish_and_clear(),
            Painter::Json(_) if state.total > 0 => print_json(state),
            Painter::Farm(mut lines) if state.total > 0 => {
                lines.show(f64::INFINITY, state.percent(), || state.told());
            }
            Painter::Lines(_) | Painter::Json(_) | Painter::Farm(_) => {}
        }
    }
}

/// Writes a state to standard error as one line.
fn print_json(state: &State) {
    if let Ok(line) = serde_json::to_string(state) {
        eprintln!("{line}");
    }
}

fn bar() -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(0), ProgressDrawTarget::stderr());
    if let Ok(style) = ProgressStyle::with_template("{bar:32} {percent:>3} %  {msg}") {
        bar.set_style(style);
    }
    bar
}

fn draw(bar: &ProgressBar, state: &State) {
    bar.set_length(u64::from(state.total));
    bar.set_position(u64::from(state.done));
    let message = match (state.stopping, state.eta) {
        (true, _) => "stopping".into(),
        (false, Some(left)) => format!("{}  {} left", state.rate(), clock(left)),
        (false, None) => state.rate(),
    };
    bar.set_message(message);
}

/// Formats a time as people say it: `8 s`, `2 min 5 s`, `3 h 20 min`.
fn clock(seconds: f64) -> String {
    let seconds = seconds.round() as u64;
    match seconds {
        0..60 => format!("{seconds} s"),
        60..3600 => format!("{} min {} s", seconds / 60, seconds % 60),
        _ => format!("{} h {} min", seconds / 3600, seconds / 60 % 60),
    }
}

/// Formats a rate as `12.3 Mrays/s`.
pub fn rate(rays_per_second: f64) -> String {
    match rays_per_second {
        r if r >= 1e9 => format!("{:.2} Grays/s", r / 1e9),
        r if r >= 1e6 => format!("{:.1} Mrays/s", r / 1e6),
        r if r >= 1e3 => format!("{:.1} krays/s", r / 1e3),
        r => format!("{r:.0} rays/s"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_text_report() {
        assert_eq!(rate(0.0), "0 rays/s");
        assert_eq!(rate(999.0), "999 rays/s");
        assert_eq!(rate(12_345.0), "12.3 krays/s");
        assert_eq!(rate(20_000_000.0), "20.0 Mrays/s");
        assert_eq!(rate(1.5e9), "1.50 Grays/s");
    }

    #[test]
    fn times_as_people_say_them() {
        assert_eq!(clock(7.6), "8 s");
        assert_eq!(clock(125.0), "2 min 5 s");
        assert_eq!(clock(12_000.0), "3 h 20 min");
    }

    #[test]
    fn the_time_left_is_what_the_done_tiles_took() {
        assert_eq!(seconds_left(0, 10, 3.0), None);
        assert_eq!(seconds_left(1, 10, 3.0), Some(27.0));
        assert_eq!(seconds_left(10, 10, 3.0), Some(0.0));
        // A stage may do more than was planned.
        assert_eq!(seconds_left(11, 10, 3.0), Some(0.0));
    }
}
