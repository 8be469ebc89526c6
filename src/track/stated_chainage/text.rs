//! Stated chainages as text: `DK12+340.000`, `km 12.340`.

use super::StatedChainage;

/// Digits after the point of metres in messages: millimetres.
const DECIMALS: usize = 3;

/// Why a text names no place of a track.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ChainageError {
    /// It is written in another way.
    #[error("`{text}` is no chainage; write it like `{example}`")]
    Unreadable {
        /// The text.
        text: String,
        /// What is stated where the track begins.
        example: String,
    },
    /// It has the prefix of another line or track.
    #[error("`{text}` begins with `{found}`; on this track write it like `{example}`")]
    Prefix {
        /// The text.
        text: String,
        /// Its prefix.
        found: String,
        /// What is stated where the track begins.
        example: String,
    },
    /// It is stated in several regions.
    #[error("`{text}` is stated at several places; write one of {choices}")]
    Ambiguous {
        /// The text.
        text: String,
        /// The same with their regions.
        choices: String,
    },
    /// It is left out by a short chain, or lies beyond the ends of the track or of the region that is named.
    #[error("`{text}` is not stated on this track; the nearest: {nearest}")]
    Nowhere {
        /// The text.
        text: String,
        /// The nearest that are stated.
        nearest: String,
    },
    /// It names a region that is not there.
    #[error(
        "`{text}` names region R{region}; this track has {count}, counted from R1 at its begin"
    )]
    NoRegion {
        /// The text.
        text: String,
        /// The region that it names.
        region: usize,
        /// How many there are.
        count: usize,
    },
}

/// What a text says.
struct Written<'t> {
    /// Letters before the number.
    word: &'t str,
    stated_m: f64,
    /// Counted from 1.
    region: Option<usize>,
}

impl StatedChainage {
    /// What is stated at a place, to so many digits of a metre: `DK12+340.000`, or `km 12.340000` where there is no
    /// prefix; with its region where it is stated in another one too.
    pub fn text(&self, s_m: f64, decimals: usize) -> String {
        self.text_in(self.region_at(s_m), self.stated_m(s_m), decimals)
    }

    /// The place that a text names, metres from the begin of the track.
    pub fn place(&self, text: &str) -> Result<f64, ChainageError> {
        let written = self.written(text)?;
        let stated_m = written.stated_m;
        let places = match written.region {
            None => self.places_m(stated_m),
            Some(number) => {
                let region = number.checked_sub(1).and_then(|k| self.regions.get(k));
                let region = region.ok_or_else(|| ChainageError::NoRegion {
                    text: text.to_owned(),
                    region: number,
                    count: self.regions.len(),
                })?;
                region.place_m(stated_m).into_iter().collect()
            }
        };
        match places[..] {
            [place] => Ok(place),
            [] => Err(ChainageError::Nowhere {
                text: text.to_owned(),
                nearest: self.nearest(&written),
            }),
            _ => Err(ChainageError::Ambiguous {
                text: text.to_owned(),
                choices: self.choices(stated_m),
            }),
        }
    }

    fn written<'t>(&self, text: &'t str) -> Result<Written<'t>, ChainageError> {
        let example = || self.text(0.0, DECIMALS);
        let written = read(text).ok_or_else(|| ChainageError::Unreadable {
            text: text.to_owned(),
            example: example(),
        })?;
        let word = written.word;
        let is_prefix = word.to_lowercase() == self.prefix.to_lowercase();
        if word.is_empty() || is_km(word) || is_prefix {
            return Ok(written);
        }
        Err(ChainageError::Prefix {
            text: text.to_owned(),
            found: word.to_owned(),
            example: example(),
        })
    }

    /// A text with its region, where another one states the same.
    fn text_in(&self, region: usize, stated_m: f64, decimals: usize) -> String {
        let number = self.number(stated_m, decimals);
        let scale = 10f64.powi(decimals as i32);
        let rounded_m = (stated_m * scale).round() / scale;
        let mut others = self.regions.iter().enumerate();
        match others.any(|(k, other)| k != region && other.states(rounded_m)) {
            true => format!("{number} R{}", region + 1),
            false => number,
        }
    }

    /// A stated chainage to so many digits of a metre, without its region.
    pub fn number(&self, stated_m: f64, decimals: usize) -> String {
        // Rounded first, so that no 1000 m stand after 12 km.
        let units = 10u64.pow(decimals as u32);
        let count = (stated_m.abs() * units as f64).round() as u64;
        let sign = if stated_m < 0.0 && count > 0 { "-" } else { "" };
        let (km, metres) = (count / (1000 * units), count / units % 1000);
        let part = match decimals {
            0 => String::new(),
            _ => format!("{:0decimals$}", count % units),
        };
        match (self.prefix.is_empty(), decimals) {
            (true, _) => format!("km {sign}{km}.{metres:03}{part}"),
            (false, 0) => format!("{}{sign}{km}+{metres:03}", self.prefix),
            (false, _) => format!("{}{sign}{km}+{metres:03}.{part}", self.prefix),
        }
    }

    fn choices(&self, stated_m: f64) -> String {
        let regions = self.regions.iter().enumerate();
        let regions = regions.filter(|(_, region)| region.states(stated_m));
        let texts = regions.map(|(k, _)| format!("`{}`", self.text_in(k, stated_m, DECIMALS)));
        texts.collect::<Vec<_>>().join(", ")
    }

    /// The next below and above a chainage that are stated, in the region that is named, if one is.
    fn nearest(&self, written: &Written<'_>) -> String {
        let regions = self.regions.iter().enumerate();
        let named = |k: usize| written.region.is_none_or(|number| number == k + 1);
        let bounds: Vec<(usize, f64)> = regions
            .filter(|(k, _)| named(*k))
            .flat_map(|(k, r)| [(k, *r.range_m().start()), (k, *r.range_m().end())])
            .collect();
        let stated_m = written.stated_m;
        let below = bounds.iter().filter(|b| b.1 < stated_m);
        let above = bounds.iter().filter(|b| b.1 > stated_m);
        let nearest = [
            below.max_by(|a, b| a.1.total_cmp(&b.1)),
            above.min_by(|a, b| a.1.total_cmp(&b.1)),
        ];
        let texts = nearest.into_iter().flatten();
        let texts = texts.map(|(k, m)| format!("`{}`", self.text_in(*k, *m, DECIMALS)));
        texts.collect::<Vec<_>>().join(" and ")
    }
}

/// Word, number and region of a text: `DK12+340.0 R2`, `12+340`, `km 12.340`; small and capital letters are the same.
fn read(text: &str) -> Option<Written<'_>> {
    let (rest, region) = without_region(text.trim());
    let (word, number) = rest.split_at(rest.find(|c: char| !c.is_alphabetic())?);
    let number = number.trim_start();
    let (sign, number) = match number.strip_prefix('-') {
        Some(number) => (-1.0, number),
        None => (1.0, number),
    };
    let size_m = match number.split_once('+') {
        Some((km, metres)) => {
            let (km, metres_m) = (whole(km)?, decimal(metres)?);
            (metres_m < 1000.0).then_some(1000.0 * km + metres_m)?
        }
        None if is_km(word) => 1000.0 * decimal(number)?,
        // Metres or kilometres?
        None => return None,
    };
    Some(Written {
        word,
        stated_m: sign * size_m,
        region,
    })
}

fn is_km(word: &str) -> bool {
    word.eq_ignore_ascii_case("km")
}

/// A text without the region after it, and that.
fn without_region(text: &str) -> (&str, Option<usize>) {
    let parts = text.rsplit_once(char::is_whitespace);
    let region = parts.and_then(|(_, last)| last.strip_prefix(['R', 'r']));
    match (parts, region.and_then(|number| number.parse().ok())) {
        (Some((rest, _)), Some(number)) => (rest.trim_end(), Some(number)),
        _ => (text, None),
    }
}

fn whole(text: &str) -> Option<f64> {
    let digits = text.bytes().all(|b| b.is_ascii_digit());
    digits.then(|| text.parse().ok())?
}

/// Without sign and exponent.
fn decimal(text: &str) -> Option<f64> {
    let digits = text.bytes().all(|b| b.is_ascii_digit() || b == b'.');
    digits.then(|| text.parse().ok())?
}
