//! Models of other authors: which become machines, and which are refused with the name of the
//! element.

use asid_withheld::anatomy::Anatomy;
use asid_withheld::case;
use asid_withheld::plan::{Kind, Plan};
use asid_withheld::{Half, outside};

fn model(inside: &str) -> String {
    format!(
        r#"<mujoco model="package/arm"><option timestep="0.001"/><worldbody><body name="a/b c.d">
        <joint name="a/joint 1" type="hinge" axis="0 1 0" ref="0"/>{inside}
        </body></worldbody>
        <actuator><motor name="a/m.1" joint="a/joint 1" ctrlrange="-2 4"/></actuator>
        <sensor><jointpos name="q_a/joint 1" joint="a/joint 1"/></sensor></mujoco>"#
    )
}

#[test]
fn names_with_slashes_spaces_and_dots_are_names() {
    let text = model(r#"<geom name="a/g" type="sphere" size="0.1"/>"#);
    let machine = outside::machine(&text, Half::Test).expect("a machine");
    assert_eq!(machine.name, "package/arm");
    let anatomy = Anatomy::of(machine).expect("a model");
    assert_eq!(anatomy.joints[0].name, "a/joint 1");
    assert_eq!(anatomy.bodies, ["world", "a/b c.d"]);
    // The middle of the range, and a share of it.
    let command = machine.commands[0];
    assert!((command.center - 1.0).abs() < 1e-12 && (command.amplitude - 1.2).abs() < 1e-12);
}

#[test]
fn what_cannot_be_a_machine_is_refused_by_the_name_of_its_element() {
    for (inside, name) in [
        // A body that would get its mass from the mesh.
        (r#"<geom name="shell" type="mesh" mesh="m"/>"#, "`shell`"),
        (r#"<geom name="cast" mesh="m"/>"#, "`cast`"),
        (
            r#"<joint name="wrist" type="ball"/><geom size="0.1"/>"#,
            "`wrist`",
        ),
    ] {
        let error = outside::machine(&model(inside), Half::Test).expect_err("a refusal");
        let text = error.to_string();
        assert!(text.contains(name) && text.contains("`a/b c.d`"), "{text}");
    }
}

#[test]
fn meshes_are_left_out_where_no_mass_comes_from_them() {
    // A body with an `<inertial>`, a fixed part of it, and a body fixed to the ground.
    let inside = r#"<inertial pos="0 0 0.1" mass="0.7" diaginertia="0.01 0.01 0.01"/>
        <geom name="shell" type="mesh" mesh="m"/><geom name="pad" size="0.02"/>
        <body name="cover"><geom name="lid" type="mesh" mesh="m"/></body>
        </body><body name="table"><geom name="top" type="mesh" mesh="m"/>"#;
    let machine = outside::machine(&model(inside), Half::Test).expect("a machine");
    assert!(!machine.model.contains("mesh"), "{}", machine.model);
    let anatomy = Anatomy::of(machine).expect("a model");
    assert_eq!(anatomy.geoms, ["pad"]);
    let compiled = asid_withheld::engine::compile(machine.model).expect("a model");
    // The world, the body with the document's mass, its fixed part, the table.
    assert_eq!(compiled.body_mass(), [0.0, 0.7, 0.0, 0.0]);
}

/// Two fingers over a coupler with tied tips, and a slide whose range does not contain its
/// reference.
const LINKAGE: &str = r#"<mujoco model="package/linkage"><compiler angle="degree"/><option timestep="0.001"/>
    <default><geom type="sphere" size="0.02"/></default><worldbody><body name="base">
    <joint name="wrist" range="-90 90"/><geom/>
    <body name="left"><joint name="left"/><geom/><body name="tip"><joint name="tip"/><geom/></body></body>
    <body name="right"><joint name="right"/><geom/></body>
    <body name="jaw"><joint name="jaw" type="slide" axis="1 0 0" range="0.02 0.06"/><geom/></body></body></worldbody>
    <equality><connect body1="tip" body2="right" anchor="0 0 0"/></equality>
    <sensor><jointpos name="q" joint="wrist"/></sensor></mujoco>"#;

#[test]
fn a_machine_starts_within_its_limits_and_with_its_loops_closed() {
    let machine = outside::machine(LINKAGE, Half::Test).expect("a machine");
    let joints: Vec<&str> = machine.starts.iter().map(|s| s.joint).collect();
    assert_eq!(joints, ["wrist", "jaw"]);
    for (joint, [low, high]) in [
        ("wrist", [-90f64.to_radians(), 90f64.to_radians()]),
        ("jaw", [0.02, 0.06]),
    ] {
        let start = machine.starts.iter().find(|s| s.joint == joint);
        let [center, spread] = start.expect("a start").position[0];
        assert!(center - spread >= low && center + spread <= high);
        assert!(spread > 0.0);
    }
}

#[test]
fn an_episode_is_as_long_as_the_time_step_can_tell_the_motion() {
    // A damped joint, and an arm of three links without friction that a motor throws about.
    let calm = model(r#"<geom size="0.1"/>"#).replace("axis=", "damping=\"1\" axis=");
    let link = r#"<geom type="capsule" size="0.02" fromto="0 0 0 0 0 -0.2"/>"#;
    let joint = r#"<joint type="hinge" axis="0 1 0"/>"#;
    let hung = |inside: &str| format!(r#"<body pos="0 0 -0.2">{joint}{link}{inside}</body>"#);
    let wild = model(&format!("{link}{}", hung(&hung(""))));
    let wild = wild.replace("-2 4", "-40 44").replace("0.001", "0.004");
    let seconds = |text: &str| {
        let machine = outside::machine(text, Half::Test);
        machine.expect("a machine").seconds
    };
    assert!(seconds(&wild) < seconds(&calm));
}

#[test]
fn a_study_gives_the_noise_of_a_sensor_whatever_its_name() {
    let text = model(r#"<geom size="0.1"/>"#).replace("axis=", "damping=\"1\" axis=");
    let machine = outside::machine(&text, Half::Test).expect("a machine");
    let given = |seed: u64| {
        let plan = Plan::draw(Half::Test, seed, 400, std::slice::from_ref(&machine));
        let plan = plan.expect("a plan");
        (0..plan.slots.len())
            .filter(|&i| plan.machines[plan.slots[i].machine].machine.name == machine.name)
            .filter(|&i| plan.slots[i].kind == Kind::None && plan.slots[i].fault.is_none())
            .filter_map(|i| case::make(&plan, seed, i).ok())
            .find_map(|c| Some(c.study["study.toml"].split_once("[noise]\n")?.1.to_owned()))
    };
    // Not every plan has such a case.
    let noise = (1..20)
        .find_map(given)
        .expect("a case whose study gives the noise");
    // A bare key of TOML must not have a slash or a space.
    assert_eq!(noise, "\"q_a/joint 1\" = 0.003\n");
}

#[test]
fn a_folder_of_models_gives_its_machines_and_says_what_it_refuses() {
    let folder = tempfile::tempdir().expect("a folder");
    let half = folder.path().join("training");
    std::fs::create_dir(&half).expect("a folder");
    let good = model(r#"<geom name="g" type="sphere" size="0.1"/>"#);
    let bad = model(r#"<geom name="hills" type="hfield" hfield="h"/>"#);
    std::fs::write(half.join("a.xml"), good).expect("a file");
    std::fs::write(half.join("b.xml"), bad).expect("a file");
    let found = outside::read(folder.path(), Half::Training).expect("a folder");
    assert_eq!(found.machines.len(), 1);
    assert!(found.refused[0].contains("b.xml") && found.refused[0].contains("`hills`"));
    assert!(outside::read(folder.path(), Half::Test).is_err());
}
