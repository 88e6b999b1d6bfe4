//! Joints, drives and free flight against theory.

#![allow(clippy::unwrap_used)]

mod support;

use support::Bench;

const G: f64 = 9.81;

#[test]
fn a_body_falls_freely_and_keeps_its_spin() {
    let inside = r#"<worldbody><body name="b" pos="0 0 5"><freejoint name="b"/>
      <geom type="box" size=".1 .1 .1" pos=".05 0 0" mass="1"/></body></worldbody>"#;
    let mut bench = Bench::new(inside, &["qpos.b", "qvel.b"]);
    // It turns about the centre of mass, which is not the origin.
    bench.place(&[0., 0., 5., 1., 0., 0., 0.], &[1., 0.15, 0., 0., 0., -3.]);
    let rows = bench.run(500, &[]);
    let end = &rows[499];
    // Semi-implicit Euler falls by g dt t / 2 more in substeps of 1 ms. The centre of mass flies
    // straight and is 0.05 m along the body's x axis.
    let (sin, cos) = (-3.0f64).sin_cos();
    let height = 5.0 - 0.5 * G - 0.5 * G * 0.001;
    assert!(
        (end[2] - height).abs() < 1e-4,
        "z {} against {height}",
        end[2]
    );
    assert!((end[0] + 0.05 * cos - 1.05).abs() < 1e-4, "x {}", end[0]);
    assert!((end[1] + 0.05 * sin).abs() < 1e-3, "y {}", end[1]);
    assert!((end[12] + 3.0).abs() < 1e-4, "spin {}", end[12]);
}

#[test]
fn unit_torque_gives_the_expected_acceleration() {
    // Inertia about the hinge: 2 (0.5² + (0.1² + 0.1²)/12 * 4) with armature 0.1.
    let inside = r#"<option gravity="0 0 0"/><worldbody><body><joint name="j" axis="0 0 1" armature="0.1"/>
      <geom type="box" size=".1 .1 .1" pos="0.5 0 0" mass="2"/></body></worldbody>
      <actuator><motor joint="j" gear="2"/></actuator>"#;
    let inertia = 2.0 * 0.25 + 2.0 * (0.04 + 0.04) / 12.0 + 0.1;
    let mut bench = Bench::new(inside, &["qvel.j"]);
    let rows = bench.run(100, &[0.5]);
    assert!(
        (rows[99][0] - 0.2 / inertia).abs() < 1e-4 * 0.2 / inertia,
        "{}",
        rows[99][0]
    );
    // A slide: one newton acts on two kilograms.
    let inside = r#"<option gravity="0 0 0"/><worldbody><body><joint name="j" type="slide" axis="0 1 0"/>
      <geom type="sphere" size=".1" mass="2"/></body></worldbody><actuator><motor joint="j"/></actuator>"#;
    let rows = Bench::new(inside, &["qvel.j", "qpos.j"]).run(500, &[1.0]);
    assert!((rows[499][0] - 0.5).abs() < 1e-4, "{}", rows[499][0]);
    assert!((rows[499][1] - 0.25).abs() < 1e-3, "{}", rows[499][1]);
}

#[test]
fn a_pendulum_keeps_its_energy_and_period() {
    let inside = r#"<worldbody><body pos="0 0 1"><joint name="j" axis="0 1 0"/>
      <geom type="sphere" size=".02" pos="0 0 -0.5" mass="1"/></body></worldbody>"#;
    let mut bench = Bench::new(inside, &["qpos.j", "qvel.j"]);
    bench.place(&[0.5], &[0.0]);
    let rows = bench.run(5000, &[]);
    let inertia = 0.25 + 0.4 * 0.02 * 0.02;
    let energy = |r: &Vec<f64>| 0.5 * inertia * r[1] * r[1] - 0.5 * G * r[0].cos();
    let depth = 0.5 * G * (1.0 - 0.5f64.cos());
    let drift = (energy(&rows[4999]) - energy(&rows[0])) / depth;
    assert!(
        drift.abs() < 0.005,
        "energy drifts by {drift} of the swing in 10 s"
    );
    let mut crossings = rows
        .windows(2)
        .enumerate()
        .filter(|(_, w)| w[0][0] > 0.0 && w[1][0] <= 0.0);
    let (first, last) = (
        crossings.next().unwrap().0,
        crossings.next_back().unwrap().0,
    );
    let period = (last - first) as f64 * 0.002 / 6.0;
    // Series of the exact period at an amplitude of 0.5 rad.
    let expected = std::f64::consts::TAU * (inertia / (0.5 * G)).sqrt() * (1.0 + 0.25 / 16.0);
    assert!(
        (period / expected - 1.0).abs() < 0.005,
        "{period} against {expected}"
    );
}

/// A servo on a hinge of inertia 0.1 kg m² without gravity.
fn servo(kp: f64, kv: f64, more: &str) -> Bench {
    Bench::new(
        &format!(
            r#"<option gravity="0 0 0" timestep="0.002"/>
            <worldbody><body><joint name="j" axis="0 0 1" {more}/>
              <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body></worldbody>
            <actuator><position joint="j" kp="{kp}" kv="{kv}"/></actuator>"#
        ),
        &["qpos.j", "qvel.j"],
    )
}

#[test]
fn a_servo_answers_a_step_like_its_differential_equation() {
    // 0.1 q'' + 1 q' + 10 q = 10: half of critical damping.
    let rows = servo(10.0, 1.0, "").run(1000, &[1.0]);
    let (omega, zeta) = (10.0, 0.5f64);
    let damped = omega * (1.0 - zeta * zeta).sqrt();
    for (i, row) in rows.iter().enumerate().step_by(50) {
        let t = (i + 1) as f64 * 0.002;
        let (sin, cos) = (damped * t).sin_cos();
        let expected = 1.0 - (-zeta * omega * t).exp() * (cos + zeta * omega / damped * sin);
        // Backward Euler in substeps h = 1 ms is off by about omega h / 2.
        assert!(
            (row[0] - expected).abs() < 0.005,
            "t {t}: {} against {expected}",
            row[0]
        );
    }
}

#[test]
fn a_stiff_servo_is_stable_and_exact_at_rest() {
    let rows = servo(4000.0, 400.0, "").run(1000, &[0.3]);
    assert!((rows[999][0] - 0.3).abs() < 1e-5);
    // Overdamped, with the slow rate near kp / kv = 10 per second.
    let expected = 0.3 * (1.0 - (-10.0f64 * 0.2).exp());
    assert!((rows[99][0] - expected).abs() < 0.01, "{}", rows[99][0]);
    assert!(rows.iter().all(|r| r[0] < 0.3001), "overshoots");
}

/// MuJoCo's short forms and their `<general>` equivalents, by themselves and by a class.
///
/// Symptom: a `<position>` whose gains a class of `<general>` gives moved with a gain of 1.
#[test]
fn a_general_actuator_moves_as_the_short_form_that_it_equals() {
    let run = |class: &str, actuator: &str| {
        let inside = format!(
            r#"<option gravity="0 0 0"/><default>{class}</default>
            <worldbody><body><joint name="j" axis="0 0 1" damping="0.1"/>
              <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body></worldbody>
            <actuator>{actuator}</actuator>"#
        );
        Bench::new(&inside, &["qpos.j", "qvel.j"]).run(100, &[0.4])
    };
    let servo = r#"gainprm="40" biastype="affine" biasprm="0 -40 -3" forcerange="-9 9""#;
    let class = format!("<general {servo}/>");
    for (short, class, general) in [
        (
            r#"<position joint="j" kp="40" kv="3" forcerange="-9 9"/>"#,
            "",
            &*format!(r#"<general joint="j" {servo}/>"#),
        ),
        (
            r#"<position joint="j" kp="40" kv="3" forcerange="-9 9"/>"#,
            &class,
            r#"<position joint="j"/>"#,
        ),
        (
            r#"<velocity joint="j" kv="4"/>"#,
            "",
            r#"<general joint="j" gainprm="4" biastype="affine" biasprm="0 0 -4"/>"#,
        ),
        (
            r#"<motor joint="j" gear="-6" forcerange="-0.25 0.05"/>"#,
            "",
            r#"<general joint="j" gainprm="3" gear="-2" forcerange="-0.75 0.15"/>"#,
        ),
    ] {
        let (expected, found) = (run("", short), run(class, general));
        assert!(expected[99][0].abs() > 1e-3, "{short} does not move");
        for (a, b) in expected.iter().flatten().zip(found.iter().flatten()) {
            assert!((a - b).abs() < 1e-6, "{general}: {b} where {short} has {a}");
        }
    }
}

#[test]
fn a_limited_servo_pushes_with_its_limit() {
    let inside = r#"<option gravity="0 0 0"/>
      <worldbody><body><joint name="j" axis="0 0 1"/>
        <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body></worldbody>
      <actuator><position joint="j" kp="1000" kv="1000" forcerange="-0.2 0.2" ctrlrange="-1 1"/></actuator>"#;
    let mut bench = Bench::new(inside, &["qpos.j", "qvel.j"]);
    let rows = bench.run(6000, &[50.0]);
    assert!((rows[99][1] - 0.4).abs() < 1e-3, "{} rad/s", rows[99][1]);
    // Then it follows 1 - q, with a command that is clamped to 1 as well. Its force never changes
    // by more than its limits in one step.
    assert!((rows[5999][0] - 1.0).abs() < 1e-3, "{} rad", rows[5999][0]);
    assert!(
        rows[1000..]
            .iter()
            .all(|r| (r[1] - (1.0 - r[0])).abs() < 0.01)
    );
}

#[test]
fn joint_friction_holds_up_to_its_bound() {
    let inside = |friction: f64| {
        format!(
            r#"<option gravity="0 0 0"/><worldbody><body><joint name="j" axis="0 0 1" frictionloss="{friction}"/>
            <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body></worldbody>
            <actuator><motor joint="j"/></actuator>"#
        )
    };
    let held = Bench::new(&inside(1.1), &["qpos.j"]).run(500, &[1.0]);
    assert!(held[499][0].abs() < 1e-4, "creeps {}", held[499][0]);
    let moves = Bench::new(&inside(0.6), &["qvel.j"]).run(500, &[1.0]);
    assert!((moves[499][0] - 4.0).abs() < 0.02, "{}", moves[499][0]);
}

#[test]
fn damping_springs_reference_and_limits_are_mujocos() {
    // Damping alone: the rate decays with damping over inertia. Without the attribute there is
    // none.
    let inside = |more: &str| {
        format!(
            r#"<option gravity="0 0 0"/><worldbody><body><joint name="j" axis="0 0 1" {more}/>
            <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body></worldbody>"#
        )
    };
    for (damping, expected) in [(0.0f64, 2.0), (0.1, 2.0 * (-1.0f64).exp())] {
        let mut bench = Bench::new(&inside(&format!("damping=\"{damping}\"")), &["qvel.j"]);
        bench.place(&[0.0], &[2.0]);
        let rate = bench.run(500, &[])[499][0];
        assert!((rate - expected).abs() < 0.003, "{rate} against {expected}");
    }
    // A spring pulls to springref, whatever ref is; readings are relative to ref.
    let mut bench = Bench::new(
        &inside(r#"ref="0.2" springref="0.5" stiffness="5" damping="1""#),
        &["qpos.j"],
    );
    assert!((bench.read()[0] - 0.2).abs() < 1e-6);
    let rest = bench.run(3000, &[])[2999][0];
    assert!((rest - 0.5).abs() < 1e-4, "{rest}");
    // A stop holds against a torque.
    let stop = r#"<option gravity="0 0 0"/><worldbody><body><joint name="j" axis="0 0 1" range="-1 0.3" damping="0.05"/>
      <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body></worldbody>
      <actuator><motor joint="j"/></actuator>"#;
    let held = Bench::new(stop, &["qpos.j"]).run(2000, &[0.5])[1999][0];
    assert!((held - 0.3).abs() < 1e-3, "{held}");
}

#[test]
fn a_body_with_gravity_compensation_floats() {
    let inside = r#"<worldbody><body pos="0 0 1" gravcomp="1"><joint name="j" axis="0 1 0"/>
      <geom type="sphere" size=".02" pos="0.5 0 0" mass="1"/></body></worldbody>"#;
    let angle = Bench::new(inside, &["qpos.j"]).run(500, &[])[499][0];
    assert!(angle.abs() < 1e-5, "{angle}");
}

#[test]
fn a_ball_joint_turns_like_a_free_top() {
    // Torque-free and isotropic: the rate stays constant, and the rotation is its integral.
    let inside = r#"<option gravity="0 0 0"/><worldbody><body><joint name="j" type="ball"/>
      <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body></worldbody>
      <sensor><ballquat name="q" joint="j"/><ballangvel name="w" joint="j"/></sensor>"#;
    let mut bench = Bench::new(inside, &["qpos.j", "qvel.j", "q", "w"]);
    let start = nalgebra::UnitQuaternion::from_euler_angles(0.3, -0.2, 0.5);
    let rate = nalgebra::Vector3::new(0.4, 1.0, -0.6);
    bench.place(&[start.w, start.i, start.j, start.k], rate.as_slice());
    let end = &bench.run(500, &[])[499];
    let expected = start * nalgebra::UnitQuaternion::from_scaled_axis(rate);
    let dot: f64 = [expected.w, expected.i, expected.j, expected.k]
        .iter()
        .zip(end)
        .map(|(a, b)| a * b)
        .sum();
    assert!(1.0 - dot.abs() < 1e-5, "{end:?} against {expected:?}");
    assert!(
        (end[4] - 0.4).abs() < 1e-3 && (end[6] + 0.6).abs() < 1e-3,
        "{end:?}"
    );
    assert_eq!(end[..7], end[7..]);
}

#[test]
fn a_floating_tree_keeps_its_momentum() {
    // A spinning base whose centre of mass is not its origin, with a link on it.
    let inside = r#"<option gravity="0 0 0"/><worldbody><body name="base"><freejoint name="base"/>
        <geom type="box" size=".1 .1 .02" pos=".1 0 0" mass="1"/>
        <body name="lid" pos="0.2 0 0"><joint name="lid" axis="0 0 1"/>
          <geom type="box" size=".1 .02 .02" pos=".1 0 0" mass="0.5"/></body></body></worldbody>
      <sensor><framepos name="a" objtype="body" objname="base"/><framepos name="b" objtype="body" objname="lid"/></sensor>"#;
    let mut bench = Bench::new(inside, &["a", "b"]);
    let mut qpos = vec![0.0; 8];
    qpos[3] = 1.0;
    bench.place(&qpos, &[0.2, 0.0, 0.0, 0.0, 0.0, 2.0, -1.0]);
    let center =
        |r: &[f64]| -> Vec<f64> { (0..3).map(|i| (r[i] + 0.5 * r[3 + i]) / 1.5).collect() };
    let start = center(&bench.read());
    let rows = bench.run(1000, &[]);
    let (half, end) = (center(&rows[499]), center(&rows[999]));
    for i in 0..3 {
        let bend = end[i] - 2.0 * half[i] + start[i];
        // The path of the common centre is straight within 1 % of its length of 1 m.
        assert!(bend.abs() < 0.01, "entry {i} bends by {bend} m");
    }
    assert!((end[0] - start[0]).hypot(end[1] - start[1]) > 0.5);
}
