//! A scene, ready to be drawn: its shapes in the frames of rigid parts.

use asid_core::{Result, Scene};
use asid_mjcf::Plant;
use asid_mjcf::document::default_qpos;
use asid_mjcf::mass::placed;
use asid_results::view::{Shape, ShapeKind, View};
use mjcf_rs::Model;
use mjcf_rs::body::{Geom, GeomType};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

use crate::contact::Touch;
use crate::mesh;
use crate::surface::Surface;

/// Highest group of geoms that is drawn, if a part has any up to it: MuJoCo's viewer shows groups
/// 0 to 2.
const SHOWN_GROUP: i32 = 2;

/// A scene ready to be drawn.
pub struct Stage<'p> {
    pub(crate) plant: &'p Plant,
    /// First body of each part; that of the world is 0.
    pub(crate) heads: Vec<usize>,
    /// Part of each body.
    pub(crate) part_of: Vec<usize>,
    /// Geometry of the shapes that may touch.
    pub(crate) touch: Touch,
    /// Radius of the largest bounded shape, m.
    pub(crate) reach: f64,
    shapes: Vec<Shape>,
    meshes: Vec<Surface>,
    notes: Vec<String>,
}

impl<'p> Stage<'p> {
    /// Reads a scene, and the files of its meshes. What cannot be drawn is left out with a remark.
    ///
    /// # Errors
    /// When the document is not valid MJCF.
    pub fn of(scene: &Scene, plant: &'p Plant) -> Result<Self> {
        let model = scene.description()?;
        let home = plant.poses(&default_qpos(&model, &plant.layout));
        let mut heads = vec![0];
        heads.extend((1..plant.bodies.len()).filter(|&b| plant.bodies[b].weld == b));
        let part = |b: usize| heads.iter().position(|&h| h == plant.bodies[b].weld);
        let part_of: Vec<usize> = (0..plant.bodies.len())
            .map(|b| part(b).unwrap_or(0))
            .collect();

        let all: Vec<(usize, &Geom)> = (model.bodies.iter().enumerate())
            .flat_map(|(b, entry)| entry.body.geoms.iter().map(move |g| (b, g)))
            .collect();
        let mut names: Vec<&str> = all.iter().filter_map(|(_, g)| mesh_of(g)).collect();
        names.sort_unstable();
        names.dedup();
        let (mut surfaces, mut notes) = (Vec::new(), Vec::new());
        // Index of each name among the meshes that could be read.
        let mut read: Vec<Option<usize>> = Vec::new();
        for surface in mesh::of_scene(scene, &model, &names) {
            match surface {
                Ok(surface) => {
                    read.push(Some(surfaces.len()));
                    surfaces.push(surface);
                }
                Err(why) => {
                    read.push(None);
                    notes.push(why);
                }
            }
        }
        let mesh = |g: &Geom| read[names.iter().position(|n| Some(*n) == mesh_of(g))?];

        // Hide what MuJoCo's viewer hides, unless a part has nothing else.
        let visible = |g: &Geom| g.group <= SHOWN_GROUP;
        let has_visible: Vec<bool> = (0..heads.len())
            .map(|p| all.iter().any(|(b, g)| part_of[*b] == p && visible(g)))
            .collect();
        let mut shapes = Vec::new();
        let mut frames = Vec::with_capacity(all.len());
        for (b, geom) in &all {
            let (b, part) = (*b, part_of[*b]);
            let (pose, size) = placed(geom);
            let part_from_geom = home[heads[part]].inverse() * home[b] * isometry(&pose);
            frames.push((part_from_geom, geom.type_, size, mesh(geom)));
            let Some(kind) = kind(geom.type_) else {
                notes.push("height fields and signed distance fields are not drawn".to_owned());
                continue;
            };
            let hidden = has_visible[part] && !visible(geom);
            if hidden || kind == ShapeKind::Mesh && mesh(geom).is_none() {
                continue;
            }
            let (t, q) = (part_from_geom.translation, part_from_geom.rotation);
            shapes.push(Shape {
                part,
                kind,
                size: size.map(|x| x as f32),
                position: [t.x, t.y, t.z].map(|x| x as f32),
                rotation: [q.w, q.i, q.j, q.k].map(|x| x as f32),
                rgba: colour(&model, geom),
                mesh: mesh(geom),
            });
        }
        notes.dedup();
        Ok(Self {
            touch: Touch::new(plant, &part_of, &frames, &surfaces),
            reach: reach(&shapes, &surfaces),
            plant,
            heads,
            part_of,
            shapes,
            meshes: surfaces,
            notes,
        })
    }

    /// Poses of all parts but the world in a state `qpos` (`nq`).
    #[must_use]
    pub fn poses(&self, qpos: &[f64]) -> Vec<Isometry3<f64>> {
        let bodies = self.plant.poses(qpos);
        self.heads[1..].iter().map(|&b| bodies[b]).collect()
    }

    /// The view, without episodes.
    #[must_use]
    pub fn view(&self) -> View {
        View {
            parts: self
                .heads
                .iter()
                .map(|&b| self.plant.layout.bodies[b].clone())
                .collect(),
            shapes: self.shapes.clone(),
            meshes: self.meshes.iter().map(Surface::packed).collect(),
            takes: Vec::new(),
            notes: self.notes.clone(),
        }
    }
}

/// Radius of the largest bounded shape, m.
fn reach(shapes: &[Shape], meshes: &[Surface]) -> f64 {
    let of = |shape: &Shape| match (shape.kind, shape.mesh) {
        (ShapeKind::Plane, _) => 0.0,
        (_, Some(mesh)) => {
            let [low, high] = meshes[mesh].bounds();
            (0..3)
                .map(|k| (high[k] - low[k]).powi(2))
                .sum::<f64>()
                .sqrt()
                / 2.0
        }
        _ => shape
            .size
            .iter()
            .map(|x| f64::from(*x).powi(2))
            .sum::<f64>()
            .sqrt(),
    };
    shapes.iter().map(of).fold(0.0, f64::max)
}

/// The pose in nalgebra's form.
fn isometry(pose: &mjcf_rs::Pose) -> Isometry3<f64> {
    let (t, q) = (pose.translation, pose.rotation);
    Isometry3::from_parts(
        Translation3::new(t.x, t.y, t.z),
        UnitQuaternion::from_quaternion(Quaternion::new(q.w, q.x, q.y, q.z)),
    )
}

/// The mesh of a geom; `None` for a primitive, even one that was fitted to a mesh.
fn mesh_of(geom: &Geom) -> Option<&str> {
    geom.mesh
        .as_deref()
        .filter(|_| geom.type_ == GeomType::Mesh)
}

fn kind(kind: GeomType) -> Option<ShapeKind> {
    Some(match kind {
        GeomType::Plane => ShapeKind::Plane,
        GeomType::Sphere => ShapeKind::Sphere,
        GeomType::Capsule => ShapeKind::Capsule,
        GeomType::Ellipsoid => ShapeKind::Ellipsoid,
        GeomType::Cylinder => ShapeKind::Cylinder,
        GeomType::Box => ShapeKind::Box,
        GeomType::Mesh => ShapeKind::Mesh,
        GeomType::Hfield | GeomType::Sdf => return None,
    })
}

/// Colour of a geom: its own, else its material's.
fn colour(model: &Model, geom: &Geom) -> Option<[f32; 4]> {
    let material = || model.assets.material(geom.material.as_deref()?)?.rgba;
    let rgba = geom.rgba.or_else(material)?;
    Some(rgba.map(|x| x.clamp(0.0, 1.0) as f32))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &str = r#"<mujoco><compiler angle="radian"/>
      <asset><material name="red" rgba="1 0 0 1"/>
        <mesh name="tip" vertex="0 0 0 1 0 0 0 1 0 0 0 1" scale="0.1 0.1 0.1"/></asset><worldbody>
      <geom type="plane" size="0 0 1"/>
      <body name="base" pos="0 0 1"><geom type="box" size="0.1 0.2 0.3"/>
        <body name="arm" pos="0.5 0 0"><joint axis="0 1 0"/>
          <geom type="capsule" fromto="0 0 0 0 0 0.4" size="0.02" material="red"/>
          <body name="hand" pos="0 0 0.4"><geom type="mesh" mesh="tip"/><geom type="sphere" size="0.3" group="3"/></body></body></body>
      </worldbody></mujoco>"#;

    #[test]
    fn what_is_rigidly_joined_is_one_part() {
        let scene = Scene::from_xml("arm", SCENE, &[]).unwrap();
        let plant = Plant::of(&scene).unwrap();
        let stage = Stage::of(&scene, &plant).unwrap();
        let view = stage.view();
        assert_eq!(view.parts, ["world", "arm"]);
        // The hand's sphere is in a hidden group.
        let parts: Vec<usize> = view.shapes.iter().map(|s| s.part).collect();
        assert_eq!(parts, [0, 0, 1, 1]);
        assert_eq!(view.shapes[1].position, [0.0, 0.0, 1.0]);
        assert_eq!(view.shapes[2].rgba, Some([1.0, 0.0, 0.0, 1.0]));
        assert_eq!(view.shapes[2].size[1], 0.2);
        assert_eq!(view.shapes[3].position, [0.0, 0.0, 0.4]);
        assert_eq!(view.meshes.len(), 1);
        assert_eq!(stage.poses(&[0.0])[0].translation.vector.x, 0.5);
    }

    #[test]
    fn a_mesh_that_is_not_there_is_told_and_the_rest_is_drawn() {
        let missing = SCENE.replace("vertex=\"0 0 0 1 0 0 0 1 0 0 0 1\"", "file=\"nowhere.stl\"");
        let scene = Scene::from_xml("arm", &missing, &[]).unwrap();
        let plant = Plant::of(&scene).unwrap();
        let view = Stage::of(&scene, &plant).unwrap().view();
        assert_eq!(view.shapes.len(), 3);
        assert!(view.notes[0].contains("`tip`") && view.notes[0].contains("nowhere.stl"));
    }
}
