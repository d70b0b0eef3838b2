//! Measured pinholes: OpenCV's camera matrix and distortion, and its inverse.

/// A pinhole camera as OpenCV measures it: pixel (0, 0) has its centre at (0, 0), x points to
/// the right and y down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    /// Focal lengths fx and fy in pixels.
    pub focal: [f64; 2],
    /// The pixel on the view axis: cx and cy.
    pub center: [f64; 2],
    /// Width and height in pixels of the picture that the numbers are for; other sizes scale them.
    pub size: [u32; 2],
    /// Radial and tangential distortion: k1, k2, p1, p2, k3.
    pub distortion: [f64; 5],
}

impl Calibration {
    /// Returns where a direction (x, y, 1) is seen, distorted.
    pub fn distorted(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [k1, k2, p1, p2, k3] = self.distortion;
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        [
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        ]
    }

    /// Says whether a direction (x, y, 1) lies before the fold of the distortion: the map without
    /// its tangential terms gets wider all the way from the axis to there, and the Jacobian of the
    /// whole map is positive definite at the point.
    pub fn is_before_fold(&self, at: [f64; 2]) -> bool {
        self.distortion == [0.0; 5] || self.slopes(at, self.widest()).is_some()
    }

    /// Returns the direction (x, y, 1) before the [fold](Self::is_before_fold) that is seen at a
    /// distorted point, by Newton's method from the point itself; `None` where there is no such
    /// direction. The Jacobian is symmetric, so the map is the gradient of a function that is convex
    /// where it is positive definite, and no two points of a disc of such have one image.
    pub fn undistorted(&self, seen: [f64; 2]) -> Option<[f64; 2]> {
        /// Points tried. Ordinary lenses need 4 to 7, beyond a fold all of them are.
        const TRIED: usize = 64;
        /// Of the residual, relative to the point: some roundings.
        const NEAR: f64 = 1e-14;
        /// The same where terms of the map cancel, so that no point comes nearer.
        const NEAREST: f64 = 1e-12;
        if self.distortion == [0.0; 5] {
            return Some(seen);
        }
        let widest = self.widest();
        let size = 1.0 + seen[0].abs() + seen[1].abs();
        // The last point that was nearer than all before, and the step from there.
        let mut from = [0.0; 2];
        let mut step = seen;
        let mut least = f64::INFINITY;
        for _ in 0..TRIED {
            let [x, y] = [from[0] + step[0], from[1] + step[1]];
            if least.is_finite() && [x, y] == from {
                break;
            }
            let at = self.distorted([x, y]);
            let off = [at[0] - seen[0], at[1] - seen[1]];
            let residual = off[0].abs() + off[1].abs();
            match self.slopes([x, y], widest) {
                Some(_) if residual <= NEAR * size => return Some([x, y]),
                Some([xx, xy, yy]) if residual < least => {
                    let determinant = xx * yy - xy * xy;
                    (from, least) = ([x, y], residual);
                    step = [
                        -(yy * off[0] - xy * off[1]) / determinant,
                        -(xx * off[1] - xy * off[0]) / determinant,
                    ];
                }
                // Behind the fold, or no nearer.
                _ => step = step.map(|part| 0.5 * part),
            }
        }
        (least <= NEAREST * size).then_some(from)
    }

    /// Returns the map's Jacobian at a point as [d/dx of x, d/dy of x, d/dy of y]; `None` behind
    /// the fold. `widest` is that of [`widest`](Self::widest).
    fn slopes(&self, [x, y]: [f64; 2], widest: f64) -> Option<[f64; 3]> {
        let [k1, k2, p1, p2, k3] = self.distortion;
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let slope = 2.0 * (k1 + r2 * (2.0 * k2 + 3.0 * r2 * k3));
        let xx = radial + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x;
        let yy = radial + y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x;
        let xy = x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y;
        let grows = r2 < widest && self.growth(r2) > 0.0;
        (grows && xx * yy - xy * xy > 0.0 && xx + yy > 0.0).then_some([xx, xy, yy])
    }

    /// Returns the derivative of r (1 + k1 r² + k2 r⁴ + k3 r⁶), for the square of r.
    fn growth(&self, r2: f64) -> f64 {
        let [k1, k2, _, _, k3] = self.distortion;
        1.0 + r2 * (3.0 * k1 + r2 * (5.0 * k2 + r2 * (7.0 * k3)))
    }

    /// Returns a square of r before which the first zero of [`growth`](Self::growth) is the only
    /// one, if there is one: that of the growth's least value where it is not positive.
    fn widest(&self) -> f64 {
        let [k1, k2, _, _, k3] = self.distortion;
        // Zeros of 3 k1 + 10 k2 s + 21 k3 s², of which growth has a minimum at the one where
        // the derivative of this is the root: by the form that does not cancel. Where there is no
        // minimum the result is NaN, infinite or negative.
        let root = libm::sqrt(100.0 * k2 * k2 - 252.0 * k1 * k3);
        let least = match k2 > 0.0 {
            true => -6.0 * k1 / (10.0 * k2 + root),
            false => (root - 10.0 * k2) / (42.0 * k3),
        };
        match least > 0.0 && self.growth(least) <= 0.0 {
            true => least,
            false => f64::INFINITY,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lens(distortion: [f64; 5]) -> Calibration {
        Calibration {
            focal: [1.0; 2],
            center: [0.0; 2],
            size: [1; 2],
            distortion,
        }
    }

    /// Radii at which these maps first turn back, by fine steps, and where these are seen.
    #[test]
    fn a_direction_is_seen_up_to_the_first_fold_and_nothing_beyond() {
        for distortion in [
            [-0.4, 0.05, 0.0, 0.0, 0.0],
            [-3.0, 0.1, 0.0, 0.0, 0.0],
            [-0.4, 0.0, 0.0, 0.0, 0.0],
            [-0.35, 0.08, 0.0, 0.0, 0.0],
            [-0.3, 0.02, 0.0, 0.0, 0.0],
            [-0.3, 0.1, 0.0, 0.0, -0.02],
            [0.5, -0.5, 0.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 0.0, -0.1],
            [0.3, -0.5, 0.0, 0.0, 0.1],
            [-0.5, 0.0, 0.0, 0.0, 0.05],
        ] {
            let k = lens(distortion);
            let out = |r: f64| k.distorted([r, 0.0])[0];
            let step = 1e-4;
            let fold = (1..100_000)
                .map(|i| f64::from(i) * step)
                .find(|r| out(r + step) <= out(*r));
            let (fold, edge) = match fold {
                Some(fold) => (fold, out(fold)),
                None => (10.0, out(10.0)),
            };
            for i in 0..400 {
                let (share, turn) = (f64::from(i) / 200.0, f64::from(i));
                let seen = [turn.cos(), turn.sin()].map(|c| share * edge * c);
                let found = k.undistorted(seen);
                if share < 0.9999 {
                    let [x, y] = found.unwrap_or_else(|| panic!("{distortion:?} {share}"));
                    assert!(x.hypot(y) <= fold + 2.0 * step, "{distortion:?} {share}");
                    let to = k.distorted([x, y]);
                    assert!(
                        (to[0] - seen[0]).abs() + (to[1] - seen[1]).abs() < 1e-13 * (1.0 + edge)
                    );
                } else if fold < 10.0 && share > 1.0001 {
                    assert_eq!(found, None, "{distortion:?} {share}");
                }
            }
            for i in 1..100 {
                let r = f64::from(i) / 20.0;
                let is = k.is_before_fold([0.6 * r, -0.8 * r]);
                let is_there = (r - fold).abs() < 2.0 * step;
                assert!(is_there || is == (r < fold), "{distortion:?} {r}");
            }
        }
    }
}
