use super::*;
use proptest::prelude::*;

fn rays(n: usize) -> RaySet {
    let mut rays = RaySet::default();
    for i in 0..n {
        let x = i as f32;
        let t_max = if i % 2 == 0 { f32::INFINITY } else { 1.0 };
        rays.push([x, -x, 0.1], 1e-3 * x, [0.5, 1e-38, -x], t_max);
    }
    rays
}

fn triangles() -> TriangleSet {
    TriangleSet {
        positions: vec![[0.0, 1.0, -2.5], [1e30, -0.0, 3.0], [7.0, 8.0, 9.0]],
        triangles: vec![[0, 1, 2], [2, 1, 1]],
    }
}

#[test]
fn the_layout_is_the_documented_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("one.primary.rays");
    let mut one = RaySet::default();
    one.push([1.0, 2.0, 3.0], 4.0, [5.0, 6.0, 7.0], 8.0);
    one.save(&path).unwrap();
    let mut expected = b"RAY1\x01\0\0\0".to_vec();
    for x in 1..=8 {
        expected.extend((x as f32).to_le_bytes());
    }
    assert_eq!(std::fs::read(&path).unwrap(), expected);

    let path = folder.path().join("one.msh");
    let mesh = TriangleSet {
        positions: vec![[1.0, 2.0, 3.0]],
        triangles: vec![[0, 0, 0], [0, 0, 0]],
    };
    mesh.save(&path).unwrap();
    let mut expected = b"MSH1\x01\0\0\0\x02\0\0\0".to_vec();
    for x in 1..=3 {
        expected.extend((x as f32).to_le_bytes());
    }
    expected.extend([0; 24]);
    assert_eq!(std::fs::read(&path).unwrap(), expected);
}

#[test]
fn what_is_written_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x");
    for n in [0, 1, 1000] {
        rays(n).save(&path).unwrap();
        assert_eq!(RaySet::load(&path).unwrap(), rays(n));
    }
    for mesh in [TriangleSet::default(), triangles()] {
        mesh.save(&path).unwrap();
        assert_eq!(TriangleSet::load(&path).unwrap(), mesh);
    }
}

fn refuses<T: std::fmt::Debug>(
    load: fn(&Path) -> Result<T, LoadError>,
    bytes: &[u8],
    message: &str,
) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x");
    std::fs::write(&path, bytes).unwrap();
    let said = load(&path).unwrap_err().to_string();
    assert!(said.contains(message), "{said}");
    assert!(said.starts_with(path.to_str().unwrap()), "{said}");
}

fn bytes_of(save: impl FnOnce(&Path)) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x");
    save(&path);
    std::fs::read(path).unwrap()
}

#[test]
fn malformed_rays() {
    let good = bytes_of(|path| rays(3).save(path).unwrap());
    let bad = |bytes: &[u8], message: &str| refuses(RaySet::load, bytes, message);
    bad(b"", "with 'RAY1' and 1 count");
    bad(b"RAY1\0\0\0", "with 'RAY1' and 1 count");
    bad(b"MSH1\0\0\0\0", "does not begin like a .rays file");
    bad(
        &good[..good.len() - 1],
        "3 rays, which are 96 bytes, but 95",
    );
    bad(&[&good[..], &[0]].concat(), "but 97 follow");
    // The header announces 137 GB and nothing follows: refused before memory is allocated.
    bad(b"RAY1\xff\xff\xff\xff", "4294967295 rays");
    let mut nan = good.clone();
    nan[8 + 32 + 16..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    bad(&nan, "ray 1: it has a number that is not finite");
    nan = good.clone();
    nan[8 + 64 + 28..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    bad(&nan, "ray 2: it has a number");
    let mut behind = good;
    behind[8 + 32 + 12..][..4].copy_from_slice(&(-1e-3_f32).to_le_bytes());
    bad(&behind, "ray 1: its tmin is below 0");
}

#[test]
fn malformed_meshes() {
    let good = bytes_of(|path| triangles().save(path).unwrap());
    let bad = |bytes: &[u8], message: &str| refuses(TriangleSet::load, bytes, message);
    bad(b"", "with 'MSH1' and 2 counts");
    bad(b"MSH1\0\0\0\0\0\0\0", "with 'MSH1' and 2 counts");
    bad(
        &good[..good.len() - 4],
        "3 vertices and 2 triangles, which are 60 bytes, but 56",
    );
    bad(&[&good[..], &good[..]].concat(), "the file is damaged");
    // Both counts are the largest possible: 103 GB, which must not wrap around.
    bad(
        b"MSH1\xff\xff\xff\xff\xff\xff\xff\xff",
        "103079215080 bytes, but 0",
    );
    let mut index = good.clone();
    index[12 + 36 + 12 + 4] = 3;
    bad(&index, "triangle 1: it uses vertex 3, but there are only 3");
    let mut infinite = good;
    infinite[12 + 12 + 8..][..4].copy_from_slice(&f32::INFINITY.to_le_bytes());
    bad(&infinite, "vertex 1: its position is not finite");
}

#[test]
fn files_that_are_none() {
    let folder = tempfile::tempdir().unwrap();
    let said = RaySet::load(&folder.path().join("no")).unwrap_err();
    assert!(said.to_string().contains("cannot be read"), "{said}");
    let said = TriangleSet::load(folder.path()).unwrap_err();
    assert!(said.to_string().contains("not a regular file"), "{said}");
}

#[test]
fn unequal_columns_are_not_written() {
    let folder = tempfile::tempdir().unwrap();
    let mut broken = rays(2);
    broken.t_max.pop();
    assert!(broken.save(&folder.path().join("x")).is_err());
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 0);
}

proptest! {
    /// Reads arbitrary bytes, which must end with a set or an error, without panic.
    #[test]
    fn any_bytes(magic in prop_oneof![Just(*b"RAY1"), Just(*b"MSH1"), any::<[u8; 4]>()],
                 counts in proptest::collection::vec(0_u32..4, 0..3),
                 rest in proptest::collection::vec(any::<u8>(), 0..100)) {
        let mut bytes = magic.to_vec();
        bytes.extend(counts.iter().flat_map(|n| n.to_le_bytes()));
        bytes.extend(rest);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x");
        std::fs::write(&path, &bytes).unwrap();
        if let Ok(rays) = RaySet::load(&path) {
            prop_assert_eq!(bytes.len(), 8 + 32 * rays.len());
        }
        if let Ok(mesh) = TriangleSet::load(&path) {
            let rows = mesh.positions.len() + mesh.triangles.len();
            prop_assert_eq!(bytes.len(), 12 + 12 * rows);
        }
    }
}
