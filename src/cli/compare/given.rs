//! The options that a command line gave, so that none is silently ignored.

use anyhow::Result;

use super::{Arguments, Parts, Real};
use crate::cli::settings::wrong;

/// Options for the place and the output of a result.
const OUTPUT: [&str; 3] = ["--out", "--quiet", "--json"];

/// Options of a merge; what finished comparisons contain cannot be chosen again.
const MERGE: [&str; 2] = ["--merge", "--across-commits"];

/// Options of every figure.
const FIGURE: [&str; 7] = [
    "--figure",
    "--seed",
    "--quick",
    "--threads",
    "--config",
    "--set",
    "--backend",
];

/// Options of a figure that plays episodes itself.
const EPISODES: [&str; 2] = ["--episodes", "--explorer"];

/// Options of a figure that consists of comparisons.
const COMPARISONS: [&str; 13] = [
    "TASK",
    "--levels",
    "--method",
    "--condition",
    "--world",
    "--seeds",
    "--train",
    "--preset",
    "--model",
    "--truth",
    "--real-backend",
    "--real-model",
    "--real-effect",
];

impl Arguments {
    /// Names of the options that were given.
    fn given(&self) -> Vec<&'static str> {
        let Self {
            tasks,
            method,
            condition,
            world,
            backend,
            seeds,
            seed,
            table,
            figure,
            episodes,
            explorer,
            levels,
            quick,
            train,
            shard,
            submit,
            jobs,
            sbatch,
            print_script,
            merge,
            across_commits,
            threads,
            config,
            preset,
            set,
            out,
            quiet,
            json,
            simulator,
            real,
            parts,
        } = self;
        let Real {
            truth,
            real_backend,
            real_model,
            real_effect,
        } = real;
        let Parts { identifier, solver } = parts;
        let all = [
            ("TASK", !tasks.is_empty()),
            ("--method", !method.is_empty()),
            ("--condition", !condition.is_empty()),
            ("--world", !world.is_empty()),
            ("--backend", !backend.is_empty()),
            ("--seeds", seeds.is_some()),
            ("--seed", seed.is_some()),
            ("--table", table.is_some()),
            ("--figure", figure.is_some()),
            ("--episodes", episodes.is_some()),
            ("--explorer", !explorer.is_empty()),
            ("--levels", levels.is_some()),
            ("--quick", *quick),
            ("--train", *train),
            ("--shard", shard.is_some()),
            ("--submit", submit.is_some()),
            ("--jobs", jobs.is_some()),
            ("--sbatch", !sbatch.is_empty()),
            ("--print-script", *print_script),
            ("--merge", !merge.is_empty()),
            ("--across-commits", *across_commits),
            ("--threads", threads.is_some()),
            ("--config", config.is_some()),
            ("--preset", preset.is_some()),
            ("--set", !set.is_empty()),
            ("--out", out.is_some()),
            ("--quiet", *quiet),
            ("--json", *json),
            ("--model", simulator.model.is_some()),
            ("--truth", !truth.is_empty()),
            ("--real-backend", real_backend.is_some()),
            ("--real-model", real_model.is_some()),
            ("--real-effect", !real_effect.is_empty()),
            ("--identifier", identifier.is_some()),
            ("--solver", solver.is_some()),
        ];
        let given = all.iter().filter(|(_, given)| *given);
        given.map(|(name, _)| *name).collect()
    }

    /// Refuses options that a figure does not use.
    ///
    /// # Errors
    /// When an option is given that it does not use, or there is no such figure.
    pub fn check_figure(&self, name: &str) -> Result<()> {
        let uses = crate::cli::figure::uses(name)?;
        let used = |option: &str| {
            let of_draw = match uses.comparisons {
                true => &COMPARISONS[..],
                false => &EPISODES[..],
            };
            let all = [&OUTPUT[..], &FIGURE, of_draw];
            all.iter().any(|some| some.contains(&option)) || (option == "TASK" && uses.tasks)
        };
        let unused = self.given().into_iter().find(|option| !used(option));
        if let Some(option) = unused {
            return Err(wrong(
                option,
                format!("the figure `{name}` does not use it: leave it out"),
            ));
        }
        if !uses.comparisons && self.backend.len() > 1 {
            let message = format!("the figure `{name}` is drawn on one engine: name one");
            return Err(wrong("--backend", message));
        }
        Ok(())
    }

    /// Refuses options that a merge does not use.
    ///
    /// # Errors
    /// When an option is given that it does not use.
    pub fn check_merge(&self) -> Result<()> {
        let used = |option: &str| MERGE.contains(&option) || OUTPUT.contains(&option);
        let Some(option) = self.given().into_iter().find(|option| !used(option)) else {
            return Ok(());
        };
        let message = "a merge does not use it, for it has what the folders hold: leave it out";
        Err(wrong(option, message))
    }
}
