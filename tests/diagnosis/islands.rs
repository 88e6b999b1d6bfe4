//! Derivatives of uncoupled parts: perturbing the parts together gives the same as one by one.

use asid::core::episode::ChannelColumns;
use asid::core::{Episode, Scene};
use asid::diagnosis::data::Logs;
use asid::diagnosis::latent_force::context::{Taken, begin};
use asid::diagnosis::latent_force::initial::from_readings;
use asid::diagnosis::latent_force::step_map::{Derivatives, LinearEpisode, StepMap};
use asid::diagnosis::latent_force::walk::Walk;
use asid::diagnosis::machine::Machine;

use crate::diagnosis_support::engine;
use crate::row_slopes::largest_difference;

/// Two arms of two hinges each, one with a servo, and a free-falling body.
const SCENE: &str = r#"<mujoco><option timestep="0.002"/><worldbody>
    <body><joint name="a" type="hinge" axis="0 1 0" damping="0.1"/><geom size="0.05" pos="0 0 -0.2" mass="1"/>
      <body pos="0 0 -0.4"><joint name="b" type="hinge" axis="0 1 0" damping="0.1"/><geom size="0.05" pos="0 0 -0.2" mass="0.5"/></body></body>
    <body pos="2 0 0"><joint name="c" type="hinge" axis="0 1 0" damping="0.2"/><geom size="0.05" pos="0 0 -0.2" mass="1"/>
      <body pos="0 0 -0.4"><joint name="d" type="hinge" axis="1 0 0" damping="0.2"/><geom size="0.05" pos="0 0 -0.2" mass="0.5"/></body></body>
    <body pos="4 0 5"><freejoint name="free"/><geom size="0.1" mass="1"/></body></worldbody>
    <actuator><position name="servo" joint="a" kp="8" kv="0.5"/></actuator>
    <sensor><jointpos name="qa" joint="a"/><jointpos name="qb" joint="b"/><jointpos name="qc" joint="c"/>
      <jointpos name="qd" joint="d"/></sensor></mujoco>"#;
const NAMES: [&str; 4] = ["qa", "qb", "qc", "qd"];
/// Rows of a log, and physics steps per row.
const ROWS: usize = 8;
const STEPS: usize = 5;

fn logs(machine: &Machine) -> Logs {
    let time: Vec<f64> = (0..ROWS).map(|k| (k * STEPS) as f64 * 0.002).collect();
    let readings = time
        .iter()
        .flat_map(|t| [0.3, -0.4, 0.5, 0.2].map(|x| x * (3.0 * t).cos()));
    let episode = Episode {
        readings: readings.collect(),
        actuators: vec!["servo".into()],
        ctrl: vec![0.2; ROWS],
        channels: NAMES
            .map(|name| ChannelColumns {
                name: name.into(),
                len: 1,
            })
            .into(),
        time,
        ..Episode::default()
    };
    let names = NAMES.map(String::from);
    Logs::new(&machine.plant, &names, vec![("log".into(), episode)]).unwrap()
}

#[test]
fn one_push_of_each_island_tells_what_one_push_at_a_time_does() {
    let scene = Scene::from_xml("scene", SCENE, &[]).unwrap();
    let machine = Machine::new(engine(), &scene, &[], &[], 1).unwrap();
    let logs = logs(&machine);
    let layout = &machine.plant.layout;
    let (nv, width) = (layout.nv, layout.nq + layout.nv);
    let home = asid::core::problem::home(layout);
    let mut row = [&home.0[..], &home.1[..]].concat();
    for (i, x) in row.iter_mut().take(4).enumerate() {
        *x = 0.3 - 0.15 * i as f64;
    }
    let states = row.repeat(ROWS);
    assert_eq!(states.len(), ROWS * width);
    let walk = || vec![Walk::new(&logs, 0, layout.timestep)];
    let taken = Taken {
        walks: walk(),
        given: vec![None],
        open: Vec::new(),
        states: from_readings(
            &machine.plant,
            &logs,
            &walk(),
            std::slice::from_ref(&states),
        ),
        scale: vec![1.0; 2 * nv],
        touching: Vec::new(),
    };
    let (context, _) = begin(&machine, &logs, taken, (&[], &[])).unwrap();
    // Six coordinates of the free body, or two of each arm.
    assert_eq!(context.islands.slots(), 6);
    let walks = walk();
    let want = Derivatives {
        state: true,
        force: true,
        jolt: true,
    };
    for one_step in [false, true] {
        let linearised = |apart: bool| -> (LinearEpisode, u64) {
            let mut map = StepMap::new(&machine, &[], &[], (&logs, &walks), 64).unwrap();
            map.by_one_step(one_step);
            if apart {
                map.apart(&context.islands);
            }
            let push = vec![1e-3; nv];
            let found = map.linearise(&[], std::slice::from_ref(&states), want, &push, &[]);
            (found.unwrap().remove(0), map.steps())
        };
        let ((whole, many), (apart, few)) = (linearised(false), linearised(true));
        // 4 x 10 columns and the unperturbed model, compared with 4 x 6.
        assert!(few < many * 7 / 10, "{few} of {many}");
        // Rounding, over perturbations of 1e-6 of the state and of 1e-3 N m.
        assert!(largest_difference(&whole.a, &apart.a) < 1e-8);
        assert!(largest_difference(&whole.b, &apart.b) < 1e-11);
        assert!(largest_difference(&whole.jolt, &apart.jolt) < 1e-11);
        assert_eq!(whole.h, apart.h);
        assert_eq!(whole.defect, apart.defect);
    }
}
