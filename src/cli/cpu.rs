//! Checks whether this processor can run the binary, before anything else runs.
//!
//! Lanes choose their instructions at compile time, so a binary requires the features
//! of the processor it was built for. This file compares these features with the
//! processor's (CPUID) and with the state that the operating system saves for its
//! threads (XGETBV). `is_x86_feature_detected!` cannot be used: it is constant for
//! features that are compiled in.
//!
//! All code here runs where the required instructions may be missing, on Linux before
//! the Rust runtime starts (`main.rs`): link-time optimisation also compiles the
//! runtime for the required instructions. The code therefore uses only integers, static
//! text and the system's own `write`; atomics and `black_box` stand where the compiler
//! would otherwise choose vector or BMI instructions. The test under an emulator is in
//! `tests/cli/`.

use std::hint::black_box;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering::Relaxed};

/// A feature, and the register bit that indicates it.
struct Feature {
    name: &'static str,
    /// True if the binary may use the feature.
    compiled: bool,
    word: Word,
    mask: u32,
    /// Bits of XCR0 that must also be set.
    state: u64,
}

/// The CPUID words that indicate features: leaf (sub-leaf) register.
#[derive(Clone, Copy)]
enum Word {
    Leaf1Ecx,
    Leaf7Ebx,
    Leaf7Ecx,
    Leaf7Edx,
    Leaf7Sub1Eax,
    Extended1Ecx,
}

/// Register values of the processor and the operating system.
struct Registers {
    words: [AtomicU32; 6],
    xcr0: AtomicU64,
}

static REGISTERS: Registers = Registers {
    words: [const { AtomicU32::new(0) }; 6],
    xcr0: AtomicU64::new(0),
};

/// No state beyond what the system always saves.
const NONE: u64 = 0;
/// SSE and AVX state.
const YMM: u64 = 0b110;
/// SSE and AVX state, the mask registers, and both parts of the ZMM registers.
const ZMM: u64 = 0b1110_0110;

macro_rules! features {
    ($($name:literal $word:ident $bit:literal $state:ident,)*) => {
        &[$(Feature {
            name: $name,
            compiled: cfg!(target_feature = $name),
            word: Word::$word,
            mask: 1 << $bit,
            state: $state,
        },)*]
    };
}

/// The features that compiled code and the libraries may use. Features for saving state
/// and for random numbers are omitted: nothing here uses them, and virtual machines
/// often hide them.
static FEATURES: &[Feature] = features![
    "sse3" Leaf1Ecx 0 NONE,
    "pclmulqdq" Leaf1Ecx 1 NONE,
    "ssse3" Leaf1Ecx 9 NONE,
    "fma" Leaf1Ecx 12 YMM,
    "cmpxchg16b" Leaf1Ecx 13 NONE,
    "sse4.1" Leaf1Ecx 19 NONE,
    "sse4.2" Leaf1Ecx 20 NONE,
    "movbe" Leaf1Ecx 22 NONE,
    "popcnt" Leaf1Ecx 23 NONE,
    "aes" Leaf1Ecx 25 NONE,
    "avx" Leaf1Ecx 28 YMM,
    "f16c" Leaf1Ecx 29 YMM,
    "bmi1" Leaf7Ebx 3 NONE,
    "avx2" Leaf7Ebx 5 YMM,
    "bmi2" Leaf7Ebx 8 NONE,
    "avx512f" Leaf7Ebx 16 ZMM,
    "avx512dq" Leaf7Ebx 17 ZMM,
    "adx" Leaf7Ebx 19 NONE,
    "avx512ifma" Leaf7Ebx 21 ZMM,
    "avx512cd" Leaf7Ebx 28 ZMM,
    "sha" Leaf7Ebx 29 NONE,
    "avx512bw" Leaf7Ebx 30 ZMM,
    "avx512vl" Leaf7Ebx 31 ZMM,
    "avx512vbmi" Leaf7Ecx 1 ZMM,
    "avx512vbmi2" Leaf7Ecx 6 ZMM,
    "gfni" Leaf7Ecx 8 NONE,
    "vaes" Leaf7Ecx 9 YMM,
    "vpclmulqdq" Leaf7Ecx 10 YMM,
    "avx512vnni" Leaf7Ecx 11 ZMM,
    "avx512bitalg" Leaf7Ecx 12 ZMM,
    "avx512vpopcntdq" Leaf7Ecx 14 ZMM,
    "avx512vp2intersect" Leaf7Edx 8 ZMM,
    "avx512fp16" Leaf7Edx 23 ZMM,
    "sha512" Leaf7Sub1Eax 0 YMM,
    "sm3" Leaf7Sub1Eax 1 YMM,
    "sm4" Leaf7Sub1Eax 2 YMM,
    "avxvnni" Leaf7Sub1Eax 4 YMM,
    "avx512bf16" Leaf7Sub1Eax 5 ZMM,
    "avxifma" Leaf7Sub1Eax 23 YMM,
    "lzcnt" Extended1Ecx 5 NONE,
    "sse4a" Extended1Ecx 6 NONE,
    "tbm" Extended1Ecx 21 NONE,
];

fn is_there(feature: &Feature, registers: &Registers) -> bool {
    let word = registers.words[feature.word as usize].load(Relaxed);
    let state = registers.xcr0.load(Relaxed);
    black_box(word & feature.mask) != 0 && black_box(state & feature.state) == feature.state
}

/// Returns the first feature at or after `from` that is required and missing.
fn next_missing(features: &[Feature], registers: &Registers, from: usize) -> Option<usize> {
    let mut i = from;
    while i < features.len() {
        if features[i].compiled && !is_there(&features[i], registers) {
            return Some(i);
        }
        i += 1;
    }
    None
}

/// Returns whether the processor has all instructions that the binary was compiled for.
/// If not, reports the missing ones and the remedy on standard error.
#[inline(never)]
pub fn check() -> bool {
    read_registers(&REGISTERS);
    let Some(first) = next_missing(FEATURES, &REGISTERS, 0) else {
        return true;
    };
    say("error: this lanecast was built for another processor; missing here:");
    let mut at = Some(first);
    while let Some(i) = at {
        say(" ");
        say(FEATURES[i].name);
        at = next_missing(FEATURES, &REGISTERS, i + 1);
    }
    say("; build it on this machine with 'cargo build --release', or for older ones with ");
    say("RUSTFLAGS=\"-Ctarget-cpu=x86-64-v3\" (or x86-64-v2) cargo build --release\n");
    false
}

/// Lists the features by name: whether the binary uses each, and whether the processor has it.
/// [`check`] has to run before.
pub fn features() -> impl Iterator<Item = (&'static str, bool, bool)> {
    FEATURES.iter().map(|feature| {
        let there = is_there(feature, &REGISTERS);
        (feature.name, feature.compiled, there)
    })
}

/// Runs [`check`] from the list of functions that run before `main`, and ends the
/// process with exit code 2 if it fails.
#[cfg(unix)]
pub extern "C" fn check_before_main() {
    unsafe extern "C" {
        safe fn _exit(code: i32) -> !;
    }
    if !check() {
        _exit(2);
    }
}

#[cfg(unix)]
fn say(text: &str) {
    unsafe extern "C" {
        fn write(file: i32, bytes: *const u8, count: usize) -> isize;
    }
    // There is nowhere to report that standard error is closed.
    // SAFETY: the pointer and the length are those of `text`.
    let _ = unsafe { write(2, text.as_ptr(), text.len()) };
}

#[cfg(not(unix))]
fn say(text: &str) {
    use std::io::Write;
    let _ = std::io::stderr().write_all(text.as_bytes());
}

#[cfg(not(target_arch = "x86_64"))]
fn read_registers(_: &Registers) {
    // No feature of the table is compiled in, so no register is looked up.
}

#[cfg(target_arch = "x86_64")]
fn read_registers(registers: &Registers) {
    const OSXSAVE: u32 = 1 << 27;
    let set = |word: Word, value: u32| registers.words[word as usize].store(value, Relaxed);
    let highest = cpuid(0, 0).eax;
    if highest >= 1 {
        let leaf = cpuid(1, 0);
        set(Word::Leaf1Ecx, leaf.ecx);
        if leaf.ecx & OSXSAVE != 0 {
            // SAFETY: OSXSAVE states that the instruction exists and that the system
            // lets programs use it.
            registers.xcr0.store(unsafe { xcr0() }, Relaxed);
        }
    }
    if highest >= 7 {
        let leaf = cpuid(7, 0);
        set(Word::Leaf7Ebx, leaf.ebx);
        set(Word::Leaf7Ecx, leaf.ecx);
        set(Word::Leaf7Edx, leaf.edx);
        if leaf.eax >= 1 {
            set(Word::Leaf7Sub1Eax, cpuid(7, 1).eax);
        }
    }
    if cpuid(0x8000_0000, 0).eax >= 0x8000_0001 {
        set(Word::Extended1Ecx, cpuid(0x8000_0001, 0).ecx);
    }
}

#[cfg(target_arch = "x86_64")]
#[allow(unused_unsafe)] // Older Rust has it unsafe, newer does not.
fn cpuid(leaf: u32, sub_leaf: u32) -> core::arch::x86_64::CpuidResult {
    // SAFETY: every x86-64 processor has the instruction.
    unsafe { core::arch::x86_64::__cpuid_count(leaf, sub_leaf) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "xsave")]
fn xcr0() -> u64 {
    // SAFETY: register 0 always exists where XGETBV does.
    unsafe { core::arch::x86_64::_xgetbv(0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the features of a binary compiled for the named ones.
    fn needs(names: &[&str]) -> Vec<Feature> {
        let known = FEATURES.iter().map(|f| Feature {
            compiled: names.contains(&f.name),
            ..*f
        });
        let features: Vec<Feature> = known.collect();
        let found = features.iter().filter(|f| f.compiled).count();
        assert_eq!(found, names.len(), "an unknown name");
        features
    }

    fn missing(needed: &[&str], registers: &Registers) -> Vec<&'static str> {
        let features = needs(needed);
        let mut names = Vec::new();
        let mut from = 0;
        while let Some(i) = next_missing(&features, registers, from) {
            names.push(features[i].name);
            from = i + 1;
        }
        names
    }

    const V4: [&str; 12] = [
        "sse3", "popcnt", "avx", "fma", "f16c", "bmi1", "avx2", "bmi2", "avx512f", "avx512dq",
        "avx512vl", "lzcnt",
    ];

    fn registers(words: &[(Word, u32)], xcr0: u64) -> Registers {
        let registers = Registers {
            words: Default::default(),
            xcr0: xcr0.into(),
        };
        for (word, value) in words {
            registers.words[*word as usize].store(*value, Relaxed);
        }
        registers
    }

    /// CPUID of a Haswell: AVX2 and FMA, no AVX-512.
    fn haswell(xcr0: u64) -> Registers {
        let words = [
            (Word::Leaf1Ecx, 0x7ffa_fbff),
            (Word::Leaf7Ebx, 0x0000_27ab),
            (Word::Extended1Ecx, 0x21),
        ];
        registers(&words, xcr0)
    }

    /// CPUID of a Skylake server.
    fn skylake(xcr0: u64) -> Registers {
        let skylake = haswell(xcr0);
        skylake.words[Word::Leaf7Ebx as usize].store(0xd39f_fffb, Relaxed);
        skylake
    }

    #[test]
    fn a_machine_with_everything() {
        assert!(missing(&V4, &skylake(0b1110_0111)).is_empty());
        assert!(missing(&V4[..8], &haswell(0b111)).is_empty());
        assert!(missing(&[], &registers(&[], 0)).is_empty());
    }

    #[test]
    fn a_machine_without_avx512() {
        let lacks = ["avx512f", "avx512dq", "avx512vl"];
        assert_eq!(missing(&V4, &haswell(0b111)), lacks);
        // The result does not depend on the state that the system would save.
        assert_eq!(missing(&V4, &haswell(0b1110_0111)), lacks);
    }

    #[test]
    fn avx512_that_the_system_does_not_save() {
        // If one of the three parts is missing, all AVX-512 features are.
        for xcr0 in [0b111, 0b1100_0111, 0b1010_0111, 0b0110_0111] {
            let lacks = ["avx512f", "avx512dq", "avx512vl"];
            assert_eq!(missing(&V4, &skylake(xcr0)), lacks);
        }
    }

    #[test]
    fn avx_that_the_system_does_not_save() {
        // SSE state only: features without wide registers are still available.
        let lacks = ["avx", "fma", "f16c", "avx2"];
        let mut found = missing(&V4[..8], &haswell(0b011));
        found.sort_by_key(|name| lacks.iter().position(|l| l == name));
        assert_eq!(found, lacks);
    }

    #[test]
    fn a_processor_that_says_nothing_lacks_all() {
        assert_eq!(missing(&V4, &registers(&[], 0)).len(), V4.len());
    }

    #[test]
    fn this_machine_runs_what_was_compiled_for_it() {
        // These tests run, so the answer is known.
        assert!(check());
    }

    #[cfg(target_arch = "x86_64")]
    #[test]
    fn the_registers_agree_with_the_standard_library() {
        let registers = registers(&[], 0);
        read_registers(&registers);
        let there = |name: &str| {
            let feature = FEATURES.iter().find(|f| f.name == name).unwrap();
            is_there(feature, &registers)
        };
        assert_eq!(there("sse4.2"), is_x86_feature_detected!("sse4.2"));
        assert_eq!(there("popcnt"), is_x86_feature_detected!("popcnt"));
        assert_eq!(there("avx"), is_x86_feature_detected!("avx"));
        assert_eq!(there("avx2"), is_x86_feature_detected!("avx2"));
        assert_eq!(there("fma"), is_x86_feature_detected!("fma"));
        assert_eq!(there("f16c"), is_x86_feature_detected!("f16c"));
        assert_eq!(there("bmi1"), is_x86_feature_detected!("bmi1"));
        assert_eq!(there("bmi2"), is_x86_feature_detected!("bmi2"));
        assert_eq!(there("lzcnt"), is_x86_feature_detected!("lzcnt"));
        assert_eq!(there("sse4a"), is_x86_feature_detected!("sse4a"));
        assert_eq!(there("avx512f"), is_x86_feature_detected!("avx512f"));
        assert_eq!(there("avx512dq"), is_x86_feature_detected!("avx512dq"));
        assert_eq!(there("avx512bw"), is_x86_feature_detected!("avx512bw"));
        assert_eq!(there("avx512vl"), is_x86_feature_detected!("avx512vl"));
        assert_eq!(there("avx512cd"), is_x86_feature_detected!("avx512cd"));
        assert_eq!(there("avx512vnni"), is_x86_feature_detected!("avx512vnni"));
        assert_eq!(there("avx512vbmi"), is_x86_feature_detected!("avx512vbmi"));
        assert_eq!(there("avx512fp16"), is_x86_feature_detected!("avx512fp16"));
        assert_eq!(there("avx512bf16"), is_x86_feature_detected!("avx512bf16"));
        assert_eq!(there("avxvnni"), is_x86_feature_detected!("avxvnni"));
        assert_eq!(there("vaes"), is_x86_feature_detected!("vaes"));
        assert_eq!(there("gfni"), is_x86_feature_detected!("gfni"));
        assert_eq!(there("adx"), is_x86_feature_detected!("adx"));
        assert_eq!(there("sha"), is_x86_feature_detected!("sha"));
    }
}
