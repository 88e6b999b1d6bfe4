//! Selects the causes of a draw and their sizes.

use std::collections::BTreeMap;

use rand::Rng;
use rand::seq::IndexedRandom;

use super::Draw;
use super::rules::LeftOut;
use crate::cause::{Place, Standing};
use crate::dirt::{self, Item};
use crate::error::Result;
use crate::gap::Bench;
use crate::label::Dirt;
use crate::plan::{Kind, possible};
use crate::size::solve;
use crate::world::World;

/// Sets of causes that are tried in one draw.
const TRIES: u32 = 10;
/// Gap that dirt counts as having at least, in noise floors.
///
/// With it the smallest factor of dirty worlds gives the smallest gap of clean worlds.
const LEAST_DIRT: f64 = 0.75;
/// Episodes in which the gap of an item of dirt is measured.
const SAMPLE: usize = 2;

/// The causes of a case, sized.
#[derive(Default)]
pub(super) struct Causes {
    pub(super) items: Vec<Item>,
    pub(super) own: BTreeMap<String, f64>,
}

impl Draw<'_> {
    /// Draws other causes of the same kind.
    pub(super) fn other_causes(&mut self) {
        let unknown = self.slot.kind == Kind::Unknown;
        let all = possible(self.anatomy, |s| (s == Standing::Unknown) == unknown);
        let count = self.slot.causes.len().min(2);
        let group = self.slot.kind == Kind::Group;
        let usable: Vec<_> = all
            .into_iter()
            .filter(|c| !group || c.sites(self.anatomy).len() > 1)
            .collect();
        self.slot.same_joint = false;
        self.slot.causes = usable
            .choose_multiple(&mut self.random, count)
            .copied()
            .collect();
    }

    /// Returns a world with the given items.
    pub(super) fn with(&self, bench: &Bench<'_>, items: &[Item]) -> Result<World> {
        let mut world = bench.world(&bench.truth)?;
        for item in items {
            item.act(self.anatomy, &bench.typical, &mut world);
        }
        Ok(world)
    }

    pub(super) fn gap_of(&self, bench: &Bench<'_>, items: &[Item]) -> Result<f64> {
        if items.is_empty() {
            return Ok(0.0);
        }
        let readings = bench.run(&mut self.with(bench, items)?)?;
        Ok(bench.refit(&readings)?.excess)
    }

    /// Finds causes of the planned size.
    ///
    /// If that fails, it tries another site, then a smaller size, then other causes.
    pub(super) fn sized_causes(
        &mut self,
        bench: &Bench<'_>,
        dirt_gap: f64,
        left_out: &mut Vec<String>,
    ) -> Result<(Causes, f64), LeftOut> {
        let mut last = String::new();
        for attempt in 0..TRIES {
            match attempt {
                0 | 1 => {}
                2 | 3 => self.lower += 1,
                _ => {
                    self.lower = 0;
                    self.other_causes();
                }
            }
            let aim = self.slot.aim(self.lower);
            let target = if self.slot.dirty {
                aim * dirt_gap.max(LEAST_DIRT)
            } else {
                aim
            };
            match self.size(bench, target) {
                Err(LeftOut::Rule(reason)) => last = reason,
                other => return other.map(|causes| (causes, target)),
            }
            left_out.push(last.clone());
        }
        Err(LeftOut::Rule(last))
    }

    /// Draws sites and finds the sizes at which each cause alone reaches its share of the target.
    pub(super) fn size(&mut self, bench: &Bench<'_>, target: f64) -> Result<Causes, LeftOut> {
        let mut found = Causes::default();
        let slot = self.slot.clone();
        let share = target / (slot.causes.len().max(1) as f64).sqrt();
        let joints = crate::cause::scalar_joints(self.anatomy);
        let joint = joints.choose(&mut self.random).cloned();
        for cause in slot.causes {
            let all = cause.sites(self.anatomy);
            let mut sites: Vec<String> = match slot.kind {
                Kind::Group => all,
                _ => all.choose(&mut self.random).cloned().into_iter().collect(),
            };
            if let Some(joint) = joint
                .clone()
                .filter(|j| slot.same_joint && cause.sites(self.anatomy).contains(j))
            {
                sites = vec![joint];
            }
            let draw: [f64; 4] = std::array::from_fn(|_| self.random.random());
            let items = |fraction: f64| -> Vec<Item> {
                let item = |site: &String| {
                    let place = Place {
                        machine: self.anatomy,
                        typical: &bench.typical,
                        site,
                        draw,
                    };
                    Item {
                        cause,
                        site: site.clone(),
                        size: fraction * cause.largest(&place),
                        draw,
                    }
                };
                sites.iter().map(item).collect()
            };
            let make = |fraction: f64| self.with(bench, &items(fraction));
            let name = dirt::label(cause, sites.first().map_or("", |s| s));
            let Some(sized) = solve(bench, share, &make)? else {
                let reason = format!("{name} cannot give an excess gap of {share:.3}");
                return Err(LeftOut::Rule(reason));
            };
            found.own.insert(name, sized.excess);
            found.items.extend(items(sized.share));
        }
        Ok(found)
    }

    /// The world with all dirt and causes. Causes come after dirt.
    pub(super) fn world(
        &self,
        bench: &Bench<'_>,
        truth: &[f64],
        dirt: &[Item],
        causes: &Causes,
        timestep: f64,
    ) -> Result<World> {
        let mut world = World::new(self.anatomy, truth, timestep, bench.integrator)?;
        let (between, others): (Vec<&Item>, Vec<&Item>) = dirt
            .iter()
            .chain(&causes.items)
            .partition(|i| matches!(i.cause.name(), "backlash" | "joint-compliance"));
        // A joint can have one transmission only. A cause's transmission takes precedence over that
        // of dirt.
        let mut joints: Vec<&str> = Vec::new();
        for item in others.into_iter().chain(between.into_iter().rev()) {
            if matches!(item.cause.name(), "backlash" | "joint-compliance") {
                if joints.contains(&item.site.as_str()) {
                    continue;
                }
                joints.push(&item.site);
            }
            item.act(self.anatomy, &bench.typical, &mut world);
        }
        Ok(world)
    }

    /// Measures the excess gap of each item of dirt by itself, in the first episodes.
    pub(super) fn measure_dirt(
        &self,
        bench: &Bench<'_>,
        truth: &[f64],
        dirt: &[Item],
    ) -> Result<Vec<Dirt>> {
        if dirt.is_empty() {
            return Ok(Vec::new());
        }
        let some = &bench.motions[..SAMPLE];
        let small = Bench::new(self.anatomy, truth, some, bench.timestep, bench.integrator)?;
        dirt.iter()
            .map(|item| {
                let mut world = small.world(truth)?;
                let values = item.act(self.anatomy, &bench.typical, &mut world);
                Ok(Dirt {
                    effect: item.cause.name().to_owned(),
                    site: item.site.clone(),
                    parameters: values.iter().map(|(n, v)| ((*n).to_owned(), *v)).collect(),
                    excess_gap: small.excess(&small.run(&mut world)?),
                })
            })
            .collect()
    }
}
