//! Files that are wrong as a whole: syntax of JSON, bytes, paths, depth.

use super::*;

#[test]
fn json() {
    let ball = r#""shape": {"x": {"sphere": {"center": [0,0,0], "radius": 1}}}"#;
    let cases: &[(&str, &[&str])] = &[
        ("", &["scene.json:1:1: the file ends too early"]),
        ("{}", &["scene.json:1:1: the key 'format' is missing"]),
        ("[]", &["scene.json:1:1: expected a table, found a list"]),
        (
            "{\"format\": 1,\n}",
            &["scene.json:2:1: expected a key in double quotes"],
        ),
        (
            "{\"format\": 1}\n x",
            &["scene.json:2:2: there is more after the end"],
        ),
        ("{\"format\": 2}", &["scene.json:1:12: format 2 is unknown"]),
        (
            "{\"format\": 1.0}",
            &["scene.json:1:12: expected 1, written without a point"],
        ),
        (
            "{\"format\": null}",
            &["scene.json:1:12: expected 1, found null"],
        ),
        (
            "{\"format\": 1,\n\"format\": 1}",
            &["scene.json:2:1: the key 'format' is given twice"],
        ),
        (
            "{\"format\": 1,\n\"shape\": {\"a\": {}, \"\\u0061\": {}}}",
            &["scene.json:2:20: the key 'a' is given twice"],
        ),
        (
            "{\"format\": 1,\n \"shapes\": {}}",
            &["scene.json:2:2: unknown key 'shapes'; did you mean 'shape'?"],
        ),
        (
            "{\"format\": 1, \"shape\": {\"x\":\n {\"sphere\": {\"center\": [0,0,\"0\"], \"radius\": 1}}}}",
            &["scene.json:2:29: expected a number, found text"],
        ),
        (
            "{\"format\": 1, \"shape\": {\"x\":\n {\"sphere\": {\"center\": [0,0,1e999], \"radius\": 1}}}}",
            &["scene.json:2:", "the number is too large"],
        ),
        (
            "{\"format\": 1, \"shape\": {\"x\": {\"sphere\": {\"center\": [NaN,0,0]}}}}",
            &["scene.json:1:53: expected"],
        ),
        (
            "{\"format\": 1, \"shape\": {\"x\": {\"torus\": 1}}}",
            &["scene.json:1:40: expected a table, found a number"],
        ),
        (
            "{\"format\": 1, \"shape\": {\"\\ud800\": {}}}",
            &["scene.json:1:", "come in pairs"],
        ),
        (
            "{\"format\": 1, \"shape\": {\"x\": {\"union\": [3]}}}",
            &["scene.json:1:", "expected one operand", ", found a number"],
        ),
        (
            "{\"format\": 1, \"shapes\": null}",
            &["scene.json:1:15: unknown key 'shapes'"],
        ),
    ];
    for (text, expected) in cases {
        check("scene.json", text.as_bytes(), expected);
    }
    let instance = |text: &str| format!("{{\"format\": 1, {ball},\n\"instance\": [{{{text}}}]}}");
    check(
        "scene.json",
        instance("\"shape\": \"y\"").as_bytes(),
        &["scene.json:2:24: there is no shape 'y'"],
    );
    check(
        "scene.json",
        instance("\"shape\": null").as_bytes(),
        &["scene.json:2:14: none of shape, node and scene"],
    );
    check(
        "scene.json",
        instance("\"shape\": \"x\", \"transform\": [{\"scale\": 0}]").as_bytes(),
        &["singular transform"],
    );
}

#[test]
fn bytes_that_are_no_text() {
    check(
        "scene.toml",
        b"format = 1\n# caf\xe9\n",
        &["scene.toml:2:6: it is not UTF-8 text"],
    );
    check(
        "scene.json",
        b"\xff\xfe{\0}\0",
        &["scene.json:1:1: it is not UTF-8 text"],
    );
    check("scene.toml", b"format = 1\n\0\0\0", &["scene.toml:2:"]);
    check("scene.json", b"\0", &["scene.json:1:1"]);
}

#[test]
fn files_that_may_not_or_cannot_be_read() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("secret.stl"), "solid").unwrap();
    let inner = folder.path().join("inner");
    std::fs::create_dir_all(inner.join("folder.stl")).unwrap();
    let absolute = folder.path().join("secret.stl");
    let absolute = absolute.to_str().unwrap();
    let mut cases = vec![
        (
            "gone.stl",
            "scene.toml:2:16: the mesh file 'gone.stl' cannot be read",
        ),
        (
            "../secret.stl",
            "names the file '../secret.stl', which lies outside its folder",
        ),
        ("folder.stl/../../secret.stl", "lies outside its folder"),
        ("../gone.stl", "lies outside its folder"),
        (absolute, "lies outside its folder"),
        ("/etc/passwd", "lies outside its folder"),
        ("", "inner"),
    ];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("../secret.stl", inner.join("link.stl")).unwrap();
        cases.push(("link.stl", "lies outside its folder"));
    }
    let path = inner.join("scene.toml");
    for (named, expected) in cases {
        std::fs::write(&path, shape(&format!("mesh = '{named}'"))).unwrap();
        let message = refusal(&path, named);
        assert!(
            message.contains(expected),
            "{named}\n  gave {message}\n  not  {expected}"
        );
    }
    std::fs::write(inner.join("a.toml"), "").unwrap();
    for (named, expected) in [
        (
            "folder.stl",
            "scene.toml:2:16: the mesh file 'folder.stl' is a folder",
        ),
        (".", "scene.toml:2:16: the mesh file '.' is a folder"),
        (
            "scene.toml",
            "of no known format; known are .obj .ply .stl .3mf .gltf .glb",
        ),
        (
            "a.toml",
            "scene.toml:2:16: the mesh file 'a.toml' is of no known format",
        ),
    ] {
        std::fs::write(&path, shape(&format!("mesh = '{named}'"))).unwrap();
        let message = refusal(&path, named);
        assert!(message.contains(expected), "{message}");
    }
    let message = refusal(&inner.join("none.toml"), "no file");
    assert!(message.contains("none.toml: cannot be read"), "{message}");
}

/// A million levels, and other shapes of too much.
#[test]
fn depth_is_bounded() {
    const DEEP: usize = 1_000_000;
    let deep = |text: &str| text.repeat(DEEP);
    let toml: Vec<String> = vec![
        format!("format = 1\nx = {}", deep("[")),
        format!("format = 1\nx = {}{}", deep("["), deep("]")),
        format!("format = 1\nx = {}1{}", deep("{a="), deep("}")),
        format!("format = 1\nx{} = 1", deep(".a")),
        format!("format = 1\n[x{}]", deep(".a")),
        format!("format = 1\n[[x{}]]", deep(".a")),
        // Each level within the parser's limit, all of them together not.
        format!(
            "format = 1\nx = {}1{}",
            format!("{{a{}=", ".a".repeat(70)).repeat(70),
            "}".repeat(70)
        ),
    ];
    for text in toml {
        check("scene.toml", text.as_bytes(), &["scene.toml:2:"]);
    }
    let json = [
        format!("{{\"format\": 1,\n\"x\": {}", deep("[")),
        format!("{{\"format\": 1,\n\"x\": {}{}}}", deep("["), deep("]")),
        format!(
            "{{\"format\": 1,\n\"x\": {}1{}}}",
            deep("{\"a\":"),
            deep("}")
        ),
        format!(
            "{{\"format\": 1,\n\"x\": {}{}}}",
            "[".repeat(100),
            "]".repeat(100)
        ),
    ];
    for text in json {
        check("scene.json", text.as_bytes(), &["scene.json:2:"]);
    }
    let name = deep("long");
    check(
        "scene.toml",
        format!("format = 1\n{name} = 1").as_bytes(),
        &["scene.toml:2:1: unknown key 'longlong"],
    );
    let instance = format!("format = 1\n[[instance]]\nshape = '{name}'");
    check(
        "scene.toml",
        instance.as_bytes(),
        &["scene.toml:3:9: there is no shape 'longlong"],
    );
}
