//! Whether a geom's friction can act at all.
//!
//! MuJoCo takes the friction of a contact from an explicit `<pair>` where there
//! is one, else from the geom of higher `priority`, else as the larger of the
//! two. A parameter on a geom that is overruled everywhere would be silently
//! without effect.

use mujoco_rs::wrappers::mj_model::MjModel;

use asid_core::layout::Layout;

/// Says what overrules the friction of `geom` in all the contacts it can make;
/// `None` where it counts in some, or where it can touch nothing.
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

/// Whether two geoms' contact bits match, on bodies that can move against each other.
fn can_touch(model: &MjModel, a: usize, b: usize) -> bool {
    let (contype, conaffinity) = (model.geom_contype(), model.geom_conaffinity());
    let weld = |g: usize| model.body_weldid()[model.geom_bodyid()[g] as usize];
    weld(a) != weld(b) && (contype[a] & conaffinity[b] != 0 || contype[b] & conaffinity[a] != 0)
}
