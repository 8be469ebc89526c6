//! The description that lies beside every data set.

use super::frame::{FrameRow, ImageRow};
use super::lamps::LampRow;
use super::obstacles::ObstacleRow;
use super::{FramePlan, LabelKind};
use crate::record::parquet::describe;
use crate::record::render;
use clap::ValueEnum;
use minijinja::Error;
use serde_json::{Value, json};

/// The text for one set; the lamps' code has this period.
pub(super) fn of(plan: &FramePlan, meta: &Value, period_s: f64) -> Result<String, Error> {
    let labels = LabelKind::value_variants().iter();
    let missing = labels.filter(|label| !plan.has(**label));
    let values = json!({
        "meta": meta,
        "period_ms": (1e6 * period_s).round() / 1e3,
        "missing": missing.collect::<Vec<_>>(),
        "frame_columns": describe(FrameRow::COLUMNS),
        "row_columns": describe(ImageRow::COLUMNS),
        "lamp_columns": describe(LampRow::COLUMNS),
        "obstacle_columns": describe(ObstacleRow::COLUMNS),
    });
    Ok(render("readme.md", include_str!("readme.md"), values)? + "\n")
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;

    /// As many steps as the example asks OpenCV for, and OpenCV's iteration, bring the corners of a wide
    /// lens's picture home: EuRoC's left camera (k1, k2, p1, p2), its corners at depth 1.
    #[test]
    fn the_example_undistorts_exactly() {
        let text = include_str!("readme.md");
        let criteria = text
            .split("undistortPoints(seen")
            .nth(1)
            .and_then(|t| t.split_once(')'));
        let numbers = criteria.map_or("", |(call, _)| call).rsplit('(').next();
        let steps = numbers.and_then(|n| n.split(", ").nth(1)?.parse().ok());
        let steps: usize = steps.unwrap_or(5);
        let [k1, k2, p1, p2] = [-0.283_408_11, 0.073_959_07, 0.000_193_59, 1.761_871_14e-5];
        let spread = |p: &Vector2<f64>| {
            let r2 = p.norm_squared();
            let q = Vector2::new(p2, p1);
            (1.0 + r2 * (k1 + r2 * k2), p * (2.0 * q.dot(p)) + q * r2)
        };
        for corner in [(0.82, 0.55), (-0.82, 0.55), (0.82, -0.55), (-0.82, -0.55)] {
            let scene = Vector2::new(corner.0, corner.1);
            let (scale, aside) = spread(&scene);
            let seen = scene * scale + aside;
            let mut found = seen;
            for _ in 0..steps {
                let (scale, aside) = spread(&found);
                found = (seen - aside) / scale;
            }
            let miss_px = 458.654 * (found - scene).norm();
            assert!(miss_px < 1e-6, "{miss_px} px after {steps} steps");
        }
    }
}
