//! A diagnosis that is stopped returns what it knows by then.

use std::sync::Mutex;

use asid::core::Progress;
use asid::diagnosis::diagnose::{Diagnosis, Settings, diagnose};
use asid::diagnosis::machine::Machine;
use asid::diagnosis::study::Study;
use asid::results::naming::grouped;

use super::diagnosis_support::engine;
use super::world::{Truth, write_study};

/// Stops the work at ranking number `last`, counted from 1.
struct Until {
    last: usize,
    /// Whether to report that time is up from then on.
    late: bool,
    seen: Mutex<Vec<Vec<(String, f64)>>>,
}

impl Until {
    fn ranking_number(last: usize) -> Self {
        let seen = Mutex::default();
        let late = true;
        Self { last, late, seen }
    }
}

impl Progress for Until {
    fn begin(&self, _stage: &str, _total: u64) {}
    fn advance(&self, _units: u64) {}
    fn end(&self) {}
    fn ranking(&self, _stage: &str, rows: &[(String, f64)]) {
        self.seen.lock().unwrap().push(rows.to_vec());
    }
    fn is_stopped(&self) -> bool {
        self.seen.lock().unwrap().len() >= self.last
    }
    fn is_late(&self) -> bool {
        self.late && self.is_stopped()
    }
}

fn run(until: &Until) -> Diagnosis {
    let folder = tempfile::tempdir().unwrap();
    write_study(folder.path(), Truth::Coulomb(1.2));
    let study = Study::read(folder.path()).unwrap();
    let (fixed, effects) = (&study.fixed, &study.effects);
    let machine = Machine::new(engine(), &study.scene, fixed, effects, 0).unwrap();
    diagnose(&study, machine, Settings::default(), until)
        .unwrap()
        .0
}

#[test]
fn a_stopped_search_still_fits_the_values_that_it_found_unless_it_is_late() {
    let of = |late| {
        let until = Until {
            late,
            ..Until::ranking_number(1)
        };
        let result = run(&until).result;
        let mut stages = result.not_tried.iter().map(|n| &*n.stage);
        let is_cut = stages.any(|s| s == "fit of the values to whole replays");
        (is_cut, result.gap.refined)
    };
    let ((late_is_cut, late), (soon_is_cut, soon)) = (of(true), of(false));
    assert!(late_is_cut && !soon_is_cut);
    assert!(soon < 1.001 * late, "{soon} after the fit, {late} before");
}

#[test]
fn stopped_after_the_screening_it_ranks_what_was_screened_and_says_what_was_not_tried() {
    let until = Until::ranking_number(1);
    let r = run(&until).result;
    // Tolerances have no name.
    let mut table = until.seen.lock().unwrap()[0].clone();
    table.retain(|row| row.0 != "tolerances");
    // The ranking has the screened sets in the order of the screening, except the leader, which was
    // linearised once more.
    let screened = r.ranking.iter().filter(|s| s.fitted.is_none());
    for (row, (name, gain)) in screened.zip(&table[1..]) {
        assert_eq!(&grouped(&row.effects).join(" + "), name);
        assert_eq!(row.screened, Some(*gain));
    }
    assert!(table.windows(2).all(|w| w[0].1 >= w[1].1));
    let stages: Vec<&str> = r.not_tried.iter().map(|n| &*n.stage).collect();
    assert!(
        stages.contains(&"confirmation of what leads in screening"),
        "{stages:?}"
    );
    assert!(r.not_tried.iter().all(|n| !n.stage.is_empty()));
    let left = &r.not_tried[0].effects;
    assert!(
        !left.is_empty() && left.iter().all(|l| table.iter().any(|t| t.0 == *l)),
        "{left:?}"
    );
    assert!(r.sentence.contains("stopped early"), "{}", r.sentence);
    let sum: f64 = r.hypotheses.iter().map(|h| h.probability).sum();
    assert!((sum - 1.0).abs() < 1e-9, "probabilities sum to {sum}");
    // Angles: zero to itself, symmetric, and between parallel and orthogonal.
    let table = r.isolability.as_ref().unwrap();
    let n = table.effects.len();
    assert!(n > 1 && n <= 20);
    for i in 0..n {
        assert!(table.angles[i][i] < 1e-3, "{}", table.effects[i]);
        for j in 0..n {
            let angle = table.angles[i][j];
            // A right angle is exact to a ten-thousandth.
            assert!((0.0..=std::f64::consts::FRAC_PI_2 + 1e-4).contains(&angle));
            assert!((angle - table.angles[j][i]).abs() < 1e-6);
        }
    }
    // Nothing depends on the clock; the study is named after its folder.
    let mut again = run(&Until::ranking_number(1)).result;
    again.study.clone_from(&r.study);
    // As JSON, in which a limit beyond the range is not a number but null.
    let [first, second] = [&r, &again].map(|r| serde_json::to_string(r).unwrap());
    assert_eq!(first, second);
}

#[test]
fn a_diagnosis_that_is_not_stopped_leaves_nothing_untried_and_draws_the_law_through_the_missing_force()
 {
    let Diagnosis { result, trace, .. } = run(&Until::ranking_number(usize::MAX));
    assert!(result.not_tried.is_empty(), "{:?}", result.not_tried);
    assert_eq!(result.verdict.effects, ["coulomb-friction@rail"]);
    let force = &trace.forces[0];
    assert_eq!((&*force.dof, &*force.unit), ("rail", "N"));
    let s = &force.spread;
    assert!(s.before.len() > 100 && s.before.len() <= 400);
    // The missing force is the sum of what the refined model adds (friction and the mass fitted
    // with it) and what is left.
    let moving: Vec<usize> = (0..s.speed.len())
        .filter(|&k| s.speed[k].abs() > 0.2 && s.law[k].is_finite())
        .collect();
    assert!(moving.len() > 50);
    let rms = |f: &dyn Fn(usize) -> f64| -> f64 {
        let sum: f64 = moving.iter().map(|&k| f(k).powi(2)).sum();
        (sum / moving.len() as f64).sqrt()
    };
    let before = rms(&|k| s.before[k]);
    let apart = rms(&|k| s.before[k] - s.law[k] - s.after[k]);
    let left = rms(&|k| s.after[k]);
    assert!(apart < 0.3 * before, "{apart} of {before}");
    assert!(left < 0.2 * before, "{left} of {before}");
}
