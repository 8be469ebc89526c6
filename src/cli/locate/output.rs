//! What `metrotwin locate` writes.

use super::recorded::{RecordedFix, RecordedFixes};
use crate::files::write_whole;
use crate::stack::occupancy::Decision;
use crate::track::Direction;
use crate::track::geodesy::Datum;
use crate::track::plan::PlanNetwork;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::Path;

/// Names of the files.
pub const FILES: [&str; 3] = ["tracks.csv", "tracks.geojson", "summary.json"];

/// A decision that is more probable is fairly confident.
const FAIRLY: f64 = 0.9;

/// What is said at a fix.
pub struct Located {
    pub decision: Decision,
    /// Hypotheses.
    pub alive: usize,
    /// Time that it took, microseconds.
    pub cost_us: f64,
}

/// All of a run.
pub struct Report<'a> {
    pub network: &'a PlanNetwork,
    pub datum: &'a Datum,
    pub recorded: &'a RecordedFixes,
    pub located: &'a [Located],
    /// Of the measured speeds those of the time of the fixes; none where none were measured.
    pub speeds_in_time: Option<usize>,
    /// Tables in which numbers have a decimal comma.
    pub decimal_commas: Vec<&'a Path>,
}

/// A stretch of time over which one element is the most probable.
struct Visit<'a> {
    element: &'a str,
    from_s: f64,
    to_s: f64,
    fixes: usize,
    least_probability: f64,
}

impl Report<'_> {
    /// Writes all files; each is whole or not there.
    pub fn write(&self, folder: &Path) -> std::io::Result<()> {
        let summary = serde_json::to_string_pretty(&self.summary())?;
        let map = serde_json::to_string(&self.geojson())?;
        for (name, text) in FILES.into_iter().zip([self.table(), map, summary]) {
            write_whole(&folder.join(name), text.as_bytes())?;
        }
        Ok(())
    }

    /// A row a fix.
    fn table(&self) -> String {
        let mut table = String::from(
            "time_s,latitude,longitude,element,probability,identified,facing,facing_probability,along_m,sigma_m,second,second_probability,hypotheses\n",
        );
        for (RecordedFix { fix, place, .. }, at) in self.recorded.fixes.iter().zip(self.located) {
            let _ = write!(
                table,
                "{:.3},{:.8},{:.8},",
                fix.time.secs(),
                place.latitude_deg,
                place.longitude_deg
            );
            let mut tracks = at.decision.tracks.iter();
            match tracks.next() {
                Some(best) => {
                    let _ = write!(
                        table,
                        "{},{:.10},{},{},{:.10},{:.3},{:.3},",
                        self.network.elements[best.element].id,
                        best.probability,
                        at.decision.is_identified(),
                        facing(best.facing),
                        best.facing_probability,
                        best.along_m,
                        best.sigma_m
                    );
                }
                None => table.push_str(",,false,,,,,"),
            }
            let second = tracks.next().map(|track| {
                let id = &self.network.elements[track.element].id;
                format!("{id},{:.10}", track.probability)
            });
            let _ = writeln!(
                table,
                "{},{}",
                second.unwrap_or_else(|| ",".to_owned()),
                at.alive
            );
        }
        table
    }

    /// A point on the track for each fix.
    fn geojson(&self) -> Value {
        let fixes = self.recorded.fixes.iter().zip(self.located);
        let features = fixes.filter_map(|(RecordedFix { fix, .. }, at)| {
            let best = at.decision.tracks.first()?;
            let element = &self.network.elements[best.element];
            let (world, _) = element.at(best.along_m);
            let place = self.datum.geodetic(&nalgebra::Point3::new(world.x, world.y, 0.0));
            Some(json!({
                "type": "Feature",
                "geometry": { "type": "Point", "coordinates": [place.longitude_deg, place.latitude_deg] },
                "properties": {
                    "time_s": fix.time.secs(),
                    "element": element.id,
                    "probability": best.probability,
                    "identified": at.decision.is_identified(),
                    "facing": facing(best.facing),
                    "along_m": best.along_m,
                    "sigma_m": best.sigma_m,
                },
            }))
        });
        json!({ "type": "FeatureCollection", "features": features.collect::<Vec<_>>() })
    }

    fn summary(&self) -> Value {
        let [identified, fairly, undecided, nowhere] = self.counts();
        let visits = self.visits().into_iter().map(|visit| {
            json!({
                "element": visit.element,
                "from_s": visit.from_s,
                "to_s": visit.to_s,
                "fixes": visit.fixes,
                "least_probability": visit.least_probability,
            })
        });
        json!({
            "elements": self.network.elements.len(),
            "fixes": self.located.len(),
            "refused_fixes": self.recorded.refused,
            "out_of_order": self.recorded.out_of_order,
            "speed": if self.speeds_in_time.is_some() { "measured" } else { "from the fixes" },
            "identified": identified,
            "fairly_confident": fairly,
            "undecided": undecided,
            "on_no_track": nowhere,
            "most_hypotheses": self.located.iter().map(|at| at.alive).max(),
            "us_per_fix": { "p50": self.cost_us(0.5), "p99": self.cost_us(0.99) },
            "visits": visits.collect::<Vec<_>>(),
        })
    }

    /// For people.
    pub fn text(&self, folder: &Path) -> String {
        let [identified, fairly, undecided, nowhere] = self.counts();
        let share = |count: usize| 100.0 * count as f64 / self.located.len().max(1) as f64;
        let mut text = format!(
            "{} fixes on {} elements: {:.1} % identified, {:.1} % over {FAIRLY}, {:.1} % undecided, {:.1} % on no track; {:.0} us a fix (99 %: {:.0})\n\n",
            self.located.len(),
            self.network.elements.len(),
            share(identified),
            share(fairly),
            share(undecided),
            share(nowhere),
            self.cost_us(0.5),
            self.cost_us(0.99)
        );
        let _ = writeln!(text, "   from s      to s   fixes  least probable  element");
        for visit in self.visits() {
            let _ = writeln!(
                text,
                "{:9.1} {:9.1} {:7} {:15.10}  {}",
                visit.from_s, visit.to_s, visit.fixes, visit.least_probability, visit.element
            );
        }
        for note in self.notes() {
            let _ = write!(text, "\nnote: {note}");
        }
        let _ = write!(text, "\nresults in {}", folder.display());
        text
    }

    /// What hints at tables or a map that are not as they should be.
    fn notes(&self) -> Vec<String> {
        let recorded = self.recorded;
        let [_, _, _, nowhere] = self.counts();
        let mut notes = Vec::new();
        for path in &self.decimal_commas {
            notes.push(format!(
                "commas in the numbers of {} were taken for decimal commas, as other signs stand between its headers",
                path.display()
            ));
        }
        if recorded.out_of_order > 0 {
            notes.push(format!(
                "{} rows of the fixes are not newer than the row before, and were left out: sort the table by time, and \
                 give times with their fractions of seconds",
                recorded.out_of_order
            ));
        }
        if recorded.refused > 0 {
            notes.push(format!(
                "{} rows are no fixes by their solution_status, and were left out",
                recorded.refused
            ));
        }
        if nowhere == self.located.len() {
            notes.push("no fix came near enough to a track: is the map of that place, and the covariance as large as \
                        the errors?".to_owned());
        }
        if self.network.is_without_joints() {
            notes.push("the map says of no two elements that a train runs from one to the other: each stands for itself"
                .to_owned());
        }
        if self.speeds_in_time == Some(0) {
            notes.push("no speed is of the time of the fixes: do both tables count time from the same moment?".to_owned());
        }
        notes
    }

    /// Fixes with one track left, with one over 0.9, with none so probable, and on no track.
    fn counts(&self) -> [usize; 4] {
        let mut counts = [0; 4];
        for at in self.located {
            let kind = match at.decision.tracks.first() {
                Some(_) if at.decision.is_identified() => 0,
                Some(best) if best.probability > FAIRLY => 1,
                Some(_) => 2,
                None => 3,
            };
            counts[kind] += 1;
        }
        counts
    }

    fn visits(&self) -> Vec<Visit<'_>> {
        let mut visits: Vec<Visit<'_>> = Vec::new();
        for (RecordedFix { fix, .. }, at) in self.recorded.fixes.iter().zip(self.located) {
            let Some(best) = at.decision.tracks.first() else {
                continue;
            };
            let (element, time_s) = (&*self.network.elements[best.element].id, fix.time.secs());
            match visits.last_mut().filter(|visit| visit.element == element) {
                Some(visit) => {
                    visit.to_s = time_s;
                    visit.fixes += 1;
                    visit.least_probability = visit.least_probability.min(best.probability);
                }
                None => visits.push(Visit {
                    element,
                    from_s: time_s,
                    to_s: time_s,
                    fixes: 1,
                    least_probability: best.probability,
                }),
            }
        }
        visits
    }

    fn cost_us(&self, share: f64) -> f64 {
        let mut costs: Vec<f64> = self.located.iter().map(|at| at.cost_us).collect();
        costs.sort_by(f64::total_cmp);
        let at = (share * costs.len() as f64) as usize;
        costs
            .get(at.min(costs.len().saturating_sub(1)))
            .copied()
            .unwrap_or(0.0)
    }
}

fn facing(way: Direction) -> &'static str {
    match way {
        Direction::Up => "up",
        Direction::Down => "down",
    }
}
