//! Recorded fixes and speeds: tables with named columns.

use crate::bus::SimTime;
use crate::stack::occupancy::Fix;
use crate::track::geodesy::{Datum, Geodetic};
use crate::track::import::{Sheet, SheetColumn, SheetError, SheetRow};
use nalgebra::Matrix2;

/// Standard deviation of a fix to the north and to the east by its kind of solution, metres, for tables that do not
/// state one: of the receivers' makers for open sky, rounded up.
const SIGMAS_M: [(&str, f64); 7] = [
    ("NARROW_INT", 0.05),
    ("WIDE_INT", 0.2),
    ("L1_INT", 0.1),
    ("FLOAT", 0.6),
    ("PSRDIFF", 1.0),
    ("SBAS", 1.5),
    ("SINGLE", 2.5),
];
/// Kind of a solution that an inertial unit carries on from the last fix through a gap of reception.
const CARRIED_ON: &str = "PROPAGATED";
/// Drift of such a solution, metres a second: with a heading that is wrong by one degree at 60 km/h.
const DRIFT_MPS: f64 = 0.3;
/// Of any other kind, or where none is stated.
const UNKNOWN_SIGMA_M: f64 = 5.0;
/// Of the frames of fixes and map against each other, metres, where a table states no covariance and so nothing of
/// its frame: a receiver's frame of today is 0.8 m from the continental one that national maps are tied to (2.5 cm a
/// year since 1989), and transformations of national grids are good to 1 m.
const FRAME_SIGMA_M: f64 = 1.3;
/// A status, where there is one, of fixes that may be used.
const COMPUTED: &str = "SOL_COMPUTED";

/// Columns of a table of fixes.
const FIXES: [SheetColumn; 8] = [
    TIMESTAMP,
    SheetColumn::needed("latitude", &["latitude_deg", "lat"]),
    SheetColumn::needed("longitude", &["longitude_deg", "lon"]),
    SheetColumn::optional("position_type", &["solution", "kind"]),
    SheetColumn::optional("solution_status", &[]),
    SheetColumn::optional("sigma_north_m", &[]),
    SheetColumn::optional("sigma_east_m", &[]),
    // Of both.
    SheetColumn::optional("covariance_m2", &[]),
];
/// Columns of a table of speeds, which are positive forwards.
const SPEEDS: [SheetColumn; 2] = [TIMESTAMP, SheetColumn::needed("speed_mps", &[])];
/// Seconds, or a date and time after ISO 8601.
const TIMESTAMP: SheetColumn = SheetColumn::needed("timestamp", &["time", "time_s"]);

/// A table of fixes.
#[derive(Debug, Default)]
pub struct RecordedFixes {
    /// In order of time, which runs from the first one on.
    pub fixes: Vec<RecordedFix>,
    /// Of the first fix, as the table's own clock has it, seconds.
    pub start_s: f64,
    /// Fixes that the receiver itself calls none.
    pub refused: usize,
    /// Rows that are not newer than the one before.
    pub out_of_order: usize,
    /// Numbers have a decimal comma.
    pub has_decimal_commas: bool,
}

/// A table of speeds.
#[derive(Debug, Default)]
pub struct RecordedSpeeds {
    /// Time since the first fix, and the speed then, m/s, forwards positive.
    pub speeds: Vec<(SimTime, f64)>,
    /// Numbers have a decimal comma.
    pub has_decimal_commas: bool,
}

/// One of them.
#[derive(Clone, Debug)]
pub struct RecordedFix {
    pub fix: Fix,
    pub place: Geodetic,
    /// Standard deviation by the kind of its solution.
    pub sigma_m: f64,
    /// Of its solution, as the receiver says.
    pub kind: String,
}

impl RecordedFixes {
    /// Of a text, in the plane of a datum.
    pub fn read(text: &str, datum: &Datum) -> Result<Self, SheetError> {
        let sheet = Sheet::read(text, &FIXES)?;
        let mut read = Self::default();
        let mut last_s = f64::NEG_INFINITY;
        let mut received: Option<(f64, f64)> = None;
        for row in sheet.rows() {
            let row = FixRow(row?);
            // What such a row holds besides, if anything, is no fix.
            if !row.is_computed() {
                read.refused += 1;
                continue;
            }
            let time_s = seconds_of(&row.0)?;
            let place = row.place()?;
            let sigma_m = match row.kind_sigma_m() {
                Some(sigma_m) => sigma_m,
                None => received.map_or(UNKNOWN_SIGMA_M, |(received_s, sigma_m)| {
                    sigma_m.hypot(DRIFT_MPS * (time_s - received_s))
                }),
            };
            let covariance_m2 = row.covariance(sigma_m, datum)?;
            if time_s <= last_s {
                read.out_of_order += 1;
                continue;
            }
            last_s = time_s;
            if row.kind_sigma_m().is_some() {
                received = Some((time_s, sigma_m));
            }
            if read.fixes.is_empty() {
                read.start_s = time_s;
            }
            read.has_decimal_commas |= row.0.has_decimal_comma("latitude");
            let fix = Fix {
                time: SimTime::from_secs(time_s - read.start_s),
                place: datum.world(&place).xy(),
                covariance_m2,
            };
            read.fixes.push(RecordedFix {
                fix,
                place,
                sigma_m,
                kind: row.kind().to_owned(),
            });
        }
        match read.fixes.is_empty() {
            true => Err(SheetError::Row {
                line: 1,
                what: "no row under the headers is a fix".to_owned(),
                remedy: format!(
                    "give rows with timestamp, latitude and longitude, and with {COMPUTED} where there is a solution_status"
                ),
            }),
            false => Ok(read),
        }
    }
}

impl RecordedSpeeds {
    /// Of a text, with times since a start.
    pub fn read(text: &str, start_s: f64) -> Result<Self, SheetError> {
        let sheet = Sheet::read(text, &SPEEDS)?;
        let mut read = Self::default();
        for row in sheet.rows() {
            let row = row?;
            let time = SimTime::from_secs(seconds_of(&row)? - start_s);
            read.speeds.push((time, row.needed("speed_mps")?));
            read.has_decimal_commas |= row.has_decimal_comma("speed_mps");
        }
        Ok(read)
    }
}

/// The time of a row.
fn seconds_of(row: &SheetRow<'_>) -> Result<f64, SheetError> {
    let text = row.text("timestamp").unwrap_or_default();
    let time_s = seconds(&row.with_point(text));
    time_s.ok_or_else(|| {
        row.wrong(
            "timestamp",
            match text {
                "" => "is empty".to_owned(),
                text => format!("{text:?} is no time"),
            },
            "give seconds, or a date and time like 2022-02-25T09:32:54.400, or take the row out",
        )
    })
}

/// A row of a table of fixes.
struct FixRow<'a>(SheetRow<'a>);

impl FixRow<'_> {
    /// The receiver calls it a fix, or says nothing.
    fn is_computed(&self) -> bool {
        let status = self.0.text("solution_status");
        status.is_none_or(|status| status == COMPUTED)
    }

    fn kind(&self) -> &str {
        self.0.text("position_type").unwrap_or_default()
    }

    fn place(&self) -> Result<Geodetic, SheetError> {
        let latitude_deg = self.0.needed("latitude")?;
        let longitude_deg = self.0.needed("longitude")?;
        if !(latitude_deg.abs() <= 85.0 && longitude_deg.abs() <= 180.0) {
            return Err(self.0.row_wrong(
                format!("latitude {latitude_deg}, longitude {longitude_deg}: not on any railway"),
                "give both in degrees",
            ));
        }
        Ok(Geodetic {
            latitude_deg,
            longitude_deg,
            height_m: 0.0,
        })
    }

    /// None if it is carried on.
    fn kind_sigma_m(&self) -> Option<f64> {
        if self.kind().contains(CARRIED_ON) {
            return None;
        }
        let kind = SIGMAS_M.iter().find(|(kind, _)| self.kind().contains(kind));
        Some(kind.map_or(UNKNOWN_SIGMA_M, |(_, sigma_m)| *sigma_m))
    }

    /// Of world x and y.
    fn covariance(&self, kind_sigma_m: f64, datum: &Datum) -> Result<Matrix2<f64>, SheetError> {
        let sigma_m = kind_sigma_m.hypot(FRAME_SIGMA_M);
        let north_m = self.0.number("sigma_north_m")?.unwrap_or(sigma_m);
        let east_m = self.0.number("sigma_east_m")?.unwrap_or(sigma_m);
        let both_m2 = self.0.number("covariance_m2")?.unwrap_or(0.0);
        let of_plane = Matrix2::new(east_m * east_m, both_m2, both_m2, north_m * north_m);
        if !(north_m > 0.0 && east_m > 0.0) || of_plane.cholesky().is_none() {
            return Err(self.0.row_wrong(
                format!(
                    "sigma_north_m {north_m}, sigma_east_m {east_m}, covariance_m2 {both_m2}: not positive definite"
                ),
                "give standard deviations over 0, and a covariance below their product",
            ));
        }
        let turn = nalgebra::Rotation2::new(-datum.heading_deg.to_radians());
        let turned = turn.matrix() * of_plane * turn.matrix().transpose();
        Ok(0.5 * (turned + turned.transpose()))
    }
}

/// Seconds of a text: a number, or a date and time after ISO 8601, in UTC where it says nothing else.
fn seconds(text: &str) -> Option<f64> {
    let seconds = text.parse::<f64>().ok().filter(|s| s.is_finite());
    seconds.or_else(|| date_time(text))
}

/// Since 1970, of YYYY-MM-DDThh:mm:ss, with or without decimals, Z or an offset.
fn date_time(text: &str) -> Option<f64> {
    let (date, time) = text.split_once(['T', ' '])?;
    let mut date = date.splitn(3, '-').map(str::parse::<i64>);
    let [year, month, day] = [date.next()?.ok()?, date.next()?.ok()?, date.next()?.ok()?];
    let (time, offset_s) = match time.rfind(['+', '-']) {
        Some(at) => {
            let (hours, minutes) = time[at + 1..].split_once(':')?;
            let seconds =
                60.0 * (60.0 * hours.parse::<f64>().ok()? + minutes.parse::<f64>().ok()?);
            (
                &time[..at],
                if time[at..].starts_with('-') {
                    -seconds
                } else {
                    seconds
                },
            )
        }
        None => (time.trim_end_matches('Z'), 0.0),
    };
    let mut time = time.splitn(3, ':').map(str::parse::<f64>);
    let [hours, minutes, seconds] = [time.next()?.ok()?, time.next()?.ok()?, time.next()?.ok()?];
    let in_year =
        (1..=12).contains(&month) && (1..=31).contains(&day) && (1..=9999).contains(&year);
    let in_day = (0.0..24.0).contains(&hours) && (0.0..60.0).contains(&minutes);
    if !in_year || !in_day || !(0.0..61.0).contains(&seconds) {
        return None;
    }
    // Days from 1970 of the proleptic Gregorian calendar, in years that begin in March.
    let march = year - i64::from(month <= 2);
    let (era, of_era) = (march.div_euclid(400), march.rem_euclid(400));
    let of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    let days = era * 146_097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 719_468;
    Some(86_400.0 * days as f64 + 3600.0 * hours + 60.0 * minutes + seconds - offset_s)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests;
