//! An effect that is far from its null: a motor that gives a tenth of what is asked of it.

use super::run;
use super::world::Truth;

#[test]
fn a_motor_that_gives_a_tenth_of_what_is_asked_is_a_limit() {
    let (found, _) = run(Truth::Limit(0.6), &[]);
    let r = &found.result;
    assert_eq!(
        r.verdict.effects,
        ["actuator-saturation@belt"],
        "{}",
        r.sentence
    );
    let limit = found.effects[0].values[0].1;
    assert!((limit - 0.6).abs() < 0.03, "{limit}");
}
