//! Phong's model as NFF and MTL have it: Lambert, a highlight `specular`·(r·v)ⁿ/π, a perfect
//! mirror and a window.

use super::super::maps::{Frame, cosine_hemisphere};
use super::ggx::fresnel;
use super::{Color, Sample, Value, mean};
use crate::scene::{Material, Model};
use glam::DVec3;
use std::f64::consts::{PI, TAU};

#[derive(Clone, Copy, Debug)]
pub struct Phong {
    diffuse: Color,
    specular: Color,
    exponent: f64,
    mirror: Color,
    transmission: f64,
    thin: bool,
    /// Of the diffuse lobe, the highlight, the mirror and the window.
    chances: [f64; 4],
}

impl Phong {
    pub fn new(material: &Material) -> Phong {
        let color = |c: [f32; 3]| c.map(|x| f64::from(x).max(0.0));
        let (diffuse, specular, exponent, mirror) = match material.model {
            Model::Phong {
                diffuse,
                specular,
                exponent,
                mirror,
            } => (
                color(diffuse),
                color(specular),
                f64::from(exponent).clamp(0.0, 1e8),
                color(mirror),
            ),
            _ => ([0.0; 3], [0.0; 3], 0.0, [0.0; 3]),
        };
        let transmission = f64::from(material.transmission).clamp(0.0, 1.0);
        let weights = [
            mean(diffuse),
            mean(specular) * 2.0 / (exponent + 1.0),
            mean(mirror),
            transmission,
        ];
        let sum: f64 = weights.iter().sum();
        Phong {
            diffuse,
            specular,
            exponent,
            mirror,
            transmission,
            thin: material.layers.thin_walled,
            chances: weights.map(|w| if sum > 0.0 { w / sum } else { 0.0 }),
        }
    }

    pub fn is_black(&self) -> bool {
        self.chances == [0.0; 4]
    }

    pub fn only_delta(&self) -> bool {
        self.diffuse == [0.0; 3] && self.specular == [0.0; 3]
    }

    pub fn transmits(&self) -> bool {
        self.transmission > 0.0
    }

    pub fn eval(&self, out: DVec3, into: DVec3) -> Value {
        if into.z <= 0.0 {
            return Value::default();
        }
        let mirrored = DVec3::new(-out.x, -out.y, out.z);
        let power = match self.chances[1] > 0.0 {
            true => mirrored.dot(into).max(0.0).powf(self.exponent),
            false => 0.0,
        };
        let lobes = |k: usize| self.diffuse[k] * into.z / PI + self.specular[k] * power / PI;
        let highlight = (self.exponent + 1.0) / TAU * power;
        Value {
            value: [0, 1, 2].map(lobes),
            pdf: self.chances[0] * into.z / PI + self.chances[1] * highlight,
        }
    }

    pub fn sample(&self, eta: f64, out: DVec3, u: [f64; 2], lobe: f64) -> Option<Sample> {
        let [diffuse, highlight, mirror, window] = self.chances;
        let mirrored = DVec3::new(-out.x, -out.y, out.z);
        let has_delta = mirror + window > 0.0;
        if lobe < diffuse + highlight || !has_delta {
            let into = match lobe < diffuse || highlight == 0.0 {
                true => cosine_hemisphere(u),
                false => {
                    let z = (1.0 - u[0]).powf(1.0 / (self.exponent + 1.0));
                    let r = (1.0 - z * z).max(0.0).sqrt();
                    let (s, c) = libm::sincos(TAU * u[1]);
                    Frame::about(mirrored).to_world(DVec3::new(r * c, r * s, z))
                }
            };
            let all = self.eval(out, into);
            return (all.pdf > 0.0).then(|| Sample {
                into,
                weight: all.value.map(|x| x / all.pdf),
                pdf: all.pdf,
                delta: false,
            });
        }
        let ratio = if self.thin { 1.0 } else { eta };
        let interface = fresnel(out.z, ratio);
        let through = window > 0.0 && lobe >= diffuse + highlight + mirror;
        let (into, value, pdf) = if through && !interface.total {
            let bent = DVec3::new(-out.x / ratio, -out.y / ratio, -interface.cos);
            let value = [self.transmission / (ratio * ratio); 3];
            (bent, value, window)
        } else if window > 0.0 && interface.total {
            // Under total reflection the mirror also carries what would be transmitted.
            let whole = self.mirror.map(|m| (m + self.transmission).min(1.0));
            (mirrored, whole, mirror + window)
        } else {
            (mirrored, self.mirror, mirror)
        };
        (pdf > 0.0).then(|| Sample {
            into,
            weight: value.map(|x| x / pdf),
            pdf,
            delta: true,
        })
    }
}
