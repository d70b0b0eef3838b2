//! Closed meshes as operands: which meshes are closed, and how lines cross them.

use super::asked::{Asked, RIGHT, agree, line, spans};
use super::laws::{are_one, laws};
use super::programs::{Leaf, Program, random_rays};
use super::shells::{aimed, cube, torus, turned};
use super::truth::Tree;
use crate::common::{Random, RayColumns, assets, campaign, kernels};
use glam::{DAffine3, DVec3};
use lanecast::internals::geom::{Cuboid, Sphere};
use lanecast::internals::io::{ImportReport, LoadOptions, import_mesh};
use lanecast::internals::scene::{
    Edge, Material, MeshData, Operand, Operator, SceneBuilder, SceneError, ShapeId, Tables,
    check_closed,
};
use lanecast::internals::shade::Surface;
use lanecast::internals::trace::{HitId, TURNED};

fn unit_box() -> Cuboid {
    let min = DVec3::splat(-1.0);
    Cuboid { min, max: -min }
}

fn alone(scene: &mut SceneBuilder, shape: ShapeId) -> ShapeId {
    scene.csg("part", Operator::Union, &[Operand::shape(shape)])
}

/// What is said of a mesh as an operand; `None` where it is one.
fn refused(mesh: &MeshData) -> Option<String> {
    let mut scene = SceneBuilder::default();
    let shape = scene.mesh("shell", mesh);
    let whole = alone(&mut scene, shape);
    scene.instance("", Edge::shape(whole));
    scene.finish().err().map(|e| e.to_string())
}

#[test]
fn meshes_that_are_not_closed_are_refused_by_their_edges() {
    let whole = cube(&unit_box(), 1);
    assert_eq!(refused(&whole), None);
    let has = |mesh: &MeshData, parts: &[&str]| {
        let said = refused(mesh).expect("it is refused");
        let all = ["union 'part' has mesh 'shell' as an operand: it is not closed"];
        for part in all.iter().chain(parts).chain(&["fill its holes"]) {
            let part = part.replace("union 'part'", "CSG solid 'part'");
            assert!(said.contains(&part), "{said}\n{part}");
        }
        said
    };

    let mut open = whole.clone();
    open.triangles.remove(3);
    let said = has(
        &open,
        &["3 open edges (of one triangle only), the first from ("],
    );
    assert!(!said.contains("duplicated"), "{said}");

    let mut over = whole.clone();
    over.triangles[5].swap(0, 1);
    has(
        &over,
        &["3 duplicated edges (which two triangles run along"],
    );

    // A fin on an edge between two corners of the cube.
    let mut fin = whole.clone();
    let [a, b, _] = fin.triangles[0];
    fin.positions.push([5.0, 5.0, 5.0]);
    fin.triangles.push([a, b, fin.positions.len() as u32 - 1]);
    let said = has(
        &fin,
        &[
            "2 open edges (of one triangle only) and 1 non-manifold edge (of three",
            "of triangle 0",
        ],
    );
    assert!(said.contains("(-1, "), "{said}");

    let flagged = MeshData {
        open: true,
        ..whole
    };
    assert!(refused(&flagged).unwrap().contains("leave out 'open'"));
}

#[test]
fn shells_that_touch_and_triangles_without_area_are_closed() {
    let low = cube(&unit_box(), 2);
    // Another cube beside it: they share an edge, which has four triangles.
    let corner = DVec3::new(1.0, 1.0, -1.0);
    let high = cube(
        &Cuboid {
            min: corner,
            max: corner + 2.0,
        },
        2,
    );
    let mut both = low.clone();
    let first = both.positions.len() as u32;
    both.positions.extend(&high.positions);
    let moved = high.triangles.iter().map(|t| t.map(|v| v + first));
    both.triangles.extend(moved);
    assert_eq!(refused(&both), None);

    // A side with a corner more, and a triangle without area that makes up for it.
    let mut split = cube(&unit_box(), 1);
    let [a, b, c] = split.triangles[0];
    let at = |v: u32| DVec3::from_array(split.positions[v as usize]);
    let middle = ((at(a) + at(b)) * 0.5).to_array();
    let m = split.positions.len() as u32;
    split.positions.push(middle);
    split.triangles[0] = [a, m, c];
    split
        .triangles
        .extend([[m, b, c], [a, b, m], [a, a, b], [c, c, c]]);
    assert_eq!(refused(&split), None);
    let [with, without] = [&split, &cube(&unit_box(), 1)].map(|mesh| {
        Asked::one(|scene| {
            let shape = scene.mesh("", mesh);
            alone(scene, shape)
        })
    });
    let rays = aimed(&split, &mut Random(5), 2_000);
    let [one, other] = [&with, &without].map(|asked| t_of_spans(asked, &rays));
    assert_eq!(one, other);
    agree(&with, &aimed(&split, &mut Random(6), 300));
}

/// Rounded, and whether it comes in there.
fn t_of_spans(asked: &Asked, rays: &RayColumns) -> Vec<Vec<(u64, bool)>> {
    let world = asked.world();
    let of_ray = |i: usize| {
        let (org, dir) = rays.ray(i);
        let (start, found) = spans(&world, asked.csg(), &line(org, dir));
        assert!(!start, "nothing closed is without end");
        let ends = found.iter();
        ends.map(|c| (c.root.rounded().to_bits(), c.enters))
            .collect()
    };
    (0..rays.len()).map(of_ray).collect()
}

/// A block and what is taken from it, with or without triangles.
fn bitten(by_mesh: bool, cells: u32) -> Asked {
    Asked::one(|scene| {
        let block = match by_mesh {
            true => scene.mesh("", &cube(&unit_box(), cells)),
            false => scene.cuboid("", unit_box()),
        };
        let bite = scene.cuboid(
            "",
            Cuboid {
                min: DVec3::new(-0.25, 0.0, -1.5),
                max: DVec3::new(0.5, 1.0, 1.5),
            },
        );
        let parts = [block, bite].map(Operand::shape);
        scene.csg("", Operator::Difference, &parts)
    })
}

/// No line that lies in the plane of a face: of a box that is part of it, and a mesh
/// is met as by a line beside it.
fn lies_in_a_face(org: [f64; 3], dir: [f64; 3]) -> bool {
    (0..3).any(|k| dir[k] == 0.0 && org[k].abs() == 1.0)
}

fn check_cubes(rays: usize, seed: u64) {
    let [faceted, plain] = [true, false].map(|by_mesh| bitten(by_mesh, 4));
    let random = &mut Random(seed);
    let mut all = aimed(&cube(&unit_box(), 4), random, rays / 2);
    let more = random_rays(random, rays / 2, 1.0);
    for i in 0..more.len() {
        let (org, dir) = more.ray(i);
        all.push(org.into(), dir);
    }
    let mut kept = RayColumns::default();
    for i in 0..all.len() {
        let (org, dir) = all.ray(i);
        if !lies_in_a_face(org, dir) {
            kept.push(org.into(), dir);
        }
    }
    assert!(kept.len() * 10 > all.len() * 7, "{}", kept.len());
    let [one, other] = [&faceted, &plain].map(|asked| t_of_spans(asked, &kept));
    for i in 0..kept.len() {
        assert_eq!(one[i], other[i], "{:?}", kept.ray(i));
    }
    for precision in RIGHT {
        let [one, other] =
            [&faceted, &plain].map(|asked| kept.closest(&asked.world(), &kernels(precision)));
        for i in 0..kept.len() {
            let ((t, id), (u, own)) = (one[i], other[i]);
            assert_eq!(id == HitId::NONE, own == HitId::NONE, "{:?}", kept.ray(i));
            let near = id == HitId::NONE || (t - u).abs() <= 1e-5 * (1.0 + t.abs());
            assert!(near, "{:?}: {t} {u}", kept.ray(i));
        }
    }
}

#[test]
fn a_cube_of_triangles_is_a_box() {
    check_cubes(campaign(100_000), 1);
}

/// Lines through edges and corners of a mesh: boundaries alternate and are even in
/// number, and every `step`th line's are what the reference says.
fn check_aimed(mesh: &MeshData, rays: usize, seed: u64, step: usize) {
    let asked = Asked::one(|scene| {
        let shape = scene.mesh("", mesh);
        alone(scene, shape)
    });
    let (world, reference) = (asked.world(), asked.reference());
    let rays = aimed(mesh, &mut Random(seed), rays);
    let mut exactly = 0;
    for i in 0..rays.len() {
        let (org, dir) = rays.ray(i);
        let (start, found) = spans(&world, asked.csg(), &line(org, dir));
        assert!(!start && found.len().is_multiple_of(2), "{org:?} {dir:?}");
        let t: Vec<f64> = found.iter().map(|c| c.root.rounded()).collect();
        exactly += usize::from([1.0, 2.0, 4.0].iter().any(|x| t.contains(x)));
        if i % step == 0 {
            let own = reference.crossings(org, dir.map(f64::from), 0, 0);
            let own: Vec<f64> = own.iter().map(|c| c.t).collect();
            assert_eq!(t, own, "{org:?} {dir:?}");
        }
    }
    assert!(exactly * 3 > rays.len(), "{exactly} of {}", rays.len());
    println!("{exactly} of {} through edges and corners", rays.len());
}

fn rings() -> [MeshData; 3] {
    [
        torus(DVec3::ZERO, [1.0, 0.5], [40, 24], 0.0),
        // So coarse that much of it lies in common planes, or has no area.
        torus(DVec3::ZERO, [1.0, 0.5], [16, 12], 0.125),
        cube(&unit_box(), 5),
    ]
}

#[test]
fn lines_through_edges_and_corners_come_in_and_go_out_in_turn() {
    for (seed, mesh) in (1..).zip(rings()) {
        check_aimed(&mesh, campaign(34_000), seed, 40);
    }
}

/// Published meshes that are closed, and the tests' own.
#[test]
#[ignore = "ten million lines, in minutes"]
fn ten_million_lines_through_edges_and_corners() {
    let mut meshes: Vec<MeshData> = rings().into();
    for name in [
        "spot_6k.glb",
        "bunny_7k.glb",
        "suzanne_1k.glb",
        "dragon_11k.glb",
    ] {
        let Some(folder) = assets() else { continue };
        let (options, mut report) = (LoadOptions::default(), ImportReport::default());
        let path = folder.join("meshes").join(name);
        let mesh = import_mesh(&path, &options, &mut report).unwrap();
        let mut tables = Tables::default();
        let id = tables.meshes.push(&mesh);
        match check_closed(&tables, id) {
            Ok(()) => meshes.push(mesh),
            Err(leaks) => println!("{name}: {leaks}"),
        }
    }
    println!("{} meshes", meshes.len());
    let each = campaign(10_000_000) / meshes.len();
    for (seed, mesh) in (100..).zip(&meshes) {
        check_aimed(mesh, each, seed, 1000);
    }
}

/// A ball in a ring, placed or not, near or far from where numbers begin.
fn ring_and_ball(mesh: &MeshData, at: DVec3, placed: bool) -> Asked {
    Asked::one(|scene| {
        let ring = scene.mesh("ring", mesh);
        let (center, radius) = (at + DVec3::X, 0.6);
        let ball = scene.sphere("ball", Sphere { center, radius });
        let mut ring = Operand::shape(ring);
        if placed {
            let turn = DAffine3::from_rotation_y(0.5);
            ring = ring.transform(scene.transform(turn.into()));
        }
        scene.csg("", Operator::Xor, &[Operand::shape(ball), ring])
    })
}

fn around(mesh: &MeshData, at: DVec3, seed: u64, count: usize) -> RayColumns {
    let random = &mut Random(seed);
    let near = random_rays(random, count / 2, 1.0);
    let mut rays = aimed(mesh, random, count / 2);
    for i in 0..near.len() {
        let (org, dir) = near.ray(i);
        rays.push(DVec3::from_array(org) + at, dir);
    }
    rays
}

#[test]
fn hits_normals_and_shadows_are_those_of_the_reference() {
    for (i, at) in [DVec3::ZERO, DVec3::new(1e3, 0.0, -3e4)]
        .into_iter()
        .enumerate()
    {
        for placed in [false, true] {
            let mesh = torus(at, [1.0, 0.4], [20, 12], 0.0);
            let asked = ring_and_ball(&mesh, at, placed);
            let rays = around(&mesh, at, 7 + i as u64, 1_500);
            let truth = agree(&asked, &rays);
            let hits = truth.iter().flatten().count();
            assert!(hits * 6 > truth.len(), "{hits} of {}", truth.len());
        }
    }
}

/// Its space is the solid's own again, once its centre counts.
#[test]
fn a_mesh_that_is_moved_back_to_its_centre_is_met_there() {
    for at in [DVec3::new(250.0, 40.0, -730.0), DVec3::X * 1024.0] {
        let mesh = torus(at, [1.0, 0.4], [20, 12], 0.0);
        let asked = Asked::one(|scene| {
            let ring = scene.mesh("ring", &mesh);
            let (center, radius) = (DVec3::X, 0.6);
            let ball = scene.sphere("ball", Sphere { center, radius });
            let back = scene.transform(DAffine3::from_translation(-at).into());
            let operands = [Operand::shape(ball), Operand::shape(ring).transform(back)];
            scene.csg("", Operator::Xor, &operands)
        });
        let here = torus(DVec3::ZERO, [1.0, 0.4], [20, 12], 0.0);
        let truth = agree(&asked, &around(&here, DVec3::ZERO, 8, 1_500));
        let hits = truth.iter().flatten().count();
        assert!(hits * 6 > truth.len(), "{hits} of {}", truth.len());
    }
}

/// Which way the triangles are wound makes no difference but to the mark that says so.
#[test]
fn a_mesh_turned_inside_out_is_the_same_solid() {
    let mesh = torus(DVec3::ZERO, [1.0, 0.4], [20, 12], 0.0);
    let [one, other] = [&mesh, &turned(&mesh)].map(|mesh| ring_and_ball(mesh, DVec3::ZERO, true));
    let rays = around(&mesh, DVec3::ZERO, 11, 4_000);
    assert_eq!(t_of_spans(&one, &rays), t_of_spans(&other, &rays));
    let worlds = [one.world(), other.world()];
    let mut of_triangles = 0;
    for precision in RIGHT {
        let [a, b] = [0, 1].map(|i: usize| rays.closest(&worlds[i], &kernels(precision)));
        for i in 0..rays.len() {
            let ((t, id), (u, own)) = (a[i], b[i]);
            if id == HitId::NONE {
                assert_eq!(own, HitId::NONE);
                continue;
            }
            let is_triangle = id.primitive & !TURNED > 0;
            let expected = id.primitive ^ if is_triangle { TURNED } else { 0 };
            assert_eq!((t, expected), (u, own.primitive));
            of_triangles += usize::from(is_triangle);
            let (org, dir) = rays.ray(i);
            let [n, m] = [(&worlds[0], id), (&worlds[1], own)]
                .map(|(world, id)| Surface::at(world, precision, org, dir, t, id));
            assert!(n.ng.dot(m.ng) > 0.999_999 && n.front == m.front);
        }
    }
    assert!(of_triangles > 500, "{of_triangles}");
}

/// Boxes by their triangles, and balls that become rings.
fn with_meshes(program: Program) -> Program {
    let of = |leaf: Leaf| match leaf {
        Leaf::Box(row) => Leaf::Shell(row),
        Leaf::Ball(row) => Leaf::Ring(row.center, row.radius),
        other => other,
    };
    let leaves = program.leaves.into_iter();
    Program {
        leaves: leaves.map(|(leaf, place)| (of(leaf), place)).collect(),
    }
}

fn check_programs(programs: usize, rays: usize, seed: u64) {
    for i in 0..programs as u64 {
        let random = &mut Random(seed + i);
        let count = 2 + random.below(8);
        let program = with_meshes(Program::random(random, count, i % 2 == 1));
        let most = 2 + random.below(15);
        let tree = program.tree(random, most);
        let asked = Asked::one(|scene| {
            let shapes = program.shapes(scene, 1.0);
            Tree::of(Operator::Union, [tree]).shape(scene, &shapes)
        });
        let rays = random_rays(random, rays, 1.0);
        agree(&asked, &rays);
        let (world, reference) = (asked.world(), asked.reference());
        for i in 0..rays.len() {
            let (org, dir) = rays.ray(i);
            let (_, found) = spans(&world, asked.csg(), &line(org, dir));
            let found = found.iter().map(|c| c.root.rounded());
            let own = reference.crossings(org, dir.map(f64::from), 0, 0);
            assert!(found.eq(own.iter().map(|c| c.t)), "{i}: {org:?} {dir:?}");
        }
    }
}

#[test]
fn random_programs_with_meshes_are_as_the_reference_says() {
    check_programs(campaign(60), 16, 70);
}

#[test]
#[ignore = "a hundred thousand rays before the reference, in minutes"]
fn random_programs_with_meshes_are_as_the_reference_says_a_hundred_thousand_times() {
    check_programs(campaign(4_000), 25, 7_000);
}

#[test]
fn the_laws_of_set_algebra_hold_with_meshes() {
    for i in 0..12 {
        let random = &mut Random(i);
        let count = 2 + random.below(6);
        let program = with_meshes(Program::random(random, count, i % 2 == 1));
        let solids = [(); 3].map(|()| {
            let most = 1 + random.below(9);
            program.tree(random, most)
        });
        for (name, a, b) in laws(&solids) {
            let rays = random_rays(random, 8, 1.0);
            are_one(&program, [&a, &b], &rays, &format!("{name}, {i}"));
        }
    }
}

/// What is nearest to a triangle without hiding it counts: the operand's material,
/// else the mesh's own.
#[test]
fn surfaces_of_a_mesh_have_its_materials() {
    let of = |own: bool| {
        Asked::one(|scene| {
            let paint = |scene: &mut SceneBuilder, name| scene.material(name, Material::default());
            let (first, second, outer) =
                (paint(scene, "a"), paint(scene, "b"), paint(scene, "outer"));
            let mesh = MeshData {
                parts: vec![(0, Some(first)), (2, Some(second))],
                ..cube(&unit_box(), 1)
            };
            let mut operand = Operand::shape(scene.mesh("", &mesh));
            if !own {
                operand = operand.material(outer);
            }
            scene.csg("", Operator::Union, &[operand])
        })
    };
    let mut rays = RayColumns::default();
    // The first two triangles are the face at −x.
    rays.push(DVec3::new(-5.0, 0.25, 0.5), [1.0, 0.0, 0.0]);
    rays.push(DVec3::new(5.0, 0.25, 0.5), [-1.0, 0.0, 0.0]);
    for (own, expected) in [(true, [0, 1]), (false, [2, 2])] {
        let asked = of(own);
        let world = asked.world();
        for precision in RIGHT {
            let hits = rays.closest(&world, &kernels(precision));
            for (i, (t, id)) in hits.into_iter().enumerate() {
                let (org, dir) = rays.ray(i);
                let surface = Surface::at(&world, precision, org, dir, t, id);
                assert_eq!(surface.material.map(|m| m.0), Some(expected[i]));
            }
        }
    }
}

/// Too many triangles for ids: counted, not unfolded.
#[test]
fn surfaces_that_ids_cannot_number_are_refused() {
    let mut scene = SceneBuilder::default();
    let mut shape = scene.mesh("", &torus(DVec3::ZERO, [1.0, 0.5], [64, 32], 0.0));
    for _ in 0..20 {
        let twice = [Operand::shape(shape); 2];
        shape = scene.csg("", Operator::Union, &twice);
    }
    scene.instance("", Edge::shape(shape));
    let error = scene.finish().unwrap_err();
    let SceneError::TooManySurfaces { count, .. } = error else {
        panic!("{error}");
    };
    assert_eq!(count, (64 * 32 * 2) << 20);
}
