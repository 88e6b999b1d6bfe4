//! Another rod, for a real world whose rod differs from the model's.
//!
//! The paper's real rods are found objects whose simulated twins have a measured length and
//! otherwise guessed properties. This rod therefore differs from the model:
//!
//! - It is 0.28 m long instead of 0.30 m.
//! - It weighs 0.25 kg instead of 0.20 kg.
//! - It has 0.70 of its mass at the offset instead of 0.75.
//! - Its friction is 0.25 instead of 0.20.
//!
//! Height and width are the same, since the gripper and the start pose depend on them.

use asid_core::{Result, Scene};

/// Half length of one of the five boxes, m.
const BOX_HALF: f64 = 0.028;

/// Mass of each box, kg.
const BOX_MASS: f64 = 0.015;

/// Mass at the offset, kg.
const MOVABLE_MASS: f64 = 0.175;

/// Friction coefficient with the table.
const FRICTION: f64 = 0.25;

/// Returns the scene with the other rod.
pub fn scene(scene: &Scene) -> Result<Scene> {
    let mut other = scene.with_attribute("geom", "rod_mass", "mass", &MOVABLE_MASS.to_string())?;
    for i in 0..5 {
        let name = format!("rod_{}", i + 1);
        let along = 2.0 * BOX_HALF * (f64::from(i) - 2.0);
        for (attribute, value) in [
            ("pos", format!("0 {along:.6} 0")),
            ("size", format!("0.02 {BOX_HALF} 0.02")),
            ("mass", BOX_MASS.to_string()),
            ("friction", format!("{FRICTION} 0.005 0.0001")),
        ] {
            other = other.with_attribute("geom", &name, attribute, &value)?;
        }
    }
    Ok(other)
}

#[cfg(test)]
mod tests {
    use crate::rod_balancing::RodBalancing;
    use asid_core::Task as _;
    use asid_mjcf::Plant;

    #[test]
    fn the_rod_is_another_one() {
        let task = RodBalancing::new().unwrap();
        let other = task.stand_in().unwrap().unwrap();
        let [own, other] = [task.scene(), &other].map(|s| Plant::of(s).unwrap());
        assert_eq!(own.layout.geoms, other.layout.geoms);
        let rod = |p: &Plant| p.layout.bodies.iter().position(|b| b == "rod").unwrap();
        let mass = |p: &Plant| p.bodies[rod(p)].mass;
        assert!((mass(&own) - 0.2).abs() < 1e-9 && (mass(&other) - 0.25).abs() < 1e-9);
        let friction = |p: &Plant| p.geoms[p.geom("rod_1").unwrap()].friction[0];
        assert_eq!((friction(&own), friction(&other)), (0.2, 0.25));
    }
}
