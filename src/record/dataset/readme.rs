//! The description that lies beside every data set.

use super::frame::{FrameRow, ImageRow};
use super::lamps::LampRow;
use super::obstacles::ObstacleRow;
use super::{FramePlan, LabelKind};
use crate::record::parquet::describe;

const TEMPLATE: &str = include_str!("readme.md");

/// The text for one set.
pub(super) fn of(scenario: &str, plan: &FramePlan, meta: &serde_json::Value) -> String {
    let missing: Vec<String> = LabelKind::ALL
        .iter()
        .filter(|(_, label)| !plan.has(*label))
        .map(|(word, _)| format!("`{word}`"))
        .collect();
    let missing = if missing.is_empty() {
        String::new()
    } else {
        let list = missing.join(", ");
        format!(
            "This set was made without {list}; their files and columns are missing or null.\n\n"
        )
    };
    let cameras = meta["cameras"].as_array().into_iter().flatten();
    let cameras: Vec<String> = cameras
        .enumerate()
        .map(|(k, c)| {
            let name = c["name"].as_str().unwrap_or_default();
            format!("| {k} | `{name}` | {} |", c["frames"])
        })
        .collect();
    let text = [
        ("{scenario}", scenario.to_owned()),
        ("{seed}", meta["seed"].to_string()),
        ("{frames}", meta["frames"].to_string()),
        ("{version}", env!("CARGO_PKG_VERSION").to_owned()),
        ("{missing}", missing),
        ("{cameras}", cameras.join("\n")),
        ("{frame columns}", describe(FrameRow::COLUMNS)),
        ("{row columns}", describe(ImageRow::COLUMNS)),
        ("{lamp columns}", describe(LampRow::COLUMNS)),
        ("{obstacle columns}", describe(ObstacleRow::COLUMNS)),
    ];
    text.into_iter()
        .fold(TEMPLATE.to_owned(), |all, (key, value)| {
            all.replace(key, &value)
        })
}
