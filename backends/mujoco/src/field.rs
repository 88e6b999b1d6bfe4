//! Fields of `mjModel` that parameters change.

use std::ffi::CStr;

/// A field of `mjModel` that parameters change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[allow(missing_docs)]
pub enum Field {
    GeomFriction,
    GeomPos,
    GeomSolref,
    BodyPos,
    BodyMass,
    BodyIpos,
    BodyIquat,
    BodyInertia,
    DofDamping,
    DofFrictionloss,
    DofArmature,
    JntPos,
    JntStiffness,
    JntAxis,
    JntRange,
    QposSpring,
    ActuatorGainprm,
    ActuatorBiasprm,
    ActuatorGear,
    ActuatorForcerange,
    Gravity,
}

impl Field {
    /// MuJoCo's name of the field.
    #[must_use]
    pub fn name(self) -> &'static CStr {
        match self {
            Self::GeomFriction => c"geom_friction",
            Self::GeomPos => c"geom_pos",
            Self::GeomSolref => c"geom_solref",
            Self::BodyPos => c"body_pos",
            Self::BodyMass => c"body_mass",
            Self::BodyIpos => c"body_ipos",
            Self::BodyIquat => c"body_iquat",
            Self::BodyInertia => c"body_inertia",
            Self::DofDamping => c"dof_damping",
            Self::DofFrictionloss => c"dof_frictionloss",
            Self::DofArmature => c"dof_armature",
            Self::JntPos => c"jnt_pos",
            Self::JntStiffness => c"jnt_stiffness",
            Self::JntAxis => c"jnt_axis",
            Self::JntRange => c"jnt_range",
            Self::QposSpring => c"qpos_spring",
            Self::ActuatorGainprm => c"actuator_gainprm",
            Self::ActuatorBiasprm => c"actuator_biasprm",
            Self::ActuatorGear => c"actuator_gear",
            Self::ActuatorForcerange => c"actuator_forcerange",
            Self::Gravity => c"opt.gravity",
        }
    }
}
