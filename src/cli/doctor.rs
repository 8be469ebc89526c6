//! `metrotwin doctor`: which graphics adapters there are, and how fast this machine is.

use super::fault::Failure;
use super::print;
use crate::record::render;
use crate::session::{DrawingProfile, measure, profile};
use serde::Serialize;

const AFTER: &str = "\
Each figure is the best median of rounds of 20 frames. With --profile, frames are drawn one by one, a stereo
pair or a wayside frame each, and times are medians:
  prepare  until the job is handed over
  draw     until the adapter is done, with its own time in each pass
  develop  until the images are there; includes the sensor where the processor computes it
For comparison: the time to move the same bytes through memory, and the plain renderer's for the last job.

Examples:
  metrotwin doctor
  metrotwin doctor --profile
  metrotwin doctor --json | jq .stereo_pairs_per_s";

/// List graphics adapters and measure how fast this machine is
#[derive(clap::Args)]
#[command(after_help = AFTER)]
pub(super) struct DoctorArgs {
    /// Print the figures as JSON
    #[arg(long)]
    json: bool,
    /// Measure where the time of a picture goes instead, pass by pass
    #[arg(long)]
    profile: bool,
}

pub(super) fn doctor(args: &DoctorArgs) -> Result<(), Failure> {
    let failed = |error| Failure::run(anyhow::Error::from_boxed(error));
    if args.profile {
        let cases = Cases {
            cases: profile(&|case| eprintln!("{case} ...")).map_err(failed)?,
        };
        return say(
            args,
            "profile.txt",
            include_str!("texts/profile.txt"),
            &cases,
        );
    }
    let speeds = measure().map_err(failed)?;
    say(
        args,
        "doctor.txt",
        include_str!("texts/doctor.txt"),
        &speeds,
    )
}

#[derive(Serialize)]
struct Cases {
    cases: Vec<DrawingProfile>,
}

/// As a text by a template, or as JSON.
fn say(
    args: &DoctorArgs,
    name: &str,
    template: &str,
    figures: &impl Serialize,
) -> Result<(), Failure> {
    let text = match args.json {
        true => serde_json::to_string_pretty(figures).map_err(Failure::run)?,
        false => render(name, template, figures).map_err(Failure::run)?,
    };
    print(&text)
}
