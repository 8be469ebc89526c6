//! Obstacle detection in a wayside box: camera frames and lidar scans in, a report a frame and
//! messages to the trains out.
//!
//! ```
//! use metrotwin::bus::{CameraModel, Frame, Intrinsics, Shutter, SimTime, WaysideCalibration};
//! use metrotwin::stack::wayside::{WaysideDetector, WaysideSettings};
//! # use metrotwin::track::{Alignment, Grade, PlanElement, Track, TrackId};
//! # use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion};
//! # let straight = PlanElement { length_m: 400.0, start_per_m: 0.0, end_per_m: 0.0,
//! #     start_cant_m: 0.0, end_cant_m: 0.0 };
//! # let map = std::sync::Arc::new(Track::bare("t",
//! #     Alignment::new(Point3::origin(), 0.0, &[straight], &[])));
//! // On the left wall at chainage 200 m, 2.5 m up, looking down the line at approaching trains.
//! let axes = Matrix3::new(0.0, 0.1, -1.0, 1.0, 0.0, 0.0, 0.0, -1.0, -0.1);
//! let calibration = WaysideCalibration {
//!     name: "W1".into(),
//!     camera: CameraModel {
//!         intrinsics: Intrinsics::centred(640, 360, 367.0),
//!         shutter: Shutter { line_time_s: 14.8e-6, exposure_s: 8e-3, first_row: 0 },
//!         blur_px: 0.5,
//!     },
//!     world_from_camera: Isometry3::from_parts(
//!         Translation3::new(200.0, 2.5, 2.5),
//!         UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(&axes)),
//!     ),
//!     world_from_lidar: None,
//!     track: TrackId::default(),
//!     chainage_m: 200.0,
//!     balise_chainage_m: 0.0,
//! };
//! // These images have no noise: a real camera that repeats one has got stuck.
//! let settings = WaysideSettings {
//!     reference_frames: 2,
//!     allow_repeated_images: true,
//!     ..Default::default()
//! };
//! let mut detector = WaysideDetector::new(&settings, calibration, map);
//! // Without anything to see on it, the bed might lie behind mist.
//! let bed = |u, _| image::Luma([if u % 16 < 8 { 70 } else { 110 }]);
//! let mut image = image::GrayImage::from_fn(640, 360, bed);
//! let report = |detector: &mut WaysideDetector, number: u32, image: &image::GrayImage| {
//!     let start = SimTime::from_secs(f64::from(number) * 0.1);
//!     let (exposure_s, gain_db) = (8e-3, 0.0);
//!     detector.on_frame(&Frame { number, start, exposure_s, gain_db, image: image.clone() }, None, &[])
//! };
//! assert!(report(&mut detector, 0, &image).learning);
//! assert!(report(&mut detector, 1, &image).passage_possible);
//! // Something dark lies on the track from now on; the third frame confirms it.
//! for (u, v) in (250..270).flat_map(|u| (190..210).map(move |v| (u, v))) {
//!     image.put_pixel(u, v, image::Luma([30]));
//! }
//! assert!(report(&mut detector, 2, &image).obstacles.is_empty());
//! assert!(report(&mut detector, 3, &image).obstacles.is_empty());
//! assert_eq!(report(&mut detector, 4, &image).obstacles.len(), 1);
//! ```
//!
//! # Method
//!
//! The baseline of Xiao, Xu and Yu, "Research on Obstacle Detection and Train Control Technology
//! for Urban Rail Transit", Journal of Ordnance Equipment Engineering 41(10), 2020, 161-165:
//! difference to a reference image of the clear track, |id| >= T, connected regions, comparison
//! with stored knowledge of the structure gauge. One file a stage:
//!
//! | file | stage |
//! |---|---|
//! | `reference` | the reference image, learnt from the first frames and held |
//! | `difference` | difference, threshold, 3x3 median; compensation of headlights |
//! | `rails` | rail heads, which mirror any light |
//! | `shadows` | shadows, which are no bodies: the texture of the floor shows in them |
//! | `bed` | whether the light lets the bed be seen, and where it is seen to be clear |
//! | `veil` | how much of the bed's light comes through mist, by range |
//! | `regions` | connected regions |
//! | `sight` | where a line of sight meets gauge and bed, from calibration and map |
//! | `place` | region to obstacle: place, width, height; fused with lidar echoes |
//! | `gauge` | danger level |
//! | `confirm` | k of n frames |
//! | [`distance`] | distance to the train, by the paper's formulas and exact |
//! | `vision` | is the camera alive, and what its death means |
//! | `announce` | messages |
//! | `equipment` | frames, sweeps and reports of trains in, warnings and heartbeats out |
//!
//! # The train itself
//!
//! It enters the view, and its headlights come before it. While a train is reported within
//! [`HEADLIGHT_M`] of the device, grey levels are compensated by the local gain (see
//! `difference`). Where the train is reported to be, and in the glare of its lamps ahead, lines of
//! sight that pass the gauge are blind: nothing is found by them, and what was confirmed there
//! stays confirmed until they see again. Elsewhere too an alarm ends only where the clear bed is seen,
//! and where the light shows too little of the bed the device is blind. Without reports of the train it
//! is an obstacle like any other.
//!
//! # What it does not do
//!
//! It finds nothing whose grey is within T of what is behind, nor anything smaller than the noise
//! filter lets through; it needs a clear track at the start; it takes a region's lowest edge for
//! its foot, so that something above the bed is placed too far away. What falls on the line less
//! than 100 m ahead of a train, in the light of its headlights, it does not see. Something dark on a
//! smooth floor, in or beside a shadow as dark, it finds three seconds late. What is brighter than a
//! rail's head and no wider it takes for a reflection; one in a wet bed it takes for an obstacle.

mod announce;
mod bed;
mod cells;
mod confirm;
mod difference;
pub mod distance;
mod equipment;
mod gauge;
mod place;
mod rails;
mod reference;
mod regions;
mod settings;
mod shadows;
mod sight;
#[cfg(test)]
mod test_scene;
#[cfg(test)]
mod tests;
mod veil;
mod vision;

pub use equipment::WaysideDetection;
pub use settings::WaysideSettings;

use crate::bus::{
    DangerLevel, DetectedObstacle, Frame, LidarScan, ObstacleWarning, PixelBox, Plan, SimTime,
    TrainReport, WaysideCalibration, WaysideReport,
};
use crate::track::Track;
use announce::Announcer;
use bed::{BedLight, ClearBed};
use cells::GaugeCells;
use confirm::Confirmation;
use difference::Difference;
use image::GrayImage;
use place::Placer;
use rails::RailHeads;
use reference::Reference;
use regions::regions;
use shadows::ShadowFilter;
use sight::Sight;
use std::sync::Arc;
use vision::Vision;

/// A train nearer than this to the device's view may light it.
pub const HEADLIGHT_M: f64 = 200.0;
/// A train's place is known to this; its halo reaches as far.
const TRAIN_MARGIN_M: f64 = 10.0;
/// So far ahead of its head a train's headlights (40,000 cd) light bed, rails and walkway edge
/// more than the lamps do, and more steeply than a local gain can follow: 4 lx at 100 m.
const GLARE_M: f64 = 100.0;

/// One wayside device.
#[derive(Clone, Debug)]
pub struct WaysideDetector {
    settings: WaysideSettings,
    sight: Sight,
    vision: Vision,
    cells: GaugeCells,
    rails: RailHeads,
    reference: Reference,
    difference: Difference,
    shadows: ShadowFilter,
    bed_light: BedLight,
    /// The reference is learnt, and showed the bed.
    bed_was_seen: bool,
    confirmation: Confirmation,
    announcer: Announcer,
    /// Of the last good frame.
    number: u32,
}

/// Reports of trains carried on to a time.
fn reckoned(trains: &[TrainReport], time: SimTime) -> Vec<TrainReport> {
    let on = |train: &TrainReport| {
        let run_m = train.speed_mps * time.since(train.time).max(0.0);
        TrainReport {
            chainage_m: train.chainage_m + train.direction.sign() * run_m,
            time,
            ..train.clone()
        }
    };
    trains.iter().map(on).collect()
}

impl WaysideDetector {
    /// A device as calibrated, on its line.
    pub fn new(
        settings: &WaysideSettings,
        calibration: WaysideCalibration,
        map: Arc<Track>,
    ) -> Self {
        let intrinsics = calibration.camera.intrinsics;
        let (width, height) = (intrinsics.width_px as usize, intrinsics.height_px as usize);
        let announcer = Announcer::new(&calibration);
        let sight = Sight::new(settings, calibration, map);
        Self {
            settings: settings.clone(),
            vision: Vision::new(settings, (intrinsics.width_px, intrinsics.height_px)),
            cells: GaugeCells::new(&sight, width, height),
            rails: RailHeads::new(&sight, width, height),
            bed_light: BedLight::new(&sight),
            bed_was_seen: false,
            sight,
            reference: Reference::new(settings, width * height),
            difference: Difference::new(settings, width, height),
            shadows: ShadowFilter::default(),
            confirmation: Confirmation::default(),
            announcer,
            number: 0,
        }
    }

    /// Looks at one frame; `scan` is a lidar sweep of about the same time, `trains` the last
    /// position reports of the trains of the line. A frame in which the camera shows a fault tells
    /// nothing: what was confirmed stays confirmed, and soon the device counts as blind.
    pub fn on_frame(
        &mut self,
        frame: &Frame,
        scan: Option<&LidarScan>,
        trains: &[TrainReport],
    ) -> WaysideReport {
        let width_px = self.sight.calibration().camera.intrinsics.width_px as usize;
        let grey = frame.image.as_raw().as_slice();
        let seen = WaysideReport {
            time: frame.start,
            number: frame.number,
            camera: self.vision.look(frame),
            ..WaysideReport::default()
        };
        let trains = reckoned(trains, frame.start);
        if !seen.camera.is_good() {
            self.vision.note(false, frame.start, &self.settings);
            return self.report(seen, &trains);
        }
        if !self.reference.ready() {
            self.learn(grey);
            if !self.reference.ready() {
                self.vision.note(true, frame.start, &self.settings);
                return self.report(seen, &trains);
            }
        }
        self.number = frame.number;
        let occupied_m: Vec<_> = trains.iter().map(|t| self.occupied_m(t)).collect();
        self.cells.occupy(&occupied_m);
        let train_near = trains.iter().any(|t| self.may_light(t));
        let places = (&self.cells, &self.rails);
        let headlights: Vec<_> = trains.iter().filter_map(|t| self.headlights(t)).collect();
        (self.difference).run(grey, &self.reference, places, train_near, &headlights);
        let compared = (&self.reference, &self.difference);
        let bed_sight = (self.bed_light).look(grey, compared, &self.cells, &self.settings);
        let sees = bed_sight.unseen_m <= self.settings.unseen_bed_m;
        self.bed_was_seen |= sees;
        self.vision.note(sees, frame.start, &self.settings);
        let binary = &mut self.difference.binary;
        if self.settings.reject_shadows {
            let images = (grey, self.reference.mean.as_slice());
            (self.shadows).reject(binary, width_px, images, &self.reference.noise);
        }
        let blobs = regions(binary, width_px, self.settings.min_area_px);
        let placer = Placer {
            settings: &self.settings,
            sight: &self.sight,
            binary,
            scan,
        };
        let found: Vec<_> = blobs.iter().filter_map(|b| placer.place(b)).collect();
        let bed = ClearBed {
            frame: grey,
            reference: &self.reference,
            width_px,
            threshold: self.settings.threshold_grey,
        };
        (self.confirmation).update(&found, &self.cells, &self.settings, |b| bed.shows_in(b));
        let seen = WaysideReport {
            bed: Some(bed_sight),
            blobs,
            ..seen
        };
        let mut report = self.report(seen, &trains);
        if self.settings.keep_images {
            let (w, h) = frame.image.dimensions();
            report.difference = GrayImage::from_raw(w, h, self.difference.absolute.clone());
            report.binary = GrayImage::from_raw(w, h, self.difference.binary.clone());
        }
        report
    }

    /// To be called at least some times a second: a camera that has fallen silent has no frames to
    /// tell of it. Gives a report where it has.
    pub fn on_time(&mut self, now: SimTime, trains: &[TrainReport]) -> Option<WaysideReport> {
        let seen = WaysideReport {
            time: now,
            number: self.number,
            camera: self.vision.wait(now, &self.settings)?,
            ..WaysideReport::default()
        };
        Some(self.report(seen, &reckoned(trains, now)))
    }

    /// The message that this report gives rise to, if any: on a change of danger, and when the
    /// device goes blind or sees again; again every `refresh_s` while either lasts; and a clear
    /// message (danger none) when it is over.
    pub fn message(&mut self, report: &WaysideReport) -> Option<ObstacleWarning> {
        let refresh_s = self.settings.refresh_s;
        (self.announcer).message(report, self.sight.watched_m(), refresh_s)
    }

    /// What a heartbeat says: the state of the last report; `None` before the reference is learnt.
    pub fn heartbeat(&self) -> Option<ObstacleWarning> {
        self.announcer.heartbeat()
    }

    fn learn(&mut self, grey: &[u8]) {
        self.reference.learn(grey, &self.settings);
        if self.reference.ready() {
            let width = self.sight.calibration().camera.intrinsics.width_px as usize;
            let cells = &self.cells;
            self.reference.restrict(width, |u, v| cells.in_gauge(u, v));
            self.difference.set_reference(&self.reference);
            self.bed_light.set_reference(&self.reference, width);
        }
    }

    /// What a train covers and dazzles: from its tail to where its glare ends.
    fn occupied_m(&self, train: &TrainReport) -> (f64, f64) {
        let sign = train.direction.sign();
        let tail_m = train.chainage_m - sign * (train.length_m + TRAIN_MARGIN_M);
        let glare_m = train.chainage_m + sign * GLARE_M;
        (tail_m.min(glare_m), tail_m.max(glare_m))
    }

    /// Where a train's headlights may be in the picture, mirrored in a wet bed too, with their halos; `None`
    /// of a train whose head is not before the camera, or too far away to dazzle.
    fn headlights(&self, train: &TrainReport) -> Option<PixelBox> {
        if !self.may_light(train) {
            return None;
        }
        let nearest_m = train.chainage_m + train.direction.sign() * TRAIN_MARGIN_M;
        let far = self.sight.lamps_box(train.chainage_m)?;
        let near = self.sight.lamps_box(nearest_m).unwrap_or(far);
        let both = far.joined(&near);
        let halo_px = (both.u1 - both.u0) / 2;
        Some(both.widened(halo_px, halo_px))
    }

    fn may_light(&self, train: &TrainReport) -> bool {
        let device = self.sight.calibration().chainage_m;
        let reach = self.settings.reach_m + HEADLIGHT_M;
        let tail_m = train.chainage_m - train.direction.sign() * train.length_m;
        train.chainage_m.max(tail_m) > device - reach
            && train.chainage_m.min(tail_m) < device + reach
    }

    /// The least distance of a train's head to an obstacle before it, by the paper's formula and
    /// exact.
    fn nearest_m(
        &self,
        trains: &[TrainReport],
        obstacles: &[DetectedObstacle],
    ) -> Option<(f64, f64)> {
        let dangerous = || (obstacles.iter()).filter(|o| o.danger != DangerLevel::None);
        let (map, calibration) = (self.sight.map(), self.sight.calibration());
        let pairs = trains.iter().flat_map(|t| dangerous().map(move |o| (t, o)));
        pairs
            .filter(|(t, o)| {
                let ahead_m = |s_m| t.direction.ahead_m(t.chainage_m, s_m);
                ahead_m(o.from_chainage_m).max(ahead_m(o.to_chainage_m)) >= 0.0
            })
            .map(|(t, o)| distance::train_distance_m(map, calibration, t, o))
            .min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// The report of what was seen and of what is confirmed.
    fn report(&self, seen: WaysideReport, trains: &[TrainReport]) -> WaysideReport {
        let obstacles: Vec<DetectedObstacle> = self.confirmation.confirmed().cloned().collect();
        let blind = self.vision.is_blind();
        let of_blindness = blind.then_some(self.settings.blind_danger);
        let found = obstacles.iter().map(|o| o.danger);
        let danger = found.chain(of_blindness).max().unwrap_or_default();
        let distances = self.nearest_m(trains, &obstacles);
        let learning = !self.bed_was_seen;
        WaysideReport {
            blind,
            learning,
            train_in_view: self.cells.any_blind(),
            obstacles,
            train_distance_m: distances.map(|d| d.0),
            train_distance_exact_m: distances.map(|d| d.1),
            train_affected: danger == DangerLevel::High,
            danger,
            passage_possible: !learning && !blind && danger != DangerLevel::High,
            emergency_needed: danger == DangerLevel::High,
            plan: match danger {
                DangerLevel::None => Plan::Pass,
                DangerLevel::Low => Plan::WarnDriver,
                DangerLevel::High => Plan::BrakeAutomatically,
            },
            ..seen
        }
    }
}
