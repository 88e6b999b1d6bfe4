//! Mass, gravity and forces of moving bodies.

use super::bench::{Bench, engines_for, engines_that_load, near, on_each};

const G: f64 = 9.81;
const DT: f64 = 0.002;

/// A falling stone of 0.5 kg with an offset centre of mass.
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

/// Symptom: a force on a link acted at another place than its centre of mass, and the refined model was
/// off by thousands of times the noise.
///
/// Cause: the centre followed from the document, and a compiler option or a mesh made another.
#[test]
fn masses_and_centres_are_those_that_the_engine_has_compiled() {
    let compilers = [r#"settotalmass="4""#, r#"inertiafromgeom="true""#, ""];
    for compiler in compilers {
        let xml = CART.replace(
            r#"angle="radian""#,
            &format!(r#"angle="radian" {compiler}"#),
        );
        let xml = xml.replace(
            r#"<inertial pos="0 0 -0.1""#,
            r#"<geom size="0.1" pos="0 0 0.3" mass="0.7" contype="0"/><inertial pos="0 0 -0.1""#,
        );
        let scene = super::bench::scene(&xml);
        for backend in engines_that_load("constant-force@flap:z=1", &xml) {
            let model = backend.load(&scene).unwrap();
            let plant = asid::mjcf::Plant::of(&scene).unwrap();
            let plant = asid::effects::refined::as_compiled(&plant, &*model, "cart").unwrap();
            for (body, name) in [(1, "cart"), (2, "flap")] {
                let nominal = |attribute: &str, i: usize| {
                    let target = asid::core::Target::new("body", name, attribute, i);
                    model.nominal(&target).unwrap()
                };
                near(name, plant.bodies[body].mass, nominal("mass", 0), 1e-9);
                near(name, plant.bodies[body].center[2], nominal("ipos", 2), 1e-9);
            }
        }
    }
}

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
            // Rotation about the vertical axis through the centre of mass, which moves along x.
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
fn a_constant_force_pushes_at_the_center_of_mass() {
    on_each(
        &weightless(),
        &["constant-force@stone:x=1,y=-2,z=0.5"],
        |bench| {
            let rows = bench.run(500, &[vec![]]);
            for (i, force) in [1.0, -2.0, 0.5].into_iter().enumerate() {
                near(&bench.engine, rows[0][3 + i], force / 0.5, 1e-3);
                // It does not rotate: the frame moves with the centre.
                near(&bench.engine, rows[0][i], force / 0.5 / 2.0, 5e-3);
            }
        },
    );
    on_each(CART, &["constant-force@flap:x=2"], |bench| {
        // Torque about y of a force along x, 0.1 m below the hinge.
        let row = &bench.hold(1, &[0.0, 0.0])[0];
        let about = 0.02 + 0.3 * 0.01;
        near(&bench.engine, row[1], -0.1 * 2.0 / about * DT, 1e-3 * DT);
    });
}

/// Symptom: a force on a body pushed beside its centre of mass where an effect or a study had moved
/// that.
///
/// Cause: the force acted at the centre of the document, and at the places of its links.
#[test]
fn a_force_acts_at_the_center_of_mass_of_the_simulation() {
    let far = ["constant-force@stone:y=1", "center-of-mass@stone:x=0.2"];
    on_each(&weightless(), &far, |bench| {
        let row = &bench.run(500, &[vec![]])[0];
        // It does not rotate: the frame moves with the centre.
        near(&bench.engine, row[1], 1.0, 5e-3);
        near(&bench.engine, row[0], 0.0, 1e-3);
    });
    let force = "constant-force@flap:x=2";
    let plate = 0.3 / 3.0 * (0.05_f64.powi(2) + 0.08_f64.powi(2));
    for (xml, values, effects, drives, own) in [
        (
            CART,
            &[][..],
            &[force, "center-of-mass@flap:z=-0.1"][..],
            1,
            0.02,
        ),
        (
            CART,
            &[("body/flap/ipos/2", -0.2)][..],
            &[force][..],
            1,
            0.02,
        ),
        (
            PLATE,
            &[("geom/plate/pos/2", -0.2)][..],
            &[force][..],
            0,
            plate,
        ),
    ] {
        for backend in engines_for("center-of-mass") {
            let mut bench = Bench::with_values(&*backend, xml, values, effects);
            let row = &bench.hold(1, &vec![0.0; drives + 1])[0];
            // Torque about y of a force along x, 0.2 m below the hinge.
            let expected = -0.2 * 2.0 / (own + 0.3 * 0.2 * 0.2) * DT;
            near(&bench.engine, row[drives], expected, -2e-3 * expected);
        }
    }
    // The outer link is carried 0.1 m farther out, and the force with it.
    let values = [("body/outer/pos/0", 0.4)];
    for backend in engines_for("center-of-mass") {
        let effects = ["constant-force@outer:z=3"];
        let mut bench = Bench::with_values(&*backend, LINKS, &values, &effects);
        let about = 0.002 + 0.3 * 0.01 + 0.001 + 0.5 * 0.4 * 0.4;
        let torque = G * (0.3 * 0.1 + 0.5 * 0.4) - 3.0 * 0.4;
        let expected = torque / about * DT;
        let w = bench.hold(1, &[])[0][0];
        near(&bench.engine, w, expected, 2e-3 * expected.abs());
    }
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
fn moments_of_inertia_and_centers_of_mass_move_a_flap() {
    for (effect, moment, center) in [
        ("inertia@flap:factor=1.5", 0.03, [0.0, -0.1]),
        ("center-of-mass@flap:x=0.05,z=-0.1", 0.02, [0.05, -0.2]),
        ("mass@flap:factor=1", 0.02, [0.0, -0.1]),
    ] {
        on_each(CART, &[effect], |bench| {
            let [x, z]: [f64; 2] = center;
            let about = moment + 0.3 * (x * x + z * z);
            // A weight at positive x turns the flap about +y.
            let torque = 0.2 + 0.3 * G * x;
            let w = bench.hold(1, &[0.0, 0.2])[0][1];
            near(effect, w, torque / about * DT, 2e-3 * DT * torque / about);
        });
    }
}

/// Two links. The inner one is on a hinge that the weight turns. The outer one, a ball of 0.5 kg,
/// turns about the vertical axis 0.3 m from that hinge.
const LINKS: &str = r#"<mujoco><compiler angle="radian"/><option timestep="0.002" integrator="implicitfast"/>
  <worldbody><body name="inner"><joint name="lift" axis="0 1 0"/>
    <inertial pos="0.1 0 0" mass="0.3" diaginertia="0.001 0.002 0.002"/>
    <body name="outer" pos="0.3 0 0"><joint name="turn" axis="0 0 1"/>
      <inertial pos="0 0 0" mass="0.5" diaginertia="0.001 0.001 0.001"/></body></body></worldbody>
  <sensor><jointvel name="w" joint="lift"/></sensor></mujoco>"#;

#[test]
fn a_longer_link_carries_what_follows_farther_out() {
    let about = |x: f64| 0.002 + 0.3 * 0.01 + 0.001 + 0.5 * x * x;
    let falls = |x: f64, along: f64| along * G * (0.3 * 0.1 + 0.5 * x) / about(x);
    for (effect, wanted) in [
        ("geometry@outer:x=0.05", falls(0.35, 1.0)),
        // The inner link is on the ground, so only its position changes.
        ("geometry@inner:x=0.1,z=0.1", falls(0.3, 1.0)),
    ] {
        on_each(LINKS, &[effect], |bench| {
            let w = bench.hold(1, &[])[0][0];
            near(&bench.engine, w, wanted * DT, 2e-3 * wanted * DT);
        });
    }
}

#[test]
fn an_axis_that_stands_askew_feels_the_part_of_the_weight_along_it() {
    // Turned about x, the axis is (0, 1, 0.45) before normalisation; the moments about it are those
    // about y.
    let scene = LINKS.replace("0.001 0.002 0.002", "0.002 0.002 0.002");
    let about = 0.002 + 0.3 * 0.01 + 0.001 + 0.5 * 0.09;
    let torque = G * (0.3 * 0.1 + 0.5 * 0.3);
    on_each(&scene, &["geometry@inner:turn_x=0.45"], |bench| {
        let axis = [1.0 / 1.2025_f64.sqrt(), 0.45 / 1.2025_f64.sqrt()];
        // The outer link keeps its own rotation about the vertical axis. Like a free ball it takes
        // no part in the rotation about z.
        let w = bench.hold(1, &[])[0][0];
        let about = about - 0.001 * axis[1] * axis[1];
        let wanted = axis[0] * torque / about;
        near(&bench.engine, w, wanted * DT, 2e-3 * wanted * DT);
    });
}

/// A driven plate of half sizes 50, 20 and 80 mm and 0.3 kg, which hangs from a hinge.
const PLATE: &str = r#"<mujoco><option timestep="0.002" integrator="implicitfast"/>
  <worldbody><body name="flap"><joint name="hinge" axis="0 1 0"/>
    <geom name="plate" type="box" size="0.05 0.02 0.08" pos="0 0 -0.1" mass="0.3"/></body></worldbody>
  <actuator><motor name="turn" joint="hinge"/></actuator>
  <sensor><jointvel name="w" joint="hinge"/></sensor></mujoco>"#;

#[test]
fn mass_of_a_geom_composes_with_inertia_and_center_of_its_body() {
    // A study that fits the mass of a geom can lack the inertia of its body.
    let effects = [
        "mass@plate:factor=2",
        "inertia@flap:factor=1.5",
        "center-of-mass@flap:x=0.05,z=-0.1",
    ];
    for used in [
        &effects[..],
        &effects[..2],
        &effects[..1],
        &[effects[0], effects[2]],
    ] {
        on_each(PLATE, used, |bench| {
            let has = |i: usize| used.contains(&effects[i]);
            let mass = 0.6;
            let [x, z] = if has(2) { [0.05, -0.2] } else { [0.0, -0.1] };
            let own = mass / 3.0 * (0.05_f64.powi(2) + 0.08_f64.powi(2));
            let about = own * if has(1) { 1.5 } else { 1.0 } + mass * (x * x + z * z);
            let torque = 0.2 + mass * G * x;
            let w = bench.hold(1, &[0.2])[0][0];
            near(
                &bench.engine,
                w,
                torque / about * DT,
                2e-3 * DT * torque / about,
            );
        });
    }
}

#[test]
fn inertia_at_its_null_follows_the_mass_of_a_geom() {
    let runs = ["mass@plate:factor=2", "inertia@flap:factor=1"];
    for backend in engines_for(runs[0]) {
        let [alone, beside] = [&runs[..1], &runs[..]]
            .map(|effects| Bench::new(&*backend, PLATE, effects).hold(50, &[0.2]));
        assert_eq!(alone, beside, "{}", backend.name());
    }
}

/// A payload of mass `m` at `r` from the centre of mass has the first moment `p = m r`, wherever
/// the mass is defined. The torque about the hinge is that of the common centre.
#[test]
fn a_payload_has_mass_and_first_moments() {
    let values = "mass=0.4,moment_x=0.05,moment_y=0.02,moment_z=-0.03";
    // The mass from <inertial>, and from geoms: number of drives, and moment of inertia about the
    // body's own centre.
    let plate = 0.3 / 3.0 * (0.05_f64.powi(2) + 0.08_f64.powi(2));
    for (xml, drives, own) in [(CART, 1, 0.02), (PLATE, 0, plate)] {
        for carried in [values, "mass=0.4", "moment_x=0.05"] {
            let given = |name: &str| {
                let part = carried.split(',').find_map(|p| p.strip_prefix(name));
                part.map_or(0.0, |v| v[1..].parse::<f64>().unwrap())
            };
            let mass = 0.3 + given("mass");
            let (x, z) = (given("moment_x") / mass, -0.1 + given("moment_z") / mass);
            on_each(xml, &[&format!("payload@flap:{carried}")], |bench| {
                let mut command = vec![0.0; drives];
                command.push(0.2);
                let about = own * mass / 0.3 + mass * (x * x + z * z);
                let torque = 0.2 + mass * G * x;
                let w = bench.hold(1, &command)[0][drives];
                let expected = torque / about * DT;
                near(&bench.engine, w, expected, 2e-3 * expected.abs());
            });
        }
    }
}

/// The force of a payload is linear in its mass and first moments: half of all four gives half of
/// the torque.
#[test]
fn the_weight_of_a_payload_is_linear_in_its_parameters() {
    let hold = |share: f64| {
        let mut torques = Vec::new();
        // A servo of 400 N m/rad shows the torque by its deflection.
        let xml = PLATE.replace(
            r#"<motor name="turn" joint="hinge"/>"#,
            r#"<position name="turn" joint="hinge" kp="400" kv="40"/>"#,
        );
        let effect = format!(
            "payload@flap:mass={},moment_x={},moment_z={}",
            0.4 * share,
            0.05 * share,
            0.02 * share
        );
        on_each(&xml, &[&effect], |bench| {
            let rate: f64 = bench.hold(1, &[0.0])[0][0];
            let rows = bench.hold(3000, &[0.0]);
            let angle: f64 = rows.iter().map(|r| r[0] * DT).sum::<f64>() + rate * DT;
            torques.push(400.0 * angle);
        });
        torques
    };
    for (whole, half) in hold(1.0).into_iter().zip(hold(0.5)) {
        near("payload", whole, G * 0.05, 1e-2 * G * 0.05);
        near("payload", half, whole / 2.0, 1e-2 * G * 0.05);
    }
}
