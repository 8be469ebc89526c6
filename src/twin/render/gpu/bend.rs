//! How finely straight things are cut before a lens that bends them: the rasteriser moves corners
//! only and draws straight between them.
//!
//! A lens that sees radius r at d(r), in focal lengths, bends a straight of length l by up to
//! f l^2 |d''| / 8 pixels. Of a surface parallel to the picture, a cell that is a share q of its distance
//! from the camera is q (1 + r^2)^(1/2) long at radius r; those along a tunnel are shorter. [`Bend::of`]
//! takes the greatest q for which no cell is bent by more than [`BENT_PX`] in the picture.

use crate::bus::Intrinsics;
use crate::track::TrackPoint;

/// What a straight may be off in its middle.
const BENT_PX: f64 = 0.25;
/// Radii at which a lens is probed.
const PROBES: u32 = 32;
/// Places of a camera in the cross-section that are nearer to each other than this count as one.
const PLACE_M: f64 = 0.25;
/// No surface is taken to be nearer to a camera than this.
const NEAREST_M: f64 = 0.5;

/// The cells that a camera needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Bend {
    /// A cell is at most the root of 2 to the power of minus this many times its distance.
    halvings: i16,
    /// Of the camera in the cross-section, in [`PLACE_M`].
    place: [i16; 2],
}

impl Bend {
    /// Of a lens that bends lines, at a place in the tunnel.
    pub fn of(lens: &Intrinsics, eye: &TrackPoint) -> Option<Self> {
        let share = cell_share(lens)?;
        Some(Self {
            halvings: (-2.0 * share.log2()).ceil() as i16,
            place: [eye.l_m, eye.h_m].map(|x| (x / PLACE_M).round() as i16),
        })
    }

    /// The largest cell at a distance from the camera.
    pub fn cell_m(self, away_m: f64) -> f64 {
        0.5f64.powf(0.5 * f64::from(self.halvings)) * away_m.max(NEAREST_M)
    }

    /// Where the camera is; its chainage is 0.
    pub fn eye(self) -> TrackPoint {
        let [l_m, h_m] = self.place.map(|k| f64::from(k) * PLACE_M);
        TrackPoint { s_m: 0.0, l_m, h_m }
    }
}

/// The greatest size of a cell as a share of its distance; none where the lens bends nothing.
pub fn cell_share(lens: &Intrinsics) -> Option<f64> {
    if lens.distortion.is_none() {
        return None;
    }
    let (width, height) = (f64::from(lens.width_px), f64::from(lens.height_px));
    let corners = [(0.0, 0.0), (width, 0.0), (0.0, height), (width, height)];
    let radii = corners.map(|(u, v)| lens.ray(u, v).xy().norm());
    let reach = radii
        .into_iter()
        .fold(0.0, f64::max)
        .min(lens.distortion.reach());
    let worst = (1..=PROBES)
        .map(|k| {
            let r = reach * f64::from(k) / f64::from(PROBES);
            bending(lens, r) * (1.0 + r * r)
        })
        .fold(0.0, f64::max);
    (worst > 0.0).then(|| (8.0 * BENT_PX / (lens.fx_px.max(lens.fy_px) * worst)).sqrt())
}

/// The most by which the derivative of where a lens sees a point changes with its radius.
fn bending(lens: &Intrinsics, r: f64) -> f64 {
    let c = lens.distortion.coefficients();
    let r2 = r * r;
    let radial = r * (6.0 * c.k1 + r2 * (20.0 * c.k2 + r2 * 42.0 * c.k3));
    radial.abs() + 6.0 * c.p1.hypot(c.p2)
}

#[cfg(test)]
mod tests {
    #![allow(
        clippy::print_stdout,
        clippy::unwrap_used,
        reason = "a test may fail by panicking, and prints its figures"
    )]
    use super::*;
    use crate::bus::{Distortion, lenses};
    use nalgebra::{Point3, Vector3};

    /// Provokes cells that a lens bends by more than they may be: straights of the size given, all
    /// over the picture and in all directions, against where their middles are seen.
    #[test]
    fn no_cell_is_bent_by_more_than_it_may() {
        let mut worst: f64 = 0.0;
        for (coefficients, f_px) in [(lenses::EUROC[0], 781.0), (lenses::EUROC[1], 781.0)] {
            let lens = Intrinsics {
                distortion: Distortion::new(coefficients),
                ..Intrinsics::centred(1280, 720, f_px)
            };
            let share = cell_share(&lens).unwrap();
            for (u, v) in (0..20).flat_map(|i| (0..12).map(move |j| (i, j))) {
                let ray = lens.ray(64.0 * f64::from(u) + 32.0, 60.0 * f64::from(v) + 30.0);
                let away_m = 5.0;
                let at = Point3::from(ray.normalize() * away_m);
                for k in 0..12 {
                    let (sin, cos) = (0.5 * f64::from(k)).sin_cos();
                    let step = Vector3::new(cos, sin, 0.0) * (0.5 * share * away_m);
                    let seen = [at - step, at, at + step].map(|p| lens.project(&p));
                    if let [Some(a), Some(middle), Some(b)] = seen {
                        worst = worst.max((nalgebra::center(&a, &b) - middle).norm());
                    }
                }
            }
        }
        println!("a straight is bent by up to {worst:.3} px");
        assert!(worst > 0.3 * BENT_PX && worst < 1.05 * BENT_PX, "{worst}");
    }
}
