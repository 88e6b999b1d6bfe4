//! Triangles in space, and their form for a page.

use asid_results::view as out;

use crate::pack::{Cube, text};

/// Triangles in space.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surface {
    /// Vertices, m.
    pub vertices: Vec<[f64; 3]>,
    /// Three vertices a triangle, counterclockwise from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl Surface {
    /// Lowest and highest corner of the bounding box.
    #[must_use]
    pub fn bounds(&self) -> [[f64; 3]; 2] {
        let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for p in &self.vertices {
            for k in 0..3 {
                bounds[0][k] = bounds[0][k].min(p[k]);
                bounds[1][k] = bounds[1][k].max(p[k]);
            }
        }
        bounds
    }

    /// The surface in the form for the page.
    pub(crate) fn packed(&self) -> out::Mesh {
        let cube = Cube::around(self.vertices.iter().copied());
        let vertices: Vec<u16> = self.vertices.iter().flat_map(|p| cube.point(*p)).collect();
        let triangles: Vec<u16> = self.triangles.iter().flatten().map(|&v| v as u16).collect();
        out::Mesh {
            low: cube.low.map(|x| x as f32),
            size: cube.size as f32,
            vertices: text(&vertices),
            triangles: text(&triangles),
        }
    }
}
