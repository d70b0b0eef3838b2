//! Tests of the text of `.csg` files.

use super::*;

fn parsed(text: &str) -> Result<Vec<(String, u32)>, String> {
    let tree = Tree::parse(Path::new("a.csg"), text).map_err(|e| e.to_string())?;
    let nodes = tree.nodes.iter();
    Ok(nodes.map(|node| (node.name.into(), node.end)).collect())
}

#[test]
fn nodes_stand_in_the_order_of_the_file() {
    let text = "group() { // all\n cube(size = [1, 2, 3], center = true); union();\n}\n\
                % # multmatrix([[1]]) sphere(r = 1e2); /* end */ ;";
    let rows = parsed(text).unwrap();
    let expected = [("group", 3), ("cube", 2), ("union", 3), ("multmatrix", 5)];
    assert_eq!(rows.len(), 5);
    for (row, (name, end)) in rows.iter().zip(expected) {
        assert_eq!(*row, (name.to_string(), end));
    }
    let tree = Tree::parse(Path::new("a"), text).unwrap();
    assert_eq!(tree.top().collect::<Vec<_>>(), [0, 3]);
    assert_eq!(tree.children(0).collect::<Vec<_>>(), [1, 2]);
    assert_eq!(tree.children(3).collect::<Vec<_>>(), [4]);
    assert!(tree.nodes[3].modifiers.is_background && tree.nodes[3].modifiers.is_marked);
    assert_eq!(tree.lines(), [1, 2, 2, 4, 4]);
}

#[test]
fn values_are_those_that_openscad_writes() {
    let text =
        r#"a($fn = 0, x = undef, t = "a\"\\\nb", l = [], n = [[1, -inf], [nan]], b = true, 7);"#;
    let tree = Tree::parse(Path::new("a"), text).unwrap();
    let arguments = &tree.nodes[0].arguments;
    let [fragments, x, t, l, n, b, last] = &arguments[..] else {
        panic!("{arguments:?}");
    };
    assert_eq!(
        (fragments.name, &fragments.value),
        ("$fn", &Value::Number(0.0))
    );
    assert_eq!(x.value, Value::Undefined);
    assert_eq!(t.value, Value::Text("a\"\\\nb".into()));
    assert_eq!(l.value, Value::List(Vec::new()));
    let Value::List(rows) = &n.value else {
        panic!()
    };
    let infinite = Value::Number(f64::NEG_INFINITY);
    assert_eq!(rows[0], Value::List(vec![Value::Number(1.0), infinite]));
    assert!(
        matches!(&rows[1], Value::List(one) if matches!(one[..], [Value::Number(x)] if x.is_nan()))
    );
    assert_eq!(b.value, Value::Bool(true));
    assert_eq!((last.name, &last.value), ("", &Value::Number(7.0)));
}

#[test]
fn what_is_wrong_is_said_with_its_place() {
    for (text, says) in [
        (
            "cube(",
            "a.csg:1:6: expected a value, found the end of the file",
        ),
        (
            "cube()",
            "a.csg:1:1: cube() is not closed at the end of the file",
        ),
        ("group() {\n  }\n}", "a.csg:3:1: this } closes nothing"),
        ("x = 3;", "a.csg:1:1: 'x' is OpenSCAD's language"),
        ("cube(size = [1, 2", "expected a comma or ] in a list"),
        ("cube(size = \"1", "no closing quote"),
        ("/* a", "no end"),
        (
            "cube(1 2);",
            "expected a comma or ) behind an argument, found '2);'",
        ),
        (
            "a([[[[[[[[[[[[[[[[[[1]]]]]]]]]]]]]]]]]]);",
            "more than 16 deep",
        ),
        ("§();", "expected a node such as cube(…), found '§();'"),
    ] {
        let error = parsed(text).unwrap_err();
        assert!(error.contains(says), "{text}: {error}");
    }
}

#[test]
fn a_hundred_thousand_levels_are_read() {
    let text = "group(){".repeat(100_000) + &"}".repeat(100_000);
    assert_eq!(parsed(&text).unwrap().len(), 100_000);
}
