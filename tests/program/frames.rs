//! Data sets: files, tables and annotations agree with each other and with what the stack got.

use crate::program::{REPOSITORY, content, folder, program, refuses, succeeds};
use arrow::array::AsArray;
use arrow::datatypes::{Float64Type, Int64Type};
use arrow::record_batch::RecordBatch;
use image::GrayImage;
use metrotwin::record::dataset::{DataSet, FramePlan, Provenance};
use metrotwin::scenario::Scenario;
use metrotwin::session::{
    Event, Observer, ObserverError, RendererChoice, RunOptions, renderer, run,
};
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::Path;
use std::process::Output;
use std::sync::atomic::{AtomicBool, Ordering};

/// The toolbox's place in small pictures, with a box that falls instead of the worker.
const SMALL: [&str; 14] = [
    "workers=[]",
    "obstacles=[{name='box', body={shape='box', size_m=[0.5, 0.3, 0.3]}, mass_kg=10, \
     chainage_m=1512, height_m=0.5, appears_s=0.1}]",
    "duration_s=0.65",
    "rig.pairs_per_s=10",
    "rig.width_px=320",
    "rig.height_px=180",
    "rig.pixel_um=15",
    "rig.line_time_us=88.8",
    "rig.sensor.bits=12",
    "wayside[0].camera.width_px=480",
    "wayside[0].camera.height_px=270",
    "wayside[0].camera.pixel_um=15",
    "wayside[0].camera.line_time_us=59.2",
    "train.start_chainage_m=700",
];

fn scenario(seed: u64) -> Scenario {
    let path = Path::new(REPOSITORY).join("scenarios/forgotten_toolbox.toml");
    let overrides: Vec<_> = SMALL.iter().map(|o| o.parse().unwrap()).collect();
    let mut scenario = Scenario::load(&path, &overrides).unwrap();
    scenario.file.seed = seed;
    scenario
}

/// Keeps the images that reach the stack, by the names that their files have.
#[derive(Default)]
struct Delivered(BTreeMap<String, GrayImage>);

impl Observer for Delivered {
    fn observe(&mut self, event: &Event<'_>) -> Result<(), ObserverError> {
        let mut keep = |camera: &str, number: u32, image: &GrayImage| {
            let name = format!("images/{camera}/{number:06}.png");
            self.0.insert(name, image.clone());
        };
        match event {
            Event::Pair { pair, .. } => {
                keep("left", pair.left.number, &pair.left.image);
                keep("right", pair.right.number, &pair.right.image);
            }
            Event::Wayside { frame, .. } => keep("W1530", frame.number, &frame.image),
            _ => {}
        }
        Ok(())
    }
}

/// Makes a set with the plain renderer; a run that comes to `stop_s` is broken off there. Gives the
/// number of frames, what the stack got, and how long the run was.
fn make(out: &Path, seed: u64, plan: FramePlan, stop_s: f64) -> (usize, Delivered, f64) {
    let scenario = scenario(seed);
    let draws = renderer(&scenario, RendererChoice::Cpu).unwrap();
    let stop = AtomicBool::new(false);
    let mut set = DataSet::new(out, &scenario, plan, Provenance::default(), draws, &stop);
    let progress = |now_s: f64| {
        if now_s >= stop_s {
            stop.store(true, Ordering::Relaxed);
        }
    };
    let options = RunOptions {
        renderer: RendererChoice::Cpu,
        stop: Some(&stop),
        progress: Some(&progress),
    };
    let mut delivered = Delivered::default();
    let summary = run(&scenario, &options, &mut [&mut set, &mut delivered]).unwrap();
    (set.frames(), delivered, summary.simulated_s)
}

fn table(out: &Path, name: &str) -> RecordBatch {
    let file = File::open(out.join(name)).unwrap();
    let reader = ParquetRecordBatchReaderBuilder::try_new(file).unwrap();
    let schema = reader.schema().clone();
    let batches: Vec<_> = reader.build().unwrap().map(Result::unwrap).collect();
    arrow::compute::concat_batches(&schema, &batches).unwrap()
}

fn ints(table: &RecordBatch, name: &str) -> Vec<i64> {
    let column = table.column_by_name(name).unwrap();
    column.as_primitive::<Int64Type>().values().to_vec()
}

fn reals(table: &RecordBatch, name: &str) -> Vec<f64> {
    let column = table.column_by_name(name).unwrap();
    column.as_primitive::<Float64Type>().values().to_vec()
}

fn texts(table: &RecordBatch, name: &str) -> Vec<Option<String>> {
    let column = table.column_by_name(name).unwrap().as_string::<i32>();
    column.iter().map(|t| t.map(str::to_owned)).collect()
}

/// Shape and numbers of an array of float32.
fn npy(path: &Path) -> (String, Vec<f32>) {
    let bytes = fs::read(path).unwrap();
    assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00");
    let header = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let (text, numbers) = bytes[10..].split_at(header);
    assert_eq!((10 + header) % 64, 0);
    let numbers = numbers
        .as_chunks::<4>()
        .0
        .iter()
        .map(|b| f32::from_le_bytes(*b));
    (String::from_utf8(text.to_vec()).unwrap(), numbers.collect())
}

/// Fails where a file is missing, left under its temporary name, or differs from what the stack
/// got; where tables, masks and annotations count other pixels; where rows have another time.
#[test]
fn files_tables_and_annotations_agree() {
    let out = folder("agree");
    let (frames, delivered, _) = make(&out, 1, FramePlan::default(), f64::INFINITY);
    let table_of = |name: &str| table(&out, name);
    let rows = table_of("frames.parquet");
    assert_eq!(rows.num_rows(), frames);
    assert_eq!(frames, delivered.0.len());
    let all = content(&out);
    assert!(all.keys().all(|name| !name.ends_with(".part")));

    let (ids, images, raws) = (
        ints(&rows, "frame_id"),
        texts(&rows, "image"),
        texts(&rows, "raw"),
    );
    let (heights, masks) = (ints(&rows, "height_px"), texts(&rows, "mask"));
    let (bits, flows) = (ints(&rows, "bits"), texts(&rows, "flow"));
    let obstacles = table_of("obstacles.parquet");
    let (of_frame, who) = (
        ints(&obstacles, "frame_id"),
        ints(&obstacles, "instance_id"),
    );
    let visible_px = ints(&obstacles, "visible_px");
    let mut boxes = 0;
    for k in 0..frames {
        let name = images[k].as_ref().unwrap();
        let image = image::open(out.join(name)).unwrap().into_luma8();
        assert_eq!(&image, &delivered.0[name], "{name}");
        let raw = image::open(out.join(raws[k].as_ref().unwrap()))
            .unwrap()
            .into_luma16();
        for (raw, grey) in raw.iter().zip(image.iter()) {
            assert_eq!((raw >> (bits[k] - 8)) as u8, *grey, "{name}");
        }
        let mask = image::open(out.join(masks[k].as_ref().unwrap()))
            .unwrap()
            .into_luma16();
        for j in (0..obstacles.num_rows()).filter(|j| of_frame[*j] == ids[k]) {
            let own = mask.iter().filter(|id| i64::from(**id) == who[j]).count();
            assert_eq!(own as i64, visible_px[j], "{name}, {}", who[j]);
            boxes += usize::from(who[j] == 1 && own > 0);
        }
        let camera_goes_on = ids.contains(&(ids[k] + 1));
        assert_eq!(flows[k].is_some(), camera_goes_on, "{name}");
    }
    assert!(boxes >= 3, "the box is seen {boxes} times");

    // Rows: all of them, a line time apart.
    let lines = table_of("rows.parquet");
    assert_eq!(lines.num_rows() as i64, heights.iter().sum::<i64>());
    let (open, line) = (ints(&lines, "open_ns"), reals(&rows, "line_time_s")[0]);
    assert_eq!(open[1] - open[0], (1e9 * line).round() as i64);
    assert_eq!(open[0], ints(&rows, "start_ns")[0]);
    assert!(table_of("lamps.parquet").num_rows() > 0);

    // COCO: areas and boxes of the same masks.
    let coco: serde_json::Value =
        serde_json::from_slice(&fs::read(out.join("coco.json")).unwrap()).unwrap();
    assert_eq!(coco["images"].as_array().unwrap().len(), frames);
    for a in coco["annotations"].as_array().unwrap() {
        let j = (0..obstacles.num_rows())
            .find(|j| of_frame[*j] == a["image_id"] && who[*j] == a["instance_id"])
            .unwrap();
        assert_eq!(a["area"], visible_px[j]);
        let [left, top] = ["left_px", "top_px"].map(|c| ints(&obstacles, c)[j]);
        assert_eq!((&a["bbox"][0], &a["bbox"][1]), (&left.into(), &top.into()));
    }
}

/// Fails where depth and flow have another shape, or a wall that a still camera sees seems to move.
#[test]
fn arrays_have_their_shape_and_still_walls_stand_still() {
    let out = folder("arrays");
    let plan = FramePlan {
        cameras: vec!["W1530".into()],
        limit: Some(3),
        ..FramePlan::default()
    };
    let (frames, _, simulated_s) = make(&out, 1, plan, f64::INFINITY);
    assert_eq!(frames, 3);
    // The third frame starts at 0.2 s and is delivered some hundredths later; then it is enough.
    assert!((0.2..0.35).contains(&simulated_s), "{simulated_s}");
    let (shape, depth) = npy(&out.join("depth/W1530/000000.npy"));
    assert!(shape.contains("'shape': (270, 480)"), "{shape}");
    assert!(depth.iter().all(|d| *d > 0.0) && depth.iter().any(|d| *d < 5.0));
    let (shape, flow) = npy(&out.join("flow/W1530/000001.npy"));
    assert!(shape.contains("'shape': (270, 480, 2)"), "{shape}");
    let mask = image::open(out.join("mask/W1530/000001.png"))
        .unwrap()
        .into_luma16();
    let (mut walls, mut falls) = (0, 0.0f32);
    for (k, id) in mask.iter().enumerate() {
        let [u, v] = [flow[2 * k], flow[2 * k + 1]];
        match id {
            0 => walls += usize::from(u.abs() < 1e-6 && v.abs() < 1e-6),
            _ if v.is_finite() => falls = falls.max(v),
            _ => {}
        }
    }
    assert!(walls as f64 > 0.98 * mask.len() as f64, "{walls}");
    // From 0.1 s on it falls: 0.05 m by 0.2 s, 0.2 m by 0.3 s, at 18 m through 273 px.
    assert!((0.3..8.0).contains(&falls), "{falls} px");
}

/// Fails where anything depends on threads, order or the clock.
#[test]
fn same_seed_same_bytes() {
    let [one, two, other] = ["one", "two", "other"].map(|name| {
        let out = folder(&format!("bytes_{name}"));
        let plan = FramePlan {
            every: 2,
            to_s: 0.45,
            ..FramePlan::default()
        };
        let (_, _, simulated_s) = make(
            &out,
            if name == "other" { 2 } else { 1 },
            plan,
            f64::INFINITY,
        );
        // Ended by the first frames after the last wanted time, not by the scenario.
        assert!((0.5..0.6).contains(&simulated_s), "{simulated_s}");
        content(&out)
    });
    assert!(one.len() > 40, "{} files", one.len());
    assert_eq!(
        one.keys().collect::<Vec<_>>(),
        two.keys().collect::<Vec<_>>()
    );
    for (path, bytes) in &one {
        assert_eq!(bytes, &two[path], "{path}");
    }
    assert_ne!(
        one["images/left/000002.png"],
        other["images/left/000002.png"]
    );
}

/// Fails where a run that is broken off leaves a set that cannot be read.
#[test]
fn a_run_broken_off_leaves_a_whole_set() {
    let out = folder("broken_off");
    let (frames, _, _) = make(&out, 1, FramePlan::default(), 0.3);
    assert!((1..18).contains(&frames), "{frames}");
    let rows = table(&out, "frames.parquet");
    assert_eq!(rows.num_rows(), frames);
    for (name, height) in texts(&rows, "image").iter().zip(ints(&rows, "height_px")) {
        let image = image::open(out.join(name.as_ref().unwrap())).unwrap();
        assert_eq!(i64::from(image.height()), height);
    }
    assert!(out.join("meta.json").exists() && out.join("README.md").exists());
}

fn frames(args: &[&str]) -> Output {
    let line = "frames scenarios/forgotten_toolbox.toml --renderer cpu";
    let mut command = program(line.split(' '));
    for change in SMALL {
        command.args(["--set", change]);
    }
    command.args(args).output().unwrap()
}

/// Fails where a wrong argument is found too late, or somebody's files are written over.
#[test]
fn the_command_refuses_what_is_wrong_and_keeps_what_is_there() {
    let base = folder("command");
    let out = base.join("set");
    let path = out.to_str().unwrap();
    for (args, word) in [
        (["--cameras", "middle"], "left, right, W1530"),
        (["--labels", "depths"], "`depths`"),
        (["--from", "99"], "lasts 0.65 s"),
        (["--to", "nan"], "lasts 0.65 s"),
        (["--seed", "18446744073709551615"], "--seed"),
        (["--every", "0"], "--every"),
    ] {
        let output = frames(&[&["--out", path], &args[..]].concat());
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {said}");
        assert!(
            said.contains(word),
            "{args:?} does not say `{word}`, but: {said}"
        );
        assert!(!out.exists(), "{args:?} wrote");
    }
    let some = [
        "--out",
        path,
        "--labels",
        "none",
        "--limit",
        "1",
        "--cameras",
        "left",
    ];
    assert_eq!(frames(&some).status.code(), Some(0));
    let files = content(&out);
    let names: Vec<_> = files.keys().map(String::as_str).collect();
    let expected = [
        "README.md",
        "files.txt",
        "frames.parquet",
        "images/left/000000.png",
        "inputs/scenarios/forgotten_toolbox.toml",
        "inputs/tunnels/chengdu_line1.toml",
        "meta.json",
        "scenario.toml",
    ];
    assert_eq!(names, expected);

    // As an interrupted set: that of another camera is not gone on with.
    let meta = out.join("meta.json");
    let whole = fs::read_to_string(&meta).unwrap();
    let begun = whole.replace("\"finished\": true", "\"finished\": false");
    assert_ne!(whole, begun);
    fs::write(&meta, begun).unwrap();
    let mut right = some;
    right[7] = "right";
    refuses(&frames(&right), "--force");
    fs::write(&meta, whole).unwrap();

    fs::write(out.join("mine.txt"), "kept").unwrap();
    fs::write(out.join("images/holiday.jpg"), "kept").unwrap();
    refuses(&frames(&some), "--force");
    let forced = [&some[..], &["--force", "--from", "0.1"]].concat();
    assert_eq!(frames(&forced).status.code(), Some(0));
    assert!(!out.join("images/left/000000.png").exists());
    for there in ["images/left/000001.png", "mine.txt", "images/holiday.jpg"] {
        assert!(out.join(there).exists(), "no {there}");
    }
}

/// Fails where `--force` removes files in a folder that holds no data set, or that a set there does not
/// list; or where one of its own would be written over somebody's.
#[test]
fn files_of_others_survive_force() {
    let base = folder("frames_of_others");
    let theirs = [
        "README.md",
        "meta.json",
        "images/holiday.jpg",
        "flow/river.txt",
    ];
    let some = [
        "--labels",
        "none",
        "--limit",
        "1",
        "--cameras",
        "left",
        "--force",
    ];
    for left_out in [&[][..], &["README.md", "meta.json"]] {
        let out = base.join(left_out.len().to_string());
        let theirs = || theirs.iter().filter(|name| !left_out.contains(name));
        for name in theirs() {
            let path = out.join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, name).unwrap();
        }
        let made = frames(&[&["--out", out.to_str().unwrap()], &some[..]].concat());
        let said = String::from_utf8_lossy(&made.stderr);
        if left_out.is_empty() {
            assert_eq!(made.status.code(), Some(2), "{said}");
            assert!(
                said.contains("README.md") || said.contains("meta.json"),
                "{said}"
            );
            assert!(!out.join("files.txt").exists());
        } else {
            assert_eq!(made.status.code(), Some(0), "{said}");
        }
        for name in theirs() {
            assert_eq!(fs::read_to_string(out.join(name)).unwrap(), *name);
        }
    }
}

/// Fails where the scenario of a set names files that are not there, or lacks the changes that the set
/// was made with.
#[test]
fn the_scenario_of_a_set_makes_the_set_again() {
    let base = folder("frames_again");
    let [first, again] = ["first", "again"].map(|name| base.join(name));
    // A mesh and a vehicle are files too.
    let mesh =
        "obstacles=[{name='spanner', body={shape='mesh', file='spanner.obj'}, chainage_m=1512}]";
    let change = [
        "--set",
        mesh,
        "--set",
        "train.vehicle='vehicles/metro_b1_crush.toml'",
        "--seed",
        "7",
    ];
    let some = [
        "--labels",
        "obstacles",
        "--limit",
        "2",
        "--cameras",
        "left,W1530",
    ];
    let made = frames(&[&["--out", first.to_str().unwrap()], &some[..], &change].concat());
    succeeds(&made);
    let scenario = fs::read_to_string(first.join("scenario.toml")).unwrap();
    assert!(!scenario.contains(REPOSITORY), "a file of its own is named");
    let line = "frames first/scenario.toml --renderer cpu --out again";
    let mut command = program(line.split(' '));
    let made = command.args(some).current_dir(&base).output().unwrap();
    succeeds(&made);
    let [a, b] = [&first, &again].map(|out| {
        let mut all = content(out);
        // These two tell of changes and list the inputs.
        all.retain(|name, _| {
            !name.starts_with("inputs/") && name != "meta.json" && name != "files.txt"
        });
        all
    });
    assert!(a.len() > 8);
    assert!(a.keys().eq(b.keys()));
    for (name, bytes) in a.iter().filter(|(name, _)| *name != "scenario.toml") {
        assert!(*bytes == b[name], "{name}");
    }
}
