//! Units, which the names of keys end with.

/// Endings of keys with their units.
const UNITS: [(&str, &str); 50] = [
    ("_c", "deg C"),
    ("_c_per_m", "deg C/m"),
    ("_cd", "cd"),
    ("_db", "dB"),
    ("_dbi", "dBi"),
    ("_dbm", "dBm"),
    ("_deg", "deg"),
    ("_deg_h", "deg/h"),
    ("_deg_s", "deg/s"),
    ("_deg_sqrt_h", "deg/sqrt(h)"),
    ("_e", "e"),
    ("_e_per_s", "e/s"),
    ("_g", "g"),
    ("_ghz", "GHz"),
    ("_grey", "grey"),
    ("_hz", "Hz"),
    ("_kg", "kg"),
    ("_kg_m2", "kg m^2"),
    ("_kg_per_m", "kg/m"),
    ("_kmh", "km/h"),
    ("_kn", "kN"),
    ("_kn_s_m", "kN s/m"),
    ("_kw", "kW"),
    ("_lm_per_w", "lm/W"),
    ("_lx", "lx"),
    ("_m", "m"),
    ("_m2", "m^2"),
    ("_mg", "mg"),
    ("_mhz", "MHz"),
    ("_mm", "mm"),
    ("_mn_m", "MN/m"),
    ("_mn_m_rad", "MN m/rad"),
    ("_mps", "m/s"),
    ("_mps2", "m/s^2"),
    ("_mps3", "m/s^3"),
    ("_mps_sqrt_h", "m/s/sqrt(h)"),
    ("_ms", "ms"),
    ("_ms_per_s", "ms/s"),
    ("_n", "N"),
    ("_per_m", "1/m"),
    ("_per_s", "1/s"),
    ("_permille", "permille"),
    ("_px", "px"),
    ("_rad", "rad"),
    ("_rad_s", "rad/s"),
    ("_rows", "rows"),
    ("_s", "s"),
    ("_um", "um"),
    ("_us", "us"),
    ("_w", "W"),
];

/// What keys count.
const COUNTS: [&str; 4] = ["cars", "runs", "points", "trains"];

/// The unit that the end of a key names.
pub fn unit_in(key: &str) -> Option<&'static str> {
    let fitting = UNITS.iter().filter(|(ending, _)| key.ends_with(ending));
    let longest = fitting.max_by_key(|(ending, _)| ending.len());
    longest.map(|(_, unit)| *unit)
}

/// The unit of a key, or what it counts; empty for a number without either.
pub(super) fn of_key(key: &str) -> &'static str {
    let counted = || COUNTS.into_iter().find(|count| key.ends_with(count));
    unit_in(key).or_else(counted).unwrap_or_default()
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
