//! `lanecast view`: a page that shows a scene while it is looked at from all sides.
//!
//! The page's state is a list of `render`'s options. The server parses it as the command line is
//! parsed, renders in passes from coarse to fine, and ends in the bytes of the file that this
//! command line writes. Options, scenes and rays go one way and pictures the other, over one
//! WebSocket a page; each page has threads of its own, and all share the scene and its trees.

#[cfg(feature = "view")]
mod serve;

use super::args::PageArgs;
use super::error::CliError;

/// Serves the page until the process is ended.
#[cfg(feature = "view")]
pub fn run(args: &PageArgs) -> Result<(), CliError> {
    serve::run(args)
}

/// Says how to get a program that has it.
#[cfg(not(feature = "view"))]
pub fn run(args: &PageArgs) -> Result<(), CliError> {
    let _ = (args.listen, args.open, &args.render.scene);
    Err(CliError::Usage(
        "this program is built without the viewer; build it with --features view, or use lanecast \
         render"
            .into(),
    ))
}
