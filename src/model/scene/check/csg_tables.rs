//! Checks of CSG solids: no solid contains itself, and every operand has an inside.

use super::entities::{shape_entity, shapes_of_csg, shortened};
use super::numbers::require;
use crate::csg::Operator;
use crate::scene::csg_solid::{
    MAX_OPERANDS, MAX_SURFACES, operands_first, surfaces, unfolded_counts,
};
use crate::scene::error::SceneError;
use crate::scene::ids::{CsgId, ShapeId};
use crate::scene::nodes::Target;
use crate::scene::{Shape, Tables, check_closed};

/// Checks the CSG solids, and returns them with each after its operands.
pub(super) fn csg_solids(scene: &Tables) -> Result<Vec<u32>, SceneError> {
    let table = &scene.csg;
    let of = shapes_of_csg(scene);
    let entity = |row: u32| shape_entity(scene, of[row as usize]);
    for row in 0..table.len() as u32 {
        let (what, id) = (|| entity(row), CsgId(row));
        let (operator, operands) = (table.operator[id.index()], table.operands(id));
        if operands.is_empty() {
            let part = "operands";
            return Err(SceneError::Empty { what: what(), part });
        }
        if operator == Operator::Complement && operands.len() != 1 {
            return Err(SceneError::OutOfRange {
                what: what(),
                field: "number of operands",
                value: operands.len().to_string(),
                must: "1: a complement is that of one solid",
            });
        }
        let tolerance = table.tolerance[id.index()];
        let is_length = tolerance >= 0.0 && tolerance.is_finite();
        require(is_length, what, "tolerance", tolerance, "0 or greater")?;
        for operand in operands {
            if let Some(why) = no_inside(scene, operand.shape) {
                let operand = shape_entity(scene, operand.shape.0);
                return Err(SceneError::NotSolid {
                    what: what(),
                    operand: Box::new(operand),
                    why,
                });
            }
        }
    }
    let order = operands_first(scene).map_err(|path| {
        let label = |row: &u32| entity(*row).label.into();
        SceneError::CycleOfShapes {
            what: entity(path[0]),
            path: shortened(&path, label),
        }
    })?;
    let placed = placed(scene);
    let counts = unfolded_counts(scene, &order, 0, |_| 1);
    if let Some(row) = counts.iter().position(|n| *n > MAX_OPERANDS) {
        return Err(SceneError::TooManyOperands {
            what: entity(row as u32),
            count: counts[row],
            limit: MAX_OPERANDS,
        });
    }
    let mut all = 0_u64;
    for (row, count) in (0..).zip(&counts).filter(|(row, _)| placed[*row as usize]) {
        all = all.saturating_add(*count);
        if all > MAX_OPERANDS {
            return Err(SceneError::TooManyOperandsInAll {
                what: entity(row),
                count: all,
                limit: MAX_OPERANDS,
            });
        }
    }
    let counts = unfolded_counts(scene, &order, 0, |shape| surfaces(scene, shape).into());
    if let Some(row) = counts.iter().position(|n| *n > MAX_SURFACES) {
        return Err(SceneError::TooManySurfaces {
            what: entity(row as u32),
            count: counts[row],
            limit: MAX_SURFACES,
        });
    }
    Ok(order)
}

/// Says of each CSG solid whether an instance or a child of a node is one, so that it is
/// unfolded by itself.
fn placed(scene: &Tables) -> Vec<bool> {
    let mut placed = vec![false; scene.csg.len()];
    for target in scene.roots.target.iter().chain(&scene.edges.target) {
        if let Target::Shape(shape) = target
            && let Shape::Csg(id) = scene.shapes.row(*shape)
        {
            placed[id.index()] = true;
        }
    }
    placed
}

/// Checks that meshes which are operands are closed. The rows of meshes must be checked
/// already.
pub(super) fn meshes(scene: &Tables) -> Result<(), SceneError> {
    let table = &scene.csg;
    let mut of = None;
    let mut seen = vec![false; scene.meshes.len()];
    for row in 0..table.len() as u32 {
        for operand in table.operands(CsgId(row)) {
            let Shape::Mesh(id) = scene.shapes.row(operand.shape) else {
                continue;
            };
            if std::mem::replace(&mut seen[id.index()], true) {
                continue;
            }
            if let Err(leaks) = check_closed(scene, id) {
                let of = of.get_or_insert_with(|| shapes_of_csg(scene));
                return Err(SceneError::NotClosed {
                    what: shape_entity(scene, of[row as usize]),
                    operand: Box::new(shape_entity(scene, operand.shape.0)),
                    leaks: Box::new(leaks),
                });
            }
        }
    }
    Ok(())
}

fn no_inside(scene: &Tables, shape: ShapeId) -> Option<&'static str> {
    scene.no_inside(scene.shapes.row(shape))
}
