//! The JSON Schemas in the repository are those of the types.
#![cfg(feature = "twin")]
#![allow(clippy::expect_used, reason = "a test fails by panicking")]

use metrotwin::scenario::schema;
use std::path::Path;

/// Fails when a settings struct changed (a key, a default, a doc comment) and its schema did not.
/// `METROTWIN_WRITE_SCHEMAS=1 cargo test --release --test schema` writes them anew.
#[test]
fn schemas_are_up_to_date() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for (path, text) in schema::all().expect("the types have schemas") {
        let file = root.join(path);
        if std::env::var_os("METROTWIN_WRITE_SCHEMAS").is_some() {
            std::fs::write(&file, &text).expect("the schema can be written");
        }
        let kept = std::fs::read_to_string(&file).unwrap_or_default();
        assert!(
            kept == text,
            "{path} is not what the types say; run\n  \
             METROTWIN_WRITE_SCHEMAS=1 cargo test --release --test schema\nand commit the result"
        );
    }
}
