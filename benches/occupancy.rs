//! What a fix costs track occupancy, by how many hypotheses are alive.
//!
//! ```text
//! cargo bench --bench occupancy
//! ```
//!
//! A stem parts at a switch into two tracks, these into four, and so on, into a fan of parallel tracks 4.5 m apart.
//! Fixes state a standard deviation of 500 m, so that nearly all tracks stay possible. The train runs onto the track in
//! the middle. Where all tracks lie side by side each fix is measured, with its speed and the decision after it: one
//! thread, 10 fixes a second, 1 km at 10 m/s.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    clippy::disallowed_methods,
    missing_docs,
    reason = "a benchmark measures time and prints its figures, and may fail by panicking"
)]

use metrotwin::bus::SimTime;
use metrotwin::stack::occupancy::{Fix, Occupancy, OccupancySettings};
use metrotwin::track::Direction;
use metrotwin::track::plan::{ElementEnd, PlanNetwork, TrackElement};
use nalgebra::{Matrix2, Point2, Vector2};
use std::hint::black_box;
use std::time::Instant;

const STEM_M: f64 = 200.0;
const APART_M: f64 = 4.5;
/// So much farther along than across the line a track leads, between a switch and the next.
const SLOPE: f64 = 9.0;
const MEASURED_M: f64 = 1000.0;
const SIGMA_M: f64 = 500.0;
const SPEED_MPS: f64 = 10.0;
const STEP_S: f64 = 0.1;
/// Of so many equal runs the least cost of each fix counts, because the machine does other things too.
const RUNS: u32 = 5;

/// Tracks after so many switches, one after the other. Element 0 is the stem; behind element k come 2 k + 1 and
/// 2 k + 2, as in a heap.
struct Fan {
    switches: u32,
}

impl Fan {
    fn tracks(&self) -> usize {
        1 << self.switches
    }

    /// Where an element ends: the tracks behind it lie to either side alike.
    fn end(&self, element: usize) -> Point2<f64> {
        let passed = (element + 1).ilog2();
        let from_right = element + 1 - (1 << passed);
        let tracks_behind = f64::from(1 << (self.switches - passed));
        let across_m = APART_M * (from_right as f64 + 0.5) * tracks_behind;
        let widths_left = self.tracks() as f64 - tracks_behind;
        Point2::new(0.5 * SLOPE * APART_M * widths_left, across_m)
    }

    /// From where on all tracks lie side by side.
    fn beside_from_m(&self) -> f64 {
        self.end(2 * self.tracks() - 2).x
    }

    fn points(&self, element: usize) -> Vec<Point2<f64>> {
        let own = self.end(element);
        let begin = match element {
            0 => own - Vector2::x() * STEM_M,
            _ => self.end((element - 1) / 2),
        };
        let is_last = element + 1 >= self.tracks();
        let beyond = is_last.then(|| own + Vector2::x() * MEASURED_M);
        [begin, own].into_iter().chain(beyond).collect()
    }

    fn network(&self) -> PlanNetwork {
        let elements = (0..2 * self.tracks() - 1).map(|k| {
            let points = self.points(k);
            TrackElement::new(&k.to_string(), points).unwrap()
        });
        let end = |element, way| ElementEnd { element, way };
        let behind = 1..2 * self.tracks() - 1;
        let joints = behind.map(|k| (end((k - 1) / 2, Direction::Up), end(k, Direction::Down)));
        PlanNetwork::new(None, elements.collect(), &joints.collect::<Vec<_>>())
    }

    /// Onto the track in the middle.
    fn run(&self) -> TrackElement {
        let mut elements = vec![self.tracks() + self.tracks() / 2 - 1];
        while let Some(before) = elements[0].checked_sub(1) {
            elements.insert(0, before / 2);
        }
        let points = elements.iter().flat_map(|k| self.points(*k));
        TrackElement::new("run", points.collect()).unwrap()
    }
}

/// A fix on the tracks that lie side by side.
struct MeasuredFix {
    alive: usize,
    cost_us: f64,
}

/// Runs onto the middle track.
fn measure(fan: &Fan) -> Vec<MeasuredFix> {
    let run = fan.run();
    let mut occupancy = Occupancy::new(fan.network().into(), OccupancySettings::default());
    let mut measured = Vec::new();
    for k in 0..(run.length_m() / (SPEED_MPS * STEP_S)) as u32 {
        let time_s = STEP_S * f64::from(k);
        let fix = Fix {
            time: SimTime::from_secs(time_s),
            place: run.at(SPEED_MPS * time_s).0,
            covariance_m2: Matrix2::identity() * SIGMA_M.powi(2),
        };
        let begin = Instant::now();
        occupancy.on_speed(fix.time, SPEED_MPS);
        occupancy.on_fix(&fix);
        black_box(occupancy.decision());
        let cost_us = 1e6 * begin.elapsed().as_secs_f64();
        if fix.place.x > fan.beside_from_m() {
            let alive = occupancy.alive();
            measured.push(MeasuredFix { alive, cost_us });
        }
    }
    measured
}

/// Prints the line of a fan with so many switches in a row.
fn report(switches: u32) {
    let fan = Fan { switches };
    let mut fixes = measure(&fan);
    for _ in 1..RUNS {
        for (fix, again) in fixes.iter_mut().zip(measure(&fan)) {
            fix.cost_us = fix.cost_us.min(again.cost_us);
        }
    }
    let alive = || fixes.iter().map(|fix| fix.alive);
    let (least, most) = (alive().min().unwrap(), alive().max().unwrap());
    fixes.sort_by(|a, b| a.cost_us.total_cmp(&b.cost_us));
    let quantile_us = |percent: usize| fixes[(fixes.len() - 1) * percent / 100].cost_us;
    let (tracks, p50_us, p99_us) = (fan.tracks(), quantile_us(50), quantile_us(99));
    println!("{tracks:6}  {least:5} to {most:3}  {p50_us:8.0}  {p99_us:6.0}");
}

fn main() {
    println!("tracks   hypotheses  us: p50     p99");
    for switches in [0, 2, 4, 6, 7, 8] {
        report(switches);
    }
}
