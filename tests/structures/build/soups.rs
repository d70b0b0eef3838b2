//! Triangle soups for builders, among them degenerate ones.

use crate::common::Random;
use lanecast::internals::scene::{Mesh, MeshData, Meshes};

pub type Triangle = [[f32; 3]; 3];

/// A mesh with three vertices of its own per triangle.
pub fn soup(triangles: &[Triangle]) -> Meshes {
    let mut meshes = Meshes::default();
    let corners = triangles.iter().flatten();
    let count = triangles.len() as u32;
    meshes.push(&MeshData {
        positions: corners.map(|c| c.map(f64::from)).collect(),
        triangles: (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        ..MeshData::default()
    });
    meshes
}

pub fn row(meshes: &Meshes) -> Mesh<'_> {
    meshes.row(lanecast::internals::scene::MeshId(0))
}

/// Numbers in 0..1, the same ones every time.
pub fn numbers(seed: u64) -> impl FnMut() -> f32 {
    let mut random = Random(seed);
    move || (random.bits() >> 40) as f32 / (1 << 24) as f32
}

/// Small triangles about points that crowd near the middle.
pub fn cloud(count: usize) -> Vec<Triangle> {
    let mut next = numbers(7);
    let corner =
        |middle: [f32; 3], next: &mut dyn FnMut() -> f32| middle.map(|x| x + 0.02 * (next() - 0.5));
    (0..count)
        .map(|_| {
            let middle = std::array::from_fn(|_| (next() - 0.5) * next());
            std::array::from_fn(|_| corner(middle, &mut next))
        })
        .collect()
}

/// A sheet in 128 × 128 cells, shuffled.
pub fn sheet() -> Vec<Triangle> {
    let mut next = numbers(1);
    let mut triangles: Vec<Triangle> = (0..1 << 15)
        .map(|i| {
            let (x, y) = ((i / 2 % 128) as f32, (i / 256) as f32);
            let far = [x + (i % 2) as f32, y + 1.0 - (i % 2) as f32, 0.0];
            [[x, y, 0.0], far, [x + 1.0, y + 1.0, 0.0]]
        })
        .collect();
    for i in (1..triangles.len()).rev() {
        triangles.swap(i, (next() * i as f32) as usize);
    }
    triangles
}

/// What no split tells apart, or f32 hardly holds.
pub fn degenerate(count: usize) -> Vec<(&'static str, Vec<Triangle>)> {
    let mut next = numbers(3);
    let mut random = || -> Triangle { std::array::from_fn(|_| std::array::from_fn(|_| next())) };
    let plain: Vec<Triangle> = (0..count).map(|_| random()).collect();
    let mapped = |f: &dyn Fn(usize, [f32; 3]) -> [f32; 3]| -> Vec<Triangle> {
        let each = plain.iter().enumerate();
        each.map(|(i, t)| t.map(|p| f(i, p))).collect()
    };
    vec![
        ("identical", vec![plain[0]; count]),
        ("one point", mapped(&|_, _| [1.0, 2.0, 3.0])),
        (
            "at the origin, signs of zero",
            mapped(&|i, _| [-0.0, 0.0, [-0.0, 0.0][i % 2]]),
        ),
        ("flat", mapped(&|_, [x, y, _]| [x, y, 5.0])),
        ("on a line", mapped(&|_, [x, ..]| [x, 1.0, 1.0])),
        ("on a slanted line", mapped(&|_, [x, ..]| [x, x, x])),
        ("nested", mapped(&|i, p| p.map(|x| (x - 0.5) * i as f32))),
        (
            "powers",
            mapped(&|i, p| p.map(|x| x * 2.0_f32.powi(i as i32 % 250 - 126))),
        ),
        ("tiny", mapped(&|_, p| p.map(|x| x * 1e-30))),
        ("denormal", mapped(&|_, p| p.map(|x| x * 1e-42))),
        ("huge", mapped(&|_, p| p.map(|x| x * 1e30))),
        (
            "largest",
            mapped(&|_, p| p.map(|x| (x - 0.5) * 2.0 * f32::MAX)),
        ),
        (
            "all on one side",
            mapped(&|_, p| p.map(|x| f32::MAX * (0.9 + 0.1 * x))),
        ),
        ("far away", mapped(&|_, [x, y, z]| [x + 1e6, y, z])),
    ]
}
