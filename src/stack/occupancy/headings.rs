//! Which hypotheses the headings tell apart.
//!
//! A map is wrong about the headings of two tracks by an error of each. Where it has both parallel, to within what these
//! errors may be, the tracks may well be parallel, and which of them has the better heading says nothing; counted for
//! kilometres it makes a wrong track certain, the sooner the worse the map is. So what headings say is kept aside, and
//! fades over some lengths of the map's errors, until the map has the tracks part by more than it can be wrong.

use super::hypothesis::{Hypothesis, most_probable, wrapped};
use super::map_error;
use super::settings::OccupancySettings;
use crate::track::plan::PlanNetwork;
use std::f64::consts::SQRT_2;

/// Two mapped headings that differ by so many standard deviations of the difference are two headings.
const PARTED_SIGMAS: f64 = 3.0;
/// What was kept aside fades by e over so many correlation lengths of the map's errors.
const KEPT_LENGTHS: f64 = 3.0;

/// Mapped headings that differ by more are two headings.
pub fn parted_rad(settings: &OccupancySettings) -> f64 {
    let turned_rad2 = map_error::stationary(settings)[(1, 1)];
    PARTED_SIGMAS * SQRT_2 * turned_rad2.sqrt()
}

/// Takes the sum of yaw rates into all hypotheses, after a run since the last time.
pub fn compare_headings(
    hypotheses: &mut [Hypothesis],
    network: &PlanNetwork,
    (turned_rad, run_m): (f64, f64),
    settings: &OccupancySettings,
) {
    let Some(most) = most_probable(hypotheses) else {
        return;
    };
    let keep = (-run_m / (KEPT_LENGTHS * settings.map_correlation_m)).exp();
    let update = |hypotheses: &mut [Hypothesis], k: usize| {
        let mapped = hypotheses[k].heading_beside(&hypotheses[most], network, settings);
        let hypothesis = &mut hypotheses[k];
        let log = hypothesis.update_heading(&mapped, turned_rad, settings);
        hypothesis.heading_log = keep * hypothesis.heading_log + log;
        mapped.here_rad
    };
    let most_rad = update(hypotheses, most);
    let most_log = std::mem::take(&mut hypotheses[most].heading_log);
    let parted_rad = parted_rad(settings);
    for k in (0..hypotheses.len()).filter(|k| *k != most) {
        let mapped_rad = update(hypotheses, k);
        let hypothesis = &mut hypotheses[k];
        hypothesis.heading_log -= most_log;
        if wrapped(mapped_rad - most_rad).abs() > parted_rad {
            hypothesis.log_probability += std::mem::take(&mut hypothesis.heading_log);
        }
    }
}
