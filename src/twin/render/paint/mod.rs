//! What is painted on the walls: for each cross-section one image of its albedo, made once.
//!
//! A metro tunnel is anything but plain: rings of segments with gaskets and bolt pockets, leaks,
//! cables on brackets, a handrail, plates, sleepers with fasteners, drains. To look all of that up
//! costs a renderer nothing for each pixel but a texture fetch, so it is *painted*: onto a raster
//! over (s, q), s being metres along the line, q metres along the outline from its first point.
//!
//! ```
//! use metrotwin::track::{CrossSection, Side};
//! use metrotwin::twin::render::paint::Painting;
//!
//! let painting = Painting::of(&CrossSection::circular(3.0, 2.26, Some(Side::Left)));
//! let joint = painting.albedo(1.5, 4.0);
//! let concrete = painting.mean_over([0.75, 4.0], [[0.5, 0.0], [0.0, 0.5]]);
//! assert!(joint < 0.8 * concrete);
//! ```
//!
//! # The raster
//!
//! 64 texels a metre, 8 bits: a texel holds 255 times the mean albedo over its square. Texel
//! (i, j) is centred at s = (i + 1/2) / 64, q = (j + 1/2) / 64. Along s it repeats after
//! [`PERIOD_M`], which rings, sleepers and brackets divide; what should not show that, dirt and
//! chance, does repeat, but two ends 60 m apart are never seen sharply together. **Albedo is the
//! bilinear interpolation of the texels** (wrapping in s, clamped in q): both renderers hold to
//! that. Below the outline lie the rails' rows: [`Painting::rail_q_m`] is where
//! [`rail_outline`] begins.
//!
//! The pyramid above it halves both axes, each texel the mean of its four (Williams, "Pyramidal
//! parametrics", SIGGRAPH 1983), computed from the exact sums, so that levels keep the mean. The
//! height is padded to a multiple of 256, so all nine levels halve without remainder.
//!
//! # What it shows, and after what
//!
//! | thing | measures | after |
//! |---|---|---|
//! | rings of a round lining | 1.5 m, 6 segments: key 21.5 deg, 2 x 68, 3 x 67.5, key alternating 18 deg off the crown | usual for shield-driven Chinese metros of some 6 m; terms of the ITA guidelines for shield tunnel lining (2000) |
//! | bolts | ring to ring every 36 deg, 2 at each segment joint | the same linings (10 and 12 bolts) |
//! | other linings | cast in 12 m blocks, formwork panels of 1.5 m x 1.2 m with tie holes | usual formwork |
//! | sleepers | every 0.6 m, 0.26 m x 2.5 m | as the track everywhere here |
//! | slab joints | every 6 m | own choice, about as long as prefabricated track slabs |
//! | cables | on brackets every 1 m, on the wall without walkway | own choice: power and signal cables apart |
//! | handrail, stripes | 1.05 m above the walkway, 45 deg stripes on its edge | own choice; stripes as safety markings of ISO 3864-1 |
//! | plates, light boxes | every 30 m, every 15 m | own choice |
//!
//! Everything accidental is a hash of what it is about (ring, segment, ...), see
//! [`random`](crate::twin::random).
//!
//! Not here: relief (joints and cables are flat paint with painted shades), gloss, numbers that
//! could be read (the image repeats).

mod brush;
mod furniture;
mod ground;
mod lining;
mod unroll;

use crate::track::{CrossSection, Material, Track, rail_outline};
use crate::twin::geometry::surface_of;
use brush::{Chance, Strip, ValueNoise, chance};
use rayon::prelude::*;
use std::sync::Arc;
use unroll::{OutlinePlace, Unrolled};

/// Along the line everything repeats after this.
pub const PERIOD_M: f64 = 60.0;
/// Texels a metre.
pub const TEXELS_PER_M: u32 = 64;
/// Side of a texel.
pub const TEXEL_M: f64 = 1.0 / TEXELS_PER_M as f64;
/// Images of the pyramid; a texel of the last is 4 m wide.
pub const LEVELS: usize = 9;
/// Rings of segments, or panels of formwork, along the line.
const RING_M: f64 = 1.5;
/// Rows between the outline and the rails, half of them like either.
const GAP_ROWS: usize = 16;

/// The albedo of a cross-section and of the rails in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Painting {
    /// Texels along the line.
    pub width: u32,
    /// Texels along the outline, and more for rails and padding.
    pub height: u32,
    /// 255 times albedo, row by row (a row runs along the line); level k has `width >> k` columns
    /// and `height >> k` rows.
    pub levels: Vec<Vec<u8>>,
    /// The brightest texel of each row.
    brightest: Vec<u8>,
    rail_row: usize,
}

/// The paintings of a tunnel; equal cross-sections share one.
#[derive(Clone, Debug, Default)]
pub struct Paintings {
    /// Each once.
    pub all: Vec<Painting>,
    /// Of each section range of each track, its painting.
    pub of_range: Vec<Vec<usize>>,
}

impl Paintings {
    /// Paints all cross-sections of all tracks.
    pub fn of(tracks: &[Arc<Track>]) -> Self {
        let mut sections: Vec<&CrossSection> = Vec::new();
        let mut of_range = Vec::new();
        for track in tracks {
            let mut of_track = Vec::new();
            for range in &track.sections {
                let known = sections.iter().position(|s| **s == range.section);
                of_track.push(known.unwrap_or(sections.len()));
                if known.is_none() {
                    sections.push(&range.section);
                }
            }
            of_range.push(of_track);
        }
        Self {
            all: sections.into_iter().map(Painting::of).collect(),
            of_range,
        }
    }

    /// The painting of a section range of a track.
    pub fn of_range(&self, track: usize, range: usize) -> Option<usize> {
        self.of_range.get(track)?.get(range).copied()
    }

    /// Leaves the texels to an adapter that has them.
    pub fn forget_texels(&mut self) {
        for painting in &mut self.all {
            painting.levels = Vec::new();
        }
    }
}

impl Painting {
    /// Paints a cross-section.
    pub fn of(section: &CrossSection) -> Self {
        let outline = Unrolled::of(&surface_of(section, 0));
        let rail = Unrolled::of(&rail_outline(0.0));
        let rows = |u: &Unrolled| (u.length_m * f64::from(TEXELS_PER_M)).ceil() as usize;
        let rail_row = rows(&outline) + GAP_ROWS;
        let height = (rail_row + rows(&rail)).next_multiple_of(1 << (LEVELS - 1));
        let (width, strip) = (
            (PERIOD_M * f64::from(TEXELS_PER_M)) as usize,
            (RING_M * f64::from(TEXELS_PER_M)) as usize,
        );
        let places = places(&outline, &rail, rail_row, height);
        let strips: Vec<Vec<u8>> = (0..width / strip)
            .into_par_iter()
            .map(|ring| {
                let mut strip = Strip::new(ring * strip, strip, height);
                paint(&mut strip, ring as i32, &outline, &places);
                let to_byte = |a: &f32| (a.clamp(0.0, 1.0) * 255.0).round() as u8;
                strip.albedo.iter().map(to_byte).collect()
            })
            .collect();
        let mut sharp = Vec::with_capacity(width * height);
        for y in 0..height {
            for painted in &strips {
                sharp.extend_from_slice(&painted[y * strip..][..strip]);
            }
        }
        let brightest = sharp.chunks_exact(width.max(1));
        Self {
            width: width as u32,
            height: height as u32,
            brightest: brightest
                .map(|row| row.iter().copied().max().unwrap_or(0))
                .collect(),
            levels: pyramid(sharp, width),
            rail_row,
        }
    }

    /// Where the rails' outline begins: a rail shows what is this far along plus metres along
    /// [`rail_outline`].
    pub fn rail_q_m(&self) -> f64 {
        self.rail_row as f64 / f64::from(TEXELS_PER_M)
    }

    /// Albedo at a point.
    pub fn albedo(&self, s_m: f64, q_m: f64) -> f64 {
        self.sample(0, [s_m, q_m])
    }

    /// No point between these two ways along the outline has more.
    pub fn most_albedo(&self, mut q_m: [f64; 2]) -> f64 {
        q_m.sort_by(f64::total_cmp);
        let last = self.brightest.len().saturating_sub(1);
        let [low, high] = q_m.map(|q_m| q_m * f64::from(TEXELS_PER_M) - 0.5);
        // Between two rows both count.
        let (low, high) = (
            (low.max(0.0) as usize).min(last),
            (high.max(0.0).ceil() as usize).min(last),
        );
        let rows = self.brightest.get(low..=high).unwrap_or_default();
        rows.iter()
            .copied()
            .max()
            .map_or(1.0, |byte| f64::from(byte) / 255.0)
    }

    /// Mean albedo over a parallelogram around a point (s, q), whose sides are `across`, such as
    /// a pixel's footprint.
    ///
    /// It is sampled on an even grid of points no farther apart than a quarter of its width, each
    /// from the level whose texels are that fine.
    pub fn mean_over(&self, at: [f64; 2], across: [[f64; 2]; 2]) -> f64 {
        let sides = across.map(|a| a[0].hypot(a[1]));
        let area = (across[0][0] * across[1][1] - across[0][1] * across[1][0]).abs();
        let width_m = area / sides[0].max(sides[1]).max(1e-12);
        let level = (0.25 * width_m / TEXEL_M)
            .log2()
            .clamp(0.0, (self.levels.len() - 1) as f64) as usize;
        let step_m = (0.25 * width_m).max(0.5 * TEXEL_M);
        // A needle of a pixel at the horizon is no reason to count for ever.
        let [n, m] = sides.map(|side| (side / step_m).ceil().clamp(1.0, 256.0) as usize);
        let mut sum = 0.0;
        for i in 0..n * m {
            let share = |k: usize, of: usize| (k as f64 + 0.5) / of as f64 - 0.5;
            let (a, b) = (share(i % n, n), share(i / n, m));
            let along = |axis: usize| at[axis] + a * across[0][axis] + b * across[1][axis];
            sum += self.sample(level, [along(0), along(1)]);
        }
        sum / (n * m) as f64
    }

    fn sample(&self, level: usize, at: [f64; 2]) -> f64 {
        let texels = &self.levels[level];
        let (columns, rows) = (self.width as usize >> level, self.height as usize >> level);
        let per_m = f64::from(TEXELS_PER_M) / f64::from(1u32 << level);
        let (x, y) = (
            (at[0] * per_m - 0.5).rem_euclid(columns as f64),
            (at[1] * per_m - 0.5).clamp(0.0, (rows - 1) as f64),
        );
        let (i, j) = (x as usize % columns, y as usize);
        let (right, above) = ((i + 1) % columns, (j + 1).min(rows - 1));
        let (a, b) = (x - x.floor(), y - y.floor());
        let texel = |i: usize, j: usize| f64::from(texels[j * columns + i]);
        let near = texel(i, j) * (1.0 - a) + texel(right, j) * a;
        let far = texel(i, above) * (1.0 - a) + texel(right, above) * a;
        (near * (1.0 - b) + far * b) / 255.0
    }
}

/// What each row of the image shows: the outline, the rails, and the nearer of both between and
/// beyond them.
fn places(
    outline: &Unrolled,
    rail: &Unrolled,
    rail_row: usize,
    height: usize,
) -> Vec<Option<OutlinePlace>> {
    let q_of = |rows: f64| (rows + 0.5) / f64::from(TEXELS_PER_M);
    (0..height)
        .map(|row| {
            if row < rail_row - GAP_ROWS / 2 {
                outline.at(q_of(row as f64))
            } else {
                rail.at(q_of(row as f64 - rail_row as f64).max(0.0))
            }
        })
        .collect()
}

/// Paints a strip of one ring.
fn paint(strip: &mut Strip, ring: i32, outline: &Unrolled, places: &[Option<OutlinePlace>]) {
    prime(strip, ring, outline, places);
    lining::paint(strip, outline);
    ground::paint(strip, outline);
    furniture::paint(strip, outline);
}

/// Bare surfaces: the tone of each segment, dust, streaks and grain.
fn prime(strip: &mut Strip, ring: i32, outline: &Unrolled, places: &[Option<OutlinePlace>]) {
    let patches = ValueNoise::under(strip, [48, 48], 0);
    let streaks = ValueNoise::under(strip, [12, 96], 1);
    let specks = ValueNoise::under(strip, [8, 8], 2);
    for (y, place) in places.iter().enumerate() {
        let Some(place) = place else { continue };
        let tone = match place.material {
            Material::Lining => lining::tone(ring, outline, place),
            Material::Bed => ground::BED_ALBEDO,
            Material::Walkway => ground::walkway_tone(place),
            Material::Platform => ground::platform_tone(place),
            Material::Rail => ground::rail_tone(place),
        };
        let (streaky, first) = (0.30 * place.upright as f32, strip.first_column);
        let mut grain = [0.0; 4];
        for (x, albedo) in strip.row(y).iter_mut().enumerate() {
            if x % 4 == 0 {
                grain = chance(Chance::Grain, (first + x) as i32, y as i32);
            }
            let dirt = 0.22 * patches.at(x, y)
                + streaky * streaks.at(x, y)
                + 0.12 * specks.at(x, y)
                + 0.08 * grain[x % 4] as f32;
            let mean = 0.5 * (0.42 + streaky);
            *albedo = tone as f32 * (1.0 + mean - dirt);
        }
    }
}

/// All levels above an image, from the exact sums of its texels.
fn pyramid(sharp: Vec<u8>, width: usize) -> Vec<Vec<u8>> {
    let mut sums = sums_of_four(&sharp, width);
    let mut levels = vec![sharp];
    for level in 1..LEVELS {
        if level > 1 {
            sums = sums_of_four(&sums, width >> (level - 1));
        }
        // Halves go to the even neighbour: upwards each level would be paler than the last.
        let (shift, half) = (2 * level, 1u32 << (2 * level - 1));
        let mean = |sum: &u32| ((sum + half - 1 + (sum >> shift & 1)) >> shift) as u8;
        levels.push(sums.iter().map(mean).collect());
    }
    levels
}

/// Of every two by two numbers in rows of so many.
fn sums_of_four<T: Copy + Into<u32> + Sync>(numbers: &[T], columns: usize) -> Vec<u32> {
    let of_rows = numbers.par_chunks(2 * columns).flat_map_iter(|rows| {
        let (above, below) = rows.split_at(columns);
        let pairs = above.chunks(2).zip(below.chunks(2));
        let sum = |numbers: &[T]| numbers.iter().map(|n| (*n).into()).sum::<u32>();
        pairs.map(move |(a, b)| sum(a) + sum(b))
    });
    of_rows.collect()
}

#[cfg(test)]
mod tests;
