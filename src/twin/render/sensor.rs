//! From luminance to digital numbers: the lens, and the sensor after EMVA 1288 (release 4.0).
//!
//! # Theory
//!
//! A scene of luminance L gives the sensor an illuminance of `pi/4 T L / N^2` on the axis (T
//! transmission, N f-number). A pixel of area A collects `A * PHOTONS_PER_LM_S` photons a lux and
//! second, of which the quantum efficiency makes electrons: the *signal* that the renderers draw.
//! From there on, pixel by pixel:
//!
//! ```text
//! charge = signal * gain + dark                    fixed pattern, see pixel_map.rs
//! charge = charge + what spills from pixels above and below        where blooming is asked for
//! e      = min(charge + sqrt(charge + r^2) n, full well + r n)     n standard normal
//! dn     = round(black + K e), from 0 to 2^bits - 1
//! ```
//!
//! with r the read noise and K the system gain. In a full pixel there is no shot noise any more
//! but still read noise, which the second term of the minimum has.
//!
//! # Few electrons
//!
//! Shot noise is Poisson's, here normal. Mean and variance are exact at any signal, negative
//! charges included (read noise goes both ways). What is missing is the skew, `m / (m + r^2)^1.5`
//! at a mean of m electrons: at most `2 / (3 sqrt(3) r)`, 0.064 with a read noise of 6 e, and a
//! distribution function off by no more than 0.5 % anywhere (`few_electrons_are_nearly_normal`
//! computes it). To one that reads with less than 1 e, the skew of few electrons matters.
//!
//! # Defaults
//!
//! The format is that of a rolling-shutter CMOS sensor of 1/3 inch (1.2 million pixels of 3.75 um,
//! converters of 12 bits: onsemi's AR0130 is one). Quantum efficiency, full well, noises, dark
//! current and fixed pattern are of usual size for such a one at 40 degrees; they are assumed, not
//! from a data sheet.
//!
//! # What it does not do
//!
//! Photon transfer that bends before the full well, noise of rows and columns, lag from frame to
//! frame, smear of a CCD, crosstalk, interpolated colours (the mosaic is delivered).

use super::RawImage;
use crate::settings::{Checker, settings};
use image::GrayImage;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Photons in a lumen of a white LED for a second: its light makes about 320 lm a watt, at 560 nm in the
/// mean (a photon of 3.55e-19 J).
pub const PHOTONS_PER_LM_S: f64 = 1.0 / (320.0 * 3.55e-19);

/// Charge over the full well spills up and down its column, half of it each way, no farther than
/// this many pixels. A pixel on the way that is not full takes what is left of its own room, half
/// of it for either way, so that both flows can be followed alone:
///
/// ```text
/// flow = max(0, flow + share * over / 2)     past a pixel that holds `over` too much
/// flow = max(0, flow - room / 2)             past a pixel that has `room` left
/// ```
///
/// So charge is kept where nothing spills farther than that, or over the picture's border.
pub const BLOOMING_REACH: usize = 32;

/// How far a lens may blur: the standard deviation of its point spread, pixels.
pub const BLUR_PX: std::ops::RangeInclusive<f64> = 0.0..=50.0;

settings! {
    /// The glass in front of a sensor.
    #[derive(Copy)]
    pub struct LensSettings {
        /// Focal length over the width of the entrance pupil.
        f_number: f64 = 1.4, in 0.5..=64.0;
        /// Share of the light that passes.
        transmission: f64 = 0.9, in 1e-3..=1.0;
        /// Standard deviation of the point spread in focus, with which lamps are seen, pixels.
        blur_px: f64 = 0.5, in BLUR_PX;
        /// Distance in focus, m; nearer and farther things are blurred by the pupil's width, focal
        /// length over f number. Default: none, all is in focus.
        focus_m: Option<f64> = None, in 0.2..=1e6;
        /// Share of a lamp's light that near glare spreads around it.
        halo_share: f64 = 0.02, in 0.0..=0.5;
        /// Distance in which the near glare falls to 1/e, pixels.
        halo_px: f64 = 12.0, in 0.1..=1e3;
        /// Share of a lamp's light in the wide veil around it.
        veil_share: f64 = 0.02, in 0.0..=0.5;
        /// Width of the veil, pixels: half of its light lies within 1.73 times this.
        veil_px: f64 = 20.0, in 0.1..=1e4;
        /// How much of the natural vignetting, the fourth power of the cosine to the axis, is left:
        /// 1 all, 0 none.
        vignetting: f64 = 1.0, in 0.0..=1.0;
        /// Share of the glass that lies under specks of dirt, which take 30 to 80 % of the light in
        /// the middle of their soft shadows.
        dirt_share: f64 = 0.0, in 0.0..=1.0;
        /// Share of the picture that something on the glass covers, from one side.
        occluded_share: f64 = 0.0, in 0.0..=1.0;
    }
}

impl LensSettings {
    /// The same glass, clean and without any glare.
    pub fn without_flaws(self) -> Self {
        Self {
            halo_share: 0.0,
            veil_share: 0.0,
            dirt_share: 0.0,
            occluded_share: 0.0,
            ..self
        }
    }

    /// Share of a lamp's light that is not glare.
    pub fn direct_share(&self) -> f64 {
        1.0 - self.halo_share - self.veil_share
    }

    /// Illuminance of the sensor on the axis under a scene of 1 cd/m^2.
    pub fn lux_per_cd_m2(&self) -> f64 {
        0.25 * PI * self.transmission / self.f_number.powi(2)
    }
}

/// What covers the pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Pattern {
    /// Nothing: every pixel sees all light.
    #[default]
    Grey,
    /// Bayer's mosaic with red at the top left, green beside and below it, then blue.
    Rggb,
}

impl Pattern {
    /// Of red, green and blue the one that belongs to a pixel; 1 without colours.
    pub fn of(self, u: u32, v: u32, [red, green, blue]: [f64; 3]) -> f64 {
        match (self, u % 2, v % 2) {
            (Self::Grey, ..) => 1.0,
            (Self::Rggb, 0, 0) => red,
            (Self::Rggb, 1, 1) => blue,
            (Self::Rggb, ..) => green,
        }
    }
}

settings! {
    /// From photons to digital numbers.
    #[derive(Copy)]
    pub struct SensorSettings {
        /// Electrons a photon.
        quantum_efficiency: f64 = 0.6, in 1e-3..=1.0;
        // The adapter's signal ends at 65504 e, the largest number in half precision.
        /// Most electrons that a pixel holds. At a gain of 0 dB they are full scale.
        full_well_e: f64 = 10_500.0, in 10.0..=6e4;
        /// Share of the charge over the full well that spills into the pixels above and below; the
        /// rest goes down the drain. It spills no farther than 32 pixels. Default 0, as in CMOS
        /// sensors with an anti-blooming drain.
        blooming: f64 = 0.0, in 0.0..=1.0;
        /// Gain before the converter, dB.
        gain_db: f64 = 3.3, in -20.0..=60.0;
        /// Digital number of darkness, on the scale of 8 bits.
        black_level_grey: f64 = 4.0, in 0.0..=255.0;
        /// Bits of the converter: 8, 10 or 12. Images of eight bits have the upper ones, the lower
        /// are dropped.
        bits: u8 = 8;
        /// Read noise, electrons.
        read_noise_e: f64 = 6.0, in 0.0..=1e3;
        /// Dark current, electrons a second.
        dark_current_e_per_s: f64 = 20.0, in 0.0..=1e6;
        /// Standard deviation of the pixels' offsets (DSNU1288), electrons.
        dsnu_e: f64 = 2.0, in 0.0..=1e3;
        /// Standard deviation of the pixels' gains over their mean (PRNU1288).
        prnu: f64 = 0.01, in 0.0..=0.2;
        /// Share of pixels that leak.
        hot_pixel_share: f64 = 1e-4, in 0.0..=1.0;
        /// What they leak in the mean, electrons a second.
        hot_pixel_e_per_s: f64 = 500.0, in 0.0..=1e6;
        /// Colours: `grey` or `rggb`, of which the mosaic is delivered.
        pattern: Pattern = Pattern::Grey;
        /// Light of a white LED that passes the red, green and blue filter.
        channel_response: [f64; 3] = [0.3, 0.45, 0.22], in 0.0..=1.0;
        /// Gains of the red, green and blue pixels before the converter. Default [1.5, 1, 2.05],
        /// which makes white LEDs white.
        white_balance: [f64; 3] = [1.5, 1.0, 2.05], in 0.1..=10.0;
        /// Draw noise from frame to frame.
        noise: bool = true;
    }
    also check_bits
}

impl SensorSettings {
    /// The same sensor without noise, fixed pattern, dark current and blooming.
    pub fn without_flaws(self) -> Self {
        Self {
            noise: false,
            blooming: 0.0,
            dark_current_e_per_s: 0.0,
            dsnu_e: 0.0,
            prnu: 0.0,
            hot_pixel_share: 0.0,
            ..self
        }
    }

    /// Electrons that an exposure of 1 lx s makes in a pixel of that width.
    pub fn electrons_per_lux_s(&self, pixel_m: f64) -> f64 {
        self.quantum_efficiency * PHOTONS_PER_LM_S * pixel_m.powi(2)
    }

    /// Grey levels of 255 an electron: the system gain on the scale of 8 bits.
    pub fn grey_per_e(&self) -> f64 {
        10f64.powf(self.gain_db / 20.0) * 255.0 / self.full_well_e
    }

    /// Digital numbers of the converter an electron: EMVA's system gain K.
    pub fn dn_per_e(&self) -> f64 {
        self.grey_per_e() * f64::from(self.dn_per_grey())
    }

    /// Of the pixels in a 2 x 2 cell: the two of an even row, then the two of an odd one.
    pub fn cell_dn_per_e(&self) -> [f64; 4] {
        [(0, 0), (1, 0), (0, 1), (1, 1)]
            .map(|(u, v)| self.dn_per_e() * self.pattern.of(u, v, self.white_balance))
    }

    /// Digital number of darkness.
    pub fn black_dn(&self) -> f64 {
        self.black_level_grey * f64::from(self.dn_per_grey())
    }

    /// Largest digital number.
    pub fn white_dn(&self) -> u16 {
        255 * self.dn_per_grey() + (self.dn_per_grey() - 1)
    }

    /// Digital numbers a grey level: 2^(bits - 8).
    pub fn dn_per_grey(&self) -> u16 {
        1 << self.spare_bits()
    }

    /// Bits that an image of eight does not have.
    pub fn spare_bits(&self) -> u32 {
        u32::from(self.bits).clamp(8, 16) - 8
    }

    fn check_bits(&self, check: &mut Checker<'_>) {
        if ![8, 10, 12].contains(&self.bits) {
            check.problem(
                "bits",
                format!("no converter here has {} bits", self.bits),
                "give 8, 10 or 12",
            );
        }
    }
}

/// The eight upper bits of a raw image that has `spare_bits` more: what a camera delivers that is
/// asked for eight.
pub fn upper_bits(raw: &RawImage, spare_bits: u32) -> GrayImage {
    let mut image = GrayImage::new(raw.width(), raw.height());
    for (to, from) in image.iter_mut().zip(raw.iter()) {
        *to = (from >> spare_bits).min(255) as u8;
    }
    image
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Settings;
    use std::f64::consts::FRAC_1_SQRT_2;

    /// Standard normal distribution function, by the series of its integral.
    fn below(x: f64) -> f64 {
        if x.abs() > 8.0 {
            return if x > 0.0 { 1.0 } else { 0.0 };
        }
        let (mut term, mut sum) = (x, x);
        for k in 1..200 {
            term *= -x * x / (2.0 * f64::from(k));
            sum += term / (2.0 * f64::from(k) + 1.0);
        }
        0.5 + sum * FRAC_1_SQRT_2 / PI.sqrt()
    }

    /// Largest difference between the distribution functions of m electrons after Poisson with
    /// normal read noise, and of the normal noise that is drawn instead.
    fn off(mean_e: f64, read_e: f64) -> f64 {
        let deviation = (mean_e + read_e * read_e).sqrt();
        let mut worst = 0.0f64;
        for step in -60..=60 {
            let e = mean_e + deviation * f64::from(step) * 0.1;
            let mut chance = (-mean_e).exp();
            let mut right = 0.0;
            for count in 0..400 {
                right += chance * below((e - f64::from(count)) / read_e);
                chance *= mean_e / f64::from(count + 1);
            }
            worst = worst.max((right - below((e - mean_e) / deviation)).abs());
        }
        worst
    }

    /// Holds the header's claim: fails where few electrons need more than a normal number.
    #[test]
    fn few_electrons_are_nearly_normal() {
        let read_e = SensorSettings::default().read_noise_e;
        for mean_e in [0.1, 1.0, 3.0, 10.0, 30.0, 72.0, 150.0] {
            let found = off(mean_e, read_e);
            assert!(found < 0.005, "{mean_e} e: {found}");
        }
        // What it would be without read noise to speak of.
        assert!(off(3.0, 0.5) > 0.03);
    }

    /// Fails where white LEDs are not white through the default mosaic, or a grey sensor has one.
    #[test]
    fn a_mosaic_has_its_colours_in_place() {
        let mut sensor = SensorSettings::default();
        assert!(
            sensor
                .cell_dn_per_e()
                .iter()
                .all(|k| (k - sensor.dn_per_e()).abs() < 1e-12)
        );
        sensor.pattern = Pattern::Rggb;
        let cell = sensor.cell_dn_per_e();
        let white = [(0, 0), (1, 0), (0, 1), (1, 1)]
            .map(|(u, v)| sensor.pattern.of(u, v, sensor.channel_response));
        for (gain, response) in cell.iter().zip(white) {
            let grey = gain * response / (cell[1] * white[1]);
            assert!((grey - 1.0).abs() < 0.01, "{grey}");
        }
        assert!(white[0] > white[3] && white[1] > white[0]);
    }

    /// Fails where a value that means nothing gets through, or is refused without a reason.
    #[test]
    fn bad_values_are_refused_with_the_reason() {
        let mut problems = Vec::new();
        let sensor = SensorSettings {
            bits: 9,
            full_well_e: 0.0,
            blooming: 1.5,
            prnu: f64::NAN,
            channel_response: [-0.1, 1.0, 1.0],
            ..SensorSettings::default()
        };
        sensor.check("sensor", &mut problems);
        let keys: Vec<_> = problems.iter().map(|p| p.key.as_str()).collect();
        assert_eq!(
            keys,
            [
                "sensor.full_well_e",
                "sensor.blooming",
                "sensor.prnu",
                "sensor.channel_response",
                "sensor.bits"
            ]
        );
        assert!(problems[4].to_string().contains("give 8, 10 or 12"));
    }
}
