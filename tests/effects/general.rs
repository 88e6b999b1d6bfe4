//! `<general>` actuators with the gains of a short form: effects find them and act as on the short
//! form.

use super::ROTOR;
use super::bench::{Bench, engines_for, near};
use asid::core::registry::{BackendEntry, all};
use asid::core::{Model as _, Target};
use asid::effects::EffectEntry;
use asid::effects::refined::Refined;
use asid::mjcf::Plant;

fn machine(actuator: &str) -> String {
    ROTOR
        .replace(r#"<motor name="drive" joint="spin" gear="1"/>"#, actuator)
        .replace(
            r#"gravity="0 0 0""#,
            r#"gravity="0 0 0" integrator="implicitfast""#,
        )
        .replace(r#"name="spin" axis"#, r#"name="spin" armature="0.05" axis"#)
}

/// Short forms, each with its `<general>` equivalent.
const PAIRS: [[&str; 2]; 3] = [
    [
        r#"<position name="drive" joint="spin" kp="30" kv="4" forcerange="-2 2" gear="1.5"/>"#,
        r#"<general name="drive" joint="spin" gainprm="30" biastype="affine" biasprm="0 -30 -4" forcerange="-2 2" gear="1.5"/>"#,
    ],
    [
        r#"<velocity name="drive" joint="spin" kv="4"/>"#,
        r#"<general name="drive" joint="spin" gainprm="4" biastype="affine" biasprm="0 0 -4"/>"#,
    ],
    [
        r#"<motor name="drive" joint="spin" gear="3" ctrlrange="-1 1"/>"#,
        r#"<general name="drive" joint="spin" gainprm="6" gear="0.5" ctrlrange="-1 1"/>"#,
    ],
];

/// Engines that support the effect and `<general>` actuators.
fn engines_for_general(effect: &str) -> Vec<Box<dyn asid::core::Backend>> {
    let scene = super::bench::scene(&machine(PAIRS[0][1]));
    let engines = engines_for(effect).into_iter();
    engines.filter(|b| b.load(&scene).is_ok()).collect()
}

/// Symptom: an exported gain was a fifth of the right one, and limits of force were at a fifth of the
/// force.
///
/// Cause: a default class has one actuator for all kinds, and only what it says of the own kind was
/// read.
#[test]
fn a_class_says_of_any_kind_of_actuator_what_it_says_of_one() {
    let of_class =
        r#"<default><motor gear="5" forcerange="-3 3"/><position kp="7"/></default><worldbody>"#;
    for own in [
        r#"<position name="drive" joint="spin" kp="2"/>"#,
        r#"<general name="drive" joint="spin" gainprm="2"/>"#,
        r#"<velocity name="drive" joint="spin" kv="2"/>"#,
    ] {
        let xml = machine(own).replace("<worldbody>", of_class);
        let scene = super::bench::scene(&xml);
        let drive = Plant::of(&scene).unwrap().drives[0].unwrap();
        // The gear of a motor includes its gain, and its limits lie before it.
        let limit = drive.force_range.unwrap()[1] * drive.gear / 5.0;
        assert_eq!(limit, 3.0, "{own}");
        for backend in engines_for_general("actuator-gain") {
            let model = backend.load(&scene).unwrap();
            let gear = Target::new("actuator", "drive", "gear", 0);
            let gear = model.nominal(&gear).unwrap();
            assert!(
                (drive.gear.abs() / 5.0) >= 1.0 && gear == 5.0,
                "{own}: {drive:?} {gear}"
            );
        }
    }
}

#[test]
fn general_actuators_have_the_sites_of_their_short_forms() {
    for forms in PAIRS {
        let [short, general] = forms.map(|a| Plant::of(&super::bench::scene(&machine(a))).unwrap());
        let known = |plant: &Plant| {
            let drives = plant.drives.iter().flatten();
            let known = drives.map(|d| (d.joint, d.law, d.gear, d.ctrl_range, d.force_range));
            known.collect::<Vec<_>>()
        };
        assert_eq!(known(&short), known(&general));
        for entry in all::<EffectEntry>() {
            let effect = (entry.make)();
            assert_eq!(
                effect.sites(&short),
                effect.sites(&general),
                "{}",
                entry.name
            );
        }
    }
}

#[test]
fn effects_act_on_general_actuators_as_on_their_short_forms() {
    for (i, effect) in [
        (0, "servo-stiffness@drive:factor=0.1"),
        (0, "servo-damping@drive:damping=2"),
        (0, "actuator-saturation@drive:limit=1"),
        (0, "actuator-deadband@drive:width=0.1"),
        (0, "torque-speed-limit@drive:force=2,speed=3"),
        (0, "backlash@spin:width=0.02"),
        (0, "load-friction@spin:coefficient=0.3"),
        (1, "servo-damping@drive:damping=2"),
        (1, "actuator-saturation@drive:limit=1"),
        (1, "joint-compliance@spin:compliance=0.02"),
        (2, "actuator-saturation@drive:limit=1"),
        (2, "load-friction@spin:coefficient=0.3"),
        (2, "backlash@spin:width=0.02"),
    ] {
        for backend in engines_for_general(effect) {
            let [short, general] =
                PAIRS[i].map(|a| Bench::new(&*backend, &machine(a), &[effect]).hold(300, &[0.7]));
            for (a, b) in short.iter().zip(&general) {
                near(effect, b[0], a[0], 1e-9);
            }
        }
    }
}

/// Gains that are read from the document agree with the engine's, for classes too.
#[test]
fn gains_of_the_document_are_those_of_the_engine() {
    let class = r#"<default><default class="a"><general biastype="affine" gainprm="50" biasprm="0 -50 -4"/></default>
      <default class="b"><position kp="70" kv="3"/></default></default>"#;
    for actuator in [
        r#"<general name="drive" joint="spin" class="a"/>"#,
        r#"<position name="drive" joint="spin" class="a"/>"#,
        r#"<position name="drive" joint="spin" class="a" kp="20"/>"#,
        r#"<position name="drive" joint="spin" class="b"/>"#,
        r#"<velocity name="drive" joint="spin" kv="9"/>"#,
        PAIRS[0][1],
        PAIRS[1][1],
    ] {
        let xml = machine(actuator).replace("<worldbody>", &format!("{class}<worldbody>"));
        let scene = super::bench::scene(&xml);
        let plant = Plant::of(&scene).unwrap();
        let (_, drive) = plant.drive("drive").unwrap();
        use asid::mjcf::plant::DriveLaw;
        let gains = match drive.law {
            DriveLaw::Position { kp, kv } => vec![("kp", kp), ("kv", kv)],
            DriveLaw::Velocity { kv } => vec![("kv", kv)],
            DriveLaw::Motor => panic!("{actuator}"),
        };
        for entry in all::<BackendEntry>() {
            let backend = (entry.make)().unwrap();
            // rapier interprets classes in its own way.
            if backend.name() != "mujoco" {
                continue;
            }
            let model = Refined::load(&*backend, &scene, &[]).unwrap();
            for (attribute, gain) in &gains {
                let target: Target = format!("actuator/drive/{attribute}").parse().unwrap();
                near(actuator, model.nominal(&target).unwrap(), *gain, 1e-12);
            }
        }
    }
}

/// The effects use the `kv` that the engine computes from a damping ratio: `2 ratio sqrt(kp I)`.
#[test]
fn effects_know_the_damping_that_a_ratio_makes() {
    let about: f64 = super::INERTIA + 0.05;
    let kv = 2.0 * 0.7 * (30.0 * about).sqrt();
    let ratio =
        r#"<position name="drive" joint="spin" kp="30" dampratio="0.7" forcerange="-9 9"/>"#;
    let gain =
        format!(r#"<position name="drive" joint="spin" kp="30" kv="{kv}" forcerange="-9 9"/>"#);
    let scene = super::bench::scene(&machine(ratio));
    for effect in [
        "actuator-saturation@drive:limit=1",
        "torque-speed-limit@drive:force=2,speed=3",
        "load-friction@spin:coefficient=0.3",
        "backlash@spin:width=0.02",
        "servo-damping@drive:damping=-1",
    ] {
        let engines = engines_for(effect).into_iter();
        for backend in engines.filter(|b| b.load(&scene).is_ok()) {
            let [a, b] = [ratio, &gain]
                .map(|a| Bench::new(&*backend, &machine(a), &[effect]).hold(300, &[0.7]));
            for (a, b) in a.iter().zip(&b) {
                near(effect, a[0], b[0], 1e-9);
            }
        }
    }
}
