//! Obstacles as a scenario writes them, and the single things that come of one entry.

use super::material::ObstacleMaterial;
use super::shape::ObstacleShape;
use crate::settings::{Checker, settings};
use crate::twin::geometry::Shape;
use crate::twin::random::Stream;
use nalgebra::{UnitQuaternion, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

settings! {
    /// One obstacle, or several alike.
    pub struct ObstacleSettings {
        /// Name, for the summary; several are called `name 1`, `name 2` and so on.
        name: String = "box".to_owned();
        /// Shape and size: `body = { shape = "box", size_m = [0.4, 0.25, 0.25] }`, `cylinder` with
        /// `diameter_m` and `height_m`, `sphere` or `rock` with `diameter_m`, or `mesh` with `file`
        /// and `scale`.
        body: ObstacleShape = ObstacleShape::Box { size_m: [0.3; 3] }, nested;
        /// Mass, kilograms.
        mass_kg: f64 = 10.0, in 0.01..=1e5;
        /// Coulomb friction; of a contact, the mean of both sides counts (concrete 0.6, train 0.3).
        friction: f64 = 0.6, in 0.0..=2.0;
        /// Restitution, 0 to 1; of a contact, the mean of both sides counts (concrete 0, train
        /// 0.1).
        restitution: f64 = 0.2, in 0.0..=1.0;
        /// Rolling resistance: the force that keeps it rolling evenly, over its weight. A steel
        /// drum on concrete has some 0.01, a rock 0.1 or more.
        rolling_resistance: f64 = 0.02, in 0.0..=1.0;
        /// Share of light reflected, 0 to 1.
        albedo: f64 = 0.3, in 0.0..=1.0;
        /// What it is made of, for a radar: `metal`, `masonry`, `wood`, `plastic`, `cardboard`, or `vehicle`.
        /// Default: a rock is masonry, the rest metal.
        material: Option<ObstacleMaterial> = None;
        /// Temperature of its surface, degrees Celsius.
        temperature_c: f64 = 20.0, in -50.0..=1500.0;
        /// Name of the track. Default: the tunnel's first.
        track: Option<String> = None;
        /// Chainage of its centre, metres.
        chainage_m: f64 = 0.0, in -1e6..=1e6;
        /// Left of the centreline, metres.
        lateral_m: f64 = 0.0, in -10.0..=10.0;
        /// Height of its lowest point above top of rail when it appears, metres.
        height_m: f64 = 0.5, in -1.0..=10.0;
        /// Turned about the vertical, to the left, degrees; after `pitch_deg` and `roll_deg`.
        yaw_deg: f64 = 0.0, in -360.0..=360.0;
        /// Turned about its width, front end up, degrees; after `roll_deg`.
        pitch_deg: f64 = 0.0, in -360.0..=360.0;
        /// Turned about its length, left side up, degrees.
        roll_deg: f64 = 0.0, in -360.0..=360.0;
        /// When it appears, seconds.
        appears_s: f64 = 0.0, in 0.0..=1e6;
        /// Velocity when it appears: up the line, to the left, up, m/s. Held, it has none.
        velocity_mps: [f64; 3] = [0.0; 3], in -50.0..=50.0;
        /// Spin when it appears, about the axes up the line, to the left and up, rad/s. Held, it
        /// has none.
        spin_rad_s: [f64; 3] = [0.0; 3], in -100.0..=100.0;
        /// Until then it is fixed to the lining (a panel, a luminaire), seconds; then it comes
        /// loose. The train tears it off earlier where it hits it. Default: it is not fixed.
        held_until_s: Option<f64> = None, in 0.0..=1e6;
        /// One of its edges stays fixed for longer, so that it swings about it first.
        hinge: Option<HingeSettings> = None, nested;
        /// How many there are, 1 to 500. Of several, each is turned about the vertical at random,
        /// and rocks differ in shape.
        count: u32 = 1, in 1.0..=500.0;
        /// How far their places are spread to either side of the given one: along, across, up,
        /// metres.
        spread_m: [f64; 3] = [0.0; 3], in 0.0..=50.0;
        /// How far their sizes are spread to either side of the given one, as a share of it, 0 to
        /// 0.9; `mass_kg` is that of the given size, and goes with the volume.
        size_spread: f64 = 0.0, in 0.0..=0.9;
    }
    also check_together
}

settings! {
    /// What holds a thing that has come loose otherwise.
    #[derive(Copy)]
    pub struct HingeSettings {
        /// The edge (of the box around it) that it swings about.
        edge: HingeEdge;
        /// Until when, seconds. Default: until the train hits it.
        until_s: Option<f64>, in 0.0..=1e6;
    }
}

/// An edge, before the thing is turned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum HingeEdge {
    /// The upper one: it hangs.
    Top,
    /// The lower one: it topples, if it leans.
    Bottom,
    /// The upright one up the line, as of a door.
    Front,
    /// The upright one down the line.
    Back,
}

/// How much of the room that they are spread over several things may fill: well below the 0.38
/// where balls placed at random jam.
const FILL: f64 = 0.2;
/// Draws for one place.
const DRAWS: u64 = 400;

impl ObstacleSettings {
    fn check_together(&self, check: &mut Checker<'_>) {
        self.check_hold(check);
        self.check_room(check);
    }

    fn check_hold(&self, check: &mut Checker<'_>) {
        if let Some(held_s) = self.held_until_s {
            check.within("held_until_s", held_s, self.appears_s..=1e6);
            let swings_until_s = self.hinge.and_then(|hinge| hinge.until_s);
            check.within("hinge.until_s", swings_until_s, held_s..=1e6);
        } else if self.hinge.is_some() {
            check.problem(
                "hinge",
                "it is not fixed to anything that it could swing from",
                "give held_until_s too; 0 to let it swing at once",
            );
        }
    }

    /// Several things need room beside each other.
    fn check_room(&self, check: &mut Checker<'_>) {
        if self.count < 2 {
            return;
        }
        let Some(body) = self.body.body(Stream::new(0, 0, "")) else {
            return;
        };
        let size_m = 2.0 * body.half_extents_m().max() * (1.0 + self.size_spread);
        let room_m3: f64 = self.spread_m.iter().map(|s| 2.0 * s + size_m).product();
        let most = (FILL * room_m3 / size_m.powi(3)).floor();
        if f64::from(self.count) > most {
            check.problem(
                "count",
                format!(
                    "{} of {size_m:.2} m do not find room in {room_m3:.2} m^3",
                    self.count
                ),
                format!("spread them wider with spread_m, or have {most:.0} at most"),
            );
        }
    }

    /// What it is made of.
    pub fn made_of(&self) -> ObstacleMaterial {
        let by_shape = match self.body {
            ObstacleShape::Rock { .. } => ObstacleMaterial::Masonry,
            _ => ObstacleMaterial::Metal,
        };
        self.material.unwrap_or(by_shape)
    }

    /// Attitude to the line.
    pub(super) fn attitude(&self) -> UnitQuaternion<f64> {
        UnitQuaternion::from_euler_angles(
            self.roll_deg.to_radians(),
            -self.pitch_deg.to_radians(),
            self.yaw_deg.to_radians(),
        )
    }

    /// Height of its centre over top of rail when it appears; `None` for a mesh that has not been
    /// read.
    pub fn middle_m(&self) -> Option<f64> {
        let body = self.body.body(Stream::new(0, 0, ""))?;
        Some(self.centre_height_m(&body))
    }

    /// Height of the centre over top of rail.
    pub(super) fn centre_height_m(&self, body: &Shape) -> f64 {
        let down = self.attitude().inverse() * -Vector3::z();
        self.height_m + body.reach_m(&down)
    }

    /// The pieces of this entry, number `entry` of the scenario.
    pub(super) fn pieces(&self, entry: &str, seed: u64, index: u64) -> Vec<SingleObstacle> {
        let stream = |what: &str| Stream::new(seed, index, &format!("{entry} {what}"));
        let draws = stream("places");
        let mut made: Vec<SingleObstacle> = Vec::new();
        for k in 0..u64::from(self.count) {
            let draw = |n: u64| 2.0 * draws.uniform(k * 4 * (DRAWS + 1) + n) - 1.0;
            let mut settings = self.clone();
            if self.count > 1 {
                settings.name = format!("{} {}", self.name, k + 1);
                let size = 1.0 + self.size_spread * draw(0);
                settings.body = self.body.scaled(size);
                settings.mass_kg *= size.powi(3);
                settings.yaw_deg += 180.0 * draw(1);
            }
            let Some(body) = settings.body.body(stream(&format!("shape {k}"))) else {
                continue;
            };
            // Should no draw be free, the last one stands and the solver parts what overlaps:
            // `check_room` leaves so much room that this is rare.
            for attempt in 1..=DRAWS {
                settings.chainage_m = self.chainage_m + self.spread_m[0] * draw(4 * attempt);
                settings.lateral_m = self.lateral_m + self.spread_m[1] * draw(4 * attempt + 1);
                settings.height_m = self.height_m + self.spread_m[2] * draw(4 * attempt + 2);
                if made.iter().all(|other| apart(&settings, &body, other)) {
                    break;
                }
            }
            made.push(SingleObstacle { settings, body });
        }
        made
    }
}

/// Whether the balls around two things do not overlap.
fn apart(settings: &ObstacleSettings, body: &Shape, other: &SingleObstacle) -> bool {
    let place = |s: &ObstacleSettings| Vector3::new(s.chainage_m, s.lateral_m, s.height_m);
    let distance_m = (place(settings) - place(&other.settings)).norm();
    distance_m > body.half_extents_m().max() + other.body.half_extents_m().max()
}

/// One thing to come.
#[derive(Clone, Debug)]
pub(super) struct SingleObstacle {
    pub settings: ObstacleSettings,
    pub body: Shape,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Settings;

    /// Fails where several things share a place or a size, leave their room, or depend on the
    /// order of entries alone and not on the run.
    #[test]
    fn several_things_find_places_of_their_own() {
        let rocks = ObstacleSettings {
            name: "rock".to_owned(),
            body: ObstacleShape::Rock { diameter_m: 0.3 },
            mass_kg: 30.0,
            chainage_m: 100.0,
            height_m: 3.0,
            count: 12,
            spread_m: [1.0, 0.5, 0.4],
            size_spread: 0.4,
            ..ObstacleSettings::default()
        };
        let mut problems = Vec::new();
        rocks.check("obstacles[0]", &mut problems);
        assert!(problems.is_empty(), "{problems:?}");
        let made = rocks.pieces("obstacle 0", 1, 0);
        assert_eq!(made.len(), 12);
        assert_eq!(made[2].settings.name, "rock 3");
        for (k, one) in made.iter().enumerate() {
            let s = &one.settings;
            assert!((s.chainage_m - 100.0).abs() <= 1.0 && s.lateral_m.abs() <= 0.5);
            let reach_m = one.body.half_extents_m().max();
            assert!(reach_m <= 0.5 * 0.3 * 1.4 + 1e-9);
            assert!(made[..k].iter().all(|other| apart(s, &one.body, other)));
        }
        let masses = |made: &[SingleObstacle]| -> Vec<f64> {
            made.iter().map(|one| one.settings.mass_kg).collect()
        };
        assert_eq!(
            masses(&made),
            masses(&rocks.pieces("obstacle 0", 1, 0)),
            "not the same twice"
        );
        assert_ne!(masses(&made), masses(&rocks.pieces("obstacle 0", 1, 1)));
        let crowded = ObstacleSettings {
            spread_m: [0.1; 3],
            ..rocks
        };
        crowded.check("obstacles[0]", &mut problems);
        let keys: Vec<&str> = problems.iter().map(|p| p.key.as_str()).collect();
        assert_eq!(keys, ["obstacles[0].count"]);
    }

    /// Fails where a lying barrel is put into the bed, or a turned box hovers.
    #[test]
    fn the_lowest_point_is_where_it_is_said() {
        let barrel = ObstacleSettings {
            body: ObstacleShape::Cylinder {
                diameter_m: 0.6,
                height_m: 0.9,
            },
            roll_deg: 90.0,
            height_m: 0.1,
            ..ObstacleSettings::default()
        };
        let height = |s: &ObstacleSettings| s.middle_m().unwrap_or(f64::NAN);
        assert!((height(&barrel) - 0.4).abs() < 1e-9);
        let cube = ObstacleSettings {
            body: ObstacleShape::Box { size_m: [1.0; 3] },
            roll_deg: 45.0,
            height_m: 0.0,
            ..ObstacleSettings::default()
        };
        assert!((height(&cube) - 0.5f64.sqrt()).abs() < 1e-9);
    }
}
