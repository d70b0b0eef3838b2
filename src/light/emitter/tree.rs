//! The light tree: which of many emitters to sample, by one descent (Conty Estevez and Kulla
//! 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting", without the
//! splitting).
//!
//! A node has up to eight children, emitters or nodes, in columns of one register: all eight
//! importances (pbrt 4, section 12.6.3) are computed together, for one point. So nothing is
//! gathered, lanes descend one after the other, and every width has the same bits. The
//! density of an emitter is the product on the way up from it. [`super::tree_build`] makes
//! the nodes.

use super::importance::{Facing, MOST};
use super::tree_build::Cluster;
use lanecast_numerics::math::Vec3;
use lanecast_numerics::math::lanes::{Lanes, f32x8};

/// How many children a node has.
pub const WIDTH: usize = 8;

/// A child that is no node but the emitter in this slot, or nothing.
const LEAF: u32 = 1 << 31;
const EMPTY: u32 = u32::MAX;

/// Up to eight clusters of emitters, column by column.
#[derive(Clone, Debug)]
struct Node {
    /// What the centres are relative to.
    origin: [f64; 3],
    center: Vec3<f32x8>,
    /// Half of the box's edges.
    half: Vec3<f32x8>,
    radius_squared: f32x8,
    axis: Vec3<f32x8>,
    /// Of the cone of normals.
    cos_spread: f32x8,
    sin_spread: f32x8,
    /// Beyond this angle from its normal an emitter brings no light.
    cos_end: f32x8,
    /// 1 for clusters that shine on both sides of their normals, else 0.
    two_sided: f32x8,
    /// 1 for clusters with a light that does not decrease with distance, else 0.
    everywhere: f32x8,
    /// 0 of missing children.
    power: f32x8,
    children: [u32; WIDTH],
}

/// The tree; its emitters are known by their slots, their order when it was built.
#[derive(Clone, Debug)]
pub struct Tree {
    nodes: Vec<Node>,
    /// Node and child of each node but the first, and of each emitter.
    above_node: Vec<(u32, u8)>,
    above_emitter: Vec<(u32, u8)>,
}

/// One point and normal; the normal is zero if light counts from both sides.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    pub at: [f64; 3],
    pub normal: [f32; 3],
}

impl Tree {
    /// Makes a tree without nodes for so many emitters.
    pub fn with_slots(count: usize) -> Tree {
        Tree {
            nodes: Vec::new(),
            above_node: Vec::new(),
            above_emitter: vec![(0, 0); count],
        }
    }

    /// Adds a node with these children below child `above` of another; returns its index.
    pub fn add_node(&mut self, clusters: &[Cluster], above: (u32, u8)) -> u32 {
        let index = self.nodes.len() as u32;
        self.nodes.push(Node::new(clusters));
        self.above_node.push(above);
        index
    }

    /// Says that a child of a node is another node.
    pub fn set_node(&mut self, (node, child): (u32, u8), below: u32) {
        self.nodes[node as usize].children[child as usize] = below;
    }

    /// Says that a child of a node is an emitter.
    pub fn set_emitter(&mut self, (node, child): (u32, u8), slot: u32) {
        self.nodes[node as usize].children[child as usize] = LEAF | slot;
        self.above_emitter[slot as usize] = (node, child);
    }

    /// Returns the bytes of the tree.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.nodes)
            + size_of_val(&*self.above_node)
            + size_of_val(&*self.above_emitter)
    }

    /// Returns the importance of all emitters together.
    #[inline]
    pub fn importance(&self, point: &Point) -> f32 {
        total(&self.nodes[0].importances(point)).min(MOST)
    }

    /// Chooses an emitter by a number in [0, 1); returns its slot and probability. None where
    /// no light can arrive.
    #[inline]
    pub fn choose(&self, point: &Point, mut pick: f32) -> Option<(u32, f32)> {
        let (mut node, mut chance) = (0_u32, 1.0_f32);
        loop {
            let Node { children, .. } = &self.nodes[node as usize];
            let weights = self.nodes[node as usize].importances(point);
            let sum = total(&weights);
            let target = pick * sum;
            let (mut before, mut chosen) = (0.0, None);
            for (k, &weight) in weights.iter().enumerate() {
                // The last that begins at or before the number.
                if weight > 0.0 && before <= target {
                    chosen = Some((k, before, weight));
                }
                before += weight;
            }
            let (k, before, weight) = chosen?;
            chance *= weight / sum;
            let left = (target - before) / weight;
            pick = left.clamp(0.0, 1.0 - f32::EPSILON / 2.0);
            match children[k] {
                EMPTY => return None,
                child if child & LEAF != 0 => return Some((child & !LEAF, chance)),
                child => node = child,
            }
        }
    }

    /// Returns the probability with which [`Tree::choose`] chooses the emitter in a slot.
    #[inline]
    pub fn chance(&self, point: &Point, slot: u32) -> f32 {
        let (mut node, mut child) = self.above_emitter[slot as usize];
        let mut chance = 1.0;
        loop {
            let weights = self.nodes[node as usize].importances(point);
            let weight = weights[child as usize];
            if weight <= 0.0 {
                return 0.0;
            }
            chance *= weight / total(&weights);
            if node == 0 {
                return chance;
            }
            (node, child) = self.above_node[node as usize];
        }
    }
}

/// Adds in one order, whoever asks.
#[inline]
fn total(weights: &[f32; WIDTH]) -> f32 {
    weights.iter().fold(0.0, |sum, weight| sum + weight)
}

impl Node {
    fn new(clusters: &[Cluster]) -> Node {
        let whole = clusters.iter().skip(1).fold(clusters[0], |a, b| a.union(b));
        let origin = whole.center();
        let column = |of: &dyn Fn(&Cluster) -> f64| {
            let one = |k: usize| clusters.get(k).map_or(0.0, |c| of(c) as f32);
            f32x8::load(&std::array::from_fn::<f32, WIDTH, _>(one))
        };
        let yes = |on: bool| f64::from(u8::from(on));
        Node {
            origin: origin.to_array(),
            center: Vec3::new(
                column(&|c| c.center().x - origin.x),
                column(&|c| c.center().y - origin.y),
                column(&|c| c.center().z - origin.z),
            ),
            // Rounded up, so that box and ball contain the cluster.
            half: Vec3::new(
                column(&|c| (c.high.x - c.low.x) * 0.500_001),
                column(&|c| (c.high.y - c.low.y) * 0.500_001),
                column(&|c| (c.high.z - c.low.z) * 0.500_001),
            ),
            radius_squared: column(&|c| (c.radius() * c.radius() * 1.000_001).min(1e30)),
            axis: Vec3::new(
                column(&|c| c.axis.x),
                column(&|c| c.axis.y),
                column(&|c| c.axis.z),
            ),
            cos_spread: column(&|c| libm::cos(c.spread)),
            sin_spread: column(&|c| libm::sin(c.spread)),
            // The addend covers what f32 loses.
            cos_end: column(&|c| libm::cos(c.end) - if c.end < 1.5 { 1e-3 } else { 0.0 }),
            two_sided: column(&|c| yes(c.two_sided)),
            everywhere: column(&|c| yes(c.everywhere)),
            power: column(&|c| c.power.min(f64::from(MOST))),
            children: [EMPTY; WIDTH],
        }
    }

    /// Returns the importances of the children at a point.
    #[inline]
    fn importances(&self, point: &Point) -> [f32; WIDTH] {
        let splat = f32x8::splat;
        let (zero, one) = (splat(0.0), splat(1.0));
        let from: [f32; 3] = std::array::from_fn(|k| (self.origin[k] - point.at[k]) as f32);
        let to = self.center + Vec3::splat(from);
        let square = Lanes::max(to.length_squared(), splat(1.0 / MOST));
        let square = Lanes::min(square, splat(MOST));
        let nearness = one / Lanes::sqrt(square);
        let near = self.radius_squared;
        let inside = near.ge(square);
        let sin_squared = Lanes::min(near / square, one);
        let (sin, cos) = (Lanes::sqrt(sin_squared), Lanes::sqrt(one - sin_squared));
        // The cosine of an angle less another, 1 if that is the greater.
        let less = |cos: f32x8, sin_less: f32x8, cos_less: f32x8| {
            let own = Lanes::sqrt(Lanes::max(one - cos * cos, zero));
            let turned = cos * cos_less + own * sin_less;
            Lanes::select(cos.ge(cos_less), one, turned)
        };
        let [nx, ny, nz] = point.normal;
        let one_sided = nx * nx + ny * ny + nz * nz > 0.0;
        let surface = if one_sided {
            let height = to.dot(Vec3::splat(point.normal));
            let facing = Lanes::max(less(height * nearness, sin, cos), zero);
            let facing = Lanes::select(inside, one, facing);
            // The box may lie below the horizon where its ball does not.
            let rise = self.half.dot(Vec3::splat(point.normal.map(f32::abs)));
            Lanes::select((height + rise).ge(zero), facing, zero)
        } else {
            one
        };
        let along = -(to.dot(self.axis) * nearness);
        let both = self.two_sided.gt(zero);
        let along = Lanes::select(both, Lanes::abs(along), along);
        let leaving = less(along, self.sin_spread, self.cos_spread);
        let leaving = less(leaving, sin, cos);
        let lit = leaving.gt(self.cos_end) | inside;
        let leaving = Lanes::select(inside, one, Lanes::select(lit, leaving, zero));
        let decrease = one / Lanes::max(square, near);
        let decrease = Lanes::select(self.everywhere.gt(zero), one, decrease);
        let importance = self.power * surface * leaving * decrease;
        Lanes::to_array(Lanes::min(importance, splat(MOST)))
    }
}

/// Returns the cosine law of an emitter's facing: its spread and end, whether it is two-sided,
/// and whether its light does not decrease.
pub fn cone_of(facing: Facing) -> (f64, f64, bool, bool) {
    use std::f64::consts::{FRAC_PI_2, PI};
    match facing {
        Facing::All => (PI, FRAC_PI_2, false, false),
        Facing::Flat => (0.0, FRAC_PI_2, true, false),
        Facing::Front => (0.0, FRAC_PI_2, false, false),
        Facing::Spot { slope, start } => {
            // The ramp's zero and one.
            let none = f64::from(-start / slope);
            let full = f64::from((1.0 - start) / slope).min(1.0);
            let (inner, outer) = (libm::acos(full), libm::acos(none.clamp(-1.0, 1.0)));
            (inner, (outer - inner).max(0.0), false, false)
        }
        Facing::Everywhere => (PI, FRAC_PI_2, false, true),
    }
}
