//! The machine with other values than the document's.

use asid_core::target::Target;
use nalgebra::Vector3;

use super::Plant;

impl Plant {
    /// Whether a target's value changes what the plant holds ([`Plant::set`]).
    #[must_use]
    pub fn holds(&self, target: &Target) -> bool {
        matches!(
            (&*target.element, &*target.attribute),
            ("actuator", "gear" | "forcerange")
                | ("body", "mass" | "ipos" | "pos")
                | ("geom", "mass" | "pos")
                | ("joint", "pos" | "axis")
        )
    }

    /// Gives a target another value; `nominal` is the value in the document.
    ///
    /// Gears and force limits of drives, masses and places change. Of all else nothing does.
    pub fn set(&mut self, target: &Target, [nominal, value]: [f64; 2]) {
        let names = &self.layout;
        let attribute = &*target.attribute;
        match &*target.element {
            "actuator" => {
                if let Ok(i) = names.actuator(&target.name) {
                    let at = [nominal, value];
                    self.drives[i] =
                        self.drives[i].map(|drive| drive.with(attribute, target.index, at));
                }
            }
            "body" => {
                if let Ok(body) = names.body(&target.name) {
                    self.set_body(body, target, [nominal, value]);
                }
            }
            "geom" => {
                if let Ok(geom) = self.geom(&target.name) {
                    self.set_geom(geom, target, value);
                }
            }
            "joint" => {
                let joint = names.joints.iter().position(|j| j.name == target.name);
                let joint = joint.and_then(|j| self.joints.get_mut(j));
                let place = joint.and_then(|joint| match attribute {
                    "pos" => joint.anchor.get_mut(target.index),
                    "axis" => joint.axis.get_mut(target.index),
                    _ => None,
                });
                if let Some(place) = place {
                    *place = value;
                }
            }
            _ => {}
        }
    }

    fn set_body(&mut self, body: usize, target: &Target, [nominal, value]: [f64; 2]) {
        match (&*target.attribute, target.index) {
            ("mass", _) => self.bodies[body].mass = value,
            // Masses and places of the geoms may move the centre too.
            ("ipos", axis @ 0..3) => self.bodies[body].center[axis] += value - nominal,
            ("pos", axis @ 0..3) => self.poses[body].translation.vector[axis] = value,
            _ => {}
        }
    }

    fn set_geom(&mut self, geom: usize, target: &Target, value: f64) {
        let body = self.geoms[geom].body;
        let (_, before) = self.mass_of_geoms(body);
        match (&*target.attribute, target.index) {
            ("mass", _) => self.geoms[geom].mass = value,
            ("pos", axis @ 0..3) => self.geoms[geom].center[axis] = value,
            _ => {}
        }
        if !self.geoms[geom].has_mass {
            return;
        }
        let (mass, center) = self.mass_of_geoms(body);
        let own = &mut self.bodies[body];
        own.mass = mass;
        let center = Vector3::from(own.center) + center - before;
        if center.iter().all(|x| x.is_finite()) {
            own.center = center.into();
        }
    }

    /// Mass of the geoms of a body, kg, and its centre in the body's frame, m.
    fn mass_of_geoms(&self, body: usize) -> (f64, Vector3<f64>) {
        let geoms = self.geoms.iter().filter(|g| g.body == body && g.has_mass);
        let add = |(mass, moment): (f64, Vector3<f64>), geom: &super::PlantGeom| {
            let center = Vector3::from(geom.center);
            (mass + geom.mass, moment + center * geom.mass)
        };
        let (mass, moment) = geoms.fold((0.0, Vector3::zeros()), add);
        (mass, moment / mass)
    }
}

#[cfg(test)]
mod tests {
    use asid_core::scene::Scene;

    use super::*;

    fn plant(xml: &str) -> Plant {
        Plant::of(&Scene::from_xml("machine", xml, &[]).unwrap()).unwrap()
    }

    /// A machine; `{}` are the masses and places of its parts.
    fn machine([light, far, link, anchor]: [f64; 4]) -> String {
        format!(
            r#"<mujoco><worldbody><body name="a"><joint name="j" axis="0 0 1"/>
              <geom name="near" size="0.1" mass="{light}"/><geom name="far" size="0.1" mass="1" pos="{far} 0 0"/>
              <body name="b" pos="{link} 0 0"><joint name="k" axis="0 1 0" pos="0 0 {anchor}"/>
                <inertial pos="0.1 0 0" mass="2" diaginertia="1 1 1"/></body></body></worldbody></mujoco>"#
        )
    }

    /// Symptom: a force on a link pushed its joint by the wrong share, where an axis that the
    /// document states as `1 1 0` was turned. Cause: engines scale an axis to length one, and the
    /// plant held two of its entries as they stand.
    #[test]
    fn an_entry_of_an_axis_is_one_of_a_unit_axis() {
        let xml = machine([1.0, 0.4, 0.5, 0.1]).replace(r#"axis="0 0 1""#, r#"axis="3 4 0""#);
        let mut found = plant(&xml);
        found.set(&"joint/j/axis/2".parse().unwrap(), [0.0, 0.5]);
        assert_eq!(found.joints[0].axis, [0.6, 0.8, 0.5]);
    }

    /// The plant with some values is that of the document with these values.
    #[test]
    fn values_are_those_of_a_document_that_has_them() {
        let was = [1.0, 0.4, 0.5, 0.1];
        let now = [3.0, 0.6, 0.7, -0.2];
        let mut found = plant(&machine(was));
        let targets = [
            "geom/near/mass",
            "geom/far/pos/0",
            "body/b/pos/0",
            "joint/k/pos/2",
        ];
        for (target, (nominal, value)) in targets.into_iter().zip(was.into_iter().zip(now)) {
            let target: Target = target.parse().unwrap();
            assert!(found.holds(&target));
            found.set(&target, [nominal, value]);
        }
        let wanted = plant(&machine(now));
        assert_eq!(found.joints, wanted.joints);
        for (a, b) in found.bodies.iter().zip(&wanted.bodies) {
            assert!((a.mass - b.mass).abs() < 1e-12);
            assert!((0..3).all(|k| (a.center[k] - b.center[k]).abs() < 1e-12));
        }
        let qpos = [0.3, -0.4];
        for (a, b) in found.poses(&qpos).iter().zip(wanted.poses(&qpos)) {
            assert!((a.translation.vector - b.translation.vector).norm() < 1e-12);
        }
        // A shift of the centre adds to what the geoms do.
        found.set(&"body/a/ipos/1".parse().unwrap(), [0.0, 0.02]);
        let center = found.bodies[1].center;
        assert!((center[0] - 0.6 / 4.0).abs() < 1e-12 && (center[1] - 0.02).abs() < 1e-12);
        found.set(&"body/b/ipos/0".parse().unwrap(), [0.1, -0.3]);
        found.set(&"body/b/mass".parse().unwrap(), [2.0, 5.0]);
        assert!((found.bodies[2].center[0] + 0.3).abs() < 1e-12);
        assert_eq!(found.bodies[2].mass, 5.0);
    }
}
