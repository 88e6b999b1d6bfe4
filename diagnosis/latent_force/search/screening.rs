//! Screening: all open candidates as columns of one regression upon a set, and its detection
//! limits.

use asid_core::Result;
use nalgebra::DMatrix;

use crate::candidate::{Candidate, nameable};
use crate::latent_force::columns::{Columns, Form, Leads};
use crate::latent_force::detection::{Limit, limits};
use crate::latent_force::rehearsal::{Rehearsal, rehearse};
use crate::latent_force::scales::{Scales, at_own_scales};
use crate::latent_force::screen::{Pairs, Screened, isolability, rank};
use crate::latent_force::smoother::Regression;

use super::prior::log_prior;
use super::round::Upon;
use super::tolerances::{Tolerances, of_names};

/// Leading candidates that are compared in pairs.
const COMPARED: usize = 20;

/// Leading sets on a part of the logs whose members are then screened on all of them.
///
/// These are twice as many sets as are [raced](crate::settings::Breadth), because a part ranks them
/// slightly differently.
const LEADING: usize = 16;

/// What a screening could have shown.
#[derive(Clone, Debug, Default)]
pub struct Sight {
    /// The detection limit of each candidate.
    pub limits: Vec<Limit>,
    /// Results of screenings of simulated logs.
    pub rehearsal: Rehearsal,
}

/// The open candidates, their columns, and their sets ranked by evidence.
pub(super) struct Look {
    pub(super) some: Vec<Candidate>,
    pub(super) columns: Columns,
    pub(super) ranked: Vec<Screened>,
    scales: Scales,
}

impl Look {
    /// Whether a form has no derivative at its null.
    pub(super) fn is_secant(&self, form: usize) -> bool {
        self.columns.forms[form].slopes.iter().all(Option::is_none)
    }

    /// Evidence of some of the candidates together, each in its best form, without prior odds.
    ///
    /// `places` are positions in [`Look::some`]. `None` if one of them was not screened.
    pub(super) fn evidence_of(&self, places: &[usize]) -> Option<f64> {
        let best_form = |place: &usize| {
            let is_of = |s: &&Screened| matches!(s.forms[..], [f] if self.columns.forms[f].candidate == *place);
            self.ranked.iter().find(is_of).map(|s| s.forms[0])
        };
        let forms: Vec<usize> = places.iter().map(best_form).collect::<Option<_>>()?;
        let base: Vec<usize> = (0..self.columns.base).collect();
        let own = forms.iter().flat_map(|&f| self.columns.forms[f].columns());
        let all: Vec<usize> = base.iter().copied().chain(own).collect();
        let [with, without] = [&all, &base].map(|which| self.scales.best(&self.columns, which).0);
        Some(with - without)
    }
}

/// A screening: the ranked candidates, and further results.
pub(super) struct Screening {
    pub(super) look: Look,
    /// Leading candidates, and the cosines between each two.
    pub(super) alike: (Vec<usize>, DMatrix<f64>),
    pub(super) sight: Sight,
    /// The tolerances, and the evidence of the best few names.
    pub(super) tolerances: Option<Tolerances>,
    pub(super) of_names: f64,
}

impl Upon<'_> {
    /// Ranks the open candidates, and some pairs of them, by one regression.
    pub(super) fn look(&self, pairs: Pairs) -> Result<Look> {
        self.progress.begin("screening", 1);
        let open = self.open.iter();
        let some: Vec<Candidate> = open.map(|&c| self.candidates[c].clone()).collect();
        let fitted = &self.base.fitted;
        let model = (&fitted.hypothesis, &fitted.theta[..]);
        let leads = |columns: &Columns| self.leads(columns, &some, pairs);
        let asked = (&some[..], &leads as Leads<'_>);
        let estimates = (&fitted.estimate, self.priors);
        let columns = Columns::of(self.context, model, estimates, asked, self.progress)?;
        let price = self.price();
        let estimate = at_own_scales(self.context, &fitted.estimate, &columns);
        let scales = Scales::of(self.context, &estimate, (&columns, &some));
        let mut ranked = rank(&scales, &columns, &some, (pairs, price));
        for s in &mut ranked {
            let members = s.forms.iter().map(|&f| columns.forms[f].candidate);
            s.gain += log_prior(self.context.plant(), &some, &members.collect::<Vec<_>>());
        }
        ranked.sort_by(|a, b| b.worth(price).total_cmp(&a.worth(price)));
        self.progress.end();
        Ok(Look {
            some,
            columns,
            ranked,
            scales,
        })
    }

    /// Ranks the open candidates, and computes what the screening could have shown.
    pub(super) fn screen(&self) -> Result<Screening> {
        let look = self.look(Pairs::BeyondTheSum)?;
        let Look {
            some,
            columns,
            ranked,
            scales,
        } = &look;
        let singles = ranked.iter().filter(|s| s.forms.len() == 1);
        let leading: Vec<usize> = singles.map(|s| s.forms[0]).take(COMPARED).collect();
        let candidate = |&f: &usize| self.open[columns.forms[f].candidate];
        let alike = (
            leading.iter().map(candidate).collect(),
            isolability(&scales.common[0], columns, &leading),
        );
        let tolerances = Tolerances::of((scales, columns), self.open, self.candidates, self.base);
        let of_names = tolerances
            .as_ref()
            .map_or(0.0, |_| of_names(scales, columns, ranked, self.price()));
        let found = ranked.iter().find(|s| s.forms.len() == 1);
        let found = found.map_or(0.0, |s| s.gain);
        let sight = self.sight((scales, found), columns, some);
        Ok(Screening {
            look,
            alike,
            sight,
            tolerances,
            of_names,
        })
    }

    /// Price of a further name: the logarithm of the number of candidates.
    pub(super) fn price(&self) -> f64 {
        (nameable(self.candidates).max(1) as f64).ln()
    }

    /// Which candidates lead by columns along a part of the logs.
    ///
    /// These are the members of the leading sets, and tolerances, which are judged all at once.
    fn leads(&self, columns: &Columns, some: &[Candidate], pairs: Pairs) -> Vec<bool> {
        let estimate = at_own_scales(self.context, &self.base.fitted.estimate, columns);
        let scales = Scales::of(self.context, &estimate, (columns, some));
        let mut leads: Vec<bool> = some.iter().map(|c| c.is_tolerance).collect();
        for set in rank(&scales, columns, some, (pairs, self.price()))
            .iter()
            .take(LEADING)
        {
            let members = set.forms.iter().map(|&f| columns.forms[f].candidate);
            members.for_each(|c| leads[c] = true);
        }
        leads
    }

    /// What a screening could have shown; `found` is the evidence of its best candidate, prior odds
    /// included.
    ///
    /// The limits are those at the most likely of the scales of `q`.
    fn sight(
        &self,
        (scales, found): (&Scales, f64),
        columns: &Columns,
        some: &[Candidate],
    ) -> Sight {
        let likely =
            |a: &&Regression, b: &&Regression| a.log_likelihood.total_cmp(&b.log_likelihood);
        let Some(sum) = scales.common.iter().max_by(likely) else {
            return Sight::default();
        };
        let mut limits = limits(sum, columns, some, self.threshold());
        let odds = |f: &Form| log_prior(self.context.plant(), some, &[f.candidate]);
        let odds: Vec<f64> = columns.forms.iter().map(odds).collect();
        let all = (columns, &odds[..]);
        let mut rehearsal = rehearse(scales, all, (&limits, found), self.breadth.seed);
        let place = |c: &mut usize| *c = self.open[*c];
        limits.iter_mut().for_each(|l| place(&mut l.candidate));
        let taken_for = rehearsal.recognised.iter_mut().flatten();
        taken_for.filter_map(|r| r.1.as_mut()).for_each(place);
        Sight { limits, rehearsal }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DVector;

    use super::*;

    /// Symptom: a law at two of three joints was never exchanged for another one. Cause: its
    /// evidence was that of a ranked set with the same members, and only single candidates and
    /// groups of all are ranked.
    #[test]
    fn a_law_at_some_of_its_sites_has_an_evidence() {
        // Three candidates with a column of information 100 each, and moments 60, 40 and 0.
        let form = |candidate: usize| Form {
            candidate,
            begin: vec![0.0],
            slopes: vec![Some((0, 1.0))],
            first: candidate,
        };
        let columns = Columns {
            linear: Vec::new(),
            base: 0,
            forms: (0..3).map(form).collect(),
            center: vec![0.0; 3],
            bounds: vec![[-9.0, 9.0]; 3],
            complete: true,
        };
        let sum = Regression {
            log_likelihood: -7.0,
            gram: DMatrix::from_diagonal_element(3, 3, 100.0),
            moment: DVector::from_row_slice(&[60.0, 40.0, 0.0]),
        };
        let scales = Scales::known(vec![sum], Vec::new());
        let single = |form: usize| Screened {
            forms: vec![form],
            names: 1,
            gain: 0.0,
            base: Vec::new(),
            coefficients: Vec::new(),
        };
        let look = Look {
            some: Vec::new(),
            columns,
            ranked: vec![single(1), single(0)],
            scales,
        };
        let each = |b: f64| 0.5 * b * b / 101.0 - 0.5 * 101.0_f64.ln();
        let both = look.evidence_of(&[0, 1]).unwrap();
        assert!((both - each(60.0) - each(40.0)).abs() < 1e-9, "{both}");
        assert_eq!(look.evidence_of(&[0, 2]), None, "the last was not screened");
    }
}
