//! Where satellites stand in the sky.
//!
//! Two systems as Walker constellations on circular orbits: GPS as 24/6/1 at 55 degrees (its slots of 1990, evenly
//! spaced), Galileo as 24/3/1 at 56 degrees (Galileo OS Service Definition, 2021). The earth is a ball here, and the
//! receiver is on it: directions are right to 0.2 degrees, which is nothing to how errors spread.

use crate::track::geodesy::Geodetic;
use nalgebra::{Unit, Vector3};
use std::f64::consts::TAU;

const EARTH_M: f64 = 6_371_000.0;
/// Gravitational constant times the earth's mass (WGS 84), m^3/s^2.
const MU: f64 = 3.986_004_418e14;
/// Turn rate of the earth (WGS 84).
const EARTH_RADPS: f64 = 7.292_115e-5;

/// Evenly spaced circular orbits: satellites/planes/phasing at an inclination.
struct Walker {
    satellites: u32,
    planes: u32,
    phasing: u32,
    inclination_deg: f64,
    radius_m: f64,
}

const SYSTEMS: [Walker; 2] = [
    Walker {
        satellites: 24,
        planes: 6,
        phasing: 1,
        inclination_deg: 55.0,
        radius_m: 26_560_000.0,
    },
    Walker {
        satellites: 24,
        planes: 3,
        phasing: 1,
        inclination_deg: 56.0,
        radius_m: 29_600_000.0,
    },
];

/// Of both systems.
pub const SATELLITES: usize = 48;

/// The satellites as seen from a place.
#[derive(Clone, Debug)]
pub struct Sky {
    /// Rows: east, north, up, on axes that turn with the earth.
    east_north_up: [Vector3<f64>; 3],
    /// Of the earth and of each system's orbits at time 0, as parts of a turn.
    phases: [f64; 3],
}

impl Sky {
    /// Over a place, at a time of day that three numbers from 0 to 1 say.
    pub fn new(place: &Geodetic, phases: [f64; 3]) -> Self {
        let (sin_lat, cos_lat) = place.latitude_deg.to_radians().sin_cos();
        let (sin_lon, cos_lon) = place.longitude_deg.to_radians().sin_cos();
        Self {
            east_north_up: [
                Vector3::new(-sin_lon, cos_lon, 0.0),
                Vector3::new(-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat),
                Vector3::new(cos_lat * cos_lon, cos_lat * sin_lon, sin_lat),
            ],
            phases,
        }
    }

    /// Directions of all satellites (east, north, up) after so many seconds. Below the horizon `z` is negative.
    pub fn directions(&self, seconds: f64) -> [Unit<Vector3<f64>>; SATELLITES] {
        let turned_rad = TAU * self.phases[0] + EARTH_RADPS * seconds;
        let mut directions = [Vector3::z_axis(); SATELLITES];
        let mut next = directions.iter_mut();
        for (system, phase) in SYSTEMS.iter().zip(&self.phases[1..]) {
            for number in 0..system.satellites {
                let inertial = system.place_m(number, *phase, seconds);
                let (sin, cos) = turned_rad.sin_cos();
                let with_earth = Vector3::new(
                    cos * inertial.x + sin * inertial.y,
                    cos * inertial.y - sin * inertial.x,
                    inertial.z,
                );
                let to = with_earth - EARTH_M * self.east_north_up[2];
                let seen = self.east_north_up.map(|axis| axis.dot(&to));
                if let Some(direction) = next.next() {
                    *direction = Unit::new_normalize(Vector3::from(seen));
                }
            }
        }
        directions
    }
}

impl Walker {
    /// On axes that do not turn.
    fn place_m(&self, number: u32, phase: f64, seconds: f64) -> Vector3<f64> {
        let in_plane = self.satellites / self.planes;
        let (plane, slot) = (f64::from(number / in_plane), f64::from(number % in_plane));
        let node_rad = TAU * plane / f64::from(self.planes);
        let slots = slot / f64::from(in_plane)
            + f64::from(self.phasing) * plane / f64::from(self.satellites);
        let rate_radps = (MU / self.radius_m.powi(3)).sqrt();
        let (sin, cos) = (TAU * (slots + phase) + rate_radps * seconds).sin_cos();
        let (sin_i, cos_i) = self.inclination_deg.to_radians().sin_cos();
        let (sin_node, cos_node) = node_rad.sin_cos();
        self.radius_m
            * Vector3::new(
                cos_node * cos - sin_node * cos_i * sin,
                sin_node * cos + cos_node * cos_i * sin,
                sin_i * sin,
            )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(latitude_deg: f64, phases: [f64; 3]) -> Sky {
        let place = Geodetic {
            latitude_deg,
            longitude_deg: 104.0,
            height_m: 0.0,
        };
        Sky::new(&place, phases)
    }

    /// Published periods: GPS 11 h 58 min, Galileo 14 h 5 min.
    #[test]
    fn val_orbits_take_their_time() {
        let [gps, galileo] = [&SYSTEMS[0], &SYSTEMS[1]]
            .map(|system| TAU / (MU / system.radius_m.powi(3)).sqrt() / 3600.0);
        assert!((gps - 11.967).abs() < 0.01, "{gps} h");
        assert!((galileo - 14.08).abs() < 0.01, "{galileo} h");
    }

    /// Fails where satellites are not spread evenly: the share of the sphere of an orbit's radius that is higher than an
    /// angle over the horizon, by the closed form for a cap, is what is seen on average over all latitudes and times.
    /// With c = cos(h + asin(cos h R/r)): half of 1 - sin(h + asin(...)).
    #[test]
    fn satellites_are_as_often_over_ten_degrees_as_a_cap_says() {
        let mask = 10f64.to_radians();
        let share = |radius_m: f64| {
            let nadir = (mask.cos() * EARTH_M / radius_m).asin();
            0.5 * (1.0 - (mask + nadir).sin())
        };
        let expected: f64 = SYSTEMS.iter().map(|s| 24.0 * share(s.radius_m)).sum();
        let (mut sum, mut weights) = (0.0, 0.0);
        for latitude in -89..=89 {
            let weight = f64::from(latitude).to_radians().cos();
            for k in 0..24 {
                let sky = at(f64::from(latitude), [0.0, 0.0, 0.0]);
                let seen = sky.directions(f64::from(k) * 3600.0 + 100.0 * f64::from(latitude));
                let over = seen.iter().filter(|d| d.z > mask.sin()).count();
                sum += weight * over as f64;
                weights += weight;
            }
        }
        let mean = sum / weights;
        assert!((mean - expected).abs() < 0.3, "{mean} {expected}");
    }

    /// Over the pole none stands higher than its inclination allows; over the equator they come to the zenith.
    #[test]
    fn no_satellite_is_over_the_pole() {
        let highest = |latitude_deg| {
            (0..200)
                .flat_map(|k| at(latitude_deg, [0.1, 0.2, 0.3]).directions(431.0 * f64::from(k)))
                .map(|d| d.z.asin().to_degrees())
                .fold(-90.0, f64::max)
        };
        assert!(highest(0.0) > 80.0);
        // From the pole a satellite at latitude 56 is seen at atan((r sin 56 - R) / (r cos 56)).
        let (sin, cos) = 56f64.to_radians().sin_cos();
        let bound = ((29.6e6 * sin - EARTH_M) / (29.6e6 * cos))
            .atan()
            .to_degrees();
        assert!(
            (highest(90.0) - bound).abs() < 0.5,
            "{} {bound}",
            highest(90.0)
        );
    }
}
