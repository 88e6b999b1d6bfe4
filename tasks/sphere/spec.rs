//! Specification of one task of the family.

use asid_core::parameter::Parameter;
use asid_core::task::{Condition, Outline};

use super::{STEERING, conditions, rolling_friction, walls};
use crate::steering::Steering;

/// An area in the plane: ranges of x and y, m.
pub type Area = [[f64; 2]; 2];

/// The part of a task that differs within the family.
#[derive(Clone)]
pub struct Spec {
    /// Name on the command line.
    pub name: &'static str,
    /// One line for `asid list`.
    pub about: &'static str,
    /// The scene's document; it includes `../panda.xml`.
    pub xml: &'static str,
    /// The unknowns.
    pub parameters: Vec<Parameter>,
    /// Optional unknowns.
    pub optional: Vec<Parameter>,
    /// Named truths.
    pub conditions: Vec<Condition>,
    /// Workspace and speed of the hand.
    pub steering: Steering,
    /// Number of control steps of exploration.
    pub horizon: usize,
    /// Area of the ball's position at the start of exploration.
    pub explored_from: Area,
    /// Area of the ball's position when it is struck.
    pub struck_from: Area,
    /// Position in which the ball must come to rest, m.
    pub goal: [f64; 2],
    /// A y coordinate behind the goal; a ball that passes it was struck too hard, m. See the
    /// metric.
    pub line: Option<f64>,
    /// Range of the paddle's speed, m/s.
    pub speed: [f64; 2],
    /// Length of an attempt, s.
    pub seconds: f64,
    /// Fixed objects, for pictures.
    pub fixtures: Vec<Outline>,
    /// Regions of the floor whose visits are counted.
    pub regions: Vec<Outline>,
    /// Names of the bodies of further tracked balls.
    pub distractors: &'static [&'static str],
    /// Algorithm settings that suit the task better than their defaults.
    pub settings: &'static [Setting],
}

impl Spec {
    /// The published task of this name and scene: one ball with unknown rolling friction on the
    /// floor, within walls.
    #[must_use]
    pub fn published([name, about]: [&'static str; 2], xml: &'static str) -> Self {
        Self {
            name,
            about,
            xml,
            parameters: vec![rolling_friction("floor")],
            optional: Vec::new(),
            conditions: conditions(),
            steering: STEERING,
            horizon: 20,
            explored_from: [[0.43, 0.65], [-0.2, 0.23]],
            struck_from: [[0.55, 0.65], [0.03, 0.05]],
            goal: [0.65, -0.40],
            line: None,
            speed: [0.3, 1.4],
            seconds: 4.5,
            fixtures: walls(),
            regions: Vec::new(),
            distractors: &[],
            settings: &[],
        }
    }
}

/// One numeric setting of an algorithm: section (`explorer`, `identifier` or `solver`), algorithm,
/// key, value.
pub type Setting = (&'static str, &'static str, &'static str, Number);

/// Value of a setting.
#[derive(Clone, Copy, Debug)]
pub enum Number {
    /// An integer, for counts.
    Whole(i64),
    /// A real number, for measures.
    Real(f64),
}
