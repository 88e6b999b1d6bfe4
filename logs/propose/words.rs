//! Splits names into words: `ShoulderPan_pos [deg]` has a shoulder's pan, a position, and degrees.

/// The physical quantity that a name speaks of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// A position.
    Position,
    /// An orientation, as a quaternion.
    Orientation,
    /// A linear or angular velocity.
    Velocity,
    /// An acceleration.
    Acceleration,
    /// A force or torque.
    Effort,
}

/// Words of each measure. `angular` and `linear` only tell its kind.
const MEASURES: [(Measure, &[&str]); 5] = [
    (
        Measure::Orientation,
        &["orientation", "quat", "quaternion", "rotation"],
    ),
    (
        Measure::Position,
        &[
            "pos",
            "position",
            "positions",
            "angle",
            "angles",
            "q",
            "qpos",
            "pose",
            "translation",
            "encoder",
        ],
    ),
    (
        Measure::Velocity,
        &[
            "vel",
            "velocity",
            "velocities",
            "speed",
            "speeds",
            "dq",
            "qd",
            "qvel",
            "twist",
            "gyro",
            "rate",
            "omega",
        ],
    ),
    (
        Measure::Acceleration,
        &[
            "acc",
            "accel",
            "acceleration",
            "accelerations",
            "accelerometer",
            "ddq",
            "qdd",
        ],
    ),
    (
        Measure::Effort,
        &[
            "effort", "efforts", "torque", "torques", "tau", "force", "forces", "frc", "current",
            "load", "wrench",
        ],
    ),
];

/// Words for data sent to a machine.
const COMMAND: [&str; 20] = [
    "command",
    "commands",
    "commanded",
    "cmd",
    "ctrl",
    "control",
    "action",
    "actions",
    "goal",
    "target",
    "desired",
    "setpoint",
    "reference",
    "ref",
    "des",
    "sent",
    "u",
    "jog",
    "trajectory",
    "input",
];

/// Words for data read from it.
const READING: [&str; 11] = [
    "state",
    "states",
    "observation",
    "observations",
    "obs",
    "measured",
    "actual",
    "feedback",
    "present",
    "meas",
    "sensor",
];

/// Words that do not distinguish one thing from another.
const FILLER: [&str; 11] = [
    "joint",
    "joints",
    "motor",
    "motors",
    "servo",
    "actuator",
    "data",
    "value",
    "values",
    "controller",
    "msg",
];

/// Spellings of units in names, and in a study.
const UNITS: [(&str, &str); 14] = [
    ("deg", "deg"),
    ("degree", "deg"),
    ("degrees", "deg"),
    ("mrad", "mrad"),
    ("rad", "rad"),
    ("radian", "rad"),
    ("radians", "rad"),
    ("rev", "rev"),
    ("turns", "rev"),
    ("rpm", "rpm"),
    ("mm", "mm"),
    ("cm", "cm"),
    ("percent", "%"),
    ("meters", "m"),
];

/// A name, split into words and classified.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Words {
    /// All words, in their order.
    pub all: Vec<String>,
    /// Words that distinguish it from others of its kind.
    pub own: Vec<String>,
    /// Its measure, if it states one.
    pub measure: Option<Measure>,
    /// Whether it says that it is a command.
    pub command: bool,
    /// Whether it says that it is a reading.
    pub reading: bool,
    /// Unit, as a study spells it.
    pub unit: Option<&'static str>,
    /// Axis: x, y, z or w.
    pub axis: Option<char>,
    /// The number at its end.
    pub index: Option<usize>,
    /// True for angular, false for linear, if it states either.
    pub turning: Option<bool>,
}

/// Lower-case words of a name, split at signs, at inner capitals, and between letters and digits.
#[must_use]
pub fn split(name: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let mut last: Option<char> = None;
    for c in name.chars() {
        let begins = match last {
            Some(l) if l.is_alphanumeric() => {
                (c.is_uppercase() && l.is_lowercase()) || c.is_ascii_digit() != l.is_ascii_digit()
            }
            _ => true,
        };
        if c.is_alphanumeric() {
            match words.last_mut() {
                Some(word) if !begins => word.extend(c.to_lowercase()),
                _ => words.push(c.to_lowercase().collect()),
            }
        }
        last = Some(c);
    }
    words
}

impl Words {
    /// Splits and classifies a name.
    #[must_use]
    pub fn of(name: &str) -> Self {
        let words = split(name);
        let mut found = Self::default();
        let last = words.len().saturating_sub(1);
        // The index of a list entry is not a name: `commands.data.2`, `position[2]`.
        let end = name.trim_end_matches(']');
        let stem = end.trim_end_matches(|c: char| c.is_ascii_digit());
        let entry = stem.len() < end.len() && stem.ends_with(['.', '[']);
        for (i, word) in words.iter().enumerate() {
            let measure = MEASURES.iter().find(|(_, all)| all.contains(&&**word));
            let unit = UNITS.iter().find(|(spelt, _)| spelt == word);
            if let Some((measure, _)) = measure {
                // The last word of a measure counts: `pose.orientation`, `joint_states.velocity`.
                let pose_of =
                    *measure == Measure::Position && found.measure == Some(Measure::Orientation);
                if !pose_of {
                    found.measure = Some(*measure);
                }
            } else if COMMAND.contains(&&**word) {
                // The last of these words counts: the reference in a controller's state is a
                // command.
                (found.command, found.reading) = (true, false);
            } else if READING.contains(&&**word) {
                (found.command, found.reading) = (false, true);
            } else if let Some((_, unit)) = unit {
                found.unit = Some(unit);
            } else if i == last && ["x", "y", "z", "w"].contains(&&**word) {
                found.axis = word.chars().next();
            } else if word == "angular" || word == "linear" {
                found.turning = Some(word == "angular");
            } else if !(FILLER.contains(&&**word) || entry && i == last) {
                found.own.push(word.clone());
            }
            if i == last {
                found.index = word.parse().ok();
            }
        }
        found.all = words;
        found
    }

    /// The single word of a one-word name, such as `x` of a gantry's joint.
    ///
    /// `None` for a name of several words, and for a word that distinguishes nothing.
    #[must_use]
    pub fn whole(&self) -> Option<&str> {
        match &*self.all {
            [word] if !FILLER.contains(&&**word) => Some(word),
            _ => None,
        }
    }

    /// Share of `word` in the distinguishing words and itself: 1 if alone, 0 if it is not in the
    /// name.
    #[must_use]
    pub fn part_of(&self, word: &str) -> f64 {
        if !self.all.iter().any(|w| w == word) {
            return 0.0;
        }
        let others = self.own.iter().filter(|w| *w != word).count();
        1.0 / (1 + others) as f64
    }

    /// Similarity of the distinguishing words of two names, 0 to 1 (Jaccard's index).
    #[must_use]
    pub fn likeness(&self, other: &Self) -> f64 {
        let mut all: Vec<&String> = self.own.iter().chain(&other.own).collect();
        all.sort();
        all.dedup();
        let shared = all
            .iter()
            .filter(|w| self.own.contains(w) && other.own.contains(w));
        if all.is_empty() {
            0.0
        } else {
            shared.count() as f64 / all.len() as f64
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_parted_where_people_part_them() {
        assert_eq!(
            split("ShoulderPan_pos [deg]"),
            ["shoulder", "pan", "pos", "deg"]
        );
        assert_eq!(split("/arm/joint1.cmd"), ["arm", "joint", "1", "cmd"]);
        assert_eq!(split("IMU.z"), ["imu", "z"]);
    }

    #[test]
    fn words_say_what_a_column_is() {
        let words = Words::of("observation.state.shoulder_pan.pos");
        assert_eq!(words.own, ["shoulder", "pan"]);
        assert_eq!(words.measure, Some(Measure::Position));
        assert!(words.reading && !words.command);
        let words = Words::of("/position_controller/commands.data.2");
        assert!(words.command);
        assert_eq!(words.index, Some(2));
        assert!(words.own.is_empty());
        assert_eq!(Words::of("joint1").own, ["1"]);
        let words = Words::of("/tracker.pose.orientation.w");
        assert_eq!(
            (words.measure, words.axis),
            (Some(Measure::Orientation), Some('w'))
        );
        assert_eq!(Words::of("elbow (deg)").unit, Some("deg"));
        let likeness = Words::of("q_shoulder_pan").likeness(&Words::of("shoulder_lift.pos"));
        assert!((likeness - 1.0 / 3.0).abs() < 1e-12);
    }
}
