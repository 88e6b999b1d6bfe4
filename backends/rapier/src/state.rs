//! Everything that determines a simulation's future, except its parameters.
//!
//! A state is a set of rapier's own collections, and saving clones them. The copy is exact, as it
//! includes warm-starting impulses, contact graphs and the broad phase. rapier's pipeline is
//! scratch memory and is not saved.

use asid_core::Status;
use rapier3d::dynamics::{
    CCDSolver, ImpulseJointSet, IslandManager, MultibodyJointSet, RigidBodySet, SoftBodySet,
};
use rapier3d::geometry::{BroadPhaseBvh, ColliderSet, NarrowPhase};

use crate::contact::Resistance;
use crate::structure::Structure;

/// State of one simulation.
#[derive(Clone)]
pub struct State {
    /// Rigid bodies.
    pub bodies: RigidBodySet,
    /// Shapes on them.
    pub colliders: ColliderSet,
    /// Groups of touching bodies.
    pub islands: IslandManager,
    /// Pairs of near shapes.
    pub broad_phase: BroadPhaseBvh,
    /// Contacts with their impulses.
    pub narrow_phase: NarrowPhase,
    /// Equality constraints.
    pub impulse_joints: ImpulseJointSet,
    /// Articulated trees.
    pub multibodies: MultibodyJointSet,
    /// Always empty; the pipeline requires the collection.
    pub soft_bodies: SoftBodySet,
    /// Continuous collision detection, which is off.
    pub ccd: CCDSolver,
    /// Rolling and torsional resistance stored by contacts.
    pub resistance: Resistance,
    /// Mass properties and places that the collections were built with.
    pub structure: Structure,
    /// Whether it was set and no step was taken since, so that no contact is known yet.
    pub fresh: bool,
    /// Time since the last reset or load, s.
    pub time: f64,
    /// Whether it runs.
    pub status: Status,
}
