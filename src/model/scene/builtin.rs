//! The built-in scene: a sphereflake (Haines 1987, balls) of gold among glass and mirrors,
//! on a floor of boxes. A program builds it, without any file.

use super::*;
use crate::geom::{Cone, Cuboid, Cylinder, Ellipsoid, HalfSpace, Sphere};
use glam::DVec3;

/// The levels of the flake below its middle sphere: 1 + 9 + 81 + 729 + 6,561 spheres.
const LEVELS: u32 = 4;

pub fn builtin() -> Result<Scene, SceneError> {
    let scene = &mut SceneBuilder::default();
    floor(scene);
    flake(scene);
    guests(scene);

    scene.background([0.66, 0.6, 0.56]);
    scene.camera(
        "front",
        Camera::perspective(
            DVec3::new(2.1, 2.7, 6.6),
            DVec3::new(0.05, 0.72, 0.0),
            DVec3::Y,
            31.0,
        ),
    );
    scene.light(Light::Point {
        position: DVec3::new(-4.5, 7.0, 5.0),
        intensity: [210.0, 195.0, 170.0],
        falloff: Falloff::InverseSquare,
        radius: 0.0,
    });
    scene.light(Light::Directional {
        direction: DVec3::new(-1.0, -0.9, -0.6),
        irradiance: [0.75, 0.9, 1.15],
        angle: 0.0,
    });
    std::mem::take(scene).finish()
}

/// Adds a golden middle sphere with nine smaller ones on it, and so on.
fn flake(scene: &mut SceneBuilder) {
    let metal = |rgb: Rgb, roughness| Material::metallic_roughness(rgb, 1.0, roughness);
    let gold = scene.material("gold", metal([1.0, 0.74, 0.32], 0.0));
    let rose = scene.material(
        "rose",
        Material::metallic_roughness([0.86, 0.42, 0.3], 0.0, 0.35),
    );
    let pearl = scene.material(
        "pearl",
        Material::metallic_roughness([0.92, 0.85, 0.74], 0.0, 0.3),
    );
    let mut open = vec![(DVec3::new(0.0, 1.0, 0.0), 0.62, DVec3::Y, 0)];
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

/// Adds one shape of each other kind.
fn guests(scene: &mut SceneBuilder) {
    let dull = Material::metallic_roughness;
    let glass = scene.material(
        "glass",
        Material {
            transmission: 1.0,
            ior: 1.5,
            ..dull([0.98, 1.0, 0.99], 0.0, 0.0)
        },
    );
    let mirror = scene.material("mirror", dull([0.9, 0.92, 0.95], 1.0, 0.0));
    let teal = scene.material("teal", dull([0.04, 0.42, 0.45], 0.0, 0.3));
    let orange = scene.material("orange", dull([0.9, 0.36, 0.06], 0.0, 0.4));

    let sphere = |center, radius| Sphere { center, radius };
    let ball = scene.sphere("glass ball", sphere(DVec3::new(1.35, 0.42, 1.35), 0.42));
    scene.instance("", Edge::shape(ball).material(glass));
    let ball = scene.sphere("mirror ball", sphere(DVec3::new(-1.75, 0.5, 0.75), 0.5));
    scene.instance("", Edge::shape(ball).material(mirror));
    let cone = scene.cone(
        "cone",
        Cone {
            base: DVec3::new(-0.62, 0.0, 1.75),
            top: DVec3::new(-0.62, 0.75, 1.75),
            base_radius: 0.34,
            top_radius: 0.0,
            open: false,
        },
    );
    scene.instance("", Edge::shape(cone).material(orange));
    let tube = scene.cylinder(
        "tube",
        Cylinder {
            base: DVec3::new(1.95, 0.0, -0.35),
            top: DVec3::new(1.95, 0.95, -0.35),
            radius: 0.36,
            open: true,
        },
    );
    scene.instance("", Edge::shape(tube).material(teal));
    let pebble = scene.ellipsoid(
        "pebble",
        Ellipsoid {
            center: DVec3::new(0.45, 0.17, 2.05),
            radii: DVec3::new(0.36, 0.17, 0.24),
        },
    );
    scene.instance("", Edge::shape(pebble).material(teal));
}

/// Adds one box, 31 × 31 times, at slightly different heights and in two tones.
fn floor(scene: &mut SceneBuilder) {
    let light = scene.material(
        "light stone",
        Material::metallic_roughness([0.62, 0.6, 0.56], 0.0, 0.6),
    );
    let dark = scene.material(
        "dark stone",
        Material::metallic_roughness([0.2, 0.22, 0.26], 0.0, 0.35),
    );
    let under = scene.half_space(
        "ground",
        HalfSpace {
            normal: DVec3::Y,
            offset: -0.06,
        },
    );
    scene.instance("", Edge::shape(under).material(dark));
    let side = 0.245;
    let tile = scene.cuboid(
        "tile",
        Cuboid {
            min: DVec3::new(-side, -0.3, -side),
            max: DVec3::new(side, 0.0, side),
        },
    );
    let mut tiles = Vec::new();
    for x in -15..=15_i32 {
        for z in -15..=15_i32 {
            // Five fixed heights, so that no two neighbours are alike.
            let step = (x * 7 + z * 13).rem_euclid(5);
            let place = glam::DAffine3::from_translation(DVec3::new(
                f64::from(x) * 0.5,
                f64::from(step) * -0.008,
                f64::from(z) * 0.5,
            ));
            let material = if (x + z).rem_euclid(2) == 0 {
                light
            } else {
                dark
            };
            let edge = Edge::shape(tile).material(material);
            tiles.push(edge.transform(scene.transform(place.into())));
        }
    }
    let tiles = scene.node("tiles", &tiles);
    scene.instance("floor", Edge::node(tiles));
}
