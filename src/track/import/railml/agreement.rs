//! Which known places along a track agree with each other.
//!
//! Two places agree where the distance between them is what the track's length between them lets it be. The set of
//! places is chosen in which each agrees with the next, and which weighs most less what is left of disagreement.

use nalgebra::Point2;

/// A place agrees with one of so many chosen before it.
const LOOK_BACK: usize = 40;
/// Distances and lengths differ by so much: survey, and lengths along rising or curved track.
const TOLERANCE_M: f64 = 0.5;
/// And by this part of the length.
const TOLERANCE: f64 = 0.005;
/// Where no curvature is stated, a curve may be so much longer than its chord: that of a half circle is.
const SHORTEST_CHORD: f64 = 0.6;

/// A place that a track runs through, and how much it is to be trusted.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TrackSpot {
    /// Along the track, as stated, metres.
    pub(super) at_m: f64,
    pub(super) place: Point2<f64>,
    pub(super) weight: u32,
    /// Track that states it, by number.
    pub(super) source: usize,
}

/// How well two places agree that are so far apart along a track, whose stated curvature gives this chord, if it is
/// stated: from 0, as they should be, to 1; none: they do not.
pub(super) fn agree([a, b]: [&TrackSpot; 2], chord_m: Option<f64>) -> Option<f64> {
    let (length_m, found_m) = ((b.at_m - a.at_m).abs(), (b.place - a.place).norm());
    let tolerance_m = TOLERANCE_M + TOLERANCE * length_m;
    let [least_m, most_m] = match chord_m {
        Some(chord_m) => [chord_m, chord_m],
        None => [SHORTEST_CHORD * length_m, length_m],
    };
    let off_m = (least_m - found_m).max(found_m - most_m).max(0.0);
    (off_m <= tolerance_m).then_some(off_m / tolerance_m)
}

/// Numbers of the places that agree, of places in their order along the track.
pub(super) fn agreeing(
    spots: &[TrackSpot],
    agree: impl Fn([&TrackSpot; 2]) -> Option<f64>,
) -> Vec<usize> {
    // Of each: worth of the best chain that ends there, and the place before it in that chain.
    let mut best: Vec<(f64, Option<usize>)> = Vec::with_capacity(spots.len());
    for (number, spot) in spots.iter().enumerate() {
        let own = f64::from(spot.weight);
        let mut found = (own, None);
        let before = best
            .iter()
            .zip(spots)
            .enumerate()
            .skip(number.saturating_sub(LOOK_BACK));
        for (k, ((worth, _), earlier)) in before {
            if let Some(off) = agree([earlier, spot]) {
                let sum = worth + own - off;
                if sum > found.0 {
                    found = (sum, Some(k));
                }
            }
        }
        best.push(found);
    }
    let end = best
        .iter()
        .enumerate()
        .rev()
        .max_by(|a, b| a.1.0.total_cmp(&b.1.0));
    let mut chosen: Vec<usize> = Vec::new();
    let mut next = end.map(|(k, _)| k);
    while let Some(k) = next {
        chosen.push(k);
        next = best.get(k).and_then(|(_, before)| *before);
    }
    chosen.reverse();
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spot(at_m: f64, x: f64, weight: u32) -> TrackSpot {
        TrackSpot {
            at_m,
            place: Point2::new(x, 0.0),
            weight,
            source: 0,
        }
    }

    #[test]
    fn places_that_lie_off_are_not_chosen() {
        let straight =
            |pair: [&TrackSpot; 2]| agree(pair, Some((pair[1].at_m - pair[0].at_m).abs()));
        let spots = [
            spot(0.0, 0.0, 2),
            spot(100.0, 100.2, 1),
            spot(150.0, 130.0, 1),
            spot(300.0, 299.5, 2),
        ];
        assert_eq!(agreeing(&spots, straight), [0, 1, 3]);
        // One that all others contradict loses, however much it weighs alone.
        let spots = [
            spot(0.0, 500.0, 3),
            spot(100.0, 100.0, 2),
            spot(200.0, 200.0, 2),
        ];
        assert_eq!(agreeing(&spots, straight), [1, 2]);
        // Two that agree with each other, and just so with those far from them, weigh less than one that is exact.
        let spots = [
            spot(0.0, 0.0, 1),
            spot(250.0, 250.0, 1),
            spot(370.0, 368.0, 1),
            spot(400.0, 398.0, 1),
            spot(800.0, 800.0, 1),
        ];
        assert_eq!(agreeing(&spots, straight), [0, 1, 4]);
        // Of two that contradict each other, the first.
        assert_eq!(
            agreeing(&[spot(0.0, 0.0, 1), spot(100.0, 50.0, 1)], straight),
            [0]
        );
        assert!(agreeing(&[], straight).is_empty());
    }

    #[test]
    fn a_chord_is_never_longer_than_the_track() {
        let pair = |x| [spot(0.0, 0.0, 1), spot(100.0, x, 1)];
        for (x, chord_m, ok) in [
            (100.0, None, true),
            (101.1, None, false),
            (70.0, None, true),
            (50.0, None, false),
            (70.0, Some(71.0), true),
            (70.0, Some(100.0), false),
        ] {
            let [a, b] = pair(x);
            assert_eq!(agree([&a, &b], chord_m).is_some(), ok, "{x} {chord_m:?}");
        }
    }
}
