//! Selects the causes of a draw and their sizes.

use std::collections::BTreeMap;

use rand::Rng;
use rand::seq::IndexedRandom;

use super::Draw;
use super::rules::LeftOut;
use crate::cause::{Place, Standing, is_transmission};
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

impl Causes {
    /// The items of each cause, by the name under which its gap stands: that of its first item.
    pub(super) fn by_name(&self) -> Vec<(String, Vec<Item>)> {
        let mut all: Vec<(String, Vec<Item>)> = Vec::new();
        for item in &self.items {
            let name = item.label();
            match all.last_mut() {
                Some((_, items)) if !self.own.contains_key(&name) => items.push(item.clone()),
                _ => all.push((name, vec![item.clone()])),
            }
        }
        all
    }
}

/// The dirt of a case, and its excess gap.
pub(super) struct Background {
    pub(super) items: Vec<Item>,
    pub(super) gap: f64,
}

impl Background {
    /// Drops transmissions of joints whose transmission is a cause; returns whether there were any.
    fn drop_clashing(&mut self, causes: &[Item]) -> bool {
        let before = self.items.len();
        let takes = |cause: &Item, site: &str| is_transmission(cause.cause) && cause.site == site;
        self.items.retain(|item| {
            let clashes = || causes.iter().any(|cause| takes(cause, &item.site));
            !(is_transmission(item.cause) && clashes())
        });
        self.items.len() < before
    }
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
        let mut causes: Vec<_> = usable
            .choose_multiple(&mut self.random, count)
            .copied()
            .collect();
        if causes.len() > 1 && causes.iter().copied().all(is_transmission) {
            // Two transmissions exclude each other, as in the plan.
            causes.pop();
            let others: Vec<_> = usable
                .iter()
                .copied()
                .filter(|&c| !is_transmission(c))
                .collect();
            causes.extend(others.choose(&mut self.random).copied());
        }
        self.slot.causes = causes;
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
    /// If that fails, it tries another site, then a smaller size, then other causes. Dirt that
    /// clashes with a cause is dropped.
    pub(super) fn sized_causes(
        &mut self,
        bench: &Bench<'_>,
        dirt: &mut Background,
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
            let before = self.random.clone();
            let mut target = self.target(dirt.gap);
            let mut sized = self.size(bench, target);
            let clash = |causes: &Causes| dirt.drop_clashing(&causes.items);
            if sized.as_ref().is_ok_and(clash) {
                // The same sites and draws again, sized by the dirt that is left.
                dirt.gap = self.gap_of(bench, &dirt.items)?;
                self.random = before;
                target = self.target(dirt.gap);
                sized = self.size(bench, target);
            }
            match sized {
                Err(LeftOut::Rule(reason)) => last = reason,
                other => return other.map(|causes| (causes, target)),
            }
            left_out.push(last.clone());
        }
        Err(LeftOut::Rule(last))
    }

    /// Gap for which the causes are sized beside dirt of this gap.
    fn target(&self, dirt_gap: f64) -> f64 {
        let aim = self.slot.aim(self.lower);
        if self.slot.dirty {
            aim * dirt_gap.max(LEAST_DIRT)
        } else {
            aim
        }
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

    /// The world with all dirt and causes. Causes come after dirt, and transmissions last.
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
            .partition(|i| is_transmission(i.cause));
        for item in others.into_iter().chain(between.into_iter().rev()) {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anatomy::Anatomy;
    use crate::causes;
    use crate::machines::servo;
    use crate::motion::Motion;
    use crate::plan::Slot;
    use crate::random::stream;

    /// A dirty case of the causes, on a machine of one driven joint.
    fn draw<'a>(anatomy: &'a Anatomy, kind: Kind, causes: &[&str]) -> Draw<'a> {
        let slot = Slot {
            machine: 0,
            kind,
            causes: causes.iter().filter_map(|c| causes::named(c)).collect(),
            same_joint: false,
            dirty: true,
            level: 1,
            fault: None,
            wiring: None,
            little: false,
        };
        Draw {
            anatomy,
            slot,
            random: stream(3, &["clash"]),
            lower: 0,
            pace: [0.5, 0.3],
        }
    }

    /// Symptom: labels listed a compliance among the dirt that was not in the world. Cause: the
    /// world left out the transmission of dirt beside that of a cause; the label did not.
    #[test]
    fn dirt_has_no_transmission_at_the_joint_of_a_transmission_that_is_a_cause() -> Result<()> {
        let anatomy = Anatomy::of(&servo::MACHINE)?;
        let mut draw = draw(&anatomy, Kind::Single, &["backlash"]);
        let style = draw.usual();
        let motions: Vec<Motion> = (0..SAMPLE)
            .map(|_| Motion::draw(&anatomy, style, &mut draw.random))
            .collect();
        let step = anatomy.timestep;
        let bench = Bench::new(&anatomy, &[0.4], &motions, step, "implicitfast")?;
        let items = dirt::draw(&anatomy, &bench.typical, &mut draw.random);
        let compliant = |items: &[Item]| items.iter().any(|i| is_transmission(i.cause));
        assert!(compliant(&items));
        let gap = draw.gap_of(&bench, &items)?;
        let mut dirt = Background { items, gap };
        let Ok((causes, target)) = draw.sized_causes(&bench, &mut dirt, &mut Vec::new()) else {
            panic!("the causes cannot be sized");
        };
        assert!(compliant(&causes.items) && !compliant(&dirt.items));
        // Gap and target are those of the dirt that is left.
        assert_eq!(dirt.gap, draw.gap_of(&bench, &dirt.items)?);
        assert_eq!(target, draw.target(dirt.gap));
        Ok(())
    }

    /// Symptom: a case had backlash and compliance, one of them without effect. Cause: the draw of
    /// other causes lacked the exclusion of the plan.
    #[test]
    fn other_causes_are_not_two_transmissions() -> Result<()> {
        let anatomy = Anatomy::of(&servo::MACHINE)?;
        let mut draw = draw(&anatomy, Kind::Several, &["mass", "viscous-friction"]);
        let mut transmissions = 0;
        for _ in 0..2000 {
            draw.other_causes();
            let causes = draw.slot.causes.iter().copied();
            let count = causes.filter(|&c| is_transmission(c)).count();
            assert!(count < 2 && draw.slot.causes.len() == 2);
            transmissions += count;
        }
        assert!(transmissions > 0);
        Ok(())
    }
}
