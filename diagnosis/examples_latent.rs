//! Development: what the latent force says of a study.
use asid_diagnosis::candidate::enumerate;
use asid_diagnosis::data::Logs;
use asid_diagnosis::latent_force::estimate::begin;
use asid_diagnosis::latent_force::fit::{Hypothesis, fit, settle_noise};
use asid_diagnosis::latent_force::search::{Breadth, search};
use asid_diagnosis::latent_force::unknown::Unknown;
use asid_diagnosis::latent_force::walk::Walk;
use asid_diagnosis::machine::Machine;
use asid_diagnosis::study::Study;
use asid_diagnosis::trajectory::Trajectory;
use asid::core::registry::{BackendEntry, find};

use std::time::Instant;


fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).unwrap();
    let most: usize = std::env::args().nth(2).map_or(100000, |x| x.parse().unwrap());
    let t0 = Instant::now();
    macro_rules! say { ($($a:tt)*) => { println!("[{:6.1}] {}", t0.elapsed().as_secs_f64(), format!($($a)*)) } }
    let study = Study::read(path.as_ref())?;
    let backend = (find::<BackendEntry>("mujoco")?.make)()?;
    let machine = Machine::new(backend.into(), &study.scene, &study.fixed, &study.effects, 0)?;
    let plant = machine.plant.clone();
    let layout = plant.layout.clone();
    let sensors: Vec<String> = layout.sensors.iter().filter(|s| study.train.iter().any(|(_, e)| e.channel(&s.name).is_some())).map(|s| s.name.clone()).collect();
    let mut logs = Logs::new(&plant, &sensors, study.train.clone())?;
    let readings: Vec<Vec<f64>> = (0..logs.episodes.len()).map(|e| {
        let w = logs.width(); let n = logs.entries.len(); let rows = logs.episodes[e].plan.rows();
        let first: Vec<f64> = logs.episodes[e].readings[..w].to_vec();
        let mut out = vec![0.0; rows * n];
        for k in 0..rows { let row = logs.episodes[e].readings[k*w..(k+1)*w].to_vec(); logs.reading_difference(&row, &first, &mut out[k*n..(k+1)*n]); }
        out
    }).collect();
    let noise: Vec<f64> = asid_diagnosis::noise::estimate(&logs, &readings).iter().zip(&logs.sensors).map(|(x, s)| study.noise.get(&s.name).copied().unwrap_or(*x)).collect();
    logs.set_noise(&noise);
    let mut walks: Vec<Walk> = (0..logs.episodes.len()).map(|e| Walk::new(&logs, e, layout.timestep)).collect();
    for w in &mut walks { if w.len() > most { *w = w.part(0..most); } }
    let given = study.train.iter().map(|(_, e)| e.initial.as_ref().map(|_| asid_diagnosis::starts::given_start(&plant, e))).collect();
    let open = asid_diagnosis::starts::open_coordinates(&layout, &study);
    let home = asid_core::problem::home(&layout);
    let otherwise: Vec<Vec<f64>> = walks.iter().map(|w| { let s = [&home.0[..], &home.1[..]].concat(); s.repeat(w.len()) }).collect();
    let model = machine.with(&[])?;
    let nominal: Vec<f64> = study.parameters.iter().map(|p| model.nominal(&p.targets[0]).map(|x| x.clamp(p.range[0], p.range[1]))).collect::<Result<_, _>>()?;
    let hypothesis = Hypothesis { specs: vec![], unknowns: study.parameters.iter().zip(&nominal).map(|(p, n)| Unknown::of_study(p, *n)).collect() };
    let rows: usize = walks.iter().map(|w| w.len()).sum();
    let (context, mut estimate) = begin(&machine, &logs, walks, (given, open), (&study.parameters, &nominal), &otherwise)?;
    say!("rows {rows} noise {noise:?} inertial {:?}", context.inertial);
    settle_noise(&context, &hypothesis, &nominal, &mut estimate, (4, 8))?;
    let std = |q: &[f64]| q.iter().map(|x| format!("{:.3e}", x.sqrt())).collect::<Vec<_>>().join(" ");
    say!("smoothed ll {:.0} missing {} tau {:?} r {}", estimate.log_likelihood, std(&estimate.noise.q), estimate.noise.tau, std(&estimate.noise.r));
    let none = fit(&context, &hypothesis, &nominal, &estimate, 15)?;
    say!("null {:?} evidence {:.1} missing {} tau {:?} r {}", none.theta, none.evidence, std(&none.estimate.noise.q), none.estimate.noise.tau, std(&none.estimate.noise.r));
    let mut none = none;
    none.estimate.free_at_rest(&context); none.estimate.set_resolution(layout.nv);
    let none = fit(&context, &hypothesis, &none.theta, &none.estimate, 15)?;
    say!("null, free at rest: evidence {:.1} missing {} white {} r {}", none.evidence, std(&none.estimate.noise.q), std(&none.estimate.noise.white), std(&none.estimate.noise.r));
    let rows: Vec<&[usize]> = context.walks.iter().map(|w| &w.rows[..]).collect();
    let shown = Trajectory::along(&*model, &plant, (&study.parameters, &none.theta), &logs, &none.estimate.trajectory, &rows)?;
    let (candidates, left) = enumerate(&machine, &shown, &[]);
    say!("{} candidates, {} left out", candidates.len(), left.len());
    if std::env::var("PROBE").is_ok() {
        use asid_diagnosis::latent_force::fit::{Hypothesis as H};
        let c = candidates.iter().find(|c| c.label() == "sensor-delay@phi").unwrap();
        let mut h: H = none.hypothesis.clone();
        h.specs.push(c.spec.clone());
        for (p, free) in c.unknowns() { h.unknowns.push(Unknown { parameter: p, center: 0.0, deviation: 0.03, bounds: [0.0, 0.5], free }); }
        for tau in [0.0, 0.02, 0.04, 0.0565, 0.07] {
            let mut theta = none.theta.clone(); theta.push(tau);
            let mut est = none.estimate.clone();
            for _ in 0..12 { settle_noise(&context, &h, &theta, &mut est, (1, 2))?; print!("{:.0} ", est.log_likelihood); }
            println!(" tau {tau} q {:?} r {:?}", est.noise.q, est.noise.r);
        }
        return Ok(());
    }
    struct P(Instant);
    impl asid_core::Progress for P { fn begin(&self, what: &str, n: u64) { eprintln!("[{:.1}] {what} {n}", self.0.elapsed().as_secs_f64()); } fn advance(&self, _: u64) {} fn end(&self) {} }
    let p = P(t0);
    let outcome = search(&context, &none, &candidates, Breadth::default(), &p)?;
    let label = |c: &[usize]| if c.len() > 3 { format!("{} x{}", candidates[c[0]].label(), c.len()) } else { c.iter().map(|&i| candidates[i].label()).collect::<Vec<_>>().join("+") };
    for r in &outcome.rounds {
        say!("upon [{}]: screened {}", label(&r.base), r.screened.iter().take(10).map(|(c, g)| format!("{} {:.0}", label(c), g)).collect::<Vec<_>>().join("; "));
        for s in &r.confirmed {
            let left: Vec<String> = (0..layout.nv).map(|j| { let t = |e: &asid_diagnosis::latent_force::estimate::Estimate| e.noise.q[j] + e.noise.white[j]; format!("{:.2}", (t(&s.fitted.estimate) / t(&outcome.none.estimate)).sqrt()) }).collect();
            let v: Vec<String> = s.fitted.theta.iter().map(|x| format!("{x:.4}")).collect();
            say!("   {} {:.1} left [{}] white [{}] values {}", label(&s.candidates), s.fitted.evidence - outcome.none.evidence, left.join(" "), std(&s.fitted.estimate.noise.white), v.join(" "));
        }
    }
    say!("DONE {}", label(&outcome.best.candidates));
    Ok(())
}
