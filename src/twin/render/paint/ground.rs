//! Floors: track bed with sleepers and fasteners, walkway, platform; and the rails.

use super::brush::{Anchor, Chance, Paint, Strip, about, chance};
use super::unroll::{OutlinePlace, Unrolled};
use super::{PERIOD_M, TEXELS_PER_M};
use crate::track::{Material, RAIL_OFFSET_M};

/// Bed between the sleepers.
pub(super) const BED_ALBEDO: f64 = 0.20;
/// From sleeper to sleeper, half a sleeper along and across the line, and how much lighter it is.
const SLEEPER_M: f64 = 0.6;
const SLEEPER_HALF_M: [f64; 2] = [0.13, 1.25];
const SLEEPER: Paint = Paint::Shade(1.6);
/// From joint to joint of the track slab; joints lie midway between sleepers.
const SLAB_M: f64 = 6.0;
/// Half a fastener's baseplate along and across the line.
const PLATE_HALF_M: [f64; 2] = [0.085, 0.185];
/// Side of a platform's tiles.
const TILE_M: f64 = 0.6;
/// From stripe to stripe along a walkway's edge, and how far they reach on both its faces.
const STRIPE_M: f64 = 0.3;
const STRIPED_M: f64 = 0.1;

/// The top of a walkway is trodden clean, its face is dusty.
pub(super) fn walkway_tone(place: &OutlinePlace) -> f64 {
    if place.upright > 0.5 { 0.29 } else { 0.39 }
}

/// So are a platform's.
pub(super) fn platform_tone(place: &OutlinePlace) -> f64 {
    if place.upright > 0.5 { 0.30 } else { 0.55 }
}

/// Rust on a rail's sides, worn steel on its head, brightest where wheels run.
pub(super) fn rail_tone(place: &OutlinePlace) -> f64 {
    const BAND_HALF_M: f64 = 0.025;
    match (place.upright > 0.5, place.at.l_m.abs() < BAND_HALF_M) {
        (true, _) => 0.24,
        (false, false) => 0.36,
        (false, true) => 0.62,
    }
}

pub(super) fn paint(strip: &mut Strip, outline: &Unrolled) {
    for q in outline.stretches(Material::Bed) {
        bed(strip, outline, q);
    }
    for edge in outline.ledges(Material::Walkway) {
        stripes(strip, edge.q);
        walkway(strip, outline, edge);
    }
    for edge in outline.ledges(Material::Platform) {
        platform(strip, outline, edge);
    }
}

fn bed(strip: &mut Strip, outline: &Unrolled, q: [f64; 2]) {
    let span = strip.span_m();
    let across = |half_m: f64| {
        let a = outline.floor(Material::Bed, -half_m)?;
        let b = outline.floor(Material::Bed, half_m)?;
        Some([a.min(b), a.max(b)])
    };
    if let Some(width) = across(SLEEPER_HALF_M[1]) {
        let half = SLEEPER_HALF_M[0];
        for (_, s) in strip.multiples(SLEEPER_M, half) {
            let edges = [s - half - 0.008, s + half + 0.008];
            strip.rect(edges, width, Paint::Shade(0.7));
            strip.rect(about(s, half), width, Paint::Shade(1.0 / 0.7));
            strip.rect(about(s, half), width, SLEEPER);
        }
    }
    for (_, s) in strip.multiples(SLAB_M, SLEEPER_M) {
        let joint = about(s + 0.5 * SLEEPER_M, 0.012);
        strip.rect(joint, q, Paint::Coat(0.05));
    }
    // Oil between the rails, rust and metal dust beside them.
    if let Some(oiled) = across(0.3) {
        let middle = 0.5 * (oiled[0] + oiled[1]);
        let fade = |_: f64, at: f64| 1.0 - ((at - middle) / 0.3).powi(2);
        strip.area(span, oiled, fade, Paint::Shade(0.78));
    }
    let rails = [RAIL_OFFSET_M, -RAIL_OFFSET_M];
    for middle in rails
        .map(|l| outline.floor(Material::Bed, l))
        .into_iter()
        .flatten()
    {
        let fade = |_: f64, at: f64| (1.0 - ((at - middle) / 0.35).powi(2)).max(0.0);
        strip.area(span, about(middle, 0.35), fade, Paint::Shade(0.68));
        for (_, s) in strip.multiples(SLEEPER_M, PLATE_HALF_M[0]) {
            fastener(strip, s, middle);
        }
    }
    for (foot, inwards) in [(q[0], 1.0), (q[1], -1.0)] {
        if q[1] - q[0] > 2.0 * (SLEEPER_HALF_M[1] + 0.3) {
            drain(strip, foot, inwards);
        }
    }
}

/// Baseplate, two clips, two screws.
fn fastener(strip: &mut Strip, s: f64, q: f64) {
    let [along, across] = PLATE_HALF_M;
    strip.rect(about(s, along), about(q, across), Paint::Coat(0.085));
    for side in [-1.0, 1.0] {
        let clip = about(q + side * 0.075, 0.022);
        strip.rect(about(s, 0.05), clip, Paint::Coat(0.17));
        strip.disc([s, q + side * 0.145], 0.024, Paint::Coat(0.22));
    }
}

/// A channel along the foot of the wall, here and there with water in it.
fn drain(strip: &mut Strip, foot: f64, inwards: f64) {
    const POOL_M: f64 = 3.0;
    let wall = Anchor {
        q: foot,
        sense: inwards,
    };
    let span = strip.span_m();
    strip.rect(span, wall.band(0.03, 0.27), Paint::Shade(0.45));
    strip.rect(span, wall.band(0.27, 0.285), Paint::Shade(1.3));
    strip.rect(span, wall.band(0.03, 0.07), Paint::Shade(0.6));
    let pools = (PERIOD_M / POOL_M) as i32;
    for (k, _) in strip.multiples(POOL_M, POOL_M) {
        let [luck, at, length, _] = chance(Chance::Puddle, k.rem_euclid(pools), inwards as i32);
        if luck < 0.6 {
            let s = (f64::from(k) + at) * POOL_M;
            let half = 0.2 + 0.8 * length;
            let fade = |at: f64, _: f64| (3.0 - 3.0 * (at - s).abs() / half).clamp(0.0, 1.0);
            let width = wall.band(0.06, 0.25);
            strip.area(about(s, half), width, fade, Paint::Coat(0.045));
        }
    }
}

/// Yellow and black at 45 degrees on both faces of an edge.
fn stripes(strip: &mut Strip, edge: f64) {
    let yellow = |s: f64, q: f64| {
        let phase = ((s + q - edge) / STRIPE_M).rem_euclid(1.0);
        // Distance into the stripe, in texels across the edge.
        let inside = (0.25 - (phase - 0.5).abs()) * STRIPE_M * f64::from(TEXELS_PER_M);
        (inside + 0.5).clamp(0.0, 1.0)
    };
    let (span, both) = (strip.span_m(), about(edge, STRIPED_M));
    strip.rect(span, both, Paint::Coat(0.07));
    strip.area(span, both, yellow, Paint::Coat(0.52));
}

fn walkway(strip: &mut Strip, outline: &Unrolled, edge: Anchor) {
    let Some(floor) = stretch_at(outline, Material::Walkway, edge.q) else {
        return;
    };
    for (_, s) in strip.multiples(1.5, 0.02) {
        strip.rect(about(s, 0.005), floor, Paint::Shade(0.5));
    }
    // Dirt in the corner with the wall, and at the foot.
    let [foot, wall] = inwards(floor, edge);
    for (corner, reach) in [(wall, 0.25), (foot, 0.3)] {
        let fade = |_: f64, q: f64| (1.0 - (q - corner).abs() / reach).clamp(0.0, 1.0);
        let near = about(corner, reach);
        let near = [near[0].max(floor[0]), near[1].min(floor[1])];
        strip.area(strip.span_m(), near, fade, Paint::Shade(0.7));
    }
}

fn platform(strip: &mut Strip, outline: &Unrolled, edge: Anchor) {
    let Some(floor) = stretch_at(outline, Material::Platform, edge.q) else {
        return;
    };
    let [_, far] = inwards(floor, edge);
    let width_m = (far - edge.q).abs();
    let rows = (width_m / TILE_M).ceil() as i32;
    let tiles = (PERIOD_M / TILE_M) as i32;
    for (k, s) in strip.multiples(TILE_M, TILE_M) {
        let along = [s, s + TILE_M];
        for row in 0..rows {
            let d = f64::from(row) * TILE_M;
            let tile = edge.band(d, (d + TILE_M).min(width_m));
            let [tone, ..] = chance(Chance::Tile, k.rem_euclid(tiles), row);
            strip.rect(along, tile, Paint::Shade(0.95 + 0.1 * tone as f32));
            let joint = edge.band(d - 0.004, d + 0.004);
            strip.rect(along, joint, Paint::Shade(0.55));
        }
        let joint = about(s, 0.004);
        strip.rect(joint, edge.band(0.0, width_m), Paint::Shade(0.55));
    }
    let span = strip.span_m();
    // The white edge, the yellow strip for feet that cannot see, its studs.
    strip.rect(span, edge.band(0.0, 0.1), Paint::Coat(0.74));
    strip.rect(span, edge.band(0.6, 0.9), Paint::Coat(0.50));
    for (k, _) in strip.multiples(0.1, 0.05) {
        let s = (f64::from(k) + 0.5) * 0.1;
        for row in 0..3 {
            let q = edge.at(0.65 + 0.1 * f64::from(row));
            strip.disc([s, q], 0.02, Paint::Shade(0.8));
        }
    }
    // The face below is black with brake dust under the nosing.
    let under = |_: f64, q: f64| (1.0 - (q - edge.q).abs() / 0.5).clamp(0.0, 1.0);
    strip.area(span, edge.band(-0.5, 0.0), under, Paint::Shade(0.55));
}

/// The ends of a stretch, in the direction in which an edge's floor lies.
fn inwards([from, to]: [f64; 2], edge: Anchor) -> [f64; 2] {
    if edge.sense > 0.0 {
        [from, to]
    } else {
        [to, from]
    }
}

/// The stretch of a material that holds a place.
fn stretch_at(outline: &Unrolled, material: Material, q_m: f64) -> Option<[f64; 2]> {
    let all = outline.stretches(material).into_iter();
    all.into_iter().find(|q| q[0] <= q_m && q_m <= q[1])
}
