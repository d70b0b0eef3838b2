//! Set algebra along a line, on rational numbers.

use lanecast::internals::geom::{Cuboid, HalfSpace};
use lanecast::internals::scene::{Operand, Operator, SceneBuilder, ShapeId};
use num_rational::BigRational;

pub type Rational = BigRational;

pub fn rational(x: f64) -> Rational {
    Rational::from_float(x).expect("a finite number")
}

/// A solid by its operators. Operands stand in the order of their numbers.
#[derive(Clone, Debug)]
pub enum Tree {
    Operand(usize),
    Of(Operator, Vec<Tree>),
}

impl Tree {
    pub fn of(operator: Operator, of: impl IntoIterator<Item = Tree>) -> Tree {
        Tree::Of(operator, of.into_iter().collect())
    }

    /// A point that is in these operands.
    pub fn says(&self, inside: &[bool]) -> bool {
        let (operator, of) = match self {
            Tree::Operand(number) => return inside[*number],
            Tree::Of(operator, of) => (operator, of),
        };
        let mut of = of.iter().map(|tree| tree.says(inside));
        match operator {
            Operator::Union => of.any(|x| x),
            Operator::Intersection => of.all(|x| x),
            Operator::Difference => of.next() == Some(true) && !of.any(|x| x),
            Operator::Xor => of.filter(|x| *x).count() % 2 == 1,
            Operator::Complement => of.next() == Some(false),
        }
    }

    /// In a scene, with a shape for each operand.
    pub fn shape(&self, scene: &mut SceneBuilder, shapes: &[ShapeId]) -> ShapeId {
        match self {
            Tree::Operand(number) => shapes[*number],
            Tree::Of(operator, of) => {
                let operands: Vec<Operand> = of
                    .iter()
                    .map(|tree| Operand::shape(tree.shape(scene, shapes)))
                    .collect();
                scene.csg("", *operator, &operands)
            }
        }
    }
}

/// What a line has in a convex solid: from where, to where; `None`: without end.
#[derive(Clone, Debug)]
pub struct Part {
    pub from: Option<Rational>,
    pub to: Option<Rational>,
}

impl Part {
    pub fn between(from: f64, to: f64) -> Part {
        let end = |x: f64| x.is_finite().then(|| rational(x));
        let (from, to) = (end(from), end(to));
        Part { from, to }
    }

    fn has(&self, t: &Rational) -> bool {
        self.from.as_ref().is_none_or(|x| x < t) && self.to.as_ref().is_none_or(|x| t < x)
    }
}

/// A boundary of a solid.
#[derive(Clone, Debug)]
pub struct Change {
    pub t: Rational,
    pub enters: bool,
    /// Whose surface it is.
    pub operand: usize,
    pub turned: bool,
}

/// Whether a line is in a solid far before all boundaries, and these. The state
/// changes where it is not the same on both sides; asked in the middle between.
pub fn changes(tree: &Tree, parts: &[Option<Part>]) -> (bool, Vec<Change>) {
    let ends = |part: &Part| [part.from.clone(), part.to.clone()];
    let mut at: Vec<Rational> = parts.iter().flatten().flat_map(ends).flatten().collect();
    at.sort();
    at.dedup();
    let inside = |t: &Rational| -> Vec<bool> {
        parts
            .iter()
            .map(|part| part.as_ref().is_some_and(|part| part.has(t)))
            .collect()
    };
    let one = rational(1.0);
    let before = |i: usize| match i {
        0 => at.first().map_or(rational(0.0), |first| first - &one),
        i if i == at.len() => &at[i - 1] + &one,
        i => (&at[i - 1] + &at[i]) / rational(2.0),
    };
    let states: Vec<Vec<bool>> = (0..=at.len()).map(|i| inside(&before(i))).collect();
    let mut changes = Vec::new();
    for (t, around) in at.iter().zip(states.windows(2)) {
        let [was, is] = [&around[0], &around[1]];
        let (outside, enters) = (tree.says(was), tree.says(is));
        if outside == enters {
            continue;
        }
        let mut flipped = was.clone();
        let operand = (0..parts.len()).find(|operand| {
            flipped[*operand] = is[*operand];
            tree.says(&flipped) == enters
        });
        let operand = operand.expect("some operand makes the change");
        changes.push(Change {
            t: t.clone(),
            enters,
            operand,
            turned: is[operand] != enters,
        });
    }
    (tree.says(&states[0]), changes)
}

/// Of a line in an intersection of closed half-spaces. A point is nothing.
pub fn part_in(org: [f64; 3], dir: [f64; 3], planes: &[HalfSpace]) -> Option<Part> {
    let dot = |a: [f64; 3], b: [f64; 3]| {
        let [x, y, z] = std::array::from_fn(|k| rational(a[k]) * rational(b[k]));
        x + y + z
    };
    let zero = rational(0.0);
    let (mut from, mut to): (Option<Rational>, Option<Rational>) = (None, None);
    for plane in planes {
        let n = plane.normal.to_array();
        let (rise, room) = (dot(n, dir), rational(plane.offset) - dot(n, org));
        if rise == zero {
            if room < zero {
                return None;
            }
            continue;
        }
        let t = room / &rise;
        if rise > zero {
            to = Some(to.map_or(t.clone(), |to| to.min(t)));
        } else {
            from = Some(from.map_or(t.clone(), |from| from.max(t)));
        }
    }
    let empty = from.as_ref().zip(to.as_ref()).is_some_and(|(a, b)| a >= b);
    (!empty).then_some(Part { from, to })
}

pub fn part_in_box(org: [f64; 3], dir: [f64; 3], row: &Cuboid) -> Option<Part> {
    let planes: Vec<HalfSpace> = (0..3)
        .flat_map(|k| {
            let axis = glam::DVec3::AXES[k];
            [(axis, row.max[k]), (-axis, -row.min[k])]
        })
        .map(|(normal, offset)| HalfSpace { normal, offset })
        .collect();
    part_in(org, dir, &planes)
}

/// Whether no f64 is nearer.
pub fn is_nearest(t: f64, exact: &Rational) -> bool {
    let off = |x: f64| {
        let off = rational(x) - exact;
        if off < rational(0.0) { -off } else { off }
    };
    let own = off(t);
    own <= off(t.next_up()) && own <= off(t.next_down())
}
