//! Orthogonal initial weights (Saxe et al. 2014), drawn from the caller's generator.
//!
//! libtorch's own initialisation uses a generator that is global to the process; two concurrent
//! trainings would race for it.

use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

/// A `rows x cols` matrix, row-major, whose rows (or columns, where there are
/// more rows than columns) are orthogonal and of length `gain`.
pub fn orthogonal(rows: usize, cols: usize, gain: f64, rng: &mut impl Rng) -> Vec<f32> {
    let (few, many) = (rows.min(cols), rows.max(cols));
    let mut vectors: Vec<Vec<f64>> = Vec::with_capacity(few);
    while vectors.len() < few {
        let mut vector: Vec<f64> = (0..many).map(|_| StandardNormal.sample(rng)).collect();
        // Gram-Schmidt, twice: the second pass removes the rounding of the first.
        for _ in 0..2 {
            for earlier in &vectors {
                let along: f64 = dot(earlier, &vector);
                for (v, e) in vector.iter_mut().zip(earlier) {
                    *v -= along * e;
                }
            }
        }
        let length = dot(&vector, &vector).sqrt();
        // A vector within the span of the earlier ones is drawn again.
        if length > 1e-6 {
            vector.iter_mut().for_each(|v| *v /= length);
            vectors.push(vector);
        }
    }
    // Each vector is a row, or a column where there are more rows than columns.
    let mut matrix = vec![0.0; rows * cols];
    for (i, vector) in vectors.iter().enumerate() {
        for (j, v) in vector.iter().enumerate() {
            let (row, col) = if rows <= cols { (i, j) } else { (j, i) };
            matrix[row * cols + col] = (gain * v) as f32;
        }
    }
    matrix
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;

    #[test]
    fn rows_or_columns_are_orthogonal_and_of_length_gain() {
        for (rows, cols) in [(3, 5), (5, 3), (64, 64), (1, 7)] {
            let mut rng = ChaCha8Rng::seed_from_u64(1);
            let matrix = orthogonal(rows, cols, 2.0, &mut rng);
            let entry = |r: usize, c: usize| f64::from(matrix[r * cols + c]);
            let few = rows.min(cols);
            for i in 0..few {
                for j in 0..few {
                    let product: f64 = (0..rows.max(cols))
                        .map(|k| match rows <= cols {
                            true => entry(i, k) * entry(j, k),
                            false => entry(k, i) * entry(k, j),
                        })
                        .sum();
                    let expected = if i == j { 4.0 } else { 0.0 };
                    // Tolerance: single precision of a sum of numbers of order one.
                    assert!(
                        (product - expected).abs() < 1e-5,
                        "{rows}x{cols}: {product}"
                    );
                }
            }
        }
    }
}
