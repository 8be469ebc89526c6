//! The `paper` positioning and its baseline `mono`, from samples to fixes.

use super::lamp_presence::LampPresence;
use super::naming::{Expected, Followed, Naming, Verdict};
use super::reckoning::DeadReckoning;
use super::smear::LampSmear;
use super::stereo::{Pairing, at_rest, from_size, pinhole, triangulate};
use crate::bus::{
    CameraFault, CameraHealth, CameraModel, Frame, Identity, ImuSample, Intrinsics, LedReport,
    Method, OdometerSample, PositionFix, RigCalibration, SimTime, StereoPair,
};
use crate::stack::camera_watch::CameraWatch;
use crate::stack::led::{ChipVotes, LampFinder, LampImage, LedSettings};
use crate::track::Tunnel;
use crate::track::uid::Uid;
use image::GrayImage;
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use std::sync::Arc;

/// Positions the train from stereo pairs of a lamp, as it would on board: raw images, odometer
/// and inertial samples, the rig's calibration and the surveyed map are all that it gets. It
/// takes the rig's cab to look up the line; the train may run backwards.
#[derive(Debug)]
pub struct LedPositioner {
    settings: LedSettings,
    rig: RigCalibration,
    map: Arc<Tunnel>,
    /// One an eye, left and right.
    watches: [CameraWatch; 2],
    /// One an eye, left and right.
    finders: [LampFinder; 2],
    reckoning: DeadReckoning,
    naming: Naming,
    lamp_presence: LampPresence,
    followed: Vec<Followed>,
    epoch: Option<SimTime>,
    left: Vec<LampImage>,
    right: Vec<LampImage>,
    alone: ChipVotes,
}

/// No camera on a train exposes for as long as this.
const MOST_EXPOSURE_S: f64 = 1.0;

/// A lamp seen in a pair.
#[derive(Clone, Copy, Debug)]
struct Sighting {
    left: usize,
    right: Option<usize>,
    stereo: Option<Pairing>,
    mono: Option<Vector3<f64>>,
    time: SimTime,
    named: Option<(Uid, Identity)>,
}

impl Sighting {
    fn lamp_in_camera(&self) -> Option<Vector3<f64>> {
        self.stereo.map(|s| s.lamp).or(self.mono)
    }
}

/// How well a lamp was measured by the rig.
#[derive(Clone, Copy, Debug)]
struct LampAccuracy {
    /// Standard deviation of its distance, as a share of it.
    distance: f64,
    /// Standard deviation of its image, pixels.
    image_px: f64,
}

impl LedPositioner {
    /// For one rig on one line.
    pub fn new(settings: &LedSettings, rig: RigCalibration, map: Arc<Tunnel>) -> Self {
        let finder = |eye: &CameraModel| LampFinder::new(settings, eye, &map.lamps);
        let finders = [finder(&rig.left), finder(&rig.right)];
        let watch = |eye: &CameraModel| {
            let size_px = (eye.intrinsics.width_px, eye.intrinsics.height_px);
            CameraWatch::new(size_px, settings.allow_repeated_images)
        };
        Self {
            watches: [watch(&rig.left), watch(&rig.right)],
            reckoning: DeadReckoning::new(settings, map.clone()),
            naming: Naming {
                gate_share: settings.gate_share,
                agreeing_reads: settings.agreeing_reads,
            },
            settings: settings.clone(),
            rig,
            map,
            alone: finders[0].votes(),
            finders,
            lamp_presence: LampPresence::default(),
            followed: Vec::new(),
            epoch: None,
            left: Vec::new(),
            right: Vec::new(),
        }
    }

    /// Takes an inertial sample; samples come in order of time.
    pub fn on_imu(&mut self, sample: &ImuSample) {
        self.reckoning.on_imu(sample);
    }

    /// Takes an odometer sample; samples come in order of time.
    pub fn on_odometer(&mut self, sample: &OdometerSample) {
        self.reckoning.on_odometer(sample);
    }

    /// Takes a pair of images, after the samples up to the end of its exposure. An eye that shows a
    /// fault is left out: then the other one measures alone.
    pub fn on_pair(&mut self, pair: &StereoPair) -> LedReport {
        self.expose(pair);
        let eyes = self.look_after(pair);
        let mut report = match eyes.map(|eye| eye.is_good()) {
            [true, true] => self.read_pair(pair),
            [true, false] => self.read_pair(&StereoPair {
                left: pair.left.clone(),
                right: without_image(&pair.right),
            }),
            [false, true] => self.read_right(pair),
            [false, false] => self.read_pair(&StereoPair {
                left: without_image(&pair.left),
                right: without_image(&pair.right),
            }),
        };
        report.eyes = eyes;
        report.best = self.best_method(eyes.iter().any(|eye| !eye.is_good()));
        report
    }

    fn gives(&self, method: Method) -> bool {
        self.settings.methods.contains(&method)
    }

    /// The method that a train should run by. One eye alone has nothing better than `mono`.
    fn best_method(&self, one_eyed: bool) -> Method {
        if one_eyed || !self.gives(Method::Stereo) {
            Method::Mono
        } else {
            Method::Stereo
        }
    }

    /// Whether no pair has come for so long that there must be something wrong.
    pub fn is_silent(&mut self, now: SimTime) -> bool {
        let limit_s = self.settings.silent_after_s;
        let [left, right] = self.watches.each_mut().map(|w| w.silence(now, limit_s));
        left && right
    }

    /// Rows are timed by the exposure that each eye says it had, which may differ from the sheet's. A
    /// frame that says none is taken to have the one before.
    fn expose(&mut self, pair: &StereoPair) {
        let eyes = [&mut self.rig.left, &mut self.rig.right];
        let frames = [&pair.left, &pair.right];
        for ((eye, finder), frame) in eyes.into_iter().zip(&mut self.finders).zip(frames) {
            if frame.exposure_s > 0.0 && frame.exposure_s < MOST_EXPOSURE_S {
                eye.shutter.exposure_s = frame.exposure_s;
                finder.expose(frame.exposure_s);
            }
        }
    }

    fn look_after(&mut self, pair: &StereoPair) -> [CameraHealth; 2] {
        let late = self.reckoning.has_forgotten(pair.left.start);
        let [left, right] = &mut self.watches;
        [left.look(&pair.left), right.look(&pair.right)].map(|eye| CameraHealth {
            fault: eye.fault.or(late.then_some(CameraFault::Late)),
            ..eye
        })
    }

    /// The right eye stands in for the left one.
    fn read_right(&mut self, pair: &StereoPair) -> LedReport {
        let rig = self.rig;
        self.rig.left = rig.right;
        self.rig.vehicle_from_left = rig.vehicle_from_left * rig.left_from_right;
        self.finders.swap(0, 1);
        let mut report = self.read_pair(&StereoPair {
            left: pair.right.clone(),
            right: without_image(&pair.right),
        });
        self.rig = rig;
        self.finders.swap(0, 1);
        std::mem::swap(&mut report.left, &mut report.right);
        for fix in &mut report.fixes {
            let lamp = rig.left_from_right * Point3::from(fix.lamp_in_camera);
            fix.lamp_in_camera = lamp.coords;
        }
        report
    }

    fn read_pair(&mut self, pair: &StereoPair) -> LedReport {
        let start = pair.left.start;
        let seconds = start.since(*self.epoch.get_or_insert(start));
        let (mut left, mut right) = (
            std::mem::take(&mut self.left),
            std::mem::take(&mut self.right),
        );
        self.find(pair, &mut left, &mut right);
        self.followed
            .retain(|f| seconds - f.seen_s <= self.settings.forget_s);
        let (mut paper, mut mono) = (None, None);
        for k in 0..left.len() {
            let mut sighting = self.sight(pair, &left, &right, k);
            self.name(pair, &mut sighting, seconds, &left, &right);
            left[k].spot.uid = sighting.named;
            if let Some(r) = sighting.right {
                right[r].spot.uid = sighting.named;
            }
            if self.gives(Method::Stereo) {
                keep_surer(&mut paper, self.paper_fix(&sighting, &left, &right));
            }
            if self.gives(Method::Mono) {
                keep_surer(&mut mono, self.mono_fix(&sighting, &left));
            }
        }
        let best = match self.best_method(pair.right.image.is_empty()) {
            Method::Stereo => &paper,
            Method::Mono => &mono,
        };
        if let Some(fix) = best {
            self.reckoning.on_fix(fix.time, fix.chainage_m);
        }
        let fixes = paper.into_iter().chain(mono).collect();
        let spots = |lamps: &[LampImage]| lamps.iter().map(|l| l.spot.clone()).collect();
        let report = LedReport {
            time: start,
            number: pair.left.number,
            eyes: [CameraHealth::default(); 2],
            best: Method::Stereo,
            dark: self.dark_lamps(pair, &left),
            left: spots(&left),
            right: spots(&right),
            fixes,
        };
        (self.left, self.right) = (left, right);
        report
    }

    /// Lamps that have gone out of the left eye's sight without ever having been in it.
    fn dark_lamps(&mut self, pair: &StereoPair, left: &[LampImage]) -> Vec<Uid> {
        let camera = self.rig.left;
        let middle = 0.5 * f64::from(camera.intrinsics.height_px);
        let time = camera.shutter.row_mid(pair.left.start, middle);
        let Some(chainage_m) = self
            .reckoning
            .chainage_m(time)
            .filter(|_| !pair.left.image.is_empty())
        else {
            self.lamp_presence.forget();
            return Vec::new();
        };
        let eye = self.reckoning.vehicle(time, chainage_m) * self.rig.vehicle_from_left;
        let spots = left.iter().map(|lamp| lamp.spot.centre);
        (self.lamp_presence).check(&self.map, &camera.intrinsics, &eye, spots)
    }

    /// Finds the lamps of both eyes' images.
    fn find(&mut self, pair: &StereoPair, left: &mut Vec<LampImage>, right: &mut Vec<LampImage>) {
        let start = pair.left.start;
        let reckoning = &self.reckoning;
        let (head_m, speed_mps) = (reckoning.chainage_m(start), reckoning.speed_mps(start));
        let vehicle_from_left = self.rig.vehicle_from_left;
        let smear = |eye: &CameraModel, vehicle_from_eye: Isometry3<f64>| LampSmear {
            lens: eye.intrinsics,
            vehicle_from_eye,
            lamps: &self.map.lamps,
            head_m,
            travel_m: speed_mps * eye.shutter.exposure_s,
        };
        let from_right = vehicle_from_left * self.rig.left_from_right;
        let smears = [
            smear(&self.rig.left, vehicle_from_left),
            smear(&self.rig.right, from_right),
        ];
        let [of_left, of_right] = &mut self.finders;
        *left = of_left.find(&pair.left.image, |p| smears[0].along_row_px(p));
        *right = of_right.find(&pair.right.image, |p| smears[1].along_row_px(p));
    }

    /// Finds the right eye's image of a lamp and where the lamp is.
    fn sight(
        &self,
        pair: &StereoPair,
        left: &[LampImage],
        right: &[LampImage],
        k: usize,
    ) -> Sighting {
        let lamp = &left[k];
        let height = f64::from(lamp.spot.bounds.v1 - lamp.spot.bounds.v0 + 1);
        let most = (4.0 + 0.15 * height) / self.rig.left.intrinsics.fy_px;
        let partner = right
            .iter()
            .enumerate()
            .filter_map(|(r, other)| Some((r, self.put_together(pair, lamp, other)?)))
            .filter(|(_, pairing)| pairing.miss < most)
            .min_by(|a, b| a.1.miss.total_cmp(&b.1.miss));
        let shutter = &self.rig.left.shutter;
        let time = shutter.row_mid(pair.left.start, lamp.spot.centre.y);
        Sighting {
            left: k,
            right: partner.map(|p| p.0),
            stereo: partner.map(|p| p.1),
            mono: self.by_size(lamp, time),
            time,
            named: None,
        }
    }

    /// Both eyes' images of a lamp, with what the train runs between their rows. The rows' times
    /// are taken from the images first, then, without their noise, from where the lamp is.
    fn put_together(
        &self,
        pair: &StereoPair,
        left: &LampImage,
        right: &LampImage,
    ) -> Option<Pairing> {
        let rig = &self.rig;
        let times = |left_row: f64, right_row: f64| {
            let left = rig.left.shutter.row_mid(pair.left.start, left_row);
            (left, rig.right.shutter.row_mid(pair.right.start, right_row))
        };
        let (l, r) = (
            sight(&rig.left.intrinsics, left),
            sight(&rig.right.intrinsics, right),
        );
        let at_rows = |(now, then)| {
            let left_from_right = self.left_from_right(now, then);
            Some((left_from_right, triangulate(&left_from_right, &l, &r)?))
        };
        let (left_from_right, rough) = at_rows(times(left.spot.centre.y, right.spot.centre.y))?;
        let lamp = Point3::from(rough.lamp);
        let left_row = rig.left.intrinsics.project(&lamp)?.y;
        let seen_right = left_from_right.inverse_transform_point(&lamp);
        let right_row = rig.right.intrinsics.project(&seen_right)?.y;
        Some(at_rows(times(left_row, right_row))?.1)
    }

    /// The right eye at one time in the frame of the left eye at another.
    fn left_from_right(&self, now: SimTime, then: SimTime) -> Isometry3<f64> {
        if now == then {
            return self.rig.left_from_right;
        }
        let mount = self.rig.vehicle_from_left;
        mount.inverse() * self.reckoning.moved(now, then) * mount * self.rig.left_from_right
    }

    /// Where a lamp is by its size in one image.
    fn by_size(&self, lamp: &LampImage, time: SimTime) -> Option<Vector3<f64>> {
        let (camera, outline) = (&self.rig.left, lamp.own_outline?);
        let diameter_m = self.map.lamps.first()?.diameter_m;
        let pinhole = pinhole(&camera.intrinsics);
        let place = |e| from_size(&pinhole, &lamp.centre, e, diameter_m);
        let run = Vector3::x() * self.reckoning.speed_mps(time);
        let velocity = -(self.rig.vehicle_from_left.rotation.inverse() * run);
        place(&at_rest(camera, &outline, &place(&outline)?, &velocity)?)
    }

    /// Follows the lamp, reads its stripes, and names it.
    fn name(
        &mut self,
        pair: &StereoPair,
        sighting: &mut Sighting,
        seconds: f64,
        left: &[LampImage],
        right: &[LampImage],
    ) {
        let Some(lamp) = sighting.lamp_in_camera() else {
            return;
        };
        let lamp_m = (self.rig.vehicle_from_left * Point3::from(lamp)).coords;
        let distance_m = self.reckoning.distance_m(sighting.time);
        let k = self.follow(lamp_m, distance_m, seconds);
        let decoded = self.read(pair, sighting, seconds, k, left, right);
        let expected = self.expect(sighting.time, &lamp_m);
        let verdict = self
            .naming
            .judge(&mut self.followed[k], decoded, expected, &self.map);
        sighting.named = match verdict {
            Verdict::Named(uid, identity) => Some((uid, identity)),
            Verdict::Moved(uid, identity) => {
                self.reckoning.forget_fix();
                Some((uid, identity))
            }
            Verdict::Unknown => None,
        };
    }

    /// Index of the followed lamp that this is.
    fn follow(&mut self, lamp_m: Vector3<f64>, distance_m: f64, seconds: f64) -> usize {
        let misses = self.followed.iter().enumerate().filter_map(|(k, f)| {
            // Two lamps of one pair are two lamps.
            let free = f.seen_s < seconds;
            Some((k, f.misses_by(&lamp_m, distance_m).filter(|_| free)?))
        });
        if let Some((k, _)) = misses.min_by(|a, b| a.1.total_cmp(&b.1)) {
            let f = &mut self.followed[k];
            (f.lamp_m, f.distance_m, f.seen_s) = (lamp_m, distance_m, seconds);
            return k;
        }
        let votes = self.finders[0].votes();
        self.followed
            .push(Followed::new(lamp_m, distance_m, seconds, votes));
        self.followed.len() - 1
    }

    /// Reads the left eye's stripes, or the right eye's where the left lamp is cut off.
    fn read(
        &mut self,
        pair: &StereoPair,
        sighting: &Sighting,
        seconds: f64,
        k: usize,
        left: &[LampImage],
        right: &[LampImage],
    ) -> Option<Uid> {
        let lamp = &left[sighting.left];
        let whole = |r: &usize| !right[*r].spot.cut;
        let (eye, frame, lamp) = match sighting.right.filter(whole) {
            Some(r) if lamp.spot.cut => (1, &pair.right, &right[r]),
            _ => (0, &pair.left, lamp),
        };
        let reading = self.finders[eye].read(&frame.image, lamp)?;
        let seconds = seconds + frame.start.since(pair.left.start);
        self.followed[k].votes.add(seconds, &reading);
        self.alone.clear();
        self.alone.add(seconds, &reading);
        self.alone.decode()
    }

    /// Chainage where this lamp must stand, from where the train takes itself to be.
    fn expect(&self, time: SimTime, lamp_m: &Vector3<f64>) -> Option<Expected> {
        let chainage_m = self.reckoning.chainage_m(time)?;
        let line = &self.map.alignment;
        let turn = self.reckoning.attitude(time, chainage_m);
        let lamp = line.at(chainage_m).origin + turn * lamp_m;
        Some(Expected {
            lamp_chainage_m: line.track_from_world(&lamp, chainage_m).s_m,
        })
    }

    fn paper_fix(
        &self,
        sighting: &Sighting,
        left: &[LampImage],
        right: &[LampImage],
    ) -> Option<PositionFix> {
        let (stereo, r) = (sighting.stereo?, sighting.right?);
        let (l, r) = (&left[sighting.left], &right[r]);
        let baseline_mm = 1e3 * self.rig.baseline_m();
        let focal_px = |eye: &CameraModel| eye.intrinsics.fx_px;
        let sigma = (l.sigma_px / focal_px(&self.rig.left))
            .hypot(r.sigma_px / focal_px(&self.rig.right))
            .hypot(self.vergence_sigma(stereo.right_x));
        let spread = LampAccuracy {
            distance: (sigma / stereo.disparity)
                .hypot(self.settings.baseline_sigma_mm / baseline_mm),
            image_px: l.sigma_px,
        };
        self.fix(Method::Stereo, sighting, stereo.lamp, spread)
    }

    /// What the right eye's yaw against the left makes of its x at depth 1: x = tan(angle), so
    /// dx = (1 + tan^2) d(angle).
    fn vergence_sigma(&self, right_x: f64) -> f64 {
        (1.0 + right_x * right_x) * self.settings.vergence_sigma_deg.to_radians()
    }

    fn mono_fix(&self, sighting: &Sighting, left: &[LampImage]) -> Option<PositionFix> {
        let lamp = &left[sighting.left];
        let spread = LampAccuracy {
            distance: lamp.axis_sigma_px / lamp.own_outline?.semi_major_px,
            image_px: lamp.sigma_px,
        };
        self.fix(Method::Mono, sighting, sighting.mono?, spread)
    }

    /// Train = lamp - R (lamp in the vehicle's frame).
    fn fix(
        &self,
        method: Method,
        sighting: &Sighting,
        lamp: Vector3<f64>,
        spread: LampAccuracy,
    ) -> Option<PositionFix> {
        let (uid, identity) = sighting.named?;
        let site = self.map.lamp(uid)?;
        let line = &self.map.alignment;
        let vehicle = self.rig.vehicle_from_left * Point3::from(lamp);
        let expected = self.reckoning.chainage_m(sighting.time);
        let mut chainage_m = expected.unwrap_or(site.chainage_m - vehicle.x);
        let mut position = site.centre;
        // The attitude depends on the place, weakly: twice is enough.
        for _ in 0..2 {
            let turn = self.reckoning.attitude(sighting.time, chainage_m);
            position = site.centre - turn * vehicle.coords;
            chainage_m = line.track_from_world(&position, chainage_m).s_m;
        }
        let turn = self.reckoning.attitude(sighting.time, chainage_m);
        let heading = line.at(chainage_m).heading_rad;
        let sigma_m = self.sigma_m(&lamp, &vehicle, &turn, heading, spread);
        (sigma_m <= self.settings.max_sigma_m).then_some(PositionFix {
            time: sighting.time,
            method,
            chainage_m,
            sigma_m,
            position,
            uid,
            identity,
            lamp_in_camera: lamp,
        })
    }

    /// One sigma along the track: of distance and bearing (`spread`: what the images scatter by and,
    /// of the rig's calibration, what enters the disparity), of the rest of the calibration (focal
    /// length, attitude of the mount; an error of the first scales depths alone, as x = (u - cx) b /
    /// d), of the car's attitude, and of the survey.
    fn sigma_m(
        &self,
        lamp: &Vector3<f64>,
        vehicle: &Point3<f64>,
        turn: &UnitQuaternion<f64>,
        heading_rad: f64,
        spread: LampAccuracy,
    ) -> f64 {
        let along = Vector3::new(heading_rad.cos(), heading_rad.sin(), 0.0);
        let world_from_camera = turn * self.rig.vehicle_from_left.rotation;
        let in_world = world_from_camera * lamp;
        let depth = world_from_camera * Vector3::new(0.0, 0.0, lamp.z);
        let turned_by = |arm: &Vector3<f64>, deg: f64| along.cross(arm).norm() * deg.to_radians();
        let s = &self.settings;
        let terms = [
            along.dot(&in_world) * spread.distance,
            spread.image_px * lamp.z / self.rig.left.intrinsics.fx_px,
            along.dot(&depth) * s.focal_sigma_share,
            turned_by(&in_world, s.mount_sigma_deg),
            turned_by(&(turn * vehicle.coords), s.attitude_sigma_deg),
            s.survey_sigma_m,
        ];
        terms.iter().map(|t| t * t).sum::<f64>().sqrt()
    }
}

/// The frame of an eye that has delivered nothing.
fn without_image(frame: &Frame) -> Frame {
    Frame {
        number: frame.number,
        start: frame.start,
        exposure_s: frame.exposure_s,
        gain_db: frame.gain_db,
        image: GrayImage::default(),
    }
}

/// Keeps the fix with the smaller sigma.
fn keep_surer(best: &mut Option<PositionFix>, fix: Option<PositionFix>) {
    let surer = |fix: &PositionFix| best.as_ref().is_none_or(|b| fix.sigma_m < b.sigma_m);
    if let Some(fix) = fix.filter(surer) {
        *best = Some(fix);
    }
}

/// Line of sight of a lamp's centre in an eye's frame, at depth 1.
fn sight(lens: &Intrinsics, lamp: &LampImage) -> Vector3<f64> {
    pinhole(lens).ray(lamp.centre.x, lamp.centre.y)
}
