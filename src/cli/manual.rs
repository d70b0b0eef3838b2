//! `lanecast completions` and `lanecast man`: what shells and `man` know of the command line.

use super::args::{CompletionsArgs, ManArgs};
use super::error::CliError;
use super::output::{Results, check_destinations, print};
use clap::Command;
use lanecast_io::SaveError;
use std::path::PathBuf;

/// Prints the completions of a shell.
pub fn completions(args: &CompletionsArgs, mut command: Command) -> Result<(), CliError> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, "lanecast", &mut script);
    print(&String::from_utf8_lossy(&script))
}

/// Writes a page for the program and one for each command.
pub fn man(args: &ManArgs, command: Command) -> Result<(), CliError> {
    std::fs::create_dir_all(&args.folder).map_err(|source| SaveError::Write {
        path: args.folder.clone(),
        source,
    })?;
    let pages = pages(command);
    let file = |(name, _): &(String, _)| args.folder.join(format!("{name}.1"));
    let files: Vec<PathBuf> = pages.iter().map(file).collect();
    check_destinations(&[], &files, [].into_iter())?;
    let mut results = Results::default();
    for (path, (_, page)) in files.iter().zip(pages) {
        results.outputs.add(path, page)?;
    }
    results.commit(&format!("{} pages, for man -l FILE\n", files.len()))
}

/// Makes the pages: their names, and their text in roff.
fn pages(mut command: Command) -> Vec<(String, Vec<u8>)> {
    // Gives each command the name of its page, such as `lanecast-render`.
    command.build();
    let commands: Vec<Command> = command.get_subcommands().cloned().collect();
    let all = std::iter::once(command).chain(commands);
    all.map(|command| {
        let name = command.get_display_name().unwrap_or(command.get_name());
        let name = name.to_owned();
        let mut page = Vec::new();
        // Writing to a vector cannot fail.
        let _ = clap_mangen::Man::new(command).render(&mut page);
        (name, page)
    })
    .collect()
}
