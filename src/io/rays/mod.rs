//! Reader and writer of ray sets and bare triangle meshes, the input of any tracer.
//!
//! `.msh` is "MSH1", u32 vertices, u32 triangles, f32 positions (x y z each), u32 indices (3
//! each). `.rays` is "RAY1", u32 count, then per ray f32 `ox oy oz tmin dx dy dz tmax`. Both
//! are little-endian without padding or trailing bytes. By convention files are named
//! `NAME.msh` and `NAME.KIND.rays`.
//!
//! The counts in a header must match the size of the file before memory is allocated.
//! Indices and numbers are checked here, once.

use crate::Outputs;
use crate::shared::folder::open_file;
use crate::{LoadError, SaveError};
use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::Path;

/// Rays in columns. A hit counts if `t_min < t < t_max`, where t is in lengths of `dir`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RaySet {
    pub org: [Vec<f32>; 3],
    pub t_min: Vec<f32>,
    /// Directions of any length.
    pub dir: [Vec<f32>; 3],
    /// Upper limits of t, maybe infinite.
    pub t_max: Vec<f32>,
}

/// A triangle mesh without normals, materials or transforms.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleSet {
    pub positions: Vec<[f32; 3]>,
    /// Indices into `positions`.
    pub triangles: Vec<[u32; 3]>,
}

const RAY_BYTES: u64 = 32;
const VERTEX_BYTES: u64 = 12;
const TRIANGLE_BYTES: u64 = 12;

impl RaySet {
    pub fn len(&self) -> usize {
        self.t_max.len()
    }

    pub fn is_empty(&self) -> bool {
        self.t_max.is_empty()
    }

    /// The origin of ray `i`.
    pub fn org(&self, i: usize) -> [f32; 3] {
        [self.org[0][i], self.org[1][i], self.org[2][i]]
    }

    /// The direction of ray `i`.
    pub fn dir(&self, i: usize) -> [f32; 3] {
        [self.dir[0][i], self.dir[1][i], self.dir[2][i]]
    }

    /// Reads a `.rays` file.
    ///
    /// Fails if the file cannot be read or its size does not match its count, and names the
    /// first ray with an origin or direction that is not finite, a NaN, or a negative
    /// `t_min`.
    pub fn load(path: &Path) -> Result<RaySet, LoadError> {
        let mut file = Counted::open(path)?;
        let [count] = file.header(b"RAY1", ".rays")?;
        let body = file.body(u64::from(count) * RAY_BYTES, || format!("{count} rays"))?;
        let mut rays = RaySet::with_capacity(count as usize);
        for (i, row) in body.chunks_exact(RAY_BYTES as usize).enumerate() {
            let f = |k: usize| f32::from_le_bytes(word(row, k));
            let (org, t_min) = ([f(0), f(1), f(2)], f(3));
            let (dir, t_max) = ([f(4), f(5), f(6)], f(7));
            let finite = |v: &[f32; 3]| v.iter().all(|x| x.is_finite());
            if !finite(&org) || !finite(&dir) || t_min.is_nan() || t_max.is_nan() {
                return Err(file.invalid(
                    format!("ray {i}"),
                    "it has a number that is not finite; only tmin and tmax may be infinite",
                ));
            }
            if t_min < 0.0 {
                let remedy = "its tmin is below 0; move its origin there and count from 0";
                return Err(file.invalid(format!("ray {i}"), remedy));
            }
            rays.push(org, t_min, dir, t_max);
        }
        Ok(rays)
    }

    /// An empty set with room for `count` rays.
    pub fn with_capacity(count: usize) -> RaySet {
        let column = || Vec::with_capacity(count);
        RaySet {
            org: [column(), column(), column()],
            t_min: column(),
            dir: [column(), column(), column()],
            t_max: column(),
        }
    }

    /// Adds a ray.
    pub fn push(&mut self, org: [f32; 3], t_min: f32, dir: [f32; 3], t_max: f32) {
        for k in 0..3 {
            self.org[k].push(org[k]);
            self.dir[k].push(dir[k]);
        }
        self.t_min.push(t_min);
        self.t_max.push(t_max);
    }

    /// Copies the rays of these indices, in their order.
    pub fn select(&self, rows: impl Iterator<Item = usize>) -> RaySet {
        let mut some = RaySet::with_capacity(rows.size_hint().0);
        for i in rows {
            some.push(self.org(i), self.t_min[i], self.dir(i), self.t_max[i]);
        }
        some
    }

    /// Adds the `.rays` file to `outputs`, which the caller commits. Fails if columns differ
    /// in length, there are more rays than u32 can count, or writing fails.
    pub fn save_into(&self, path: &Path, outputs: &mut Outputs) -> Result<(), SaveError> {
        let n = self.len();
        let columns = self.org.iter().chain(&self.dir).chain([&self.t_min]);
        if columns.map(Vec::len).any(|len| len != n) {
            return Err(encode_error(
                path,
                "the columns of the rays differ in length",
            ));
        }
        let mut bytes = Vec::with_capacity(8 + n * RAY_BYTES as usize);
        bytes.extend(b"RAY1");
        bytes.extend(count(n, "rays", path)?);
        for i in 0..n {
            let ([ox, oy, oz], [dx, dy, dz]) = (self.org(i), self.dir(i));
            let row = [ox, oy, oz, self.t_min[i], dx, dy, dz, self.t_max[i]];
            bytes.extend(row.iter().flat_map(|x| x.to_le_bytes()));
        }
        outputs.add(path, bytes)
    }

    /// Writes the file; fails as `save_into` does.
    pub fn save(&self, path: &Path) -> Result<(), SaveError> {
        let mut outputs = Outputs::default();
        self.save_into(path, &mut outputs)?;
        outputs.commit()
    }
}

impl TriangleSet {
    /// Reads a `.msh` file.
    ///
    /// Fails if the file cannot be read or its size does not match its counts, and names the
    /// first position that is not finite or triangle with an index out of range.
    pub fn load(path: &Path) -> Result<TriangleSet, LoadError> {
        let mut file = Counted::open(path)?;
        let [vertices, triangles] = file.header(b"MSH1", ".msh")?;
        let vertex_bytes = u64::from(vertices) * VERTEX_BYTES;
        let body = file.body(vertex_bytes + u64::from(triangles) * TRIANGLE_BYTES, || {
            format!("{vertices} vertices and {triangles} triangles")
        })?;
        let (positions, indices) = body.split_at(vertex_bytes as usize);
        let positions: Vec<[f32; 3]> = positions
            .chunks_exact(VERTEX_BYTES as usize)
            .map(|row| [0, 1, 2].map(|k| f32::from_le_bytes(word(row, k))))
            .collect();
        let triangles: Vec<[u32; 3]> = indices
            .chunks_exact(TRIANGLE_BYTES as usize)
            .map(|row| [0, 1, 2].map(|k| u32::from_le_bytes(word(row, k))))
            .collect();
        if let Some(i) = positions
            .iter()
            .position(|p| p.iter().any(|x| !x.is_finite()))
        {
            return Err(file.invalid(format!("vertex {i}"), "its position is not finite"));
        }
        for (i, triangle) in triangles.iter().enumerate() {
            if let Some(vertex) = triangle.iter().find(|v| **v >= vertices) {
                return Err(file.invalid(
                    format!("triangle {i}"),
                    &format!("it uses vertex {vertex}, but there are only {vertices}"),
                ));
            }
        }
        Ok(TriangleSet {
            positions,
            triangles,
        })
    }

    /// Adds the `.msh` file to `outputs`, which the caller commits. Fails if there are more
    /// vertices or triangles than u32 can count, or writing fails.
    pub fn save_into(&self, path: &Path, outputs: &mut Outputs) -> Result<(), SaveError> {
        let (n, m) = (self.positions.len(), self.triangles.len());
        let mut bytes = Vec::with_capacity(12 + 12 * (n + m));
        bytes.extend(b"MSH1");
        bytes.extend(count(n, "vertices", path)?);
        bytes.extend(count(m, "triangles", path)?);
        bytes.extend(
            self.positions
                .iter()
                .flatten()
                .flat_map(|x| x.to_le_bytes()),
        );
        bytes.extend(
            self.triangles
                .iter()
                .flatten()
                .flat_map(|i| i.to_le_bytes()),
        );
        outputs.add(path, bytes)
    }

    /// Writes the file; fails as `save_into` does.
    pub fn save(&self, path: &Path) -> Result<(), SaveError> {
        let mut outputs = Outputs::default();
        self.save_into(path, &mut outputs)?;
        outputs.commit()
    }
}

/// An open file and the number of its bytes that are not read yet.
struct Counted<'a> {
    path: &'a Path,
    file: File,
    left: u64,
}

impl<'a> Counted<'a> {
    /// Opens a regular file.
    fn open(path: &'a Path) -> Result<Counted<'a>, LoadError> {
        let (file, left) = open_file(path)?;
        Ok(Counted { path, file, left })
    }

    /// Reads the magic and the counts that follow it.
    fn header<const N: usize>(
        &mut self,
        magic: &[u8; 4],
        extension: &str,
    ) -> Result<[u32; N], LoadError> {
        let expected = 4 + 4 * N as u64;
        let bytes = if self.left >= expected {
            self.read(expected as usize)?
        } else {
            Vec::new()
        };
        if !bytes.starts_with(magic) {
            return Err(self.invalid(
                "header".into(),
                &format!(
                    "it does not begin like a {extension} file, with '{}' and {N} count{}",
                    String::from_utf8_lossy(magic),
                    if N == 1 { "" } else { "s" }
                ),
            ));
        }
        Ok(std::array::from_fn(|k| {
            u32::from_le_bytes(word(&bytes, k + 1))
        }))
    }

    /// Reads the rest of the file, which must have `expected` bytes; `announced` says what
    /// the header counts, for the message.
    fn body(
        &mut self,
        expected: u64,
        announced: impl FnOnce() -> String,
    ) -> Result<Vec<u8>, LoadError> {
        if self.left != expected {
            return Err(self.invalid(
                "header".into(),
                &format!(
                    "it announces {}, which are {expected} bytes, but {} follow; \
                     the file is damaged or was not written to its end",
                    announced(),
                    self.left
                ),
            ));
        }
        self.read(expected as usize)
    }

    /// Reads so many bytes; fails, without panic, if there is no memory for them.
    fn read(&mut self, bytes: usize) -> Result<Vec<u8>, LoadError> {
        let failed = |source| LoadError::Read {
            path: self.path.into(),
            source,
        };
        let mut buffer = Vec::new();
        buffer
            .try_reserve_exact(bytes)
            .map_err(|_| failed(ErrorKind::OutOfMemory.into()))?;
        buffer.resize(bytes, 0);
        self.file.read_exact(&mut buffer).map_err(failed)?;
        self.left -= bytes as u64;
        Ok(buffer)
    }

    fn invalid(&self, place: String, message: &str) -> LoadError {
        LoadError::Invalid {
            path: self.path.into(),
            place,
            message: message.into(),
        }
    }
}

/// Returns the k-th group of four bytes.
fn word(row: &[u8], k: usize) -> [u8; 4] {
    [row[4 * k], row[4 * k + 1], row[4 * k + 2], row[4 * k + 3]]
}

/// Encodes a count; fails if u32 cannot hold it.
fn count(n: usize, what: &str, path: &Path) -> Result<[u8; 4], SaveError> {
    u32::try_from(n)
        .map(u32::to_le_bytes)
        .map_err(|_| encode_error(path, &format!("the format has no room for {n} {what}")))
}

fn encode_error(path: &Path, message: &str) -> SaveError {
    SaveError::Encode {
        path: path.into(),
        message: message.into(),
    }
}

#[cfg(test)]
mod tests;
