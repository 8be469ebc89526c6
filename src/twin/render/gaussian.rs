//! Normal numbers for many texels at a time: those of `gaussian` in `shaders/sensor.wgsl`.

use crate::twin::random::pcg4d;
use std::f32::consts::TAU;

/// Texels that are worked at together. A whole loop over so many becomes vector code; over fewer it would
/// be unrolled first.
pub const BLOCK_TEXELS: usize = 64;
/// 2^-24.
const UNIT: f32 = 1.0 / 16_777_216.0;
/// Bits of 2^-0.5.
const HALF_OCTAVE: u32 = 0x3f35_04f3;
const MANTISSA: u32 = 0x007f_ffff;
/// ln 2 in two parts, the first with few bits.
const LN_2: [f32; 2] = [0.693_359_4, -2.121_944_4e-4];
/// A quarter of a turn, in steps of 2^-24.
const QUARTER_BITS: u32 = 22;

/// Four standard normal numbers for each texel from `counter` on, by Box and Muller's transform.
#[inline(always)]
pub fn gaussian(key: [u32; 3], counter: u32, out: &mut [f32; 4 * BLOCK_TEXELS]) {
    let [a, b, c, d] = words(key, counter);
    let (mut first, mut second) = ([0.0; BLOCK_TEXELS], [0.0; BLOCK_TEXELS]);
    for (radius, word) in first.iter_mut().zip(&a) {
        *radius = radius_of(*word);
    }
    for (radius, word) in second.iter_mut().zip(&c) {
        *radius = radius_of(*word);
    }
    for k in 0..BLOCK_TEXELS {
        let ([sin_b, cos_b], [sin_d, cos_d]) = (sin_cos(b[k]), sin_cos(d[k]));
        out[4 * k] = first[k] * cos_b;
        out[4 * k + 1] = second[k] * cos_d;
        out[4 * k + 2] = first[k] * sin_b;
        out[4 * k + 3] = second[k] * sin_d;
    }
}

/// Two of two words.
#[inline(always)]
pub fn pair(a: u32, b: u32) -> [f32; 2] {
    let (radius, [sin, cos]) = (radius_of(a), sin_cos(b));
    [radius * cos, radius * sin]
}

/// The words of each counter.
#[inline(always)]
fn words([x, y, z]: [u32; 3], counter: u32) -> [[u32; BLOCK_TEXELS]; 4] {
    let mut all = [[0; BLOCK_TEXELS]; 4];
    let [to_a, to_b, to_c, to_d] = &mut all;
    for k in 0..BLOCK_TEXELS {
        let [a, b, c, d] = pcg4d([x, y, z, counter.wrapping_add(k as u32)]);
        (to_a[k], to_b[k], to_c[k], to_d[k]) = (a, b, c, d);
    }
    all
}

/// The square root of minus twice the logarithm of a number in (0, 1) with the word's upper 24 bits.
#[inline(always)]
fn radius_of(word: u32) -> f32 {
    let number = ((word >> 8) as i32 as f32 + 0.5) * UNIT;
    (-2.0 * ln(number)).abs().sqrt()
}

/// The natural logarithm of a normal positive number (Cephes, logf: the mantissa between the roots of 1/2
/// and 2, a polynomial in what it is over 1).
#[inline(always)]
fn ln(number: f32) -> f32 {
    let shifted = number.to_bits().wrapping_sub(HALF_OCTAVE);
    let exponent = (shifted as i32 >> 23) as f32;
    let x = f32::from_bits((shifted & MANTISSA).wrapping_add(HALF_OCTAVE)) - 1.0;
    let mut sum = 7.037_683_6e-2;
    for term in [
        -1.151_461e-1,
        1.167_699_9e-1,
        -1.242_014_1e-1,
        1.424_932_3e-1,
        -1.666_805_8e-1,
        2.000_071_5e-1,
        -2.499_999_4e-1,
        3.333_333e-1,
    ] {
        sum = sum * x + term;
    }
    let square = x * x;
    let small = sum * x * square + exponent * LN_2[1] - 0.5 * square;
    x + small + exponent * LN_2[0]
}

/// Sine and cosine of the part of a turn that the word's upper 24 bits and a half say (Cephes, sinf and
/// cosf: polynomials within an eighth of a turn of the nearest quarter).
#[inline(always)]
fn sin_cos(word: u32) -> [f32; 2] {
    let steps = word >> 8;
    let quarter = (steps + (1 << (QUARTER_BITS - 1))) >> QUARTER_BITS;
    let past = steps.wrapping_sub(quarter << QUARTER_BITS) as i32;
    let x = (past as f32 + 0.5) * (TAU * UNIT);
    let z = x * x;
    let sin = x + x * z * (-1.666_665_5e-1 + z * (8.332_161e-3 + z * -1.951_529_6e-4));
    let high = 4.166_664_6e-2 + z * (-1.388_731_6e-3 + z * 2.443_315_7e-5);
    let cos = 1.0 - 0.5 * z + z * z * high;
    let (sin, cos) = if quarter & 1 == 1 {
        (cos, sin)
    } else {
        (sin, cos)
    };
    let signed = |x: f32, negative: u32| f32::from_bits(x.to_bits() ^ (negative << 31));
    [
        signed(sin, quarter >> 1 & 1),
        signed(cos, (quarter + 1) >> 1 & 1),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A word in another order, a wrong quarter of a turn, a polynomial that is off: each number of many
    /// blocks against double precision.
    #[test]
    fn numbers_are_those_of_double_precision() {
        let unit = |word: u32| (f64::from(word >> 8) + 0.5) / 16_777_216.0;
        let mut found = [0.0; 4 * BLOCK_TEXELS];
        let mut worst = 0.0f64;
        for block in 0..2000u32 {
            let (key, counter) = ([block, 77, block * 3], block.wrapping_mul(0x9e37_79b9));
            gaussian(key, counter, &mut found);
            for (k, found) in (0..).zip(found.chunks_exact(4)) {
                let word = pcg4d([key[0], key[1], key[2], counter.wrapping_add(k)]);
                let radius = |w: u32| (-2.0 * unit(w).ln()).sqrt();
                let turn = |w: u32| (std::f64::consts::TAU * unit(w)).sin_cos();
                let ((sin_b, cos_b), (sin_d, cos_d)) = (turn(word[1]), turn(word[3]));
                let (first, second) = (radius(word[0]), radius(word[2]));
                let right = [first * cos_b, second * cos_d, first * sin_b, second * sin_d];
                for (found, right) in found.iter().zip(right) {
                    worst = worst.max((f64::from(*found) - right).abs());
                }
            }
        }
        // A number close to 1 loses its half step, which its logarithm, then the radius, is made of.
        assert!(worst < 2e-5, "{worst}");
    }

    /// The ends of the range: no number that is none.
    #[test]
    fn ends_are_finite() {
        for word in [0, 255, 256, u32::MAX, u32::MAX - 256, 1 << 31, 1 << 30] {
            assert!(radius_of(word).is_finite());
            let [sin, cos] = sin_cos(word);
            assert!((sin * sin + cos * cos - 1.0).abs() < 1e-6);
        }
        assert!(radius_of(0) > 5.8 && radius_of(u32::MAX) < 1e-3);
    }
}
