//! Trains over switches and crossings: which comes next on a train's way, who may run over it, and what becomes of a
//! train that runs over a switch that is not set for it.

use super::incident::{IncidentKind, Incidents};
use super::switches::{InterlockingSettings, Switches};
use super::train::Train;
use crate::bus::{SimTime, TrainId};
use crate::track::network::{Network, Passing, Route, RouteEnvelope, SwitchLeg};
use crate::track::{Direction, Place};

/// A train decides at the blades' tips which way they lead it.
const TIPS_M: f64 = 0.5;
/// Trains wait this far before a switch or a crossing that is not theirs.
const SIGNAL_M: f64 = 15.0;
/// Steps between looks at whose switches and crossings are.
const LOOK_STEPS: u64 = 50;

/// What a train has to do about a switch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Verdict {
    /// It has been led onto the other leg: passing `k` of its way is where.
    Diverted(usize),
    /// It derails.
    Derails,
}

/// A switch or a crossing that a train must have to itself between two distances along its way.
#[derive(Clone, Copy, Debug)]
struct Claim {
    /// Number of the switch, or that of the crossing after all switches.
    number: usize,
    /// For which leg a switch is to be set.
    leg: Option<SwitchLeg>,
    from_m: f64,
    to_m: f64,
}

/// A train's way over switches and crossings.
#[derive(Clone, Debug)]
struct Way {
    passings: Vec<Passing>,
    /// In the order in which they begin.
    claims: Vec<Claim>,
    envelope: RouteEnvelope,
    /// So many tips its front has passed.
    passed: usize,
    off_end: bool,
}

/// Switches and crossings, and whose they are.
#[derive(Clone, Debug, Default)]
pub(super) struct Interlocking {
    pub switches: Switches,
    pub incidents: Incidents,
    settings: InterlockingSettings,
    ways: Vec<Way>,
    /// Clearance of each switch behind its toe.
    clear_m: Vec<f64>,
    /// The train that each switch, and then each crossing, is kept for.
    kept_for: Vec<Option<TrainId>>,
    /// Where each train must stop before a switch or a crossing that is not its own.
    pub signals_m: Vec<Option<f64>>,
    steps: u64,
}

impl Interlocking {
    pub(super) fn new(
        network: &Network,
        settings: &InterlockingSettings,
        trains: &[Train],
    ) -> Self {
        let clear = |s| network.clear_from_m(s).unwrap_or(f64::INFINITY);
        let clear_m: Vec<f64> = network.switches.iter().map(clear).collect();
        let ways = trains
            .iter()
            .map(|train| Way::new(network, train, &clear_m));
        let mut interlocking = Self {
            switches: Switches::new(network, settings),
            settings: settings.clone(),
            ways: ways.collect(),
            clear_m,
            kept_for: vec![None; network.switches.len() + network.crossings.len()],
            signals_m: vec![None; trains.len()],
            ..Self::default()
        };
        if settings.automatic {
            interlocking.keep_occupied(trains);
            interlocking.keep(network, trains, None);
        }
        interlocking
    }

    /// A train has another route from now on.
    pub(super) fn rerouted(&mut self, network: &Network, train: &Train) {
        let way = &mut self.ways[train.consist.id.index()];
        let passed = way.passed;
        let before = std::mem::replace(
            way,
            Way {
                passed,
                ..Way::new(network, train, &self.clear_m)
            },
        );
        // What lies on its old route alone is kept for it no longer.
        for claim in &before.claims {
            let kept_for = &mut self.kept_for[claim.number];
            let goes_there = way.claims.iter().any(|c| c.number == claim.number);
            if *kept_for == Some(train.consist.id) && !goes_there {
                *kept_for = None;
            }
        }
    }

    /// To be called after each step; what trains have to do.
    pub(super) fn after_step(
        &mut self,
        network: &Network,
        trains: &[Train],
        now: SimTime,
    ) -> Vec<(usize, Verdict)> {
        if network.tracks.len() == 1 {
            return Vec::new();
        }
        self.steps += 1;
        let mut verdicts = Vec::new();
        while let Some((k, leg, lock_fails)) = self.switches.asked(now) {
            let on_it = self.occupied_by(k, trains);
            let locks = on_it.or_else(|| self.set_for(k, leg));
            self.ask(
                network,
                (k, leg),
                locks.filter(|_| !lock_fails),
                now,
                trains,
            );
            if let Some(train) = on_it.filter(|_| lock_fails) {
                self.tell(
                    network,
                    (now, IncidentKind::SwitchMovedUnderTrain),
                    &trains[train],
                    Some(k),
                    None,
                );
                verdicts.push((train, Verdict::Derails));
            }
        }
        self.switches.arrive(now);
        for (k, train) in trains.iter().enumerate() {
            verdicts.extend(self.pass(network, train, now).map(|verdict| (k, verdict)));
        }
        if self.steps.is_multiple_of(LOOK_STEPS) {
            if self.settings.automatic {
                self.keep(network, trains, Some(now));
            }
            self.find_fouled(network, trains, now);
        }
        verdicts
    }

    /// Asks a switch to move, which does not where a train locks it.
    fn ask(
        &mut self,
        network: &Network,
        (k, leg): (usize, SwitchLeg),
        locked_by: Option<usize>,
        now: SimTime,
        trains: &[Train],
    ) {
        let blades = &self.switches.all[k];
        let stays = blades.set == leg && blades.moving.is_none();
        match locked_by.filter(|_| !stays) {
            Some(train) => {
                let what = (now, IncidentKind::SwitchLocked);
                self.tell(network, what, &trains[train], Some(k), None);
            }
            None => (self.switches).begin(k, leg, now, network.switches[k].throw_s),
        }
    }

    /// The front of a train comes to the tips of blades, or to the end of its way.
    fn pass(&mut self, network: &Network, train: &Train, now: SimTime) -> Option<Verdict> {
        let way = &mut self.ways[train.consist.id.index()];
        let front_m = train.consist.front_axle_m();
        if !way.off_end && front_m > train.track.route.length_m() {
            way.off_end = true;
            self.tell(network, (now, IncidentKind::OffEnd), train, None, None);
            return None;
        }
        let passing = *way.passings.get(way.passed)?;
        if front_m < passing.toe_m - TIPS_M {
            return None;
        }
        let k = way.passed;
        way.passed += 1;
        let blades = &mut self.switches.all[passing.switch];
        let (set, moves) = (blades.set, blades.moving.is_some());
        if !passing.facing {
            if moves || set != passing.leg {
                (blades.set, blades.moving, blades.run_through) = (passing.leg, None, true);
                let what = (now, IncidentKind::RunThrough);
                self.tell(network, what, train, Some(passing.switch), None);
            }
            return None;
        }
        if moves {
            let what = (now, IncidentKind::SwitchNotClosed);
            self.tell(network, what, train, Some(passing.switch), None);
            return Some(Verdict::Derails);
        }
        if set != passing.leg {
            let what = (now, IncidentKind::AgainstRoute);
            self.tell(network, what, train, Some(passing.switch), None);
            return Some(Verdict::Diverted(k));
        }
        None
    }

    /// Keeps what trains stand on at the start for them, whichever come to it.
    fn keep_occupied(&mut self, trains: &[Train]) {
        for (train, way) in trains.iter().zip(&self.ways) {
            let (head_m, tail_m) = train.consist.stands_m();
            let claims = way.claims.iter();
            for claim in claims.filter(|claim| head_m > claim.from_m && tail_m < claim.to_m) {
                self.kept_for[claim.number].get_or_insert(train.consist.id);
            }
        }
    }

    /// Keeps switches and crossings for the trains that come to them, in the order of their numbers, sets the
    /// switches, and lets go of those that trains have left. At the start (no time) switches stand at once.
    fn keep(&mut self, network: &Network, trains: &[Train], now: Option<SimTime>) {
        for (train, way) in trains.iter().zip(&self.ways) {
            let id = train.consist.id;
            let (head_m, tail_m) = train.consist.stands_m();
            let mut signal_m = None;
            for claim in &way.claims {
                let kept_for = &mut self.kept_for[claim.number];
                if tail_m > claim.to_m {
                    if *kept_for == Some(id) && !way.comes_again_to(claim) {
                        *kept_for = None;
                    }
                    continue;
                }
                if claim.from_m - head_m > self.settings.ahead_m {
                    break;
                }
                if kept_for.is_some_and(|other| other != id) {
                    signal_m.get_or_insert(claim.from_m - SIGNAL_M);
                    break;
                }
                *kept_for = Some(id);
                let to_set = |leg: &SwitchLeg| !self.switches.leads_to(claim.number, *leg);
                if let Some(leg) = claim.leg.filter(to_set) {
                    match now {
                        None => self.switches.all[claim.number].set = leg,
                        Some(now) if head_m < claim.from_m => {
                            let throw_s = network.switches[claim.number].throw_s;
                            self.switches.begin(claim.number, leg, now, throw_s);
                            // Until it stands, the signal before it shows danger.
                            signal_m.get_or_insert(claim.from_m - SIGNAL_M);
                        }
                        Some(_) => {}
                    }
                }
            }
            self.signals_m[id.index()] = signal_m.filter(|signal_m| *signal_m > head_m - SIGNAL_M);
        }
    }

    /// The train that stands or runs over a switch.
    fn occupied_by(&self, k: usize, trains: &[Train]) -> Option<usize> {
        trains.iter().zip(&self.ways).position(|(train, way)| {
            let (head_m, tail_m) = train.consist.stands_m();
            let mut over = way.passings.iter().filter(|passing| passing.switch == k);
            over.any(|passing| {
                let (from_m, to_m) = passing.zone_m(self.clear_m[k]);
                head_m > from_m && tail_m < to_m
            })
        })
    }

    /// The train whose route a switch is kept for, if that is over the other leg.
    fn set_for(&self, k: usize, leg: SwitchLeg) -> Option<usize> {
        let train = self.kept_for[k]?.index();
        let mut claims = self.ways[train].claims.iter();
        let is_other = |claim: &Claim| claim.number == k && claim.leg.is_some_and(|set| set != leg);
        claims.any(is_other).then_some(train)
    }

    /// Trains in each other's gauge at a switch or a crossing.
    fn find_fouled(&mut self, network: &Network, trains: &[Train], now: SimTime) {
        let mut fouled = Vec::new();
        for (k, train) in trains.iter().enumerate() {
            let (head_m, tail_m) = train.consist.stands_m();
            for other in trains.iter().take(k) {
                let (front_m, rear_m) = other.consist.stands_m();
                let stretches = other.track.route.stretches(rear_m, front_m);
                let envelope = &self.ways[k].envelope;
                let mut runs = stretches.flat_map(|stretch| envelope.fouls_over(stretch));
                let fouls = runs.any(|(from_m, to_m)| from_m < head_m && to_m > tail_m);
                drop(runs);
                if fouls {
                    fouled.push((train, other.consist.id));
                }
            }
        }
        for (train, other) in fouled {
            self.tell(
                network,
                (now, IncidentKind::Fouled),
                train,
                None,
                Some(other),
            );
        }
    }

    fn tell(
        &mut self,
        network: &Network,
        what: (SimTime, IncidentKind),
        train: &Train,
        switch: Option<usize>,
        other: Option<TrainId>,
    ) {
        // Where the switch is, or else the train's head.
        let toe = switch.and_then(|k| {
            let toe = network.switches[k].toe;
            let s_m = match toe.way {
                Direction::Up => network.alignment(toe.track)?.length_m(),
                Direction::Down => 0.0,
            };
            Some(Place {
                track: toe.track,
                s_m,
            })
        });
        let (head_m, _) = train.consist.stands_m();
        let place = toe.unwrap_or_else(|| train.track.route.place(head_m).0);
        let id = train.consist.id;
        self.incidents
            .add(network, what, (id, place), switch, other);
    }
}

impl Way {
    fn new(network: &Network, train: &Train, clear_m: &[f64]) -> Self {
        let route = &train.track.route;
        let passings = network.passings(route);
        let front_m = train.consist.front_axle_m();
        Self {
            passed: passings.partition_point(|passing| passing.toe_m - TIPS_M <= front_m),
            claims: claims(network, route, &passings, clear_m),
            passings,
            envelope: RouteEnvelope::new(network, route.clone()),
            off_end: false,
        }
    }

    /// It runs once more over the switch or crossing of a claim.
    fn comes_again_to(&self, claim: &Claim) -> bool {
        let mut later = self.claims.iter().filter(|c| c.from_m > claim.from_m);
        later.any(|other| other.number == claim.number)
    }
}

/// What a train on a route must have to itself, in the order in which it begins.
fn claims(network: &Network, route: &Route, passings: &[Passing], clear_m: &[f64]) -> Vec<Claim> {
    let switches = passings.iter().map(|passing| {
        let (from_m, to_m) = passing.zone_m(clear_m[passing.switch]);
        Claim {
            number: passing.switch,
            leg: Some(passing.leg),
            from_m,
            to_m,
        }
    });
    let first = network.switches.len();
    let crossings = network.crossings.iter().enumerate();
    let crossings = crossings.flat_map(|(k, crossing)| {
        let zones = [0, 1].map(|side| crossing.zone(side));
        let runs = zones.into_iter().flat_map(|zone| route.runs_over(zone));
        runs.map(move |(from_m, to_m)| Claim {
            number: first + k,
            leg: None,
            from_m,
            to_m,
        })
    });
    let mut claims: Vec<Claim> = switches.chain(crossings).collect();
    claims.sort_by(|a, b| a.from_m.total_cmp(&b.from_m));
    claims
}
