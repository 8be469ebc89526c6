//! A train on a line: what its sensors measure, and what the filter says of it.

use super::tally::{AtSwitch, Tally};
use metrotwin::bus::SimTime;
use metrotwin::stack::occupancy::{Decision, Fix, Occupancy, OccupancySettings};
use metrotwin::track::plan::PlanNetwork;
use metrotwin::twin::random::Stream;
use nalgebra::{Matrix2, Point2, Vector2};
use std::sync::Arc;

const RATE_HZ: f64 = 5.0;
/// Speeds and yaw rates for each fix.
const PARTS: u64 = 10;
/// Half of the distance of the bogies, which is not what the filter takes it for.
const HALF_M: f64 = 6.3;
/// A run begins so far behind the line's begin, and ends so far before its end.
const INSIDE_M: f64 = 20.0;
/// The next switch counts from so far before it: a place that is wrong by less is no wrong track.
const BEFORE_END_M: f64 = 15.0;

/// How a receiver errs.
#[derive(Clone, Copy)]
pub struct FixErrors {
    /// Share of the variance that changes slowly, and of that the share that lasts.
    pub slow_share: f64,
    pub lasting_share: f64,
    /// Time constants of the rest of it, and of that share.
    pub correlation_s: f64,
    pub lasting_s: f64,
    /// Jumps an hour, by 10 m.
    pub jumps_per_h: f64,
    /// Of a fix.
    pub covariance_m2: Matrix2<f64>,
}

pub const AS_BELIEVED: FixErrors = FixErrors {
    slow_share: 0.8,
    lasting_share: 0.5,
    correlation_s: 60.0,
    lasting_s: 1800.0,
    jumps_per_h: 0.0,
    // 1 m on each axis, more along one diagonal than along the other.
    covariance_m2: Matrix2::new(1.0, 0.5, 0.5, 1.0),
};

/// One run over a line.
#[derive(Clone, Copy)]
pub struct Run {
    pub errors: FixErrors,
    pub speed_mps: f64,
    pub seed: u64,
    pub with_gyro: bool,
    /// From the end of the line to its begin, as if time ran back and the train had turned.
    pub reversed: bool,
}

/// The elements that a run leads over, in a row, with where each begins along it.
struct Way<'a> {
    world: &'a PlanNetwork,
    elements: Vec<(usize, f64)>,
    length_m: f64,
}

impl<'a> Way<'a> {
    fn new(world: &'a PlanNetwork, elements: impl Iterator<Item = usize>) -> Self {
        let mut way = Self {
            world,
            elements: Vec::new(),
            length_m: 0.0,
        };
        for element in elements {
            way.elements.push((element, way.length_m));
            way.length_m += world.elements[element].length_m();
        }
        way
    }

    /// Element, distance along it, and place.
    fn at(&self, m: f64) -> (usize, f64, Point2<f64>) {
        let after = self.elements.partition_point(|(_, from_m)| *from_m <= m);
        let (element, from_m) = self.elements[after.saturating_sub(1)];
        let along_m = m - from_m;
        (element, along_m, self.world.elements[element].at(along_m).0)
    }

    /// Of the car's chord, for each metre that it runs on.
    fn turn_per_m(&self, m: f64) -> f64 {
        let heading = |m: f64| {
            let chord = self.at(m + HALF_M).2 - self.at(m - HALF_M).2;
            chord.y.atan2(chord.x)
        };
        (heading(m + 0.1) - heading(m - 0.1)) / 0.2
    }
}

/// Errors of a receiver, from one fix to the next.
struct Receiver {
    errors: FixErrors,
    stream: Stream,
    /// What changes with the surroundings, and what lasts, each of variance 1.
    slow: [Vector2<f64>; 2],
}

impl Receiver {
    fn new(errors: FixErrors, stream: Stream) -> Self {
        let normal = |k| Vector2::new(stream.normal(k), stream.normal(k + 1));
        let slow = [normal(0), normal(2)];
        Self {
            errors,
            stream,
            slow,
        }
    }

    /// Of fix number k, from 1 on.
    fn error(&mut self, k: u64) -> Vector2<f64> {
        let FixErrors {
            slow_share,
            lasting_share,
            ..
        } = self.errors;
        let stream = &self.stream;
        let normal = |what| {
            Vector2::new(
                stream.normal(16 * k + what),
                stream.normal(16 * k + what + 1),
            )
        };
        let times_s = [self.errors.correlation_s, self.errors.lasting_s];
        for (part, (slow, time_s)) in self.slow.iter_mut().zip(times_s).enumerate() {
            let keep = (-1.0 / (RATE_HZ * time_s)).exp();
            *slow = *slow * keep + normal(2 * part as u64) * (1.0 - keep * keep).sqrt();
        }
        let jumps = self.errors.jumps_per_h / 3600.0 / RATE_HZ;
        if stream.uniform(16 * k + 4) < jumps {
            let around_sigma = (slow_share * (1.0 - lasting_share)).sqrt();
            self.slow[0] += normal(5) * (10.0 / around_sigma);
        }
        let [around, lasting] = self.slow;
        let slow = around * (1.0 - lasting_share).sqrt() + lasting * lasting_share.sqrt();
        let error = slow * slow_share.sqrt() + normal(7) * (1.0 - slow_share).sqrt();
        let root = self.errors.covariance_m2.cholesky().unwrap();
        root.l() * error
    }
}

/// Drives a train over its way, and says after each fix what the filter decided, on which element the train was and
/// how far along it, metres.
fn drive(
    run: &Run,
    way: &Way<'_>,
    occupancy: &mut Occupancy,
    mut after_fix: impl FnMut(&Decision, usize, f64),
) {
    let Run {
        speed_mps, seed, ..
    } = *run;
    let stream = |name: &str| Stream::new(seed, (speed_mps * 100.0) as u64, name);
    let (speeds, yaw_rates, offsets) = (stream("speeds"), stream("yaw rates"), stream("offsets"));
    let mut receiver = Receiver::new(run.errors, stream("fixes"));
    let (scale, yaw_offset) = (1.0 + 0.01 * offsets.normal(0), 5e-4 * offsets.normal(1));
    let sign = if run.reversed { -1.0 } else { 1.0 };
    let count = ((way.length_m - 2.0 * INSIDE_M) / speed_mps * RATE_HZ) as u64;
    for k in 1..count {
        let time = SimTime::from_secs(k as f64 / RATE_HZ);
        let run_m = INSIDE_M + speed_mps * k as f64 / RATE_HZ;
        let m = if run.reversed {
            way.length_m - run_m
        } else {
            run_m
        };
        for part in 1..=PARTS {
            let number = k * PARTS + part;
            let back_s = (PARTS - part) as f64 / (RATE_HZ * PARTS as f64);
            let (time, m) = (time.plus(-back_s), m - sign * speed_mps * back_s);
            occupancy.on_speed(time, speed_mps * scale + 0.05 * speeds.normal(number));
            if run.with_gyro {
                let rate_radps = way.turn_per_m(m) * sign * speed_mps;
                let noise = yaw_offset + 3e-3 * yaw_rates.normal(number);
                occupancy.on_yaw_rate(time, rate_radps + noise);
            }
        }
        let (element, along_m, place) = way.at(m);
        occupancy.on_fix(&Fix {
            time,
            place: place + receiver.error(k),
            covariance_m2: run.errors.covariance_m2,
        });
        after_fix(&occupancy.decision(), element, along_m);
    }
}

/// A run over all stages of a line, whose legs are drawn.
pub fn over_line(
    (world, map): (&PlanNetwork, Arc<PlanNetwork>),
    settings: &OccupancySettings,
    run: &Run,
    tally: &mut Tally,
) {
    let legs = Stream::new(run.seed, (run.speed_mps * 100.0) as u64, "legs");
    let stages = world.elements.len() / 3;
    // Back it goes from the last stem on: its first leg, too, is entered over a toe.
    let elements = (0..stages).flat_map(|stage| {
        let leg = 1 + usize::from(legs.uniform(stage as u64) < 0.5);
        let is_left_out = run.reversed && stage + 1 == stages;
        [Some(3 * stage), (!is_left_out).then_some(3 * stage + leg)]
    });
    let way = Way::new(world, elements.flatten());
    let mut occupancy = Occupancy::new(map, *settings);
    tally.calibration.begin_run();
    let mut at = Progress::default();
    drive(run, &way, &mut occupancy, |decision, element, along_m| {
        let length_m = world.elements[element].length_m();
        let from_toe_m = if run.reversed {
            length_m - along_m
        } else {
            along_m
        };
        tally
            .switches
            .extend(at.after_fix(decision, element, from_toe_m, length_m));
        tally.add(decision, (element, along_m), length_m);
    });
}

/// A run along the first of two tracks.
pub fn along_first(
    (world, map): (&PlanNetwork, Arc<PlanNetwork>),
    settings: &OccupancySettings,
    run: &Run,
    tally: &mut Tally,
) {
    let way = Way::new(world, [0].into_iter());
    let mut occupancy = Occupancy::new(map, *settings);
    tally.calibration.begin_run();
    drive(run, &way, &mut occupancy, |decision, element, along_m| {
        tally.add(decision, (element, along_m), way.length_m);
    });
}

/// What has become of the leg that the train is on.
#[derive(Default)]
struct Progress {
    leg: Option<usize>,
    /// Since when it is identified, beyond the toe.
    identified_m: Option<f64>,
    is_right: bool,
}

impl Progress {
    /// Takes a fix in; the leg that was left before it, if one was.
    fn after_fix(
        &mut self,
        decision: &Decision,
        element: usize,
        from_toe_m: f64,
        length_m: f64,
    ) -> Option<AtSwitch> {
        let is_leg = !element.is_multiple_of(3);
        let left = self.leg.filter(|leg| *leg != element).map(|_| AtSwitch {
            identified_m: self.identified_m,
            right: self.is_right,
        });
        if left.is_some() || self.leg.is_none() {
            *self = Self::default();
        }
        self.leg = is_leg.then_some(element);
        if is_leg && from_toe_m < length_m - BEFORE_END_M {
            self.is_right = decision
                .tracks
                .first()
                .is_some_and(|best| best.element == element);
            let is_told = decision.is_identified() && self.is_right;
            self.identified_m = is_told.then(|| self.identified_m.unwrap_or(from_toe_m));
        }
        left
    }
}
