//! Runs of a train over a line of 4 km with sensors whose errors are drawn as combined positioning believes of them, but for
//! faults.
//!
//! The train accelerates with 0.8 m/s2 to 20 m/s, stops at a station at 900 m for 20 s, runs through a tunnel from 2,000
//! to 3,000 m and stops at 3,900 m. A tag lies every 80 m.

use metrotwin::bus::SimTime;
use metrotwin::stack::combined::{
    Alarm, CombinedEstimate, CombinedPositioning, CombinedSettings, Measured, Source, Zone,
    ZoneStretch, Zones,
};
use metrotwin::twin::random::Stream;

const STEP_S: f64 = 0.02;
/// The positioning reports this often.
const SEEN_STEPS: u64 = 5;
pub const SEEN_S: f64 = 0.1;
const CRUISE_MPS: f64 = 20.0;
const ACCELERATION_MPS2: f64 = 0.8;
const STATIONS_M: [f64; 2] = [900.0, 3900.0];
const DWELL_S: f64 = 20.0;
const TUNNEL_M: [f64; 2] = [2000.0, 3000.0];
const TAG_EVERY_M: f64 = 80.0;
const MISSED_SHARE: f64 = 0.1;
/// From a tag until its reads are over and its passage is known.
const TAG_AGE_S: f64 = 0.1;
pub const FIX_SIGMA_M: f64 = 1.5;
/// A run is over after this, seconds.
pub const END_S: f64 = 270.0;

/// What a source does wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wrong {
    Silent,
    /// Fixes move away by so much a second.
    Drift(f64),
    /// The odometer says so many times the speed.
    Scale(f64),
    /// Each tag has the name of one so much farther along.
    Exchanged(f64),
}

/// A fault of a source over a time, seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fault {
    pub source: Source,
    pub from_s: f64,
    pub to_s: f64,
    pub wrong: Wrong,
}

/// What is seen of a run, ten times a second.
pub struct RunStep<'a> {
    pub time_s: f64,
    /// Where the head really is.
    pub place_m: f64,
    pub zone: Zone,
    pub estimate: CombinedEstimate,
    pub alarms: &'a [Alarm],
    /// A tag was taken in since the last time.
    pub has_tag: bool,
}

/// A quantity that forgets: Gauss-Markov.
struct Wandering {
    value: f64,
    sigma: f64,
    time_s: f64,
    draws: Stream,
    drawn: u64,
}

impl Wandering {
    fn new(sigma: f64, time_s: f64, draws: Stream) -> Self {
        Self {
            value: sigma * draws.normal(0),
            sigma,
            time_s,
            draws,
            drawn: 1,
        }
    }

    fn advance(&mut self, seconds: f64) -> f64 {
        let keep = (-seconds / self.time_s).exp();
        let new = (1.0 - keep * keep).sqrt() * self.sigma * self.draws.normal(self.drawn);
        self.drawn += 1;
        self.value = keep * self.value + new;
        self.value
    }
}

/// The train's own motion.
struct Motion {
    place_m: f64,
    speed_mps: f64,
    dwelt_s: f64,
    stopped: usize,
}

impl Motion {
    fn step(&mut self) {
        let stop_m = STATIONS_M.get(self.stopped).copied();
        let left_m = stop_m.map_or(0.0, |stop_m| stop_m - self.place_m);
        if left_m < 0.05 {
            self.speed_mps = 0.0;
            self.dwelt_s += STEP_S;
            if self.dwelt_s > DWELL_S && self.stopped + 1 < STATIONS_M.len() {
                (self.dwelt_s, self.stopped) = (0.0, self.stopped + 1);
            }
            return;
        }
        let braking_mps = (2.0 * ACCELERATION_MPS2 * left_m).sqrt();
        let faster = self.speed_mps + ACCELERATION_MPS2 * STEP_S;
        let next_mps = faster.min(CRUISE_MPS).min(braking_mps);
        self.place_m += 0.5 * (self.speed_mps + next_mps) * STEP_S;
        self.speed_mps = next_mps;
    }
}

/// What kind of line it is.
fn zones() -> Zones {
    let stations =
        STATIONS_M.map(|station_m| ([station_m - 100.0, station_m + 100.0], Zone::Junction));
    let all = stations.into_iter().chain([(TUNNEL_M, Zone::Covered)]);
    let stretches = all.map(|([from_m, to_m], zone)| ZoneStretch { from_m, to_m, zone });
    Zones::new(stretches.collect())
}

/// One run, by its number.
pub struct DrawnRun<'a> {
    pub number: u64,
    pub faults: &'a [Fault],
    pub settings: CombinedSettings,
}

impl DrawnRun<'_> {
    fn wrong(&self, source: Source, time_s: f64) -> impl Iterator<Item = (Wrong, f64)> {
        self.faults
            .iter()
            .filter(move |fault| fault.source == source)
            .filter(move |fault| (fault.from_s..fault.to_s).contains(&time_s))
            .map(move |fault| (fault.wrong, time_s - fault.from_s))
    }

    fn is_silent(&self, source: Source, time_s: f64) -> bool {
        self.wrong(source, time_s)
            .any(|(wrong, _)| wrong == Wrong::Silent)
    }

    /// Runs it, and shows every step.
    pub fn run(&self, mut see: impl FnMut(&RunStep<'_>)) {
        let settings = &self.settings;
        let draws = |name: &str| Stream::new(self.number, 0, name);
        let [odometer, fixes, tags, missed] = ["odometer", "fix", "tag", "missed"].map(draws);
        let mut scale = Wandering::new(
            settings.odometer_scale,
            settings.odometer_scale_s,
            draws("scale"),
        );
        let share = settings.fix_correlated_share;
        let slow_m = (share * FIX_SIGMA_M.powi(2) + settings.map_m.powi(2)).sqrt();
        let mut slow = Wandering::new(slow_m, settings.fix_correlation_s, draws("slow"));
        let mut motion = Motion {
            place_m: 20.0,
            speed_mps: 0.0,
            dwelt_s: 0.0,
            stopped: 0,
        };
        let zones_m = zones();
        let start_m = motion.place_m + draws("start").normal(0);
        let mut positioning =
            CombinedPositioning::new(SimTime::ZERO, [start_m, 1.0], zones(), settings);
        let mut passed: Vec<(f64, f64)> = Vec::new();
        let (mut next_tag, mut next_unread, mut read) = (1_u32, 1_u32, Vec::new());
        let mut has_tag = false;
        for step in 1..=(END_S / STEP_S) as u64 {
            let time_s = STEP_S * step as f64;
            let time = SimTime::from_secs(time_s);
            let before_m = motion.place_m;
            motion.step();
            let mean_mps = (motion.place_m - before_m) / STEP_S;
            let scale = scale.advance(STEP_S);
            if !self.is_silent(Source::Odometer, time_s) {
                let times: f64 = self
                    .wrong(Source::Odometer, time_s)
                    .map(|(wrong, _)| {
                        if let Wrong::Scale(times) = wrong {
                            times
                        } else {
                            1.0
                        }
                    })
                    .product();
                let noise_mps = settings.odometer_mps * odometer.normal(step);
                let said_mps = mean_mps * (1.0 + scale) * times + noise_mps;
                let length_m = STEP_S * said_mps;
                positioning.on(
                    time,
                    &Measured::Run {
                        length_m,
                        seconds: STEP_S,
                    },
                );
            }
            if step % 5 == 0 && !self.is_silent(Source::Tags, time_s) {
                positioning.on_reader(time);
            }
            let tag_m = |number: u32| TAG_EVERY_M * f64::from(number);
            if motion.place_m >= tag_m(next_tag) {
                let is_read = missed.uniform(u64::from(next_tag)) >= MISSED_SHARE
                    && !self.is_silent(Source::Tags, time_s);
                if is_read {
                    let off_m: f64 = self
                        .wrong(Source::Tags, time_s)
                        .map(|(wrong, _)| {
                            if let Wrong::Exchanged(m) = wrong {
                                m
                            } else {
                                0.0
                            }
                        })
                        .sum();
                    let noise_m = settings.tag_m * tags.normal(u64::from(next_tag));
                    let over_m = motion.place_m - tag_m(next_tag);
                    let over_s = over_m / motion.speed_mps.max(0.1);
                    passed.push((time_s - over_s, tag_m(next_tag) + noise_m + off_m));
                    read.push(next_tag);
                }
                next_tag += 1;
            }
            if let Some((at_s, place_m)) = passed.first().copied()
                && time_s - at_s >= TAG_AGE_S
            {
                passed.remove(0);
                positioning.on_tag_passed(time, true);
                has_tag = true;
                let age_s = time_s - at_s;
                positioning.on(time, &Measured::Tag { place_m, age_s });
            }
            let zone = zones_m.at(motion.place_m);
            let is_open = zone != Zone::Covered;
            if step % 50 == 0 {
                let slow_m = slow.advance(1.0);
                if is_open && !self.is_silent(Source::Satellites, time_s) {
                    let drift_m: f64 = self
                        .wrong(Source::Satellites, time_s)
                        .map(|(wrong, since_s)| match wrong {
                            Wrong::Drift(mps) => mps * since_s,
                            _ => 0.0,
                        })
                        .sum();
                    let white_m = (1.0 - share).sqrt() * FIX_SIGMA_M * fixes.normal(step);
                    let place_m = motion.place_m + slow_m + white_m + drift_m;
                    let variance_m2 = FIX_SIGMA_M.powi(2);
                    positioning.on(
                        time,
                        &Measured::Fix {
                            place_m,
                            variance_m2,
                        },
                    );
                }
            }
            if step % SEEN_STEPS != 0 {
                continue;
            }
            positioning.carry_on(time);
            let estimate = positioning.estimate();
            let behind_m = 3.0 * estimate.covariance[0][0].sqrt() + 5.0;
            if estimate.place_m - behind_m > tag_m(next_unread) {
                if !read.contains(&next_unread) {
                    positioning.on_tag_passed(time, false);
                }
                next_unread += 1;
            }
            let alarms = positioning.take_alarms();
            see(&RunStep {
                time_s,
                place_m: motion.place_m,
                zone,
                estimate,
                alarms: &alarms,
                has_tag: std::mem::take(&mut has_tag),
            });
        }
    }
}
