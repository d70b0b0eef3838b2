//! 3MF that is malformed, or asks for more than its size.

use super::{CORE, cuboid, model, packed, read, refused};
use crate::common::within_seconds;
use std::fmt::Write as _;
use std::io::{Cursor, Write as _};
use std::time::{Duration, Instant};
use zip::write::SimpleFileOptions;

#[test]
fn malformed_files_are_refused_by_part_and_line() {
    let good = format!("<object id=\"1\">{}</object>", cuboid([1.0; 3], ""));
    let item = "<item objectid=\"1\"/>";
    let of = |from: &str, to: &str| {
        let text = model("", &good, item);
        assert!(text.contains(from), "{from}");
        packed(&text.replacen(from, to, 1))
    };
    for (from, to, says) in [
        (
            "v1=\"0\"",
            "v1=\"8\"",
            "object 1: triangle 0 has vertex 8, but there are only 8",
        ),
        (
            "v1=\"0\"",
            "v1=\"-1\"",
            "v1 of a triangle is '-1', not a whole number",
        ),
        ("v1=\"0\"", "", "a triangle has no v1"),
        (
            "x=\"0\"",
            "x=\"nan\"",
            "object 1: x of vertex 0 is 'nan', not a finite number",
        ),
        ("x=\"0\"", "x=\"1e999\"", "x of vertex 0 is '1e999'"),
        ("x=\"0\"", "", "a vertex has no x"),
        ("<object id=\"1\"", "<object", "a object has no id"),
        (
            "objectid=\"1\"",
            "objectid=\"2\"",
            "there is no object 2, which is placed",
        ),
        (
            "objectid=\"1\"",
            "objectid=\"1\" transform=\"1 2 3\"",
            "'1 2 3' is not 12 finite numbers",
        ),
        ("</vertices>", "</vertexes>", "not well-formed XML"),
        ("</model>", "", "it ends within an element"),
        (
            "<model ",
            "<thing ",
            "its first element is 'thing', not 'model'",
        ),
        (
            "<model ",
            "<!DOCTYPE model><model ",
            "a document type, which 3MF forbids",
        ),
    ] {
        let said = refused(&of(from, to));
        assert!(said.contains(says), "{said}");
        assert!(said.contains("3dmodel.model"), "{said}");
    }
    let twice = format!("{good}{good}");
    let said = refused(&packed(&model("", &twice, item)));
    assert!(said.contains("there are two objects 1"), "{said}");
    let said = refused(&packed(&model("unit=\"ell\"", &good, item)));
    assert!(said.contains("its unit 'ell' is none of micron"), "{said}");
    let kind = good.replace("id=\"1\"", "id=\"1\" type=\"ghost\"");
    let said = refused(&packed(&model("", &kind, item)));
    assert!(
        said.contains("object 1 has an unknown type 'ghost'"),
        "{said}"
    );
    let said = refused(b"PK is not enough");
    assert!(
        said.contains("it is no zip archive that can be read"),
        "{said}"
    );
    let said = refused(&packed(&model("", &good, "")));
    assert!(said.contains("the scene is empty"), "{said}");
    assert!(said.contains("1 × object that is not built"), "{said}");
}

#[test]
fn objects_are_no_parts_of_themselves() {
    let with = |components: &str| format!("<components>{components}</components>");
    let of = |id: u32| format!("<component objectid=\"{id}\"/>");
    let resources = format!(
        "<object id=\"1\">{}</object><object id=\"2\">{}</object>",
        with(&of(2)),
        with(&of(1))
    );
    let said = refused(&packed(&model("", &resources, "<item objectid=\"1\"/>")));
    assert!(said.contains("object 1 is a part of itself"), "{said}");
}

/// A chain of objects, each of two of the next: 2^60 instances are refused, and those of a chain
/// of single components are one.
#[test]
fn nests_are_counted_and_not_followed() {
    let chain = |depth: u32, times: usize| {
        let mut text = format!("<object id=\"1\">{}</object>", cuboid([1.0; 3], ""));
        for id in 2..=depth {
            let one = format!("<component objectid=\"{}\"/>", id - 1);
            let all = one.repeat(times);
            let _ = write!(
                text,
                "<object id=\"{id}\"><components>{all}</components></object>"
            );
        }
        packed(&model("", &text, &format!("<item objectid=\"{depth}\"/>")))
    };
    let start = Instant::now();
    let loaded = read(&chain(50_000, 1)).unwrap();
    assert_eq!(
        lanecast::internals::scene::Instances::of(&loaded.scene)
            .unwrap()
            .count(),
        1
    );
    let deep = read(&chain(200, 2));
    let instances =
        deep.map(|loaded| lanecast::internals::scene::Instances::of(&loaded.scene).err());
    assert!(
        !matches!(instances, Ok(None)),
        "more instances than can be counted"
    );
    assert!(start.elapsed() < Duration::from_secs(60));
}

/// A package of one part, which begins with `head` and goes on with a thousand pieces, again and again.
fn bomb(name: &str, head: &str, piece: &str, thousands: usize) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    zip.start_file(name, SimpleFileOptions::default()).unwrap();
    zip.write_all(head.as_bytes()).unwrap();
    let pieces = piece.repeat(1000);
    for _ in 0..thousands {
        zip.write_all(pieces.as_bytes()).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

/// Archives of kilobytes that become hundreds of megabytes.
#[test]
fn bombs_are_refused_early() {
    const MODEL: &str = "3d/3dmodel.model";
    let far = "it holds far more than the size of the file justifies";
    let deep_in = |inner: &str| format!("<model xmlns=\"{CORE}\"><resources>{inner}");
    let in_mesh = deep_in("<object id=\"1\"><mesh><vertices>");
    let vertex = "<vertex x=\"0\" y=\"0\" z=\"0\"/>";
    let long = format!("<model xmlns=\"{CORE}\" a=\"");
    let spaces: String = (0..500).map(|i| format!("xmlns:a{i}=\"b\" ")).collect();
    let spaces = format!("<model xmlns=\"{CORE}\" {spaces}/>");
    for (part, head, piece, thousands, says) in [
        (MODEL, &*in_mesh, vertex, 5_000, far),
        (MODEL, &*deep_in(""), " <!-- -->", 20_000, far),
        (MODEL, &*deep_in(""), "<object id=\"1\"/>", 500, far),
        (
            MODEL,
            &*deep_in("<basematerials id=\"1\">"),
            "<base displaycolor=\"#123456\"/>",
            1_500,
            far,
        ),
        (
            MODEL,
            &*deep_in("</resources><build>"),
            "<item objectid=\"1\"/>",
            1_000,
            far,
        ),
        (
            MODEL,
            &*long,
            "aaaaaaaaaaaaaaaaaaaa",
            1_000,
            "a tag or text has more than 16 MiB",
        ),
        (MODEL, &*deep_in(""), "<a>", 100, "nests elements"),
        (MODEL, &*spaces, "", 0, "namespace"),
        ("_rels/.rels", "<Relationships>", " <!-- -->", 20_000, far),
    ] {
        let bytes = bomb(part, head, piece, thousands);
        let said = within_seconds(60, || refused(&bytes));
        assert!(said.contains(part) && said.contains(says), "{said}");
    }
}
