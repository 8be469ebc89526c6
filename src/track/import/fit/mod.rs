//! From points along a track to its plan: straights and arcs with clothoids between, as railways are set out.
//!
//! Points of a map lie beside the track by some decimetres, and joining them by straights gives kinks that no train
//! can run. The curve is an [`ArcChain`](arc_chain::ArcChain): as many arcs as it takes to come as near to the points as
//! they are accurate. It begins with few; stretches whose points are too far away are halved. Then arcs that need not
//! turn become straights. Where a curve must begin and end in given poses it does so exactly.
//!
//! Not here: cant, and curves by design speed.

mod arc_chain;
mod solve;
#[cfg(test)]
#[allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test may panic, and says what it measured"
)]
mod tests;

pub(super) use arc_chain::ArcChain;
pub(super) use solve::{EndPose, EndRule, FitTask};

use super::plane::{length_m, turn_rad};
use nalgebra::{Point2, Vector2};
use solve::Foot;

/// Arcs are no closer, metres, unless the curve is shorter.
const LEAST_APART_M: f64 = 6.0;
/// The first arcs are so far apart, or the curve has [`FEWEST`] stretches.
const FIRST_APART_M: f64 = 150.0;
const FEWEST: usize = 4;
/// No curve has more: 10 km of bends every 25 m. A search takes time by the cube of them.
const MOST_ARCS: usize = 400;
/// More stretches to begin with only take time.
const MOST_FIRST: usize = 200;
/// A point may be so many sigma beside the curve.
const MOST_SIGMA: f64 = 2.5;
/// An arc of a larger radius is a straight, if the points allow it.
const STRAIGHT_M: f64 = 500.0;
/// An end that is no farther beside a straight, in place and direction, is on it: far less than what ends that meet
/// may differ by.
const SAME_M: f64 = 2e-4;
const SAME_RAD: f64 = 2e-5;
/// Of a curve with more arcs none is taken out or tried alone: each takes a search.
const MOST_THINNED: usize = 80;
/// The tightest that the tunnel format has.
pub(super) const TIGHTEST_M: f64 = 20.0;

/// A curve through points.
#[derive(Clone, Debug)]
pub(super) struct FittedCurve {
    pub chain: ArcChain,
    /// The farthest that a point is beside it, and the root of the mean square, metres.
    pub most_m: f64,
    pub rms_m: f64,
}

impl FittedCurve {
    fn of(chain: ArcChain, feet: &[Foot]) -> Self {
        Self {
            most_m: feet.iter().map(|f| f.left_m.abs()).fold(0.0, f64::max),
            rms_m: rms(feet, |f| f.left_m),
            chain,
        }
    }
}

/// Why points have no curve.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub(super) enum FitError {
    /// The method found none.
    #[error(
        "no curve of arcs and clothoids leads through its points from one of its ends to the other"
    )]
    NotFound,
    /// It is tighter than any track.
    #[error("the map asks for a radius of {0:.1} m, and a track has at least {TIGHTEST_M:.0} m")]
    TooTight(f64),
}

impl FitTask<'_> {
    /// The curve with as few arcs as come near enough to the points.
    pub(super) fn fit(&self) -> Result<FittedCurve, FitError> {
        if let Some(straight) = self.straight() {
            return Ok(straight);
        }
        let along_m = length_m(self.points);
        let stretches = ((along_m / FIRST_APART_M).ceil() as usize).clamp(FEWEST, MOST_FIRST);
        let mut chain = self.first(stretches);
        let mut best: Option<(ArcChain, Vec<Foot>)> = None;
        loop {
            let mut tried = chain.clone();
            let fixed = self.fixed(&mut tried);
            match self.solve(&mut tried, &fixed) {
                Some(feet) if is_sane(&tried) => {
                    let far = self.far(&tried, &feet);
                    chain = tried.clone();
                    best = Some((tried, feet));
                    if !divide(&mut chain, &far) {
                        break;
                    }
                }
                // More freedom may help.
                _ if !divide_all(&mut chain) => break,
                _ => {}
            }
        }
        let (chain, feet) = best.ok_or(FitError::NotFound)?;
        let limit = Nearness::of(&feet);
        let (chain, feet) = self.thinned(chain, feet, &limit);
        let (chain, feet) = self.straightened(chain, feet, &limit);
        let tightest_m = 1.0 / chain.per_m.iter().fold(0.0f64, |most, k| most.max(k.abs()));
        if tightest_m < TIGHTEST_M {
            return Err(FitError::TooTight(tightest_m));
        }
        Ok(FittedCurve::of(chain, &feet))
    }

    /// The straight between two poses that lie on one, if its points do.
    fn straight(&self) -> Option<FittedCurve> {
        let [begin, end] = [self.rules[0].pose?, self.rules[1].pose?];
        let way = end.place - begin.place;
        let (sin, cos) = begin.heading_rad.sin_cos();
        let turn_rad = turn_rad(begin.heading_rad, end.heading_rad);
        let is_straight =
            Vector2::new(cos, sin).perp(&way).abs() < SAME_M && turn_rad.abs() < SAME_RAD;
        let chain = ArcChain {
            begin: begin.place,
            heading_rad: begin.heading_rad,
            length_m: way.norm(),
            middles: vec![0.0, 1.0],
            per_m: vec![0.0; 2],
        };
        let feet = self.feet_of(&chain);
        (is_straight && Nearness::of(&[]).holds(&feet)).then(|| FittedCurve::of(chain, &feet))
    }

    /// The curve of evenly spaced arcs that changes its curvature least, and where along it each point is.
    pub(super) fn smooth(&self, apart_m: f64) -> Result<(ArcChain, Vec<f64>), FitError> {
        let stretches = ((length_m(self.points) / apart_m).ceil() as usize).max(2);
        let mut chain = self.first(stretches);
        let fixed = self.fixed(&mut chain);
        let feet = self.solve(&mut chain, &fixed).ok_or(FitError::NotFound)?;
        Ok((chain, feet.iter().map(|foot| foot.s_m).collect()))
    }

    /// A curve to begin with: its curvatures are those of the points, over the stretch of each arc.
    fn first(&self, stretches: usize) -> ArcChain {
        let course = HeadingProfile::of(self.points);
        let count = stretches as f64;
        let middles: Vec<f64> = (0..=stretches).map(|k| k as f64 / count).collect();
        let half_m = 0.5 * course.length_m / count;
        let per_m = middles.iter().map(|share| {
            let at_m = share * course.length_m;
            let [from_m, to_m] =
                [at_m - half_m, at_m + half_m].map(|m| m.clamp(0.0, course.length_m));
            (course.heading_rad(to_m) - course.heading_rad(from_m)) / (to_m - from_m)
        });
        let begin = self.rules[0].pose;
        ArcChain {
            begin: begin.map_or(self.points[0], |pose| pose.place),
            heading_rad: begin.map_or(course.heading_rad(0.0), |pose| pose.heading_rad),
            length_m: course.length_m,
            per_m: per_m.collect(),
            middles,
        }
    }

    /// Which arcs have their curvature by a rule, and gives it to them.
    fn fixed(&self, chain: &mut ArcChain) -> Vec<bool> {
        let last = chain.per_m.len() - 1;
        let mut fixed = vec![false; last + 1];
        for (rule, k) in self.rules.iter().zip([0, last]) {
            if let Some(per_m) = rule.per_m {
                (chain.per_m[k], fixed[k]) = (per_m, true);
            }
        }
        fixed
    }

    /// Between which arcs points are too far away, by the first of both.
    fn far(&self, chain: &ArcChain, feet: &[Foot]) -> Vec<usize> {
        let mut far: Vec<usize> = Vec::new();
        for k in 0..chain.middles.len() - 1 {
            let [from_m, to_m] = [k, k + 1].map(|k| chain.middles[k] * chain.length_m);
            let within = feet.iter().filter(|f| (from_m..=to_m).contains(&f.s_m));
            let within: Vec<Foot> = within.copied().collect();
            let most = within.iter().map(|f| f.sigmas).fold(0.0, f64::max);
            if most > MOST_SIGMA || (within.len() > 2 && rms(&within, |f| f.sigmas) > 1.0) {
                far.push(k);
            }
        }
        far
    }

    /// Takes out arcs without which the points stay as near as they must, first those that lie on the line between
    /// their neighbours.
    fn thinned(&self, chain: ArcChain, feet: Vec<Foot>, limit: &Nearness) -> (ArcChain, Vec<Foot>) {
        let mut now = (chain, feet);
        if now.0.per_m.len() > MOST_THINNED {
            return now;
        }
        let bend = |chain: &ArcChain, k: usize| {
            let [a, b, c] = [k - 1, k, k + 1].map(|k| (chain.middles[k], chain.per_m[k]));
            let between = a.1 + (c.1 - a.1) * (b.0 - a.0) / (c.0 - a.0);
            (b.1 - between).abs()
        };
        let mut kept: Vec<f64> = Vec::new();
        while now.0.per_m.len() > FEWEST + 1 {
            let chain = &now.0;
            let inner = (1..chain.per_m.len() - 1).filter(|k| !kept.contains(&chain.middles[*k]));
            let Some(k) = inner.min_by(|a, b| bend(chain, *a).total_cmp(&bend(chain, *b))) else {
                break;
            };
            let mut tried = chain.clone();
            let middle = tried.middles.remove(k);
            tried.per_m.remove(k);
            let fixed = self.fixed(&mut tried);
            let found = self.solve(&mut tried, &fixed).filter(|_| is_sane(&tried));
            match found.filter(|feet| limit.holds(feet)) {
                Some(feet) => now = (tried, feet),
                None => kept.push(middle),
            }
        }
        now
    }

    /// Arcs that hardly turn become straights where the points stay as near as they must.
    fn straightened(
        &self,
        chain: ArcChain,
        feet: Vec<Foot>,
        limit: &Nearness,
    ) -> (ArcChain, Vec<Foot>) {
        let mut now = (chain, feet);
        let mut straight = self.fixed(&mut now.0);
        let mut order: Vec<usize> = (0..straight.len()).filter(|k| !straight[*k]).collect();
        order.sort_by(|a, b| now.0.per_m[*a].abs().total_cmp(&now.0.per_m[*b].abs()));
        let mut free = order.len();
        // With the length they meet the pose of the other end.
        let needed = if self.rules.iter().all(|rule| rule.pose.is_some()) {
            2
        } else {
            0
        };
        for group in groups(&now.0, &order) {
            if free < needed + group.len() {
                break;
            }
            let mut tried = now.0.clone();
            let mut fixed = straight.clone();
            for k in &group {
                (tried.per_m[*k], fixed[*k]) = (0.0, true);
            }
            let found = self.solve(&mut tried, &fixed).filter(|_| is_sane(&tried));
            if let Some(feet) = found.filter(|feet| limit.holds(feet)) {
                free -= group.len();
                now = (tried, feet);
                straight = fixed;
            }
        }
        now
    }
}

/// Arcs that may be straights: first all together, then one by one, the straightest first.
fn groups(chain: &ArcChain, order: &[usize]) -> Vec<Vec<usize>> {
    let small = order.iter().copied();
    let small: Vec<usize> = small
        .filter(|k| chain.per_m[*k].abs() * STRAIGHT_M < 1.0)
        .collect();
    let are_few = chain.per_m.len() <= MOST_THINNED;
    let one_by_one = small.iter().filter(|_| are_few).map(|k| vec![*k]);
    let together = (small.len() > 1).then(|| small.clone());
    together.into_iter().chain(one_by_one).collect()
}

/// Halves stretches; false where there are none, or they are short already.
fn divide(chain: &mut ArcChain, stretches: &[usize]) -> bool {
    let mut done = false;
    if chain.per_m.len() + stretches.len() > MOST_ARCS {
        return done;
    }
    for k in stretches.iter().rev() {
        let apart_m = chain.length_m * (chain.middles[k + 1] - chain.middles[*k]);
        if apart_m >= 2.0 * LEAST_APART_M {
            chain.divide(*k);
            done = true;
        }
    }
    done
}

fn divide_all(chain: &mut ArcChain) -> bool {
    let all: Vec<usize> = (0..chain.middles.len() - 1).collect();
    divide(chain, &all)
}

/// Whether no arc is tighter than 5 m: with such an arc the method has gone astray.
fn is_sane(chain: &ArcChain) -> bool {
    let tight = chain.per_m.iter().any(|k| k.abs() > 0.2);
    !tight && chain.length_m.is_finite()
}

/// How far points may be beside a curve, by their accuracy: as far as they must be allowed to.
struct Nearness {
    most: f64,
    rms: f64,
}

impl Nearness {
    /// Of the curve with the most arcs.
    fn of(feet: &[Foot]) -> Self {
        Self {
            most: feet.iter().map(|f| f.sigmas).fold(MOST_SIGMA, f64::max),
            rms: rms(feet, |f| f.sigmas).max(1.0),
        }
    }

    fn holds(&self, feet: &[Foot]) -> bool {
        feet.iter().all(|f| f.sigmas <= self.most) && rms(feet, |f| f.sigmas) <= self.rms
    }
}

fn rms(feet: &[Foot], of: impl Fn(&Foot) -> f64) -> f64 {
    let sum: f64 = feet.iter().map(|f| of(f).powi(2)).sum();
    (sum / feet.len().max(1) as f64).sqrt()
}

/// Headings of straights between points, linear from middle to middle.
pub(super) struct HeadingProfile {
    pub length_m: f64,
    /// Middles of the straights and their headings, which do not jump by a whole turn.
    middles: Vec<(f64, f64)>,
}

impl HeadingProfile {
    pub fn of(points: &[Point2<f64>]) -> Self {
        let mut along_m = 0.0;
        let mut middles: Vec<(f64, f64)> = Vec::new();
        for pair in points.windows(2) {
            let way: Vector2<f64> = pair[1] - pair[0];
            let heading = way.y.atan2(way.x);
            let heading = middles
                .last()
                .map_or(heading, |(_, last)| last + turn_rad(*last, heading));
            middles.push((along_m + 0.5 * way.norm(), heading));
            along_m += way.norm();
        }
        Self {
            length_m: along_m,
            middles,
        }
    }

    /// Before the first middle and after the last one it is theirs.
    pub fn heading_rad(&self, at_m: f64) -> f64 {
        let after = self.middles.partition_point(|(m, _)| *m <= at_m);
        match (after.checked_sub(1), self.middles.get(after)) {
            (Some(before), Some((to_m, to))) => {
                let (from_m, from) = self.middles[before];
                from + (to - from) * (at_m - from_m) / (to_m - from_m)
            }
            (Some(before), None) => self.middles[before].1,
            (None, first) => first.map_or(0.0, |(_, heading)| *heading),
        }
    }
}
