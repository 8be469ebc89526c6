//! Paint on a strip of the image: even coats and shades with soft edges, and noise that wraps.

use super::{PERIOD_M, TEXELS_PER_M};
use crate::twin::random::pcg4d;

const PER_M: f64 = TEXELS_PER_M as f64;

/// Metres along the line, from and to.
pub(super) type Along = [f64; 2];
/// Metres along the outline, from and to.
pub(super) type Up = [f64; 2];

/// So far to either side of a place.
pub(super) fn about(place: f64, half: f64) -> [f64; 2] {
    [place - half, place + half]
}

/// A place on the outline, and which way along it is counted from there (1 or -1).
#[derive(Clone, Copy, Debug)]
pub(super) struct Anchor {
    pub q: f64,
    pub sense: f64,
}

impl Anchor {
    /// What is so far away.
    pub fn at(&self, away: f64) -> f64 {
        self.q + self.sense * away
    }

    /// What lies between two distances.
    pub fn band(&self, from: f64, to: f64) -> Up {
        let (a, b) = (self.at(from), self.at(to));
        [a.min(b), a.max(b)]
    }
}

/// What a stroke does to what is under it.
#[derive(Clone, Copy, Debug)]
pub(super) enum Paint {
    /// Covers it by this albedo.
    Coat(f32),
    /// Multiplies its albedo.
    Shade(f32),
}

impl Paint {
    fn over(self, albedo: f32, cover: f32) -> f32 {
        match self {
            Self::Coat(own) => albedo + cover * (own - albedo),
            Self::Shade(factor) => albedo * (1.0 + cover * (factor - 1.0)),
        }
    }
}

/// Some columns of the image over its whole height, row by row.
pub(super) struct Strip {
    /// Of the image.
    pub first_column: usize,
    pub columns: usize,
    pub albedo: Vec<f32>,
}

impl Strip {
    pub fn new(first_column: usize, columns: usize, rows: usize) -> Self {
        Self {
            first_column,
            columns,
            albedo: vec![0.0; columns * rows],
        }
    }

    pub fn row(&mut self, y: usize) -> &mut [f32] {
        &mut self.albedo[y * self.columns..][..self.columns]
    }

    /// Metres of chainage that it spans.
    pub fn span_m(&self) -> Along {
        [0, self.columns].map(|k| (self.first_column + k) as f64 / PER_M)
    }

    /// Multiples of a pitch within some length of the strip, each with its number. Before the image's
    /// begin they are negative and behind its end they run on, where the image wraps.
    pub fn multiples(
        &self,
        pitch_m: f64,
        length_m: f64,
    ) -> impl Iterator<Item = (i32, f64)> + use<> {
        let [from, to] = self.span_m();
        let first = ((from - length_m) / pitch_m).ceil() as i32;
        let last = ((to + length_m) / pitch_m).floor() as i32;
        (first..=last).map(move |k| (k, f64::from(k) * pitch_m))
    }

    /// An upright rectangle.
    pub fn rect(&mut self, s: Along, q: Up, paint: Paint) {
        self.area(s, q, |_, _| 1.0, paint);
    }

    /// Upright rectangles around a place, in the order of painting: along the line, along the outline.
    pub fn stamp(&mut self, s: f64, anchor: Anchor, parts: &[([f64; 2], [f64; 2], Paint)]) {
        for ([from, to], [low, high], paint) in parts {
            self.rect([s + from, s + to], anchor.band(*low, *high), *paint);
        }
    }

    /// A disc.
    pub fn disc(&mut self, centre: [f64; 2], radius_m: f64, paint: Paint) {
        let reach = radius_m + 1.0 / PER_M;
        let inside = |s: f64, q: f64| {
            let away = (s - centre[0]).hypot(q - centre[1]);
            ((radius_m - away) * PER_M + 0.5).clamp(0.0, 1.0)
        };
        self.area(
            about(centre[0], reach),
            about(centre[1], reach),
            inside,
            paint,
        );
    }

    /// A rectangle with its own cover at each place.
    pub fn area(&mut self, s: Along, q: Up, cover: impl Fn(f64, f64) -> f64, paint: Paint) {
        let rows = self.albedo.len() / self.columns;
        let x = s.map(|s| s * PER_M - self.first_column as f64);
        let y = q.map(|q| q * PER_M);
        for row in texels(y, rows) {
            let down = overlap(row, y);
            let at_q = (row as f64 + 0.5) / PER_M;
            for column in texels(x, self.columns) {
                let at_s = ((self.first_column + column) as f64 + 0.5) / PER_M;
                let share = overlap(column, x) * down * cover(at_s, at_q);
                let albedo = &mut self.albedo[row * self.columns + column];
                *albedo = paint.over(*albedo, share as f32);
            }
        }
    }
}

/// Texels that a range touches.
fn texels(range: [f64; 2], count: usize) -> std::ops::Range<usize> {
    let begin = range[0].floor().max(0.0) as usize;
    let end = (range[1].ceil().max(0.0) as usize).min(count);
    begin.min(end)..end
}

/// Share of a texel that a range covers.
fn overlap(texel: usize, range: [f64; 2]) -> f64 {
    let at = texel as f64;
    ((at + 1.0).min(range[1]) - at.max(range[0])).clamp(0.0, 1.0)
}

/// What a hash is for, so that no two things share their chance.
#[derive(Clone, Copy, Debug)]
pub(super) enum Chance {
    Tone = 1,
    Noise,
    Grain,
    Joint,
    Leak,
    Plug,
    Sign,
    Tile,
    Puddle,
}

/// Four numbers from 0 to 1 for a thing.
pub(super) fn chance(of: Chance, i: i32, j: i32) -> [f64; 4] {
    pcg4d([i as u32, j as u32, of as u32, 0x7061_696e]).map(|x| f64::from(x) / 4_294_967_296.0)
}

/// Value noise from 0 to 1 on a lattice, smooth between its points.
pub(super) struct ValueNoise {
    cell: [usize; 2],
    lattice_columns: usize,
    lattice: Vec<f32>,
    /// Smoothstep at the texels of a cell, both ways.
    ease: [Vec<f32>; 2],
}

impl ValueNoise {
    /// With cells of so many texels (which divide strip and period), under a strip.
    pub fn under(strip: &Strip, cell: [usize; 2], kind: i32) -> Self {
        let lattice_columns = strip.columns / cell[0] + 1;
        let lattice_rows = strip.albedo.len() / strip.columns / cell[1] + 2;
        let period = (PERIOD_M * PER_M) as usize / cell[0];
        let first = strip.first_column / cell[0];
        let lattice = (0..lattice_columns * lattice_rows).map(|k| {
            let column = (first + k % lattice_columns) % period;
            let place = (column * 65_536 + k / lattice_columns) as i32;
            chance(Chance::Noise, place, kind)[0] as f32
        });
        let ease = cell.map(|size| {
            let smooth = move |k: usize| {
                let at = (k as f32 + 0.5) / size as f32;
                at * at * (3.0 - 2.0 * at)
            };
            (0..size).map(smooth).collect()
        });
        Self {
            cell,
            lattice_columns,
            lattice: lattice.collect(),
            ease,
        }
    }

    /// At a texel of the strip.
    pub fn at(&self, x: usize, y: usize) -> f32 {
        let (i, j) = (x / self.cell[0], y / self.cell[1]);
        let (a, b) = (
            self.ease[0][x % self.cell[0]],
            self.ease[1][y % self.cell[1]],
        );
        let near = &self.lattice[j * self.lattice_columns + i..][..2];
        let far = &self.lattice[(j + 1) * self.lattice_columns + i..][..2];
        let near = near[0] + a * (near[1] - near[0]);
        let far = far[0] + a * (far[1] - far[0]);
        near + b * (far - near)
    }
}
