//! Stretching and shear of a triangle.
//!
//! Model: the membrane of St Venant and Kirchhoff, constant strain, plane stress, orthotropic (Eq. 12.1 to 12.3). Source:
//! [Bonet2008]. Valid when: strains are small, as those of paper are; rotations may be large. Cost: about 300 flops a
//! triangle, forces and stiffness.

use crate::scene::Shell;
use glam::{DMat3, DVec2, DVec3};

/// In-plane stiffness per width, in material axes [N/m].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct MembraneStiffness {
    /// Tension along per strain along, no strain across.
    pub q11: f64,
    /// Tension across per strain across, no strain along.
    pub q22: f64,
    /// Tension along per strain across.
    pub q12: f64,
    /// Shear tension per shear angle.
    pub q66: f64,
}

impl MembraneStiffness {
    /// Of a material, Eq. 12.2. The two Poisson ratios are in the ratio of the moduli; the scene gives their geometric
    /// mean.
    pub fn of(material: &Shell) -> Self {
        let (along, across, poisson) = (material.modulus_along.0, material.modulus_across.0, material.poisson.0);
        let mean = (along * across).sqrt();
        let per_width = material.thickness.0 / (1.0 - poisson * poisson);
        let shear = material.shear_modulus.map_or(0.5 * mean / (1.0 + poisson), |modulus| modulus.0);
        Self {
            q11: along * per_width,
            q22: across * per_width,
            q12: poisson * mean * per_width,
            q66: shear * material.thickness.0,
        }
    }

    /// So many times as stiff.
    pub fn scaled(&self, factor: f64) -> Self {
        Self { q11: self.q11 * factor, q22: self.q22 * factor, q12: self.q12 * factor, q66: self.q66 * factor }
    }
}

/// Rest shape of a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RestTriangle {
    /// Sides from the first corner to the second and third, in material axes [m].
    pub side: [DVec2; 2],
    /// Gradients of the linear shape functions of the second and third corner [1/m].
    pub gradient: [DVec2; 2],
    /// [m2]
    pub area: f64,
}

impl RestTriangle {
    /// From its sides.
    pub fn new(u: DVec2, v: DVec2) -> Self {
        let determinant = u.perp_dot(v);
        Self {
            side: [u, v],
            gradient: [DVec2::new(v.y, -v.x) / determinant, DVec2::new(-u.y, u.x) / determinant],
            area: 0.5 * determinant.abs(),
        }
    }

    /// Gradients of the linear shape functions of all three corners [1/m].
    #[inline(always)]
    pub fn gradients(&self) -> [DVec2; 3] {
        let [g1, g2] = self.gradient;
        [-(g1 + g2), g1, g2]
    }
}

/// What a triangle gives.
#[derive(Debug, Clone, Copy, Default)]
pub struct Response {
    /// Forces on the second and third corner [N]; the first has what is left of zero.
    pub force: [DVec3; 2],
    /// Second derivatives of the energy between the corners 0-1, 0-2 and 1-2 [N/m].
    pub stiffness: [DMat3; 3],
    /// [J]
    pub energy: f64,
    /// Tensions in material axes: along, across, shear [N/m].
    pub tension: [f64; 3],
}

/// Forces and stiffness. Compression gives no geometric stiffness, so that the whole is positive semidefinite.
#[inline(always)]
pub fn respond(rest: &RestTriangle, q: &MembraneStiffness, x: [DVec3; 3]) -> Response {
    let [g0, g1, g2] = rest.gradients();
    let (u, v) = (x[1] - x[0], x[2] - x[0]);
    let f1 = u * g1.x + v * g2.x;
    let f2 = u * g1.y + v * g2.y;
    // Eq. 12.1: Green's strain, and with Eq. 12.3 the tensions.
    let (e11, e22, e12) = (0.5 * (f1.dot(f1) - 1.0), 0.5 * (f2.dot(f2) - 1.0), f1.dot(f2));
    let (s11, s22, s12) = (q.q11 * e11 + q.q12 * e22, q.q12 * e11 + q.q22 * e22, q.q66 * e12);
    let along = |g: DVec2| -rest.area * (f1 * (s11 * g.x + s12 * g.y) + f2 * (s12 * g.x + s22 * g.y));
    let force = [along(g1), along(g2)];
    let (mean, half) = (0.5 * (s11 + s22), 0.5 * (s11 - s22));
    let radius = half.hypot(s12);
    // The part of the tensions that pulls.
    let (t11, t22, t12) = if mean - radius >= 0.0 {
        (s11, s22, s12)
    } else if mean + radius <= 0.0 {
        (0.0, 0.0, 0.0)
    } else {
        let scale = (mean + radius) / (2.0 * radius);
        (scale * (radius + half), scale * (radius - half), scale * s12)
    };
    let (m11, m22, m12) = (outer(f1, f1), outer(f2, f2), outer(f1, f2));
    let m21 = m12.transpose();
    let block = |a: DVec2, b: DVec2| {
        let geometric = a.x * (t11 * b.x + t12 * b.y) + a.y * (t12 * b.x + t22 * b.y);
        let c11 = a.x * q.q11 * b.x + a.y * q.q66 * b.y;
        let c22 = a.y * q.q22 * b.y + a.x * q.q66 * b.x;
        let c12 = a.x * q.q12 * b.y + a.y * q.q66 * b.x;
        let c21 = a.y * q.q12 * b.x + a.x * q.q66 * b.y;
        (m11 * c11 + m22 * c22 + m12 * c12 + m21 * c21 + DMat3::from_diagonal(DVec3::splat(geometric))) * rest.area
    };
    Response {
        force,
        stiffness: [block(g0, g1), block(g0, g2), block(g1, g2)],
        energy: 0.5 * rest.area * (s11 * e11 + s22 * e22 + s12 * e12),
        tension: [s11, s22, s12],
    }
}

#[inline(always)]
fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}
