//! Effects as MJCF's own elements: the exported document moves like the refined model.

#![cfg(feature = "mujoco")]
#![allow(clippy::unwrap_used)]

#[path = "native_export/beside.rs"]
mod beside;

use asid::core::registry::{BackendEntry, find};
use asid::core::{Backend, BatchConfig, Control, Model, Rollout, Scene};
use asid::effects::native::{PlainModel, plain};
use asid::effects::{EffectSpec, Native, RefinedModel};

/// Two links with a motor and a servo, with angles in degrees, a class and a keyframe.
const ARM: &str = r#"<mujoco><compiler angle="degree"/><option timestep="0.002" integrator="implicitfast"/>
  <default><default class="link"><joint damping="0.05" armature="0.01"/><geom type="capsule" size="0.02"/></default></default>
  <worldbody><frame pos="0 0 1"><body name="upper"><joint class="link" name="shoulder" axis="0 1 0" range="-170 170"/>
    <geom class="link" name="upper" fromto="0 0 0 0 0 -0.3" mass="0.6"/>
    <body name="lower" pos="0 0 -0.3"><joint class="link" name="elbow" axis="0 1 0"/>
      <inertial pos="0 0 -0.15" mass="0.4" diaginertia="0.004 0.004 0.0004"/>
      <geom class="link" name="lower" fromto="0 0 0 0 0 -0.3"/></body></body></frame></worldbody>
  <actuator><motor name="push" joint="shoulder" gear="2" ctrlrange="-2 2"/>
    <position name="hold" joint="elbow" kp="8" kv="0.4" ctrlrange="-2 2" forcerange="-6 6"/></actuator>
  <sensor><jointpos name="q1" joint="shoulder"/><jointpos name="q2" joint="elbow"/>
    <jointvel name="v1" joint="shoulder"/><jointvel name="v2" joint="elbow"/>
    <framepos name="tip" objtype="geom" objname="lower"/></sensor>
  <keyframe><key name="home" qpos="0.3 -0.4"/></keyframe></mujoco>"#;

/// A puck that slides on a board.
const PUCK: &str = r#"<mujoco><option timestep="0.002"/><worldbody>
  <geom name="board" type="plane" size="2 2 0.1" friction="0.3 0.005 0.0001"/>
  <body name="puck" pos="0 0 0.02"><freejoint name="slide"/><geom name="puck" type="cylinder" size="0.05 0.02" mass="0.2" friction="0.3 0.005 0.0001"/></body>
  </worldbody><sensor><framepos name="at" objtype="xbody" objname="puck"/></sensor></mujoco>"#;

fn engine() -> Box<dyn Backend> {
    (find::<BackendEntry>("mujoco").unwrap().make)().unwrap()
}

/// All sensors over one second of varying commands.
fn run(model: &dyn Model, qvel: &[f64]) -> Vec<f64> {
    let layout = model.layout();
    let config = BatchConfig {
        size: 1,
        threads: 1,
        targets: Vec::new(),
    };
    let mut simulator = model.simulator(&config).unwrap();
    simulator.reset(&[0]).unwrap();
    if !qvel.is_empty() {
        let (qpos, _) = asid::core::problem::home(layout);
        simulator.set_state(&[0], &qpos, qvel).unwrap();
    }
    let names: Vec<&str> = layout.sensors.iter().map(|s| &*s.name).collect();
    let record = layout.recording(&names).unwrap();
    let frames = 500;
    // The servo begins at its joint's position, so that nothing between them is stretched.
    let command = |k: usize, a: usize| match a {
        0 => 0.9 * (0.02 * k as f64).cos(),
        _ => 0.9 * (0.02 * k as f64).sin() - 0.4,
    };
    let control: Vec<f64> = (0..frames * layout.nu())
        .map(|i| command(i / layout.nu(), i % layout.nu()))
        .collect();
    let mut out = vec![0.0; frames * record.width()];
    let rollout = Rollout::new(&[0], frames, 1, Control::Shared(&control), &record);
    simulator.rollout(&rollout, &mut out).unwrap();
    assert!(out.iter().all(|x| x.is_finite()));
    // Drops the first 20 ms: histories of delayed sensors, which begin at zero in MuJoCo.
    out.split_off(10 * record.width())
}

fn refined(xml: &str, values: &[(&str, f64)], effects: &[&str]) -> RefinedModel {
    RefinedModel {
        scene: Scene::from_xml("machine", xml, &[]).unwrap(),
        parameters: values
            .iter()
            .map(|(t, v)| (t.parse().unwrap(), *v))
            .collect(),
        effects: effects
            .iter()
            .map(|e| e.parse::<EffectSpec>().unwrap())
            .collect(),
    }
}

fn exported(model: &RefinedModel) -> PlainModel {
    plain(&*engine(), model, std::path::Path::new("")).unwrap()
}

/// Distances (root mean square, and largest) of the refined model's readings from those of two
/// documents.
///
/// The first is the exported document, the second the document without any effect.
fn distances(model: &RefinedModel, qvel: &[f64]) -> ([f64; 2], [f64; 2]) {
    let backend = engine();
    let written = exported(model);
    let of = |scene: &Scene| run(&*backend.load(scene).unwrap(), qvel);
    let plant = std::sync::Arc::new(asid::mjcf::Plant::of(&model.scene).unwrap());
    let wanted = asid::effects::refined::Refined::new(
        &*backend,
        backend.load(&model.scene).unwrap(),
        plant,
        &model.parameters,
        &model.effects,
    )
    .unwrap();
    let wanted = run(&*wanted, qvel);
    let far = |found: Vec<f64>| {
        let pairs = found.iter().zip(&wanted);
        let squares: f64 = pairs.clone().map(|(a, b)| (a - b).powi(2)).sum();
        let largest = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        [(squares / wanted.len() as f64).sqrt(), largest]
    };
    let scene = Scene::from_xml("exported", &written.xml, &[]).unwrap();
    (far(of(&scene)), far(of(&model.scene)))
}

/// Tolerance for the same numbers in the same engine: rounding over one second of a freely swinging
/// arm.
const EXACT: f64 = 1e-7;

#[test]
fn effects_that_are_values_or_gains_move_the_same() {
    for effect in [
        "viscous-friction@shoulder:damping=0.3",
        "armature@elbow:inertia=0.02",
        "joint-stiffness@shoulder:stiffness=3,rest=0.4",
        "joint-stiffness@elbow:stiffness=2,rest=-0.3,cubic=4",
        "gravity-tilt:pitch=0.1,roll=-0.05",
        "mass@upper:factor=1.4",
        "mass@lower:factor=1.4",
        "inertia@upper:factor=1.5",
        "inertia@lower:factor=1.5",
        "center-of-mass@upper:x=0.01,z=-0.03",
        "center-of-mass@lower:x=0.01,z=-0.03",
        "geometry@lower:x=0.02,z=-0.01,turn_x=0.1,turn_z=-0.05",
        "payload@lower:mass=0.2,moment_z=-0.02",
        "servo-stiffness@hold:factor=0.6",
        "servo-damping@hold:damping=0.2",
        "actuator-gain@push:gain=0.7",
        "actuator-gain@hold:gain=0.8",
        "actuator-bias@push:bias=0.2",
        "actuator-bias@hold:bias=-0.1",
        "actuator-delay@push:delay=0.013",
        "actuator-delay@hold:delay=0.0305",
        "constant-force@lower:z=1.5",
    ] {
        let ([_, left], [_, without]) = distances(&refined(ARM, &[], &[effect]), &[]);
        assert!(left < EXACT, "{effect}: {left} of {without}");
        assert!(without > 1e-3, "{effect} does nothing here: {without}");
    }
}

/// Laws that MuJoCo integrates in its own way. The document removes most of the difference (root
/// mean squares of all readings).
#[test]
fn effects_with_another_law_move_nearly_the_same() {
    for (effect, share) in [
        // A limit that is evaluated at the start of a step or within it.
        ("actuator-saturation@push:limit=1.1", 1e-3),
        ("actuator-saturation@hold:limit=0.9", 0.02),
        // The mean over a step or its start: half a step of a lag of 50 steps.
        ("actuator-lag@push:time_constant=0.1", 0.02),
        ("actuator-lag@hold:time_constant=0.1", 0.02),
        // A soft constraint for a rigid law: speeds differ for some steps where the joint stops.
        ("coulomb-friction@shoulder:force=0.4", 0.15),
        ("sensor-delay@q1:delay=0.02", 0.02),
        // The ends of the gap are springs of two time steps: speeds differ at an impact.
        ("backlash@elbow:width=0.1", 0.5),
        // The trapezoidal rule, or MuJoCo's symplectic Euler: periods differ by an eighth of the
        // square of a step's phase.
        ("joint-compliance@elbow:compliance=0.05", 0.01),
    ] {
        let ([left, _], [without, _]) = distances(&refined(ARM, &[], &[effect]), &[]);
        assert!(left < share * without, "{effect}: {left} of {without}");
    }
}

#[test]
fn friction_and_softness_of_contacts_move_the_same() {
    for effect in [
        "sliding-friction@board:factor=0.5",
        "contact-stiffness@board:factor=0.5",
        "contact-restitution@board:factor=0.5",
        "gravity-tilt:pitch=0.05",
    ] {
        let qvel = [0.8, 0.1, -0.3, 0.0, 0.0, 0.0];
        let ([_, left], [_, without]) = distances(&refined(PUCK, &[], &[effect]), &qvel);
        assert!(left < EXACT, "{effect}: {left} of {without}");
        assert!(without > 1e-6, "{effect}: {without}");
    }
}

/// Effects at one site, and values of the study, are exported together.
#[test]
fn several_effects_compose() {
    let values = [
        ("joint/shoulder/damping", 0.2),
        ("actuator/hold/kp", 11.0),
        ("geom/upper/mass", 0.8),
        ("joint/shoulder/range/1", 1.0),
    ];
    let effects = [
        "actuator-gain@hold:gain=0.9",
        "actuator-bias@hold:bias=0.05",
        "actuator-delay@hold:delay=0.01",
        "joint-stiffness@shoulder:stiffness=1,rest=0.5",
        "center-of-mass@upper:x=0.02",
        "viscous-friction@shoulder:damping=0.1",
    ];
    let ([_, left], [_, without]) = distances(&refined(ARM, &values, &effects), &[]);
    assert!(left < EXACT, "{left} of {without}");
    assert!(without > 0.05);
}

/// Symptom: an exported constant force was larger on a body with another mass.
///
/// Cause: it is written as a share of the weight, and this was the weight before the change.
#[test]
fn a_constant_force_does_not_grow_with_the_mass() {
    for body in ["lower", "upper"] {
        let force = format!("constant-force@{body}:z=1.5");
        let mass = format!("mass@{body}:factor=1.4");
        let ([_, left], [_, without]) = distances(&refined(ARM, &[], &[&force, &mass]), &[]);
        assert!(left < EXACT, "{body}: {left} of {without}");
    }
    let effects = ["constant-force@lower:z=1.5", "gravity-tilt:pitch=0.1"];
    let sentences = exported(&refined(ARM, &[], &effects)).sentences();
    assert!(
        sentences.iter().any(|s| s.contains("another gravity")),
        "{sentences:?}"
    );
}

/// Two links, of which the second and a weight lie in a frame that is moved and turned.
const FRAMED: &str = r#"<mujoco><option timestep="0.002" integrator="implicitfast"/><worldbody>
  <body name="base"><joint name="swing" axis="0 1 0" damping="0.1"/><geom name="base" size="0.05" mass="1"/>
    <frame pos="0.1 0 -0.2"><frame pos="0.1 0 0" quat="0.9 0.3 0.2 0.1">
      <geom name="weight" size="0.03" mass="0.3" pos="0 0.1 0"/>
      <body name="link" pos="0.1 0 0"><joint name="turn" axis="0 1 0" damping="0.1"/>
        <geom name="link" size="0.05" mass="0.5" pos="0 0 0.2"/></body></frame></frame></body></worldbody>
  <actuator><motor name="push" joint="turn"/></actuator>
  <sensor><jointpos name="q1" joint="swing"/><jointpos name="q2" joint="turn"/></sensor></mujoco>"#;

/// Symptom: an exported body or geom inside a `<frame>` was elsewhere.
///
/// Cause: its place in the frame of its body was written, and MuJoCo applied the frame again.
#[test]
fn a_place_inside_a_frame_is_written_as_the_frame_sees_it() {
    for target in ["body/link/pos/0", "geom/weight/pos/2"] {
        let model = refined(FRAMED, &[(target, 0.35)], &[]);
        let ([_, left], [_, without]) = distances(&model, &[]);
        assert!(left < EXACT, "{target}: {left} of {without}");
        assert!(without > 1e-3, "{target} does nothing here: {without}");
    }
    let xml = FRAMED.replace(r#"quat="0.9 0.3 0.2 0.1""#, r#"euler="20 0 0""#);
    let written = exported(&refined(&xml, &[("body/link/pos/0", 0.35)], &[]));
    assert_eq!(written.xml, xml);
    let sentences = written.sentences().join("\n");
    assert!(
        sentences.contains("body `link` lies in a <frame>"),
        "{sentences}"
    );
}

/// Symptom: on rapier no document was written with a spring, and a loose joint kept its range on
/// the drive's side. Cause: rapier has no targets of a spring's rest and of a range, which the
/// document states.
#[test]
fn a_smaller_engine_writes_the_same_document() {
    let rapier = (find::<BackendEntry>("rapier").unwrap().make)().unwrap();
    let xml = ARM
        .replace(r#"angle="degree""#, r#"angle="radian""#)
        .replace(r#"range="-170 170""#, r#"range="-2.5 2.5""#)
        .replace(
            r#"name="elbow""#,
            r#"name="elbow" stiffness="1.5" springref="0.4""#,
        );
    for effect in [
        "joint-stiffness@shoulder:stiffness=3,rest=0.4",
        "joint-stiffness@elbow:stiffness=2,rest=-0.3",
        "actuator-gain@hold:gain=0.8",
        "actuator-bias@push:bias=0.2",
        "actuator-delay@push:delay=0.013",
        "actuator-lag@hold:time_constant=0.1",
        "backlash@shoulder:width=0.1",
        "joint-compliance@shoulder:compliance=0.05",
        "sensor-delay@q1:delay=0.02",
    ] {
        let model = refined(&xml, &[], &[effect]);
        let written = plain(&*rapier, &model, std::path::Path::new("")).unwrap();
        assert_eq!(written.xml, exported(&model).xml, "{effect}");
        if effect.starts_with("backlash") {
            let range = r#"limited="true" range="-2.5 2.5""#;
            assert!(written.xml.contains(range), "{}", written.xml);
        }
    }
}

/// Symptom: an exported servo with a `timeconst` answered without its lag.
///
/// Cause: a gain or a bias of its command is written in the long form, with `dyntype="none"`.
#[test]
fn a_servo_with_a_gain_keeps_its_own_lag() {
    let own = ARM.replace(r#"kv="0.4""#, r#"kv="0.4" timeconst="0.05""#);
    let class = ARM.replace(r#"kp="8""#, r#"class="link" kp="8""#).replace(
        r#"size="0.02"/>"#,
        r#"size="0.02"/><position timeconst="0.05"/>"#,
    );
    for xml in [own, class] {
        let model = refined(&xml, &[], &["actuator-gain@hold:gain=0.8"]);
        let ([_, left], [_, without]) = distances(&model, &[]);
        assert!(left < EXACT, "{left} of {without}");
        let written = exported(&model).xml;
        let filter = r#"gainprm="6.4" biastype="affine" biasprm="0 -8 -0.4" dyntype="filterexact" dynprm="0.05""#;
        assert!(written.contains(filter), "{written}");
        let model = refined(&xml, &[], &["actuator-lag@hold:time_constant=0.1"]);
        let written = exported(&model);
        let sentences = written.sentences().join("\n");
        assert!(sentences.contains("has a filter of its own"), "{sentences}");
    }
}

/// Symptom: the exported document of an elastic or loose joint with a spring moved otherwise than
/// the refined model.
///
/// Cause: the spring stayed at the drive's side of the transmission, while it acts on the link.
#[test]
fn the_spring_of_an_elastic_joint_acts_on_its_link() {
    let own = r#"name="elbow" axis="0 1 0" stiffness="6" springref="40""#;
    let xml = ARM.replace(r#"name="elbow" axis="0 1 0""#, own);
    let effect = "joint-compliance@elbow:compliance=0.05";
    let model = refined(&xml, &[], &[effect]);
    let ([left, _], [without, _]) = distances(&model, &[]);
    assert!(left < 0.02 * without, "{left} of {without}");
    let written = exported(&model).xml;
    assert!(
        written.contains(r#"_whole" damping="0.05" stiffness="6""#),
        "{written}"
    );
}

/// Symptom: the exported document moved otherwise than the refined model where a servo had a
/// `dampratio`.
///
/// Cause: the ratio stayed beside a new gain, mass or armature, and MuJoCo computed another damping
/// from them.
#[test]
fn a_damping_ratio_is_written_as_the_damping_of_the_model() {
    let own = ARM.replace(r#"kv="0.4""#, r#"dampratio="0.7""#);
    let class = ARM
        .replace(r#"kp="8" kv="0.4""#, r#"class="link" kp="8""#)
        .replace(
            r#"size="0.02"/>"#,
            r#"size="0.02"/><position dampratio="0.7"/>"#,
        );
    for xml in [own, class] {
        for values in [
            [("actuator/hold/kp", 3.0)],
            [("joint/elbow/armature", 0.05)],
            [("body/lower/mass", 0.8)],
        ] {
            let model = refined(&xml, &values, &[]);
            let ([_, left], [_, without]) = distances(&model, &[]);
            assert!(left < EXACT, "{values:?}: {left} of {without}");
            assert!(without > 1e-3, "{values:?} does nothing here: {without}");
        }
    }
}

#[test]
fn what_mjcf_cannot_say_is_told_in_a_sentence() {
    let model = refined(
        ARM,
        &[],
        &[
            "torque-ripple@elbow:amplitude_sin=0.1",
            "sensor-bias@q1:bias=0.1",
        ],
    );
    let written = exported(&model);
    assert_eq!(written.sentences().len(), 2);
    for (expressed, sentence) in written.effects.iter().zip(written.sentences()) {
        assert!(matches!(expressed.native, Native::LeftOut(_)), "{sentence}");
        assert!(
            sentence.contains("is left out: it has no counterpart"),
            "{sentence}"
        );
    }
    assert_eq!(written.xml, ARM);
}

/// What is not changed stays as its author wrote it.
#[test]
fn the_rest_of_the_document_stays() {
    let model = refined(ARM, &[("joint/elbow/damping", 0.5)], &[]);
    let xml = exported(&model).xml;
    let changed = ARM.replace(
        r#"<joint class="link" name="elbow" axis="0 1 0"/>"#,
        r#"<joint class="link" name="elbow" axis="0 1 0" damping="0.5"/>"#,
    );
    assert_eq!(xml, changed);
}

/// A tetrahedron as a mesh.
const TETRAHEDRON: &str =
    "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

#[test]
fn meshes_and_includes_are_found_from_another_folder() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    for name in ["robot/assets", "robot/parts", "out/deep"] {
        std::fs::create_dir_all(at(name)).unwrap();
    }
    std::fs::write(at("robot/assets/tip.obj"), TETRAHEDRON).unwrap();
    let arm = r#"<mujocoinclude><body name="arm"><joint name="turn" axis="0 1 0" damping="0.1"/>
      <geom name="tip" type="mesh" mesh="tip" mass="0.3"/></body></mujocoinclude>"#;
    std::fs::write(at("robot/parts/arm.xml"), arm).unwrap();
    let robot = r#"<mujoco><compiler meshdir="assets"/><asset><mesh name="tip" file="tip.obj"/></asset>
      <worldbody><include file="parts/arm.xml"/></worldbody><sensor><jointpos name="q" joint="turn"/></sensor></mujoco>"#;
    std::fs::write(at("robot/robot.xml"), robot).unwrap();
    let model = RefinedModel {
        scene: Scene::from_file(&at("robot/robot.xml")).unwrap(),
        parameters: vec![("joint/turn/damping".parse().unwrap(), 0.02)],
        effects: vec!["gravity-tilt:pitch=0.1".parse().unwrap()],
    };
    let backend = engine();
    let written = plain(&*backend, &model, &at("out/deep")).unwrap();
    std::fs::write(at("out/deep/model.xml"), &written.xml).unwrap();
    let scene = Scene::from_file(&at("out/deep/model.xml")).unwrap();
    let compiled = backend.load(&scene).unwrap();
    assert_eq!(
        compiled
            .nominal(&"joint/turn/damping".parse().unwrap())
            .unwrap(),
        0.02
    );
    // Nothing refers to this machine's paths, so the folders can move together.
    assert!(
        !written.xml.contains(folder.path().to_str().unwrap()),
        "{}",
        written.xml
    );
}
