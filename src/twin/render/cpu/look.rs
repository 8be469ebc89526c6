//! Reflectance of the tunnel's surface as a pixel sees it.

use super::tunnel::SurfacePoint;
use crate::twin::random::pcg4d;
use crate::twin::render::surface::{self, Pulse};

impl SurfacePoint {
    /// Share of light reflected, for a pixel that spans `width_m` of chainage.
    pub fn albedo(&self, width_m: f64) -> f64 {
        albedo(self, width_m)
    }
}

fn albedo(at: &SurfacePoint, width_m: f64) -> f64 {
    let look = surface::look(at.material);
    let mark = match look.pulse {
        Some(pulse) if at.l_m.abs() < pulse.half_width_m => {
            1.0 + (pulse.factor - 1.0) * share_of_marks(&pulse, at.s_m, width_m)
        }
        _ => 1.0,
    };
    let fade = (2.0 - width_m / surface::STAIN_FADE_M).clamp(0.0, 1.0);
    let stain = if fade > 0.0 {
        1.0 + surface::STAIN_CONTRAST * fade * (stains(at.s_m, at.q_m, look.id) - 0.5)
    } else {
        1.0
    };
    look.albedo * mark * stain
}

/// Share of the window of `width_m` around `s_m` that marks cover.
fn share_of_marks(pulse: &Pulse, s_m: f64, width_m: f64) -> f64 {
    let width_m = width_m.max(1e-6);
    (marked_until(pulse, s_m + 0.5 * width_m) - marked_until(pulse, s_m - 0.5 * width_m)) / width_m
}

/// Metres of mark between the begin of the mark at 0 and `s_m`.
fn marked_until(pulse: &Pulse, s_m: f64) -> f64 {
    let from_begin = s_m + 0.5 * pulse.width_m;
    let periods = (from_begin / pulse.period_m).floor();
    let inside = from_begin - periods * pulse.period_m;
    periods * pulse.width_m + inside.min(pulse.width_m)
}

/// Value noise, 0 to 1.
fn stains(s_m: f64, q_m: f64, material: u32) -> f64 {
    let (x, y) = (s_m / surface::STAIN_CELL_M, q_m / surface::STAIN_CELL_M);
    let (i, j) = (x.floor(), y.floor());
    let corner = |di: u32, dj: u32| {
        let (i, j) = (i as i32 as u32, j as i32 as u32);
        let hash = pcg4d([i.wrapping_add(di), j.wrapping_add(dj), material, 0])[0];
        f64::from(hash) / 4_294_967_296.0
    };
    let smooth = |f: f64| f * f * (3.0 - 2.0 * f);
    let (a, b) = (smooth(x - i), smooth(y - j));
    let near = corner(0, 0) * (1.0 - b) + corner(0, 1) * b;
    let far = corner(1, 0) * (1.0 - b) + corner(1, 1) * b;
    near * (1.0 - a) + far * a
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::Material;
    use nalgebra::{Point3, Vector3};

    fn at(s_m: f64, l_m: f64, material: Material) -> SurfacePoint {
        SurfacePoint {
            position: Point3::origin(),
            normal: Vector3::z(),
            s_m,
            l_m,
            q_m: 3.3,
            material,
        }
    }

    /// Fails where the closed form of the marks is not the mean of what a sharp eye sees.
    #[test]
    fn wide_pixels_see_the_mean_of_narrow_ones() {
        for pulse in [surface::RING_JOINT, surface::SLEEPER] {
            for (s, w) in [
                (-3.1, 0.2),
                (0.0, 0.01),
                (7.45, 1.5),
                (0.29, 0.4),
                (12.0, 31.0),
            ] {
                let n = 20_000;
                let seen = (0..n)
                    .filter(|k| {
                        let x = s + w * ((f64::from(*k) + 0.5) / f64::from(n) - 0.5);
                        (x - pulse.period_m * (x / pulse.period_m).round()).abs()
                            < 0.5 * pulse.width_m
                    })
                    .count();
                let mean = seen as f64 / f64::from(n);
                assert!(
                    (share_of_marks(&pulse, s, w) - mean).abs() < 1e-3,
                    "{s} {w}"
                );
            }
        }
    }

    /// Fails where a sleeper is out of place or too long.
    #[test]
    fn sleepers_lie_at_multiples_of_their_spacing() {
        let bare = |s: f64, l: f64| {
            let stain = 1.0 + 0.3 * (stains(s, 3.3, 1) - 0.5);
            albedo(&at(s, l, Material::Bed), 1e-3) / stain
        };
        assert!((bare(60.0, 1.2) - 0.22 * 1.6).abs() < 1e-9);
        assert!((bare(60.3, 1.2) - 0.22).abs() < 1e-9);
        assert!((bare(60.0, 1.3) - 0.22).abs() < 1e-9);
    }

    /// Fails where stains jump between lattice cells or have the wrong contrast.
    #[test]
    fn stains_are_continuous_and_bounded() {
        let mut last = stains(-5.0, 2.0, 0);
        let (mut low, mut high) = (1.0f64, 0.0f64);
        for k in 0..100_000 {
            let n = stains(-5.0 + 1e-3 * f64::from(k), 2.0 + 3e-4 * f64::from(k), 0);
            assert!((n - last).abs() < 0.01);
            (low, high, last) = (low.min(n), high.max(n), n);
        }
        assert!(low > 0.0 && low < 0.15 && high < 1.0 && high > 0.85);
    }
}
