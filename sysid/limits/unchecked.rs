//! Limits of parts whose motion or force is not compared with any.

use asid_core::error::Result;
use asid_core::layout::{Joint, JointKind};
use asid_mjcf::Plant;

use super::{LimitRequest, wrong};

/// Whether positions and speeds of a joint are compared with limits.
pub(super) fn is_checked(joint: &Joint) -> bool {
    matches!(joint.kind, JointKind::Hinge | JointKind::Slide)
}

/// Refuses limits of named parts that are not there, or are not compared with limits.
pub(super) fn check_names(plant: &Plant, request: &LimitRequest) -> Result<()> {
    let layout = &plant.layout;
    let speeds = request.speed.keys().filter(|n| !n.is_empty());
    for name in request.position.keys().chain(speeds) {
        if !is_checked(layout.joint(name)?) {
            return Err(wrong(
                "limit_position, limit_speed",
                format!("joint `{name}` is no hinge or slide, and only those have limits"),
            ));
        }
    }
    for name in request.force.keys().filter(|n| !n.is_empty()) {
        plant.drive(name)?;
    }
    Ok(())
}

/// One sentence for each limit without a name that does not hold for all parts.
pub(super) fn sentences(plant: &Plant, request: &LimitRequest) -> Vec<String> {
    let layout = &plant.layout;
    let mut all = Vec::new();
    let mut tell = |quantity: &str, names: Vec<&str>, what: &str| {
        if !names.is_empty() {
            let names = names.join(", ");
            all.push(format!("no limit of {quantity} holds for {names}: {what}"));
        }
    };
    if request.speed.contains_key("") {
        let joints = layout.joints.iter().filter(|j| !is_checked(j));
        let names = joints.map(|j| &*j.name).collect();
        tell("speed", names, "only hinges and slides are checked");
    }
    if request.force.contains_key("") {
        let pairs = layout.actuators.iter().zip(&plant.drives);
        let others = pairs.filter(|(_, drive)| drive.is_none());
        let names = others.map(|(a, _)| &*a.name).collect();
        tell(
            "force",
            names,
            "only motors, position and velocity servos of hinges and slides are checked",
        );
    }
    let limited =
        |name: &String| request.force.contains_key("") || request.force.contains_key(name);
    let pairs = layout.actuators.iter().zip(&plant.drives);
    let late =
        pairs.filter(|(a, drive)| limited(&a.name) && drive.is_some_and(|d| !d.is_memoryless()));
    let late: Vec<&str> = late.map(|(a, _)| &*a.name).collect();
    if !late.is_empty() {
        all.push(format!(
            "the limit of force of {} is checked as if the drive had no filter and no delay",
            late.join(", ")
        ));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::super::Limits;
    use super::*;
    use asid_core::Scene;

    /// A wrist that is a ball, and a finger that a tendon pulls.
    const ARM: &str = r#"<mujoco><worldbody>
        <body name="hand"><joint name="wrist" type="ball"/><geom size="0.05"/>
        <body name="finger" pos="0.1 0 0"><joint name="knuckle" axis="0 1 0"/><geom size="0.02"/></body></body>
        </worldbody>
        <tendon><fixed name="string"><joint joint="knuckle" coef="0.01"/></fixed></tendon>
        <actuator><motor name="bend" joint="knuckle"/><motor name="pull" tendon="string"/></actuator></mujoco>"#;

    fn limits(request: &LimitRequest) -> Result<Limits> {
        let plant = Plant::of(&Scene::from_xml("arm", ARM, &[]).unwrap()).unwrap();
        Limits::new(&plant, &|_| None, request)
    }

    /// Symptom: `--limit-speed wrist:1` was accepted, nothing was checked, and the answer was "all
    /// limits hold".
    ///
    /// Cause: the name of any joint was accepted, and only hinges and slides are checked.
    #[test]
    fn a_limit_of_a_joint_that_is_not_checked_is_refused() {
        let refused = |request: LimitRequest| limits(&request).unwrap_err().to_string();
        let by_speed = refused(LimitRequest {
            speed: [("wrist".to_owned(), 1.0)].into(),
            ..LimitRequest::default()
        });
        let by_position = refused(LimitRequest {
            position: [("wrist".to_owned(), [-1.0, 1.0])].into(),
            ..LimitRequest::default()
        });
        for said in [by_speed, by_position] {
            assert!(said.contains("`wrist` is no hinge or slide"), "{said}");
        }
        // Unlike a speed or a force, a range is that of a single joint.
        let unnamed = refused(LimitRequest {
            position: [(String::new(), [-1.0, 1.0])].into(),
            ..LimitRequest::default()
        });
        assert!(unnamed.contains("joint"), "{unnamed}");
    }

    /// Symptom: "all limits hold" with `--limit-force 5`, although the force of a tendon's motor
    /// was not looked at.
    ///
    /// Cause: a limit without a name passed over actuators whose force is not computed.
    #[test]
    fn a_limit_without_a_name_tells_which_parts_it_does_not_hold_for() {
        let all = |x: f64| [(String::new(), x)].into();
        let found = limits(&LimitRequest {
            speed: all(1.0),
            force: all(5.0),
            ..LimitRequest::default()
        })
        .unwrap();
        assert_eq!(found.joints.len(), 1);
        assert_eq!(found.drives.len(), 1);
        let told = &found.unchecked;
        assert_eq!(told.len(), 2, "{told:?}");
        assert!(told[0].contains("speed holds for wrist:"), "{told:?}");
        assert!(told[1].contains("force holds for pull:"), "{told:?}");
        // Without such a limit there is nothing to tell.
        let none = limits(&LimitRequest::default()).unwrap().unchecked;
        assert!(none.is_empty(), "{none:?}");
    }
}
