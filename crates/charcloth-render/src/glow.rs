//! Light of what is hot: the visible part of the spectrum of a black body [Incropera2007], as a camera records it.
//!
//! Model: Wien's law at three wavelengths that stand for red, green and blue, so the light is all but nought under 1000 K and
//! grows tenfold from 1150 K to 1350 K; only the hottest char is seen, which is a thin line. The camera is set for char that is
//! burning: 1 is the red light of `SHOWS`, and its white is that of a lamp. Valid when: under 4000 K. Cost: three powers.

use glam::Vec3;

/// Second constant of radiation over the wavelengths 650, 550 and 450 nm [K].
const WIEN: [f32; 3] = [22_135.0, 26_160.0, 31_970.0];
/// Temperature whose red light is 1 [K].
const SHOWS: f32 = 1270.0; // tuned: exposure, for char of 1100 to 1450 K; 1150 to 1350 K
/// Temperature of light that is recorded as white [K].
const WHITE: f32 = 3000.0; // tuned: a lamp indoors; 2700 to 4000 K

/// Light of a black body of a temperature [K], linear, 1 for white.
pub fn black_body(temperature: f32) -> Vec3 {
    let over = 1.0 / temperature.max(1.0);
    let exposure = WIEN[0] * (1.0 / SHOWS - 1.0 / WHITE);
    Vec3::from_array(WIEN.map(|wien| (wien * (1.0 / WHITE - over) + exposure).exp()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn red_is_that_of_the_exposure_and_white_is_white() {
        assert!((black_body(SHOWS).x - 1.0).abs() < 1e-4);
        let white = black_body(WHITE);
        assert!((white / white.x - Vec3::ONE).abs().max_element() < 1e-5);
        // Ratio of Wien's law between two temperatures: exp(22135 K (1/1150 K - 1/1350 K)) = 17.3.
        assert!((black_body(1350.0).x / black_body(1150.0).x / 17.3 - 1.0).abs() < 0.01);
        assert!(black_body(0.0) == Vec3::ZERO && black_body(900.0).x < 1e-3);
    }
}
