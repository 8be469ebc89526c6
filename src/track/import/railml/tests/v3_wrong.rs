//! Wrong files of railML 3.x.

use super::v3::{FORK, read};
use crate::track::import::railml::RailMlError;

/// Fails where a wrong file passes, or the message does not name line, element and what would be right.
#[test]
fn what_is_wrong_is_named() {
    for (from, to, told) in [
        ("</common>", "", "line 39"),
        (
            "elementA ref=\"stem\"",
            "elementA ref=\"stern\"",
            "line 21: netRelation (sl): `elementA` is \"stern\", which no netElement",
        ),
        (
            "positionOnB=\"0\"",
            "positionOnB=\"2\"",
            "line 21: netRelation (sl): `positionOnB` is \"2\": 0 (begin) or 1 (end)",
        ),
        (
            "navigability=\"Both\"",
            "navigability=\"Some\"",
            "line 21: netRelation (sl): `navigability` is \"Some\"",
        ),
        (
            "navigability=\"Both\"",
            "navigability=\"None\"",
            "line 37: leftBranch (of switchIS w): trains do not run over \"sl\"",
        ),
        (
            "<netElement id=\"left\" length=\"300\"/>",
            "<netElement id=\"left\"/>",
            "line 12: netElement (left): has no `length`",
        ),
        (
            "length=\"400\"",
            "length=\"-400\"",
            "line 8: netElement (stem): is -400 m long",
        ),
        (
            "length=\"400\"",
            "length=\"inf\"",
            "line 8: netElement (stem): `length` is \"inf\"",
        ),
        (
            "id=\"left\"",
            "id=\"stem\"",
            "line 12: netElement (stem): has the id of an element on line 8",
        ),
        (
            "elementPart ref=\"stem\"",
            "elementPart ref=\"more\"",
            "contains",
        ),
        (
            "elementPart ref=\"stem\"",
            "elementPart ref=\"all\"",
            "line 17: netElement (all): contains \"all\", which contains it",
        ),
        (
            "elementPart ref=\"stem\"",
            "elementPart ref=\"nix\"",
            "line 17: elementPart (of elementCollectionUnordered ec): `ref` is \"nix\"",
        ),
        (
            "intrinsicCoord=\"1\"",
            "intrinsicCoord=\"1.5\"",
            "line 10: intrinsicCoordinate (i2): `intrinsicCoord` is 1.5",
        ),
        (
            "<rightBranch netRelationRef=\"sr\"/>",
            "",
            "line 36: switchIS (w): needs one `rightBranch`",
        ),
        (
            "<rightBranch netRelationRef=\"sr\"/>",
            "<rightBranch netRelationRef=\"sl\"/>",
            "line 36: switchIS (w): its two branches are one",
        ),
        (
            "netRelationRef=\"sl\"",
            "netRelationRef=\"xx\"",
            "line 37: leftBranch (of switchIS w): `netRelationRef` is \"xx\"",
        ),
        (
            "branchCourse=\"left\" continueCourse=\"right\"",
            "",
            "line 36: switchIS (w): nothing tells which leg diverges",
        ),
        (
            "pos=\"380\"",
            "pos=\"480\"",
            "line 32: spotLocation (l5): lies at 480 m, outside its track, which is 400 m long",
        ),
        (
            "pos=\"380\"",
            "",
            "line 32: spotLocation (l5): has neither `pos`",
        ),
        (
            "netElementRef=\"stem\" pos=\"380\"",
            "netElementRef=\"steam\" pos=\"380\"",
            "line 32: spotLocation (l5): `netElementRef` is \"steam\"",
        ),
        (
            "radius=\"500\"",
            "radius=\"5\"",
            "line 28: horizontalCurve (h1): `radius` is 5",
        ),
        (
            "radius=\"500\"",
            "",
            "line 28: horizontalCurve (h1): `radius` is missing",
        ),
        (
            "gradient=\"4\"",
            "gradient=\"400\"",
            "line 30: gradientCurve (g1): `gradient` is 400",
        ),
        (
            "maxSpeed=\"80\"",
            "maxSpeed=\"0\"",
            "line 34: speedSection (v1): `maxSpeed` is 0",
        ),
    ] {
        assert!(FORK.contains(from), "{from}");
        let error = read(&FORK.replacen(from, to, 1)).unwrap_err().to_string();
        assert!(error.contains(told), "{to}: {error}");
    }
    let empty = "<railML version=\"3.2\"><infrastructure><topology/></infrastructure></railML>";
    assert!(matches!(read(empty), Err(RailMlError::NoTracks)));
    // Other versions of the third generation are read alike.
    for version in ["3.1", "3.3"] {
        assert!(read(&FORK.replace("3.2", version)).is_ok());
    }
}
