//! Small matrices by rows, in lanes of four numbers, of which the last is nought: a row meets a vector lane by lane, without
//! shuffles, and only sums of many rows are added up across.

use glam::{DMat3, DVec3, Mat4, Vec3A, Vec4};

/// A block of 3 x 3.
pub type Block = [Vec4; 3];
/// Three rows that meet how a body moves and how it turns: four lanes for either, of which the last is nought.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C, align(32))]
pub struct Strip(pub [[f32; 8]; 3]);

/// Nothing.
pub const NO_BLOCK: Block = [Vec4::ZERO; 3];

impl Strip {
    /// Nothing.
    pub const ZERO: Self = Self([[0.0; 8]; 3]);

    /// Of two blocks.
    pub fn of(moves: &Block, turns: &Block) -> Self {
        let mut strip = Self::ZERO;
        for (r, row) in strip.0.iter_mut().enumerate() {
            row[..4].copy_from_slice(&moves[r].to_array());
            row[4..].copy_from_slice(&turns[r].to_array());
        }
        strip
    }

    /// The part of a row that meets moves, and the one that meets turns.
    #[inline(always)]
    pub fn row(&self, r: usize) -> [Vec4; 2] {
        let (moves, turns) = self.0[r].split_at(4);
        [Vec4::from_slice(moves), Vec4::from_slice(turns)]
    }

    /// Adds to a row.
    #[inline(always)]
    pub fn add(&mut self, r: usize, [moves, turns]: [Vec4; 2]) {
        let [own_moves, own_turns] = self.row(r);
        self.set(r, [own_moves + moves, own_turns + turns]);
    }

    /// Sets a row.
    #[inline(always)]
    pub fn set(&mut self, r: usize, [moves, turns]: [Vec4; 2]) {
        let (own_moves, own_turns) = self.0[r].split_at_mut(4);
        moves.write_to_slice(own_moves);
        turns.write_to_slice(own_turns);
    }

    /// What its rows make of how a body moves and turns.
    #[inline(always)]
    pub fn meet(&self, moves: Vec4, turns: Vec4) -> [Vec4; 3] {
        let row = |r: usize| {
            let [along, about] = self.row(r);
            along * moves + about * turns
        };
        [row(0), row(1), row(2)]
    }
}

/// Three rows that meet how a body moves and how it turns, in double precision; lanes 3 and 7 are nought.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C, align(64))]
pub struct Wide(pub [[f64; 8]; 3]);

impl Wide {
    /// Nothing.
    pub const ZERO: Self = Self([[0.0; 8]; 3]);

    /// The part that meets moves, or the one that meets turns.
    pub fn part(&self, turns: usize) -> DMat3 {
        let [x, y, z] = self.0.map(|row| DVec3::new(row[4 * turns], row[4 * turns + 1], row[4 * turns + 2]));
        DMat3::from_cols(x, y, z).transpose()
    }

    /// Sets the part that meets moves, or the one that meets turns.
    pub fn set_part(&mut self, turns: usize, block: DMat3) {
        for (row, values) in self.0.iter_mut().zip(block.transpose().to_cols_array_2d()) {
            row[4 * turns..4 * turns + 3].copy_from_slice(&values);
        }
    }

    /// In single precision.
    #[inline(always)]
    pub fn single(&self) -> Strip {
        let mut strip = Strip::ZERO;
        for (row, wide) in strip.0.iter_mut().zip(&self.0) {
            for lane in 0..8 {
                row[lane] = wide[lane] as f32;
            }
        }
        strip
    }
}

/// A block in single precision, by rows.
#[inline(always)]
pub fn single(block: &DMat3) -> Block {
    let rows = block.transpose();
    [rows.x_axis, rows.y_axis, rows.z_axis].map(|row| row.as_vec3().extend(0.0))
}

/// What the lanes of each of three rows add up to.
#[inline(always)]
pub fn totals(rows: &[Vec4; 3]) -> Vec4 {
    let lanes = Mat4::from_cols(rows[0], rows[1], rows[2], Vec4::ZERO).transpose();
    (lanes.x_axis + lanes.y_axis) + lanes.z_axis
}

/// A block times a vector.
#[inline(always)]
pub fn times(block: &Block, x: Vec4) -> Vec4 {
    totals(&[block[0] * x, block[1] * x, block[2] * x])
}

/// The product of vectors, with a last lane of nought.
#[inline(always)]
pub fn cross(a: Vec4, b: Vec4) -> Vec4 {
    Vec3A::from_vec4(a).cross(Vec3A::from_vec4(b)).extend(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_by_rows_are_the_blocks_they_were() {
        let block = DMat3::from_cols_array_2d(&[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, -9.0]]);
        let x = DVec3::new(0.5, -1.0, 2.0);
        assert_eq!(times(&single(&block), x.as_vec3().extend(0.0)), (block * x).as_vec3().extend(0.0));
        let mut wide = Wide::ZERO;
        wide.set_part(1, block);
        wide.set_part(0, block * 2.0);
        assert_eq!([wide.part(0), wide.part(1)], [block * 2.0, block]);
        let strip = wide.single();
        let [moves, turns] = [0, 1].map(|half| [0, 1, 2].map(|r| strip.row(r)[half]));
        assert_eq!(strip, Strip::of(&moves, &turns));
        assert_eq!([moves, turns], [single(&(block * 2.0)), single(&block)]);
    }
}
