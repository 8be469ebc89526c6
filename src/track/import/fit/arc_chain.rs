//! A curve of arcs that clothoids join, and how its places change with each of its numbers.
//!
//! Curvature is that of arc i over a stretch around its middle, and runs linearly from there to the stretch of the next
//! arc. The middles are shares of the length, so that a change of the length stretches the curve. The first and the last
//! arc lie at its ends. So the heading at s is h0 + sum of k[i] B[i](s), with B[i] the integral of a trapezoid, and the
//! place its Fresnel integral, by Gauss's rule of three points over steps within which the heading changes little.

use nalgebra::{DVector, Point2, Vector2};

/// Of the distance to the nearer neighbour, an arc takes this share to either side of its middle.
const ARC_SHARE: f64 = 0.25;
/// Steps of the integral turn no farther, within these lengths.
const STEP_RAD: f64 = 0.05;
const SHORTEST_STEP_M: f64 = 0.5;
const LONGEST_STEP_M: f64 = 100.0;
/// Middles and weights of Gauss's rule of three points.
const GAUSS: [(f64, f64); 3] = [
    (0.112_701_665_379_258_3, 5.0 / 18.0),
    (0.5, 8.0 / 18.0),
    (0.887_298_334_620_741_7, 5.0 / 18.0),
];

/// A curve from a place on.
#[derive(Clone, Debug)]
pub(in crate::track::import) struct ArcChain {
    pub begin: Point2<f64>,
    pub heading_rad: f64,
    pub length_m: f64,
    /// Middles of the arcs as shares of the length: from 0 to 1, growing.
    pub middles: Vec<f64>,
    /// Their curvatures, to the left positive.
    pub per_m: Vec<f64>,
}

/// A stretch of one linear course of curvature.
#[derive(Clone, Copy, Debug)]
pub(in crate::track::import) struct ChainPiece {
    pub from_m: f64,
    pub to_m: f64,
    /// The arc, or the two that a clothoid joins.
    pub arcs: [usize; 2],
}

/// A place on the curve.
#[derive(Clone, Debug)]
pub(in crate::track::import) struct ChainPlace {
    pub s_m: f64,
    pub place: Point2<f64>,
    pub heading_rad: f64,
    pub per_m: f64,
}

/// How a place and its heading change with: begin x and y, heading, length, curvatures. The place keeps its share of
/// the length.
#[derive(Clone, Debug)]
pub(super) struct Effects {
    pub x: DVector<f64>,
    pub y: DVector<f64>,
    pub heading: DVector<f64>,
}

/// The numbers of a curve before its curvatures.
pub(super) const BEGIN: usize = 4;

impl ArcChain {
    /// Its stretches in order, without gaps.
    pub fn pieces(&self) -> Vec<ChainPiece> {
        let last = self.middles.len() - 1;
        let gap = |k: usize| self.middles[k + 1] - self.middles[k];
        let half = |k: usize| {
            let before = k.checked_sub(1).map_or(f64::INFINITY, gap);
            let after = if k < last { gap(k) } else { f64::INFINITY };
            ARC_SHARE * before.min(after)
        };
        let mut pieces = Vec::with_capacity(2 * last + 1);
        let mut from = 0.0;
        let mut add = |to: f64, arcs| {
            pieces.push(ChainPiece {
                from_m: self.length_m * from,
                to_m: self.length_m * to,
                arcs,
            });
            from = to;
        };
        for k in 0..last {
            add(self.middles[k] + half(k), [k, k]);
            add(self.middles[k + 1] - half(k + 1), [k, k + 1]);
        }
        add(1.0, [last, last]);
        pieces
    }

    /// Places at distances from the begin, in order; what does not grow is where the one before is.
    pub fn places(&self, at_m: &[f64]) -> Vec<ChainPlace> {
        let mut places = Vec::with_capacity(at_m.len());
        self.march(at_m, |marching| places.push(marching.now()));
        places
    }

    /// The same with their effects.
    pub(super) fn effects(&self, at_m: &[f64]) -> Vec<(ChainPlace, Effects)> {
        let mut places = Vec::with_capacity(at_m.len());
        let mut march = March::of(self, true);
        self.march_with(&mut march, at_m, |marching| {
            places.push((marching.now(), marching.effects(self)));
        });
        places
    }

    fn march(&self, at_m: &[f64], tell: impl FnMut(&March)) {
        self.march_with(&mut March::of(self, false), at_m, tell);
    }

    fn march_with(&self, march: &mut March, at_m: &[f64], mut tell: impl FnMut(&March)) {
        let mut wanted = at_m.iter().copied().peekable();
        while wanted.next_if(|m| *m <= 0.0).is_some() {
            tell(march);
        }
        for piece in self.pieces() {
            let bends = piece.arcs.map(|k| self.per_m[k].abs());
            let step_m = STEP_RAD / bends[0].max(bends[1]).max(1e-9);
            let step_m = step_m.clamp(SHORTEST_STEP_M, LONGEST_STEP_M);
            while march.s_m < piece.to_m {
                let next_m = wanted.peek().copied().unwrap_or(f64::INFINITY);
                let to_m = piece.to_m.min(march.s_m + step_m).min(next_m);
                march.step(self, &piece, to_m.max(march.s_m));
                while wanted.next_if(|m| *m <= march.s_m).is_some() {
                    tell(march);
                }
            }
        }
        // Beyond the end by rounding.
        for _ in wanted {
            tell(march);
        }
    }

    /// The curve with another arc halfway between two.
    pub fn divide(&mut self, after: usize) {
        let pair = |list: &[f64]| 0.5 * (list[after] + list[after + 1]);
        let (middle, per_m) = (pair(&self.middles), pair(&self.per_m));
        self.middles.insert(after + 1, middle);
        self.per_m.insert(after + 1, per_m);
    }
}

/// Integrals up to a place.
struct March {
    s_m: f64,
    place: Vector2<f64>,
    heading: f64,
    per_m: f64,
    /// Of the heading by each curvature.
    turned: Vec<f64>,
    /// Of the place by each curvature, and by the length as far as it changes headings. Empty where not asked for.
    moved: Vec<Vector2<f64>>,
    stretched: Vector2<f64>,
}

impl March {
    fn of(chain: &ArcChain, with_effects: bool) -> Self {
        let count = if with_effects { chain.per_m.len() } else { 0 };
        Self {
            s_m: 0.0,
            place: chain.begin.coords,
            heading: chain.heading_rad,
            per_m: chain.per_m[0],
            turned: vec![0.0; count],
            moved: vec![Vector2::zeros(); count],
            stretched: Vector2::zeros(),
        }
    }

    fn step(&mut self, chain: &ArcChain, piece: &ChainPiece, to_m: f64) {
        let [a, b] = piece.arcs;
        let long_m = piece.to_m - piece.from_m;
        let share = |s_m: f64| match a == b {
            true => 0.0,
            false => (s_m - piece.from_m) / long_m,
        };
        let per_m = |s_m: f64| {
            let t = share(s_m);
            chain.per_m[a] * (1.0 - t) + chain.per_m[b] * t
        };
        let by_m = to_m - self.s_m;
        let (from_share, from_m) = (share(self.s_m), self.s_m);
        let begin_per_m = per_m(from_m);
        // Integrals of the shares of both arcs from the begin of the step on.
        let weights = |into_m: f64| {
            let mean = 0.5 * (from_share + share(from_m + into_m));
            [into_m * (1.0 - mean), into_m * mean]
        };
        let mut place = Vector2::zeros();
        let mut across = Vector2::zeros();
        let mut own = [Vector2::zeros(); 2];
        for (at, weight) in GAUSS {
            let into_m = at * by_m;
            let turn = into_m * 0.5 * (begin_per_m + per_m(from_m + into_m));
            let (sin, cos) = (self.heading + turn).sin_cos();
            let left = Vector2::new(-sin, cos) * (weight * by_m);
            place += Vector2::new(cos, sin) * (weight * by_m);
            if self.turned.is_empty() {
                continue;
            }
            across += left;
            let more = weights(into_m);
            own[0] += left * more[0];
            own[1] += left * more[1];
            let turned = self.heading + turn - chain.heading_rad;
            self.stretched += left * (turned / chain.length_m);
        }
        self.place += place;
        if !self.turned.is_empty() {
            // An arc that is not begun has turned nothing.
            for (moved, turned) in self.moved.iter_mut().zip(&self.turned).take(b + 1) {
                *moved += across * *turned;
            }
            let more = weights(by_m);
            self.moved[a] += own[0];
            self.turned[a] += more[0];
            self.moved[b] += own[1];
            self.turned[b] += more[1];
        }
        self.heading += by_m * 0.5 * (begin_per_m + per_m(to_m));
        self.per_m = per_m(to_m);
        self.s_m = to_m;
    }

    fn now(&self) -> ChainPlace {
        ChainPlace {
            s_m: self.s_m,
            place: Point2::from(self.place),
            heading_rad: self.heading,
            per_m: self.per_m,
        }
    }

    fn effects(&self, chain: &ArcChain) -> Effects {
        let count = BEGIN + self.turned.len();
        let [mut x, mut y, mut heading] = [(); 3].map(|()| DVector::zeros(count));
        let way = self.place - chain.begin.coords;
        (x[0], y[1]) = (1.0, 1.0);
        (x[2], y[2], heading[2]) = (-way.y, way.x, 1.0);
        let stretch = way / chain.length_m + self.stretched;
        (x[3], y[3]) = (stretch.x, stretch.y);
        heading[3] = (self.heading - chain.heading_rad) / chain.length_m;
        for (k, (moved, turned)) in self.moved.iter().zip(&self.turned).enumerate() {
            x[BEGIN + k] = moved.x;
            y[BEGIN + k] = moved.y;
            heading[BEGIN + k] = *turned;
        }
        Effects { x, y, heading }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chain() -> ArcChain {
        ArcChain {
            begin: Point2::new(3.0, -7.0),
            heading_rad: 0.4,
            length_m: 180.0,
            middles: vec![0.0, 0.3, 0.55, 1.0],
            per_m: vec![0.0, 1.0 / 120.0, -1.0 / 300.0, 1.0 / 90.0],
        }
    }

    /// Fails where an effect is not the derivative: held against differences.
    #[test]
    fn effects_are_derivatives() {
        let at = chain();
        let shares = [0.0, 0.2, 0.47, 0.8, 1.0];
        let at_m = |chain: &ArcChain| shares.map(|share| share * chain.length_m);
        let effects = at.effects(&at_m(&at));
        for number in 0..BEGIN + at.per_m.len() {
            let step = if number < BEGIN { 1e-5 } else { 1e-8 };
            let moved = |by: f64| {
                let mut chain = at.clone();
                match number {
                    0 => chain.begin.x += by,
                    1 => chain.begin.y += by,
                    2 => chain.heading_rad += by,
                    3 => chain.length_m += by,
                    k => chain.per_m[k - BEGIN] += by,
                }
                chain.places(&at_m(&chain))
            };
            let (low, high) = (moved(-step), moved(step));
            for (k, (_, effects)) in effects.iter().enumerate() {
                let slope = (high[k].place - low[k].place) / (2.0 * step);
                let turn = (high[k].heading_rad - low[k].heading_rad) / (2.0 * step);
                let found = Vector2::new(effects.x[number], effects.y[number]);
                let scale = 1.0 + slope.norm();
                assert!((found - slope).norm() < 1e-6 * scale, "{number} {k}");
                assert!((effects.heading[number] - turn).abs() < 1e-6 * (1.0 + turn.abs()));
            }
        }
    }

    /// A quarter of a circle ends where it does.
    #[test]
    fn a_circle_is_one() {
        let quarter = ArcChain {
            begin: Point2::origin(),
            heading_rad: 0.0,
            length_m: 100.0 * std::f64::consts::FRAC_PI_2,
            middles: vec![0.0, 1.0],
            per_m: vec![0.01; 2],
        };
        let end = quarter.places(&[quarter.length_m]);
        assert!((end[0].place - Point2::new(100.0, 100.0)).norm() < 1e-8);
    }
}
