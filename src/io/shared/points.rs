//! Points and segments of a file, drawn as spheres and capsules.

use crate::geom::{Cylinder, Sphere};
use crate::scene::{Edge, Material, MaterialId, SceneBuilder, linear_from_srgb};
use crate::{ImportReport, LoadError, LoadOptions};
use glam::DVec3;
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// The most spheres and cylinders that a file's points and segments become; each takes some 90
/// bytes, and about as much again in trees.
const MOST_DRAWN: usize = 1 << 24;

/// The most colours that become materials as they are; of more, 2¹⁵ are left.
const MOST_COLORS: usize = 1 << 16;

/// Segments shorter than this share of the radius have no cylinder: between the balls at their
/// ends it would be 10⁻¹³ of the radius wide.
const SHORTEST: f64 = 1e-6;

/// A colour in sRGB.
pub type Code = [u8; 3];

/// Points, and segments between some of them.
#[derive(Clone, Debug, Default)]
pub struct Points {
    pub positions: Vec<[f64; 3]>,
    /// None, or one for each position; `None` for a point without a colour.
    pub colors: Vec<Option<Code>>,
    /// Rows of positions.
    pub segments: Vec<[u32; 2]>,
}

/// Points, and the material of those without a colour.
pub type Drawn = (Option<MaterialId>, Points);

/// Adds an instance of a node of spheres, and of cylinders between them. Adds nothing if there
/// are no points, or no radius is given. Fails if they are too many.
pub fn add_points(
    path: &Path,
    groups: &[Drawn],
    options: &LoadOptions,
    scene: &mut SceneBuilder,
    report: &mut ImportReport,
) -> Result<(), LoadError> {
    let Some(radius) = options.point_radius else {
        return Ok(());
    };
    let drawn = groups.iter();
    let drawn: usize = drawn
        .map(|(_, all)| all.positions.len() + all.segments.len())
        .sum();
    if drawn == 0 {
        return Ok(());
    }
    if drawn > MOST_DRAWN {
        return Err(LoadError::Unsupported {
            path: path.into(),
            what: format!("drawing {drawn} points and segments, more than {MOST_DRAWN},"),
            remedy: Some("leave out --point-radius, or thin the points out".into()),
        });
    }
    let mut colors = Colors::new(groups, report);
    let mut edges: Vec<Edge> = Vec::with_capacity(drawn);
    for (material, all) in groups {
        let at = |v: u32| DVec3::from_array(all.positions[v as usize]);
        let finite = |v: u32| at(v).is_finite();
        let mut material = |v: u32, scene: &mut SceneBuilder| {
            let color = all.colors.get(v as usize).copied().flatten();
            color.map_or(*material, |color| Some(colors.material(color, scene)))
        };
        let mut lost = 0;
        for v in 0..all.positions.len() as u32 {
            if !finite(v) {
                lost += 1;
                continue;
            }
            let center = at(v);
            let ball = scene.sphere("", Sphere { center, radius });
            let material = material(v, scene);
            edges.push(Edge {
                material,
                ..Edge::shape(ball)
            });
        }
        report.add_many("point that is not finite", lost);
        for [a, b] in &all.segments {
            let (base, top) = (at(*a), at(*b));
            if !finite(*a) || !finite(*b) || (top - base).length() <= SHORTEST * radius {
                continue;
            }
            let side = scene.cylinder(
                "",
                Cylinder {
                    base,
                    top,
                    radius,
                    open: true,
                },
            );
            let material = material(*a, scene);
            edges.push(Edge {
                material,
                ..Edge::shape(side)
            });
        }
    }
    if !edges.is_empty() {
        let node = scene.node("points", &edges);
        scene.instance("", Edge::node(node));
    }
    Ok(())
}

/// Materials of colours.
struct Colors {
    of: HashMap<Code, MaterialId>,
    are_too_many: bool,
}

impl Colors {
    fn new(groups: &[Drawn], report: &mut ImportReport) -> Colors {
        let mut seen = HashSet::new();
        let all = groups
            .iter()
            .flat_map(|(_, all)| all.colors.iter().flatten());
        let are_too_many = all.copied().any(|color| {
            seen.insert(color);
            seen.len() > MOST_COLORS
        });
        if are_too_many {
            report.shown_as("set of colours of points, rounded to 5 bits a channel");
        }
        Colors {
            of: HashMap::new(),
            are_too_many,
        }
    }

    /// Returns the material of a colour.
    fn material(&mut self, color: Code, scene: &mut SceneBuilder) -> MaterialId {
        let color = match self.are_too_many {
            // The nearest of 32 steps from 0 to 255.
            true => color.map(|c| ((u32::from(c) * 31 + 127) / 255 * 255 / 31) as u8),
            false => color,
        };
        let made = || {
            let linear = color.map(|c| linear_from_srgb(f64::from(c) / 255.0) as f32);
            let material = Material {
                base_color: linear,
                ..Material::default()
            };
            scene.material("", material)
        };
        *self.of.entry(color).or_insert_with(made)
    }
}
