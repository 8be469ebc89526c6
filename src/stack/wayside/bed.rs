//! What a frame shows of the bed: whether the light lets it be seen, and whether it lies clear in a place.

use super::WaysideSettings;
use super::cells::{CELL_PX, GaugeCells};
use super::difference::Difference;
use super::reference::Reference;
use super::sight::Sight;
use crate::bus::PixelBox;
use crate::track::TrackPoint;

/// Along the line, the bed is looked at so often.
const STEP_M: f64 = 1.0;
/// And in so many places across it, metres left of the centreline.
const ACROSS_M: [f64; 3] = [-0.5, 0.0, 0.5];
/// A place is seen where its line of sight meets the bed within so many metres of it along the line.
const FOOT_ERROR_M: f64 = 1.0;
/// Share of a place's pixels that must show the bed as the reference has it.
const CLEAR_SHARE: f64 = 0.9;
/// In light as that of the reference the mean grey of a place differs by less than this share of the
/// threshold.
const KNOWN_LIGHT_SHARE: f64 = 0.25;

/// A place on the bed, and the cell that shows it.
#[derive(Clone, Debug)]
struct BedPlace {
    step: usize,
    /// First pixel of the cell.
    cell_px: (usize, usize),
    /// Mean grey level of the cell in the reference.
    grey: f64,
}

/// The bed as the camera has it in view, and how bright it is.
#[derive(Clone, Debug)]
pub(super) struct BedLight {
    places: Vec<BedPlace>,
    /// Places in view, and places seen, of each step along the line.
    counts: Vec<(u32, u32)>,
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
        Self {
            places: places.collect(),
            counts: vec![(0, 0); steps],
        }
    }

    fn place(sight: &Sight, step: usize, s_m: f64, l_m: f64) -> Option<BedPlace> {
        let on_rails = TrackPoint { s_m, l_m, h_m: 0.0 };
        let h_m = sight.floor_m(on_rails);
        let pixel = sight.pixel_of(TrackPoint { h_m, ..on_rails })?;
        let lens = &sight.calibration().camera.intrinsics;
        let foot = lens
            .contains(&pixel)
            .then(|| sight.foot(pixel.x, pixel.y))??;
        let cell = |px: f64| px.max(0.0) as usize / CELL_PX * CELL_PX;
        ((foot.s_m - s_m).abs() <= FOOT_ERROR_M).then(|| BedPlace {
            step,
            cell_px: (cell(pixel.x), cell(pixel.y)),
            grey: 0.0,
        })
    }

    /// Takes the grey levels of a reference image.
    pub fn set_reference(&mut self, mean: &[u8], width_px: usize) {
        for place in &mut self.places {
            let (u, v) = place.cell_px;
            let rows = mean.chunks_exact(width_px.max(1)).skip(v).take(CELL_PX);
            let pixels = rows.flat_map(|row| row.iter().skip(u).take(CELL_PX));
            let (sum, count) = pixels.fold((0u32, 0u32), |(sum, count), grey| {
                (sum + u32::from(*grey), count + 1)
            });
            place.grey = f64::from(sum) / f64::from(count.max(1));
        }
    }

    /// Length of bed in view, metres, on which a body of the least contrast would not be found in the
    /// light of the last frame. What a train hides does not count.
    pub fn unseen_m(
        &mut self,
        difference: &Difference,
        cells: &GaugeCells,
        settings: &WaysideSettings,
    ) -> f64 {
        self.counts.fill((0, 0));
        for place in &self.places {
            if cells.is_blind(place.cell_px) {
                continue;
            }
            let (expected, limit) = difference.expected(place.cell_px, place.grey);
            let (in_view, seen) = &mut self.counts[place.step];
            *in_view += 1;
            *seen += u32::from(limit <= settings.least_contrast * expected);
        }
        let unseen = self
            .counts
            .iter()
            .filter(|(in_view, seen)| 2 * seen < *in_view);
        unseen.count() as f64 * STEP_M
    }
}

/// A frame held against the reference, in the search for the clear bed.
pub(super) struct ClearBed<'a> {
    pub frame: &'a [u8],
    pub reference: &'a Reference,
    pub width_px: usize,
    /// Of the difference, grey levels.
    pub threshold: f64,
}

/// Of some pixels: how many can be compared, how many are as in the reference, and the sum of the
/// differences.
#[derive(Clone, Copy, Default)]
struct Compared {
    pixels: u32,
    alike: u32,
    sum: i64,
}

impl Compared {
    fn light_is_known(&self, threshold: f64) -> bool {
        let mean = self.sum as f64 / f64::from(self.pixels.max(1));
        mean.abs() < KNOWN_LIGHT_SHARE * threshold
    }
}

impl ClearBed<'_> {
    /// Whether the frame shows the bed of the reference in a box and around it. In the same light
    /// everything must look the same; in another light a body may look as the bed did before, but what is
    /// around it then does not.
    pub fn shows_in(&self, bounds: &PixelBox) -> bool {
        let margin = |low: u32, high: u32| (high - low) / 2 + CELL_PX as u32;
        let wide = bounds.widened(margin(bounds.u0, bounds.u1), margin(bounds.v0, bounds.v1));
        let (inside, all) = (self.compare(bounds), self.compare(&wide));
        let around = Compared {
            pixels: all.pixels - inside.pixels,
            alike: all.alike - inside.alike,
            sum: all.sum - inside.sum,
        };
        inside.pixels > 0
            && f64::from(inside.alike) >= CLEAR_SHARE * f64::from(inside.pixels)
            && inside.light_is_known(self.threshold)
            && around.light_is_known(self.threshold)
    }

    fn compare(&self, bounds: &PixelBox) -> Compared {
        let mut compared = Compared::default();
        let columns = bounds.u0 as usize..(bounds.u1 as usize + 1).min(self.width_px);
        for v in bounds.v0 as usize..=bounds.v1 as usize {
            let row = v * self.width_px + columns.start..v * self.width_px + columns.end;
            let pixels = (self.frame.get(row.clone()).unwrap_or_default().iter())
                .zip(self.reference.mean.get(row.clone()).unwrap_or_default())
                .zip(self.reference.valid.get(row).unwrap_or_default());
            for ((&f, &b), _) in pixels.filter(|(_, valid)| **valid != 0) {
                let difference = i32::from(f) - i32::from(b);
                compared.pixels += 1;
                compared.alike += u32::from(f64::from(difference.abs()) < self.threshold);
                compared.sum += i64::from(difference);
            }
        }
        compared
    }
}
