//! Friction of contacts: sliding, rolling and torsional.

use asid_core::{Backend, Capabilities, Result};

use crate::check::Measure::Figure;
use crate::check::{Check, Tolerance};
use crate::rig::{G, Rig, STEP, broken, largest, last, relative};

const CONTACT: Capabilities = Capabilities::CONTACT.union(Capabilities::FREE_BODIES);
const ROLLING: Capabilities = CONTACT.union(Capabilities::ROLLING_FRICTION);
const TORSIONAL: Capabilities = CONTACT.union(Capabilities::TORSIONAL_FRICTION);

/// The checks of this family.
pub const CHECKS: &[Check] = &[
    Check {
        name: "friction/block-holds-on-an-incline",
        needs: CONTACT,
        unit: "m/s",
        tolerance: Tolerance::same(1e-4),
        reason: "softened friction creeps by (1 - d) a / (d b impratio) = 0.03 mm/s at the scene's impratio of 100: three times that",
        measure: Figure(incline_holds),
    },
    Check {
        name: "friction/block-slides-down-an-incline",
        needs: CONTACT,
        unit: "",
        tolerance: Tolerance::same(0.01),
        reason: "g (sin a - mu cos a) is a difference of near numbers: a thousandth of the friction is four thousandths of it",
        measure: Figure(incline_slides),
    },
    Check {
        name: "friction/stopping-distance",
        needs: CONTACT,
        unit: "",
        tolerance: Tolerance::same(0.01),
        reason: "first order in the step: mu g dt / v = 0.006 of v^2 / (2 mu g), and settling into contact",
        measure: Figure(stopping_distance),
    },
    Check {
        name: "friction/larger-of-the-pair-counts",
        needs: CONTACT,
        unit: "",
        tolerance: Tolerance::same(0.01),
        reason: "as stopping-distance",
        measure: Figure(larger_counts),
    },
    Check {
        name: "friction/same-in-every-direction",
        needs: CONTACT,
        unit: "",
        tolerance: Tolerance::same(0.01),
        reason: "Coulomb's cone is round: as stopping-distance, and no drift sideways",
        measure: Figure(every_direction),
    },
    Check {
        name: "friction/grip-holds-up-to-its-bound",
        needs: CONTACT
            .union(Capabilities::ARTICULATION)
            .union(Capabilities::ACTUATORS),
        unit: "",
        tolerance: Tolerance::same(0.0),
        reason: "two fingers carry 2 mu F: nine tenths of that stay, eleven tenths fall: wrong of two",
        measure: Figure(grip),
    },
    Check {
        name: "friction/sliding-ball-ends-rolling",
        needs: CONTACT,
        unit: "",
        tolerance: Tolerance::same(0.01),
        reason: "5/7 of the speed is left by momentum alone; contact gives way to a hundredth of the slip",
        measure: Figure(ends_rolling),
    },
    Check {
        name: "friction/ball-rolls-on-without-resistance",
        needs: CONTACT,
        unit: "",
        tolerance: Tolerance::same(2.3e-3),
        reason: "nothing slows a rolling ball; one sunk in by 0.4 mm of 50 rolls on a smaller radius: 2/7 of 0.8 %",
        measure: Figure(rolls_on),
    },
    Check {
        name: "friction/roll-out-distance",
        needs: ROLLING,
        unit: "",
        tolerance: Tolerance::same(0.01),
        reason: "v^2 / (2 a) with a = 5/7 mu_r g / R; the cone leaves sliding friction 0.9996 of rolling's part",
        measure: Figure(roll_out),
    },
    Check {
        name: "friction/ball-holds-on-a-slope",
        needs: ROLLING,
        unit: "m/s",
        tolerance: Tolerance::same(1e-3),
        reason: "below mu_r / R a ball stays: rolling friction is softened (R / mu_r)^2 times more than sliding, and at impratio 1000 creeps by 0.2 mm/s: five times that",
        measure: Figure(ball_holds),
    },
    Check {
        name: "friction/spin-down",
        needs: TORSIONAL,
        unit: "",
        tolerance: Tolerance::same(0.01),
        reason: "it turns by w^2 / (2 a), a = mu_t N / I: first order, a dt / w = 0.003, and as much for a step without a known N",
        measure: Figure(spin_down),
    },
    Check {
        name: "friction/spin-stops",
        needs: TORSIONAL,
        unit: "rad/s",
        tolerance: Tolerance::same(0.01),
        reason: "from 60 rad/s it stops after 0.6 s, and softened friction leaves nothing after 1 s",
        measure: Figure(spin_stops),
    },
];

/// The hardest friction that MJCF allows: an elliptic cone, a hundred times as stiff as the normal.
const ROUND: &str = r#"cone="elliptic" impratio="100""#;

/// A box of 0.5 kg on a plane with gravity tilted by `angle` towards x.
fn block(backend: &dyn Backend, plane: f64, own: f64, angle: f64) -> Result<Rig> {
    let (sin, cos) = angle.sin_cos();
    let inside = format!(
        r#"<option {ROUND} gravity="{} 0 {}"/><worldbody>
        <geom type="plane" size="5 5 .1" friction="{plane}"/>
        <body pos="0 0 0.05"><freejoint name="b"/>
          <geom type="box" size=".1 .08 .05" mass="0.5" friction="{own}"/></body></worldbody>"#,
        G * sin,
        -G * cos
    );
    Rig::new(backend, &inside, &["qpos.b", "qvel.b"])
}

fn incline_holds(backend: &dyn Backend) -> Result<f64> {
    let mut rig = block(backend, 0.3, 0.1, 0.97 * 0.3f64.atan())?;
    let rows = rig.run(1000, &[])?;
    Ok(rows[999][0] - rows[499][0])
}

fn incline_slides(backend: &dyn Backend) -> Result<f64> {
    let angle = 1.3 * 0.3f64.atan();
    let mut rig = block(backend, 0.3, 0.1, angle)?;
    let rows = rig.run(500, &[])?;
    // The second difference of positions; velocities of a soft contact fluctuate.
    let found = (rows[499][0] - 2.0 * rows[299][0] + rows[99][0]) / (200.0 * STEP).powi(2);
    Ok(relative(found, G * (angle.sin() - 0.3 * angle.cos())))
}

/// Height at which a body has settled in its soft contact after 0.3 s.
fn settled(rig: &mut Rig) -> Result<f64> {
    Ok(last(&rig.run(150, &[])?)?[2])
}

/// Position at which a block with 1 m/s stops. It moves at an angle of `heading` from x and is
/// rotated by `yaw`.
fn stop(backend: &dyn Backend, plane: f64, own: f64, heading: f64, yaw: f64) -> Result<[f64; 2]> {
    let mut rig = block(backend, plane, own, 0.0)?;
    let half = 0.5 * yaw;
    let height = settled(&mut rig)?;
    rig.place(
        &[0.0, 0.0, height, half.cos(), 0.0, 0.0, half.sin()],
        &[heading.cos(), heading.sin(), 0.0, 0.0, 0.0, 0.0],
    )?;
    let rows = rig.run(600, &[])?;
    let end = last(&rows)?;
    Ok([end[0], end[1]])
}

fn stopping_distance(backend: &dyn Backend) -> Result<f64> {
    let mut errors = Vec::new();
    for friction in [0.1, 0.2, 0.5] {
        let [x, _] = stop(backend, friction, friction, 0.0, 0.0)?;
        errors.push(relative(x, 1.0 / (2.0 * friction * G)));
    }
    Ok(largest(errors))
}

fn larger_counts(backend: &dyn Backend) -> Result<f64> {
    let theory = 1.0 / (2.0 * 0.4 * G);
    let [plane, _] = stop(backend, 0.4, 0.1, 0.0, 0.0)?;
    let [own, _] = stop(backend, 0.1, 0.4, 0.0, 0.0)?;
    Ok(largest([relative(plane, theory), relative(own, theory)]))
}

fn every_direction(backend: &dyn Backend) -> Result<f64> {
    let theory = 1.0 / (2.0 * 0.3 * G);
    let mut errors = Vec::new();
    for (heading, yaw) in [(0.5f64, 0.0), (0.8, 0.8), (0.0, 1.1)] {
        let [x, y] = stop(backend, 0.3, 0.3, heading, yaw)?;
        let along = x * heading.cos() + y * heading.sin();
        let aside = y * heading.cos() - x * heading.sin();
        errors.extend([relative(along, theory), aside / theory]);
    }
    Ok(largest(errors))
}

/// Two fingers press a box of 0.5 kg from both sides; it stays or slips.
fn grip(backend: &dyn Backend) -> Result<f64> {
    let finger = |name: &str, side: f64| {
        format!(
            r#"<body pos="{} 0 0"><joint name="{name}" type="slide" axis="{} 0 0"/>
            <geom type="box" size=".01 .05 .05" mass="0.1" friction="0.4"/></body>"#,
            -0.06 * side,
            side
        )
    };
    let inside = format!(
        r#"<option {ROUND}/><worldbody>{}{}
        <body><freejoint name="box"/><geom type="box" size=".05 .03 .03" mass="0.5" friction="0.4"/></body></worldbody>
        <actuator><motor joint="l"/><motor joint="r"/></actuator>"#,
        finger("l", 1.0),
        finger("r", -1.0)
    );
    let mut held = [false; 2];
    for (held, share) in held.iter_mut().zip([0.9, 1.1]) {
        let mut rig = Rig::new(backend, &inside, &["qpos.box"])?;
        let force = 0.5 * G / (2.0 * 0.4 * share);
        let rows = rig.run(250, &[force, force])?;
        // At a share of 1.1 it falls by (1 - 1 / 1.1) g t^2 / 2 = 0.1 m in half a second.
        *held = last(&rows)?[2] > -0.01;
    }
    Ok(broken([held[0], !held[1]]))
}

/// Radius of the ball, m.
const RADIUS: f64 = 0.05;

/// A ball of 0.3 kg on a plane; `push` is gravity along x.
fn ball(backend: &dyn Backend, condim: u32, friction: &str, push: f64) -> Result<Rig> {
    let inside = format!(
        r#"<option cone="elliptic" impratio="1000" gravity="{push} 0 -{G}"/><worldbody>
        <geom type="plane" size="5 5 .1" condim="{condim}" friction="{friction}"/>
        <body pos="0 0 {RADIUS}"><freejoint name="b"/>
          <geom type="sphere" size="{RADIUS}" mass="0.3" friction="0.01 0 0"/></body></worldbody>"#
    );
    Rig::new(backend, &inside, &["qpos.b", "qvel.b"])
}

/// Gives a settled ball a velocity.
fn launch(rig: &mut Rig, qvel: [f64; 6]) -> Result<()> {
    let height = settled(rig)?;
    rig.place(&[0.0, 0.0, height, 1.0, 0.0, 0.0, 0.0], &qvel)
}

fn ends_rolling(backend: &dyn Backend) -> Result<f64> {
    let mut rig = ball(backend, 3, "0.4 0 0", 0.0)?;
    launch(&mut rig, [0.7, 0.0, 0.0, 0.0, 0.0, 0.0])?;
    let rows = rig.run(500, &[])?;
    let end = last(&rows)?;
    let rolling = [relative(end[7], 0.5), relative(end[11] * RADIUS, 0.5)];
    Ok(largest(rolling))
}

fn rolls_on(backend: &dyn Backend) -> Result<f64> {
    let mut rig = ball(backend, 3, "1 0.01 0.004", 0.0)?;
    launch(&mut rig, [0.5, 0.0, 0.0, 0.0, 10.0, 0.0])?;
    Ok(relative(last(&rig.run(500, &[])?)?[7], 0.5))
}

fn roll_out(backend: &dyn Backend) -> Result<f64> {
    let mut errors = Vec::new();
    for rolling in [0.002, 0.004] {
        let mut rig = ball(backend, 6, &format!("1 0 {rolling}"), 0.0)?;
        launch(&mut rig, [0.5, 0.0, 0.0, 0.0, 10.0, 0.0])?;
        let rows = rig.run(1250, &[])?;
        let theory = 0.25 / (2.0 * 5.0 / 7.0 * rolling * G / RADIUS);
        errors.push(relative(last(&rows)?[0], theory));
    }
    Ok(largest(errors))
}

fn ball_holds(backend: &dyn Backend) -> Result<f64> {
    let mut rig = ball(backend, 6, "1 0 0.002", 0.8 * 0.002 / RADIUS * G)?;
    let rows = rig.run(1000, &[])?;
    Ok(rows[999][0] - rows[499][0])
}

/// A ball that spins at 60 rad/s about the vertical at first: its rate over one second.
fn spinning(backend: &dyn Backend) -> Result<Vec<f64>> {
    let mut rig = ball(backend, 4, "1 0.01 0", 0.0)?;
    launch(&mut rig, [0.0, 0.0, 0.0, 0.0, 0.0, 60.0])?;
    Ok(rig.run(500, &[])?.iter().map(|row| row[12]).collect())
}

fn spin_down(backend: &dyn Backend) -> Result<f64> {
    let rates = spinning(backend)?;
    let turned = rates.iter().map(|rate| rate * STEP).sum::<f64>();
    let slowing = 0.01 * G / (0.4 * RADIUS * RADIUS);
    Ok(relative(turned, 60.0 * 60.0 / (2.0 * slowing)))
}

fn spin_stops(backend: &dyn Backend) -> Result<f64> {
    Ok(spinning(backend)?[499])
}
