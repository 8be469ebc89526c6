//! Numbers of a file, held against the range that they may have.

use schemars::Schema;
use std::ops::RangeInclusive;

/// What a key may hold that a range can be given for: a number, a list of numbers, or nothing.
pub trait Numbers {
    /// The first number that does not lie in a range; one that is no number (NaN) never does.
    fn first_outside(&self, range: &RangeInclusive<f64>) -> Option<f64>;
}

macro_rules! numbers {
    ($($number:ty)*) => { $(
        impl Numbers for $number {
            fn first_outside(&self, range: &RangeInclusive<f64>) -> Option<f64> {
                let value = f64::from(*self);
                (!range.contains(&value)).then_some(value)
            }
        }
    )* };
}

numbers!(u8 u16 u32 f64);

impl Numbers for u64 {
    fn first_outside(&self, range: &RangeInclusive<f64>) -> Option<f64> {
        (*self as f64).first_outside(range)
    }
}

impl<N: Numbers> Numbers for Option<N> {
    fn first_outside(&self, range: &RangeInclusive<f64>) -> Option<f64> {
        self.as_ref()?.first_outside(range)
    }
}

impl<N: Numbers, const COUNT: usize> Numbers for [N; COUNT] {
    fn first_outside(&self, range: &RangeInclusive<f64>) -> Option<f64> {
        self.iter().find_map(|n| n.first_outside(range))
    }
}

impl<N: Numbers> Numbers for &N {
    fn first_outside(&self, range: &RangeInclusive<f64>) -> Option<f64> {
        (*self).first_outside(range)
    }
}

/// The default of a scale or a count.
pub(crate) fn one<N: From<u8>>() -> N {
    N::from(1)
}

/// Puts a range into the schema of a number, or of the numbers of a list.
pub fn put_range(range: RangeInclusive<f64>) -> impl FnMut(&mut Schema) {
    let (low, high) = range.into_inner();
    move |schema| {
        let place = schema.get("items").map_or("", |_| "/items");
        let numbers = schema.pointer_mut(place).and_then(|n| n.as_object_mut());
        let Some(numbers) = numbers else {
            return;
        };
        let format = numbers.get("format").and_then(|format| format.as_str());
        let whole = format.is_some_and(|format| format.starts_with("uint"));
        for (key, limit) in [("minimum", low), ("maximum", high)] {
            let limit = match whole {
                true => (limit as u64).into(),
                false => limit.into(),
            };
            numbers.insert(key.to_owned(), limit);
        }
    }
}
