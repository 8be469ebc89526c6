//! Counts over many runs.

use crate::calibration::{Calibration, TruePlace};
use metrotwin::stack::occupancy::Decision;

/// What became of one switch.
#[derive(Clone, Copy, Debug, Default)]
pub struct AtSwitch {
    /// Beyond the toe, where only one leg was left and it stayed so to the leg's end; none where that was not
    /// before the next switch.
    pub identified_m: Option<f64>,
    /// Whether the most probable element was the right one at the last fix before the leg's end.
    pub right: bool,
}

/// Distances of all switches, metres: one whose leg was never identified counts as infinite.
pub struct Distances {
    /// Of those that were identified; not a number where none was.
    pub mean_of_identified: f64,
    pub p95: f64,
    pub most: f64,
    /// How many never were.
    pub never: usize,
}

#[derive(Default)]
pub struct Tally {
    pub switches: Vec<AtSwitch>,
    /// Of fixes: wrong confident, wrong fairly confident, wrong undecided, nothing said, right undecided, fairly,
    /// confident.
    pub classes: [usize; 7],
    /// Of the wrong confident ones, those near a joint.
    pub at_joint: usize,
    pub calibration: Calibration,
    sigmas_m: [usize; 3],
    /// Squared errors of the place over their variance: sum and number, of fixes on the right element.
    squares: (f64, usize),
    /// Fixes where the tracks lie side by side, and how many were right.
    parallel: [usize; 2],
    /// From so far behind a leg's begin to so far before its end the tracks lie side by side.
    pub parallel_from_m: f64,
}

impl Tally {
    pub fn add(&mut self, decision: &Decision, (truth, along_m): (usize, f64), length_m: f64) {
        let place = TruePlace::new(truth, along_m, length_m);
        let is_leg = !truth.is_multiple_of(3);
        let is_parallel =
            is_leg && self.parallel_from_m > 0.0 && place.from_end_m > self.parallel_from_m;
        self.parallel[0] += usize::from(is_parallel);
        let Some(best) = decision.tracks.first() else {
            self.classes[3] += 1;
            return;
        };
        let right = best.element == truth;
        self.parallel[1] += usize::from(is_parallel && right);
        let sure = match (decision.is_identified(), best.probability > 0.9) {
            (true, _) => 2,
            (false, true) => 1,
            (false, false) => 0,
        };
        self.classes[if right { 4 + sure } else { 2 - sure }] += 1;
        self.at_joint += usize::from(!right && sure == 2 && place.is_at_joint());
        self.calibration.add(place, 1.0 - best.probability, right);
        for (count, most_m) in self.sigmas_m.iter_mut().zip([1.0, 2.0, 3.0]) {
            *count += usize::from(best.sigma_m < most_m);
        }
        if right {
            self.squares.0 += ((best.along_m - along_m) / best.sigma_m).powi(2);
            self.squares.1 += 1;
        }
    }

    pub fn extend(&mut self, other: Self) {
        self.switches.extend(other.switches);
        let sums = self.classes.iter_mut().zip(other.classes);
        let sums = sums.chain(self.sigmas_m.iter_mut().zip(other.sigmas_m));
        for (sum, count) in sums.chain(self.parallel.iter_mut().zip(other.parallel)) {
            *sum += count;
        }
        self.calibration.extend(&other.calibration);
        self.at_joint += other.at_joint;
        self.squares.0 += other.squares.0;
        self.squares.1 += other.squares.1;
    }

    pub fn fixes(&self) -> usize {
        self.classes.iter().sum()
    }

    /// Share of fixes beside the other track that are right.
    pub fn parallel_right(&self) -> f64 {
        self.parallel[1] as f64 / self.parallel[0] as f64
    }

    /// Prints what no column of [`table`] has.
    pub fn print(&self, name: &str) {
        let of = self.distances();
        let (mean_m, p95_m, most_m) = (of.mean_of_identified, of.p95, of.most);
        println!(
            "{name}: {} switches, {} fixes; {} never identified, the others after {mean_m:.1} m in the mean; of all 95 %: {p95_m:.1} m, most {most_m:.1} m; {:.3} % right",
            self.switches.len(),
            self.fixes(),
            of.never,
            100.0 * self.right()
        );
        println!("sigma of the place under 1, 2, 3 m: {}", self.sigmas());
        println!(
            "squared error of the place over its variance: {:.2}",
            self.nees()
        );
        println!(
            "{:.4} % of {} fixes beside the other track right",
            100.0 * self.parallel_right(),
            self.parallel[0]
        );
    }

    /// Shares of fixes whose place has a standard deviation under 1, 2 and 3 m.
    fn sigmas(&self) -> String {
        let shares = self
            .sigmas_m
            .map(|count| 100.0 * count as f64 / self.fixes() as f64);
        shares.map(|share| format!("{share:.0} %")).join(", ")
    }

    /// Mean squared error of the place over its variance.
    pub fn nees(&self) -> f64 {
        self.squares.0 / self.squares.1 as f64
    }

    /// Distances behind the toe at which legs were known.
    pub fn distances(&self) -> Distances {
        let legs = || self.switches.iter().map(|s| s.identified_m);
        let identified: Vec<f64> = legs().flatten().collect();
        let mut all: Vec<f64> = legs().map(|m| m.unwrap_or(f64::INFINITY)).collect();
        all.sort_by(f64::total_cmp);
        // The least that so many are not above; not a number without switches.
        let quantile = |p: f64| {
            let rank = (p * all.len() as f64).ceil() as usize;
            all.get(rank.saturating_sub(1)).copied().unwrap_or(f64::NAN)
        };
        Distances {
            mean_of_identified: identified.iter().sum::<f64>() / identified.len() as f64,
            p95: quantile(0.95),
            most: quantile(1.0),
            never: all.len() - identified.len(),
        }
    }

    /// Share of switches whose leg was never identified.
    pub fn never(&self) -> f64 {
        self.distances().never as f64 / self.switches.len() as f64
    }

    /// Share of switches where the leg was right.
    pub fn right(&self) -> f64 {
        let right = self.switches.iter().filter(|s| s.right).count();
        right as f64 / self.switches.len() as f64
    }
}

pub fn table(title: &str, rows: &[(String, Tally)]) {
    println!("\n{title}");
    println!("inf: more than the leg; the mean is of the legs that were identified");
    println!(
        "                           switches  mean m   95 %   most      never  right %   wc (at joints)  wf    wu    ns    cu    cf     cc (% of fixes)  nees"
    );
    for (name, tally) in rows {
        let of = tally.distances();
        let (mean, p95, most) = (of.mean_of_identified, of.p95, of.most);
        let fixes = tally.fixes() as f64;
        let [wc, wf, wu, ns, cu, cf, cc] = tally.classes;
        let share = |count: usize| 100.0 * count as f64 / fixes;
        println!(
            "{name:26} {:8} {mean:7.1} {p95:6.1} {most:6.1} {:9.2} % {:7.2} {wc:5} ({:5}) {:5.2} {:5.2} {:5.2} {:5.2} {:5.2} {:6.2} {:5.2}",
            tally.switches.len(),
            100.0 * tally.never(),
            100.0 * tally.right(),
            tally.at_joint,
            share(wf),
            share(wu),
            share(ns),
            share(cu),
            share(cf),
            share(cc),
            tally.nees(),
        );
    }
}
