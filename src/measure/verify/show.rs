//! A mismatch with all its numbers, for people.

use super::{Mismatch, Said};
use std::fmt;

impl fmt::Display for Mismatch {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let (ray, kind) = (&self.ray, self.kind);
        writeln!(
            f,
            "{kind:?}: pixel {} sample {} depth {} {:?}",
            ray.pixel, ray.sample, ray.depth, ray.kind
        )?;
        writeln!(
            f,
            "  ray        org {:?} dir {:?} t_max {:?}",
            ray.org, ray.dir, ray.t_max
        )?;
        writeln!(f, "  fast       {:?}", ray.outcome)?;
        match &self.reference {
            Said::Shadow(own) => write!(
                f,
                "  reference  {}{}",
                if own.blocked { "Blocked" } else { "Clear" },
                if own.grazing {
                    ", the light grazes"
                } else {
                    ""
                }
            ),
            Said::Nearest(None) => write!(f, "  reference  Miss"),
            Said::Nearest(Some(h)) => write!(
                f,
                "  reference  Hit t {:?} instance {} primitive {} normal {:?}",
                h.t, h.instance, h.primitive, h.normal
            ),
        }
    }
}
