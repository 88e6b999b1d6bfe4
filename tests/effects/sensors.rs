//! Effects on readings, compared with the same readings without them.

use super::bench::{Bench, engines_for, near, on_each};
use super::{DT, ROTOR};

/// Physics steps of a row of 10 ms.
const SUBSTEPS: usize = 5;
const ROW: f64 = SUBSTEPS as f64 * DT;
const FRAMES: usize = 60;

/// A falling body with frame sensors, which read vectors.
const FALL: &str = r#"<mujoco><compiler angle="radian"/><option timestep="0.002"/>
  <worldbody><body name="stone"><freejoint name="free"/><geom name="stone" size="0.1" mass="1"/></body></worldbody>
  <sensor><framepos name="at" objtype="xbody" objname="stone"/><framequat name="turn" objtype="xbody" objname="stone"/></sensor></mujoco>"#;

/// Calls `check` with the readings without and with an effect. The rotor is under a constant
/// torque, other scenes under none.
fn both(xml: &str, effect: &str, mut check: impl FnMut(&str, f64, &[Vec<f64>], &[Vec<f64>])) {
    for backend in engines_for(effect) {
        let command = if xml == ROTOR { vec![0.8] } else { vec![] };
        let run = |effects: &[&str]| {
            let mut bench = Bench::new(&*backend, xml, effects);
            let rows = bench.run(SUBSTEPS, &vec![command.clone(); FRAMES]);
            (rows, bench.rounding)
        };
        let ((plain, rounding), (with, _)) = (run(&[]), run(&[effect]));
        let label = format!("{effect} on {}", backend.name());
        check(&label, rounding, &plain, &with);
    }
}

#[test]
fn a_delayed_reading_is_that_of_then() {
    for delay in [0.001, 0.0137, 0.08] {
        both(
            ROTOR,
            &format!("sensor-delay@angle:delay={delay}"),
            |label, rounding, plain, with| {
                for k in 0..FRAMES {
                    assert_eq!(plain[k][1], with[k][1], "the other sensor is in step");
                    // Constant acceleration: after n steps the angle is a dt² n (n + 1) / 2.
                    let steps = ((k + 1) as f64 * ROW - delay) / DT;
                    let first = plain[0][0];
                    let expected = match steps > SUBSTEPS as f64 {
                        true => 0.8 / 0.5 * DT * DT * steps * (steps + 1.0) / 2.0,
                        false => first,
                    };
                    // With two or three rows the curve through them is not yet a parabola.
                    let tolerance = if k < 3 { 2e-4 } else { 10.0 * rounding };
                    near(label, with[k][0], expected, tolerance);
                }
            },
        );
    }
}

#[test]
fn a_delay_does_not_blur_a_fast_motion() {
    // A servo's oscillation at 5 Hz, read every 10 ms, half a row late.
    let spring = ROTOR.replace(r#"axis="0 0 1""#, r#"axis="0 0 1" stiffness="493.5""#);
    for backend in engines_for("sensor-delay") {
        let run = |effects: &[&str], substeps: usize, frames: usize| {
            let mut bench = Bench::new(&*backend, &spring, effects);
            bench
                .state(&[1.0], &[0.0])
                .run(substeps, &vec![vec![0.0]; frames])
        };
        let late = run(&["sensor-delay@angle:delay=0.006"], SUBSTEPS, FRAMES);
        let fine = run(&[], 1, FRAMES * SUBSTEPS);
        for k in 4..FRAMES {
            near(
                backend.name(),
                late[k][0],
                fine[SUBSTEPS * (k + 1) - 4][0],
                4e-3,
            );
        }
    }
}

#[test]
fn a_filter_is_exact_for_a_line() {
    // The speed is linear in time: y = r - m T (1 - e^(-t/T)) after the first row.
    for time in [0.004, 0.05] {
        both(
            ROTOR,
            &format!("sensor-filter@speed:time_constant={time}"),
            |label, rounding, plain, with| {
                let slope = 0.8 / 0.5;
                for k in 0..FRAMES {
                    let since = k as f64 * ROW;
                    let lag = -slope * time * (-since / time).exp_m1();
                    near(label, with[k][1], plain[k][1] - lag, 10.0 * rounding);
                }
            },
        );
    }
}

#[test]
fn numbers_are_shifted_scaled_and_rounded() {
    type Law = fn(f64, f64) -> f64;
    let laws: [(&str, Law); 4] = [
        ("sensor-bias@angle:bias=0.3", |_, r| r + 0.3),
        ("sensor-scale@angle:scale=1.2", |_, r| 1.2 * r),
        ("sensor-drift@angle:rate=-0.4", |t, r| r - 0.4 * t),
        ("sensor-quantization@angle:step=0.05", |_, r| {
            (r / 0.05).round() * 0.05
        }),
    ];
    for (effect, law) in laws {
        both(ROTOR, effect, |label, _, plain, with| {
            for k in 0..FRAMES {
                near(
                    label,
                    with[k][0],
                    law((k + 1) as f64 * ROW, plain[k][0]),
                    1e-12,
                );
                assert_eq!(with[k][1], plain[k][1], "{label}");
            }
        });
    }
}

#[test]
fn vectors_have_a_shift_by_entry_and_orientations_none() {
    both(
        FALL,
        "sensor-bias@at:x=0.1,z=-0.2",
        |label, _, plain, with| {
            for k in 0..FRAMES {
                for (i, shift) in [0.1, 0.0, -0.2].into_iter().enumerate() {
                    near(label, with[k][i], plain[k][i] + shift, 1e-12);
                }
                assert_eq!(plain[k][3..], with[k][3..], "{label}");
            }
        },
    );
    let plant = asid::mjcf::Plant::of(&super::bench::scene(FALL)).unwrap();
    let spec: asid::effects::EffectSpec = "sensor-bias@turn".parse().unwrap();
    assert!(spec.find(&plant).is_err());
}

#[test]
fn a_reading_has_a_shift_of_its_episode() {
    type Law = fn(usize) -> f64;
    let laws: [(&str, Law); 2] = [
        ("sensor-trend@angle:step=-0.02", |n| -0.02 * n as f64),
        ("episode-offset@angle:e0=0.3,e2=-0.1", |n| match n {
            0 => 0.3,
            2 => -0.1,
            _ => 0.0,
        }),
    ];
    for (effect, shift) in laws {
        on_each(ROTOR, &[effect], |bench| {
            for n in [0, 1, 2, 40] {
                let rows = bench.episode(n).hold(3, &[0.0]);
                near(&bench.engine, rows[2][0], shift(n), 1e-9);
                assert_eq!(rows[2][1], 0.0, "{effect}");
            }
        });
    }
}
