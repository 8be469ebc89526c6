//! Detection with a constant false-alarm rate (CFAR): a cell is held against cells nearer and farther.
//!
//! The power of a cell of noise is exponentially distributed, with a mean that nobody knows. A cell is a detection when
//! it has more than a factor times what its N reference cells say of that mean:
//!
//! - cell averaging: factor / N times their sum, with factor = N (Pfa^(-1/N) - 1);
//! - ordered statistic: factor times the k-th smallest, with Pfa = prod_{i < k} (N - i) / (N - i + factor).
//!
//! Pfa does not depend on the mean. Where one side has too few cells, at the begin and the end of range, the other
//! side's are taken alone, with the factor of their number.
//!
//! Source: H. M. Finn and R. S. Johnson, RCA Review 29 (1968); H. Rohling, Radar CFAR Thresholding in Clutter and
//! Multiple Target Situations, IEEE Trans. AES 19 (1983).

use super::settings::{CfarKind, RadarTrackingSettings};
use crate::numerics::bisected;

/// Factor on the mean of so many reference cells, for a probability of a false alarm.
pub fn cell_averaging_factor(cells: u32, false_alarm_probability: f64) -> f64 {
    let cells = f64::from(cells);
    // As exp(x) - 1, which does not cancel for many cells.
    cells * (-false_alarm_probability.ln() / cells).exp_m1()
}

/// Factor on the `order`-th smallest of so many reference cells, counted from 1.
pub fn ordered_statistic_factor(cells: u32, order: u32, false_alarm_probability: f64) -> f64 {
    let wanted = false_alarm_probability.ln();
    let log = |factor: f64| -> f64 {
        let left = (0..order.min(cells)).map(|i| f64::from(cells - i));
        left.map(|left| -(factor / left).ln_1p()).sum()
    };
    let (least, most) = bisected((-50.0, 50.0), 100, |exponent: f64| {
        log(exponent.exp()) > wanted
    });
    (0.5 * (least + most)).exp()
}

/// A factor on the `order`-th smallest of the reference cells, or on their mean.
#[derive(Clone, Copy, Debug)]
struct Test {
    factor: f32,
    order: f32,
}

impl Test {
    fn new(settings: &RadarTrackingSettings, cells: u32) -> Self {
        let probability = settings.false_alarm_probability;
        let order = (settings.ordered_share * f64::from(cells)).round() as u32;
        let order = order.clamp(1, cells.max(1));
        let factor = match settings.cfar {
            CfarKind::Ca => cell_averaging_factor(cells, probability) / f64::from(cells),
            CfarKind::Os => ordered_statistic_factor(cells, order, probability),
        };
        Self {
            factor: factor as f32,
            order: order as f32,
        }
    }
}

/// The test along range, for many columns of cells at once.
#[derive(Clone, Debug)]
pub struct Cfar {
    kind: CfarKind,
    /// Reference cells of one side.
    side: usize,
    guard: usize,
    with_both: Test,
    with_one: Test,
    /// By column: what a reference cell has to stay below, and how many do; or their sum.
    limits: Vec<f32>,
    sums: Vec<f32>,
}

impl Cfar {
    /// For so many columns.
    pub fn new(settings: &RadarTrackingSettings, columns: usize) -> Self {
        let side = (settings.reference_cells / 2).max(1);
        Self {
            kind: settings.cfar,
            side: side as usize,
            guard: settings.guard_cells as usize,
            with_both: Test::new(settings, 2 * side),
            with_one: Test::new(settings, side),
            limits: vec![0.0; columns],
            sums: vec![0.0; columns],
        }
    }

    /// Calls `found` with the row and column of each detection. Powers are by range, then column.
    pub fn detect(&mut self, powers: &[f32], mut found: impl FnMut(usize, usize)) {
        let columns = self.sums.len();
        if columns == 0 {
            return;
        }
        let rows = powers.len() / columns;
        let reach = self.guard + self.side;
        for row in 0..rows {
            let nearer = row >= reach;
            let farther = row + reach < rows;
            if !nearer && !farther {
                continue;
            }
            let test = if nearer && farther {
                self.with_both
            } else {
                self.with_one
            };
            let cells = &powers[row * columns..(row + 1) * columns];
            self.begin(cells, test);
            if nearer {
                self.add(&powers[(row - reach) * columns..(row - self.guard) * columns]);
            }
            if farther {
                let from = row + self.guard + 1;
                self.add(&powers[from * columns..(from + self.side) * columns]);
            }
            self.decide(cells, test, |column| found(row, column));
        }
    }

    fn begin(&mut self, cells: &[f32], test: Test) {
        self.sums.fill(0.0);
        for (limit, cell) in self.limits.iter_mut().zip(cells) {
            *limit = cell / test.factor;
        }
    }

    /// Takes rows of reference cells in. A cell exceeds the k-th smallest times a factor where at least k of them are
    /// smaller than the cell over the factor: counting them is cheaper than to sort.
    fn add(&mut self, references: &[f32]) {
        for row in references.chunks_exact(self.sums.len()) {
            let columns = self.sums.iter_mut().zip(row).zip(&self.limits);
            match self.kind {
                CfarKind::Ca => columns.for_each(|((sum, cell), _)| *sum += cell),
                CfarKind::Os => columns.for_each(|((sum, cell), limit)| {
                    *sum += if cell < limit { 1.0 } else { 0.0 };
                }),
            }
        }
    }

    fn decide(&self, cells: &[f32], test: Test, mut found: impl FnMut(usize)) {
        for (column, (sum, cell)) in self.sums.iter().zip(cells).enumerate() {
            let is_detected = match self.kind {
                CfarKind::Ca => *cell > test.factor * sum,
                CfarKind::Os => *sum >= test.order,
            };
            if is_detected {
                found(column);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stack::radar::testing::Draw;

    const COLUMNS: usize = 1000;

    fn cfar(kind: CfarKind, false_alarm_probability: f64) -> Cfar {
        let settings = RadarTrackingSettings {
            cfar: kind,
            false_alarm_probability,
            ..RadarTrackingSettings::default()
        };
        Cfar::new(&settings, COLUMNS)
    }

    /// Against the closed forms, worked out with 50 digits.
    #[test]
    fn val_factors_are_those_of_the_closed_forms() {
        let expected = [
            (1e-3, 8.6388, 7.4214),
            (1e-4, 12.4525, 11.0802),
            (1e-6, 21.9420, 20.9542),
        ];
        for (probability, averaging, ordered) in expected {
            let ca = cell_averaging_factor(16, probability);
            let os = ordered_statistic_factor(16, 12, probability);
            assert!((ca - averaging).abs() < 5.1e-5, "{ca}");
            assert!((os - ordered).abs() < 5.1e-5, "{os}");
        }
    }

    /// Ten million independent cells of noise: the 99.9 % binomial interval about the probability, for cells in the
    /// middle and, with reference cells of one side only, at the ends.
    #[test]
    fn val_noise_is_detected_as_often_as_asked() {
        let mut draw = Draw::new(1);
        let rows = 10_000;
        let powers: Vec<f32> = (0..rows * COLUMNS)
            .map(|_| draw.exponential() as f32)
            .collect();
        for kind in [CfarKind::Ca, CfarKind::Os] {
            for probability in [1e-3, 1e-4] {
                let (mut middle, mut ends) = (0.0, 0.0);
                let mut test = cfar(kind, probability);
                for part in powers.chunks(100 * COLUMNS) {
                    test.detect(part, |row, _| match row {
                        10..90 => middle += 1.0,
                        _ => ends += 1.0,
                    });
                }
                for (found, share) in [(middle, 0.8), (ends, 0.2)] {
                    let mean = share * powers.len() as f64 * probability;
                    let sigma = (mean * (1.0 - probability)).sqrt();
                    let off: f64 = (found - mean) / sigma;
                    assert!(
                        off.abs() < 3.29,
                        "{kind:?} {probability} {share}: {off} sigma"
                    );
                }
            }
        }
    }

    /// Share of cells detected whose targets are drawn by `target`, amid noise of power one.
    fn detected(kind: CfarKind, probability: f64, mut target: impl FnMut(&mut Draw) -> f64) -> f64 {
        let mut draw = Draw::new(2);
        let mut test = cfar(kind, probability);
        let (mut found, repeats) = (0, 100);
        for _ in 0..repeats {
            let mut powers: Vec<f32> = (0..21 * COLUMNS)
                .map(|_| draw.exponential() as f32)
                .collect();
            for power in &mut powers[10 * COLUMNS..11 * COLUMNS] {
                *power = target(&mut draw) as f32;
            }
            test.detect(&powers, |row, _| found += u32::from(row == 10));
        }
        f64::from(found) / (COLUMNS * repeats) as f64
    }

    /// Rohling 1983: an echo that fluctuates from frame to frame (Swerling 1), 15 dB over noise, 1e-4.
    #[test]
    fn val_a_fluctuating_echo_is_detected_as_theory_says() {
        let snr = 10f64.powf(1.5);
        for (kind, expected) in [(CfarKind::Ca, 0.6858), (CfarKind::Os, 0.6494)] {
            let share = detected(kind, 1e-4, |draw| (1.0 + snr) * draw.exponential());
            // 1e5 cells: three sigma are 0.0046.
            assert!((share - expected).abs() < 0.005, "{kind:?} {share}");
        }
    }

    /// With many reference cells CFAR becomes the test that knows the noise: textbook values of one echo that
    /// fluctuates slowly (Swerling 1, 3) or not (5), of 1e5 draws each.
    #[test]
    fn val_known_noise_gives_the_textbook_probabilities() {
        let mut draw = Draw::new(3);
        let mut share = |probability: f64, snr_db: f64, echo: &dyn Fn(&mut Draw) -> f64| {
            let limit = cell_averaging_factor(1_000_000, probability);
            let snr = 10f64.powf(0.1 * snr_db);
            let found = (0..100_000).filter(|_| {
                let amplitude = (snr * echo(&mut draw)).sqrt();
                let [re, im] = draw.noise(1.0);
                (amplitude + re).powi(2) + im * im > limit
            });
            found.count() as f64 / 1e5
        };
        let steady = |_: &mut Draw| 1.0;
        let swerling_1 = |draw: &mut Draw| draw.exponential();
        let swerling_3 = |draw: &mut Draw| 0.5 * (draw.exponential() + draw.exponential());
        let cases = [
            (share(1e-4, 15.0, &swerling_1), 0.7540),
            (share(1e-4, 16.0, &swerling_1), 0.7980),
            (share(1e-4, 15.2, &swerling_3), 0.8846),
            (share(1e-8, 13.0, &steady), 0.6290),
        ];
        for (share, expected) in cases {
            assert!((share - expected).abs() < 0.005, "{share} {expected}");
        }
    }

    /// A second target among the reference cells hides the first from the mean of them, not from one of them.
    #[test]
    fn val_only_the_mean_is_masked_by_a_neighbour() {
        let mut powers = vec![1.0; 40 * COLUMNS];
        powers[20 * COLUMNS] = 100.0;
        powers[25 * COLUMNS] = 1000.0;
        let rows = |kind| {
            let mut rows = Vec::new();
            cfar(kind, 1e-4).detect(&powers, |row, _| rows.push(row));
            rows
        };
        assert_eq!(rows(CfarKind::Ca), [25]);
        assert_eq!(rows(CfarKind::Os), [20, 25]);
    }

    /// Provokes: no cells, fewer than the references need, no number.
    #[test]
    fn few_cells_give_no_detection() {
        let mut found = 0;
        Cfar::new(&RadarTrackingSettings::default(), 0).detect(&[], |_, _| found += 1);
        assert_eq!(found, 0);
        for kind in [CfarKind::Ca, CfarKind::Os] {
            for rows in [0, 1, 10] {
                let powers = vec![f32::NAN; rows * COLUMNS];
                let mut found = 0;
                cfar(kind, 1e-4).detect(&powers, |_, _| found += 1);
                assert_eq!(found, 0);
            }
        }
    }
}
