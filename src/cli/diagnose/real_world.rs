//! A task in its simulated real world: the source of a diagnosis' logs, and the test of its answer.
//!
//! There is a single machine, whose hidden truth and perturbations are the same in every run. Start
//! poses, trackers' noise and wear are drawn anew for each seed.

use anyhow::Result;
use asid_algorithms::explore::{Discriminating, Rival};
use asid_core::{Episode, Explorer as _, Progress, RealWorld as _};
use asid_diagnosis::diagnose::Work;
use asid_diagnosis::findings::trials;
use asid_effects::EffectSpec;
use asid_effects::refined_model::RefinedModel;
use asid_results::diagnosis::{RealWorld, TaskTrial};
use asid_results::naming::{count, joined};

use super::super::model;
use super::super::options::{Algorithms, Common, Real, Worlds};
use super::super::run::pipeline;
use super::super::session::Session;
use super::config::{Config, Logs, RunLogs};

/// A task, its machine, and the number of runs.
pub struct Machine {
    task: String,
    common: Common,
    algorithms: Algorithms,
    worlds: Worlds,
    runs: usize,
    seeds: u64,
    logs: RunLogs,
}

/// Episodes that discriminate between explanations.
pub struct Experiments {
    /// Their logs.
    pub logs: Logs,
    /// Text on their purpose.
    pub what: String,
}

/// Largest number of explanations that are discriminated.
const RIVALS: usize = 3;
/// Least weight of a rival: an explanation that seems improbable may be so only on these data.
const LEAST: f64 = 0.1;
/// Offset between the seeds of the experiments and those of the runs.
const APART: u64 = 1000;

/// The most probable explanations, as simulators with their fitted values.
fn rivals(work: &Work) -> Result<Vec<Rival>> {
    let hypotheses = work.judgement.hypotheses.iter();
    // A set that was only screened has no fitted values to play with.
    let fitted = hypotheses.filter(|h| h.found.is_some() || h.labels.is_empty());
    fitted
        .take(RIVALS)
        .map(|h| {
            let (members, explanation) = match h.found {
                Some(i) => {
                    let found = &work.findings.found[i];
                    (&found.candidates[..], &found.explanation)
                }
                None => (&[][..], &work.findings.none),
            };
            let trials = trials(&work.candidates, members, explanation);
            let specs: Vec<EffectSpec> = trials.iter().map(|(c, _)| c.spec.clone()).collect();
            let unknowns = work.bench.unknowns(&trials).into_iter();
            Ok(Rival {
                label: match h.labels.as_slice() {
                    [] => "no effect".to_owned(),
                    labels => labels.join(" + "),
                },
                model: work.bench.machine.with(&specs)?,
                parameters: unknowns.map(|u| u.parameter).collect(),
                theta: explanation.fit.point.theta.clone(),
                weight: h.probability.max(LEAST),
            })
        })
        .collect()
}

/// One run of the pipeline.
pub struct Run {
    value: f64,
    success: bool,
    exploration: Option<Episode>,
    attempt: Episode,
}

impl Machine {
    /// The machine that the settings describe; `of_run` are those of the task's runs.
    pub fn new(
        config: &Config,
        of_run: toml::Table,
        common: &Common,
        algorithms: &Algorithms,
        worlds: &Worlds,
    ) -> Result<Self> {
        let mut machine = Self {
            task: config.task.clone().unwrap_or_default(),
            common: Common {
                backend: Some(config.backend.clone()),
                seed: Some(config.seed),
                machine: Some(config.seed),
                threads: common.threads,
                base: of_run,
                quiet: true,
                ..Common::default()
            },
            algorithms: algorithms.clone(),
            worlds: worlds.clone(),
            runs: config.runs.unwrap_or_default(),
            seeds: config.seeds.unwrap_or_default(),
            logs: config.logs.unwrap_or_default(),
        };
        machine.worlds.simulator.model.clone_from(&config.model);
        // The truth is drawn once.
        let session = machine.session(0, &machine.worlds)?;
        let truth = session.parameters.iter().zip(session.truth());
        machine.worlds.real.truth = truth.map(|(p, x)| format!("{}={x:?}", p.name)).collect();
        Ok(machine)
    }

    fn session(&self, k: u64, worlds: &Worlds) -> Result<Session> {
        let mut common = self.common.clone();
        common.seed = common.seed.map(|seed| seed + k);
        Session::open(&self.task, &common, &self.algorithms, worlds)
    }

    /// The resolved settings of its runs.
    pub fn settings(&self) -> Result<toml::Table> {
        let config = self.session(0, &self.worlds)?.config;
        Ok(toml::Table::try_from(&config)?)
    }

    fn play(&self, n: u64, worlds: &Worlds, progress: &dyn Progress) -> Result<Vec<Run>> {
        (0..n)
            .map(|k| {
                let session = self.session(k, worlds)?;
                let outcome = pipeline(&session, &session.truth())?;
                progress.advance(1);
                Ok(Run {
                    value: outcome.attempt.outcome.value,
                    success: outcome.attempt.outcome.success,
                    exploration: outcome.real.map(|r| r.episode),
                    attempt: outcome.attempt.episode,
                })
            })
            .collect()
    }

    /// Runs with the model as given: those that are diagnosed, and those that are counted.
    pub fn before(&self, diagnosed: bool, progress: &dyn Progress) -> Result<Vec<Run>> {
        let n = if diagnosed {
            self.seeds.max(self.runs as u64)
        } else {
            self.seeds
        };
        progress.begin("running the task", n);
        let runs = self.play(n, &self.worlds, progress)?;
        progress.end();
        Ok(runs)
    }

    /// The logs of the first runs; the last third is held out.
    pub fn logs(&self, runs: &[Run]) -> Logs {
        let held = (self.runs / 3).max(1);
        let mut logs: Logs = (Vec::new(), Vec::new());
        for (k, run) in runs.iter().take(self.runs).enumerate() {
            let to = if k + held < self.runs {
                &mut logs.0
            } else {
                &mut logs.1
            };
            let explored = run.exploration.iter().map(|e| ("exploration", e));
            let explored = explored.filter(|_| self.logs.exploration());
            let attempt = self.logs.attempt().then_some(("attempt", &run.attempt));
            let both = explored.chain(attempt);
            to.extend(both.map(|(what, e)| (format!("run {}, {what}", k + 1), e.clone())));
        }
        logs
    }

    /// Plays `n` episodes in which the predictions of the most probable explanations differ most.
    ///
    /// The last third is held out. `None` where there is a single explanation.
    pub fn tell_apart(
        &self,
        work: &Work,
        n: usize,
        progress: &dyn Progress,
    ) -> Result<Option<Experiments>> {
        let rivals = rivals(work)?;
        if rivals.len() < 2 {
            return Ok(None);
        }
        let labels: Vec<String> = rivals.iter().map(|r| r.label.clone()).collect();
        let explorer = Discriminating::new(rivals)?;
        let held = if n > 1 { (n / 3).max(1) } else { 0 };
        let mut logs: Logs = (Vec::new(), Vec::new());
        progress.begin("telling apart", n as u64);
        for k in 0..n {
            let session = self.session(APART + k as u64, &self.worlds)?;
            let problem = session.problem();
            let mut explored = explorer.explore(&problem, None)?;
            let mut world = session.world(&session.truth())?;
            let played = world.explore(&mut *explored.policy)?;
            let to = if k + held < n {
                &mut logs.0
            } else {
                &mut logs.1
            };
            to.push((format!("experiment {}", k + 1), played.episode));
            progress.advance(1);
        }
        progress.end();
        let what = format!(
            "{} played to tell apart {}",
            count(n, "episode"),
            joined(&labels, "and")
        );
        Ok(Some(Experiments { logs, what }))
    }

    /// Compares the task in three settings: in the real world with the model as given, there with
    /// the verdict's effects added to it, and in a real world without its effects.
    pub fn compare(
        &self,
        before: &[Run],
        effects: &[EffectSpec],
        progress: &dyn Progress,
    ) -> Result<RealWorld> {
        let n = self.seeds;
        let session = self.session(0, &self.worlds)?;
        let counted = &before[..before.len().min(n as usize)];
        let mut trials = Vec::new();
        let real = &session.config.real;
        if !real.is_scene_on(&session.config.backend) {
            progress.begin("without the effect", n);
            let plain = Worlds {
                real: Real {
                    truth: self.worlds.real.truth.clone(),
                    ..Real::default()
                },
                ..self.worlds.clone()
            };
            let mut ideal = Self {
                worlds: plain.clone(),
                common: self.common.clone(),
                task: self.task.clone(),
                algorithms: self.algorithms.clone(),
                ..*self
            };
            ideal.common.base.remove("real");
            let runs = ideal.play(n, &plain, progress)?;
            trials.push(trial(
                "a real world without the effect",
                "the model as given",
                &runs,
            ));
            progress.end();
        }
        let here = "the real world";
        trials.push(trial(here, "the model as given", counted));
        if !effects.is_empty() {
            progress.begin("with the refined model", n);
            let mut worlds = self.worlds.clone();
            let source = match &self.worlds.simulator.model {
                Some(path) => RefinedModel::open(path)?,
                None => model::of_task(&*session.task),
            };
            worlds.simulator = super::super::options::Simulator {
                model: None,
                refined: Some(RefinedModel {
                    effects: [&source.effects[..], effects].concat(),
                    ..source
                }),
            };
            let runs = self.play(n, &worlds, progress)?;
            trials.push(trial(here, "the refined model", &runs));
            progress.end();
        }
        let protocol = session.task.downstream();
        let truth = session.parameters.iter().zip(session.truth());
        Ok(RealWorld {
            task: self.task.clone(),
            condition: session.config.condition.clone().unwrap_or_default(),
            metric: protocol.metric.clone(),
            unit: protocol.unit.clone(),
            rule: protocol.rule.clone(),
            effects: real.effects.clone(),
            experiments: String::new(),
            truth: truth.map(|(p, x)| (p.name.clone(), x)).collect(),
            trials,
        })
    }
}

fn trial(world: &str, simulator: &str, runs: &[Run]) -> TaskTrial {
    TaskTrial {
        world: world.to_owned(),
        simulator: simulator.to_owned(),
        values: runs.iter().map(|r| r.value).collect(),
        successes: runs.iter().filter(|r| r.success).count(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Symptom: `asid diagnose --task TASK --world perturbed` found no value of a mass or of a
    /// delay that fits all of its logs. Cause: the seed of each run drew another perturbation, so
    /// that the logs were those of as many machines.
    #[test]
    fn all_runs_are_of_one_perturbed_machine() {
        let task = "sphere-striking";
        let config: Config = toml::from_str(&format!("task = \"{task}\"")).unwrap();
        let worlds = Worlds {
            real: Real {
                world: Some("perturbed".into()),
                ..Real::default()
            },
            ..Worlds::default()
        };
        let of = |session: Session| session.perturbed().unwrap().drawn.clone();
        let algorithms = Algorithms::default();
        let of_run = toml::Table::new();
        let machine =
            Machine::new(&config, of_run, &Common::default(), &algorithms, &worlds).unwrap();
        let run = |k| of(machine.session(k, &machine.worlds).unwrap());
        assert_eq!(run(0), run(3));
        // Runs of their own are of as many machines as seeds; the first is the same.
        let alone = |seed| {
            let common = Common {
                backend: Some(config.backend.clone()),
                seed: Some(seed),
                ..Common::default()
            };
            of(Session::open(task, &common, &algorithms, &worlds).unwrap())
        };
        assert_eq!(alone(0), run(0));
        assert_ne!(alone(0), alone(3));
    }
}
