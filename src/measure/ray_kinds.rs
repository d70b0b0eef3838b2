//! Kinds of rays and their orders, as `bench` names its ray sets.

use super::queries::Ask;

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Through the pixels' centres (or corners).
    Primary,
    /// Through the same pixels, parallel: an orthographic camera that covers the same
    /// extent at the distance of the scene's centre.
    Ortho,
    /// From the primary hits to one point light, t in (0, 1).
    Shadow,
    /// The reverse: from the light to the hits, t in (0, 1 − 1e-4).
    LightShadow,
    /// From the primary hits towards one directional light.
    Directional,
    /// From the primary hits to random points of a square light at the point light's
    /// position, t in (0, 1).
    AreaShadow,
    /// One mirror reflection per primary hit.
    Mirror,
    /// One bounce per primary hit, cosine-distributed around the normal.
    Diffuse,
    /// The diffuse rays, traced for any hit.
    DiffuseAny,
}

impl Kind {
    pub const ALL: [Kind; 9] = [
        Kind::Primary,
        Kind::Ortho,
        Kind::Shadow,
        Kind::LightShadow,
        Kind::Directional,
        Kind::AreaShadow,
        Kind::Mirror,
        Kind::Diffuse,
        Kind::DiffuseAny,
    ];

    /// Returns the name on the command line and in file names.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Primary => "primary",
            Kind::Ortho => "ortho",
            Kind::Shadow => "shadow",
            Kind::LightShadow => "lightshadow",
            Kind::Directional => "directional",
            Kind::AreaShadow => "areashadow",
            Kind::Mirror => "mirror",
            Kind::Diffuse => "diffuse",
            Kind::DiffuseAny => "diffuse_any",
        }
    }

    pub fn named(name: &str) -> Option<Kind> {
        Kind::ALL.into_iter().find(|kind| kind.name() == name)
    }

    pub fn ask(self) -> Ask {
        match self {
            Kind::Primary | Kind::Ortho | Kind::Mirror | Kind::Diffuse => Ask::Closest,
            Kind::Shadow
            | Kind::LightShadow
            | Kind::Directional
            | Kind::AreaShadow
            | Kind::DiffuseAny => Ask::Any,
        }
    }

    /// Returns whether the rays start at the primary hits.
    pub fn is_secondary(self) -> bool {
        !matches!(self, Kind::Primary | Kind::Ortho)
    }
}

/// Order of the pixels' rays; secondary rays keep the order of the hits they start
/// from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// Row by row.
    Scanline,
    /// Absolute blocks of 16×16 pixels row by row, in Morton order inside: the
    /// renderer's packets.
    #[default]
    Tile,
    /// One Morton curve through the picture.
    Morton,
    /// Random order: consecutive rays are rarely near each other.
    Random,
}

impl Order {
    pub const ALL: [Order; 4] = [Order::Scanline, Order::Tile, Order::Morton, Order::Random];

    pub fn name(self) -> &'static str {
        match self {
            Order::Scanline => "scanline",
            Order::Tile => "tile",
            Order::Morton => "morton",
            Order::Random => "random",
        }
    }
}
