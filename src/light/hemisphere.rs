//! Derives from what rays above a point have met how irradiance changes around it.
//!
//! The things met are triangles between neighbouring hits, each as bright as the farthest of its
//! corners: so the edge of a near thing moves before a far one as the point does, and what it
//! hides comes into sight (Schwarzhaupt, Jensen and Jarosz, "Practical Hessian-Based Error Control
//! for Irradiance Caching", 2012, section 5). The irradiance of a triangle is Lambert's sum over
//! its edges, ½ Σ Θ Γ·n; so that of all is a sum over edges between triangles, each by the
//! difference of their light, and so are its derivatives.
//!
//! Directions are of a frame whose z axis is the normal.

use glam::{DMat2, DVec2, DVec3};

/// What a ray above a point has met.
#[derive(Clone, Copy, Debug)]
pub struct Sight {
    /// Unit, z above 0.
    pub toward: DVec3,
    /// Infinite where nothing is met.
    pub distance: f64,
    pub light: [f64; 3],
}

impl Sight {
    /// A direction that no ray has gone to.
    pub const DARK: Sight = Sight {
        toward: DVec3::Z,
        distance: f64::INFINITY,
        light: [0.0; 3],
    };
}

/// How irradiance over π changes about a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    /// By channel, along the surface, per unit of length.
    pub gradient: [DVec2; 3],
    /// By channel, as the normal turns towards x and y, per radian.
    pub turn: [DVec2; 3],
    /// Second derivatives along the surface of the mean of the channels.
    pub hessian: DMat2,
}

/// Sights count for turns as if they were this high at least: those near the horizon, where few
/// rays go, would count without bound.
const LEAST_HEIGHT: f64 = 0.15;

/// Things that are not met stand so many times as far as the farthest that is.
const FAR: f64 = 1e4;

/// Derives the change from sights, one in each cell of a grid over the unit square that
/// [`cosine_hemisphere`](super::sampling::cosine_hemisphere) maps to directions, row by row.
pub fn change(sights: &[Sight], columns: usize) -> Change {
    let grid = Grid::new(sights, columns);
    let mut change = Change {
        gradient: [DVec2::ZERO; 3],
        turn: [DVec2::ZERO; 3],
        hessian: DMat2::ZERO,
    };
    grid.edges(|[a, b], left, right| {
        let by: [f64; 3] = std::array::from_fn(|k| left[k] - right[k]);
        if by == [0.0; 3] {
            return;
        }
        let Some((slope, bend)) = edge(a, b) else {
            return;
        };
        for k in 0..3 {
            change.gradient[k] += by[k] * slope;
        }
        change.hessian += (by[0] + by[1] + by[2]) / 3.0 * bend;
    });
    let share = 1.0 / sights.len() as f64;
    for sight in sights {
        let aside = sight.toward.truncate() / sight.toward.z.max(LEAST_HEIGHT);
        for k in 0..3 {
            change.turn[k] += share * sight.light[k] * aside;
        }
    }
    change.gradient = change.gradient.map(|g| g * std::f64::consts::FRAC_1_PI);
    change.hessian *= std::f64::consts::FRAC_1_PI;
    change
}

/// Hits of a grid of rays, with a ring of points on the horizon around them.
struct Grid<'s> {
    sights: &'s [Sight],
    columns: usize,
    rows: usize,
    far: f64,
}

type Light = [f64; 3];

impl Grid<'_> {
    fn new(sights: &[Sight], columns: usize) -> Grid<'_> {
        let met = sights.iter().map(|s| s.distance).filter(|d| d.is_finite());
        Grid {
            sights,
            columns,
            rows: sights.len() / columns,
            far: FAR * met.fold(1e-100, f64::max),
        }
    }

    /// Returns the sight of a point of the grid; those of the ring are their neighbours'.
    fn sight(&self, x: usize, y: usize) -> &Sight {
        let x = x.clamp(1, self.columns) - 1;
        let y = y.clamp(1, self.rows) - 1;
        &self.sights[y * self.columns + x]
    }

    fn distance(&self, x: usize, y: usize) -> f64 {
        self.sight(x, y).distance.min(self.far)
    }

    fn point(&self, x: usize, y: usize) -> DVec3 {
        let toward = self.sight(x, y).toward;
        let is_ring = x == 0 || y == 0 || x > self.columns || y > self.rows;
        let toward = match is_ring {
            true => toward.with_z(0.0).normalize_or(DVec3::X),
            false => toward,
        };
        toward * self.distance(x, y)
    }

    /// Returns the light of the farthest of three points.
    fn farthest(&self, corners: [(usize, usize); 3]) -> Light {
        let mut most = corners[0];
        for corner in &corners[1..] {
            if self.distance(corner.0, corner.1) > self.distance(most.0, most.1) {
                most = *corner;
            }
        }
        self.sight(most.0, most.1).light
    }

    /// Returns the light of the two triangles of the quadrilateral whose first corner is a point:
    /// the one below its diagonal, from (1, 0) to (0, 1), and the one above.
    fn pair(&self, x: usize, y: usize) -> [Light; 2] {
        let (right, up) = ((x + 1, y), (x, y + 1));
        [
            self.farthest([(x, y), right, up]),
            self.farthest([right, (x + 1, y + 1), up]),
        ]
    }

    /// Visits all edges, with the light on their left and right, from above the point.
    fn edges(&self, mut visit: impl FnMut([DVec3; 2], Light, Light)) {
        const NONE: Light = [0.0; 3];
        let (wide, high) = (self.columns + 1, self.rows + 1);
        let mut below: Vec<[Light; 2]> = vec![[NONE; 2]; wide];
        for y in 0..=high {
            let mut before = [NONE; 2];
            for x in 0..=wide {
                let is_inner = x < wide && y < high;
                let pair = match is_inner {
                    true => self.pair(x, y),
                    false => [NONE; 2],
                };
                let here = self.point(x, y);
                if x < wide {
                    visit([here, self.point(x + 1, y)], pair[0], below[x][1]);
                    below[x] = pair;
                }
                if y < high {
                    visit([here, self.point(x, y + 1)], before[1], pair[0]);
                    before = pair;
                }
                if is_inner {
                    let diagonal = [self.point(x + 1, y), self.point(x, y + 1)];
                    visit(diagonal, pair[0], pair[1]);
                }
            }
        }
    }
}

/// Returns the first and second derivatives of an edge's ½ Θ Γ·n along the surface; `None` if it
/// has no width.
///
/// With v running from a to b and c = a×b, the edge's part is ½ c·n ∫dt/|v|² (the integral is
/// Θ/|c|). Moved by δ, a and b become a − δ and b − δ. In the angle φ that v has turned by,
/// dt = |v|² dφ/|c|, and the derivatives' integrals are of smooth functions of unit vectors, taken
/// by Gauss' rule of two points, whose error is of Θ⁵.
fn edge(a: DVec3, b: DVec3) -> Option<(DVec2, DMat2)> {
    let c = a.cross(b);
    let area = c.length();
    let (ra, rb) = (a.length(), b.length());
    // Below this the directions differ by roundings alone.
    if !(area > 1e-12 * ra * rb) {
        return None;
    }
    let angle = libm::atan2(area, a.dot(b));
    let d = b - a;
    // The derivative of c·n by a.
    let g = DVec2::new(d.y, -d.x);
    let scale = 1.0 / area;
    let mut first = DVec2::ZERO;
    let mut second = DMat2::ZERO;
    let sine = libm::sin(angle);
    // Half of 1 − 1/√3.
    const NODE: f64 = 0.211_324_865_405_187_1;
    let near = libm::sin(NODE * angle) / sine;
    let far = libm::sin((1.0 - NODE) * angle) / sine;
    for (of_a, of_b) in [(far, near), (near, far)] {
        let toward = (a.truncate() * (of_a / ra)) + (b.truncate() * (of_b / rb));
        let inverse = of_a / ra + of_b / rb;
        let half = 0.5 * angle * scale;
        first -= 2.0 * half * inverse * toward;
        let outer = DMat2::from_cols(toward * toward.x, toward * toward.y);
        second += half * inverse * inverse * (8.0 * outer - 2.0 * DMat2::IDENTITY);
    }
    let slope = 0.5 * (g * angle * scale + c.z * first);
    let mixed = DMat2::from_cols(g * first.x, g * first.y);
    let bend = 0.5 * (mixed + mixed.transpose() + c.z * second);
    Some((-slope, bend))
}

#[cfg(test)]
mod tests;
