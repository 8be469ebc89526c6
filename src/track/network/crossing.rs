//! Tracks that cross each other at one level: diamond crossings without slips.
//!
//! Neither track ends there, and no train changes from one to the other. Trains on both are in each other's way
//! where their gauges overlap. Of straight tracks that cross at an angle a, with gauges of half widths v and w, that
//! is a parallelogram, whose corners are, along the track of v and counted from the crossing,
//!
//! (+-w +- v cos a) / sin a
//!
//! away; where tracks curve, the corners are found by Newton's method, as the crossing itself is.

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests;

use super::Network;
use crate::track::{Alignment, Gauge, Place, RAIL_OFFSET_M, Stretch, TrackFrame, TrackId};
use nalgebra::{Matrix2, Vector2};
use std::collections::BTreeMap;

/// Tracks are looked at in chords of this length: 8 cm off a curve of 150 m, which hides no crossing.
const CHORD_M: f64 = 10.0;
/// A crossing is found when a step of the search is shorter.
const FOUND_M: f64 = 1e-9;
const MOST_STEPS: usize = 30;
/// Crossings closer than this, on one of the tracks, are the same; and what is so near to an end is its joint.
const SAME_M: f64 = 0.01;
/// The sides of both tracks' middles on which the corners of a crossing are, going round.
const AROUND: [[f64; 2]; 4] = [[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0]];

/// Two tracks that cross each other at one level.
///
/// ```
/// use metrotwin::track::network::Network;
/// use metrotwin::track::{Alignment, Place, PlanElement, Stretch, Track, TrackId};
/// use nalgebra::Point3;
/// use std::f64::consts::FRAC_PI_6;
/// use std::sync::Arc;
///
/// // From the origin eastwards, and across it 100 m farther on.
/// let track = |x: f64, y: f64, heading_rad| {
///     let straight = PlanElement::straight(200.0);
///     Arc::new(Track::bare("", Alignment::new(Point3::new(x, y, 0.0), heading_rad, &[straight], &[])))
/// };
/// let (y, x) = FRAC_PI_6.sin_cos();
/// let network = Network::unjoined(vec![track(0.0, 0.0, 0.0), track(100.0 - 80.0 * x, -80.0 * y, FRAC_PI_6)]);
/// let tracks = [TrackId(0), TrackId(1)];
/// let [[s_m, other_s_m]] = network.crossed_at_m(tracks)[..] else { unreachable!() };
/// assert!((s_m - 100.0).abs() < 1e-9 && (other_s_m - 80.0).abs() < 1e-9);
///
/// let crossing = network.crossing("X1", tracks, [s_m, other_s_m]).unwrap();
/// assert!((crossing.angle_rad - FRAC_PI_6).abs() < 1e-12);
/// // Gauges of 1.6 m to either side: 1.6 (1 + cos 30 deg) / sin 30 deg.
/// assert!((crossing.zone(0).to_m - 100.0 - 5.971).abs() < 1e-3);
/// // What stands 5 m before it on one track is in the way of the end of that on the other.
/// let stands = Stretch { track: TrackId(1), from_m: 75.0, to_m: 75.0 };
/// let in_way = crossing.in_way_of(stands).unwrap();
/// assert!((in_way.from_m - crossing.zone(0).from_m).abs() < 1.0 && in_way.to_m < 100.0);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Crossing {
    /// As on the map.
    pub name: String,
    /// Where it is, on each of its tracks.
    pub places: [Place; 2],
    /// Between the tracks: up to a right angle.
    pub angle_rad: f64,
    /// The most by which the heads of two rails that cross differ in height.
    pub rail_step_m: f64,
    /// Corners, as chainages of both tracks, of where gauges overlap, and of where rails cross.
    gauges: [[f64; 2]; 4],
    rails: [[f64; 2]; 4],
}

impl Crossing {
    /// Where on its first (0) or second (1) track a train is in the gauge of some place on the other one.
    pub fn zone(&self, side: usize) -> Stretch {
        self.stretch(side, &self.gauges)
    }

    /// From the first to the last place on its first (0) or second (1) track where a rail of the other one crosses
    /// a rail of it.
    pub fn rails(&self, side: usize) -> Stretch {
        self.stretch(side, &self.rails)
    }

    fn stretch(&self, side: usize, corners: &[[f64; 2]; 4]) -> Stretch {
        let (from_m, to_m) = range_of(corners.iter().map(|corner| corner[side]));
        Stretch {
            track: self.places[side].track,
            from_m,
            to_m,
        }
    }

    /// Which of its tracks this is, 0 or 1.
    pub fn side_of(&self, track: TrackId) -> Option<usize> {
        self.places.iter().position(|place| place.track == track)
    }

    /// The stretch of its other track in whose gauge is what takes up all of the gauge on a stretch of one of its
    /// tracks.
    pub fn in_way_of(&self, stretch: Stretch) -> Option<Stretch> {
        let side = self.side_of(stretch.track)?;
        let corners = self.gauges.map(|corner| [corner[side], corner[1 - side]]);
        // Along an edge both chainages are linear.
        let edges = (0..4).map(|k| (corners[k], corners[(k + 1) % 4]));
        let ends = edges.filter_map(|([a, near], [b, far])| {
            let (from_m, to_m) = (stretch.from_m.max(a.min(b)), stretch.to_m.min(a.max(b)));
            let share = |s_m: f64| Some((s_m - a) / (b - a)).filter(|share| share.is_finite());
            // The far end of an edge that is square to the stretch is the near one of the next.
            let on_other_m = |s_m: f64| near + (far - near) * share(s_m).unwrap_or(0.0);
            (from_m <= to_m).then(|| [from_m, to_m].map(on_other_m))
        });
        let (from_m, to_m) = range_of(ends.flatten());
        (from_m <= to_m).then_some(Stretch {
            track: self.places[1 - side].track,
            from_m,
            to_m,
        })
    }
}

/// The least and the most; from above to below where there is none.
fn range_of(numbers: impl Iterator<Item = f64>) -> (f64, f64) {
    numbers.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), m| {
        (low.min(m), high.max(m))
    })
}

impl Network {
    /// The same network with crossings on its tracks.
    #[must_use]
    pub fn with_crossings(self, crossings: Vec<Crossing>) -> Self {
        Self { crossings, ..self }
    }

    /// Where two tracks cross each other in plan, as chainages of both, up the first one. Where they meet at an end
    /// of either they do not cross.
    pub fn crossed_at_m(&self, tracks: [TrackId; 2]) -> Vec<[f64; 2]> {
        let [Some(a), Some(b)] = tracks.map(|track| self.alignment(track)) else {
            return Vec::new();
        };
        let lines = [a, b];
        let [chords, others] = lines.map(chords);
        let mut cells: BTreeMap<(i64, i64), Vec<&Chord>> = BTreeMap::new();
        for other in &others {
            cells.entry(other.cell()).or_default().push(other);
        }
        let near = chords.iter().flat_map(|chord| {
            let (i, j) = chord.cell();
            let around = (i - 1..=i + 1).flat_map(move |i| (j - 1..=j + 1).map(move |j| (i, j)));
            let others = around.filter_map(|cell| cells.get(&cell)).flatten();
            others.filter_map(|other| chord.crosses(other))
        });
        let inside = |at_m: &[f64; 2]| {
            let both = lines.iter().zip(at_m);
            let mut inside =
                both.map(|(line, s_m)| (SAME_M..line.length_m() - SAME_M).contains(s_m));
            inside.all(|is| is)
        };
        let found = near.filter_map(|near_m| meet(lines, [0.0; 2], near_m));
        let mut found: Vec<[f64; 2]> = found.filter(inside).collect();
        found.sort_by(|a, b| a[0].total_cmp(&b[0]));
        found.dedup_by(|a, b| (a[0] - b[0]).abs() < SAME_M);
        found
    }

    /// A crossing of two tracks near chainages of theirs; none where they do not cross there, or do not part to both
    /// sides.
    pub fn crossing(&self, name: &str, tracks: [TrackId; 2], near_m: [f64; 2]) -> Option<Crossing> {
        let lines = [self.alignment(tracks[0])?, self.alignment(tracks[1])?];
        let at_m = meet(lines, [0.0; 2], near_m)?;
        let frames = [lines[0].at(at_m[0]), lines[1].at(at_m[1])];
        let across = frames[0].ahead().xy().perp(&frames[1].ahead().xy());
        let along = frames[0].ahead().dot(&frames[1].ahead());
        let rails = corners(lines, [RAIL_OFFSET_M; 2], at_m)?;
        let inner = corners(lines, half_widths_m(lines, &[at_m]), at_m)?;
        // A track may be more curved there than in the middle.
        let gauges = corners(lines, half_widths_m(lines, &inner), at_m)?;
        let place = |k: usize| Place {
            track: tracks[k],
            s_m: at_m[k],
        };
        Some(Crossing {
            name: name.to_owned(),
            places: [place(0), place(1)],
            angle_rad: across.abs().atan2(along.abs()),
            rail_step_m: rail_step_m(lines, &rails),
            gauges,
            rails,
        })
    }
}

/// Half of the widest gauge of each line at some places on both.
fn half_widths_m(lines: [&Alignment; 2], places_m: &[[f64; 2]]) -> [f64; 2] {
    [0, 1].map(|k| {
        let curvatures = places_m
            .iter()
            .map(|at_m| lines[k].at(at_m[k]).curvature_per_m);
        let widths = curvatures.map(|curvature| Gauge::b1(curvature).widest_m());
        widths.fold(0.0, f64::max)
    })
}

/// Where lines beside two others meet, to both sides of each of those.
fn corners(lines: [&Alignment; 2], beside_m: [f64; 2], at_m: [f64; 2]) -> Option<[[f64; 2]; 4]> {
    let mut corners = [at_m; 4];
    for (corner, sides) in corners.iter_mut().zip(AROUND) {
        *corner = meet(lines, [0, 1].map(|k| sides[k] * beside_m[k]), at_m)?;
    }
    Some(corners)
}

/// The most by which heads of rails differ in height where they cross.
fn rail_step_m(lines: [&Alignment; 2], rails: &[[f64; 2]; 4]) -> f64 {
    let head_m =
        |frame: TrackFrame, side: f64| frame.origin.z + side * RAIL_OFFSET_M * frame.roll_rad.sin();
    let steps = rails.iter().zip(AROUND).map(|(at_m, sides)| {
        let [a, b] = [0, 1].map(|k| head_m(lines[k].at(at_m[k]), sides[k]));
        (a - b).abs()
    });
    steps.fold(0.0, f64::max)
}

/// The chainages at which a line so far to the left of one alignment meets such a line of another one, in plan, near
/// two chainages. Newton's method: up a line that is l to the left of a curve of curvature k, a metre of chainage is
/// 1 - k l long.
fn meet(lines: [&Alignment; 2], left_m: [f64; 2], near_m: [f64; 2]) -> Option<[f64; 2]> {
    let mut at_m = near_m;
    for _ in 0..MOST_STEPS {
        let frames = [lines[0].at(at_m[0]), lines[1].at(at_m[1])];
        let [point, other] = [0, 1].map(|k| frames[k].world_from_section(left_m[k], 0.0).xy());
        let up = |k: usize| {
            let frame = &frames[k];
            frame.ahead().xy() * (1.0 - frame.curvature_per_m * left_m[k])
        };
        let effect = Matrix2::from_columns(&[up(0), -up(1)]);
        let step_m = effect.try_inverse()? * (other - point);
        at_m = [at_m[0] + step_m.x, at_m[1] + step_m.y];
        if step_m.amax() < FOUND_M {
            return Some(at_m);
        }
    }
    None
}

/// A straight between two places of a line.
struct Chord {
    s_m: f64,
    length_m: f64,
    begin: Vector2<f64>,
    way: Vector2<f64>,
}

/// A line in chords of equal lengths.
fn chords(line: &Alignment) -> Vec<Chord> {
    let count = (line.length_m() / CHORD_M).ceil().max(1.0);
    let length_m = line.length_m() / count;
    let chord = |k: u32| {
        let s_m = length_m * f64::from(k);
        let [begin, end] = [s_m, s_m + length_m].map(|s_m| line.at(s_m).origin.xy().coords);
        Chord {
            s_m,
            length_m,
            begin,
            way: end - begin,
        }
    };
    (0..count as u32).map(chord).collect()
}

impl Chord {
    /// Where it begins, on a grid on which chords that cross begin in one cell or in neighbours.
    fn cell(&self) -> (i64, i64) {
        let along = |m: f64| (m / (2.0 * CHORD_M)).floor() as i64;
        (along(self.begin.x), along(self.begin.y))
    }

    /// The chainages at which it crosses another one, about; none where it does not, or lies along it.
    fn crosses(&self, other: &Self) -> Option<[f64; 2]> {
        let to = other.begin - self.begin;
        let across = self.way.perp(&other.way);
        let shares = [to.perp(&other.way) / across, to.perp(&self.way) / across];
        let is_on = shares.iter().all(|share| (0.0..=1.0).contains(share));
        is_on.then(|| {
            [
                self.s_m + shares[0] * self.length_m,
                other.s_m + shares[1] * other.length_m,
            ]
        })
    }
}
