//! Tracking against theory: from where on a target is followed, how well, and what is taken for a mirror image.

use super::cfar::ordered_statistic_factor;
use super::testing::{Draw, Scatterer, frame, half_frame_s, noise_power, sheet};
use super::window::Weights;
use super::{RadarTracking, RadarTrackingSettings};
use crate::bus::{
    Content, ImuSample, Message, Node, OdometerSample, RadarFrame, RadarReport, RadarSheet,
    SimTime, TrainEnd, TrainId,
};
use crate::stack::Equipment;
use nalgebra::{Isometry3, Point3, Vector2, Vector3};
use std::f64::consts::PI;

const NODE: Node = Node::Train(TrainId(0));
const FRAME_S: f64 = 0.05;

/// A radar on a train that runs with a speed and a yaw rate.
struct Run {
    sheet: RadarSheet,
    tracking: RadarTracking,
    frames: u32,
    speed_mps: f64,
    yaw_rate_radps: f64,
    draw: Draw,
}

impl Run {
    fn new(sheet: &RadarSheet, settings: RadarTrackingSettings, speed_mps: f64, seed: u64) -> Self {
        Self {
            tracking: RadarTracking::new(NODE, settings, sheet),
            sheet: sheet.clone(),
            frames: 0,
            speed_mps,
            yaw_rate_radps: 0.0,
            draw: Draw::new(seed),
        }
    }

    /// One more frame, of scatterers in the radar frame.
    fn frame(&mut self, scatterers: &[Scatterer]) -> RadarReport {
        let start = SimTime::from_secs(1.0 + FRAME_S * f64::from(self.frames));
        for ms in [0.0, 10.0, 20.0, 30.0, 40.0] {
            let time = start.plus(1e-3 * ms);
            let sample = OdometerSample {
                time,
                distance_m: self.speed_mps * time.secs(),
                speed_mps: self.speed_mps,
                slides: false,
            };
            let imu = ImuSample {
                time,
                end: self.sheet.end,
                gyro_rad_s: Vector3::new(0.0, 0.0, self.yaw_rate_radps),
                accel_m_s2: Vector3::zeros(),
            };
            for content in [Content::Odometer(sample), Content::Imu(imu)] {
                self.tracking.on(&Message::own(NODE, time, content));
            }
        }
        let mut frame = frame(&self.sheet, scatterers, 1.0, &mut self.draw);
        (frame.number, frame.start) = (self.frames, start);
        self.frames += 1;
        let message = Message::own(NODE, start, Content::RadarFrame(frame));
        self.tracking.on(&message);
        let mut reports = self.tracking.cycle(start.plus(0.045));
        assert_eq!(reports.len(), 1);
        let Content::Radar(report) = reports.remove(0).content else {
            unreachable!("it gives reports only");
        };
        report
    }
}

/// A frame a quarter as long, so that many can be drawn.
fn short_sheet() -> RadarSheet {
    let mut sheet = sheet();
    sheet.waveform.loops = 32;
    sheet
}

/// Signal over noise in a cell in the middle of which the target is, by the radar equation.
fn snr(sheet: &RadarSheet, windows: &[Weights; 2], range_m: f64, cross_section_m2: f64) -> f64 {
    let wave_m = sheet.waveform.wave_m();
    let spread = wave_m.powi(2) * cross_section_m2 / ((4.0 * PI).powi(3) * range_m.powi(4));
    let gains_db = sheet.transmit_gain_dbi + sheet.receive_gain_dbi + sheet.power_dbm;
    let loss_db = windows[0].loss_db + windows[1].loss_db;
    let full = spread * 10f64.powf(0.1 * (gains_db - sheet.full_scale_dbm - loss_db));
    full * RadarSheet::FULL_SCALE.powi(2) / noise_power(sheet) * sheet.frame_samples() as f64
}

/// Of an echo that fluctuates (Swerling 1) by the ordered statistic: the closed form with the factor over 1 + S.
fn detection_probability(snr: f64, settings: &RadarTrackingSettings) -> f64 {
    let (cells, order) = (16, 12);
    let factor = ordered_statistic_factor(cells, order, settings.false_alarm_probability);
    let left = (0..order).map(|i| f64::from(cells - i));
    left.map(|left| left / (left + factor / (1.0 + snr)))
        .product()
}

/// Draws detections of an approach by their probability: the range at which M of N are first reached, where a run of
/// frames begins with a detection and ends when it can no longer succeed.
fn drawn_range_m(
    draw: &mut Draw,
    settings: &RadarTrackingSettings,
    (from_m, step_m): (f64, f64),
    probability: &dyn Fn(f64) -> f64,
) -> f64 {
    let (hits_wanted, frames) = (settings.confirm_hits, settings.confirm_frames);
    let (mut range_m, mut hits, mut age) = (from_m, 0, 0);
    while range_m > step_m {
        let is_hit = draw.uniform() < probability(range_m);
        if age > 0 || is_hit {
            (age, hits) = (age + 1, hits + u32::from(is_hit));
        }
        if hits >= hits_wanted {
            return range_m;
        }
        if age > 0 && hits + (frames - age) < hits_wanted {
            (hits, age) = (0, 0);
        }
        range_m -= step_m;
    }
    0.0
}

/// Range at which the target is first followed in the processed signal.
fn followed_range_m(
    sheet: &RadarSheet,
    (from_m, speed_mps): (f64, f64),
    cross_section_m2: f64,
    seed: u64,
) -> f64 {
    let mut run = Run::new(sheet, RadarTrackingSettings::default(), speed_mps, seed);
    let mut range_m = from_m + run.draw.uniform();
    while range_m > 1.0 {
        let area = cross_section_m2 * run.draw.exponential();
        let mut point = Scatterer::polar(range_m, 0.0, -speed_mps, area);
        point.phase_rad = 2.0 * PI * run.draw.uniform();
        let report = run.frame(&[point]);
        let near = |place: [f64; 2]| (place[0] - range_m).abs() < 3.0 && place[1].abs() < 10.0;
        if report.tracks.iter().any(|track| near(track.place_m)) {
            return range_m;
        }
        range_m -= speed_mps * FRAME_S;
    }
    0.0
}

/// A person of 0.5 and a car of 10 square metres that the train comes near to at nearly 15 m/s, and that fluctuate from
/// frame to frame (Swerling 1): the mean range from which they are followed is that of the probability of detection at
/// each range and of M of N, within the 99.9 % interval of the mean. Speed and azimuth are in the middle of cells; the
/// range drifts through them, and its loss between them is in the theory.
#[test]
fn val_targets_are_followed_from_where_theory_says() {
    let (sheet, settings) = (short_sheet(), RadarTrackingSettings::default());
    let windows = super::range_doppler::weights(&sheet, &settings);
    let speed_mps = 6.0 * sheet.waveform.speed_bin_mps(2);
    for (area_m2, from_m) in [(0.5, 70.0), (10.0, 140.0)] {
        let probability = |range_m: f64| {
            let bins = range_m / sheet.waveform.range_bin_m();
            let between = windows[0].response(bins - bins.round()).powi(2);
            detection_probability(between * snr(&sheet, &windows, range_m, area_m2), &settings)
        };
        let mut draw = Draw::new(21);
        let drawn: Vec<f64> = (0..4000)
            .map(|_| {
                let from_m = from_m + draw.uniform();
                drawn_range_m(
                    &mut draw,
                    &settings,
                    (from_m, speed_mps * FRAME_S),
                    &probability,
                )
            })
            .collect();
        let mean = drawn.iter().sum::<f64>() / drawn.len() as f64;
        let variance = drawn.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / drawn.len() as f64;
        let runs = 12;
        let followed = (0..runs).map(|k| followed_range_m(&sheet, (from_m, speed_mps), area_m2, k));
        let followed = followed.sum::<f64>() / runs as f64;
        let sigma = (variance / runs as f64).sqrt();
        assert!(
            (followed - mean).abs() < 3.29 * sigma,
            "{area_m2} m^2: {followed} m, theory {mean} m, sigma {sigma} m"
        );
    }
}

/// A target that stands beside the line of a train in a curve, followed from the head and, by a radar that is turned and
/// mounted aside, from the rear, which runs backwards: its speed over ground is none, its place and its cross-section
/// are right.
#[test]
fn a_standing_target_has_no_speed_over_ground() {
    for (end, yaw_rad) in [
        (TrainEnd::Front, 0.0),
        (TrainEnd::Front, 0.2),
        (TrainEnd::Rear, -0.1),
    ] {
        let mut sheet = short_sheet();
        sheet.end = end;
        sheet.vehicle_from_radar =
            Isometry3::new(Vector3::new(0.5, 0.8, 1.0), Vector3::z() * yaw_rad);
        let train_mps = if end == TrainEnd::Front { 12.0 } else { -12.0 };
        let (yaw_rate_radps, frames) = (0.04, 60);
        let mut run = Run::new(&sheet, RadarTrackingSettings::default(), 12.0, 9);
        run.yaw_rate_radps = yaw_rate_radps;
        let world = Point3::new(if train_mps > 0.0 { 70.0 } else { 25.0 }, 2.0, 1.0);
        let mut last = None;
        for k in 0..frames {
            let time_s = FRAME_S * f64::from(k) + half_frame_s(&sheet);
            // On a circle from the origin along x.
            let turned = yaw_rate_radps * time_s;
            let radius_m = train_mps / yaw_rate_radps;
            let place = Vector3::new(
                radius_m * turned.sin(),
                radius_m * (1.0 - turned.cos()),
                0.0,
            );
            let vehicle = Isometry3::new(place, Vector3::z() * turned);
            let in_vehicle = vehicle.inverse_transform_point(&world);
            let around = Vector3::new(-in_vehicle.y, in_vehicle.x, 0.0) * yaw_rate_radps;
            let velocity = -Vector3::new(train_mps, 0.0, 0.0) - around;
            let point = Scatterer {
                place_m: sheet
                    .vehicle_from_radar
                    .inverse_transform_point(&in_vehicle),
                velocity_mps: sheet.vehicle_from_radar.inverse_transform_vector(&velocity),
                cross_section_m2: 20.0,
                phase_rad: 0.0,
            };
            let report = run.frame(&[point]);
            last = Some((in_vehicle, report));
        }
        let (truth, report) = last.unwrap();
        assert_eq!(report.tracks.len(), 1, "{:?}", report.tracks);
        let track = &report.tracks[0];
        let off = (Vector2::from(track.place_m) - truth.coords.xy()).norm();
        let speed = Vector2::from(track.velocity_mps).norm();
        assert!(off < 0.5 && speed < 0.5, "{end:?}: {off} m, {speed} m/s");
        assert!(track.frames > frames - 10, "{}", track.frames);
        assert!(
            (track.cross_section_m2 / 20.0 - 1.0).abs() < 0.15,
            "{track:?}"
        );
    }
}

/// A train that comes near at more than the speeds that alias: by the train's own speed it has its real one.
#[test]
fn an_oncoming_train_has_its_speed_in_spite_of_aliasing() {
    let mut run = Run::new(&short_sheet(), RadarTrackingSettings::default(), 22.0, 3);
    let mut range_m = 150.0;
    let mut last = None;
    while range_m > 60.0 {
        last = Some(run.frame(&[Scatterer::polar(range_m, 0.05, -44.0, 200.0)]));
        range_m -= 44.0 * FRAME_S;
    }
    let report = last.unwrap();
    assert_eq!(report.tracks.len(), 1, "{:?}", report.tracks);
    let velocity = report.tracks[0].velocity_mps;
    assert!((velocity[0] + 22.0).abs() < 0.5, "{velocity:?}");
}

/// A person beside the track of a tunnel whose left wall echoes all along, and the image in it; and
/// another person, who mirrors nobody. The image is a ghost, the persons are not; without a wall nobody is.
#[test]
fn images_in_a_wall_are_ghosts_and_people_are_not() {
    for has_walls in [true, false] {
        let sheet = sheet();
        let train_mps = 8.0;
        let mut run = Run::new(&sheet, RadarTrackingSettings::default(), train_mps, 13);
        let mut report = None;
        for k in -50..60 {
            let time_s = FRAME_S * f64::from(k);
            let seen = |x: f64, y: f64, velocity: [f64; 2], area_m2: f64| Scatterer {
                place_m: Point3::new(x, y, 0.0),
                velocity_mps: Vector3::new(velocity[0] - train_mps, velocity[1], 0.0),
                cross_section_m2: area_m2,
                phase_rad: 1.7 * f64::from(k) + x + y,
            };
            let person = seen(
                26.0 - (train_mps - 1.0) * time_s,
                -1.5 + 0.2 * time_s,
                [1.0, 0.2],
                2.0,
            );
            let mut image = person;
            image.place_m.y = 2.0 * 3.5 - person.place_m.y;
            image.velocity_mps.y *= -1.0;
            image.cross_section_m2 = 0.8;
            let other = seen(34.0 - (train_mps - 1.5) * time_s, -2.5, [1.5, 0.0], 1.0);
            let mut scatterers = if k < 0 {
                vec![]
            } else {
                vec![person, image, other]
            };
            for j in 0..if has_walls { 8 } else { 0 } {
                // Things on the wall, from 6 to 24 m: they pass, and others come.
                let x = 6.0 + (2.2 * f64::from(j) - train_mps * time_s).rem_euclid(17.6);
                scatterers.push(seen(x, 3.5, [0.0, 0.0], 0.2));
            }
            report = Some((run.frame(&scatterers), person, image, other));
        }
        let (report, person, image, other) = report.unwrap();
        let track = |of: &Scatterer| {
            let off = |place: [f64; 2]| (Vector2::from(place) - of.place_m.coords.xy()).norm();
            let near = report
                .tracks
                .iter()
                .filter(|track| off(track.place_m) < 2.0);
            near.min_by(|a, b| off(a.place_m).total_cmp(&off(b.place_m)))
        };
        assert!(!track(&person).unwrap().is_ghost && !track(&other).unwrap().is_ghost);
        assert_eq!(
            track(&image).unwrap().is_ghost,
            has_walls,
            "{:?}",
            report.tracks
        );
    }
}

/// Provokes: frames out of order, of another end, of wrong size; samples that are no numbers.
#[test]
fn wrong_messages_are_left_out() {
    let sheet = short_sheet();
    let mut run = Run::new(&sheet, RadarTrackingSettings::default(), f64::NAN, 1);
    run.yaw_rate_radps = f64::INFINITY;
    let report = run.frame(&[Scatterer::polar(20.0, 0.0, 0.0, 10.0)]);
    assert_eq!(report.detections.len(), 1);
    let mut frame = frame(&sheet, &[], 1.0, &mut run.draw);
    frame.start = SimTime::from_secs(0.5);
    let mut given = |frame: &RadarFrame| {
        let message = Message::own(NODE, frame.start, Content::RadarFrame(frame.clone()));
        run.tracking.on(&message);
        run.tracking.cycle(SimTime::from_secs(9.0)).len()
    };
    assert_eq!(given(&frame), 0);
    frame.start = SimTime::from_secs(3.0);
    frame.end = TrainEnd::Rear;
    assert_eq!(given(&frame), 0);
    frame.end = TrainEnd::Front;
    frame.counts.pop();
    assert_eq!(given(&frame), 0);
    frame.counts.push([0, 0]);
    assert_eq!(given(&frame), 1);
}
