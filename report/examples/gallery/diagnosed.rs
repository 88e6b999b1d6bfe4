//! Invented diagnoses, with the shapes and sizes of real ones.

#[path = "missing.rs"]
mod missing;

use std::collections::BTreeMap;

use asid_results::diagnosis::*;
use asid_results::trace::*;

/// The data of a page.
#[derive(Clone, Default)]
pub struct Diagnosis {
    pub result: DiagnosisResult,
    pub trace: DiagnosisTrace,
}

/// Names as owned texts.
fn names(names: &[&str]) -> Vec<String> {
    names.iter().map(|n| (*n).to_owned()).collect()
}

fn texts(pairs: &[(&str, &str)]) -> Vec<NamedText> {
    let text = |(name, value): &(&str, &str)| NamedText::new(*name, *value);
    pairs.iter().map(text).collect()
}

fn hypothesis(effects: &[&str], probability: f64) -> HypothesisResult {
    HypothesisResult {
        effects: names(effects),
        probability,
    }
}

/// An effect with its values by name.
fn effect(label: [&str; 2], probability: f64, closes: f64, values: &[(&str, f64)]) -> EffectResult {
    let values = values.iter().map(|(name, value)| ((*name).into(), *value));
    EffectResult {
        effect: label[0].into(),
        site: label[1].into(),
        probability,
        gap_closed: Some(closes),
        parameters: values.collect(),
        ..EffectResult::default()
    }
}

/// The catalogue's entry of an effect: unit and null value of its parameters by name.
fn words(name: &str, about: &str, parameters: &[(&str, &str, f64)]) -> (String, EffectWords) {
    let words = |(name, unit, null): &(&str, &str, f64)| {
        let unit = (*unit).to_owned();
        ((*name).into(), ParameterWords { unit, null: *null })
    };
    let words = EffectWords {
        about: about.into(),
        parameters: parameters.iter().map(words).collect(),
    };
    (name.into(), words)
}

fn check(name: &str, ok: bool, detail: &str) -> CheckResult {
    CheckResult {
        check: name.into(),
        ok,
        detail: detail.into(),
    }
}

fn signal_gap(signal: &str, unit: &str, noise: f64, gaps: [f64; 3]) -> SignalGap {
    let [nominal, identified, refined] = gaps;
    SignalGap {
        signal: signal.into(),
        unit: unit.into(),
        noise,
        nominal,
        identified,
        refined,
    }
}

/// Its gap, in total and by signal.
fn patch_gap() -> Gap {
    Gap {
        nominal: 41.3,
        identified: 14.2,
        refined: 1.9,
        closed: Some(0.984),
        closed_interval95: Some([0.961, 0.993]),
        shares: Some(Shares {
            named: 0.984,
            learnable: 0.01,
            unrepeatable: 0.006,
        }),
        signals: vec![
            signal_gap("puck_pos", "m", 0.002, [48.0, 16.5, 2.1]),
            signal_gap("puck_yaw", "rad", 0.01, [12.3, 5.2, 1.2]),
        ],
        ..Gap::default()
    }
}

/// Where the gap lies.
fn patch_places() -> Vec<Where> {
    [
        (
            "puck_pos.0",
            "sliding, puck/board",
            0.71,
            "puck_pos.0 > 0.41",
        ),
        (
            "puck_pos.1",
            "sliding, puck/board",
            0.13,
            "puck_pos.0 > 0.41",
        ),
        ("puck_yaw", "sliding, puck/board", 0.09, ""),
        ("puck_pos.0", "contact pusher/puck", 0.05, ""),
        ("puck_pos.0", "sticking", 0.018, ""),
        ("puck_yaw", "start-up", 0.002, ""),
    ]
    .map(
        |(signal, regime, share, condition): (&str, &str, f64, &str)| Where {
            signal: signal.into(),
            regime: regime.into(),
            share,
            condition: (!condition.is_empty()).then(|| condition.into()),
        },
    )
    .into()
}

/// Effects that were tried.
fn patch_effects() -> Vec<EffectResult> {
    vec![
        effect(
            ["friction-patch", "board"],
            0.71,
            0.984,
            &[("axis", 0.0), ("place", 0.4112), ("ratio", 1.812)],
        ),
        effect(
            ["friction-drift", "board"],
            0.22,
            0.957,
            &[("per_second", 0.62)],
        ),
        effect(
            ["gravity-tilt", ""],
            0.034,
            0.31,
            &[("pitch", -0.021), ("roll", 0.004)],
        ),
        effect(
            ["friction-anisotropy", "board"],
            0.034,
            0.42,
            &[("cos_2", 0.12)],
        ),
        effect(
            ["linear-drag", "puck"],
            0.0048,
            0.66,
            &[("coefficient", 0.31)],
        ),
    ]
}

/// What its task gains from the refined model.
fn patch_in_the_real_world() -> RealWorld {
    RealWorld {
        task: "shuffleboard".into(),
        condition: "far".into(),
        metric: "zone_error_m".into(),
        unit: "m".into(),
        rule: "at rest in the far zone".into(),
        effects: vec!["friction-patch@board:ratio=0.35,place=0.75".into()],
        truth: vec![("sliding_friction".into(), 0.02)],
        trials: [
            (
                "a real world without the effect",
                "the model as given",
                0.06,
                3,
            ),
            ("the real world", "the model as given", 0.4, 0),
            ("the real world", "the refined model", 0.08, 3),
        ]
        .map(|(world, simulator, error, successes)| TaskTrial {
            world: world.into(),
            simulator: simulator.into(),
            values: vec![0.5 * error, error, error, 1.5 * error],
            successes,
        })
        .into(),
        ..RealWorld::default()
    }
}

/// Catalogue entries of the effects that were tried.
fn patch_catalogue() -> BTreeMap<String, EffectWords> {
    [
        words(
            "friction-patch",
            "sliding friction differs beyond a place",
            &[("axis", "", 0.0), ("place", "m", 0.0), ("ratio", "1", 1.0)],
        ),
        words(
            "friction-drift",
            "sliding friction changes over time",
            &[("per_second", "1/s", 0.0)],
        ),
        words(
            "gravity-tilt",
            "the ground is not level",
            &[("pitch", "rad", 0.0), ("roll", "rad", 0.0)],
        ),
        words(
            "friction-anisotropy",
            "sliding friction differs by direction",
            &[("cos_2", "1", 0.0)],
        ),
        words(
            "linear-drag",
            "a drag in proportion to speed",
            &[("coefficient", "N s/m", 0.0)],
        ),
    ]
    .into()
}

/// What each explanation leaves of the gap.
fn patch_ladder() -> Vec<Rung> {
    [
        ("friction-patch@board", 1.9),
        ("friction-drift@board", 3.1),
        ("linear-drag@puck", 8.3),
        ("friction-anisotropy@board", 10.9),
        ("gravity-tilt", 11.8),
        ("payload@puck", 14.1),
    ]
    .map(|(label, gap)| Rung {
        label: label.into(),
        gap,
    })
    .into()
}

/// A puck on a board with a rougher far half, which one other effect explains equally well.
pub fn patch() -> Diagnosis {
    let signals = puck();
    let map = map(&signals);
    let result = DiagnosisResult {
        study: "puck-on-board".into(),
        sentence: "The real board is rougher beyond 0.41 m: sliding friction there is 1.8 times the modelled one, which closes 98 % of the gap."
            .into(),
        gap: patch_gap(),
        places: patch_places(),
        hypotheses: vec![
            hypothesis(&["friction-patch@board"], 0.71),
            hypothesis(&["friction-drift@board"], 0.22),
            hypothesis(&["friction-anisotropy@board", "gravity-tilt"], 0.034),
            hypothesis(&["unknown"], 0.031),
            hypothesis(&["linear-drag@puck"], 0.0048),
            hypothesis(&["none"], 1e-9),
        ],
        effects: patch_effects(),
        verdict: Verdict {
            kind: Kind::Effects,
            effects: names(&["friction-patch@board"]),
            probability: 0.71,
            ambiguous_with: vec![names(&["friction-drift@board"])],
            unexplained: 0.016,
            remainder: Some(Remainder {
                share: 0.016,
                place: "puck_pos".into(),
                against: "rate of puck_pos".into(),
                kinds: names(&["friction-like", "delay-like"]),
            }),
        },
        parameters: vec![
            ParameterResult { name: "board_friction".into(), unit: String::new(), nominal: Some(0.4), estimate: 0.2213, std: 0.0031, interval95: [0.2152, 0.2274] },
            ParameterResult { name: "puck_mass".into(), unit: "kg".into(), nominal: Some(0.2), estimate: 0.2021, std: f64::NAN, interval95: [f64::NAN; 2] },
        ],
        checks: vec![
            check("time stamps", true, "even to 0.1 ms"),
            check("missing readings", true, "3 % of puck_pos, spread evenly"),
            check("excitation", false, "puck_mass does not show in any reading: it was kept at its value. Push harder, or weigh the puck."),
            check("time step", true, "halving it changes no reading by more than 0.1 of its noise"),
        ],
        next_experiment: NextExperiment {
            separates: names(&["friction-patch@board", "friction-drift@board"]),
            how: "slide the puck across 0.41 m once more after waiting, then back across it: a rough place stays where it is, wear grows \
                          with every pass."
                .into(),
            file: "next.csv".into(),
        },
        real_world: Some(patch_in_the_real_world()),
        ..DiagnosisResult::default()
    };
    let trace = DiagnosisTrace {
        catalogue: patch_catalogue(),
        held_out: 3,
        fitted_to: 9,
        ladder: patch_ladder(),
        signals,
        map: Some(map),
        left_out: texts(&[
            ("contact-restitution@board", "rapier cannot set it"),
            (
                "inertia@puck",
                "cannot be joined with the study's geom/puck/mass",
            ),
        ]),
        engine: "rapier 0.36.1".into(),
        command:
            "asid diagnose studies/puck-on-board --backend rapier --seed 0 --out diagnoses/puck"
                .into(),
        versions: texts(&[("asid", "0.1.0"), ("seed", "0"), ("git", "6c5e301")]),
        files: [
            ("result.json", "the numbers"),
            ("trace.json", "the data of the pictures"),
            ("refined.toml", "the refined model, for every command"),
        ]
        .map(|(name, what)| FileEntry {
            name: name.into(),
            what: what.into(),
        })
        .into(),
        ..DiagnosisTrace::default()
    };
    Diagnosis { result, trace }
}

/// A pendulum whose model is complete.
pub fn complete() -> Diagnosis {
    let trace = |episode: usize| {
        let time: Vec<f64> = (0..90).map(|i| 0.05 * f64::from(i)).collect();
        let swing = |t: f64, damping: f64| (-damping * t).exp() * (4.1 * t + episode as f64).sin();
        let mut noise = Noise(3 + episode as u64);
        SignalTrace {
            episode: format!("swing_{episode}.csv"),
            signal: "angle".into(),
            unit: "rad".into(),
            noise: 0.01,
            real: time
                .iter()
                .map(|t| swing(*t, 0.21) + 0.01 * noise.normal())
                .collect(),
            nominal: time.iter().map(|t| swing(*t, 0.1)).collect(),
            identified: time.iter().map(|t| swing(*t, 0.2101)).collect(),
            refined: time.iter().map(|t| swing(*t, 0.2101)).collect(),
            time,
        }
    };
    let result = DiagnosisResult {
        study: "pendulum".into(),
        sentence: "Nothing is missing: with its damping fitted, the model predicts the pendulum as well as the sensor allows.".into(),
        gap: Gap { nominal: 11.2, identified: 1.02, refined: 1.02, ..Gap::default() },
        hypotheses: vec![hypothesis(&["none"], 0.97), hypothesis(&["coulomb-friction@hinge"], 0.02), hypothesis(&["unknown"], 0.01)],
        verdict: Verdict { kind: Kind::None, effects: vec![], probability: 0.97, ambiguous_with: vec![], unexplained: 0.0, remainder: None },
        parameters: vec![ParameterResult {
            name: "damping".into(),
            unit: "N m s/rad".into(),
            nominal: Some(0.1),
            estimate: 0.2101,
            std: 0.0007,
            interval95: [0.2087, 0.2115],
        }],
        checks: vec![check("excitation", true, "every parameter shows")],
        ..DiagnosisResult::default()
    };
    let trace = DiagnosisTrace {
        held_out: 2,
        signals: (0..2).map(trace).collect(),
        engine: "mujoco 3.3.7".into(),
        ..DiagnosisTrace::default()
    };
    Diagnosis { result, trace }
}

/// The same diagnosis by the missing force, stopped early.
pub fn by_force() -> Diagnosis {
    let mut d = patch();
    d.trace.map = None;
    missing::add(&mut d);
    d
}

/// A gap that nothing explains, with many signals, hostile names, missing readings and diverging
/// simulations.
pub fn crowded() -> Diagnosis {
    let long = "friction-anisotropy@a_body_with_a_name_that_is_much_too_long_for_a_phone";
    let mut patch = patch();
    let d = &mut patch.result;
    d.study = "arm <&\"'>".into();
    d.sentence = String::new();
    d.verdict = Verdict {
        kind: Kind::Unknown,
        effects: names(&["unknown"]),
        probability: 0.58,
        ambiguous_with: vec![],
        unexplained: 0.44,
        remainder: None,
    };
    d.gap = Gap {
        nominal: 2300.0,
        identified: 96.4,
        refined: 96.4,
        closed: Some(0.0),
        ..Gap::default()
    };
    d.hypotheses = vec![
        hypothesis(&["unknown"], 0.58),
        hypothesis(&[long, "stribeck-friction@joint_1"], 0.2),
    ];
    d.hypotheses
        .extend((0..14).map(|i| hypothesis(&[&format!("armature@joint_{i}")], 0.015)));
    d.hypotheses.push(hypothesis(&["none"], f64::NAN));
    let t = &mut patch.trace;
    t.ladder = (0..23)
        .map(|i| Rung {
            label: format!("armature@joint_{i}"),
            gap: 50.0 + f64::from(i),
        })
        .collect();
    t.ladder.push(Rung {
        label: long.into(),
        gap: f64::INFINITY,
    });
    d.places = (0..17)
        .map(|i| Where {
            signal: format!("joint_{i}_pos"),
            regime: if i % 2 == 0 {
                "reversal".into()
            } else {
                long.into()
            },
            share: 1.0 / 17.0,
            condition: None,
        })
        .collect();
    t.signals = (0..5).flat_map(arm).collect();
    t.map = None;
    d.checks.push(check(
        "<b>units</b>",
        false,
        "joint_3_pos looks like degrees & not rad",
    ));
    patch
}

/// Seven signals of an arm; every fourth row has a reading, one stretch has none.
fn arm(episode: usize) -> impl Iterator<Item = SignalTrace> {
    (0..7).map(move |joint| {
        let time: Vec<f64> = (0..1200).map(|i| 0.005 * f64::from(i)).collect();
        let there = |i: usize| i.is_multiple_of(4) && !(500..640).contains(&i);
        let truth = |t: f64| (1.3 * t + joint as f64).sin() + 0.2 * (5.0 * t).cos();
        let mut noise = Noise((episode * 7 + joint) as u64 + 1);
        let mut made = |error: &dyn Fn(f64) -> f64, noisy: f64| -> Vec<f64> {
            let value = |(i, t): (usize, &f64)| {
                if there(i) {
                    truth(*t) + error(*t) + noisy * noise.normal()
                } else {
                    f64::NAN
                }
            };
            time.iter().enumerate().map(value).collect()
        };
        SignalTrace {
            episode: format!("log_{episode}.csv"),
            signal: format!("joint_{joint}_pos"),
            unit: "rad".into(),
            noise: if joint == 6 { f64::NAN } else { 0.001 },
            real: made(&|_| 0.0, 0.001),
            nominal: made(&|t| (2.0 * t).exp() * 1e-3, 0.0),
            identified: made(&|t| 0.1 * (0.2 + 0.1 * joint as f64) * (3.0 * t).sin(), 0.0),
            refined: made(&|t| 0.1 * (0.2 + 0.1 * joint as f64) * (3.0 * t).sin(), 0.0),
            time,
        }
    })
}

/// Signal, unit, noise, and its dependence on the distance.
type Part<'a> = (&'static str, &'static str, f64, &'a dyn Fn(f64) -> f64);

/// Three slides of a puck: position and yaw, and the predictions of three models.
fn puck() -> Vec<SignalTrace> {
    let mut noise = Noise(17);
    let mut signals = Vec::new();
    for (episode, speed) in [1.35, 1.6, 1.15].into_iter().enumerate() {
        let time: Vec<f64> = (0..100).map(|i| 0.02 * f64::from(i)).collect();
        let models = [
            slide(&time, speed, [0.4, 0.4]),
            slide(&time, speed, [0.29, 0.29]),
            slide(&time, speed, [0.223, 0.4]),
            slide(&time, speed, [0.2213, 0.4001]),
        ];
        let drift = [0.11, -0.06, 0.02][episode];
        let parts: [Part<'_>; 3] = [
            ("puck_pos.0", "m", 0.002, &|x| x),
            ("puck_pos.1", "m", 0.002, &|x| drift * x),
            ("puck_yaw", "rad", 0.01, &|x| 0.6 * drift * x.sqrt()),
        ];
        for (signal, unit, deviation, from) in parts {
            let [nominal, identified, refined, truth] = models
                .each_ref()
                .map(|m| m.iter().map(|x| from(*x)).collect::<Vec<_>>());
            let mut real: Vec<f64> = truth
                .iter()
                .map(|x| x + deviation * noise.normal())
                .collect();
            // The tracker lost the puck for a moment.
            real[61..70].fill(f64::NAN);
            signals.push(SignalTrace {
                episode: format!("test_{episode}.csv"),
                signal: signal.into(),
                unit: unit.into(),
                noise: deviation,
                time: time.clone(),
                real,
                nominal,
                identified,
                refined,
            });
        }
    }
    signals
}

/// Distance that a puck has slid, with one friction up to 0.41 m and another beyond.
fn slide(time: &[f64], speed: f64, friction: [f64; 2]) -> Vec<f64> {
    let (mut x, mut v) = (0.0, speed);
    let mut path = Vec::with_capacity(time.len());
    for _ in time {
        path.push(x);
        for _ in 0..20 {
            let mu = friction[usize::from(x > 0.41)];
            v = f64::max(v - 9.81 * mu * 0.001, 0.0);
            x += v * 0.001;
        }
    }
    path
}

fn map(signals: &[SignalTrace]) -> Map {
    let mut points = Vec::new();
    for pair in signals.chunks(3) {
        for i in 0..pair[0].time.len() {
            let residual = (pair[0].real[i] - pair[0].identified[i]) / pair[0].noise;
            points.push([pair[0].real[i], pair[1].real[i], residual.abs()]);
        }
    }
    Map {
        axes: ["puck_pos.0".into(), "puck_pos.1".into()],
        unit: "m".into(),
        points,
    }
}

/// Small normal random numbers from a simple generator.
struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}
