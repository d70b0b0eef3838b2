//! Entities of errors, with the labels that messages show.

use crate::scene::error::{Entity, EntityKind};
use crate::scene::{Shape, Tables};

/// Returns the entity of a shape.
pub(super) fn shape_entity(scene: &Tables, shape: u32) -> Entity {
    let kind = scene.shapes.rows[shape as usize].kind_name();
    let label = match scene.shapes.names.get(shape) {
        Some(name) => format!("{kind} '{name}'"),
        None => format!("{kind} (shape {shape})"),
    };
    Entity::new(EntityKind::Shape, shape, label)
}

/// Returns the shape of each CSG solid.
pub(super) fn shapes_of_csg(scene: &Tables) -> Vec<u32> {
    let mut of = vec![0; scene.csg.len()];
    for (i, shape) in scene.shapes.rows.iter().enumerate() {
        if let Shape::Csg(id) = shape {
            of[id.index()] = i as u32;
        }
    }
    of
}

/// Returns the entity of an operand, for errors about its transform or material.
pub(super) fn operand_entity(scene: &Tables, operand: usize) -> Entity {
    let has = |row: &usize| {
        let range = &scene.csg.operands_of[*row];
        (range.start as usize..range.end as usize).contains(&operand)
    };
    let row = (0..scene.csg.len()).find(has);
    match row.map(|row| shapes_of_csg(scene)[row]) {
        Some(shape) => {
            let label = format!("an operand of {}", shape_entity(scene, shape));
            Entity::new(EntityKind::Shape, shape, label)
        }
        None => Entity::new(EntityKind::Shape, u32::MAX, format!("operand {operand}")),
    }
}

/// Returns the labels of a path for a message, shortened because a path may have a million
/// nodes.
pub(super) fn shortened(path: &[u32], label: impl Fn(&u32) -> String) -> Vec<String> {
    const ENDS: usize = 5;
    if path.len() <= 2 * ENDS + 1 {
        return path.iter().map(label).collect();
    }
    let (head, tail) = (&path[..ENDS], &path[path.len() - ENDS..]);
    let between = format!("({} more)", path.len() - 2 * ENDS);
    head.iter()
        .map(&label)
        .chain([between])
        .chain(tail.iter().map(&label))
        .collect()
}
