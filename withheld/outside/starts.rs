//! Initial states of a machine that other authors modelled: about its reference, within its limits,
//! and with its loops closed.

use mujoco_rs::wrappers::mj_model::{MjModel, MjtObjBase};

use crate::anatomy::{Anatomy, JointKind};
use crate::engine;
use crate::machine::Start;

/// Spread of initial positions (rad or m) and velocities (rad/s or m/s).
///
/// A few degrees: far above the noise and far below the joints' motion.
const SPREAD: [f64; 2] = [0.05, 0.1];
/// Largest spread of a joint's initial positions to each side, as a share of the joint's range.
const OF_RANGE: f64 = 0.25;

/// Initial states of all hinges and slides; joints of a loop stay at the reference, which closes
/// it.
pub(super) fn of(anatomy: &Anatomy, model: &MjModel) -> Vec<Start> {
    let looped = looped(model);
    let scalar = anatomy.joints.iter().filter(|j| j.kind != JointKind::Free);
    scalar
        .filter_map(|j| {
            let id = engine::index(model, MjtObjBase::mjOBJ_JOINT, &j.name)?;
            let (mut center, mut spread) = (anatomy.qpos0[j.qpos], SPREAD[0]);
            if model.jnt_limited()[id] {
                let [low, high] = model.jnt_range()[id];
                spread = spread.min(OF_RANGE * (high - low));
                center = center.clamp(low + spread, high - spread);
            }
            (!looped[id]).then(|| Start {
                joint: super::keep(&j.name),
                position: vec![[center, spread]].leak(),
                velocity: vec![[0.0, SPREAD[1]]].leak(),
            })
        })
        .collect()
}

/// For each joint, whether an equality constraint ties it.
///
/// The constraint names the joint, or the joint lies between two bodies that are tied to each
/// other.
fn looped(model: &MjModel) -> Vec<bool> {
    let mut looped = vec![false; model.jnt_bodyid().len()];
    let (first, second) = (model.eq_obj1id(), model.eq_obj2id());
    for (i, kind) in model.eq_objtype().iter().enumerate() {
        let ends = [first[i], second[i]];
        let index = |id: i32| usize::try_from(id).ok();
        match *kind {
            MjtObjBase::mjOBJ_JOINT => {
                for joint in ends.into_iter().filter_map(index) {
                    looped[joint] = true;
                }
            }
            MjtObjBase::mjOBJ_BODY | MjtObjBase::mjOBJ_SITE => {
                let body = |id: usize| match *kind {
                    MjtObjBase::mjOBJ_SITE => usize::try_from(model.site_bodyid()[id]).unwrap_or(0),
                    _ => id,
                };
                let [a, b] = ends.map(|id| chain(model, index(id).map_or(0, body)));
                for (joint, at) in looped.iter_mut().zip(model.jnt_bodyid()) {
                    *joint |= a.contains(at) != b.contains(at);
                }
            }
            _ => {}
        }
    }
    looped
}

/// A body and all its ancestors.
fn chain(model: &MjModel, body: usize) -> Vec<i32> {
    let mut all = vec![i32::try_from(body).unwrap_or(0)];
    while let Some(&last) = all.last().filter(|&&b| b > 0) {
        all.push(model.body_parentid()[usize::try_from(last).unwrap_or(0)]);
    }
    all
}
