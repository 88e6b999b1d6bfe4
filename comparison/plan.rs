//! The runs of a comparison: tasks x conditions x engines x worlds x methods x seeds.

use asid_core::{Error, Result};
use serde::{Deserialize, Serialize};

use crate::cell::CellKey;
use crate::method::Method;

/// A task and the conditions under which it is run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TaskPlan {
    /// Name.
    pub name: String,
    /// Conditions.
    pub conditions: Vec<String>,
}

/// The whole plan, as `[compare]` in `config.toml` holds it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    /// Number of the paper's table that is reproduced; `None` for a custom comparison.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub table: Option<u8>,
    /// Whether searches are shortened; see [`crate::preset`].
    #[serde(default)]
    pub quick: bool,
    /// Whether learned parts are trained here and not loaded as shipped.
    #[serde(default)]
    pub train: bool,
    /// Methods.
    pub methods: Vec<Method>,
    /// Kinds of real worlds.
    pub worlds: Vec<String>,
    /// Engines.
    pub backends: Vec<String>,
    /// The first seed.
    pub first_seed: u64,
    /// Number of runs per row; their seeds count up from the first.
    pub seeds: u64,
    /// Tasks with their conditions.
    pub task: Vec<TaskPlan>,
}

/// The world that is the method's own simulator with a hidden truth.
pub const MATCHED: &str = "matched";

/// The world that differs from the simulator as a real one would; tables show it first.
pub const PERTURBED: &str = "perturbed";

/// Most runs of a plan: far more than are ever made, and few enough to be listed in memory, at some
/// 200 bytes each.
const MOST: u64 = 1_000_000;

impl Plan {
    /// Removes repeated entries and puts the perturbed world first.
    ///
    /// # Errors
    /// When there is nothing to run or far too much, seeds overflow, or two methods share a name.
    pub fn check(&mut self) -> Result<()> {
        let wrong = |key: &str, message: &str| {
            Err(Error::Config {
                key: key.into(),
                message: message.into(),
            })
        };
        if self.seeds == 0 {
            return wrong("--seeds", "must be at least 1");
        }
        if self.first_seed.checked_add(self.seeds).is_none() {
            return wrong("--seed", "the last seed does not fit into 64 bits");
        }
        distinct(&mut self.methods);
        distinct(&mut self.worlds);
        distinct(&mut self.backends);
        self.worlds.sort_by_key(|w| w != PERTURBED);
        let mut tasks: Vec<TaskPlan> = Vec::new();
        for mut task in std::mem::take(&mut self.task) {
            match tasks.iter_mut().find(|t| t.name == task.name) {
                Some(known) => known.conditions.append(&mut task.conditions),
                None => tasks.push(task),
            }
        }
        tasks.iter_mut().for_each(|t| distinct(&mut t.conditions));
        self.task = tasks;
        for (i, method) in self.methods.iter().enumerate() {
            if self.methods[..i].iter().any(|m| m.name == method.name) {
                return wrong(
                    &format!("--method {}", method.name),
                    "is the name of two methods; a row's name stands for one",
                );
            }
        }
        if self.runs().is_none_or(|runs| runs > MOST) {
            let last = self.first_seed + (self.seeds - 1);
            let message = format!(
                "the seeds {} to {last} make more than {MOST} runs; name fewer, and merge only \
                 comparisons whose seeds lie near each other",
                self.first_seed
            );
            return wrong("--seeds", &message);
        }
        if self.cells().is_empty() {
            return Err(Error::Failed("there is nothing to compare".into()));
        }
        Ok(())
    }

    /// Number of cells; `None` where 64 bits do not hold it.
    fn runs(&self) -> Option<u64> {
        let conditions: usize = self.task.iter().map(|t| t.conditions.len()).sum();
        let parts = [
            conditions,
            self.backends.len(),
            self.worlds.len(),
            self.methods.len(),
        ];
        let of = |part: usize| u64::try_from(part).ok();
        parts
            .into_iter()
            .try_fold(self.seeds, |product, part| product.checked_mul(of(part)?))
    }

    /// The cells in the order of the tables; seeds are innermost.
    #[must_use]
    pub fn cells(&self) -> Vec<CellKey> {
        let mut cells = Vec::new();
        for task in &self.task {
            for condition in &task.conditions {
                for backend in &self.backends {
                    for world in &self.worlds {
                        for method in &self.methods {
                            for k in 0..self.seeds {
                                cells.push(CellKey {
                                    task: task.name.clone(),
                                    condition: condition.clone(),
                                    method: method.name.clone(),
                                    world: world.clone(),
                                    backend: backend.clone(),
                                    seed: self.first_seed + k,
                                });
                            }
                        }
                    }
                }
            }
        }
        cells
    }

    /// The method of this name.
    #[must_use]
    pub fn method(&self, name: &str) -> Option<&Method> {
        self.methods.iter().find(|m| m.name == name)
    }

    /// Extends the plan to the smallest one that contains both.
    ///
    /// # Errors
    /// When one method's name stands for different parts, or one of the plans is a quick look.
    pub fn union(&mut self, other: &Self) -> Result<()> {
        let wrong = |message: String| Err(Error::Failed(message));
        for method in &other.methods {
            if let Some(own) = self.method(&method.name).filter(|m| *m != method) {
                return wrong(format!(
                    "`{}` is {} in one and {} in the other",
                    method.name,
                    own.parts(),
                    method.parts()
                ));
            }
        }
        if self.quick != other.quick {
            return wrong("one is a quick look and the other is not".into());
        }
        if self.table != other.table {
            self.table = None;
        }
        self.train |= other.train;
        self.methods.extend(other.methods.iter().cloned());
        self.worlds.extend(other.worlds.iter().cloned());
        self.backends.extend(other.backends.iter().cloned());
        self.task.extend(other.task.iter().cloned());
        let end = (self.first_seed + self.seeds).max(other.first_seed + other.seeds);
        self.first_seed = self.first_seed.min(other.first_seed);
        self.seeds = end - self.first_seed;
        self.check()
    }
}

/// Removes repeated entries; the first of equal ones stays.
fn distinct<T: PartialEq>(list: &mut Vec<T>) {
    let mut kept: Vec<T> = Vec::with_capacity(list.len());
    for entry in list.drain(..) {
        if !kept.contains(&entry) {
            kept.push(entry);
        }
    }
    *list = kept;
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub fn plan() -> Plan {
        let task = |name: &str, conditions: &[&str]| TaskPlan {
            name: name.into(),
            conditions: conditions.iter().map(|c| (*c).to_owned()).collect(),
        };
        Plan {
            table: None,
            quick: false,
            train: false,
            methods: ["asid", "dr"].map(|m| Method::named(m).unwrap()).into(),
            worlds: vec![MATCHED.into(), PERTURBED.into(), MATCHED.into()],
            backends: vec!["rapier".into()],
            first_seed: 5,
            seeds: 3,
            task: vec![task("a", &["x", "y"]), task("b", &["z"])],
        }
    }

    #[test]
    fn a_plan_is_the_product_of_its_lists_with_the_perturbed_world_first() {
        let mut plan = plan();
        plan.check().unwrap();
        assert_eq!(plan.worlds, [PERTURBED, MATCHED]);
        let cells = plan.cells();
        assert_eq!(cells.len(), 3 * 2 * 2 * 3);
        assert_eq!(cells[0].words(), "a, x, asid, perturbed, rapier, seed 5");
        assert_eq!(cells[3].method, "dr");
        let text = toml::to_string(&plan).unwrap();
        assert_eq!(toml::from_str::<Plan>(&text).unwrap(), plan);
    }

    #[test]
    fn plans_unite_only_where_a_name_means_the_same() {
        let mut a = plan();
        a.check().unwrap();
        let mut b = a.clone();
        b.first_seed = 8;
        b.backends = vec!["mujoco".into()];
        b.methods
            .push(Method::parse("mine=random+cem+cem").unwrap());
        let mut both = a.clone();
        both.union(&b).unwrap();
        assert_eq!((both.first_seed, both.seeds), (5, 6));
        assert_eq!(both.backends, ["rapier", "mujoco"]);
        assert_eq!(both.methods.len(), 3);
        let mut other = a.clone();
        other
            .methods
            .push(Method::parse("mine=random+reps+cem").unwrap());
        assert!(
            both.union(&other)
                .unwrap_err()
                .to_string()
                .contains("`mine`")
        );
        other.methods.pop();
        other.quick = true;
        assert!(a.union(&other).unwrap_err().to_string().contains("quick"));
    }

    /// Symptom: a merge of comparisons of the seeds 0 and 20250101 ended for want of memory. Cause:
    /// the smallest plan with both has all seeds between them.
    #[test]
    fn plans_whose_seeds_lie_far_apart_are_not_united() {
        let mut a = plan();
        a.check().unwrap();
        assert_eq!(a.runs(), Some(a.cells().len() as u64));
        let mut b = a.clone();
        b.first_seed = 20_250_101;
        let said = a.union(&b).unwrap_err().to_string();
        assert!(
            said.contains("--seeds") && said.contains("5 to 20250103"),
            "{said}"
        );
        let mut many = plan();
        many.seeds = u64::MAX - many.first_seed;
        assert!(many.check().is_err());
    }

    #[test]
    fn a_plan_without_cells_or_with_a_name_twice_is_refused() {
        let mut empty = plan();
        empty.task.clear();
        assert!(empty.check().is_err());
        let mut none = plan();
        none.seeds = 0;
        assert!(none.check().unwrap_err().to_string().contains("--seeds"));
    }
}
