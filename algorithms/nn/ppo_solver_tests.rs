//! The solver on a task with a known best action: a cart of mass `m` is pushed with a force `F` for
//! half a second, `x = x_0 + F t^2 / (2 m)`; the cost is the squared distance from a goal.

use std::sync::atomic::AtomicU64;

// Linked for the entries that it registers.
use asid_rapier as _;

use asid_core::parameter::{Parameter, Scale};
use asid_core::progress::Silent;
use asid_core::registry::{BackendEntry, SolverEntry, find};
use asid_core::signal::Signal;
use asid_core::task::{
    Commander, Coordinate, DownstreamProtocol, ExplorationProtocol, Outcome, TaskSpec,
};
use asid_core::{Layout, Posterior, Problem, Result, Scene, Streams, Task};

const GOAL: f64 = 0.3;
const FRAMES: usize = 25;
const XML: &str = r#"
<mujoco>
  <option timestep="0.002" gravity="0 0 0"/>
  <worldbody>
    <body name="cart">
      <joint name="rail" type="slide" axis="1 0 0"/>
      <geom name="cart" type="box" size="0.05 0.05 0.05" mass="1"/>
    </body>
  </worldbody>
  <actuator><motor name="push" joint="rail" ctrlrange="-10 10"/></actuator>
  <sensor><jointpos name="x" joint="rail"/></sensor>
</mujoco>"#;

struct Cart {
    spec: TaskSpec,
}

impl Cart {
    fn new() -> Self {
        let force = Coordinate::new("force", "N", [0.0, 4.0]);
        let start = vec![Coordinate::new("x", "m", [-0.1, 0.1])];
        let scene = Scene::from_xml("cart", XML, &[]).unwrap();
        let exploration = ExplorationProtocol {
            horizon: 1,
            frames_per_step: 1,
            frame_period: 0.02,
            action: vec![force.clone()],
            start: start.clone(),
            signals: vec![Signal {
                sensor: "x".into(),
                noise: 1e-3,
            }],
            proprioception: Vec::new(),
            contact: Vec::new(),
        };
        let downstream = DownstreamProtocol {
            metric: "squared_distance_m2".into(),
            unit: "m²".into(),
            rule: "none".into(),
            threshold: None,
            frames: FRAMES,
            frame_period: 0.02,
            action: vec![force],
            start,
            channels: vec!["x".into()],
            phases: Vec::new(),
        };
        let parameters = vec![Parameter {
            name: "mass".into(),
            targets: vec!["geom/cart/mass".parse().unwrap()],
            range: [0.5, 2.0],
            scale: Scale::Linear,
            unit: "kg".into(),
        }];
        Self {
            spec: TaskSpec {
                parameters,
                ..TaskSpec::new(["cart", ""], scene, exploration, downstream)
            },
        }
    }
}

impl Task for Cart {
    fn spec(&self) -> &TaskSpec {
        &self.spec
    }

    fn place(&self, layout: &Layout, start: &[f64], qpos: &mut [f64]) -> Result<()> {
        qpos[layout.joint("rail")?.qpos] = start[0];
        Ok(())
    }

    fn locate(&self, signals: &[f64]) -> Vec<f64> {
        signals.to_vec()
    }

    fn commander(&self) -> Result<Box<dyn Commander>> {
        unreachable!("it is not explored")
    }

    fn attempt(&self, _start: &[f64], action: &[f64]) -> Result<Vec<f64>> {
        Ok(vec![action[0]; FRAMES])
    }

    fn metric(&self, readings: &[f64]) -> Vec<f64> {
        readings.iter().map(|x| (x - GOAL).powi(2)).collect()
    }

    fn outcome(&self, readings: &[f64]) -> Outcome {
        let value = (readings[FRAMES - 1] - GOAL).powi(2);
        Outcome {
            value,
            success: true,
            cost: value,
        }
    }
}

/// Returns the force of a trained policy for each start, and the number of attempts.
fn answers(masses: &[f64], starts: &[f64]) -> (Vec<f64>, usize) {
    let task = Cart::new();
    let backend = (find::<BackendEntry>("rapier").unwrap().make)().unwrap();
    let model = backend.load(task.scene()).unwrap();
    let parameters = task.parameters();
    let counter = AtomicU64::new(0);
    let problem = Problem {
        task: &task,
        model: &*model,
        capabilities: backend.capabilities(),
        parameters: &parameters,
        signals: &task.spec.exploration.signals,
        threads: 1,
        streams: Streams::new(0),
        progress: &Silent,
        physics_counter: &counter,
        env_counter: &counter,
    };
    let samples: Vec<Vec<f64>> = masses.iter().map(|m| vec![*m]).collect();
    let belief = Posterior::from_samples(&parameters, samples, &vec![1.0; masses.len()]);
    let entry = find::<SolverEntry>("ppo").unwrap();
    let solver = (entry.make)(&(entry.defaults)()).unwrap();
    let mut solved = solver.solve(&problem, &belief).unwrap();
    let act = |start: &f64| {
        let mut action = [0.0];
        solved.policy.act(&[*start], &mut action).unwrap();
        action[0]
    };
    (starts.iter().map(act).collect(), solved.trials.len())
}

/// `F = 2 m (GOAL - x_0) / t^2` for the observed start, to 5 % of the range of forces.
#[test]
fn the_best_action_is_found_for_each_start() {
    let starts = [-0.08, 0.0, 0.08];
    let (forces, attempts) = answers(&[1.0], &starts);
    for (force, start) in forces.iter().zip(starts) {
        let best = 2.0 * (GOAL - start) / 0.25;
        assert!((force - best).abs() < 0.2, "{start}: {force}, best {best}");
    }
    // The attempts of the training, and one batch that measures the scale of the costs.
    assert_eq!(attempts, 2048 + 64);
}

/// The best force for two equally probable masses minimises the mean cost of both: `F = c (1/m_1 +
/// 1/m_2) / (1/m_1^2 + 1/m_2^2)` with `c = 2 (GOAL - x_0) / t^2`.
#[test]
fn a_belief_is_averaged_over() {
    let (forces, _) = answers(&[0.8, 1.25], &[0.0]);
    let [a, b] = [1.0 / 0.8, 1.0 / 1.25];
    let best = 2.0 * GOAL / 0.25 * (a + b) / (a * a + b * b);
    assert!((forces[0] - best).abs() < 0.2, "{} {best}", forces[0]);
}

#[test]
fn wrong_settings_are_named() {
    let make = find::<SolverEntry>("ppo").unwrap().make;
    let message = |text: &str| make(&text.parse().unwrap()).err().unwrap().to_string();
    assert!(message("environments = 1").contains("solver.environments"));
    assert!(message("[ppo]\nclip = 0.0").contains("ppo.clip"));
}
