//! `metrotwin generate`: concrete scenarios drawn from a template.

use super::fault::Failure;
use super::print;
use super::running::prepare;
use super::scenario_fault::load_template;
use crate::record;
use crate::scenario::sampling::{Inputs, ScenarioSample, Template};
use std::io;
use std::path::{Path, PathBuf};

const AFTER: &str = "\
The scenario needs a table [study] that says what varies; scenarios/studies has examples.
Into the output folder go:
  <name>_000000.toml ...   complete scenarios, every key with its value and what it means
  index.csv                file, seed and drawn values of each
  inputs/                  copies of the tunnel and all other files that they name
The same seed and number give the same file for ever.

Examples:
  metrotwin generate scenarios/studies/led_accuracy.toml -n 20 --out out/generated
  metrotwin run out/generated/led_accuracy_000007.toml";

/// Write concrete scenarios drawn from a template
#[derive(clap::Args)]
#[command(after_help = AFTER)]
pub(super) struct GenerateArgs {
    /// Scenario file with a [study]
    scenario: PathBuf,
    /// How many
    #[arg(short, long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    number: u32,
    /// All draws follow from it [default: the study's]
    #[arg(long, value_name = "S")]
    seed: Option<u64>,
    /// Folder for the scenarios
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub(super) fn generate(args: &GenerateArgs) -> Result<(), Failure> {
    let template = load_template(&args.scenario)?.with(args.seed, Some(args.number));
    let samples = (0..u64::from(args.number)).map(|k| template.sample(k));
    let samples = samples.collect::<Result<Vec<_>, _>>();
    let samples =
        samples.map_err(|e| Failure::input(e, "ease the conditions under study.require"))?;
    // Nothing is written unless all of them can be.
    let inputs = Inputs::of(&template).map_err(Failure::run)?;
    let place = |name: &str| match inputs.place_of(name) {
        Some(place) => Path::new("inputs")
            .join(place)
            .to_string_lossy()
            .into_owned(),
        None => name.to_owned(),
    };
    let texts = samples.iter().map(|sample| template.text_of(sample, place));
    let texts = texts.collect::<Result<Vec<_>, _>>()?;
    prepare(&args.out)?;
    write(&args.out, &template, &inputs, &samples, &texts)
        .map_err(|e| Failure::run(anyhow::Error::new(e).context("cannot write the scenarios")))?;
    let rejected: u64 = samples.iter().map(|d| u64::from(d.rejected)).sum();
    print(&format!(
        "{} scenarios in {}; {rejected} draws did not meet the conditions",
        samples.len(),
        args.out.display()
    ))
}

fn write(
    out: &Path,
    template: &Template,
    inputs: &Inputs,
    samples: &[ScenarioSample],
    texts: &[String],
) -> io::Result<()> {
    inputs.copy_to(&out.join("inputs"))?;
    let mut index = csv::Writer::from_writer(Vec::new());
    let variables = template.settings.variables.keys().map(String::as_str);
    let head = ["index", "file", "seed", "rejected", "weight"]
        .into_iter()
        .chain(variables);
    index.write_record(head)?;
    for (sample, text) in samples.iter().zip(texts) {
        let file = format!("{}_{:06}.toml", template.file.name, sample.index);
        record::write_whole(&out.join(&file), text.as_bytes())?;
        let about = [
            sample.index.to_string(),
            file,
            sample.seed.to_string(),
            sample.rejected.to_string(),
            sample.ln_weight.exp().to_string(),
        ];
        let values = sample.values.iter().map(|(_, value)| match value {
            toml::Value::String(text) => text.clone(),
            other => other.to_string(),
        });
        index.write_record(about.into_iter().chain(values))?;
    }
    let text = index
        .into_inner()
        .map_err(|e| io::Error::other(e.to_string()))?;
    record::write_whole(&out.join("index.csv"), &text)
}
