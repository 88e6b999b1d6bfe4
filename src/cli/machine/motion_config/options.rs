//! Options of `explore` for any machine.

/// Options of `explore` that go with any machine.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct Options {
    /// Seek this unknown of any machine, beside those of the study; a fourth part `log` has it on a
    /// logarithmic scale (repeatable)
    #[arg(long, value_name = "TARGET:LOW:HIGH", help_heading = "Any machine")]
    pub unknown: Vec<String>,
    /// Nuisance parameter: unknown within this range and estimated with the others, but the motion
    /// is not made for it (repeatable)
    #[arg(long, value_name = "TARGET:LOW:HIGH", help_heading = "Any machine")]
    pub nuisance: Vec<String>,
    /// Make this small: a-optimal (sum of variances), d-optimal (their volume), trace (of the
    /// information, to be large)
    #[arg(long, value_name = "NAME", help_heading = "Any machine")]
    pub objective: Option<String>,
    /// Move for so long, s
    #[arg(long, value_name = "S", help_heading = "Any machine")]
    pub seconds: Option<f64>,
    /// Command and read at this period, s
    #[arg(long, value_name = "S", help_heading = "Any machine")]
    pub period: Option<f64>,
    /// Keep a joint here, rad or m [default: its range in the model, less 2 % at either end]
    /// (repeatable)
    #[arg(long, value_name = "JOINT:LOW:HIGH", help_heading = "Any machine")]
    pub limit_position: Vec<String>,
    /// Keep a joint below this speed, rad/s or m/s; without a joint all (repeatable)
    #[arg(long, value_name = "[JOINT:]SPEED", help_heading = "Any machine")]
    pub limit_speed: Vec<String>,
    /// Keep a drive's force on its joint below this, N or N m; without an actuator all (repeatable)
    #[arg(long, value_name = "[ACTUATOR:]FORCE", help_heading = "Any machine")]
    pub limit_force: Vec<String>,
    /// Keep the origin of a body's frame in this box of the world, m, along the whole motion
    /// (repeatable)
    #[arg(
        long,
        value_name = "BODY:X0:X1:Y0:Y1:Z0:Z1",
        help_heading = "Any machine"
    )]
    pub limit_box: Vec<String>,
    /// Let two bodies touch (repeatable)
    #[arg(long, value_name = "BODY:BODY", help_heading = "Any machine")]
    pub may_touch: Vec<String>,
    /// Take this standard deviation for a sensor's noise (repeatable)
    #[arg(long, value_name = "SENSOR:STD", help_heading = "Any machine")]
    pub noise: Vec<String>,
}

impl Options {
    /// Name of the first of these options that is given; `None` where none is.
    pub fn first(&self) -> Option<&'static str> {
        let given = [
            ("--unknown", !self.unknown.is_empty()),
            ("--nuisance", !self.nuisance.is_empty()),
            ("--objective", self.objective.is_some()),
            ("--seconds", self.seconds.is_some()),
            ("--period", self.period.is_some()),
            ("--limit-position", !self.limit_position.is_empty()),
            ("--limit-speed", !self.limit_speed.is_empty()),
            ("--limit-force", !self.limit_force.is_empty()),
            ("--limit-box", !self.limit_box.is_empty()),
            ("--may-touch", !self.may_touch.is_empty()),
            ("--noise", !self.noise.is_empty()),
        ];
        let first = given.iter().find(|(_, is_given)| *is_given);
        first.map(|(name, _)| *name)
    }
}
