use super::*;
use crate::geom::implicit::Clip;
use crate::geom::tape::Builder;
use crate::geom::{Cuboid, Sphere};
use proptest::prelude::*;

/// A polynomial of x, y, z, in units of 2^`scale`, about a point.
fn tape(scale: i32, at: [f64; 3], make: impl Fn(&mut Builder, [u32; 3]) -> u32) -> Tape {
    let mut b = Builder::default();
    let unit = b.constant(f64::powi(2.0, -scale));
    let coordinates = std::array::from_fn(|k| {
        let (coordinate, at) = (b.coordinate(k as u8), b.constant(at[k]));
        let off = b.difference(coordinate, at);
        b.product(off, unit)
    });
    let last = make(&mut b, coordinates);
    b.finish(last)
}

fn plain(make: impl Fn(&mut Builder, [u32; 3]) -> u32) -> Tape {
    tape(0, [0.0; 3], make)
}

/// Σ c x^i y^j z^k, written out.
fn sum(b: &mut Builder, at: [u32; 3], terms: &[(f64, [u32; 3])]) -> u32 {
    let mut sum = b.constant(0.0);
    for (c, powers) in terms {
        let mut term = b.constant(*c);
        for k in 0..3 {
            let power = b.power(at[k], powers[k]);
            term = b.product(term, power);
        }
        sum = b.sum(sum, term);
    }
    sum
}

fn expanded(terms: &[(f64, [u32; 3])]) -> Tape {
    plain(|b, at| sum(b, at, terms))
}

fn ball(b: &mut Builder, at: [u32; 3]) -> u32 {
    sum(
        b,
        at,
        &[
            (1.0, [2, 0, 0]),
            (1.0, [0, 2, 0]),
            (1.0, [0, 0, 2]),
            (-1.0, [0, 0, 0]),
        ],
    )
}

/// (x² + y² + z² + 15/4)² − 16 (x² + z²): the radii 2 and 1/2.
fn torus(b: &mut Builder, [x, y, z]: [u32; 3]) -> u32 {
    let [xx, yy, zz] = [x, y, z].map(|v| b.power(v, 2));
    let flat = b.sum(xx, zz);
    let ball = b.sum(flat, yy);
    let shift = b.constant(3.75);
    let ball = b.sum(ball, shift);
    let ball = b.power(ball, 2);
    let factor = b.constant(16.0);
    let flat = b.product(factor, flat);
    b.difference(ball, flat)
}

/// (x² + 9/4 y² + z² − 1)³ − x² z³ − 9/80 y² z³ (Taubin, Distance Approximations for
/// Rasterizing Implicit Curves, 1994).
fn heart(b: &mut Builder, at: [u32; 3]) -> u32 {
    let ball = sum(
        b,
        at,
        &[
            (1.0, [2, 0, 0]),
            (2.25, [0, 2, 0]),
            (1.0, [0, 0, 2]),
            (-1.0, [0, 0, 0]),
        ],
    );
    let cube = b.power(ball, 3);
    let rest = sum(b, at, &[(1.0, [2, 0, 3]), (9.0 / 80.0, [0, 2, 3])]);
    b.difference(cube, rest)
}

/// Holds a box whose true one is `min` to `max`, and is no wider than by `slack` of its
/// extents on each side.
fn check(bounds: Option<Aabb>, min: [f64; 3], max: [f64; 3], slack: f64) {
    let bounds = bounds.expect("a bounded surface");
    for k in 0..3 {
        let slack = slack * (max[k] - min[k]);
        assert!(bounds.min[k] <= min[k], "{k}: {bounds:?}");
        assert!(bounds.max[k] >= max[k], "{k}: {bounds:?}");
        assert!(bounds.min[k] >= min[k] - slack, "{k}: {bounds:?}");
        assert!(bounds.max[k] <= max[k] + slack, "{k}: {bounds:?}");
    }
}

#[test]
fn known_surfaces_have_tight_boxes() {
    check(bounds_of(&plain(ball), None), [-1.0; 3], [1.0; 3], 0.005);
    let (min, max) = ([-2.5, -0.5, -2.5], [2.5, 0.5, 2.5]);
    check(bounds_of(&plain(torus), None), min, max, 0.01);
    // Each of the three at most 2.5² · 2 − 11.8 above its least, −2.5².
    let tangle = expanded(&[
        (1.0, [4, 0, 0]),
        (-5.0, [2, 0, 0]),
        (1.0, [0, 4, 0]),
        (-5.0, [0, 2, 0]),
        (1.0, [0, 0, 4]),
        (-5.0, [0, 0, 2]),
        (11.8, [0, 0, 0]),
    ]);
    let most = (2.5 + f64::sqrt(6.25 * 3.0 - 11.8)).sqrt();
    check(bounds_of(&tangle, None), [-most; 3], [most; 3], 0.005);
    // A superquadric, with vanishing leading terms along z.
    let pillow = expanded(&[
        (1.0, [8, 0, 0]),
        (16.0, [0, 4, 0]),
        (0.25, [0, 0, 2]),
        (-1.0, [0, 0, 0]),
    ]);
    let (min, max) = ([-1.0, -0.5, -2.0], [1.0, 0.5, 2.0]);
    check(bounds_of(&pillow, None), min, max, 0.005);
    // A thistle: leading terms vanish along every axis, and z² − 1 decides there.
    let thistle = plain(|b, at| {
        let ball = ball(b, at);
        let mut product = b.constant(1000.0);
        for squares in [[0, 1], [1, 2], [2, 0]] {
            let [p, q] = squares.map(|k| b.power(at[k], 2));
            let both = b.sum(p, q);
            product = b.product(product, both);
        }
        b.sum(ball, product)
    });
    check(bounds_of(&thistle, None), [-1.0; 3], [1.0; 3], 0.005);
}

#[test]
fn singular_surfaces_have_boxes() {
    // By halving: x and z are largest where y = 0, y where x = 0; the least z is −1.
    let (min, max) = ([-1.13902, -0.67813, -1.0], [1.13902, 0.67813, 1.23665]);
    check(bounds_of(&plain(heart), None), min, max, 0.005);
    // x² + z² = y³ (1 − y)³: cusps at 0 and 1, and x, z at most 1/8. Its closure
    // touches infinity.
    let lemon = plain(|b, at| {
        let [_, y, _] = at;
        let one = b.constant(1.0);
        let rest = b.difference(y, one);
        let product = b.product(y, rest);
        let cube = b.power(product, 3);
        let squares = sum(b, at, &[(1.0, [2, 0, 0]), (1.0, [0, 0, 2])]);
        b.sum(squares, cube)
    });
    let (min, max) = ([-0.125, 0.0, -0.125], [0.125, 1.0, 0.125]);
    check(bounds_of(&lemon, None), min, max, 0.03);
    // One point.
    let point = expanded(&[(1.0, [2, 0, 0]), (3.0, [0, 2, 0]), (1.0, [0, 0, 4])]);
    let bounds = bounds_of(&point, None).unwrap();
    assert!(bounds.max_abs() < 1e-20);
    assert!(bounds.min.cmple(DVec3::ZERO).all() && bounds.max.cmpge(DVec3::ZERO).all());
}

#[test]
fn surfaces_without_bounds_have_none() {
    let dingdong: &[_] = &[
        (1.0, [2, 0, 0]),
        (1.0, [0, 2, 0]),
        (1.0, [0, 0, 3]),
        (-1.0, [0, 0, 2]),
    ];
    let saddle: &[_] = &[(1.0, [3, 0, 0]), (-3.0, [1, 2, 0]), (-1.0, [0, 0, 1])];
    let cone: &[_] = &[(1.0, [2, 0, 0]), (1.0, [0, 2, 0]), (-1.0, [0, 0, 2])];
    let umbrella: &[_] = &[(1.0, [2, 0, 0]), (-1.0, [0, 2, 1])];
    // With the axes, which are lines of it.
    let roman: &[_] = &[
        (1.0, [2, 2, 0]),
        (1.0, [2, 0, 2]),
        (1.0, [0, 2, 2]),
        (-2.0, [1, 1, 1]),
    ];
    let cylinder: &[_] = &[(1.0, [2, 0, 0]), (1.0, [0, 2, 0]), (-1.0, [0, 0, 0])];
    let horn: &[_] = &[(1.0, [2, 2, 0]), (1.0, [0, 0, 2]), (-1.0, [0, 0, 0])];
    for terms in [dingdong, saddle, cone, umbrella, roman, cylinder, horn, &[]] {
        assert_eq!(bounds_of(&expanded(terms), None), None, "{terms:?}");
    }
    // Out of the format's range.
    let vast: &[_] = &[(1e300, [2, 0, 0]), (-1e-300, [0, 0, 0])];
    assert_eq!(bounds_of(&expanded(vast), None), None);
}

#[test]
fn a_surface_without_points_has_one() {
    let none = expanded(&[(1.0, [2, 0, 0]), (1.0, [0, 0, 0])]);
    let none = bounds_of(&none, None).map(|b| (b.min, b.max));
    assert_eq!(none, Some((DVec3::ZERO, DVec3::ZERO)));
    let clip = Clip::Cuboid(Cuboid {
        min: DVec3::splat(4.0),
        max: DVec3::splat(6.0),
    });
    let beside = bounds_of(&plain(ball), Some(&clip));
    assert_eq!(beside.map(|b| b.extent()), Some(DVec3::ZERO));
    assert!(beside.unwrap().min == DVec3::splat(5.0));
}

#[test]
fn boxes_scale_by_powers_of_two() {
    for make in [ball, torus, heart] {
        let own = bounds_of(&tape(1, [0.0; 3], make), None).unwrap();
        for scale in [-20, 20, -60, 60] {
            let by = f64::powi(2.0, scale - 1);
            let bounds = bounds_of(&tape(scale, [0.0; 3], make), None).unwrap();
            assert_eq!(bounds.min, own.min * by, "{scale}");
            assert_eq!(bounds.max, own.max * by, "{scale}");
        }
    }
}

#[test]
fn far_surfaces_have_tight_boxes() {
    let at = [-1e6, 2e6 + 0.5, -3e6];
    let about = |extent: [f64; 3], sign: f64| std::array::from_fn(|k| at[k] + sign * extent[k]);
    let far = tape(0, at, torus);
    let extent = [2.5, 0.5, 2.5];
    check(
        bounds_of(&far, None),
        about(extent, -1.0),
        about(extent, 1.0),
        0.01,
    );
    // The unit sphere about (10⁴, 0, 0), written out.
    let far = expanded(&[
        (1.0, [2, 0, 0]),
        (-2e4, [1, 0, 0]),
        (1e8 - 1.0, [0, 0, 0]),
        (1.0, [0, 2, 0]),
        (1.0, [0, 0, 2]),
    ]);
    let (min, max) = ([1e4 - 1.0, -1.0, -1.0], [1e4 + 1.0, 1.0, 1.0]);
    check(bounds_of(&far, None), min, max, 0.01);
}

#[test]
fn clips_bound_and_are_tightened() {
    let sphere = |radius: f64| {
        let center = DVec3::ZERO;
        Clip::Sphere(Sphere { center, radius })
    };
    let cuboid = |min: f64, max: f64| {
        Clip::Cuboid(Cuboid {
            min: DVec3::splat(min),
            max: DVec3::splat(max),
        })
    };
    // A cone in a ball reaches to 45 degrees.
    let cone = expanded(&[(1.0, [2, 0, 0]), (1.0, [0, 2, 0]), (-1.0, [0, 0, 2])]);
    let most = f64::sqrt(2.0);
    let bounds = bounds_of(&cone, Some(&sphere(2.0)));
    check(bounds, [-most; 3], [most; 3], 0.01);
    let bounds = bounds_of(&cone, Some(&cuboid(1.0, 2.0)));
    check(
        bounds,
        [1.0, 1.0, most],
        [3.0_f64.sqrt(), 3.0_f64.sqrt(), 2.0],
        0.02,
    );
    // A small surface in a great clip.
    let bounds = bounds_of(&plain(torus), Some(&cuboid(-1e9, 1e9)));
    check(bounds, [-2.5, -0.5, -2.5], [2.5, 0.5, 2.5], 0.01);
    // A line in it.
    let umbrella = expanded(&[(1.0, [2, 0, 0]), (-1.0, [0, 2, 1])]);
    let bounds = bounds_of(&umbrella, Some(&cuboid(-1.0, 1.0)));
    check(bounds, [-1.0; 3], [1.0; 3], 0.0);
    // The sphere's own rounding is counted.
    let center = DVec3::new(0.1, 0.2, 0.3);
    let ball = Clip::Sphere(Sphere {
        center,
        radius: 1e-30,
    });
    let bounds = bounds_of(&expanded(&[]), Some(&ball)).unwrap();
    assert!(bounds.min.cmplt(center).all() && bounds.max.cmpgt(center).all());
}

#[test]
fn within_a_clip_or_not() {
    let torus = plain(torus);
    let bounds = bounds_of(&torus, None).unwrap();
    let sphere = |radius: f64| {
        let center = DVec3::ZERO;
        Clip::Sphere(Sphere { center, radius })
    };
    // The corners of the bounds are outside of the first, the torus is not.
    for (radius, is) in [(2.6, true), (4.0, true), (2.49, false), (1.0, false)] {
        assert_eq!(is_within(&torus, &bounds, &sphere(radius)), is, "{radius}");
    }
    let cuboid = |by: f64| {
        let extent = DVec3::new(2.5, 0.5, 2.5) * by;
        Clip::Cuboid(Cuboid {
            min: -extent,
            max: extent,
        })
    };
    for (by, is) in [(1.1, true), (0.99, false), (0.5, false)] {
        assert_eq!(is_within(&torus, &bounds, &cuboid(by)), is, "{by}");
    }
}

/// Ellipsoids with half-axes at right angles to each other, whose product less a
/// positive number is the polynomial: blobs around them.
#[derive(Clone, Debug)]
struct Blobs {
    centers: Vec<[f64; 3]>,
    /// Rows of the map to the unit sphere.
    rows: Vec<[[f64; 3]; 3]>,
    level: f64,
}

fn blobs() -> impl Strategy<Value = Blobs> {
    let number = -4.0..4.0;
    let center = [number.clone(), number.clone(), number];
    let skew = -0.5..0.5;
    let ellipsoid = (center, [skew.clone(), skew.clone(), skew], -3.0..3.0);
    let several = prop::collection::vec(ellipsoid, 1..=3);
    (several, 0.0..0.25, -30..30).prop_map(|(several, level, exponent)| {
        let scale = f64::powi(2.0, exponent);
        let centers = several.iter().map(|e| e.0.map(|x| x * scale)).collect();
        let rows = several.iter().map(|(_, [a, b, c], size)| {
            let size = f64::exp2(*size) / scale;
            [
                [size, a * size, b * size],
                [0.0, size, c * size],
                [0.0, 0.0, size * 2.0],
            ]
        });
        Blobs {
            centers,
            rows: rows.collect(),
            level,
        }
    })
}

impl Blobs {
    fn tape(&self) -> Tape {
        plain(|b, at| {
            let mut product = b.constant(1.0);
            for (center, rows) in self.centers.iter().zip(&self.rows) {
                let off: [u32; 3] = std::array::from_fn(|k| {
                    let center = b.constant(center[k]);
                    b.difference(at[k], center)
                });
                let mapped = rows.map(|row| {
                    let powers = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
                    let terms: [_; 3] = std::array::from_fn(|k| (row[k], powers[k]));
                    sum(b, off, &terms)
                });
                let factor = ball(b, mapped);
                product = b.product(product, factor);
            }
            let level = b.constant(self.level);
            b.difference(product, level)
        })
    }

    fn value(&self, p: [f64; 3]) -> f64 {
        let factor = |(center, rows): (&[f64; 3], &[[f64; 3]; 3])| {
            let off: [f64; 3] = std::array::from_fn(|k| p[k] - center[k]);
            let mapped = rows.map(|row| row[0] * off[0] + row[1] * off[1] + row[2] * off[2]);
            mapped.iter().map(|x| x * x).sum::<f64>() - 1.0
        };
        let factors = self.centers.iter().zip(&self.rows).map(factor);
        factors.product::<f64>() - self.level
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn points_of_a_surface_are_in_its_box(
        blobs in blobs(),
        directions in prop::collection::vec([-1.0..1.0_f64, -1.0..1.0, -1.0..1.0], 64),
    ) {
        let bounds = bounds_of(&blobs.tape(), None);
        prop_assert!(bounds.is_some());
        let bounds = bounds.unwrap();
        // Halving between the centre and far out: one of the places where the value
        // changes its sign.
        let far = (bounds.max_abs() + bounds.diagonal()) * 4.0;
        for d in directions {
            let along = |t: f64| std::array::from_fn(|k| blobs.centers[0][k] + t * d[k]);
            let (mut near, mut out) = (0.0, far / d.iter().fold(0.0, |m: f64, x: &f64| m.max(x.abs())));
            let sign = blobs.value(along(near)) < 0.0;
            if !out.is_finite() || (blobs.value(along(out)) < 0.0) == sign {
                continue;
            }
            for _ in 0..200 {
                let middle = 0.5 * (near + out);
                if (blobs.value(along(middle)) < 0.0) == sign {
                    near = middle;
                } else {
                    out = middle;
                }
            }
            let p: [f64; 3] = along(near);
            let slack = bounds.max_abs() * 1e-12;
            for k in 0..3 {
                prop_assert!(bounds.min[k] - slack <= p[k] && p[k] <= bounds.max[k] + slack);
            }
        }
    }

    #[test]
    fn cells_hold_the_values_at_their_points(
        ends in [[-2.0..2.0_f64, 0.0..1.0], [-2.0..2.0, 0.0..1.0], [-2.0..2.0, 0.0..1.0]],
        part in [0.0..1.0_f64, 0.0..1.0, 0.0..1.0],
    ) {
        use values::{Slopes, Values};
        let tape = plain(heart);
        let region = ends.map(|[low, width]| Interval::new(low, low + width));
        let point: [f64; 3] = std::array::from_fn(|k| {
            (region[k].low + part[k] * region[k].width()).min(region[k].high)
        });
        let there = tape.evaluate(&Values(&point.map(Interval::point)));
        let over = tape.evaluate(&Slopes(&region));
        prop_assert_eq!(over.value, tape.evaluate(&Values(&region)));
        prop_assert!(over.value.low <= there.high && there.low <= over.value.high);
        let at = tape.evaluate(&Slopes(&point.map(Interval::point)));
        for k in 0..3 {
            let (over, at) = (over.gradient[k], at.gradient[k]);
            prop_assert!(over.low <= at.high && at.low <= over.high);
        }
    }
}
