//! Contact along the normal: rest height, weight, stacks, edges, collisions.

use asid_core::{Backend, Capabilities, Result};

use crate::check::Measure::Figure;
use crate::check::{Check, Tolerance};
use crate::rig::{G, Rig, broken, differing_bits, largest, last, relative};

const CONTACT: Capabilities = Capabilities::CONTACT.union(Capabilities::FREE_BODIES);
const FORCES: Capabilities = CONTACT.union(Capabilities::CONTACT_FORCES);

/// The checks of this family.
pub const CHECKS: &[Check] = &[
    Check {
        name: "contact/rest-height-of-shapes",
        needs: CONTACT,
        unit: "m",
        tolerance: Tolerance::same(5e-4),
        reason: "the default softness (20 ms, d = 0.9) yields (1 - d) g / (d k) = 0.4 mm",
        measure: Figure(rest_heights),
    },
    Check {
        name: "contact/rest-height-of-a-mesh",
        needs: CONTACT.union(Capabilities::MESHES),
        unit: "m",
        tolerance: Tolerance::same(5e-4),
        reason: "as contact/rest-height-of-shapes",
        measure: Figure(mesh_height),
    },
    Check {
        name: "contact/rest-is-still",
        needs: CONTACT,
        unit: "m/s",
        tolerance: Tolerance::same(1e-4),
        reason: "50 time constants of contact after the start nothing is left: g dt / 200",
        measure: Figure(rest_is_still),
    },
    Check {
        name: "contact/rest-does-not-wander",
        needs: CONTACT,
        unit: "m",
        tolerance: Tolerance::same(1e-5),
        reason: "nothing pushes sideways: rounding of a solver in 1000 steps",
        measure: Figure(rest_wanders),
    },
    Check {
        name: "contact/force-is-the-weight",
        needs: FORCES,
        unit: "",
        tolerance: Tolerance::same(1e-3),
        reason: "at rest forces balance: what an iterative solver leaves over",
        measure: Figure(weight),
    },
    Check {
        name: "contact/force-is-read-where-it-is-set",
        needs: FORCES,
        unit: "",
        tolerance: Tolerance::same(0.5),
        reason: "a box is set to where it came to rest, and pushes by its weight: half for a solver that begins anew",
        measure: Figure(weight_where_set),
    },
    Check {
        name: "contact/force-on-a-slope",
        needs: FORCES,
        unit: "",
        tolerance: Tolerance::same(1e-3),
        reason: "the normal force is m g cos a, at rest under friction: what an iterative solver leaves over",
        measure: Figure(weight_on_slope),
    },
    Check {
        name: "contact/force-passes-through",
        needs: FORCES
            .union(Capabilities::ARTICULATION)
            .union(Capabilities::ACTUATORS),
        unit: "",
        tolerance: Tolerance::same(1e-3),
        reason: "a finger pushes a box against a wall by 5 N, and both contacts carry it: what an iterative solver leaves over",
        measure: Figure(force_passes),
    },
    Check {
        name: "contact/stack-of-three-stands",
        needs: CONTACT,
        unit: "m",
        tolerance: Tolerance::same(2.5e-3),
        reason: "the default softness yields 0.4 mm for each weight carried: 3 + 2 + 1 of them",
        measure: Figure(stack_stands),
    },
    Check {
        name: "contact/stack-forces",
        needs: FORCES,
        unit: "",
        tolerance: Tolerance::same(5e-3),
        reason: "each contact carries what is above it: what an iterative solver leaves over in three layers",
        measure: Figure(stack_forces),
    },
    Check {
        name: "contact/tips-only-beyond-the-edge",
        needs: CONTACT,
        unit: "",
        tolerance: Tolerance::same(0.0),
        reason: "a box with its centre 5 mm inside a ledge stands, 5 mm beyond it falls: wrong of two",
        measure: Figure(tips_over),
    },
    Check {
        name: "contact/collision-momentum",
        needs: CONTACT,
        unit: "",
        tolerance: Tolerance::by_precision(1e-9, 1e-5),
        reason: "contact forces are opposite and equal: rounding",
        measure: Figure(collision_momentum),
    },
    Check {
        name: "contact/collision-gives-no-energy",
        needs: CONTACT,
        unit: "",
        tolerance: Tolerance::same(1e-3),
        reason: "contact of default damping only takes energy: what is given, and rounding",
        measure: Figure(collision_energy),
    },
    Check {
        name: "contact/undamped-contact-bounces",
        needs: CONTACT.union(Capabilities::CONTACT_STIFFNESS),
        unit: "",
        tolerance: Tolerance::same(0.05),
        reason: "a spring gives back what it takes; contact begins within a step: 2 w dt of the energy at w = 50 /s",
        measure: Figure(bounces),
    },
];

/// A box of 0.5 kg on a plane under tilted gravity, and its readings after one second.
fn rested(backend: &dyn Backend, angle: f64, channels: &[&str]) -> Result<(Rig, Vec<f64>)> {
    let (sin, cos) = angle.sin_cos();
    let inside = format!(
        r#"<option cone="elliptic" impratio="100" gravity="{} 0 {}"/><worldbody>
        <geom type="plane" size="5 5 .1" friction="0.5"/>
        <body name="b" pos="0 0 0.05"><freejoint name="b"/>
          <geom type="box" size=".1 .08 .05" mass="0.5" friction="0.5"/></body></worldbody>"#,
        G * sin,
        -G * cos
    );
    let mut rig = Rig::new(backend, &inside, channels)?;
    let end = last(&rig.run(500, &[])?)?.to_vec();
    Ok((rig, end))
}

fn resting(backend: &dyn Backend, angle: f64, channels: &[&str]) -> Result<Vec<f64>> {
    Ok(rested(backend, angle, channels)?.1)
}

fn rest_heights(backend: &dyn Backend) -> Result<f64> {
    let shapes = [
        ("sphere", "0.05", 0.05),
        ("box", "0.06 0.05 0.04", 0.04),
        ("cylinder", "0.05 0.03", 0.03),
        ("capsule", "0.03 0.05", 0.03),
    ];
    let mut heights = Vec::new();
    for (shape, size, height) in shapes {
        // A capsule lies on its side.
        let lies = if shape == "capsule" { "0 1 0" } else { "0 0 1" };
        let inside = format!(
            r#"<worldbody><geom type="plane" size="5 5 .1"/><body pos="0 0 {height}">
            <freejoint name="b"/><geom type="{shape}" size="{size}" zaxis="{lies}" mass="0.7"/></body></worldbody>"#
        );
        let mut rig = Rig::new(backend, &inside, &["qpos.b"])?;
        heights.push(last(&rig.run(500, &[])?)?[2] - height);
    }
    Ok(largest(heights))
}

fn mesh_height(backend: &dyn Backend) -> Result<f64> {
    let corner = |i: usize| {
        let sign = |bit: usize| if i >> bit & 1 == 0 { "-.05" } else { ".05" };
        format!("{} {} {} ", sign(0), sign(1), sign(2))
    };
    let corners: String = (0..8).map(corner).collect();
    let inside = format!(
        r#"<asset><mesh name="cube" vertex="{corners}"/></asset>
        <worldbody><geom type="plane" size="5 5 .1"/><body pos="0 0 .05"><freejoint name="b"/>
          <geom type="mesh" mesh="cube" mass="0.7"/></body></worldbody>"#
    );
    let mut rig = Rig::new(backend, &inside, &["qpos.b"])?;
    Ok(last(&rig.run(500, &[])?)?[2] - 0.05)
}

fn rest_is_still(backend: &dyn Backend) -> Result<f64> {
    Ok(largest(resting(backend, 0.0, &["qvel.b"])?))
}

fn rest_wanders(backend: &dyn Backend) -> Result<f64> {
    let end = resting(backend, 0.0, &["qpos.b"])?;
    Ok(end[0].hypot(end[1]))
}

fn weight(backend: &dyn Backend) -> Result<f64> {
    let end = resting(backend, 0.0, &["contact.world/b"])?;
    Ok(relative(end[0], 0.5 * G))
}

/// Deviation of the contact force that is read of a state that was set; NaN if reading moves it.
fn weight_where_set(backend: &dyn Backend) -> Result<f64> {
    let channels = ["contact.world/b", "qpos.b", "qvel.b"];
    let (mut rig, end) = rested(backend, 0.0, &channels)?;
    rig.place(&end[1..8], &[0.0; 6])?;
    let (first, again) = (rig.read()?, rig.read()?);
    if differing_bits(&first, &again) > 0.0 {
        return Ok(f64::NAN);
    }
    Ok(relative(first[0][0], 0.5 * G))
}

fn weight_on_slope(backend: &dyn Backend) -> Result<f64> {
    let end = resting(backend, 0.3, &["contact.b/world"])?;
    Ok(relative(end[0], 0.5 * G * 0.3f64.cos()))
}

fn force_passes(backend: &dyn Backend) -> Result<f64> {
    let inside = r#"<option gravity="0 0 0"/><worldbody>
        <geom type="box" size=".02 .2 .2" pos=".12 0 0"/>
        <body name="box"><freejoint name="box"/><geom type="box" size=".1 .05 .05" mass="0.5"/></body>
        <body name="finger" pos="-.11 0 0"><joint name="s" type="slide" axis="1 0 0"/>
          <geom type="box" size=".01 .03 .03" mass="0.1"/></body></worldbody>
      <actuator><motor joint="s"/></actuator>"#;
    let channels = ["contact.finger/box", "contact.box/world"];
    let mut rig = Rig::new(backend, inside, &channels)?;
    let rows = rig.run(500, &[5.0])?;
    Ok(largest(
        last(&rows)?.iter().map(|force| relative(*force, 5.0)),
    ))
}

/// Three stacked boxes of 0.3 kg, after two seconds.
fn stack(backend: &dyn Backend, channels: &[&str]) -> Result<Vec<f64>> {
    let boxes: String = (0..3)
        .map(|i| {
            format!(
                r#"<body name="b{i}" pos="0 0 {}"><freejoint name="b{i}"/>
                <geom type="box" size=".05 .05 .05" mass="0.3"/></body>"#,
                0.05 + 0.1 * f64::from(i)
            )
        })
        .collect();
    let inside = format!(r#"<worldbody><geom type="plane" size="1 1 .1"/>{boxes}</worldbody>"#);
    let mut rig = Rig::new(backend, &inside, channels)?;
    Ok(last(&rig.run(1000, &[])?)?.to_vec())
}

fn stack_stands(backend: &dyn Backend) -> Result<f64> {
    let top = stack(backend, &["qpos.b2"])?;
    Ok(largest([top[0], top[1], top[2] - 0.25]))
}

fn stack_forces(backend: &dyn Backend) -> Result<f64> {
    let channels = ["contact.world/b0", "contact.b0/b1", "contact.b1/b2"];
    let forces = stack(backend, &channels)?;
    Ok(largest(
        (0..3).map(|i| relative(forces[i], (3 - i) as f64 * 0.3 * G)),
    ))
}

fn tips_over(backend: &dyn Backend) -> Result<f64> {
    let mut stands = [false; 2];
    for (stands, x) in stands.iter_mut().zip([-0.005, 0.005]) {
        let inside = format!(
            r#"<worldbody><geom type="box" size=".5 .5 .25" pos="-.5 0 .25"/>
            <body pos="{x} 0 0.55"><freejoint name="b"/>
              <geom type="box" size=".05 .05 .05" mass="0.3"/></body></worldbody>"#
        );
        let mut rig = Rig::new(backend, &inside, &["qpos.b"])?;
        let rows = rig.run(1000, &[])?;
        *stands = (last(&rows)?[2] - 0.55).abs() < 2e-3;
    }
    Ok(broken([stands[0], !stands[1]]))
}

/// Two balls that collide off centre without gravity: velocities before and after.
fn collision(backend: &dyn Backend) -> Result<[Vec<f64>; 2]> {
    let inside = r#"<option gravity="0 0 0"/><worldbody>
      <body pos="-0.2 0 0"><freejoint name="a"/><geom type="sphere" size=".05" mass="0.4"/></body>
      <body pos="0 0.03 0"><freejoint name="b"/><geom type="sphere" size=".05" mass="1"/></body></worldbody>"#;
    let mut rig = Rig::new(backend, inside, &["qvel.a", "qvel.b"])?;
    let qpos = [
        -0.2, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.03, 0.0, 1.0, 0.0, 0.0, 0.0,
    ];
    let mut qvel = [0.0; 12];
    qvel[0] = 1.5;
    rig.place(&qpos, &qvel)?;
    let rows = rig.run(250, &[])?;
    Ok([qvel.to_vec(), last(&rows)?.to_vec()])
}

fn collision_momentum(backend: &dyn Backend) -> Result<f64> {
    let [before, after] = collision(backend)?;
    if after[6] < 0.1 {
        // The balls passed through each other.
        return Ok(f64::NAN);
    }
    let momentum = |v: &[f64], i: usize| 0.4 * v[i] + v[6 + i];
    Ok(largest((0..3).map(|i| {
        (momentum(&after, i) - momentum(&before, i)) / (0.4 * 1.5)
    })))
}

fn collision_energy(backend: &dyn Backend) -> Result<f64> {
    let energy = |v: &[f64]| {
        let square = |at: usize| v[at..at + 3].iter().map(|x| x * x).sum::<f64>();
        let inertia = 0.4 * 0.05 * 0.05;
        0.4 * (square(0) + inertia * square(3)) + square(6) + inertia * square(9)
    };
    let [before, after] = collision(backend)?;
    Ok((relative(energy(&after), energy(&before))).max(0.0))
}

fn bounces(backend: &dyn Backend) -> Result<f64> {
    let inside = r#"<option timestep="0.0005"/><worldbody><geom type="plane" size="1 1 .1"/>
      <body pos="0 0 0.3"><freejoint name="b"/>
        <geom type="sphere" size=".1" mass="0.5" solref="-2500 0" solimp="0.9999 0.9999 0.001" priority="1"/>
      </body></worldbody>"#;
    let mut rig = Rig::new(backend, inside, &["qpos.b"])?;
    let rows = rig.run(2000, &[])?;
    let heights: Vec<f64> = rows.iter().map(|r| r[2] - 0.1).collect();
    let first = heights
        .iter()
        .position(|h| *h < 0.0)
        .unwrap_or(heights.len());
    let highest = heights[first..].iter().copied().fold(f64::NAN, f64::max);
    Ok(relative(highest, 0.2))
}
