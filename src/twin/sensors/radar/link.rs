//! Power on the way from a transmitter over a scatterer to a receiver.
//!
//! **Radar equation.** P_r = P_t G_t G_r lambda^2 sigma / ((4 pi)^3 r_out^2 r_back^2) (Skolnik, Introduction to Radar
//! Systems), with the length of the way out and of the way back, which differ where a wall mirrors one of them.
//!
//! **Antennas.** A Gaussian beam over azimuth and elevation, -3 dB at half its width, over a floor of side lobes.
//!
//! **Fog.** Drops of fog are much smaller than the wave, so the loss goes with their water: gamma = K M, with M in g/m^3 and
//! K in (dB/km)/(g/m^3) by the double-Debye permittivity of water (Recommendation ITU-R P.840). Of visibility V (km):
//! M = (0.024 / V)^1.54 (Eldridge 1966, as Altshuler gives it in "A simple expression for estimating attenuation by fog at
//! millimeter wavelengths", IEEE Trans. AP 32(7), 1984). So 50 m of visibility cost 1.1 dB a kilometre: fog that blinds
//! cameras is nothing to the radar. Dust and smoke are dry and cost it nothing here.
//!
//! **Noise.** k T B F with T = 290 K, in the band of the samples of both quadratures.
//!
//! Not modelled: rain, attenuation by gases (under 0.5 dB/km at 77 GHz), the radiation of a warm scene, near fields.

use crate::numerics::BOLTZMANN_JPK;
use crate::twin::air::Air;
use nalgebra::Vector3;
use std::f64::consts::{LN_2, PI};

const NOISE_K: f64 = 290.0;
/// Air in a tunnel.
const AIR_C: f64 = 15.0;

/// Watts of a power in dBm.
pub fn watts(dbm: f64) -> f64 {
    1e-3 * ratio(dbm)
}

/// A power ratio of decibels.
pub fn ratio(db: f64) -> f64 {
    10f64.powf(0.1 * db)
}

/// An antenna, which looks along x of its frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Antenna {
    /// Gain on boresight, dBi.
    pub gain_dbi: f64,
    /// Half-power width over azimuth, radians.
    pub azimuth_rad: f64,
    /// Over elevation.
    pub elevation_rad: f64,
    /// Least gain, against boresight, dB.
    pub side_lobe_db: f64,
}

impl Antenna {
    /// Gain in a direction of the radar frame, as a power ratio.
    pub fn gain(&self, direction: &Vector3<f64>) -> f64 {
        let azimuth = direction.y.atan2(direction.x) / self.azimuth_rad;
        let elevation = direction.z.atan2(direction.xy().norm()) / self.elevation_rad;
        let beam = (-4.0 * LN_2 * (azimuth.powi(2) + elevation.powi(2))).exp();
        ratio(self.gain_dbi) * beam.max(ratio(self.side_lobe_db))
    }
}

/// What a link is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// Power sent, W.
    pub sent_w: f64,
    /// Wave length, m.
    pub wave_m: f64,
    /// What air takes on the way, dB/m.
    pub loss_db_m: f64,
}

impl Link {
    /// Power received over a scatterer of a cross-section, W: gains and lengths of the ways out and back.
    pub fn echo_w(&self, section_m2: f64, gains: [f64; 2], ways_m: [f64; 2]) -> f64 {
        let [out, back] = ways_m.map(|way_m| way_m.max(1e-3));
        let spread = (4.0 * PI).powi(3) * (out * back).powi(2);
        let air = ratio(-self.loss_db_m * (out + back));
        self.sent_w * gains[0] * gains[1] * self.wave_m.powi(2) * section_m2 * air / spread
    }

    /// Power received straight from another transmitter (Friis), W.
    pub fn straight_w(&self, gains: [f64; 2], way_m: f64) -> f64 {
        let way_m = way_m.max(1e-3);
        let spread = (self.wave_m / (4.0 * PI * way_m)).powi(2);
        self.sent_w * gains[0] * gains[1] * spread * ratio(-self.loss_db_m * way_m)
    }
}

/// Power of thermal noise in a band, W.
pub fn noise_w(band_hz: f64, noise_figure_db: f64) -> f64 {
    BOLTZMANN_JPK * NOISE_K * band_hz * ratio(noise_figure_db)
}

/// What the air takes at a frequency, dB/m.
pub fn air_loss_db_m(air: &Air, frequency_hz: f64) -> f64 {
    if air.is_clear() || air.scattered_share < 1.0 {
        return 0.0;
    }
    let visibility_km = 1e-3 * 3.912 / air.extinction_per_m;
    1e-3 * fog_db_km(1e-9 * frequency_hz, AIR_C) * fog_water_g_m3(visibility_km)
}

/// Liquid water of fog in which one sees so far.
fn fog_water_g_m3(visibility_km: f64) -> f64 {
    (0.024 / visibility_km).powf(1.54)
}

/// Loss by fog of 1 g/m^3.
fn fog_db_km(f_ghz: f64, celsius: f64) -> f64 {
    let theta = 300.0 / (celsius + 273.15) - 1.0;
    let still = 77.66 + 103.3 * theta;
    let (middle, fast) = (0.0671 * still, 3.52);
    let first_ghz = 20.20 - 146.0 * theta + 316.0 * theta * theta;
    let second_ghz = 39.8 * first_ghz;
    let relaxed = |ghz: f64| 1.0 + (f_ghz / ghz).powi(2);
    let real = (still - middle) / relaxed(first_ghz) + (middle - fast) / relaxed(second_ghz) + fast;
    let lossy = f_ghz * (still - middle) / (first_ghz * relaxed(first_ghz))
        + f_ghz * (middle - fast) / (second_ghz * relaxed(second_ghz));
    let eta = (2.0 + real) / lossy;
    0.819 * f_ghz / (lossy * (1.0 + eta * eta))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The worked figure: 12 dBm, gains of 6 and 8, noise figure 15 dB, 5 ms: 10 m^2 at 100 m stand 13.6 dB out of noise.
    #[test]
    fn val_a_car_at_100_m() {
        let link = Link {
            sent_w: watts(12.0),
            wave_m: 299_792_458.0 / 76.58e9,
            loss_db_m: 0.0,
        };
        let echo_w = link.echo_w(10.0, [6.0, 8.0], [100.0; 2]);
        let snr_db = 10.0 * (echo_w / noise_w(1.0 / 5e-3, 15.0)).log10();
        assert!((snr_db - 13.6).abs() < 0.1, "{snr_db}");
    }

    /// Against Altshuler's fit, -1.347 + 0.0372 w + 18.0 / w - 0.022 T with the wave w in mm, and the densities that
    /// ITU-R P.840 calls typical: 0.05 g/m^3 where one sees some 300 m, 0.5 g/m^3 at 50 m (within a factor of 3).
    #[test]
    fn val_fog_is_that_of_the_tables() {
        for (f_ghz, celsius) in [
            (35.0, 10.0),
            (77.0, 0.0),
            (77.0, 10.0),
            (77.0, 20.0),
            (95.0, 10.0),
        ] {
            let wave_mm = 299.792_458 / f_ghz;
            let fit = -1.347 + 0.0372 * wave_mm + 18.0 / wave_mm - 0.022 * celsius;
            let ours = fog_db_km(f_ghz, celsius);
            assert!(
                (ours / fit - 1.0).abs() < 0.12,
                "{f_ghz} GHz {celsius} C: {ours} for {fit}"
            );
        }
        for (visibility_km, typical) in [(0.3, 0.05), (0.05, 0.5)] {
            let share = fog_water_g_m3(visibility_km) / typical;
            assert!(
                (1.0 / 3.0..3.0).contains(&share),
                "{visibility_km} km: {share}"
            );
        }
        let thick = 1e3 * air_loss_db_m(&Air::of_visibility(50.0), 77e9);
        assert!((0.8..1.4).contains(&thick), "{thick} dB/km");
        assert!(air_loss_db_m(&Air::default(), 77e9).abs() < f64::EPSILON);
    }

    /// Half power at half the width, full on boresight, the floor behind.
    #[test]
    fn antennas_have_their_widths() {
        let antenna = Antenna {
            gain_dbi: 12.0,
            azimuth_rad: 1.2,
            elevation_rad: 0.4,
            side_lobe_db: -20.0,
        };
        let at = |azimuth: f64, elevation: f64| {
            let (sin, cos) = azimuth.sin_cos();
            let level = elevation.cos();
            let direction = Vector3::new(level * cos, level * sin, elevation.sin());
            10.0 * antenna.gain(&direction).log10()
        };
        let is = |db: f64, expected: f64| (db - expected).abs() < 1e-2;
        assert!(is(at(0.0, 0.0), 12.0));
        assert!(is(at(0.6, 0.0), 12.0 - 3.01) && is(at(-0.6, 0.0), 12.0 - 3.01));
        assert!(is(at(0.0, 0.2), 12.0 - 3.01));
        assert!(is(at(3.0, 0.0), -8.0));
    }

    /// R^-4 over a scatterer, R^-2 straight; each way of a mirrored echo counts alone.
    #[test]
    fn power_falls_with_the_way() {
        let link = Link {
            sent_w: 1.0,
            wave_m: 4e-3,
            loss_db_m: 0.0,
        };
        let echo = |out, back| link.echo_w(1.0, [1.0; 2], [out, back]);
        assert!((echo(10.0, 10.0) / echo(20.0, 20.0) / 16.0 - 1.0).abs() < 1e-12);
        assert!((echo(10.0, 20.0) / echo(20.0, 20.0) / 4.0 - 1.0).abs() < 1e-12);
        let straight = |way| link.straight_w([1.0; 2], way);
        assert!((straight(10.0) / straight(20.0) / 4.0 - 1.0).abs() < 1e-12);
        let foggy = Link {
            loss_db_m: 0.01,
            ..link
        };
        let lost = foggy.echo_w(1.0, [1.0; 2], [100.0; 2]) / echo(100.0, 100.0);
        assert!((10.0 * lost.log10() + 2.0).abs() < 1e-9);
    }
}
