//! Masses, springs and dampers of the cars.

use super::settings::VehicleSet;
use rapier3d_f64::math::Vector;

/// Springs and dampers of one element along its x, y and z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Element {
    pub stiffness_n_m: Vector,
    pub damping_n_s_m: Vector,
}

/// One set of parameters. Heights are over top of rail with the car at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Vehicle {
    pub car_mass_kg: f64,
    /// Roll, pitch, yaw.
    pub car_inertia_kg_m2: Vector,
    pub bogie_mass_kg: f64,
    pub bogie_inertia_kg_m2: Vector,
    pub wheelset_mass_kg: f64,
    /// Of each of a bogie's four axle boxes.
    pub primary: Element,
    /// Of each of a bogie's two sides.
    pub secondary: Element,
    /// Between car and bogie.
    pub roll_bar_n_m_rad: f64,
    /// Between car and bogie, along.
    pub traction_rod: (f64, f64),
    pub semi_bogie_distance_m: f64,
    pub semi_wheelbase_m: f64,
    pub wheel_radius_m: f64,
    pub car_cg_m: f64,
    pub bogie_cg_m: f64,
    /// Half the lateral distance of axle boxes and of secondary springs.
    pub semi_spring_base_m: f64,
    /// Where the secondary springs act: between their lower and upper ends.
    pub secondary_m: f64,
}

/// Coupler between two cars: along, stiffness in N/m and damping in N s/m. A rubber draft gear
/// takes some 40 mm under the 300 kN of a buff test.
pub(super) const COUPLER: (f64, f64) = (8.0e6, 2.0e5);
/// Height of the couplers over top of rail (GB/T metro cars: 0.66 m).
pub(super) const COUPLER_HEIGHT_M: f64 = 0.66;
/// Standard gravity.
pub(super) const GRAVITY_MPS2: f64 = 9.806_65;

impl Vehicle {
    pub(super) fn of(set: VehicleSet) -> Self {
        match set {
            VehicleSet::Metro => metro(),
            VehicleSet::Manchester => manchester(),
        }
    }

    /// Mass of a car with bogies and wheelsets.
    pub(super) fn total_mass_kg(&self) -> f64 {
        self.car_mass_kg + 2.0 * self.bogie_mass_kg + 4.0 * self.wheelset_mass_kg
    }

    /// Static force of one secondary side.
    pub(super) fn secondary_preload_n(&self) -> f64 {
        self.car_mass_kg * GRAVITY_MPS2 / 4.0
    }

    /// Static force of one axle box.
    pub(super) fn primary_preload_n(&self) -> f64 {
        (self.car_mass_kg / 2.0 + self.bogie_mass_kg) * GRAVITY_MPS2 / 4.0
    }
}

/// Metro car: Shock and Vibration 2019, 2015465. It gives no lateral and longitudinal damping of
/// the primary suspension (10 kN s/m is some 7 % of critical, as of rubber springs) and no
/// heights, spring bases and traction rod, which are taken from the Manchester vehicle.
fn metro() -> Vehicle {
    Vehicle {
        car_mass_kg: 34_500.0,
        car_inertia_kg_m2: Vector::new(124_304.0, 1_560_400.0, 1_521_000.0),
        bogie_mass_kg: 3_500.0,
        bogie_inertia_kg_m2: Vector::new(2_522.0, 1_722.0, 3_100.0),
        wheelset_mass_kg: 2_200.0,
        primary: Element {
            stiffness_n_m: Vector::new(11.68e6, 7.40e6, 1.173e6),
            damping_n_s_m: Vector::new(10.0e3, 10.0e3, 19.6e3),
        },
        secondary: Element {
            stiffness_n_m: Vector::new(0.179e6, 0.179e6, 0.61e6),
            damping_n_s_m: Vector::new(0.0, 54.8e3, 9.8e3),
        },
        roll_bar_n_m_rad: 0.0,
        semi_bogie_distance_m: 8.75,
        semi_wheelbase_m: 1.25,
        wheel_radius_m: 0.43,
        ..manchester()
    }
}

/// Vehicle 1 of the Manchester benchmarks: Iwnicki, "Manchester benchmarks for rail vehicle
/// simulation", Vehicle System Dynamics 30 (1998) 295-313. Its bump stops and the yaw dampers
/// are left out.
fn manchester() -> Vehicle {
    Vehicle {
        car_mass_kg: 32_000.0,
        car_inertia_kg_m2: Vector::new(56_800.0, 1.97e6, 1.97e6),
        bogie_mass_kg: 2_615.0,
        bogie_inertia_kg_m2: Vector::new(1_722.0, 1_476.0, 3_067.0),
        wheelset_mass_kg: 1_813.0,
        primary: Element {
            stiffness_n_m: Vector::new(31.391e6, 3.884e6, 1.22e6),
            damping_n_s_m: Vector::new(15.0e3, 2.0e3, 4.0e3),
        },
        secondary: Element {
            stiffness_n_m: Vector::new(0.16e6, 0.16e6, 0.43e6),
            damping_n_s_m: Vector::new(0.0, 32.0e3, 20.0e3),
        },
        roll_bar_n_m_rad: 0.94e6,
        traction_rod: (5.0e6, 25.0e3),
        semi_bogie_distance_m: 9.5,
        semi_wheelbase_m: 1.28,
        wheel_radius_m: 0.46,
        car_cg_m: 1.8,
        bogie_cg_m: 0.6,
        semi_spring_base_m: 1.0,
        secondary_m: 0.83,
    }
}
