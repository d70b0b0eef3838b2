//! What of a scene shines.

use super::{
    CsgId, Edge, Light, MaterialId, Shape, ShapeId, Tables, Target, children_first, operands_first,
};

impl Tables {
    /// Says whether nothing in the scene shines but, perhaps, its background.
    pub fn is_dark(&self) -> bool {
        // What an image makes shine, such as the lamps of a model, lights no scene.
        self.lights.is_empty()
            && self.environment.is_none()
            && !self.shines(|material| !self.textures.has_emission(material))
    }

    /// Says whether the scene's light has an extent, so that only paths find all of it.
    pub fn has_soft_light(&self) -> bool {
        let soft = |light: &Light| match *light {
            Light::Point { radius, .. } | Light::Spot { radius, .. } => radius > 0.0,
            Light::Directional { angle, .. } => angle > 0.0,
            Light::Rectangle { .. } | Light::Disc { .. } => true,
        };
        self.environment.is_some() || self.lights.iter().any(soft) || self.shines(|_| true)
    }

    /// Says whether some material that counts shines on a surface of the scene. Files bring whole
    /// libraries of materials, parts that nothing places, and materials that placements replace.
    fn shines(&self, counts: impl Fn(MaterialId) -> bool) -> bool {
        let rows = (0..).map(MaterialId).zip(&self.materials.rows);
        let mut shining = rows.filter(|(id, row)| row.emission != [0.0; 3] && counts(*id));
        let Some(first) = shining.next() else {
            return false;
        };
        let worn = worn_materials(self);
        std::iter::once(first)
            .chain(shining)
            .any(|(id, _)| worn[id.index()])
    }
}

/// Marks the materials of surfaces that the roots lead to, without those that another replaces: that
/// of the placement nearest to the surface counts, and before what a solid or a mesh has of its own.
///
/// Parts of a mesh count even if no triangle has them, and below an operand of an operand that has a
/// material.
fn worn_materials(scene: &Tables) -> Vec<bool> {
    let mut worn = vec![false; scene.materials.len()];
    let mut wear = |material: MaterialId| worn[material.index()] = true;
    let nodes = children_first(scene).unwrap_or_default();
    let edges = |node: u32| {
        let rows = scene.nodes.children[node as usize].clone();
        rows.map(|row| scene.edges.row(row as usize))
    };
    // Whether something below a node takes a material from above.
    let mut takes = vec![false; scene.nodes.len()];
    for node in &nodes {
        takes[*node as usize] =
            edges(*node).any(|edge| edge.material.is_none() && takes_from_above(&takes, edge));
    }
    // Nodes that roots lead to, and nodes and shapes to which they lead by placements without materials.
    let mut reached = vec![false; scene.nodes.len()];
    let mut plain = vec![false; scene.nodes.len()];
    let mut own = vec![false; scene.shapes.len()];
    let mut follow = |edge: Edge, is_plain: bool, reached: &mut [bool], plain: &mut [bool]| {
        if let Some(material) = edge.material.filter(|_| takes_from_above(&takes, edge)) {
            wear(material);
        }
        let is_plain = is_plain && edge.material.is_none();
        match edge.target {
            Target::Shape(id) => own[id.index()] |= is_plain,
            Target::Node(id) => {
                reached[id.index()] = true;
                plain[id.index()] |= is_plain;
            }
        }
    };
    for row in 0..scene.roots.len() {
        follow(scene.roots.row(row), true, &mut reached, &mut plain);
    }
    for node in nodes.into_iter().rev() {
        if reached[node as usize] {
            let is_plain = plain[node as usize];
            edges(node).for_each(|edge| follow(edge, is_plain, &mut reached, &mut plain));
        }
    }
    wear_own(scene, &mut own, wear);
    worn
}

/// Says whether what a placement shows takes the placement's material.
fn takes_from_above(takes: &[bool], edge: Edge) -> bool {
    match edge.target {
        Target::Shape(_) => true,
        Target::Node(id) => takes[id.index()],
    }
}

/// Calls `wear` with the materials that some shapes have of their own. `own` marks these shapes, and
/// their operands after that.
fn wear_own(scene: &Tables, own: &mut [bool], mut wear: impl FnMut(MaterialId)) {
    let csg = &scene.csg;
    let solids = operands_first(scene).unwrap_or_default();
    let mut takes = vec![false; csg.len()];
    let operand_takes = |takes: &[bool], shape: ShapeId| match scene.shapes.row(shape) {
        Shape::Csg(id) => takes[id.index()],
        _ => true,
    };
    for row in &solids {
        let mut operands = csg.operands(CsgId(*row)).iter();
        takes[*row as usize] = csg.material[*row as usize].is_none()
            && operands.any(|one| one.material.is_none() && operand_takes(&takes, one.shape));
    }
    let mut of_csg = vec![false; csg.len()];
    for (shape, _) in scene.shapes.rows.iter().zip(&*own).filter(|(_, own)| **own) {
        if let Shape::Csg(id) = shape {
            of_csg[id.index()] = true;
        }
    }
    for row in solids.into_iter().rev().map(|row| row as usize) {
        match csg.material[row] {
            _ if !of_csg[row] => {}
            Some(material) => wear(material),
            None => {
                for operand in csg.operands(CsgId(row as u32)) {
                    let given = operand.material;
                    given
                        .filter(|_| operand_takes(&takes, operand.shape))
                        .map(&mut wear);
                    match scene.shapes.row(operand.shape) {
                        Shape::Csg(id) => of_csg[id.index()] = true,
                        _ => own[operand.shape.index()] |= given.is_none(),
                    }
                }
            }
        }
    }
    for (shape, _) in scene.shapes.rows.iter().zip(&*own).filter(|(_, own)| **own) {
        if let Shape::Mesh(id) = shape {
            scene
                .meshes
                .row(*id)
                .parts
                .iter()
                .filter_map(|(_, material)| *material)
                .for_each(&mut wear);
        }
    }
}
