//! The memory that a picture takes, compared with what is free before any work.

use super::error::CliError;
use lanecast_io::{AovSet, Bits};
use lanecast_picture::render::{Backdrop, RenderConfig, picture_bytes};
use std::path::Path;

/// Refuses a picture that needs more memory than the system has free, where it tells.
pub fn check(config: &RenderConfig, bits: Bits, path: &Path) -> Result<(), CliError> {
    match free() {
        Some(free) => compare(config, bits, path, free),
        None => Ok(()),
    }
}

/// Refuses a part of a picture that needs more memory than the system has free: its sums, and
/// the file.
pub fn check_part(config: &RenderConfig) -> Result<(), CliError> {
    let needed = 64 * u64::from(config.width) * u64::from(config.height);
    match free() {
        Some(free) if needed > free => Err(CliError::Memory(format!(
            "a part of a picture of {}x{} needs {} MB of memory, and {} MB are free; ask for a \
             smaller --size",
            config.width,
            config.height,
            needed.div_ceil(1_000_000),
            free.div_ceil(1_000_000)
        ))),
        _ => Ok(()),
    }
}

fn compare(config: &RenderConfig, bits: Bits, path: &Path, free: u64) -> Result<(), CliError> {
    let needed = needed(config, bits, path);
    if needed <= free {
        return Ok(());
    }
    let fewer = match config.aovs.any() {
        true => "fewer outputs with --aov, or ",
        false => "",
    };
    let megabytes = |bytes: u64| bytes.div_ceil(1_000_000);
    Err(CliError::Memory(format!(
        "a picture of {}x{} with what --aov asks for needs {} MB of memory, and {} MB are free; ask \
         for {fewer}a smaller --size, or render tiles of it with --tile",
        config.width,
        config.height,
        megabytes(needed),
        megabytes(free)
    )))
}

/// Returns the bytes of a picture, and of its largest file while it is written: OpenEXR
/// takes a copy of its channels and the encoded file, PNG the samples of a pixel twice.
pub fn needed(config: &RenderConfig, bits: Bits, path: &Path) -> u64 {
    let window = config.window();
    let columns = |aovs| picture_bytes(window.width, window.height, aovs, config.matte_ranks);
    let (mut all, mut color) = (columns(config.aovs), columns(AovSet::default()));
    if config.backdrop == Backdrop::Transparent {
        // A column of alpha, beside three of colour.
        all += color / 3;
        color += color / 3;
    }
    let samples = match bits {
        Bits::Eight => color / 4,
        Bits::Sixteen => color / 2,
    };
    let is_exr = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("exr"));
    let file = match is_exr {
        true => 2 * all,
        false => (2 * (all - color)).max(2 * samples),
    };
    all + file
}

/// Gives memory that is free back to the system. The allocator of GNU/Linux keeps pages that lie below others
/// in use, so that a process that loads one scene after the other grows.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
pub fn give_back() {
    // SAFETY: it takes no pointer, leaves all memory that is in use as it is, and may be called by any
    // thread at any time.
    unsafe { libc::malloc_trim(0) };
}

#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub fn give_back() {}

/// Returns the memory that a process can get, by what Linux tells.
fn free() -> Option<u64> {
    available(&std::fs::read_to_string("/proc/meminfo").ok()?)
}

fn available(told: &str) -> Option<u64> {
    let line = told
        .lines()
        .find(|line| line.starts_with("MemAvailable:"))?;
    let kilobytes: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    kilobytes.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_that_does_not_fit_is_refused_with_the_number() {
        let mut config = RenderConfig {
            width: 16_384,
            height: 16_384,
            ..RenderConfig::default()
        };
        let pixels = 1_u64 << 28;
        let png = Path::new("x.png");
        assert_eq!(needed(&config, Bits::Eight, png), 18 * pixels);
        assert_eq!(
            needed(&config, Bits::Eight, Path::new("x.EXR")),
            36 * pixels
        );
        assert_eq!(needed(&config, Bits::Sixteen, png), 24 * pixels);
        for name in AovSet::NAMES {
            assert!(config.aovs.add(name));
        }
        assert_eq!(needed(&config, Bits::Eight, png), (500 + 2 * 320) * pixels);
        assert!(compare(&config, Bits::Eight, png, 1 << 46).is_ok());
        let error = compare(&config, Bits::Eight, png, 24_000_000_000).unwrap_err();
        assert_eq!(error.exit_code(), 3);
        let said = error.to_string();
        for part in ["16384x16384", "306017 MB", "24000 MB", "--aov", "--size"] {
            assert!(said.contains(part), "{said}");
        }
    }

    #[test]
    fn what_is_free_is_read() {
        let told = "MemTotal:  99 kB\nMemFree: 1 kB\nMemAvailable:   12 kB\n";
        assert_eq!(available(told), Some(12 * 1024));
        assert_eq!(available("MemTotal: 1 kB\n"), None);
    }
}
