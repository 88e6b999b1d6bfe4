//! Parameters of joints and of the actuators that drive them.

use asid_core::Result;
use asid_core::layout::{Joint, JointKind};
use mujoco_rs::mujoco_c::{mjtBias, mjtGain};

use super::resolver::Resolver;
use super::{Column, Domain};
use crate::field::Field;

impl Resolver<'_> {
    pub(super) fn joint(&self) -> Result<Column> {
        let joint = self.compiled.layout.joint(&self.target.name)?;
        match self.target.attribute.as_str() {
            "pos" => return self.anchor(joint),
            "axis" => return self.axis(joint),
            "range" => return self.range(joint),
            "springref" => return self.spring_reference(joint),
            _ => {}
        }
        self.index(1)?;
        let dofs = joint.qvel..joint.qvel + joint.kind.qvel_len();
        let model = self.model();
        let (field, nominal) = match self.target.attribute.as_str() {
            "damping" => (Field::DofDamping, model.dof_damping()[joint.qvel]),
            "frictionloss" => (Field::DofFrictionloss, model.dof_frictionloss()[joint.qvel]),
            "armature" => (Field::DofArmature, model.dof_armature()[joint.qvel]),
            "stiffness" => {
                let id = self.joint_id(joint);
                let entry = (Field::JntStiffness, id, 1.0);
                return Ok(self.column(
                    model.jnt_stiffness()[id],
                    Domain::NonNegative,
                    vec![entry],
                ));
            }
            _ => {
                return Err(self.no_attribute(
                    "pos, axis, range, damping, frictionloss, stiffness, springref, armature",
                ));
            }
        };
        let entries = dofs.map(|dof| (field, dof, 1.0)).collect();
        let mut column = self.column(nominal, Domain::NonNegative, entries);
        column.derives = field == Field::DofArmature;
        Ok(column)
    }

    fn joint_id(&self, joint: &Joint) -> usize {
        let joints = &self.compiled.layout.joints;
        joints
            .iter()
            .position(|j| j.name == joint.name)
            .unwrap_or(0)
    }

    /// The place of a hinge's axis.
    fn anchor(&self, joint: &Joint) -> Result<Column> {
        let axis = self.index(3)?;
        if joint.kind != JointKind::Hinge {
            return self.refuse("only the anchor of a hinge can be changed");
        }
        let id = self.joint_id(joint);
        let entry = (Field::JntPos, 3 * id + axis, 1.0);
        let mut column = self.column(self.model().jnt_pos()[id][axis], Domain::Any, vec![entry]);
        column.derives = true;
        Ok(column)
    }

    /// Only a hinge or a slide has some attributes.
    fn scalar(&self, joint: &Joint) -> Result<usize> {
        if matches!(joint.kind, JointKind::Hinge | JointKind::Slide) {
            return Ok(self.joint_id(joint));
        }
        self.refuse(&format!(
            "only the `{}` of a hinge or slide can be changed",
            self.target.attribute
        ))
    }

    /// A part of an axis, which is scaled to one when all parts are known.
    fn axis(&self, joint: &Joint) -> Result<Column> {
        let (id, i) = (self.scalar(joint)?, self.index(3)?);
        let mut column = self.column(self.model().jnt_axis()[id][i], Domain::Any, Vec::new());
        column.axis = Some((id, i));
        column.derives = true;
        Ok(column)
    }

    /// An end of a joint's range.
    fn range(&self, joint: &Joint) -> Result<Column> {
        let (id, i) = (self.scalar(joint)?, self.index(2)?);
        if !self.model().jnt_limited()[id] {
            return self.refuse("it would have no effect: the joint is not limited");
        }
        let entry = (Field::JntRange, 2 * id + i, 1.0);
        Ok(self.column(self.model().jnt_range()[id][i], Domain::Any, vec![entry]))
    }

    /// Where a joint's spring rests.
    fn spring_reference(&self, joint: &Joint) -> Result<Column> {
        self.scalar(joint)?;
        self.index(1)?;
        let nominal = self.model().qpos_spring()[joint.qpos];
        let entry = (Field::QposSpring, joint.qpos, 1.0);
        Ok(self.column(nominal, Domain::Any, vec![entry]))
    }

    /// An end of the range of an actuator's force.
    fn force_range(&self, actuator: usize) -> Result<Column> {
        let i = self.index(2)?;
        if !self.model().actuator_forcelimited()[actuator] {
            return self.refuse("it would have no effect: the actuator's force is not limited");
        }
        let entry = (Field::ActuatorForcerange, 2 * actuator + i, 1.0);
        let nominal = self.model().actuator_forcerange()[actuator][i];
        Ok(self.column(nominal, Domain::Any, vec![entry]))
    }

    pub(super) fn actuator(&self) -> Result<Column> {
        let actuator = self.compiled.layout.actuator(&self.target.name)?;
        let model = self.model();
        let (gains, biases) = (model.actuator_gainprm(), model.actuator_biasprm());
        let (gain, bias) = (gains[actuator], biases[actuator]);
        let (gain_at, bias_at) = (actuator * gain.len(), actuator * bias.len());
        let servo = model.actuator_gaintype()[actuator] == mjtGain::mjGAIN_FIXED
            && model.actuator_biastype()[actuator] == mjtBias::mjBIAS_AFFINE;
        // A position servo pulls with kp (ctrl - q) - kv dq, a velocity servo
        // with kv (ctrl - dq).
        let position = servo && bias[1] != 0.0 && gain[0] == -bias[1];
        let velocity = servo && bias[1] == 0.0 && bias[2] != 0.0 && gain[0] == -bias[2];
        let attribute = self.target.attribute.as_str();
        match attribute {
            "gear" => {
                let i = self.index(6)?;
                let entry = (Field::ActuatorGear, 6 * actuator + i, 1.0);
                let mut column =
                    self.column(model.actuator_gear()[actuator][i], Domain::Any, vec![entry]);
                column.derives = true;
                Ok(column)
            }
            "forcerange" => self.force_range(actuator),
            "kp" if position => {
                self.index(1)?;
                let entries = vec![
                    (Field::ActuatorGainprm, gain_at, 1.0),
                    (Field::ActuatorBiasprm, bias_at + 1, -1.0),
                ];
                Ok(self.column(gain[0], Domain::NonNegative, entries))
            }
            "kv" if position || velocity => {
                self.index(1)?;
                let mut entries = vec![(Field::ActuatorBiasprm, bias_at + 2, -1.0)];
                if velocity {
                    entries.push((Field::ActuatorGainprm, gain_at, 1.0));
                }
                Ok(self.column(-bias[2], Domain::NonNegative, entries))
            }
            "kp" | "kv" => self.refuse(&format!(
                "the actuator is no servo with a gain `{attribute}` above 0"
            )),
            _ => Err(self.no_attribute("kp, kv, gear, forcerange")),
        }
    }
}
