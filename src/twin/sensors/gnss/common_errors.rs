//! Errors that all receivers of one world have at a time, whatever their rates.
//!
//! Each is a first-order Gauss-Markov process of variance 1, drawn at times that are a hundredth of its correlation time
//! apart, from time 0 on: x' = a x + sqrt(1 - a^2) n, with a = exp(-1/100) and n standard normal. Between them it is
//! linear, where its variance is 0.5 % less at most.

use crate::twin::random::Stream;

/// Draws in a correlation time.
const DRAWS: f64 = 100.0;

/// Processes of one correlation time.
#[derive(Clone, Debug)]
pub struct CommonErrors {
    stream: Stream,
    step_s: f64,
    /// Steps until `before`.
    steps: u64,
    /// At the times of the draws before and after now.
    before: Vec<f64>,
    after: Vec<f64>,
    /// Where now is between them, 0 to 1.
    share: f64,
}

impl CommonErrors {
    /// So many, at time 0.
    pub fn new(stream: Stream, count: usize, correlation_s: f64) -> Self {
        let mut errors = Self {
            stream,
            step_s: correlation_s / DRAWS,
            steps: 0,
            before: Vec::new(),
            after: (0..count as u64).map(|k| stream.normal(k)).collect(),
            share: 0.0,
        };
        errors.draw();
        errors
    }

    /// Carries them on to a time; not back.
    pub fn advance(&mut self, seconds: f64) {
        let steps = seconds / self.step_s;
        while steps >= (self.steps + 1) as f64 {
            self.steps += 1;
            self.draw();
        }
        self.share = (steps - self.steps as f64).clamp(0.0, 1.0);
    }

    /// One of them now.
    pub fn of(&self, number: usize) -> f64 {
        self.before[number] + self.share * (self.after[number] - self.before[number])
    }

    fn draw(&mut self) {
        self.before.clone_from(&self.after);
        let keep = (-1.0 / DRAWS).exp();
        let more = (1.0 - keep * keep).sqrt();
        let first = (self.steps + 1) * self.after.len() as u64;
        for (error, number) in self.after.iter_mut().zip(first..) {
            *error = keep * *error + more * self.stream.normal(number);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn errors(seed: u64, correlation_s: f64) -> CommonErrors {
        CommonErrors::new(Stream::new(seed, 0, "common"), 2, correlation_s)
    }

    /// Whoever asks at other times before has the same number at one time.
    #[test]
    fn they_do_not_depend_on_when_they_are_asked_for() {
        let (mut often, mut once) = (errors(5, 30.0), errors(5, 30.0));
        for k in 0..=1000 {
            often.advance(0.07 * f64::from(k));
        }
        once.advance(0.07 * 1000.0);
        for number in [0, 1] {
            assert_eq!(often.of(number).to_bits(), once.of(number).to_bits());
        }
        assert!((once.of(0) - once.of(1)).abs() > 1e-6);
    }

    /// Variance 1 and the correlation exp(-lag / time), also where the lag is no whole number of draws.
    #[test]
    fn they_are_gauss_markov() {
        let count = 4000;
        for (lag_s, correlation_s) in [(0.0, 1.0), (0.505, 1.0), (12.0, 20.0), (3600.0, 1800.0)] {
            let (mut product, mut squares) = (0.0, 0.0);
            for seed in 0..count {
                let mut errors = errors(seed, correlation_s);
                errors.advance(0.3 * correlation_s);
                let before = errors.of(0);
                errors.advance(0.3 * correlation_s + lag_s);
                product += before * errors.of(0);
                squares += before.powi(2);
            }
            let [found, variance] = [product, squares].map(|sum| sum / f64::from(count as u32));
            let expected = f64::exp(-lag_s / correlation_s);
            // Deviations of means over `count`: sqrt(2) of a square, at most that of a product.
            let most = 4.0 * (2.0 / f64::from(count as u32)).sqrt();
            assert!((variance - 1.0).abs() < most, "{lag_s}: {variance}");
            assert!(
                (found - expected).abs() < most,
                "{lag_s}: {found} {expected}"
            );
        }
    }
}
