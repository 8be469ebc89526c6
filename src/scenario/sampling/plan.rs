//! Points of the unit cube, one a run: any can be had alone, in any order.

use super::settings::PlanSettings;
use crate::twin::random::Stream;
use sobol::Sobol;
use sobol::params::JoeKuoD6;

/// Most variables that Sobol's sequence serves here.
pub const MOST_SOBOL: usize = 100;

/// Which run of a study it is.
#[derive(Clone, Copy, Debug)]
pub struct RunNumber {
    /// Among all.
    pub index: u64,
    /// Which combination of swept values it has.
    pub cell: u64,
    /// Which run of that combination it is.
    pub repeat: u64,
}

/// A plan for some variables by name.
#[derive(Clone, Debug)]
pub struct SamplingPlan {
    settings: PlanSettings,
    seed: u64,
    names: Vec<String>,
    /// Direction numbers of Sobol's sequence, for each variable.
    directions: Vec<Vec<u32>>,
}

impl SamplingPlan {
    /// Of the variables that are drawn.
    pub fn new(settings: PlanSettings, seed: u64, names: Vec<String>) -> Self {
        let dimensions = names.len().min(MOST_SOBOL);
        let directions = if settings == PlanSettings::Sobol && dimensions > 0 {
            Sobol::<u32>::init_direction_vals(dimensions, 32, &JoeKuoD6::minimal())
        } else {
            Vec::new()
        };
        Self {
            settings,
            seed,
            names,
            directions,
        }
    }

    /// The point of a run, in (0, 1) for each variable. Every cell has a plan of its own. A draw that was rejected is tried again at independent
    /// points: what is accepted at last has the distribution that was asked for, whatever the plan.
    pub fn point(&self, run: RunNumber, attempt: u32) -> Vec<f64> {
        let RunNumber {
            index,
            cell,
            repeat,
        } = run;
        let random = |name: &String| {
            Stream::new(self.seed, index, &format!("draw/{name}")).uniform(u64::from(attempt))
        };
        let of_cell =
            |what: &str, name: &str| Stream::new(self.seed, cell, &format!("{what}/{name}"));
        let names = self.names.iter();
        match self.settings {
            PlanSettings::LatinHypercube { points } if attempt == 0 => names
                .map(|name| {
                    let cube = repeat / u64::from(points);
                    let order = of_cell("slices", name).words(cube as u32, (cube >> 32) as u32);
                    let within = (repeat % u64::from(points)) as u32;
                    let slice = shuffled(within, points, [order[0], order[1]]);
                    (f64::from(slice) + random(name)) / f64::from(points)
                })
                .collect(),
            PlanSettings::Sobol if attempt == 0 => names
                .zip(&self.directions)
                .map(|(name, directions)| {
                    let x = owen(sobol(repeat, directions), of_cell("scramble", name).key);
                    // 32 bits of the sequence; below them nothing is known, so any place will do.
                    (f64::from(x) + random(name)) / 4_294_967_296.0
                })
                .collect(),
            _ => names.map(random).collect(),
        }
    }
}

/// Point `index` of Sobol's sequence in one dimension, in the order of Gray codes.
fn sobol(index: u64, directions: &[u32]) -> u32 {
    let gray = index ^ (index >> 1);
    let set = directions
        .iter()
        .enumerate()
        .filter(|(bit, _)| gray >> bit & 1 == 1);
    set.fold(0, |x, (_, direction)| x ^ direction)
}

/// Owen's nested uniform scramble: every bit is flipped, or not, by a hash of the bits above it, so
/// that all dyadic intervals keep their points (Owen, "Randomly permuted (t,m,s)-nets", 1995).
fn owen(x: u32, key: [u32; 2]) -> u32 {
    let flips = (0..32).fold(0u32, |flips, bit| {
        let above = if bit == 0 { 0 } else { x >> (32 - bit) };
        let hash = Stream { key }.words(above, bit)[0];
        flips | (hash >> 31) << (31 - bit)
    });
    x ^ flips
}

/// Where a random permutation of 0..len has put `at`: a Feistel network over the next power of four,
/// walked on until it falls within (Black and Rogaway, "Ciphers with arbitrary finite domains",
/// 2002). It needs no list.
fn shuffled(at: u32, len: u32, key: [u32; 2]) -> u32 {
    let half = (32 - len.max(2).saturating_sub(1).leading_zeros())
        .div_ceil(2)
        .max(1);
    let mask = (1u32 << half) - 1;
    let mut x = at;
    loop {
        let (mut left, mut right) = (x >> half, x & mask);
        for round in 0..6 {
            let hash = Stream { key }.words(right, round)[0];
            (left, right) = (right, left ^ (hash & mask));
        }
        x = left << half | right;
        if x < len {
            return x;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(settings: PlanSettings, seed: u64) -> SamplingPlan {
        SamplingPlan::new(settings, seed, (0..5).map(|k| format!("v{k}")).collect())
    }

    fn run(index: u64, cell: u64, repeat: u64) -> RunNumber {
        RunNumber {
            index,
            cell,
            repeat,
        }
    }

    /// scipy.stats.qmc.Sobol(5, scramble=False).random(16).
    #[test]
    fn val_sobol_points_are_scipys() {
        let directions = Sobol::<u32>::init_direction_vals(5, 32, &JoeKuoD6::minimal());
        let scipy = [
            [0.0, 0.0, 0.0, 0.0, 0.0],
            [0.5, 0.5, 0.5, 0.5, 0.5],
            [0.75, 0.25, 0.25, 0.25, 0.75],
            [0.25, 0.75, 0.75, 0.75, 0.25],
            [0.375, 0.375, 0.625, 0.875, 0.375],
            [0.875, 0.875, 0.125, 0.375, 0.875],
            [0.625, 0.125, 0.875, 0.625, 0.625],
            [0.125, 0.625, 0.375, 0.125, 0.125],
            [0.1875, 0.3125, 0.9375, 0.4375, 0.5625],
            [0.6875, 0.8125, 0.4375, 0.9375, 0.0625],
            [0.9375, 0.0625, 0.6875, 0.1875, 0.3125],
            [0.4375, 0.5625, 0.1875, 0.6875, 0.8125],
            [0.3125, 0.1875, 0.3125, 0.5625, 0.9375],
            [0.8125, 0.6875, 0.8125, 0.0625, 0.4375],
            [0.5625, 0.4375, 0.0625, 0.8125, 0.1875],
            [0.0625, 0.9375, 0.5625, 0.3125, 0.6875],
        ];
        for (k, row) in scipy.iter().enumerate() {
            for (d, expected) in row.iter().enumerate() {
                let x = f64::from(sobol(k as u64, &directions[d])) / 2f64.powi(32);
                assert!(
                    (x - expected).abs() < 1e-15,
                    "point {k}, dimension {d}: {x}"
                );
            }
        }
    }

    /// Points that fall into one slice twice, or leave one out: a permutation that is none, a
    /// scramble that breaks the net.
    #[test]
    fn every_slice_is_taken_once() {
        let cube = PlanSettings::LatinHypercube { points: 100 };
        for (settings, n) in [(cube, 100u64), (PlanSettings::Sobol, 128)] {
            for (seed, block) in [(1, 0), (2, 0), (2, 3)] {
                let plan = plan(settings, seed);
                let points: Vec<_> = (0..n)
                    .map(|k| plan.point(run(block * n + k, 2, block * n + k), 0))
                    .collect();
                for v in 0..5 {
                    let slices = points.iter().map(|p| (p[v] * n as f64) as usize);
                    let mut slices: Vec<_> = slices.collect();
                    slices.sort_unstable();
                    assert!(slices.into_iter().eq(0..n as usize), "{settings:?} v{v}");
                }
            }
        }
    }

    /// All pairs of Sobol's dimensions 0 and 1 make a (0, m, 2)-net, scrambled or not: every box of
    /// 16 x 8 holds one of 128 points.
    #[test]
    fn a_scrambled_net_is_a_net() {
        let plan = plan(PlanSettings::Sobol, 7);
        let mut boxes = vec![0; 128];
        for k in 0..128 {
            let p = plan.point(run(k, 0, k), 0);
            boxes[(p[0] * 16.0) as usize * 8 + (p[1] * 8.0) as usize] += 1;
        }
        assert!(boxes.iter().all(|n| *n == 1), "{boxes:?}");
    }

    /// Cells of a sweep that share their draws: figures over all of them would look surer than they are.
    #[test]
    fn cells_are_sampled_by_themselves() {
        for settings in [PlanSettings::Random, PlanSettings::Sobol] {
            let plan = plan(settings, 3);
            let cells = [0, 1].map(|cell| plan.point(run(2 * 7 + cell, cell, 7), 0));
            assert!(
                cells[0]
                    .iter()
                    .zip(&cells[1])
                    .all(|(a, b)| (a - b).abs() > 1e-6)
            );
        }
    }

    /// Seeds and attempts that do not matter, a variable whose draws depend on the others'.
    #[test]
    fn samples_depend_on_seed_index_and_name_alone() {
        let few = SamplingPlan::new(PlanSettings::Random, 1, vec!["v3".into()]);
        let many = plan(PlanSettings::Random, 1);
        for index in 0..10 {
            let at = |plan: &SamplingPlan, attempt| plan.point(run(index, 0, index), attempt);
            let own = at(&few, 0)[0].to_bits();
            assert_eq!(own, at(&many, 0)[3].to_bits());
            let other = [at(&many, 1), at(&plan(PlanSettings::Random, 2), 0)];
            assert!(other.iter().all(|p| p[3].to_bits() != own));
        }
    }
}
