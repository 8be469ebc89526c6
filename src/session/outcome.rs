//! How the train fared: whether it ran, braked for an obstacle, stood, hit something.

use super::summary::ProtectionFigures;
use crate::bus::{BrakeDemand, ProtectionReport, SimTime, TrainId};
use crate::track::network::Route;
use crate::track::{Alignment, Gauge, Place};
use crate::twin::physics::{ObstacleTruth, TrainState, World};
use nalgebra::Isometry3;

/// What a run came to.
#[derive(Default)]
pub struct Outcome {
    /// An obstacle ahead permits less than the driver aims at.
    slowed_by_obstacle: bool,
    brake_commanded: Option<SimTime>,
    emergency_brake: Option<SimTime>,
    stopped: Option<SimTime>,
    /// Closest that the head came to what was ahead of it; below 0 after a hit.
    closest_m: Option<f64>,
    /// The train has hit something: what comes after that does not count.
    has_hit: bool,
    /// Speed at the last look.
    speed_mps: Option<f64>,
    standing: bool,
    has_run: bool,
    standing_since: Option<SimTime>,
}

impl Outcome {
    /// A cycle of the protection, for a driver who aims at `aim_mps`. A train that stands is not
    /// braked for an obstacle, but held.
    pub fn on_cycle(&mut self, now: SimTime, report: &ProtectionReport, aim_mps: f64) {
        let obstacle = report.authority_end.is_some();
        self.slowed_by_obstacle = obstacle && report.permitted_mps < aim_mps;
        if obstacle && !self.standing && report.command.brake != BrakeDemand::None {
            self.brake_commanded.get_or_insert(now);
        }
        if !self.standing && report.command.brake == BrakeDemand::Emergency {
            self.emergency_brake.get_or_insert(now);
        }
    }

    /// Follows whether the train has run, and since when it stands.
    pub fn on_motion(&mut self, id: TrainId, train: &TrainState, world: &World) {
        self.approach(id, train, world);
        self.speed_mps = Some(train.speed_mps);
        self.standing = train.standing;
        self.has_run |= !train.standing;
        if !train.standing {
            // A driver who obeys brakes before the equipment has to.
            if self.slowed_by_obstacle && train.brake_mps2 > 0.0 {
                self.brake_commanded.get_or_insert(train.time);
            }
            self.standing_since = None;
            return;
        }
        if train.dwells {
            self.standing_since = None;
            return;
        }
        self.standing_since.get_or_insert(train.time);
        if self.brake_commanded.is_some() && self.stopped.is_none() {
            self.stopped = Some(train.time);
        }
    }

    /// Follows how near the train comes to what is ahead of it, until it hits something.
    fn approach(&mut self, id: TrainId, train: &TrainState, world: &World) {
        if self.has_hit {
            return;
        }
        self.has_hit = world.impacts().iter().any(|hit| hit.train == id);
        let now_m = if self.has_hit {
            // A hit slows the train: its speed before it counts.
            let speed_mps = self.speed_mps.unwrap_or(train.speed_mps);
            let brake_mps2 = world.emergency_brake_mps2(id);
            brake_mps2.map(|brake_mps2| 0.0 - stopping_way_m(speed_mps, brake_mps2))
        } else {
            ahead_m(id, train, world).map(|ahead_m| ahead_m.max(0.0))
        };
        self.closest_m = [self.closest_m, now_m]
            .into_iter()
            .flatten()
            .reduce(f64::min);
    }

    /// For how long the train has stood again after it ran.
    pub fn stood_s(&self, now: SimTime) -> Option<f64> {
        let since = self.standing_since.filter(|_| self.has_run)?;
        Some(now.since(since))
    }

    /// The figures; `None` without a train.
    pub fn protection(&self, id: TrainId, world: &World) -> Option<ProtectionFigures> {
        world.head(id)?;
        let impacts = world.impacts().iter().filter(|hit| hit.train == id);
        let impacts: Vec<_> = impacts.cloned().collect();
        Some(ProtectionFigures {
            brake_commanded_s: self.brake_commanded.map(SimTime::secs),
            emergency_brake_s: self.emergency_brake.map(SimTime::secs),
            stopped_s: self.stopped.map(SimTime::secs),
            stop_margin_m: self.closest_m,
            collision: !impacts.is_empty(),
            impacts,
        })
    }
}

/// Way from a speed to standstill at a constant deceleration.
fn stopping_way_m(speed_mps: f64, brake_mps2: f64) -> f64 {
    speed_mps * speed_mps / (2.0 * brake_mps2)
}

/// From the head to the nearest obstacle or train that it would meet on its route. What has fallen just behind the
/// head counts too.
fn ahead_m(id: TrainId, train: &TrainState, world: &World) -> Option<f64> {
    let (route, line) = (world.route(id)?, &world.along_route(id)?.alignment);
    let obstacles = world.obstacles();
    let obstacles = obstacles.filter_map(|o| on_route(id, train, world, &o));
    let others = world.train_ids().filter(|other| *other != id);
    let trains = others.flat_map(|other| nearest_cars_m((route, line), train.run_m, world, other));
    obstacles
        .chain(trains)
        .map(|run_m| run_m - train.run_m)
        .filter(|ahead_m| *ahead_m > -1.0)
        .min_by(f64::total_cmp)
}

/// Where the near end of an obstacle is along the train's route, if any of it is within the gauge there.
fn on_route(id: TrainId, train: &TrainState, world: &World, o: &ObstacleTruth<'_>) -> Option<f64> {
    let (route, line) = (world.route(id)?, &world.along_route(id)?.alignment);
    let place = Place {
        track: o.track,
        s_m: o.chainage_m,
    };
    let centre = o.world_from_body.translation.vector.into();
    let (run_m, lateral_m) = match route.run_near_m(place, train.run_m) {
        Some(run_m) => (run_m, o.lateral_m),
        None => {
            let point = line.nearest(&centre)?;
            (point.s_m, point.l_m)
        }
    };
    let gauge = Gauge::b1(line.at(run_m).curvature_per_m);
    let half = o.half_extents_m;
    let fouls = gauge.fouled_by([lateral_m, o.height_m], [half.y, half.z]);
    fouls.then_some(run_m - half.x)
}

/// The near ends of the cars of another train that stand in the gauge of a route, along it.
fn nearest_cars_m(
    (route, line): (&Route, &Alignment),
    run_m: f64,
    world: &World,
    other: TrainId,
) -> Vec<f64> {
    let (Some(state), Some(length_m), Some(half_m)) = (
        world.train(other),
        world.train_length_m(other),
        world.car_half_extents_m(other),
    ) else {
        return Vec::new();
    };
    let cars = &state.world_from_cars;
    // Where its head is on the route, if it is: near enough for all of its cars.
    let head = Place {
        track: state.track,
        s_m: state.chainage_m,
    };
    let near_m = route.run_near_m(head, run_m);
    let half_car_m = 0.5 * length_m / cars.len().max(1) as f64;
    let near_end = |car: &Isometry3<f64>| {
        let middle = car.translation.vector.into();
        let point = match near_m {
            Some(near_m) => line.track_from_world(&middle, near_m),
            None => line.nearest(&middle)?,
        };
        let gauge = Gauge::b1(line.at(point.s_m).curvature_per_m);
        let fouls = gauge.fouled_by([point.l_m, half_m.z], [half_m.y, half_m.z]);
        fouls.then_some(point.s_m - half_car_m)
    };
    cars.iter().filter_map(near_end).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::bus::TrainCommand;
    use crate::track::Tunnel;
    use crate::twin::physics::{ObstacleSettings, PhysicsSettings, TrainSettings};
    use std::sync::Arc;

    /// Fails where a train that is held, or braked for want of a position, braked for an obstacle.
    #[test]
    fn only_a_running_train_brakes_for_an_obstacle() {
        let text = include_str!("../../tunnels/test_bench.toml");
        let tunnel = Arc::new(Tunnel::from_toml(text).unwrap());
        for (start_speed_kmh, authority_end_m, braked) in [
            (40.0, Some(200.0), true),
            (40.0, None, false),
            (0.0, Some(200.0), false),
        ] {
            let train = TrainSettings {
                start_speed_kmh,
                ..TrainSettings::default()
            };
            let settings = PhysicsSettings {
                trains: vec![train],
                ..PhysicsSettings::default()
            };
            let mut world = World::new(tunnel.clone(), &settings, 1, 0).unwrap();
            let command = TrainCommand {
                brake: BrakeDemand::Emergency,
                ..TrainCommand::default()
            };
            let report = ProtectionReport {
                authority_end: authority_end_m.map(Place::on_first_track),
                command,
                ..ProtectionReport::default()
            };
            let mut outcome = Outcome::default();
            for _ in 0..100 {
                world.step(&[command]).unwrap();
                let train = world.train(TrainId(0)).unwrap();
                outcome.on_motion(TrainId(0), &train, &world);
                outcome.on_cycle(world.time(), &report, 20.0);
            }
            let protection = outcome.protection(TrainId(0), &world).unwrap();
            assert_eq!(protection.brake_commanded_s.is_some(), braked);
            assert_eq!(
                protection.emergency_brake_s.is_some(),
                start_speed_kmh > 0.0
            );
            assert_eq!(protection.stopped_s, None);
        }
    }

    /// A run that ends in a hit, one that stops short, and one that ends before it comes near must all have
    /// a closest approach: of the hit less than 0, by the stopping way from the speed of the hit, however
    /// long the run goes on after it and whatever the train does then.
    #[test]
    fn every_run_has_a_closest_approach() {
        let text = include_str!("../../tunnels/test_bench.toml");
        let tunnel = Arc::new(Tunnel::from_toml(text).unwrap());
        let train = TrainSettings {
            start_chainage_m: 150.0,
            start_speed_kmh: 40.0,
            ..TrainSettings::default()
        };
        let closest = |obstacle_m, for_s: f64, brake_after_hit| {
            let obstacle = ObstacleSettings {
                chainage_m: obstacle_m,
                ..ObstacleSettings::default()
            };
            let settings = PhysicsSettings {
                trains: vec![train.clone()],
                obstacles: vec![obstacle],
                ..PhysicsSettings::default()
            };
            let mut world = World::new(tunnel.clone(), &settings, 1, 0).unwrap();
            let mut command = TrainCommand {
                brake: BrakeDemand::Emergency,
                ..TrainCommand::default()
            };
            let mut outcome = Outcome::default();
            while world.time().secs() < for_s {
                if !world.impacts().is_empty() {
                    command.brake = brake_after_hit;
                }
                world.step(&[command]).unwrap();
                let train = world.train(TrainId(0)).unwrap();
                outcome.on_motion(TrainId(0), &train, &world);
            }
            let figures = outcome.protection(TrainId(0), &world).unwrap();
            let head_m = world.train(TrainId(0)).unwrap().chainage_m;
            let hit_mps = figures.impacts.first().map(|hit| hit.speed_mps);
            (figures.stop_margin_m.unwrap(), hit_mps, head_m)
        };
        for (for_s, brake_after_hit) in [
            (3.5, BrakeDemand::Emergency),
            (15.0, BrakeDemand::Emergency),
            (15.0, BrakeDemand::None),
        ] {
            let (margin_m, hit_mps, _) = closest(175.0, for_s, brake_after_hit);
            let needed_m = stopping_way_m(hit_mps.unwrap(), train.emergency_brake_mps2);
            assert!(needed_m > 20.0, "{needed_m}");
            let off = margin_m / -needed_m - 1.0;
            assert!(off.abs() < 0.01, "{for_s} s: {margin_m} m, {needed_m} m");
        }
        for (obstacle_m, for_s) in [(260.0, 15.0), (260.0, 1.0)] {
            let (margin_m, hit_mps, head_m) = closest(obstacle_m, for_s, BrakeDemand::Emergency);
            assert!(hit_mps.is_none() && margin_m > 0.0);
            assert!(
                (margin_m - (obstacle_m - 0.15 - head_m)).abs() < 0.3,
                "{margin_m}"
            );
        }
    }

    /// Fails where what stands beside the gauge, or lies behind the train, counts as in its way.
    #[test]
    fn the_margin_is_to_what_is_in_the_way() {
        let text = include_str!("../../tunnels/test_bench.toml");
        let tunnel = Arc::new(Tunnel::from_toml(text).unwrap());
        let lying = |chainage_m, lateral_m| ObstacleSettings {
            chainage_m,
            lateral_m,
            ..ObstacleSettings::default()
        };
        let settings = PhysicsSettings {
            trains: vec![TrainSettings {
                cars: 1,
                start_chainage_m: 40.0,
                ..TrainSettings::default()
            }],
            obstacles: vec![lying(190.0, 2.5), lying(200.0, 0.5), lying(150.0, 0.0)],
            ..PhysicsSettings::default()
        };
        let mut world = World::new(tunnel.clone(), &settings, 1, 0).unwrap();
        while world.time().secs() < 1.5 {
            world.step(&[]).unwrap();
        }
        let head_at = |run_m| TrainState {
            run_m,
            ..TrainState::default()
        };
        let margin_m = |head_m| ahead_m(TrainId(0), &head_at(head_m), &world);
        let margin = margin_m(180.0).unwrap();
        assert!((margin - (20.0 - 0.15)).abs() < 0.1, "{margin}");
        assert_eq!(margin_m(202.0), None);
    }
}
