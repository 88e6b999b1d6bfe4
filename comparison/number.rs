//! Numbers in JSON that may not be finite: `null` for NaN, and texts for the infinities, since JSON
//! cannot represent them.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A number that survives a JSON round trip, whatever its value.
#[derive(Clone, Copy)]
struct Number(f64);

impl Serialize for Number {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if self.0.is_finite() {
            serializer.serialize_f64(self.0)
        } else if self.0.is_nan() {
            serializer.serialize_none()
        } else {
            serializer.serialize_str(if self.0 > 0.0 { "inf" } else { "-inf" })
        }
    }
}

impl<'de> Deserialize<'de> for Number {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged)]
        enum Form {
            Value(f64),
            Text(String),
            Null(()),
        }
        Ok(Self(match Form::deserialize(deserializer)? {
            Form::Value(x) => x,
            Form::Null(()) => f64::NAN,
            Form::Text(text) => text.parse().map_err(serde::de::Error::custom)?,
        }))
    }
}

/// One number.
pub mod scalar {
    use super::*;

    /// Writes the number.
    pub fn serialize<S: Serializer>(x: &f64, serializer: S) -> Result<S::Ok, S::Error> {
        Number(*x).serialize(serializer)
    }

    /// Reads the number.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
        Number::deserialize(deserializer).map(|n| n.0)
    }
}

/// Two numbers.
pub mod pair {
    use super::*;

    /// Writes the numbers.
    pub fn serialize<S: Serializer>(x: &[f64; 2], serializer: S) -> Result<S::Ok, S::Error> {
        x.map(Number).serialize(serializer)
    }

    /// Reads the numbers.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[f64; 2], D::Error> {
        <[Number; 2]>::deserialize(deserializer).map(|p| p.map(|n| n.0))
    }
}

/// An optional number.
pub mod option {
    use super::*;

    /// Writes the number.
    pub fn serialize<S: Serializer>(x: &Option<f64>, serializer: S) -> Result<S::Ok, S::Error> {
        x.map(Number).serialize(serializer)
    }

    /// Reads the number; `null` is `None`.
    pub fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Option<f64>, D::Error> {
        Ok(Option::<Number>::deserialize(deserializer)?.map(|n| n.0))
    }
}
