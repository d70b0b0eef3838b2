//! Groups of lights by name, whose light a picture may keep in layers of their own.

use super::ids::{LightId, MaterialId};
use std::collections::BTreeMap;

/// What may belong to a group of lights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lit {
    Light(LightId),
    /// All that shines of a material.
    Material(MaterialId),
    /// The environment, or the background.
    Environment,
}

/// The groups of a scene's lights; without groups it takes no memory.
#[derive(Clone, Debug, Default)]
pub struct LightGroups {
    names: Vec<Box<str>>,
    of_light: BTreeMap<u32, u32>,
    of_material: BTreeMap<u32, u32>,
    environment: Option<u32>,
}

impl LightGroups {
    /// Puts something into the group of a name.
    pub fn put(&mut self, name: &str, lit: Lit) {
        let known = self.names.iter().position(|known| &**known == name);
        let group = known.unwrap_or_else(|| {
            self.names.push(name.into());
            self.names.len() - 1
        }) as u32;
        match lit {
            Lit::Light(id) => drop(self.of_light.insert(id.0, group)),
            Lit::Material(id) => drop(self.of_material.insert(id.0, group)),
            Lit::Environment => self.environment = Some(group),
        }
    }

    /// Lists the groups' names; a group's number is its place in the list.
    pub fn names(&self) -> impl ExactSizeIterator<Item = &str> {
        self.names.iter().map(|name| &**name)
    }

    /// Returns the group of something, if it is in any.
    pub fn of(&self, lit: Lit) -> Option<u32> {
        match lit {
            Lit::Light(id) => self.of_light.get(&id.0).copied(),
            Lit::Material(id) => self.of_material.get(&id.0).copied(),
            Lit::Environment => self.environment,
        }
    }
}
