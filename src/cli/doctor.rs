//! `metrotwin doctor`: which graphics adapters there are, and how fast this machine is.

use super::fault::Failure;
use super::print;
use crate::record::render;
use crate::session::measure;

const AFTER: &str = "\
A figure is the best median of rounds of 20 frames.

Examples:
  metrotwin doctor
  metrotwin doctor --json | jq .stereo_pairs_per_s";

/// List graphics adapters and measure how fast this machine is
#[derive(clap::Args)]
#[command(after_help = AFTER)]
pub(super) struct DoctorArgs {
    /// Print the figures as JSON
    #[arg(long)]
    json: bool,
}

pub(super) fn doctor(args: &DoctorArgs) -> Result<(), Failure> {
    let speeds = measure().map_err(|e| Failure::run(anyhow::Error::from_boxed(e)))?;
    if args.json {
        let text = serde_json::to_string_pretty(&speeds).map_err(Failure::run)?;
        print(&text)
    } else {
        let template = include_str!("texts/doctor.txt");
        let text = render("doctor.txt", template, &speeds).map_err(Failure::run)?;
        print(&text)
    }
}
