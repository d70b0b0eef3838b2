//! The one check of a scene's tables. What passes cannot fail later.
//!
//! Every error names the entity and says what to do. Range checks come first,
//! so the later ones may index freely.

use super::ids::{ShapeId, TransformId};
use super::motion::{Key, singular_time};
use super::nodes::Target;
use super::{Edges, Light, Material, Model, Projection, Shape, Tables};
use glam::DVec3;
use thiserror::Error;

#[derive(Clone, Debug, PartialEq, Error)]
pub enum SceneError {
    #[error("{what} refers to {kind} {id}, but there are only {count}")]
    DanglingId {
        what: String,
        kind: &'static str,
        id: u32,
        count: usize,
    },
    #[error("nodes form a cycle: {}; a node cannot contain itself", path.join(" → "))]
    Cycle { path: Vec<String> },
    #[error(
        "{what} has a singular transform (a scale of 0, or a matrix that flattens space); \
         give every axis a size"
    )]
    SingularTransform { what: String },
    #[error(
        "{what} is placed by a transform that becomes singular or infinite together with those above it"
    )]
    SingularPath { what: String },
    #[error(
        "{what} has a motion that is singular at time {time:.6}, between two keys; matrices are \
         interpolated element by element, so turn in smaller steps: give more keys"
    )]
    SingularMotion { what: String, time: f64 },
    #[error(
        "at time {time} {what} is placed by a transform that becomes singular or infinite \
         together with those above it"
    )]
    SingularPathAt { what: String, time: f64 },
    #[error("{what} has {field} = {value}, which is not a finite number")]
    NotFinite {
        what: String,
        field: &'static str,
        value: String,
    },
    #[error("{what} has {field} = {value}; it must be {must}")]
    OutOfRange {
        what: String,
        field: &'static str,
        value: String,
        must: &'static str,
    },
    #[error("{what} is degenerate: {why}")]
    Degenerate { what: String, why: String },
    #[error("{what} is empty: it has no {part}")]
    Empty { what: String, part: &'static str },
    #[error("{what}: triangle {triangle} uses vertex {vertex}, but there are only {count}")]
    VertexOutOfRange {
        what: String,
        triangle: usize,
        vertex: u32,
        count: usize,
    },
    #[error("{what} has {normals} normals for {vertices} vertices; give one each, or none")]
    NormalCount {
        what: String,
        normals: usize,
        vertices: usize,
    },
    #[error("{what} has {count} triangles; at most {limit} are supported, so split it")]
    TooManyTriangles {
        what: String,
        count: usize,
        limit: usize,
    },
    #[error("the scene is empty: no instance places a shape")]
    NothingToSee,
    #[error(
        "the scene unfolds into {count} appearances of shapes or more; ids count at most {limit}: \
         nest fewer shared nodes"
    )]
    TooManyAppearances { count: u64, limit: u64 },
    #[error(
        "the scene unfolds into {count} appearances of shapes, and each of them would be looked \
         at by itself; at most {limit} are supported for that"
    )]
    TooManyToLayOut { count: u64, limit: u64 },
    #[error(
        "the scene's nodes lie in each other {depth} deep; at most {limit} are supported where so \
         much is shared: use shorter chains of nodes"
    )]
    TooDeep { depth: u64, limit: u64 },
}

pub(super) fn check(scene: &Tables) -> Result<(), SceneError> {
    ranges(scene)?;
    cycles(scene)?;
    transforms(scene)?;
    solids(scene)?;
    polygons(scene)?;
    polyhedra(scene)?;
    meshes(scene)?;
    materials(scene)?;
    lights(scene)?;
    cameras(scene)?;
    appearances(scene)
}

fn ranges(scene: &Tables) -> Result<(), SceneError> {
    edge_ranges(scene, &scene.instances, |i| {
        format!("instance {}", scene.instance_names.label(i))
    })?;
    let parents = parents(scene);
    edge_ranges(scene, &scene.edges, |i| match parents[i as usize] {
        u32::MAX => format!("edge {i}"),
        node => format!("a child of node {}", scene.nodes.names.label(node)),
    })?;
    for (i, shape) in scene.shapes.rows.iter().enumerate() {
        let (kind, id, count) = match *shape {
            Shape::HalfSpace(id) => ("half-space", id.0, scene.half_spaces.len()),
            Shape::Sphere(id) => ("sphere", id.0, scene.spheres.len()),
            Shape::Ellipsoid(id) => ("ellipsoid", id.0, scene.ellipsoids.len()),
            Shape::Cylinder(id) => ("cylinder", id.0, scene.cylinders.len()),
            Shape::Cone(id) => ("cone", id.0, scene.cones.len()),
            Shape::Cuboid(id) => ("box", id.0, scene.cuboids.len()),
            Shape::Polyhedron(id) => ("polyhedron", id.0, scene.polyhedra.len()),
            Shape::Polygon(id) => ("polygon", id.0, scene.polygons.len()),
            Shape::Mesh(id) => ("mesh", id.0, scene.meshes.len()),
        };
        dangling(|| shape_label(scene, i as u32), kind, id, count)?;
    }
    for (mesh, parts) in scene.meshes.parts_of.iter().enumerate() {
        for (_, material) in &scene.meshes.parts[parts.start as usize..parts.end as usize] {
            if let Some(m) = material {
                dangling(
                    || format!("mesh {mesh}"),
                    "material",
                    m.0,
                    scene.materials.len(),
                )?;
            }
        }
    }
    Ok(())
}

fn edge_ranges(
    scene: &Tables,
    edges: &Edges,
    what: impl Fn(u32) -> String,
) -> Result<(), SceneError> {
    for i in 0..edges.len() {
        let edge = edges.row(i);
        let what = || what(i as u32);
        match edge.target {
            Target::Shape(id) => dangling(what, "shape", id.0, scene.shapes.len())?,
            Target::Node(id) => dangling(what, "node", id.0, scene.nodes.len())?,
        }
        dangling(what, "transform", edge.transform.0, scene.transforms.len())?;
        if let Some(m) = edge.material {
            dangling(what, "material", m.0, scene.materials.len())?;
        }
    }
    Ok(())
}

fn dangling(
    what: impl FnOnce() -> String,
    kind: &'static str,
    id: u32,
    count: usize,
) -> Result<(), SceneError> {
    if (id as usize) < count {
        return Ok(());
    }
    Err(SceneError::DanglingId {
        what: what(),
        kind,
        id,
        count,
    })
}

/// The node that each edge belongs to.
fn parents(scene: &Tables) -> Vec<u32> {
    let mut parent = vec![u32::MAX; scene.edges.len()];
    for (node, children) in scene.nodes.children.iter().enumerate() {
        parent[children.start as usize..children.end as usize].fill(node as u32);
    }
    parent
}

fn cycles(scene: &Tables) -> Result<(), SceneError> {
    children_first(scene)
        .map(|_| ())
        .map_err(|path| SceneError::Cycle {
            path: shown(&path, |n| scene.nodes.names.label(*n)),
        })
}

/// Labels of a path that may have a million nodes: a message stays short.
fn shown(path: &[u32], label: impl Fn(&u32) -> String) -> Vec<String> {
    const ENDS: usize = 5;
    if path.len() <= 2 * ENDS + 1 {
        return path.iter().map(label).collect();
    }
    let (head, tail) = (&path[..ENDS], &path[path.len() - ENDS..]);
    let between = format!("({} more)", path.len() - 2 * ENDS);
    head.iter()
        .map(&label)
        .chain([between])
        .chain(tail.iter().map(&label))
        .collect()
}

/// The nodes, each after all of its children; or a cycle, first node repeated.
/// An explicit stack: graphs may be a million nodes deep.
pub(super) fn children_first(scene: &Tables) -> Result<Vec<u32>, Vec<u32>> {
    const NEW: u8 = 0;
    const OPEN: u8 = 1;
    const DONE: u8 = 2;
    let mut state = vec![NEW; scene.nodes.len()];
    let mut order = Vec::with_capacity(scene.nodes.len());
    let mut stack: Vec<(u32, u32)> = Vec::new();
    for start in 0..scene.nodes.len() as u32 {
        if state[start as usize] != NEW {
            continue;
        }
        state[start as usize] = OPEN;
        stack.push((start, scene.nodes.children[start as usize].start));
        while let Some((node, next)) = stack.last_mut() {
            if *next == scene.nodes.children[*node as usize].end {
                state[*node as usize] = DONE;
                order.push(*node);
                stack.pop();
                continue;
            }
            let target = scene.edges.target[*next as usize];
            *next += 1;
            let Target::Node(child) = target else {
                continue;
            };
            match state[child.index()] {
                NEW => {
                    state[child.index()] = OPEN;
                    stack.push((child.0, scene.nodes.children[child.index()].start));
                }
                OPEN => {
                    let from = stack.iter().position(|(n, _)| *n == child.0).unwrap_or(0);
                    let mut path: Vec<u32> = stack[from..].iter().map(|(n, _)| *n).collect();
                    path.push(child.0);
                    return Err(path);
                }
                _ => {}
            }
        }
    }
    Ok(order)
}

fn transforms(scene: &Tables) -> Result<(), SceneError> {
    let parents = parents(scene);
    let of_edges = |edges: &Edges, what: &dyn Fn(u32) -> String| {
        for i in 0..edges.len() {
            let t = edges.transform[i].index();
            if !scene.transforms.local[t].is_finite() {
                return Err(SceneError::NotFinite {
                    what: what(i as u32),
                    field: "transform",
                    value: "NaN or infinity in its matrix".into(),
                });
            }
            if scene.transforms.inverse[t].is_none() {
                return Err(SceneError::SingularTransform {
                    what: what(i as u32),
                });
            }
            if let Some(keys) = scene.transforms.motions.of_transform(edges.transform[i]) {
                motion(keys, &|| what(i as u32))?;
            }
        }
        Ok(())
    };
    of_edges(&scene.instances, &|i| {
        format!("instance {}", scene.instance_names.label(i))
    })?;
    of_edges(&scene.edges, &|i| match parents[i as usize] {
        u32::MAX => format!("edge {i}"),
        node => format!("a child of node {}", scene.nodes.names.label(node)),
    })
}

fn motion(keys: &[Key], what: &dyn Fn() -> String) -> Result<(), SceneError> {
    let mut last = 0.0;
    // The first is the transform itself.
    for key in &keys[1..] {
        if !(key.at > last && key.at <= 1.0) {
            return Err(SceneError::OutOfRange {
                what: what(),
                field: "at of a motion's key",
                value: key.at.to_string(),
                must: "above 0 and the key before, and at most 1",
            });
        }
        last = key.at;
        if !key.local.is_finite() {
            return Err(SceneError::NotFinite {
                what: what(),
                field: "transform of a motion's key",
                value: "NaN or infinity in its matrix".into(),
            });
        }
        if key.local.inverse().is_none() {
            let time = key.at;
            return Err(SceneError::SingularMotion { what: what(), time });
        }
    }
    match singular_time(keys) {
        Some(time) => Err(SceneError::SingularMotion { what: what(), time }),
        None => Ok(()),
    }
}

/// What the first check could not know of a scene that moves.
pub(super) fn at_time(scene: &Tables, time: f64) -> Result<(), SceneError> {
    let motions = &scene.transforms.motions;
    let inverse = |row: &TransformId| scene.transforms.inverse[row.index()];
    let regular = motions.of.iter().all(|row| inverse(row).is_some());
    // This names what is singular.
    let checked = if regular {
        appearances(scene)
    } else {
        transforms(scene)
    };
    checked.map_err(|error| match error {
        SceneError::SingularTransform { what } => SceneError::SingularMotion { what, time },
        SceneError::SingularPath { what } => SceneError::SingularPathAt { what, time },
        error => error,
    })
}

fn shape_label(scene: &Tables, shape: u32) -> String {
    let kind = scene.shapes.rows[shape as usize].kind_name();
    match scene.shapes.names.get(shape) {
        Some(name) => format!("{kind} '{name}'"),
        None => format!("{kind} (shape {shape})"),
    }
}

fn finite(
    what: impl FnOnce() -> String,
    field: &'static str,
    values: &[f64],
) -> Result<(), SceneError> {
    match values.iter().find(|v| !v.is_finite()) {
        None => Ok(()),
        Some(v) => Err(SceneError::NotFinite {
            what: what(),
            field,
            value: v.to_string(),
        }),
    }
}

fn finite3(what: impl FnOnce() -> String, field: &'static str, v: DVec3) -> Result<(), SceneError> {
    finite(what, field, &v.to_array())
}

fn require(
    ok: bool,
    what: impl FnOnce() -> String,
    field: &'static str,
    value: f64,
    must: &'static str,
) -> Result<(), SceneError> {
    if ok {
        return Ok(());
    }
    Err(SceneError::OutOfRange {
        what: what(),
        field,
        value: value.to_string(),
        must,
    })
}

fn solids(scene: &Tables) -> Result<(), SceneError> {
    for i in 0..scene.shapes.len() {
        let what = || shape_label(scene, i as u32);
        let positive =
            |field, value: f64| require(value > 0.0, what, field, value, "greater than 0");
        let not_negative =
            |field, value: f64| require(value >= 0.0, what, field, value, "0 or greater");
        let apart = |base: DVec3, top: DVec3| {
            // Halved, as the kernel does: the least numbers have no half.
            if base * 0.5 != top * 0.5 {
                return Ok(());
            }
            Err(SceneError::Degenerate {
                what: what(),
                why: "its base and top are the same point".into(),
            })
        };
        match scene.shapes.rows[i] {
            Shape::HalfSpace(id) => {
                let row = scene.half_spaces.row(id);
                finite3(what, "normal", row.normal)?;
                finite(what, "offset", &[row.offset])?;
                if row.normal == DVec3::ZERO {
                    return Err(SceneError::Degenerate {
                        what: what(),
                        why: "its normal is (0, 0, 0)".into(),
                    });
                }
            }
            Shape::Sphere(id) => {
                let row = scene.spheres.row(id);
                finite3(what, "center", row.center)?;
                finite(what, "radius", &[row.radius])?;
                positive("radius", row.radius)?;
            }
            Shape::Ellipsoid(id) => {
                let row = scene.ellipsoids.row(id);
                finite3(what, "center", row.center)?;
                finite3(what, "radii", row.radii)?;
                positive("radii", row.radii.min_element())?;
            }
            Shape::Cylinder(id) => {
                let row = scene.cylinders.row(id);
                finite3(what, "base", row.base)?;
                finite3(what, "top", row.top)?;
                finite(what, "radius", &[row.radius])?;
                positive("radius", row.radius)?;
                apart(row.base, row.top)?;
            }
            Shape::Cone(id) => {
                let row = scene.cones.row(id);
                finite3(what, "base", row.base)?;
                finite3(what, "top", row.top)?;
                finite(what, "base_radius", &[row.base_radius])?;
                finite(what, "top_radius", &[row.top_radius])?;
                not_negative("base_radius", row.base_radius)?;
                not_negative("top_radius", row.top_radius)?;
                positive("base_radius + top_radius", row.base_radius + row.top_radius)?;
                apart(row.base, row.top)?;
            }
            Shape::Cuboid(id) => {
                let row = scene.cuboids.row(id);
                finite3(what, "min", row.min)?;
                finite3(what, "max", row.max)?;
                if !row.min.cmplt(row.max).all() {
                    return Err(SceneError::Degenerate {
                        what: what(),
                        why: format!(
                            "min {} must be below max {} on every axis",
                            row.min, row.max
                        ),
                    });
                }
            }
            Shape::Polyhedron(_) | Shape::Polygon(_) | Shape::Mesh(_) => {}
        }
    }
    Ok(())
}

/// How many normals each row brought: its range ends where the next one's
/// begins.
fn normal_counts(first: &[Option<u32>], total: usize) -> Vec<Option<usize>> {
    let mut end = total;
    let mut counts = vec![None; first.len()];
    for (count, first) in counts.iter_mut().zip(first).rev() {
        if let Some(first) = first {
            *count = Some(end - *first as usize);
            end = *first as usize;
        }
    }
    counts
}

fn normal_count(
    what: impl FnOnce() -> String,
    normals: Option<usize>,
    vertices: usize,
) -> Result<(), SceneError> {
    match normals {
        Some(normals) if normals != vertices => Err(SceneError::NormalCount {
            what: what(),
            normals,
            vertices,
        }),
        _ => Ok(()),
    }
}

fn polygons(scene: &Tables) -> Result<(), SceneError> {
    let table = &scene.polygons;
    let counts = normal_counts(&table.normals_of, table.normals.len());
    for i in 0..scene.shapes.len() {
        let Shape::Polygon(id) = scene.shapes.rows[i] else {
            continue;
        };
        let what = || shape_label(scene, i as u32);
        let points = scene.polygons.points(id);
        if points.len() < 3 {
            return Err(SceneError::Empty {
                what: what(),
                part: "area (fewer than 3 points)",
            });
        }
        for p in points {
            finite3(what, "points", *p)?;
        }
        normal_count(what, counts[id.index()], points.len())?;
        for n in scene.polygons.normals(id).into_iter().flatten() {
            finite3(what, "normals", *n)?;
        }
        let degenerate = |why| SceneError::Degenerate { what: what(), why };
        crate::geom::polygon_plane(points).map_err(degenerate)?;
    }
    Ok(())
}

fn polyhedra(scene: &Tables) -> Result<(), SceneError> {
    for i in 0..scene.shapes.len() {
        let Shape::Polyhedron(id) = scene.shapes.rows[i] else {
            continue;
        };
        let what = || shape_label(scene, i as u32);
        let (planes, points) = (scene.polyhedra.planes(id), scene.polyhedra.points(id));
        if planes.len() < 4 || points.len() < 4 {
            return Err(SceneError::Empty {
                what: what(),
                part: "volume (fewer than 4 faces or corners)",
            });
        }
        for plane in planes {
            finite3(what, "planes", plane.normal)?;
            finite(what, "planes", &[plane.offset])?;
            if plane.normal == DVec3::ZERO {
                return Err(SceneError::Degenerate {
                    what: what(),
                    why: "one of its planes has the normal (0, 0, 0)".into(),
                });
            }
        }
        for p in points {
            finite3(what, "points", *p)?;
        }
    }
    Ok(())
}

/// Of one mesh: what the trees' leaves can address.
pub const MAX_TRIANGLES: usize = 1 << 27;

fn few_enough(what: impl FnOnce() -> String, count: usize) -> Result<(), SceneError> {
    if count <= MAX_TRIANGLES {
        return Ok(());
    }
    Err(SceneError::TooManyTriangles {
        what: what(),
        count,
        limit: MAX_TRIANGLES,
    })
}

fn meshes(scene: &Tables) -> Result<(), SceneError> {
    let table = &scene.meshes;
    let counts = normal_counts(&table.normals_of, table.normals.len());
    for i in 0..scene.shapes.len() {
        let Shape::Mesh(id) = scene.shapes.rows[i] else {
            continue;
        };
        let what = || shape_label(scene, i as u32);
        // Before the row is read: it slices the normals.
        normal_count(
            what,
            counts[id.index()],
            table.vertices_of[id.index()].len(),
        )?;
        let mesh = table.row(id);
        if mesh.triangles.is_empty() {
            return Err(SceneError::Empty {
                what: what(),
                part: "triangles",
            });
        }
        few_enough(what, mesh.triangles.len())?;
        finite3(what, "vertices", mesh.center)?;
        for p in mesh.positions {
            finite(what, "vertices", &p.map(f64::from))?;
        }
        if let Some(normals) = mesh.normals {
            for n in normals {
                finite(what, "normals", &n.map(f64::from))?;
            }
        }
        let count = mesh.positions.len();
        for (triangle, corners) in mesh.triangles.iter().enumerate() {
            if let Some(vertex) = corners.iter().find(|v| **v as usize >= count) {
                return Err(SceneError::VertexOutOfRange {
                    what: what(),
                    triangle,
                    vertex: *vertex,
                    count,
                });
            }
        }
    }
    Ok(())
}

fn materials(scene: &Tables) -> Result<(), SceneError> {
    for (i, m) in scene.materials.rows.iter().enumerate() {
        let what = || format!("material {}", scene.materials.names.label(i as u32));
        let colors = |field, c: &[f32]| {
            for v in c {
                finite(what, field, &[f64::from(*v)])?;
                require(*v >= 0.0, what, field, f64::from(*v), "0 or greater")?;
            }
            Ok(())
        };
        let fraction = |field, v: f32| {
            let ok = (0.0..=1.0).contains(&v);
            require(ok, what, field, f64::from(v), "between 0 and 1")
        };
        let Material {
            base_color,
            emission,
            transmission,
            ior,
            model,
        } = m;
        colors("base_color", base_color)?;
        colors("emission", emission)?;
        fraction("transmission", *transmission)?;
        let ok = *ior > 0.0 && ior.is_finite();
        require(
            ok,
            what,
            "ior",
            f64::from(*ior),
            "greater than 0 and finite",
        )?;
        match model {
            Model::MetallicRoughness {
                metallic,
                roughness,
            } => {
                fraction("metallic", *metallic)?;
                fraction("roughness", *roughness)?;
            }
            Model::Phong {
                diffuse,
                specular,
                exponent,
                mirror,
            } => {
                colors("diffuse", diffuse)?;
                colors("specular", specular)?;
                colors("mirror", mirror)?;
                colors("exponent", &[*exponent])?;
            }
        }
    }
    for v in scene.background {
        finite(|| "the background".into(), "colour", &[f64::from(v)])?;
        let what = || "the background".into();
        require(v >= 0.0, what, "colour", f64::from(v), "0 or greater")?;
    }
    Ok(())
}

fn lights(scene: &Tables) -> Result<(), SceneError> {
    for (i, light) in scene.lights.iter().enumerate() {
        let what = || format!("light {i}");
        let power = match light {
            Light::Point {
                position,
                intensity,
                ..
            } => {
                finite3(what, "position", *position)?;
                intensity
            }
            Light::Directional {
                direction,
                irradiance,
            } => {
                finite3(what, "direction", *direction)?;
                if *direction == DVec3::ZERO {
                    return Err(SceneError::Degenerate {
                        what: what(),
                        why: "its direction is (0, 0, 0)".into(),
                    });
                }
                irradiance
            }
        };
        for v in power {
            finite(what, "intensity", &[f64::from(*v)])?;
            require(*v >= 0.0, what, "intensity", f64::from(*v), "0 or greater")?;
        }
    }
    Ok(())
}

fn cameras(scene: &Tables) -> Result<(), SceneError> {
    for (i, camera) in scene.cameras.rows.iter().enumerate() {
        let what = || format!("camera {}", scene.cameras.names.label(i as u32));
        finite3(what, "eye", camera.eye)?;
        let axes = [camera.right, camera.up, camera.forward];
        if axes.iter().any(|a| !a.is_finite() || !a.is_normalized()) {
            return Err(SceneError::Degenerate {
                what: what(),
                why: "it looks nowhere: eye and look_at must be two different, finite points"
                    .into(),
            });
        }
        let (field, half_height, must) = match camera.projection {
            Projection::Perspective { half_height } => {
                ("fov_y", half_height, "between 0 and 180 degrees")
            }
            Projection::Orthographic { half_height } => (
                "orthographic height",
                half_height,
                "greater than 0 and finite",
            ),
        };
        let ok = half_height > 0.0 && half_height.is_finite();
        require(ok, what, field, half_height, must)?;
    }
    Ok(())
}

/// Products along paths: each matrix is fine by itself, their product may
/// overflow, or lose an axis.
fn appearances(scene: &Tables) -> Result<(), SceneError> {
    let all = super::Appearances::of(scene)?;
    if all.is_empty() {
        return Err(SceneError::NothingToSee);
    }
    let singular = |shape: ShapeId| SceneError::SingularPath {
        what: shape_label(scene, shape.0),
    };
    // Bounds say so for nearly all scenes; else one must look.
    let Err(shape) = super::paths::stay_regular(scene) else {
        return Ok(());
    };
    if all.check_enumerable().is_err() {
        return Err(singular(shape));
    }
    let flat = |m: &crate::math::Affine| !m.is_finite() || m.norm() == 0.0;
    match all
        .iter(scene)
        .find(|row| flat(&row.object_from_world) || flat(&row.world_from_object))
    {
        Some(row) => Err(singular(row.shape)),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By its count alone: such a mesh would take gigabytes.
    #[test]
    fn a_mesh_of_too_many_triangles() {
        let what = || "mesh 'm'".to_string();
        assert_eq!(few_enough(what, MAX_TRIANGLES), Ok(()));
        let error = few_enough(what, MAX_TRIANGLES + 1).unwrap_err();
        assert!(
            error
                .to_string()
                .starts_with("mesh 'm' has 134217729 triangles")
        );
    }
}
