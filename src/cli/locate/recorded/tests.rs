use super::*;

/// By `date -u -d ... +%s`.
#[test]
fn val_dates_are_seconds_since_1970() {
    for (text, expected) in [
        ("1970-01-01T00:00:00", 0.0),
        ("2000-02-29T12:34:56", 951_827_696.0),
        ("2022-02-25T09:32:54.400", 1_645_781_574.4),
        ("2022-02-25 10:32:54.4+01:00", 1_645_781_574.4),
        ("2100-03-01T00:00:00Z", 4_107_542_400.0),
        ("12.5", 12.5),
    ] {
        assert!((seconds(text).unwrap() - expected).abs() < 1e-6, "{text}");
    }
    for wrong in [
        "",
        "yesterday",
        "2022-13-01T00:00:00",
        "2022-01-01T25:00:00",
        "NaN",
        "2022-01-01",
    ] {
        assert!(seconds(wrong).is_none(), "{wrong}");
    }
}

fn datum() -> Datum {
    Datum {
        place: Geodetic {
            latitude_deg: 50.9,
            longitude_deg: 4.5,
            height_m: 0.0,
        },
        heading_deg: 0.0,
    }
}

#[test]
fn fixes_have_the_covariance_of_their_kind_or_their_own() {
    let text = "timestamp,latitude,longitude,position_type,solution_status,sigma_north_m,sigma_east_m\n\
        10,50.9,4.5,NARROW_INT3,SOL_COMPUTED,,\n\
        10,50.9,4.5,NARROW_INT3,SOL_COMPUTED,,\n\
        11,50.9,4.5001,SINGLE,INTEGRITY_WARNING,,\n\
        12,50.9,4.5001,SINGLE,SOL_COMPUTED,2,1\n";
    let read = RecordedFixes::read(text, &datum()).unwrap();
    assert_eq!(
        (read.fixes.len(), read.refused, read.out_of_order),
        (2, 1, 1)
    );
    let [first, second] = [0, 1].map(|k| read.fixes[k].fix);
    let is = |fix: &Fix, m2: Matrix2<f64>| (fix.covariance_m2 - m2).norm() < 1e-12;
    assert!(is(&first, Matrix2::identity() * (0.0025 + 1.69)));
    assert!(is(&second, Matrix2::new(1.0, 0.0, 0.0, 4.0)));
    assert!((second.place.x - 7.03).abs() < 0.01 && (second.time.secs() - 2.0).abs() < 1e-9);
}

/// Fails where a fix without reception is as good as the last received one.
#[test]
fn carried_on_fixes_grow_worse_by_the_second() {
    let text = "timestamp,latitude,longitude,position_type\n\
        10,50.9,4.5,SINGLE\n\
        11,50.9,4.5,PROPAGATED\n\
        20,50.9,4.5,PROPAGATED\n\
        21,50.9,4.5,NARROW_INT3\n\
        22,50.9,4.5,PROPAGATED\n";
    let read = RecordedFixes::read(text, &datum()).unwrap();
    let sigmas_m: Vec<f64> = read.fixes.iter().map(|fix| fix.sigma_m).collect();
    let expected_m = [
        2.5,
        2.5f64.hypot(0.3),
        2.5f64.hypot(3.0),
        0.05,
        0.05f64.hypot(0.3),
    ];
    for (sigma_m, expected_m) in sigmas_m.iter().zip(expected_m) {
        assert!((sigma_m - expected_m).abs() < 1e-9, "{sigmas_m:?}");
    }
}

#[test]
fn wrong_rows_are_named_by_their_line() {
    let said = |text: &str| {
        let error = RecordedFixes::read(text, &datum()).unwrap_err();
        error.to_string()
    };
    for (row, told) in [
        (
            "now,50.9,4.5",
            "line 3, column `timestamp`: \"now\" is no time; give seconds",
        ),
        (
            ",50.9,4.5",
            "line 3, column `timestamp`: is empty; give seconds",
        ),
        ("1,4.5,250.9", "line 3: latitude 4.5"),
        (
            "1,north,4.5",
            "line 3, column `latitude`: \"north\" is no number",
        ),
        (
            "1,,4.5",
            "line 3, column `latitude`: is empty or endless; give a number, or take the row out",
        ),
        ("1,50.9", "line 3, column `longitude`: is empty"),
        (
            "1,50,9,4,5",
            "line 3: the row has 5 cells, and there are 3 headers",
        ),
    ] {
        for line_break in ["\n", "\r\n"] {
            let text = ["time,latitude,longitude", "0,50.9,4.5", row, ""].join(line_break);
            assert!(said(&text).starts_with(told), "{row}: {}", said(&text));
        }
    }
    assert!(said("time,latitude,longitude\n").contains("no row under the headers is a fix"));
    assert!(said("time,latitude\n1,50.9\n").contains("no column `longitude`"));
    let speeds = |text: &str| RecordedSpeeds::read(text, 0.0).unwrap_err().to_string();
    let empty = speeds("time;speed_mps\r\n0;1,5\r\n\r\n1;\r\n");
    assert!(
        empty.starts_with("line 4, column `speed_mps`: is empty"),
        "{empty}"
    );
}

/// Fails where a comma of a number is taken for one between columns, or a row without a fix has to hold a place.
#[test]
fn tables_with_decimal_commas_are_those_with_points() {
    let points = "timestamp,latitude,longitude,solution_status,sigma_north_m,sigma_east_m\n\
        0.5,50.91,4.5,SOL_COMPUTED,1.5,2\n1,,,INSUFFICIENT_OBS,,\n2022-02-25T09:32:54.400,50.9,4.25,,1,1\n";
    let commas = points.replace(',', ";").replace('.', ",");
    let [points, commas] =
        [points, &commas].map(|text| RecordedFixes::read(text, &datum()).unwrap());
    assert!(commas.has_decimal_commas && !points.has_decimal_commas);
    assert_eq!((commas.fixes.len(), commas.refused), (2, 1));
    for (a, b) in points.fixes.iter().zip(&commas.fixes) {
        assert_eq!(a.fix.time, b.fix.time);
        assert_eq!(a.fix.place, b.fix.place);
        assert_eq!(a.fix.covariance_m2, b.fix.covariance_m2);
    }
    let speeds = |text| RecordedSpeeds::read(text, 0.0).unwrap();
    let commas = speeds("time;speed_mps\n0,5;12,25\n");
    assert!(commas.has_decimal_commas);
    assert_eq!(commas.speeds, speeds("time,speed_mps\n0.5,12.25\n").speeds);
}
