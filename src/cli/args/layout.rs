//! How the help of commands is laid out: rare options under headings of their own, and examples at
//! the end. What stands under no heading is what most people need.

use super::page::HIDDEN;
use clap::Command;

/// Headings, and the options below each, by the names of their fields.
const HEADINGS: [(&str, &[&str]); 7] = [
    (
        "Light and samples",
        &[
            "ground",
            "samples",
            "max_spp",
            "cache",
            "cache_error",
            "cache_file",
            "cache_keep",
            "max_bounces",
            "sampler",
            "filter",
            "seed",
            "shadow_cache",
            "solver",
        ],
    ),
    (
        "Files of pictures",
        &[
            "view_transform",
            "exposure",
            "dither",
            "bits",
            "background",
            "cryptomatte_levels",
            "metadata",
            "tile",
            "denoise",
        ],
    ),
    (
        "Motion",
        &["animation", "fps", "shutter", "shutter_slices", "reuse"],
    ),
    (
        "Reading files",
        &[
            "format",
            "allow_outside",
            "point_radius",
            "scad_curves",
            "clip",
            "variant",
        ],
    ),
    (
        "Structures and lanes",
        &[
            "accel", "kd_stop", "kd_depth", "kd_leaf", "kd_clip", "quality", "lanes",
        ],
    ),
    ("Measured cameras", &["pose", "k"]),
    ("Progress and records", &["progress", "stats"]),
];

/// Commands, and lines that people may begin from.
const EXAMPLES: [(&str, &[&str]); 13] = [
    (
        "render",
        &[
            "lanecast render part.glb -o part.png --size 1024x1024",
            "lanecast render part.stl --noise 0.01 --background transparent",
            "lanecast render part.csg --view iso --integrator edges",
            "lanecast render room.toml -o room.exr --spp 256 --aov all",
            "lanecast render walk.glb --frames 0..48 --fps 24",
        ],
    ),
    (
        "view",
        &[
            "lanecast view part.glb --open",
            "lanecast view part.csg --integrator path --clip 0,0,1,0",
            "lanecast view part.glb --listen 127.0.0.1:8123",
        ],
    ),
    (
        "batch",
        &[
            "lanecast batch job.toml --list",
            "lanecast batch job.toml --out pictures",
            "lanecast batch job.toml --out pictures --shard 0/4",
            "lanecast batch job.toml --out pictures --merge",
        ],
    ),
    (
        "thumbs",
        &["lanecast thumbs parts --out thumbs --background white"],
    ),
    (
        "merge",
        &[
            "lanecast render room.toml --samples 0..64 -o a.sums",
            "lanecast render room.toml --samples 64..128 -o b.sums",
            "lanecast merge a.sums b.sums -o room.exr",
            "lanecast render room.toml --tile 0/2 -o top.tile",
            "lanecast render room.toml --tile 1/2 -o bottom.tile",
            "lanecast merge top.tile bottom.tile -o room.exr",
        ],
    ),
    (
        "compare",
        &[
            "lanecast compare a.exr b.exr",
            "lanecast compare a.exr b.exr --html ab.html --max-wrong 0",
        ],
    ),
    (
        "verify",
        &[
            "lanecast verify part.glb",
            "lanecast verify part.glb --adversarial 1000000 --offset 1e6,0,0",
            "lanecast verify room.toml --light --size 96x72",
        ],
    ),
    (
        "bench",
        &[
            "lanecast bench part.glb --size 1024x1024",
            "lanecast bench part.glb --accels bvh,kd,grid --plot structures.html",
        ],
    ),
    (
        "tradeoff",
        &[
            "lanecast tradeoff part.glb --html trade.html",
            "lanecast tradeoff part.glb --within rmse=0.02",
        ],
    ),
    (
        "plan",
        &["lanecast plan part.glb", "lanecast plan part.glb --json -"],
    ),
    (
        "probe",
        &["lanecast probe bracket.toml --org 0.6,1,9 --dir 0,0,-1"],
    ),
    (
        "measure",
        &[
            "lanecast measure bracket.toml --density 7850",
            "lanecast measure bracket.toml --error 1e-6 --json -",
        ],
    ),
    (
        "export",
        &[
            "lanecast export bracket.toml --pov bracket.pov",
            "lanecast export room.toml --mitsuba room.xml",
            "lanecast export job.toml --openjd job.openjd.yaml",
        ],
    ),
];

/// Puts rare options under their headings, and adds the examples.
pub fn laid_out(command: Command) -> Command {
    let mut command = command.mut_subcommands(|command| {
        command.mut_args(|arg| match heading(arg.get_id().as_str()) {
            Some(heading) => arg.help_heading(heading),
            None => arg,
        })
    });
    for name in HIDDEN {
        command = command.mut_subcommand("view", |view| view.mut_arg(name, |arg| arg.hide(true)));
    }
    for (name, lines) in EXAMPLES {
        command = command.mut_subcommand(name, |command| {
            let before = command.get_after_help().map(|text| format!("{text}\n\n"));
            let text = format!(
                "{}Examples:\n  {}",
                before.unwrap_or_default(),
                lines.join("\n  ")
            );
            command.after_help(text)
        });
    }
    command
}

fn heading(option: &str) -> Option<&'static str> {
    let found = HEADINGS.iter().find(|(_, below)| below.contains(&option));
    found.map(|(heading, _)| *heading)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command;

    #[test]
    fn every_option_below_a_heading_exists() {
        let command = command();
        for name in HEADINGS.iter().flat_map(|(_, below)| *below) {
            let known = command
                .get_subcommands()
                .any(|command| command.get_arguments().any(|arg| arg.get_id() == *name));
            assert!(known, "{name}");
        }
    }

    #[test]
    fn every_example_is_parsed() {
        for line in EXAMPLES.iter().flat_map(|(_, lines)| *lines) {
            let parsed = command().try_get_matches_from(line.split(' '));
            assert!(parsed.is_ok(), "{line}: {:?}", parsed.err());
        }
    }
}
