//! What a place is where several tracks meet, by the directions in which they leave it.
//!
//! Maps drawn by hand seldom say which of three tracks at a switch is that before its toe. Trains do not turn: from
//! the toe both legs lead on almost straight, and from a leg the other one leads back.

use nalgebra::Vector2;

/// Tracks between which a train runs on turn by less than this.
const MOST_TURN_RAD: f64 = std::f64::consts::FRAC_PI_2;

/// What it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum JunctionKind {
    /// A track ends.
    End,
    /// One track goes on as another.
    Joint,
    /// Three tracks, one of which leads to both others.
    Switch,
    /// Four tracks, each of which leads to the one straight on.
    Crossing,
    /// Four tracks, each of which leads to both on the other side.
    Slip,
    /// Some other number of tracks, or directions that make no junction: only what is almost straight on is joined.
    Unclear,
}

/// Pairs of tracks, by number, that a train runs from one to the other, of tracks that leave a place in these
/// directions (unit vectors). `slips` tells whether a map says that trains change tracks where four meet.
pub fn junction(directions: &[Vector2<f64>], slips: bool) -> (JunctionKind, Vec<(usize, usize)>) {
    match directions.len() {
        0 | 1 => (JunctionKind::End, Vec::new()),
        2 if turn_between_rad(directions, (0, 1)) < MOST_TURN_RAD => {
            (JunctionKind::Joint, vec![(0, 1)])
        }
        3 => switch(directions),
        4 => crossing(directions, slips),
        _ => (JunctionKind::Unclear, straightest(directions)),
    }
}

/// By how much a train turns that comes by one track and leaves by another.
pub(super) fn turn_between_rad(directions: &[Vector2<f64>], (a, b): (usize, usize)) -> f64 {
    (-directions[a]).angle(&directions[b])
}

fn switch(directions: &[Vector2<f64>]) -> (JunctionKind, Vec<(usize, usize)>) {
    let legs = |toe: usize| [(toe + 1) % 3, (toe + 2) % 3];
    let worst_rad = |toe: &usize| {
        let turns = legs(*toe).map(|leg| turn_between_rad(directions, (*toe, leg)));
        turns[0].max(turns[1])
    };
    let best = (0..3).min_by(|a, b| worst_rad(a).total_cmp(&worst_rad(b)));
    match best.filter(|toe| worst_rad(toe) < MOST_TURN_RAD) {
        Some(toe) => (JunctionKind::Switch, legs(toe).map(|leg| (toe, leg)).into()),
        None => (JunctionKind::Unclear, straightest(directions)),
    }
}

fn crossing(directions: &[Vector2<f64>], slips: bool) -> (JunctionKind, Vec<(usize, usize)>) {
    let partners = [1, 2, 3].map(|partner| {
        let others: Vec<usize> = (1..4).filter(|k| *k != partner).collect();
        let pairs = [(0, partner), (others[0], others[1])];
        let worst_rad = pairs.map(|pair| turn_between_rad(directions, pair));
        (pairs, worst_rad[0].max(worst_rad[1]))
    });
    let best = partners.into_iter().min_by(|a, b| a.1.total_cmp(&b.1));
    let Some((pairs, _)) = best.filter(|(_, worst_rad)| *worst_rad < MOST_TURN_RAD) else {
        return (JunctionKind::Unclear, straightest(directions));
    };
    if !slips {
        return (JunctionKind::Crossing, pairs.into());
    }
    let all = (0..4).flat_map(|a| (a + 1..4).map(move |b| (a, b)));
    let run_on = all.filter(|pair| turn_between_rad(directions, *pair) < MOST_TURN_RAD);
    (JunctionKind::Slip, run_on.collect())
}

/// Each track with the one most straight on, as long as both are free.
fn straightest(directions: &[Vector2<f64>]) -> Vec<(usize, usize)> {
    let count = directions.len();
    let mut pairs: Vec<_> = (0..count)
        .flat_map(|a| (a + 1..count).map(move |b| (a, b)))
        .collect();
    pairs.retain(|pair| turn_between_rad(directions, *pair) < MOST_TURN_RAD);
    pairs.sort_by(|a, b| {
        turn_between_rad(directions, *a).total_cmp(&turn_between_rad(directions, *b))
    });
    let mut taken = vec![false; count];
    pairs.retain(|(a, b)| {
        let free = !taken[*a] && !taken[*b];
        if free {
            (taken[*a], taken[*b]) = (true, true);
        }
        free
    });
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ways(degrees: &[f64]) -> Vec<Vector2<f64>> {
        let unit = |degrees: &f64| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            Vector2::new(cos, sin)
        };
        degrees.iter().map(unit).collect()
    }

    #[test]
    fn a_switch_has_its_legs_on_one_side() {
        // From the toe, at 180 degrees, to legs at 0 and 6 degrees, in any order.
        for (degrees, toe) in [
            ([180.0, 0.0, 6.0], 0),
            ([0.0, 180.0, 6.0], 1),
            ([6.0, 0.0, 180.0], 2),
        ] {
            let (kind, pairs) = junction(&ways(&degrees), false);
            assert_eq!(kind, JunctionKind::Switch);
            assert!(
                pairs.len() == 2 && pairs.iter().all(|(a, b)| *a == toe && *b != toe),
                "{pairs:?}"
            );
        }
        // A track that ends square against another one is no leg.
        let (kind, pairs) = junction(&ways(&[0.0, 180.0, 91.0]), false);
        assert_eq!((kind, pairs), (JunctionKind::Switch, vec![(0, 1), (0, 2)]));
        let (kind, pairs) = junction(&ways(&[0.0, 120.0, 240.0]), false);
        assert_eq!((kind, pairs.len()), (JunctionKind::Switch, 2));
        let (kind, pairs) = junction(&ways(&[0.0, 10.0, 20.0]), false);
        assert_eq!((kind, pairs.len()), (JunctionKind::Unclear, 0));
    }

    #[test]
    fn tracks_cross_straight_on() {
        let directions = ways(&[0.0, 12.0, 180.0, 192.0]);
        assert_eq!(
            junction(&directions, false),
            (JunctionKind::Crossing, vec![(0, 2), (1, 3)])
        );
        let (kind, pairs) = junction(&directions, true);
        assert_eq!(
            (kind, pairs),
            (JunctionKind::Slip, vec![(0, 2), (0, 3), (1, 2), (1, 3)])
        );
    }

    #[test]
    fn two_tracks_go_on_or_end() {
        assert_eq!(junction(&ways(&[0.0, 170.0]), false).0, JunctionKind::Joint);
        assert_eq!(
            junction(&ways(&[0.0, 20.0]), false),
            (JunctionKind::Unclear, Vec::new())
        );
        assert_eq!(junction(&ways(&[0.0]), false).0, JunctionKind::End);
    }

    /// Whatever tracks meet: no train turns by a right angle or more, and three tracks of which one leads to both
    /// others are a switch.
    #[test]
    fn no_train_turns() {
        for first in (0..360).step_by(5) {
            for second in (first..360).step_by(5) {
                let directions = ways(&[0.0, f64::from(first), f64::from(second)]);
                let (kind, pairs) = junction(&directions, false);
                let turns = pairs
                    .iter()
                    .map(|pair| turn_between_rad(&directions, *pair));
                assert!(turns.clone().all(|turn| turn < MOST_TURN_RAD));
                let has_toe = (0..3).any(|toe| {
                    let legs = [(toe + 1) % 3, (toe + 2) % 3];
                    legs.iter()
                        .all(|leg| turn_between_rad(&directions, (toe, *leg)) < MOST_TURN_RAD)
                });
                assert_eq!(kind == JunctionKind::Switch, has_toe, "{first} {second}");
                for fourth in [0, 90, 200] {
                    let four = [directions.clone(), ways(&[f64::from(fourth)])].concat();
                    for slips in [false, true] {
                        let (_, pairs) = junction(&four, slips);
                        let mut turns = pairs.iter().map(|pair| turn_between_rad(&four, *pair));
                        assert!(turns.all(|turn| turn < MOST_TURN_RAD));
                    }
                }
            }
        }
    }
}
