//! A moving scene made of what an engine claims and of nothing else.
//!
//! Snapshots, determinism, invalid calls and the rules of parameters must hold for every engine, so
//! their checks run on every engine. If the engine claims all of it, the scene is a pile of bodies
//! that an arm pushes. Without contact it is a mechanism alone, without joints tumbling bodies.

use asid_core::layout::JointKind;
use asid_core::{Backend, Capabilities, Control, Layout, Result, Rollout};

use crate::rig::{Rig, Rows, Size};

/// The document and its recorded channels.
pub struct Subject {
    /// Content of the document, for [`crate::rig::scene`].
    pub inside: String,
    /// `qpos` and `qvel` of every joint.
    pub channels: Vec<&'static str>,
}

/// Parameters that every engine can set: gravity along z and x.
pub const TARGETS: [&str; 2] = ["option/gravity/2", "option/gravity/0"];

/// Nominal values of [`TARGETS`].
pub const NOMINAL: [f64; 2] = [-9.81, 0.0];

/// Attributes of geoms that touch nothing.
pub const GHOST: &str = r#" contype="0" conaffinity="0""#;

/// The scene for an engine.
pub fn subject(backend: &dyn Backend) -> Subject {
    let capabilities = backend.capabilities();
    let has = |bits: Capabilities| capabilities.contains(bits);
    let when = |bits: Capabilities, text: &str| if has(bits) { text } else { "" }.to_owned();
    let touch = if has(Capabilities::CONTACT) {
        ""
    } else {
        GHOST
    };
    let mut bodies = String::new();
    let mut actuators = String::new();
    let mut channels = Vec::new();
    if has(Capabilities::CONTACT) {
        let condim = match (
            has(Capabilities::TORSIONAL_FRICTION),
            has(Capabilities::ROLLING_FRICTION),
        ) {
            (true, true) => 6,
            (true, false) => 4,
            _ => 3,
        };
        bodies += &format!(
            r#"<geom type="plane" size="5 5 .1" condim="{condim}" friction="0.6 0.005 0.001"/>"#
        );
    }
    if has(Capabilities::ARTICULATION) {
        let damping = when(Capabilities::JOINT_IMPEDANCE, r#" damping="0.05""#);
        let friction = when(Capabilities::JOINT_FRICTION, r#" frictionloss="0.02""#);
        let range = when(Capabilities::JOINT_LIMITS, r#" range="-1 0.3""#);
        // An arm that sweeps over the floor, and a crank whose slider flies off.
        bodies += &format!(
            r#"<body name="arm" pos="-0.3 0 0.06"><joint name="turn" axis="0 0 1"{damping}{friction}/>
              <geom type="capsule" fromto="0 0 0 0.25 0 0" size="0.03" mass="0.6"{touch}/></body>
            <body name="crank" pos="-1 0 1"><joint name="swing" axis="0 1 0"{range}/>
              <geom type="sphere" size=".03" pos=".2 0 0" mass="0.5"{GHOST}/>
              <body name="slider" pos=".1 0 0"><joint name="reach" type="slide" axis="0.6 0 0.8"/>
                <geom type="sphere" size=".03" mass="0.3"{GHOST}/></body></body>"#
        );
        channels.extend(["qpos.turn", "qvel.turn"]);
        channels.extend(["qpos.swing", "qvel.swing", "qpos.reach", "qvel.reach"]);
        if has(Capabilities::ACTUATORS) {
            actuators = r#"<actuator>
                <position name="servo" joint="turn" kp="20" kv="2" ctrlrange="-2 2"/>
                <motor name="push" joint="swing" gear="0.5"/></actuator>"#
                .into();
        }
    }
    if has(Capabilities::FREE_BODIES) {
        bodies += &format!(
            r#"<body pos="0 0 0.06"><freejoint name="a"/>
              <geom type="box" size=".05 .05 .05" mass="0.4"{touch}/></body>
            <body pos="0.02 0.01 0.17"><freejoint name="b"/>
              <geom type="box" size=".05 .04 .05" mass="0.3"{touch}/></body>
            <body pos="0.1 0.1 0.06"><freejoint name="c"/>
              <geom type="sphere" size=".05" mass="0.3"{touch}/></body>"#
        );
        channels.extend(["qpos.a", "qvel.a", "qpos.b", "qvel.b", "qpos.c", "qvel.c"]);
    }
    if !capabilities.intersects(crate::MOVES) {
        return unclaimed(backend);
    }
    Subject {
        inside: format!(r#"<option cone="elliptic"/><worldbody>{bodies}</worldbody>{actuators}"#),
        channels,
    }
}

/// The scene for an engine that claims no motion.
///
/// It is a cart on a rail if the engine accepts one, else a body that nothing moves.
fn unclaimed(backend: &dyn Backend) -> Subject {
    let body = |joint: &str| {
        format!(
            r#"<worldbody><body name="cart">{joint}
            <geom type="sphere" size=".1" mass="1"{GHOST}/></body></worldbody>"#
        )
    };
    let inside = body(r#"<joint name="cart" type="slide" axis="1 0 0"/>"#);
    let moves = crate::rig::scene(&inside).and_then(|scene| backend.load(&scene));
    match moves {
        Ok(_) => Subject {
            inside,
            channels: vec!["qpos.cart", "qvel.cart"],
        },
        Err(_) => Subject {
            inside: body(""),
            channels: Vec::new(),
        },
    }
}

/// A batch of the scene with [`TARGETS`] as its parameters.
pub fn batch(backend: &dyn Backend, sims: usize, threads: usize) -> Result<Rig> {
    let subject = subject(backend);
    let size = Size {
        sims,
        threads,
        targets: &TARGETS,
    };
    Rig::with(backend, &subject.inside, &subject.channels, size)
}

/// A batch of the scene whose simulations move differently, by their numbers.
pub fn stirred(backend: &dyn Backend, sims: usize, threads: usize) -> Result<Rig> {
    let mut rig = batch(backend, sims, threads)?;
    stir(&mut rig, &(0..sims).collect::<Vec<_>>())?;
    Ok(rig)
}

/// Gives each simulation the velocities of its number, at the scene's initial positions.
pub fn stir(rig: &mut Rig, numbers: &[usize]) -> Result<()> {
    let nv = rig.simulator.layout().nv;
    let qvel: Vec<f64> = numbers
        .iter()
        .flat_map(|number| (0..nv).map(move |i| 1.0 + i as f64 + 0.3 * *number as f64))
        .map(|phase| 0.1 * phase.sin())
        .collect();
    let qpos = start(rig)?.repeat(numbers.len());
    let sims = rig.all();
    rig.simulator.set_state(&sims, &qpos, &qvel)
}

/// The initial positions of the document.
fn start(rig: &Rig) -> Result<Vec<f64>> {
    let names: Vec<String> = (rig.simulator.layout().joints.iter())
        .map(|joint| format!("qpos.{}", joint.name))
        .collect();
    let record = rig.simulator.layout().recording(&names)?;
    let mut fresh = rig.another(1, 1)?;
    let mut qpos = vec![0.0; record.width()];
    fresh.simulator.read(&[0], &record, &mut qpos)?;
    Ok(qpos)
}

/// A state that is neither the initial one nor one that the scene would reach by itself.
pub fn elsewhere(layout: &Layout) -> (Vec<f64>, Vec<f64>) {
    let mut qpos = Vec::with_capacity(layout.nq);
    for (i, joint) in layout.joints.iter().enumerate() {
        let i = i as f64;
        match joint.kind {
            JointKind::Free => {
                qpos.extend([0.1 * i, 0.02, 0.05 + 0.08 * i, 1.0, 0.0, 0.1, 0.0]);
            }
            JointKind::Ball => qpos.extend([0.8, 0.0, 0.6, 0.0]),
            JointKind::Hinge | JointKind::Slide => qpos.push(0.02 * i),
        }
    }
    let qvel = (0..layout.nv).map(|i| 0.1 * (i as f64).sin()).collect();
    (qpos, qvel)
}

/// Rolls out some simulations, each under the command of its number.
pub fn roll(rig: &mut Rig, sims: &[usize], frames: usize, substeps: usize) -> Result<Rows> {
    let nu = rig.simulator.layout().nu();
    let control: Vec<f64> = sims
        .iter()
        .flat_map(|&sim| (0..frames * nu).map(move |_| command(sim)))
        .collect();
    let width = rig.record.width();
    let mut out = vec![0.0; sims.len() * frames * width];
    let control = Control::PerSimulation(&control);
    let rollout = Rollout::new(sims, frames, substeps, control, &rig.record);
    rig.simulator.rollout(&rollout, &mut out)?;
    Ok(out.chunks(width).map(<[f64]>::to_vec).collect())
}

/// The command of a simulation in [`roll`].
pub fn command(sim: usize) -> f64 {
    0.4 + 0.3 * sim as f64
}

/// A body of 1 kg that nothing holds: on a free joint or on three slides.
pub struct Falling {
    /// Content of the document.
    pub inside: &'static str,
    /// Its name in the document.
    pub body: &'static str,
    /// Channels of its velocity: three linear ones, then the others of the joint.
    pub velocity: &'static [&'static str],
    /// Position at the origin, as a row of positions.
    pub origin: &'static [f64],
    /// State at rest, as a row of velocities.
    pub rest: &'static [f64],
}

/// Returns such a body for an engine.
pub fn falling(backend: &dyn Backend) -> Falling {
    if backend.capabilities().contains(Capabilities::FREE_BODIES) {
        Falling {
            inside: r#"<worldbody><body name="b"><freejoint name="b"/>
                <inertial pos="0 0 0" mass="1" diaginertia=".01 .01 .01"/></body></worldbody>"#,
            body: "b",
            velocity: &["qvel.b"],
            origin: &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
            rest: &[0.0; 6],
        }
    } else {
        Falling {
            inside: r#"<worldbody><body name="b"><joint name="x" type="slide" axis="1 0 0"/>
                <joint name="y" type="slide" axis="0 1 0"/><joint name="z" type="slide" axis="0 0 1"/>
                <inertial pos="0 0 0" mass="1" diaginertia=".01 .01 .01"/></body></worldbody>"#,
            body: "b",
            velocity: &["qvel.x", "qvel.y", "qvel.z"],
            origin: &[0.0; 3],
            rest: &[0.0; 3],
        }
    }
}
