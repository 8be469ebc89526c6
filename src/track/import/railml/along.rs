//! What lies along a track, cut where the track is.

use crate::track::Direction;
use crate::track::import::{AlongElement, MapBalise, MapSpeed, MapStep};

/// Values at a cut to within this are at it, metres.
const SAME_M: f64 = 1e-6;

impl AlongElement {
    /// In the order along the track, with tunnels that touch made one.
    pub(super) fn sort(&mut self) {
        for steps in [
            &mut self.curvatures_per_m,
            &mut self.cants_mm,
            &mut self.grades_permille,
        ] {
            steps.sort_by(|a, b| a.from_m.total_cmp(&b.from_m));
        }
        self.speeds.sort_by(|a, b| a.from_m.total_cmp(&b.from_m));
        self.balises.sort_by(|a, b| a.along_m.total_cmp(&b.along_m));
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
        let steps = |steps: &[MapStep]| -> Vec<MapStep> {
            let after = steps.partition_point(|step| step.from_m <= from_m + SAME_M);
            let held = after.checked_sub(1).and_then(|k| steps.get(k));
            let ahead = steps.get(after..).unwrap_or_default().iter();
            let ahead = ahead.take_while(|step| step.from_m < to_m - SAME_M);
            let moved = |from_m: f64, step: &MapStep| MapStep { from_m, ..*step };
            let held = held.map(|step| moved(0.0, step));
            held.into_iter()
                .chain(ahead.map(|step| moved(along(step.from_m), step)))
                .collect()
        };
        let of = |from: usize, place: &dyn Fn(usize) -> Option<f64>| {
            (from..)
                .take_while(move |k| place(*k).is_some_and(inside))
                .collect::<Vec<_>>()
        };
        let balises = of(self.balises.partition_point(|b| b.along_m < from_m), &|k| {
            self.balises.get(k).map(|b| b.along_m)
        });
        let signals = of(self.signals.partition_point(|s| s.along_m < from_m), &|k| {
            self.signals.get(k).map(|s| s.along_m)
        });
        let tunnels = self.tunnels_m.partition_point(|t| t[1] <= from_m);
        let tunnels = self.tunnels_m.get(tunnels..).unwrap_or_default().iter();
        let tunnels = tunnels.take_while(|t| t[0] < to_m);
        Self {
            buffers: [self.buffers[0] && from_m <= 0.0, self.buffers[1] && is_last],
            curvatures_per_m: steps(&self.curvatures_per_m),
            cants_mm: steps(&self.cants_mm),
            grades_permille: steps(&self.grades_permille),
            speeds: self.speeds_in([from_m, to_m], along),
            balises: balises
                .into_iter()
                .filter_map(|k| self.balises.get(k))
                .map(|balise| MapBalise {
                    name: balise.name.clone(),
                    along_m: along(balise.along_m),
                })
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

    fn step(from_m: f64, value: f64) -> MapStep {
        MapStep { from_m, value }
    }

    fn balise(name: &str, along_m: f64) -> MapBalise {
        let name = name.to_owned();
        MapBalise { name, along_m }
    }

    /// Cut at 100 m: every step is held over the cut in its direction, every thing is on one side of it.
    #[test]
    fn pieces_have_what_holds_where_they_begin() {
        let (up, down) = (Some(Direction::Up), Some(Direction::Down));
        let mut all = AlongElement {
            grades_permille: vec![step(120.0, 7.0), step(0.0, 5.0)],
            curvatures_per_m: vec![step(100.0, 1e-3)],
            speeds: vec![
                speed(150.0, 60.0, down),
                speed(120.0, 70.0, up),
                speed(0.0, 40.0, up),
                speed(50.0, 80.0, up),
                speed(90.0, 30.0, down),
            ],
            balises: vec![balise("b", 100.0), balise("a", 20.0)],
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
        assert_eq!(first.grades_permille, [step(0.0, 5.0)]);
        assert_eq!(second.grades_permille, [step(0.0, 5.0), step(40.0, 7.0)]);
        assert!(first.curvatures_per_m.is_empty());
        assert_eq!(second.curvatures_per_m, [step(0.0, 1e-3)]);
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
        assert_eq!(first.balises, [balise("a", 20.0)]);
        assert_eq!(second.balises, [balise("b", 0.0)]);
        assert_eq!((first.signals.len(), second.signals.len()), (0, 1));
        assert_eq!(first.tunnels_m, [[60.0, 100.0]]);
        assert_eq!(second.tunnels_m, [[0.0, 60.0]]);
    }
}
