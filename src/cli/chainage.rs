//! `metrotwin check TUNNEL --chainage DK12+340`: where that is.

use super::fault::Failure;
use crate::settings::{LONGEST_KEY, shortened};
use crate::track::{ChainageError, Tunnel};
use std::path::Path;

/// A line for each track on which a stated chainage is found.
pub(super) fn report(path: &Path, tunnel: &Tunnel, text: &str) -> Result<String, Failure> {
    let (mut found, mut why_not) = (String::new(), Vec::new());
    for track in &tunnel.network.tracks {
        let Some(stated) = &track.stated_chainage else {
            continue;
        };
        let name = shortened(&track.name, LONGEST_KEY);
        match stated.place(text) {
            Ok(s_m) => {
                found += &format!("  {text} is {s_m:.3} m from the begin of track `{name}`\n")
            }
            Err(error @ ChainageError::Ambiguous { .. }) => {
                found += &format!("  track `{name}`: {error}\n");
            }
            Err(error) => why_not.push(format!("track `{name}`: {error}")),
        }
    }
    match (found.is_empty(), why_not.is_empty()) {
        (false, _) => Ok(found),
        (true, false) if text.trim().is_empty() => Err(Failure::input(
            format!("--chainage of {} is empty", path.display()),
            "write what a track states, for instance at its begin as `check` tells it without --chainage",
        )),
        (true, false) => Err(Failure::input(
            format!("`{text}` is on no track of {}", path.display()),
            why_not.join("\n"),
        )),
        (true, true) => Err(Failure::input(
            format!("no track of {} states chainages", path.display()),
            "give it `stated_chainage = { prefix = \"DK\", start_m = 12340.0 }`",
        )),
    }
}

/// For a file that has no tracks.
pub(super) fn refuse(path: &Path, chainages: &[String]) -> Result<(), Failure> {
    match chainages.first() {
        None => Ok(()),
        Some(text) => Err(Failure::input(
            format!(
                "--chainage {text} is looked for in tunnels, and {} is none",
                path.display()
            ),
            "give the tunnel file that it names",
        )),
    }
}
