//! One brightness a row: what the rolling shutter saw of the lamp's switching.
//!
//! The mean of a row's columns inside the lamp, over black, is the row's light. Its envelope, the
//! light that the row would have while the lamp is on, is the grey closing of that profile by a
//! segment longer than the longest darkness: closing fills every dark stripe to the lower of its
//! two bright neighbours. Light over envelope is then 0 to 1 whatever the lamp's shading.
//!
//! Glare around the lamp blinks too. Above and below the lamp the profile runs on through it as
//! long as the envelope stands out, which doubles the rows that a far lamp gives.
//!
//! **Tilt.** "Rotating the stripes upright" is a photographer's step: stripes are rows of the
//! sensor, so they can only be tilted by resampling. Here nothing is (points are rectified, not
//! images), but recorded images may have been, by the small angle between an eye's own rows and the
//! epipolar lines. A tilt of 0.5 deg shears stripes by a
//! quarter row across 30 columns (harmless) but by one row across 120. So the shear is measured, by
//! matching the profiles of the left and right part of the spot, and undone where it matters.

use super::ellipse::chord;
use super::patch::Patch;
use crate::bus::Ellipse;
use std::ops::RangeInclusive;

/// Light by rows.
#[derive(Debug)]
pub struct RowProfile {
    /// Image row of the first entry (may be negative: rows above the image are dark).
    pub first_row: f64,
    /// Mean grey over black.
    pub light: Vec<f64>,
    /// The same without stripes.
    pub envelope: Vec<f64>,
}

/// Rows of glare that are looked at above and below the spot.
pub const REACH_ROWS: i64 = 40;

impl RowProfile {
    /// The profile of the spot with this outline ellipse.
    pub fn of(
        raw: &Patch,
        black: f64,
        spot: &Ellipse,
        gap_rows: usize,
        tilt_over_rows: f64,
    ) -> Self {
        let tilt = tilt(raw, black, spot, tilt_over_rows);
        let light = band(raw, black, spot, (0.0, 1.0), tilt);
        Self {
            first_row: *rows(spot).start() as f64,
            envelope: closing(&light, gap_rows),
            light,
        }
    }

    /// Row numbers of the longest stretch whose envelope is at least `floor`.
    pub fn lit_stretch(&self, floor: f64) -> Option<(usize, usize)> {
        let mut best: Option<(usize, usize)> = None;
        let mut from = None;
        for k in 0..=self.envelope.len() {
            let lit = self.envelope.get(k).is_some_and(|&e| e >= floor);
            match (lit, from) {
                (true, None) => from = Some(k),
                (false, Some(start)) => {
                    if best.is_none_or(|(a, b)| k - 1 - start > b - a) {
                        best = Some((start, k - 1));
                    }
                    from = None;
                }
                _ => {}
            }
        }
        best
    }
}

fn half_height(e: &Ellipse) -> f64 {
    let (sin, cos) = e.angle_rad.sin_cos();
    (e.semi_major_px * sin).hypot(e.semi_minor_px * cos)
}

/// Image rows of a profile.
fn rows(spot: &Ellipse) -> RangeInclusive<i64> {
    let half = half_height(spot);
    let first = (spot.centre.y - half).floor() as i64 - REACH_ROWS;
    let last = (spot.centre.y + half).ceil() as i64 + REACH_ROWS;
    first..=last
}

/// Shear of the stripes to be undone, rows per column; 0 where it does not matter.
fn tilt(raw: &Patch, black: f64, spot: &Ellipse, over_rows: f64) -> f64 {
    let left = band(raw, black, spot, (0.0, 0.45), 0.0);
    let right = band(raw, black, spot, (0.55, 1.0), 0.0);
    let width = spot.semi_major_px + spot.semi_minor_px;
    let between = 0.275 * width;
    let tilt = shift_between(&left, &right) / between;
    if (tilt * width).abs() > over_rows && between > 4.0 {
        tilt
    } else {
        0.0
    }
}

/// Mean light of each row between two shares of the spot's chord, sheared by `tilt`. Above and
/// below the spot the columns of its highest and lowest point are used.
fn band(raw: &Patch, black: f64, spot: &Ellipse, (from, to): (f64, f64), tilt: f64) -> Vec<f64> {
    let half = half_height(spot);
    let narrow = (0.4 * spot.semi_minor_px).max(2.0);
    let light = |v: i64| {
        // Rows near the ends keep a band that is wide enough to average noise.
        let dv = (v as f64 - spot.centre.y).clamp(-0.97 * half, 0.97 * half);
        let Some((l, r)) = chord(spot, spot.centre.y + dv) else {
            return 0.0;
        };
        let (middle, half_width) = (0.5 * (l + r), (0.5 * (r - l) - 1.0).max(narrow));
        let u0 = middle + (2.0 * from - 1.0) * half_width;
        let u1 = middle + (2.0 * to - 1.0) * half_width;
        (mean(raw, v as f64, (u0, u1), (spot.centre.x, tilt)) - black).max(0.0)
    };
    rows(spot).map(light).collect()
}

/// Mean grey of a row from `u0` to `u1`, 0 outside the patch; with a tilt the row is followed
/// with linear interpolation between rows.
fn mean(raw: &Patch, v: f64, (u0, u1): (f64, f64), (pivot, tilt): (f64, f64)) -> f64 {
    let columns = |u: f64| (u - raw.u0 as f64).round().clamp(0.0, raw.width as f64) as usize;
    let (c0, c1) = (columns(u0), columns(u1 + 1.0).min(raw.width));
    if c0 >= c1 {
        return 0.0;
    }
    let row = v - raw.v0 as f64;
    let pixel_row = |k: f64| (k >= 0.0 && (k as usize) < raw.height).then(|| raw.row(k as usize));
    if tilt.abs() < 1e-12 {
        let Some(pixels) = pixel_row(row) else {
            return 0.0;
        };
        let sum: u32 = pixels[c0..c1].iter().map(|&g| u32::from(g)).sum();
        return f64::from(sum) / (c1 - c0) as f64;
    }
    let mut sum = 0.0;
    for c in c0..c1 {
        let along = row + tilt * ((c + raw.u0) as f64 - pivot);
        let share = along - along.floor();
        let at = |k: f64| pixel_row(k).map_or(0.0, |pixels| f64::from(pixels[c]));
        sum += (1.0 - share) * at(along.floor()) + share * at(along.floor() + 1.0);
    }
    sum / (c1 - c0) as f64
}

/// Rows by which `b` lies below `a`: the best whole shift up to three rows, refined by a parabola.
fn shift_between(a: &[f64], b: &[f64]) -> f64 {
    let score = |shift: i64| -> f64 {
        let pairs = (3..a.len() as i64 - 3)
            .filter_map(|k| Some((a.get(k as usize)?, b.get((k + shift) as usize)?)));
        -pairs.map(|(x, y)| (x - y).powi(2)).sum::<f64>()
    };
    let scores: [f64; 7] = std::array::from_fn(|k| score(k as i64 - 3));
    let best = (1..6)
        .max_by(|&i, &j| scores[i].total_cmp(&scores[j]))
        .unwrap_or(3);
    let (before, top, after) = (scores[best - 1], scores[best], scores[best + 1]);
    let bend = before - 2.0 * top + after;
    let fraction = if bend < 0.0 {
        0.5 * (before - after) / bend
    } else {
        0.0
    };
    best as f64 - 3.0 + fraction.clamp(-0.5, 0.5)
}

/// Grey closing by a segment of `2 half + 1` samples, where `2 half >= gap`: largest value in the
/// window, then the smallest of those. Outside the samples it is dark.
fn closing(samples: &[f64], gap: usize) -> Vec<f64> {
    let half = gap.div_ceil(2);
    let n = samples.len();
    let window = |k: usize| k.saturating_sub(half)..(k + half + 1).min(n);
    let largest = |k: usize| samples[window(k)].iter().copied().fold(0.0, f64::max);
    let dilated: Vec<f64> = (0..n).map(largest).collect();
    let smallest = |k: usize| {
        dilated[window(k)]
            .iter()
            .copied()
            .fold(f64::INFINITY, f64::min)
    };
    (0..n).map(smallest).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use nalgebra::Point2;

    /// The envelope fills stripes to the lower neighbour and leaves what is lit.
    #[test]
    fn closing_fills_gaps_and_nothing_else() {
        let samples = [
            0.0, 0.0, 9.0, 0.0, 0.0, 7.0, 5.0, 0.0, 0.0, 0.0, 0.0, 4.0, 0.0, 0.0, 0.0,
        ];
        let out = closing(&samples, 2);
        assert_eq!(out[2..7], [9.0, 7.0, 7.0, 7.0, 5.0]);
        assert_eq!((out[8], out[11]), (0.0, 4.0));
    }

    /// Stripes drawn with a known shear; the measured one is undone.
    #[test]
    fn tilted_stripes_are_measured_and_followed() {
        let (w, h, tilt) = (160usize, 200usize, 0.02);
        let spot = Ellipse {
            centre: Point2::new(80.0, 100.0),
            semi_major_px: 60.0,
            semi_minor_px: 50.0,
            angle_rad: 0.0,
        };
        let mut data = vec![0u8; w * h];
        for v in 0..h {
            for u in 0..w {
                let inside =
                    chord(&spot, v as f64).is_some_and(|(l, r)| (l..r).contains(&(u as f64)));
                let phase = (v as f64 - tilt * (u as f64 - 80.0)) / 9.0;
                // Every second stripe is wider, so that a shift by a period is no match.
                let on = (phase * std::f64::consts::PI).sin() + 0.4 * (phase * 1.37).sin();
                data[v * w + u] = if inside { (100.0 + 60.0 * on) as u8 } else { 0 };
            }
        }
        let raw = Patch::from_data(0, 0, w, h, data);
        let measured = super::tilt(&raw, 0.0, &spot, 0.5);
        assert!((measured - tilt).abs() < 0.3 * tilt, "{measured}");
        let unimportant = super::tilt(&raw, 0.0, &spot, 100.0);
        assert_eq!(unimportant.to_bits(), 0.0f64.to_bits());
    }
}
