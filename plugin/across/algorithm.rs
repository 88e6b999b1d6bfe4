//! Explorers, identifiers, solvers, effects, and what they make.

use std::ops::Deref;
use std::path::Path;

use asid_core::episode::Episode;
use asid_core::error::Result;
use asid_core::explore::{CurvePoint, Explored, Explorer, Policy};
use asid_core::identify::{Assumptions, Identified, Identifier};
use asid_core::posterior::Posterior;
use asid_core::problem::Problem;
use asid_core::simulator::StepView;
use asid_core::solve::{Solved, TaskPolicy, TaskSolver};
use asid_effects::{
    Acting, Acts, Confusion, Effect, EffectParameter, Native, Reach, Reference, Site,
};
use asid_mjcf::native::NativeModel;
use asid_mjcf::plant::{ForceLimit, Plant};

use super::super::border::Border;
use super::{Across, identified};
use asid_core::backend::{Capabilities, Model};
use asid_core::progress::Progress;
use asid_core::target::Target;
use asid_core::task::Task;

/// The objects that a problem refers to, wrapped for the other side.
struct Handed<'a> {
    task: Across<&'a dyn Task>,
    model: Across<&'a dyn Model>,
    progress: Across<&'a dyn Progress>,
}

impl<'a> Handed<'a> {
    fn new(problem: &Problem<'a>, border: Border) -> Self {
        Self {
            task: Across::new(problem.task, border),
            model: Across::new(problem.model, border),
            progress: Across::new(problem.progress, border),
        }
    }

    fn problem<'b>(&'b self, problem: &'b Problem<'a>) -> Problem<'b> {
        Problem {
            task: &self.task,
            model: &self.model,
            progress: &self.progress,
            capabilities: problem.capabilities,
            parameters: problem.parameters,
            signals: problem.signals,
            threads: problem.threads,
            streams: problem.streams,
            physics_counter: problem.physics_counter,
            env_counter: problem.env_counter,
        }
    }

    /// The problem for an object that keeps it.
    ///
    /// Its small memory is never freed, because it must outlive what the other side makes of it.
    fn kept(problem: &'a Problem<'a>, border: Border) -> &'a Problem<'a> {
        let handed: &'a Self = Box::leak(Box::new(Self::new(problem, border)));
        Box::leak(Box::new(handed.problem(problem)))
    }
}

impl<T> Explorer for Across<T>
where
    T: Deref + Send + Sync,
    T::Target: Explorer,
{
    fn explore<'a>(
        &'a self,
        problem: &'a Problem<'a>,
        start: Option<&[f64]>,
    ) -> Result<Explored<'a>> {
        let problem = Handed::kept(problem, self.border.back());
        let explored = self.border.try_run(|| self.inner.explore(problem, start))?;
        Ok(Explored {
            policy: Box::new(Across::new(explored.policy, self.border)),
            ..explored
        })
    }

    fn train(&self, problem: &Problem<'_>, file: &Path) -> Result<bool> {
        let handed = Handed::new(problem, self.border.back());
        let problem = handed.problem(problem);
        self.try_run(|explorer| explorer.train(&problem, file))
    }
}

impl Policy for Across<Box<dyn Policy + '_>> {
    fn reset(&mut self) {
        self.run_mut(|policy| policy.reset());
    }

    fn act(&mut self, step: usize, reading: &[f64], action: &mut [f64]) -> Result<()> {
        self.try_run_mut(|policy| policy.act(step, reading, action))?;
        self.border
            .finite(reading, action, "an action of the policy")
    }

    fn is_open_loop(&self) -> bool {
        self.run(|policy| policy.is_open_loop())
    }

    fn take_curve(&mut self) -> Vec<CurvePoint> {
        self.run_mut(|policy| policy.take_curve())
    }

    fn export(&self) -> serde_json::Value {
        self.run(|policy| policy.export())
    }
}

impl Identifier for Across<Box<dyn Identifier>> {
    fn identify(&self, problem: &Problem<'_>, episodes: &[Episode]) -> Result<Identified> {
        let handed = Handed::new(problem, self.border.back());
        let problem = handed.problem(problem);
        let found = self.try_run(|identifier| identifier.identify(&problem, episodes))?;
        let checked = identified::check(&found, &problem, episodes);
        self.border.require(checked)?;
        Ok(found)
    }

    fn assumes(&self) -> Assumptions {
        self.run(|identifier| identifier.assumes())
    }

    fn train(&self, problem: &Problem<'_>, explorer: &dyn Explorer, file: &Path) -> Result<bool> {
        let back = self.border.back();
        let handed = Handed::new(problem, back);
        let problem = handed.problem(problem);
        let explorer = Across::new(explorer, back);
        self.try_run(|identifier| identifier.train(&problem, &explorer, file))
    }
}

impl TaskSolver for Across<Box<dyn TaskSolver>> {
    fn solve<'a>(&'a self, problem: &'a Problem<'a>, belief: &Posterior) -> Result<Solved<'a>> {
        let problem = Handed::kept(problem, self.border.back());
        let solved = self.border.try_run(|| self.inner.solve(problem, belief))?;
        Ok(Solved {
            policy: Box::new(Across::new(solved.policy, self.border)),
            ..solved
        })
    }
}

impl TaskPolicy for Across<Box<dyn TaskPolicy + '_>> {
    fn act(&mut self, start: &[f64], action: &mut [f64]) -> Result<()> {
        self.try_run_mut(|policy| policy.act(start, action))?;
        self.border
            .finite(start, action, "an action of the task policy")
    }
}

impl Effect for Across<Box<dyn Effect>> {
    fn acts(&self) -> Acts {
        self.run(|effect| effect.acts())
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        self.run(|effect| effect.parameters())
    }

    fn sites(&self, plant: &Plant) -> Vec<String> {
        self.run(|effect| effect.sites(plant))
    }

    fn targets(&self, plant: &Plant, site: &str) -> Vec<Target> {
        self.run(|effect| effect.targets(plant, site))
    }

    fn reach(&self, plant: &Plant, site: &str) -> Reach {
        self.run(|effect| effect.reach(plant, site))
    }

    fn steps(&self) -> bool {
        self.run(|effect| effect.steps())
    }

    fn takes_drive(&self) -> bool {
        self.run(|effect| effect.takes_drive())
    }

    fn force_limit(&self, values: &[f64]) -> Option<ForceLimit> {
        self.run(|effect| effect.force_limit(values))
    }

    fn remembers_readings(&self) -> bool {
        self.run(|effect| effect.remembers_readings())
    }

    fn refines(&self) -> &'static [&'static str] {
        self.run(|effect| effect.refines())
    }

    fn takes_over(&self) -> &'static [(&'static str, &'static str)] {
        self.run(|effect| effect.takes_over())
    }

    fn mistaken_for(&self) -> &'static [Confusion] {
        self.run(|effect| effect.mistaken_for())
    }

    fn unusual_at(&self, plant: &Plant, site: &str) -> bool {
        self.run(|effect| effect.unusual_at(plant, site))
    }

    fn goes_with(&self) -> &'static [&'static str] {
        self.run(|effect| effect.goes_with())
    }

    fn tolerance(
        &self,
        plant: &Plant,
        site: &str,
        shown: &dyn Fn(Reference) -> f64,
    ) -> Vec<[f64; 2]> {
        let tolerance = self.run(|effect| effect.tolerance(plant, site, shown));
        let bounds: Vec<f64> = tolerance.iter().flatten().copied().collect();
        self.border
            .check_finite(&[], &bounds, "a tolerance of an effect");
        tolerance
    }

    fn rounds(&self) -> bool {
        self.run(|effect| effect.rounds())
    }

    fn delays(&self) -> bool {
        self.run(|effect| effect.delays())
    }

    fn shifts_readings(&self) -> bool {
        self.run(|effect| effect.shifts_readings())
    }

    fn counts_episodes(&self) -> bool {
        self.run(|effect| effect.counts_episodes())
    }

    fn needs(&self) -> Capabilities {
        self.run(|effect| effect.needs())
    }

    fn native(&self, site: &Site<'_>, document: &mut NativeModel<'_>) -> Result<Native> {
        self.try_run(|effect| effect.native(site, document))
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let acting = self.try_run(|effect| effect.attach(site))?;
        Ok(Box::new(Across::new(acting, self.border)))
    }
}

impl Acting for Across<Box<dyn Acting>> {
    fn set(&self, columns: &mut [f64]) {
        self.run(|acting| acting.set(columns));
        self.border
            .check_finite(&[], columns, "a parameter set by an effect");
    }

    fn before_step(&mut self, view: &mut StepView<'_>) {
        self.run_mut(|acting| acting.before_step(view));
        let given = [view.qpos, view.qvel];
        if given.iter().all(|v| v.iter().all(|x| x.is_finite())) {
            self.border
                .check_finite(&[], view.ctrl, "the command of an effect");
            self.border
                .check_finite(&[], view.force, "the force of an effect");
            self.border
                .check_finite(&[], view.parameters, "a parameter set by an effect");
        }
    }

    fn read(&mut self, time: f64, reading: &mut [f64]) {
        self.run_mut(|acting| acting.read(time, reading));
    }

    fn displaced(&mut self, from: [&[f64]; 2], to: [&[f64]; 2]) {
        self.run_mut(|acting| acting.displaced(from, to));
    }

    fn restart(&mut self) {
        self.run_mut(|acting| acting.restart());
    }

    fn save(&self, memory: &mut Vec<f64>) {
        self.run(|acting| acting.save(memory));
    }

    fn load(&mut self, memory: &[f64]) {
        self.run_mut(|acting| acting.load(memory));
    }
}

impl Progress for Across<&dyn Progress> {
    fn begin(&self, stage: &str, total: u64) {
        self.run(|progress| progress.begin(stage, total));
    }

    fn advance(&self, units: u64) {
        self.run(|progress| progress.advance(units));
    }

    fn note(&self, text: &str) {
        self.run(|progress| progress.note(text));
    }

    fn ranking(&self, stage: &str, rows: &[(String, f64)]) {
        self.run(|progress| progress.ranking(stage, rows));
    }

    fn is_stopped(&self) -> bool {
        self.run(|progress| progress.is_stopped())
    }

    fn is_late(&self) -> bool {
        self.run(|progress| progress.is_late())
    }

    fn end(&self) {
        self.run(|progress| progress.end());
    }
}
