//! Writes play and elasticity between a drive and its joint as two joints in MJCF.
//!
//! The joint that the drive acts on keeps its name and becomes the rotor's. A second joint follows,
//! in the same body and about the same axis: the link's against the rotor. It is free within a
//! `range` as wide as the gap, or held by a spring with its damper. Properties of the sum of the
//! two (damping, dry friction, the joint's own spring and range, its sensors) move to a fixed
//! tendon over both.

use asid_core::Target;
use asid_core::error::Result;
use asid_core::layout::JointKind;
use roxmltree::Node;

use super::frame::is_framed;
use super::{Series, Writer};
use crate::markup::{escaped, numbers};
use crate::plant::DriveLaw;

/// Time constant of the ends of a gap, in time steps: the shortest that MuJoCo takes (`refsafe`).
const END_TIME: f64 = 2.0;

impl Writer<'_, '_> {
    pub(super) fn write_transmissions(&mut self) -> Result<()> {
        let mut tendons = String::new();
        for (&i, joint) in &self.native.joints {
            if let Some(series) = joint.series {
                tendons += &self.write_series(i, series)?;
            }
        }
        if !tendons.is_empty() {
            let root = self.elements.root;
            self.markup
                .append(root, &format!("  <tendon>\n{tendons}  </tendon>\n"));
        }
        Ok(())
    }

    /// Splits a joint in two, and returns the tendon over both.
    fn write_series(&mut self, i: usize, series: Series) -> Result<String> {
        let joint = self.native.plant.layout.joints[i].clone();
        let node = self.elements.joints[i];
        let name = joint.name.clone();
        let Some((actuator, drive)) = self.native.plant.drives_of(i).next().map(|(a, d)| (a, *d))
        else {
            return Ok(String::new());
        };
        if is_framed(node) {
            self.leave_out(format!(
                "joint `{name}` lies in a <frame>: the play or elasticity between it and its drive is not written"
            ));
            return Ok(String::new());
        }
        if self.is_coupled(&name) {
            self.leave_out(format!(
                "joint `{name}` is coupled by an <equality>: the document couples the drive's side of its play or \
                 elasticity, and the model couples the link"
            ));
        }
        let label = self.native.plant.layout.actuators[actuator].name.clone();
        let timestep = self.native.plant.layout.timestep;
        let get = |w: &Self, attribute: &str| w.value(&Target::new("joint", &name, attribute, 0));
        let (damping, friction) = (get(self, "damping")?, get(self, "frictionloss")?);
        let friction = friction + self.native.joints.get(&i).map_or(0.0, |j| j.friction);
        let value = |w: &Self, gain: &str| w.value(&Target::new("actuator", &label, gain, 0));
        let (kp, kv) = match drive.law {
            DriveLaw::Position { .. } => (value(self, "kp")?, value(self, "kv")?),
            DriveLaw::Velocity { .. } => (0.0, value(self, "kv")?),
            DriveLaw::Motor => (0.0, 0.0),
        };
        let gear = Target::new("actuator", &label, "gear", 0);
        let drive = drive.with("gear", 0, [self.model.nominal(&gear)?, self.value(&gear)?]);
        let square = drive.gear * drive.gear;
        let rotor = get(self, "armature")?;
        let mut inertia = rotor;
        if inertia <= 0.0 {
            // A rotor without inertia follows its servo's law; this inertia makes it lag by one
            // step.
            inertia = square * timestep * (kv + kp * timestep);
            self.leave_out(format!(
                "joint `{name}` has no rotor inertia: {inertia:.3e} is written in its place, which lags the servo by a step"
            ));
        }
        let spring = self.move_spring(i, &name)?;
        self.markup.set(node, "damping", "0");
        self.markup.set(node, "frictionloss", "0");
        self.markup.set_numbers(node, "armature", &[inertia]);
        self.markup.set(node, "name", name.clone());
        let unit = match joint.kind {
            JointKind::Hinge => self.elements.angle_unit(),
            _ => 1.0,
        };
        let plant = &self.native.plant.joints[i];
        let kind = if joint.kind == JointKind::Hinge {
            "hinge"
        } else {
            "slide"
        };
        let hold = if series.compliance > 0.0 {
            let stiffness = 1.0 / series.compliance;
            let damping = 2.0 * series.loss * (rotor * stiffness).sqrt();
            format!(
                "limited=\"false\" stiffness=\"{stiffness}\" springref=\"0\" damping=\"{damping}\""
            )
        } else {
            let half = series.gap / 2.0 * unit;
            let time = END_TIME * timestep;
            format!(
                "limited=\"true\" range=\"{}\" solreflimit=\"{time} 1\" stiffness=\"0\" springref=\"0\" damping=\"0\"",
                numbers(&[-half, half])
            )
        };
        let written = escaped(&name);
        self.markup.after(
            node,
            &format!(
                "<joint name=\"{written}_link\" type=\"{kind}\" pos=\"{}\" axis=\"{}\" ref=\"0\" armature=\"0\" \
                 frictionloss=\"0\" {hold}/>",
                numbers(&plant.anchor),
                numbers(&plant.axis)
            ),
        );
        let limits = self.move_range(i, &name);
        self.move_sensors(i, node, &name);
        self.widen_keyframes(joint.qpos, joint.qvel);
        let friction = if friction > 0.0 {
            format!(
                " frictionloss=\"{friction}\" solreffriction=\"{} 1\"",
                END_TIME * timestep
            )
        } else {
            String::new()
        };
        Ok(format!(
            "    <fixed name=\"{written}_whole\" damping=\"{damping}\"{spring}{friction}{limits}>\
             <joint joint=\"{written}\" coef=\"1\"/><joint joint=\"{written}_link\" coef=\"1\"/></fixed>\n"
        ))
    }

    /// Whether an equality constraint couples a joint.
    fn is_coupled(&self, name: &str) -> bool {
        let sections = self.elements.root.children();
        let sections = sections.filter(|n| n.has_tag_name("equality"));
        let mut couplings = sections
            .flat_map(|s| s.children())
            .filter(|n| n.has_tag_name("joint"));
        couplings.any(|n| {
            ["joint1", "joint2"]
                .iter()
                .any(|end| n.attribute(*end) == Some(name))
        })
    }

    /// Moves the spring of the joint to the tendon, so that it acts on the link; returns the
    /// tendon's attribute.
    ///
    /// MuJoCo rests the spring of a tendon where the springs of its joints rest, so the joint keeps
    /// its `springref`.
    fn move_spring(&mut self, i: usize, name: &str) -> Result<String> {
        let node = self.elements.joints[i];
        let stiffness = match self.markup.get(node, "stiffness") {
            Some(text) => text,
            None => numbers(&[self.value(&Target::new("joint", name, "stiffness", 0))?]),
        };
        let mut coefficients = stiffness.split_whitespace();
        if coefficients.all(|x| x.parse::<f64>().is_ok_and(|x| x == 0.0)) {
            return Ok(String::new());
        }
        self.markup.set(node, "stiffness", "0");
        Ok(format!(" stiffness=\"{stiffness}\""))
    }

    /// Moves the range of the joint to the tendon; returns the tendon's attributes.
    fn move_range(&mut self, i: usize, name: &str) -> String {
        let limits: Result<Vec<f64>> = (0..2)
            .map(|k| self.value(&Target::new("joint", name, "range", k)))
            .collect();
        // An engine has no range of an unlimited joint, and may have none of any.
        let stated = self.native.plant.joints[i].range;
        let Some(range) = limits.ok().or(stated.map(Vec::from)) else {
            return String::new();
        };
        self.markup.set(self.elements.joints[i], "limited", "false");
        format!(" limited=\"true\" range=\"{}\"", numbers(&range))
    }

    /// Makes sensors of the joint read the tendon.
    fn move_sensors(&mut self, joint: usize, joint_node: Node<'_, '_>, name: &str) {
        let own = joint_node.attribute("name").unwrap_or(name);
        for (i, sensor) in self.native.plant.layout.sensors.iter().enumerate() {
            let node = self.elements.sensors[i];
            let reads = self.native.plant.sensors[i] == crate::plant::Reads::Joint(joint)
                && node.attribute("joint") == Some(own);
            let tag = match &*sensor.kind {
                "jointpos" => "tendonpos",
                "jointvel" => "tendonvel",
                _ => continue,
            };
            if reads {
                self.markup.rename(node, tag);
                self.markup.remove(node, "joint");
                self.markup.set(node, "tendon", format!("{name}_whole"));
            }
        }
    }

    /// Inserts a coordinate of the link into the keyframes, at the middle of its gap.
    fn widen_keyframes(&mut self, qpos: usize, qvel: usize) {
        let sections = self
            .elements
            .root
            .children()
            .filter(|n| n.has_tag_name("keyframe"));
        let keys: Vec<Node<'_, '_>> = sections
            .flat_map(|s| s.children())
            .filter(|n| n.has_tag_name("key"))
            .collect();
        let before = |at: usize, of: fn(&asid_core::layout::Joint) -> usize| {
            let earlier = self
                .native
                .joints
                .iter()
                .filter(|(_, j)| j.series.is_some());
            let joints = &self.native.plant.layout.joints;
            earlier.filter(|(k, _)| of(&joints[**k]) < at).count()
        };
        let places = [
            ("qpos", qpos + before(qpos, |j| j.qpos)),
            ("qvel", qvel + before(qvel, |j| j.qvel)),
        ];
        for key in keys {
            for (attribute, at) in places {
                let Some(text) = self.markup.get(key, attribute) else {
                    continue;
                };
                let mut values: Vec<&str> = text.split_whitespace().collect();
                if at < values.len() {
                    values.insert(at + 1, "0");
                    self.markup.set(key, attribute, values.join(" "));
                }
            }
        }
    }
}
