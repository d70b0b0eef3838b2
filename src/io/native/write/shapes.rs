//! Shapes: primitives, solids made of solids, and meshes with their files.

use super::looks::vector;
use super::text::{Table, Value, numbers, one};
use super::{NativeError, Writer, function};
use crate::geom::implicit::torus;
use crate::geom::{Clip, Cuboid, HalfSpace, Sphere};
use crate::roots::Solver;
use crate::scene::{
    CsgId, ImplicitId, LevelSetId, MeshAttributes, MeshData, MeshId, Operator, Shape, ShapeId,
    Slot, TextureRef, TransformId, far_center,
};
use crate::shared::tangents::generated;
use crate::shared::write_ply::{PlyMesh, encode, turned};
use glam::DVec3;

impl Writer<'_> {
    /// Writes a shape as the value of its name.
    pub(super) fn shape(&mut self, id: ShapeId) -> Result<Table, NativeError> {
        let scene = self.scene;
        let number = Value::Number;
        let field = |key: &str, value: Value| (key.to_string(), value);
        let mut open = false;
        let (kind, value) = match scene.shapes.row(id) {
            Shape::HalfSpace(row) => (
                "half_space",
                Value::Table(half_space(&scene.half_spaces.row(row))),
            ),
            Shape::Sphere(row) => ("sphere", sphere(&scene.spheres.row(row))),
            Shape::Ellipsoid(row) => {
                let row = scene.ellipsoids.row(row);
                let fields = vec![
                    field("center", vector(row.center)),
                    field("radii", vector(row.radii)),
                ];
                ("ellipsoid", Value::Table(fields))
            }
            Shape::Cylinder(row) => {
                let row = scene.cylinders.row(row);
                open = row.open;
                let fields = vec![
                    field("base", vector(row.base)),
                    field("top", vector(row.top)),
                    field("radius", number(row.radius)),
                ];
                ("cylinder", Value::Table(fields))
            }
            Shape::Cone(row) => {
                let row = scene.cones.row(row);
                open = row.open;
                let fields = vec![
                    field("base", vector(row.base)),
                    field("top", vector(row.top)),
                    field("base_radius", number(row.base_radius)),
                    field("top_radius", number(row.top_radius)),
                ];
                ("cone", Value::Table(fields))
            }
            Shape::Cuboid(row) => ("box", cuboid(&scene.cuboids.row(row))),
            Shape::Polyhedron(row) => {
                let planes = scene.polyhedra.planes(row).iter();
                let planes = planes.map(|plane| Value::Table(half_space(plane)));
                ("polyhedron", one("planes", Value::List(planes.collect())))
            }
            Shape::Polygon(row) => {
                let list =
                    |points: &[DVec3]| Value::List(points.iter().map(|p| vector(*p)).collect());
                let mut fields = vec![field("points", list(scene.polygons.points(row)))];
                if let Some(normals) = scene.polygons.normals(row) {
                    fields.push(field("normals", list(normals)));
                }
                ("polygon", Value::Table(fields))
            }
            Shape::Prism(row) => {
                let row = scene.prisms.row(row);
                let ring = |ring: &[glam::DVec2]| {
                    Value::List(ring.iter().map(|p| numbers(p.to_array())).collect())
                };
                let mut rings = row.rings().map(ring);
                let outline = rings.next().unwrap_or(Value::List(Vec::new()));
                let holes: Vec<Value> = rings.collect();
                let mut fields = vec![field("points", outline)];
                if !holes.is_empty() {
                    fields.push(field("holes", Value::List(holes)));
                }
                fields.push(field("height", number(row.height())));
                ("prism", Value::Table(fields))
            }
            Shape::Quadric(row) => {
                let coefficients = scene.quadrics.row(row).coefficients;
                ("quadric", one("coefficients", numbers(coefficients)))
            }
            Shape::Implicit(row) => return self.implicit(id, row),
            Shape::LevelSet(row) => return self.level_set(id, row),
            Shape::Mesh(row) => return Ok(self.mesh(id, row)),
            Shape::Csg(row) => return self.csg(row),
        };
        let mut table = vec![(kind.to_string(), value)];
        if open {
            table.push(("open".into(), Value::Flag(true)));
        }
        Ok(table)
    }

    fn implicit(&mut self, shape: ShapeId, id: ImplicitId) -> Result<Table, NativeError> {
        let row = self.scene.implicits.row(id);
        let mut table: Table = match torus::radii_of(row.tape) {
            Some([major, minor]) => {
                let fields = vec![
                    ("major".to_string(), Value::Number(major)),
                    ("minor".to_string(), Value::Number(minor)),
                ];
                vec![("torus".into(), Value::Table(fields))]
            }
            None => {
                let equation = function::of_tape(row.tape);
                let text = self.equation(shape, equation)?;
                vec![("implicit".into(), Value::Text(text))]
            }
        };
        extras(&mut table, row.open, row.clip);
        let solver = self.scene.implicits.solver(id);
        if solver != Solver::Auto {
            table.push(("solver".into(), Value::Text(solver.name().into())));
        }
        Ok(table)
    }

    fn level_set(&mut self, shape: ShapeId, id: LevelSetId) -> Result<Table, NativeError> {
        let row = self.scene.level_sets.row(id);
        let text = self.equation(shape, function::of_formula(row.formula))?;
        let mut table: Table = vec![("implicit".into(), Value::Text(text))];
        extras(&mut table, row.open, row.clip);
        Ok(table)
    }

    /// Returns the text of an equation, and counts those that are other steps when read.
    fn equation(
        &mut self,
        shape: ShapeId,
        equation: Option<function::Equation>,
    ) -> Result<String, NativeError> {
        let Some(equation) = equation else {
            let name = self.shapes[shape.index()].clone();
            return Err(NativeError::NoText { name });
        };
        if !equation.is_same {
            self.lose("order of steps of an equation");
        }
        Ok(equation.text)
    }

    /// Returns the level set of a solid that a file gives as one shape: with the clip that it is
    /// intersected with.
    pub(super) fn clipped(&self, id: CsgId) -> Option<[ShapeId; 2]> {
        let csg = &self.scene.csg;
        let i = id.index();
        let [solid, within] = csg.operands(id) else {
            return None;
        };
        let is_plain = csg.operator[i] == Operator::Intersection
            && csg.material[i].is_none()
            && csg.tolerance[i] == 0.0
            && [solid, within].iter().all(|operand| {
                operand.transform == TransformId::IDENTITY && operand.material.is_none()
            });
        let Shape::LevelSet(row) = self.scene.shapes.row(solid.shape) else {
            return None;
        };
        let row = self.scene.level_sets.row(row);
        let clip = match self.scene.shapes.row(within.shape) {
            Shape::Sphere(id) => Clip::Sphere(self.scene.spheres.row(id)),
            Shape::Cuboid(id) => Clip::Cuboid(self.scene.cuboids.row(id)),
            _ => return None,
        };
        (is_plain && !row.open && row.clip == Some(clip)).then_some([solid.shape, within.shape])
    }

    fn csg(&mut self, id: CsgId) -> Result<Table, NativeError> {
        let csg = &self.scene.csg;
        if let Some([solid, _]) = self.clipped(id)
            && let Shape::LevelSet(row) = self.scene.shapes.row(solid)
        {
            return self.level_set(solid, row);
        }
        let operands = csg.operands(id).iter().map(|operand| {
            let name = Value::Text(self.shapes[operand.shape.index()].clone());
            if operand.transform == TransformId::IDENTITY && operand.material.is_none() {
                return name;
            }
            let mut table: Table = vec![("shape".into(), name)];
            self.placed(&mut table, operand.transform, operand.material);
            Value::Table(table)
        });
        let mut operands: Vec<Value> = operands.collect();
        let (kind, value) = match csg.operator[id.index()] {
            Operator::Union => ("union", Value::List(operands)),
            Operator::Intersection => ("intersection", Value::List(operands)),
            Operator::Difference => ("difference", Value::List(operands)),
            Operator::Xor => ("xor", Value::List(operands)),
            Operator::Complement => ("complement", operands.remove(0)),
        };
        let mut table: Table = vec![(kind.into(), value)];
        if let Some(material) = csg.material[id.index()] {
            let name = self.materials[material.index()].clone();
            table.push(("material".into(), Value::Text(name)));
        }
        let tolerance = csg.tolerance[id.index()];
        if tolerance != 0.0 {
            table.push(("tolerance".into(), Value::Number(tolerance)));
        }
        Ok(table)
    }

    /// Says whether the written scene has normal maps, without which no mesh gets tangents.
    fn has_normal_maps(&self) -> bool {
        let is_written =
            |(slot, texture): &(Slot, TextureRef)| *slot == Slot::Normal && texture.uv_set == 0;
        let mut rows = self.scene.textures.iter();
        rows.any(|row| row.refs.iter().any(is_written))
    }

    /// Returns the tangents that a mesh of the first set of texture coordinates has when it is read.
    fn tangents_read(&self, id: MeshId, row: &MeshAttributes) -> Vec<[i16; 4]> {
        let mesh = self.scene.meshes.row(id);
        if row.sets == 0 {
            return Vec::new();
        }
        let uvs = &self.scene.meshes.attributes.uvs[row.uvs..row.uvs + row.vertices];
        let place = |p: &[f32; 3]| (DVec3::from_array(p.map(f64::from)) + mesh.center).to_array();
        let data = MeshData {
            positions: mesh.positions.iter().map(place).collect(),
            normals: mesh.normals.unwrap_or_default().to_vec(),
            triangles: mesh.triangles.to_vec(),
            uvs: vec![uvs.to_vec()],
            ..MeshData::default()
        };
        generated(&data, 0, mesh.normals.is_some(), 0)
    }

    /// Writes a mesh, whose file is made for the first shape of it.
    fn mesh(&mut self, shape: ShapeId, id: MeshId) -> Table {
        let mesh = self.scene.meshes.row(id);
        let name = match &self.mesh_files[id.index()] {
            Some(name) => name.clone(),
            None => {
                let name = self.file_name(&self.shapes[shape.index()], shape.0, "ply");
                let all = &self.scene.meshes.attributes;
                let row = all.of(id).map(|row| &all.rows[row as usize]);
                let own = |first: usize, row: &MeshAttributes| first..first + row.vertices;
                let uvs = row.filter(|row| row.sets > 0);
                let bytes = encode(&PlyMesh {
                    positions: mesh.positions,
                    normals: mesh.normals,
                    uvs: uvs.map(|row| &all.uvs[own(row.uvs, row)]),
                    colors: row.and_then(|row| Some(&all.colors[own(row.colors?, row)])),
                    triangles: mesh.triangles,
                    center: mesh.center,
                });
                self.files.push((name.clone(), bytes));
                if far_center(&mesh.bounds(), 8.0) != mesh.center {
                    self.lose("vertices that are rounded otherwise");
                }
                if self.scene.deformations.has(id) {
                    self.lose("mesh that deforms");
                }
                if let Some(uvs) = uvs.map(|row| &all.uvs[own(row.uvs, row)]) {
                    let is_kept = |uv: &[f32; 2]| turned(turned(f64::from(uv[1]))) as f32 == uv[1];
                    let rounded = !uvs.iter().all(is_kept);
                    self.lose_many(
                        "mesh's texture coordinates that are rounded",
                        usize::from(rounded),
                    );
                }
                if let Some(row) = row {
                    let more = usize::from(row.sets).saturating_sub(1);
                    self.lose_many("further set of a mesh's texture coordinates", more);
                    let has_own = row.tangents.is_some_and(|first| {
                        let own = &all.tangents[first..first + 3 * mesh.triangles.len()];
                        !self.has_normal_maps() || own != self.tangents_read(id, row)
                    });
                    self.lose_many("mesh's own tangents", usize::from(has_own));
                }
                self.mesh_files[id.index()] = Some(name.clone());
                name
            }
        };
        let path = format!("{}/{name}", self.folder);
        let mut table: Table = vec![("mesh".into(), Value::Text(path))];
        if mesh.open {
            table.push(("open".into(), Value::Flag(true)));
        }
        // Where its colours have a say, a file alone has a material of its own, which no part asks for.
        let attributes = &self.scene.meshes.attributes;
        let colors = attributes
            .of(id)
            .and_then(|row| attributes.rows[row as usize].colors);
        if !mesh.parts.is_empty() || colors.is_some() {
            let part = |(first, material): &(u32, Option<crate::scene::MaterialId>)| {
                let mut row: Table = vec![("first".into(), Value::Whole((*first).into()))];
                if let Some(id) = material {
                    let name = self.materials[id.index()].clone();
                    row.push(("material".into(), Value::Text(name)));
                }
                Value::Table(row)
            };
            let parts = mesh.parts.iter().map(part).collect();
            table.push(("parts".into(), Value::List(parts)));
        }
        table
    }
}

fn extras(table: &mut Table, open: bool, clip: Option<Clip>) {
    if open {
        table.push(("open".into(), Value::Flag(true)));
    }
    if let Some(clip) = clip {
        let clip = match clip {
            Clip::Sphere(row) => one("sphere", sphere(&row)),
            Clip::Cuboid(row) => one("box", cuboid(&row)),
        };
        table.push(("clip".into(), clip));
    }
}

fn half_space(row: &HalfSpace) -> Table {
    vec![
        ("normal".into(), vector(row.normal)),
        ("offset".into(), Value::Number(row.offset)),
    ]
}

fn sphere(row: &Sphere) -> Value {
    Value::Table(vec![
        ("center".into(), vector(row.center)),
        ("radius".into(), Value::Number(row.radius)),
    ])
}

fn cuboid(row: &Cuboid) -> Value {
    Value::Table(vec![
        ("min".into(), vector(row.min)),
        ("max".into(), vector(row.max)),
    ])
}
