//! Where the bodies of a train are at the start: cars over the track as it lies, couplers closed.

use super::route_track::{RouteTrack, rail_axes};
use super::suspension::BodyState;
use super::vehicle::{AXLES, Vehicle};
use rapier3d_f64::math::{Rotation, Vector};

/// Bodies of a car: itself, front and rear bogie, four wheelsets from the front.
pub(super) const BODIES: usize = 7;

/// Whether body `k` of a train is a wheelset.
pub(super) fn is_wheelset(k: usize) -> bool {
    k % BODIES > 2
}

/// The body of an axle, counted from the front of the train.
pub(super) fn wheelset_of(axle: usize) -> usize {
    BODIES * (axle / AXLES) + 3 + axle % AXLES
}

/// Body `k` of a train, for messages.
pub(super) fn body_name(k: usize) -> String {
    let part = match k % BODIES {
        0 => "body".to_owned(),
        1 => "front bogie".to_owned(),
        2 => "rear bogie".to_owned(),
        w => format!("wheelset {}", w - 2),
    };
    format!("{part} of car {}", k / BODIES + 1)
}

/// One car after the other, the head of the train at a chainage, running.
pub(super) fn place_train(
    vehicle: &Vehicle,
    track: &RouteTrack,
    cars: u32,
    head_m: f64,
    speed_mps: f64,
) -> Vec<[BodyState; BODIES]> {
    let mut front_end: Option<Vector> = None;
    let mut front_m = head_m - (0.5 * vehicle.length_m - vehicle.semi_bogie_distance_m);
    let mut placed = Vec::new();
    for _ in 0..cars {
        let mut states = car(vehicle, track, front_m, speed_mps);
        // Where the track bends, cars are chords: their couplers shall meet all the same.
        if let Some(meet) = front_end {
            for _ in 0..6 {
                let gap = meet - states[0].point(vehicle.coupler_m(1.0));
                front_m += gap.dot(states[0].rotation * Vector::X);
                states = car(vehicle, track, front_m, speed_mps);
            }
        }
        front_end = Some(states[0].point(vehicle.coupler_m(-1.0)));
        front_m -= vehicle.length_m;
        placed.push(states);
    }
    placed
}

/// A car on the track, its front bogie at a chainage. Bogies point along the line and wheelsets stand on the
/// middle of the track as it lies, so on rough track a wheelset is pressed aside by up to some 13 kN until the
/// train has rolled two metres.
fn car(vehicle: &Vehicle, track: &RouteTrack, front_m: f64, speed_mps: f64) -> [BodyState; BODIES] {
    let distance = 2.0 * vehicle.semi_bogie_distance_m;
    let at = |s_m: f64, height_m: f64| on_rails(track, s_m, height_m, speed_mps);
    let front = at(front_m, vehicle.bogie_cg_m);
    let mut rear_m = front_m - distance;
    let mut rear = at(rear_m, vehicle.bogie_cg_m);
    for _ in 0..4 {
        rear_m -= distance - (front.position - rear.position).length();
        rear = at(rear_m, vehicle.bogie_cg_m);
    }
    // The car's x axis joins the bogies, its z axis leans as they do.
    let x = (front.position - rear.position).normalize();
    let lean = front.rotation * Vector::Z + rear.rotation * Vector::Z;
    let y = lean.cross(x).normalize();
    let z = x.cross(y);
    let middle = (front.position + rear.position) * 0.5;
    let body = BodyState {
        position: middle + z * (vehicle.car_cg_m - vehicle.bogie_cg_m),
        rotation: turned(x, y, z),
        velocity: (front.velocity + rear.velocity) * 0.5,
        angular: (front.angular + rear.angular) * 0.5,
    };
    let radius = vehicle.wheel_radius_m;
    let wheelset = |s_m: f64| {
        let mut state = at(s_m, radius);
        state.angular += state.rotation * Vector::Y * (speed_mps / radius);
        state
    };
    let half = vehicle.semi_wheelbase_m;
    let [a, b, c, d] = [front_m + half, front_m - half, rear_m + half, rear_m - half].map(wheelset);
    [body, front, rear, a, b, c, d]
}

/// A body over the rails that runs along them.
fn on_rails(track: &RouteTrack, s_m: f64, height_m: f64, speed_mps: f64) -> BodyState {
    let frame = track.alignment().at(s_m);
    let (origin, axes) = rail_axes(&frame);
    let d = track.deviation_at(s_m);
    BodyState {
        position: origin + axes.y * d.left_m + axes.z * (d.up_m + height_m),
        rotation: turned(axes.x, axes.y, axes.z),
        velocity: axes.x * speed_mps,
        angular: Vector::Z * (speed_mps * frame.curvature_per_m),
    }
}

fn turned(x: Vector, y: Vector, z: Vector) -> Rotation {
    let axes = nalgebra::Matrix3::from_columns(&[x.into(), y.into(), z.into()]);
    let axes = nalgebra::Rotation3::from_matrix_unchecked(axes);
    nalgebra::UnitQuaternion::from_rotation_matrix(&axes).into()
}
