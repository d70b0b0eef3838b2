//! One shape of each kind, and its hits worked out by hand.

use super::implicits::{implicit, torus};
use super::quadrics::hyperboloid;
use super::*;

pub fn sphere(b: &mut SceneBuilder) -> ShapeId {
    b.sphere(
        "",
        Sphere {
            center: v(1.0, 0.0, 0.0),
            radius: 2.0,
        },
    )
}

#[test]
fn sphere_hits_and_normals() {
    // From outside, from inside, with a direction that is not unit, away.
    expect(
        sphere,
        [-5.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        4.0,
        [-1.0, 0.0, 0.0],
    );
    expect(
        sphere,
        [1.0, 0.0, 0.0],
        [0.0, 4.0, 0.0],
        0.5,
        [0.0, 1.0, 0.0],
    );
    expect(
        sphere,
        [1.0, 0.0, 9.0],
        [0.0, 0.0, -0.5],
        14.0,
        [0.0, 0.0, 1.0],
    );
    expect_miss(sphere, [-5.0, 0.0, 0.0], [-1.0, 0.0, 0.0]);
    expect_miss(sphere, [-5.0, 2.0 + 1e-13, 0.0], [1.0, 0.0, 0.0]);
    // A long way off, by the formula 1e8 + 1 − 2.
    expect(
        sphere,
        [-1e8, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        1e8 - 1.0,
        [-1.0, 0.0, 0.0],
    );
}

#[test]
fn a_sphere_is_touched_exactly() {
    // A tangent in one point is a hit, one step beside it none.
    expect_at(sphere, [-5.0, 2.0, 0.0], [1.0, 0.0, 0.0], 6.0);
    let within = 2.0_f64.next_down();
    let half_chord = 2.0_f64.powi(-25);
    expect_at(
        sphere,
        [-5.0, within, 0.0],
        [1.0, 0.0, 0.0],
        6.0 - half_chord,
    );
    expect_miss(sphere, [-5.0, 2.0_f64.next_up(), 0.0], [1.0, 0.0, 0.0]);
    // From the surface inward and outward: t = 0 does not count.
    expect_at(sphere, [-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], 4.0);
    expect_miss(sphere, [-1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]);
    expect_miss(sphere, [1.0, 2.0, 0.0], [1.0, 0.0, 0.0]);
    // 3-4-5: (6, 8) lies on a ball of radius 10, and the tangent there is (4, −3).
    let large = |b: &mut SceneBuilder| {
        let (center, radius) = (v(0.0, 0.0, 0.0), 10.0);
        b.sphere("", Sphere { center, radius })
    };
    expect_at(large, [6.0 - 8.0, 8.0 + 6.0, 0.0], [4.0, -3.0, 0.0], 2.0);
    let beside = 14.0_f64.next_up();
    expect_miss(large, [6.0 - 8.0, beside, 0.0], [4.0, -3.0, 0.0]);
    // From a billion radii away the rim is as sharp.
    let far = |y: f64| ask(sphere, [-1e9, y, 0.0], [1.0, 0.0, 0.0]);
    assert!(far(2.0).is_some_and(|hit| hit.t == 1e9 + 1.0));
    assert!(far(2.0_f64.next_down()).is_some() && far(2.0_f64.next_up()).is_none());
}

pub fn ellipsoid(b: &mut SceneBuilder) -> ShapeId {
    b.ellipsoid(
        "",
        Ellipsoid {
            center: v(0.0, 1.0, 0.0),
            radii: v(1.0, 2.0, 4.0),
        },
    )
}

#[test]
fn ellipsoid_hits_and_normals() {
    expect(
        ellipsoid,
        [0.0, 9.0, 0.0],
        [0.0, -2.0, 0.0],
        3.0,
        [0.0, 1.0, 0.0],
    );
    expect(
        ellipsoid,
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        4.0,
        [0.0, 0.0, 1.0],
    );
    // At x = 0.6 the z half-axis is 4·0.8; the gradient is (x/1, y/4, z/16).
    let n = v(0.6, 0.0, 3.2 / 16.0).normalize().to_array();
    expect(ellipsoid, [0.6, 1.0, 10.0], [0.0, 0.0, -1.0], 10.0 - 3.2, n);
    expect_at(ellipsoid, [1.0, 1.0, 10.0], [0.0, 0.0, -1.0], 10.0);
    expect_miss(ellipsoid, [1.0_f64.next_up(), 1.0, 10.0], [0.0, 0.0, -1.0]);
}

pub fn tube(open: bool) -> impl Fn(&mut SceneBuilder) -> ShapeId + Copy {
    move |b| {
        b.cylinder(
            "",
            Cylinder {
                base: v(0.0, 0.0, 0.0),
                top: v(0.0, 3.0, 0.0),
                radius: 1.0,
                open,
            },
        )
    }
}

#[test]
fn cylinder_hits_and_normals() {
    expect(
        tube(false),
        [5.0, 1.0, 0.0],
        [-1.0, 0.0, 0.0],
        4.0,
        [1.0, 0.0, 0.0],
    );
    // Along the axis: the caps; without them nothing.
    expect(
        tube(false),
        [0.25, 5.0, 0.0],
        [0.0, -1.0, 0.0],
        2.0,
        [0.0, 1.0, 0.0],
    );
    expect(
        tube(false),
        [0.25, -5.0, 0.0],
        [0.0, 1.0, 0.0],
        5.0,
        [0.0, -1.0, 0.0],
    );
    expect_miss(tube(true), [0.25, 5.0, 0.0], [0.0, -1.0, 0.0]);
    expect_miss(tube(true), [1.25, 5.0, 0.0], [0.0, -1.0, 0.0]);
    // From inside, and in by the open end to the far wall, seen from within.
    expect(
        tube(false),
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        1.0,
        [0.0, 0.0, 1.0],
    );
    expect(
        tube(true),
        [-2.5, 5.0, 0.0],
        [1.0, -1.0, 0.0],
        3.5,
        [1.0, 0.0, 0.0],
    );
    expect(
        tube(false),
        [-3.0, 5.0, 0.0],
        [1.0, -0.8, 0.0],
        2.5,
        [0.0, 1.0, 0.0],
    );
    // Down a generator, and at the rim.
    let down = [0.0, -1.0, 0.0];
    expect_at(tube(false), [1.0, 5.0, 0.0], down, 2.0);
    expect_at(tube(false), [1.0, 1.0, 0.0], down, 1.0);
    expect_miss(tube(false), [1.0_f64.next_up(), 5.0, 0.0], down);
    // A surface is not crossed by what lies in it.
    expect_miss(tube(true), [1.0, 5.0, 0.0], down);
    for open in [false, true] {
        expect_at(tube(open), [-3.0, 5.0, 0.0], [1.0, -1.0, 0.0], 2.0);
        let above = 5.0_f64.next_up();
        let t = if open { None } else { Some(above - 3.0) };
        let hit = ask(tube(open), [-3.0, above, 0.0], [1.0, -1.0, 0.0]);
        assert!(hit.map(|h| h.t) == t || open && hit.is_some_and(|h| h.t > 3.9));
    }
    // Past the side as a tangent, and in the plane of a cap.
    expect_at(tube(true), [1.0, 1.0, 4.0], [0.0, 0.5, -1.0], 4.0);
    expect_miss(tube(true), [1.0, 1.0, 4.0], [0.0, 1.0, -1.0]);
    expect_at(tube(false), [-3.0, 3.0, 0.0], [1.0, 0.0, 0.0], 2.0);
    expect_miss(tube(false), [-3.0, 3.0_f64.next_up(), 0.0], [1.0, 0.0, 0.0]);
    // A slanted axis, whose length is no f64.
    let slanted = |b: &mut SceneBuilder| {
        let (base, top) = (v(0.0, 0.0, 0.0), v(1.0, 1.0, 1.0));
        let (radius, open) = (1.0, false);
        b.cylinder(
            "",
            Cylinder {
                base,
                top,
                radius,
                open,
            },
        )
    };
    // Along the axis, from without and from within.
    expect_at(slanted, [-1.0, -1.0, -1.0], [1.0, 1.0, 1.0], 1.0);
    expect_at(slanted, [0.25, 0.25, 0.25], [1.0, 1.0, 1.0], 0.75);
    expect_miss(tube(false), [5.0, 3.5, 0.0], [-1.0, 0.0, 0.0]);
}

pub fn spike(b: &mut SceneBuilder) -> ShapeId {
    // Radius 2 at y = 0, a point at y = 4.
    b.cone(
        "",
        Cone {
            base: v(0.0, 0.0, 0.0),
            top: v(0.0, 4.0, 0.0),
            base_radius: 2.0,
            top_radius: 0.0,
            open: false,
        },
    )
}

#[test]
fn cone_hits_and_normals() {
    let n = v(2.0, 1.0, 0.0).normalize().to_array();
    expect(spike, [5.0, 2.0, 0.0], [-1.0, 0.0, 0.0], 4.0, n);
    expect(spike, [0.5, 9.0, 0.0], [0.0, -1.0, 0.0], 6.0, n);
    expect(
        spike,
        [0.5, -9.0, 0.0],
        [0.0, 1.0, 0.0],
        9.0,
        [0.0, -1.0, 0.0],
    );
    // Parallel to a generator, inside: only the other side and the cap.
    let m = v(-2.0, 1.0, 0.0).normalize().to_array();
    expect(spike, [0.0, 2.0, 0.0], [-1.0, 2.0, 0.0], 0.5, m);
    expect(
        spike,
        [0.0, 2.0, 0.0],
        [1.0, -2.0, 0.0],
        1.0,
        [0.0, -1.0, 0.0],
    );
    // The other nappe is no part of it.
    expect_miss(spike, [5.0, 6.0, 0.0], [-1.0, 0.0, 0.0]);
    // Through the apex, level and otherwise.
    expect_at(spike, [5.0, 4.0, 0.0], [-1.0, 0.0, 0.0], 5.0);
    expect_at(spike, [5.0, 9.0, 0.0], [-1.0, -1.0, 0.0], 5.0);
    expect_miss(spike, [5.0, 4.0_f64.next_up(), 0.0], [-1.0, 0.0, 0.0]);
    // Along a generator, on the surface.
    expect_at(spike, [3.0, -2.0, 0.0], [-1.0, 2.0, 0.0], 1.0);
    expect_at(spike, [1.5, 1.0, 0.0], [-1.0, 2.0, 0.0], 1.5);
    expect_miss(spike, [3.0_f64.next_up(), -2.0, 0.0], [-1.0, 2.0, 0.0]);
}

pub fn block(b: &mut SceneBuilder) -> ShapeId {
    b.cuboid(
        "",
        Cuboid {
            min: v(-1.0, -2.0, -3.0),
            max: v(1.0, 2.0, 3.0),
        },
    )
}

#[test]
fn box_hits_and_normals() {
    expect(
        block,
        [-5.0, 0.5, 0.5],
        [2.0, 0.0, 0.0],
        2.0,
        [-1.0, 0.0, 0.0],
    );
    expect(
        block,
        [0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        2.0,
        [0.0, 1.0, 0.0],
    );
    expect(
        block,
        [0.0, 7.0, 7.0],
        [0.0, -1.0, -1.5],
        5.0,
        [0.0, 1.0, 0.0],
    );
    expect_miss(block, [-5.0, 2.5, 0.0], [1.0, 0.0, 0.0]);
    // Within a face's plane, beside the face: a certain miss all the same.
    expect_miss(block, [-5.0, 2.0, 9.0], [1.0, 0.0, 0.0]);
    // Its border belongs to it: along a face, an edge, through a corner.
    expect_at(block, [-5.0, 2.0, 0.0], [1.0, 0.0, 0.0], 4.0);
    expect_at(block, [-5.0, 2.0, 3.0], [1.0, 0.0, 0.0], 4.0);
    expect_at(block, [-2.0, -3.0, -4.0], [1.0, 1.0, 1.0], 1.0);
    expect_at(block, [-2.0, 1.0, 3.0], [1.0, 1.0, 0.0], 1.0);
    expect_miss(block, [-2.0, 1.0_f64.next_up(), 3.0], [1.0, 1.0, 0.0]);
    // In at an edge: one hit, on both faces.
    let (org, dir) = ([-3.0, 4.0, 0.0], [1.0, -1.0, 0.125]);
    expect_at(block, org, dir, 2.0);
    let (scene, all) = scene_of(|b| place(b, block));
    let crossings = Reference::new(&scene, &all)
        .unwrap()
        .crossings(org, dir, 0, 0);
    for normal in [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] {
        assert!(crossings.iter().any(|c| c.t == 2.0 && c.normal == normal));
    }
}

#[test]
fn half_space_hits_and_normals() {
    expect(
        ground,
        [0.0, 10.0, 0.0],
        [1.0, -2.0, 0.0],
        4.0,
        [0.0, 1.0, 0.0],
    );
    expect(
        ground,
        [0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        2.0,
        [0.0, 1.0, 0.0],
    );
    expect_miss(ground, [0.0, 10.0, 0.0], [1.0, 0.0, 0.0]);
    expect_miss(ground, [0.0, 10.0, 0.0], [0.0, 1.0, 0.0]);
    expect_miss(ground, [0.0, 2.0, 0.0], [0.0, 1.0, 0.0]);
    expect_at(
        ground,
        [0.0, 2.0_f64.next_down(), 0.0],
        [0.0, 1.0, 0.0],
        2.0 - 2.0_f64.next_down(),
    );
}

/// |x| + |y| + |z| ≤ 1.
pub fn octahedron(b: &mut SceneBuilder) -> ShapeId {
    let sign = |i: u32, k: u32| if i >> k & 1 == 0 { 1.0 } else { -1.0 };
    let planes: Vec<HalfSpace> = (0..8)
        .map(|i| HalfSpace {
            normal: v(sign(i, 0), sign(i, 1), sign(i, 2)),
            offset: 1.0,
        })
        .collect();
    let points: Vec<DVec3> = DVec3::AXES.iter().flat_map(|a| [*a, -*a]).collect();
    b.polyhedron("", &planes, &points)
}

#[test]
fn polyhedron_hits_and_normals() {
    let n = v(1.0, 1.0, 1.0).normalize().to_array();
    expect(octahedron, [2.0, 0.25, 0.125], [-1.0, 0.0, 0.0], 1.375, n);
    expect(
        octahedron,
        [0.0, 0.0, 0.0],
        [0.5, 0.25, 0.125],
        1.0 / 0.875,
        n,
    );
    expect_miss(octahedron, [2.0, 0.75, 0.5], [-1.0, 0.0, 0.0]);
    // Through two vertices.
    expect_at(octahedron, [2.0, 0.0, 0.0], [-1.0, 0.0, 0.0], 1.0);
    // Past a vertex, along an edge.
    expect_at(octahedron, [1.0, -3.0, 0.0], [0.0, 1.0, 0.0], 3.0);
    expect_miss(octahedron, [1.0_f64.next_up(), -3.0, 0.0], [0.0, 1.0, 0.0]);
    expect_at(octahedron, [2.0, -1.0, 0.0], [-1.0, 1.0, 0.0], 1.0);
}

/// A U: outline with a bay between x = 1 and 2 above y = 1; normal +z.
pub fn letter(b: &mut SceneBuilder) -> ShapeId {
    let outline = [
        (0.0, 0.0),
        (3.0, 0.0),
        (3.0, 3.0),
        (2.0, 3.0),
        (2.0, 1.0),
        (1.0, 1.0),
        (1.0, 3.0),
        (0.0, 3.0),
    ];
    let points: Vec<DVec3> = outline.iter().map(|(x, y)| v(*x, *y, 1.0)).collect();
    b.polygon("", &points, &[])
}

#[test]
fn polygon_hits_and_normals() {
    let down = [0.0, 0.0, -1.0];
    expect(letter, [0.5, 2.0, 5.0], down, 4.0, [0.0, 0.0, 1.0]);
    expect(letter, [2.5, 1.0, 5.0], down, 4.0, [0.0, 0.0, 1.0]);
    // From behind the normal still follows the winding.
    expect(
        letter,
        [1.5, 0.5, -1.0],
        [0.0, 0.0, 1.0],
        2.0,
        [0.0, 0.0, 1.0],
    );
    expect_miss(letter, [1.5, 2.0, 5.0], down);
    // Level with corners, but not on an edge: certain.
    expect_miss(letter, [1.5, 3.0, 5.0], down);
    expect_miss(letter, [-0.5, 1.0, 5.0], down);
    // Edges and corners belong to it.
    for (x, y) in [(1.5, 0.0), (2.5, 3.0), (1.5, 1.0), (2.0, 3.0), (0.0, 0.0)] {
        expect_at(letter, [x, y, 5.0], down, 4.0);
        expect_at(letter, [x + 2.0, y - 1.0, 5.0], [-0.5, 0.25, -1.0], 4.0);
    }
    expect_miss(letter, [1.5, 1.0_f64.next_up(), 5.0], down);
    expect_miss(letter, [2.0_f64.next_down(), 3.0, 5.0], down);
    // In its plane, across it and past it.
    expect_miss(letter, [-1.0, 0.5, 1.0], [1.0, 0.0, 0.0]);
}

/// y ≤ 2, with a normal that is not unit.
pub fn ground(b: &mut SceneBuilder) -> ShapeId {
    b.half_space(
        "",
        HalfSpace {
            normal: v(0.0, 4.0, 0.0),
            offset: 8.0,
        },
    )
}

/// Two triangles of the unit square at z = 0, sharing the diagonal x = y.
pub fn square(b: &mut SceneBuilder) -> ShapeId {
    let data = MeshData {
        positions: vec![
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
        ],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..MeshData::default()
    };
    b.mesh("", &data)
}

pub type Maker = fn(&mut SceneBuilder) -> ShapeId;

/// Every kind once, near the origin; all but the last three are solids.
pub const KINDS: [Maker; 12] = [
    sphere,
    ellipsoid,
    hyperboloid,
    |b| tube(false)(b),
    spike,
    block,
    octahedron,
    ground,
    |b| implicit(torus)(b),
    |b| tube(true)(b),
    letter,
    square,
];

#[test]
fn triangle_hits_normals_edges_and_ties() {
    let down = [0.0, 0.0, -2.0];
    let hit = certain(&ask(square, [0.75, 0.25, 3.0], down));
    assert_eq!(
        (hit.t, hit.primitive, hit.normal),
        (1.5, 0, [0.0, 0.0, 1.0])
    );
    let hit = certain(&ask(square, [0.25, 0.75, -3.0], [0.0, 0.0, 1.0]));
    assert_eq!(
        (hit.t, hit.primitive, hit.normal),
        (3.0, 1, [0.0, 0.0, 1.0])
    );
    // On the diagonal both are met at one t: the lower id, exactly.
    let hit = certain(&ask(square, [0.5, 0.5, 3.0], down));
    assert_eq!((hit.t, hit.primitive), (1.5, 0));
    // The rim belongs to it, and its corners; one step beside it does not.
    for (x, y) in [(1.0, 0.5), (0.5, 0.0), (0.0, 1.0), (1.0, 1.0)] {
        assert_eq!(certain(&ask(square, [x, y, 3.0], down)).t, 1.5);
    }
    expect_miss(square, [1.0_f64.next_up(), 0.5, 3.0], down);
    expect_miss(square, [0.5, -f64::MIN_POSITIVE, 3.0], down);
    expect_miss(square, [0.5, 0.5, 3.0], [0.0, 0.0, 2.0]);
    // In its plane: D = 0 never hits.
    expect_miss(square, [-1.0, 0.5, 0.0], [1.0, 0.0, 0.0]);
}
