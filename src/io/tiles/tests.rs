use super::*;

/// A tile of 3x2 pixels that has one of each sort.
fn tile() -> PictureTile {
    let pixels = 6;
    PictureTile {
        header: TileHeader {
            whole: (5, 4),
            corner: (2, 1),
            size: (3, 2),
            development: Development {
                tone: Tone::Agx,
                exposure: -1.5,
                dither: true,
                bits: Bits::Sixteen,
                behind: None,
            },
            key: 7 << 100 | 5,
        },
        picture: Picture {
            width: 3,
            height: 2,
            color: (0..6).map(|i| [i as f32, -0.0, f32::NAN]).collect(),
            alpha: Some(vec![0.5; pixels]),
            instance_id: Some(vec![u64::MAX - 1; pixels]),
            uv: Some(vec![[1.0, 2.0]; pixels]),
            variance: Some(vec![[3.0; 3]; pixels]),
            layers: vec![Layer {
                name: "light_a".into(),
                color: vec![[4.0; 3]; pixels],
            }],
            mattes: vec![Matte {
                name: "CryptoMaterial",
                ranks: 2,
                rows: vec![[5.0, 6.0]; 2 * pixels],
                manifest: [("red".to_owned(), 9)].into(),
            }],
            metadata: vec![
                ("a".into(), Attribute::Text("ü".into())),
                ("b".into(), Attribute::Int(-1)),
                ("c".into(), Attribute::Float(0.5)),
                ("d".into(), Attribute::Double(-0.25)),
                ("e".into(), Attribute::Matrix([1.5; 16])),
            ],
            ..Picture::default()
        },
    }
}

fn written(tile: &PictureTile, path: &Path) -> Vec<u8> {
    let mut outputs = Outputs::default();
    tile.save_into(path, &mut outputs).unwrap();
    outputs.commit().unwrap();
    std::fs::read(path).unwrap()
}

#[test]
fn every_bit_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.tile");
    let bytes = written(&tile(), &path);
    assert_eq!(TileHeader::load(&path).unwrap(), tile().header);
    let read = PictureTile::load(&path).unwrap();
    assert_eq!(read.header, tile().header);
    assert_eq!(bytes, written(&read, &path));
    assert_eq!(read.picture.instance_id, tile().picture.instance_id);
    assert_eq!(read.picture.layers, tile().picture.layers);
    assert_eq!(read.picture.mattes, tile().picture.mattes);
    assert_eq!(read.picture.metadata, tile().picture.metadata);
}

#[test]
fn damage_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.tile");
    let good = written(&tile(), &path);
    for at in 0..good.len() {
        let mut bytes = good.clone();
        bytes[at] ^= 0x10;
        std::fs::write(&path, bytes).unwrap();
        assert!(PictureTile::load(&path).is_err(), "{at}");
    }
    for len in 0..good.len() {
        std::fs::write(&path, &good[..len]).unwrap();
        assert!(PictureTile::load(&path).is_err(), "{len}");
    }
    assert!(TileHeader::load(folder.path()).is_err());
    assert!(PictureTile::load(folder.path()).is_err());
}

/// A checksum that is right is no reason to trust lengths.
#[test]
fn lengths_are_compared_with_the_file() {
    let mut tile = tile();
    for size in [(3, 1 << 20), (1 << 20, 2)] {
        tile.header.size = size;
        tile.header.whole = (1 << 14, 1 << 14);
        let body = body_of(&tile.picture);
        assert!(Body(&body).picture(size).is_none());
    }
    let mut body = body_of(&Picture::default());
    let layers = body.len() - 12;
    body[layers..layers + 4].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(Body(&body).picture((0, 0)).is_none());
}

#[test]
fn tiles_are_put_in_their_places() {
    let mut whole = Picture::default();
    tile().put(&mut whole).unwrap();
    assert_eq!((whole.width, whole.height, whole.color.len()), (5, 4, 20));
    let reds: Vec<f32> = whole.color.iter().map(|c| c[0]).collect();
    assert_eq!(reds[5..15], [0., 0., 0., 1., 2., 0., 0., 3., 4., 5.]);
    let mattes = &whole.mattes[0];
    assert_eq!(mattes.rows.len(), 40);
    assert_eq!(mattes.rows[13..16], [[0.0, 0.0], [5.0, 6.0], [5.0, 6.0]]);
    assert_eq!(mattes.manifest.len(), 1);
    let other = PictureTile {
        header: TileHeader {
            corner: (0, 0),
            ..tile().header
        },
        ..tile()
    };
    other.put(&mut whole).unwrap();
    assert!(whole.color[6][0] == 4.0 && whole.color[7][0] == 5.0);
    assert!(whole.layers[0].color[0] == [4.0; 3] && whole.layers.len() == 1);
}
