//! Obstacles as COCO has them (<https://cocodataset.org/#format-data>): images, boxes, and masks
//! as run lengths.

use serde::Serialize;
use serde_json::{Value, json};

/// Categories, their ids counting from 1.
pub(super) const CATEGORIES: [&str; 4] = ["obstacle", "cable", "worker", "train"];

/// One thing in one picture.
#[derive(Serialize)]
pub(super) struct Annotation {
    pub id: i64,
    pub image_id: i64,
    pub category_id: usize,
    /// Left, top, width, height.
    pub bbox: [usize; 4],
    pub area: u32,
    pub segmentation: Mask,
    pub iscrowd: u8,
    pub name: String,
    /// The same in all frames.
    pub instance_id: u32,
    pub visible_share: Option<f64>,
}

/// Pixels of one thing, as runs down the columns: first of those outside, then in, then out...
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(super) struct Mask {
    /// Height and width.
    size: [usize; 2],
    counts: Vec<u32>,
    /// First column and row, and one after the last ones.
    #[serde(skip)]
    bounds: Option<[usize; 4]>,
    #[serde(skip)]
    area: u32,
}

impl Mask {
    /// Of the pixels (column, row) for which `has` is true. Only columns `from..to` are asked.
    pub fn of(
        size: [usize; 2],
        columns: std::ops::Range<usize>,
        has: impl Fn(usize, usize) -> bool,
    ) -> Self {
        let [height, width] = size;
        let mut mask = Self {
            size,
            counts: Vec::new(),
            bounds: None,
            area: 0,
        };
        let (mut inside, mut run) = (false, (columns.start * height) as u32);
        let mut count = |run: &mut u32| mask.counts.push(std::mem::take(run));
        for u in columns.clone() {
            for v in 0..height {
                let now = has(u, v);
                if now != inside {
                    count(&mut run);
                    inside = now;
                }
                run += 1;
                if now {
                    mask.area += 1;
                    let b = mask.bounds.get_or_insert([u, v, u + 1, v + 1]);
                    *b = [b[0].min(u), b[1].min(v), b[2].max(u + 1), b[3].max(v + 1)];
                }
            }
        }
        let rest = ((width - columns.end.min(width)) * height) as u32;
        if inside && rest > 0 {
            count(&mut run);
        }
        run += rest;
        count(&mut run);
        mask
    }

    /// Pixels.
    pub fn area(&self) -> u32 {
        self.area
    }

    /// Left, top, right and bottom edge, the pixel (u, v) reaching from u to u + 1.
    pub fn bounds(&self) -> Option<[usize; 4]> {
        self.bounds
    }
}

/// The file's content.
pub(super) fn document(scenario: &str, images: &[Value], annotations: &[Annotation]) -> Value {
    let categories = (1..).zip(CATEGORIES);
    let categories = categories.map(|(id, name)| json!({"id": id, "name": name}));
    json!({
        "info": {
            "description": format!("metrotwin frames of {scenario}"),
            "version": env!("CARGO_PKG_VERSION"),
        },
        "images": images,
        "annotations": annotations,
        "categories": categories.collect::<Vec<_>>(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fails where runs go along rows, begin with a run inside, or lose a column at the border:
    /// the runs, laid out again, are the pixels.
    #[test]
    fn runs_are_the_pixels_column_by_column() {
        let (height, width) = (5, 7);
        let cases: [fn(usize, usize) -> bool; 4] = [
            |u, v| (u + v) % 3 == 0,
            |u, v| u == 6 && v > 1,
            |u, v| u == 0 && v == 0,
            |_, _| false,
        ];
        for (k, has) in cases.into_iter().enumerate() {
            for columns in [0..width, 6..width, 0..1] {
                let within = |u: usize, v: usize| columns.contains(&u) && has(u, v);
                let mask = Mask::of([height, width], columns.clone(), has);
                let mut pixels = Vec::new();
                for (i, &run) in mask.counts.iter().enumerate() {
                    pixels.extend(std::iter::repeat_n(i % 2 == 1, run as usize));
                }
                let right: Vec<_> = (0..height * width)
                    .map(|i| within(i / height, i % height))
                    .collect();
                assert_eq!(pixels, right, "case {k}");
                let area = right.iter().filter(|x| **x).count();
                assert_eq!(mask.area() as usize, area);
            }
        }
    }

    /// Fails where a box ends a pixel early.
    #[test]
    fn boxes_hold_whole_pixels() {
        let mask = Mask::of([10, 20], 0..20, |u, v| (3..8).contains(&u) && v == 4);
        assert_eq!(mask.bounds(), Some([3, 4, 8, 5]));
        assert_eq!(mask.area(), 5);
    }
}
