//! What is known of the surface at hits, in columns.

use super::batch::{Hits, RayBatch};
use crate::accel::World;
use crate::plan::Precision;
use crate::scene::{MaterialId, Shape};
use crate::shade::{InteractionPart, place_of};
use crate::trace::{HitId, TURNED};
use glam::DVec3;
use rayon::prelude::*;
use thiserror::Error;

/// The surfaces at hits in world space, in columns: a row per ray, NaN and `None` where it has no
/// hit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surfaces {
    /// Within f64's rounding of the surface, but in [`Precision::Fast`].
    pub point: Vec<DVec3>,
    /// Unit, on the outer side of the shape; a CSG solid's own outer side.
    pub geometric_normal: Vec<DVec3>,
    /// Unit, on the side that the ray came from: interpolated where a shape has vertex normals,
    /// else the geometric one or its opposite. Normal maps do not show.
    pub shading_normal: Vec<DVec3>,
    /// Where images are looked up: the first set of a mesh's texture coordinates, else the
    /// coordinates that the shape itself has.
    pub uv: Vec<[f64; 2]>,
    /// The material's number; `None` as well where the surface has the default one.
    pub material: Vec<Option<MaterialId>>,
}

/// Hits that are not those of the rays in the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum SurfaceError {
    #[error("there are {rays} rays and {hits} hits; give the rays that were traced")]
    Rows { rays: usize, hits: usize },
    #[error("hit {0} is on nothing in this scene; ask the tracer that found it")]
    Unknown(usize),
}

/// Rows that are evaluated in one piece of work.
const PIECE: usize = 1024;

impl Surfaces {
    pub fn len(&self) -> usize {
        self.point.len()
    }

    pub fn is_empty(&self) -> bool {
        self.point.is_empty()
    }

    pub(super) fn of(
        (world, precision): (&World, Precision),
        rays: &RayBatch,
        hits: &Hits,
    ) -> Result<Surfaces, SurfaceError> {
        let columns = [
            hits.t.len(),
            hits.instance.len(),
            hits.primitive.len(),
            hits.turned.len(),
        ];
        if let Some(other) = columns.into_iter().find(|rows| *rows != rays.len()) {
            return Err(SurfaceError::Rows {
                rays: rays.len(),
                hits: other,
            });
        }
        let mut all = Surfaces::nothing(rays.len());
        let columns = (all.point.par_chunks_mut(PIECE))
            .zip(all.geometric_normal.par_chunks_mut(PIECE))
            .zip(all.shading_normal.par_chunks_mut(PIECE))
            .zip(all.uv.par_chunks_mut(PIECE))
            .zip(all.material.par_chunks_mut(PIECE));
        let pieces = columns.enumerate();
        pieces.try_for_each(|(piece, ((((point, ng), ns), uv), material))| {
            // Neighbouring rays mostly hit the same primitive.
            let mut last: Option<InteractionPart> = None;
            for i in 0..point.len() {
                let row = piece * PIECE + i;
                let Some(id) = id_of(hits, row) else {
                    continue;
                };
                if !is_known(world, id) {
                    return Err(SurfaceError::Unknown(row));
                }
                let kept = last.take().filter(|part| part.has(id));
                let other = || InteractionPart::of(world, precision, id);
                let part = last.insert(kept.unwrap_or_else(other));
                let (org, dir) = rays.ray(row);
                let surface = part.surface((org, dir), hits.t[row], id.primitive);
                let (place, _) = place_of((part, world), (org, dir), (&surface, id));
                point[i] = surface.point;
                ng[i] = surface.ng;
                ns[i] = surface.ns;
                uv[i] = place.uv(&world.scene);
                material[i] = surface.material;
            }
            Ok(())
        })?;
        Ok(all)
    }

    fn nothing(rows: usize) -> Surfaces {
        Surfaces {
            point: vec![DVec3::NAN; rows],
            geometric_normal: vec![DVec3::NAN; rows],
            shading_normal: vec![DVec3::NAN; rows],
            uv: vec![[f64::NAN; 2]; rows],
            material: vec![None; rows],
        }
    }
}

/// Returns what a ray has hit, as the engine has it.
fn id_of(hits: &Hits, row: usize) -> Option<HitId> {
    let turned = if hits.turned[row] { TURNED } else { 0 };
    let instance = hits.instance[row];
    (instance != HitId::NONE.instance).then(|| HitId {
        instance,
        primitive: hits.primitive[row] | turned,
    })
}

/// Says whether the scene has the primitive.
fn is_known(world: &World, id: HitId) -> bool {
    let scene = &world.scene;
    if id.instance >= world.instances.count() {
        return false;
    }
    let has = |shape: Shape, triangle: u32| match shape {
        Shape::Mesh(mesh) => (triangle as usize) < scene.meshes.row(mesh).triangles.len(),
        _ => triangle == 0,
    };
    match world.entry_of(id.instance).shape {
        Shape::Csg(row) => {
            let solid = &world.csg(row).solid;
            let (operand, triangle) = solid.operand_of(id.primitive & !TURNED);
            let operand = solid.operands.get(operand as usize);
            operand.is_some_and(|operand| has(operand.shape, triangle))
        }
        shape => has(shape, id.primitive),
    }
}
