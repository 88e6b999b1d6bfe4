//! The joint between the two parts that a task tracks, in results and in the output.

use asid_algorithms::identify::articulation::{Articulation, Joint, of_episodes};
use asid_core::{Episode, Result};
use serde::Serialize;

use super::session::Session;

/// The joint between the task's two tracked parts.
#[derive(Serialize)]
#[serde(transparent)]
pub struct TrackedJoint {
    /// As estimated from real episodes; missing where there are no such parts or no episode, and
    /// where it cannot be told.
    articulation: Option<Articulation>,
    /// Why it cannot be told.
    #[serde(skip)]
    untold: Option<String>,
}

impl TrackedJoint {
    /// The joint by these episodes.
    pub fn of(session: &Session, episodes: &[Episode]) -> Self {
        let layout = session.model.layout();
        Self::new(if episodes.is_empty() {
            Ok(None)
        } else {
            of_episodes(&*session.task, layout, &session.signals, episodes)
        })
    }

    /// The joint or the reason why it cannot be told. It is a by-product: the fit of the unknowns
    /// stands without it.
    fn new(found: Result<Option<Articulation>>) -> Self {
        let (articulation, untold) = match found {
            Ok(articulation) => (articulation, None),
            Err(error) => (None, Some(error.to_string())),
        };
        Self {
            articulation,
            untold,
        }
    }

    /// Whether there is no estimate.
    pub fn is_missing(&self) -> bool {
        self.articulation.is_none()
    }

    /// What is said of it; `None` where there is nothing to say.
    pub fn line(&self) -> Option<String> {
        let untold = |why: &String| format!("joint of the tracked parts: cannot be told, {why}");
        let found = self.articulation.as_ref().map(articulation_line);
        found.or_else(|| self.untold.as_ref().map(untold))
    }
}

/// Text `revolute joint (100 %), axis …, origin …` of an articulation.
fn articulation_line(found: &Articulation) -> String {
    let (name, p) = match found.joint {
        Joint::Rigid => ("rigid", found.probability[0]),
        Joint::Revolute => ("revolute", found.probability[1]),
        Joint::Prismatic => ("prismatic", found.probability[2]),
    };
    let vector = |v: &[f64; 3]| format!("({:.3}, {:.3}, {:.3})", v[0], v[1], v[2]);
    let mut line = format!("joint of the tracked parts: {name} ({:.1} %)", 100.0 * p);
    if let Some(axis) = &found.axis {
        line += &format!(", axis {}", vector(axis));
    }
    if let Some(origin) = &found.origin {
        line += &format!(" through {} m", vector(origin));
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;
    use asid_core::Error;

    /// Symptom: a log with two readings of a laptop's lid ended `asid identify` in an error after the
    /// fit, which was lost. Cause: the joint of the tracked parts needs three readings, and its error
    /// was that of the whole call.
    #[test]
    fn a_joint_that_cannot_be_told_is_said_and_costs_nothing_else() {
        let joint = TrackedJoint::new(Err(Error::Failed("too few readings: 2".into())));
        let line = joint.line().unwrap();
        assert!(
            line.ends_with("cannot be told, too few readings: 2"),
            "{line}"
        );
        assert!(joint.is_missing());
        assert_eq!(TrackedJoint::new(Ok(None)).line(), None);
    }
}
