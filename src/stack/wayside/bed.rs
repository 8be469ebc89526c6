//! What a frame shows of the bed: whether the light lets it be seen, and whether it lies clear in a place.

use super::WaysideSettings;
use super::cells::{CELL_PX, GaugeCells};
use super::difference::Difference;
use super::reference::Reference;
use super::sight::Sight;
use super::veil::TrackContrast;
use crate::bus::{BedSight, PixelBox};

/// Along the line, the bed is looked at so often.
const STEP_M: f64 = 1.0;
/// And in so many places across it, metres left of the centreline.
const ACROSS_M: [f64; 3] = [-0.5, 0.0, 0.5];
/// Share of a place's pixels that must show the bed as the reference has it.
const CLEAR_SHARE: f64 = 0.9;
/// In light as that of the reference the mean grey of a place differs by less than this share of the
/// threshold.
const KNOWN_LIGHT_SHARE: f64 = 0.25;
/// Texture can be told from noise where its variance is so many times that of the noise.
const TEXTURE_OVER_NOISE: f64 = 4.0;
/// In another light the bed's texture must show at least this strongly: less than half is a veil, or
/// something else.
const LEAST_SLOPE: f64 = 0.5;

/// A place on the bed, and the cell that shows it.
#[derive(Clone, Debug)]
struct BedPlace {
    step: usize,
    /// First pixel of the cell.
    cell_px: (usize, usize),
    /// Mean grey level of the cell in the reference; 0 where most of it cannot be compared.
    grey: f64,
}

/// A step along the line: how many of its places the last frame showed, and in how many it would have shown
/// a body.
#[derive(Clone, Copy, Debug)]
struct BedStep {
    shown: u32,
    lit: u32,
    /// Whether a body would have been found in the last frame that showed any of it; true where the camera
    /// has none of it in view.
    seen: bool,
}

/// The bed as the camera has it in view, and how bright it is.
#[derive(Clone, Debug)]
pub(super) struct BedLight {
    places: Vec<BedPlace>,
    track: TrackContrast,
    steps: Vec<BedStep>,
    /// Contrast of the track at each place that the last frame showed.
    contrasts: Vec<f64>,
}

impl BedLight {
    /// All places on the bed that are in the picture and not behind a wall.
    pub fn new(sight: &Sight) -> Self {
        let (from_m, to_m) = sight.watched_m();
        let steps = ((to_m - from_m) / STEP_M).clamp(0.0, 1000.0) as usize;
        let places = (0..steps).flat_map(|step| {
            let s_m = from_m + (step as f64 + 0.5) * STEP_M;
            let places = ACROSS_M.into_iter();
            places.filter_map(move |l_m| Self::place(sight, step, s_m, l_m))
        });
        let mut light = Self {
            places: places.collect(),
            track: TrackContrast::new(sight, STEP_M, steps),
            steps: vec![
                BedStep {
                    shown: 0,
                    lit: 0,
                    seen: true,
                };
                steps
            ],
            contrasts: Vec::new(),
        };
        for place in &light.places {
            light.steps[place.step].seen = false;
        }
        light
    }

    fn place(sight: &Sight, step: usize, s_m: f64, l_m: f64) -> Option<BedPlace> {
        let pixel = sight.floor_pixel(s_m, l_m)?;
        let cell = |px: f64| px.max(0.0) as usize / CELL_PX * CELL_PX;
        Some(BedPlace {
            step,
            cell_px: (cell(pixel.x), cell(pixel.y)),
            grey: 0.0,
        })
    }

    /// Takes the grey levels of a reference image.
    pub fn set_reference(&mut self, reference: &Reference, width_px: usize) {
        for place in &mut self.places {
            let (u, v) = place.cell_px;
            let columns = u..(u + CELL_PX).min(width_px);
            let row = |v: usize| columns.clone().map(move |u| v * width_px + u);
            let rows = (v..v + CELL_PX).flat_map(row);
            let pixels = rows.filter(|&k| reference.valid.get(k) == Some(&1));
            let (sum, count) = pixels.fold((0, 0), |(sum, count), k| {
                (sum + u32::from(reference.mean[k]), count + 1)
            });
            let most = 2 * count >= CELL_PX * CELL_PX;
            place.grey = if most {
                f64::from(sum) / count as f64
            } else {
                0.0
            };
        }
    }

    /// What is seen of the bed in the light of a frame, the one that `difference` was made of. What a train
    /// hides is as it was before.
    pub fn look(
        &mut self,
        frame: &[u8],
        (reference, difference): (&Reference, &Difference),
        cells: &GaugeCells,
        settings: &WaysideSettings,
    ) -> BedSight {
        self.track.measure(frame, reference, cells);
        self.contrasts.clear();
        for step in &mut self.steps {
            (step.shown, step.lit) = (0, 0);
        }
        for place in &self.places {
            if cells.is_blind(place.cell_px) {
                continue;
            }
            let (expected, limit) = difference.expected(place.cell_px, place.grey);
            let across = self.track.around(place.step);
            if let Some(across) = across.filter(|_| expected > 0.0) {
                self.contrasts.push(across / expected);
            }
            let behind_veil = across.unwrap_or(0.0) / settings.track_contrast;
            let step = &mut self.steps[place.step];
            step.shown += 1;
            step.lit += u32::from(limit <= settings.least_contrast * expected.min(behind_veil));
        }
        for step in self.steps.iter_mut().filter(|step| step.shown > 0) {
            step.seen = 2 * step.lit >= step.shown;
        }
        let unseen = self.steps.iter().filter(|step| !step.seen);
        BedSight {
            unseen_m: unseen.count() as f64 * STEP_M,
            track_contrast: median(&mut self.contrasts),
        }
    }
}

/// The upper one of the two in the middle; `None` of nothing.
fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// A frame held against the reference, in the search for the clear bed.
pub(super) struct ClearBed<'a> {
    pub frame: &'a [u8],
    pub reference: &'a Reference,
    pub width_px: usize,
    /// Of the difference, grey levels.
    pub threshold: f64,
}

/// Of some pixels: how many can be compared, how many are as in the reference, and sums for the
/// straight line that turns the reference into the frame.
#[derive(Clone, Copy, Default)]
struct Compared {
    pixels: f64,
    alike: f64,
    frame: f64,
    reference: f64,
    squares: f64,
    products: f64,
}

impl Compared {
    fn light_is_known(&self, threshold: f64) -> bool {
        let mean = (self.frame - self.reference) / self.pixels.max(1.0);
        mean.abs() < KNOWN_LIGHT_SHARE * threshold
    }

    /// The reference's variance, grey levels squared, and the line of least squares from the reference to
    /// the frame: slope and grey level at 0.
    fn line(&self) -> (f64, f64, f64) {
        let n = self.pixels.max(1.0);
        let (f, b) = (self.frame / n, self.reference / n);
        let variance = self.squares / n - b * b;
        let slope = (self.products / n - f * b) / variance.max(f64::MIN_POSITIVE);
        (variance, slope, f - slope * b)
    }
}

impl ClearBed<'_> {
    /// Whether the frame shows the bed of the reference in a box.
    pub fn shows_in(&self, bounds: &PixelBox) -> bool {
        let inside = self.compare(bounds);
        self.is_as_before(bounds, &inside) || self.shows_texture(bounds, &inside)
    }

    /// In the light of the reference everything must look the same. In another light a body may look as
    /// the bed did, but what is around it then does not.
    fn is_as_before(&self, bounds: &PixelBox, inside: &Compared) -> bool {
        let margin = |low: u32, high: u32| (high - low) / 2 + CELL_PX as u32;
        let wide = bounds.widened(margin(bounds.u0, bounds.u1), margin(bounds.v0, bounds.v1));
        let all = self.compare(&wide);
        let around = Compared {
            pixels: all.pixels - inside.pixels,
            frame: all.frame - inside.frame,
            reference: all.reference - inside.reference,
            ..all
        };
        inside.pixels > 0.0
            && inside.alike >= CLEAR_SHARE * inside.pixels
            && inside.light_is_known(self.threshold)
            && around.light_is_known(self.threshold)
    }

    /// In another light, the texture of the bed must show: the frame is the reference times a factor,
    /// plus a constant. A body hides the texture, and the factor is then 0.
    fn shows_texture(&self, bounds: &PixelBox, inside: &Compared) -> bool {
        let (variance, slope, at_0) = inside.line();
        let (mut alike, mut noise) = (0.0, 0.0);
        for (f, b) in self.pixels(bounds) {
            let expected = at_0 + slope * b;
            alike += f64::from((f - expected).abs() < 0.5 * self.threshold);
            noise += self.reference.noise.variance(b);
        }
        slope >= LEAST_SLOPE
            && inside.pixels > 0.0
            && variance >= TEXTURE_OVER_NOISE * noise / inside.pixels
            && alike >= CLEAR_SHARE * inside.pixels
    }

    fn compare(&self, bounds: &PixelBox) -> Compared {
        let mut sums = Compared::default();
        for (f, b) in self.pixels(bounds) {
            sums.pixels += 1.0;
            sums.alike += f64::from((f - b).abs() < self.threshold);
            sums.frame += f;
            sums.reference += b;
            sums.squares += b * b;
            sums.products += f * b;
        }
        sums
    }

    /// Grey levels, in the frame and in the reference, of the pixels of a box that can be compared.
    fn pixels(&self, bounds: &PixelBox) -> impl Iterator<Item = (f64, f64)> {
        let columns = bounds.u0 as usize..(bounds.u1 as usize + 1).min(self.width_px);
        let rows = bounds.v0 as usize..=bounds.v1 as usize;
        rows.flat_map(move |v| {
            let row = v * self.width_px + columns.start..v * self.width_px + columns.end;
            let frame = self.frame.get(row.clone()).unwrap_or_default().iter();
            let mean = self.reference.mean.get(row.clone()).unwrap_or_default();
            let valid = self.reference.valid.get(row).unwrap_or_default();
            let pixels = frame.zip(mean).zip(valid);
            let pixels = pixels.filter(|(_, valid)| **valid != 0);
            pixels.map(|((&f, &b), _)| (f64::from(f), f64::from(b)))
        })
    }
}
