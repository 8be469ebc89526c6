//! What an import says: on the terminal, in the head of the file, and as a report.

use crate::track::import::{ImportedMap, LaidMap, LaidTrack, LeftOut};
use nalgebra::Point3;
use serde_json::json;
use std::fmt::Write as _;
use std::path::Path;

/// Of a long list so many lines are shown.
const MOST_SHOWN: usize = 20;

/// As it may stand in a comment.
pub(super) fn file_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name.chars().filter(|c| !c.is_control()).collect()
}

/// An import that is told of.
pub(super) struct Told<'a> {
    pub path: &'a Path,
    pub map: &'a ImportedMap,
    pub laid: &'a LaidMap,
}

impl Told<'_> {
    /// What could not be laid first: that are tracks and switches.
    fn all_left_out(&self) -> impl Iterator<Item = &LeftOut> {
        self.laid.left_out.iter().chain(&self.map.report.left_out)
    }

    fn length_m(&self) -> f64 {
        self.laid.tracks.iter().map(|track| track.length_m).sum()
    }

    /// The farthest that a point of the map is beside its track, with the track, and the root of the mean square of all.
    fn fit(&self) -> Option<(&LaidTrack, f64)> {
        let tracks = &self.laid.tracks;
        let worst = tracks.iter().max_by(|a, b| a.most_m.total_cmp(&b.most_m))?;
        let points: usize = tracks.iter().map(|track| track.points).sum();
        let sum: f64 = tracks
            .iter()
            .map(|t| t.points as f64 * t.rms_m * t.rms_m)
            .sum();
        Some((worst, (sum / points.max(1) as f64).sqrt()))
    }

    /// Lines at the head of the file.
    pub fn comment(&self, source: &[&str]) -> Vec<String> {
        let name = file_name(self.path);
        let file = &self.laid.file;
        let mut lines = vec![
            format!("By `metrotwin import` from {name}."),
            format!(
                "{} tracks, {:.3} km, {} switches, {} crossings. Of the map {} things were left out.",
                file.track.len(),
                self.length_m() / 1000.0,
                file.switches.len(),
                file.crossings.len(),
                self.all_left_out().count()
            ),
        ];
        if let Some((worst, rms_m)) = self.fit() {
            lines.push(format!(
                "Plans are curves near the points of the map: at most {:.2} m beside them, {rms_m:.2} m (rms).",
                worst.most_m
            ));
        }
        lines.push("Tracks lie in the open, but where the map has a tunnel.".to_owned());
        if self.map.plan_is_laid_out {
            lines.push("The map has no coordinates: where tracks lie, and every angle and curve, was made up.".to_owned());
        }
        lines.extend(source.iter().map(|line| (*line).to_owned()));
        lines
    }

    /// What was left out, as far as it is shown.
    pub fn left_out(&self) -> Vec<String> {
        let count = self.all_left_out().count();
        let shown = self.all_left_out().take(MOST_SHOWN).map(|left| {
            let line = match left.line {
                0 => String::new(),
                line => format!("line {line}: "),
            };
            format!("left out: {line}{}: {}", left.what, left.why)
        });
        let mut lines: Vec<String> = shown.collect();
        if count > MOST_SHOWN {
            lines.push(format!(
                "left out: and {} more; --report FILE writes all",
                count - MOST_SHOWN
            ));
        }
        lines
    }

    /// For people.
    pub fn table(&self, out: &Path) -> String {
        let mut text = String::new();
        let counts = &self.map.report.counts;
        let wide = counts
            .keys()
            .map(|what| what.chars().count())
            .max()
            .unwrap_or(0)
            .max(4);
        if !counts.is_empty() {
            let _ = writeln!(text, "{:wide$}  in file        read", "");
        }
        for (what, count) in counts.iter().filter(|(_, count)| count.taken > 0) {
            let _ = writeln!(text, "{what:wide$} {:8} {:11}", count.in_file, count.taken);
        }
        let others: Vec<String> = counts
            .iter()
            .filter(|(_, count)| count.taken == 0)
            .map(|(what, count)| format!("{} {what}", count.in_file))
            .collect();
        if !others.is_empty() {
            let shown = others
                .iter()
                .take(MOST_SHOWN)
                .cloned()
                .collect::<Vec<_>>()
                .join(", ");
            let more = match others.len() - others.len().min(MOST_SHOWN) {
                0 => String::new(),
                more => format!(", and {more} kinds more"),
            };
            let _ = writeln!(text, "not read: {shown}{more}");
        }
        let file = &self.laid.file;
        let _ = writeln!(
            text,
            "\n{}: {} tracks, {:.3} km, {} switches, {} crossings",
            out.display(),
            file.track.len(),
            self.length_m() / 1000.0,
            file.switches.len(),
            file.crossings.len()
        );
        if let Some((worst, rms_m)) = self.fit() {
            let _ = writeln!(
                text,
                "points of the map beside the tracks: {rms_m:.2} m (rms), at most {:.2} m on track `{}`",
                worst.most_m, worst.name
            );
        }
        let tightest = self
            .laid
            .tracks
            .iter()
            .filter_map(|t| Some((t.tightest_m?, t)));
        if let Some((radius_m, track)) = tightest.min_by(|a, b| a.0.total_cmp(&b.0)) {
            let _ = writeln!(
                text,
                "tightest radius: {radius_m:.0} m on track `{}`",
                track.name
            );
        }
        let in_tunnel = self.laid.in_tunnel();
        let _ = writeln!(
            text,
            "in tunnel: {:.3} km of the tracks, {} of the switches",
            in_tunnel.length_m / 1000.0,
            in_tunnel.switches
        );
        if let Some([[south, north], [west, east]]) = self.bounds_deg() {
            let _ = writeln!(
                text,
                "on the earth: latitude {south:.5} to {north:.5}, longitude {west:.5} to {east:.5} degrees"
            );
        }
        let _ = writeln!(text, "left out: {}", self.all_left_out().count());
        text
    }

    /// Latitudes and longitudes between which the map's tracks lie, degrees; none of a map without coordinates.
    fn bounds_deg(&self) -> Option<[[f64; 2]; 2]> {
        let network = &self.map.network;
        let datum = network.datum?;
        let points = network.elements.iter().flat_map(|element| element.points());
        let places = points.map(|(point, _)| {
            let place = datum.geodetic(&Point3::new(point.x, point.y, 0.0));
            [place.latitude_deg, place.longitude_deg]
        });
        let wider = |[least, most]: [f64; 2], deg: f64| [least.min(deg), most.max(deg)];
        places.fold(None, |bounds, [latitude, longitude]| {
            let [a, b] = bounds.unwrap_or([[latitude; 2], [longitude; 2]]);
            Some([wider(a, latitude), wider(b, longitude)])
        })
    }

    /// All of it.
    pub fn json(&self) -> Result<String, serde_json::Error> {
        let counts = self.map.report.counts.iter();
        let counts = counts.map(|(what, c)| {
            (
                what.clone(),
                json!({ "in_file": c.in_file, "taken": c.taken }),
            )
        });
        let in_tunnel = self.laid.in_tunnel();
        let left_out = self.all_left_out();
        let left_out =
            left_out.map(|left| json!({ "line": left.line, "what": left.what, "why": left.why }));
        let tracks = self.laid.tracks.iter().map(|t| {
            json!({
                "name": t.name,
                "elements": t.elements,
                "length_m": t.length_m,
                "points": t.points,
                "most_m": t.most_m,
                "rms_m": t.rms_m,
                "tightest_radius_m": t.tightest_m,
            })
        });
        serde_json::to_string_pretty(&json!({
            "in_tunnel": { "length_m": in_tunnel.length_m, "switches": in_tunnel.switches },
            "counts": counts.collect::<serde_json::Map<_, _>>(),
            "tracks": tracks.collect::<Vec<_>>(),
            "left_out": left_out.collect::<Vec<_>>(),
        }))
    }
}
