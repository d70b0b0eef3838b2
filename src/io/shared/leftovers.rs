//! Temporary files of processes that were killed: their names, and their removal.
//!
//! A temporary file is called `.lanecast-HOST-PID-RANDOM.tmp`. HOST stands for the machine
//! and its set of process ids, so that a folder which several machines or containers share
//! is safe. A file is removed if its process is known to be gone, and is left alone
//! whenever that is not certain.

use std::fs;
use std::io::ErrorKind;
use std::path::Path;

/// Returns how the names of a process's temporary files begin.
pub(super) fn prefix(process: u32) -> String {
    format!(".lanecast-{}-{process}-", host())
}

/// Removes the temporary files that dead processes of this machine left in a folder.
/// Failures are ignored: the files are in nobody's way.
pub fn sweep(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else {
        return;
    };
    for entry in entries.flatten() {
        let left = entry.file_name().to_str().and_then(process_of);
        let is_file = || entry.file_type().is_ok_and(|kind| kind.is_file());
        if left.is_some_and(is_dead) && is_file() {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Returns the process that named a file, if that was one of this machine.
fn process_of(name: &str) -> Option<u32> {
    let rest = name.strip_prefix(".lanecast-")?.strip_suffix(".tmp")?;
    let (process, _) = rest
        .strip_prefix(&host())?
        .strip_prefix('-')?
        .split_once('-')?;
    process.parse().ok()
}

/// Whether there is no process of this number, or only one that has ended and waits for its
/// parent to look. Only Linux can tell.
fn is_dead(process: u32) -> bool {
    let processes = Path::new("/proc");
    match fs::read_to_string(processes.join(process.to_string()).join("stat")) {
        // The state follows the name, which may hold anything.
        Ok(stat) => stat
            .rsplit_once(") ")
            .is_some_and(|(_, rest)| rest.starts_with(['Z', 'X'])),
        Err(e) if e.kind() == ErrorKind::NotFound => processes.join("self").exists(),
        Err(_) => false,
    }
}

/// Returns a number in hexadecimal digits for the machine and the process's namespace.
fn host() -> String {
    let name = fs::read("/proc/sys/kernel/hostname").unwrap_or_default();
    let space = fs::read_link("/proc/self/ns/pid").unwrap_or_default();
    let both = [&name, space.as_os_str().as_encoded_bytes()].concat();
    // FNV-1a: the same in every version of the program.
    let fold = |hash: u32, byte: &u8| (hash ^ u32::from(*byte)).wrapping_mul(0x0100_0193);
    format!("{:08x}", both.iter().fold(0x811c_9dc5, fold))
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn only_files_of_dead_processes_are_swept() {
        let folder = tempfile::tempdir().unwrap();
        // Ended, and not looked at before the end of the test.
        let mut ended = std::process::Command::new("true").spawn().unwrap();
        let dead = ended.id();
        while !is_dead(dead) {
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        let alive = std::process::id();
        let (host, other) = (host(), "00000000");
        let kept = [
            format!(".lanecast-{host}-{alive}-abc.tmp"),
            format!(".lanecast-{other}-{dead}-abc.tmp"),
            format!(".lanecast-{host}-{dead}-abc"),
            format!(".lanecast-{host}-x{dead}-abc.tmp"),
            ".lanecast-abcdef.tmp".into(),
            "x.png".into(),
        ];
        let gone = prefix(dead) + "abc.tmp";
        for name in kept.iter().chain([&gone]) {
            fs::write(folder.path().join(name), "").unwrap();
        }
        fs::create_dir(folder.path().join(prefix(dead) + "d.tmp")).unwrap();
        sweep(folder.path());
        let left = |name: &String| folder.path().join(name).exists();
        assert!(kept.iter().all(left));
        assert!(!left(&gone));
        assert_eq!(fs::read_dir(&folder).unwrap().count(), kept.len() + 1);
        ended.wait().unwrap();
        assert!(is_dead(dead) && !is_dead(alive));
    }
}
