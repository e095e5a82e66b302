//! What a pair in contact does: its energy by its distance, and the way that friction works over.
//!
//! Sources: Eq. 16.1 [Chen2025], Eq. 16.3 [Li2020] of docs/physics.md.

/// Part of the radius from which the energy is logarithmic: there second derivatives meet.
pub const LOGARITHMIC: f64 = 0.5;
/// Distance under which energies grow no further [m]: only what touches at the start comes so near.
const LEAST: f64 = 1e-12;

/// Eq. 16.1: energy of a pair at a distance [J], minus its derivative [N], and its second derivative [N/m].
pub fn barrier(distance: f64, radius: f64, stiffness: f64) -> (f64, f64, f64) {
    if distance >= radius {
        return (0.0, 0.0, 0.0);
    }
    let change = LOGARITHMIC * radius;
    if distance >= change {
        let gap = radius - distance;
        return (0.5 * stiffness * gap * gap, stiffness * gap, stiffness);
    }
    let (distance, strength) = (distance.max(LEAST), stiffness * change * change);
    let energy = strength * (0.5 + (change / distance).ln());
    (energy, strength / distance, strength / (distance * distance))
}

/// Eq. 16.3: the way that friction of unit force works over [m], its derivative, and the second [1/m]; `slip` is the way
/// under which it grows [m].
pub fn friction(way: f64, slip: f64) -> (f64, f64, f64) {
    if way >= slip {
        return (way, 1.0, 0.0);
    }
    let part = way / slip;
    (slip * (part * part - part * part * part / 3.0 + 1.0 / 3.0), part * (2.0 - part), 2.0 * (1.0 - part) / slip)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_are_slopes_of_energies_and_stiffness_is_theirs() {
        let slope = |f: &dyn Fn(f64) -> f64, x: f64| (f(x + 1e-6) - f(x - 1e-6)) / 2e-6;
        for x in [0.02, 0.3, 0.499, 0.501, 0.7, 0.99] {
            let (_, force, curvature) = barrier(x, 1.0, 3.0);
            assert!((slope(&|x| barrier(x, 1.0, 3.0).0, x) + force).abs() < 1e-5 * force.max(1.0), "{x}");
            assert!((slope(&|x| barrier(x, 1.0, 3.0).1, x) + curvature).abs() < 1e-4 * curvature, "{x}");
            let (_, pull, curvature) = friction(x, 0.8);
            assert!((slope(&|x| friction(x, 0.8).0, x) - pull).abs() < 1e-8, "{x}");
            assert!((slope(&|x| friction(x, 0.8).1, x) - curvature).abs() < 1e-5, "{x}");
        }
        // Second derivatives meet where the energy turns logarithmic; friction is whole where sliding begins.
        assert!((barrier(0.5, 1.0, 3.0).2 - barrier(0.5 - 1e-12, 1.0, 3.0).2).abs() < 1e-9);
        assert_eq!(friction(0.8, 0.8), (0.8, 1.0, 0.0));
        assert_eq!(barrier(1.0, 1.0, 3.0), (0.0, 0.0, 0.0));
    }
}
