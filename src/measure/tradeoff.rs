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
    /// The largest relative error of t of camera rays that meet what the reference says; absent as
    /// `wrong_pixels` is.
    pub t_error: Option<f64>,
    /// The largest error of their shading normals, in degrees.
    pub normal_error: Option<f64>,
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

/// Returns the points of several views as those of one: of each way the longest time and the
/// largest errors. Ways are known by their options; all that the first view has are returned.
pub fn worst_of(views: Vec<Vec<Point>>) -> Vec<Point> {
    let mut views = views.into_iter();
    let mut worst = views.next().unwrap_or_default();
    for point in views.flatten() {
        if let Some(known) = worst.iter_mut().find(|one| one.options == point.options) {
            known.seconds = known.seconds.max(point.seconds);
            known.spread = known.spread.max(point.spread);
            known.build_seconds = known.build_seconds.max(point.build_seconds);
            known.rmse = known.rmse.max(point.rmse);
            known.relmse = known.relmse.max(point.relmse);
            known.flip = known.flip.max(point.flip);
            // What is unknown of one view is unknown of all.
            known.wrong_pixels = both(known.wrong_pixels, point.wrong_pixels, u64::max);
            known.t_error = both(known.t_error, point.t_error, f64::max);
            known.normal_error = both(known.normal_error, point.normal_error, f64::max);
        }
    }
    mark_front(&mut worst);
    worst
}

fn both<T>(a: Option<T>, b: Option<T>, of: impl Fn(T, T) -> T) -> Option<T> {
    Some(of(a?, b?))
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
    /// Returns the bound with errors that are smaller by a factor. Wrong pixels and seconds stay.
    pub fn within(self, factor: f64) -> Bound {
        match self {
            Bound::Rmse(most) => Bound::Rmse(most * factor),
            Bound::Flip(most) => Bound::Flip(most * factor),
            Bound::WrongPixels(_) | Bound::Seconds(_) => self,
        }
    }

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

/// Returns an error as tables show it: two digits with their power of ten, `?` of an unknown one.
pub fn shown(error: Option<f64>) -> String {
    match error {
        None => "?".into(),
        Some(0.0) => "0".into(),
        Some(error) => format!("{error:.1e}"),
    }
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
            t_error: None,
            normal_error: None,
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
    fn of_several_views_the_worst_counts() {
        let of_view = |seconds, rmse, wrong| Point {
            options: "--spp 4".into(),
            wrong_pixels: wrong,
            t_error: Some(rmse),
            ..point(seconds, rmse)
        };
        let worst = worst_of(vec![
            vec![of_view(1.0, 0.5, Some(3)), point(9.0, 0.1)],
            vec![point(7.0, 0.0), of_view(2.0, 0.1, Some(5))],
            vec![of_view(0.5, 0.7, Some(1))],
        ]);
        assert_eq!(worst.len(), 2);
        let [way, other] = &worst[..] else { panic!() };
        assert_eq!((way.seconds, way.rmse), (2.0, 0.7));
        assert_eq!((way.wrong_pixels, way.t_error), (Some(5), Some(0.7)));
        assert_eq!(way.normal_error, None);
        // The other way stands once, and as it was.
        assert_eq!((other.seconds, other.rmse), (9.0, 0.1));
        assert!(way.pareto && other.pareto);
        let unknown = worst_of(vec![
            vec![of_view(1.0, 0.5, Some(3))],
            vec![of_view(1.0, 0.5, None)],
        ]);
        assert_eq!(unknown[0].wrong_pixels, None);
    }

    #[test]
    fn errors_are_short() {
        let texts = [None, Some(0.0), Some(0.0000123)].map(shown);
        assert_eq!(texts, ["?", "0", "1.2e-5"]);
    }

    #[test]
    fn medians() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), (2.0, 2.0));
        assert!(median(Vec::new()).0.is_nan());
    }
}
