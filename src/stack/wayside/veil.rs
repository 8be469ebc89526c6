//! How much of the bed's light comes through a veil: mist, dust, a wet or dirty glass.
//!
//! A veil adds light of its own, and of every difference in grey behind it only a share is left: e^(-k d)
//! at a distance d (Koschmieder 1924). Grey levels alone do not tell: a bed behind a veil is bright. But
//! rails and sleepers lie everywhere, and what they differ by in clear air is known; what is left of that
//! tells what is left of a body. On a line across the track the distance is the same, so that the veil adds
//! the same to all of it, but for a slope.

use super::cells::GaugeCells;
use super::reference::Reference;
use super::sight::Sight;
use std::ops::Range;

/// Lines go from rail to rail and a little beyond, m either side of the centreline.
const HALF_WIDTH_M: f64 = 1.0;
/// So many lines in each step along the line.
const LINES_A_STEP: usize = 4;
/// Points of a line: one a pixel, but not more than say enough, nor fewer than would show a rail.
const POINTS: Range<usize> = 6..64;
/// So many steps either side count with a step: the rails mirror bright places and dark ones in turns.
const WINDOW_STEPS: usize = 5;

/// Sums over the lines of a step.
#[derive(Clone, Copy, Debug, Default)]
struct StepSums {
    lines: f64,
    /// Variance across the track, without the noise, grey levels squared.
    variance: f64,
}

/// The track before a camera, in lines across it.
#[derive(Clone, Debug)]
pub(super) struct TrackContrast {
    pixels: Vec<usize>,
    /// Step of each line, and which of `pixels` it is, from right to left.
    lines: Vec<(usize, Range<usize>)>,
    sums: Vec<StepSums>,
}

impl TrackContrast {
    /// Of all of the watched stretch that is in the picture, in steps of `step_m`.
    pub fn new(sight: &Sight, step_m: f64, steps: usize) -> Self {
        let (from_m, _) = sight.watched_m();
        let mut track = Self {
            pixels: Vec::new(),
            lines: Vec::new(),
            sums: vec![StepSums::default(); steps],
        };
        for step in 0..steps {
            for k in 0..LINES_A_STEP {
                let share = (k as f64 + 0.5) / LINES_A_STEP as f64;
                track.add_line(sight, step, from_m + (step as f64 + share) * step_m);
            }
        }
        track
    }

    /// Adds the line at a chainage, where the camera tells it from the last one.
    fn add_line(&mut self, sight: &Sight, step: usize, s_m: f64) {
        let ends = [-HALF_WIDTH_M, HALF_WIDTH_M].map(|l_m| sight.floor_pixel(s_m, l_m));
        let [Some(right), Some(left)] = ends else {
            return;
        };
        let points = ((left - right).norm() as usize).min(POINTS.end);
        let width = sight.calibration().camera.intrinsics.width_px as usize;
        let pixels = (0..points).filter_map(|k| {
            let share = (k as f64 + 0.5) / points as f64;
            let pixel = sight.floor_pixel(s_m, HALF_WIDTH_M * (2.0 * share - 1.0))?;
            Some(pixel.y.round() as usize * width + pixel.x.round() as usize)
        });
        let first = self.pixels.len();
        self.pixels.extend(pixels);
        let line = first..self.pixels.len();
        let last = self
            .lines
            .last()
            .map(|(_, last)| &self.pixels[last.clone()]);
        if line.len() >= POINTS.start && last != Some(&self.pixels[line.clone()]) {
            self.lines.push((step, line));
        } else {
            self.pixels.truncate(first);
        }
    }

    /// Takes a frame. What a train hides is left out.
    pub fn measure(&mut self, frame: &[u8], reference: &Reference, cells: &GaugeCells) {
        self.sums.fill(StepSums::default());
        for (step, line) in &self.lines {
            let pixels = &self.pixels[line.clone()];
            if pixels.iter().any(|&k| cells.hides(k)) {
                continue;
            }
            let valid = pixels.iter().filter(|&&k| reference.valid[k] != 0);
            let greys = valid.map(|&k| f64::from(frame[k]));
            if let Some((mean, variance)) = variance_about_slope(greys) {
                let sums = &mut self.sums[*step];
                sums.lines += 1.0;
                sums.variance += variance - reference.noise.variance(mean);
            }
        }
    }

    /// Standard deviation of the grey across the track around a step, grey levels; `None` where nothing of it
    /// is in view.
    pub fn around(&self, step: usize) -> Option<f64> {
        let last = (step + WINDOW_STEPS + 1).min(self.sums.len());
        let near = &self.sums[step.saturating_sub(WINDOW_STEPS)..last];
        let lines: f64 = near.iter().map(|s| s.lines).sum();
        let variance: f64 = near.iter().map(|s| s.variance).sum();
        (lines > 0.0).then(|| (variance / lines).max(0.0).sqrt())
    }
}

/// Mean of some values, and their variance about the straight line of least squares; none of too few.
fn variance_about_slope(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let [mut n, mut x, mut y, mut xx, mut xy, mut yy] = [0.0; 6];
    for value in values {
        x += n;
        xx += n * n;
        xy += n * value;
        y += value;
        yy += value * value;
        n += 1.0;
    }
    if n < POINTS.start as f64 {
        return None;
    }
    let explained = (xy - x * y / n).powi(2) / (xx - x * x / n);
    Some((y / n, (yy - y * y / n - explained) / (n - 2.0)))
}

#[cfg(test)]
mod tests {
    use super::super::WaysideSettings;
    use super::super::test_scene::{BED_M, DEVICE_M, TestScene};
    use super::*;

    const STEPS: usize = 60;

    /// What is measured of the tests' track at each metre of the watched stretch.
    fn measured(scene: &TestScene) -> Vec<Option<f64>> {
        let settings = WaysideSettings::default();
        let (calibration, map) = (scene.calibration.clone(), scene.map.clone());
        let i = calibration.camera.intrinsics;
        let (width, height) = (i.width_px as usize, i.height_px as usize);
        let sight = Sight::new(&settings, calibration, map);
        let cells = GaugeCells::new(&sight, width, height);
        let mut reference = Reference::new(&settings, width * height);
        let frame = |n| scene.frame(n, |_, _| 1.0, &[]).image;
        for n in 0..settings.reference_frames {
            reference.learn(&frame(n), &settings);
        }
        let mut track = TrackContrast::new(&sight, 1.0, STEPS);
        track.measure(&frame(20), &reference, &cells);
        (0..STEPS).map(|step| track.around(step)).collect()
    }

    /// Of the contrast in clear air Koschmieder's share must be left, e^(-3.912 d / V) at a distance d, for
    /// the middle of the steps that count; and the noise must not count. Provokes a veil's own light taken
    /// for contrast, and steps counted from the wrong end.
    #[test]
    fn what_is_left_follows_koschmieder() {
        let mut scene = TestScene::new(1280, 720);
        let clear = measured(&scene);
        for visibility_m in [300.0, 100.0] {
            scene.visibility_m = visibility_m;
            let veiled = measured(&scene);
            // The watched stretch begins 80 m before the device.
            for step in [35, 45, 55] {
                let along_m = 80.0 - (step as f64 + 0.5);
                let eye = scene.calibration.world_from_camera.translation.vector;
                let bed = scene.map.alignment.at(DEVICE_M - along_m);
                let below = bed.world_from_line() * nalgebra::Point3::new(0.0, 0.0, BED_M);
                let law = (-3.912 * (below.coords - eye).norm() / visibility_m).exp();
                let [veiled, clear] = [&veiled, &clear].map(|of| of[step].unwrap_or(f64::NAN));
                let left = veiled / clear;
                assert!((left / law - 1.0).abs() < 0.1, "{along_m} m: {left}, {law}");
            }
        }
    }

    /// A slope alone has no variance; a wave on it has its own, half its height squared. Provokes a slope
    /// left in, and a wrong number of degrees of freedom.
    #[test]
    fn a_slope_does_not_count() {
        let slope = |k: usize| 40.0 + 0.7 * k as f64;
        let (mean, variance) = variance_about_slope((0..64).map(slope)).unwrap_or_default();
        assert!((mean - slope(0) - 0.7 * 31.5).abs() < 1e-9 && variance.abs() < 1e-8);
        let wave = |k: usize| slope(k) + 6.0 * (k as f64 * std::f64::consts::TAU / 8.0).cos();
        let (_, variance) = variance_about_slope((0..64).map(wave)).unwrap_or_default();
        assert!((variance - 18.0 * 64.0 / 62.0).abs() < 0.05, "{variance}");
        assert_eq!(variance_about_slope((0..5).map(wave)), None);
    }
}
