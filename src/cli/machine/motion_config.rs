//! The settings of a motion's design: what is unknown, what must be kept, how it is searched.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::Result;
use asid_core::parameter::Scale;
use asid_core::{Error, Parameter};
use asid_sysid::limits::{LimitRequest, REST};
use asid_sysid::method::{DesignSettings, Method};
use serde::{Deserialize, Serialize};

use super::Subject;
use crate::cli::options::Common;
use crate::cli::settings::{read_table, set};

/// Length of a motion where nothing is said, s: some swings of an arm.
const SECONDS: f64 = 5.0;

/// Period of commands and readings where nothing is said, s: that of most robots' loggers.
const PERIOD: f64 = 0.01;

/// Time to settle before a motion, and to come to rest behind it, s: some times an arm's slowest decay.
const SETTLE: f64 = 1.0;

/// Relative precision that repeats are counted for.
const PRECISION: f64 = 0.01;

/// Options of `explore` that go with any machine.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct Options {
    /// Seek this unknown of any machine, beside those of the study; a fourth part `log` has it on a logarithmic scale
    /// (repeatable)
    #[arg(long, value_name = "TARGET:LOW:HIGH", help_heading = "Any machine")]
    pub unknown: Vec<String>,
    /// Know this one as little, but do not seek it: it is estimated along (repeatable)
    #[arg(long, value_name = "TARGET:LOW:HIGH", help_heading = "Any machine")]
    pub nuisance: Vec<String>,
    /// Make this small: a-optimal (sum of variances), d-optimal (their volume), trace (of the information, to be large)
    #[arg(long, value_name = "NAME", help_heading = "Any machine")]
    pub objective: Option<String>,
    /// Move for so long, s
    #[arg(long, value_name = "S", help_heading = "Any machine")]
    pub seconds: Option<f64>,
    /// Command and read at this period, s
    #[arg(long, value_name = "S", help_heading = "Any machine")]
    pub period: Option<f64>,
    /// Keep a joint here, rad or m [default: its range in the model, less 2 % at either end] (repeatable)
    #[arg(long, value_name = "JOINT:LOW:HIGH", help_heading = "Any machine")]
    pub limit_position: Vec<String>,
    /// Keep a joint below this speed, rad/s or m/s; without a joint all (repeatable)
    #[arg(long, value_name = "[JOINT:]SPEED", help_heading = "Any machine")]
    pub limit_speed: Vec<String>,
    /// Keep a drive's force on its joint below this, N or N m; without an actuator all (repeatable)
    #[arg(long, value_name = "[ACTUATOR:]FORCE", help_heading = "Any machine")]
    pub limit_force: Vec<String>,
    /// Keep the origin of a body's frame in this box of the world, m, along the whole motion (repeatable)
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
    /// Whether any is given.
    pub fn any(&self) -> bool {
        let lists = [
            &self.unknown,
            &self.nuisance,
            &self.limit_position,
            &self.limit_speed,
            &self.limit_force,
            &self.limit_box,
            &self.may_touch,
            &self.noise,
        ];
        lists.iter().any(|l| !l.is_empty())
            || self.objective.is_some()
            || self.seconds.is_some()
            || self.period.is_some()
    }
}

/// `config.toml`.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// Study, or model.
    pub machine: String,
    /// Engine; the default one where nothing is said.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub backend: Option<String>,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Method of the search.
    pub explorer: String,
    /// What is made small.
    pub objective: String,
    /// Length of the motion, s.
    pub seconds: f64,
    /// Rest behind it, s.
    pub rest_seconds: f64,
    /// Period of commands and readings, s.
    pub period: f64,
    /// Time to settle before the motion, s.
    pub settle: f64,
    /// Largest speed at rest, rad/s or m/s.
    pub rest_speed: f64,
    /// Whether the motion must end at rest.
    pub ends_at_rest: bool,
    /// Relative precision that repeats are counted for.
    pub precision: f64,
    /// Unknowns that are sought, `TARGET:LOW:HIGH`, with `:log` behind for a logarithmic scale.
    pub unknown: Vec<String>,
    /// Unknowns that are estimated along, likewise.
    pub nuisance: Vec<String>,
    /// Positions of joints, `JOINT:LOW:HIGH`, rad or m.
    pub limit_position: Vec<String>,
    /// Speeds of joints, `[JOINT:]SPEED`, rad/s or m/s.
    pub limit_speed: Vec<String>,
    /// Forces of drives, `[ACTUATOR:]FORCE`, N or N m.
    pub limit_force: Vec<String>,
    /// Boxes of bodies, `BODY:X0:X1:Y0:Y1:Z0:Z1`, m.
    pub limit_box: Vec<String>,
    /// Bodies that may touch, `BODY:BODY`.
    pub may_touch: Vec<String>,
    /// Noise by sensor, in its unit.
    pub noise: BTreeMap<String, f64>,
    /// How widely is searched.
    pub design: DesignSettings,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            machine: String::new(),
            backend: None,
            seed: 0,
            explorer: Method::FisherCem.name().to_owned(),
            objective: "a-optimal".into(),
            seconds: SECONDS,
            rest_seconds: SETTLE,
            period: PERIOD,
            settle: SETTLE,
            rest_speed: REST,
            ends_at_rest: true,
            precision: PRECISION,
            unknown: Vec::new(),
            nuisance: Vec::new(),
            limit_position: Vec::new(),
            limit_speed: Vec::new(),
            limit_force: Vec::new(),
            limit_box: Vec::new(),
            may_touch: Vec::new(),
            noise: BTreeMap::new(),
            design: DesignSettings::default(),
        }
    }
}

fn wrong(key: &str, message: impl Into<String>) -> anyhow::Error {
    Error::Config {
        key: key.into(),
        message: message.into(),
    }
    .into()
}

fn number(key: &str, text: &str) -> Result<f64> {
    let parsed: Option<f64> = text.trim().parse().ok().filter(|x: &f64| x.is_finite());
    parsed.ok_or_else(|| wrong(key, format!("`{text}` is not a finite number")))
}

/// A name, which may hold colons, and `N` numbers behind it.
fn name_and<const N: usize>(key: &str, text: &str) -> Result<(String, [f64; N])> {
    let parts: Vec<&str> = text.rsplitn(N + 1, ':').collect();
    let form = || {
        wrong(
            key,
            format!("`{text}` is not a name and {N} numbers, with colons between"),
        )
    };
    let Some((name, numbers)) = parts.split_last().filter(|(_, n)| n.len() == N) else {
        return Err(form());
    };
    let mut values = [0.0; N];
    for (to, part) in values.iter_mut().rev().zip(numbers) {
        *to = number(key, part)?;
    }
    Ok(((*name).to_owned(), values))
}

/// A name, or none, and a number above zero.
fn maybe_name(key: &str, text: &str) -> Result<(String, f64)> {
    let (name, value) = text.rsplit_once(':').unwrap_or(("", text));
    let value = number(key, value)?;
    if value <= 0.0 {
        return Err(wrong(key, format!("`{text}`: must be above 0")));
    }
    Ok((name.to_owned(), value))
}

impl Config {
    /// The settings of a file alone, for a machine.
    ///
    /// # Errors
    /// When the file cannot be read, or a setting is unknown or out of its domain.
    pub fn of_file(machine: &Path, file: &Path) -> Result<Self> {
        let common = Common {
            config: Some(file.to_owned()),
            ..Common::default()
        };
        Self::resolve(machine, &common, &Options::default())
    }

    /// The configuration file, `--set`, then the options.
    pub fn resolve(path: &Path, common: &Common, given: &Options) -> Result<Self> {
        let mut table = match &common.config {
            Some(path) => read_table(path)?,
            None => toml::Table::new(),
        };
        for setting in &common.set {
            set(&mut table, setting)?;
        }
        let mut config: Self = table
            .try_into()
            .map_err(|e: toml::de::Error| wrong("config", e.message().replace('\n', " ")))?;
        config.machine = path.display().to_string();
        config.backend = common.backend.clone().or(config.backend);
        config.seed = common.seed.unwrap_or(config.seed);
        for (to, from) in [
            (&mut config.unknown, &given.unknown),
            (&mut config.nuisance, &given.nuisance),
            (&mut config.limit_position, &given.limit_position),
            (&mut config.limit_speed, &given.limit_speed),
            (&mut config.limit_force, &given.limit_force),
            (&mut config.limit_box, &given.limit_box),
            (&mut config.may_touch, &given.may_touch),
        ] {
            to.extend(from.iter().cloned());
        }
        for text in &given.noise {
            let (name, [std]) = name_and("--noise", text)?;
            config.noise.insert(name, std);
        }
        config.objective = given.objective.clone().unwrap_or(config.objective);
        config.seconds = given.seconds.unwrap_or(config.seconds);
        config.period = given.period.unwrap_or(config.period);
        config.check()?;
        Ok(config)
    }

    fn check(&self) -> Result<()> {
        for (key, value, least) in [
            ("seconds", self.seconds, f64::MIN_POSITIVE),
            ("period", self.period, f64::MIN_POSITIVE),
            ("rest_speed", self.rest_speed, f64::MIN_POSITIVE),
            ("precision", self.precision, f64::MIN_POSITIVE),
            ("settle", self.settle, 0.0),
            ("rest_seconds", self.rest_seconds, 0.0),
        ] {
            if !(value.is_finite() && value >= least) {
                return Err(wrong(
                    key,
                    format!("{value} is out of its domain: a number above 0"),
                ));
            }
        }
        for (name, std) in &self.noise {
            if !(std.is_finite() && *std > 0.0) {
                return Err(wrong(
                    "noise",
                    format!("{name} = {std}: a standard deviation is above 0"),
                ));
            }
        }
        let design = &self.design;
        if design.population < 4 || design.knots < 2 || design.harmonics < 1 {
            return Err(wrong(
                "design",
                "population is at least 4, knots at least 2, harmonics at least 1",
            ));
        }
        Ok(())
    }

    /// The unknowns that are sought, then nuisance entries.
    pub fn parameters(&self, subject: &Subject) -> Result<Vec<Parameter>> {
        let mut all: Vec<Parameter> = subject
            .study
            .iter()
            .flat_map(|s| s.parameters.clone())
            .collect();
        let lists = [("--unknown", &self.unknown), ("--nuisance", &self.nuisance)];
        for (key, text) in lists
            .iter()
            .flat_map(|(k, l)| l.iter().map(move |t| (*k, t)))
        {
            let (text, scale) = match text.strip_suffix(":log") {
                Some(text) => (text, Scale::Log),
                None => (&**text, Scale::Linear),
            };
            let (target, range) = name_and::<2>(key, text)?;
            let parameter = Parameter {
                targets: vec![target.parse()?],
                name: target,
                range,
                scale,
                unit: String::new(),
            };
            parameter.check()?;
            all.push(parameter);
        }
        if self.sought(subject) == 0 {
            return Err(wrong(
                "--unknown",
                "nothing is sought: name an unknown, such as --unknown body/link/mass:0.5:1.5, or [[parameter]] in the study",
            ));
        }
        for (i, p) in all.iter().enumerate() {
            if all[..i]
                .iter()
                .any(|q| q.targets.iter().any(|t| p.targets.contains(t)))
            {
                return Err(wrong("--unknown", format!("`{}` is named twice", p.name)));
            }
            for target in &p.targets {
                subject.model.nominal(target)?;
            }
        }
        Ok(all)
    }

    /// Number of unknowns that are sought.
    pub fn sought(&self, subject: &Subject) -> usize {
        subject.study.as_ref().map_or(0, |s| s.parameters.len()) + self.unknown.len()
    }

    /// The values about which is designed: the model's own where they lie in the range, else its middle.
    pub fn values(&self, subject: &Subject, parameters: &[Parameter]) -> Result<Vec<f64>> {
        parameters
            .iter()
            .map(|p| {
                let own = subject.model.nominal(&p.targets[0])?;
                let inside = (p.range[0]..=p.range[1]).contains(&own) && !p.is_binary();
                Ok(if inside { own } else { p.center() })
            })
            .collect()
    }

    /// The limits that are asked for.
    pub fn limits(&self) -> Result<LimitRequest> {
        let mut request = LimitRequest {
            rest: self.ends_at_rest.then_some(self.rest_speed),
            ..LimitRequest::default()
        };
        for text in &self.limit_position {
            let (joint, range) = name_and("--limit-position", text)?;
            request.position.insert(joint, range);
        }
        for text in &self.limit_speed {
            let (joint, speed) = maybe_name("--limit-speed", text)?;
            request.speed.insert(joint, speed);
        }
        for text in &self.limit_force {
            let (actuator, force) = maybe_name("--limit-force", text)?;
            request.force.insert(actuator, force);
        }
        for text in &self.limit_box {
            let (body, [x0, x1, y0, y1, z0, z1]) = name_and("--limit-box", text)?;
            request.boxes.insert(body, [[x0, y0, z0], [x1, y1, z1]]);
        }
        for text in &self.may_touch {
            let pair = text
                .split_once(':')
                .filter(|(a, b)| !a.is_empty() && !b.is_empty());
            let (a, b) =
                pair.ok_or_else(|| wrong("--may-touch", format!("`{text}` is not BODY:BODY")))?;
            request.touch.push([a.to_owned(), b.to_owned()]);
        }
        Ok(request)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_may_hold_colons() {
        let (name, range) = name_and::<2>("k", "joint/robot:elbow/damping:0.1:2").unwrap();
        assert_eq!((&*name, range), ("joint/robot:elbow/damping", [0.1, 2.0]));
        assert!(name_and::<2>("k", "a:1").is_err());
        assert!(name_and::<1>("k", "a:x").is_err());
        assert_eq!(maybe_name("k", "2.5").unwrap(), (String::new(), 2.5));
        assert!(maybe_name("k", "a:-1").is_err());
    }
}
