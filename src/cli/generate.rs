//! `metrotwin generate`: concrete scenarios drawn from a template.

use super::fault::Failure;
use super::folder::{prepare, unusable};
use super::print;
use super::running::seed;
use super::scenario_fault::load_template;
use crate::files::{self, Listing};
use crate::scenario::sampling::{Inputs, ScenarioSample, Template, read_input};
use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};

const AFTER: &str = "\
The scenario needs a table [study] that says what varies; scenarios/studies has examples.
Into the output folder go:
  <name>_000000.toml ...   complete scenarios, every key with its value and what it means
  index.csv                file, seed and drawn values of each
  inputs/                  copies of the tunnel and all other files that they name
  files.txt                the list of these files
The same seed and number give the same file for ever. Scenarios that an earlier command has drawn into
the folder are replaced with --force; files that are not its own stay as they are.

Examples:
  metrotwin generate scenarios/studies/led_accuracy.toml -n 20 --out out/generated
  metrotwin run out/generated/led_accuracy_000007.toml";

/// Write concrete scenarios drawn from a template
#[derive(clap::Args)]
#[command(after_help = AFTER)]
pub(super) struct GenerateArgs {
    /// Scenario file with a [study]
    scenario: PathBuf,
    /// How many, up to 100000
    #[arg(short, long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=MOST_SCENARIOS))]
    number: u32,
    /// All draws follow from it [default: the study's]
    #[arg(long, value_name = "S", value_parser = seed())]
    seed: Option<u64>,
    /// Folder for the scenarios
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Replace scenarios drawn earlier; only files that `generate` has listed there are removed
    #[arg(long)]
    force: bool,
}

/// More than anyone looks at.
const MOST_SCENARIOS: i64 = 100_000;
/// Whose files are listed.
const COMMAND: &str = "metrotwin generate";
/// Folder for the copies of what the scenarios name.
const INPUTS: &str = "inputs";
/// The table of all scenarios: it is written last.
const INDEX: &str = "index.csv";

pub(super) fn generate(args: &GenerateArgs) -> Result<(), Failure> {
    let template = load_template(&args.scenario, &[])?.with(args.seed, Some(args.number));
    let samples = (0..u64::from(args.number)).map(|k| template.sample(k));
    let samples = samples.collect::<Result<Vec<_>, _>>();
    let samples =
        samples.map_err(|e| Failure::input(e, "ease the conditions under study.require"))?;
    let inputs = Inputs::of(&template).map_err(Failure::run)?;
    let copies = inputs.copies(Path::new(INPUTS));
    let copies = copies.map(|path| path.to_string_lossy().into_owned());
    let names: Vec<String> = samples.iter().map(|s| file_name(&template, s)).collect();
    let all: Vec<String> = copies.chain(names).chain([INDEX.to_owned()]).collect();
    claim(args, &all)?;
    for copy in inputs.contents(Path::new(INPUTS)) {
        let (path, bytes) = copy.map_err(Failure::run)?;
        go_on(args, &path, &bytes)?;
    }
    // Nothing is written unless all of them can be.
    for sample in &samples {
        let text = template.text_of(sample, &inputs, Path::new(INPUTS))?;
        let name = file_name(&template, sample);
        go_on(args, Path::new(&name), text.as_bytes())?;
    }
    prepare(&args.out)?;
    write(&args.out, all, &template, &inputs, &samples)
        .map_err(|e| Failure::run(anyhow::Error::new(e).context("cannot write the scenarios")))?;
    let rejected: u64 = samples.iter().map(|d| u64::from(d.rejected)).sum();
    print(&format!(
        "{} scenarios in {}; {rejected} draws did not meet the conditions",
        samples.len(),
        args.out.display()
    ))
}

fn file_name(template: &Template, sample: &ScenarioSample) -> String {
    format!("{}_{:06}.toml", template.file.name, sample.index)
}

/// Refuses to write over files of others, and to replace scenarios without `--force`. A set whose table is
/// missing was interrupted: it is gone on with where it has no other files.
fn claim(args: &GenerateArgs, names: &[String]) -> Result<(), Failure> {
    let out = args.out.display();
    let unusable = |error: io::Error| unusable(&args.out, &error);
    let names = names.iter().map(String::as_str);
    if let Some(name) = files::foreign(&args.out, COMMAND, names.clone()).map_err(unusable)? {
        return Err(unusable(files::why_foreign(&args.out, COMMAND, name)));
    }
    if args.out.join(INDEX).exists() && !args.force {
        return Err(Failure::input(
            format!("{out} holds scenarios drawn earlier"),
            "choose another folder with --out, or give --force to replace them",
        ));
    }
    let names: BTreeSet<&str> = names.collect();
    let listed = Listing::read(&args.out, COMMAND).map_err(unusable)?;
    let mut others = listed.iter().flatten();
    match others.find(|name| !names.contains(name.as_str()) && args.out.join(name).exists()) {
        Some(name) if !args.force => Err(another_draw(args, name)),
        _ => Ok(()),
    }
}

/// Refuses to replace a file of an interrupted set by another one without `--force`.
fn go_on(args: &GenerateArgs, name: &Path, bytes: &[u8]) -> Result<(), Failure> {
    match read_input(&args.out.join(name)) {
        Ok(kept) if kept == bytes => Ok(()),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        _ if args.force => Ok(()),
        _ => Err(another_draw(args, &name.to_string_lossy())),
    }
}

fn another_draw(args: &GenerateArgs, name: &str) -> Failure {
    Failure::input(
        format!(
            "{} holds {name} of another draw, which was interrupted, or changed since",
            args.out.display()
        ),
        "give the study, number and seed of that draw to go on with it, choose another folder with --out, \
         or give --force to replace it",
    )
}

/// Writes all files, of which `names` are the names.
fn write(
    out: &Path,
    names: Vec<String>,
    template: &Template,
    inputs: &Inputs,
    samples: &[ScenarioSample],
) -> io::Result<()> {
    let listing = Listing::claim(out, COMMAND, names)?;
    files::remove(&out.join(INDEX))?;
    inputs.copy_to(&out.join(INPUTS), files::write_whole)?;
    for sample in samples {
        let text = template.text_of(sample, inputs, Path::new(INPUTS));
        let text = text.map_err(io::Error::other)?;
        files::write_whole(&out.join(file_name(template, sample)), text.as_bytes())?;
    }
    listing.close()?;
    let index = index(template, samples).map_err(io::Error::other)?;
    files::write_whole(&out.join(INDEX), &index)
}

/// The table of all scenarios, as comma-separated values.
fn index(template: &Template, samples: &[ScenarioSample]) -> Result<Vec<u8>, csv::Error> {
    let mut index = csv::Writer::from_writer(Vec::new());
    let variables = template.settings.variables.keys().map(String::as_str);
    let head = ["index", "file", "seed", "rejected", "weight"]
        .into_iter()
        .chain(variables);
    index.write_record(head)?;
    for sample in samples {
        let about = [
            sample.index.to_string(),
            file_name(template, sample),
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
    index.into_inner().map_err(|e| e.into_error().into())
}
