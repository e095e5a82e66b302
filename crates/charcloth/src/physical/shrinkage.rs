//! What burning and drying do to the shape of the sheet.
//!
//! Model: each half-layer has a free strain by its conversion to char and by the water that it has lost (Eq. 15.5), for
//! good, since neither comes back; the mean of both faces shortens the sheet, their difference bends it as two layers do
//! (Eq. 15.6) [Timoshenko1925]. No knob curls the sheet: it curls where one face is ahead of the other. Valid when: the
//! char of both faces is alike in stiffness. Cost: one pass over the burn nodes and their triangles.

use super::Physical;
use crate::effects::SpringFactors;
use crate::material::Material;
use crate::sheet::{FaceNodes, SheetState};
use glam::DVec2;

/// Most that the rest curvature may bend the sheet over the side of a triangle [rad]: a mesh cannot show tighter curls.
const TIGHTEST: f64 = 0.8; // tuned: 46 degrees a triangle; 0.3 to 1.2

/// What a material does when it chars and dries.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Shrinkage {
    /// Linear shrinkage of char.
    char: f64,
    /// Shrinkage of sheet that has dried from 50 % relative humidity, along the machine direction and across.
    drying: DVec2,
    thickness: f64,
}

impl Shrinkage {
    pub fn of(material: &Material, thickness: f64) -> Self {
        let mechanics = &material.mechanics;
        // Expansion is given from 20 to 75 % humidity, over about as much water as there is at 50 %.
        let drying = DVec2::new(mechanics.wetting_machine.value.0, mechanics.wetting_cross.value.0);
        Self { char: mechanics.char_shrinkage.value.0, drying, thickness }
    }
}

impl Physical {
    /// Free strain of a face at a node, along the machine direction and across (Eq. 15.5), and the part of its fibre that is
    /// left.
    fn free_strain(&self, face: &FaceNodes, i: usize) -> (DVec2, f64) {
        let left = ((face.fibre[i] + face.polymer[i]) / (self.burns * face.dry_mass[i])).clamp(0.0, 1.0);
        let dried = (1.0 - face.water[i] / (self.water * face.dry_mass[i]).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        let Shrinkage { char, drying, .. } = self.shrinkage;
        // What has charred has dried before; the shrinkage of char counts from the dry sheet.
        (-(drying * dried + DVec2::splat(char * (1.0 - left))), left)
    }

    /// Fills in the free strain and curvature of every motion triangle, and the fibre that it has left, the mean over the burn
    /// nodes that it carries.
    pub fn shrink(&self, state: &SheetState, factors: &mut SpringFactors) {
        let SheetState { front, back, burn_triangles: fine, triangles, .. } = state;
        let of_node = |i: u32| {
            let i = i as usize;
            let ((front, left_front), (back, left_back)) = (self.free_strain(front, i), self.free_strain(back, i));
            // The face that shrinks more ends up inside: curvature towards the front where that is the front.
            (0.5 * (front + back), (back - front) * (1.5 / self.shrinkage.thickness), 0.5 * (left_front + left_back))
        };
        let of_corners = |corners: [u32; 3]| {
            let [a, b, c] = corners.map(of_node);
            ((a.0 + b.0 + c.0) / 3.0, (a.1 + b.1 + c.1) / 3.0, (a.2 + b.2 + c.2) / 3.0)
        };
        factors.free_strain.clear();
        factors.free_curvature.clear();
        factors.fibre.clear();
        let mut t = 0;
        for parent in 0..triangles.len() {
            let (mut strain, mut curvature, mut left, mut number) = (DVec2::ZERO, DVec2::ZERO, 0.0, 0.0);
            if fine.is_empty() {
                (strain, curvature, left) =
                    of_corners(triangles.corners[parent].map(|i| state.burn_node(i as usize) as u32));
                number = 1.0;
            }
            while t < fine.len() && fine.parent[t] as usize == parent {
                let (of_strain, of_curvature, of_left) = of_corners(fine.corners[t]);
                strain += of_strain;
                curvature += of_curvature;
                left += of_left;
                number += 1.0;
                t += 1;
            }
            // Eq. 15.6, no tighter than the mesh can show.
            let curvature = curvature / (number * state.rest.thickness[parent]);
            let most = TIGHTEST / (2.0 * triangles.rest_area[parent]).sqrt();
            factors.fibre.push(left / number);
            factors.free_strain.push(strain / number);
            factors.free_curvature.push(curvature.clamp(DVec2::splat(-most), DVec2::splat(most)));
        }
    }
}
