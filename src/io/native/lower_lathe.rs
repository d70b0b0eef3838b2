//! `lathe`: an outline that is turned about the y axis, as a solid made of cones.

use super::schema::Lathe;
use super::source_spans::At;
use super::tree::Source;
use crate::LoadError;
use crate::geom::{Cone, Cylinder};
use crate::scene::{Operand, Operator, SceneBuilder, ShapeId};
use crate::shared::lathe::{Frustum, frusta};
use glam::{DVec2, DVec3};

/// Adds the solid that an outline with holes sweeps about the y axis: what is in an odd number of
/// the cones between its edges and the axis. Fails for outlines of fewer than three points, points
/// left of the axis, and outlines that sweep nothing.
pub(super) fn lathe(
    source: &Source,
    name: &str,
    row: &At<Lathe>,
    scene: &mut SceneBuilder,
) -> Result<ShapeId, LoadError> {
    let refuse = |message: String| Err(source.error(row.at, message));
    let outline = [&row.value.points].into_iter();
    let mut pieces: Vec<Frustum> = Vec::new();
    for ring in outline.chain(row.value.holes.iter().flatten()) {
        if ring.len() < 3 {
            return refuse(format!(
                "an outline of {} points encloses nothing; give three or more",
                ring.len()
            ));
        }
        let bad = ring.iter().find(|[r, _]| *r < 0.0);
        if let Some([r, y]) = bad {
            return refuse(format!(
                "a point of a lathe is [{r}, {y}]; give [distance from the y axis, y], with \
                 distances of 0 or more"
            ));
        }
        let ring: Vec<DVec2> = ring.iter().map(|p| DVec2::from_array(*p)).collect();
        pieces.extend(frusta(&ring));
    }
    if pieces.is_empty() {
        return refuse("the outline of a lathe sweeps nothing".into());
    }
    let operands: Vec<Operand> = pieces
        .iter()
        .enumerate()
        .map(|(edge, piece)| Operand::shape(cone(&format!("{name} edge {edge}"), piece, scene)))
        .collect();
    Ok(scene.csg(name, Operator::Xor, &operands))
}

/// Adds a piece of a cone about the y axis.
fn cone(name: &str, [low, high]: &Frustum, scene: &mut SceneBuilder) -> ShapeId {
    let [base, top] = [low, high].map(|end| DVec3::Y * end.y);
    match low.x == high.x {
        true => scene.cylinder(
            name,
            Cylinder {
                base,
                top,
                radius: low.x,
                open: false,
            },
        ),
        false => scene.cone(
            name,
            Cone {
                base,
                top,
                base_radius: low.x,
                top_radius: high.x,
                open: false,
            },
        ),
    }
}
