//! A piece of the plan as a power series; `alignment.rs` says why it is one.

use super::PlanElement;
use nalgebra::Vector2;
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
pub(super) struct PlanPiece {
    pub s0: f64,
    heading0: f64,
    /// Both by the distance from `s0`, like the position.
    pub curvature: LinearChange,
    pub cant: LinearChange,
    /// Position as a polynomial, x and y, lowest power first.
    position: [Vector2<f64>; TERMS],
    /// How many of the terms matter within the piece: 2 where it is straight.
    terms: usize,
}

/// What a term must add, somewhere within a piece, to matter.
const MATTERS_M: f64 = 1e-15;

impl PlanPiece {
    pub fn new(
        s0: f64,
        start: Vector2<f64>,
        heading0: f64,
        curvature: LinearChange,
        cant: LinearChange,
    ) -> Self {
        let mut position = [start; TERMS];
        // (n + 1) w[n + 1] = i (curvature w[n] + rate w[n - 1]), position[n + 1] = w[n] / (n + 1)
        let (sin, cos) = heading0.sin_cos();
        let (mut w, mut before) = (Vector2::new(cos, sin), Vector2::zeros());
        for (n, term) in position.iter_mut().enumerate().skip(1) {
            *term = w / n as f64;
            let turned = w * curvature.start + before * curvature.rate;
            before = w;
            w = Vector2::new(-turned.y, turned.x) / n as f64;
        }
        let matters = |n: &usize| position[*n].amax() * PIECE_M.powi(*n as i32) > MATTERS_M;
        let terms = (2..TERMS).rev().find(matters).map_or(2, |n| n + 1);
        Self {
            s0,
            heading0,
            curvature,
            cant,
            position,
            terms,
        }
    }

    pub fn heading(&self, ds: f64) -> f64 {
        self.heading0 + ds * (self.curvature.start + 0.5 * self.curvature.rate * ds)
    }

    pub fn position(&self, ds: f64) -> Vector2<f64> {
        let terms = self.position[..self.terms].iter().rev();
        terms.fold(Vector2::zeros(), |p, term| p * ds + term)
    }

    /// The piece from here to `end_m` of a line of `length_m`, as met from its other end.
    pub fn reversed(&self, end_m: f64, length_m: f64) -> Self {
        let ds = end_m - self.s0;
        let opposite = |change: LinearChange| LinearChange {
            start: -change.at(ds),
            rate: change.rate,
        };
        Self::new(
            length_m - end_m,
            self.position(ds),
            self.heading(ds) + PI,
            opposite(self.curvature),
            opposite(self.cant),
        )
    }

    /// The same with more chainage.
    pub fn shifted(&self, more_m: f64) -> Self {
        Self {
            s0: self.s0 + more_m,
            ..*self
        }
    }

    /// What is left of the piece from `from_m` on, where chainage is 0 then.
    pub fn from(&self, from_m: f64) -> Self {
        let ds = from_m - self.s0;
        if ds <= 0.0 {
            return Self { s0: -ds, ..*self };
        }
        let rest = |change: LinearChange| LinearChange {
            start: change.at(ds),
            rate: change.rate,
        };
        let mut rest = self.next(ds, rest(self.curvature), rest(self.cant));
        rest.s0 = 0.0;
        rest
    }

    /// The piece that begins `ds` further.
    pub fn next(&self, ds: f64, curvature: LinearChange, cant: LinearChange) -> Self {
        let (s0, heading0) = (self.s0 + ds, self.heading(ds));
        Self::new(s0, self.position(ds), heading0, curvature, cant)
    }
}

/// A number that changes linearly along the line.
#[derive(Clone, Copy, Debug)]
pub(super) struct LinearChange {
    pub start: f64,
    pub rate: f64,
}

impl LinearChange {
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

    pub fn at(&self, ds: f64) -> f64 {
        self.start + self.rate * ds
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
