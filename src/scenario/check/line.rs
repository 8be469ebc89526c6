//! Checks against the line: what stands, hangs or walks there must fit into its tunnel.

use crate::scenario::WaysidePost;
use crate::scenario::file::{BenchSettings, ScenarioFile, WaysidePostSettings};
use crate::settings::{Checker, name_advice};
use crate::track::{Track, TrackId, Tunnel};

/// Checks against the line, and the wayside devices at their places. A part with a wrong value is not
/// held against the line: what would be said follows from it, and numbers out of their range would
/// take any time or memory.
pub(in crate::scenario) fn in_tunnel(
    file: &ScenarioFile,
    tunnel: &Tunnel,
    check: &mut Checker<'_>,
) -> Vec<WaysidePost> {
    file.faults.check_in(tunnel, &mut check.below("faults"));
    let mut line = LineCheck {
        file,
        tunnel,
        check,
    };
    line.interlocking();
    line.trains();
    line.bench();
    line.obstacles();
    line.cables();
    line.workers();
    line.onboard();
    let posts = file.wayside.iter().enumerate();
    posts
        .filter_map(|(k, post)| line.post(&format!("wayside[{k}]"), post))
        .collect()
}

/// A scenario held against its line.
pub(super) struct LineCheck<'a, 'c> {
    pub(super) file: &'a ScenarioFile,
    pub(super) tunnel: &'a Tunnel,
    pub(super) check: &'a mut Checker<'c>,
}

impl<'a> LineCheck<'a, '_> {
    fn bench(&mut self) {
        let right = |_: &&BenchSettings| self.check.is_right("bench");
        let Some(bench) = self.file.bench.as_ref().filter(right) else {
            return;
        };
        let track = self.tunnel.first_track();
        for (key, head_m) in [("first_m", bench.first_m), ("points", bench.last_m())] {
            self.is_on_line(&format!("bench.{key}"), track, "the head", head_m);
        }
    }

    fn interlocking(&mut self) {
        let settings = &self.file.interlocking;
        let positions = settings.positions.iter().enumerate();
        let positions = positions.map(|(k, p)| (format!("positions[{k}]"), &p.switch));
        let moves = settings.moves.iter().enumerate();
        let moves = moves.map(|(k, m)| (format!("moves[{k}]"), &m.switch));
        let switches = &self.tunnel.network.switches;
        let names: Vec<String> = switches.iter().map(|switch| switch.name.clone()).collect();
        for (key, name) in positions
            .chain(moves)
            .filter(|(_, name)| !names.contains(name))
        {
            let what = format!("tunnel `{}` has no switch `{name}`", self.tunnel.name);
            let advice = name_advice(name, &names, "its switches are", "leave it out");
            let key = format!("interlocking.{key}.switch");
            self.check.problem(&key, what, advice);
        }
    }

    fn obstacles(&mut self) {
        let obstacles = self.file.obstacles.iter().enumerate();
        'obstacles: for (k, o) in obstacles {
            let at = format!("obstacles[{k}]");
            let Some(middle_m) = o.middle_m().filter(|_| self.check.is_right(&at)) else {
                continue;
            };
            let Some(track) = self.track(&at, o.track.as_ref()) else {
                continue;
            };
            let [along_m, across_m, up_m] = if o.count > 1 { o.spread_m } else { [0.0; 3] };
            for side in [-1.0, 1.0] {
                let s_m = o.chainage_m + side * along_m;
                if !self.is_on_line(&format!("{at}.chainage_m"), track, "it", s_m) {
                    break;
                }
                for (across, up) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
                    let place = [s_m, o.lateral_m + across * across_m, middle_m + up * up_m];
                    if !self.is_in_the_open(&at, track, place) {
                        continue 'obstacles;
                    }
                }
            }
        }
    }

    fn cables(&mut self) {
        for (k, cable) in self.file.cables.iter().enumerate() {
            let at = format!("cables[{k}]");
            if !self.check.is_right(&at) {
                continue;
            }
            let Some(track) = self.track(&at, cable.track.as_ref()) else {
                continue;
            };
            let ends = [("from", &cable.from), ("to", &cable.to)];
            let outside = ends.map(|(key, end)| {
                let place = [end.chainage_m, end.lateral_m, end.height_m];
                !self.is_inside(&format!("{at}.{key}"), track, "it", place)
            });
            if outside == [false; 2] {
                cable.check_reach(&track.alignment, &mut self.check.below(&at));
            }
        }
    }

    fn workers(&mut self) {
        for (k, worker) in self.file.workers.iter().enumerate() {
            if !self.check.is_right(&format!("workers[{k}]")) {
                continue;
            }
            let Some(track) = self.track(&format!("workers[{k}]"), worker.track.as_ref()) else {
                continue;
            };
            let middle_m = worker.ground_m + 0.5 * worker.stature_m;
            for (j, p) in worker.path.iter().enumerate() {
                let at = format!("workers[{k}].path[{j}]");
                self.is_inside(&at, track, "he", [p.chainage_m, p.lateral_m, middle_m]);
            }
        }
    }

    /// The track of the name under the key `track`, or the first one; a problem where there is none of it.
    fn track(&mut self, at: &str, name: Option<&String>) -> Option<&'a Track> {
        let Some(name) = name else {
            return Some(self.tunnel.first_track());
        };
        let found = self.tunnel.network.named(name);
        if found.is_none() {
            self.no_track(&format!("{at}.track"), name);
        }
        Some(&self.tunnel.network.tracks[usize::from(found?.0)])
    }

    /// A key names a track that is not there.
    pub(super) fn no_track(&mut self, key: &str, name: &str) {
        let tracks = self.tunnel.network.tracks.iter();
        let mut names: Vec<String> = tracks.clone().map(|track| track.name.clone()).collect();
        let mut what = "track";
        if key.ends_with("via") {
            let stations = tracks.flat_map(|track| &track.stations);
            names.extend(stations.map(|station| station.name.clone()));
            what = "track or station";
        }
        let remedy = name_advice(name, &names, "those of this tunnel are", "leave it out");
        let what = format!("tunnel `{}` has no {what} `{name}`", self.tunnel.name);
        self.check.problem(key, what, remedy);
    }

    /// Whether a place (chainage, left of the centreline, above top of rail) is in the tunnel.
    fn is_inside(&mut self, at: &str, track: &Track, who: &str, place: [f64; 3]) -> bool {
        self.is_on_line(&format!("{at}.chainage_m"), track, who, place[0])
            && self.is_in_the_open(at, track, place)
    }

    pub(super) fn is_on_line(
        &mut self,
        key: &str,
        track: &Track,
        who: &str,
        chainage_m: f64,
    ) -> bool {
        let end_m = track.alignment.length_m();
        let inside = (0.0..=end_m).contains(&chainage_m);
        if !inside {
            self.check.problem(
                key,
                format!("{who} would be at {chainage_m} m, outside of the tunnel"),
                format!("the line runs from 0 to {end_m:.1} m"),
            );
        }
        inside
    }

    fn is_in_the_open(&mut self, at: &str, track: &Track, place: [f64; 3]) -> bool {
        let [chainage_m, lateral_m, height_m] = place;
        let section = track.section_at(chainage_m);
        let open = section.is_none_or(|section| section.contains(lateral_m, height_m));
        if !open {
            self.check.problem(
                &format!("{at}.lateral_m"),
                format!(
                    "{lateral_m} m to the left and {height_m:.2} m above top of rail is inside the \
                     wall at chainage {chainage_m} m"
                ),
                "bring it nearer to the centreline (0 m), or check its height",
            );
        }
        open
    }

    /// A wayside device at its place.
    fn post(&mut self, at: &str, post: &WaysidePostSettings) -> Option<WaysidePost> {
        if !self.check.is_right(at) {
            return None;
        }
        let tracks = (0u16..).zip(&self.tunnel.network.tracks);
        let sites = tracks.flat_map(|(k, track)| {
            let sites = track.wayside.iter();
            sites.map(move |site| (TrackId(k), track, site))
        });
        let key = &format!("{at}.device");
        let Some((id, track, site)) = (sites.clone()).find(|(.., site)| site.name == post.device)
        else {
            let names: Vec<_> = sites.map(|(.., site)| site.name.clone()).collect();
            self.check.problem(
                key,
                format!(
                    "tunnel `{}` has no wayside device `{}`",
                    self.tunnel.name, post.device
                ),
                name_advice(
                    &post.device,
                    &names,
                    "devices of this tunnel",
                    "add [[wayside]] to the tunnel file",
                ),
            );
            return None;
        };
        let with_lidar = post.lidar.is_some();
        let calibration = post.camera.calibration(site, (id, track), with_lidar);
        let actual = post.camera.actual(site, (id, track), with_lidar);
        if calibration.is_none() {
            self.check.problem(
                key,
                format!("its balise `{}` is not in the tunnel", site.balise),
                "name a balise of the tunnel in the tunnel file",
            );
        }
        (calibration.zip(actual)).map(|(calibration, actual)| WaysidePost {
            calibration,
            actual,
            balise: site.balise.clone(),
            camera: post.camera,
            lidar: post.lidar.clone(),
        })
    }
}
