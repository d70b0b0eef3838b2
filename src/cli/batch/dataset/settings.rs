//! The table `[dataset]` of a job file.

use crate::batch::many::Many;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What is written about each picture, for those who learn from it.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DatasetSettings {
    /// Formats that are written.
    pub write: Many<Format>,
    /// What is one object.
    #[serde(default)]
    pub object: ObjectOf,
    /// Kinds of objects, the first that names one counts; without any all are of category 1.
    #[serde(default)]
    pub category: Many<Category>,
    /// Millimetres in a unit of the scene; 1000.
    #[serde(default = "metre")]
    pub unit: f64,
    /// Millimetres in a step of depth; 0.1.
    #[serde(default = "tenth")]
    pub depth_scale: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Format {
    /// Poses, masks and depth as the BOP benchmark has them.
    Bop,
    /// Boxes and masks as COCO has them.
    Coco,
    /// Tracks of objects as Kubric has them.
    Kubric,
    /// Cameras as NeRF has them.
    Nerf,
}

/// Which instances make up one object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ObjectOf {
    /// Shapes that one node places without a transform of their own; else each instance.
    #[default]
    Node,
    /// All below one row of the file's list of instances, or below one root node.
    Root,
}

/// A kind of objects.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Category {
    /// From 1 to 65535.
    pub id: u16,
    pub name: String,
    /// Names of objects, with `*`, `?` and `[a-c]`.
    pub objects: Many<String>,
}

fn metre() -> f64 {
    1000.0
}

fn tenth() -> f64 {
    0.1
}

impl DatasetSettings {
    pub fn writes(&self, format: Format) -> bool {
        self.write.0.contains(&format)
    }

    /// Refuses what no scene would make right.
    pub fn check(&self) -> Result<(), String> {
        for (name, value) in [("unit", self.unit), ("depth_scale", self.depth_scale)] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(format!("{name} is a number of millimetres above 0"));
            }
        }
        for (i, category) in self.category.0.iter().enumerate() {
            if category.id == 0 {
                return Err(format!(
                    "category '{}' has the id 0, which stands for what is no object; count from 1",
                    category.name
                ));
            }
            let same = |other: &&Category| other.id == category.id && other.name != category.name;
            if let Some(other) = self.category.0[..i].iter().find(same) {
                return Err(format!(
                    "categories '{}' and '{}' both have the id {}",
                    other.name, category.name, category.id
                ));
            }
            for pattern in &category.objects.0 {
                glob::Pattern::new(pattern).map_err(|e| {
                    format!(
                        "category '{}': '{pattern}' is no pattern: {e}",
                        category.name
                    )
                })?;
            }
        }
        Ok(())
    }

    /// Returns a text of all that shows in the files of a task.
    pub fn text(&self) -> String {
        let category = |c: &Category| format!("{:?}", (c.id, &c.name, &c.objects.0));
        let categories: Vec<String> = self.category.0.iter().map(category).collect();
        format!(
            "dataset 1 {} {:?} {categories:?} {:?} {:?}",
            self.writes(Format::Bop),
            self.object,
            self.unit,
            self.depth_scale
        )
    }

    /// Returns the category of an object by its own name, else by the names above it, nearest first;
    /// none if it is no object of the data set.
    pub fn category_of<'n>(&self, names: impl Iterator<Item = &'n str>) -> Option<u16> {
        if self.category.0.is_empty() {
            return Some(1);
        }
        let matches = |pattern: &String, name: &str| {
            glob::Pattern::new(pattern).is_ok_and(|pattern| pattern.matches(name))
        };
        let of_name = |name: &str| {
            let all = self.category.0.iter();
            let found = all
                .clone()
                .find(|c| c.objects.0.iter().any(|p| matches(p, name)));
            found.map(|category| category.id)
        };
        names.into_iter().find_map(of_name)
    }

    /// Lists ids and names of the categories, each id once, rising.
    pub fn categories(&self) -> Vec<(u16, &str)> {
        let mut all: Vec<(u16, &str)> = match self.category.0.is_empty() {
            true => vec![(1, "object")],
            false => self
                .category
                .0
                .iter()
                .map(|c| (c.id, &c.name[..]))
                .collect(),
        };
        all.sort_unstable();
        all.dedup();
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(text: &str) -> DatasetSettings {
        toml::from_str(text).unwrap()
    }

    #[test]
    fn the_first_category_that_names_an_object_counts() {
        let s = settings(
            "write = \"coco\"\n\
             category = [{ id = 3, name = \"bolt\", objects = [\"bolt*\", \"screw\"] },\n\
             { id = 4, name = \"part\", objects = \"*t*\" }]",
        );
        s.check().unwrap();
        let of = |names: &[&str]| s.category_of(names.iter().copied());
        assert_eq!(of(&["bolt.001"]), Some(3));
        assert_eq!(of(&["nut"]), Some(4));
        assert_eq!(of(&["floor"]), None);
        // Names above an object stand in for its own.
        assert_eq!(of(&["mesh", "bolts"]), Some(3));
        assert_eq!(s.categories(), [(3, "bolt"), (4, "part")]);
        assert_eq!(
            settings("write = \"bop\"").category_of(["x"].into_iter()),
            Some(1)
        );
    }

    #[test]
    fn what_is_wrong_is_said() {
        let said = |text: &str| settings(text).check().unwrap_err();
        assert!(said("write = \"bop\"\nunit = 0.0").contains("unit"));
        assert!(said("write = \"bop\"\ndepth_scale = inf").contains("depth_scale"));
        let id = "write = \"bop\"\ncategory = { id = 0, name = \"x\", objects = \"*\" }";
        assert!(said(id).contains("count from 1"));
        let glob = "write = \"bop\"\ncategory = { id = 1, name = \"x\", objects = \"[\" }";
        assert!(said(glob).contains("no pattern"));
    }
}
