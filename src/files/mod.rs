//! Results on the disk: files that are whole or not there, and the list of those that a command has written into a
//! folder, so that no other file there is ever removed or written over.

mod listing;
mod whole;

pub(crate) use listing::Listing;
pub(crate) use whole::{probe, write_whole};

/// What only commands with a world use.
#[cfg(feature = "twin")]
pub(crate) use {
    listing::{LIST, foreign, why_foreign},
    whole::{PartFile, create_new, is_empty, open_in_place, part_name, remove},
};
