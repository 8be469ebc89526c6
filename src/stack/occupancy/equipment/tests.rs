use super::*;
use crate::bus::{GnssSolution, ImuSample, OdometerSample, TrainId};
use crate::track::Tunnel;
use nalgebra::{Point3, Vector3};

/// Two tracks 4 m apart, the right one with two groups of balises; x is north-east.
const LINE: &str = "name = 'line'\n\
    datum = { latitude_deg = 48.2, longitude_deg = 15.6, heading_deg = 45.0 }\n\
    [[track]]\nname = 'right'\nstart = { north_m = 0.0 }\nplan = [{ kind = 'straight', length_m = 900.0 }]\n\
    balises = [{ name = 'A', chainage_m = 240.0 }, { name = 'B1', chainage_m = 300.0 }, { name = 'B2', chainage_m = 303.0 }]\n\
    sections = [{ kind = 'open', from_m = 0.0, width_m = 20.0 }]\n\
    [[track]]\nname = 'left'\nstart = { north_m = 4.0 }\nplan = [{ kind = 'straight', length_m = 900.0 }]\n\
    sections = [{ kind = 'shared', from_m = 0.0 }]\n";

const NODE: Node = Node::Train(TrainId(0));

fn message(time: SimTime, content: Content) -> Message {
    Message::own(NODE, time, content)
}

/// A run at 20 m/s from 100 m on.
fn evenly_m(seconds: f64) -> f64 {
    100.0 + 20.0 * seconds
}

fn inputs(balises: bool) -> Vec<Message> {
    inputs_of(evenly_m, balises)
}

/// Of a run that is at 20 m/s until 11 s: fixes once a second between both tracks, and balises.
fn inputs_of(place_m: impl Fn(f64) -> f64, balises: bool) -> Vec<Message> {
    let datum = Tunnel::from_toml(LINE).unwrap().datum.unwrap();
    let mut all = Vec::new();
    for k in 0..150u32 {
        let seconds = 0.1 * f64::from(k);
        let (time, along_m) = (SimTime::from_secs(seconds), place_m(seconds));
        all.push(message(
            time,
            Content::Odometer(OdometerSample {
                time,
                distance_m: along_m,
                speed_mps: 50.0 * (place_m(seconds + 0.01) - place_m(seconds - 0.01)),
                slides: false,
            }),
        ));
        if k % 10 == 0 {
            all.push(message(
                time,
                Content::Gnss(GnssFix {
                    time,
                    place: datum.geodetic(&Point3::new(along_m, 2.0, 0.0)),
                    covariance_m2: Matrix2::identity() * 4.0,
                    solution: GnssSolution::Single,
                    satellites: 9,
                }),
            ));
        }
    }
    // The head is 10 m ahead of the antenna.
    for (name, head_m) in [("A", 240.0), ("B1", 300.0), ("B2", 303.0)] {
        if balises {
            let time = SimTime::from_secs((head_m - 10.0 - 100.0) / 20.0);
            all.push(message(time, Content::BalisePassed(name.to_owned())));
        }
    }
    all.sort_by_key(|message| message.valid_at);
    all
}

fn equipment(with_datum: bool) -> TrackOccupancy {
    let tunnel = Tunnel::from_toml(LINE).unwrap();
    let datum = tunnel.datum.filter(|_| with_datum);
    let plan = PlanNetwork::of_network(&tunnel.network, datum).into();
    TrackOccupancy::new(NODE, plan, &tunnel.network, &OccupancySettings::default())
}

fn reports(inputs: &[Message], late_s: impl Fn(usize) -> f64) -> Vec<OccupancyReport> {
    reports_of(equipment(true), inputs, late_s)
}

fn reports_of(
    mut equipment: TrackOccupancy,
    inputs: &[Message],
    late_s: impl Fn(usize) -> f64,
) -> Vec<OccupancyReport> {
    let mut arrivals: Vec<(SimTime, &Message)> = (inputs.iter().enumerate())
        .map(|(k, message)| (message.valid_at.plus(late_s(k)), message))
        .collect();
    arrivals.sort_by_key(|(time, _)| *time);
    let mut reports = Vec::new();
    let mut arrivals = arrivals.into_iter().peekable();
    for k in 0..2000 {
        let now = SimTime::from_secs(0.01 * f64::from(k));
        while let Some((_, message)) = arrivals.next_if(|(time, _)| *time <= now) {
            equipment.on(message);
        }
        for message in equipment.cycle(now) {
            if let Content::Occupancy(report) = message.content {
                reports.push(report);
            }
        }
    }
    reports
}

/// A covariance that is turned by any heading is still one: no fix is lost for rounding.
#[test]
fn turned_covariances_are_symmetric() {
    let covariance = Matrix2::new(1.3, 0.4, 0.4, 0.7);
    for k in 0..1000 {
        let datum = Datum {
            heading_deg: 0.37 * f64::from(k),
            ..Tunnel::from_toml(LINE).unwrap().datum.unwrap()
        };
        let turned = in_world(&datum, &covariance);
        assert_eq!(turned, turned.transpose());
        let fix = Fix {
            time: SimTime::ZERO,
            place: Point3::origin().xy(),
            covariance_m2: turned,
        };
        assert!(fix.is_possible());
    }
}

/// Fails where what comes late is lost, or taken in after what is younger.
#[test]
fn the_order_of_arrival_does_not_matter() {
    let inputs = inputs(true);
    let at_once = reports(&inputs, |_| 0.0);
    let late = reports(&inputs, |k| 0.03 * (k * 7 % 6) as f64);
    assert_eq!(at_once, late);
    assert_eq!(at_once.iter().filter(|report| report.of_fix).count(), 15);
}

/// Fixes between two tracks cannot tell them apart; a group of balises of one of them does, to within the chance that it
/// is foreign, and two groups leave no other.
#[test]
fn balises_tell_the_track() {
    let last = |inputs: &[Message]| reports(inputs, |_| 0.0).pop().unwrap();
    let without = last(&inputs(false));
    assert!(without.tracks[0].probability < 0.9 && !without.identified);
    let with = last(&inputs(true));
    assert!(with.identified && with.tracks[0].track == TrackId(0));
    // 14 s at 20 m/s.
    assert!(
        (with.tracks[0].s_m - 380.0).abs() < 3.0,
        "{}",
        with.tracks[0].s_m
    );
    assert_eq!(with.tracks[0].facing, crate::track::Direction::Up);
    let mut one_group = inputs(true);
    one_group.retain(|m| m.content != Content::BalisePassed("A".to_owned()));
    let one = last(&one_group);
    assert!(one.tracks[0].track == TrackId(0) && !one.identified);
    let doubt = 1.0 - one.tracks[0].probability;
    assert!((1e-8..2e-6).contains(&doubt), "{doubt}");
}

/// Before the first fix a balise says where the train is.
#[test]
fn a_balise_is_a_start() {
    let only: Vec<_> = inputs(true)
        .into_iter()
        .filter(|message| !matches!(message.content, Content::Gnss(_)))
        .collect();
    let reports = reports(&only, |_| 0.0);
    assert!(reports.iter().all(|report| !report.of_fix));
    let known = reports.last().unwrap();
    assert_eq!(known.tracks[0].track, TrackId(0));
    assert!(known.identified);
}

/// The same with a wheel that stands, although the train runs on, from 11 s until then.
fn with_slide(mut inputs: Vec<Message>, until_s: f64) -> Vec<Message> {
    for message in &mut inputs {
        if let Content::Odometer(sample) = &mut message.content
            && (11.0..until_s).contains(&sample.time.secs())
        {
            (sample.speed_mps, sample.slides) = (0.0, true);
        }
    }
    inputs
}

/// Fails where a wheel that slides is taken for the train, or what is not known then for known: the train runs on as
/// before, or brakes by 1 m/s^2, with fixes and without.
#[test]
fn a_sliding_wheel_is_not_the_train() {
    for (brake_mps2, slide_s, fixes) in [
        (0.0, 1.5, true),
        (0.0, 1.5, false),
        (1.0, 1.5, true),
        (1.0, 1.5, false),
        (1.0, 3.0, true),
        (1.0, 3.0, false),
    ] {
        let place_m = |s: f64| evenly_m(s) - 0.5 * brake_mps2 * (s - 11.0).max(0.0).powi(2);
        let mut inputs = with_slide(inputs_of(place_m, true), 11.0 + slide_s);
        inputs.retain(|message| fixes || !matches!(message.content, Content::Gnss(_)));
        let reports = reports(&inputs, |_| 0.0);
        let mut judged = 0;
        for report in reports.iter().filter(|report| report.time.secs() > 11.0) {
            let seconds = report.time.secs();
            let best = report.tracks[0];
            let deviations = (best.s_m - place_m(seconds)) / best.sigma_m;
            assert!(
                report.identified && best.track == TrackId(0) && deviations.abs() < 2.0,
                "{brake_mps2} {slide_s} {fixes}: {deviations} at {seconds} s, {report:?}"
            );
            judged += 1;
        }
        assert!(judged >= 3, "{judged}");
    }
}

/// Fails where the speed of a slide is taken for exact: a wheel is 10 % slower before it is said to slide, then stands for
/// 1.5 s while the train runs on.
#[test]
fn a_slide_is_seen_late() {
    let mut inputs = with_slide(inputs(true), 12.5);
    inputs.retain(|message| !matches!(message.content, Content::Gnss(_)));
    for message in &mut inputs {
        if let Content::Odometer(sample) = &mut message.content
            && (10.65..11.0).contains(&sample.time.secs())
        {
            sample.speed_mps -= 2.0 * (sample.time.secs() - 10.5) / 0.4;
        }
    }
    let reports = reports(&inputs, |_| 0.0);
    let best = (reports.iter())
        .filter(|report| report.time.secs() > 12.4)
        .map(|report| {
            (
                report.tracks[0].s_m - evenly_m(report.time.secs()),
                report.tracks[0].sigma_m,
            )
        });
    for (error_m, sigma_m) in best {
        assert!(
            error_m < -3.0 && error_m > -2.0 * sigma_m,
            "{error_m} {sigma_m}"
        );
    }
}

/// Fails where the last car's turn is taken for the first one's: in a curve they differ.
#[test]
fn only_the_leading_car_turns_the_train() {
    let turning = |end: TrainEnd| {
        let mut inputs = inputs(false);
        inputs.extend((0..150).map(|k| {
            let time = SimTime::from_secs(0.1 * f64::from(k));
            let sample = ImuSample {
                time,
                end,
                gyro_rad_s: Vector3::new(0.0, 0.0, 0.1),
                accel_m_s2: Vector3::new(0.0, 0.0, 9.81),
            };
            message(time, Content::Imu(sample))
        }));
        reports(&inputs, |_| 0.0)
    };
    let without = reports(&inputs(false), |_| 0.0);
    assert_eq!(turning(TrainEnd::Rear), without);
    assert_ne!(turning(TrainEnd::Front), without);
}

/// A train without a receiver on a map that is nowhere on the earth knows its track by balises; a fix says nothing
/// there.
#[test]
fn without_a_datum_balises_are_left() {
    let reports = reports_of(equipment(false), &inputs(true), |_| 0.0);
    assert!(reports.iter().all(|report| !report.of_fix));
    let last = reports.last().unwrap();
    assert!(last.identified && last.tracks[0].track == TrackId(0));
}
