//! One ray and one primitive: all points where they meet, and the first one beyond the
//! origin.

use super::approx::{Approx, Undecided};
use super::combination::Combination;
use super::dyadic::Dyadic;
use super::number::Number;
use super::ray::Ray;
use super::root::{Poly, Root};
use super::slack::Measured;
use super::solids::{self, Meeting, changes, ends, first_face};
use super::{facet, implicit, level_set, rounding};
use crate::geom::Cone;
use crate::scene::{Scene, Shape};

/// A primitive of a scene.
#[derive(Clone, Copy)]
pub struct Primitive<'a> {
    pub scene: &'a Scene,
    pub shape: Shape,
    /// The triangle of a mesh; 0 otherwise.
    pub triangle: u32,
    /// The unfolded CSG solid, if the shape is one.
    pub combination: Option<&'a Combination>,
}

/// Bounds on the t of a first meeting.
#[derive(Clone, Debug)]
pub struct Within {
    pub lo: f64,
    pub hi: f64,
    /// The exact meeting, if f64 left it undecided.
    pub exact: Option<Meeting<Dyadic>>,
}

impl Primitive<'_> {
    /// Returns the polynomials of a convex solid or quadric, all ≤ 0 inside (O2); none for
    /// any other shape.
    pub fn faces<N: Number>(&self, ray: &Ray) -> Vec<Poly<N>> {
        let scene = self.scene;
        match self.shape {
            Shape::HalfSpace(id) => solids::half_spaces(ray, &[scene.half_spaces.row(id)]),
            Shape::Polyhedron(id) => solids::half_spaces(ray, scene.polyhedra.planes(id)),
            Shape::Cuboid(id) => solids::cuboid(ray, &scene.cuboids.row(id)),
            Shape::Sphere(id) => solids::sphere(ray, &scene.spheres.row(id)),
            Shape::Ellipsoid(id) => solids::ellipsoid(ray, &scene.ellipsoids.row(id)),
            Shape::Quadric(id) => solids::quadric(ray, &scene.quadrics.row(id)),
            Shape::Cone(id) => solids::cone(ray, &scene.cones.row(id)),
            Shape::Cylinder(id) => {
                let cylinder = scene.cylinders.row(id);
                let cone = Cone {
                    base: cylinder.base,
                    top: cylinder.top,
                    base_radius: cylinder.radius,
                    top_radius: cylinder.radius,
                    open: cylinder.open,
                };
                solids::cone(ray, &cone)
            }
            Shape::Implicit(_)
            | Shape::LevelSet(_)
            | Shape::Polygon(_)
            | Shape::Mesh(_)
            | Shape::Combination(_) => Vec::new(),
        }
    }

    /// Finds all meetings on the whole line, in no order. The ray is the primitive's own
    /// (about the centre of a mesh), and finite.
    pub fn meetings<N: Measured>(&self, ray: &Ray) -> Result<Vec<Meeting<N>>, N::Undecided> {
        let scene = self.scene;
        let one = |t: Option<Root<N>>| {
            let (face, surface) = (0, 0);
            let met = |t| Meeting { t, face, surface };
            t.into_iter().map(met).collect()
        };
        match self.shape {
            Shape::Polygon(id) => {
                let polygon = scene.polygons.row(id);
                let points: Vec<[f64; 3]> = polygon.points.iter().map(|p| p.to_array()).collect();
                facet::polygon(ray, polygon.normal.to_array(), &points).map(one)
            }
            Shape::Mesh(id) => {
                let corners = scene.meshes.row(id).corners(self.triangle as usize);
                facet::triangle(ray, corners.map(|p| p.map(f64::from))).map(one)
            }
            Shape::Implicit(id) => implicit::meetings(ray, &scene.implicits.row(id)),
            Shape::LevelSet(id) => level_set::meetings(ray, &scene.level_sets.row(id)),
            Shape::Combination(_) => match self.combination {
                Some(combination) => combination.boundaries(scene, ray),
                None => Ok(Vec::new()),
            },
            Shape::Cone(id) if scene.cones.row(id).open => first_face(&self.faces(ray)),
            Shape::Cylinder(id) if scene.cylinders.row(id).open => first_face(&self.faces(ray)),
            // A quadric is the only one of these solids that need not be convex.
            Shape::Quadric(_) => changes(&self.faces(ray)[0]),
            _ => ends(&self.faces(ray)),
        }
    }

    /// Finds the first meeting with 0 < t < t_max; of several faces that meet there, the
    /// first by number.
    fn first<N: Measured>(
        &self,
        ray: &Ray,
        t_max: f64,
    ) -> Result<Option<Meeting<N>>, N::Undecided> {
        let mut first: Option<Meeting<N>> = None;
        for meeting in self.meetings(ray)? {
            let t = &meeting.t;
            if t.order_with(0.0)?.is_le() || t_max.is_finite() && t.order_with(t_max)?.is_ge() {
                continue;
            }
            let nearer = match &first {
                None => true,
                Some(first) => t.order(&first.t)?.is_lt(),
            };
            if nearer {
                first = Some(meeting);
            }
        }
        Ok(first)
    }

    /// Bounds the t of the first meeting with 0 < t < t_max, by f64 if its error bounds
    /// decide, and otherwise by exact arithmetic.
    pub fn first_within(&self, ray: &Ray, t_max: f64) -> Option<Within> {
        if !ray.is_finite() || !(t_max > 0.0) {
            return None;
        }
        let t = match self.first::<Approx>(ray, t_max) {
            Ok(None) => return None,
            Ok(Some(meeting)) => meeting.t.value(),
            Err(Undecided) => Approx::exact(f64::NAN),
        };
        if t.lo().is_finite() && t.hi().is_finite() {
            return Some(Within {
                lo: t.lo(),
                hi: t.hi(),
                exact: None,
            });
        }
        let exact = self.first_exactly(ray, t_max)?;
        let t = rounding::nearest(&exact.t);
        Some(Within {
            lo: t.next_down(),
            hi: t.next_up(),
            exact: Some(exact),
        })
    }

    /// Finds the first meeting with 0 < t < t_max by exact arithmetic.
    pub fn first_exactly(&self, ray: &Ray, t_max: f64) -> Option<Meeting<Dyadic>> {
        if !ray.is_finite() || !(t_max > 0.0) {
            return None;
        }
        let Ok(first) = self.first(ray, t_max);
        first
    }

    /// Finds all meetings on the whole line by exact arithmetic, in no order.
    pub fn meetings_exactly(&self, ray: &Ray) -> Vec<Meeting<Dyadic>> {
        if !ray.is_finite() {
            return Vec::new();
        }
        let Ok(meetings) = self.meetings(ray);
        meetings
    }
}
