//! Obstacles as COCO has them (<https://cocodataset.org/#format-data>): images, boxes, and masks
//! as run lengths.

use serde_json::{Value, json};

/// Categories, their ids counting from 1.
pub(super) const CATEGORIES: [&str; 4] = ["obstacle", "cable", "worker", "train"];

/// One thing in one picture.
pub(super) struct Annotation {
    pub id: i64,
    pub image_id: i64,
    /// Index into [`CATEGORIES`].
    pub category: usize,
    pub mask: Mask,
    /// Name and number of the instance, the same in all frames.
    pub name: String,
    pub instance: u32,
    pub visible_share: Option<f64>,
}

/// Pixels of one thing, as runs down the columns: first of those outside, then in, then out...
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Mask {
    /// Height and width.
    size: [usize; 2],
    counts: Vec<u32>,
    /// First column and row, and one after the last ones.
    bounds: Option<[usize; 4]>,
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
pub(super) fn document(info: Value, images: Vec<Value>, annotations: &[Annotation]) -> Value {
    let categories = (1..).zip(CATEGORIES);
    let categories = categories.map(|(id, name)| json!({"id": id, "name": name}));
    json!({
        "info": info,
        "images": images,
        "annotations": annotations.iter().filter_map(annotation).collect::<Vec<_>>(),
        "categories": categories.collect::<Vec<_>>(),
    })
}

fn annotation(a: &Annotation) -> Option<Value> {
    let [left, top, right, bottom] = a.mask.bounds?;
    Some(json!({
        "id": a.id,
        "image_id": a.image_id,
        "category_id": a.category + 1,
        "bbox": [left, top, right - left, bottom - top],
        "area": a.mask.area,
        "segmentation": {"size": a.mask.size, "counts": a.mask.counts},
        "iscrowd": 0,
        "name": a.name,
        "instance_id": a.instance,
        "visible_share": a.visible_share,
    }))
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
