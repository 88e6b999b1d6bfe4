//! What a machine is: a model, what its owner fits, how it is driven and where it starts.

/// Half of the machines that a case belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Half {
    /// Settings and calibration of a diagnosis may be chosen on it.
    Training,
    /// Nothing may be chosen on it.
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

/// A parameter of the study: the owner fits it, and its true value is drawn from the range.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    /// Name in the study.
    pub name: &'static str,
    /// `geom/NAME/mass` or `geom/NAME/friction/0`.
    pub target: &'static str,
    /// Range in the study; the truth is drawn from its middle eight tenths.
    pub range: [f64; 2],
}

/// How an actuator is driven: a sum of sines of random phases about a centre.
#[derive(Clone, Copy, Debug)]
pub struct Command {
    /// Actuator.
    pub actuator: &'static str,
    /// Mean of the command, in its unit.
    pub center: f64,
    /// Largest departure from it, in its unit.
    pub amplitude: f64,
    /// Lowest and highest frequency, Hz.
    pub band: [f64; 2],
}

/// Where a joint starts: each coordinate within `center` plus or minus `spread`.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    /// Joint.
    pub joint: &'static str,
    /// Center and spread of each position; of a free joint x, y, z and the turn about z.
    pub position: &'static [[f64; 2]],
    /// Center and spread of each velocity.
    pub velocity: &'static [[f64; 2]],
}

/// A pair of geoms that touch, both of which carry the same coefficients.
#[derive(Clone, Copy, Debug)]
pub struct Contact {
    /// The geom whose name is the site of a contact's effects: the fixed one.
    pub site: &'static str,
    /// The geoms that touch it.
    pub movers: &'static [&'static str],
    /// What can be seen of the contact.
    pub shows: Shows,
}

/// Which coefficients of a contact act in a machine's motion.
#[derive(Clone, Copy, Debug, Default)]
pub struct Shows {
    /// It slides.
    pub sliding: bool,
    /// It spins about the normal (`condim` of 4 or more).
    pub torsion: bool,
    /// It rolls (`condim` of 6).
    pub rolling: bool,
    /// It is struck, so that stiffness and damping act.
    pub impact: bool,
}

/// A kind of machine.
#[derive(Clone, Copy, Debug)]
pub struct Machine {
    /// Name.
    pub name: &'static str,
    /// What it is, in a line.
    pub about: &'static str,
    /// Half that it belongs to.
    pub half: Half,
    /// The study's model: MJCF.
    pub model: &'static str,
    /// What the owner fits.
    pub parameters: &'static [Parameter],
    /// Standard deviation of each sensor's noise, in its unit; rad for an orientation.
    pub noise: &'static [(&'static str, f64)],
    /// How it is driven.
    pub commands: &'static [Command],
    /// Where it starts; joints that are not listed start at the model's reference at rest.
    pub starts: &'static [Start],
    /// What touches what.
    pub contacts: &'static [Contact],
    /// Length of an episode, s.
    pub seconds: f64,
    /// Rows a second.
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

/// A command about `center`, by at most `amplitude`, in a band of frequencies in Hz.
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

/// Where a joint starts: centres and spreads.
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
