//! Dimensions, masses, springs and dampers of a car, as a file has them.

use crate::settings::{Checker, FileError, Settings, read_settings, settings};
use std::sync::LazyLock;

/// Texts of the sets that come with the program.
const SHIPPED: [&str; 3] = [
    include_str!("../../../scenarios/vehicles/metro_b1_empty.toml"),
    include_str!("../../../scenarios/vehicles/metro_b1_crush.toml"),
    include_str!("../../../scenarios/vehicles/manchester.toml"),
];

settings! {
    /// A vehicle file: one car. Heights are over top of rail with the car at rest; x is forward, y
    /// to the left, z up.
    pub struct VehicleFile {
        /// Name of the set.
        name: String;
        /// Where its figures come from.
        source: String;
        /// Car body with its load.
        body: BodyFile, nested;
        /// Each of the two bogies.
        bogie: BogieFile, nested;
        /// Each of the four wheelsets.
        wheelset: WheelsetFile, nested;
        /// Between wheelset and bogie.
        primary: PrimaryFile, nested;
        /// Between bogie and body.
        secondary: SecondaryFile, nested;
        /// Between cars.
        coupler: CouplerFile, nested;
    }
    also check_bogies
}

settings! {
    /// Car body with its load.
    #[derive(Copy)]
    pub struct BodyFile {
        /// Length over couplers, m.
        length_m: f64, in 8.0..=30.0;
        /// Width, m.
        width_m: f64, in 2.0..=3.6;
        /// Height of the roof, m.
        height_m: f64, in 3.0..=5.0;
        /// Height of the floor, m.
        floor_m: f64, in 0.3..=1.5;
        /// Mass, kg.
        mass_kg: f64, in 5e3..=1e5;
        /// Moments of inertia: roll, pitch, yaw, kg m^2.
        inertia_kg_m2: [f64; 3], in 5e3..=1e7;
        /// Height of the centre of gravity, m.
        cg_m: f64, in 0.5..=3.0;
    }
}

settings! {
    /// A bogie without wheelsets.
    #[derive(Copy)]
    pub struct BogieFile {
        /// Mass, kg.
        mass_kg: f64, in 500.0..=1e4;
        /// Moments of inertia: roll, pitch, yaw, kg m^2.
        inertia_kg_m2: [f64; 3], in 200.0..=2e4;
        /// Height of the centre of gravity, m.
        cg_m: f64, in 0.2..=1.0;
        /// Distance of the two bogies' centres, m.
        distance_m: f64, in 4.0..=30.0;
        /// Distance of the two axles, m.
        wheelbase_m: f64, in 1.2..=4.0;
    }
}

settings! {
    /// A wheelset.
    #[derive(Copy)]
    pub struct WheelsetFile {
        /// Mass, kg.
        mass_kg: f64, in 500.0..=4e3;
        /// Moments of inertia: roll, about the axle, yaw, kg m^2.
        inertia_kg_m2: [f64; 3], in 20.0..=4e3;
        /// Radius of the wheels, m.
        radius_m: f64, in 0.25..=0.7;
        /// Effect of all rotating parts, motors and gears included, as a share of the car's mass.
        rotating_mass_share: f64, in 0.01..=0.3;
    }
}

settings! {
    /// Springs and dampers of each axle box.
    #[derive(Copy)]
    pub struct PrimaryFile {
        /// Along x, y, z, MN/m.
        stiffness_mn_m: [f64; 3], in 0.1..=40.0;
        /// Along x, y, z, kN s/m.
        damping_kn_s_m: [f64; 3], in 0.0..=100.0;
        /// Lateral distance of the two axle boxes, m.
        base_m: f64, in 1.0..=2.6;
    }
}

settings! {
    /// Springs and dampers of each side of a bogie.
    #[derive(Copy)]
    pub struct SecondaryFile {
        /// Along x, y, z, MN/m.
        stiffness_mn_m: [f64; 3], in 0.02..=5.0;
        /// Along x, y, z, kN s/m; along x it damps the bogie's yaw.
        damping_kn_s_m: [f64; 3], in 0.0..=300.0;
        /// Lateral distance of the two sides, m.
        base_m: f64, in 1.0..=2.6;
        /// Height at which the springs act, m.
        height_m: f64, in 0.3..=1.5;
        /// Roll bar of a bogie, MN m/rad.
        roll_bar_mn_m_rad: f64, in 0.0..=10.0;
        /// Traction rod of a bogie, along x: stiffness, MN/m.
        traction_rod_mn_m: f64, in 0.5..=20.0;
        /// And damping, kN s/m.
        traction_rod_kn_s_m: f64, in 0.0..=200.0;
        /// Way to the bump stops, up and down (of a side) and to the left and right (of a bogie),
        /// m.
        stop_play_m: f64, in 0.005..=0.2;
        /// Stiffness of a bump stop, MN/m.
        stop_mn_m: f64, in 0.0..=10.0;
    }
}

settings! {
    /// Coupler between two cars.
    #[derive(Copy)]
    pub struct CouplerFile {
        /// Height, m.
        height_m: f64, in 0.3..=1.5;
        /// Stiffness in pull and buff, MN/m.
        stiffness_mn_m: f64, in 0.5..=50.0;
        /// Damping, kN s/m.
        damping_kn_s_m: f64, in 0.0..=1e3;
        /// Free play between pull and buff, m.
        slack_m: f64, in 0.0..=0.1;
    }
}

impl VehicleFile {
    /// Reads and checks a vehicle file's text.
    pub fn from_toml(text: &str) -> Result<Self, FileError> {
        let file: Self = read_settings(text)?;
        let mut problems = Vec::new();
        file.check("", &mut problems);
        match problems.is_empty() {
            true => Ok(file),
            false => Err(FileError::Problems(problems)),
        }
    }

    /// A set that comes with the program.
    pub fn shipped(name: &str) -> Option<&'static Self> {
        Self::all_shipped().iter().find(|file| file.name == name)
    }

    /// Names of the sets that come with the program.
    pub fn shipped_names() -> Vec<&'static str> {
        let all = Self::all_shipped().iter();
        all.map(|file| file.name.as_str()).collect()
    }

    fn all_shipped() -> &'static [Self] {
        static READ: LazyLock<Vec<VehicleFile>> = LazyLock::new(|| {
            let files = SHIPPED.iter();
            files
                .filter_map(|text| VehicleFile::from_toml(text).ok())
                .collect()
        });
        &READ
    }

    /// Mass of the car with bogies and wheelsets.
    pub fn mass_kg(&self) -> f64 {
        self.body.mass_kg + 2.0 * self.bogie.mass_kg + 4.0 * self.wheelset.mass_kg
    }

    /// Both bogies' wheels must be under the body.
    fn check_bogies(&self, check: &mut Checker<'_>) {
        let taken_m = self.bogie.wheelbase_m + 2.0 * self.wheelset.radius_m;
        let longest_m = (self.body.length_m - taken_m).max(4.0);
        check.within("bogie.distance_m", self.bogie.distance_m, 4.0..=longest_m);
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::twin::physics::vehicle::Vehicle;

    /// Fails where a set that comes with the program cannot be read, or gives other figures than
    /// its file.
    #[test]
    fn shipped_vehicles_are_right() {
        assert_eq!(VehicleFile::shipped_names().len(), SHIPPED.len());
        for name in VehicleFile::shipped_names() {
            let file = VehicleFile::shipped(name).unwrap();
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
        let wrong = SHIPPED[0].replace("distance_m = 12.6", "distance_m = 19.0");
        let error = VehicleFile::from_toml(&wrong).unwrap_err().to_string();
        assert!(error.contains("bogie.distance_m"), "{error}");
    }
}
