//! What a parameter changes in a scene.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};

/// The thing in a scene that a parameter changes: `element/name/attribute[/index]`, such as
/// `geom/puck/friction/0`; `option/gravity/2` for the scene as a whole.
///
/// | target | is | unit |
/// |---|---|---|
/// | `geom/NAME/friction/{0,1,2}` | sliding, torsional (m), rolling (m) friction | 1, m, m |
/// | `geom/NAME/pos/{0,1,2}` | place in its body; mass properties follow | m |
/// | `geom/NAME/mass` | mass; its body's mass properties follow | kg |
/// | `geom/NAME/solref/{0,1}` | contact softness: time constant (s), damping ratio; MuJoCo | s, 1 |
/// | `body/NAME/mass` | mass, the inertia scaled with it | kg |
/// | `body/NAME/ipos/{0,1,2}` | centre of mass in its body | m |
/// | `body/NAME/inertia/{0,1,2}` | principal moments | kg m² |
/// | `joint/NAME/pos/{0,1,2}` | anchor of a hinge in its body; joint coordinates stay | m |
/// | `joint/NAME/damping`, `frictionloss`, `stiffness`, `armature` | per degree of freedom | SI |
/// | `actuator/NAME/kp`, `kv`, `gear` | gains of a servo, ratio of a drive | SI |
/// | `body/NAME/pos/{0,1,2}` | place in its parent, of a body that is not free | m |
/// | `joint/NAME/axis/{0,1,2}` | axis of a hinge or slide, scaled to length 1 | 1 |
/// | `joint/NAME/range/{0,1}`, `springref` | limits, rest of the spring; MuJoCo | rad or m |
/// | `actuator/NAME/forcerange/{0,1}` | limits of the force, before the gear; MuJoCo | N or N m |
/// | `option/gravity/{0,1,2}` | gravity | m/s² |
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Target {
    /// Kind of element: `geom`, `body`, `joint`, `actuator`, `option`; `effect` for an effect's
    /// parameter, whose name is `NAME@SITE`.
    pub element: String,
    /// Name of the element; empty for `option`.
    pub name: String,
    /// Attribute.
    pub attribute: String,
    /// Entry of the attribute; 0 for a scalar.
    pub index: usize,
}

impl Target {
    /// A target by its parts.
    #[must_use]
    pub fn new(element: &str, name: &str, attribute: &str, index: usize) -> Self {
        Self {
            element: element.into(),
            name: name.into(),
            attribute: attribute.into(),
            index,
        }
    }
}

impl FromStr for Target {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let bad = |message: &str| Error::Parameter {
            parameter: text.to_owned(),
            message: format!(
                "{message}; a target is written element/name/attribute[/index], such as geom/puck/friction/0"
            ),
        };
        let (element, rest) = text.split_once('/').ok_or_else(|| bad("not a target"))?;
        const ELEMENTS: [&str; 7] = [
            "geom", "body", "joint", "actuator", "equality", "option", "effect",
        ];
        if !ELEMENTS.contains(&element) {
            return Err(bad(&format!(
                "`{element}` is not one of {}",
                ELEMENTS.join(", ")
            )));
        }
        // A name may hold slashes, as in scenes that dm_control attaches. Attribute and index are
        // therefore read from the end; no attribute is a number.
        let (rest, index) = match rest.rsplit_once('/') {
            Some((before, last)) if last.bytes().all(|b| b.is_ascii_digit()) => (
                before,
                last.parse()
                    .map_err(|_| bad(&format!("`{last}` is not an index")))?,
            ),
            _ => (rest, 0),
        };
        let (name, attribute) = match rest.rsplit_once('/') {
            _ if element == "option" => ("", rest),
            Some(both) => both,
            None => return Err(bad("not a target")),
        };
        if attribute.is_empty() || (name.is_empty() && element != "option") {
            return Err(bad("name or attribute is empty"));
        }
        Ok(Self {
            element: element.to_owned(),
            name: name.to_owned(),
            attribute: attribute.to_owned(),
            index,
        })
    }
}

impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/", self.element)?;
        if !self.name.is_empty() {
            write!(f, "{}/", self.name)?;
        }
        write!(f, "{}/{}", self.attribute, self.index)
    }
}

impl Serialize for Target {
    fn serialize<S: serde::Serializer>(
        &self,
        serializer: S,
    ) -> std::result::Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Target {
    fn deserialize<D: serde::Deserializer<'de>>(
        deserializer: D,
    ) -> std::result::Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        text.parse().map_err(serde::de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_round_trip() {
        for text in [
            "geom/puck/friction/0",
            "body/rod/mass/0",
            "option/gravity/2",
            "joint/robot/arm/elbow/damping/0",
            "geom/left finger.pad/friction/1",
            "geom/pad/3/friction/1",
            "effect/viscous-friction@robot/elbow/coefficient/0",
        ] {
            let target: Target = text.parse().unwrap();
            assert_eq!(target.to_string(), text);
        }
        let short: Target = "geom/bob/mass".parse().unwrap();
        assert_eq!(short.index, 0);
    }

    #[test]
    fn bad_targets_say_what_a_target_is() {
        for text in [
            "puck",
            "geom/puck",
            "thing/puck/friction",
            "geom//friction",
            "geom/puck/3",
            "geom/puck/friction/99999999999999999999999",
        ] {
            let error = text.parse::<Target>().unwrap_err().to_string();
            assert!(error.contains("element/name/attribute"), "{error}");
        }
    }
}
