//! What the oracle knows of each kind of primitive: its box; the polynomials or meetings that
//! define it; and its normals, gradients of these in f64.

mod prism;

use super::bounds::{Bounds, near_outline};
use super::meet::Primitive;
use super::number::Number;
use super::ray::{Ray, dot};
use super::root::{Poly, Root};
use super::slack::Measured;
use super::solids::{self, Meeting, changes, ends, first_face};
use super::{facet, implicit, level_set};
use crate::geom::{Clip, Cone};
use crate::scene::{Scene, Shape};

/// In object space; `None` for what has no bounds, and for CSG solids.
pub fn of_shape(scene: &Scene, shape: Shape) -> Option<Bounds> {
    let ball = |c: [f64; 3], r: f64| Bounds { min: c, max: c }.grown(r);
    let bounds = match shape {
        // An ellipsoid among quadrics has bounds, and is met without them.
        Shape::HalfSpace(_) | Shape::Quadric(_) | Shape::Csg(_) => {
            return None;
        }
        // What it is clipped to; where else it ends is not asked.
        Shape::Implicit(id) => match scene.implicits.row(id).clip? {
            Clip::Sphere(s) => ball(s.center.to_array(), s.radius),
            Clip::Cuboid(b) => Bounds::around([b.min.to_array(), b.max.to_array()]),
        },
        Shape::LevelSet(id) => {
            let b = scene.level_sets.row(id).bounds?;
            Bounds::around([b.min.to_array(), b.max.to_array()])
        }
        Shape::Sphere(id) => {
            let s = scene.spheres.row(id);
            ball(s.center.to_array(), s.radius)
        }
        Shape::Ellipsoid(id) => {
            let e = scene.ellipsoids.row(id);
            ball(e.center.to_array(), e.radii.max_element())
        }
        Shape::Cylinder(id) => {
            let c = scene.cylinders.row(id);
            ball(c.base.to_array(), c.radius).union(&ball(c.top.to_array(), c.radius))
        }
        Shape::Cone(id) => {
            let c = scene.cones.row(id);
            ball(c.base.to_array(), c.base_radius).union(&ball(c.top.to_array(), c.top_radius))
        }
        Shape::Cuboid(id) => {
            let b = scene.cuboids.row(id);
            Bounds::around([b.min.to_array(), b.max.to_array()])
        }
        Shape::Polyhedron(id) => {
            Bounds::around(scene.polyhedra.points(id).iter().map(|p| p.to_array()))
        }
        Shape::Polygon(id) => {
            let points: Vec<[f64; 3]> = scene
                .polygons
                .points(id)
                .iter()
                .map(|p| p.to_array())
                .collect();
            near_outline(&points)
        }
        Shape::Prism(id) => prism::bounds(&scene.prisms.row(id)),
        Shape::Mesh(id) => {
            let mesh = scene.meshes.row(id);
            let about = Bounds::around(mesh.positions.iter().map(|p| p.map(f64::from)));
            let center = mesh.center.to_array();
            let moved = |p: [f64; 3]| std::array::from_fn(|k| p[k] + center[k]);
            Bounds::around([moved(about.min), moved(about.max)])
        }
    };
    Some(bounds.widened())
}

impl Primitive<'_> {
    /// What is not above zero inside a closed solid. Of what is none: nothing.
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
            _ => Vec::new(),
        }
    }

    /// All of them on the whole line, in no order. The ray is the primitive's
    /// own (a mesh's about its centre), and finite.
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
            Shape::Prism(id) => prism::ends(ray, &scene.prisms.row(id)),
            Shape::Csg(_) => match self.csg {
                Some(csg) => csg.boundaries(scene, ray),
                None => Ok(Vec::new()),
            },
            Shape::Cone(id) if scene.cones.row(id).open => first_face(&self.faces(ray)),
            Shape::Cylinder(id) if scene.cylinders.row(id).open => first_face(&self.faces(ray)),
            // The only one that need not be convex.
            Shape::Quadric(_) => changes(&self.faces(ray)[0]),
            _ => ends(&self.faces(ray)),
        }
    }

    /// As an operand: of what a line may come into many times.
    pub fn span_of_many<N: Number>(&self, ray: &Ray) -> Option<Result<Inside<N>, N::Undecided>> {
        let scene = self.scene;
        Some(match self.shape {
            Shape::Implicit(id) => implicit::span(ray, &scene.implicits.row(id)),
            Shape::LevelSet(id) => Ok(level_set::span(ray, &scene.level_sets.row(id))),
            Shape::Prism(id) => prism::ends(ray, &scene.prisms.row(id)).map(|ends| (false, ends)),
            _ => return None,
        })
    }
}

/// An operand's part of a line: whether the line is in it from the start, and where
/// that changes, in order.
pub type Inside<N> = (bool, Vec<Meeting<N>>);

/// Of several faces that are met at one t, the one of the lowest rank counts: of boxes
/// by axis, of cylinders and cones a cap before the side, of polyhedra by their order.
pub fn rank(shape: Shape, face: usize) -> usize {
    match shape {
        Shape::Cuboid(_) => face % 3,
        Shape::Cylinder(_) | Shape::Cone(_) => usize::from(face == 0),
        _ => face,
    }
}

/// Object space, outward, any length; of triangles and polygons by their
/// winding. Zero where the surface has none (a cone's apex, a node), and of
/// CSG solids.
pub fn normal(of: &Primitive, ray: &Ray, t: f64, face: usize) -> [f64; 3] {
    let scene = of.scene;
    let from =
        |p: [f64; 3]| -> [f64; 3] { std::array::from_fn(|k| (ray.org[k] - p[k]) + t * ray.dir[k]) };
    match of.shape {
        Shape::HalfSpace(id) => scene.half_spaces.row(id).normal.to_array(),
        Shape::Polyhedron(id) => scene.polyhedra.planes(id)[face].normal.to_array(),
        Shape::Cuboid(_) => std::array::from_fn(|k| {
            if face % 3 != k {
                0.0
            } else if face < 3 {
                -1.0
            } else {
                1.0
            }
        }),
        Shape::Sphere(id) => from(scene.spheres.row(id).center.to_array()),
        Shape::Ellipsoid(id) => {
            let row = scene.ellipsoids.row(id);
            let (w, r) = (from(row.center.to_array()), row.radii.to_array());
            std::array::from_fn(|k| w[k] / r[k] / r[k])
        }
        Shape::Quadric(id) => {
            let [a, b, c, d, e, f, g, h, i, _] = scene.quadrics.row(id).coefficients;
            let [x, y, z] = from([0.0; 3]);
            [
                2.0 * a * x + d * y + e * z + g,
                2.0 * b * y + d * x + f * z + h,
                2.0 * c * z + e * x + f * y + i,
            ]
        }
        Shape::Cone(id) => of_cone(&scene.cones.row(id), from, face),
        Shape::Cylinder(id) => {
            let row = scene.cylinders.row(id);
            let cone = Cone {
                base: row.base,
                top: row.top,
                base_radius: row.radius,
                top_radius: row.radius,
                open: row.open,
            };
            of_cone(&cone, from, face)
        }
        Shape::Polygon(id) => scene.polygons.row(id).normal.to_array(),
        Shape::Implicit(id) => implicit::gradient(scene.implicits.row(id).tape, from([0.0; 3])),
        Shape::Prism(id) => prism::normal(&scene.prisms.row(id), face),
        Shape::LevelSet(id) => level_set::normal(&scene.level_sets.row(id), ray, t),
        Shape::Csg(_) => [0.0; 3],
        Shape::Mesh(id) => {
            let corners = scene.meshes.row(id).corners(of.triangle as usize);
            let [a, b, c] = corners.map(|p| p.map(f64::from));
            let (u, v) = (less(b, a), less(c, a));
            [
                u[1] * v[2] - u[2] * v[1],
                u[2] * v[0] - u[0] * v[2],
                u[0] * v[1] - u[1] * v[0],
            ]
        }
    }
}

fn of_cone(cone: &Cone, from: impl Fn([f64; 3]) -> [f64; 3], face: usize) -> [f64; 3] {
    let base = cone.base.to_array();
    let axis = less(cone.top.to_array(), base);
    if face > 0 {
        return axis.map(|x| if face == 1 { -x } else { x });
    }
    // Away from the axis, tilted by how much the side widens; at the axis' own scale. Beside
    // the apex that is a direction still, where the gradient of the side's square is noise.
    let size = axis.iter().fold(0.0, |m, x| f64::max(m, x.abs()));
    let (a, w) = (axis.map(|x| x / size), from(base).map(|x| x / size));
    let s = dot(w, a) / dot(a, a);
    let radial: [f64; 3] = std::array::from_fn(|k| w[k] - s * a[k]);
    let widening = (cone.top_radius - cone.base_radius) / size / dot(a, a);
    let distance = dot(radial, radial).sqrt();
    if distance == 0.0 {
        return a.map(|x| x * if widening > 0.0 { -1.0 } else { 1.0 });
    }
    std::array::from_fn(|k| radial[k] / distance - widening * a[k])
}

fn less(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| a[k] - b[k])
}
