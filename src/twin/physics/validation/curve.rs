//! Curves: how far a car leans, what its passengers feel, and how it gets there.
//!
//! In the rails' plane a curve of radius R under cant phi pulls outwards and presses with
//!
//! ```text
//! a_q = v^2/R cos phi - g sin phi        g_q = g cos phi + v^2/R sin phi
//! ```
//!
//! The seven bodies give way to m a_q on the springs of the linear model, whose weights press with
//! g_q: K q = -m a_q. Where in the gauge the wheelsets run does not matter for that: the flanges
//! hold each bogie's share. With the roll r of the car the floor feels a_q cos r + g_q sin r.

use super::model::{CAR, G_MPS2, LinearModel, ROLL, Under, Y, dof};
use super::*;
use nalgebra::{DVector, Vector3};
use rapier3d_f64::math::Vector;

/// A curve to the left, and the car that runs in it.
struct CurveCase {
    vehicle: &'static str,
    radius_m: f64,
    cant_m: f64,
    kmh: f64,
}

/// What the closed form says.
struct Steady {
    /// In the rails' plane, outwards.
    plane_mps2: f64,
    /// Across the floor.
    floor_mps2: f64,
    /// Of the car against the rails, outwards.
    roll_rad: f64,
}

impl CurveCase {
    fn steady(&self) -> Steady {
        let file = shipped(self.vehicle);
        let v = self.kmh / 3.6;
        let (sin, cos) = (self.cant_m / 1.5).asin().sin_cos();
        let pull = v * v / self.radius_m;
        let (plane_mps2, weight_mps2) = (pull * cos - G_MPS2 * sin, G_MPS2 * cos + pull * sin);
        let under = Under {
            weight_mps2,
            flange_n_m: 40e6,
            ..Under::dry(0.0)
        };
        let model = LinearModel::new(&file, under).lateral();
        let mut force = DVector::zeros(model.dofs.len());
        for body in 0..7 {
            let y = model.place(dof(body, Y));
            force[y] = -model.mass[(y, y)] * plane_mps2;
        }
        let q = model.stiffness.clone().lu().solve(&force).unwrap();
        let roll_rad = q[model.place(dof(CAR, ROLL))];
        Steady {
            plane_mps2,
            roll_rad,
            floor_mps2: plane_mps2 * roll_rad.cos() + weight_mps2 * roll_rad.sin(),
        }
    }

    fn settings(&self) -> PhysicsSettings {
        let train = TrainSettings {
            start_chainage_m: 900.0,
            ..free_car(shipped(self.vehicle), self.kmh)
        };
        on_track(train, IrregularityClass::None)
    }

    /// A world that has run in on the whole circle.
    fn world(&self) -> World {
        let arc = PlanElement::arc(1500.0, 1.0 / self.radius_m, self.cant_m);
        World::new(line(&[arc], 0.0), &self.settings(), 1, 0).unwrap()
    }
}

/// A step at constant speed.
fn hold(world: &mut World, kmh: f64) {
    step_with(world, Effort::default(), Some(kmh / 3.6));
}

/// Floor over the first bogie: what a passenger feels across, and its roll against the rails there.
fn felt(world: &World) -> (f64, f64) {
    let consist = consist(world);
    let across = consist.states[0].rotation * Vector::Y;
    let bogie_m = 0.5 * (consist.wheelsets[0].s_m + consist.wheelsets[1].s_m);
    let rails = world
        .tunnel
        .first_track()
        .alignment
        .at(bogie_m)
        .world_from_rails()
        .rotation;
    let along = rails * Vector3::x();
    let y = Vector3::from(across);
    // The angle from the rails' own left to the car's, about the track.
    let roll = along.dot(&(rails * Vector3::y()).cross(&y));
    (
        consist.floor_accel_mps2(world.step_s).y + G_MPS2 * across.z,
        roll,
    )
}

/// Fails where the sway of the car, its roll on secondary springs, primary springs and rails, the
/// weight's moment or the effect of cant is wrong: below, at and above the balanced speed.
#[test]
fn val_steady_curve() {
    for (vehicle, radius_m, speeds) in [
        ("metro_b1_crush", 300.0, [30.0, 50.8, 62.0]),
        ("metro_b1_empty", 400.0, [40.0, 58.7, 75.0]),
        ("manchester", 400.0, [40.0, 58.7, 75.0]),
    ] {
        for kmh in speeds {
            let curve = CurveCase {
                vehicle,
                radius_m,
                cant_m: 0.1,
                kmh,
            };
            let want = curve.steady();
            let mut world = curve.world();
            let (mut floor, mut roll, mut n) = (0.0, 0.0, 0.0);
            for k in 0..20_000 {
                hold(&mut world, kmh);
                if k >= 12_000 {
                    let (across, leans) = felt(&world);
                    (floor, roll, n) = (floor + across, roll + leans, n + 1.0);
                }
            }
            let (floor, roll) = (floor / n, roll / n);
            eprintln!(
                "{vehicle} R {radius_m} m {kmh} km/h: plane {:+.4} m/s^2; floor {floor:+.4}, closed form {:+.4}; roll {:+.4} mrad, closed form {:+.4}",
                want.plane_mps2,
                want.floor_mps2,
                1e3 * roll,
                1e3 * want.roll_rad
            );
            let (v, yaw) = (kmh / 3.6, consist(&world).states[0].angular.z);
            assert!((yaw * radius_m / v - 1.0).abs() < 0.005, "{yaw} rad/s");
            let close =
                |got: f64, want: f64, least: f64| (got - want).abs() < 0.006 * want.abs() + least;
            assert!(close(floor, want.floor_mps2, 1e-3));
            assert!(close(roll, want.roll_rad, 2e-5));
        }
    }
}

/// Fails where a train that starts in a curve starts upright: its first two seconds are steady.
#[test]
fn val_start_in_a_curve() {
    let curve = CurveCase {
        vehicle: "metro_b1_crush",
        radius_m: 300.0,
        cant_m: 0.1,
        kmh: 62.0,
    };
    let want = curve.steady().floor_mps2;
    let mut world = curve.world();
    let mut worst = 0.0f64;
    for _ in 0..2000 {
        coast(&mut world);
        worst = worst.max((felt(&world).0 - want).abs());
    }
    eprintln!("first 2 s: at most {worst:.4} m/s^2 off {want:.4}");
    assert!(worst < 0.02 * want);
}

/// Fails where a transition curve jerks. Floor over the first bogie, mean over 0.2 s, in and out of
/// a curve through clothoids with ramps of cant: the steady value s a_q grows at the rate
/// r = s a_q v / L. An oscillator of frequency w that is pulled so lags by no more than 2 r / w without
/// any damping, and moves no faster than 2 r; out of two such kinks come no more than twice as
/// much.
#[test]
fn val_transition() {
    let (kmh, ramp_m) = (62.0, 60.0);
    let curve = CurveCase {
        vehicle: "metro_b1_crush",
        radius_m: 300.0,
        cant_m: 0.1,
        kmh,
    };
    let steady = curve.steady();
    let bend = |start_per_m: f64, end_per_m: f64, length_m: f64| PlanElement {
        length_m,
        start_per_m,
        end_per_m,
        start_cant_m: 0.1 * 300.0 * start_per_m,
        end_cant_m: 0.1 * 300.0 * end_per_m,
    };
    let full = 1.0 / 300.0;
    let plan = [
        PlanElement::straight(1000.0),
        bend(0.0, full, ramp_m),
        bend(full, full, 100.0),
        bend(full, 0.0, ramp_m),
        PlanElement::straight(300.0),
    ];
    let mut world = World::new(line(&plan, 0.0), &curve.settings(), 1, 0).unwrap();
    let v = kmh / 3.6;
    let file = shipped("metro_b1_crush");
    let slowest = &LinearModel::new(&file, Under::dry(v)).lateral().modes()[0];
    let rate = steady.floor_mps2 * v / ramp_m;
    let (mut worst, mut fastest, mut before) = (0.0f64, 0.0f64, None);
    for _ in 0..120 {
        let (mut mean, mut want) = (0.0, 0.0);
        for _ in 0..200 {
            hold(&mut world, kmh);
            mean += felt(&world).0 / 200.0;
            let wheelsets = &consist(&world).wheelsets;
            let s_m = 0.5 * (wheelsets[0].s_m + wheelsets[1].s_m) - 1000.0;
            let share = (s_m / ramp_m)
                .clamp(0.0, 1.0)
                .min((2.0 * ramp_m + 100.0 - s_m) / ramp_m)
                .max(0.0);
            want += share * steady.floor_mps2 / 200.0;
        }
        worst = worst.max((mean - want).abs());
        if let Some(before) = before.replace(mean) {
            fastest = fastest.max((mean - before).abs() / 0.2);
        }
    }
    let (lag, speed) = (4.0 * rate / slowest.value.im, 4.0 * rate);
    eprintln!(
        "clothoid: {:.3} m/s^2 at {rate:.3} m/s^3; off the closed form by {worst:.4} m/s^2 of {lag:.4}, changes by {fastest:.3} m/s^3 of {speed:.3}",
        steady.floor_mps2
    );
    assert!(worst < lag && fastest < speed && fastest > 0.8 * rate);
}
