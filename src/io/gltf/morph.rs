//! Morph targets: what is added to the vertices of a primitive, by weights (glTF 2.0, section
//! 3.7.2.2).

use super::File;
use super::accessor::{Accept, triples};
use crate::LoadError;
use gltf::json::Index;
use gltf::json::accessor::Accessor;
use gltf::json::mesh::Primitive;

/// Lists the columns of a primitive's targets.
pub(super) fn columns(primitive: &Primitive) -> impl Iterator<Item = Option<Index<Accessor>>> {
    let targets = primitive.targets.iter().flatten();
    targets.flat_map(|target| [target.positions, target.normals])
}

/// Adds targets to the vertices of a primitive, weighted; more weights than targets do nothing.
pub(super) fn apply(
    file: &File,
    primitive: &Primitive,
    weights: &[f64],
    (positions, normals): (&mut [[f64; 3]], &mut [[f32; 3]]),
    place: &str,
) -> Result<(), LoadError> {
    let targets = primitive.targets.iter().flatten().zip(weights);
    for (i, (target, weight)) in targets.enumerate() {
        if *weight == 0.0 {
            continue;
        }
        let column = |id, accept, name: &str| {
            let place = format!("{place}, target {i}, {name}");
            let rows = triples(file, id, &file.vertex_types(accept), &place)?;
            if rows.len() == positions.len() {
                return Ok(rows);
            }
            let message = format!("{} for {} positions", rows.len(), positions.len());
            Err(file.invalid(&place, &message))
        };
        let (moves, turns) = (
            target
                .positions
                .map(|id| column(id, Accept::Position, "POSITION")),
            target
                .normals
                .map(|id| column(id, Accept::Normal, "NORMAL")),
        );
        for (to, by) in positions
            .iter_mut()
            .zip(moves.transpose()?.iter().flatten())
        {
            for k in 0..3 {
                to[k] += weight * by[k];
            }
        }
        for (to, by) in normals.iter_mut().zip(turns.transpose()?.iter().flatten()) {
            for k in 0..3 {
                to[k] = (f64::from(to[k]) + weight * by[k]) as f32;
            }
        }
    }
    Ok(())
}
