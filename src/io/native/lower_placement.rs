//! Placements of the file to edges of the scene: what is placed, where, how often and when.

use super::files::{Files, Overrides, PlacedFile};
use super::lower::{Names, Result, find};
use super::lower_transform::{powers, transform};
use super::schema;
use super::source_spans::At;
use super::tree::Source;
use crate::math::Affine;
use crate::scene::{Edge, Interpolation, Key, SceneBuilder};
use crate::{ImportReport, LoadOptions};
use std::rc::Rc;

/// What placements are made from, beside their rows.
pub(super) struct Placements<'p> {
    options: &'p LoadOptions,
    files: &'p mut Files,
    placed: Vec<(Rc<PlacedFile>, usize)>,
}

impl<'p> Placements<'p> {
    pub(super) fn new(options: &'p LoadOptions, files: &'p mut Files) -> Placements<'p> {
        Placements {
            options,
            files,
            placed: Vec::new(),
        }
    }

    /// Returns the files that are placed and the offset of the first placement of each, in the
    /// order of these.
    pub(super) fn placed(self) -> Vec<(Rc<PlacedFile>, usize)> {
        self.placed
    }

    /// Adds the edges of a placement: one, or as many as it is repeated.
    pub(super) fn edges(
        &mut self,
        names: &Names,
        row: &At<schema::Child>,
        (scene, report): (&mut SceneBuilder, &mut ImportReport),
        edges: &mut Vec<Edge>,
    ) -> Result<()> {
        let child = &row.value;
        let source = names.source;
        let edge = self.target(names, row, (scene, report))?;
        let edge = match &child.material {
            Some(name) => edge.material(find(source, "material", names.materials, name)?),
            None => edge,
        };
        let local = match &child.transform {
            Some(steps) => transform(source, steps)?,
            None => Affine::IDENTITY,
        };
        let interpolation = match child.interpolation.as_ref().map(|row| row.value) {
            Some(schema::Interpolation::Rigid) => Interpolation::Rigid,
            Some(schema::Interpolation::Linear) | None => Interpolation::Linear,
        };
        let keys = match (&child.motion, &child.interpolation) {
            (Some(motion), _) => Some(keys(source, motion)?),
            (None, None) => None,
            (None, Some(row)) => {
                let message = "interpolation is how things move between the keys of a motion, and \
                               there is no motion here; give one, or leave it out";
                return Err(source.error(row.at, message));
            }
        };
        let mut add = |scene: &mut SceneBuilder, local: Affine, keys: Option<&[Key]>| {
            let id = match keys {
                Some(keys) => scene.moving_by(interpolation, local, keys),
                None => scene.transform(local),
            };
            edges.push(edge.transform(id));
        };
        let Some(repeat) = &child.repeat else {
            add(scene, local, keys.as_deref());
            return Ok(());
        };
        for (k, power) in self
            .copies(source, repeat, keys.as_deref())?
            .iter()
            .enumerate()
        {
            let of_copy = |local: &Affine| match power.is_identity() {
                true => *local,
                false => power.then_after(local),
            };
            let there = of_copy(&local);
            // A placement that is singular by itself is refused by the scene's own check.
            if there.inverse().is_none() && local.inverse().is_some() {
                let message = format!(
                    "copy {k} is singular or infinite: the transform, repeated as often, grows or \
                     shrinks too far; repeat it less"
                );
                return Err(source.error(repeat.at, message));
            }
            let keys = keys.as_ref().map(|keys| {
                let moved = |key: &Key| Key {
                    local: of_copy(&key.local),
                    ..*key
                };
                keys.iter().map(moved).collect::<Vec<Key>>()
            });
            add(scene, there, keys.as_deref());
        }
        Ok(())
    }

    /// Returns the maps of a repeat's copies, that of copy 0 first.
    fn copies(
        &mut self,
        source: &Source,
        repeat: &At<schema::Repeat>,
        keys: Option<&[Key]>,
    ) -> Result<Vec<Affine>> {
        let count = &repeat.value.count;
        let copies = count.value;
        if !(copies >= 1.0 && copies.fract() == 0.0) {
            let message = format!("count = {copies}; give a whole number of copies, 1 or more");
            return Err(source.error(count.at, message));
        }
        // Beyond 2⁶⁴ the conversion gives the largest number, which is too many, too.
        let spent = (copies as u64).saturating_mul(1 + keys.map_or(0, <[Key]>::len) as u64);
        let spent = self.files.spend_copies(spent);
        spent.map_err(|why| source.error(count.at, why))?;
        powers(source, &repeat.value.transform, copies as usize)
    }

    /// Returns an edge to what is placed.
    fn target(
        &mut self,
        names: &Names,
        row: &At<schema::Child>,
        (scene, report): (&mut SceneBuilder, &mut ImportReport),
    ) -> Result<Edge> {
        let child = &row.value;
        let source = names.source;
        if let (Some(materials), None) = (&child.materials, &child.scene) {
            let message = "materials takes the place of materials of a file, and no scene is given \
                           here; write material = \"NAME\", or leave it out";
            return Err(source.error(materials.at, message));
        }
        match (&child.shape, &child.node, &child.scene) {
            (Some(name), None, None) => {
                let shape = find(source, "shape", names.shapes, name)?;
                Ok(Edge::shape(shape))
            }
            (None, Some(name), None) => Ok(Edge::node(find(source, "node", names.nodes, name)?)),
            (None, None, Some(file)) => {
                let mut overrides: Overrides = Vec::new();
                for (name, by) in child.materials.iter().flat_map(|all| &all.value.0) {
                    overrides.push((name, find(source, "material", names.materials, by)?));
                }
                let placed = (source, file);
                let placed = self
                    .files
                    .place(placed, &overrides, self.options, scene, report)?;
                let edge = Edge::node(placed.node);
                if !self
                    .placed
                    .iter()
                    .any(|(known, _)| known.node == placed.node)
                {
                    self.placed.push((placed, file.at));
                }
                Ok(edge)
            }
            (None, None, None) => {
                let message = "none of shape, node and scene is given; name what is placed here";
                Err(source.error(row.at, message))
            }
            (shape, node, file) => {
                let given = [("shape", shape), ("node", node), ("scene", file)];
                let given: Vec<_> = given
                    .into_iter()
                    .filter_map(|(k, v)| Some((k, v.as_ref()?)))
                    .collect();
                let both = given
                    .iter()
                    .map(|(key, _)| *key)
                    .collect::<Vec<_>>()
                    .join(" and ");
                let message =
                    format!("both {both} are given; an instance or child places one of them");
                Err(source.error(given[1].1.at, message))
            }
        }
    }
}

/// In the order of their times.
fn keys(source: &Source, motion: &At<Vec<At<schema::Key>>>) -> Result<Vec<Key>> {
    if motion.value.is_empty() {
        let message = "motion has no keys; give one, such as { at = 1.0, transform = […] }, \
                       or leave it out";
        return Err(source.error(motion.at, message));
    }
    let mut keys: Vec<Key> = Vec::with_capacity(motion.value.len());
    for row in &motion.value {
        let schema::Key {
            at,
            transform: steps,
        } = &row.value;
        let (time, last) = (at.value, keys.last().map_or(0.0, |key| key.at));
        let message = if !(time > 0.0 && time <= 1.0) {
            format!("at = {time}; it must be above 0, where 'transform' holds, and at most 1")
        } else if time <= last {
            format!("at = {time} after {last}; give the keys in the order of their times")
        } else {
            let local = transform(source, steps)?;
            if local.inverse().is_some() {
                keys.push(Key { at: time, local });
                continue;
            }
            "the transform of this key is singular (a scale of 0, or a matrix that flattens \
             space); give every axis a size"
                .into()
        };
        let place = if time > last && time <= 1.0 {
            row.at
        } else {
            at.at
        };
        return Err(source.error(place, message));
    }
    Ok(keys)
}
