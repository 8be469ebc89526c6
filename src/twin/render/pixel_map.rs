//! What is fixed in every pixel of a camera: its gain (glass, response of its colour, PRNU) and its
//! offset (DSNU, or the leak of a hot pixel). Made once from the camera's stream; the plain
//! renderer and the shader read the same words.
//!
//! # One word a pixel
//!
//! ```text
//! bits  0..16   gain, in steps of GAIN_STEP
//! bit      16   whether the pixel is hot
//! bits 17..32   signed level x, in steps of LEVEL_STEP
//!
//! electrons = signal * gain + dark current * exposure
//!           + x * (hot ? mean hot rate * exposure : DSNU)
//! ```
//!
//! Exposure, dark current and DSNU come in when the word is read, so a map stays what it is when
//! the exposure changes.

use super::glass::Shade;
use super::{Pattern, View};
use crate::bus::Intrinsics;
use crate::twin::random::{Stream, pcg4d};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Step of the gain: 16 bits reach from 0 to 2.
pub const GAIN_STEP: f64 = 1.0 / 32_768.0;
/// Step of the level: 15 bits reach from -16 to 16.
pub const LEVEL_STEP: f64 = 1.0 / 1024.0;
/// Flags a hot pixel.
pub const HOT: u32 = 1 << 16;
/// The level lies above this many bits.
pub const LEVEL_SHIFT: u32 = 17;
const LEVEL_MAX: f64 = 16_383.0;
/// Cameras whose maps a renderer keeps.
pub const KEPT_MAPS: usize = 8;

/// All that a map depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapKey {
    stream: Stream,
    camera: Intrinsics,
    lens: super::LensSettings,
    pattern: Pattern,
    response: [f64; 3],
    prnu: f64,
    hot_pixel_share: f64,
}

impl MapKey {
    /// Of a view's camera.
    pub fn new(view: &View) -> Self {
        let sensor = &view.sensor;
        Self {
            stream: view.noise.stream,
            camera: view.camera.intrinsics,
            lens: view.lens,
            pattern: sensor.pattern,
            response: sensor.channel_response,
            prnu: sensor.prnu,
            hot_pixel_share: sensor.hot_pixel_share,
        }
    }

    /// Makes the map.
    pub fn make_map(&self) -> PixelMap {
        let camera = &self.camera;
        let shade = Shade::new(&self.lens, camera, branch(self.stream, 1));
        let pixels = branch(self.stream, 2);
        let row_len = 4 * camera.width_px.div_ceil(4) as usize;
        let mut words = vec![0; row_len * camera.height_px as usize];
        let rows = words.par_chunks_mut(row_len.max(1));
        rows.zip(0..camera.height_px).for_each(|(row, v)| {
            for (word, u) in row.iter_mut().zip(0..camera.width_px) {
                *word = self.word(pixels.words(u, v), (u, v), shade.at(u, v));
            }
        });
        PixelMap { row_len, words }
    }

    fn word(&self, draw: [u32; 4], (u, v): (u32, u32), passed: f64) -> u32 {
        let [a, b] = normals(draw[0], draw[1]);
        let response = self.pattern.of(u, v, self.response);
        let gain = passed * response * (1.0 + self.prnu * a);
        let gain = (gain / GAIN_STEP).round().clamp(0.0, 65_535.0) as u32;
        let hot = unit(draw[2]) < self.hot_pixel_share;
        // Leaks of hot pixels spread as an exponential does.
        let level = if hot { -unit(draw[3]).ln() } else { b };
        let level = (level / LEVEL_STEP).round().clamp(-LEVEL_MAX, LEVEL_MAX) as i32;
        gain | if hot { HOT } else { 0 } | (level << LEVEL_SHIFT) as u32
    }
}

/// The words of a camera's pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct PixelMap {
    row_len: usize,
    words: Vec<u32>,
}

impl PixelMap {
    /// Row by row, each filled up to a multiple of four.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// Of row `v`.
    pub fn row(&self, v: usize) -> &[u32] {
        &self.words[v * self.row_len..][..self.row_len]
    }
}

/// Electrons in the dark, for a map's words.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dark {
    /// In every pixel.
    pub base_e: f64,
    /// A step of the level.
    pub step_e: f64,
    /// A step of the level in a hot pixel.
    pub hot_step_e: f64,
}

impl Dark {
    /// In an exposure of a view.
    pub fn new(view: &View) -> Self {
        let (sensor, exposure_s) = (&view.sensor, view.camera.shutter.exposure_s);
        Self {
            base_e: sensor.dark_current_e_per_s * exposure_s,
            step_e: LEVEL_STEP * sensor.dsnu_e,
            hot_step_e: LEVEL_STEP * sensor.hot_pixel_e_per_s * exposure_s,
        }
    }

    /// Electrons of a pixel with that word under a signal.
    pub fn charge_e(&self, word: u32, signal_e: f64) -> f64 {
        let gain = GAIN_STEP * f64::from(word & 0xffff);
        let level = f64::from(word as i32 >> LEVEL_SHIFT);
        let step_e = if word & HOT == 0 {
            self.step_e
        } else {
            self.hot_step_e
        };
        signal_e * gain + self.base_e + level * step_e
    }
}

/// A stream of its own for the same camera.
fn branch(stream: Stream, number: u32) -> Stream {
    let [low, high, ..] = pcg4d([stream.key[0], stream.key[1], u32::MAX, number]);
    Stream { key: [low, high] }
}

fn unit(word: u32) -> f64 {
    (f64::from(word) + 0.5) / 4_294_967_296.0
}

/// Two standard normal numbers of two words (Box and Muller).
fn normals(a: u32, b: u32) -> [f64; 2] {
    let radius = (-2.0 * unit(a).ln()).sqrt();
    let (sin, cos) = (TAU * unit(b)).sin_cos();
    [radius * cos, radius * sin]
}
