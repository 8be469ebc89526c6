//! The stack on hostile input: every number of every message, images of any size and content, clocks that
//! jump, names that nobody knows, replays, calibrations of impossible cameras. Nothing panics, every answer
//! comes soon, and what is wrong never makes a train faster.

use crate::common::small_scenario;
use crate::fuzz::{Draw, cases, check_memory, execute, mutate};
use image::{GrayImage, Luma};
use metrotwin::bus::{
    Content, DangerLevel, Frame, Identity, Intrinsics, LedReport, Message, Method, Node,
    ObstacleWarning, OdometerSample, PositionFix, ProtectionReport, Receiver, SimTime, TrainId,
    TrainReport, Via,
};
use metrotwin::scenario::Scenario;
use metrotwin::session::{Event, Observer, ObserverError, RendererChoice, RunOptions, run};
use metrotwin::stack::Equipment;
use metrotwin::stack::positioning::{CabMount, LampPositioning};
use metrotwin::stack::protection::TrainProtection;
use metrotwin::stack::wayside::WaysideDetection;
use metrotwin::track::uid::Uid;
use metrotwin::track::{Stretch, TrackId};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Executions without a word from the environment.
const FEW: u64 = 3000;
/// Executions with one set of equipment.
const LIFE: u64 = 250;
/// Most pixels of a calibrated camera: what a memory must hold is not at stake here.
const MOST_PX: u32 = 40_000;

const TRAIN: Node = Node::Train(TrainId(0));
const DEVICE: &str = "W1530";

fn scenario() -> Scenario {
    small_scenario("[wayside.lidar]\nstep_deg = 5.0\n[doppler]\n")
}

/// Messages of a real run, by kind: no more of a kind than serve.
#[derive(Default)]
struct Corpus {
    by_kind: BTreeMap<String, Vec<Message>>,
}

impl Corpus {
    /// Kinds with more messages keep the first and every so many later ones.
    const MOST: usize = 24;

    fn add(&mut self, message: &Message) {
        let kind = format!("{:?}", message.content);
        let end = kind
            .find(|c: char| !c.is_alphanumeric())
            .unwrap_or(kind.len());
        let of_kind = self.by_kind.entry(kind[..end].to_owned()).or_default();
        if of_kind.len() < Self::MOST {
            of_kind.push(message.clone());
        }
    }

    fn of_run(scenario: &Scenario) -> Self {
        let options = RunOptions {
            renderer: RendererChoice::Cpu,
            ..RunOptions::default()
        };
        let mut corpus = Self::default();
        for danger in [DangerLevel::None, DangerLevel::Low, DangerLevel::High] {
            let warning = warning(danger, 1600.0, 3.0);
            corpus.add(&by_radio(
                Node::Post(DEVICE.into()),
                3.0,
                Content::Warning(warning),
            ));
        }
        corpus.add(&Message::own(
            TRAIN,
            SimTime::from_secs(1.0),
            Content::Led(led_report()),
        ));
        for name in ["B1110", "B0000"] {
            let time = SimTime::from_secs(1.0);
            corpus.add(&Message::own(
                TRAIN,
                time,
                Content::BalisePassed(name.into()),
            ));
        }
        let report = TrainReport {
            chainage_m: 1500.0,
            length_m: 118.0,
            occupied: vec![Stretch {
                track: TrackId::default(),
                from_m: 1382.0,
                to_m: 1500.0,
            }],
            ..TrainReport::default()
        };
        corpus.add(&by_radio(
            Node::Train(TrainId(1)),
            2.0,
            Content::Train(report),
        ));
        run(scenario, &options, &mut [&mut corpus]).unwrap();
        assert!(corpus.by_kind.len() >= 12, "{:?}", corpus.by_kind.keys());
        corpus
    }

    fn draw<'a>(&'a self, draw: &mut Draw) -> &'a Message {
        let kinds: Vec<_> = self.by_kind.values().collect();
        let kind = *draw.pick(&kinds);
        draw.pick(kind)
    }
}

impl Observer for Corpus {
    fn observe(&mut self, event: &Event<'_>) -> Result<(), ObserverError> {
        match event {
            Event::Message { message, .. } => self.add(message),
            Event::Pair { pair, report, .. } => {
                self.add(&Message::own(
                    TRAIN,
                    report.time,
                    Content::Pair((*pair).clone()),
                ));
                self.add(&Message::own(
                    TRAIN,
                    report.time,
                    Content::Led((*report).clone()),
                ));
            }
            Event::Wayside { frame, report, .. } => {
                let node = Node::Post(DEVICE.into());
                self.add(&Message::own(
                    node,
                    report.time,
                    Content::Frame((*frame).clone()),
                ));
            }
            _ => {}
        }
        Ok(())
    }
}

/// A report with a fix: the small pictures of the run show no lamp well enough.
fn led_report() -> LedReport {
    let time = SimTime::from_secs(1.0);
    let fix = PositionFix {
        track: TrackId::default(),
        time,
        method: Method::Stereo,
        chainage_m: 1308.0,
        sigma_m: 0.1,
        position: Default::default(),
        uid: Uid { line: 1, lamp: 131 },
        identity: Identity::Decoded,
        lamp_in_camera: Default::default(),
    };
    LedReport {
        time,
        number: 10,
        eyes: Default::default(),
        best: Method::Stereo,
        left: Vec::new(),
        right: Vec::new(),
        dark: Vec::new(),
        fixes: vec![fix],
    }
}

fn warning(danger: DangerLevel, from_chainage_m: f64, issued_s: f64) -> ObstacleWarning {
    ObstacleWarning {
        device: DEVICE.into(),
        number: 1,
        issued: SimTime::from_secs(issued_s),
        danger,
        track: TrackId::default(),
        from_chainage_m,
        to_chainage_m: from_chainage_m + 1.0,
        blind: false,
    }
}

fn by_radio(sender: Node, time_s: f64, content: Content) -> Message {
    let time = SimTime::from_secs(time_s);
    Message::to(Receiver::Trains, sender, time, content).arrived(time, Via::Radio)
}

/// The same thing with some of its values changed, where it can still be read at all.
fn mutated<T: Serialize + for<'de> Deserialize<'de>>(draw: &mut Draw, thing: &T) -> Option<T> {
    let mut value = toml::Value::try_from(thing).ok()?;
    for _ in 0..=draw.below(3) {
        mutate(draw, &mut value);
    }
    T::deserialize(value).ok()
}

/// An image that no camera should deliver.
fn hostile_image(draw: &mut Draw, (width, height): (u32, u32)) -> GrayImage {
    let seed = draw.word() as u32;
    match draw.below(9) {
        0 => GrayImage::new(0, 0),
        1 => GrayImage::new(1, 1),
        2 => GrayImage::new(3000, 2),
        3 => GrayImage::new(1500, 1500),
        4 => GrayImage::from_pixel(width, height, Luma([255])),
        5 => GrayImage::new(width, height),
        6 => GrayImage::from_fn(width, height, |u, v| Luma([(u * 7 + v * 31 + seed) as u8])),
        7 => GrayImage::from_fn(width, height, |_, v| {
            Luma([if v / 3 % 2 == 0 { 255 } else { 0 }])
        }),
        _ => {
            let mut noise = Draw::of(u64::from(seed));
            GrayImage::from_fn(width, height, |_, _| Luma([noise.word() as u8]))
        }
    }
}

fn spoil(draw: &mut Draw, frame: &mut Frame) {
    if draw.one_in(2) {
        frame.image = hostile_image(draw, frame.image.dimensions());
    }
}

/// A message as it may come: whole, with values changed, with images that are none.
fn hostile(draw: &mut Draw, message: &Message) -> Option<Message> {
    let mut message = message.clone();
    match &mut message.content {
        Content::Frame(frame) => spoil(draw, frame),
        Content::Pair(pair) => {
            spoil(draw, &mut pair.left);
            spoil(draw, &mut pair.right);
        }
        _ => {}
    }
    if draw.one_in(4) {
        return Some(message);
    }
    mutated(draw, &message)
}

/// All equipment there is, as calibrated or as impossibly calibrated.
struct Stack {
    equipment: [Box<dyn Equipment>; 3],
}

impl Stack {
    fn new(scenario: &Scenario, draw: &mut Draw) -> Self {
        let map = scenario.map();
        let onboard = &scenario.onboard[0];
        let (network, route) = (&map.network, scenario.itineraries[0].route.clone());
        let rig = onboard.rig.as_ref().unwrap();
        let mut sheet = rig.calibration();
        let mut calibration = scenario.wayside[0].calibration.clone();
        if draw.one_in(2) {
            let small = |lens: &Intrinsics| lens.width_px.saturating_mul(lens.height_px) <= MOST_PX;
            sheet = mutated(draw, &sheet)
                .filter(|s| small(&s.left.intrinsics) && small(&s.right.intrinsics))
                .unwrap_or(sheet);
            calibration = mutated(draw, &calibration)
                .filter(|c| small(&c.camera.intrinsics))
                .unwrap_or(calibration);
        }
        let mount = CabMount::new(rig.end, route.clone(), onboard.protection.length_m());
        let positioning = LampPositioning::new(TRAIN, mount, &onboard.led, sheet, network);
        let detection = WaysideDetection::new(
            &scenario.file.stack.wayside,
            calibration,
            map.first_track().clone(),
        );
        let protection = TrainProtection::new(TRAIN, network, route, &onboard.protection);
        Self {
            equipment: [
                Box::new(positioning),
                Box::new(detection),
                Box::new(protection),
            ],
        }
    }

    /// Hands a message to all of it; what each says goes to the others.
    fn take(&mut self, message: &Message, now: SimTime) -> Vec<Message> {
        let mut said = Vec::new();
        for k in 0..self.equipment.len() {
            self.equipment[k].on(message);
            for message in self.equipment[k].cycle(now) {
                let others = (0..self.equipment.len()).filter(|other| *other != k);
                others.for_each(|other| self.equipment[other].on(&message));
                said.push(message);
            }
        }
        said
    }
}

/// Whatever was heard, these are numbers, and no speed is over the line's.
fn check_report(case: u64, report: &ProtectionReport, most_mps: f64) {
    let speeds = [report.permitted_mps, report.command.permitted_speed_mps];
    assert!(
        speeds.iter().all(|v| (0.0..=most_mps).contains(v)) && report.speed_mps >= 0.0,
        "case {case}: {report:?}"
    );
}

/// A panic, an endless loop or search, memory by a number in a message, a speed that is no number.
#[test]
fn no_message_breaks_the_stack() {
    let scenario = scenario();
    let corpus = Corpus::of_run(&scenario);
    let most_mps = scenario.onboard[0].protection.line_speed_kmh / 3.6 + 1e-9;
    let cases = cases(FEW);
    let (mut stack, mut refused) = (None, 0);
    for case in cases.clone() {
        // A case is what its life has come to: to see one again, its life is lived again from its start.
        let from = case - case % LIFE;
        let again = if stack.is_none() {
            from..case
        } else {
            case..case
        };
        for k in again.chain([case]) {
            let draw = &mut Draw::of(k);
            if stack.is_none() || k % LIFE == 0 {
                stack = Some(execute(k, "calibration", || Stack::new(&scenario, draw)));
            }
            let drawn = corpus.draw(draw);
            let Some(message) = hostile(draw, drawn) else {
                refused += 1;
                continue;
            };
            let now = match draw.below(20) {
                0 => SimTime::from_nanos(draw.word() as i64),
                1 => message.received_at,
                _ => SimTime::from_secs(0.1 * (k % LIFE) as f64),
            };
            let kind = format!("{:.40?}", message.content);
            let stack = stack.as_mut().unwrap();
            for said in execute(k, &kind, || stack.take(&message, now)) {
                if let Content::Protection(report) = said.content {
                    check_report(k, &report, most_mps);
                }
            }
        }
        if case % 100 == 0 {
            check_memory();
        }
    }
    check_memory();
    eprintln!(
        "{} executions, {refused} could not be read",
        cases.end - cases.start
    );
}

/// A train that stands, has been heard by its device, and hears a warning of an obstacle 300 m ahead.
struct Ride {
    protection: TrainProtection,
    permitted_mps: f64,
}

impl Ride {
    fn new(scenario: &Scenario, has_position: bool) -> Self {
        let map = scenario.map();
        let mut settings = scenario.onboard[0].protection.clone();
        settings.initial_chainage_m = has_position.then_some(1300.0);
        settings.starts_under_way = Some(true);
        let route = scenario.itineraries[0].route.clone();
        Self {
            protection: TrainProtection::new(TRAIN, &map.network, route, &settings),
            permitted_mps: f64::NAN,
        }
    }

    /// A tenth of a second: the odometer, what the device says, and what else is heard.
    fn step(&mut self, now_s: f64, heard: &[Message]) {
        let time = SimTime::from_secs(now_s);
        let odometer = OdometerSample {
            time,
            distance_m: 8.0 * now_s,
            speed_mps: 8.0,
            slides: false,
        };
        self.protection
            .on(&Message::own(TRAIN, time, Content::Odometer(odometer)));
        heard.iter().for_each(|message| self.protection.on(message));
        for message in self.protection.cycle(time) {
            if let Content::Protection(report) = message.content {
                self.permitted_mps = report.permitted_mps;
            }
        }
    }
}

/// A message with something wrong that can be told: of nobody known, of nowhere, of no number, of old.
fn wrong(draw: &mut Draw, corpus: &Corpus, now_s: f64) -> Option<Message> {
    let mut message = corpus.draw(draw).clone();
    message.via = Via::Radio;
    let time = SimTime::from_secs(now_s);
    (message.received_at, message.sent_at) = (time, time);
    match &mut message.content {
        Content::Warning(warning) | Content::Heartbeat(warning) => {
            let was = warning.clone();
            *warning = mutated(draw, warning)?;
            if draw.one_in(2) {
                // Nobody's device.
                warning.device = "W9999".into();
            } else {
                // An old message once more.
                (warning.device, warning.issued) = (was.device, SimTime::from_secs(-1.0));
                message.sent_at = SimTime::from_secs(-1.0);
            }
        }
        Content::Train(report) => {
            *report = mutated(draw, report)?;
            message.sender = Node::Train(TrainId(1));
        }
        Content::BalisePassed(name) => *name = "B9999".into(),
        Content::Odometer(sample) => {
            sample.distance_m = f64::NAN;
            sample.speed_mps = *draw.pick(&[0.0, f64::INFINITY]);
        }
        Content::Led(report) => {
            for fix in &mut report.fixes {
                match draw.below(4) {
                    0 => fix.chainage_m = *draw.pick(&[f64::NAN, f64::INFINITY, -1e9, 1e5, 1e300]),
                    1 => fix.sigma_m = *draw.pick(&[f64::NAN, f64::INFINITY, -1.0]),
                    _ => fix.sigma_m = *draw.pick(&[1e5, 1e19, 1e160, 1e308]),
                }
            }
        }
        _ => return None,
    }
    Some(message)
}

/// A warning that a stranger takes back, a place that is nowhere and lies behind every obstacle, a fix
/// without worth that makes the position sure: with wrong messages a train is nowhere permitted more than
/// without them.
#[test]
fn what_is_wrong_makes_no_train_faster() {
    let scenario = scenario();
    let corpus = Corpus::of_run(&scenario);
    for life in 0..(cases(FEW).end / 50).max(1) {
        let draw = &mut Draw::of(life);
        let has_position = !draw.one_in(3);
        let mut rides = [(); 2].map(|()| Ride::new(&scenario, has_position));
        let obstacle_m = 1500.0 + draw.below(200) as f64;
        for k in 0..50 {
            let now_s = 0.1 * f64::from(k);
            let danger = if k == 10 {
                DangerLevel::High
            } else {
                DangerLevel::None
            };
            let says = by_radio(
                Node::Post(DEVICE.into()),
                now_s,
                Content::Heartbeat(warning(danger, obstacle_m, now_s)),
            );
            // Heard each second until the obstacle falls.
            let mut heard = Vec::from_iter((k == 0 || k == 10).then_some(says));
            rides[0].step(now_s, &heard);
            let wrong = (0..6).filter_map(|_| wrong(draw, &corpus, now_s));
            let wrong: Vec<Message> = wrong.collect();
            heard.splice(0..0, wrong.iter().cloned());
            rides[1].step(now_s, &heard);
            let [without, with] = rides.each_ref().map(|ride| ride.permitted_mps);
            assert!(
                with <= without + 1e-6,
                "life {life}, step {k}: {with} and {without} m/s by {wrong:?}"
            );
        }
    }
}

/// A device or an odometer whose clock is far ahead: what it says next counts all the same, its silence
/// is heard, and an odometer that is only ahead is none.
#[test]
fn messages_from_the_future_set_no_train_free() {
    let scenario = scenario();
    let far = SimTime::from_nanos(i64::MAX - 1);
    let clear = |now_s: f64| {
        let mut warning = warning(DangerLevel::None, 1600.0, now_s);
        warning.issued = far;
        let mut message = by_radio(
            Node::Post(DEVICE.into()),
            now_s,
            Content::Heartbeat(warning),
        );
        message.sent_at = far;
        message
    };
    let high = |now_s: f64| {
        let warning = warning(DangerLevel::High, 1600.0, now_s);
        by_radio(Node::Post(DEVICE.into()), now_s, Content::Warning(warning))
    };
    let mut ride = Ride::new(&scenario, true);
    ride.step(0.0, &[clear(0.0)]);
    let free_mps = ride.permitted_mps;
    ride.step(1.0, &[high(1.0)]);
    let warned_mps = ride.permitted_mps;
    assert!(
        warned_mps < free_mps - 1.0,
        "{warned_mps} of {free_mps} m/s with a warning"
    );

    let mut ride = Ride::new(&scenario, true);
    ride.step(0.0, &[clear(0.0)]);
    (1..200).for_each(|k| ride.step(0.1 * f64::from(k), &[]));
    assert!(
        ride.permitted_mps < free_mps - 1.0,
        "{} m/s after 20 s of silence",
        ride.permitted_mps
    );

    let mut protection = Ride::new(&scenario, true).protection;
    let sample = |time, distance_m| {
        let sample = OdometerSample {
            time,
            distance_m,
            speed_mps: 0.0,
            slides: false,
        };
        Message::own(TRAIN, time, Content::Odometer(sample))
    };
    protection.on(&sample(far, 0.0));
    let said = (0..50).flat_map(|k| {
        let now = SimTime::from_secs(0.1 * f64::from(k));
        protection.on(&sample(now, 0.8 * f64::from(k)));
        protection.cycle(now)
    });
    let reports: Vec<ProtectionReport> = said
        .filter_map(|message| match message.content {
            Content::Protection(report) => Some(report),
            _ => None,
        })
        .collect();
    assert_ne!(
        reports.last().unwrap().supervision,
        metrotwin::bus::Supervision::Permitted
    );
}
