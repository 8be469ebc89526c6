//! Onboard warning and control: supervises the train's speed against the braking curve to the
//! nearest dangerous obstacle ahead, brakes without the driver where he does not, and holds the
//! train until the track is clear.
//!
//! ```
//! use metrotwin::bus::{BrakeDemand, DangerLevel, ObstacleWarning, OdometerSample, SimTime};
//! use metrotwin::stack::protection::{Protection, ProtectionSettings};
//! # use metrotwin::track::{Alignment, PlanElement, Track, TrackId};
//! # let straight = PlanElement { length_m: 2000.0, start_per_m: 0.0, end_per_m: 0.0,
//! #     start_cant_m: 0.0, end_cant_m: 0.0 };
//! # let map = std::sync::Arc::new(Track::bare("t",
//! #     Alignment::new(nalgebra::Point3::origin(), 0.0, &[straight], &[])));
//! let settings = ProtectionSettings { initial_chainage_m: Some(500.0), ..Default::default() };
//! let mut protection = Protection::new(&settings, map);
//! let time = SimTime::from_secs(1.0);
//! protection.on_odometer(&OdometerSample { time, distance_m: 0.0, speed_mps: 20.0, slides: false });
//! assert_eq!(protection.cycle(time).command.brake, BrakeDemand::None);
//! // A device reports an obstacle 150 m ahead: too near for the service brake.
//! let warning = ObstacleWarning { device: "W1".into(), number: 0, issued: time,
//!     danger: DangerLevel::High, track: TrackId::default(),
//!     from_chainage_m: 650.0, to_chainage_m: 650.5, blind: false };
//! protection.on_warning(&warning, time);
//! assert_eq!(protection.cycle(time.plus(0.1)).command.brake, BrakeDemand::Emergency);
//! ```
//!
//! # Theory
//!
//! Warnings, states and display follow Xiao, Xu and Yu, "Research on Obstacle Detection and Train
//! Control Technology for Urban Rail Transit", Journal of Ordnance Equipment Engineering 41(10),
//! 2020, 161-165, which asks for target-distance curves. The curves are those of the safe braking
//! model of IEEE 1474.1 (see `curve`); margins and times are those of ETCS (SUBSET-026, 3.13):
//!
//! ```text
//!  speed
//!    |------------------------------.   emergency: worst case stops at the danger point
//!    |--------------------------.     '.
//!    |---------------------.      '.     '.   service: stops at the end of the authority
//!    |   permitted           '.     '.     '.
//!    |   (driver's time before) '.    '.     '.
//!    +------------------------------'----'-----'------#### obstacle
//!                                   end of     danger
//!                                   authority  point
//! ```
//!
//! The danger point lies `danger_distance_m` before the obstacle. The emergency curve takes the
//! train's head k sigma further ahead and its speed higher than measured, with traction on until
//! it is cut; where wheels have slid, with the rate that slippery rails leave (see `adhesion`). The
//! service curve takes the rate of the poorest rails that are reckoned with, since what the rails ahead
//! bear is not known. It ends `safety_distance_m` before the obstacle, or earlier where a large sigma
//! asks for it. Up to the permitted speed nothing happens; over it the driver is warned, and has
//! `driver_time_s` until the service brake intervenes.
//!
//! A high danger ends the authority; a low one only tells the driver. Where the permitted speed
//! has come down to walking pace, the brake stops and holds the train until the device clears the
//! warning. Warnings outlive silence of the radio; a "clear" does not: where a device of the map has
//! not been heard for `radio_timeout_s`, its stretch counts as occupied; so it does after the
//! equipment is switched on, until the device is heard. With no position the train is restricted to
//! `restricted_kmh`, and any high danger stops it; with no odometer it stops at once.
//!
//! # What it does not do
//!
//! It does not supervise running backwards, speed restrictions of single sections, or doors. A train
//! ahead is an obstacle that stands where it last said to be ([`TrainProtection`]). It trusts the
//! odometer's speed within its stated error, and what the slide protection of the odometer's wheelset
//! says: a wheel that slides unnoticed puts the train too far back.

mod adhesion;
mod curve;
mod display;
mod equipment;
mod monitor;
mod obstacles;
mod position;
mod settings;
mod supervision;
#[cfg(test)]
mod tests;

pub use equipment::TrainProtection;
pub use settings::ProtectionSettings;

use crate::bus::{
    BrakeDemand, DangerLevel, DriverDisplay, ObstacleWarning, OdometerSample, PositionEstimate,
    PositionFix, PositionSource, ProtectionReport, SimTime, Supervision, TrainCommand,
};
use crate::track::{Direction, Place, Track, TrackId};
use adhesion::{Adhesion, Grip};
use curve::Grades;
use display::{Ahead, Situation};
use monitor::BrakeMonitor;
use obstacles::Obstacles;
use position::{HeadPosition, Position};
use std::sync::Arc;
use supervision::{Limits, Supervisor};

/// The odometer's stated speed error is so many standard deviations.
const SPEED_ERROR_SIGMAS: f64 = 3.0;

/// What is known in a cycle.
#[derive(Clone, Copy, Debug)]
struct Known {
    time: SimTime,
    train: Option<HeadPosition>,
    /// By the odometer.
    speed: Option<f64>,
    grip: Grip,
    odometer_lost: bool,
    brake_failed: bool,
    /// Where the nearest high danger begins.
    obstacle_m: Option<f64>,
}

impl Known {
    fn speed_mps(&self) -> f64 {
        self.speed.unwrap_or(0.0)
    }

    fn head_m(&self) -> Option<f64> {
        self.train.map(|train| train.chainage_m)
    }
}

/// The protection of one train.
#[derive(Clone, Debug)]
pub struct Protection {
    settings: ProtectionSettings,
    map: Arc<Track>,
    grades: Grades,
    position: Position,
    obstacles: Obstacles,
    adhesion: Adhesion,
    supervisor: Supervisor,
    monitor: BrakeMonitor,
    brake: BrakeDemand,
    first_cycle: Option<SimTime>,
}

impl Protection {
    /// Switched on, with the driver's position setting if there is one.
    pub fn new(settings: &ProtectionSettings, map: Arc<Track>) -> Self {
        Self {
            grades: Grades::new(&map, settings),
            position: Position::new(settings),
            obstacles: Obstacles::new(settings, &map),
            adhesion: Adhesion::default(),
            supervisor: Supervisor::new(settings),
            monitor: BrakeMonitor::new(settings),
            brake: BrakeDemand::None,
            first_cycle: None,
            settings: settings.clone(),
            map,
        }
    }

    /// Takes a position from the positioning stack. The caller passes the fixes of one method;
    /// they may come late. One that is not on the line, or does not say where on it, is none.
    pub fn on_fix(&mut self, fix: &PositionFix) {
        let length_m = self.map.alignment.length_m();
        if (0.0..=length_m).contains(&fix.chainage_m) && fix.sigma_m <= length_m {
            self.position.on_fix(fix);
        }
    }

    /// Takes a sample of the odometer.
    pub fn on_odometer(&mut self, sample: &OdometerSample) {
        self.position.odometry.on_sample(sample);
    }

    /// The antenna on the train head passed over a balise at `time`. A balise that the map does
    /// not know tells nothing. What message it stores comes by [`Self::on_warning`].
    pub fn on_balise(&mut self, name: &str, time: SimTime) {
        if let Some(balise) = self.map.balise(name) {
            let sigma_m = self.settings.balise_sigma_m;
            self.position.reset(time, balise.chainage_m, sigma_m);
        }
    }

    /// Takes a warning, received by balise or by radio. None was issued after it was received: a clock
    /// that is ahead would make all that is issued later old.
    pub fn on_warning(&mut self, warning: &ObstacleWarning, received: SimTime) {
        let warning = ObstacleWarning {
            issued: warning.issued.min(received),
            ..warning.clone()
        };
        self.obstacles.on_warning(&warning, received);
    }

    /// Takes what a device said by radio: it is alive, and this holds.
    pub fn on_heartbeat(&mut self, state: &ObstacleWarning, sent: SimTime, received: SimTime) {
        self.obstacles.on_heard(&state.device, sent.min(received));
        self.on_warning(state, received);
    }

    /// Position and speed on the route, as the protection takes them to be.
    pub fn estimate(&self, time: SimTime, direction: Direction) -> Option<PositionEstimate> {
        let head = self.position.at(time)?;
        let odometry = &self.position.odometry;
        let v_mps = odometry.mean_speed_mps().unwrap_or(0.0);
        let mut speed_sigma_mps = self.settings.speed_error_kmh / 3.6 / SPEED_ERROR_SIGMAS;
        if odometry.slides() {
            speed_sigma_mps = speed_sigma_mps.hypot(self.settings.slide_error * v_mps);
        }
        Some(PositionEstimate {
            time,
            track: TrackId::default(),
            direction,
            s_m: head.chainage_m,
            v_mps,
            covariance: [[head.sigma_m.powi(2), 0.0], [0.0, speed_sigma_mps.powi(2)]],
            protection_level_m: None,
            sources: vec![head.source, PositionSource::Odometer],
        })
    }

    /// Decides; called 10 times a second.
    pub fn cycle(&mut self, time: SimTime) -> ProtectionReport {
        self.first_cycle.get_or_insert(time);
        self.obstacles.lapse(time);
        let now = self.known(time);
        let (train, obstacle_m, grip) = (now.train, now.obstacle_m, now.grip);
        let ceiling_mps = self.ceiling_mps(train);
        let limits = (self.supervisor).limits(&self.grades, ceiling_mps, train, obstacle_m, grip);
        // With no position every obstacle may be the next one.
        let must_stop = train.is_none() && obstacle_m.is_some();
        let at_once = now.odometer_lost || now.brake_failed;
        let supervision =
            (self.supervisor).step(time, limits, now.speed, grip.slides, must_stop, at_once);
        self.brake = supervision::demand(supervision);
        self.report(&now, limits, supervision)
    }

    fn known(&mut self, time: SimTime) -> Known {
        let train = self.position.at(time);
        let odometry = &self.position.odometry;
        let mut known = Known {
            time,
            train,
            speed: odometry.mean_speed_mps(),
            grip: self.adhesion.update(time, odometry, &self.settings),
            odometer_lost: self.odometer_lost(time),
            brake_failed: false,
            obstacle_m: self
                .ahead(train, DangerLevel::High)
                .map(|(warning, _)| warning.from_chainage_m),
        };
        let (speed_mps, head_m) = (known.speed_mps(), known.head_m());
        known.brake_failed = (self.monitor).update(
            time,
            self.brake,
            speed_mps,
            head_m,
            &self.grades,
            known.grip,
        );
        known
    }

    fn ceiling_mps(&self, train: Option<HeadPosition>) -> f64 {
        let settings = &self.settings;
        let ceiling_kmh = match train {
            Some(_) => settings.line_speed_kmh,
            None => settings.restricted_kmh.min(settings.line_speed_kmh),
        };
        ceiling_kmh / 3.6
    }

    fn report(&self, now: &Known, limits: Limits, supervision: Supervision) -> ProtectionReport {
        let mut report = ProtectionReport {
            time: now.time,
            position: now.head_m().map(Place::on_first_track),
            sigma_m: now.train.map(|t| t.sigma_m),
            speed_mps: now.speed_mps(),
            permitted_mps: limits.permitted_mps,
            service_mps: limits.service_mps,
            emergency_mps: limits.emergency_mps,
            supervision,
            authority_end: (now.obstacle_m)
                .map(|m| Place::on_first_track(m - self.settings.safety_distance_m)),
            wheels_slide: now.grip.slides,
            stops_in_time: self.stops_in_time(now),
            command: TrainCommand {
                brake: self.brake,
                permitted_speed_mps: limits.permitted_mps,
            },
            display: DriverDisplay::default(),
        };
        let situation = Situation {
            obstacle: self.nearest(now),
            brake_failed: now.brake_failed,
            odometer_lost: now.odometer_lost,
            radio_timeout_s: self.settings.radio_timeout_s,
        };
        report.display = display::display(&report, &situation);
        report
    }

    /// Whether the emergency brake stops the train before the nearest high danger.
    fn stops_in_time(&self, now: &Known) -> bool {
        let (Some(train), Some(obstacle_m)) = (now.train, now.obstacle_m) else {
            return true;
        };
        let fastest_mps = now.speed_mps() + now.grip.slide_error_mps;
        let emergency = self.supervisor.emergency_at(now.time, now.grip);
        emergency.stops(&self.grades, train.chainage_m, fastest_mps, obstacle_m)
    }

    /// The nearest obstacle of at least `danger`. It counts as passed only behind the head's rearmost
    /// possible place.
    fn ahead(
        &self,
        train: Option<HeadPosition>,
        danger: DangerLevel,
    ) -> Option<(&ObstacleWarning, SimTime)> {
        let sigmas = self.settings.position_sigmas;
        let rearmost_m = train.map_or(f64::NEG_INFINITY, |t| t.chainage_m - sigmas * t.sigma_m);
        self.obstacles.ahead(rearmost_m, danger)
    }

    /// The obstacle that the driver is shown: a dangerous one first.
    fn nearest(&self, now: &Known) -> Option<Ahead> {
        let head_m = now.head_m()?;
        let ahead = |danger| self.ahead(now.train, danger);
        let (warning, received) = ahead(DangerLevel::High).or_else(|| ahead(DangerLevel::Low))?;
        Some(Ahead {
            distance_m: warning.from_chainage_m - head_m,
            danger: warning.danger,
            silent_s: now.time.since(received),
            blind: warning.blind,
        })
    }

    fn odometer_lost(&self, time: SimTime) -> bool {
        let since_start = self.first_cycle.map_or(0.0, |first| time.since(first));
        let age_s = self.position.odometry.age_s(time).unwrap_or(since_start);
        // A sample from the future would hold off all that follow.
        age_s.abs() > self.settings.odometer_timeout_s
    }
}
