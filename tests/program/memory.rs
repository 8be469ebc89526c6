//! A run keeps nothing of what is behind it.

use crate::program::{PROGRAM, REPOSITORY, folder};
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};

/// Four minutes of a train that creeps towards a wayside device; all sensors at work, small pictures.
const SCENARIO: &str = r#"
    name = "memory"
    tunnel = "TUNNELS/chengdu_line1.toml"
    duration_s = 240.0
    train = { start_chainage_m = 800.0, cruise_speed_kmh = 2.4 }
    stack = { protection = { initial_chainage_m = 800.0 }, wayside = { blind_danger = "low" } }
    imu = {}
    doppler = {}
    [rig]
    pairs_per_s = 20.0
    width_px = 64
    height_px = 36
    pixel_um = 75.0
    [[wayside]]
    device = "W1530"
    camera = { width_px = 64, height_px = 36, pixel_um = 45.0, frames_per_s = 10.0 }
"#;

/// What a process holds by itself, kB; `None` where it has ended.
fn own_kb(process: u32) -> Option<f64> {
    let status = fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find(|l| l.starts_with("RssAnon:"))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

/// Memory at the start of a run and at each tenth but the last, kB.
fn run_of(scenario: &Path, more: &[&str]) -> Vec<f64> {
    let mut command = Command::new(PROGRAM);
    command.args(["run", "--renderer", "cpu", "--out"]);
    command.arg(scenario.with_extension("out"));
    command.arg(scenario).args(more).current_dir(REPOSITORY);
    let mut child = (command.stdout(Stdio::null()).stderr(Stdio::piped()))
        .spawn()
        .unwrap();
    let said = BufReader::new(child.stderr.take().unwrap()).lines();
    let tenths = said
        .map(Result::unwrap)
        .filter(|line| line.ends_with("% of the run"));
    let kept = tenths.map_while(|_| own_kb(child.id())).collect();
    assert!(child.wait().unwrap().success());
    kept
}

/// Flat within 5 MB over an hour: from the second and third tenth of a run to its last two it must not take
/// 100 kB more, with a recording or without; it takes none. Provokes anything that is kept of each frame or
/// step.
#[test]
fn memory_is_flat() {
    let folder = folder("memory");
    let measured = |name: &str, more: &[&str]| {
        let scenario = folder.join(format!("{name}.toml"));
        let tunnels = format!("{REPOSITORY}/tunnels");
        fs::write(&scenario, SCENARIO.replace("TUNNELS", &tunnels)).unwrap();
        let kept_kb = run_of(&scenario, more);
        println!("{name}: {kept_kb:?} kB");
        assert!(kept_kb.len() > 8, "{kept_kb:?}");
        let most = |kb: &[f64]| kb.iter().fold(0.0, |a: f64, b| a.max(*b));
        let (early, late) = (&kept_kb[2..4], &kept_kb[kept_kb.len() - 2..]);
        assert!(most(late) - most(early) < 100.0, "{name}: {kept_kb:?}");
    };
    std::thread::scope(|threads| {
        threads.spawn(|| measured("recorded", &[]));
        threads.spawn(|| measured("bare", &["--no-recording"]));
    });
}
