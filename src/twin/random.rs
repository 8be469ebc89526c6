//! Randomness without order: every random number is a hash of what it is for, so nothing depends
//! on the order of calls or on threads, and a single run, frame or pixel can be made again alone.
//!
//! A [`Stream`] is hash(seed, run index, name of the source); its k-th number is a hash of the
//! stream and k. The 32-bit hash is pcg4d (Jarzynski and Olano, "Hash functions for GPU
//! rendering", JCGT 9(3), 2020), which the shaders compute too, bit for bit.

/// The numbers of one source of randomness.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Stream {
    /// Lower and upper half of the key.
    pub key: [u32; 2],
}

impl Stream {
    /// The stream of source `name` in run `index` of a study with `seed`.
    pub fn new(seed: u64, index: u64, name: &str) -> Self {
        // FNV-1a folds the name into 64 bits, splitmix64 mixes.
        let name = name.bytes().fold(0xcbf2_9ce4_8422_2325u64, |h, b| {
            (h ^ u64::from(b)).wrapping_mul(0x100_0000_01b3)
        });
        let key = splitmix64(splitmix64(splitmix64(seed) ^ index) ^ name);
        Self {
            key: [key as u32, (key >> 32) as u32],
        }
    }

    /// Four independent 32-bit words for a pair of counters.
    #[inline(always)]
    pub fn words(self, a: u32, b: u32) -> [u32; 4] {
        pcg4d([self.key[0], self.key[1], a, b])
    }

    /// Uniform in (0, 1), number `k` of the stream.
    pub fn uniform(self, k: u64) -> f64 {
        let w = self.words(k as u32, (k >> 32) as u32);
        unit(w[0], w[1])
    }

    /// Standard normal, number `k` of the stream (Box-Muller).
    pub fn normal(self, k: u64) -> f64 {
        let w = self.words(k as u32, (k >> 32) as u32);
        let (u1, u2) = (unit(w[0], w[1]), unit(w[2], w[3]));
        (-2.0 * u1.ln()).sqrt() * (std::f64::consts::TAU * u2).cos()
    }
}

/// The seed of a named part of what a seed makes.
pub fn branch(seed: u64, name: &str) -> u64 {
    let [low, high] = Stream::new(seed, 0, name).key;
    u64::from(high) << 32 | u64::from(low)
}

/// 53 bits to the open interval (0, 1).
fn unit(low: u32, high: u32) -> f64 {
    let bits = (u64::from(high) << 32 | u64::from(low)) >> 11;
    (bits as f64 + 0.5) / (1u64 << 53) as f64
}

/// The hash of four words, a bijection; the same in `shaders/`.
#[inline(always)]
pub fn pcg4d(v: [u32; 4]) -> [u32; 4] {
    let mut v = v.map(|x| x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    for round in 0..2 {
        v[0] = v[0].wrapping_add(v[1].wrapping_mul(v[3]));
        v[1] = v[1].wrapping_add(v[2].wrapping_mul(v[0]));
        v[2] = v[2].wrapping_add(v[0].wrapping_mul(v[1]));
        v[3] = v[3].wrapping_add(v[1].wrapping_mul(v[2]));
        if round == 0 {
            v = v.map(|x| x ^ (x >> 16));
        }
    }
    v
}

fn splitmix64(x: u64) -> u64 {
    let mut z = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
