//! An ensemble of models as one model: its members share the simulations of a batch.
//!
//! A model's maker does not know how soft its contacts are, how late its servos answer, or what its
//! bodies weigh to the gram. Simulations in models that differ in all of that scatter by what the
//! maker does not know. An identifier that measures the scatter of its simulations
//! (`algorithms/identify/emulator.rs`) then weighs readings by it, and its intervals hold under
//! such errors.

use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use asid_core::backend::Model;
use asid_core::error::{Error, Result};
use asid_core::layout::{Layout, Recording};
use asid_core::simulator::{
    BatchConfig, Control, ExternalForce, ParameterChange, Rollout, Simulator, Snapshot, Status,
    StepHook, StepView, check_copy, check_len, check_sims, check_state,
};
use asid_core::target::Target;

/// Models of one machine that differ in what is not known of it.
pub struct Ensemble {
    members: Vec<Arc<dyn Model>>,
}

impl Ensemble {
    /// An ensemble of models with equal states, commands and sensors.
    ///
    /// Simulation `i` of a batch is of member `i` modulo their number.
    ///
    /// # Errors
    /// [`Error::Shape`] without members, or where two of them differ.
    pub fn new(members: Vec<Arc<dyn Model>>) -> Result<Self> {
        let shape = |l: &Layout| (l.nq, l.nv, l.nu(), l.sensors.len(), l.timestep.to_bits());
        let Some(first) = members.first() else {
            return Err(Error::Shape("an ensemble needs a member".into()));
        };
        let own = shape(first.layout());
        if members.iter().any(|m| shape(m.layout()) != own) {
            let message = "the models of an ensemble have equal states, commands and time steps";
            return Err(Error::Shape(message.into()));
        }
        Ok(Self { members })
    }
}

impl Model for Ensemble {
    fn layout(&self) -> &Layout {
        self.members[0].layout()
    }

    fn engine(&self) -> String {
        self.members[0].engine()
    }

    fn remembers_commands(&self) -> bool {
        self.members.iter().any(|m| m.remembers_commands())
    }

    fn nominal(&self, target: &Target) -> Result<f64> {
        self.members[0].nominal(target)
    }

    fn simulator(&self, config: &BatchConfig) -> Result<Box<dyn Simulator>> {
        let count = self.members.len();
        // An engine refuses an empty batch, so a member without a simulation of its own has a spare
        // one.
        let sizes = (0..count).map(|k| config.size.saturating_sub(k).div_ceil(count).max(1));
        let lanes = config.thread_count().clamp(1, count);
        let made = self.members.iter().zip(sizes).map(|(member, size)| {
            member.simulator(&BatchConfig {
                size,
                threads: (config.thread_count() / lanes).max(1),
                ..config.clone()
            })
        });
        Ok(Box::new(Shared {
            members: made.collect::<Result<_>>()?,
            lanes,
            columns: config.targets.len(),
            status: vec![Status::Running; config.size],
        }))
    }
}

/// The simulations of an ensemble.
struct Shared {
    members: Vec<Box<dyn Simulator>>,
    /// Members that simulate at a time.
    lanes: usize,
    columns: usize,
    status: Vec<Status>,
}

/// The part of some simulations that one member has.
struct Part {
    member: usize,
    /// Numbers of the simulations within the member.
    sims: Vec<usize>,
    /// Their rows in the arrays of the whole.
    rows: Vec<usize>,
}

impl Part {
    /// The rows of an array with `width` numbers a row.
    fn of(&self, all: &[f64], width: usize) -> Vec<f64> {
        let rows = self.rows.iter();
        rows.flat_map(|row| &all[row * width..(row + 1) * width])
            .copied()
            .collect()
    }

    /// The readings of a rollout of the part.
    fn played(&self, member: &mut dyn Simulator, rollout: &Rollout<'_>) -> Result<Vec<f64>> {
        let (frames, width) = (rollout.frames, rollout.record.width());
        let commands;
        let control = match rollout.control {
            Control::Shared(_) => rollout.control,
            Control::PerSimulation(all) => {
                commands = self.of(all, frames * member.layout().nu());
                Control::PerSimulation(&commands)
            }
        };
        let wrenches = rollout.forces.iter().map(|f| self.of(f.wrench, 6 * frames));
        let wrenches: Vec<Vec<f64>> = wrenches.collect();
        let forces = rollout.forces.iter().zip(&wrenches);
        let forces: Vec<ExternalForce<'_>> = forces
            .map(|(f, wrench)| ExternalForce { wrench, ..*f })
            .collect();
        let values = rollout.changes.iter().map(|c| self.of(c.values, 1));
        let values: Vec<Vec<f64>> = values.collect();
        let changes = rollout.changes.iter().zip(&values);
        let changes: Vec<ParameterChange<'_>> = changes
            .map(|(c, values)| ParameterChange { values, ..*c })
            .collect();
        let hook = rollout.hook.map(|hook| Renumbered {
            hook,
            rows: &self.rows,
        });
        let mut out = vec![0.0; self.sims.len() * frames * width];
        member.rollout(
            &Rollout {
                sims: &self.sims,
                control,
                forces: &forces,
                changes: &changes,
                hook: hook.as_ref().map(|hook| hook as &dyn StepHook),
                ..*rollout
            },
            &mut out,
        )?;
        Ok(out)
    }

    /// Writes the rows of the part into the array of the whole.
    fn write(&self, own: &[f64], width: usize, all: &mut [f64]) {
        for (row, own) in self.rows.iter().zip(own.chunks_exact(width.max(1))) {
            all[row * width..(row + 1) * width].copy_from_slice(own);
        }
    }
}

/// A hook that sees the rows of the whole.
struct Renumbered<'a> {
    hook: &'a dyn StepHook,
    rows: &'a [usize],
}

impl StepHook for Renumbered<'_> {
    fn before_step(&self, row: usize, step: usize, view: &mut StepView<'_>) {
        self.hook.before_step(self.rows[row], step, view);
    }
}

/// The state of an ensemble's simulations: each row's member and its row there.
struct Saved {
    members: Vec<Option<Snapshot>>,
    rows: Vec<(usize, usize)>,
}

impl Shared {
    /// Splits simulations by their members.
    fn parts(&self, sims: &[usize]) -> Result<Vec<Part>> {
        check_sims(sims, self.status.len())?;
        let count = self.members.len();
        let part = |member: usize| {
            let own = sims
                .iter()
                .enumerate()
                .filter(|(_, s)| *s % count == member);
            let (rows, sims) = own.map(|(row, s)| (row, s / count)).unzip();
            Part { member, sims, rows }
        };
        let all = (0..count).map(part);
        Ok(all.filter(|part| !part.sims.is_empty()).collect())
    }

    /// Reads the status of all simulations anew.
    fn look(&mut self) {
        let count = self.members.len();
        for (i, status) in self.status.iter_mut().enumerate() {
            status.clone_from(&self.members[i % count].status()[i / count]);
        }
    }

    /// Gives each member its simulations' positions and velocities by `set`.
    fn put(
        &mut self,
        sims: &[usize],
        (qpos, qvel): (&[f64], &[f64]),
        set: impl Fn(&mut dyn Simulator, &[usize], &[f64], &[f64]) -> Result<()>,
    ) -> Result<()> {
        let (nq, nv) = (self.layout().nq, self.layout().nv);
        check_state(self.layout(), sims.len(), qpos, qvel)?;
        for part in self.parts(sims)? {
            let (qpos, qvel) = (part.of(qpos, nq), part.of(qvel, nv));
            set(&mut *self.members[part.member], &part.sims, &qpos, &qvel)?;
        }
        self.look();
        Ok(())
    }

    /// Pairs of simulations by member; no state goes from one member to another.
    fn pairs(&self, from: &[usize], to: &[usize]) -> Result<Vec<[Vec<usize>; 2]>> {
        let count = self.members.len();
        let mut pairs = vec![[Vec::new(), Vec::new()]; count];
        for (a, b) in from.iter().zip(to) {
            if a % count != b % count {
                return Err(foreign());
            }
            pairs[a % count][0].push(a / count);
            pairs[a % count][1].push(b / count);
        }
        Ok(pairs)
    }
}

fn foreign() -> Error {
    Error::Shape("a state of one member of an ensemble does not go to another".into())
}

impl Simulator for Shared {
    fn layout(&self) -> &Layout {
        self.members[0].layout()
    }

    fn batch_size(&self) -> usize {
        self.status.len()
    }

    fn set_parameters(&mut self, sims: &[usize], values: &[f64]) -> Result<()> {
        check_len("parameters", values.len(), sims.len() * self.columns)?;
        for part in self.parts(sims)? {
            let own = part.of(values, self.columns);
            self.members[part.member].set_parameters(&part.sims, &own)?;
        }
        Ok(())
    }

    fn reset(&mut self, sims: &[usize]) -> Result<()> {
        for part in self.parts(sims)? {
            self.members[part.member].reset(&part.sims)?;
        }
        self.look();
        Ok(())
    }

    fn set_state(&mut self, sims: &[usize], qpos: &[f64], qvel: &[f64]) -> Result<()> {
        self.put(sims, (qpos, qvel), |member, sims, qpos, qvel| {
            member.set_state(sims, qpos, qvel)
        })
    }

    fn displace(&mut self, sims: &[usize], qpos: &[f64], qvel: &[f64]) -> Result<()> {
        self.put(sims, (qpos, qvel), |member, sims, qpos, qvel| {
            member.displace(sims, qpos, qvel)
        })
    }

    fn rollout(&mut self, rollout: &Rollout<'_>, out: &mut [f64]) -> Result<()> {
        rollout.check(self.layout(), self.status.len(), self.columns, out)?;
        let parts = self.parts(rollout.sims)?;
        // A simulation keeps to its member, so the results do not depend on the lanes.
        let work = Mutex::new(self.members.iter_mut().enumerate());
        let lane = || -> Result<Vec<(&Part, Vec<f64>)>> {
            let next = || work.lock().unwrap_or_else(PoisonError::into_inner).next();
            let mut played = Vec::new();
            while let Some((k, member)) = next() {
                if let Some(part) = parts.iter().find(|part| part.member == k) {
                    played.push((part, part.played(&mut **member, rollout)?));
                }
            }
            Ok(played)
        };
        let played: Result<Vec<_>> = thread::scope(|scope| {
            let others: Vec<_> = (1..self.lanes).map(|_| scope.spawn(lane)).collect();
            let own = std::iter::once(lane());
            let joined = others.into_iter().map(|other| {
                other
                    .join()
                    .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
            });
            own.chain(joined).collect()
        });
        let row = rollout.frames * rollout.record.width();
        for (part, own) in played?.into_iter().flatten() {
            part.write(&own, row, out);
        }
        self.look();
        Ok(())
    }

    fn read(&mut self, sims: &[usize], record: &Recording, out: &mut [f64]) -> Result<()> {
        let width = record.width();
        check_len("readings", out.len(), sims.len() * width)?;
        for part in self.parts(sims)? {
            let mut own = vec![0.0; part.sims.len() * width];
            self.members[part.member].read(&part.sims, record, &mut own)?;
            part.write(&own, width, out);
        }
        Ok(())
    }

    fn save(&mut self, sims: &[usize]) -> Result<Snapshot> {
        let mut saved = Saved {
            members: vec![None; self.members.len()],
            rows: vec![(0, 0); sims.len()],
        };
        for part in self.parts(sims)? {
            for (own, row) in part.rows.iter().enumerate() {
                saved.rows[*row] = (part.member, own);
            }
            saved.members[part.member] = Some(self.members[part.member].save(&part.sims)?);
        }
        Ok(Snapshot::new(saved, sims.len()))
    }

    fn load(&mut self, snapshot: &Snapshot, rows: &[usize], sims: &[usize]) -> Result<()> {
        let count = self.members.len();
        let is_own = |saved: &Saved| saved.members.len() == count;
        let saved: &Saved = snapshot.restored(rows, sims, is_own)?;
        for part in self.parts(sims)? {
            let from = part.rows.iter().map(|&row| saved.rows[rows[row]]);
            let own = from.map(|(member, row)| (member == part.member).then_some(row));
            let own: Vec<usize> = own.collect::<Option<_>>().ok_or_else(foreign)?;
            let state = saved.members[part.member].as_ref().ok_or_else(foreign)?;
            self.members[part.member].load(state, &own, &part.sims)?;
        }
        self.look();
        Ok(())
    }

    fn copy_state(&mut self, from: &[usize], to: &[usize]) -> Result<()> {
        check_copy(from, to, self.status.len())?;
        for (member, [from, to]) in self.pairs(from, to)?.iter().enumerate() {
            if !from.is_empty() {
                self.members[member].copy_state(from, to)?;
            }
        }
        self.look();
        Ok(())
    }

    fn status(&self) -> &[Status] {
        &self.status
    }

    fn steps_taken(&self) -> u64 {
        self.members.iter().map(|m| m.steps_taken()).sum()
    }
}
