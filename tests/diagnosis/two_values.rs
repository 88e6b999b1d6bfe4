//! A parameter of the study that has only two values: no derivative leads from one to the other.

use super::world::{MASS, NOMINAL, Truth, log, write_files};
use super::{engine, run_on};
use asid::core::Capabilities;

/// Dry friction of the real cart, N.
const FRICTION: f64 = 1.2;
/// Dry friction of the model as given, N.
const GIVEN: f64 = 0.1;

/// Symptom: the parameter stayed at the value of the model as given, the check `excitation` said
/// that it hardly shows, and an effect stood in for it. Cause: its setting was read as its value,
/// and the value was left to derivatives, which are zero.
#[test]
fn the_other_of_two_values_is_found_by_replays() {
    if !engine()
        .capabilities()
        .contains(Capabilities::DOUBLE_PRECISION)
    {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let model = NOMINAL
        .replace("mass=\"1\"", &format!("mass=\"{MASS}\""))
        .replace(
            "damping=\"2\"",
            &format!("damping=\"2\" frictionloss=\"{GIVEN}\""),
        );
    let parameter = format!(
        "name = \"rubs\"\ntarget = \"joint/rail/frictionloss\"\nrange = [0, 1]\nscale = {{ binary = [{GIVEN}, {FRICTION}] }}"
    );
    let truth = Truth::Coulomb(FRICTION);
    write_files(folder.path(), &model, &parameter, |e| log(truth, e));
    let r = run_on(folder.path(), &[]).0.result;
    let found = &r.parameters[0];
    assert_eq!(found.nominal, Some(0.0), "{found:?}");
    assert_eq!(found.estimate, 1.0, "{found:?}");
    assert!(r.gap.identified < 0.2 * r.gap.nominal, "{:?}", r.gap);
    let excitation = r.checks.iter().find(|c| c.check == "excitation").unwrap();
    assert!(excitation.ok, "{}", excitation.detail);
}
