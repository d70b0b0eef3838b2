//! The layers of the crates, their `unsafe`, their elementary functions, and the entries of the top
//! level.
//!
//! Imports are the paths behind `crate::` in the code of `src/`, in `use` lines and elsewhere;
//! comments and strings are left out. `super::` is not followed: rows of the table are
//! folders, and a test checks that no file leaves its folder that way.

use std::fs;
use std::path::{Path, PathBuf};

/// What a layer may import beside itself. `lib.rs` and `main.rs` may all.
const LAYERS: &[(&str, &[&str])] = &[
    ("math", &[]),
    ("roots", &["math"]),
    ("geom", &["math", "roots"]),
    ("csg", &["math", "roots", "geom"]),
    ("scene", &["math", "roots", "geom", "csg"]),
    ("light", &["math", "scene"]),
    ("io", &["math", "roots", "geom", "csg", "scene", "light"]),
    ("plan", &["math", "roots", "geom", "csg", "scene"]),
    ("accel", &["math", "roots", "geom", "csg", "scene"]),
    (
        "trace",
        &["math", "roots", "geom", "csg", "scene", "plan", "accel"],
    ),
    (
        "shade",
        &[
            "light", "math", "roots", "geom", "csg", "scene", "plan", "accel", "trace",
        ],
    ),
    (
        "render",
        &[
            "light", "math", "roots", "geom", "csg", "scene", "io", "plan", "accel", "trace",
            "shade",
        ],
    ),
    (
        "tracer",
        &[
            "light", "math", "roots", "geom", "csg", "scene", "io", "plan", "accel", "trace",
            "shade", "render",
        ],
    ),
    // And of these only what `reference_may` allows.
    ("reference", &["math", "geom", "scene"]),
    (
        "measure",
        &[
            "light",
            "math",
            "roots",
            "geom",
            "csg",
            "scene",
            "io",
            "plan",
            "accel",
            "trace",
            "shade",
            "render",
            "reference",
        ],
    ),
    (
        "cli",
        &[
            "light",
            "math",
            "roots",
            "geom",
            "csg",
            "scene",
            "io",
            "plan",
            "accel",
            "trace",
            "shade",
            "render",
            "tracer",
            "reference",
            "measure",
        ],
    ),
];

/// Whether the reference may use this path: of what it checks it shares the types of rows
/// and tables and the affine map, and no function, kernel or inner module.
fn reference_may(path: &[String]) -> bool {
    let is_type = |name: &str| name.starts_with(|c: char| c.is_ascii_uppercase());
    match path {
        [layer, name, ..] if layer == "scene" || layer == "geom" => is_type(name),
        [layer, name, ..] if layer == "math" => name == "Affine",
        _ => false,
    }
}

/// Where `unsafe` stands, and how often.
const UNSAFE: &[(&str, usize)] = &[
    // Asking for memory before it is needed.
    ("src/engine/accel/prefetch.rs", 1),
    // The system's `write`, XGETBV, and CPUID.
    ("src/cli/cpu.rs", 6),
    // The calls of Open Image Denoise, where it is compiled in.
    ("src/cli/denoise/oidn.rs", 16),
    ("src/cli/memory.rs", 1),
    // The calls of Embree, where it is compiled in.
    ("src/measure/baseline/embree/ffi.rs", 2),
    ("src/measure/baseline/embree/mod.rs", 6),
    ("src/measure/baseline/embree/trace.rs", 12),
    // A counting allocator.
    ("tests/light/allocations.rs", 7),
    // The section of functions that run before `main`.
    ("src/main.rs", 1),
];

const TOP_LEVEL: &[&str] = &[
    "README.md",
    "LICENSE-MIT",
    "LICENSE-APACHE",
    "Cargo.toml",
    "Cargo.lock",
    "src",
    "benches",
    "tests",
    "scenes",
    "docs",
    "target",
    // What the first command of the README makes.
    "lanecast.png",
    // Property tests note their failures here; not under version control.
    "proptest-regressions",
];

fn root() -> PathBuf {
    env!("CARGO_MANIFEST_DIR").into()
}

/// Every Rust file below these folders: its path from the root, and its code.
fn sources(folders: &[&str]) -> Vec<(String, String)> {
    let mut found: Vec<(String, String)> = files(folders)
        .filter(|path| path.extension().is_some_and(|e| e == "rs"))
        .map(|path| {
            let name = path.strip_prefix(root()).unwrap().to_str().unwrap();
            let text = fs::read_to_string(&path).unwrap();
            (name.replace('\\', "/"), code(&text))
        })
        .collect();
    found.sort();
    found
}

/// Every file among these, and below those that are folders.
fn files(among: &[&str]) -> impl Iterator<Item = PathBuf> {
    let mut todo: Vec<PathBuf> = among.iter().map(|f| root().join(f)).collect();
    std::iter::from_fn(move || {
        loop {
            let path = todo.pop()?;
            if !path.is_dir() {
                return Some(path);
            }
            todo.extend(fs::read_dir(path).unwrap().map(|e| e.unwrap().path()));
        }
    })
}

/// The text without comments and without what stands in quotes.
fn code(text: &str) -> String {
    let mut code = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let skipped = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            rest.find("*/").map_or(rest.len(), |end| end + 2)
        } else if let Some(end) = raw_string(rest, code.chars().last()) {
            end
        } else if c == '"' {
            quoted(rest)
        } else if rest.starts_with("'\"'") {
            3
        } else if rest.starts_with("'\\\"'") {
            4
        } else {
            code.push(c);
            rest = &rest[c.len_utf8()..];
            continue;
        };
        code.push(' ');
        rest = &rest[skipped..];
    }
    code
}

/// The length of the text in quotes with which `rest` begins.
fn quoted(rest: &str) -> usize {
    let mut escaped = false;
    for (i, c) in rest.char_indices().skip(1) {
        match c {
            '"' if !escaped => return i + 1,
            '\\' => escaped = !escaped,
            _ => escaped = false,
        }
    }
    rest.len()
}

/// The length of `r"…"` or `r#"…"#`, if `rest` begins with one.
fn raw_string(rest: &str, before: Option<char>) -> Option<usize> {
    if before.is_some_and(is_word) && before != Some('b') {
        return None;
    }
    let after = rest.strip_prefix('r')?;
    let hashes = after.len() - after.trim_start_matches('#').len();
    let body = after[hashes..].strip_prefix('"')?;
    let end = format!("\"{}", "#".repeat(hashes));
    let length = body.find(&end).map_or(body.len(), |at| at + end.len());
    Some(1 + hashes + 1 + length)
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// The paths behind every `crate::`, braces expanded: `crate::a::{b, c::d}`
/// gives a::b and a::c::d.
fn imports(code: &str) -> Vec<Vec<String>> {
    let mut paths = Vec::new();
    let mut from = 0;
    while let Some(at) = code[from..].find("crate::").map(|at| from + at) {
        from = at + "crate::".len();
        // Not `$crate`, not the end of a longer word.
        if !code[..at].ends_with(|c: char| is_word(c)) {
            expand(&code[from..], &[], &mut paths);
        }
    }
    paths
}

/// Adds the paths of one use tree; returns what follows it.
fn expand<'a>(tree: &'a str, prefix: &[String], paths: &mut Vec<Vec<String>>) -> &'a str {
    let mut path = prefix.to_vec();
    let mut rest = tree.trim_start();
    loop {
        if let Some(mut inner) = rest.strip_prefix('{') {
            loop {
                inner = inner.trim_start();
                match inner.chars().next() {
                    Some('}') => return &inner[1..],
                    Some(',') => inner = &inner[1..],
                    Some(_) => {
                        let left = expand(inner, &path, paths);
                        // Whatever this is, it is no use tree.
                        if left.len() == inner.len() {
                            return left;
                        }
                        inner = left;
                    }
                    None => return inner,
                }
            }
        }
        let end = rest.find(|c| !is_word(c) && c != '*').unwrap_or(rest.len());
        if end > 0 {
            path.push(rest[..end].into());
        }
        rest = &rest[end..];
        match rest.strip_prefix("::") {
            Some(next) => rest = next.trim_start(),
            None => break,
        }
    }
    let renamed = rest.trim_start().strip_prefix("as ");
    if let Some(name) = renamed {
        rest = name.trim_start().trim_start_matches(is_word);
    }
    paths.push(path);
    rest
}

/// Member crates of several layers.
const CRATES: [&str; 4] = ["numerics/", "model/", "engine/", "picture/"];

/// The path below src, without the member crate that holds several layers.
fn inside(file: &str) -> Option<&str> {
    let inside = file.strip_prefix("src/")?;
    let below = |name: &&str| inside.strip_prefix(*name);
    Some(CRATES.iter().find_map(below).unwrap_or(inside))
}

fn layer(file: &str) -> Option<&str> {
    inside(file)?.split_once('/').map(|(layer, _)| layer)
}

/// What is wrong with these sources' imports.
fn import_faults(sources: &[(String, String)]) -> Vec<String> {
    let mut faults = Vec::new();
    for (file, code) in sources {
        let Some(own) = layer(file) else {
            continue;
        };
        let Some((_, allowed)) = LAYERS.iter().find(|(name, _)| *name == own) else {
            faults.push(format!("{file}: the table has no layer '{own}'"));
            continue;
        };
        for path in imports(code) {
            let Some(other) = path.first() else {
                continue;
            };
            // In a crate of one layer, its own modules.
            let is_layer = LAYERS.iter().any(|(name, _)| name == other);
            let fine = other == own
                || !is_layer && ["io", "light", "reference", "measure", "cli"].contains(&own)
                || allowed.contains(&other.as_str())
                    && (own != "reference" || reference_may(&path));
            if !fine {
                faults.push(format!("{file}: {own} may not use {}", path.join("::")));
            }
        }
        // Two steps up from src/a/b.rs are the crate, three from src/a/b/c.rs.
        let depth = 1 + inside(file).map_or(0, |path| path.matches('/').count());
        let depth = depth - usize::from(file.ends_with("/mod.rs"));
        let climb = "super::".repeat(depth.max(2));
        if code.contains(&climb) {
            faults.push(format!("{file}: {climb} leaves its layer; say crate::"));
        }
    }
    faults
}

#[test]
fn layers_point_one_way() {
    let sources = sources(&["src"]);
    assert!(sources.len() > 20, "{}", sources.len());
    let faults = import_faults(&sources);
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
    // The table itself points one way: io and plan do not know each other.
    for (i, (_, allowed)) in LAYERS.iter().enumerate() {
        let lower: Vec<&str> = LAYERS[..i].iter().map(|(name, _)| *name).collect();
        assert!(allowed.iter().all(|name| lower.contains(name)));
    }
}

#[test]
fn forbidden_imports_are_found() {
    let faults = |file: &str, text: &str| import_faults(&[(file.into(), code(text))]).join("; ");
    for (file, text, fault) in [
        (
            "src/math/a.rs",
            "use crate::scene::Scene;",
            "math may not use scene::Scene",
        ),
        (
            "src/io/a.rs",
            "pub use crate::render::Picture;",
            "render::Picture",
        ),
        (
            "src/io/a.rs",
            "fn f() -> crate::plan::Plan {}",
            "plan::Plan",
        ),
        (
            "src/scene/a.rs",
            "use crate::{\n    geom::{Cone, Sphere},\n    accel::{self, bvh as tree},\n};",
            "scene may not use accel::self; src/scene/a.rs: scene may not use accel::bvh",
        ),
        (
            "src/measure/a.rs",
            "use crate::cli;",
            "measure may not use cli",
        ),
        (
            "src/reference/a.rs",
            "use crate::geom::polygon_plane;",
            "geom::polygon_plane",
        ),
        (
            "src/reference/a.rs",
            "use crate::geom::sphere::Sphere;",
            "geom::sphere",
        ),
        ("src/reference/a.rs", "use crate::scene::*;", "scene::*"),
        (
            "src/reference/a.rs",
            "use crate::math::{Affine, Vec3};",
            "math::Vec3",
        ),
        (
            "src/reference/a.rs",
            "use crate::trace::Outcome;",
            "trace::Outcome",
        ),
        ("src/attic/a.rs", "", "no layer 'attic'"),
        ("src/io/a.rs", "use super::super::cli;", "leaves its layer"),
        (
            "src/io/a/b.rs",
            "use super::super::super::cli;",
            "leaves its layer",
        ),
    ] {
        let found = faults(file, text);
        assert!(found.contains(fault), "{text}: {found}");
    }
    for (file, text) in [
        (
            "src/math/a.rs",
            "// use crate::scene::Scene;\n/* crate::io */",
        ),
        (
            "src/math/a.rs",
            "const A: &str = \"use crate::io;\"; // \"\n",
        ),
        ("src/math/a.rs", "const A: &str = r#\"\"crate::io\"#;"),
        (
            "src/math/a.rs",
            "const A: [char; 2] = ['\"', '\\\"']; // crate::io",
        ),
        ("src/math/a.rs", "use crate::math::Aabb; my_crate::io::f();"),
        (
            "src/reference/a.rs",
            "use crate::{math::Affine, geom::Cone, scene::Shape};",
        ),
        ("src/trace/a.rs", "use crate::{accel::Bvh, plan::Plan};"),
        (
            "src/picture/render/mod.rs",
            "pub use crate::io::{AovSet, Picture};",
        ),
        ("src/io/a/b.rs", "use super::super::LoadError;"),
        ("src/lib.rs", "use crate::cli;"),
    ] {
        assert_eq!(faults(file, text), "", "{text}");
    }
}

/// Files that name the crate `wide`; a module of accel has the same name.
fn naming_wide(sources: &[(String, String)]) -> Vec<&str> {
    let names = |code: &str| {
        code.match_indices("wide::").any(|(at, _)| {
            let before = &code[..at];
            let ours = ["super::", "accel::"].iter().any(|m| before.ends_with(m));
            !ours && !before.ends_with(is_word)
        })
    };
    let others = sources
        .iter()
        .filter(|(file, _)| file != "src/engine/accel/mod.rs");
    let found = others.filter(|(_, code)| names(code));
    found.map(|(file, _)| file.as_str()).collect()
}

#[test]
fn one_file_names_the_registers() {
    let found = sources(&["src", "tests", "benches"]);
    assert_eq!(
        naming_wide(&found),
        ["src/numerics/math/lanes/registers.rs"]
    );
    for (text, named) in [
        ("use wide::f32x8;", true),
        ("let x = wide::f32x8::ZERO;", true),
        ("use ::wide::f32x8;", true),
        ("use super::wide::WideBlas;", false),
        ("use world::world_wide::X;", false),
        ("// wide::f32x8", false),
    ] {
        let sources = [("src/geom/a.rs".into(), code(text))];
        assert_eq!(!naming_wide(&sources).is_empty(), named, "{text}");
    }
}

#[test]
fn unsafe_is_counted() {
    let mut found: Vec<(String, usize)> = Vec::new();
    for (file, code) in sources(&["src", "tests", "benches"]) {
        let words = code
            .split(|c| !is_word(c))
            .filter(|w| *w == "unsafe")
            .count();
        if words > 0 {
            found.push((file, words));
        }
    }
    let mut allowed: Vec<(String, usize)> = UNSAFE.iter().map(|(f, n)| ((*f).into(), *n)).collect();
    allowed.sort();
    assert_eq!(
        found, allowed,
        "found (left) is not what is allowed (right)"
    );
}

#[test]
fn the_top_level_is_tidy() {
    let stray: Vec<String> = fs::read_dir(root())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| !name.starts_with('.') && !TOP_LEVEL.contains(&name.as_str()))
        .collect();
    assert!(stray.is_empty(), "not listed in TOP_LEVEL: {stray:?}");
}

#[test]
fn tests_that_texts_name_are_there() {
    const NAMED: &str = "--test ";
    let mut named = 0;
    for file in files(&["README.md", "docs", ".ci", "src", "tests"]) {
        // Pictures are no texts.
        let Ok(text) = fs::read_to_string(&file) else {
            continue;
        };
        let file = file.display();
        for rest in text.split(NAMED).skip(1) {
            let name = rest.split(|c| !is_word(c)).next().unwrap_or_default();
            if name.is_empty() || name == "NAME" {
                continue;
            }
            assert!(
                root().join("tests").join(name).is_dir(),
                "{file}: --test {name}"
            );
            named += 1;
        }
    }
    assert!(named > 10, "{named}");
}

#[test]
fn licences_are_there() {
    for (file, line) in [
        (
            "LICENSE-MIT",
            "Permission is hereby granted, free of charge",
        ),
        ("LICENSE-APACHE", "Version 2.0, January 2004"),
    ] {
        let text = fs::read_to_string(Path::new(&root()).join(file)).unwrap();
        assert!(text.contains(line), "{file}");
    }
}

/// Functions of f32 and f64 that the platform's library computes, each in its own way. A lane's own
/// `sin_cos` has no such name.
const OF_THE_PLATFORM: [&str; 23] = [
    "acos", "acosh", "asin", "asinh", "atan", "atan2", "atanh", "cbrt", "cos", "cosh", "exp",
    "exp2", "exp_m1", "hypot", "ln", "ln_1p", "log", "log10", "log2", "powf", "sin", "sinh", "tan",
];

/// Whether numbers of this file come into pictures: not those of tests, of plots, nor of the
/// reference, whose pictures nobody sees.
fn makes_pictures(file: &str) -> bool {
    let apart = ["src/reference/", "src/measure/"];
    let is_test = |part: &str| part.contains("tests") || part.starts_with("test_");
    !apart.iter().any(|folder| file.starts_with(folder))
        && !file.split('/').any(is_test)
        && file != "src/light/chi2.rs"
}

/// The calls of such functions in code, up to its tests.
fn platform_calls(code: &str) -> Vec<String> {
    let code = code.split("#[cfg(test)]").next().unwrap_or_default();
    let calls = OF_THE_PLATFORM.iter().flat_map(|name| {
        [
            format!(".{name}("),
            format!("f32::{name}"),
            format!("f64::{name}"),
        ]
    });
    let ends = |rest: &str| !rest.starts_with(is_word);
    calls
        .filter(|call| {
            let found = code.match_indices(call.as_str());
            found
                .into_iter()
                .any(|(at, _)| call.ends_with('(') || ends(&code[at + call.len()..]))
        })
        .collect()
}

/// Pictures have the same bits on every machine (docs/SPEC.md, S65).
#[test]
fn elementary_functions_are_those_of_libm() {
    assert_eq!(platform_calls("let y = x.ln();"), [".ln("]);
    assert_eq!(platform_calls("xs.map(f64::exp)"), ["f64::exp"]);
    let fine = "libm::ln(x) + one.cos + f32::EPSILON + self.sin_cos()[0]\n#[cfg(test)]\nx.ln()";
    assert!(platform_calls(fine).is_empty());
    let faults: Vec<String> = sources(&["src"])
        .iter()
        .filter(|(file, _)| makes_pictures(file))
        .flat_map(|(file, code)| {
            let calls = platform_calls(code);
            calls.into_iter().map(move |call| format!("{file}: {call}"))
        })
        .collect();
    assert!(
        faults.is_empty(),
        "call libm instead:\n{}",
        faults.join("\n")
    );
}
