//! Randomness that is the same on every machine: a counter-based generator and a smooth random field.

use glam::DVec3;

/// SplitMix64 [Steele2014]: small, fast, and good enough for jitter and phases.
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    /// A stream of its own for each pair of seed and purpose.
    pub fn new(seed: u64, purpose: u64) -> Self {
        let mut random = Self(seed ^ purpose.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        random.bits();
        random
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in 0 to 1.
    pub fn uniform(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Standard normal, by Box and Muller.
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

/// A Gaussian random field of mean 0 and variance 1 with correlation exp(-r^2 / (2 l^2)), as a sum of cosines with
/// random wave vectors and phases (Eq. 2.2, spectral representation [Shinozuka1972]). A function of the point alone:
/// the same field on every mesh.
#[derive(Debug, Clone)]
pub struct RandomField {
    waves: Vec<(DVec3, f64)>,
}

/// tuned: the field is Gaussian to within a few per cent from about a hundred waves on
const WAVES: usize = 192;

impl RandomField {
    /// Builds the field of a seed with a correlation length [m].
    pub fn new(seed: u64, purpose: u64, correlation_length: f64) -> Self {
        let mut random = Random::new(seed, purpose);
        let waves = (0..WAVES)
            .map(|_| {
                let wave = DVec3::new(random.normal(), random.normal(), random.normal()) / correlation_length;
                (wave, std::f64::consts::TAU * random.uniform())
            })
            .collect();
        Self { waves }
    }

    /// Builds a field of variance 1 whose waves are from half to twice a length [m], evenly by its logarithm, in all
    /// directions of the plane z = 0, or of space (Eq. 2.4). Waves shorter than `shortest` [m] are left out, and with them
    /// their part of the variance: a mesh that cannot show them would show others in their place.
    pub fn band(seed: u64, purpose: u64, length: f64, in_plane: bool, shortest: f64) -> Self {
        let mut random = Random::new(seed, purpose);
        let waves = (0..WAVES).map(|_| {
            let wavelength = length * 4.0f64.powf(random.uniform() - 0.5);
            let direction = DVec3::new(random.normal(), random.normal(), random.normal());
            let direction = if in_plane { direction.with_z(0.0) } else { direction };
            let wave = direction.normalize_or(DVec3::X) * (std::f64::consts::TAU / wavelength);
            (wave, std::f64::consts::TAU * random.uniform())
        });
        let resolved = |(wave, _): &(DVec3, f64)| wave.length() * shortest <= std::f64::consts::TAU;
        Self { waves: waves.filter(resolved).collect() }
    }

    /// The field at a point [m].
    pub fn at(&self, point: DVec3) -> f64 {
        let sum: f64 = self.waves.iter().map(|(wave, phase)| (wave.dot(point) + phase).cos()).sum();
        sum * (2.0 / WAVES as f64).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_field_has_the_variance_and_correlation_it_says() {
        // Averages over many seeds and points; the standard error of each is about 1/sqrt(4000 independent samples).
        let (mut variance, mut product, mut count) = (0.0, 0.0, 0.0);
        for seed in 0..40 {
            let field = RandomField::new(seed, 7, 0.01);
            for k in 0..100 {
                let p = DVec3::new(0.05 * k as f64, 0.03 * (k % 10) as f64, 0.0);
                let (a, b) = (field.at(p), field.at(p + DVec3::X * 0.01));
                variance += a * a;
                product += a * b;
                count += 1.0;
            }
        }
        let error = 4.0 * (2.0f64 / count).sqrt();
        assert!((variance / count - 1.0).abs() < error, "{}", variance / count);
        assert!((product / count - (-0.5f64).exp()).abs() < error, "{}", product / count);
    }

    #[test]
    fn a_band_has_its_variance_and_slope_and_loses_what_is_too_short() {
        // Slope along x of isotropic waves in a plane: <(dz/dx)^2> = <k^2>/2, with k = 2 pi/L, ln L even over ln 4, so that
        // <1/L^2> = (4 - 1/4)/(2 ln 4 L0^2). Samples a wavelength apart are as good as independent.
        let (length, step) = (0.02, 1e-6);
        let moments = |shortest: f64| {
            let (mut variance, mut slope, mut count) = (0.0, 0.0, 0.0);
            for seed in 0..40 {
                let field = RandomField::band(seed, 7, length, true, shortest);
                for k in 0..100 {
                    let p = DVec3::new(0.05 * k as f64, 0.03 * (k % 10) as f64, 0.7);
                    let (a, b) = (field.at(p), field.at(p + DVec3::X * step));
                    variance += a * a;
                    slope += ((b - a) / step).powi(2);
                    count += 1.0;
                }
            }
            [variance / count, slope / count]
        };
        let expected = 0.5 * std::f64::consts::TAU.powi(2) * (4.0 - 0.25) / (2.0 * 4.0f64.ln() * length * length);
        let [variance, slope] = moments(0.0);
        assert!((variance - 1.0).abs() < 0.1, "{variance}");
        assert!((slope / expected - 1.0).abs() < 0.1, "{slope}, {expected}");
        // Half of the waves are shorter than the middle of the band, and they are the steep ones.
        let [variance, slope] = moments(length);
        assert!((variance - 0.5).abs() < 0.08, "{variance}");
        assert!(slope / expected < 0.3, "{slope}, {expected}");
    }
}
