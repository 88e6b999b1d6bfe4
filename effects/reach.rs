//! What an effect moves directly, before the machine passes the motion on.
//!
//! Two effects that reach different joints, or different sensors, can be tried in one simulation
//! and told apart afterwards, like the columns of a sparse Jacobian (Curtis, Powell, Reid 1974).

use std::collections::BTreeSet;

use asid_core::layout::JointKind;
use asid_core::target::Target;
use asid_mjcf::plant::Plant;

use crate::acts::Acts;

/// What an effect moves directly.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Reach {
    /// Possibly anything.
    Everything,
    /// Generalised forces on these degrees of freedom (indices in `qvel`), and nothing else.
    Dofs(BTreeSet<usize>),
    /// The reading of one sensor, by index in the layout.
    Sensor(usize),
}

impl Reach {
    /// Reach of an effect that acts on its site's sensor or drive alone, or on what its targets
    /// name.
    #[must_use]
    pub fn of(plant: &Plant, acts: Acts, site: &str, targets: &[Target]) -> Self {
        let layout = &plant.layout;
        let named = match acts {
            Acts::Measurement => {
                let sensor = layout.sensors.iter().position(|s| s.name == site);
                return sensor.map_or(Self::Everything, Self::Sensor);
            }
            Acts::Command => drive_dofs(plant, site),
            Acts::Model | Acts::Force if targets.is_empty() => None,
            Acts::Model | Acts::Force => Some(BTreeSet::new()),
        };
        let join = |all: BTreeSet<usize>, target: &Target| {
            target_dofs(plant, target).map(|own| all.union(&own).copied().collect())
        };
        let dofs = named.and_then(|named| targets.iter().try_fold(named, join));
        dofs.map_or(Self::Everything, Self::Dofs)
    }

    /// Reach of a force on a body: the joints that carry it.
    #[must_use]
    pub fn of_body(plant: &Plant, name: &str) -> Self {
        let body = plant.layout.bodies.iter().position(|b| b == name);
        body.map_or(Self::Everything, |b| Self::Dofs(body_dofs(plant, b)))
    }

    /// Whether the effects of the two can be told apart within one simulation.
    #[must_use]
    pub fn is_apart_from(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Dofs(a), Self::Dofs(b)) => a.is_disjoint(b),
            (Self::Sensor(a), Self::Sensor(b)) => a != b,
            _ => false,
        }
    }
}

/// Degrees of freedom of a joint.
fn joint_dofs(plant: &Plant, joint: usize) -> BTreeSet<usize> {
    let joint = &plant.layout.joints[joint];
    let count = match joint.kind {
        JointKind::Free => 6,
        JointKind::Ball => 3,
        JointKind::Hinge | JointKind::Slide => 1,
    };
    (joint.qvel..joint.qvel + count).collect()
}

/// Degrees of freedom that an actuator drives; `None` where it is no plain drive of a joint.
fn drive_dofs(plant: &Plant, actuator: &str) -> Option<BTreeSet<usize>> {
    let actuators = &plant.layout.actuators;
    let place = actuators.iter().position(|a| a.name == actuator)?;
    let drive = plant.drives[place].as_ref()?;
    Some(joint_dofs(plant, drive.joint))
}

/// Degrees of freedom that carry a body.
fn body_dofs(plant: &Plant, body: usize) -> BTreeSet<usize> {
    let mut body = body;
    let mut dofs = BTreeSet::new();
    while body != 0 {
        let joints = plant.bodies[body].joints.clone();
        joints.for_each(|joint| dofs.extend(joint_dofs(plant, joint)));
        body = plant.bodies[body].parent;
    }
    dofs
}

/// Degrees of freedom on which a target's value causes forces; `None` where unknown.
///
/// For a body's mass these are all joints that carry it.
fn target_dofs(plant: &Plant, target: &Target) -> Option<BTreeSet<usize>> {
    let layout = &plant.layout;
    match &*target.element {
        "actuator" => drive_dofs(plant, &target.name),
        "joint" => {
            let joint = layout.joints.iter().position(|j| j.name == target.name)?;
            let own = [
                "damping",
                "frictionloss",
                "stiffness",
                "armature",
                "springref",
            ];
            own.contains(&&*target.attribute)
                .then(|| joint_dofs(plant, joint))
        }
        "body" if ["mass", "ipos", "inertia"].contains(&&*target.attribute) => {
            let body = layout.bodies.iter().position(|b| *b == target.name)?;
            Some(body_dofs(plant, body))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use asid_core::Scene;
    use asid_core::registry::all;

    use super::*;
    use crate::EffectEntry;

    const ARM: &str = r#"<mujoco><worldbody>
        <body name="upper"><joint name="shoulder" type="hinge"/><geom name="u" size="0.1" mass="1"/>
          <body name="lower"><joint name="elbow" type="hinge"/><geom name="l" size="0.1" mass="1"/></body></body>
        <body name="box"><freejoint name="box"/><geom name="b" size="0.1" mass="1"/></body></worldbody>
        <actuator><motor name="elbow" joint="shoulder"/></actuator>
        <sensor><jointpos name="angle" joint="elbow"/></sensor></mujoco>"#;

    fn reach(name: &str, site: &str) -> Reach {
        let plant = Plant::of(&Scene::from_xml("arm", ARM, &[]).unwrap()).unwrap();
        let entry = all::<EffectEntry>()
            .into_iter()
            .find(|e| e.name == name)
            .unwrap();
        (entry.make)().reach(&plant, site)
    }

    #[test]
    fn a_mass_is_felt_at_the_joints_that_carry_it_and_at_no_other() {
        assert_eq!(reach("mass", "upper"), Reach::Dofs([0].into()));
        assert_eq!(reach("mass", "lower"), Reach::Dofs([0, 1].into()));
        assert_eq!(reach("mass", "box"), Reach::Dofs((2..8).collect()));
        assert_eq!(reach("linear-drag", "lower"), Reach::Dofs([0, 1].into()));
        assert!(reach("mass", "lower").is_apart_from(&reach("mass", "box")));
        assert!(!reach("mass", "lower").is_apart_from(&reach("mass", "upper")));
    }

    #[test]
    fn an_effect_on_a_drive_reaches_its_joint_whatever_the_drive_is_called() {
        assert_eq!(reach("actuator-gain", "elbow"), Reach::Dofs([0].into()));
        assert_eq!(reach("viscous-friction", "elbow"), Reach::Dofs([1].into()));
        assert_eq!(reach("sensor-delay", "angle"), Reach::Sensor(0));
    }

    #[test]
    fn what_is_felt_everywhere_or_says_nothing_of_itself_is_apart_from_nothing() {
        assert_eq!(reach("gravity-tilt", ""), Reach::Everything);
        assert_eq!(reach("sliding-friction", "b"), Reach::Everything);
        assert!(!Reach::Everything.is_apart_from(&Reach::Sensor(0)));
        assert!(!Reach::Sensor(0).is_apart_from(&Reach::Dofs([0].into())));
    }
}
