//! From the typed file to lights, and to how they move.

use super::lower::{Result, exactly_one, not_zero};
use super::schema_light::{self, LightKey};
use super::source_spans::At;
use super::tree::Source;
use crate::scene::{Falloff, Light};
use glam::DVec3;

/// Checks that a light is of exactly one kind, and that one that moves is of a kind that can.
pub(super) fn check_kind(source: &Source, row: &At<schema_light::Light>) -> Result<()> {
    let light = &row.value;
    let given = [
        ("point", light.point.is_some()),
        ("spot", light.spot.is_some()),
        ("directional", light.directional.is_some()),
        ("rectangle", light.rectangle.is_some()),
        ("disc", light.disc.is_some()),
        ("sphere", light.sphere.is_some()),
        ("environment", light.environment.is_some()),
        ("sky", light.sky.is_some()),
    ];
    let kind = exactly_one(source, row.at, "a light", &given)?;
    match &light.motion {
        Some(motion) if matches!(kind, "environment" | "sky") => {
            let message = format!("the {kind} does not move; leave its motion out");
            Err(source.error(motion.at, message))
        }
        _ => Ok(()),
    }
}

/// Returns a light of the file that stands somewhere, as it is at time 0.
pub(super) fn light(source: &Source, row: &At<schema_light::Light>) -> Result<Light> {
    let light = &row.value;
    if let Some(lamp) = &light.point {
        return Ok(Light::Point {
            position: DVec3::from_array(lamp.position),
            intensity: lamp.intensity,
            falloff: match lamp.falloff {
                Some(schema_light::Falloff::InverseSquare) | None => Falloff::InverseSquare,
                Some(schema_light::Falloff::None) => Falloff::None,
            },
            radius: lamp.radius.unwrap_or(0.0),
        });
    }
    if let Some(lamp) = &light.spot {
        return Ok(Light::Spot {
            position: DVec3::from_array(lamp.position),
            direction: not_zero(source, "direction", &lamp.direction)?,
            intensity: lamp.intensity,
            inner: lamp.inner.unwrap_or(0.0).to_radians(),
            outer: lamp.outer.to_radians(),
            radius: lamp.radius.unwrap_or(0.0),
        });
    }
    if let Some(panel) = &light.rectangle {
        return Ok(Light::Rectangle {
            center: DVec3::from_array(panel.center),
            edges: [panel.edge_u, panel.edge_v].map(DVec3::from_array),
            radiance: panel.radiance,
            two_sided: panel.two_sided.unwrap_or(false),
        });
    }
    if let Some(disc) = &light.disc {
        let radius = positive(source, &disc.radius)?;
        return Ok(Light::Disc {
            center: DVec3::from_array(disc.center),
            normal: not_zero(source, "normal", &disc.normal)?,
            radius,
            radiance: disc.radiance,
            two_sided: disc.two_sided.unwrap_or(false),
        });
    }
    if let Some(ball) = &light.sphere {
        let radius = positive(source, &ball.radius)?;
        return Ok(Light::Point {
            position: DVec3::from_array(ball.center),
            intensity: ball.radiance.map(|c| of_disc(c, radius)),
            falloff: Falloff::InverseSquare,
            radius,
        });
    }
    match &light.directional {
        Some(sun) => Ok(Light::Directional {
            direction: not_zero(source, "direction", &sun.direction)?,
            irradiance: sun.irradiance,
            angle: half_angle(sun.angle.unwrap_or(0.0)),
        }),
        None => Err(source.error(row.at, "the light stands nowhere; give it a point")),
    }
}

/// Reads a radius greater than 0.
fn positive(source: &Source, radius: &At<f64>) -> Result<f64> {
    let At { at, value } = *radius;
    if value > 0.0 && value.is_finite() {
        return Ok(value);
    }
    let message = format!("radius = {value}; it must be greater than 0, and finite");
    Err(source.error(at, message))
}

/// Returns the intensity of a ball of a radiance, whose outline is a disc from everywhere.
fn of_disc(radiance: f32, radius: f64) -> f32 {
    (f64::from(radiance) * std::f64::consts::PI * radius * radius) as f32
}

/// Returns the keys of a light, the first as it is at time 0.
pub(super) fn keys(
    source: &Source,
    of: &At<schema_light::Light>,
    (light, motion): (Light, &At<Vec<At<LightKey>>>),
) -> Result<Vec<(f64, Light)>> {
    if motion.value.is_empty() {
        let message = "motion has no keys; give one, such as { at = 1.0, color = [0, 0, 0] }, or \
                       leave it out";
        return Err(source.error(motion.at, message));
    }
    let mut keys = vec![(0.0, light)];
    let mut radiance = of.value.sphere.as_ref().map(|ball| ball.radiance);
    for row in &motion.value {
        let (last, mut light) = keys[keys.len() - 1];
        let time = row.value.at.value;
        if !(time > last && time <= 1.0) {
            let message = format!(
                "at = {time}; it must be above that of the key before, {last}, and at most 1"
            );
            return Err(source.error(row.value.at.at, message));
        }
        change(source, row, &mut light)?;
        if let (
            Some(radiance),
            Light::Point {
                intensity, radius, ..
            },
        ) = (&mut radiance, &mut light)
        {
            *radiance = row.value.color.unwrap_or(*radiance);
            *intensity = radiance.map(|c| of_disc(c, *radius));
        }
        keys.push((time, light));
    }
    Ok(keys)
}

/// Changes a light to what it is at a key.
fn change(source: &Source, row: &At<LightKey>, light: &mut Light) -> Result<()> {
    let key = &row.value;
    let direction = match &key.direction {
        Some(direction) => Some(not_zero(source, "direction", direction)?),
        None => None,
    };
    if let Some(radius) = key.radius.as_ref().filter(|r| !(r.value >= 0.0)) {
        let message = format!("radius = {}; it must be 0 or greater", radius.value);
        return Err(source.error(radius.at, message));
    }
    let position = key.position.map(DVec3::from_array);
    let (place, axis, color, edges, size) = match light {
        Light::Point {
            position,
            intensity,
            radius,
            ..
        } => (Some(position), None, intensity, None, Some(radius)),
        Light::Spot {
            position,
            direction,
            intensity,
            radius,
            ..
        } => (
            Some(position),
            Some(direction),
            intensity,
            None,
            Some(radius),
        ),
        Light::Directional {
            direction,
            irradiance,
            ..
        } => (None, Some(direction), irradiance, None, None),
        Light::Rectangle {
            center,
            edges,
            radiance,
            ..
        } => (Some(center), None, radiance, Some(edges), None),
        Light::Disc {
            center,
            normal,
            radius,
            radiance,
            ..
        } => (Some(center), Some(normal), radiance, None, Some(radius)),
    };
    let wrong = |what| {
        let message = format!("this kind of light has no {what}; leave it out of its keys");
        Err(source.error(row.at, message))
    };
    match (position, place) {
        (Some(to), Some(place)) => *place = to,
        (Some(_), None) => return wrong("position"),
        _ => {}
    }
    match (direction, axis) {
        (Some(to), Some(axis)) => *axis = to,
        (Some(_), None) => return wrong("direction"),
        _ => {}
    }
    match (key.edges, edges) {
        (Some(to), Some(edges)) => *edges = to.map(DVec3::from_array),
        (Some(_), None) => return wrong("edges"),
        _ => {}
    }
    match (&key.radius, size) {
        (Some(to), Some(size)) => *size = to.value,
        (Some(_), None) => return wrong("radius"),
        _ => {}
    }
    if let Some(to) = key.color {
        *color = to;
    }
    Ok(())
}

/// Returns half of an angle in degrees, in radians.
fn half_angle(degrees: f64) -> f64 {
    degrees.to_radians() * 0.5
}
