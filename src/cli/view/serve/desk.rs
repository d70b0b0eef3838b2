//! One page: what it last asked to see, and the thread that renders it.

use super::look::{Look, Shot};
use super::outbox::Outbox;
use super::passes::{Finished, Pace, draw};
use super::probing::{Click, probe};
use super::{Shared, json, locked};
use crate::pipeline::thread_pool;
use lanecast_picture::render::Progress;
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicBool, Ordering::SeqCst};
use std::sync::{Arc, Condvar, Mutex};

#[derive(Default)]
pub struct Page {
    pub outbox: Outbox,
    desk: Mutex<Desk>,
    more: Condvar,
    probing: AtomicBool,
}

#[derive(Default)]
struct Desk {
    look: Option<Look>,
    /// Whether the look waits to be rendered.
    is_new: bool,
    /// Of the picture that is rendered.
    progress: Arc<Progress>,
    closed: bool,
}

/// What a page says.
#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
enum Said {
    Look(Look),
    Probe(Click),
}

#[derive(Serialize)]
#[serde(tag = "kind", rename = "failed")]
struct Failed {
    id: u64,
    text: String,
}

impl Page {
    /// Takes a message of the page.
    pub fn hear(self: &Arc<Page>, text: &str, shared: &Arc<Shared>) {
        match serde_json::from_str(text) {
            Ok(Said::Look(look)) => self.ask(|desk| desk.look = Some(look)),
            Ok(Said::Probe(click)) => {
                // One at a time: solids may take long to prepare.
                if self.probing.swap(true, SeqCst) {
                    return;
                }
                let (page, shared) = (Arc::clone(self), Arc::clone(shared));
                std::thread::spawn(move || {
                    page.outbox.text(probe(&shared, &click));
                    page.probing.store(false, SeqCst);
                });
            }
            Err(e) => self.fail(0, e.to_string()),
        }
    }

    /// Renders the last look again.
    pub fn redraw(&self) {
        self.ask(|_| ());
    }

    fn ask(&self, change: impl FnOnce(&mut Desk)) {
        let mut desk = locked(&self.desk);
        change(&mut desk);
        desk.is_new = desk.look.is_some();
        desk.progress.cancel();
        self.more.notify_one();
    }

    fn fail(&self, id: u64, text: String) {
        self.outbox.text(json(&Failed { id, text }));
    }

    /// Ends the page's threads.
    pub fn close(&self) {
        self.ask(|desk| desk.closed = true);
        self.outbox.close();
    }

    /// Waits for something new to render; `None` once the page is closed.
    fn next(&self) -> Option<(Look, Arc<Progress>)> {
        let mut desk = locked(&self.desk);
        loop {
            if desk.closed {
                return None;
            }
            if let (true, Some(look)) = (desk.is_new, desk.look.clone()) {
                desk.is_new = false;
                desk.progress = Arc::default();
                return Some((look, Arc::clone(&desk.progress)));
            }
            desk = self.more.wait(desk).unwrap_or_else(|e| e.into_inner());
        }
    }

    /// Renders what the page asks for until it is closed. Each page has threads of its own, so that
    /// none waits for the picture of another.
    pub fn render(&self, shared: &Shared) {
        let pool = match thread_pool(shared.base.threads) {
            Ok(pool) => pool,
            Err(e) => return self.fail(0, e.to_string()),
        };
        let mut pace = Pace::default();
        let mut kept: Option<(u64, Finished)> = None;
        while let Some((look, progress)) = self.next() {
            let (revision, model) = shared.model();
            let id = look.id;
            let shot = Shot::of(&shared.base, &model, &look);
            let drawn = shot.and_then(|shot| {
                self.outbox.text(json(&shot.seen(id, (revision, &model))));
                let job = (&*model, &shot, id);
                if let Some((of, finished)) = &kept
                    && *of == revision
                    && finished.is_of(&shot)
                {
                    // Only its development is another.
                    return finished.send(job, &self.outbox, &progress);
                }
                kept = None;
                let finished = draw(job, &self.outbox, &pool, &progress, &mut pace)?;
                kept = Some((revision, finished));
                Ok(())
            });
            if let Err(error) = drawn
                && !progress.is_cancelled()
            {
                self.fail(id, error.to_string());
            }
        }
    }
}
