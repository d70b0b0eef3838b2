//! Pictures that show what a camera ray meets, or what it costs, in place of light: one ray
//! through the centre of each pixel.

use super::camera::RayGenerator;
use super::config::{Backdrop, Cost, Inspection, RenderConfig};
use super::picture::View;
use super::pixel_order::Spot;
use super::sampler::{mix, unit};
use crate::accel::Counter;
use crate::plan::Kernels;
use crate::scene::{Rgb, framed_bounds};
use crate::shade::{InteractionPart, Surface, barycentrics};
use crate::trace::{
    Depths, HitId, HitIds, Hits, Rays, TURNED, TraceScratch, Vectors, closest_counted,
};
use glam::DVec3;

/// What was read at a pixel, by column of [`columns`]; NaN where there is nothing to read.
pub type Reading = [f64; 3];

/// The reading of a pixel whose ray meets nothing.
pub const NOTHING: Reading = [f64::NAN; 3];

/// Costs of exact decisions in primitive tests: each takes some microseconds.
const ESCALATION: f64 = 16.0;

/// The cost that is shown in the hottest colour, and all above it.
const HOTTEST: f64 = 1024.0;

/// Inspects the pixels of a tile.
pub struct Inspector<'a> {
    pub view: &'a View<'a>,
    pub config: &'a RenderConfig,
    pub what: Inspection,
    pub generator: &'a RayGenerator,
    pub corner: (u32, u32),
    /// Depths that are shown white and darkest.
    pub depths: [f64; 2],
}

/// The lightness of the farthest depth, lighter than what a ray through nothing shows.
const FARTHEST: f64 = 0.04;

/// Returns the least and the greatest depth that the scene's box has before the camera; 0 and infinity
/// of a scene without bounds.
pub fn depths_of(view: &View, generator: &RayGenerator) -> [f64; 2] {
    let world = view.world;
    let Some(bounds) = framed_bounds(&world.scene, &world.instances) else {
        return [0.0, f64::INFINITY];
    };
    let corner = |i: usize| {
        let [low, high] = [bounds.min.to_array(), bounds.max.to_array()];
        let side = |k: usize| if i >> k & 1 == 0 { low[k] } else { high[k] };
        generator
            .depth(DVec3::new(side(0), side(1), side(2)))
            .max(0.0)
    };
    let all = (0..8).map(corner);
    all.fold([f64::INFINITY, 0.0], |[near, far], depth| {
        [near.min(depth), far.max(depth)]
    })
}

/// Returns the lightness of a depth: 1 at the near end and [`FARTHEST`] at the far one.
fn lightness(depth: f64, [near, far]: [f64; 2]) -> f64 {
    let part = match far {
        f64::INFINITY => depth / (1.0 + depth),
        _ if far > near => (depth - near) / (far - near),
        _ => 0.0,
    };
    FARTHEST + (1.0 - FARTHEST) * (1.0 - part.clamp(0.0, 1.0))
}

impl Inspector<'_> {
    /// Returns what a pixel shows whose ray meets nothing.
    pub fn nothing(&self) -> Rgb {
        match self.config.backdrop {
            Backdrop::Color(color) => color,
            Backdrop::Auto | Backdrop::Transparent => [0.0; 3],
        }
    }

    /// Returns the colour and the reading of what a pixel's ray meets first. `albedo` tells the colour of
    /// its material.
    pub fn of_hit(
        &self,
        at: (u32, u32),
        (surface, id): (&Surface, HitId),
        albedo: impl Fn() -> Rgb,
    ) -> (Rgb, Reading) {
        match self.what {
            Inspection::Normals => {
                let n = surface.ns.to_array();
                (n.map(|x| (0.5 + 0.5 * x) as f32), n)
            }
            Inspection::Uv => {
                let (org, dir) = self.generator.ray(at.0, at.1, [0.5; 2]);
                let [u, v] = coordinates(self.view, (org, dir), surface, id);
                // Images repeat.
                let [red, green] = [u, v].map(|x| {
                    let within = (0.0..=1.0).contains(&x);
                    if within { x } else { x - x.floor() }
                });
                ([red as f32, green as f32, 0.0], [u, v, f64::NAN])
            }
            Inspection::Ids => {
                let primitive = id.primitive & !TURNED;
                let reading = [id.instance as f64, f64::from(primitive), f64::NAN];
                (id_color(id.instance, primitive), reading)
            }
            Inspection::Depth => {
                let depth = self.generator.depth(surface.point);
                let light = lightness(depth, self.depths) as f32;
                ([light; 3], [depth, f64::NAN, f64::NAN])
            }
            Inspection::Albedo => (albedo(), albedo().map(f64::from)),
            Inspection::Heat(_) | Inspection::Edges => (self.nothing(), NOTHING),
        }
    }

    /// Traces the pixels' rays one by one, and shows what each has cost.
    pub fn costs(
        &self,
        cost: Cost,
        order: &[Spot],
        trace: &mut TraceScratch,
        mut put: impl FnMut(u32, Rgb, Reading),
    ) {
        let kernels = &Kernels {
            lanes: 1,
            ..self.view.kernels
        };
        for spot in order {
            let at = (self.corner.0 + spot.x, self.corner.1 + spot.y);
            let (org, dir) = self.generator.ray(at.0, at.1, [0.5; 2]);
            if dir.is_nan() {
                put(spot.row, self.nothing(), NOTHING);
                continue;
            }
            let (counter, decided) = (Counter::default(), trace.decided);
            count_ray(self.view, kernels, (org, dir), &counter, trace);
            let counts = counter.counts();
            let reading = [counts.nodes, counts.tests, trace.decided - decided].map(|n| n as f64);
            put(spot.row, heat_color(cost_of(cost, reading)), reading);
        }
    }
}

/// Returns the barycentric coordinates of a hit on a mesh, and the texture coordinates of one on
/// any other shape.
pub fn coordinates(
    view: &View,
    (org, dir): (DVec3, DVec3),
    surface: &Surface,
    id: HitId,
) -> [f64; 2] {
    barycentrics(view.world, org, dir, id).unwrap_or_else(|| {
        let part = InteractionPart::of(view.world, view.kernels.precision, id);
        part.place(surface.point, surface.ng, id.primitive).weights
    })
}

/// Traces one ray, and counts.
fn count_ray(
    view: &View,
    kernels: &Kernels,
    (org, dir): (DVec3, DVec3),
    counter: &Counter,
    trace: &mut TraceScratch,
) {
    let [org, dir] = [org, dir].map(|v| v.to_array().map(|x| [x]));
    let rays = Rays {
        org: Vectors::Double([&org[0], &org[1], &org[2]]),
        dir: Vectors::Double([&dir[0], &dir[1], &dir[2]]),
        t_min: &[0.0],
        t_max: &[f32::INFINITY],
    };
    let (mut t, mut ids) = ([0.0], HitIds::none(1));
    let hits = &mut Hits {
        t: Depths::Double(&mut t),
        id: ids.columns(),
    };
    closest_counted(view.world, kernels, &rays, hits, counter, trace);
}

/// Returns the cost that a reading stands for.
pub fn cost_of(cost: Cost, [nodes, tests, escalations]: Reading) -> f64 {
    match cost {
        Cost::All => nodes + tests + ESCALATION * escalations,
        Cost::Nodes => nodes,
        Cost::Tests => tests,
        Cost::Escalations => escalations,
    }
}

/// Returns a colour of an instance, a little lighter or darker by the primitive.
fn id_color(instance: u64, primitive: u32) -> Rgb {
    let hashed = mix(instance);
    let channels = [hashed, mix(hashed), mix(mix(hashed))];
    let light = 0.55 + 0.45 * unit(mix(u64::from(primitive) ^ 0x1d5));
    channels.map(|bits| ((0.04 + 0.96 * unit(bits) * unit(bits)) * light) as f32)
}

/// The colours of costs from 1 on, at equal steps of the cost's logarithm: those of a body that
/// is heated, so that the lightness tells the cost by itself.
const HEAT: [[f64; 3]; 6] = [
    [0.0, 0.0, 0.04],
    [0.05, 0.02, 0.35],
    [0.45, 0.02, 0.3],
    [0.9, 0.12, 0.03],
    [1.0, 0.6, 0.02],
    [1.0, 1.0, 0.8],
];

fn heat_color(cost: f64) -> Rgb {
    if cost < 1.0 {
        return [0.0; 3];
    }
    let steps = (HEAT.len() - 1) as f64;
    let at = (libm::log2(cost) / libm::log2(HOTTEST)).min(1.0) * steps;
    let below = (at as usize).min(HEAT.len() - 2);
    let part = at - below as f64;
    std::array::from_fn(|k| (HEAT[below][k] + (HEAT[below + 1][k] - HEAT[below][k]) * part) as f32)
}

/// Returns the names of an inspection's columns of readings.
fn columns(what: Inspection) -> &'static [&'static str] {
    match what {
        Inspection::Normals => &["x", "y", "z"],
        Inspection::Uv => &["u", "v"],
        Inspection::Ids => &["instance", "primitive"],
        Inspection::Depth => &["depth"],
        Inspection::Albedo => &["r", "g", "b"],
        Inspection::Edges => &["ink"],
        Inspection::Heat(_) => &["nodes", "tests", "escalations"],
    }
}

/// Says in one line what the colours mean, with the least, the median and the greatest reading
/// of each column.
pub fn legend(what: Inspection, readings: &[Reading]) -> String {
    let meaning = match what {
        Inspection::Normals => "normals: n as 0.5 + 0.5 n".into(),
        Inspection::Uv => {
            "uv: u in red and v in green, of triangles barycentric, of others texture coordinates"
                .into()
        }
        Inspection::Ids => "ids: a hue for each instance, a lightness for each primitive".into(),
        Inspection::Depth => {
            "depth: along the view axis, from white where the scene's box begins to dark where it ends"
                .into()
        }
        Inspection::Albedo => "albedo: colours of materials, without light".into(),
        Inspection::Edges => {
            "edges: lines where things end or turn, from samples 4 times as fine as pixels".into()
        }
        Inspection::Heat(cost) => {
            let what = match cost {
                Cost::All => format!("nodes + tests + {ESCALATION} escalations"),
                Cost::Nodes => "nodes".into(),
                Cost::Tests => "tests".into(),
                Cost::Escalations => "escalations".into(),
            };
            format!(
                "heat: {what} of the camera ray, from black at 1 to white at {HOTTEST}, by the logarithm"
            )
        }
    };
    let mut rows: Vec<(&str, Vec<f64>)> = Vec::new();
    for (k, name) in columns(what).iter().enumerate() {
        rows.push((name, readings.iter().map(|reading| reading[k]).collect()));
    }
    if let Inspection::Heat(Cost::All) = what {
        let costs = readings.iter().map(|r| cost_of(Cost::All, *r)).collect();
        rows.push(("all", costs));
    }
    let mut text = format!("{meaning}; min, median, max:");
    let mut known = 0;
    for (number, (name, mut values)) in rows.into_iter().enumerate() {
        values.retain(|value| !value.is_nan());
        values.sort_by(f64::total_cmp);
        known = known.max(values.len());
        let comma = if number > 0 { "," } else { "" };
        match values[..] {
            [] => text += &format!("{comma} {name} none"),
            _ => {
                let [least, median, most] = [0, values.len() / 2, values.len() - 1]
                    .map(|i| format!("{}", (values[i] * 1000.0).round() / 1000.0 + 0.0));
                text += &format!("{comma} {name} {least} {median} {most}");
            }
        }
    }
    text + &format!("; {known} of {} pixels", readings.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn costs_get_lighter_with_their_logarithm() {
        assert_eq!(heat_color(0.0), [0.0; 3]);
        assert_eq!(heat_color(HOTTEST), HEAT[5].map(|x| x as f32));
        assert_eq!(heat_color(f64::INFINITY), heat_color(HOTTEST));
        let light = |cost| {
            let [r, g, b] = heat_color(cost);
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        for power in 0..10 {
            let cost = f64::from(1 << power);
            assert!(light(cost) < light(2.0 * cost), "{cost}");
        }
    }

    #[test]
    fn a_legend_has_least_median_and_most() {
        let readings = [[3.0, 1.0, 0.0], [1.0, 5.0, 1.0], [2.0, 2.0, 0.0]];
        let all = legend(Inspection::Heat(Cost::All), &readings);
        assert!(
            all.contains("nodes 1 2 3, tests 1 2 5, escalations 0 0 1, all 4 4 22"),
            "{all}"
        );
        assert!(all.ends_with("3 of 3 pixels"), "{all}");
        let nothing = legend(Inspection::Normals, &[NOTHING, [0.0, -0.5, 1.0]]);
        assert!(nothing.contains("y -0.5 -0.5 -0.5"), "{nothing}");
        assert!(nothing.ends_with("1 of 2 pixels"), "{nothing}");
        assert!(legend(Inspection::Uv, &[]).contains("u none, v none"));
    }

    #[test]
    fn depths_get_darker_and_stay_lighter_than_nothing() {
        let at = |depth| lightness(depth, [2.0, 6.0]);
        assert_eq!([1.0, 2.0, 6.0, 9.0].map(at), [1.0, 1.0, FARTHEST, FARTHEST]);
        assert!(at(3.0) > at(4.0) && at(4.0) > at(5.0));
        let endless = |depth| lightness(depth, [0.0, f64::INFINITY]);
        assert_eq!(endless(0.0), 1.0);
        assert!(endless(1e9) < endless(1.0) && endless(1e300) >= FARTHEST);
        assert_eq!(lightness(3.0, [3.0, 3.0]), 1.0);
    }

    #[test]
    fn ids_have_colours_of_their_own() {
        let mut met = std::collections::BTreeSet::new();
        for instance in 0..40 {
            for primitive in 0..20 {
                let color = id_color(instance, primitive);
                assert!(color.iter().all(|c| (0.0..=1.0).contains(c)));
                assert!(met.insert(color.map(f32::to_bits)));
            }
        }
    }
}
