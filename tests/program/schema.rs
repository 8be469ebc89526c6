//! The JSON Schemas in the repository are those of the types.

use metrotwin::scenario::ScenarioFile;
use metrotwin::session::Summary;
use metrotwin::settings::{self, Problem, Settings};
use metrotwin::track::TunnelFile;
use metrotwin::twin::physics::VehicleFile;
use schemars::generate::SchemaSettings;
use schemars::{JsonSchema, schema_for};
use serde::{Serialize, de::DeserializeOwned};
use serde_json::Value as Json;
use std::marker::PhantomData;
use std::path::Path;

/// Fails when a settings struct or the summary changed (a key, a default, a doc comment) and its schema did
/// not.
/// `METROTWIN_WRITE_SCHEMAS=1 cargo test --release --test program schema` writes them anew.
#[test]
fn schemas_are_up_to_date() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for (path, schema) in [
        ("scenarios/scenario.schema.json", schema_for!(ScenarioFile)),
        (
            "scenarios/vehicles/vehicle.schema.json",
            schema_for!(VehicleFile),
        ),
        ("tunnels/tunnel.schema.json", schema_for!(TunnelFile)),
        (
            "docs/summary.schema.json",
            SchemaSettings::default()
                .for_serialize()
                .into_generator()
                .into_root_schema_for::<Summary>(),
        ),
    ] {
        let text = serde_json::to_string_pretty(&schema).expect("the types have schemas") + "\n";
        let file = root.join(path);
        if std::env::var_os("METROTWIN_WRITE_SCHEMAS").is_some() {
            std::fs::write(&file, &text).expect("the schema can be written");
        }
        let kept = std::fs::read_to_string(&file).unwrap_or_default();
        assert!(
            kept == text,
            "{path} is not what the types say; run\n  \
             METROTWIN_WRITE_SCHEMAS=1 cargo test --release --test program schema\nand commit the result"
        );
    }
}

/// Fails when a time, delay or rate may have any value: one that is too long or too short overflows the
/// clock, or takes any time and memory.
#[test]
fn every_time_and_rate_is_bounded() {
    let mut bounded = 0;
    for schema in [
        schema_for!(ScenarioFile),
        schema_for!(VehicleFile),
        schema_for!(TunnelFile),
    ] {
        times_are_bounded(schema.as_value(), &mut bounded);
    }
    assert!(bounded > 50, "{bounded}");
}

fn times_are_bounded(schema: &Json, bounded: &mut u32) {
    let of_time = |key: &str| {
        let unit = settings::unit_in(key);
        unit.is_some_and(|unit| ["s", "ms", "us", "Hz", "1/s"].contains(&unit))
    };
    let properties = schema["properties"].as_object().into_iter().flatten();
    for (key, property) in properties.filter(|(key, _)| of_time(key)) {
        let numbers = property.get("items").unwrap_or(property);
        let kind = numbers["type"].to_string();
        if kind.contains("number") || kind.contains("integer") {
            let has = |limit: &str| numbers[limit].is_number();
            assert!(has("minimum") && has("maximum"), "{key} has no bounds");
            *bounded += 1;
        }
    }
    match schema {
        Json::Object(parts) => parts.values().for_each(|p| times_are_bounded(p, bounded)),
        Json::Array(parts) => parts.iter().for_each(|p| times_are_bounded(p, bounded)),
        _ => {}
    }
}

/// One of everything that has a range: keys that are left out by default are given.
const SCENARIO: &str = r#"
    name = "all"
    tunnel = "given"
    stop_after_standstill_s = 1.0
    train = { stop_at_m = 500.0 }
    other_trains = [{}]
    rig = { lens = { focus_m = 5.0 }, exposure_control = { max_exposure_us = 30.0 } }
    doppler = {}
    radar = { road = {} }
    bench = {}
    air = { visibility_m = 100.0 }
    wayside = [{ device = "W", lidar = {} }]
    workers = [{ path = [{ time_s = 0.0, chainage_m = 1.0, lateral_m = 0.0 }] }]
    cables = [{ from = { lets_go_s = 1.0 } }]
    stack = { protection = { initial_chainage_m = 0.0 } }

    [track]
    rail_zones = [{ from_m = 0.0, to_m = 1.0, rail = "wet" }]
    defects = [
        { chainage_m = 1.0, every_m = 5.0, shape = { kind = "joint", depth_m = 0.01, half_length_m = 1.0 } },
        { chainage_m = 1.0, shape = { kind = "dip", depth_m = 0.01, half_length_m = 1.0 } },
        { chainage_m = 1.0, shape = { kind = "slab", depth_m = 0.01, length_m = 9.0, ramp_m = 2.0 } },
        { chainage_m = 1.0, shape = { kind = "corrugation", amplitude_m = 1e-4, wavelength_m = 0.3, length_m = 9.0 } },
    ]

    [[obstacles]]
    held_until_s = 1.0
    hinge = { edge = "top", until_s = 2.0 }
    [[obstacles]]
    body = { shape = "cylinder", diameter_m = 0.1, height_m = 0.1 }
    [[obstacles]]
    body = { shape = "sphere", diameter_m = 0.1 }
    [[obstacles]]
    body = { shape = "rock", diameter_m = 0.1 }

    [faults]
    lamps = [
        { from_m = 0.0, to_m = 1.0, fault = { kind = "flicker", phase_deg = 1.0 } },
        { fault = { kind = "dim", level = 0.5 } },
    ]
    cameras = [
        { camera = "rig", fault = { kind = "drop" } },
        { camera = "rig", fault = { kind = "late", by_ms = 1.0 } },
    ]

    [study]
    variables.x = { from = { uniform = { min = 0.0, max = 1.0 } } }
    stop = { after_s = 1.0, when = { of = "x", half_width = 1.0 } }
"#;

/// Fails when a range stands in a schema and is not checked, or the other way about, or when a
/// default lies outside of its range.
#[test]
fn ranges_of_the_schemas_are_those_that_are_checked() {
    let scenario = settings::read_toml(SCENARIO).expect("its keys are right");
    assert!(Ranges::<ScenarioFile>::of(&scenario).hold() > 300);
    let car = VehicleFile::shipped("manchester").expect("it comes with the program");
    assert!(Ranges::of(car).hold() > 25);
    let text = include_str!("../../tunnels/chengdu_line1.toml");
    let tunnel = settings::read_toml(text).expect("its keys are right");
    assert!(Ranges::<TunnelFile>::of(&tunnel).hold() > 40);
}

/// A file as written in full, and the schema of its kind.
struct Ranges<F> {
    document: toml::Value,
    schema: Json,
    kind: PhantomData<F>,
}

/// A number with a range: where it is in the document, and its key as problems have it.
struct Place<'s> {
    pointer: Vec<String>,
    key: String,
    schema: &'s Json,
}

impl<F: Settings + Serialize + DeserializeOwned + JsonSchema> Ranges<F> {
    fn of(file: &F) -> Self {
        Self {
            document: toml::Value::try_from(file).expect("a file can be written"),
            schema: schemars::schema_for!(F).to_value(),
            kind: PhantomData,
        }
    }

    /// Checks every range from both sides of both of its ends; how many there are.
    fn hold(&self) -> usize {
        let mut places = Vec::new();
        self.collect(
            &self.document,
            &self.schema,
            Vec::new(),
            String::new(),
            &mut places,
        );
        for place in &places {
            let limit = |name: &str| place.schema[name].as_f64().expect("a limit is a number");
            let (low, high) = (limit("minimum"), limit("maximum"));
            let default = place.schema["default"].as_f64();
            assert!(
                default.is_none_or(|d| (low..=high).contains(&d)),
                "{}",
                place.key
            );
            let whole = place.schema["type"] == "integer";
            let step = f64::from(u8::from(whole));
            let range = format!("give {low} to {high}");
            let refuses = |value: f64| {
                let problems = self.problems_with(place, value);
                problems.is_none_or(|list| {
                    let of_key = list.iter().find(|p| p.key == place.key);
                    of_key.is_some_and(|p| p.remedy.starts_with(&range))
                })
            };
            for (inside, outside) in [(low, low.next_down() - step), (high, high.next_up() + step)]
            {
                assert!(!refuses(inside), "{} = {inside} is refused", place.key);
                assert!(refuses(outside), "{} = {outside} is taken", place.key);
            }
            assert!(whole || refuses(f64::NAN), "{} takes NaN", place.key);
        }
        places.len()
    }

    /// What is wrong with the file when a number is another; `None` where its type cannot hold it.
    fn problems_with(&self, place: &Place<'_>, number: f64) -> Option<Vec<Problem>> {
        let mut document = self.document.clone();
        let value = place
            .pointer
            .iter()
            .fold(&mut document, |value, step| match value {
                toml::Value::Array(list) => &mut list[step.parse::<usize>().expect("an index")],
                table => &mut table[step.as_str()],
            });
        *value = match value {
            toml::Value::Integer(_) => toml::Value::Integer(number.round() as i64),
            _ => toml::Value::Float(number),
        };
        let file = F::deserialize(document).ok()?;
        let mut problems = Vec::new();
        file.check("", &mut problems);
        Some(problems)
    }

    fn collect<'s>(
        &'s self,
        value: &toml::Value,
        schema: &'s Json,
        pointer: Vec<String>,
        key: String,
        places: &mut Vec<Place<'s>>,
    ) {
        let schema = self.resolved(schema, value);
        let step = |step: String| [pointer.clone(), vec![step]].concat();
        match value {
            toml::Value::Table(table) => {
                for (name, value) in table {
                    let below = settings::key_below(&key, name);
                    let schema = match &schema["properties"][name] {
                        Json::Null => &schema["additionalProperties"],
                        own => own,
                    };
                    self.collect(value, schema, step(name.clone()), below, places);
                }
            }
            toml::Value::Array(list) => {
                for (k, value) in list.iter().enumerate() {
                    let key = if value.is_table() {
                        format!("{key}[{k}]")
                    } else {
                        key.clone()
                    };
                    self.collect(value, &schema["items"], step(k.to_string()), key, places);
                }
            }
            _ if schema["maximum"].is_number() => places.push(Place {
                pointer,
                key,
                schema,
            }),
            _ => {}
        }
    }

    /// A schema with its reference followed: of an optional part the part, of a choice what the
    /// value has chosen.
    fn resolved<'s>(&'s self, schema: &'s Json, value: &toml::Value) -> &'s Json {
        let fits = |choice: &&Json| {
            let properties = choice["properties"].as_object();
            properties.is_some_and(|properties| {
                let mut tags = properties.iter().filter(|(_, p)| p["const"].is_string());
                tags.any(|(tag, p)| value.get(tag).and_then(|v| v.as_str()) == p["const"].as_str())
            })
        };
        if let Some(name) = schema["$ref"].as_str() {
            let name = name.trim_start_matches("#/$defs/");
            self.resolved(&self.schema["$defs"][name], value)
        } else if schema["anyOf"].is_array() {
            self.resolved(&schema["anyOf"][0], value)
        } else if let Some(choices) = schema["oneOf"].as_array() {
            choices.iter().find(fits).unwrap_or(&Json::Null)
        } else {
            schema
        }
    }
}
