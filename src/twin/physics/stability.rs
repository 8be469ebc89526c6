//! The longest step that a train can be moved by.
//!
//! A mass m on k and c, moved by symplectic Euler with forces from the start of the step, is stable
//! while k dt^2 + 2 c dt < 4 m. Bodies that hang together swing at most twice as fast, squared, as
//! each would between fixed neighbours (Gershgorin's circles, two bodies to a spring), so half of it
//! is allowed here.

use super::vehicle::{FLANGE_STIFFNESS_N_M, HALF_CONTACT_M, Vehicle};
use rapier3d_f64::math::Vector;

/// The longest step, and what limits it, for rails of a stiffness and damping under a wheel.
pub(super) fn longest_step_s(v: &Vehicle, support: (f64, f64)) -> (f64, &'static str) {
    let turned = |e: Vector, arm: Vector| {
        Vector::new(
            e.y * arm.z * arm.z + e.z * arm.y * arm.y,
            e.x * arm.z * arm.z + e.z * arm.x * arm.x,
            e.x * arm.y * arm.y + e.y * arm.x * arm.x,
        )
    };
    let half = v.half_primary_m;
    let at_axle = Vector::Y * half;
    let at_box = Vector::new(v.semi_wheelbase_m, half, v.wheel_radius_m - v.bogie_cg_m);
    let at_side = Vector::new(0.0, v.half_secondary_m, v.secondary_m - v.bogie_cg_m);
    let at_car = Vector::new(
        v.semi_bogie_distance_m,
        v.half_secondary_m,
        v.secondary_m - v.car_cg_m,
    );
    // Shift and turn of wheelset, bogie and car against fixed neighbours; of stiffness, or damping.
    let of_bodies = |primary: Vector, side: Vector, rail: f64, flange: Vector| {
        let down = Vector::Z * (2.0 * rail);
        let roll = Vector::X * (2.0 * rail * HALF_CONTACT_M * HALF_CONTACT_M);
        [
            [
                primary * 2.0 + down + flange,
                turned(primary, at_axle) * 2.0 + roll,
            ],
            [
                primary * 4.0 + side * 2.0,
                turned(primary, at_box) * 4.0 + turned(side, at_side) * 2.0,
            ],
            [side * 4.0, turned(side, at_car) * 4.0],
        ]
    };
    let ((side_k, side_c), primary) = (bogie_side(v), v.primary);
    let flange = Vector::Y * FLANGE_STIFFNESS_N_M;
    let stiffness = of_bodies(primary.stiffness_n_m, side_k, support.0, flange);
    let damping = of_bodies(primary.damping_n_s_m, side_c, support.1, Vector::ZERO);
    let bodies = [
        ("a wheelset", v.wheelset),
        ("a bogie", v.bogie),
        ("the car body", v.car),
    ];
    let mut longest = (f64::INFINITY, "nothing");
    for (((name, mass), k), c) in bodies.into_iter().zip(stiffness).zip(damping) {
        let shift = (k[0] / mass.kg, c[0] / mass.kg);
        let turn = (k[1] / mass.kg_m2, c[1] / mass.kg_m2);
        for (k, c) in [shift, turn] {
            for (k, c) in k.to_array().into_iter().zip(c.to_array()) {
                let step_s = 2.0 / (c + (c * c + 2.0 * k).sqrt());
                if step_s < longest.0 {
                    longest = (step_s, name);
                }
            }
        }
    }
    longest
}

/// Stiffness and damping of a bogie's side, with its share of traction rod, stops and roll bar.
fn bogie_side(v: &Vehicle) -> (Vector, Vector) {
    let (rod_k, rod_c) = v.traction_rod;
    let bar = v.roll_bar_n_m_rad / (2.0 * v.half_secondary_m * v.half_secondary_m);
    let stop = Vector::new(0.0, v.stop.1, v.stop.1);
    let k = v.secondary.stiffness_n_m + Vector::new(0.5 * rod_k, 0.0, bar) + stop;
    (k, v.secondary.damping_n_s_m + Vector::X * (0.5 * rod_c))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::twin::physics::VehicleFile;

    /// Fails where the cars that come with the program cannot be moved by the steps that settings
    /// allow, or where a car that bursts apart (a light wheelset on stiff rails) passes.
    #[test]
    fn shipped_cars_bear_any_step() {
        for name in VehicleFile::shipped_names() {
            let car = Vehicle::new(VehicleFile::shipped(name).unwrap());
            let (step_s, what) = longest_step_s(&car, (100e6, 60e3));
            assert!(
                (0.002..0.01).contains(&step_s),
                "{name}: {step_s} by {what}"
            );
            assert!(longest_step_s(&car, (500e6, 300e3)).0 < 0.002);
        }
        let mut file = VehicleFile::shipped("metro_b1_empty").unwrap().clone();
        file.wheelset.mass_kg = 500.0;
        file.wheelset.inertia_kg_m2 = [20.0; 3];
        let (step_s, what) = longest_step_s(&Vehicle::new(&file), (100e6, 60e3));
        assert!(step_s < 0.001 && what == "a wheelset");
    }
}
