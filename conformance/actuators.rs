//! Motors and servos, their gains and limits.

use asid_core::{Backend, Capabilities, Result};

use crate::check::Measure::Figure;
use crate::check::{Check, Tolerance};
use crate::rig::{Rig, STEP, largest, last, relative};

const DRIVEN: Capabilities = Capabilities::ARTICULATION.union(Capabilities::ACTUATORS);

/// The checks of this family.
pub const CHECKS: &[Check] = &[
    Check {
        name: "actuators/servo-step-response",
        needs: DRIVEN,
        unit: "",
        tolerance: Tolerance::same(0.01),
        reason: "first order in the step: w dt / 2 of the step at w = 10 rad/s",
        measure: Figure(step_response),
    },
    Check {
        name: "actuators/stiff-servo-response",
        needs: DRIVEN,
        unit: "",
        tolerance: Tolerance::same(0.01),
        reason: "kp = 4000, kv = 400 on 0.1 kg m^2, an implicit integrator: first order, slow rate 10 /s times dt / 2",
        measure: Figure(stiff_response),
    },
    Check {
        name: "actuators/stiff-servo-rests-on-target",
        needs: DRIVEN,
        unit: "rad",
        tolerance: Tolerance::by_precision(1e-6, 1e-5),
        reason: "20 slow time constants leave exp(-20), and rounding",
        measure: Figure(stiff_rest),
    },
    Check {
        name: "actuators/servo-sags-under-load",
        needs: DRIVEN,
        unit: "",
        tolerance: Tolerance::by_precision(1e-6, 1e-4),
        reason: "at rest kp times the error is the load: rounding",
        measure: Figure(sag),
    },
    Check {
        name: "actuators/gains-of-a-class",
        needs: DRIVEN,
        unit: "",
        tolerance: Tolerance::same(0.01),
        reason: "kp and kv from the element, its class and the class around that make the response of servo-step-response: first order, w dt / 2 of the step",
        measure: Figure(class_gains),
    },
    Check {
        name: "actuators/force-limit",
        needs: DRIVEN,
        unit: "",
        tolerance: Tolerance::by_precision(1e-9, 1e-4),
        reason: "beyond its limit a servo is a constant force, whose acceleration is exact: rounding",
        measure: Figure(force_limit),
    },
    Check {
        name: "actuators/command-limit",
        needs: DRIVEN,
        unit: "",
        tolerance: Tolerance::by_precision(1e-9, 1e-4),
        reason: "a command beyond its range acts like the end of the range: rounding",
        measure: Figure(command_limit),
    },
    Check {
        name: "actuators/velocity-servo",
        needs: DRIVEN,
        unit: "",
        tolerance: Tolerance::same(0.01),
        reason: "approach with rate kv / I = 10 /s: first order, rate times dt / 2",
        measure: Figure(velocity_servo),
    },
    Check {
        name: "actuators/gear-of-a-motor",
        needs: DRIVEN,
        unit: "",
        tolerance: Tolerance::by_precision(1e-9, 1e-4),
        reason: "torque is gear times command, constant: rounding",
        measure: Figure(motor_gear),
    },
    Check {
        name: "actuators/gear-of-a-servo",
        needs: DRIVEN,
        unit: "rad",
        tolerance: Tolerance::by_precision(1e-6, 1e-5),
        reason: "the servo holds gear times angle at the command: exp(-20) after 20 slow time constants",
        measure: Figure(servo_gear),
    },
    Check {
        name: "actuators/each-acts-on-its-joint",
        needs: DRIVEN,
        unit: "",
        tolerance: Tolerance::by_precision(1e-9, 1e-4),
        reason: "commands in the order of the actuators reach the joints that these name: rounding",
        measure: Figure(own_joint),
    },
];

/// A wheel of 0.1 kg m² on a hinge without gravity, with one actuator.
fn wheel(backend: &dyn Backend, actuator: &str) -> Result<Rig> {
    let inside = format!(
        r#"<option gravity="0 0 0" integrator="implicitfast"/><worldbody><body>
        <joint name="j" axis="0 0 1"/>
        <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body></worldbody>
        <actuator>{actuator}</actuator>"#
    );
    Rig::new(backend, &inside, &["qpos.j", "qvel.j"])
}

/// Three wheels of 0.1 kg m² on the hinges a, b and c.
fn wheels() -> String {
    let wheel = |name: &&str| {
        format!(
            r#"<body><joint name="{name}" axis="0 0 1"/>
            <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body>"#
        )
    };
    ["a", "b", "c"].iter().map(wheel).collect()
}

/// What is left of a step after some frames, by 0.1 q'' + 1 q' + 10 q = 10.
fn left(frames: usize) -> f64 {
    let (omega, zeta) = (10.0, 0.5f64);
    let damped = omega * (1.0 - zeta * zeta).sqrt();
    let t = frames as f64 * STEP;
    let (sin, cos) = (damped * t).sin_cos();
    (-zeta * omega * t).exp() * (cos + zeta * omega / damped * sin)
}

fn step_response(backend: &dyn Backend) -> Result<f64> {
    let mut rig = wheel(backend, r#"<position joint="j" kp="10" kv="1"/>"#)?;
    let rows = rig.run(500, &[1.0])?;
    let rows = rows.iter().enumerate();
    Ok(largest(rows.map(|(i, row)| row[0] - 1.0 + left(i + 1))))
}

/// The same servo three times, whose gains a document states in other places.
fn class_gains(backend: &dyn Backend) -> Result<f64> {
    let inside = format!(
        r#"<option gravity="0 0 0" integrator="implicitfast"/>
        <default><position kp="4" kv="1"/>
          <default class="stiff"><position kp="10"/></default>
          <default class="damped"><position kp="10" kv="7"/></default></default>
        <worldbody>{}</worldbody>
        <actuator><position joint="a" kp="10"/><position joint="b" class="stiff"/>
          <position joint="c" class="damped" kv="1"/></actuator>"#,
        wheels()
    );
    let mut rig = Rig::new(backend, &inside, &["qpos.a", "qpos.b", "qpos.c"])?;
    let rows = rig.run(250, &[1.0; 3])?;
    let all = rows.iter().enumerate();
    Ok(largest(all.flat_map(|(i, row)| {
        row.iter().map(move |angle| angle - 1.0 + left(i + 1))
    })))
}

/// A stiff servo during two seconds after a step to 0.3 rad.
fn stiff(backend: &dyn Backend) -> Result<Vec<Vec<f64>>> {
    let mut rig = wheel(backend, r#"<position joint="j" kp="4000" kv="400"/>"#)?;
    rig.run(1000, &[0.3])
}

fn stiff_response(backend: &dyn Backend) -> Result<f64> {
    // Roots of 0.1 s^2 + 400 s + 4000, which are far apart.
    let root = (400f64 * 400.0 - 4.0 * 0.1 * 4000.0).sqrt();
    let (slow, fast) = ((400.0 - root) / 0.2, (400.0 + root) / 0.2);
    Ok(largest(stiff(backend)?.iter().enumerate().map(
        |(i, row)| {
            let t = (i + 1) as f64 * STEP;
            let left = (fast * (-slow * t).exp() - slow * (-fast * t).exp()) / (fast - slow);
            row[0] / 0.3 - 1.0 + left
        },
    )))
}

fn stiff_rest(backend: &dyn Backend) -> Result<f64> {
    Ok(last(&stiff(backend)?)?[0] - 0.3)
}

/// An arm of 1 kg at half a metre that a servo holds horizontal.
fn sag(backend: &dyn Backend) -> Result<f64> {
    let inside = r#"<option integrator="implicitfast"/><worldbody><body><joint name="j" axis="0 1 0"/>
      <inertial pos="0.5 0 0" mass="1" diaginertia="0.01 0.01 0.01"/></body></worldbody>
      <actuator><position joint="j" kp="400" kv="40"/></actuator>"#;
    let mut rig = Rig::new(backend, inside, &["qpos.j"])?;
    let angle = last(&rig.run(2000, &[0.0])?)?[0];
    // Gravity rotates the arm down, towards positive angles about y.
    Ok(relative(400.0 * angle, 0.5 * 9.81 * angle.cos()))
}

fn force_limit(backend: &dyn Backend) -> Result<f64> {
    let mut rig = wheel(
        backend,
        r#"<position joint="j" kp="1000" kv="10" forcerange="-0.2 0.2"/>"#,
    )?;
    Ok(relative(
        last(&rig.run(100, &[1.0])?)?[1],
        2.0 * 100.0 * STEP,
    ))
}

fn command_limit(backend: &dyn Backend) -> Result<f64> {
    let mut rig = wheel(backend, r#"<motor joint="j" ctrlrange="-0.5 0.25"/>"#)?;
    let up = last(&rig.run(50, &[3.0])?)?[1] / 0.1;
    rig.simulator.reset(&[0])?;
    let down = last(&rig.run(50, &[-3.0])?)?[1] / 0.1;
    Ok(largest([relative(up, 2.5), relative(down, -5.0)]))
}

fn velocity_servo(backend: &dyn Backend) -> Result<f64> {
    let mut rig = wheel(backend, r#"<velocity joint="j" kv="1"/>"#)?;
    let rows = rig.run(500, &[2.0])?;
    Ok(largest(rows.iter().enumerate().map(|(i, row)| {
        let t = (i + 1) as f64 * STEP;
        row[1] / 2.0 - 1.0 + (-10.0 * t).exp()
    })))
}

fn motor_gear(backend: &dyn Backend) -> Result<f64> {
    let mut rig = wheel(backend, r#"<motor joint="j" gear="-3"/>"#)?;
    Ok(relative(last(&rig.run(50, &[0.5])?)?[1], -15.0 * 0.1))
}

fn servo_gear(backend: &dyn Backend) -> Result<f64> {
    let mut rig = wheel(
        backend,
        r#"<position joint="j" kp="1000" kv="100" gear="2"/>"#,
    )?;
    Ok(last(&rig.run(1000, &[0.6])?)?[0] - 0.3)
}

fn own_joint(backend: &dyn Backend) -> Result<f64> {
    // The motors come in another order than their wheels.
    let inside = format!(
        r#"<option gravity="0 0 0"/><worldbody>{}</worldbody>
        <actuator><motor name="mc" joint="c"/><motor name="ma" joint="a"/><motor name="mb" joint="b"/></actuator>"#,
        wheels()
    );
    let mut rig = Rig::new(backend, &inside, &["qvel.a", "qvel.b", "qvel.c"])?;
    let rows = rig.run(50, &[1.0, 2.0, 3.0])?;
    let end = last(&rows)?;
    Ok(largest(
        [2.0, 3.0, 1.0]
            .iter()
            .zip(end)
            .map(|(&t, &v)| relative(v, t)),
    ))
}
