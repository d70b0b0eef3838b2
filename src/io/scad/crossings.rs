//! How often edges cross: operators split each edge where it meets others, so a few corners may
//! make many.

use super::polygons::Rings;
use glam::DVec2;

/// The most pairs of edges that meet anywhere but at common ends. Operators take some 500 bytes for
/// each, and outlines that people draw have few.
const MOST_CROSSINGS: usize = 1 << 16;

/// Refuses rings whose edges cross too often. Takes time by how many edges share their range of x.
pub(super) fn few_enough<'a>(rings: impl Iterator<Item = &'a Rings>) -> Result<(), String> {
    let mut edges: Vec<[DVec2; 2]> = Vec::new();
    for ring in rings.flatten() {
        let next = ring.iter().skip(1).chain(ring.first());
        let pairs = ring.iter().zip(next).filter(|(a, b)| a != b);
        edges.extend(pairs.map(|(a, b)| if a.x <= b.x { [*a, *b] } else { [*b, *a] }));
    }
    edges.sort_unstable_by(|e, f| e[0].x.total_cmp(&f[0].x));
    let mut found = 0;
    for (i, edge) in edges.iter().enumerate() {
        let later = &edges[i + 1..];
        for other in later.iter().take_while(|other| other[0].x <= edge[1].x) {
            found += usize::from(meet(edge, other));
        }
        if found > MOST_CROSSINGS {
            return Err(format!(
                "the edges of this outline cross more than {MOST_CROSSINGS} times"
            ));
        }
    }
    Ok(())
}

/// Says whether edges meet anywhere but at a common end.
fn meet(one: &[DVec2; 2], other: &[DVec2; 2]) -> bool {
    let [[a, b], [c, d]] = [*one, *other];
    if a.y.max(b.y) < c.y.min(d.y) || c.y.max(d.y) < a.y.min(b.y) {
        return false;
    }
    if a == c || a == d || b == c || b == d {
        return false;
    }
    let parts = |p: DVec2, q: DVec2, [r, s]: [DVec2; 2]| {
        let side = |t: DVec2| (q - p).perp_dot(t - p);
        side(r).signum() != side(s).signum() || side(r) == 0.0 || side(s) == 0.0
    };
    parts(a, b, [c, d]) && parts(c, d, [a, b])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Stars whose every edge crosses every other one but its two neighbours.
    #[test]
    fn edges_that_cross_too_often_are_refused() {
        let star = |corners: u32| -> Rings {
            let step = f64::from(corners / 2) / f64::from(corners) * std::f64::consts::TAU;
            let corner = |i: u32| DVec2::from_angle(f64::from(i) * step);
            vec![(0..corners).map(corner).collect()]
        };
        // n (n − 3) / 2: 64620 and 66064.
        assert!(few_enough([star(361)].iter()).is_ok());
        assert!(few_enough([star(365)].iter()).is_err());
        let ring = super::super::curves::circle(1.0, 4096);
        assert!(few_enough([vec![ring]].iter()).is_ok());
    }
}
