//! The node graph: transforms, meshes by need, cameras and lights in world space.
//!
//! Nodes must form a forest, as the specification says. Walks use a list instead of
//! recursion, so a hierarchy may be a million deep. Only meshes that the scene shows are
//! decoded, and nodes with nothing to show are not imported. A scene has no singular
//! transform, so a mesh below a node that is flat is copied flat.

use super::File;
use super::camera::camera;
use super::container::Placement;
use super::light::light;
use super::material::Materials;
use super::meshes::Meshes;
use super::motion::Motion;
use super::placement::{Extent, instances, local_transform};
use super::points::PointMeshes;
use crate::math::Affine;
use crate::scene::{Edge, SceneBuilder};
use crate::shared::messages::one_line;
use crate::shared::points::Drawn;
use crate::{ImportReport, LoadError};
use serde_json::Value;
use std::collections::HashMap;

/// The parent of a root.
pub(super) const NO_PARENT: u32 = u32::MAX;

/// Imports the nodes of the scene to show, placed as at the motion's beginning. Returns their points
/// and lines, if these are wanted. Fails for references that do not exist, nodes
/// with two parents, cycles, and malformed transforms, skins, cameras or lights.
pub(super) fn import(
    file: &File,
    motion: &Motion,
    materials: &Materials,
    scene: &mut SceneBuilder,
    report: &mut ImportReport,
) -> Result<Vec<Drawn>, LoadError> {
    let parents = parents(file)?;
    let roots = roots(file, &parents)?;
    let order = parents_first(file, &roots);
    let placed = Placed::new(
        file,
        &motion.start,
        &|n| motion.moves(n),
        (&parents, &order),
        report,
    )?;

    // Lights, parents before children; cameras as the file lists them.
    let there = || order.iter().filter(|n| !placed.vanished[**n as usize]);
    for node in there()
        .map(|n| *n as usize)
        .filter(|n| !placed.invisible[*n])
    {
        let worlds = || motion.worlds(file, node, &parents, placed.world[node]);
        if has_light(file, node) {
            light(file, node, &worlds()?, scene, report)?;
        }
    }
    let number = |n: u32| {
        file.root.nodes[n as usize]
            .camera
            .map(|camera| camera.value())
    };
    let mut seen: Vec<u32> = there().copied().filter(|n| number(*n).is_some()).collect();
    seen.sort_unstable_by_key(|n| (number(*n), *n));
    for node in seen.into_iter().map(|n| n as usize) {
        let worlds = motion.worlds(file, node, &parents, placed.world[node])?;
        camera(file, node, &worlds, scene, report)?;
    }

    let mut meshes = Meshes::new(file, materials, motion);
    // Meshes are imported in the order of the nodes in the file, so that ids do not depend
    // on the graph.
    let mut shown: Vec<u32> = order.clone();
    shown.retain(|n| !placed.invisible[*n as usize]);
    shown.sort_unstable();
    let mut own: Vec<Option<Edge>> = vec![None; placed.local.len()];
    let mut several: HashMap<usize, Vec<Edge>> = HashMap::new();
    let mut skinned = Vec::new();
    let mut points = PointMeshes::default();
    for node in shown.iter().map(|n| *n as usize) {
        let source = &file.root.nodes[node];
        let Some(mesh) = source.mesh.map(|mesh| mesh.value()) else {
            continue;
        };
        if file.wants_points {
            let world = placed.world[node];
            let copies = instances(file, node, &|| label(file, node))?;
            let maps: Vec<Affine> = match copies {
                Some(copies) => copies.iter().map(|copy| world.then_after(copy)).collect(),
                None => vec![world],
            };
            if points.add(file, mesh, materials, &maps, report)? && motion.any_moves() {
                report.add("motion of points or lines");
            }
        }
        // The skin of a file that lacks what it needs is not imported.
        let skin = source.skin.map(|skin| skin.value());
        if let Some(skin) = skin.filter(|skin| *skin < file.root.skins.len()) {
            meshes.read_poses(skin, &parents)?;
            if let Some(shape) = meshes.shape(node, mesh, Some(skin), scene, report)? {
                skinned.push((node, shape));
            }
            continue;
        }
        if placed.vanished[node] {
            continue;
        }
        let instances = instances(file, node, &|| label(file, node))?;
        if instances.is_none() && placed.flat[node].is_none() {
            let shape = meshes.shape(node, mesh, None, scene, report)?;
            own[node] = shape.map(Edge::shape);
            continue;
        }
        let mut edges = Vec::new();
        for instance in instances.unwrap_or_else(|| vec![Affine::IDENTITY]) {
            let map = match &placed.flat[node] {
                Some(flat) => flat.then_after(&instance),
                None => instance,
            };
            let edge = match Extent::of(&map) {
                Extent::Nothing => {
                    report.add("instance scaled to nothing");
                    None
                }
                Extent::Flat => meshes
                    .flat(node, mesh, &map, scene, report)?
                    .map(Edge::shape),
                Extent::Solid => {
                    let shape = meshes.shape(node, mesh, None, scene, report)?;
                    shape.map(|shape| Edge::shape(shape).transform(scene.transform(map)))
                }
            };
            edges.extend(edge);
        }
        several.insert(node, edges);
    }

    // Edges, children before parents.
    let mut edges: Vec<Option<Edge>> = vec![None; placed.local.len()];
    for node in order.iter().rev().map(|n| *n as usize) {
        if placed.vanished[node] || placed.invisible[node] {
            continue;
        }
        let source = &file.root.nodes[node];
        let mut all = several.remove(&node).unwrap_or_default();
        all.extend(own[node]);
        let is_one_shape = own[node].is_some() && all.len() == 1;
        let below = source.children.iter().flatten();
        let first = all.len();
        all.extend(below.filter_map(|c| edges[c.value()]));
        let edge = match own[node] {
            _ if all.is_empty() => continue,
            Some(shape) if is_one_shape && all.len() == first => shape,
            _ => Edge::node(scene.node(&name(file, node), &all)),
        };
        // What is below a flat node has been moved to the space of the node above.
        edges[node] = Some(match placed.flat[node] {
            Some(_) => edge,
            None => {
                edge.transform(motion.transform(file, node, placed.local[node], scene, report)?)
            }
        });
    }
    for root in roots {
        if let Some(edge) = edges[root as usize] {
            scene.instance(&name(file, root as usize), edge);
        }
    }
    for (node, shape) in skinned {
        scene.instance(&name(file, node), Edge::shape(shape));
    }
    Ok(points.drawn)
}

/// Where nodes are, and which of them show nothing; a row for each node of the file, filled
/// for those of the scene.
struct Placed {
    local: Vec<Affine>,
    world: Vec<Affine>,
    /// Of nodes that one direction is scaled to 0 for, and all below: the map to the space
    /// of the last node above that is not flat.
    flat: Vec<Option<Affine>>,
    /// Whether a node is scaled to a line or a point, or one above it.
    vanished: Vec<bool>,
    /// Whether a node is made invisible, or one above it.
    invisible: Vec<bool>,
}

impl Placed {
    fn new(
        file: &File,
        placements: &[Placement],
        moving: &dyn Fn(usize) -> bool,
        (parents, order): (&[u32], &[u32]),
        report: &mut ImportReport,
    ) -> Result<Placed, LoadError> {
        let count = file.root.nodes.len();
        let mut all = Placed {
            local: vec![Affine::IDENTITY; count],
            world: vec![Affine::IDENTITY; count],
            flat: vec![None; count],
            vanished: vec![false; count],
            invisible: vec![false; count],
        };
        for node in order.iter().map(|n| *n as usize) {
            let label = || label(file, node);
            let local = local_transform(file, &label, &placements[node], report)?;
            all.local[node] = local;
            all.world[node] = local;
            let mut flat = None;
            if parents[node] != NO_PARENT {
                let above = parents[node] as usize;
                all.world[node] = all.world[above].then_after(&local);
                all.vanished[node] = all.vanished[above];
                all.invisible[node] = all.invisible[above];
                flat = all.flat[above];
            }
            if !all.invisible[node] && is_hidden(file, node) {
                all.invisible[node] = true;
                report.add("hidden node");
            }
            if all.vanished[node] || flat.is_none() && Extent::of(&local) == Extent::Solid {
                continue;
            }
            let map = flat.map_or(local, |flat| flat.then_after(&local));
            if Extent::of(&map) == Extent::Nothing {
                all.vanished[node] = true;
                report.add("node scaled to nothing");
            }
            all.flat[node] = Some(map);
            let moves = moving(node);
            report.add_many("animation of a node that is flat", usize::from(moves));
        }
        Ok(all)
    }
}

/// Whether a node hides itself and what is below (KHR_node_visibility).
fn is_hidden(file: &File, node: usize) -> bool {
    let extensions = file.root.nodes[node].extensions.as_ref();
    let visibility = extensions.and_then(|e| e.others.get("KHR_node_visibility"));
    let visible = visibility.and_then(|v| v.get("visible"));
    visible.and_then(Value::as_bool) == Some(false)
}

/// Computes the transforms of all nodes of the file to the world, for joints.
pub(super) fn all_worlds(
    file: &File,
    placements: &[Placement],
    parents: &[u32],
) -> Result<Vec<Affine>, LoadError> {
    let tops = (0..parents.len() as u32).filter(|n| parents[*n as usize] == NO_PARENT);
    let order = parents_first(file, &tops.collect::<Vec<_>>());
    // What is repaired or left out of them is reported already.
    let mut unused = ImportReport::default();
    let placed = Placed::new(file, placements, &|_| false, (parents, &order), &mut unused)?;
    Ok(placed.world)
}

/// Says whether a node has a light.
fn has_light(file: &File, node: usize) -> bool {
    let extensions = file.root.nodes[node].extensions.as_ref();
    extensions.is_some_and(|e| e.khr_lights_punctual.is_some())
}

/// The name of a node, maybe empty.
pub(super) fn name(file: &File, node: usize) -> String {
    one_line(file.root.nodes[node].name.as_deref().unwrap_or_default())
}

/// A node as messages name it: `node 3 'wheel'`.
pub(super) fn label(file: &File, node: usize) -> String {
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
                let (one, other) = (label(file, *parent as usize), label(file, node));
                let message =
                    format!("is a child of {one} and of {other}; a node has one parent at most");
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
