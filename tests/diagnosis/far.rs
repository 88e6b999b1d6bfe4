//! Effects that are far from their null value: a motor with a tenth of the force that is commanded,
//! and a stiff spring.

use super::world::Truth;
use super::{assert_names, run};

#[test]
fn a_motor_that_gives_a_tenth_of_what_is_asked_is_a_limit() {
    let (found, _) = run(Truth::Limit(0.6), &[]);
    let r = &found.result;
    assert_names(r, &["actuator-saturation@belt"]);
    let limit = found.effects[0].values[0].1;
    assert!((limit - 0.6).abs() < 0.03, "{limit}");
}

/// On a table a spring of up to 200 N m/rad or N/m is plausible. The stiffer spring of a heavier
/// machine must not be cut off there.
#[test]
fn a_spring_ten_times_as_stiff_as_any_on_a_table_is_found() {
    let (found, _) = run(Truth::Spring(2000.0), &[]);
    let r = &found.result;
    assert_names(r, &["joint-stiffness@rail"]);
    let stiffness = r.effects[0].parameters["stiffness"];
    assert!((stiffness / 2000.0 - 1.0).abs() < 0.03, "{stiffness}");
}
