//! Missing forces of the model as arrows: where they act, in which direction, and how large they
//! are in each frame.

use asid_core::layout::JointKind;
use asid_results::trace::ForceTrace;
use asid_results::view::Force;

use crate::Stage;

/// The missing force along an episode, at some of its frames; `None` where the scene has no such
/// degree of freedom.
#[must_use]
pub fn at(missing: &ForceTrace, stage: &Stage<'_>, frames: &[f64]) -> Option<Force> {
    let plant = stage.plant;
    let joints = &plant.layout.joints;
    let named = |j: usize| {
        let axis = missing.dof.strip_prefix(&joints[j].name)?;
        (axis.is_empty() || axis.starts_with('.')).then_some((j, axis))
    };
    // The longest name wins, because one joint's name may be a prefix of another's.
    let (joint, axis) = (0..joints.len())
        .filter_map(named)
        .max_by_key(|(j, _)| joints[*j].name.len())?;
    let own = &plant.joints[joint];
    let unit = |letter: &str| match letter {
        "x" => Some([1.0, 0.0, 0.0]),
        "y" => Some([0.0, 1.0, 0.0]),
        "z" => Some([0.0, 0.0, 1.0]),
        _ => None,
    };
    let (turns, in_world, direction, at) = match joints[joint].kind {
        JointKind::Hinge => (true, false, own.axis, own.anchor),
        JointKind::Slide => (false, false, own.axis, own.anchor),
        JointKind::Ball => (true, false, unit(axis.strip_prefix(".r")?)?, own.anchor),
        JointKind::Free => {
            let center = plant.bodies[own.body].center;
            match axis.strip_prefix(".r") {
                Some(letter) => (true, false, unit(letter)?, center),
                None => (false, true, unit(axis.strip_prefix('.')?)?, center),
            }
        }
    };
    let whole = &missing.whole;
    let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
    Some(Force {
        dof: missing.dof.clone(),
        unit: missing.unit.clone(),
        part: stage.part_of[own.body],
        turns,
        at: at.map(|x| x as f32),
        axis: direction.map(|x| (x / length) as f32),
        in_world,
        before: along(&whole.time, &whole.before, frames),
        after: along(&whole.time, &whole.after, frames),
    })
}

/// A series at other times; 0 outside it and where it is unknown. Empty if there is no series.
fn along(time: &[f64], values: &[f64], frames: &[f64]) -> Vec<f32> {
    let n = time.len().min(values.len());
    if n == 0 {
        return Vec::new();
    }
    let at = |&t: &f64| {
        let next = time[..n].partition_point(|&x| x < t);
        let value = match next {
            0 if time[0] - t > 1e-6 => 0.0,
            0 => values[0],
            next if next == n => 0.0,
            next => {
                let share = (t - time[next - 1]) / (time[next] - time[next - 1]);
                values[next - 1] + share * (values[next] - values[next - 1])
            }
        };
        if value.is_finite() { value as f32 } else { 0.0 }
    };
    frames.iter().map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use asid_core::Scene;
    use asid_mjcf::Plant;
    use asid_results::trace::ForceSeries;

    #[test]
    fn arrows_stand_where_the_degree_of_freedom_is() {
        let xml = r#"<mujoco><worldbody><body name="a"><joint name="arm" axis="0 0 2" pos="0.1 0 0"/><geom size="1"/>
          <body name="b"><joint name="arm_2" type="slide" axis="1 0 0"/><geom size="1"/></body></body>
          <body name="c"><freejoint name="fly"/><geom size="1" pos="0 0 0.5"/></body></worldbody></mujoco>"#;
        let scene = Scene::from_xml("three", xml, &[]).unwrap();
        let plant = Plant::of(&scene).unwrap();
        let stage = Stage::of(&scene, &plant).unwrap();
        let of = |dof: &str| {
            let missing = ForceTrace {
                dof: dof.into(),
                whole: ForceSeries {
                    time: vec![1.0, 2.0],
                    before: vec![3.0, 5.0],
                    ..ForceSeries::default()
                },
                ..ForceTrace::default()
            };
            at(&missing, &stage, &[0.0, 1.0, 1.5, 3.0])
        };
        let arm = of("arm").unwrap();
        assert_eq!((arm.part, arm.turns, arm.axis), (1, true, [0.0, 0.0, 1.0]));
        assert_eq!(arm.before, [0.0, 3.0, 4.0, 0.0]);
        assert!(arm.after.is_empty());
        let slide = of("arm_2").unwrap();
        assert_eq!((slide.part, slide.turns), (2, false));
        let fly = of("fly.y").unwrap();
        assert_eq!(
            (fly.in_world, fly.axis, fly.at[2]),
            (true, [0.0, 1.0, 0.0], 0.5)
        );
        assert!(of("fly.rz").unwrap().turns);
        assert!(of("fly.q").is_none() && of("nowhere").is_none());
    }
}
