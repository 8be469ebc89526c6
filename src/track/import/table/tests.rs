use super::*;
use crate::track::Tunnel;
use crate::track::file::PlanShape;
use crate::track::section::Side;

const LINE: &str = "\
Chainage_m;Element;Radius_m;Turn;Cant_mm;Grade_permille\n\
12000,0;straight;;;;-3,0\n\
12150,0;clothoid;;;;\n\
12200,0;arc;500,0;right;60;\n\
12400,0;clothoid;;;;\n\
12450,0;straight;;;;2\n\
12700,0;end;;;;\n";
const ROW: &str = "chainage_m,uid,lateral_m,height_m\n12010,1-001,2.7,3.2\n12020,2,2.7,3.2\n";

fn options() -> TableOptions {
    TableOptions {
        name: "line".to_owned(),
        line_number: 1,
        datum: None,
        heading_deg: 30.0,
        is_open: false,
    }
}

/// Provokes: curvature to the wrong side, lengths, cants, grades or lamps that are not those of the table.
#[test]
fn a_line_is_as_its_table_says() {
    let import = TableImport::read(LINE, Some(ROW), &options()).unwrap();
    assert!((import.length_m - 700.0).abs() < 1e-9);
    let text = import.file.to_text(&[]).unwrap();
    let tunnel = Tunnel::from_toml(&text).unwrap();
    let track = tunnel.first_track();
    let middle = track.alignment.at(300.0);
    assert!((middle.curvature_per_m + 1.0 / 500.0).abs() < 1e-12);
    assert!((middle.roll_rad - (0.06f64 / 1.5).asin()).abs() < 1e-9);
    assert!((track.alignment.at(175.0).curvature_per_m + 0.001).abs() < 1e-12);
    assert!((track.alignment.at(100.0).slope + 0.003).abs() < 1e-12);
    assert!((track.alignment.at(600.0).slope - 0.002).abs() < 1e-12);
    assert!((track.alignment.at(0.0).heading_rad - 30f64.to_radians()).abs() < 1e-12);
    let stated = track.stated_chainage.as_ref().unwrap();
    assert_eq!(stated.text(300.0, 0), "km 12.300");
    let lamps: Vec<_> = track
        .lamps
        .iter()
        .map(|lamp| (lamp.uid.lamp, lamp.chainage_m))
        .collect();
    assert_eq!(lamps, [(1, 10.0), (2, 20.0)]);
}

#[test]
fn signs_of_radii_are_sides() {
    let text = "chainage_m,radius_m,length_m\n0,inf,100\n100,-400,50\n150,0,20\n170,400,30\n";
    let import = TableImport::read(text, None, &options()).unwrap();
    let turns = import.file.plan.iter().filter_map(|e| match e.shape {
        PlanShape::Arc { turn, .. } => Some(turn),
        _ => None,
    });
    let turns: Vec<Side> = turns.collect();
    assert_eq!(turns, [Side::Right, Side::Left]);
    assert!(import.file.stated_chainage.is_none());
}

/// Fails where a unit is taken for another one: metres for millimetres, percent or a ratio for permille.
#[test]
fn cants_and_grades_have_the_unit_of_their_column() {
    let written = |text: &str| {
        let import = TableImport::read(text, None, &options()).unwrap();
        (import.file.plan, import.file.grades)
    };
    let as_before = written(LINE);
    for (cant, grade, of_60_mm, falls, rises) in [
        ("cant_m", "grade_percent", "0,06", "-0,3", "0,2"),
        ("Cant_M", "gradient_ratio", "0,060", "-3:1000", "1:500"),
        ("cant_mm", "Grade_ratio", "60,0", "-0,003", " 1 : 500 "),
    ] {
        let text = LINE
            .replace("Cant_mm", cant)
            .replace("Grade_permille", grade)
            .replace(";60;", &format!(";{of_60_mm};"))
            .replace("-3,0", falls)
            .replace(";2\n", &format!(";{rises}\n"));
        assert_eq!(written(&text), as_before, "{text}");
    }
    let level = LINE
        .replace("Grade_permille", "grade_ratio")
        .replace("-3,0", "0");
    let (_, grades) = written(&level.replace(";2\n", ";-1:40\n"));
    let grades: Vec<f64> = grades.iter().map(|grade| grade.grade_permille).collect();
    assert_eq!(grades, [0.0, -25.0]);
    for (from, to, told) in [
        (
            ";2\n",
            ";1:0\n",
            "line 6, column `grade_ratio`: \"1\" to \"0\" is no ratio",
        ),
        (";2\n", ";1:x\n", "line 6, column `grade_ratio`"),
        // One to forty, or forty to one?
        (";2\n", ";40\n", "line 6: "),
        (
            "\n12150,0;clothoid;",
            "\n12150,0;clothoid:1;",
            "line 3, column `element`",
        ),
    ] {
        let text = level.replacen(from, to, 1);
        let fault = TableImport::read(&text, None, &options())
            .unwrap_err()
            .to_string();
        assert!(fault.contains(told), "{told}: {fault}");
    }
    let twice = "chainage_m,radius_m,length_m,cant_mm,cant_m\n0,400,50,60,0.06\n";
    let fault = TableImport::read(twice, None, &options())
        .unwrap_err()
        .to_string();
    assert!(
        fault.contains("line 2, column `cant_m`: `cant_mm` says it too"),
        "{fault}"
    );
}

/// Fails where a line that is in the open has a roof.
#[test]
fn a_line_may_lie_in_the_open() {
    for is_open in [false, true] {
        let options = TableOptions {
            is_open,
            ..options()
        };
        let import = TableImport::read(LINE, Some(ROW), &options).unwrap();
        let tunnel = Tunnel::from_toml(&import.file.to_text(&[]).unwrap()).unwrap();
        let sections = &tunnel.first_track().sections;
        assert!(!sections.is_empty() && sections.iter().all(|r| r.section.is_open() == is_open));
    }
}

/// Fails where a wrong table passes, or the message does not name line and column.
#[test]
fn what_is_wrong_is_named() {
    for (from, to, told) in [
        ("12400,0", "12100,0", "line 4, column `chainage_m`"),
        (
            "500,0;right",
            ";right",
            "line 4, column `radius_m`: an arc has no radius",
        ),
        ("500,0;right", "500,0;", "line 4, column `turn`"),
        ("500,0;right", "-500,0;right", "line 4, column `radius_m`"),
        ("arc;500", "bow;500", "line 4, column `element`: \"bow\""),
        (";60;", ";180;", "line 4: "),
        (
            "12700,0;end;;;;\n",
            "",
            "line 6: the last row has no length",
        ),
        ("-3,0", "-300", "line 2: "),
        ("Radius_m", "Rad", "no column `radius_m`"),
        (
            "12000,0;straight;;",
            "12000,0;straight;70;",
            "line 2, column `radius_m`",
        ),
    ] {
        assert!(LINE.contains(from), "{from}");
        let text = LINE.replacen(from, to, 1);
        let fault = TableImport::read(&text, None, &options()).unwrap_err();
        assert!(
            !fault.is_of_lamps && fault.to_string().contains(told),
            "{told}: {fault}"
        );
    }
    for (from, to, told) in [
        ("12010", "11010", "line 2, column `chainage_m`"),
        ("1-001", "3-001", "line 2, column `number`"),
        ("20,2,", "20,x,", "line 3, column `number`"),
        ("20,2,2.7", "20,2,9.7", "line 3: "),
    ] {
        let text = ROW.replacen(from, to, 1);
        let fault = TableImport::read(LINE, Some(&text), &options()).unwrap_err();
        assert!(
            fault.is_of_lamps && fault.to_string().contains(told),
            "{told}: {fault}"
        );
    }
}
