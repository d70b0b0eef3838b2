//! Materials: factors of the extensions, alpha, and what is thin-walled.

use super::*;
use lanecast::internals::scene::{Layers, Material, Model};

/// Loads a document whose one material is this.
fn material(source: Value) -> Result<(Material, Option<String>), LoadError> {
    let bin = points();
    let mut d = document(&bin);
    set(&mut d, "/materials", json!([source]));
    set(&mut d, "/meshes/0/primitives/0/material", json!(0));
    set(&mut d, "/accessors/0/count", json!(3));
    let (scene, warning) = load(&d, &bin)?;
    Ok((scene.materials.rows[0], warning))
}

fn layers(extensions: Value) -> Layers {
    let (material, warning) = material(json!({ "extensions": extensions })).unwrap();
    assert_eq!(warning, None);
    material.layers
}

#[test]
fn extensions_become_layers() {
    let all = layers(json!({
        "KHR_materials_clearcoat": {"clearcoatFactor": 0.5, "clearcoatRoughnessFactor": 0.25},
        "KHR_materials_sheen": {"sheenColorFactor": [0.1, 0.2, 0.3], "sheenRoughnessFactor": 0.75},
        "KHR_materials_iridescence": {
            "iridescenceFactor": 1.0, "iridescenceIor": 1.8, "iridescenceThicknessMaximum": 550
        },
        "KHR_materials_anisotropy": {"anisotropyStrength": 0.5, "anisotropyRotation": 1.5},
        "KHR_materials_dispersion": {"dispersion": 0.5},
        "KHR_materials_specular": {"specularFactor": 0.25, "specularColorFactor": [2, 1, 0]},
        "KHR_materials_transmission": {"transmissionFactor": 0.5},
        "KHR_materials_volume": {
            "thicknessFactor": 0.5, "attenuationDistance": 2, "attenuationColor": [0.5, 1, 0.25]
        },
        "KHR_materials_diffuse_transmission": {
            "diffuseTransmissionFactor": 0.125, "diffuseTransmissionColorFactor": [1, 0.5, 0]
        },
    }));
    let expected = Layers {
        clearcoat: 0.5,
        clearcoat_roughness: 0.25,
        sheen_color: [0.1, 0.2, 0.3],
        sheen_roughness: 0.75,
        iridescence: 1.0,
        iridescence_ior: 1.8,
        iridescence_thickness: 550.0,
        anisotropy: 0.5,
        anisotropy_rotation: 1.5,
        dispersion: 0.5,
        specular: 0.25,
        specular_color: [2.0, 1.0, 0.0],
        attenuation_distance: 2.0,
        attenuation_color: [0.5, 1.0, 0.25],
        diffuse_transmission: 0.125,
        diffuse_transmission_color: [1.0, 0.5, 0.0],
        ..Layers::default()
    };
    assert_eq!(all, expected);
    let names = [
        "clearcoat",
        "sheen",
        "iridescence",
        "anisotropy",
        "dispersion",
        "specular",
        "volume",
        "diffuse_transmission",
    ];
    let empty = names.map(|name| (format!("KHR_materials_{name}"), json!({})));
    assert_eq!(
        layers(Value::Object(empty.into_iter().collect())),
        Layers::default()
    );
}

#[test]
fn transmission_without_a_volume_is_thin_walled() {
    let glass = json!({"transmissionFactor": 1.0});
    let pane = layers(json!({"KHR_materials_transmission": glass}));
    assert!(pane.thin_walled);
    let thin = json!({"thicknessFactor": 0.0, "attenuationDistance": 2.0});
    let film = layers(json!({"KHR_materials_transmission": glass, "KHR_materials_volume": thin}));
    assert!(film.thin_walled && film.attenuation_distance.is_infinite());
    let thick = json!({"thicknessFactor": 0.1});
    let solid = layers(json!({"KHR_materials_transmission": glass, "KHR_materials_volume": thick}));
    assert!(!solid.thin_walled);
    let leaf = json!({"diffuseTransmissionFactor": 0.5});
    assert!(layers(json!({"KHR_materials_diffuse_transmission": leaf})).thin_walled);
    assert!(!layers(json!({})).thin_walled);
}

#[test]
fn alpha_is_opacity_where_it_blends() {
    let with = |mode: &str, alpha: f32, texture: bool| {
        let mut pbr = json!({"baseColorFactor": [1.0, 1.0, 1.0, alpha]});
        if texture {
            pbr["baseColorTexture"] = json!({"index": 0});
        }
        material(json!({"alphaMode": mode, "pbrMetallicRoughness": pbr}))
    };
    let opacity = |mode, alpha| with(mode, alpha, false).unwrap().0.layers.opacity;
    assert_eq!(opacity("BLEND", 0.25), 0.25);
    assert_eq!(opacity("OPAQUE", 0.25), 1.0);
    assert_eq!(opacity("MASK", 0.75), 1.0);
    // A surface that nobody sees is left out, with nothing else in the file.
    assert!(with("BLEND", 0.0, false).is_err());
    assert!(with("MASK", 0.25, false).is_err());
    let (textured, warning) = with("BLEND", 0.5, true).unwrap();
    assert_eq!(textured.layers.opacity, 0.5);
    assert!(warning.unwrap().contains("1 × texture (texture 0 of 0)"));
}

#[test]
fn unlit_surfaces_show_their_base_colour() {
    let (unlit, warning) = material(json!({"extensions": {"KHR_materials_unlit": {}}})).unwrap();
    assert!(unlit.layers.unlit && warning.is_none());
    let dull = Model::MetallicRoughness {
        metallic: 0.0,
        roughness: 1.0,
    };
    assert_eq!(unlit.model, dull);
}

#[test]
fn wrong_values_name_material_and_extension() {
    for (name, value, says) in [
        (
            "sheen",
            json!({"sheenColorFactor": [1, 2]}),
            "invalid length 2",
        ),
        (
            "clearcoat",
            json!({"clearcoatFactor": "much"}),
            "invalid type",
        ),
        (
            "clearcoat",
            json!({"clearcoatFactor": 1.5}),
            "between 0 and 1",
        ),
        ("volume", json!(true), "invalid type"),
        (
            "volume",
            json!({"thicknessFactor": 1.0, "attenuationDistance": 0.0}),
            "attenuation.distance",
        ),
    ] {
        let mut extensions = json!({});
        extensions[format!("KHR_materials_{name}")] = value;
        let said = material(json!({ "extensions": extensions })).unwrap_err();
        let said = said.to_string();
        assert!(said.contains("material ") && said.contains(says), "{said}");
    }
}
