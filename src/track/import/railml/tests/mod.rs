//! Readers of railML, by drawn files and by files of others.

mod hostile;
mod layout;
mod recorded;
mod v2;
mod v2_wrong;
mod v3;
mod v3_wrong;

use crate::track::Direction;
use crate::track::import::ImportedMap;
use crate::track::plan::ElementEnd;

/// How far apart ends are at most that are joined.
fn joints_apart_m(map: &ImportedMap) -> f64 {
    let place = |end: ElementEnd| {
        let element = &map.network.elements[end.element];
        match end.way {
            Direction::Down => element.at(0.0).0,
            Direction::Up => element.at(element.length_m()).0,
        }
    };
    let ends = (0..map.network.elements.len()).flat_map(|element| {
        [Direction::Down, Direction::Up].map(|way| ElementEnd { element, way })
    });
    let pairs = ends.flat_map(|end| {
        let next = map.network.onward(end).iter();
        next.map(move |next| (end, next.opposite()))
    });
    let gaps = pairs.map(|(a, b)| (place(a) - place(b)).norm());
    gaps.fold(0.0, f64::max)
}
