//! Spans of one line, of solids that are prepared for it alone.

use glam::DVec3;
use lanecast::internals::scene::{Instances, Scene, SceneError};
use lanecast::internals::trace::{Solids, Spans, TraceScratch};

pub fn spans(
    scene: &Scene,
    instances: &Instances,
    org: DVec3,
    dir: DVec3,
) -> Result<Spans, SceneError> {
    let solids = Solids::prepare(scene, instances)?;
    Ok(solids.spans(org, dir, &mut TraceScratch::default()))
}
