//! A place in a file as a message shows it: its line and those around it, cut to what fits.
//!
//! A file may have lines of any length, and very many problems: neither may show in the size of the
//! message.

use crate::settings::shortened;
use miette::{MietteError, MietteSpanContents, SourceCode, SourceSpan, SpanContents};
use std::ops::Range;

/// Letters that are shown of a line.
const WIDEST: usize = 160;
/// Of which so many stand before the place, where the line is longer.
const BEFORE: usize = 40;
/// What stands for letters that are left out.
const LEFT_OUT: &str = "... ";

/// A line of a file with a place in it, between the lines before and after.
#[derive(Debug)]
pub(super) struct Excerpt {
    name: String,
    text: String,
    /// The place in `text`.
    pub(super) place: Range<usize>,
    /// Lines of the file before these.
    lines_before: usize,
    /// Bytes of the line that are left out before what is shown of it.
    bytes_left_out: usize,
}

impl Excerpt {
    /// Around a span of a text; `None` where the text has no such span.
    pub(super) fn around(name: String, text: &str, span: Range<usize>) -> Option<Self> {
        let (before, rest) = (text.get(..span.start)?, text.get(span.start..)?);
        let line_start = before.rfind('\n').map_or(0, |end| end + 1);
        let (lines_above, head) = before.split_at(line_start);
        let (line, below) = rest.split_once('\n').unwrap_or((rest, ""));
        let end = span.end.checked_sub(span.start)?.min(line.trim_end().len());
        let (marked, tail) = (line.get(..end)?, line.get(end..)?);

        let skipped = match head.chars().count() + line.chars().count() > WIDEST {
            true => head
                .char_indices()
                .rev()
                .nth(BEFORE - 1)
                .map_or(0, |(k, _)| k),
            false => 0,
        };
        let above = lines_above.lines().next_back();
        let above = above.map_or(String::new(), |line| shortened(line, WIDEST) + "\n");
        let mut shown = above.clone();
        if skipped > 0 {
            shown += LEFT_OUT;
        }
        shown += &shortened(head.get(skipped..)?, WIDEST);
        let start = shown.len();
        shown += &shortened(marked, WIDEST - BEFORE);
        let place = start..shown.len();
        let left = WIDEST.saturating_sub(shown.chars().count() - above.chars().count());
        shown += &shortened(tail, left);
        if let Some(line) = below.lines().next() {
            shown += "\n";
            shown += &shortened(line, WIDEST);
        }
        Some(Self {
            name,
            text: shown + "\n",
            place,
            lines_before: lines_above.lines().count().saturating_sub(1),
            bytes_left_out: skipped.saturating_sub(LEFT_OUT.len()),
        })
    }
}

impl SourceCode for Excerpt {
    fn read_span<'a>(
        &'a self,
        span: &SourceSpan,
        lines_before: usize,
        lines_after: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, MietteError> {
        let shown = self
            .text
            .as_str()
            .read_span(span, lines_before, lines_after)?;
        let left_out = match shown.column() {
            0 => 0,
            _ => self.bytes_left_out,
        };
        Ok(Box::new(MietteSpanContents::new_named(
            self.name.clone(),
            shown.data(),
            *shown.span(),
            shown.line() + self.lines_before,
            shown.column() + left_out,
            shown.line_count(),
        )))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    fn line_and_column(text: &str, span: Range<usize>) -> (usize, usize, String) {
        let excerpt = Excerpt::around("x.toml".to_owned(), text, span).unwrap();
        let contents = excerpt
            .read_span(&excerpt.place.clone().into(), 0, 0)
            .unwrap();
        let marked = excerpt.text[excerpt.place.clone()].to_owned();
        (contents.line(), contents.column(), marked)
    }

    /// Provokes: a line or column of the excerpt in place of the file's, a place that is off, a long
    /// line that is shown whole.
    #[test]
    fn an_excerpt_keeps_lines_and_columns_of_its_file() {
        let text = "a = 1\nb = 2\nc = 3\nd = 4\n";
        assert_eq!(line_and_column(text, 16..17), (2, 4, "3".to_owned()));
        assert_eq!(line_and_column(text, 0..1), (0, 0, "a".to_owned()));
        let long = format!(
            "a = 1\n{}b = [{}]\n",
            " ".repeat(70_000),
            "7, ".repeat(1000)
        );
        let (line, column, marked) = line_and_column(&long, 70_006..70_007);
        assert_eq!((line, column, marked.as_str()), (1, 70_000, "b"));
        let excerpt = Excerpt::around(String::new(), &long, 70_010..73_000).unwrap();
        assert!(excerpt.text.len() < 400, "{}", excerpt.text.len());
        for span in [0..0, long.len()..long.len(), long.len() - 1..long.len()] {
            Excerpt::around(String::new(), &long, span).unwrap();
        }
        assert!(Excerpt::around(String::new(), "", 0..0).is_some());
        assert!(Excerpt::around(String::new(), "\u{e4}", 1..2).is_none());
    }
}
