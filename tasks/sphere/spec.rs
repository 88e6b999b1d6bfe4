//! What a task of the family says of itself.

use asid_core::parameter::Parameter;
use asid_core::task::{Condition, Outline};

use super::{STEERING, conditions, rolling_friction, walls};
use crate::steering::Steering;

/// A place in the plane: ranges of x and y, m.
pub type Area = [[f64; 2]; 2];

/// What is a task's own.
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
    /// Unknowns that can be switched on.
    pub optional: Vec<Parameter>,
    /// Named truths.
    pub conditions: Vec<Condition>,
    /// Where the hand may go.
    pub steering: Steering,
    /// Control steps of exploration.
    pub horizon: usize,
    /// Where the ball lies when exploration begins.
    pub explored_from: Area,
    /// Where the ball lies when it is struck.
    pub struck_from: Area,
    /// Where it is to come to rest, m.
    pub goal: [f64; 2],
    /// A y behind the goal past which a ball has been struck too hard, m; see the metric.
    pub line: Option<f64>,
    /// Range of the paddle's speed, m/s.
    pub speed: [f64; 2],
    /// Length of an attempt, s.
    pub seconds: f64,
    /// Things that stand still, for pictures.
    pub fixtures: Vec<Outline>,
    /// Parts of the floor whose visits are counted.
    pub regions: Vec<Outline>,
    /// Further balls that are tracked, by the names of their bodies.
    pub distractors: &'static [&'static str],
    /// Numbers of algorithms that suit the task better than their defaults.
    pub settings: &'static [Setting],
}

impl Spec {
    /// The published task of this name and scene: one ball whose rolling friction on the floor is unknown, within walls.
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

/// A number among an algorithm's settings: section (`explorer`, `identifier` or `solver`), algorithm, key, value.
pub type Setting = (&'static str, &'static str, &'static str, Number);

/// Value of a setting.
#[derive(Clone, Copy, Debug)]
pub enum Number {
    /// Of something that is counted.
    Whole(i64),
    /// Of something that is measured.
    Real(f64),
}
