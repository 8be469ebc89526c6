//! What lies along a track, cut where the track is.

use crate::track::Direction;
use crate::track::import::{AlongElement, MapSpeed};

/// Values at a cut to within this are at it, metres.
const SAME_M: f64 = 1e-6;

impl AlongElement {
    /// In the order along the track, with tunnels that touch made one.
    pub(super) fn sort(&mut self) {
        for steps in [
            &mut self.curvatures,
            &mut self.cants_mm,
            &mut self.grades_permille,
        ] {
            steps.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        self.speeds.sort_by(|a, b| a.from_m.total_cmp(&b.from_m));
        self.balises.sort_by(|a, b| a.1.total_cmp(&b.1));
        self.signals.sort_by(|a, b| a.along_m.total_cmp(&b.along_m));
        self.tunnels_m.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let mut tunnels: Vec<[f64; 2]> = Vec::new();
        for tunnel in &self.tunnels_m {
            match tunnels.last_mut().filter(|last| last[1] >= tunnel[0]) {
                Some(last) => last[1] = last[1].max(tunnel[1]),
                None => tunnels.push(*tunnel),
            }
        }
        self.tunnels_m = tunnels;
    }

    /// What of it lies from one place to another, of a sorted one; `along` gives the distance from the first. The last
    /// piece has what is at its end.
    pub(super) fn piece(
        &self,
        [from_m, to_m]: [f64; 2],
        is_last: bool,
        along: &impl Fn(f64) -> f64,
    ) -> Self {
        let inside = |at_m: f64| from_m <= at_m && (at_m < to_m || is_last && at_m <= to_m);
        let steps = |steps: &[(f64, f64)]| -> Vec<(f64, f64)> {
            let after = steps.partition_point(|step| step.0 <= from_m + SAME_M);
            let held = after.checked_sub(1).and_then(|k| steps.get(k));
            let ahead = steps.get(after..).unwrap_or_default().iter();
            let ahead = ahead.take_while(|step| step.0 < to_m - SAME_M);
            let held = held.map(|(_, value)| (0.0, *value));
            held.into_iter()
                .chain(ahead.map(|(at_m, value)| (along(*at_m), *value)))
                .collect()
        };
        let of = |from: usize, place: &dyn Fn(usize) -> Option<f64>| {
            (from..)
                .take_while(move |k| place(*k).is_some_and(inside))
                .collect::<Vec<_>>()
        };
        let balises = of(self.balises.partition_point(|b| b.1 < from_m), &|k| {
            self.balises.get(k).map(|b| b.1)
        });
        let signals = of(self.signals.partition_point(|s| s.along_m < from_m), &|k| {
            self.signals.get(k).map(|s| s.along_m)
        });
        let tunnels = self.tunnels_m.partition_point(|t| t[1] <= from_m);
        let tunnels = self.tunnels_m.get(tunnels..).unwrap_or_default().iter();
        let tunnels = tunnels.take_while(|t| t[0] < to_m);
        Self {
            buffers: [self.buffers[0] && from_m <= 0.0, self.buffers[1] && is_last],
            curvatures: steps(&self.curvatures),
            cants_mm: steps(&self.cants_mm),
            grades_permille: steps(&self.grades_permille),
            speeds: self.speeds_in([from_m, to_m], along),
            balises: balises
                .into_iter()
                .filter_map(|k| self.balises.get(k))
                .map(|(name, at_m)| (name.clone(), along(*at_m)))
                .collect(),
            signals: signals
                .into_iter()
                .filter_map(|k| self.signals.get(k))
                .map(|signal| {
                    let mut signal = signal.clone();
                    signal.along_m = along(signal.along_m);
                    signal
                })
                .collect(),
            tunnels_m: tunnels
                .map(|t| [along(t[0].max(from_m)), along(t[1].min(to_m))])
                .collect(),
            name: self.name.clone(),
            stated_m: self.stated_m,
            one_way: self.one_way,
            line: self.line,
        }
    }

    /// A speed holds from its place on in its direction of running, until the next one for that direction.
    fn speeds_in(&self, [from_m, to_m]: [f64; 2], along: &impl Fn(f64) -> f64) -> Vec<MapSpeed> {
        let first = self.speeds.partition_point(|s| s.from_m <= from_m + SAME_M);
        let last = self.speeds.partition_point(|s| s.from_m < to_m - SAME_M);
        let part = |range: std::ops::Range<usize>| self.speeds.get(range).unwrap_or_default();
        let (before, within, after) = (
            part(0..first),
            part(first..last.max(first)),
            part(last.max(first)..self.speeds.len()),
        );
        let held = |way| {
            let held = before.iter().rev().find(|speed| speed.way == way);
            held.map(|speed| MapSpeed {
                from_m: 0.0,
                ..speed.clone()
            })
        };
        let down = Some(Direction::Down);
        let entered = after.iter().find(|speed| speed.way == down);
        let entered = entered.map(|speed| MapSpeed {
            from_m: along(to_m),
            ..speed.clone()
        });
        let within = within.iter().map(|speed| MapSpeed {
            from_m: along(speed.from_m),
            ..speed.clone()
        });
        let held = [None, Some(Direction::Up)].into_iter().filter_map(held);
        held.chain(within).chain(entered).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::import::MapSignal;

    fn speed(from_m: f64, kmh: f64, way: Option<Direction>) -> MapSpeed {
        MapSpeed { from_m, kmh, way }
    }

    /// Cut at 100 m: every step is held over the cut in its direction, every thing is on one side of it.
    #[test]
    fn pieces_have_what_holds_where_they_begin() {
        let (up, down) = (Some(Direction::Up), Some(Direction::Down));
        let mut all = AlongElement {
            grades_permille: vec![(120.0, 7.0), (0.0, 5.0)],
            curvatures: vec![(100.0, 1e-3)],
            speeds: vec![
                speed(150.0, 60.0, down),
                speed(120.0, 70.0, up),
                speed(0.0, 40.0, up),
                speed(50.0, 80.0, up),
                speed(90.0, 30.0, down),
            ],
            balises: vec![("b".to_owned(), 100.0), ("a".to_owned(), 20.0)],
            signals: vec![MapSignal {
                name: "s".to_owned(),
                along_m: 200.0,
                way: Direction::Up,
            }],
            tunnels_m: vec![[90.0, 130.0], [60.0, 95.0]],
            ..AlongElement::default()
        };
        all.sort();
        let first = all.piece([0.0, 100.0], false, &|at_m| at_m);
        let second = all.piece([100.0, 200.0], true, &|at_m| (at_m - 100.0) * 2.0);
        assert_eq!(first.grades_permille, [(0.0, 5.0)]);
        assert_eq!(second.grades_permille, [(0.0, 5.0), (40.0, 7.0)]);
        assert!(first.curvatures.is_empty());
        assert_eq!(second.curvatures, [(0.0, 1e-3)]);
        assert_eq!(
            first.speeds,
            [
                speed(0.0, 40.0, up),
                speed(50.0, 80.0, up),
                speed(90.0, 30.0, down),
                speed(100.0, 60.0, down)
            ]
        );
        assert_eq!(
            second.speeds,
            [
                speed(0.0, 80.0, up),
                speed(40.0, 70.0, up),
                speed(100.0, 60.0, down)
            ]
        );
        assert_eq!(first.balises, [("a".to_owned(), 20.0)]);
        assert_eq!(second.balises, [("b".to_owned(), 0.0)]);
        assert_eq!((first.signals.len(), second.signals.len()), (0, 1));
        assert_eq!(first.tunnels_m, [[60.0, 100.0]]);
        assert_eq!(second.tunnels_m, [[0.0, 60.0]]);
    }
}
