//! What a session shows: a rerun recording with a layout of its own, tables, and data sets
//! ([`dataset`]).
//!
//! The only room that knows rerun. A [`Recording`] is an observer: it gets what passes in a
//! session and cannot change it.
//!
//! ```no_run
//! use metrotwin::record::Recording;
//! use metrotwin::scenario::RecordSettings;
//! use metrotwin::session::Observer;
//!
//! let mut recording = Recording::to_file("out/run.rrd".as_ref(), &RecordSettings::default());
//! # fn session(_: &mut dyn Observer) -> Result<(), metrotwin::session::ObserverError> { Ok(()) }
//! session(&mut recording)?; // calls open, observe, and close in any case
//! # Ok::<(), metrotwin::session::ObserverError>(())
//! ```
//!
//! Everything lies on the timeline `sim_time`, images and what was found in them also on `frame`.
//! What is true and what was estimated are siblings: `world/train`, `world/bodies` against
//! `world/estimate/...`. What belongs to the first train or to none has these paths; of train `k`
//! the same lie below `world/train_k` and `train_k`. Two runs with one seed give equal recordings (`rerun rrd compare`): ids
//! of files come from scenario and seed, no row carries the wall clock, and batches are cut every 0.8
//! seconds of simulated time. Nothing older than that is held in memory or lost when the process is
//! killed: `<path>.part` then has all before it. A finished file has batches of ten seconds.
//!
//! Coordinates are the world's, relative to a point in the middle of the line; rerun's transforms
//! are single precision (<https://rerun.io/docs/concepts/logging-and-ingestion/transforms>).
//!
//! What it does not do: keep every image (see [`RecordSettings`]), nor anything that the stack or
//! the scores could read back. Tables are for that.

mod blueprint;
pub mod dataset;
mod image_encoder;
mod images;
mod map;
mod moving;
mod observer_error;
mod palette;
pub mod parquet;
mod plots;
mod recording_file;
mod scene;
mod stream;
mod tables;
mod template;
mod texts;

pub(crate) use recording_file::names_of_recording;
#[cfg(test)]
pub(crate) use tables::FIX_COLUMNS;
pub use tables::FixTable;
pub(crate) use template::render;

use crate::bus::{Content, Message, Node, SimTime, TrainId};
use crate::scenario::RecordSettings;
use crate::session::{Event, Observer, Opening, TrainOpening};
use images::Images;
use map::Map;
use moving::Moving;
use nalgebra::Isometry3;
use observer_error::Result;
use plots::{Plots, RIG_CAMERA};
use rerun::{SpawnError, SpawnOptions};
use scene::RecordedScene;
use std::collections::BTreeMap;
use std::path::Path;
use std::rc::Rc;
use stream::{FLUSH_S, RowStream, Target};
use texts::Texts;

/// Why there is no viewer.
#[derive(Debug, thiserror::Error)]
pub enum ViewerError {
    /// The program `rerun` is not installed.
    #[error(
        "the rerun viewer is not installed (no program `rerun` on the PATH); \
         install it with `pip install rerun-sdk==0.36.3`"
    )]
    NotInstalled,
    /// It is, but does not start.
    #[error("the rerun viewer did not start: {0}")]
    DidNotStart(String),
}

/// Writes a session into a rerun recording.
pub struct Recording {
    target: Target,
    settings: RecordSettings,
    open: Option<Open>,
}

impl Recording {
    /// Into a file. It is written as `<path>.part` and gets its name in [`Observer::close`].
    pub fn to_file(path: &Path, settings: &RecordSettings) -> Self {
        Self::new(Target::File(path.to_owned()), settings)
    }

    /// To a viewer that runs already, at `host:port` or a whole `rerun+http://host:port/proxy`.
    pub fn connect(address: &str, settings: &RecordSettings) -> Self {
        let url = if address.contains("://") {
            address.to_owned()
        } else {
            format!("rerun+http://{address}/proxy")
        };
        Self::new(Target::Viewer(url), settings)
    }

    /// Starts the viewer on this machine, unless one listens already, and shows the session as it
    /// runs.
    pub fn view(settings: &RecordSettings) -> Result<Self, ViewerError> {
        let viewer = rerun::spawn(&SpawnOptions {
            wait_for_bind: true,
            ..SpawnOptions::default()
        });
        match viewer {
            Ok(viewer) => Ok(Self::connect(
                &format!("127.0.0.1:{}", viewer.port),
                settings,
            )),
            Err(
                SpawnError::ExecutableNotFoundInPath { .. } | SpawnError::ExecutableNotFound { .. },
            ) => Err(ViewerError::NotInstalled),
            Err(error) => Err(ViewerError::DidNotStart(error.to_string())),
        }
    }

    fn new(target: Target, settings: &RecordSettings) -> Self {
        Self {
            target,
            settings: settings.clone(),
            open: None,
        }
    }
}

impl Observer for Recording {
    fn open(&mut self, opening: &Opening<'_>) -> Result {
        let stream = RowStream::open(&self.target, opening.scenario, opening.seed)?;
        self.open = Some(Open::new(stream, opening, &self.settings)?);
        Ok(())
    }

    fn observe(&mut self, event: &Event<'_>) -> Result {
        match &mut self.open {
            Some(open) => open.observe(event),
            None => Ok(()),
        }
    }

    fn close(&mut self) -> Result {
        match self.open.take() {
            Some(open) => open.close(),
            None => Ok(()),
        }
    }
}

/// What a train has, and so what a recording shows of it. With the first train goes what belongs to
/// none.
#[derive(Default)]
struct Contents {
    id: TrainId,
    rig: bool,
    train: bool,
    radar: bool,
    occupancy: bool,
    protection: bool,
    /// Names of the wayside devices.
    devices: Vec<String>,
}

impl Contents {
    fn of_train(train: &TrainOpening) -> Self {
        Self {
            id: train.id,
            rig: train.rig.is_some(),
            train: train.cars > 0,
            radar: train.radar,
            occupancy: train.occupancy,
            protection: train.protection,
            devices: Vec::new(),
        }
    }

    /// Of all trains with equipment, by number; the first is always there.
    fn of(opening: &Opening<'_>) -> Vec<Self> {
        let first = opening.first().map(Self::of_train).unwrap_or_default();
        let devices = opening.wayside.iter().map(|d| d.name.clone()).collect();
        let others = opening.trains.iter().map(Self::of_train);
        let others = others.filter(|train| train.id != TrainId::default());
        let first = Self { devices, ..first };
        std::iter::once(first).chain(others).collect()
    }

    /// Names of all cameras, the rig's first.
    fn cameras(&self) -> impl Iterator<Item = &str> {
        let rig = self.rig.then_some(RIG_CAMERA);
        rig.into_iter()
            .chain(self.devices.iter().map(String::as_str))
    }

    /// Something has the head's pose: a train, or a rig on a bench.
    fn head(&self) -> bool {
        self.train || self.rig
    }
}

/// What a recording shows of one train.
struct TrainView {
    moving: Moving,
    images: Images,
    plots: Plots,
}

/// A recording in the making.
struct Open {
    stream: RowStream,
    contents: Vec<Contents>,
    first_camera: Option<Isometry3<f64>>,
    laid_out: bool,
    flush_at: SimTime,
    scene: Rc<RecordedScene>,
    /// With the first train goes what belongs to none.
    views: BTreeMap<TrainId, TrainView>,
    texts: Texts,
    map: Option<Map>,
}

impl Open {
    fn new(stream: RowStream, opening: &Opening<'_>, settings: &RecordSettings) -> Result<Self> {
        let contents = Contents::of(opening);
        let scene = Rc::new(RecordedScene::new(opening.tunnel));
        scene.log(&stream, opening, settings)?;
        let view = |contents: &Contents| -> Result<TrainView> {
            let (id, devices) = (contents.id, contents.devices.len());
            let train = opening.trains.iter().find(|train| train.id == id);
            Ok(TrainView {
                moving: Moving::open(stream.clone(), scene.clone(), train)?,
                plots: Plots::open(stream.clone(), contents)?,
                images: Images::new(stream.clone(), settings, (id, devices)),
            })
        };
        let views = contents.iter().map(|c| Ok((c.id, view(c)?)));
        Ok(Self {
            views: views.collect::<Result<_>>()?,
            first_camera: opening.wayside.first().map(|d| d.world_from_camera),
            laid_out: false,
            flush_at: SimTime::ZERO.plus(FLUSH_S),
            texts: Texts::open(stream.clone(), opening)?,
            map: Map::open(&stream, opening.tunnel)?,
            stream,
            contents,
            scene,
        })
    }

    fn observe(&mut self, event: &Event<'_>) -> Result {
        let time = match *event {
            Event::Train {
                train,
                truth,
                left_eye,
            } => {
                if let Some(view) = self.view(train) {
                    view.moving.train(truth, left_eye);
                    view.plots.train(truth);
                }
                if let Some(map) = &mut self.map {
                    map.train(train, truth)?;
                }
                if train == TrainId::default() {
                    self.lay_out(Some(&truth.world_from_vehicle))?;
                }
                truth.time
            }
            Event::Message {
                node: Node::Train(id),
                message,
            } => self.message(*id, message)?,
            Event::Message { .. } | Event::Cost { .. } => return Ok(()),
            Event::Blades { time, bodies } => {
                if let Some(view) = self.view(TrainId::default()) {
                    view.moving.blades(time, bodies)?;
                }
                time
            }
            Event::Bodies { time, bodies } => {
                if let Some(view) = self.view(TrainId::default()) {
                    view.moving.bodies(time, bodies)?;
                }
                time
            }
            Event::Occupancy {
                train,
                report,
                class,
                ..
            } => {
                if let Some(view) = self.view(train) {
                    view.plots.occupancy(report, class);
                }
                if let Some(map) = &mut self.map {
                    map.occupancy(train, report)?;
                }
                report.time
            }
            // Its images come when they reach the stack.
            Event::Exposure(_) => return Ok(()),
            Event::Pair {
                train,
                pair,
                report,
                true_chainages_m,
            } => {
                self.texts.dark_lamps(train, report)?;
                if let Some(view) = self.view(train) {
                    view.plots.fixes(report, true_chainages_m);
                    view.plots.exposure(RIG_CAMERA, &pair.left);
                    view.images.pair(pair, report)?;
                    view.moving.fixes(report)?;
                }
                report.time
            }
            Event::Wayside {
                post,
                frame,
                report,
            } => {
                let name = self.contents[0].devices.get(post);
                let view = self.views.get_mut(&TrainId::default());
                let (Some(name), Some(view)) = (name, view) else {
                    return Ok(());
                };
                let device = (post, name.as_str());
                let time = frame.start;
                view.plots.wayside(post, report);
                view.plots.exposure(name, frame);
                self.texts.wayside(device, report)?;
                view.images.wayside(device, frame, report)?;
                self.stream.at(time);
                view.moving.obstacles(name, &report.obstacles)?;
                time
            }
            Event::Camera {
                time,
                node,
                camera,
                fault,
            } => {
                self.texts.camera(time, node, camera, fault)?;
                time
            }
            Event::Note { time, text } => {
                self.texts.note(time, text)?;
                time
            }
        };
        if time >= self.flush_at {
            self.flush_at = time.plus(FLUSH_S);
            self.flush()?;
        }
        Ok(())
    }

    /// A message of a train's node, or one that arrived there; gives its time.
    fn message(&mut self, id: TrainId, message: &Message) -> Result<SimTime> {
        let time = message.received_at;
        if let Content::Warning(warning) = &message.content {
            self.texts.warning(id, message, warning)?;
        }
        if let (Content::Gnss(fix), Some(map)) = (&message.content, &mut self.map) {
            map.fix(id, fix)?;
        }
        let Some(view) = self.view(id) else {
            return Ok(time);
        };
        match &message.content {
            Content::Odometer(sample) => view.plots.odometer(sample),
            Content::Doppler(sample) => view.plots.doppler(sample),
            Content::Protection(report) => {
                view.plots.protection(report);
                self.texts.protection(id, report)?;
                self.texts.display(id, report.time, &report.display)?;
            }
            _ => {}
        }
        Ok(time)
    }

    fn view(&mut self, id: TrainId) -> Option<&mut TrainView> {
        self.views.get_mut(&id)
    }

    /// Sends the layout, once: with the first truth, which says where to look.
    fn lay_out(&mut self, head: Option<&Isometry3<f64>>) -> Result {
        if self.laid_out {
            return Ok(());
        }
        self.laid_out = true;
        let eye = self.scene.eye(self.first_camera.as_ref(), head);
        blueprint::send(&self.stream, &self.contents, eye, self.map.is_some())
    }

    /// Rows first, then columns: each batch is cut before the next begins, so that the order in
    /// the file does not depend on threads.
    fn flush(&mut self) -> Result {
        self.lay_out(None)?;
        // An image that could not be encoded must not cost the rest.
        let images = self.views.values_mut().map(|view| view.images.flush());
        let images = images.fold(Ok(()), Result::and);
        self.stream.flush()?;
        for view in self.views.values_mut() {
            view.moving.flush()?;
            view.plots.flush()?;
        }
        images
    }

    fn close(mut self) -> Result {
        let flushed = self.flush();
        self.stream.finish()?;
        flushed
    }
}

/// Where something of a train goes: as the path says for the first one, below a number for others.
fn path_of(id: TrainId, path: &str) -> String {
    let number = id.index();
    match (number, path.strip_prefix("world/")) {
        (0, _) => path.to_owned(),
        (_, Some(in_world)) => format!("world/train_{number}/{in_world}"),
        (_, None) => format!("train_{number}/{path}"),
    }
}

/// A name as one part of an entity path.
fn slug(name: &str) -> String {
    let keep = |c: char| c.is_alphanumeric() || matches!(c, '_' | '-' | '.');
    name.chars()
        .map(|c| if keep(c) { c } else { '_' })
        .collect()
}

#[cfg(test)]
mod tests;
