//! The exact fallback: decides one ray and one primitive where error bounds leave it open.
//!
//! Hits and the order of their t are those of exact arithmetic
//! ([`crate::geom::exact`], [`crate::geom::triangle::exact`]).

use super::certain_hits::t_of_end;
use super::csg;
use super::csg::lanes::{Spaces, is_sharp};
use super::leaf::Tester;
use super::packet::Packet;
use super::query::{Competitor, Depth, HitId, Query};
use super::scratch::TraceScratch;
use crate::accel::{PreparedCsg, TlasEntry, World};
use crate::geom::exact::{Crossing, Line, Root, Solid, first_beyond};
use crate::geom::primitive::Boundaries;
use crate::geom::triangle::Corners;
use crate::geom::triangle::exact::{Pair, meet_exact};
use crate::geom::{Certainty, Guarded, Ray, triangle};
use crate::math::Vec3;
use crate::math::bounds::ErrorBounded;
use crate::math::lanes::{Lanes, Mask, Scalar};
use crate::scene::{Shape, Tables};
use glam::DVec3;
use std::cmp::Ordering;

/// A ray in a primitive's space, and the numbers that define the primitive.
enum Case<'a> {
    Triangle(Pair),
    Solid(Line, Solid<'a>),
    Csg(Line, &'a PreparedCsg, &'a Tables),
}

/// Results of a kernel that left lanes undecided.
#[derive(Clone, Copy)]
pub(super) struct KnownHits<'a, X> {
    /// Lanes with a certain hit whose order is undecided.
    pub hits: u32,
    /// Lanes in which the kernel is not certain of a hit.
    pub open: u32,
    /// t by lane.
    pub t: &'a [X],
    /// Corners of a triangle.
    pub corners: Option<&'a Corners>,
}

/// What the kernel of one lane says of a ray and a solid.
#[derive(Clone, Copy)]
enum Met {
    /// A certain hit at this t.
    At(f64),
    /// No certain hit.
    Uncertain,
    /// It has not been asked.
    Unknown,
}

/// A ray in world space.
#[derive(Clone, Copy)]
pub(super) struct WorldRay {
    pub org: [f64; 3],
    pub dir: [f64; 3],
    pub t_min: f64,
}

/// Finds the f64 nearest to t of a ray's first hit of a primitive beyond its t_min.
pub(super) fn nearest_t(
    world: &World,
    ray: &WorldRay,
    id: HitId,
    scratch: &mut TraceScratch,
) -> Option<f64> {
    let case = Case::look_up(world, ray, id, None);
    let (crossing, _) = case.crossing(ray.t_min, scratch)?;
    Some(crossing.rounded())
}

impl<L: Lanes, C: Certainty> Tester<'_, L, C> {
    /// Decides one primitive for some lanes, and commits hits that precede the queries'.
    pub fn decide<Q: Query<L>>(&mut self, lanes: L::Mask, id: HitId, query: &mut Q) {
        let nothing = KnownHits {
            hits: 0,
            open: 0,
            t: &[],
            corners: None,
        };
        self.decide_with(lanes, &nothing, id, query);
    }

    /// [`Tester::decide`] with the results of a kernel.
    #[cold]
    #[inline(never)]
    pub(super) fn decide_with<Q: Query<L>>(
        &mut self,
        lanes: L::Mask,
        known: &KnownHits<L::Scalar>,
        id: HitId,
        query: &mut Q,
    ) {
        let mut bits = lanes.bits();
        self.scratch.decided += u64::from(bits.count_ones());
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            self.decide_one(lane, known, id, query);
        }
    }

    /// Decides one primitive for one lane.
    fn decide_one<Q: Query<L>>(
        &mut self,
        lane: usize,
        known: &KnownHits<L::Scalar>,
        id: HitId,
        query: &mut Q,
    ) {
        let (org, dir) = self.packet.lane(lane);
        let t_min = self.packet.ray.t_min.lane(lane).to_f64();
        let ray = WorldRay { org, dir, t_min };
        let Some(competitor) = query.competitor(lane) else {
            return;
        };
        let (world, scratch) = (self.world, &mut *self.scratch);
        let case = Case::look_up(world, &ray, id, known.corners);
        let Some((crossing, surface)) = case.crossing(t_min, scratch) else {
            return;
        };
        let id = HitId {
            primitive: surface.unwrap_or(id.primitive),
            ..id
        };
        let first = match competitor {
            Competitor::End(end) => crossing.order_with(end).is_lt(),
            Competitor::Hit(best, within) => match order_by_interval(&crossing, within) {
                Some(order) => order.is_lt(),
                None => match Case::look_up(world, &ray, best, None).crossing(t_min, scratch) {
                    Some((other, _)) => crossing.order(&other).then(id.cmp(&best)).is_lt(),
                    None => true,
                },
            },
        };
        if first {
            let met = match (known.hits >> lane & 1, known.open >> lane & 1) {
                (1, _) => Met::At(known.t[lane].to_f64()),
                (_, 1) => Met::Uncertain,
                _ => Met::Unknown,
            };
            let at = || depth::<L::Single>(world, &ray, id, &crossing, met, scratch);
            query.commit(lane, at, id);
        }
    }
}

impl<'a> Case<'a> {
    /// Looks up the numbers of a ray and a primitive. `corners` of a triangle may be in any
    /// order.
    #[inline(always)]
    fn look_up(world: &'a World, ray: &WorldRay, id: HitId, corners: Option<&Corners>) -> Case<'a> {
        let entry = world.entry_of(id.instance);
        let scene = &world.scene;
        match entry.shape {
            Shape::Mesh(mesh) => {
                let (org, dir) = in_object(world, ray, &entry, scene.meshes.center[mesh.index()]);
                let look_up = || scene.meshes.row(mesh).corners(id.primitive as usize);
                let corners = corners.copied().unwrap_or_else(look_up);
                Case::Triangle(Pair { org, dir, corners })
            }
            shape => {
                let (org, dir) = in_object(world, ray, &entry, DVec3::ZERO);
                let line = Line { org, dir };
                match (shape, scene.solid(shape)) {
                    (_, Some(solid)) => Case::Solid(line, solid),
                    (Shape::Csg(id), None) => Case::Csg(line, world.csg(id), scene),
                    _ => unreachable!("a mesh is met by its triangles"),
                }
            }
        }
    }

    /// Finds the first crossing beyond t_min, and for a CSG solid its surface.
    fn crossing(
        &self,
        t_min: f64,
        scratch: &mut TraceScratch,
    ) -> Option<(Crossing<'_>, Option<u32>)> {
        if let Case::Csg(line, solid, tables) = self {
            let csg::Crossing {
                root, primitive, ..
            } = csg::first(solid, tables, line, t_min, scratch)?;
            return Some((Crossing::Root(root), Some(primitive)));
        }
        let crossing = match self {
            Case::Csg(..) => None,
            Case::Solid(line, solid) => {
                first_beyond(solid, line, t_min, &mut scratch.kernels).map(Crossing::Root)
            }
            Case::Triangle(pair) => {
                let crossing = meet_exact(pair)?;
                let beyond = crossing.order_with(t_min).is_gt();
                beyond.then_some(Crossing::Triangle(crossing))
            }
        };
        Some((crossing?, None))
    }
}

/// Orders a crossing against one in an interval of t, where f64 suffices.
fn order_by_interval(crossing: &Crossing, [from, to]: [f64; 2]) -> Option<Ordering> {
    let known = crossing.t();
    let order = |x: f64| known.order(&ErrorBounded::exact(x));
    match (order(from), order(to)) {
        (Some(Ordering::Less), _) => Some(Ordering::Less),
        (_, Some(Ordering::Greater)) => Some(Ordering::Greater),
        _ => None,
    }
}

/// Computes a hit's t as it is reported: that of the kernel at one lane where it is certain,
/// else of the end of the solid's span there, else from the root (D19). `met`: what that kernel
/// has said.
fn depth<L: Lanes>(
    world: &World,
    ray: &WorldRay,
    id: HitId,
    crossing: &Crossing,
    met: Met,
    scratch: &mut TraceScratch,
) -> Depth {
    let shape = world.entry_of(id.instance).shape;
    if let (Shape::Csg(_), Crossing::Root(root)) = (shape, crossing) {
        let depth = depth_of(root);
        let t = kernel_of_operand::<L>(world, ray, id, root, scratch);
        return Depth {
            t: t.unwrap_or(depth.t),
            ..depth
        };
    }
    let ErrorBounded { value, error } = crossing.t();
    // The root's own bounds serve where they are narrow; else t is rounded exactly. The part
    // only chooses between two valid intervals. An infinite value has no finite error.
    let known_to = |part: f64| error <= value.abs() * part && value.is_finite();
    let within = if known_to(1e-6) {
        [(value - error).next_down(), (value + error).next_up()]
    } else {
        let t = crossing.rounded();
        [t.next_down(), t.next_up()]
    };
    let lanes = |v: [f64; 3]| Vec3::<L>::splat(v.map(L::Scalar::from_f64));
    let by_kernel = match (crossing, met) {
        (Crossing::Triangle(crossing), _) => {
            let Pair { org, dir, corners } = crossing.pair;
            let ray = Ray::new(lanes(*org), lanes(*dir), L::zero());
            let corners = triangle::canonical(*corners);
            let t = triangle::depth_each(&triangle::splat(&corners), &ray);
            Some(t.lane(0).to_f64())
        }
        (Crossing::Root(_), Met::At(t)) => Some(t),
        (Crossing::Root(_), Met::Uncertain) => None,
        (Crossing::Root(_), Met::Unknown) => {
            let splat = |v: [f64; 3]| Vec3::<L::Double>::splat(v);
            let packet = Packet::<L>::new(
                splat(ray.org),
                splat(ray.dir),
                L::from_f64(ray.t_min),
                &world.bounds,
            );
            let entry = world.entry_of(id.instance);
            let meet = Tester::<L, Guarded>::new(world, &packet, scratch).kernel(&entry);
            meet.hit.any().then(|| meet.t.lane(0).to_f64())
        }
    };
    let by_end = || match crossing {
        Crossing::Root(root) => {
            let (org, dir) = in_object(world, ray, &world.entry_of(id.instance), DVec3::ZERO);
            t_of_end::<L>((&world.scene, shape), (org, dir, ray.t_min), root.t.value)
        }
        Crossing::Triangle(_) => None,
    };
    let by_kernel = by_kernel.filter(|t| t.is_finite()).or_else(by_end);
    let near = known_to(KERNEL_ACCURACY);
    let exact = || match crossing {
        Crossing::Root(root) if near => root.t.value,
        _ => crossing.rounded(),
    };
    Depth {
        t: by_kernel.unwrap_or_else(exact),
        within,
    }
}

/// Computes t of a CSG operand's boundary by the kernel at one lane, where it is certain.
fn kernel_of_operand<L: Lanes>(
    world: &World,
    ray: &WorldRay,
    id: HitId,
    root: &Root,
    scratch: &mut TraceScratch,
) -> Option<f64> {
    let entry = world.entry_of(id.instance);
    let Shape::Csg(row) = entry.shape else {
        return None;
    };
    let solid = &world.csg(row).solid;
    let (number, _) = solid.operand_of(id.primitive & !csg::TURNED);
    let operand = &solid.operands[number as usize];
    if operand.shape.boundaries() == Boundaries::Crossings {
        return None;
    }
    let (org, dir) = in_object(world, ray, &entry, DVec3::ZERO);
    let splat = |v: [f64; 3]| Vec3::<L::Double>::splat(v);
    if let Shape::Implicit(id) = operand.shape {
        // The packet as the walk in lanes sees it.
        let packet = Packet::<L>::new(splat(org), splat(dir), L::from_f64(ray.t_min), &entry.own);
        let rows: &mut Vec<[L; 3]> = scratch.lanes.rows.slot();
        rows.clear();
        let all = L::Mask::splat(true);
        let solid = (world.csg(row), &*world.scene);
        let mut spaces = Spaces::new(&packet);
        let found = spaces.boundaries(solid, (operand, id), all, rows, &mut scratch.kernels);
        let holds = |end: &[L; 3]| {
            let [from, _, to] = end.map(|x| x.lane(0).to_f64());
            from <= root.t.value && root.t.value <= to && to.is_finite()
        };
        let end = rows.drain(..).find(holds)?;
        let known = !found.unsure.any() && is_sharp(&end).any();
        return known.then(|| end[1].lane(0).to_f64());
    }
    let frame = &solid.frames[operand.frame as usize];
    let line = csg::in_frame(frame, operand.frame, &Line { org, dir });
    let shape = (&*world.scene, operand.shape);
    t_of_end::<L>(shape, (line.org, line.dir, ray.t_min), root.t.value)
}

/// Relative error of t, a quarter of f32's unit roundoff, up to which the root's f64 value is
/// reported instead of the f64 nearest to the root (D19). Both depend on the ray and the
/// primitive alone, and the former is cheaper.
const KERNEL_ACCURACY: f64 = 1.0 / (1 << 26) as f64;

/// Computes t of a root as it is reported, with bounds (D19).
pub(super) fn depth_of(root: &Root) -> Depth {
    let ErrorBounded { value, error } = root.t;
    let known = error <= value.abs() * KERNEL_ACCURACY && value.is_finite();
    let t = if known { root.t.value } else { root.rounded() };
    let within = if known {
        [(value - error).next_down(), (value + error).next_up()]
    } else {
        [t.next_down(), t.next_up()]
    };
    Depth { t, within }
}

/// Transforms a ray to a primitive's space by the steps of [`Packet::in_object`] (S6).
#[inline(always)]
fn in_object(
    world: &World,
    ray: &WorldRay,
    entry: &TlasEntry,
    center: DVec3,
) -> ([f64; 3], [f64; 3]) {
    if !entry.placed {
        return (ray.org, ray.dir);
    }
    let map = world.object_from_world(entry.instance);
    let org = DVec3::from_array(map.point(ray.org)) - center;
    (org.to_array(), map.vector(ray.dir))
}
