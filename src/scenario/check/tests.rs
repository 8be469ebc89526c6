#![allow(clippy::unwrap_used, reason = "a test may panic")]
use super::*;
use crate::settings::{Settings, read_toml};
use crate::track::Tunnel;
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
    assert_eq!(
        keys("[bench]\n[rig]\n[doppler]\n[radar]\n[gnss]\n"),
        ["doppler", "radar", "gnss"]
    );
    assert_eq!(keys("[train]\n[doppler]\n[odometer]\naxle = 24\n"), [""; 0]);
    let short = "[train]\ncars = 2\n[odometer]\naxle = 9\n[doppler]\nrate_hz = 0.0\n";
    assert_eq!(keys(short), ["doppler.rate_hz", "odometer.axle"]);
}

/// Satellites are over a place on the earth, which only a datum says.
#[test]
fn a_satellite_receiver_needs_a_datum() {
    let text = "name = \"test\"\ntunnel = \"given\"\n[train]\ncars = 1\nstart_chainage_m = 100.0\nstop_at_m = 150.0\n[gnss]\n\
                [[other_trains]]\ncars = 1\nstart_chainage_m = 200.0\nstop_at_m = 300.0\n[[onboard]]\ntrain = 1\n[onboard.gnss]\n";
    let file = read_toml::<ScenarioFile>(text).unwrap();
    let line = "name = 'line'\nplan = [{ kind = 'straight', length_m = 400.0 }]\n";
    let keys = |datum: &str| {
        let tunnel = Tunnel::from_toml(&format!("{datum}{line}")).unwrap();
        let mut problems = Vec::new();
        in_tunnel(&file, &tunnel, &mut Checker::new("", &mut problems));
        problems.into_iter().map(|p| p.key).collect::<Vec<_>>()
    };
    assert_eq!(keys(""), ["gnss", "onboard[0].gnss"]);
    assert_eq!(
        keys("datum = { latitude_deg = 1.0, longitude_deg = 2.0 }\n"),
        [""; 0]
    );
}

/// Without receiver and balises nothing would ever be said; what is not named is not asked for.
#[test]
fn track_occupancy_needs_a_receiver_or_balises() {
    let line = |balises: &str| {
        let line = format!(
            "name = 'line'\ndatum = {{ latitude_deg = 1.0, longitude_deg = 2.0 }}\n\
             plan = [{{ kind = 'straight', length_m = 400.0 }}]\n{balises}"
        );
        Tunnel::from_toml(&line).unwrap()
    };
    let keys = |more: &str, balises: &str| {
        let text = format!(
            "name = \"test\"\ntunnel = \"given\"\n{more}\
             [train]\ncars = 1\nstart_chainage_m = 100.0\nstop_at_m = 150.0\n\
             [[other_trains]]\ncars = 1\nstart_chainage_m = 200.0\nstop_at_m = 300.0\n"
        );
        let mut problems = Vec::new();
        let file = read_toml::<ScenarioFile>(&text).unwrap();
        in_tunnel(&file, &line(balises), &mut Checker::new("", &mut problems));
        problems.into_iter().map(|p| p.key).collect::<Vec<_>>()
    };
    let balises = "balises = [{ name = 'B1', chainage_m = 130.0 }]\n";
    let (first, other) = ("stack.onboard", "onboard[0].equipment");
    for (more, balises, expected) in [
        ("", "", vec![]),
        ("stack.onboard = ['occupancy']\n", "", vec![first]),
        ("stack.onboard = ['occupancy']\n", balises, vec![]),
        ("stack.onboard = ['occupancy']\ngnss = {}\n", "", vec![]),
        ("stack.onboard = ['protection']\n", "", vec![]),
        ("onboard = [{ train = 1 }]\n", "", vec![]),
        (
            "onboard = [{ train = 1, equipment = ['led', 'occupancy', 'protection'] }]\n",
            "",
            vec![other],
        ),
        (
            "onboard = [{ train = 1, equipment = ['occupancy'] }]\n",
            balises,
            vec![],
        ),
        (
            "onboard = [{ train = 1, equipment = ['occupancy'], gnss = {} }]\n",
            "",
            vec![],
        ),
    ] {
        assert_eq!(keys(more, balises), expected, "{more}{balises}");
    }
}

/// Every fault that could not act as written is refused, with its key.
#[test]
fn faults_must_be_able_to_strike() {
    let text = include_str!("../../../tunnels/chengdu_line1.toml");
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
    let keys = |others: usize| keys(&format!("[train]\n{}", "[[other_trains]]\n".repeat(others)));
    assert_eq!(keys(7), [""; 0]);
    assert_eq!(keys(8), ["other_trains"]);
    assert_eq!(TrainId::MOST * 2, MAX_HEADLIGHTS);
}

/// Two trains in one place would burst apart.
#[test]
fn trains_stand_clear_of_each_other() {
    let text = include_str!("../../../tunnels/chengdu_line1.toml");
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
    let text = include_str!("../../../tunnels/chengdu_line1.toml");
    let tunnel = Tunnel::from_toml(text).unwrap();
    let end_m = tunnel.first_track().alignment.length_m();
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

/// Fails where equipment takes its train for much longer or shorter than it is (at the rear end, from
/// which the head is reckoned, at all), a rig on a bench has a rear end, or a silent device is missed
/// over less than it watches.
#[test]
fn equipment_knows_its_train_and_its_devices() {
    let rear = "[rig]\nend = 'rear'\nside = 'right'\nyaw_deg = 141.0\n";
    assert_eq!(keys(&format!("[bench]\n{rear}")), ["rig.end"]);
    let short =
        "[train]\n[[wayside]]\ndevice = 'W1530'\n[stack.protection]\ndevice_reach_m = 79.0\n";
    assert_eq!(keys(short), ["stack.protection.device_reach_m"]);

    let text = include_str!("../../../tunnels/chengdu_line1.toml");
    let tunnel = Tunnel::from_toml(text).unwrap();
    let keys = |train: &str, more: &str| -> Vec<String> {
        let text = format!(
            "name = 'test'\ntunnel = 'given'\n[train]\n{train}start_chainage_m = 300.0\n{more}"
        );
        let (file, mut problems) = (read_toml::<ScenarioFile>(&text).unwrap(), Vec::new());
        in_tunnel(&file, &tunnel, &mut Checker::new("", &mut problems));
        problems.into_iter().map(|p| p.key).collect()
    };
    let length = |length_m: f64| format!("[stack.protection]\ntrain_length_m = {length_m}\n");
    let given =
        |cars: &str, rig: &str, length_m: f64| keys(cars, &format!("{rig}{}", length(length_m)));
    let wrong = ["stack.protection.train_length_m"];
    // Not given it is the train's, of however many cars.
    assert_eq!(keys("cars = 3\n", rear), [""; 0]);
    assert_eq!(given("", rear, 118.1), [""; 0]);
    assert_eq!(given("", rear, 118.2), wrong);
    assert_eq!(given("", "", 118.2), [""; 0]);
    assert_eq!(given("", "", 98.35), wrong);
}

/// Fails where two things may have the same name, which scores and pictures tell them apart by.
#[test]
fn each_thing_has_a_name_of_its_own() {
    let boxes = "[train]\n[[obstacles]]\n[[obstacles]]\nname = 'bag'\n[[obstacles]]\n";
    assert_eq!(keys(boxes), ["obstacles[2].name"]);
    let worker = "[train]\n[[obstacles]]\nname = 'worker'\n[[workers]]\n";
    assert!(keys(worker).contains(&"workers[0].name".to_owned()));
}
