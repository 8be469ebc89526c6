//! The virtual array: a transmitter and a receiver together are like one element at the sum of their places.
//!
//! An echo from azimuth a of a far target reaches the element at y with the phase -2 pi y u / wave, with u = sin a. Beams
//! are evenly spaced in u, by wave / (C s) for C elements a distance s apart: then they are orthogonal, a Fourier
//! transform, and the noise of one is independent of that of others. Elements that are not evenly spaced get as many
//! beams as fit their aperture; these are not orthogonal, but each still holds noise of the same power. Elements at other
//! heights count as if they were at one, which holds for targets at the radar's height.
//!
//! Source: J. Li and P. Stoica (eds.), MIMO Radar Signal Processing (2009), chapter 1.

use crate::bus::RadarSheet;
use rustfft::num_complex::Complex32;
use std::f64::consts::TAU;

/// So many times as many beams are looked at where one is to be found between others.
pub const FINE: usize = 8;
/// More than the apertures of radars ask for.
const MOST_BEAMS: f64 = 512.0;
/// Places are even that are off by so much of their distance, or less: sheets round them.
const UNEVEN: f64 = 0.01;

/// Elements by transmitter, then receiver, and beams.
#[derive(Clone, Debug)]
pub struct VirtualArray {
    /// To the left, in wave lengths.
    places: Vec<f64>,
    /// From a beam to the next one, in u.
    pub step: f64,
    /// How many beams.
    pub beams: usize,
    /// The first beam is a neighbour of the last one.
    pub is_circular: bool,
    /// Weights of [`FINE`] times as many beams, by beam, then element.
    fine: Vec<Complex32>,
}

impl VirtualArray {
    /// Of a sheet.
    pub fn new(sheet: &RadarSheet) -> Self {
        let wave_m = sheet.waveform.wave_m();
        let mut places = Vec::with_capacity(sheet.channels());
        for transmitter in &sheet.transmitters_m {
            let receivers = sheet.receivers_m.iter();
            places.extend(receivers.map(|receiver| (transmitter[0] + receiver[0]) / wave_m));
        }
        Self::at(places)
    }

    fn at(places: Vec<f64>) -> Self {
        let (aperture, is_even) = aperture(&places);
        let step = 1.0 / aperture;
        let fit = (2.0 / step - UNEVEN).ceil().clamp(1.0, MOST_BEAMS) as usize;
        // Evenly spaced elements have no more orthogonal beams than elements; farther out they repeat.
        let beams = if is_even { fit.min(places.len()) } else { fit };
        let is_circular = is_even && beams == places.len() && beams > 1;
        let mut array = Self {
            places,
            step,
            beams,
            is_circular,
            fine: Vec::new(),
        };
        for k in 0..FINE * beams {
            let u = array.fine_u(k);
            let weights = (0..array.elements()).map(|element| array.weight(element, u));
            let weights: Vec<Complex32> = weights.collect();
            array.fine.extend(weights);
        }
        array
    }

    /// How many elements.
    pub fn elements(&self) -> usize {
        self.places.len()
    }

    /// Sine of the azimuth of a beam.
    pub fn u(&self, beam: usize) -> f64 {
        self.step * (beam as f64 - (self.beams / 2) as f64)
    }

    /// Of one of [`FINE`] times as many beams.
    pub fn fine_u(&self, fine: usize) -> f64 {
        self.step * (fine as f64 / FINE as f64 - (self.beams / 2) as f64)
    }

    /// Weights of a beam by element: the sum of their squares is one.
    pub fn weights(&self, beam: usize) -> &[Complex32] {
        self.fine_weights(FINE * beam)
    }

    /// Of one of [`FINE`] times as many beams.
    pub fn fine_weights(&self, fine: usize) -> &[Complex32] {
        let elements = self.elements();
        &self.fine[fine * elements..(fine + 1) * elements]
    }

    /// Weight of an element in a beam towards u.
    pub fn weight(&self, element: usize, u: f64) -> Complex32 {
        let (sin, cos) = (TAU * self.places[element] * u).sin_cos();
        let scale = 1.0 / (self.elements() as f64).sqrt();
        Complex32::new((scale * cos) as f32, (scale * sin) as f32)
    }

    /// Standard deviation of u with a ratio of signal to noise of one in a beam: the Cramer-Rao bound, with the phase of
    /// the echo unknown. Infinite where the elements are in one place.
    pub fn u_error(&self) -> f64 {
        let count = self.places.len() as f64;
        let mean = self.places.iter().sum::<f64>() / count;
        let squares = self.places.iter().map(|y| (y - mean).powi(2));
        1.0 / (TAU * (2.0 * squares.sum::<f64>() / count).sqrt())
    }

    /// Width of a beam in u where its power is halved: 0.886 steps of an even array (Harris 1978).
    pub fn u_width(&self) -> f64 {
        0.886 * self.step
    }
}

/// Of which beams are a half to either side: the distance of the outer elements and once more that of neighbours, wave
/// lengths; and whether elements are evenly spaced.
fn aperture(places: &[f64]) -> (f64, bool) {
    let mut sorted = places.to_vec();
    sorted.sort_by(f64::total_cmp);
    let (Some(first), Some(last)) = (sorted.first(), sorted.last()) else {
        return (0.5, false);
    };
    let count = sorted.len() as f64;
    let length = last - first;
    if !(length.is_finite() && length > 0.0) {
        return (0.5, false);
    }
    let even = length / (count - 1.0);
    let gaps = sorted.windows(2).map(|pair| pair[1] - pair[0]);
    let is_even = gaps
        .into_iter()
        .all(|gap| (gap / even - 1.0).abs() < UNEVEN);
    (length + even, is_even)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stack::radar::testing::sheet;

    /// Two transmitters and four receivers are eight elements half a wave apart, whose beams are orthogonal.
    #[test]
    fn beams_of_an_even_array_are_orthogonal() {
        let array = VirtualArray::new(&sheet());
        assert_eq!((array.elements(), array.beams), (8, 8));
        assert!(array.is_circular && (array.step - 0.25).abs() < 1e-9);
        for a in 0..8 {
            for b in 0..8 {
                let pairs = array.weights(a).iter().zip(array.weights(b));
                let product: Complex32 = pairs.map(|(x, y)| x * y.conj()).sum();
                let expected = if a == b { 1.0 } else { 0.0 };
                assert!((product - expected).norm() < 1e-5, "{a} {b} {product}");
            }
        }
    }

    /// The bound for even elements: u is a frequency, 2 pi u d of it a step, so sqrt(6 / (s (C^2 - 1))) / (2 pi d).
    #[test]
    fn the_error_is_that_of_a_frequency() {
        let expected = (6.0 / 63.0f64).sqrt() / (TAU * 0.5);
        assert!((VirtualArray::new(&sheet()).u_error() / expected - 1.0).abs() < 1e-9);
    }

    /// Provokes: elements in one place, none, far apart, unevenly, and no numbers.
    #[test]
    fn any_places_give_beams() {
        let sets = [
            vec![0.0; 4],
            vec![],
            vec![0.0, 1e9],
            vec![0.0, 0.5, 2.0, 2.5],
            vec![f64::NAN, 0.0],
        ];
        for places in sets {
            let array = VirtualArray::at(places);
            assert!((1..=512).contains(&array.beams));
            assert_eq!(array.weights(array.beams - 1).len(), array.elements());
        }
        assert_eq!(VirtualArray::at(vec![0.0, 0.5, 2.0, 2.5]).beams, 7);
    }
}
