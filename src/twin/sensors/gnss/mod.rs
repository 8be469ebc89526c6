//! Satellite receiver on a train's roof.
//!
//! Satellites of two systems move over the sky ([`satellites`]); a ray from the antenna to each says whether walls,
//! vaults or bridges are in between, so fixes get worse before a portal, are gone underground and come back after it.
//! Ranges have slow and fast errors and reflections (`range_errors`); the receiver solves for its place by weighted least
//! squares, leaves out ranges that do not fit, and states the covariance of what it takes its ranges for (`solution`).
//! So an error ellipse is long towards what hides the sky, and errors of one fix are those of the next. All receivers of
//! a world have one sky over them, and the errors that come from there.
//!
//! What it does not do: buildings, trees and other trains beside the track (a share of reflections stands for them),
//! carrier phase, jamming, systems with clocks apart.

mod common_errors;
mod range_errors;
mod satellites;
mod solution;
#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests;

use super::{Output, Sensor, SensorError, SensorSample};
use crate::bus::{Content, GnssFix, GnssSolution, SimTime, Ticker, TrainEnd, TrainId};
use crate::settings::settings;
use crate::track::Track;
use crate::track::geodesy::Datum;
use crate::twin::geometry::{RayStart, Sight, TunnelCaster};
use crate::twin::physics::World;
use crate::twin::random::Stream;
use nalgebra::{Point3, Rotation2, Rotation3, Unit, Vector3};
use range_errors::{RangeErrors, SignalWay};
use satellites::{SATELLITES, Sky};
use solution::{MeasuredRange, Solution, solve};
use std::sync::Arc;

/// What is farther away from the antenna hides nothing of the sky that is over the lowest elevation.
const SIGHT_M: f64 = 300.0;
/// What corrections leave of the errors that a reference station has too.
const LEFT_BY_CORRECTIONS: f64 = 0.2;

settings! {
    /// A satellite receiver (GPS and Galileo, code ranges). It needs a tunnel with a `[datum]`. Defaults give about 1 m
    /// east and north under an open sky.
    #[derive(Copy)]
    pub struct GnssSettings {
        /// Fixes a second.
        rate_hz: f64 = 5.0, in 0.1..=50.0;
        /// From the time of a fix until it reaches the equipment, ms.
        delay_ms: f64 = 80.0, in 0.0..=5000.0;
        /// Antenna in the vehicle frame (forward, left, up from the head at top of rail), metres.
        antenna_m: [f64; 3] = [-10.0, 0.0, 3.9], in -30.0..=10.0;
        /// Satellites that are lower are not used, degrees.
        lowest_deg: f64 = 10.0, in 0.0..=60.0;
        /// Single, or with corrections of a reference station, which leave a fifth of what both have in common.
        solution: GnssSolution = GnssSolution::Single;
        /// Sigma of a range by orbit, clock and ionosphere, metres.
        signal_in_space_m: f64 = 0.8, in 0.0..=100.0;
        /// Its correlation time, s.
        signal_in_space_s: f64 = 1800.0, in 1.0..=1e6;
        /// Sigma of what models leave of the troposphere, towards the zenith, metres.
        troposphere_m: f64 = 0.12, in 0.0..=10.0;
        /// Its correlation time, s.
        troposphere_s: f64 = 1800.0, in 1.0..=1e6;
        /// Sigma of a range by multipath, towards the zenith, metres.
        multipath_m: f64 = 0.7, in 0.0..=100.0;
        /// Its correlation time, s.
        multipath_s: f64 = 60.0, in 0.1..=1e6;
        /// Sigma of a range's white noise, towards the zenith, metres.
        noise_m: f64 = 0.3, in 0.0..=100.0;
        /// All of these times this.
        error_scale: f64 = 1.0, in 0.0..=100.0;
        /// Share of time in which a satellite at the horizon comes by a reflection alone; less with the cosine of its
        /// elevation.
        reflected_share: f64 = 0.02, in 0.0..=0.5;
        /// The same of a satellite that a wall or a bridge hides.
        reflected_if_blocked: f64 = 0.2, in 0.0..=0.9;
        /// Mean time for which a reflection lasts, s.
        reflected_s: f64 = 5.0, in 0.1..=1e4;
        /// Mean excess of its range, metres.
        reflected_excess_m: f64 = 15.0, in 0.0..=1000.0;
        /// Until a satellite that comes into sight is used, s.
        acquisition_s: f64 = 2.0, in 0.0..=600.0;
        /// Stated over true standard deviations of ranges without reflections.
        stated_scale: f64 = 0.8, in 0.01..=100.0;
    }
}

impl GnssSettings {
    fn left_by_corrections(&self) -> f64 {
        match self.solution {
            GnssSolution::Single => 1.0,
            GnssSolution::Differential => LEFT_BY_CORRECTIONS,
        }
    }

    /// Standard deviation of a range without reflections, but for the troposphere, which all have in common.
    fn range_sigma_m(&self, sine: f64) -> f64 {
        let space_m = self.signal_in_space_m * self.left_by_corrections();
        let near_m = self.multipath_m.hypot(self.noise_m) / sine;
        (self.error_scale * space_m.hypot(near_m)).max(1e-3)
    }
}

/// From which seeds a receiver's numbers are drawn.
#[derive(Clone, Copy, Debug)]
pub struct GnssSeeds {
    /// What all receivers of a world have in common: the time of day, and errors of satellites' signals and of the air.
    pub common: u64,
    /// What is its own: multipath, noise and reflections.
    pub own: u64,
}

/// A receiver at work.
pub struct Gnss {
    settings: GnssSettings,
    train: TrainId,
    datum: Datum,
    tunnel: TunnelCaster,
    near: Option<RayStart>,
    ticker: Ticker,
    sky: Sky,
    errors: RangeErrors,
    /// Since when each satellite's signal has been there.
    since_s: [Option<f64>; SATELLITES],
    last_s: Option<f64>,
}

impl Gnss {
    /// On a train, over the tracks of a place on the earth.
    pub fn new(
        settings: &GnssSettings,
        train: TrainId,
        (tracks, datum): (&[Arc<Track>], &Datum),
        seeds: GnssSeeds,
    ) -> Self {
        let day = Stream::new(seeds.common, 0, "gnss time of day");
        let phases = [0, 1, 2].map(|k| day.uniform(k));
        Self {
            settings: *settings,
            train,
            datum: *datum,
            tunnel: TunnelCaster::new(tracks),
            near: None,
            ticker: Ticker::new(settings.rate_hz),
            sky: Sky::new(&datum.place, phases),
            errors: RangeErrors::new(settings, seeds),
            since_s: [None; SATELLITES],
            last_s: None,
        }
    }

    /// A fix of an antenna at a place in the world; none where too few satellites are received.
    fn fix(&mut self, time: SimTime, antenna: &Point3<f64>) -> Option<GnssFix> {
        let Solution {
            error_m,
            covariance_m2,
            satellites,
        } = self.solution(time.secs(), antenna)?;
        let turned = Rotation2::new(-self.datum.heading_deg.to_radians()) * error_m.xy();
        let place = antenna + Vector3::new(turned.x, turned.y, error_m.z);
        Some(GnssFix {
            time,
            place: self.datum.geodetic(&place),
            covariance_m2: covariance_m2 * self.settings.stated_scale.powi(2),
            solution: self.settings.solution,
            satellites: satellites as u8,
        })
    }

    /// The error of the place at a time, and its covariance.
    fn solution(&mut self, seconds: f64, antenna: &Point3<f64>) -> Option<Solution> {
        let step_s = seconds - self.last_s.unwrap_or(seconds);
        let is_first = self.last_s.replace(seconds).is_none();
        self.errors.advance(seconds);
        let near = self.tunnel.ray_start(antenna, self.near);
        self.near = Some(near);
        let lowest = self.settings.lowest_deg.to_radians().sin();
        let directions = self.sky.directions(seconds);
        let mut ranges = Vec::with_capacity(SATELLITES);
        let mut free = 0;
        for (number, direction) in directions.into_iter().enumerate() {
            let way = (direction.z > lowest).then(|| self.way(near, antenna, &direction));
            let error_m = way.and_then(|way| self.errors.of(number, direction.z, way, step_s));
            let Some(error_m) = error_m else {
                self.since_s[number] = None;
                continue;
            };
            // At power-on the receiver has been at work for long.
            let begun_s = if is_first { f64::NEG_INFINITY } else { seconds };
            let since_s = *self.since_s[number].get_or_insert(begun_s);
            if seconds - since_s < self.settings.acquisition_s {
                continue;
            }
            free += usize::from(way == Some(SignalWay::Free));
            let sigma_m = self.settings.range_sigma_m(direction.z);
            ranges.push(MeasuredRange {
                direction,
                error_m,
                sigma_m,
            });
        }
        // Deep under the ground nothing reflects.
        if free > 0 { solve(ranges) } else { None }
    }

    /// Whether something is between the antenna and a satellite (east, north, up).
    fn way(
        &self,
        near: RayStart,
        antenna: &Point3<f64>,
        direction: &Unit<Vector3<f64>>,
    ) -> SignalWay {
        let world_from_earth =
            Rotation3::from_axis_angle(&Vector3::z_axis(), -self.datum.heading_deg.to_radians());
        let ray = world_from_earth * direction.into_inner();
        match self.tunnel.look(near, antenna, &ray, SIGHT_M) {
            Sight::Open => SignalWay::Free,
            Sight::Surface(_) | Sight::Dark => SignalWay::Blocked,
        }
    }
}

impl Sensor for Gnss {
    fn sample(&mut self, world: &World) -> Result<Vec<Output>, SensorError> {
        let now = world.time();
        if self.ticker.due(now, 0.0).is_none() {
            return Ok(Vec::new());
        }
        let Some(motion) = world.vehicle_motion(self.train, TrainEnd::Front) else {
            return Ok(Vec::new());
        };
        let antenna = motion.world_from_vehicle * Point3::from(self.settings.antenna_m);
        let fix = self.fix(now, &antenna);
        let sample = fix.map(|fix| {
            Output::Sample(SensorSample {
                valid_at: now,
                delay_s: 1e-3 * self.settings.delay_ms,
                content: Content::Gnss(fix),
            })
        });
        Ok(sample.into_iter().collect())
    }
}
