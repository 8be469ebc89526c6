//! Which frames go into a data set, and what of each.

use clap::ValueEnum;
use serde::Serialize;
use std::collections::BTreeSet;
use std::str::FromStr;

/// What a frame comes with, besides its image and its row in `frames.parquet`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum LabelKind {
    /// Digital numbers of the converter.
    Raw,
    /// The image without flaws.
    Clean,
    /// Depth of every pixel.
    Depth,
    /// Instance of every pixel.
    Mask,
    /// Optical flow to the camera's next frame in the set.
    Flow,
    /// Time and pose of every row.
    Rows,
    /// Outline, name and light of every lamp in view.
    Lamps,
    /// Boxes and shares of every obstacle in view, and COCO annotations.
    Obstacles,
}

impl LabelKind {
    /// It needs the surface of every pixel.
    fn needs_rays(self) -> bool {
        matches!(
            self,
            Self::Depth | Self::Mask | Self::Flow | Self::Obstacles
        )
    }
}

/// A word that names no [`LabelKind`].
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "there are no labels `{0}`; give raw, clean, depth, mask, flow, rows, lamps, obstacles, all or none"
)]
pub struct UnknownLabel(String);

/// A list of labels as a user writes it: words between commas, or `all`, or `none`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LabelKinds(pub BTreeSet<LabelKind>);

impl FromStr for LabelKinds {
    type Err = UnknownLabel;

    fn from_str(text: &str) -> Result<Self, UnknownLabel> {
        match text.trim() {
            "all" => return Ok(Self::default()),
            "none" => return Ok(Self(BTreeSet::new())),
            _ => {}
        }
        let words = text.split(',').map(str::trim);
        let label = |word: &str| {
            <LabelKind as ValueEnum>::from_str(word, false)
                .map_err(|_| UnknownLabel(word.to_owned()))
        };
        words.map(label).collect::<Result<_, _>>().map(Self)
    }
}

impl Default for LabelKinds {
    fn default() -> Self {
        Self(LabelKind::value_variants().iter().copied().collect())
    }
}

/// Which frames, and what of each.
#[derive(Clone, Debug, PartialEq)]
pub struct FramePlan {
    /// Every which frame of a camera, by its number.
    pub every: u32,
    /// Frames that start at this time or later.
    pub from_s: f64,
    /// And not later than this.
    pub to_s: f64,
    /// Most frames of a camera.
    pub limit: Option<u32>,
    /// Names of the cameras; all where empty.
    pub cameras: Vec<String>,
    /// What of each.
    pub labels: LabelKinds,
}

impl Default for FramePlan {
    fn default() -> Self {
        Self {
            every: 1,
            from_s: 0.0,
            to_s: f64::INFINITY,
            limit: None,
            cameras: Vec::new(),
            labels: LabelKinds::default(),
        }
    }
}

impl FramePlan {
    /// Whether a label is wanted.
    pub fn has(&self, label: LabelKind) -> bool {
        self.labels.0.contains(&label)
    }

    pub(super) fn needs_rays(&self) -> bool {
        self.labels.0.iter().any(|label| label.needs_rays())
    }

    pub(super) fn has_camera(&self, name: &str) -> bool {
        self.cameras.is_empty() || self.cameras.iter().any(|c| c == name)
    }

    /// Whether a frame is wanted of a camera that has given `taken` so far.
    pub(super) fn takes(&self, number: u32, start_s: f64, taken: u32) -> bool {
        number.is_multiple_of(self.every.max(1))
            && (self.from_s..=self.to_s).contains(&start_s)
            && self.limit.is_none_or(|limit| taken < limit)
    }

    /// Whether no frame from that time on is wanted of a camera that has given `taken` so far.
    pub(super) fn is_over(&self, start_s: f64, taken: u32) -> bool {
        start_s > self.to_s || self.limit.is_some_and(|limit| taken >= limit)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    /// Fails where a label cannot be named, or a wrong word passes.
    #[test]
    fn lists_of_labels() {
        let labels = |text: &str| text.parse::<LabelKinds>();
        assert_eq!(labels("all").unwrap(), LabelKinds::default());
        assert!(labels("none").unwrap().0.is_empty());
        for label in LabelKind::value_variants() {
            // What is written down names the same label to the command line.
            let word = serde_json::to_value(label).unwrap();
            let word = word.as_str().unwrap();
            assert_eq!(labels(word).unwrap().0, BTreeSet::from([*label]));
        }
        assert_eq!(labels("mask, depth").unwrap().0.len(), 2);
        assert!(
            labels("mask,dept")
                .unwrap_err()
                .to_string()
                .contains("`dept`")
        );
    }

    /// Fails where a limit is of pictures taken and not of those wanted, or an end is left out.
    #[test]
    fn frames_are_chosen_by_number_time_and_count() {
        let plan = FramePlan {
            every: 3,
            from_s: 0.1,
            to_s: 0.4,
            limit: Some(2),
            ..FramePlan::default()
        };
        let mut taken = 0;
        let mut chosen = Vec::new();
        for number in 0..20 {
            let start_s = 0.05 * f64::from(number);
            if plan.takes(number, start_s, taken) {
                taken += 1;
                chosen.push(number);
            }
        }
        assert_eq!(chosen, [3, 6]);
        assert!(plan.is_over(0.2, 2) && plan.is_over(0.41, 1) && !plan.is_over(0.4, 1));
    }
}
