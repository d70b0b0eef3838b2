//! The server of the page: one thread that accepts, one that watches the scene's files, and for
//! each page one that reads, one that writes and one that renders.

mod desk;
mod http;
mod look;
mod model;
mod outbox;
mod passes;
mod probing;
mod watch;

use crate::args::PageArgs;
use crate::error::CliError;
use crate::interrupt;
use crate::output::{complain, print, printable};
use desk::Page;
use http::Guard;
use lanecast_io::ReadLog;
use look::Base;
use model::Model;
use serde::Serialize;
use std::net::{SocketAddr, TcpListener};
use std::sync::atomic::{AtomicUsize, Ordering::SeqCst};
use std::sync::{Arc, Mutex, MutexGuard, Weak};

/// Connections that are served at a time: each takes a thread.
const MOST_CONNECTIONS: usize = 64;

/// What all pages share.
pub struct Shared {
    base: Base,
    guard: Guard,
    current: Mutex<Current>,
    pages: Mutex<Vec<Weak<Page>>>,
}

/// The scene that pages show, and what is wrong with its file.
struct Current {
    /// Counts the scenes from 1.
    revision: u64,
    model: Arc<Model>,
    error: Option<String>,
}

/// What a page is told of the scene.
#[derive(Serialize)]
#[serde(tag = "kind", rename = "scene", rename_all = "snake_case")]
struct SceneNote<'a> {
    revision: u64,
    /// What the page begins with.
    options: &'a std::collections::BTreeMap<String, String>,
    #[serde(flatten)]
    about: &'a model::About,
    error: Option<&'a str>,
}

pub fn run(args: &PageArgs) -> Result<(), CliError> {
    interrupt::leave_at_signal();
    let tokens = std::env::args_os().skip(2).map(|token| token.into_string());
    let tokens: Result<Vec<String>, _> = tokens.collect();
    let tokens = tokens.map_err(|token| {
        CliError::Usage(format!(
            "{} is not UTF-8, and a page cannot name it; rename it",
            token.display()
        ))
    })?;
    let base = Base::of(args, tokens)?;
    let asked = ReadLog::default();
    let model = Model::load(&base, &asked)?;
    if let Some(warning) = &model.about.warning {
        complain(&format!("warning: {}: {warning}", model.about.name));
    }
    if args.render.shutter.is_open() && !model.about.blurs {
        complain(
            "warning: nothing moves in this scene that a page blurs, so --shutter changes nothing",
        );
    }
    let listener = TcpListener::bind(args.listen)
        .and_then(|listener| Ok((listener.local_addr()?, listener)))
        .map_err(|e| {
            CliError::Usage(format!(
                "--listen {}: {e}; name an address of this machine and a free port, or leave it out",
                args.listen
            ))
        });
    let (address, listener) = listener?;
    let shared = Arc::new(Shared {
        base,
        guard: Guard::new(address),
        current: Mutex::new(Current {
            revision: 1,
            model: Arc::new(model),
            error: None,
        }),
        pages: Mutex::default(),
    });
    greet(address, &shared.guard, args.open)?;
    let watched = Arc::clone(&shared);
    std::thread::spawn(move || watch::watch(&watched, &asked));
    accept(&listener, &shared);
    Ok(())
}

/// Prints where the page is.
fn greet(address: SocketAddr, guard: &Guard, open: bool) -> Result<(), CliError> {
    let url = guard.url();
    let port = address.port();
    let mut text = format!("{url}\n");
    if address.ip().is_loopback() {
        text += &format!(
            "from another machine: ssh -L {port}:{address} THIS_MACHINE, then the same address there\n"
        );
    } else {
        complain(
            "warning: the page is served beyond this machine, without encryption; whoever learns its \
             address with the token sees the scene",
        );
    }
    text += "Ctrl-C ends it\n";
    print(&printable(&text))?;
    if open {
        let program = match std::env::consts::OS {
            "macos" => "open",
            "windows" => "explorer",
            _ => "xdg-open",
        };
        if let Err(e) = std::process::Command::new(program).arg(&url).spawn() {
            complain(&format!(
                "warning: {program} cannot be started: {e}; open the address by hand"
            ));
        }
    }
    Ok(())
}

/// Serves connections, each on a thread of its own.
fn accept(listener: &TcpListener, shared: &Arc<Shared>) {
    let open = Arc::new(AtomicUsize::new(0));
    for stream in listener.incoming() {
        let Ok(stream) = stream else {
            // Out of file handles, most likely: some come back.
            std::thread::sleep(std::time::Duration::from_millis(50));
            continue;
        };
        if open.fetch_add(1, SeqCst) >= MOST_CONNECTIONS {
            open.fetch_sub(1, SeqCst);
            continue;
        }
        let shared = Arc::clone(shared);
        let counted = Arc::clone(&open);
        let served = std::thread::Builder::new().spawn(move || {
            http::serve(stream, &shared);
            counted.fetch_sub(1, SeqCst);
        });
        if served.is_err() {
            open.fetch_sub(1, SeqCst);
        }
    }
}

impl Shared {
    fn current(&self) -> MutexGuard<'_, Current> {
        locked(&self.current)
    }

    /// Returns the scene and its revision.
    pub fn model(&self) -> (u64, Arc<Model>) {
        let current = self.current();
        (current.revision, Arc::clone(&current.model))
    }

    /// Describes the scene to a page.
    pub fn scene_note(&self) -> String {
        let current = self.current();
        json(&SceneNote {
            revision: current.revision,
            options: &self.base.options,
            about: &current.model.about,
            error: current.error.as_deref(),
        })
    }

    /// Adds a page, which is told of the scene.
    pub fn enter(&self, page: &Arc<Page>) {
        page.outbox.text(self.scene_note());
        let mut pages = locked(&self.pages);
        pages.retain(|page| page.strong_count() > 0);
        pages.push(Arc::downgrade(page));
    }

    /// Shows another scene on all pages, or what is wrong with its file.
    pub fn replace(&self, loaded: Result<Model, CliError>) {
        let redraw = loaded.is_ok();
        {
            let mut current = self.current();
            match loaded {
                Ok(model) => {
                    current.model = Arc::new(model);
                    current.revision += 1;
                    current.error = None;
                }
                Err(error) => current.error = Some(error.to_string()),
            }
        }
        let note = self.scene_note();
        let pages: Vec<Arc<Page>> = locked(&self.pages)
            .iter()
            .filter_map(Weak::upgrade)
            .collect();
        for page in pages {
            page.outbox.text(note.clone());
            if redraw {
                page.redraw();
            }
        }
    }
}

/// Locks what no panic leaves half-written.
pub fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|e| e.into_inner())
}

/// Writes a message. Its maps have names for keys, so nothing can fail.
pub fn json(value: &impl Serialize) -> String {
    serde_json::to_string(value).unwrap_or_default()
}
