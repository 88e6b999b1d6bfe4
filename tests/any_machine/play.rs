//! Motions that are simulated: their information, and their limits.

use std::sync::Arc;

use asid::core::registry::{BackendEntry, find};
use asid::core::signal::Signal;
use asid::core::{Model, Parameter, Scene};
use asid::mjcf::Plant;
use asid::sysid::limits::{LimitRequest, Limits};
use asid::sysid::play::Player;
use asid::sysid::tells::{differences, of_plays};

use super::mass;
use super::world::NOMINAL;

/// Without friction a cart's position is `F(t) / m`, with `F` a function of the commands alone. Its
/// derivative with respect to the mass is therefore `-x / m`, and the information of the position
/// readings is the sum of `(x / (m σ))²`.
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
    // In standard deviations of the prior: that of a uniform prior is its width over the root of
    // twelve.
    let prior = 2.6 / 12.0_f64.sqrt();
    let found = told.matrix[(0, 0)] / (prior * prior);
    // Central differences of 1/m over 0.02 standard deviations are off by their third derivative.
    assert!((found / expected - 1.0).abs() < 1e-3, "{found} {expected}");
}

/// The cart with a position servo of some gains, whose force has a limit of 15 N.
fn servo_within_15_n(gains: &str) -> (Arc<dyn Model>, Plant, Limits) {
    let xml = NOMINAL.replace(
        r#"<motor name="belt" joint="rail" ctrlrange="-20 20"/>"#,
        &format!(r#"<position name="belt" joint="rail" {gains}/>"#),
    );
    let scene = Scene::from_xml("cart", &xml, &[]).unwrap();
    let backend = (find::<BackendEntry>("mujoco").unwrap().make)().unwrap();
    let plant = Plant::of(&scene).unwrap();
    let request = LimitRequest {
        force: [("belt".to_owned(), 15.0)].into(),
        ..LimitRequest::default()
    };
    let limits = Limits::new(&plant, &|_| None, &request).unwrap();
    (backend.load(&scene).unwrap(), plant, limits)
}

/// A servo of gain `kp` with a command of 0.1 m begins with a force of 0.1 kp.
#[test]
fn the_force_of_a_servo_is_looked_at_with_the_gain_of_each_point() {
    let (model, plant, limits) = servo_within_15_n(r#"kp="100""#);
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
    let (what, by) = plays[1].excess.worst.clone().unwrap();
    assert!(what.starts_with("force of `belt`"), "{what}");
    assert!((by - (20.0 / 15.0 - 1.0)).abs() < 1e-9, "{by}");
}

/// Symptom: a motion that keeps its limits asked a servo for a third more force than allowed.
///
/// Cause: the force was computed at the state after the step, when a stiff servo has moved already.
#[test]
fn the_force_of_a_servo_is_largest_as_its_command_begins() {
    let (model, plant, limits) = servo_within_15_n(r#"kp="20000" kv="200""#);
    for substeps in [1, 5] {
        let limits = limits.clone();
        let mut player = Player::new(&*model, &plant, limits, &[], &[], (&[0.0], 0.0), 1).unwrap();
        let plays = player
            .play(&[(&[0.001, 0.001, 0.001], &[])], substeps)
            .unwrap();
        let by = plays[0].excess.worst.as_ref().unwrap().1;
        assert!((by - (20.0 / 15.0 - 1.0)).abs() < 1e-9, "{by}");
    }
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
    assert_eq!(
        beyond.unwrap(),
        "position of `rail` 0.000, 0.100 beyond its limit of 0.100 to 1.000"
    );
}
