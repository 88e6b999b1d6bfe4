//! Free motion and kinematic trees without contact.

use asid_core::{Backend, Capabilities, Result};
use nalgebra::{Matrix2, UnitQuaternion, Vector2, Vector3};

use crate::check::Measure::Figure;
use crate::check::{Check, Tolerance};
use crate::rig::{G, Rig, STEP, largest, last, period, relative};

const FREE: Capabilities = Capabilities::FREE_BODIES;
const TREE: Capabilities = Capabilities::ARTICULATION;

/// The checks of this family.
pub const CHECKS: &[Check] = &[
    Check {
        name: "dynamics/free-fall-position",
        needs: FREE,
        unit: "m",
        tolerance: Tolerance::same(1.02 * G * STEP / 2.0),
        reason: "a first-order integrator is off by at most g dt t / 2 after t = 1 s",
        measure: Figure(free_fall_position),
    },
    Check {
        name: "dynamics/free-fall-velocity",
        needs: FREE,
        unit: "m/s",
        tolerance: Tolerance::by_precision(1e-11, 3e-4),
        reason: "constant acceleration is exact: rounding of 500 additions at 10 m/s",
        measure: Figure(free_fall_velocity),
    },
    Check {
        name: "dynamics/free-tumbling-momentum",
        needs: FREE,
        unit: "",
        tolerance: Tolerance::same(0.027),
        reason: "first order in the step: w^2 dt t / 2 at w = 5.2 rad/s after t = 1 s",
        measure: Figure(tumbling_momentum),
    },
    Check {
        name: "dynamics/momentum-of-a-thrown-arm",
        needs: FREE.union(TREE),
        unit: "m/s",
        tolerance: Tolerance::same(0.021),
        reason: "velocities belong to the pose of a step before: w dt of 1 m/s at w = 10 rad/s",
        measure: Figure(thrown_arm),
    },
    Check {
        name: "dynamics/pendulum-energy",
        needs: TREE,
        unit: "",
        tolerance: Tolerance::same(0.01),
        reason: "a symplectic integrator of first order strays by w dt = 0.009 of the swing, and does not drift",
        measure: Figure(pendulum_energy),
    },
    Check {
        name: "dynamics/pendulum-period",
        needs: TREE,
        unit: "",
        tolerance: Tolerance::same(2e-4),
        reason: "second order in the step: (w dt)^2 = 8e-5, and crossings read between steps",
        measure: Figure(pendulum_period),
    },
    Check {
        name: "dynamics/unit-torque-on-a-hinge",
        needs: TREE.union(Capabilities::ACTUATORS),
        unit: "",
        tolerance: Tolerance::by_precision(1e-9, 1e-4),
        reason: "from rest, constant acceleration is exact: rounding",
        measure: Figure(unit_torque),
    },
    Check {
        name: "dynamics/inertia-of-shapes",
        needs: TREE.union(Capabilities::ACTUATORS),
        unit: "",
        tolerance: Tolerance::by_precision(1e-9, 1e-4),
        reason: "mass and inertia of turned shapes by density, from textbook formulas: rounding",
        measure: Figure(inertia_of_shapes),
    },
    Check {
        name: "dynamics/unit-force-on-a-slide",
        needs: TREE.union(Capabilities::ACTUATORS),
        unit: "",
        tolerance: Tolerance::by_precision(1e-9, 1e-4),
        reason: "constant acceleration is exact: rounding",
        measure: Figure(unit_force),
    },
    Check {
        name: "dynamics/coupled-links",
        needs: TREE.union(Capabilities::ACTUATORS),
        unit: "",
        tolerance: Tolerance::by_precision(1e-4, 2e-4),
        reason: "one step from rest is the inverse of the mass matrix times the torque: an integrator may see that the links turn by 1e-4 rad within it, at up to 0.09 rad/s",
        measure: Figure(coupled_links),
    },
    Check {
        name: "dynamics/coriolis",
        needs: TREE,
        unit: "",
        tolerance: Tolerance::same(0.01),
        reason: "first order in the step: w dt = 0.01 of the angular momentum at w = 5 rad/s",
        measure: Figure(coriolis),
    },
    Check {
        name: "dynamics/ball-joint",
        needs: TREE,
        unit: "rad",
        tolerance: Tolerance::by_precision(1e-9, 2e-4),
        reason: "constant rate is integrated exactly: rounding of 500 quaternion products",
        measure: Figure(ball_joint),
    },
];

fn falling(backend: &dyn Backend) -> Result<Vec<f64>> {
    let inside = r#"<worldbody><body name="b" pos="0 0 10"><freejoint name="b"/>
      <geom type="sphere" size=".1" mass="1" contype="0" conaffinity="0"/></body></worldbody>"#;
    let mut rig = Rig::new(backend, inside, &["qpos.b", "qvel.b"])?;
    rig.place(
        &[0.0, 0.0, 10.0, 1.0, 0.0, 0.0, 0.0],
        &[1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    )?;
    Ok(last(&rig.run(500, &[])?)?.to_vec())
}

fn free_fall_position(backend: &dyn Backend) -> Result<f64> {
    let end = falling(backend)?;
    let theory = [1.0, 0.0, 10.0 - G / 2.0];
    Ok(largest((0..3).map(|i| end[i] - theory[i])))
}

fn free_fall_velocity(backend: &dyn Backend) -> Result<f64> {
    let end = falling(backend)?;
    let theory = [1.0, 0.0, -G, 0.0, 0.0, 0.0];
    Ok(largest((0..6).map(|i| end[7 + i] - theory[i])))
}

/// Angular momentum of a tumbling box in the world, after one second without torque.
fn tumbling_momentum(backend: &dyn Backend) -> Result<f64> {
    let inside = r#"<option gravity="0 0 0"/><worldbody><body name="b"><freejoint name="b"/>
      <inertial pos="0 0 0" mass="1" diaginertia="0.01 0.02 0.025"/></body></worldbody>"#;
    let mut rig = Rig::new(backend, inside, &["qpos.b", "qvel.b"])?;
    let rate = Vector3::new(1.0, 5.0, 1.0);
    let inertia = Vector3::new(0.01, 0.02, 0.025);
    rig.place(
        &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
        &[0.0, 0.0, 0.0, rate.x, rate.y, rate.z],
    )?;
    let before = inertia.component_mul(&rate);
    let rows = rig.run(500, &[])?;
    let end = last(&rows)?;
    let attitude =
        UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(end[3], end[4], end[5], end[6]));
    let after = attitude * inertia.component_mul(&Vector3::new(end[10], end[11], end[12]));
    Ok((after - before).norm() / before.norm())
}

/// A free body with a swinging arm: its centre of mass moves on a straight line.
fn thrown_arm(backend: &dyn Backend) -> Result<f64> {
    let inside = r#"<option gravity="0 0 0"/><worldbody>
      <body name="a"><freejoint name="a"/><inertial pos="0 0 0" mass="2" diaginertia=".02 .02 .02"/>
        <body name="b"><joint name="j" axis="0 0 1"/>
          <inertial pos="0.2 0 0" mass="2" diaginertia=".01 .01 .01"/></body></body></worldbody>
      <sensor><framelinvel name="va" objtype="body" objname="a"/>
        <framelinvel name="vb" objtype="body" objname="b"/></sensor>"#;
    let mut rig = Rig::new(backend, inside, &["va", "vb"])?;
    rig.place(
        &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0],
        &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 10.0],
    )?;
    // Half of the mass moves at 2 m/s along y, so the centre of mass moves at 1 m/s.
    let rows = rig.run(500, &[])?;
    let end = last(&rows)?;
    let center = |i: usize| 0.5 * (end[i] + end[3 + i]);
    Ok(largest([center(0), center(1) - 1.0, center(2)]))
}

/// Inertia of the pendulum about its axis, kg m²: 1 kg at 0.5 m, plus that of its ball.
const PENDULUM_INERTIA: f64 = 0.25 + 0.4 * 0.02 * 0.02;

/// A bob of 1 kg on half a metre, released at 1 rad: 10 s of angle and rate.
fn pendulum(backend: &dyn Backend) -> Result<Vec<Vec<f64>>> {
    let inside = r#"<worldbody><body pos="0 0 1"><joint name="j" axis="0 1 0"/>
      <geom type="sphere" size=".02" pos="0 0 -0.5" mass="1" contype="0" conaffinity="0"/></body></worldbody>"#;
    let mut rig = Rig::new(backend, inside, &["qpos.j", "qvel.j"])?;
    rig.place(&[1.0], &[0.0])?;
    rig.run(5000, &[])
}

fn pendulum_energy(backend: &dyn Backend) -> Result<f64> {
    let swing = 0.5 * G * (1.0 - 1f64.cos());
    let energy = |r: &Vec<f64>| 0.5 * PENDULUM_INERTIA * r[1] * r[1] + 0.5 * G * (1.0 - r[0].cos());
    Ok(largest(
        pendulum(backend)?.iter().map(|r| energy(r) / swing - 1.0),
    ))
}

fn pendulum_period(backend: &dyn Backend) -> Result<f64> {
    // The complete elliptic integral by the arithmetic-geometric mean.
    let (mut a, mut b) = (1.0, 0.5f64.cos());
    for _ in 0..6 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    let theory = std::f64::consts::TAU * (PENDULUM_INERTIA / (0.5 * G)).sqrt() / a;
    let angles: Vec<f64> = pendulum(backend)?.iter().map(|r| r[0]).collect();
    Ok(relative(period(&angles, 0.0), theory))
}

fn unit_torque(backend: &dyn Backend) -> Result<f64> {
    let inside = r#"<option gravity="0 0 0"/><worldbody><body><joint name="j" axis="0 0 1"/>
      <geom type="box" size=".1 .15 .2" pos="0.5 0 0" mass="2" contype="0" conaffinity="0"/></body></worldbody>
      <actuator><motor joint="j"/></actuator>"#;
    let mut rig = Rig::new(backend, inside, &["qvel.j"])?;
    let inertia = 2.0 * 0.25 + 2.0 * (0.2 * 0.2 + 0.3 * 0.3) / 12.0;
    Ok(relative(last(&rig.run(50, &[1.0])?)?[0], 0.1 / inertia))
}

/// Shapes of 800 kg/m³ at half a metre from a hinge about z, with their axis along x.
fn inertia_of_shapes(backend: &dyn Backend) -> Result<f64> {
    let pi = std::f64::consts::PI;
    let density = 800.0;
    let sphere = density * 4.0 / 3.0 * pi * 0.1f64.powi(3);
    let cuboid = density * 8.0 * 0.1 * 0.15 * 0.2;
    let (r, h) = (0.05f64, 0.3);
    let cylinder = density * pi * r * r * h;
    let caps = density * 4.0 / 3.0 * pi * r.powi(3);
    let across = cylinder * (3.0 * r * r + h * h) / 12.0;
    // Two half balls, whose centres lie 3/8 r beyond the ends of the cylinder.
    let half_balls = caps * (0.4 * r * r + 0.25 * h * h + 0.375 * r * h);
    let shapes = [
        ("sphere", ".1", sphere, 0.4 * sphere * 0.01),
        // After the rotation to x, its z side lies along x and its x side along -z.
        (
            "box",
            ".1 .15 .2",
            cuboid,
            cuboid * (0.4 * 0.4 + 0.3 * 0.3) / 12.0,
        ),
        ("cylinder", ".05 .15", cylinder, across),
        ("capsule", ".05 .15", cylinder + caps, across + half_balls),
    ];
    let mut errors = Vec::new();
    for (shape, size, mass, inertia) in shapes {
        let inside = format!(
            r#"<option gravity="0 0 0"/><worldbody><body><joint name="j" axis="0 0 1"/>
            <geom type="{shape}" size="{size}" pos=".5 0 0" zaxis="1 0 0" density="{density}"
              contype="0" conaffinity="0"/></body></worldbody>
            <actuator><motor joint="j"/></actuator>"#
        );
        let mut rig = Rig::new(backend, &inside, &["qvel.j"])?;
        let rows = rig.run(50, &[1.0])?;
        errors.push(relative(last(&rows)?[0], 0.1 / (inertia + 0.25 * mass)));
    }
    Ok(largest(errors))
}

fn unit_force(backend: &dyn Backend) -> Result<f64> {
    let inside = r#"<option gravity="0 0 0"/><worldbody><body>
      <joint name="j" type="slide" axis="0.6 0 0.8"/>
      <geom type="sphere" size=".1" mass="2" contype="0" conaffinity="0"/></body></worldbody>
      <actuator><motor joint="j"/></actuator>"#;
    let mut rig = Rig::new(backend, inside, &["qvel.j"])?;
    Ok(relative(last(&rig.run(50, &[1.0])?)?[0], 0.05))
}

/// Two links at a right angle, with a torque on each.
fn coupled_links(backend: &dyn Backend) -> Result<f64> {
    let inside = r#"<option gravity="0 0 0"/><worldbody>
      <body><joint name="a" axis="0 0 1"/><inertial pos=".2 0 0" mass="1" diaginertia=".01 .01 .01"/>
        <body pos=".4 0 0"><joint name="b" axis="0 0 1"/>
          <inertial pos=".15 0 0" mass=".5" diaginertia=".004 .004 .004"/></body></body></worldbody>
      <actuator><motor joint="a"/><motor joint="b"/></actuator>"#;
    let mut rig = Rig::new(backend, inside, &["qvel.a", "qvel.b"])?;
    let bend = 1.2f64;
    rig.place(&[0.3, bend], &[0.0, 0.0])?;
    let rows = rig.run(1, &[0.7, -0.4])?;
    let (m, l, c) = (0.5, 0.4, 0.15);
    let far = 0.004 + m * c * c;
    let cross = m * l * c * bend.cos();
    let near = 0.01 + 1.0 * 0.2 * 0.2 + m * l * l + far + 2.0 * cross;
    let mass = Matrix2::new(near, far + cross, far + cross, far);
    let theory = mass.try_inverse().map_or(Vector2::zeros(), |inverse| {
        inverse * Vector2::new(0.7, -0.4) * STEP
    });
    let found = Vector2::new(rows[0][0], rows[0][1]);
    Ok((found - theory).norm() / theory.norm())
}

/// A bead that slides outwards along a rotating rod: angular momentum is conserved.
fn coriolis(backend: &dyn Backend) -> Result<f64> {
    let inside = r#"<option gravity="0 0 0"/><worldbody>
      <body><joint name="turn" axis="0 0 1"/><inertial pos="0 0 0" mass="1" diaginertia=".1 .1 .1"/>
        <body><joint name="out" type="slide" axis="1 0 0"/>
          <inertial pos="0 0 0" mass="1" diaginertia="1e-4 1e-4 1e-4"/></body></body></worldbody>"#;
    let mut rig = Rig::new(backend, inside, &["qpos.out", "qvel.turn"])?;
    rig.place(&[0.0, 0.2], &[5.0, 0.0])?;
    let momentum = |r: f64, w: f64| (0.1 + 1e-4 + r * r) * w;
    let rows = rig.run(250, &[])?;
    let end = last(&rows)?;
    Ok(relative(momentum(end[0], end[1]), momentum(0.2, 5.0)))
}

/// An isotropic body on a ball joint rotates at a constant rate.
fn ball_joint(backend: &dyn Backend) -> Result<f64> {
    let inside = r#"<option gravity="0 0 0"/><worldbody><body><joint name="j" type="ball"/>
      <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body></worldbody>"#;
    let mut rig = Rig::new(backend, inside, &["qpos.j"])?;
    let start = UnitQuaternion::from_euler_angles(0.3, -0.2, 0.5);
    let rate = Vector3::new(0.4, 1.0, -0.6);
    rig.place(&[start.w, start.i, start.j, start.k], rate.as_slice())?;
    let rows = rig.run(500, &[])?;
    let end = last(&rows)?;
    let found =
        UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(end[0], end[1], end[2], end[3]));
    let theory = start * UnitQuaternion::from_scaled_axis(rate);
    Ok(theory.angle_to(&found))
}
