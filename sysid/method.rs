//! Methods that find a motion, and their settings.

use asid_core::error::{Error, Result};

use crate::motion::Shape;

/// How a motion is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Maximises Fisher information by the cross-entropy method over splines.
    FisherCem,
    /// Random heights of splines.
    Random,
    /// A multisine with Schroeder's phases.
    Multisine,
    /// A Fourier series with random coefficients.
    Fourier,
}

impl Method {
    /// All methods, with their names on the command line.
    pub const ALL: [(&'static str, Self); 4] = [
        ("fisher-cem", Self::FisherCem),
        ("random", Self::Random),
        ("multisine", Self::Multisine),
        ("fourier", Self::Fourier),
    ];

    /// The method with a name.
    ///
    /// # Errors
    /// When there is none.
    pub fn named(name: &str) -> Result<Self> {
        let found = Self::ALL.iter().find(|(n, _)| *n == name);
        found.map(|(_, m)| *m).ok_or_else(|| {
            Error::unknown(
                "explorer of any machine",
                name,
                Self::ALL.iter().map(|(n, _)| *n),
            )
        })
    }

    /// Name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        let found = Self::ALL.iter().find(|(_, m)| *m == self);
        found.map_or("", |(n, _)| n)
    }

    /// Shape of the curves that it uses.
    #[must_use]
    pub fn shape(self, settings: &DesignSettings) -> Shape {
        match self {
            Self::FisherCem | Self::Random => Shape::Spline(settings.knots),
            Self::Multisine | Self::Fourier => Shape::Fourier(settings.harmonics),
        }
    }
}

/// Settings of a method: size of the motion's parametrisation, and effort of the search.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DesignSettings {
    /// Spline heights for each actuator: more follow faster motions, and need a longer search.
    pub knots: usize,
    /// Harmonics of a Fourier series for each actuator: five in usual excitations (Swevers 1997).
    pub harmonics: usize,
    /// Most rounds of the search.
    pub iterations: usize,
    /// Candidates in a round.
    pub population: usize,
    /// Physics steps of the whole search, which bound its time.
    ///
    /// After them no round begins, but at least 8 rounds are done. Two cores take about 5e5 steps
    /// of an arm of six joints per second; steps of a machine with more coordinates count for more.
    pub physics_steps: f64,
}

impl Default for DesignSettings {
    fn default() -> Self {
        Self {
            knots: 12,
            harmonics: 5,
            iterations: 40,
            population: 40,
            physics_steps: 3e7,
        }
    }
}
