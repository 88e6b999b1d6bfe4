//! Limits that a motion must keep on a real machine.
//!
//! Every limit is checked in simulation, along whole trajectories: positions, speeds, forces of
//! drives, positions of bodies, contacts, and whether the machine comes to rest. A violation is
//! measured in units of the limit's own width. A search can then tell which of two motions violates
//! limits less.

mod unchecked;

use std::collections::BTreeMap;

use asid_core::error::{Error, Result};
use asid_core::layout::{Joint, JointKind};
use asid_mjcf::Plant;

/// Share of a joint's range that is kept free at either end: a real machine may have its stop
/// there.
const END_MARGIN: f64 = 0.02;

/// Share of a joint's range within which it counts as resting at an end of the range.
///
/// It may also pass the end by this share. Stops of a simulated machine yield by less (MuJoCo's
/// default `solimp` lets them yield by a thousandth of a rad or m).
pub const STOP: f64 = 2e-3;

/// Digits of the numbers in messages on ranges: enough to recognise radians as what they are in
/// degrees.
const DIGITS: usize = 3;

/// Share of the command's range that is kept free at either end.
const COMMAND_MARGIN: f64 = 0.0;

/// Default speed (rad/s or m/s) below which a joint is at rest.
///
/// It is the resolution of an arm's 12-bit encoder read at 100 Hz.
pub const REST: f64 = 0.15;

/// Limits that a user requests, by name.
#[derive(Clone, Debug, Default)]
pub struct LimitRequest {
    /// Positions of joints, rad or m.
    pub position: BTreeMap<String, [f64; 2]>,
    /// Speeds of joints, rad/s or m/s; the empty name stands for all others.
    pub speed: BTreeMap<String, f64>,
    /// Forces of drives on their joints, N or N m, by actuator; the empty name stands for all
    /// others.
    pub force: BTreeMap<String, f64>,
    /// Boxes that contain the frames of bodies: low and high corner, m, in the world's frame.
    pub boxes: BTreeMap<String, [[f64; 3]; 2]>,
    /// Pairs of bodies that may touch.
    pub touch: Vec<[String; 2]>,
    /// Largest speed at the end, rad/s or m/s; `None` where the machine need not come to rest.
    pub rest: Option<f64>,
}

/// A limit of a hinge or slide.
#[derive(Clone, Debug, PartialEq)]
pub struct JointLimit {
    /// Name.
    pub name: String,
    /// Index in `qpos`.
    pub qpos: usize,
    /// Index in `qvel`.
    pub dof: usize,
    /// Range of positions, rad or m.
    pub position: Option<[f64; 2]>,
    /// Ends of the joint's range in the model, rad or m, if `position` is that range less a margin.
    pub stops: Option<[f64; 2]>,
    /// Largest speed, rad/s or m/s.
    pub speed: Option<f64>,
}

impl JointLimit {
    /// Lets the joint stay at `at` if that is an end of its range or limit; returns whether it is.
    ///
    /// The end is one of the joint's range in the model, or of its limit. The limit then moves
    /// slightly beyond it, since stops yield.
    pub(crate) fn stay_at_stop(&mut self, at: f64) -> bool {
        let Some(limit) = &mut self.position else {
            return false;
        };
        let stops = self.stops.unwrap_or(*limit);
        let hair = STOP * (stops[1] - stops[0]);
        let mut stays = false;
        for (end, outward) in [(0, -hair), (1, hair)] {
            let near = [stops[end], limit[end]];
            if let Some(stop) = near.into_iter().find(|stop| (at - stop).abs() <= hair) {
                limit[end] = stop + outward;
                stays = true;
            }
        }
        stays
    }
}

/// A limit of a drive.
#[derive(Clone, Debug, PartialEq)]
pub struct DriveLimit {
    /// Index of the actuator.
    pub actuator: usize,
    /// Largest force on the joint, N or N m.
    pub force: f64,
}

/// A box that must contain the origin of a body's frame.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyBox {
    /// Name.
    pub name: String,
    /// Index of the body.
    pub body: usize,
    /// Low and high corner, m.
    pub corners: [[f64; 3]; 2],
}

/// Limits of a machine.
#[derive(Clone, Debug)]
pub struct Limits {
    /// Limits of hinges and slides.
    pub joints: Vec<JointLimit>,
    /// Drives with a limit.
    pub drives: Vec<DriveLimit>,
    /// Range of each actuator's command.
    pub command: Vec<Option<[f64; 2]>>,
    /// Boxes.
    pub boxes: Vec<BodyBox>,
    /// Pairs of bodies that must not touch.
    pub apart: Vec<[usize; 2]>,
    /// Largest speed at the end, rad/s or m/s.
    pub rest: Option<f64>,
    /// Parts for which a limit without a name does not hold, one sentence for each limit.
    pub unchecked: Vec<String>,
}

impl Limits {
    /// Limits of a machine: those requested, and the ranges of its model.
    ///
    /// # Errors
    /// When a name is unknown or that of a part whose limits cannot be checked, a low end is not
    /// below its high end, or a position lies beyond the joint's own range.
    pub fn new(
        plant: &Plant,
        ranges: &dyn Fn(usize) -> Option<[f64; 2]>,
        request: &LimitRequest,
    ) -> Result<Self> {
        let layout = &plant.layout;
        unchecked::check_names(plant, request)?;
        for (name, [low, high]) in &request.position {
            if low >= high {
                return Err(wrong(
                    "limit_position",
                    format!("position of `{name}`: {low} is not below {high}"),
                ));
            }
            if let Some(joint) = layout.joints.iter().position(|j| j.name == *name) {
                within_range(&layout.joints[joint], ranges(joint), [*low, *high])?;
            }
        }
        let joints = layout
            .joints
            .iter()
            .enumerate()
            .filter(|(_, j)| unchecked::is_checked(j))
            .map(|(i, joint)| {
                let shrink = |[low, high]: [f64; 2]| {
                    let margin = END_MARGIN * (high - low);
                    [low + margin, high - margin]
                };
                let given = request.position.get(&joint.name).copied();
                let stops = if given.is_some() { None } else { ranges(i) };
                let speed = request.speed.get(&joint.name).or(request.speed.get(""));
                JointLimit {
                    name: joint.name.clone(),
                    qpos: joint.qpos,
                    dof: joint.qvel,
                    position: given.or(stops.map(shrink)),
                    stops,
                    speed: speed.copied(),
                }
            })
            .collect();
        let drives = layout.actuators.iter().enumerate().filter_map(|(i, a)| {
            plant.drives[i]?;
            let force = request.force.get(&a.name).or(request.force.get(""))?;
            Some(DriveLimit {
                actuator: i,
                force: *force,
            })
        });
        let boxes = request
            .boxes
            .iter()
            .map(|(name, corners)| {
                if (0..3).any(|k| corners[0][k] >= corners[1][k]) {
                    return Err(wrong(
                        "limit_box",
                        format!("box of `{name}`: its low corner is not below its high one"),
                    ));
                }
                Ok(BodyBox {
                    name: name.clone(),
                    body: layout.body(name)?,
                    corners: *corners,
                })
            })
            .collect::<Result<_>>()?;
        let mut may_touch = Vec::new();
        for pair in &request.touch {
            may_touch.push([layout.body(&pair[0])?, layout.body(&pair[1])?]);
        }
        let command = layout.actuators.iter().map(|a| {
            a.ctrl_range.map(|[low, high]| {
                let margin = COMMAND_MARGIN * (high - low);
                [low + margin, high - margin]
            })
        });
        Ok(Self {
            joints,
            drives: drives.collect(),
            command: command.collect(),
            boxes,
            apart: pairs_apart(plant, &may_touch),
            rest: request.rest,
            unchecked: unchecked::sentences(plant, request),
        })
    }
}

/// Refuses a limit of a joint that goes beyond its `range` in the model by more than stops yield.
///
/// Degrees in place of radians would otherwise widen the range.
fn within_range(joint: &Joint, range: Option<[f64; 2]>, given: [f64; 2]) -> Result<()> {
    let Some([low, high]) = range else {
        return Ok(());
    };
    let hair = STOP * (high - low);
    if given[0] >= low - hair && given[1] <= high + hair {
        return Ok(());
    }
    let (name, [from, to]) = (&joint.name, given);
    let unit = match joint.kind {
        JointKind::Hinge => "rad (90 degrees are 1.571 rad)",
        _ => "m",
    };
    Err(wrong(
        "limit_position",
        format!(
            "position of `{name}`: {from} to {to} goes beyond the joint's range in the model, {low:.DIGITS$} to {high:.DIGITS$}; it is in {unit}; \
             give a range within that one, or widen the model's"
        ),
    ))
}

/// Pairs of bodies that can touch, each once, without those that are allowed to.
fn pairs_apart(plant: &Plant, may_touch: &[[usize; 2]]) -> Vec<[usize; 2]> {
    let mut pairs: Vec<[usize; 2]> = plant
        .contacts
        .iter()
        .map(|pair| {
            let mut bodies = pair.map(|g| plant.geoms[g].body);
            bodies.sort_unstable();
            bodies
        })
        .collect();
    pairs.sort_unstable();
    pairs.dedup();
    let same = |a: &[usize; 2], b: &[usize; 2]| a == b || (a[0] == b[1] && a[1] == b[0]);
    pairs.retain(|p| !may_touch.iter().any(|m| same(m, p)));
    pairs
}

fn wrong(key: &str, message: String) -> Error {
    Error::Config {
        key: key.into(),
        message,
    }
}

/// Violations of limits, in units of their own width; zero where all are kept.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Excess {
    /// Sum over frames and limits, each frame weighted by its share of the motion.
    pub total: f64,
    /// The worst violation: a description, and its size.
    pub worst: Option<(String, f64)>,
}

impl Excess {
    /// Adds the violation of a limit, in units of its width, at one of `frames` frames.
    pub fn add(&mut self, excess: f64, frames: usize, what: impl FnOnce() -> String) {
        if excess.is_nan() || excess > 0.0 {
            let excess = if excess.is_nan() { DIVERGED } else { excess };
            self.total += excess / frames.max(1) as f64;
            if self.worst.as_ref().is_none_or(|(_, w)| excess > *w) {
                self.worst = Some((what(), excess));
            }
        }
    }

    /// Adds the violations of another trajectory.
    pub fn join(&mut self, other: &Self) {
        self.total += other.total;
        if let Some((what, excess)) = &other.worst
            && self.worst.as_ref().is_none_or(|(_, w)| excess > w)
        {
            self.worst = Some((what.clone(), *excess));
        }
    }

    /// The same violations, described with the point where they occur.
    #[must_use]
    pub fn at(&self, place: impl FnOnce() -> String) -> Self {
        let mut excess = self.clone();
        if let Some((what, _)) = &mut excess.worst {
            let place = place();
            if !place.is_empty() {
                *what += &format!(" at {place}");
            }
        }
        excess
    }

    /// Whether all limits are kept.
    #[must_use]
    pub fn is_none(&self) -> bool {
        self.worst.is_none()
    }
}

/// Violation that a diverged simulation counts as, in widths of a limit.
///
/// It exceeds that of a motion that merely breaks a limit.
pub const DIVERGED: f64 = 1e3;

#[cfg(test)]
mod tests {
    use super::*;
    use asid_core::Scene;

    /// A hinge of a quarter turn to either side, on a wheel that turns freely.
    const ARM: &str = r#"<mujoco><compiler angle="radian"/><worldbody>
        <body><joint name="wheel" axis="0 1 0"/><geom size="0.1"/>
        <body><joint name="elbow" axis="0 1 0" range="-1.57 1.57"/><geom size="0.05"/></body></body>
        </worldbody></mujoco>"#;

    /// Symptom: `--limit-position elbow:-90:90` let a joint of ±1.57 rad turn by 90 rad. Cause: a
    /// limit that was given replaced the model's range, whatever that is.
    #[test]
    fn a_limit_in_degrees_does_not_widen_the_models_range() {
        let plant = Plant::of(&Scene::from_xml("arm", ARM, &[]).unwrap()).unwrap();
        let limits = |joint: &str, range: [f64; 2]| {
            let request = LimitRequest {
                position: [(joint.to_owned(), range)].into(),
                ..LimitRequest::default()
            };
            Limits::new(&plant, &|joint| plant.joints[joint].range, &request)
        };
        let said = limits("elbow", [-90.0, 90.0]).unwrap_err().to_string();
        let parts = ["`elbow`: -90 to 90", "-1.570 to 1.570", "is in rad"];
        assert!(parts.iter().all(|part| said.contains(part)), "{said}");
        assert!(limits("elbow", [0.0, 2.0]).is_err());
        // The whole range, and all of a joint that has none.
        assert!(limits("elbow", [-1.57, 1.57]).is_ok());
        assert!(limits("wheel", [-90.0, 90.0]).is_ok());
    }
}
