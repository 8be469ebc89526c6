#![allow(clippy::unwrap_used, reason = "a test may fail by panicking")]
use super::*;
use crate::track::{PlatformShape, Side};
use crate::twin::random::Stream;
use crate::twin::reflectance::mean_albedo;
use crate::twin::render::sample;

fn bored() -> CrossSection {
    CrossSection::circular(3.0, 2.26, Some(Side::Left))
}

fn station() -> CrossSection {
    let platform = PlatformShape {
        side: Side::Right,
        edge_m: 1.5,
        height_m: 1.05,
    };
    CrossSection::rectangular(2.9, 6.0, 4.6, Some(platform), None)
}

fn texel(painting: &Painting, i: usize, j: usize) -> f64 {
    f64::from(painting.levels[0][j * painting.width as usize + i]) / 255.0
}

/// Mean difference across the border before a column.
fn step_at(painting: &Painting, column: usize) -> f64 {
    let before = (column + painting.width as usize - 1) % painting.width as usize;
    let rows = painting.height as usize;
    let steps = (0..rows).map(|j| texel(painting, column, j) - texel(painting, before, j));
    steps.map(f64::abs).sum::<f64>() / rows as f64
}

/// Fails where something ends at the seam instead of going on at the other side of the image:
/// noise, a leak, a sleeper, half a joint.
#[test]
fn the_image_repeats_without_a_seam() {
    for section in [bored(), station()] {
        let painting = Painting::of(&section);
        // Rings and sleepers are in step again every 3 m.
        let steps: Vec<f64> = (1..20).map(|k| step_at(&painting, 192 * k)).collect();
        let usual = steps.iter().sum::<f64>() / steps.len() as f64;
        let worst = steps.iter().copied().fold(0.0, f64::max);
        let seam = step_at(&painting, 0);
        assert!(seam < worst.max(1.2 * usual), "{seam} {usual} {worst}");
        for s in [0.01, 17.3] {
            let there = painting.albedo(s + 3.0 * PERIOD_M, 4.0);
            assert!((painting.albedo(s, 4.0) - there).abs() < 1e-9);
        }
    }
}

/// Fails where furniture or dirt make a material darker or paler in the mean than `surface` says.
#[test]
fn materials_keep_their_mean_albedo() {
    for (section, materials) in [
        (
            bored(),
            &[Material::Lining, Material::Bed, Material::Walkway][..],
        ),
        (
            station(),
            &[Material::Lining, Material::Bed, Material::Platform][..],
        ),
    ] {
        let painting = Painting::of(&section);
        let outline = Unrolled::of(&section);
        for material in materials {
            let (mut sum, mut area) = (0.0, 0.0);
            for [from, to] in outline.stretches(*material) {
                let across = [[PERIOD_M, 0.0], [0.0, to - from]];
                let mean = painting.mean_over([0.0, 0.5 * (from + to)], across);
                sum += mean * (to - from);
                area += to - from;
            }
            let expected = mean_albedo(*material);
            let off = sum / area / expected - 1.0;
            assert!(
                off.abs() < 0.12,
                "{material:?}: {} for {expected}",
                sum / area
            );
        }
    }
}

/// Fails where rounding makes the far end of a tunnel darker than the near one, or where a level
/// has the wrong size.
#[test]
fn levels_conserve_the_mean() {
    let painting = Painting::of(&bored());
    let mean = |level: &[u8]| level.iter().map(|a| f64::from(*a)).sum::<f64>() / level.len() as f64;
    let sharp = mean(&painting.levels[0]);
    assert_eq!(painting.levels.len(), LEVELS);
    for (k, level) in painting.levels.iter().enumerate() {
        let size = (painting.width as usize >> k) * (painting.height as usize >> k);
        assert_eq!(level.len(), size);
        // Five standard deviations of rounding to whole steps, and a hundredth of a step.
        let bound = 5.0 * (1.0 / 12.0 / size as f64).sqrt() + 0.01;
        assert!(
            (mean(level) - sharp).abs() < bound,
            "{k}: {} {sharp}",
            mean(level)
        );
    }
}

/// Fails where a strip depends on the thread that paints it.
#[test]
fn threads_paint_the_same_bytes() {
    let paint = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap().install(|| Painting::of(&bored()))
    };
    assert!(paint(1) == paint(3));
}

/// Fails where a pixel's mean leaves out a part of its footprint, or takes too coarse a level:
/// the plain sum of bilinear values over parallelograms of all sizes and slants.
#[test]
fn means_are_those_of_the_interpolated_texels() {
    let painting = Painting::of(&bored());
    let random = Stream::new(11, 0, "footprints");
    let (mut square, mut worst) = (0.0, 0.0f64);
    for k in 0..60u64 {
        let number = |j: u64| 2.0 * random.uniform(10 * k + j) - 1.0;
        let size = 0.004 * 500f64.powf(random.uniform(10 * k + 9));
        let at = [30.0 * number(0), 9.0 + 6.0 * number(1)];
        let along = [size * (1.5 + number(2)), 0.3 * size * number(3)];
        let up = [0.5 * size * number(4), size * (0.6 + 0.5 * number(5))];
        let n = 300;
        let mut sum = 0.0;
        for i in 0..n * n {
            let share = |k: usize| (k as f64 + 0.5) / n as f64 - 0.5;
            let (a, b) = (share(i % n), share(i / n));
            let place = |axis: usize| at[axis] + a * along[axis] + b * up[axis];
            sum += painting.albedo(place(0), place(1));
        }
        let off = painting.mean_over(at, [along, up]) - sum / (n * n) as f64;
        square += off * off / 60.0;
        worst = worst.max(off.abs());
    }
    assert!(
        square.sqrt() < 0.003 && worst < 0.012,
        "{} {worst}",
        square.sqrt()
    );
}

/// Fails where rings have another length, or joints are washed out: the wall's mean along the
/// line dips at multiples of 1.5 m, and only there by so much.
#[test]
fn rings_are_one_and_a_half_metres_long() {
    let painting = Painting::of(&bored());
    let column = |s_m: f64| painting.mean_over([s_m, 7.0], [[0.02, 0.0], [0.0, 2.0]]);
    let found = (0..40).filter(|ring| {
        let s_m = 1.5 * f64::from(*ring);
        let between = 0.5 * (column(s_m - 0.6) + column(s_m + 0.6));
        column(s_m) < 0.8 * between && column(s_m + 0.08) > 0.85 * between
    });
    // A leak or a chip may hide one.
    assert!(found.count() >= 36);
    let elsewhere = (0..40).filter(|ring| {
        let s_m = 1.5 * f64::from(*ring) + 0.6;
        column(s_m) < 0.8 * column(s_m + 0.2)
    });
    assert!(elsewhere.count() <= 2);
}

/// Fails where a rail's rows are not where they are said to be: its head shines, its sides are
/// rusty.
#[test]
fn a_rails_head_is_brighter_than_its_sides() {
    for section in [bored(), station()] {
        let painting = Painting::of(&section);
        let begin = painting.rail_q_m();
        let mean = |q_m: f64| painting.mean_over([20.0, begin + q_m], [[10.0, 0.0], [0.0, 0.01]]);
        assert!(mean(0.205) > 0.5 && mean(0.205) < 0.7, "{}", mean(0.205));
        for side in [0.08, 0.33] {
            assert!(mean(side) > 0.15 && mean(side) < 0.3, "{}", mean(side));
        }
    }
}

/// Fails where equal cross-sections are painted twice, or ranges get another's painting.
#[test]
fn equal_sections_share_a_painting() {
    let mut track = sample::track();
    let first = track.sections[0].clone();
    let (mut second, mut third) = (first.clone(), first.clone());
    (second.section, third.from_m) = (station(), 200.0);
    track.sections = vec![first, second, third];
    let paintings = Paintings::of(&[track.into()]);
    assert_eq!(paintings.of_range, [[0, 1, 0]]);
    assert_eq!(paintings.all.len(), 2);
    assert!(paintings.all[1] == Painting::of(&station()));
}

/// Provokes a bound that misses rows or the way between two: no point has more, and some row comes up to it.
#[test]
fn most_albedo_is_a_bound_that_is_reached() {
    let painting = Painting::of(&bored());
    let height_m = f64::from(painting.height) / f64::from(TEXELS_PER_M);
    for k in 0..200 {
        let q_m = height_m * f64::from(k) / 200.0;
        let between = [q_m + 0.11, q_m];
        let most = painting.most_albedo(between);
        let mut found = 0.0f64;
        for i in 0..painting.width {
            for j in 0..8 {
                let s_m = (f64::from(i) + 0.5) * TEXEL_M;
                found = found.max(painting.albedo(s_m, q_m + 0.11 * f64::from(j) / 7.0));
            }
        }
        assert!(found <= most + 1e-12, "{q_m}: {found} over {most}");
        assert!(found > 0.7 * most, "{q_m}: {found} far under {most}");
    }
}
