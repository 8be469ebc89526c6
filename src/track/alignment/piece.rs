//! A piece of the plan as a power series; `alignment.rs` says why it is one.

use super::PlanElement;
use std::f64::consts::PI;

/// Terms of the position's power series.
const TERMS: usize = 16;
/// Longest curved piece.
const PIECE_M: f64 = 25.0;
/// Most that a piece turns.
const PIECE_RAD: f64 = 0.1;
/// No element is cut into more (an arc of 1000 km would have as many).
const MOST_PIECES: f64 = 40_000.0;

/// A stretch of the plan, from `s0` to where the next begins; the first and the last one run on
/// for ever.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    pub s0: f64,
    heading0: f64,
    curvature0: f64,
    curvature_rate: f64,
    cant0: f64,
    cant_rate: f64,
    /// Position as polynomials of the distance from `s0`, lowest power first.
    x: [f64; TERMS],
    y: [f64; TERMS],
    /// How many of the terms matter within the piece: 2 where it is straight.
    terms: usize,
}

/// What a term must add, somewhere within a piece, to matter.
const MATTERS_M: f64 = 1e-15;

impl Piece {
    pub fn new(s0: f64, start: (f64, f64), heading0: f64, curvature: Linear, cant: Linear) -> Self {
        let (mut x, mut y) = ([0.0; TERMS], [0.0; TERMS]);
        (x[0], y[0]) = start;
        // (n + 1) w[n + 1] = i (curvature0 w[n] + rate w[n - 1]), position[n + 1] = w[n] / (n + 1)
        let (sin, cos) = heading0.sin_cos();
        let (mut w, mut before) = ((cos, sin), (0.0, 0.0));
        for n in 1..TERMS {
            x[n] = w.0 / n as f64;
            y[n] = w.1 / n as f64;
            let re = curvature.start * w.0 + curvature.rate * before.0;
            let im = curvature.start * w.1 + curvature.rate * before.1;
            before = w;
            w = (-im / n as f64, re / n as f64);
        }
        let matters = |n: &usize| {
            let most_m = PIECE_M.powi(*n as i32);
            x[*n].abs().max(y[*n].abs()) * most_m > MATTERS_M
        };
        let terms = (2..TERMS).rev().find(matters).map_or(2, |n| n + 1);
        Self {
            s0,
            heading0,
            curvature0: curvature.start,
            curvature_rate: curvature.rate,
            cant0: cant.start,
            cant_rate: cant.rate,
            x,
            y,
            terms,
        }
    }

    pub fn curvature(&self, ds: f64) -> f64 {
        self.curvature0 + self.curvature_rate * ds
    }

    pub fn heading(&self, ds: f64) -> f64 {
        self.heading0 + ds * (self.curvature0 + 0.5 * self.curvature_rate * ds)
    }

    pub fn cant(&self, ds: f64) -> f64 {
        self.cant0 + self.cant_rate * ds
    }

    pub fn position(&self, ds: f64) -> (f64, f64) {
        let terms = self.x[..self.terms].iter().zip(&self.y[..self.terms]);
        let terms = terms.rev();
        terms.fold((0.0, 0.0), |(x, y), (cx, cy)| (x * ds + cx, y * ds + cy))
    }

    /// The piece from here to `end_m` of a line of `length_m`, as met from its other end.
    pub fn reversed(&self, end_m: f64, length_m: f64) -> Self {
        let ds = end_m - self.s0;
        let opposite = |end: f64, rate: f64| Linear { start: -end, rate };
        Self::new(
            length_m - end_m,
            self.position(ds),
            self.heading(ds) + PI,
            opposite(self.curvature(ds), self.curvature_rate),
            opposite(self.cant(ds), self.cant_rate),
        )
    }

    /// The piece that begins `ds` further.
    pub fn next(&self, ds: f64, curvature: Linear, cant: Linear) -> Self {
        let (s0, heading0) = (self.s0 + ds, self.heading(ds));
        Self::new(s0, self.position(ds), heading0, curvature, cant)
    }
}

/// A number that changes linearly along the line.
#[derive(Clone, Copy)]
pub(super) struct Linear {
    start: f64,
    rate: f64,
}

impl Linear {
    pub fn constant(start: f64) -> Self {
        Self { start, rate: 0.0 }
    }

    /// From `start` to `end` over a length, looked at from `into` on.
    pub fn between(start: f64, end: f64, length_m: f64, into_m: f64) -> Self {
        let rate = (end - start) / length_m;
        Self {
            start: start + rate * into_m,
            rate,
        }
    }
}

/// How many pieces an element needs.
pub(super) fn pieces(e: &PlanElement) -> f64 {
    let sharpest = e.start_per_m.abs().max(e.end_per_m.abs());
    if sharpest > 0.0 {
        let by_turn = sharpest * e.length_m / PIECE_RAD;
        let by_length = e.length_m / PIECE_M;
        by_turn.max(by_length).ceil().clamp(1.0, MOST_PIECES)
    } else {
        1.0
    }
}
