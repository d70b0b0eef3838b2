//! Instruction sets by name: what the program is built for, and what this machine has.

use super::cpu;
use super::output::complain;

/// The levels of x86-64, from the lowest on, and what each adds to the one before (System V ABI,
/// section 3.1.1). LAHF, which every processor of level 2 has, is not looked for.
const LEVELS: [(&str, &[&str]); 4] = [
    ("x86-64", &[]),
    (
        "x86-64-v2",
        &["cmpxchg16b", "popcnt", "sse3", "ssse3", "sse4.1", "sse4.2"],
    ),
    (
        "x86-64-v3",
        &[
            "avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "lzcnt", "movbe",
        ],
    ),
    (
        "x86-64-v4",
        &["avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"],
    ),
];

/// Returns the highest level all of whose features are there.
fn level(is_there: impl Fn(&str) -> bool) -> &'static str {
    let whole = |(_, features): &&(_, &[&str])| features.iter().all(|name| is_there(name));
    let reached = LEVELS.iter().take_while(whole).last();
    reached.map_or(LEVELS[0].0, |(name, _)| name)
}

/// Returns the instruction set that the program is built for: a level of x86-64, or the
/// architecture.
pub fn of_build() -> &'static str {
    of(|(_, compiled, _)| compiled)
}

/// Returns the instruction set of this machine.
pub fn of_machine() -> &'static str {
    of(|(_, _, there)| there)
}

fn of(counts: impl Fn((&str, bool, bool)) -> bool) -> &'static str {
    match std::env::consts::ARCH {
        "x86_64" => level(|name| cpu::features().any(|f| f.0 == name && counts(f))),
        other => other,
    }
}

/// Warns where a program without AVX2 runs on a machine that has it. A program for AVX2 on a
/// machine with AVX-512 is left alone: it is what one builds on purpose for many machines.
pub fn warn_of_slow_build() {
    let lacks = |wanted| {
        cpu::features().any(|(name, compiled, there)| name == wanted && !compiled && there)
    };
    if lacks("avx2") {
        complain(
            "warning: this lanecast is built for every x86-64 processor, and this one has AVX2, which \
             makes it several times as fast; build it with RUSTFLAGS=-Ctarget-cpu=native (cargo \
             install does not read the repository's .cargo/config.toml)",
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_needs_all_below_it() {
        let all: Vec<&str> = LEVELS.iter().flat_map(|(_, f)| f.iter().copied()).collect();
        assert_eq!(level(|_| false), "x86-64");
        assert_eq!(level(|name| all.contains(&name)), "x86-64-v4");
        assert_eq!(level(|name| name != "avx512vl"), "x86-64-v3");
        assert_eq!(level(|name| name != "sse3"), "x86-64");
    }

    #[test]
    fn every_feature_of_a_level_is_looked_up() {
        let known: Vec<&str> = cpu::features().map(|f| f.0).collect();
        for name in LEVELS.iter().flat_map(|(_, features)| *features) {
            assert!(known.contains(name), "{name}");
        }
    }
}
