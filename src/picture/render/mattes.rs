//! Cryptomattes: which instances and materials the samples of a pixel meet first, by name.
//!
//! Of each sample that counts is what it meets first through holes, with the weight that the pixel
//! filter gives it. A pixel has room for [`ROOM`] instances and as many materials; what finds no
//! room is not counted. Ids become hashes of names when a tile is done, so that a picture of ever
//! so many instances names only those that it shows.

use crate::io::{AovSet, Matte, matte_id};
use crate::scene::{Instances, MaterialId, Scene, Target};
use crate::shade::path::FirstMet;
use bumpalo::Bump;
use std::collections::{BTreeMap, HashMap};
use std::sync::{Mutex, PoisonError};

/// The number of different instances, and of materials, of a pixel that are told apart.
const ROOM: usize = 32;

/// What is told apart: instances, and materials.
const KEYS: usize = 2;

/// Something that samples of a pixel meet, and the sum of their weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Met {
    key: u64,
    weight: f32,
}

/// What the samples of a tile's pixels meet: [`ROOM`] places of each kind, the first ones used.
pub struct MetLists<'b> {
    rows: &'b mut [Met],
}

const NOTHING: Met = Met {
    key: u64::MAX,
    weight: 0.0,
};

impl<'b> MetLists<'b> {
    pub fn new(pixels: usize, arena: &'b Bump) -> MetLists<'b> {
        MetLists {
            rows: arena.alloc_slice_fill_copy(pixels * KEYS * ROOM, NOTHING),
        }
    }

    /// Adds what the next sample of each pixel has met first.
    pub fn add(&mut self, met: &[FirstMet]) {
        for (first, lists) in met.iter().zip(self.rows.chunks_exact_mut(KEYS * ROOM)) {
            if first.instance == FirstMet::NOTHING.instance {
                continue;
            }
            let keys = [first.instance, u64::from(first.material)];
            for (key, list) in keys.into_iter().zip(lists.chunks_exact_mut(ROOM)) {
                let place = list
                    .iter_mut()
                    .find(|met| met.key == key || **met == NOTHING);
                if let Some(met) = place {
                    met.key = key;
                    met.weight += first.weight;
                }
            }
        }
    }

    /// Returns what a pixel's samples have met of a kind.
    pub fn of(&self, pixel: usize, kind: usize) -> &[Met] {
        let list = &self.rows[(pixel * KEYS + kind) * ROOM..][..ROOM];
        let used = list.iter().position(|met| *met == NOTHING);
        &list[..used.unwrap_or(ROOM)]
    }
}

/// What the samples of a whole picture meet, in passes.
#[derive(Default)]
pub struct MetFilm {
    lists: Vec<[Vec<Met>; KEYS]>,
}

impl MetFilm {
    pub fn new(pixels: usize) -> MetFilm {
        MetFilm {
            lists: vec![Default::default(); pixels],
        }
    }

    /// Adds what more samples of a pixel have met.
    pub fn add(&mut self, pixel: usize, more: &[Vec<Met>; KEYS]) {
        for (list, more) in self.lists[pixel].iter_mut().zip(more) {
            for met in more {
                match list.iter().position(|known| known.key == met.key) {
                    Some(place) => list[place].weight += met.weight,
                    None if list.len() < ROOM => list.push(*met),
                    None => {}
                }
            }
        }
    }

    pub fn of(&self, pixel: usize, kind: usize) -> &[Met] {
        &self.lists[pixel][kind]
    }
}

/// The layers of mattes that a picture keeps, and the names of what it shows.
pub struct MatteNames<'s> {
    scene: &'s Scene,
    instances: &'s Instances,
    layers: Vec<Named>,
    pub ranks: u32,
}

/// One layer: what its names stand for, and those that are known.
struct Named {
    of: Of,
    known: Mutex<Known>,
}

#[derive(Default)]
struct Known {
    ids: HashMap<u64, u32>,
    manifest: BTreeMap<String, u32>,
}

#[derive(Clone, Copy, PartialEq)]
enum Of {
    Object,
    Material,
    Instance,
}

impl Of {
    fn layer(self) -> &'static str {
        match self {
            Of::Object => "CryptoObject",
            Of::Material => "CryptoMaterial",
            Of::Instance => "CryptoInstance",
        }
    }

    /// Returns the kind of list that the layer is made of.
    fn kind(self) -> usize {
        match self {
            Of::Object | Of::Instance => 0,
            Of::Material => 1,
        }
    }
}

impl<'s> MatteNames<'s> {
    /// Plans the mattes of a set; `None` if it has none.
    pub fn of(
        aovs: &AovSet,
        ranks: u32,
        (scene, instances): (&'s Scene, &'s Instances),
    ) -> Option<MatteNames<'s>> {
        let asked = [
            (Of::Object, aovs.crypto_object),
            (Of::Material, aovs.crypto_material),
            (Of::Instance, aovs.crypto_instance),
        ];
        let layers: Vec<Named> = asked
            .into_iter()
            .filter(|(_, is)| *is)
            .map(|(of, _)| Named {
                of,
                known: Mutex::default(),
            })
            .collect();
        (!layers.is_empty()).then_some(MatteNames {
            scene,
            instances,
            layers,
            ranks,
        })
    }

    /// Lists the layers' names.
    pub fn layers(&self) -> impl Iterator<Item = &'static str> {
        self.layers.iter().map(|layer| layer.of.layer())
    }

    /// Ranks what a pixel's samples have met by its coverage, into the rows of each layer.
    pub fn rank<'m>(
        &self,
        of: impl Fn(usize) -> &'m [Met],
        samples: u32,
        mattes: &mut [Matte],
        pixel: usize,
    ) {
        let ranks = self.ranks as usize;
        let share = 1.0 / samples.max(1) as f32;
        for (layer, matte) in self.layers.iter().zip(mattes) {
            let mut all: Vec<(u32, f32)> = Vec::new();
            let mut known = layer.known.lock().unwrap_or_else(PoisonError::into_inner);
            for met in of(layer.of.kind()) {
                let id = known.id_of(met.key, || self.name(layer.of, met.key));
                match all.iter_mut().find(|(other, _)| *other == id) {
                    Some((_, weight)) => *weight += met.weight,
                    None => all.push((id, met.weight)),
                }
            }
            drop(known);
            // Equal weights are ordered by id, so that no order of samples shows.
            all.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
            let rows = &mut matte.rows[pixel * ranks..][..ranks];
            for (row, (id, weight)) in rows.iter_mut().zip(all) {
                // A filter with negative lobes goes beyond both ends.
                *row = [f32::from_bits(id), (weight * share).clamp(0.0, 1.0)];
            }
        }
    }

    /// Completes the mattes by the names of what they show.
    pub fn finish(self, mattes: &mut [Matte]) {
        for (layer, matte) in self.layers.into_iter().zip(mattes) {
            let known = layer.known.into_inner();
            matte.manifest = known.unwrap_or_else(PoisonError::into_inner).manifest;
        }
    }

    fn name(&self, of: Of, key: u64) -> String {
        match of {
            Of::Instance => instance_name(self.scene, self.instances, key),
            Of::Object => {
                let shape = self.instances.get(self.scene, key).shape;
                named_or(self.scene.shapes.names.get(shape.0), || {
                    format!("{}.{}", self.scene.shapes.row(shape).kind_name(), shape.0)
                })
            }
            Of::Material => material_name(self.scene, MaterialId(key as u32)),
        }
    }
}

impl Known {
    fn id_of(&mut self, key: u64, name: impl FnOnce() -> String) -> u32 {
        if let Some(id) = self.ids.get(&key) {
            return *id;
        }
        let name = name();
        let id = matte_id(&name);
        self.ids.insert(key, id);
        self.manifest.insert(name, id);
        id
    }
}

/// Returns a material's name: that of the file, or its number, or `default` for surfaces without
/// one.
pub fn material_name(scene: &Scene, id: MaterialId) -> String {
    match id.index() < scene.materials.len() {
        true => named_or(scene.materials.names.get(id.0), || {
            format!("material.{}", id.0)
        }),
        false => "default".into(),
    }
}

fn named_or(name: Option<&str>, or: impl FnOnce() -> String) -> String {
    name.map_or_else(or, Into::into)
}

/// Names an instance by its path: a name and number for each step, such as `row.3/pawn.0`. The
/// name is that of the row of the file's list of instances, else that of the node or shape placed,
/// else `node` or the shape's kind; the number is the row, or the child's.
pub fn instance_name(scene: &Scene, instances: &Instances, id: u64) -> String {
    let path = instances.path(scene, id);
    let Some((root, children)) = path.split_first() else {
        return String::new();
    };
    let called = |target: Target| match target {
        Target::Node(node) => named_or(scene.nodes.names.get(node.0), || "node".into()),
        Target::Shape(shape) => named_or(scene.shapes.names.get(shape.0), || {
            scene.shapes.row(shape).kind_name().into()
        }),
    };
    let mut target = scene.roots.target[*root as usize];
    let first = named_or(scene.root_names.get(*root), || called(target));
    let mut name = format!("{first}.{root}");
    for child in children {
        let Target::Node(node) = target else {
            break;
        };
        let first = scene.nodes.children[node.index()].start;
        target = scene.edges.target[(first + child) as usize];
        name += &format!("/{}.{child}", called(target));
    }
    name
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_counted_by_what_they_meet() {
        let arena = Bump::new();
        let mut lists = MetLists::new(2, &arena);
        let met = |instance, material, weight| FirstMet {
            instance,
            material,
            weight,
        };
        let nothing = FirstMet::NOTHING;
        lists.add(&[met(7, 1, 1.0), nothing]);
        lists.add(&[met(8, 1, 0.5), nothing]);
        lists.add(&[met(7, 2, 1.0), met(0, 0, 1.0)]);
        let of = |pixel, kind| -> Vec<(u64, f32)> {
            let list = lists.of(pixel, kind).iter();
            list.map(|met| (met.key, met.weight)).collect()
        };
        assert_eq!(of(0, 0), [(7, 2.0), (8, 0.5)]);
        assert_eq!(of(0, 1), [(1, 1.5), (2, 1.0)]);
        assert_eq!(of(1, 0), [(0, 1.0)]);
        let mut film = MetFilm::new(1);
        for _ in 0..2 {
            film.add(0, &[0, 1].map(|kind| lists.of(0, kind).to_vec()));
        }
        assert_eq!(film.of(0, 0)[0].weight, 4.0);
    }

    #[test]
    fn what_finds_no_room_is_left_out() {
        let arena = Bump::new();
        let mut lists = MetLists::new(1, &arena);
        for instance in 0..100 {
            lists.add(&[FirstMet {
                instance,
                material: 0,
                weight: 1.0,
            }]);
        }
        assert_eq!(lists.of(0, 0).len(), ROOM);
        assert_eq!(lists.of(0, 1)[0].weight, 100.0);
    }
}
