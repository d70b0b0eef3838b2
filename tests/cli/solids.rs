//! Commands about solids: `probe`, `export`, and what `plan` says about CSG.

use crate::run::{folder, lanecast, names, stderr, stdout};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// A block with a bore through it and a blind slot, seen along z; a sheet and an open pipe.
pub const PART: &str = "format = 1
[material.steel]
[material.bright]
[shape]
part.difference = [{ shape = 'block', material = 'steel' }, { shape = 'bore', material = 'bright' }]
block.box = { min = [-1, -1, -3], max = [1, 1, 3] }
bore.cylinder = { base = [-2, 0, 0], top = [2, 0, 0], radius = 0.5 }
ball.sphere = { center = [0, 0, 0], radius = 1 }
under.half_space = { normal = [0, 0, 1], offset = -20 }
sheet.polygon.points = [[-1, -1, 0], [1, -1, 0], [0, 1, 0]]
pipe = { cylinder = { base = [0, 0, 0], top = [0, 1, 0], radius = 0.5 }, open = true }
[[instance]]
shape = 'part'
[[instance]]
shape = 'ball'
transform = [{ scale = 0.5 }, { translate = [0, 0, 12] }]
[[instance]]
shape = 'under'
[[instance]]
shape = 'sheet'
[[instance]]
shape = 'pipe'
";

pub fn write(folder: &Path, text: &str) {
    fs::write(folder.join("a.toml"), text).unwrap();
}

pub fn probe(folder: &Path, text: &str, org: &str, dir: &str) -> Value {
    write(folder, text);
    let arguments = ["probe", "a.toml", "--org", org, "--dir", dir, "--json", "-"];
    let output = lanecast(folder, &arguments);
    assert!(output.status.success(), "{}", stderr(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn probe_lists_every_span_in_front_and_behind() {
    let folder = folder();
    let found = probe(folder.path(), PART, "0,0,10", "0,0,-2");
    assert_eq!(found["surfaces_left_out"], 2);
    let spans = found["spans"].as_array().unwrap();
    let ends: Vec<_> = spans
        .iter()
        .map(|s| {
            let t = |key: &str| s[key].as_f64();
            let text = |key: &str| s[key].as_str().unwrap();
            (text("side"), text("solid"), t("t_enter"), t("t_exit"))
        })
        .collect();
    assert_eq!(
        ends,
        [
            ("behind", "ball", Some(-1.25), Some(-0.75)),
            ("ahead", "part", Some(3.5), Some(4.75)),
            ("ahead", "part", Some(5.25), Some(6.5)),
            ("ahead", "under", Some(15.0), None),
        ]
    );
    let end = |span: usize, end: &str| {
        let end = &spans[span][end];
        let list = |key: &str| -> Vec<f64> {
            let rows = end[key].as_array().unwrap().iter();
            rows.map(|x| x.as_f64().unwrap()).collect()
        };
        (
            end["shape"].as_str().unwrap().to_string(),
            end["material"].as_str().map(str::to_string),
            list("point"),
            list("normal"),
        )
    };
    let said = |shape: &str, material: &str| (shape.to_string(), Some(material.to_string()));
    let (shape, material, point, normal) = end(1, "enter");
    assert_eq!((shape, material), said("block", "steel"));
    assert_eq!((point, normal), (vec![0.0, 0.0, 3.0], vec![0.0, 0.0, 1.0]));
    // The bore's wall: the solid's outside is the bore's inside.
    let (shape, material, point, normal) = end(1, "exit");
    assert_eq!((shape, material), said("bore", "bright"));
    assert_eq!((point, normal), (vec![0.0, 0.0, 0.5], vec![0.0, 0.0, -1.0]));
    let (_, material, point, normal) = end(0, "exit");
    assert_eq!((material, point), (None, vec![0.0, 0.0, 11.5]));
    assert_eq!(normal, [0.0, 0.0, -1.0]);
    assert_eq!(spans[3]["exit"], Value::Null);
    assert_eq!(spans[3]["enter"]["instance"], 2);
}

#[test]
fn probe_from_within_and_along_nothing() {
    let folder = folder();
    let found = probe(folder.path(), PART, "0,0,2", "0,0,1");
    let spans = found["spans"].as_array().unwrap();
    assert_eq!(spans[0]["solid"], "under");
    assert_eq!(spans[0]["t_enter"], Value::Null);
    assert_eq!(spans[0]["t_exit"], -22.0);
    assert_eq!(
        (&spans[2]["side"], &spans[2]["solid"]),
        (&"around".into(), &"part".into())
    );
    let outside = PART.replace("[shape]", "[shape]\nnothing.intersection = ['ball', 'far']\nfar.sphere = { center = [9, 0, 0], radius = 1 }\neverything.complement = 'nothing'")
        .replace("shape = 'under'", "shape = 'everything'");
    let found = probe(folder.path(), &outside, "100,0,0", "0,1,0");
    let spans = found["spans"].as_array().unwrap();
    assert_eq!(spans.len(), 1);
    assert_eq!(
        (&spans[0]["t_enter"], &spans[0]["t_exit"]),
        (&Value::Null, &Value::Null)
    );
    assert_eq!(spans[0]["side"], "around");
}

#[test]
fn probe_prints_a_table_for_people() {
    let folder = folder();
    write(folder.path(), PART);
    let arguments = ["probe", "a.toml", "--org", "0,0,10", "--dir", "0,0,-1"];
    let output = lanecast(folder.path(), &arguments);
    assert!(output.status.success(), "{}", stderr(&output));
    for line in [
        "behind  t -2.5 to -1.5, length 1.0: ball (instance 1)",
        "ahead   t 7.0 to 9.5, length 2.5: part (instance 0)",
        "4 spans;",
        "2 instances of surfaces left out",
    ] {
        assert!(stdout(&output).contains(line), "{}", stdout(&output));
    }
    // A file instead, whole.
    let mut arguments = arguments.to_vec();
    arguments.extend(["--json", "spans.json"]);
    let output = lanecast(folder.path(), &arguments);
    assert!(output.status.success() && stdout(&output).contains("4 spans;"));
    assert_eq!(names(folder.path()), ["a.toml", "spans.json"]);
}

#[test]
fn export_writes_the_whole_file_or_none() {
    let folder = folder();
    write(folder.path(), PART);
    let output = lanecast(folder.path(), &["export", "a.toml", "--pov", "a.pov"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let text = fs::read_to_string(folder.path().join("a.pov")).unwrap();
    assert_eq!(stdout(&output), format!("a.pov: {} bytes\n", text.len()));
    assert!(text.contains("#version 3.7;") && text.contains("difference {"));
    let output = lanecast(folder.path(), &["export", "a.toml", "--pov", "-"]);
    assert_eq!(stdout(&output), text);
    for (pov, code) in [("none/a.pov", 4), ("a.toml", 2)] {
        let output = lanecast(folder.path(), &["export", "a.toml", "--pov", pov]);
        assert_eq!(output.status.code(), Some(code), "{}", stderr(&output));
    }
    assert_eq!(
        fs::read_to_string(folder.path().join("a.toml")).unwrap(),
        PART
    );
    // 2000 operands would be four million parts.
    let many = "'ball',".repeat(2000);
    write(
        folder.path(),
        &PART
            .replace("[shape]", &format!("[shape]\nodd.xor = [{many}]"))
            .replace("shape = 'under'", "shape = 'odd'"),
    );
    let output = lanecast(folder.path(), &["export", "a.toml", "--pov", "b.pov"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        stderr(&output).contains("the xor 'odd' becomes 4194304 parts"),
        "{}",
        stderr(&output)
    );
    assert_eq!(names(folder.path()), ["a.pov", "a.toml"]);
}

#[test]
fn export_to_mitsuba_writes_all_files() {
    let folder = folder();
    let cube = "format = 1\n[shape]\nlid = { polygon = { points = [[0, 0, 0], [1, 0, 0], [0, 1, 0]] } }\n\
                [[instance]]\nshape = 'lid'\n";
    write(folder.path(), cube);
    let arguments = ["export", "a.toml", "--mitsuba", "b.xml", "--size", "20x10"];
    let output = lanecast(folder.path(), &arguments);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(stdout(&output).starts_with("b.xml: 3 files, "));
    assert!(stderr(&output).contains("warning: a.toml: only similar in Mitsuba: "));
    // The map is that of the studio, since the scene brings no light.
    let all = names(folder.path());
    assert!(
        ["a.toml", "b.xml", "b_mesh_0.ply"]
            .iter()
            .all(|name| all.iter().any(|n| n == name))
    );
    assert_eq!(all.len(), 4, "{all:?}");
    let xml = fs::read_to_string(folder.path().join("b.xml")).unwrap();
    assert!(xml.contains("value=\"b_mesh_0.ply\"") && xml.contains("name=\"width\" value=\"20\""));
    for (arguments, says) in [
        (["--mitsuba", "-"], "name one"),
        (["--mitsuba", "a.toml"], "is the input"),
        (["--max-bounces", "3"], "--pov <FILE>"),
    ] {
        let output = lanecast(
            folder.path(),
            &[&["export", "a.toml"][..], &arguments].concat(),
        );
        assert_eq!(output.status.code(), Some(2));
        assert!(stderr(&output).contains(says), "{}", stderr(&output));
    }
}

fn plan(text: &str) -> Value {
    let folder = folder();
    write(folder.path(), text);
    let output = lanecast(folder.path(), &["plan", "a.toml", "--json", "-"]);
    assert!(output.status.success(), "{}", stderr(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Nodes that have the next one twice; `step` keeps the two apart.
#[test]
fn plan_says_what_stands_at_one_place() {
    let notes = |levels: u32, step: u32| {
        let mut text = "format = 1\n[shape.a]\nsphere = { center = [0, 0, 0], radius = 1 }\n\
            [node.n0]\nchildren = [{ shape = 'a' }]\n"
            .to_string();
        for level in 1..=levels {
            let below = level - 1;
            text += &format!(
                "[node.n{level}]\nchildren = [{{ node = 'n{below}' }}, {{ node = 'n{below}', \
                 transform = [{{ translate = [{step}, 0, 0] }}] }}]\n"
            );
        }
        text += &format!("[[instance]]\nnode = 'n{levels}'\n");
        plan(&text)["remarks"].to_string()
    };
    let said = notes(40, 0);
    assert!(
        said.contains("1099511627776 instances of one shape stand at one"),
        "{said}"
    );
    assert_eq!(notes(16, 0), "[]");
    assert_eq!(notes(40, 1), "[]");
}

#[test]
fn plan_shows_csg() {
    let report = plan(PART);
    let rows = report["csg_solids"].as_array().unwrap();
    assert_eq!(rows.len(), 1);
    let row = &rows[0];
    assert_eq!(
        (&row["name"], &row["operands"]),
        (&"'part'".into(), &2.into())
    );
    assert_eq!((&row["gates"], &row["frames"]), (&1.into(), &1.into()));
    assert!(row["bytes"].as_u64().unwrap() > 0);
    assert_eq!(report["remarks"].as_array().unwrap().len(), 0);
}

#[test]
fn plan_says_what_is_odd_about_csg() {
    for (part, says) in [
        (
            "part.difference = ['block', 'far', 'farther']",
            "'part': 2 operands never matter: they lie apart from the solid, such as 'far'",
        ),
        (
            "part.difference = ['block', 'far']",
            "'part': the operand 'far' never matters: it lies apart from the solid",
        ),
        (
            "part.intersection = ['block', 'far']",
            "'part' is empty: the bounds of its operands do not overlap",
        ),
        (
            "part.union = ['block', 'none']\nnone.intersection = ['block', { shape = 'block', transform = [{ translate = [7, 0, 0] }] }]",
            "'none', a part of 'part', is empty",
        ),
        (
            "part.difference = ['block', 'bore']\nbore.cylinder = { base = [0, 0, 0], top = [0, 2, 0], radius = 0.5 }",
            "'part': 2 pairs of faces lie in one plane, such as one of 'block' and one of 'bore' (y = 0);",
        ),
        (
            "part.union = ['block', 'table']\ntable.half_space = { normal = [0, 2, 0], offset = 0 }",
            "'block' and 'table' have faces in one plane, y = 0; they",
        ),
        (
            "part.union = ['block', 'cap']\ncap.cone = { base = [0, 2, 0], top = [0, 3, 0], base_radius = 1, top_radius = 0 }",
            "'block' and 'cap' have faces in one plane, y = 2; they",
        ),
        (
            "part.union = ['block', { shape = 'block', transform = [{ translate = [2, 0, 0] }] }]",
            "5 pairs of faces lie in one plane, such as one of 'block' and one of 'block' (x = 1)",
        ),
        (
            "part.union = ['block', { shape = 'block', transform = [{ rotate_z = 45 }, { translate = [1, 1, 0] }] }, { shape = 'block', transform = [{ rotate_z = 45 }] }]",
            "one plane",
        ),
        (
            "part.difference = ['block', 'block']",
            "'part' is empty: its operands leave nothing",
        ),
        (
            "part.difference = ['block', 'again']\nagain.box = { min = [-1, 0, -1], max = [1, 2, 1] }",
            "'part' is empty: its operands leave nothing",
        ),
        (
            "part.intersection = ['block', 'outside']\noutside.complement = 'block'",
            "'part' is empty: its operands leave nothing",
        ),
        (
            "part.union = ['block', 'bead']\nbead.sphere = { center = [0, 1, 0], radius = 0.25 }",
            "'part': the operand 'bead' never matters to the solid's form: others",
        ),
        (
            "part.intersection = ['bead', 'block']\nbead.sphere = { center = [0, 1, 0], radius = 0.25 }",
            "'part': the operand 'block' never matters to the solid's form: others",
        ),
    ] {
        let report = plan(&format!(
            "format = 1\n[shape]\n{part}\nblock.box = {{ min = [-1, 0, -1], max = [1, 2, 1] }}\n\
             far.sphere = {{ center = [9, 0, 0], radius = 1 }}\n\
             farther.sphere = {{ center = [19, 0, 0], radius = 1 }}\n[[instance]]\nshape = 'part'\n"
        ));
        let remarks = report["remarks"].as_array().unwrap();
        assert_eq!(remarks.len(), 1, "{part}: {remarks:?}");
        let said = remarks[0].as_str().unwrap();
        assert!(said.contains(says), "{part}: {said}");
    }
}

#[test]
fn plan_says_which_surfaces_have_no_bounds() {
    for (more, says) in [
        (
            "",
            Some("'part' has no bounds, and every ray is tried on it: give it a clip"),
        ),
        (
            "open = true\nclip.sphere = { center = [0, 0, 0], radius = 2 }",
            None,
        ),
        ("clip.box = { min = [0, 0, 0], max = [1, 1, 1] }", None),
    ] {
        let report = plan(&format!(
            "format = 1\n[shape.part]\nimplicit = 'x*y - z'\n{more}\n[[instance]]\nshape = 'part'\n"
        ));
        let remarks = report["remarks"].as_array().unwrap();
        let said = remarks.iter().map(|said| said.as_str().unwrap());
        assert_eq!(said.collect::<Vec<_>>(), Vec::from_iter(says), "{more}");
    }
}

#[test]
fn plan_says_what_no_tree_holds() {
    let plan = |factor: f64| {
        let steps = "{ rotate_z = 30.0 }, { scale = [FACTOR, 1, 1] }, { rotate_z = 40.0 }";
        let steps = steps.replace("FACTOR", &factor.to_string());
        let report = plan(&format!(
            "format = 1\n[shape]\npart.sphere = {{ center = [0, 0, 0], radius = 1 }}\n\
             [[instance]]\nshape = 'part'\ntransform = [{steps}]\n"
        ));
        report["remarks"].clone()
    };
    let said = plan(1e5);
    let said = said[0].as_str().unwrap();
    assert!(said.starts_with("no tree holds one instance,"), "{said}");
    assert_eq!(plan(1e3).as_array().unwrap().len(), 0);
}
