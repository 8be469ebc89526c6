//! Conditions between named values: `gap_m > 2.0 * size_m && !(dark || wet)`.

use crate::settings::shortened;
use exmex::regex::{Captures, Regex};
use exmex::{
    BinOp, Express, FlatEx, MakeOperators, MatchLiteral, Operator, literal_matcher_from_pattern,
    ops_factory,
};
use std::borrow::Cow;
use std::sync::LazyLock;

/// One operator between two numbers; a larger `prio` binds tighter.
macro_rules! between {
    ($sign:literal, $prio:literal, $apply:expr) => {
        Operator::make_bin(
            $sign,
            BinOp {
                apply: $apply,
                prio: $prio,
                is_commutative: false,
            },
        )
    };
}

// Numbers throughout: true is 1, false is 0. Priorities are those of most languages.
ops_factory!(
    Operators,
    f64,
    between!("||", 0, |a, b| f64::from(a > 0.5 || b > 0.5)),
    between!("&&", 1, |a, b| f64::from(a > 0.5 && b > 0.5)),
    between!("<", 2, |a, b| f64::from(a < b)),
    between!("<=", 2, |a, b| f64::from(a <= b)),
    between!(">", 2, |a, b| f64::from(a > b)),
    between!(">=", 2, |a, b| f64::from(a >= b)),
    between!("==", 2, |a: f64, b| f64::from(
        a.to_bits() == f64::to_bits(b) || a - b == 0.0
    )),
    between!("!=", 2, |a: f64, b| f64::from(a - b != 0.0)),
    Operator::make_bin_unary(
        "+",
        BinOp {
            apply: |a, b| a + b,
            prio: 3,
            is_commutative: true,
        },
        |a| a,
    ),
    Operator::make_bin_unary(
        "-",
        BinOp {
            apply: |a, b| a - b,
            prio: 3,
            is_commutative: false,
        },
        |a: f64| -a,
    ),
    between!("*", 4, |a, b| a * b),
    between!("/", 4, |a, b| a / b),
    between!("^", 5, f64::powf),
    between!("min", 6, f64::min),
    between!("max", 6, f64::max),
    Operator::make_unary("!", |a| f64::from(a < 0.5)),
    Operator::make_unary("abs", f64::abs),
    Operator::make_unary("sqrt", f64::sqrt),
    Operator::make_unary("ln", f64::ln),
    Operator::make_unary("exp", f64::exp),
    Operator::make_unary("floor", f64::floor)
);

literal_matcher_from_pattern!(Numbers, r"^([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?");

/// The parser's time grows with the square of the length.
const LONGEST: usize = 2000;

/// A condition, parsed.
#[derive(Clone, Debug)]
pub struct Condition {
    text: String,
    /// Large: it holds its nodes by value.
    expression: Box<FlatEx<f64, Operators, Numbers>>,
}

/// Why a condition cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ConditionError {
    /// It is no expression.
    #[error("`{0}` is no condition: {1}")]
    Form(String, String),
    /// It names something that is not there, or is no number.
    #[error("`{0}` names `{1}`, which is not known here, or is no number")]
    Unknown(String, String),
    /// Its value is not yes or no.
    #[error("`{0}` is neither true nor false: {1}")]
    NoCondition(String, String),
}

impl Condition {
    /// Parses one of `+ - * / ^`, `< <= > >= == !=`, `&& || !`, `abs(x)`, `sqrt(x)`, `ln(x)`, `exp(x)`,
    /// `floor(x)`, `min(x, y)`, `max(x, y)`, numbers and names; names in braces may hold anything.
    pub fn parse(text: &str) -> Result<Self, ConditionError> {
        let shown = || shortened(text, 200);
        if text.len() > LONGEST {
            let why = format!("it is longer than {LONGEST} letters");
            return Err(ConditionError::Form(shown(), why));
        }
        let form = |e: exmex::ExError| ConditionError::Form(shown(), e.to_string());
        Ok(Self {
            text: text.to_owned(),
            expression: Box::new(FlatEx::parse(&in_braces(text)).map_err(form)?),
        })
    }

    /// The condition as written.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Names in it, without braces.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.expression.var_names().iter().map(|name| {
            let inner = name.strip_prefix('{').and_then(|n| n.strip_suffix('}'));
            inner.unwrap_or(name)
        })
    }

    /// Whether it holds for these values; `None` of a name where its value is not there (a figure that
    /// this run does not have), and then nothing holds.
    pub fn holds(
        &self,
        value_of: impl Fn(&str) -> Result<Option<f64>, ()>,
    ) -> Result<Option<bool>, ConditionError> {
        let mut values = Vec::new();
        for name in self.names() {
            let unknown = |()| ConditionError::Unknown(self.text.clone(), name.to_owned());
            match value_of(name).map_err(unknown)? {
                Some(value) => values.push(value),
                None => return Ok(None),
            }
        }
        let wrong = |why: String| ConditionError::NoCondition(self.text.clone(), why);
        let value = self.expression.eval(&values);
        match value.map_err(|e| wrong(e.to_string()))? {
            x if x.is_nan() => Err(wrong("it gives no number".into())),
            // A flag or a count is a condition by itself: `collision`, `missed`.
            x => Ok(Some(x.abs() > 0.0)),
        }
    }
}

/// Names in braces, whole numbers with their powers of ten, functions, and names without braces.
#[allow(clippy::unwrap_used, reason = "the pattern is right")]
static WORDS: LazyLock<Regex> = LazyLock::new(|| {
    Regex::new(
        r"(?x)
          \{[^}]*\}?
        | [0-9.]+ ([eE][+-]?[0-9]+)?
        | [a-zA-Z_][a-zA-Z0-9_]* [\ \t\r\n]* \(
        | (?<name>[a-zA-Z_][a-zA-Z0-9_]*)",
    )
    .unwrap()
});

/// With all names in braces: the parser would take `min_gap_m` for the function `min`.
fn in_braces(text: &str) -> Cow<'_, str> {
    WORDS.replace_all(text, |word: &Captures<'_>| match word.name("name") {
        Some(name) => format!("{{{}}}", name.as_str()),
        None => word[0].to_owned(),
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    fn holds(text: &str) -> Result<Option<bool>, ConditionError> {
        Condition::parse(text)?.holds(|name| match name {
            "a" => Ok(Some(2.0)),
            "train.speed[0]" => Ok(Some(5.0)),
            "flag" | "min_flag" => Ok(Some(1.0)),
            "gone" => Ok(None),
            _ => Err(()),
        })
    }

    /// Precedence, names in braces, values that are not there, names that nobody knows, expressions
    /// that are no condition.
    #[test]
    fn conditions_hold_or_say_why_not() {
        assert_eq!(holds("a + 1.5 * 2 <= {train.speed[0]}"), Ok(Some(true)));
        assert_eq!(holds("a > 3 || (a < 3 && a != 2)"), Ok(Some(false)));
        assert_eq!(holds("flag && a == 2"), Ok(Some(true)));
        assert_eq!(holds("flag"), Ok(Some(true)));
        assert_eq!(holds("min_flag > 0.5"), Ok(Some(true)));
        assert_eq!(holds("max(a, 1.5e1) == 15"), Ok(Some(true)));
        assert_eq!(holds("a > 2e-7 && a<.5E+1"), Ok(Some(true)));
        assert_eq!(holds("!flag"), Ok(Some(false)));
        assert_eq!(holds("gone > 1 && a > 0"), Ok(None));
        assert!(matches!(holds("b > 1"), Err(ConditionError::Unknown(_, name)) if name == "b"));
        assert_eq!(holds("a - 2"), Ok(Some(false)));
        assert_eq!(holds("a + 1"), Ok(Some(true)));
        assert!(matches!(
            holds("sqrt(1 - a)"),
            Err(ConditionError::NoCondition(..))
        ));
        assert!(matches!(holds("a > "), Err(ConditionError::Form(..))));
        let nested = |n: usize| format!("{}a{} > 1", "(".repeat(n), ")".repeat(n));
        assert_eq!(holds(&nested(900)), Ok(Some(true)));
        assert!(matches!(
            holds(&nested(1_000_000)),
            Err(ConditionError::Form(..))
        ));
    }
}
