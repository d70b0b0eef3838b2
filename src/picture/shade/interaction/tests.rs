//! Surface evaluation in lanes gives each lane the bits of a single evaluation.

use super::*;
use crate::accel::Structure;
use crate::geom::tape::Builder;
use crate::geom::{Cone, Cuboid, Cylinder, Ellipsoid, HalfSpace, Quadric, Sphere};
use crate::math::lanes::f64x8;
use crate::scene::{Edge, Instances, MeshData, Operand, Operator, Scene, SceneBuilder, ShapeId};
use proptest::prelude::*;

const LANES: usize = <f64x8 as Lanes>::COUNT;

/// A tetrahedron whose vertex normals disagree with its faces.
fn tetrahedron() -> MeshData {
    MeshData {
        positions: vec![
            [0.0, 0.0, 0.0],
            [1.0, 0.25, 0.0],
            [0.25, 1.0, 0.125],
            [0.0, 0.25, 1.5],
        ],
        normals: vec![
            [-1.0, -1.0, -1.0],
            [2.0, 0.0, -0.5],
            [0.0, 1.0, 0.5],
            [0.0, -0.25, 1.0],
        ],
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        ..MeshData::default()
    }
}

fn shapes(scene: &mut SceneBuilder) -> Vec<ShapeId> {
    let center = DVec3::new(0.1, -0.2, 0.3);
    let plane = |normal: DVec3, offset: f64| HalfSpace { normal, offset };
    let corner = [
        plane(DVec3::new(-1.0, 0.0, 0.0), 0.5),
        plane(DVec3::new(0.0, -2.0, 0.0), 0.5),
        plane(DVec3::new(0.0, 0.0, -1.0), 0.25),
        plane(DVec3::new(1.0, 1.0, 1.0), 1.0),
    ];
    let points = [
        DVec3::new(-0.5, -0.25, -0.25),
        DVec3::new(1.5, -0.25, -0.25),
        DVec3::new(-0.5, 1.75, -0.25),
        DVec3::new(-0.5, -0.25, 1.75),
    ];
    let around = [
        DVec3::new(0.0, 0.0, 0.5),
        DVec3::new(1.0, 0.0, 0.5),
        DVec3::new(1.0, 1.0, 0.5),
        DVec3::new(0.0, 1.5, 0.5),
    ];
    let slopes = around.map(|p| DVec3::new(p.x - 0.5, p.y, 1.0));
    let [base, top] = [DVec3::new(0.0, -0.5, 0.0), DVec3::new(0.25, 1.0, 0.0)];
    let cone = |open| Cone {
        base,
        top,
        base_radius: 0.5,
        top_radius: 0.0,
        open,
    };
    let cylinder = Cylinder {
        base,
        top,
        radius: 0.5,
        open: false,
    };
    vec![
        scene.half_space("", plane(DVec3::new(0.0, 3.0, 1.0), 0.25)),
        scene.sphere(
            "",
            Sphere {
                center,
                radius: 0.75,
            },
        ),
        scene.ellipsoid(
            "",
            Ellipsoid {
                center,
                radii: DVec3::new(0.5, 1.0, 0.75),
            },
        ),
        scene.cylinder("", cylinder),
        scene.cone("", cone(false)),
        scene.cone("", cone(true)),
        scene.cuboid(
            "",
            Cuboid {
                min: -DVec3::ONE,
                max: center,
            },
        ),
        scene.quadric(
            "",
            Quadric {
                coefficients: [1.0, -2.0, 0.5, 0.25, 0.0, 1.0, 0.0, 0.5, 0.0, -0.75],
            },
        ),
        scene.polyhedron("", &corner, &points),
        scene.polygon("", &around, &[]),
        scene.polygon("", &around, &slopes),
        scene.mesh("", &tetrahedron()),
    ]
}

/// All kinds of shapes: unplaced, placed, and as operands.
fn everything() -> Scene {
    let mut scene = SceneBuilder::default();
    let shapes = shapes(&mut scene);
    let turned = Affine::new(
        [[0.5, 1.0, 0.0], [-1.0, 0.5, 0.25], [0.0, 0.0, 2.0]],
        [0.5, -0.25, 3.0],
    );
    let turned = scene.transform(turned);
    let solids = shapes.iter().copied().enumerate();
    let solids = solids.filter(|(i, _)| ![5, 9, 10].contains(i));
    let operands: Vec<Operand> = solids
        .flat_map(|(_, shape)| {
            let operand = Operand::shape(shape);
            [operand, operand.transform(turned)]
        })
        .collect();
    let all = scene.csg("", Operator::Xor, &operands);
    for shape in shapes.into_iter().chain([all]) {
        scene.instance("", Edge::shape(shape));
        scene.instance("", Edge::shape(shape).transform(turned));
    }
    scene.finish().unwrap()
}

/// Number of primitive ids that hits of an instance may have.
fn primitives(world: &World, shape: Shape) -> u32 {
    match shape {
        Shape::Mesh(id) => world.scene.meshes.row(id).triangles.len() as u32,
        Shape::Csg(id) => {
            let solid = &world.csg(id).solid;
            let last = solid.operands.len() as u32 - 1;
            solid.surface(last, 0) + 4
        }
        _ => 1,
    }
}

fn bits(v: Vec3<f64>) -> [u64; 3] {
    // All NaNs count as equal.
    [v.x, v.y, v.z].map(|x| if x.is_nan() { 0 } else { x.to_bits() })
}

type Rays = [([f64; 3], [f64; 3], f64, u32); LANES];

fn compare(world: &World, precision: Precision, rays: &Rays) {
    for instance in 0..world.instances.count() {
        let shape = world.entry_of(instance).shape;
        let count = primitives(world, shape);
        let number = |i: usize| {
            let turned = match shape {
                Shape::Csg(_) => rays[i].3 & TURNED,
                _ => 0,
            };
            (rays[i].3 % count) | turned
        };
        let first = HitId {
            instance,
            primitive: number(0),
        };
        let interaction = InteractionPart::of(world, precision, first);
        // Hits outside this interaction are replaced by hits of the first primitive.
        let primitives: [u32; LANES] = std::array::from_fn(|i| {
            let id = HitId {
                instance,
                primitive: number(i),
            };
            if interaction.has(id) {
                id.primitive
            } else {
                first.primitive
            }
        });
        let org = Vec3::of_lanes(|i| rays[i].0);
        let dir = Vec3::of_lanes(|i| rays[i].1.map(|x| f64::from(x as f32)));
        let t = f64x8::load(&rays.map(|ray| ray.2));
        let all = interaction.surfaces::<f64x8>((org, dir), t, &primitives);
        for i in 0..LANES {
            let lane = |v: Vec3<f64x8>| Vec3::new(v.x.lane(i), v.y.lane(i), v.z.lane(i));
            let ray = (lane(org), lane(dir));
            let one = interaction.surfaces::<f64>(ray, t.lane(i), &primitives[i..]);
            let place = format!("{shape:?}, {precision:?}, lane {i}");
            assert_eq!(bits(lane(all.point)), bits(one.point), "{place}");
            assert_eq!(bits(lane(all.ng)), bits(one.ng), "{place}");
            assert_eq!(bits(lane(all.ns)), bits(one.ns), "{place}");
            assert_eq!(
                all.front.bits() >> i & 1,
                u32::from(one.front.any()),
                "{place}"
            );
            assert_eq!(
                all.offset.lane(i).to_bits(),
                one.offset.to_bits(),
                "{place}"
            );
        }
    }
}

/// Powers of x² + y² + z² − 1: the higher the power, the smaller the slope near the
/// ball.
#[test]
fn without_a_slope_rays_start_no_farther_than_stated() {
    for power in [1, 2, 3, 12] {
        let b = &mut Builder::default();
        let squares = [0, 1, 2].map(|axis| {
            let x = b.coordinate(axis);
            b.power(x, 2)
        });
        let sum = b.sum(squares[0], squares[1]);
        let sum = b.sum(sum, squares[2]);
        let one = b.constant(1.0);
        let ball = b.difference(sum, one);
        let last = b.power(ball, power);
        let mut scene = SceneBuilder::default();
        let shape = scene.implicit("", std::mem::take(b).finish(last), true, None);
        scene.instance("", Edge::shape(shape));
        let scene = scene.finish().unwrap();
        let instances = Instances::of(&scene).unwrap();
        let world = World::build(&scene, &instances, Structure::Linear);
        let (instance, primitive) = (0, 0);
        for precision in [Precision::Fast, Precision::Guarded, Precision::Exact] {
            let id = HitId {
                instance,
                primitive,
            };
            let interaction = InteractionPart::of(&world, precision, id);
            let mut largest = 0.0_f64;
            for i in 0..200 {
                let angle = f64::from(i) * 0.01;
                let radius = 0.95 * (f64::from(i) * 0.618).fract();
                let (y, z) = (radius * libm::sin(angle), radius * libm::cos(angle));
                let x = -libm::sqrt(1.0 - y * y - z * z);
                let ray = (Vec3::new(-3.0, y, z), Vec3::new(1.0, 0.0, 0.0));
                let one = interaction.surfaces::<f64>(ray, x + 3.0, &[primitive]);
                assert!(one.offset > 0.0, "{power} {precision:?} {angle}");
                let cos = one.ng.dot(Vec3::new(x, y, z)).abs();
                assert!(cos > 1.0 - 1e-6, "{power} {precision:?} {angle}: {cos}");
                largest = largest.max(one.offset);
            }
            // For power 1 rounding alone; else the size's share and the allowance.
            let most = if power == 1 { 1e-4 } else { 1.5 * 2.0 / 1024.0 };
            assert!(largest < most, "{power} {precision:?} {largest:e}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Includes points that lie on no surface: the value of t does not matter here.
    #[test]
    fn surfaces_of_a_lane_are_those_of_one(
        rays in proptest::array::uniform8((
            proptest::array::uniform3(-4.0..4.0_f64),
            proptest::array::uniform3(-1.0..1.0_f64),
            prop_oneof![0.0..8.0_f64, Just(0.0), Just(f64::INFINITY), 0.0..1e-9_f64],
            any::<u32>(),
        )),
    ) {
        let scene = everything();
        let instances = Instances::of(&scene).unwrap();
        let world = World::build(&scene, &instances, Structure::Linear);
        for precision in [Precision::Fast, Precision::Guarded, Precision::Exact] {
            compare(&world, precision, &rays);
        }
    }
}
