//! The node graph: transforms, meshes by need, cameras and lights in world space.
//!
//! Nodes must form a forest, as the specification says. Walks use a list instead of
//! recursion, so a hierarchy may be a million deep. Only meshes that the scene shows are
//! decoded, and nodes with nothing to show are not imported.

use super::container::Placement;
use super::{File, mesh};
use crate::math::Affine;
use crate::scene::{Camera, Edge, Falloff, Light, MaterialId, SceneBuilder, ShapeId};
use crate::shared::mesh_cleanup::unit;
use crate::shared::messages::one_line;
use crate::{ImportReport, LoadError};
use glam::{DMat3, DQuat, DVec3};
use gltf::json::camera::Type as CameraType;
use gltf::json::extensions::scene::khr_lights_punctual::Type as LightType;
use gltf::json::validation::Checked;

/// The parent of a root.
const NO_PARENT: u32 = u32::MAX;

/// Imports the nodes of the scene to show. Fails for references that do not exist, nodes
/// with two parents, cycles, and malformed transforms, cameras or lights.
pub(super) fn import(
    file: &File,
    placements: &[Placement],
    materials: &[MaterialId],
    scene: &mut SceneBuilder,
    report: &mut ImportReport,
) -> Result<(), LoadError> {
    let parents = parents(file)?;
    let roots = roots(file, &parents)?;
    let order = parents_first(file, &roots);

    // Local transforms; a subtree scaled to a point is hidden.
    let count = file.root.nodes.len();
    let mut local = vec![Affine::IDENTITY; count];
    let mut hidden = vec![false; count];
    for node in order.iter().map(|n| *n as usize) {
        local[node] = local_transform(file, node, &placements[node])?;
        let above = parents[node];
        hidden[node] = above != NO_PARENT && hidden[above as usize];
        if !hidden[node] && local[node].linear() == &[[0.0; 3]; 3] {
            hidden[node] = true;
            report.add("node scaled to nothing");
        }
    }

    // Lights, parents before children.
    let mut world = vec![Affine::IDENTITY; count];
    for node in order.iter().map(|n| *n as usize).filter(|n| !hidden[*n]) {
        world[node] = match parents[node] {
            NO_PARENT => local[node],
            above => world[above as usize].then_after(&local[node]),
        };
        light(file, node, &world[node], scene, report)?;
    }
    // Cameras are numbered as the file lists them.
    let mut seen: Vec<u32> = order.clone();
    seen.retain(|n| !hidden[*n as usize] && file.root.nodes[*n as usize].camera.is_some());
    seen.sort_unstable_by_key(|n| (file.root.nodes[*n as usize].camera.map(|c| c.value()), *n));
    for node in seen.into_iter().map(|n| n as usize) {
        camera(file, node, &world[node], scene, report)?;
    }
    drop(world);

    // Edges, children before parents.
    let mut shapes: Vec<Option<Option<ShapeId>>> = vec![None; file.root.meshes.len()];
    // Meshes are imported in the order of the nodes in the file, so that ids do not depend
    // on the graph.
    let mut shown: Vec<u32> = order.clone();
    shown.retain(|n| !hidden[*n as usize]);
    shown.sort_unstable();
    for node in shown.iter().map(|n| *n as usize) {
        let Some(mesh) = file.root.nodes[node].mesh else {
            continue;
        };
        let Some(source) = file.root.meshes.get(mesh.value()) else {
            let all = file.root.meshes.len();
            let message = format!("refers to mesh {}, but there are {all}", mesh.value());
            return Err(file.invalid(&label(file, node), &message));
        };
        if shapes[mesh.value()].is_none() {
            let name = one_line(source.name.as_deref().unwrap_or_default());
            let label = match &*name {
                "" => format!("mesh {}", mesh.value()),
                name => format!("mesh {} '{name}'", mesh.value()),
            };
            let data = mesh::read(file, source, &label, materials, report)?;
            check_room(file, scene, &data, &label)?;
            let shape = (!data.triangles.is_empty()).then(|| scene.mesh(&name, &data));
            shapes[mesh.value()] = Some(shape);
        }
    }
    let mut edges: Vec<Option<Edge>> = vec![None; count];
    for node in order.iter().rev().map(|n| *n as usize) {
        if hidden[node] {
            continue;
        }
        let source = &file.root.nodes[node];
        let shape = source.mesh.and_then(|m| shapes[m.value()].flatten());
        let below = source.children.iter().flatten();
        let mut below: Vec<Edge> = below.filter_map(|c| edges[c.value()]).collect();
        let edge = match (shape, below.is_empty()) {
            (None, true) => continue,
            (Some(shape), true) => Edge::shape(shape),
            (shape, false) => {
                below.splice(0..0, shape.map(Edge::shape));
                Edge::node(scene.node(&name(file, node), &below))
            }
        };
        edges[node] = Some(edge.transform(scene.transform(local[node])));
    }
    for root in roots {
        if let Some(edge) = edges[root as usize] {
            scene.instance(&name(file, root as usize), edge);
        }
    }
    Ok(())
}

/// The name of a node, maybe empty.
fn name(file: &File, node: usize) -> String {
    one_line(file.root.nodes[node].name.as_deref().unwrap_or_default())
}

/// A node as messages name it: `node 3 'wheel'`.
fn label(file: &File, node: usize) -> String {
    match &*name(file, node) {
        "" => format!("node {node}"),
        name => format!("node {node} '{name}'"),
    }
}

/// Finds the parent of each node. Fails if a node has two parents or is its own descendant.
fn parents(file: &File) -> Result<Vec<u32>, LoadError> {
    let nodes = &file.root.nodes;
    let mut parents = vec![NO_PARENT; nodes.len()];
    for (node, source) in nodes.iter().enumerate() {
        for child in source.children.iter().flatten() {
            let Some(parent) = parents.get_mut(child.value()) else {
                let (child, all) = (child.value(), nodes.len());
                let message = format!("refers to child node {child}, but there are {all}");
                return Err(file.invalid(&label(file, node), &message));
            };
            if *parent != NO_PARENT {
                let message = format!(
                    "is a child of node {parent} and of node {node}; a node has one parent at most"
                );
                return Err(file.invalid(&label(file, child.value()), &message));
            }
            *parent = node as u32;
        }
    }
    // Each node has at most one parent, so the way up from a node that no root reaches
    // ends in a cycle.
    let tops = (0..nodes.len() as u32).filter(|n| parents[*n as usize] == NO_PARENT);
    let reached = parents_first(file, &tops.collect::<Vec<_>>());
    if reached.len() < nodes.len() {
        let mut seen = vec![false; nodes.len()];
        reached.iter().for_each(|n| seen[*n as usize] = true);
        let mut at = seen.iter().position(|s| !s).unwrap_or(0);
        while !seen[at] {
            seen[at] = true;
            at = parents[at] as usize;
        }
        return Err(file.invalid(&label(file, at), "is its own descendant"));
    }
    Ok(parents)
}

/// Lists the roots of the scene to show: the default scene, or else the first one. In a
/// file without scenes every node without parent is a root.
fn roots(file: &File, parents: &[u32]) -> Result<Vec<u32>, LoadError> {
    let scenes = &file.root.scenes;
    let id = file.root.scene.map_or(0, |s| s.value());
    let Some(scene) = scenes.get(id) else {
        if file.root.scene.is_some() {
            let message = format!("is {id}, but there are {} scenes", scenes.len());
            return Err(file.invalid("scene", &message));
        }
        let all = 0..parents.len() as u32;
        return Ok(all.filter(|n| parents[*n as usize] == NO_PARENT).collect());
    };
    let mut listed = vec![false; parents.len()];
    let mut roots = Vec::with_capacity(scene.nodes.len());
    for node in &scene.nodes {
        let wrong = |why: &str| file.invalid(&format!("scene {id}"), why);
        let node = node.value();
        let parent = parents.get(node).ok_or_else(|| {
            let all = parents.len();
            wrong(&format!("refers to node {node}, but there are {all}"))
        })?;
        if *parent != NO_PARENT {
            let why =
                format!("lists node {node}, which is not a root but a child of node {parent}");
            return Err(wrong(&why));
        }
        if std::mem::replace(&mut listed[node], true) {
            return Err(wrong(&format!("lists node {node} twice")));
        }
        roots.push(node as u32);
    }
    Ok(roots)
}

/// Lists the roots and all nodes below them, each after its parent.
fn parents_first(file: &File, roots: &[u32]) -> Vec<u32> {
    let mut order = roots.to_vec();
    let mut next = 0;
    while let Some(node) = order.get(next) {
        let children = file.root.nodes[*node as usize].children.iter().flatten();
        order.extend(children.map(|c| c.value() as u32));
        next += 1;
    }
    order
}

/// Computes a node's transform to its parent in f64: its matrix, or translation · rotation ·
/// scale. Fails if the matrix is not affine or the rotation is 0.
fn local_transform(file: &File, node: usize, p: &Placement) -> Result<Affine, LoadError> {
    if let Some(m) = p.matrix {
        if [m[3], m[7], m[11], m[15]] != [0.0, 0.0, 0.0, 1.0] {
            let message = "its matrix is not affine: the last row must be 0 0 0 1";
            return Err(file.invalid(&label(file, node), message));
        }
        let linear = [[m[0], m[1], m[2]], [m[4], m[5], m[6]], [m[8], m[9], m[10]]];
        return Ok(Affine::new(linear, [m[12], m[13], m[14]]));
    }
    let [x, y, z, w] = p.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]);
    // Files round quaternions, which should have length 1, to f32. The division by the
    // largest component keeps the squares within range.
    let size = [x, y, z, w].iter().fold(0.0_f64, |a, c| a.max(c.abs()));
    if size == 0.0 {
        return Err(file.invalid(&label(file, node), "its rotation is 0 0 0 0"));
    }
    let rotation = DQuat::from_array([x, y, z, w].map(|c| c / size)).normalize();
    let columns = DMat3::from_quat(rotation).to_cols_array_2d();
    let scale = p.scale.unwrap_or([1.0; 3]);
    let linear = [0, 1, 2].map(|c| columns[c].map(|x| x * scale[c]));
    Ok(Affine::new(linear, p.translation.unwrap_or([0.0; 3])))
}

/// Adds the camera of a node, if it has one. A camera looks along -z of its node, with +y up;
/// the node's scale is ignored.
fn camera(
    file: &File,
    node: usize,
    world: &Affine,
    scene: &mut SceneBuilder,
    report: &mut ImportReport,
) -> Result<(), LoadError> {
    let Some(id) = file.root.nodes[node].camera else {
        return Ok(());
    };
    let cameras = &file.root.cameras;
    let Some(source) = cameras.get(id.value()) else {
        let message = format!(
            "refers to camera {}, but there are {}",
            id.value(),
            cameras.len()
        );
        return Err(file.invalid(&label(file, node), &message));
    };
    // The pose is computed at the origin, because at a far eye the point to look at would
    // round the direction.
    let forward = DVec3::from_array(world.vector([0.0, 0.0, -1.0]));
    let up = DVec3::from_array(world.vector([0.0, 1.0, 0.0]));
    let place = format!("camera {}", id.value());
    let posed = match (&source.type_, &source.perspective, &source.orthographic) {
        (Checked::Valid(CameraType::Perspective), Some(p), _) => {
            let fov = f64::from(p.yfov).to_degrees();
            if fov >= 180.0 {
                report.add("camera with a field of view of 180 degrees or more");
                return Ok(());
            }
            Camera::perspective(DVec3::ZERO, forward, up, fov)
        }
        (Checked::Valid(CameraType::Orthographic), _, Some(o)) => {
            let height = 2.0 * f64::from(o.ymag).abs();
            Camera::orthographic(DVec3::ZERO, forward, up, height)
        }
        _ => {
            let message =
                "its type must be 'perspective' or 'orthographic', with the property of that name";
            return Err(file.invalid(&place, message));
        }
    };
    let eye = DVec3::from_array(world.translation);
    let own = one_line(source.name.as_deref().unwrap_or_default());
    let name = if own.is_empty() {
        name(file, node)
    } else {
        own
    };
    scene.camera(&name, Camera { eye, ..posed });
    Ok(())
}

/// Adds the light of a node, if it has one: a directional light along -z of the node, or a
/// point light at its origin. The cones of spot lights are not supported.
fn light(
    file: &File,
    node: usize,
    world: &Affine,
    scene: &mut SceneBuilder,
    report: &mut ImportReport,
) -> Result<(), LoadError> {
    let extensions = file.root.nodes[node].extensions.as_ref();
    let Some(id) = extensions.and_then(|e| e.khr_lights_punctual.as_ref()) else {
        return Ok(());
    };
    let id = id.light.value();
    let extensions = file.root.extensions.as_ref();
    let lights = extensions.and_then(|e| e.khr_lights_punctual.as_ref());
    let lights = lights.map_or(&[][..], |l| &l.lights);
    let Some(source) = lights.get(id) else {
        let message = format!("refers to light {id}, but there are {}", lights.len());
        return Err(file.invalid(&label(file, node), &message));
    };
    let power = source.color.map(|c| c * source.intensity);
    match source.type_ {
        Checked::Valid(LightType::Directional) => {
            let travels = DVec3::from_array(world.vector([0.0, 0.0, -1.0]));
            scene.light(Light::Directional {
                direction: unit(travels).unwrap_or(travels),
                irradiance: power,
            });
        }
        Checked::Valid(kind) => {
            if kind == LightType::Spot {
                report.add("spot light cone");
            }
            scene.light(Light::Point {
                position: DVec3::from_array(world.translation),
                intensity: power,
                falloff: Falloff::InverseSquare,
            });
        }
        Checked::Invalid => report.add("light of an unknown type"),
    }
    if source.range.is_some() {
        report.add("light range");
    }
    Ok(())
}

/// Checks that a mesh fits into the scene, whose tables count all vertices and all triangles
/// in u32.
fn check_room(
    file: &File,
    scene: &SceneBuilder,
    data: &crate::scene::MeshData,
    label: &str,
) -> Result<(), LoadError> {
    let meshes = &scene.tables().meshes;
    let most = u32::MAX as usize;
    if meshes.positions.len() + data.positions.len() > most
        || meshes.triangles.len() + data.triangles.len() > most
    {
        return Err(file.invalid(label, "the scene has more triangles than u32 can count"));
    }
    Ok(())
}
