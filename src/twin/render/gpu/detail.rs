//! How finely the tunnel is cut into cells.

use super::bend::Bend;
use crate::track::{OutlinePoint, SectionRange, TrackPoint};
use crate::twin::geometry::STATION_STEP_M;

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

    fn cells(self) -> CellSizes {
        let [nearest_m, step_m, share_of_distance, least_m] = match self {
            Self::Near => [0.0, 0.5 * STATION_STEP_M, 0.25, 0.06],
            Self::Close => [NEAR_M, STATION_STEP_M, 0.3, 0.15],
            Self::Middle => [CLOSE_M, 0.5 * CHUNK_M, 0.5, 0.4],
            Self::Far => [MIDDLE_M, CHUNK_M, 0.5, 0.8],
        };
        CellSizes {
            nearest_m,
            step_m,
            share_of_distance,
            least_m,
        }
    }

    /// From one station of a chunk to the next.
    pub fn step_m(self) -> f64 {
        self.cells().step_m
    }
}

/// The cells of a detail.
struct CellSizes {
    /// A chunk is at least so far from the camera along the line.
    nearest_m: f64,
    step_m: f64,
    /// Share of its distance from the nearest lamp that a cell of the mesh may be long, since light falls
    /// with a power of that distance and is interpolated over the cell.
    share_of_distance: f64,
    /// No cell gets smaller than this, which is 6 to 12 pixels of the usual cameras.
    least_m: f64,
}

/// Which mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ChunkKey {
    /// Of which track.
    pub track: usize,
    /// Covers chainage from `index * CHUNK_M` over `CHUNK_M`.
    pub index: i64,
    /// How fine.
    pub detail: Detail,
    /// Finer still before a lens that bends lines.
    pub bend: Option<Bend>,
    /// Whether what is beyond its begin and its end is dark: it is out of sight, or not on the map.
    pub dark: [bool; 2],
}

impl ChunkKey {
    /// Chainage of its origin.
    pub fn start_m(self) -> f64 {
        self.index as f64 * CHUNK_M
    }
}

/// What decides how finely a chunk is cut.
#[derive(Clone, Copy)]
pub struct Cutting<'a> {
    /// Of the chunk.
    pub key: ChunkKey,
    /// Lamps that may light it.
    pub lamps: &'a [TrackPoint],
}

impl Cutting<'_> {
    /// Whether a cell of that length, somewhere in a stretch of chainage, is lit evenly, and straight
    /// before the camera's lens; `across_m` says how far from it things are across the line.
    pub fn suffices(
        &self,
        cell_m: f64,
        [from_m, to_m]: [f64; 2],
        across_m: impl Fn(&TrackPoint) -> f64,
    ) -> bool {
        let cells = self.key.detail.cells();
        let lit_evenly = |lamp: &TrackPoint| {
            let along_m = (from_m - lamp.s_m).max(lamp.s_m - to_m).max(0.0);
            let away_m = along_m.hypot(across_m(lamp));
            cell_m <= cells.share_of_distance * away_m || cell_m < 2.0 * cells.least_m
        };
        let straight = |bend: Bend| {
            let away_m = cells.nearest_m.hypot(across_m(&bend.eye()));
            cell_m <= bend.cell_m(away_m)
        };
        self.lamps.iter().all(lit_evenly) && self.key.bend.is_none_or(straight)
    }
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
pub fn finer_stations(stations: &[f64], at: OutlinePoint, cutting: Cutting<'_>) -> Vec<f64> {
    let mut finer = vec![stations[0]];
    let across_m = |from: &TrackPoint| (at.l_m - from.l_m).hypot(at.h_m - from.h_m);
    for pair in stations.windows(2) {
        let fits =
            |from_m: f64, to_m: f64| cutting.suffices(to_m - from_m, [from_m, to_m], across_m);
        halve(pair[0], pair[1], &fits, &mut finer);
    }
    finer
}
