//! Effects beside what the document says of the same drive or joint.

use super::{ARM, EXACT, distances, exported, refined};

/// Symptom: the export of a limit widened the limits that a motor with a gain has itself.
///
/// Cause: they were left out of the comparison, since the machine holds them before that gain.
#[test]
fn a_limit_does_not_widen_those_of_the_drive() {
    let motor = r#"<motor name="push" joint="shoulder" gear="2" ctrlrange="-2 2"/>"#;
    let general =
        r#"<general name="push" joint="shoulder" gainprm="5" gear="2" forcerange="-1 2"/>"#;
    let xml = ARM.replace(motor, general);
    assert_ne!(xml, ARM);
    let limit = ["actuator-saturation@push:limit=3"];
    let written = exported(&refined(&xml, &[], &limit)).xml;
    assert!(written.contains(r#"forcerange="-1 1.5""#), "{written}");
    let values = [("actuator/push/forcerange/1", 1.25)];
    let written = exported(&refined(&xml, &values, &limit)).xml;
    assert!(written.contains(r#"forcerange="-1 1.25""#), "{written}");
}

/// Symptom: gains and biases of a command at the end of its range moved the document otherwise than
/// the refined model.
///
/// Cause: the model's simulation cut them off at the range, which is before them in the document.
#[test]
fn what_is_behind_the_range_of_a_command_is_so_in_the_document() {
    let xml = ARM
        .replace(r#"ctrlrange="-2 2""#, r#"ctrlrange="-0.5 0.5""#)
        .replace(r#" forcerange="-6 6""#, "");
    for effects in [
        &["actuator-gain@push:gain=1.4"][..],
        &["actuator-bias@push:bias=0.3"][..],
        &["actuator-gain@hold:gain=1.4", "actuator-bias@hold:bias=0.1"][..],
    ] {
        let ([_, left], [_, without]) = distances(&refined(&xml, &[], effects), &[]);
        assert!(left < EXACT, "{effects:?}: {left} of {without}");
        assert!(without > 1e-3, "{effects:?} does nothing here: {without}");
    }
}

/// Symptom: springs and friction of a joint were lost in the exported document, though told as
/// written.
///
/// Cause: the joint's `springdamper` stayed, and MuJoCo computed stiffness and damping from it.
#[test]
fn a_time_constant_of_a_spring_is_written_as_its_stiffness_and_damping() {
    let own = r#"name="elbow" axis="0 1 0" springdamper="0.5 0.3""#;
    let own = ARM.replace(r#"name="elbow" axis="0 1 0""#, own);
    let class = ARM.replace(
        r#"<joint damping="0.05" armature="0.01"/>"#,
        r#"<joint damping="0.05" armature="0.01" springdamper="0.5 0.3"/>"#,
    );
    for xml in [own, class] {
        assert_ne!(xml, ARM);
        for effect in [
            "joint-stiffness@elbow:stiffness=2",
            "viscous-friction@elbow:damping=0.3",
            "armature@elbow:inertia=0.02",
        ] {
            let ([_, left], [_, without]) = distances(&refined(&xml, &[], &[effect]), &[]);
            assert!(left < EXACT, "{effect}: {left} of {without}");
            assert!(without > 1e-3, "{effect} does nothing here: {without}");
        }
    }
}

/// Symptom: MuJoCo refused an exported document, in which a `<freejoint>` had a `springdamper`.
///
/// Cause: the class for joints, of which a `<freejoint>` is none, was taken for its own.
#[test]
fn a_free_joint_has_no_spring_of_a_class() {
    let joint = r#"<freejoint name="ball"/>"#;
    let xml = format!(
        r#"<mujoco><default><joint springdamper="0.5 0.3"/></default><worldbody>
        <body name="ball" pos="0 0 1">{joint}<geom name="ball" size="0.05" mass="1"/></body></worldbody></mujoco>"#
    );
    let written = exported(&refined(&xml, &[], &["mass@ball:factor=2"])).xml;
    assert!(written.contains(joint), "{written}");
    assert!(written.contains(r#"mass="2""#), "{written}");
}

/// Symptom: the document of a model with a gap of no width had a range that MuJoCo refuses.
///
/// Cause: an effect at its null values was written, which the simulation is without.
#[test]
fn effects_that_are_off_are_not_written() {
    for effect in [
        "backlash@elbow:width=0",
        "joint-compliance@elbow:compliance=0",
        "joint-compliance@elbow:compliance=0,loss=0.1",
        "actuator-saturation@hold:limit=1000",
        "actuator-gain@hold",
    ] {
        let written = exported(&refined(ARM, &[], &[effect]));
        assert_eq!(written.xml, ARM, "{effect}");
        assert!(written.sentences().is_empty(), "{effect}");
    }
}

#[test]
fn a_coupling_of_an_elastic_joint_is_told() {
    let coupled = r#"<equality><joint joint1="shoulder" joint2="elbow"/></equality><actuator>"#;
    let effect = ["joint-compliance@elbow:compliance=0.05"];
    for (xml, told) in [
        (ARM.to_owned(), false),
        (ARM.replace("<actuator>", coupled), true),
    ] {
        let sentences = exported(&refined(&xml, &[], &effect))
            .sentences()
            .join("\n");
        let says = sentences.contains("`elbow` is coupled by an <equality>");
        assert_eq!(says, told, "{sentences}");
    }
}
