//! A scene with effects is a model like any other: parameters that change from step to step,
//! parameters of effects as columns, and memory in snapshots.

#![allow(clippy::unwrap_used)]

use asid::core::registry::{BackendEntry, all};
use asid::core::simulator::{ParameterChange, StepHook, StepView};
use asid::core::{Backend, BatchConfig, Capabilities, Control, Model, Rollout, Scene, Simulator};
use asid::effects::refined::Refined;
use asid::mjcf::Plant;

/// A block that slides on a floor along x.
const BLOCK: &str = r#"<mujoco><compiler angle="radian"/><option timestep="0.001" cone="elliptic" impratio="10"/>
  <worldbody><geom name="floor" type="plane" size="9 9 1" friction="0.1 0 0"/>
    <body name="block" pos="0 0 0.05"><freejoint name="free"/><geom name="block" type="box" size="0.1 0.1 0.05" mass="1" friction="0.2 0 0"/></body>
  </worldbody><sensor><framepos name="at" objtype="xbody" objname="block"/></sensor></mujoco>"#;

/// Sets the block's friction to the second value once the block is beyond the first, a position in
/// m.
struct Beyond(f64, f64);

impl StepHook for Beyond {
    fn before_step(&self, _row: usize, _step: usize, view: &mut StepView<'_>) {
        if view.qpos[0] > self.0 {
            view.parameters[0] = self.1;
        }
    }
}

fn engines(needed: Capabilities) -> Vec<Box<dyn Backend>> {
    let made = all::<BackendEntry>()
        .into_iter()
        .map(|e| (e.make)().unwrap());
    made.filter(|b| b.capabilities().contains(needed)).collect()
}

/// Position at which the block comes to rest after a start at 1 m/s.
fn rest(simulator: &mut dyn Simulator, hook: Option<&dyn StepHook>) -> f64 {
    let layout = simulator.layout().clone();
    let recording = layout.recording(&["at"]).unwrap();
    simulator.reset(&[0]).unwrap();
    let qpos = [0.0, 0.0, 0.05, 1.0, 0.0, 0.0, 0.0];
    let still = [0.0; 6];
    simulator.set_state(&[0], &qpos, &still).unwrap();
    let settle = Rollout::new(&[0], 1, 200, Control::Shared(&[]), &recording);
    let mut out = [0.0; 3];
    simulator.rollout(&settle, &mut out).unwrap();
    let qpos = [0.0, 0.0, out[2], 1.0, 0.0, 0.0, 0.0];
    simulator
        .set_state(&[0], &qpos, &[1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
        .unwrap();
    let mut rollout = Rollout::new(&[0], 1, 2000, Control::Shared(&[]), &recording);
    rollout.hook = hook;
    simulator.rollout(&rollout, &mut out).unwrap();
    out[0]
}

#[test]
fn a_hook_changes_friction_from_step_to_step_and_for_a_rollout_only() {
    for backend in engines(Capabilities::LIVE_PARAMETERS | Capabilities::CONTACT) {
        let scene = Scene::from_xml("block", BLOCK, &[]).unwrap();
        let model = backend.load(&scene).unwrap();
        let config = BatchConfig {
            size: 1,
            threads: 1,
            targets: vec!["geom/block/friction/0".parse().unwrap()],
        };
        let mut simulator = model.simulator(&config).unwrap();
        let (mu, after, place, g) = (0.2, 0.5, 0.1, 9.81);
        let plain = rest(&mut *simulator, None);
        let expected = 1.0 / (2.0 * mu * g);
        assert!(
            (plain / expected - 1.0).abs() < 0.03,
            "{}: {plain}, {expected}",
            backend.name()
        );
        // At `place` v² = 1 - 2 mu g place is left; the other friction uses it up.
        let hooked = rest(&mut *simulator, Some(&Beyond(place, after)));
        let expected = place + (1.0 - 2.0 * mu * g * place) / (2.0 * after * g);
        assert!(
            (hooked / expected - 1.0).abs() < 0.03,
            "{}: {hooked}, {expected}",
            backend.name()
        );
        assert_eq!(rest(&mut *simulator, None), plain, "{}", backend.name());
    }
}

/// A stone in free flight.
const STONE: &str = r#"<mujoco><option timestep="0.001"/><worldbody><body name="stone"><freejoint name="free"/>
  <geom size="0.1" mass="2" contype="0" conaffinity="0"/></body></worldbody></mujoco>"#;

/// Symptom: a parameter that changes within a rollout was another one, or refused. Cause: its
/// column was handed to the engine, whose columns do not count those of effects.
#[test]
fn a_change_within_a_rollout_is_of_the_callers_column() {
    let needed = Capabilities::STEP_HOOKS
        | Capabilities::PARAMETER_CHANGES
        | Capabilities::MASS_PARAMETERS
        | Capabilities::FREE_BODIES;
    for backend in engines(needed) {
        let scene = Scene::from_xml("stone", STONE, &[]).unwrap();
        let force = "constant-force@stone:x=1".parse().unwrap();
        let model = Refined::load(&*backend, &scene, &[force]).unwrap();
        let targets = ["effect/constant-force@stone/x", "option/gravity/2"];
        let config = BatchConfig {
            size: 1,
            threads: 1,
            targets: targets.iter().map(|t| t.parse().unwrap()).collect(),
        };
        let mut simulator = model.simulator(&config).unwrap();
        let recording = model.layout().recording(&["qvel.free"]).unwrap();
        // From 40 ms of 100 on, the value is -1.
        let mut run = |column: usize| {
            let changes = [ParameterChange {
                frame: 4,
                column,
                values: &[-1.0],
            }];
            let mut rollout = Rollout::new(&[0], 10, 10, Control::Shared(&[]), &recording);
            rollout.changes = &changes;
            simulator.reset(&[0]).unwrap();
            let mut out = [0.0; 10 * 6];
            let done = simulator.rollout(&rollout, &mut out);
            done.map(|()| [out[54], out[56]])
        };
        let [x, z] = run(1).unwrap();
        assert!((x - 0.1 / 2.0).abs() < 1e-4, "{}: {x}", backend.name());
        let fall = 0.04 * 9.81 + 0.06;
        assert!((z + fall).abs() < 1e-4, "{}: {z}", backend.name());
        let error = run(0).unwrap_err().to_string();
        assert!(error.contains("an effect has or uses it"), "{error}");
    }
}

/// Symptom: an effect on a drive of a document that attaches another one acted on the wrong drive.
/// Cause: the parser has the attached actuators and sensors before the document's own, and MuJoCo
/// behind them.
#[test]
fn what_a_document_attaches_comes_behind_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let tool = r#"<mujoco><worldbody><body name="tool"><joint name="turn"/><geom size="0.1" mass="1"/></body></worldbody>
      <actuator><motor name="drive" joint="turn"/></actuator><sensor><jointpos name="angle" joint="turn"/></sensor></mujoco>"#;
    std::fs::write(folder.path().join("tool.xml"), tool).unwrap();
    let xml = r#"<mujoco><asset><model name="tool" file="tool.xml"/></asset><worldbody><body name="arm"><joint name="lift"/>
      <geom size="0.1" mass="1"/><attach model="tool" body="tool" prefix="a_"/></body></worldbody>
      <actuator><position name="servo" joint="lift" kp="5" timeconst="0.1"/></actuator>
      <sensor><jointpos name="height" joint="lift"/></sensor></mujoco>"#;
    let scene = Scene::from_xml("arm", xml, &[]).unwrap();
    let scene = scene.in_directory(Some(folder.path().to_owned()));
    let plant = Plant::of(&scene).unwrap();
    let actuators: Vec<&str> = plant.layout.actuators.iter().map(|a| &*a.name).collect();
    assert_eq!(actuators, ["servo", "a_drive"]);
    let sensors: Vec<&str> = plant.layout.sensors.iter().map(|s| &*s.name).collect();
    assert_eq!(sensors, ["height", "a_angle"]);
    let memoryless = plant.drives.iter().map(|d| d.unwrap().is_memoryless());
    assert_eq!(memoryless.collect::<Vec<_>>(), [false, true]);
}
