//! The server of `view`, from outside: a page that has no browser.

use crate::run::{BALL, folder, lanecast, stderr};
use serde_json::{Value, json};
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tungstenite::protocol::Role;
use tungstenite::{Message, WebSocket};

/// A server, which ends with the value.
struct Server {
    process: Child,
    address: String,
    token: String,
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

impl Server {
    fn of(folder: &Path, arguments: &[&str]) -> Server {
        let mut process = Command::new(env!("CARGO_BIN_EXE_lanecast"))
            .current_dir(folder)
            .arg("view")
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(process.stdout.take().unwrap()).lines();
        let url = lines.next().unwrap().unwrap();
        let (address, token) = url
            .strip_prefix("http://")
            .unwrap()
            .split_once("/?token=")
            .unwrap();
        let said = lines.next().unwrap().unwrap();
        assert!(
            said.contains(&format!("ssh -L {}:{address}", &address[10..])),
            "{said}"
        );
        Server {
            address: address.into(),
            token: token.into(),
            process,
        }
    }

    /// Returns the first line of the answer to a request, and what follows.
    fn answer(&self, request: &str) -> (String, String) {
        let mut stream = TcpStream::connect(&self.address).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        stream.write_all(request.as_bytes()).unwrap();
        let mut reader = BufReader::new(stream);
        let (mut first, mut rest) = (String::new(), String::new());
        reader.read_line(&mut first).unwrap();
        // An open socket would not end.
        if !first.contains(" 101 ") {
            let _ = reader.read_to_string(&mut rest);
        }
        (first, rest)
    }

    fn get(&self, target: &str, headers: &[(&str, &str)]) -> String {
        let headers = headers
            .iter()
            .map(|(name, value)| format!("{name}: {value}\r\n"));
        let headers: String = headers.collect();
        self.answer(&format!("GET {target} HTTP/1.1\r\n{headers}\r\n"))
            .0
    }

    fn page(&self) -> Page {
        let mut stream = TcpStream::connect(&self.address).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let (address, token) = (&self.address, &self.token);
        let request = format!(
            "GET /ws?token={token} HTTP/1.1\r\nHost: {address}\r\nOrigin: http://{address}\r\n\
             Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n\
             Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
        );
        stream.write_all(request.as_bytes()).unwrap();
        let mut head = Vec::new();
        while !head.ends_with(b"\r\n\r\n") {
            let mut byte = [0];
            stream.read_exact(&mut byte).unwrap();
            head.push(byte[0]);
        }
        let head = String::from_utf8(head).unwrap();
        assert!(head.starts_with("HTTP/1.1 101 "), "{head}");
        // The answer of RFC 6455's own example.
        assert!(head.contains("s3pPLMBiTxaQ9kYGzzhZRbK+xOo="), "{head}");
        Page {
            socket: WebSocket::from_raw_socket(stream, Role::Client, None),
            asked: 0,
        }
    }
}

const PATIENCE: Duration = Duration::from_secs(60);

struct Page {
    socket: WebSocket<TcpStream>,
    asked: u64,
}

/// A message: its header or text, and the bytes that follow.
type Said = (Value, Vec<u8>);

impl Page {
    fn say(&mut self, message: &Value) {
        self.socket
            .send(Message::text(message.to_string()))
            .unwrap();
    }

    fn hear(&mut self) -> Said {
        loop {
            match self.socket.read().unwrap() {
                Message::Text(text) => return (serde_json::from_str(&text).unwrap(), Vec::new()),
                Message::Binary(bytes) => {
                    let end = 4 + u32::from_le_bytes(bytes[..4].try_into().unwrap()) as usize;
                    let header = serde_json::from_slice(&bytes[4..end]).unwrap();
                    return (header, bytes[end..].to_vec());
                }
                _ => (),
            }
        }
    }

    /// Waits for a message.
    fn wait(&mut self, mut is: impl FnMut(&Said) -> bool) -> Said {
        loop {
            let said = self.hear();
            assert_ne!(said.0["kind"], "failed", "{}", said.0);
            if is(&said) {
                return said;
            }
        }
    }

    fn look(&mut self, options: &Value) -> u64 {
        self.asked += 1;
        self.say(&json!({"kind": "look", "id": self.asked, "options": options}));
        self.asked
    }

    /// Returns the command of a look, its complete picture, and the number of messages before.
    fn picture(&mut self, options: &Value) -> (String, Vec<u8>, usize) {
        let id = self.look(options);
        let (mut command, mut before) = (String::new(), 0);
        let (_, bytes) = self.wait(|(said, _)| {
            if said["kind"] == "seen" && said["id"] == id {
                command = said["command"].as_str().unwrap().to_owned();
            }
            before += usize::from(said["kind"] != "seen");
            said["kind"] == "picture" && said["is_final"] == true && said["id"] == id
        });
        (command, bytes, before - 1)
    }
}

fn with_scene(text: &str) -> tempfile::TempDir {
    let folder = folder();
    fs::write(folder.path().join("a.toml"), text).unwrap();
    folder
}

#[test]
fn strangers_are_refused() {
    let folder = with_scene(BALL);
    let server = Server::of(folder.path(), &["a.toml"]);
    let (host, token) = (("Host", &*server.address), &server.token);
    let page = format!("/?token={token}");
    let socket = format!("/ws?token={token}");
    let key = ("Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ==");
    let own = format!("http://{}", server.address);
    let is = |target: &str, headers: &[(&str, &str)], status: &str| {
        let got = server.get(target, headers);
        assert!(
            got.starts_with(&format!("HTTP/1.1 {status} ")),
            "{target} {headers:?}: {got}"
        );
    };
    is(&page, &[host], "200");
    is(&page, &[host, ("Origin", &own)], "200");
    is(&page, &[("Host", "localhost:1234")], "200");
    is(&socket, &[host, key, ("Origin", &own)], "101");
    is("/", &[host], "403");
    is("/?token=", &[host], "403");
    is(&format!("/?token={}0", &token[1..]), &[host], "403");
    is(&page, &[("Host", "evil.example")], "403");
    is(&page, &[], "403");
    is(&page, &[host, ("Origin", "http://evil.example")], "403");
    is(&page, &[host, ("Sec-Fetch-Site", "cross-site")], "403");
    let link = ("Sec-Fetch-Mode", "navigate");
    is(
        &page,
        &[host, ("Sec-Fetch-Site", "cross-site"), link],
        "200",
    );
    is(
        &socket,
        &[host, key, ("Origin", "http://evil.example")],
        "403",
    );
    is(&socket, &[host, key, ("Origin", "null")], "403");
    is(&socket, &[("Host", "evil.example"), key], "403");
    is("/ws", &[host, key, ("Origin", &own)], "403");
    is(&format!("/a.toml?token={token}"), &[host], "404");
    is(&page, &[host, host], "400");
    let (got, _) = server.answer(&format!(
        "POST {page} HTTP/1.1\r\nHost: {}\r\n\r\n",
        server.address
    ));
    assert!(got.starts_with("HTTP/1.1 405 "), "{got}");
    let (got, _) = server.answer("\x16\x03\x01\r\n\r\n");
    assert!(got.starts_with("HTTP/1.1 400 "), "{got}");
}

/// Renders what a page shows by the command that it names, into `made.png`, of which the name of a
/// frame is another. Returns the file's bytes.
fn rendered_as(folder: &Path, command: &str, file: &str) -> Vec<u8> {
    let words = command.strip_prefix("lanecast ").unwrap().split(' ');
    let arguments: Vec<&str> = words.chain(["-o", "made.png"]).collect();
    let output = lanecast(folder, &arguments);
    assert!(output.status.success(), "{command}: {}", stderr(&output));
    fs::read(folder.join(file)).unwrap()
}

fn rendered(folder: &Path, command: &str) -> Vec<u8> {
    rendered_as(folder, command, "made.png")
}

#[test]
fn the_last_picture_has_the_bytes_of_render() {
    let folder = with_scene(BALL);
    let server = Server::of(folder.path(), &["a.toml", "--seed", "7", "--size", "90x60"]);
    let mut page = server.page();
    let (scene, _) = page.hear();
    assert_eq!(scene["kind"], "scene");
    assert_eq!(scene["options"], json!({"size": "90x60"}));
    let place =
        json!({"size": "90x60", "eye": "-3.1,2.2,4.7", "look-at": "0.1,0,0", "up": "0,1,0.01"});
    let with = |options: Value| {
        let mut all = place.clone();
        let more = options.as_object().unwrap().clone();
        all.as_object_mut().unwrap().extend(more);
        all
    };
    let mut met = std::collections::BTreeSet::new();
    for options in [
        json!({"size": "90x60"}),
        json!({"size": "90x60", "view": "top"}),
        json!({"size": "90x60", "orbit": "-40,25"}),
        place.clone(),
        with(json!({"exposure": "-1.5"})),
        with(json!({"precision": "fast", "spp": "4"})),
        with(json!({"integrator": "path", "spp": "1"})),
        with(json!({"integrator": "path", "spp": "24"})),
        with(json!({"integrator": "path", "spp": "24", "view-transform": "agx", "exposure": "2"})),
        with(json!({"integrator": "path", "spp": "16", "background": "transparent"})),
        with(json!({"integrator": "path", "spp": "16", "background": "white"})),
        with(json!({"integrator": "ao", "spp": "16"})),
        with(json!({"integrator": "normals"})),
        with(json!({"integrator": "heat"})),
        with(json!({"integrator": "edges", "orthographic": "3.25"})),
    ] {
        let (command, picture, before) = page.picture(&options);
        assert!(
            command.starts_with("lanecast render a.toml --seed 7 "),
            "{command}"
        );
        assert_eq!(picture, rendered(folder.path(), &command), "{command}");
        assert!(met.insert(picture), "{command}");
        if options["spp"] == "24" && options.get("view-transform").is_none() {
            // 1 sample, then 2, 4, 8, 16; and 24 at last. A page gets those that it has time for.
            assert!(before >= 1, "{before}");
        }
    }
    // The same scene for eight pages at once.
    let mut pages: Vec<Page> = (0..8).map(|_| server.page()).collect();
    let ids: Vec<u64> = pages.iter_mut().map(|page| page.look(&place)).collect();
    let (_, first, _) = page.picture(&place);
    for (page, id) in pages.iter_mut().zip(ids) {
        let (_, picture) = page.wait(|(said, _)| said["is_final"] == true && said["id"] == id);
        assert!(picture == first);
    }
}

/// The ball on a way of two seconds.
fn moving() -> String {
    let moving = BALL.replace(
        "material = 'red'\n",
        "material = 'red'\nmotion = [{ at = 1.0, transform = [{ translate = [1, 0.5, 0] }] }]\n",
    );
    moving.replace("format = 1", "format = 1\nseconds = 2")
}

#[test]
fn a_frame_has_the_bytes_of_the_sequence() {
    let folder = with_scene(&moving());
    let server = Server::of(folder.path(), &["a.toml", "--size", "64x48"]);
    let mut page = server.page();
    assert_eq!(page.hear().0["frames"], 48);
    let (_, still, _) = page.picture(&json!({"size": "64x48"}));
    for options in [
        json!({"size": "64x48", "frames": "36..37"}),
        json!({"size": "64x48", "frames": "36..37", "view": "front", "integrator": "path", "spp": "8"}),
    ] {
        let (command, picture, _) = page.picture(&options);
        let made = rendered_as(folder.path(), &command, "made_0036.png");
        assert!(picture == made, "{command}");
        assert!(picture != still);
    }
}

#[test]
fn a_shutter_is_open_where_it_is_asked_for() {
    let folder = with_scene(&moving());
    let line = ["a.toml", "--size", "64x48", "--shutter-slices", "16"];
    let server = Server::of(folder.path(), &line);
    let mut page = server.page();
    let (_, still, _) = page.picture(&json!({"size": "64x48"}));
    for more in [
        json!({"shutter": "0..0.5", "spp": "16"}),
        json!({"shutter": "0..0.5", "shutter-slices": "16"}),
        json!({"shutter": "0..0.5", "integrator": "path", "spp": "16"}),
        json!({"shutter": "0..0.5", "frames": "36..37", "integrator": "path", "spp": "8"}),
    ] {
        let mut options = more.clone();
        options["size"] = "64x48".into();
        let (command, picture, _) = page.picture(&options);
        assert!(command.contains("--shutter=0..0.5"), "{command}");
        let name = match more.get("frames") {
            Some(_) => "made_0036.png",
            None => "made.png",
        };
        assert!(
            picture == rendered_as(folder.path(), &command, name),
            "{command}"
        );
        assert!(picture != still, "{command}");
    }
    // What shows no light is not blurred, and is not refused either.
    let sharp = json!({"size": "64x48", "shutter": "0..0.5", "integrator": "normals"});
    let (command, picture, _) = page.picture(&sharp);
    assert!(!command.contains("shutter"), "{command}");
    assert!(picture == rendered(folder.path(), &command), "{command}");
}

#[test]
fn things_stand_on_a_ground() {
    let folder = with_scene(BALL);
    let line = ["a.toml", "--size", "64x48", "--ground", "--spp", "8"];
    let server = Server::of(folder.path(), &line);
    let mut page = server.page();
    let options = json!({"size": "64x48", "spp": "8"});
    for view in ["front", "iso", "top"] {
        let mut options = options.clone();
        options["view"] = view.into();
        let (command, picture, _) = page.picture(&options);
        assert!(command.contains("--ground"), "{command}");
        assert!(picture == rendered(folder.path(), &command), "{command}");
        let bare = command.replace(" --ground", " --integrator path");
        assert!(picture != rendered(folder.path(), &bare), "{command}");
    }
    // Where it would not show, it is left out.
    for more in [("integrator", "normals"), ("background", "transparent")] {
        let mut options = options.clone();
        options[more.0] = more.1.into();
        let (command, picture, _) = page.picture(&options);
        assert!(!command.contains("--ground"), "{command}");
        assert!(picture == rendered(folder.path(), &command), "{command}");
    }
}

#[test]
fn an_animation_has_its_frames_and_the_bytes_of_its_sequence() {
    let Some(assets) = crate::common::assets() else {
        return;
    };
    for (file, name, frames) in [
        (
            "gltf/AnimatedMorphCube/AnimatedMorphCube.gltf",
            "Square",
            101,
        ),
        ("gltf/simple_skin/simple_skin.gltf", "0", 132),
    ] {
        let folder = folder();
        let file = assets.join(file);
        let file = file.to_str().unwrap();
        let line = [
            file,
            "--animation",
            name,
            "--size",
            "64x48",
            "--integrator",
            "normals",
        ];
        let server = Server::of(folder.path(), &line);
        let mut page = server.page();
        assert_eq!(page.hear().0["frames"], frames);
        let shared = [("size", "64x48"), ("integrator", "normals")];
        let shared: std::collections::BTreeMap<&str, &str> = shared.into();
        let (_, still, _) = page.picture(&json!(shared));
        for frame in [17, 50] {
            let mut options = shared.clone();
            let range = format!("{frame}..{}", frame + 1);
            options.insert("frames", &range);
            let (command, picture, _) = page.picture(&json!(options));
            let made = rendered_as(folder.path(), &command, &format!("made_00{frame}.png"));
            assert!(picture == made, "{command}");
            assert!(picture != still, "{command}");
        }
    }
    // At rest without a name.
    let folder = folder();
    let file = assets.join("gltf/simple_skin/simple_skin.gltf");
    let server = Server::of(folder.path(), &[file.to_str().unwrap()]);
    assert_eq!(server.page().hear().0["frames"], 0);
}

#[test]
fn the_newest_look_is_answered_and_wrong_ones_are_told() {
    let folder = with_scene(BALL);
    let server = Server::of(folder.path(), &["a.toml", "--size", "64x48"]);
    let mut page = server.page();
    for options in [
        json!({"size": "1x"}),
        json!({"integrator": "hot"}),
        json!({"output": "x.png"}),
        json!({"allow-outside": ""}),
        json!({"eye": "1,2,3"}),
        json!({"camera": "no"}),
    ] {
        let id = page.look(&options);
        let said = loop {
            let (said, _) = page.hear();
            if said["kind"] == "failed" {
                break said;
            }
        };
        assert_eq!(said["id"], id);
        let text = said["text"].as_str().unwrap();
        assert!(!text.is_empty() && !text.contains("error: "), "{text}");
    }
    // Long work is given up for the next.
    let start = Instant::now();
    page.look(&json!({"size": "640x480", "integrator": "path", "spp": "65536"}));
    page.wait(|(said, _)| said["kind"] == "picture" || said["kind"] == "tiles");
    for k in 0..200 {
        page.look(&json!({"size": "640x480", "integrator": "path", "spp": "65536", "exposure": k.to_string()}));
    }
    page.picture(&json!({"size": "64x48"}));
    assert!(start.elapsed() < Duration::from_secs(30));
    assert!(!folder.path().join("x.png").exists());
}

#[test]
fn a_click_tells_what_probe_tells() {
    let folder = with_scene(crate::solids::PART);
    let server = Server::of(folder.path(), &["a.toml"]);
    let mut page = server.page();
    let options = json!({"size": "80x60", "eye": "0,0.1,30", "look-at": "0,0,0"});
    for (x, y) in [(40, 30), (41, 28), (0, 0)] {
        page.say(&json!({"kind": "probe", "id": 3, "options": options, "x": x, "y": y}));
        let (told, _) = page.wait(|(said, _)| said["kind"] == "probed");
        assert_eq!((&told["x"], &told["y"]), (&json!(x), &json!(y)));
        let command = told["command"].as_str().unwrap();
        let words = command.strip_prefix("lanecast ").unwrap().split(' ');
        let arguments: Vec<&str> = words.chain(["--json", "-"]).collect();
        let output = lanecast(folder.path(), &arguments);
        let probed: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(told["report"], probed, "{command}");
        assert_eq!(
            probed["spans"].as_array().unwrap().len(),
            if x > 0 { 4 } else { 1 }
        );
    }
}

/// How soon is for `.ci/view` to say.
#[test]
fn an_edit_shows_and_a_broken_one_tells_where() {
    let folder = with_scene(BALL);
    let file = folder.path().join("a.toml");
    let server = Server::of(folder.path(), &["a.toml", "--size", "64x48"]);
    let mut page = server.page();
    let (_, red, _) = page.picture(&json!({"size": "64x48"}));

    // Breaks a line, and mends it in another colour.
    fs::write(&file, BALL.replace("radius = 1 }", "radius = -1 }")).unwrap();
    let (said, _) = page.wait(|(said, _)| said["kind"] == "scene" && said["revision"] == 1);
    let error = said["error"].as_str().unwrap();
    assert!(error.contains("a.toml:10:8:"), "{error}");
    let (_, still, _) = page.picture(&json!({"size": "64x48"}));
    assert!(still == red);

    fs::write(&file, BALL.replace("[1, 0, 0]", "[0, 1, 0]")).unwrap();
    let (said, _) = page.wait(|(said, _)| said["kind"] == "scene");
    assert_eq!(
        (&said["revision"], &said["error"]),
        (&json!(2), &Value::Null)
    );
    let (_, green) = page.wait(|(said, _)| said["is_final"] == true);
    assert!(green != red);
    assert!(green == page.picture(&json!({"size": "64x48"})).1);

    // A mesh that comes to be named is watched, too; it is not there at first.
    let meshed = BALL.replace(
        "sphere = { center = [0, 0, 0], radius = 1 }",
        "mesh = 'part.obj'",
    );
    fs::write(&file, &meshed).unwrap();
    let (said, _) = page.wait(|(said, _)| said["kind"] == "scene");
    assert!(
        said["error"].as_str().unwrap().contains("part.obj"),
        "{said}"
    );
    let part = folder.path().join("part.obj");
    fs::write(&part, "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let (said, _) = page.wait(|(said, _)| said["kind"] == "scene");
    assert_eq!(
        (&said["revision"], &said["error"]),
        (&json!(3), &Value::Null)
    );
    page.wait(|(said, _)| said["is_final"] == true);
    fs::write(&part, "v -2 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    page.wait(|(said, _)| said["kind"] == "scene" && said["revision"] == 4);
    page.wait(|(said, _)| said["is_final"] == true);
}

#[test]
fn a_wrong_start_ends_with_one_message() {
    let fails = |arguments: &[&str], code, says: &str| {
        crate::run::fails(&[&["view"], arguments].concat(), code, says);
    };
    fails(&["none.toml"], 3, "none.toml");
    fails(&["-o", "x.png"], 2, "-o is not for view");
    fails(&["--frames", "3"], 2, "--frames is not for view");
    fails(&["--aov", "depth"], 2, "--aov is not for view");
    fails(&["--listen", "here"], 2, "--listen");
    fails(&["--listen", "192.0.2.1:0"], 2, "address of this machine");
}
