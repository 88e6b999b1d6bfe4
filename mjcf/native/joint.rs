//! Writes joints: damping, dry friction, rotor inertia, springs, limits, axes and anchors.

use asid_core::Target;
use asid_core::error::Result;
use asid_core::layout::JointKind;
use roxmltree::Node;

use super::{NativeJoint, Spring, Writer};

/// Time constant of the dry friction constraint, in time steps: MuJoCo's shortest (`refsafe`).
///
/// At its default of 20 ms a joint that should stand still glides.
const FRICTION_TIME: f64 = 2.0;

/// The attribute that states a joint's stiffness and damping by a time constant and a ratio.
const SPRING_DAMPER: &str = "springdamper";

/// Whether a joint, or a class for joints, has its stiffness and damping from a time constant and a
/// ratio; `None` if it does not say.
fn spring_damper(node: Node<'_, '_>) -> Option<bool> {
    let text = node.attribute(SPRING_DAMPER);
    let numbers = text.filter(|_| node.has_tag_name("joint"))?;
    let mut numbers = numbers.split_whitespace().map(str::parse::<f64>);
    Some(numbers.all(|x| x.is_ok_and(|x| x > 0.0)))
}

impl Writer<'_, '_> {
    pub(super) fn write_joints(&mut self) -> Result<()> {
        for i in 0..self.native.plant.layout.joints.len() {
            let joint = self.native.plant.layout.joints[i].clone();
            let node = self.elements.joints[i];
            // A <freejoint> has no class for joints.
            let damped =
                node.has_tag_name("joint") && self.elements.said(node, spring_damper) == Some(true);
            if damped {
                // From it MuJoCo would compute other coefficients for each mass and armature, and
                // override those beside it.
                self.markup.set(node, SPRING_DAMPER, "0 0");
            }
            for attribute in ["damping", "stiffness", "armature"] {
                let mut values = self.entries("joint", &joint.name, attribute, 1)?;
                if values.is_none() && damped && attribute != "armature" {
                    let compiled = Target::new("joint", &joint.name, attribute, 0);
                    values = Some(vec![self.model.nominal(&compiled)?]);
                }
                if let Some(values) = values {
                    // Coefficients of higher order may follow the first.
                    let said = node.attribute(attribute).unwrap_or_default();
                    let rest = said.split_whitespace().skip(1);
                    let rest: Vec<f64> = rest.filter_map(|x| x.parse().ok()).collect();
                    self.markup
                        .set_numbers(node, attribute, &[values, rest].concat());
                }
            }
            for attribute in ["pos", "axis"] {
                if let Some(values) = self.entries("joint", &joint.name, attribute, 3)? {
                    self.write_place(&format!("joint `{}`", joint.name), node, attribute, &values);
                }
            }
            let unit = match joint.kind {
                JointKind::Hinge => self.elements.angle_unit(),
                _ => 1.0,
            };
            for (attribute, len) in [("range", 2), ("springref", 1)] {
                if let Some(values) = self.entries("joint", &joint.name, attribute, len)? {
                    let values: Vec<f64> = values.iter().map(|x| x * unit).collect();
                    self.markup.set_numbers(node, attribute, &values);
                }
            }
            let asked = self.native.joints.get(&i).cloned().unwrap_or_default();
            self.write_friction(&joint.name, node, &asked)?;
            if !asked.springs.is_empty() {
                self.write_springs(i, node, &asked.springs, unit)?;
            }
        }
        Ok(())
    }

    fn write_friction(
        &mut self,
        name: &str,
        node: Node<'_, '_>,
        asked: &NativeJoint,
    ) -> Result<()> {
        let own = self.entries("joint", name, "frictionloss", 1)?;
        if own.is_none() && asked.friction == 0.0 {
            return Ok(());
        }
        let now = self.value(&Target::new("joint", name, "frictionloss", 0))?;
        self.markup
            .set_numbers(node, "frictionloss", &[now + asked.friction]);
        if asked.friction > 0.0 && !node.has_attribute("solreffriction") {
            let time = FRICTION_TIME * self.native.plant.layout.timestep;
            self.markup
                .set_numbers(node, "solreffriction", &[time, 1.0]);
        }
        Ok(())
    }

    /// Where the spring of a joint rests, rad or m: by the engine, or by the document where the
    /// engine has no such target.
    fn rest(&self, i: usize, name: &str) -> Result<f64> {
        if let Ok(rest) = self.value(&Target::new("joint", name, "springref", 0)) {
            return Ok(rest);
        }
        let document = self.scene.description()?;
        let mut joints = document.bodies.iter().flat_map(|b| &b.body.joints);
        Ok(joints.nth(i).map_or(0.0, |joint| joint.springref))
    }

    /// One spring of several in parallel: stiffnesses add, and it rests at their weighted mean.
    fn write_springs(
        &mut self,
        i: usize,
        node: Node<'_, '_>,
        springs: &[Spring],
        unit: f64,
    ) -> Result<()> {
        let name = &*self.native.plant.layout.joints[i].name;
        let stiffness = self.value(&Target::new("joint", name, "stiffness", 0))?;
        let rest = self.rest(i, name)?;
        let own = Spring {
            stiffness,
            rest,
            cubic: 0.0,
        };
        let all: Vec<Spring> = [&[own], springs].concat();
        let total: f64 = all.iter().map(|s| s.stiffness).sum();
        let pull: f64 = all.iter().map(|s| s.stiffness * s.rest).sum();
        let cubic: Vec<&Spring> = all.iter().filter(|s| s.cubic != 0.0).collect();
        let rest = match (&cubic[..], total > 0.0) {
            ([], true) => pull / total,
            ([], false) => rest,
            ([one], _) => one.rest,
            _ => springs[0].rest,
        };
        let agree = all
            .iter()
            .all(|s| s.rest == rest || (s.stiffness == 0.0 && s.cubic == 0.0));
        if !cubic.is_empty() && !agree {
            self.leave_out(format!(
                "joint `{name}` has springs that rest in different places, one of them stiffening: MJCF has one \
                 spring a joint, and they are not written"
            ));
            return Ok(());
        }
        let cubic: f64 = cubic.iter().map(|s| s.cubic).sum();
        let numbers = if cubic == 0.0 {
            vec![total]
        } else {
            vec![total, 0.0, cubic]
        };
        self.markup.set_numbers(node, "stiffness", &numbers);
        self.markup.set_numbers(node, "springref", &[rest * unit]);
        Ok(())
    }
}
