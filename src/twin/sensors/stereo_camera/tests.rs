//! What is drawn, and what the frames say.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use super::*;
use crate::twin::sensors::{Exposed, ExposureMode, ExposureSettings, ReadOut, RigError};

/// A train that runs along x at 30 m/s from time zero on.
fn running(time: SimTime) -> Option<Isometry3<f64>> {
    let run = Isometry3::translation(30.0 * time.secs(), 0.0, 0.0);
    (time >= SimTime::ZERO).then_some(run)
}

/// What the frames say is the sheet; what is drawn is the truth: with its own start and lens
/// for either eye, at the place where the train is by then.
#[test]
fn frames_say_what_the_sheet_says() {
    let rig = RigSettings {
        trigger_offset_us: 1000.0,
        read_out: ReadOut::Up,
        calibration_error: RigError {
            trigger_offset_us: 200.0,
            k1: -0.01,
            ..RigError::default()
        },
        ..RigSettings::default()
    };
    let camera = StereoCamera::new(TrainId(0), &rig, &[], 1);
    let start = SimTime::from_secs(0.5);
    let [left, right] = camera.views(3, start, running).unwrap();
    assert_eq!(left.start, start);
    assert_eq!(right.start, start.plus(1.2e-3));
    assert_eq!(right.camera.shutter.first_row, 719);
    let k1 = right.camera.intrinsics.distortion.coefficients().k1;
    assert!((k1 + 0.01).abs() < 1e-12);
    let row = |view: &View, v: f64| {
        let time = view.camera.shutter.row_open(view.start, v);
        view.motion.pose_at(time).translation.x
    };
    let apart_m = row(&right, 719.0) - row(&left, 719.0);
    let eyes_m = (rig.calibration().vehicle_from_left * camera.rig.left_from_right)
        .translation
        .x
        + 0.5;
    assert!(
        (apart_m - eyes_m - 0.036).abs() < 1e-9,
        "{apart_m} {eyes_m}"
    );
    let header = FrameHeader {
        number: 3,
        start,
        start_true: start,
        with: Exposed {
            exposure_s: 20e-6,
            gain_db: 6.0,
        },
    };
    let pair = camera.pair(&header, [GrayImage::new(1, 1), GrayImage::new(1, 1)]);
    for eye in [&pair.left, &pair.right] {
        assert!((eye.exposure_s - 20e-6).abs() < 1e-12 && (eye.gain_db - 6.0).abs() < 1e-12);
    }
    assert_eq!(pair.left.start, start);
    assert_eq!(pair.right.start, start.plus(1e-3));
    assert!(rig.calibration().left.intrinsics.distortion.is_none());
}

/// An exposure that a control may lengthen is drawn from the train's own poses to its end, which
/// the session waits for.
#[test]
fn poses_cover_the_longest_exposure() {
    let rig = RigSettings {
        exposure_control: ExposureSettings {
            mode: ExposureMode::Auto,
            max_exposure_us: Some(12_000.0),
            ..ExposureSettings::default()
        },
        ..RigSettings::default()
    };
    let camera = StereoCamera::new(TrainId(0), &rig, &[], 1);
    let span_s = 719.0 * 22.2e-6 + 12e-3;
    assert!((camera.delay_s() - span_s).abs() < POSE_STEP_S);
    let [left, right] = camera.views(0, SimTime::ZERO, running).unwrap();
    for view in [left, right] {
        let [start, end] = [0.0, span_s].map(|s| {
            let pose = view.motion.pose_at(view.start.plus(s));
            pose.translation.x
        });
        assert!((end - start - 30.0 * span_s).abs() < 1e-9);
    }
}

/// Frames start about the time that they say, with the spread that was asked for, never before
/// time zero, never later than the poses are waited for; the pair's eyes alike.
#[test]
fn frames_jitter_about_their_times() {
    let rig = RigSettings {
        frame_jitter_us: 100.0,
        trigger_offset_us: -400.0,
        ..RigSettings::default()
    };
    let camera = StereoCamera::new(TrainId(0), &rig, &[], 1);
    let mut squares = 0.0;
    for number in 0..500 {
        let start = SimTime::from_secs(f64::from(number) / 30.0);
        let [left, right] = camera.views(number, start, running).unwrap();
        let late_s = left.start.since(start);
        if number > 0 {
            assert!((right.start.since(left.start) + 4e-4).abs() < 1e-9);
            squares += late_s * late_s / 499.0;
        }
        for view in [&left, &right] {
            assert!(view.start >= SimTime::ZERO);
            let last = view
                .start
                .plus(0.001 * (view.motion.poses.len() - 1) as f64);
            assert!(last.since(start) <= camera.delay_s() + 1e-9);
        }
    }
    let sigma_us = 1e6 * squares.sqrt();
    assert!((90.0..110.0).contains(&sigma_us), "{sigma_us}");
}
