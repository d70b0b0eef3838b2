//! Does the tasks of a job: one a thread where they are many and small, else each on all threads.
//!
//! Memory holds as many scenes as there are threads, however many tasks there are, or those that
//! `--memory` has room for (`shelf.rs`).

use super::alone;
use super::dataset::Sample;
use super::end::{End, panicked};
use super::key::{Hashes, settings};
use super::picture;
use super::records::{Failure, Known, Record, Standing, Status, Writer, outputs_of};
use super::shelf::Shelf;
use super::tasks::{Task, Tasks};
use crate::args::{BatchArgs, RenderArgs};
use crate::denoise;
use crate::error::CliError;
use crate::interrupt;
use crate::output::{complain, print};
use crate::pipeline::thread_pool;
use crate::progress::Drawing;
use lanecast_io::{SaveError, sweep};
use lanecast_measure::{Stats, Watch};
use lanecast_picture::render::Progress;
use rayon::ThreadPool;
use std::collections::BTreeSet;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, AtomicUsize, Ordering::SeqCst};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// Tasks of a thread from which on each does its own: the last ones leave threads idle.
const MANY: usize = 4;

/// The most pixels of a picture that one thread renders alone: as many pictures as threads are in
/// memory then.
const SMALL: u64 = 1 << 22;

/// A run, before its tasks are known.
pub struct Run<'r> {
    args: &'r BatchArgs,
    tasks: &'r Tasks,
    out: &'r Path,
    hashes: &'r Hashes,
    known: &'r Known,
}

/// What the threads of a run share.
struct Work<'r> {
    run: &'r Run<'r>,
    todo: &'r [u32],
    next: AtomicUsize,
    shelf: Shelf,
    writer: Mutex<Writer>,
    /// All threads, for trees that several tasks wait for.
    pool: ThreadPool,
    /// Threads of a task.
    threads: u32,
    progress: &'r Progress,
    shown: &'r Progress,
    done: AtomicU32,
    failed: AtomicU32,
    /// Why no other task begins.
    stop: Mutex<Option<CliError>>,
}

impl<'r> Run<'r> {
    pub fn new(
        args: &'r BatchArgs,
        tasks: &'r Tasks,
        (out, hashes, known): (&'r Path, &'r Hashes, &'r Known),
    ) -> Run<'r> {
        Run {
            args,
            tasks,
            out,
            hashes,
            known,
        }
    }

    /// Does those of the chosen tasks that are not done. Fails if any failed, here or before.
    pub fn all(&self, chosen: &[u32]) -> Result<(), CliError> {
        let progress = interrupt::watch();
        interrupt::keep_what_is_done();
        let start = Instant::now();
        let (mut todo, mut suspects, mut hopeless) = (Vec::new(), Vec::new(), 0);
        for number in chosen {
            interrupt::check(&progress)?;
            let task = self.tasks.task(*number);
            let settings = settings(self.tasks, &task);
            let here = (self.out, self.hashes);
            match self.known.standing(&settings, here, self.args.check) {
                Standing::Todo => todo.push(*number),
                Standing::Suspect if self.args.alone => todo.push(*number),
                Standing::Suspect => suspects.push(*number),
                Standing::Done(_) => {}
                Standing::Failed(failure) => {
                    hopeless += 1;
                    self.complain(&task, &failure);
                }
            }
        }
        let kept = chosen.len() - todo.len() - suspects.len() - hopeless;
        let (mut done, mut failed) = (0, hopeless);
        if !todo.is_empty() || !suspects.is_empty() {
            self.check_files(todo.iter().chain(&suspects))?;
            create_folder(self.out)?;
            self.sweep(&todo);
            let shown = Arc::new(Progress::default());
            shown.start((todo.len() + suspects.len()) as u32);
            let drawing = Drawing::start(&shown, self.args.progress.style);
            let work = self.work(&todo, (&progress, &shown))?;
            let workers = if work.threads == 1 {
                work.pool.current_num_threads()
            } else {
                1
            };
            std::thread::scope(|scope| {
                for _ in 1..workers.min(todo.len()) {
                    scope.spawn(|| work.work());
                }
                work.work();
            });
            for number in &suspects {
                work.alone(*number);
            }
            drop(drawing);
            done = work.done.load(SeqCst) as usize;
            failed += work.failed.load(SeqCst) as usize;
            let stop = work
                .stop
                .into_inner()
                .unwrap_or_else(PoisonError::into_inner);
            let finished = format!("{} of {} tasks are done", done + kept, chosen.len());
            match stop {
                Some(CliError::Interrupted) => {
                    return Err(CliError::Stopped(format!(
                        "interrupted; {finished}, and the same command goes on"
                    )));
                }
                Some(error) => {
                    complain(&format!("note: {finished}, and the same command goes on"));
                    return Err(error);
                }
                None => {}
            }
        }
        if !self.args.json && !self.args.quiet {
            let next = match self.tasks.dataset {
                Some(_) => "; with --merge the files of the data set are written",
                None => "",
            };
            print(&format!(
                "{}: {done} pictures in {:.3} s, {kept} were there, {failed} failed{next}\n",
                self.out.display(),
                start.elapsed().as_secs_f64()
            ))?;
        }
        match failed {
            0 => Ok(()),
            failed => Err(CliError::Short(format!(
                "{failed} of {} tasks failed; the records in {} say why",
                chosen.len(),
                self.out.join("records").display()
            ))),
        }
    }

    fn work<'w>(
        &'w self,
        todo: &'w [u32],
        (progress, shown): (&'w Progress, &'w Progress),
    ) -> Result<Work<'w>, CliError> {
        let pool = thread_pool(self.args.threads)?;
        let threads = pool.current_num_threads();
        let is_small = || {
            let task = self.tasks.task(todo[0]);
            let args = self.render_args(&task, &mut self.tasks.parser());
            let config = args.and_then(|args| Ok(args.config()?));
            config.is_ok_and(|c| u64::from(c.width) * u64::from(c.height) <= SMALL)
        };
        let is_split = todo.len() >= MANY * threads && is_small();
        Ok(Work {
            run: self,
            todo,
            next: AtomicUsize::new(0),
            shelf: Shelf::of(self.tasks, todo, self.args.memory),
            writer: Mutex::new(Writer::create(self.out)?),
            threads: if is_split { 1 } else { threads as u32 },
            pool,
            progress,
            shown,
            done: AtomicU32::new(0),
            failed: AtomicU32::new(0),
            stop: Mutex::default(),
        })
    }

    /// Refuses to replace what no record names: it is not a picture of this job.
    fn check_files<'n>(&self, numbers: impl Iterator<Item = &'n u32>) -> Result<(), CliError> {
        let mut newest = None;
        for number in numbers {
            let task = self.tasks.task(*number);
            let (of_dataset, _) = self.tasks.beside(&task);
            let output = task.output;
            let beside = [output.with_extension("aov.exr"), denoise::beside(&output)];
            for file in [output].into_iter().chain(beside).chain(of_dataset) {
                let path = self.out.join(&file);
                if self.known.names(&file) || path.symlink_metadata().is_err() {
                    continue;
                }
                // Another process may have made it since records were read.
                if newest.is_none() {
                    newest = Some(Known::read(self.out)?);
                }
                if let Some(newest) = &newest {
                    newest.check_is_ours(self.out, &file)?;
                }
            }
        }
        Ok(())
    }

    /// Removes what killed processes have left in the folders of some tasks.
    fn sweep(&self, numbers: &[u32]) {
        let beside = |number: &u32| self.tasks.beside(&self.tasks.task(*number)).1;
        let folders: BTreeSet<PathBuf> = numbers.iter().flat_map(beside).collect();
        folders
            .iter()
            .for_each(|folder| sweep(&self.out.join(folder)));
    }

    fn render_args(&self, task: &Task, parser: &mut clap::Command) -> Result<RenderArgs, End> {
        let args = self.tasks.render_args(task, self.out, parser);
        args.map_err(|why| End::from(CliError::Usage(why)))
    }

    fn complain(&self, task: &Task, failure: &Failure) {
        complain(&format!(
            "failed: task {}, {}: {}",
            task.number,
            task.output.display(),
            failure.message
        ));
    }
}

impl Work<'_> {
    /// Does tasks until there are no more.
    fn work(&self) {
        let mut parser = self.run.tasks.parser();
        loop {
            if self.progress.is_cancelled() {
                self.stop(CliError::Interrupted);
            }
            if lock(&self.stop).is_some() {
                return;
            }
            let Some(number) = self.todo.get(self.next.fetch_add(1, SeqCst)) else {
                return;
            };
            let task = self.run.tasks.task(*number);
            if let Err(error) = self.task(&task, &mut parser) {
                self.stop(error);
            }
        }
    }

    /// Does a task and records how it ended. Fails if others would fail, too.
    fn task(&self, task: &Task, parser: &mut clap::Command) -> Result<(), CliError> {
        let Run {
            tasks, known, out, ..
        } = self.run;
        let settings = settings(tasks, task);
        let output = out.join(&task.output);
        let slot = self.shelf.slot(tasks, task, self.progress);
        let args = self.run.render_args(task, parser);
        let files = args
            .as_ref()
            .ok()
            .and_then(|args| picture::files(args, &task.output).ok());
        let mut files = files.unwrap_or_else(|| vec![task.output.clone()]);
        files.extend(tasks.beside(task).0);
        let started = Record::started(task.number, &settings, known.starts(&settings) + 1, &files);
        lock(&self.writer).append(&started)?;
        let (mut watch, mut stats) = (Watch::start(), Stats::default());
        let attempt = AssertUnwindSafe(|| {
            let args = args?;
            let with = (&args, self.run.hashes);
            let loaded = self.shelf.loaded(&slot, (tasks, task), with);
            stats.stages.push(watch.stage("load"));
            let loaded = loaded?;
            let args = with_threads(args, self.threads);
            let (pool, progress) = (&self.pool, self.progress);
            let (watch, stats) = (&mut watch, &mut stats);
            create_folder(output.parent().unwrap_or(out))?;
            let sample = tasks.dataset.as_ref().map(|settings| Sample {
                tasks,
                task,
                out,
                settings,
            });
            let of = (loaded, sample.as_ref());
            let made = picture::rendered(&args, &output, of, (pool, progress), (watch, stats));
            let (made, more) = made?;
            made.place().map_err(CliError::from)?;
            files.extend(more);
            files.sort();
            files.dedup();
            known.remove_others(&settings, &files, out);
            let outputs = outputs_of(out, &files);
            stats.stages.push(watch.stage("write"));
            Ok(outputs?)
        });
        let ended =
            catch_unwind(attempt).unwrap_or_else(|panic| Err(End::Failed(panicked(&*panic))));
        let inputs = slot.inputs((tasks, task), self.run.hashes);
        drop(slot);
        self.shelf.release(tasks, task);
        let mut record = match ended {
            Ok(outputs) => Record {
                outputs,
                ..started.ended(Status::Done, inputs)
            },
            Err(End::Stop(error)) => {
                // A disk that is full may have no room for this.
                let _ = lock(&self.writer).append(&started.ended(Status::Stopped, inputs));
                return Err(error);
            }
            Err(End::Failed(failure)) => Record {
                outputs: Vec::new(),
                error: Some(failure),
                ..started.ended(Status::Failed, inputs)
            },
        };
        for stage in &stats.stages {
            *record.stages.entry(stage.name.into()).or_default() += stage.seconds;
        }
        record.rays = stats.rays.total();
        self.end(task, &record)
    }

    /// Records and shows the end of a task.
    fn end(&self, task: &Task, record: &Record) -> Result<(), CliError> {
        let line = lock(&self.writer).append(record)?;
        self.shown.add_tile(record.rays);
        if self.run.args.json {
            print(&line)?;
        }
        let Some(failure) = &record.error else {
            self.done.fetch_add(1, SeqCst);
            return Ok(());
        };
        self.run.complain(task, failure);
        let failed = self.failed.fetch_add(1, SeqCst) + 1;
        match self.run.args.max_fails {
            Some(most) if failed > most => Err(CliError::Short(format!(
                "stopped: {failed} tasks have failed, more than --max-fails {most}"
            ))),
            _ => Ok(()),
        }
    }

    /// Does a task that has ended the process before in one of its own.
    fn alone(&self, number: u32) {
        if lock(&self.stop).is_some() {
            return;
        }
        let threads = self.pool.current_num_threads() as u32;
        let task = self.run.tasks.task(number);
        let ended = alone::done(self.run.args, number, threads, self.progress);
        let done = ended.and_then(|ended| {
            match ended {
                alone::Ended::Done => self.done.fetch_add(1, SeqCst),
                alone::Ended::Failed => self.failed.fetch_add(1, SeqCst),
                alone::Ended::Died(failure) => {
                    let (tasks, known) = (self.run.tasks, self.run.known);
                    let settings = settings(tasks, &task);
                    let starts = known.starts(&settings) + 1;
                    let files = [task.output.clone()];
                    let started = Record::started(number, &settings, starts, &files);
                    let scene = [tasks.scene_path(&task)].into();
                    let record = Record {
                        error: Some(failure),
                        ..started.ended(Status::Failed, self.run.hashes.inputs(&scene))
                    };
                    return self.end(&task, &record);
                }
            };
            self.shown.add_tile(0);
            Ok(())
        });
        if let Err(error) = done {
            self.stop(error);
        }
    }

    /// Keeps the first reason to stop.
    fn stop(&self, error: CliError) {
        lock(&self.stop).get_or_insert(error);
    }
}

fn create_folder(folder: &Path) -> Result<(), CliError> {
    let created = std::fs::create_dir_all(folder);
    let failed = |source| SaveError::Write {
        path: folder.into(),
        source,
    };
    Ok(created.map_err(failed)?)
}

fn with_threads(mut args: RenderArgs, threads: u32) -> RenderArgs {
    args.common.threads = Some(threads);
    args
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
