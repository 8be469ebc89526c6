//! The arc chain nearest to points, by Gauss and Newton's method.
//!
//! Minimised is the sum of squared distances of the points over sigma squared, and of the steps of curvature from arc to
//! arc over q squared times their distance: the curve of least change of curvature (minimum variation curve, Moreton and
//! Sequin 1992) that the points allow. Poses and curvatures that an end must have are constraints, by Lagrange's
//! multipliers.

use super::arc_chain::{ArcChain, BEGIN, ChainPlace, Effects};
use crate::track::import::plane::along_m;
use nalgebra::{DMatrix, DVector, Point2, Vector2};

/// Curvature changes by this much in a metre (and by the root of a length over it): 1/300 per m over 500 m.
const CHANGE_PER_M_SQRT_M: f64 = 1.5e-4;
/// Steps of the method.
const MOST_STEPS: usize = 40;
/// No step moves a place farther.
const MOST_MOVE_M: f64 = 30.0;
/// No curve is longer than the one to begin with by such a factor.
const MOST_LONGER: f64 = 3.0;
/// What is moved by less is found.
const FOUND_M: f64 = 1e-7;
/// Weight of what nothing else decides.
const LEAST_WEIGHT: f64 = 1e-12;
/// Within this distance of a kink points are less accurate, by this factor.
const KINK_REACH_M: f64 = 40.0;
const KINK_FACTOR: f64 = 3.0;

/// Where and in which direction a curve begins or ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::track::import) struct EndPose {
    pub place: Point2<f64>,
    /// Up the curve.
    pub heading_rad: f64,
}

/// What holds at an end.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::track::import) struct EndRule {
    pub pose: Option<EndPose>,
    pub per_m: Option<f64>,
    /// Points near this end are less accurate, as those of a leg that a map draws with a kink at the toe.
    pub is_kinked: bool,
}

/// Points, and what must hold.
pub(in crate::track::import) struct FitTask<'a> {
    pub points: &'a [Point2<f64>],
    /// At the begin and at the end.
    pub rules: [EndRule; 2],
    /// Of the points, metres.
    pub sigma_m: f64,
}

impl FitTask<'_> {
    /// Moves the curve's numbers to the best ones; arcs of which `fixed` holds keep their curvature. Of each point the
    /// signed distance to its left. None where the method does not come to an end.
    pub(super) fn solve(&self, chain: &mut ArcChain, fixed: &[bool]) -> Option<Vec<Foot>> {
        let mut feet = self.first_feet(chain);
        let most_m = MOST_LONGER * chain.length_m;
        for _ in 0..MOST_STEPS {
            feet = self.feet(chain, &feet);
            let step = self.step(chain, &feet, fixed)?;
            let moved_m = apply(chain, &step)?;
            if chain.length_m > most_m {
                return None;
            }
            if moved_m < FOUND_M {
                return Some(self.feet(chain, &feet));
            }
        }
        None
    }

    /// Accuracy of a point there, metres.
    fn sigma_m(&self, s_m: f64, length_m: f64) -> f64 {
        let [begin, end] = self.rules.map(|rule| rule.is_kinked);
        let is_near = (begin && s_m < KINK_REACH_M) || (end && length_m - s_m < KINK_REACH_M);
        self.sigma_m * if is_near { KINK_FACTOR } else { 1.0 }
    }

    /// Where the points' perpendiculars meet a curve.
    pub(super) fn feet_of(&self, chain: &ArcChain) -> Vec<Foot> {
        self.feet(chain, &self.first_feet(chain))
    }

    fn first_feet(&self, chain: &ArcChain) -> Vec<Foot> {
        let along_m = along_m(self.points);
        let scale = chain.length_m / along_m.last().copied().unwrap_or(0.0);
        let feet = along_m.into_iter().map(|at_m| Foot {
            s_m: at_m * scale,
            ..Foot::default()
        });
        feet.collect()
    }

    /// Feet of the points' perpendiculars, from those before; the ends stay at the ends.
    fn feet(&self, chain: &ArcChain, before: &[Foot]) -> Vec<Foot> {
        let last = before.len() - 1;
        let old_m = before[last].s_m.max(1e-9);
        let mut at_m: Vec<f64> = before
            .iter()
            .map(|f| f.s_m * chain.length_m / old_m)
            .collect();
        for _ in 0..2 {
            let places = chain.places(&at_m);
            let mut low_m = 0.0f64;
            for k in 1..last {
                let step_m = ahead(&places[k]).dot(&(self.points[k] - places[k].place));
                at_m[k] = (places[k].s_m + step_m.clamp(-5.0, 5.0)).clamp(low_m, chain.length_m);
                low_m = at_m[k];
            }
            at_m[last] = chain.length_m;
        }
        let places = chain.places(&at_m);
        let feet = places.iter().zip(self.points).map(|(place, point)| {
            let forward = ahead(place);
            let to = point - place.place;
            let left_m = forward.perp(&to);
            Foot {
                s_m: place.s_m,
                left_m,
                sigmas: left_m.abs() / self.sigma_m(place.s_m, chain.length_m),
            }
        });
        feet.collect()
    }

    fn step(&self, chain: &ArcChain, feet: &[Foot], fixed: &[bool]) -> Option<DVector<f64>> {
        let count = BEGIN + chain.per_m.len();
        let at_m: Vec<f64> = feet.iter().map(|foot| foot.s_m).collect();
        let effects = chain.effects(&at_m);
        let mut normal = DMatrix::<f64>::zeros(count, count);
        let mut right = DVector::<f64>::zeros(count);
        let mut add = |row: &DVector<f64>, value: f64, sigma: f64| {
            let weight = 1.0 / (sigma * sigma);
            normal.ger(weight, row, row, 1.0);
            right.axpy(weight * value, row, 1.0);
        };
        let last = effects.len() - 1;
        for (k, ((place, effects), point)) in effects.iter().zip(self.points).enumerate() {
            let forward = ahead(place);
            let to = point - place.place;
            let left = &effects.y * forward.x - &effects.x * forward.y;
            let sigma_m = self.sigma_m(place.s_m, chain.length_m);
            add(&left, forward.perp(&to), sigma_m);
            if k == 0 || k == last {
                let along = &effects.x * forward.x + &effects.y * forward.y;
                add(&along, forward.dot(&to), sigma_m);
            }
        }
        for k in 1..chain.per_m.len() {
            let apart_m = chain.length_m * (chain.middles[k] - chain.middles[k - 1]);
            let mut row = DVector::zeros(count);
            (row[BEGIN + k - 1], row[BEGIN + k]) = (-1.0, 1.0);
            let change = chain.per_m[k - 1] - chain.per_m[k];
            add(&row, change, CHANGE_PER_M_SQRT_M * apart_m.max(1.0).sqrt());
        }
        let (rows, values) = self.constraints(chain, &effects, fixed);
        solved(normal, right, &rows, &values)
    }

    /// What must hold, as rows and by how much it does not yet.
    fn constraints(
        &self,
        chain: &ArcChain,
        effects: &[(ChainPlace, Effects)],
        fixed: &[bool],
    ) -> (Vec<DVector<f64>>, Vec<f64>) {
        let count = BEGIN + chain.per_m.len();
        let (mut rows, mut values) = (Vec::new(), Vec::new());
        for (rule, (place, effects)) in self
            .rules
            .iter()
            .zip([&effects[0], &effects[effects.len() - 1]])
        {
            if let Some(pose) = rule.pose {
                let to = pose.place - place.place;
                rows.extend([&effects.x, &effects.y, &effects.heading].map(Clone::clone));
                values.extend([to.x, to.y, pose.heading_rad - place.heading_rad]);
            }
        }
        for (k, _) in fixed.iter().enumerate().filter(|(_, is)| **is) {
            let mut row = DVector::zeros(count);
            row[BEGIN + k] = 1.0;
            rows.push(row);
            values.push(0.0);
        }
        (rows, values)
    }
}

/// Where a point's perpendicular meets the curve, and how far to its left the point is.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Foot {
    pub s_m: f64,
    pub left_m: f64,
    /// The same, of its accuracy.
    pub sigmas: f64,
}

fn ahead(place: &ChainPlace) -> Vector2<f64> {
    let (sin, cos) = place.heading_rad.sin_cos();
    Vector2::new(cos, sin)
}

/// Numbers are of metres, radians and 1/m: scaled to what moves a place some 100 m away by a metre.
fn scale(number: usize) -> f64 {
    match number {
        0 | 1 | 3 => 1.0,
        2 => 1e-2,
        _ => 1e-4,
    }
}

/// The step that minimises under constraints.
fn solved(
    normal: DMatrix<f64>,
    right: DVector<f64>,
    rows: &[DVector<f64>],
    values: &[f64],
) -> Option<DVector<f64>> {
    let (count, more) = (right.len(), rows.len());
    let mut all = DMatrix::zeros(count + more, count + more);
    let mut sums = DVector::zeros(count + more);
    for i in 0..count {
        for j in 0..count {
            all[(i, j)] = normal[(i, j)] * scale(i) * scale(j);
        }
        all[(i, i)] += LEAST_WEIGHT;
        sums[i] = right[i] * scale(i);
    }
    for (k, (row, value)) in rows.iter().zip(values).enumerate() {
        let row: DVector<f64> =
            DVector::from_iterator(count, (0..count).map(|i| row[i] * scale(i)));
        let size = row.amax().max(1e-300);
        for i in 0..count {
            all[(i, count + k)] = row[i] / size;
            all[(count + k, i)] = row[i] / size;
        }
        sums[count + k] = value / size;
    }
    let found = all.lu().solve(&sums)?;
    let step = DVector::from_iterator(count, (0..count).map(|i| found[i] * scale(i)));
    step.iter().all(|x| x.is_finite()).then_some(step)
}

/// Makes a step, shortened where it is too large; by about how much it moves a place. None where the curve loses its
/// length.
fn apply(chain: &mut ArcChain, step: &DVector<f64>) -> Option<f64> {
    let long_m = chain.length_m;
    let turn_m = (BEGIN..step.len()).map(|k| step[k].abs() * long_m * long_m / step.len() as f64);
    let moved_m = step[0].abs() + step[1].abs() + step[2].abs() * long_m + step[3].abs();
    let moved_m = moved_m + turn_m.fold(0.0, f64::max);
    let part = (MOST_MOVE_M.max(0.3 * long_m) / moved_m).min(1.0);
    chain.begin.x += part * step[0];
    chain.begin.y += part * step[1];
    chain.heading_rad += part * step[2];
    chain.length_m += part * step[3];
    for (k, per_m) in chain.per_m.iter_mut().enumerate() {
        *per_m += part * step[BEGIN + k];
    }
    (chain.length_m > 0.2 * long_m).then_some(moved_m)
}
