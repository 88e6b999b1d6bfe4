//! Writes actuators: gains, bias, delay, lag, and the limit of the force.
//!
//! MuJoCo has one actuator, of which `<motor>`, `<position>` and `<velocity>` are short forms. Its
//! force is `g w + b0 + b1 q + b2 v`, `w` the command after its range, its delay and its filter. A
//! scaled and shifted command, `gain u + bias`, becomes `g gain` and `b0 + g bias`. A short form
//! that can express all of it stays; else it becomes `<general>`.

use asid_core::Target;
use asid_core::error::Result;
use roxmltree::Node;

use super::elements::HISTORY_MARGIN;
use super::{NativeActuator, Writer};
use crate::markup::numbers;
use crate::memory::{self, time_constant};
use crate::plant::DriveLaw;

/// Attributes of short forms that `<general>` does not have.
const SHORT: [&str; 5] = ["kp", "kv", "dampratio", "timeconst", "inheritrange"];

impl Writer<'_, '_> {
    pub(super) fn write_actuators(&mut self) -> Result<()> {
        for i in 0..self.native.plant.layout.actuators.len() {
            let name = self.native.plant.layout.actuators[i].name.clone();
            let node = self.elements.actuators[i];
            if let Some(gear) = self.entries("actuator", &name, "gear", 1)? {
                let rest = node
                    .attribute("gear")
                    .unwrap_or_default()
                    .split_whitespace();
                let rest: Vec<f64> = rest.skip(1).filter_map(|x| x.parse().ok()).collect();
                self.markup
                    .set_numbers(node, "gear", &[gear, rest].concat());
            }
            if let Some(range) = self.entries("actuator", &name, "forcerange", 2)? {
                self.markup.set_numbers(node, "forcerange", &range);
            }
            self.write_gains(i, &name, node)?;
        }
        Ok(())
    }

    fn write_gains(&mut self, i: usize, name: &str, node: Node<'_, '_>) -> Result<()> {
        let mut asked = self.native.actuators.get(&i).cloned().unwrap_or_default();
        let drive = self.native.plant.drives[i];
        let kp = self.entries("actuator", name, "kp", 1)?.map(|v| v[0]);
        let mut kv = self.entries("actuator", name, "kv", 1)?.map(|v| v[0]);
        if kv.is_none() && self.elements.said(node, has_ratio) == Some(true) {
            // From a ratio MuJoCo would compute another damping for each gain, mass and armature.
            // The engine has no `kv` of an actuator that is no servo.
            let compiled = Target::new("actuator", name, "kv", 0);
            kv = self.model.nominal(&compiled).ok();
        }
        if asked == NativeActuator::default() && kp.is_none() && kv.is_none() {
            return Ok(());
        }
        let Some(drive) = drive else {
            self.write_servo(name, node, kp, kv);
            if asked.delay > 0.0 {
                self.write_delay(node, asked.delay);
            }
            if (asked.gain, asked.bias, asked.lag, asked.limit) != (1.0, 0.0, 0.0, None) {
                self.leave_out(format!(
                    "actuator `{name}` is no plain motor or servo: its gain, bias, lag and limit are not written"
                ));
            }
            return Ok(());
        };
        if asked.lag > 0.0 && self.filter(node).is_some() {
            self.leave_out(format!(
                "actuator `{name}` has a filter of its own, and MJCF has one per actuator: its added lag is not written"
            ));
            asked.lag = 0.0;
        }
        let gear = self.value(&Target::new("actuator", name, "gear", 0))?;
        let declared = self
            .model
            .nominal(&Target::new("actuator", name, "gear", 0))?;
        // Gain of the actuator, and slopes of its bias in position and speed.
        let (gain, slopes) = match drive.law {
            DriveLaw::Motor => (drive.gear / declared, None),
            DriveLaw::Position { .. } => {
                let kp = self.value(&Target::new("actuator", name, "kp", 0))?;
                // An engine has no `kv` of a servo without one.
                let kv = match kv {
                    Some(kv) => kv,
                    None => self
                        .model
                        .nominal(&Target::new("actuator", name, "kv", 0))?,
                };
                (kp, Some([-kp, -kv]))
            }
            DriveLaw::Velocity { .. } => {
                let kv = self.value(&Target::new("actuator", name, "kv", 0))?;
                (kv, Some([0.0, -kv]))
            }
        };
        let tag = node.tag_name().name();
        let plain =
            asked.gain == 1.0 && asked.bias == 0.0 && (asked.lag == 0.0 || tag == "position");
        match (tag, plain) {
            ("position", true) => {
                let [stiffness, damping] = slopes.unwrap_or_default();
                self.markup.set_numbers(node, "kp", &[-stiffness]);
                if kv.is_some() {
                    self.markup.remove(node, "dampratio");
                    self.markup.set_numbers(node, "kv", &[-damping]);
                }
                if asked.lag > 0.0 {
                    self.markup.set_numbers(node, "timeconst", &[asked.lag]);
                }
            }
            ("velocity", true) => self.markup.set_numbers(node, "kv", &[gain]),
            ("motor", true) => {}
            _ => self.write_general(i, node, gain, slopes, &asked),
        }
        if asked.delay > 0.0 {
            self.write_delay(node, asked.delay);
        }
        if let Some(limit) = asked.limit {
            let own = self.entries("actuator", name, "forcerange", 2)?;
            let own = own.map_or(drive.own_force_range(), |ends| Some([ends[0], ends[1]]));
            self.write_limit(node, limit / gear.abs(), own);
        }
        Ok(())
    }

    /// Writes the gains of a servo that is no plain drive, such as one of a tendon.
    fn write_servo(&mut self, name: &str, node: Node<'_, '_>, kp: Option<f64>, kv: Option<f64>) {
        if kp.is_none() && kv.is_none() {
            return;
        }
        let tag = node.tag_name().name();
        if !matches!(tag, "position" | "intvelocity" | "velocity") {
            self.leave_out(format!(
                "actuator `{name}` is no plain motor or servo: its gains kp and kv are not written"
            ));
            return;
        }
        if let Some(kp) = kp {
            self.markup.set_numbers(node, "kp", &[kp]);
        }
        if let Some(kv) = kv {
            self.markup.remove(node, "dampratio");
            self.markup.set_numbers(node, "kv", &[kv]);
        }
    }

    /// Writes the long form, with all numbers explicit.
    fn write_general(
        &mut self,
        i: usize,
        node: Node<'_, '_>,
        gain: f64,
        slopes: Option<[f64; 2]>,
        asked: &NativeActuator,
    ) {
        let filter = self.filter(node);
        for attribute in SHORT {
            self.markup.remove(node, attribute);
        }
        self.markup.rename(node, "general");
        self.markup.set(node, "gaintype", "fixed");
        self.markup
            .set_numbers(node, "gainprm", &[gain * asked.gain]);
        let [position, speed] = slopes.unwrap_or_default();
        self.markup.set(node, "biastype", "affine");
        self.markup
            .set_numbers(node, "biasprm", &[gain * asked.bias, position, speed]);
        if asked.lag > 0.0 {
            self.markup.set(node, "dyntype", "filterexact");
            self.markup.set_numbers(node, "dynprm", &[asked.lag]);
        } else if let Some((kind, numbers)) = filter {
            self.markup.set(node, "dyntype", kind);
            if let Some(numbers) = numbers {
                self.markup.set(node, "dynprm", numbers);
            }
        } else {
            self.markup.set(node, "dyntype", "none");
        }
        if let Some(range) = self.native.plant.layout.actuators[i].ctrl_range {
            self.markup.set_numbers(node, "ctrlrange", &range);
        }
    }

    /// The filter that the document gives an actuator: its `dyntype`, and `dynprm` if it is said.
    fn filter(&self, node: Node<'_, '_>) -> Option<(String, Option<String>)> {
        let kind = memory::filter(self.elements.root, node)?;
        let numbers = self.elements.said(node, |n| match time_constant(n) {
            Some(lag) if lag > 0.0 => Some(numbers(&[lag])),
            _ => n.attribute("dynprm").map(str::to_owned),
        });
        Some((kind, numbers))
    }

    /// Writes a delay in addition to the document's own.
    fn write_delay(&mut self, node: Node<'_, '_>, delay: f64) {
        let delay = memory::delay(self.elements.root, node) + delay;
        let samples = (delay / self.native.plant.layout.timestep).ceil() + HISTORY_MARGIN;
        self.markup.set_numbers(node, "delay", &[delay]);
        self.markup.set_numbers(node, "nsample", &[samples]);
        self.markup.set(node, "interp", "linear");
    }

    /// Writes the narrower of a drive's own limits and `limit`, both before the gear.
    fn write_limit(&mut self, node: Node<'_, '_>, limit: f64, has: Option<[f64; 2]>) {
        let [low, high] = has.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
        let range = [low.max(-limit), high.min(limit)];
        self.markup.set_numbers(node, "forcerange", &range);
        self.markup.set(node, "forcelimited", "true");
    }
}

/// Whether an actuator, or a class's, takes its damping from a ratio; `None` if it does not say.
///
/// In the long form a positive slope of the bias in the speed is such a ratio.
fn has_ratio(node: Node<'_, '_>) -> Option<bool> {
    if node.has_attribute("kv") {
        return Some(false);
    }
    let slope = || node.attribute("biasprm")?.split_whitespace().nth(2);
    let ratio = node.attribute("dampratio").or_else(slope)?;
    ratio.trim().parse::<f64>().ok().map(|ratio| ratio > 0.0)
}
