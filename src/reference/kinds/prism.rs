//! Prisms: the part of an outline, seen along z, that lies between two planes.
//!
//! Faces are numbered: the base, the top, then an edge after the other.

use crate::bounds::Bounds;
use crate::geom::PrismRow;
use crate::number::Number;
use crate::ray::Ray;
use crate::root::Root;
use crate::solids::Meeting;
use std::cmp::Ordering;

pub fn bounds(row: &PrismRow) -> Bounds {
    let corners = row.rings().flatten();
    Bounds::around(corners.flat_map(|p| [0.0, row.height()].map(|z| [p.x, p.y, z])))
}

/// All edges, from corner to corner, inside to the left.
fn edges(row: &PrismRow) -> Vec<[[f64; 2]; 2]> {
    let of = |ring: &[glam::DVec2]| -> Vec<[[f64; 2]; 2]> {
        let at = |i: usize| ring[i % ring.len()].to_array();
        (0..ring.len()).map(|i| [at(i), at(i + 1)]).collect()
    };
    row.rings().flat_map(of).collect()
}

/// Outward: an edge turned to the right.
pub fn normal(row: &PrismRow, face: usize) -> [f64; 3] {
    match face {
        0 => [0.0, 0.0, -1.0],
        1 => [0.0, 0.0, 1.0],
        side => {
            let [a, b] = edges(row)[side - 2];
            [b[1] - a[1], a[0] - b[0], 0.0]
        }
    }
}

/// a × b of two vectors of the plane.
fn cross<N: Number>(a: &[N; 2], b: &[N; 2]) -> N {
    a[0].times(&b[1]).minus(&a[1].times(&b[0]))
}

/// Where a line comes in and goes out by turns, in order; without spans of one point. A
/// corner on the line counts as not to the right of it, and a line along z through an edge
/// has that edge not to its right.
pub fn ends<N: Number>(ray: &Ray, row: &PrismRow) -> Result<Vec<Meeting<N>>, N::Undecided> {
    let [org, dir] = [ray.org, ray.dir].map(|v| v.map(N::from_f64));
    let (o, d) = ([&org[0], &org[1]], [dir[0].clone(), dir[1].clone()]);
    let from = |p: [f64; 2]| -> [N; 2] { std::array::from_fn(|k| N::from_f64(p[k]).minus(o[k])) };
    let met = |(t, face): (Root<N>, usize)| Meeting {
        t,
        face,
        surface: 0,
    };
    let caps = match ray.dir[2].total_cmp(&0.0) {
        _ if ray.dir[2] == 0.0 => None,
        up => {
            let cap = |z: f64| Root::fraction(N::from_f64(z).minus(&org[2]), dir[2].clone(), up);
            let (base, top) = ((cap(0.0), 0), (cap(row.height()), 1));
            Some(if up == Ordering::Greater {
                [base, top]
            } else {
                [top, base]
            })
        }
    };
    if caps.is_none() && !(0.0 <= ray.org[2] && ray.org[2] <= row.height()) {
        return Ok(Vec::new());
    }
    if ray.dir[0] == 0.0 && ray.dir[1] == 0.0 {
        let mut odd = false;
        for [a, b] in edges(row) {
            let (low, high) = (a[1] > ray.org[1], b[1] > ray.org[1]);
            if low != high {
                let side = cross(&from(a), &from(b)).sign()?;
                odd ^= side.is_ne() && side.is_gt() == high;
            }
        }
        let caps = caps.filter(|_| odd).into_iter().flatten();
        return Ok(caps.map(met).collect());
    }
    let mut sides: Vec<(Root<N>, usize)> = Vec::new();
    for (i, [a, b]) in edges(row).into_iter().enumerate() {
        let (p, q) = (from(a), from(b));
        let right = [cross(&p, &d).sign()?.is_gt(), cross(&q, &d).sign()?.is_gt()];
        if right[0] == right[1] {
            continue;
        }
        // p + s (q − p) = t d: crossed with q − p.
        let way = [q[0].minus(&p[0]), q[1].minus(&p[1])];
        let speed = cross(&d, &way);
        let sign = speed.sign()?;
        let t = Root::fraction(cross(&p, &way), speed, sign);
        let mut place = sides.len();
        while place > 0 && sides[place - 1].0.order(&t)?.is_gt() {
            place -= 1;
        }
        sides.insert(place, (t, i + 2));
    }
    let mut found = Vec::new();
    for span in sides.chunks_exact(2) {
        let (mut enter, mut exit) = (span[0].clone(), span[1].clone());
        if let Some([first, last]) = &caps {
            if first.0.order(&enter.0)?.is_ge() {
                enter = first.clone();
            }
            if last.0.order(&exit.0)?.is_le() {
                exit = last.clone();
            }
        }
        if enter.0.order(&exit.0)?.is_lt() {
            found.extend([met(enter), met(exit)]);
        }
    }
    Ok(found)
}
