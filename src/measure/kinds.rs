//! Kinds of rays and their order: what the sets of `bench` are called.

use super::queries::Ask;

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Through the pixels' centres (or corners).
    Primary,
    /// Through the same pixels, parallel: an orthographic camera that shows as
    /// much at the distance of the scene's middle.
    Ortho,
    /// From the primary hits to one point light, t in (0, 1).
    Shadow,
    /// The same from the light to the hits, t in (0, 1 − 1e-4).
    LightShadow,
    /// From the primary hits, against one direction of light.
    Directional,
    /// From the primary hits to points of a square light in the point light's
    /// place, random for each ray, t in (0, 1).
    AreaShadow,
    /// One mirror reflection per primary hit.
    Mirror,
    /// One bounce per primary hit, cosine-distributed about the normal.
    Diffuse,
    /// The same rays, asked for any hit.
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

    /// On the command line and in file names.
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

    /// Starts from the primary hits.
    pub fn is_secondary(self) -> bool {
        !matches!(self, Kind::Primary | Kind::Ortho)
    }
}

/// In which order the pixels' rays follow each other; later rays keep the order
/// of the hits that they leave from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// Row by row.
    Scanline,
    /// Absolute blocks of 16×16 pixels row by row, Morton order inside: the
    /// renderer's packets.
    #[default]
    Tile,
    /// One Morton curve through the picture.
    Morton,
    /// No two that follow each other are near.
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
