//! Speed against accuracy: what each way to render a scene takes, and what it is off by.

use serde::{Deserialize, Serialize};

/// A way to render a scene, with what it costs.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Point {
    /// Which choice it varies; empty in a point that was read.
    #[serde(skip_deserializing)]
    pub choice: &'static str,
    /// What the command line says for it; empty for the scene's own way.
    pub options: String,
    /// Median seconds of the picture, without the build of the trees.
    pub seconds: f64,
    /// The largest less the least of these seconds.
    pub spread: f64,
    pub build_seconds: f64,
    /// Pixels whose camera ray meets something else than exact arithmetic says; absent where nobody
    /// has asked the reference.
    pub wrong_pixels: Option<u64>,
    /// Of the colour, against the converged picture.
    pub rmse: f64,
    pub relmse: f64,
    pub flip: f64,
    /// Whether no other point is as fast and as near to the converged picture (RMSE).
    pub pareto: bool,
}

/// Marks the points that no other point beats: that are faster than all which are at least as near.
/// Of points alike, the first is marked.
pub fn mark_front(points: &mut [Point]) {
    let mut order: Vec<usize> = (0..points.len()).collect();
    let key = |i: &usize| (points[*i].seconds, points[*i].rmse);
    order.sort_by(|a, b| {
        let ((s, e), (t, f)) = (key(a), key(b));
        s.total_cmp(&t).then(e.total_cmp(&f)).then(a.cmp(b))
    });
    let mut nearest = f64::INFINITY;
    for i in order {
        points[i].pareto = points[i].rmse < nearest;
        nearest = nearest.min(points[i].rmse);
    }
}

/// What a point must keep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    WrongPixels(u64),
    Rmse(f64),
    Flip(f64),
    Seconds(f64),
}

impl Bound {
    fn is_kept(&self, point: &Point) -> bool {
        match self {
            Bound::WrongPixels(most) => point.wrong_pixels.is_some_and(|wrong| wrong <= *most),
            Bound::Rmse(most) => point.rmse <= *most,
            Bound::Flip(most) => point.flip <= *most,
            Bound::Seconds(most) => point.seconds <= *most,
        }
    }
}

/// Returns the fastest point that keeps all bounds; where time is bounded, the one nearest to the
/// converged picture.
pub fn within<'p>(points: &'p [Point], bounds: &[Bound]) -> Option<&'p Point> {
    let timed = bounds
        .iter()
        .any(|bound| matches!(bound, Bound::Seconds(_)));
    let price = |point: &Point| match timed {
        true => point.rmse,
        false => point.seconds,
    };
    let kept = points
        .iter()
        .filter(|point| bounds.iter().all(|bound| bound.is_kept(point)));
    kept.min_by(|a, b| price(a).total_cmp(&price(b)))
}

/// Returns the median of some numbers, and how far they are spread.
pub fn median(mut all: Vec<f64>) -> (f64, f64) {
    all.sort_by(f64::total_cmp);
    match (all.first(), all.last()) {
        (Some(least), Some(most)) => (all[all.len() / 2], most - least),
        _ => (f64::NAN, f64::NAN),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(seconds: f64, rmse: f64) -> Point {
        Point {
            choice: "samples",
            options: format!("{seconds}"),
            seconds,
            spread: 0.0,
            build_seconds: 0.0,
            wrong_pixels: None,
            rmse,
            relmse: rmse * rmse,
            flip: rmse,
            pareto: false,
        }
    }

    #[test]
    fn the_front_is_what_nothing_beats() {
        let of = [
            (1.0, 0.5),
            (2.0, 0.5),
            (2.0, 0.1),
            (3.0, 0.3),
            (4.0, 0.0),
            (4.0, 0.0),
        ];
        let mut points: Vec<Point> = of.map(|(s, e)| point(s, e)).into();
        mark_front(&mut points);
        let front: Vec<bool> = points.iter().map(|p| p.pareto).collect();
        assert_eq!(front, [true, false, true, false, true, false]);
    }

    #[test]
    fn bounds_are_kept_by_the_fastest_or_the_nearest() {
        let points = [
            point(1.0, 0.5),
            point(2.0, 0.1),
            point(3.0, 0.05),
            point(9.0, 0.0),
        ];
        let found = |bounds: &[Bound]| within(&points, bounds).map(|point| point.seconds);
        assert_eq!(found(&[Bound::Rmse(0.2)]), Some(2.0));
        assert_eq!(found(&[Bound::Seconds(5.0)]), Some(3.0));
        assert_eq!(found(&[Bound::Seconds(5.0), Bound::Flip(0.01)]), None);
        assert_eq!(found(&[Bound::WrongPixels(0)]), None);
        assert_eq!(found(&[]), Some(1.0));
    }

    #[test]
    fn medians() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), (2.0, 2.0));
        assert!(median(Vec::new()).0.is_nan());
    }
}
