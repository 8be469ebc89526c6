//! Turn-outs: how their legs part, and how fast the diverging one may be run.

use super::joints::end_word;
use crate::settings::Checker;
use crate::track::CANT_BASE_M;
use crate::track::network::{Network, Switch, TrackEnd};

/// Legs that part by less curvature than this do not part: a radius of 20 km.
const LEAST_PARTING_PER_M: f64 = 5e-5;
/// Lateral acceleration in the plane of the rails that passengers are to feel at most: a cant deficiency of 100 mm
/// (EN 13803, normal limit on turn-outs).
const MOST_LATERAL_MPS2: f64 = 0.65;
const GRAVITY_MPS2: f64 = 9.81;

/// Problems of the switches of a network, whose entries in the file are in the same order.
pub(super) fn check_switches(network: &Network, check: &mut Checker<'_>) {
    for (k, switch) in network.switches.iter().enumerate() {
        let key = format!("switches[{k}]");
        check_parting(network, switch, &key, check);
        check_speed(network, switch, &key, check);
        if network
            .clearance_m(switch, network.clear_apart_m(switch))
            .is_none()
        {
            let name = &switch.name;
            check.problem(
                &format!("{key}.name"),
                format!(
                    "the legs of `{name}` are nowhere {:.2} m apart, so that no train on one is clear of the other",
                    network.clear_apart_m(switch)
                ),
                "make the legs longer, or let them part more",
            );
        }
    }
}

fn check_parting(network: &Network, switch: &Switch, key: &str, check: &mut Checker<'_>) {
    let (Some(through), Some(diverging)) = (
        network.entered(switch.through),
        network.entered(switch.diverging),
    ) else {
        return;
    };
    let [through_per_m, diverging_per_m] = [through, diverging].map(|f| f.curvature_per_m);
    let problem = if (diverging_per_m - through_per_m).abs() < LEAST_PARTING_PER_M {
        Some("both its legs begin with the same curvature, and do not part")
    } else if through_per_m.abs() > diverging_per_m.abs() {
        Some("its through leg turns more than its diverging one")
    } else {
        None
    };
    if let Some(what) = problem {
        let word = |end: TrackEnd| end_word(end, &network.tracks[usize::from(end.track.0)].name);
        let remedy = format!(
            "let the leg of `{}` begin with an arc, and that of `{}` go on as the track before the toe",
            word(switch.diverging),
            word(switch.through)
        );
        check.problem(&format!("{key}.name"), what, remedy);
    }
}

fn check_speed(network: &Network, switch: &Switch, key: &str, check: &mut Checker<'_>) {
    let Some(leg) = network.entered(switch.diverging) else {
        return;
    };
    let cant_m = -CANT_BASE_M * leg.roll_rad.sin() * leg.curvature_per_m.signum();
    let lateral_mps2 = |speed_mps: f64| {
        speed_mps * speed_mps * leg.curvature_per_m.abs() - GRAVITY_MPS2 * cant_m / CANT_BASE_M
    };
    let felt_mps2 = lateral_mps2(switch.diverging_mps);
    if felt_mps2 > MOST_LATERAL_MPS2 {
        let most_mps2 = MOST_LATERAL_MPS2 + GRAVITY_MPS2 * cant_m / CANT_BASE_M;
        let most_mps = (most_mps2 / leg.curvature_per_m.abs()).sqrt();
        check.problem(
            &format!("{key}.diverging_kmh"),
            format!(
                "passengers feel {felt_mps2:.2} m/s^2 to the side at {:.0} km/h on a radius of {:.0} m, and \
                 {MOST_LATERAL_MPS2} are permitted",
                3.6 * switch.diverging_mps,
                1.0 / leg.curvature_per_m.abs()
            ),
            format!("permit at most {:.0} km/h, or lay a wider arc", (3.6 * most_mps).floor()),
        );
    }
}
