//! What a parameter changes in a scene.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};

/// The thing in a scene that a parameter changes: `element/name/attribute[/index]`,
/// such as `geom/puck/friction/0`; `option/gravity/2` for the scene as a whole.
///
/// | target | is | unit |
/// |---|---|---|
/// | `geom/NAME/friction/{0,1,2}` | sliding, torsional (m), rolling (m) friction | 1, m, m |
/// | `geom/NAME/pos/{0,1,2}` | place in its body; mass properties follow | m |
/// | `geom/NAME/mass` | mass; its body's mass properties follow | kg |
/// | `geom/NAME/solref/{0,1}` | contact softness: time constant (s), damping ratio | s, 1 |
/// | `body/NAME/mass` | mass, the inertia scaled with it | kg |
/// | `body/NAME/ipos/{0,1,2}` | centre of mass in its body | m |
/// | `body/NAME/inertia/{0,1,2}` | principal moments | kg m² |
/// | `joint/NAME/pos/{0,1,2}` | anchor of a hinge in its body; joint coordinates stay | m |
/// | `joint/NAME/damping`, `frictionloss`, `stiffness`, `armature` | of each degree of freedom | SI |
/// | `actuator/NAME/kp`, `kv`, `gear` | gains of a servo, ratio of a drive | SI |
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
    /// Entry of the attribute, 0 where it is a scalar.
    pub index: usize,
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
        let mut parts: Vec<&str> = text.split('/').collect();
        if parts.first() == Some(&"option") {
            parts.insert(1, "");
        }
        let (element, name, attribute, index) = match parts[..] {
            [e, n, a] => (e, n, a, "0"),
            [e, n, a, i] => (e, n, a, i),
            _ => return Err(bad("not a target")),
        };
        const ELEMENTS: [&str; 7] = [
            "geom", "body", "joint", "actuator", "equality", "option", "effect",
        ];
        if !ELEMENTS.contains(&element) {
            return Err(bad(&format!(
                "`{element}` is not one of {}",
                ELEMENTS.join(", ")
            )));
        }
        if attribute.is_empty() || (name.is_empty() && element != "option") {
            return Err(bad("name or attribute is empty"));
        }
        Ok(Self {
            element: element.to_owned(),
            name: name.to_owned(),
            attribute: attribute.to_owned(),
            index: index
                .parse()
                .map_err(|_| bad(&format!("`{index}` is not an index")))?,
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
            "geom/p/friction/x",
        ] {
            let error = text.parse::<Target>().unwrap_err().to_string();
            assert!(error.contains("element/name/attribute"), "{error}");
        }
    }
}
