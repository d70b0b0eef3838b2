//! The progress bar: rays per second and the time left, on standard error if that is a
//! terminal.

use crate::render::Progress;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// A drawn progress bar, which is cleared when this value is dropped.
pub struct Drawing {
    running: Option<(Sender<()>, JoinHandle<()>)>,
}

impl Drawing {
    pub fn start(progress: &Arc<Progress>) -> Drawing {
        let running = std::io::stderr().is_terminal().then(|| {
            let (stop, stopped) = channel();
            let progress = Arc::clone(progress);
            let thread = std::thread::spawn(move || {
                let bar = bar();
                let start = Instant::now();
                let pause = Duration::from_millis(100);
                // Nothing is ever sent: dropping the sender is the signal.
                while stopped.recv_timeout(pause) == Err(RecvTimeoutError::Timeout) {
                    draw(&bar, &progress, start.elapsed());
                }
                bar.finish_and_clear();
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

fn bar() -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(0), ProgressDrawTarget::stderr());
    if let Ok(style) = ProgressStyle::with_template("{bar:32} {percent:>3} %  {msg}  {eta} left") {
        bar.set_style(style);
    }
    bar
}

fn draw(bar: &ProgressBar, progress: &Progress, elapsed: Duration) {
    let tiles = progress.tiles.load(Relaxed);
    if tiles == 0 {
        return;
    }
    bar.set_length(u64::from(tiles));
    bar.set_position(u64::from(progress.tiles_done.load(Relaxed)));
    let message = if progress.is_cancelled() {
        "stopping".into()
    } else {
        let rays = progress.rays.load(Relaxed) as f64;
        rate(rays / elapsed.as_secs_f64().max(1e-3))
    };
    bar.set_message(message);
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
    use super::rate;

    #[test]
    fn rates_text_report() {
        assert_eq!(rate(0.0), "0 rays/s");
        assert_eq!(rate(999.0), "999 rays/s");
        assert_eq!(rate(12_345.0), "12.3 krays/s");
        assert_eq!(rate(20_000_000.0), "20.0 Mrays/s");
        assert_eq!(rate(1.5e9), "1.50 Grays/s");
    }
}
