//! The host's reading of a document, as the `asid_world` of the header.
//!
//! An engine without an MJCF compiler of its own builds its world from this: names
//! given, defaults resolved, angles in radians, mass properties computed, places in
//! the rows known. What the document holds beyond it is in a list of its own, so
//! that nothing gets lost in silence.

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

/// A document as engines without a compiler of their own see it; owns everything
/// that [`World::table`] points to.
pub struct World {
    table: table::World,
    layout: Layout,
    // What `table` points to: each lies on the heap and is never changed.
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

// SAFETY: all that the pointers lead to is owned by the value, is made before it
// is, and never changes.
unsafe impl Send for World {}
// SAFETY: as above.
unsafe impl Sync for World {}

impl World {
    /// Reads a scene.
    ///
    /// # Errors
    /// [`Error::Scene`] where the document is no MJCF, names something that is not
    /// there or the same thing twice, or holds a shape or number without a meaning.
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

    /// The structure; what it points to lives as long as `self`.
    #[must_use]
    pub fn table(&self) -> &table::World {
        &self.table
    }

    /// Names and places, as every engine gives them for this scene.
    #[must_use]
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Place of a named element among those of its kind (`body`, `geom`, `joint`,
    /// `actuator`); `None` where there is none.
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

/// Zero-terminated texts, each at one place for good.
#[derive(Default)]
struct Texts(Vec<CString>);

impl Texts {
    /// Adds one; XML cannot hold the zero character that a C string cannot hold.
    fn add(&mut self, text: &str) -> *const c_char {
        self.0.push(CString::new(text).unwrap_or_default());
        self.0.last().map_or(std::ptr::null(), |t| t.as_ptr())
    }
}

/// Rows of numbers, each at one place for good.
#[derive(Default)]
struct Rows(Vec<Vec<f64>>);

impl Rows {
    fn add(&mut self, row: &[f64]) -> *const f64 {
        self.0.push(row.to_vec());
        self.0.last().map_or(std::ptr::null(), |r| r.as_ptr())
    }
}

/// The sites of a document: body and site.
fn sites(model: &Model) -> impl Iterator<Item = (usize, &mjcf_rs::body::Site)> {
    let bodies = model.bodies.iter().enumerate();
    bodies.flat_map(|(i, entry)| entry.body.sites.iter().map(move |site| (i, site)))
}

#[cfg(test)]
mod tests;
