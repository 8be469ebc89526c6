//! Scores of lamp positioning: fixes and names held against the truth.

use super::cost_tally::CostTally;
use super::statistics::ErrorStatistics;
use super::summary::Positioning;
use crate::bus::{Identity, Intrinsics, LedReport, Method, PositionFix, SimTime};
use crate::track::Tunnel;
use crate::track::uid::Uid;
use nalgebra::{Isometry3, Point2, Point3};
use std::collections::{BTreeMap, BTreeSet};

/// A lamp counts as passed when it was at least this far ahead of the rig's end as the run began, so
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
    /// Names and centres of all lamps.
    lamps: Vec<(Uid, Point3<f64>)>,
    /// Lamps that the rig passes on its way with their luminous side to it, with their distances along the route.
    on_way: Vec<(Uid, f64)>,
    methods: BTreeMap<Method, Errors>,
    named: BTreeSet<Uid>,
    pairs: u32,
    costs: CostTally,
    /// Where the rig was first along the route, and how far it has run from there.
    run: Option<(f64, f64)>,
}

impl PositioningScore {
    /// Of a rig on a way, with these methods. Of the lamps of the tunnel it passes `on_way`.
    pub fn new(tunnel: &Tunnel, on_way: Vec<(Uid, f64)>, methods: &[Method]) -> Self {
        let lamps = tunnel.network.tracks.iter().flat_map(|track| &track.lamps);
        Self {
            lamps: lamps.map(|lamp| (lamp.uid, lamp.centre)).collect(),
            on_way,
            methods: methods.iter().map(|m| (*m, Errors::default())).collect(),
            named: BTreeSet::new(),
            pairs: 0,
            costs: CostTally::default(),
            run: None,
        }
    }

    /// The end of the train that the rig is at was here along the route.
    pub fn rig_at(&mut self, at_m: f64) {
        let (first_m, run_m) = self.run.get_or_insert((at_m, 0.0));
        *run_m = run_m.max(at_m - *first_m);
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
        self.costs.add(cost_ms);
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
        self.lamps
            .iter()
            .filter(|(_, at)| (at.coords - world_from_left.translation.vector).norm() < 60.0)
            .filter_map(|(uid, at)| Some((distance(at)?, *uid)))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, uid)| uid)
    }

    /// Share of the lamps passed whose name was read from the stripes.
    fn decode_rate(&self) -> Option<f64> {
        let (first_m, run_m) = self.run?;
        let passed = |s_m: f64| (APPROACH_M..=run_m).contains(&(s_m - first_m));
        let lamps = || self.on_way.iter().filter(|(_, s_m)| passed(*s_m));
        let named = lamps().filter(|(uid, _)| self.named.contains(uid)).count();
        (lamps().count() > 0).then(|| named as f64 / lamps().count() as f64)
    }

    /// The figures, by method.
    pub fn finish(self) -> BTreeMap<Method, Positioning> {
        let uid_decode_rate = self.decode_rate();
        let ms_per_frame = self.costs.cost();
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
                    error_m: ErrorStatistics::of(&mut e.errors_m),
                    ms_per_frame,
                    nees_mean: (count > 0).then(|| e.nees_sum / count as f64),
                };
                (method, figures)
            })
            .collect()
    }
}
