//! What `plan` tells of light: how it is found, what shines, and what is left out.

use crate::args::needed_integrator;
use crate::looks::{is_medium, layers_of};
use glam::DVec3;
use lanecast_model::scene::{Camera, Environment, Instances, Scene, studio};
use lanecast_picture::render::{Grid, Integrator};
use lanecast_picture::shade::path::{Luminaires, Materials, MediaField};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write;

/// Light of a scene, as pictures find it.
#[derive(Debug, Serialize)]
pub struct Light {
    integrator: &'static str,
    why: &'static str,
    /// Number of emitters that are sampled, by kind.
    emitters: BTreeMap<&'static str, usize>,
    /// How one of them is chosen: `tree`, `list` or `none`.
    chosen_by: &'static str,
    /// Number of instances that shine and are not sampled.
    unsampled: u64,
    environment: String,
    /// Number of materials that bound media, and whether solids are asked where they overlap.
    media: usize,
    asks_solids: bool,
    /// What the scene's materials have beside base colour, metal and roughness.
    layers: Vec<&'static str>,
    left_out: Vec<&'static str>,
    bytes: usize,
}

impl Light {
    /// Looks at a scene that is complete for the integrator that it needs; the camera says where
    /// the studio stands.
    pub fn of(
        scene: &Scene,
        instances: &Instances,
        camera: &Camera,
        (row, grid): (Option<usize>, Grid),
    ) -> Light {
        let (integrator, why) = needed_integrator(scene, row, grid);
        let made = scene.is_dark().then(|| studio(camera));
        let sky = scene.environment.as_ref().or(made.as_ref());
        let luminaires = Luminaires::of((scene, instances), &scene.lights, sky);
        let rows = &scene.materials.rows;
        let materials = Materials::new(rows, &scene.textures);
        let media = rows.iter().filter(|m| is_medium(m)).count();
        let asks_solids = MediaField::of(scene, instances, &materials, DVec3::splat(f64::MAX))
            .solids
            .is_some();
        let layers = layers_of(rows);
        let emitters = &luminaires.emitters;
        let left_out = [
            ("no environment", sky.is_none()),
            ("no emitters", emitters.counts().is_empty()),
            ("no media stack", media == 0),
            (
                "no exact look into solids of media",
                media > 0 && !asks_solids,
            ),
            ("no holes", !rows.iter().any(|m| m.layers.opacity < 1.0)),
            ("no layers", layers.is_empty()),
        ];
        Light {
            integrator: match integrator {
                Integrator::Path => "path",
                _ => "direct",
            },
            why,
            chosen_by: match (emitters.has_tree(), emitters.is_empty()) {
                (true, _) => "tree",
                (_, false) => "list",
                _ => "none",
            },
            emitters: emitters.counts().into_iter().collect(),
            unsampled: luminaires.unsampled,
            environment: environment_of(scene, made.as_ref(), emitters.samples_sky()),
            media,
            asks_solids,
            layers,
            left_out: left_out
                .iter()
                .filter(|(_, is)| *is)
                .map(|(what, _)| *what)
                .collect(),
            bytes: emitters.bytes(),
        }
    }

    /// Appends the lines for people.
    pub fn write(&self, text: &mut String) {
        let mut line = |what: &str, told: &str| {
            let _ = writeln!(text, "  {what:<16} {told}");
        };
        line("integrator", &format!("{}: {}", self.integrator, self.why));
        let emitters: Vec<String> = (self.emitters.iter())
            .map(|(kind, count)| format!("{count} × {kind}"))
            .collect();
        if !emitters.is_empty() {
            let chosen = match self.chosen_by {
                "tree" => "one chosen by a tree",
                _ => "one chosen by the weights of all",
            };
            let bytes = self.bytes;
            line(
                "emitters",
                &format!("{}; {chosen}; {bytes} bytes", emitters.join(", ")),
            );
        }
        if self.unsampled > 0 {
            line(
                "not sampled",
                &format!(
                    "{} × instance that shines: a solid, an implicit surface or the like, which \
                     scattered rays find",
                    self.unsampled
                ),
            );
        }
        line("environment", &self.environment);
        if self.media > 0 {
            let asked = match self.asks_solids {
                true => "solids are asked exactly which are where, for some touch or overlap",
                false => "a list on each path, for none touch",
            };
            line("media", &format!("{} × material; {asked}", self.media));
        }
        if !self.layers.is_empty() {
            line("layers", &self.layers.join(", "));
        }
        if !self.left_out.is_empty() {
            line("left out", &self.left_out.join(", "));
        }
    }
}

fn environment_of(scene: &Scene, made: Option<&Environment>, is_sampled: bool) -> String {
    let sampled = match is_sampled {
        true => "sampled",
        false => "even, and not sampled",
    };
    match (&scene.environment, made) {
        (Some(map), _) => format!("a map of {}x{}, {sampled}", map.width, map.height),
        (None, Some(_)) => "a studio about the camera, sampled".into(),
        (None, None) if scene.background != [0.0; 3] => {
            "the background, which shines evenly and is not sampled".into()
        }
        (None, None) => "none".into(),
    }
}
