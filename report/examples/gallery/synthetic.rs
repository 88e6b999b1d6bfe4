//! Invented runs, with the shapes and sizes of real ones.

use asid_report::run::*;

/// Truth and estimate of the invented run, m.
const TRUTH: f64 = 0.06;
const ESTIMATE: f64 = 0.0612;
const STD: f64 = 0.0021;

/// A run without any optional data.
pub fn bare_run() -> RunReport {
    RunReport {
        task: "rod-balancing".into(),
        backend: "rapier".into(),
        explorer: "random".into(),
        ..RunReport::default()
    }
}

/// Rod balancing with all optional data.
pub fn full_run() -> RunReport {
    let mut noise = Noise(7);
    RunReport {
        task: "rod-balancing".into(),
        condition: "right".into(),
        backend: "mujoco".into(),
        explorer: "fisher-cem".into(),
        identifier: "reps".into(),
        solver: "cem".into(),
        seed: 3,
        real_world: RealWorld {
            engine: "rapier".into(),
            effects: vec!["actuator-delay@servo:delay=0.03".into()],
            noise: "2 mm, 0.01 rad".into(),
            ..RealWorld::default()
        },
        parameters: vec![parameter(&mut noise)],
        episode: Some(episode()),
        signals: signals(&mut noise),
        exploration: Some(exploration()),
        learning: Some(learning()),
        downstream: Some(downstream(&mut noise)),
        costs: [("explore", 21.4, 1_080_000), ("identify", 9.8, 512_000), ("solve", 14.1, 384_000), ("evaluate", 0.31, 4_200)]
            .map(|(stage, wall_s, physics_steps)| StageCost { stage: stage.into(), wall_s, physics_steps })
            .to_vec(),
        wall_s: 46.2,
        physics_steps: 1_980_200,
        env_steps: 21_600,
        versions: [("asid", "0.1.0"), ("engine", "mujoco 3.3.7"), ("git", "6c5e301")]
            .map(|(name, value)| NamedText { name: name.into(), value: value.into() })
            .to_vec(),
        command: "asid run rod-balancing --backend mujoco --real-backend rapier --truth mass_offset=0.06 \
                  --real-effect actuator-delay@servo:delay=0.03 --seed 3 --out runs/rod-right"
            .into(),
        files: [
            ("result.json", "the numbers"),
            ("config.toml", "the resolved configuration: --config with it repeats the run"),
            ("real_0.csv", "the log of the real episode"),
            ("trace.json", "the data of this page"),
        ]
        .map(|(name, what)| FileEntry { name: name.into(), what: what.into() })
        .to_vec(),
        ..RunReport::default()
    }
}

/// Several unknowns of every kind, two action dimensions, long and hostile names, non-finite
/// numbers.
pub fn crowded_run() -> RunReport {
    let mut noise = Noise(11);
    let mut report = full_run();
    report.task = "sphere-patches <&\"'>".into();
    report.explorer = "fisher-ppo".into();
    report.notes = vec!["2 of 512 simulations diverged and were left out.".into()];
    let logarithmic = (1..=3).map(|i| {
        let center = [2e-5f64, 1.7e-4, 8e-4][i - 1];
        let draw = |z: f64, spread: f64| (center * (spread * z).exp()).clamp(1e-5, 1e-3);
        ParameterReport {
            name: format!("rolling_friction_{i}"),
            unit: "m".into(),
            target: format!("geom/patch_{i}/friction/2"),
            log_scale: true,
            truth: Some(center * 1.05),
            estimate: center,
            std: 0.12 * center,
            interval95: [draw(-1.96, 0.12), draw(1.96, 0.12)],
            prior: Some(Prior::LogUniform {
                low: 1e-5,
                high: 1e-3,
            }),
            narrowing: (0..5)
                .map(|k| Narrowing {
                    iteration: k,
                    quantiles: [-1.96, -0.67, 0.0, 0.67, 1.96]
                        .map(|z| draw(z, 1.3 / f64::from(1 + k * k))),
                })
                .collect(),
            samples: (0..300).map(|_| draw(noise.normal(), 0.12)).collect(),
            ..ParameterReport::default()
        }
    });
    report.parameters = logarithmic.collect();
    report.parameters.push(ParameterReport {
        name: "articulated".into(),
        truth: Some(1.0),
        estimate: 0.97,
        prior: Some(Prior::Binary { probability: 0.5 }),
        ..ParameterReport::default()
    });
    report.learning = Some(LearningCurve {
        x_label: "environment steps".into(),
        y_label: "return".into(),
        x: (0..200).map(|i| 5_000.0 * f64::from(i)).collect(),
        mean: (0..200)
            .map(|i| {
                if i == 60 {
                    f64::NAN
                } else {
                    40.0 * f64::from(i).sqrt() + 12.0 * noise.normal()
                }
            })
            .collect(),
        std: vec![45.0; 200],
        best: vec![],
    });
    if let Some(downstream) = &mut report.downstream {
        downstream.value = 0.31;
        downstream.success = false;
        downstream.metric = "goal_distance_m".into();
        downstream.label = String::new();
        downstream.unit = "m".into();
        downstream.threshold = Some(0.05);
        downstream.phases = (0..12u8)
            .map(|i| Phase {
                name: format!("phase number {i}"),
                start: 0.2 * f64::from(i),
                end: 0.2 * f64::from(i + 1),
            })
            .collect();
        if let Some(search) = &mut downstream.search {
            search.chosen.push(NamedValue {
                name: "speed".into(),
                value: 0.42,
                unit: "m/s".into(),
            });
            search.cost_unit = "m".into();
            for trial in &mut search.trials {
                trial.action.push(0.42 + 0.1 * noise.normal());
            }
            search.trials[3].cost = f64::INFINITY;
        }
    }
    report.exploration = None;
    report
}

fn parameter(noise: &mut Noise) -> ParameterReport {
    let narrowing = (0..=8).map(|iteration| {
        let spread = 0.055 * 0.55f64.powi(iteration) + STD;
        let center = ESTIMATE * (1.0 - 0.5f64.powi(iteration));
        let z = if iteration == 0 {
            [-1.7, -0.9, 0.0, 0.9, 1.7]
        } else {
            [-1.96, -0.674, 0.0, 0.674, 1.96]
        };
        Narrowing {
            iteration: iteration as u32,
            quantiles: z.map(|z| (center + z * spread).clamp(-0.1, 0.1)),
        }
    });
    ParameterReport {
        name: "mass_offset".into(),
        unit: "m".into(),
        target: "body/rod_mass/pos/1".into(),
        truth: Some(TRUTH),
        estimate: ESTIMATE,
        std: STD,
        interval95: [ESTIMATE - 1.96 * STD, ESTIMATE + 1.96 * STD],
        prior: Some(Prior::Uniform {
            low: -0.1,
            high: 0.1,
        }),
        narrowing: narrowing.collect(),
        samples: (0..400).map(|_| ESTIMATE + STD * noise.normal()).collect(),
        ..ParameterReport::default()
    }
}

/// Pose of the rod when its mass is `offset` from the middle: pushed at its middle, it turns about
/// the mass.
fn pose(t: f64, offset: f64) -> [f64; 3] {
    let push = ((t - 0.45) / 1.3).clamp(0.0, 1.0);
    let smooth = push * push * (3.0 - 2.0 * push);
    [
        0.55 + 0.09 * smooth,
        0.05 - 0.05 * smooth - 0.4 * offset * smooth,
        1.35 - 11.0 * offset * smooth - 0.1 * smooth,
    ]
}

fn episode() -> Episode {
    let steps = || (0..=20).map(|i| 0.1 * f64::from(i));
    let (a, b) = (0.02, 0.15);
    Episode {
        objects: vec![ObjectTrack {
            name: "rod".into(),
            outline: vec![[-a, -b], [a, -b], [a, b], [-a, b]],
            round: false,
            time: steps().collect(),
            poses: steps().map(|t| pose(t, TRUTH)).collect(),
        }],
        end_effector: Some(PlanarPath {
            time: steps().collect(),
            position: steps()
                .map(|t| {
                    [
                        0.44 + 0.09 * t + 0.02 * (2.0 * t).sin(),
                        0.16 - 0.1 * t + 0.03 * (2.6 * t).cos(),
                    ]
                })
                .collect(),
        }),
        workspace: Some([0.12, 1.0, -1.0, 1.0]),
        shapes: vec![Shape {
            label: "ledge".into(),
            kind: ShapeKind::Goal,
            points: vec![[0.6, -0.3], [0.64, -0.3], [0.64, -0.18], [0.6, -0.18]],
            radius: None,
        }],
    }
}

fn signals(noise: &mut Noise) -> Vec<Signal> {
    let fine: Vec<f64> = (0..=200).map(|i| 0.01 * f64::from(i)).collect();
    [
        ("rod_pos.0", "m", 0.002),
        ("rod_pos.1", "m", 0.002),
        ("rod_yaw", "rad", 0.01),
    ]
    .iter()
    .enumerate()
    .map(|(k, (name, unit, std))| {
        let time: Vec<f64> = (0..=20).map(|i| 0.1 * f64::from(i)).collect();
        let replay = |offset: f64, width: f64| Replay {
            time: fine.clone(),
            value: fine.iter().map(|&t| pose(t, offset)[k]).collect(),
            band95: fine
                .iter()
                .map(|&t| [pose(t, offset - width)[k], pose(t, offset + width)[k]])
                .collect(),
        };
        let mut readings: Vec<f64> = time
            .iter()
            .map(|&t| pose(t, TRUTH)[k] + std * noise.normal())
            .collect();
        readings[13] = f64::NAN;
        Signal {
            name: (*name).into(),
            unit: (*unit).into(),
            noise_std: Some(*std),
            time,
            readings,
            before: Some(Replay {
                band95: vec![],
                ..replay(0.0, 0.0)
            }),
            after: Some(replay(ESTIMATE, 2.0 * STD)),
        }
    })
    .collect()
}

fn exploration() -> Exploration {
    let time: Vec<f64> = (1..=20).map(|i| 0.1 * f64::from(i)).collect();
    let gained: Vec<f64> = time
        .iter()
        .map(|t| 0.9 * (-((t - 1.0) / 0.33).powi(2)).exp() + if *t > 0.4 { 0.03 } else { 0.0 })
        .collect();
    let mut sum = 0.0;
    let value = gained.iter().map(|g| {
        sum += g;
        0.0577 * (-0.5 * sum).exp()
    });
    let value = value.collect();
    Exploration {
        objective: "d-optimal".into(),
        form: "trajectory".into(),
        time,
        gained,
        gained_unit: "nat".into(),
        expected_std: vec![ExpectedStd {
            parameter: "mass_offset".into(),
            unit: "m".into(),
            prior: Some(0.0577),
            value,
        }],
        contact_fraction: Some(0.65),
    }
}

fn learning() -> LearningCurve {
    let rise = |i: f64| 6.4 * (1.0 - (-0.35 * i).exp());
    let x: Vec<f64> = (0..12).map(f64::from).collect();
    LearningCurve {
        x_label: "iteration".into(),
        y_label: "return".into(),
        mean: x.iter().map(|&i| rise(i)).collect(),
        std: x.iter().map(|&i| 0.3 + 1.6 * (-0.25 * i).exp()).collect(),
        best: x
            .iter()
            .map(|&i| rise(i) + 0.5 + 1.9 * (-0.25 * i).exp())
            .collect(),
        x,
    }
}

fn downstream(noise: &mut Noise) -> Downstream {
    let time: Vec<f64> = (0..=3600).map(|i| 0.002 * f64::from(i)).collect();
    let tilt = |t: f64| match t {
        t if t < 2.1 => 0.02,
        t if t < 3.6 => 2.6 * ((t - 2.1) / 1.5).sin().abs() + 0.25 * (18.0 * t).sin(),
        t if t < 5.2 => 2.2 * (-(t - 3.6) * 0.8).exp() + 0.15 * (15.0 * t).sin(),
        t => 0.3 + 1.4 * (-(t - 5.2) * 4.0).exp() * (22.0 * (t - 5.2)).cos().abs(),
    };
    let phases = [
        ("above", 0.0, 1.3),
        ("grasp", 1.3, 2.1),
        ("lift", 2.1, 3.6),
        ("place", 3.6, 5.2),
        ("release", 5.2, 5.6),
        ("rise", 5.6, 7.2),
    ];
    let mut trials = Vec::new();
    for iteration in 0..6 {
        let (center, spread) = (
            ESTIMATE * (1.0 - 0.4f64.powi(iteration)),
            0.05 * 0.5f64.powi(iteration),
        );
        for _ in 0..40 {
            let action = center + spread * noise.normal();
            let cost = if (action - TRUTH).abs() > 0.045 {
                18.0 + noise.normal()
            } else {
                230.0 * (action - TRUTH).abs() + 0.3 * noise.normal().abs()
            };
            trials.push(Trial {
                iteration: iteration as u32,
                action: vec![action],
                cost,
            });
        }
    }
    let rectangle =
        |x0: f64, x1: f64, y0: f64, y1: f64| vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]];
    let shape = |label: &str, kind: ShapeKind, points: Vec<[f64; 2]>| Shape {
        label: label.into(),
        kind,
        points,
        radius: None,
    };
    Downstream {
        metric: "tilt_deg".into(),
        label: "tilt".into(),
        unit: "deg".into(),
        value: 0.31,
        success: true,
        rule: "below 5° and still on the ledge".into(),
        threshold: Some(5.0),
        metric_over_time: time.iter().map(|&t| tilt(t).max(0.0)).collect(),
        time,
        phases: phases
            .map(|(name, start, end)| Phase {
                name: name.into(),
                start,
                end,
            })
            .to_vec(),
        search: Some(Search {
            chosen: vec![NamedValue {
                name: "pick_offset".into(),
                value: 0.0607,
                unit: "m".into(),
            }],
            cost_label: "expected tilt".into(),
            cost_unit: "deg".into(),
            trials,
        }),
        side_view: Some(SideView {
            x_label: "along the rod".into(),
            floor: Some(0.0),
            shapes: vec![
                shape("ledge", ShapeKind::Fixed, rectangle(-0.02, 0.02, 0.0, 0.15)),
                shape("rod", ShapeKind::Object, rectangle(-0.21, 0.09, 0.15, 0.19)),
                shape(
                    "its mass",
                    ShapeKind::Part,
                    rectangle(-0.02, 0.02, 0.155, 0.185),
                ),
            ],
        }),
    }
}

/// Normal random numbers from a linear congruential generator: sufficient for a picture.
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
