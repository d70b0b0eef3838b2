//! Formats that do not say which way is up take z for it when asked.

use lanecast::internals::io::{LoadOptions, ZUp, load};
use lanecast::internals::scene::Instances;

#[test]
fn z_up_turns_what_does_not_say() {
    let folder = tempfile::tempdir().unwrap();
    let stl = "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 5\nvertex 1 0 5\nvertex 0 1 5\n\
               endloop\nendfacet\nendsolid s\n";
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
               property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
               0 0 5\n1 0 5\n0 1 5\n3 0 1 2\n";
    let obj = "v 0 0 5\nv 1 0 5\nv 0 1 5\nf 1 2 3\n";
    let options = |z_up| LoadOptions {
        z_up,
        ..LoadOptions::default()
    };
    for (name, text) in [("a.stl", stl), ("a.ply", ply), ("a.obj", obj)] {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        for (z_up, expected) in [
            (ZUp::Never, [0.0, 1.0, 5.0]),
            (ZUp::Asked, [0.0, 5.0, -1.0]),
            (ZUp::WhereUnsaid, [0.0, 5.0, -1.0]),
        ] {
            let scene = load(&path, &options(z_up)).unwrap().scene;
            let all = Instances::of(&scene).unwrap();
            let placed: Vec<_> = all.iter(&scene).map(|row| row.world_from_object).collect();
            assert_eq!(placed.len(), 1, "{name}");
            assert_eq!(placed[0].point([0.0, 1.0, 5.0]), expected, "{name}");
        }
    }
    let path = folder.path().join("a.toml");
    std::fs::write(&path, "format = 1\n").unwrap();
    let said = load(&path, &options(ZUp::Asked)).unwrap_err().to_string();
    assert!(
        said.contains("--z-up of a file that is no .stl, .ply or .obj"),
        "{said}"
    );
}
