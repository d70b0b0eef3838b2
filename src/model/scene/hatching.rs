//! Hatches the faces that a section makes, as technical drawings do: parallel lines at 45° on the
//! plane, in another direction for the next part.
//!
//! A hatch is a [`Pattern::Gradient`] that repeats, so it is filtered as all patterns are. A part is
//! what has one material in one instance: operands of one solid that look alike are one piece of
//! matter, and have one hatch.

use super::materials::{Material, Model, Rgb};
use super::patterns::{Pattern, mixed};
use super::textures::{Slot, Texturing, Wrap};
use super::{MaterialId, SceneBuilder};
use crate::geom::HalfSpace;
use crate::math::Affine;
use glam::DVec3;
use std::collections::HashMap;
use std::f64::consts::FRAC_1_SQRT_2;

/// How the faces that a section makes are hatched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hatch {
    /// From line to line, in world units; without one it is a 48th of the longest side of what the
    /// planes cut.
    pub spacing: Option<f64>,
}

/// The lines on the longest side of what is cut, where no spacing is given: so many are told apart
/// in a picture of some hundred pixels.
const LINES: f64 = 48.0;

/// Steps of a period: lines are one step wide between two edges of one step each, so that they are as
/// wide as two.
const STEPS: usize = 16;

/// Spacings of the first pair of directions, of the second one, and again.
const SPACINGS: [f64; 2] = [1.0, 0.6];

/// Hatched materials, each made once.
pub(super) struct Hatcher {
    spacing: f64,
    /// How many parts have a hatch so far, and which.
    parts: HashMap<(usize, Option<MaterialId>), usize>,
    made: HashMap<(usize, Option<MaterialId>, usize), MaterialId>,
}

impl Hatcher {
    /// Takes the length of the longest side of what is cut.
    pub fn new(hatch: Hatch, longest: f64) -> Hatcher {
        let by_size = if longest > 0.0 { longest / LINES } else { 1.0 };
        Hatcher {
            spacing: hatch.spacing.unwrap_or(by_size),
            parts: HashMap::new(),
            made: HashMap::new(),
        }
    }

    /// Returns the material of a face on a plane of the world, of the part of an instance that has
    /// a material, or none.
    pub fn material(
        &mut self,
        builder: &mut SceneBuilder,
        (instance, world_from_object): (usize, &Affine),
        (number, plane): (usize, &HalfSpace),
        of: Option<MaterialId>,
    ) -> MaterialId {
        let next = self.parts.len();
        let part = *self.parts.entry((instance, of)).or_insert(next);
        let key = (instance, of, number);
        if let Some(known) = self.made.get(&key) {
            return *known;
        }
        let across = direction(plane.normal, part % 2 == 1);
        let spacing = self.spacing * SPACINGS[part / 2 % SPACINGS.len()];
        let made = hatched(builder, of, way(across, spacing, world_from_object));
        self.made.insert(key, made);
        made
    }
}

/// Returns the direction from line to line, at 45° to what is level on the plane.
fn direction(normal: DVec3, is_other: bool) -> DVec3 {
    let normal = normal.normalize();
    // Of a level plane x is to the right, as seen from above.
    let right = DVec3::Y.cross(normal);
    let right = match right.length_squared() > 1e-12 {
        true => right.normalize(),
        false => DVec3::X,
    };
    let up = normal.cross(right);
    let up = if is_other { -up } else { up };
    (right + up) * FRAC_1_SQRT_2
}

/// Returns two points of object space, from a line of the hatch to the next one. Lines of all instances
/// count from the world's origin. `None` where numbers end.
fn way(across: DVec3, spacing: f64, world_from_object: &Affine) -> Option<[[f64; 3]; 2]> {
    let slope = world_from_object.transposed_vector(across.to_array());
    let slope = DVec3::from_array(slope) / spacing;
    let origin = DVec3::from_array(world_from_object.point([0.0; 3]));
    let lines = origin.dot(across) / spacing;
    // Whole lines do not count.
    let phase = lines - lines.floor();
    let way = slope / slope.length_squared();
    let from = way * -phase;
    let squared = (way + from - from).length_squared();
    let is_good = from.is_finite() && squared.is_normal() && squared.recip().is_normal();
    is_good.then(|| [from.to_array(), (from + way).to_array()])
}

/// Adds a material whose colour has lines in it.
fn hatched(
    builder: &mut SceneBuilder,
    of: Option<MaterialId>,
    way: Option<[[f64; 3]; 2]>,
) -> MaterialId {
    let tables = builder.tables();
    let own = of.map_or(Material::default(), |id| tables.materials.rows[id.index()]);
    let name = of.and_then(|id| tables.materials.names.get(id.0));
    let name = name.map_or("hatched".to_owned(), |name| format!("{name} hatched"));
    let row = of.and_then(|id| tables.textures.of(id));
    let pattern = row.and_then(|row| row.texturing.base_color);
    let paper = match own.model {
        Model::Phong { diffuse, .. } => diffuse,
        Model::MetallicRoughness { .. } => own.base_color,
    };
    let paper = pattern.map_or(paper, |id| tables.textures.pattern(id).mean());
    let image = row.and_then(|row| row.refs.iter().find(|(slot, _)| *slot == Slot::BaseColor));
    let paper = image.map_or(paper, |(_, texture)| {
        let image = &tables.textures.images[texture.image.index()];
        // Its smallest level is one texel.
        let mean = tables.textures.texel(image, image.levels.len() - 1, 0, 0);
        std::array::from_fn(|k| paper[k] * mean[k])
    });
    let paper = paper.map(|c| c.clamp(0.0, 1.0));
    // Patterns are of this model.
    let model = match own.model {
        Model::Phong { .. } => Material::default().model,
        model => model,
    };
    let base_color = paper;
    let material = builder.material(
        &name,
        Material {
            base_color,
            model,
            ..own
        },
    );
    if let Some([from, to]) = way {
        let wrap = Wrap::Repeat;
        let colors = lines(paper);
        let pattern = builder.pattern(Pattern::Gradient {
            colors,
            from,
            to,
            wrap,
        });
        let texturing = Texturing {
            base_color: Some(pattern),
            ..Texturing::default()
        };
        builder.texture(material, texturing, &[]);
    }
    material
}

/// Returns the colours of a period, whose ends are in the middle of a line's dark part.
fn lines(paper: Rgb) -> Vec<Rgb> {
    // Of linear light: a fifth of it is dark beside the whole, and on what is nearly black lines
    // have to be lighter.
    let is_dark = paper.iter().sum::<f32>() < 0.15;
    let ink = match is_dark {
        true => mixed(paper, [1.0; 3], 0.3),
        false => paper.map(|c| c * 0.2),
    };
    let color = |step: usize| {
        if step == 0 || step == 1 || step == STEPS {
            ink
        } else {
            paper
        }
    };
    (0..=STEPS).map(color).collect()
}

#[cfg(test)]
#[path = "hatching_tests.rs"]
mod tests;
