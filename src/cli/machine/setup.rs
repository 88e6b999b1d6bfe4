//! The setup of a motion search: a machine at rest, its unknowns and limits, and the amplitudes of
//! its commands.

use anyhow::Result;
use asid_core::signal::Signal;
use asid_core::{Error, Parameter, Progress, Streams, Target};
use asid_mjcf::plant::DriveLaw;
use asid_sysid::check_scales;
use asid_sysid::dataset::Dataset;
use asid_sysid::design::{Designed, Designer};
use asid_sysid::limits::Limits;
use asid_sysid::method::Method;
use asid_sysid::motion::Family;
use asid_sysid::play::{Player, substeps};
use asid_sysid::rehearse::{Rehearsed, rehearse};
use asid_sysid::tells::{Told, of_logs};

use super::motion_config::Config;
use super::{Subject, sensors};

/// A machine at rest, ready for a search.
pub struct Setup<'a> {
    subject: &'a Subject,
    /// Plays motions and checks limits.
    pub player: Player<'a>,
    /// The unknowns to identify, then nuisance entries.
    pub parameters: Vec<Parameter>,
    /// Number of unknowns to identify.
    pub sought: usize,
    /// Values at which the motion is designed, in the parameters' units.
    pub values: Vec<f64>,
    /// Information from the logs of a study; zero without a study.
    pub known: Told,
    /// Sensors that are read, with their noise.
    pub signals: Vec<Signal>,
    /// Physics steps per frame.
    pub substeps: usize,
    /// Commands at which the machine rests.
    pub base: Vec<f64>,
    /// Remarks for the user, one sentence each.
    pub notes: Vec<String>,
}

impl<'a> Setup<'a> {
    /// Brings a machine to rest and checks its limits there.
    ///
    /// # Errors
    /// When a name of the configuration is unknown, the machine begins beyond a limit, or the
    /// engine fails.
    pub fn new(subject: &'a Subject, config: &Config, threads: usize) -> Result<Self> {
        let mut notes = Vec::new();
        let parameters = config.parameters(subject)?;
        check_scales(&parameters)?;
        let sought = config.sought(subject);
        let plant = &subject.plant;
        let limits = Limits::new(plant, &|j| range_of(subject, j), &config.limits()?)?;
        notes.extend(limits.unchecked.iter().cloned());
        let data = match &subject.study {
            Some(study) => {
                // That of the options holds for the logs too.
                let mut noise = study.noise.clone();
                noise.extend(config.noise.clone());
                Some(Dataset::new(plant, &study.train, &noise)?)
            }
            None => None,
        };
        let signals = sensors::signals(subject, data.as_ref(), &config.noise, &mut notes)?;
        let base = base_commands(subject);
        let mut player = Player::new(
            &*subject.model,
            plant,
            limits,
            &parameters,
            &signals,
            (&base, config.settle),
            threads,
        )?;
        let values = config.values(subject, &parameters)?;
        settle(&mut player, &values, config, &mut notes)?;
        let known = match &data {
            Some(data) => of_logs(
                &*subject.model,
                &parameters,
                (&values, sought),
                data,
                threads,
            )?,
            None => Told::nothing(sought, parameters.len()),
        };
        Ok(Self {
            subject,
            player,
            parameters,
            sought,
            values,
            known,
            signals,
            substeps: substeps(plant, config.period)?,
            base,
            notes,
        })
    }

    /// Plays commands (`frames x nu`) on a simulated true machine, which a seed draws from the
    /// ranges.
    ///
    /// The machine is the same for all commands. Returns its values in their units, its motion, and
    /// its log with noise.
    ///
    /// # Errors
    /// As [`rehearse`].
    pub fn true_machine(
        &mut self,
        commands: &[f64],
        seed: u64,
    ) -> Result<(Vec<f64>, Rehearsed, Dataset)> {
        let streams = Streams::new(seed);
        let mut rng = streams.stream("truth");
        let truth: Vec<f64> = self.parameters.iter().map(|p| p.sample(&mut rng)).collect();
        let mut rng = streams.stream("noise");
        let did = rehearse(
            &mut self.player,
            (commands, self.substeps),
            &truth,
            &mut rng,
        )?;
        let signals = self.signals.iter();
        let noise = signals.map(|s| (s.sensor.clone(), s.noise)).collect();
        let logs = [(seed.to_string(), did.log.clone())];
        let data = Dataset::new(&self.subject.plant, &logs, &noise)?;
        Ok((truth, did, data))
    }

    /// Period of a frame, s: a whole number of physics steps.
    #[must_use]
    pub fn period(&self) -> f64 {
        self.substeps as f64 * self.subject.plant.layout.timestep
    }

    /// Designs a motion.
    ///
    /// # Errors
    /// When the configuration is wrong, nothing can move, or the engine fails.
    pub fn design(
        &mut self,
        config: &Config,
        method: Method,
        seed: u64,
        progress: &dyn Progress,
    ) -> Result<Designed> {
        let period = self.period();
        let limits = self.player.limits();
        let family = Family {
            shape: method.shape(&config.design),
            amplitude: amplitudes(self.subject, limits, &self.base),
            range: limits.command.clone(),
            base: self.base.clone(),
            frames: ((config.seconds / period).round() as usize).max(2),
            rest: (config.rest_seconds / period).round() as usize,
            period,
        };
        let mut designer = Designer {
            player: &mut self.player,
            family,
            parameters: &self.parameters,
            sought: self.sought,
            values: self.values.clone(),
            known: self.known.clone(),
            objective: config.objective.parse()?,
            substeps: self.substeps,
        };
        Ok(designer.design(method, &config.design, Streams::new(seed), progress)?)
    }
}

/// The range of a joint, by index, where the document has one.
///
/// The model's values take precedence over the document's, unless the engine cannot change a range.
fn range_of(subject: &Subject, joint: usize) -> Option<[f64; 2]> {
    let [low, high] = subject.plant.joints[joint].range?;
    let name = &subject.plant.layout.joints[joint].name;
    let end = |index: usize, declared: f64| {
        let target = Target::new("joint", name, "range", index);
        subject.model.nominal(&target).unwrap_or(declared)
    };
    Some([end(0, low), end(1, high)]).filter(|[low, high]| low < high)
}

/// Commands at which the machine rests: the first keyframe's, else those at which servos hold the
/// first state.
fn base_commands(subject: &Subject) -> Vec<f64> {
    let layout = &subject.plant.layout;
    if let Some(key) = layout.keyframes.first() {
        return key.ctrl.clone();
    }
    let (qpos, _) = asid_core::problem::home(layout);
    let drives = subject.plant.drives.iter();
    drives
        .map(|drive| match drive {
            Some(d) if d.is_position_servo() => d.gear * qpos[layout.joints[d.joint].qpos],
            _ => 0.0,
        })
        .collect()
}

/// Largest distance of each command from its base within the limits, on the wider side.
///
/// It is infinite for a drive that only its joint's limits bound, and 0 for one that nothing
/// bounds.
fn amplitudes(subject: &Subject, limits: &Limits, base: &[f64]) -> Vec<f64> {
    let each = base.iter().enumerate().map(|(a, &base)| {
        let mut width = reach(limits.command[a], base);
        let Some(drive) = subject.plant.drives[a] else {
            return if width.is_finite() { width } else { 0.0 };
        };
        let joint = &subject.plant.layout.joints[drive.joint];
        let limit = limits.joints.iter().find(|l| l.name == joint.name);
        if drive.is_position_servo() {
            let range = limit.and_then(|l| l.position);
            let range = range.map(|range| scaled(range, drive.gear));
            width = width.min(reach(range, base));
        }
        let force = limits.drives.iter().find(|d| d.actuator == a);
        // Only a motor's command is its force.
        if let (DriveLaw::Motor, Some(force)) = (drive.law, force) {
            width = width.min(force.force / drive.gear.abs());
        }
        let is_bounded =
            force.is_some() || limit.is_some_and(|l| l.position.is_some() || l.speed.is_some());
        if width.is_finite() || is_bounded {
            width
        } else {
            0.0
        }
    });
    each.collect()
}

/// Distance from `base` to the farther end of a range that contains it; infinite without a range.
fn reach(range: Option<[f64; 2]>, base: f64) -> f64 {
    range.map_or(f64::INFINITY, |[low, high]| {
        (high - base).max(base - low).max(0.0)
    })
}

/// The commands of a position servo at the ends of its joint's range, the lower first.
fn scaled(range: [f64; 2], gear: f64) -> [f64; 2] {
    let [a, b] = range.map(|end| end * gear);
    [a.min(b), a.max(b)]
}

/// Lets the machine come to rest before a motion, if it does.
fn settle(
    player: &mut Player<'_>,
    values: &[f64],
    config: &Config,
    notes: &mut Vec<String>,
) -> Result<()> {
    let left = player.unrest(&[values.to_vec()])?;
    if left > config.rest_speed {
        notes.push(format!(
            "under its first commands the machine does not come to rest within {} s (speed {left:.3} left): the motion \
             begins in the first state itself, which is taken as known exactly",
            config.settle
        ));
        player.skip_settling();
    }
    let (at_stop, beyond) = player.look_at_begin(values)?;
    if let Some((what, _)) = beyond.worst {
        let message = format!(
            "the machine begins beyond one: {what}; move its first keyframe within the limits, or widen this one (where none is given, \
             that of a joint is its range in the model less 2 % at either end)"
        );
        return Err(Error::Config {
            key: "limit_position, limit_speed, limit_force, limit_box".into(),
            message,
        }
        .into());
    }
    if !at_stop.is_empty() {
        let names = at_stop.join(", ");
        notes.push(format!(
            "at rest at the end of the range, and may stay there: {names}"
        ));
    }
    let touching = player.allow_present_contacts(values)?;
    if !touching.is_empty() {
        let pairs: Vec<String> = touching
            .iter()
            .map(|[a, b]| format!("{a} and {b}"))
            .collect();
        notes.push(format!(
            "at rest there touch already, and may: {}",
            pairs.join(", ")
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Symptom: a motion left the joint of a servo with a negative gear at rest. Cause: the gear
    /// turned the joint's range around, and a range with its upper end first has no reach.
    #[test]
    fn a_servo_with_a_negative_gear_reaches_as_far_as_one_with_a_positive_gear() {
        let range = [-0.5, 1.0];
        let (plus, minus) = (scaled(range, 2.0), scaled(range, -2.0));
        assert!(plus == [-1.0, 2.0] && minus == [-2.0, 1.0], "{minus:?}");
        for base in [0.0, 0.3] {
            assert_eq!(reach(Some(plus), base), reach(Some(minus), -base));
        }
        assert_eq!(reach(Some(minus), 0.0), 2.0);
    }
}
