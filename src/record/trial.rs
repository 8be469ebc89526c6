//! A made-up session: a train runs through a small tunnel towards a box on the track and brakes
//! for it. No physics and no stack, only events of the right shape, so that a recording can be
//! tried alone.

#![allow(
    clippy::unwrap_used,
    reason = "tests stop at the first thing that is not as expected"
)]

use crate::bus::*;
use crate::session::{Event, Observer, Opening, TrainOpening};
use crate::track::uid::Uid;
use crate::track::*;
use crate::twin::geometry::{Body, Shape};
use crate::twin::physics::{TrainState, WheelForces};
use crate::twin::random::Stream as Random;
use image::{GrayImage, Luma};
use nalgebra::{Isometry3, Point2, Point3, Rotation3, Unit, UnitQuaternion, Vector3};

/// How large a session to make up.
#[derive(Clone, Copy)]
pub(super) struct Size {
    pub(super) duration_s: f64,
    /// Divides the resolution of all cameras.
    pub(super) shrink: u32,
    pub(super) wayside: bool,
    pub(super) cars: usize,
}

const START_M: f64 = 60.0;
const SPEED_MPS: f64 = 15.0;
const BRAKE_FROM_S: f64 = 4.0;
const BRAKE_MPS2: f64 = 1.1;
const OBSTACLE_M: f64 = 245.0;

/// A 400 m line: straight, transition, 400 m curve; a polygon of a tunnel with lamps on the left.
pub(super) fn tunnel() -> Tunnel {
    let element = |length_m, start_per_m, end_per_m| PlanElement {
        length_m,
        start_per_m,
        end_per_m,
        start_cant_m: 0.0,
        end_cant_m: 0.0,
    };
    let plan = [
        element(100.0, 0.0, 0.0),
        element(60.0, 0.0, 1.0 / 400.0),
        element(240.0, 1.0 / 400.0, 1.0 / 400.0),
    ];
    let grade = Grade {
        from_m: 0.0,
        slope: 0.01,
        radius_m: 0.0,
    };
    let alignment = Alignment::new(Point3::new(5000.0, 8000.0, 20.0), 0.4, &plan, &[grade]);
    let lamps = (0..40).map(|k| lamp(&alignment, k)).collect();
    Tunnel {
        name: "made up".into(),
        sections: vec![SectionRange {
            from_m: 0.0,
            to_m: alignment.length_m(),
            section: section(),
        }],
        lamps,
        wayside: Vec::new(),
        balises: vec![Balise {
            name: "B1".into(),
            chainage_m: 120.0,
        }],
        base_stations: Vec::new(),
        line_number: 2,
        stations: Vec::new(),
        ambient_lx: 1.0,
        alignment,
    }
}

fn lamp(alignment: &Alignment, k: u16) -> LampSite {
    let (chainage_m, lateral_m, height_m) = (5.0 + 10.0 * f64::from(k), 2.4, 3.4);
    let left = alignment.at(chainage_m).world_from_line() * Vector3::y();
    LampSite {
        uid: Uid { line: 2, lamp: k },
        chainage_m,
        lateral_m,
        height_m,
        centre: alignment.world_from_track(TrackPoint {
            s_m: chainage_m,
            l_m: lateral_m,
            h_m: height_m,
        }),
        facing: Unit::new_normalize(-left),
        diameter_m: 0.25,
        power_w: 21.0,
        efficacy_lm_per_w: 100.0,
        beam_deg: 60.0,
        chip_s: 1e-4,
        code: uid::LineCode::Manchester,
    }
}

/// A circle of 3 m about 1.9 m over the rails, cut by the bed; the bed runs to the right, the
/// lining up the right wall and over.
fn section() -> CrossSection {
    let from = (-2.2f64 / 3.0).asin();
    let corners = 28;
    let points = (0..=corners).map(|k| {
        let angle = from + (std::f64::consts::PI - 2.0 * from) * f64::from(k) / f64::from(corners);
        OutlinePoint {
            l_m: -3.0 * angle.cos(),
            h_m: 1.9 + 3.0 * angle.sin(),
        }
    });
    let points: Vec<_> = points.collect();
    let mut materials = vec![Material::Lining; points.len()];
    *materials.last_mut().unwrap() = Material::Bed;
    CrossSection {
        points,
        materials,
        closed: true,
    }
}

fn camera(width_px: u32, height_px: u32, f_px: f64, shrink: u32) -> CameraModel {
    CameraModel {
        intrinsics: Intrinsics::centred(
            width_px / shrink,
            height_px / shrink,
            f_px / f64::from(shrink),
        ),
        shutter: Shutter {
            line_time_s: 22.2e-6,
            exposure_s: 30e-6,
            first_row: 0,
        },
        blur_px: 0.5,
    }
}

/// `vehicle_from_camera` of a camera that looks `yaw` to the left of forward and `pitch` up.
fn looking(place: Vector3<f64>, yaw_rad: f64, pitch_rad: f64) -> Isometry3<f64> {
    let forward = Rotation3::from_matrix_unchecked(nalgebra::Matrix3::new(
        0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0,
    ));
    let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), yaw_rad)
        * Rotation3::from_axis_angle(&Vector3::y_axis(), -pitch_rad)
        * forward;
    Isometry3::from_parts(place.into(), UnitQuaternion::from_rotation_matrix(&turn))
}

fn rig(shrink: u32) -> RigCalibration {
    RigCalibration::rectified(
        camera(1280, 720, 1040.0, shrink),
        0.12,
        looking(Vector3::new(0.2, 0.5, 1.9), 0.7, 0.3),
    )
}

fn device(alignment: &Alignment, shrink: u32) -> WaysideCalibration {
    let frame = alignment.at(205.0).world_from_line();
    WaysideCalibration {
        name: "W 205".into(),
        camera: camera(1920, 1080, 1500.0, shrink),
        world_from_camera: frame * looking(Vector3::new(0.0, -2.2, 3.2), 0.05, -0.06),
        world_from_lidar: None,
        chainage_m: 205.0,
        balise_chainage_m: 120.0,
    }
}

/// Way and speed of the train.
fn run(t_s: f64) -> (f64, f64) {
    let braking_s = (t_s - BRAKE_FROM_S).clamp(0.0, SPEED_MPS / BRAKE_MPS2);
    let free_s = t_s.min(BRAKE_FROM_S);
    let way_m = SPEED_MPS * (free_s + braking_s) - 0.5 * BRAKE_MPS2 * braking_s * braking_s;
    (START_M + way_m, SPEED_MPS - BRAKE_MPS2 * braking_s)
}

/// Plays the session to an observer, from open to close.
pub(super) fn play(observer: &mut dyn Observer, size: Size) {
    let tunnel = tunnel();
    let rig = rig(size.shrink);
    let devices = if size.wayside {
        vec![device(&tunnel.alignment, size.shrink)]
    } else {
        Vec::new()
    };
    let train = TrainOpening {
        id: TrainId(0),
        rig: Some(rig),
        car_half_extents_m: Vector3::new(9.5, 1.4, 1.7),
        cars: size.cars,
        radar: false,
        protection: size.cars > 0,
    };
    let opening = Opening {
        scenario: "made_up",
        seed: 7,
        tunnel: &tunnel,
        trains: &[train],
        wayside: &devices,
    };
    observer.open(&opening).unwrap();
    let mut session = Session {
        observer,
        tunnel: &tunnel,
        rig,
        devices: &devices,
        cars: size.cars,
        random: Random::new(7, 0, "trial"),
    };
    session.say(0.0, "scenario made_up begins");
    // Everything falls on multiples of 1/300 s.
    let ticks = (size.duration_s * 300.0) as u32;
    for tick in 0..=ticks {
        let t_s = f64::from(tick) / 300.0;
        if tick % 6 == 0 {
            session.train(t_s);
        }
        if tick % 30 == 0 {
            session.bodies(t_s);
            session.protection(t_s);
        }
        if tick % 10 == 0 {
            session.pair(t_s, tick / 10);
        }
        if tick % 30 == 0 && size.wayside {
            session.wayside(t_s, tick / 30);
        }
    }
    session.observer.close().unwrap();
}

struct Session<'a> {
    observer: &'a mut dyn Observer,
    tunnel: &'a Tunnel,
    rig: RigCalibration,
    devices: &'a [WaysideCalibration],
    cars: usize,
    random: Random,
}

impl Session<'_> {
    fn tell(&mut self, event: &Event<'_>) {
        self.observer.observe(event).unwrap();
    }

    fn message(&mut self, time: SimTime, content: Content) {
        let node = Node::Train(TrainId(0));
        let message = Message::own(node.clone(), time, content);
        self.tell(&Event::Message(&node, &message));
    }

    fn say(&mut self, t_s: f64, text: &str) {
        self.tell(&Event::Note(SimTime::from_secs(t_s), text));
    }

    fn vehicle(&self, t_s: f64) -> Isometry3<f64> {
        let sway = 0.01 * (t_s * 9.0).sin();
        self.tunnel.alignment.at(run(t_s).0).world_from_line()
            * Isometry3::rotation(Vector3::new(sway, 0.3 * sway, 0.0))
    }

    fn train(&mut self, t_s: f64) {
        let (chainage_m, speed_mps) = run(t_s);
        let car = |k: usize| {
            let middle = chainage_m - 9.8 - 19.6 * k as f64;
            self.tunnel.alignment.at(middle).world_from_line()
                * Isometry3::translation(0.0, 0.0, 2.1)
        };
        let wheel = WheelForces {
            normal_n: [68e3 + 4e3 * (t_s * 60.0).sin(), 69e3],
            lateral_n: 3e3 * (t_s * 9.0).sin(),
            along_n: -2e3,
            slip_mps: 0.01,
        };
        let truth = TrainState {
            time: SimTime::from_secs(t_s),
            chainage_m,
            speed_mps,
            world_from_vehicle: self.vehicle(t_s),
            world_from_cars: (0..self.cars).map(car).collect(),
            floor_accel_mps2: Vector3::new(
                0.0,
                0.2 * (t_s * 11.0).sin(),
                0.5 * (t_s * 23.0).sin() * (t_s * 3.0).cos(),
            ),
            primary_travel_m: 0.003 * (t_s * 31.0).sin(),
            secondary_travel_m: 0.012 * (t_s * 7.0).sin(),
            wheels: vec![wheel; 4 * self.cars],
            couplers_n: vec![-2e4; self.cars.saturating_sub(1)],
            ..TrainState::default()
        };
        let left = truth.world_from_vehicle * self.rig.vehicle_from_left;
        self.tell(&Event::Train(TrainId(0), &truth, Some(&left)));
    }

    fn bodies(&mut self, t_s: f64) {
        let at = |s_m: f64, l_m: f64, h_m: f64| {
            let frame = self.tunnel.alignment.at(s_m).world_from_line();
            frame * Isometry3::translation(0.0, l_m, h_m)
        };
        let body = |shape, world_from_body| Body {
            shape,
            world_from_body,
            velocity_mps: Vector3::zeros(),
            albedo: 0.4,
            luminance_cd_m2: 0.0,
        };
        let walk = -1.5 + 0.2 * t_s;
        let mut bodies = vec![
            body(Shape::Capsule(0.22, 0.5), at(OBSTACLE_M + 8.0, walk, 0.72)),
            body(Shape::Sphere(0.13), at(OBSTACLE_M + 8.0, walk, 1.6)),
            body(Shape::Cylinder(0.3, 0.4), at(OBSTACLE_M + 3.0, -1.2, 0.4)),
        ];
        if t_s >= 2.0 {
            let half = Vector3::new(0.4, 0.3, 0.25);
            bodies.push(body(Shape::Box(half), at(OBSTACLE_M, 0.2, 0.25)));
        }
        self.tell(&Event::Bodies(SimTime::from_secs(t_s), &bodies));
    }

    fn protection(&mut self, t_s: f64) {
        if self.cars == 0 {
            return;
        }
        let time = SimTime::from_secs(t_s);
        let (position_m, speed_mps) = run(t_s);
        let warned = t_s >= BRAKE_FROM_S - 0.5;
        let distance_m = warned.then_some(OBSTACLE_M - position_m);
        let permitted_mps = match distance_m {
            Some(d) => (2.0 * 1.0 * (d - 10.0).max(0.0)).sqrt().min(22.0),
            None => 22.0,
        };
        let display = DriverDisplay {
            power: true,
            lamp: if warned {
                Lamp::BrakeWarningRed
            } else {
                Lamp::NormalGreen
            },
            position_m: Some(position_m),
            distance_to_obstacle_m: distance_m,
            text: if warned {
                "Obstacle reported by W 205"
            } else {
                ""
            }
            .into(),
        };
        let brake = if t_s >= BRAKE_FROM_S {
            BrakeDemand::Service
        } else {
            BrakeDemand::None
        };
        let report = ProtectionReport {
            time,
            position_m: Some(position_m),
            sigma_m: Some(0.1),
            speed_mps: speed_mps + 0.05 * (t_s * 5.0).sin(),
            permitted_mps,
            service_mps: permitted_mps + 1.5,
            emergency_mps: permitted_mps + 2.5,
            command: TrainCommand {
                brake,
                permitted_speed_mps: permitted_mps,
            },
            display,
            ..ProtectionReport::default()
        };
        self.message(report.time, Content::Protection(report));
    }

    fn pair(&mut self, t_s: f64, number: u32) {
        let start = SimTime::from_secs(t_s);
        let world_from_left = self.vehicle(t_s) * self.rig.vehicle_from_left;
        let mut eyes = [Isometry3::identity(), self.rig.left_from_right]
            .map(|left_from_eye| self.eye(&(world_from_left * left_from_eye), number));
        let fixes = match eyes[0].2 {
            Some((uid, lamp)) => self.fixes(t_s, uid, lamp),
            None => Vec::new(),
        };
        let truths = vec![run(t_s).0; fixes.len()];
        let [left, right] = [0, 1].map(|k| {
            let image = std::mem::take(&mut eyes[k].0);
            Frame {
                number,
                start,
                exposure_s: 30e-6,
                gain_db: 0.0,
                image,
            }
        });
        let report = LedReport {
            best: Method::Paper,
            eyes: Default::default(),
            dark: Vec::new(),
            time: start,
            number,
            left: std::mem::take(&mut eyes[0].1),
            right: std::mem::take(&mut eyes[1].1),
            fixes,
        };
        self.tell(&Event::Pair(
            TrainId(0),
            &StereoPair { left, right },
            &report,
            &truths,
        ));
    }

    fn fixes(&self, t_s: f64, uid: Uid, lamp: Vector3<f64>) -> Vec<PositionFix> {
        let n = (t_s * 300.0) as u64;
        let make = |(k, (method, sigma_m)): (u64, (Method, f64))| {
            let chainage_m = run(t_s).0 + sigma_m * self.random.normal(n * 2 + k);
            PositionFix {
                time: SimTime::from_secs(t_s),
                method,
                chainage_m,
                sigma_m,
                position: self.tunnel.alignment.at(chainage_m).origin,
                uid,
                identity: Identity::Decoded,
                lamp_in_camera: lamp,
            }
        };
        let methods = [(Method::Paper, 0.12), (Method::Mono, 0.3)];
        (0..).zip(methods).map(make).collect()
    }

    /// Image, spots, and the nearest lamp seen.
    #[allow(
        clippy::type_complexity,
        reason = "three things of one image, used once"
    )]
    fn eye(
        &self,
        world_from_eye: &Isometry3<f64>,
        number: u32,
    ) -> (GrayImage, Vec<Spot>, Option<(Uid, Vector3<f64>)>) {
        let k = self.rig.left.intrinsics;
        let mut image = noise(k.width_px, k.height_px, self.random, number);
        let mut spots = Vec::new();
        let mut nearest: Option<(Uid, Vector3<f64>)> = None;
        for lamp in &self.tunnel.lamps {
            let p = world_from_eye.inverse_transform_point(&lamp.centre);
            let Some(centre) = k.project(&p).filter(|_| p.z < 25.0) else {
                continue;
            };
            let radius = 0.5 * lamp.diameter_m * k.fx_px / p.z;
            let (w, h) = (f64::from(k.width_px), f64::from(k.height_px));
            let (u, v) = (centre.x, centre.y);
            if u < radius || v < radius || u > w - radius - 1.0 || v > h - radius - 1.0 {
                continue;
            }
            disc(&mut image, centre, radius, |row| (row / 4) % 3 != 0);
            let uid = (p.z < 12.0).then_some((lamp.uid, Identity::Decoded));
            if uid.is_some() && nearest.is_none_or(|(_, q)| p.coords.norm() < q.norm()) {
                nearest = Some((lamp.uid, p.coords));
            }
            spots.push(Spot {
                bounds: around(centre, radius, radius),
                centre,
                ellipse: Some(Ellipse {
                    centre,
                    semi_major_px: radius,
                    semi_minor_px: 0.9 * radius,
                    angle_rad: 0.5,
                }),
                roundness: 0.98,
                cut: false,
                uid,
            });
        }
        (image, spots, nearest)
    }

    fn wayside(&mut self, t_s: f64, number: u32) {
        let device = &self.devices[0];
        let k = device.camera.intrinsics;
        let mut frame = noise(k.width_px, k.height_px, self.random, number + 100_000);
        let mut difference = noise(k.width_px, k.height_px, self.random, number + 200_000);
        let mut binary = GrayImage::new(k.width_px, k.height_px);
        let mut report = WaysideReport {
            time: SimTime::from_secs(t_s),
            number,
            obstacles: Vec::new(),
            blobs: Vec::new(),
            train_distance_m: None,
            train_distance_exact_m: None,
            train_affected: false,
            danger: DangerLevel::None,
            passage_possible: true,
            emergency_needed: false,
            plan: Plan::Pass,
            difference: None,
            binary: None,
            ..WaysideReport::default()
        };
        let position = self.tunnel.alignment.world_from_track(TrackPoint {
            s_m: OBSTACLE_M,
            l_m: 0.2,
            h_m: 0.0,
        });
        let p = device.world_from_camera.inverse_transform_point(&position);
        if let Some(foot) = k.project(&p).filter(|_| t_s >= 2.0) {
            let half = 0.3 * k.fx_px / p.z;
            let centre = Point2::new(foot.x, foot.y - half);
            for (image, bright) in [(&mut frame, 180), (&mut difference, 60), (&mut binary, 255)] {
                square(image, centre, half, bright);
            }
            let bounds = around(centre, half, half);
            let blob = Blob {
                bounds,
                area_px: (4.0 * half * half) as u32,
            };
            let distance_m = OBSTACLE_M - run(t_s).0;
            report.blobs.push(blob.clone());
            report.train_distance_m = Some(distance_m + 0.4);
            report.train_distance_exact_m = Some(distance_m);
            report.danger = DangerLevel::High;
            report.plan = Plan::BrakeAutomatically;
            report.obstacles.push(DetectedObstacle {
                blob,
                position,
                near_range_m: p.coords.norm(),
                near_angle_rad: 0.05,
                far_range_m: p.coords.norm() + 0.8,
                far_angle_rad: 0.05,
                from_chainage_m: OBSTACLE_M - 0.5,
                to_chainage_m: OBSTACLE_M + 0.5,
                lateral_m: 0.25,
                width_m: 0.62,
                height_m: 0.55,
                danger: DangerLevel::High,
            });
        }
        report.difference = Some(difference);
        report.binary = Some(binary);
        let frame = Frame {
            number,
            start: report.time,
            exposure_s: 16e-3,
            gain_db: 9.4,
            image: frame,
        };
        self.tell(&Event::Wayside(0, &frame, &report));
        if number == 35 {
            let warning = ObstacleWarning {
                device: device.name.clone(),
                number: 1,
                issued: SimTime::from_secs(t_s - 0.4),
                danger: DangerLevel::High,
                from_chainage_m: OBSTACLE_M - 0.5,
                to_chainage_m: OBSTACLE_M + 0.5,
                blind: false,
            };
            self.message(report.time, Content::Warning(warning));
        }
    }
}

/// Darkness with the noise of a real sensor, which is what makes images large.
fn noise(width: u32, height: u32, random: Random, frame: u32) -> GrayImage {
    let mut image = GrayImage::new(width, height);
    for (k, grey) in image.iter_mut().enumerate() {
        let word = random.words(frame, k as u32)[0];
        *grey = 10 + (word.count_ones() / 4) as u8;
    }
    image
}

fn disc(image: &mut GrayImage, centre: Point2<f64>, radius: f64, lit: impl Fn(u32) -> bool) {
    let bounds = around(centre, radius, radius);
    for v in bounds.v0..=bounds.v1 {
        for u in bounds.u0..=bounds.u1 {
            let (du, dv) = (f64::from(u) - centre.x, f64::from(v) - centre.y);
            if du.hypot(dv) <= radius && lit(v) {
                image.put_pixel(u, v, Luma([245]));
            }
        }
    }
}

fn square(image: &mut GrayImage, centre: Point2<f64>, half: f64, grey: u8) {
    let bounds = around(centre, half, half);
    for v in bounds.v0..=bounds.v1.min(image.height() - 1) {
        for u in bounds.u0..=bounds.u1.min(image.width() - 1) {
            image.put_pixel(u, v, Luma([grey]));
        }
    }
}

fn around(centre: Point2<f64>, half_u: f64, half_v: f64) -> PixelBox {
    PixelBox {
        u0: (centre.x - half_u).ceil().max(0.0) as u32,
        v0: (centre.y - half_v).ceil().max(0.0) as u32,
        u1: (centre.x + half_u).floor() as u32,
        v1: (centre.y + half_v).floor() as u32,
    }
}
