//! The `paper` positioning and its baseline `mono`, from samples to fixes.

use super::LedSettings;
use super::naming::{Expected, Followed, Naming, Verdict};
use super::reckoning::Reckoning;
use super::roll_call::RollCall;
use super::stereo::{at_rest, from_size, triangulate};
use crate::bus::{
    CameraFault, CameraHealth, CameraModel, Frame, Identity, ImuSample, LedReport, Method,
    OdometerSample, PositionFix, RigCalibration, SimTime, StereoPair,
};
use crate::stack::camera_watch::CameraWatch;
use crate::stack::led::{ChipVotes, LampFinder, LampImage, StripeReading};
use crate::track::uid::Uid;
use crate::track::{LampSite, Tunnel};
use image::GrayImage;
use nalgebra::{Isometry3, Point2, Point3, Translation3, UnitQuaternion, Vector3};
use std::sync::Arc;

/// Positions the train from stereo pairs of a lamp, as it would on board: raw images, odometer
/// and inertial samples, the rig's calibration and the surveyed map are all that it gets. It
/// takes the train to run up the line.
#[derive(Debug)]
pub struct LedPositioner {
    settings: LedSettings,
    rig: RigCalibration,
    map: Arc<Tunnel>,
    watches: [CameraWatch; 2],
    finder: LampFinder,
    reckoning: Reckoning,
    naming: Naming,
    roll_call: RollCall,
    followed: Vec<Followed>,
    anchor: Option<Anchor>,
    epoch: Option<SimTime>,
    left: Vec<LampImage>,
    right: Vec<LampImage>,
    reading: StripeReading,
    alone: ChipVotes,
}

/// The last fix, to reckon on from.
#[derive(Clone, Copy, Debug)]
struct Anchor {
    time: SimTime,
    chainage_m: f64,
    distance_m: Option<f64>,
}

/// A lamp seen in a pair.
#[derive(Clone, Copy, Debug)]
struct Sighting {
    left: usize,
    right: Option<usize>,
    stereo: Option<Vector3<f64>>,
    mono: Option<Vector3<f64>>,
    time: SimTime,
    named: Option<(Uid, Identity)>,
}

impl Sighting {
    fn lamp_in_camera(&self) -> Option<Vector3<f64>> {
        self.stereo.or(self.mono)
    }
}

/// How well a lamp was measured by the rig.
#[derive(Clone, Copy, Debug)]
struct Spread {
    /// Standard deviation of its distance, as a share of it.
    distance: f64,
    /// Standard deviation of its image, pixels.
    image_px: f64,
}

impl LedPositioner {
    /// For one rig on one line.
    pub fn new(settings: &LedSettings, rig: RigCalibration, map: Arc<Tunnel>) -> Self {
        let finder = LampFinder::new(settings, &rig.camera, &map.lamps);
        let watch = |eye: &CameraModel| {
            let size_px = (eye.intrinsics.width_px, eye.intrinsics.height_px);
            CameraWatch::new(size_px, settings.allow_repeated_images)
        };
        Self {
            watches: [watch(&rig.camera), watch(&rig.camera)],
            reckoning: Reckoning::new(settings),
            naming: Naming {
                gate_share: settings.gate_share,
                agreeing_reads: settings.agreeing_reads,
            },
            settings: settings.clone(),
            rig,
            map,
            alone: finder.votes(),
            finder,
            roll_call: RollCall::default(),
            followed: Vec::new(),
            anchor: None,
            epoch: None,
            left: Vec::new(),
            right: Vec::new(),
            reading: StripeReading::default(),
        }
    }

    /// Takes an inertial sample; samples come in order of time.
    pub fn on_imu(&mut self, sample: &ImuSample) {
        let chainage_m = self.chainage_m(sample.time);
        self.reckoning
            .on_imu(sample, &self.map.alignment, chainage_m);
    }

    /// Takes an odometer sample; samples come in order of time.
    pub fn on_odometer(&mut self, sample: &OdometerSample) {
        self.reckoning.on_odometer(sample);
    }

    /// Takes a pair of images, after the samples up to the end of its exposure. An eye that shows a
    /// fault is left out: then the other one measures alone.
    pub fn on_pair(&mut self, pair: &StereoPair) -> LedReport {
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
        report
    }

    /// Whether no pair has come for so long that there must be something wrong.
    pub fn is_silent(&self, now: SimTime) -> bool {
        let patience_s = self.settings.silent_after_s;
        self.watches.iter().all(|w| w.silence(now, patience_s))
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
        self.rig.vehicle_from_left = rig.vehicle_from_left * rig.left_from_right();
        let mut report = self.read_pair(&StereoPair {
            left: pair.right.clone(),
            right: without_image(&pair.right),
        });
        self.rig = rig;
        std::mem::swap(&mut report.left, &mut report.right);
        for fix in &mut report.fixes {
            let lamp = rig.left_from_right() * Point3::from(fix.lamp_in_camera);
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
        let smear = Smear {
            rig: self.rig,
            lamps: &self.map.lamps,
            head_m: self.chainage_m(start),
            travel_m: self.reckoning.speed_mps(start) * self.rig.camera.shutter.exposure_s,
        };
        self.finder
            .find(&pair.left.image, |p| smear.along_row_px(p), &mut left);
        self.finder
            .find(&pair.right.image, |p| smear.along_row_px(p), &mut right);
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
            keep_surer(&mut paper, self.paper_fix(&sighting, &left, &right));
            keep_surer(&mut mono, self.mono_fix(&sighting, &left));
        }
        // One eye alone has nothing better.
        let one_eyed = pair.right.image.is_empty();
        let best = if one_eyed { &mono } else { &paper };
        if let Some(fix) = best {
            self.anchor = Some(Anchor {
                time: fix.time,
                chainage_m: fix.chainage_m,
                distance_m: self.reckoning.distance_m(fix.time),
            });
        }
        let fixes = paper.into_iter().chain(mono).collect();
        let spots = |lamps: &[LampImage]| lamps.iter().map(|l| l.spot.clone()).collect();
        let report = LedReport {
            time: start,
            number: pair.left.number,
            eyes: [CameraHealth::default(); 2],
            dark: self.call_lamps(pair, &left),
            left: spots(&left),
            right: spots(&right),
            fixes,
        };
        (self.left, self.right) = (left, right);
        report
    }

    /// Lamps that have gone out of the left eye's sight without ever having been in it.
    fn call_lamps(&mut self, pair: &StereoPair, left: &[LampImage]) -> Vec<Uid> {
        let camera = self.rig.camera;
        let middle = 0.5 * f64::from(camera.intrinsics.height_px);
        let time = camera.shutter.row_mid(pair.left.start, middle);
        let Some(chainage_m) = self
            .chainage_m(time)
            .filter(|_| !pair.left.image.is_empty())
        else {
            self.roll_call.forget();
            return Vec::new();
        };
        let line = &self.map.alignment;
        let place = Translation3::from(line.at(chainage_m).origin);
        let attitude = self.reckoning.attitude(time, line, chainage_m);
        let eye = Isometry3::from_parts(place, attitude) * self.rig.vehicle_from_left;
        let spots = left.iter().map(|lamp| lamp.spot.centre);
        (self.roll_call).call(&self.map, &camera.intrinsics, &eye, spots)
    }

    /// Where the train takes itself to be at a time.
    fn chainage_m(&self, time: SimTime) -> Option<f64> {
        let anchor = self.anchor?;
        let ran = match (self.reckoning.distance_m(time), anchor.distance_m) {
            (Some(now), Some(then)) => now - then,
            _ => self.reckoning.speed_mps(time) * time.since(anchor.time),
        };
        Some(anchor.chainage_m + ran)
    }

    /// Finds the right eye's image of a lamp and where the lamp is.
    fn sight(
        &self,
        pair: &StereoPair,
        left: &[LampImage],
        right: &[LampImage],
        k: usize,
    ) -> Sighting {
        let lamp = &left[k].spot;
        let height = f64::from(lamp.bounds.v1 - lamp.bounds.v0 + 1);
        let miss = |r: &LampImage| (r.spot.centre.y - lamp.centre.y).abs();
        let fits = |r: &&(usize, &LampImage)| {
            miss(r.1) < 4.0 + 0.15 * height
                && triangulate(&self.rig, &lamp.centre, &r.1.spot.centre).is_some()
        };
        let partner = right
            .iter()
            .enumerate()
            .filter(|r| fits(&r))
            .min_by(|a, b| miss(a.1).total_cmp(&miss(b.1)));
        let shutter = &self.rig.camera.shutter;
        let time = shutter.row_mid(pair.left.start, lamp.centre.y);
        Sighting {
            left: k,
            right: partner.map(|r| r.0),
            stereo: partner.and_then(|r| triangulate(&self.rig, &lamp.centre, &r.1.spot.centre)),
            mono: self.by_size(&left[k], time),
            time,
            named: None,
        }
    }

    /// Where a lamp is by its size in one image.
    fn by_size(&self, lamp: &LampImage, time: SimTime) -> Option<Vector3<f64>> {
        let (camera, outline) = (&self.rig.camera, lamp.own_outline?);
        let diameter_m = self.map.lamps.first()?.diameter_m;
        let place = |e| from_size(&camera.intrinsics, &lamp.spot.centre, e, diameter_m);
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
        let distance_m = self.reckoning.distance_m(sighting.time).unwrap_or(0.0);
        let k = self.follow(lamp_m, distance_m, seconds);
        let decoded = self.read(pair, sighting, seconds, k, left, right);
        let expected = self.expect(sighting.time, &lamp_m);
        let verdict = self
            .naming
            .judge(&mut self.followed[k], decoded, expected, &self.map);
        sighting.named = match verdict {
            Verdict::Named(uid, identity) => Some((uid, identity)),
            Verdict::Moved(uid, identity) => {
                self.anchor = None;
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
        let votes = self.finder.votes();
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
        let (frame, lamp) = match sighting.right.filter(whole) {
            Some(r) if lamp.spot.cut => (&pair.right, &right[r]),
            _ => (&pair.left, lamp),
        };
        if !self.finder.read(&frame.image, lamp, &mut self.reading) {
            return None;
        }
        self.followed[k].votes.add(seconds, &self.reading);
        self.alone.clear();
        self.alone.add(seconds, &self.reading);
        self.alone.decode()
    }

    /// Chainage where this lamp must stand, from where the train takes itself to be.
    fn expect(&self, time: SimTime, lamp_m: &Vector3<f64>) -> Option<Expected> {
        let chainage_m = self.chainage_m(time)?;
        let line = &self.map.alignment;
        let turn = self.reckoning.attitude(time, line, chainage_m);
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
        let disparity_px = l.spot.centre.x - r.spot.centre.x;
        let baseline_mm = 1e3 * self.rig.baseline_m;
        let sigma_px = l.sigma_px.hypot(r.sigma_px);
        let vergence_px = self.vergence_sigma_px(r.spot.centre.x);
        let spread = Spread {
            distance: (sigma_px.hypot(vergence_px) / disparity_px)
                .hypot(self.settings.baseline_sigma_mm / baseline_mm),
            image_px: l.sigma_px,
        };
        self.fix(Method::Paper, sighting, stereo, spread)
    }

    /// What the right eye's yaw against the left makes of its u: u = cx + f tan(angle), so
    /// du = f (1 + tan^2) d(angle).
    fn vergence_sigma_px(&self, right_u_px: f64) -> f64 {
        let c = &self.rig.camera.intrinsics;
        let tan = (right_u_px - c.cx_px) / c.fx_px;
        c.fx_px * (1.0 + tan * tan) * self.settings.vergence_sigma_deg.to_radians()
    }

    fn mono_fix(&self, sighting: &Sighting, left: &[LampImage]) -> Option<PositionFix> {
        let lamp = &left[sighting.left];
        let spread = Spread {
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
        spread: Spread,
    ) -> Option<PositionFix> {
        let (uid, identity) = sighting.named?;
        let site = self.map.lamp(uid)?;
        let line = &self.map.alignment;
        let vehicle = self.rig.vehicle_from_left * Point3::from(lamp);
        let expected = self.chainage_m(sighting.time);
        let mut chainage_m = expected.unwrap_or(site.chainage_m - vehicle.x);
        let mut position = site.centre;
        // The attitude depends on the place, weakly: twice is enough.
        for _ in 0..2 {
            let turn = self.reckoning.attitude(sighting.time, line, chainage_m);
            position = site.centre - turn * vehicle.coords;
            chainage_m = line.track_from_world(&position, chainage_m).s_m;
        }
        let turn = self.reckoning.attitude(sighting.time, line, chainage_m);
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
        spread: Spread,
    ) -> f64 {
        let along = Vector3::new(heading_rad.cos(), heading_rad.sin(), 0.0);
        let world_from_camera = turn * self.rig.vehicle_from_left.rotation;
        let in_world = world_from_camera * lamp;
        let depth = world_from_camera * Vector3::new(0.0, 0.0, lamp.z);
        let turned_by = |arm: &Vector3<f64>, deg: f64| along.cross(arm).norm() * deg.to_radians();
        let s = &self.settings;
        let terms = [
            along.dot(&in_world) * spread.distance,
            spread.image_px * lamp.z / self.rig.camera.intrinsics.fx_px,
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

/// How far a lamp moves in the image while a row is exposed.
///
/// The paper has V cos(psi) f t / W for a lamp at lateral distance W: the speed across the axis
/// at depth W. Here the depth is that of the lamp's line along the pixel's own ray, which also
/// holds off the axis: du = V t f (x_x z - x z_x)/z^2 with (x_x, z_x) the running direction in
/// the camera's frame.
#[derive(Clone, Copy, Debug)]
struct Smear<'a> {
    rig: RigCalibration,
    lamps: &'a [LampSite],
    /// Where the train takes its head to be.
    head_m: Option<f64>,
    travel_m: f64,
}

impl Smear<'_> {
    fn along_row_px(&self, p: &Point2<f64>) -> f64 {
        let c = &self.rig.camera.intrinsics;
        let ray = c.ray(p.x, p.y);
        let turn = self.rig.vehicle_from_left.rotation;
        let in_vehicle = turn * ray;
        let left_m = self.lateral_m(&in_vehicle) - self.rig.vehicle_from_left.translation.y;
        let z = left_m / in_vehicle.y;
        if !(0.3..60.0).contains(&z) {
            return 0.0;
        }
        let running = turn.inverse() * Vector3::x();
        self.travel_m * c.fx_px * (running.x - ray.x * running.z) / z
    }

    /// Of the lamp that is expected nearest to a ray from the left eye; of the first lamp while
    /// the train does not know where it is. The track is taken as straight over the few metres.
    fn lateral_m(&self, ray: &Vector3<f64>) -> f64 {
        let eye = self.rig.vehicle_from_left.translation.vector;
        let off = |lamp: &LampSite, head_m: f64| {
            let ahead_m = lamp.chainage_m - head_m;
            ray.angle(&(Vector3::new(ahead_m, lamp.lateral_m, lamp.height_m) - eye))
        };
        let nearest = self.head_m.and_then(|head_m| {
            let near = |lamp: &&LampSite| (lamp.chainage_m - head_m).abs() < LAMPS_WITHIN_M;
            (self.lamps.iter().filter(near))
                .min_by(|a, b| off(a, head_m).total_cmp(&off(b, head_m)))
        });
        nearest.or(self.lamps.first()).map_or(0.0, |l| l.lateral_m)
    }
}

/// Farther off no lamp is large enough in the image to be found.
const LAMPS_WITHIN_M: f64 = 60.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stack::led::testing::{rig, tunnel};

    /// Lamps on the left wall and on a nearer pillar between them, on the other side of the line
    /// first: each pixel takes the lamp that is there, and without a position the first.
    #[test]
    fn smear_is_of_the_lamp_that_is_looked_at() {
        let mut lamps = tunnel("manchester").lamps;
        (lamps[0].lateral_m, lamps[4].lateral_m) = (-2.0, 1.8);
        let rig = rig();
        let at_px = |lamp: &LampSite, head_m: f64| {
            let seen = Point3::new(lamp.chainage_m - head_m, lamp.lateral_m, lamp.height_m);
            let pixel = (rig.camera.intrinsics).project(&(rig.vehicle_from_left.inverse() * seen));
            pixel.unwrap_or_else(Point2::origin)
        };
        let head_m = lamps[4].chainage_m - 2.0;
        let smear = |head_m| Smear {
            rig,
            lamps: &lamps,
            head_m,
            travel_m: 5e-4,
        };
        for lamp in &lamps[4..6] {
            let seen = at_px(lamp, head_m);
            let moved = at_px(lamp, head_m + 5e-4).x - seen.x;
            let said = smear(Some(head_m)).along_row_px(&seen);
            assert!((said + moved).abs() < 0.02 * moved.abs(), "{said} {moved}");
        }
        let seen = at_px(&lamps[4], head_m);
        assert!(smear(None).along_row_px(&seen).abs() < 1e-12);
    }
}
