#![allow(clippy::unwrap_used, reason = "a test may panic")]
use super::scatterers::{BodyEchoSettings, ClutterSettings};
use super::signal::{Moving, RadarEcho};
use super::*;
use crate::bus::{RadarSheet, TrainCommand};
use crate::track::Tunnel;
use crate::twin::physics::{
    ObstacleMaterial, ObstacleSettings, ObstacleShape, PhysicsSettings, TrackSettings,
    TrainSettings,
};
use nalgebra::{Complex, Point3, Vector3};
use std::f64::consts::TAU;

/// Without errors, clutter and images.
fn plain() -> RadarSettings {
    RadarSettings {
        error: RadarError {
            mount_deg: 0.0,
            gain_db: 0.0,
            channel_gain_db: 0.0,
            channel_phase_deg: 0.0,
            quartz_ppm: 0.0,
        },
        clutter: ClutterSettings {
            range_m: 0.0,
            ..ClutterSettings::default()
        },
        wall_loss_db: 200.0,
        ..RadarSettings::default()
    }
}

/// Sum of all samples of a frame over what an echo straight ahead with a range and a speed would give: its amplitude.
fn matched(
    figures: &RadarSheet,
    counts: &[[i16; 2]],
    range_m: f64,
    speed_mps: f64,
) -> Complex<f64> {
    let w = &figures.waveform;
    let (senders, receivers) = (figures.transmitters_m.len(), figures.receivers_m.len());
    let mut sum = Complex::default();
    for (row, chirp) in counts.chunks(w.samples as usize).enumerate() {
        let begin_s = (row / receivers) as f64 * w.chirp_interval_s;
        assert!(senders * receivers * w.loops as usize > row);
        for (k, [re, im]) in chirp.iter().enumerate() {
            let t_s = k as f64 / w.sample_rate_hz;
            let tau = 2.0 * (range_m + speed_mps * (begin_s + t_s)) / 299_792_458.0;
            let turns = tau * (w.start_hz + w.slope_hzps * (t_s - 0.5 * tau));
            sum += Complex::new(f64::from(*re), f64::from(*im))
                * Complex::from_polar(1.0, -TAU * turns.fract());
        }
    }
    sum / counts.len() as f64
}

/// A point straight ahead, through all samples, noise and converter, stands out of the noise by what the radar equation
/// says, with all samples of all channels summed. Within 0.5 dB at 10, 50, 100 and 200 m: it is so strong that noise
/// moves it by less (35 dB: 0.2 dB).
#[test]
fn a_point_stands_out_by_the_radar_equation() {
    let figures = plain().sheet(TrainEnd::Front);
    let link = Link {
        sent_w: watts(figures.power_dbm),
        wave_m: figures.waveform.wave_m(),
        loss_db_m: 0.0,
    };
    let gain = 10f64.powf(1.2);
    let noise = noise_w(25e6, 13.0);
    let converter = Converter::new(&figures, 12, Stream::new(1, 0, "noise"));
    let channels = vec![Complex::new(1.0, 0.0); 8];
    let model = BeatModel {
        figures: &figures,
        channels: &channels,
    };
    for (frame, (range_m, section_m2)) in
        [(10.0, 1.0), (50.0, 30.0), (100.0, 300.0), (200.0, 5000.0)]
            .into_iter()
            .enumerate()
    {
        let power_w = link.echo_w(section_m2, [gain; 2], [range_m; 2]);
        let expected_db = 10.0 * (power_w * figures.frame_samples() as f64 / noise).log10();
        let way = Moving {
            place_m: Point3::new(range_m, 0.0, 0.0),
            velocity_mps: Vector3::new(-5.0, 0.0, 0.0),
        };
        let echo = RadarEcho {
            out: way,
            back: way,
            amplitude: converter::counts_of(&figures, power_w),
            phase_rad: 0.0,
        };
        let counts = converter.counts(frame as u32, &model.samples(&[echo]));
        let signal = matched(&figures, &counts, range_m, -5.0).norm_sqr();
        // Elsewhere there is noise alone: speeds and ranges far from it, on bins where it has no side lobes.
        let (bin_m, bin_mps) = (
            figures.waveform.range_bin_m(),
            figures.waveform.speed_bin_mps(2),
        );
        let away = (1..=40).map(|k| {
            let (off_m, off_mps) = (bin_m * f64::from(3 + k % 5), bin_mps * f64::from(20 + k));
            matched(&figures, &counts, range_m + off_m, -5.0 + off_mps).norm_sqr()
        });
        let mean = away.sum::<f64>() / 40.0;
        let all = noise / watts(figures.full_scale_dbm) * RadarSheet::FULL_SCALE.powi(2)
            / counts.len() as f64;
        assert!(
            (0.5..2.0).contains(&(mean / all)),
            "{range_m} m: noise {mean} for {all}"
        );
        let snr_db = 10.0 * (signal / all).log10();
        assert!(
            (snr_db - expected_db).abs() < 0.5,
            "{range_m} m: {snr_db} for {expected_db}"
        );
    }
}

const STEP: TrainCommand = TrainCommand::UNSUPERVISED;

fn tunnel() -> Arc<Tunnel> {
    let text = "name = 'line'\nplan = [{ kind = 'straight', length_m = 1000.0 }]\n\
                sections = [{ kind = 'rectangular', from_m = 0.0, left_m = 2.4, right_m = 2.4, ceiling_m = 4.6 }]\n";
    Arc::new(Tunnel::from_toml(text).unwrap())
}

fn train(start_m: f64, speed_kmh: f64, direction: crate::track::Direction) -> TrainSettings {
    TrainSettings {
        cars: 1,
        start_chainage_m: start_m,
        start_speed_kmh: speed_kmh,
        cruise_speed_kmh: speed_kmh,
        direction,
        ..TrainSettings::default()
    }
}

fn obstacle(chainage_m: f64, size_m: [f64; 3], material: ObstacleMaterial) -> ObstacleSettings {
    ObstacleSettings {
        body: ObstacleShape::Box { size_m },
        chainage_m,
        lateral_m: 0.0,
        height_m: 0.3,
        held_until_s: Some(1e3),
        material: Some(material),
        ..ObstacleSettings::default()
    }
}

/// A world after some steps.
fn world(trains: Vec<TrainSettings>, obstacles: Vec<ObstacleSettings>) -> World {
    let settings = PhysicsSettings {
        trains,
        obstacles,
        track: TrackSettings::default(),
        ..PhysicsSettings::default()
    };
    let mut world = World::new(tunnel(), &settings, 1, 0).unwrap();
    for _ in 0..10 {
        world.step(&[STEP, STEP]).unwrap();
    }
    world
}

fn mounted(settings: RadarSettings, train: u8, end: TrainEnd) -> MountedRadar {
    MountedRadar {
        train: TrainId(train),
        end,
        settings,
        seed: 1,
    }
}

fn radar(settings: RadarSettings, end: TrainEnd, world: &World) -> Radar {
    let tracks = &world.network().tracks;
    Radar::new(mounted(settings, 0, end), &[], tracks, &Air::default())
}

/// Power over ranges of bins, at the speed at which a standing thing is met.
fn profile(figures: &RadarSheet, frame: &RadarFrame, speed_mps: f64) -> Vec<f64> {
    let bin_m = figures.waveform.range_bin_m();
    let power =
        |k: u32| matched(figures, &frame.counts, bin_m * f64::from(k), speed_mps).norm_sqr();
    (0..140).map(power).collect()
}

fn strongest(profile: &[f64]) -> usize {
    let power = |k: &usize| profile[*k];
    (3..profile.len())
        .max_by(|a, b| power(a).total_cmp(&power(b)))
        .unwrap()
}

/// A metal box 60 m ahead of a running train is the strongest echo, where it is and as fast as the train comes; behind
/// a train in between there is nothing of it; the rear end sees nothing of what is ahead.
#[test]
fn a_box_is_found_where_it_lies_and_not_where_it_is_hidden() {
    let ahead = crate::track::Direction::Up;
    let metal = ObstacleMaterial::Metal;
    let lone = world(
        vec![train(200.0, 50.0, ahead)],
        vec![obstacle(260.0, [0.5; 3], metal)],
    );
    let mut front = radar(plain(), TrainEnd::Front, &lone);
    let start = lone.time();
    let frame = front.frame(&lone, 0, start).unwrap();
    let figures = plain().sheet(TrainEnd::Front);
    let head = lone.run_m(TrainId(0)).unwrap();
    let box_m = 260.0 - 0.25 - head;
    let seen = profile(&figures, &frame, -50.0 / 3.6);
    let expected = box_m / figures.waveform.range_bin_m();
    assert!(
        (strongest(&seen) as f64 - expected).abs() < 1.0,
        "{} for {expected}",
        strongest(&seen)
    );
    let noise = seen[3..50].iter().sum::<f64>() / 47.0;
    assert!(seen[strongest(&seen)] > 100.0 * noise);

    let mut rear = radar(plain(), TrainEnd::Rear, &lone);
    let behind = profile(&figures, &rear.frame(&lone, 0, start).unwrap(), 50.0 / 3.6);
    assert!(behind[strongest(&behind)] < 30.0 * noise);

    let both = vec![train(200.0, 0.0, ahead), train(250.0, 0.0, ahead)];
    let hidden = world(both, vec![obstacle(260.0, [0.5; 3], metal)]);
    let scene = |world: &World| {
        let mut front = radar(plain(), TrainEnd::Front, world);
        let received = front.scene.received(world, 0, world.time()).unwrap();
        let beyond = received
            .echoes
            .iter()
            .filter(|e| (59.0..61.0).contains(&e.out.place_m.x));
        beyond.count()
    };
    assert!(scene(&lone) > 0);
    assert_eq!(scene(&hidden), 0);
}

/// One seed gives one frame, byte by byte; another gives another, and so does the next frame.
#[test]
fn frames_follow_from_the_seed() {
    let ahead = crate::track::Direction::Up;
    let world = world(
        vec![train(200.0, 0.0, ahead)],
        vec![obstacle(240.0, [0.5; 3], ObstacleMaterial::Wood)],
    );
    let frame = |seed: u64, number: u32, threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let settings = RadarSettings::default();
        let mounted = MountedRadar {
            seed,
            ..mounted(settings, 0, TrainEnd::Front)
        };
        let mut radar = Radar::new(mounted, &[], &world.network().tracks, &Air::default());
        pool.install(|| radar.frame(&world, number, world.time()))
            .unwrap()
    };
    let first = frame(1, 0, 1);
    assert_eq!(first.counts.len(), 2 * 4 * 128 * 256);
    assert!(first == frame(1, 0, 2));
    assert!(first != frame(2, 0, 1));
    assert!(first.counts != frame(1, 1, 1).counts);
}

/// A person 30 m ahead in a tunnel with walls 2.4 m aside is seen over each of them: images at 5.4 m or so beside him.
#[test]
fn walls_mirror_what_is_ahead() {
    let ahead = crate::track::Direction::Up;
    let settings = RadarSettings {
        wall_loss_db: 0.0,
        ..plain()
    };
    let world = world(
        vec![train(200.0, 0.0, ahead)],
        vec![obstacle(230.0, [0.5; 3], ObstacleMaterial::Metal)],
    );
    let mut radar = radar(settings, TrainEnd::Front, &world);
    let echoes = radar
        .scene
        .received(&world, 0, world.time())
        .unwrap()
        .echoes;
    let aside = |low: f64, high: f64| {
        let images = echoes
            .iter()
            .filter(|e| (low..high).contains(&e.out.place_m.y) && e.out == e.back);
        images.count()
    };
    // Left wall at 2.4: images at 4.8 less the body's own 0.25 either way.
    assert!(aside(4.5, 5.1) > 0 && aside(-5.1, -4.5) > 0);
    let mixed = echoes.iter().filter(|e| e.out != e.back).count();
    assert!(mixed > 0 && mixed % 2 == 0, "{mixed}");
}

/// A train that faces this one, radars of both with the same plan: it is heard where its clock lets frames meet, and not
/// where its frames come between ours.
#[test]
fn a_train_that_faces_this_one_is_heard() {
    let (ahead, back) = (crate::track::Direction::Up, crate::track::Direction::Down);
    let world = world(
        vec![train(200.0, 0.0, ahead), train(300.0, 0.0, back)],
        Vec::new(),
    );
    let heard = |offset_ms: f64| {
        let mut theirs = plain();
        theirs.clock.offset_ms = offset_ms;
        let other = mounted(theirs, 1, TrainEnd::Front);
        let tracks = &world.network().tracks;
        let mut ours = Radar::new(
            mounted(plain(), 0, TrainEnd::Front),
            &[other],
            tracks,
            &Air::default(),
        );
        ours.scene
            .received(&world, 0, SimTime::ZERO)
            .unwrap()
            .interferers
    };
    assert_eq!(
        [heard(0.0).len(), heard(1.0).len(), heard(50.0).len()],
        [1, 1, 0]
    );
    let one = heard(0.0)[0];
    assert!(
        (one.place.place_m.x - 100.0).abs() < 1.0,
        "{}",
        one.place.place_m
    );
    // Friis by hand: 10 dBm + 12 dBi + 12 dBi, 100 m at 3.9 mm: -76.2 dBm against -45 dBm of full scale.
    let level_db = 20.0 * (one.amplitude / RadarSheet::FULL_SCALE).log10();
    assert!((level_db - (34.0 - 110.1 + 45.0)).abs() < 0.5, "{level_db}");
}

/// What echoes stronger than full scale is held at the converter's ends.
#[test]
fn a_near_train_drives_the_converter_to_its_ends() {
    let ahead = crate::track::Direction::Up;
    let settings = RadarSettings {
        bodies: BodyEchoSettings {
            train_slope_deg: 3.0,
            ..BodyEchoSettings::default()
        },
        full_scale_dbm: -72.0,
        ..plain()
    };
    let near = world(
        vec![train(200.0, 0.0, ahead), train(225.0, 0.0, ahead)],
        Vec::new(),
    );
    let far = world(vec![train(200.0, 0.0, ahead)], Vec::new());
    let held = |world: &World| {
        let frame = radar(settings.clone(), TrainEnd::Front, world)
            .frame(world, 0, world.time())
            .unwrap();
        let is_held = |c: &i16| [32752, -32768].contains(c);
        frame.counts.iter().flatten().filter(|c| is_held(c)).count()
    };
    assert!(held(&near) > 1000, "{}", held(&near));
    assert_eq!(held(&far), 0);
}
