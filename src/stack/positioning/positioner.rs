//! The `paper` positioning and its baseline `mono`, from samples to fixes.

use super::lamp_presence::LampPresence;
use super::naming::{Expected, Followed, Naming, PairReading, Verdict};
use super::reckoning::DeadReckoning;
use super::sighting::{Measurement, PairLamps, Sighting};
use super::smear::LampSmear;
use crate::bus::{
    CameraFault, CameraHealth, CameraModel, Frame, Identity, ImuSample, LedReport, Method,
    OdometerSample, PositionFix, RigCalibration, SimTime, StereoPair,
};
use crate::stack::camera_watch::CameraWatch;
use crate::stack::led::{ChipVotes, LampFinder, LampImage, LedSettings};
use crate::track::Track;
use crate::track::uid::Uid;
use image::GrayImage;
use nalgebra::{Isometry3, Point3, Vector3};
use std::sync::Arc;

/// Positions the train from stereo pairs of a lamp, as it would on board: raw images, odometer
/// and inertial samples, the rig's calibration and the surveyed map are all that it gets. It
/// takes the rig's cab to look up the line; the train may run backwards.
#[derive(Debug)]
pub struct LedPositioner {
    settings: LedSettings,
    rig: RigCalibration,
    map: Arc<Track>,
    /// One an eye, left and right.
    watches: [CameraWatch; 2],
    /// One an eye, left and right.
    finders: [LampFinder; 2],
    reckoning: DeadReckoning,
    naming: Naming,
    lamp_presence: LampPresence,
    followed: Vec<Followed>,
    epoch: Option<SimTime>,
    alone: ChipVotes,
}

/// What is read of an eye's frame.
#[derive(Clone, Copy)]
struct EyeView<'a> {
    number: u32,
    start: SimTime,
    health: CameraHealth,
    /// `None` where the eye shows a fault.
    image: Option<&'a GrayImage>,
}

impl<'a> EyeView<'a> {
    fn new(frame: &'a Frame, health: CameraHealth) -> Self {
        Self {
            number: frame.number,
            start: frame.start,
            health,
            image: health.is_good().then_some(&frame.image),
        }
    }
}

/// No camera on a train exposes for as long as this.
const MOST_EXPOSURE_S: f64 = 1.0;

impl LedPositioner {
    /// For one rig on one line.
    pub fn new(settings: &LedSettings, rig: RigCalibration, map: Arc<Track>) -> Self {
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
        let [left, right] = self.look_after(pair);
        let left = EyeView::new(&pair.left, left);
        let right = EyeView::new(&pair.right, right);
        if left.image.is_none() && right.image.is_some() {
            self.read_right(left, right)
        } else {
            self.read_pair([left, right])
        }
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
    fn read_right(&mut self, left: EyeView<'_>, right: EyeView<'_>) -> LedReport {
        let rig = self.rig;
        self.rig.left = rig.right;
        self.rig.vehicle_from_left = rig.vehicle_from_left * rig.left_from_right;
        self.finders.swap(0, 1);
        let mut report = self.read_pair([right, left]);
        self.rig = rig;
        self.finders.swap(0, 1);
        report.eyes.reverse();
        std::mem::swap(&mut report.left, &mut report.right);
        for fix in &mut report.fixes {
            let lamp = rig.left_from_right * Point3::from(fix.lamp_in_camera);
            fix.lamp_in_camera = lamp.coords;
        }
        report
    }

    fn read_pair(&mut self, views: [EyeView<'_>; 2]) -> LedReport {
        let starts = views.map(|view| view.start);
        let seconds = starts[0].since(*self.epoch.get_or_insert(starts[0]));
        let mut lamps = self.find(views);
        self.followed
            .retain(|f| seconds - f.seen_s <= self.settings.forget_s);
        let (mut stereo, mut mono) = (None, None);
        for k in 0..lamps.left.len() {
            let mut sighting = self.measurement().sight(starts, &lamps, k);
            sighting.named = self.name(views, &sighting, seconds, &lamps);
            lamps.left[k].spot.uid = sighting.named;
            if let Some(r) = sighting.right {
                lamps.right[r].spot.uid = sighting.named;
            }
            if self.gives(Method::Stereo) {
                let fix = self.measurement().stereo_fix(&sighting, &lamps);
                keep_surer(&mut stereo, fix);
            }
            if self.gives(Method::Mono) {
                let fix = self.measurement().mono_fix(&sighting, &lamps);
                keep_surer(&mut mono, fix);
            }
        }
        let best = self.best_method(views.iter().any(|view| view.image.is_none()));
        let best_fix = match best {
            Method::Stereo => &stereo,
            Method::Mono => &mono,
        };
        if let Some(fix) = best_fix {
            self.reckoning.on_fix(fix.time, fix.chainage_m);
        }
        let fixes = stereo.into_iter().chain(mono).collect();
        let spots = |lamps: &[LampImage]| lamps.iter().map(|l| l.spot.clone()).collect();
        LedReport {
            time: starts[0],
            number: views[0].number,
            eyes: views.map(|view| view.health),
            best,
            dark: self.dark_lamps(views[0], &lamps.left),
            left: spots(&lamps.left),
            right: spots(&lamps.right),
            fixes,
        }
    }

    fn measurement(&self) -> Measurement<'_> {
        Measurement {
            settings: &self.settings,
            rig: &self.rig,
            map: &self.map,
            reckoning: &self.reckoning,
        }
    }

    /// Lamps that have gone out of the left eye's sight without ever having been in it.
    fn dark_lamps(&mut self, view: EyeView<'_>, left: &[LampImage]) -> Vec<Uid> {
        let camera = self.rig.left;
        let middle = 0.5 * f64::from(camera.intrinsics.height_px);
        let time = camera.shutter.row_mid(view.start, middle);
        let Some(chainage_m) = self
            .reckoning
            .chainage_m(time)
            .filter(|_| view.image.is_some())
        else {
            self.lamp_presence.forget();
            return Vec::new();
        };
        let eye = self.reckoning.vehicle(time, chainage_m) * self.rig.vehicle_from_left;
        let spots = left.iter().map(|lamp| lamp.spot.centre);
        (self.lamp_presence).check(&self.map, &camera.intrinsics, &eye, spots)
    }

    /// Finds the lamps of both eyes' images.
    fn find(&mut self, [left, right]: [EyeView<'_>; 2]) -> PairLamps {
        let start = left.start;
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
        let of_left = smear(&self.rig.left, vehicle_from_left);
        let of_right = smear(&self.rig.right, from_right);
        let find = |finder: &mut LampFinder, view: EyeView<'_>, smear: LampSmear<'_>| {
            view.image.map_or_else(Vec::new, |image| {
                finder.find(image, |p| smear.along_row_px(p))
            })
        };
        let [left_finder, right_finder] = &mut self.finders;
        PairLamps {
            left: find(left_finder, left, of_left),
            right: find(right_finder, right, of_right),
        }
    }

    /// Follows the lamp, reads its stripes, and names it.
    fn name(
        &mut self,
        views: [EyeView<'_>; 2],
        sighting: &Sighting,
        seconds: f64,
        lamps: &PairLamps,
    ) -> Option<(Uid, Identity)> {
        let lamp = sighting.lamp_in_camera()?;
        let lamp_m = (self.rig.vehicle_from_left * Point3::from(lamp)).coords;
        let distance_m = self.reckoning.distance_m(sighting.time);
        let k = self.follow(lamp_m, distance_m, seconds);
        let reading = self.read(views, sighting, seconds, k, lamps);
        let sigma_m = self.measurement().place_sigma_m(sighting, lamps)?;
        let expected = self.expect(sighting.time, &lamp_m, sigma_m);
        let followed = &mut self.followed[k];
        match (self.naming).judge(followed, reading, expected, &self.map) {
            Verdict::Named(uid, identity) => Some((uid, identity)),
            Verdict::Moved(uid, identity) => {
                self.reckoning.forget_fix();
                Some((uid, identity))
            }
            Verdict::Unknown => None,
        }
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
        views: [EyeView<'_>; 2],
        sighting: &Sighting,
        seconds: f64,
        k: usize,
        lamps: &PairLamps,
    ) -> PairReading {
        let lamp = &lamps.left[sighting.left];
        let right = sighting.right.map(|r| &lamps.right[r]);
        let (eye, lamp) = match right.filter(|right| !right.spot.cut) {
            Some(right) if lamp.spot.cut => (1, right),
            _ => (0, lamp),
        };
        let view = views[eye];
        let reading = (view.image).and_then(|image| self.finders[eye].read(image, lamp));
        let Some(reading) = reading else {
            return PairReading::Nothing;
        };
        let seconds = seconds + view.start.since(views[0].start);
        self.followed[k].votes.add(seconds, &reading);
        self.alone.clear();
        self.alone.add(seconds, &reading);
        let chips = reading.chips.iter().flatten().count() as u32;
        (self.alone.decode()).map_or(PairReading::Chips(chips), PairReading::Name)
    }

    /// Where this lamp must be, from where the train takes itself to be.
    fn expect(&self, time: SimTime, lamp_m: &Vector3<f64>, sigma_m: f64) -> Option<Expected> {
        let chainage_m = self.reckoning.chainage_m(time)?;
        let vehicle = self.reckoning.vehicle(time, chainage_m);
        Some(Expected {
            lamp: vehicle * Point3::from(*lamp_m),
            sigma_m,
            eye: vehicle * Point3::from(self.rig.vehicle_from_left.translation.vector),
        })
    }
}

/// Keeps the fix with the smaller sigma.
fn keep_surer(best: &mut Option<PositionFix>, fix: Option<PositionFix>) {
    let surer = |fix: &PositionFix| best.as_ref().is_none_or(|b| fix.sigma_m < b.sigma_m);
    if let Some(fix) = fix.filter(surer) {
        *best = Some(fix);
    }
}
