//! Scenes: layouts, sensors, and parts that are refused rather than left out.

#![allow(clippy::unwrap_used)]

mod support;

use asid_core::layout::JointKind;
use asid_core::registry::BackendEntry;
use asid_core::{Backend, Scene};
use asid_rapier::Rapier;
use support::{Bench, scene};

#[test]
fn the_layout_is_in_document_order() {
    let inside = r#"<worldbody>
        <geom type="plane" size="1 1 1"/>
        <body name="a" pos="0 0 1"><freejoint name="fly"/><geom name="ga" type="sphere" size=".1"/>
          <body><joint type="ball"/><geom type="sphere" size=".1" pos="0 0 .3"/></body></body>
        <body name="b" pos="2 0 1"><joint name="turn" ref="0.3"/><joint name="slide" type="slide"/><geom type="sphere" size=".1"/></body>
      </worldbody>
      <actuator><motor joint="turn"/><velocity name="drive" joint="slide" kv="2" ctrlrange="-1 1"/></actuator>
      <sensor><jointpos name="angle" joint="turn"/><framequat objtype="xbody" objname="a"/></sensor>
      <keyframe><key name="far" qpos="0 0 2 1 0 0 0 1 0 0 0 0.4 0.1"/></keyframe>"#;
    let model = Rapier.load(&scene(inside)).unwrap();
    let layout = model.layout();
    assert_eq!(layout.bodies, ["world", "a", "body2", "b"]);
    assert_eq!(layout.geoms, ["geom0", "ga", "geom2", "geom3"]);
    let joints: Vec<_> = layout
        .joints
        .iter()
        .map(|j| (j.name.as_str(), j.kind, j.qpos, j.qvel))
        .collect();
    assert_eq!(
        joints,
        [
            ("fly", JointKind::Free, 0, 0),
            ("joint1", JointKind::Ball, 7, 6),
            ("turn", JointKind::Hinge, 11, 9),
            ("slide", JointKind::Slide, 12, 10),
        ]
    );
    assert_eq!((layout.nq, layout.nv), (13, 11));
    assert_eq!(layout.actuators[0].name, "actuator0");
    assert_eq!(layout.actuators[1].ctrl_range, Some([-1.0, 1.0]));
    assert_eq!((layout.sensors[1].address, layout.sensors[1].len), (1, 4));
    // A batch starts at the first keyframe.
    let mut bench = Bench::new(inside, &["qpos.fly", "angle", "qpos.slide"]);
    let start = bench.read();
    for (read, set) in start.iter().zip([0., 0., 2., 1., 0., 0., 0., 0.4, 0.1]) {
        assert!((read - set).abs() < 1e-6, "{start:?}");
    }
}

#[test]
fn sensors_read_frames_where_they_are() {
    let inside = r#"<option gravity="0 0 0"/><worldbody>
        <body name="b" pos="0 0 1"><joint name="j" axis="0 0 1"/>
          <geom name="g" type="box" size=".1 .1 .1" pos="0.5 0 0" euler="0 0 0.1" mass="1"/>
          <site name="s" pos="1 0 0" quat="0 1 0 0"/></body></worldbody>
      <sensor>
        <framepos name="site" objtype="site" objname="s"/><framelinvel name="site_v" objtype="site" objname="s"/>
        <framepos name="geom" objtype="geom" objname="g"/><framepos name="inertia" objtype="body" objname="b"/>
        <framelinvel name="inertia_v" objtype="body" objname="b"/><frameangvel name="w" objtype="xbody" objname="b"/>
        <framepos name="frame" objtype="xbody" objname="b"/><framezaxis name="z" objtype="site" objname="s"/>
        <jointvel name="jv" joint="j"/><gyro name="gyro" site="s"/><velocimeter name="v" site="s"/>
        <clock name="clock"/><torque name="torque" site="s"/>
      </sensor>"#;
    let names = [
        "site",
        "site_v",
        "geom",
        "inertia",
        "inertia_v",
        "w",
        "frame",
        "z",
        "jv",
        "gyro",
        "v",
        "clock",
    ];
    let mut bench = Bench::new(inside, &names);
    bench.place(&[std::f64::consts::FRAC_PI_2], &[2.0]);
    let expected = [
        0., 1., 1., -2., 0., 0., 0., 0.5, 1., 0., 0.5, 1., -1., 0., 0., 0., 0., 2., 0., 0., 1., 0.,
        0., -1., 2., 0., 0., -2., 0., -2., 0., 0.,
    ];
    let read = bench.read();
    for (i, (a, b)) in read.iter().zip(expected).enumerate() {
        assert!((a - b).abs() < 1e-6, "entry {i}: {a} against {b}");
    }
    // After steps the velocity is the current one, not that of the previous substep.
    let row = bench.run(10, &[]).pop().unwrap();
    assert!((row[3].hypot(row[4]) - 2.0).abs() < 1e-4 && (row[31] - 0.02).abs() < 1e-9);
    // A sensor that it cannot read is refused when it is requested.
    let record = bench.simulator.layout().recording(&["torque"]).unwrap();
    let error = bench
        .simulator
        .read(&[0], &record, &mut [0.0; 3])
        .unwrap_err();
    assert!(
        error.to_string().contains("read sensor `torque`"),
        "{error}"
    );
}

/// Symptom: a sensor that reads late by itself was read at once. Cause: the parser knows no `delay`
/// and no `interval` of sensors.
#[test]
fn a_sensor_that_reads_late_by_itself_is_refused_when_it_is_read() {
    let inside = r#"<worldbody><body><joint name="j"/><geom type="sphere" size=".1" pos=".3 0 0"/></body></worldbody>
      <sensor><jointpos name="late" joint="j" delay="0.05" nsample="60"/><jointpos name="now" joint="j" nsample="3"/>
        <jointpos name="seldom" joint="j" interval="0.01" nsample="3"/></sensor>"#;
    let mut bench = Bench::new(inside, &["now"]);
    bench.place(&[0.2], &[0.0]);
    assert!((bench.read()[0] - 0.2).abs() < 1e-6);
    for name in ["late", "seldom"] {
        let record = bench.simulator.layout().recording(&[name]).unwrap();
        let read = bench.simulator.read(&[0], &record, &mut [0.0]);
        let error = read.unwrap_err().to_string();
        assert!(
            error.contains(&format!("read sensor `{name}`")) && error.contains("delay"),
            "{error}"
        );
    }
}

/// Symptom: the same machine moved otherwise than in MuJoCo. Cause: the parser left the ends of
/// geoms where they are, dropped joints in frames, and took positions and rotations together.
#[test]
fn frames_and_classes_are_as_if_written_out() {
    let written_out = r#"<worldbody><body name="rod" pos="0 0 1">
        <joint name="j" axis="0 1 0" pos="0 .1 0"/>
        <geom type="capsule" size=".02" fromto="0 .1 0 .3 .1 0" mass="1"/>
        <geom type="box" size=".1 .02 .03" pos="0 0 -.3" euler="0 .3 0" mass=".5"/></body></worldbody>"#;
    let by_frames = r#"<default><default class="placed"><geom pos="0 0 -.3" size=".2 .02 .03"/></default></default>
      <worldbody><frame pos="0 0 1"><body name="rod">
        <frame pos="0 .1 0" euler="0 0 1.5707963267948966"><joint name="j" axis="1 0 0"/>
          <geom type="capsule" size=".02" fromto="0 0 0 0 -.3 0" mass="1"/></frame>
        <geom class="placed" type="box" size=".1" euler="0 .3 0" mass=".5"/></body></frame></worldbody>"#;
    let ends = [written_out, by_frames].map(|inside| {
        let mut bench = Bench::new(inside, &["qpos.j"]);
        bench.place(&[0.1], &[0.0]);
        bench.run(200, &[]).pop().unwrap()[0]
    });
    assert!((ends[0] - 0.1).abs() > 0.1, "{ends:?}");
    assert!((ends[1] - ends[0]).abs() < 1e-4, "{ends:?}");
}

#[test]
fn equalities_hold() {
    let inside = r#"<worldbody>
        <body pos="0 0 1"><joint name="l" type="slide" axis="1 0 0"/><geom type="sphere" size=".05" mass="1"/></body>
        <body pos="0 1 1"><joint name="r" type="slide" axis="1 0 0"/><geom type="sphere" size=".05" mass="1"/></body>
        <body name="hung" pos="1 0 1"><freejoint name="hung"/><geom type="box" size=".1 .1 .1" mass="1"/></body>
      </worldbody>
      <equality><joint joint1="l" joint2="r" polycoef="0 -2 0 0 0"/><connect body1="hung" anchor="0 0 0.5"/></equality>
      <actuator><motor joint="l"/></actuator>"#;
    let rows = Bench::new(inside, &["qpos.l", "qpos.r", "qpos.hung"]).run(500, &[1.0]);
    let end = &rows[499];
    // The first joint is -2 times the second: one newton moves 1 + 1/4 kg.
    assert!((end[0] - 0.4).abs() < 2e-3, "{}", end[0]);
    assert!((end[0] + 2.0 * end[1]).abs() < 2e-3, "{end:?}");
    assert!((end[4] - 1.0).abs() < 2e-3, "{end:?}");
}

#[test]
fn what_it_cannot_simulate_is_refused_by_name() {
    let joint = r#"<body name="b"><joint name="j"/><geom type="sphere" size="1"/></body>"#;
    let cases = [
        (format!("<worldbody>{joint}</worldbody><actuator><general name=\"g\" joint=\"j\" gainprm=\"4\" biastype=\"affine\" biasprm=\"1 -4\"/></actuator>"), "not actuator `g`"),
        (format!("<worldbody>{joint}</worldbody><actuator><general name=\"g\" joint=\"j\" dyntype=\"filter\"/></actuator>"), "`dyntype` of <general> `g`"),
        (format!("<default><general gainprm=\"4\" biastype=\"affine\" biasprm=\"0 -4 1\"/></default><worldbody>{joint}</worldbody><actuator><position name=\"p\" joint=\"j\"/></actuator>"), "damping ratio (`biasprm`) of actuator `p`"),
        (format!("<worldbody>{joint}</worldbody><actuator><position name=\"p\" joint=\"j\" kp=\"1\" dampratio=\"1\"/></actuator>"), "`dampratio` of <position> `p`"),
        (format!("<worldbody>{joint}</worldbody><tendon><fixed name=\"t\"><joint joint=\"j\" coef=\"1\"/></fixed></tendon>"), "<tendon>"),
        (format!("<worldbody>{joint}</worldbody><actuator><motor name=\"m\" joint=\"k\"/></actuator>"), "joint `k` of actuator `m`"),
        ("<worldbody><body><freejoint/><geom name=\"e\" type=\"ellipsoid\" size=\"1 2 3\"/></body></worldbody>".into(), "geom `e`"),
        ("<worldbody><body><joint name=\"ball\" type=\"ball\" stiffness=\"1\"/><geom size=\"1\"/></body></worldbody>".into(), "ball joint `ball`"),
        ("<worldbody><body><joint name=\"s\" stiffness=\"1 0 3\"/><geom size=\"1\"/></body></worldbody>".into(), "linear coefficient of `stiffness` of <joint> `s`"),
        ("<worldbody><body><freejoint name=\"f\" align=\"true\"/><geom size=\"1\"/></body></worldbody>".into(), "`align` of <freejoint> `f`"),
        ("<worldbody><body name=\"none\"><freejoint/></body></worldbody>".into(), "`none` moves but has no mass"),
        ("<option viscosity=\"0.1\"/><worldbody/>".into(), "`viscosity` of <option>"),
        ("<option><flag gravity=\"disable\"/></option><worldbody/>".into(), "`gravity` of <flag>"),
        (
            "<worldbody><geom name=\"b\" type=\"sphere\" size=\"1\" solref=\"-40000 -18\"/></worldbody>".into(),
            "`b` on line 1 throws bodies back with 0.87 of their speed",
        ),
        ("<worldbody/><keyframe><key name=\"k\" qpos=\"1\"/></keyframe>".into(), "keyframe `k`"),
        ("<worldbody/><contact><exclude body1=\"x\" body2=\"y\"/></contact>".into(), "names body `x`"),
    ];
    for (inside, says) in cases {
        let Err(error) = Rapier.load(&scene(&inside)) else {
            panic!("`{says}` was let in");
        };
        let text = error.to_string();
        assert!(text.contains(says) && !text.contains('\n'), "{text}");
    }
    // Settings of another engine's solver are not physics of the scene.
    let inside = r#"<option integrator="implicitfast" cone="elliptic" impratio="10"/>
      <worldbody><body><freejoint/><geom size=".1" solref="0.01 1" solimp="0.9 0.95 0.001"/></body></worldbody>"#;
    assert!(Rapier.load(&scene(inside)).is_ok());
    // A stiff contact that is damped well does not bounce.
    let inside =
        r#"<worldbody><body><freejoint/><geom size=".1" solref="-40000 -400"/></body></worldbody>"#;
    assert!(Rapier.load(&scene(inside)).is_ok());
}

/// Symptom: a drive with a damper or a rotor of its own, and one that was switched off, moved as if
/// the document did not say so. Cause: the parser knows none of these attributes.
#[test]
fn what_a_document_says_of_drives_is_not_passed_over() {
    let inside = |before: &str, joint: &str, motor: &str| {
        format!(
            r#"{before}<worldbody><body><joint name="j" {joint}/><geom size=".1"/></body></worldbody>
            <actuator><motor name="m" joint="j" {motor}/></actuator>"#
        )
    };
    let class = |says: &str| format!("<default>{says}</default>");
    let groups = r#"<option actuatorgroupdisable="0"/>"#;
    let masses = r#"<compiler inertiagrouprange="0 0"/>"#;
    let timed = class(r#"<joint springdamper="0.5 0.3"/>"#);
    for (scene_of, says) in [
        (
            inside("", "", r#"damping="0.2""#),
            "`damping` of <motor> `m`",
        ),
        (
            inside("", "", r#"armature="0.2""#),
            "`armature` of <motor> `m`",
        ),
        (
            inside(&class(r#"<motor damping="1 2"/>"#), "", ""),
            "`damping` of <motor> on",
        ),
        (inside(groups, "", ""), "`actuatorgroupdisable` of <option>"),
        (inside(masses, "", ""), "`inertiagrouprange` of <compiler>"),
        (inside(&timed, "", ""), "`springdamper` of joint `j`"),
        (
            inside("", r#"springdamper="0.5 0.3""#, ""),
            "`springdamper` of joint `j`",
        ),
    ] {
        let Err(error) = Rapier.load(&scene(&scene_of)) else {
            panic!("`{says}` was let in");
        };
        let text = error.to_string();
        assert!(text.contains(says) && !text.contains('\n'), "{text}");
    }
}

/// Symptom: a link swung too slowly. Cause: a geom had mass although the document says that masses
/// are those of `<inertial>` alone.
#[test]
fn geoms_have_no_mass_where_the_document_says_so() {
    let inside = r#"<compiler inertiafromgeom="false"/><worldbody><body><joint name="j" axis="0 1 0"/>
      <inertial pos=".3 0 0" mass="1" diaginertia=".01 .01 .01"/>
      <body pos="0 0 .4"><geom size=".1" mass="2"/></body></body></worldbody>"#;
    let rate = Bench::new(inside, &["qvel.j"]).run(1, &[])[0][0];
    let theory = 9.81 * 0.3 / (0.01 + 0.3 * 0.3) * 0.002;
    assert!(
        (rate / theory - 1.0).abs() < 1e-3,
        "{rate} against {theory}"
    );
}

/// Symptom: an exported model was refused for its `springdamper="0 0"`. Cause: of the values that
/// mean the same as none, a few were known by their spelling.
#[test]
fn values_that_mean_none_are_let_in() {
    let turning = |before: &str, joint: &str, more: &str| {
        let inside = format!(
            r#"{before}<option gravity="0 0 0"/><worldbody><body><joint name="j" axis="0 0 1" {joint}/>
            <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/><geom size=".1" {more}/></body></worldbody>
            <actuator><motor joint="j" damping="0 0" armature="0.0" delay="0.0"/></actuator>"#
        );
        let mut bench = Bench::new(&inside, &["qvel.j"]);
        bench.place(&[0.0], &[2.0]);
        bench.run(500, &[0.0])[499][0]
    };
    // The coefficient itself counts: the rate decays with damping over inertia.
    let decayed = 2.0 * (-1.0f64).exp();
    let timed = r#"<default><joint springdamper="0.5 0.3"/></default>"#;
    let none =
        r#"<compiler settotalmass="-1" inertiagrouprange="0 5"/><option actuatorgroupdisable=""/>"#;
    for rate in [
        turning(timed, r#"damping="0.1" springdamper="0 0""#, ""),
        turning(
            none,
            r#"damping="0.1" actuatorfrcrange="0 0""#,
            r#"gap="0.0""#,
        ),
    ] {
        assert!((rate - decayed).abs() < 0.003, "{rate} against {decayed}");
    }
}

/// Symptom: a servo of an attached document moved without its damping. Cause: parts that the loader
/// skips were sought in the document alone that attaches it.
#[test]
fn what_an_attached_document_says_is_not_passed_over() {
    let folder = std::env::temp_dir().join(format!("asid-rapier-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let load = |tool: &str| {
        let tool = format!("<mujoco>{tool}</mujoco>");
        std::fs::write(folder.join("tool.xml"), tool).unwrap();
        let inside = r#"<asset><model name="tool" file="tool.xml"/></asset><worldbody><body><joint/>
          <geom size="0.1"/><attach model="tool" body="tool" prefix="a_"/></body></worldbody>"#;
        let attaching = scene(inside).in_directory(Some(folder.clone()));
        Rapier.load(&attaching).map(|_| ())
    };
    let tool = r#"<body name="tool"><joint name="turn"/><geom size="0.1"/></body>"#;
    let refused = load(&format!(
        r#"<worldbody>{tool}</worldbody>
        <actuator><position name="servo" joint="turn" kp="5" dampratio="1"/></actuator>"#
    ));
    // Options, the total mass and the other bodies of the attached document stay behind.
    let taken = load(&format!(
        r#"<compiler settotalmass="9"/><option viscosity="0.3"><flag gravity="disable"/></option>
        <worldbody><geom size="1" solref="-40000 -18"/>{tool}</worldbody>"#
    ));
    std::fs::remove_dir_all(&folder).unwrap();
    let text = refused.unwrap_err().to_string();
    assert!(text.contains("tool.xml: backend"), "{text}");
    assert!(text.contains("`dampratio` of <position> `servo`"), "{text}");
    assert_eq!(taken.map_err(|e| e.to_string()), Ok(()));
}

#[test]
fn an_empty_scene_runs() {
    let scene = Scene::from_xml("empty", "<mujoco/>", &[]).unwrap();
    assert_eq!(Bench::with(&scene, &[], 1, 1, &[]).run(3, &[]).len(), 0);
}

#[test]
fn the_registry_finds_it() {
    let entry = asid_core::registry::find::<BackendEntry>("rapier").unwrap();
    assert_eq!((entry.make)().unwrap().name(), Rapier.name());
}
