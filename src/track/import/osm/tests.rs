use super::*;

/// A line with a siding on its left: nodes 1 - 2 - 3 - 4 - 5, and 2 - 6 - 7 - 4.
const SIDING: &str = r#"{ "elements": [
        { "type": "node", "id": 1, "lat": 48.2, "lon": 15.600 }, { "type": "node", "id": 2, "lat": 48.2, "lon": 15.602 },
        { "type": "node", "id": 3, "lat": 48.2, "lon": 15.604 }, { "type": "node", "id": 4, "lat": 48.2, "lon": 15.606 },
        { "type": "node", "id": 5, "lat": 48.2, "lon": 15.608 },
        { "type": "node", "id": 6, "lat": 48.20005, "lon": 15.6026 }, { "type": "node", "id": 7, "lat": 48.20005, "lon": 15.6054 },
        { "type": "way", "id": 10, "nodes": [1, 2, 3], "tags": { "railway": "rail" } },
        { "type": "way", "id": 11, "nodes": [3, 4, 5, 99], "tags": { "railway": "rail" } },
        { "type": "way", "id": 12, "nodes": [2, 6, 7, 4], "tags": { "railway": "rail", "service": "siding" } },
        { "type": "way", "id": 13, "nodes": [1, 5], "tags": { "railway": "abandoned" } }
    ] }"#;

#[test]
fn a_siding_has_two_switches() {
    let import = OsmImport::from_json(SIDING, None).unwrap();
    let count = |kind| import.junctions.get(&kind).copied().unwrap_or(0);
    assert_eq!(
        [JunctionKind::Switch, JunctionKind::Joint, JunctionKind::End].map(count),
        [2, 1, 2]
    );
    assert_eq!((import.ways, import.cut.as_slice()), (3, [11].as_slice()));
    assert_eq!(import.left_out["abandoned"], 1);
    let ids: Vec<&str> = import.map.network.elements.iter().map(|e| &*e.id).collect();
    assert_eq!(ids, ["10", "10.2", "11", "11.2", "12"]);
    let from_west = ElementEnd {
        element: 0,
        way: Direction::Up,
    };
    let legs: Vec<usize> = import
        .map
        .network
        .onward(from_west)
        .iter()
        .map(|end| end.element)
        .collect();
    assert_eq!(legs, [1, 4]);
    // From the siding's end back onto the line's other leg no train runs.
    let from_siding = ElementEnd {
        element: 4,
        way: Direction::Down,
    };
    let next: Vec<usize> = import
        .map
        .network
        .onward(from_siding)
        .iter()
        .map(|end| end.element)
        .collect();
    assert_eq!(next, [0]);
    // 0.008 degrees of longitude at this latitude, and the siding.
    let east_m = 0.008 * 74_330.0;
    assert!(
        (import.length_m - east_m - 0.004 * 74_330.0).abs() < 2.0,
        "{}",
        import.length_m
    );
}

/// The same map as XML.
const SIDING_XML: &str = r#"<?xml version="1.0"?>
<osm version="0.6">
  <node id="1" lat="48.2" lon="15.600"/> <node id="2" lat="48.2" lon="15.602"/>
  <node id="3" lat="48.2" lon="15.604"><tag k="railway" v="signal"/><tag k="ref" v="A 1"/><tag k="railway:signal:direction" v="forward"/></node>
  <node id="4" lat="48.2" lon="15.606"/>
  <node id="5" lat="48.2" lon="15.608"><tag k="railway" v="buffer_stop"/></node>
  <node id="6" lat="48.20005" lon="15.6026"/> <node id="7" lat="48.20005" lon="15.6054"/>
  <node id="8" lat="48.3" lon="15.6" action="delete"/>
  <way id="10"><nd ref="1"/><nd ref="2"/><nd ref="3"/><tag k="railway" v="rail"/><tag k="maxspeed" v="100"/></way>
  <way id="11">
    <nd ref="3"/><nd ref="4"/><nd ref="5"/><tag k="railway" v="rail"/></way>
  <way id="12"><nd ref="2"/><nd ref="6"/><nd ref="7"/><nd ref="4"/><tag k="railway" v="rail"/><tag k="tunnel" v="yes"/><tag k="railway:track_ref" v="3"/></way>
  <way id="13"><nd ref="1"/><nd ref="5"/><tag k="railway" v="abandoned"/></way>
</osm>"#;

/// Provokes: readers that differ, and lines that are not those of the file.
#[test]
fn xml_is_read_as_json_is() {
    let xml = OsmImport::from_xml(SIDING_XML, None).unwrap();
    let json = OsmImport::from_json(SIDING, None).unwrap();
    assert_eq!(xml.junctions, json.junctions);
    for (a, b) in xml
        .map
        .network
        .elements
        .iter()
        .zip(&json.map.network.elements)
    {
        assert!(a.id == b.id && (a.length_m() - b.length_m()).abs() < 1e-9);
    }
    let lines: Vec<usize> = xml.map.along.iter().map(|along| along.line).collect();
    assert_eq!(lines, [9, 9, 10, 10, 12]);
    let siding = &xml.map.along[4];
    assert_eq!(
        (siding.name.as_deref(), siding.tunnels_m.len()),
        (Some("track 3"), 1)
    );
    assert!(
        (xml.map.along[1].signals[0].along_m - 2.0 * 74.33).abs() < 1.0,
        "{:?}",
        xml.map.along[1]
    );
    assert_eq!(xml.map.along[3].buffers, [false, true]);
    // The line goes on straightest, and the siding is not signed.
    assert_eq!(xml.map.switches.len(), 2);
    assert!(
        xml.map
            .switches
            .iter()
            .all(|s| s.diverging.element == 4 && s.diverging_kmh.is_none())
    );
}

#[test]
fn a_part_is_cut_out() {
    let around = |longitude_deg| AroundPlace {
        place: Geodetic {
            latitude_deg: 48.2,
            longitude_deg,
            height_m: 0.0,
        },
        radius_m: 200.0,
    };
    let part = OsmImport::from_json(SIDING, Some(around(15.6015))).unwrap();
    let ids: Vec<&str> = part.map.network.elements.iter().map(|e| &*e.id).collect();
    assert_eq!(ids, ["10", "10.2", "12"]);
    let error = OsmImport::from_json(SIDING, Some(around(48.2))).unwrap_err();
    assert!(
        error.to_string().contains("no track within 200 m"),
        "{error}"
    );
}

#[test]
fn wrong_xml_is_refused_with_its_line() {
    for (from, to, told) in [
        (
            "lon=\"15.608\"",
            "lon=\"east\"",
            "line 6: `lon` of this `node` is \"east\"",
        ),
        (
            "id=\"7\" lat=\"48.20005\"",
            "id=\"7\" lat=\"98.2\"",
            "line 7: node 7",
        ),
        (
            "<nd ref=\"4\"/><nd ref=\"5\"/>",
            "<nd ref=\"4\"/><nd/>",
            "line 11: `ref`",
        ),
        ("</osm>", "", "not XML"),
        ("<osm version=\"0.6\">", "<svg>", "not XML"),
    ] {
        assert!(SIDING_XML.contains(from), "{from}");
        let error = OsmImport::from_xml(&SIDING_XML.replacen(from, to, 1), None).unwrap_err();
        assert!(error.to_string().contains(told), "{told}: {error}");
    }
}

#[test]
fn wrong_files_are_refused() {
    for (from, to, told) in [
        ("\"rail\"", "\"disused\"", "no way with `railway`"),
        (
            "\"lat\": 48.2, \"lon\": 15.600",
            "\"lat\": 148.2, \"lon\": 15.600",
            "node 1",
        ),
        ("\"elements\"", "\"features\"", "missing field `elements`"),
        ("] }", "", "line "),
    ] {
        let text = SIDING.replace(from, to);
        let error = OsmImport::from_json(&text, None).unwrap_err().to_string();
        assert!(error.contains(told), "{told}: {error}");
    }
}
