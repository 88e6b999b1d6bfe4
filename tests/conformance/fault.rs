//! The faults that an engine can have.

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

use asid::core::nalgebra::{Quaternion, UnitQuaternion, Vector3};
use asid::core::simulator::{StepHook, StepView};

/// A fault of an engine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// No fault.
    None,
    /// No fault: a Runge-Kutta integrator of fourth order, where the engine has one.
    FourthOrder,
    /// Sliding friction of every geom is half of the scene's value.
    FrictionHalved,
    /// The larger friction of two geoms applies, whatever their priorities.
    PriorityIgnored,
    /// Explicit pairs of geoms are ignored.
    PairsIgnored,
    /// Joints have no damping.
    DampingIgnored,
    /// Joint ranges are neither claimed nor refused, and do not act.
    RangesLeftOut,
    /// Angles of a document are taken as radians.
    DegreesIgnored,
    /// Limits of commands and forces do not act.
    LimitsIgnored,
    /// The last of several actuators has no effect.
    TorqueIgnored,
    /// Quaternions are read in the order x y z w.
    QuaternionSwapped,
    /// Joint sensors read degrees.
    DegreesRead,
    /// Sensors show the previous frame.
    StaleSensor,
    /// Readings have noise from one random state that all batches share.
    SharedNoise,
    /// The result depends on the number of threads.
    ThreadDependent,
    /// A restored state has zero velocity.
    ForgetsVelocity,
    /// A reset leaves a trace of the previous state.
    ResetRemembers,
    /// A snapshot of any scene is accepted, and has no effect.
    AnySnapshot,
    /// Parameters of one simulation are set in all.
    SharedParameters,
    /// Parameter changes during a rollout have no effect.
    ChangesIgnored,
    /// Torques of external wrenches are lost.
    WrenchTorqueLost,
    /// External forces act with the opposite sign.
    ForceReversed,
    /// Simulations outside of the request also move.
    OthersMove,
    /// Simulations after the 1024th stand still.
    LargeBatchCut,
    /// Simulations may be named in any order, but are taken in ascending order.
    OrderIgnored,
    /// A diverged simulation reports that it runs.
    DivergenceHidden,
    /// Commands that are not finite are taken as zero.
    NanAccepted,
    /// A hook gets the state of the previous step.
    HookLate,
    /// A hook gets the time since the rollout began.
    HookForgetsTime,
    /// A hook gets the index of the simulation in place of the rollout's row.
    HookCountsSimulations,
    /// With a hook, readings differ in their last bit.
    HookDisturbs,
    /// The axes of a body's inertia are taken as those of the body.
    InertiaTurnIgnored,
    /// A hook's force on a free joint acts at the centre of mass.
    HookForceAtCenter,
    /// Setting a mass leaves the inertia as it is.
    MassWithoutInertia,
    /// A mass can be set, but has no effect.
    MassUnused,
    /// A negative mass is taken as its absolute value.
    NegativeMass,
    /// `frameangvel` of a site reads in the site's frame.
    RateInOwnFrame,
    /// `gyro` reads in the world frame.
    GyroInWorld,
    /// `velocimeter` reads in the world frame.
    VelocimeterInWorld,
    /// A site has the orientation of its body.
    SiteTurnIgnored,
    /// Equality constraints are ignored.
    EqualitiesLeftOut,
    /// Density, viscosity and wind of the air are ignored.
    AirLeftOut,
}

impl Fault {
    /// All faults, except those that only [`Self::OF_FREE_BODIES`] has.
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

    /// Faults in the bodies of an engine of free bodies.
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

    /// Whether a full engine is tested with this fault: all faults of contact, and the commonest
    /// others.
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

    /// Whether an engine of mechanisms without contact can have this fault.
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
    /// The fault of the call.
    pub fault: Fault,
    /// Indices of the rollout's simulations.
    pub sims: &'a [usize],
    /// Length of a physics step, s.
    pub timestep: f64,
    /// Centre of mass in the first body's frame, m.
    pub center: Vector3<f64>,
    /// Positions and speeds of each row one step before.
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
