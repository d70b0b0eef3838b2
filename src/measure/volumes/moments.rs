//! Second moments of solids, and how affine maps change them.

use glam::DVec3;

/// A symmetric 3×3 matrix: xx, yy, zz, xy, xz, yz.
pub type Symmetric = [f64; 6];

/// Rows and columns of [`Symmetric`]'s entries.
pub const PAIRS: [[usize; 2]; 6] = [[0, 0], [1, 1], [2, 2], [0, 1], [0, 2], [1, 2]];

/// Returns v vᵀ, scaled.
pub fn outer(v: DVec3, scale: f64) -> Symmetric {
    PAIRS.map(|[i, j]| v[i] * v[j] * scale)
}

pub fn plus(a: Symmetric, b: Symmetric) -> Symmetric {
    std::array::from_fn(|k| a[k] + b[k])
}

/// Returns M S Mᵀ, where `columns` are those of M.
pub fn mapped(columns: [DVec3; 3], s: &Symmetric) -> Symmetric {
    let entry = |i: usize, j: usize| match PAIRS.iter().position(|p| *p == [i.min(j), i.max(j)]) {
        Some(k) => s[k],
        None => 0.0,
    };
    PAIRS.map(|[row, column]| {
        let mut sum = 0.0;
        for i in 0..3 {
            for j in 0..3 {
                sum += columns[i][row] * entry(i, j) * columns[j][column];
            }
        }
        sum
    })
}

/// Returns the inertia tensor ∫(|p|² δᵢⱼ − pᵢpⱼ) of the second moments ∫pᵢpⱼ.
pub fn inertia(s: &Symmetric) -> [[f64; 3]; 3] {
    let [xx, yy, zz, xy, xz, yz] = *s;
    [
        [yy + zz, -xy, -xz],
        [-xy, xx + zz, -yz],
        [-xz, -yz, xx + yy],
    ]
}

/// Returns the eigenvalues of a symmetric matrix, by Jacobi's rotations (Golub and Van
/// Loan, Matrix Computations, section 8.5).
pub fn eigenvalues(s: &Symmetric) -> [f64; 3] {
    let [xx, yy, zz, xy, xz, yz] = *s;
    let mut a = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
    // Convergence is quadratic: six sweeps leave nothing above rounding.
    for _ in 0..8 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q] == 0.0 {
                continue;
            }
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = 1.0_f64.copysign(theta) / (theta.abs() + (theta * theta + 1.0).sqrt());
            let c = 1.0 / (t * t + 1.0).sqrt();
            let s = t * c;
            for row in &mut a {
                let (x, y) = (row[p], row[q]);
                (row[p], row[q]) = (c * x - s * y, s * x + c * y);
            }
            let (x, y) = (a[p], a[q]);
            for k in 0..3 {
                (a[p][k], a[q][k]) = (c * x[k] - s * y[k], s * x[k] + c * y[k]);
            }
        }
    }
    [a[0][0], a[1][1], a[2][2]]
}
