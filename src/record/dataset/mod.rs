//! A data set from a run: images with labels, for those who train and test detectors and decoders.
//!
//! [`DataSet`] watches a session. It sees every frame as it is taken, with the scene and the views
//! that the renderer is given ([`Event::Exposure`]), and the images as they reach the stack. Beside
//! each image it puts what is true: every pixel's depth, owner and flow by rays
//! ([`Labeller`]), the row-time equation solved for every lamp
//! ([`Projection`](crate::twin::render::labels::Projection)), boxes, times, poses; and the picture that a better
//! camera would have taken, for which it has a renderer of its own. So the run is the same, image
//! by image, as without a data set.
//!
//! ```no_run
//! use metrotwin::record::dataset::{DataSet, FramePlan, Provenance};
//! use metrotwin::scenario::Scenario;
//! use metrotwin::session::{RendererChoice, RunOptions, renderer, run, scene};
//! use std::path::Path;
//! use std::sync::atomic::AtomicBool;
//!
//! let scenario = Scenario::load(Path::new("scenarios/obstacle_gallery.toml"), &[])?;
//! let draws = renderer(&scenario, RendererChoice::Auto)?;
//! let enough = AtomicBool::new(false);
//! let plan = FramePlan { limit: Some(10), ..FramePlan::default() };
//! let mut set = DataSet::new("out/set".as_ref(), &scenario, plan, Provenance::default(), draws, &enough);
//! let options = RunOptions { stop: Some(&enough), ..RunOptions::default() };
//! run(&scenario, &options, &mut [&mut set])?;
//! println!("{} frames", set.frames());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Conventions of the files are in the `README.md` that every data set has (`readme.md` here): the
//! COCO format (<https://cocodataset.org/#format-data>), Parquet tables, PNG, and numpy arrays
//! for depth and flow, because 16-bit PNG has neither the range (160 m in millimetres, 700 pixels
//! in 64ths) nor the digits.
//!
//! It lives in `record` because it is an observer that writes down what a session shows. It does
//! not know the stack's answers, and writes none: truth is the twin's.
//!
//! What it does not do: split into training and test, and mixed pixels (a pixel belongs to what its
//! centre sees).

mod clean;
mod coco;
mod files;
mod folder;
mod frame;
mod lamps;
mod obstacles;
mod plan;
mod readme;
mod take;

pub use folder::FolderError;
pub use plan::{FramePlan, LabelKind, LabelKinds, UnknownLabel};

use crate::bus::TrainId;
use crate::files::Listing;
use crate::files::write_whole;
use crate::record::observer_error::{Result, broken, failed};
use crate::record::parquet::{Column, ParquetTable};
use crate::scenario::Scenario;
use crate::scenario::sampling::{Inputs, complete, sha256};
use crate::session::{self, Event, Exposure, Observer, Opening, Source, TrainPoint};
use crate::track::Place;
use crate::twin::physics::BodyOwner;
use crate::twin::render::labels::Labeller;
use crate::twin::render::{Job, Renderer};
use files::{FILES, FOLDERS};
use frame::{FrameRow, ImageRow};
use image::GrayImage;
use lamps::LampRow;
use obstacles::ObstacleRow;
use serde_json::json;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use take::LastFrame;

/// Where a data set comes from, to be written down with it.
#[derive(Clone, Debug, Default)]
pub struct Provenance {
    /// The scenario's file and all that it names, of which the set gets copies.
    pub inputs: Option<Inputs>,
    /// Changes to it, `key=value`.
    pub overrides: Vec<String>,
}

/// Folder of a data set for the copies of its inputs.
const INPUTS: &str = "inputs";

/// Writes a data set.
pub struct DataSet<'a> {
    out: PathBuf,
    plan: FramePlan,
    scenario: &'a Scenario,
    provenance: Provenance,
    renderer: Box<dyn Renderer>,
    labeller: Labeller,
    /// After that time a lamp's signal repeats.
    period_s: f64,
    cameras: Vec<Camera>,
    /// Frames whose images are on their way.
    waiting: Vec<ExposedFrame>,
    tables: Tables,
    frames: Vec<FrameRow>,
    images: Vec<serde_json::Value>,
    annotations: Vec<coco::Annotation>,
    enough: &'a AtomicBool,
    complete: bool,
    /// While it is being written.
    listing: Option<Listing>,
}

#[derive(Default)]
struct Tables {
    rows: Option<ParquetTable>,
    lamps: Option<ParquetTable>,
    obstacles: Option<ParquetTable>,
}

/// One camera of the run.
struct Camera {
    name: String,
    source: Source,
    /// Place among the views of its source.
    view: usize,
    wanted: bool,
    /// Of a wayside device, where it stands.
    place: Option<Place>,
    /// Frames taken that are wanted.
    taken: u32,
    /// Those of them whose images have come.
    written: u32,
    /// No more are wanted.
    over: bool,
    /// The last frame, whose flow is still to come.
    last: Option<LastFrame>,
}

/// A frame that has been taken, until its images come.
#[derive(Clone)]
struct ExposedFrame {
    source: Source,
    number: u32,
    job: Arc<Job>,
    owners: Arc<[(BodyOwner, String)]>,
    train: Option<TrainPoint>,
}

impl<'a> DataSet<'a> {
    /// Into a folder. `renderer` is for clean and raw pictures; `enough` is set when all frames of
    /// the plan have been taken.
    pub fn new(
        out: &Path,
        scenario: &'a Scenario,
        plan: FramePlan,
        provenance: Provenance,
        renderer: Box<dyn Renderer>,
        enough: &'a AtomicBool,
    ) -> Self {
        let scene = session::scene(scenario);
        let periods = scene.lamps.iter().map(|lamp| lamp.waveform.period_s());
        Self {
            out: out.to_owned(),
            plan,
            scenario,
            provenance,
            renderer,
            period_s: periods.fold(0.0, f64::max),
            labeller: Labeller::new(&scene),
            cameras: Vec::new(),
            waiting: Vec::new(),
            tables: Tables::default(),
            frames: Vec::new(),
            images: Vec::new(),
            annotations: Vec::new(),
            enough,
            complete: false,
            listing: None,
        }
    }

    /// Claims the folder. An earlier data set there is removed by `force`, and nothing else ever
    /// is; without it, what is there is left alone, unless it is the beginning of this same set.
    pub fn claim(&self, force: bool) -> Result<(), FolderError> {
        folder::claim(&self.out, &self.meta(false), force)
    }

    /// All frames of the plan have been taken, before the scenario's end.
    pub fn is_complete(&self) -> bool {
        self.complete
    }

    /// Frames so far.
    pub fn frames(&self) -> usize {
        self.frames.len()
    }

    /// Names of the cameras of which a scenario takes images, in the order of their numbers.
    pub fn cameras_of(scenario: &Scenario) -> Vec<String> {
        let bench = scenario.file.bench.is_some();
        let rides = bench || !scenario.physics.trains.is_empty();
        let rig = scenario
            .rig()
            .into_iter()
            .filter(|_| rides)
            .flat_map(|_| EYES);
        let devices = scenario.wayside.iter().filter(|_| !bench);
        let devices = devices.map(|w| w.calibration.name.clone());
        rig.map(str::to_owned).chain(devices).collect()
    }

    fn table(
        &self,
        label: LabelKind,
        name: &str,
        columns: &[Column],
    ) -> Result<Option<ParquetTable>> {
        let wanted = self.plan.has(label);
        wanted
            .then(|| ParquetTable::create(self.out.join(name), columns))
            .transpose()
    }

    /// Keeps a frame if it is wanted of any camera.
    fn expose(&mut self, exposure: &Exposure<'_>) {
        let Some(start) = exposure.job.views.first().map(|view| view.start.secs()) else {
            return;
        };
        let mut wanted = false;
        for camera in self
            .cameras
            .iter_mut()
            .filter(|c| c.source == exposure.source)
        {
            if camera.wanted && self.plan.takes(exposure.number, start, camera.taken) {
                camera.taken += 1;
                wanted = true;
            }
            camera.over |= self.plan.is_over(start, camera.taken);
        }
        if wanted {
            self.waiting.push(ExposedFrame {
                source: exposure.source,
                number: exposure.number,
                job: Arc::new(exposure.job.clone()),
                owners: obstacles::kept(exposure.owners).into(),
                train: exposure.train,
            });
        }
    }

    /// Takes the frame of these images, if it is wanted. Frames before it whose images have not come
    /// are lost.
    fn images(&mut self, source: Source, number: u32, images: &[&GrayImage]) -> Result {
        let is_lost = |f: &ExposedFrame| f.source == source && f.number < number;
        self.waiting.retain(|frame| !is_lost(frame));
        let is_own = |f: &ExposedFrame| f.source == source && f.number == number;
        match self.waiting.iter().position(is_own) {
            Some(k) => {
                let frame = self.waiting.remove(k);
                self.take(&frame, images)
            }
            None => Ok(()),
        }
    }

    /// Ends the run once all images that are wanted have come.
    fn end_if_complete(&mut self) {
        if self.waiting.is_empty() && self.cameras.iter().all(|c| c.over || !c.wanted) {
            self.complete = true;
            self.enough.store(true, Ordering::Relaxed);
        }
    }

    fn write(&self, name: &str, text: &str) -> Result {
        let path = self.out.join(name);
        write_whole(&path, text.as_bytes()).map_err(broken(&path))
    }

    fn write_json(&self, name: &str, value: &serde_json::Value) -> Result {
        let text = serde_json::to_string_pretty(value).map_err(failed("writing JSON"))?;
        self.write(name, &format!("{text}\n"))
    }

    /// Lists files before they are written.
    fn announce(&mut self, names: impl IntoIterator<Item = String>) -> Result {
        let listing = self.listing.as_mut();
        let listed = listing.map_or(Ok(()), |listing| listing.announce(names));
        listed.map_err(failed("listing the files of the data set"))
    }

    /// Lists and writes what the set has from its beginning: that it is not finished, and from what it
    /// is made.
    fn begin(&mut self) -> Result {
        let doing = || failed("beginning the data set");
        fs::create_dir_all(&self.out).map_err(doing())?;
        self.listing = Some(Listing::open(&self.out, folder::COMMAND).map_err(doing())?);
        let inputs = self.provenance.inputs.clone();
        let copies = inputs.iter().flat_map(|i| i.copies(Path::new(INPUTS)));
        let copies = copies.map(|path| path.to_string_lossy().into_owned());
        let own = FILES.iter().filter(|name| self.has_file(name));
        let names: Vec<_> = own.map(|name| (*name).to_owned()).chain(copies).collect();
        self.announce(names)?;
        self.write_json("meta.json", &self.meta(false))?;
        let copied = inputs.map_or(Ok(()), |i| i.copy_to(&self.out.join(INPUTS), write_whole));
        copied.map_err(failed("copying the inputs"))
    }

    /// Whether one of [`FILES`] will be in the set.
    fn has_file(&self, name: &str) -> bool {
        match name {
            "rows.parquet" => self.plan.has(LabelKind::Rows),
            "lamps.parquet" => self.plan.has(LabelKind::Lamps),
            "obstacles.parquet" | "coco.json" => self.plan.has(LabelKind::Obstacles),
            _ => true,
        }
    }

    /// The scenario as it was run, by itself: with all changes, and with the paths of its inputs' copies.
    fn scenario_text(&self) -> Result<String> {
        let mut file = self.scenario.file.clone();
        if let Some(inputs) = &self.provenance.inputs {
            inputs.rename(&mut file, Path::new(INPUTS));
        }
        let head = format!(
            "# {}, seed {}, as it was run: every key stands here, with what it means.\n\n",
            file.name, file.seed
        );
        let text = complete(&file).map_err(failed("writing scenario.toml"))?;
        Ok(head + &text)
    }

    fn meta(&self, finished: bool) -> serde_json::Value {
        let scenario = self.scenario;
        let cameras = self.cameras.iter();
        let cameras = cameras.map(|c| json!({"name": c.name, "frames": c.written}));
        let finite = |s: f64| s.is_finite().then_some(s);
        json!({
            "format": folder::FORMAT,
            "format_version": 2,
            // Not while it is being made, nor after a kill.
            "finished": finished,
            "metrotwin": env!("CARGO_PKG_VERSION"),
            "scenario": scenario.file.name,
            "description": scenario.file.description,
            "seed": scenario.file.seed,
            "overrides": self.provenance.overrides,
            // Of the scenario as checked, with all that it names.
            "inputs_sha256": sha256(format!("{scenario:?}").as_bytes()),
            "renderer": self.renderer.backend(),
            "frames": self.frames.len(),
            "cameras": cameras.collect::<Vec<_>>(),
            "plan": {
                "every": self.plan.every,
                "from_s": self.plan.from_s,
                "to_s": finite(self.plan.to_s),
                "limit": self.plan.limit,
                "cameras": self.plan.cameras,
                "labels": self.plan.labels.0,
            },
        })
    }
}

/// The rig that images are kept of.
const RIG: Source = Source::Rig(TrainId(0));

const EYES: [&str; 2] = ["left", "right"];

impl Observer for DataSet<'_> {
    fn open(&mut self, opening: &Opening<'_>) -> Result {
        self.begin()?;
        let camera = |name: &str, source, view, place| Camera {
            name: name.to_owned(),
            source,
            view,
            wanted: self.plan.has_camera(name),
            place,
            taken: 0,
            written: 0,
            over: false,
            last: None,
        };
        let rig = opening.first().and_then(|train| train.rig);
        let eyes = rig.iter().flat_map(|_| EYES.iter().enumerate());
        let eyes = eyes.map(|(k, name)| camera(name, RIG, k, None));
        let devices = opening.wayside.iter().enumerate();
        let devices = devices.map(|(k, d)| {
            camera(
                &d.name,
                Source::Wayside(k),
                0,
                Some(Place {
                    track: d.track,
                    s_m: d.chainage_m,
                }),
            )
        });
        self.cameras = eyes.chain(devices).collect();
        for camera in self.cameras.iter().filter(|c| c.wanted) {
            for folder in FOLDERS {
                let label = folder.parse::<LabelKinds>();
                if folder == "images" || label.is_ok_and(|l| l.0.is_subset(&self.plan.labels.0)) {
                    let folder = self.out.join(folder).join(super::slug(&camera.name));
                    fs::create_dir_all(folder).map_err(failed("making a folder"))?;
                }
            }
        }
        self.tables = Tables {
            rows: self.table(LabelKind::Rows, "rows.parquet", ImageRow::COLUMNS)?,
            lamps: self.table(LabelKind::Lamps, "lamps.parquet", LampRow::COLUMNS)?,
            obstacles: self.table(
                LabelKind::Obstacles,
                "obstacles.parquet",
                ObstacleRow::COLUMNS,
            )?,
        };
        Ok(())
    }

    fn observe(&mut self, event: &Event<'_>) -> Result {
        match *event {
            Event::Exposure(exposure) => self.expose(exposure),
            Event::Pair {
                train: TrainId(0),
                pair,
                ..
            } => {
                let images = [&pair.left.image, &pair.right.image];
                self.images(RIG, pair.left.number, &images)?;
            }
            Event::Wayside { post, frame, .. } => {
                self.images(Source::Wayside(post), frame.number, &[&frame.image])?;
            }
            _ => return Ok(()),
        }
        self.end_if_complete();
        Ok(())
    }

    /// Also of a run that was broken off: what has been taken is a whole, smaller set.
    fn close(&mut self) -> Result {
        let Tables {
            rows,
            lamps,
            obstacles,
        } = std::mem::take(&mut self.tables);
        for table in [rows, lamps, obstacles].into_iter().flatten() {
            table.close()?;
        }
        let mut frames = ParquetTable::create(self.out.join("frames.parquet"), FrameRow::COLUMNS)?;
        for row in &self.frames {
            frames.push(row)?;
        }
        frames.close()?;
        let meta = self.meta(true);
        if self.plan.has(LabelKind::Obstacles) {
            let set = coco::document(&self.scenario.file.name, &self.images, &self.annotations);
            self.write_json("coco.json", &set)?;
        }
        let text =
            readme::of(&self.plan, &meta, self.period_s).map_err(failed("writing README.md"))?;
        self.write("README.md", &text)?;
        self.write("scenario.toml", &self.scenario_text()?)?;
        let listing = self.listing.take().map_or(Ok(()), Listing::close);
        listing.map_err(failed("listing the files of the data set"))?;
        // The last one: it says that all others are whole.
        self.write_json("meta.json", &meta)
    }
}
