//! The host's reading of a document, as the header's `asid_world`.
//!
//! An engine without an MJCF compiler builds its world from this. Names are assigned, defaults
//! resolved, angles in radians, mass properties computed, and indices into the rows known. A
//! separate list names what the document holds beyond it, so that nothing is silently lost.

mod drives;
mod left_out;
mod refusal;
mod tree;

use std::ffi::{CString, c_char};

use asid_core::layout::Layout;
use asid_core::{Error, Result, Scene};
use asid_mjcf::document;
use mjcf_rs::Model;

use crate::table;

/// A document in the form for engines without a compiler; owns everything that [`World::table`]
/// points to.
pub struct World {
    table: table::World,
    layout: Layout,
    // The targets of `table`'s pointers: each lies on the heap and never changes.
    _bodies: Vec<table::Body>,
    _joints: Vec<table::Joint>,
    _geoms: Vec<table::Geom>,
    _sites: Vec<table::Site>,
    _actuators: Vec<table::Actuator>,
    _sensors: Vec<table::Sensor>,
    _keyframes: Vec<table::Keyframe>,
    _left_out: Vec<*const c_char>,
    _texts: Texts,
    _rows: Rows,
}

// SAFETY: everything that the pointers lead to is owned by the value, is made before it, and never
// changes.
unsafe impl Send for World {}
// SAFETY: as above.
unsafe impl Sync for World {}

impl World {
    /// Reads a scene.
    ///
    /// # Errors
    /// [`Error::Scene`] when the document is not MJCF, refers to something that does not exist, has
    /// a duplicate name, or holds a shape or number without a meaning.
    pub fn read(scene: &Scene) -> Result<Self> {
        let refuse = |message: String| Error::Scene {
            scene: scene.name().to_owned(),
            message,
        };
        let xml = roxmltree::Document::parse(scene.xml())
            .map_err(|e| refuse(format!("is not well-formed XML: {e}")))?;
        let model = scene.description()?;
        let layout = document::layout(scene, &model)?;
        refusal::check(&model, &layout).map_err(refuse)?;

        let mut texts = Texts::default();
        let mut rows = Rows::default();
        let bodies = tree::bodies(&model, &layout, &mut texts);
        let joints = tree::joints(&model, &layout, &mut texts);
        if let Some(body) = refusal::weightless(&model, &bodies, &joints) {
            let name = &layout.bodies[body];
            return Err(refuse(format!("body `{name}` moves and has no mass")));
        }
        let geoms = tree::geoms(&model, &layout, &mut texts);
        let sites = tree::sites(&model, &mut texts);
        let actuators = drives::actuators(&model, &layout, &xml, &mut texts).map_err(refuse)?;
        let sensors = drives::sensors(&model, &layout, &xml, &mut texts).map_err(refuse)?;
        let keyframes = drives::keyframes(&layout, &mut texts, &mut rows);
        let left_out: Vec<*const c_char> = left_out::list(&xml, &model)
            .iter()
            .map(|text| texts.add(text))
            .collect();
        let qpos0 = rows.add(&document::default_qpos(&model, &layout));
        Ok(Self {
            table: table::World {
                size: size_of::<table::World>() as u64,
                timestep: layout.timestep,
                gravity: model.option.gravity,
                nq: layout.nq as u64,
                nv: layout.nv as u64,
                nu: layout.nu() as u64,
                nsensordata: layout.nsensordata() as u64,
                qpos0,
                nbody: bodies.len() as u64,
                bodies: bodies.as_ptr(),
                njoint: joints.len() as u64,
                joints: joints.as_ptr(),
                ngeom: geoms.len() as u64,
                geoms: geoms.as_ptr(),
                nsite: sites.len() as u64,
                sites: sites.as_ptr(),
                nactuator: actuators.len() as u64,
                actuators: actuators.as_ptr(),
                nsensor: sensors.len() as u64,
                sensors: sensors.as_ptr(),
                nkeyframe: keyframes.len() as u64,
                keyframes: keyframes.as_ptr(),
                nleft_out: left_out.len() as u64,
                left_out: left_out.as_ptr(),
            },
            layout,
            _bodies: bodies,
            _joints: joints,
            _geoms: geoms,
            _sites: sites,
            _actuators: actuators,
            _sensors: sensors,
            _keyframes: keyframes,
            _left_out: left_out,
            _texts: texts,
            _rows: rows,
        })
    }

    /// The structure; its pointers are valid as long as `self` lives.
    #[must_use]
    pub fn table(&self) -> &table::World {
        &self.table
    }

    /// Names and indices, as every engine gives them for this scene.
    #[must_use]
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Index of a named element among those of its kind (`body`, `geom`, `joint`, `actuator`);
    /// `None` where there is none.
    #[must_use]
    pub fn object(&self, element: &str, name: &str) -> Option<u64> {
        object(&self.layout, element, name)
    }
}

fn object(layout: &Layout, element: &str, name: &str) -> Option<u64> {
    let place = match element {
        "body" => layout.bodies.iter().position(|n| n == name),
        "geom" => layout.geoms.iter().position(|n| n == name),
        "joint" => layout.joints.iter().position(|j| j.name == name),
        "actuator" => layout.actuators.iter().position(|a| a.name == name),
        _ => None,
    };
    place.map(|i| i as u64)
}

/// Zero-terminated texts with fixed addresses.
#[derive(Default)]
struct Texts(Vec<CString>);

impl Texts {
    /// Adds a text. XML cannot contain the zero character, which a C string cannot hold.
    fn add(&mut self, text: &str) -> *const c_char {
        self.0.push(CString::new(text).unwrap_or_default());
        self.0.last().map_or(std::ptr::null(), |t| t.as_ptr())
    }
}

/// Rows of numbers with fixed addresses.
#[derive(Default)]
struct Rows(Vec<Vec<f64>>);

impl Rows {
    fn add(&mut self, row: &[f64]) -> *const f64 {
        self.0.push(row.to_vec());
        self.0.last().map_or(std::ptr::null(), |r| r.as_ptr())
    }
}

/// The sites of a document, each with its body.
fn sites(model: &Model) -> impl Iterator<Item = (usize, &mjcf_rs::body::Site)> {
    let bodies = model.bodies.iter().enumerate();
    bodies.flat_map(|(i, entry)| entry.body.sites.iter().map(move |site| (i, site)))
}

#[cfg(test)]
mod tests;
