//! Maps of others, and fixes on them, with drawn mistakes.

use crate::fuzz::{Draw, cases, check_memory, execute, mutate, mutated_text};
use metrotwin::bus::SimTime;
use metrotwin::stack::occupancy::{Fix, Method, Occupancy, OccupancySettings};
use metrotwin::track::Tunnel;
use metrotwin::track::import::railml::{RailMlOptions, read_railml};
use metrotwin::track::import::{LayingOptions, OsmImport, TableImport, TableOptions};
use metrotwin::track::plan::PlanNetwork;
use nalgebra::{Matrix2, Point2};

/// Executions where nothing else is asked for.
const FEW: u64 = 4000;

const GEOJSON: &str = r#"{ "type": "FeatureCollection", "features": [
    { "type": "Feature", "properties": { "id": "a" }, "geometry": { "type": "LineString",
        "coordinates": [[4.48, 50.9], [4.481, 50.9], [4.482, 50.9002]] } },
    { "type": "Feature", "properties": { "id": "b" }, "geometry": { "type": "LineString",
        "coordinates": [[4.482, 50.9002], [4.484, 50.9004]] } },
    { "type": "Feature", "properties": { "id": "c" }, "geometry": { "type": "LineString",
        "coordinates": [[4.482, 50.9002], [4.484, 50.9007]] } },
    { "type": "Feature", "properties": { "id": "ab", "netelementA": "a", "netelementB": "b",
        "positionOnA": 1, "positionOnB": 0, "navigability": "both" } },
    { "type": "Feature", "properties": { "id": "ac", "netelementA": "a", "netelementB": "c",
        "positionOnA": 1, "positionOnB": 0, "navigability": "both" } }
] }"#;

const OSM: &str = r#"{ "elements": [
    { "type": "node", "id": 1, "lat": 50.9, "lon": 4.48 }, { "type": "node", "id": 2, "lat": 50.9, "lon": 4.482 },
    { "type": "node", "id": 3, "lat": 50.9, "lon": 4.484 }, { "type": "node", "id": 4, "lat": 50.9002, "lon": 4.484 },
    { "type": "node", "id": 5, "lat": 50.9006, "lon": 4.481, "tags": { "railway": "switch" } },
    { "type": "way", "id": 10, "nodes": [1, 2, 3], "tags": { "railway": "rail" } },
    { "type": "way", "id": 11, "nodes": [2, 4], "tags": { "railway": "rail" } },
    { "type": "way", "id": 12, "nodes": [5, 2], "tags": { "railway": "subway", "service": "siding" } }
] }"#;

const OSM_XML: &str = r#"<osm version="0.6"><node id="1" lat="50.9" lon="4.48"/><node id="2" lat="50.9" lon="4.482"/>
    <node id="3" lat="50.9" lon="4.486"/><node id="4" lat="50.90012" lon="4.4845"><tag k="railway" v="buffer_stop"/></node>
    <node id="5" lat="50.90004" lon="4.4827"/><node id="6" lat="50.9001" lon="4.4835"/>
    <way id="10"><nd ref="1"/><nd ref="2"/><nd ref="3"/><tag k="railway" v="rail"/><tag k="maxspeed" v="60"/></way>
    <way id="11"><nd ref="2"/><nd ref="5"/><nd ref="6"/><nd ref="4"/><tag k="railway" v="rail"/><tag k="tunnel" v="yes"/></way>
</osm>"#;

const ALIGNMENT: &str = "\
chainage_m;element;radius_m;turn;length_m;cant_mm;grade_permille;vertical_radius_m
1000,0;straight;;;150;;-3,0;2000
1150,0;clothoid;;;50;;;
1200,0;arc;500,0;right;200;60;;
1400,0;clothoid;;;50;;;
1450,0;straight;;;250;;2;
1700,0;end;;;;;;
";
const LAMPS: &str = "chainage_m,uid,lateral_m,height_m,aim_yaw_deg,power_w\n1010,1-001,2.7,3.2,65,21\n1020,2,2.7,3.2,,\n";

const RAILML_2: &str = r#"<railml version="2.2" xmlns="http://www.railml.org/schemas/2013"><infrastructure><tracks>
    <track id="a"><trackTopology>
        <trackBegin id="ab" pos="0" absPos="1000"><geoCoord coord="50.9 4.48" epsgCode="4326"/><openEnd id="o1"/></trackBegin>
        <trackEnd id="ae" pos="281.4" absPos="1281.4"><geoCoord coord="50.9 4.484" epsgCode="4326"/><openEnd id="o2"/></trackEnd>
        <connections><switch id="w" pos="140"><connection id="c1" ref="c2" orientation="outgoing" course="left" maxSpeed="40"/></switch>
            <crossing id="x" pos="200"><connection id="c3" ref="c4" orientation="incoming"/><connection id="c5" ref="c6" orientation="outgoing"/></crossing></connections>
    </trackTopology><trackElements>
        <speedChanges><speedChange id="v" pos="10" dir="up" vMax="80"/></speedChanges>
        <gradientChanges><gradientChange id="g" pos="0" slope="5"/></gradientChanges>
        <radiusChanges><radiusChange id="r" pos="60" radius="800"/><radiusChange id="q" pos="90" radius="0"/></radiusChanges>
        <tunnels><tunnel id="t" pos="20" length="60"/></tunnels>
    </trackElements><ocsElements><signals><signal id="s" pos="99" dir="down"><geoCoord coord="50.90002 4.4815" epsgCode="4326"/></signal></signals>
        <balises><balise id="z" pos="50"/></balises></ocsElements></track>
    <track id="b"><trackTopology><trackBegin pos="0"><connection id="c2" ref="c1"/></trackBegin>
        <trackEnd pos="150"><bufferStop id="o3"/></trackEnd></trackTopology></track>
    <track id="c"><trackTopology><trackBegin pos="0"><openEnd id="o4"/></trackBegin>
        <trackEnd pos="90"><connection id="c4" ref="c3"/></trackEnd></trackTopology></track>
    <track id="d"><trackTopology><trackBegin pos="0"><connection id="c6" ref="c5"/></trackBegin>
        <trackEnd pos="90"><openEnd id="o5"/></trackEnd></trackTopology></track>
</tracks></infrastructure></railml>"#;

const RAILML_3: &str = r#"<railML version="3.2" xmlns="https://www.railml.org/schemas/3.2"><infrastructure id="i"><topology><netElements>
    <netElement id="a" length="400"/><netElement id="b" length="300"/><netElement id="c" length="310"/>
    <netElement id="m"><elementCollectionUnordered id="k"><elementPart ref="a"/><elementPart ref="b"/></elementCollectionUnordered></netElement>
</netElements><netRelations>
    <netRelation id="ab" navigability="Both" positionOnA="1" positionOnB="0"><elementA ref="a"/><elementB ref="b"/></netRelation>
    <netRelation id="ac" navigability="Both" positionOnA="1" positionOnB="0"><elementA ref="a"/><elementB ref="c"/></netRelation>
    <netRelation id="bc" navigability="None" positionOnA="0" positionOnB="0"><elementA ref="b"/><elementB ref="c"/></netRelation>
</netRelations></topology><functionalInfrastructure>
    <switchesIS><switchIS id="w" type="ordinarySwitch" branchCourse="left"><leftBranch netRelationRef="ab" branchingSpeed="40"/><rightBranch netRelationRef="ac"/></switchIS></switchesIS>
    <signalsIS><signalIS id="s"><spotLocation id="l" netElementRef="a" pos="380" applicationDirection="normal"/></signalIS></signalsIS>
    <speeds><speedSection id="v" maxSpeed="80"><linearLocation id="n"><associatedNetElement netElementRef="a" posBegin="0" posEnd="250"/></linearLocation></speedSection></speeds>
    <curves><horizontalCurve id="h" curveType="arc" radius="500"><linearLocation id="p"><associatedNetElement netElementRef="b" posBegin="10" posEnd="250"/></linearLocation></horizontalCurve></curves>
</functionalInfrastructure></infrastructure></railML>"#;

/// Reads a map of some format.
type Reader = fn(&str) -> Result<PlanNetwork, String>;

fn osm(text: &str) -> Result<PlanNetwork, String> {
    let import = OsmImport::from_json(text, None).map_err(|e| e.to_string())?;
    Ok(import.map.network)
}

fn geojson(text: &str) -> Result<PlanNetwork, String> {
    PlanNetwork::from_geojson(text).map_err(|e| e.to_string())
}

fn railml(text: &str) -> Result<PlanNetwork, String> {
    let map = read_railml(text, &RailMlOptions::default()).map_err(|e| e.to_string())?;
    assert_eq!(map.along.len(), map.network.elements.len());
    Ok(map.network)
}

/// A text with something changed, by structure or without regard to it.
fn changed(draw: &mut Draw, text: &str) -> String {
    let value = serde_json::from_str::<toml::Value>(text);
    match value.ok().filter(|_| !draw.one_in(3)) {
        Some(mut value) => {
            for _ in 0..=draw.below(3) {
                mutate(draw, &mut value);
            }
            serde_json::to_string(&value).unwrap()
        }
        None => String::from_utf8_lossy(&mutated_text(draw, text.as_bytes())).into_owned(),
    }
}

/// Runs the filter over a network with fixes that may be anything.
fn locate(draw: &mut Draw, network: PlanNetwork) {
    let methods = [Method::Fused, Method::Pedal, Method::Perpendicular];
    let settings = OccupancySettings {
        method: *draw.pick(&methods),
        ..OccupancySettings::default()
    };
    let odd = [0.0, -1.0, 1e-300, 1e300, f64::NAN, f64::INFINITY, 20.0];
    let mut number = |usual: f64| {
        if draw.one_in(8) {
            *draw.pick(&odd)
        } else {
            usual
        }
    };
    let mut occupancy = Occupancy::new(network.into(), settings);
    for k in 0..30 {
        let second = number(f64::from(k));
        let time = SimTime::from_secs(if second.abs() < 1e9 { second } else { 0.0 });
        occupancy.on_speed(time, number(12.0));
        occupancy.on_yaw_rate(time, number(0.01));
        occupancy.on_fix(&Fix {
            time,
            place: Point2::new(number(12.0 * f64::from(k)), number(1.0)),
            covariance_m2: Matrix2::new(number(1.0), number(0.2), number(0.2), number(1.0)),
        });
        let decision = occupancy.decision();
        let sum: f64 = decision.tracks.iter().map(|track| track.probability).sum();
        assert!(
            decision.tracks.is_empty() || (sum - 1.0).abs() < 1e-6,
            "{decision:?}"
        );
    }
}

fn osm_xml(text: &str) -> Result<PlanNetwork, String> {
    OsmImport::from_xml(text, None)
        .map(|import| import.map.network)
        .map_err(|e| e.to_string())
}

/// A panic, an endless search, or a file that does not pass its checks.
#[test]
fn no_map_breaks_laying() {
    let (mut accepted, mut refused) = (0, 0);
    for case in cases(FEW / 40) {
        let draw = &mut Draw::of(case);
        let number = draw.below(4);
        let right = [OSM, OSM_XML, RAILML_2, RAILML_3][number];
        let text = changed(draw, right);
        let map = match number {
            0 => OsmImport::from_json(&text, None)
                .map(|import| import.map)
                .ok(),
            1 => OsmImport::from_xml(&text, None)
                .map(|import| import.map)
                .ok(),
            _ => read_railml(&text, &RailMlOptions::default()).ok(),
        };
        let Some(map) = map else {
            continue;
        };
        let options = LayingOptions {
            name: "drawn".to_owned(),
            sigma_m: 0.3,
            join: draw.one_in(2),
        };
        match execute(case, "laying", || map.lay(&options)) {
            Ok(laid) => {
                accepted += 1;
                let text = laid.file.to_text(&[]).unwrap();
                let read = Tunnel::from_toml(&text);
                assert!(read.is_ok(), "case {case}: {read:?}\n{text}");
            }
            Err(error) => {
                refused += 1;
                assert!(error.to_string().len() > 20);
            }
        }
    }
    println!("{accepted} accepted, {refused} refused");
    assert!(accepted > 0);
}

/// A panic, memory by a number that somebody wrote, or an error that says nothing.
#[test]
fn no_table_breaks_a_reader() {
    let (mut accepted, mut refused) = (0, 0);
    let options = TableOptions {
        name: "drawn".to_owned(),
        line_number: 1,
        datum: None,
        heading_deg: 0.0,
        is_open: false,
    };
    for case in cases(FEW) {
        let draw = &mut Draw::of(case);
        let mut text = |right: &str| match draw.one_in(4) {
            true => right.to_owned(),
            false => String::from_utf8_lossy(&mutated_text(draw, right.as_bytes())).into_owned(),
        };
        let (alignment, lamps) = (text(ALIGNMENT), text(LAMPS));
        match execute(case, "a table", || {
            TableImport::read(&alignment, Some(&lamps), &options)
        }) {
            Ok(import) => {
                accepted += 1;
                let text = import.file.to_text(&[]).unwrap();
                assert!(Tunnel::from_toml(&text).is_ok(), "case {case}: {text}");
            }
            Err(fault) => {
                refused += 1;
                let said = fault.to_string();
                assert!(
                    said.len() > 20 && said.len() < 20_000,
                    "case {case}: {said}"
                );
            }
        }
    }
    println!("{accepted} accepted, {refused} refused");
    assert!(accepted > 0 && refused > 0);
}

/// A panic, an endless search, memory by a number that somebody wrote, an error that says nothing, or probabilities
/// that are none.
#[test]
fn no_map_breaks_a_reader() {
    let (mut accepted, mut refused) = (0, 0);
    for case in cases(FEW) {
        let draw = &mut Draw::of(case);
        let formats: [(&str, Reader); 5] = [
            (OSM, osm),
            (OSM_XML, osm_xml),
            (GEOJSON, geojson),
            (RAILML_2, railml),
            (RAILML_3, railml),
        ];
        let (right, read) = *draw.pick(&formats);
        let text = changed(draw, right);
        let answer = execute(case, "a map", || read(&text));
        match answer {
            Ok(network) => {
                accepted += 1;
                execute(case, "fixes", || locate(draw, network));
            }
            Err(said) => {
                assert!(
                    said.len() > 20 && said.len() < 20_000,
                    "case {case}: {said}"
                );
                refused += 1;
            }
        }
        if case % 100 == 0 {
            check_memory();
        }
    }
    println!("{accepted} accepted, {refused} refused");
    assert!(accepted > 0 && refused > 0);
}
