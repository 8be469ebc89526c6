//! People on the line: they walk where their path says, and may leave something behind.

use super::obstacle::ObstacleSettings;
use super::settings::{join, within};
use crate::track::Problem;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Where a worker is at a time; in between he walks straight and evenly.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Waypoint {
    /// When, seconds.
    pub time_s: f64,
    /// Chainage, metres.
    pub chainage_m: f64,
    /// Left of the centreline, metres.
    pub lateral_m: f64,
}

/// One worker. He is there from his first waypoint to his last.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct WorkerSettings {
    /// Name.
    pub name: String,
    /// Height of the body, metres.
    pub stature_m: f64,
    /// Height of the ground he walks on above top of rail, metres.
    pub ground_m: f64,
    /// Share of light that his clothes reflect, 0 to 1.
    pub albedo: f64,
    /// Where he is when.
    pub path: Vec<Waypoint>,
    /// What he carries; place, velocity and `appears_s` of it are ignored.
    pub carries: Option<ObstacleSettings>,
    /// When he puts it down beside him, seconds; never where absent.
    pub puts_down_s: Option<f64>,
}

impl Default for WorkerSettings {
    fn default() -> Self {
        Self {
            name: "worker".to_owned(),
            stature_m: 1.75,
            ground_m: -0.2,
            albedo: 0.4,
            path: Vec::new(),
            carries: None,
            puts_down_s: None,
        }
    }
}

impl WorkerSettings {
    /// Appends what is wrong with these settings; `at` is the dotted key that leads here.
    pub fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        within(problems, at, "stature_m", self.stature_m, 1.0, 2.3, "m");
        within(problems, at, "ground_m", self.ground_m, -2.0, 2.0, "m");
        within(problems, at, "albedo", self.albedo, 0.0, 1.0, "");
        if let Some(carried) = &self.carries {
            carried.check(&join(at, "carries"), problems);
        }
        if self.path.is_empty() {
            problems.push(Problem::new(
                join(at, "path"),
                "there is no waypoint",
                "give at least one { time_s, chainage_m, lateral_m }",
            ));
        }
        for (k, pair) in self.path.windows(2).enumerate() {
            if !(pair[1].time_s > pair[0].time_s) {
                problems.push(Problem::new(
                    join(at, &format!("path[{}].time_s", k + 1)),
                    format!("{} s is not after {} s", pair[1].time_s, pair[0].time_s),
                    "put the waypoints in order of time",
                ));
            }
        }
        for (k, p) in self.path.iter().enumerate() {
            let at = join(at, &format!("path[{k}]"));
            within(problems, &at, "time_s", p.time_s, 0.0, 1e6, "s");
            within(problems, &at, "chainage_m", p.chainage_m, -1e6, 1e6, "m");
            within(problems, &at, "lateral_m", p.lateral_m, -10.0, 10.0, "m");
        }
    }
}
