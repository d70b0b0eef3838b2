//! Curves with both axes logarithmic.

use super::svg::{Anchor, Svg, text_width};

pub struct Chart {
    pub x_label: &'static str,
    pub y_label: &'static str,
    /// Range that the y-axis covers at least, so that charts are comparable.
    pub y_covers: Option<[f64; 2]>,
    pub lines: Vec<Line>,
}

pub struct Line {
    pub label: String,
    /// Index of a colour of the style sheet, modulo their number.
    pub hue: usize,
    pub stroke: Stroke,
    /// Points with both coordinates above 0; others are omitted.
    pub points: Vec<[f64; 2]>,
    /// What each point is, shown where it is pointed at; without one it is the line's label.
    pub names: Vec<String>,
}

/// The stroke that joins a line's points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stroke {
    Solid,
    Dashed,
    /// Points without a line.
    Dots,
    /// Crosses over points of other lines.
    Crosses,
    /// A thick line whose points have rings, and their names beside them. A chart that has one lists
    /// its labels from the top, each with its mark.
    Front,
}

const WIDTH: f64 = 960.0;
const HEIGHT: f64 = 420.0;
const LEFT: f64 = 64.0;
const TOP: f64 = 24.0;
const BOTTOM: f64 = 44.0;
/// Number of colours of the style sheet, of which the last is that of text.
pub const COLOURS: usize = 10;
/// Distance between the labels at the curves' ends.
const LABEL: f64 = 16.0;

pub fn draw(chart: &Chart) -> String {
    let lines: Vec<(&Line, Vec<[f64; 2]>)> = chart
        .lines
        .iter()
        .map(|line| (line, logarithms(&line.points)))
        .filter(|(_, points)| !points.is_empty())
        .collect();
    let right = lines.iter().map(|(line, _)| text_width(&line.label));
    let right = right.fold(60.0, f64::max) + 26.0;
    let has_front = lines.iter().any(|(line, _)| line.stroke == Stroke::Front);
    let points = || lines.iter().flat_map(|(_, points)| points);
    let covers = chart.y_covers.map(|ends| ends.map(f64::log10));
    let range = |k: usize| {
        let covered = covers.iter().flatten().copied().filter(|_| k == 1);
        let all = || points().map(|p| p[k]).chain(covered.clone());
        let least = all().fold(f64::INFINITY, f64::min);
        let most = all().fold(f64::NEG_INFINITY, f64::max);
        if least > most {
            return (0.0, 1.0);
        }
        // A margin, so that no curve lies on the frame, and names have room above.
        let part = if has_front { 0.1 } else { 0.04 };
        let air = ((most - least) * part).max(0.04);
        (least - air, most + air)
    };
    let (x_range, y_range) = (range(0), range(1));
    let [inner_width, inner_height] = [WIDTH - LEFT - right, HEIGHT - TOP - BOTTOM];
    let at = |[x, y]: [f64; 2]| {
        let along = |value: f64, (from, to): (f64, f64)| (value - from) / (to - from);
        [
            LEFT + along(x, x_range) * inner_width,
            TOP + (1.0 - along(y, y_range)) * inner_height,
        ]
    };

    let mut svg = Svg::new(WIDTH, HEIGHT);
    let [bottom, edge] = [TOP + inner_height, LEFT + inner_width];
    for (value, text) in ticks(x_range) {
        let [x, _] = at([value, 0.0]);
        svg.line([x, TOP], [x, bottom], "grid");
        svg.text([x, bottom + 18.0], Anchor::Middle, "tick", &text);
    }
    for (value, text) in ticks(y_range) {
        let [_, y] = at([0.0, value]);
        svg.line([LEFT, y], [edge, y], "grid");
        svg.text([LEFT - 8.0, y + 4.0], Anchor::End, "tick", &text);
    }
    svg.line([LEFT, TOP], [LEFT, bottom], "axis");
    svg.line([LEFT, bottom], [edge, bottom], "axis");
    let below = [LEFT + inner_width * 0.5, HEIGHT - 6.0];
    svg.text(below, Anchor::Middle, "note", chart.x_label);
    svg.text([LEFT, 14.0], Anchor::Start, "note", chart.y_label);

    for (line, points) in &lines {
        let placed: Vec<[f64; 2]> = points.iter().map(|p| at(*p)).collect();
        let colour = line.hue % COLOURS;
        match line.stroke {
            Stroke::Solid => svg.polyline(&placed, &format!("curve s{colour}")),
            Stroke::Dashed => svg.polyline(&placed, &format!("curve s{colour} dashed")),
            Stroke::Dots | Stroke::Crosses => {}
            Stroke::Front => svg.polyline(&placed, "front"),
        }
        if matches!(line.stroke, Stroke::Crosses | Stroke::Front) {
            for place in &placed {
                mark(&mut svg, line.stroke, *place);
            }
            continue;
        }
        let drawn = line.points.iter().map(is_drawn);
        let names = line.names.iter().zip(drawn);
        let mut names = names.filter_map(|(name, is)| is.then_some(name));
        for (place, [x, y]) in placed.iter().zip(points) {
            let (x, y) = (10.0_f64.powf(*x), 10.0_f64.powf(*y));
            let x = if (1.0..1e12).contains(&x) {
                format!("{x:.0}")
            } else {
                format!("{x:.1e}")
            };
            let name = names.next().unwrap_or(&line.label);
            let hint = format!("{name}: {x} {}, {y:.4e}", chart.x_label);
            svg.dot(*place, &format!("d{colour}"), &hint);
        }
    }
    if let Some((front, points)) = lines.iter().find(|(line, _)| line.stroke == Stroke::Front) {
        let mut taken: Vec<[f64; 4]> = Vec::new();
        for (row, (line, _)) in lines.iter().enumerate() {
            let [x, y] = [edge + 14.0, TOP + 4.0 + 18.0 * row as f64];
            match line.stroke {
                Stroke::Front | Stroke::Crosses => mark(&mut svg, line.stroke, [x, y]),
                _ => svg.dot([x, y], &format!("d{}", line.hue % COLOURS), &line.label),
            }
            svg.text([x + 12.0, y + 4.0], Anchor::Start, "", &line.label);
            taken.push([edge, y - 9.0, WIDTH, y + 9.0]);
        }
        let dots = lines.iter().flat_map(|(_, p)| p);
        taken.extend(dots.map(|p| around(at(*p), 5.0)));
        let way: Vec<[f64; 2]> = points.iter().map(|p| at(*p)).collect();
        let names = front.names.iter().zip(&front.points);
        let names: Vec<&String> = names.filter(|(_, p)| is_drawn(p)).map(|(n, _)| n).collect();
        write_names(&mut svg, (&way, &names), taken, [LEFT, TOP, WIDTH, bottom]);
        return svg.finish();
    }
    // Labels at the curves' ends, moved apart from the top down.
    let mut ends: Vec<(f64, usize, &str)> = lines
        .iter()
        .map(|(line, points)| {
            let end = at(points[points.len() - 1])[1];
            (end, line.hue, line.label.as_str())
        })
        .collect();
    ends.sort_by(|a, b| a.0.total_cmp(&b.0));
    let overflow = |ends: &[(f64, usize, &str)]| ends.last().map_or(0.0, |end| end.0 - bottom);
    for i in 1..ends.len() {
        ends[i].0 = ends[i].0.max(ends[i - 1].0 + LABEL);
    }
    let lift = overflow(&ends).max(0.0);
    for (y, hue, label) in ends {
        let place = [edge + 10.0, y - lift + 4.0];
        let class = format!("e{}", hue % COLOURS);
        svg.text(place, Anchor::Start, &class, label);
    }
    svg.finish()
}

/// Draws the mark of a point: a cross, or the ring of a front.
fn mark(svg: &mut Svg, stroke: Stroke, [x, y]: [f64; 2]) {
    if stroke == Stroke::Front {
        return svg.ring([x, y], 7.0, "front");
    }
    for slant in [-4.0, 4.0] {
        svg.line([x - 4.0, y - slant], [x + 4.0, y + slant], "cross");
    }
}

/// Returns the square about a point: left, top, right, bottom.
fn around([x, y]: [f64; 2], half: f64) -> [f64; 4] {
    [x - half, y - half, x + half, y + half]
}

/// Where a name may stand: how far its line lies below the point, and whether it is right of it.
const PLACES: [(f64, bool); 12] = [
    (16.0, false),
    (16.0, true),
    (-10.0, true),
    (4.0, true),
    (-10.0, false),
    (4.0, false),
    (34.0, false),
    (34.0, true),
    (-26.0, true),
    (-26.0, false),
    (52.0, false),
    (52.0, true),
];

/// Writes the name of each point of a front where it covers nothing of what is `taken`, no other name
/// and no part of the front, within a frame; of a point that has no such place, none.
fn write_names(
    svg: &mut Svg,
    (way, names): (&[[f64; 2]], &[&String]),
    mut taken: Vec<[f64; 4]>,
    frame: [f64; 4],
) {
    for ends in way.windows(2) {
        for k in 0..=64 {
            let t = f64::from(k) / 64.0;
            let on = [0, 1].map(|axis| ends[0][axis] + t * (ends[1][axis] - ends[0][axis]));
            taken.push(around(on, 1.0));
        }
    }
    taken.extend(way.iter().map(|place| around(*place, 8.0)));
    for ([x, y], name) in way.iter().zip(names) {
        let width = text_width(name);
        let place = PLACES.iter().find_map(|(below, rightward)| {
            let (from, end, anchor) = match rightward {
                true => (x + 10.0, x + 10.0, Anchor::Start),
                false => (x - 10.0 - width, x - 10.0, Anchor::End),
            };
            let own = [from, y + below - 11.0, from + width, y + below + 3.0];
            let inside = (0..2).all(|k| own[k] > frame[k] && own[k + 2] < frame[k + 2]);
            let meets = |o: &[f64; 4]| (0..2).all(|k| own[k] < o[k + 2] && o[k] < own[k + 2]);
            let free = inside && !taken.iter().any(meets);
            free.then_some((own, [end, y + below], anchor))
        });
        if let Some((own, at, anchor)) = place {
            taken.push(own);
            svg.text(at, anchor, "name", name);
        }
    }
}

fn logarithms(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let drawn = points.iter().filter(|p| is_drawn(p));
    drawn.map(|p| p.map(f64::log10)).collect()
}

/// Says whether a point has a place on logarithmic axes.
fn is_drawn(point: &[f64; 2]) -> bool {
    point.iter().all(|x| x.is_finite() && *x > 0.0)
}

/// Maximum number of ticks on an axis of many decades.
const TICKS: f64 = 12.0;

/// Returns the ticks' base-10 logarithms and labels: powers of ten, a subset of them
/// for a long range, and also their multiples by two and five for a short one.
fn ticks((from, to): (f64, f64)) -> Vec<(f64, String)> {
    let stride = ((to - from) / TICKS).ceil().max(1.0) as i32;
    let steps: &[f64] = if to - from > 2.5 {
        &[1.0]
    } else {
        &[1.0, 2.0, 5.0]
    };
    let mut ticks = Vec::new();
    let powers = from.floor() as i32..=to.ceil() as i32;
    for power in powers.filter(|power| power % stride == 0) {
        for step in steps {
            let value = step.log10() + f64::from(power);
            if value >= from && value <= to {
                ticks.push((value, written(*step, power)));
            }
        }
    }
    ticks
}

fn written(step: f64, power: i32) -> String {
    let value = step * 10.0_f64.powi(power);
    match power {
        -3..=-1 => format!("{value:.*}", -power as usize),
        0..3 => format!("{value:.0}"),
        3..6 => format!("{:.0}k", value * 1e-3),
        6..9 => format!("{:.0}M", value * 1e-6),
        9..12 => format!("{:.0}G", value * 1e-9),
        _ => format!("{step:.0}e{power}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_lie_inside_and_read_well() {
        let texts = |from, to| {
            let ticks = ticks((from, to));
            assert!(ticks.iter().all(|(at, _)| (from..=to).contains(at)));
            ticks.into_iter().map(|(_, text)| text).collect::<Vec<_>>()
        };
        assert_eq!(texts(2.9, 7.1), ["1k", "10k", "100k", "1M", "10M"]);
        assert_eq!(texts(-0.1, 1.05), ["1", "2", "5", "10"]);
        assert_eq!(texts(-2.0, -1.0), ["0.01", "0.02", "0.05", "0.1"]);
        let many = texts(-45.0, 0.0);
        assert_eq!(many.first().map(String::as_str), Some("1e-44"));
        assert_eq!(many.last().map(String::as_str), Some("1"));
        assert_eq!(many.len(), 12);
    }

    #[test]
    fn nothing_to_draw_is_an_empty_frame() {
        let line = Line {
            label: "none".into(),
            hue: 0,
            stroke: Stroke::Solid,
            points: vec![[1.0, 0.0], [f64::NAN, 2.0]],
            names: Vec::new(),
        };
        let drawn = draw(&Chart {
            x_label: "x",
            y_label: "y",
            y_covers: None,
            lines: vec![line],
        });
        assert!(
            !drawn.contains("polyline") && !drawn.contains("NaN"),
            "{drawn}"
        );
    }

    #[test]
    fn points_are_known_by_their_names() {
        let drawn = draw(&Chart {
            x_label: "seconds",
            y_label: "y",
            y_covers: None,
            lines: vec![Line {
                label: "all".into(),
                hue: 0,
                stroke: Stroke::Dots,
                points: vec![[0.0, 1.0], [0.5, 1.0], [0.25, 1.0]],
                names: ["none", "--spp 4", "--spp 2"].map(String::from).into(),
            }],
        });
        assert!(drawn.contains("--spp 4: 5.0e-1 seconds"), "{drawn}");
        assert!(drawn.contains("--spp 2: 2.5e-1 seconds") && !drawn.contains("none"));
    }

    #[test]
    fn a_front_has_its_names_beside_its_points() {
        let line = |stroke, points: Vec<[f64; 2]>, names: Vec<String>| Line {
            label: "all".into(),
            hue: 0,
            stroke,
            points,
            names,
        };
        let front = vec![[0.01, 0.5], [0.1, 0.1], [1.0, 0.01]];
        let names = ["--spp 1", "--spp 4", "--spp 64"].map(String::from);
        let of = |lines| {
            draw(&Chart {
                x_label: "seconds",
                y_label: "y",
                y_covers: None,
                lines,
            })
        };
        let drawn = of(vec![
            line(Stroke::Front, front.clone(), names.clone().into()),
            line(Stroke::Dots, front.clone(), names.clone().into()),
        ]);
        for name in &names {
            assert!(
                drawn.contains(&format!("class=\"name\">{name}</text>")),
                "{name}: {drawn}"
            );
        }
        // Where dots lie close all around, there is no place for a name.
        let crowd = |k: i32| {
            [
                0.1 * 1.06_f64.powi(k / 40 - 20),
                0.1 * 1.06_f64.powi(k % 40 - 20),
            ]
        };
        let crowd = (0..1600).map(crowd).collect();
        let crowded = of(vec![
            line(Stroke::Front, front, names.into()),
            line(Stroke::Crosses, crowd, Vec::new()),
        ]);
        assert!(!crowded.contains("name\">--spp 4<") && crowded.contains("name\">--spp 64<"));
    }
}
