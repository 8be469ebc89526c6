//! railML 2.x.

use crate::track::Direction;
use crate::track::import::railml::{RailMlError, RailMlOptions, read_railml};
use crate::track::import::{Crs, ImportedMap, MapBalise, MapSignal, MapSpeed, MapStep};
use crate::track::plan::ElementEnd;

const UP: Direction = Direction::Up;
const DOWN: Direction = Direction::Down;

/// A track of 900 m with a leg to the left at 300 m and one that joins it from the right at 700 m, and a crossing track
/// in two parts at 500 m.
pub(super) const STATION: &str = r#"

<?xml version="1.0" encoding="UTF-8"?>
<railml version="2.2" xmlns="http://www.railml.org/schemas/2013"><infrastructure>
<infraAttrGroups><infraAttributes id="slow"><speeds>
    <speed etcsTrainCategory="0" vMax="70"/><speed etcsTrainCategory="1" vMax="60"/>
</speeds></infraAttributes></infraAttrGroups>
<tracks>
<track id="main" name="Track 1">
    <trackTopology>
        <trackBegin id="mb" pos="0" absPos="5000"><openEnd id="west"/></trackBegin>
        <trackEnd id="me" pos="900" absPos="5900"><bufferStop id="east"/></trackEnd>
        <connections>
            <switch id="w1" name="W1" pos="300"><connection id="a" ref="b" orientation="outgoing" course="left" maxSpeed="40"/></switch>
            <switch id="w2" pos="699" absPos="5699.75"><connection id="c" ref="d" orientation="incoming" course="right"/></switch>
            <crossing id="x1" pos="500">
                <connection id="e" ref="f" orientation="incoming"/><connection id="g" ref="h" orientation="outgoing"/>
            </crossing>
        </connections>
    </trackTopology>
    <trackElements>
        <speedChanges>
            <speedChange id="s1" pos="0" dir="up" vMax="80" profileRef="slow"/>
            <speedChange id="s2" pos="600" dir="down" vMax="50"/>
        </speedChanges>
        <gradientChanges><gradientChange id="g1" pos="0" slope="5"/><gradientChange id="g2" pos="400" slope="-2.5"/></gradientChanges>
        <radiusChanges><radiusChange id="r1" pos="0" radius="0"/><radiusChange id="r2" pos="350" radius="-500" superelevation="60"/></radiusChanges>
        <tunnels><tunnel id="t1" pos="250" length="200"/></tunnels>
        <platformEdges><platformEdge id="p1" pos="100" length="80"/></platformEdges>
    </trackElements>
    <ocsElements>
        <signals><signal id="n1" name="N1" pos="290" dir="up"/><signal id="n2" pos="310"/></signals>
        <balises><balise id="b1" pos="120"/></balises>
        <trainDetectionElements><trainDetector id="td1" pos="300"/></trainDetectionElements>
    </ocsElements>
</track>
<track id="leg"><trackTopology>
    <trackBegin id="lb" pos="0"><connection id="b" ref="a"/></trackBegin>
    <trackEnd id="le" pos="250"><openEnd id="north"/></trackEnd>
</trackTopology></track>
<track id="other"><trackTopology>
    <trackBegin id="ob" pos="0"><macroscopicNode id="on" ocpRef="ocp"/></trackBegin>
    <trackEnd id="oe" pos="333"><connection id="d" ref="c"/></trackEnd>
</trackTopology></track>
<track id="south"><trackTopology>
    <trackBegin id="sb" pos="0"><openEnd id="so"/></trackBegin>
    <trackEnd id="se" pos="120"><connection id="f" ref="e"/></trackEnd>
</trackTopology></track>
<track id="north2"><trackTopology>
    <trackBegin id="nb" pos="0"><connection id="h" ref="g"/></trackBegin>
    <trackEnd id="ne" pos="130"><openEnd id="no"/></trackEnd>
</trackTopology></track>
</tracks></infrastructure></railml>
"#;

/// Places of a track 1000 m long to the east, with a leg that leaves it at 400 m and comes back to it: in UTM zone 32.
/// 0.9996 of a metre of the zone is a metre on the ground at its meridian.
pub(super) const PLACED: &str = r#"<infrastructure id="i" xmlns="http://www.railml.org/schemas/2013"><tracks>
<track id="a">
    <trackTopology>
        <trackBegin id="ab" pos="0"><geoCoord coord="500000 6000000 12"/><openEnd id="o1"/></trackBegin>
        <trackEnd id="ae" pos="1000"><geoCoord coord="500999.6 6000000"/><openEnd id="o2"/></trackEnd>
        <connections><switch id="w" pos="400"><geoCoord coord="500399.84 6000000"/>
            <connection id="c1" ref="c2" orientation="outgoing" course="left"/></switch></connections>
    </trackTopology>
    <ocsElements>
        <signals><signal id="s" pos="700" dir="up"><geoCoord coord="500701.72 5999997"/></signal></signals>
        <trainDetectionElements><trainDetector id="d" pos="500"><geoCoord coord="500560 6000000"/></trainDetector></trainDetectionElements>
    </ocsElements>
</track>
<track id="b">
    <trackTopology>
        <trackBegin id="bb" pos="0"><connection id="c2" ref="c1"/></trackBegin>
        <trackEnd id="be" pos="300"><geoCoord coord="500695 6000045"/><bufferStop id="o3"/></trackEnd>
    </trackTopology>
</track>
</tracks></infrastructure>"#;

pub(super) fn read(text: &str) -> Result<ImportedMap, RailMlError> {
    read_railml(text, &RailMlOptions::default())
}

pub(super) fn with_utm(text: &str) -> Result<ImportedMap, RailMlError> {
    let crs: Option<Crs> = Some("EPSG:25832".parse().unwrap());
    read_railml(text, &RailMlOptions { crs })
}

pub(super) fn end(element: usize, way: Direction) -> ElementEnd {
    ElementEnd { element, way }
}

#[test]
fn tracks_are_cut_and_joined() {
    let map = read(STATION).unwrap();
    let ids: Vec<&str> = map.network.elements.iter().map(|e| &*e.id).collect();
    assert_eq!(
        ids,
        [
            "main", "main.2", "main.3", "main.4", "leg", "other", "south", "north2"
        ]
    );
    let onward = |element, way| {
        let mut next = map.network.onward(end(element, way)).to_vec();
        next.sort();
        next
    };
    assert_eq!(onward(0, UP), [end(1, UP), end(4, UP)]);
    assert_eq!(onward(1, DOWN), [end(0, DOWN)]);
    assert_eq!(onward(4, DOWN), [end(0, DOWN)]);
    assert_eq!(onward(3, DOWN), [end(2, DOWN), end(5, DOWN)]);
    assert_eq!(onward(5, UP), [end(3, UP)]);
    // Over the crossing each goes straight on.
    assert_eq!(onward(1, UP), [end(2, UP)]);
    assert_eq!(onward(6, UP), [end(7, UP)]);
    assert!(onward(3, UP).is_empty() && onward(5, DOWN).is_empty());
    let [first, second] = map.switches.as_slice() else {
        panic!("{:?}", map.switches)
    };
    assert_eq!(
        (first.toe, first.through, first.diverging),
        (end(0, UP), end(1, DOWN), end(4, DOWN))
    );
    assert_eq!(
        (&*first.name, first.line, first.diverging_kmh),
        ("W1", 14, Some(40.0))
    );
    assert_eq!(
        (second.toe, second.through, second.diverging),
        (end(3, DOWN), end(2, UP), end(5, UP))
    );
    assert_eq!((&*second.name, second.diverging_kmh), ("w2", None));
    // Lengths; the second switch has its decimals from its mileage.
    for (element, length_m) in map
        .network
        .elements
        .iter()
        .zip([300.0, 200.0, 199.75, 200.25, 250.0, 333.0, 120.0, 130.0])
    {
        assert!(
            (element.length_m() - length_m).abs() < 1.0,
            "{} {}",
            element.id,
            element.length_m()
        );
    }
    assert!(map.plan_is_laid_out && map.network.datum.is_none() && map.plan_checks.is_empty());
    // A double slip leads from each track to both others.
    let slips = STATION.replace(
        "<crossing id=\"x1\"",
        "<crossing id=\"x1\" type=\"doubleSwitchCrossing\"",
    );
    let map = read(&slips).unwrap();
    let mut next = map.network.onward(end(1, UP)).to_vec();
    next.sort();
    assert_eq!(next, [end(2, UP), end(7, UP)]);
    let mut next = map.network.onward(end(2, DOWN)).to_vec();
    next.sort();
    assert_eq!(next, [end(1, DOWN), end(6, DOWN)]);
}

#[test]
fn what_lies_along_tracks_is_taken_over() {
    let map = read(STATION).unwrap();
    let [first, second] = [&map.along[0], &map.along[1]];
    assert_eq!(first.name.as_deref(), Some("Track 1"));
    assert_eq!(
        (first.line, first.stated_m, second.stated_m),
        (9, Some(5000.0), Some(5300.0))
    );
    let speed = |from_m, kmh, way| MapSpeed {
        from_m,
        kmh,
        way: Some(way),
    };
    assert_eq!(first.speeds.first(), Some(&speed(0.0, 60.0, UP)));
    assert!((map.along[2].speeds[1].from_m - 100.0).abs() < 1.0);
    assert_eq!(map.along[2].speeds[1].way, Some(DOWN));
    let grade = MapStep {
        from_m: 0.0,
        value: 5.0,
    };
    assert_eq!(first.grades_permille, [grade]);
    assert!((second.grades_permille[1].value + 2.5).abs() < 1e-12);
    assert!((second.grades_permille[1].from_m - 100.0).abs() < 0.5);
    // Without coordinates nothing says which way the radius turns; cant has no side.
    assert!(first.curvatures_per_m.is_empty() && second.curvatures_per_m.is_empty());
    assert!((second.cants_mm[0].value - 60.0).abs() < 1e-12);
    assert_eq!(
        first.signals,
        [MapSignal {
            name: "N1".to_owned(),
            along_m: 290.0,
            way: UP
        }]
    );
    let balise = MapBalise {
        name: "b1".to_owned(),
        along_m: 120.0,
    };
    assert_eq!(first.balises, [balise]);
    assert_eq!(first.tunnels_m, [[250.0, 300.0]]);
    let buffers = [0, 1, 3].map(|element: usize| map.along[element].buffers);
    assert_eq!(buffers, [[false, false], [false, false], [false, true]]);
    assert!((second.tunnels_m[0][1] - 150.0).abs() < 0.5);
    let count = |name: &str| {
        let count = map.report.counts[name];
        (count.in_file, count.taken)
    };
    for (name, in_file, taken) in [
        ("track", 5, 5),
        ("connection", 8, 8),
        ("switch", 2, 2),
        ("crossing", 1, 1),
        ("openEnd", 4, 4),
        ("macroscopicNode", 1, 1),
        ("signal", 2, 1),
        ("radiusChange", 2, 0),
        ("gradientChange", 2, 2),
        ("speedChange", 2, 2),
        ("balise", 1, 1),
        ("platformEdge", 1, 0),
        ("trainDetector", 1, 0),
    ] {
        assert_eq!(count(name), (in_file, taken), "{name}");
    }
    for (line, what, why) in [
        (32, "signal n2", "`dir`"),
        (29, "platformEdge p1", "platforms"),
        (27, "radiusChange r2", "which way"),
    ] {
        let left = map
            .report
            .left_out
            .iter()
            .find(|left| left.what == what)
            .unwrap();
        assert!(left.line == line && left.why.contains(why), "{left:?}");
    }
}

#[test]
fn tracks_run_through_their_places() {
    let map = with_utm(PLACED).unwrap();
    assert!(!map.plan_is_laid_out);
    let datum = map.network.datum.unwrap();
    assert!((datum.place.longitude_deg - 9.0).abs() < 1e-12);
    let lengths: Vec<f64> = map.network.elements.iter().map(|e| e.length_m()).collect();
    assert!(
        (lengths[0] - 400.0).abs() < 0.01 && (lengths[1] - 600.0).abs() < 0.01,
        "{lengths:?}"
    );
    // The leg begins at the switch, whose coordinates are its own, and is as long as its chord.
    let (begin, _) = map.network.elements[2].at(0.0);
    assert!((begin.coords.norm() - 400.0).abs() < 0.01, "{begin}");
    // The signal is 3 m on the right, and 2 m farther on than stated.
    let [check] = map.plan_checks.as_slice() else {
        panic!("{:?}", map.plan_checks)
    };
    assert_eq!(
        (check.element, &*check.what, check.line),
        (1, "signal s", 10)
    );
    assert!(
        (check.left_m + 3.0).abs() < 0.01 && (check.along_m - 2.0).abs() < 0.01,
        "{check:?}"
    );
    // The detector lies 60 m off.
    let count = map.report.counts["geoCoord"];
    assert_eq!((count.in_file, count.taken), (6, 5));
    assert!(
        map.report
            .left_out
            .iter()
            .any(|left| left.what == "geoCoord of trainDetector d" && left.line == 11)
    );
}

/// A leg of which no coordinates are known leaves its switch as the track runs there; a height alone is no place.
#[test]
fn a_leg_without_coordinates_leaves_from_its_switch() {
    for height in ["", "<geoCoord coord=\"0 0\" extraHeight=\"12\"/>"] {
        let map =
            with_utm(&PLACED.replace("<geoCoord coord=\"500695 6000045\"/>", height)).unwrap();
        let leg: Vec<_> = map.network.elements[2]
            .points()
            .map(|(point, _)| *point)
            .collect();
        let [begin, .., end] = leg.as_slice() else {
            panic!("{leg:?}")
        };
        assert!(
            (begin.x - 400.0).abs() < 0.01 && begin.y.abs() < 0.01,
            "{leg:?}"
        );
        assert!(
            (end.x - 700.0).abs() < 0.01 && end.y.abs() < 0.01,
            "{leg:?}"
        );
    }
    // And one that is joined by its end runs towards the switch.
    let text = PLACED
        .replace(
            "<geoCoord coord=\"500695 6000045\"/><bufferStop id=\"o3\"/>",
            "<connection id=\"c2\" ref=\"c1\"/>",
        )
        .replace(
            "<trackBegin id=\"bb\" pos=\"0\"><connection id=\"c2\" ref=\"c1\"/>",
            "<trackBegin id=\"bb\" pos=\"0\"><bufferStop id=\"o3\"/>",
        );
    let map = with_utm(&text).unwrap();
    let (begin, _) = map.network.elements[2].at(0.0);
    assert!(
        (begin.x - 700.0).abs() < 0.01 && begin.y.abs() < 0.01,
        "{begin}"
    );
}

/// Mileage may fall along a track.
#[test]
fn mileage_of_an_element_is_that_of_its_begin() {
    let text = STATION
        .replace("absPos=\"5900\"", "absPos=\"4100\"")
        .replace(
            "pos=\"699\" absPos=\"5699.75\"",
            "pos=\"699\" absPos=\"4300.25\"",
        );
    let map = read(&text).unwrap();
    let stated: Vec<_> = map.along[..4].iter().map(|along| along.stated_m).collect();
    assert_eq!(
        stated,
        [Some(5000.0), Some(4700.0), Some(4500.0), Some(4300.25)]
    );
}

/// A file may name its system once, for all coordinates that name none.
#[test]
fn a_file_may_name_its_system_once() {
    let text = PLACED.replace(
        "<tracks>",
        "<infraAttrGroups><infraAttributes id=\"k\"><epsgCode default=\"urn:ogc:def:crs:EPSG::25832\"/></infraAttributes></infraAttrGroups><tracks>",
    );
    let (own, asked) = (read(&text).unwrap(), with_utm(PLACED).unwrap());
    assert_eq!(own.network.datum, asked.network.datum);
}

/// A single slip does not say between which tracks it leads: it is a crossing, and told.
#[test]
fn a_single_slip_is_a_crossing() {
    let text = STATION.replace(
        "<crossing id=\"x1\"",
        "<crossing id=\"x1\" type=\"simpleSwitchCrossing\"",
    );
    let map = read(&text).unwrap();
    assert_eq!(map.network.onward(end(1, UP)), [end(2, UP)]);
    assert!(
        map.report
            .left_out
            .iter()
            .any(|left| left.what == "crossing x1" && left.why.contains("single slip"))
    );
}

/// The same curve with radii of either sign: coordinates say which way it turns, and the track is the curve.
#[test]
fn coordinates_tell_which_way_radii_turn() {
    let (radius_m, scale) = (300.0f64, 0.9996);
    let place = |at_m: f64| {
        let angle = (at_m - 100.0).max(0.0) / radius_m;
        let x = at_m.min(100.0) + radius_m * angle.sin();
        let y = radius_m * (1.0 - angle.cos());
        format!(
            "<geoCoord coord=\"{} {}\" epsgCode=\"urn:ogc:def:crs:EPSG::32632\"/>",
            500_000.0 + scale * x,
            5_000_000.0 + scale * y
        )
    };
    for sign in [1.0, -1.0] {
        let detectors: String = [50.0, 200.0]
            .map(|at_m| {
                format!(
                    "<trainDetector id=\"d{at_m}\" pos=\"{at_m}\">{}</trainDetector>",
                    place(at_m)
                )
            })
            .concat();
        let text = format!(
            "<railml version=\"2.4\"><infrastructure><tracks><track id=\"t\"><trackTopology><trackBegin pos=\"0\">{}</trackBegin>\
            <trackEnd pos=\"400\">{}</trackEnd></trackTopology><trackElements><radiusChanges><radiusChange pos=\"0\" radius=\"0\"/>\
            <radiusChange pos=\"100\" radius=\"{}\"/></radiusChanges></trackElements><ocsElements><a>{detectors}</a></ocsElements>\
            </track></tracks></infrastructure></railml>",
            place(0.0),
            place(400.0),
            sign * radius_m
        );
        let map = read(&text).unwrap();
        let curvatures = &map.along[0].curvatures_per_m;
        assert!(
            (curvatures[1].value - 1.0 / radius_m).abs() < 1e-12,
            "{curvatures:?}"
        );
        let (middle, _) = map.network.elements[0].at(100.0 + radius_m / 2.0);
        let truth = nalgebra::Point2::new(
            100.0 + radius_m * 0.5f64.sin(),
            radius_m * (1.0 - 0.5f64.cos()),
        );
        assert!((middle - truth).norm() < 0.02, "{middle} {truth}");
    }
}

#[test]
fn bytes_before_the_file_are_no_error() {
    for before in ["\u{feff}", "\u{feff}\r\n\n", "  \n"] {
        let text = format!("{before}{}", STATION.trim_start());
        let map = read(&text).unwrap();
        let lines = before.matches('\n').count();
        assert_eq!(map.along[0].line, 7 + lines);
    }
}

/// Course `straight`: the track itself turns off.
#[test]
fn the_through_leg_may_be_the_other_track() {
    let text = STATION.replace(
        "<switch id=\"w1\" name=\"W1\" pos=\"300\"><connection id=\"a\" ref=\"b\" orientation=\"outgoing\" course=\"left\"",
        "<switch id=\"w1\" trackContinueCourse=\"right\" pos=\"300\"><connection id=\"a\" ref=\"b\" orientation=\"outgoing\" course=\"straight\"",
    );
    let map = read(&text).unwrap();
    let switch = &map.switches[0];
    assert_eq!(
        (switch.toe, switch.through, switch.diverging),
        (end(0, UP), end(4, DOWN), end(1, DOWN))
    );
    assert_eq!(switch.diverging_kmh, None);
}
