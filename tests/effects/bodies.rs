//! Mass, gravity and forces of moving bodies.

use super::bench::{near, on_each};

const G: f64 = 9.81;
const DT: f64 = 0.002;

/// A stone of 0.5 kg that falls, its centre of mass off its frame.
const STONE: &str = r#"<mujoco><compiler angle="radian"/><option timestep="0.002"/>
  <worldbody><body name="stone"><freejoint name="free"/><inertial pos="0.02 0 0.01" mass="0.5" diaginertia="0.01 0.01 0.01"/></body></worldbody>
  <sensor><framepos name="at" objtype="xbody" objname="stone"/><framelinvel name="v" objtype="body" objname="stone"/></sensor></mujoco>"#;

/// The same without gravity.
fn weightless() -> String {
    STONE.replace(r#"timestep="0.002""#, r#"timestep="0.002" gravity="0 0 0""#)
}

/// A cart of 2 kg on a rail, and a flap on a hinge beside it.
const CART: &str = r#"<mujoco><compiler angle="radian"/><option timestep="0.002" gravity="0 0 -9.81"/>
  <worldbody><body name="cart"><joint name="rail" type="slide" axis="1 0 0"/><geom name="cart" type="box" size="0.1 0.1 0.1" mass="2"/></body>
    <body name="flap" pos="0 1 0"><joint name="hinge" axis="0 1 0"/><inertial pos="0 0 -0.1" mass="0.3" diaginertia="0.01 0.02 0.01"/></body></worldbody>
  <actuator><motor name="pull" joint="rail"/><motor name="turn" joint="hinge"/></actuator>
  <sensor><jointvel name="v" joint="rail"/><jointvel name="w" joint="hinge"/></sensor></mujoco>"#;

#[test]
fn quadratic_drag_falls_at_its_terminal_speed() {
    let c = 0.05;
    on_each(
        STONE,
        &[&format!("quadratic-drag@stone:coefficient={c}")],
        |bench| {
            let v = bench.run(3000, &[vec![]])[0][5];
            near(&bench.engine, v, -(0.5 * G / c).sqrt(), 0.02);
        },
    );
}

#[test]
fn linear_drag_is_an_exponential_however_strong() {
    for c in [0.7, 600.0] {
        on_each(
            &weightless(),
            &[&format!("linear-drag@stone:coefficient={c}")],
            |bench| {
                bench.state(
                    &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
                    &[2.0, -1.0, 0.0, 0.0, 0.0, 0.0],
                );
                let row = &bench.run(250, &[vec![]])[0];
                let left = (-c * 250.0 * DT / 0.5_f64).exp();
                near(&bench.engine, row[3], 2.0 * left, 3e-4);
                near(&bench.engine, row[4], -left, 3e-4);
            },
        );
    }
}

#[test]
fn magnus_force_bends_a_path_to_a_circle() {
    let (k, spin, v) = (0.1, 3.0, 2.0);
    on_each(
        &weightless(),
        &[&format!("magnus@stone:coefficient={k}")],
        |bench| {
            // About the vertical through the centre of mass, which moves along x.
            let qvel = [v, -spin * 0.02, 0.0, 0.0, 0.0, spin];
            bench.state(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], &qvel);
            let steps = 800;
            let row = &bench.run(steps, &[vec![]])[0];
            let turned = k * spin / 0.5 * steps as f64 * DT;
            near(&bench.engine, row[3], v * turned.cos(), 0.02);
            near(&bench.engine, row[4], v * turned.sin(), 0.02);
        },
    );
}

#[test]
fn a_constant_force_pushes_at_the_centre_of_mass() {
    on_each(
        &weightless(),
        &["constant-force@stone:x=1,y=-2,z=0.5"],
        |bench| {
            let rows = bench.run(500, &[vec![]]);
            for (i, force) in [1.0, -2.0, 0.5].into_iter().enumerate() {
                near(&bench.engine, rows[0][3 + i], force / 0.5, 1e-3);
                // It does not turn: the frame goes as the centre does.
                near(&bench.engine, rows[0][i], force / 0.5 / 2.0, 5e-3);
            }
        },
    );
    on_each(CART, &["constant-force@flap:x=2"], |bench| {
        // Torque about y of a force along x at 0.1 m below the hinge.
        let row = &bench.hold(1, &[0.0, 0.0])[0];
        let about = 0.02 + 0.3 * 0.01;
        near(&bench.engine, row[1], -0.1 * 2.0 / about * DT, 1e-3 * DT);
    });
}

#[test]
fn a_tilt_makes_things_run_downhill() {
    let (pitch, roll): (f64, f64) = (0.1, -0.2);
    on_each(
        STONE,
        &[&format!("gravity-tilt:pitch={pitch},roll={roll}")],
        |bench| {
            let row = &bench.run(500, &[vec![]])[0];
            let expected = [
                pitch.sin(),
                -pitch.cos() * roll.sin(),
                -pitch.cos() * roll.cos(),
            ];
            for (i, part) in expected.into_iter().enumerate() {
                near(&bench.engine, row[3 + i], G * part, 1e-3);
            }
        },
    );
}

#[test]
fn masses_resist_a_known_force() {
    for (effect, mass) in [
        ("mass@cart:factor=1.5", 3.0),
        ("payload@cart:mass=0.5", 2.5),
        ("inertia@cart:factor=2", 2.0),
    ] {
        on_each(CART, &[effect], |bench| {
            let v = bench.hold(500, &[1.0, 0.0])[499][0];
            near(effect, v, 1.0 / mass, 1e-3);
        });
    }
}

#[test]
fn moments_of_inertia_and_centres_of_mass_move_a_flap() {
    for (effect, moment, center) in [
        ("inertia@flap:factor=1.5", 0.03, [0.0, -0.1]),
        ("center-of-mass@flap:x=0.05,z=-0.1", 0.02, [0.05, -0.2]),
        ("mass@flap:factor=1", 0.02, [0.0, -0.1]),
    ] {
        on_each(CART, &[effect], |bench| {
            let [x, z]: [f64; 2] = center;
            let about = moment + 0.3 * (x * x + z * z);
            // Weight at x ahead of the hinge turns it about +y.
            let torque = 0.2 + 0.3 * G * x;
            let w = bench.hold(1, &[0.0, 0.2])[0][1];
            near(effect, w, torque / about * DT, 2e-3 * DT * torque / about);
        });
    }
}
