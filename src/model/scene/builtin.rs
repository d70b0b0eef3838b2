//! The built-in scene: a golden sphereflake (Haines 1987, balls) among glass, copper and solids
//! that are cut and drilled, under a large soft lamp. A program builds it, without any file.

use super::*;
use crate::geom::{Cuboid, Cylinder, HalfSpace, Sphere};
use glam::{DAffine3, DVec3};

/// The levels of the flake below its middle sphere: 1 + 9 + 81 + 729 spheres.
const LEVELS: u32 = 3;

pub fn builtin() -> Result<Scene, SceneError> {
    let scene = &mut SceneBuilder::default();
    flake(scene);
    balls(scene);
    solids(scene);
    lights(scene);
    let ground = scene.half_space(
        "ground",
        HalfSpace {
            normal: DVec3::Y,
            offset: 0.0,
        },
    );
    let stone = scene.material("stone", dull([0.50, 0.48, 0.45], 0.55));
    scene.instance("", Edge::shape(ground).material(stone));
    scene.camera(
        "front",
        Camera::perspective(
            DVec3::new(3.3, 3.6, 7.4),
            DVec3::new(0.1, 0.62, 0.15),
            DVec3::Y,
            27.0,
        ),
    );
    std::mem::take(scene).finish()
}

fn dull(color: Rgb, roughness: f32) -> Material {
    Material::metallic_roughness(color, 0.0, roughness)
}

fn metal(color: Rgb, roughness: f32) -> Material {
    Material::metallic_roughness(color, 1.0, roughness)
}

/// Adds a large lamp on the left, and a sky that fills the shadows.
fn lights(scene: &mut SceneBuilder) {
    let corners = [
        DVec3::new(-7.4, 4.6, -3.2),
        DVec3::new(-2.8, 8.8, -3.2),
        DVec3::new(-2.8, 8.8, 5.4),
        DVec3::new(-7.4, 4.6, 5.4),
    ];
    let lamp = scene.polygon("lamp", &corners, &[]);
    let shine = scene.material(
        "lamp",
        Material {
            emission: [6.2, 5.5, 4.6],
            ..dull([0.0; 3], 1.0)
        },
    );
    scene.instance("", Edge::shape(lamp).material(shine));
    scene.environment(Environment::uniform([0.34, 0.39, 0.47]));
}

/// Adds a golden middle sphere with nine smaller ones on it, and so on.
fn flake(scene: &mut SceneBuilder) {
    let gold = scene.material("gold", metal([1.0, 0.74, 0.32], 0.25));
    let rose = scene.material("rose", dull([0.8, 0.3, 0.22], 0.35));
    let pearl = scene.material("pearl", dull([0.9, 0.86, 0.8], 0.25));
    let mut open = vec![(DVec3::new(0.0, 1.02, 0.0), 0.62, DVec3::Y, 0)];
    while let Some((center, radius, up, level)) = open.pop() {
        let ball = scene.sphere("", Sphere { center, radius });
        let material = [gold, pearl, rose][level as usize % 3];
        scene.instance("", Edge::shape(ball).material(material));
        if level == LEVELS {
            continue;
        }
        // Six spheres around the equator and three above, about the outward direction.
        let side = up.any_orthonormal_vector();
        let front = up.cross(side);
        let small = radius / 3.0;
        for k in 0..9 {
            let (turn, height): (f64, f64) = if k < 6 {
                (f64::from(k) / 6.0, 0.0)
            } else {
                (f64::from(k) / 3.0 + 1.0 / 12.0, 0.87)
            };
            let angle = turn * std::f64::consts::TAU;
            let flat = side * libm::cos(angle) + front * libm::sin(angle);
            let out = (flat * (1.0 - height * height).sqrt() + up * height).normalize();
            open.push((center + out * (radius + small), small, out, level + 1));
        }
    }
}

/// Adds a ball of green glass and one of copper.
fn balls(scene: &mut SceneBuilder) {
    let glass = scene.material(
        "glass",
        Material {
            transmission: 1.0,
            ior: 1.5,
            layers: Layers {
                attenuation_color: [0.55, 0.85, 0.72],
                attenuation_distance: 1.2,
                ..Layers::default()
            },
            ..dull([1.0; 3], 0.0)
        },
    );
    let copper = scene.material("copper", metal([0.93, 0.55, 0.4], 0.28));
    for (name, center, radius, material) in [
        ("glass ball", DVec3::new(1.55, 0.45, 1.35), 0.45, glass),
        ("copper ball", DVec3::new(-1.55, 0.42, 1.15), 0.42, copper),
    ] {
        let ball = scene.sphere(name, Sphere { center, radius });
        scene.instance(name, Edge::shape(ball).material(material));
    }
}

/// Adds solids made of others: a drilled die, whose bores have a colour of their own, and a
/// lacquered ring.
fn solids(scene: &mut SceneBuilder) {
    let yellow = scene.material("yellow", dull([0.92, 0.62, 0.1], 0.45));
    let dark = scene.material("dark", dull([0.12, 0.14, 0.18], 0.4));
    let half = DVec3::splat(0.42);
    let block = scene.cuboid(
        "block",
        Cuboid {
            min: -half,
            max: half,
        },
    );
    let ball = scene.sphere(
        "rounding",
        Sphere {
            center: DVec3::ZERO,
            radius: 0.56,
        },
    );
    let die = scene.csg(
        "die",
        Operator::Intersection,
        &[Operand::shape(block), Operand::shape(ball)],
    );
    let mut parts = vec![Operand::shape(die).material(yellow)];
    for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
        let bore = scene.cylinder("bore", tube(-axis, axis, 0.26));
        parts.push(Operand::shape(bore).material(dark));
    }
    let drilled = scene.csg("drilled die", Operator::Difference, &parts);
    let turned = DAffine3::from_rotation_y(28_f64.to_radians());
    let place = DAffine3::from_translation(DVec3::new(2.25, 0.42, -0.45)) * turned;
    let place = scene.transform(place.into());
    scene.instance("drilled die", Edge::shape(drilled).transform(place));

    let lacquer = scene.material(
        "lacquer",
        Material {
            layers: Layers {
                clearcoat: 1.0,
                clearcoat_roughness: 0.03,
                ..Layers::default()
            },
            ..dull([0.03, 0.3, 0.33], 0.3)
        },
    );
    let middle = DVec3::new(0.25, 0.0, 2.15);
    let high = middle + DVec3::Y * 0.24;
    let disc = scene.cylinder("disc", tube(middle, high, 0.47));
    // The hole is longer than the disc: no skins are left at its ends.
    let hole = scene.cylinder("hole", tube(middle - DVec3::Y, high + DVec3::Y, 0.27));
    let parts = [disc, hole].map(Operand::shape);
    let ring = scene.csg("ring", Operator::Difference, &parts);
    scene.instance("ring", Edge::shape(ring).material(lacquer));
}

fn tube(base: DVec3, top: DVec3, radius: f64) -> Cylinder {
    Cylinder {
        base,
        top,
        radius,
        open: false,
    }
}
