//! A task with physics in closed form: a force pushes a cart of unknown mass `m` on a rail without
//! friction.
//!
//! The cart's displacement is inversely proportional to `m`. Downstream the cart must reach a goal
//! at distance `d` after the time `t`, under one constant force `F = 2 m d / t^2`. The relative
//! miss is therefore the relative error of the mass.

use asid::core::parameter::{Parameter, Scale};
use asid::core::signal::Signal;
use asid::core::task::{
    Commander, Coordinate, DownstreamProtocol, ExplorationProtocol, Outcome, TaskSpec,
};
use asid::core::{Capabilities, Layout, Result, Scene, Task};

/// Standard deviation of a position reading, m.
pub const NOISE: f64 = 1e-3;
/// Number of control steps, of one frame each.
pub const HORIZON: usize = 10;
/// Length of a frame, s.
pub const FRAME: f64 = 0.02;
/// Position that the cart must reach after [`FRAMES`], m.
pub const GOAL: f64 = 0.4;
/// Frames of the push downstream: 0.8 s, in which the heaviest cart reaches the goal from the
/// farthest start with 3.1 N.
pub const FRAMES: usize = 40;
/// Largest distance from the goal that counts as success, m.
pub const NEAR: f64 = 0.02;

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

/// The task.
pub struct Cart {
    spec: TaskSpec,
}

impl Cart {
    pub fn new() -> Self {
        let force = Coordinate::new("force", "N", [-4.0, 4.0]);
        let start = vec![Coordinate::new("x", "m", [-0.1, 0.1])];
        let scene = Scene::from_xml("cart", XML, &[]).unwrap();
        let exploration = ExplorationProtocol {
            horizon: HORIZON,
            frames_per_step: 1,
            frame_period: FRAME,
            action: vec![force.clone()],
            start: start.clone(),
            signals: vec![Signal {
                sensor: "x".into(),
                noise: NOISE,
            }],
            proprioception: Vec::new(),
            contact: Vec::new(),
        };
        let downstream = DownstreamProtocol {
            metric: "goal_distance_m".into(),
            unit: "m".into(),
            rule: "within 2 cm of the goal".into(),
            threshold: Some(NEAR),
            frames: FRAMES,
            frame_period: FRAME,
            action: vec![force],
            start,
            channels: vec!["x".into()],
            phases: Vec::new(),
        };
        let about = "weigh a cart by pushing it";
        Self {
            spec: TaskSpec {
                requires: Capabilities::ACTUATORS,
                parameters: vec![Self::mass(Scale::Log)],
                ..TaskSpec::new(["cart", about], scene, exploration, downstream)
            },
        }
    }

    /// The mass, with a uniform or log-uniform prior on 0.5 to 2 kg.
    pub fn mass(scale: Scale) -> Parameter {
        Parameter {
            name: "mass".into(),
            targets: vec!["geom/cart/mass".parse().unwrap()],
            range: [0.5, 2.0],
            scale,
            unit: "kg".into(),
        }
    }
}

struct Force;

impl Commander for Force {
    fn reset(&mut self) {}
    fn commands(&mut self, action: &[f64], ctrl: &mut [f64]) {
        ctrl.fill(action[0]);
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
        Ok(Box::new(Force))
    }

    /// The action is the force that moves the cart from the middle to the goal. From elsewhere the
    /// force is scaled with the distance.
    fn attempt(&self, start: &[f64], action: &[f64]) -> Result<Vec<f64>> {
        Ok(vec![action[0] * (GOAL - start[0]) / GOAL; FRAMES])
    }

    fn metric(&self, readings: &[f64]) -> Vec<f64> {
        readings.iter().map(|x| (x - GOAL).abs()).collect()
    }

    fn outcome(&self, readings: &[f64]) -> Outcome {
        let value = (readings[readings.len() - 1] - GOAL).abs();
        Outcome {
            value,
            success: value < NEAR,
            cost: value,
        }
    }
}
