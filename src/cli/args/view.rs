//! Options that choose from where a scene is seen.

use crate::scene::StandardView;
use clap::Args;

#[derive(Args, Clone, Default)]
pub struct ViewArgs {
    /// Name of a camera or of its node, or its number from 0 [default: the first]
    #[arg(long, value_name = "NAME|INDEX")]
    pub camera: Option<String>,
    /// Look from the front, back, left, right, top, bottom or iso at the whole scene, by
    /// parallel rays, whatever cameras it has
    #[arg(long, value_name = "SIDE", conflicts_with = "camera", value_parser = parse_view)]
    pub view: Option<StandardView>,
    /// Move the camera along its direction until it frames the whole scene
    #[arg(long)]
    pub fit: bool,
}

fn parse_view(text: &str) -> Result<StandardView, String> {
    let found = StandardView::ALL.iter().find(|(name, _)| *name == text);
    found
        .map(|(_, view)| *view)
        .ok_or_else(|| "expected front, back, left, right, top, bottom or iso".to_owned())
}
