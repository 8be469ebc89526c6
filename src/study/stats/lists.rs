//! Figures of which each run has a list of numbers. The numbers of a run are alike, having met the same chances: runs are
//! independent, they are not, and so intervals are by runs.

use super::sample::{order_statistics, student_t};
use super::{Bounds, IntervalEstimate, z};
use crate::session::quantile as interpolated;

/// The mean of all numbers of all runs, each of which counts for one. It is a ratio of two sums over runs, that of the
/// numbers and how many they are: the interval is that of a ratio (Cochran, Sampling Techniques, 3rd ed., 9.A, equal
/// to the delta method), with Student's t of as many runs, within the bounds. Runs without numbers count for nothing here
/// and in quantiles; `None` of fewer than two others.
pub fn mean_of_lists(lists: &[Vec<f64>], bounds: Bounds) -> Option<IntervalEstimate> {
    let n = runs_with_numbers(lists);
    let value = mean(lists, |x| x)?;
    let half = student_t(n)? * sigma(lists, |x| x - value)?;
    let bounds = bounds.kept_by(lists.iter().flatten().copied());
    let (low, high) = bounds.interval(value, half);
    Some(IntervalEstimate {
        value,
        low,
        high,
        n,
    })
}

/// The quantile p of all numbers of all runs, each of which counts for one, and may be infinite. The interval is between
/// order statistics of an effective number of independent numbers: so many as would estimate the share below the quantile
/// with the same variance (Woodruff, J. Am. Stat. Assoc. 47 (1952); Korn and Graubard, Survey Methodology
/// 24 (1998)). An end that there are too few for is infinite, and so are both of one run. `None` without numbers.
pub fn quantile_of_lists(lists: &[Vec<f64>], p: f64) -> Option<IntervalEstimate> {
    let mut sorted: Vec<f64> = lists.iter().flatten().copied().collect();
    if sorted.is_empty() {
        return None;
    }
    sorted.sort_by(f64::total_cmp);
    let value = interpolated(&sorted, p);
    // Where many numbers are equal, the shares below and not above differ.
    let [below, not_above] = [
        effective_count(lists, |x| x < value),
        effective_count(lists, |x| x <= value),
    ];
    let count = below.min(not_above) as usize;
    let (i, j) = order_statistics(count, p);
    let each = (sorted.len() + 1) as f64 / (count + 1) as f64;
    let low = i.map(|i| (i as f64 * each).floor() as usize);
    let high = j.map(|j| (j as f64 * each).ceil() as usize);
    let at = |k: usize| sorted[k.clamp(1, sorted.len()) - 1];
    Some(IntervalEstimate {
        value,
        low: low.map_or(f64::NEG_INFINITY, at),
        high: high.map_or(f64::INFINITY, at),
        n: runs_with_numbers(lists),
    })
}

fn runs_with_numbers(lists: &[Vec<f64>]) -> usize {
    lists.iter().filter(|list| !list.is_empty()).count()
}

/// The mean over all numbers of what `of` makes of each.
fn mean(lists: &[Vec<f64>], of: impl Fn(f64) -> f64) -> Option<f64> {
    let numbers = lists.iter().flatten();
    let count = numbers.clone().count();
    (count > 0).then(|| numbers.map(|x| of(*x)).sum::<f64>() / count as f64)
}

/// Standard deviation of a mean over all numbers, where `off` is how far a number is from it; `None` of fewer than two
/// runs that have numbers.
fn sigma(lists: &[Vec<f64>], off: impl Fn(f64) -> f64) -> Option<f64> {
    let runs = runs_with_numbers(lists);
    let numbers = lists.iter().map(Vec::len).sum::<usize>() as f64;
    let of_run = |list: &Vec<f64>| list.iter().map(|x| off(*x)).sum::<f64>();
    let squares: f64 = lists.iter().map(|list| of_run(list).powi(2)).sum();
    let of_few = runs as f64 / (runs as f64 - 1.0);
    (runs > 1).then(|| (squares * of_few).sqrt() / numbers)
}

/// How many independent numbers would estimate the share of numbers with a property with the same variance; not more than
/// there are, and 0 of fewer than two runs.
fn effective_count(lists: &[Vec<f64>], has: impl Fn(f64) -> bool) -> f64 {
    let all = lists.iter().map(Vec::len).sum::<usize>() as f64;
    let is = |x: f64| f64::from(has(x));
    let share = mean(lists, is).unwrap_or_default();
    let (Some(sigma), Some(t)) = (
        sigma(lists, |x| is(x) - share),
        student_t(runs_with_numbers(lists)),
    ) else {
        return 0.0;
    };
    let variance = share * (1.0 - share);
    if sigma <= 0.0 || variance <= 0.0 {
        return all;
    }
    (variance / (sigma * t / z()).powi(2)).min(all)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::study::stats::{bounded_mean, mean as mean_of, quantile};
    use crate::twin::random::Stream;

    fn is_close(a: f64, b: f64) -> bool {
        (a - b).abs() < 1e-12 * b.abs().max(1.0)
    }

    /// Of lists of one number each it is the mean of numbers; three numbers of one run that are equal know no more than
    /// one does.
    #[test]
    fn a_run_knows_as_much_as_one_number_where_its_numbers_are_equal() {
        let numbers: Vec<f64> = (0..30).map(|k| f64::from(k * k % 17)).collect();
        let alone = bounded_mean(&numbers, Bounds::NOT_NEGATIVE).unwrap();
        for copies in [1, 3] {
            let lists: Vec<_> = numbers.iter().map(|x| vec![*x; copies]).collect();
            let e = mean_of_lists(&lists, Bounds::NOT_NEGATIVE).unwrap();
            assert_eq!(e.n, 30);
            for (a, b) in [
                (e.value, alone.value),
                (e.low, alone.low),
                (e.high, alone.high),
            ] {
                assert!(is_close(a, b), "{copies}: {e:?} {alone:?}");
            }
        }
        let one = [vec![1.0, 2.0, 3.0], Vec::new()];
        assert!(mean_of_lists(&one, Bounds::NONE).is_none());
        let half = quantile_of_lists(&one, 0.5).unwrap();
        assert!(is_close(half.value, 2.0) && half.low.is_infinite() && half.high.is_infinite());
        assert!(quantile_of_lists(&[], 0.5).is_none());
    }

    /// Infinite numbers are quantiles, and ends of their intervals, and none is made of them that is no number.
    #[test]
    fn infinite_numbers_have_their_place() {
        let run = |k: u32| match k % 8 {
            0 => vec![f64::from(k), f64::INFINITY],
            _ => vec![f64::from(k), f64::from(k) + 0.5],
        };
        let lists: Vec<_> = (0..60).map(run).collect();
        let [half, most] = [0.5, 0.95].map(|p| quantile_of_lists(&lists, p).unwrap());
        assert!(half.low < half.value && half.value < half.high && half.high < 60.0);
        assert!(
            most.value.is_infinite() && most.high.is_infinite(),
            "{most:?}"
        );
        assert!(most.low < 60.0, "{most:?}");
    }

    /// Runs of 3 to 11 numbers that share a part of their error: intervals hold the truth as often as they say, and those
    /// that take the numbers for independent do not.
    #[test]
    fn intervals_by_runs_cover_the_truth() {
        const TRIALS: u64 = 1000;
        let truths = [0.25f64.exp(), 1.0, (1.281_551_565_5 * 0.5f64.sqrt()).exp()];
        let mut held = [[0u32; 3]; 2];
        for trial in 0..TRIALS {
            let stream = Stream::new(12, trial, "lists");
            let run = |k: u64| {
                let shared = stream.normal(100 * k);
                let count = 3 + (9.0 * stream.uniform(100 * k + 99)) as u64;
                let own = |n: u64| stream.normal(100 * k + n);
                let numbers = (1..=count).map(|n| (0.5 * (shared + own(n))).exp());
                numbers.collect::<Vec<f64>>()
            };
            let lists: Vec<_> = (0..40).map(run).collect();
            let mut all = lists.concat();
            all.sort_by(f64::total_cmp);
            let by_runs = [
                mean_of_lists(&lists, Bounds::NOT_NEGATIVE),
                quantile_of_lists(&lists, 0.5),
                quantile_of_lists(&lists, 0.9),
            ];
            let by_numbers = [mean_of(&all), quantile(&all, 0.5), quantile(&all, 0.9)];
            for (held, estimates) in held.iter_mut().zip([by_runs, by_numbers]) {
                for ((held, e), truth) in held.iter_mut().zip(estimates).zip(truths) {
                    let e = e.unwrap();
                    *held += u32::from((e.low..=e.high).contains(&truth));
                }
            }
        }
        let share = held.map(|of| of.map(|held| f64::from(held) / TRIALS as f64));
        eprintln!("by runs {:?}, by numbers {:?}", share[0], share[1]);
        assert!(
            share[0].iter().all(|s| (0.925..0.985).contains(s)),
            "{share:?}"
        );
        assert!(share[1].iter().all(|s| *s < 0.85), "{share:?}");
    }
}
