//! Copies a scene from its tables with a change: another scale, a rotation, another order, or
//! one object more.

use crate::common::Random;
use glam::{DAffine3, DMat3, DVec3};
use lanecast::internals::geom::formula::Formula;
use lanecast::internals::geom::tape::{Builder, Step};
use lanecast::internals::geom::*;
use lanecast::internals::math::Affine;
use lanecast::internals::scene::*;

/// A turn that takes axes to axes: coordinate k of a turned point is
/// `sign[k]` times coordinate `from[k]` of the point. No rounding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn {
    pub from: [usize; 3],
    pub sign: [f64; 3],
}

impl Turn {
    pub const NONE: Turn = Turn {
        from: [0, 1, 2],
        sign: [1.0; 3],
    };

    /// Quarters of a circle about axis `k`, counter-clockwise.
    pub fn quarters(k: usize, count: usize) -> Turn {
        let (a, b) = ((k + 1) % 3, (k + 2) % 3);
        let mut quarter = Turn::NONE;
        (quarter.from[a], quarter.sign[a]) = (b, -1.0);
        quarter.from[b] = a;
        (0..count).fold(Turn::NONE, |turn, _| quarter.after(&turn))
    }

    pub fn after(&self, first: &Turn) -> Turn {
        Turn {
            from: self.from.map(|k| first.from[k]),
            sign: std::array::from_fn(|k| self.sign[k] * first.sign[self.from[k]]),
        }
    }

    pub fn of(&self, v: DVec3) -> DVec3 {
        DVec3::from_array(self.of_each(v.to_array()))
    }

    pub fn of_each<T: Copy + std::ops::Mul<f64, Output = T>>(&self, v: [T; 3]) -> [T; 3] {
        std::array::from_fn(|k| v[self.from[k]] * self.sign[k])
    }

    fn of_size(&self, v: DVec3) -> DVec3 {
        self.of(v).abs()
    }

    pub fn matrix(&self) -> DMat3 {
        DMat3::from_cols(self.of(DVec3::X), self.of(DVec3::Y), self.of(DVec3::Z))
    }
}

/// What becomes of the numbers: points are turned, and times `scale`.
#[derive(Clone, Copy, Debug)]
pub struct Change {
    pub turn: Turn,
    pub scale: f64,
}

impl Change {
    pub const NONE: Change = Change {
        turn: Turn::NONE,
        scale: 1.0,
    };

    pub fn point(&self, p: DVec3) -> DVec3 {
        self.turn.of(p) * self.scale
    }

    /// T M T⁻¹, the linear part by swaps alone.
    fn place(&self, m: &Affine) -> Affine {
        let Turn { from, sign } = self.turn;
        let entry = |c: usize, r: usize| m.linear()[from[c]][from[r]] * (sign[c] * sign[r]);
        Affine::new(
            std::array::from_fn(|c| std::array::from_fn(|r| entry(c, r))),
            self.point(DVec3::from_array(m.translation)).to_array(),
        )
    }

    fn plane(&self, plane: &HalfSpace) -> HalfSpace {
        HalfSpace {
            normal: self.turn.of(plane.normal),
            offset: plane.offset * self.scale,
        }
    }

    pub fn camera(&self, camera: &Camera) -> Camera {
        Camera {
            eye: self.point(camera.eye),
            right: self.turn.of(camera.right),
            up: self.turn.of(camera.up),
            forward: self.turn.of(camera.forward),
            projection: match camera.projection {
                Projection::Orthographic { half_height } => Projection::Orthographic {
                    half_height: half_height * self.scale,
                },
                other => other,
            },
            lens: camera.lens.map(|lens| Lens {
                radius: lens.radius * self.scale,
                focus: lens.focus * self.scale,
                ..lens
            }),
        }
    }

    pub fn light(&self, light: &Light) -> Light {
        match *light {
            Light::Point {
                position,
                intensity,
                falloff,
                radius,
            } => {
                let more = match falloff {
                    Falloff::InverseSquare => (self.scale * self.scale) as f32,
                    Falloff::None => 1.0,
                };
                Light::Point {
                    position: self.point(position),
                    intensity: intensity.map(|i| i * more),
                    falloff,
                    radius: radius * self.scale,
                }
            }
            Light::Spot {
                position,
                direction,
                intensity,
                inner,
                outer,
                radius,
            } => Light::Spot {
                position: self.point(position),
                direction: self.turn.of(direction),
                intensity: intensity.map(|i| i * (self.scale * self.scale) as f32),
                inner,
                outer,
                radius: radius * self.scale,
            },
            Light::Directional {
                direction,
                irradiance,
                angle,
            } => Light::Directional {
                direction: self.turn.of(direction),
                irradiance,
                angle,
            },
            Light::Rectangle {
                center,
                edges,
                radiance,
                two_sided,
            } => {
                let [u, v] = edges.map(|edge| self.turn.of(edge) * self.scale);
                // A mirror turns the side that shines.
                let side = self.turn.of(edges[0].cross(edges[1]));
                let edges = match u.cross(v).dot(side) > 0.0 {
                    true => [u, v],
                    false => [v, u],
                };
                Light::Rectangle {
                    center: self.point(center),
                    edges,
                    radiance,
                    two_sided,
                }
            }
            Light::Disc {
                center,
                normal,
                radius,
                radiance,
                two_sided,
            } => Light::Disc {
                center: self.point(center),
                normal: self.turn.of(normal),
                radius: radius * self.scale,
                radiance,
                two_sided,
            },
        }
    }

    fn mesh(&self, mesh: &Mesh) -> MeshData {
        let position = |p: &[f32; 3]| {
            let p = DVec3::from_array(p.map(f64::from)) + mesh.center;
            self.point(p).to_array()
        };
        let normal = |n: &[f32; 3]| self.turn.of_each(n.map(f64::from)).map(|x| x as f32);
        MeshData {
            positions: mesh.positions.iter().map(position).collect(),
            normals: mesh.normals.iter().copied().flatten().map(normal).collect(),
            triangles: mesh.triangles.to_vec(),
            parts: mesh.parts.to_vec(),
            open: mesh.open,
            // The scenes of these tests have no textures.
            ..MeshData::default()
        }
    }

    /// Of the points where they were. The scale is a power of two, and so its inverse is
    /// exact.
    fn tape(&self, tape: &Tape) -> Tape {
        let mut builder = Builder::default();
        let mut steps: Vec<u32> = Vec::new();
        for step in tape.steps() {
            let of = |i: u32| steps[i as usize];
            let step = match *step {
                Step::Coordinate(axis) => {
                    let is_it = |from: &usize| *from == usize::from(axis);
                    let k = self.turn.from.iter().position(is_it).unwrap();
                    let new = builder.coordinate(k as u8);
                    let factor = builder.constant(self.turn.sign[k] / self.scale);
                    builder.product(factor, new)
                }
                Step::Constant(value) => builder.constant(value),
                Step::Sum(a, b) => builder.sum(of(a), of(b)),
                Step::Difference(a, b) => builder.difference(of(a), of(b)),
                Step::Product(a, b) => builder.product(of(a), of(b)),
                Step::Scaled(a, by) => {
                    let by = builder.constant(by);
                    builder.product(of(a), by)
                }
            };
            steps.push(step);
        }
        builder.finish(*steps.last().unwrap())
    }

    /// The same of a formula.
    fn formula(&self, of: &Formula) -> Formula {
        let mut builder = formula::Builder::default();
        let mut steps: Vec<u32> = Vec::new();
        for step in of.steps() {
            let of = |i: u32| steps[i as usize];
            let step = match *step {
                formula::Step::Coordinate(axis) => {
                    let is_it = |from: &usize| *from == usize::from(axis);
                    let k = self.turn.from.iter().position(is_it).unwrap();
                    let new = builder.coordinate(k as u8);
                    let factor = builder.constant(self.turn.sign[k] / self.scale);
                    builder.binary(formula::Binary::Product, factor, new)
                }
                formula::Step::Constant(value) => builder.constant(value),
                formula::Step::Power(a, exponent) => builder.power(of(a), exponent),
                formula::Step::Unary(function, a) => builder.unary(function, of(a)),
                formula::Step::Binary(operator, a, b) => builder.binary(operator, of(a), of(b)),
            };
            steps.push(step);
        }
        builder.finish(*steps.last().unwrap())
    }

    fn clip(&self, clip: &Clip) -> Clip {
        match clip {
            Clip::Sphere(s) => Clip::Sphere(Sphere {
                center: self.point(s.center),
                radius: s.radius * self.scale,
            }),
            Clip::Cuboid(s) => {
                let (p, q) = (self.point(s.min), self.point(s.max));
                let (min, max) = (p.min(q), p.max(q));
                Clip::Cuboid(Cuboid { min, max })
            }
        }
    }

    /// Shape `row` of a scene, as the next one of `to`.
    fn shape(&self, scene: &Scene, row: Shape, to: &mut SceneBuilder, order: &mut Order) {
        let scale = self.scale;
        match row {
            Shape::HalfSpace(id) => to.half_space("", self.plane(&scene.half_spaces.row(id))),
            Shape::Sphere(id) => {
                let row = scene.spheres.row(id);
                let (center, radius) = (self.point(row.center), row.radius * scale);
                to.sphere("", Sphere { center, radius })
            }
            Shape::Ellipsoid(id) => {
                let row = scene.ellipsoids.row(id);
                let radii = self.turn.of_size(row.radii) * scale;
                let center = self.point(row.center);
                to.ellipsoid("", Ellipsoid { center, radii })
            }
            Shape::Quadric(id) => {
                let row = scene.quadrics.row(id).coefficients;
                let Turn { from, sign } = self.turn;
                // Of x_i x_j, i ≤ j.
                let place = |i: usize, j: usize| if i == j { i } else { 2 + i + j };
                let mut coefficients = [0.0; 10];
                for i in 0..3 {
                    for j in i..3 {
                        let (a, b) = (from[i].min(from[j]), from[i].max(from[j]));
                        coefficients[place(i, j)] = row[place(a, b)] * (sign[i] * sign[j]);
                    }
                    coefficients[6 + i] = row[6 + from[i]] * sign[i] * scale;
                }
                coefficients[9] = row[9] * scale * scale;
                to.quadric("", Quadric { coefficients })
            }
            Shape::Cylinder(id) => {
                let row = scene.cylinders.row(id);
                let row = Cylinder {
                    base: self.point(row.base),
                    top: self.point(row.top),
                    radius: row.radius * scale,
                    open: row.open,
                };
                to.cylinder("", row)
            }
            Shape::Cone(id) => {
                let row = scene.cones.row(id);
                let row = Cone {
                    base: self.point(row.base),
                    top: self.point(row.top),
                    base_radius: row.base_radius * scale,
                    top_radius: row.top_radius * scale,
                    open: row.open,
                };
                to.cone("", row)
            }
            Shape::Cuboid(id) => {
                let row = scene.cuboids.row(id);
                let (p, q) = (self.point(row.min), self.point(row.max));
                let (min, max) = (p.min(q), p.max(q));
                to.cuboid("", Cuboid { min, max })
            }
            Shape::Polyhedron(id) => {
                let planes = scene.polyhedra.planes(id).iter().map(|h| self.plane(h));
                let points = scene.polyhedra.points(id).iter().map(|p| self.point(*p));
                to.polyhedron("", &planes.collect::<Vec<_>>(), &points.collect::<Vec<_>>())
            }
            Shape::Polygon(id) => {
                let points = scene.polygons.points(id).iter().map(|p| self.point(*p));
                let normals = scene.polygons.normals(id).unwrap_or(&[]);
                let normals = normals.iter().map(|n| self.turn.of(*n));
                to.polygon(
                    "",
                    &points.collect::<Vec<_>>(),
                    &normals.collect::<Vec<_>>(),
                )
            }
            Shape::Implicit(id) => {
                let row = scene.implicits.row(id);
                let clip = row.clip.map(|clip| self.clip(&clip));
                to.implicit("", self.tape(row.tape), row.open, clip)
            }
            Shape::LevelSet(id) => {
                let row = scene.level_sets.row(id);
                let clip = row.clip.map(|clip| self.clip(&clip));
                to.level_set("", self.formula(row.formula), row.open, clip)
            }
            Shape::Prism(_) => unreachable!("a prism lies along z, and these scenes have none"),
            Shape::Mesh(id) => {
                let data = self.mesh(&scene.meshes.row(id));
                to.mesh("", &order.mesh(data))
            }
            Shape::Csg(id) => {
                let table = &scene.csg;
                let (shape, new) = to.declare_csg("", table.operator[id.index()]);
                let operand = |operand: &Operand| {
                    let local = &scene.transforms.local[operand.transform.index()];
                    operand.transform(to.transform(self.place(local)))
                };
                let operands: Vec<_> = table.operands(id).iter().map(operand).collect();
                to.set_operands(new, &operands);
                to.set_tolerance(new, table.tolerance[id.index()] * scale);
                if let Some(material) = table.material[id.index()] {
                    to.set_csg_material(new, material);
                }
                shape
            }
        };
    }
}

/// In which order things stand.
#[derive(Default)]
pub struct Order {
    /// None: as they were.
    shuffle: Option<Random>,
    /// By mesh: which triangle each of its triangles was.
    pub triangles: Vec<Vec<u32>>,
    /// Which root each root was.
    pub roots: Vec<usize>,
}

impl Order {
    pub fn shuffled(seed: u64) -> Order {
        Order {
            shuffle: Some(Random(seed)),
            ..Order::default()
        }
    }

    fn of(&mut self, count: usize) -> Vec<usize> {
        let mut order: Vec<usize> = (0..count).collect();
        if let Some(random) = &mut self.shuffle {
            for i in (1..count).rev() {
                order.swap(i, random.below(i as u64 + 1) as usize);
            }
        }
        order
    }

    /// Its triangles, each one's corners, and its vertices in another order. The
    /// parts go: they are runs of triangles.
    fn mesh(&mut self, data: MeshData) -> MeshData {
        let order = self.of(data.triangles.len());
        self.triangles
            .push(order.iter().map(|i| *i as u32).collect());
        if self.shuffle.is_none() {
            return data;
        }
        let vertices = self.of(data.positions.len());
        let mut new_of_old = vec![0; vertices.len()];
        for (new, old) in vertices.iter().enumerate() {
            new_of_old[*old] = new as u32;
        }
        let triangle = |(i, old): (usize, &usize)| {
            let mut corners = data.triangles[*old].map(|v| new_of_old[v as usize]);
            corners.rotate_left(i % 3);
            corners
        };
        MeshData {
            positions: vertices.iter().map(|v| data.positions[*v]).collect(),
            normals: match data.normals.is_empty() {
                true => Vec::new(),
                false => vertices.iter().map(|v| data.normals[*v]).collect(),
            },
            triangles: order.iter().enumerate().map(triangle).collect(),
            parts: Vec::new(),
            open: data.open,
            ..MeshData::default()
        }
    }
}

/// The scene with `change` made to every number, in `order`, complete but for
/// [`SceneBuilder::finish`]: whoever calls may add to its end.
pub fn remade(scene: &Scene, change: &Change, order: &mut Order) -> SceneBuilder {
    let mut to = tables(scene, change, change, order);
    order.roots = order.of(scene.roots.len());
    for root in &order.roots {
        to.instance("", scene.roots.row(*root));
    }
    to
}

/// The scene as it was, all of its roots below one node that is turned and
/// scaled.
pub fn below(scene: &Scene, change: &Change) -> SceneBuilder {
    let mut to = tables(scene, &Change::NONE, change, &mut Order::default());
    let roots = 0..scene.roots.len();
    let roots: Vec<Edge> = roots.map(|row| scene.roots.row(row)).collect();
    let node = to.node("", &roots);
    let map = DAffine3::from_mat3(change.turn.matrix() * change.scale);
    let transform = to.transform(map.into());
    to.instance("", Edge::node(node).transform(transform));
    to
}

/// All tables but the roots: shapes and where they are placed by one change, what
/// looks at them and lights them by another.
fn tables(scene: &Scene, change: &Change, view: &Change, order: &mut Order) -> SceneBuilder {
    assert!(scene.transforms.motions.is_empty(), "scenes at rest only");
    let mut to = SceneBuilder::default();
    for local in &scene.transforms.local[1..] {
        to.transform(change.place(local));
    }
    assert_eq!(to.tables().transforms.len(), scene.transforms.len());
    for material in &scene.materials.rows {
        to.material("", *material);
    }
    for light in &scene.lights {
        to.light(view.light(light));
    }
    for camera in &scene.cameras.rows {
        to.camera("", view.camera(camera));
    }
    to.background(scene.background);
    for shape in &scene.shapes.rows {
        change.shape(scene, *shape, &mut to, order);
    }
    for children in &scene.nodes.children {
        let rows = children.start as usize..children.end as usize;
        let children: Vec<Edge> = rows.map(|row| scene.edges.row(row)).collect();
        to.node("", &children);
    }
    to
}
