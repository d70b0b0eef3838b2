//! Motion: what an animation makes of nodes, as keys of the scene.
//!
//! The scene turns and stretches from key to key as LINEAR channels do, so their keys are its
//! keys. What steps has a key just before each step. Cubics get as many keys as keep the way
//! between them within [`NEAR`], and one at each frame, where they are met.

use super::File;
use super::animation::{Animation, Curves, Way};
use super::container::Placement;
use super::nodes::{NO_PARENT, label};
use super::placement::local_transform;
use crate::math::Affine;
use crate::scene::{Interpolation, Key, SceneBuilder, TransformId};
use crate::{Animated, ImportReport, LoadError};
use glam::{DQuat, DVec3};

/// How far from a cubic the way between two keys may be, relative to the size of its values.
const NEAR: f64 = 1e-4;

/// The most halvings of the time between two keys of a file.
const MOST_HALVINGS: u32 = 10;

/// The cosine of half the angle that one key is turned from the one before at most: 90 degrees,
/// so that it is plain which way is the shorter.
const LEAST_COSINE: f64 = 0.707;

/// How nodes move, and the times for which meshes that deform are computed.
pub(super) struct Motion {
    /// The placements of all nodes of the file at time 0.
    pub start: Vec<Placement>,
    rest: Vec<Placement>,
    animation: Option<Animation>,
    /// Times from 0 to 1, rising from 0.
    pub samples: Vec<f64>,
}

impl Motion {
    /// Makes the motion of an animation, or none.
    pub fn new(
        rest: Vec<Placement>,
        animation: Option<Animation>,
        asked: Option<&Animated>,
    ) -> Motion {
        let (seconds, nodes) = animation
            .as_ref()
            .map_or((1.0, None), |a| (a.seconds, Some(&a.nodes)));
        let start = (0..).zip(&rest).map(|(node, rest): (usize, _)| {
            let curves = nodes
                .and_then(|nodes| nodes.get(&node))
                .filter(|c| c.moves());
            curves.map_or_else(|| rest.clone(), |curves| curves.placement(rest, 0.0))
        });
        Motion {
            start: start.collect(),
            samples: match (asked, nodes) {
                (Some(asked), Some(_)) => asked.samples(seconds),
                _ => vec![0.0],
            },
            rest,
            animation,
        }
    }

    pub(super) fn curves(&self, node: usize) -> Option<&Curves> {
        self.animation.as_ref()?.nodes.get(&node)
    }

    /// Says whether a node itself moves.
    pub fn moves(&self, node: usize) -> bool {
        self.curves(node).is_some_and(Curves::moves)
    }

    /// Says whether any node moves.
    pub fn any_moves(&self) -> bool {
        let all = self.animation.as_ref();
        all.is_some_and(|all| all.nodes.values().any(Curves::moves))
    }

    /// Returns the placements of all nodes at a time.
    pub fn placements(&self, time: f64) -> Vec<Placement> {
        let rows = self.rest.iter().enumerate();
        rows.map(
            |(node, rest)| match self.curves(node).filter(|c| c.moves()) {
                Some(curves) => curves.placement(rest, time),
                None => rest.clone(),
            },
        )
        .collect()
    }

    fn local(&self, file: &File, node: usize, time: f64) -> Result<Affine, LoadError> {
        let placement = match self.curves(node).filter(|curves| curves.moves()) {
            Some(curves) => &curves.placement(&self.rest[node], time),
            None => &self.rest[node],
        };
        // What is repaired is reported already.
        let mut unused = ImportReport::default();
        local_transform(file, &|| label(file, node), placement, &mut unused)
    }

    /// Returns the places of a node in the world: `world`, and if it moves one for each sample.
    pub fn worlds(
        &self,
        file: &File,
        node: usize,
        parents: &[u32],
        world: Affine,
    ) -> Result<Vec<(f64, Affine)>, LoadError> {
        let above = |node: &usize| {
            let parent = parents[*node];
            (parent != NO_PARENT).then_some(parent as usize)
        };
        let way: Vec<usize> = std::iter::successors(Some(node), above).collect();
        if !way.iter().any(|node| self.moves(*node)) {
            return Ok(vec![(0.0, world)]);
        }
        let mut worlds = Vec::with_capacity(self.samples.len());
        for time in &self.samples {
            let mut world = self.local(file, way[way.len() - 1], *time)?;
            for node in way.iter().rev().skip(1) {
                world = world.then_after(&self.local(file, *node, *time)?);
            }
            worlds.push((*time, world));
        }
        Ok(worlds)
    }

    /// Adds the transform of a node to its parent, which is `start` at time 0.
    pub fn transform(
        &self,
        file: &File,
        node: usize,
        start: Affine,
        scene: &mut SceneBuilder,
        report: &mut ImportReport,
    ) -> Result<TransformId, LoadError> {
        let Some(curves) = self.curves(node).filter(|curves| curves.moves()) else {
            return Ok(scene.transform(start));
        };
        let times = self.key_times(node, curves);
        file.spend(times.len() as u64, &label(file, node))?;
        let mut keys = Vec::with_capacity(times.len());
        for at in times {
            let local = self.local(file, node, at)?;
            keys.push(Key { at, local });
        }
        let mirrors = |map: &Affine| {
            let [x, y, z] = map.linear().map(DVec3::from_array);
            x.dot(y.cross(z)) < 0.0
        };
        if keys
            .iter()
            .any(|key| mirrors(&key.local) != mirrors(&start))
        {
            report.add("animation that turns a node inside out");
            return Ok(scene.transform(start));
        }
        if keys.iter().all(|key| key.local == start) {
            return Ok(scene.transform(start));
        }
        Ok(scene.moving_by(Interpolation::Rigid, start, &keys))
    }

    /// Lists the times of a node's keys, after 0 and up to 1.
    fn key_times(&self, node: usize, curves: &Curves) -> Vec<f64> {
        let mut times = Vec::new();
        for curve in curves.of_placement() {
            times.extend(&curve.at);
            if curve.way == Way::Step {
                times.extend(curve.at.iter().map(|at| at.next_down()));
            }
        }
        let is_cubic = curves.of_placement().any(|curve| curve.way == Way::Cubic);
        if is_cubic {
            times.extend(&self.samples);
        }
        times.retain(|at| *at > 0.0 && *at <= 1.0);
        times.sort_unstable_by(f64::total_cmp);
        times.dedup();
        let rest = &self.rest[node];
        let mut all = Vec::with_capacity(times.len());
        let mut last = 0.0;
        for time in times {
            halve(curves, rest, (last, time), MOST_HALVINGS, &mut all);
            all.push(time);
            last = time;
        }
        all
    }
}

/// Lists the times between two that need a key.
fn halve(
    curves: &Curves,
    rest: &Placement,
    (from, to): (f64, f64),
    halvings: u32,
    all: &mut Vec<f64>,
) {
    let middle = 0.5 * (from + to);
    if halvings == 0 || !(from < middle && middle < to) {
        return;
    }
    let [a, m, b] = [from, middle, to].map(|time| curves.placement(rest, time));
    let turn = |p: &Placement| DQuat::from_array(p.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]));
    let [p, q, r] = [&a, &m, &b].map(|p| turn(p).normalize());
    let r = if p.dot(r) < 0.0 { -r } else { r };
    let q = if p.dot(q) < 0.0 { -q } else { q };
    let mean = (p + r).normalize();
    let mut is_near = p.dot(r) >= LEAST_COSINE && (mean - q).length() <= NEAR;
    for of in [|p: &Placement| p.translation, |p: &Placement| p.scale] {
        if let [Some(a), Some(m), Some(b)] = [&a, &m, &b].map(of) {
            let [a, m, b] = [a, m, b].map(DVec3::from_array);
            let size = a.abs().max(b.abs()).max(m.abs()).max_element();
            is_near &= ((a + b) * 0.5 - m).length() <= NEAR * size;
        }
    }
    if is_near {
        return;
    }
    halve(curves, rest, (from, middle), halvings - 1, all);
    all.push(middle);
    halve(curves, rest, (middle, to), halvings - 1, all);
}
