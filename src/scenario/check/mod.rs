//! What no part can check by itself: how the parts of a scenario go together.

mod equipment;
mod line;
mod trains;

pub(super) use line::in_tunnel;

use equipment::{check_motion, check_onboard};

use super::file::{LONGEST_RUN_S, ScenarioFile};
use crate::bus::{TrainEnd, TrainId};
use crate::settings::{Checker, name_advice};
use crate::twin::faults::rig_cameras;
use std::collections::BTreeSet;

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
        check_names(self, check);
        check_reach(self, check);
        let mut devices = BTreeSet::new();
        for (k, post) in self.wayside.iter().enumerate() {
            if !devices.insert(&post.device) {
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

/// A device that falls silent must be missed over all of the stretch that it watches.
fn check_reach(file: &ScenarioFile, check: &mut Checker<'_>) {
    if file.wayside.is_empty() {
        return;
    }
    let watched_m = file.stack.wayside.reach_m;
    let others = file.onboard.iter().enumerate();
    let others = others.map(|(k, o)| (format!("onboard[{k}].protection"), &o.protection));
    let first = file.train.iter();
    let first = first.map(|_| ("stack.protection".to_owned(), &file.stack.protection));
    for (at, protection) in first.chain(others) {
        let reach_m = protection.device_reach_m;
        if reach_m < watched_m {
            check.problem(
                &format!("{at}.device_reach_m"),
                format!("devices watch {watched_m} m, a silent one is missed over {reach_m} m"),
                format!("give at least {watched_m}, as stack.wayside.reach_m has it"),
            );
        }
    }
}

/// Scores and pictures tell things apart by their names.
fn check_names(file: &ScenarioFile, check: &mut Checker<'_>) {
    let obstacles = file.obstacles.iter().map(|o| &o.name);
    let cables = file.cables.iter().map(|c| &c.name);
    let workers = file.workers.iter().map(|w| &w.name);
    let mut names = BTreeSet::new();
    for (table, names_there) in [
        ("obstacles", obstacles.collect::<Vec<_>>()),
        ("cables", cables.collect()),
        ("workers", workers.collect()),
    ] {
        for (k, name) in names_there.into_iter().enumerate() {
            if !names.insert(name) {
                check.problem(
                    &format!("{table}[{k}].name"),
                    format!("`{name}` is the name of something before it too"),
                    "give each obstacle, cable and worker a name of its own",
                );
            }
        }
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
    let Some(bench) = &file.bench else {
        return;
    };
    let takes_s = file
        .rig
        .as_ref()
        .map(|rig| bench.duration_s(rig.pairs_per_s));
    if let Some(takes_s) = takes_s.filter(|takes_s| *takes_s > LONGEST_RUN_S) {
        check.problem(
            "bench.fixes_per_point",
            format!("all pairs of images take {takes_s:.0} s"),
            format!("give fewer points or fixes, for at most {LONGEST_RUN_S} s as other runs have"),
        );
    }
    let mut ends = file.rig.iter().map(|rig| rig.end);
    if ends.any(|end| end == TrainEnd::Rear) {
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
            check.problem(
                &format!("faults.cameras[{k}].camera"),
                format!("there is no camera `{}`", fault.camera),
                name_advice(
                    &fault.camera,
                    &names,
                    "cameras of this scenario",
                    "add [rig] or [[wayside]], or take this out",
                ),
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

/// What happens after the end would never be seen.
fn check_appearances(file: &ScenarioFile, check: &mut Checker<'_>) {
    let end_s = file.duration_s;
    let late = |check: &mut Checker<'_>, key: String, what: &str, at_s: Option<f64>| {
        if let Some(at_s) = at_s.filter(|at_s| *at_s > end_s) {
            check.problem(
                &key,
                format!("{what} at {at_s} s, but the run ends at {end_s} s"),
                "choose an earlier time, or a longer duration_s",
            );
        }
    };
    for (k, obstacle) in file.obstacles.iter().enumerate() {
        let key = |key: &str| format!("obstacles[{k}].{key}");
        late(
            check,
            key("appears_s"),
            "it appears",
            Some(obstacle.appears_s),
        );
        late(
            check,
            key("held_until_s"),
            "it comes loose",
            obstacle.held_until_s,
        );
    }
    for (k, cable) in file.cables.iter().enumerate() {
        for (end, at_s) in [("from", cable.from.lets_go_s), ("to", cable.to.lets_go_s)] {
            late(
                check,
                format!("cables[{k}].{end}.lets_go_s"),
                "it lets go",
                at_s,
            );
        }
    }
    let carriers = file.workers.iter().enumerate();
    for (k, worker) in carriers.filter(|(_, worker)| worker.puts_down_s.is_some()) {
        let key = |key: &str| format!("workers[{k}].{key}");
        if worker.carries.is_none() {
            check.problem(
                &key("puts_down_s"),
                "he carries nothing that he could put down",
                format!("add [workers.carries] to workers[{k}], or take this out"),
            );
        }
        late(
            check,
            key("puts_down_s"),
            "he puts it down",
            worker.puts_down_s,
        );
        late(
            check,
            key("picks_up_s"),
            "he picks it up",
            worker.picks_up_s,
        );
    }
}

#[cfg(test)]
mod tests;
