//! From photo-electrons to digital numbers on the processor, many pixels at a time: for software adapters,
//! whose shaders take longer for it.
//!
//! The model is that of [`sensor`](super::sensor), the noise that of `shaders/sensor.wgsl`, number by number
//! but for the last bits of logarithm and sine. All of it is single precision in loops over slices that
//! compilers turn into vector code; [`pulp`] picks the widest that the processor has. Nothing is fused or
//! reordered, so every processor gives the same bytes.

use super::View;
use super::constants::BRIGHTEST_E;
use super::gaussian::{BLOCK_TEXELS, gaussian};
use super::pixel_map::{Dark, GAIN_STEP, HOT, LEVEL_SHIFT};
use super::rounding::{greatest, least, rounded};

/// Pixels that are worked at together: four a texel.
const BLOCK_PX: usize = 4 * BLOCK_TEXELS;

/// A view's sensor.
#[derive(Clone, Copy, Debug)]
pub struct Developer {
    /// Of the noise, the frame's number last; none without noise.
    noise: Option<[u32; 3]>,
    texels_a_row: u32,
    dark_e: f32,
    level_step_e: f32,
    /// What a step takes more in a hot pixel.
    hot_more_e: f32,
    saturation_e: f32,
    full_well_e: f32,
    read_noise_e: f32,
    black_dn: f32,
    white_dn: f32,
    dn_per_e: [f32; 4],
}

impl Developer {
    /// Of a view; none where charge spills from row to row, which is not done here.
    pub fn of(view: &View) -> Option<Self> {
        let (sensor, dark) = (&view.sensor, Dark::new(view));
        let [low, high] = view.noise.stream.key;
        (sensor.blooming <= 0.0).then(|| Self {
            noise: sensor.noise.then_some([low, high, view.noise.frame]),
            texels_a_row: view.camera.intrinsics.width_px.div_ceil(4),
            dark_e: dark.base_e as f32,
            level_step_e: dark.step_e as f32,
            hot_more_e: (dark.hot_step_e - dark.step_e) as f32,
            saturation_e: view.saturation_e() as f32,
            full_well_e: sensor.full_well_e as f32,
            read_noise_e: sensor.read_noise_e as f32,
            black_dn: sensor.black_dn() as f32,
            white_dn: f32::from(sensor.white_dn()),
            dn_per_e: sensor.cell_dn_per_e().map(|k| k as f32),
        })
    }

    /// Digital numbers of row `v` from its signal in electrons and its words of the pixel map, each converted to
    /// a pixel of the image.
    #[inline(always)]
    pub fn row<T>(
        &self,
        v: usize,
        signals_e: &[f32],
        words: &[u32],
        out: &mut [T],
        convert: impl Fn(u32) -> T,
    ) {
        let dn_per_e: [f32; BLOCK_PX] = std::array::from_fn(|u| self.dn_per_e[v % 2 * 2 + u % 2]);
        let mut noise = [0.0; BLOCK_PX];
        let mut counter = v as u32 * self.texels_a_row;
        let blocks = signals_e.chunks(BLOCK_PX).zip(words.chunks(BLOCK_PX));
        for ((signals_e, words), out) in blocks.zip(out.chunks_mut(BLOCK_PX)) {
            if let Some(key) = self.noise {
                gaussian(key, counter, &mut noise);
            }
            counter += BLOCK_TEXELS as u32;
            let mut digital = [0; BLOCK_PX];
            let pixels = signals_e.iter().zip(words).zip(&noise).zip(&dn_per_e);
            for (to, (((signal_e, word), n), dn_per_e)) in digital.iter_mut().zip(pixels) {
                *to = self.digital(*signal_e, *word, *n, *dn_per_e);
            }
            for (to, from) in out.iter_mut().zip(&digital) {
                *to = convert(*from);
            }
        }
    }

    /// The digital number of a pixel with a word, under a normal number.
    #[inline(always)]
    fn digital(&self, signal_e: f32, word: u32, n: f32, dn_per_e: f32) -> u32 {
        let gain = (GAIN_STEP as f32) * (word & 0xffff) as i32 as f32;
        let level = (word as i32 >> LEVEL_SHIFT) as f32;
        // The flag as a number: a choice between two values becomes a slow look-up.
        let hot = ((word / HOT) & 1) as i32 as f32;
        let step_e = self.level_step_e + hot * self.hot_more_e;
        // What half precision ends at may be any amount more.
        let held_e = if signal_e >= BRIGHTEST_E as f32 {
            self.saturation_e
        } else {
            least(signal_e, self.saturation_e)
        };
        let charge_e = held_e * gain + (level * step_e + self.dark_e);
        let read_e = self.read_noise_e;
        let deviation_e = greatest(charge_e + read_e * read_e, 0.0).sqrt();
        // A full pixel has no shot noise, but still read noise.
        let electrons = least(charge_e + deviation_e * n, self.full_well_e + read_e * n);
        let dn = self.black_dn + dn_per_e * electrons;
        rounded(dn, self.white_dn)
    }
}
