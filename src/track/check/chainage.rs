//! What a track file says of stated chainages.

use crate::settings::Checker;
use crate::track::file::{ChainageEquationEntry, StatedChainageEntry, TrackEntry};
use crate::track::{ChainageEquation, StatedChainage};

/// Texts are written to the millimetre: smaller jumps could not be told.
const LEAST_M: f64 = 1e-3;
/// Plans round what is stated at an equation to a centimetre.
const BACK_ERROR_M: f64 = 5e-3;
/// Longer prefixes are words.
const LONGEST_PREFIX: usize = 8;

/// Chainages that a track states, if it does.
pub(super) fn stated(
    entry: &TrackEntry,
    length_m: f64,
    check: &mut Checker<'_>,
) -> Option<StatedChainage> {
    let entry = entry.stated_chainage.as_ref()?;
    let check = &mut check.below("stated_chainage");
    check_prefix(&entry.prefix, check);
    let stated = StatedChainage::of(entry, length_m);
    let in_order = check_order(entry, length_m, check);
    if in_order {
        for (k, (equation, jump)) in entry.equations.iter().zip(stated.equations()).enumerate() {
            check_jump(
                equation,
                &jump,
                &mut check.below(&format!("equations[{k}]")),
            );
        }
    }
    Some(stated)
}

fn check_prefix(prefix: &str, check: &mut Checker<'_>) {
    let letters = prefix.chars().all(char::is_alphabetic);
    if !letters || prefix == "km" || prefix.chars().count() > LONGEST_PREFIX {
        check.problem(
            "prefix",
            format!("\"{prefix}\" is no prefix: chainages could not be read"),
            format!(
                "give up to {LONGEST_PREFIX} letters, like \"DK\", or leave it out for km 12.340"
            ),
        );
    }
}

/// Equations are on the track, one after the other.
fn check_order(entry: &StatedChainageEntry, length_m: f64, check: &mut Checker<'_>) -> bool {
    let mut before_m = 0.0;
    let mut in_order = true;
    for (k, equation) in entry.equations.iter().enumerate() {
        let at_m = equation.chainage_m;
        let inside = (before_m + LEAST_M..=length_m - LEAST_M).contains(&at_m);
        if !inside {
            in_order = false;
            check.problem(
                &format!("equations[{k}].chainage_m"),
                format!("{at_m} m is not between {before_m} and {length_m} m, counted from the track's begin"),
                "put equations inside the track, in order; what is stated at its begin is `start_m`",
            );
        } else {
            before_m = at_m;
        }
    }
    in_order
}

/// An equation goes on from what is stated before it, and jumps.
fn check_jump(equation: &ChainageEquationEntry, jump: &ChainageEquation, check: &mut Checker<'_>) {
    let back_m = equation.back_m.unwrap_or(jump.back_m);
    if (back_m - jump.back_m).abs() > BACK_ERROR_M {
        check.problem(
            "back_m",
            format!("{back_m} m is not what is stated up to here: {:.3} m", jump.back_m),
            "correct the equation's `chainage_m` or what is stated before it, or leave `back_m` out",
        );
    }
    if jump.longer_m.abs() < LEAST_M {
        check.problem(
            "ahead_m",
            format!(
                "{} m is what is stated up to here too: nothing jumps",
                jump.ahead_m
            ),
            "take the equation out, or give what is stated from here on",
        );
    }
}
