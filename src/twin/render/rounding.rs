//! Whole numbers from real ones in loops that become vector code.

/// Added to a number below it, it leaves no bits behind the point: 2^23.
const WHOLE: f32 = 8_388_608.0;
/// The bits of the number that was added.
const WHOLE_BITS: u32 = (1 << 23) - 1;

/// The nearest whole number, the even one of two, from 0 to `most`.
#[inline(always)]
pub fn rounded(number: f32, most: f32) -> u32 {
    (least(greatest(number, 0.0), most) + WHOLE).to_bits() & WHOLE_BITS
}

/// The lesser of two numbers, in one instruction, which that of the standard library is not.
#[inline(always)]
pub fn least(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The greater.
#[inline(always)]
pub fn greatest(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}
