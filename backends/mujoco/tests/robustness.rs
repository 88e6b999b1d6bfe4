//! Failures stay local and are reported.

#![allow(clippy::unwrap_used)]

mod common;

use asid_core::simulator::{ExternalForce, StepHook, StepView};
use asid_core::{BatchConfig, Control, Error, Rollout, Status};
use common::*;

#[test]
fn a_diverged_simulation_stands_still_and_disturbs_nobody() {
    let model = load(ARM);
    let record = recording(&model, &CHANNELS);
    let width = record.width();
    let mut simulator = batch(&model, 3, 2, &[]);
    let ball = model.layout().body("ball").unwrap();
    let mut wrench = vec![0.0; 3 * 10 * 6];
    // From frame 4 on, the second gets a force that overflows a double.
    for frame in 4..10 {
        wrench[(10 + frame) * 6] = 1e200;
    }
    let forces = [ExternalForce {
        body: ball,
        wrench: &wrench,
    }];
    let control = waves(10);
    let mut out = vec![0.0; 3 * 10 * width];
    let rollout = Rollout {
        forces: &forces,
        ..Rollout::new(&[0, 1, 2], 10, 5, Control::Shared(&control), &record)
    };
    simulator.rollout(&rollout, &mut out).unwrap();
    let Status::Diverged { time, message } = &simulator.status()[1] else {
        panic!("it runs on");
    };
    // 4 frames of 5 steps of 2 ms, plus the failed step.
    assert!((time - 0.042).abs() < 1e-9, "{time}");
    assert!(message.contains("0.042"), "{message}");
    let rows: Vec<&[f64]> = out.chunks_exact(width).collect();
    assert!(rows[10..14].iter().all(|r| r.iter().all(|x| x.is_finite())));
    assert!(rows[14..20].iter().all(|r| r.iter().all(|x| x.is_nan())));

    // The others behave as if alone.
    let alone = roll(&mut batch(&model, 1, 1, &[]), 10, 5, &control, &record);
    assert_eq!(bits(&alone), bits(&out[..10 * width]));
    assert_eq!(bits(&alone), bits(&out[20 * width..]));

    // It does not take part until it is reset, even after set_state.
    let taken = simulator.steps_taken();
    let out = roll(&mut simulator, 2, 5, &waves(2), &record);
    assert!(out[2 * width..4 * width].iter().all(|x| x.is_nan()));
    assert_eq!(simulator.steps_taken(), taken + 20);
    let mut row = vec![0.0; width];
    simulator.read(&[1], &record, &mut row).unwrap();
    assert!(row.iter().all(|x| x.is_nan()));
    simulator.reset(&[1]).unwrap();
    assert!(simulator.status()[1].is_running());
    let again = roll(&mut simulator, 10, 5, &control, &record);
    assert_eq!(bits(&alone), bits(&again[10 * width..20 * width]));
    assert!(!std::path::Path::new("MUJOCO_LOG.TXT").exists());
}

#[test]
fn an_absurd_velocity_diverges_instead_of_restarting() {
    let model = load(FALLING);
    let record = recording(&model, &["place"]);
    let mut simulator = batch(&model, 2, 1, &[]);
    let pose = [0.0, 0.0, 2.0, 1.0, 0.0, 0.0, 0.0];
    let mut speed = [0.0; 6];
    speed[0] = 1e11;
    simulator.set_state(&[1], &pose, &speed).unwrap();
    let out = roll(&mut simulator, 3, 1, &[], &record);
    assert!(out[9..].iter().all(|x| x.is_nan()));
    assert!(simulator.status()[0].is_running());
    assert!(!simulator.status()[1].is_running());
    // A snapshot carries the status, and a good state restores it.
    let saved = simulator.save(&[0, 1]).unwrap();
    simulator.copy_state(&[0], &[1]).unwrap();
    assert!(simulator.status()[1].is_running());
    simulator.load(&saved, &[1], &[0]).unwrap();
    assert!(!simulator.status()[0].is_running());
}

#[test]
fn an_error_inside_the_engine_stops_its_simulation_alone() {
    // The solver's stack is large enough in the air, but not in contact.
    let starved = |bytes: usize| {
        let xml = ARM.replace(
            "<worldbody>",
            &format!("<size memory=\"{bytes}\"/><worldbody>"),
        );
        load(&xml)
    };
    let flying = [0.2, -0.3, 1.0, 0.0, 3.0, 1.0, 0.0, 0.0, 0.0];
    let resting = [0.2, -0.3, 1.0, 0.0, 0.099, 1.0, 0.0, 0.0, 0.0];
    let mut seen = false;
    for bytes in (12_000..60_000).step_by(1000) {
        let model = starved(bytes);
        let record = recording(&model, &["angle", "ball_pos"]);
        let mut simulator = batch(&model, 2, 2, &[]);
        let state = [flying, resting].concat();
        simulator.set_state(&[0, 1], &state, &[0.0; 16]).unwrap();
        let out = roll(&mut simulator, 3, 2, &waves(3), &record);
        if simulator.status()[0].is_running()
            && let Status::Diverged { time, message } = &simulator.status()[1]
        {
            assert!(
                message.contains("out of memory") && !message.contains('\n'),
                "{message}"
            );
            assert!((0.0..0.013).contains(time), "{time}");
            assert!(out[..12].iter().all(|x| x.is_finite()));
            assert!(out[23].is_nan());
            seen = true;
        }
    }
    assert!(seen, "no size starved one and not the other");
}

/// A spring to the origin along x, and the command of the elbow halved.
struct Spring;

impl StepHook for Spring {
    fn before_step(&self, row: usize, step: usize, view: &mut StepView<'_>) {
        assert!((view.time - 0.01 * step as f64).abs() < 1e-9, "row {row}");
        assert!(view.force.iter().all(|&f| f == 0.0));
        view.force[0] = -50.0 * view.qpos[0];
    }
}

#[test]
fn a_hook_sees_the_state_and_adds_a_force() {
    // An undamped oscillator under semi-implicit Euler follows
    // v += h (-k/m) x, x += h v, which is iterated here.
    let model = load(FALLING);
    let record = recording(&model, &["qpos.ball"]);
    let mut simulator = batch(&model, 1, 1, &[]);
    simulator
        .set_state(&[0], &[0.3, 0.0, 2.0, 1.0, 0.0, 0.0, 0.0], &[0.0; 6])
        .unwrap();
    let mut out = vec![0.0; 40 * 7];
    let rollout = Rollout {
        hook: Some(&Spring),
        ..Rollout::new(&[0], 40, 3, Control::Shared(&[]), &record)
    };
    simulator.rollout(&rollout, &mut out).unwrap();
    let (mut x, mut v, h) = (0.3, 0.0, 0.01);
    for row in out.chunks_exact(7) {
        for _ in 0..3 {
            v += h * (-50.0 / 0.5) * x;
            x += h * v;
        }
        assert!((row[0] - x).abs() < 1e-10, "{} {x}", row[0]);
    }
}

/// Sets the command instead of the rollout.
struct Command(f64);

impl StepHook for Command {
    fn before_step(&self, _: usize, _: usize, view: &mut StepView<'_>) {
        assert_eq!(view.ctrl, [0.1, 0.2]);
        view.ctrl[1] = self.0;
    }
}

#[test]
fn a_hook_changes_the_command() {
    let model = load(ARM);
    let record = recording(&model, &["qpos.elbow", "torque"]);
    let run = |control: [f64; 2], hook: Option<&dyn StepHook>| {
        let mut simulator = batch(&model, 1, 1, &[]);
        let control = control.repeat(20);
        let mut out = vec![0.0; 40];
        let rollout = Rollout {
            hook,
            ..Rollout::new(&[0], 20, 5, Control::Shared(&control), &record)
        };
        simulator.rollout(&rollout, &mut out).unwrap();
        (out, simulator.status()[0].clone())
    };
    let (hooked, _) = run([0.1, 0.2], Some(&Command(-0.3)));
    let (direct, _) = run([0.1, -0.3], None);
    assert_eq!(bits(&hooked), bits(&direct));
    let (out, status) = run([0.1, 0.2], Some(&Command(f64::NAN)));
    assert!(out.iter().all(|x| x.is_nan()) && !status.is_running());
}

struct Panics;

impl StepHook for Panics {
    fn before_step(&self, _: usize, _: usize, _: &mut StepView<'_>) {
        panic!("a hook's own fault");
    }
}

#[test]
fn a_panic_in_a_hook_reaches_the_caller() {
    let model = load(FALLING);
    let record = recording(&model, &["place"]);
    let mut simulator = batch(&model, 4, 2, &[]);
    let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
        let mut out = vec![0.0; 12];
        let rollout = Rollout {
            hook: Some(&Panics),
            ..Rollout::new(&[0, 1, 2, 3], 1, 1, Control::Shared(&[]), &record)
        };
        simulator.rollout(&rollout, &mut out)
    }));
    let payload = outcome.unwrap_err();
    assert_eq!(payload.downcast_ref(), Some(&"a hook's own fault"));
    simulator.reset(&[0, 1, 2, 3]).unwrap();
    roll(&mut simulator, 2, 1, &[], &record);
}

#[test]
fn bad_documents_are_one_line() {
    for (xml, part) in [
        (
            "<mujoco><worldbody><body><geom/></body></worldbody></mujoco>",
            "size",
        ),
        (
            "<mujoco><worldbody><geom size=\"1\" colour=\"red\"/></worldbody></mujoco>",
            "colour",
        ),
        (
            "<mujoco><asset><mesh name=\"m\" file=\"none.stl\"/></asset><worldbody><body><geom type=\"mesh\" mesh=\"m\"/></body></worldbody></mujoco>",
            "none.stl",
        ),
        (
            "<mujoco><option><flag sleep=\"enable\"/></option><worldbody/></mujoco>",
            "sleep",
        ),
        (
            "<mujoco><worldbody><body><joint/><geom size=\".1\" mass=\"0\"/></body></worldbody></mujoco>",
            "mass",
        ),
    ] {
        let Err(error) = try_load(xml) else {
            panic!("{xml} was taken");
        };
        let text = error.to_string();
        assert!(
            text.starts_with("scene test.xml: ") && text.contains(part) && !text.contains('\n'),
            "{text}"
        );
    }
    assert!(!std::path::Path::new("MUJOCO_LOG.TXT").exists());
}

#[test]
fn assets_are_found_beside_the_document() {
    let folder = std::env::temp_dir().join(format!("asid-mujoco-{}", std::process::id()));
    std::fs::create_dir_all(folder.join("assets")).unwrap();
    let mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    std::fs::write(folder.join("assets/tetra.obj"), mesh).unwrap();
    let path = folder.join("scene.xml");
    std::fs::write(
        &path,
        r#"<mujoco><compiler meshdir="assets"/><asset><mesh name="tetra" file="tetra.obj"/></asset>
        <worldbody><body name="b"><freejoint/><geom name="g" type="mesh" mesh="tetra" density="600"/></body></worldbody></mujoco>"#,
    )
    .unwrap();
    let scene = asid_core::Scene::from_file(&path).unwrap();
    let backend = asid_mujoco::MujocoBackend::new().unwrap();
    let model = asid_core::Backend::load(&backend, &scene).unwrap();
    // A corner of the unit cube: a sixth of a cubic metre.
    let mass = model.nominal(&"body/b/mass".parse().unwrap()).unwrap();
    assert!((mass - 100.0).abs() < 1e-9, "{mass}");
    let error = model.nominal(&"geom/g/mass".parse().unwrap()).unwrap_err();
    assert!(error.to_string().contains("primitives"), "{error}");
    std::fs::remove_dir_all(&folder).unwrap();
}

/// Symptom: a valid model was refused, or one of the same name in the working folder taken.
///
/// Cause: MuJoCo opens attached models while it parses, before it was told the model's folder.
#[test]
fn attached_models_are_found_beside_the_document() {
    let folder = std::env::temp_dir().join(format!("asid-attach-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let leg = r#"<mujoco><worldbody><body name="leg"><joint name="hip"/><geom size="0.1"/></body></worldbody></mujoco>"#;
    std::fs::write(folder.join("sub.xml"), leg).unwrap();
    let path = folder.join("robot.xml");
    let robot = r#"<mujoco><asset><model name="s" file="sub.xml"/></asset><worldbody>
        <body name="r"><freejoint/><geom size="0.1"/><attach model="s" body="leg" prefix="A_"/></body></worldbody></mujoco>"#;
    std::fs::write(&path, robot).unwrap();
    let scene = asid_core::Scene::from_file(&path).unwrap();
    let backend = asid_mujoco::MujocoBackend::new().unwrap();
    let model = asid_core::Backend::load(&backend, &scene).unwrap();
    assert!(model.layout().joint("A_hip").is_ok());
    std::fs::remove_dir_all(&folder).unwrap();
}

/// Symptom: an effect on one joint halved the drive of another.
///
/// Cause: effects clamp commands, and the model says that they are not to be.
#[test]
fn commands_have_no_range_where_the_model_turns_clamping_off() {
    let range = |flag: &str| {
        let model = load(&format!(
            r#"<mujoco><option><flag {flag}/></option><worldbody><body><joint name="j"/><geom size="0.1"/></body></worldbody>
            <actuator><motor name="m" joint="j" ctrlrange="-1 1"/></actuator></mujoco>"#
        ));
        let all = &model.layout().actuators;
        all.iter().any(|a| a.ctrl_range.is_some())
    };
    assert!(range(r#"clampctrl="enable""#));
    assert!(!range(r#"clampctrl="disable""#));
}

#[test]
fn sizes_and_arrays_that_do_not_fit_are_errors() {
    let model = load(ARM);
    for size in [0, 1 << 40, usize::MAX] {
        let config = BatchConfig {
            size,
            ..BatchConfig::default()
        };
        let Err(error) = model.simulator(&config) else {
            panic!("{size} simulations were taken");
        };
        assert!(matches!(error, Error::Config { .. }), "{error}");
    }
    let record = recording(&model, &["angle"]);
    let mut simulator = batch(&model, 2, 0, &[]);
    let mut out = vec![0.0; 2];
    let control = [0.0, 0.0];
    for rollout in [
        Rollout::new(&[1, 0], 1, 1, Control::Shared(&control), &record),
        Rollout::new(&[0, 2], 1, 1, Control::Shared(&control), &record),
        Rollout::new(&[0, 1], 1, 0, Control::Shared(&control), &record),
        Rollout::new(&[0, 1], 1, 1, Control::Shared(&control[..1]), &record),
        Rollout::new(&[0, 1], 2, 1, Control::Shared(&control), &record),
        Rollout::new(&[0, 1], 1, 1, Control::Shared(&[f64::NAN, 0.0]), &record),
    ] {
        assert!(matches!(
            simulator.rollout(&rollout, &mut out),
            Err(Error::Shape(_))
        ));
    }
    assert!(simulator.set_state(&[0], &[0.0; 9], &[0.0; 8]).is_err());
    assert!(
        simulator
            .set_state(&[0], &[f64::NAN; 9], &[0.0; 8])
            .is_err()
    );
    assert!(simulator.copy_state(&[0], &[0]).is_err());
    assert!(simulator.copy_state(&[2], &[0]).is_err());
    let snapshot = simulator.save(&[0]).unwrap();
    assert!(simulator.load(&snapshot, &[1], &[0]).is_err());
    let mut other = batch(&load(FALLING), 1, 1, &[]);
    assert!(other.load(&snapshot, &[0], &[0]).is_err());
}
