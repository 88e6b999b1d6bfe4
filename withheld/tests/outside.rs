//! Models that others wrote: what is a machine, and what is refused in a sentence that names the element.

use asid_withheld::anatomy::Anatomy;
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
    let machine = outside::machine(text, Half::Test).expect("a machine");
    assert_eq!(machine.name, "package/arm");
    let anatomy = Anatomy::of(machine).expect("a model");
    assert_eq!(anatomy.joints[0].name, "a/joint 1");
    assert_eq!(anatomy.bodies, ["world", "a/b c.d"]);
    // The middle of the range, and a part of it.
    let command = machine.commands[0];
    assert!((command.center - 1.0).abs() < 1e-12 && (command.amplitude - 1.2).abs() < 1e-12);
}

#[test]
fn what_cannot_be_a_machine_is_refused_by_the_name_of_its_element() {
    for (inside, name) in [
        (r#"<geom name="shell" type="mesh" mesh="m"/>"#, "`shell`"),
        (
            r#"<joint name="wrist" type="ball"/><geom size="0.1"/>"#,
            "`wrist`",
        ),
    ] {
        let error = outside::machine(model(inside), Half::Test).expect_err("a refusal");
        let text = error.to_string();
        assert!(text.contains(name) && text.contains("`a/b c.d`"), "{text}");
    }
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
