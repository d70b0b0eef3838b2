//! What materials have, by name.

use lanecast_model::scene::{Material, Model, Slot, Tables};

/// Says whether light inside a solid of the material is bent or absorbed.
pub fn is_medium(material: &Material) -> bool {
    material.transmission > 0.0 && !material.layers.thin_walled
}

/// Names what some material has and the direct integrator does not show.
pub fn beyond_direct(scene: &Tables) -> Vec<&'static str> {
    const SHOWN: [&str; 5] = ["phong", "emission", "transmission", "metal", "priority"];
    let mut layers = layers_of(&scene.materials.rows);
    layers.retain(|layer| !SHOWN.contains(layer));
    let mut textured = scene.textures.iter();
    if textured.any(|row| row.has(Slot::Normal) || row.has(Slot::ClearcoatNormal)) {
        layers.push("normal maps");
    }
    layers
}

/// Names what some material has.
pub fn layers_of(rows: &[Material]) -> Vec<&'static str> {
    type Has = fn(&Material) -> bool;
    let known: [(&str, Has); 17] = [
        ("phong", |m| matches!(m.model, Model::Phong { .. })),
        ("emission", |m| m.emission != [0.0; 3]),
        ("unlit", |m| m.layers.unlit),
        ("opacity", |m| m.layers.opacity < 1.0),
        ("transmission", |m| m.transmission > 0.0),
        ("thin walls", |m| {
            m.transmission > 0.0 && m.layers.thin_walled
        }),
        ("absorption", |m| {
            is_medium(m) && m.layers.attenuation_distance.is_finite()
        }),
        ("priority", |m| is_medium(m) && m.layers.priority != 0),
        ("dispersion", |m| m.layers.dispersion > 0.0),
        ("diffuse roughness", |m| m.layers.diffuse_roughness > 0.0),
        ("diffuse transmission", |m| {
            m.layers.diffuse_transmission > 0.0
        }),
        ("specular", |m| {
            m.layers.specular != 1.0 || m.layers.specular_color != [1.0; 3]
        }),
        ("anisotropy", |m| m.layers.anisotropy > 0.0),
        ("clearcoat", |m| m.layers.clearcoat > 0.0),
        ("sheen", |m| m.layers.sheen_color != [0.0; 3]),
        ("iridescence", |m| m.layers.iridescence > 0.0),
        (
            "metal",
            |m| matches!(m.model, Model::MetallicRoughness { metallic, .. } if metallic > 0.0),
        ),
    ];
    let some = known.iter().filter(|(_, has)| rows.iter().any(has));
    some.map(|(name, _)| *name).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use lanecast_model::scene::{SceneBuilder, Texels, TextureRef, Texturing};

    #[test]
    fn normal_maps_are_beyond_direct_light() {
        for (slot, expected) in [
            (Slot::Normal, &["normal maps"][..]),
            (Slot::ClearcoatNormal, &["normal maps"]),
            (Slot::BaseColor, &[]),
        ] {
            let mut scene = SceneBuilder::default();
            let id = scene.material("", Material::default());
            let image = scene.image(Texels::Bytes(vec![128, 128, 255]), 3, false, [1, 1]);
            scene.texture(
                id,
                Texturing::default(),
                &[(slot, TextureRef::plain(image))],
            );
            assert_eq!(beyond_direct(scene.tables()), expected);
        }
    }
}
