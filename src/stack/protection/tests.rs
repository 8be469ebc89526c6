//! The protection against a point-mass train.
#![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

use super::*;
use crate::bus::{Identity, Indicator, Method, ObstacleWarning};
use crate::track::uid::Uid;
use crate::track::{Alignment, Balise, Grade, PlanElement, TrackId};
use nalgebra::{Point3, Vector3};

/// Distance of one odometer pulse: 128 a turn of a wheel of 0.43 m radius.
const PULSE_M: f64 = std::f64::consts::TAU * 0.43 / 128.0;

/// 4 km of straight line on a constant gradient.
pub(super) fn map(permille: f64) -> Arc<Track> {
    let straight = PlanElement {
        length_m: 4000.0,
        start_per_m: 0.0,
        end_per_m: 0.0,
        start_cant_m: 0.0,
        end_cant_m: 0.0,
    };
    let grade = Grade {
        from_m: 0.0,
        slope: permille / 1000.0,
        radius_m: 0.0,
    };
    Arc::new(Track {
        name: "test".into(),
        alignment: Alignment::new(Point3::origin(), 0.3, &[straight], &[grade]),
        stated_chainage: None,
        sections: vec![],
        lamps: vec![],
        wayside: vec![],
        balises: vec![Balise {
            name: "B7".into(),
            chainage_m: 700.0,
        }],
        base_stations: vec![],
        stations: vec![],
        ambient_lx: 5.0,
        daylight_lx: 0.0,
    })
}

fn warning(number: u32, issued: SimTime, danger: DangerLevel, from_m: f64) -> ObstacleWarning {
    ObstacleWarning {
        track: TrackId::default(),
        device: "W1".into(),
        number,
        issued,
        danger,
        from_chainage_m: from_m,
        to_chainage_m: from_m + 0.5,
        blind: false,
    }
}

pub(super) fn fix(time: SimTime, chainage_m: f64, sigma_m: f64) -> PositionFix {
    PositionFix {
        track: TrackId::default(),
        time,
        method: Method::Stereo,
        chainage_m,
        sigma_m,
        position: Point3::origin(),
        uid: Uid { line: 1, lamp: 1 },
        identity: Identity::Decoded,
        lamp_in_camera: Vector3::zeros(),
    }
}

/// How the train of the tests behaves; the protection knows none of it.
#[derive(Clone, Copy)]
struct Train {
    s: f64,
    v: f64,
    brake: f64,
    travelled: f64,
    /// Acceleration by the driver while nothing overrides him.
    driver_mps2: f64,
    /// Obeys the permitted speed.
    obedient: bool,
    service_mps2: f64,
    emergency_mps2: f64,
    dead_s: f64,
    buildup_s: f64,
    pull_mps2: f64,
    odometer_scale: f64,
    /// Time since the demand last changed.
    demand: BrakeDemand,
    demand_s: f64,
}

impl Train {
    fn new(s: f64, v: f64, permille: f64) -> Self {
        Self {
            s,
            v,
            brake: 0.0,
            travelled: 0.0,
            driver_mps2: 0.0,
            obedient: false,
            service_mps2: 1.0,
            emergency_mps2: 1.3,
            dead_s: 0.3,
            buildup_s: 1.5,
            pull_mps2: -9.80665 * permille / 1000.0 / 1.08,
            odometer_scale: 1.0,
            demand: BrakeDemand::None,
            demand_s: 0.0,
        }
    }

    fn step(&mut self, dt: f64, command: TrainCommand) {
        self.demand_s = if command.brake == self.demand {
            self.demand_s + dt
        } else {
            0.0
        };
        // A brake that is on stays on while a stronger one is asked for.
        let answered = self.demand_s >= self.dead_s;
        self.demand = command.brake;
        let target = match self.demand {
            BrakeDemand::None if self.obedient && self.v > command.permitted_speed_mps - 0.3 => 0.8,
            BrakeDemand::None => 0.0,
            BrakeDemand::Service if answered => self.service_mps2,
            BrakeDemand::Emergency if answered => self.emergency_mps2,
            _ => self.brake,
        };
        let slew = dt / self.buildup_s * self.emergency_mps2.max(self.service_mps2);
        self.brake += (target - self.brake).clamp(-slew, slew);
        let driver = if self.demand == BrakeDemand::None && target <= 0.0 {
            if self.obedient {
                (command.permitted_speed_mps - 0.4 - self.v).clamp(0.0, 1.0) - self.pull_mps2
            } else {
                self.driver_mps2
            }
        } else {
            0.0
        };
        let standing = self.v <= 0.0 && self.brake >= self.pull_mps2.abs();
        let accel = driver + self.pull_mps2 - self.brake;
        let v = if standing {
            0.0
        } else {
            (self.v + accel * dt).max(0.0)
        };
        self.s += 0.5 * (v + self.v) * dt;
        self.travelled += 0.5 * (v + self.v) * dt;
        self.v = v;
    }
}

#[derive(Clone, Copy, Debug, Default)]
struct Outcome {
    /// Head to obstacle when stopped.
    margin_m: f64,
    worst: Supervision,
    lamp: Indicator,
    stopped: bool,
}

/// Drives until standstill (or 400 s); the warning comes at the start.
fn drive(
    settings: &ProtectionSettings,
    mut train: Train,
    permille: f64,
    obstacle_m: f64,
) -> Outcome {
    let mut protection = Protection::new(settings, map(permille));
    let mut command = TrainCommand {
        permitted_speed_mps: 99.0,
        ..TrainCommand::default()
    };
    let mut outcome = Outcome::default();
    let mut before_m = 0.0;
    let danger = warning(0, SimTime::ZERO, DangerLevel::High, obstacle_m);
    protection.on_warning(&danger, danger.issued);
    let dt = 0.01;
    for k in 0..40_000 {
        let time = SimTime::from_secs(f64::from(k) * dt);
        // As a wheel with 128 pulses a turn gives it, 50 times a second: distance in whole
        // pulses, speed in pulses an interval.
        if k % 2 == 0 {
            let counted = (train.travelled * train.odometer_scale / PULSE_M).floor() * PULSE_M;
            protection.on_odometer(&OdometerSample {
                time,
                distance_m: counted,
                speed_mps: (counted - before_m) / 0.02,
                slides: false,
            });
            before_m = counted;
        }
        if k % 10 == 0 {
            let report = protection.cycle(time);
            command = report.command;
            outcome.worst = outcome.worst.max(report.supervision);
            if report.display.lamp == Indicator::Emergency {
                outcome.lamp = Indicator::Emergency;
            }
        }
        train.step(dt, command);
        if train.v <= 0.0 && command.brake != BrakeDemand::None {
            outcome.stopped = true;
            break;
        }
    }
    outcome.margin_m = obstacle_m - train.s;
    outcome
}

fn at(chainage_m: f64, sigma_m: f64) -> ProtectionSettings {
    ProtectionSettings {
        initial_chainage_m: Some(chainage_m),
        initial_sigma_m: sigma_m,
        line_speed_kmh: 100.0,
        odometer_drift: 0.01,
        ..Default::default()
    }
}

/// A position that fixes keep good: half a metre.
fn well_known(chainage_m: f64) -> ProtectionSettings {
    ProtectionSettings {
        odometer_drift: 0.0,
        ..at(chainage_m, 0.5)
    }
}

/// Every speed and gradient, a driver who ignores everything and keeps powering, brakes as the
/// specification has them: the service brake alone stops the train between the end of the
/// authority and 15 m before it (at 1 m/s downhill, the rate of slippery rails takes that), and the
/// emergency brake never joins in.
#[test]
fn the_service_brake_stops_before_the_obstacle() {
    let (mut least, mut most) = (f64::INFINITY, 0.0f64);
    for permille in [-28.0, 0.0, 28.0] {
        for kmh in [20.0, 40.0, 60.0, 80.0, 100.0] {
            let mut train = Train::new(500.0, kmh / 3.6, permille);
            train.driver_mps2 = -train.pull_mps2;
            let out = drive(&well_known(500.0), train, permille, 1500.0);
            assert!(out.stopped, "{kmh} km/h, {permille} permille");
            assert_eq!(
                out.worst,
                Supervision::Service,
                "{kmh} km/h, {permille}: {out:?}"
            );
            least = least.min(out.margin_m);
            most = most.max(out.margin_m);
        }
    }
    assert!(least >= 25.0 && most < 40.0, "{least} to {most} m");
}

/// A driver who keeps to the permitted speed is never braked but for the last metres, and stops
/// where the authority ends.
#[test]
fn an_obedient_driver_stops_at_the_end_of_the_authority() {
    let (mut least, mut most) = (f64::INFINITY, 0.0f64);
    for permille in [-28.0, 0.0, 28.0] {
        for kmh in [20.0, 60.0, 80.0, 99.0] {
            let mut train = Train::new(500.0, kmh / 3.6, permille);
            train.obedient = true;
            let out = drive(&well_known(500.0), train, permille, 1500.0);
            assert!(out.stopped, "{kmh} km/h, {permille} permille: {out:?}");
            assert!(
                out.worst <= Supervision::Service,
                "{kmh}, {permille}: {out:?}"
            );
            least = least.min(out.margin_m);
            most = most.max(out.margin_m);
        }
    }
    assert!(least >= 25.0 && most < 40.0, "{least} to {most} m");
}

/// Everything at its worst at once: the guaranteed rate only, slowest answer, odometer short by
/// its error, position off by three sigma, traction to the last moment, warning from the latest
/// point at which it is not yet too late. The danger distance must still be kept.
#[test]
fn the_worst_case_stops_before_the_danger_point() {
    let mut least = f64::INFINITY;
    for permille in [-28.0, 0.0, 28.0] {
        for kmh in [20.0, 40.0, 60.0, 80.0, 100.0] {
            let sigma = 2.0;
            let settings = at(500.0 - 3.0 * sigma, sigma);
            let mut train = Train::new(500.0, kmh / 3.6, permille);
            train.driver_mps2 = 1.0;
            train.service_mps2 = 0.0;
            train.emergency_mps2 = 1.0;
            train.dead_s = 0.9;
            train.odometer_scale = 0.99;
            let out = drive(&settings, train, permille, 1500.0);
            assert!(out.stopped, "{kmh} km/h, {permille} permille");
            least = least.min(out.margin_m);
        }
    }
    assert!(least >= 10.0, "{least} m");
}

/// Neither brake works: the emergency lamp must light, and only then.
#[test]
fn a_failed_brake_lights_the_emergency_lamp() {
    let mut train = Train::new(500.0, 15.0, 0.0);
    train.service_mps2 = 0.05;
    train.emergency_mps2 = 0.05;
    let out = drive(&at(500.0, 0.5), train, 0.0, 900.0);
    assert_eq!(out.lamp, Indicator::Emergency);
    assert_eq!(out.worst, Supervision::Emergency);
    // The service brake fails, the emergency brake takes over in time.
    train.emergency_mps2 = 1.2;
    let out = drive(&at(500.0, 0.5), train, 0.0, 900.0);
    assert!(out.stopped && out.margin_m > 10.0);
    let healthy = Train::new(500.0, 15.0, -28.0);
    let out = drive(&at(500.0, 0.5), healthy, -28.0, 900.0);
    assert_eq!(out.lamp, Indicator::NormalGreen);
}

/// One train standing at a place; cycles on demand.
struct Bench {
    protection: Protection,
    time: SimTime,
    slides: bool,
}

impl Bench {
    fn new(settings: &ProtectionSettings) -> Self {
        Self {
            protection: Protection::new(settings, map(0.0)),
            time: SimTime::ZERO,
            slides: false,
        }
    }

    fn cycle(&mut self, distance_m: f64, speed_mps: f64) -> ProtectionReport {
        self.time = self.time.plus(0.1);
        self.protection.on_odometer(&OdometerSample {
            time: self.time,
            distance_m,
            speed_mps,
            slides: self.slides,
        });
        self.protection.cycle(self.time)
    }

    fn hear(&mut self, number: u32, issued_s: f64, danger: DangerLevel, from_m: f64) {
        let warning = warning(number, SimTime::from_secs(issued_s), danger, from_m);
        self.protection.on_warning(&warning, warning.issued);
    }
}

/// Stopped, the train is held until the device clears its warning, however long it is silent; a
/// clear message that is older than the warning (the balise's) releases nothing.
#[test]
fn only_a_newer_clear_message_releases() {
    let mut b = Bench::new(&at(1000.0, 0.5));
    b.hear(5, 10.0, DangerLevel::High, 1020.0);
    for _ in 0..600 {
        let r = b.cycle(0.0, 0.0);
        assert_eq!(r.command.brake, BrakeDemand::Service);
        assert_eq!(r.display.lamp, Indicator::BrakeWarningRed);
    }
    let r = b.cycle(0.0, 0.0);
    assert!(
        r.display.text.contains("not heard of for 50 s"),
        "{}",
        r.display.text
    );
    b.hear(4, 9.0, DangerLevel::None, 1020.0);
    assert_eq!(b.cycle(0.0, 0.0).command.brake, BrakeDemand::Service);
    b.hear(6, 70.0, DangerLevel::None, 1020.0);
    let r = b.cycle(0.0, 0.0);
    assert_eq!(r.command.brake, BrakeDemand::None);
    assert_eq!(r.display.lamp, Indicator::NormalGreen);
    assert!((r.command.permitted_speed_mps - 100.0 / 3.6).abs() < 1e-9);
}

/// A low danger is shown and nothing else; an obstacle that the train has passed is forgotten.
#[test]
fn low_dangers_warn_only() {
    let mut b = Bench::new(&at(1000.0, 0.5));
    b.hear(0, 0.0, DangerLevel::Low, 1020.0);
    let r = b.cycle(0.0, 20.0);
    assert_eq!(r.supervision, Supervision::Permitted);
    assert_eq!(r.display.lamp, Indicator::NormalGreen);
    assert!((r.display.distance_to_obstacle_m.unwrap() - 20.0).abs() < 1e-6);
    assert!(
        r.display
            .text
            .starts_with("Object beside the track in 20 m")
    );
    let r = b.cycle(30.0, 20.0);
    assert_eq!(r.display.distance_to_obstacle_m, None);
}

/// Over the line speed: warned, braked at +5.5 km/h until permitted again, emergency at +7.5
/// until standstill.
#[test]
fn the_ceiling_speed_has_its_margins() {
    let mut b = Bench::new(&at(500.0, 0.5));
    // Speed is measured over half a second: it takes as long to be known.
    let mut run_m = 0.0;
    let mut state = |kmh: f64| {
        let states = [(); 6].map(|()| {
            run_m += 0.1 * kmh / 3.6;
            b.cycle(run_m, kmh / 3.6).supervision
        });
        states[5]
    };
    assert_eq!(state(99.9), Supervision::Permitted);
    assert_eq!(state(102.0), Supervision::Warning);
    assert_eq!(state(105.6), Supervision::Service);
    assert_eq!(state(101.0), Supervision::Service);
    assert_eq!(state(99.0), Supervision::Permitted);
    assert_eq!(state(107.6), Supervision::Emergency);
    assert_eq!(state(50.0), Supervision::Emergency);
    assert_eq!(state(0.0), Supervision::Permitted);
}

/// No position: restricted speed, and a high danger anywhere stops. A fix, or a balise of the
/// map, gives it; an unknown balise does not.
#[test]
fn position_comes_from_fix_or_balise() {
    let unknown = ProtectionSettings::default();
    let mut b = Bench::new(&unknown);
    let r = b.cycle(0.0, 5.0);
    assert_eq!(r.position, None);
    assert!((r.permitted_mps - 25.0 / 3.6).abs() < 1e-9);
    b.protection.on_balise("nowhere", b.time);
    assert_eq!(b.cycle(0.5, 5.0).position, None);
    b.hear(0, 0.0, DangerLevel::High, 3000.0);
    assert_eq!(b.cycle(1.0, 5.0).supervision, Supervision::Service);
    b.protection.on_balise("B7", b.time);
    let r = b.cycle(1.5, 5.0);
    assert!((r.position.unwrap().s_m - 700.5).abs() < 1e-9);
    assert_eq!(r.supervision, Supervision::Permitted);
    assert_eq!(r.authority_end, Some(Place::on_first_track(3000.0 - 25.0)));
    b.protection.on_fix(&fix(b.time, 701.0, 0.3));
    let r = b.cycle(2.0, 5.0);
    assert!((r.position.unwrap().s_m - 701.4).abs() < 0.15);
    assert!(r.sigma_m.unwrap() < 0.5);
}

/// A worse position must bring the brake earlier, by about k times sigma.
#[test]
fn uncertainty_brings_the_end_nearer() {
    let limit = |sigma: f64| {
        let mut b = Bench::new(&at(1000.0, sigma));
        b.hear(0, 0.0, DangerLevel::High, 1400.0);
        b.cycle(0.0, 10.0).emergency_mps
    };
    let model = curve::BrakeModel::emergency(&at(0.0, 1.0));
    let error = 3.0 / 3.6;
    let shift =
        model.distance_m(limit(1.0) + error, 0.0) - model.distance_m(limit(11.0) + error, 0.0);
    assert!((shift - 30.0).abs() < 0.01, "{shift}");
}

/// Where the emergency brake is demanded now, it is not on yet: it needs 275 m from 80 km/h, and would
/// need 247 m had it been on before.
#[test]
fn a_brake_just_demanded_is_not_on() {
    let settings = ProtectionSettings {
        initial_sigma_m: 0.0,
        ..well_known(1000.0)
    };
    let stops = |obstacle_m: f64| {
        let mut b = Bench::new(&settings);
        b.hear(0, 0.0, DangerLevel::High, obstacle_m);
        let report = b.cycle(0.0, 80.0 / 3.6);
        assert_eq!(report.supervision, Supervision::Emergency);
        report.stops_in_time
    };
    assert!(!stops(1260.0));
    assert!(stops(1276.0));
}

/// A wheel that stands while slide protection acts is a locked wheel: neither is the emergency brake
/// released, nor a failed brake forgotten, until any train would have stopped.
#[test]
fn a_locked_wheel_is_no_standing_train() {
    let mut b = Bench::new(&at(1000.0, 0.5));
    b.hear(0, 0.0, DangerLevel::High, 1500.0);
    for k in 0..60 {
        b.cycle(2.0 * f64::from(k), 20.0);
    }
    b.slides = true;
    for _ in 0..100 {
        let report = b.cycle(120.0, 0.0);
        assert_eq!(report.supervision, Supervision::Emergency);
        assert_eq!(report.display.lamp, Indicator::Emergency);
    }
    let released = (0..3000).find(|_| b.cycle(120.0, 0.0).supervision != Supervision::Emergency);
    assert!(released.is_some());
}

/// At 60 km/h, 300 m before an obstacle, the brakes are on and stop the train on dry rails. Where wheels have
/// slid they reach `low_adhesion_mps2`, and while these slide the train may run faster than they say. Provokes a
/// guaranteed rate, or a warning that the train may not stop, that ignores what the wheels have felt.
#[test]
fn a_slide_lowers_the_rate_that_is_guaranteed() {
    let speed_mps = 60.0 / 3.6;
    let mut b = Bench::new(&well_known(1000.0));
    b.hear(0, 0.0, DangerLevel::High, 1300.0);
    let mut run_m = 0.0;
    let mut after = |slides: bool, cycles: u32| {
        b.slides = slides;
        let reports = (0..cycles).map(|_| {
            run_m += 0.1 * speed_mps;
            b.cycle(run_m, speed_mps)
        });
        reports.last().unwrap()
    };
    let dry = after(false, 1);
    assert!(dry.stops_in_time && !dry.display.text.contains("MAY NOT STOP"));
    let sliding = after(true, 1);
    assert!(sliding.wheels_slide && !sliding.stops_in_time);
    assert!(sliding.display.text.contains("MAY NOT STOP BEFORE IT"));
    // The mean speed holds samples of the slide for half a second.
    let slid = after(false, 10);
    assert!(!slid.wheels_slide && !slid.stops_in_time);
    let (wider, lower) = (
        slid.emergency_mps - sliding.emergency_mps,
        dry.emergency_mps - slid.emergency_mps,
    );
    // Three sigma of a tenth of the speed, less what the 17 m between take.
    assert!((4.0..5.0).contains(&wider), "{wider}");
    assert!(lower > 4.0, "{lower}");
}

/// A brake that reaches 0.35 m/s^2 has failed on dry rails, and does what it can where wheels have slid.
#[test]
fn a_brake_on_slippery_rails_has_not_failed() {
    for (slides, lamp) in [
        (false, Indicator::Emergency),
        (true, Indicator::BrakeWarningRed),
    ] {
        let mut b = Bench::new(&well_known(1000.0));
        b.hear(0, 0.0, DangerLevel::High, 1300.0);
        let (mut run_m, mut speed_mps) = (0.0, 16.0);
        let mut last = None;
        for k in 0..80 {
            b.slides = slides && k < 5;
            speed_mps -= 0.035;
            run_m += 0.1 * speed_mps;
            last = Some(b.cycle(run_m, speed_mps));
        }
        let report = last.unwrap();
        assert_ne!(report.command.brake, BrakeDemand::None);
        assert_eq!(report.display.lamp, lamp, "{report:?}");
    }
}

/// While the wheels slide, the speed is less well known.
#[test]
fn a_slide_widens_the_estimated_speed() {
    let mut b = Bench::new(&at(1000.0, 0.5));
    let mut sigma_mps = |slides: bool| {
        b.slides = slides;
        b.cycle(0.0, 20.0);
        let estimate = b.protection.estimate(b.time, Direction::Up).unwrap();
        b = Bench::new(&at(1000.0, 0.5));
        estimate.covariance[1][1].sqrt()
    };
    let rolling_mps = 3.0 / 3.6 / 3.0;
    assert!((sigma_mps(false) - rolling_mps).abs() < 1e-9);
    assert!((sigma_mps(true) - f64::hypot(rolling_mps, 0.1 * 20.0)).abs() < 1e-9);
}

/// The odometer falls silent: the emergency brake, after the timeout and not before.
#[test]
fn silent_odometer_stops_the_train() {
    let mut b = Bench::new(&at(500.0, 0.5));
    b.cycle(0.0, 15.0);
    let later = |b: &mut Bench, s: f64| b.protection.cycle(b.time.plus(s)).supervision;
    assert_eq!(later(&mut b, 0.9), Supervision::Permitted);
    assert_eq!(later(&mut b, 1.1), Supervision::Emergency);
}

/// Not-a-number from any side must neither panic nor release the brake.
#[test]
fn nonsense_changes_nothing() {
    let mut b = Bench::new(&at(1000.0, 0.5));
    b.hear(0, 0.0, DangerLevel::High, 1020.0);
    b.hear(1, 1.0, DangerLevel::High, f64::NAN);
    b.protection.on_fix(&fix(b.time, f64::INFINITY, 0.1));
    b.protection.on_odometer(&OdometerSample {
        time: b.time.plus(0.05),
        distance_m: f64::NAN,
        speed_mps: f64::NAN,
        slides: false,
    });
    let r = b.cycle(0.0, 0.0);
    assert_eq!(r.command.brake, BrakeDemand::Service);
    assert!((r.position.unwrap().s_m - 1000.0).abs() < 1e-9);
}

/// A device of the map that is silent watches nothing: its stretch counts as occupied until its
/// first heartbeat and when its last one is too old, and is free again with the next one. A warning
/// of it stays.
#[test]
fn a_clear_track_is_clear_as_long_as_its_device_is_heard() {
    let mut map = Track::clone(&map(0.0));
    map.wayside.push(crate::track::WaysideSite {
        name: "W1".into(),
        chainage_m: 1800.0,
        lateral_m: -2.0,
        height_m: 3.0,
        yaw_deg: 170.0,
        pitch_deg: 0.0,
        balise: "B7".into(),
    });
    let settings = ProtectionSettings {
        initial_chainage_m: Some(1000.0),
        ..ProtectionSettings::default()
    };
    let map = Arc::new(map);
    let mut protection = Protection::new(&settings, map.clone());
    let end_m = |protection: &mut Protection, time_s: f64| {
        let time = SimTime::from_secs(time_s);
        protection.on_odometer(&OdometerSample {
            time,
            distance_m: 0.0,
            speed_mps: 0.0,
            slides: false,
        });
        protection.cycle(time).authority_end.map(|end| end.s_m)
    };
    let clear = |number: u32, time_s: f64| {
        let issued = SimTime::from_secs(time_s);
        warning(number, issued, DangerLevel::None, 1790.0)
    };
    let watched = Some(1800.0 - 80.0 - settings.safety_distance_m);
    assert_eq!(end_m(&mut protection, 0.0), watched);
    let under_way = ProtectionSettings {
        starts_under_way: Some(true),
        ..settings.clone()
    };
    let mut running = Protection::new(&under_way, map.clone());
    assert_eq!(end_m(&mut running, 0.0), None);
    assert_eq!(end_m(&mut running, 5.0), None);
    assert_eq!(end_m(&mut running, 5.1), watched);
    let at = SimTime::from_secs;
    protection.on_heartbeat(&clear(0, 5.1), at(5.1), at(5.6));
    assert_eq!(end_m(&mut protection, 5.6), None);
    assert_eq!(end_m(&mut protection, 10.1), None);
    assert_eq!(end_m(&mut protection, 10.2), watched);
    // What was said long ago, and comes only now, is not news.
    protection.on_heartbeat(&clear(0, 5.0), at(5.0), at(10.2));
    assert_eq!(end_m(&mut protection, 10.3), watched);
    // By balise one cannot tell whether the device is alive.
    protection.on_warning(&clear(1, 9.0), SimTime::from_secs(10.7));
    assert_eq!(end_m(&mut protection, 10.8), watched);
    let danger = warning(2, SimTime::from_secs(11.0), DangerLevel::High, 1790.0);
    protection.on_heartbeat(&danger, at(11.0), at(11.5));
    let obstacle = Some(1790.0 - settings.safety_distance_m);
    assert_eq!(end_m(&mut protection, 11.6), obstacle);
    // Of the rest of its stretch a device that has fallen silent says nothing.
    assert_eq!(end_m(&mut protection, 60.0), watched);
}
