//! Checks against the line: what stands or runs there must fit into its tunnel.

use crate::bus::{TrainEnd, TrainId};
use crate::scenario::WaysidePost;
use crate::scenario::file::{BenchSettings, ScenarioFile, WaysidePostSettings};
use crate::settings::{Checker, name_advice};
use crate::stack::protection::ProtectionSettings;
use crate::track::{Direction, Tunnel};
use crate::twin::physics::TrainSettings;
use crate::twin::sensors::{MountSide, RigSettings, ever_sees};

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
struct LineCheck<'a, 'c> {
    file: &'a ScenarioFile,
    tunnel: &'a Tunnel,
    check: &'a mut Checker<'c>,
}

impl LineCheck<'_, '_> {
    /// Each on the line, and no two in the same place.
    fn trains(&mut self) {
        let file = self.file;
        // Too many of them are compared with each other for too long.
        if file.other_trains.len() > TrainId::MOST {
            return;
        }
        for (k, train) in file.trains().enumerate() {
            let at = file.train_key(k);
            if !self.check.is_right(&at) {
                continue;
            }
            self.train(&at, train);
            let [from_m, to_m] = stands_m(train);
            let before = file.trains().take(k).position(|other| {
                let [other_from_m, other_to_m] = stands_m(other);
                from_m < other_to_m && other_from_m < to_m
            });
            if let Some(other) = before.map(|other| file.train_key(other)) {
                self.check.problem(
                    &format!("{at}.start_chainage_m"),
                    format!(
                        "it stands from {from_m:.1} to {to_m:.1} m, where `{other}` stands too"
                    ),
                    "start them clear of each other",
                );
            }
        }
    }

    fn train(&mut self, at: &str, train: &TrainSettings) {
        let end_m = self.tunnel.alignment.length_m();
        let (head_m, length_m) = (train.start_chainage_m, train.length_m());
        let start_key = format!("{at}.start_chainage_m");
        self.is_on_line(&start_key, "the train head", head_m);
        let (way, begins_outside, first_m) = match train.direction {
            Direction::Up => ("up", head_m < length_m, length_m),
            Direction::Down => ("down", head_m > end_m - length_m, end_m - length_m),
        };
        if begins_outside {
            self.check.problem(
                &start_key,
                format!("with its head at {head_m} m a train of {length_m:.1} m begins outside"),
                format!("start at {first_m:.1} m or further {way} the line"),
            );
        }
        let stop_key = format!("{at}.stop_at_m");
        if let Some(stop_m) = train.stop_at_m {
            self.is_on_line(&stop_key, "the train head", stop_m);
            return;
        }
        let duration_s = self.file.duration_s;
        let reach_m = head_m + train.direction.sign() * farthest_run_m(train, duration_s);
        if !(0.0..=end_m).contains(&reach_m) {
            let last_m = reach_m.clamp(0.0, end_m);
            self.check.problem(
                &stop_key,
                format!(
                    "it is not given, and in {duration_s} s the train can get to {reach_m:.0} m, \
                     past the end of the tunnel at {last_m:.0} m"
                ),
                format!("give a stop_at_m {way} to {last_m:.0} m, or shorten duration_s"),
            );
        }
    }

    fn bench(&mut self) {
        let right = |_: &&BenchSettings| self.check.is_right("bench");
        let Some(bench) = self.file.bench.as_ref().filter(right) else {
            return;
        };
        for (key, head_m) in [("first_m", bench.first_m), ("points", bench.last_m())] {
            self.is_on_line(&format!("bench.{key}"), "the head", head_m);
        }
    }

    fn obstacles(&mut self) {
        let obstacles = self.file.obstacles.iter().enumerate();
        'obstacles: for (k, o) in obstacles {
            let at = format!("obstacles[{k}]");
            let Some(middle_m) = o.middle_m().filter(|_| self.check.is_right(&at)) else {
                continue;
            };
            let [along_m, across_m, up_m] = if o.count > 1 { o.spread_m } else { [0.0; 3] };
            for side in [-1.0, 1.0] {
                let s_m = o.chainage_m + side * along_m;
                if !self.is_on_line(&format!("{at}.chainage_m"), "it", s_m) {
                    break;
                }
                for (across, up) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
                    let place = [s_m, o.lateral_m + across * across_m, middle_m + up * up_m];
                    if !self.is_in_the_open(&at, place) {
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
            let ends = [("from", &cable.from), ("to", &cable.to)];
            let outside = ends.map(|(key, end)| {
                let place = [end.chainage_m, end.lateral_m, end.height_m];
                !self.is_inside(&format!("{at}.{key}"), "it", place)
            });
            if outside == [false; 2] {
                cable.check_reach(&self.tunnel.alignment, &mut self.check.below(&at));
            }
        }
    }

    fn workers(&mut self) {
        for (k, worker) in self.file.workers.iter().enumerate() {
            if !self.check.is_right(&format!("workers[{k}]")) {
                continue;
            }
            let middle_m = worker.ground_m + 0.5 * worker.stature_m;
            for (j, p) in worker.path.iter().enumerate() {
                let at = format!("workers[{k}].path[{j}]");
                self.is_inside(&at, "he", [p.chainage_m, p.lateral_m, middle_m]);
            }
        }
    }

    /// Whether a place (chainage, left of the centreline, above top of rail) is in the tunnel.
    fn is_inside(&mut self, at: &str, who: &str, place: [f64; 3]) -> bool {
        self.is_on_line(&format!("{at}.chainage_m"), who, place[0])
            && self.is_in_the_open(at, place)
    }

    fn is_on_line(&mut self, key: &str, who: &str, chainage_m: f64) -> bool {
        let end_m = self.tunnel.alignment.length_m();
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

    fn is_in_the_open(&mut self, at: &str, place: [f64; 3]) -> bool {
        let [chainage_m, lateral_m, height_m] = place;
        let section = self.tunnel.section_at(chainage_m);
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

    fn onboard(&mut self) {
        let file = self.file;
        let first = file.rig.as_ref();
        self.equipped("stack", &file.stack.protection, "rig", first, 0);
        for (k, onboard) in file.onboard.iter().enumerate() {
            let (at, rig) = (format!("onboard[{k}]"), onboard.rig.as_ref());
            let (protection, train) = (&onboard.protection, onboard.train.into());
            self.equipped(&at, protection, &format!("{at}.rig"), rig, train);
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
        let direction = rig.end.looks(self.file.direction(train));
        let tunnel = self.tunnel;
        if tunnel.lamps.is_empty() {
            self.check.problem(
                at,
                format!("tunnel `{}` has no lamps to see", tunnel.name),
                "choose a tunnel with lamps, or take out [rig]",
            );
            return;
        }
        let way = tunnel.along(direction);
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

    /// A wayside device at its place.
    fn post(&mut self, at: &str, post: &WaysidePostSettings) -> Option<WaysidePost> {
        if !self.check.is_right(at) {
            return None;
        }
        let tunnel = self.tunnel;
        let key = &format!("{at}.device");
        if post.device.trim().is_empty() {
            let names = tunnel.wayside.iter().map(|site| site.name.as_str());
            let remedy = format!(
                "give the name of one that the tunnel has: {}",
                names.collect::<Vec<_>>().join(", ")
            );
            self.check.problem(key, "names no device", remedy);
            return None;
        }
        let Some(site) = tunnel.wayside.iter().find(|site| site.name == post.device) else {
            let names: Vec<_> = tunnel
                .wayside
                .iter()
                .map(|site| site.name.clone())
                .collect();
            self.check.problem(
                key,
                format!(
                    "tunnel `{}` has no wayside device `{}`",
                    tunnel.name, post.device
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
        let calibration = post.camera.calibration(site, tunnel, with_lidar);
        let actual = post.camera.actual(site, tunnel, with_lidar);
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

/// Where a train stands at the start.
fn stands_m(train: &TrainSettings) -> [f64; 2] {
    let head_m = train.start_chainage_m;
    match train.direction {
        Direction::Up => [head_m - train.length_m(), head_m],
        Direction::Down => [head_m, head_m + train.length_m()],
    }
}

/// How far the driver can get: at full acceleration to the cruising speed, then at that.
fn farthest_run_m(train: &TrainSettings, duration_s: f64) -> f64 {
    let (start, cruise) = (train.start_speed_kmh / 3.6, train.cruise_speed_kmh / 3.6);
    let driven_s = (duration_s - train.start_s).max(0.0);
    let waited_m = start * (duration_s - driven_s);
    let ramp_s = ((cruise - start).max(0.0) / train.accel_mps2).min(driven_s);
    let top = start.max(cruise);
    waited_m + (start + 0.5 * train.accel_mps2 * ramp_s) * ramp_s + top * (driven_s - ramp_s)
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
