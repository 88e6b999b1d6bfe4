use std::ffi::CStr;
use std::ffi::c_char;

use super::*;
use crate::table::{actuator_kind, geom_kind, joint_kind};

fn read(inside: &str) -> World {
    let xml = format!("<mujoco>{inside}</mujoco>");
    World::read(&Scene::from_xml("test", &xml, &[]).unwrap()).unwrap()
}

fn refused(inside: &str) -> String {
    let xml = format!("<mujoco>{inside}</mujoco>");
    let read = Scene::from_xml("test", &xml, &[]).and_then(|scene| World::read(&scene));
    read.err().map(|e| e.to_string()).unwrap_or_default()
}

fn text(pointer: *const c_char) -> String {
    // SAFETY: every text of a table is zero-terminated and lives as long as it.
    unsafe { CStr::from_ptr(pointer) }.to_str().unwrap().into()
}

fn list<T: Copy>(first: *const T, n: u64) -> Vec<T> {
    // SAFETY: a table's lists have as many entries as it says.
    unsafe { std::slice::from_raw_parts(first, n as usize) }.to_vec()
}

fn left_out(world: &World) -> Vec<String> {
    let table = world.table();
    let texts = list(table.left_out, table.nleft_out);
    texts.into_iter().map(text).collect()
}

fn near<const N: usize>(value: [f64; N], theory: [f64; N]) {
    let error = value.iter().zip(theory).map(|(v, t)| (v - t).abs());
    assert!(error.clone().fold(0.0, f64::max) < 1e-12, "{value:?}");
}

const MACHINE: &str = r#"
  <option timestep="0.004" gravity="0 1 -9"/>
  <default><joint damping="0.5"/><geom density="2000"/>
    <default class="stiff"><joint stiffness="7" damping="0.1"/></default></default>
  <worldbody><geom type="plane" size="1 1 1"/><site name="corner" pos="1 2 3"/>
    <body name="arm" pos="0 0 1" euler="0 0 90">
      <joint name="swing" axis="0 3 4" range="-90 45" ref="30" springref="10"/>
      <geom name="beam" type="capsule" fromto="0 0 0 0.4 0 0" size="0.05" mass="2"/>
      <body childclass="stiff"><joint name="reach" type="slide"/><joint type="ball" pos="0 0 .1" range="0 60"/>
        <geom type="box" size=".1 .2 .3"/><site pos="0 0 .5"/></body></body>
    <body name="lump"><freejoint/><inertial pos="1 0 0" quat="0 1 1 0" mass="3" diaginertia="1 2 2.5"/></body>
  </worldbody>
  <actuator><motor name="pull" joint="swing" gear="3" ctrlrange="-1 2"/>
    <position joint="reach" kp="20" kv="2" forcerange="-5 5"/><velocity joint="reach"/>
    <general joint="swing" gainprm="3"/></actuator>
  <sensor><jointpos name="angle" joint="swing"/><framepos objtype="site" objname="corner"/>
    <framequat objtype="xbody" objname="lump"/><actuatorfrc name="force" actuator="pull"/></sensor>
  <keyframe><key qpos="1 2 1 0 0 0 0 0 0 1 0 0 0" ctrl="1 2 3 4"/><key name="rest"/></keyframe>"#;

#[test]
fn bodies_have_parents_poses_and_masses() {
    let world = read(MACHINE);
    let table = world.table();
    let bodies = list(table.bodies, table.nbody);
    let names: Vec<_> = bodies.iter().map(|b| text(b.name)).collect();
    assert_eq!(names, ["world", "arm", "body2", "lump"]);
    let parents: Vec<_> = bodies.iter().map(|b| b.parent).collect();
    assert_eq!(parents, [table::NONE, 0, 1, 0]);
    let half = 0.5_f64.sqrt();
    near(bodies[1].quat, [half, 0.0, 0.0, half]);
    // A capsule: a cylinder between two half spheres, 2 kg in total, with its middle at 0.2 m.
    let (r, h) = (0.05, 0.2);
    let cylinder = 2.0 * std::f64::consts::PI * r * r * h;
    let ball = 4.0 / 3.0 * std::f64::consts::PI * r * r * r;
    let along = 2.0 / (cylinder + ball) * (cylinder * r * r / 2.0 + ball * 0.4 * r * r);
    near(bodies[1].com, [0.2, 0.0, 0.0]);
    near([bodies[1].mass, bodies[1].inertia[0]], [2.0, along]);
    // A box with the class's density.
    let mass = 2000.0 * 8.0 * 0.1 * 0.2 * 0.3;
    near([bodies[2].mass], [mass]);
    near(
        [bodies[2].inertia[0], bodies[2].inertia[2]],
        [mass * 0.13 / 3.0, mass * 0.05 / 3.0],
    );
    // Half a turn about x + y exchanges x and y and reverses z.
    assert_eq!((bodies[2].inertial, bodies[3].inertial), (0, 1));
    near(bodies[3].inertia, [2.0, 1.0, 2.5, 0.0, 0.0, 0.0]);
    // The principal axes of a document keep their order.
    near(bodies[3].moments, [1.0, 2.0, 2.5]);
    let half = 0.5_f64.sqrt();
    near(bodies[3].iquat, [0.0, half, half, 0.0]);
    near(bodies[3].com, [1.0, 0.0, 0.0]);
}

#[test]
fn joints_are_in_radians_with_defaults_resolved() {
    let world = read(MACHINE);
    let table = world.table();
    let joints = list(table.joints, table.njoint);
    let names: Vec<_> = joints.iter().map(|j| text(j.name)).collect();
    assert_eq!(names, ["swing", "reach", "joint2", "joint3"]);
    let kinds: Vec<_> = joints.iter().map(|j| j.kind).collect();
    assert_eq!(
        kinds,
        [
            joint_kind::HINGE,
            joint_kind::SLIDE,
            joint_kind::BALL,
            joint_kind::FREE
        ]
    );
    let places: Vec<_> = joints.iter().map(|j| (j.qpos, j.qvel)).collect();
    assert_eq!(places, [(0, 0), (1, 1), (2, 2), (6, 5)]);
    near(joints[0].axis, [0.0, 0.6, 0.8]);
    let pi = std::f64::consts::PI;
    near(joints[0].range, [-pi / 2.0, pi / 4.0]);
    near([joints[0].ref_, joints[0].springref], [pi / 6.0, pi / 18.0]);
    near(joints[2].range, [0.0, pi / 3.0]);
    let limited: Vec<_> = joints.iter().map(|j| j.limited).collect();
    assert_eq!(limited, [1, 0, 1, 0]);
    let damping: Vec<_> = joints.iter().map(|j| j.damping).collect();
    assert_eq!(damping, [0.5, 0.1, 0.1, 0.0]);
    assert_eq!((joints[0].stiffness, joints[1].stiffness), (0.0, 7.0));
}

#[test]
fn geoms_and_sites_lie_where_the_document_says() {
    let world = read(MACHINE);
    let table = world.table();
    let geoms = list(table.geoms, table.ngeom);
    let kinds: Vec<_> = geoms.iter().map(|g| (g.kind, g.body)).collect();
    assert_eq!(
        kinds,
        [
            (geom_kind::PLANE, 0),
            (geom_kind::CAPSULE, 1),
            (geom_kind::BOX, 2)
        ]
    );
    assert_eq!(geoms[0].mass, 0.0);
    near(geoms[1].pos, [0.2, 0.0, 0.0]);
    near(geoms[1].size, [0.05, 0.2, 0.0]);
    // The capsule's z points from the beam's second end to its first, against x.
    let half = 0.5_f64.sqrt();
    near(geoms[1].quat, [half, 0.0, -half, 0.0]);
    let sites = list(table.sites, table.nsite);
    let named: Vec<_> = sites.iter().map(|s| (text(s.name), s.body)).collect();
    assert_eq!(named, [("corner".into(), 0), ("site1".into(), 2)]);
}

#[test]
fn drives_sensors_and_keyframes_are_resolved() {
    let world = read(MACHINE);
    let table = world.table();
    let drives = list(table.actuators, table.nactuator);
    let kinds: Vec<_> = drives.iter().map(|a| (a.kind, text(a.kind_name))).collect();
    assert_eq!(
        kinds,
        [
            (actuator_kind::MOTOR, "motor".into()),
            (actuator_kind::POSITION, "position".into()),
            (actuator_kind::VELOCITY, "velocity".into()),
            (actuator_kind::OTHER, "general".into()),
        ]
    );
    assert_eq!((drives[0].joint, drives[0].gear), (0, 3.0));
    assert_eq!(
        (drives[0].ctrl_limited, drives[0].ctrl_range),
        (1, [-1.0, 2.0])
    );
    assert_eq!(
        (drives[1].force_limited, drives[1].force_range),
        (1, [-5.0, 5.0])
    );
    assert_eq!((drives[1].kp, drives[1].kv, drives[2].kv), (20.0, 2.0, 1.0));

    let sensors = list(table.sensors, table.nsensor);
    let objects: Vec<_> = sensors
        .iter()
        .map(|s| (text(s.object_kind), s.object))
        .collect();
    assert_eq!(
        objects,
        [
            ("joint".into(), 0),
            ("site".into(), 0),
            ("xbody".into(), 3),
            ("actuator".into(), 0)
        ]
    );
    let places: Vec<_> = sensors.iter().map(|s| (s.address, s.length)).collect();
    assert_eq!(places, [(0, 1), (1, 3), (4, 4), (8, 1)]);
    assert_eq!(
        (table.nq, table.nv, table.nu, table.nsensordata),
        (13, 11, 4, 9)
    );

    let keys = list(table.keyframes, table.nkeyframe);
    assert_eq!(
        (text(keys[0].name), text(keys[1].name)),
        ("key0".into(), "rest".into())
    );
    assert_eq!(list(keys[0].ctrl, 4), [1.0, 2.0, 3.0, 4.0]);
    // A key that omits a value has the document's own pose, at rest.
    let rest = list(table.qpos0, table.nq);
    assert_eq!(list(keys[1].qpos, table.nq), rest);
    near(
        [rest[0], rest[2], rest[9]],
        [std::f64::consts::PI / 6.0, 1.0, 1.0],
    );
    assert_eq!(list(keys[1].qvel, 11), [0.0; 11]);
}

#[test]
fn elements_are_found_by_name() {
    let world = read(MACHINE);
    assert_eq!(world.object("body", "lump"), Some(3));
    assert_eq!(world.object("geom", "geom0"), Some(0));
    assert_eq!(world.object("joint", "joint2"), Some(2));
    assert_eq!(world.object("actuator", "pull"), Some(0));
    assert_eq!(world.object("geom", "lump"), None);
    assert_eq!(world.object("option", ""), None);
    assert_eq!(world.layout().timestep, 0.004);
}

#[test]
fn what_the_structure_lacks_is_listed() {
    assert_eq!(left_out(&read(MACHINE)), ["actuator gainprm"]);
    let world = read(
        r#"<compiler settotalmass="3" balanceinertia="false"/>
        <option integrator="RK4" cone="pyramidal" density="0" wind="0 0 1" iterations="9"><flag contact="disable" energy="enable"/></option>
        <visual><global fovy="3"/></visual>
        <default><geom solref="0.01 1" margin="0"/><default class="a"><general dyntype="filter"/></default></default>
        <worldbody><camera fovy="3"/><light dir="0 0 1"/><body name="a" gravcomp="1" mocap="false"><freejoint/>
          <geom name="g" size="1" gap="0.1" rgba="1 0 0 1"/>
          <frame pos="0 0 1"><geom size=".1" solimp="0.9 0.9 0.01"/></frame>
          <body name="b"><joint name="j" springdamper="0.1 1" solreflimit="0.01 1"/><geom size=".1"/></body></body></worldbody>
        <contact><exclude body1="a" body2="b"/></contact>
        <equality><weld body1="a"/></equality>
        <tendon><fixed><joint joint="j" coef="1"/></fixed></tendon>
        <actuator><motor name="m" joint="j" gear="1 0 2"/><position site="x"/></actuator>
        <sensor><jointpos name="s" joint="j" cutoff="3" noise="1"/><jointpos joint="j" reftype="body" refname="a"/>
          <contact/></sensor>
        <keyframe><key mpos="1 2 3"/></keyframe>"#,
    );
    assert_eq!(
        left_out(&world),
        [
            "compiler settotalmass",
            "option integrator",
            "option wind",
            "flag contact",
            "default/geom solref",
            "default/general dyntype",
            "body/a gravcomp",
            "geom/g gap",
            "geom solimp",
            "joint/j springdamper",
            "joint/j solreflimit",
            "contact/exclude",
            "equality/weld",
            "tendon/fixed",
            "actuator site",
            "sensor/s cutoff",
            "sensor reftype",
            "sensor refname",
            "sensor/contact",
            "key mpos",
            "actuator/m gear",
        ]
    );
}

/// Symptom: an engine got other frictions, and no joint from a frame. Cause: the parser reads lists
/// of a class as a whole, and skips joints and inertias in frames.
#[test]
fn frames_and_classes_are_resolved() {
    let world = read(
        r#"<default><geom friction="0.8 0.01 0.001"/></default><worldbody><body name="b">
        <frame pos="0 0 1" euler="0 0 90"><joint axis="1 0 0"/><inertial pos="1 0 0" mass="2" diaginertia="1 1 1"/>
          <geom size=".1" friction="0.5"/></frame></body></worldbody>"#,
    );
    assert_eq!(left_out(&world), Vec::<String>::new());
    let table = world.table();
    let joint = list(table.joints, table.njoint)[0];
    near(joint.pos, [0.0, 0.0, 1.0]);
    near(joint.axis, [0.0, 1.0, 0.0]);
    near(list(table.bodies, table.nbody)[1].com, [0.0, 1.0, 1.0]);
    let geom = list(table.geoms, table.ngeom)[0];
    near(geom.friction, [0.5, 0.01, 0.001]);
    near(geom.pos, [0.0, 0.0, 1.0]);
}

/// Symptom: an engine in C counted the mass of geoms that the document leaves out, and drove what
/// it switches off. Cause: zeros were taken for the default, which for lists of groups they are not.
#[test]
fn groups_that_are_left_out_are_listed() {
    let world = read(
        r#"<compiler inertiagrouprange="0 0"/><option actuatorgroupdisable="0"/><worldbody/>"#,
    );
    assert_eq!(
        left_out(&world),
        ["compiler inertiagrouprange", "option actuatorgroupdisable"]
    );
    let defaults =
        read(r#"<compiler inertiagrouprange="0 5"/><option actuatorgroupdisable=""/><worldbody/>"#);
    assert_eq!(left_out(&defaults), Vec::<String>::new());
}

/// Symptom: engines in C refused an exported model for a class's `springdamper`. Cause: the class
/// was read without the joint, whose zeros overrule it.
#[test]
fn a_time_constant_of_a_spring_counts_where_a_joint_has_it() {
    let world = |joints: &str| {
        read(&format!(
            r#"<default><joint springdamper="0.5 0.3"/></default><worldbody><body><geom size="1"/>{joints}</body></worldbody>"#
        ))
    };
    let overruled = world(r#"<joint name="j" springdamper="0 0"/>"#);
    assert_eq!(left_out(&overruled), Vec::<String>::new());
    let one = world(r#"<joint name="j" springdamper="0 0"/><joint name="k"/>"#);
    assert_eq!(left_out(&one), ["joint/k springdamper"]);
    let own = world(r#"<joint name="j" springdamper="1 1"/>"#);
    assert_eq!(left_out(&own), ["joint/j springdamper"]);
}

#[test]
fn what_a_drive_adds_to_its_joint_is_listed() {
    let world = read(
        r#"<default><position armature="0.1"/></default><worldbody><body><joint name="j"/><geom size="1"/></body></worldbody>
        <actuator><motor name="m" joint="j" damping="0.2"/><position name="p" joint="j" damping="0 0"/></actuator>"#,
    );
    assert_eq!(
        left_out(&world),
        ["default/position armature", "actuator/m damping"]
    );
}

#[test]
fn coefficients_of_higher_order_are_listed() {
    let world = read(
        r#"<default><joint damping="1 2"/></default><worldbody><body>
        <joint name="j" stiffness="1 0 3" damping="2 0"/><geom size=".1"/></body></worldbody>"#,
    );
    assert_eq!(
        left_out(&world),
        ["default/joint damping", "joint/j stiffness"]
    );
    let joint = list(world.table().joints, 1)[0];
    assert_eq!((joint.stiffness, joint.damping), (1.0, 2.0));
}

#[test]
fn nonsense_is_refused_with_its_name() {
    let body = |inside: &str| format!("<worldbody><body name='b'>{inside}</body></worldbody>");
    for (document, expected) in [
        (
            body("<joint/><geom size='nan'/>"),
            "line 1: size=\"nan\" is not finite",
        ),
        (body("<joint/><geom/>"), "geom `geom0` needs 1 positive"),
        (
            body("<joint name='j' axis='0 0 0'/><geom size='1'/>"),
            "joint `j` has no axis",
        ),
        (
            body("<joint name='j' damping='-1'/><geom size='1'/>"),
            "joint `j`: -1",
        ),
        (body("<joint/>"), "body `b` moves and has no mass"),
        (
            body("<joint/><geom type='mesh' mesh='m'/>"),
            "names mesh `m`",
        ),
        (body("<joint/><freejoint/><geom size='1'/>"), "free joint"),
        (body("<body name='b'/>"), "body `b` is there a second time"),
        (
            body("<joint/><geom size='1'/>") + "<actuator><motor joint='x'/></actuator>",
            "actuator `actuator0` drives joint `x`",
        ),
        (
            body("<joint/><geom size='1'/>") + "<actuator><motor joint='joint0'/></actuator>",
            "drives joint `joint0`, which is not there",
        ),
        (
            body("") + "<sensor><framepos name='s' objtype='site' objname='x'/></sensor>",
            "sensor `s` names site `x`",
        ),
    ] {
        let error = refused(&document);
        assert!(error.contains(expected), "{document}: {error}");
    }
}

#[test]
fn the_reading_is_shared_between_threads() {
    let world = read(MACHINE);
    let count = std::thread::spawn(move || world.table().nbody)
        .join()
        .unwrap();
    assert_eq!(count, 4);
}
