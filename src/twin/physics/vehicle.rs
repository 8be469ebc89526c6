//! A car in SI units, as the forces need it.

use super::vehicle_file::VehicleFile;
use rapier3d_f64::math::Vector;

/// Standard gravity.
pub(super) const GRAVITY_MPS2: f64 = 9.806_65;
/// Half the distance of the wheels' contact points (1435 mm gauge).
pub(super) const HALF_CONTACT_M: f64 = 0.75;
/// Wheelsets of a car.
pub(super) const AXLES: usize = 4;
/// Stiffness of a rail under a flange: sideways, it gives more than downwards.
pub(super) const FLANGE_STIFFNESS_N_M: f64 = 40e6;

/// Springs and dampers of one element along its x, y and z, under a static load along z.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Element {
    pub stiffness_n_m: Vector,
    pub damping_n_s_m: Vector,
    pub preload_n: f64,
}

/// Mass and moments of inertia of a body.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Mass {
    pub kg: f64,
    /// Roll, pitch, yaw.
    pub kg_m2: Vector,
}

/// A car in SI units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Vehicle {
    pub length_m: f64,
    pub width_m: f64,
    pub height_m: f64,
    pub floor_m: f64,
    pub car: Mass,
    pub bogie: Mass,
    /// With the rotating parts that are geared to it.
    pub wheelset: Mass,
    pub car_cg_m: f64,
    pub bogie_cg_m: f64,
    pub semi_bogie_distance_m: f64,
    pub semi_wheelbase_m: f64,
    pub wheel_radius_m: f64,
    /// Of each axle box.
    pub primary: Element,
    /// Half the lateral distance of axle boxes.
    pub half_primary_m: f64,
    /// Of each side of a bogie.
    pub secondary: Element,
    pub half_secondary_m: f64,
    /// Where the secondary springs act.
    pub secondary_m: f64,
    pub roll_bar_n_m_rad: f64,
    /// Stiffness and damping, along.
    pub traction_rod: (f64, f64),
    /// Play and stiffness.
    pub stop: (f64, f64),
    pub coupler: Coupler,
}

/// A coupler in SI units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Coupler {
    pub height_m: f64,
    pub stiffness_n_m: f64,
    pub damping_n_s_m: f64,
    pub slack_m: f64,
}

impl Vehicle {
    pub(super) fn new(file: &VehicleFile) -> Self {
        let (b, g, w) = (&file.body, &file.bogie, &file.wheelset);
        let (p, s, c) = (&file.primary, &file.secondary, &file.coupler);
        let total_kg = b.mass_kg + 2.0 * g.mass_kg + 4.0 * w.mass_kg;
        let [roll, axle, yaw] = w.inertia_kg_m2;
        // A quarter of the car's rotating parts turn with each wheelset.
        let rotating = 0.25 * w.rotating_mass_share * total_kg * w.radius_m.powi(2);
        let element = |stiffness: [f64; 3], damping: [f64; 3], preload_n| Element {
            stiffness_n_m: Vector::from(stiffness) * 1e6,
            damping_n_s_m: Vector::from(damping) * 1e3,
            preload_n,
        };
        let mass = |kg, inertia: [f64; 3]| Mass {
            kg,
            kg_m2: Vector::from(inertia),
        };
        let on_primary_n = 0.25 * GRAVITY_MPS2 * (0.5 * b.mass_kg + g.mass_kg);
        Self {
            length_m: b.length_m,
            width_m: b.width_m,
            height_m: b.height_m,
            floor_m: b.floor_m,
            car: mass(b.mass_kg, b.inertia_kg_m2),
            bogie: mass(g.mass_kg, g.inertia_kg_m2),
            wheelset: mass(w.mass_kg, [roll, rotating.max(axle), yaw]),
            car_cg_m: b.cg_m,
            bogie_cg_m: g.cg_m,
            semi_bogie_distance_m: 0.5 * g.distance_m,
            semi_wheelbase_m: 0.5 * g.wheelbase_m,
            wheel_radius_m: w.radius_m,
            primary: element(p.stiffness_mn_m, p.damping_kn_s_m, on_primary_n),
            half_primary_m: 0.5 * p.base_m,
            secondary: element(
                s.stiffness_mn_m,
                s.damping_kn_s_m,
                0.25 * GRAVITY_MPS2 * b.mass_kg,
            ),
            half_secondary_m: 0.5 * s.base_m,
            secondary_m: s.height_m,
            roll_bar_n_m_rad: 1e6 * s.roll_bar_mn_m_rad,
            traction_rod: (1e6 * s.traction_rod_mn_m, 1e3 * s.traction_rod_kn_s_m),
            stop: (s.stop_play_m, 1e6 * s.stop_mn_m),
            coupler: Coupler {
                height_m: c.height_m,
                stiffness_n_m: 1e6 * c.stiffness_mn_m,
                damping_n_s_m: 1e3 * c.damping_kn_s_m,
                slack_m: c.slack_m,
            },
        }
    }

    /// The coupler in the body's frame: 1 at the front end, -1 at the rear.
    pub(super) fn coupler_m(&self, end: f64) -> Vector {
        let height_m = self.coupler.height_m - self.car_cg_m;
        Vector::new(end * 0.5 * self.length_m, 0.0, height_m)
    }

    /// Mass of a car with bogies and wheelsets.
    pub(super) fn total_kg(&self) -> f64 {
        self.car.kg + 2.0 * self.bogie.kg + 4.0 * self.wheelset.kg
    }

    /// What accelerates as if it were mass: the car and its rotating parts.
    pub(super) fn effective_kg(&self) -> f64 {
        self.total_kg() + 4.0 * self.wheelset.kg_m2.y / self.wheel_radius_m.powi(2)
    }

    /// Static force of a wheel on its rail.
    pub(super) fn wheel_load_n(&self) -> f64 {
        0.125 * self.total_kg() * GRAVITY_MPS2
    }
}
