//! Friction and softness of contacts, on a sliding block and a rolling, spinning or bouncing ball.

use super::bench::{Bench, engines_for, near, on_each};

const G: f64 = 9.81;
const MU: f64 = 0.2;

/// A block on a floor; the block's friction applies.
const BLOCK: &str = r#"<mujoco><compiler angle="radian"/><option timestep="0.001" cone="elliptic" impratio="10"/>
  <worldbody><geom name="floor" type="plane" size="9 9 1" friction="0.1 0 0"/>
    <body name="block" pos="0 0 0.05"><freejoint name="free"/><geom name="block" type="box" size="0.1 0.1 0.05" mass="1" friction="0.2 0 0"/></body>
  </worldbody><sensor><framepos name="at" objtype="xbody" objname="block"/></sensor></mujoco>"#;

/// A ball of 5 cm with rolling and spinning friction, on a floor of the same friction.
const BALL: &str = r#"<mujoco><compiler angle="radian"/><option timestep="0.001" cone="elliptic" impratio="100"/>
  <worldbody><geom name="floor" type="plane" size="9 9 1" friction="0.5 0.004 0.001" condim="6" solref="-40000 -18" solimp="0.95 0.95 0.001"/>
    <body name="ball" pos="0 0 0.05"><freejoint name="free"/><geom name="ball" size="0.05" mass="0.1" friction="0.5 0.004 0.001" condim="6" solref="-40000 -18" solimp="0.95 0.95 0.001"/></body>
  </worldbody><sensor><framepos name="at" objtype="xbody" objname="ball"/><frameangvel name="spin" objtype="xbody" objname="ball"/></sensor></mujoco>"#;

/// Final position of a block that rests on the floor and is given a velocity.
fn slide(bench: &mut Bench, v: [f64; 2]) -> [f64; 2] {
    let rest = bench.run(200, &[vec![]])[0][2];
    let place = [0.0, 0.0, rest, 1.0, 0.0, 0.0, 0.0];
    bench.simulator.reset(&[0]).unwrap();
    bench.state(&place, &[v[0], v[1], 0.0, 0.0, 0.0, 0.0]);
    let end = bench.run(2000, &[vec![]]);
    [end[0][0], end[0][1]]
}

#[test]
fn sliding_friction_scales_the_distance() {
    for factor in [0.4, 2.0] {
        on_each(
            BLOCK,
            &[&format!("sliding-friction@floor:factor={factor}")],
            |bench| {
                let expected = 1.0 / (2.0 * MU * factor * G);
                let [x, _] = slide(bench, [1.0, 0.0]);
                near(&bench.engine, x, expected, 0.03 * expected);
            },
        );
    }
}

#[test]
fn beyond_the_edge_of_a_patch_the_friction_is_another() {
    for ratio in [0.5, 3.0] {
        for (axis, v) in [(0, [1.0, 0.0]), (1, [0.0, 1.0])] {
            let effect = format!("friction-patch@floor:ratio={ratio},place=0.1,axis={axis}");
            on_each(BLOCK, &[&effect], |bench| {
                let left = 1.0 - 2.0 * MU * G * 0.1;
                let expected = 0.1 + left / (2.0 * MU * ratio * G);
                let end = slide(bench, v);
                near(&bench.engine, end[axis], expected, 0.03 * expected);
            });
        }
    }
}

#[test]
fn friction_drifts_with_time() {
    let rate = 1.5;
    on_each(
        BLOCK,
        &[&format!("friction-drift@floor:per_second={rate}")],
        |bench| {
            // v = 1 - mu g (t + rate t² / 2) reaches zero at t, after the distance t - mu g (t²/2 +
            // rate t³/6).
            let a = MU * G;
            let t = (-1.0 + (1.0 + 2.0 * rate / a).sqrt()) / rate;
            let expected = t - a * (t * t / 2.0 + rate * t.powi(3) / 6.0);
            let [x, _] = slide(bench, [1.0, 0.0]);
            near(&bench.engine, x, expected, 0.03 * expected);
        },
    );
}

/// The block stops after `v² / (2 mu g)`.
#[test]
fn friction_changes_from_episode_to_episode() {
    let effect = "friction-trend@floor:per_episode=0.2";
    on_each(BLOCK, &[effect], |bench| {
        for n in [0, 1, 5] {
            let [x, _] = slide(bench.episode(n), [1.0, 0.0]);
            let expected = 1.0 / (2.0 * MU * G * (1.0 + 0.2 * n as f64));
            near(&bench.engine, x, expected, 0.03 * expected);
        }
    });
}

#[test]
fn friction_differs_by_direction() {
    let (cos, sin): (f64, f64) = (0.3, -0.2);
    for direction in [0.0_f64, 0.7, 2.5] {
        let effect = format!("friction-anisotropy@floor:cos_2={cos},sin_2={sin}");
        on_each(BLOCK, &[&effect], |bench| {
            let v = [direction.cos(), direction.sin()];
            let factor = 1.0 + cos * (2.0 * direction).cos() + sin * (2.0 * direction).sin();
            let expected = 1.0 / (2.0 * MU * factor * G);
            let [x, y] = slide(bench, v);
            near(
                &bench.engine,
                x * v[0] + y * v[1],
                expected,
                0.03 * expected,
            );
        });
    }
}

#[test]
fn rolling_and_torsional_friction_scale() {
    let (radius, mass) = (0.05, 0.1);
    let factor = 2.0;
    // Critical damping, for engines without bounces too.
    let ball = BALL.replace("-40000 -18", "-40000 -400");
    on_each(&ball, &["rolling-friction@floor:factor=2"], |bench| {
        let rest = bench.run(500, &[vec![]])[0][2];
        let place = [0.0, 0.0, rest, 1.0, 0.0, 0.0, 0.0];
        bench.state(&place, &[0.5, 0.0, 0.0, 0.0, 0.5 / radius, 0.0]);
        let a = 5.0 / 7.0 * factor * 0.001 * G / radius;
        let expected = 0.25 / (2.0 * a);
        let x = bench.run(5000, &[vec![]])[0][0];
        near(&bench.engine, x, expected, 0.03 * expected);
    });
    on_each(&ball, &["torsional-friction@floor:factor=2"], |bench| {
        let rest = bench.run(500, &[vec![]])[0][2];
        let place = [0.0, 0.0, rest, 1.0, 0.0, 0.0, 0.0];
        bench.state(&place, &[0.0, 0.0, 0.0, 0.0, 0.0, 30.0]);
        let inertia = 0.4 * mass * radius * radius;
        let slowed = factor * 0.004 * mass * G / inertia * 0.2;
        let spin = bench.run(200, &[vec![]])[0][5];
        near(&bench.engine, 30.0 - spin, slowed, 0.03 * slowed);
    });
}

#[test]
fn damping_lowers_the_bounce_and_stiffness_the_sinking_in() {
    for backend in engines_for("contact-restitution") {
        let height = |factor: f64| {
            let effect = format!("contact-restitution@floor:factor={factor}");
            let mut bench = Bench::new(&*backend, BALL, &[&effect]);
            let high = [0.0, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0];
            let rows = bench.state(&high, &[0.0; 6]).hold(700, &[]);
            let down = (0..700)
                .min_by(|&i, &j| rows[i][2].total_cmp(&rows[j][2]))
                .unwrap();
            rows[down..].iter().map(|r| r[2]).fold(0.0, f64::max)
        };
        let heights = [0.3, 1.0, 3.0, 10.0].map(height);
        assert!(
            heights.windows(2).all(|w| w[1] < w[0] - 0.02),
            "{heights:?}"
        );
    }
    for backend in engines_for("contact-stiffness") {
        let depth = |effects: &[&str]| {
            let mut bench = Bench::new(&*backend, BALL, effects);
            0.05 - bench.run(2000, &[vec![]])[0][2]
        };
        let ratio = depth(&["contact-stiffness@floor:factor=0.25"]) / depth(&[]);
        near(backend.name(), ratio, 4.0, 0.05);
    }
}

/// Symptom: less damping of a contact made it stiffer as well, and a stiffer contact was damped more
/// too, where `solref` is a time constant and a damping ratio.
///
/// Cause: each effect changed one of the two numbers, and both properties follow from both.
#[test]
fn a_factor_means_the_same_in_both_forms_of_a_contact() {
    let (time, ratio): (f64, f64) = (0.02, 0.3);
    let with = |solref: &str| BALL.replace("-40000 -18", solref);
    let direct = format!("{} {}", -1.0 / (time * ratio).powi(2), -2.0 / time);
    let forms = [with(&format!("{time} {ratio}")), with(&direct)];
    let high = [0.0, 0.0, 0.2, 1.0, 0.0, 0.0, 0.0];
    for effect in ["contact-restitution", "contact-stiffness"] {
        for factor in [0.4, 1.0, 2.5] {
            let effect = format!("{effect}@floor:factor={factor}");
            for backend in engines_for(&effect) {
                let [a, b] = [&forms[0], &forms[1]].map(|xml| {
                    let mut bench = Bench::new(&*backend, xml, &[&effect]);
                    bench.state(&high, &[0.0; 6]).hold(600, &[])
                });
                for (a, b) in a.iter().zip(&b) {
                    near(&effect, a[2], b[2], 1e-7);
                }
            }
        }
    }
}

/// A ball at rest sinks in by its weight over the stiffness.
#[test]
fn damping_of_a_contact_leaves_its_stiffness() {
    for solref in ["0.02 1", "0.02 0.4", "-4000 -30"] {
        let xml = BALL.replace("-40000 -18", solref);
        let depth = |backend: &dyn asid::core::Backend, effects: &[&str]| {
            0.05 - Bench::new(backend, &xml, effects).run(3000, &[vec![]])[0][2]
        };
        for backend in engines_for("contact-restitution") {
            let plain = depth(&*backend, &[]);
            for (effect, share) in [
                ("contact-restitution@floor:factor=0.5", 1.0),
                ("contact-restitution@floor:factor=2", 1.0),
                ("contact-stiffness@floor:factor=0.5", 2.0),
                ("contact-stiffness@floor:factor=2", 0.5),
            ] {
                let found = depth(&*backend, &[effect]) / plain;
                near(&format!("{effect}, {solref}"), found, share, 0.02 * share);
            }
        }
    }
}
