//! Places and sizes along tracks, as files of either version state them.

use super::RailMlError;
use super::xml::Item;

/// No track in one piece is longer, metres.
pub(super) const LONGEST_M: f64 = 1e6;
/// Curves of a smaller radius are none, metres.
pub(super) const LEAST_RADIUS_M: f64 = 10.0;
/// Steeper is no railway, permille.
pub(super) const MOST_GRADE_PERMILLE: f64 = 300.0;
/// Places along a track are one to within this, metres.
pub(super) const SAME_M: f64 = 0.01;
/// Coordinates of one place may be so far apart, metres.
pub(super) const SAME_POINT_M: f64 = 0.5;
/// A place may be stated to lie so far beyond its track's end, metres: places are rounded.
const BEYOND_M: f64 = 1.0;
/// `pos` of a switch may be rounded; its mileage tells the rest if it differs by less than this, metres.
const ROUNDED_M: f64 = 1.0;

/// A place along a track; fails beyond its ends.
pub(super) fn place_m(item: Item<'_>, length_m: f64, at_m: f64) -> Result<f64, RailMlError> {
    if !(-BEYOND_M..=length_m + BEYOND_M).contains(&at_m) {
        return Err(item.fault(format!(
            "lies at {at_m} m, outside its track, which is {length_m} m long"
        )));
    }
    Ok(at_m.clamp(0.0, length_m))
}

/// Where a switch lies along its track: `pos`, and the decimals of its mileage where `pos` is rounded.
pub(super) fn switch_m(item: Item<'_>, begin_mileage_m: Option<f64>) -> Result<f64, RailMlError> {
    let pos_m = item.needed_value("pos")?;
    let by_mileage_m = match (item.value("absPos")?, begin_mileage_m) {
        (Some(mileage_m), Some(begin_m)) => (mileage_m - begin_m).abs(),
        _ => return Ok(pos_m),
    };
    Ok(if (by_mileage_m - pos_m).abs() < ROUNDED_M {
        by_mileage_m
    } else {
        pos_m
    })
}
