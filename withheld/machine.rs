//! Describes a machine: its model, the parameters of its owner, its commands and its initial
//! states.

/// The half to which a machine belongs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Half {
    /// The half on which settings and calibration of a diagnosis may be chosen.
    Training,
    /// The half on which nothing may be chosen.
    Test,
}

impl Half {
    /// `training` or `test`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Training => "training",
            Self::Test => "test",
        }
    }
}

/// A parameter of the study. The owner fits it; its true value is drawn from the range.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    /// Name in the study.
    pub name: &'static str,
    /// `geom/NAME/mass` or `geom/NAME/friction/0`.
    pub target: &'static str,
    /// Range in the study; the true value is drawn from its middle eight tenths.
    pub range: [f64; 2],
}

/// Commands of an actuator: a sum of sines with random phases about a centre.
#[derive(Clone, Copy, Debug)]
pub struct Command {
    /// Actuator.
    pub actuator: &'static str,
    /// Mean of the command, in its unit.
    pub center: f64,
    /// Largest deviation from the mean, in its unit.
    pub amplitude: f64,
    /// Lowest and highest frequency, Hz.
    pub band: [f64; 2],
}

/// Initial state of a joint: each coordinate is drawn within `center` plus or minus `spread`.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    /// Joint.
    pub joint: &'static str,
    /// Centre and spread of each position; for a free joint x, y, z and the rotation about z.
    pub position: &'static [[f64; 2]],
    /// Centre and spread of each velocity.
    pub velocity: &'static [[f64; 2]],
}

/// Geoms that touch each other and have the same contact coefficients.
#[derive(Clone, Copy, Debug)]
pub struct Contact {
    /// The fixed geom. Its name is the site of the contact's effects.
    pub site: &'static str,
    /// The geoms that touch the site.
    pub movers: &'static [&'static str],
    /// The coefficients whose effect can be seen.
    pub shows: Shows,
}

/// The coefficients of a contact that act in a machine's motion.
#[derive(Clone, Copy, Debug, Default)]
pub struct Shows {
    /// Whether it slides.
    pub sliding: bool,
    /// Whether it spins about the normal (`condim` of 4 or more).
    pub torsion: bool,
    /// Whether it rolls (`condim` of 6).
    pub rolling: bool,
    /// Whether it is struck, so that stiffness and damping act.
    pub impact: bool,
}

/// A kind of machine.
#[derive(Clone, Copy, Debug)]
pub struct Machine {
    /// Name.
    pub name: &'static str,
    /// Description in one line.
    pub about: &'static str,
    /// Half to which it belongs.
    pub half: Half,
    /// The study's model: MJCF.
    pub model: &'static str,
    /// The parameters that the owner fits.
    pub parameters: &'static [Parameter],
    /// Standard deviation of each sensor's noise, in its unit; rad for an orientation.
    pub noise: &'static [(&'static str, f64)],
    /// Commands of its actuators.
    pub commands: &'static [Command],
    /// Initial states. A joint that is not listed starts at the model's reference, at rest.
    pub starts: &'static [Start],
    /// Contacts.
    pub contacts: &'static [Contact],
    /// Length of an episode, s.
    pub seconds: f64,
    /// Rows per second.
    pub rate: f64,
}

/// A parameter that the owner fits.
#[must_use]
pub const fn fit(name: &'static str, target: &'static str, low: f64, high: f64) -> Parameter {
    Parameter {
        name,
        target,
        range: [low, high],
    }
}

/// A command about `center` by at most `amplitude`, in a band of frequencies in Hz.
#[must_use]
pub const fn sines(
    actuator: &'static str,
    center: f64,
    amplitude: f64,
    low: f64,
    high: f64,
) -> Command {
    Command {
        actuator,
        center,
        amplitude,
        band: [low, high],
    }
}

/// Initial state of a joint: centres and spreads.
#[must_use]
pub const fn start(
    joint: &'static str,
    position: &'static [[f64; 2]],
    velocity: &'static [[f64; 2]],
) -> Start {
    Start {
        joint,
        position,
        velocity,
    }
}
