//! The options of `view`.

use super::RenderArgs;
use clap::Args;
use std::net::SocketAddr;

/// Names of the options of [`PageArgs`] that `render` has not, with whether they take a value.
#[cfg(feature = "view")]
pub const OWN_OPTIONS: [(&str, bool); 2] = [("--listen", true), ("--open", false)];

/// Options of `render` that are not for a page, by the names of their fields.
pub const HIDDEN: [&str; 17] = [
    "output",
    "accuracy",
    "samples",
    "cache_file",
    "cache_keep",
    "tile",
    "frames",
    "fps",
    "reuse",
    "denoise",
    "display",
    "aov",
    "cryptomatte_levels",
    "metadata",
    "stats",
    "json",
    "progress",
];

#[derive(Args)]
#[command(
    after_help = "All other options are those of render, which say what the page begins with. The page \
                  names the render command of what it shows, whose picture has the same bytes."
)]
pub struct PageArgs {
    /// Address and port that the page is served at; port 0 is any that is free
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:0")]
    pub listen: SocketAddr,
    /// Open the page in the browser of this machine
    #[arg(long)]
    pub open: bool,
    #[command(flatten)]
    pub render: RenderArgs,
}
