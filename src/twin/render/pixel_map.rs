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

use super::gaussian::pair;
use super::glass::Shade;
use super::rounding::rounded;
use super::{Pattern, View};
use crate::bus::Intrinsics;
use crate::twin::random::{Stream, pcg4d};
use pulp::Arch;
use rayon::prelude::*;

/// Step of the gain: 16 bits reach from 0 to 2.
pub const GAIN_STEP: f64 = 1.0 / 32_768.0;
/// Step of the level: 15 bits reach from -16 to 16.
pub const LEVEL_STEP: f64 = 1.0 / 1024.0;
/// Flags a hot pixel.
pub const HOT: u32 = 1 << 16;
/// The level lies above this many bits.
pub const LEVEL_SHIFT: u32 = 17;
const LEVEL_MAX: f32 = 16_383.0;
const GAIN_MASK: u32 = 0xffff;
/// So many words there are.
const WORDS: f64 = 4_294_967_296.0;
/// Pixels that are worked at together: loops over so many become vector code.
const BLOCK_PX: usize = 64;
/// Cameras of a scene whose maps a renderer keeps.
pub const KEPT_MAPS: usize = 32;

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
        let rows = words
            .par_chunks_mut(row_len.max(1))
            .zip(0..camera.height_px);
        let arch = Arch::new();
        rows.for_each_init(
            || vec![0.0; camera.width_px as usize],
            |passed, (row, v)| {
                shade.row(v, passed);
                arch.dispatch(|| self.fill_row(pixels, v, passed, row));
            },
        );
        PixelMap { row_len, words }
    }

    /// Words of the pixels of row `v`, to each of which so much light passes.
    #[inline(always)]
    fn fill_row(&self, pixels: Stream, v: u32, passed: &[f32], row: &mut [u32]) {
        let response = [0, 1].map(|u| self.pattern.of(u, v, self.response));
        let response: [f32; BLOCK_PX] = std::array::from_fn(|u| response[u % 2] as f32);
        let hot_below = (self.hot_pixel_share * WORDS) as u32;
        let blocks = row.chunks_mut(BLOCK_PX).zip(passed.chunks(BLOCK_PX));
        for (first, (words, passed)) in (0..).step_by(BLOCK_PX).zip(blocks) {
            let [mut a, mut b, mut c, mut d] = [[0; BLOCK_PX]; 4];
            for k in 0..BLOCK_PX {
                [a[k], b[k], c[k], d[k]] = pixels.words(first + k as u32, v);
            }
            let draws = a.iter().zip(&b).zip(passed.iter().zip(&response));
            for (word, ((a, b), (passed, response))) in words.iter_mut().zip(draws) {
                let [x, level] = pair(*a, *b);
                let gain = passed * response * (1.0 + self.prnu as f32 * x);
                *word = gain_bits(gain) | level_bits(level);
            }
            if c.iter().all(|c| *c >= hot_below) {
                continue;
            }
            for ((word, c), d) in words.iter_mut().zip(c).zip(d).take(passed.len()) {
                if c < hot_below {
                    // Leaks of hot pixels spread as an exponential does.
                    let leak = -((f64::from(d) + 0.5) / WORDS).ln();
                    *word = *word & GAIN_MASK | HOT | level_bits(leak as f32);
                }
            }
        }
    }
}

#[inline(always)]
fn gain_bits(gain: f32) -> u32 {
    rounded(gain * (1.0 / GAIN_STEP) as f32, GAIN_MASK as f32)
}

#[inline(always)]
fn level_bits(level: f32) -> u32 {
    // Whole numbers below 2 LEVEL_MAX, less LEVEL_MAX.
    let from_least = rounded(
        level * (1.0 / LEVEL_STEP) as f32 + LEVEL_MAX,
        2.0 * LEVEL_MAX,
    );
    from_least.wrapping_sub(LEVEL_MAX as u32) << LEVEL_SHIFT
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
        let gain = GAIN_STEP * f64::from(word & GAIN_MASK);
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
