//! The stack's words held against the truth.

use super::summary::{Cost, Distribution, ObstacleScore, Positioning, Wayside};
use crate::bus::{
    DangerLevel, Identity, Intrinsics, LedReport, Method, PositionFix, SimTime, WaysideReport,
};
use crate::track::Tunnel;
use crate::track::uid::Uid;
use nalgebra::{Isometry3, Point2, Point3};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// A lamp counts as passed when it was at least this far ahead of the head as the run began, so
/// that the camera had the chance to see the whole approach.
const APPROACH_M: f64 = 10.0;

#[derive(Debug, Default)]
struct Errors {
    errors_m: Vec<f64>,
    nees_sum: f64,
    wrong_uid: u32,
}

/// Scores positioning.
#[derive(Debug)]
pub struct PositioningScore {
    tunnel: Arc<Tunnel>,
    methods: BTreeMap<Method, Errors>,
    named: BTreeSet<Uid>,
    pairs: u32,
    costs_ms: Vec<f64>,
    /// Chainage of the train head: first and furthest.
    run_m: Option<(f64, f64)>,
}

impl PositioningScore {
    /// Of a run on `tunnel` with these methods.
    pub fn new(tunnel: Arc<Tunnel>, methods: &[Method]) -> Self {
        Self {
            tunnel,
            methods: methods.iter().map(|m| (*m, Errors::default())).collect(),
            named: BTreeSet::new(),
            pairs: 0,
            costs_ms: Vec::new(),
            run_m: None,
        }
    }

    /// The head was here.
    pub fn head_at(&mut self, chainage_m: f64) {
        let (first, furthest) = self.run_m.unwrap_or((chainage_m, chainage_m));
        self.run_m = Some((first, furthest.max(chainage_m)));
    }

    /// One report, the cost of making it, and the true pose of the left eye at a time.
    pub fn report(
        &mut self,
        report: &LedReport,
        cost_ms: f64,
        intrinsics: &Intrinsics,
        left_at: impl Fn(SimTime) -> Option<Isometry3<f64>>,
    ) {
        self.pairs += 1;
        self.costs_ms.push(cost_ms);
        let Some(left) = left_at(report.time) else {
            return;
        };
        for spot in &report.left {
            if let Some((uid, Identity::Decoded | Identity::Joined)) = spot.uid
                && self.lamp_at(&left, intrinsics, &spot.centre) == Some(uid)
            {
                self.named.insert(uid);
            }
        }
        for fix in &report.fixes {
            let pixel = intrinsics.project(&Point3::from(fix.lamp_in_camera));
            let left = left_at(fix.time).unwrap_or(left);
            let seen = pixel.and_then(|p| self.lamp_at(&left, intrinsics, &p));
            self.methods.entry(fix.method).or_default().wrong_uid +=
                u32::from(seen != Some(fix.uid));
        }
    }

    /// One fix and the chainage at which the head really was; gives the error.
    pub fn fix(&mut self, fix: &PositionFix, true_chainage_m: f64) -> f64 {
        let error_m = fix.chainage_m - true_chainage_m;
        let errors = self.methods.entry(fix.method).or_default();
        errors.errors_m.push(error_m.abs());
        errors.nees_sum += (error_m / fix.sigma_m).powi(2);
        error_m
    }

    /// Fixes of a method so far.
    pub fn fixes(&self, method: Method) -> usize {
        self.methods.get(&method).map_or(0, |e| e.errors_m.len())
    }

    /// The lamp whose image is nearest to a pixel.
    fn lamp_at(
        &self,
        world_from_left: &Isometry3<f64>,
        intrinsics: &Intrinsics,
        pixel: &Point2<f64>,
    ) -> Option<Uid> {
        let distance = |centre: &Point3<f64>| {
            let p = intrinsics.project(&world_from_left.inverse_transform_point(centre))?;
            Some((p - pixel).norm())
        };
        self.tunnel
            .lamps
            .iter()
            .filter(|l| (l.centre.coords - world_from_left.translation.vector).norm() < 60.0)
            .filter_map(|l| Some((distance(&l.centre)?, l.uid)))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, uid)| uid)
    }

    /// Share of the lamps passed whose name was read from the stripes.
    fn decode_rate(&self) -> Option<f64> {
        let (first, furthest) = self.run_m?;
        let passed = |s: f64| s >= first + APPROACH_M && s <= furthest;
        let lamps = || self.tunnel.lamps.iter().filter(|l| passed(l.chainage_m));
        let named = lamps().filter(|l| self.named.contains(&l.uid)).count();
        (lamps().count() > 0).then(|| named as f64 / lamps().count() as f64)
    }

    /// The figures, by method.
    pub fn finish(mut self) -> BTreeMap<Method, Positioning> {
        let uid_decode_rate = self.decode_rate();
        let ms_per_frame = Cost::of(&mut self.costs_ms);
        let pairs = f64::from(self.pairs);
        self.methods
            .into_iter()
            .map(|(method, mut e)| {
                let count = e.errors_m.len();
                let figures = Positioning {
                    fixes: count as u32,
                    availability: (pairs > 0.0).then(|| count as f64 / pairs),
                    uid_decode_rate,
                    wrong_uid: e.wrong_uid,
                    error_m: Distribution::of(&mut e.errors_m),
                    ms_per_frame,
                    nees_mean: (count > 0).then(|| e.nees_sum / count as f64),
                };
                (method, figures)
            })
            .collect()
    }
}

/// Something in the tunnel that a wayside device may rightly report.
#[derive(Clone, Debug, PartialEq)]
pub struct Presence {
    /// Name in the scenario.
    pub name: String,
    /// Largest dimension.
    pub size_m: f64,
    /// Chainage of its centre.
    pub chainage_m: f64,
    /// Half its extent along the line.
    pub half_length_m: f64,
    /// It lies still, on its own.
    pub at_rest: bool,
    /// It is scored as an obstacle (a worker or a train is not).
    pub obstacle: bool,
}

/// A report this far along the line from anything real is a false alarm.
const MATCH_M: f64 = 3.0;

/// Scores wayside detection.
#[derive(Debug, Default)]
pub struct WaysideScore {
    found: BTreeMap<String, Found>,
    false_alarms: u32,
    costs_ms: Vec<f64>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Found {
    size_m: f64,
    appeared: SimTime,
    first: Option<SimTime>,
    error_sum_m: f64,
    errors: u32,
}

impl WaysideScore {
    /// One report, and all that there was at the frame's time.
    pub fn report(&mut self, report: &WaysideReport, cost_ms: f64, present: &[Presence]) {
        self.costs_ms.push(cost_ms);
        for p in present.iter().filter(|p| p.obstacle && p.at_rest) {
            self.found.entry(p.name.clone()).or_insert(Found {
                size_m: p.size_m,
                appeared: report.time,
                ..Found::default()
            });
        }
        // What the device itself calls clear of the gauge is no alarm.
        for seen in (report.obstacles.iter()).filter(|o| o.danger != DangerLevel::None) {
            let centre_m = 0.5 * (seen.from_chainage_m + seen.to_chainage_m);
            let beside = |p: &Presence| (p.chainage_m - centre_m).abs() - p.half_length_m;
            let nearest = present
                .iter()
                .min_by(|a, b| beside(a).total_cmp(&beside(b)));
            match nearest.filter(|p| beside(p) < MATCH_M) {
                None => self.false_alarms += 1,
                Some(p) => {
                    if let Some(found) = self.found.get_mut(&p.name) {
                        found.first.get_or_insert(report.time);
                        found.error_sum_m += centre_m - p.chainage_m;
                        found.errors += 1;
                    }
                }
            }
        }
    }

    /// Takes in the scores of another device.
    pub fn add(&mut self, other: Self) {
        for (name, theirs) in other.found {
            let new = !self.found.contains_key(&name);
            let ours = self.found.entry(name).or_insert(theirs);
            ours.appeared = ours.appeared.min(theirs.appeared);
            ours.first = ours.first.into_iter().chain(theirs.first).min();
            if !new {
                ours.error_sum_m += theirs.error_sum_m;
                ours.errors += theirs.errors;
            }
        }
        self.false_alarms += other.false_alarms;
        self.costs_ms.extend(other.costs_ms);
    }

    /// The figures.
    pub fn finish(mut self) -> Wayside {
        let score = |(name, f): (String, Found)| ObstacleScore {
            name,
            size_m: f.size_m,
            first_detected_s: f.first.map(SimTime::secs),
            latency_s: f.first.map(|t| t.since(f.appeared)),
            distance_error_m: (f.errors > 0).then(|| f.error_sum_m / f64::from(f.errors)),
        };
        Wayside {
            obstacles: self.found.into_iter().map(score).collect(),
            false_alarms: self.false_alarms,
            ms_per_frame: Cost::of(&mut self.costs_ms),
        }
    }
}
