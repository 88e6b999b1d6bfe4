//! `asid identify`, `explore` and `export` on a machine that is no task.

#![cfg(feature = "mujoco")]
#![allow(clippy::unwrap_used)]

#[path = "cli_support/mod.rs"]
#[allow(dead_code)]
mod cli_support;
#[path = "diagnosis/world.rs"]
mod world;

use asid::core::registry::{BackendEntry, find};
use asid::core::signal::Signal;
use asid::core::{Parameter, Scene};
use asid::mjcf::Plant;
use asid::sysid::limits::{LimitRequest, Limits};
use asid::sysid::play::Player;
use asid::sysid::tells::{differences, of_plays};
use cli_support::Workplace;
use serde_json::Value;
use world::{MASS, NOMINAL, Truth, write_study};

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap()
}

fn ok(place: &Workplace, arguments: &[&str]) -> String {
    let done = place.run(arguments);
    assert!(
        done.status.success(),
        "{arguments:?}: {}",
        String::from_utf8_lossy(&done.stderr)
    );
    String::from_utf8(done.stdout).unwrap()
}

fn mass() -> Parameter {
    Parameter {
        name: "mass".into(),
        targets: vec!["geom/cart/mass".parse().unwrap()],
        range: [0.4, 3.0],
        scale: asid::core::parameter::Scale::Linear,
        unit: "kg".into(),
    }
}

/// Without friction a cart's place is `F(t) / m` for some `F` of the commands alone, so that its derivative in the mass is
/// `-x / m`, and what readings of the place tell is the sum of `(x / (m σ))²`.
#[test]
fn the_information_about_a_mass_is_the_closed_form() {
    let xml = NOMINAL.replace(r#" damping="2""#, "");
    let scene = Scene::from_xml("cart", &xml, &[]).unwrap();
    let backend = (find::<BackendEntry>("mujoco").unwrap().make)().unwrap();
    let model = backend.load(&scene).unwrap();
    let plant = Plant::of(&scene).unwrap();
    let limits = Limits::new(&plant, &|_| None, &LimitRequest::default()).unwrap();
    let (sigma, parameters) = (1e-3, [mass()]);
    let signals = [Signal {
        sensor: "x".into(),
        noise: sigma,
    }];
    let mut player = Player::new(
        &*model,
        &plant,
        limits,
        &parameters,
        &signals,
        (&[0.0], 0.0),
        1,
    )
    .unwrap();
    let commands: Vec<f64> = (0..200)
        .map(|k| 4.0 * (0.05 * f64::from(k)).sin())
        .collect();
    let (points, widths) = differences(&parameters, &[1.3]);
    let jobs: Vec<(&[f64], &[f64])> = points.iter().map(|p| (&commands[..], &p[..])).collect();
    let plays = player.play(&jobs, 5).unwrap();
    let told = of_plays(&player, &plays, &widths, 1);
    let expected: f64 = plays[0]
        .readings
        .iter()
        .map(|x| (x / (1.3 * sigma)).powi(2))
        .sum();
    // In prior deviations: a uniform prior's is its width by the root of twelve.
    let prior = 2.6 / 12.0_f64.sqrt();
    let found = told.matrix[(0, 0)] / (prior * prior);
    // Central differences of 1/m over 0.02 prior deviations are off by their third derivative.
    assert!((found / expected - 1.0).abs() < 1e-3, "{found} {expected}");
}

#[test]
fn a_study_is_identified_and_its_refined_model_exported() {
    let place = Workplace::new();
    write_study(&place.path("cart"), Truth::Viscous(1.5));
    let study = place.read("cart/study.toml");
    // Damping is unknown too; a mass of the same cart twice over cannot be told from the first.
    let more = "[[parameter]]\nname = \"damping\"\ntarget = \"joint/rail/damping\"\nrange = [0.0, 8.0]\n\
                [[parameter]]\nname = \"rotor\"\ntarget = \"joint/rail/armature\"\nrange = [0.0, 0.5]\n";
    place.write("cart/study.toml", &format!("{study}{more}"));
    ok(&place, &["identify", "cart", "--quiet", "--out", "fit"]);
    let result = json(&place.read("fit/result.json"));
    let of = |name: &str| {
        let all = result["parameters"].as_array().unwrap();
        all.iter().find(|p| p["name"] == name).unwrap().clone()
    };
    let damping = of("damping");
    let (low, high) = (
        damping["interval95"][0].as_f64().unwrap(),
        damping["interval95"][1].as_f64().unwrap(),
    );
    assert!(low - 0.02 < 3.5 && 3.5 < high + 0.02, "{damping}");
    assert!(high - low < 0.2);
    // Mass and rotor add up: their difference is named as unseen.
    let unseen = result["unseen"].as_array().unwrap();
    assert_eq!(unseen.len(), 1, "{unseen:?}");
    let sum = of("mass")["estimate"].as_f64().unwrap() + of("rotor")["estimate"].as_f64().unwrap();
    assert!((sum - MASS).abs() < 0.02, "{sum}");
    let gap = &result["gap"];
    assert!(gap["nominal"].as_f64().unwrap() > 5.0);
    assert!(gap["identified"].as_f64().unwrap() < 1.2, "{gap}");
    for file in [
        "config.toml",
        "report.html",
        "refined.toml",
        "train-1.csv",
        "posterior.json",
    ] {
        assert!(place.path("fit").join(file).is_file(), "{file}");
    }
    // The refined model goes home, and replays the logs as well.
    let refined = place.read("fit/refined.toml");
    place.write("cart/refined.toml", &refined);
    let study = place
        .read("cart/study.toml")
        .replace("nominal.xml", "refined.toml");
    place.write("cart/again.toml", &study);
    let said = json(&ok(
        &place,
        &["export", "cart/again.toml", "--mjcf", "out.xml", "--json"],
    ));
    assert!(said["left_out"].as_array().unwrap().is_empty(), "{said}");
    for row in said["gap"].as_array().unwrap() {
        let (a, b) = (
            row["refined"].as_f64().unwrap(),
            row["exported"].as_f64().unwrap(),
        );
        assert!((a - b).abs() < 1e-6 && a < 1.2, "{row}");
    }
    // It repeats to the byte.
    ok(
        &place,
        &[
            "identify",
            "cart",
            "--quiet",
            "--out",
            "twice",
            "--threads",
            "1",
        ],
    );
    let again = json(&place.read("twice/result.json"));
    assert_eq!(again["parameters"], result["parameters"]);
}

#[test]
fn a_study_is_fitted_in_another_model_that_takes_the_place_of_its_own() {
    let place = Workplace::new();
    write_study(&place.path("cart"), Truth::Viscous(1.5));
    let damped = NOMINAL.replace("damping=\"2\"", "damping=\"3.5\"");
    assert_ne!(damped, NOMINAL);
    place.write("damped.xml", &damped);
    let fit = ["identify", "cart", "--quiet", "--out"];
    ok(&place, &[&fit[..], &["own"]].concat());
    ok(
        &place,
        &[&fit[..], &["other", "--model", "damped.xml"]].concat(),
    );
    let gap = |folder: &str| {
        let result = json(&place.read(&format!("{folder}/result.json")));
        result["gap"]["identified"].as_f64().unwrap()
    };
    assert!(gap("own") > 5.0 && gap("other") < 1.2);
    assert!(place.read("other/config.toml").contains("damped.xml"));
}

/// A body that is one geom has one mass, under two names.
#[test]
fn the_mass_of_a_body_of_one_geom_is_that_of_the_geom() {
    let place = Workplace::new();
    write_study(&place.path("cart"), Truth::None);
    let study = place.read("cart/study.toml");
    let by_body = study.replace("geom/cart/mass", "body/cart/mass");
    assert_ne!(study, by_body);
    place.write("cart/study.toml", &by_body);
    let read = asid::diagnosis::study::Study::read(&place.path("cart")).unwrap();
    assert_eq!(read.parameters[0].targets, mass().targets);
}

/// Options that make a search short.
const SHORT: [&str; 6] = [
    "--set",
    "design.iterations=10",
    "--set",
    "design.population=16",
    "--set",
    "design.physics_steps=4e6",
];

#[test]
fn a_motion_keeps_its_limits_and_tells_what_it_says() {
    let place = Workplace::new();
    write_study(&place.path("cart"), Truth::None);
    let limits = [
        "--limit-position",
        "rail:-0.4:0.4",
        "--limit-speed",
        "rail:1.5",
        "--limit-force",
        "belt:8",
        "--seconds",
        "2",
        "--unknown",
        "geom/cart/mass:0.4:3",
        "--unknown",
        "joint/rail/damping:0.5:4",
    ];
    let design = |explorer: &str, seed: usize| {
        let (seed, out) = (seed.to_string(), format!("{explorer}-{seed}"));
        let arguments = [
            &[
                "explore",
                "cart/nominal.xml",
                "--quiet",
                "--out",
                &out,
                "--explorer",
                explorer,
                "--seed",
                &seed,
            ][..],
            &limits,
            &SHORT,
        ]
        .concat();
        ok(&place, &arguments);
        let result = json(&place.read(&format!("{out}/result.json")));
        assert_eq!(result["broken"], Value::Null, "{}", result["notes"]);
        let all = result["unknowns"].as_array().unwrap().iter();
        all.map(|u| (u["motion"].as_f64().unwrap() / u["prior"].as_f64().unwrap()).powi(2))
            .sum::<f64>()
    };
    // The median of three seeds.
    let typical = |explorer: &str| {
        let mut costs = [0, 1, 2].map(|seed| design(explorer, seed));
        costs.sort_by(f64::total_cmp);
        costs[1]
    };
    let best = typical("fisher-cem");
    // A cart is linear: a periodic motion that fills its limits is near the best there is, and a short search comes near it.
    for (explorer, share) in [("random", 1.0), ("multisine", 1.5), ("fourier", 1.0)] {
        let other = typical(explorer);
        assert!(best < share * other, "{explorer}: {best} and {other}");
    }
    // The file is a log of the model's actuator, within the limits, and at rest at its end.
    let text = place.read("fisher-cem-0/commands.csv");
    let rows: Vec<Vec<f64>> = text
        .lines()
        .skip(1)
        .map(|l| l.split(',').map(|x| x.parse().unwrap()).collect())
        .collect();
    assert!(text.starts_with("time,ctrl.belt\n"));
    assert!(rows.iter().all(|r| r[1].abs() <= 8.0));
    assert_eq!(rows.last().unwrap()[1], 0.0);
    // An independent cart, integrated by hand, keeps them too.
    let (mut x, mut v) = (0.0_f64, 0.0_f64);
    let (mut far, mut fast) = (0.0_f64, 0.0_f64);
    for pair in rows.windows(2) {
        let steps = 100;
        let h = (pair[1][0] - pair[0][0]) / f64::from(steps);
        for _ in 0..steps {
            v += h * (pair[0][1] - 2.0 * v) / 1.0;
            x += h * v;
            (far, fast) = (far.max(x.abs()), fast.max(v.abs()));
        }
    }
    assert!(far <= 0.4 * 1.01 && fast <= 1.5 * 1.01, "{far} {fast}");
    assert!(far > 0.1, "it hardly moves: {far}");
    // The same seed gives the same bytes, at any number of threads.
    let arguments = [
        &[
            "explore",
            "cart/nominal.xml",
            "--quiet",
            "--out",
            "again",
            "--threads",
            "1",
        ][..],
        &limits,
        &SHORT,
    ]
    .concat();
    ok(&place, &arguments);
    assert_eq!(place.read("again/commands.csv"), text);
    assert!(place.path("fisher-cem-0/report.html").is_file());
}

/// Twenty simulated carts play the motion and are identified: the spread of the estimates is what was expected.
#[test]
fn the_expected_deviation_is_the_actual_one() {
    use std::fmt::Write as _;
    let place = Workplace::new();
    write_study(&place.path("cart"), Truth::None);
    let arguments = [
        &[
            "explore",
            "cart/nominal.xml",
            "--quiet",
            "--out",
            "motion",
            "--unknown",
            "geom/cart/mass:0.4:3",
            "--seconds",
            "2",
        ][..],
        &["--limit-position", "rail:-0.4:0.4", "--limit-force", "8"],
        &["--noise", "x:0.0005", "--noise", "dx:0.005"],
        &SHORT,
    ]
    .concat();
    ok(&place, &arguments);
    let expected = json(&place.read("motion/result.json"))["unknowns"][0]["motion"]
        .as_f64()
        .unwrap();
    let text = place.read("motion/predicted.csv");
    let rows: Vec<Vec<&str>> = text
        .lines()
        .skip(1)
        .map(|l| l.split(',').collect())
        .collect();
    let mut rng = asid::core::Streams::new(3).stream("noise");
    let mut normal = || -> f64 {
        use rand::Rng as _;
        (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0
    };
    let mut off = Vec::new();
    std::fs::create_dir_all(place.path("worlds")).unwrap();
    place.write("worlds/nominal.xml", NOMINAL);
    for world in 0..10 {
        let mut log = "time,ctrl.belt,x,dx,qpos.rail,qvel.rail\n".to_owned();
        for (k, row) in rows.iter().enumerate() {
            let noisy = |cell: &str, sigma: f64, n: f64| -> String {
                let value: Option<f64> = cell.parse().ok();
                value.map_or_else(String::new, |x| (x + sigma * n).to_string())
            };
            let (x, dx) = (noisy(row[2], 5e-4, normal()), noisy(row[3], 5e-3, normal()));
            let start = if k == 0 { "0,0" } else { "," };
            let _ = writeln!(log, "{},{},{x},{dx},{start}", row[0], row[1]);
        }
        place.write("worlds/a.csv", &log);
        place.write("worlds/b.csv", &log);
        place.write(
            "worlds/study.toml",
            "model = \"nominal.xml\"\ntrain = [\"a.csv\"]\ntest = [\"b.csv\"]\n[noise]\nx = 0.0005\ndx = 0.005\n\
             [[parameter]]\nname = \"mass\"\ntarget = \"geom/cart/mass\"\nrange = [0.4, 3.0]\n",
        );
        let said = ok(
            &place,
            &[
                "identify",
                "worlds",
                "--quiet",
                "--json",
                "--out",
                &format!("w{world}"),
            ],
        );
        off.push(json(&said)["parameters"][0]["estimate"].as_f64().unwrap() - 1.0);
    }
    let actual = (off.iter().map(|x| x * x).sum::<f64>() / off.len() as f64).sqrt();
    // Ten draws give a deviation to 22 %: three of these.
    assert!(
        (0.34..1.7).contains(&(actual / expected)),
        "{actual} {expected}"
    );
}

/// A servo of gain `kp` that is asked to go 0.1 m presses with 0.1 kp at first.
#[test]
fn the_force_of_a_servo_is_looked_at_with_the_gain_of_each_point() {
    let xml = NOMINAL.replace(
        r#"<motor name="belt" joint="rail" ctrlrange="-20 20"/>"#,
        r#"<position name="belt" joint="rail" kp="100"/>"#,
    );
    let scene = Scene::from_xml("cart", &xml, &[]).unwrap();
    let backend = (find::<BackendEntry>("mujoco").unwrap().make)().unwrap();
    let model = backend.load(&scene).unwrap();
    let plant = Plant::of(&scene).unwrap();
    let request = LimitRequest {
        force: [("belt".to_owned(), 15.0)].into(),
        ..LimitRequest::default()
    };
    let limits = Limits::new(&plant, &|_| None, &request).unwrap();
    let gain = Parameter {
        name: "gain".into(),
        targets: vec!["actuator/belt/kp".parse().unwrap()],
        range: [50.0, 300.0],
        scale: asid::core::parameter::Scale::Linear,
        unit: "N/m".into(),
    };
    let (parameters, base) = ([gain], [0.0]);
    let mut player =
        Player::new(&*model, &plant, limits, &parameters, &[], (&base, 0.0), 1).unwrap();
    let jobs = [(&[0.1][..], &[100.0][..]), (&[0.1], &[200.0])];
    let plays = player.play(&jobs, 1).unwrap();
    assert!(plays[0].excess.is_none(), "{:?}", plays[0].excess);
    // The cart has moved by less than a millimetre within the step.
    let (what, by) = plays[1].excess.worst.clone().unwrap();
    assert!(what.starts_with("force of `belt`"), "{what}");
    assert!((by - (20.0 / 15.0 - 1.0)).abs() < 0.01, "{by}");
}

#[test]
fn a_joint_that_begins_at_the_end_of_its_range_may_stay_there() {
    let scene = Scene::from_xml("cart", NOMINAL, &[]).unwrap();
    let backend = (find::<BackendEntry>("mujoco").unwrap().make)().unwrap();
    let model = backend.load(&scene).unwrap();
    let plant = Plant::of(&scene).unwrap();
    let begin = |range: [f64; 2]| {
        let request = LimitRequest {
            position: [("rail".to_owned(), range)].into(),
            ..LimitRequest::default()
        };
        let limits = Limits::new(&plant, &|_| None, &request).unwrap();
        let mut player = Player::new(&*model, &plant, limits, &[], &[], (&[0.0], 0.0), 1).unwrap();
        let (at_stop, excess) = player.look_at_begin(&[]).unwrap();
        let range = player.limits().joints[0].position.unwrap();
        (at_stop, excess.worst.map(|(what, _)| what), range)
    };
    let (at_stop, beyond, [low, high]) = begin([0.001, 1.001]);
    assert_eq!((at_stop, beyond), (vec!["rail".to_owned()], None));
    assert!((low + 0.001).abs() < 1e-12 && high == 1.001, "{low} {high}");
    assert_eq!(begin([-1.0, 1.0]), (Vec::new(), None, [-1.0, 1.0]));
    let (at_stop, beyond, _) = begin([0.1, 1.0]);
    assert!(at_stop.is_empty());
    assert_eq!(beyond.unwrap(), "position of `rail` 0.000");
}

#[test]
fn what_is_wrong_is_told_in_one_line() {
    let place = Workplace::new();
    write_study(&place.path("cart"), Truth::None);
    place.write("model.xml", NOMINAL);
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
        (
            vec!["explore", "cart", "--world", "perturbed"],
            "--world: goes with a task",
        ),
        (
            vec!["explore", "cart", "--seconds", "1", "--period", "0.6"],
            "period: 0.6 s is longer than half of the motion",
        ),
        (vec!["explore", "model.xml"], "nothing is sought"),
        (
            vec!["explore", "rod-balancing", "--seconds", "3"],
            "goes with a study or --model",
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
            "limit_position: position of `rail`: 1 is not below 0",
        ),
        (
            vec!["explore", "cart", "--set", "second=3"],
            "--config, --set: unknown field `second`",
        ),
        // The cart begins at 0.
        (
            vec!["explore", "cart", "--limit-position", "rail:0.1:1"],
            "limit_box: the machine begins beyond one: position of `rail` 0.000",
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
    assert_eq!(place.names(), ["cart", "model.xml"]);
}

/// Symptom: "gap on logs held out: 0.00 as given, 0.00 identified" where these logs have six rows. Cause: their starts are open, and
/// fitted to all rows; of what is left, nothing, the mean was 0.
#[test]
fn logs_that_are_all_warm_up_are_called_too_short_for_a_gap() {
    let place = Workplace::new();
    write_study(&place.path("cart"), Truth::None);
    for name in ["test_4.csv", "test_5.csv"] {
        let log = place.read(&format!("cart/{name}"));
        // Six rows, without the columns that give the start.
        let rows = log.lines().take(7);
        let rows: Vec<String> = rows
            .map(|l| l.split(',').take(4).collect::<Vec<_>>().join(",") + "\n")
            .collect();
        place.write(&format!("cart/{name}"), &rows.concat());
    }
    let said = ok(&place, &["identify", "cart", "--quiet", "--out", "fit"]);
    assert!(said.contains("the logs held out are too short"), "{said}");
    let gap = &json(&place.read("fit/result.json"))["gap"];
    assert!(
        gap["nominal"].is_null() && gap["identified"].is_null(),
        "{gap}"
    );
    assert!(gap["identified_fitted"].is_number(), "{gap}");
    let said = ok(&place, &["export", "cart", "--mjcf", "out.xml"]);
    assert!(said.contains("the logs held out are too short"), "{said}");
    assert!(said.contains("gap on the logs fitted"), "{said}");
}

/// Symptom: a panic in `f64::clamp` where the range of one limit of a force passes the other limit, and memory without end where
/// `--seconds` is a million.
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
    // Either end is unknown, and their ranges overlap.
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
