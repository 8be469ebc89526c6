//! Bounded fuzzing without a tool: draws that a seed repeats, mutations of text and of structure, and what
//! no input may cause.
//!
//! `METROTWIN_FUZZ=100000` asks for that many executions; without it there are few, always the same.
//! `METROTWIN_FUZZ_CASE=17` does one of them again.

#![allow(
    dead_code,
    clippy::panic,
    clippy::unwrap_used,
    clippy::disallowed_methods,
    reason = "no harness uses all of it, it fails by panicking, and measures how long answers take"
)]

use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::LazyLock;
use std::time::{Duration, Instant};
use toml::Value;

/// No answer takes longer.
const LONGEST: Duration = Duration::from_secs(2);
/// Nor more memory at a time, kB.
const MOST_KB: u64 = 500_000;

/// Cases to execute, `few` where the environment does not say.
pub fn cases(few: u64) -> Range<u64> {
    let number = |name: &str| std::env::var(name).ok().map(|text| text.parse().unwrap());
    match number("METROTWIN_FUZZ_CASE") {
        Some(case) => case..case + 1,
        None => 0..number("METROTWIN_FUZZ").unwrap_or(few),
    }
}

/// Numbers that a seed repeats (splitmix64).
pub struct Draw(u64);

impl Draw {
    /// Those of one case.
    pub fn of(case: u64) -> Self {
        Self(case.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x5DEE_CE66)
    }

    /// Any number.
    pub fn word(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// From 0 to 1.
    pub fn share(&mut self) -> f64 {
        self.word() as f64 / u64::MAX as f64
    }

    /// Under `n`; 0 of 0.
    pub fn below(&mut self, n: usize) -> usize {
        (self.word() % n.max(1) as u64) as usize
    }

    /// True one time in `n`.
    pub fn one_in(&mut self, n: usize) -> bool {
        self.below(n) == 0
    }

    /// One of several.
    pub fn pick<'a, T>(&mut self, all: &'a [T]) -> &'a T {
        &all[self.below(all.len())]
    }
}

/// Executes a case; fails where it panics or takes too long.
pub fn execute<T>(case: u64, what: &str, f: impl FnOnce() -> T) -> T {
    let begin = thread_time();
    let answer = catch_unwind(AssertUnwindSafe(f));
    let took = thread_time().saturating_sub(begin);
    let answer = answer.unwrap_or_else(|_| panic!("case {case}, {what}: it panicked"));
    assert!(took < LONGEST, "case {case}, {what}: {took:?}");
    answer
}

/// Time that this thread has run, so that a machine at work on other things makes no answer late; where
/// the system does not say, time on the wall.
fn thread_time() -> Duration {
    static BEGIN: LazyLock<Instant> = LazyLock::new(Instant::now);
    let said = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanos = said.and_then(|text| text.split_whitespace().next()?.parse().ok());
    nanos.map_or_else(|| BEGIN.elapsed(), Duration::from_nanos)
}

/// Fails where the process has ever taken too much memory.
pub fn check_memory() {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let peak = peak.map(|text| {
        text.trim()
            .trim_end_matches(" kB")
            .trim()
            .parse::<u64>()
            .unwrap()
    });
    assert!(peak.is_none_or(|kb| kb < MOST_KB), "{peak:?} kB");
}

/// What stands where something else is expected.
const TOKENS: [&str; 24] = [
    "NaN",
    "-1",
    "1e999",
    "-1e308",
    "18446744073709551615",
    "9223372036854775808",
    "0",
    "null",
    "\"\"",
    "{}",
    "[]",
    "true",
    "../../../etc/passwd",
    "/dev/zero",
    "\u{0}",
    "\n",
    "\r\n\t",
    "\"",
    "\\u0000",
    "}}}}",
    "[[[[[[[[",
    "\u{feff}",
    "é\u{202e}",
    "1e-320",
];

/// Bytes with something changed, left out, doubled or put in.
pub fn mutated_text(draw: &mut Draw, text: &[u8]) -> Vec<u8> {
    let mut text = text.to_vec();
    for _ in 0..=draw.below(4) {
        let at = draw.below(text.len());
        let end = (at + draw.below(40)).min(text.len());
        match draw.below(6) {
            0 if !text.is_empty() => text[at] ^= 1 << draw.below(8),
            1 => _ = text.drain(at..end),
            2 => text.truncate(at),
            3 => {
                let copy = text[at..end].to_vec();
                let to = draw.below(text.len());
                text.splice(to..to, copy);
            }
            // The number or name that stands there gives way to another token.
            4 => {
                let is_word = |b: &u8| b.is_ascii_alphanumeric() || b"._-".contains(b);
                let end = text[at..].iter().position(|b| !is_word(b)).unwrap_or(0) + at;
                text.splice(at..end, draw.pick(&TOKENS).bytes());
            }
            _ => _ = text.splice(at..at, draw.pick(&TOKENS).bytes()),
        }
    }
    text
}

/// Numbers at which something ends or turns.
const FLOATS: [f64; 16] = [
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    0.0,
    -0.0,
    1e308,
    -1e308,
    1e200,
    1e19,
    -1e19,
    1e9,
    5e-324,
    1e-12,
    -1.0,
    1.0,
    4e3,
];
const INTEGERS: [i64; 12] = [
    0,
    1,
    -1,
    2,
    63,
    255,
    256,
    65_536,
    u32::MAX as i64,
    i64::MAX,
    i64::MIN,
    1_000_000_000,
];

/// A value of the same kind, or now and then of another.
pub fn mutate_leaf(draw: &mut Draw, value: &mut Value) {
    *value = match &*value {
        _ if draw.one_in(100) => Value::String((*draw.pick(&TOKENS)).to_owned()),
        Value::Float(x) if draw.one_in(4) => Value::Float(x * 1.5 - 1.0),
        Value::Float(_) => Value::Float(*draw.pick(&FLOATS)),
        Value::Integer(n) if draw.one_in(3) => {
            Value::Integer(n.wrapping_add(draw.below(9) as i64 - 4))
        }
        Value::Integer(_) => Value::Integer(*draw.pick(&INTEGERS)),
        Value::Boolean(is) => Value::Boolean(!is),
        // Most texts are names of kinds, and with another none is left to read.
        Value::String(_) if draw.one_in(6) => Value::String((*draw.pick(&TOKENS)).to_owned()),
        other => other.clone(),
    };
}

/// Changes a leaf somewhere below; a list may lose or double an element, a table a key.
pub fn mutate(draw: &mut Draw, value: &mut Value) {
    match value {
        Value::Array(list) if !list.is_empty() => {
            let at = draw.below(list.len());
            match draw.below(12) {
                0 => _ = list.remove(at),
                1 => list.insert(at, list[at].clone()),
                _ => mutate(draw, &mut list[at]),
            }
        }
        Value::Table(table) if !table.is_empty() => {
            let keys: Vec<String> = table.keys().cloned().collect();
            let key = draw.pick(&keys);
            if draw.one_in(100) {
                table.remove(key);
            } else if let Some(inner) = table.get_mut(key) {
                mutate(draw, inner);
            }
        }
        leaf => mutate_leaf(draw, leaf),
    }
}
