use super::*;
use crate::scene::Scene;

/// The description of a document with this content.
fn described(inside: &str) -> std::sync::Arc<mjcf_rs::Model> {
    let scene = Scene::from_xml("test", &format!("<mujoco>{inside}</mujoco>"), &[]).unwrap();
    scene.description().unwrap()
}

fn refused(inside: &str) -> String {
    let scene = Scene::from_xml("test", &format!("<mujoco>{inside}</mujoco>"), &[]).unwrap();
    let read = scene.description();
    read.err().map(|e| e.to_string()).unwrap_or_default()
}

/// Position and orientation (w x y z) of a pose.
fn parts(pose: &mjcf_rs::Pose) -> [f64; 7] {
    let (p, q) = (pose.translation, pose.rotation);
    [p.x, p.y, p.z, q.w, q.x, q.y, q.z]
}

fn near(found: &[f64], theory: &[f64]) {
    assert_eq!(found.len(), theory.len());
    let error = found.iter().zip(theory).map(|(a, b)| (a - b).abs());
    assert!(error.fold(0.0, f64::max) < 1e-12, "{found:?}");
}

/// The cosine of 45°.
const HALF: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Symptom: rolling friction was off by a factor of 100, and a capsule had no length. Cause: the
/// parser filled the entries that a geom leaves out with MJCF's defaults, and not from its class.
#[test]
fn later_entries_of_a_list_are_those_of_the_class() {
    let model = described(
        r#"<default><geom friction="0.8 0.01 0.001" size="0.02 0.1"/>
          <default class="smooth"><geom friction="0.3"/></default></default>
        <worldbody><geom friction="0.6"/><geom class="smooth"/><geom class="smooth" friction="0.4 0.02"/>
          <geom type="capsule" size="0.03"/></worldbody>"#,
    );
    let geoms = &model.bodies[0].body.geoms;
    assert_eq!(geoms[0].friction, [0.6, 0.01, 0.001]);
    assert_eq!(geoms[1].friction, [0.3, 0.01, 0.001]);
    assert_eq!(geoms[2].friction, [0.4, 0.02, 0.001]);
    assert_eq!(geoms[3].size, [0.03, 0.1, 0.0]);
}

/// Symptom: a servo had no damping. Cause: as of `later_entries_of_a_list_are_those_of_the_class`.
#[test]
fn later_coefficients_of_an_actuator_are_those_of_the_class() {
    let model = described(
        r#"<default><general gainprm="50" biasprm="0 -50 -4" biastype="affine"/>
          <default class="soft"><general biasprm="0 -55"/></default></default>
        <worldbody><body><joint name="j"/><geom size=".1"/></body></worldbody>
        <actuator> <general joint="j" biasprm="0 -60"/><general class="soft" joint="j"/></actuator>"#,
    );
    assert_eq!(model.actuators[0].biasprm, [0.0, -60.0, -4.0]);
    assert_eq!(model.actuators[1].biasprm, [0.0, -55.0, -4.0]);
    assert_eq!(model.actuators[1].gainprm, [50.0]);
}

/// Symptom: a geom was at the body's origin, or not turned. Cause: position and rotation were taken
/// together, from the geom or from its class.
#[test]
fn a_position_may_be_of_the_class_and_the_rotation_of_the_element() {
    let model = described(
        r#"<default><default class="turned"><geom quat="1 0 1 0" size=".1"/></default>
          <default class="placed"><geom pos="0 0 .3" size=".1"/><site pos="1 0 0"/></default></default>
        <worldbody><body childclass="placed"><joint/>
          <geom class="turned" pos=".1 0 0"/><geom euler="0 90 0"/><site euler="0 90 0"/></body></worldbody>"#,
    );
    let body = &model.bodies[1].body;
    near(
        &parts(&body.geoms[0].pose),
        &[0.1, 0.0, 0.0, HALF, 0.0, HALF, 0.0],
    );
    near(
        &parts(&body.geoms[1].pose),
        &[0.0, 0.0, 0.3, HALF, 0.0, HALF, 0.0],
    );
    near(
        &parts(&body.sites[0].pose),
        &[1.0, 0.0, 0.0, HALF, 0.0, HALF, 0.0],
    );
}

/// Symptom: joints of a body were missing, so that all later ones had another index; a link lay
/// beside its place. Cause: the parser drops joints and inertias in frames, and leaves the ends of
/// geoms there.
#[test]
fn a_frame_moves_whatever_is_in_it() {
    let model = described(
        r#"<default><default class="loose"><joint damping="3"/></default></default>
        <worldbody><frame pos="0 0 1"><body name="b" pos="1 0 0" euler="90 0 0">
          <frame pos="0 0 .5" euler="0 0 90" childclass="loose">
            <joint name="first" axis="1 0 0"/><inertial pos=".1 0 0" mass="1" diaginertia="1 2 2.5"/>
            <frame pos=".1 0 0"><joint name="second" type="slide" pos="0 .2 0"/>
              <geom name="rod" type="capsule" size=".01" fromto="0 0 0 1 0 0"/></frame>
            <geom name="ball" size=".1" pos="1 0 0"/><site name="tip" pos="0 1 0" zaxis="1 0 0"/></frame>
          <joint name="third"/></body></frame></worldbody>"#,
    );
    let body = &model.bodies[1].body;
    near(&parts(&body.pose), &[1.0, 0.0, 1.0, HALF, HALF, 0.0, 0.0]);
    let names: Vec<_> = body.joints.iter().map(|j| j.name.as_deref()).collect();
    assert_eq!(names, [Some("first"), Some("second"), Some("third")]);
    near(&body.joints[0].pos, &[0.0, 0.0, 0.5]);
    near(&body.joints[0].axis, &[0.0, 1.0, 0.0]);
    near(&body.joints[1].pos, &[-0.2, 0.1, 0.5]);
    near(&body.joints[1].axis, &[0.0, 0.0, 1.0]);
    let damping: Vec<_> = body.joints.iter().map(|j| j.damping).collect();
    assert_eq!(damping, [3.0, 3.0, 0.0]);
    near(
        &body.geoms[0].fromto.unwrap(),
        &[0.0, 0.1, 0.5, 0.0, 1.1, 0.5],
    );
    near(
        &parts(&body.geoms[1].pose),
        &[0.0, 1.0, 0.5, HALF, 0.0, 0.0, HALF],
    );
    let tip = &body.sites[0].pose;
    near(&parts(tip)[..3], &[-1.0, 0.0, 0.5]);
    near(
        &(tip.rotation * mjcf_rs::glam::DVec3::Z).to_array(),
        &[0.0, 1.0, 0.0],
    );
    let inertial = parts(&body.inertial.as_ref().unwrap().pose);
    near(&inertial, &[0.0, 0.1, 0.5, HALF, 0.0, 0.0, HALF]);
}

/// Each way to state the same rotation of a frame gives the same place of a geom.
#[test]
fn rotations_of_frames_are_those_of_their_kind() {
    let turns = [
        r#"quat="2 2 2 2""#,
        r#"axisangle="1 1 1 120""#,
        r#"xyaxes="0 3 0 0 1 2""#,
        r#"euler="90 90 0""#,
    ];
    for turn in turns {
        let model = described(&format!(
            r#"<worldbody><frame {turn}><geom size=".1" pos="1 2 3"/></frame></worldbody>"#
        ));
        // x to y, y to z, z to x.
        let pose = parts(&model.bodies[0].body.geoms[0].pose);
        near(&pose, &[3.0, 1.0, 2.0, 0.5, 0.5, 0.5, 0.5]);
    }
    let about_fixed_axes = described(
        r#"<compiler angle="radian" eulerseq="ZXY"/>
        <worldbody><frame euler="1.5707963267948966 1.5707963267948966 0"><geom size=".1" pos="1 2 3"/></frame></worldbody>"#,
    );
    let pose = parts(&about_fixed_axes.bodies[0].body.geoms[0].pose);
    // About z it goes to (-2, 1, 3), then about x to (-2, -3, 1).
    near(&pose[..3], &[-2.0, -3.0, 1.0]);
}

/// Symptom: a document that `asid export` wrote could be no model: "not a float". Cause: stiffness
/// may have coefficients of higher order.
#[test]
fn stiffness_of_higher_order_is_read_by_its_first_coefficient() {
    let model = described(
        r#"<default><joint damping="2 1"/></default>
        <worldbody><body><joint stiffness="5 0 30"/><geom size=".1"/></body></worldbody>"#,
    );
    let joint = &model.bodies[1].body.joints[0];
    assert_eq!((joint.stiffness, joint.damping), (5.0, 2.0));
}

#[test]
fn a_document_of_that_form_stays_as_it_is() {
    let xml = r#"<mujoco><default><geom friction="1 .01 .001" pos="0 0 1"/><default class="a"><geom quat="1 0 0 0"/></default></default>
      <worldbody><body><freejoint/><geom size="1 1 1" friction="1 0 0"/><geom size=".1" pos="0 0 0" euler="0 0 1"/></body></worldbody>
      <actuator><motor joint="x"/></actuator></mujoco>"#;
    assert!(matches!(
        normal_form("test", xml),
        Ok(Cow::Borrowed(text)) if text == xml
    ));
}

#[test]
fn what_cannot_be_moved_out_of_a_frame_is_named() {
    let frame = |inside: &str| format!("\n<worldbody><body>{inside}</body></worldbody>");
    for (inside, says) in [
        (
            r#"<frame pos="0 0"><geom/></frame>"#,
            r#"line 2: pos="0 0" is not 3 numbers"#,
        ),
        (
            r#"<frame euler="1 b 2"/>"#,
            r#"line 2: euler="1 b 2" is no rotation"#,
        ),
        (
            r#"<frame><attach model="m" body="b" prefix="p"/></frame>"#,
            "line 2: <attach> in a <frame>",
        ),
    ] {
        let error = refused(&frame(inside));
        assert!(error.contains(says) && !error.contains('\n'), "{error}");
    }
}
