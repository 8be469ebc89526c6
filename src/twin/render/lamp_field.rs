//! The lamps of a scene and their light at a place.

use super::photometry::{BlinkingLamp, LAMP_REACH_M};
use crate::track::{Track, TrackPoint};
use crate::twin::air::Air;
use crate::twin::lights::LampLight;
use nalgebra::{Point3, Vector3};
use std::f64::consts::PI;

/// Airlight is the mean along the line to this distance before and behind the camera, a few
/// lamps.
pub const AIRLIGHT_REACH_M: f64 = 20.0;

/// The lamps of a scene, found by place: cells of a plan grid list the lamps that reach them.
#[derive(Clone, Debug)]
pub struct LampField {
    lamps: Vec<BlinkingLamp>,
    air: Air,
    /// Cell and lamp, sorted, so that the lamps of a cell are one run.
    reach: Vec<((i32, i32), u32)>,
}

const CELL_M: f64 = 10.0;

fn cell(x_m: f64) -> i32 {
    (x_m / CELL_M).floor() as i32
}

impl LampField {
    /// Sorts lamps that shine through air into cells.
    pub fn new(lamps: &[LampLight], air: Air) -> Self {
        let mut reach = Vec::new();
        for (k, lamp) in lamps.iter().enumerate() {
            let c = lamp.centre;
            for i in cell(c.x - LAMP_REACH_M)..=cell(c.x + LAMP_REACH_M) {
                for j in cell(c.y - LAMP_REACH_M)..=cell(c.y + LAMP_REACH_M) {
                    reach.push(((i, j), k as u32));
                }
            }
        }
        reach.sort_unstable();
        Self {
            lamps: lamps.iter().cloned().map(BlinkingLamp::new).collect(),
            air,
            reach,
        }
    }

    /// All lamps, in the order given.
    pub fn lamps(&self) -> &[BlinkingLamp] {
        &self.lamps
    }

    /// Those that may reach a place, in the order given.
    pub fn near(&self, p: &Point3<f64>) -> impl Iterator<Item = &BlinkingLamp> {
        self.indices_near(p).map(|k| &self.lamps[k])
    }

    fn indices_near(&self, p: &Point3<f64>) -> impl Iterator<Item = usize> {
        let at = (cell(p.x), cell(p.y));
        let first = self.reach.partition_point(|(c, _)| *c < at);
        self.reach[first..]
            .iter()
            .take_while(move |(c, _)| *c == at)
            .map(|(_, k)| *k as usize)
    }

    /// What the blinking of lamps adds to their mean illuminance of a surface in an exposure, lux;
    /// `flicker` is the light of each lamp in it over its mean, less 1.
    pub fn flickering_lx(&self, p: &Point3<f64>, n: &Vector3<f64>, flicker: &[f64]) -> f64 {
        self.indices_near(p)
            .filter(|k| flicker[*k] != 0.0)
            .map(|k| {
                let lamp = &self.lamps[k];
                let clear = self.air.transmission((p - lamp.centre).norm());
                flicker[k] * clear * lamp.irradiance_lx(p, n)
            })
            .sum()
    }

    /// Mean illuminance by all lamps of a surface at `p` with unit normal `n`, lux.
    pub fn irradiance_lx(&self, p: &Point3<f64>, n: &Vector3<f64>) -> f64 {
        self.near(p)
            .map(|lamp| {
                let lux = lamp.irradiance_lx(p, n);
                // Most lamps about a place turn their back on it.
                if lux > 0.0 {
                    lux * self.air.transmission((p - lamp.centre).norm())
                } else {
                    0.0
                }
            })
            .sum()
    }

    /// Mean light of all lamps that passes a place from any side, lux: the sum of I / d^2.
    fn scalar_lx(&self, p: &Point3<f64>) -> f64 {
        self.near(p)
            .map(|lamp| {
                let d = p - lamp.centre;
                // A surface that faces the lamp gets all of it.
                d.try_normalize(1e-3).map_or(0.0, |to| {
                    lamp.irradiance_lx(p, &-to) * self.air.transmission(d.norm())
                })
            })
            .sum()
    }

    /// Luminance of endless lit air about a chainage: the mean, over places a metre apart along
    /// the line to [`AIRLIGHT_REACH_M`] on both sides and 2 m above top of rail, of what it
    /// scatters. Ambient light of `ambient_lx`, E, on every surface is a luminance of E / pi from all sides,
    /// so 4 E pass any place.
    pub fn airlight_cd_m2(&self, track: &Track, s_m: f64, ambient_lx: f64) -> f64 {
        if self.air.is_clear() {
            return 0.0;
        }
        let places = AIRLIGHT_REACH_M as i32;
        let lamps_lx: f64 = (-places..=places)
            .map(|k| {
                let place = TrackPoint {
                    s_m: s_m + f64::from(k),
                    l_m: 0.0,
                    h_m: 2.0,
                };
                self.scalar_lx(&track.alignment.world_from_track(place))
            })
            .sum();
        let mean_lx = lamps_lx / f64::from(2 * places + 1) + 4.0 * ambient_lx;
        self.air.scattered_share * mean_lx / (4.0 * PI)
    }
}

#[cfg(test)]
mod tests {
    use super::super::photometry::tests::light;
    use super::super::sample;
    use super::*;

    /// Fails where the grid loses a lamp: the same sum over all lamps.
    #[test]
    fn cells_hold_every_lamp_in_reach() {
        let lamps: Vec<_> = (0..40)
            .map(|k| {
                let s = 10.0 * f64::from(k) - 200.0;
                light(
                    Point3::new(s * 0.8, s * 0.6, 3.0),
                    Vector3::new(1.0, -2.0, 0.1),
                )
            })
            .collect();
        let field = LampField::new(&lamps, Air::default());
        let lamps = field.lamps();
        let n = Vector3::new(0.0, 0.6, 0.8);
        for k in 0..500 {
            let s = f64::from(k) - 250.0;
            let p = Point3::new(s * 0.8 + 1.0, s * 0.6 - 2.5, 0.0);
            let all: f64 = lamps.iter().map(|l| l.irradiance_lx(&p, &n)).sum();
            assert!((field.irradiance_lx(&p, &n) - all).abs() < 1e-12);
            assert!(field.near(&p).count() <= 10);
        }
    }

    /// Fails where lamps shine through mist as through clear air, or twice dimmed.
    #[test]
    fn mist_dims_lamps_by_beer_and_lambert() {
        let lamps = [light(Point3::origin(), Vector3::x())];
        let air = Air::of_visibility(50.0);
        let (clear, misty) = (
            LampField::new(&lamps, Air::default()),
            LampField::new(&lamps, air),
        );
        for d in [1.0f64, 7.0, 20.0] {
            let at =
                |field: &LampField| field.irradiance_lx(&Point3::new(d, 0.0, 0.0), &-Vector3::x());
            let expected = (-3.912_023 / 50.0 * d).exp();
            assert!((at(&misty) / at(&clear) - expected).abs() < 1e-6);
        }
    }

    /// Fails where the airlight of evenly lit mist is not that of its surroundings: where light
    /// of luminance L comes from all sides, air that absorbs nothing glows with L.
    #[test]
    fn evenly_lit_mist_is_as_bright_as_what_lights_it() {
        let mut track = sample::track();
        track.ambient_lx = 12.0 * PI;
        let mut air = Air::of_visibility(80.0);
        let dark = LampField::new(&[], air);
        assert!((dark.airlight_cd_m2(&track, 100.0, track.ambient_lx) - 12.0).abs() < 1e-9);
        air.scattered_share = 0.7;
        let dust = LampField::new(&[], air);
        assert!((dust.airlight_cd_m2(&track, 100.0, track.ambient_lx) - 8.4).abs() < 1e-9);
        // Lamps add to it, clear air has none.
        let lamps = sample::scene().lamps;
        let clear = LampField::new(&lamps, Air::default());
        assert!(clear.airlight_cd_m2(&track, 100.0, track.ambient_lx).abs() < 1e-300);
        assert!(LampField::new(&lamps, air).airlight_cd_m2(&track, 100.0, track.ambient_lx) > 8.5);
    }
}
