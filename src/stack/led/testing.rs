//! A small renderer for the tests of this room: one disc a lamp, ray by ray, row by row.

use crate::bus::lenses::EUROC;
use crate::bus::{
    CameraModel, DistortionCoefficients, Frame, Intrinsics, RigCalibration, Shutter, SimTime,
    StereoPair,
};
use crate::track::waveform::Waveform;
use crate::track::{LampSite, Track, Tunnel};
use image::GrayImage;
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// Uniform and normal numbers from a splitmix64 sequence.
#[derive(Debug)]
pub struct SplitMix64(u64);

impl SplitMix64 {
    /// A sequence of its own for each seed.
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15))
    }

    /// In [0, 1).
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Nearly standard normal: the sum of six uniform numbers, scaled.
    pub fn normal(&mut self) -> f64 {
        ((0..6).map(|_| self.uniform()).sum::<f64>() - 3.0) * std::f64::consts::SQRT_2
    }
}

/// Axes of a camera on a vehicle, yawed to the left and pitched up.
pub fn camera_attitude(yaw_deg: f64, pitch_deg: f64) -> UnitQuaternion<f64> {
    let (sy, cy) = yaw_deg.to_radians().sin_cos();
    let (sp, cp) = pitch_deg.to_radians().sin_cos();
    let right = Vector3::new(sy, -cy, 0.0);
    let down = Vector3::new(sp * cy, sp * sy, -cp);
    let forward = Vector3::new(cp * cy, cp * sy, sp);
    let axes = Matrix3::from_columns(&[right, down, forward]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes))
}

/// The reference rig.
pub fn rig() -> RigCalibration {
    let mount = Translation3::new(0.0, 1.0, 1.7);
    let camera = CameraModel {
        intrinsics: Intrinsics::centred(1280, 720, 1040.0),
        shutter: Shutter {
            line_time_s: 22.2e-6,
            exposure_s: 30e-6,
            first_row: 0,
        },
        blur_px: 0.0,
    };
    let vehicle_from_left = Isometry3::from_parts(mount, camera_attitude(41.0, 26.0));
    RigCalibration::rectified(camera, 0.12, vehicle_from_left)
}

/// The same mount with two wide lenses that differ, as a real pair does (`EUROC`): 79 deg across,
/// 2.3 % barrel at the edge of a lamp's height and 20 % in the corner; the right eye with 0.2 % less
/// focal length, another principal point, 0.5 deg off in every angle and off the baseline's line.
pub fn wide_rig() -> RigCalibration {
    let mut rig = rig();
    let eye = |f_px: f64, centre_px: [f64; 2], lens: DistortionCoefficients| Intrinsics {
        cx_px: centre_px[0],
        cy_px: centre_px[1],
        distortion: lens.into(),
        ..Intrinsics::centred(1280, 720, f_px)
    };
    rig.left.intrinsics = eye(780.7, [634.0, 352.0], EUROC[0]);
    rig.right.intrinsics = eye(778.9, [651.0, 366.0], EUROC[1]);
    rig.left_from_right = Isometry3::new(
        Vector3::new(0.12, 0.001, -0.0015),
        Vector3::new(0.009, -0.0085, 0.0087),
    );
    rig
}

/// Lamps every 10 m from chainage 10 of a straight line of 2 km.
pub fn track(code: &str) -> Track {
    let text = format!(
        "name = 'straight'\n[[plan]]\nkind = 'straight'\nlength_m = 2000.0\n[lamps]\nfrom_m = 10.0\ncode = '{code}'\n"
    );
    Track::clone(Tunnel::from_toml(&text).unwrap().first_track())
}

/// An eye that draws.
struct Eye {
    camera: CameraModel,
    left_from_eye: Isometry3<f64>,
    start_s: f64,
}

/// The world seen from a train on the straight line.
#[derive(Clone, Debug)]
pub struct TestWorld {
    /// What is seen.
    pub lamps: Vec<LampSite>,
    /// The rig as it is built.
    pub rig: RigCalibration,
    /// How much later than the left eye the right one is triggered, as its frames say.
    pub right_later_s: f64,
    /// And by how much later than that it really is.
    pub right_late_s: f64,
    /// Error of every lamp's clock.
    pub clock_ppm: f64,
    /// Turn of the car off the track's direction, to the left, at a time.
    pub yaw_rad: fn(f64) -> f64,
    /// Chainage at time 0, and speed.
    pub start_m: f64,
    /// Metres a second.
    pub speed_mps: f64,
    /// Grey of a lamp seen along its normal.
    pub lamp_grey: f64,
    /// Share of glare.
    pub halo_share: f64,
}

impl TestWorld {
    /// At rest at a chainage, or passing it at time 0.
    pub fn new(map: &Track, start_m: f64, speed_mps: f64) -> Self {
        Self {
            lamps: map.lamps.clone(),
            rig: rig(),
            right_later_s: 0.0,
            right_late_s: 0.0,
            clock_ppm: 0.0,
            yaw_rad: |_| 0.0,
            start_m,
            speed_mps,
            lamp_grey: 1190.0,
            halo_share: 0.02,
        }
    }

    /// Pose of the left eye.
    pub fn world_from_left(&self, t_s: f64) -> Isometry3<f64> {
        let origin = Translation3::new(self.start_m + self.speed_mps * t_s, 0.0, 0.0);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), (self.yaw_rad)(t_s));
        Isometry3::from_parts(origin, turn) * self.rig.vehicle_from_left
    }

    /// Draws a pair whose left rows open from `start_s` on.
    pub fn pair(&self, number: u32, start_s: f64) -> StereoPair {
        let right_s = start_s + self.right_later_s;
        let eye = |start_s: f64, eye: Eye, seed: u64| Frame {
            number,
            start: SimTime::from_secs(start_s),
            exposure_s: eye.camera.shutter.exposure_s,
            gain_db: 0.0,
            image: self.draw(&eye, &mut SplitMix64::new(2 * u64::from(number) + seed)),
        };
        let left = Eye {
            camera: self.rig.left,
            left_from_eye: Isometry3::identity(),
            start_s,
        };
        let right = Eye {
            camera: self.rig.right,
            left_from_eye: self.rig.left_from_right,
            start_s: right_s + self.right_late_s,
        };
        StereoPair {
            left: eye(start_s, left, 0),
            right: eye(right_s, right, 1),
        }
    }

    fn draw(&self, eye: &Eye, noise: &mut SplitMix64) -> GrayImage {
        let c = eye.camera.intrinsics;
        let (w, h) = (c.width_px as usize, c.height_px as usize);
        let mut grey = vec![0.0; w * h];
        for lamp in &self.lamps {
            self.add_lamp(&mut grey, lamp, eye);
        }
        // A table of normal numbers, entered anew for every row, keeps the tests fast.
        let table: Vec<f64> = (0..4096).map(|_| noise.normal()).collect();
        let seen = |light: f64, normal: f64| {
            let light = light.min(1016.0);
            let sigma = (light / 40.0 + 0.4).sqrt();
            (4.0 + light + sigma * normal).round().clamp(0.0, 255.0) as u8
        };
        let dark: Vec<u8> = table.iter().map(|&normal| seen(0.0, normal)).collect();
        let mut image = GrayImage::new(c.width_px, c.height_px);
        for (pixels, light) in image.chunks_exact_mut(w).zip(grey.chunks_exact(w)) {
            let from = (noise.uniform() * 2048.0) as usize;
            pixels.copy_from_slice(&dark[from..from + w]);
            for (u, &light) in light.iter().enumerate().filter(|(_, light)| **light > 0.0) {
                pixels[u] = seen(light, table[from + u]);
            }
        }
        image
    }

    fn add_lamp(&self, grey: &mut [f64], lamp: &LampSite, eye: &Eye) {
        let (c, s) = (eye.camera.intrinsics, eye.camera.shutter);
        let wave = Waveform::sharp(
            lamp.uid.frame(lamp.code),
            lamp.chip_s * (1.0 + 1e-6 * self.clock_ppm),
            0.000_123 * f64::from(lamp.uid.lamp),
        );
        let seen = |t_s: f64| {
            let to_eye = (self.world_from_left(t_s) * eye.left_from_eye).inverse();
            (to_eye * lamp.centre, to_eye * lamp.facing.into_inner())
        };
        let shine = |p: &Point3<f64>, n: &Vector3<f64>| {
            let cos = -n.dot(&p.coords.normalize());
            self.lamp_grey * cos.max(0.0).powf(3.82)
        };
        let radius = 0.5 * lamp.diameter_m;
        for v in 0..c.height_px as usize {
            let open = eye.start_s + s.delay_s(v as f64);
            let (p, n) = seen(open + 0.5 * s.exposure_s);
            let Some(middle) = c.project(&p).filter(|_| p.z < 30.0) else {
                return;
            };
            let reach = c.fx_px * radius / p.z * 1.6 + 100.0;
            if (middle.y - v as f64).abs() > reach || shine(&p, &n) < 0.5 {
                continue;
            }
            let slots: [_; 4] = std::array::from_fn(|k| {
                let at = |k: f64| open + k * s.exposure_s;
                let k = k as f64 / 4.0;
                let (p, n) = seen(at(k + 0.125));
                (p, n, wave.on_share(at(k), at(k + 0.25)), shine(&p, &n))
            });
            let on = wave.on_share(open, open + s.exposure_s);
            let apparent = c.fx_px * radius * (-n.dot(&p.coords.normalize())).max(0.0).sqrt() / p.z;
            let glare = self.halo_share * shine(&p, &n) * on * apparent.powi(2)
                / (apparent.powi(2) + 144.0);
            let from = (middle.x - reach).max(0.0) as usize;
            let to = (middle.x + reach).clamp(0.0, f64::from(c.width_px)) as usize;
            for u in from..to {
                let beyond = (u as f64 - middle.x).hypot(v as f64 - middle.y) - apparent;
                let mut light = if beyond < 96.0 {
                    glare * (-beyond.max(0.0) / 12.0).exp()
                } else {
                    0.0
                };
                if beyond < 0.6 * apparent + 3.0 {
                    let rays = rays(&c, (u, v));
                    for (p, n, share, grey) in &slots {
                        light += grey * share * coverage(&rays, p, n, radius) / 4.0;
                    }
                }
                grey[v * c.width_px as usize + u] += light;
            }
        }
    }
}

/// 4 x 4 rays of a pixel.
fn rays(c: &Intrinsics, (u, v): (usize, usize)) -> [Vector3<f64>; 16] {
    std::array::from_fn(|k| {
        let (du, dv) = ((k % 4) as f64 / 4.0 - 0.375, (k / 4) as f64 / 4.0 - 0.375);
        c.ray(u as f64 + du, v as f64 + dv)
    })
}

/// Share of a pixel's rays that meet a disc.
fn coverage(rays: &[Vector3<f64>], p: &Point3<f64>, n: &Vector3<f64>, radius: f64) -> f64 {
    let meets = |ray: &&Vector3<f64>| {
        let t = n.dot(&p.coords) / n.dot(ray);
        (*ray * t - p.coords).norm_squared() <= radius * radius
    };
    rays.iter().filter(meets).count() as f64 / rays.len() as f64
}
