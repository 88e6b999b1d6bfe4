//! Answers all cases, then reads the labels and scores.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use anyhow::Result;
use asid_core::registry::all;
use asid_core::{Backend, Error, Progress as _};
use asid_effects::EffectEntry;
use asid_scorer::answer::Answer;
use asid_scorer::board::Score;
use asid_scorer::case::{Case as Scored, Run};
use asid_scorer::judge::Judge;
use asid_scorer::label::{Label, read_labels};
use asid_scorer::oracle::oracle;
use asid_scorer::physics::{self, Physics};
use asid_scorer::sites::Sites;

use super::Arguments;
use super::cases::{Case, cases, refused};
use super::child::Stop;
use super::control::{Control, true_effects};
use super::isolate::Treatment;
use super::jobs::side_by_side;
use super::kept::{self, Kept, Maker};
use super::method::{Asked, Method};
use super::seal::sealed;
use super::sensitivity::{Stored, sensitivity};
use crate::cli::failure;
use crate::cli::output::{OutFolder, staging};
use crate::cli::progress::Bars;
use crate::cli::session::backend;

/// Folder of the stored answers within the folder of the result.
const ANSWERS: &str = "answers";

/// The call and what it works on.
pub struct Session<'a> {
    pub arguments: &'a Arguments,
    cases: Vec<Case>,
    pub backend: Arc<dyn Backend>,
    left_out: BTreeMap<String, String>,
    pub out: PathBuf,
    jobs: usize,
    stop: Stop,
}

/// Answers all cases of a folder and scores them.
pub fn score(folder: &Path, arguments: &Arguments) -> Result<()> {
    let session = Session::new(folder, arguments)?;
    let beside = folder.join("labels.json");
    let file = arguments.labels.as_deref().unwrap_or(&beside);
    // Only this control needs the labels before the answers: they say which effects to remove from
    // the catalogue.
    let early = match arguments.control {
        Some(Control::WithoutTruth) => Some(read_labels(file)?),
        _ => None,
    };
    let methods = match &arguments.method[..] {
        [] => vec![Method::Diagnose],
        methods => methods.to_vec(),
    };
    if arguments.sensitivity {
        let labels = read_labels(file)?;
        sealed(folder, file)?;
        return session.sensitivity(&labels);
    }
    if !arguments.only_score && arguments.control != Some(Control::Oracle) {
        for method in &methods {
            session.answer(*method, early.as_ref())?;
        }
    }
    if let Some(shard) = arguments.shard {
        failure::note(&format!(
            "share {shard} is answered; when all shares are, the same call without --shard scores them"
        ));
        return Ok(());
    }
    // Everything is answered, so the labels may be read now.
    let labels = match early {
        Some(labels) => labels,
        None => read_labels(file)?,
    };
    sealed(folder, file)?;
    let seed = arguments.common.seed.unwrap_or(0);
    let labels = match arguments.control {
        Some(control) => control.labels(labels, seed),
        None => labels,
    };
    let scores: Vec<Score> = methods
        .iter()
        .map(|m| session.score(*m, &labels))
        .collect::<Result<_>>()?;
    session.write(&scores)
}

impl<'a> Session<'a> {
    fn new(folder: &Path, arguments: &'a Arguments) -> Result<Self> {
        let common = &arguments.common;
        let all = cases(folder, &arguments.case)?;
        let asked = Asked::new(Method::Diagnose, arguments);
        let backend: Arc<dyn Backend> = backend(&asked.backend)?.into();
        let left_out = refused(&all, &*backend);
        let taken = all
            .into_iter()
            .filter(|(name, _)| !left_out.contains_key(name));
        let threads = common.threads.unwrap_or(1);
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        Ok(Self {
            cases: taken.collect(),
            backend,
            left_out,
            out: out_folder(common.out.as_deref())?,
            jobs: arguments.jobs.unwrap_or((cores / threads).max(1)),
            stop: Stop::watch()?,
            arguments,
        })
    }

    /// Folder of a method's answers.
    fn answers(&self, method: Method) -> PathBuf {
        // Scrambled labels are scored against the existing answers.
        let spoilt = self.arguments.control.filter(|c| *c != Control::Scrambled);
        let name = match spoilt {
            Some(control) => format!("{}-{}", method.name(), control.name()),
            None => method.name().to_owned(),
        };
        self.out.join(ANSWERS).join(name)
    }

    /// Answers the cases that have no answer yet.
    fn answer(&self, method: Method, early: Option<&BTreeMap<String, Label>>) -> Result<()> {
        let arguments = self.arguments;
        let (program, into) = (kept::program()?, self.answers(method));
        std::fs::create_dir_all(&into)
            .map_err(|e| Error::Failed(format!("{}: cannot be written: {e}", into.display())))?;
        staging::clear(&into);
        let noise = arguments.control == Some(Control::Noise);
        let shard = |i: usize| arguments.shard.is_none_or(|s| s.holds(i));
        let mine: Vec<&Case> = self
            .cases
            .iter()
            .enumerate()
            .filter(|(i, _)| shard(*i))
            .map(|(_, c)| c)
            .collect();
        let bars = Bars::new(arguments.common.quiet);
        bars.begin(method.name(), mine.len() as u64);
        let done = side_by_side(self.jobs, &mine, |(name, study)| {
            let mut asked = Asked::new(method, arguments);
            if let Some(labels) = early {
                let label = labels.get(name).cloned().unwrap_or_default();
                asked.also_without = true_effects(&label).into_iter().collect();
            }
            let maker = Maker {
                asked,
                treatment: Treatment {
                    finer: arguments.finer,
                    noise: noise.then(|| arguments.common.seed.unwrap_or(0)),
                },
                limit: arguments.limit,
                program: &program,
                into: &into,
                stop: &self.stop,
            };
            let was_there = maker.make(name, study)?;
            if !was_there {
                failure::note(&told(name, &maker.folder(name)));
            }
            bars.advance(1);
            Ok(())
        });
        bars.end();
        done.into_iter().collect::<Result<Vec<()>>>()?;
        Ok(())
    }

    /// Scores a method's answers.
    fn score(&self, method: Method, labels: &BTreeMap<String, Label>) -> Result<Score> {
        let arguments = self.arguments;
        let folder = self.answers(method);
        let bars = Bars::new(arguments.common.quiet);
        bars.begin("scores", self.cases.len() as u64);
        let unanswered = AtomicUsize::new(0);
        let scored = side_by_side(self.jobs, &self.cases, |(name, study)| {
            if self.stop.check().is_err() {
                return None;
            }
            let found = Kept::at(&folder.join(name), arguments.limit);
            let oracle = arguments.control == Some(Control::Oracle);
            let case = match (labels.get(name), found) {
                (Some(label), _) if oracle => {
                    Some(self.scored(name, study, label, &of_oracle(label)))
                }
                (Some(label), Some(kept)) => {
                    let run = run_of(&folder.join(name), &kept);
                    Some(self.scored(name, study, label, &run))
                }
                // A folder without a label is skipped.
                (None, _) => None,
                (Some(_), None) => {
                    unanswered.fetch_add(1, Ordering::Relaxed);
                    None
                }
            };
            bars.advance(1);
            case
        });
        bars.end();
        self.stop.check()?;
        let (missing, all) = (unanswered.into_inner(), self.cases.len());
        if missing > 0 {
            failure::note(&format!(
                "{}: {missing} of {all} cases have no answer yet, and are passed over",
                method.name()
            ));
        }
        let scored: Vec<Scored> = scored.into_iter().flatten().collect();
        Ok(Score::of(method.name(), scored, self.left_out.clone()))
    }

    /// Repeats the decisions of the diagnosis' stored answers.
    fn sensitivity(&self, labels: &BTreeMap<String, Label>) -> Result<()> {
        let folder = self.answers(Method::Diagnose);
        let stored = self
            .cases
            .iter()
            .filter_map(|(name, study)| Stored::read(&folder.join(name), study, labels.get(name)?));
        let stored: Vec<Stored<'_>> = stored.collect();
        let effects = all::<EffectEntry>();
        let catalogue = effects.iter().map(|e| e.name.to_owned()).collect();
        sensitivity(&stored, &catalogue, &self.out)
    }

    fn scored(&self, name: &str, study: &Path, label: &Label, run: &Run) -> Scored {
        let without: BTreeSet<String> = match self.arguments.control {
            Some(Control::WithoutTruth) => true_effects(label),
            _ => BTreeSet::new(),
        };
        let left = |n: &str| without.contains(n) || self.arguments.without.iter().any(|w| w == n);
        let effects = all::<EffectEntry>();
        let names = effects.iter().map(|e| e.name).filter(|n| !left(n));
        let catalogue: BTreeSet<String> = names.map(str::to_owned).collect();
        let sites = physics::sites_of(study).unwrap_or_else(|_| Sites::default());
        let judge = Judge {
            label,
            sites: &sites,
            catalogue: &catalogue,
        };
        let spoilt = matches!(
            self.arguments.control,
            Some(Control::Scrambled | Control::Noise)
        );
        let physics = match &run.answer {
            Ok(_) if self.arguments.names_only => Physics::skipped("scored by names alone"),
            Ok(_) if spoilt => Physics::skipped("label and logs are not of one world"),
            Ok(answer) => physics::examine(Arc::clone(&self.backend), study, &judge, answer),
            Err(_) => Physics::skipped("there is no answer"),
        };
        Scored::new(name, run, &judge, physics)
    }
}

/// The folder of the result: new, empty, or with existing answers.
fn out_folder(out: Option<&Path>) -> Result<PathBuf> {
    let there = out.filter(|path| path.join(ANSWERS).is_dir());
    Ok(match there {
        Some(path) => path.to_owned(),
        None => OutFolder::claim(out, "withheld")?.path(),
    })
}

/// A stored answer in the form that is scored.
fn run_of(folder: &Path, kept: &Kept) -> Run {
    Run {
        answer: match &kept.failure {
            Some(why) => Err(why.clone()),
            None => Answer::read(&folder.join("result.json")).map_err(|e| e.to_string()),
        },
        seconds: kept.seconds,
        memory_mib: kept.memory_mib,
    }
}

/// The answer of an oracle, which knows the label.
fn of_oracle(label: &Label) -> Run {
    Run {
        answer: Ok(oracle(label)),
        seconds: 0.0,
        memory_mib: None,
    }
}

/// A one-line summary of a case.
fn told(name: &str, folder: &Path) -> String {
    let Some(kept) = Kept::at(folder, None) else {
        return format!("{name}: nothing came of it");
    };
    let sentence = || {
        let text = std::fs::read_to_string(folder.join("result.json")).ok()?;
        let value: serde_json::Value = serde_json::from_str(&text).ok()?;
        Some(value.get("sentence")?.as_str()?.to_owned())
    };
    let what = match &kept.failure {
        Some(why) => format!("no answer: {why}"),
        None => sentence().unwrap_or_else(|| "answered".into()),
    };
    format!("{name}: {:.1} s: {what}", kept.seconds)
}
