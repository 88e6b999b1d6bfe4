//! scratch
#![allow(clippy::unwrap_used, clippy::print_stdout)]
use asid::core::registry::{BackendEntry, find};
use asid::core::Target;
use asid::diagnosis::{data::Logs, fit::*, machine::Machine, noise, predict::*, study::Study};
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let study = Study::read(std::path::Path::new(&a[1])).unwrap();
    let backend = (find::<BackendEntry>("mujoco").unwrap().make)().unwrap();
    let machine = Machine::new(backend, &study.scene, &study.fixed, &study.effects, 0).unwrap();
    let plant = machine.plant.clone();
    let sensors: Vec<String> = plant.layout.sensors.iter().map(|s| s.name.clone()).collect();
    let mut train = Logs::new(&plant, &sensors, study.train.clone()).unwrap();
    train.set_noise(&[0.0005, 0.004, 0.0003, 0.0003]);
    let starts: Vec<State> = train.episodes.iter().map(|e| { let i = e.episode.initial.clone().unwrap(); State { qpos: i.qpos, qvel: i.qvel } }).collect();
    let model = machine.with(&[]).unwrap();
    let targets: Vec<Target> = study.parameters.iter().flat_map(|p| p.targets.clone()).collect();
    let (lo, hi, n): (f64, f64, usize) = (a[2].parse().unwrap(), a[3].parse().unwrap(), a[4].parse().unwrap());
    let mut p = Predictor::new(&*model, &targets, &train, 12, 0).unwrap();
    if a.len() > 5 {
        let mut rng = asid::core::Streams::new(0).stream("r");
        let point = Point { theta: vec![a[5].parse().unwrap()], starts: starts.clone() };
        let wh = asid::diagnosis::roughness::estimate(&mut p, &plant.layout, &point, &asid::diagnosis::roughness::Spread::of_known_starts(&plant.layout), &mut rng).unwrap();
        p.set_whitening(wh);
    }
    let pts: Vec<Point> = (0..n).map(|i| Point { theta: vec![lo + (hi - lo) * i as f64 / (n - 1) as f64], starts: starts.clone() }).collect();
    let r = p.residuals(&pts).unwrap();
    let m = p.present().iter().filter(|x| **x).count() as f64;
    for (pt, r) in pts.iter().zip(&r) {
        let per: Vec<String> = (0..train.episodes.len()).map(|e| format!("{:.2}", (cost(&r[train.offset(e)..train.offset(e+1)]) * train.episodes.len() as f64 / m).sqrt())).collect();
        println!("{:.6} {:.3} {}", pt.theta[0], (cost(r) / m).sqrt(), per.join(" "));
    }
    let _ = noise::estimate;
}
