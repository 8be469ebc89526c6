//! Colours and widths, the same for the same thing in every pane.

use crate::bus::{DangerLevel, Identity, Indicator, Method};
use crate::track::Material;
use re_sdk_types::components::{Color, Radius};

/// As it really is.
pub(super) const TRUTH: Color = rgb(240, 240, 240);
/// Cars.
pub(super) const TRAIN: Color = rgb(70, 130, 200);
/// Obstacles as they really are.
pub(super) const BODY: Color = rgb(205, 120, 60);
/// Lamps on the wall.
pub(super) const LAMP: Color = rgb(255, 236, 150);
/// Camera frusta.
pub(super) const CAMERA: Color = rgb(120, 220, 255);
/// Fixes of a satellite receiver.
pub(super) const GNSS: Color = rgb(255, 190, 70);
/// Rails.
pub(super) const RAIL: Color = rgb(190, 195, 205);
/// Balises.
pub(super) const BALISE: Color = rgb(250, 200, 0);
/// A lamp in an image that has no name.
pub(super) const UNNAMED: Color = rgb(255, 150, 60);
/// A region of a wayside image that is not (yet) an obstacle.
pub(super) const BLOB: Color = rgb(130, 160, 190);

/// An opaque colour.
pub(super) const fn rgb(r: u8, g: u8, b: u8) -> Color {
    Color(re_sdk_types::datatypes::Rgba32(u32::from_be_bytes([
        r, g, b, 255,
    ])))
}

/// Name and colour of an estimator.
pub(super) fn method(method: Method) -> (&'static str, Color) {
    match method {
        Method::Stereo => ("paper", rgb(255, 110, 180)),
        Method::Mono => ("mono", rgb(255, 190, 70)),
    }
}

/// Of a lamp's name, by how it was found.
pub(super) fn identity(identity: Identity) -> Color {
    match identity {
        Identity::Decoded => rgb(90, 230, 120),
        Identity::Joined => rgb(90, 200, 255),
        Identity::Followed => rgb(150, 160, 255),
        Identity::Predicted => rgb(255, 230, 90),
    }
}

/// Of an obstacle.
pub(super) fn danger(danger: DangerLevel) -> Color {
    match danger {
        DangerLevel::None => rgb(120, 220, 140),
        DangerLevel::Low => rgb(255, 190, 60),
        DangerLevel::High => rgb(255, 70, 70),
    }
}

/// Of the driver's lamp, with its name.
pub(super) fn driver_lamp(lamp: Indicator) -> (&'static str, &'static str) {
    match lamp {
        Indicator::NormalGreen => ("green", "run"),
        Indicator::BrakeWarningRed => ("RED + buzzer", "brake"),
        Indicator::Emergency => ("EMERGENCY + buzzer", "brake by hand"),
    }
}

/// Of a surface. Every other ring is darker, so that one sees distance and motion.
pub(super) fn material(material: Material, ring: usize) -> Color {
    let [r, g, b] = match material {
        Material::Lining => [112, 116, 122],
        Material::Bed => [78, 72, 66],
        Material::Walkway => [132, 124, 104],
        Material::Rail => [170, 175, 185],
        Material::Platform => [150, 135, 115],
    };
    if ring.is_multiple_of(2) {
        Color::from_rgb(r, g, b)
    } else {
        Color::from_rgb(r - r / 4, g - g / 4, b - b / 4)
    }
}

/// Of a track that a train may be on, by how probable that is: grey to green.
pub(super) fn probability(probability: f64) -> Color {
    let share = probability.clamp(0.0, 1.0);
    let mix = |from: f64, to: f64| (from + (to - from) * share) as u8;
    Color::from_rgb(mix(120.0, 60.0), mix(120.0, 235.0), mix(130.0, 110.0))
}

/// A width on the screen, whatever the distance.
pub(super) fn ui(points: f32) -> Radius {
    Radius::new_ui_points(points)
}
