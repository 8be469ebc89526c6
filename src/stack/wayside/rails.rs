//! Rail heads in the image. Wheels polish them: they mirror any light, first of all that of a train
//! still far away, and get brighter with nothing on them. So there, only what is darker than the
//! reference counts. An obstacle on a rail hides its shine, and is wider than the head.

use super::sight::Sight;
use crate::track::{RAIL_OFFSET_M, RAIL_WIDTH_M, TrackPoint};
use nalgebra::{Point2, Vector2};

/// Heads are taken to be straight over this length.
const STEP_M: f64 = 0.25;
/// Calibration and blur.
const MARGIN_PX: f64 = 1.5;

/// Pixels that see the head of a rail.
#[derive(Clone, Debug, Default)]
pub(super) struct RailHeads {
    pixels: Vec<usize>,
}

impl RailHeads {
    /// Before a device, in images of a size.
    pub fn new(sight: &Sight, width: usize, height: usize) -> Self {
        let (from_m, to_m) = sight.watched_m();
        let steps = ((to_m - from_m) / STEP_M).ceil().clamp(0.0, 1e5) as usize;
        let mut pixels = Vec::new();
        for centre_m in [RAIL_OFFSET_M, -RAIL_OFFSET_M] {
            let sides = [-0.5, 0.5].map(|side| centre_m + side * RAIL_WIDTH_M);
            let across = |k: usize| {
                let s_m = (from_m + STEP_M * k as f64).min(to_m);
                sides.map(|l_m| sight.pixel_of(TrackPoint { s_m, l_m, h_m: 0.0 }))
            };
            for k in 0..steps {
                let ([a, b], [d, c]) = (across(k), across(k + 1));
                if let (Some(a), Some(b), Some(c), Some(d)) = (a, b, c, d) {
                    fill([a, b, c, d], (width, height), &mut pixels);
                }
            }
        }
        pixels.sort_unstable();
        pixels.dedup();
        Self { pixels }
    }

    /// Sets to 0 what has changed by getting brighter.
    pub fn forgive(&self, frame: &[u8], reference: &[u8], changed: &mut [u8]) {
        for &k in &self.pixels {
            if frame[k] > reference[k] {
                changed[k] = 0;
            }
        }
    }
}

/// Appends the pixels inside a convex quadrangle or within the margin of it.
fn fill(corners: [Point2<f64>; 4], (width, height): (usize, usize), pixels: &mut Vec<usize>) {
    let low = corners[1..].iter().fold(corners[0], |a, p| a.inf(p));
    let high = corners[1..].iter().fold(corners[0], |a, p| a.sup(p));
    let range = |low: f64, high: f64, size: usize| {
        let from = (low - MARGIN_PX).ceil().clamp(0.0, size as f64) as usize;
        from..((high + MARGIN_PX).floor() + 1.0).clamp(from as f64, size as f64) as usize
    };
    for v in range(low.y, high.y, height) {
        for u in range(low.x, high.x, width) {
            if outside_px(&corners, &Point2::new(u as f64, v as f64)) <= MARGIN_PX {
                pixels.push(v * width + u);
            }
        }
    }
}

/// How far beyond the farthest of its sides a point lies; negative inside.
fn outside_px(corners: &[Point2<f64>; 4], p: &Point2<f64>) -> f64 {
    let side = |k: usize| (corners[k], corners[(k + 1) % 4]);
    let area = (0..4)
        .map(|k| side(k).0.coords.perp(&side(k).1.coords))
        .sum::<f64>();
    (0..4)
        .filter_map(|k| {
            let (a, b) = side(k);
            let along: Vector2<f64> = (b - a).try_normalize(1e-9)?;
            Some(-area.signum() * along.perp(&(p - a)))
        })
        .fold(f64::NEG_INFINITY, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Provokes quadrangles filled outside, or not at all when they run the other way round.
    #[test]
    fn quadrangles_are_filled_either_way_round() {
        let ring = [[10.0, 10.0], [20.0, 12.0], [22.0, 30.0], [8.0, 28.0]].map(Point2::from);
        let mut back = ring;
        back.reverse();
        for corners in [ring, back] {
            let mut pixels = Vec::new();
            fill(corners, (40, 40), &mut pixels);
            assert!(pixels.contains(&(20 * 40 + 15)) && pixels.contains(&(9 * 40 + 12)));
            assert!(!pixels.contains(&(6 * 40 + 12)) && !pixels.contains(&(20 * 40 + 30)));
            assert!((200..400).contains(&pixels.len()), "{}", pixels.len());
        }
    }

    /// Provokes darker pixels forgiven, or others than those of rails.
    #[test]
    fn only_brighter_pixels_of_rails_are_forgiven() {
        let rails = RailHeads { pixels: vec![1, 2] };
        let mut changed = [1u8; 4];
        rails.forgive(&[90, 90, 20, 90], &[50; 4], &mut changed);
        assert_eq!(changed, [1, 0, 1, 1]);
    }
}
