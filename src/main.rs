use std::process::ExitCode;

/// The processor is checked before the Rust runtime starts: that may itself be
/// compiled to instructions which are missing. 00050 comes before the runtime's
/// own 00099.
#[cfg(all(target_os = "linux", target_arch = "x86_64"))]
#[used]
#[unsafe(link_section = ".init_array.00050")]
static BEFORE_MAIN: extern "C" fn() = lanecast::internals::cli::check_before_main;

fn main() -> ExitCode {
    lanecast::internals::cli::main()
}
