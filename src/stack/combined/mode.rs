//! Which sources a position rests on, by their health and by what kind of line the train is on.
//!
//! | satellites, tags, odometer | junction | plain line | covered |
//! |---|---|---|---|
//! | 1 1 1 | tags, odometer: full | all three: full | tags, odometer: full |
//! | 1 1 0 | satellites, tags: degraded | satellites, tags: full | tags: coasting |
//! | 1 0 1 | satellites, odometer: degraded | satellites, odometer: full | odometer: coasting |
//! | 0 1 1 | tags, odometer: full | tags, odometer: degraded | tags, odometer: full |
//! | 1 0 0 | satellites: degraded | satellites: degraded | none: coasting |
//! | 0 1 0 | tags: coasting | tags: coasting | tags: coasting |
//! | 0 0 1 | odometer: coasting | odometer: coasting | odometer: coasting |
//! | 0 0 0 | lost | lost | lost |
//!
//! The table of the source (Zhou and Cheng, on combined positioning by satellites, RFID and odometer) is lost. This one
//! follows from its rules and three more:
//! - Satellites never count where the line is covered; on plain line they carry the position; tags correct the odometer
//!   wherever one is read.
//! - At junctions, crossings and stations the track must be known as well as the place. A tag is of one track; fixes cannot
//!   tell tracks 4 m apart at once. So satellites count there only in place of something that has failed, and the mode is
//!   then degraded.
//! - Full: two independent sources, and one that corrects the other soon. Degraded: it is corrected, but one source alone
//!   says so, or the track is not confirmed. Coasting: the position is carried on between tags, or since the last of all,
//!   and its bound grows.
//! - Lost: all three have failed. Nothing else is.

/// One bit for each source: whether it is in order, or whether it counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Sources {
    /// Satellite receiver.
    pub satellites: bool,
    /// Tag reader.
    pub tags: bool,
    /// Odometer.
    pub odometer: bool,
}

/// A source.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Source {
    /// Satellite receiver.
    Satellites,
    /// Tag reader.
    Tags,
    /// Odometer.
    Odometer,
}

/// What kind of line it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Zone {
    /// Switches, level crossings and stations of the main line (X in the source).
    Junction,
    /// The rest of it (Y).
    #[default]
    Plain,
    /// Underground, and leads to a depot that are (Z).
    Covered,
}

/// How good a position may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Grade {
    /// As designed.
    Full,
    /// Corrected, but by one source alone, or with the track unconfirmed.
    Degraded,
    /// Carried on: the bound grows.
    Coasting,
    /// All sources have failed.
    Lost,
}

/// What the table says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mode {
    /// The sources that count.
    pub counts: Sources,
    /// How good the position may be.
    pub grade: Grade,
}

impl Source {
    /// All, in the order of the table.
    pub const ALL: [Self; 3] = [Self::Satellites, Self::Tags, Self::Odometer];
}

impl Sources {
    /// All of them.
    pub const ALL: Self = Self::of(true, true, true);
    /// None of them.
    pub const NONE: Self = Self::of(false, false, false);

    const fn of(satellites: bool, tags: bool, odometer: bool) -> Self {
        Self {
            satellites,
            tags,
            odometer,
        }
    }

    /// Whether one is among them.
    pub fn has(self, source: Source) -> bool {
        match source {
            Source::Satellites => self.satellites,
            Source::Tags => self.tags,
            Source::Odometer => self.odometer,
        }
    }

    /// With one more, or one less.
    #[must_use]
    pub fn with(mut self, source: Source, is: bool) -> Self {
        match source {
            Source::Satellites => self.satellites = is,
            Source::Tags => self.tags = is,
            Source::Odometer => self.odometer = is,
        }
        self
    }

    /// Those that are among both.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self::of(
            self.satellites && other.satellites,
            self.tags && other.tags,
            self.odometer && other.odometer,
        )
    }

    /// From 0 to 7.
    pub fn number(self) -> usize {
        let bits = Source::ALL.iter().enumerate();
        bits.map(|(k, source)| usize::from(self.has(*source)) << k)
            .sum()
    }

    /// By its number.
    pub fn numbered(number: usize) -> Self {
        Self::of(number & 1 != 0, number & 2 != 0, number & 4 != 0)
    }
}

/// The table.
pub fn mode(healthy: Sources, zone: Zone) -> Mode {
    use Grade::{Coasting, Degraded, Full, Lost};
    let as_healthy = |grade| (healthy, grade);
    let (counts, grade) = match (healthy.satellites, healthy.tags, healthy.odometer, zone) {
        (true, true, true, Zone::Junction) => (Sources::of(false, true, true), Full),
        (true, true, true, Zone::Plain) => as_healthy(Full),
        (true, true, true, Zone::Covered) => (Sources::of(false, true, true), Full),
        (true, true, false, Zone::Junction) => as_healthy(Degraded),
        (true, true, false, Zone::Plain) => as_healthy(Full),
        (true, true, false, Zone::Covered) => (Sources::of(false, true, false), Coasting),
        (true, false, true, Zone::Junction) => as_healthy(Degraded),
        (true, false, true, Zone::Plain) => as_healthy(Full),
        (true, false, true, Zone::Covered) => (Sources::of(false, false, true), Coasting),
        (false, true, true, Zone::Plain) => as_healthy(Degraded),
        (false, true, true, Zone::Junction | Zone::Covered) => as_healthy(Full),
        (true, false, false, Zone::Junction | Zone::Plain) => as_healthy(Degraded),
        (true, false, false, Zone::Covered) => (Sources::NONE, Coasting),
        (false, true, false, _) | (false, false, true, _) => as_healthy(Coasting),
        (false, false, false, _) => as_healthy(Lost),
    };
    Mode { counts, grade }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The table of the header, read from it, entry by entry.
    #[test]
    fn the_table_is_as_written_down() {
        let rows = include_str!("mode.rs").lines();
        let rows = rows.filter_map(|line| line.strip_prefix("//! | "));
        let rows: Vec<Vec<&str>> = rows
            .filter(|row| row.starts_with(['0', '1']))
            .map(|row| row.trim_end_matches(" |").split(" | ").collect())
            .collect();
        assert_eq!(rows.len(), 8);
        for row in rows {
            let bits: Vec<bool> = row[0].split(' ').map(|bit| bit == "1").collect();
            let healthy = Sources::of(bits[0], bits[1], bits[2]);
            for (zone, entry) in [Zone::Junction, Zone::Plain, Zone::Covered]
                .into_iter()
                .zip(&row[1..])
            {
                let has = |name| entry.contains("all three") || entry.contains(name);
                let counts = Sources::of(has("satellites"), has("tags"), has("odometer"));
                let grade = match entry {
                    _ if entry.ends_with("full") => Grade::Full,
                    _ if entry.ends_with("degraded") => Grade::Degraded,
                    _ if entry.ends_with("coasting") => Grade::Coasting,
                    _ => Grade::Lost,
                };
                assert_eq!(mode(healthy, zone), Mode { counts, grade }, "{row:?}");
            }
        }
    }

    /// The rules that it follows from: nothing counts that is not in order; satellites never where it is covered; lost
    /// only without any; one source less is never better.
    #[test]
    fn the_table_keeps_its_rules() {
        for zone in [Zone::Junction, Zone::Plain, Zone::Covered] {
            for healthy in (0..8).map(Sources::numbered) {
                let Mode { counts, grade } = mode(healthy, zone);
                assert_eq!(counts.and(healthy), counts);
                assert!(!(counts.satellites && zone == Zone::Covered));
                assert_eq!(grade == Grade::Lost, healthy == Sources::NONE);
                for source in Source::ALL {
                    let fewer = mode(healthy.with(source, false), zone);
                    assert!(
                        fewer.grade >= grade,
                        "{healthy:?} without {source:?} in {zone:?}"
                    );
                }
                assert_eq!(Sources::numbered(healthy.number()), healthy);
            }
        }
    }
}
