//! The lamp's name on the air: how a UID becomes light switched on and off.
//!
//! Frame, sent over and over: header, line number (4 bits), lamp number (10 bits), check sum
//! (CRC-6, polynomial x^6 + x + 1 as in ITU-T G.704), footer. Two codes carry it:
//!
//! **Manchester** ([`LineCode::Manchester`], 48 chips). Each data bit is two chips (1 = on then
//! off, 0 = off then on, as in IEEE 802.15.7 PHY I), so no run in the data is longer than two
//! chips and the lamp's mean brightness does not depend on its name. The header is three chips
//! on, three off: runs that the data cannot contain, so the frame cannot be found anywhere else
//! when it is read cyclically. The footer is off, on; read cyclically its last chip makes the
//! header's bright run four chips long, and a first data bit of 0 does so to the dark run.
//!
//! **NRZ** ([`LineCode::Nrz`], 33 chips). A chip a bit, as the stripes of Zhang et al. 2023 have
//! it; after every 4 bits the complement of the last one, so runs end after 5 chips. The header
//! is six chips on and one off, the footer one off. Shorter, but the mean brightness depends on
//! the name.
//!
//! ```
//! use metrotwin::track::uid::{LineCode, Uid};
//!
//! let uid = Uid { line: 1, lamp: 152 };
//! let frame = uid.frame(LineCode::Manchester);
//! assert_eq!(frame.len, 48);
//! assert_eq!(Uid::from_frame(frame, LineCode::Manchester), Some(uid));
//! ```

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

/// A lamp's name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Uid {
    /// Line number, 0 to 15.
    pub line: u8,
    /// Lamp number on that line, 0 to 1023.
    pub lamp: u16,
}

impl fmt::Display for Uid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}-{}", self.line, self.lamp)
    }
}

/// One period of the switching signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ChipFrame {
    /// Bit k is chip k, 1 = light on; chip 0 is sent first.
    pub bits: u64,
    /// Chips in a period, at most 64.
    pub len: u32,
}

impl ChipFrame {
    /// Whether the lamp is on in chip `k`; never beyond the frame.
    pub fn is_on(&self, k: u32) -> bool {
        k < self.len && self.bits.checked_shr(k).unwrap_or(0) & 1 == 1
    }
}

/// Bits of line, lamp and check sum, most significant first.
pub const PAYLOAD_BITS: u32 = 20;
/// Chips of a Manchester frame: 6 header, 40 payload, 2 footer.
pub const MANCHESTER_CHIPS: u32 = 48;
/// Chips of an NRZ frame: 7 header, 20 payload with 5 complements, 1 footer.
pub const NRZ_CHIPS: u32 = 33;
/// Data bits of an NRZ group, which a complement follows.
const NRZ_GROUP_BITS: u32 = 4;

/// How the bits of a frame become chips.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LineCode {
    /// Two chips a bit, constant mean brightness.
    #[default]
    Manchester,
    /// One chip a bit, runs bounded by a complement after every 4 bits.
    Nrz,
}

impl LineCode {
    /// Chips of a frame.
    pub fn chips(self) -> u32 {
        match self {
            Self::Manchester => MANCHESTER_CHIPS,
            Self::Nrz => NRZ_CHIPS,
        }
    }

    /// Whether the complement of bit `k` of the payload, counted from the last one, follows it.
    fn has_complement(self, k: u32) -> bool {
        self == Self::Manchester || k.is_multiple_of(NRZ_GROUP_BITS)
    }

    /// The header: pattern (bit k is chip k) and its length in chips.
    pub fn header(self) -> (u64, u32) {
        match self {
            Self::Manchester => (0b000_111, 6),
            Self::Nrz => (0b011_1111, 7),
        }
    }
}

impl Uid {
    /// The 20 bits sent: line, lamp, CRC-6.
    pub fn payload(self) -> u32 {
        let data = (u32::from(self.line) & 0xf) << 10 | u32::from(self.lamp) & 0x3ff;
        data << 6 | crc6(data, 14)
    }

    /// From 20 received bits; `None` where the check sum is wrong.
    pub fn from_payload(payload: u32) -> Option<Self> {
        let data = payload >> 6;
        (payload >> PAYLOAD_BITS == 0 && crc6(data, 14) == payload & 0x3f).then_some(Self {
            line: (data >> 10) as u8,
            lamp: (data & 0x3ff) as u16,
        })
    }

    /// One period of the signal in a code.
    pub fn frame(self, code: LineCode) -> ChipFrame {
        let (mut bits, mut at) = code.header();
        let payload = self.payload();
        for k in (0..PAYLOAD_BITS).rev() {
            let bit = u64::from(payload >> k & 1);
            bits |= bit << at;
            at += 1;
            if code.has_complement(k) {
                bits |= (bit ^ 1) << at;
                at += 1;
            }
        }
        // Footer: off, on; of NRZ a chip off, for which nothing is set.
        if code == LineCode::Manchester {
            bits |= 0b10 << at;
        }
        ChipFrame {
            bits,
            len: code.chips(),
        }
    }

    /// From a whole frame that starts with its header; `None` where any chip cannot be.
    pub fn from_frame(frame: ChipFrame, code: LineCode) -> Option<Self> {
        let (_, header_chips) = code.header();
        let mut payload = 0;
        let mut at = header_chips;
        for k in (0..PAYLOAD_BITS).rev() {
            let bit = frame.is_on(at);
            payload = payload << 1 | u32::from(bit);
            at += 1 + u32::from(code.has_complement(k));
        }
        // Header, footer, second halves and complements are right if sending again gives the
        // same chips.
        Self::from_payload(payload).filter(|uid| uid.frame(code) == frame)
    }
}

/// CRC-6 (x^6 + x + 1) of the lowest `n` bits, most significant first.
fn crc6(data: u32, n: u32) -> u32 {
    (0..n).rev().fold(0, |crc, k| {
        let feedback = (crc >> 5 ^ data >> k) & 1;
        (crc << 1 & 0x3f) ^ (feedback * 0b00_0011)
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    const CODES: [LineCode; 2] = [LineCode::Manchester, LineCode::Nrz];

    fn all() -> impl Iterator<Item = Uid> {
        (0..16).flat_map(|line| (0..1024).map(move |lamp| Uid { line, lamp }))
    }

    fn cyclic(frame: ChipFrame, from: u32) -> impl Iterator<Item = bool> {
        (0..frame.len).map(move |k| frame.is_on((from + k) % frame.len))
    }

    /// Longest runs of equal chips, read cyclically, in falling order.
    fn runs(frame: ChipFrame) -> Vec<u32> {
        let len = frame.len;
        let change = |k: u32| frame.is_on(k % len) != frame.is_on((k + len - 1) % len);
        let starts: Vec<u32> = (0..len).filter(|k| change(*k)).collect();
        let next = starts.iter().skip(1).copied().chain([starts[0] + len]);
        let mut runs: Vec<u32> = starts.iter().zip(next).map(|(a, b)| b - a).collect();
        runs.sort_unstable_by(|a, b| b.cmp(a));
        runs
    }

    /// Provokes: two names with the same signal, or a frame that is not read back.
    #[test]
    fn frames_are_read_back_and_nothing_else_is() {
        for code in CODES {
            for uid in all() {
                let frame = uid.frame(code);
                assert_eq!(frame.len, code.chips());
                assert_eq!(Uid::from_frame(frame, code), Some(uid));
                let damaged = ChipFrame {
                    bits: frame.bits ^ 1 << (uid.lamp as u32 % frame.len),
                    len: frame.len,
                };
                assert_eq!(Uid::from_frame(damaged, code), None);
            }
        }
    }

    /// Provokes: a header that data can imitate: over all names and cyclic shifts the header
    /// stands at one place only.
    #[test]
    fn a_frame_cannot_be_found_inside_itself() {
        for code in CODES {
            let (pattern, n) = code.header();
            for uid in all() {
                let frame = uid.frame(code);
                let found = (0..frame.len)
                    .filter(|from| {
                        cyclic(frame, *from)
                            .take(n as usize)
                            .enumerate()
                            .all(|(k, on)| on == (pattern >> k & 1 == 1))
                    })
                    .count();
                assert_eq!(found, 1, "{uid} {code:?}");
            }
        }
    }

    /// Provokes: data runs as long as the header's, which a single chip would have to distinguish.
    #[test]
    fn runs_are_bounded() {
        for uid in all() {
            let manchester = runs(uid.frame(LineCode::Manchester));
            assert!(manchester[0] == 4 && (3..=4).contains(&manchester[1]));
            assert!(manchester[2] <= 2);
            let nrz = runs(uid.frame(LineCode::Nrz));
            assert_eq!(nrz[0], 6);
            assert!(nrz[1] <= 5);
        }
    }

    /// Provokes: a lamp whose brightness depends on its name (flicker from lamp to lamp).
    #[test]
    fn manchester_is_on_half_of_the_time() {
        for uid in all() {
            assert_eq!(
                uid.frame(LineCode::Manchester).bits.count_ones(),
                MANCHESTER_CHIPS / 2
            );
        }
    }

    /// Provokes: a check polynomial of too short a period or with a reflected shift: every one
    /// and two wrong bits of the 20 are noticed, for every name.
    #[test]
    fn val_crc_detects_one_and_two_wrong_bits() {
        for uid in all() {
            let sent = uid.payload();
            assert_eq!(Uid::from_payload(sent), Some(uid));
            for a in 0..PAYLOAD_BITS {
                assert_eq!(Uid::from_payload(sent ^ 1 << a), None);
                for b in 0..a {
                    assert_eq!(Uid::from_payload(sent ^ 1 << a ^ 1 << b), None);
                }
            }
            assert_eq!(Uid::from_payload(sent | 1 << PAYLOAD_BITS), None);
        }
    }

    /// Remainder of polynomial division by x^6 + x + 1, done on the whole word at once.
    #[test]
    fn val_crc_is_the_remainder_of_the_polynomial() {
        for data in 0..1 << 14 {
            let mut rest: u32 = data << 6;
            for k in (6..20).rev() {
                if rest >> k & 1 == 1 {
                    rest ^= 0b100_0011 << (k - 6);
                }
            }
            assert_eq!(crc6(data, 14), rest);
        }
    }
}
