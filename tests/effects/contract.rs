//! The contract of every effect of the catalogue, at every site of several kinds of machines.
//!
//! An effect has bitwise no influence at its null values, its memory is part of snapshots, and its
//! sites are usable.

use asid::core::registry::all;
use asid::core::{Backend, BatchConfig, Capabilities, Control, Model as _, Rollout, Target};
use asid::effects::Effect;
use asid::effects::EffectEntry;
use asid::effects::EffectSpec;
use asid::effects::refined::{Refined, counts_episodes, needs};
use asid::mjcf::Plant;

use super::bench::{engines, scene};

/// A driven arm of two links with a velocity servo and a spring-loaded slide.
const ARM: &str = r#"<mujoco><compiler angle="radian"/><option timestep="0.002" integrator="implicitfast"/>
  <worldbody><body name="upper" pos="0 0 1"><joint name="shoulder" axis="0 1 0" damping="0.1" armature="0.02"/>
    <geom name="upper" type="capsule" fromto="0 0 0 0.3 0 0" size="0.03" mass="1.2"/>
    <body name="fore" pos="0.3 0 0"><joint name="elbow" axis="0 1 0" damping="0.05" frictionloss="0.1"/>
      <geom name="fore" type="capsule" fromto="0 0 0 0.2 0 0" size="0.02" mass="0.5"/>
      <body name="tool" pos="0.2 0 0"><joint name="reach" type="slide" axis="1 0 0" stiffness="40" damping="1"/>
        <inertial pos="0.01 0 0" mass="0.2" diaginertia="0.001 0.002 0.003"/></body></body></body></worldbody>
  <actuator><motor name="motor" joint="shoulder" gear="2" ctrlrange="-5 5"/>
    <position name="servo" joint="elbow" kp="15" kv="0.8" forcerange="-3 3"/>
    <velocity name="speed" joint="reach" kv="8"/></actuator>
  <sensor><jointpos name="q" joint="shoulder"/><jointvel name="w" joint="elbow"/>
    <framepos name="tip" objtype="xbody" objname="tool"/><framequat name="turn" objtype="xbody" objname="tool"/></sensor></mujoco>"#;

/// A ball and a puck on a floor, and a driven pusher.
const FLOOR: &str = r#"<mujoco><compiler angle="radian"/><option timestep="0.002" cone="elliptic" impratio="10"/>
  <worldbody><geom name="floor" type="plane" size="9 9 1" friction="0.3 0.01 0.001" condim="6"/>
    <body name="ball" pos="0 0 0.1"><freejoint name="fly"/><geom name="ball" size="0.05" mass="0.1" friction="0.3 0.01 0.001" condim="6"/></body>
    <body name="puck" pos="0.5 0.015 0.0199"><freejoint name="slip"/><geom name="puck" type="cylinder" size="0.05 0.02" mass="0.3" friction="0.4 0.01 0.001" condim="4"/></body>
    <body name="pusher" pos="0.3 0 0.05"><joint name="push" type="slide" axis="1 0 0" damping="2" armature="0.1"/>
      <geom name="tip" type="box" size="0.02 0.05 0.03" mass="0.5" friction="0.6 0.01 0.001"/></body></worldbody>
  <actuator><position name="pushing" joint="push" kp="200" kv="20"/></actuator>
  <sensor><framepos name="ball_at" objtype="xbody" objname="ball"/><framepos name="puck_at" objtype="xbody" objname="puck"/>
    <framelinvel name="puck_v" objtype="xbody" objname="puck"/><jointpos name="push_at" joint="push"/></sensor></mujoco>"#;

const FRAMES: usize = 40;
const SUBSTEPS: usize = 5;
/// Episode of the readings, for effects that count episodes.
const EPISODE: f64 = 3.0;

/// Commands that move all joints, `frames x nu`.
fn commands(nu: usize) -> Vec<f64> {
    let entry = |k: usize| 0.4 * (0.3 * (k / nu) as f64 + (k % nu) as f64).sin() + 0.1;
    (0..FRAMES * nu).map(entry).collect()
}

/// Readings of a machine in motion. At the frame `cut` the run is saved, disturbed and restored.
fn readings(
    backend: &dyn Backend,
    xml: &str,
    effects: &[EffectSpec],
    targets: &[Target],
    cut: Option<usize>,
) -> asid::core::Result<Vec<u64>> {
    let model = Refined::load(backend, &scene(xml), effects)?;
    let layout = model.layout().clone();
    let counted = counts_episodes(&*model);
    let config = BatchConfig {
        size: 1,
        threads: 1,
        targets: targets.iter().cloned().chain(counted.clone()).collect(),
    };
    let mut simulator = model.simulator(&config)?;
    if counted.is_some() {
        assert!(targets.is_empty(), "of effects no target is set");
        simulator.set_parameters(&[0], &[EPISODE])?;
    }
    let names: Vec<_> = layout.sensors.iter().map(|s| s.name.clone()).collect();
    let recording = layout.recording(&names)?;
    let control = commands(layout.nu());
    let mut out = vec![0.0; FRAMES * recording.width()];
    let at = cut.unwrap_or(FRAMES);
    let (w, nu) = (recording.width(), layout.nu());
    let mut part = |simulator: &mut dyn asid::core::Simulator, range: std::ops::Range<usize>| {
        let control = Control::Shared(&control[range.start * nu..range.end * nu]);
        let rollout = Rollout::new(&[0], range.len(), SUBSTEPS, control, &recording);
        simulator.rollout(&rollout, &mut out[range.start * w..range.end * w])
    };
    part(&mut *simulator, 0..at)?;
    if at < FRAMES {
        let saved = simulator.save(&[0])?;
        part(&mut *simulator, 0..at)?;
        simulator.reset(&[0])?;
        simulator.load(&saved, &[0], &[0])?;
        part(&mut *simulator, 0..at.min(3))?;
        simulator.load(&saved, &[0], &[0])?;
        part(&mut *simulator, at..FRAMES)?;
        return Ok(out[at * w..].iter().map(|x| x.to_bits()).collect());
    }
    Ok(out.iter().map(|x| x.to_bits()).collect())
}

/// Calls `check` for each effect at each of its sites, at null values and at others.
///
/// The other values are 2 % of the way to the upper end of the range, or 99.9 % of the way to the
/// lower end where the null value is the upper end.
fn each_at_each_site(xml: &str, mut check: impl FnMut(&dyn Backend, &str, EffectSpec, EffectSpec)) {
    let plant = Plant::of(&scene(xml)).unwrap();
    for backend in engines(Capabilities::STEP_HOOKS) {
        for entry in all::<EffectEntry>() {
            let effect = (entry.make)();
            if !backend.capabilities().contains(needs(&*effect)) {
                continue;
            }
            for site in effect.sites(&plant) {
                let null = EffectSpec {
                    name: entry.name.into(),
                    site,
                    values: Vec::new(),
                };
                let mut some = null.clone();
                for p in effect.parameters() {
                    let (far, part) = match p.null >= p.range[1] {
                        true => (p.range[0], 0.999),
                        false => (p.range[1], 0.02),
                    };
                    let value = p.null + part * (far - p.null);
                    some.values.push((p.name.into(), value));
                }
                let label = format!("{}: {some}", backend.name());
                check(&*backend, &label, null, some);
            }
        }
    }
}

#[test]
fn what_an_ordinary_machine_has_of_an_effect_lies_about_none_of_it() {
    let one = |_: asid::effects::Reference| 1.0;
    let mut counted = 0;
    for xml in [ARM, FLOOR] {
        let plant = Plant::of(&scene(xml)).unwrap();
        for entry in all::<EffectEntry>() {
            let effect = (entry.make)();
            for site in effect.sites(&plant) {
                let tolerance = effect.tolerance(&plant, &site, &one);
                if tolerance.is_empty() {
                    continue;
                }
                assert_eq!(tolerance.len(), effect.parameters().len(), "{}", entry.name);
                for ([low, high], p) in tolerance.iter().zip(effect.parameters()) {
                    assert!(low <= high, "{} {}", entry.name, p.name);
                    if low < high {
                        counted += 1;
                        assert!(
                            *low <= p.null && p.null <= *high,
                            "{} {}",
                            entry.name,
                            p.name
                        );
                        // The end of a tolerance is within the range of a named value.
                        assert!(*high < p.range[1], "{} {}", entry.name, p.name);
                    }
                }
            }
        }
    }
    assert!(counted > 20, "{counted}");
}

/// Compares with a simulation whose same parameters can be set but are not, since an engine may
/// round differently once a body's mass can change.
#[test]
fn every_effect_is_off_at_its_null_value_to_the_bit() {
    for xml in [ARM, FLOOR] {
        let plant = Plant::of(&scene(xml)).unwrap();
        each_at_each_site(xml, |backend, label, null, _| {
            let targets = null.find(&plant).unwrap().targets(&plant, &null.site);
            let without = readings(backend, xml, &[], &targets, None).unwrap();
            let with = readings(backend, xml, &[null], &[], None).unwrap();
            assert!(with == without, "{label}: not off");
        });
    }
}

#[test]
fn every_effect_acts_at_some_site_of_some_machine() {
    let mut seen = std::collections::BTreeMap::new();
    for xml in [ARM, FLOOR] {
        each_at_each_site(xml, |backend, label, null, some| {
            let off = readings(backend, xml, &[null], &[], None).unwrap();
            let on = readings(backend, xml, std::slice::from_ref(&some), &[], None)
                .unwrap_or_else(|e| panic!("{label}: {e}"));
            let key = format!("{} on {}", some.name, backend.name());
            *seen.entry(key).or_insert(false) |= on != off;
        });
    }
    let silent: Vec<_> = seen.iter().filter(|(_, acts)| !**acts).collect();
    assert!(silent.is_empty(), "{silent:?}");
}

#[test]
fn a_snapshot_carries_the_memory_of_every_effect() {
    for xml in [ARM, FLOOR] {
        each_at_each_site(xml, |backend, label, _, some| {
            let effects = [some];
            let whole = readings(backend, xml, &effects, &[], None).unwrap();
            let cut = 13;
            let rest = readings(backend, xml, &effects, &[], Some(cut)).unwrap();
            let from = whole.len() - rest.len();
            assert!(whole[from..] == rest[..], "{label}: goes on otherwise");
        });
    }
}

#[test]
fn the_catalogue_is_complete() {
    let names: Vec<_> = all::<EffectEntry>().iter().map(|e| e.name).collect();
    let wanted = "actuator-delay actuator-lag actuator-gain actuator-bias actuator-saturation \
        actuator-deadband backlash viscous-friction coulomb-friction stribeck-friction load-friction \
        joint-stiffness joint-compliance armature torque-ripple sensor-delay sensor-bias sensor-scale \
        sensor-drift sensor-filter sensor-quantization sliding-friction torsional-friction \
        rolling-friction friction-patch friction-drift friction-anisotropy contact-restitution \
        contact-stiffness mass center-of-mass inertia payload gravity-tilt constant-force linear-drag \
        quadratic-drag magnus servo-stiffness servo-damping actuator-hysteresis torque-speed-limit \
        supply-drift geometry episode-offset sensor-trend supply-trend friction-trend";
    for name in wanted.split_whitespace() {
        assert!(names.contains(&name), "{name}");
    }
    assert_eq!(names.len(), wanted.split_whitespace().count(), "{names:?}");
}

#[test]
fn what_an_effect_refines_goes_with_or_is_mistaken_for_is_in_the_catalogue() {
    let all = all::<EffectEntry>();
    for entry in &all {
        let effect = (entry.make)();
        let confused = effect.mistaken_for().iter().flat_map(|c| c.with);
        let others = effect.refines().iter().chain(effect.goes_with());
        for name in others.chain(confused) {
            assert!(
                all.iter().any(|e| e.name == *name) && *name != entry.name,
                "{}: `{name}`",
                entry.name
            );
        }
    }
}

/// Guards against a refinement without the simpler law's value: a Stribeck friction that begins
/// without the dry friction of 2 N that it refines.
#[test]
fn what_an_effect_takes_over_is_a_parameter_of_a_law_that_it_refines() {
    let all = all::<EffectEntry>();
    let of = |name: &str| all.iter().find(|e| e.name == name).map(|e| (e.make)());
    let has = |effect: &dyn Effect, name: &str| effect.parameters().iter().any(|p| p.name == name);
    for entry in &all {
        let effect = (entry.make)();
        for simpler in effect.refines().iter().filter_map(|name| of(name)) {
            for (own, theirs) in effect.takes_over() {
                let both = has(&*effect, own) && has(&*simpler, theirs);
                assert!(both, "{}: `{own}` and `{theirs}`", entry.name);
            }
        }
        assert_eq!(
            effect.refines().is_empty(),
            effect.takes_over().is_empty(),
            "{}",
            entry.name
        );
    }
}

/// A clock correction is revised by the seconds that a delay of every sensor has. Such an effect
/// must therefore have no other parameter.
#[test]
fn an_effect_that_delays_readings_has_a_time_and_nothing_else() {
    let effects = all::<EffectEntry>().into_iter();
    let delays = effects.filter(|e| (e.make)().delays());
    let names: Vec<&str> = delays.map(|e| e.name).collect();
    assert_eq!(names, ["sensor-delay"]);
    let delay = (all::<EffectEntry>().iter())
        .find(|e| e.name == "sensor-delay")
        .map(|e| (e.make)().parameters())
        .unwrap();
    assert_eq!((delay.len(), delay[0].unit), (1, "s"));
}

#[test]
fn a_force_on_a_body_is_unusual_where_joints_hold_it() {
    let plant = Plant::of(&scene(FLOOR)).unwrap();
    let drag = (asid::core::registry::find::<EffectEntry>("linear-drag")
        .unwrap()
        .make)();
    assert!(drag.unusual_at(&plant, "pusher"));
    assert!(!drag.unusual_at(&plant, "ball"));
}
