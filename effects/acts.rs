//! The four places where effects act.

/// Where an effect acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Acts {
    /// On the model's parameters.
    Model,
    /// On the command, before it reaches the drive.
    Command,
    /// As a force during the step.
    Force,
    /// On the reading of a sensor.
    Measurement,
}
