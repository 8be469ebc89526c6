//! Texts for people, as templates that see what is serialised.

use minijinja::value::Serde;
use minijinja::{Environment, Error, UndefinedBehavior, Value};
use serde::Serialize;

/// Fills a template. In one whose name ends with `.html` every value is escaped. Beside the filters
/// of Jinja there are `fixed(digits)` and `short` for numbers, and `left(width)` and `right(width)` for
/// columns.
pub fn render(name: &str, source: &str, values: impl Serialize) -> Result<String, Error> {
    let mut environment = Environment::new();
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    environment.add_filter("fixed", |x: f64, digits: usize| format!("{x:.digits$}"));
    environment.add_filter("short", short);
    environment.add_filter("left", |text: Value, width: usize| {
        format!("{:<width$}", text.to_string())
    });
    environment.add_filter("right", |text: Value, width: usize| {
        format!("{:>width$}", text.to_string())
    });
    environment.render_named_str(name, source, Serde(values))
}

/// Four digits behind the point, none of a whole number; very large and very small ones in powers of ten.
fn short(x: f64) -> String {
    match x.abs() {
        size if size > 1e9 || size > 0.0 && size < 1e-3 => format!("{x:.3e}"),
        size if size.fract() > 0.0 => format!("{x:.4}"),
        _ => format!("{x:.0}"),
    }
}
