//! Which lamp is it: names read from stripes, held against the position that is expected.
//!
//! A lamp is followed from pair to pair by where it is in front of the train: it comes nearer by
//! what the odometer ran. What was read of its code is collected as long as it is followed. A name
//! counts when it is on the map, and
//! - with a position to expect: when the lamp then is where the map has it, within a gate of under
//!   half the spacing; a name that contradicts is not used, until it has been read so often that
//!   the expectation must be wrong;
//! - without one: when the same name has been read often enough.
//!
//! A name is read from one image, or from several joined; it is read again by as many new chips as a name
//! is read from. A few chips, of which each agrees by chance in one case of two, are no reading.
//!
//! A lamp keeps a name once believed for as long as it is followed, whether its stripes can be read
//! again or not. One of which nothing is read yet takes the name of the map's lamp that is expected there.

use crate::bus::Identity;
use crate::stack::led::ChipVotes;
use crate::track::Track;
use crate::track::uid::Uid;
use nalgebra::Vector3;

/// A followed lamp may be this far from where it is expected, along and across the train.
const FOLLOW_ALONG_M: f64 = 3.0;
const FOLLOW_ACROSS_M: f64 = 1.5;

/// Readings of one name after each other.
#[derive(Clone, Copy, Debug)]
struct Agreeing {
    uid: Uid,
    times: u32,
    /// Chips read since the last of them.
    new_chips: u32,
}

/// A lamp followed from pair to pair.
#[derive(Debug)]
pub struct Followed {
    /// Where it was when last seen, vehicle frame.
    pub lamp_m: Vector3<f64>,
    /// Odometer then.
    pub distance_m: f64,
    /// Seconds since the first pair, then.
    pub seen_s: f64,
    /// What was read of its code.
    pub votes: ChipVotes,
    read: Option<Agreeing>,
    believed: Option<Uid>,
}

impl Followed {
    /// A lamp seen for the first time.
    pub fn new(lamp_m: Vector3<f64>, distance_m: f64, seen_s: f64, votes: ChipVotes) -> Self {
        Self {
            lamp_m,
            distance_m,
            seen_s,
            votes,
            read: None,
            believed: None,
        }
    }

    /// How far a lamp seen now is from where this one should be; `None` beyond the gate.
    pub fn misses_by(&self, lamp_m: &Vector3<f64>, distance_m: f64) -> Option<f64> {
        let miss = lamp_m - self.lamp_m + Vector3::x() * (distance_m - self.distance_m);
        let near = miss.x.abs() < FOLLOW_ALONG_M && miss.y.hypot(miss.z) < FOLLOW_ACROSS_M;
        near.then(|| miss.norm())
    }

    /// Notes the name that all chips so far give, and how often in a row it was read: the first time by
    /// chips of any number of pairs, again by a whole name, or by as many new chips as one takes.
    fn note(&mut self, uid: Uid, reading: PairReading) -> u32 {
        let least_chips = self.votes.least_chips();
        let known = self.read.filter(|read| read.uid == uid);
        let mut read = known.unwrap_or(Agreeing {
            uid,
            times: 0,
            new_chips: least_chips,
        });
        let is_reading = match reading {
            PairReading::Nothing => false,
            PairReading::Name(own) => own == uid,
            PairReading::Chips(chips) => {
                read.new_chips = read.new_chips.saturating_add(chips);
                read.new_chips >= least_chips
            }
        };
        if is_reading {
            (read.times, read.new_chips) = (read.times.saturating_add(1), 0);
        }
        self.read = Some(read);
        read.times
    }
}

/// What one pair's stripes say of a lamp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PairReading {
    /// They cannot be read.
    Nothing,
    /// So many chips of its code.
    Chips(u32),
    /// All of its name.
    Name(Uid),
}

/// What is expected at the time of a pair.
#[derive(Clone, Copy, Debug)]
pub struct Expected {
    /// Chainage at which the lamp must stand if the train is where it takes itself to be.
    pub lamp_chainage_m: f64,
}

/// What to make of a lamp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// It has this name.
    Named(Uid, Identity),
    /// It has this name, and the train is not where it took itself to be.
    Moved(Uid, Identity),
    /// Not known, or contradicted.
    Unknown,
}

/// How readily names are believed.
#[derive(Clone, Copy, Debug)]
pub struct Naming {
    /// Share of the lamps' spacing within which a lamp is where it is expected.
    pub gate_share: f64,
    /// Equal readings that count as proof.
    pub agreeing_reads: u32,
}

impl Naming {
    /// Names a followed lamp. `reading` is what this pair's stripes alone say.
    pub fn judge(
        &self,
        followed: &mut Followed,
        reading: PairReading,
        expected: Option<Expected>,
        map: &Track,
    ) -> Verdict {
        let on_map = |uid: &Uid| map.lamp(*uid).is_some();
        let own = match reading {
            PairReading::Name(uid) if on_map(&uid) => Some((uid, Identity::Decoded)),
            _ => None,
        };
        let joined = || followed.votes.decode().filter(on_map);
        let by_votes = match reading {
            PairReading::Nothing => Identity::Followed,
            _ => Identity::Joined,
        };
        let read = own.or_else(|| joined().map(|uid| (uid, by_votes)));
        let Some((uid, identity)) = read else {
            return self.without_reading(followed, expected, map);
        };
        let proven = followed.note(uid, reading) >= self.agreeing_reads;
        let verdict = match expected {
            Some(e) if self.stands_there(uid, e, map) => Verdict::Named(uid, identity),
            Some(_) if proven => Verdict::Moved(uid, identity),
            None if proven => Verdict::Named(uid, identity),
            _ => Verdict::Unknown,
        };
        followed.believed = (verdict != Verdict::Unknown).then_some(uid);
        verdict
    }

    fn without_reading(
        &self,
        followed: &Followed,
        expected: Option<Expected>,
        map: &Track,
    ) -> Verdict {
        if let Some(uid) = followed.believed {
            return Verdict::Named(uid, Identity::Followed);
        }
        let nearest = expected.and_then(|e| nearest_lamp(map, e.lamp_chainage_m).map(|k| (e, k)));
        match nearest {
            Some((e, k)) if self.stands_there(map.lamps[k].uid, e, map) => {
                Verdict::Named(map.lamps[k].uid, Identity::Predicted)
            }
            _ => Verdict::Unknown,
        }
    }

    fn stands_there(&self, uid: Uid, expected: Expected, map: &Track) -> bool {
        let Some(k) = map.lamps.iter().position(|l| l.uid == uid) else {
            return false;
        };
        let off = (map.lamps[k].chainage_m - expected.lamp_chainage_m).abs();
        off < self.gate_share * spacing_m(map, k)
    }
}

fn nearest_lamp(map: &Track, chainage_m: f64) -> Option<usize> {
    let off = |k: &usize| (map.lamps[*k].chainage_m - chainage_m).abs();
    (0..map.lamps.len()).min_by(|a, b| off(a).total_cmp(&off(b)))
}

/// Distance to the nearer neighbour, 10 m for a lamp alone.
fn spacing_m(map: &Track, k: usize) -> f64 {
    let to = |other: Option<usize>| {
        let neighbour = other.and_then(|o| map.lamps.get(o))?;
        Some((neighbour.chainage_m - map.lamps[k].chainage_m).abs())
    };
    let nearer = [to(k.checked_sub(1)), to(Some(k + 1))]
        .into_iter()
        .flatten();
    let nearest = nearer.fold(f64::INFINITY, f64::min);
    if nearest.is_finite() { nearest } else { 10.0 }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::stack::led::StripeReading;
    use crate::stack::led::testing::track;
    use crate::track::uid::LineCode;

    const NAMING: Naming = Naming {
        gate_share: 0.4,
        agreeing_reads: 2,
    };

    fn followed() -> Followed {
        let votes = ChipVotes::new(LineCode::Manchester, 45e-6);
        Followed::new(Vector3::new(6.0, 2.7, 3.2), 0.0, 0.0, votes)
    }

    fn at(lamp_chainage_m: f64) -> Option<Expected> {
        Some(Expected { lamp_chainage_m })
    }

    /// A wrong name that passes the check sum once must not move the train.
    #[test]
    fn one_wrong_reading_is_not_believed() {
        let map = track("manchester");
        let (a, b) = (map.lamps[20].uid, map.lamps[90].uid);
        let s = map.lamps[20].chainage_m;
        let mut lamp = followed();
        assert_eq!(
            NAMING.judge(&mut lamp, PairReading::Name(b), at(s + 1.0), &map),
            Verdict::Unknown
        );
        assert_eq!(
            NAMING.judge(&mut lamp, PairReading::Name(a), at(s + 1.0), &map),
            Verdict::Named(a, Identity::Decoded)
        );
        assert_eq!(
            NAMING.judge(&mut lamp, PairReading::Name(b), None, &map),
            Verdict::Unknown
        );
        let stranger = Uid { line: 9, lamp: 3 };
        assert_eq!(
            NAMING.judge(&mut followed(), PairReading::Name(stranger), None, &map),
            Verdict::Unknown
        );
    }

    /// Two equal readings start a position, and end a wrong one.
    #[test]
    fn agreeing_readings_are() {
        let map = track("manchester");
        let uid = map.lamps[20].uid;
        for (expected, verdict) in [
            (None, Verdict::Named(uid, Identity::Decoded)),
            (at(700.0), Verdict::Moved(uid, Identity::Decoded)),
        ] {
            let mut lamp = followed();
            assert_eq!(
                NAMING.judge(&mut lamp, PairReading::Name(uid), expected, &map),
                Verdict::Unknown
            );
            assert_eq!(
                NAMING.judge(&mut lamp, PairReading::Name(uid), expected, &map),
                verdict
            );
            // Once believed it keeps its name while it is followed.
            let kept = NAMING.judge(&mut lamp, PairReading::Nothing, expected, &map);
            assert_eq!(kept, Verdict::Named(uid, Identity::Followed));
        }
    }

    /// Fails where chips of long ago count as a reading of every later pair, or a few new ones as a whole
    /// name.
    #[test]
    fn what_was_joined_once_is_one_reading() {
        let map = track("manchester");
        let uid = map.lamps[20].uid;
        let expected = at(map.lamps[90].chainage_m);
        let mut lamp = followed();
        let frame = uid.frame(LineCode::Manchester);
        let reading = StripeReading {
            phase_s: 0.0,
            chips: (0..frame.len).map(|k| Some(frame.is_on(k))).collect(),
            coherence: 0.9,
            edges: 20,
        };
        lamp.votes.add(0.0, &reading);
        let least_chips = lamp.votes.least_chips();
        assert_eq!((least_chips, least_chips % 6), (42, 0));
        assert_eq!(lamp.votes.decode(), Some(uid));
        let mut judge = |reading| NAMING.judge(&mut lamp, reading, expected, &map);
        assert_eq!(judge(PairReading::Chips(frame.len)), Verdict::Unknown);
        for _ in 0..10 {
            assert_eq!(judge(PairReading::Nothing), Verdict::Unknown);
        }
        for _ in 0..least_chips / 6 - 1 {
            assert_eq!(judge(PairReading::Chips(6)), Verdict::Unknown);
        }
        let moved = Verdict::Moved(uid, Identity::Joined);
        assert_eq!(judge(PairReading::Chips(6)), moved);
        // The chips of before are not read again.
        let followed = Verdict::Moved(uid, Identity::Followed);
        assert_eq!(judge(PairReading::Nothing), followed);
    }

    /// Within the gate the expected lamp, between two lamps none.
    #[test]
    fn a_far_lamp_takes_the_expected_name() {
        let map = track("manchester");
        let s = map.lamps[20].chainage_m;
        let named = Verdict::Named(map.lamps[20].uid, Identity::Predicted);
        for off in [-3.9, 0.0, 3.9] {
            assert_eq!(
                NAMING.judge(&mut followed(), PairReading::Nothing, at(s + off), &map),
                named
            );
        }
        assert_eq!(
            NAMING.judge(&mut followed(), PairReading::Nothing, at(s + 4.5), &map),
            Verdict::Unknown
        );
        assert_eq!(
            NAMING.judge(&mut followed(), PairReading::Nothing, None, &map),
            Verdict::Unknown
        );
    }
}
