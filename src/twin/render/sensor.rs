//! From luminance to digital numbers: the lens, and the sensor after EMVA 1288 (release 4.0).
//!
//! # Theory
//!
//! A scene of luminance L gives the sensor an illuminance of `pi/4 T L / N^2` on the axis (T
//! transmission, N f-number). A pixel of area A collects `A * PHOTONS_PER_LM_S` photons a lux and
//! second, of which the quantum efficiency makes electrons.

use crate::track::{Checker, Problem};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Photons in a lumen of a white LED for a second: its light makes 320 lm a watt, at 560 nm in the
/// mean (a photon of 3.55e-19 J).
pub const PHOTONS_PER_LM_S: f64 = 1.0 / (320.0 * 3.55e-19);

/// The glass in front of a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LensSettings {
    /// Focal length over the width of the entrance pupil. Default 1.4.
    pub f_number: f64,
    /// Share of the light that passes. Default 0.9.
    pub transmission: f64,
    /// Standard deviation of the point spread in focus, pixels. Default 0.5.
    pub blur_px: f64,
    /// Share of a lamp's light that near glare spreads around it. Default 0.02.
    pub halo_share: f64,
    /// Distance in which the near glare falls to 1/e, pixels. Default 12.
    pub halo_px: f64,
    /// Share of a lamp's light in the wide veil around it. Default 0.02.
    pub veil_share: f64,
    /// Width of the veil, pixels: half of its light lies within 1.73 times this. Default 20.
    pub veil_px: f64,
    /// How much of the natural vignetting, the fourth power of the cosine to the axis, is left:
    /// 1 all, 0 none. Default 1.
    pub vignetting: f64,
}

impl Default for LensSettings {
    fn default() -> Self {
        Self {
            f_number: 1.4,
            transmission: 0.9,
            blur_px: 0.5,
            halo_share: 0.02,
            halo_px: 12.0,
            veil_share: 0.02,
            veil_px: 20.0,
            vignetting: 1.0,
        }
    }
}

impl LensSettings {
    /// Illuminance of the sensor on the axis under a scene of 1 cd/m^2.
    pub fn lux_per_cd_m2(&self) -> f64 {
        0.25 * PI * self.transmission / self.f_number.powi(2)
    }

    /// Appends what is wrong, with keys below `at`.
    pub fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        let mut check = Checker::new(at, problems);
        check.within("f_number", self.f_number, 0.5..=64.0, "");
        check.within("transmission", self.transmission, 1e-3..=1.0, "");
        check.within("blur_px", self.blur_px, 0.0..=50.0, "px");
        check.within("halo_share", self.halo_share, 0.0..=1.0, "");
        check.within("halo_px", self.halo_px, 0.1..=1e3, "px");
        check.within("veil_share", self.veil_share, 0.0..=1.0, "");
        check.within("veil_px", self.veil_px, 0.1..=1e4, "px");
        check.within("vignetting", self.vignetting, 0.0..=1.0, "");
    }
}

/// From photons to digital numbers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SensorSettings {
    /// Electrons a photon. Default 0.6.
    pub quantum_efficiency: f64,
    /// Most electrons that a pixel holds. At a gain of 0 dB they are full scale. Default 10500.
    pub full_well_e: f64,
    /// Gain before the converter, dB. Default 3.3.
    pub gain_db: f64,
    /// Digital number of darkness, on the scale of 8 bits. Default 4.
    pub black_level_grey: f64,
    /// Read noise, electrons. Default 6.
    pub read_noise_e: f64,
    /// Draw noise at all.
    pub noise: bool,
}

impl Default for SensorSettings {
    fn default() -> Self {
        Self {
            quantum_efficiency: 0.6,
            full_well_e: 10_500.0,
            gain_db: 3.3,
            black_level_grey: 4.0,
            read_noise_e: 6.0,
            noise: true,
        }
    }
}

impl SensorSettings {
    /// Electrons that an exposure of 1 lx s makes in a pixel of that width.
    pub fn electrons_per_lux_s(&self, pixel_m: f64) -> f64 {
        self.quantum_efficiency * PHOTONS_PER_LM_S * pixel_m.powi(2)
    }

    /// Grey levels of 255 an electron: EMVA's system gain K on the scale of 8 bits.
    pub fn grey_per_e(&self) -> f64 {
        10f64.powf(self.gain_db / 20.0) * 255.0 / self.full_well_e
    }

    /// Appends what is wrong, with keys below `at`.
    pub fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        let mut check = Checker::new(at, problems);
        check.within(
            "quantum_efficiency",
            self.quantum_efficiency,
            1e-3..=1.0,
            "",
        );
        check.within("full_well_e", self.full_well_e, 10.0..=1e6, "e");
        check.within("gain_db", self.gain_db, -20.0..=60.0, "dB");
        check.within("black_level_grey", self.black_level_grey, 0.0..=255.0, "");
        check.within("read_noise_e", self.read_noise_e, 0.0..=1e5, "e");
    }
}
