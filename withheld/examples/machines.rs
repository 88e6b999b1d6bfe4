//! Prints what each machine does without a cause: run time, gap of its time step, readings, forces.
//!
//! `cargo run --release -p asid-withheld --example machines [NAME…] [DIR]`; machines of other
//! authors come from a folder that `withheld/models/fetch.py` filled.

use std::io::Write as _;
use std::time::Instant;

use asid_withheld::anatomy::{Anatomy, JointKind};
use asid_withheld::engine::RAPIER;
use asid_withheld::gap::Bench;
use asid_withheld::motion::{Motion, Style};
use asid_withheld::random::stream;
use asid_withheld::world::World;
use asid_withheld::{Half, machines, outside};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (folders, names): (Vec<String>, Vec<String>) = std::env::args()
        .skip(1)
        .partition(|a| std::path::Path::new(a).is_dir());
    let mut out = std::io::stdout().lock();
    let mut machines = machines::ALL.to_vec();
    for folder in &folders {
        for half in [Half::Training, Half::Test] {
            let found = outside::read(folder.as_ref(), half)?;
            machines.extend(found.machines);
            for why in found.refused {
                writeln!(out, "{why}")?;
            }
        }
    }
    for machine in machines {
        if !names.is_empty() && !names.iter().any(|n| n == machine.name) {
            continue;
        }
        let anatomy = match Anatomy::of(machine) {
            Ok(anatomy) => anatomy,
            Err(error) => {
                writeln!(out, "{:14} {error}", machine.name)?;
                continue;
            }
        };
        let truth: Vec<f64> = machine
            .parameters
            .iter()
            .map(|p| (p.range[0] + p.range[1]) / 2.0)
            .collect();
        let style = Style {
            seconds: machine.seconds,
            rate: machine.rate,
            vigour: 1.0,
            rest: 0.0,
        };
        let random = &mut stream(1, &[machine.name]);
        let motions: Vec<Motion> = (0..9)
            .map(|_| Motion::draw(&anatomy, style, random))
            .collect();
        let step = anatomy.timestep;
        let clock = Instant::now();
        let bench = match Bench::new(&anatomy, &truth, &motions, step / 2.0, "implicitfast") {
            Ok(bench) => bench,
            Err(error) => {
                writeln!(out, "{:14} {error}", machine.name)?;
                continue;
            }
        };
        let seconds = clock.elapsed().as_secs_f64() / (1 + truth.len()) as f64;
        let show = |v: &[f64]| {
            let all: Vec<String> = v.iter().map(|x| format!("{x:.3}")).collect();
            all.join(" ")
        };
        let gap = |step: f64, integrator: &str| -> Result<f64, asid_withheld::Error> {
            let mut world = World::new(&anatomy, &truth, step, integrator)?;
            Ok(bench.distance(&bench.run(&mut world)?, &bench.clean))
        };
        let free = anatomy.joints.len() == 1 && anatomy.joints[0].kind == JointKind::Free;
        let by_rapier: Vec<f64> = [2.0, 4.0, 8.0]
            .into_iter()
            .filter(|_| free)
            .map(|finer| gap(step / finer, RAPIER))
            .collect::<Result<_, _>>()?;
        let option = anatomy.document.find("option", None);
        let integrator = option.and_then(|o| o.get("integrator")).unwrap_or("Euler");
        let t = &bench.typical;
        let parameters: Vec<f64> = machine
            .parameters
            .iter()
            .enumerate()
            .map(|(i, p)| {
                let mut values = truth.clone();
                values[i] += 0.02 * (p.range[1] - p.range[0]);
                let mut world = World::new(&anatomy, &values, step / 2.0, "implicitfast")?;
                Ok(bench.distance(&bench.run(&mut world)?, &bench.clean))
            })
            .collect::<Result<_, asid_withheld::Error>>()?;
        writeln!(
            out,
            "{:14} {seconds:.3} s a run; step alone {:.3}, Euler {:.3}, quarter {:.3}, rapier at a half, a quarter, an eighth {}; 2 % of a parameter {}\n    speed {}\n    drive {}\n    weight {}\n    spread {}",
            machine.name,
            gap(step, integrator)?,
            gap(step / 2.0, "Euler")?,
            gap(step / 4.0, "implicitfast")?,
            show(&by_rapier),
            show(&parameters),
            show(&t.speed),
            show(&t.drive),
            show(&t.weight),
            show(&t.spread),
        )?;
    }
    Ok(())
}
