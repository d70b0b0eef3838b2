//! `lanecast batch`: tasks, their bits, and what comes of processes that end at any moment.

use crate::run::{folder, lanecast, names, stderr, stdout};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

const BALL: &str = "format = 1\n\
    [camera.near]\neye = [0, 0, 3]\nlook_at = [0, 0, 0]\nfov_y = 40\n\
    [camera.far]\neye = [2, 1, 6]\nlook_at = [0, 0, 0]\nfov_y = 40\n\
    [[light]]\npoint = { position = [3, 4, 5], intensity = [90, 90, 90] }\n\
    [shape.ball]\nsphere = { center = [0, 0, 0], radius = 1 }\n\
    [[instance]]\nshape = \"ball\"\n";

const BLOCK: &str = "format = 1\n\
    [camera.near]\neye = [1, 2, 4]\nlook_at = [0, 0, 0]\nfov_y = 40\n\
    [camera.far]\neye = [2, 1, 9]\nlook_at = [0, 0, 0]\nfov_y = 40\n\
    [shape.block]\nbox = { min = [-1, -1, -1], max = [1, 0.5, 1] }\n\
    [[instance]]\nshape = \"block\"\n\
    motion = [{ at = 1.0, transform = [{ translate = [1, 0, 0] }] }]\n";

/// A folder with two scenes and a job over them.
fn job(job: &str) -> tempfile::TempDir {
    let folder = folder();
    fs::create_dir(folder.path().join("s")).unwrap();
    fs::write(folder.path().join("s/ball.toml"), BALL).unwrap();
    fs::write(folder.path().join("s/block.toml"), BLOCK).unwrap();
    fs::write(folder.path().join("job.toml"), job).unwrap();
    folder
}

/// Twelve pictures.
const TWELVE: &str = "format = 1\nscene = \"s/*.toml\"\ncamera = [\"near\", \"far\"]\nview = \"iso\"\n\
    frame = \"0-12:12\"\nrender = { size = \"20x16\", spp = 2 }\n";

fn batch(folder: &Path, arguments: &[&str]) -> std::process::Output {
    lanecast(folder, &[&["batch", "job.toml"], arguments].concat())
}

fn succeeds(folder: &Path, arguments: &[&str]) -> String {
    let done = batch(folder, arguments);
    assert_eq!(done.status.code(), Some(0), "{}", stderr(&done));
    stdout(&done).into()
}

/// The lines of JSON that a run prints.
fn lines(folder: &Path, arguments: &[&str]) -> Vec<Value> {
    let done = batch(folder, &[arguments, &["--json"]].concat());
    let lines = stdout(&done).lines();
    lines
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

/// The bytes of all pictures of a folder and those below, by their paths.
fn pictures(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for name in names(folder) {
        let path = folder.join(&name);
        if path.is_dir() && name != "records" {
            let below = pictures(&path).into_iter();
            found.extend(below.map(|(below, bytes)| (format!("{name}/{below}"), bytes)));
        } else if path.is_file() && name != "records.jsonl" {
            found.insert(name, fs::read(path).unwrap());
        }
    }
    found
}

#[test]
fn tasks_are_numbered_scenes_outermost() {
    let folder = job(TWELVE);
    let listed = lines(folder.path(), &["--list"]);
    let outputs: Vec<&str> = listed
        .iter()
        .map(|l| l["output"].as_str().unwrap())
        .collect();
    let expected = ["ball", "block"].into_iter().flat_map(|scene| {
        let views = ["near", "far", "iso"].into_iter();
        views.flat_map(move |view| [0, 12].map(|i| format!("{scene}_{view}_{i:04}.png")))
    });
    assert_eq!(outputs, expected.collect::<Vec<_>>());
    assert!(listed.iter().zip(0..).all(|(line, i)| line["task"] == i));
    assert_eq!(listed[9]["camera"], "far");
    assert_eq!(
        (&listed[9]["scene"], &listed[9]["frame"]),
        (&"s/block.toml".into(), &12.into())
    );
    let text = succeeds(folder.path(), &["--list", "--tasks", "9"]);
    assert!(
        text.starts_with("9  block_far_0012.png  s/block.toml"),
        "{text}"
    );
    // Nothing is rendered or made.
    assert_eq!(names(folder.path()), ["job.toml", "s"]);
}

/// Each task is rendered alone by the command that `--list` gives.
fn has_the_bits_of_render(text: &str, count: usize) {
    let folder = job(text);
    let path = folder.path();
    succeeds(path, &["--out", "all"]);
    succeeds(path, &["--out", "one", "--threads", "1"]);
    let all = pictures(&path.join("all"));
    assert_eq!(all, pictures(&path.join("one")));
    assert_eq!(all.len(), count, "{:?}", all.keys());
    for line in lines(path, &["--list"]) {
        let command: Vec<&str> = line["command"]
            .as_array()
            .unwrap()
            .iter()
            .map(|w| w.as_str().unwrap())
            .collect();
        let output = line["output"].as_str().unwrap();
        let ending = output.rsplit('.').next().unwrap();
        let mut command = command;
        let alone = format!("alone.{ending}");
        let place = command.iter().position(|word| *word == "-o").unwrap() + 1;
        command[place] = &alone;
        let done = lanecast(path, &command);
        assert!(done.status.success(), "{}", stderr(&done));
        // Of --frames the name gets the number.
        let name = match line["frame"].as_u64() {
            Some(frame) => format!("alone_{frame:04}.{ending}"),
            None => alone.clone(),
        };
        assert!(
            all[output] == fs::read(path.join(&name)).unwrap(),
            "{command:?}"
        );
        fs::remove_file(path.join(name)).unwrap();
    }
}

#[test]
fn a_task_has_the_bits_of_render() {
    has_the_bits_of_render(TWELVE, 12);
    let light = "format = 1\nscene = \"s/ball.toml\"\norbit = { views = 2, elevation = [0, 90], fov_y = 50 }\n\
                 variant = [{ name = \"path\", integrator = \"path\", spp = 4 }, \
                 { name = \"cut\", clip = [\"1,0,0,0.2\", \"0,1,0,0.4\"] }, \
                 { name = \"box\", accel = \"kd\", precision = \"exact\" }]\n\
                 output = \"{folder}/{scene}/{variant}-{camera}.exr\"\n\
                 [render]\nsize = \"18x14\"\naov = [\"depth\", \"instance_id\", \"normal\"]\n";
    has_the_bits_of_render(light, 12);
    let ground = "format = 1\nscene = \"s/ball.toml\"\nview = [\"front\", \"iso\"]\n\
                  [render]\nsize = \"18x14\"\nspp = 2\nground = true\nbits = 16\nview_transform = \"agx\"\n";
    has_the_bits_of_render(ground, 2);
    let blur = "format = 1\nscene = \"s/block.toml\"\ncamera = [\"near\", \"far\"]\nframe = \"3,9-11\"\n\
                output = \"{frame}/{camera}.exr\"\n[render]\nsize = \"18x14\"\nspp = 8\n\
                shutter = \"0..0.5\"\naov = \"motion\"\nintegrator = \"path\"\nmetadata = \"none\"\n";
    has_the_bits_of_render(blur, 8);
    let without = "format = 1\nscene = \"s/ball.toml\"\ncamera = [0, 1]\nframe = [\"0-1\", 5]\n\
                   variant = [{ name = \"few\" }, { name = \"one\", noise = false, spp = 1, max-depth = false }]\n\
                   [render]\nsize = \"18x14\"\nintegrator = \"path\"\nnoise = 0.2\ndither = false\nmax_bounces = 2\n";
    has_the_bits_of_render(without, 12);
    // Variants of a scene share its trees only if they trace by one structure.
    let heat = "format = 1\nscene = \"s/block.toml\"\nframe = [0, 12]\n\
                variant = [{ name = \"light\", integrator = \"path\", spp = 2 }, \
                { name = \"heat\", integrator = \"heat\" }, \
                { name = \"cells\", integrator = \"heat\", accel = \"kd\" }]\n\
                render = { size = \"18x14\" }\n";
    has_the_bits_of_render(heat, 6);
}

/// Of a file's animation the frames of all tasks are read at once.
#[test]
fn animated_files_have_the_bits_of_render() {
    let asset = Path::new("gltf/AnimatedMorphCube/AnimatedMorphCube.gltf");
    let Some(assets) = crate::common::assets() else {
        return;
    };
    let scene = assets.join(asset);
    if !scene.is_file() {
        println!("skipped: {} is not there", scene.display());
        return;
    }
    let text = format!(
        "format = 1\nscene = {scene:?}\nview = [\"iso\", \"top\"]\nframe = \"4-40:12,6\"\n\
         [render]\nsize = \"20x16\"\nspp = 2\n"
    );
    has_the_bits_of_render(&text, 10);
}

/// Ends a run after a while, however far it is.
fn killed_after(folder: &Path, milliseconds: u64) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lanecast"));
    command
        .current_dir(folder)
        .args(["batch", "job.toml", "--out", "k"]);
    command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    let mut child = command.spawn().unwrap();
    std::thread::sleep(Duration::from_millis(milliseconds));
    // It may have ended by itself.
    let _ = child.kill();
    child.wait().unwrap();
}

#[test]
fn a_killed_run_goes_on_to_the_same_bits() {
    let folder = job(TWELVE);
    let path = folder.path();
    for i in 0..20 {
        killed_after(path, 3 + 7 * i % 41);
        // What has its name is whole.
        if path.join("k").exists() {
            for (name, bytes) in pictures(&path.join("k")) {
                let is_temporary = name.starts_with('.');
                assert!(
                    is_temporary || image::load_from_memory(&bytes).is_ok(),
                    "{name}"
                );
            }
        }
    }
    succeeds(path, &["--out", "k"]);
    succeeds(path, &["--out", "c"]);
    assert_eq!(pictures(&path.join("k")), pictures(&path.join("c")));
    // Another run has nothing to do, and the records tell of all.
    let again = succeeds(path, &["--out", "k"]);
    assert!(
        again.contains("0 pictures") && again.contains("12 were there"),
        "{again}"
    );
    succeeds(path, &["--out", "k", "--merge"]);
}

#[test]
fn shards_at_once_and_merged_are_the_whole() {
    let folder = job(TWELVE);
    let path = folder.path();
    let shard = |part: usize| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_lanecast"));
        let part = format!("{part}/4");
        command
            .current_dir(path)
            .args(["batch", "job.toml", "--out", "s4", "--shard", &part]);
        command
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .spawn()
            .unwrap()
    };
    let shards: Vec<_> = (0..3).map(shard).collect();
    for mut shard in shards {
        assert!(shard.wait().unwrap().success());
    }
    let missing = batch(path, &["--out", "s4", "--merge"]);
    assert_eq!(missing.status.code(), Some(1));
    let said = stderr(&missing);
    assert!(said.contains("3 of 12 tasks are missing: 9-11"), "{said}");
    assert!(shard(3).wait().unwrap().success());
    succeeds(path, &["--out", "s4", "--merge"]);
    let merged = fs::read_to_string(path.join("s4/records.jsonl")).unwrap();
    let tasks = merged
        .lines()
        .map(|l| serde_json::from_str::<Value>(l).unwrap());
    let tasks: Vec<u64> = tasks.map(|l| l["task"].as_u64().unwrap()).collect();
    assert_eq!(tasks, (0..12).collect::<Vec<u64>>());
    succeeds(path, &["--out", "c"]);
    assert_eq!(pictures(&path.join("s4")), pictures(&path.join("c")));
}

/// The numbers of the tasks that a run does.
fn made(folder: &Path, arguments: &[&str]) -> Vec<u64> {
    let mut made: Vec<u64> = lines(folder, arguments)
        .iter()
        .map(|line| line["task"].as_u64().unwrap())
        .collect();
    made.sort_unstable();
    made
}

#[test]
fn exactly_what_changed_is_done_again() {
    let folder = job(TWELVE);
    let path = folder.path();
    let out = &["--out", "o"];
    assert_eq!(made(path, out).len(), 12);
    let before = pictures(&path.join("o"));
    // A picture that is gone, and one that is cut.
    fs::remove_file(path.join("o/ball_iso_0000.png")).unwrap();
    fs::write(path.join("o/ball_far_0000.png"), "cut").unwrap();
    assert_eq!(made(path, out), [2, 4]);
    // One with the right size and another byte: only --check reads it.
    let name = path.join("o/block_far_0012.png");
    let mut bytes = fs::read(&name).unwrap();
    *bytes.last_mut().unwrap() ^= 1;
    fs::write(&name, bytes).unwrap();
    assert_eq!(made(path, out), [] as [u64; 0]);
    assert_eq!(made(path, &["--out", "o", "--check"]), [9]);
    assert_eq!(pictures(&path.join("o")), before);
    // A scene with another byte, and options: exactly its tasks.
    fs::write(
        path.join("s/ball.toml"),
        BALL.replace("radius = 1", "radius = 0.9"),
    )
    .unwrap();
    assert_eq!(made(path, out), [0, 1, 2, 3, 4, 5]);
    let text = TWELVE.replace("spp = 2", "spp = 1");
    fs::write(path.join("job.toml"), text).unwrap();
    assert_eq!(made(path, out).len(), 12);
    // Numbers are no part of a task: others come before, and what is done stays.
    let text = fs::read_to_string(path.join("job.toml")).unwrap();
    fs::write(
        path.join("job.toml"),
        text.replace("[\"near\", ", "[\"1\", \"near\", "),
    )
    .unwrap();
    assert_eq!(made(path, out), [0, 1, 8, 9]);
}

#[test]
fn files_that_scenes_name_are_read_too() {
    let folder = job("format = 1\nscene = \"s/square.toml\"\n[render]\nsize = \"9x7\"\nspp = 1\n");
    let path = folder.path();
    let scene = "format = 1\n[shape.square]\nmesh = \"square.obj\"\n\
                 [[instance]]\nshape = \"square\"\n";
    fs::write(path.join("s/square.toml"), scene).unwrap();
    let missing = batch(path, &["--out", "o"]);
    assert_eq!(missing.status.code(), Some(1), "{}", stderr(&missing));
    assert!(
        stderr(&missing).contains("square.obj"),
        "{}",
        stderr(&missing)
    );
    // It fails as before without a look, until the file is there.
    assert_eq!(made(path, &["--out", "o"]), [] as [u64; 0]);
    let square = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nf 1 2 3\n";
    fs::write(path.join("s/square.obj"), square).unwrap();
    assert_eq!(made(path, &["--out", "o"]), [0]);
    assert_eq!(made(path, &["--out", "o"]), [] as [u64; 0]);
    fs::write(
        path.join("s/square.obj"),
        square.replace("v 1 1 0", "v 0 1 0"),
    )
    .unwrap();
    assert_eq!(made(path, &["--out", "o"]), [0]);
}

/// The records of a run's folder with this status.
fn known(path: &Path, status: &str) -> Vec<Value> {
    let folder = path.join("o/records");
    let files = names(&folder)
        .into_iter()
        .map(|name| fs::read_to_string(folder.join(name)));
    let text: String = files.map(|text| text.unwrap()).collect();
    let records = text
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).unwrap());
    records
        .filter(|record| record["status"] == status)
        .collect()
}

#[test]
fn a_broken_scene_fails_alone_and_once() {
    let folder = job(TWELVE);
    let path = folder.path();
    fs::write(path.join("s/z.toml"), "format = 1\nnonsense").unwrap();
    let done = batch(path, &["--out", "o"]);
    assert_eq!(done.status.code(), Some(1));
    let said = stderr(&done);
    assert!(
        said.contains("failed: task 12, z_near_0000.png: s/z.toml:2"),
        "{said}"
    );
    assert!(said.contains("error: 6 of 18 tasks failed"), "{said}");
    assert_eq!(pictures(&path.join("o")).len(), 12);
    let again = batch(path, &["--out", "o"]);
    assert_eq!(again.status.code(), Some(1));
    assert!(stdout(&again).contains("0 pictures"), "{}", stdout(&again));
    assert!(stderr(&again).contains("s/z.toml:2"), "{}", stderr(&again));
    let records = known(path, "failed");
    assert_eq!(records.len(), 6);
    assert!(records.iter().all(|record| record["error"]["code"] == 3));
}
