//! Drives: actuators whose force on a hinge or slide follows a simple law of their command.

use mjcf_rs::extras::{Actuator, ActuatorKind};

/// How an actuator turns its command into a force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DriveLaw {
    /// The command is the force.
    Motor,
    /// A position servo: `kp (command - position) - kv speed`.
    Position {
        /// Position gain, N/m or N m/rad.
        kp: f64,
        /// Damping, N s/m or N m s/rad.
        kv: f64,
    },
    /// A velocity servo: `kv (command - speed)`.
    Velocity {
        /// Gain, N s/m or N m s/rad.
        kv: f64,
    },
}

/// An actuator on a hinge or slide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive {
    /// Index in [`Layout::joints`](asid_core::layout::Layout::joints).
    pub joint: usize,
    /// Its law, before the gear.
    pub law: DriveLaw,
    /// Ratio of the joint's force to the actuator's; includes a motor's gain.
    pub gear: f64,
    /// Limits of the command.
    pub ctrl_range: Option<[f64; 2]>,
    /// Limits of the force, before the gear: its own, within those of its joint.
    pub force_range: Option<[f64; 2]>,
    /// Whether the document gives it a filter or a delay: its force then follows from earlier
    /// commands too, which [`Drive::force`] does not know.
    pub remembers: bool,
    /// What its limits follow from.
    pub(super) limits: Limits,
}

/// The limits of a drive's force as the document states them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Limits {
    /// A motor's gain, which the gear of the drive includes; 1 for servos.
    pub(super) gain: f64,
    /// The actuator's own (`forcerange`), after that gain and before the gear, N or N m.
    pub(super) own: Option<[f64; 2]>,
    /// Those of its joint (`actuatorfrcrange`), N or N m.
    pub(super) joint: Option<[f64; 2]>,
}

impl Limits {
    /// Both limits, before the gain and the gear.
    pub(super) fn before(&self, gear: f64) -> Option<[f64; 2]> {
        let over = |[low, high]: [f64; 2], factor: f64| match factor < 0.0 {
            true => [high / factor, low / factor],
            false => [low / factor, high / factor],
        };
        let own = self.own.map(|range| over(range, self.gain));
        let joint = self.joint.filter(|_| gear != 0.0);
        match (own, joint.map(|range| over(range, gear))) {
            (Some(own), Some([low, high])) => Some(own.map(|end| end.max(low).min(high))),
            (own, joint) => own.or(joint),
        }
    }
}

/// A limit of a drive's force that falls with the speed of its joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceLimit {
    /// Largest force on the joint at rest, gear included, N or N m.
    pub force: f64,
    /// Speed of the joint at which nothing is left of it, m/s or rad/s; infinite for a limit that
    /// does not fall.
    pub speed: f64,
}

impl ForceLimit {
    /// The largest force at a speed.
    #[must_use]
    pub fn at(&self, speed: f64) -> f64 {
        self.force * (1.0 - speed.abs() / self.speed).max(0.0)
    }
}

impl Drive {
    /// Force on the joint (N or N m) for a command, at a position and speed of the joint.
    #[must_use]
    pub fn force(&self, command: f64, position: f64, speed: f64) -> f64 {
        let command = within(command, self.ctrl_range);
        let (q, v) = (self.gear * position, self.gear * speed);
        let force = match self.law {
            DriveLaw::Motor => command,
            DriveLaw::Position { kp, kv } => kp * (command - q) - kv * v,
            DriveLaw::Velocity { kv } => kv * (command - v),
        };
        self.gear * within(force, self.force_range)
    }

    /// The command that makes the drive ask for a force on the joint (N or N m), before any limit.
    ///
    /// `None` where no command can.
    #[must_use]
    pub fn command_for(&self, force: f64, position: f64, speed: f64) -> Option<f64> {
        let (q, v) = (self.gear * position, self.gear * speed);
        let force = force / self.gear;
        let command = match self.law {
            DriveLaw::Motor => force,
            DriveLaw::Position { kp, kv } => q + (force + kv * v) / kp,
            DriveLaw::Velocity { kv } => v + force / kv,
        };
        command.is_finite().then_some(command)
    }

    /// The same drive with another value of a target of its actuator.
    ///
    /// Targets are `kp`, `kv`, `gear` and `forcerange`; `nominal` is the value in the document.
    /// Other attributes leave the drive unchanged.
    #[must_use]
    pub fn with(mut self, attribute: &str, index: usize, [nominal, value]: [f64; 2]) -> Self {
        match (attribute, &mut self.law) {
            ("kp", DriveLaw::Position { kp, .. }) => *kp = value,
            ("kv", DriveLaw::Position { kv, .. } | DriveLaw::Velocity { kv }) => *kv = value,
            ("gear", _) if index == 0 && nominal != 0.0 => self.gear *= value / nominal,
            ("forcerange", _) => {
                if let Some(end) = self.limits.own.as_mut().and_then(|r| r.get_mut(index)) {
                    *end = value;
                }
            }
            _ => {}
        }
        self.force_range = self.limits.before(self.gear);
        self
    }

    /// The limits of its actuator's own force (`forcerange`), N or N m before the gear.
    #[must_use]
    pub fn own_force_range(&self) -> Option<[f64; 2]> {
        self.limits.own
    }

    /// Whether its force follows from the present command, position and speed alone.
    #[must_use]
    pub fn is_memoryless(&self) -> bool {
        !self.remembers
    }

    /// Whether it is a position servo.
    #[must_use]
    pub fn is_position_servo(&self) -> bool {
        matches!(self.law, DriveLaw::Position { .. })
    }
}

/// Clips a number to a range as MuJoCo does (`mju_clip`).
///
/// If an unknown moves one end of the range past the other, the lower end counts first.
/// `f64::clamp` panics there.
fn within(x: f64, range: Option<[f64; 2]>) -> f64 {
    match range {
        Some([low, _]) if x < low => low,
        Some([_, high]) if x > high => high,
        _ => x,
    }
}

/// The law of an actuator, and the factor of its gain in the gear; `None` for other laws.
///
/// MuJoCo has one actuator, of which `<motor>`, `<position>` and `<velocity>` are short forms. Its
/// force is `gain u + b0 + b1 q + b2 v`, with `u` the command or what its filter makes of it. A
/// `<general>` one with no other state is
///
/// - a motor where the bias is none,
/// - a position servo where `b1 = -gain` and `b0 = 0`, with `kp = gain` and `kv = -b2`,
/// - a velocity servo where `b2 = -gain` and `b0 = b1 = 0`, with `kv = gain`,
///
/// and no plain drive otherwise. A servo without gain is no plain drive either. A default class for
/// `<general>` may set what a short form leaves out. `None` too where the actuator remembers more
/// than a first-order filter of its command.
#[must_use]
pub fn law(actuator: &Actuator) -> Option<(DriveLaw, f64)> {
    let gain = actuator.gainprm.first().copied().unwrap_or(1.0);
    let bias: [f64; 3] = std::array::from_fn(|i| actuator.biasprm.get(i).copied().unwrap_or(0.0));
    // A positive `b2` is a damping ratio: the engine computes the gain, and effects read it there.
    let damping = (-bias[2]).max(0.0);
    let is = |kind: &Option<String>, name: &str, default: bool| {
        kind.as_deref().map_or(default, |k| k == name)
    };
    let servo = |kp: f64, kv: f64| (kp > 0.0).then_some((DriveLaw::Position { kp, kv }, 1.0));
    let speed = |kv: f64| (kv > 0.0).then_some((DriveLaw::Velocity { kv }, 1.0));
    match actuator.kind {
        ActuatorKind::Motor => Some((DriveLaw::Motor, 1.0)),
        ActuatorKind::Position => {
            servo(actuator.kp.unwrap_or(gain), actuator.kv.unwrap_or(damping))
        }
        ActuatorKind::Velocity => speed(actuator.kv.unwrap_or(gain)),
        ActuatorKind::General => {
            let plain = is(&actuator.gain_type, "fixed", true)
                && ["none", "filter", "filterexact"]
                    .iter()
                    .any(|kind| is(&actuator.dyn_type, kind, *kind == "none"))
                && gain != 0.0;
            let affine = is(&actuator.bias_type, "affine", false);
            if !plain || !(affine || is(&actuator.bias_type, "none", true)) {
                return None;
            }
            match bias {
                _ if !affine => Some((DriveLaw::Motor, gain)),
                [0.0, 0.0, 0.0] => Some((DriveLaw::Motor, gain)),
                [0.0, stiffness, _] if stiffness == -gain => servo(gain, damping),
                [0.0, 0.0, slope] if slope == -gain => speed(gain),
                _ => None,
            }
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Plant;
    use asid_core::scene::Scene;

    /// The drive of one actuator on a hinge.
    fn drive(defaults: &str, actuator: &str) -> Option<Drive> {
        let xml = format!(
            r#"<mujoco><default>{defaults}</default><worldbody><body><joint name="j"/><geom size="0.1"/></body></worldbody>
            <actuator>{actuator}</actuator></mujoco>"#
        );
        let scene = Scene::from_xml("drive", &xml, &[]).unwrap();
        Plant::of(&scene).unwrap().drives[0]
    }

    #[test]
    fn general_actuators_are_known_by_their_gains() {
        let position = |kp, kv| Some(DriveLaw::Position { kp, kv });
        for (prm, law) in [
            (
                r#"gainprm="40" biastype="affine" biasprm="0 -40 -3""#,
                position(40.0, 3.0),
            ),
            (
                r#"gainprm="40" biastype="affine" biasprm="0 -40""#,
                position(40.0, 0.0),
            ),
            (
                r#"gainprm="7" biastype="affine" biasprm="0 0 -7""#,
                Some(DriveLaw::Velocity { kv: 7.0 }),
            ),
            (r#"gainprm="7""#, Some(DriveLaw::Motor)),
            // Without `biastype` the bias does not count.
            (r#"gainprm="7" biasprm="0 -7 -1""#, Some(DriveLaw::Motor)),
            (r#"gainprm="40" biastype="affine" biasprm="0 -30 -3""#, None),
            (r#"gainprm="40" biastype="affine" biasprm="1 -40 -3""#, None),
            (r#"gainprm="40" gaintype="affine""#, None),
            (r#"gainprm="40" dyntype="integrator""#, None),
            (r#"gainprm="0""#, None),
        ] {
            let found = drive("", &format!(r#"<general joint="j" {prm}/>"#));
            assert_eq!(found.map(|d| d.law), law, "{prm}");
        }
    }

    #[test]
    fn classes_give_gains_to_general_actuators_and_to_short_forms() {
        let class =
            r#"<general biastype="affine" gainprm="50" biasprm="0 -50 -4" forcerange="-9 9"/>"#;
        for actuator in [r#"<general joint="j"/>"#, r#"<position joint="j"/>"#] {
            let found = drive(class, actuator).unwrap();
            assert_eq!(found.law, DriveLaw::Position { kp: 50.0, kv: 4.0 });
            assert_eq!(found.force_range, Some([-9.0, 9.0]));
        }
    }

    /// Symptom: a panic of `asid explore` with `--unknown actuator/A/forcerange/0:-1:8` and an
    /// upper end of 5.
    ///
    /// Cause: `f64::clamp`.
    #[test]
    fn limits_of_a_force_that_cross_each_other_make_no_panic() {
        let motor = drive("", r#"<motor joint="j" forcerange="-5 5"/>"#).unwrap();
        let crossed = motor.with("forcerange", 0, [-5.0, 8.0]);
        assert_eq!(crossed.force_range, Some([8.0, 5.0]));
        assert_eq!(crossed.force(3.0, 0.0, 0.0), 8.0);
        assert_eq!(crossed.force(9.0, 0.0, 0.0), 5.0);
        assert!(crossed.force(f64::NAN, 0.0, 0.0).is_nan());
    }

    /// A motor's command is the force before its gain; its limits hold after the gain.
    #[test]
    fn the_gain_of_a_motor_counts_as_gear() {
        let motor = drive(
            "",
            r#"<general joint="j" gainprm="-5" gear="2" forcerange="-10 20"/>"#,
        );
        let motor = motor.unwrap();
        assert_eq!(motor.force(1.0, 0.0, 0.0), -10.0);
        assert_eq!(motor.force(100.0, 0.0, 0.0), -20.0);
        assert_eq!(motor.force(-100.0, 0.0, 0.0), 40.0);
        assert_eq!(motor.command_for(-10.0, 0.0, 0.0), Some(1.0));
    }
}
