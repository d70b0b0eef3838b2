//! Patterns that are none.

use super::*;

#[test]
fn patterns() {
    let two = "colors = [[1, 0, 0], [0, 1, 0]]";
    let cases: Vec<(String, &str)> = vec![
        ("base_color = {}".into(), ":2:29: the pattern is empty"),
        (
            format!("base_color = {{ checkers = {{ {two} }} }}"),
            "unknown key 'checkers'; did you mean 'checker'?",
        ),
        (
            format!("base_color = {{ checker = {{ {two} }}, noise = {{ {two} }} }}"),
            "the pattern has checker and noise at once",
        ),
        (
            "base_color = { checker = { colors = [[1, 0, 0]] } }".into(),
            ":2:41: the checker needs colors, two or more",
        ),
        (
            "base_color = { brick = { colors = [[1, 0, 0], [0, 1, 0], [0, 0, 1]] } }".into(),
            "the brick is of two, and 3 are given",
        ),
        (
            "base_color = { noise = { values = [0, 1] } }".into(),
            "the noise has values; here it takes colors alone",
        ),
        (
            format!("roughness = {{ noise = {{ {two} }} }}"),
            "the noise has colors; here it takes values alone",
        ),
        (
            "roughness = { noise = { values = [0, 1.5] } }".into(),
            "the noise has 1.5 in its values, which go from 0 to 1",
        ),
        (
            "base_color = { checker = { colors = [[1, 0, 0], [0, -1, 0]] } }".into(),
            "the checker has -1 in its colors",
        ),
        (
            format!("base_color = {{ checker = {{ {two}, size = [1, 0, 1] }} }}"),
            "its checker has a size that is not greater than 0",
        ),
        (
            format!("base_color = {{ gradient = {{ {two} }} }}"),
            "the key 'to' is missing",
        ),
        (
            format!("base_color = {{ gradient = {{ {two}, to = [0, 0, 0] }} }}"),
            "its gradient goes nowhere",
        ),
        (
            format!("base_color = {{ noise = {{ {two}, octaves = 99 }} }}"),
            "its noise has 99 octaves; from 1 to 24",
        ),
        (
            format!("base_color = {{ brick = {{ {two}, joint = 0.4 }} }}"),
            "its brick has joints of 0.4, which leave nothing of bricks of 0.4",
        ),
        (
            "base_color = 1".into(),
            "expected a list of 3 numbers, a pattern",
        ),
        (
            "base_color = [1, 1]".into(),
            "expected a list of 3 numbers, a pattern",
        ),
        ("roughness = [1]".into(), "expected a number or a pattern"),
    ];
    for (case, expected) in cases {
        let text = toml(&format!("material.m = {{ {case} }}"));
        check("scene.toml", text.as_bytes(), &[expected]);
    }
}
