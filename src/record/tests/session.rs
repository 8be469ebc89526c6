//! A made-up session: a train runs through a small tunnel towards a box on the track and brakes
//! for it. No physics and no stack, only events of the right shape, so that a recording can be
//! tried alone.

use crate::bus::*;
use crate::session::{Event, Observer, Opening, TrainOpening};
use crate::track::geodesy::{Datum, Geodetic};
use crate::track::uid::Uid;
use crate::track::{
    Alignment, Balise, Grade, Place, PlanElement, Track, TrackId, TrackPoint, Tunnel,
};
use crate::twin::geometry::{Body, Shape};
use crate::twin::physics::{TrainState, WheelForces};
use crate::twin::render::sample;
use image::{GrayImage, Luma};
use nalgebra::{Isometry3, Point2, Point3, Vector3};

/// What a session has.
#[derive(Clone, Copy)]
pub(crate) struct Extent {
    pub(crate) duration_s: f64,
    pub(crate) wayside: bool,
    pub(crate) cars: usize,
}

const START_M: f64 = 60.0;
const SPEED_MPS: f64 = 15.0;
const BRAKE_FROM_S: f64 = 2.0;
const BRAKE_MPS2: f64 = 1.1;
/// Where the box lies, and when it comes to lie there.
const OBSTACLE_M: f64 = 245.0;
const OBSTACLE_FROM_S: f64 = 1.0;
/// Columns and rows of all images.
const SIZE: (u32, u32) = (160, 90);

/// A straight, a transition and a curve of 400 m radius, on a grade.
pub(crate) fn tunnel() -> Tunnel {
    let place = Geodetic {
        latitude_deg: 30.6,
        longitude_deg: 104.1,
        height_m: 500.0,
    };
    Tunnel {
        datum: Some(Datum {
            place,
            heading_deg: 0.0,
        }),
        ..Tunnel::of_one(track())
    }
}

fn track() -> Track {
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
        element(sample::LENGTH_M - 160.0, 1.0 / 400.0, 1.0 / 400.0),
    ];
    let grade = Grade {
        from_m: 0.0,
        slope: 0.01,
        radius_m: 0.0,
    };
    Track {
        alignment: Alignment::new(Point3::new(5000.0, 8000.0, 20.0), 0.4, &plan, &[grade]),
        balises: vec![Balise {
            name: "B1".into(),
            chainage_m: 120.0,
        }],
        ..sample::track()
    }
}

fn camera(f_px: f64) -> CameraModel {
    CameraModel {
        intrinsics: Intrinsics::centred(SIZE.0, SIZE.1, f_px),
        shutter: Shutter {
            line_time_s: 22.2e-6,
            exposure_s: 30e-6,
            first_row: 0,
        },
        blur_px: 0.5,
    }
}

fn device(track: &Track) -> WaysideCalibration {
    let place = TrackPoint {
        s_m: 205.0,
        l_m: -2.2,
        h_m: 3.2,
    };
    WaysideCalibration {
        track: TrackId::default(),
        name: "W 205".into(),
        camera: camera(190.0),
        world_from_camera: sample::camera_pose(track, place, 0.05, -0.06),
        world_from_lidar: None,
        chainage_m: 205.0,
        balise_chainage_m: 120.0,
    }
}

/// Chainage and speed of the train.
fn run(t_s: f64) -> (f64, f64) {
    let braking_s = (t_s - BRAKE_FROM_S).clamp(0.0, SPEED_MPS / BRAKE_MPS2);
    let free_s = t_s.min(BRAKE_FROM_S);
    let way_m = SPEED_MPS * (free_s + braking_s) - 0.5 * BRAKE_MPS2 * braking_s * braking_s;
    (START_M + way_m, SPEED_MPS - BRAKE_MPS2 * braking_s)
}

/// Plays the session to an observer, from open to close.
pub(crate) fn play(observer: &mut dyn Observer, extent: Extent) {
    let tunnel = tunnel();
    let mount = Isometry3::translation(0.2, 0.5, 1.9);
    let rig = RigCalibration::rectified(camera(130.0), 0.12, mount);
    let device = device(tunnel.first_track());
    let train = TrainOpening {
        id: TrainId(0),
        rig: Some(rig),
        car_half_extents_m: Vector3::new(9.5, 1.4, 1.7),
        cars: extent.cars,
        radar: false,
        occupancy: false,
        protection: extent.cars > 0,
    };
    let opening = Opening {
        trains: &[train],
        wayside: if extent.wayside {
            std::slice::from_ref(&device)
        } else {
            &[]
        },
        ..super::bare("made_up", &tunnel)
    };
    observer.open(&opening).unwrap();
    let mut session = Session {
        observer,
        opening: &opening,
        rig: &rig,
    };
    session.event(&Event::Note {
        time: SimTime::ZERO,
        text: "scenario made_up begins",
    });
    // Everything falls on multiples of 1/300 s.
    for tick in 0..=(extent.duration_s * 300.0) as u32 {
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
        if tick % 30 == 0 {
            session.wayside(t_s, tick / 30);
        }
    }
    session.observer.close().unwrap();
}

struct Session<'a> {
    observer: &'a mut dyn Observer,
    opening: &'a Opening<'a>,
    rig: &'a RigCalibration,
}

impl Session<'_> {
    fn event(&mut self, event: &Event<'_>) {
        self.observer.observe(event).unwrap();
    }

    /// A place on the line, in its axes.
    fn place(&self, s_m: f64, l_m: f64, h_m: f64) -> Isometry3<f64> {
        let frame = self
            .opening
            .tunnel
            .first_track()
            .alignment
            .at(s_m)
            .world_from_line();
        frame * Isometry3::translation(0.0, l_m, h_m)
    }

    fn train(&mut self, t_s: f64) {
        let (chainage_m, speed_mps) = run(t_s);
        let cars = self.opening.trains[0].cars;
        let car = |k: usize| self.place(chainage_m - 9.8 - 19.6 * k as f64, 0.0, 2.1);
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
            world_from_vehicle: self.place(chainage_m, 0.0, 0.0),
            world_from_cars: (0..cars).map(car).collect(),
            floor_accel_mps2: Vector3::new(0.0, 0.2, 0.5 * (t_s * 23.0).sin()),
            primary_travel_m: 0.003,
            secondary_travel_m: 0.012,
            wheels: vec![wheel; 4 * cars],
            couplers_n: vec![-2e4; cars.saturating_sub(1)],
            ..TrainState::default()
        };
        let left = truth.world_from_vehicle * self.rig.vehicle_from_left;
        self.event(&Event::Train {
            train: TrainId(0),
            truth: &truth,
            left_eye: Some(&left),
        });
    }

    fn bodies(&mut self, t_s: f64) {
        let body = |shape, world_from_body| Body {
            shape,
            world_from_body,
            velocity_mps: Vector3::zeros(),
            albedo: 0.4,
            luminance_cd_m2: 0.0,
        };
        let at = |l_m, h_m| self.place(OBSTACLE_M, l_m, h_m);
        let mut bodies = vec![
            body(Shape::Capsule(0.22, 0.5), at(-1.5 + 0.2 * t_s, 0.72)),
            body(Shape::Sphere(0.13), at(-1.5 + 0.2 * t_s, 1.6)),
            body(Shape::Cylinder(0.3, 0.4), at(-1.2, 0.4)),
        ];
        if t_s >= OBSTACLE_FROM_S {
            let half = Vector3::new(0.4, 0.3, 0.25);
            bodies.push(body(Shape::Box(half), at(0.2, 0.25)));
        }
        self.event(&Event::Bodies {
            time: SimTime::from_secs(t_s),
            bodies: &bodies,
        });
        let blade = Shape::Box(Vector3::new(1.2, 0.02, 0.08));
        let blade = body(blade, self.place(OBSTACLE_M, 0.7, -0.08));
        self.event(&Event::Blades {
            time: SimTime::from_secs(t_s),
            bodies: &[blade],
        });
    }

    fn protection(&mut self, t_s: f64) {
        if !self.opening.trains[0].protection {
            return;
        }
        let (position_m, speed_mps) = run(t_s);
        let is_warned = t_s >= BRAKE_FROM_S;
        let distance_m = is_warned.then_some(OBSTACLE_M - position_m);
        let permitted_mps = distance_m.map_or(22.0, |d| (2.0 * (d - 10.0)).max(0.0).sqrt());
        let (brake, lamp) = match is_warned {
            true => (BrakeDemand::Service, Indicator::BrakeWarningRed),
            false => (BrakeDemand::None, Indicator::NormalGreen),
        };
        let report = ProtectionReport {
            time: SimTime::from_secs(t_s),
            position: Some(Place::on_first_track(position_m)),
            sigma_m: Some(0.1),
            speed_mps,
            permitted_mps,
            service_mps: permitted_mps + 1.5,
            emergency_mps: permitted_mps + 2.5,
            command: TrainCommand {
                brake,
                permitted_speed_mps: permitted_mps,
            },
            display: DriverDisplay {
                power: true,
                lamp,
                position: Some(Place::on_first_track(position_m)),
                distance_to_obstacle_m: distance_m,
                text: "Obstacle reported by W 205".into(),
            },
            ..ProtectionReport::default()
        };
        super::message(self.observer, report.time, Content::Protection(report));
    }

    /// Each eye sees a lamp with its name and one without.
    fn pair(&mut self, t_s: f64, number: u32) {
        let time = SimTime::from_secs(t_s);
        let uid = Uid { line: 1, lamp: 9 };
        let spots = vec![spot(40.0, Some((uid, Identity::Decoded))), spot(90.0, None)];
        let fix = |(method, sigma_m): (Method, f64)| {
            let chainage_m = run(t_s).0 + sigma_m * (t_s * 11.0).sin();
            PositionFix {
                track: TrackId::default(),
                time,
                method,
                chainage_m,
                sigma_m,
                position: self
                    .opening
                    .tunnel
                    .first_track()
                    .alignment
                    .at(chainage_m)
                    .origin,
                uid,
                identity: Identity::Decoded,
                lamp_in_camera: Vector3::new(-1.0, -2.0, 8.0),
            }
        };
        let report = LedReport {
            best: Method::Stereo,
            eyes: Default::default(),
            dark: Vec::new(),
            time,
            number,
            left: spots.clone(),
            right: spots,
            fixes: [(Method::Stereo, 0.12), (Method::Mono, 0.3)]
                .map(fix)
                .into(),
        };
        let pair = StereoPair {
            left: frame(time, number),
            right: frame(time, number),
        };
        let truths_m = [run(t_s).0; 2];
        self.event(&Event::Pair {
            train: TrainId(0),
            pair: &pair,
            report: &report,
            true_chainages_m: &truths_m,
        });
    }

    fn wayside(&mut self, t_s: f64, number: u32) {
        let Some(device) = self.opening.wayside.first() else {
            return;
        };
        let frame = frame(SimTime::from_secs(t_s), number);
        let mut report = WaysideReport {
            time: frame.start,
            number,
            difference: Some(frame.image.clone()),
            binary: Some(frame.image.clone()),
            ..WaysideReport::default()
        };
        if t_s >= OBSTACLE_FROM_S {
            let obstacle = obstacle(self.place(OBSTACLE_M, 0.2, 0.0));
            let distance_m = OBSTACLE_M - run(t_s).0;
            report.blobs.push(obstacle.blob.clone());
            report.train_distance_m = Some(distance_m + 0.4);
            report.train_distance_exact_m = Some(distance_m);
            report.danger = DangerLevel::High;
            report.obstacles.push(obstacle);
        }
        self.event(&Event::Wayside {
            post: 0,
            frame: &frame,
            report: &report,
        });
        if number == 15 {
            let warning = super::warning(&device.name, t_s, DangerLevel::High);
            super::message(self.observer, report.time, warning);
        }
    }
}

fn frame(start: SimTime, number: u32) -> Frame {
    Frame {
        number,
        start,
        exposure_s: 30e-6,
        gain_db: 9.4,
        image: GrayImage::from_fn(SIZE.0, SIZE.1, |u, v| Luma([10 + ((u ^ v) % 7) as u8])),
    }
}

fn spot(u: f64, uid: Option<(Uid, Identity)>) -> Spot {
    let centre = Point2::new(u, 30.0);
    Spot {
        bounds: around(centre, 8.0),
        centre,
        ellipse: Some(Ellipse {
            centre,
            semi_major_px: 8.0,
            semi_minor_px: 7.0,
            angle_rad: 0.5,
        }),
        roundness: 0.98,
        cut: false,
        uid,
    }
}

fn obstacle(foot: Isometry3<f64>) -> DetectedObstacle {
    DetectedObstacle {
        blob: Blob {
            bounds: around(Point2::new(80.0, 50.0), 5.0),
            area_px: 100,
        },
        position: foot.translation.vector.into(),
        near_range_m: 40.0,
        near_angle_rad: 0.05,
        far_range_m: 40.8,
        far_angle_rad: 0.05,
        from_chainage_m: OBSTACLE_M - 0.5,
        to_chainage_m: OBSTACLE_M + 0.5,
        lateral_m: 0.25,
        width_m: 0.62,
        height_m: 0.55,
        danger: DangerLevel::High,
    }
}

fn around(centre: Point2<f64>, half: f64) -> PixelBox {
    PixelBox {
        u0: (centre.x - half) as u32,
        v0: (centre.y - half) as u32,
        u1: (centre.x + half) as u32,
        v1: (centre.y + half) as u32,
    }
}
