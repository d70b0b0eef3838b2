//! Variants of materials (KHR_materials_variants): which one is shown.

use crate::LoadError;
use crate::shared::messages::one_line;
use gltf::json::Root;
use gltf::json::mesh::Primitive;
use serde::Deserialize;
use serde_json::Value;
use std::path::Path;

const NAME: &str = "KHR_materials_variants";

/// Returns the number of the variant of a name. Fails if there is none.
pub(super) fn pick(path: &Path, root: &Root, name: Option<&str>) -> Result<Option<u64>, LoadError> {
    let Some(name) = name else {
        return Ok(None);
    };
    let extensions = root.extensions.as_ref();
    let listed = extensions.and_then(|all| all.others.get(NAME)?.get("variants")?.as_array());
    let listed = listed.into_iter().flatten();
    // One without a name is none that can be asked for.
    let names: Vec<Option<&str>> = listed
        .map(|variant| variant.get("name").and_then(Value::as_str))
        .collect();
    let found = names.iter().position(|known| *known == Some(name));
    found.map(|number| Some(number as u64)).ok_or_else(|| {
        let names: Vec<&str> = names.into_iter().flatten().collect();
        let known = match names.is_empty() {
            true => "the file has no variants".into(),
            false => format!("known are {}", one_line(&names.join(", "))),
        };
        LoadError::Invalid {
            path: path.into(),
            place: "variants".into(),
            message: format!("there is no variant '{}'; {known}", one_line(name)),
        }
    })
}

/// Returns the material that a primitive has in a variant; `None` if the variant leaves it its
/// own.
pub(super) fn material_in(primitive: &Primitive, variant: u64) -> Option<usize> {
    #[derive(Deserialize)]
    struct Mapping {
        material: usize,
        variants: Vec<u64>,
    }
    let extensions = primitive.extensions.as_ref()?;
    let mappings = extensions.others.get(NAME)?.get("mappings")?;
    let mappings = Vec::<Mapping>::deserialize(mappings).ok()?;
    let found = mappings
        .iter()
        .find(|mapping| mapping.variants.contains(&variant));
    found.map(|mapping| mapping.material)
}
