//! The builder of scenes, which fills the tables row by row.

mod placed_file;

use super::check::check;
use super::*;
use crate::csg::Operator;
use crate::geom::formula::Formula;
use crate::geom::kinds::for_each_kind;
use crate::geom::{self, Clip, HalfSpace, Tape};
use crate::math::Affine;
use crate::roots::Solver;
use glam::DVec3;
use std::collections::HashMap;
use std::sync::Arc;

pub use placed_file::{RowCounts, Surroundings};

/// Builds a [`Scene`]. Functions that add a row return its id; names may be empty. Nothing is
/// checked before [`finish`](SceneBuilder::finish).
///
/// ```
/// use glam::DVec3;
/// use lanecast_model::geom::Sphere;
/// use lanecast_model::scene::*;
///
/// let mut scene = SceneBuilder::default();
/// let brass = scene.material("brass", Material::metallic_roughness([0.85, 0.65, 0.25], 1.0, 0.25));
/// let ball = scene.sphere("ball", Sphere { center: DVec3::ZERO, radius: 1.0 });
///
/// // A node is stored once and may appear many times.
/// let apart = scene.transform(glam::DAffine3::from_translation(DVec3::X * 2.5).into());
/// let pair = scene.node("pair", &[Edge::shape(ball), Edge::shape(ball).transform(apart).material(brass)]);
/// scene.instance("", Edge::node(pair));
///
/// scene.camera("", Camera::perspective(DVec3::new(1.0, 1.0, 8.0), DVec3::X, DVec3::Y, 35.0));
/// scene.light(Light::Directional { direction: DVec3::new(-1.0, -2.0, -1.0), irradiance: [3.0; 3], angle: 0.0 });
/// let scene = scene.finish()?;
///
/// assert_eq!(scene.spheres.len(), 1);
/// assert_eq!(Instances::of(&scene)?.count(), 2);
/// # Ok::<(), SceneError>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct SceneBuilder {
    tables: Tables,
    /// The images that are added, by their address.
    images: HashMap<usize, ImageId>,
}

impl SceneBuilder {
    /// Returns the tables as filled so far.
    pub fn tables(&self) -> &Tables {
        &self.tables
    }

    /// Adds a transform `parent_from_child`.
    pub fn transform(&mut self, local: Affine) -> TransformId {
        self.tables.transforms.push(local)
    }

    /// Adds a transform that is `local` at time 0 and then passes through the keys, in the
    /// order of their times.
    pub fn moving(&mut self, local: Affine, keys: &[Key]) -> TransformId {
        self.moving_by(Interpolation::Linear, local, keys)
    }

    /// Adds a transform as [`moving`](Self::moving) does, with a rule for the times between keys.
    pub fn moving_by(
        &mut self,
        interpolation: Interpolation,
        local: Affine,
        keys: &[Key],
    ) -> TransformId {
        let transforms = &mut self.tables.transforms;
        transforms.push_moving(local, keys, interpolation)
    }

    /// Adds a material.
    pub fn material(&mut self, name: &str, material: Material) -> MaterialId {
        self.tables.materials.push(name, material)
    }

    /// Adds an image of texels ([`Image::new`]).
    pub fn image(
        &mut self,
        texels: Texels,
        channels: u8,
        is_srgb: bool,
        size: [u32; 2],
    ) -> ImageId {
        self.shared_image(Arc::new(Image::new(texels, channels, is_srgb, size)))
    }

    /// Adds an image, or returns its id if it is there.
    pub fn shared_image(&mut self, image: Arc<Image>) -> ImageId {
        // The table keeps the image alive, so no other one has its address.
        let address = Arc::as_ptr(&image).addr();
        let textures = &mut self.tables.textures;
        let known = self.images.entry(address);
        *known.or_insert_with(|| textures.push_image(image))
    }

    /// Adds a pattern, by which [`texture`](SceneBuilder::texture) may vary materials.
    pub fn pattern(&mut self, pattern: Pattern) -> PatternId {
        self.tables.textures.push_pattern(pattern)
    }

    /// Varies a material by images, patterns and the colours of vertices.
    pub fn texture(
        &mut self,
        material: MaterialId,
        texturing: Texturing,
        refs: &[(Slot, TextureRef)],
    ) {
        self.tables.textures.push(material, texturing, refs);
    }

    /// Adds a light.
    pub fn light(&mut self, light: Light) -> LightId {
        self.tables.lights.push(light);
        LightId(self.tables.lights.len() as u32 - 1)
    }

    /// Lets a light move through keys of its kind, of which the first is the light at time 0.
    pub fn move_light(&mut self, light: LightId, keys: &[(f64, Light)]) {
        self.tables.light_motions.push(light, keys);
    }

    /// Sets how many seconds the scene's motion takes.
    pub fn motion_takes(&mut self, seconds: f64) {
        self.tables.seconds = Seconds(seconds);
    }

    /// Puts a light, what shines of a material, or the environment into a group of a name.
    pub fn light_group(&mut self, name: &str, lit: Lit) {
        self.tables.light_groups.put(name, lit);
    }

    /// Adds a camera.
    pub fn camera(&mut self, name: &str, camera: Camera) -> CameraId {
        let cameras = &mut self.tables.cameras;
        cameras.names.set(cameras.rows.len() as u32, name);
        cameras.rows.push(camera);
        CameraId(cameras.rows.len() as u32 - 1)
    }

    /// Lets a camera move through keys, of which the first is its pose at time 0.
    pub fn move_camera(&mut self, camera: CameraId, keys: &[CameraKey]) {
        self.tables.cameras.motions.push(camera.0, keys);
    }

    /// Gives a camera a shutter.
    pub fn shutter(&mut self, camera: CameraId, shutter: Shutter) {
        self.tables.cameras.shutters.push((camera.0, shutter));
    }

    /// Adds a camera that a node of this name places.
    pub fn camera_on(&mut self, name: &str, node: &str, camera: Camera) -> CameraId {
        let id = self.camera(name, camera);
        if node != name {
            self.tables.cameras.node_names.set(id.0, node);
        }
        id
    }

    /// Sets the radiance from all directions.
    pub fn environment(&mut self, map: Environment) {
        self.tables.environment = Some(map);
    }

    /// Sets the radiance where a ray meets nothing.
    pub fn background(&mut self, radiance: Rgb) {
        self.tables.background = radiance;
    }

    /// Adds the solid where a polynomial is at most zero or, if `open`, the surface where it
    /// is zero. A clip cuts off what lies outside it.
    pub fn implicit(&mut self, name: &str, tape: Tape, open: bool, clip: Option<Clip>) -> ShapeId {
        let id = self.tables.implicits.push(tape, open, clip);
        self.tables.shapes.push(name, Shape::Implicit(id))
    }

    /// Sets the solver that finds the roots of a polynomial surface in `fast`; does nothing
    /// for other shapes.
    pub fn set_solver(&mut self, shape: ShapeId, solver: Solver) {
        if let Shape::Implicit(id) = self.tables.shapes.row(shape) {
            self.tables.implicits.solver[id.index()] = solver;
        }
    }

    /// Adds the solid where a formula is at most zero or, if `open`, the surface where it is
    /// zero. The clip cuts off a surface outside it. For a solid it is only the region in
    /// which the surface is searched for, so intersect the solid with the clip.
    pub fn level_set(
        &mut self,
        name: &str,
        formula: Formula,
        open: bool,
        clip: Option<Clip>,
    ) -> ShapeId {
        let id = self.tables.level_sets.push(formula, open, clip);
        self.tables.shapes.push(name, Shape::LevelSet(id))
    }

    /// Adds a convex polyhedron, given by its planes and its corners.
    pub fn polyhedron(&mut self, name: &str, planes: &[HalfSpace], points: &[DVec3]) -> ShapeId {
        let id = self.tables.polyhedra.push(planes, points);
        self.tables.shapes.push(name, Shape::Polyhedron(id))
    }

    /// Adds a planar polygon; `normals` are shading normals at the corners, or empty.
    pub fn polygon(&mut self, name: &str, points: &[DVec3], normals: &[DVec3]) -> ShapeId {
        let id = self.tables.polygons.push(points, normals);
        self.tables.shapes.push(name, Shape::Polygon(id))
    }

    /// Adds a mesh and a shape of it.
    pub fn mesh(&mut self, name: &str, data: &MeshData) -> ShapeId {
        let id = self.tables.meshes.push(data);
        self.tables.shapes.push(name, Shape::Mesh(id))
    }

    /// Adds a mesh that deforms and a shape of it: `data` is the mesh at time 0, and keys are
    /// others of the same triangles, with rising times.
    pub fn deforming_mesh(
        &mut self,
        name: &str,
        data: &MeshData,
        keys: &[(f64, MeshData)],
    ) -> ShapeId {
        let id = self.tables.meshes.push(data);
        let Tables {
            meshes,
            deformations,
            ..
        } = &mut self.tables;
        deformations.push(meshes, id, keys);
        self.tables.shapes.push(name, Shape::Mesh(id))
    }

    /// Adds a shape of a mesh that is already in the tables.
    pub fn mesh_again(&mut self, name: &str, mesh: MeshId) -> ShapeId {
        self.tables.shapes.push(name, Shape::Mesh(mesh))
    }

    /// Adds a CSG solid with its operands.
    pub fn csg(&mut self, name: &str, operator: Operator, operands: &[Operand]) -> ShapeId {
        let (shape, id) = self.declare_csg(name, operator);
        self.set_operands(id, operands);
        shape
    }

    /// Adds a CSG solid whose operands are set later, because files name shapes in any order.
    pub fn declare_csg(&mut self, name: &str, operator: Operator) -> (ShapeId, CsgId) {
        let id = self.tables.csg.push(operator);
        let shape = self.tables.shapes.push(name, Shape::Csg(id));
        (shape, id)
    }

    /// Sets the operands of a CSG solid.
    pub fn set_operands(&mut self, id: CsgId, operands: &[Operand]) {
        self.tables.csg.set_operands(id, operands);
    }

    /// Sets the material of all surfaces of a CSG solid; it overrides those of operands.
    pub fn set_csg_material(&mut self, id: CsgId, material: MaterialId) {
        self.tables.csg.material[id.index()] = Some(material);
    }

    /// Sets how far apart boundaries of different operands may lie and still be one event
    /// (docs/SPEC.md, S49).
    pub fn set_tolerance(&mut self, id: CsgId, tolerance: f64) {
        self.tables.csg.tolerance[id.index()] = tolerance;
    }

    /// Adds a node with its children.
    pub fn node(&mut self, name: &str, children: &[Edge]) -> NodeId {
        let id = self.declare_node(name);
        self.set_children(id, children);
        id
    }

    /// Adds a node whose children are set later, because files name nodes in any order.
    pub fn declare_node(&mut self, name: &str) -> NodeId {
        let nodes = &mut *self.tables.nodes;
        nodes.names.set(nodes.children.len() as u32, name);
        nodes.children.push(0..0);
        NodeId(nodes.children.len() as u32 - 1)
    }

    /// Sets the children of a node.
    pub fn set_children(&mut self, node: NodeId, children: &[Edge]) {
        let first = self.tables.edges.len() as u32;
        for edge in children {
            self.tables.edges.push(*edge);
        }
        self.tables.nodes.children[node.index()] = first..self.tables.edges.len() as u32;
    }

    /// Adds a root of the graph, which places a shape or a node in the world.
    pub fn instance(&mut self, name: &str, edge: Edge) {
        let row = self.tables.roots.len() as u32;
        self.tables.root_names.set(row, name);
        self.tables.roots.push(edge);
    }

    /// Turns or moves all of the scene as one: `by` is applied after the roots' own transforms,
    /// which must be still.
    pub fn place_roots(&mut self, by: &Affine) {
        for row in 0..self.tables.roots.len() {
            let own = self.tables.roots.transform[row];
            let local = self.tables.transforms.local[own.index()];
            self.tables.roots.transform[row] = self.transform(by.then_after(&local));
        }
    }

    /// Leaves out all instances; what they refer to stays.
    pub(super) fn clear_instances(&mut self) {
        self.tables.roots = Default::default();
        self.tables.root_names = Names::default();
    }

    /// Checks every table once, and returns the scene.
    pub fn finish(mut self) -> Result<Scene, SceneError> {
        check(&mut self.tables)?;
        Ok(Scene {
            tables: Arc::new(self.tables),
        })
    }
}

/// Goes on from a scene; its rows keep their ids.
impl From<Scene> for SceneBuilder {
    fn from(scene: Scene) -> SceneBuilder {
        let tables = Arc::unwrap_or_clone(scene.tables);
        let images = tables.textures.images.iter().enumerate();
        SceneBuilder {
            images: images
                .map(|(row, image)| (Arc::as_ptr(image).addr(), ImageId(row as u32)))
                .collect(),
            tables,
        }
    }
}

macro_rules! builder {
    ($([$kind:ident $field:ident $table:ident $id:ident $name:literal $number:literal $($function:ident)?])*) => {
        /// Functions for the kinds whose row is one value.
        impl SceneBuilder {
            $($(
                pub fn $function(&mut self, name: &str, row: geom::$kind) -> ShapeId {
                    let id = self.tables.$field.push(row);
                    self.tables.shapes.push(name, Shape::$kind(id))
                }
            )?)*
        }
    };
}

for_each_kind!(builder);
