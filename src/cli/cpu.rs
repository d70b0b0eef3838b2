//! May this binary run here? Asked before anything else.
//!
//! Lanes choose their instructions at compile time, so a binary carries the
//! needs of the machine it was built for. This file compares them with the
//! processor (CPUID) and with what the system saves for its threads (XGETBV).
//! `is_x86_feature_detected!` cannot be asked: it is constant for features that
//! are compiled in.
//!
//! Everything here runs where the wanted instructions may be missing. It keeps
//! to integers, references and static text: no formatting, no collections, so
//! that the compiler finds nothing to do in vector registers.

/// One register bit that stands for a feature.
struct Feature {
    name: &'static str,
    /// The binary may use it.
    compiled: bool,
    word: Word,
    bit: u32,
    /// Bits of XCR0 that must be set beside it.
    state: u64,
}

/// The CPUID words that name features: leaf (sub-leaf) register.
#[derive(Clone, Copy)]
enum Word {
    Leaf1Ecx,
    Leaf1Edx,
    Leaf7Ebx,
    Leaf7Ecx,
    Leaf7Edx,
    Leaf7Sub1Eax,
    Leaf13Sub1Eax,
    Extended1Ecx,
}

/// What the processor and the system say.
#[derive(Clone, Copy, Default)]
pub struct Registers {
    words: [u32; 8],
    xcr0: u64,
}

/// Nothing beyond CPUID; registers that the system saves lazily or always.
const NONE: u64 = 0;
/// SSE and AVX state.
const YMM: u64 = 0b110;
/// That, the masks, and both parts of the ZMM registers.
const ZMM: u64 = 0b1110_0110;

macro_rules! features {
    ($($name:literal $word:ident $bit:literal $state:ident,)*) => {
        &[$(Feature {
            name: $name,
            compiled: cfg!(target_feature = $name),
            word: Word::$word,
            bit: $bit,
            state: $state,
        },)*]
    };
}

/// Every stable feature of rustc for x86-64 that plain code may be compiled to.
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
    "xsave" Leaf1Ecx 26 NONE,
    "avx" Leaf1Ecx 28 YMM,
    "f16c" Leaf1Ecx 29 YMM,
    "rdrand" Leaf1Ecx 30 NONE,
    "fxsr" Leaf1Edx 24 NONE,
    "bmi1" Leaf7Ebx 3 NONE,
    "avx2" Leaf7Ebx 5 YMM,
    "bmi2" Leaf7Ebx 8 NONE,
    "avx512f" Leaf7Ebx 16 ZMM,
    "avx512dq" Leaf7Ebx 17 ZMM,
    "rdseed" Leaf7Ebx 18 NONE,
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
    "xsaveopt" Leaf13Sub1Eax 0 NONE,
    "xsavec" Leaf13Sub1Eax 1 NONE,
    "xsaves" Leaf13Sub1Eax 3 NONE,
    "lzcnt" Extended1Ecx 5 NONE,
    "sse4a" Extended1Ecx 6 NONE,
    "tbm" Extended1Ecx 21 NONE,
];

fn is_there(feature: &Feature, registers: &Registers) -> bool {
    registers.words[feature.word as usize] >> feature.bit & 1 == 1
        && registers.xcr0 & feature.state == feature.state
}

/// The first feature at or after `from` that is needed and not there.
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

/// If this processor lacks instructions that the binary was compiled to, says
/// so on standard error, with the remedy. True if all is well.
#[inline(never)]
pub fn check() -> bool {
    let registers = read_registers();
    let Some(first) = next_missing(FEATURES, &registers, 0) else {
        return true;
    };
    say("error: this lanecast was built for another processor; missing here:");
    let mut at = Some(first);
    while let Some(i) = at {
        say(" ");
        say(FEATURES[i].name);
        at = next_missing(FEATURES, &registers, i + 1);
    }
    say("; build it on this machine with 'cargo build --release', or for older ones with ");
    say("RUSTFLAGS=\"-Ctarget-cpu=x86-64-v3\" (or x86-64-v2) cargo build --release\n");
    false
}

fn say(text: &str) {
    use std::io::Write;
    // There is nowhere to report that standard error is closed.
    let _ = std::io::stderr().write_all(text.as_bytes());
}

#[cfg(not(target_arch = "x86_64"))]
fn read_registers() -> Registers {
    // No feature of the table is compiled in, so nothing is looked up.
    Registers::default()
}

#[cfg(target_arch = "x86_64")]
fn read_registers() -> Registers {
    const OSXSAVE: u32 = 1 << 27;
    let mut registers = Registers::default();
    let words = &mut registers.words;
    let highest = cpuid(0, 0).eax;
    if highest >= 1 {
        let leaf = cpuid(1, 0);
        words[Word::Leaf1Ecx as usize] = leaf.ecx;
        words[Word::Leaf1Edx as usize] = leaf.edx;
    }
    if highest >= 7 {
        let leaf = cpuid(7, 0);
        words[Word::Leaf7Ebx as usize] = leaf.ebx;
        words[Word::Leaf7Ecx as usize] = leaf.ecx;
        words[Word::Leaf7Edx as usize] = leaf.edx;
        if leaf.eax >= 1 {
            words[Word::Leaf7Sub1Eax as usize] = cpuid(7, 1).eax;
        }
    }
    if highest >= 13 {
        words[Word::Leaf13Sub1Eax as usize] = cpuid(13, 1).eax;
    }
    if cpuid(0x8000_0000, 0).eax >= 0x8000_0001 {
        words[Word::Extended1Ecx as usize] = cpuid(0x8000_0001, 0).ecx;
    }
    if words[Word::Leaf1Ecx as usize] & OSXSAVE != 0 {
        // SAFETY: OSXSAVE says that the instruction exists and that the system
        // lets programs use it.
        registers.xcr0 = unsafe { xcr0() };
    }
    registers
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

    /// A binary compiled for the named features.
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

    /// CPUID of a Haswell, from its manual: AVX2 and FMA, no AVX-512.
    fn haswell() -> Registers {
        let mut haswell = Registers {
            words: [0; 8],
            xcr0: 0b111,
        };
        haswell.words[Word::Leaf1Ecx as usize] = 0x7ffa_fbff;
        haswell.words[Word::Leaf1Edx as usize] = 0xbfeb_fbff;
        haswell.words[Word::Leaf7Ebx as usize] = 0x0000_27ab;
        haswell.words[Word::Extended1Ecx as usize] = 0x21;
        haswell
    }

    /// A Skylake server.
    fn skylake() -> Registers {
        let mut skylake = haswell();
        skylake.words[Word::Leaf7Ebx as usize] = 0xd39f_fffb;
        skylake.xcr0 = 0b1110_0111;
        skylake
    }

    #[test]
    fn a_machine_with_everything() {
        assert!(missing(&V4, &skylake()).is_empty());
        assert!(missing(&V4[..8], &haswell()).is_empty());
        assert!(missing(&[], &Registers::default()).is_empty());
    }

    #[test]
    fn a_machine_without_avx512() {
        assert_eq!(
            missing(&V4, &haswell()),
            ["avx512f", "avx512dq", "avx512vl"]
        );
    }

    #[test]
    fn avx512_that_the_system_does_not_save() {
        // Any one of the three parts missing is all of them missing.
        for xcr0 in [0b111, 0b1100_0111, 0b1010_0111, 0b0110_0111] {
            let masked = Registers { xcr0, ..skylake() };
            assert_eq!(missing(&V4, &masked), ["avx512f", "avx512dq", "avx512vl"]);
        }
    }

    #[test]
    fn avx_that_the_system_does_not_save() {
        // SSE state only: what needs no wide registers is still there.
        let masked = Registers {
            xcr0: 0b011,
            ..haswell()
        };
        assert_eq!(missing(&V4[..8], &masked), ["fma", "avx", "f16c", "avx2"]);
    }

    #[test]
    fn a_processor_that_says_nothing_lacks_all() {
        assert_eq!(missing(&V4, &Registers::default()).len(), V4.len());
    }

    #[test]
    fn this_machine_runs_what_was_compiled_for_it() {
        // These tests run, so the answer is known.
        assert!(check());
    }

    #[cfg(target_arch = "x86_64")]
    #[test]
    fn the_registers_agree_with_the_standard_library() {
        let registers = read_registers();
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
        assert_eq!(there("rdseed"), is_x86_feature_detected!("rdseed"));
        assert_eq!(there("adx"), is_x86_feature_detected!("adx"));
        assert_eq!(there("sha"), is_x86_feature_detected!("sha"));
        assert_eq!(there("xsavec"), is_x86_feature_detected!("xsavec"));
        assert_eq!(there("xsaveopt"), is_x86_feature_detected!("xsaveopt"));
    }
}
