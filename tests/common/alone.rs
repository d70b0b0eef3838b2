//! Runs a test that reads state of the whole process in a process of its own.

use std::process::Command;

/// Set in the process that [`in_own_process`] starts.
const ALONE: &str = "LANECAST_TEST_ALONE";

/// Runs `body` while no other test runs: this test binary starts itself once more with
/// nothing but `test`, a path such as `module::name` below the binary's root.
///
/// Panics if the process fails, whose output it prints.
pub fn in_own_process(test: &str, body: impl FnOnce()) {
    if std::env::var_os(ALONE).is_some() {
        return body();
    }
    let binary = std::env::current_exe().expect("a test knows its binary");
    let output = Command::new(binary)
        .args(["--exact", test, "--nocapture", "--include-ignored"])
        .env(ALONE, "1")
        .output()
        .expect("the binary starts again");
    let said = String::from_utf8_lossy(&output.stdout);
    println!("{said}{}", String::from_utf8_lossy(&output.stderr));
    assert!(said.contains("1 passed"), "no test {test}, or it failed");
    assert!(output.status.success(), "{}", output.status);
}
