//! Dimensions, masses, springs and dampers of a car, as a file has them.

use crate::track::{Checker, FileError, Problem, read_toml};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::LazyLock;

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
        file.check(&mut problems);
        match problems.is_empty() {
            true => Ok(file),
            false => Err(FileError::Problems(problems)),
        }
    }

    /// A set that comes with the program.
    pub fn shipped(name: &str) -> Option<&'static Self> {
        static READ: LazyLock<Vec<VehicleFile>> = LazyLock::new(|| {
            let files = SHIPPED.iter();
            files
                .filter_map(|(_, text)| VehicleFile::from_toml(text).ok())
                .collect()
        });
        READ.iter().find(|file| file.name == name)
    }

    /// Names of the sets that come with the program.
    pub fn shipped_names() -> [&'static str; SHIPPED.len()] {
        SHIPPED.map(|(name, _)| name)
    }

    /// Mass of the car with bogies and wheelsets.
    pub fn mass_kg(&self) -> f64 {
        self.body.mass_kg + 2.0 * self.bogie.mass_kg + 4.0 * self.wheelset.mass_kg
    }

    /// Appends what is wrong.
    fn check(&self, problems: &mut Vec<Problem>) {
        self.body.check(&mut Checker::new("body", problems));
        // Both bogies' wheels must be under the body.
        let taken_m = self.bogie.wheelbase_m + 2.0 * self.wheelset.radius_m;
        let longest_m = self.body.length_m - taken_m;
        self.bogie
            .check(&mut Checker::new("bogie", problems), longest_m);
        self.wheelset.check(&mut Checker::new("wheelset", problems));
        self.primary.check(&mut Checker::new("primary", problems));
        self.secondary
            .check(&mut Checker::new("secondary", problems));
        self.coupler.check(&mut Checker::new("coupler", problems));
    }
}

impl BodyFile {
    fn check(&self, check: &mut Checker<'_>) {
        check.within("length_m", self.length_m, 8.0..=30.0, "m");
        check.within("width_m", self.width_m, 2.0..=3.6, "m");
        check.within("height_m", self.height_m, 3.0..=5.0, "m");
        check.within("floor_m", self.floor_m, 0.3..=1.5, "m");
        check.within("mass_kg", self.mass_kg, 5e3..=1e5, "kg");
        for j in self.inertia_kg_m2 {
            check.within("inertia_kg_m2", j, 5e3..=1e7, "kg m^2");
        }
        check.within("cg_m", self.cg_m, 0.5..=3.0, "m");
    }
}

impl BogieFile {
    fn check(&self, check: &mut Checker<'_>, longest_m: f64) {
        check.within("mass_kg", self.mass_kg, 500.0..=1e4, "kg");
        for j in self.inertia_kg_m2 {
            check.within("inertia_kg_m2", j, 200.0..=2e4, "kg m^2");
        }
        check.within("cg_m", self.cg_m, 0.2..=1.0, "m");
        check.within("distance_m", self.distance_m, 4.0..=longest_m.max(4.0), "m");
        check.within("wheelbase_m", self.wheelbase_m, 1.2..=4.0, "m");
    }
}

impl WheelsetFile {
    fn check(&self, check: &mut Checker<'_>) {
        check.within("mass_kg", self.mass_kg, 500.0..=4e3, "kg");
        for j in self.inertia_kg_m2 {
            check.within("inertia_kg_m2", j, 20.0..=4e3, "kg m^2");
        }
        check.within("radius_m", self.radius_m, 0.25..=0.7, "m");
        let share = self.rotating_mass_share;
        check.within("rotating_mass_share", share, 0.01..=0.3, "");
    }
}

impl PrimaryFile {
    fn check(&self, check: &mut Checker<'_>) {
        for k in self.stiffness_mn_m {
            check.within("stiffness_mn_m", k, 0.1..=40.0, "MN/m");
        }
        for c in self.damping_kn_s_m {
            check.within("damping_kn_s_m", c, 0.0..=100.0, "kN s/m");
        }
        check.within("base_m", self.base_m, 1.0..=2.6, "m");
    }
}

impl SecondaryFile {
    fn check(&self, check: &mut Checker<'_>) {
        for k in self.stiffness_mn_m {
            check.within("stiffness_mn_m", k, 0.02..=5.0, "MN/m");
        }
        for c in self.damping_kn_s_m {
            check.within("damping_kn_s_m", c, 0.0..=300.0, "kN s/m");
        }
        check.within("base_m", self.base_m, 1.0..=2.6, "m");
        check.within("height_m", self.height_m, 0.3..=1.5, "m");
        let bar = self.roll_bar_mn_m_rad;
        check.within("roll_bar_mn_m_rad", bar, 0.0..=10.0, "MN m/rad");
        let rod = (self.traction_rod_mn_m, self.traction_rod_kn_s_m);
        check.within("traction_rod_mn_m", rod.0, 0.5..=20.0, "MN/m");
        check.within("traction_rod_kn_s_m", rod.1, 0.0..=200.0, "kN s/m");
        check.within("stop_play_m", self.stop_play_m, 0.005..=0.2, "m");
        check.within("stop_mn_m", self.stop_mn_m, 0.0..=10.0, "MN/m");
    }
}

impl CouplerFile {
    fn check(&self, check: &mut Checker<'_>) {
        check.within("height_m", self.height_m, 0.3..=1.5, "m");
        check.within("stiffness_mn_m", self.stiffness_mn_m, 0.5..=50.0, "MN/m");
        check.within("damping_kn_s_m", self.damping_kn_s_m, 0.0..=1e3, "kN s/m");
        check.within("slack_m", self.slack_m, 0.0..=0.1, "m");
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::twin::physics::vehicle::Vehicle;

    /// Fails where a set that comes with the program cannot be read, has another name, or gives
    /// other figures than its file.
    #[test]
    fn shipped_vehicles_are_right() {
        for name in VehicleFile::shipped_names() {
            let file = VehicleFile::shipped(name).unwrap();
            assert_eq!(file.name, name);
            let car = Vehicle::new(file);
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
