use super::*;

const COLUMNS: [SheetColumn; 2] = [
    SheetColumn {
        name: "chainage_m",
        others: &["station"],
        is_needed: true,
    },
    SheetColumn {
        name: "radius_m",
        others: &[],
        is_needed: false,
    },
];

#[test]
fn tables_of_all_offices_are_the_same() {
    for text in [
        "chainage_m,radius_m\n0,300.5\n12.5,\n",
        "\u{feff}Chainage_m;Radius_m;remark\r\n0;300,5;a\r\n;;\r\n12,5;;\r\n",
        "radius_m\tSTATION\n\"300,5\"\t0\n\t12,5\n",
    ] {
        let sheet = Sheet::read(text, &COLUMNS).unwrap();
        let cells: Vec<_> = sheet
            .rows()
            .map(|row| {
                let row = row.unwrap();
                (
                    row.needed("chainage_m").unwrap(),
                    row.number("radius_m").unwrap(),
                )
            })
            .collect();
        assert_eq!(cells, [(0.0, Some(300.5)), (12.5, None)], "{text}");
    }
}

#[test]
fn wrong_cells_are_named() {
    let said = |text: &str| match Sheet::read(text, &COLUMNS) {
        Ok(sheet) => sheet
            .rows()
            .map(|row| row?.needed("chainage_m"))
            .find_map(Result::err)
            .map(|e| e.to_string()),
        Err(error) => Some(error.to_string()),
    };
    for (text, told) in [
        ("", "empty"),
        (
            "km;radius_m\n1;2\n",
            "no column `chainage_m`; the columns are `km`, `radius_m`",
        ),
        ("chainage_m,station\n1,2\n", "twice"),
        (
            "chainage_m,radius_m\n1,2\nx,3\n",
            "line 3, column `chainage_m`: \"x\" is no number",
        ),
        ("chainage_m;radius_m\n1.000,5;2\n", "line 2"),
        (
            "chainage_m;radius_m\n;2\n",
            "line 2, column `chainage_m`: is empty",
        ),
        (
            "chainage_m,radius_m\n1,2\n12,5,300\n",
            "line 3: the row has 3 cells, and there are 2 headers; write numbers with a decimal point",
        ),
        // As an editor counts them, whatever ends a line, and whatever lies between rows.
        ("chainage_m;radius_m\r\n1;2\r\nx;3\r\n", "line 3, "),
        (
            "\u{feff}chainage_m;radius_m\r\n\r\n1;2\r\n;;\r\n\r\nx;3",
            "line 6, ",
        ),
        ("\n\nchainage_m,radius_m\n1,2\n\n\nx,3\n", "line 7, "),
        ("chainage_m,radius_m\n1,\"2\n\"\nx,3\n", "line 4, "),
    ] {
        let said = said(text).unwrap();
        assert!(said.contains(told), "{told}: {said}");
    }
}
