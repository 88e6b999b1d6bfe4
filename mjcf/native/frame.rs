//! Places inside a `<frame>`.
//!
//! A target states a place in the frame of a body. MuJoCo applies the frames around an element to
//! the place that the element states, so the inverse of their pose is applied before it is written.

use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use roxmltree::Node;

use super::Writer;

/// Ways to state a rotation whose meaning depends on the compiler's settings, or on other axes.
const OTHER_ROTATIONS: [&str; 4] = ["axisangle", "euler", "xyaxes", "zaxis"];

impl Writer<'_, '_> {
    /// Writes a `pos` (a point, m) or an `axis` (a direction), given in the frame of the body.
    ///
    /// `what` names the element.
    pub(super) fn write_place(
        &mut self,
        what: &str,
        node: Node<'_, '_>,
        attribute: &str,
        values: &[f64],
    ) {
        let (true, &[x, y, z]) = (is_framed(node), values) else {
            self.markup.set_numbers(node, attribute, values);
            return;
        };
        let mut pose = Isometry3::identity();
        for frame in frames(node) {
            let Some(outer) = pose_of(frame) else {
                self.leave_out(format!(
                    "{what} lies in a <frame> that is turned by no quat: its new {attribute} {values:?} is not written"
                ));
                return;
            };
            pose = outer * pose;
        }
        let value = match attribute {
            "axis" => pose.inverse_transform_vector(&Vector3::new(x, y, z)),
            _ => pose.inverse_transform_point(&Point3::new(x, y, z)).coords,
        };
        self.markup.set_numbers(node, attribute, value.as_slice());
    }
}

/// The frames around an element within its body, the innermost first.
fn frames<'a, 'i>(node: Node<'a, 'i>) -> impl Iterator<Item = Node<'a, 'i>> {
    let around = node.ancestors().skip(1);
    around.take_while(|n| n.has_tag_name("frame"))
}

/// Whether an element lies in a frame within its body.
pub(super) fn is_framed(node: Node<'_, '_>) -> bool {
    frames(node).next().is_some()
}

/// The pose of a frame; `None` where it is not stated by `pos` and `quat`.
fn pose_of(frame: Node<'_, '_>) -> Option<Isometry3<f64>> {
    if OTHER_ROTATIONS.iter().any(|a| frame.has_attribute(*a)) {
        return None;
    }
    let numbers = |attribute: &str, otherwise: &str| -> Option<Vec<f64>> {
        let text = frame.attribute(attribute).unwrap_or(otherwise);
        text.split_whitespace().map(|x| x.parse().ok()).collect()
    };
    let (place, turn) = (numbers("pos", "0 0 0")?, numbers("quat", "1 0 0 0")?);
    let (&[x, y, z], &[w, i, j, k]) = (&place[..], &turn[..]) else {
        return None;
    };
    let turn = UnitQuaternion::try_new(Quaternion::new(w, i, j, k), 0.0)?;
    Some(Isometry3::from_parts(Translation3::new(x, y, z), turn))
}
