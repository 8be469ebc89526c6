//! Otsu's threshold: the grey level that splits a histogram into two classes with the largest
//! variance between them (N. Otsu, IEEE Trans. Syst. Man Cybern. 9(1), 1979).

/// A split histogram.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Split {
    /// Levels over this one are bright.
    pub threshold: u8,
    /// Mean level of the dark class.
    pub dark_mean: f64,
    /// Mean level of the bright class.
    pub bright_mean: f64,
}

/// Splits a histogram; `None` where all pixels have the same level.
///
/// Levels between the classes that no pixel has give the same variance: the threshold is put in
/// the middle of them, away from both classes.
pub fn otsu(counts: &[u32; 256]) -> Option<Split> {
    let total: f64 = counts.iter().map(|&n| f64::from(n)).sum();
    let sum: f64 = (0u32..)
        .zip(counts)
        .map(|(g, &n)| f64::from(g) * f64::from(n))
        .sum();
    let (mut dark_n, mut dark_sum) = (0.0, 0.0);
    let mut best: Option<(f64, Split, u8)> = None;
    for level in 0..255u8 {
        let n = f64::from(counts[usize::from(level)]);
        dark_n += n;
        dark_sum += f64::from(level) * n;
        let bright_n = total - dark_n;
        if dark_n < 1.0 || bright_n < 1.0 {
            continue;
        }
        let (dark_mean, bright_mean) = (dark_sum / dark_n, (sum - dark_sum) / bright_n);
        let between = dark_n * bright_n * (bright_mean - dark_mean).powi(2);
        match &mut best {
            // An empty level leaves both classes as they are.
            Some((.., last)) if n < 1.0 && *last + 1 == level => *last = level,
            Some((variance, ..)) if between <= *variance => {}
            _ => {
                let split = Split {
                    threshold: level,
                    dark_mean,
                    bright_mean,
                };
                best = Some((between, split, level));
            }
        }
    }
    best.map(|(_, split, last)| Split {
        threshold: split.threshold + (last - split.threshold) / 2,
        ..split
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    /// Fails when the classes' means or the middle of the gap are wrong.
    #[test]
    fn two_levels_split_in_their_middle() {
        let mut counts = [0; 256];
        counts[10] = 900;
        counts[210] = 100;
        let split = otsu(&counts).unwrap();
        assert_eq!(split.threshold, 109);
        assert!((split.dark_mean - 10.0).abs() < 1e-12);
        assert!((split.bright_mean - 210.0).abs() < 1e-12);
    }

    /// Against the definition: within-class variance least, over every threshold.
    #[test]
    fn has_the_least_variance_within_its_classes() {
        let counts: [u32; 256] = std::array::from_fn(|g| {
            let bump = |m: f64, s: f64| (-((g as f64 - m) / s).powi(2)).exp();
            (1000.0 * bump(40.0, 12.0) + 300.0 * bump(150.0, 25.0)) as u32 + 1
        });
        let within = |t: usize| {
            let class = |levels: std::ops::Range<usize>| {
                let n: f64 = levels.clone().map(|g| f64::from(counts[g])).sum();
                let mean = levels
                    .clone()
                    .map(|g| g as f64 * f64::from(counts[g]))
                    .sum::<f64>()
                    / n;
                levels
                    .map(|g| f64::from(counts[g]) * (g as f64 - mean).powi(2))
                    .sum::<f64>()
            };
            class(0..t + 1) + class(t + 1..256)
        };
        let best = (0..255)
            .min_by(|&a, &b| within(a).total_cmp(&within(b)))
            .unwrap();
        assert_eq!(usize::from(otsu(&counts).unwrap().threshold), best);
    }

    #[test]
    fn one_level_cannot_be_split() {
        let mut counts = [0; 256];
        counts[77] = 5;
        assert_eq!(otsu(&counts), None);
    }
}
