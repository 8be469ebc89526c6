//! How one train and its equipment did, held against the truth.

use super::SessionError;
use super::health::Health;
use super::occupancy_score::{Judged, OccupancyScore};
use super::outcome::Outcome;
use super::positioning_score::PositioningScore;
use super::ride::Ride;
use super::summary::TrainSummary;
use crate::bus::{
    EYES, LedReport, Method, OccupancyReport, PositionFix, ProtectionReport, RigCalibration,
    SimTime, TrainEnd, TrainId,
};
use crate::scenario::{OnboardSettings, Scenario};
use crate::track::uid::Uid;
use crate::track::{LampSite, Track};
use crate::twin::physics::{TrainState, World};
use crate::twin::sensors::{RigSettings, SensorError, ever_sees};
use nalgebra::Isometry3;

/// Lamps farther beside the route stand on another track.
const OWN_LAMPS_M: f64 = 4.0;

/// The scores of one train.
pub struct TrainScore {
    id: TrainId,
    /// Its rig as it really is, and the end of the train that it is at.
    rig: Option<(RigCalibration, TrainEnd)>,
    positioning: Option<PositioningScore>,
    occupancy: Option<OccupancyScore>,
    outcome: Outcome,
    ride: Ride,
    dark_lamps: Vec<String>,
    stereo_frames: u32,
    /// Speed that its driver aims at.
    aim_mps: f64,
    /// How its cameras do, by what the equipment says.
    pub health: Health,
}

impl TrainScore {
    /// Before the first step.
    pub fn new(scenario: &Scenario, id: TrainId, onboard: Option<&OnboardSettings>) -> Self {
        let train = scenario.physics.trains.get(id.index());
        let rig = onboard.and_then(|onboard| onboard.rig.as_ref());
        let positioning = onboard.filter(|o| o.positions()).zip(rig);
        let positioning = positioning.map(|(onboard, rig)| {
            let seen = scenario.seen_from_rig(onboard);
            let way = seen.unwrap_or_else(|| scenario.tunnel.first_track().clone());
            let lamps = passed_by(rig, &way);
            PositioningScore::new(&scenario.tunnel, lamps, &onboard.led.methods)
        });
        let eyes = EYES.into_iter().filter(|_| positioning.is_some());
        Self {
            id,
            rig: rig.map(|rig| (rig.actual(), rig.end)),
            health: Health::of(eyes),
            positioning,
            occupancy: onboard
                .filter(|onboard| onboard.tells_its_track())
                .map(OccupancyScore::new),
            outcome: Outcome::default(),
            ride: Ride::default(),
            dark_lamps: Vec::new(),
            stereo_frames: 0,
            aim_mps: train.map_or(f64::INFINITY, |t| t.cruise_speed_kmh / 3.6),
        }
    }

    /// Takes down where the train really is.
    pub fn on_motion(&mut self, train: &TrainState, world: &World) {
        self.outcome.on_motion(self.id, train, world);
        self.ride.on_motion(train);
        if let Some(positioning) = &mut self.positioning {
            let rear = matches!(self.rig, Some((_, TrainEnd::Rear)));
            let behind_m = world.train_length_m(self.id).filter(|_| rear);
            positioning.rig_at(train.run_m - behind_m.unwrap_or(0.0));
        }
    }

    /// Takes down a report of the lamp positioning and what making it cost; gives the true chainage of
    /// the head at each fix.
    pub fn on_led(
        &mut self,
        report: &LedReport,
        cost_ms: f64,
        world: &World,
    ) -> Result<Vec<f64>, SessionError> {
        let (Some((rig, end)), Some(positioning)) = (&self.rig, &mut self.positioning) else {
            return Ok(Vec::new());
        };
        self.stereo_frames += 1;
        let dark = report.dark.iter().map(|uid| uid.to_string());
        self.dark_lamps.extend(dark);
        let left_at = |t| Some(world.vehicle_at(self.id, *end, t)? * rig.vehicle_from_left);
        positioning.report(report, cost_ms, &rig.left.intrinsics, left_at);
        let mut truths_m = Vec::with_capacity(report.fixes.len());
        for fix in &report.fixes {
            let true_m = true_chainage_m(world, self.id, fix)
                .ok_or(SensorError::PoseForgotten(fix.time.secs()))?;
            positioning.fix(fix, true_m);
            truths_m.push(true_m);
        }
        Ok(truths_m)
    }

    /// Takes down what track occupancy says, and gives what it is worth.
    pub fn on_occupancy(&mut self, report: &OccupancyReport, world: &World) -> Option<Judged> {
        self.occupancy.as_mut()?.report(report, world, self.id)
    }

    /// Takes down a cycle of the protection.
    pub fn on_protection(&mut self, now: SimTime, report: &ProtectionReport) {
        self.outcome.on_cycle(now, report, self.aim_mps);
    }

    /// Fixes of a method so far.
    pub fn fixes(&self, method: Method) -> usize {
        let positioning = self.positioning.as_ref();
        positioning.map_or(0, |p| p.fixes(method))
    }

    /// Stereo pairs read so far.
    pub fn pairs(&self) -> u32 {
        self.stereo_frames
    }

    /// For how long the train has stood again after it ran.
    pub fn stood_s(&self, now: SimTime) -> Option<f64> {
        self.outcome.stood_s(now)
    }

    /// Pose of the left eye now.
    pub fn left_eye(&self, world: &World) -> Option<Isometry3<f64>> {
        let (rig, end) = self.rig.as_ref()?;
        Some(world.vehicle_at(self.id, *end, world.time())? * rig.vehicle_from_left)
    }

    /// The figures.
    pub fn finish(self, world: &World, derailed: bool) -> TrainSummary {
        let positioning = self.positioning.map(PositioningScore::finish);
        TrainSummary {
            id: self.id,
            stereo_frames: self.stereo_frames,
            positioning: positioning.unwrap_or_default(),
            cameras: self.health.cameras,
            dark_lamps: self.dark_lamps,
            occupancy: self.occupancy.map(OccupancyScore::finish),
            protection: self.outcome.protection(self.id, world),
            train: self.ride.finish(self.id, world, derailed),
        }
    }
}

/// The lamps of its own track that a rig comes to see on its way, with their distances along the train's route.
/// `way` is the track as its cab looks along it.
fn passed_by(rig: &RigSettings, way: &Track) -> Vec<(Uid, f64)> {
    let calibration = rig.calibration();
    let along_m = |lamp: &LampSite| match rig.end {
        TrainEnd::Front => lamp.chainage_m,
        TrainEnd::Rear => way.alignment.length_m() - lamp.chainage_m,
    };
    let own = (way.lamps.iter()).filter(|lamp| lamp.lateral_m.abs() <= OWN_LAMPS_M);
    let seen = own.filter(|lamp| ever_sees(&calibration, way, lamp));
    seen.map(|lamp| (lamp.uid, along_m(lamp))).collect()
}

/// Where the head of a train really was at the time of a fix, as a chainage of the track that the fix is on.
fn true_chainage_m(world: &World, id: TrainId, fix: &PositionFix) -> Option<f64> {
    let route = world.route(id)?;
    let run_m = run_at(world, id, fix.time)?;
    let (place, _) = route.place(run_m);
    if place.track == fix.track {
        return Some(place.s_m);
    }
    // Over a joint the way from one to the other counts; beside the route the place across.
    if let Some(fix_m) = route.run_near_m(fix.place(), run_m) {
        let (_, direction) = route.place(fix_m);
        return Some(fix.chainage_m - direction.sign() * (fix_m - run_m));
    }
    let head = world.along_route(id)?.alignment.at(run_m).origin;
    let line = world.network().alignment(fix.track)?;
    Some(line.track_from_world(&head, fix.chainage_m).s_m)
}

/// Distance of a train's head along its route at a time. The stamp of a clock that is fast may lie ahead of the
/// world: over that moment the speed goes on.
fn run_at(world: &World, id: TrainId, time: SimTime) -> Option<f64> {
    world.run_at(id, time).or_else(|| {
        let train = world.train(id)?;
        let ahead_s = time.since(train.time);
        let speed_mps = train.direction.sign() * train.speed_mps;
        (ahead_s > 0.0).then_some(train.run_m + speed_mps * ahead_s)
    })
}
