//! A disc that shrinks within a sheet: the stresses of the plane before it buckles, and wrinkles after.

mod common;

use charcloth::scene::Shape;
use charcloth::sheet::SheetState;
use charcloth::units::*;
use common::{Settler, build, sheet};
use glam::DVec2;

const MODULUS: f64 = 3e9;
const THICKNESS: f64 = 1e-4;
/// Radius of the sheet [m].
const OUTER: f64 = 0.06;

/// A round sheet whose middle shrinks.
struct Sheet {
    state: SheetState,
    settler: Settler,
    /// Triangles that shrink, and the radius of a disc as large as they are [m].
    inside: Vec<bool>,
    radius: f64,
}

impl Sheet {
    fn new(cockle: f64) -> Self {
        let mut scene = sheet(Shape::Disc, 0.12, 0.12, 0.002);
        scene.sheet.radius = Length(OUTER);
        scene.sheet.cockle = Some(Length(cockle));
        scene.gravity = Acceleration(0.0);
        scene.mechanics.integrator = "implicit".to_owned();
        scene.shell.thickness = Length(THICKNESS);
        scene.shell.modulus_along = Modulus(MODULUS);
        scene.shell.modulus_across = Modulus(MODULUS);
        scene.shell.poisson = Ratio(0.3);
        let state: SheetState = build(&scene).state().clone();
        let count = state.triangles.len();
        let inside: Vec<bool> = (0..count).map(|t| middle(&state, t).length() < 0.012).collect();
        let area: f64 = (0..count).filter(|t| inside[*t]).map(|t| state.triangles.rest_area[t]).sum();
        Self {
            settler: Settler::new(&scene, &state, 1e-4),
            inside,
            radius: (area / std::f64::consts::PI).sqrt(),
            state,
        }
    }

    /// Settles with a middle that has shrunk by so much.
    fn settle(&mut self, shrinkage: f64, steps: u32) {
        for (free, inside) in self.settler.factors.free_strain.iter_mut().zip(&self.inside) {
            *free = if *inside { DVec2::splat(-shrinkage) } else { DVec2::ZERO };
        }
        (0..steps).for_each(|_| self.settler.advance(&mut self.state));
    }

    /// Mean stress along the radius and around the middle, over the triangles of a ring [Pa].
    fn stress(&self, ring: std::ops::Range<f64>) -> [f64; 2] {
        let shell = self.settler.integrator.shell().unwrap();
        let (mut sum, mut area) = ([0.0; 2], 0.0);
        for (k, t) in shell.triangles().iter().enumerate() {
            let t = *t as usize;
            let at = middle(&self.state, t);
            if !ring.contains(&at.length()) {
                continue;
            }
            // Material axes: the machine direction is up, and the second a quarter turn on from it.
            let radial = DVec2::new(at.y, -at.x).normalize();
            let [along, across, shear] = shell.tension(k).map(|tension| tension / THICKNESS);
            let normal = |n: DVec2| along * n.x * n.x + across * n.y * n.y + 2.0 * shear * n.x * n.y;
            let own = self.state.triangles.rest_area[t];
            sum[0] += own * normal(radial);
            sum[1] += own * normal(radial.perp());
            area += own;
        }
        sum.map(|sum| sum / area)
    }

    fn out_of_plane(&self) -> f64 {
        self.state.motion.position.iter().map(|p| p.z.abs()).fold(0.0, f64::max)
    }
}

fn middle(state: &SheetState, t: usize) -> DVec2 {
    state.triangles.corners[t].iter().map(|i| state.motion.rest_position[*i as usize].truncate()).sum::<DVec2>() / 3.0
}

/// Stress along the radius and around, of a disc that is larger by `shrinkage` than the hole it is drawn into, in a round
/// sheet with a free edge: Lame's thick ring, which for a large sheet is E s/2 inside, +- E s a^2/(2 r^2) outside.
fn expected(shrinkage: f64, a: f64, r: f64) -> [f64; 2] {
    let tension = 0.5 * MODULUS * shrinkage * (1.0 - (a / OUTER).powi(2));
    if r < a {
        return [tension; 2];
    }
    let of_ring = tension * a * a / (OUTER * OUTER - a * a);
    [of_ring * ((OUTER / r).powi(2) - 1.0), -of_ring * ((OUTER / r).powi(2) + 1.0)]
}

#[test]
fn a_disc_that_shrinks_pulls_on_its_sheet_as_in_the_plane_and_then_throws_wrinkles() {
    let shrinkage = 1e-4;
    let mut flat = Sheet::new(0.0);
    flat.settle(shrinkage, 30);
    assert_eq!(flat.out_of_plane(), 0.0, "nothing pushes a flat sheet out of its plane");
    let whole = 0.5 * MODULUS * shrinkage;
    for ring in [0.0..0.009, 0.016..0.019, 0.022..0.026, 0.034..0.038] {
        // By area: 1/r^2 over a ring is its mean at the geometric middle, near enough for narrow ones.
        let r = f64::sqrt(ring.start * ring.end);
        let (found, expected) = (flat.stress(ring.clone()), expected(shrinkage, flat.radius, r));
        println!(
            "{ring:?}: {:.4} and {:.4} of E s/2, expected {:.4} and {:.4}",
            found[0] / whole,
            found[1] / whole,
            expected[0] / whole,
            expected[1] / whole
        );
        for (found, expected) in found.into_iter().zip(expected) {
            assert!((found - expected).abs() < 0.03 * expected.abs().max(0.1 * whole), "{found} instead of {expected}");
        }
    }
    // 1 % is far past what the ring around bears in its plane: it goes out of it, and bears no more around the middle.
    let shrinkage = 0.01;
    let mut wrinkled = Sheet::new(2e-5);
    (1..=10).for_each(|k| wrinkled.settle(shrinkage * f64::from(k) / 10.0, 2));
    wrinkled.settle(shrinkage, 10);
    let [_, around] = wrinkled.stress(0.016..0.019);
    let [_, in_plane] = expected(shrinkage, wrinkled.radius, 0.0174);
    println!("{:.2} mm out of plane, {:.3} of the pressure around", 1e3 * wrinkled.out_of_plane(), around / in_plane);
    assert!(wrinkled.out_of_plane() > 5.0 * THICKNESS, "{} m", wrinkled.out_of_plane());
    assert!(around / in_plane < 0.3, "wrinkles have not relieved it: {around} of {in_plane} Pa");
}
