//! Meshes of a scene, read from their files as an engine reads them, with few enough triangles for
//! a page.
//!
//! STL (binary and text) and OBJ are read, the usual formats of MJCF models; other files lead to a
//! remark. The counts in a file are not trusted: no memory is reserved beyond the size of its
//! content.

use std::path::{Path, PathBuf};

use asid_core::Scene;
use mjcf_rs::Model;
use mjcf_rs::assets::Mesh;
use parry3d::math::Vector;

use crate::simplify::simplify;
use crate::surface::Surface;

/// Triangles of all meshes of a scene together: about 300 kB of a report.
pub const TRIANGLES: usize = 24_000;
/// Fewest triangles of a mesh, however many other meshes there are.
const FEWEST: usize = 120;
/// Largest number of vertices of a mesh: indices have 16 bits.
const VERTICES: usize = 65_535;
/// Largest file that is read, bytes. It is far larger than any robot's, and read in a second.
const LARGEST: u64 = 256 << 20;

/// The meshes of these names, in the frames of their geoms, with at most [`TRIANGLES`] in total;
/// `Err` holds the reason why one is missing.
pub(crate) fn of_scene(
    scene: &Scene,
    model: &Model,
    names: &[&str],
) -> Vec<Result<Surface, String>> {
    let whole: Vec<Result<Surface, String>> = names
        .iter()
        .map(|name| {
            let mesh = model.assets.meshes.iter().find(|m| name_of(m) == *name);
            let mesh = mesh.ok_or_else(|| format!("mesh `{name}` is not among the assets"))?;
            surface(scene, model, mesh).map_err(|why| format!("mesh `{name}` is not drawn: {why}"))
        })
        .collect();
    let all: usize = whole.iter().flatten().map(|s| s.triangles.len()).sum();
    let share = |own: usize| ((TRIANGLES as f64 * own as f64 / all as f64) as usize).max(FEWEST);
    whole
        .into_iter()
        .map(|surface| {
            let surface = surface?;
            let most = if all <= TRIANGLES {
                usize::MAX
            } else {
                share(surface.triangles.len())
            };
            let mut few = simplify(&surface, most);
            if few.vertices.len() > VERTICES {
                few = simplify(&surface, TRIANGLES / 2);
            }
            Ok(few)
        })
        .collect()
}

/// Name of a mesh: its own, or its file's.
fn name_of(mesh: &Mesh) -> String {
    let of_file = || {
        let stem = Path::new(mesh.file.as_deref()?).file_stem()?;
        Some(stem.to_string_lossy().into_owned())
    };
    mesh.name.clone().or_else(of_file).unwrap_or_default()
}

/// A mesh in the frame of its geoms: as in MuJoCo, moved by its reference pose, then scaled.
fn surface(scene: &Scene, model: &Model, mesh: &Mesh) -> Result<Surface, String> {
    let mut surface = match (&mesh.inline_vertices, &mesh.file) {
        (Some(flat), _) => inline(flat, mesh.inline_faces.as_deref())?,
        (None, Some(file)) => read(&place(scene, model, file))?,
        (None, None) => return Err("it has neither a file nor vertices".into()),
    };
    let (t, q) = (mesh.refpose.translation, mesh.refpose.rotation.inverse());
    for p in &mut surface.vertices {
        let moved = q * (mjcf_rs::glam::DVec3::from_array(*p) - t);
        *p = [0, 1, 2].map(|k| moved[k] * mesh.scale[k]);
    }
    let mirrored = mesh.scale.iter().product::<f64>() < 0.0;
    if mirrored {
        surface.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    if surface.vertices.iter().flatten().any(|x| !x.is_finite()) {
        return Err("a vertex is not finite".into());
    }
    Ok(surface)
}

/// Path of a mesh's file.
fn place(scene: &Scene, model: &Model, file: &str) -> PathBuf {
    let home = scene.directory().unwrap_or(Path::new(""));
    let compiler = &model.compiler;
    let folder = compiler
        .mesh_dir
        .as_deref()
        .or(compiler.asset_dir.as_deref());
    home.join(folder.unwrap_or("")).join(file)
}

/// Vertices of the document, with its faces or their convex hull.
fn inline(flat: &[f64], faces: Option<&[u32]>) -> Result<Surface, String> {
    let vertices: Vec<[f64; 3]> = flat.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
    if let Some(faces) = faces {
        let triangles = faces.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
        return checked(Surface {
            vertices,
            triangles,
        });
    }
    let points: Vec<Vector> = vertices
        .iter()
        .map(|p| Vector::new(p[0] as f32, p[1] as f32, p[2] as f32))
        .collect();
    let hull = parry3d::transformation::try_convex_hull(&points);
    let (points, triangles) = hull.map_err(|_| "its vertices enclose nothing".to_owned())?;
    let vertices = points.iter().map(|p| p.to_array().map(f64::from)).collect();
    checked(Surface {
        vertices,
        triangles,
    })
}

/// Checks that the vertices of all triangles exist.
fn checked(surface: Surface) -> Result<Surface, String> {
    let n = surface.vertices.len();
    if surface.triangles.is_empty() {
        return Err("it has no triangles".into());
    }
    match surface
        .triangles
        .iter()
        .flatten()
        .find(|&&v| v as usize >= n)
    {
        Some(v) => Err(format!("a triangle has vertex {v} of {n}")),
        None => Ok(surface),
    }
}

/// Reads a file according to its extension.
fn read(path: &Path) -> Result<Surface, String> {
    let said = |why: &dyn std::fmt::Display| format!("{}: {why}", path.display());
    let size = std::fs::metadata(path).map_err(|e| said(&e))?.len();
    if size > LARGEST {
        return Err(said(&"larger than 256 MiB"));
    }
    let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
    let bytes = std::fs::read(path).map_err(|e| said(&e))?;
    let surface = match &*ending.to_string_lossy() {
        "stl" => stl(&bytes),
        "obj" => obj(&String::from_utf8_lossy(&bytes)),
        other => {
            return Err(said(&format!(
                "`.{other}` files are not read, STL and OBJ are"
            )));
        }
    };
    checked(surface).map_err(|e| said(&e))
}

/// Reads STL: binary if the file's length matches its count, text otherwise. Equal vertices are
/// merged.
fn stl(bytes: &[u8]) -> Surface {
    let count = bytes
        .get(80..84)
        .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let fits = count.is_some_and(|n| bytes.len() as u64 >= 84 + 50 * u64::from(n));
    let mut corners: Vec<[f32; 3]> = Vec::new();
    if fits && !(bytes.starts_with(b"solid") && bytes.windows(5).take(400).any(|w| w == b"facet")) {
        for facet in bytes[84..]
            .chunks_exact(50)
            .take(count.unwrap_or(0) as usize)
        {
            for corner in facet[12..48].chunks_exact(12) {
                let x = |k: usize| {
                    f32::from_le_bytes([corner[k], corner[k + 1], corner[k + 2], corner[k + 3]])
                };
                corners.push([x(0), x(4), x(8)]);
            }
        }
    } else {
        for line in String::from_utf8_lossy(bytes).lines() {
            if let Some(rest) = line.trim().strip_prefix("vertex") {
                corners.extend(three(rest).map(|p| p.map(|x| x as f32)));
            }
        }
    }
    let mut surface = Surface::default();
    let mut known = std::collections::HashMap::new();
    for triangle in corners.chunks_exact(3) {
        surface.triangles.push([0, 1, 2].map(|k| {
            let p = triangle[k];
            *known.entry(p.map(f32::to_bits)).or_insert_with(|| {
                surface.vertices.push(p.map(f64::from));
                surface.vertices.len() as u32 - 1
            })
        }));
    }
    surface
}

/// Three numbers of a line.
fn three(text: &str) -> Option<[f64; 3]> {
    let mut numbers = text.split_whitespace().map(|x| x.parse().ok());
    Some([numbers.next()??, numbers.next()??, numbers.next()??])
}

/// Reads OBJ: vertices and faces; a face with more than three corners becomes a fan.
fn obj(text: &str) -> Surface {
    let mut surface = Surface::default();
    for line in text.lines() {
        let line = line.trim();
        if let Some(rest) = line.strip_prefix("v ") {
            surface.vertices.extend(three(rest));
        } else if let Some(rest) = line.strip_prefix("f ") {
            let n = surface.vertices.len() as i64;
            let corner = |word: &str| -> Option<u32> {
                let i: i64 = word.split('/').next()?.parse().ok()?;
                // Indices count from one, or backwards from the last.
                u32::try_from(if i < 0 { n + i } else { i - 1 }).ok()
            };
            let corners: Vec<u32> = rest.split_whitespace().filter_map(corner).collect();
            let fan = corners.windows(2).skip(1);
            surface
                .triangles
                .extend(fan.map(|w| [corners[0], w[0], w[1]]));
        }
    }
    surface
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1/1/1 2/2/1 3/3/1 -1/4/1\n";

    #[test]
    fn a_square_of_four_corners_is_two_triangles() {
        let square = checked(obj(SQUARE)).unwrap();
        assert_eq!(square.triangles, [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn binary_and_text_say_the_same() {
        let corners = [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.5]];
        let mut binary = vec![0; 80];
        binary.extend(1_u32.to_le_bytes());
        binary.extend([0; 12]);
        binary.extend(corners.iter().flatten().flat_map(|x| x.to_le_bytes()));
        binary.extend([0; 2]);
        let lines: String = corners
            .iter()
            .map(|p| format!("vertex {} {} {}\n", p[0], p[1], p[2]))
            .collect();
        let text = format!(
            "solid a\nfacet normal 0 0 1\nouter loop\n{lines}endloop\nendfacet\nendsolid a\n"
        );
        assert_eq!(stl(&binary), stl(text.as_bytes()));
        assert_eq!(stl(&binary).vertices.len(), 3);
    }

    /// The count in a damaged file claims four thousand million triangles.
    #[test]
    fn damaged_files_are_told_and_reserve_nothing() {
        let mut binary = vec![0; 80];
        binary.extend(u32::MAX.to_le_bytes());
        binary.extend([7; 30]);
        assert_eq!(checked(stl(&binary)).unwrap_err(), "it has no triangles");
        assert!(
            checked(obj("v 0 0 0\nf 1 2 3\n"))
                .unwrap_err()
                .contains("vertex 1 of 1")
        );
        assert!(checked(obj("v a b\nf 1 x\nf\nf -9 -9 -9")).is_err());
    }

    #[test]
    fn points_without_faces_are_their_hull() {
        let cube: Vec<f64> = (0..8)
            .flat_map(|i| [i & 1, i >> 1 & 1, i >> 2 & 1].map(f64::from))
            .chain([0.5; 3])
            .collect();
        let hull = inline(&cube, None).unwrap();
        assert_eq!(hull.triangles.len(), 12);
        assert!(inline(&[0.0; 9], None).is_err());
    }
}
