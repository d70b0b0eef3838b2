//! One shape of the file to one row of its table.

use super::lower::{exactly_one, find};
use super::lower_csg::{Declared, declare, refuse_extras};
use super::schema;
use super::source_spans::At;
use super::tree::{Source, quoted};
use super::{lower_deformation, lower_lathe, lower_polynomial};
use crate::geom::{Cone, Cuboid, Cylinder, Ellipsoid, HalfSpace, Prism, Quadric, Sphere, hull};
use crate::scene::{MaterialId, MeshData, MeshId, SceneBuilder, Shape, ShapeId};
use crate::shared::images::ImageStore;
use crate::shared::merge_meshes::{MESH_FORMATS, import_mesh, import_with_materials, names_mesh};
use crate::shared::tangents::generated;
use crate::{Folder, ImportReport, LoadError, LoadOptions};
use glam::{DVec2, DVec3};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Runs of triangles and their materials, as a file of the format gives them.
type Parts = Vec<(u32, Option<MaterialId>)>;

/// The mesh files that are read already, each once: with the mesh of the scene for the file
/// as it is, and for the file as an open surface.
pub(super) struct MeshFiles<'i> {
    /// The folder of the file whose shapes are read.
    folder: Folder,
    options: LoadOptions,
    images: &'i mut ImageStore,
    known: HashMap<(PathBuf, Option<Parts>), [Option<MeshId>; 2]>,
}

impl MeshFiles<'_> {
    /// Returns the path of a mesh file that there is.
    pub(super) fn path(&self, source: &Source, file: &At<String>) -> Result<PathBuf, LoadError> {
        let path = self.folder.resolve(&file.value).map_err(|e| match e {
            LoadError::Read { source: why, .. } => {
                let message = format!(
                    "the mesh file {} cannot be read: {why}",
                    quoted(&file.value)
                );
                source.error(file.at, message)
            }
            other => other,
        })?;
        let refuse = |why: String| {
            let message = format!("the mesh file {} {why}", quoted(&file.value));
            Err(source.error(file.at, message))
        };
        if path.is_dir() {
            return refuse("is a folder; name a file in it".into());
        }
        if !names_mesh(&path) {
            return refuse(format!("is of no known format; known are {MESH_FORMATS}"));
        }
        Ok(path)
    }

    /// Reads a file apart from all others.
    pub(super) fn read(
        &mut self,
        source: &Source,
        file: &At<String>,
        scene: &mut SceneBuilder,
        report: &mut ImportReport,
    ) -> Result<MeshData, LoadError> {
        let path = self.path(source, file)?;
        import_with_materials(&path, &self.options, self.images, scene, report)
    }

    pub(super) fn new<'i>(options: &LoadOptions, images: &'i mut ImageStore) -> MeshFiles<'i> {
        MeshFiles {
            images,
            folder: Folder::new(Path::new(""), options),
            options: options.clone(),
            known: HashMap::new(),
        }
    }

    /// Goes on to the shapes of another file.
    pub(super) fn enter(&mut self, source: &Source) {
        self.folder = Folder::new(source.path, &self.options);
    }
}

pub(super) fn shape(
    source: &Source,
    name: &At<String>,
    row: schema::Shape,
    (files, materials): (&mut MeshFiles<'_>, &HashMap<String, MaterialId>),
    scene: &mut SceneBuilder,
    report: &mut ImportReport,
    csg_solids: &mut Vec<Declared>,
) -> Result<ShapeId, LoadError> {
    let what = format!("shape {}", quoted(&name.value));
    let given = [
        ("sphere", row.sphere.is_some()),
        ("ellipsoid", row.ellipsoid.is_some()),
        ("half_space", row.half_space.is_some()),
        ("box", row.cuboid.is_some()),
        ("cylinder", row.cylinder.is_some()),
        ("cone", row.cone.is_some()),
        ("polyhedron", row.polyhedron.is_some()),
        ("polygon", row.polygon.is_some()),
        ("prism", row.prism.is_some()),
        ("lathe", row.lathe.is_some()),
        ("quadric", row.quadric.is_some()),
        ("torus", row.torus.is_some()),
        ("superquadric", row.superquadric.is_some()),
        ("cubic", row.cubic.is_some()),
        ("quartic", row.quartic.is_some()),
        ("implicit", row.implicit.is_some()),
        ("mesh", row.mesh.is_some()),
        ("union", row.union.is_some()),
        ("intersection", row.intersection.is_some()),
        ("difference", row.difference.is_some()),
        ("xor", row.xor.is_some()),
        ("complement", row.complement.is_some()),
    ];
    let kind = exactly_one(source, name.at, &what, &given)?;
    lower_polynomial::refuse_extras(source, kind, &row)?;
    let open = row.open.is_some_and(|o| o.value);
    let name = &*name.value;
    if matches!(
        kind,
        "union" | "intersection" | "difference" | "xor" | "complement"
    ) {
        let declared = declare(name, row, scene);
        let shape = declared.shape;
        csg_solids.push(declared);
        return Ok(shape);
    }
    refuse_extras(source, kind, &row)?;
    if lower_polynomial::KINDS.contains(&kind) {
        return lower_polynomial::polynomial(source, name, &row, scene);
    }
    let v = DVec3::from_array;

    if let Some(s) = row.sphere {
        let (center, radius) = (v(s.center), s.radius);
        return Ok(scene.sphere(name, Sphere { center, radius }));
    }
    if let Some(s) = row.ellipsoid {
        let (center, radii) = (v(s.center), v(s.radii));
        return Ok(scene.ellipsoid(name, Ellipsoid { center, radii }));
    }
    if let Some(s) = row.half_space {
        return Ok(scene.half_space(name, half_space(&s)));
    }
    if let Some(s) = row.cuboid {
        let (min, max) = (v(s.min), v(s.max));
        return Ok(scene.cuboid(name, Cuboid { min, max }));
    }
    if let Some(s) = row.cylinder {
        let cylinder = Cylinder {
            base: v(s.base),
            top: v(s.top),
            radius: s.radius,
            open,
        };
        return Ok(scene.cylinder(name, cylinder));
    }
    if let Some(s) = row.cone {
        let cone = Cone {
            base: v(s.base),
            top: v(s.top),
            base_radius: s.base_radius,
            top_radius: s.top_radius,
            open,
        };
        return Ok(scene.cone(name, cone));
    }
    if let Some(s) = row.polyhedron {
        return polyhedron(source, name, &what, &s, scene);
    }
    if let Some(s) = row.polygon {
        let points: Vec<DVec3> = s.points.into_iter().map(v).collect();
        let normals: Vec<DVec3> = s.normals.into_iter().flatten().map(v).collect();
        return Ok(scene.polygon(name, &points, &normals));
    }
    if let Some(s) = row.prism {
        let ring = |ring: Vec<[f64; 2]>| ring.into_iter().map(DVec2::from_array).collect();
        let prism = Prism {
            outline: ring(s.points),
            holes: s.holes.into_iter().flatten().map(ring).collect(),
            height: s.height,
        };
        return Ok(scene.prism(name, prism));
    }
    if let Some(s) = row.lathe {
        return lower_lathe::lathe(source, name, &s, scene);
    }
    if let Some(s) = row.quadric {
        let coefficients = s.coefficients;
        return Ok(scene.quadric(name, Quadric { coefficients }));
    }
    let file = row.mesh.unwrap_or(At {
        at: 0,
        value: String::new(),
    });
    let parts = row.parts.as_ref();
    let parts = parts
        .map(|rows| self::parts(source, rows, materials))
        .transpose()?;
    match &row.motion {
        Some(motion) => {
            lower_deformation::mesh(source, name, (&file, motion, open), files, scene, report)
        }
        None => mesh(source, name, (&file, open, parts), files, scene, report),
    }
}

/// For messages: with its article.
pub(super) fn one(kind: &str) -> String {
    let article = match kind {
        "ellipsoid" | "implicit" | "intersection" => "an",
        _ => "a",
    };
    format!("{article} {kind}")
}

fn half_space(row: &schema::HalfSpace) -> HalfSpace {
    HalfSpace {
        normal: DVec3::from_array(row.normal),
        offset: row.offset,
    }
}

fn polyhedron(
    source: &Source,
    name: &str,
    what: &str,
    row: &At<schema::Polyhedron>,
    scene: &mut SceneBuilder,
) -> Result<ShapeId, LoadError> {
    let at = row.at;
    let (at, solid) = match (&row.value.planes, &row.value.points) {
        (Some(planes), None) => {
            let rows: Vec<HalfSpace> = planes.value.iter().map(half_space).collect();
            (planes.at, hull::of_planes(&rows))
        }
        (None, Some(points)) => {
            let rows = points.value.iter().map(|p| DVec3::from_array(*p));
            (points.at, hull::of_points(&rows.collect::<Vec<_>>()))
        }
        (Some(_), Some(points)) => {
            let message = format!("{what} has both planes and points; give exactly one");
            return Err(source.error(points.at, message));
        }
        (None, None) => {
            let message = format!("{what}: a polyhedron needs planes or points");
            return Err(source.error(at, message));
        }
    };
    let solid = solid.map_err(|e| source.error(at, format!("{what}: {e}")))?;
    Ok(scene.polyhedron(name, &solid.planes, &solid.points))
}

fn mesh(
    source: &Source,
    name: &str,
    (file, open, parts): (&At<String>, bool, Option<Parts>),
    files: &mut MeshFiles,
    scene: &mut SceneBuilder,
    report: &mut ImportReport,
) -> Result<ShapeId, LoadError> {
    let path = files.path(source, file)?;
    let key = (path.clone(), parts.clone());
    let known = files.known.get(&key).and_then(|of| of[usize::from(open)]);
    if let Some(mesh) = known {
        return Ok(scene.mesh_again(name, mesh));
    }
    // Materials of the file's own are not needed where its parts have others.
    let mut data = match &parts {
        Some(_) => import_mesh(&path, &files.options, report)?,
        None => import_with_materials(&path, &files.options, files.images, scene, report)?,
    };
    data.open |= open;
    if files.options.keeps_tangents && !data.uvs.is_empty() {
        data.tangents = generated(&data, 0, !data.normals.is_empty(), 0);
    }
    if let Some(parts) = parts {
        data.parts = parts;
    }
    let shape = scene.mesh(name, &data);
    if let Shape::Mesh(mesh) = scene.tables().shapes.row(shape) {
        files.known.entry(key).or_default()[usize::from(open)] = Some(mesh);
    }
    Ok(shape)
}

/// Reads the parts of a mesh.
fn parts(
    source: &Source,
    rows: &At<Vec<At<schema::MeshPart>>>,
    materials: &HashMap<String, MaterialId>,
) -> Result<Parts, LoadError> {
    let mut parts: Parts = Vec::with_capacity(rows.value.len());
    for row in &rows.value {
        let first = &row.value.first;
        if let Some((before, _)) = parts.last().filter(|(before, _)| *before >= first.value) {
            let message = format!(
                "first = {} after {before}; give the parts in the order of their triangles",
                first.value
            );
            return Err(source.error(first.at, message));
        }
        let material = row.value.material.as_ref();
        let material = material.map(|name| find(source, "material", materials, name));
        parts.push((first.value, material.transpose()?));
    }
    Ok(parts)
}
