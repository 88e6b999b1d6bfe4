//! Which contacts a model can make, and whether a geom's friction can act at all.
//!
//! MuJoCo takes the friction of a contact from an explicit `<pair>` if there is one, else from the
//! geom of higher `priority`, else the larger of the two. A parameter on a geom that is always
//! overruled would silently have no effect.

use asid_core::layout::Layout;
use mujoco_rs::mujoco_c::mjtDisableBit;
use mujoco_rs::wrappers::mj_model::MjModel;

/// Whether the model can make any contact in any pose.
///
/// Most arms cannot, because a link does not collide with the one that carries it. Their steps need
/// no broad phase, which is a sixth of a step.
#[must_use]
pub fn is_possible(model: &MjModel) -> bool {
    let geoms = model.geom_bodyid().len();
    let touch = |a: usize, b: usize| can_touch(model, a, b) && !is_filtered(model, a, b);
    !model.pair_geom1().is_empty()
        || !model.flex_dim().is_empty()
        || (0..geoms).any(|a| (0..a).any(|b| touch(a, b)))
}

/// Whether MuJoCo omits all contacts between the bodies of two geoms: one carries the other, or an
/// `<exclude>` names both.
fn is_filtered(model: &MjModel, a: usize, b: usize) -> bool {
    let weld = |body: usize| model.body_weldid()[body] as usize;
    let body = |geom: usize| model.geom_bodyid()[geom] as usize;
    let bodies = [body(a), body(b)];
    let [own, other] = bodies.map(weld);
    let carrier = |body: usize| weld(model.body_parentid()[body] as usize);
    let filters = model.opt().disableflags & mjtDisableBit::mjDSBL_FILTERPARENT as i32 == 0;
    let carries = own != 0 && other != 0 && (carrier(own) == other || carrier(other) == own);
    let [low, high] = [bodies[0].min(bodies[1]), bodies[0].max(bodies[1])];
    let excluded = model.exclude_signature();
    let is_excluded = excluded.contains(&(((low << 16) + high) as i32))
        || excluded.contains(&(((high << 16) + low) as i32));
    filters && carries || is_excluded
}

/// What overrules the friction of `geom` in all contacts that it can make.
///
/// `None` where its friction counts in some contact, or where it can touch nothing.
#[must_use]
pub fn overruled(model: &MjModel, layout: &Layout, geom: usize) -> Option<String> {
    let name = |g: usize| &layout.geoms[g];
    let mut why = None;
    let mut paired = Vec::new();
    for (&a, &b) in model.pair_geom1().iter().zip(model.pair_geom2()) {
        let (a, b) = (a as usize, b as usize);
        if a == geom || b == geom {
            let other = if a == geom { b } else { a };
            paired.push(other);
            why = Some(format!(
                "a <pair> gives the friction between `{}` and `{}`",
                name(geom),
                name(other)
            ));
        }
    }
    let priority = model.geom_priority();
    for other in 0..layout.geoms.len() {
        if paired.contains(&other) || !can_touch(model, geom, other) {
            continue;
        }
        if priority[other] <= priority[geom] {
            return None;
        }
        why = Some(format!(
            "geom `{}` has the higher priority, so that its friction alone counts",
            name(other)
        ));
    }
    why
}

/// Whether two geoms' contact bits match and their bodies can move relative to each other.
fn can_touch(model: &MjModel, a: usize, b: usize) -> bool {
    let (contype, conaffinity) = (model.geom_contype(), model.geom_conaffinity());
    let weld = |g: usize| model.body_weldid()[model.geom_bodyid()[g] as usize];
    weld(a) != weld(b) && (contype[a] & conaffinity[b] != 0 || contype[b] & conaffinity[a] != 0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compiled::compile;
    use asid_core::Scene;

    /// Two links attached to the world, the second with `in_fore` in its body, and something in the
    /// world or beside it.
    fn model(beside: &str, in_fore: &str, after: &str) -> MjModel {
        let xml = format!(
            r#"<mujoco><worldbody>{beside}<body name="upper"><joint/><geom name="upper" size="0.1"/>
            <body name="fore" pos="0 0 -0.1"><joint/><geom name="fore" size="0.1"/>{in_fore}</body></body></worldbody>{after}</mujoco>"#
        );
        compile(&Scene::from_xml("links", &xml, &[]).unwrap(), true).unwrap()
    }

    #[test]
    fn a_link_does_not_touch_the_one_that_carries_it() {
        let off = |m: &MjModel| m.opt().disableflags & mjtDisableBit::mjDSBL_CONTACT as i32 != 0;
        let rigid = r#"<body><geom size="0.2"/></body>"#;
        for alone in [model("", "", ""), model("", rigid, "")] {
            assert!(!is_possible(&alone) && off(&alone));
        }
        let floor = r#"<geom type="plane" size="1 1 1"/>"#;
        let hand = r#"<body name="hand"><joint/><geom size="0.2"/></body>"#;
        let unfiltered = r#"<option><flag filterparent="disable"/></option>"#;
        let pair = r#"<contact><pair geom1="upper" geom2="fore"/></contact>"#;
        let more = [
            model(floor, "", ""),
            model("", hand, ""),
            model("", "", unfiltered),
            model("", "", pair),
        ];
        for can in more {
            assert!(is_possible(&can) && !off(&can));
        }
    }

    #[test]
    fn bodies_that_are_excluded_do_not_touch() {
        let hand = r#"<body name="hand"><joint/><geom size="0.2"/></body>"#;
        for [a, b] in [["hand", "upper"], ["upper", "hand"]] {
            let exclude = format!(r#"<contact><exclude body1="{a}" body2="{b}"/></contact>"#);
            assert!(!is_possible(&model("", hand, &exclude)));
        }
    }
}
