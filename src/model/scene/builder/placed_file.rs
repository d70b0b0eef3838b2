//! Files within a scene: an importer adds a file's rows to the tables of another scene, of
//! which the file then becomes a part.
//!
//! What a graph refers to (shapes, nodes, materials, transforms) only grows, so that rows keep
//! their ids. What stands beside the graph ([`Surroundings`]) is taken out before a file is read,
//! and put back after.

use super::SceneBuilder;
use crate::scene::{
    Cameras, Edge, Edges, Environment, Light, LightGroups, LightMotions, MaterialId, Names, NodeId,
    Rgb, Seconds, Shared,
};
use std::collections::HashMap;
use std::mem::swap;

/// The tables of a scene that its graph does not refer to: its roots, and what it is seen by.
#[derive(Clone, Debug, Default)]
pub struct Surroundings {
    pub roots: Shared<Edges>,
    pub root_names: Names,
    pub cameras: Cameras,
    pub lights: Vec<Light>,
    pub light_motions: Shared<LightMotions>,
    /// Also those of materials, whose rows stay in the scene.
    pub light_groups: LightGroups,
    pub background: Rgb,
    pub environment: Option<Environment>,
    pub seconds: Seconds,
}

/// The numbers of rows that tables had before a file was read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RowCounts {
    pub nodes: usize,
    pub edges: usize,
    pub shapes: usize,
    pub meshes: usize,
    pub materials: usize,
    mesh_parts: usize,
    solids: usize,
    operands: usize,
}

impl SceneBuilder {
    /// Exchanges what stands beside the graph.
    pub fn swap_surroundings(&mut self, other: &mut Surroundings) {
        let own = &mut self.tables;
        swap(&mut own.roots, &mut other.roots);
        swap(&mut own.root_names, &mut other.root_names);
        swap(&mut own.cameras, &mut other.cameras);
        swap(&mut own.lights, &mut other.lights);
        swap(&mut own.light_motions, &mut other.light_motions);
        swap(&mut own.light_groups, &mut other.light_groups);
        swap(&mut own.background, &mut other.background);
        swap(&mut own.environment, &mut other.environment);
        swap(&mut own.seconds, &mut other.seconds);
    }

    /// Counts the rows of the tables that files add to.
    pub fn row_counts(&self) -> RowCounts {
        let all = &self.tables;
        RowCounts {
            nodes: all.nodes.len(),
            edges: all.edges.len(),
            shapes: all.shapes.len(),
            meshes: all.meshes.len(),
            materials: all.materials.rows.len(),
            mesh_parts: all.meshes.parts.len(),
            solids: all.csg.len(),
            operands: all.csg.operands.len(),
        }
    }

    /// Adds a node whose children are the roots of a file.
    pub fn node_of_roots(&mut self, name: &str, roots: &Edges) -> NodeId {
        let edges: Vec<Edge> = (0..roots.len()).map(|row| roots.row(row)).collect();
        self.node(name, &edges)
    }

    /// Puts a prefix before the names of nodes, shapes and materials that were added since.
    pub fn prefix_names(&mut self, since: &RowCounts, prefix: &str) {
        let all = &mut self.tables;
        all.nodes.names.prefix(since.nodes as u32, prefix);
        all.shapes.names.prefix(since.shapes as u32, prefix);
        all.materials.names.prefix(since.materials as u32, prefix);
    }

    /// Replaces materials wherever rows that were added since refer to them.
    pub fn replace_materials(&mut self, since: &RowCounts, by: &HashMap<MaterialId, MaterialId>) {
        if by.is_empty() {
            return;
        }
        let replace = |material: &mut Option<MaterialId>| {
            if let Some(other) = material.and_then(|id| by.get(&id)) {
                *material = Some(*other);
            }
        };
        let all = &mut self.tables;
        all.edges.material[since.edges..]
            .iter_mut()
            .for_each(replace);
        all.roots.material.iter_mut().for_each(replace);
        if all.meshes.parts.len() > since.mesh_parts {
            let parts = &mut all.meshes.parts[since.mesh_parts..];
            parts.iter_mut().for_each(|(_, material)| replace(material));
        }
        all.csg.material[since.solids..]
            .iter_mut()
            .for_each(replace);
        let operands = &mut all.csg.operands[since.operands..];
        operands
            .iter_mut()
            .for_each(|operand| replace(&mut operand.material));
    }
}
