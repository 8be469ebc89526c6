//! What recordings hold, whole ones and those that a kill has left.

#![allow(
    dead_code,
    clippy::unwrap_used,
    reason = "no test uses all of it, and a test fails by panicking"
)]

use rerun::external::re_log_encoding::DecoderApp;
use rerun::log::{Chunk, LogMsg};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// Messages that a recording, or what is left of it, holds: all that is whole stands before the first
/// that is not.
pub fn read(path: &Path) -> Vec<LogMsg> {
    let Ok(file) = File::open(path) else {
        return Vec::new();
    };
    let mut all = DecoderApp::decode_lazy(BufReader::new(file));
    let whole: Vec<_> = all.by_ref().map_while(Result::ok).collect();
    assert!(all.next().is_none(), "{} is torn", path.display());
    whole
}

/// How many they are.
pub fn messages(path: &Path) -> usize {
    read(path).len()
}

/// The last simulated time in a recording, s.
pub fn recorded_s(path: &Path) -> f64 {
    let times = read(path).into_iter().filter_map(|message| {
        let LogMsg::ArrowMsg(_, rows) = &message else {
            return None;
        };
        let batch = Chunk::from_arrow_msg(rows).unwrap();
        let times = batch.timelines().get(&"sim_time".into())?;
        Some(times.time_range().max().as_i64())
    });
    times.max().unwrap_or(0) as f64 * 1e-9
}
