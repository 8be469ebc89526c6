//! Parts of a study, each run by itself.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// Most parts of a study: an array job of Slurm has no more tasks on most machines, and a merge names
/// all that are missing.
pub const MOST_SHARDS: u64 = 10_000;

/// One of several parts of a study, each run by itself: runs are dealt in turn, so that shard I of N has
/// those with index = I - 1 modulo N. There is none but with 1 <= I <= N <= [`MOST_SHARDS`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Numbers")]
pub struct Shard {
    /// Which, counted from 1.
    pub(super) number: u64,
    /// Of how many.
    pub(super) of: u64,
}

/// As it stands in a file, where anything may stand.
#[derive(Deserialize)]
struct Numbers {
    number: u64,
    of: u64,
}

impl TryFrom<Numbers> for Shard {
    type Error = String;

    fn try_from(Numbers { number, of }: Numbers) -> Result<Self, String> {
        Self::new(number, of).ok_or_else(|| {
            format!("`shard` is {number} of {of}, not I of N with 1 <= I <= N <= {MOST_SHARDS}")
        })
    }
}

impl Shard {
    /// Part `number` of `of`; `None` where there is no such part.
    pub fn new(number: u64, of: u64) -> Option<Self> {
        let is_part = (1..=of).contains(&number) && of <= MOST_SHARDS;
        is_part.then_some(Self { number, of })
    }

    /// Whether a run is a part of it.
    pub fn holds(self, index: u64) -> bool {
        index % self.of == self.number - 1
    }

    /// Name of its folder below the study's.
    pub fn folder(self) -> String {
        format!("shard-{}-of-{}", self.number, self.of)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let part = text.split_once('/').and_then(|(number, of)| {
            let [number, of] = [number, of].map(|t| t.trim().parse().ok());
            Self::new(number?, of?)
        });
        part.ok_or_else(|| {
            format!("`{text}` is no shard: give I/N with 1 <= I <= N <= {MOST_SHARDS}, as in 2/4")
        })
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}
