//! Lights and cameras of placed files: a light for each way from an instance down to the file, and
//! the cameras of the first.
//!
//! The scene's tables have lights and cameras in world space only, so the ways through the graph
//! are followed here, once each, to a limit.

use super::files::PlacedFile;
use super::lower::Result;
use super::moved_views::{moved_camera, moved_key, moved_light};
use super::places::Offsets;
use super::tree::{Source, quoted};
use crate::ImportReport;
use crate::math::Affine;
use crate::scene::{
    Camera, CameraId, CameraKey, EntityKind, Light, Lit, NodeId, Rgb, SceneBuilder, Tables, Target,
    TransformId,
};
use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::rc::Rc;

/// The most lights that placements of files add to a scene.
const MOST_LIGHTS: usize = 1 << 16;

/// The most edges that are followed: 64 for each light.
const MOST_STEPS: usize = 64 * MOST_LIGHTS;

/// Into so many parts the time between two keys is split where things do not go straight.
const PARTS: usize = 16;

/// The most times at which a light or camera is placed.
const MOST_TIMES: usize = 4096;

/// Whether a radiance is anything but black.
pub(super) fn is_seen(radiance: Rgb) -> bool {
    radiance != [0.0; 3]
}

/// A placed file whose views are wanted, and the offset of its first placement.
struct Wanted<'f> {
    file: &'f PlacedFile,
    at: usize,
    prefix: String,
    has_cameras: bool,
}

/// Edges of one node that are left to follow, and where the node is.
struct Level {
    left: Range<usize>,
    world: Affine,
}

/// Adds the lights and cameras of files that this file's own nodes and instances place. Fails
/// if lights would be too many.
pub(super) fn views(
    source: &Source,
    own_nodes: impl Iterator<Item = NodeId>,
    placed: &[(Rc<PlacedFile>, usize)],
    (scene, report): (&mut SceneBuilder, &mut ImportReport),
    at: &mut Offsets,
) -> Result<()> {
    let mut wanted = wanted(placed);
    if wanted.is_empty() {
        return Ok(());
    }
    let leading = leading(own_nodes, &wanted, scene.tables());
    let too_many = |file: &Wanted| {
        let message = format!(
            "the lights of {} are placed too often: files that a scene places bring {MOST_LIGHTS} \
             lights at most; place a copy of the file without lights",
            quoted(&file.file.name)
        );
        source.error(file.at, message)
    };
    // A path longer than this runs in a circle, which the scene's check refuses.
    let deepest = scene.tables().nodes.len() + 1;
    let mut path: Vec<TransformId> = Vec::new();
    let mut levels = vec![Level {
        left: 0..scene.tables().roots.len(),
        world: Affine::IDENTITY,
    }];
    let (mut lights, mut steps) = (0, 0);
    loop {
        let is_root = levels.len() == 1;
        let Some(level) = levels.last_mut() else {
            return Ok(());
        };
        let Some(row) = level.left.next() else {
            levels.pop();
            path.pop();
            continue;
        };
        let all = scene.tables();
        let edge = match is_root {
            true => all.roots.row(row),
            false => all.edges.row(row),
        };
        let Target::Node(node) = edge.target else {
            continue;
        };
        let leads = leading.contains(&node);
        let file = wanted.get_mut(&node);
        if !leads && file.is_none() {
            continue;
        }
        steps += 1;
        let local = &all.transforms.local[edge.transform.index()];
        let world = match local.is_identity() {
            true => level.world,
            false => level.world.then_after(local),
        };
        path.push(edge.transform);
        if let Some(file) = file {
            lights += file.file.views.lights.len();
            if lights > MOST_LIGHTS || steps > MOST_STEPS {
                return Err(too_many(file));
            }
            let before = scene.tables();
            let first = [before.lights.len(), before.cameras.rows.len()];
            let way = Way::new(&path, world, before);
            way.add_lights(file.file, scene, report);
            if std::mem::take(&mut file.has_cameras) {
                way.add_cameras(file, scene, report);
            }
            let after = scene.tables();
            at.note(EntityKind::Light, first[0]..after.lights.len(), file.at);
            at.note(
                EntityKind::Camera,
                first[1]..after.cameras.rows.len(),
                file.at,
            );
            path.pop();
        } else if path.len() <= deepest {
            let children = &all.nodes.children[node.index()];
            let left = children.start as usize..children.end as usize;
            levels.push(Level { left, world });
        } else {
            return Ok(());
        }
    }
}

/// Returns the files that have lights or cameras, by node.
fn wanted(placed: &[(Rc<PlacedFile>, usize)]) -> HashMap<NodeId, Wanted<'_>> {
    let mut times: HashMap<&str, usize> = HashMap::new();
    let mut wanted = HashMap::new();
    for (file, at) in placed {
        let views = &file.views;
        if views.lights.is_empty() && views.cameras.rows.is_empty() {
            continue;
        }
        let before = times.entry(&file.name).or_default();
        *before += 1;
        let prefix = match *before {
            1 => format!("{}/", file.name),
            n => format!("{}_{n}/", file.name),
        };
        let row = Wanted {
            file,
            at: *at,
            prefix,
            has_cameras: !views.cameras.rows.is_empty(),
        };
        wanted.insert(file.node, row);
    }
    wanted
}

/// Returns this file's nodes from which a way leads to a wanted file.
fn leading(
    own_nodes: impl Iterator<Item = NodeId>,
    wanted: &HashMap<NodeId, Wanted>,
    all: &Tables,
) -> HashSet<NodeId> {
    let mut parents: HashMap<NodeId, Vec<NodeId>> = HashMap::new();
    for node in own_nodes {
        let children = &all.nodes.children[node.index()];
        for row in children.start as usize..children.end as usize {
            if let Target::Node(child) = all.edges.target[row] {
                let of = parents.entry(child).or_default();
                if of.last() != Some(&node) {
                    of.push(node);
                }
            }
        }
    }
    let mut leading = HashSet::new();
    let mut open: Vec<NodeId> = wanted.keys().copied().collect();
    while let Some(node) = open.pop() {
        for parent in parents.get(&node).into_iter().flatten() {
            if leading.insert(*parent) {
                open.push(*parent);
            }
        }
    }
    leading
}

/// A way from the world to a placed file.
struct Way {
    /// Where the file is at time 0.
    world: Affine,
    /// Where it is at times from 0 on; empty if it does not move.
    keys: Vec<(f64, Affine)>,
}

impl Way {
    fn new(path: &[TransformId], world: Affine, all: &Tables) -> Way {
        let transforms = &all.transforms;
        let motions = &transforms.motions;
        let moving: Vec<usize> = path.iter().filter_map(|id| motions.row_of(*id)).collect();
        if moving.is_empty() {
            return Way {
                world,
                keys: Vec::new(),
            };
        }
        let keys = moving.iter().flat_map(|row| motions.keys(*row));
        let mut times: Vec<f64> = keys.map(|key| key.at).collect();
        times.sort_unstable_by(f64::total_cmp);
        times.dedup();
        let goes_straight = moving.len() == 1 && !motions.is_rigid(moving[0]);
        if !goes_straight && times.len() * PARTS <= MOST_TIMES {
            let between = |pair: &[f64]| {
                let (a, b) = (pair[0], pair[1]);
                (0..PARTS).map(move |k| a + (b - a) * k as f64 / PARTS as f64)
            };
            let last = times.last().copied();
            times = times.windows(2).flat_map(between).chain(last).collect();
        }
        times.truncate(MOST_TIMES);
        let world_at = |time: f64| {
            path.iter().fold(Affine::IDENTITY, |above, id| {
                let local = match motions.row_of(*id) {
                    Some(row) => motions.row_at(row, time),
                    None => transforms.local[id.index()],
                };
                above.then_after(&local)
            })
        };
        let keys = times.iter().map(|time| (*time, world_at(*time)));
        Way {
            world,
            keys: keys.collect(),
        }
    }

    fn add_lights(&self, file: &PlacedFile, scene: &mut SceneBuilder, report: &mut ImportReport) {
        let views = &file.views;
        let groups: Vec<&str> = views.light_groups.names().collect();
        for (row, light) in (0..).zip(&views.lights) {
            let motions = &views.light_motions;
            let own = motions.of.iter().position(|of| of.0 == row);
            let own = own.map(|i| &motions.ranges[i]);
            let own = own.map(|keys| &motions.keys[keys.start as usize..keys.end as usize]);
            let keys: Option<Vec<(f64, Light)>> = match (own, &self.keys[..]) {
                (None, []) => Some(Vec::new()),
                (None, keys) => keys
                    .iter()
                    .map(|(at, world)| Some((*at, moved_light(light, world)?)))
                    .collect(),
                (Some(keys), []) => keys
                    .iter()
                    .map(|(at, light)| Some((*at, moved_light(light, &self.world)?)))
                    .collect(),
                (Some(_), _) => {
                    report.add("light of a placed file that moves, as does its placement");
                    continue;
                }
            };
            let (Some(light), Some(keys)) = (moved_light(light, &self.world), keys) else {
                report.add("light with an extent below a placement that stretches it");
                continue;
            };
            let id = scene.light(light);
            if !keys.is_empty() {
                scene.move_light(id, &keys);
            }
            if let Some(group) = views
                .light_groups
                .of(Lit::Light(crate::scene::LightId(row)))
            {
                scene.light_group(groups[group as usize], Lit::Light(id));
            }
        }
    }

    fn add_cameras(&self, file: &Wanted, scene: &mut SceneBuilder, report: &mut ImportReport) {
        let cameras = &file.file.views.cameras;
        for (row, camera) in cameras.rows.iter().enumerate() {
            let of = row as u32;
            let named = |name: Option<&str>| match name {
                Some(name) => format!("{}{name}", file.prefix),
                None => String::new(),
            };
            let name = named(cameras.names.get(of));
            let node = named(cameras.node_names.get(of).or(cameras.names.get(of)));
            let id: CameraId = scene.camera_on(&name, &node, moved_camera(camera, &self.world));
            let own = cameras.motions.of.iter().position(|row| *row == of);
            match own.map(|row| cameras.motions.keys(row)) {
                None if self.keys.is_empty() => {}
                None => scene.move_camera(id, &self.keys_of(camera)),
                Some(keys) => {
                    if !self.keys.is_empty() {
                        report.add("motion of a placement, of a camera that moves");
                    }
                    let keys: Vec<CameraKey> =
                        keys.iter().map(|key| moved_key(key, &self.world)).collect();
                    scene.move_camera(id, &keys);
                }
            }
            if let Some(shutter) = cameras.shutter(row) {
                scene.shutter(id, shutter);
            }
        }
    }

    /// Returns the keys of a camera that is at rest in the file.
    fn keys_of(&self, camera: &Camera) -> Vec<CameraKey> {
        let key = |(at, world): &(f64, Affine)| {
            let there = moved_camera(camera, world);
            CameraKey {
                at: *at,
                eye: there.eye,
                look_at: there.eye + there.forward,
                up: there.up,
            }
        };
        self.keys.iter().map(key).collect()
    }
}
