//! `asid explore`: motions within limits, and the information that is expected of them.

use serde_json::Value;

use super::cli_support::Workplace;
use super::world::{NOMINAL, Truth, write_study};
use super::{json, ok};

/// Options for a short search.
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
    // A cart is linear: a periodic motion that uses its limits fully is nearly optimal, and a short
    // search comes close to it.
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
    // An independent cart, integrated by hand, stays within the limits too.
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
    // The same seed gives the same bytes with any number of threads.
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

/// Ten simulated carts play the motion and are identified. The spread of the estimates agrees
/// with the expected standard deviation.
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
    // Ten draws give a standard deviation to 22 %; the bounds are three times that.
    assert!(
        (0.34..1.7).contains(&(actual / expected)),
        "{actual} {expected}"
    );
}

/// Designs a motion for a variant of the cart; returns its result and the standard output.
fn design_for(model: &str, options: &[&str]) -> (Value, String) {
    let place = Workplace::new();
    place.write("cart.xml", model);
    let unknown = ["--unknown", "geom/cart/mass:0.4:3", "--seconds", "2"];
    let call = ["explore", "cart.xml", "--quiet", "--out", "motion"];
    let said = ok(&place, &[&call[..], &unknown, options, &SHORT].concat());
    (json(&place.read("motion/result.json")), said)
}

/// Symptom: "no actuator has a range to move in: … such as --limit-position JOINT:LOW:HIGH", with
/// this very limit given. Cause: only a command's range, a servo's joint range or a force limit
/// bounds a drive.
#[test]
fn a_limit_of_the_joint_alone_is_enough_for_a_motion() {
    let free = NOMINAL.replace(r#"ctrlrange="-20 20""#, "");
    assert_ne!(free, NOMINAL);
    let known = |limit: [&str; 2]| {
        let (result, said) = design_for(&free, &limit);
        assert_eq!(result["broken"], Value::Null, "{said}");
        let of = |key: &str| result["unknowns"][0][key].as_f64().unwrap();
        of("motion") / of("prior")
    };
    assert!(known(["--limit-position", "rail:-0.4:0.4"]) < 0.1);
    assert!(known(["--limit-speed", "rail:1"]) < 0.1);
}

/// Symptom: a joint that begins at the end of its range is refused. Cause: only an end of the limit
/// counts, 2 % within the range.
#[test]
fn a_joint_may_stay_at_the_end_of_its_range_where_the_limit_ends_before_it() {
    let rail = r#"<joint name="rail""#;
    let ended = NOMINAL.replace(rail, &format!("{rail} limited=\"true\" range=\"0 1\""));
    assert_ne!(ended, NOMINAL);
    let (result, said) = design_for(&ended, &["--limit-force", "8"]);
    assert_eq!(result["broken"], Value::Null, "{said}");
    assert!(
        said.contains("at rest at the end of the range, and may stay there: rail"),
        "{said}"
    );
}

/// Symptom: what "your logs so far tell" was the same with any `--noise`. Cause: the option counted
/// for the motion alone, and the logs had the noise of the study. In a linear machine a deviation
/// is proportional to the noise.
#[test]
fn the_noise_of_the_options_holds_for_the_logs_too() {
    let place = Workplace::new();
    write_study(&place.path("cart"), Truth::None);
    let known = |noise: [&str; 2]| {
        let design = ["explore", "cart", "--quiet", "--explorer", "random"];
        let limit = ["--limit-position", "rail:-0.4:0.4", "--seconds", "2"];
        let noise = ["--json", "--noise", noise[0], "--noise", noise[1]];
        let said = ok(&place, &[&design[..], &limit, &noise, &SHORT].concat());
        json(&said)["unknowns"][0]["logs"].as_f64().unwrap()
    };
    let (once, twice) = (known(["x:0.001", "dx:0.01"]), known(["x:0.002", "dx:0.02"]));
    // The prior's own information is less than a thousandth of that of the logs.
    assert!((twice / once - 2.0).abs() < 0.01, "{once} {twice}");
}
