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

/// How a lamp blinks: a chip frame sent over and over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Waveform {
    /// One period.
    pub frame: ChipFrame,
    /// Duration of a chip.
    pub chip_s: f64,
    /// Time of the start of some period, seconds.
    pub phase_s: f64,
}

impl Waveform {
    /// Duration of the whole frame.
    pub fn period_s(&self) -> f64 {
        self.chip_s * f64::from(self.frame.len)
    }

    /// Share of the interval from `open_s` to `close_s` in which the lamp is on: the exact
    /// integral of the waveform.
    pub fn on_share(&self, open_s: f64, close_s: f64) -> f64 {
        let (a, b) = (
            (open_s - self.phase_s) / self.chip_s,
            (close_s - self.phase_s) / self.chip_s,
        );
        if b <= a {
            return f64::from(u8::from(self.on_at(open_s)));
        }
        (self.on_until(b) - self.on_until(a)) / (b - a)
    }

    /// Whether the lamp is on at a time.
    pub fn on_at(&self, t_s: f64) -> bool {
        let chip = ((t_s - self.phase_s) / self.chip_s).floor();
        self.frame
            .is_on(chip.rem_euclid(f64::from(self.frame.len)) as u32)
    }

    /// Chips' worth of light between the phase's origin and `x` chips later.
    fn on_until(&self, x: f64) -> f64 {
        let len = f64::from(self.frame.len);
        let periods = (x / len).floor();
        let inside = x - periods * len;
        let whole = inside.floor();
        let mask = if whole >= 64.0 {
            u64::MAX
        } else {
            (1u64 << whole as u32) - 1
        };
        let full = f64::from(self.frame.bits.count_ones());
        let current = if self.frame.is_on(whole as u32) {
            inside - whole
        } else {
            0.0
        };
        periods * full + f64::from((self.frame.bits & mask).count_ones()) + current
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

    /// The header: pattern (bit k is chip k) and its length in chips.
    pub fn header(self) -> (u64, u32) {
        match self {
            Self::Manchester => (0b000_111, 6),
            Self::Nrz => (0b011_1111, 7),
        }
    }

    /// The longest run of equal chips that data can make.
    pub fn longest_data_run(self) -> u32 {
        match self {
            Self::Manchester => 2,
            Self::Nrz => 5,
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
        match code {
            LineCode::Manchester => self.manchester(),
            LineCode::Nrz => self.nrz(),
        }
    }

    /// From a whole frame that starts with its header; `None` where any chip cannot be.
    pub fn from_frame(frame: ChipFrame, code: LineCode) -> Option<Self> {
        let (_, header_chips) = code.header();
        let mut payload = 0;
        let mut at = header_chips;
        for k in 0..PAYLOAD_BITS {
            let bit = frame.is_on(at);
            payload = payload << 1 | u32::from(bit);
            at += match code {
                LineCode::Manchester => 2,
                LineCode::Nrz if (k + 1) % NRZ_GROUP_BITS == 0 => 2,
                LineCode::Nrz => 1,
            };
        }
        // Header, footer, second halves and complements are right if sending again gives the
        // same chips.
        Self::from_payload(payload).filter(|uid| uid.frame(code) == frame)
    }

    /// One period of the Manchester signal.
    pub fn manchester(self) -> ChipFrame {
        let (mut bits, mut at) = LineCode::Manchester.header();
        let payload = self.payload();
        for k in (0..PAYLOAD_BITS).rev() {
            bits |= if payload >> k & 1 == 1 { 0b01 } else { 0b10 } << at;
            at += 2;
        }
        // Footer: off, on.
        bits |= 0b10 << at;
        ChipFrame {
            bits,
            len: MANCHESTER_CHIPS,
        }
    }

    /// One period of the NRZ signal. The footer is a chip off, so nothing is set for it.
    fn nrz(self) -> ChipFrame {
        let (mut bits, mut at) = LineCode::Nrz.header();
        let payload = self.payload();
        for k in (0..PAYLOAD_BITS).rev() {
            let bit = u64::from(payload >> k & 1);
            bits |= bit << at;
            at += 1;
            if k % NRZ_GROUP_BITS == 0 {
                bits |= (bit ^ 1) << at;
                at += 1;
            }
        }
        ChipFrame {
            bits,
            len: NRZ_CHIPS,
        }
    }
}

/// CRC-6 (x^6 + x + 1) of the lowest `n` bits, most significant first.
fn crc6(data: u32, n: u32) -> u32 {
    (0..n).rev().fold(0, |crc, k| {
        let feedback = (crc >> 5 ^ data >> k) & 1;
        (crc << 1 & 0x3f) ^ (feedback * 0b00_0011)
    })
}
