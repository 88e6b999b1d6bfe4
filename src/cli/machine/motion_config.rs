//! The settings of a motion's design: unknowns, limits and search.

mod options;
mod text;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::Result;
use asid_core::parameter::Scale;
use asid_core::{Parameter, Target};
use asid_sysid::limits::{LimitRequest, REST};
use asid_sysid::method::{DesignSettings, Method};
use serde::{Deserialize, Serialize};

use super::Subject;
use crate::cli::options::Common;
use crate::cli::settings::{given, parsed, wrong};
pub use options::Options;
use text::{maybe_name, name_and};

/// Default length of a motion, s: some swings of an arm.
const SECONDS: f64 = 5.0;

/// Default period of commands and readings, s: that of most robots' loggers.
const PERIOD: f64 = 0.01;

/// Time to settle before a motion, and to come to rest after it, s: several times an arm's slowest
/// decay.
const SETTLE: f64 = 1.0;

/// Largest number of physics steps of a motion, with the time to settle and the rest. The state is
/// recorded after each step in a batch of 256 plays, which with 20 numbers each takes 4 GB. 100 000
/// steps of 2 ms are 200 s, many swings of any machine.
const MOST_STEPS: f64 = 1e5;

/// Relative precision for which repeats are counted.
const PRECISION: f64 = 0.01;

/// `config.toml`.
#[derive(Clone, Debug, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// Study, or model.
    pub machine: String,
    /// The model in place of a study's own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub model: Option<PathBuf>,
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
            model: None,
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
    pub fn resolve(path: &Path, common: &Common, options: &Options) -> Result<Self> {
        let mut config: Self = parsed(given(common)?)?;
        config.machine = path.display().to_string();
        config.backend = common.backend.clone().or(config.backend);
        config.seed = common.seed.unwrap_or(config.seed);
        for (to, from) in [
            (&mut config.unknown, &options.unknown),
            (&mut config.nuisance, &options.nuisance),
            (&mut config.limit_position, &options.limit_position),
            (&mut config.limit_speed, &options.limit_speed),
            (&mut config.limit_force, &options.limit_force),
            (&mut config.limit_box, &options.limit_box),
            (&mut config.may_touch, &options.may_touch),
        ] {
            to.extend(from.iter().cloned());
        }
        for text in &options.noise {
            let (name, [std]) = name_and("--noise", text)?;
            config.noise.insert(name, std);
        }
        config.objective = options.objective.clone().unwrap_or(config.objective);
        config.seconds = options.seconds.unwrap_or(config.seconds);
        config.period = options.period.unwrap_or(config.period);
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
                let domain = if least > 0.0 { "above 0" } else { "from 0 up" };
                return Err(wrong(
                    key,
                    format!("{value} is out of its domain: a number {domain}"),
                ));
            }
        }
        // A motion of a single command leaves nothing to search.
        if self.period > 0.5 * self.seconds {
            return Err(wrong(
                "period",
                format!(
                    "{} s is longer than half of the motion of {} s: a motion has several commands",
                    self.period, self.seconds
                ),
            ));
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

    /// Refuses a motion with more physics steps than can be played at once.
    ///
    /// # Errors
    /// When there are more than [`MOST_STEPS`].
    fn check_steps(&self, timestep: f64) -> Result<()> {
        let seconds = self.seconds + self.rest_seconds + self.settle;
        let steps = seconds / timestep;
        if steps <= MOST_STEPS {
            return Ok(());
        }
        Err(wrong(
            "seconds",
            format!(
                "{seconds} s with settling and rest are {steps:.0} physics steps of {timestep} s, and {MOST_STEPS} are the most: ask for a \
                 motion of at most {} s in all, and play it several times",
                MOST_STEPS * timestep
            ),
        ))
    }

    /// The unknowns to identify, then nuisance entries.
    pub fn parameters(&self, subject: &Subject) -> Result<Vec<Parameter>> {
        // Check this before any work.
        self.check_steps(subject.plant.layout.timestep)?;
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
                ends_apart(subject, &all, p, target)?;
            }
        }
        Ok(all)
    }

    /// Number of unknowns to identify.
    pub fn sought(&self, subject: &Subject) -> usize {
        subject.study.as_ref().map_or(0, |s| s.parameters.len()) + self.unknown.len()
    }

    /// The values at which the motion is designed: the model's own where they lie in the range,
    /// else its middle.
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

    /// The requested limits.
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

/// Refuses a range in which one end of a drive's force limits could pass the other.
fn ends_apart(
    subject: &Subject,
    all: &[Parameter],
    own: &Parameter,
    target: &Target,
) -> Result<()> {
    let is_end = target.element == "actuator" && target.attribute == "forcerange";
    if !is_end || target.index > 1 {
        return Ok(());
    }
    let values = |p: &Parameter| {
        let [a, b] = p.range.map(|x| p.setting(x));
        [a.min(b), a.max(b)]
    };
    let other = Target {
        index: 1 - target.index,
        ..target.clone()
    };
    let [low, high] = values(own);
    let there = match all.iter().find(|p| p.targets.contains(&other)) {
        Some(unknown) => values(unknown),
        None => [subject.model.nominal(&other)?; 2],
    };
    let (passes, side) = match target.index {
        0 => (high > there[0], "upper"),
        _ => (low < there[1], "lower"),
    };
    if passes {
        return Err(wrong(
            "--unknown",
            format!(
                "the range {low} to {high} of `{}` passes the {side} limit of the same force, which is {}: give a range that ends before it",
                own.name,
                if there[0] == there[1] {
                    there[0].to_string()
                } else {
                    format!("{} to {}", there[0], there[1])
                }
            ),
        ));
    }
    Ok(())
}
