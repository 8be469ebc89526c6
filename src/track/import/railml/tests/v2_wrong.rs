//! Wrong files of railML 2.x.

use super::v2::{PLACED, STATION, read, with_utm};
use crate::track::import::railml::RailMlError;

/// Fails where a wrong file passes, or the message does not name line, element and what would be right.
#[test]
fn what_is_wrong_is_named() {
    for (from, to, told) in [
        ("</tracks>", "", "line "),
        (
            "<railml version=\"2.2\"",
            "<railml version=\"1.1\"",
            "line 4: this is railML 1.1",
        ),
        (
            "<railml version=\"2.2\" xmlns=\"http://www.railml.org/schemas/2013\"",
            "<railml",
            "line 4: neither `version`",
        ),
        (
            "<railml version=\"2.2\" xmlns=\"http://www.railml.org/schemas/2013\"",
            "<railml xmlns=\"http://www.railml.org/schemas/2005\"",
            "line 4: this is railML 2005",
        ),
        (
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>",
            "<!DOCTYPE railml [<!ENTITY x \"y\">]>",
            "line 3, column 1",
        ),
        (
            "ref=\"d\"",
            "ref=\"z\"",
            "line 15: connection (c): `ref` is \"z\", which no connection",
        ),
        (
            "ref=\"d\"",
            "ref=\"c\"",
            "line 15: connection (c): `ref` is its own",
        ),
        (
            "ref=\"d\"",
            "ref=\"b\"",
            "line 15: connection (c): `ref` is \"b\", but that one (line 38) refers to \"a\"",
        ),
        (
            "<connection id=\"a\" ref=\"b\" orientation=\"outgoing\" course=\"left\" maxSpeed=\"40\"/>",
            "",
            "line 14: switch (w1): has one leg alone",
        ),
        (
            "maxSpeed=\"40\"",
            "maxSpeed=\"0\"",
            "line 14: connection (a): `maxSpeed` is 0",
        ),
        (
            "course=\"left\" ",
            "",
            "line 14: connection (a): nothing tells on which side",
        ),
        (
            "course=\"left\"",
            "course=\"straight\"",
            "`trackContinueCourse`",
        ),
        (
            "orientation=\"outgoing\" course",
            "course",
            "line 14: connection (a): `orientation` is \"\"",
        ),
        (
            "id=\"leg\"",
            "id=\"main\"",
            "line 37: track (main): has the id of an element on line 9",
        ),
        (
            "pos=\"300\"><conn",
            "pos=\"3000\"><conn",
            "line 14: switch (w1): lies at 3000 m, outside its track, which is 900 m long",
        ),
        (
            "pos=\"900\"",
            "pos=\"-900\"",
            "line 12: trackEnd (me): `pos` makes its track -900 m long",
        ),
        (
            "pos=\"900\"",
            "pos=\"1e300\"",
            "line 12: trackEnd (me): `pos` is \"1e300\": a number",
        ),
        (
            "pos=\"900\"",
            "pos=\"NaN\"",
            "line 12: trackEnd (me): `pos` is \"NaN\": a number",
        ),
        ("pos=\"900\"", "", "line 12: trackEnd (me): has no `pos`"),
        (
            "slope=\"5\"",
            "slope=\"5000\"",
            "line 26: gradientChange (g1): `slope` is 5000",
        ),
        (
            "vMax=\"50\"",
            "vMax=\"-50\"",
            "line 24: speedChange (s2): `vMax` is -50: more than 0",
        ),
        (
            "radius=\"-500\"",
            "radius=\"-5\"",
            "line 27: radiusChange (r2): `radius` is -5 m",
        ),
        (
            "pos=\"250\" length",
            "pos=\"850\" length",
            "line 28: tunnel (t1): lies at 1050 m, outside",
        ),
        (
            "<connection id=\"e\" ref=\"f\" orientation=\"incoming\"/>",
            "<connection id=\"e\" ref=\"f\" orientation=\"outgoing\"/>",
            "line 16: crossing (x1): needs two connections",
        ),
        (
            "<trackBegin id=\"lb\" pos=\"0\"><connection id=\"b\" ref=\"a\"/></trackBegin>",
            "",
            "line 37: track (leg): needs a `trackBegin`",
        ),
    ] {
        assert!(STATION.contains(from), "{from}");
        let error = read(&STATION.replacen(from, to, 1))
            .unwrap_err()
            .to_string();
        assert!(error.contains(told), "{to}: {error}");
    }
    let empty = "<railml version=\"2.2\"><infrastructure><tracks/></infrastructure></railml>";
    assert!(matches!(read(empty), Err(RailMlError::NoTracks)));
    assert!(matches!(
        read("<railml version=\"2.2\"/>"),
        Err(RailMlError::NoTracks)
    ));
    let error = read("{ \"type\": 1 }").unwrap_err().to_string();
    assert!(error.contains("line 1, column 1: not XML"), "{error}");
    let long = format!("<a{}/>", "b".repeat(5000));
    let error = read(&long).unwrap_err().to_string();
    assert!(error.len() < 300, "{error}");
    let escape = STATION.replacen("ref=\"d\"", "ref=\"&#9;z\"", 1);
    let error = read(&escape).unwrap_err().to_string();
    assert!(
        error.contains("\u{fffd}z") && !error.contains('\t'),
        "{error}"
    );
    let error = read("<html/>").unwrap_err().to_string();
    assert!(error.contains("this is `html`"), "{error}");
}

/// Three connections in a ring: a refers to b, b to c, and c to a.
#[test]
fn connections_that_refer_in_a_ring_are_refused() {
    let mut ring = STATION.to_owned();
    for (from, to) in [
        ("id=\"b\" ref=\"a\"", "id=\"b\" ref=\"c\""),
        ("id=\"c\" ref=\"d\"", "id=\"c\" ref=\"a\""),
    ] {
        assert!(ring.contains(from), "{from}");
        ring = ring.replacen(from, to, 1);
    }
    assert_eq!(
        read(&ring).unwrap_err().to_string(),
        "line 14: connection (a): `ref` is \"b\", but that one (line 38) refers to \"c\": the two must refer to each other"
    );
}

#[test]
fn wrong_coordinates_are_named() {
    let error = read(PLACED).unwrap_err();
    assert!(
        matches!(&error, RailMlError::NoDatum { line: 4, .. }),
        "{error}"
    );
    assert!(error.to_string().contains("--crs EPSG:25832"), "{error}");
    for (from, to, told) in [
        (
            "500000 6000000 12",
            "6000000 500000",
            "line 4: geoCoord (of trackBegin ab): (6000000, 500000) is on no railway in UTM (easting, northing); the other way round",
        ),
        ("500000 6000000 12", "500000", "two or three numbers"),
        ("500000 6000000 12", "500000 north", "two or three numbers"),
        (
            "500000 6000000 12\"",
            "0.5 0.5\" epsgCode=\"31467\"",
            "the coordinate system \"31467\" is not read",
        ),
        (
            "<connection id=\"c2\" ref=\"c1\"/>",
            "<openEnd id=\"c2\"/>",
            "line 7: connection (c1): `ref` is \"c2\"",
        ),
    ] {
        assert!(PLACED.contains(from), "{from}");
        let error = with_utm(&PLACED.replacen(from, to, 1))
            .unwrap_err()
            .to_string();
        assert!(error.contains(told), "{to}: {error}");
    }
    // A track that nothing places.
    let lost = PLACED
        .replace("<connection id=\"c2\" ref=\"c1\"/>", "<openEnd id=\"c2\"/>")
        .replace(
            "<connection id=\"c1\" ref=\"c2\" orientation=\"outgoing\" course=\"left\"/>",
            "",
        )
        .replace(
            "<switch id=\"w\" pos=\"400\"><geoCoord coord=\"500399.84 6000000\"/>",
            "",
        )
        .replace("</switch>", "");
    let lost = lost.replace("<geoCoord coord=\"500695 6000045\"/>", "");
    let error = with_utm(&lost).unwrap_err().to_string();
    assert!(
        error.contains("line 14: track (b): nothing says where it lies"),
        "{error}"
    );
    // Longitude before latitude is only seen by lengths.
    let degrees = |swapped: bool| {
        let point = |k: u32| {
            let (latitude, longitude) = (48.0, 15.0 + 0.001 * f64::from(k));
            let values = if swapped {
                [longitude, latitude]
            } else {
                [latitude, longitude]
            };
            format!(
                "<geoCoord coord=\"{} {}\" epsgCode=\"4326\"/>",
                values[0], values[1]
            )
        };
        format!(
            "<railml version=\"2.5\"><infrastructure><tracks><track id=\"t\"><trackTopology><trackBegin pos=\"0\">{}</trackBegin>\
            <trackEnd pos=\"223.8\">{}</trackEnd></trackTopology><ocsElements><a><balise id=\"b\" pos=\"74.6\">{}</balise></a></ocsElements>\
            </track></tracks></infrastructure></railml>",
            point(0),
            point(3),
            point(1)
        )
    };
    assert!(read(&degrees(false)).is_ok());
    let error = read(&degrees(true)).unwrap_err().to_string();
    assert!(error.contains("are they swapped?"), "{error}");
}

/// A track between two places, latitude and longitude, of this stated length.
fn between(places: [[f64; 2]; 2], length_m: f64) -> String {
    let [a, b] = places.map(|[first, second]| {
        format!("<geoCoord coord=\"{first:.7} {second:.7}\" epsgCode=\"4326\"/>")
    });
    format!(
        "<railml version=\"2.5\"><infrastructure><tracks><track id=\"t\"><trackTopology>\n\
         <trackBegin id=\"tb\" pos=\"0\">{a}</trackBegin>\n<trackEnd id=\"te\" pos=\"{length_m}\">{b}</trackEnd>\n\
         </trackTopology></track></tracks></infrastructure></railml>"
    )
}

/// Metres between two places by the radii of curvature of the ellipsoid (WGS 84) in the middle between them.
fn ellipsoidal_m([a, b]: [[f64; 2]; 2]) -> f64 {
    let (axis_m, e2) = (6_378_137.0, 0.006_694_379_990_14);
    let middle = 0.5 * (a[0] + b[0]).to_radians();
    let w2 = 1.0 - e2 * middle.sin().powi(2);
    let along_m = axis_m * (1.0 - e2) / w2.powf(1.5) * (b[0] - a[0]).to_radians();
    let across_m = axis_m / w2.sqrt() * middle.cos() * (b[1] - a[1]).to_radians();
    along_m.hypot(across_m)
}

/// Fails where a track from south to north passes with its coordinates the wrong way round, or a right one, straight or
/// curved, does not pass. On the meridian of Greenwich nothing tells.
#[test]
fn swapped_coordinates_are_told_in_any_direction() {
    for (latitude, longitude) in [(50.9, 4.48), (48.2, 15.6), (30.6, 104.0), (-33.9, 18.4)] {
        // North, north-east, east and south-east.
        for [north, east] in [[0.02, 0.0], [0.014, 0.02], [0.0, 0.03], [-0.01, 0.02]] {
            let places = [[latitude, longitude], [latitude + north, longitude + east]];
            let length_m = ellipsoidal_m(places);
            let name = format!("{places:?}");
            // Straight, by a projection's scale, in hills, and with curves that nothing states.
            for longer in [0.9996, 1.0, 1.0003, 1.02, 1.1, 1.3] {
                let read = read(&between(places, longer * length_m));
                assert!(read.is_ok(), "{name} {longer}: {}", read.unwrap_err());
            }
            let swapped = places.map(|[latitude, longitude]| [longitude, latitude]);
            let error = read(&between(swapped, (10.0 * length_m).round() / 10.0));
            let error = error.unwrap_err().to_string();
            let is_told = error.contains("are they swapped?") || error.contains("on no railway");
            assert!(is_told, "{name}: {error}");
        }
    }
    let greenwich = between([[0.0, 51.5], [0.0, 51.52]], 2225.3);
    assert!(read(&greenwich).is_ok());
}

/// Fails where a length that contradicts the coordinates is told as something else.
#[test]
fn a_length_that_contradicts_the_coordinates_is_named() {
    let places = [[50.9, 4.48], [50.9, 4.494_16]];
    let apart_m = ellipsoidal_m(places);
    for length_m in [600.0, 3000.0] {
        let error = read(&between(places, length_m)).unwrap_err().to_string();
        let told = format!(
            "line 3: geoCoord (of trackEnd te): its coordinates are {apart_m:.1} m from those of trackBegin tb (line 2), and \
             the track between them is stated to be {length_m:.1} m long: correct the coordinates, or the stated length"
        );
        assert!(error.starts_with(&told), "{error}");
    }
}
