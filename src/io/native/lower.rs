//! From the typed file to the scene's tables: names become ids, choices are
//! checked, transforms are multiplied out.
//!
//! Nothing here recurses, and names are looked up in hash maps: a chain of a
//! million nodes is as good as any other file.

use super::lower_camera::camera;
use super::lower_looks::{environment, group, material};
use super::schema::{self, Named, Triple};
use super::schema_camera::Cameras;
use super::source_spans::At;
use super::tree::{Source, nearest, quoted};
use super::{
    lower_csg, lower_light, lower_pattern, lower_shape, lower_shutter, lower_texture, rotate,
};
use crate::math::Affine;
use crate::scene::{
    Edge, Entity, EntityKind, Interpolation, Key, LightId, Lit, MaterialId, NodeId, SceneBuilder,
    ShapeId,
};
use crate::{ImportReport, LoadError, LoadOptions};
use glam::DVec3;
use std::collections::HashMap;

pub(super) type Result<T> = std::result::Result<T, LoadError>;

/// Byte offsets of entities in the text, a column per kind, in the tables' order.
#[derive(Debug, Default)]
pub(super) struct Offsets {
    instances: Vec<usize>,
    nodes: Vec<usize>,
    edges: Vec<usize>,
    shapes: Vec<usize>,
    materials: Vec<usize>,
    lights: Vec<usize>,
    cameras: Vec<usize>,
    /// Those of the shapes that they belong to.
    meshes: Vec<usize>,
    background: Option<usize>,
}

impl Offsets {
    pub(super) fn of(&self, what: &Entity) -> Option<usize> {
        let column = match what.kind {
            EntityKind::Instance => &self.instances,
            EntityKind::Node => &self.nodes,
            EntityKind::Edge => &self.edges,
            EntityKind::Shape => &self.shapes,
            EntityKind::Material => &self.materials,
            EntityKind::Light => &self.lights,
            EntityKind::Camera => &self.cameras,
            EntityKind::Mesh => &self.meshes,
            EntityKind::Background => return self.background,
        };
        column.get(what.row as usize).copied()
    }
}

pub(super) fn lower(
    source: &Source,
    file: schema::File,
    options: &LoadOptions,
    scene: &mut SceneBuilder,
    report: &mut ImportReport,
) -> Result<Offsets> {
    let mut at = Offsets::default();
    if let Some(background) = file.background {
        scene.background(background.value);
        at.background = Some(background.at);
    }
    if let Some(seconds) = &file.seconds {
        if !(seconds.value > 0.0 && seconds.value.is_finite()) {
            let message = format!(
                "seconds = {}; a motion takes more than 0 seconds, and not forever",
                seconds.value
            );
            return Err(source.error(seconds.at, message));
        }
        scene.motion_takes(seconds.value);
    }
    if let Some(row) = &file.environment {
        let lights = scene.tables().lights.len() as u32;
        environment(source, row, (options, report), scene)?;
        let suns = lights..scene.tables().lights.len() as u32;
        let suns = suns.map(|row| Lit::Light(LightId(row)));
        let all = std::iter::once(Lit::Environment).chain(suns);
        group(source, &row.value.group, all, scene)?;
    }
    let Cameras(Named(rows)) = file.camera.unwrap_or_default();
    for (name, row) in &rows {
        let id = scene.camera(&name.value, camera(source, row)?);
        if let Some(motion) = &row.value.motion {
            scene.move_camera(id, &lower_shutter::camera_keys(source, &row.value, motion)?);
        }
        if let Some(shutter) = &row.value.shutter {
            scene.shutter(id, lower_shutter::shutter(source, shutter)?);
        }
        at.cameras.push(row.at);
    }
    for row in file.light.iter().flatten() {
        let light = lower_light::light(source, row)?;
        let id = scene.light(light);
        if let Some(motion) = &row.value.motion {
            scene.move_light(id, &lower_light::keys(source, light, motion)?);
        }
        group(source, &row.value.group, [Lit::Light(id)], scene)?;
        at.lights.push(row.at);
    }
    let Named(rows) = file.material.unwrap_or_default();
    let mut materials = HashMap::with_capacity(rows.len());
    let mut images = lower_texture::ImageFiles::new(source, options);
    let options = &LoadOptions {
        keeps_uvs: rows.iter().any(|(_, row)| lower_texture::has_textures(row)),
        ..options.clone()
    };
    for (name, row) in rows {
        at.materials.push(name.at);
        if lower_pattern::is_above_one(&row) {
            report.repair("base_color with a part above 1", 1);
        }
        let id = scene.material(&name.value, material(source, &row)?);
        group(source, &row.group, [Lit::Material(id)], scene)?;
        lower_texture::textures(source, &row, id, &mut images, scene)?;
        materials.insert(name.value, id);
    }
    let Named(rows) = file.shape.unwrap_or_default();
    let mut shapes: HashMap<String, ShapeId> = HashMap::with_capacity(rows.len());
    let mut csg_solids = Vec::new();
    let mut files = lower_shape::MeshFiles::new(source, options, images.into_store());
    for (name, row) in rows {
        let id = lower_shape::shape(
            source,
            &name,
            row,
            (&mut files, &materials),
            scene,
            report,
            &mut csg_solids,
        )?;
        // A clipped solid is three of them.
        at.shapes.resize(scene.tables().shapes.len(), name.at);
        at.meshes.resize(scene.tables().meshes.len(), name.at);
        shapes.insert(name.value, id);
    }
    let groups = file.node.unwrap_or_default();
    let nodes = declare(&groups, scene);
    at.nodes.extend(groups.0.iter().map(|(name, _)| name.at));
    let names = Names {
        source,
        materials,
        shapes,
        nodes,
    };
    lower_csg::join(&names, &csg_solids, scene)?;
    let mut edges = Vec::new();
    for (name, node) in &groups.0 {
        edges.clear();
        for row in &node.children {
            edges.push(edge(&names, row, scene)?);
            at.edges.push(row.at);
        }
        scene.set_children(names.nodes[&name.value], &edges);
    }
    for row in file.instance.iter().flatten() {
        let edge = edge(&names, row, scene)?;
        scene.instance("", edge);
        at.instances.push(row.at);
    }
    Ok(at)
}

/// Every node gets its id before any child is looked up.
fn declare(nodes: &Named<schema::Node>, scene: &mut SceneBuilder) -> HashMap<String, NodeId> {
    let names = nodes.0.iter().map(|(name, _)| &name.value);
    names
        .map(|name| (name.clone(), scene.declare_node(name)))
        .collect()
}

/// What a name may stand for.
pub(super) struct Names<'s> {
    pub source: &'s Source<'s>,
    pub materials: HashMap<String, MaterialId>,
    pub shapes: HashMap<String, ShapeId>,
    nodes: HashMap<String, NodeId>,
}

pub(super) fn find<I: Copy>(
    source: &Source,
    kind: &str,
    table: &HashMap<String, I>,
    name: &At<String>,
) -> Result<I> {
    find_at(source, kind, table, &name.value, name.at)
}

pub(super) fn find_at<I: Copy>(
    source: &Source,
    kind: &str,
    table: &HashMap<String, I>,
    name: &str,
    at: usize,
) -> Result<I> {
    table.get(name).copied().ok_or_else(|| {
        let shown = quoted(name);
        // Sorted, because the order of a hash map is another one each run.
        let mut known: Vec<&str> = table.keys().map(|k| &**k).collect();
        known.sort_unstable();
        let message = match nearest(name, known.into_iter()) {
            Some(like) => format!("there is no {kind} {shown}; did you mean {}?", quoted(like)),
            None => format!("there is no {kind} {shown}; define it as [{kind}.NAME]"),
        };
        source.error(at, message)
    })
}

fn edge(names: &Names, row: &At<schema::Child>, scene: &mut SceneBuilder) -> Result<Edge> {
    let child = &row.value;
    let edge = match (&child.shape, &child.node) {
        (Some(name), None) => Edge::shape(find(names.source, "shape", &names.shapes, name)?),
        (None, Some(name)) => Edge::node(find(names.source, "node", &names.nodes, name)?),
        (Some(_), Some(second)) => {
            let message = "both shape and node are given; an instance or child places one of them";
            return Err(names.source.error(second.at, message));
        }
        (None, None) => {
            let message = "neither shape nor node is given; name what is placed here";
            return Err(names.source.error(row.at, message));
        }
    };
    let edge = match &child.material {
        Some(name) => edge.material(find(names.source, "material", &names.materials, name)?),
        None => edge,
    };
    let local = match &child.transform {
        Some(steps) => transform(names.source, steps)?,
        None => Affine::IDENTITY,
    };
    let interpolation = match child.interpolation.as_ref().map(|row| row.value) {
        Some(schema::Interpolation::Rigid) => Interpolation::Rigid,
        Some(schema::Interpolation::Linear) | None => Interpolation::Linear,
    };
    let id = match (&child.motion, &child.interpolation) {
        (Some(motion), _) => scene.moving_by(interpolation, local, &keys(names.source, motion)?),
        (None, None) => scene.transform(local),
        (None, Some(row)) => {
            let message = "interpolation is how things move between the keys of a motion, and \
                           there is no motion here; give one, or leave it out";
            return Err(names.source.error(row.at, message));
        }
    };
    Ok(edge.transform(id))
}

/// In the order of their times.
fn keys(source: &Source, motion: &At<Vec<At<schema::Key>>>) -> Result<Vec<Key>> {
    if motion.value.is_empty() {
        let message = "motion has no keys; give one, such as { at = 1.0, transform = […] }, \
                       or leave it out";
        return Err(source.error(motion.at, message));
    }
    let mut keys: Vec<Key> = Vec::with_capacity(motion.value.len());
    for row in &motion.value {
        let schema::Key {
            at,
            transform: steps,
        } = &row.value;
        let (time, last) = (at.value, keys.last().map_or(0.0, |key| key.at));
        let message = if !(time > 0.0 && time <= 1.0) {
            format!("at = {time}; it must be above 0, where 'transform' holds, and at most 1")
        } else if time <= last {
            format!("at = {time} after {last}; give the keys in the order of their times")
        } else {
            let local = transform(source, steps)?;
            if local.inverse().is_some() {
                keys.push(Key { at: time, local });
                continue;
            }
            "the transform of this key is singular (a scale of 0, or a matrix that flattens \
             space); give every axis a size"
                .into()
        };
        let place = if time > last && time <= 1.0 {
            row.at
        } else {
            at.at
        };
        return Err(source.error(place, message));
    }
    Ok(keys)
}

/// The product of the steps, the first applied first.
pub(super) fn transform(source: &Source, steps: &[At<schema::Step>]) -> Result<Affine> {
    steps.iter().try_fold(Affine::IDENTITY, |before, row| {
        Ok(step(source, row)?.then_after(&before))
    })
}

fn step(source: &Source, row: &At<schema::Step>) -> Result<Affine> {
    let step = &row.value;
    let given = [
        ("translate", step.translate.is_some()),
        ("rotate_x", step.rotate_x.is_some()),
        ("rotate_y", step.rotate_y.is_some()),
        ("rotate_z", step.rotate_z.is_some()),
        ("rotate", step.rotate.is_some()),
        ("scale", step.scale.is_some()),
        ("matrix", step.matrix.is_some()),
    ];
    exactly_one(source, row.at, "a transform step", &given)?;
    if let Some(turn) = &step.rotate {
        let axis = not_zero(source, "axis", &turn.axis)?;
        return Ok(rotate::about(axis, turn.degrees));
    }
    let turns = [step.rotate_x, step.rotate_y, step.rotate_z];
    let turn = turns
        .into_iter()
        .enumerate()
        .find_map(|(k, d)| Some((k, d?)));
    let maps = [
        step.translate.map(rotate::translation),
        step.scale.map(|s| rotate::scaling(s.0)),
        step.matrix.map(rotate::from_rows),
        turn.map(|(k, degrees)| rotate::about_axis(k, degrees)),
    ];
    Ok(maps
        .into_iter()
        .flatten()
        .next()
        .unwrap_or(Affine::IDENTITY))
}

/// Of several keys that exclude each other, exactly one must be there.
pub(super) fn exactly_one(
    source: &Source,
    at: usize,
    what: &str,
    given: &[(&'static str, bool)],
) -> Result<&'static str> {
    let mut found = given.iter().filter(|(_, is)| *is);
    match (found.next(), found.next()) {
        (Some((one, _)), None) => Ok(one),
        _ => Err(not_one(source, at, what, given)),
    }
}

pub(super) fn not_one(source: &Source, at: usize, what: &str, given: &[(&str, bool)]) -> LoadError {
    let names = |is: bool| {
        let names = given.iter().filter(|(_, given)| *given == is);
        names.map(|(name, _)| *name).collect::<Vec<_>>()
    };
    let message = match names(true).as_slice() {
        [] => format!("{what} is empty; give one of {}", names(false).join(", ")),
        several => format!(
            "{what} has {} at once; give exactly one",
            several.join(" and ")
        ),
    };
    source.error(at, message)
}

pub(super) fn not_zero(source: &Source, what: &str, v: &At<Triple>) -> Result<DVec3> {
    if v.value == [0.0; 3] {
        return Err(source.error(
            v.at,
            format!("{what} is (0, 0, 0); it must point somewhere"),
        ));
    }
    Ok(DVec3::from_array(v.value))
}
