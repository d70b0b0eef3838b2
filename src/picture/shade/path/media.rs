//! Media that touch: where the surfaces of two solids coincide or cross, a path's list of media
//! does not follow from the surfaces that it meets, and the solids themselves are asked.

use super::Materials;
use super::state::Media;
use crate::math::Aabb;
use crate::scene::{Instance, Instances, Shape, Tables, shape_bounds};
use crate::trace::{Solids, TraceScratch};
use glam::DVec3;

/// With more solids of media than this, some are taken to touch.
const MOST_COMPARED: usize = 1000;

/// A picture's solids that are media, as far as paths have to ask them.
pub struct MediaField {
    /// The scene's solids, where some media touch or overlap.
    pub solids: Option<Solids>,
    /// The media around the eye.
    pub eye: Media,
}

impl MediaField {
    /// Prepares what has to be asked; nothing where media stand apart and the eye outside.
    pub fn of(
        scene: &crate::scene::Scene,
        instances: &Instances,
        materials: &Materials,
        eye: DVec3,
    ) -> MediaField {
        let none = MediaField {
            solids: None,
            eye: Media::default(),
        };
        if !materials.has_media() || instances.check_enumerable().is_err() {
            return none;
        }
        let boxes: Vec<Option<Aabb>> = instances
            .iter(scene)
            .filter(|instance| is_medium(scene, instance, materials))
            .map(|instance| room(scene, &instance))
            .collect();
        let around =
            |room: &Option<Aabb>| room.is_none_or(|room| meet(&room, &Aabb::new(eye, eye)));
        let inside = boxes.iter().any(around);
        let touch = |(i, a): (usize, &Option<Aabb>)| {
            boxes[..i].iter().any(|b| match (a, b) {
                (Some(a), Some(b)) => meet(a, b),
                _ => true,
            })
        };
        let touching = boxes.len() > MOST_COMPARED || boxes.iter().enumerate().any(touch);
        if !inside && !touching {
            return none;
        }
        let Ok(solids) = Solids::prepare(scene, instances) else {
            return none;
        };
        let trace = &mut TraceScratch::default();
        MediaField {
            eye: materials.media_at(&solids, eye, trace),
            solids: touching.then_some(solids),
        }
    }
}

/// Says whether an instance's surfaces, or some of them, bound a medium.
fn is_medium(scene: &Tables, instance: &Instance, materials: &Materials) -> bool {
    if instance.material.is_some() {
        return materials.bounds_medium(instance.material);
    }
    match scene.shapes.row(instance.shape) {
        Shape::Csg(row) => {
            let mut parts = scene.csg.operands(row).iter();
            parts.any(|part| materials.bounds_medium(part.material))
        }
        Shape::Mesh(row) => {
            let mesh = scene.meshes.row(row);
            (0..mesh.triangles.len() as u32).any(|i| materials.bounds_medium(mesh.material(i)))
        }
        _ => false,
    }
}

/// Returns a box around an instance in world space, `None` if it has no bounds.
fn room(scene: &Tables, instance: &Instance) -> Option<Aabb> {
    let own = shape_bounds(scene, instance.shape)?;
    own.placed(&instance.object_from_world, &instance.world_from_object)
}

fn meet(a: &Aabb, b: &Aabb) -> bool {
    a.min.cmple(b.max).all() && b.min.cmple(a.max).all()
}
