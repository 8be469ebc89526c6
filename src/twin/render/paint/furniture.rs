//! What hangs on the walls: cables on brackets, a water main, the leaky cable of the radio, a
//! handrail, plates, boxes of emergency lights.

use super::brush::{Anchor, Chance, Paint, Strip, about, chance};
use super::unroll::Unrolled;
use super::{PERIOD_M, TEXELS_PER_M};
use crate::track::{Material, Side, WALKWAY_HEIGHT_M};

/// From bracket to bracket of the cables.
const BRACKET_M: f64 = 1.0;
/// Cables: height over top of rail and diameter; power below, signals and telephones above.
const CABLES_M: [(f64, f64); 9] = [
    (0.62, 0.065),
    (0.72, 0.065),
    (0.95, 0.065),
    (1.05, 0.065),
    (1.28, 0.05),
    (1.62, 0.04),
    (1.68, 0.04),
    (1.84, 0.032),
    (1.89, 0.032),
];
/// How far a cable hangs through between brackets.
const SAG_M: f64 = 0.018;
/// Radiating cable.
const LEAKY_M: (f64, f64) = (2.75, 0.045);
/// Water main: height, diameter, length of its pipes.
const MAIN_M: (f64, f64, f64) = (0.22, 0.16, 6.0);
/// Handrail above the walkway.
const HANDRAIL_M: (f64, f64) = (WALKWAY_HEIGHT_M + 1.05, 0.042);

pub(super) fn paint(strip: &mut Strip, outline: &Unrolled) {
    let walkway = outline.side_of(Material::Walkway);
    let platform = outline.side_of(Material::Platform);
    let cables = match walkway.or(platform) {
        Some(Side::Right) => Side::Left,
        _ => Side::Right,
    };
    run_cables(strip, outline, cables);
    if let Some(side) = walkway {
        handrail(strip, outline, side);
        boxes(strip, outline, side);
    }
    // Plates face whoever walks; drivers read the other side's.
    for (side, shift) in [(Side::Left, 11.25), (Side::Right, 26.25)] {
        if platform != Some(side) {
            plates(strip, outline, side, shift);
        }
    }
}

/// A stroke along the line: body, light on its upper side, shade under it.
struct Tube {
    up: Anchor,
    radius_m: f64,
    albedo: f32,
}

impl Tube {
    fn at(
        outline: &Unrolled,
        side: Side,
        (height_m, diameter_m): (f64, f64),
        albedo: f32,
    ) -> Option<Self> {
        Some(Self {
            up: outline.wall(side, height_m)?,
            radius_m: 0.5 * diameter_m,
            albedo,
        })
    }

    /// Draws it; it hangs through by `sag_m` between multiples of `pitch_m`.
    fn draw(&self, strip: &mut Strip, pitch_m: f64, sag_m: f64) {
        let (radius_m, albedo) = (self.radius_m, self.albedo);
        let Anchor { q, sense } = self.up;
        let axis = |s: f64| {
            let x = 2.0 * (s / pitch_m).rem_euclid(1.0) - 1.0;
            q - sense * sag_m * (1.0 - x * x)
        };
        let (span, all) = (strip.span_m(), about(q, 3.0 * radius_m + sag_m + 0.02));
        for (below, half, paint) in [
            (1.5 * radius_m, radius_m, Paint::Shade(0.6)),
            (0.0, radius_m, Paint::Coat(albedo)),
            (-0.45 * radius_m, 0.25 * radius_m, Paint::Coat(2.2 * albedo)),
        ] {
            let within = |s: f64, at: f64| {
                let off = (at - axis(s) + sense * below).abs();
                ((half - off) * f64::from(TEXELS_PER_M) + 0.5).clamp(0.0, 1.0)
            };
            strip.area(span, all, within, paint);
        }
    }
}

fn run_cables(strip: &mut Strip, outline: &Unrolled, side: Side) {
    let lowest = outline.wall(side, CABLES_M[0].0 - 0.12);
    let highest = outline.wall(side, CABLES_M[CABLES_M.len() - 1].0 + 0.1);
    if let (Some(low), Some(high)) = (lowest, highest) {
        for (_, s) in strip.multiples(BRACKET_M, 0.1) {
            let upright = [low.q.min(high.q), low.q.max(high.q)];
            strip.rect([s + 0.025, s + 0.06], upright, Paint::Shade(0.65));
            strip.rect(about(s, 0.025), upright, Paint::Coat(0.36));
            strip.rect([s + 0.008, s + 0.025], upright, Paint::Coat(0.22));
            for bolt in [low.at(0.05), high.at(-0.05)] {
                strip.disc([s, bolt], 0.016, Paint::Coat(0.10));
            }
        }
    }
    for (k, cable) in CABLES_M.into_iter().enumerate() {
        let albedo = if k % 3 == 2 { 0.10 } else { 0.06 };
        if let Some(tube) = Tube::at(outline, side, cable, albedo) {
            tube.draw(strip, BRACKET_M, SAG_M);
        }
    }
    if let Some(leaky) = Tube::at(outline, side, LEAKY_M, 0.07) {
        leaky.draw(strip, BRACKET_M, 0.0);
        for (_, s) in strip.multiples(BRACKET_M, 0.1) {
            strip.rect(about(s, 0.02), about(leaky.up.q, 0.04), Paint::Coat(0.45));
        }
    }
    let (height, diameter, pipe_m) = MAIN_M;
    if let Some(main) = Tube::at(outline, side, (height, diameter), 0.13) {
        main.draw(strip, pipe_m, 0.0);
        for (k, s) in strip.multiples(0.5 * pipe_m, 0.2) {
            // A coupling at each end, a hanger in the middle.
            let (half, albedo) = if k % 2 == 0 {
                (0.06, 0.09)
            } else {
                (0.025, 0.34)
            };
            let around = about(main.up.q, 0.6 * diameter);
            strip.rect(about(s, half), around, Paint::Coat(albedo));
        }
    }
}

fn handrail(strip: &mut Strip, outline: &Unrolled, side: Side) {
    let Some(rail) = Tube::at(outline, side, HANDRAIL_M, 0.34) else {
        return;
    };
    for (k, _) in strip.multiples(1.5, 0.1) {
        let s = (f64::from(k) + 0.5) * 1.5;
        strip.rect(about(s, 0.02), rail.up.band(-0.12, 0.0), Paint::Coat(0.3));
        strip.disc([s, rail.up.at(-0.12)], 0.045, Paint::Coat(0.26));
    }
    rail.draw(strip, 1.5, 0.0);
}

/// Emergency lights, unlit: a box with a pale cover and a running figure's patch.
fn boxes(strip: &mut Strip, outline: &Unrolled, side: Side) {
    const PARTS: [([f64; 2], [f64; 2], Paint); 6] = [
        ([-0.19, 0.23], [-0.13, 0.07], Paint::Shade(0.6)),
        ([-0.21, 0.21], [-0.09, 0.09], Paint::Coat(0.16)),
        ([-0.19, 0.19], [-0.07, 0.07], Paint::Coat(0.40)),
        ([-0.17, -0.03], [-0.05, 0.05], Paint::Coat(0.68)),
        ([0.04, 0.15], [-0.02, 0.02], Paint::Coat(0.68)),
        // Its feeder comes down from the ceiling.
        ([-0.012, 0.012], [0.09, 0.75], Paint::Coat(0.2)),
    ];
    if let Some(up) = outline.wall(side, 2.70) {
        for (_, s) in strip.multiples(15.0, 15.0) {
            strip.stamp(s + 4.5, up, &PARTS);
        }
    }
}

/// Plates with a row of signs that look like digits.
fn plates(strip: &mut Strip, outline: &Unrolled, side: Side, shift_m: f64) {
    const PITCH_M: f64 = 30.0;
    const PARTS: [([f64; 2], [f64; 2], Paint); 3] = [
        ([-0.34, 0.40], [-0.27, 0.2], Paint::Shade(0.7)),
        ([-0.36, 0.36], [-0.22, 0.22], Paint::Coat(0.08)),
        ([-0.34, 0.34], [-0.20, 0.20], Paint::Coat(0.72)),
    ];
    let Some(up) = outline.wall(side, 2.45) else {
        return;
    };
    // Digits run to the right for whoever looks at the wall.
    let (right, own) = match side {
        Side::Left => (1.0, 0),
        Side::Right => (-1.0, 64),
    };
    let count = (PERIOD_M / PITCH_M) as i32;
    for (k, s) in strip.multiples(PITCH_M, PITCH_M) {
        let s = s + shift_m;
        strip.stamp(s, up, &PARTS);
        for digit in 0..3 {
            let [which, ..] = chance(Chance::Sign, k.rem_euclid(count) + own, digit);
            let at = s + right * 0.2 * f64::from(digit - 1);
            digit_block(
                strip,
                Anchor {
                    q: at,
                    sense: right,
                },
                up,
                which,
            );
        }
    }
}

/// The seven bars of a digit: which, and where they lie in a cell of 0.13 m x 0.26 m.
fn digit_block(strip: &mut Strip, right: Anchor, up: Anchor, which: f64) {
    const BARS: [u8; 10] = [0x77, 0x24, 0x5d, 0x6d, 0x2e, 0x6b, 0x7b, 0x25, 0x7f, 0x6f];
    const LIE: [[f64; 4]; 7] = [
        [-0.065, 0.065, 0.10, 0.13],
        [-0.065, -0.035, 0.0, 0.13],
        [0.035, 0.065, 0.0, 0.13],
        [-0.065, 0.065, -0.015, 0.015],
        [-0.065, -0.035, -0.13, 0.0],
        [0.035, 0.065, -0.13, 0.0],
        [-0.065, 0.065, -0.13, -0.10],
    ];
    let digit = BARS[(which * 10.0) as usize % 10];
    for (_, [from, to, low, high]) in (0..).zip(LIE).filter(|(k, _)| digit >> k & 1 == 1) {
        strip.rect(right.band(from, to), up.band(low, high), Paint::Coat(0.05));
    }
}
