//! A global transform of the scene: a uniform scale and a shift.

use super::check::check;
use super::error::SceneError;
use super::{Camera, Edge, Edges, Falloff, Light, Names, NodeId, Projection, Scene, Tables};
use crate::math::Affine;
use glam::DVec3;
use std::sync::Arc;

impl Scene {
    /// Returns the scene scaled about the world's origin, then moved. The roots become
    /// children of one new node; cameras and lights change their numbers in f64. Instance
    /// ids stay, and so does the picture to within roundings. Returns an error where
    /// numbers leave f64.
    pub fn moved(self, scale: f64, offset: DVec3) -> Result<Scene, SceneError> {
        let scaled = [[scale, 0.0, 0.0], [0.0, scale, 0.0], [0.0, 0.0, scale]];
        let place = Affine::new(scaled, offset.to_array());
        if place.is_identity() {
            return Ok(self);
        }
        let mut tables = Arc::unwrap_or_clone(self.tables);
        lift(&mut tables, place);
        for light in &mut tables.lights {
            move_light(light, scale, offset);
        }
        if !tables.light_motions.is_empty() {
            for (_, light) in &mut tables.light_motions.keys {
                move_light(light, scale, offset);
            }
        }
        for Camera {
            eye,
            projection,
            lens,
            ..
        } in &mut tables.cameras.rows
        {
            if let Some(lens) = lens {
                lens.radius *= scale;
                lens.focus *= scale;
            }
            *eye = *eye * scale + offset;
            if let Projection::Orthographic { half_height } = projection {
                *half_height *= scale;
            }
        }
        for key in &mut tables.cameras.motions.keys {
            key.eye = key.eye * scale + offset;
            key.look_at = key.look_at * scale + offset;
        }
        check(&mut tables)?;
        let tables = Arc::new(tables);
        Ok(Scene { tables })
    }
}

/// Puts the roots below one node, and that node under a transform.
fn lift(tables: &mut Tables, place: Affine) {
    if tables.roots.is_empty() {
        return;
    }
    let roots = std::mem::take(&mut *tables.roots);
    let first = tables.edges.len() as u32;
    for row in 0..roots.len() {
        tables.edges.push(roots.row(row));
    }
    let last = tables.edges.len() as u32;
    tables.nodes.children.push(first..last);
    let node = NodeId(tables.nodes.len() as u32 - 1);
    let transform = tables.transforms.push(place);
    let mut instances = Edges::default();
    instances.push(Edge::node(node).transform(transform));
    tables.roots = instances.into();
    tables.root_names = Names::default();
}

/// Scales a light's place and size, and its power so that pictures stay as bright.
fn move_light(light: &mut Light, scale: f64, offset: DVec3) {
    let (position, intensity, radius, fades) = match light {
        Light::Point {
            position,
            intensity,
            falloff,
            radius,
        } => (
            position,
            intensity,
            radius,
            *falloff == Falloff::InverseSquare,
        ),
        Light::Spot {
            position,
            intensity,
            radius,
            ..
        } => (position, intensity, radius, true),
        Light::Directional { .. } => return,
        Light::Rectangle { center, edges, .. } => {
            *center = *center * scale + offset;
            *edges = edges.map(|edge| edge * scale);
            return;
        }
        Light::Disc { center, radius, .. } => {
            *center = *center * scale + offset;
            *radius *= scale;
            return;
        }
    };
    *position = *position * scale + offset;
    *radius *= scale;
    if fades {
        *intensity = intensity.map(|i| (f64::from(i) * scale * scale) as _);
    }
}
