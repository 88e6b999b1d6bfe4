//! scratch
#![allow(clippy::unwrap_used, clippy::print_stdout)]
use std::time::Instant;
use asid::core::progress::Silent;
use asid::core::registry::{BackendEntry, find};
use asid::core::Streams;
use asid::diagnosis::{candidate, machine::Machine, prepare, search, study::Study, trajectory::Trajectory};

fn main() {
    for path in std::env::args().skip(1) {
        let study = Study::read(std::path::Path::new(&path)).unwrap();
        let backend = (find::<BackendEntry>("mujoco").unwrap().make)().unwrap();
        let machine = Machine::new(backend.into(), &study.scene, &study.fixed, &study.effects, 0).unwrap();
        let plant = machine.plant.clone();
        let t = Instant::now();
        let mut rng = Streams::new(0).stream("scatter");
        let p = prepare::prepare(&study, machine, &mut rng).unwrap();
        let (bench, none) = (p.bench, p.none);
        let last = bench.stages.len() - 1;
        let model = bench.machine.with(&[]).unwrap();
        let shown = Trajectory::of(&*model, &plant, &bench.parameters, &bench.train.logs, &none[last].fit.point, 0).unwrap();
        let (candidates, left) = candidate::enumerate(&bench.machine, &shown);
        println!("== {path} candidates {} left out {} prepared {:?} stages {:?} rms {:?}", candidates.len(), left.len(), t.elapsed(), (0..=last).map(|i| bench.readings(i)).collect::<Vec<_>>(), none.iter().enumerate().map(|(i, e)| (e.fit.cost / bench.readings(i)).sqrt()).collect::<Vec<_>>());
        for l in left.iter().take(3) { println!("   left out {} {}", l.label, l.why); }
        println!("   rough {} rank {:?} test {:?}", bench.is_rough(), bench.train.whitening.iter().map(|w| w.rank()).collect::<Vec<_>>(), bench.test.whitening.iter().map(|w| (w.rank(), w.lost())).collect::<Vec<_>>());
        let s = search::Search { bench: &bench, candidates: &candidates, breadth: search::Breadth::default(), progress: &Silent };
        let t0 = t.elapsed();
        let f = s.run(&none).unwrap();
        let (n, m) = (bench.train.readings as f64, bench.held_readings());
        println!("   {:?} searched {:?}; none {:.3} {:.3} {:?}", t0, t.elapsed(), (f.none.fit.cost / n).sqrt(), (f.none.held_out / m).sqrt(), f.none.fit.point.theta);
        let n0 = bench.readings(0);
        for s in f.screened.iter().take(8) { println!("     screened {} {:.3} {:?}", candidates[s.candidate].label(), (s.cost / n0).sqrt(), s.values); }
        for x in f.found.iter().filter(|x| x.candidates.len() == 1).take(6).chain(f.found.iter().filter(|x| x.candidates.len() == 2).take(3)) {
            println!("     {:.3} {:.3} {} theta {:?}", (x.explanation.fit.cost / n).sqrt(), (x.explanation.held_out / m).sqrt(), x.explanation.effects.iter().map(|e| e.to_string()).collect::<Vec<_>>().join(" + "), &x.explanation.fit.point.theta[..bench.parameters.len()]);
        }
    }
}
