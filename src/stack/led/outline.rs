//! The outline of a lamp whose image is cut into stripes.
//!
//! The binary spot is closed (dilated, then eroded) by an upright segment longer than the code's
//! longest darkness, so that the stripes become one component. The closing decides *what belongs
//! together*, not where the edge is: where a dark stripe touches the upper or lower end of the
//! lamp, the closed spot ends too early, by up to four chips (eight rows), and an ellipse through
//! those ends would be too small and off the centre. Therefore edge points are taken from lit rows
//! only, to the left and right: there the edge is the lamp's own, a dark stripe removes points
//! and never makes a false one, and the two sides alone determine the ellipse.
//!
//! An edge lies where the row crosses half of its own plateau, between two pixels by linear
//! interpolation; so a row that caught the lamp switching, at half its brightness, gives the same
//! edge. Where the sensor saturates the plateau is too low and the edge lies outside, left and
//! right alike: [`Spill`] says by how much.

use super::patch::Patch;
use super::spill::{Spill, SpillSums, SpillTable};
use crate::bus::PixelBox;
use crate::stack::runs::Runs;
use nalgebra::Point2;

/// The largest spot of a patch, its stripes closed.
#[derive(Debug)]
pub struct ClosedSpot {
    /// First row of the patch that it covers.
    first_row: usize,
    /// Leftmost and rightmost column in every row from there on.
    extents: Vec<(usize, usize)>,
    /// Its pixels.
    pub area_px: u32,
    /// In the image.
    pub bounds: PixelBox,
}

impl ClosedSpot {
    /// Over `threshold` in the filtered patch after closing gaps of up to `gap_rows`; `None` where
    /// there is none.
    pub fn find(filtered: &Patch, threshold: u8, gap_rows: usize) -> Option<Self> {
        let bright = filtered.data.iter().map(|&g| u8::from(g > threshold));
        let mut mask: Vec<u8> = bright.collect();
        close_columns(&mut mask, filtered.width, gap_rows);
        let mut runs = Runs::new(&mask, filtered.width, 0, |_| true);
        // Of equally large ones the first.
        let blobs = runs.blobs().into_iter().rev();
        let (region, spot) = blobs.max_by_key(|(_, blob)| blob.area_px)?;
        let first_row = spot.bounds.v0 as usize;
        let mut extents: Vec<(usize, usize)> = Vec::new();
        for k in 0..runs.all.len() {
            if runs.region(k) != region {
                continue;
            }
            let run = runs.all[k];
            let (left, right) = (run.u.0 as usize, run.u.1 as usize);
            match extents.get_mut(run.v as usize - first_row) {
                Some(extent) => extent.1 = right,
                None => extents.push((left, right)),
            }
        }
        let (u0, v0) = (filtered.u0 as u32, filtered.v0 as u32);
        Some(Self {
            first_row,
            extents,
            area_px: spot.area_px,
            bounds: PixelBox {
                u0: u0 + spot.bounds.u0,
                v0: v0 + spot.bounds.v0,
                u1: u0 + spot.bounds.u1,
                v1: v0 + spot.bounds.v1,
            },
        })
    }
}

/// Edges of a lamp.
#[derive(Debug)]
pub struct Outline {
    /// Lit rows, as row of the patch and sub-pixel left and right edge, `NaN` where the image's
    /// border cut it.
    pub edges: Vec<(usize, f64, f64)>,
    /// Edge points in image coordinates.
    pub points: Vec<Point2<f64>>,
    /// How far the edges lie outside of the lamp's own because rows are saturated.
    pub spill: Spill,
    /// It touches the image's border.
    pub cut: bool,
}

impl Outline {
    /// Sub-pixel edges of the lit rows of a spot from the unfiltered patch (the median would shorten
    /// rows beside dark ones). `image_size` tells which borders of the patch are the image's.
    pub fn trace(
        spot: &ClosedSpot,
        raw: &Patch,
        (black, threshold): (f64, u8),
        image_size: (usize, usize),
        table: &SpillTable,
    ) -> Self {
        let (first, rows) = (spot.first_row, spot.extents.len());
        let at_left = raw.u0 == 0;
        let at_right = raw.u0 + raw.width == image_size.0;
        let mut outline = Self {
            edges: Vec::new(),
            points: Vec::new(),
            spill: Spill::default(),
            cut: raw.v0 + first == 0 || raw.v0 + first + rows >= image_size.1,
        };
        let mut sums = SpillSums::default();
        for (v, &(u0, u1)) in (first..).zip(&spot.extents) {
            let row = raw.row(v);
            let Some((u0, u1)) = lit_core(row, u0, u1, threshold) else {
                continue;
            };
            let top = plateau(row, u0, u1);
            let level = black + 0.5 * (top - black);
            let cut = [at_left && u0 == 0, at_right && u1 + 1 == raw.width];
            let middle = (u0 + u1) / 2;
            let left = (!cut[0]).then(|| crossing(row, (0..=middle).rev(), level));
            let right = (!cut[1]).then(|| crossing(row, middle..raw.width, level));
            let (left, right) = (left.flatten(), right.flatten());
            let off_middle = (2 * v).abs_diff(2 * first + rows - 1) as f64;
            if off_middle < STEEP_SHARE * rows as f64 {
                for (edge, outwards) in [(left, -1), (right, 1)] {
                    if let Some(edge) = edge {
                        sums.add(row, top, edge, outwards);
                    }
                }
            }
            outline.cut |= cut[0] || cut[1];
            let (du, dv) = (raw.u0 as f64, (raw.v0 + v) as f64);
            let found = left.into_iter().chain(right);
            outline
                .points
                .extend(found.map(|u| Point2::new(u + du, dv)));
            let edges = (v, left.unwrap_or(f64::NAN), right.unwrap_or(f64::NAN));
            outline.edges.push(edges);
        }
        outline.spill = sums.spill(table);
        outline
    }
}

/// Fills dark gaps of up to `gap` rows between lit pixels of a column: closing by a segment.
fn close_columns(mask: &mut [u8], w: usize, gap: usize) {
    for u in 0..w {
        let mut last_lit: Option<usize> = None;
        for v in 0..mask.len() / w {
            if mask[v * w + u] != 0 {
                if let Some(last) = last_lit.filter(|last| v - last <= gap + 1) {
                    for between in last + 1..v {
                        mask[between * w + u] = 1;
                    }
                }
                last_lit = Some(v);
            }
        }
    }
}

/// Narrows an extent to the pixels over the threshold; `None` where fewer than 60 % of them, or
/// fewer than four, are lit.
fn lit_core(row: &[u8], u0: usize, u1: usize, threshold: u8) -> Option<(usize, usize)> {
    let over = |&u: &usize| row[u] > threshold;
    let first = (u0..=u1).find(over)?;
    let last = (u0..=u1).rev().find(over)?;
    let lit = (first..=last).filter(over).count();
    (lit >= 4 && lit * 10 >= (u1 + 1 - u0) * 6).then_some((first, last))
}

/// Rows this near to the middle, as a share of half the height, cross a circle's outline at more
/// than 57 deg, so that a pixel's light hardly depends on the slope.
const STEEP_SHARE: f64 = 0.53;

/// Mean of the middle half of a lit row.
fn plateau(row: &[u8], u0: usize, u1: usize) -> f64 {
    let quarter = (u1 - u0) / 4;
    let middle = &row[u0 + quarter..=u1 - quarter];
    middle.iter().map(|&g| f64::from(g)).sum::<f64>() / middle.len() as f64
}

/// Where a row falls under `level`, walking along `columns` from inside the lamp outwards.
fn crossing(row: &[u8], columns: impl Iterator<Item = usize>, level: f64) -> Option<f64> {
    let mut inside: Option<(usize, f64)> = None;
    for u in columns {
        let grey = f64::from(row[u]);
        if grey < level {
            let (before, g) = inside?;
            let share = (g - level) / (g - grey);
            return Some(before as f64 + share * (u as f64 - before as f64));
        }
        inside = Some((u, grey));
    }
    None
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::bus::Ellipse;
    use crate::stack::led::ellipse::{chord, fit_ellipse};

    /// Stripes of a slanting ellipse, one on its upper end: one spot, edges on the outline.
    #[test]
    fn edges_of_a_striped_lamp_lie_on_its_outline() {
        let lamp = Ellipse {
            centre: Point2::new(52.3, 47.6),
            semi_major_px: 30.0,
            semi_minor_px: 21.0,
            angle_rad: 0.6,
        };
        let (w, h) = (110, 100);
        let mut data = vec![4; w * h];
        for v in (0..h).filter(|v| v % 9 > 4) {
            let Some((left, right)) = chord(&lamp, v as f64) else {
                continue;
            };
            for u in 0..w {
                let cover = (u as f64 + 0.5).min(right) - (u as f64 - 0.5).max(left);
                data[v * w + u] = (4.0 + 120.0 * cover.clamp(0.0, 1.0)).round() as u8;
            }
        }
        // A bright speck far off is another component.
        data[3 * w + 100] = 250;
        let patch = Patch::from_data(1000, 300, w, h, data);
        let spot = ClosedSpot::find(&patch, 60, 9).unwrap();
        let table = SpillTable::new(0.0);
        let outline = Outline::trace(&spot, &patch, (4.0, 60), (1280, 720), &table);
        assert!(!outline.cut);
        assert!(spot.extents.iter().all(|e| e.1 < 100));
        let fit = fit_ellipse(&outline.points).map(|f| f.ellipse.centre);
        let miss = fit.map(|c| (c - lamp.centre - nalgebra::Vector2::new(1000.0, 300.0)).norm());
        assert!(miss.is_some_and(|m| m < 0.05), "{miss:?}");
    }

    /// Gaps are filled up to their limit and not beyond.
    #[test]
    fn closing_joins_up_to_the_gap() {
        let column = |gap: usize| {
            let mut mask = vec![0; 20];
            (mask[3], mask[3 + gap + 1]) = (1, 1);
            close_columns(&mut mask, 1, 5);
            mask.iter().filter(|&&lit| lit != 0).count()
        };
        assert_eq!([column(4), column(5), column(6)], [6, 7, 2]);
    }
}
