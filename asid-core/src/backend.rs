//! An engine: compiles a scene, states its capabilities, makes batches.

use std::sync::Arc;

use crate::error::Result;
use crate::layout::Layout;
use crate::scene::Scene;
use crate::simulator::{BatchConfig, Simulator};
use crate::target::Target;

bitflags::bitflags! {
    /// Capabilities of an engine. Tests and algorithms branch on these bits and never on an
    /// engine's name.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub struct Capabilities: u64 {
        /// Hinge, slide and ball joints in a tree.
        const ARTICULATION = 1 << 0;
        /// Contact between primitive shapes.
        const CONTACT = 1 << 1;
        /// Dry friction of joints.
        const JOINT_FRICTION = 1 << 2;
        /// Torsional friction of contacts.
        const TORSIONAL_FRICTION = 1 << 3;
        /// Rolling friction of contacts.
        const ROLLING_FRICTION = 1 << 4;
        /// Softness of contacts can be set.
        const CONTACT_STIFFNESS = 1 << 5;
        /// Position and velocity servos, and torque drives.
        const ACTUATORS = 1 << 6;
        /// A saved state continues to the bit.
        const EXACT_SNAPSHOT = 1 << 7;
        /// Wrenches on bodies during a rollout.
        const EXTERNAL_FORCES = 1 << 8;
        /// Parameters may change during a rollout.
        const PARAMETER_CHANGES = 1 << 9;
        /// Hooks before each physics step.
        const STEP_HOOKS = 1 << 10;
        /// Normal forces between two bodies can be recorded.
        const CONTACT_FORCES = 1 << 11;
        /// Computes in double precision.
        const DOUBLE_PRECISION = 1 << 12;
        /// Springs, dampers and rotor inertia of joints.
        const JOINT_IMPEDANCE = 1 << 13;
        /// Equality constraints (weld, connect).
        const EQUALITY = 1 << 14;
        /// Triangle meshes.
        const MESHES = 1 << 15;
        /// Free joints.
        const FREE_BODIES = 1 << 16;
        /// Ranges of joints.
        const JOINT_LIMITS = 1 << 17;
        /// Masses, centres of mass and inertia can be parameters.
        const MASS_PARAMETERS = 1 << 18;
        /// Anchors and axes of joints, and places of the bodies on them, can be parameters.
        const JOINT_ANCHORS = 1 << 19;
        /// A hook may change friction, damping and stiffness for a step.
        const LIVE_PARAMETERS = 1 << 20;
    }
}

/// An engine that loads scenes.
pub trait Backend: Send + Sync {
    /// Name on the command line, such as `mujoco`.
    fn name(&self) -> &str;

    /// Version of the engine.
    fn version(&self) -> String;

    /// Its capabilities.
    fn capabilities(&self) -> Capabilities;

    /// Compiles a scene.
    ///
    /// # Errors
    /// [`crate::Error::Scene`] when the engine refuses it or would ignore a part that changes the
    /// physics.
    fn load(&self, scene: &Scene) -> Result<Arc<dyn Model>>;
}

/// A scene compiled by an engine, from which batches are made.
pub trait Model: Send + Sync {
    /// Names and indices.
    fn layout(&self) -> &Layout;

    /// Name and version of the engine, for files that outlive the run; empty if unknown.
    fn engine(&self) -> String {
        String::new()
    }

    /// Whether actuators have a filter, a delay or another state that [`Simulator::displace`] keeps.
    ///
    /// False by default: the memory of a scene that has one is then lost where its state is set.
    fn remembers_commands(&self) -> bool {
        false
    }

    /// Value of a target in the unchanged scene.
    ///
    /// # Errors
    /// [`crate::Error::Parameter`] when the scene has no such target or the engine cannot change
    /// it.
    fn nominal(&self, target: &Target) -> Result<f64>;

    /// Makes a batch with every simulation reset and with nominal parameters.
    ///
    /// # Errors
    /// As [`Model::nominal`], for every target of the configuration.
    fn simulator(&self, config: &BatchConfig) -> Result<Box<dyn Simulator>>;
}
