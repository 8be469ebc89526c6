//! What hangs on the walls: cables on brackets, a water main, the leaky cable of the radio, a
//! handrail, plates, boxes of emergency lights.

use super::brush::{Chance, Paint, Strip, chance};
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
    q: f64,
    up: f64,
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
        let (q, up) = outline.wall(side, height_m)?;
        Some(Self {
            q,
            up,
            radius_m: 0.5 * diameter_m,
            albedo,
        })
    }

    /// Draws it; it hangs through by `sag_m` between multiples of `pitch_m`.
    fn draw(&self, strip: &mut Strip, pitch_m: f64, sag_m: f64) {
        let Self {
            q,
            up,
            radius_m,
            albedo,
        } = *self;
        let axis = |s: f64| {
            let x = 2.0 * (s / pitch_m).rem_euclid(1.0) - 1.0;
            q - up * sag_m * (1.0 - x * x)
        };
        let within = |below: f64, half: f64| {
            move |s: f64, at: f64| {
                let off = (at - axis(s) + up * below).abs();
                ((half - off) * f64::from(TEXELS_PER_M) + 0.5).clamp(0.0, 1.0)
            }
        };
        let reach = 3.0 * radius_m + sag_m + 0.02;
        let (span, all) = (strip.span_m(), [q - reach, q + reach]);
        strip.area(
            span,
            all,
            within(1.5 * radius_m, radius_m),
            Paint::Shade(0.6),
        );
        strip.area(span, all, within(0.0, radius_m), Paint::Coat(albedo));
        strip.area(
            span,
            all,
            within(-0.45 * radius_m, 0.25 * radius_m),
            Paint::Coat(2.2 * albedo),
        );
    }
}

fn run_cables(strip: &mut Strip, outline: &Unrolled, side: Side) {
    let lowest = outline.wall(side, CABLES_M[0].0 - 0.12);
    let highest = outline.wall(side, CABLES_M[CABLES_M.len() - 1].0 + 0.1);
    if let (Some((low, up)), Some((high, _))) = (lowest, highest) {
        for k in strip.multiples(BRACKET_M, 0.1) {
            let s = f64::from(k) * BRACKET_M;
            let upright = [low.min(high), low.max(high)];
            strip.rect([s + 0.025, s + 0.06], upright, Paint::Shade(0.65));
            strip.rect([s - 0.025, s + 0.025], upright, Paint::Coat(0.36));
            strip.rect([s + 0.008, s + 0.025], upright, Paint::Coat(0.22));
            for bolt in [low + up * 0.05, high - up * 0.05] {
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
        for k in strip.multiples(BRACKET_M, 0.1) {
            let s = f64::from(k) * BRACKET_M;
            let clip = [leaky.q - 0.04, leaky.q + 0.04];
            strip.rect([s - 0.02, s + 0.02], clip, Paint::Coat(0.45));
        }
    }
    let (height, diameter, pipe_m) = MAIN_M;
    if let Some(main) = Tube::at(outline, side, (height, diameter), 0.13) {
        main.draw(strip, pipe_m, 0.0);
        let around = [main.q - 0.6 * diameter, main.q + 0.6 * diameter];
        for k in strip.multiples(0.5 * pipe_m, 0.2) {
            let s = f64::from(k) * 0.5 * pipe_m;
            // A coupling at each end, a hanger in the middle.
            let (half, albedo) = if k % 2 == 0 {
                (0.06, 0.09)
            } else {
                (0.025, 0.34)
            };
            strip.rect([s - half, s + half], around, Paint::Coat(albedo));
        }
    }
}

fn handrail(strip: &mut Strip, outline: &Unrolled, side: Side) {
    let Some(rail) = Tube::at(outline, side, HANDRAIL_M, 0.34) else {
        return;
    };
    for k in strip.multiples(1.5, 0.1) {
        let s = (f64::from(k) + 0.5) * 1.5;
        let bracket = [
            rail.q.min(rail.q - rail.up * 0.12),
            rail.q.max(rail.q - rail.up * 0.12),
        ];
        strip.rect([s - 0.02, s + 0.02], bracket, Paint::Coat(0.3));
        strip.disc([s, rail.q - rail.up * 0.12], 0.045, Paint::Coat(0.26));
    }
    rail.draw(strip, 1.5, 0.0);
}

/// Emergency lights, unlit: a box with a pale cover and a running figure's patch.
fn boxes(strip: &mut Strip, outline: &Unrolled, side: Side) {
    let Some((q, up)) = outline.wall(side, 2.70) else {
        return;
    };
    for k in strip.multiples(15.0, 15.0) {
        let s = f64::from(k) * 15.0 + 4.5;
        let range = |low: f64, high: f64| {
            let (a, b) = (q + up * low, q + up * high);
            [a.min(b), a.max(b)]
        };
        strip.rect([s - 0.19, s + 0.23], range(-0.13, 0.07), Paint::Shade(0.6));
        strip.rect([s - 0.21, s + 0.21], range(-0.09, 0.09), Paint::Coat(0.16));
        strip.rect([s - 0.19, s + 0.19], range(-0.07, 0.07), Paint::Coat(0.40));
        strip.rect([s - 0.17, s - 0.03], range(-0.05, 0.05), Paint::Coat(0.68));
        strip.rect([s + 0.04, s + 0.15], range(-0.02, 0.02), Paint::Coat(0.68));
        // Its feeder comes down from the ceiling.
        strip.rect([s - 0.012, s + 0.012], range(0.09, 0.75), Paint::Coat(0.2));
    }
}

/// Plates with a row of signs that look like digits.
fn plates(strip: &mut Strip, outline: &Unrolled, side: Side, shift_m: f64) {
    const PITCH_M: f64 = 30.0;
    let Some((q, up)) = outline.wall(side, 2.45) else {
        return;
    };
    let count = (PERIOD_M / PITCH_M) as i32;
    for k in strip.multiples(PITCH_M, PITCH_M) {
        let s = f64::from(k) * PITCH_M + shift_m;
        let range = |low: f64, high: f64| {
            let (a, b) = (q + up * low, q + up * high);
            [a.min(b), a.max(b)]
        };
        strip.rect([s - 0.34, s + 0.40], range(-0.27, 0.2), Paint::Shade(0.7));
        strip.rect([s - 0.36, s + 0.36], range(-0.22, 0.22), Paint::Coat(0.08));
        strip.rect([s - 0.34, s + 0.34], range(-0.20, 0.20), Paint::Coat(0.72));
        // Digits run to the right for whoever looks at the wall.
        let right = if side == Side::Left { 1.0 } else { -1.0 };
        for digit in 0..3 {
            let at = s + right * 0.2 * f64::from(digit - 1);
            let place = k.rem_euclid(count) + if right > 0.0 { 0 } else { 64 };
            digit_block(
                strip,
                at,
                right,
                range,
                chance(Chance::Sign, place, digit)[0],
            );
        }
    }
}

/// The seven bars of a digit: which, and where they lie in a cell of 0.13 m x 0.26 m.
fn digit_block(
    strip: &mut Strip,
    s: f64,
    right: f64,
    range: impl Fn(f64, f64) -> [f64; 2],
    which: f64,
) {
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
        let along = [s + right * from, s + right * to];
        let along = [along[0].min(along[1]), along[0].max(along[1])];
        strip.rect(along, range(low, high), Paint::Coat(0.05));
    }
}
