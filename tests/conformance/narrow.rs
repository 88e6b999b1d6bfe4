//! An engine with fewer capabilities: a wrapper around another engine that claims fewer of them and
//! refuses whatever needs the others.

use std::sync::Arc;

use asid::core::layout::Channel;
use asid::core::{
    Backend, BatchConfig, Capabilities, Error, Layout, Model, Recording, Result, Rollout, Scene,
    Simulator, Snapshot, Status, Target,
};
use roxmltree::{Document, Node};

/// An engine that claims `bits` and nothing else.
pub struct Narrow<'a> {
    inner: &'a dyn Backend,
    bits: Capabilities,
}

impl<'a> Narrow<'a> {
    /// Restricts an engine to those of its capabilities that are in `bits`.
    pub fn new(inner: &'a dyn Backend, bits: Capabilities) -> Self {
        Self {
            inner,
            bits: inner.capabilities() & bits,
        }
    }
}

fn require(bits: Capabilities, needed: Capabilities) -> Result<()> {
    let lacking = needed - bits;
    if lacking.is_empty() {
        return Ok(());
    }
    let names: Vec<&str> = lacking.iter_names().map(|(name, _)| name).collect();
    Err(Error::Incapable {
        backend: "narrow".into(),
        what: names.join(", "),
    })
}

/// Capabilities that a document needs.
fn needed(xml: &str) -> Capabilities {
    let document = Document::parse(xml).unwrap();
    let mut bits = Capabilities::empty();
    for node in document.descendants().filter(Node::is_element) {
        let has = |name: &str| node.attribute(name).is_some_and(|v| v != "0");
        let within = |tag: &str| node.ancestors().skip(1).any(|a| a.has_tag_name(tag));
        match node.tag_name().name() {
            "freejoint" => bits |= Capabilities::FREE_BODIES,
            "joint" if within("worldbody") || within("default") => {
                if within("worldbody") {
                    bits |= match node.attribute("type") {
                        Some("free") => Capabilities::FREE_BODIES,
                        _ => Capabilities::ARTICULATION,
                    };
                }
                if has("damping") || has("stiffness") || has("armature") {
                    bits |= Capabilities::JOINT_IMPEDANCE;
                }
                if has("frictionloss") {
                    bits |= Capabilities::JOINT_FRICTION;
                }
                if has("range") || has("limited") {
                    bits |= Capabilities::JOINT_LIMITS;
                }
            }
            "geom" if within("worldbody") => bits |= of_geom(&node),
            _ => {}
        }
        bits |= match node.parent_element().map(|p| p.tag_name().name()) {
            Some("actuator") => Capabilities::ACTUATORS,
            Some("equality") => Capabilities::EQUALITY,
            Some("contact") => Capabilities::CONTACT,
            _ => Capabilities::empty(),
        };
    }
    bits
}

fn of_geom(node: &Node<'_, '_>) -> Capabilities {
    let touches = ["contype", "conaffinity"]
        .iter()
        .any(|a| node.attribute(*a) != Some("0"));
    if !touches {
        return Capabilities::empty();
    }
    let mut bits = Capabilities::CONTACT;
    if node.attribute("type") == Some("mesh") {
        bits |= Capabilities::MESHES;
    }
    let condim = node.attribute("condim").unwrap_or("3");
    let friction: Vec<&str> = (node.attribute("friction").unwrap_or("1"))
        .split_whitespace()
        .collect();
    let acts = |i: usize| friction.get(i).is_some_and(|f| *f != "0");
    if ["4", "6"].contains(&condim) && acts(1) {
        bits |= Capabilities::TORSIONAL_FRICTION;
    }
    if condim == "6" && acts(2) {
        bits |= Capabilities::ROLLING_FRICTION;
    }
    bits
}

/// Capabilities that a target needs.
fn of_target(target: &Target) -> Capabilities {
    match (&*target.element, &*target.attribute, target.index) {
        ("geom", "friction", 0) => Capabilities::CONTACT,
        ("geom", "friction", 1) => Capabilities::TORSIONAL_FRICTION,
        ("geom", "friction", 2) => Capabilities::ROLLING_FRICTION,
        ("geom", "solref", _) => Capabilities::CONTACT_STIFFNESS,
        ("body", "pos", _) | ("joint", "pos" | "axis", _) => Capabilities::JOINT_ANCHORS,
        ("geom" | "body", ..) => Capabilities::MASS_PARAMETERS,
        ("joint", "frictionloss", _) => Capabilities::JOINT_FRICTION,
        ("joint", ..) => Capabilities::JOINT_IMPEDANCE,
        ("actuator", ..) => Capabilities::ACTUATORS,
        _ => Capabilities::empty(),
    }
}

fn of_record(record: &Recording) -> Capabilities {
    let force = |c: &Channel| matches!(c, Channel::ContactForce { .. });
    if record.channels().iter().any(force) {
        Capabilities::CONTACT_FORCES
    } else {
        Capabilities::empty()
    }
}

impl Backend for Narrow<'_> {
    fn name(&self) -> &str {
        "narrow"
    }

    fn version(&self) -> String {
        self.inner.version()
    }

    fn capabilities(&self) -> Capabilities {
        self.bits
    }

    fn load(&self, scene: &Scene) -> Result<Arc<dyn Model>> {
        let model = self.inner.load(scene)?;
        require(self.bits, needed(scene.xml()))?;
        Ok(Arc::new(NarrowModel {
            inner: model,
            bits: self.bits,
        }))
    }
}

struct NarrowModel {
    inner: Arc<dyn Model>,
    bits: Capabilities,
}

impl Model for NarrowModel {
    fn layout(&self) -> &Layout {
        self.inner.layout()
    }

    fn nominal(&self, target: &Target) -> Result<f64> {
        require(self.bits, of_target(target))?;
        self.inner.nominal(target)
    }

    fn simulator(&self, config: &BatchConfig) -> Result<Box<dyn Simulator>> {
        for target in &config.targets {
            require(self.bits, of_target(target))?;
        }
        Ok(Box::new(NarrowSimulator {
            inner: self.inner.simulator(config)?,
            bits: self.bits,
        }))
    }
}

struct NarrowSimulator {
    inner: Box<dyn Simulator>,
    bits: Capabilities,
}

impl Simulator for NarrowSimulator {
    fn layout(&self) -> &Layout {
        self.inner.layout()
    }

    fn batch_size(&self) -> usize {
        self.inner.batch_size()
    }

    fn set_parameters(&mut self, sims: &[usize], values: &[f64]) -> Result<()> {
        self.inner.set_parameters(sims, values)
    }

    fn reset(&mut self, sims: &[usize]) -> Result<()> {
        self.inner.reset(sims)
    }

    fn set_state(&mut self, sims: &[usize], qpos: &[f64], qvel: &[f64]) -> Result<()> {
        self.inner.set_state(sims, qpos, qvel)
    }

    fn rollout(&mut self, rollout: &Rollout<'_>, out: &mut [f64]) -> Result<()> {
        let mut needed = of_record(rollout.record);
        if !rollout.forces.is_empty() {
            needed |= Capabilities::EXTERNAL_FORCES;
        }
        if !rollout.changes.is_empty() {
            needed |= Capabilities::PARAMETER_CHANGES;
        }
        if rollout.hook.is_some() {
            needed |= Capabilities::STEP_HOOKS;
        }
        require(self.bits, needed)?;
        self.inner.rollout(rollout, out)
    }

    fn read(&mut self, sims: &[usize], record: &Recording, out: &mut [f64]) -> Result<()> {
        require(self.bits, of_record(record))?;
        self.inner.read(sims, record, out)
    }

    fn save(&mut self, sims: &[usize]) -> Result<Snapshot> {
        require(self.bits, Capabilities::EXACT_SNAPSHOT)?;
        self.inner.save(sims)
    }

    fn load(&mut self, snapshot: &Snapshot, rows: &[usize], sims: &[usize]) -> Result<()> {
        require(self.bits, Capabilities::EXACT_SNAPSHOT)?;
        self.inner.load(snapshot, rows, sims)
    }

    fn copy_state(&mut self, from: &[usize], to: &[usize]) -> Result<()> {
        require(self.bits, Capabilities::EXACT_SNAPSHOT)?;
        self.inner.copy_state(from, to)
    }

    fn status(&self) -> &[Status] {
        self.inner.status()
    }

    fn steps_taken(&self) -> u64 {
        self.inner.steps_taken()
    }
}
