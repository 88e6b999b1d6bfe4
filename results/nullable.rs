//! Reading numbers that may not have been finite: JSON has only `null` for them.

use std::collections::BTreeMap;

use serde::{Deserialize, Deserializer};

/// A number, `null` read as NaN.
#[derive(Clone, Copy)]
struct Number(f64);

impl<'de> Deserialize<'de> for Number {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(Self(
            Option::<f64>::deserialize(deserializer)?.unwrap_or(f64::NAN),
        ))
    }
}

/// One number.
///
/// # Errors
/// Where the text holds something else.
pub fn scalar<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Number::deserialize(deserializer).map(|n| n.0)
}

/// A list of numbers.
///
/// # Errors
/// Where the text holds something else.
pub fn list<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<f64>, D::Error> {
    Ok(Vec::<Number>::deserialize(deserializer)?
        .into_iter()
        .map(|n| n.0)
        .collect())
}

/// A fixed number of numbers.
///
/// # Errors
/// Where the text holds something else.
pub fn array<'de, D: Deserializer<'de>, const N: usize>(
    deserializer: D,
) -> Result<[f64; N], D::Error> {
    let numbers = list(deserializer)?;
    let found = numbers.len();
    numbers
        .try_into()
        .map_err(|_| serde::de::Error::invalid_length(found, &format!("{N} numbers").as_str()))
}

/// A list of rows of `N` numbers.
///
/// # Errors
/// Where the text holds something else.
pub fn rows<'de, D: Deserializer<'de>, const N: usize>(
    deserializer: D,
) -> Result<Vec<[f64; N]>, D::Error> {
    Vec::<Vec<Number>>::deserialize(deserializer)?
        .into_iter()
        .map(|row| {
            let found = row.len();
            let numbers: Vec<f64> = row.into_iter().map(|n| n.0).collect();
            numbers.try_into().map_err(|_| {
                serde::de::Error::invalid_length(found, &format!("{N} numbers").as_str())
            })
        })
        .collect()
}

/// A list of lists of numbers.
///
/// # Errors
/// Where the text holds something else.
pub fn table<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Vec<f64>>, D::Error> {
    let rows = Vec::<Vec<Number>>::deserialize(deserializer)?;
    Ok(rows
        .into_iter()
        .map(|row| row.into_iter().map(|n| n.0).collect())
        .collect())
}

/// Numbers by name.
///
/// # Errors
/// Where the text holds something else.
pub fn map<'de, D: Deserializer<'de>>(deserializer: D) -> Result<BTreeMap<String, f64>, D::Error> {
    let numbers = BTreeMap::<String, Number>::deserialize(deserializer)?;
    Ok(numbers.into_iter().map(|(k, n)| (k, n.0)).collect())
}

/// Intervals by name.
///
/// # Errors
/// Where the text holds something else.
pub fn intervals<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<BTreeMap<String, [f64; 2]>, D::Error> {
    let intervals = BTreeMap::<String, [Number; 2]>::deserialize(deserializer)?;
    let ends = |(name, [low, high]): (String, [Number; 2])| (name, [low.0, high.0]);
    Ok(intervals.into_iter().map(ends).collect())
}
