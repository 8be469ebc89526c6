//! Switches as they stand and move.

use crate::bus::SimTime;
use crate::settings::settings;
use crate::track::network::{Network, SwitchLeg};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A leg, as files name it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LegName {
    /// Straight on.
    #[default]
    Through,
    /// Away to a side.
    Diverging,
}

impl From<LegName> for SwitchLeg {
    fn from(name: LegName) -> Self {
        match name {
            LegName::Through => Self::Through,
            LegName::Diverging => Self::Diverging,
        }
    }
}

settings! {
    /// How switches are set.
    pub struct InterlockingSettings {
        /// Routes of trains are set before them, and trains wait before a switch or a crossing that is not theirs
        /// yet. Without it switches stand and move as `positions` and `moves` say, trains go where they lead, and
        /// none waits.
        automatic: bool = true;
        /// A route is set so far before a train's head, metres.
        ahead_m: f64 = 300.0, in 20.0..=5000.0;
        /// Switches that do not lead straight on at the start.
        positions: Vec<SwitchPosition> = Vec::new();
        /// Switches that are asked to move.
        moves: Vec<SwitchMove> = Vec::new(), nested;
    }
}

/// How a switch stands at the start.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SwitchPosition {
    /// Its name.
    pub switch: String,
    /// The leg that it leads to.
    pub leg: LegName,
}

settings! {
    /// A switch that is asked to move.
    pub struct SwitchMove {
        /// Its name.
        switch: String;
        /// The leg that it shall lead to.
        leg: LegName;
        /// When, seconds.
        at_s: f64, in 0.0..=1e6;
        /// Its lock has failed: it moves even under a train.
        #[serde(default)]
        lock_fails: bool;
    }
}

/// One switch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Blades {
    /// The leg that they lead to, or led to before they began to move.
    pub set: SwitchLeg,
    /// Where they are moving to, and when they arrive there.
    pub moving: Option<(SwitchLeg, SimTime)>,
    /// When they began to move.
    since: SimTime,
    /// A train that came from the other leg has forced them.
    pub run_through: bool,
}

/// All switches of a network, by number.
#[derive(Clone, Debug, Default)]
pub(super) struct Switches {
    pub all: Vec<Blades>,
    /// Still to come, the next one last.
    moves: Vec<(SwitchMove, usize)>,
}

impl Switches {
    /// As they stand at the start. Names that are none were refused.
    pub(super) fn new(network: &Network, settings: &InterlockingSettings) -> Self {
        let resting = Blades {
            set: SwitchLeg::Through,
            moving: None,
            since: SimTime::ZERO,
            run_through: false,
        };
        let number = |name: &str| network.switches.iter().position(|s| s.name == name);
        let mut all = vec![resting; network.switches.len()];
        for position in &settings.positions {
            if let Some(k) = number(&position.switch) {
                all[k].set = position.leg.into();
            }
        }
        let moves = settings.moves.iter();
        let moves = moves.filter_map(|m| Some((m.clone(), number(&m.switch)?)));
        let mut moves: Vec<_> = moves.collect();
        moves.sort_by(|a, b| b.0.at_s.total_cmp(&a.0.at_s));
        Self { all, moves }
    }

    /// The next move that the scenario asks for by now: which switch, where to, and whether its lock fails.
    pub(super) fn asked(&mut self, now: SimTime) -> Option<(usize, SwitchLeg, bool)> {
        let due = self.moves.pop_if(|(m, _)| m.at_s <= now.secs());
        due.map(|(m, k)| (k, m.leg.into(), m.lock_fails))
    }

    /// Blades begin to move.
    pub(super) fn begin(&mut self, k: usize, to: SwitchLeg, now: SimTime, throw_s: f64) {
        let blades = &mut self.all[k];
        let is_there = blades.moving.map_or(blades.set == to, |(leg, _)| leg == to);
        if !is_there {
            blades.moving = Some((to, now.plus(throw_s)));
            blades.since = now;
        }
    }

    /// Its blades lead to a leg, and do not move.
    pub(super) fn leads_to(&self, k: usize, leg: SwitchLeg) -> bool {
        self.all[k].set == leg && self.all[k].moving.is_none()
    }

    /// Blades that have arrived stand.
    pub(super) fn arrive(&mut self, now: SimTime) {
        for blades in &mut self.all {
            if let Some((to, at)) = blades.moving
                && at <= now
            {
                (blades.set, blades.moving) = (to, None);
            }
        }
    }

    /// Share of the way from the through to the diverging leg that the blades are at: 0 to 1.
    pub(super) fn share(&self, k: usize, now: SimTime) -> f64 {
        let blades = &self.all[k];
        let share_of = |leg| match leg {
            SwitchLeg::Through => 0.0,
            SwitchLeg::Diverging => 1.0,
        };
        let from = share_of(blades.set);
        blades.moving.map_or(from, |(to, at)| {
            let done = now.since(blades.since) / at.since(blades.since).max(1e-9);
            from + (share_of(to) - from) * done.clamp(0.0, 1.0)
        })
    }
}
