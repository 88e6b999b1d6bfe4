//! What can be wrong with an engine.

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

use asid::core::nalgebra::{Quaternion, UnitQuaternion, Vector3};
use asid::core::simulator::{StepHook, StepView};

/// What is wrong with an engine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// Nothing.
    None,
    /// Nothing: Runge and Kutta's integrator of fourth order, where the engine has one.
    FourthOrder,
    /// Sliding friction of every geom is half of what the scene says.
    FrictionHalved,
    /// The friction of the larger of two geoms counts, whatever their priorities.
    PriorityIgnored,
    /// Explicit pairs of geoms are not read.
    PairsIgnored,
    /// Joints are not damped.
    DampingIgnored,
    /// Ranges of joints are neither claimed nor refused.
    RangesLeftOut,
    /// Angles of a document are radians.
    DegreesIgnored,
    /// Limits of commands and forces do not act.
    LimitsIgnored,
    /// The last of several actuators does nothing.
    TorqueIgnored,
    /// Quaternions are read as x y z w.
    QuaternionSwapped,
    /// Sensors of joints read degrees.
    DegreesRead,
    /// Sensors show the frame before.
    StaleSensor,
    /// Readings carry the noise of one random state that all batches share.
    SharedNoise,
    /// The result depends on the number of threads.
    ThreadDependent,
    /// A restored state has no velocity.
    ForgetsVelocity,
    /// A reset keeps a little of what was.
    ResetRemembers,
    /// A snapshot of any scene is taken for one of this scene, and does nothing.
    AnySnapshot,
    /// A simulation's parameters are set for all.
    SharedParameters,
    /// Parameters do not change during a rollout.
    ChangesIgnored,
    /// Torques of external wrenches are lost.
    WrenchTorqueLost,
    /// External forces act with the opposite sign.
    ForceReversed,
    /// Simulations that are not asked for move as well.
    OthersMove,
    /// From the 1025th on, simulations stand still.
    LargeBatchCut,
    /// Simulations may be named in any order, and are taken in theirs.
    OrderIgnored,
    /// A diverged simulation says that it runs.
    DivergenceHidden,
    /// Commands that are not finite are taken for zero.
    NanAccepted,
    /// A hook is shown the state of the step before.
    HookLate,
    /// A hook is told the time since the rollout began.
    HookForgetsTime,
    /// A hook is told the number of the simulation for the row of the rollout.
    HookCountsSimulations,
    /// A hook is there, and what is read is another number by its last bit.
    HookDisturbs,
    /// The axes of a body's inertia are those of the body.
    InertiaTurnIgnored,
    /// A hook's force on a free joint acts at the centre of mass.
    HookForceAtCenter,
    /// A mass that is set leaves the inertia as it was.
    MassWithoutInertia,
    /// A mass may be set, and does nothing.
    MassUnused,
    /// A negative mass is taken for its magnitude.
    NegativeMass,
    /// `frameangvel` of a site reads in the site's frame.
    RateInOwnFrame,
    /// `gyro` reads in the world.
    GyroInWorld,
    /// `velocimeter` reads in the world.
    VelocimeterInWorld,
    /// A site is turned as its body.
    SiteTurnIgnored,
    /// Equalities are left out.
    EqualitiesLeftOut,
    /// The air is left out.
    AirLeftOut,
}

impl Fault {
    /// Every fault.
    pub const ALL: [Self; 29] = [
        Self::FrictionHalved,
        Self::PriorityIgnored,
        Self::PairsIgnored,
        Self::DampingIgnored,
        Self::RangesLeftOut,
        Self::DegreesIgnored,
        Self::LimitsIgnored,
        Self::TorqueIgnored,
        Self::QuaternionSwapped,
        Self::DegreesRead,
        Self::StaleSensor,
        Self::SharedNoise,
        Self::ThreadDependent,
        Self::ForgetsVelocity,
        Self::ResetRemembers,
        Self::AnySnapshot,
        Self::SharedParameters,
        Self::ChangesIgnored,
        Self::WrenchTorqueLost,
        Self::ForceReversed,
        Self::OthersMove,
        Self::LargeBatchCut,
        Self::OrderIgnored,
        Self::DivergenceHidden,
        Self::NanAccepted,
        Self::HookLate,
        Self::HookForgetsTime,
        Self::HookCountsSimulations,
        Self::HookDisturbs,
    ];

    /// What an engine of free bodies can have wrong about a body.
    pub const OF_FREE_BODIES: [Self; 12] = [
        Self::InertiaTurnIgnored,
        Self::HookForceAtCenter,
        Self::MassWithoutInertia,
        Self::MassUnused,
        Self::NegativeMass,
        Self::RateInOwnFrame,
        Self::GyroInWorld,
        Self::VelocimeterInWorld,
        Self::SiteTurnIgnored,
        Self::EqualitiesLeftOut,
        Self::AirLeftOut,
        Self::DampingIgnored,
    ];

    /// True where an engine that does everything is spoilt by it: what takes contact, and
    /// the commonest of the others.
    pub fn of_a_whole_engine(self) -> bool {
        !self.of_a_mechanism()
            || matches!(
                self,
                Self::TorqueIgnored
                    | Self::QuaternionSwapped
                    | Self::StaleSensor
                    | Self::SharedNoise
                    | Self::ForgetsVelocity
                    | Self::ForceReversed
            )
    }

    /// True where an engine of mechanisms without contact can have it.
    pub fn of_a_mechanism(self) -> bool {
        !matches!(
            self,
            Self::FrictionHalved | Self::PriorityIgnored | Self::PairsIgnored
        )
    }
}

/// A hook as a faulty engine calls it.
pub struct SpoiltHook<'a> {
    /// The hook of the rollout.
    pub inner: &'a dyn StepHook,
    /// How it is called.
    pub fault: Fault,
    /// Simulations of the rollout.
    pub sims: &'a [usize],
    /// Length of a physics step, s.
    pub timestep: f64,
    /// Centre of mass in the first body's frame, m.
    pub center: Vector3<f64>,
    /// State of each row a step ago.
    pub before: Mutex<HashMap<usize, [Vec<f64>; 2]>>,
}

impl StepHook for SpoiltHook<'_> {
    fn before_step(&self, row: usize, step: usize, view: &mut StepView<'_>) {
        let now = [view.qpos.to_vec(), view.qvel.to_vec()];
        let mut before = self.before.lock().unwrap_or_else(PoisonError::into_inner);
        let late = before
            .insert(row, now.clone())
            .filter(|_| self.fault == Fault::HookLate);
        let [qpos, qvel] = late.unwrap_or(now);
        drop(before);
        let row = match self.fault {
            Fault::HookCountsSimulations => self.sims[row],
            _ => row,
        };
        let time = match self.fault {
            Fault::HookForgetsTime => step as f64 * self.timestep,
            _ => view.time,
        };
        self.inner.before_step(
            row,
            step,
            &mut StepView {
                time,
                qpos: &qpos,
                qvel: &qvel,
                ctrl: view.ctrl,
                force: view.force,
                parameters: view.parameters,
            },
        );
        if self.fault == Fault::HookForceAtCenter && qpos.len() == 7 {
            let q = Quaternion::new(qpos[3], qpos[4], qpos[5], qpos[6]);
            let force = Vector3::from_column_slice(&view.force[..3]);
            let own = UnitQuaternion::from_quaternion(q).inverse() * force;
            let torque = self.center.cross(&own);
            for (f, t) in view.force[3..6].iter_mut().zip(torque.iter()) {
                *f += t;
            }
        }
    }
}
