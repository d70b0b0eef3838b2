//! The shapes of meshes: one for all nodes that show a mesh alike, one for each pose or morph.

use super::File;
use super::material::Materials;
use super::mesh::{self, State};
use super::motion::Motion;
use super::nodes::{all_worlds, label};
use super::placement::flattened;
use super::skin::Pose;
use crate::math::Affine;
use crate::scene::{MeshData, SceneBuilder, ShapeId};
use crate::shared::messages::one_line;
use crate::{ImportReport, LoadError};
use std::collections::HashMap;

/// The most bytes of the vertices of all keys of a file's meshes that deform.
const MOST_KEY_BYTES: usize = 1 << 31;

/// What a shape is made for: a mesh, its skin, and the node whose weights or motion it has.
type Use = (usize, Option<usize>, Option<usize>);

/// The shapes of meshes that are read so far.
pub(super) struct Meshes<'f> {
    file: &'f File<'f>,
    materials: &'f Materials,
    motion: &'f Motion,
    /// `None` for a mesh without triangles.
    shapes: HashMap<Use, Option<ShapeId>>,
    /// Per skin its poses, one for each sample of the motion, or one if nothing moves.
    poses: HashMap<usize, Vec<Pose>>,
    key_bytes: usize,
}

impl<'f> Meshes<'f> {
    pub fn new(file: &'f File<'f>, materials: &'f Materials, motion: &'f Motion) -> Meshes<'f> {
        Meshes {
            file,
            materials,
            motion,
            shapes: HashMap::new(),
            poses: HashMap::new(),
            key_bytes: 0,
        }
    }

    /// Reads the poses of a skin, unless they are read already.
    pub fn read_poses(&mut self, skin: usize, parents: &[u32]) -> Result<(), LoadError> {
        if self.poses.contains_key(&skin) {
            return Ok(());
        }
        let samples = match self.motion.any_moves() {
            true => &self.motion.samples[..],
            false => &[0.0],
        };
        let mut poses = Vec::with_capacity(samples.len());
        let left = self.file.budget.get();
        for time in samples {
            let placements = self.motion.placements(*time);
            let world = all_worlds(self.file, &placements, parents)?;
            // The same columns are read for each.
            self.file.budget.set(left);
            poses.push(Pose::read(self.file, skin, &world)?);
        }
        self.poses.insert(skin, poses);
        Ok(())
    }

    /// Reads a mesh that a node refers to, with its name.
    fn read(
        &self,
        node: usize,
        mesh: usize,
        state: &State,
        (scene, report): (&SceneBuilder, &mut ImportReport),
    ) -> Result<(String, MeshData), LoadError> {
        let file = self.file;
        let Some(source) = file.root.meshes.get(mesh) else {
            let all = file.root.meshes.len();
            let message = format!("refers to mesh {mesh}, but there are {all}");
            return Err(file.invalid(&label(file, node), &message));
        };
        let name = one_line(source.name.as_deref().unwrap_or_default());
        let label = match &*name {
            "" => format!("mesh {mesh}"),
            name => format!("mesh {mesh} '{name}'"),
        };
        let data = mesh::read(file, source, &label, self.materials, state, report)?;
        check_room(file, scene, &data, &label)?;
        Ok((name, data))
    }

    /// Returns the weights of a mesh's morph targets for a node at a time.
    fn weights(&self, node: usize, mesh: usize, time: f64) -> Vec<f64> {
        let curves = self.motion.curves(node).and_then(|c| c.weights.as_ref());
        if let Some(curve) = curves {
            return curve.value(time);
        }
        let own = self.file.root.nodes[node].weights.as_ref();
        let of_mesh = self.file.root.meshes.get(mesh);
        let weights = own.or(of_mesh.and_then(|mesh| mesh.weights.as_ref()));
        let weights = weights.map_or(&[][..], |weights| weights);
        weights.iter().map(|w| f64::from(*w)).collect()
    }

    /// Returns the shape of a mesh as a node shows it, in the world's space if it has a skin.
    pub fn shape(
        &mut self,
        node: usize,
        mesh: usize,
        skin: Option<usize>,
        scene: &mut SceneBuilder,
        report: &mut ImportReport,
    ) -> Result<Option<ShapeId>, LoadError> {
        let curves = self.motion.curves(node);
        let morphs = curves.is_some_and(|curves| curves.weights.is_some());
        let is_own = morphs || self.file.root.nodes[node].weights.is_some();
        let key = (mesh, skin, is_own.then_some(node));
        if let Some(shape) = self.shapes.get(&key) {
            return Ok(*shape);
        }
        let poses = skin.and_then(|skin| self.poses.get(&skin));
        let poses = poses.map_or(&[][..], |poses| poses);
        let motion = self.motion;
        let state = |sample: usize| State {
            pose: poses.get(sample).or(poses.last()),
            weights: self.weights(node, mesh, motion.samples[sample]),
            is_key: sample > 0,
        };
        let mut key_bytes = self.key_bytes;
        let (name, data) = self.read(node, mesh, &state(0), (scene, report))?;
        if data.triangles.is_empty() {
            self.shapes.insert(key, None);
            return Ok(None);
        }
        let mut keys = Vec::new();
        if morphs || poses.len() > 1 {
            let left = self.file.budget.get();
            for (sample, time) in self.motion.samples.iter().enumerate().skip(1) {
                // The same columns are read for each key.
                self.file.budget.set(left);
                let mut unused = ImportReport::default();
                let (_, key) = self.read(node, mesh, &state(sample), (scene, &mut unused))?;
                key_bytes += (key.positions.len() + key.normals.len()) * 12;
                if key_bytes > MOST_KEY_BYTES {
                    let message = "has more vertices at all its times than there is room for; \
                                   ask for fewer frames at once: --frames A..B --fps F";
                    return Err(self.file.invalid(&label(self.file, node), message));
                }
                keys.push((*time, key));
            }
            self.file.budget.set(left);
        }
        self.key_bytes = key_bytes;
        let is_like = |(_, key): &(f64, MeshData)| {
            key.positions == data.positions && key.normals == data.normals
        };
        let shape = match keys.iter().all(is_like) {
            true => scene.mesh(&name, &data),
            false => scene.deforming_mesh(&name, &data, &keys),
        };
        self.shapes.insert(key, Some(shape));
        Ok(Some(shape))
    }

    /// Returns the shape of a copy of a mesh, moved by a flat map, which no instance can have.
    pub fn flat(
        &self,
        node: usize,
        mesh: usize,
        map: &Affine,
        scene: &mut SceneBuilder,
        report: &mut ImportReport,
    ) -> Result<Option<ShapeId>, LoadError> {
        let state = State {
            pose: None,
            weights: self.weights(node, mesh, 0.0),
            is_key: false,
        };
        let (name, data) = self.read(node, mesh, &state, (scene, report))?;
        let data = flattened(&data, map);
        Ok((!data.triangles.is_empty()).then(|| scene.mesh(&name, &data)))
    }
}

/// Checks that a mesh fits into the scene, whose tables count all vertices and all triangles
/// in u32.
fn check_room(
    file: &File,
    scene: &SceneBuilder,
    data: &MeshData,
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
