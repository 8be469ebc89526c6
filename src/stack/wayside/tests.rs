//! The detector on drawn images whose truth is known.
#![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

use super::test_scene::*;
use super::*;
use crate::bus::lenses::EUROC;
use crate::bus::{CameraFault, Distortion, DistortionCoefficients, Intrinsics, SimTime};
use crate::track::Direction;

const STEADY: fn(u32, u32) -> f64 = |_, _| 1.0;

fn detector(scene: &TestScene, settings: &WaysideSettings) -> WaysideDetector {
    WaysideDetector::new(settings, scene.calibration.clone(), scene.map.clone())
}

fn quiet() -> WaysideSettings {
    WaysideSettings {
        keep_images: false,
        ..WaysideSettings::default()
    }
}

/// A train of six cars that runs up the line, as it reports itself.
fn train_report(head_m: f64, speed_mps: f64, time: SimTime) -> TrainReport {
    TrainReport {
        chainage_m: head_m,
        direction: Direction::Up,
        speed_mps,
        time,
        length_m: 118.0,
        ..TrainReport::default()
    }
}

/// Runs the frames of the reference.
fn taught(scene: &TestScene, settings: &WaysideSettings) -> WaysideDetector {
    let mut d = detector(scene, settings);
    for n in 0..settings.reference_frames {
        let report = d.on_frame(&scene.frame(n, STEADY, &[]), None, &[]);
        assert!(report.learning == (n + 1 < settings.reference_frames));
    }
    d
}

/// Noise alone, 300 frames: a threshold too near to the noise, or an overflow in sums, alarms.
#[test]
fn noise_raises_no_alarm() {
    let scene = TestScene::new(640, 360);
    let settings = quiet();
    let mut d = taught(&scene, &settings);
    for n in 10..310 {
        let report = d.on_frame(&scene.frame(n, STEADY, &[]), None, &[]);
        assert!(
            report.obstacles.is_empty() && report.blobs.is_empty(),
            "frame {n}"
        );
        assert!(d.message(&report).is_none());
        assert!(report.passage_possible);
    }
}

/// A wide lens with 20 % of barrel in the corners.
fn wide() -> Intrinsics {
    Intrinsics {
        distortion: EUROC[0].into(),
        ..Intrinsics::centred(1280, 720, 780.7)
    }
}

/// Crates over distance, size and contrast, through a straight and a wide lens: place, width and
/// height within two pixels' worth. The camera cannot see depth; the crate's near face is what it
/// places.
#[test]
fn crates_are_found_where_they_are() {
    for lens in [Intrinsics::centred(1280, 720, 733.4), wide()] {
        find_crates(&TestScene::through(lens));
    }
}

fn find_crates(scene: &TestScene) {
    let settings = quiet();
    let f_px = scene.calibration.camera.intrinsics.fx_px;
    for (s, l, size, grey) in [
        (193.0, 1.3, 0.3, 200.0),
        (190.0, 0.0, 0.3, 20.0),
        (180.0, 0.4, 0.4, 190.0),
        (165.0, -0.6, 0.5, 15.0),
        (150.0, 0.0, 0.8, 200.0),
        (135.0, 0.3, 1.0, 20.0),
    ] {
        let mut d = taught(scene, &settings);
        let item = Crate::on_bed(s, l, size);
        let mut last = None;
        for n in 10..14 {
            last = Some(d.on_frame(&scene.frame(n, STEADY, &[(item, grey)]), None, &[]));
        }
        let report = last.unwrap();
        assert_eq!(report.obstacles.len(), 1, "crate at {s} m");
        let o = &report.obstacles[0];
        let range = DEVICE_M - item.s.1;
        let pixel_m = range / f_px;
        // A row at the foot spans range^2 / (f H) along the bed.
        let row_m = range * range / (f_px * (2.8 - BED_M));
        assert!(
            (o.to_chainage_m - item.s.1).abs() < 2.0 * row_m + 0.05,
            "{s}: {} against {}",
            o.to_chainage_m,
            item.s.1
        );
        assert!(
            (o.lateral_m - l).abs() < 0.1 * size + 3.0 * pixel_m,
            "{s}: l {}",
            o.lateral_m
        );
        assert!(
            (o.width_m - size).abs() < 0.2 * size + 3.0 * pixel_m,
            "{s}: w {}",
            o.width_m
        );
        // The top's far edge is seen over the near one.
        let tilt = (2.8 - item.h.1) / range;
        let height = size + size * tilt;
        assert!(
            (o.height_m - height).abs() < 0.1 * size + 3.0 * pixel_m,
            "{s}: h {}",
            o.height_m
        );
        assert_eq!(o.danger, DangerLevel::High);
        assert!(report.emergency_needed && !report.passage_possible);
    }
}

/// A detector that does not know the distortion places what is off the axis wrongly; so the test
/// above tells whether it is used.
#[test]
fn a_lens_that_is_not_known_misplaces() {
    let scene = TestScene::through(wide());
    let mut straight = scene.calibration.clone();
    straight.camera.intrinsics.distortion = Distortion::default();
    let settings = quiet();
    let item = Crate::on_bed(193.0, -1.0, 0.3);
    let [known, unknown] = [scene.calibration.clone(), straight].map(|calibration| {
        let mut d = WaysideDetector::new(&settings, calibration, scene.map.clone());
        for n in 0..settings.reference_frames {
            d.on_frame(&scene.frame(n, STEADY, &[]), None, &[]);
        }
        let frame = |n| scene.frame(n, STEADY, &[(item, 200.0)]);
        (10..13).for_each(|n| drop(d.on_frame(&frame(n), None, &[])));
        let report = d.on_frame(&frame(13), None, &[]);
        (report.obstacles[0].to_chainage_m - item.s.1).abs()
    });
    assert!(unknown > 0.3 && unknown > 3.0 * known, "{known} {unknown}");
}

/// Echoes of a lidar from beside and behind the picture must not fall into it through a lens whose
/// polynomial turns back beyond its corners.
#[test]
fn what_is_out_of_the_picture_stays_out() {
    let lens = Intrinsics {
        distortion: DistortionCoefficients {
            k1: -0.3,
            k2: 0.03,
            ..DistortionCoefficients::default()
        }
        .into(),
        ..Intrinsics::centred(1280, 720, 1040.0)
    };
    assert!(lens.ray(0.0, 0.0).xy().norm() < lens.distortion.reach());
    for k in 0..400 {
        let off = 1.0 + 0.05 * f64::from(k);
        for angle in (0..8).map(|k| f64::from(k) * 0.7) {
            let echo = nalgebra::Point3::new(off * angle.cos(), off * angle.sin(), 1.0);
            let pixel = lens.project(&echo).unwrap();
            assert!(!lens.contains(&pixel), "{echo}: {pixel}");
        }
    }
}

/// With a lidar the depth is measured, and the place is no longer a matter of one row.
#[test]
fn lidar_sharpens_the_place() {
    let scene = TestScene::new(1280, 720);
    let settings = quiet();
    let item = Crate {
        s: (178.5, 181.0),
        l: (-0.4, 0.4),
        h: (BED_M, 0.6),
    };
    let scan = scene.scan(&[item]);
    let mut d = taught(&scene, &settings);
    let mut report = None;
    for n in 10..14 {
        report = Some(d.on_frame(&scene.frame(n, STEADY, &[(item, 20.0)]), Some(&scan), &[]));
    }
    let report = report.unwrap();
    let o = &report.obstacles[0];
    // The outline shows the front and, 2 m from the camera's side of it, the crate's long side.
    let seen = 0.8 + 2.0 * 2.5 / 21.5;
    // Rows of echoes on the top, 0.2 degrees apart and 2 m lower than the lidar.
    let row_m = 21.5 * 21.5 / 2.0 * 0.2f64.to_radians();
    assert!(
        (o.to_chainage_m - 181.0).abs() < 0.1,
        "near {}",
        o.to_chainage_m
    );
    assert!(
        (o.from_chainage_m - 178.5).abs() < row_m,
        "far {}",
        o.from_chainage_m
    );
    assert!((o.width_m - seen).abs() < 0.15, "width {}", o.width_m);
}

/// An adaptive background would lose it: 300 frames later the crate must still be there, under
/// the same warning, refreshed every second, never cleared.
#[test]
fn what_stays_stays_found() {
    let scene = TestScene::new(640, 360);
    let mut d = taught(&scene, &quiet());
    let item = Crate::on_bed(180.0, 0.0, 0.5);
    let mut messages = Vec::new();
    for n in 10..310 {
        let report = d.on_frame(&scene.frame(n, STEADY, &[(item, 20.0)]), None, &[]);
        assert_eq!(report.obstacles.len(), usize::from(n >= 12), "frame {n}");
        messages.extend(d.message(&report));
    }
    assert!(messages.iter().all(|m| m.danger == DangerLevel::High));
    // Confirmed in the third frame; then once a second over 29.7 s.
    assert_eq!(messages[0].issued, SimTime::from_secs(1.2));
    assert_eq!(messages.len(), 30);
    assert!(messages.windows(2).all(|w| w[1].number == w[0].number + 1));
}

/// A person walks across the track and leaves, a tool box stays: one confirmed thing while he is
/// there, the box after him, a clear message only when the box is gone too.
#[test]
fn a_worker_leaves_his_box() {
    let scene = TestScene::new(640, 360);
    let mut d = taught(&scene, &quiet());
    let mut messages = Vec::new();
    let mut boxes = 0;
    for n in 10..110u32 {
        let walked = f64::from(n - 10) * 0.1;
        let person = Crate {
            s: (178.0 + walked - 0.2, 178.0 + walked + 0.2),
            l: (0.3, 0.8),
            h: (BED_M, 1.55),
        };
        let tool_box = Crate {
            s: (180.0, 180.5),
            l: (-0.2, 0.2),
            h: (BED_M, 0.15),
        };
        let mut things = Vec::new();
        if n < 60 {
            things.push((person, 170.0));
        }
        if (30..90).contains(&n) {
            things.push((tool_box, 20.0));
        }
        let report = d.on_frame(&scene.frame(n, STEADY, &things), None, &[]);
        if (70..90).contains(&n) {
            assert_eq!(report.obstacles.len(), 1, "frame {n}");
            boxes += usize::from(report.danger == DangerLevel::High);
            assert!((report.obstacles[0].to_chainage_m - 180.5).abs() < 0.5);
        }
        messages.extend(d.message(&report));
    }
    assert_eq!(boxes, 20);
    let last = messages.last().unwrap();
    assert_eq!(last.danger, DangerLevel::None);
    // Taken away at 9.0 s, believed after ten frames without it.
    assert!(last.issued > SimTime::from_secs(9.8) && last.issued < SimTime::from_secs(10.2));
    let cleared = messages.iter().filter(|m| m.danger == DangerLevel::None);
    assert_eq!(cleared.count(), 1);
}

/// Lamps: saturated in the reference and flickering, with bands over all rows. Pixels that cannot
/// be compared must be left out, and the bands stay under the threshold.
#[test]
fn flicker_raises_no_alarm() {
    let scene = TestScene::new(640, 360);
    let mut d = detector(&scene, &quiet());
    let lamp = |u: u32, v: u32| u.abs_diff(330) < 12 && v.abs_diff(150) < 8;
    for n in 0..120u32 {
        let light = |u: u32, v: u32| {
            let bands = 1.0 + 0.03 * (f64::from(v) * 0.21 + f64::from(n) * 1.3).sin();
            if lamp(u, v) {
                if n % 2 == 0 { 9.0 } else { 1.5 }
            } else {
                bands
            }
        };
        let report = d.on_frame(&scene.frame(n, light, &[]), None, &[]);
        assert!(report.blobs.is_empty(), "frame {n}");
    }
}

/// The light doubles everywhere, or grows towards one side as before headlights: no alarm, and a
/// crate is still found. Without compensation all of it would be a difference.
#[test]
fn brightening_is_no_obstacle() {
    let scene = TestScene::new(640, 360);
    let item = Crate::on_bed(182.0, 0.0, 0.6);
    for with_crate in [false, true] {
        let mut d = taught(&scene, &quiet());
        let things = if with_crate {
            vec![(item, 5.0)]
        } else {
            vec![]
        };
        let mut found = 0;
        for n in 10..60u32 {
            let step = f64::from(n - 10) / 50.0;
            let light = |u: u32, _| 1.0 + step * (0.5 + f64::from(u) / 640.0);
            let report = d.on_frame(&scene.frame(n, light, &things), None, &[]);
            found += report.obstacles.len();
            if !with_crate {
                assert!(report.obstacles.is_empty(), "frame {n}");
            }
        }
        assert_eq!(found, if with_crate { 48 } else { 0 });
    }
}

/// A train comes into view behind a crate, its lamp blinding: the train is no obstacle, the
/// crate stays confirmed throughout, and without a report of the train it is found like any
/// other body.
#[test]
fn the_train_is_no_obstacle() {
    let scene = TestScene::new(640, 360);
    let item = Crate::on_bed(185.0, 0.0, 0.5);
    for reported in [true, false] {
        let mut d = taught(&scene, &quiet());
        let mut seen_train = false;
        for n in 10..60u32 {
            let head = 60.0 + 2.0 * f64::from(n - 10);
            let train = Crate {
                s: (head - 118.0, head),
                l: (-1.4, 1.4),
                h: (0.1, 3.8),
            };
            let near = 0.3 * (f64::from(n - 10) / 50.0);
            let light = |_, _| 1.0 + near;
            let frame = scene.frame(n, light, &[(train, 210.0), (item, 20.0)]);
            let report = train_report(head - 1.0, 20.0, frame.start.plus(-0.05));
            let report = d.on_frame(&frame, None, reported.then_some(report).as_slice());
            let behind = |o: &DetectedObstacle| o.to_chainage_m < 183.0;
            if reported {
                assert!(!report.obstacles.iter().any(behind), "train at {head} m");
                if n > 20 {
                    assert_eq!(report.obstacles.len(), 1, "train at {head} m");
                    let s = report.train_distance_exact_m.unwrap();
                    let paper = report.train_distance_m.unwrap();
                    assert!((s - (184.75 - head)).abs() < 0.5, "{s}");
                    assert!((paper - s).abs() < 0.5, "{paper} {s}");
                }
            } else {
                seen_train |= report.obstacles.iter().any(behind);
            }
        }
        assert!(reported || seen_train);
    }
}

/// The blind zone: what comes to lie within [`GLARE_M`] of a train's head is not found while the
/// train is there (the price of no false alarm in its headlights), and is when the train is farther
/// away, or gone. Whoever narrows or widens the zone meets this test.
#[test]
fn the_glare_of_a_train_hides_what_falls_before_it() {
    let scene = TestScene::new(640, 360);
    let item = Crate::on_bed(150.0, 0.0, 0.8);
    for (head_m, hidden) in [(Some(100.0), true), (Some(20.0), false), (None, false)] {
        let mut d = taught(&scene, &quiet());
        let mut look = |n: u32, things: &[(Crate, f64)], head_m: Option<f64>| {
            let frame = scene.frame(n, STEADY, things);
            let train = head_m.map(|head_m| train_report(head_m, 0.0, frame.start));
            d.on_frame(&frame, None, train.as_slice()).obstacles.len()
        };
        assert_eq!(look(10, &[], head_m), 0);
        for n in 11..40 {
            let expected = usize::from(!hidden && n >= 13);
            assert_eq!(look(n, &[(item, 20.0)], head_m), expected, "{head_m:?} {n}");
        }
        // The train has gone: three frames later it is found at the latest.
        let seen = [40, 41, 42].map(|n| look(n, &[(item, 20.0)], None));
        assert_eq!(seen[2], 1, "{seen:?}");
    }
}

/// The border of the blind zone passes over an obstacle, as it does before every train that comes:
/// what is left of it in the picture is lower and lies elsewhere. The obstacle keeps its danger and
/// its place until the train has gone by, frame by frame.
#[test]
fn the_border_of_the_blind_zone_changes_no_obstacle() {
    let scene = TestScene::new(1280, 720);
    let mut d = taught(&scene, &quiet());
    let item = [(Crate::on_bed(170.0, 0.0, 0.4), 200.0)];
    let mut whole = None;
    for n in 10..110u32 {
        let frame = scene.frame(n, STEADY, &item);
        let train = train_report(40.0 + 0.5 * f64::from(n), 0.0, frame.start);
        let report = d.on_frame(&frame, None, std::slice::from_ref(&train));
        if n < 14 {
            continue;
        }
        assert_eq!(report.obstacles.len(), 1, "train at {} m", train.chainage_m);
        let o = &report.obstacles[0];
        let whole = whole.get_or_insert_with(|| o.clone());
        assert_eq!(o.danger, DangerLevel::High, "{} m", train.chainage_m);
        assert!((o.to_chainage_m - whole.to_chainage_m).abs() < 0.5);
        assert!((o.height_m - whole.height_m).abs() < 0.1);
    }
}

/// A shadow walks over the track: no obstacle; the crate that lies in it is found.
#[test]
fn a_shadow_is_no_obstacle() {
    let scene = TestScene::new(640, 360);
    let item = Crate::on_bed(182.0, 0.0, 0.6);
    for with_crate in [false, true] {
        let mut d = taught(&scene, &quiet());
        let things = [(item, 170.0)];
        let things = if with_crate { &things[..] } else { &[] };
        for n in 10..60u32 {
            let edge = 150 + 4 * (n - 10);
            let light = |u: u32, v: u32| {
                if (edge..edge + 60).contains(&u) && (180..300).contains(&v) {
                    0.55
                } else {
                    1.0
                }
            };
            let report = d.on_frame(&scene.frame(n, light, things), None, &[]);
            let expected = usize::from(with_crate && n >= 12);
            assert_eq!(report.obstacles.len(), expected, "frame {n}");
        }
    }
}

/// Frames of another size, empty calibrations: no panic, nothing claimed.
#[test]
fn odd_input_is_survived() {
    let scene = TestScene::new(64, 36);
    let mut d = detector(&scene, &quiet());
    let other = TestScene::new(32, 36).frame(0, STEADY, &[]);
    assert!(d.on_frame(&other, None, &[]).learning);
    let mut calibration = scene.calibration.clone();
    for (w, h) in [(0, 0), (1, 1), (2, 7), (9, 2)] {
        calibration.camera.intrinsics = Intrinsics::centred(w, h, 10.0);
        let mut d = WaysideDetector::new(&quiet(), calibration.clone(), scene.map.clone());
        for number in 0..14 {
            let image = GrayImage::from_pixel(w, h, image::Luma([(number * 20) as u8]));
            let start = SimTime::from_secs(f64::from(number));
            let _ = d.on_frame(
                &Frame {
                    number,
                    start,
                    exposure_s: 8e-3,
                    gain_db: 0.0,
                    image,
                },
                None,
                &[],
            );
        }
    }
}

/// The feet of pixels: project bed points of straight and curved lines and place them back.
#[test]
fn foot_inverts_projection() {
    for curvature in [0.0, 1.0 / 300.0, -1.0 / 250.0] {
        let map = track(curvature);
        let calibration = calibration(&map, 1920, 1080);
        let sight = Sight::new(
            &WaysideSettings::default(),
            calibration.clone(),
            map.clone(),
        );
        let mut seen = 0;
        for k in 0..60 {
            let p = crate::track::TrackPoint {
                s_m: DEVICE_M - 8.0 - f64::from(k),
                l_m: f64::from(k % 7) * 0.4 - 1.2,
                h_m: BED_M,
            };
            let world = map.alignment.world_from_track(p);
            let in_camera = calibration
                .world_from_camera
                .inverse_transform_point(&world);
            let i = calibration.camera.intrinsics;
            let Some(px) = i.project(&in_camera) else {
                continue;
            };
            if px.x < 0.0 || px.y < 0.0 || px.x > 1919.0 || px.y > 1079.0 {
                continue;
            }
            let Some(foot) = sight.foot(px.x, px.y) else {
                // In a curve the inner wall may hide it.
                assert!(curvature != 0.0);
                continue;
            };
            seen += 1;
            assert!((foot.s_m - p.s_m).abs() < 0.02, "{foot:?} {p:?}");
            assert!((foot.l_m - p.l_m).abs() < 0.005, "{foot:?} {p:?}");
            let span = sight.gauge_span(px.x, px.y).unwrap();
            assert!(span.from_m <= p.s_m + 0.5 && span.to_m >= p.s_m - 0.5);
        }
        assert!(seen > 20, "curvature {curvature}: {seen}");
    }
}

/// A device whose camera is stuck (the image of before again and again, with new numbers), dead
/// (one grey), or gone says for a second that something is wrong, and then that the track is not
/// clear: silence would let the train pass. When it sees again, what fell meanwhile is found
/// before the warning ends.
#[test]
fn a_blind_device_is_not_silent() {
    let scene = TestScene::new(640, 360);
    let item = Crate::on_bed(180.0, 0.0, 0.5);
    for fault in [CameraFault::Frozen, CameraFault::Dead, CameraFault::Silent] {
        for falls in [false, true] {
            let mut d = taught(&scene, &quiet());
            let mut messages = Vec::new();
            for n in 10..80u32 {
                let things = [(item, 20.0)];
                let things = if falls && n >= 30 { &things[..] } else { &[] };
                let mut frame = scene.frame(n, STEADY, things);
                let gone = (20..50).contains(&n);
                match fault {
                    CameraFault::Frozen if gone => {
                        frame.image = scene.frame(19, STEADY, &[]).image;
                    }
                    CameraFault::Dead if gone => frame.image = GrayImage::new(640, 360),
                    _ => {}
                }
                let report = if fault == CameraFault::Silent && gone {
                    d.on_time(frame.start, &[])
                } else {
                    assert!(d.on_time(frame.start, &[]).is_none() || n == 50);
                    Some(d.on_frame(&frame, None, &[]))
                };
                let Some(report) = report else {
                    assert!(n < 30, "nothing said in frame {n}");
                    continue;
                };
                assert_eq!(report.camera.fault, gone.then_some(fault), "frame {n}");
                let blind = (30..54).contains(&n);
                assert_eq!(report.blind, blind, "{fault}: frame {n}");
                assert_eq!(report.passage_possible, !blind && (n < 54 || !falls));
                assert!(report.obstacles.is_empty() || (falls && n >= 52));
                messages.extend(d.message(&report));
            }
            let said: Vec<_> = messages.iter().map(|m| (m.blind, m.danger)).collect();
            let blind = messages.iter().filter(|m| m.blind).count();
            // At once, and every second until the frame at 5.4 s.
            assert_eq!(blind, 3, "{fault}: {said:?}");
            assert_eq!(messages[0].issued, SimTime::from_secs(3.0));
            let (from_m, to_m) = (messages[0].from_chainage_m, messages[0].to_chainage_m);
            assert!(from_m < DEVICE_M - 79.0 && to_m > DEVICE_M - 1.0 && to_m < DEVICE_M + 1.0);
            assert!(messages[..3].iter().all(|m| m.danger == DangerLevel::High));
            let after = if falls {
                DangerLevel::High
            } else {
                DangerLevel::None
            };
            assert_eq!(messages[3].danger, after, "{fault}: {said:?}");
        }
    }
}

/// Faults while the reference is learnt: a stuck image is not taken into it, a device that never
/// sees warns although it has learnt nothing, and a lost frame or two are no fault.
#[test]
fn a_device_that_never_sees_warns() {
    let scene = TestScene::new(640, 360);
    let mut d = detector(&scene, &quiet());
    let first = scene.frame(0, STEADY, &[]);
    let mut said = Vec::new();
    for n in 0..20 {
        let frame = Frame {
            number: n,
            start: SimTime::from_secs(f64::from(n) * FRAME_S),
            image: first.image.clone(),
            ..first
        };
        let report = d.on_frame(&frame, None, &[]);
        assert!(report.learning && !report.passage_possible);
        said.extend(d.message(&report));
    }
    assert_eq!(said.len(), 1);
    assert!(said[0].blind);
    let mut d = taught(&scene, &quiet());
    for (n, lost) in [(10, 0), (13, 2), (14, 0), (22, 7)] {
        let report = d.on_frame(&scene.frame(n, STEADY, &[]), None, &[]);
        assert_eq!(report.camera.lost, lost);
        assert!(report.passage_possible && d.message(&report).is_none());
    }
}

/// Fails where a change of light takes an alarm back: a crate that can no longer be told from the bed
/// stays confirmed, and is gone when the bed is seen in its place: in the light of the reference, or by
/// its texture.
#[test]
fn a_change_of_light_clears_nothing() {
    let scene = TestScene::new(640, 360);
    let item = Crate::on_bed(182.0, 0.0, 0.6);
    // In so little light there is no texture; in more than half of it there is.
    for (light, grey, gone) in [(0.3, 45.0, 129), (0.55, 88.0, 99)] {
        let mut d = taught(&scene, &quiet());
        let crate_there = [(item, grey)];
        let mut missed = 0;
        for n in 10..150u32 {
            let things = if n < 90 { &crate_there[..] } else { &[] };
            let frame = match n {
                30..120 => scene.frame(n, |_, _| light, things),
                _ => scene.frame(n, STEADY, things),
            };
            let report = d.on_frame(&frame, None, &[]);
            missed += u32::from((30..90).contains(&n) && report.blobs.is_empty());
            let lies = (12..gone).contains(&n);
            assert_eq!(report.obstacles.len(), usize::from(lies), "{light}: {n}");
        }
        // The frames must have been such that the crate was not found in them.
        assert!(missed > 50, "{light}: {missed}");
    }
}

/// Fails where a camera that sees nothing for want of light, or for too much of it, says that the track is
/// clear, from the start or when the lamps change; when they are as before the device sees again.
#[test]
fn a_tunnel_without_light_or_with_too_much_is_not_clear() {
    let scene = TestScene::new(640, 360);
    for level in [0.12, 3.0] {
        let light = |_: u32, _: u32| level;
        let mut d = detector(&scene, &quiet());
        for n in 0..40u32 {
            let report = d.on_frame(&scene.frame(n, light, &[]), None, &[]);
            assert!(!report.passage_possible, "{level}: frame {n}");
            assert_eq!(report.blind, n >= 19, "{level}: frame {n}");
        }
        let mut d = taught(&scene, &quiet());
        for n in 10..80u32 {
            let frame = match n {
                20..50 => scene.frame(n, light, &[]),
                _ => scene.frame(n, STEADY, &[]),
            };
            let report = d.on_frame(&frame, None, &[]);
            // A second after the last frame that showed the bed, until five have shown it again.
            assert_eq!(report.blind, (30..54).contains(&n), "{level}: frame {n}");
            // What shines may be taken for a body, darkness not.
            assert!(level > 1.0 || report.obstacles.is_empty());
        }
    }
}

/// Without light on 20 m of the bed the device is blind, without it on 5 m it is not (`unseen_bed_m`).
#[test]
fn a_dark_stretch_is_not_clear() {
    let scene = TestScene::new(640, 360);
    for (dark_m, blind) in [(20.0, true), (5.0, false)] {
        let mut d = taught(&scene, &quiet());
        let light = |u: u32, v: u32| match DEVICE_M - scene.bed_chainage_m(u, v) {
            away_m if (20.0..20.0 + dark_m).contains(&away_m) => 0.05,
            _ => 1.0,
        };
        let reports = (10..40).map(|n| d.on_frame(&scene.frame(n, light, &[]), None, &[]));
        let report = reports.last().unwrap();
        assert_eq!(report.blind, blind, "{dark_m} m: {:?}", report.bed);
    }
}

/// A train comes near, its headlights saturate their pixels, and a bright body is put down that saturates its own:
/// found, and nothing else. Provokes a body that is taken for headlights, wherever it lies, as long as a train is
/// within 200 m of it.
#[test]
fn a_bright_body_is_no_headlight() {
    let scene = TestScene::new(640, 360);
    let settings = quiet();
    let mut d = taught(&scene, &settings);
    let body = Crate::on_bed(182.0, 0.0, 0.6);
    for n in 10..40u32 {
        let head_m = 40.0 + f64::from(n);
        let lamps = Crate {
            s: (head_m - 0.1, head_m),
            l: (-1.2, 1.2),
            h: (0.6, 1.2),
        };
        let frame = scene.frame(n, STEADY, &[(lamps, 255.0), (body, 255.0)]);
        let train = train_report(head_m, 10.0, frame.start);
        let report = d.on_frame(&frame, None, &[train]);
        let found: Vec<_> = report.obstacles.iter().map(|o| o.from_chainage_m).collect();
        let expected = usize::from(n >= 12);
        assert_eq!(found.len(), expected, "frame {n}: {found:?}");
        assert!(found.iter().all(|m| (m - 182.0).abs() < 1.0), "{found:?}");
    }
}

/// Mist hides a body before it hides the light: the device says that it is blind, whether the mist was there
/// when it learnt or came later. Provokes brightness taken for sight. What it would miss is missed: a body at
/// 55 m, as much brighter than the bed as must be found, is found in thin mist and not in thick mist.
#[test]
fn mist_that_hides_a_body_blinds() {
    let mut scene = TestScene::new(640, 360);
    let settings = quiet();
    let grey = 97.0 * (1.0 + settings.least_contrast);
    let body = [(Crate::on_bed(145.0, 0.0, 1.2), grey)];
    let clear = f64::INFINITY;
    for (learnt_m, now_m, blind) in [
        (1000.0, 1000.0, false),
        (80.0, 80.0, true),
        (20.0, 20.0, true),
        (clear, 80.0, true),
        (clear, 20.0, true),
    ] {
        scene.visibility_m = learnt_m;
        let mut d = detector(&scene, &settings);
        for n in 0..settings.reference_frames {
            d.on_frame(&scene.frame(n, STEADY, &[]), None, &[]);
        }
        scene.visibility_m = now_m;
        let mut last = |frames: std::ops::Range<u32>, bodies: &[(Crate, f64)]| {
            let reports = frames.map(|n| d.on_frame(&scene.frame(n, STEADY, bodies), None, &[]));
            reports.last().unwrap()
        };
        let report = last(10..40, &[]);
        assert_eq!(report.blind, blind, "{learnt_m} m, {now_m} m");
        assert_eq!(report.passage_possible, !blind);
        if (learnt_m - now_m).abs() < 1.0 {
            let found = last(40..50, &body).obstacles.len();
            assert_eq!(found, usize::from(!blind), "{now_m} m");
        }
    }
}

/// A train that comes near hides the bed, and a device that did not see it sees no more for that. Provokes
/// a blind device that lets the train in as soon as it has stopped before the stretch.
#[test]
fn a_train_before_it_gives_no_sight_to_a_blind_device() {
    let mut scene = TestScene::new(640, 360);
    scene.visibility_m = 20.0;
    let settings = quiet();
    let mut d = detector(&scene, &settings);
    for n in 0..100u32 {
        let frame = scene.frame(n, STEADY, &[]);
        let train = train_report(40.0 + f64::from(n), 10.0, frame.start);
        let report = d.on_frame(&frame, None, &[train]);
        assert!(!report.passage_possible, "frame {n}");
        assert!(report.blind || n < 20, "frame {n}");
    }
}
