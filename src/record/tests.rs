//! A made-up session recorded and read back.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "tests stop at the first thing that is not as expected"
)]

pub(super) mod session;

use super::{FixTable, Recording};
use crate::bus::{
    Content, DangerLevel, DopplerSample, Message, Node, ObstacleWarning, OdometerSample, SimTime,
    TrainId,
};
use crate::files::part_name;
use crate::scenario::RecordSettings;
use crate::session::{Event, Observer, Opening, TrainOpening};
use crate::track::{TrackId, Tunnel};
use re_sdk_types::archetypes::TextLog;
use re_sdk_types::blueprint::archetypes::ViewBlueprint;
use re_sdk_types::components::Name;
use rerun::StoreKind;
use rerun::external::re_log_encoding::DecoderApp;
use rerun::log::{Chunk, LogMsg};
use session::{Extent, play};
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::io::BufReader;
use std::path::{Path, PathBuf};

const SMALL: Extent = Extent {
    duration_s: 3.0,
    wayside: true,
    cars: 2,
};

/// A folder of its own for each test, gone afterwards.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let name = format!("metrotwin-record-{}-{name}", std::process::id());
        Self(std::env::temp_dir().join(name))
    }

    fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn record(path: &Path, extent: Extent) {
    play(
        &mut Recording::to_file(path, &RecordSettings::default()),
        extent,
    );
}

/// Rows of one kind of store, in the order of the file.
fn chunks(path: &Path, kind: StoreKind) -> Vec<Chunk> {
    let file = BufReader::new(File::open(path).unwrap());
    DecoderApp::decode_lazy(file)
        .filter_map(|message| match message.unwrap() {
            LogMsg::ArrowMsg(store, rows) if store.kind() == kind => {
                Some(Chunk::from_arrow_msg(&rows).unwrap())
            }
            _ => None,
        })
        .collect()
}

fn entities(chunks: &[Chunk]) -> BTreeSet<String> {
    let path = |chunk: &Chunk| chunk.entity_path().to_string();
    chunks.iter().map(path).collect()
}

/// Fails when a kind of data is forgotten, when the file is not finished, or when rows carry the
/// wall clock.
#[test]
fn a_session_is_recorded_whole() {
    let folder = Folder::new("whole");
    let path = folder.file("deep/run.rrd");
    record(&path, SMALL);
    assert!(!part_name(&path).exists());
    let rows = chunks(&path, StoreKind::Recording);
    let entities = entities(&rows);
    for expected in [
        "/world/tunnel",
        "/world/lamps",
        "/world/train/head",
        "/world/train/car_2",
        "/world/rig/right/image",
        "/world/rig/left/lamps",
        "/world/estimate/paper",
        "/world/estimate/sight",
        "/world/estimate/obstacles/W_205",
        "/world/bodies/boxes",
        "/world/blades",
        "/map/tracks",
        "/map/train_0",
        "/world/wayside/W_205/camera/image",
        "/wayside/W_205/binary",
        "/plots/speed/permitted",
        "/plots/position_error/mono/upper",
        "/plots/distance/W_205/line",
        "/plots/exposure/W_205",
        "/plots/gain/rig",
        "/events",
        "/display",
    ] {
        assert!(
            entities.contains(expected),
            "no {expected} in {entities:#?}"
        );
    }
    for chunk in &rows {
        for timeline in chunk.timelines().keys() {
            assert!(
                ["sim_time", "frame"].contains(&timeline.as_str()),
                "{timeline}"
            );
        }
    }
    // Truth 50 times a second over 3 s, both ends included.
    let speeds = rows
        .iter()
        .filter(|chunk| chunk.entity_path().to_string() == "/plots/speed/true");
    let speeds = speeds.filter(|chunk| !chunk.is_static());
    assert_eq!(speeds.map(Chunk::num_rows).sum::<usize>(), 151);
    // Images 5 times a second.
    let images = rows
        .iter()
        .filter(|chunk| chunk.entity_path().to_string() == "/world/rig/left/image");
    assert_eq!(images.map(Chunk::num_rows).sum::<usize>(), 16);
}

/// Fails when an id is random, a batch is cut by the wall clock, or an order depends on threads:
/// what `rerun rrd compare` holds against two runs with one seed. Rows that say the same in the
/// same order are equal; the sdk's ids of rows and chunks are times and never are.
#[test]
fn two_recordings_of_one_session_are_equal() {
    let folder = Folder::new("equal");
    let paths = ["a.rrd", "b.rrd"].map(|name| folder.file(name));
    for path in &paths {
        record(path, SMALL);
    }
    for kind in [StoreKind::Recording, StoreKind::Blueprint] {
        let [a, b] = paths.each_ref().map(|path| chunks(path, kind));
        assert_eq!(a.len(), b.len());
        for (a, b) in a.iter().zip(&b) {
            Chunk::ensure_similar(a, b).unwrap();
        }
    }
}

/// The sdk parts the rows of an entity by the components that they hold, in an order that differs
/// between processes, which the test above cannot see. So no entity may give it a choice.
#[test]
fn all_rows_of_an_entity_hold_the_same_components() {
    let folder = Folder::new("components");
    let path = folder.file("run.rrd");
    record(&path, SMALL);
    let mut seen = BTreeMap::new();
    for chunk in chunks(&path, StoreKind::Recording) {
        let entity = (chunk.entity_path().to_string(), chunk.is_static());
        let components: BTreeSet<_> = chunk.components_identifiers().collect();
        let first = seen.entry(entity.clone()).or_insert(components.clone());
        assert_eq!(*first, components, "{entity:?}");
    }
}

/// Fails when panes stay empty: what a scenario has not is not in its layout.
#[test]
fn the_layout_leaves_out_what_is_missing() {
    let folder = Folder::new("layout");
    let bench = Extent {
        wayside: false,
        cars: 0,
        ..SMALL
    };
    let names = |extent: Extent, name: &str| {
        let path = folder.file(name);
        record(&path, extent);
        let rows = chunks(&path, StoreKind::Blueprint);
        let views = rows.iter().filter(|chunk| {
            let path = chunk.entity_path().to_string();
            path.starts_with("/view/") && path.matches('/').count() == 2
        });
        let component = ViewBlueprint::descriptor_display_name().component;
        let name = |chunk: &Chunk| chunk.component_mono::<Name>(component, 0).unwrap().unwrap();
        views
            .map(|chunk| name(chunk).to_string())
            .collect::<Vec<_>>()
    };
    let (full, bench) = (names(SMALL, "full.rrd"), names(bench, "bench.rrd"));
    let has = |panes: &[String], name: &str| panes.iter().any(|pane| pane.contains(name));
    for pane in [
        "Left camera",
        "Position error",
        "Exposure",
        "Gain",
        "Events",
    ] {
        assert!(has(&full, pane) && has(&bench, pane), "{pane}");
    }
    for pane in ["Difference", "Binary", "Speed", "display", "obstacle"] {
        assert!(has(&full, pane) && !has(&bench, pane), "{pane}");
    }
}

/// What a run without rig, train and devices opens with.
fn bare<'a>(scenario: &'a str, tunnel: &'a Tunnel) -> Opening<'a> {
    Opening {
        scenario,
        seed: 0,
        tunnel,
        trains: &[],
        wayside: &[],
    }
}

/// Hands a message of the first train to an observer.
fn message(observer: &mut dyn Observer, time: SimTime, content: Content) {
    let node = Node::Train(TrainId(0));
    let message = Message::own(node.clone(), time, content);
    observer
        .observe(&Event::Message {
            node: &node,
            message: &message,
        })
        .unwrap();
}

/// A warning that comes at once.
fn warning(device: &str, t_s: f64, danger: DangerLevel) -> Content {
    Content::Warning(ObstacleWarning {
        track: TrackId::default(),
        device: device.into(),
        number: 1,
        issued: SimTime::from_secs(t_s),
        danger,
        from_chainage_m: 100.0,
        to_chainage_m: 101.0,
        blind: false,
    })
}

/// A device repeats its warning every second; the log filled up with it.
#[test]
fn regress_the_log_has_a_repeated_warning_once() {
    let folder = Folder::new("repeated");
    let path = folder.file("run.rrd");
    let mut recording = Recording::to_file(&path, &RecordSettings::default());
    let tunnel = session::tunnel();
    recording.open(&bare("repeated", &tunnel)).unwrap();
    for number in 0..6 {
        let cleared = number == 5;
        let danger = match cleared {
            true => DangerLevel::None,
            false => DangerLevel::High,
        };
        let time = SimTime::from_secs(number.into());
        message(&mut recording, time, warning("W1", number.into(), danger));
    }
    recording.close().unwrap();
    let rows = chunks(&path, StoreKind::Recording);
    let events = rows
        .iter()
        .filter(|c| c.entity_path().to_string() == "/events");
    // What is run, the warning, the all clear.
    assert_eq!(events.map(Chunk::num_rows).sum::<usize>(), 3);
}

/// Fails where the log tells chainages that no plan of the line has.
#[test]
fn the_log_tells_chainages_as_the_line_states_them() {
    let folder = Folder::new("stated");
    let path = folder.file("run.rrd");
    let mut recording = Recording::to_file(&path, &RecordSettings::default());
    let text = include_str!("../../tunnels/terminus.toml");
    let tunnel = Tunnel::from_toml(text).unwrap();
    recording.open(&bare("stated", &tunnel)).unwrap();
    let high = warning("V-hall", 1.0, DangerLevel::High);
    message(&mut recording, SimTime::from_secs(1.0), high);
    recording.close().unwrap();
    let rows = chunks(&path, StoreKind::Recording);
    let events = rows
        .iter()
        .filter(|c| c.entity_path().to_string() == "/events");
    let text = TextLog::descriptor_text().component;
    let lines: Vec<String> = events
        .flat_map(|c| c.iter_slices::<String>(text))
        .flatten()
        .map(|line| line.to_string())
        .collect();
    let line = "V-hall #1 by wire (0.00 s): danger high, YDK12+100.0 to YDK12+101.0";
    assert!(lines.iter().any(|l| l == line), "{lines:#?}");
}

/// Speeds of odometer and radar become series; where the radar says nothing the line breaks, and
/// a train without one has no entry in the legend.
#[test]
fn sensors_of_motion_become_series() {
    let folder = Folder::new("motion");
    let tunnel = session::tunnel();
    for radar in [true, false] {
        let path = folder.file(if radar { "with.rrd" } else { "without.rrd" });
        let mut recording = Recording::to_file(&path, &RecordSettings::default());
        let train = TrainOpening {
            id: TrainId(0),
            rig: None,
            car_half_extents_m: nalgebra::Vector3::zeros(),
            cars: 1,
            radar,
            occupancy: false,
            protection: false,
        };
        let opening = Opening {
            trains: &[train],
            ..bare("motion", &tunnel)
        };
        recording.open(&opening).unwrap();
        for k in 0..10 {
            let time = SimTime::from_secs(0.1 * f64::from(k));
            let odometer = OdometerSample {
                time,
                distance_m: f64::from(k),
                speed_mps: 10.0,
                slides: false,
            };
            message(&mut recording, time, Content::Odometer(odometer));
            let doppler = DopplerSample {
                time,
                speed_mps: (k < 5).then_some(10.0),
            };
            if radar {
                message(&mut recording, time, Content::Doppler(doppler));
            }
        }
        recording.close().unwrap();
        let all = chunks(&path, StoreKind::Recording);
        let rows = |name: &str, still: bool| {
            let of = all.iter().filter(|c| c.entity_path().to_string() == name);
            let of = of.filter(|c| c.is_static() == still);
            of.map(Chunk::num_rows).sum::<usize>()
        };
        assert_eq!(rows("/plots/speed/odometer", false), 10);
        // Five values and one gap.
        assert_eq!(rows("/plots/speed/radar", false), if radar { 6 } else { 0 });
        assert_eq!(rows("/plots/speed/radar", true), usize::from(radar));
    }
}

/// A folder that cannot be made is an error at once, not a silent loss.
#[test]
fn an_impossible_file_is_an_error() {
    let folder = Folder::new("impossible");
    fs::create_dir_all(&folder.0).unwrap();
    let blocked = folder.file("file");
    fs::write(&blocked, "not a folder").unwrap();
    let mut recording = Recording::to_file(&blocked.join("run.rrd"), &RecordSettings::default());
    let tunnel = session::tunnel();
    let error = recording.open(&bare("impossible", &tunnel)).unwrap_err();
    assert!(error.to_string().contains("folder"), "{error}");
    // Closing what never opened is nothing to fail at.
    recording.close().unwrap();
}

/// Fails when rows are lost between the last flush and the end, or columns change places.
#[test]
fn fixes_become_rows() {
    let folder = Folder::new("fixes");
    let path = folder.file("fixes.csv");
    play(
        &mut FixTable::to_folder(path.parent().unwrap(), TrainId(0)),
        SMALL,
    );
    assert!(!part_name(&path).exists());
    let text = fs::read_to_string(&path).unwrap();
    let mut lines = text.lines();
    let columns = lines.next().unwrap().split(',').count();
    let rows: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    assert!(rows.len() > 100, "{} rows", rows.len());
    for row in rows {
        assert_eq!(row.len(), columns);
        let number = |k: usize| row[k].parse::<f64>().unwrap();
        assert!(["paper", "mono"].contains(&row[1]) && row[2].starts_with("1-"));
        assert!((number(4) - number(5) - number(6)).abs() < 2e-6);
        assert!(number(10) > 0.0, "the lamp is in front of the camera");
    }
}

/// Watches a session with a recording, and reads from time to time what a kill would leave of it.
struct Killed<'a> {
    recording: Recording,
    path: &'a Path,
    looks: usize,
}

/// The last time of any row of an entity, s; of a file whose end is missing.
fn last_time_s(path: &Path, entity: &str) -> f64 {
    let file = BufReader::new(File::open(path).unwrap());
    let whole = DecoderApp::decode_lazy(file).map_while(Result::ok);
    let rows = whole.filter_map(|message| match message {
        LogMsg::ArrowMsg(_, rows) => Some(Chunk::from_arrow_msg(&rows).unwrap()),
        _ => None,
    });
    let rows = rows.filter(|chunk| chunk.entity_path().to_string() == entity);
    let times = rows.filter_map(|chunk| {
        let times = chunk.timelines().get(&"sim_time".into())?;
        Some(1e-9 * times.time_range().max().as_i64() as f64)
    });
    times.fold(0.0, f64::max)
}

impl Observer for Killed<'_> {
    fn open(&mut self, opening: &Opening<'_>) -> super::Result {
        self.recording.open(opening)
    }

    fn observe(&mut self, event: &Event<'_>) -> super::Result {
        if let Event::Train { truth, .. } = event {
            let now_s = truth.time.secs();
            if (10.0 * now_s).round() as usize > self.looks {
                self.looks += 1;
                let last_s = last_time_s(&part_name(self.path), "/plots/speed/true");
                assert!(
                    now_s - last_s < 1.0,
                    "{last_s} s of {now_s} s are in the file"
                );
            }
        }
        self.recording.observe(event)
    }
}

/// Fails where rows wait in memory for longer than a second, or in a buffer of the file.
#[test]
fn a_kill_loses_less_than_a_second() {
    let folder = Folder::new("killed");
    let path = folder.file("run.rrd");
    let mut killed = Killed {
        recording: Recording::to_file(&path, &RecordSettings::default()),
        path: &path,
        looks: 0,
    };
    play(&mut killed, SMALL);
    assert!(killed.looks > 25, "{}", killed.looks);
    drop(killed);
}
