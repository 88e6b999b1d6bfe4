//! Columns of other stacks match their quantities.

use super::*;

const ARM: &str = r#"<mujoco><compiler angle="radian"/><worldbody>
  <body name="upper"><joint name="shoulder_pan" axis="0 0 1" range="-1.9 1.9"/><geom size="0.1" mass="1"/>
    <body name="lower"><joint name="elbow" axis="0 1 0" range="-1.6 1.6"/><geom size="0.1" mass="1"/>
      <body name="jaw"><joint name="gripper" axis="0 1 0" range="-0.2 1.7"/><geom size="0.1" mass="0.1"/></body></body></body>
  <body name="puck" pos="1 0 0"><freejoint/><geom size="0.1" mass="0.1"/></body>
  </worldbody>
  <actuator><position name="shoulder_pan" joint="shoulder_pan" kp="9"/><position name="elbow" joint="elbow" kp="9"/>
    <position name="gripper" joint="gripper" kp="9"/></actuator>
  <sensor><jointpos name="q_pan" joint="shoulder_pan"/><jointpos name="q_elbow" joint="elbow"/><jointpos name="q_gripper" joint="gripper"/>
    <jointvel name="dq_pan" joint="shoulder_pan"/><jointvel name="dq_elbow" joint="elbow"/>
    <framepos name="puck_pos" objtype="body" objname="puck"/><framequat name="puck_quat" objtype="body" objname="puck"/></sensor></mujoco>"#;

/// A joint's motion, rad: each joint has another sine.
fn motion(joint: usize, t: f64) -> f64 {
    let k = joint as f64;
    0.6 + 0.5 * ((2.0 + 0.7 * k) * t + k).sin()
}

fn series(stream: &str, name: &str, f: impl Fn(f64) -> f64) -> Series {
    let time: Vec<f64> = (0..300).map(|k| 0.01 * f64::from(k)).collect();
    Series {
        name: format!("{stream}{name}"),
        stream: stream.into(),
        values: time.iter().map(|t| f(*t)).collect(),
        time,
    }
}

fn proposed(series: Vec<Series>, kind: LogFormat) -> Proposal {
    let scene = Scene::from_xml("arm", ARM, &[]).unwrap();
    let plant = Plant::of(&scene).unwrap();
    let log = RawLog {
        series,
        ..RawLog::default()
    };
    propose(&scene, &plant, (&log, kind), &[]).unwrap()
}

fn from<'a>(proposal: &'a Proposal, name: &str) -> &'a str {
    let found = proposal.matches.iter().find(|m| m.name == name).unwrap();
    found.mapping.as_ref().map_or("", source)
}

#[test]
fn topics_of_ros_find_their_sensors_and_commands() {
    let mut all = Vec::new();
    for (j, name) in ["gripper", "elbow", "shoulder_pan"].into_iter().enumerate() {
        let joint = 2 - j;
        let speed = move |t: f64| (motion(joint, t + 1e-5) - motion(joint, t - 1e-5)) / 2e-5;
        all.push(series(
            "/joint_states",
            &format!(".position.{name}"),
            move |t| motion(joint, t),
        ));
        all.push(series("/joint_states", &format!(".velocity.{name}"), speed));
        all.push(series("/joint_states", &format!(".effort.{name}"), |t| t));
    }
    for j in 0..3 {
        all.push(series(
            "/position_controller/commands",
            &format!(".data.{j}"),
            move |t| motion(j, t + 0.05),
        ));
    }
    for (k, axis) in ["x", "y", "z", "w"].into_iter().enumerate() {
        if k < 3 {
            all.push(series(
                "/puck/pose",
                &format!(".pose.position.{axis}"),
                |t| t,
            ));
        }
        all.push(series(
            "/puck/pose",
            &format!(".pose.orientation.{axis}"),
            |_| 0.5,
        ));
    }
    all.push(series("/battery", ".voltage", |_| 12.0));
    let found = proposed(all, LogFormat::Mcap);
    for (name, column) in [
        ("ctrl.shoulder_pan", "/position_controller/commands.data.0"),
        ("ctrl.gripper", "/position_controller/commands.data.2"),
        ("q_pan", "/joint_states.position.shoulder_pan"),
        ("dq_elbow", "/joint_states.velocity.elbow"),
        ("puck_pos.1", "/puck/pose.pose.position.y"),
        ("puck_quat.0", "/puck/pose.pose.orientation.w"),
        ("puck_quat.3", "/puck/pose.pose.orientation.z"),
    ] {
        assert_eq!(from(&found, name), column, "{name}");
    }
    assert_eq!(
        found.topics,
        [
            "/joint_states",
            "/position_controller/commands",
            "/puck/pose"
        ]
    );
    assert!(found.unused.contains(&"/battery.voltage".to_owned()));
    assert!(found.missing_commands().is_empty());
}

#[test]
fn features_of_lerobot_are_in_degrees_and_the_gripper_in_parts_of_its_range() {
    let mut all = Vec::new();
    for (feature, late) in [("action", 0.05), ("observation.state", 0.0)] {
        for (j, name) in ["shoulder_pan", "elbow"].into_iter().enumerate() {
            all.push(series("", &format!("{feature}.{name}.pos"), move |t| {
                motion(j, t + late).to_degrees()
            }));
        }
        all.push(series("", &format!("{feature}.gripper.pos"), move |t| {
            50.0 + 10.0 * (t + late).sin()
        }));
    }
    let found = proposed(all, LogFormat::Lerobot);
    assert_eq!(from(&found, "q_pan"), "observation.state.shoulder_pan.pos");
    assert_eq!(from(&found, "ctrl.elbow"), "action.elbow.pos");
    let mappings = found.mappings();
    let unit = |name: &str| {
        let m = mappings.iter().find(|m| m.name == name).unwrap();
        (m.unit.clone().unwrap(), m.scale, m.offset)
    };
    assert_eq!(unit("q_elbow"), ("deg".into(), 1.0, 0.0));
    let (percent, scale, offset) = unit("q_gripper");
    assert_eq!((&*percent, offset), ("%", -0.2));
    assert!((scale - 1.9).abs() < 1e-12);
    assert_eq!(unit("ctrl.gripper").0, "%");
}

#[test]
fn columns_of_a_script_are_told_by_words_units_and_the_displacement_that_they_make() {
    let degrees = |j: usize| move |t: f64| motion(j, t).to_degrees();
    let turned = |t: f64| -((motion(0, t + 1e-5) - motion(0, t - 1e-5)) / 2e-5).to_degrees();
    let all = vec![
        series("", "target_1", |t| motion(0, t + 0.05)),
        series("", "target_2", |t| motion(1, t + 0.05)),
        series("", "target_3", |t| motion(2, t + 0.05)),
        series("", "PanAngle", degrees(0)),
        series("", "elbow [deg]", degrees(1)),
        series("", "pan_speed", turned),
        series("", "temperature", |_| 40.0),
    ];
    let found = proposed(all, LogFormat::Csv);
    assert_eq!(from(&found, "ctrl.elbow"), "target_2");
    assert_eq!(from(&found, "q_pan"), "PanAngle");
    assert_eq!(from(&found, "q_elbow"), "elbow [deg]");
    assert_eq!(from(&found, "q_gripper"), "");
    let mappings = found.mappings();
    let of = |name: &str| mappings.iter().find(|m| m.name == name).unwrap();
    assert_eq!(of("q_pan").unit.as_deref(), Some("deg"));
    assert_eq!(
        (of("dq_pan").unit.as_deref(), of("dq_pan").sign),
        (Some("deg/s"), -1.0)
    );
    assert_eq!(found.unused, ["temperature"]);
}

/// Symptom: a speed that counts the other way was mapped without a sign if its name has a unit.
///
/// Cause: a known unit ended the comparison with the position, before the sign was looked at.
#[test]
fn a_speed_with_a_unit_in_its_name_has_the_sign_of_its_position() {
    let all = vec![
        series("", "PanAngle", |t| motion(0, t)),
        series("", "pan_speed_deg", |t| {
            -((motion(0, t + 1e-5) - motion(0, t - 1e-5)) / 2e-5).to_degrees()
        }),
    ];
    let found = proposed(all, LogFormat::Csv);
    assert_eq!(from(&found, "dq_pan"), "pan_speed_deg");
    let mappings = found.mappings();
    let speed = mappings.iter().find(|m| m.name == "dq_pan").unwrap();
    assert_eq!((speed.unit.as_deref(), speed.sign), (Some("deg/s"), -1.0));
}

#[test]
fn a_log_of_the_models_own_names_needs_no_mapping() {
    let all = vec![
        series("", "ctrl.shoulder_pan", |t| motion(0, t)),
        series("", "q_pan", |t| motion(0, t)),
    ];
    let found = proposed(all, LogFormat::Csv);
    assert!(found.mappings().is_empty());
    assert_eq!(found.missing_commands(), ["elbow", "gripper"]);
    assert_eq!(found.readings(), 1);
}

#[test]
fn what_is_known_is_taken_and_a_name_that_is_not_there_is_refused() {
    let scene = Scene::from_xml("arm", ARM, &[]).unwrap();
    let plant = Plant::of(&scene).unwrap();
    let log = RawLog {
        series: vec![series("", "q_pan", |t| t), series("", "other", |t| t)],
        ..RawLog::default()
    };
    let of = |column: &str| {
        let given = [("q_pan".to_owned(), column.to_owned())];
        propose(&scene, &plant, (&log, LogFormat::Csv), &given)
    };
    assert_eq!(from(&of("other").unwrap(), "q_pan"), "other");
    assert!(of("othr").unwrap_err().to_string().contains("`other`"));
}

#[test]
fn a_unit_is_told_by_the_episode_that_moves_where_the_first_stands_still() {
    let column = |scale: f64| series("", "elbow_pos", move |t| scale * motion(1, t));
    let log = |series: Vec<Series>| RawLog {
        series,
        ..RawLog::default()
    };
    // Values up to 1.1 fit any unit; 63 is no angle in rad of a joint that ends at 1.6.
    let (still, moved) = (
        log(vec![column(1.0)]),
        log(vec![column(180.0 / std::f64::consts::PI)]),
    );
    let whole = RawLog::joined([&still, &moved]);
    let joined = &whole.series[0];
    assert_eq!(joined.values.len(), 600);
    assert!(joined.time.windows(2).all(|w| w[0] < w[1]));
    let unit = |log: &RawLog| {
        let scene = Scene::from_xml("arm", ARM, &[]).unwrap();
        let plant = Plant::of(&scene).unwrap();
        let found = propose(&scene, &plant, (log, LogFormat::Csv), &[]).unwrap();
        let own = found.matches.into_iter().find(|m| m.name == "q_elbow");
        own.unwrap().mapping.and_then(|m| m.unit)
    };
    assert_eq!(unit(&whole).as_deref(), Some("deg"));
}

/// A cart with one-letter joints, as gantries have them.
const GANTRY: &str = r#"<mujoco><worldbody>
  <body name="bridge"><joint name="x" type="slide" axis="1 0 0" range="-0.6 0.6"/><geom size="0.1" mass="1"/>
    <body name="cart"><joint name="y" type="slide" axis="0 1 0" range="-0.6 0.6"/><geom size="0.1" mass="1"/>
      <body name="arm"><joint name="elbow" axis="0 1 0" range="-1.6 1.6"/><geom size="0.1" mass="1"/></body></body></body>
  </worldbody>
  <actuator><position name="x" joint="x" kp="9"/><position name="y" joint="y" kp="9"/><motor name="elbow" joint="elbow"/></actuator>
  <sensor><jointpos name="x" joint="x"/><jointpos name="y" joint="y"/><jointpos name="elbow" joint="elbow"/></sensor></mujoco>"#;

#[test]
fn a_joint_of_one_letter_is_found_by_the_word_in_a_columns_name_before_a_place_in_a_list() {
    let scene = Scene::from_xml("gantry", GANTRY, &[]).unwrap();
    let plant = Plant::of(&scene).unwrap();
    for (columns, wanted) in [
        (
            ["cmd_x", "cmd_y", "x_pos", "y_pos"],
            ["cmd_x", "cmd_y", "x_pos", "y_pos"],
        ),
        (
            ["yTarget", "target.x", "q-y", "pos/x"],
            ["target.x", "yTarget", "pos/x", "q-y"],
        ),
    ] {
        let mut all: Vec<Series> = (columns.iter().enumerate())
            .map(|(i, name)| series("", name, move |t| motion(i % 2, t) - 0.6))
            .collect();
        all.push(series("", "elbow_torque_cmd", |t| t.sin()));
        all.push(series("", "elbow_angle", |t| motion(2, t)));
        for i in 0..3 {
            all.push(series("", &format!("tip.{i}"), |t| 0.1 * t));
        }
        let log = RawLog {
            series: all,
            ..RawLog::default()
        };
        let found = propose(&scene, &plant, (&log, LogFormat::Csv), &[]).unwrap();
        for (name, column) in ["ctrl.x", "ctrl.y", "x", "y"].iter().zip(wanted) {
            assert_eq!(from(&found, name), column, "{name}");
        }
        assert_eq!(from(&found, "ctrl.elbow"), "elbow_torque_cmd");
        assert_eq!(found.unused, ["tip.0", "tip.1", "tip.2"]);
    }
}

#[test]
fn another_mapping_shows_its_own_values() {
    let log = RawLog {
        series: vec![series("", "q_pan", |t| t), series("", "other", |t| 2.0 * t)],
        ..RawLog::default()
    };
    let mut found = proposed(log.series.clone(), LogFormat::Csv).matches;
    let pan = found.iter_mut().find(|m| m.name == "q_pan").unwrap();
    let mapping = ColumnMapping {
        from: Some("other".into()),
        sign: -1.0,
        ..ColumnMapping::of("q_pan")
    };
    pan.remap(mapping, &log);
    assert!((pan.values[0] + 2.0 * 2.99).abs() < 1e-12 && pan.values[1] == 0.0);
}

#[test]
fn a_rate_is_that_of_the_stretches_that_have_values() {
    let whole = series("", "q", |t| t);
    let mut halves = whole.clone();
    halves.time.drain(100..200);
    halves.values.drain(100..200);
    assert!((rate(&whole) - 100.0).abs() < 1e-9);
    assert!((rate(&halves) - 100.0).abs() < 1e-9);
}
