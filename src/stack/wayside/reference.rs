//! The reference image b(i0): learnt while the track is known to be clear, and held.
//!
//! Held, because an adaptive background swallows an obstacle that stays. The mean over some
//! frames takes the noise out of it; pixels that are saturated or unstable meanwhile (lamps) can
//! tell nothing later and are left out. What the others vary by is the sensor's noise.

use super::WaysideSettings;

/// Noise of a sensor: variance over grey level is a straight line, that of photons on that of the
/// electronics (EMVA 1288).
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Noise {
    /// Grey levels squared.
    pub dark: f64,
    /// Grey levels.
    pub per_grey: f64,
}

/// Rounding to whole grey levels.
const ROUNDING_VARIANCE: f64 = 1.0 / 12.0;

impl Noise {
    /// The line of least squares through grey levels and their variances.
    fn fit(points: impl Iterator<Item = (f64, f64)>) -> Self {
        let [mut n, mut x, mut y, mut xx, mut xy] = [0.0; 5];
        for (grey, variance) in points {
            n += 1.0;
            x += grey;
            y += variance;
            xx += grey * grey;
            xy += grey * variance;
        }
        let spread = n * xx - x * x;
        let per_grey = if spread > 0.0 {
            ((n * xy - x * y) / spread).max(0.0)
        } else {
            0.0
        };
        let dark = if n > 0.0 { (y - per_grey * x) / n } else { 0.0 };
        Self { dark, per_grey }
    }

    /// Of one pixel in one frame, grey levels squared.
    pub fn variance(&self, grey: f64) -> f64 {
        (self.dark + self.per_grey * grey).max(ROUNDING_VARIANCE)
    }
}

/// What a pixel was in the frames learnt from.
#[derive(Clone, Copy, Debug)]
struct Learnt {
    sum: u16,
    squares: u32,
    least: u8,
    most: u8,
}

/// Learns the reference, then keeps it.
#[derive(Clone, Debug)]
pub(super) struct Reference {
    frames: u32,
    wanted: u32,
    learnt: Vec<Learnt>,
    /// The reference image.
    pub mean: Vec<u8>,
    /// 1 where a pixel can be compared, 0 where it is left out.
    pub valid: Vec<u8>,
    /// Of the frames that it was learnt from.
    pub noise: Noise,
}

impl Reference {
    pub fn new(settings: &WaysideSettings, pixels: usize) -> Self {
        let nothing = Learnt {
            sum: 0,
            squares: 0,
            least: u8::MAX,
            most: 0,
        };
        Self {
            frames: 0,
            // 257 frames of 255 would overflow the sums.
            wanted: settings.reference_frames.clamp(1, 250),
            learnt: vec![nothing; pixels],
            mean: Vec::new(),
            valid: Vec::new(),
            noise: Noise::default(),
        }
    }

    pub fn ready(&self) -> bool {
        self.frames >= self.wanted
    }

    /// Adds a frame; with the last one the reference is made.
    pub fn learn(&mut self, grey: &[u8], settings: &WaysideSettings) {
        for (pixel, &g) in self.learnt.iter_mut().zip(grey) {
            pixel.sum += u16::from(g);
            pixel.squares += u32::from(g) * u32::from(g);
            pixel.least = g.min(pixel.least);
            pixel.most = g.max(pixel.most);
        }
        self.frames += 1;
        if self.ready() {
            self.finish(settings);
        }
    }

    fn finish(&mut self, settings: &WaysideSettings) {
        let n = self.wanted;
        let learnt = std::mem::take(&mut self.learnt);
        let mean = |p: &Learnt| ((u32::from(p.sum) + n / 2) / n) as u8;
        let is_valid = |p: &Learnt| {
            let stable = f64::from(p.most - p.least) < settings.unstable_grey;
            stable && f64::from(p.most) < settings.saturated_grey
        };
        self.mean = learnt.iter().map(mean).collect();
        self.valid = learnt.iter().map(|p| u8::from(is_valid(p))).collect();
        // From one frame alone there is no noise to see.
        let n = f64::from(n);
        let valid = learnt.iter().filter(|p| is_valid(p));
        self.noise = Noise::fit(valid.map(|p| {
            let (sum, squares) = (f64::from(p.sum), f64::from(p.squares));
            (sum / n, (squares - sum * sum / n) / (n - 1.0).max(1.0))
        }));
    }

    /// Leaves out every pixel for which `keep` (given column and row) is false.
    pub fn restrict(&mut self, width: usize, keep: impl Fn(usize, usize) -> bool) {
        for (v, row) in self.valid.chunks_exact_mut(width.max(1)).enumerate() {
            for (u, valid) in row.iter_mut().enumerate() {
                *valid &= u8::from(keep(u, v));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_scene::normal;
    use super::*;

    /// Photon transfer from the frames of the reference: variance 0.4 and 0.068 a grey level, put
    /// in, come out; pixels that flicker are left out of it. Provokes: a wrong count of frames, a
    /// variance about the wrong mean.
    #[test]
    fn noise_is_that_of_the_frames() {
        let pixels = 40_000;
        let settings = WaysideSettings::default();
        let mut reference = Reference::new(&settings, pixels);
        for n in 0..settings.reference_frames as usize {
            let frame: Vec<u8> = (0..pixels)
                .map(|k| {
                    let level = 20.0 + (k % 150) as f64;
                    let sigma = (0.4 + 0.068 * level).sqrt();
                    let flicker = if k % 7 == 0 {
                        60.0 * (n % 2) as f64
                    } else {
                        0.0
                    };
                    let noise = sigma * normal((n * pixels + k) as u32);
                    (level + noise + flicker).round() as u8
                })
                .collect();
            reference.learn(&frame, &settings);
        }
        for grey in [20.0, 60.0, 150.0] {
            let expected = 0.4 + 0.068 * grey + ROUNDING_VARIANCE;
            let ratio = reference.noise.variance(grey) / expected;
            assert!((ratio - 1.0).abs() < 0.03, "{grey}: {ratio}");
        }
    }
}
