//! What is broken shows, each fault as its key says, and the stack finds out by itself: small
//! pictures by the plain renderer, what is delivered, what is said of it.

use crate::common::{Make, cpu, gpu, sample, small_scenario};
use metrotwin::bus::{CameraFault, Content, DangerLevel, Intrinsics, Node, SimTime};
use metrotwin::session::{
    Event, Observer, ObserverError, RendererChoice, RunOptions, Summary, run,
};
use metrotwin::settings::read_toml;
use metrotwin::track::Tunnel;
use metrotwin::twin::faults::{FaultSettings, age};
use metrotwin::twin::lights::LampLight;
use metrotwin::twin::render::{Job, Renderer, Scene};
use std::hash::{DefaultHasher, Hash, Hasher};

/// Number and start of a pair, hashes of its images, faults of its eyes.
type SeenPair = (u32, SimTime, [u64; 2], [Option<CameraFault>; 2]);

/// Everything that a run delivers and says.
#[derive(Default)]
struct Seen {
    /// Time of the latest truth.
    now: SimTime,
    /// When each pair was delivered.
    delivered: Vec<SimTime>,
    /// Number, start, hashes of both eyes' images, faults.
    pairs: Vec<SeenPair>,
    /// Number, start, hash of the image, fault, blind.
    frames: Vec<(u32, SimTime, u64, Option<CameraFault>, bool)>,
    /// Camera events and warnings, as text.
    said: Vec<String>,
    warnings: Vec<(bool, DangerLevel)>,
    hasher: DefaultHasher,
}

fn hash(image: &image::GrayImage) -> u64 {
    let mut hasher = DefaultHasher::new();
    (image.dimensions(), image.as_raw()).hash(&mut hasher);
    hasher.finish()
}

impl Observer for Seen {
    fn observe(&mut self, event: &Event<'_>) -> Result<(), ObserverError> {
        match event {
            Event::Pair { pair, report, .. } => {
                let images = [hash(&pair.left.image), hash(&pair.right.image)];
                let faults = report.eyes.map(|eye| eye.fault);
                assert_eq!(report.number, pair.left.number);
                self.delivered.push(self.now);
                (self.pairs).push((pair.left.number, pair.left.start, images, faults));
                format!("{report:?}{images:?}").hash(&mut self.hasher);
            }
            Event::Wayside { frame, report, .. } => {
                let fault = report.camera.fault;
                let (start, image) = (frame.start, hash(&frame.image));
                (self.frames).push((report.number, start, image, fault, report.blind));
                image.hash(&mut self.hasher);
            }
            Event::Camera {
                time,
                camera,
                fault,
                ..
            } => {
                self.said.push(format!("{time} {camera} {fault:?}"));
            }
            Event::Message {
                node: Node::Train(_),
                message,
            } => {
                if let Content::Warning(warning) = &message.content {
                    self.warnings.push((warning.blind, warning.danger));
                }
                format!("{message:?}").hash(&mut self.hasher);
            }
            Event::Train { truth, .. } => self.now = truth.time,
            Event::Cost { .. } => {}
            other => format!("{other:?}").hash(&mut self.hasher),
        }
        Ok(())
    }
}

fn seen(faults: &str) -> (Seen, Summary) {
    let options = RunOptions {
        renderer: RendererChoice::Cpu,
        ..RunOptions::default()
    };
    let mut seen = Seen::default();
    let summary = run(&small_scenario(faults), &options, &mut [&mut seen]).unwrap();
    (seen, summary)
}

/// Fails where a frozen frame has an old number or time, another image than the one before, or is
/// taken for a good one; where the device is silent about it; or where it does not recover.
#[test]
fn a_frozen_wayside_camera_is_reported_and_fails_safe() {
    let (seen, summary) = seen(
        "[[faults.cameras]]\ncamera = 'W1530'\nfault = { kind = 'freeze' }\nfrom_s = 1.0\nto_s = 2.5\n",
    );
    assert!(seen.frames.len() > 35);
    for (k, (number, start, image, fault, blind)) in seen.frames.iter().enumerate() {
        assert_eq!(
            (*number, *start),
            (k as u32, SimTime::from_secs(0.1 * k as f64))
        );
        let frozen = (10..25).contains(&k);
        assert_eq!(k > 0 && *image == seen.frames[k - 1].2, frozen, "frame {k}");
        assert_eq!(*fault, frozen.then_some(CameraFault::Frozen));
        // One second without a good frame; then five good ones.
        assert_eq!(*blind, (20..29).contains(&k), "frame {k}");
    }
    let said = ["1.000 s W1530 Some(Frozen)", "2.500 s W1530 None"];
    assert_eq!(seen.said, said);
    assert_eq!(seen.warnings.first(), Some(&(true, DangerLevel::High)));
    assert_eq!(seen.warnings.last(), Some(&(false, DangerLevel::None)));
    let figures = &summary.cameras["W1530"];
    assert_eq!(figures.lost_frames, 0);
    let span = figures.faults[0];
    assert_eq!(
        (span.fault, span.from_s, span.to_s),
        (CameraFault::Frozen, 1.0, Some(2.5))
    );
    assert!(summary.cameras["rig.left"].faults.is_empty());
}

/// Fails where a lost frame is delivered, a number is given twice, or the gap is not counted; where
/// a camera that has gone for good is not missed.
#[test]
fn lost_frames_leave_gaps_and_silence_is_noticed() {
    let (seen, summary) = seen(
        "[[faults.cameras]]\ncamera = 'rig'\nfault = { kind = 'drop', frames = [3, 4, 9] }\n\
         [[faults.cameras]]\ncamera = 'W1530'\nfault = { kind = 'drop' }\nfrom_s = 1.0\n",
    );
    let numbers: Vec<u32> = seen.pairs.iter().map(|p| p.0).collect();
    assert_eq!(numbers[..8], [0, 1, 2, 5, 6, 7, 8, 10]);
    for (number, start, ..) in &seen.pairs {
        assert_eq!(*start, SimTime::from_secs(f64::from(*number) / 10.0));
    }
    for eye in ["rig.left", "rig.right"] {
        assert_eq!(summary.cameras[eye].lost_frames, 3);
        assert!(summary.cameras[eye].faults.is_empty());
    }
    assert_eq!(seen.frames.len(), 10);
    let silent = summary.cameras["W1530"].faults[0];
    assert_eq!((silent.fault, silent.to_s), (CameraFault::Silent, None));
    assert!((1.9..2.1).contains(&silent.from_s), "{}", silent.from_s);
    assert_eq!(seen.warnings.first(), Some(&(true, DangerLevel::High)));
}

/// Fails where the wrong eye, or both, are struck, or a pair is held back for the eye that is dead.
#[test]
fn one_eye_dies_alone() {
    let (seen, summary) = seen(
        "[[faults.cameras]]\ncamera = 'right'\nfault = { kind = 'dead' }\nfrom_s = 1.0\nto_s = 2.0\n\
         [[faults.cameras]]\ncamera = 'left'\nfault = { kind = 'drop' }\nfrom_s = 3.0\n",
    );
    let whole = [None, None];
    for (number, _, images, faults) in &seen.pairs {
        let expected = match number {
            10..20 => [None, Some(CameraFault::Dead)],
            30.. => [Some(CameraFault::Missing), None],
            _ => whole,
        };
        assert_eq!(*faults, expected, "pair {number}");
        let black = hash(&image::GrayImage::new(64, 36));
        assert_eq!(
            images.map(|i| i == black),
            [false, (10..20).contains(number)]
        );
    }
    assert!(seen.pairs.len() >= 39);
    assert_eq!(summary.cameras["rig.left"].faults.len(), 1);
    assert_eq!(summary.cameras["rig.right"].faults.len(), 1);
}

/// Late images of one camera come in their order, with the times at which they were taken, and do
/// not hold up another camera's.
#[test]
fn late_images_keep_their_times() {
    let (on_time, _) = seen("");
    let (late, _) = seen(
        "[[faults.cameras]]\ncamera = 'rig'\nfault = { kind = 'late', by_ms = 730.0 }\nfrom_s = 1.0\nto_s = 2.0\n",
    );
    assert_eq!(late.frames, on_time.frames);
    let same = on_time.pairs.iter().zip(&late.pairs);
    for (good, late) in same {
        assert_eq!((good.0, good.1, good.2), (late.0, late.1, late.2));
    }
    // The truth comes every 20 ms. Whoever follows a late pair waits for it.
    let waited = late.pairs.iter().zip(&late.delivered);
    for (k, (pair, delivered)) in waited.enumerate() {
        assert_eq!(pair.3, [None; 2]);
        let usual = on_time.delivered[k];
        let late_s = match k {
            10..20 => 0.73,
            20..27 => late.delivered[19].since(usual),
            _ => 0.0,
        };
        let off_s = delivered.since(usual) - late_s;
        assert!(off_s.abs() < 0.025, "pair {k}: {off_s}");
    }
}

/// Everything at once: nothing panics, and a second run is the same to the last bit.
#[test]
fn all_faults_at_once_are_survived_and_reproducible() {
    let all = "
        [[faults.lamps]]
        share = 0.3
        fault = { kind = 'dead' }
        [[faults.lamps]]
        share = 0.5
        fault = { kind = 'flicker', depth = 0.8 }
        [[faults.lamps]]
        from_m = 1290.0
        fault = { kind = 'dim', level = 0.3 }
        from_s = 1.0
        to_s = 2.0
        [[faults.cameras]]
        camera = 'rig'
        fault = { kind = 'drop', share = 0.2 }
        [[faults.cameras]]
        camera = 'W1530'
        fault = { kind = 'drop', share = 0.2 }
        [[faults.cameras]]
        camera = 'left'
        fault = { kind = 'freeze' }
        from_s = 0.5
        to_s = 1.5
        [[faults.cameras]]
        camera = 'right'
        fault = { kind = 'dead' }
        from_s = 1.2
        to_s = 3.0
        [[faults.cameras]]
        camera = 'rig'
        fault = { kind = 'late', by_ms = 300.0 }
        [[faults.cameras]]
        camera = 'W1530'
        fault = { kind = 'late', by_ms = 120.0 }
        [[faults.cameras]]
        camera = 'W1530'
        fault = { kind = 'freeze' }
        from_s = 2.0
        to_s = 3.5
    ";
    let (one, summary) = seen(all);
    let (two, again) = seen(all);
    assert_eq!(
        (one.pairs, one.frames, one.said),
        (two.pairs, two.frames, two.said)
    );
    assert_eq!(one.hasher.finish(), two.hasher.finish());
    assert_eq!(summary.cameras, again.cameras);
    assert!(
        summary
            .cameras
            .values()
            .all(|c| c.lost_frames > 0 && !c.faults.is_empty())
    );
}

/// The lamps of the sample scene with faults.
fn lamps(faults: &str) -> Scene {
    let mut scene = sample::scene();
    let faults: FaultSettings = read_toml(faults).unwrap();
    let tunnel = Tunnel::of_one(sample::track());
    age(&mut scene.lamps, &faults.lamps, &tunnel, 1);
    scene
}

fn draw(renderer: &mut dyn Renderer, time_s: f64) -> image::GrayImage {
    let mut job: Job = sample::wayside_job(&sample::track(), 103.7);
    job.time = SimTime::from_secs(time_s);
    job.views[0].camera.intrinsics = Intrinsics::centred(320, 180, 182.0);
    renderer.submit(&job).unwrap();
    renderer.collect().unwrap().remove(0)
}

/// A lamp that fails during a run darkens its disc and what it lit, as if it had never been lit; one
/// that comes back is as good as new. Fails where light that was computed before is kept.
fn lamps_fail_in_time(new: Make) {
    let good = draw(new(lamps("")).as_mut(), 0.0);
    let out = "lamps = [{ share = 0.5, fault = { kind = 'dead' } }]";
    let dark = draw(new(lamps(out)).as_mut(), 0.0);
    assert!(good != dark);
    let timed = "lamps = [{ share = 0.5, fault = { kind = 'dead' }, from_s = 1.0, to_s = 2.0 }]";
    let mut renderer = new(lamps(timed));
    let renderer = renderer.as_mut();
    for (time_s, expected) in [(0.5, &good), (1.0, &dark), (1.9, &dark), (2.0, &good)] {
        assert!(draw(renderer, time_s) == *expected, "at {time_s} s");
    }
}

#[test]
fn lamps_fail_in_time_in_the_plain_renderer() {
    lamps_fail_in_time(cpu);
}

#[test]
fn lamps_fail_in_time_on_the_gpu() {
    lamps_fail_in_time(gpu);
}

/// Half the light is half the light: of all lamps dimmed to one half, ambient light left out, every
/// pixel that is neither black nor white has half the grey over black.
#[test]
fn dim_lamps_give_as_much_less() {
    let scene = |faults: &str| {
        let mut scene = lamps(faults);
        let mut track = (*scene.tracks[0]).clone();
        track.ambient_lx = 0.0;
        scene.tracks = vec![track.into()];
        scene
    };
    let whole = draw(cpu(scene("")).as_mut(), 0.0);
    let text = "lamps = [{ fault = { kind = 'dim', level = 0.5 } }]";
    let half = draw(cpu(scene(text)).as_mut(), 0.0);
    let black = sample::wayside_job(&sample::track(), 100.0).views[0]
        .sensor
        .black_level_grey;
    let (mut sum, mut sum_half, mut n) = (0.0, 0.0, 0);
    for (a, b) in whole.iter().zip(half.iter()) {
        if (20..240).contains(a) {
            sum += f64::from(*a) - black;
            sum_half += f64::from(*b) - black;
            n += 1;
        }
    }
    assert!(n > 1000, "{n}");
    let ratio = sum_half / sum;
    assert!((ratio - 0.5).abs() < 0.005, "{ratio}");
}

/// A lamp that flickers is the same lamp in the mean.
#[test]
fn flicker_keeps_the_mean() {
    let text = "lamps = [{ fault = { kind = 'flicker', depth = 0.7, phase_deg = 30.0 } }]";
    let (good, bad) = (lamps(""), lamps(text));
    let light = |lamp: &LampLight, from_s: f64, to_s: f64| lamp.curve().mean(from_s, to_s);
    let mut swing = (f64::INFINITY, 0.0f64);
    for (good, bad) in good.lamps.iter().zip(&bad.lamps) {
        // Whole periods of code and mains alike.
        let ratio = light(bad, 0.0, 2.0) / light(good, 0.0, 2.0);
        assert!((ratio - 1.0).abs() < 2e-3, "{ratio}");
        for k in 0..10 {
            let from_s = 1e-3 * f64::from(k);
            let ratio = light(bad, from_s, from_s + 1e-3) / light(good, from_s, from_s + 1e-3);
            swing = (swing.0.min(ratio), swing.1.max(ratio));
        }
    }
    assert!(swing.0 < 0.4 && swing.1 > 1.6, "{swing:?}");
}
