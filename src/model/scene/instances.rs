//! Instances ([`Instance`]): all paths through the scene's graph that end in a shape.
//!
//! An instance's id is the mixed-radix index of its path in the depth-first order of the
//! file: the number of instances before it (docs/SPEC.md, S12). Hits and pictures carry it
//! as the instance id. Each instance has one `object_from_world`, the product of its edges'
//! inverses from root to leaf in a fixed order without FMA; the object ray is defined as
//! that matrix times the world ray (S5, S6). Only [`Placement::through`] multiplies these
//! matrices.
//!
//! The DAG is not unfolded. Sums of counts beside the edges find an instance in O(depth ·
//! log children). A scene of few instances also lays them out in [`Instances::rows`],
//! which saves hot code the walk.

use super::conditioning::Conditioning;
use super::error::SceneError;
use super::graph_order::children_first;
use super::ids::{MaterialId, NodeId, ShapeId, TransformId};
use super::nodes::Target;
use super::{Edge, Shape, Tables};
use crate::math::Affine;
use glam::DVec3;
use std::borrow::Cow;
use std::ops::Deref;
use std::sync::Arc;

/// The largest number of instances; `u64::MAX` stands for none.
pub const MAX_INSTANCES: u64 = u64::MAX - 1;

/// The largest number of instances that code which visits each of them accepts, at up to
/// 800 bytes each.
pub const MAX_LAID_OUT: u64 = 1 << 21;

/// The largest number of instances that is kept laid out: 13 megabytes, about a third-level
/// cache. Beyond it, a row is as far away as the few edges that produce it.
const FEW: u64 = 1 << 16;

/// The longest path, in edges, that a scene with more instances than can be laid out once
/// may have, because each look-up walks the whole path.
pub const MAX_DEPTH: u64 = 256;

/// The most edges that laying out longer paths may walk.
const MAX_STEPS: u64 = 1 << 27;

/// An instance: one shape at one place in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instance {
    pub shape: ShapeId,
    /// The material of the nearest edge that sets one; it overrides a mesh's own.
    pub material: Option<MaterialId>,
    pub object_from_world: Affine,
    pub world_from_object: Affine,
    /// The row of [`Tables::roots`], the root, that the instance is below.
    pub root: u32,
}

impl Instance {
    /// Says whether object space differs from world space, by a transform or by a mesh's
    /// centre.
    pub fn is_placed(&self, scene: &Tables) -> bool {
        is_placed(scene, self.shape, &self.object_from_world)
    }

    /// Returns the place of the instance.
    pub fn place(&self) -> Placement {
        Placement {
            object_from_world: self.object_from_world,
            world_from_object: self.world_from_object,
            material: self.material,
        }
    }
}

fn is_placed(scene: &Tables, shape: ShapeId, object_from_world: &Affine) -> bool {
    !(is_centered(scene, shape) && object_from_world.is_identity())
}

fn is_centered(scene: &Tables, shape: ShapeId) -> bool {
    match scene.shapes.row(shape) {
        Shape::Mesh(id) => scene.meshes.center[id.index()] == DVec3::ZERO,
        _ => true,
    }
}

/// The instances of a scene, by id. Methods that take a scene need the one that these
/// instances belong to. Clones share the table.
#[derive(Clone, Debug, Default)]
pub struct Instances {
    table: Arc<InstanceTable>,
}

impl Deref for Instances {
    type Target = InstanceTable;

    fn deref(&self) -> &InstanceTable {
        &self.table
    }
}

/// The table that clones of [`Instances`] share.
#[derive(Clone, Debug, Default)]
pub struct InstanceTable {
    /// All instances by id if they are few; empty otherwise.
    pub rows: Vec<Instance>,
    count: u64,
    depth: u64,
    /// Per row of [`Tables::roots`]: the instances of the roots before it.
    before_root: Vec<u64>,
    /// Per row of [`Tables::edges`]: the instances below the edges of its node before it.
    before_edge: Vec<u64>,
    /// Per node: the instances below it.
    of_node: Vec<u64>,
}

impl Instances {
    pub fn of(scene: &Tables) -> Result<Instances, SceneError> {
        let mut below = vec![Size::default(); scene.nodes.len()];
        let mut before_edge = vec![0; scene.edges.len()];
        for node in children_first(scene).unwrap_or_default() {
            let children = &scene.nodes.children[node as usize];
            let rows = children.start as usize..children.end as usize;
            let targets = &scene.edges.target[rows.clone()];
            below[node as usize] = add_up(targets, &below, &mut before_edge[rows]);
        }
        let mut before_root = vec![0; scene.roots.len()];
        let all = add_up(&scene.roots.target, &below, &mut before_root);
        if all.instances > MAX_INSTANCES {
            return Err(SceneError::TooManyInstances {
                count: all.instances,
                limit: MAX_INSTANCES,
            });
        }
        let (deep, few) = (all.depth > MAX_DEPTH, all.instances <= FEW);
        if deep && (all.instances > MAX_LAID_OUT || all.steps > MAX_STEPS) {
            return Err(SceneError::TooDeep {
                depth: all.depth,
                limit: MAX_DEPTH,
            });
        }
        let mut instances = InstanceTable {
            rows: Vec::new(),
            count: all.instances,
            depth: all.depth,
            before_root,
            before_edge,
            of_node: below.iter().map(|size| size.instances).collect(),
        };
        if few || deep {
            let mut rows = Vec::with_capacity(all.instances as usize);
            rows.extend(instances.iter(scene));
            instances.rows = rows;
        }
        let table = Arc::new(instances);
        Ok(Instances { table })
    }
}

impl InstanceTable {
    pub fn count(&self) -> u64 {
        self.count
    }

    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Says whether [`rows`](Self::rows) holds all instances.
    pub fn are_laid_out(&self) -> bool {
        self.rows.len() as u64 == self.count
    }

    /// Returns the number of instances of the roots before this row of
    /// [`Tables::roots`].
    pub fn before_root(&self, row: usize) -> u64 {
        self.before_root[row]
    }

    /// Returns the number of instances below the edges of its node before this row of
    /// [`Tables::edges`].
    pub fn before_edge(&self, row: usize) -> u64 {
        self.before_edge[row]
    }

    /// Returns the number of instances below a node.
    pub fn below(&self, node: NodeId) -> u64 {
        self.of_node[node.index()]
    }

    /// Returns the number of edges of the longest path, the root's included.
    pub fn depth(&self) -> u64 {
        self.depth
    }

    /// Returns the instance of this id.
    ///
    /// # Panics
    ///
    /// If `id` is not below [`count`](Self::count), as indexing does.
    #[inline(always)]
    pub fn get(&self, scene: &Tables, id: u64) -> Instance {
        match self.rows.get(id as usize) {
            Some(row) => *row,
            None => self.look_up(scene, id),
        }
    }

    /// Returns the matrix of the instance of this id, which must be below the count.
    #[inline(always)]
    pub fn object_from_world(&self, scene: &Tables, id: u64) -> Affine {
        match self.rows.get(id as usize) {
            Some(row) => row.object_from_world,
            None => self.look_up(scene, id).object_from_world,
        }
    }

    #[cold]
    #[inline(never)]
    fn look_up(&self, scene: &Tables, id: u64) -> Instance {
        let (mut place, mut root) = (Placement::WORLD, None);
        let shape = self.descend(scene, id, |row, edge| {
            place = place.through(scene, edge);
            root = root.or(Some(row));
        });
        place.of(shape, root.unwrap_or_default())
    }

    /// Calls `step` for every edge of the path with its number among its siblings, and
    /// returns the shape at the end.
    fn descend(&self, scene: &Tables, id: u64, mut step: impl FnMut(u32, Edge)) -> ShapeId {
        assert!(id < self.count, "no instance {id} of {}", self.count);
        let mut rest = id;
        let mut number = choose(&self.before_root, &mut rest);
        let mut edge = scene.roots.row(number);
        loop {
            step(number as u32, edge);
            match edge.target {
                Target::Shape(shape) => return shape,
                Target::Node(node) => {
                    let children = &scene.nodes.children[node.index()];
                    let rows = children.start as usize..children.end as usize;
                    number = choose(&self.before_edge[rows.clone()], &mut rest);
                    edge = scene.edges.row(rows.start + number);
                }
            }
        }
    }

    /// Returns the path of an id below the count: the row of [`Tables::roots`], then
    /// the number of the child at each node on the way.
    pub fn path(&self, scene: &Tables, id: u64) -> Vec<u32> {
        let mut path = Vec::new();
        self.descend(scene, id, |number, _| path.push(number));
        path
    }

    /// Returns the id of a path as [`path`](Self::path) gives it; `None` if it does not
    /// lead to a shape.
    pub fn id(&self, scene: &Tables, path: &[u32]) -> Option<u64> {
        let (root, numbers) = path.split_first()?;
        let mut id = *self.before_root.get(*root as usize)?;
        let mut target = scene.roots.target[*root as usize];
        for number in numbers {
            let Target::Node(node) = target else {
                return None;
            };
            let children = &scene.nodes.children[node.index()];
            if *number >= children.end - children.start {
                return None;
            }
            let row = (children.start + number) as usize;
            id += self.before_edge[row];
            target = scene.edges.target[row];
        }
        matches!(target, Target::Shape(_)).then_some(id)
    }

    /// Iterates over all instances in the order of their ids. Check [`count`](Self::count)
    /// first, or use [`laid_out`](Self::laid_out).
    pub fn iter<'a>(&'a self, scene: &'a Tables) -> Iter<'a> {
        Iter {
            scene,
            of_node: &self.of_node,
            open: Vec::new(),
            next_root: 0,
        }
    }

    /// Returns all instances by id, or an error if they are more than [`MAX_LAID_OUT`].
    pub fn laid_out(&self, scene: &Tables) -> Result<Cow<'_, [Instance]>, SceneError> {
        self.check_enumerable()?;
        if self.rows.is_empty() {
            return Ok(self.iter(scene).collect());
        }
        Ok(Cow::Borrowed(&self.rows))
    }

    /// Returns an error if there are more than [`MAX_LAID_OUT`] instances.
    pub fn check_enumerable(&self) -> Result<(), SceneError> {
        if self.count <= MAX_LAID_OUT {
            return Ok(());
        }
        Err(SceneError::TooManyToLayOut {
            count: self.count,
            limit: MAX_LAID_OUT,
        })
    }

    /// Counts the instances of each shape, by row of [`Tables::shapes`].
    pub fn of_shapes(&self, scene: &Tables) -> Vec<u64> {
        paths_to_shapes(scene, |_| true)
    }

    /// Counts the instances that are [placed](Instance::is_placed), including those whose
    /// transforms happen to undo each other.
    pub fn placed(&self, scene: &Tables) -> u64 {
        let plain = paths_to_shapes(scene, |t| t == TransformId::IDENTITY);
        let shapes = (0..scene.shapes.len()).map(|i| ShapeId(i as u32));
        let unplaced = shapes.zip(plain).filter(|(s, _)| is_centered(scene, *s));
        self.count - unplaced.map(|(_, paths)| paths).sum::<u64>()
    }

    pub fn bytes(&self) -> usize {
        let sums = self.before_root.len() + self.before_edge.len() + self.of_node.len();
        self.rows.len() * size_of::<Instance>() + sums * size_of::<u64>()
    }
}

/// Finds the sibling that `rest` is below, and leaves its number below that sibling in
/// `rest`.
fn choose(before: &[u64], rest: &mut u64) -> usize {
    // Where every sibling is one shape, the number is the row.
    let number = match usize::try_from(*rest) {
        Ok(row) if before.get(row) == Some(rest) && before.get(row + 1) != Some(rest) => row,
        // Siblings without shapes share their sum with the next one; only the last of
        // equals has instances.
        _ => before.partition_point(|sum| sum <= rest) - 1,
    };
    *rest -= before[number];
    number
}

/// The maps and the material at the end of a path.
#[derive(Clone, Copy, Debug)]
pub struct Placement {
    pub object_from_world: Affine,
    pub world_from_object: Affine,
    /// The material of the nearest edge that sets one.
    pub material: Option<MaterialId>,
}

impl Placement {
    /// The place of the path without edges.
    pub const WORLD: Placement = Placement {
        object_from_world: Affine::IDENTITY,
        world_from_object: Affine::IDENTITY,
        material: None,
    };

    /// Returns the place one edge further.
    pub fn through(&self, scene: &Tables, edge: Edge) -> Placement {
        let t = edge.transform.index();
        // The scene's check has refused rows without an inverse.
        let inverse = scene.transforms.inverse[t].unwrap_or(Affine::IDENTITY);
        Placement {
            object_from_world: inverse.then_after(&self.object_from_world),
            world_from_object: self
                .world_from_object
                .then_after(&scene.transforms.local[t]),
            material: edge.material.or(self.material),
        }
    }

    /// Says whether a shape at this place is [placed](Instance::is_placed).
    pub fn is_placed(&self, scene: &Tables, shape: ShapeId) -> bool {
        is_placed(scene, shape, &self.object_from_world)
    }

    /// Returns the conditioning of a shape at this place, seen from the world.
    pub fn conditioning(&self, scene: &Tables, shape: ShapeId) -> Conditioning {
        let own = scene.conditioning_of(shape);
        own.through(&self.object_from_world, &self.world_from_object)
    }

    fn of(&self, shape: ShapeId, root: u32) -> Instance {
        Instance {
            shape,
            material: self.material,
            object_from_world: self.object_from_world,
            world_from_object: self.world_from_object,
            root,
        }
    }
}

/// Iterates as [`Instances::iter`] says, depth first and without recursion, because the
/// graph may be a million nodes deep.
pub struct Iter<'a> {
    scene: &'a Tables,
    of_node: &'a [u64],
    /// Nodes whose children are being visited.
    open: Vec<Frame>,
    next_root: usize,
}

struct Frame {
    /// Rows of the edges still to be visited.
    edges: std::ops::Range<u32>,
    place: Placement,
}

impl Iterator for Iter<'_> {
    type Item = Instance;

    fn next(&mut self) -> Option<Instance> {
        let scene = self.scene;
        loop {
            let (edge, above) = match self.open.last_mut() {
                None if self.next_root == scene.roots.len() => return None,
                None => {
                    self.next_root += 1;
                    (scene.roots.row(self.next_root - 1), Placement::WORLD)
                }
                Some(frame) => match frame.edges.next() {
                    Some(row) => (scene.edges.row(row as usize), frame.place),
                    None => {
                        self.open.pop();
                        continue;
                    }
                },
            };
            match edge.target {
                Target::Shape(shape) => {
                    let place = above.through(scene, edge);
                    return Some(place.of(shape, self.next_root as u32 - 1));
                }
                // A node without shapes may unfold into unboundedly many paths.
                Target::Node(node) if self.of_node[node.index()] == 0 => {}
                Target::Node(node) => self.open.push(Frame {
                    edges: scene.nodes.children[node.index()].clone(),
                    place: above.through(scene, edge),
                }),
            }
        }
    }
}

/// Counts of the graph unfolded below a node, saturating.
#[derive(Clone, Copy, Default)]
struct Size {
    /// The paths that end in a shape.
    instances: u64,
    /// The edges walked to lay these paths out.
    steps: u64,
    /// The edges of the longest path.
    depth: u64,
}

/// Adds up the sizes below a node with these children, and fills the sums before each
/// child.
fn add_up(targets: &[Target], below: &[Size], before: &mut [u64]) -> Size {
    let mut sum = Size::default();
    for (target, before) in targets.iter().zip(before) {
        *before = sum.instances;
        let one = match target {
            Target::Shape(_) => Size {
                instances: 1,
                ..Size::default()
            },
            Target::Node(node) => below[node.index()],
        };
        if one.instances > 0 {
            sum = Size {
                instances: sum.instances.saturating_add(one.instances),
                steps: sum.steps.saturating_add(one.steps).saturating_add(1),
                depth: sum.depth.max(one.depth + 1),
            };
        }
    }
    sum
}

/// Counts the paths to each shape over edges whose transform is `wanted`.
fn paths_to_shapes(scene: &Tables, wanted: impl Fn(TransformId) -> bool) -> Vec<u64> {
    let mut to_node = vec![0_u64; scene.nodes.len()];
    let mut to_shape = vec![0_u64; scene.shapes.len()];
    let mut lead = |edge: Edge, paths: u64, to_node: &mut [u64]| {
        if wanted(edge.transform) {
            let to = match edge.target {
                Target::Shape(shape) => &mut to_shape[shape.index()],
                Target::Node(node) => &mut to_node[node.index()],
            };
            // Only paths to nodes without shapes may outnumber ids.
            *to = to.saturating_add(paths);
        }
    };
    for row in 0..scene.roots.len() {
        lead(scene.roots.row(row), 1, &mut to_node);
    }
    for node in children_first(scene).unwrap_or_default().into_iter().rev() {
        let paths = to_node[node as usize];
        for row in scene.nodes.children[node as usize].clone() {
            lead(scene.edges.row(row as usize), paths, &mut to_node);
        }
    }
    to_shape
}
