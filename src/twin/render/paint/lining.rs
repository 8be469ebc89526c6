//! Concrete of the walls: rings of segments, or blocks cast in formwork; joints, bolts, leaks.

use super::RING_M;
use super::brush::{Anchor, Chance, Paint, Strip, about, chance};
use super::unroll::{Circle, OutlinePlace, Unrolled};
use crate::track::Material;
use std::f64::consts::TAU;

/// Bare concrete between the joints.
const CONCRETE_ALBEDO: f64 = 0.33;
/// Joints between segments of a ring, counted from the middle of its key.
const JOINTS_DEG: [f64; 6] = [-146.25, -78.75, -10.75, 10.75, 78.75, 146.25];
/// Middles of the segments.
const MIDDLES_DEG: [f64; 6] = [180.0, -112.5, -44.75, 0.0, 44.75, 112.5];
/// Between bolts from ring to ring.
const BOLTS_DEG: f64 = 36.0;
/// Half the width of a joint's open groove.
const GROOVE_HALF_M: f64 = 0.006;
/// The same with the bevelled edges beside it, which catch light and chip.
const BEVEL_HALF_M: f64 = GROOVE_HALF_M + 0.016;
const GROOVE: Paint = Paint::Coat(0.05);
const BEVEL: Paint = Paint::Shade(1.14);
/// A block of cast lining, and the height of its formwork's panels.
const BLOCK_RINGS: i32 = 8;
const PANEL_M: f64 = 1.2;
/// Rings in the image.
const RINGS: i32 = (super::PERIOD_M / RING_M) as i32;

/// Albedo of the bare concrete at a place of a ring.
pub(super) fn tone(ring: i32, outline: &Unrolled, place: &OutlinePlace) -> f64 {
    let (l, h) = (place.at.l_m, place.at.h_m);
    let piece = match &outline.circle {
        Some(circle) => {
            let angle = (l - circle.centre.l_m).atan2(h - circle.centre.h_m) - key_rad(ring);
            let turned = (angle.to_degrees() + 180.0).rem_euclid(360.0) - 180.0;
            JOINTS_DEG.partition_point(|j| *j < turned) as i32 % 6
        }
        None => (h / PANEL_M).floor() as i32 * 2 + i32::from(l > 0.0) + 16,
    };
    let own = chance(Chance::Tone, ring, piece);
    let whole = chance(Chance::Tone, ring, -1);
    // Brake dust lies thickest near the track.
    let dust = 1.0 - 0.22 * (-(h - crate::track::BED_M).max(0.0) / 0.9).exp();
    CONCRETE_ALBEDO * dust * (1.0 + 0.20 * (own[0] - 0.5) + 0.12 * (whole[0] - 0.5))
}

/// Where the key of a ring is, from the crown to the left.
fn key_rad(ring: i32) -> f64 {
    let side = if ring % 2 == 0 { 0.5 } else { -0.5 };
    // Here and there a ring is turned by a bolt more, to steer.
    let turned = if chance(Chance::Joint, ring, -1)[0] < 0.2 {
        3.0
    } else {
        1.0
    };
    (side * turned * BOLTS_DEG).to_radians()
}

pub(super) fn paint(strip: &mut Strip, outline: &Unrolled) {
    match outline.circle {
        Some(circle) => rings(strip, outline, &circle),
        None => blocks(strip, outline),
    }
    leaks(strip, outline);
}

fn rings(strip: &mut Strip, outline: &Unrolled, circle: &Circle) {
    for (k, from_m) in strip.multiples(RING_M, RING_M) {
        let ring = k.rem_euclid(RINGS);
        let key = key_rad(ring);
        let at = |deg: f64| outline.at_angle(circle, key + deg.to_radians());
        for q in JOINTS_DEG.iter().filter_map(|deg| at(*deg)) {
            let along = [from_m, from_m + RING_M];
            strip.rect(along, about(q, BEVEL_HALF_M), BEVEL);
            strip.rect(along, about(q, GROOVE_HALF_M), GROOVE);
            for s in [0.25, 0.75].map(|share| from_m + share * RING_M) {
                for side in [-0.17, 0.17] {
                    pocket(strip, outline, [s, q + side], [0.11, 0.20]);
                }
            }
        }
        for (segment, deg) in (0..).zip(MIDDLES_DEG) {
            if let Some(q) = at(deg) {
                plug(strip, [from_m + 0.5 * RING_M, q], ring, segment);
            }
        }
        ring_joint(strip, outline, from_m, ring);
        for bolt in 0..10 {
            let angle = TAU * (f64::from(bolt) + 0.5) / 10.0;
            if let Some(q) = outline.at_angle(circle, angle) {
                for side in [-0.18, 0.18] {
                    pocket(strip, outline, [from_m + side, q], [0.20, 0.11]);
                }
            }
        }
    }
}

/// A joint around the lining, with the chips of its edges.
fn ring_joint(strip: &mut Strip, outline: &Unrolled, s: f64, ring: i32) {
    for (stretch, q) in (0..).zip(outline.stretches(Material::Lining)) {
        strip.rect(about(s, BEVEL_HALF_M), q, BEVEL);
        strip.rect(about(s, GROOVE_HALF_M), q, GROOVE);
        for chip in 0..6 {
            let [place, size, side, fresh] = chance(Chance::Joint, ring, 16 * stretch + chip);
            let q = q[0] + place * (q[1] - q[0]);
            let s = s + if side < 0.5 { -0.02 } else { 0.02 };
            let paint = Paint::Coat(if fresh < 0.6 { 0.42 } else { 0.12 });
            strip.disc([s, q], 0.008 + 0.022 * size * size, paint);
        }
    }
}

/// The recess of a bolt: its roof in shade, its sill in light, the nut in it.
fn pocket(strip: &mut Strip, outline: &Unrolled, [s, q]: [f64; 2], size: [f64; 2]) {
    let (half_s, half_q) = (0.5 * size[0], 0.5 * size[1]);
    let Some(up) = outline.up_at(q) else { return };
    let (sill, roof) = (up.at(-half_q), up.at(half_q));
    let (from_sill, from_roof) = (Anchor { q: sill, ..up }, Anchor { q: roof, ..up });
    let along = about(s, half_s);
    strip.rect(along, up.band(-half_q, half_q), Paint::Shade(0.5));
    strip.rect(along, from_roof.band(-0.4 * half_q, 0.0), Paint::Shade(0.5));
    strip.rect(along, from_sill.band(-0.018, 0.0), Paint::Shade(1.2));
    strip.disc([s, up.at(-0.01)], 0.026, Paint::Coat(0.11));
    strip.disc([s - 0.006, up.at(0.002)], 0.010, Paint::Coat(0.24));
}

/// The hole in the middle of a segment for grout and for lifting it.
fn plug(strip: &mut Strip, at: [f64; 2], ring: i32, segment: i32) {
    let [wet, ..] = chance(Chance::Plug, ring, segment);
    strip.disc(at, 0.055, Paint::Shade(0.78));
    strip.disc(at, 0.038, Paint::Coat(if wet < 0.3 { 0.36 } else { 0.13 }));
    strip.disc(at, 0.016, Paint::Coat(0.08));
}

fn blocks(strip: &mut Strip, outline: &Unrolled) {
    for q in outline.stretches(Material::Lining) {
        for (k, s) in strip.multiples(RING_M, 0.1) {
            strip.rect(about(s, 0.004), q, Paint::Shade(0.55));
            if k.rem_euclid(BLOCK_RINGS) == 0 {
                strip.rect(about(s, 0.03), q, Paint::Shade(1.15));
                strip.rect(about(s, 0.01), q, GROOVE);
            }
        }
        let panels = ((q[1] - q[0]) / PANEL_M).ceil() as i32;
        for panel in 0..panels {
            let seam = q[0] + f64::from(panel) * PANEL_M;
            strip.rect(strip.span_m(), about(seam, 0.004), Paint::Shade(0.6));
            for (k, _) in strip.multiples(0.75, 0.1) {
                let s = (f64::from(k) + 0.5) * 0.75;
                for hole in [0.25, 0.75].map(|share| seam + share * PANEL_M) {
                    if hole < q[1] {
                        strip.disc([s, hole], 0.016, Paint::Shade(0.4));
                    }
                }
            }
        }
    }
}

/// Where water came through a joint and ran down.
struct Leak {
    s: f64,
    from: Anchor,
    length_m: f64,
    half_m: f64,
    /// How much lime it left, from 0 to 1.
    lime: f64,
}

fn leaks(strip: &mut Strip, outline: &Unrolled) {
    const REACH_M: f64 = 0.6;
    for (stretch, range) in (0..).zip(outline.stretches(Material::Lining)) {
        for (k, joint_m) in strip.multiples(RING_M, REACH_M) {
            for which in (0..4).map(|one| 8 * stretch + one) {
                let ring = k.rem_euclid(RINGS);
                let [luck, place, length, width] = chance(Chance::Leak, ring, which);
                let q = range[0] + place * (range[1] - range[0]);
                // Under the crown water drips.
                let runs = |q: f64| outline.at(q).is_some_and(|place| place.upright > 0.4);
                if luck > 0.22 || !runs(q) {
                    continue;
                }
                let Some(from) = outline.up_at(q) else {
                    continue;
                };
                let [lime, shift, ..] = chance(Chance::Leak, ring, which + 4096);
                let beside_m = if lime < 0.5 {
                    0.0
                } else {
                    RING_M * (shift - 0.5) * 0.6
                };
                let leak = Leak {
                    s: joint_m + beside_m,
                    from,
                    length_m: 0.4 + 2.0 * length,
                    half_m: 0.05 + 0.18 * width,
                    lime,
                };
                leak.paint(strip, range);
            }
        }
    }
}

impl Leak {
    /// Dark where it is wet, pale where lime stayed.
    fn paint(&self, strip: &mut Strip, range: [f64; 2]) {
        let Self { s, lime, .. } = *self;
        let [low, high] = self.from.band(-self.length_m, 0.0);
        let down = [low.max(range[0]), high.min(range[1])];
        let along = about(s, 2.0 * self.half_m);
        let wet = |at_s: f64, at_q: f64| {
            let (off, strength) = self.profile(at_s, at_q);
            strength.sqrt() * (1.0 - off * off).clamp(0.0, 1.0)
        };
        let pale = |at_s: f64, at_q: f64| {
            let (off, strength) = self.profile(at_s, at_q);
            let rim = (off.abs() - 0.8) / 0.35;
            strength * (1.0 - rim * rim).clamp(0.0, 1.0)
        };
        let dark = Paint::Shade(if lime < 0.65 { 0.5 } else { 0.72 });
        strip.area(along, down, wet, dark);
        strip.area(along, down, pale, Paint::Coat(0.30 + 0.25 * lime as f32));
    }

    /// How far aside of its middle a place is, in half widths, and how strong it is there.
    fn profile(&self, at_s: f64, at_q: f64) -> (f64, f64) {
        let Anchor { q, sense } = self.from;
        let depth = ((q - at_q) * sense / self.length_m).clamp(0.0, 1.0);
        let sway = 0.25 * self.half_m * (9.0 * depth + 40.0 * self.lime).sin();
        // It widens from its source and thins out at its end.
        let half = self.half_m * (0.35 + 0.65 * (3.0 * depth).min(1.0));
        let off = (at_s - self.s - sway) / half;
        (off, (1.0 - depth) * (20.0 * depth).min(1.0))
    }
}
