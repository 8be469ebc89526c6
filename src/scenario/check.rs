//! What no part can check by itself: how the parts of a scenario go together.

use super::WaysidePost;
use super::file::{ScenarioFile, WaysidePostSettings};
use crate::bus::{TrainEnd, TrainId};
use crate::settings::{Checker, did_you_mean};
use crate::track::{Direction, Tunnel};
use crate::twin::faults::rig_cameras;
use crate::twin::physics::TrainSettings;
use crate::twin::sensors::{MountSide, RigSettings, ever_sees};
use std::borrow::Cow;

impl ScenarioFile {
    /// What needs no tunnel.
    pub(super) fn check_together(&self, check: &mut Checker<'_>) {
        check_name(&self.name, check);
        if self.train.is_none() && !self.other_trains.is_empty() {
            check.problem(
                "other_trains",
                "there is no first train that they are added to",
                "call the first of them [train]",
            );
        } else {
            self.physics().check_together(check);
        }
        check_onboard(self, check);
        for (k, post) in self.wayside.iter().enumerate() {
            if self.wayside[..k].iter().any(|p| p.device == post.device) {
                check.problem(
                    &format!("wayside[{k}].device"),
                    format!("`{}` is in use already", post.device),
                    "name each device once",
                );
            }
        }
        check_faulty_cameras(self, check);
        check_carrier(self, check);
        check_motion(self, check);
        check_appearances(self, check);
    }
}

/// Checks against the line, and the wayside devices at their places.
pub(super) fn in_tunnel(
    file: &ScenarioFile,
    tunnel: &Tunnel,
    check: &mut Checker<'_>,
) -> Vec<WaysidePost> {
    file.faults.check_in(tunnel, &mut check.below("faults"));
    check_trains(file, tunnel, check);
    if let Some(bench) = &file.bench {
        let heads: Vec<f64> = bench.heads_m().collect();
        for (key, head) in [("first_m", heads.first()), ("points", heads.last())] {
            if let Some(&head_m) = head {
                inside_line(&format!("bench.{key}"), "the head", head_m, tunnel, check);
            }
        }
    }
    check_obstacles(file, tunnel, check);
    check_cables(file, tunnel, check);
    check_workers(file, tunnel, check);
    let directions: Vec<Direction> = file.trains().map(|train| train.direction).collect();
    let others = file.onboard.iter().enumerate();
    let others = others.filter_map(|(k, onboard)| {
        let rig = onboard.rig.as_ref()?;
        Some((format!("onboard[{k}].rig"), usize::from(onboard.train), rig))
    });
    let first = file.rig.iter().map(|rig| ("rig".to_owned(), 0, rig));
    for (at, train, rig) in first.chain(others) {
        let running = directions.get(train).copied().unwrap_or_default();
        let direction = match rig.end {
            TrainEnd::Front => running,
            TrainEnd::Rear => running.reversed(),
        };
        check_view(&at, rig, direction, tunnel, check);
    }
    let posts = file.wayside.iter().enumerate();
    posts
        .filter_map(|(k, post)| place(post, &format!("wayside[{k}]"), tunnel, check))
        .collect()
}

/// Sensors and equipment of other trains, each of a train that there is, and named once.
fn check_onboard(file: &ScenarioFile, check: &mut Checker<'_>) {
    let kinds = file.onboard.iter().enumerate();
    let kinds = kinds.map(|(k, o)| (format!("onboard[{k}].equipment"), &o.equipment));
    for (key, kinds) in kinds.chain([("stack.onboard".to_owned(), &file.stack.onboard)]) {
        if (1..kinds.len()).any(|k| kinds[..k].contains(&kinds[k])) {
            check.problem(&key, "names an equipment twice", "name each once");
        }
    }
    let others = file.other_trains.len();
    for (k, onboard) in file.onboard.iter().enumerate() {
        let number = usize::from(onboard.train);
        let twice = file.onboard[..k].iter().any(|o| o.train == onboard.train);
        let what = if twice {
            format!("train {number} has its equipment already")
        } else if number == 0 || number > others {
            format!("there is no other train {number}")
        } else {
            continue;
        };
        let remedy = match others {
            0 => "add it to [[other_trains]]".to_owned(),
            1 => "give 1: the one of [[other_trains]]".to_owned(),
            most => format!("give 1 to {most}, each once, in the order of [[other_trains]]"),
        };
        check.problem(&format!("onboard[{k}].train"), what, remedy);
    }
}

fn check_name(name: &str, check: &mut Checker<'_>) {
    let fit = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if name.is_empty() || !name.chars().all(fit) {
        check.problem(
            "name",
            format!("`{name}` cannot name a folder of results"),
            "use letters, digits, `_` and `-`",
        );
    }
}

/// Something must move or look, and only one thing may carry the rig.
fn check_carrier(file: &ScenarioFile, check: &mut Checker<'_>) {
    match (&file.train, &file.bench, &file.rig) {
        (Some(_), Some(_), _) => check.problem(
            "bench",
            "there is a train too, and the rig can be on one of them only",
            "take out [bench] or [train]",
        ),
        (None, Some(_), None) => check.problem(
            "bench",
            "there is no rig to stand at its points",
            "add [rig]; empty, it is the reference rig",
        ),
        (None, None, Some(_)) => check.problem(
            "rig",
            "there is nothing that carries it",
            "add [train], or [bench] for a rig at rest",
        ),
        (None, None, None) if file.wayside.is_empty() => check.problem(
            "train",
            "there is no train, no bench and no wayside device: nothing would be seen",
            "add [train] with [rig], [bench] with [rig], or [[wayside]]",
        ),
        _ => {}
    }
    if file.bench.is_none() {
        return;
    }
    if file
        .rig
        .as_ref()
        .is_some_and(|rig| rig.end == TrainEnd::Rear)
    {
        check.problem(
            "rig.end",
            "a bench has no train, and so no rear end",
            "take it out, or give \"front\"",
        );
    }
    for (key, count) in [
        ("wayside", file.wayside.len()),
        ("other_trains", file.other_trains.len()),
        ("obstacles", file.obstacles.len()),
        ("cables", file.cables.len()),
        ("workers", file.workers.len()),
    ] {
        if count > 0 {
            check.problem(
                key,
                "a bench test has the rig and the lamps only: they would not be there",
                format!("take out [bench] or [[{key}]]"),
            );
        }
    }
}

/// A fault of a camera that is not there would go unnoticed.
fn check_faulty_cameras(file: &ScenarioFile, check: &mut Checker<'_>) {
    let first = file.rig.iter().map(|_| TrainId(0));
    let others = file.onboard.iter().filter(|onboard| onboard.rig.is_some());
    let rigs = first.chain(others.map(|onboard| TrainId(onboard.train)));
    let eyes = rigs.flat_map(rig_cameras);
    let devices = file.wayside.iter().map(|post| post.device.clone());
    let names: Vec<String> = eyes.chain(devices).collect();
    for (k, fault) in file.faults.cameras.iter().enumerate() {
        if !names.contains(&fault.camera) {
            let remedy = match did_you_mean(&fault.camera, &names) {
                Some(name) => format!("did you mean `{name}`?"),
                None if names.is_empty() => "add [rig] or [[wayside]], or take this out".to_owned(),
                None => format!("cameras of this scenario: {}", names.join(", ")),
            };
            check.problem(
                &format!("faults.cameras[{k}].camera"),
                format!("there is no camera `{}`", fault.camera),
                remedy,
            );
        }
        if file.bench.is_some() && fault.late_s() > 0.0 {
            check.problem(
                &format!("faults.cameras[{k}].fault.by_ms"),
                "a rig at rest on a bench does not wait for its images: they cannot be late",
                "take this out",
            );
        }
    }
}

/// The sensors of motion need the part of the train that they sit on.
fn check_motion(file: &ScenarioFile, check: &mut Checker<'_>) {
    let Some(train) = &file.train else {
        if file.doppler.is_some() {
            check.problem(
                "doppler",
                "there is no train that carries it",
                "add [train], or take this out",
            );
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

fn check_appearances(file: &ScenarioFile, check: &mut Checker<'_>) {
    let late = |check: &mut Checker<'_>, key: String, what: &str, at_s: f64| {
        if at_s > file.duration_s {
            check.problem(
                &key,
                format!(
                    "{what} at {at_s} s, but the run ends at {} s",
                    file.duration_s
                ),
                "choose an earlier time, or a longer duration_s",
            );
        }
    };
    for (k, obstacle) in file.obstacles.iter().enumerate() {
        let key = format!("obstacles[{k}].appears_s");
        late(check, key, "it appears", obstacle.appears_s);
        if let Some(at_s) = obstacle.held_until_s {
            let key = format!("obstacles[{k}].held_until_s");
            late(check, key, "it comes loose", at_s);
        }
    }
    for (k, cable) in file.cables.iter().enumerate() {
        for (end, at_s) in [("from", cable.from.lets_go_s), ("to", cable.to.lets_go_s)] {
            let key = format!("cables[{k}].{end}.lets_go_s");
            late(check, key, "it lets go", at_s.unwrap_or_default());
        }
    }
    for (k, worker) in file.workers.iter().enumerate() {
        let Some(at_s) = worker.puts_down_s else {
            continue;
        };
        let key = format!("workers[{k}].puts_down_s");
        if worker.carries.is_none() {
            check.problem(
                &key,
                "he carries nothing that he could put down",
                format!("add [workers.carries] to workers[{k}], or take this out"),
            );
        }
        late(check, key, "he puts it down", at_s);
        if let Some(at_s) = worker.picks_up_s {
            let key = format!("workers[{k}].picks_up_s");
            late(check, key, "he picks it up", at_s);
        }
    }
}

/// Each on the line, and no two in the same place.
fn check_trains(file: &ScenarioFile, tunnel: &Tunnel, check: &mut Checker<'_>) {
    for (k, train) in file.trains().enumerate() {
        let at = file.train_key(k);
        check_train(&at, train, file.duration_s, tunnel, check);
        let [from_m, to_m] = stands_m(train);
        let before = file.trains().take(k).position(|other| {
            let [other_from_m, other_to_m] = stands_m(other);
            from_m < other_to_m && other_from_m < to_m
        });
        if let Some(other) = before.map(|other| file.train_key(other)) {
            check.problem(
                &format!("{at}.start_chainage_m"),
                format!("it stands from {from_m:.1} to {to_m:.1} m, where `{other}` stands too"),
                "start them clear of each other",
            );
        }
    }
}

/// Which way it runs, in words.
fn way(train: &TrainSettings) -> &'static str {
    match train.direction {
        Direction::Up => "up",
        Direction::Down => "down",
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

fn check_train(
    at: &str,
    train: &TrainSettings,
    duration_s: f64,
    tunnel: &Tunnel,
    check: &mut Checker<'_>,
) {
    let start_key = format!("{at}.start_chainage_m");
    let stop_key = format!("{at}.stop_at_m");
    let end_m = tunnel.alignment.length_m();
    let head_m = train.start_chainage_m;
    let length_m = train.length_m();
    inside_line(&start_key, "the train head", head_m, tunnel, check);
    let (begins_outside, first_m) = match train.direction {
        Direction::Up => (head_m < length_m, length_m),
        Direction::Down => (head_m > end_m - length_m, end_m - length_m),
    };
    let way = way(train);
    if begins_outside {
        check.problem(
            &start_key,
            format!("with its head at {head_m} m a train of {length_m:.1} m begins outside"),
            format!("start at {first_m:.1} m or further {way} the line"),
        );
    }
    if let Some(stop_m) = train.stop_at_m {
        inside_line(&stop_key, "the train head", stop_m, tunnel, check);
    } else {
        let reach_m = head_m + train.direction.sign() * farthest_run_m(train, duration_s);
        if !(0.0..=end_m).contains(&reach_m) {
            let last_m = reach_m.clamp(0.0, end_m);
            check.problem(
                &stop_key,
                format!(
                    "it is not given, and in {duration_s} s the train can get to {reach_m:.0} m, \
                     past the end of the tunnel at {last_m:.0} m"
                ),
                format!("give a stop_at_m {way} to {last_m:.0} m, or shorten duration_s"),
            );
        }
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

fn check_obstacles(file: &ScenarioFile, tunnel: &Tunnel, check: &mut Checker<'_>) {
    'obstacles: for (k, o) in file.obstacles.iter().enumerate() {
        let key = format!("obstacles[{k}].chainage_m");
        let Some(middle_m) = o.middle_m() else {
            continue;
        };
        let spread = if o.count > 1 { o.spread_m } else { [0.0; 3] };
        for side in [-1.0, 1.0] {
            let s_m = o.chainage_m + side * spread[0];
            if !inside_line(&key, "it", s_m, tunnel, check) {
                break;
            }
            let at = format!("obstacles[{k}].lateral_m");
            for (across, up) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
                let l_m = o.lateral_m + across * spread[1];
                let h_m = middle_m + up * spread[2];
                if !in_the_open(&at, s_m, l_m, h_m, tunnel, check) {
                    continue 'obstacles;
                }
            }
        }
    }
}

fn check_cables(file: &ScenarioFile, tunnel: &Tunnel, check: &mut Checker<'_>) {
    for (k, cable) in file.cables.iter().enumerate() {
        let at = format!("cables[{k}]");
        let mut inside = true;
        for (key, end) in [("from", &cable.from), ("to", &cable.to)] {
            let (s_m, l_m) = (end.chainage_m, end.lateral_m);
            let at = format!("{at}.{key}");
            inside &= inside_line(&format!("{at}.chainage_m"), "it", s_m, tunnel, check)
                && in_the_open(
                    &format!("{at}.lateral_m"),
                    s_m,
                    l_m,
                    end.height_m,
                    tunnel,
                    check,
                );
        }
        if inside {
            cable.check_reach(&tunnel.alignment, &mut check.below(&at));
        }
    }
}

fn check_workers(file: &ScenarioFile, tunnel: &Tunnel, check: &mut Checker<'_>) {
    for (k, worker) in file.workers.iter().enumerate() {
        for (j, p) in worker.path.iter().enumerate() {
            let at = format!("workers[{k}].path[{j}]");
            let key = format!("{at}.chainage_m");
            if inside_line(&key, "he", p.chainage_m, tunnel, check) {
                let middle_m = worker.ground_m + 0.5 * worker.stature_m;
                let at = format!("{at}.lateral_m");
                in_the_open(&at, p.chainage_m, p.lateral_m, middle_m, tunnel, check);
            }
        }
    }
}

fn inside_line(
    key: &str,
    who: &str,
    chainage_m: f64,
    tunnel: &Tunnel,
    check: &mut Checker<'_>,
) -> bool {
    let end_m = tunnel.alignment.length_m();
    let inside = (0.0..=end_m).contains(&chainage_m);
    if !inside {
        check.problem(
            key,
            format!("{who} would be at {chainage_m} m, outside of the tunnel"),
            format!("the line runs from 0 to {end_m:.1} m"),
        );
    }
    inside
}

fn in_the_open(
    key: &str,
    chainage_m: f64,
    lateral_m: f64,
    height_m: f64,
    tunnel: &Tunnel,
    check: &mut Checker<'_>,
) -> bool {
    let section = tunnel.section_at(chainage_m);
    let open = section.is_none_or(|section| section.contains(lateral_m, height_m));
    if !open {
        check.problem(
            key,
            format!(
                "{lateral_m} m to the left and {height_m:.2} m above top of rail is inside the \
                 wall at chainage {chainage_m} m"
            ),
            "bring it nearer to the centreline (0 m), or check its height",
        );
    }
    open
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

/// A rig must see lamps on the way that its train runs.
fn check_view(
    at: &str,
    rig: &RigSettings,
    direction: Direction,
    tunnel: &Tunnel,
    check: &mut Checker<'_>,
) {
    if tunnel.lamps.is_empty() {
        check.problem(
            at,
            format!("tunnel `{}` has no lamps to see", tunnel.name),
            "choose a tunnel with lamps, or take out [rig]",
        );
        return;
    }
    let way = match direction {
        Direction::Up => Cow::Borrowed(tunnel),
        Direction::Down => Cow::Owned(tunnel.reversed()),
    };
    let sees = |rig: &RigSettings| {
        let calibration = rig.calibration();
        (way.lamps.iter()).any(|lamp| ever_sees(&calibration, &way, lamp))
    };
    if sees(rig) {
        return;
    }
    let asks_for_side = direction == Direction::Down || rig.side == MountSide::Right;
    let better = turned(rig).into_iter().find(|turned| sees(turned));
    if let Some(turned) = better.filter(|_| asks_for_side) {
        let side = match turned.side {
            MountSide::Left => "left",
            MountSide::Right => "right",
        };
        check.problem(
            &format!("{at}.side"),
            "on a train that runs this way it sees no lamp from its luminous side",
            format!("give side = \"{side}\", yaw_deg = {}", turned.yaw_deg),
        );
        return;
    }
    check.problem(
        &format!("{at}.yaw_deg"),
        format!(
            "turned {} deg to the left and {} deg up, the rig never sees a whole lamp with both eyes",
            rig.yaw_deg, rig.pitch_deg
        ),
        "turn it towards the lamps; the reference rig has yaw_deg = 39, pitch_deg = 22",
    );
}

fn place(
    post: &WaysidePostSettings,
    at: &str,
    tunnel: &Tunnel,
    check: &mut Checker<'_>,
) -> Option<WaysidePost> {
    let Some(site) = tunnel.wayside.iter().find(|site| site.name == post.device) else {
        unknown_device(post, at, tunnel, check);
        return None;
    };
    let with_lidar = post.lidar.is_some();
    let calibration = post.camera.calibration(site, tunnel, with_lidar);
    let actual = post.camera.actual(site, tunnel, with_lidar);
    if calibration.is_none() {
        check.problem(
            &format!("{at}.device"),
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

fn unknown_device(post: &WaysidePostSettings, at: &str, tunnel: &Tunnel, check: &mut Checker<'_>) {
    let names: Vec<String> = tunnel
        .wayside
        .iter()
        .map(|site| site.name.clone())
        .collect();
    let remedy = match did_you_mean(&post.device, &names) {
        Some(name) => format!("did you mean `{name}`?"),
        None if names.is_empty() => "add [[wayside]] to the tunnel file".to_owned(),
        None => format!("devices of this tunnel: {}", names.join(", ")),
    };
    check.problem(
        &format!("{at}.device"),
        format!(
            "tunnel `{}` has no wayside device `{}`",
            tunnel.name, post.device
        ),
        remedy,
    );
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::settings::{Settings, read_toml};
    use crate::twin::render::gpu::layout::MAX_HEADLIGHTS;

    fn keys(rest: &str) -> Vec<String> {
        let text = format!("name = \"test\"\ntunnel = \"given\"\n{rest}");
        let mut problems = Vec::new();
        read_toml::<ScenarioFile>(&text)
            .unwrap()
            .check("", &mut problems);
        problems.into_iter().map(|p| p.key).collect()
    }

    /// A sensor of motion that nothing carries, or on a wheelset that the train has not, would
    /// be silent all the run.
    #[test]
    fn sensors_of_motion_need_their_place() {
        assert_eq!(keys("[bench]\n[rig]\n[doppler]\n"), ["doppler"]);
        assert_eq!(keys("[train]\n[doppler]\n[odometer]\naxle = 24\n"), [""; 0]);
        let short = "[train]\ncars = 2\n[odometer]\naxle = 9\n[doppler]\nrate_hz = 0.0\n";
        assert_eq!(keys(short), ["doppler.rate_hz", "odometer.axle"]);
    }

    /// Every fault that could not act as written is refused, with its key.
    #[test]
    fn faults_must_be_able_to_strike() {
        let text = include_str!("../../tunnels/chengdu_line1.toml");
        let tunnel = Tunnel::from_toml(text).unwrap();
        let keys = |faults: &str| {
            let text = format!(
                "name = \"test\"\ntunnel = \"given\"\n[train]\nstop_at_m = 900.0\n[rig]\n\
                 [[wayside]]\ndevice = \"W1530\"\n{faults}"
            );
            let (file, mut problems) = (read_toml::<ScenarioFile>(&text).unwrap(), Vec::new());
            file.check("", &mut problems);
            in_tunnel(&file, &tunnel, &mut Checker::new("", &mut problems));
            problems.into_iter().map(|p| p.key).collect::<Vec<_>>()
        };
        let lamp = |rest: &str| keys(&format!("[[faults.lamps]]\n{rest}\n"));
        assert_eq!(lamp("share = 0.22\nfault = { kind = 'dead' }"), [""; 0]);
        let bad = "share = 1.5\nfault = { kind = 'dim', level = -0.1 }\nfrom_s = 5.0\nto_s = 4.0";
        let at = "faults.lamps[0]";
        let expected = ["share", "fault.level", "to_s"].map(|key| format!("{at}.{key}"));
        assert_eq!(lamp(bad), expected);
        let flicker = "fault = { kind = 'flicker', depth = 2.0, frequency_hz = 0.0 }";
        let expected = ["depth", "frequency_hz"].map(|key| format!("{at}.fault.{key}"));
        assert_eq!(lamp(flicker), expected);
        let missing = "numbers = [3, 4000]\nfault = { kind = 'dead' }";
        assert_eq!(lamp(missing), [format!("{at}.numbers")]);
        let nowhere = "from_m = 12.0\nto_m = 13.0\nfault = { kind = 'dead' }";
        assert_eq!(lamp(nowhere), [format!("{at}.from_m")]);
        let backwards = "from_m = 40.0\nto_m = 30.0\nfault = { kind = 'dead' }";
        assert_eq!(lamp(backwards)[0], format!("{at}.to_m"));

        assert_eq!(keys("[air]\nvisibility_m = 60.0"), [""; 0]);
        let air = "[air]\nvisibility_m = 0.0\nscattered_share = 2.0";
        assert_eq!(keys(air), ["air.visibility_m", "air.scattered_share"]);

        let camera = |rest: &str| keys(&format!("[[faults.cameras]]\n{rest}\n"));
        for name in ["rig", "left", "right", "W1530"] {
            let freeze = format!("camera = '{name}'\nfault = {{ kind = 'freeze' }}");
            assert_eq!(camera(&freeze), [""; 0]);
        }
        let at = "faults.cameras[0]";
        let stranger = "camera = 'W1350'\nfault = { kind = 'freeze' }";
        assert_eq!(camera(stranger), [format!("{at}.camera")]);
        let share = "camera = 'rig'\nfault = { kind = 'drop', share = -0.1 }\nfrom_s = -1.0";
        let expected = ["fault.share", "from_s"].map(|key| format!("{at}.{key}"));
        assert_eq!(camera(share), expected);
        let late = "camera = 'rig'\nfault = { kind = 'late', by_ms = 1e9 }";
        assert_eq!(camera(late), [format!("{at}.fault.by_ms")]);
    }

    /// With more trains the same line would be lit by one renderer and not by another.
    #[test]
    fn all_headlights_light_a_picture() {
        let keys =
            |others: usize| keys(&format!("[train]\n{}", "[[other_trains]]\n".repeat(others)));
        assert_eq!(keys(7), [""; 0]);
        assert_eq!(keys(8), ["other_trains"]);
        assert_eq!(TrainId::MOST * 2, MAX_HEADLIGHTS);
    }

    /// Two trains in one place would burst apart.
    #[test]
    fn trains_stand_clear_of_each_other() {
        let text = include_str!("../../tunnels/chengdu_line1.toml");
        let tunnel = Tunnel::from_toml(text).unwrap();
        let keys = |other_m: f64| {
            let text = format!(
                "name = \"test\"\ntunnel = \"given\"\n[train]\nstart_chainage_m = 300.0\n\
                 stop_at_m = 2000.0\n[[other_trains]]\nstart_chainage_m = {other_m}\n\
                 stop_at_m = 2500.0\n"
            );
            let mut problems = Vec::new();
            let mut check = Checker::new("", &mut problems);
            in_tunnel(&read_toml(&text).unwrap(), &tunnel, &mut check);
            problems.into_iter().map(|p| p.key).collect::<Vec<_>>()
        };
        assert_eq!(keys(420.0), [""; 0]);
        assert_eq!(keys(417.0), ["other_trains[0].start_chainage_m"]);
    }

    /// Fails where a train that runs down stands, stops or ends as one that runs up.
    #[test]
    fn a_train_that_runs_down_stands_up_the_line_of_its_head() {
        let text = include_str!("../../tunnels/chengdu_line1.toml");
        let tunnel = Tunnel::from_toml(text).unwrap();
        let end_m = tunnel.alignment.length_m();
        let problems = |start_m: f64, rest: &str| {
            let text = format!(
                "name = \"test\"\ntunnel = \"given\"\n[[wayside]]\ndevice = \"W1530\"\n[train]\n\
                 start_chainage_m = 300.0\nstop_at_m = 600.0\n[[other_trains]]\n\
                 direction = \"down\"\nstart_chainage_m = {start_m}\n{rest}"
            );
            let (file, mut problems) = (read_toml::<ScenarioFile>(&text).unwrap(), Vec::new());
            file.check("", &mut problems);
            in_tunnel(&file, &tunnel, &mut Checker::new("", &mut problems));
            problems
        };
        let keys = |start_m: f64, rest: &str| -> Vec<String> {
            let problems = problems(start_m, rest).into_iter();
            problems.map(|p| p.key).collect()
        };
        let (start, stop) = (
            "other_trains[0].start_chainage_m",
            "other_trains[0].stop_at_m",
        );
        assert_eq!(keys(end_m - 120.0, "stop_at_m = 1000.0"), [""; 0]);
        assert_eq!(keys(end_m - 100.0, "stop_at_m = 1000.0"), [start]);
        assert_eq!(keys(1000.0, "stop_at_m = 1200.0"), [stop]);
        // Its tail would be in the first train's head, and its own head behind that one's tail.
        assert_eq!(keys(290.0, "stop_at_m = 0.0"), [start]);
        assert_eq!(keys(310.0, "stop_at_m = 0.0"), [""; 0]);
        let far = problems(800.0, "");
        assert_eq!(far[0].key, stop);
        assert!(far[0].remedy.contains("down to 0 m"), "{}", far[0].remedy);
    }

    /// Fails where trains are numbered without a first one, or their keys are those of others.
    #[test]
    fn other_trains_are_other_than_a_first_one() {
        let rest = "[[wayside]]\ndevice = \"W1530\"\n[[other_trains]]\n";
        assert_eq!(keys(rest), ["other_trains"]);
        let text = format!("name = \"test\"\ntunnel = \"given\"\n{rest}");
        let file: ScenarioFile = read_toml(&text).unwrap();
        assert_eq!(file.train_key(0), "other_trains[0]");
    }
}
