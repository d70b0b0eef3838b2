//! Names of instance ids: which node, shape and material of the file each belongs to.

use lanecast_model::scene::{Instance, Instances, Scene, Target};
use serde::Serialize;

/// The greatest number of instances that are listed.
const LISTED: u64 = 10_000;

/// How ids follow from the file where instances are too many to list.
const RULE: &str = "ids count the instances of shapes in the order of the file, depth first: an id \
                    is the number of instances before it";

/// Every instance id, or the rule that makes ids.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum InstanceNames {
    Listed(Vec<InstanceName>),
    Rule(&'static str),
}

impl Default for InstanceNames {
    fn default() -> InstanceNames {
        InstanceNames::Listed(Vec::new())
    }
}

/// One instance, as the file names it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct InstanceName {
    pub id: u64,
    /// The row of the file's list of instances, and the node's child at each step below it.
    pub path: Vec<u32>,
    /// The nodes on the way; null for those without a name.
    pub nodes: Vec<Option<String>>,
    /// Null if the shape has no name.
    pub shape: Option<String>,
    pub kind: &'static str,
    /// The material that the placements set; null where the shape's own counts.
    pub material: Option<String>,
}

impl InstanceNames {
    /// Names the instances of a scene.
    pub fn of(scene: &Scene, instances: &Instances) -> InstanceNames {
        if instances.count() > LISTED {
            return InstanceNames::Rule(RULE);
        }
        let rows = (0..).zip(instances.iter(scene));
        let name = |(id, row): (u64, Instance)| {
            let path = instances.path(scene, id);
            InstanceName {
                id,
                nodes: nodes(scene, &path),
                path,
                shape: scene.shapes.names.get(row.shape.0).map(Into::into),
                kind: scene.shapes.row(row.shape).kind_name(),
                material: row.material.map(|id| {
                    let names = &scene.materials.names;
                    names
                        .get(id.0)
                        .map_or_else(|| names.label(id.0), Into::into)
                }),
            }
        };
        InstanceNames::Listed(rows.map(name).collect())
    }
}

/// Returns the names of the nodes on a path.
fn nodes(scene: &Scene, path: &[u32]) -> Vec<Option<String>> {
    let mut nodes = Vec::new();
    let Some((root, numbers)) = path.split_first() else {
        return nodes;
    };
    let mut target = scene.roots.target[*root as usize];
    for number in numbers {
        let Target::Node(node) = target else {
            break;
        };
        nodes.push(scene.nodes.names.get(node.0).map(Into::into));
        let first = scene.nodes.children[node.index()].start;
        target = scene.edges.target[(first + number) as usize];
    }
    nodes
}
