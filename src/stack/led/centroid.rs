//! Grey centroid: the centre of a Gaussian through three samples.
//!
//! With g(u) = B exp(-(u - c)^2 / 2 sigma^2) three samples g1, g2, g3 at u1, u2, u3 give
//!
//! c = 1/2 [(u3^2-u2^2) ln g1 + (u1^2-u3^2) ln g2 + (u2^2-u1^2) ln g3]
//!       / [(u3-u2) ln g1 + (u1-u3) ln g2 + (u2-u1) ln g3].
//!
//! **Which three.** A lamp is a disc with a flat, often saturated top, so three neighbouring
//! pixels at the peak carry no information. Here the formula is applied to the spot's *marginal*
//! (grey summed over the lit rows; for v the chord lengths): chords get shorter to both sides
//! even where every pixel is saturated. The samples are the centre and the points at 0.6 of the
//! half width on both sides, where the flanks are steep, and the formula is repeated from its own
//! result. It comes to rest only where both flanks are equal: on the centre of any symmetric
//! marginal, Gaussian or not.

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
const FLANK: f64 = 0.6;

/// Centre of a marginal given at 0, 1, 2 ...; `None` where it has no clear top.
pub fn marginal_centre(marginal: &[f64]) -> Option<f64> {
    let (mut sum, mut first) = (0.0, 0.0);
    for (k, &g) in marginal.iter().enumerate() {
        sum += g;
        first += k as f64 * g;
    }
    let peak = marginal.iter().copied().fold(0.0, f64::max);
    if !(sum > 0.0 && peak > 0.0) {
        return None;
    }
    // For half an ellipse over its diameter: area = pi/4 * peak * width.
    let half_width = 2.0 / std::f64::consts::PI * sum / peak;
    let step = FLANK * half_width;
    let mut centre = first / sum;
    for _ in 0..20 {
        let u = [centre - step, centre, centre + step];
        // Sampled about the present centre, so that large coordinates lose no digits.
        let offset = log_gaussian_centre([-step, 0.0, step], u.map(|u| at(marginal, u)))?;
        centre += offset.clamp(-step, step);
        if offset.abs() < 1e-6 {
            break;
        }
    }
    Some(centre)
}

/// Linear interpolation, 0 outside.
fn at(samples: &[f64], u: f64) -> f64 {
    let k = u.floor();
    let value = |k: f64| {
        if k < 0.0 {
            0.0
        } else {
            samples.get(k as usize).copied().unwrap_or(0.0)
        }
    };
    let share = u - k;
    value(k) * (1.0 - share) + value(k + 1.0) * share
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

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
    }

    /// The chords of a saturated disc, sampled by pixels at any sub-pixel place.
    #[test]
    fn a_flat_disc_is_found_to_a_fiftieth_of_a_pixel() {
        for k in 0..20 {
            let (centre, a) = (30.0 + 0.05 * f64::from(k), 12.0 + 0.37 * f64::from(k));
            let half_chord = |u: f64| (a * a - (u - centre).powi(2)).max(0.0).sqrt();
            let marginal: Vec<f64> = (0..64).map(|u| 2.0 * half_chord(f64::from(u))).collect();
            let found = marginal_centre(&marginal).unwrap();
            assert!((found - centre).abs() < 0.02, "{found} for {centre}");
        }
    }
}
