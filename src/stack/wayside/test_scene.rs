//! Pictures for the tests: a textured background, noise, boxes drawn through the calibration by
//! casting rays at them in line coordinates (the tests' line is straight and level, so these are
//! world coordinates turned).

use crate::bus::{
    CameraModel, Frame, Intrinsics, LidarReturn, LidarScan, Shutter, SimTime, WaysideCalibration,
};
use crate::track::TrackId;
use crate::track::{
    Alignment, CrossSection, Material, OutlinePoint, PlanElement, RAIL_OFFSET_M, SectionRange,
    Track,
};
use image::GrayImage;
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use std::sync::Arc;

pub const BED_M: f64 = -0.25;
pub const DEVICE_M: f64 = 200.0;
pub const FRAME_S: f64 = 0.1;

/// Hash noise (pcg3d, Jarzynski and Olano 2020).
pub fn words(a: u32, b: u32, c: u32) -> [u32; 3] {
    let mut v = [a, b, c].map(|x| x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    for _ in 0..2 {
        v[0] = v[0].wrapping_add(v[1].wrapping_mul(v[2]));
        v[1] = v[1].wrapping_add(v[2].wrapping_mul(v[0]));
        v[2] = v[2].wrapping_add(v[0].wrapping_mul(v[1]));
        v = v.map(|x| x ^ (x >> 16));
    }
    v
}

/// Of thick mist.
const AIRLIGHT_GREY: f64 = 120.0;
/// Numbers of the noise table: prime, so that frames do not repeat its rows.
const NOISE: usize = 99_991;

/// About normal: the sum of six uniform bytes.
pub fn normal(k: u32) -> f64 {
    let w = words(k, 3, 9);
    let bytes = [w[0], w[0] >> 8, w[1], w[1] >> 8, w[2], w[2] >> 8].map(|x| f64::from(x & 0xff));
    (bytes.iter().sum::<f64>() - 765.0) / (6.0f64 * (256.0 * 256.0 - 1.0) / 12.0).sqrt()
}

/// A horseshoe: bed, low walls, crown.
pub fn section() -> CrossSection {
    let corners = [
        (-1.8, BED_M),
        (-2.7, 1.0),
        (-2.7, 3.0),
        (-1.5, 4.6),
        (1.5, 4.6),
        (2.7, 3.0),
        (2.7, 1.0),
        (1.8, BED_M),
    ];
    CrossSection {
        points: corners
            .iter()
            .map(|&(l_m, h_m)| OutlinePoint { l_m, h_m })
            .collect(),
        materials: vec![Material::Lining; corners.len()],
        closed: true,
    }
}

/// 600 m of level line, curved to the left with `curvature_per_m`.
pub fn track(curvature_per_m: f64) -> Arc<Track> {
    let element = PlanElement {
        length_m: 600.0,
        start_per_m: curvature_per_m,
        end_per_m: curvature_per_m,
        start_cant_m: 0.0,
        end_cant_m: 0.0,
    };
    Arc::new(Track {
        name: "test".into(),
        alignment: Alignment::new(Point3::new(3.0, -7.0, 11.0), 0.4, &[element], &[]),
        stated_chainage: None,
        sections: vec![SectionRange {
            from_m: 0.0,
            to_m: 600.0,
            missing_rail: None,
            section: section(),
        }],
        lamps: vec![],
        wayside: vec![],
        balises: vec![],
        base_stations: vec![],
        stations: vec![],
        ambient_lx: 5.0,
        daylight_lx: 0.0,
    })
}

/// A camera on the left wall at [`DEVICE_M`] that looks down the line and a little down and
/// inwards; a lidar just under it.
pub fn calibration(map: &Track, width: u32, height: u32) -> WaysideCalibration {
    let line = map.alignment.at(DEVICE_M).world_from_line();
    let forward = Vector3::new(-1.0, -0.06, -0.07).normalize();
    let right = forward.cross(&Vector3::z()).normalize();
    let down = forward.cross(&right);
    let attitude = |x: Vector3<f64>, y: Vector3<f64>, z: Vector3<f64>| {
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(
            Matrix3::from_columns(&[x, y, z]),
        ))
    };
    let camera = attitude(right, down, forward);
    let lidar = attitude(right, forward, -down);
    WaysideCalibration {
        track: TrackId::default(),
        name: "W1".into(),
        camera: CameraModel {
            intrinsics: Intrinsics::centred(width, height, f64::from(width) * 0.573),
            shutter: Shutter {
                line_time_s: 14.8e-6,
                exposure_s: 8e-3,
                first_row: 0,
            },
            blur_px: 0.5,
        },
        world_from_camera: line * Isometry3::from_parts(Translation3::new(0.0, 2.4, 2.8), camera),
        world_from_lidar: Some(
            line * Isometry3::from_parts(Translation3::new(0.0, 2.4, 2.6), lidar),
        ),
        chainage_m: DEVICE_M,
        balise_chainage_m: 20.0,
    }
}

/// A box on a straight line: chainage, left, height ranges.
#[derive(Clone, Copy, Debug)]
pub struct Crate {
    pub s: (f64, f64),
    pub l: (f64, f64),
    pub h: (f64, f64),
}

impl Crate {
    /// Of a size, standing on the bed with its middle at a place.
    pub fn on_bed(s: f64, l: f64, size: f64) -> Self {
        let half = size / 2.0;
        Self {
            s: (s - half, s + half),
            l: (l - half, l + half),
            h: (BED_M, BED_M + size),
        }
    }

    /// Where a ray given in line axes first meets it.
    fn hit(&self, from: Point3<f64>, d: Vector3<f64>) -> Option<f64> {
        let (mut near, mut far) = (0.0f64, f64::INFINITY);
        for (k, (low, high)) in [self.s, self.l, self.h].into_iter().enumerate() {
            let (a, b) = ((low - from[k]) / d[k], (high - from[k]) / d[k]);
            near = near.max(a.min(b));
            far = far.min(a.max(b));
        }
        (near <= far).then_some(near)
    }
}

/// What the camera of the tests sees.
pub struct TestScene {
    pub map: Arc<Track>,
    pub calibration: WaysideCalibration,
    background: Vec<f64>,
    /// Of every pixel, in line axes.
    rays: Vec<Vector3<f64>>,
    eye: Point3<f64>,
    noise: Vec<f64>,
    /// Of the air, metres.
    pub visibility_m: f64,
}

impl TestScene {
    pub fn new(width: u32, height: u32) -> Self {
        Self::through(Intrinsics::centred(width, height, f64::from(width) * 0.573))
    }

    /// Through a lens of choice.
    pub fn through(lens: Intrinsics) -> Self {
        let (width, height) = (lens.width_px, lens.height_px);
        let map = track(0.0);
        let mut calibration = calibration(&map, width, height);
        calibration.camera.intrinsics = lens;
        let i = calibration.camera.intrinsics;
        let (eye, line_from_camera) = line_from(&map, &calibration.world_from_camera);
        let rays: Vec<_> = (0..width * height)
            .map(|k| line_from_camera * i.ray(f64::from(k % width), f64::from(k / width)))
            .collect();
        // Stains of some 16 pixels, and rows of sleepers: light and dark all over. Rails, with what shines
        // beside them.
        let background = (0..width * height)
            .zip(&rays)
            .map(|(k, ray): (u32, &Vector3<f64>)| {
                let (u, v) = (k % width, k / width);
                let stain = f64::from(words(u / 16, v / 16, 7)[0] % 60);
                let sleeper = if v % 24 < 9 { 35.0 } else { 0.0 };
                let l_m = eye.y + ray.y * bed_distance_m(&eye, ray);
                let on_rail = (l_m.abs() - RAIL_OFFSET_M).abs() < 0.1;
                50.0 + stain + sleeper + if on_rail { 45.0 } else { 0.0 }
            });
        let background = background.collect();
        Self {
            map,
            calibration,
            background,
            rays,
            eye,
            noise: (0..NOISE as u32).map(normal).collect(),
            visibility_m: f64::INFINITY,
        }
    }

    /// Where a pixel's ray meets the bed.
    pub fn bed_chainage_m(&self, u: u32, v: u32) -> f64 {
        let ray = &self.rays[(v * self.calibration.camera.intrinsics.width_px + u) as usize];
        self.eye.x + ray.x * bed_distance_m(&self.eye, ray)
    }

    /// A frame: background times `light` (a function of the pixel), crates of a grey level,
    /// noise of 1.7 grey levels.
    pub fn frame(
        &self,
        number: u32,
        light: impl Fn(u32, u32) -> f64,
        crates: &[(Crate, f64)],
    ) -> Frame {
        let i = self.calibration.camera.intrinsics;
        let mut image = GrayImage::new(i.width_px, i.height_px);
        let mut grey: Vec<f64> = self.background.clone();
        for (item, level) in crates {
            self.paint(&mut grey, *item, *level);
        }
        let first = words(number, 1, 2)[0] as usize % NOISE;
        let mut noise = self.noise.iter().cycle().skip(first);
        for (k, pixel) in image.iter_mut().enumerate() {
            let (u, v) = (k as u32 % i.width_px, k as u32 / i.width_px);
            let noise = 1.7 * noise.next().unwrap_or(&0.0);
            let through = self.transmission(&self.rays[k]);
            let behind = grey[k] * through + AIRLIGHT_GREY * (1.0 - through);
            *pixel = (behind * light(u, v) + noise).round().clamp(0.0, 255.0) as u8;
        }
        Frame {
            number,
            start: SimTime::from_secs(f64::from(number) * FRAME_S),
            exposure_s: 8e-3,
            gain_db: 0.0,
            image,
        }
    }

    /// Share of the bed's light that comes through the air along a ray (Koschmieder).
    fn transmission(&self, ray: &Vector3<f64>) -> f64 {
        let bed_m = bed_distance_m(&self.eye, ray).min(200.0);
        (-3.912 * bed_m / self.visibility_m).exp()
    }

    fn paint(&self, grey: &mut [f64], item: Crate, level: f64) {
        for (grey, &ray) in grey.iter_mut().zip(&self.rays) {
            if item.hit(self.eye, ray).is_some() {
                *grey = level;
            }
        }
    }

    /// A lidar sweep of 0.2 degree steps over crates and bed.
    pub fn scan(&self, crates: &[Crate]) -> LidarScan {
        let Some(pose) = self.calibration.world_from_lidar else {
            return LidarScan {
                time: SimTime::ZERO,
                returns: vec![],
            };
        };
        let (from, line_from_lidar) = line_from(&self.map, &pose);
        let mut returns = Vec::new();
        for k in 0..300 * 120 {
            let azimuth_rad = (f64::from(k % 300) * 0.2 - 30.0).to_radians();
            let elevation_rad = (f64::from(k / 300) * 0.2 - 20.0).to_radians();
            let unit = super::place::lidar_point(&LidarReturn {
                range_m: 1.0,
                azimuth_rad,
                elevation_rad,
            });
            let d = line_from_lidar * unit.coords;
            let bed = if d.z < 0.0 {
                (BED_M - from.z) / d.z
            } else {
                f64::INFINITY
            };
            let range_m = crates
                .iter()
                .filter_map(|c| c.hit(from, d))
                .fold(bed, f64::min);
            if range_m < 150.0 {
                returns.push(LidarReturn {
                    range_m,
                    azimuth_rad,
                    elevation_rad,
                });
            }
        }
        LidarScan {
            time: SimTime::ZERO,
            returns,
        }
    }
}

/// How far along a ray the bed lies: beyond the horizon, very far.
fn bed_distance_m(eye: &Point3<f64>, ray: &Vector3<f64>) -> f64 {
    (BED_M - eye.z) / ray.z.min(-1e-3)
}

/// Origin (chainage, left, height) and rotation of a pose in line axes.
fn line_from(map: &Track, pose: &Isometry3<f64>) -> (Point3<f64>, UnitQuaternion<f64>) {
    let line_from = map.alignment.at(0.0).world_from_line().inv_mul(pose);
    (
        Point3::from(line_from.translation.vector),
        line_from.rotation,
    )
}
