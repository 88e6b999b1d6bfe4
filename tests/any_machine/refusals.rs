//! Errors are reported in one line.

use super::cli_support::Workplace;
use super::world::{NOMINAL, Truth, write_study};
use super::{json, ok};

#[test]
fn what_is_wrong_is_told_in_one_line() {
    let place = Workplace::new();
    write_study(&place.path("cart"), Truth::None);
    place.write("model.xml", NOMINAL);
    let unfitted = "model = \"model.xml\"\n[[parameter]]\nname = \"m\"\ntarget = \"geom/cart/mass\"\nrange = [1, 2]\n";
    place.write("unfitted.toml", unfitted);
    for (arguments, part) in [
        (
            vec!["identify", "nothing-here"],
            "unknown task `nothing-here`",
        ),
        (vec!["identify", "nothing/here.toml"], "no such file"),
        (vec!["identify", "model.xml"], "is a model without logs"),
        (
            vec!["identify", "cart", "--log", "x.csv"],
            "a study names its logs itself",
        ),
        (
            vec!["identify", "cart", "--explorer", "random"],
            "--explorer, --policy, --identifier and --preset go with a task",
        ),
        (
            vec!["identify", "cart", "--model", "nothing.xml"],
            "nothing.xml: no such file",
        ),
        (
            vec!["diagnose", "cart", "--model", "nothing.xml"],
            "nothing.xml: no such file",
        ),
        (
            vec!["explore", "cart", "--model", "nothing.xml"],
            "nothing.xml: no such file",
        ),
        // Symptom: the study's own logs were diagnosed, without a word.
        (
            vec!["diagnose", "cart", "--train", "nothing.csv"],
            "--train: goes with --task",
        ),
        // Symptom: rc 0, with the setting ignored.
        (
            vec![
                "explore",
                "cart",
                "--explorer",
                "random",
                "--set",
                "explorer.x=0",
            ],
            "explorer.x: goes with a task",
        ),
        // Symptom: the key was not named.
        (
            vec!["explore", "cart", "--set", "rest_speed=abc"],
            "`rest_speed`: invalid type",
        ),
        // Symptom: it was read as a refined model, whose parameters have no range.
        (vec!["identify", "unfitted.toml"], "missing field `train`"),
        (
            vec!["explore", "cart", "--world", "perturbed"],
            "--world: goes with a task",
        ),
        (
            vec!["explore", "cart", "--truth", "mass=1"],
            "--truth: goes with a task",
        ),
        (
            vec!["explore", "cart", "--preset", "published"],
            "--preset: goes with a task",
        ),
        (
            vec!["explore", "cart", "--seconds=-5"],
            "seconds: -5 is out of its domain: a number above 0",
        ),
        (
            vec!["explore", "cart", "--set", "settle=-1"],
            "settle: -1 is out of its domain: a number from 0 up",
        ),
        (
            vec!["explore", "cart", "--seconds", "1", "--period", "0.6"],
            "period: 0.6 s is longer than half of the motion",
        ),
        (vec!["explore", "model.xml"], "nothing is sought"),
        (
            vec!["explore", "rod-balancing", "--seconds", "3"],
            "--seconds: goes with a study or --model",
        ),
        (
            vec!["explore", "cart", "--unknown", "mass:1"],
            "not a name and 2 numbers",
        ),
        (
            vec!["explore", "cart", "--limit-position", "rale:0:1"],
            "unknown joint `rale`",
        ),
        (
            vec!["explore", "cart", "--limit-position", "rail:1:0"],
            "asid: --limit-position: position of `rail`: 1 is not below 0",
        ),
        (
            vec!["explore", "cart", "--set", "second=3"],
            "asid: --set: unknown field `second`",
        ),
        // The cart begins at 0.
        (
            vec!["explore", "cart", "--limit-position", "rail:0.1:1"],
            "asid: --limit-position: the machine begins beyond one: position of `rail` 0.000, 0.100 beyond its limit of 0.100 to 1.000",
        ),
        (
            vec!["explore", "cart", "--explorer", "chance"],
            "unknown explorer of any machine `chance`",
        ),
        (
            vec!["explore", "cart", "--objective", "best"],
            "unknown objective",
        ),
        (
            vec!["export", "cart", "--mjcf", "model.xml"],
            "exists already",
        ),
        (
            vec!["export", "cart", "--mjcf", "none/model.xml"],
            "cannot be written",
        ),
    ] {
        let done = place.run(&arguments);
        let said = String::from_utf8(done.stderr).unwrap();
        assert!(!done.status.success(), "{arguments:?}");
        assert!(said.contains(part), "{arguments:?}: {said}");
        assert_eq!(said.trim().lines().count(), 1, "{said}");
    }
    assert_eq!(place.names(), ["cart", "model.xml", "unfitted.toml"]);
}

/// Symptom: a panic in `f64::clamp` if the range of one force limit passes the other limit, and
/// unbounded memory if `--seconds` is a million.
#[test]
fn motions_that_cannot_be_played_are_refused_in_a_line() {
    let place = Workplace::new();
    let limited = NOMINAL.replace(
        r#"ctrlrange="-20 20""#,
        r#"ctrlrange="-20 20" forcerange="-5 5""#,
    );
    place.write("cart.xml", &limited);
    let refused = |options: &[&str], expected: &[&str]| {
        let limits = ["--limit-position", "rail:-0.4:0.4", "--quiet"];
        let arguments = [&["explore", "cart.xml"][..], &limits, options].concat();
        let done = place.run(&arguments);
        let said = String::from_utf8(done.stderr).unwrap();
        assert_eq!(done.status.code(), Some(2), "{said}");
        assert_eq!(said.trim_end().lines().count(), 1, "{said}");
        for words in expected {
            assert!(said.contains(words), "{said}");
        }
    };
    let [lower, upper] = ["0:-6:8", "1:-7:-1"].map(|r| format!("actuator/belt/forcerange/{r}"));
    refused(
        &["--unknown", &lower],
        &["actuator/belt/forcerange/0", "-6 to 8", "upper limit"],
    );
    refused(&["--unknown", &upper], &["lower limit", "which is -5"]);
    // Both ends are unknown, and their ranges overlap.
    let [low, high] = ["0:-6:2", "1:1:6"].map(|r| format!("actuator/belt/forcerange/{r}"));
    refused(
        &["--unknown", &low, "--nuisance", &high],
        &["which is 1 to 6"],
    );
    refused(
        &["--unknown", "geom/cart/mass:0.4:3", "--seconds", "1e6"],
        &["seconds", "physics steps", "at most 200 s"],
    );
}

/// Symptom: `asid export` wrote no file on rapier where the document has a tendon. Cause: the
/// document is right, but rapier cannot load it for the gaps.
#[test]
fn a_document_that_a_smaller_engine_refuses_is_written_all_the_same() {
    let place = Workplace::new();
    write_study(&place.path("cart"), Truth::None);
    let model = NOMINAL.replace(r#"damping="2""#, r#"damping="2" armature="0.1""#);
    place.write("cart/nominal.xml", &model);
    let refined = "model = \"nominal.xml\"\n[[effect]]\neffect = \"backlash\"\nsite = \"rail\"\n\
                   parameters = { width = 0.01 }\n";
    place.write("cart/refined.toml", refined);
    let study = place.read("cart/study.toml");
    let study = study.replace("nominal.xml", "refined.toml");
    place.write("cart/study.toml", &study);
    let export = [
        "export",
        "cart",
        "--backend",
        "rapier",
        "--mjcf",
        "out.xml",
        "--json",
    ];
    let said = json(&ok(&place, &export));
    let refused = said["refused"].as_str().unwrap();
    assert!(refused.contains("<tendon>"), "{said}");
    assert!(said["gap"].as_array().unwrap().is_empty(), "{said}");
    assert!(place.read("out.xml").contains("<fixed name=\"rail_whole\""));
}
