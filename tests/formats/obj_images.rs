//! Images of the materials of OBJ files.

use lanecast::internals::io::{LoadOptions, Loaded, load};
use lanecast::internals::scene::{Alpha, Model, Slot, Texels, Wrap};

#[test]
fn images_of_materials_have_coordinates_from_above() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    image::RgbaImage::from_pixel(2, 1, image::Rgba([255, 0, 0, 51]))
        .save(place("a b.png"))
        .unwrap();
    let mtl = "newmtl m\nmap_Kd -s 2 3 1 -clamp on a b.png\nmap_d a b.png\nnewmtl n\nKd 1 0 0\n";
    std::fs::write(place("m.mtl"), mtl).unwrap();
    let obj = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0.25\nusemtl m\n\
               f 1/1 2/2 3/1\nusemtl n\nf 1 2 3\n";
    std::fs::write(place("m.obj"), obj).unwrap();
    let loaded = load(&place("m.obj"), &LoadOptions::default()).unwrap();
    assert_eq!(loaded.warning, None);
    let scene = loaded.scene;
    let uvs = &scene.meshes.attributes.uvs;
    assert_eq!(uvs[..3], [[0.0, 1.0], [1.0, 0.75], [0.0, 1.0]]);
    let rows: Vec<_> = scene.textures.iter().collect();
    assert_eq!(rows.len(), 1);
    assert_eq!(rows[0].texturing.alpha, Alpha::Blend);
    let [(_, color), (_, opacity)] = rows[0].refs else {
        panic!("two images: {:?}", rows[0].refs);
    };
    assert_eq!(color.wrap, [Wrap::Clamp; 2]);
    // v from below, three times as much, is 1 - 3 (1 - v) from above.
    assert_eq!(color.transform, [[2.0, 0.0, 0.0], [0.0, 3.0, -2.0]]);
    let images = &scene.textures.images;
    let channels = [color, opacity].map(|of| images[of.image.index()].channels);
    assert_eq!(channels, [3, 1]);
    let texel = scene
        .textures
        .texel(&images[opacity.image.index()], 0, 1, 0);
    assert_eq!(texel[0], 0.2);
    // White, as the file says no colour.
    let Model::Phong { diffuse, .. } = scene.materials.rows[0].model else {
        panic!("Phong");
    };
    assert_eq!(diffuse, [1.0; 3]);
}

/// Writes a grey image of one texel, and loads a triangle for each of some materials.
fn with_images(names: &[&str], mtl: &str, materials: &[&str]) -> Loaded {
    let folder = tempfile::tempdir().unwrap();
    for (i, name) in names.iter().enumerate() {
        let grey = image::Luma([128 + i as u8 / 8]);
        let place = folder.path().join(name);
        image::GrayImage::from_pixel(1, 1, grey)
            .save(place)
            .unwrap();
    }
    std::fs::write(folder.path().join("m.mtl"), mtl).unwrap();
    let mut obj = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\n".to_string();
    for name in materials {
        obj += &format!("usemtl {name}\nf 1/1 2/1 3/1\n");
    }
    let path = folder.path().join("m.obj");
    std::fs::write(&path, obj).unwrap();
    load(&path, &LoadOptions::default()).unwrap()
}

#[test]
fn a_later_image_of_a_use_replaces_the_earlier_one() {
    let names = [
        "a.png", "b.png", "c.png", "d.png", "e.png", "f.png", "g.png", "h.png", "i.png",
    ];
    let mtl = "newmtl m\nmap_Kd a.png\nmap_d a.png\nmap_Kd i.png\n";
    let scene = with_images(&names, mtl, &["m"]).scene;
    let refs = scene.textures.iter().next().unwrap().refs;
    let slots: Vec<_> = refs.iter().map(|(slot, _)| *slot).collect();
    assert_eq!(slots, [Slot::Opacity, Slot::BaseColor]);
    let image = &scene.textures.images[refs[1].1.image.index()];
    assert_eq!(image.texels, Texels::Bytes(vec![129]));
}

#[test]
fn an_image_of_several_names_is_one() {
    let names = ["a.png", "b.png", "c.png"];
    let mtl = "newmtl a\nmap_Kd a.png\nnewmtl b\nmap_Kd b.png\nnewmtl c\nmap_Kd c.png\n";
    let loaded = with_images(&names, mtl, &["a", "b", "c"]);
    assert_eq!(loaded.warning, None);
    assert_eq!(loaded.scene.textures.iter().count(), 3);
    assert_eq!(loaded.scene.textures.images.len(), 1);
}

#[test]
fn a_broken_image_is_one_kind_for_all_materials() {
    let mtl = "newmtl a\nmap_Kd m.mtl\nnewmtl b\nmap_Kd m.mtl\n";
    let loaded = with_images(&[], mtl, &["a", "b"]);
    assert_eq!(
        loaded.warning.unwrap(),
        "not imported: 2 × texture (m.mtl: it is no PNG, JPEG, WebP or KTX2 file)"
    );
}
