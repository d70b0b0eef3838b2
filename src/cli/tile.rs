//! `lanecast render --tile`: renders a rectangle of a picture with the bits of the whole, and joins
//! such tiles again.

use super::args::Told;
use super::args::{RenderArgs, TileChoice};
use super::error::CliError;
use super::interrupt;
use super::metadata;
use lanecast_io::{Development, LoadError, Outputs, Picture, PictureTile, SaveError, TileHeader};
use lanecast_picture::render::{Backdrop, Progress, RenderConfig, Window};
use std::path::Path;

/// Refuses what a tile cannot have, before any work.
pub fn check(args: &RenderArgs, output: &Path) -> Result<(), CliError> {
    let is_file = is_tile(output);
    let refused = |message: String| Err(CliError::Usage(message));
    match (args.outputs.tile, is_file) {
        (None, false) => return Ok(()),
        (None, true) => {
            return refused(format!(
                "{}: a .tile is a part of a picture; ask for one with --tile, or name a .png or .exr",
                output.display()
            ));
        }
        (Some(_), false) => {
            return refused(format!(
                "{}: --tile writes a part of a picture; name a .tile file, and join all with \
                 lanecast merge",
                output.display()
            ));
        }
        (Some(_), true) => {}
    }
    if let Backdrop::Color(_) = args.background {
        return refused(
            "--tile keeps linear light, which no colour can be laid under; leave out --background, or \
             ask for --background transparent"
                .into(),
        );
    }
    if args.outputs.metadata == Told::All {
        return refused(
            "--metadata all tells times, which the tiles of a picture have each of its own; ask for \
             --metadata fixed"
                .into(),
        );
    }
    Ok(())
}

/// Says whether a file is named as a tile.
pub fn is_tile(path: &Path) -> bool {
    path.extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("tile"))
}

/// Returns what is told of a picture of which a tile is rendered: nothing that differs between them.
pub fn told(told: Told, config: &RenderConfig) -> Told {
    match told {
        Told::Auto if config.window.is_some() && config.aovs.any_of_layers() => Told::Fixed,
        told => told,
    }
}

/// Gives the configuration of a picture, whose size is known, the tile that is asked for.
pub fn windowed(
    choice: Option<TileChoice>,
    config: RenderConfig,
) -> Result<RenderConfig, CliError> {
    let Some(choice) = choice else {
        return Ok(config);
    };
    let size = (config.width, config.height);
    let grid = (choice.grid.columns, choice.grid.rows);
    let Some(window) = Window::of_grid(size, grid, choice.number) else {
        let most = Window::most(size.0, size.1);
        return Err(CliError::Usage(format!(
            "tiles are of blocks of {step}x{step} pixels, and a picture of {}x{} has {} columns and \
             {} rows of these; ask for at most {}x{} tiles",
            size.0,
            size.1,
            most.0,
            most.1,
            most.0,
            most.1,
            step = Window::STEP
        )));
    };
    Ok(RenderConfig {
        window: Some(window),
        ..config
    })
}

/// Does as [`windowed`] does before the scene is known, if its cameras have no say in the size.
pub fn foreseen(args: &RenderArgs, config: RenderConfig) -> Result<RenderConfig, CliError> {
    let choice = args.outputs.tile.filter(|_| args.common.size.is_some());
    windowed(choice, config)
}

/// Adds the picture's files to `outputs`, or the file of a tile if one was rendered; `key` stands for
/// the whole picture.
pub fn save(
    picture: Picture,
    path: &Path,
    (config, development): (&RenderConfig, &Development),
    key: Option<u128>,
    outputs: &mut Outputs,
) -> Result<(), SaveError> {
    let Some(window) = config.window else {
        return picture.save_into(path, development, outputs);
    };
    let header = TileHeader {
        whole: (config.width, config.height),
        corner: (window.x, window.y),
        size: (window.width, window.height),
        development: *development,
        key: key.unwrap_or_default(),
    };
    PictureTile { header, picture }.save_into(path, outputs)
}

/// Joins all tiles of a picture, in any order. Returns the picture, and how PNG and JPEG files of it
/// are developed: what `over` makes of the tiles' own development. Fails if they are not all tiles of
/// one picture, if some are missing, and if that is not the same for all.
pub fn joined(
    paths: &[&Path],
    over: impl Fn(Development) -> Development,
    progress: &Progress,
) -> Result<(Picture, Development), CliError> {
    let mut headers = Vec::new();
    for path in paths {
        headers.push((TileHeader::load(path)?, *path));
    }
    // The metadata that is not of all tiles is that of the first of the picture.
    headers.sort_by_key(|(header, _)| (header.corner.1, header.corner.0));
    let Some((first, named)) = headers.first() else {
        return Err(CliError::Usage("there are no tiles to join".into()));
    };
    let development = over(first.development);
    check_all(&headers)?;
    for (header, path) in &headers {
        if over(header.development) != development {
            let message = format!(
                "it was rendered with another --exposure, --view-transform, --dither or --bits than \
                 {}; name the option for all of them as one of merge",
                named.display()
            );
            return Err(wrong(path, &message).into());
        }
    }
    let mut picture = Picture::default();
    let mut rays = 0.0;
    for (header, path) in &headers {
        interrupt::check(progress)?;
        let tile = PictureTile::load(path)?;
        if tile.header != *header {
            return Err(wrong(path, "it changed while it was read; merge again").into());
        }
        let (width, height) = header.whole;
        tile.put(&mut picture).map_err(|_| {
            CliError::Memory(format!(
                "there is not enough memory for a picture of {width}x{height}"
            ))
        })?;
        rays += metadata::rays(&tile.picture.metadata);
        if picture.metadata.is_empty() {
            picture.metadata = tile.picture.metadata;
        }
    }
    metadata::complete(&mut picture, rays);
    Ok((picture, development))
}

/// Checks that tiles are those of one picture, and that they have each of its pixels once.
fn check_all(tiles: &[(TileHeader, &Path)]) -> Result<(), CliError> {
    let (first, named) = &tiles[0];
    let (columns, rows) = Window::most(first.whole.0, first.whole.1);
    let mut met: Vec<Option<usize>> = vec![None; columns as usize * rows as usize];
    for (number, (header, path)) in tiles.iter().enumerate() {
        if header.whole != first.whole || header.key != first.key {
            return Err(wrong(
                path,
                &format!(
                    "it is of another picture, or of another version of the program, than {}; merge \
                     tiles of one picture",
                    named.display()
                ),
            )
            .into());
        }
        // Tiles begin at multiples of the step, and end there or at the picture's end.
        let span = |corner: u32, size: u32, whole: u32| {
            let end = corner + size;
            let is_whole = corner.is_multiple_of(Window::STEP)
                && (end.is_multiple_of(Window::STEP) || end == whole);
            is_whole.then(|| corner / Window::STEP..end.div_ceil(Window::STEP))
        };
        let across = span(header.corner.0, header.size.0, header.whole.0);
        let down = span(header.corner.1, header.size.1, header.whole.1);
        let (Some(across), Some(down)) = (across, down) else {
            return Err(wrong(path, "its place is none of a tile; render it again").into());
        };
        for place in down.flat_map(|y| across.clone().map(move |x| y * columns + x)) {
            if let Some(other) = met[place as usize].replace(number) {
                return Err(wrong(
                    path,
                    &format!(
                        "its pixels are in {} already; leave one of them out",
                        tiles[other].1.display()
                    ),
                )
                .into());
            }
        }
    }
    match met.iter().position(Option::is_none) {
        None => Ok(()),
        Some(place) => {
            let place = place as u32;
            Err(CliError::Usage(format!(
                "the tile from column {} and row {} of the pixels on is missing; render it with \
                 --tile, and merge all tiles at once",
                place % columns * Window::STEP,
                place / columns * Window::STEP
            )))
        }
    }
}

fn wrong(path: &Path, message: &str) -> LoadError {
    LoadError::Invalid {
        path: path.into(),
        place: "tile".into(),
        message: message.into(),
    }
}
