//! Race of a round: the leading sets of a screening are fitted briefly.

use asid_core::Result;

use crate::latent_force::screen::Screened;

use super::finish::Fits;
use super::has_tolerances;
use super::round::Upon;
use super::screening::Look;
use super::set::{Set, name_of};
use super::tolerances::Tolerances;

/// Evidence, in nats, by which a set may end below the base that it contains: a value that the logs
/// tell to a millionth of its prior costs 14.
const LOST: f64 = 15.0;
/// Share of the screened coefficients of the added effects with which such a set begins again.
const NEARER: f64 = 0.1;

impl Upon<'_> {
    /// Fits the leading sets of a screening briefly, and tolerances too unless they are far behind.
    ///
    /// Once a set upon the model without effects leaves no gap of replays, sets that the screening
    /// puts far behind it are skipped. A set is far behind if its screened evidence is below a
    /// share ([`Breadth::behind`](crate::settings::Breadth::behind)) of what that set has gained.
    /// It would have to close the gap too, and be ahead. The closing set's own law at more sites is
    /// still tried.
    pub(super) fn race(&self, look: &Look, tolerances: Option<&Tolerances>) -> Result<Fits> {
        let (breadth, progress) = (self.breadth, self.progress);
        let ranked = &look.ranked;
        let price = self.price();
        let lead = ranked.first().map_or(0.0, |s| s.worth(price));
        let least = (breadth.share * lead).max(breadth.least);
        let replayed = self.replayed(look)?;
        let due = self.due(look, &replayed, least);
        progress.begin("confirming", due.len().min(breadth.raced) as u64);
        let (mut sets, mut risen) = (Vec::new(), 0);
        let (mut closed, mut far) = (Vec::new(), f64::NEG_INFINITY);
        let mut left_out = Vec::new();
        let not_far = lead - (breadth.behind * lead).max(breadth.near);
        let mut near = tolerances.filter(|t| t.gain > not_far);
        for (place, due) in due.into_iter().enumerate() {
            let s = due.screened;
            // A set that has not reached the base gives its place to the next.
            if risen == breadth.raced {
                break;
            }
            let members = self.members(look, s);
            let holds = s.names == 1 && members.iter().any(|m| closed.contains(m));
            let is_out = replayed.closes && due.is_behind && !closed.is_empty();
            if (s.worth(price) < far || is_out) && !holds {
                continue;
            }
            // The leader is always fitted: if time is out, the answer rests on it.
            if place > 0 && progress.is_stopped() {
                left_out.push(members);
                continue;
            }
            progress.note(&format!("trying {}", name_of(self.candidates, &members)));
            let is_screened = due.elsewhere.is_none();
            let mut set = match due.elsewhere {
                Some(set) => self.with_starts(set.clone())?,
                None => self.begun(look, s)?,
            };
            set.fit(self.context, (breadth.rounds[0], progress))?;
            if !self.base.candidates.is_empty() && is_screened {
                set = self.unless_lost(set, (look, s))?;
            }
            if set.fitted.evidence + set.fitted.promised > self.base.fitted.evidence {
                risen += 1;
                progress.advance(1);
            }
            if self.base.candidates.is_empty() && self.is_closed_by(Some(&set))? {
                let gain = set.fitted.evidence - self.base.fitted.evidence;
                far = far.max(breadth.behind * gain);
                closed.extend(&set.candidates);
            }
            sets.push(set);
            sets.extend(self.tried(near.take())?);
        }
        sets.extend(self.tried(near)?);
        Ok(Fits { sets, left_out })
    }

    /// A set that was fitted briefly, or a fit of it that begins nearer to the base if that is better.
    ///
    /// A set contains its base. If its fit has ended far below, its first step was too long.
    fn unless_lost(&self, set: Set, (look, s): (&Look, &Screened)) -> Result<Set> {
        let reached = set.fitted.evidence + set.fitted.promised;
        if reached >= self.base.fitted.evidence - LOST || self.progress.is_stopped() {
            return Ok(set);
        }
        let near = Screened {
            base: vec![0.0; s.base.len()],
            coefficients: (s.coefficients.iter())
                .map(|all| all.iter().map(|c| NEARER * c).collect())
                .collect(),
            ..s.clone()
        };
        let mut again = self.begun(look, &near)?;
        again.fit(self.context, (self.breadth.rounds[0], self.progress))?;
        let is_better = again.fitted.evidence > set.fitted.evidence;
        Ok(if is_better { again } else { set })
    }

    /// Tolerances added to the base and fitted briefly, if there are any.
    fn tried(&self, tolerances: Option<&Tolerances>) -> Result<Option<Set>> {
        let Some(tolerances) = tolerances else {
            return Ok(None);
        };
        self.progress.note("trying tolerances");
        let mut set = tolerances.beside(self.base, self.candidates);
        set.fit(self.context, (self.breadth.rounds[0], self.progress))?;
        Ok(Some(set))
    }

    /// If a group leads the `raced` sets, the best law at one site with tolerances, fitted briefly.
    ///
    /// One law at all sites makes up for many small errors, as tolerances do. It is not there if it
    /// is strong at one site only and the rest is small errors. If the group falls behind that, it
    /// is fitted with tolerances too.
    pub(super) fn beside_tolerances(
        &self,
        tolerances: Option<&Tolerances>,
        raced: &[Set],
    ) -> Result<Vec<Set>> {
        let before = self.base.candidates.len();
        let added = |s: &Set| s.candidates[before.min(s.candidates.len())..].to_vec();
        let by_evidence = |a: &&Set, b: &&Set| a.fitted.evidence.total_cmp(&b.fitted.evidence);
        let named = raced.iter().filter(|s| !has_tolerances(self.candidates, s));
        let leads = named.clone().max_by(by_evidence);
        let (Some(tolerances), Some(group)) = (tolerances, leads) else {
            return Ok(Vec::new());
        };
        let members = added(group);
        let is_single = |s: &&Set| matches!(added(s)[..], [_]);
        let Some(member) = named.filter(is_single).max_by(by_evidence) else {
            return Ok(Vec::new());
        };
        let mut fitted = Vec::new();
        for set in [member, group] {
            let is_behind = fitted
                .last()
                .is_none_or(|alone: &Set| alone.fitted.evidence > group.fitted.evidence);
            if members.len() < 2 || self.progress.is_stopped() || !is_behind {
                break;
            }
            let name = name_of(self.candidates, &set.candidates);
            self.progress
                .note(&format!("trying {name} with tolerances"));
            let mut set = tolerances.beside(set, self.candidates);
            set.fit(self.context, (self.breadth.rounds[0], self.progress))?;
            fitted.push(set);
        }
        Ok(fitted)
    }
}
