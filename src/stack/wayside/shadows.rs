//! Shadows, which are no bodies. A shadow takes one of several lamps away: the picture under it gets
//! darker, but what is painted on the floor still shows in it. A body hides it.
//!
//! So in a region that is darker than the reference, the steps from pixel to pixel of the frame are
//! compared with those of the reference,
//!
//! ```text
//! slope = sum(df db) / sum(db db),    standard error = sqrt(var / sum(db db)),
//! ```
//!
//! var the variance of a step, by noise and by what does not fit. Under a body the slope is 0; in a
//! shadow it is about what it leaves of the light, a = sum(f) / sum(b) (less, where noise and the
//! sharp edges of other shadows blur it). Soft borders do not matter: their own steps have nothing to
//! do with those of the floor.
//! The texture test is that of Jacques, Jung and Musse, "Background Subtraction and Shadow
//! Detection in Grayscale Video Sequences", SIBGRAPI 2005, in the form of a regression, which says
//! how sure it is.
//!
//! The doubt is for the obstacle: a region counts as shadow only where the slope is well over 0, or
//! as a piece of a shadow beside it that leaves as much of the light; and parts of it whose own
//! texture is gone stay. What has too little texture to tell is believed for [`PATIENCE`] frames and
//! no longer: a shadow that does not move is that of a body that does not. On a floor without
//! texture every dark patch is an obstacle.

use super::reference::Noise;
use crate::bus::PixelBox;
use crate::stack::runs::Runs;
use std::collections::{BTreeMap, BTreeSet};

/// The texture of a shadow is at least this share of what light is left.
const LEAST_SHARE: f64 = 1.0 / 3.0;
/// A region is a shadow when its slope is over 0 by so many standard errors. These are as of
/// independent steps; those of stains repeat from row to row, which makes chance some twice as
/// large.
const SURE: f64 = 4.0;
/// A part of it is none when its slope is so many under that of a shadow.
const SURE_OF_PART: f64 = 2.0;
/// Shadows of the same lamps leave shares of the light that differ by less than this.
const ALIKE: f64 = 0.1;
/// So many frames a part goes with the rest of its shadow without a texture of its own.
const PATIENCE: u32 = 30;
/// Frames in which a part that was there may be missing.
const GAP: u32 = 3;
/// Side of a part: half the least obstacle at 20 m, the whole of it at 40 m.
const PART_PX: u32 = 16;

/// Sums over pixels and steps.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    pixels: f64,
    frame: f64,
    reference: f64,
    /// Of df db, db db and df df.
    both: f64,
    square: f64,
    frame_square: f64,
    steps: f64,
}

impl Sums {
    fn add(&mut self, other: &Self) {
        self.pixels += other.pixels;
        self.frame += other.frame;
        self.reference += other.reference;
        self.both += other.both;
        self.square += other.square;
        self.frame_square += other.frame_square;
        self.steps += other.steps;
    }

    fn step(&mut self, df: f64, db: f64) {
        self.both += df * db;
        self.square += db * db;
        self.frame_square += df * df;
        self.steps += 1.0;
    }

    fn slope(&self) -> f64 {
        self.both / self.square
    }

    /// Variance of a step, by the noise of its two pixels.
    fn noise_variance(&self, noise: &Noise) -> f64 {
        2.0 * noise.variance(self.frame / self.pixels)
    }

    /// Variance of a step, by how far the frame is from the reference times the slope.
    fn residual_variance(&self) -> f64 {
        let residual = self.frame_square - self.both * self.slope();
        residual / (self.steps - 1.0).max(1.0)
    }

    fn error(&self, variance: f64) -> f64 {
        (variance / self.square).sqrt()
    }

    /// Share of the light that is left.
    fn left(&self) -> f64 {
        self.frame / self.reference
    }

    /// Whether the texture shows for sure, be what does not fit noise or a texture of its own.
    fn is_shadow(&self, noise: &Noise) -> bool {
        let variance = self.noise_variance(noise).max(self.residual_variance());
        self.square > 0.0
            && self.slope() > (LEAST_SHARE * self.left()).max(SURE * self.error(variance))
    }

    /// Whether less of the texture shows than `least`.
    fn is_covered(&self, least: f64, noise: &Noise) -> bool {
        let error = self.error(self.noise_variance(noise));
        self.square > 0.0 && self.slope() + SURE_OF_PART * error < least
    }
}

/// What a region has in one square of the image: the region's number, and column and row of the
/// square.
type Part = (usize, (u32, u32));

/// A region that may be a shadow, as a whole.
#[derive(Clone, Copy, Debug)]
struct CandidateRegion {
    /// Bounds, in squares.
    squares: PixelBox,
    sums: Sums,
}

impl CandidateRegion {
    /// Whether another one is as dark, and beside it, so that their squares meet.
    fn is_piece_of(&self, other: &Self) -> bool {
        (self.sums.left() - other.sums.left()).abs() < ALIKE
            && self.squares.is_near(&other.squares, 1)
    }
}

/// How long a square has had parts that go with a shadow: first and last frame.
#[derive(Clone, Copy, Debug, Default)]
struct Stay {
    first: u32,
    last: u32,
}

/// Finds shadows.
#[derive(Clone, Debug, Default)]
pub(super) struct ShadowFilter {
    /// Of frames looked at.
    number: u32,
    stays: BTreeMap<(u32, u32), Stay>,
}

impl ShadowFilter {
    /// Takes the shadows out of a binary image of what differs from the reference.
    pub fn reject(
        &mut self,
        binary: &mut [u8],
        width: usize,
        (frame, reference): (&[u8], &[u8]),
        noise: &Noise,
    ) {
        let mut runs = Runs::new(binary, width, 0, |k| frame[k] < reference[k]);
        let parts = parts(&mut runs, binary, width, (frame, reference));
        let mut shadows = shadows(&parts, noise);
        self.release_held(&parts, &mut shadows, noise);
        for k in 0..runs.all.len() {
            let region = runs.region(k);
            let run = runs.all[k];
            for (square, from, to) in pieces(run.v, run.u) {
                if shadows.contains(&(region, square)) {
                    let row = run.v as usize * width;
                    binary[row + from as usize..=row + to as usize].fill(0);
                }
            }
        }
    }

    /// Takes back parts that their own texture does not decide, in squares that have had any for
    /// long.
    fn release_held(
        &mut self,
        parts: &BTreeMap<Part, Sums>,
        shadows: &mut BTreeSet<Part>,
        noise: &Noise,
    ) {
        let number = self.number;
        self.number += 1;
        self.stays.retain(|_, stay| stay.last + GAP >= number);
        shadows.retain(|part| {
            if parts[part].is_shadow(noise) {
                return true;
            }
            let first = number;
            let stay = self.stays.entry(part.1);
            let stay = stay.or_insert(Stay { first, last: first });
            stay.last = number;
            number - stay.first < PATIENCE
        });
    }
}

/// The parts of all regions and their sums.
fn parts(
    runs: &mut Runs,
    binary: &[u8],
    width: usize,
    (frame, reference): (&[u8], &[u8]),
) -> BTreeMap<Part, Sums> {
    let mut parts: BTreeMap<Part, Sums> = BTreeMap::new();
    let grey = |image: &[u8], k: usize| f64::from(image[k]);
    for k in 0..runs.all.len() {
        let region = runs.region(k);
        let run = runs.all[k];
        for (square, from, to) in pieces(run.v, run.u) {
            let sums = parts.entry((region, square)).or_default();
            for u in from..=to {
                let here = run.v as usize * width + u as usize;
                let (f, b) = (grey(frame, here), grey(reference, here));
                sums.pixels += 1.0;
                sums.frame += f;
                sums.reference += b;
                // Neighbours to the right and below that are as dark are of the same region.
                let right = (u < run.u.1).then_some(here + 1);
                let below = here + width;
                let below = (binary.get(below).is_some_and(|&set| set != 0)
                    && frame[below] < reference[below])
                    .then_some(below);
                for next in [right, below].into_iter().flatten() {
                    sums.step(grey(frame, next) - f, grey(reference, next) - b);
                }
            }
        }
    }
    parts
}

/// Which parts are shadow: those of regions that are shadow for sure, and of undecided pieces beside
/// them that are as dark.
fn shadows(parts: &BTreeMap<Part, Sums>, noise: &Noise) -> BTreeSet<Part> {
    let mut regions = regions(parts);
    let sure = regions.values().filter(|r| r.sums.is_shadow(noise));
    let sure: Vec<CandidateRegion> = sure.copied().collect();
    regions.retain(|_, region| sure.iter().any(|shadow| region.is_piece_of(shadow)));
    let is_shadow = |(part, sums): &(&Part, &Sums)| {
        let region = regions.get(&part.0);
        region.is_some_and(|r| !sums.is_covered(LEAST_SHARE * r.sums.left(), noise))
    };
    parts
        .iter()
        .filter(is_shadow)
        .map(|(part, _)| *part)
        .collect()
}

fn regions(parts: &BTreeMap<Part, Sums>) -> BTreeMap<usize, CandidateRegion> {
    let mut regions: BTreeMap<usize, CandidateRegion> = BTreeMap::new();
    for (&(number, (u, v)), part) in parts {
        let squares = PixelBox::of_row(v, (u, u));
        let sums = Sums::default();
        let region = regions
            .entry(number)
            .or_insert(CandidateRegion { squares, sums });
        region.squares = region.squares.joined(&squares);
        region.sums.add(part);
    }
    regions
}

/// A run cut at the borders of the squares: square, first and last column.
fn pieces(v: u32, (u0, u1): (u32, u32)) -> impl Iterator<Item = ((u32, u32), u32, u32)> {
    (u0 / PART_PX..=u1 / PART_PX).map(move |x| {
        let last = x * PART_PX + PART_PX - 1;
        ((x, v / PART_PX), u0.max(x * PART_PX), u1.min(last))
    })
}

#[cfg(test)]
mod tests {
    use super::super::test_scene::{normal, words};
    use super::*;

    const WIDTH: usize = 160;
    const HEIGHT: usize = 120;
    const NOISE: Noise = Noise {
        dark: 0.4,
        per_grey: 0.068,
    };

    type Ellipse = ((f64, f64), (f64, f64));

    /// How far within an ellipse (centre, half axes) a pixel is: over 0 inside.
    fn within(u: f64, v: f64, (centre, half): Ellipse) -> f64 {
        1.0 - ((u - centre.0) / half.0).hypot((v - centre.1) / half.1)
    }

    /// A floor with texture of so many grey levels.
    fn floor(texture: u32) -> Vec<f64> {
        (0..WIDTH * HEIGHT)
            .map(|k| {
                let (u, v) = ((k % WIDTH) as u32, (k / WIDTH) as u32);
                let stain = f64::from(words(u / 5, v / 5, 3)[0] % (texture + 1));
                80.0 - f64::from(texture) / 2.0 + stain
            })
            .collect()
    }

    fn seen(light: &[f64], seed: u32) -> Vec<u8> {
        let noisy = |(k, grey): (usize, &f64)| {
            let noise = NOISE.variance(*grey).sqrt() * normal(seed * 100_000 + k as u32);
            (grey + noise).round().clamp(0.0, 255.0) as u8
        };
        light.iter().enumerate().map(noisy).collect()
    }

    /// Share of the pixels over the threshold that are rejected, over all pictures of 20 seeds.
    fn rejected(floor: &[f64], picture: &[f64], place: Ellipse) -> f64 {
        let reference: Vec<u8> = floor.iter().map(|grey| grey.round() as u8).collect();
        let (mut all, mut left) = (0, 0);
        for seed in 0..20 {
            let frame = seen(picture, seed);
            let over = |k: usize| frame[k].abs_diff(reference[k]) >= 15;
            let mut binary: Vec<u8> = (0..frame.len()).map(|k| 255 * u8::from(over(k))).collect();
            let count = |binary: &[u8]| {
                let inside = |k: usize| within((k % WIDTH) as f64, (k / WIDTH) as f64, place) > 0.0;
                (0..binary.len())
                    .filter(|&k| binary[k] != 0 && inside(k))
                    .count()
            };
            all += count(&binary);
            ShadowFilter::default().reject(&mut binary, WIDTH, (&frame, &reference), &NOISE);
            left += count(&binary);
        }
        1.0 - left as f64 / all as f64
    }

    const PATCH: Ellipse = ((80.0, 60.0), (40.0, 18.0));

    /// The floor with a shadow on it that leaves `left` of the light and has soft borders.
    fn shaded(floor: &[f64], left: f64) -> Vec<f64> {
        let pixels = floor.iter().enumerate();
        pixels
            .map(|(k, grey)| {
                let depth = within((k % WIDTH) as f64, (k / WIDTH) as f64, PATCH);
                grey * (1.0 - (1.0 - left) * (10.0 * depth).clamp(0.0, 1.0))
            })
            .collect()
    }

    fn covered(picture: &mut [f64], place: Ellipse, grey: impl Fn(usize) -> f64) {
        for (k, pixel) in picture.iter_mut().enumerate() {
            if within((k % WIDTH) as f64, (k / WIDTH) as f64, place) > 0.0 {
                *pixel = grey(k);
            }
        }
    }

    /// Shadows from faint to deep on floors of weak and strong texture.
    #[test]
    fn shadows_go() {
        for (texture, left) in [(20, 0.7), (20, 0.5), (40, 0.7), (40, 0.45), (40, 0.3)] {
            let floor = floor(texture);
            let share = rejected(&floor, &shaded(&floor, left), PATCH);
            assert!(share > 0.95, "{texture}, {left}: {share}");
        }
    }

    /// Bodies of the same darkness stay: plain ones, ones with a texture of their own, on floors
    /// with and without texture. Provokes a test of darkness alone, or doubt that counts for shadow.
    #[test]
    fn bodies_stay() {
        for texture in [0, 3, 20, 40] {
            let floor = floor(texture);
            for (grey, own) in [(20.0, 0), (40.0, 0), (56.0, 0), (40.0, 30)] {
                let mut picture = floor.clone();
                let pattern = |k: usize| {
                    let stain = words((k % WIDTH) as u32 / 4, (k / WIDTH) as u32 / 4, 17)[0];
                    grey + f64::from(stain % (own + 1)) - f64::from(own) / 2.0
                };
                covered(&mut picture, PATCH, pattern);
                let share = rejected(&floor, &picture, PATCH);
                assert!(share < 0.02, "{texture}, {grey}, {own}: {share}");
            }
        }
    }

    /// A floor without texture cannot tell: the doubt is for the obstacle.
    #[test]
    fn what_cannot_be_decided_stays() {
        let floor = floor(0);
        assert!(rejected(&floor, &shaded(&floor, 0.5), PATCH) < 0.02);
    }

    /// A dark body in the middle of a shadow stays when the shadow goes: as dark as it, and so one
    /// region with it.
    #[test]
    fn a_body_in_a_shadow_stays() {
        let floor = floor(40);
        let body = ((85.0, 60.0), (14.0, 12.0));
        let mut picture = shaded(&floor, 0.5);
        covered(&mut picture, body, |_| 40.0);
        let share = rejected(&floor, &picture, body);
        assert!(share < 0.35, "{share}");
        assert!(rejected(&floor, &picture, ((52.0, 60.0), (12.0, 9.0))) > 0.95);
    }

    /// A body as dark as the shadow that it throws, on a smooth floor: the shadow crosses a floor with
    /// texture, so both together pass for a shadow, but not for ever.
    #[test]
    fn a_body_does_not_hide_in_its_own_shadow() {
        let rough = floor(40);
        let smooth = |k: usize| k % WIDTH > 70;
        let floor: Vec<f64> = (0..rough.len())
            .map(|k| if smooth(k) { 80.0 } else { rough[k] })
            .collect();
        let body = ((100.0, 60.0), (18.0, 12.0));
        let mut picture = shaded(&floor, 0.5);
        covered(&mut picture, body, |_| 40.0);
        let reference: Vec<u8> = floor.iter().map(|grey| grey.round() as u8).collect();
        let mut shadows = ShadowFilter::default();
        let left: Vec<usize> = (0..2 * PATIENCE)
            .map(|n| {
                let frame = seen(&picture, n);
                let over = |k: usize| frame[k].abs_diff(reference[k]) >= 15;
                let mut binary: Vec<u8> =
                    (0..frame.len()).map(|k| 255 * u8::from(over(k))).collect();
                shadows.reject(&mut binary, WIDTH, (&frame, &reference), &NOISE);
                let inside = |k: usize| within((k % WIDTH) as f64, (k / WIDTH) as f64, body) > 0.0;
                (0..binary.len())
                    .filter(|&k| binary[k] != 0 && inside(k))
                    .count()
            })
            .collect();
        assert!(left[0] < 50, "{left:?}");
        let patience = PATIENCE as usize;
        assert!(left[patience + 1..].iter().all(|n| *n > 500), "{left:?}");
    }
}
