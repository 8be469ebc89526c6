//! Camera images, and what the stack found in them.
//!
//! rerun puts the corner of the top left pixel at (0, 0), we its centre, so everything drawn into
//! an image moves by half a pixel.

use super::image_encoder::{Format, ImageEncoder, ImageRow};
use super::observer_error::Result;
use super::palette::{self, ui};
use super::stream::RowStream;
use super::{path_of, slug};
use crate::bus::{
    DangerLevel, DetectedObstacle, Ellipse, Frame, Intrinsics, LedReport, PixelBox, SimTime, Spot,
    StereoPair, TrainId, WaysideReport,
};
use crate::scenario::RecordSettings;
use image::GrayImage;
use re_sdk_types::archetypes::{Boxes2D, EncodedImage, LineStrips2D, Pinhole, Points2D};

/// The left eye's frame, with its image plane under it.
pub(super) const LEFT: &str = "world/rig/left";
/// The right eye's.
pub(super) const RIGHT: &str = "world/rig/right";

const PIXEL_CENTRE: f32 = 0.5;

/// Where the things of one wayside device go.
pub(super) struct WaysidePaths {
    /// Its mark in the 3-D view.
    pub(super) device: String,
    /// Its camera's frame, with its image plane under it.
    pub(super) camera: String,
    /// Difference image.
    pub(super) difference: String,
    /// Binary image.
    pub(super) binary: String,
}

impl WaysidePaths {
    /// Of the device with this name.
    pub(super) fn new(name: &str) -> Self {
        let name = slug(name);
        Self {
            device: format!("world/wayside/{name}"),
            camera: format!("world/wayside/{name}/camera"),
            difference: format!("wayside/{name}/difference"),
            binary: format!("wayside/{name}/binary"),
        }
    }
}

/// A camera's frustum, drawn `depth_m` deep: that of a lens without distortion, which is all that
/// rerun knows. Images and what is drawn into them stay as they were read.
pub(super) fn pinhole(intrinsics: &Intrinsics, depth_m: f32) -> Pinhole {
    let focal = [intrinsics.fx_px as f32, intrinsics.fy_px as f32];
    let size = [intrinsics.width_px as f32, intrinsics.height_px as f32];
    let centre = [intrinsics.cx_px, intrinsics.cy_px].map(|c| c as f32 + PIXEL_CENTRE);
    Pinhole::from_focal_length_and_resolution(focal, size)
        .with_principal_point(centre)
        .with_image_plane_distance(depth_m)
        .with_color(palette::CAMERA)
}

/// The label of an obstacle in space.
pub(super) fn danger_label(o: &DetectedObstacle) -> String {
    let danger = match o.danger {
        DangerLevel::None => "clear",
        DangerLevel::Low => "low",
        DangerLevel::High => "HIGH",
    };
    format!("{:.1} m {danger}", o.near_range_m)
}

/// The label of a danger in the image.
fn obstacle_label(o: &DetectedObstacle) -> String {
    let range_and_danger = danger_label(o);
    format!("{range_and_danger}, {:.2} x {:.2} m", o.width_m, o.height_m)
}

/// Lets through the first of each interval of a fixed rate.
#[derive(Clone, Copy)]
struct Rate {
    hz: f64,
    last: Option<i64>,
}

impl Rate {
    fn new(hz: f64) -> Self {
        Self { hz, last: None }
    }

    fn due(&mut self, time: SimTime) -> bool {
        if self.hz <= 0.0 {
            return false;
        }
        // A frame may start a hair before the interval that it belongs to.
        let interval = (time.secs() * self.hz + 1e-6).floor() as i64;
        self.last.replace(interval) != Some(interval)
    }
}

/// The image part of a recording.
pub(super) struct Images {
    stream: RowStream,
    /// Of both eyes.
    eyes: [String; 2],
    quality: u8,
    gain: f64,
    every_frame: bool,
    stereo: Rate,
    wayside: Vec<Rate>,
    encoder: ImageEncoder,
}

impl Images {
    /// Of a train, and of so many wayside devices.
    pub(super) fn new(
        stream: RowStream,
        settings: &RecordSettings,
        (id, devices): (TrainId, usize),
    ) -> Self {
        Self {
            stream,
            eyes: [LEFT, RIGHT].map(|path| path_of(id, path)),
            quality: settings.jpeg_quality,
            gain: settings.difference_gain,
            every_frame: settings.overlay_every_frame,
            stereo: Rate::new(settings.stereo_image_hz),
            wayside: vec![Rate::new(settings.wayside_image_hz); devices],
            encoder: ImageEncoder::default(),
        }
    }

    /// A pair of the train's cameras.
    pub(super) fn pair(&mut self, pair: &StereoPair, report: &LedReport) -> Result {
        let keep = self.stereo.due(pair.left.start);
        if !keep && !self.every_frame {
            return Ok(());
        }
        let eyes = [(&pair.left, &report.left), (&pair.right, &report.right)];
        for (path, (frame, spots)) in self.eyes.clone().iter().zip(eyes) {
            if keep {
                let at = (frame.start, frame.number);
                self.encode(format!("{path}/image"), at, &frame.image, self.jpeg(None))?;
            }
            self.stream.at_frame(frame.start, frame.number);
            self.log_spots(path, spots)?;
        }
        Ok(())
    }

    /// A frame of a wayside camera.
    pub(super) fn wayside(
        &mut self,
        device: (usize, &str),
        frame: &Frame,
        report: &WaysideReport,
    ) -> Result {
        let (start, image) = (frame.start, &frame.image);
        let keep = self.wayside.get_mut(device.0).is_some_and(|r| r.due(start));
        if !keep && !self.every_frame {
            return Ok(());
        }
        let paths = WaysidePaths::new(device.1);
        if keep {
            let at = (start, report.number);
            self.encode(
                format!("{}/image", paths.camera),
                at,
                image,
                self.jpeg(None),
            )?;
            if let Some(difference) = &report.difference {
                self.encode(paths.difference, at, difference, self.jpeg(Some(self.gain)))?;
            }
            if let Some(binary) = &report.binary {
                self.encode(paths.binary, at, binary, Format::Png)?;
            }
        }
        self.stream.at_frame(start, report.number);
        self.log_obstacles(&paths.camera, report, image.height())
    }

    fn jpeg(&self, gain: Option<f64>) -> Format {
        let quality = self.quality;
        Format::Jpeg { quality, gain }
    }

    /// Has an image encoded, and logs an earlier one.
    fn encode(
        &mut self,
        path: String,
        (start, number): (SimTime, u32),
        image: &GrayImage,
        format: Format,
    ) -> Result {
        let row = ImageRow {
            path,
            start,
            number,
        };
        match self.encoder.add(row, image, format)? {
            Some(ready) => self.log_image(&ready),
            None => Ok(()),
        }
    }

    fn log_image(&self, (row, image): &(ImageRow, EncodedImage)) -> Result {
        self.stream.at_frame(row.start, row.number);
        self.stream.log(&row.path, image)
    }

    /// Logs all images so far.
    pub(super) fn flush(&mut self) -> Result {
        while let Some(ready) = self.encoder.next()? {
            self.log_image(&ready)?;
        }
        Ok(())
    }

    /// Boxes of lamps, with names where they have one, fitted ellipses and centres.
    fn log_spots(&self, path: &str, spots: &[Spot]) -> Result {
        let unnamed = spots.iter().filter(|spot| spot.uid.is_none());
        let boxes = boxes_of(unnamed.map(|spot| spot.bounds)).with_colors([palette::UNNAMED]);
        self.stream.log(&format!("{path}/unnamed"), &boxes)?;

        let named = spots
            .iter()
            .filter_map(|spot| Some((spot.bounds, spot.uid?)));
        let (bounds, names): (Vec<_>, Vec<_>) = named.unzip();
        let boxes = boxes_of(bounds)
            .with_colors(names.iter().map(|(_, how)| palette::identity(*how)))
            .with_labels(names.iter().map(|(uid, _)| uid.to_string()));
        self.stream.log(&format!("{path}/lamps"), &boxes)?;

        let ellipses = spots.iter().filter_map(|spot| spot.ellipse.map(outline));
        let ellipses = LineStrips2D::new(ellipses)
            .with_radii([ui(1.0)])
            .with_colors([palette::CAMERA]);
        self.stream.log(&format!("{path}/ellipses"), &ellipses)?;

        let centres = spots.iter().map(|spot| pixel(spot.centre.x, spot.centre.y));
        let centres = Points2D::new(centres)
            .with_radii([ui(2.5)])
            .with_colors([palette::TRUTH]);
        self.stream.log(&format!("{path}/centres"), &centres)
    }

    /// Boxes of obstacles with what is known of them, and of the other regions found.
    fn log_obstacles(&self, path: &str, report: &WaysideReport, height_px: u32) -> Result {
        let is_obstacle =
            |bounds: PixelBox| report.obstacles.iter().any(|o| o.blob.bounds == bounds);
        let others = report.blobs.iter().map(|blob| blob.bounds);
        let others = boxes_of(others.filter(|bounds| !is_obstacle(*bounds)));
        self.stream.log(
            &format!("{path}/blobs"),
            &others.with_colors([palette::BLOB]),
        )?;

        let found = boxes_of(report.obstacles.iter().map(|o| o.blob.bounds))
            .with_colors(report.obstacles.iter().map(|o| palette::danger(o.danger)));
        self.stream.log(&format!("{path}/obstacles"), &found)?;

        let (places, dangers) = label_places(&report.obstacles, height_px);
        let labels = Points2D::new(places)
            .with_radii([ui(1.0)])
            .with_colors(dangers.iter().map(|o| palette::danger(o.danger)))
            .with_labels(dangers.iter().map(|o| obstacle_label(o)));
        self.stream
            .log(&format!("{path}/obstacles/labels"), &labels)
    }
}

/// Where the labels of the dangers go: under the box, because labels of boxes are wrapped to their
/// width, and under each other, because obstacles far away lie close together in the image.
fn label_places(
    obstacles: &[DetectedObstacle],
    height_px: u32,
) -> (Vec<[f32; 2]>, Vec<&DetectedObstacle>) {
    /// Of a label's line to the image, as a pane a quarter of a window high shows it.
    const LINE: f64 = 0.08;
    let mut dangers: Vec<_> = obstacles
        .iter()
        .filter(|o| o.danger != DangerLevel::None)
        .collect();
    dangers.sort_by_key(|o| o.blob.bounds.v1);
    let mut free_px = 0.0_f64;
    let places = dangers.iter().map(|o| {
        let b = o.blob.bounds;
        let v = free_px.max(f64::from(b.v1));
        free_px = v + LINE * f64::from(height_px);
        pixel(0.5 * (f64::from(b.u0) + f64::from(b.u1)), v)
    });
    (places.collect(), dangers)
}

fn boxes_of(bounds: impl IntoIterator<Item = PixelBox>) -> Boxes2D {
    let (centres, halves): (Vec<_>, Vec<_>) = bounds
        .into_iter()
        .map(|b| {
            let (u0, v0) = (b.u0 as f32, b.v0 as f32);
            // Both corners are inside: the right edge is that of the last pixel.
            let (u1, v1) = (b.u1 as f32 + 1.0, b.v1 as f32 + 1.0);
            (
                [(u0 + u1) / 2.0, (v0 + v1) / 2.0],
                [(u1 - u0) / 2.0, (v1 - v0) / 2.0],
            )
        })
        .unzip();
    Boxes2D::from_centers_and_half_sizes(centres, halves).with_radii([ui(1.2)])
}

fn outline(e: Ellipse) -> Vec<[f32; 2]> {
    const STEPS: u32 = 48;
    let (sin, cos) = e.angle_rad.sin_cos();
    let point = |k: u32| {
        let t = std::f64::consts::TAU * f64::from(k) / f64::from(STEPS);
        let (x, y) = (e.semi_major_px * t.cos(), e.semi_minor_px * t.sin());
        pixel(
            e.centre.x + x * cos - y * sin,
            e.centre.y + x * sin + y * cos,
        )
    };
    (0..=STEPS).map(point).collect()
}

fn pixel(u: f64, v: f64) -> [f32; 2] {
    [u as f32 + PIXEL_CENTRE, v as f32 + PIXEL_CENTRE]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::Blob;
    use nalgebra::{Point2, Point3};

    /// Rates that do not divide, and frames that start a little early or late, must neither skip
    /// nor double an interval.
    #[test]
    fn a_rate_lets_one_frame_an_interval_through() {
        for (camera_hz, hz, expected) in [(30.0, 5.0, 50), (25.0, 10.0, 100), (30.0, 100.0, 300)] {
            let mut rate = Rate::new(hz);
            let frames = (0..(10.0 * camera_hz) as u32).filter(|k| {
                let early = if k % 2 == 0 { -1e-9 } else { 1e-9 };
                rate.due(SimTime::from_secs(f64::from(*k) / camera_hz).plus(early))
            });
            assert_eq!(frames.count(), expected, "{camera_hz} Hz down to {hz} Hz");
        }
        assert!(!Rate::new(0.0).due(SimTime::ZERO));
    }

    /// Two dangers and the train between them, all within a few pixels: labels written over each
    /// other, or one for the train that hides them.
    #[test]
    fn labels_keep_clear_of_each_other() {
        let at = |v1: u32, danger: DangerLevel| DetectedObstacle {
            blob: Blob {
                bounds: PixelBox {
                    u0: 300,
                    v0: 200,
                    u1: 310,
                    v1,
                },
                area_px: 100,
            },
            position: Point3::origin(),
            near_range_m: 25.0,
            near_angle_rad: 0.0,
            far_range_m: 26.0,
            far_angle_rad: 0.0,
            from_chainage_m: 100.0,
            to_chainage_m: 101.0,
            lateral_m: 0.0,
            width_m: 0.5,
            height_m: 0.25,
            danger,
        };
        let obstacles = [
            at(214, DangerLevel::High),
            at(212, DangerLevel::None),
            at(210, DangerLevel::Low),
        ];
        let (places, dangers) = label_places(&obstacles, 500);
        let levels: Vec<_> = dangers.iter().map(|o| o.danger).collect();
        assert_eq!(levels, [DangerLevel::Low, DangerLevel::High]);
        let rows: Vec<_> = places.iter().map(|[_, v]| *v).collect();
        assert_eq!(rows, [210.5, 250.5]);
    }

    /// A wrong sign of the angle, swapped axes or a forgotten half pixel put points off the
    /// ellipse.
    #[test]
    fn an_outline_lies_on_its_ellipse() {
        let e = Ellipse {
            centre: Point2::new(100.0, 50.0),
            semi_major_px: 20.0,
            semi_minor_px: 8.0,
            angle_rad: 0.3,
        };
        let points = outline(e);
        assert_eq!(points.first(), points.last());
        for [u, v] in points {
            let (du, dv) = (f64::from(u) - 100.5, f64::from(v) - 50.5);
            let (sin, cos) = e.angle_rad.sin_cos();
            let (along, across) = (du * cos + dv * sin, dv * cos - du * sin);
            let r = (along / 20.0).hypot(across / 8.0);
            assert!((r - 1.0).abs() < 1e-5, "({u}, {v}) is at {r}");
        }
    }
}
