//! What a data set as a whole may lack, in the words of its maker's warnings.

use super::note::Note;
use super::settings::{DatasetSettings, Format};
use std::collections::BTreeSet;

/// What the pictures of a data set show of its settings.
#[derive(Debug, Default)]
pub struct Doubts {
    pictures: u64,
    /// Pixels whose depth has no number, and the pictures that have some.
    too_far: [u64; 2],
    /// Categories of objects that are met.
    met: BTreeSet<u16>,
    /// Bits of fx, fy, cx and cy.
    lenses: BTreeSet<[u64; 4]>,
}

impl Doubts {
    pub fn add(&mut self, note: &Note) {
        self.pictures += 1;
        self.too_far[0] += note.too_far;
        self.too_far[1] += u64::from(note.too_far > 0);
        self.met
            .extend(note.objects.iter().map(|seen| seen.category));
        self.lenses.insert(note.k.map(f64::to_bits));
    }

    /// Lists what is worth a warning.
    pub fn said(&self, settings: &DatasetSettings) -> Vec<String> {
        let mut said = Vec::new();
        let [pixels, pictures] = self.too_far;
        if pixels > 0 {
            said.push(format!(
                "{pixels} pixels of {pictures} pictures lie farther than {} units, which is what \
                 depth of 16 bits has at depth_scale = {}, and have the depth 0; raise it",
                f64::from(u16::MAX) * settings.depth_scale / settings.unit,
                settings.depth_scale
            ));
        }
        let unmet = settings.category.0.iter();
        let unmet = unmet.filter(|category| !self.met.contains(&category.id));
        for category in unmet.filter(|_| self.pictures > 0) {
            said.push(format!(
                "category {}: no picture shows an object called {}; an object is called as the node \
                 or row that places it, else as its shape",
                category.name,
                category.objects.0.join(" or ")
            ));
        }
        if self.lenses.len() > 1 && settings.writes(Format::Bop) {
            said.push(
                "pictures have lenses of their own: take scene_camera.json, for camera.json has that \
                 of the first"
                    .into(),
            );
        }
        said
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_data_set_lacks_is_said() {
        let settings: DatasetSettings = toml::from_str(
            "write = \"bop\"\ncategory = [{ id = 2, name = \"bolt\", objects = [\"bolt*\", \"b?\"] }]",
        )
        .unwrap();
        let mut doubts = Doubts::default();
        assert!(doubts.said(&settings).is_empty(), "no picture yet");
        doubts.pictures = 2;
        doubts.lenses = [[1, 1, 0, 0], [2, 2, 0, 0]].into();
        doubts.too_far = [7, 1];
        let said = doubts.said(&settings);
        assert_eq!(said.len(), 3, "{said:?}");
        assert!(said[0].starts_with("7 pixels of 1 pictures lie farther than 6.5535 units"));
        assert!(said[1].contains("category bolt: no picture shows an object called bolt* or b?"));
        assert!(said[2].contains("scene_camera.json"));
        doubts.met.insert(2);
        doubts.lenses.pop_last();
        assert_eq!(doubts.said(&settings).len(), 1);
    }
}
