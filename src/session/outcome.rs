//! How the train fared: whether it ran, braked for an obstacle, stood, hit something.

use super::summary::ProtectionFigures;
use crate::bus::{BrakeDemand, ProtectionReport, SimTime, TrainId};
use crate::track::{Alignment, Gauge};
use crate::twin::physics::{ObstacleTruth, TrainState, World};

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
        let obstacle = report.authority_end_m.is_some();
        self.slowed_by_obstacle = obstacle && report.permitted_mps < aim_mps;
        if obstacle && !self.standing && report.command.brake != BrakeDemand::None {
            self.brake_commanded.get_or_insert(now);
        }
        if !self.standing && report.command.brake == BrakeDemand::Emergency {
            self.emergency_brake.get_or_insert(now);
        }
    }

    /// Follows whether the train has run, and since when it stands.
    pub fn on_motion(&mut self, id: TrainId, train: &TrainState, world: &World, line: &Alignment) {
        self.approach(id, train, world, line);
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
        self.standing_since.get_or_insert(train.time);
        if self.brake_commanded.is_some() && self.stopped.is_none() {
            self.stopped = Some(train.time);
        }
    }

    /// Follows how near the train comes to what is ahead of it, until it hits something.
    fn approach(&mut self, id: TrainId, train: &TrainState, world: &World, line: &Alignment) {
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
            ahead_m(id, train, world, line).map(|ahead_m| ahead_m.max(0.0))
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
        world.head_m(id)?;
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

/// From the head to the nearest obstacle or train that it would meet. What has fallen just behind the
/// head counts too.
fn ahead_m(id: TrainId, train: &TrainState, world: &World, line: &Alignment) -> Option<f64> {
    let to_m = |s_m| train.direction.ahead_m(train.chainage_m, s_m);
    let obstacles = world.obstacles().filter(|o| fouls(line, o));
    let near_end_m =
        |o: ObstacleTruth<'_>| to_m(o.chainage_m - train.direction.sign() * o.half_extents_m.x);
    let obstacles = obstacles.map(near_end_m);
    let others = world.train_ids().filter(|other| *other != id);
    let trains = others.filter_map(|other| {
        let (state, length_m) = (world.train(other)?, world.train_length_m(other)?);
        let tail_m = state.chainage_m - state.direction.sign() * length_m;
        Some(to_m(state.chainage_m).min(to_m(tail_m)))
    });
    obstacles
        .chain(trains)
        .filter(|ahead_m| *ahead_m > -1.0)
        .min_by(f64::total_cmp)
}

/// Whether any of an obstacle is within the gauge across the track.
fn fouls(line: &Alignment, o: &ObstacleTruth<'_>) -> bool {
    let gauge = Gauge::b1(line.at(o.chainage_m).curvature_per_m);
    let half = o.half_extents_m;
    gauge.fouled_by([o.lateral_m, o.height_m], [half.y, half.z])
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::bus::TrainCommand;
    use crate::track::Tunnel;
    use crate::twin::physics::{ObstacleSettings, PhysicsSettings, TrainSettings};

    /// Fails where a train that is held, or braked for want of a position, braked for an obstacle.
    #[test]
    fn only_a_running_train_brakes_for_an_obstacle() {
        let text = include_str!("../../tunnels/test_bench.toml");
        let tunnel = Tunnel::from_toml(text).unwrap().first_track().clone();
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
                authority_end_m,
                command,
                ..ProtectionReport::default()
            };
            let mut outcome = Outcome::default();
            for _ in 0..100 {
                world.step(&[command]).unwrap();
                let train = world.train(TrainId(0)).unwrap();
                outcome.on_motion(TrainId(0), &train, &world, &tunnel.alignment);
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
        let tunnel = Tunnel::from_toml(text).unwrap().first_track().clone();
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
                outcome.on_motion(TrainId(0), &train, &world, &tunnel.alignment);
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
        let tunnel = Tunnel::from_toml(text).unwrap().first_track().clone();
        let lying = |chainage_m, lateral_m| ObstacleSettings {
            chainage_m,
            lateral_m,
            ..ObstacleSettings::default()
        };
        let settings = PhysicsSettings {
            trains: Vec::new(),
            obstacles: vec![lying(190.0, 2.5), lying(200.0, 0.5), lying(150.0, 0.0)],
            ..PhysicsSettings::default()
        };
        let mut world = World::new(tunnel.clone(), &settings, 1, 0).unwrap();
        while world.time().secs() < 1.5 {
            world.step(&[]).unwrap();
        }
        let head_at = |chainage_m| TrainState {
            chainage_m,
            ..TrainState::default()
        };
        let line = &tunnel.alignment;
        let margin_m = |head_m| ahead_m(TrainId(0), &head_at(head_m), &world, line);
        let margin = margin_m(180.0).unwrap();
        assert!((margin - (20.0 - 0.15)).abs() < 0.1, "{margin}");
        assert_eq!(margin_m(202.0), None);
    }
}
