//! The objects of a scene: which instances belong together, what they are called, where they are.

use super::note::Seen;
use super::settings::{DatasetSettings, ObjectOf};
use glam::{DMat3, DVec3};
use lanecast_model::scene::{Edge, Instances, Placement, Scene, Target, TransformId, shape_bounds};
use lanecast_numerics::math::{Aabb, Affine};
use std::collections::HashMap;

/// What a data set knows by one number.
#[derive(Clone, Debug)]
pub struct Object {
    pub name: String,
    pub category: u16,
    /// Ids of its instances, rising.
    pub instances: Vec<u64>,
    pub world_from_object: Affine,
    /// The box about it in its own space; none of what is unbounded.
    pub bounds: Option<Aabb>,
}

/// The way to an object: edges from the root on.
struct Way {
    edges: Vec<Edge>,
    root: u32,
}

/// Lists the objects that have a category, in the order of the file.
pub fn objects(scene: &Scene, instances: &Instances, settings: &DatasetSettings) -> Vec<Object> {
    let mut objects: Vec<Option<Object>> = Vec::new();
    let mut known: HashMap<Vec<u32>, usize> = HashMap::new();
    for id in 0..instances.count() {
        let mut path = instances.path(scene, id);
        let mut way = Way::of(scene, &path);
        let is_part = |edge: &Edge| {
            matches!(edge.target, Target::Shape(_)) && edge.transform == TransformId::IDENTITY
        };
        let steps = match settings.object {
            ObjectOf::Root => 1,
            ObjectOf::Node if path.len() > 1 && way.edges.last().is_some_and(is_part) => {
                path.len() - 1
            }
            ObjectOf::Node => path.len(),
        };
        path.truncate(steps);
        let shape = instances.get(scene, id).shape;
        way.edges.truncate(steps);
        let number = *known.entry(path).or_insert_with(|| {
            let names = way.names(scene, scene.shapes.names.get(shape.0));
            let category = settings.category_of(names.iter().map(|name| &name[..]));
            let world = way.edges.iter();
            let world = world.fold(Placement::WORLD, |place, edge| place.through(scene, *edge));
            let mut names = names.into_iter();
            objects.push(category.map(|category| {
                Object {
                    name: names
                        .next()
                        .unwrap_or_else(|| scene.shapes.row(shape).kind_name().into()),
                    category,
                    instances: Vec::new(),
                    world_from_object: world.world_from_object,
                    bounds: Some(Aabb::EMPTY),
                }
            }));
            objects.len() - 1
        });
        if let Some(object) = &mut objects[number] {
            object.instances.push(id);
            let part = bounds_within(scene, instances, id, &object.world_from_object);
            object.bounds = object.bounds.and_then(|all| Some(all.union(&part?)));
        }
    }
    objects.into_iter().flatten().collect()
}

/// Returns the box of an instance in the space of its object.
fn bounds_within(
    scene: &Scene,
    instances: &Instances,
    id: u64,
    world_from_object: &Affine,
) -> Option<Aabb> {
    let instance = instances.get(scene, id);
    let own = shape_bounds(scene, instance.shape)?;
    if instance.world_from_object == *world_from_object {
        return Some(own);
    }
    let object_from_world = world_from_object.inverse()?;
    let within = object_from_world.then_after(&instance.world_from_object);
    let corner = |p: DVec3| DVec3::from_array(within.point(p.to_array()));
    Some(Aabb::of_points(own.corners().map(corner)))
}

impl Way {
    fn of(scene: &Scene, path: &[u32]) -> Way {
        let (root, children) = path.split_first().map_or((0, path), |(r, c)| (*r, c));
        let mut edges = vec![scene.roots.row(root as usize)];
        for child in children {
            let Some(Edge {
                target: Target::Node(node),
                ..
            }) = edges.last()
            else {
                break;
            };
            let first = scene.nodes.children[node.index()].start;
            edges.push(scene.edges.row((first + child) as usize));
        }
        Way { edges, root }
    }

    /// Lists the names of what is placed, from the object up to the root; of what has none at the
    /// object that of its shape.
    fn names(&self, scene: &Scene, shape: Option<&str>) -> Vec<String> {
        let of_target = |target: Target| match target {
            Target::Node(node) => scene.nodes.names.get(node.0),
            Target::Shape(shape) => scene.shapes.names.get(shape.0),
        };
        let steps = self.edges.iter().enumerate().rev();
        let mut names: Vec<String> = Vec::new();
        for (step, edge) in steps {
            let own = (step == 0)
                .then(|| scene.root_names.get(self.root))
                .flatten();
            let name = own.or_else(|| of_target(edge.target));
            let is_object = step + 1 == self.edges.len();
            let name = name.or(shape.filter(|_| is_object));
            names.extend(name.map(String::from));
            // A row's own name stands before that of what it places.
            names.extend(own.and_then(|_| of_target(edge.target)).map(String::from));
        }
        names
    }
}

/// Parts a matrix, given by columns, into the nearest rotation and the lengths of its columns, by Newton's method for
/// the polar decomposition (Higham 1986). Of a matrix that mirrors, the rotation is that of its
/// negative, and the lengths are negative.
fn rotation(linear: &[[f64; 3]; 3]) -> (DMat3, DVec3) {
    /// Convergence is quadratic; matrices whose stretches are within 2^16 need a dozen steps.
    const STEPS: usize = 64;
    let matrix = DMat3::from_cols_array_2d(linear);
    let sign = if matrix.determinant() < 0.0 {
        -1.0
    } else {
        1.0
    };
    let mut turn = matrix * sign;
    for _ in 0..STEPS {
        let next = (turn + turn.inverse().transpose()) * 0.5;
        let moved = (next - turn)
            .to_cols_array()
            .iter()
            .fold(0.0, |m, x| f64::max(m, x.abs()));
        turn = next;
        if moved <= 4.0 * f64::EPSILON {
            break;
        }
    }
    let lengths = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(|axis| axis.length() * sign);
    (turn, DVec3::from_array(lengths))
}

/// Returns an object's rotation, the lengths of its axes, and its origin.
pub fn place(seen: &Seen) -> (DMat3, DVec3, DVec3) {
    let column = |k: usize| seen.world_from_object.map(|row| row[k]);
    let (turn, lengths) = rotation(&[column(0), column(1), column(2)]);
    (turn, lengths, DVec3::from_array(column(3)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rotation_of_a_scaled_turn_is_the_turn() {
        let turn = DMat3::from_euler(glam::EulerRot::XYZ, 0.3, -1.1, 2.0);
        for scale in [1.0, 3.0, 1e-4, -2.0] {
            let scaled = (turn * scale).to_cols_array_2d();
            let (found, lengths) = rotation(&scaled);
            let off = (found - turn).to_cols_array();
            assert!(off.iter().all(|x| x.abs() < 1e-14), "{scale}: {off:?}");
            assert!((lengths - DVec3::splat(scale)).abs().max_element() < 1e-14 * scale.abs());
        }
    }
}
