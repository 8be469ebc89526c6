//! `metrotwin doctor`: which graphics adapters there are, and how fast this machine is.

use super::fault::Failure;
use super::print;
use crate::session::{Speeds, measure};

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
        print(&table(&speeds))
    }
}

fn table(s: &Speeds) -> String {
    let mut text = String::new();
    for a in &s.adapters {
        text += &format!("adapter    {} ({})\n", a.adapter, a.backend);
    }
    if s.adapters.is_empty() {
        text += "adapter    none; on Debian or Ubuntu: apt-get install mesa-vulkan-drivers\n";
    }
    text += &format!("drawn by   {} ({})\n\n", s.adapter, s.backend);
    let mut line = |what: &str, value: f64, unit: &str| {
        text += &format!("{what:34} {value:9.2} {unit}\n");
    };
    line(
        "stereo pairs, 2 x 1280 x 720",
        s.stereo_pairs_per_s,
        "a second",
    );
    line(
        "wayside frames, 1920 x 1080",
        s.wayside_frames_per_s,
        "a second",
    );
    line("physics, six cars", s.physics_us_per_step, "us a step");
    line("lamp positioning", s.led_ms_per_pair, "ms a pair");
    line("wayside detection", s.wayside_ms_per_frame, "ms a frame");
    text
}
