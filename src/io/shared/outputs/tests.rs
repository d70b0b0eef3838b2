//! Tests of outputs: all or nothing, links, permissions, devices, and refusals.

use super::*;

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn nothing_before_the_commit_and_everything_after() {
    let folder = tempfile::tempdir().unwrap();
    let (a, b) = (folder.path().join("a"), folder.path().join("b"));
    fs::write(&b, "old").unwrap();
    let mut outputs = Outputs::default();
    outputs.add(&a, b"one".into()).unwrap();
    outputs.add(&b, b"two".into()).unwrap();
    assert!(!a.exists());
    assert_eq!(fs::read(&b).unwrap(), b"old");
    outputs.commit().unwrap();
    assert_eq!(fs::read(&a).unwrap(), b"one");
    assert_eq!(fs::read(&b).unwrap(), b"two");
    assert_eq!(names(folder.path()), ["a", "b"]);
}

#[test]
fn dropped_outputs_leave_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let old = folder.path().join("old");
    fs::write(&old, "as it was").unwrap();
    let mut outputs = Outputs::default();
    outputs.add(&old, b"new".into()).unwrap();
    outputs
        .add(&folder.path().join("new"), b"new".into())
        .unwrap();
    assert_eq!(names(folder.path()).len(), 3);
    drop(outputs);
    assert_eq!(names(folder.path()), ["old"]);
    assert_eq!(fs::read(&old).unwrap(), b"as it was");
}

#[test]
fn a_failed_commit_takes_back_what_it_placed() {
    let folder = tempfile::tempdir().unwrap();
    let (first, second) = (folder.path().join("first"), folder.path().join("second"));
    let mut outputs = Outputs::default();
    outputs.add(&first, b"1".into()).unwrap();
    outputs.add(&second, b"2".into()).unwrap();
    // A folder has taken the name since it was checked.
    fs::create_dir(&second).unwrap();
    fs::write(second.join("inside"), "").unwrap();
    assert!(outputs.commit().is_err());
    assert_eq!(names(folder.path()), ["second"]);
}

#[test]
fn refusals_say_why() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("file"), "").unwrap();
    fs::write(at("locked"), "").unwrap();
    let mut locked = fs::metadata(at("locked")).unwrap().permissions();
    locked.set_readonly(true);
    fs::set_permissions(at("locked"), locked).unwrap();
    for (path, why) in [
        (at("missing").join("x.png"), "does not exist; create it"),
        (at("file").join("x.png"), ""),
        (folder.path().into(), "a folder of that name"),
        (at("locked"), "read-only"),
        (PathBuf::new(), "not a file name"),
        (PathBuf::from(".."), "not a file name"),
        (at("x.png").join(""), "ends in '/'"),
    ] {
        let said = check_writable(&path).unwrap_err().to_string();
        assert!(said.contains(why), "{said}");
        let added = Outputs::default().add(&path, vec![1]).unwrap_err();
        assert_eq!(added.to_string(), said);
    }
    assert_eq!(names(folder.path()), ["file", "locked"]);
}

#[test]
fn checking_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    check_writable(&folder.path().join("x")).unwrap();
    assert!(names(folder.path()).is_empty());
}

#[test]
fn the_list_of_unfinished_files_is_true() {
    // A call of `discard_unfinished` would disturb other tests of this process.
    let folder = tempfile::tempdir().unwrap();
    let mut outputs = Outputs::default();
    outputs.add(&folder.path().join("x"), vec![0; 9]).unwrap();
    let here = |list: &BTreeSet<PathBuf>| list.iter().filter(|p| p.starts_with(&folder)).count();
    assert_eq!(here(&unfinished()), 1);
    outputs.commit().unwrap();
    assert_eq!(here(&unfinished()), 0);
    check_writable(&folder.path().join("y")).unwrap();
    assert_eq!(here(&unfinished()), 0);
}

#[cfg(unix)]
#[test]
fn links_to_nothing_are_followed() {
    use std::os::unix::fs::symlink;
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("sub")).unwrap();
    symlink("sub/second", at("first")).unwrap();
    symlink("third", at("sub/second")).unwrap();
    let mut outputs = Outputs::default();
    outputs.add(&at("first"), b"new".into()).unwrap();
    outputs.commit().unwrap();
    assert!(fs::symlink_metadata(at("first")).unwrap().is_symlink());
    assert!(fs::symlink_metadata(at("sub/second")).unwrap().is_symlink());
    assert_eq!(fs::read(at("sub/third")).unwrap(), b"new");

    symlink("none/x", at("astray")).unwrap();
    let said = check_writable(&at("astray")).unwrap_err().to_string();
    assert!(said.contains("does not exist; create it"), "{said}");
    symlink("round", at("round")).unwrap();
    let said = check_writable(&at("round")).unwrap_err().to_string();
    assert!(said.contains("leads to itself"), "{said}");
}

#[test]
fn a_commit_of_many_files_is_linear() {
    let folder = tempfile::tempdir().unwrap();
    let time = |count: usize| {
        let start = std::time::Instant::now();
        let mut outputs = Outputs::default();
        for i in 0..count {
            let path = folder.path().join(format!("{count}_{i}"));
            outputs.add(&path, vec![0]).unwrap();
        }
        outputs.commit().unwrap();
        start.elapsed().as_secs_f64()
    };
    let (few, many) = (time(2000), time(16_000));
    // 64 times as long where it is quadratic.
    assert!(many < 30.0 * few.max(0.05), "{few} s, {many} s");
}

#[cfg(unix)]
#[test]
fn links_permissions_and_devices() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = tempfile::tempdir().unwrap();
    let (file, link) = (folder.path().join("file"), folder.path().join("link"));
    fs::write(&file, "old").unwrap();
    fs::set_permissions(&file, Permissions::from_mode(0o640)).unwrap();
    symlink(&file, &link).unwrap();
    let mut outputs = Outputs::default();
    outputs.add(&link, b"new".into()).unwrap();
    outputs.add(Path::new("/dev/null"), vec![0; 99]).unwrap();
    outputs.commit().unwrap();
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!(fs::read(&file).unwrap(), b"new");
    assert_eq!(
        fs::metadata(&file).unwrap().permissions().mode() & 0o777,
        0o640
    );
    assert!(!fs::metadata("/dev/null").unwrap().is_file());

    let full = Path::new("/dev/full");
    if full.exists() {
        let mut outputs = Outputs::default();
        outputs.add(&folder.path().join("with"), vec![1]).unwrap();
        outputs.add(full, vec![0; 99]).unwrap();
        assert!(outputs.commit().is_err());
        assert_eq!(names(folder.path()), ["file", "link"]);
    }
}
