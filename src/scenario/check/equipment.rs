//! Sensors and equipment of trains: on trains that there are, and of use there.

use super::line::LineCheck;
use crate::bus::TrainEnd;
use crate::scenario::{OnboardEquipment, ScenarioFile};
use crate::settings::Checker;
use crate::stack::occupancy::OccupancySettings;
use crate::stack::protection::ProtectionSettings;
use crate::track::Direction;
use crate::twin::physics::TrainSettings;
use crate::twin::sensors::{GnssSettings, MountSide, RigSettings, ever_sees};
use std::collections::BTreeSet;

/// Of so many lamps, evenly along the line, it is found whether a rig sees them.
const LAMPS_TRIED: usize = 30;
/// A rig must see one of so many of them.
const FEWEST_SEEN_OF: usize = 10;

/// By how much its equipment may take the length of a train wrong. From the rear end, the head is
/// found by it.
const REAR_LENGTH_ERROR_M: f64 = 0.1;
/// Elsewhere it says which gradients are under the train: a quarter of a car is not a coupler more or
/// less, but a car forgotten.
const LENGTH_ERROR_M: f64 = 5.0;
/// By how much its equipment may take the place of the satellite receiver's antenna wrong.
const ANTENNA_ERROR_M: f64 = 1.0;
/// An antenna stands on the roof: so far from the middle at most, and between these heights over the rails.
const ANTENNA_ASIDE_M: f64 = 1.6;
const ANTENNA_UP_M: std::ops::RangeInclusive<f64> = 2.0..=6.0;

/// Sensors and equipment of other trains, each of a train that there is, and named once.
pub(super) fn check_onboard(file: &ScenarioFile, check: &mut Checker<'_>) {
    let others = file.onboard.iter().enumerate();
    let others = others.map(|(k, o)| (format!("onboard[{k}].equipment"), &o.equipment));
    for (key, named) in others.chain([("stack.onboard".to_owned(), &file.stack.onboard)]) {
        let named = named.as_deref().unwrap_or_default();
        if (1..named.len()).any(|k| named[..k].contains(&named[k])) {
            check.problem(&key, "names an equipment twice", "name each once");
        }
    }
    let others = file.other_trains.len();
    let mut equipped = BTreeSet::new();
    for (k, onboard) in file.onboard.iter().enumerate() {
        let number = usize::from(onboard.train);
        let twice = !equipped.insert(onboard.train);
        let what = if twice {
            format!("train {number} has its equipment already")
        } else if number == 0 || number > others {
            format!("there is no other train {number}")
        } else {
            continue;
        };
        let remedy = match others {
            _ if twice => "put all of a train's equipment into one table".to_owned(),
            0 => "add it to [[other_trains]]".to_owned(),
            1 => "give 1: the one of [[other_trains]]".to_owned(),
            most => format!("give 1 to {most}, each once, in the order of [[other_trains]]"),
        };
        check.problem(&format!("onboard[{k}].train"), what, remedy);
    }
}

/// The sensors of motion need the part of the train that they sit on.
pub(super) fn check_motion(file: &ScenarioFile, check: &mut Checker<'_>) {
    let Some(train) = &file.train else {
        let carried = [
            ("doppler", file.doppler.is_some()),
            ("radar", file.radar.is_some()),
            ("gnss", file.gnss.is_some()),
        ];
        for (key, _) in carried.into_iter().filter(|(_, given)| *given) {
            let what = "there is no train that carries it";
            check.problem(key, what, "add [train], or take this out");
        }
        return;
    };
    check_axle("odometer.axle", file.odometer.axle, train, check);
    for (k, onboard) in file.onboard.iter().enumerate() {
        if let Some(train) = file.trains().nth(onboard.train.into()) {
            let key = format!("onboard[{k}].odometer.axle");
            check_axle(&key, onboard.odometer.axle, train, check);
        }
    }
}

fn check_axle(key: &str, axle: u32, train: &TrainSettings, check: &mut Checker<'_>) {
    // A train without cars is a problem of its own.
    let axles = train.axles().max(1);
    if axle > axles {
        check.problem(
            key,
            format!("the train has {axles} wheelsets, not {axle}"),
            format!("give 1 to {axles}"),
        );
    }
}

impl LineCheck<'_, '_> {
    pub(super) fn onboard(&mut self) {
        let file = self.file;
        let first = file.rig.as_ref();
        self.equipped("stack", &file.stack.protection, "rig", first, 0);
        let settings = &file.stack.occupancy;
        self.receiver("gnss", file.gnss.as_ref(), "stack.occupancy", settings);
        if file.train.is_some() && file.gnss.is_none() {
            self.without_receiver("stack.onboard", &file.stack.onboard, "[gnss]");
        }
        for (k, onboard) in file.onboard.iter().enumerate() {
            let (at, rig) = (format!("onboard[{k}]"), onboard.rig.as_ref());
            let (protection, train) = (&onboard.protection, onboard.train.into());
            self.equipped(&at, protection, &format!("{at}.rig"), rig, train);
            let (gnss, own) = (format!("{at}.gnss"), format!("{at}.occupancy"));
            self.receiver(&gnss, onboard.gnss.as_ref(), &own, &onboard.occupancy);
            if onboard.gnss.is_none() {
                let (key, receiver) = (format!("{at}.equipment"), format!("gnss = {{}} to {at}"));
                self.without_receiver(&key, &onboard.equipment, &receiver);
            }
        }
    }

    /// Track occupancy that is named goes by balises, where there is no satellite receiver.
    fn without_receiver(
        &mut self,
        key: &str,
        named: &Option<Vec<OnboardEquipment>>,
        receiver: &str,
    ) {
        let is_named = (named.iter().flatten()).any(|kind| *kind == OnboardEquipment::Occupancy);
        let has_balises = (self.tunnel.network.tracks.iter()).any(|t| !t.balises.is_empty());
        if is_named && !has_balises {
            let what = format!(
                "names \"occupancy\", but the train has no satellite receiver and tunnel `{}` has no balises: \
                 it would never know its track",
                self.tunnel.name
            );
            let remedy =
                format!("add {receiver}, or balises to the tunnel file, or take \"occupancy\" out");
            self.check.problem(key, what, remedy);
        }
    }

    /// Satellites are over a place on the earth, and the equipment is told where the antenna is.
    fn receiver(
        &mut self,
        at: &str,
        gnss: Option<&GnssSettings>,
        stack_at: &str,
        stack: &OccupancySettings,
    ) {
        let Some(gnss) = gnss else {
            return;
        };
        let (behind_m, told_m) = (-gnss.antenna_m[0], stack.antenna_behind_head_m);
        if (behind_m - told_m).abs() > ANTENNA_ERROR_M {
            let what = format!("is {told_m} m, but the antenna is {behind_m} m behind the head");
            let remedy = format!("give a measured distance within {ANTENNA_ERROR_M} m of it");
            let key = format!("{stack_at}.antenna_behind_head_m");
            self.check.problem(&key, what, remedy);
        }
        let [_, left_m, up_m] = gnss.antenna_m;
        if left_m.abs() > ANTENNA_ASIDE_M || !ANTENNA_UP_M.contains(&up_m) {
            let what = format!(
                "the antenna is {left_m} m to the left of the middle and {up_m} m above the rails"
            );
            let remedy = format!(
                "[forward, left, up] from the head at top of rail: within {ANTENNA_ASIDE_M} m of the middle, {} to {} m up",
                ANTENNA_UP_M.start(),
                ANTENNA_UP_M.end()
            );
            self.check.problem(&format!("{at}.antenna_m"), what, remedy);
        }
        if self.tunnel.datum.is_none() {
            let what = format!(
                "tunnel `{}` does not say where on the earth it is",
                self.tunnel.name
            );
            let remedy = "add [datum] with latitude_deg and longitude_deg to the tunnel file, or take this out";
            self.check.problem(at, what, remedy);
        }
    }

    /// The rig and the protection settings of a train.
    fn equipped(
        &mut self,
        at: &str,
        protection: &ProtectionSettings,
        rig_at: &str,
        rig: Option<&RigSettings>,
        train: usize,
    ) {
        if let Some(rig) = rig.filter(|_| self.check.is_right(rig_at)) {
            self.view(rig_at, rig, train);
        }
        let train = self.file.trains().nth(train);
        let Some((train, set_m)) = train.zip(protection.train_length_m) else {
            return;
        };
        let length_m = train.length_m();
        let (most_m, why) = match rig.map(|rig| rig.end) {
            Some(TrainEnd::Rear) => (REAR_LENGTH_ERROR_M, "the rig is at the rear end, and "),
            _ => (LENGTH_ERROR_M, ""),
        };
        if (length_m - set_m).abs() > most_m {
            self.check.problem(
                &format!("{at}.protection.train_length_m"),
                format!("{set_m} m, but {why}the train is {length_m:.2} m long"),
                format!("take it out, or give a measured length within {most_m} m of it"),
            );
        }
    }

    /// A rig must see lamps on the way that its train runs.
    fn view(&mut self, at: &str, rig: &RigSettings, train: usize) {
        let network = &self.tunnel.network;
        // On a bench the rig looks along the first track.
        let train = self.file.trains().nth(train).cloned().unwrap_or_default();
        let Ok(itinerary) = train.itinerary(network) else {
            return;
        };
        let (_, direction) = itinerary.route.place(itinerary.start_m);
        let (route, direction) = match rig.end {
            TrainEnd::Front => (itinerary.route, direction),
            TrainEnd::Rear => (itinerary.route.reversed(), direction.reversed()),
        };
        let way = network.along(&route);
        if way.lamps.is_empty() {
            self.check.problem(
                at,
                format!("tunnel `{}` has no lamps to see", self.tunnel.name),
                "choose a tunnel with lamps, or take out [rig]",
            );
            return;
        }
        let every = way.lamps.len().div_ceil(LAMPS_TRIED);
        let seen = |rig: &RigSettings| {
            let calibration = rig.calibration();
            let tried = way.lamps.iter().step_by(every);
            tried
                .filter(|lamp| ever_sees(&calibration, &way, lamp))
                .count()
        };
        let enough = way.lamps.len().div_ceil(every).div_ceil(FEWEST_SEEN_OF);
        if seen(rig) >= enough {
            return;
        }
        let asks_for_side = direction == Direction::Down || rig.side == MountSide::Right;
        let better = turned(rig)
            .map(|turned| (seen(&turned), turned))
            .into_iter();
        let better = better.max_by_key(|(seen, _)| *seen);
        match better.filter(|(seen, _)| asks_for_side && *seen >= enough) {
            Some((_, turned)) => self.check.problem(
                &format!("{at}.side"),
                "on a train that runs this way it sees hardly a lamp from its luminous side",
                format!(
                    "give side = \"{}\", yaw_deg = {}",
                    match turned.side {
                        MountSide::Left => "left",
                        MountSide::Right => "right",
                    },
                    turned.yaw_deg
                ),
            ),
            None => self.check.problem(
                &format!("{at}.yaw_deg"),
                format!(
                    "turned {} deg to the left and {} deg up, the rig hardly ever sees a whole lamp with both eyes",
                    rig.yaw_deg, rig.pitch_deg
                ),
                "turn it towards the lamps; the reference rig has yaw_deg = 39, pitch_deg = 22",
            ),
        }
    }
}

/// A rig on the other side, looking back, and both.
fn turned(rig: &RigSettings) -> [RigSettings; 3] {
    let other = match rig.side {
        MountSide::Left => MountSide::Right,
        MountSide::Right => MountSide::Left,
    };
    let back_deg = 180.0f64.copysign(rig.yaw_deg) - rig.yaw_deg;
    let turned = [
        (other, rig.yaw_deg),
        (rig.side, back_deg),
        (other, back_deg),
    ];
    turned.map(|(side, yaw_deg)| RigSettings {
        side,
        yaw_deg,
        ..rig.clone()
    })
}
