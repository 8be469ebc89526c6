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

/// The text for one set.
pub(super) fn of(plan: &FramePlan, meta: &Value) -> Result<String, Error> {
    let labels = LabelKind::value_variants().iter();
    let missing = labels.filter(|label| !plan.has(**label));
    let values = json!({
        "meta": meta,
        "missing": missing.collect::<Vec<_>>(),
        "frame_columns": describe(FrameRow::COLUMNS),
        "row_columns": describe(ImageRow::COLUMNS),
        "lamp_columns": describe(LampRow::COLUMNS),
        "obstacle_columns": describe(ObstacleRow::COLUMNS),
    });
    Ok(render("readme.md", include_str!("readme.md"), values)? + "\n")
}
