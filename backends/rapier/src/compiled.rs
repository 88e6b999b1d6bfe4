//! A compiled scene: rapier's collections, with the handles and indices of all elements.

use asid_core::layout::Layout;
use rapier3d::dynamics::{IntegrationParameters, MassProperties, RigidBody, RigidBodyHandle};
use rapier3d::geometry::{ColliderHandle, ColliderSet};

use crate::convert;
use crate::pairs::PairTable;
use crate::sensor::SensorSlot;
use crate::slot::{ActuatorSlot, Frame, JointSlot};
use crate::state::State;
use crate::structure::{Inertia, MassModel};
use crate::tables::Tables;

/// A compiled scene, shared by all its batches.
pub struct Compiled {
    /// Name of the scene, for messages.
    pub scene: String,
    /// Names and indices.
    pub layout: Layout,
    /// Contact rules.
    pub pairs: PairTable,
    /// How masses are determined.
    pub masses: MassModel,
    /// The world as built, before any step.
    pub pristine: State,
    /// Rigid body of each body; `None` for a world to which nothing refers.
    pub bodies: Vec<Option<RigidBodyHandle>>,
    /// Whether each body is a moving link of an articulated tree.
    pub links: Vec<bool>,
    /// Whether each body belongs to an articulated tree, including fixed roots.
    pub trees: Vec<bool>,
    /// The moving links with shapes that can touch something.
    pub touching_links: Vec<usize>,
    /// Free bodies that carry joints: the roots of floating trees.
    pub floating: Vec<usize>,
    /// Body of each geom.
    pub body_of_geom: Vec<usize>,
    /// Frame of each geom.
    pub geom_frames: Vec<Frame>,
    /// Shape of each geom that takes part in contact.
    pub colliders: Vec<Option<ColliderHandle>>,
    /// Joints, in the order of the layout.
    pub joints: Vec<JointSlot>,
    /// Actuators, in the order of the layout.
    pub actuators: Vec<ActuatorSlot>,
    /// Sensors, in the order of the layout.
    pub sensors: Vec<SensorSlot>,
    /// Parameters as in the document.
    pub nominal: Tables,
    /// Solver settings.
    pub integration: IntegrationParameters,
    /// State after a reset: `qpos` and `qvel`.
    pub start: (Vec<f64>, Vec<f64>),
}

/// Gives a body its mass properties.
pub fn set_inertia(body: &mut RigidBody, colliders: &ColliderSet, inertia: &Inertia) {
    let properties = MassProperties::with_principal_inertia_frame(
        convert::to_vector(&inertia.center),
        inertia.mass as f32,
        convert::to_vector(&inertia.moments),
        convert::to_rotation(&inertia.axes),
    );
    // A body with equal moments has no gyroscopic torque; rapier would add its rounding error.
    let [a, b, c] = inertia.moments.into();
    let spread = (a - b).abs().max((b - c).abs());
    body.enable_gyroscopic_forces(spread > 1e-6 * inertia.moments.amax());
    body.set_additional_mass_properties(properties, false);
    body.recompute_mass_properties_from_colliders(colliders);
}
