//! Sparse matrices of 3 x 3 blocks: rows are nodes, in the order of the mesh.

use rayon::prelude::*;

/// Rows that one thread takes at a time. Fixed, so that the work is cut up alike on any number of threads.
pub const ROWS_A_TASK: usize = 1024;

/// Compiles a loop also for AVX2 and AVX-512, and runs the widest that the processor has. The operations are the same, one by
/// one, so bits are too; only encodings and registers differ.
macro_rules! on_widest_unit {
    (($($argument:ident: $type:ty),* $(,)?) $(-> $result:ty)? $body:block) => {{
        #[inline(always)]
        fn plain($($argument: $type),*) $(-> $result)? $body
        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = "avx2")]
        fn avx2($($argument: $type),*) $(-> $result)? {
            plain($($argument),*)
        }
        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = "avx2,avx512f,avx512vl,avx512dq")]
        fn avx512($($argument: $type),*) $(-> $result)? {
            plain($($argument),*)
        }
        match $crate::kernels::VectorUnit::best() {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `VectorUnit::best` only names what the processor was found to have.
            $crate::kernels::VectorUnit::Avx2 => unsafe { avx2($($argument),*) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: the same.
            $crate::kernels::VectorUnit::Avx512 => unsafe { avx512($($argument),*) },
            _ => plain($($argument),*),
        }
    }};
}
pub(crate) use on_widest_unit;

/// Which blocks of a matrix are there: for each row, the columns in rising order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Pattern {
    /// First block of each row, and the end.
    pub first: Vec<u32>,
    /// Column of each block.
    pub column: Vec<u32>,
}

impl Pattern {
    /// From lists of columns, which are sorted and freed of repeats.
    pub fn from_rows(rows: impl Iterator<Item = Vec<u32>>) -> Self {
        let mut pattern = Self { first: vec![0], column: Vec::new() };
        for mut columns in rows {
            columns.sort_unstable();
            columns.dedup();
            pattern.column.extend_from_slice(&columns);
            pattern.first.push(pattern.column.len() as u32);
        }
        pattern
    }

    /// Adds a row of columns in rising order.
    pub fn push_row(&mut self, columns: &[u32]) {
        self.column.extend_from_slice(columns);
        self.first.push(self.column.len() as u32);
    }

    /// So many rows with nothing in them.
    pub fn empty(rows: usize) -> Self {
        Self { first: vec![0; rows + 1], column: Vec::new() }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.first.len().saturating_sub(1)
    }

    /// Number of blocks.
    pub fn blocks(&self) -> usize {
        self.column.len()
    }

    /// Blocks of a row.
    #[inline(always)]
    pub fn row(&self, i: usize) -> std::ops::Range<usize> {
        self.first[i] as usize..self.first[i + 1] as usize
    }

    /// Columns of a row.
    #[inline(always)]
    pub fn columns(&self, i: usize) -> &[u32] {
        &self.column[self.row(i)]
    }

    /// The block at a row and column, if there.
    pub fn find(&self, i: usize, j: u32) -> Option<usize> {
        self.columns(i).binary_search(&j).ok().map(|k| self.first[i] as usize + k)
    }

    /// The pattern of the transpose.
    pub fn transposed(&self, columns: usize) -> Self {
        let mut first = vec![0u32; columns + 1];
        self.column.iter().for_each(|j| first[*j as usize + 1] += 1);
        for j in 0..columns {
            first[j + 1] += first[j];
        }
        let mut next = first.clone();
        let mut column = vec![0; self.blocks()];
        for i in 0..self.rows() {
            for j in self.columns(i) {
                let place = &mut next[*j as usize];
                column[*place as usize] = i as u32;
                *place += 1;
            }
        }
        Self { first, column }
    }
}

/// Collects the columns of one row after another, each once and in rising order, and knows where each stands.
pub struct Columns {
    row: Vec<u32>,
    /// For each column, the row that had it last, and its place there.
    seen: Vec<[u32; 2]>,
}

impl Columns {
    /// For matrices of so many columns.
    pub fn new(columns: usize) -> Self {
        Self { row: Vec::new(), seen: vec![[u32::MAX; 2]; columns] }
    }

    /// The columns of a row, which no call before was for.
    pub fn collect(&mut self, row: usize, columns: impl Iterator<Item = u32>) -> &[u32] {
        self.row.clear();
        for column in columns {
            let seen = &mut self.seen[column as usize];
            if seen[0] != row as u32 {
                seen[0] = row as u32;
                self.row.push(column);
            }
        }
        self.row.sort_unstable();
        for (place, column) in self.row.iter().enumerate() {
            self.seen[*column as usize][1] = place as u32;
        }
        &self.row
    }

    /// Where a column stands in the row last collected, which was this one; none if it is not there.
    #[inline(always)]
    pub fn place(&self, row: usize, column: u32) -> Option<u32> {
        let [last, place] = self.seen[column as usize];
        (last == row as u32).then_some(place)
    }
}

/// Runs `work(first row, its part of the output)` over rows, in tasks of fixed size.
pub fn by_rows<T: Send>(output: &mut [T], parallel: bool, work: impl Fn(usize, &mut [T]) + Sync) {
    if parallel && output.len() > ROWS_A_TASK {
        output.par_chunks_mut(ROWS_A_TASK).enumerate().for_each(|(task, part)| work(task * ROWS_A_TASK, part));
    } else {
        work(0, output);
    }
}

/// Runs `work(row, its blocks)` over the rows of a matrix, in tasks that hold about equally many blocks.
pub fn by_block_rows<T: Send>(
    pattern: &Pattern,
    blocks: &mut [T],
    parallel: bool,
    work: impl Fn(usize, &mut [T]) + Sync,
) {
    fn part<T: Send>(
        pattern: &Pattern,
        rows: std::ops::Range<usize>,
        blocks: &mut [T],
        parallel: bool,
        work: &(impl Fn(usize, &mut [T]) + Sync),
    ) {
        if !parallel || rows.len() <= 256 {
            let base = pattern.first[rows.start] as usize;
            for i in rows {
                let row = pattern.row(i);
                work(i, &mut blocks[row.start - base..row.end - base]);
            }
            return;
        }
        let middle = rows.start + rows.len() / 2;
        let (low, high) = blocks.split_at_mut((pattern.first[middle] - pattern.first[rows.start]) as usize);
        rayon::join(
            || part(pattern, rows.start..middle, low, true, work),
            || part(pattern, middle..rows.end, high, true, work),
        );
    }
    part(pattern, 0..pattern.rows(), blocks, parallel, &work);
}

/// Runs `work(row, one output, the other)` over rows.
pub fn by_row_pairs<T: Send, U: Send>(
    a: &mut [T],
    b: &mut [U],
    parallel: bool,
    work: impl Fn(usize, &mut T, &mut U) + Sync,
) {
    let rows = ROWS_A_TASK;
    let part = |first: usize, a: &mut [T], b: &mut [U]| {
        for (k, (a, b)) in a.iter_mut().zip(b).enumerate() {
            work(first + k, a, b);
        }
    };
    if parallel && a.len() > rows {
        a.par_chunks_mut(rows)
            .zip(b.par_chunks_mut(rows))
            .enumerate()
            .for_each(|(task, (a, b))| part(task * rows, a, b));
    } else {
        part(0, a, b);
    }
}

/// Sum over rows, added up in tasks of fixed size and then over the tasks: the same bits on any number of threads.
pub fn sum_by_rows(
    rows: usize,
    parallel: bool,
    sums: &mut Vec<f64>,
    work: impl Fn(std::ops::Range<usize>) -> f64 + Sync,
) -> f64 {
    sums.clear();
    sums.resize(rows.div_ceil(ROWS_A_TASK), 0.0);
    let part = |task: usize, sum: &mut f64| *sum = work(task * ROWS_A_TASK..rows.min((task + 1) * ROWS_A_TASK));
    if parallel && sums.len() > 1 {
        sums.par_iter_mut().enumerate().for_each(|(task, sum)| part(task, sum));
    } else {
        sums.iter_mut().enumerate().for_each(|(task, sum)| part(task, sum));
    }
    sums.iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_come_once_and_know_their_places() {
        let mut columns = Columns::new(10);
        assert_eq!(columns.collect(0, [7, 2, 7, 9, 2].into_iter()), [2, 7, 9]);
        assert_eq!([2, 7, 9, 3].map(|j| columns.place(0, j)), [Some(0), Some(1), Some(2), None]);
        assert_eq!(columns.collect(1, [3, 2].into_iter()), [2, 3]);
        assert_eq!([2, 3, 7].map(|j| columns.place(1, j)), [Some(0), Some(1), None]);
        assert_eq!(columns.collect(2, std::iter::empty()), [0u32; 0]);
    }

    #[test]
    fn the_transpose_has_rows_for_columns() {
        let pattern = Pattern::from_rows([vec![0, 2], vec![], vec![2, 1]].into_iter());
        let transposed = pattern.transposed(4);
        assert_eq!(
            (0..4).map(|i| transposed.columns(i).to_vec()).collect::<Vec<_>>(),
            [vec![0], vec![2], vec![0, 2], vec![]]
        );
        assert_eq!(transposed.transposed(3), pattern);
    }
}
