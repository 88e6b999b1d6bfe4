//! scratch
#![allow(clippy::unwrap_used, clippy::print_stdout)]
use std::time::Instant;
use asid::core::progress::Silent;
use asid::core::registry::{BackendEntry, find};
use asid::core::{Streams, Model as _};
use asid::diagnosis::{bench::*, candidate, data::Logs, fit::*, machine::Machine, noise, predict::*, roughness, search, study::Study, trajectory::Trajectory};

fn main() {
    for path in std::env::args().skip(1) {
        let study = Study::read(std::path::Path::new(&path)).unwrap();
        let backend = (find::<BackendEntry>("mujoco").unwrap().make)().unwrap();
        let machine = Machine::new(backend, &study.scene, &study.fixed, &study.effects, 0).unwrap();
        let plant = machine.plant.clone();
        let sensors: Vec<String> = plant.layout.sensors.iter().map(|s| s.name.clone()).collect();
        let starts = |logs: &Logs| -> Vec<State> { logs.episodes.iter().map(|e| { let i = e.episode.initial.clone().unwrap(); State { qpos: i.qpos, qvel: i.qvel } }).collect() };
        let train = Logs::new(&plant, &sensors, study.train.clone()).unwrap();
        let test = Logs::new(&plant, &sensors, study.test.clone()).unwrap();
        let (s, st) = (starts(&train), starts(&test));
        let mut bench = Bench { machine, train: Record::new(train, s.clone()), test: Record::new(test, st), parameters: study.parameters.clone(), open: vec![] };
        let model = bench.machine.with(&[]).unwrap();
        let t = Instant::now();
        let mut point = Point { theta: study.parameters.iter().map(|p| model.nominal(&p.targets[0]).unwrap()).collect(), starts: s };
        let spread = roughness::Spread::of_known_starts(&plant.layout);
        let unknowns = bench.unknowns(&[]);
        let mut rng = Streams::new(0).stream("r");
        for k in 0..2 {
            let (sigma, wt) = {
                let mut p = bench.predictor(&[], &bench.train).unwrap();
                if k == 0 { point = scan(&mut p, &unknowns, point, 8).unwrap(); }
                let pr = p.readings(&[point.clone()]).unwrap().remove(0);
                let logs = &bench.train.logs;
                let r: Vec<Vec<f64>> = (0..logs.episodes.len()).map(|e| { let mut o = vec![0.0; logs.episodes[e].plan.rows()*logs.entries.len()]; logs.difference(e, &pr[e], &mut o); o }).collect();
                (noise::estimate(logs, &r), ())
            };
            let _ = wt;
            bench.train.logs.set_noise(&sigma);
            bench.test.logs.set_noise(&sigma);
            let w = { let mut p = bench.predictor(&[], &bench.train).unwrap(); roughness::estimate(&mut p, &plant.layout, &point, &spread, &mut rng).unwrap() };
            bench.train.whitening = w;
            let w = { let mut p = bench.predictor(&[], &bench.test).unwrap(); roughness::estimate(&mut p, &plant.layout, &Point { theta: point.theta.clone(), starts: bench.test.starts.clone() }, &spread, &mut rng).unwrap() };
            bench.test.whitening = w;
            let e = bench.explain(&[], &point.theta, &point.starts, if k == 0 { Effort::BRIEF } else { Effort::FULL }).unwrap();
            point = e.fit.point.clone();
        }
        let none = bench.explain(&[], &point.theta, &point.starts, Effort::BRIEF).unwrap();
        let shown = Trajectory::of(&*model, &plant, &bench.parameters, &bench.train.logs, &point, 0).unwrap();
        let (candidates, left) = candidate::enumerate(&bench.machine, &shown);
        println!("== {path} candidates {} left out {} none {:?}", candidates.len(), left.len(), t.elapsed());
        for l in &left { println!("   left out {} {}", l.label, l.why); }
        let f = search::search(&bench, &candidates, none, search::Breadth::default(), &Silent).unwrap();
        let (n, m) = (bench.train.readings as f64, bench.test.readings as f64);
        println!("   searched {:?}; none {:.3} {:.3} {:?}", t.elapsed(), (f.none.fit.cost / n).sqrt(), (f.none.held_out / m).sqrt(), f.none.fit.point.theta);
        for s in f.screened.iter().take(6) { println!("     screened {} {:.3} {:?}", candidates[s.candidate].label(), (s.cost / n).sqrt(), s.values); }
        for x in f.found.iter().filter(|x| x.candidates.len() == 1).take(6).chain(f.found.iter().filter(|x| x.candidates.len() == 2).take(4)).chain(f.found.iter().filter(|x| x.candidates.len() == 3).take(2)) {
            println!("     {:.3} {:.3} {} theta {:?}", (x.explanation.fit.cost / n).sqrt(), (x.explanation.held_out / m).sqrt(), x.explanation.effects.iter().map(|e| e.to_string()).collect::<Vec<_>>().join(" + "), &x.explanation.fit.point.theta[..bench.parameters.len()]);
        }
    }
}
