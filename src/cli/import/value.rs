//! Values of options, as they are given in text.

use crate::track::geodesy::Geodetic;

/// Latitude and longitude.
pub(super) fn place(text: &str) -> Result<Geodetic, String> {
    let numbers: Vec<f64> = text
        .split(',')
        .filter_map(|part| part.trim().parse().ok())
        .collect();
    match numbers[..] {
        [latitude_deg, longitude_deg]
            if latitude_deg.abs() <= 85.0 && longitude_deg.abs() <= 180.0 =>
        {
            Ok(Geodetic {
                latitude_deg,
                longitude_deg,
                height_m: 0.0,
            })
        }
        _ => Err("give latitude and longitude in degrees, as in 48.2085,15.6240".to_owned()),
    }
}

pub(super) fn metres(text: &str) -> Result<f64, String> {
    number(text, 1.0, 1e6)
}

/// Degrees.
pub(super) fn heading(text: &str) -> Result<f64, String> {
    number(text, -360.0, 360.0)
}

pub(super) fn sigma(text: &str) -> Result<f64, String> {
    number(text, 0.01, 10.0)
}

fn number(text: &str, least: f64, most: f64) -> Result<f64, String> {
    let number = text
        .trim()
        .parse()
        .ok()
        .filter(|m| (least..=most).contains(m));
    number.ok_or_else(|| format!("give a number from {least} to {most}"))
}
