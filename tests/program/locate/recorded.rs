//! Recorded runs, and which tracks they were really on.

use crate::program::{folder, program, succeeds};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// The folder with recorded runs and maps of others, which cannot be distributed.
pub fn recorded() -> PathBuf {
    let folder = std::env::var_os("METROTWIN_RECORDED");
    folder
        .expect("METROTWIN_RECORDED names a folder with maps/ and occupancy/")
        .into()
}

/// The recorded runs, on one network.
pub struct RecordedRuns {
    pub network: PathBuf,
    pub runs: Vec<RecordedRun>,
}

/// A table of fixes.
pub struct RecordedRun {
    pub name: String,
    pub gnss: PathBuf,
    /// Where it was; none of a run that `truth.csv` does not hold.
    pub known: Option<KnownRun>,
}

/// What is known of a run: from a second to another it was on one of some elements.
pub type KnownRun = Vec<KnownStay>;

/// A stay on one of some elements, which cannot be told apart by hand.
#[derive(Clone)]
pub struct KnownStay {
    pub from_s: f64,
    pub to_s: f64,
    pub elements: Vec<String>,
}

impl RecordedRuns {
    /// `network_*` and all `log_RUN_*.csv` of the folder `occupancy`, with its `truth.csv`.
    pub fn read() -> Self {
        let folder = recorded().join("occupancy");
        let files = fs::read_dir(&folder).unwrap();
        let mut files: Vec<PathBuf> = files.map(|file| file.unwrap().path()).collect();
        files.sort();
        let name = |path: &Path| path.file_name().unwrap().to_string_lossy().into_owned();
        let network = files.iter().find(|path| name(path).starts_with("network"));
        let mut known = known_runs(&folder.join("truth.csv"));
        let logs = files.iter().filter(|path| {
            name(path).starts_with("log_") && path.extension().is_some_and(|e| e == "csv")
        });
        let runs = logs.map(|gnss| {
            let run = name(gnss).split(['_', '.']).nth(1).unwrap().to_owned();
            RecordedRun {
                known: known.remove(&run),
                gnss: gnss.clone(),
                name: run,
            }
        });
        Self {
            network: network.unwrap().clone(),
            runs: runs.collect(),
        }
    }

    /// What `locate` writes of a table of fixes into a folder: its table of tracks and its summary.
    pub fn locate(&self, gnss: &Path, out: &Path) -> (String, serde_json::Value) {
        let [network, gnss, results] = [&self.network, gnss, out].map(Path::as_os_str);
        let args = ["--network", "--gnss", "--out"].map(AsRef::as_ref);
        let args = args.into_iter().zip([network, gnss, results]);
        let args = args.flat_map(|(name, value)| [name, value]);
        let run = program(std::iter::once("locate".as_ref()).chain(args)).output();
        succeeds(&run.unwrap());
        let summary = fs::read_to_string(out.join("summary.json")).unwrap();
        let tracks = fs::read_to_string(out.join("tracks.csv")).unwrap();
        (tracks, serde_json::from_str(&summary).unwrap())
    }
}

/// By run, of a table run, from_s, to_s, element, where `|` stands between elements.
fn known_runs(path: &Path) -> BTreeMap<String, KnownRun> {
    let mut known: BTreeMap<String, KnownRun> = BTreeMap::new();
    let text = fs::read_to_string(path).unwrap_or_default();
    for row in text.lines().skip(1) {
        let columns: Vec<&str> = row.split(',').collect();
        let stay = KnownStay {
            from_s: columns[1].parse().unwrap(),
            to_s: columns[2].parse().unwrap(),
            elements: columns[3].split('|').map(str::to_owned).collect(),
        };
        known.entry(columns[0].to_owned()).or_default().push(stay);
    }
    known
}

/// Fixes of a run by what is known of them: where a stay names several elements the truth is not unique, and being right
/// is easier.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JudgedFixes {
    /// Where one element is known.
    pub unique: ClassCounts,
    /// Where one of several is.
    pub several: ClassCounts,
}

impl JudgedFixes {
    /// Of a table of tracks.
    pub fn of(tracks: &str, known: &[KnownStay]) -> Self {
        let mut judged = Self::default();
        for row in tracks.lines().skip(1) {
            let columns: Vec<&str> = row.split(',').collect();
            let second: f64 = columns[0].parse().unwrap();
            // Between two stays, either.
            let stays = known
                .iter()
                .filter(|stay| (stay.from_s - 0.45..stay.to_s + 0.45).contains(&second));
            let mut elements: Vec<&String> = stays.flat_map(|stay| &stay.elements).collect();
            elements.sort();
            elements.dedup();
            let right = elements.iter().any(|element| *element == columns[3]);
            let counts = match elements.len() {
                0 | 1 => &mut judged.unique,
                _ => &mut judged.several,
            };
            counts.add_fix(columns[4].parse().ok(), columns[5] == "true", right);
        }
        judged
    }

    pub fn add(&mut self, other: &Self) {
        self.unique.add(&other.unique);
        self.several.add(&other.several);
    }

    pub fn fixes(&self) -> usize {
        self.unique.fixes() + self.several.fixes()
    }

    pub fn wrong_confident(&self) -> usize {
        self.unique.of_class[0] + self.several.of_class[0]
    }

    /// Both under [`ClassCounts::HEADER`].
    pub fn text(&self) -> String {
        format!("{} | {}", self.unique.text(), self.several.text())
    }

    /// Over the columns of [`Self::text`].
    pub fn header() -> String {
        format!("{} | {}", ClassCounts::HEADER, ClassCounts::HEADER)
    }
}

/// Of known stays, how many name one element, and several.
pub fn stays_of_one_and_several<'a>(runs: impl IntoIterator<Item = &'a KnownRun>) -> [usize; 2] {
    let mut stays = [0; 2];
    for stay in runs.into_iter().flatten() {
        stays[usize::from(stay.elements.len() > 1)] += 1;
    }
    stays
}

/// How many fixes are of which class.
#[derive(Clone, Copy, Default, PartialEq, Debug)]
pub struct ClassCounts {
    /// Wrong confident, wrong fairly confident, wrong undecided, right undecided, fairly confident, confident.
    pub of_class: [usize; 6],
    /// After which nothing is said.
    pub none: usize,
}

impl ClassCounts {
    pub const HEADER: &str = "   wc    wf    wu    cu    cf    cc  none";

    /// One more fix, after which the most probable track has a probability, none where nothing is said.
    fn add_fix(&mut self, probability: Option<f64>, identified: bool, right: bool) {
        let Some(probability) = probability else {
            self.none += 1;
            return;
        };
        let sure = match identified {
            true => 2,
            false => usize::from(probability > 0.9),
        };
        self.of_class[if right { 3 + sure } else { 2 - sure }] += 1;
    }

    pub fn fixes(&self) -> usize {
        self.of_class.iter().sum::<usize>() + self.none
    }

    /// Share of the fixes after which one track was left, percent.
    pub fn identified_percent(&self) -> f64 {
        let [wrong, .., right] = self.of_class;
        100.0 * (wrong + right) as f64 / self.fixes() as f64
    }

    pub fn add(&mut self, other: &Self) {
        self.none += other.none;
        for (sum, count) in self.of_class.iter_mut().zip(other.of_class) {
            *sum += count;
        }
    }

    /// Under [`ClassCounts::HEADER`].
    pub fn text(&self) -> String {
        let counts = self.of_class.iter().chain([&self.none]);
        let texts: Vec<String> = counts.map(|count| format!("{count:5}")).collect();
        texts.join(" ")
    }
}

/// Fails where fixes of a stay that names several elements count among those whose truth is unique.
#[test]
fn fixes_of_several_elements_are_counted_apart() {
    let stay = |from_s, to_s, elements: &[&str]| KnownStay {
        from_s,
        to_s,
        elements: elements.iter().map(|name| (*name).to_owned()).collect(),
    };
    let known = vec![stay(0.0, 9.0, &["a"]), stay(10.0, 20.0, &["b", "c"])];
    assert_eq!(stays_of_one_and_several([&known]), [1, 1]);
    let tracks = "header\n\
        1,,,a,1.0,true\n\
        2,,,b,0.95,false\n\
        3,,,,,false\n\
        11,,,b,1.0,true\n\
        12,,,c,0.6,false\n\
        13,,,a,0.6,false\n\
        30,,,a,0.6,false\n";
    let judged = JudgedFixes::of(tracks, &known);
    assert_eq!(judged.unique.of_class, [0, 1, 1, 0, 0, 1]);
    assert_eq!(judged.several.of_class, [0, 0, 1, 1, 0, 1]);
    assert_eq!((judged.unique.none, judged.several.none), (1, 0));
    assert_eq!((judged.fixes(), judged.wrong_confident()), (7, 0));
}

/// No decision on a recorded run is both certain and wrong. What was really run comes from `occupancy/truth.csv`;
/// runs that it does not hold are only located.
#[test]
#[ignore = "needs METROTWIN_RECORDED, a folder with occupancy/network_*.geojson, log_RUN_*.csv and truth.csv that may \
    not be distributed; stack::occupancy and sessions::occupancy test the same on made fixes"]
fn recorded_runs_are_never_wrong_with_certainty() {
    let recorded = RecordedRuns::read();
    let out = folder("recorded_runs");
    let known = recorded.runs.iter().filter_map(|run| run.known.as_ref());
    let [one, several] = stays_of_one_and_several(known);
    println!("{one} stays are known to one element (left), {several} to one of several (right)");
    println!("run    {}  us a fix: p50, p99", JudgedFixes::header());
    for run in &recorded.runs {
        let name = &run.name;
        let (tracks, summary) = recorded.locate(&run.gnss, &out.join(name));
        let Some(known) = &run.known else {
            println!("{name}: nothing known, {}", summary["identified"]);
            continue;
        };
        let counts = JudgedFixes::of(&tracks, known);
        let cost_us = |share: &str| summary["us_per_fix"][share].as_f64().unwrap();
        let (p50_us, p99_us) = (cost_us("p50"), cost_us("p99"));
        println!("{name:6} {} {p50_us:.0} {p99_us:.0}", counts.text());
        assert_eq!(counts.wrong_confident(), 0, "{name}: wrong with certainty");
    }
    let known = recorded.runs.iter().filter(|run| run.known.is_some());
    assert!(
        known.count() > 0,
        "occupancy/truth.csv holds none of the runs"
    );
}
