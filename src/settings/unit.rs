//! Units, which the names of keys end with.

/// Units that messages write as keys do.
const AS_IN_KEYS: [&str; 18] = [
    "cars", "cd", "deg", "e", "g", "kg", "m", "mg", "mm", "ms", "points", "px", "rows", "runs",
    "s", "trains", "um", "us",
];

/// Other endings of keys, and the unit as messages have it.
const UNITS: [(&str, &str); 26] = [
    ("_c", "deg C"),
    ("_db", "dB"),
    ("_deg_h", "deg/h"),
    ("_deg_s", "deg/s"),
    ("_deg_sqrt_h", "deg/sqrt(h)"),
    ("_e_per_s", "e/s"),
    ("_ghz", "GHz"),
    ("_hz", "Hz"),
    ("_kg_m2", "kg m^2"),
    ("_kg_per_m", "kg/m"),
    ("_kmh", "km/h"),
    ("_kn_s_m", "kN s/m"),
    ("_lm_per_w", "lm/W"),
    ("_lx", "lx"),
    ("_mn_m", "MN/m"),
    ("_mn_m_rad", "MN m/rad"),
    ("_mps", "m/s"),
    ("_mps2", "m/s^2"),
    ("_mps3", "m/s^3"),
    ("_mps_sqrt_h", "m/s/sqrt(h)"),
    ("_n", "N"),
    ("_per_m", "1/m"),
    ("_per_s", "1/s"),
    ("_permille", "permille"),
    ("_rad_s", "rad/s"),
    ("_w", "W"),
];

/// The unit of a key; empty for a number without one.
pub(super) fn of_key(key: &str) -> &'static str {
    let fitting = UNITS.iter().filter(|(ending, _)| key.ends_with(ending));
    let longest = fitting.max_by_key(|(ending, _)| ending.len());
    let last_word = key.rsplit(['_', '.']).next().unwrap_or(key);
    let as_in_key = AS_IN_KEYS.into_iter().find(|unit| *unit == last_word);
    longest.map(|(_, unit)| *unit).or(as_in_key).unwrap_or("")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fails where a shorter ending wins over a longer one, or a plain word is taken for a unit.
    #[test]
    fn the_longest_ending_counts() {
        for (key, unit) in [
            ("spacing_m", "m"),
            ("secondary.stiffness_mn_m", "MN/m"),
            ("angle_random_walk_deg_sqrt_h", "deg/sqrt(h)"),
            ("dark_current_e_per_s", "e/s"),
            ("pairs_per_s", "1/s"),
            ("blooming", ""),
            ("gate_share", ""),
        ] {
            assert_eq!(of_key(key), unit, "{key}");
        }
    }
}
