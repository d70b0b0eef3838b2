//! Formats a mismatch with all its numbers.

use super::{Mismatch, Said};
use lanecast_engine::trace::Outcome;
use std::fmt;

/// The answer of the mode under test; aimed rays have no normal.
pub(super) struct Traced<'a>(pub &'a Outcome);

impl fmt::Display for Traced<'_> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Outcome::Hit {
            t,
            instance,
            primitive,
            normal,
        } = self.0
        else {
            return write!(f, "{:?}", self.0);
        };
        write!(f, "Hit t {t:?} instance {instance} primitive {primitive}")?;
        if normal.iter().all(|x| !x.is_nan()) {
            write!(f, " normal {normal:?}")?;
        }
        Ok(())
    }
}

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
        writeln!(f, "  traced     {}", Traced(&ray.outcome))?;
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
