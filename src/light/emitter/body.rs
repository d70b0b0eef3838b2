//! Shapes that shine, and their rows in the columns of [`super::Emitters`].

use super::importance::{Bounds, Facing, MOST};
use super::place::Row;
use super::{Kind, sphere};
use glam::DVec3;
use lanecast_model::scene::{Falloff, Light, Rgb};
use std::f64::consts::PI;

/// A shape that shines, in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Body {
    Sphere {
        center: DVec3,
        radius: f64,
    },
    Triangle([DVec3; 3]),
    /// The points corner + a·u + b·v with a and b in [0, 1]; u and v are at right angles.
    Rectangle {
        corner: DVec3,
        u: DVec3,
        v: DVec3,
    },
    /// As [`Light::Point`].
    Point {
        position: DVec3,
        radius: f64,
        falloff: Falloff,
    },
    /// As [`Light::Spot`].
    Spot {
        position: DVec3,
        direction: DVec3,
        inner: f64,
        outer: f64,
        radius: f64,
    },
    /// As [`Light::Rectangle`]: the points of a rectangle; shines along u × v.
    Panel {
        corner: DVec3,
        u: DVec3,
        v: DVec3,
        two_sided: bool,
    },
    /// As [`Light::Disc`]; the normal is unit.
    Disc {
        center: DVec3,
        normal: DVec3,
        radius: f64,
        two_sided: bool,
    },
    /// As [`Light::Directional`], but for the sign: the direction to the light.
    Sun {
        towards: DVec3,
        angle: f64,
    },
}

/// A body and its light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emitter {
    pub body: Body,
    /// The radiance of spheres, triangles, rectangles, panels and discs in W/(sr·m²), the intensity of point
    /// and spot lights in W/sr, the irradiance of suns in W/m².
    pub light: Rgb,
}

impl From<&Light> for Emitter {
    fn from(light: &Light) -> Emitter {
        match *light {
            Light::Point {
                position,
                intensity,
                falloff,
                radius,
            } => Emitter {
                body: Body::Point {
                    position,
                    radius,
                    falloff,
                },
                light: intensity,
            },
            Light::Spot {
                position,
                direction,
                intensity,
                inner,
                outer,
                radius,
            } => Emitter {
                body: Body::Spot {
                    position,
                    direction,
                    inner,
                    outer,
                    radius,
                },
                light: intensity,
            },
            Light::Directional {
                direction,
                irradiance,
                angle,
            } => Emitter {
                body: Body::Sun {
                    towards: -direction,
                    angle,
                },
                light: irradiance,
            },
            Light::Rectangle {
                center,
                edges: [u, v],
                radiance,
                two_sided,
            } => {
                // The scene's check allows a slant of 10⁻⁶.
                let v = v - u * (u.dot(v) / u.length_squared());
                Emitter {
                    body: Body::Panel {
                        corner: center - (u + v) * 0.5,
                        u,
                        v,
                        two_sided,
                    },
                    light: radiance,
                }
            }
            Light::Disc {
                center,
                normal,
                radius,
                radiance,
                two_sided,
            } => Emitter {
                body: Body::Disc {
                    center,
                    normal: (normal / normal.abs().max_element()).normalize_or_zero(),
                    radius,
                    two_sided,
                },
                light: radiance,
            },
        }
    }
}

/// An emitter as columns hold it.
pub struct Prepared {
    pub kind: Kind,
    pub row: Row,
    pub light: Rgb,
    pub bounds: Bounds,
}

/// Returns the lower and upper corner of a body's box.
pub fn sides(body: &Body) -> [DVec3; 2] {
    match *body {
        Body::Triangle([p, q, r]) => [p.min(q).min(r), p.max(q).max(r)],
        Body::Rectangle { corner, u, v } | Body::Panel { corner, u, v, .. } => {
            let corners = [corner, corner + u, corner + v, corner + u + v];
            let low = corners.into_iter().reduce(DVec3::min);
            let high = corners.into_iter().reduce(DVec3::max);
            [low.unwrap_or(corner), high.unwrap_or(corner)]
        }
        Body::Sphere { center, radius }
        | Body::Point {
            position: center,
            radius,
            ..
        }
        | Body::Spot {
            position: center,
            radius,
            ..
        }
        | Body::Disc { center, radius, .. } => [center - radius, center + radius],
        Body::Sun { towards, .. } => [towards, towards],
    }
}

/// The mean of three channels.
fn mean(light: Rgb) -> f64 {
    light.iter().map(|&x| f64::from(x)).sum::<f64>() / 3.0
}

/// Returns how a flat emitter faces that shines along its normal, or on both sides.
fn side(two_sided: bool) -> Facing {
    match two_sided {
        true => Facing::Flat,
        false => Facing::Front,
    }
}

/// Prepares an emitter.
pub fn prepare(emitter: &Emitter) -> Prepared {
    let mut light = emitter.light;
    let (mut row, mut facing, mut axis) = (Row::default(), Facing::All, DVec3::ZERO);
    let (center, radius, area, kind);
    match emitter.body {
        Body::Sphere {
            center: c,
            radius: r,
        } => {
            row.s = r;
            (center, radius, area, kind) = (c, r, PI * r * r, Kind::Sphere);
        }
        Body::Triangle([p, q, r]) => {
            let (u, v) = (q - p, r - p);
            let n = u.cross(v);
            (row.u, row.v, row.n) = (u.to_array(), v.to_array(), n.to_array());
            row.origin = p.to_array();
            (axis, facing) = (n.normalize_or_zero(), Facing::Flat);
            center = (p + q + r) / 3.0;
            radius = [p, q, r]
                .map(|p| p.distance(center))
                .into_iter()
                .fold(0.0, f64::max);
            (area, kind) = (n.length() / 2.0, Kind::Triangle);
        }
        Body::Rectangle { corner, u, v } => {
            let n = u.cross(v).normalize_or_zero();
            (row.s, row.t) = (u.length(), v.length());
            let [ex, ey] = [u, v].map(DVec3::normalize_or_zero);
            (row.u, row.v, row.n) = (ex.to_array(), ey.to_array(), n.to_array());
            row.origin = corner.to_array();
            (axis, facing) = (n, Facing::Flat);
            (center, radius) = (corner + (u + v) / 2.0, (u + v).length() / 2.0);
            (area, kind) = (row.s * row.t, Kind::Rectangle);
        }
        Body::Panel {
            corner,
            u,
            v,
            two_sided,
        } => {
            let like = prepare(&Emitter {
                body: Body::Rectangle { corner, u, v },
                light,
            });
            row = like.row;
            (axis, facing) = (DVec3::from_array(row.n), side(two_sided));
            (center, radius) = (DVec3::from_array(like.bounds.center), like.bounds.radius);
            (area, kind) = (row.s * row.t, Kind::Panel);
        }
        Body::Disc {
            center: c,
            normal,
            radius: r,
            two_sided,
        } => {
            let [u, v] = sphere::tangents::<f32>(normal.into());
            (row.u, row.v) = (DVec3::from(u).to_array(), DVec3::from(v).to_array());
            (row.n, row.s, row.origin) = (normal.to_array(), r, c.to_array());
            (axis, facing) = (normal, side(two_sided));
            (center, radius, area, kind) = (c, r, PI * r * r, Kind::Disc);
        }
        Body::Point {
            position,
            radius: r,
            falloff,
        } => {
            if falloff == Falloff::None {
                facing = Facing::Everywhere;
            }
            row.s = r;
            (center, radius, area) = (position, r, 1.0);
            kind = if r > 0.0 { Kind::Ball } else { Kind::Point };
        }
        Body::Spot {
            position,
            direction,
            inner,
            outer,
            radius: r,
        } => {
            axis = direction.normalize_or_zero();
            // glTF's ramp between the cosines of the cones, at least 10⁻³ wide.
            let (full, none) = (libm::cos(inner), libm::cos(outer));
            let slope = 1.0 / (full - none).max(1e-3);
            row.u = [slope, -none * slope, 0.0];
            facing = Facing::Spot {
                slope: slope as f32,
                start: (-none * slope) as f32,
            };
            (row.n, row.s) = (axis.to_array(), r);
            (center, radius, area) = (position, r, 1.0);
            kind = if r > 0.0 { Kind::Ball } else { Kind::Point };
        }
        Body::Sun { towards, angle } => {
            let n = towards.normalize_or_zero();
            let [u, v] = sphere::tangents::<f32>(n.into());
            let half = libm::sin(angle / 2.0);
            row.s = 2.0 * half * half;
            (row.u, row.v, row.n) = (
                DVec3::from(u).to_array(),
                DVec3::from(v).to_array(),
                n.to_array(),
            );
            axis = n;
            (center, radius, area, kind) = (n, 0.0, 1.0, Kind::Sun);
        }
    }
    // A ball shines so brightly at its surface that the far intensity is right; one too small
    // for that in f32 is a point.
    let mut kind = kind;
    if kind == Kind::Ball && mean(light) / (PI * radius * radius) > f64::from(f32::MAX) {
        kind = Kind::Point;
    }
    let flat = [
        Kind::Triangle,
        Kind::Rectangle,
        Kind::Sphere,
        Kind::Panel,
        Kind::Disc,
    ]
    .contains(&kind);
    if flat || kind == Kind::Ball || kind == Kind::Point {
        if !flat || kind == Kind::Sphere {
            row.origin = center.to_array();
        }
        if !(area > 0.0 && area.is_finite() && radius.is_finite() && center.is_finite()) {
            kind = Kind::Nothing;
        }
    }
    if kind == Kind::Sun && axis == DVec3::ZERO {
        kind = Kind::Nothing;
    }
    let power = (mean(light) * area).clamp(f64::from(1.0 / MOST), f64::from(MOST)) as f32;
    light = light.map(|x| x.max(0.0));
    Prepared {
        kind,
        row,
        light,
        bounds: Bounds {
            center: center.to_array(),
            radius,
            axis: axis.as_vec3().to_array(),
            power,
            facing,
        },
    }
}
