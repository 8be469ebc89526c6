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
//! right alike: [`Spill`] tells by how much.

use super::patch::Patch;
use super::spill::Spill;
use nalgebra::Point2;

/// A connected spot in a patch, row by row.
#[derive(Debug)]
pub struct Outline {
    /// Rows of the patch that the spot covers: from the first to the last.
    pub rows: Option<(usize, usize)>,
    /// Leftmost and rightmost column of the closed spot in every row of `rows`.
    pub extents: Vec<(usize, usize)>,
    /// Pixels of the closed spot.
    pub area_px: usize,
    /// Lit rows, as row of the patch and sub-pixel left and right edge, `NaN` where the image's
    /// border cut it.
    pub edges: Vec<(usize, f64, f64)>,
    /// Edge points in image coordinates.
    pub points: Vec<Point2<f64>>,
    /// How far the edges lie outside of the lamp's own because rows are saturated.
    pub spill: Spill,
    /// It touches the image's border.
    pub cut: bool,
    mask: Vec<bool>,
    stack: Vec<usize>,
}

impl Outline {
    /// For images of a lens that spreads a point with a standard deviation of `blur_px`.
    pub fn new(blur_px: f64) -> Self {
        Self {
            rows: None,
            extents: Vec::new(),
            area_px: 0,
            edges: Vec::new(),
            points: Vec::new(),
            spill: Spill::new(blur_px),
            cut: false,
            mask: Vec::new(),
            stack: Vec::new(),
        }
    }

    /// Finds the largest spot over `threshold` in the filtered patch after closing gaps of up to
    /// `gap_rows`. `false` where there is none.
    pub fn find(&mut self, filtered: &Patch, threshold: u8, gap_rows: usize) -> bool {
        let w = filtered.width;
        self.rows = None;
        self.mask.clear();
        self.mask
            .extend(filtered.data.iter().map(|&g| g > threshold));
        close_columns(&mut self.mask, w, gap_rows);
        let mut largest = (0, 0);
        let mut labelled = std::mem::take(&mut self.mask);
        let seen = labelled.clone();
        for start in 0..labelled.len() {
            if labelled[start] {
                let area = self.flood(&mut labelled, w, start, |_| {});
                if area > largest.0 {
                    largest = (area, start);
                }
            }
        }
        self.mask = seen;
        if largest.0 == 0 {
            return false;
        }
        self.take(largest.1, w);
        true
    }

    /// Fills rows and extents from the component that holds pixel `start`.
    fn take(&mut self, start: usize, w: usize) {
        let mut mask = std::mem::take(&mut self.mask);
        let mut extents = std::mem::take(&mut self.extents);
        extents.clear();
        extents.resize(mask.len() / w, (usize::MAX, 0));
        self.area_px = self.flood(&mut mask, w, start, |k| {
            let (u, extent) = (k % w, &mut extents[k / w]);
            *extent = (extent.0.min(u), extent.1.max(u));
        });
        self.mask = mask;
        let covered = |e: &(usize, usize)| e.0 <= e.1;
        let first = extents.iter().position(covered).unwrap_or(0);
        let last = extents.iter().rposition(covered).unwrap_or(0);
        extents.copy_within(first..=last, 0);
        extents.truncate(last - first + 1);
        self.extents = extents;
        self.rows = Some((first, last));
    }

    /// Clears a component of the mask and counts its pixels (neighbours share a side or corner).
    fn flood(
        &mut self,
        mask: &mut [bool],
        w: usize,
        start: usize,
        mut each: impl FnMut(usize),
    ) -> usize {
        let h = mask.len() / w;
        let mut area = 0;
        mask[start] = false;
        self.stack.clear();
        self.stack.push(start);
        while let Some(k) = self.stack.pop() {
            area += 1;
            each(k);
            let (u, v) = (k % w, k / w);
            for v in v.saturating_sub(1)..(v + 2).min(h) {
                for u in u.saturating_sub(1)..(u + 2).min(w) {
                    if std::mem::take(&mut mask[v * w + u]) {
                        self.stack.push(v * w + u);
                    }
                }
            }
        }
        area
    }

    /// Sub-pixel edges of the lit rows from the unfiltered patch (the median would shorten rows
    /// beside dark ones). `image_size` tells which borders of the patch are the image's.
    pub fn trace(&mut self, raw: &Patch, black: f64, threshold: u8, image_size: (usize, usize)) {
        self.edges.clear();
        self.points.clear();
        self.cut = false;
        self.spill.clear();
        let Some((first, last)) = self.rows else {
            return;
        };
        let at_left = raw.u0 == 0;
        let at_right = raw.u0 + raw.width == image_size.0;
        self.cut = raw.v0 + first == 0 || raw.v0 + last + 1 >= image_size.1;
        for v in first..=last {
            let (u0, u1) = self.extents[v - first];
            let row = raw.row(v);
            let Some((u0, u1)) = lit_core(row, u0, u1, threshold) else {
                continue;
            };
            let top = plateau(row, u0, u1);
            let level = black + 0.5 * (top - black);
            let left = if at_left && u0 == 0 {
                None
            } else {
                crossing(row, (0..=(u0 + u1) / 2).rev(), level)
            };
            let right = if at_right && u1 + 1 == raw.width {
                None
            } else {
                crossing(row, (u0 + u1) / 2..raw.width, level)
            };
            let off_middle = (2 * v).abs_diff(first + last) as f64;
            if off_middle < STEEP_SHARE * (last - first + 1) as f64 {
                for (edge, outwards) in [(left, -1), (right, 1)] {
                    if let Some(edge) = edge {
                        self.spill.add(row, top, edge, outwards);
                    }
                }
            }
            self.cut |= (at_left && u0 == 0) || (at_right && u1 + 1 == raw.width);
            let (du, dv) = (raw.u0 as f64, (raw.v0 + v) as f64);
            let found = left.into_iter().chain(right);
            self.points.extend(found.map(|u| Point2::new(u + du, dv)));
            self.edges
                .push((v, left.unwrap_or(f64::NAN), right.unwrap_or(f64::NAN)));
        }
    }
}

/// Fills dark gaps of up to `gap` rows between lit pixels of a column: closing by a segment.
fn close_columns(mask: &mut [bool], w: usize, gap: usize) {
    if w == 0 {
        return;
    }
    let h = mask.len() / w;
    for u in 0..w {
        let mut last_lit: Option<usize> = None;
        for v in 0..h {
            if mask[v * w + u] {
                if let Some(last) = last_lit.filter(|last| v - last <= gap + 1) {
                    for between in last + 1..v {
                        mask[between * w + u] = true;
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
        let mut outline = Outline::new(0.0);
        assert!(outline.find(&patch, 60, 9));
        outline.trace(&patch, 4.0, 60, (1280, 720));
        assert!(!outline.cut);
        assert!(outline.extents.iter().all(|e| e.1 < 100));
        let fit = fit_ellipse(&outline.points).map(|f| f.ellipse.centre);
        let miss = fit.map(|c| (c - lamp.centre - nalgebra::Vector2::new(1000.0, 300.0)).norm());
        assert!(miss.is_some_and(|m| m < 0.05), "{miss:?}");
    }

    /// Gaps are filled up to their limit and not beyond.
    #[test]
    fn closing_joins_up_to_the_gap() {
        let column = |gap: usize| {
            let mut mask = vec![false; 20];
            (mask[3], mask[3 + gap + 1]) = (true, true);
            close_columns(&mut mask, 1, 5);
            mask.iter().filter(|&&lit| lit).count()
        };
        assert_eq!([column(4), column(5), column(6)], [6, 7, 2]);
    }
}
