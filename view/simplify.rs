//! Reduces the number of triangles of a surface.
//!
//! Vertices that share a cell of a grid are merged at their mean; triangles that collapse are
//! dropped. It is the simplest method (Rossignac and Borrel, 1993). It keeps large features of any
//! mesh (open, or with triangles that do not meet), and at the size of a picture in a report finer
//! methods look the same.

use std::collections::HashMap;

use crate::surface::Surface;

/// Bisection steps of the search for the grid: the last changes the cell by 1/1000 of the widest.
const HALVINGS: usize = 10;
/// Cells along the longest side of the finest grid: as many as the pixels across a picture.
const FINEST: f64 = 1024.0;
/// Cells along the longest side of the coarsest grid.
const COARSEST: f64 = 6.0;

/// The surface with at most `most` triangles, as far as the coarsest grid allows; unchanged if it
/// has no more.
pub fn simplify(surface: &Surface, most: usize) -> Surface {
    if surface.triangles.len() <= most {
        return surface.clone();
    }
    let [low, high] = surface.bounds();
    let longest = (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max);
    if longest <= 0.0 {
        return Surface::default();
    }
    // Find the finest grid within the budget; the number of triangles falls as cells grow.
    let (mut coarse, mut fine) = (COARSEST.ln(), FINEST.ln());
    let mut best = cluster(surface, low, longest / COARSEST);
    for _ in 0..HALVINGS {
        let middle = f64::midpoint(coarse, fine);
        let tried = cluster(surface, low, longest / middle.exp());
        if tried.triangles.len() <= most {
            (coarse, best) = (middle, tried);
        } else {
            fine = middle;
        }
    }
    best
}

/// Merges the vertices in each cell of a grid of this width, m.
fn cluster(surface: &Surface, low: [f64; 3], width: f64) -> Surface {
    let mut cells: HashMap<[i32; 3], usize> = HashMap::new();
    let mut sums: Vec<([f64; 3], f64)> = Vec::new();
    let of_vertex: Vec<usize> = surface
        .vertices
        .iter()
        .map(|p| {
            let cell = [0, 1, 2].map(|k| ((p[k] - low[k]) / width).floor() as i32);
            let i = *cells.entry(cell).or_insert_with(|| {
                sums.push(([0.0; 3], 0.0));
                sums.len() - 1
            });
            for k in 0..3 {
                sums[i].0[k] += p[k];
            }
            sums[i].1 += 1.0;
            i
        })
        .collect();
    let mut seen = std::collections::HashSet::new();
    let mut triangles = Vec::new();
    for t in &surface.triangles {
        let [a, b, c] = t.map(|v| of_vertex[v as usize] as u32);
        if a == b || b == c || a == c {
            continue;
        }
        // The same three vertices in any order are the same triangle or the back of a sheet.
        let mut key = [a, b, c];
        key.sort_unstable();
        if seen.insert(key) {
            triangles.push([a, b, c]);
        }
    }
    Surface {
        vertices: sums.iter().map(|(sum, n)| sum.map(|x| x / n)).collect(),
        triangles,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ball of `n x 2 n` quads.
    fn ball(n: usize) -> Surface {
        let mut ball = Surface::default();
        for i in 0..=n {
            for j in 0..2 * n {
                let (a, b) = (
                    std::f64::consts::PI * i as f64 / n as f64,
                    std::f64::consts::PI * j as f64 / n as f64,
                );
                ball.vertices
                    .push([a.sin() * b.cos(), a.sin() * b.sin(), a.cos()]);
            }
        }
        let at = |i: usize, j: usize| (i * 2 * n + j % (2 * n)) as u32;
        for i in 0..n {
            for j in 0..2 * n {
                ball.triangles.push([at(i, j), at(i + 1, j), at(i, j + 1)]);
                ball.triangles
                    .push([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
        ball
    }

    #[test]
    fn a_ball_stays_a_ball_with_a_tenth_of_its_triangles() {
        let ball = ball(60);
        let few = simplify(&ball, 1400);
        assert!(
            (700..=1400).contains(&few.triangles.len()),
            "{}",
            few.triangles.len()
        );
        // A vertex is the mean of points of the ball in a cell of about 2/12 across: at most h^2/2
        // below the surface.
        for t in &few.triangles {
            for v in t {
                let r = few.vertices[*v as usize]
                    .map(|x| x * x)
                    .iter()
                    .sum::<f64>()
                    .sqrt();
                assert!((0.96..=1.000_001).contains(&r), "{r}");
            }
        }
    }

    #[test]
    fn few_triangles_are_left_alone_and_a_point_is_nothing() {
        let small = ball(4);
        assert_eq!(simplify(&small, 64), small);
        let point = Surface {
            vertices: vec![[1.0; 3]; 3],
            triangles: vec![[0, 1, 2]; 9],
        };
        assert!(simplify(&point, 3).triangles.is_empty());
    }
}
