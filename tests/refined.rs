//! A scene with effects is a model like any other: parameters that change from step to step,
//! parameters of effects as columns, and memory in snapshots.

#![allow(clippy::unwrap_used)]

use asid::core::registry::{BackendEntry, all};
use asid::core::simulator::{StepHook, StepView};
use asid::core::{Backend, BatchConfig, Capabilities, Control, Rollout, Scene, Simulator};

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
