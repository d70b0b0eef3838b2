//! Skins: a mesh in the pose of its joints as the file has it.
//!
//! A vertex moves by the weighted sum of its joints' matrices, each the joint's transform to
//! the world times its inverse bind matrix (glTF 2.0, section 3.7.3.3). The transform of the
//! node that carries the mesh does not count. Animations are not imported.

use super::File;
use super::accessor::{Accept, matrices, quadruples};
use super::placement::{affine, cofactors};
use crate::LoadError;
use crate::math::Affine;
use gltf::json::Index;
use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::validation::Checked;

/// The matrices of a skin's joints.
pub(super) struct Pose {
    joints: Vec<Affine>,
}

impl Pose {
    /// Reads a skin, whose joints are placed by `world`, a row for each node.
    pub fn read(file: &File, skin: usize, world: &[Affine]) -> Result<Pose, LoadError> {
        let source = &file.root.skins[skin];
        let place = format!("skin {skin}");
        let inverse = match source.inverse_bind_matrices {
            Some(id) => matrices(file, id, &format!("{place}, inverseBindMatrices"))?,
            None => Vec::new(),
        };
        let mut joints = Vec::with_capacity(source.joints.len());
        for (i, joint) in source.joints.iter().enumerate() {
            let Some(world) = world.get(joint.value()) else {
                let (id, all) = (joint.value(), world.len());
                let message = format!("refers to node {id}, but there are {all}");
                return Err(file.invalid(&place, &message));
            };
            joints.push(match inverse.get(i) {
                _ if source.inverse_bind_matrices.is_none() => *world,
                Some(m) => world.then_after(&affine(m).ok_or_else(|| {
                    file.invalid(&place, &format!("inverse bind matrix {i} is not affine"))
                })?),
                None => {
                    let (all, has) = (source.joints.len(), inverse.len());
                    let message = format!("has {has} inverse bind matrices for {all} joints");
                    return Err(file.invalid(&place, &message));
                }
            });
        }
        Ok(Pose { joints })
    }

    /// Moves the vertices of a primitive. Those without weights stay.
    pub fn apply(
        &self,
        file: &File,
        primitive: &Primitive,
        (positions, normals): (&mut [[f64; 3]], &mut [[f32; 3]]),
        place: &str,
    ) -> Result<(), LoadError> {
        let attribute = |s| primitive.attributes.get(&Checked::Valid(s)).copied();
        let mut sums = vec![(0.0, [[0.0; 3]; 4]); positions.len()];
        for set in 0.. {
            let (Some(joints), Some(weights)) = (
                attribute(Semantic::Joints(set)),
                attribute(Semantic::Weights(set)),
            ) else {
                break;
            };
            let column = |id: Index<_>, accept, name: &str| {
                let place = format!("{place}, {name}_{set}");
                let rows = quadruples(file, id, &accept, &place)?;
                if rows.len() == positions.len() {
                    return Ok(rows);
                }
                let message = format!("{} for {} positions", rows.len(), positions.len());
                Err(file.invalid(&place, &message))
            };
            let joints = column(joints, Accept::Joint, "JOINTS")?;
            let weights = column(weights, Accept::Weight, "WEIGHTS")?;
            for (v, (total, sum)) in sums.iter_mut().enumerate() {
                for (joint, weight) in joints[v].iter().zip(weights[v]) {
                    if weight == 0.0 || !weight.is_finite() {
                        continue;
                    }
                    let Some(matrix) = self.joints.get(*joint as usize) else {
                        let all = self.joints.len();
                        let message =
                            format!("vertex {v} has joint {joint}, but the skin has {all}");
                        return Err(file.invalid(&format!("{place}, JOINTS_{set}"), &message));
                    };
                    *total += weight;
                    let [x, y, z] = *matrix.linear();
                    for (sum, column) in sum.iter_mut().zip([x, y, z, matrix.translation]) {
                        for k in 0..3 {
                            sum[k] += weight * column[k];
                        }
                    }
                }
            }
        }
        for (v, (total, sum)) in sums.into_iter().enumerate() {
            if total == 0.0 {
                continue;
            }
            // Weights of 8 bits rarely add up to 1.
            let [x, y, z, translation] = sum.map(|column| column.map(|c| c / total));
            let map = Affine::new([x, y, z], translation);
            positions[v] = map.point(positions[v]);
            let normal = cofactors(&map).vector(normals[v].map(f64::from));
            normals[v] = normal.map(|x| x as f32);
        }
        Ok(())
    }
}
