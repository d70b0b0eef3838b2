//! Options of the commands that tell of the program itself.

use crate::output::Sink;
use clap::Args;
use clap_complete::Shell;
use std::path::PathBuf;

#[derive(Args)]
pub struct VersionArgs {
    /// Write machine-readable results, to standard output if no file is named
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "-", value_parser = Sink::parse)]
    pub json: Option<Sink>,
}

#[derive(Args)]
#[command(after_help = "bash: source <(lanecast completions bash)\n\
                  zsh:  lanecast completions zsh > \"${fpath[1]}/_lanecast\"\n\
                  fish: lanecast completions fish > ~/.config/fish/completions/lanecast.fish")]
pub struct CompletionsArgs {
    /// The shell
    pub shell: Shell,
}

#[derive(Args)]
pub struct ManArgs {
    /// The folder, which is made if there is none
    pub folder: PathBuf,
}
