//! The command `lanecast`: arguments in, exit code out. One file per command.
//!
//! Exit codes: 0 done; 1 a check failed; 2 wrong usage; 3 bad scene or input; 4 output
//! could not be written; 130 interrupted, with nothing half-written. Errors go to
//! standard error as `error: …`, with the remedy. A reader of standard output that
//! closes it early (`| head`) is no error.
//!
//! **Invariant:** the processor is checked before anything else runs (`cpu.rs`), on
//! Linux even before the Rust runtime (`main.rs` of the crate `lanecast`).
//!
//! A part of Lanecast that may change with any version; the command line is what is kept.

mod accuracy;
mod args;
mod bands;
mod batch;
mod bench;
mod compare;
mod convert;
mod cpu;
mod denoise;
mod error;
mod export;
mod extremes;
mod farm;
mod frames;
mod ground;
mod interrupt;
mod isa;
mod looks;
mod manual;
mod measure;
mod memory;
mod merge;
mod metadata;
mod motion;
mod output;
mod part;
mod pipeline;
mod plan;
mod probe;
mod progress;
mod render;
mod roots;
mod scene;
mod shutter;
mod tev;
mod thumbs;
mod tile;
mod tradeoff;
mod triangles;
mod verify;
mod version;
mod view;

#[cfg(unix)]
pub use cpu::check_before_main;

use args::{
    BatchArgs, BenchArgs, CompareArgs, CompletionsArgs, ConvertArgs, ExportArgs, ExtremesArgs,
    ManArgs, MeasureArgs, MergeArgs, PageArgs, PlanArgs, ProbeArgs, RenderArgs, RootsArgs,
    ThumbsArgs, TradeoffArgs, VerifyArgs, VersionArgs, laid_out,
};
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use error::CliError;
use progress::Style;
use std::ffi::OsString;
use std::process::ExitCode;

#[derive(Parser)]
#[command(
    name = "lanecast",
    version,
    about = "A CPU ray tracer that knows how wrong it is",
    after_help = "Exit codes: 0 done, 1 a check fell short, 2 wrong usage, 3 bad scene or input file, \
                  4 output could not be written, 130 interrupted (nothing half-written).",
    arg_required_else_help = true,
    disable_help_subcommand = true
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Render a scene; without SCENE, the built-in one
    Render(RenderArgs),
    /// Look at a scene from all sides, on a page in a browser
    View(PageArgs),
    /// Render all pictures of a job: scenes by cameras, variants and frames
    Batch(BatchArgs),
    /// Render a small picture of each scene file below folders, and a page of all
    Thumbs(ThumbsArgs),
    /// Join parts of a picture, which render --samples or --tile wrote
    Merge(MergeArgs),
    /// Compare two pictures, channel by channel
    Compare(CompareArgs),
    /// Compare lanes with scalar code and with the reference, per pixel
    Verify(VerifyArgs),
    /// Measure rays per second by ray kind and mode
    Bench(BenchArgs),
    /// Show speed against accuracy: all ways to render a scene, their times and errors
    Tradeoff(TradeoffArgs),
    /// Print what a scene requires, and the choices made for it
    Plan(PlanArgs),
    /// Sweep scenes to extremes, and report where each precision begins to err
    Extremes(ExtremesArgs),
    /// List every span of one ray through the solids of a scene
    Probe(ProbeArgs),
    /// Measure volume, area and centroid of the solids of a scene
    Measure(MeasureArgs),
    /// Write a scene in the native format, to go on from there
    Convert(ConvertArgs),
    /// Write a scene for other programs, or a job for a farm
    Export(ExportArgs),
    /// Find the real roots of a polynomial, with any solver
    Roots(RootsArgs),
    /// Tell version, commit, instruction sets and features
    Version(VersionArgs),
    /// Print the completions of a shell
    Completions(CompletionsArgs),
    /// Write the manual's pages into a folder
    Man(ManArgs),
}

impl Command {
    /// Whether the command traces rays, so that a slow build is worth a warning.
    fn traces(&self) -> bool {
        !matches!(
            self,
            Command::Merge(_)
                | Command::Compare(_)
                | Command::Convert(_)
                | Command::Export(_)
                | Command::Version(_)
                | Command::Completions(_)
                | Command::Man(_)
        )
    }

    /// How the commands of farms show how far they are.
    fn progress(&self) -> Style {
        match self {
            Command::Render(args) => args.common.progress.style,
            Command::Batch(args) => args.progress.style,
            Command::Thumbs(args) => args.progress.style,
            _ => Style::None,
        }
    }
}

/// Runs the program with the arguments of this process.
pub fn main() -> ExitCode {
    if !cpu::check() {
        return ExitCode::from(2);
    }
    interrupt::survive_file_size_limit();
    run()
}

/// Separate from `main`, so that none of it runs before the check.
#[inline(never)]
fn run() -> ExitCode {
    let cli = match parse(std::env::args_os()) {
        Ok(cli) => cli,
        // Help and version also arrive here.
        Err(e) if !e.use_stderr() => return ended(output::print(&e.render().to_string())),
        Err(e) => {
            let _ = e.print();
            return ExitCode::from(e.exit_code() as u8);
        }
    };
    if cli.command.traces() {
        isa::warn_of_slow_build();
    }
    let style = cli.command.progress();
    let done = match &cli.command {
        Command::Render(args) => rendered(args),
        Command::View(args) => view::run(args),
        Command::Batch(args) => batch::run(args, render_command()),
        Command::Thumbs(args) => thumbs::run(args, render_command()),
        Command::Merge(args) => merge::run(args),
        Command::Compare(args) => compare::run(args),
        Command::Verify(args) => verify::run(args),
        Command::Bench(args) => bench::run(args),
        Command::Tradeoff(args) => tradeoff::run(args),
        Command::Plan(args) => plan::run(args),
        Command::Extremes(args) => extremes::run(args),
        Command::Probe(args) => probe::run(args),
        Command::Measure(args) => measure::run(args),
        Command::Convert(args) => convert::run(args),
        Command::Export(args) => export::run(args, render_command()),
        Command::Roots(args) => roots::run(args),
        Command::Version(args) => version::run(args),
        Command::Completions(args) => manual::completions(args, command()),
        Command::Man(args) => manual::man(args, command()),
    };
    if let Err(error) = &done {
        style.tell_failure(&error.to_string());
    }
    ended(done)
}

/// Renders a picture, by the options that its accuracy asks for.
fn rendered(args: &RenderArgs) -> Result<(), CliError> {
    let Some(accuracy) = &args.accuracy else {
        return render::run(args);
    };
    let arguments = accuracy::resolved(args, &accuracy.0)?;
    match parse(arguments) {
        Ok(Cli {
            command: Command::Render(args),
        }) => render::run(&args),
        Ok(_) => Ok(()),
        Err(e) => {
            let why = e.to_string();
            let lines = why
                .lines()
                .take_while(|line| !line.is_empty())
                .map(str::trim);
            let why = lines.collect::<Vec<_>>().join(" ");
            Err(CliError::Usage(format!(
                "the way that keeps the bounds cannot stand beside the other options: {}",
                why.trim_start_matches("error: ")
            )))
        }
    }
}

fn ended(done: Result<(), CliError>) -> ExitCode {
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            interrupt::disable_timeout();
            let error = interrupt::cause(error);
            output::complain(&format!("error: {error}"));
            ExitCode::from(error.exit_code())
        }
    }
}

/// Parses arguments of `render`, which its name begins.
#[cfg(feature = "view")]
fn render_args(arguments: Vec<String>) -> Result<RenderArgs, clap::Error> {
    let arguments = std::iter::once("lanecast".to_owned()).chain(arguments);
    match parse(arguments.map(Into::into))?.command {
        Command::Render(args) => Ok(args),
        _ => Err(command().error(clap::error::ErrorKind::InvalidSubcommand, "not render")),
    }
}

/// Parses the arguments of a process.
fn parse(arguments: impl IntoIterator<Item = OsString>) -> Result<Cli, clap::Error> {
    Cli::from_arg_matches(&command().try_get_matches_from(arguments)?)
}

/// Returns the definition of `lanecast render`.
fn render_command() -> clap::Command {
    let command = command();
    let render = command.find_subcommand("render").cloned();
    render.expect("the command line has the subcommand")
}

/// Returns the command line as it is parsed and shown. A negative number after an option is its
/// value, which the option may refuse, not an option of that name.
fn command() -> clap::Command {
    let command = Cli::command().mut_subcommands(|command| {
        command.mut_args(|arg| {
            let numeric = arg.get_long().is_some() && arg.get_action().takes_values();
            arg.allow_negative_numbers(numeric)
        })
    });
    laid_out(command)
}
