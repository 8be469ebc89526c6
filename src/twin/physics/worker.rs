//! People on the line: they walk where their path says, carry something, put it down and pick it up
//! again.

use super::obstacle::{ObstacleSettings, SingleObstacle};
use crate::settings::{Checker, settings};
use crate::track::{Alignment, BED_M, TrackPoint};
use crate::twin::geometry::{Body, Shape};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

settings! {
    /// Where a worker is at a time; in between he walks straight and evenly.
    #[derive(Copy)]
    pub struct Waypoint {
        /// When, seconds.
        time_s: f64, in 0.0..=1e6;
        /// Chainage, metres.
        chainage_m: f64, in -1e6..=1e6;
        /// Left of the centreline, metres.
        lateral_m: f64, in -10.0..=10.0;
    }
}

settings! {
    /// One worker. He is there from his first waypoint to his last.
    pub struct WorkerSettings {
        /// Name.
        name: String = "worker".to_owned();
        /// Height of the body, metres.
        stature_m: f64 = 1.75, in 1.0..=2.3;
        /// Mass, kilograms.
        mass_kg: f64 = 80.0, in 30.0..=200.0;
        /// Height of the ground he walks on above top of rail, metres: the track bed's where
        /// absent.
        ground_m: f64 = BED_M, in -2.0..=2.0;
        /// Share of light that his clothes reflect, 0 to 1.
        albedo: f64 = 0.4, in 0.0..=1.0;
        /// Name of the track. Default: the tunnel's first.
        track: Option<String> = None;
        /// Where he is when.
        path: Vec<Waypoint> = Vec::new(), nested;
        /// What he carries, a single thing; place, motion, hold and `appears_s` of it are ignored.
        carries: Option<ObstacleSettings> = None, nested;
        /// When he puts it down beside him, seconds, while he is there; never where absent.
        puts_down_s: Option<f64> = None, in 0.0..=1e6;
        /// When he picks it up again, seconds, while he is there and it lies within 1.5 m of him;
        /// never where absent.
        picks_up_s: Option<f64> = None, in 0.0..=1e6;
    }
    also check_path
}

impl WorkerSettings {
    fn check_path(&self, check: &mut Checker<'_>) {
        let (Some(first), Some(last)) = (self.path.first(), self.path.last()) else {
            check.problem(
                "path",
                "there is no waypoint",
                "give at least one { time_s, chainage_m, lateral_m }",
            );
            return;
        };
        for (k, pair) in self.path.windows(2).enumerate() {
            let in_order = pair[1].time_s > pair[0].time_s;
            if !in_order {
                check.problem(
                    &format!("path[{}].time_s", k + 1),
                    format!("{} s is not after {} s", pair[1].time_s, pair[0].time_s),
                    "put the waypoints in order of time",
                );
            }
        }
        let (from_s, to_s) = (first.time_s, last.time_s);
        for (key, when) in [
            ("puts_down_s", self.puts_down_s),
            ("picks_up_s", self.picks_up_s),
        ] {
            if let Some(at_s) = when.filter(|at_s| !(from_s..=to_s).contains(at_s)) {
                check.problem(
                    key,
                    format!("he is on the line from {from_s} to {to_s} s, not at {at_s} s"),
                    format!("give {from_s} to {to_s} s, or let his path last longer"),
                );
            }
        }
        if let Some(up_s) = self.picks_up_s
            && !self.puts_down_s.is_some_and(|down_s| down_s < up_s)
        {
            check.problem(
                "picks_up_s",
                "he has put nothing down by then",
                "give an earlier puts_down_s, or take this out",
            );
        }
    }
}

/// A stride (two steps), metres.
const STRIDE_M: f64 = 1.4;
/// How far a leg swings out at a walk of 1.4 m/s.
const SWING_RAD: f64 = 0.45;
/// Hand beside the body's centre.
const HAND_M: f64 = 0.38;
/// What is put down is let go this high over the ground.
const LET_GO_M: f64 = 0.03;

/// Pose of a worker's feet (x ahead of him) and his velocity, world.
pub(super) type Feet = (Isometry3<f64>, Vector3<f64>);

/// A worker at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stance {
    pub s_m: f64,
    pub l_m: f64,
    /// Along the line and to the left.
    pub velocity_mps: [f64; 2],
    /// From the line's direction, to the left.
    facing_rad: f64,
    walked_m: f64,
}

impl WorkerSettings {
    /// Where he is at a time; `None` before the first waypoint and after the last.
    pub(super) fn stance(&self, t_s: f64) -> Option<Stance> {
        let first = self.path.first()?;
        if !(first.time_s..=self.path.last()?.time_s).contains(&t_s) {
            return None;
        }
        let mut stance = Stance {
            s_m: first.chainage_m,
            l_m: first.lateral_m,
            velocity_mps: [0.0; 2],
            facing_rad: 0.0,
            walked_m: 0.0,
        };
        for pair in self.path.windows(2).take_while(|p| p[0].time_s <= t_s) {
            let span = pair[1].time_s - pair[0].time_s;
            let share = ((t_s - pair[0].time_s) / span).min(1.0);
            let way = [
                pair[1].chainage_m - pair[0].chainage_m,
                pair[1].lateral_m - pair[0].lateral_m,
            ];
            let length = way[0].hypot(way[1]);
            stance.s_m = pair[0].chainage_m + share * way[0];
            stance.l_m = pair[0].lateral_m + share * way[1];
            stance.velocity_mps = way.map(|x| x / span);
            stance.walked_m += share * length;
            if length > 1e-6 {
                // Standing, he looks where he last went.
                stance.facing_rad = way[1].atan2(way[0]);
            }
        }
        Some(stance)
    }

    /// What he carries, to be put down beside him where he stands.
    pub(super) fn put_down(&self, stance: &Stance, load: &SingleObstacle) -> SingleObstacle {
        let (sin, cos) = stance.facing_rad.sin_cos();
        // His right hand.
        let (s_m, l_m) = (stance.s_m + HAND_M * sin, stance.l_m - HAND_M * cos);
        let settings = ObstacleSettings {
            chainage_m: s_m,
            lateral_m: l_m,
            height_m: self.ground_m + LET_GO_M,
            yaw_deg: stance.facing_rad.to_degrees(),
            velocity_mps: [0.0; 3],
            spin_rad_s: [0.0; 3],
            held_until_s: None,
            hinge: None,
            ..load.settings.clone()
        };
        SingleObstacle {
            settings,
            body: load.body.clone(),
        }
    }

    /// Pose of his feet (x ahead of him) and his velocity, world.
    pub(super) fn feet(&self, alignment: &Alignment, stance: &Stance) -> Feet {
        let frame = alignment.at(stance.s_m);
        let feet = alignment.world_from_track(TrackPoint {
            s_m: stance.s_m,
            l_m: stance.l_m,
            h_m: self.ground_m,
        });
        let turned = |angle| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
        let facing = turned(frame.heading_rad + stance.facing_rad);
        let [along, left] = stance.velocity_mps;
        let velocity = turned(frame.heading_rad) * Vector3::new(along, left, 0.0);
        (
            Isometry3::from_parts(Translation3::from(feet), facing),
            velocity,
        )
    }

    /// His limbs.
    pub(super) fn draw(&self, stance: &Stance, (world_from_feet, velocity): Feet) -> Vec<Body> {
        let part = |shape, feet_from_part: Isometry3<f64>| Body {
            shape,
            world_from_body: world_from_feet * feet_from_part,
            velocity_mps: velocity,
            albedo: self.albedo,
            luminance_cd_m2: 0.0,
        };
        let tall = self.stature_m;
        let hip = 0.52 * tall;
        let up = |z: f64| Isometry3::translation(0.0, 0.0, z);
        let trunk = Shape::Capsule(0.17, 0.31 * tall / 2.0 - 0.1);
        let [along, left] = stance.velocity_mps;
        let pace = (along.hypot(left) / 1.4).min(1.2);
        let phase = std::f64::consts::TAU * stance.walked_m / STRIDE_M;
        let leg = |side: f64, sign: f64| {
            let swing = sign * SWING_RAD * pace * phase.sin();
            // Turned about the hip, forward positive.
            let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -swing);
            let hip_joint = Isometry3::from_parts(Translation3::new(0.0, side, hip), turn);
            let leg = Shape::Capsule(0.08, hip / 2.0 - 0.08);
            part(leg, hip_joint * up(-hip / 2.0))
        };
        vec![
            part(trunk, up(0.68 * tall)),
            part(Shape::Sphere(0.11), up(tall - 0.11)),
            leg(0.09, 1.0),
            leg(-0.09, -1.0),
        ]
    }

    /// What he carries, in his right hand.
    pub(super) fn draw_load(
        &self,
        (world_from_feet, velocity): Feet,
        load: &SingleObstacle,
    ) -> Body {
        let half = load.body.half_extents_m().z;
        let centre = (0.42 * self.stature_m - half).max(half);
        Body {
            shape: load.body.clone(),
            world_from_body: world_from_feet * Isometry3::translation(0.0, -HAND_M, centre),
            velocity_mps: velocity,
            albedo: load.settings.albedo,
            luminance_cd_m2: 0.0,
        }
    }
}
