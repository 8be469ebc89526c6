//! Maps of others, as they are recorded.

use super::recorded::recorded;
use metrotwin::track::Direction;
use metrotwin::track::import::OsmImport;
use metrotwin::track::plan::ElementEnd;
use std::fs;

/// Every junction of a map of a region is something, and no train turns at one.
#[test]
#[ignore = "needs METROTWIN_RECORDED, a folder with maps/*_osm.json that may not be distributed; \
    track::import::junction and track::import::osm test the same on drawn junctions and a small map"]
fn recorded_maps_are_read() {
    for entry in fs::read_dir(recorded().join("maps")).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if !name.ends_with("_osm.json") {
            continue;
        }
        let import = OsmImport::from_json(&fs::read_to_string(&path).unwrap(), None).unwrap();
        println!(
            "{name}: {:.1} km, {} ways, {} elements, {:?}, unclear {:?}, left out {:?}, cut {}",
            import.length_m / 1000.0,
            import.ways,
            import.map.network.elements.len(),
            import.junctions,
            import.unclear,
            import.left_out,
            import.cut.len()
        );
        let network = &import.map.network;
        for element in 0..network.elements.len() {
            for way in [Direction::Up, Direction::Down] {
                let end = ElementEnd { element, way };
                let leaves = |end: ElementEnd, reach_m: f64| {
                    let element = &network.elements[end.element];
                    let m = match end.way {
                        Direction::Up => element.length_m() - reach_m.min(element.length_m()),
                        Direction::Down => reach_m.min(element.length_m()),
                    };
                    element.at(m).0
                };
                for next in network.onward(end) {
                    let at = leaves(end, 0.0);
                    let before = at - leaves(end, 15.0);
                    let after = leaves(next.opposite(), 15.0) - at;
                    let turn = before.angle(&after).to_degrees();
                    assert!(
                        turn <= 90.5,
                        "{name}: element {element} turns by {turn} degrees"
                    );
                }
            }
        }
    }
}
