//! Masses, springs and dampers of a car: as a file has them, and in SI units for the forces.

use crate::track::{Checker, FileError, Problem, key_below, read_toml};
use rapier3d_f64::math::Vector;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Standard gravity.
pub(super) const GRAVITY_MPS2: f64 = 9.806_65;
/// Half the distance of the wheels' contact points (1435 mm gauge).
pub(super) const HALF_CONTACT_M: f64 = 0.75;

/// Sets that come with the program, by name.
const SHIPPED: [(&str, &str); 3] = [
    (
        "metro_b1_empty",
        include_str!("../../../scenarios/vehicles/metro_b1_empty.toml"),
    ),
    (
        "metro_b1_crush",
        include_str!("../../../scenarios/vehicles/metro_b1_crush.toml"),
    ),
    (
        "manchester",
        include_str!("../../../scenarios/vehicles/manchester.toml"),
    ),
];

/// A vehicle file: one car. Heights are over top of rail with the car at rest; x is forward, y to
/// the left, z up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VehicleFile {
    /// Name of the set.
    pub name: String,
    /// Where its figures come from.
    pub source: String,
    /// Car body with its load.
    pub body: BodyFile,
    /// Each of the two bogies.
    pub bogie: BogieFile,
    /// Each of the four wheelsets.
    pub wheelset: WheelsetFile,
    /// Between wheelset and bogie.
    pub primary: PrimaryFile,
    /// Between bogie and body.
    pub secondary: SecondaryFile,
    /// Between cars.
    pub coupler: CouplerFile,
}

/// Car body with its load.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BodyFile {
    /// Length over couplers, m.
    pub length_m: f64,
    /// Width, m.
    pub width_m: f64,
    /// Height of the roof, m.
    pub height_m: f64,
    /// Height of the floor, m.
    pub floor_m: f64,
    /// Mass, kg.
    pub mass_kg: f64,
    /// Moments of inertia: roll, pitch, yaw, kg m^2.
    pub inertia_kg_m2: [f64; 3],
    /// Height of the centre of gravity, m.
    pub cg_m: f64,
}

/// A bogie without wheelsets.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BogieFile {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Moments of inertia: roll, pitch, yaw, kg m^2.
    pub inertia_kg_m2: [f64; 3],
    /// Height of the centre of gravity, m.
    pub cg_m: f64,
    /// Distance of the two bogies' centres, m.
    pub distance_m: f64,
    /// Distance of the two axles, m.
    pub wheelbase_m: f64,
}

/// A wheelset.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WheelsetFile {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Moments of inertia: roll, about the axle, yaw, kg m^2.
    pub inertia_kg_m2: [f64; 3],
    /// Radius of the wheels, m.
    pub radius_m: f64,
    /// Effect of all rotating parts, motors and gears included, as a share of the car's mass.
    pub rotating_mass_share: f64,
}

/// Springs and dampers of each axle box.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PrimaryFile {
    /// Along x, y, z, MN/m.
    pub stiffness_mn_m: [f64; 3],
    /// Along x, y, z, kN s/m.
    pub damping_kn_s_m: [f64; 3],
    /// Lateral distance of the two axle boxes, m.
    pub base_m: f64,
}

/// Springs and dampers of each side of a bogie.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SecondaryFile {
    /// Along x, y, z, MN/m.
    pub stiffness_mn_m: [f64; 3],
    /// Along x, y, z, kN s/m; along x it damps the bogie's yaw.
    pub damping_kn_s_m: [f64; 3],
    /// Lateral distance of the two sides, m.
    pub base_m: f64,
    /// Height at which the springs act, m.
    pub height_m: f64,
    /// Roll bar of a bogie, MN m/rad.
    pub roll_bar_mn_m_rad: f64,
    /// Traction rod of a bogie, along x: stiffness, MN/m.
    pub traction_rod_mn_m: f64,
    /// And damping, kN s/m.
    pub traction_rod_kn_s_m: f64,
    /// Way to the bump stops, up and down (of a side) and to the left and right (of a bogie), m.
    pub stop_play_m: f64,
    /// Stiffness of a bump stop, MN/m.
    pub stop_mn_m: f64,
}

/// Coupler between two cars.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CouplerFile {
    /// Height, m.
    pub height_m: f64,
    /// Stiffness in pull and buff, MN/m.
    pub stiffness_mn_m: f64,
    /// Damping, kN s/m.
    pub damping_kn_s_m: f64,
    /// Free play between pull and buff, m.
    pub slack_m: f64,
}

impl VehicleFile {
    /// Reads and checks a vehicle file's text.
    pub fn from_toml(text: &str) -> Result<Self, FileError> {
        let file: Self = read_toml(text)?;
        let mut problems = Vec::new();
        file.check("", &mut problems);
        match problems.is_empty() {
            true => Ok(file),
            false => Err(FileError::Problems(problems)),
        }
    }

    /// A set that comes with the program.
    pub fn shipped(name: &str) -> Option<Self> {
        let (_, text) = SHIPPED.iter().find(|(n, _)| *n == name)?;
        Self::from_toml(text).ok()
    }

    /// Names of the sets that come with the program.
    pub fn shipped_names() -> [&'static str; SHIPPED.len()] {
        SHIPPED.map(|(name, _)| name)
    }

    /// Appends what is wrong; `at` is the dotted key that leads here.
    fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        let mut section =
            |name: &str, values: &[(&str, &[f64], std::ops::RangeInclusive<f64>, &str)]| {
                let at = key_below(at, name);
                let mut check = Checker::new(&at, problems);
                for (key, numbers, range, unit) in values {
                    for x in *numbers {
                        check.within(key, *x, range.clone(), unit);
                    }
                }
            };
        let (b, g, w) = (&self.body, &self.bogie, &self.wheelset);
        let (p, s, c) = (&self.primary, &self.secondary, &self.coupler);
        // Both bogies' wheels must be under the body.
        let longest_m = b.length_m - g.wheelbase_m - 2.0 * w.radius_m;
        section(
            "body",
            &[
                ("length_m", &[b.length_m], 8.0..=30.0, "m"),
                ("width_m", &[b.width_m], 2.0..=3.6, "m"),
                ("height_m", &[b.height_m], 3.0..=5.0, "m"),
                ("floor_m", &[b.floor_m], 0.3..=1.5, "m"),
                ("mass_kg", &[b.mass_kg], 5e3..=1e5, "kg"),
                ("inertia_kg_m2", &b.inertia_kg_m2, 5e3..=1e7, "kg m^2"),
                ("cg_m", &[b.cg_m], 0.5..=3.0, "m"),
            ],
        );
        section(
            "bogie",
            &[
                ("mass_kg", &[g.mass_kg], 500.0..=1e4, "kg"),
                ("inertia_kg_m2", &g.inertia_kg_m2, 200.0..=2e4, "kg m^2"),
                ("cg_m", &[g.cg_m], 0.2..=1.0, "m"),
                ("distance_m", &[g.distance_m], 4.0..=longest_m.max(4.0), "m"),
                ("wheelbase_m", &[g.wheelbase_m], 1.2..=4.0, "m"),
            ],
        );
        section(
            "wheelset",
            &[
                ("mass_kg", &[w.mass_kg], 500.0..=4e3, "kg"),
                ("inertia_kg_m2", &w.inertia_kg_m2, 20.0..=4e3, "kg m^2"),
                ("radius_m", &[w.radius_m], 0.25..=0.7, "m"),
                (
                    "rotating_mass_share",
                    &[w.rotating_mass_share],
                    0.01..=0.3,
                    "",
                ),
            ],
        );
        // With these bounds every mode turns by less than 1 rad in a step of 2 ms.
        section(
            "primary",
            &[
                ("stiffness_mn_m", &p.stiffness_mn_m, 0.1..=40.0, "MN/m"),
                ("damping_kn_s_m", &p.damping_kn_s_m, 0.0..=100.0, "kN s/m"),
                ("base_m", &[p.base_m], 1.0..=2.6, "m"),
            ],
        );
        section(
            "secondary",
            &[
                ("stiffness_mn_m", &s.stiffness_mn_m, 0.02..=5.0, "MN/m"),
                ("damping_kn_s_m", &s.damping_kn_s_m, 0.0..=300.0, "kN s/m"),
                ("base_m", &[s.base_m], 1.0..=2.6, "m"),
                ("height_m", &[s.height_m], 0.3..=1.5, "m"),
                (
                    "roll_bar_mn_m_rad",
                    &[s.roll_bar_mn_m_rad],
                    0.0..=10.0,
                    "MN m/rad",
                ),
                (
                    "traction_rod_mn_m",
                    &[s.traction_rod_mn_m],
                    0.5..=20.0,
                    "MN/m",
                ),
                (
                    "traction_rod_kn_s_m",
                    &[s.traction_rod_kn_s_m],
                    0.0..=200.0,
                    "kN s/m",
                ),
                ("stop_play_m", &[s.stop_play_m], 0.005..=0.2, "m"),
                ("stop_mn_m", &[s.stop_mn_m], 0.0..=10.0, "MN/m"),
            ],
        );
        section(
            "coupler",
            &[
                ("height_m", &[c.height_m], 0.3..=1.5, "m"),
                ("stiffness_mn_m", &[c.stiffness_mn_m], 0.5..=50.0, "MN/m"),
                ("damping_kn_s_m", &[c.damping_kn_s_m], 0.0..=1e3, "kN s/m"),
                ("slack_m", &[c.slack_m], 0.0..=0.1, "m"),
            ],
        );
    }
}

/// Springs and dampers of one element along its x, y and z, under a static load along z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Element {
    pub stiffness_n_m: Vector,
    pub damping_n_s_m: Vector,
    pub preload_n: f64,
}

/// Mass and moments of inertia of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Mass {
    pub kg: f64,
    /// Roll, pitch, yaw.
    pub kg_m2: Vector,
}

/// A car in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
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
#[derive(Clone, Copy, Debug, PartialEq)]
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

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    /// Fails where a set that comes with the program cannot be read, has another name, or gives
    /// other figures than its file.
    #[test]
    fn shipped_vehicles_are_right() {
        for name in VehicleFile::shipped_names() {
            let file = VehicleFile::shipped(name).unwrap();
            assert_eq!(file.name, name);
            let car = Vehicle::new(&file);
            // Class B allows 14 t on an axle.
            let axle_t = 1e-3 * 0.25 * car.total_kg();
            assert!((8.0..14.1).contains(&axle_t), "{name}: {axle_t} t");
            let rotating = car.effective_kg() / car.total_kg() - 1.0;
            assert!((rotating - file.wheelset.rotating_mass_share).abs() < 1e-12);
        }
        assert!(VehicleFile::shipped("tram").is_none());
    }

    /// Fails where a wrong figure is not named with its key.
    #[test]
    fn wrong_figures_are_named() {
        let (_, text) = SHIPPED[0];
        let wrong = text.replace("distance_m = 12.6", "distance_m = 19.0");
        let error = VehicleFile::from_toml(&wrong).unwrap_err().to_string();
        assert!(error.contains("bogie.distance_m"), "{error}");
    }
}
