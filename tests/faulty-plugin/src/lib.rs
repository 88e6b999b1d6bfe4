//! A plugin for tests, each part of which fails in its own way.
//!
//! The tasks are `payload-swing` with one failing method.

use asid_core::explore::{Explored, Explorer, Policy};
use asid_core::identify::{Identified, Identifier};
use asid_core::registry::Settings;
use asid_core::simulator::StepView;
use asid_core::solve::{Solved, TaskSolver};
use asid_core::task::{Commander, Outcome, Task, TaskSpec};
use asid_core::{Episode, Error, Layout, Posterior, Problem, Result};
use asid_effects::{Acting, Acts, Effect, EffectParameter, Site};
use asid_mjcf::Plant;
use payload_swing::PayloadSwing;

asid_plugin::export_plugin!();

/// The part of a task that fails.
#[derive(Clone, Copy, PartialEq)]
enum Fault {
    OutcomePanics,
    OutcomeIsNan,
    MetricIsNan,
    AttemptPanics,
    AttemptFails,
    CommandsPanic,
    LocateIsLong,
}

/// `payload-swing` with a fault.
struct Faulty {
    inner: PayloadSwing,
    fault: Fault,
}

macro_rules! faulty_tasks {
    ($($name:literal: $fault:ident),* $(,)?) => {$(
        asid_core::register!(TaskEntry {
            name: $name,
            about: "fails",
            make: || Ok(Box::new(Faulty {
                inner: PayloadSwing::new()?,
                fault: Fault::$fault,
            })),
        });
    )*};
}

faulty_tasks! {
    "outcome-panics": OutcomePanics,
    "outcome-is-nan": OutcomeIsNan,
    "metric-is-nan": MetricIsNan,
    "attempt-panics": AttemptPanics,
    "attempt-fails": AttemptFails,
    "commands-panic": CommandsPanic,
    "locate-is-long": LocateIsLong,
}

asid_core::register!(TaskEntry {
    name: "make-panics",
    about: "fails",
    make: || panic!("the task cannot be made"),
});

impl Task for Faulty {
    fn spec(&self) -> &TaskSpec {
        self.inner.spec()
    }

    fn place(&self, layout: &Layout, start: &[f64], qpos: &mut [f64]) -> Result<()> {
        self.inner.place(layout, start, qpos)
    }

    fn locate(&self, signals: &[f64]) -> Vec<f64> {
        let mut start = self.inner.locate(signals);
        if self.fault == Fault::LocateIsLong {
            start.push(0.0);
        }
        start
    }

    fn commander(&self) -> Result<Box<dyn Commander>> {
        match self.fault {
            Fault::CommandsPanic => Ok(Box::new(Panicking)),
            _ => self.inner.commander(),
        }
    }

    fn attempt(&self, start: &[f64], action: &[f64]) -> Result<Vec<f64>> {
        match self.fault {
            Fault::AttemptPanics => panic!("no torque for the attempt"),
            Fault::AttemptFails => Err(Error::Failed("the motor is too weak".into())),
            _ => self.inner.attempt(start, action),
        }
    }

    fn metric(&self, readings: &[f64]) -> Vec<f64> {
        match self.fault {
            Fault::MetricIsNan => vec![f64::NAN; readings.len()],
            _ => self.inner.metric(readings),
        }
    }

    fn outcome(&self, readings: &[f64]) -> Outcome {
        let outcome = self.inner.outcome(readings);
        match self.fault {
            Fault::OutcomePanics => panic!("the outcome of\nseveral lines"),
            Fault::OutcomeIsNan => Outcome {
                value: f64::NAN,
                ..outcome
            },
            _ => outcome,
        }
    }
}

/// A commander that panics.
struct Panicking;

impl Commander for Panicking {
    fn reset(&mut self) {}

    fn commands(&mut self, _action: &[f64], _ctrl: &mut [f64]) {
        panic!("no commands today");
    }
}

/// An explorer that fails in one way.
struct FaultyExplorer(fn(&Problem<'_>));

macro_rules! faulty_explorers {
    ($($name:literal: $fault:expr),* $(,)?) => {$(
        asid_core::register!(ExplorerEntry {
            name: $name,
            about: "fails",
            defaults: Settings::new,
            make: |_| Ok(Box::new(FaultyExplorer($fault))),
        });
    )*};
}

faulty_explorers! {
    "explore-panics": |_| panic!("nothing to explore"),
    "explore-panics-in-a-thread": |_| {
        let thread = std::thread::spawn(|| -> () { panic!("nothing in the thread") });
        let joined: std::thread::Result<()> = thread.join();
        if let Err(payload) = joined {
            std::panic::resume_unwind(payload);
        }
    },
    // A reading without values: an index out of bounds, on the task's side.
    "explore-makes-the-task-panic": |problem| drop(problem.task.locate(&[])),
    "act-panics": |_| {},
}

impl Explorer for FaultyExplorer {
    fn explore<'a>(
        &'a self,
        problem: &'a Problem<'a>,
        _start: Option<&[f64]>,
    ) -> Result<Explored<'a>> {
        (self.0)(problem);
        Ok(Explored {
            policy: Box::new(PanickingPolicy),
            curve: Vec::new(),
            curve_label: "",
            objective: String::new(),
        })
    }
}

/// A policy that panics when it is used, and again when it is dropped.
struct PanickingPolicy;

impl Policy for PanickingPolicy {
    fn reset(&mut self) {}

    fn act(&mut self, _step: usize, _reading: &[f64], _action: &mut [f64]) -> Result<()> {
        panic!("no action comes to mind");
    }

    fn export(&self) -> serde_json::Value {
        serde_json::Value::Null
    }
}

impl Drop for PanickingPolicy {
    fn drop(&mut self) {
        panic!("cannot be dropped");
    }
}

/// An identifier with a result that is corrupted in one way.
struct FaultyIdentifier(fn(&mut Identified));

macro_rules! faulty_identifiers {
    ($($name:literal: $fault:expr),* $(,)?) => {$(
        asid_core::register!(IdentifierEntry {
            name: $name,
            about: "fails",
            defaults: Settings::new,
            make: |_| Ok(Box::new(FaultyIdentifier($fault))),
        });
    )*};
}

faulty_identifiers! {
    "identifies-without-starts": |found| found.starts.clear(),
    "identifies-short-starts": |found| found.starts[0].push(0.0),
    "identifies-without-marginals": |found| found.posterior.marginals.clear(),
    "identifies-without-samples": |found| found.posterior.samples.clear(),
    "identifies-negative-weights": |found| found.posterior.weights = vec![1.5, -0.5],
    "identifies-weights-that-do-not-sum": |found| found.posterior.weights = vec![1.0, 1.0],
    "identifies-few-weights": |found| found.posterior.weights = vec![1.0],
    "identifies-long-samples": |found| found.posterior.samples[1].push(0.0),
    "identifies-nan-residual": |found| found.residual = f64::NAN,
    "identifies-negative-misfit": |found| found.misfit = Some(-1.0),
}

impl Identifier for FaultyIdentifier {
    fn identify(&self, problem: &Problem<'_>, episodes: &[Episode]) -> Result<Identified> {
        let centre: Vec<f64> = problem.parameters.iter().map(|p| p.center()).collect();
        let samples = vec![centre.clone(), centre];
        let coordinates = problem.task.exploration().start.len();
        let mut found = Identified {
            posterior: Posterior::from_samples(problem.parameters, samples, &[1.0, 1.0]),
            starts: vec![vec![0.0; coordinates]; episodes.len()],
            iterations: Vec::new(),
            residual: 1.0,
            misfit: Some(1.0),
            roughness: 0.0,
        };
        (self.0)(&mut found);
        Ok(found)
    }
}

/// An identifier and a solver that panic.
struct PanickingAlgorithm;

asid_core::register!(IdentifierEntry {
    name: "identify-panics",
    about: "fails",
    defaults: Settings::new,
    make: |_| Ok(Box::new(PanickingAlgorithm)),
});

asid_core::register!(SolverEntry {
    name: "solve-panics",
    about: "fails",
    defaults: Settings::new,
    make: |_| Ok(Box::new(PanickingAlgorithm)),
});

impl Identifier for PanickingAlgorithm {
    fn identify(&self, _problem: &Problem<'_>, _episodes: &[Episode]) -> Result<Identified> {
        panic!("no posterior");
    }
}

impl TaskSolver for PanickingAlgorithm {
    fn solve<'a>(&'a self, _problem: &'a Problem<'a>, _belief: &Posterior) -> Result<Solved<'a>> {
        panic!("no solution");
    }
}

/// An effect whose force fails.
struct FaultyEffect(fn() -> f64);

asid_effects::register!(EffectEntry {
    name: "force-panics",
    about: "fails",
    make: || Box::new(FaultyEffect(|| panic!("no force"))),
});

asid_effects::register!(EffectEntry {
    name: "force-is-nan",
    about: "fails",
    make: || Box::new(FaultyEffect(|| f64::NAN)),
});

impl Effect for FaultyEffect {
    fn acts(&self) -> Acts {
        Acts::Force
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        &[]
    }

    fn sites(&self, _: &Plant) -> Vec<String> {
        vec![String::new()]
    }

    fn attach(&self, _: &Site<'_>) -> Result<Box<dyn Acting>> {
        Ok(Box::new(FaultyForce(self.0)))
    }
}

/// The force of [`FaultyEffect`].
struct FaultyForce(fn() -> f64);

impl Acting for FaultyForce {
    fn before_step(&mut self, view: &mut StepView<'_>) {
        view.force.fill((self.0)());
    }
}
