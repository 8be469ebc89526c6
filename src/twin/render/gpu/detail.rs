//! How finely the tunnel is cut into cells.

use super::bend::Bend;
use crate::track::{OutlinePoint, SectionRange, TrackPoint};
use crate::twin::render::surface;

/// Length of a chunk: a whole number of rings, and a whole part of a painting's period.
pub const CHUNK_M: f64 = 5.0;

/// Ends of the ranges of detail.
const NEAR_M: f64 = 6.0;
const CLOSE_M: f64 = 20.0;
const MIDDLE_M: f64 = 60.0;

/// How finely a chunk is meshed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Detail {
    /// Every ring halved: where the rolling shutter or the lens bends what is straight.
    Near,
    /// Ring by ring.
    Close,
    /// Half a chunk at a time: a chord that long is under 3 mm off a curve of 300 m.
    Middle,
    /// From end to end.
    Far,
}

impl Detail {
    /// How fine a chunk is drawn whose nearest end is so far from a camera that bends what is
    /// straight, by its motion or its lens, or does not.
    pub fn at(away_m: f64, bent: bool) -> Self {
        match away_m {
            ..NEAR_M if bent => Self::Near,
            ..CLOSE_M => Self::Close,
            ..MIDDLE_M => Self::Middle,
            _ => Self::Far,
        }
    }

    /// A chunk is at least so far from the camera along the line.
    fn nearest_m(self) -> f64 {
        match self {
            Self::Near => 0.0,
            Self::Close => NEAR_M,
            Self::Middle => CLOSE_M,
            Self::Far => MIDDLE_M,
        }
    }

    pub fn step_m(self) -> f64 {
        match self {
            Self::Near => 0.5 * surface::RING_M,
            Self::Close => surface::RING_M,
            Self::Middle => 0.5 * CHUNK_M,
            Self::Far => CHUNK_M,
        }
    }

    /// A cell of the mesh is halved until it is smaller than this share of its distance from the
    /// nearest lamp, since light falls with a power of that distance and is interpolated over the
    /// cell; but it never gets smaller than this, which is 6 to 12 pixels of the usual cameras.
    fn finest(self) -> (f64, f64) {
        match self {
            Self::Near => (0.25, 0.06),
            Self::Close => (0.3, 0.15),
            Self::Middle => (0.5, 0.4),
            Self::Far => (1.0, CHUNK_M),
        }
    }
}

/// Which mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ChunkKey {
    /// Covers chainage from `index * CHUNK_M` over `CHUNK_M`.
    pub index: i64,
    /// How fine.
    pub detail: Detail,
    /// Finer still before a lens that bends lines.
    pub bend: Option<Bend>,
}

impl ChunkKey {
    /// Whether a cell is short enough for the camera's lens, which is so far across the line from it.
    pub fn is_fine(&self, cell_m: f64, across_m: impl Fn(&TrackPoint) -> f64) -> bool {
        self.bend.is_none_or(|bend| {
            let across_m = across_m(&bend.eye());
            cell_m <= bend.cell_m(self.detail.nearest_m().hypot(across_m))
        })
    }

    /// Chainage of its origin.
    pub fn start_m(self) -> f64 {
        self.index as f64 * CHUNK_M
    }
}

/// Whether light varies little over a cell this long, this far from a lamp.
pub fn is_fine(cell_m: f64, away_m: f64, detail: Detail) -> bool {
    let (share, least_m) = detail.finest();
    cell_m <= share * away_m || cell_m < 2.0 * least_m
}

/// Halves the interval `[from, to]` until every piece `fits`; puts the ends of the pieces into
/// `cuts`, all but the first. Cuts of coarser pieces are among those of finer ones.
pub fn halve(from: f64, to: f64, fits: &impl Fn(f64, f64) -> bool, cuts: &mut Vec<f64>) {
    if fits(from, to) {
        cuts.push(to);
        return;
    }
    let middle = 0.5 * (from + to);
    halve(from, middle, fits, cuts);
    halve(middle, to, fits, cuts);
}

/// Ends of the range inside the chunk, and all multiples of `step_m` between them.
pub fn stations(range: &SectionRange, from_m: f64, to_m: f64, step_m: f64) -> Vec<f64> {
    let (from, to) = (from_m.max(range.from_m), to_m.min(range.to_m));
    if to <= from {
        return Vec::new();
    }
    let first = (from / step_m).floor() as i64 + 1;
    let last = (to / step_m).ceil() as i64;
    let inside = (first..last).map(|k| k as f64 * step_m);
    std::iter::once(from).chain(inside).chain([to]).collect()
}

/// The stations, with more of them where the line through `at` passes lamps. What shares the line
/// shares its stations, so that no gap opens between strips of different fineness.
pub fn finer_stations(
    stations: &[f64],
    at: OutlinePoint,
    near: &[TrackPoint],
    key: ChunkKey,
) -> Vec<f64> {
    let mut finer = vec![stations[0]];
    let across_m = |from: &TrackPoint| (at.l_m - from.l_m).hypot(at.h_m - from.h_m);
    for pair in stations.windows(2) {
        let fits = |from_m: f64, to_m: f64| {
            let lit_evenly = near.iter().all(|lamp| {
                let along_m = (from_m - lamp.s_m).max(lamp.s_m - to_m).max(0.0);
                is_fine(to_m - from_m, along_m.hypot(across_m(lamp)), key.detail)
            });
            lit_evenly && key.is_fine(to_m - from_m, across_m)
        };
        halve(pair[0], pair[1], &fits, &mut finer);
    }
    finer
}
