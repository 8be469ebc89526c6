//! Which lamp is it: names read from stripes, held against the position that is expected.
//!
//! A lamp is followed from pair to pair by where it is in front of the train: it comes nearer by
//! what the odometer ran. What was read of its code is collected as long as it is followed. A name
//! counts when it is on the map, and
//! - with a position to expect: when the lamp then is where the map has it, within a gate of under
//!   half the distance to the next lamp that faces the rig; a name that contradicts is not used,
//!   until it has been read so often that the expectation must be wrong;
//! - without one: when the same name has been read often enough.
//!
//! Places are compared in space: beside two tracks lamps of several rows stand at one chainage.
//!
//! A name is read from one image, or from several joined; it is read again by as many new chips as a name
//! is read from. A few chips, of which each agrees by chance in one case of two, are no reading.
//!
//! A lamp keeps a name once believed for as long as it is followed, whether its stripes can be read
//! again or not. One of which nothing is read yet takes the name of the map's lamp that is expected there,
//! where its own place is measured well enough to tell that lamp from the next.

use crate::bus::Identity;
use crate::stack::led::ChipVotes;
use crate::track::uid::Uid;
use crate::track::{LampSite, Track};
use nalgebra::{Point3, Vector3};

/// Standard deviations of a measured place that are allowed for before it counts as that of another lamp.
const SIGMAS: f64 = 3.0;
/// Distance that a lamp alone on the map is taken to have to the next, metres.
const ALONE_M: f64 = 10.0;
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
    /// Where the lamp must be in the world if the train is where it takes itself to be.
    pub lamp: Point3<f64>,
    /// Standard deviation of that place along the line of sight, as the pair measures it, metres.
    pub sigma_m: f64,
    /// Where the eye then is.
    pub eye: Point3<f64>,
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
            Some(e) => match self.is_there(uid, &e, map) {
                Some(true) => Verdict::Named(uid, identity),
                Some(false) if proven => Verdict::Moved(uid, identity),
                _ => Verdict::Unknown,
            },
            None if proven => Verdict::Named(uid, identity),
            None => Verdict::Unknown,
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
        let predicted = expected.and_then(|e| {
            let site = e.nearest(map)?;
            let gate_m = self.gate_m(site, &e, map);
            let is_near = e.misses_m(site) < gate_m && SIGMAS * e.sigma_m < gate_m;
            is_near.then_some(site.uid)
        });
        predicted.map_or(Verdict::Unknown, |uid| {
            Verdict::Named(uid, Identity::Predicted)
        })
    }

    /// Whether a lamp is where it is expected; `None` where its place is measured too badly to tell.
    fn is_there(&self, uid: Uid, expected: &Expected, map: &Track) -> Option<bool> {
        let site = map.lamp(uid)?;
        let (miss_m, gate_m) = (expected.misses_m(site), self.gate_m(site, expected, map));
        let is_there = miss_m < gate_m;
        (is_there || miss_m > gate_m + SIGMAS * expected.sigma_m).then_some(is_there)
    }

    /// Within this distance of a lamp's place on the map, metres, no other lamp can be meant.
    fn gate_m(&self, site: &LampSite, expected: &Expected, map: &Track) -> f64 {
        let others = expected.facing(map).filter(|other| other.uid != site.uid);
        let next_m = others.map(|other| (other.centre - site.centre).norm());
        let next_m = next_m.min_by(f64::total_cmp).unwrap_or(ALONE_M);
        self.gate_share * next_m
    }
}

impl Expected {
    /// How far from where it is expected a lamp of the map stands.
    fn misses_m(&self, site: &LampSite) -> f64 {
        (site.centre - self.lamp).norm()
    }

    /// The lamps of the map whose discs the eye can see.
    fn facing<'a>(&self, map: &'a Track) -> impl Iterator<Item = &'a LampSite> {
        let eye = self.eye;
        (map.lamps.iter()).filter(move |site| site.facing.dot(&(eye - site.centre)) > 0.0)
    }

    /// The one of them that stands nearest to the place.
    fn nearest<'a>(&self, map: &'a Track) -> Option<&'a LampSite> {
        let off = |site: &&LampSite| self.misses_m(site);
        (self.facing(map)).min_by(|a, b| off(a).total_cmp(&off(b)))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::stack::led::StripeReading;
    use crate::stack::led::testing::track;
    use crate::track::TrackPoint;
    use crate::track::uid::LineCode;

    const NAMING: Naming = Naming {
        gate_share: 0.4,
        agreeing_reads: 2,
    };

    fn followed() -> Followed {
        let votes = ChipVotes::new(LineCode::Manchester, 45e-6);
        Followed::new(Vector3::new(6.0, 2.7, 3.2), 0.0, 0.0, votes)
    }

    /// A place on a line of lamps on the left, seen from 6 m before it.
    fn at(s_m: f64) -> Option<Expected> {
        let map = track("manchester");
        let place = |s_m, l_m| {
            let h_m = map.lamps[0].height_m;
            (map.alignment).world_from_track(TrackPoint { s_m, l_m, h_m })
        };
        Some(Expected {
            lamp: place(s_m, map.lamps[0].lateral_m),
            sigma_m: 0.1,
            eye: place(s_m - 6.0, 1.0),
        })
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

    /// Two rows that face the rig, 9.4 m apart, their lamps at the same chainages but for half a metre. Fails where the
    /// chainage alone tells lamps apart: then a lamp of the other row is taken, or none.
    #[test]
    fn lamps_of_two_rows_are_told_apart_by_their_places() {
        let mut map = track("manchester");
        let near = map.lamps[20].clone();
        let mut far = LampSite {
            uid: Uid { line: 1, lamp: 999 },
            chainage_m: near.chainage_m + 0.5,
            lateral_m: near.lateral_m + 9.4,
            ..near.clone()
        };
        far.centre = map.alignment.world_from_track(TrackPoint {
            s_m: far.chainage_m,
            l_m: far.lateral_m,
            h_m: far.height_m,
        });
        let mut expected = at(near.chainage_m - 0.7).unwrap();
        let judged = |expected, map: &Track| {
            NAMING.judge(&mut followed(), PairReading::Nothing, Some(expected), map)
        };
        let predicted = |uid| Verdict::Named(uid, Identity::Predicted);
        let across = Expected {
            lamp: far.centre,
            ..expected
        };
        // Across the hall stands a lamp that is not on the map.
        assert_eq!(judged(across, &map), Verdict::Unknown);
        map.lamps.insert(21, far.clone());
        assert_eq!(judged(across, &map), predicted(far.uid));
        assert_eq!(judged(expected, &map), predicted(near.uid));
        // So far off along the sight line that it may be a lamp of the other row.
        expected.sigma_m = 1.5;
        assert_eq!(judged(expected, &map), Verdict::Unknown);
    }

    /// A lamp of which a sliver is seen has no place: it contradicts nothing.
    #[test]
    fn a_place_that_is_not_known_moves_no_train() {
        let map = track("manchester");
        let uid = map.lamps[20].uid;
        let mut lamp = followed();
        let mut expected = at(map.lamps[20].chainage_m + 9.0);
        for _ in 0..2 {
            NAMING.judge(&mut lamp, PairReading::Name(uid), None, &map);
        }
        let mut judge = |expected| NAMING.judge(&mut lamp, PairReading::Name(uid), expected, &map);
        let moved = Verdict::Moved(uid, Identity::Decoded);
        assert_eq!(judge(expected), moved);
        expected = expected.map(|e| Expected { sigma_m: 3.0, ..e });
        assert_eq!(judge(expected), Verdict::Unknown);
    }
}
