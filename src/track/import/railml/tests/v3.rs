//! railML 3.x.

use crate::track::Direction;
use crate::track::import::railml::{RailMlError, RailMlOptions, read_railml};
use crate::track::import::{ImportedMap, MapBalise, MapSignal, MapSpeed, MapStep};
use crate::track::plan::ElementEnd;

const UP: Direction = Direction::Up;
const DOWN: Direction = Direction::Down;

/// A stem and two legs, of which the right one runs against its element; a collection of all three.
pub(super) const FORK: &str = r#"<?xml version="1.0"?>
<railML version="3.2" xmlns="https://www.railml.org/schemas/3.2">
<common id="co"><speedProfiles>
    <speedProfile id="basic" isBasicSpeedProfile="true"/><speedProfile id="tilt" isBasicSpeedProfile="false"/>
</speedProfiles></common>
<infrastructure id="is"><topology>
<netElements>
    <netElement id="stem" length="400"><associatedPositioningSystem id="ps1">
        <intrinsicCoordinate id="i1" intrinsicCoord="0"><linearCoordinate measure="1000" positioningSystemRef="km"/></intrinsicCoordinate>
        <intrinsicCoordinate id="i2" intrinsicCoord="1"><linearCoordinate measure="1400" positioningSystemRef="km"/></intrinsicCoordinate>
    </associatedPositioningSystem></netElement>
    <netElement id="left" length="300"/>
    <netElement id="right"><associatedPositioningSystem id="ps2">
        <intrinsicCoordinate id="i3" intrinsicCoord="0"><linearCoordinate measure="1700" positioningSystemRef="km"/></intrinsicCoordinate>
        <intrinsicCoordinate id="i4" intrinsicCoord="1"><linearCoordinate measure="1400" positioningSystemRef="km"/></intrinsicCoordinate>
    </associatedPositioningSystem></netElement>
    <netElement id="all"><elementCollectionUnordered id="ec"><elementPart ref="stem"/><elementPart ref="left"/><elementPart ref="right"/></elementCollectionUnordered></netElement>
    <netElement id="more"><elementCollectionUnordered id="ed"><elementPart ref="all"/></elementCollectionUnordered></netElement>
</netElements>
<netRelations>
    <netRelation id="sl" navigability="Both" positionOnA="1" positionOnB="0"><elementA ref="stem"/><elementB ref="left"/></netRelation>
    <netRelation id="sr" navigability="Both" positionOnA="1" positionOnB="1"><elementA ref="stem"/><elementB ref="right"/></netRelation>
    <netRelation id="lr" navigability="None" positionOnA="0" positionOnB="1"><elementA ref="left"/><elementB ref="right"/></netRelation>
</netRelations>
</topology>
<functionalInfrastructure>
    <balises><balise id="ba"><spotLocation id="l0" netElementRef="stem" intrinsicCoord="0.25"/></balise></balises>
    <bufferStops><bufferStop id="bs"><spotLocation id="m0" netElementRef="left" pos="300"/></bufferStop><bufferStop id="bt"><spotLocation id="m1" netElementRef="left" pos="200"/></bufferStop></bufferStops><geometryCurves><horizontalCurve id="h1" curveType="arc" radius="500"><linearLocation id="l1"><associatedNetElement netElementRef="stem" posBegin="100" posEnd="200" keepsOrientation="true"/></linearLocation></horizontalCurve>
        <horizontalCurve id="h2" curveType="clothoid"><linearLocation id="l2"><associatedNetElement netElementRef="stem" posBegin="200" posEnd="280" keepsOrientation="true"/></linearLocation></horizontalCurve>
        <gradientCurve id="g1" curveType="straight" gradient="4"><linearLocation id="l3"><associatedNetElement netElementRef="right" keepsOrientation="false"/></linearLocation></gradientCurve></geometryCurves>
    <overCrossings><overCrossing id="oc" constructionType="tunnel"><linearLocation id="l4"><associatedNetElement netElementRef="stem" posBegin="350" posEnd="50"/></linearLocation></overCrossing></overCrossings>
    <signalsIS><signalIS id="n1"><name name="N 1" language="en"/><spotLocation id="l5" netElementRef="stem" pos="380" applicationDirection="normal"/></signalIS>
        <signalIS id="n2"><spotLocation id="l6" netElementRef="right" pos="20" applicationDirection="both"/></signalIS></signalsIS>
    <speeds><speedSection id="v1" maxSpeed="80"><linearLocation id="l7" applicationDirection="normal"><associatedNetElement netElementRef="stem" posBegin="0" posEnd="250" keepsOrientation="true"/></linearLocation><validForSpeedProfile ref="basic"/></speedSection>
        <speedSection id="v2" maxSpeed="120"><linearLocation id="l8"><associatedNetElement netElementRef="stem"/></linearLocation><validForSpeedProfile ref="tilt"/></speedSection></speeds>
    <switchesIS><switchIS id="w" type="ordinarySwitch" branchCourse="left" continueCourse="right"><name name="W 1" language="en"/>
        <spotLocation id="l9" netElementRef="stem" pos="400"/><leftBranch netRelationRef="sl" branchingSpeed="40" joiningSpeed="50"/><rightBranch netRelationRef="sr"/></switchIS></switchesIS>
    <tracks><track id="tr" mainDirection="normal"><name name="Track 7" language="en"/><linearLocation id="l10"><associatedNetElement netElementRef="stem" keepsOrientation="true"/><associatedNetElement netElementRef="right" keepsOrientation="false"/></linearLocation></track></tracks>
</functionalInfrastructure></infrastructure></railML>
"#;

pub(super) fn read(text: &str) -> Result<ImportedMap, RailMlError> {
    read_railml(text, &RailMlOptions::default())
}

fn end(element: usize, way: Direction) -> ElementEnd {
    ElementEnd { element, way }
}

#[test]
fn elements_are_joined_by_their_relations() {
    let map = read(FORK).unwrap();
    let ids: Vec<&str> = map.network.elements.iter().map(|e| &*e.id).collect();
    assert_eq!(ids, ["stem", "left", "right"]);
    assert_eq!(map.network.onward(end(0, UP)), [end(1, UP), end(2, DOWN)]);
    assert_eq!(map.network.onward(end(1, DOWN)), [end(0, DOWN)]);
    assert_eq!(map.network.onward(end(2, UP)), [end(0, DOWN)]);
    let [switch] = map.switches.as_slice() else {
        panic!("{:?}", map.switches)
    };
    assert_eq!(
        (switch.toe, switch.through, switch.diverging),
        (end(0, UP), end(2, UP), end(1, DOWN))
    );
    assert_eq!(
        (&*switch.name, switch.line, switch.diverging_kmh),
        ("W 1", 36, Some(40.0))
    );
    for (element, length_m) in map.network.elements.iter().zip([400.0, 300.0, 300.0]) {
        assert!(
            (element.length_m() - length_m).abs() < 0.5,
            "{} {}",
            element.id,
            element.length_m()
        );
    }
    assert!(map.plan_is_laid_out && map.network.datum.is_none());
    let counts = |name: &str| {
        (
            map.report.counts[name].in_file,
            map.report.counts[name].taken,
        )
    };
    assert_eq!(
        [
            counts("netElement"),
            counts("netRelation"),
            counts("signalIS")
        ],
        [(5, 3), (3, 3), (2, 1)]
    );
    assert_eq!(
        [
            counts("speedSection"),
            counts("switchIS"),
            counts("horizontalCurve")
        ],
        [(2, 1), (1, 1), (2, 2)]
    );
    assert_eq!(counts("bufferStop"), (2, 1));
    let left = |what: &str| {
        map.report
            .left_out
            .iter()
            .find(|left| left.what == what)
            .unwrap()
    };
    assert!(
        left("netElement all").why.contains("collection of 3") && left("netElement all").line == 17
    );
    assert!(left("signalIS n2").why.contains("applicationDirection"));
    assert!(left("speedSection v2").why.contains("not the basic one"));
}

#[test]
fn what_lies_along_elements_is_taken_over() {
    let map = read(FORK).unwrap();
    let [stem, left, right] = map.along.as_slice() else {
        panic!()
    };
    assert_eq!(
        (stem.stated_m, left.stated_m, right.stated_m),
        (Some(1000.0), None, Some(1700.0))
    );
    assert_eq!(
        (
            stem.name.as_deref(),
            left.name.as_deref(),
            right.name.as_deref()
        ),
        (Some("Track 7"), None, Some("Track 7"))
    );
    assert_eq!(
        (stem.one_way, left.one_way, right.one_way),
        (Some(UP), None, Some(DOWN))
    );
    let balise = MapBalise {
        name: "ba".to_owned(),
        along_m: 100.0,
    };
    assert_eq!(stem.balises, [balise]);
    assert_eq!(
        stem.signals,
        [MapSignal {
            name: "N 1".to_owned(),
            along_m: 380.0,
            way: UP
        }]
    );
    assert_eq!(
        stem.speeds,
        [MapSpeed {
            from_m: 0.0,
            kmh: 80.0,
            way: Some(UP)
        }]
    );
    assert_eq!(stem.tunnels_m, [[50.0, 350.0]]);
    assert_eq!(
        [stem.buffers, left.buffers],
        [[false, false], [false, true]]
    );
    let step = |from_m, value| MapStep { from_m, value };
    assert_eq!(right.grades_permille, [step(0.0, -4.0)]);
    // Positive radii turn to the right; the transition leads to the straight after it, in steps.
    let curvatures = &stem.curvatures_per_m;
    assert_eq!(curvatures[..2], [step(0.0, 0.0), step(100.0, -1.0 / 500.0)]);
    assert_eq!(curvatures.len(), 11);
    assert!(
        (curvatures[2].value + 0.9375 / 500.0).abs() < 1e-12
            && (curvatures[2].from_m - 200.0).abs() < 1e-9
    );
    assert!((curvatures[9].value + 0.0625 / 500.0).abs() < 1e-12);
    assert_eq!(curvatures[10], step(280.0, 0.0));
}

#[test]
fn either_course_tells_which_leg_diverges() {
    for (courses, is_left) in [
        ("branchCourse=\"left\"", true),
        ("branchCourse=\"right\"", false),
        ("continueCourse=\"right\"", true),
        ("continueCourse=\"left\"", false),
        ("branchCourse=\"straight\" continueCourse=\"right\"", true),
    ] {
        let map =
            read(&FORK.replace("branchCourse=\"left\" continueCourse=\"right\"", courses)).unwrap();
        let legs = (map.switches[0].through, map.switches[0].diverging);
        let (left, right) = (end(1, DOWN), end(2, UP));
        assert_eq!(
            legs,
            if is_left {
                (right, left)
            } else {
                (left, right)
            },
            "{courses}"
        );
    }
}

/// A train may go back the way that it came; what is on no level of single elements is left out.
#[test]
fn levels_and_ways_are_as_stated() {
    let text = FORK.replacen("navigability=\"Both\"", "navigability=\"AB\"", 1).replace(
        "</topology>",
        "<networks><network id=\"nw\"><level id=\"lv\" descriptionLevel=\"Micro\"><networkResource ref=\"stem\"/>\
        <networkResource ref=\"left\"/><networkResource ref=\"right\"/></level></network></networks></topology>",
    );
    let text = text.replace(
        "<netElement id=\"all\">",
        "<netElement id=\"station\"/><netElement id=\"all\">",
    );
    let text = text.replace(
        "</netRelations>",
        "<netRelation id=\"x\" navigability=\"Both\" positionOnA=\"0\" positionOnB=\"1\"><elementA ref=\"station\"/><elementB ref=\"all\"/></netRelation></netRelations>",
    );
    let map = read(&text).unwrap();
    assert_eq!(map.network.onward(end(0, UP)), [end(1, UP), end(2, DOWN)]);
    assert_eq!(map.network.onward(end(1, DOWN)), [end(0, DOWN)]);
    let why = |what: &str| {
        &*map
            .report
            .left_out
            .iter()
            .find(|left| left.what == what)
            .unwrap()
            .why
    };
    assert!(why("netElement station").contains("level \"Micro\""));
    assert!(why("netRelation x").contains("between collections"));
}

/// With coordinates: x is longitude, and the curve that is stated turns to the right.
#[test]
fn elements_run_through_their_coordinates() {
    // On the meridian of the datum's own projection, 100 m east and a right turn of a radian by 300 m.
    let place = |at_m: f64, left_m: f64| {
        let angle = (at_m - 100.0).max(0.0) / 300.0;
        let (x, y) = (
            at_m.min(100.0) + (300.0 + left_m) * angle.sin(),
            (300.0 + left_m) * angle.cos() - 300.0,
        );
        let datum = crate::track::geodesy::Datum {
            place: crate::track::geodesy::Geodetic {
                latitude_deg: 59.0,
                longitude_deg: 10.0,
                height_m: 0.0,
            },
            heading_deg: 0.0,
        };
        let place = datum.geodetic(&nalgebra::Point3::new(x, y, 0.0));
        format!(
            "<geometricCoordinate positioningSystemRef=\"gps\" x=\"{}\" y=\"{}\"/>",
            place.longitude_deg, place.latitude_deg
        )
    };
    let text = format!(
        "<railML version=\"3.1\"><common><positioning><screenPositioningSystems><screenPositioningSystem id=\"screen\"/></screenPositioningSystems><geometricPositioningSystems><geometricPositioningSystem id=\"gps\" crsDefinition=\"EPSG:4326\"/>\
        </geometricPositioningSystems></positioning></common><infrastructure><topology><netElements><netElement id=\"e\" length=\"400\"><associatedPositioningSystem id=\"p\">\
        <intrinsicCoordinate id=\"a\" intrinsicCoord=\"0\">{}</intrinsicCoordinate><intrinsicCoordinate id=\"b\" intrinsicCoord=\"1\">{}</intrinsicCoordinate>\
        </associatedPositioningSystem></netElement></netElements></topology><functionalInfrastructure><x><horizontalCurve id=\"h\" curveType=\"arc\" radius=\"300\">\
        <linearLocation id=\"l\"><associatedNetElement netElementRef=\"e\" posBegin=\"100\" posEnd=\"400\"/></linearLocation></horizontalCurve>\
        <signalIS id=\"s\"><spotLocation id=\"n\" netElementRef=\"e\" pos=\"250\" applicationDirection=\"normal\">{}\
        <geometricCoordinate positioningSystemRef=\"screen\" x=\"1\" y=\"2\"/></spotLocation></signalIS></x></functionalInfrastructure></infrastructure></railML>",
        place(0.0, 0.0),
        place(400.0, 0.0),
        place(250.0, 3.0)
    );
    let map = read(&text).unwrap();
    assert!(!map.plan_is_laid_out);
    let (middle, _) = map.network.elements[0].at(250.0);
    let truth = nalgebra::Point2::new(100.0 + 300.0 * 0.5f64.sin(), -300.0 * (1.0 - 0.5f64.cos()));
    assert!((middle - truth).norm() < 0.02, "{middle}");
    let [check] = map.plan_checks.as_slice() else {
        panic!("{:?}", map.plan_checks)
    };
    assert!(
        check.along_m.abs() < 0.02 && (check.left_m - 3.0).abs() < 0.02,
        "{check:?}"
    );
    for (from, to, told) in [
        (" crsDefinition=\"EPSG:4326\"", "", "no datum"),
        ("EPSG:4326", "EPSG:31468", "is not read"),
        (
            "positioningSystemRef=\"gps\"",
            "positioningSystemRef=\"gsp\"",
            "no geometricPositioningSystem has as its `id`",
        ),
        (" x=\"10", " x=\"190", "is on no railway"),
        (" y=\"59", " y=\"nan\" z=\"59", "`y` is \"nan\""),
    ] {
        let error = read(&text.replacen(from, to, 1)).unwrap_err().to_string();
        assert!(error.contains(told), "{to}: {error}");
    }
}

/// A double slip: each track leads to both on the other side, and it is no switch of three tracks.
#[test]
fn slips_are_joints() {
    let element = |id: &str| format!("<netElement id=\"{id}\" length=\"100\"/>");
    let relation = |a: &str, b: &str, run: &str, at: [u8; 2]| {
        format!(
            "<netRelation id=\"{a}{b}\" navigability=\"{run}\" positionOnA=\"{}\" positionOnB=\"{}\"><elementA ref=\"{a}\"/><elementB ref=\"{b}\"/></netRelation>",
            at[0], at[1]
        )
    };
    let relations = [("a", "d"), ("a", "c"), ("b", "d"), ("b", "c")]
        .map(|(a, b)| relation(a, b, "Both", [1, 0]))
        .concat();
    let text = format!(
        "<railML version=\"3.2\"><infrastructure><topology><netElements>{}</netElements><netRelations>{relations}{}</netRelations></topology><functionalInfrastructure><s>\
        <switchIS id=\"p\" type=\"switchCrossingPart\"><leftBranch netRelationRef=\"ac\"/><rightBranch netRelationRef=\"ad\"/></switchIS>\
        <switchIS id=\"x\" type=\"doubleSwitchCrossing\"><straightBranch netRelationRef=\"ac\"/><straightBranch netRelationRef=\"bd\"/>\
        <turningBranch netRelationRef=\"ad\"/><turningBranch netRelationRef=\"bc\"/></switchIS></s></functionalInfrastructure></infrastructure></railML>",
        ["a", "b", "c", "d"].map(element).concat(),
        relation("a", "b", "None", [1, 1])
    );
    let map = read(&text).unwrap();
    assert!(map.switches.is_empty());
    assert_eq!(map.network.onward(end(0, UP)), [end(2, UP), end(3, UP)]);
    assert_eq!(
        map.network.onward(end(3, DOWN)),
        [end(1, DOWN), end(0, DOWN)]
    );
    let error = read(&text.replacen("<straightBranch netRelationRef=\"bd\"/>", "", 1))
        .unwrap_err()
        .to_string();
    assert!(error.contains("has 1 straightBranch"), "{error}");
}
