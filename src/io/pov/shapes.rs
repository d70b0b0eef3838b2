//! Declarations of shapes and CSG solids.

use super::level_set::level_set;
use super::polynomial::polynomial;
use super::{Dress, PovError, Writer, below, comment, name, number, placed, vector};
use crate::geom::HalfSpace;
use crate::scene::{
    CsgId, MeshId, Operator, PolygonId, PrismId, Shape, ShapeId, Tables, operands_first,
    shape_bounds,
};
use glam::DVec2;
use std::fmt::Write;

/// Parts that one xor may become.
const MOST_PARTS: u64 = 1 << 20;

/// The shape that each CSG solid is.
pub(super) fn of_csg(scene: &Tables) -> Vec<u32> {
    let mut of = vec![0; scene.csg.len()];
    for (i, shape) in (0..).zip(&scene.shapes.rows) {
        if let Shape::Csg(id) = shape {
            of[id.index()] = i;
        }
    }
    of
}

impl Writer<'_> {
    pub(super) fn shapes(&mut self) -> Result<(), PovError> {
        for id in (0..self.scene.shapes.len() as u32).map(ShapeId) {
            let [own, bare] = self.wanted.shapes[id.index()];
            let shape = self.scene.shapes.row(id);
            let kinds: &[Dress] = match shape {
                Shape::Csg(_) => continue,
                Shape::Mesh(_) => &[Dress::Own, Dress::Bare],
                _ => &[Dress::Own],
            };
            for dress in kinds {
                let is_wanted = match (kinds.len(), dress) {
                    (1, _) => own || bare,
                    (_, Dress::Own) => own,
                    (_, Dress::Bare) => bare,
                };
                if is_wanted {
                    self.declare(id, *dress);
                    self.primitive(id, shape, *dress)?;
                }
            }
        }
        let shape_of = of_csg(self.scene);
        for row in operands_first(self.scene).unwrap_or_default() {
            let shape = ShapeId(shape_of[row as usize]);
            for dress in [Dress::Own, Dress::Bare] {
                if self.wanted.shapes[shape.index()][dress as usize] {
                    self.csg(shape, CsgId(row), dress)?;
                }
            }
        }
        Ok(())
    }

    fn declare(&mut self, id: ShapeId, dress: Dress) {
        let name = name("Shape", id.0, dress);
        let _ = write!(self.text, "#declare {name} = ");
    }

    fn primitive(&mut self, id: ShapeId, shape: Shape, dress: Dress) -> Result<(), PovError> {
        let scene = self.scene;
        let text = match shape {
            Shape::HalfSpace(row) => plane(&scene.half_spaces.row(row)),
            Shape::Sphere(row) => {
                let row = scene.spheres.row(row);
                format!(
                    "sphere {{ {}, {} }}",
                    vector(row.center),
                    number(row.radius)
                )
            }
            Shape::Ellipsoid(row) => {
                let row = scene.ellipsoids.row(row);
                let (radii, center) = (vector(row.radii), vector(row.center));
                format!("sphere {{ 0, 1 scale {radii} translate {center} }}")
            }
            Shape::Cylinder(row) => {
                let row = scene.cylinders.row(row);
                let (base, top) = (vector(row.base), vector(row.top));
                let open = if row.open { " open" } else { "" };
                format!("cylinder {{ {base}, {top}, {}{open} }}", number(row.radius))
            }
            Shape::Cone(row) => {
                let row = scene.cones.row(row);
                let open = if row.open { " open" } else { "" };
                format!(
                    "cone {{ {}, {}, {}, {}{open} }}",
                    vector(row.base),
                    number(row.base_radius),
                    vector(row.top),
                    number(row.top_radius)
                )
            }
            Shape::Cuboid(row) => {
                let row = scene.cuboids.row(row);
                format!("box {{ {}, {} }}", vector(row.min), vector(row.max))
            }
            Shape::Polyhedron(row) => {
                let mut text = String::from("intersection {\n");
                for face in scene.polyhedra.planes(row) {
                    let _ = writeln!(text, "  {}", plane(face));
                }
                if let Some(bounds) = shape_bounds(scene, id) {
                    let room = bounds.diagonal() * 1e-6;
                    let [low, high] = [bounds.min - room, bounds.max + room].map(vector);
                    let _ = writeln!(text, "  bounded_by {{ box {{ {low}, {high} }} }}");
                }
                text + "}"
            }
            Shape::Quadric(row) => {
                let [a, b, c, d, e, f, g, h, i, j] = scene.quadrics.row(row).coefficients;
                let [squares, mixed, linear] = [[a, b, c], [d, e, f], [g, h, i]].map(vector);
                format!("quadric {{ {squares}, {mixed}, {linear}, {} }}", number(j))
            }
            Shape::Polygon(row) => self.polygon(row),
            Shape::Prism(row) => self.prism(row),
            Shape::Mesh(row) => self.mesh(id, row, dress),
            Shape::Implicit(row) => {
                let name = || scene.shapes.names.label(id.0);
                polynomial(&scene.implicits.row(row))
                    .ok_or_else(|| PovError::NoNumber { name: name() })?
            }
            Shape::LevelSet(row) => {
                let name = || scene.shapes.names.label(id.0);
                level_set(&scene.level_sets.row(row), name)?
            }
            Shape::Csg(_) => String::new(),
        };
        let comment = comment(scene.shapes.names.get(id.0));
        let _ = writeln!(self.text, "{text}{comment}");
        Ok(())
    }

    fn polygon(&self, id: PolygonId) -> String {
        let points = self.scene.polygons.points(id);
        let corners = points.iter().chain(points.first()).map(|p| vector(*p));
        let corners: Vec<String> = corners.collect();
        format!("polygon {{ {}, {} }}", corners.len(), corners.join(", "))
    }

    /// Swept along y there, from the plane of x and z: both are exchanged.
    fn prism(&self, id: PrismId) -> String {
        let row = self.scene.prisms.row(id);
        let closed = |ring: &[DVec2]| ring.iter().chain(ring.first()).copied().collect();
        let corners: Vec<DVec2> = row
            .rings()
            .flat_map(|r| -> Vec<DVec2> { closed(r) })
            .collect();
        let pair = |p: &DVec2| format!("<{}, {}>", number(p.x), number(p.y));
        let list: Vec<String> = corners.iter().map(pair).collect();
        format!(
            "prism {{ linear_sweep linear_spline 0, {}, {}, {} \
             matrix <1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 0> }}",
            number(row.height()),
            list.len(),
            list.join(", ")
        )
    }

    fn mesh(&self, shape: ShapeId, id: MeshId, dress: Dress) -> String {
        let mesh = self.scene.meshes.row(id);
        let list = |what: &str, rows: &mut dyn ExactSizeIterator<Item = String>| {
            let mut text = format!("  {what} {{ {}", rows.len());
            for row in rows {
                text.push_str(",\n    ");
                text.push_str(&row);
            }
            text + "\n  }\n"
        };
        let center = mesh.center.to_array();
        let mut positions = mesh
            .positions
            .iter()
            .map(|p| vector([0, 1, 2].map(|k| f64::from(p[k]) + center[k])));
        let mut text = String::from("mesh2 {\n");
        text += &list("vertex_vectors", &mut positions);
        if let Some(normals) = mesh.normals {
            let mut normals = normals.iter().map(|n| vector(n.map(f64::from)));
            text += &list("normal_vectors", &mut normals);
        }
        let triangles = 0..mesh.triangles.len() as u32;
        let mut materials: Vec<u32> = match dress {
            Dress::Own => triangles
                .clone()
                .filter_map(|t| Some(mesh.material(t)?.0))
                .collect(),
            Dress::Bare => Vec::new(),
        };
        materials.sort_unstable();
        materials.dedup();
        if !materials.is_empty() {
            let mut rows = materials
                .iter()
                .map(|row| format!("texture {{ Texture_{row} }}"));
            text += &list("texture_list", &mut rows);
        }
        let mut faces = triangles.map(|t| {
            let [a, b, c] = mesh.triangles[t as usize];
            let own = mesh.material(t).filter(|_| dress == Dress::Own);
            match own.and_then(|id| materials.binary_search(&id.0).ok()) {
                Some(texture) => format!("<{a}, {b}, {c}>, {texture}"),
                None => format!("<{a}, {b}, {c}>"),
            }
        });
        text += &list("face_indices", &mut faces);
        let operands = &self.scene.csg.operands;
        if operands.iter().any(|operand| operand.shape == shape) {
            // Inside is where a ray that way leaves more often than it comes in; along
            // no edge, as a rule.
            text += "  inside_vector <0.36, 0.48, 0.8>\n";
        }
        text + "}"
    }

    fn csg(&mut self, shape: ShapeId, id: CsgId, dress: Dress) -> Result<(), PovError> {
        let scene = self.scene;
        let own = scene.csg.material[id.index()].filter(|_| dress == Dress::Own);
        let inner = below(own, dress);
        let operands: Vec<String> = scene
            .csg
            .operands(id)
            .iter()
            .map(|operand| {
                let material = operand.material.filter(|_| inner == Dress::Own);
                let map = &scene.transforms.local[operand.transform.index()];
                self.operand(operand.shape, inner, map, material)
            })
            .collect();
        let operator = scene.csg.operator[id.index()];
        let whole = match operator {
            Operator::Xor if operands.len() > 1 => self.xor(shape, dress, operands)?,
            Operator::Complement => format!("object {{ {} inverse }}", operands.concat()),
            _ if operands.len() == 1 => operands.concat(),
            _ => {
                let word = match operator {
                    Operator::Intersection => "intersection",
                    Operator::Difference => "difference",
                    _ if self.is_clear => "merge",
                    _ => "union",
                };
                format!("{word} {{\n  {}\n}}", operands.join("\n  "))
            }
        };
        let whole = match own {
            Some(material) => {
                format!(
                    "object {{ {whole} material {{ Material_{} }} }}",
                    material.0
                )
            }
            None => whole,
        };
        self.declare(shape, dress);
        let comment = comment(scene.shapes.names.get(shape.0));
        let _ = writeln!(self.text, "{whole}{comment}");
        Ok(())
    }

    fn operand(
        &self,
        shape: ShapeId,
        dress: Dress,
        map: &crate::math::Affine,
        material: Option<crate::scene::MaterialId>,
    ) -> String {
        placed(&self.shape_name(shape, dress), map, material)
    }

    /// A ⊕ B = (A − B) ∪ (B − A), of halves: n operands become n² parts.
    fn xor(
        &mut self,
        shape: ShapeId,
        dress: Dress,
        operands: Vec<String>,
    ) -> Result<String, PovError> {
        let parts = (operands.len().next_power_of_two() as u64).saturating_pow(2);
        if parts > MOST_PARTS {
            return Err(PovError::TooManyParts {
                name: self.scene.shapes.names.label(shape.0),
                parts,
                limit: MOST_PARTS,
            });
        }
        let word = if self.is_clear { "merge" } else { "union" };
        let whole = name("Shape", shape.0, dress);
        let (mut level, mut count) = (operands, 0);
        while level.len() > 2 {
            let mut next = Vec::with_capacity(level.len() / 2 + 1);
            for pair in level.chunks(2) {
                let [a, b] = pair else {
                    next.extend(pair.iter().cloned());
                    continue;
                };
                let part = format!("{whole}_xor_{count}");
                count += 1;
                let _ = writeln!(self.text, "#declare {part} = {}", one_xor(word, a, b));
                next.push(format!("object {{ {part} }}"));
            }
            level = next;
        }
        Ok(match &level[..] {
            [a, b] => one_xor(word, a, b),
            rest => rest.concat(),
        })
    }
}

fn one_xor(word: &str, a: &str, b: &str) -> String {
    format!("{word} {{\n  difference {{ {a} {b} }}\n  difference {{ {b} {a} }}\n}}")
}

fn plane(row: &HalfSpace) -> String {
    let length = crate::math::length(row.normal);
    let (normal, offset) = if length > 0.0 && length.is_finite() {
        (row.normal / length, row.offset / length)
    } else {
        let size = row.normal.abs().max_element();
        let small = row.normal / size;
        let length = crate::math::length(small);
        (small / length, row.offset / size / length)
    };
    format!("plane {{ {}, {} }}", vector(normal), number(offset))
}
