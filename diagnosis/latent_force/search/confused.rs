//! Fits of effects that are easily mistaken for a leading name and that no fit has included.
//!
//! A screening ranks laws about the trajectory of the model without them. Dry friction changes sign
//! there with every error of a speed's sign, and shows a tenth of its evidence. A dead band of the
//! drive at the same joint shows half. Once the dead band leads the fits, nothing far behind is
//! raced. So the effects that a leading law is [mistaken for](asid_effects::Effect::mistaken_for),
//! as either of the two declares, are fitted too if they act at the same place.

use asid_core::Result;
use asid_effects::Reach;

use crate::candidate::Candidate;
use crate::latent_force::context::Context;
use crate::latent_force::screen::Screened;

use super::round::Upon;
use super::screening::Look;
use super::set::Set;

/// Most such names that are fitted: for a drive, backlash and friction of its joint.
const MOST: usize = 2;

/// Whether two candidates are easily mistaken for each other, as either declares, and one acts on
/// no more than the other acts on.
pub(super) fn is_confused(
    context: &Context<'_>,
    candidates: &[Candidate],
    (a, b): (usize, usize),
) -> bool {
    let [a, b] = [a, b].map(|c| &candidates[c]);
    let says = |a: &Candidate, b: &Candidate| {
        let mut with = a.effect.mistaken_for().iter().flat_map(|c| c.with);
        with.any(|name| *name == b.spec.name)
    };
    let plant = context.plant();
    let [reach, other] = [a, b].map(|c| c.effect.reach(plant, &c.spec.site));
    is_within(&reach, &other) && (says(a, b) || says(b, a))
}

/// Whether one of two effects acts on no more than what the other one acts on.
///
/// A tilt acts on all that a force on the only body acts on.
fn is_within(a: &Reach, b: &Reach) -> bool {
    match (a, b) {
        (Reach::Dofs(a), Reach::Dofs(b)) => a.is_subset(b) || b.is_subset(a),
        (Reach::Everything, Reach::Dofs(_)) | (Reach::Dofs(_), Reach::Everything) => true,
        _ => a == b,
    }
}

impl Upon<'_> {
    /// Adds to the sets that were `fitted` to the end sets with an effect that is easily mistaken
    /// for a name of the best set; best first.
    ///
    /// The effect is in none of the fitted sets. The likeliest two of the screening are fitted from
    /// the base of the round.
    pub(super) fn with_what_is_mistaken(&self, fitted: Vec<Set>, look: &Look) -> Result<Vec<Set>> {
        let Some(best) = fitted.first() else {
            return Ok(fitted);
        };
        let named =
            |c: &&usize| !self.candidates[**c].is_tolerance && !self.base.candidates.contains(*c);
        let names: Vec<usize> = best.candidates.iter().filter(named).copied().collect();
        let is_confused = |s: &&Screened| {
            let [into] = self.members(look, s)[..] else {
                return false;
            };
            let is_fitted = fitted.iter().any(|set| set.candidates.contains(&into));
            let confused = |&c: &usize| is_confused(self.context, self.candidates, (c, into));
            !is_fitted && names.iter().any(confused)
        };
        let mistaken = look.ranked.iter().filter(is_confused).take(MOST);
        let mut rivals = Vec::new();
        for screened in mistaken {
            if self.progress.is_stopped() {
                break;
            }
            rivals.push(self.begun(look, screened)?);
        }
        self.with_rivals(fitted, rivals)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tilt_acts_where_a_force_on_a_body_does_and_no_sensor_does() {
        let dofs = |d: &[usize]| Reach::Dofs(d.iter().copied().collect());
        assert!(is_within(&Reach::Everything, &dofs(&[0, 1])));
        assert!(is_within(&dofs(&[1]), &dofs(&[0, 1])));
        assert!(!is_within(&dofs(&[1, 2]), &dofs(&[0, 1])));
        assert!(!is_within(&Reach::Everything, &Reach::Sensor(0)));
        assert!(is_within(&Reach::Sensor(0), &Reach::Sensor(0)));
    }
}
