//! Eigenvalues: the least of a block, the largest of a level, estimated from above.

use super::lanes::Block;
use glam::{DMat3, DVec3, Vec4};

/// Steps of Lanczos that estimate the largest eigenvalue of a level. // tuned: 5 to 12
pub const LANCZOS: usize = 7;
/// Least ground of a row, as a part of its stiffness, that single precision tells from nothing. What has less is taken to have
/// as much by the smoother; the coarsening goes by what it has. // tuned: some roundings of 6e-8, 2e-7 to 1e-6
const TOLD: f64 = 4e-7;

/// What a ground lacks to be told from nothing beside the stiffness of its row.
pub fn what_is_untold(ground: &DMat3, stiffness: &DMat3) -> DMat3 {
    let told = TOLD * mean(stiffness);
    DMat3::from_diagonal(DVec3::splat((told - least_eigenvalue(ground, told)).clamp(0.0, told.max(0.0))))
}

/// The least eigenvalue of the symmetric part of a block, by the cosine of a third of an angle; any number over
/// `enough` where it is over that beyond doubt.
fn least_eigenvalue(block: &DMat3, enough: f64) -> f64 {
    let middle = mean(block);
    let deviator = (*block + block.transpose()) * 0.5 - DMat3::from_diagonal(DVec3::splat(middle));
    let squares: f64 = deviator.to_cols_array().iter().map(|v| v * v).sum();
    let size = (squares / 6.0).sqrt();
    if size <= 0.0 || middle - 2.0 * size > enough {
        return middle - 2.0 * size;
    }
    let angle = (0.5 * (deviator * (1.0 / size)).determinant()).clamp(-1.0, 1.0).acos() / 3.0;
    middle + 2.0 * size * (angle + std::f64::consts::TAU / 3.0).cos()
}

fn mean(block: &DMat3) -> f64 {
    (block.x_axis.x + block.y_axis.y + block.z_axis.z) / 3.0
}

/// The inverse of a block of the diagonal; nothing for nothing, as where a body of one node turns.
pub fn inverted(block: DMat3) -> Block {
    let size = mean(&block);
    if size <= 0.0 {
        return super::lanes::NO_BLOCK;
    }
    super::lanes::single(&((block * (1.0 / size)).inverse() * (1.0 / size)))
}

/// The largest eigenvalue of a symmetric matrix of three diagonals, and by how much that of the whole may be over it: what is
/// next beside the diagonal (the last number), by the part of the eigenvector that it meets.
pub fn estimate_above(diagonal: &[f64], beside: &[f64]) -> f64 {
    let steps = diagonal.len();
    // Eigenvalues over a number are as many as pivots under nought.
    let over = |x: f64| {
        let mut pivot = 1.0;
        (0..steps).any(|k| {
            let coupling = if k == 0 { 0.0 } else { beside[k - 1] * beside[k - 1] };
            pivot = x - diagonal[k] - coupling / pivot;
            pivot <= 0.0
        })
    };
    let reach = |k: usize| if k == 0 { 0.0 } else { beside[k - 1] };
    let most = |k: usize| diagonal[k] + reach(k) + if k + 1 < steps { beside[k] } else { 0.0 };
    let (mut low, mut high) = (0.0, (0..steps).map(most).fold(0.0, f64::max));
    for _ in 0..30 {
        let middle = 0.5 * (low + high);
        if over(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    let (mut before, mut last, mut squares) = (0.0, 1.0, 1.0);
    for k in 0..steps - 1 {
        let next = ((high - diagonal[k]) * last - reach(k) * before) / beside[k];
        (before, last) = (last, next);
        squares += next * next;
    }
    high + beside[steps - 1] * last.abs() / squares.sqrt()
}

/// A rough force on a row, which its block of the diagonal bears with an energy that is the same for all rows.
pub fn rough_force(stiffness: &DMat3, row: usize) -> Vec4 {
    let rough = |k: usize| f64::from((3 * row + k).wrapping_mul(2_654_435_761) as u32 >> 24) / 128.0 - 1.0;
    let m = stiffness;
    let root = |square: f64| square.max(0.0).sqrt();
    // By the Cholesky factor of the block.
    let first = root(m.x_axis.x);
    let (second, third) = if first > 0.0 { (m.x_axis.y / first, m.x_axis.z / first) } else { (0.0, 0.0) };
    let fourth = root(m.y_axis.y - second * second);
    let fifth = if fourth > 0.0 { (m.y_axis.z - third * second) / fourth } else { 0.0 };
    let last = root(m.z_axis.z - third * third - fifth * fifth);
    let [a, b, c] = [rough(0), rough(1), rough(2)];
    DVec3::new(first * a, second * a + fourth * b, third * a + fifth * b + last * c).as_vec3().extend(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_eigenvalue_of_a_block_is_that_of_its_axes() {
        for axes in [[3.0, 1.0, 1e-6], [2.0, 2.0, 2.0], [1.0, -0.5, 1.0], [5.0, 5.0, 0.0]] {
            let turn = DMat3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 1.1);
            let block = turn * DMat3::from_diagonal(DVec3::from_array(axes)) * turn.transpose();
            let least = axes.into_iter().fold(f64::INFINITY, f64::min);
            let found = least_eigenvalue(&block, f64::INFINITY);
            assert!((found - least).abs() < 1e-13, "{axes:?}: {found}");
            let enough = least_eigenvalue(&block, least - 1.0);
            assert!(
                enough <= least + 1e-13 && enough > least - 1.0 || (enough - least).abs() < 1e-13,
                "{axes:?}: {enough}"
            );
        }
    }

    #[test]
    fn the_largest_eigenvalue_of_three_diagonals_is_estimated_from_above() {
        // Second differences: 2 - 2 cos(k pi/(n + 1)).
        for n in [1usize, 2, 5, 9] {
            let largest_of = |n: usize| 2.0 + 2.0 * (std::f64::consts::PI / (n as f64 + 1.0)).cos();
            let mut beside = vec![1.0; n];
            beside[n - 1] = 0.0;
            assert!((estimate_above(&vec![2.0; n], &beside) - largest_of(n)).abs() < 1e-8, "{n}");
            beside[n - 1] = 1.0;
            let above = estimate_above(&vec![2.0; n], &beside);
            assert!(above > largest_of(n + 1) - 1e-8 && above < 5.0, "{n}: {above}");
        }
    }
}
