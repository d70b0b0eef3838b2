//! Pictures that show what rays meet or cost: what they mean, and that only the structure
//! shows, and only in costs.

use lanecast::internals::plan::{Accel, Choices, LaneCount};
use lanecast::internals::render::{AovSet, Backdrop, Cost, Inspection, Integrator, TileOrder};
use lanecast::shapes::Sphere;
use lanecast::{
    Camera, DVec3, Edge, MeshData, Picture, RenderConfig, Scene, SceneBuilder, Tracer,
    TracerOptions,
};

/// Two balls and a triangle before nothing.
fn scene() -> Scene {
    let mut scene = SceneBuilder::default();
    for x in [-1.2, 1.2] {
        let ball = Sphere {
            center: DVec3::new(x, 0.0, 0.0),
            radius: 1.0,
        };
        let ball = scene.sphere("", ball);
        scene.instance("", Edge::shape(ball));
    }
    let triangle = MeshData {
        positions: vec![[-1.0, 1.5, 0.0], [1.0, 1.5, 0.0], [0.0, 3.0, 0.0]],
        triangles: vec![[0, 1, 2]],
        ..MeshData::default()
    };
    let triangle = scene.mesh("", &triangle);
    scene.instance("", Edge::shape(triangle));
    scene.camera(
        "",
        Camera::perspective(
            DVec3::new(0.0, 1.0, 9.0),
            DVec3::new(0.0, 1.0, 0.0),
            DVec3::Y,
            35.0,
        ),
    );
    scene.finish().unwrap()
}

fn picture(what: Inspection, choices: Choices, tiles: TileOrder, threads: usize) -> Picture {
    let config = RenderConfig {
        width: 75,
        height: 50,
        integrator: Integrator::Inspect(what),
        backdrop: Backdrop::Transparent,
        tiles,
        aovs: AovSet {
            normal: true,
            depth: true,
            albedo: true,
            instance_id: true,
            ..AovSet::default()
        },
        ..RenderConfig::default()
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
    pool.build().unwrap().install(|| {
        let options = TracerOptions {
            choices,
            ..TracerOptions::default()
        };
        let tracer = Tracer::new(&scene(), &options).unwrap();
        tracer
            .render(&config, &Default::default(), &|_| ())
            .unwrap()
    })
}

fn plain(what: Inspection) -> Picture {
    picture(what, Choices::default(), TileOrder::Spread, 1)
}

fn by(accel: Accel, lanes: LaneCount) -> Choices {
    Choices {
        accel: Some(accel),
        lanes,
        ..Choices::default()
    }
}

#[test]
fn what_rays_meet_does_not_depend_on_how() {
    for what in [
        Inspection::Normals,
        Inspection::Uv,
        Inspection::Ids,
        Inspection::Depth,
        Inspection::Albedo,
        Inspection::Edges,
    ] {
        let expected = plain(what).color;
        for (accel, lanes, tiles, threads) in [
            (Accel::Bvh, LaneCount::Auto, TileOrder::Small, 3),
            (Accel::Kd, LaneCount::One, TileOrder::Reverse, 2),
            (Accel::Linear, LaneCount::Auto, TileOrder::Spread, 2),
        ] {
            let found = picture(what, by(accel, lanes), tiles, threads).color;
            assert!(found == expected, "{what:?} {accel:?}");
        }
    }
}

#[test]
fn costs_depend_on_the_structure_alone() {
    for accel in [Accel::Kd, Accel::Linear] {
        let what = Inspection::Heat(Cost::Tests);
        let of = |lanes, tiles, threads| picture(what, by(accel, lanes), tiles, threads).color;
        let expected = of(LaneCount::Auto, TileOrder::Spread, 1);
        assert!(of(LaneCount::One, TileOrder::Small, 3) == expected);
        assert!(of(LaneCount::Auto, TileOrder::Reverse, 2) == expected);
        // A list tests all shapes for every ray, a tree hardly any beside them.
        let dark = expected.iter().filter(|color| **color == [0.0; 3]).count();
        assert_eq!(dark == 0, accel == Accel::Linear, "{dark}");
    }
}

#[test]
fn colours_mean_what_is_there() {
    let normals = plain(Inspection::Normals);
    let (ids, alpha) = (normals.instance_id.unwrap(), normals.alpha.unwrap());
    let facing = normals.normal.unwrap();
    let shown = normals.color.iter().zip(&facing);
    for (pixel, (color, normal)) in shown.enumerate() {
        let is_met = ids[pixel] != Picture::NO_ID;
        assert_eq!(alpha[pixel], f32::from(u8::from(is_met)));
        for k in 0..3 {
            let expected = if is_met { 0.5 + 0.5 * normal[k] } else { 0.0 };
            assert!((color[k] - expected).abs() < 1e-6);
        }
    }
    let uv = plain(Inspection::Uv);
    for (pixel, [u, v, w]) in uv.color.iter().enumerate() {
        match ids[pixel] {
            2 => assert!(u.min(*v) >= 0.0 && u + v <= 1.000_001 && *w == 0.0),
            Picture::NO_ID => assert_eq!([*u, *v, *w], [0.0; 3]),
            _ => assert!((0.0..=1.0).contains(u) && (0.0..=1.0).contains(v) && *w == 0.0),
        }
    }
    let albedo = plain(Inspection::Albedo);
    let of_layer = albedo.albedo.unwrap();
    assert!(albedo.color == of_layer && of_layer.contains(&[0.6; 3]));
    // The box is 3 high, as deep as the balls, and seen from 9 in front of its middle; the eye is
    // level with 1, and looks straight ahead.
    let depth = plain(Inspection::Depth);
    for (color, depth) in depth.color.iter().zip(depth.depth.unwrap()) {
        match depth.is_finite() {
            true => {
                let expected = 1.0 - 0.96 * (depth - 8.0) / 2.0;
                assert!((color[0] - expected).abs() < 1e-5, "{color:?} {depth}");
            }
            false => assert_eq!(*color, [0.0; 3]),
        }
    }
    let colors = plain(Inspection::Ids).color;
    let mut met: Vec<(u64, [u32; 3])> = ids
        .iter()
        .zip(&colors)
        .map(|(id, color)| (*id, color.map(f32::to_bits)))
        .collect();
    met.sort_unstable();
    met.dedup();
    // One colour for each of three instances, and for nothing.
    assert_eq!(met.len(), 4, "{met:?}");
    met.dedup_by_key(|row| row.1);
    assert_eq!(met.len(), 4);
}
