//! Accessors: typed columns in the buffers, dense and sparse.
//!
//! Every range is checked in u64 before a byte is read. The length of a column is bounded by
//! its bytes before it is allocated; [`File::spend`] bounds columns without bytes, which are
//! all zeros. Alignment is not required: components are read byte by byte.

use super::File;
use crate::LoadError;
use gltf::json::Index;
use gltf::json::accessor::{Accessor, ComponentType, Type, sparse::Sparse};
use gltf::json::buffer::View;
use gltf::json::validation::Checked;

/// The component types that a column may have.
pub(super) enum Accept {
    /// f32 only.
    Float,
    /// Positions of KHR_mesh_quantization: f32, or 8 and 16 bits with or without sign.
    Position,
    /// Normals of KHR_mesh_quantization, and rotations: f32, or 8 and 16 bits, signed and
    /// normalised.
    Normal,
    /// Numbers of joints: 8 and 16 bits without sign.
    Joint,
    /// Weights, and colours: f32, or 8 and 16 bits without sign and normalised.
    Weight,
    /// Values of animations: f32, or 8 and 16 bits, normalised.
    Animated,
    /// Texture coordinates of KHR_mesh_quantization: f32, or 8 and 16 bits.
    Coordinate,
}

impl Accept {
    fn allows(&self, kind: ComponentType, normalized: bool) -> bool {
        use ComponentType::{F32, I8, I16, U8, U16};
        match self {
            Accept::Float => kind == F32 && !normalized,
            Accept::Position => matches!(kind, F32 | I8 | U8 | I16 | U16),
            Accept::Normal => kind == F32 || matches!(kind, I8 | I16) && normalized,
            Accept::Joint => matches!(kind, U8 | U16) && !normalized,
            Accept::Coordinate => matches!(kind, F32 | I8 | U8 | I16 | U16),
            Accept::Animated => kind == F32 || matches!(kind, I8 | U8 | I16 | U16) && normalized,
            Accept::Weight => kind == F32 || matches!(kind, U8 | U16) && normalized,
        }
    }
}

/// Reads a column of pairs, converted to f64.
pub(super) fn pairs(
    file: &File,
    id: Index<Accessor>,
    accept: &Accept,
    place: &str,
) -> Result<Vec<[f64; 2]>, LoadError> {
    tuples(file, id, (Type::Vec2, "VEC2"), accept, place)
}

/// Reads a column of colours, with alpha 1 where they have none, converted to f64.
pub(super) fn colors(
    file: &File,
    id: Index<Accessor>,
    place: &str,
) -> Result<Vec<[f64; 4]>, LoadError> {
    let (accessor, ..) = header(file, id, place)?;
    if accessor.type_ != Checked::Valid(Type::Vec3) {
        return quadruples(file, id, &Accept::Weight, place);
    }
    let rgb = triples(file, id, &Accept::Weight, place)?;
    Ok(rgb.iter().map(|[r, g, b]| [*r, *g, *b, 1.0]).collect())
}

/// Reads a column of triples, converted to f64.
pub(super) fn triples(
    file: &File,
    id: Index<Accessor>,
    accept: &Accept,
    place: &str,
) -> Result<Vec<[f64; 3]>, LoadError> {
    tuples(file, id, (Type::Vec3, "VEC3"), accept, place)
}

/// Reads a column of quadruples, converted to f64.
pub(super) fn quadruples(
    file: &File,
    id: Index<Accessor>,
    accept: &Accept,
    place: &str,
) -> Result<Vec<[f64; 4]>, LoadError> {
    tuples(file, id, (Type::Vec4, "VEC4"), accept, place)
}

/// Reads a column of matrices, column by column, converted to f64.
pub(super) fn matrices(
    file: &File,
    id: Index<Accessor>,
    place: &str,
) -> Result<Vec<[f64; 16]>, LoadError> {
    tuples(file, id, (Type::Mat4, "MAT4"), &Accept::Float, place)
}

/// Reads a column of `N` components an element.
fn tuples<const N: usize>(
    file: &File,
    id: Index<Accessor>,
    (of, name): (Type, &str),
    accept: &Accept,
    place: &str,
) -> Result<Vec<[f64; N]>, LoadError> {
    let wrong = |message: &str| file.invalid(place, message);
    let (accessor, kind, count) = header(file, id, place)?;
    if accessor.type_ != Checked::Valid(of) {
        return Err(wrong(&format!("its accessor must be of type {name}")));
    }
    let normalized = accessor.normalized;
    if !accept.allows(kind, normalized) {
        return Err(wrong(match accept {
            Accept::Joint => "its component type is not allowed here: it must be 5121 or 5123",
            Accept::Weight => {
                "its component type is not allowed here: it must be 5126 (float), \
                 or 5121 or 5123 normalized"
            }
            _ => {
                "its component type is not allowed here: it must be 5126 (float), \
                 or 8 or 16 bits with KHR_mesh_quantization required"
            }
        }));
    }
    column(file, accessor, count, kind.size() * N, place, |b| {
        let size = kind.size();
        std::array::from_fn(|i| component(kind, normalized, &b[i * size..(i + 1) * size]))
    })
}

/// Reads a column of numbers, converted to f64.
pub(super) fn scalars(
    file: &File,
    id: Index<Accessor>,
    accept: &Accept,
    place: &str,
) -> Result<Vec<f64>, LoadError> {
    let rows = tuples::<1>(file, id, (Type::Scalar, "SCALAR"), accept, place)?;
    Ok(rows.into_iter().map(|[x]| x).collect())
}

/// Reads a column of vertex indices.
pub(super) fn indices(
    file: &File,
    id: Index<Accessor>,
    place: &str,
) -> Result<Vec<u32>, LoadError> {
    let (accessor, kind, count) = header(file, id, place)?;
    if accessor.type_ != Checked::Valid(Type::Scalar) {
        return Err(file.invalid(place, "its accessor must be of type SCALAR"));
    }
    if !is_index(kind) || accessor.normalized {
        return Err(file.invalid(
            place,
            "its component type must be 5121, 5123 or 5125 (unsigned)",
        ));
    }
    let list = column(file, accessor, count, kind.size(), place, |b| {
        unsigned(b) as u32
    })?;
    // The specification reserves the largest value, which restarts a primitive in graphics
    // interfaces.
    let largest = u32::MAX >> (32 - 8 * kind.size());
    match list.iter().position(|v| *v == largest) {
        Some(i) => Err(file.invalid(place, &format!("index {i} is {largest}, which is reserved"))),
        None => Ok(list),
    }
}

/// Whether indices may have this component type.
fn is_index(kind: ComponentType) -> bool {
    use ComponentType::{U8, U16, U32};
    matches!(kind, U8 | U16 | U32)
}

/// Looks up an accessor, its component type and its count. Fails if it does not exist, the
/// type is unknown, or the count is 0.
fn header<'f>(
    file: &'f File,
    id: Index<Accessor>,
    place: &str,
) -> Result<(&'f Accessor, ComponentType, u64), LoadError> {
    let all = &file.root.accessors;
    let Some(accessor) = all.get(id.value()) else {
        let message = format!(
            "refers to accessor {}, but there are {}",
            id.value(),
            all.len()
        );
        return Err(file.invalid(place, &message));
    };
    let Checked::Valid(kind) = accessor.component_type else {
        return Err(file.invalid(place, "its component type is unknown"));
    };
    if accessor.count.0 == 0 {
        return Err(file.invalid(place, "its count must be at least 1"));
    }
    Ok((accessor, kind.0, accessor.count.0))
}

/// Reads the dense values, or zeros if there are none, then replaces the sparse ones. An
/// element has `size` bytes, from which `read` makes a value.
fn column<T: Copy>(
    file: &File,
    accessor: &Accessor,
    count: u64,
    size: usize,
    place: &str,
    read: impl Fn(&[u8]) -> T,
) -> Result<Vec<T>, LoadError> {
    file.spend(count, place)?;
    let offset = accessor.byte_offset.map_or(0, |o| o.0);
    let mut values = match accessor.buffer_view {
        Some(view) => {
            let (bytes, stride) = range(file, view, offset, count, size, place)?;
            let rows = (0..count as usize).map(|i| &bytes[i * stride..i * stride + size]);
            rows.map(&read).collect()
        }
        None => vec![read(&vec![0; size]); count as usize],
    };
    if let Some(sparse) = &accessor.sparse {
        overlay(file, sparse, &mut values, size, place, read)?;
    }
    Ok(values)
}

/// Replaces the values that the sparse part names. Fails if its rows do not strictly
/// increase or are out of range.
fn overlay<T: Copy>(
    file: &File,
    sparse: &Sparse,
    values: &mut [T],
    size: usize,
    place: &str,
    read: impl Fn(&[u8]) -> T,
) -> Result<(), LoadError> {
    let place = &format!("{place}, sparse");
    let count = sparse.count.0;
    if count == 0 || count > values.len() as u64 {
        let message = format!("its count is {count}; it must be 1 to {}", values.len());
        return Err(file.invalid(place, &message));
    }
    let Checked::Valid(kind) = sparse.indices.component_type else {
        return Err(file.invalid(place, "the component type of its indices is unknown"));
    };
    let width = kind.0.size();
    let (rows, row_stride) = range(
        file,
        sparse.indices.buffer_view,
        sparse.indices.byte_offset.0,
        count,
        width,
        place,
    )?;
    let (bytes, stride) = range(
        file,
        sparse.values.buffer_view,
        sparse.values.byte_offset.0,
        count,
        size,
        place,
    )?;
    let mut last = None;
    for i in 0..count as usize {
        let row = unsigned(&rows[i * row_stride..i * row_stride + width]) as usize;
        if last.is_some_and(|last| row <= last) {
            return Err(file.invalid(place, "its indices must strictly increase"));
        }
        last = Some(row);
        let len = values.len();
        let Some(value) = values.get_mut(row) else {
            let message = format!("it replaces element {row}, but there are only {len}");
            return Err(file.invalid(place, &message));
        };
        *value = read(&bytes[i * stride..i * stride + size]);
    }
    Ok(())
}

/// Returns the bytes of `count` elements of `size` bytes from `offset` in a view, and their
/// stride. Fails unless there are `stride · (count - 1) + size` bytes.
fn range<'f>(
    file: &'f File,
    view: Index<View>,
    offset: u64,
    count: u64,
    size: usize,
    place: &str,
) -> Result<(&'f [u8], usize), LoadError> {
    let wrong = |message: String| file.invalid(place, &message);
    let id = view.value();
    let (view, bytes) = bytes_of(file, view, place)?;
    // Some files write 0 for elements without gaps.
    let stride = view.byte_stride.map_or(0, |s| s.0);
    let stride = if stride == 0 { size } else { stride };
    if stride < size {
        return Err(wrong(format!(
            "bufferView {id} has byteStride {stride}, but an element has {size} bytes"
        )));
    }
    let need = (stride as u64)
        .checked_mul(count - 1)
        .and_then(|n| n.checked_add(size as u64))
        .and_then(|n| n.checked_add(offset));
    if need.is_none_or(|need| need > bytes.len() as u64) {
        return Err(wrong(format!(
            "{count} elements from byte {offset} of bufferView {id} do not fit into its {} bytes",
            bytes.len()
        )));
    }
    Ok((&bytes[offset as usize..], stride))
}

/// Returns the bytes of a view. Fails if it does not exist or has no data.
pub(super) fn view_bytes<'f>(
    file: &'f File,
    view: Index<View>,
    place: &str,
) -> Result<&'f [u8], LoadError> {
    bytes_of(file, view, place).map(|(_, bytes)| bytes)
}

/// Looks up a view and its bytes.
fn bytes_of<'f>(
    file: &'f File,
    view: Index<View>,
    place: &str,
) -> Result<(&'f View, &'f [u8]), LoadError> {
    let wrong = |message: String| file.invalid(place, &message);
    let id = view.value();
    let view = file.root.buffer_views.get(id).ok_or_else(|| {
        let all = file.root.buffer_views.len();
        wrong(format!("refers to bufferView {id}, but there are {all}"))
    })?;
    if let Some(Some(decoded)) = file.decoded.get(id) {
        return Ok((view, decoded));
    }
    let buffer = view.buffer.value();
    let bytes = file.buffers.get(buffer).ok_or_else(|| {
        wrong(format!(
            "bufferView {id} refers to buffer {buffer}, which does not exist or has no data"
        ))
    })?;
    let start = view.byte_offset.map_or(0, |o| o.0);
    let end = start.checked_add(view.byte_length.0);
    let Some(end) = end.filter(|end| *end <= bytes.len() as u64) else {
        return Err(wrong(format!(
            "bufferView {id} spans bytes {start} to {start}+{}, but buffer {buffer} has only {}",
            view.byte_length.0,
            bytes.len()
        )));
    };
    Ok((view, &bytes[start as usize..end as usize]))
}

/// Reads a little-endian integer of one, two or four bytes.
fn unsigned(b: &[u8]) -> u64 {
    b.iter().rev().fold(0, |n, b| (n << 8) | u64::from(*b))
}

/// Converts a component by the rule of the specification: a normalised integer c is
/// c / max, and signed ones are not below -1.
fn component(kind: ComponentType, normalized: bool, b: &[u8]) -> f64 {
    let (value, max) = match kind {
        ComponentType::F32 => return f64::from(f32::from_bits(unsigned(b) as u32)),
        ComponentType::I8 => (f64::from(unsigned(b) as u8 as i8), 127.0),
        ComponentType::U8 => (unsigned(b) as f64, 255.0),
        ComponentType::I16 => (f64::from(unsigned(b) as u16 as i16), 32767.0),
        ComponentType::U16 => (unsigned(b) as f64, 65535.0),
        ComponentType::U32 => (unsigned(b) as f64, 4_294_967_295.0),
    };
    if normalized {
        (value / max).max(-1.0)
    } else {
        value
    }
}
