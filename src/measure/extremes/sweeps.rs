//! The table of sweeps, each from the easy to the extreme.

use super::Case;
use super::cases::{
    AWAY, along_planes, chain, decades, directed, every, near_edges, placed, placed_from, power,
    scaled, seen, sheared, slivers, small_spheres, tangent, turned,
};
use super::objects::{Stand, place, rotation, shapes};
use super::rays::{Random, at_targets};
use glam::{DAffine3, DMat3, DVec3};
use lanecast_model::scene::SceneBuilder;

/// The objects of a sweep.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subject {
    Triangles,
    /// Spheres, ellipsoids, cylinders, cones, boxes, polyhedra, polygons and
    /// half-spaces.
    Solids,
}

impl Subject {
    pub fn name(self) -> &'static str {
        match self {
            Subject::Triangles => "triangles",
            Subject::Solids => "solids",
        }
    }
}

pub struct Sweep {
    /// The name for `--only`.
    pub name: &'static str,
    /// The title for readers.
    pub title: &'static str,
    /// Meaning of the axis' values.
    pub axis: &'static str,
    /// Subjects, each of which makes a sweep of its own.
    pub subjects: &'static [Subject],
    /// Values of the axis, from the easy to the extreme.
    pub values: fn() -> Vec<f64>,
    /// Builds the scene and that many rays at a value.
    pub case: fn(Subject, f64, usize, &mut Random) -> Case,
}

/// Boxes are f32: boxes of scenes below f32's range are meaningless, and structures
/// lose the primitives in them.
const RANGE: &str = "the boxes of structures are f32, and these numbers are below its range";

impl Sweep {
    /// Returns why `guarded` and `exact` are known to fall short of exact arithmetic at
    /// this value; `None` where they guarantee their answers.
    pub fn known_gap(&self, value: f64) -> Option<&'static str> {
        (self.name == "underflow" && value <= 1e-44).then_some(RANGE)
    }
}

const TRIANGLES: &[Subject] = &[Subject::Triangles];
const SOLIDS: &[Subject] = &[Subject::Solids];
const BOTH: &[Subject] = &[Subject::Triangles, Subject::Solids];

pub const SWEEPS: &[Sweep] = &[
    Sweep {
        name: "small",
        title: "A small scene, seen from as near",
        axis: "size of the scene",
        subjects: BOTH,
        values: || decades(0, -9),
        case: scaled,
    },
    Sweep {
        name: "large",
        title: "A large scene, seen from as far",
        axis: "size of the scene",
        subjects: BOTH,
        values: || decades(0, 9),
        case: scaled,
    },
    Sweep {
        name: "far-camera",
        title: "Rays that come from far away",
        axis: "distance in radii",
        subjects: BOTH,
        values: || decades(0, 9),
        case: |subject, value, rays, random| {
            let mut scene = SceneBuilder::default();
            let shapes = shapes(subject, &mut scene, &Stand::HERE);
            place(&mut scene, &shapes, None);
            let rays = at_targets(rays, 4.0 * value, random, |r| r.in_ball());
            Case { scene, rays }
        },
    },
    Sweep {
        name: "offset",
        title: "Object and camera far from the origin, the object by its own numbers",
        axis: "distance in radii",
        subjects: BOTH,
        values: || decades(0, 9),
        case: |subject, value, rays, random| {
            let stand = Stand {
                middle: AWAY * value,
                size: 1.0,
            };
            seen(subject, &stand, rays, random)
        },
    },
    Sweep {
        name: "offset-placed",
        title: "Object and camera far from the origin, the object by a transform",
        axis: "distance in radii",
        subjects: BOTH,
        values: || decades(0, 9),
        case: |subject, value, rays, random| {
            let map = DAffine3::from_translation(AWAY * value);
            placed(subject, map, rays, random)
        },
    },
    Sweep {
        name: "grazing",
        title: "Rays along a plane of triangles",
        axis: "sine of the angle",
        subjects: TRIANGLES,
        values: || decades(0, -12),
        case: |_, value, rays, random| along_planes(value, rays, random),
    },
    Sweep {
        name: "tangent",
        title: "Rays that just meet or just miss a sphere",
        axis: "distance from the silhouette in radii",
        subjects: SOLIDS,
        values: || decades(-1, -16),
        case: |_, value, rays, random| tangent(value, rays, random),
    },
    Sweep {
        name: "edges",
        title: "Rays near the edges and corners of a mesh",
        axis: "distance from the edge in edges",
        subjects: TRIANGLES,
        values: || decades(-1, -17),
        case: |_, value, rays, random| near_edges(value, rays, random),
    },
    Sweep {
        name: "slivers",
        title: "Triangles from squat to sliver",
        axis: "height over base",
        subjects: TRIANGLES,
        values: || decades(0, -8),
        case: |_, value, rays, random| slivers(value, rays, random),
    },
    Sweep {
        name: "small-spheres",
        title: "Spheres that are small for their distance",
        axis: "radius over distance",
        subjects: SOLIDS,
        values: || decades(-1, -9),
        case: |_, value, rays, random| small_spheres(value, rays, random),
    },
    Sweep {
        name: "needles",
        title: "Objects squeezed along two axes",
        axis: "thickness over length",
        subjects: BOTH,
        values: || decades(0, -9),
        case: |subject, value, rays, random| {
            let scale = DVec3::new(value, value, 1.0);
            let map = rotation(random) * DMat3::from_diagonal(scale);
            placed(subject, DAffine3::from_mat3(map), rays, random)
        },
    },
    Sweep {
        name: "pancakes",
        title: "Objects squeezed along one axis",
        axis: "thickness over width",
        subjects: BOTH,
        values: || decades(0, -9),
        case: |subject, value, rays, random| {
            let scale = DVec3::new(1.0, value, 1.0);
            let map = rotation(random) * DMat3::from_diagonal(scale);
            placed(subject, DAffine3::from_mat3(map), rays, random)
        },
    },
    Sweep {
        name: "condition",
        title: "Objects sheared and squeezed by a transform",
        axis: "condition of the transform",
        subjects: BOTH,
        values: || decades(0, 12),
        case: |subject, value, rays, random| placed(subject, sheared(value, random), rays, random),
    },
    Sweep {
        name: "far-condition",
        title: "Sheared and squeezed objects, by rays that come from a million radii away",
        axis: "condition of the transform",
        subjects: BOTH,
        values: || decades(0, 9),
        case: |subject, value, rays, random| {
            let map = sheared(value, random);
            placed_from(1e6, subject, map, rays, random)
        },
    },
    Sweep {
        name: "chain",
        title: "Instances in instances: turned, scaled and moved at each level",
        axis: "levels",
        subjects: BOTH,
        values: || [1, 2, 3, 5, 7, 10, 15, 20, 30, 40].map(f64::from).to_vec(),
        case: |subject, value, rays, random| chain(subject, value as usize, rays, random),
    },
    Sweep {
        name: "short-directions",
        title: "Short directions, down to denormal ones",
        axis: "length of the direction",
        subjects: BOTH,
        values: || {
            [
                every(5, 0, -35),
                [-37, -38, -40, -42, -44, -45].map(power).to_vec(),
            ]
            .concat()
        },
        case: directed,
    },
    Sweep {
        name: "long-directions",
        title: "Long directions, up to the largest",
        axis: "length of the direction",
        subjects: BOTH,
        values: || [every(5, 0, 35), decades(36, 38)].concat(),
        case: directed,
    },
    Sweep {
        name: "skew-directions",
        title: "Directions of which one part is tiny beside the others",
        axis: "the part over the largest",
        subjects: BOTH,
        values: || every(5, 0, -45),
        case: |subject, value, rays, random| {
            turned(subject, rays, random, |dir, random| {
                let k = random.below(3);
                let mut dir = dir.to_array();
                dir[k] *= value;
                dir
            })
        },
    },
    Sweep {
        name: "zero-directions",
        title: "Directions along planes and axes, and none at all",
        axis: "parts that are zero",
        subjects: BOTH,
        values: || vec![1.0, 2.0, 3.0],
        case: |subject, value, rays, random| {
            turned(subject, rays, random, |dir, random| {
                let first = random.below(3);
                let mut dir = dir.to_array();
                for i in 0..value as usize {
                    // Zeros of either sign.
                    dir[(first + i) % 3] *= 0.0;
                }
                dir
            })
        },
    },
    Sweep {
        name: "underflow",
        title: "Scenes down to the least numbers",
        axis: "size of the scene",
        subjects: BOTH,
        values: || {
            let single = [-10, -15, -20, -25, -30, -35, -38, -40, -42, -44, -45];
            let double = [-60, -80, -100, -150, -160, -200, -300, -308, -320];
            single.into_iter().chain(double).map(power).collect()
        },
        case: scaled,
    },
    Sweep {
        name: "overflow",
        title: "Scenes up to the largest numbers",
        axis: "size of the scene",
        subjects: BOTH,
        values: || {
            let single = [10, 15, 18, 20, 25, 30, 35, 36, 37, 38, 39];
            let double = [60, 80, 100, 150, 160, 200, 300, 307];
            single.into_iter().chain(double).map(power).collect()
        },
        case: scaled,
    },
];
