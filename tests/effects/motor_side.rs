//! Backlash and compliance: the effect on a joint of a drive that is not rigidly attached to it.

use super::bench::{Bench, engines_for, near, on_each};
use super::{DT, INERTIA};

/// A rotor on a servo or a motor; `joint` has the attributes of its joint.
fn machine(joint: &str, drive: &str) -> String {
    format!(
        r#"<mujoco><compiler angle="radian"/><option timestep="0.002" gravity="0 0 -9.81" integrator="implicitfast"/>
  <worldbody><body name="rotor"><joint name="spin" {joint}/>
    <inertial pos="0.2 0 0" mass="1" diaginertia="0.46 0.46 0.46"/></body></worldbody>
  <actuator><{drive} name="drive" joint="spin"/></actuator>
  <sensor><jointpos name="angle" joint="spin"/><jointvel name="speed" joint="spin"/></sensor></mujoco>"#
    )
}

/// Inertia about the joint, kg m², with an offset centre of mass: the same as in the other scenes.
const ABOUT: f64 = 0.46 + 0.2 * 0.2;

const LEVEL: &str = r#"axis="0 0 1""#;
const STIFF: &str = r#"position kp="400" kv="80""#;

#[test]
fn the_inertia_is_as_said() {
    assert!((ABOUT - INERTIA).abs() < 1e-12);
}

/// Angle after the command has moved to a value over eight seconds and stayed there for two. The
/// motion is so slow that the joint never runs ahead of its drive.
fn settle(bench: &mut Bench, from: f64, to: f64) -> f64 {
    let ramp = |k: usize| vec![from + (to - from) * (k as f64 / 4000.0).min(1.0)];
    let commands: Vec<_> = (0..5000).map(ramp).collect();
    bench.run(1, &commands)[4999][0]
}

#[test]
fn play_loses_exactly_its_width() {
    let (friction, width) = (0.5, 0.06);
    let xml = machine(r#"axis="0 0 1" damping="0.5" frictionloss="0.5""#, STIFF);
    on_each(&xml, &[&format!("backlash@spin:width={width}")], |bench| {
        let up = settle(bench, 0.0, 0.5);
        let down = settle(bench, 0.5, -0.5);
        // Dry friction holds the joint where the drive leaves it, at most `short` before the goal.
        let short = friction / 400.0;
        near(
            &bench.engine,
            up,
            0.5 - width / 2.0 - short / 2.0,
            0.6 * short,
        );
        near(&bench.engine, up - down, 1.0 - width - short, 1.2 * short);
    });
}

#[test]
fn under_a_load_of_one_sign_play_is_an_offset() {
    let width = 0.06;
    let xml = machine(r#"axis="0 1 0" damping="2""#, STIFF);
    for backend in engines_for("backlash") {
        let mut plain = Bench::new(&*backend, &xml, &[]);
        let mut loose = Bench::new(&*backend, &xml, &[&format!("backlash@spin:width={width}")]);
        let angles = [&mut plain, &mut loose].map(|b| settle(b, 0.1, -0.2));
        // The weight pulls down: a positive rotation about y. The cosine changes little over the
        // offset.
        near(&plain.engine, angles[1] - angles[0], width / 2.0, 1e-3);
    }
}

#[test]
fn a_motor_crosses_the_play_and_takes_its_load_along() {
    let (rotor, width, torque) = (0.1, 0.2, 1.0);
    let xml = machine(r#"axis="0 0 1" armature="0.1""#, "motor");
    on_each(&xml, &[&format!("backlash@spin:width={width}")], |bench| {
        let push = bench.hold(200, &[torque]);
        let whole = INERTIA + rotor;
        let speed = torque * 200.0 * DT / whole;
        near(&bench.engine, push[199][1], speed, 1e-3);
        // The rotor turns back while the load continues as before.
        let back = bench.hold(500, &[-torque]);
        let crossing = (2.0 * width * rotor / torque).sqrt();
        let steps = (crossing / DT) as usize;
        near(&bench.engine, back[steps - 3][1], speed, 1e-3);
        assert!(
            back[steps + 3][1] < speed - 0.1,
            "{}: {:?}",
            bench.engine,
            back[steps + 3]
        );
        // No momentum is lost, and nothing bounces.
        near(
            &bench.engine,
            back[499][1],
            -torque * 300.0 * DT / whole,
            1e-3,
        );
    });
}

/// Asserts that a machine without a transmission and with nearly rigid ones has the same first
/// readings.
///
/// One uses backward Euler, the other the engine's own order, so they may differ by one step of
/// motion.
fn rigid_is_the_drive_itself(xml: &str, run: impl Fn(&mut Bench) -> Vec<Vec<f64>>) {
    for effect in [
        "joint-compliance@spin:compliance=1e-7",
        "backlash@spin:width=1e-7",
    ] {
        for backend in engines_for("backlash") {
            let rows =
                [&[][..], &[effect]].map(|effects| run(&mut Bench::new(&*backend, xml, effects)));
            for (plain, with) in rows[0].iter().zip(&rows[1]) {
                let what = format!("{effect}, {xml}, {}", backend.name());
                near(&what, with[0], plain[0], 0.01);
            }
        }
    }
}

fn sine(amplitude: f64, frames: usize) -> Vec<Vec<f64>> {
    let command = |k: usize| vec![amplitude * (0.05 * k as f64).sin()];
    (0..frames).map(command).collect()
}

const DRIVEN: &str = r#"axis="0 1 0" damping="0.3" armature="0.1""#;

#[test]
fn a_stiff_spring_and_no_play_are_the_drive_itself() {
    for drive in [
        STIFF,
        "motor",
        r#"velocity kv="5""#,
        r#"position kp="60" kv="2" forcerange="-4 4""#,
    ] {
        rigid_is_the_drive_itself(&machine(DRIVEN, drive), |bench| {
            bench.run(5, &sine(1.5, 100))
        });
    }
}

/// When a joint is set elsewhere, its rotor must move with it. Otherwise a spring of 10^7 N m/rad
/// would pull with 10^4 N m per milliradian.
#[test]
fn the_rotor_goes_along_where_its_joint_is_placed_elsewhere() {
    rigid_is_the_drive_itself(&machine(DRIVEN, STIFF), |bench| {
        let commands = sine(0.5, 60);
        bench.run(5, &commands[..30]);
        bench.state(&[0.151], &[0.7]);
        bench.run(5, &commands[30..])
    });
}

#[test]
fn a_spring_in_series_sags_under_the_load() {
    let (compliance, kp) = (0.02, 400.0);
    let xml = machine(r#"axis="0 1 0" damping="2""#, STIFF);
    on_each(
        &xml,
        &[&format!("joint-compliance@spin:compliance={compliance}")],
        |bench| {
            let angle = settle(bench, 0.0, 0.0);
            let load = 9.81 * 0.2 * angle.cos();
            near(&bench.engine, angle, load * (1.0 / kp + compliance), 1e-4);
        },
    );
}

/// Symptom: a servo at its force limit threw its elastic joint at the beginning of an episode.
///
/// Cause: its spring began wound by what the servo asked for, and not by what it can give.
#[test]
fn a_servo_at_its_limit_begins_with_a_spring_that_its_limit_winds() {
    let (limit, rotor) = (3.0, 0.02);
    let servo = r#"position kp="1000" kv="5" forcerange="-3 3""#;
    let xml = machine(r#"axis="0 0 1" armature="0.02""#, servo);
    on_each(&xml, &["joint-compliance@spin:compliance=0.01"], |bench| {
        let angle = bench.hold(200, &[1.0])[199][0];
        let time = 200.0 * DT;
        let expected = 0.5 * limit / (INERTIA + rotor) * time * time;
        near(&bench.engine, angle, expected, 0.01 * expected);
    });
}

#[test]
fn rotor_and_load_swing_against_each_other() {
    let (rotor, compliance, torque) = (0.1, 0.05, 1.0);
    let xml = machine(r#"axis="0 0 1" armature="0.1""#, "motor");
    let effect = format!("joint-compliance@spin:compliance={compliance}");
    on_each(&xml, &[&effect], |bench| {
        let rows = bench.hold(600, &[torque]);
        let mean = torque / (INERTIA + rotor);
        // The acceleration oscillates about its mean at sqrt(k (1/I + 1/J)).
        let above: Vec<bool> = rows
            .windows(2)
            .map(|w| (w[1][1] - w[0][1]) / DT > mean)
            .collect();
        let crossings: Vec<usize> = (1..above.len())
            .filter(|&k| above[k] != above[k - 1])
            .collect();
        let period = 2.0 * (crossings[4] - crossings[0]) as f64 / 4.0 * DT;
        let expected =
            std::f64::consts::TAU / (1.0 / compliance * (1.0 / INERTIA + 1.0 / rotor)).sqrt();
        near(&bench.engine, period, expected, 0.01 * expected);
    });
}

/// The oscillation decays by the transmission's own damping ratio.
///
/// The ratio is given for a rotor against a fixed joint. Where the joint yields, it is
/// `sqrt(1 + J/I)` of that. Backward Euler would add the stiffness times the time step.
#[test]
fn a_spring_in_series_swings_on_for_long() {
    let (rotor, compliance, loss) = (0.1, 0.05, 0.02);
    let xml = machine(r#"axis="0 0 1" armature="0.1""#, "motor");
    let effect = format!("joint-compliance@spin:compliance={compliance},loss={loss}");
    on_each(&xml, &[&effect], |bench| {
        bench.hold(30, &[1.0]);
        let rows = bench.hold(2100, &[0.0]);
        let swing = |rows: &[Vec<f64>]| {
            let speeds = rows.iter().map(|row| row[1]);
            let [low, high] = [f64::min, f64::max].map(|of| speeds.clone().reduce(of).unwrap());
            high - low
        };
        let [first, last] = [swing(&rows[..300]), swing(&rows[1800..])];
        let reduced = INERTIA * rotor / (INERTIA + rotor);
        let damper = 2.0 * loss * f64::sqrt(rotor / compliance);
        let rate = damper / (2.0 * reduced);
        let expected = f64::exp(-rate * 1800.0 * DT);
        near(&bench.engine, last / first, expected, 0.1 * expected);
    });
}

#[test]
fn without_rotor_inertia_a_motor_is_no_site() {
    let xml = machine(LEVEL, "motor");
    let spec: asid::effects::EffectSpec = "backlash@spin".parse().unwrap();
    let plant = asid::mjcf::Plant::of(&super::bench::scene(&xml)).unwrap();
    assert!(spec.find(&plant).is_err());
}
