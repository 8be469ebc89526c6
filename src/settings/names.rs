//! Names that a user may have meant.

/// The known key that a wrong one was most likely meant to be: the same stem with another unit,
/// else the nearest by edit distance if that is near.
pub fn did_you_mean<'k>(wrong: &str, known: &'k [String]) -> Option<&'k str> {
    let stem = |key: &str| key.rsplit_once('_').map(|(stem, _)| stem.to_owned());
    let same_stem = known.iter().find(|k| {
        k.as_str() == wrong
            || stem(k).is_some_and(|s| Some(&s) == stem(wrong).as_ref() || s == wrong)
    });
    same_stem
        .or_else(|| {
            known
                .iter()
                .map(|k| (strsim::levenshtein(wrong, k), k))
                .filter(|(distance, k)| *distance <= 1 + k.len().min(wrong.len()) / 4)
                .min_by_key(|(distance, _)| *distance)
                .map(|(_, k)| k)
        })
        .map(String::as_str)
}

/// What would be right in place of a wrong name: the known one that it was most likely meant to be,
/// else all known ones under a heading, or other advice where there is none.
pub fn name_advice(wrong: &str, known: &[String], heading: &str, without_any: &str) -> String {
    match did_you_mean(wrong, known) {
        Some(similar) => format!("did you mean `{similar}`?"),
        None if known.is_empty() => without_any.to_owned(),
        None => format!("{heading}: {}", known.join(", ")),
    }
}
