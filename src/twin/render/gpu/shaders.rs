//! The shaders' sources.

use super::layout;
use crate::twin::lights::HEADLIGHT_RADIUS_M;
use crate::twin::render::constants::{BRIGHTEST_E, GLARE_STEP_PX};
use crate::twin::render::disc::DISC_PLACES;
use crate::twin::render::gloss::MIRROR_REACH_M;
use crate::twin::render::photometry::OFFSET_M;
use crate::twin::render::pixel_map::{GAIN_STEP, HOT, LEVEL_SHIFT};

macro_rules! files {
    ($($name:literal),*) => {
        [$(($name, include_str!(concat!("../../../../shaders/", $name, ".wgsl")))),*]
    };
}

/// Name and text of every file in `shaders/`.
const FILES: [(&str, &str); 11] = files![
    "common",
    "rows",
    "background",
    "gloss",
    "clear",
    "blend",
    "focus",
    "lamps",
    "glare",
    "sensor",
    "shadows"
];

/// The complete source of `shaders/<name>.wgsl`: constants, what it shares with others, and the file.
pub fn shader_source(name: &str) -> Option<String> {
    let text = |name: &str| FILES.iter().find(|(n, _)| *n == name).map(|(_, t)| *t);
    let before: &[&str] = match name {
        "common" => &[],
        "background" | "gloss" => &["common", "rows"],
        _ => &["common"],
    };
    let mut source = constants();
    for shared in before {
        source.push_str(text(shared)?);
    }
    source.push_str(text(name)?);
    Some(source)
}

/// Declarations of the constants that the shaders share with the rest of the program.
fn constants() -> String {
    let reals = [
        ("BRIGHTEST_E", BRIGHTEST_E),
        ("NEAR_M", layout::NEAR_M),
        ("GLARE_STEP_PX", GLARE_STEP_PX),
        ("MIRROR_REACH_M", MIRROR_REACH_M),
        ("HEADLIGHT_RADIUS_M", HEADLIGHT_RADIUS_M),
        ("OFFSET_M", OFFSET_M),
        ("GAIN_STEP", GAIN_STEP),
    ];
    let integers = [
        ("MAX_HEADLIGHTS", layout::MAX_HEADLIGHTS as u32),
        ("MAX_WORDS", layout::MAX_WORDS as u32),
        ("MAX_SOURCES", layout::MAX_SOURCES as u32),
        ("MAX_BLOCKERS", layout::MAX_BLOCKERS as u32),
        ("MAX_SLABS", layout::MAX_SLABS as u32),
        ("PLACES", DISC_PLACES as u32),
        ("HOT", HOT),
        ("LEVEL_SHIFT", LEVEL_SHIFT),
    ];
    let reals = reals.map(|(name, value)| format!("const {name}: f32 = {value:?};\n"));
    let integers = integers.map(|(name, value)| format!("const {name}: u32 = {value}u;\n"));
    reals.concat() + &integers.concat()
}
