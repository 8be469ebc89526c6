//! Scattering centres of lining and track, ahead of a radar along its own route.
//!
//! Every ring of the lining has centres along its outline: its joints with their bolts and steps, and the rough
//! concrete between them, per area gamma times the sine of the grazing angle. Every sleeper has one centre, with its
//! fastenings. Each centre has a strength and a phase of its own, drawn once from an exponential law: it is always the
//! same there. Rails are smooth and met along: they scatter by their fastenings alone.
//!
//! **No measured clutter of a metro tunnel at 77 GHz is published.** The numbers are settings, to be varied over at least
//! 10 dB either way; the defaults are of the order of rough concrete roads at grazing angles.
//!
//! Not modelled: other tracks of the same cavern, cables, lamps and signals on the walls, platform doors, water.

use super::Centre;
use crate::settings::settings;
use crate::track::{BED_M, CrossSection, Material, Track};
use crate::twin::random::Stream;
use nalgebra::{Point3, Vector3};
use std::f64::consts::TAU;

settings! {
    /// How the surroundings echo. No measured values are known: vary them.
    #[derive(Copy)]
    pub struct ClutterSettings {
        /// From joint to joint of the lining's rings or ribs, m.
        ring_m: f64 = 1.5, in 0.3..=50.0;
        /// Mean cross-section of a joint, for each metre of outline, m^2.
        joint_m2: f64 = 0.02, in 0.0..=100.0;
        /// Cross-section of the wall by area, over the sine of the grazing angle, dB.
        wall_gamma_db: f64 = -25.0, in -100.0..=20.0;
        /// From sleeper to sleeper, m.
        sleeper_m: f64 = 0.6, in 0.3..=5.0;
        /// Mean cross-section of a sleeper with its fastenings, m^2.
        sleeper_m2: f64 = 0.01, in 0.0..=100.0;
        /// How far ahead there is any, m.
        range_m: f64 = 120.0, in 0.0..=500.0;
    }
}

/// From centre to centre along an outline.
const OUTLINE_M: f64 = 3.5;
/// Centres lie so far off the surface: a ray to them does not meet it.
const OFF_M: f64 = 0.06;
/// Half the width of the track, within which a sleeper's centre lies.
const SLEEPER_HALF_M: f64 = 0.9;
const SLEEPER_UP_M: f64 = 0.08;
/// Nearer ones are below or beside the antennas.
const NEAREST_M: f64 = 1.0;

/// A place on an outline.
#[derive(Clone, Copy)]
struct OutlineNode {
    l_m: f64,
    h_m: f64,
    /// Into the tunnel.
    normal: (f64, f64),
    /// Of the outline that it stands for.
    length_m: f64,
}

/// The centres ahead of a radar along a track: from a chainage on, up the track or down it.
pub fn clutter(
    track: &Track,
    (from_m, up): (f64, bool),
    radar: &Point3<f64>,
    settings: &ClutterSettings,
    stream: Stream,
) -> Vec<Centre> {
    let way = if up { 1.0 } else { -1.0 };
    let ends = [from_m + way * NEAREST_M, from_m + way * settings.range_m];
    let (low_m, high_m) = (
        ends[0].min(ends[1]).max(0.0),
        ends[0].max(ends[1]).min(track.alignment.length_m()),
    );
    let mut centres = Vec::new();
    for number in multiples(low_m, high_m, settings.ring_m) {
        let s_m = number as f64 * settings.ring_m;
        let Some(section) = track.section_at(s_m) else {
            continue;
        };
        for (node, k) in nodes(section).into_iter().zip(0..) {
            let key = (number as u64) << 8 | k;
            centres.extend(
                ring_centre(track, s_m, &node, radar, settings).map(|c| varied(c, stream, key)),
            );
        }
    }
    for number in multiples(low_m, high_m, settings.sleeper_m) {
        let s_m = number as f64 * settings.sleeper_m;
        let key = 1 << 40 | number as u64;
        let l_m = SLEEPER_HALF_M * (2.0 * stream.uniform(1 << 42 | key) - 1.0);
        let place = track
            .alignment
            .at(s_m)
            .world_from_section(l_m, BED_M + SLEEPER_UP_M);
        centres.push(varied(still(place, settings.sleeper_m2), stream, key));
    }
    centres
}

fn multiples(low_m: f64, high_m: f64, step_m: f64) -> std::ops::RangeInclusive<i64> {
    (low_m / step_m).ceil() as i64..=(high_m / step_m).floor() as i64
}

fn still(place: Point3<f64>, section_m2: f64) -> Centre {
    Centre {
        place,
        velocity_mps: Vector3::zeros(),
        section_m2,
        phase_rad: 0.0,
        owner: None,
    }
}

/// With a strength and a phase of its own.
fn varied(centre: Centre, stream: Stream, key: u64) -> Centre {
    Centre {
        section_m2: -centre.section_m2 * stream.uniform(2 * key).ln(),
        phase_rad: TAU * stream.uniform(2 * key + 1),
        ..centre
    }
}

/// Places along the walls of an outline.
fn nodes(section: &CrossSection) -> Vec<OutlineNode> {
    let mut nodes = Vec::new();
    let mut since_m = 0.5 * OUTLINE_M;
    let walls = section.edges().filter(|edge| {
        matches!(
            edge.material,
            Material::Lining | Material::Platform | Material::Walkway
        )
    });
    for edge in walls {
        let length_m = edge.length_m();
        while length_m > 0.0 && since_m < length_m {
            let share = since_m / length_m;
            nodes.push(OutlineNode {
                l_m: edge.a.l_m + share * (edge.b.l_m - edge.a.l_m),
                h_m: edge.a.h_m + share * (edge.b.h_m - edge.a.h_m),
                normal: edge.normal(),
                length_m: OUTLINE_M,
            });
            since_m += OUTLINE_M;
        }
        since_m -= length_m;
    }
    nodes
}

fn ring_centre(
    track: &Track,
    s_m: f64,
    node: &OutlineNode,
    radar: &Point3<f64>,
    settings: &ClutterSettings,
) -> Option<Centre> {
    let frame = track.alignment.at(s_m);
    let (across, up) = node.normal;
    let normal = frame.left() * across + Vector3::z() * up;
    let place = frame.world_from_section(node.l_m, node.h_m) + normal * OFF_M;
    let sine = (radar - place).try_normalize(1e-6)?.dot(&normal).max(0.0);
    let wall_m2 = 10f64.powf(0.1 * settings.wall_gamma_db) * settings.ring_m * node.length_m * sine;
    Some(still(place, settings.joint_m2 * node.length_m + wall_m2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::{Alignment, CrossSection, PlanElement, SectionRange};

    fn line() -> Track {
        let plan = Alignment::new(Point3::origin(), 0.0, &[PlanElement::straight(500.0)], &[]);
        let mut track = Track::bare("line", plan);
        track.sections = vec![SectionRange {
            from_m: 0.0,
            to_m: 500.0,
            missing_rail: None,
            section: CrossSection::rectangular(2.4, 2.4, 4.5, None, None),
        }];
        track
    }

    /// So many rings and sleepers, ahead of the radar alone, in the tunnel, of the mean strength that is set, the same
    /// wherever the radar is.
    #[test]
    fn clutter_stays_where_it_is() {
        let (track, stream) = (line(), Stream::new(1, 0, "clutter"));
        let settings = ClutterSettings {
            wall_gamma_db: -100.0,
            range_m: 300.0,
            ..ClutterSettings::default()
        };
        let radar = |s_m: f64| track.alignment.at(s_m).world_from_section(0.0, 1.0);
        let from = |s_m: f64, up| clutter(&track, (s_m, up), &radar(s_m), &settings, stream);
        let (here, on) = (from(100.0, true), from(103.0, true));
        let [ahead, behind] = [&here, &from(400.0, false)].map(|centres| {
            centres
                .iter()
                .map(|c| (c.place - radar(0.0)).norm())
                .collect::<Vec<_>>()
        });
        assert!(ahead.iter().all(|s| (100.9..401.0).contains(s)));
        assert!(behind.iter().all(|s| (99.0..399.2).contains(s)));
        // 2 x 4.67 m of walls and 4.8 m of ceiling: 4 nodes of 3.5 m.
        let rings = here.len() - 499;
        assert!(rings.abs_diff(4 * 200) <= 12, "{rings}");
        let total: f64 = here.iter().map(|c| c.section_m2).sum();
        let expected = 499.0 * 0.01 + rings as f64 * 3.5 * 0.02;
        // A mean of n exponentials scatters by 1 / sqrt(n).
        assert!(
            (total / expected - 1.0).abs() < 4.0 / (rings as f64).sqrt(),
            "{total} for {expected}"
        );
        let same = on.iter().filter(|c| {
            here.iter().any(|h| {
                (h.place - c.place).norm() < 1e-6
                    && (h.section_m2 / c.section_m2 - 1.0).abs() < 1e-6
            })
        });
        assert!(same.count() as f64 > 0.98 * on.len() as f64);
        for centre in &here {
            let lh = track.alignment.track_from_world(&centre.place, 200.0);
            assert!(
                lh.l_m.abs() < 2.4 && (BED_M..4.5).contains(&lh.h_m),
                "{lh:?}"
            );
        }
    }
}
