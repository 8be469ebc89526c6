//! A spectrum between its bins.
//!
//! N samples have a spectrum at all frequencies, and its N bins say all of it: at the frequency f (in bins) it is
//! sum_k X_k D(f - k), D(x) = exp(-i pi x (N - 1) / N) sin(pi x) / (N sin(pi x / N)). Here only [`REACH`] bins to either
//! side are summed. With a window the others hold nothing. Without one they hold up to 2 / (pi^2 REACH) of a tone's power,
//! more on one side than on the other: then X is a multiple of D itself, and the place is sought where the bins that are
//! summed are most like it, which is where sum X D / sqrt(sum D^2) is highest.

use rustfft::num_complex::Complex32;
use std::f64::consts::PI;

/// Bins to either side that are taken in.
pub const REACH: usize = 8;
/// Of both sides and the middle.
pub const BINS: usize = 2 * REACH + 1;
/// How far from the middle a highest place is looked for, in steps: 2 bins, where main lobes end.
const FARTHEST: isize = 16;
/// Steps of a bin.
const STEPS: f64 = 8.0;

/// The bins about one of them.
pub type Profile = [Complex32; BINS];

/// Interpolates along one axis.
#[derive(Clone, Debug)]
pub struct Axis {
    /// Bins, which repeat after the last.
    pub bins: usize,
    /// Bins to either side that there are.
    reach: usize,
    /// No window.
    is_bare: bool,
    /// By step from the farthest below to the farthest above.
    kernels: Vec<Profile>,
}

impl Axis {
    /// Of so many bins, of samples without a window or with one.
    pub fn new(bins: usize, is_bare: bool) -> Self {
        let mut axis = Self {
            bins,
            reach: REACH.min(bins.saturating_sub(1) / 2),
            is_bare,
            kernels: Vec::new(),
        };
        let steps = -FARTHEST..=FARTHEST;
        axis.kernels = steps.map(|k| axis.kernel(k as f64 / STEPS)).collect();
        axis
    }

    /// Number of the bin `k` of [`BINS`] about a middle one.
    pub fn bin(&self, middle: usize, k: usize) -> usize {
        (middle + k + self.bins * REACH - REACH) % self.bins
    }

    /// Weights of the bins at an offset from the middle one, to find a tone.
    pub fn kernel(&self, offset: f64) -> Profile {
        self.scaled(offset, -0.5)
    }

    /// Weights that give its amplitude there.
    pub fn amplitude(&self, offset: f64) -> Profile {
        self.scaled(offset, -1.0)
    }

    /// Without a window, times a power of the sum of squares.
    fn scaled(&self, offset: f64, exponent: f32) -> Profile {
        let mut kernel = self.bare(offset);
        if self.is_bare {
            let sum: f32 = kernel.iter().map(|weight| weight.norm_sqr()).sum();
            let scale = sum.powf(exponent);
            kernel.iter_mut().for_each(|weight| *weight *= scale);
        }
        kernel
    }

    fn bare(&self, offset: f64) -> Profile {
        let count = self.bins as f64;
        let mut kernel = [Complex32::default(); BINS];
        for (k, out) in kernel.iter_mut().enumerate() {
            if k.abs_diff(REACH) > self.reach {
                continue;
            }
            let x = offset - (k as f64 - REACH as f64);
            let below = count * (PI * x / count).sin();
            let size = if below.abs() < 1e-9 {
                1.0
            } else {
                (PI * x).sin() / below
            };
            let (sin, cos) = (-PI * x * (count - 1.0) / count).sin_cos();
            *out = Complex32::new((size * cos) as f32, (size * sin) as f32);
        }
        kernel
    }

    /// The highest place of a profile within so many bins of an offset, by an offset.
    pub fn highest(&self, profile: &Profile, about: f64, within: f64) -> f64 {
        let first = ((about - within) * STEPS).ceil().max(-FARTHEST as f64) as isize;
        let last = ((about + within) * STEPS).floor().min(FARTHEST as f64) as isize;
        let best = (first..=last).max_by(|a, b| {
            let power = |k: &isize| self.coarse(profile, *k);
            power(a).total_cmp(&power(b))
        });
        let start = best.map_or(about, |k| k as f64 / STEPS);
        let power = |offset: f64| f64::from(dot(profile, &self.kernel(offset)).norm_sqr());
        vertex(power, vertex(power, start, 0.5 / STEPS), 0.1 / STEPS)
    }

    /// The highest of other places, by offset, where the profile is higher than on either side, up to 2 bins away.
    pub fn other_height(&self, profile: &Profile, about: f64) -> Option<f64> {
        let power = |k: isize| self.coarse(profile, k);
        let is_top = |k: &isize| power(k - 1) < power(*k) && power(*k) >= power(k + 1);
        let is_other = |k: &isize| (*k as f64 / STEPS - about).abs() > 2.0 / STEPS;
        let tops = (1 - FARTHEST..FARTHEST).filter(|k| is_other(k) && is_top(k));
        let highest = tops.max_by(|a, b| power(*a).total_cmp(&power(*b)));
        highest.map(|k| k as f64 / STEPS)
    }

    fn coarse(&self, profile: &Profile, step: isize) -> f32 {
        dot(profile, &self.kernels[(step + FARTHEST) as usize]).norm_sqr()
    }
}

/// Sum of products.
pub fn dot(a: &Profile, b: &Profile) -> Complex32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Top of the parabola through three places, no farther away than they are.
pub fn vertex(power: impl Fn(f64) -> f64, at: f64, step: f64) -> f64 {
    let [below, middle, above] = [power(at - step), power(at), power(at + step)];
    let bend = below - 2.0 * middle + above;
    if bend < 0.0 {
        at + step * (0.5 * (below - above) / bend).clamp(-1.0, 1.0)
    } else {
        at
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// The spectrum of a tone about a bin, by its sum.
    fn tone(bins: usize, frequency: f64, middle: usize) -> Profile {
        let axis = Axis::new(bins, true);
        let mut profile = [Complex32::default(); BINS];
        for (k, out) in profile.iter_mut().enumerate() {
            let off = frequency - axis.bin(middle, k) as f64;
            let terms = (0..bins).map(|n| {
                let (sin, cos) = (TAU * off * n as f64 / bins as f64).sin_cos();
                Complex32::new(cos as f32, sin as f32)
            });
            *out = terms.sum::<Complex32>() / bins as f32;
        }
        profile
    }

    /// A tone anywhere between bins is found, also where bins repeat.
    #[test]
    fn a_tone_between_bins_is_found() {
        for (bins, middle) in [(256, 100), (256, 0), (128, 127)] {
            for k in -5..=5 {
                let offset = f64::from(k) / 10.0;
                let profile = tone(bins, middle as f64 + offset, middle);
                let axis = Axis::new(bins, true);
                let found = axis.highest(&profile, 0.0, 0.75);
                assert!((found - offset).abs() < 2e-3, "{bins} {offset} {found}");
                let power = dot(&profile, &axis.amplitude(found)).norm_sqr();
                assert!((power - 1.0).abs() < 1e-3, "{power}");
            }
        }
    }

    /// Provokes: axes shorter than the bins that are taken in.
    #[test]
    fn short_axes_do_not_panic() {
        for bins in 1..20 {
            let profile = tone(bins, 0.3, 0);
            assert!(
                Axis::new(bins, true)
                    .highest(&profile, 0.0, 0.75)
                    .is_finite()
            );
        }
    }
}
