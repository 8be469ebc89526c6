//! Grey centroid: the centre of a Gaussian through three samples.
//!
//! With g(u) = B exp(-(u - c)^2 / 2 sigma^2) three samples g1, g2, g3 at u1, u2, u3 give
//!
//! c = 1/2 [(u3^2-u2^2) ln g1 + (u1^2-u3^2) ln g2 + (u2^2-u1^2) ln g3]
//!       / [(u3-u2) ln g1 + (u1-u3) ln g2 + (u2-u1) ln g3].
//!
//! **Which three.** A lamp is a disc with a flat, often saturated top, so three neighbouring
//! pixels at the peak carry no information. Here the formula is applied to the spot's *marginals*:
//! the lengths of its chords by rows for v, the light of all rows summed by columns for u. Chords
//! get shorter to both sides even where every pixel is saturated. The samples are the middle and
//! the points at 0.7 of the half width on both sides, where the flanks are steep, each the mean of a
//! window, so that many edges share in it; and the formula is repeated from its own result. It comes
//! to rest only where both flanks are equal: on the centre of any symmetric marginal, Gaussian or
//! not.
//!
//! **Stripes.** Chords of dark rows are interpolated between their lit neighbours: the marginals
//! are those of the lamp without stripes. Where a dark stripe lies on an end of the lamp, rows are
//! missing there, and the columns' sum of a slanting ellipse would lean to the other end. An
//! ellipse is symmetric about its centre, so rows are summed with weights symmetric about the v
//! centre, which fade to nothing at the nearer end.

use nalgebra::Point2;

/// Centre of the Gaussian through three samples; `None` where they have no maximum.
pub fn log_gaussian_centre(u: [f64; 3], g: [f64; 3]) -> Option<f64> {
    if !g.iter().all(|&g| g > 0.0) {
        return None;
    }
    let [u1, u2, u3] = u;
    let [l1, l2, l3] = g.map(f64::ln);
    let below = (u3 - u2) * l1 + (u1 - u3) * l2 + (u2 - u1) * l3;
    let above = (u3 * u3 - u2 * u2) * l1 + (u1 * u1 - u3 * u3) * l2 + (u2 * u2 - u1 * u1) * l3;
    // For u1 < u2 < u3 the divisor is negative where the logarithms are concave.
    (below < -1e-12).then(|| 0.5 * above / below)
}

/// Share of the half width at which the flanks are sampled.
const FLANK: f64 = 0.7;
/// Half width of the windows that are averaged, as a share of the half width.
const WINDOW: f64 = 0.25;

/// Ends of a row of the spot, sub-pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chord {
    /// Row.
    pub v: usize,
    /// Left edge.
    pub left: f64,
    /// Right edge.
    pub right: f64,
}

/// Centre of a spot from the chords of its lit rows, in order of rows.
pub fn grey_centre(lit: impl Iterator<Item = Chord>) -> Option<Point2<f64>> {
    let chords = filled(lit);
    let first = chords.first()?.v as f64;
    let lengths: Vec<f64> = chords.iter().map(|c| c.right - c.left).collect();
    let v = marginal_centre(&lengths)?;
    let left = chords.iter().map(|c| c.left).fold(f64::INFINITY, f64::min);
    let right = chords.iter().map(|c| c.right).fold(0.0, f64::max);
    let (left, right) = (left.floor() - 1.0, right.ceil() + 1.0);
    let u = marginal_centre(&column_sums(&chords, v, left, right))?;
    Some(Point2::new(left + u, first + v))
}

/// Lit chords, and dark rows interpolated between them.
fn filled(lit: impl Iterator<Item = Chord>) -> Vec<Chord> {
    let mut chords: Vec<Chord> = Vec::new();
    for chord in lit {
        if let Some(last) = chords.last().copied() {
            for v in last.v + 1..chord.v {
                let share = (v - last.v) as f64 / (chord.v - last.v) as f64;
                chords.push(Chord {
                    v,
                    left: last.left + share * (chord.left - last.left),
                    right: last.right + share * (chord.right - last.right),
                });
            }
        }
        chords.push(chord);
    }
    chords
}

/// The chords' cover of every column from `left` to `right`, with weights symmetric about the
/// chord number `v`.
fn column_sums(chords: &[Chord], v: f64, left: f64, right: f64) -> Vec<f64> {
    let mut sums = vec![0.0; (right - left) as usize + 1];
    let reach = (v + 0.5).min(chords.len() as f64 - 0.5 - v).max(1.0);
    for (k, chord) in chords.iter().enumerate() {
        let weight = 1.0 - ((k as f64 - v) / reach).powi(2);
        if weight <= 0.0 {
            continue;
        }
        let (a, b) = (chord.left - left, chord.right - left);
        for u in (a - 0.5).max(0.0) as usize..((b + 1.5) as usize).min(sums.len()) {
            let cover = (u as f64 + 0.5).min(b) - (u as f64 - 0.5).max(a);
            sums[u] += weight * cover.max(0.0);
        }
    }
    sums
}

/// Centre of a marginal given at 0, 1, 2 ...; `None` where it has no clear top.
fn marginal_centre(marginal: &[f64]) -> Option<f64> {
    let (mut sum, mut first) = (0.0, 0.0);
    let mut sums = vec![0.0];
    for (k, &g) in marginal.iter().enumerate() {
        sum += g;
        first += k as f64 * g;
        sums.push(sum);
    }
    let peak = marginal.iter().copied().fold(0.0, f64::max);
    if !(sum > 0.0 && peak > 0.0) {
        return None;
    }
    // Half an ellipse over its diameter: area = pi/4 * peak * width.
    let half_width = 2.0 / std::f64::consts::PI * sum / peak;
    let window = WINDOW * half_width;
    let last = marginal.len() as f64 - 1.0;
    let (mut centre, mut gain, mut before) = (first / sum, 1.0, 0.0);
    for _ in 0..40 {
        // Windows stay inside: beyond a missing end there is nothing to compare.
        let step = (FLANK * half_width)
            .min(centre - window)
            .min(last - centre - window);
        if step < 0.5 * window {
            return None;
        }
        let u = [centre - step, centre, centre + step];
        let means =
            u.map(|u| (integral(&sums, u + window) - integral(&sums, u - window)) / (2.0 * window));
        // About the present centre, so that large coordinates lose no digits.
        let offset = log_gaussian_centre([-step, 0.0, step], means)?;
        // A top flatter than a Gaussian's makes the formula overshoot.
        if offset * before < 0.0 {
            gain *= 0.5;
        }
        before = offset;
        centre += gain * offset.clamp(-step, step);
        if offset.abs() < 1e-5 {
            break;
        }
    }
    Some(centre)
}

/// Integral of the marginal, pixel k reaching from k - 0.5 to k + 0.5.
fn integral(sums: &[f64], u: f64) -> f64 {
    let x = (u + 0.5).clamp(0.0, sums.len() as f64 - 1.0);
    let k = (x as usize).min(sums.len().saturating_sub(2));
    sums[k] + (x - k as f64) * (sums[k + 1] - sums[k])
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::bus::Ellipse;
    use crate::stack::led::ellipse::chord;

    /// The published formula on exact Gaussian samples, equally spaced or not.
    #[test]
    fn gaussian_samples_give_its_centre() {
        let gauss = |u: f64| 180.0 * (-(u - 417.3f64).powi(2) / (2.0 * 6.5f64.powi(2))).exp();
        for u in [
            [410.0, 417.0, 424.0],
            [405.0, 418.0, 421.0],
            [400.0, 402.0, 409.0],
        ] {
            let c = log_gaussian_centre(u, u.map(gauss)).unwrap();
            assert!((c - 417.3).abs() < 1e-6, "{c}");
        }
    }

    #[test]
    fn samples_without_a_top_give_none() {
        assert_eq!(log_gaussian_centre([1.0, 2.0, 3.0], [5.0, 5.0, 5.0]), None);
        assert_eq!(log_gaussian_centre([1.0, 2.0, 3.0], [5.0, 2.0, 5.0]), None);
        assert_eq!(log_gaussian_centre([1.0, 2.0, 3.0], [0.0, 2.0, 5.0]), None);
        assert_eq!(marginal_centre(&[]), None);
        assert_eq!(marginal_centre(&[0.0; 9]), None);
        assert_eq!(grey_centre([].into_iter()), None);
    }

    /// A slanting ellipse at any sub-pixel place, of which stripes hide rows, at an end too.
    #[test]
    fn a_striped_slanting_ellipse_is_found() {
        for k in 0..20 {
            let outline = Ellipse {
                centre: Point2::new(40.0 + 0.05 * f64::from(k), 40.0 + 0.13 * f64::from(k)),
                semi_major_px: 26.0 + 0.3 * f64::from(k),
                semi_minor_px: 16.0,
                angle_rad: 0.7,
            };
            let lit = (0..90usize)
                .filter(|v| (v + 2 * k as usize) % 9 < 4)
                .filter_map(|v| {
                    chord(&outline, v as f64).map(|(left, right)| Chord { v, left, right })
                });
            let centre = grey_centre(lit).unwrap();
            let (u, v) = (centre.x, centre.y);
            assert!(
                (u - outline.centre.x).abs() < 0.3,
                "{u} for {}",
                outline.centre.x
            );
            assert!(
                (v - outline.centre.y).abs() < 0.6,
                "{v} for {}",
                outline.centre.y
            );
        }
    }

    /// Without stripes the centre is within 0.03 pixel.
    #[test]
    fn a_whole_ellipse_is_found_closely() {
        for k in 0..20 {
            let outline = Ellipse {
                centre: Point2::new(40.0 + 0.05 * f64::from(k), 40.0),
                semi_major_px: 15.0 + 0.7 * f64::from(k),
                semi_minor_px: 14.0,
                angle_rad: 0.4,
            };
            let rows = 0..90usize;
            let lit = rows.filter_map(|v| {
                chord(&outline, v as f64).map(|(left, right)| Chord { v, left, right })
            });
            let centre = grey_centre(lit).unwrap();
            let (u, v) = (centre.x, centre.y);
            assert!(
                (u - outline.centre.x).abs() < 0.03,
                "{u} for {}",
                outline.centre.x
            );
            assert!((v - 40.0).abs() < 0.02, "{v}");
        }
    }
}
