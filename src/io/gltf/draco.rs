//! Meshes compressed by Draco (KHR_draco_mesh_compression), sequential and by edgebreaker.
//!
//! Every stream is decoded when the file is opened, once and in bounded memory. Its indices and
//! attributes become views and accessors of the document, to which the primitives are pointed, so
//! that a mesh is read as any other. Numbers and types of these accessors are the stream's; where
//! those that the file wrote are others, this is counted as repaired.

use super::File;
use super::accessor::view_bytes;
use super::container::DRACO;
use crate::shared::messages::one_line;
use crate::{ImportReport, LoadError};
use draco_core::geometry_indices::PointIndex;
use draco_core::{
    DataType, DecodeLimits, DecoderBuffer, ErrorKind, Mesh, MeshDecoder, PointAttribute,
};
use gltf::json::Index;
use gltf::json::accessor::{Accessor, ComponentType, GenericComponentType, Type};
use gltf::json::buffer::View;
use gltf::json::mesh::{Mode, Semantic};
use gltf::json::validation::Checked;
use serde::Deserialize;
use std::collections::{BTreeMap, HashMap};

/// Bytes that the streams of a file of any size may decode to, and how many more each of its
/// bytes adds. Streams hold 12 bytes of a triangle and half a vertex of some 30 in one to three
/// bytes, and of regular grids in a tenth of one.
const FREE_BYTES: u64 = 1 << 26;
const BYTES_A_BYTE: u64 = 128;

/// What a stream begins with: its magic, and the version that the extension is about.
const MAGIC: &[u8] = b"DRACO\x02\x02";

/// Bytes of the corners of a triangle.
const TRIANGLE: u64 = 12;

/// The extension of a primitive.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Source {
    buffer_view: u32,
    /// The number within the stream of each attribute.
    attributes: BTreeMap<Checked<Semantic>, u32>,
}

/// A primitive that is compressed.
struct Use {
    mesh: usize,
    primitive: usize,
    attributes: BTreeMap<Checked<Semantic>, u32>,
    place: String,
}

/// What the elements of an accessor are.
#[derive(Clone, Copy)]
struct Kind {
    of: Type,
    component: ComponentType,
    normalized: bool,
}

/// Decodes the primitives that are compressed, and points them to what their streams hold. Fails
/// where a stream is malformed, or where all are larger than the file justifies.
pub(super) fn decode(file: &mut File, report: &mut ImportReport) -> Result<(), LoadError> {
    let mut left = FREE_BYTES.saturating_add(BYTES_A_BYTE.saturating_mul(file.buffers.total()));
    for (view, uses) in uses(file)? {
        let Some(first) = uses.first() else {
            continue;
        };
        let bytes = view_bytes(file, Index::new(view), &first.place)?;
        let wrong = |place: &str, why: String| file.invalid(place, &one_line(&why));
        let stream = stream(bytes, &mut left).map_err(|why| wrong(&first.place, why))?;
        let mut added = Added::default();
        let indices = added.indices(file, &stream);
        for own in uses {
            point(
                file,
                (&stream, indices),
                &own,
                (&mut added, &mut left),
                report,
            )
            .map_err(|why| file.invalid(&own.place, &one_line(&why)))?;
        }
    }
    Ok(())
}

/// Lists the primitives that are compressed, by the view of their stream.
fn uses(file: &File) -> Result<BTreeMap<u32, Vec<Use>>, LoadError> {
    let mut uses: BTreeMap<u32, Vec<Use>> = BTreeMap::new();
    for (mesh, source) in file.root.meshes.iter().enumerate() {
        for (primitive, source) in source.primitives.iter().enumerate() {
            let all = source.extensions.as_ref().map(|all| &all.others);
            let Some(own) = all.and_then(|all| all.get(DRACO)) else {
                continue;
            };
            let place = format!("mesh {mesh}, primitive {primitive}, {DRACO}");
            let own = Source::deserialize(own)
                .map_err(|e| file.invalid(&place, &one_line(&e.to_string())))?;
            let mode = source.mode;
            if !matches!(mode, Checked::Valid(Mode::Triangles | Mode::TriangleStrip)) {
                return Err(file.invalid(&place, "the mode of its primitive must be 4 or 5"));
            }
            uses.entry(own.buffer_view).or_default().push(Use {
                mesh,
                primitive,
                attributes: own.attributes,
                place,
            });
        }
    }
    Ok(uses)
}

/// Decodes a stream to at most `left` bytes, of which its triangles are taken.
fn stream(bytes: &[u8], left: &mut u64) -> Result<Mesh, String> {
    // The decoder does not mind versions to come.
    if !bytes.starts_with(MAGIC) {
        return Err("its stream is none of Draco's, of version 2.2".into());
    }
    let limits = DecodeLimits::default()
        .with_max_faces(*left / TRIANGLE)
        .with_max_decoded_bytes(*left);
    let mut buffer = DecoderBuffer::new(bytes).with_limits(limits);
    let mut mesh = Mesh::new();
    MeshDecoder::new()
        .decode(&mut buffer, &mut mesh)
        .map_err(|error| match error.kind() {
            ErrorKind::LimitExceeded => too_large(),
            _ => format!("its stream is malformed: {}", error.message()),
        })?;
    let triangles = TRIANGLE * mesh.num_faces() as u64;
    *left = left.checked_sub(triangles).ok_or_else(too_large)?;
    Ok(mesh)
}

fn too_large() -> String {
    "its stream decodes to more than the size of the file justifies".into()
}

/// The accessors that are made of a stream.
#[derive(Default)]
struct Added {
    /// By number of the attribute, and whether it is normalised.
    columns: HashMap<(u32, bool), Index<Accessor>>,
}

impl Added {
    /// Adds the corners of all triangles.
    fn indices(&mut self, file: &mut File, stream: &Mesh) -> Index<Accessor> {
        let corners = stream.faces().iter().flatten();
        let bytes = corners.flat_map(|point| point.0.to_le_bytes()).collect();
        let kind = Kind {
            of: Type::Scalar,
            component: ComponentType::U32,
            normalized: false,
        };
        add(file, bytes, 3 * stream.num_faces() as u64, kind)
    }

    /// Adds the column of an attribute, unless it is there already.
    fn column(
        &mut self,
        file: &mut File,
        (stream, id, kind): (&Mesh, u32, Kind),
        left: &mut u64,
    ) -> Result<Index<Accessor>, String> {
        if let Some(known) = self.columns.get(&(id, kind.normalized)) {
            return Ok(*known);
        }
        let points = stream.num_points();
        let attribute = stream
            .attribute_by_unique_id(id)
            .ok_or_else(|| absent(id))?;
        let stride = kind.of.multiplicity() * kind.component.size();
        let size = points as u64 * stride as u64;
        *left = left.checked_sub(size).ok_or_else(too_large)?;
        let bytes = rows(attribute, points, stride)
            .ok_or_else(|| format!("attribute {id} of its stream has fewer values than points"))?;
        let made = add(file, bytes, points as u64, kind);
        self.columns.insert((id, kind.normalized), made);
        Ok(made)
    }
}

/// Points a primitive to what its stream holds.
fn point(
    file: &mut File,
    (stream, indices): (&Mesh, Index<Accessor>),
    own: &Use,
    (added, left): (&mut Added, &mut u64),
    report: &mut ImportReport,
) -> Result<(), String> {
    let mut others = 0;
    for (semantic, id) in &own.attributes {
        let primitive = &file.root.meshes[own.mesh].primitives[own.primitive];
        let Some(written) = primitive.attributes.get(semantic) else {
            continue;
        };
        let written = file.root.accessors.get(written.value());
        let before = written.map(|accessor| {
            let component = match accessor.component_type {
                Checked::Valid(GenericComponentType(component)) => Some(component),
                Checked::Invalid => None,
            };
            (
                accessor.type_,
                component,
                accessor.count.0,
                accessor.normalized,
            )
        });
        let attribute = stream
            .attribute_by_unique_id(*id)
            .ok_or_else(|| absent(*id))?;
        let mut kind = kind(attribute, *id)?;
        // Encoders leave it to the accessor to say that integers are normalised.
        if let Some((_, Some(component), _, normalized)) = before
            && component == kind.component
        {
            kind.normalized = normalized;
        }
        let now = (
            Checked::Valid(kind.of),
            Some(kind.component),
            stream.num_points() as u64,
            kind.normalized,
        );
        others += usize::from(before != Some(now));
        let column = added.column(file, (stream, *id, kind), left)?;
        let primitive = &mut file.root.meshes[own.mesh].primitives[own.primitive];
        primitive.attributes.insert(semantic.clone(), column);
    }
    let primitive = &mut file.root.meshes[own.mesh].primitives[own.primitive];
    let written = primitive.indices.replace(indices);
    // A strip has other numbers of corners; its stream holds triangles all the same.
    if primitive.mode == Checked::Valid(Mode::Triangles) {
        let written = written.and_then(|id| file.root.accessors.get(id.value()));
        let now = 3 * stream.num_faces() as u64;
        others += usize::from(written.is_none_or(|accessor| accessor.count.0 != now));
    }
    primitive.mode = Checked::Valid(Mode::Triangles);
    report.repair("accessor that differs from its Draco stream", others);
    Ok(())
}

fn absent(id: u32) -> String {
    format!("its stream has no attribute {id}")
}

/// Says what the values of an attribute are.
fn kind(attribute: &PointAttribute, id: u32) -> Result<Kind, String> {
    let of = match attribute.num_components() {
        1 => Type::Scalar,
        2 => Type::Vec2,
        3 => Type::Vec3,
        4 => Type::Vec4,
        other => {
            return Err(format!(
                "attribute {id} of its stream has {other} components"
            ));
        }
    };
    let component = match attribute.data_type() {
        DataType::Int8 => ComponentType::I8,
        DataType::Uint8 => ComponentType::U8,
        DataType::Int16 => ComponentType::I16,
        DataType::Uint16 => ComponentType::U16,
        DataType::Uint32 => ComponentType::U32,
        DataType::Float32 => ComponentType::F32,
        other => {
            return Err(format!(
                "attribute {id} of its stream has components {other:?}, which glTF lacks"
            ));
        }
    };
    Ok(Kind {
        of,
        component,
        normalized: attribute.normalized(),
    })
}

/// Lists the values of all points; `None` if there are fewer bytes.
fn rows(attribute: &PointAttribute, points: usize, stride: usize) -> Option<Vec<u8>> {
    let data = attribute.buffer().data();
    let mut bytes = Vec::with_capacity(points * stride);
    for point in 0..points {
        let row = attribute.mapped_index(PointIndex(point as u32)).0 as usize;
        let row = data.get(row * stride..)?.get(..stride)?;
        bytes.extend_from_slice(row);
    }
    Some(bytes)
}

/// Adds a column to the document. Its elements may be read once more than the file's size allows.
fn add(file: &mut File, bytes: Vec<u8>, count: u64, kind: Kind) -> Index<Accessor> {
    let view = View {
        // Its bytes are found before those of any buffer.
        buffer: Index::new(0),
        byte_length: bytes.len().into(),
        byte_offset: None,
        byte_stride: None,
        name: None,
        target: None,
        extensions: None,
        extras: None,
    };
    let views = &mut file.root.buffer_views;
    file.decoded.resize(views.len(), None);
    file.decoded.push(Some(bytes));
    views.push(view);
    let accessor = Accessor {
        buffer_view: Some(Index::new((views.len() - 1) as u32)),
        byte_offset: None,
        count: count.into(),
        component_type: Checked::Valid(GenericComponentType(kind.component)),
        extensions: None,
        extras: None,
        type_: Checked::Valid(kind.of),
        min: None,
        max: None,
        name: None,
        normalized: kind.normalized,
        sparse: None,
    };
    let accessors = &mut file.root.accessors;
    accessors.push(accessor);
    file.budget.set(file.budget.get().saturating_add(count));
    Index::new((accessors.len() - 1) as u32)
}
