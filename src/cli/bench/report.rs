//! Reports of `bench`: JSON, and tables for readers.

use lanecast_measure::bench::{Comparison, Row};
use lanecast_measure::growth::Growth;
use lanecast_measure::index_stats::StructureRow;
use serde::Serialize;

/// The value that `--json` writes.
#[derive(Serialize)]
pub struct Report {
    #[serde(flatten)]
    pub origin: Origin,
    /// Figures of the first structure.
    pub build_seconds: f64,
    pub tree_bytes: usize,
    pub triangles: u64,
    pub instances: u64,
    /// `thread cpu` or `wall`.
    pub clock: &'static str,
    pub reps: u32,
    /// Orders of camera rays; where they are several, names of ray sets end with theirs.
    pub order: Vec<&'static str>,
    pub structures: Vec<StructureRow>,
    pub results: Vec<Row>,
    /// Our contenders beside the baseline's; empty without one.
    pub comparisons: Vec<Comparison>,
}

/// What the figures were measured with, so that they can be measured again.
#[derive(Serialize)]
pub struct Origin {
    /// The file; null without one.
    pub scene: Option<String>,
    /// Width and height of the camera's picture, in pixels.
    pub size: [u32; 2],
    pub arguments: Vec<String>,
    pub version: &'static str,
    /// The variable LANECAST_COMMIT at the time of the build; null without it.
    pub commit: Option<&'static str>,
    /// The processor's name; null where the system does not tell.
    pub processor: Option<String>,
    /// Day and time, in UTC.
    pub date: String,
}

impl Origin {
    /// Collects what is known of this run.
    pub fn now(scene: Option<String>, size: [u32; 2]) -> Origin {
        let arguments = std::env::args_os().skip(1);
        Origin {
            scene,
            size,
            arguments: arguments.map(|a| a.to_string_lossy().into()).collect(),
            version: env!("CARGO_PKG_VERSION"),
            commit: option_env!("LANECAST_COMMIT"),
            processor: processor(),
            date: date(std::time::SystemTime::now()),
        }
    }
}

/// Returns the processor's name as Linux tells it.
fn processor() -> Option<String> {
    let told = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = told.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().into())
}

/// Formats a time of day in UTC as `2026-01-31T23:59:59Z`, by H. Hinnant's
/// `civil_from_days`.
fn date(time: std::time::SystemTime) -> String {
    let since = time.duration_since(std::time::UNIX_EPOCH);
    let seconds = since.unwrap_or_default().as_secs();
    let days = seconds / 86_400 + 719_468;
    let (era, day) = (days / 146_097, days % 146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let of_year = day - (365 * year + year / 4 - year / 100);
    // Years begin in March.
    let month = (5 * of_year + 2) / 153;
    let (day, month, late) = (
        of_year - (153 * month + 2) / 5 + 1,
        (month + 2) % 12 + 1,
        u64::from(month >= 10),
    );
    let (year, seconds) = (year + era * 400 + late, seconds % 86_400);
    let (hour, minute, second) = (seconds / 3600, seconds / 60 % 60, seconds % 60);
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}Z")
}

impl Report {
    pub fn table(&self) -> String {
        let threads = self.results.first().map_or(1, |row| row.threads);
        let mut text = format!(
            "{} instances, {} triangles; {threads} thread{}, {} time, {} runs each\n\n",
            self.instances,
            self.triangles,
            if threads == 1 { "" } else { "s" },
            self.clock,
            self.reps,
        );
        text += &structures(&self.structures);
        text += &results(&self.results);
        text += &comparisons(&self.comparisons, &self.results);
        text
    }
}

fn structures(rows: &[StructureRow]) -> String {
    let mut text = format!(
        "{:<28} {:>9} {:>9} {:>9} {:>9} {:>9}\n",
        "structure", "build s", "Mtris/s", "MB", "B/tri", "SAH"
    );
    for row in rows {
        let [top, mesh] = row.sah.unwrap_or_default();
        let sah = if row.triangles > 0 { mesh } else { top };
        let sah = match row.sah {
            Some(_) => format!("{sah:.1}"),
            None => "-".into(),
        };
        text += &format!(
            "{:<28} {:>9.3} {:>9.2} {:>9.1} {:>9.1} {sah:>9}\n",
            row.name,
            row.build_seconds,
            row.build_mtris_per_s,
            row.tree_bytes as f64 * 1e-6,
            row.bytes_per_triangle,
        );
    }
    text
}

fn results(rows: &[Row]) -> String {
    let kernel = rows.iter().map(|row| row.kernel.len()).max().unwrap_or(0);
    let width = kernel.max("kernel".len());
    let mut text = format!(
        "\n{:<12} {:<8} {:<width$} {:<9} {:>5} {:>9} {:>9}  {:>8} {:>8} {:>7} {:>8}\n",
        "kind",
        "accel",
        "kernel",
        "precision",
        "lanes",
        "rays",
        "hits",
        "Mrays/s",
        "best",
        "cached",
        "differ",
    );
    for row in rows {
        let Row {
            kind,
            accel,
            kernel,
            precision,
            lanes,
            rays,
            hits,
            ..
        } = row;
        let cached = match (row.shadow_cache, row.cache_hits_per_ray) {
            (Some("off"), _) => "off".into(),
            (_, Some(share)) => format!("{:.1}%", share * 100.0),
            _ => "-".into(),
        };
        text += &format!(
            "{kind:<12} {accel:<8} {kernel:<width$} {precision:<9} {lanes:>5} {rays:>9} \
             {hits:>9}  {:>8.3} {:>8.3} {cached:>7} {:>8}\n",
            row.mrays_per_s, row.mrays_per_s_best, row.differences.differ,
        );
    }
    if let Some(checked) = rows.iter().map(|row| row.differences.checked).max() {
        text += &format!(
            "differ: answers that differ from exact tracing at one lane, of at most {checked} rays \
             of each set\n"
        );
    }
    text
}

fn comparisons(all: &[Comparison], rows: &[Row]) -> String {
    if all.is_empty() {
        return String::new();
    }
    let mut text = format!(
        "\n{:<12} {:<9} {:>8} {:>8} {:>7}  the baseline's best\n",
        "kind", "precision", "ours", "baseline", "ratio"
    );
    for one in all {
        let (own, peer) = (&rows[one.own], &rows[one.peer]);
        let direction = if own.kind == peer.kind {
            String::new()
        } else {
            format!(" ({})", peer.kind)
        };
        text += &format!(
            "{:<12} {:<9} {:>8.3} {:>8.3} {:>6.2}x  {}{direction}\n",
            one.kind, one.precision, own.mrays_per_s, peer.mrays_per_s, one.ratio, peer.kernel,
        );
    }
    text
}

/// Formats structures and rates of each size, then the fits.
pub fn growth_table(growth: &Growth) -> String {
    let mut text = String::new();
    for size in &growth.sizes {
        let peak = match size.peak_resident_bytes {
            Some(bytes) => format!(", peak memory {:.1} MB", bytes as f64 * 1e-6),
            None => String::new(),
        };
        text += &format!("{} triangles{peak}\n", size.triangles);
        text += &structures(&size.structures);
        text += &results(&size.results);
        text += &comparisons(&size.comparisons, &size.results);
        text.push('\n');
    }
    text += &format!("{:<8} {:<44} {:>9} {:>7}\n", "fit", "of", "exponent", "r2");
    for fit in &growth.fits {
        text += &format!(
            "{:<8} {:<44} {:>9.3} {:>7.4}\n",
            fit.what, fit.name, fit.exponent, fit.r2
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::date;
    use std::time::{Duration, UNIX_EPOCH};

    #[test]
    fn dates_are_those_of_the_calendar() {
        let at = |seconds| date(UNIX_EPOCH + Duration::from_secs(seconds));
        assert_eq!(at(0), "1970-01-01T00:00:00Z");
        assert_eq!(at(951_782_400), "2000-02-29T00:00:00Z");
        assert_eq!(at(951_868_799), "2000-02-29T23:59:59Z");
        assert_eq!(at(1_735_689_599), "2024-12-31T23:59:59Z");
        assert_eq!(at(4_107_542_400), "2100-03-01T00:00:00Z");
    }
}
