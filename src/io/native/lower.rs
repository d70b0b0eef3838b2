//! From the typed files to the scene's tables: names become ids, choices are
//! checked, transforms are multiplied out.
//!
//! Nothing here recurses but the reading of placed files, to a bounded depth, and names are looked
//! up in hash maps: a chain of a million nodes is as good as any other file.

use super::files::Files;
use super::include::{Defined, Unit};
use super::lower_camera::camera;
use super::lower_looks::{environment, group, material, sky};
use super::lower_placement::Placements;
use super::places::{FilePlaces, Offsets};
use super::schema::{Named, Triple};
use super::schema_camera::Cameras;
use super::source_spans::At;
use super::tree::{Source, nearest, quoted};
use super::{
    lower_csg, lower_light, lower_pattern, lower_shape, lower_shutter, lower_texture, lower_views,
};
use crate::scene::{EntityKind, Lit, MaterialId, NodeId, SceneBuilder, ShapeId};
use crate::{ImportReport, LoadError, LoadOptions};
use glam::DVec3;
use std::collections::HashMap;

pub(super) type Result<T> = std::result::Result<T, LoadError>;

/// Adds a file to the scene: the definitions of all units, and the rest of the last of them, which
/// is the file itself and includes the others.
pub(super) fn lower(
    mut units: Vec<Unit>,
    options: &LoadOptions,
    files: &mut Files,
    scene: &mut SceneBuilder,
    report: &mut ImportReport,
) -> Result<()> {
    let mut at: Vec<Offsets> = units.iter().map(|_| Offsets::default()).collect();
    let own = units.len() - 1;
    let cameras = units[own].file.camera.take().unwrap_or_default();
    if files.is_placing()
        && let Some(lights) = &mut units[own].file.light
    {
        // A sky would add its sun to the lights, which come along.
        let all = lights.len();
        lights.retain(|row| row.value.environment.is_none() && row.value.sky.is_none());
        report.add_many("environment of a placed file", all - lights.len());
    }
    seen_by(&units[own], cameras, (options, report), scene, &mut at[own])?;
    let has_textures = |unit: &Unit| {
        let materials = unit.file.material.iter().flat_map(|all| &all.0);
        materials
            .into_iter()
            .any(|(_, row)| lower_texture::has_textures(row))
    };
    let has_normal_maps = |unit: &Unit| {
        let mut materials = unit.file.material.iter().flat_map(|all| &all.0);
        materials.any(|(_, row)| row.normal_texture.is_some())
    };
    let options = &LoadOptions {
        keeps_uvs: options.keeps_uvs || units.iter().any(has_textures),
        keeps_tangents: units.iter().any(has_normal_maps),
        ..options.clone()
    };

    let mut materials = HashMap::new();
    let mut defined = Defined::default();
    for k in 0..units.len() {
        let Named(rows) = units[k].file.material.take().unwrap_or_default();
        let source = units[k].source();
        let mut images = lower_texture::ImageFiles::new(&source, options, &mut files.images);
        for (name, row) in rows {
            defined.check("material", (&units, k), &name)?;
            let first = scene.tables().materials.len();
            at[k].note(EntityKind::Material, first..first + 1, name.at);
            if lower_pattern::is_above_one(&row) {
                report.repair("base_color with a part above 1", 1);
            }
            let id = scene.material(&name.value, material(&source, &row)?);
            group(&source, &row.group, [Lit::Material(id)], scene)?;
            lower_texture::textures(&source, &row, id, &mut images, scene)?;
            materials.insert(name.value, id);
        }
    }

    let mut shapes: HashMap<String, ShapeId> = HashMap::new();
    let mut csg_solids: Vec<Vec<_>> = Vec::with_capacity(units.len());
    let mut meshes = lower_shape::MeshFiles::new(options, &mut files.images);
    for k in 0..units.len() {
        let Named(rows) = units[k].file.shape.take().unwrap_or_default();
        let source = units[k].source();
        let mut solids = Vec::new();
        meshes.enter(&source);
        for (name, row) in rows {
            defined.check("shape", (&units, k), &name)?;
            let before = scene.row_counts();
            let id = lower_shape::shape(
                &source,
                &name,
                row,
                (&mut meshes, &materials),
                scene,
                report,
                &mut solids,
            )?;
            // A clipped solid is three of them.
            let after = scene.row_counts();
            at[k].note(EntityKind::Shape, before.shapes..after.shapes, name.at);
            at[k].note(EntityKind::Mesh, before.meshes..after.meshes, name.at);
            shapes.insert(name.value, id);
        }
        csg_solids.push(solids);
    }

    // Every node gets its id before any child is looked up.
    let mut nodes: HashMap<String, NodeId> = HashMap::new();
    let first_node = scene.tables().nodes.len() as u32;
    for (k, unit) in units.iter().enumerate() {
        for (name, _) in unit.file.node.iter().flat_map(|all| &all.0) {
            defined.check("node", (&units, k), name)?;
            let id = scene.declare_node(&name.value);
            at[k].note(EntityKind::Node, id.index()..id.index() + 1, name.at);
            nodes.insert(name.value.clone(), id);
        }
    }
    let own_nodes = (first_node..scene.tables().nodes.len() as u32).map(NodeId);

    let mut placements = Placements::new(options, files);
    let mut edges = Vec::new();
    for (k, unit) in units.iter().enumerate() {
        let (source, file) = (unit.source(), &unit.file);
        let names = Names {
            source: &source,
            materials: &materials,
            shapes: &shapes,
            nodes: &nodes,
        };
        lower_csg::join(&names, &csg_solids[k], scene)?;
        for (name, node) in file.node.iter().flat_map(|all| &all.0) {
            edges.clear();
            let mut ends = Vec::with_capacity(node.children.len());
            for row in &node.children {
                if let Some(name) = &row.value.name {
                    let message = "only instances have names; a child is called as what it places";
                    return Err(source.error(name.at, message));
                }
                placements.edges(&names, row, (scene, report), &mut edges)?;
                ends.push((edges.len(), row.at));
            }
            let first = scene.tables().edges.len();
            let mut begin = 0;
            for (end, place) in ends {
                at[k].note(EntityKind::Edge, first + begin..first + end, place);
                begin = end;
            }
            scene.set_children(nodes[&name.value], &edges);
        }
        if k != own {
            continue;
        }
        for row in file.instance.iter().flatten() {
            edges.clear();
            placements.edges(&names, row, (scene, report), &mut edges)?;
            let first = scene.tables().roots.len();
            at[k].note(EntityKind::Instance, first..first + edges.len(), row.at);
            let name = row.value.name.as_ref().map_or("", |name| &name.value);
            for (copy, edge) in edges.iter().enumerate() {
                match edges.len() > 1 && !name.is_empty() {
                    true => scene.instance(&format!("{name}_{copy}"), *edge),
                    false => scene.instance(name, *edge),
                };
            }
        }
    }
    let placed = placements.placed();
    let source = units[own].source();
    lower_views::views(&source, own_nodes, &placed, (scene, report), &mut at[own])?;
    for (unit, at) in units.into_iter().zip(at) {
        let Unit { path, text, .. } = unit;
        files.add_places(FilePlaces::Text {
            path,
            text,
            at: Box::new(at),
        });
    }
    Ok(())
}

/// Adds what a file's own picture is seen by: background, environment, cameras, lights.
fn seen_by(
    unit: &Unit,
    Cameras(Named(cameras)): Cameras,
    (options, report): (&LoadOptions, &mut ImportReport),
    scene: &mut SceneBuilder,
    at: &mut Offsets,
) -> Result<()> {
    let (source, file) = (&unit.source(), &unit.file);
    if let Some(background) = &file.background {
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
    if let (Some(shutter), true) = (&file.shutter, cameras.is_empty()) {
        let message = "a shutter is of cameras, and this file has none; give it a [camera], or ask for \
                       --shutter";
        return Err(source.error(shutter.at, message));
    }
    for (name, row) in &cameras {
        let id = scene.camera(&name.value, camera(source, row)?);
        if let Some(motion) = &row.value.motion {
            scene.move_camera(id, &lower_shutter::camera_keys(source, &row.value, motion)?);
        }
        if let Some(shutter) = row.value.shutter.as_ref().or(file.shutter.as_ref()) {
            scene.shutter(id, lower_shutter::shutter(source, shutter)?);
        }
        at.note(EntityKind::Camera, id.0 as usize..id.0 as usize + 1, row.at);
    }
    for row in file.light.iter().flatten() {
        lower_light::check_kind(source, row)?;
        let At { at: place, value } = row;
        let surrounds = value.environment.is_some() || value.sky.is_some();
        if surrounds && scene.tables().environment.is_some() {
            let message =
                "a scene has one environment or one sky, and this is another; leave it out";
            return Err(source.error(*place, message));
        }
        let light = match (&value.environment, &value.sky) {
            (Some(map), _) => {
                environment(source, map, (options, report), scene)?;
                None
            }
            (_, Some(row)) => Some(sky(source, row, scene)?),
            _ => Some(lower_light::light(source, row)?),
        };
        let mut lit: Vec<Lit> = surrounds.then_some(Lit::Environment).into_iter().collect();
        if let Some(light) = light {
            let id = scene.light(light);
            if let Some(motion) = &value.motion {
                scene.move_light(id, &lower_light::keys(source, row, (light, motion))?);
            }
            lit.push(Lit::Light(id));
            at.note(EntityKind::Light, id.index()..id.index() + 1, *place);
        }
        group(source, &value.name, lit, scene)?;
    }
    Ok(())
}

/// What a name may stand for.
pub(super) struct Names<'s> {
    /// The file whose names are looked up.
    pub source: &'s Source<'s>,
    pub materials: &'s HashMap<String, MaterialId>,
    pub shapes: &'s HashMap<String, ShapeId>,
    pub nodes: &'s HashMap<String, NodeId>,
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
