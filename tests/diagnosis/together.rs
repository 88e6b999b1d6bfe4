//! Columns that share simulations agree with columns that are simulated one by one.

use asid::core::progress::Silent;
use asid::diagnosis::candidate::{Candidate, enumerate};
use asid::diagnosis::latent_force::columns::Columns;
use asid::diagnosis::latent_force::context::{Context, Taken, begin};
use asid::diagnosis::latent_force::estimate::Estimate;
use asid::diagnosis::latent_force::fit::Hypothesis;
use asid::diagnosis::latent_force::fitted_value::Unknown;
use asid::diagnosis::latent_force::initial::{from_readings, scales};
use asid::diagnosis::latent_force::walk::Walk;
use asid::diagnosis::machine::Machine;
use asid::diagnosis::prepare::{dataset, set_reading_noise};
use asid::diagnosis::study::Study;
use asid::diagnosis::trajectory::Trajectory;

use crate::arm;
use crate::diagnosis_support::engine;

/// Largest allowed difference of a column, relative to the largest column of its law at any site in
/// the same simulation.
///
/// Effects of the sizes of a screening are not quite linear. A force may also change over a row in
/// a way that two numbers do not describe. Friction that changes with the speed differs by 0.06
/// here, a limit of both motors at once by 0.03, others by less.
const SHARE: f64 = 0.1;
/// Rows of a log that are compared.
const ROWS: usize = 60;

/// All columns of some candidates along all walks, one per form, each with the candidate's index.
fn columns(
    context: &Context<'_>,
    model: (&Hypothesis, &[f64]),
    estimate: &Estimate,
    candidates: &[Candidate],
) -> Vec<(usize, Vec<f64>)> {
    let found = Columns::of(
        context,
        model,
        (estimate, estimate),
        (candidates, &|_| Vec::new()),
        &Silent,
    )
    .unwrap();
    let m = found.center.len();
    let forms = found.forms.iter();
    let each = forms.flat_map(|f| f.columns().map(|column| (f.candidate, column)));
    each.map(|(candidate, column)| {
        let walks = found.linear.iter();
        let along = walks.flat_map(|l| l.state_columns.iter().chain(&l.reading_columns));
        let place = |all: Vec<f64>| all.into_iter().skip(column).step_by(m).collect();
        (candidate, place(along.copied().collect()))
    })
    .collect()
}

/// Compares the columns of all candidates together with those of each alone; `segments` says which
/// walks are replayed.
fn compare(segments: [Option<usize>; 2]) {
    let folder = tempfile::tempdir().unwrap();
    arm::write_study(folder.path());
    let study = Study::read(folder.path()).unwrap();
    let machine = Machine::new(engine(), &study.scene, &study.fixed, &study.effects, 0).unwrap();
    let (mut bench, nominal) = dataset(&study, machine).unwrap();
    set_reading_noise(&mut bench, &study.noise);
    let (plant, logs) = (&bench.machine.plant, &bench.train.logs);
    let layout = &plant.layout;
    let walks: Vec<Walk> = (0..2)
        .map(|e| Walk {
            segment: segments[e],
            ..Walk::new(logs, e, layout.timestep).part(0..ROWS)
        })
        .collect();
    let still = walks
        .iter()
        .map(|w| vec![0.0; w.len() * (layout.nq + layout.nv)]);
    let otherwise: Vec<Vec<f64>> = still.collect();
    let first = from_readings(plant, logs, &walks, &otherwise);
    let taken = Taken {
        touching: Vec::new(),
        given: vec![None; walks.len()],
        open: bench.open.clone(),
        scale: scales(plant, &first),
        states: first,
        walks,
    };
    let parameters = (&study.parameters[..], &nominal[..]);
    let (context, estimate) = begin(&bench.machine, logs, taken, parameters).unwrap();
    let unknowns = study.parameters.iter().zip(&nominal);
    let hypothesis = Hypothesis {
        specs: Vec::new(),
        unknowns: unknowns.map(|(p, n)| Unknown::of_study(p, *n)).collect(),
    };
    let model = bench.machine.with(&[]).unwrap();
    let rows: Vec<(usize, &[usize])> = context
        .walks
        .iter()
        .map(|w| (w.episode, &w.rows[..]))
        .collect();
    let states = &estimate.trajectory;
    let shown = Trajectory::along(&*model, plant, parameters, logs, states, &rows).unwrap();
    let (mut candidates, _) = enumerate(&bench.machine, &shown, (&[], &[]));
    candidates.retain(|c| !c.is_tolerance);

    let base = (&hypothesis, &nominal[..]);
    let together = columns(&context, base, &estimate, &candidates);
    // The columns of each candidate alone.
    let alone: Vec<(usize, Vec<f64>)> = (0..candidates.len())
        .flat_map(|c| {
            let own = columns(&context, base, &estimate, &candidates[c..=c]);
            own.into_iter().map(move |(_, column)| (c, column))
        })
        .collect();
    assert_eq!(together.len(), alone.len());
    let length = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
    let largest = |name: &str| {
        let of_law = alone
            .iter()
            .filter(|(c, _)| candidates[*c].spec.name == name);
        of_law.map(|(_, column)| length(column)).fold(0.0, f64::max)
    };
    let mut compared = 0;
    for ((c, one), (d, other)) in together.iter().zip(&alone) {
        assert_eq!(c, d);
        let apart: Vec<f64> = one.iter().zip(other).map(|(a, b)| a - b).collect();
        // A candidate without any response has no relative difference.
        if length(other) == 0.0 {
            continue;
        }
        compared += 1;
        let share = length(&apart) / largest(&candidates[*c].spec.name);
        assert!(share < SHARE, "{}: {share}", candidates[*c].label());
    }
    assert!(compared > 30, "{compared}");
}

#[test]
fn columns_are_the_same_together_and_one_by_one() {
    compare([None, None]);
}

#[test]
fn logs_that_are_in_part_in_segments_have_columns_without_slopes_in_forces() {
    compare([Some(0), None]);
}
