//! Lamps in an image: the steps in their order.

use super::LedSettings;
use super::centroid::{Chord, grey_centre};
use super::code::{ChipVotes, longest_dark_run};
use super::ellipse::{EllipseFit, fit_ellipse, roundness};
use super::median::median3;
use super::otsu::otsu;
use super::outline::{ClosedSpot, Outline};
use super::patch::Patch;
use super::profile::{REACH_ROWS, RowProfile};
use super::search::Search;
use super::spill::SpillTable;
use super::stripes::{StripeReader, StripeReading};
use super::wiener::Wiener;
use crate::bus::{CameraModel, Ellipse, Intrinsics, PixelBox, Spot};
use crate::track::LampSite;
use crate::track::uid::LineCode;
use image::GrayImage;
use nalgebra::{Point2, Vector2};

/// A lamp in an image, with what the fix needs beyond the report's [`Spot`]. The spot is in pixels
/// as they were read; what is measured is in ideal pixels, where a lens without distortion would
/// have them ([`Intrinsics::ideal`]).
#[derive(Clone, Debug)]
pub struct LampImage {
    /// As reported.
    pub spot: Spot,
    /// Centre, ideal pixel.
    pub centre: Point2<f64>,
    /// Standard deviation of the centre along u, from the scatter of the edge points about the
    /// ellipse: noise, exposure, pixel size and what smear leaves are in it.
    pub sigma_px: f64,
    /// The lamp's own outline in ideal pixels: the fitted one less the spill of its saturated rows.
    pub own_outline: Option<Ellipse>,
    /// Standard deviation of that outline's half axes.
    pub axis_sigma_px: f64,
    /// Level of darkness around it.
    black: f64,
    /// Outline to read the profile in, as seen, fitted or from the bounds.
    shape: Ellipse,
}

/// Finds lamps and reads their stripes.
#[derive(Debug)]
pub struct LampFinder {
    settings: LedSettings,
    lens: Intrinsics,
    /// Of the longest darkness of a lamp.
    dark_rows: usize,
    chip_s: f64,
    code: LineCode,
    spill: SpillTable,
    wiener: Wiener,
    reader: StripeReader,
}

/// Rows and columns around a region in which its outline may lie.
const MARGIN_PX: u32 = 14;
/// An outline that misses its ellipse by more than this share of its size is no lamp's.
const MAX_MISFIT: f64 = 0.08;

impl LampFinder {
    /// For one camera, and lamps of the first lamp's chip time and code, as a line has one kind of
    /// lamp.
    pub fn new(settings: &LedSettings, camera: &CameraModel, lamps: &[LampSite]) -> Self {
        let (chip_s, code) = lamps
            .first()
            .map_or((45e-6, LineCode::default()), |l| (l.chip_s, l.code));
        let frames = lamps.iter().map(|l| l.uid.frame(code));
        let dark_s = f64::from(longest_dark_run(frames).max(2)) * chip_s;
        // All rows of a global shutter see the same: no lamp is cut into stripes.
        let dark_rows = if camera.shutter.is_global() {
            0
        } else {
            ((dark_s / camera.shutter.line_time_s).ceil() as usize + 2).min(100)
        };
        Self {
            settings: settings.clone(),
            lens: camera.intrinsics,
            dark_rows,
            chip_s,
            code,
            spill: SpillTable::new(camera.blur_px),
            wiener: Wiener::default(),
            reader: StripeReader::new(chip_s, camera.shutter),
        }
    }

    /// What comes next was exposed for so long.
    pub fn expose(&mut self, exposure_s: f64) {
        self.reader.expose(exposure_s);
    }

    /// Empty votes for these lamps' code.
    pub fn votes(&self) -> ChipVotes {
        ChipVotes::new(self.code, self.chip_s)
    }

    /// Dark rows that may lie between two lit ones of a lamp. A bright chip that two rows share is
    /// lost in the median: dark runs on both sides of it are then one.
    fn gap_rows(&self) -> usize {
        2 * self.dark_rows
    }

    /// Finds the lamps of an image. `smear_px` says how far a lamp at a pixel moves along the row
    /// during the exposure.
    pub fn find(
        &mut self,
        image: &GrayImage,
        smear_px: impl Fn(&Point2<f64>) -> f64,
    ) -> Vec<LampImage> {
        let mut lamps: Vec<LampImage> = Vec::new();
        let search = Search::of(image, self.settings.min_contrast_grey, self.gap_rows());
        for region in &search.regions {
            let Some(lamp) = self.measure(image, region, search.black, &smear_px) else {
                continue;
            };
            let known = |l: &LampImage| l.spot.bounds.contains(&lamp.spot.centre);
            if !lamps.iter().any(known) {
                lamps.push(lamp);
            }
        }
        lamps
    }

    fn measure(
        &mut self,
        image: &GrayImage,
        region: &PixelBox,
        black: f64,
        smear_px: &impl Fn(&Point2<f64>) -> f64,
    ) -> Option<LampImage> {
        let mut raw = Patch::cut(image, &region.widened(MARGIN_PX, MARGIN_PX));
        let filtered = median3(&raw);
        let split = otsu(&filtered.histogram())?;
        if split.bright_mean - split.dark_mean < self.settings.min_contrast_grey {
            return None;
        }
        let spot = ClosedSpot::find(&filtered, split.threshold, self.gap_rows())?;
        if f64::from(spot.area_px) < self.settings.min_area_px {
            return None;
        }
        let smear = smear_px(&middle(&spot.bounds)).abs();
        if smear > self.settings.deblur_over_px {
            self.wiener
                .prepare(smear, self.settings.wiener_noise_to_signal);
            self.wiener.apply(&mut raw);
        }
        let size = (image.width() as usize, image.height() as usize);
        let outline = Outline::trace(&spot, &raw, (black, split.threshold), size, &self.spill);
        self.describe(spot.bounds, &raw, &outline, black)
    }

    /// Ellipses through the edge points as they are seen, and as they would be without distortion.
    fn fits(&self, points: &[Point2<f64>]) -> Option<(EllipseFit, EllipseFit)> {
        let fit = |points: &[Point2<f64>]| {
            let close = |f: &EllipseFit| f.rms_px < 0.3 + MAX_MISFIT * f.ellipse.semi_minor_px;
            fit_ellipse(points).filter(close)
        };
        let seen = fit(points)?;
        if self.lens.distortion.is_none() {
            return Some((seen, seen));
        }
        let ideal: Vec<_> = points.iter().map(|p| self.lens.ideal(p)).collect();
        Some((seen, fit(&ideal)?))
    }

    /// Weighs the two centres.
    fn describe(
        &self,
        bounds: PixelBox,
        raw: &Patch,
        outline: &Outline,
        black: f64,
    ) -> Option<LampImage> {
        let cut = outline.cut;
        let fits = self.fits(&outline.points);
        let fit = fits.map(|f| f.1);
        let ellipse = fit.map(|f| f.ellipse);
        // What the border cuts off pulls the grey centroid, not the ellipse.
        let alpha = match &ellipse {
            Some(_) if cut => 0.0,
            Some(e) => roundness(e),
            None => 1.0,
        };
        let centre = match (self.ideal_grey_centre(raw, outline, fits), ellipse) {
            (Some(g), Some(e)) => Point2::from(alpha * g.coords + (1.0 - alpha) * e.centre.coords),
            (None, Some(e)) => e.centre,
            (Some(g), None) => g,
            (None, None) => return None,
        };
        let seen = fits.map(|f| f.0.ellipse);
        let shape = seen.unwrap_or(Ellipse {
            centre: middle(&bounds),
            semi_major_px: 0.5 * f64::from(bounds.v1 - bounds.v0).max(2.0),
            semi_minor_px: 0.5 * f64::from(bounds.u1 - bounds.u0).max(2.0),
            angle_rad: std::f64::consts::FRAC_PI_2,
        });
        let sigma_px = fit.map_or(1.0, |f| f.centre_sigma_px);
        let scale = self.ideal_scale(&centre);
        let spill = scale * outline.spill.px;
        let spill_sigma = scale * outline.spill.sigma_px;
        Some(LampImage {
            centre,
            own_outline: ellipse
                .filter(|e| e.semi_minor_px > spill)
                .map(|e| Ellipse {
                    semi_major_px: e.semi_major_px - spill,
                    semi_minor_px: e.semi_minor_px - spill,
                    ..e
                }),
            axis_sigma_px: sigma_px.hypot(spill_sigma),
            spot: Spot {
                bounds,
                centre: self.lens.seen(&centre),
                ellipse: seen,
                roundness: ellipse.map_or(0.0, |e| roundness(&e)),
                cut,
                uid: None,
            },
            sigma_px,
            black,
            shape,
        })
    }

    /// The grey centre in ideal pixels, from the chords of the lit rows. A lens that bends a disc
    /// moves the middle of its outline off the image of its centre: as far as the centres of the
    /// two ellipses are apart.
    fn ideal_grey_centre(
        &self,
        raw: &Patch,
        outline: &Outline,
        fits: Option<(EllipseFit, EllipseFit)>,
    ) -> Option<Point2<f64>> {
        let whole = |e: &&(usize, f64, f64)| e.1.is_finite() && e.2.is_finite();
        let edges = outline.edges.iter().filter(whole);
        let chords = edges.map(|&(v, left, right)| Chord { v, left, right });
        let centre = grey_centre(chords)?;
        let grey = Point2::new(raw.u0 as f64 + centre.x, raw.v0 as f64 + centre.y);
        let bent =
            fits.map(|(seen, ideal)| self.lens.seen(&ideal.ellipse.centre) - seen.ellipse.centre);
        Some(self.lens.ideal(&(grey + bent.unwrap_or_default())))
    }

    /// Ideal pixels a pixel, at an ideal pixel.
    fn ideal_scale(&self, at: &Point2<f64>) -> f64 {
        if self.lens.distortion.is_none() {
            return 1.0;
        }
        let seen = |du: f64, dv: f64| self.lens.seen(&(at + Vector2::new(du, dv)));
        let (right, down) = (
            seen(1.0, 0.0) - seen(-1.0, 0.0),
            seen(0.0, 1.0) - seen(0.0, -1.0),
        );
        let seen_area = 0.25 * (right.x * down.y - right.y * down.x);
        seen_area.abs().max(1e-6).sqrt().recip()
    }

    /// Reads the chips of a lamp found in this image; `None` where there is no code in it.
    pub fn read(&self, image: &GrayImage, lamp: &LampImage) -> Option<StripeReading> {
        let around = lamp.spot.bounds.widened(MARGIN_PX, REACH_ROWS as u32 + 4);
        let raw = Patch::cut(image, &around);
        let tilt_over_rows = self.settings.tilt_over_rows;
        let profile = RowProfile::of(
            &raw,
            lamp.black,
            &lamp.shape,
            self.dark_rows,
            tilt_over_rows,
        );
        self.reader.read(&profile, lamp.black)
    }
}

/// Middle of a box.
fn middle(bounds: &PixelBox) -> Point2<f64> {
    let middle = |a: u32, b: u32| 0.5 * (f64::from(a) + f64::from(b));
    Point2::new(middle(bounds.u0, bounds.u1), middle(bounds.v0, bounds.v1))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::stack::led::testing::{TestWorld, track};
    use nalgebra::Translation3;

    /// Drawn lamps: the found centre's column against the projected one, and the stripes' name.
    fn look(
        world: &TestWorld,
        lamp: &LampSite,
        number: u32,
    ) -> (Vec<LampImage>, [f64; 2], Option<crate::track::uid::Uid>) {
        let start_s = 0.1 + f64::from(number) / 30.0;
        let pair = world.pair(number, start_s);
        let mut finder = LampFinder::new(&LedSettings::default(), &world.rig.left, &world.lamps);
        let mut disparities = [f64::NAN; 2];
        let right = finder.find(&pair.right.image, |_| 0.0);
        let right = right.first().map(|l| l.spot.centre.x);
        let found = finder.find(&pair.left.image, |_| 0.0);
        if let (Some(l), Some(right)) = (found.first(), right) {
            let eye = |x_m| {
                let pose = world.world_from_left(start_s) * Translation3::new(x_m, 0.0, 0.0);
                let seen = pose.inverse() * lamp.centre;
                world.rig.left.intrinsics.project(&seen).unwrap().x
            };
            disparities = [
                l.spot.centre.x - right,
                eye(0.0) - eye(world.rig.baseline_m()),
            ];
        }
        let mut votes = finder.votes();
        let lamp = found.first();
        if let Some(reading) = lamp.and_then(|l| finder.read(&pair.left.image, l)) {
            votes.add(0.0, &reading);
        }
        (found, disparities, votes.decode())
    }

    /// Near enough to show the whole frame, one image is enough, whatever the name.
    #[test]
    fn a_near_lamp_is_read_from_one_image() {
        for code in ["manchester", "nrz"] {
            let map = track(code);
            for k in (3..190).step_by(23) {
                let lamp = &map.lamps[k];
                let world = TestWorld::new(&map, lamp.chainage_m - 1.1, 0.0);
                let (_, _, uid) = look(&world, lamp, k as u32);
                assert_eq!(uid, Some(lamp.uid), "{code} {k}");
            }
        }
    }

    /// Disparity within 0.15 px, from 9 m ahead to 0.8 m, for any name and phase.
    #[test]
    fn disparities_are_good_to_a_seventh_of_a_pixel() {
        let map = track("manchester");
        let mut squares = 0.0;
        for k in 0..24 {
            let lamp = &map.lamps[7 * k + 3];
            let ahead = 9.0 - 8.2 * k as f64 / 23.0;
            let world = TestWorld::new(&map, lamp.chainage_m - ahead, 0.0);
            let (found, [measured, truth], _) = look(&world, lamp, k as u32);
            assert_eq!(found.len(), 1, "{ahead} m");
            assert!(
                (measured - truth).abs() < 0.25,
                "{ahead} m: {measured} for {truth}"
            );
            squares += (measured - truth).powi(2) / 24.0;
        }
        assert!(squares.sqrt() < 0.15, "rms {}", squares.sqrt());
    }

    /// No light, all light, no pixels: nothing found, no panic.
    #[test]
    fn images_without_a_lamp_give_nothing() {
        let map = track("manchester");
        let camera = crate::stack::led::testing::rig().left;
        let mut finder = LampFinder::new(&LedSettings::default(), &camera, &map.lamps);
        for (w, h) in [(0, 0), (1, 1), (3, 200), (1280, 720)] {
            for grey in [0, 4, 255] {
                let image = GrayImage::from_pixel(w, h, image::Luma([grey]));
                assert!(finder.find(&image, |_| 9.0).is_empty());
            }
        }
        // A column of light at the border has no two sides.
        let bar = GrayImage::from_fn(300, 200, |u, _| image::Luma([if u < 9 { 250 } else { 3 }]));
        let found = finder.find(&bar, |_| 0.0);
        assert!(
            found.iter().all(|l| l.spot.cut && l.spot.ellipse.is_none()),
            "{found:?}"
        );
    }
}
