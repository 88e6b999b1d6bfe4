//! The difference of two readings of tracked signals.
//!
//! The difference is *whitened*: divided by the standard deviation of the sensor's noise, with
//! rotations compared as rotations. The same differences make the likelihood (identification), the
//! sensitivity (information) and the gap (diagnosis).

use asid_core::layout::JointKind;
use asid_core::signal::{Signal, rotation_difference, unit_quaternion};
use asid_core::{Layout, Result, Scene};
use nalgebra::UnitQuaternion;

#[derive(Clone, Copy, Debug)]
struct Part {
    start: usize,
    len: usize,
    rotation: bool,
    /// Whether its entries are angles.
    angle: bool,
    noise: f64,
}

/// Signals resolved against a scene, in the order of a reading's row.
#[derive(Clone, Debug)]
pub struct SignalSet {
    parts: Vec<Part>,
    width: usize,
    whitened: usize,
}

impl SignalSet {
    /// Resolves `signals`, whose entries follow each other in a row.
    ///
    /// # Errors
    /// When the scene has no such sensor.
    pub fn new(layout: &Layout, signals: &[Signal]) -> Result<Self> {
        let mut parts = Vec::with_capacity(signals.len());
        let (mut width, mut whitened) = (0, 0);
        for signal in signals {
            let sensor = layout.sensor(&signal.sensor)?;
            let rotation = sensor.len == 4;
            parts.push(Part {
                start: width,
                len: sensor.len,
                rotation,
                angle: rotation,
                noise: signal.noise,
            });
            width += sensor.len;
            whitened += if rotation { 3 } else { sensor.len };
        }
        Ok(Self {
            parts,
            width,
            whitened,
        })
    }

    /// Returns the same set with the positions of hinges marked as angles.
    ///
    /// A layout does not separate these from the positions of slides, so `scene` provides the joint
    /// that each sensor reads. `signals` are those that the set was made of.
    ///
    /// # Errors
    /// When the scene's document is not valid MJCF.
    pub fn with_angles_of(
        mut self,
        scene: &Scene,
        layout: &Layout,
        signals: &[Signal],
    ) -> Result<Self> {
        let document = scene.description()?;
        for (part, signal) in self.parts.iter_mut().zip(signals) {
            let mut sensors = document.sensors.iter().filter(|s| s.kind == "jointpos");
            let joint = sensors
                .find(|s| s.name.as_deref() == Some(&*signal.sensor))
                .and_then(|s| layout.joint(s.objname.as_deref()?).ok());
            part.angle |= joint.is_some_and(|j| j.kind == JointKind::Hinge);
        }
        Ok(self)
    }

    /// Number of entries of each signal in a reading's row.
    pub fn lens(&self) -> impl Iterator<Item = usize> + use<> {
        let lens: Vec<usize> = self.parts.iter().map(|p| p.len).collect();
        lens.into_iter()
    }

    /// Number of entries of a reading's row.
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Number of entries of a whitened difference: three for an orientation.
    #[must_use]
    pub fn whitened_len(&self) -> usize {
        self.whitened
    }

    /// Whether each entry of a whitened difference is an angle.
    ///
    /// Angles are the entries of an orientation, and of a hinge after
    /// [`SignalSet::with_angles_of`].
    #[must_use]
    pub fn angles(&self) -> Vec<bool> {
        let parts = self.parts.iter();
        parts
            .flat_map(|p| std::iter::repeat_n(p.angle, if p.rotation { 3 } else { p.len }))
            .collect()
    }

    /// Writes the whitened difference `(a - b) / noise`, `whitened_len` entries.
    /// Where either reading is missing (NaN) the entry is NaN.
    pub fn difference(&self, a: &[f64], b: &[f64], out: &mut [f64]) {
        let mut k = 0;
        for part in &self.parts {
            let (a, b) = (&a[part.start..][..part.len], &b[part.start..][..part.len]);
            if part.rotation {
                let turn = rotation_difference(a, b);
                for t in turn {
                    out[k] = t / part.noise;
                    k += 1;
                }
            } else {
                for (x, y) in a.iter().zip(b) {
                    out[k] = (x - y) / part.noise;
                    k += 1;
                }
            }
        }
    }

    /// Adds the sensors' noise to a true reading; `normal` draws a standard normal number.
    pub fn add_noise(&self, reading: &mut [f64], mut normal: impl FnMut() -> f64) {
        for part in &self.parts {
            let row = &mut reading[part.start..][..part.len];
            if part.rotation {
                let turn = nalgebra::Vector3::from_fn(|_, _| normal() * part.noise);
                let noisy = UnitQuaternion::from_scaled_axis(turn) * unit_quaternion(row);
                row.copy_from_slice(&[noisy.w, noisy.i, noisy.j, noisy.k]);
            } else {
                for x in row {
                    *x += normal() * part.noise;
                }
            }
        }
    }

    /// Shifts a reading by `offset`, `whitened_len` entries in the sensors' units.
    ///
    /// Numbers are added. A rotation vector (rad) rotates an orientation about the axes of its
    /// object.
    pub fn add_offset(&self, reading: &mut [f64], offset: &[f64]) {
        let mut k = 0;
        for part in &self.parts {
            let row = &mut reading[part.start..][..part.len];
            if part.rotation {
                let turn = nalgebra::Vector3::new(offset[k], offset[k + 1], offset[k + 2]);
                let turned = unit_quaternion(row) * UnitQuaternion::from_scaled_axis(turn);
                row.copy_from_slice(&[turned.w, turned.i, turned.j, turned.k]);
                k += 3;
            } else {
                for x in row {
                    *x += offset[k];
                    k += 1;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use asid_core::layout::{Joint, Sensor};

    /// Symptom: a tracked hinge angle had the prior of a tracked position, 0.001 m, instead of
    /// 0.005 rad. Cause: the search was by a unit that no sensor has, since a joint position is m
    /// or rad depending on the joint.
    #[test]
    fn an_angle_is_known_by_the_joint_that_its_sensor_reads() {
        let xml = r#"<mujoco><worldbody><body><joint name="turn"/><geom size="0.1"/></body>
            <body><joint name="rail" type="slide"/><geom size="0.1"/></body></worldbody>
            <sensor><jointpos name="x" joint="rail"/><jointpos name="q" joint="turn"/><jointvel name="w" joint="turn"/></sensor></mujoco>"#;
        let scene = Scene::from_xml("s", xml, &[]).unwrap();
        let joints = [("turn", JointKind::Hinge), ("rail", JointKind::Slide)];
        let sensors = [("x", "jointpos"), ("q", "jointpos"), ("w", "jointvel")];
        let layout = Layout {
            timestep: 0.002,
            nq: 2,
            nv: 2,
            bodies: Vec::new(),
            geoms: Vec::new(),
            joints: (0..2)
                .map(|i| Joint {
                    name: joints[i].0.into(),
                    kind: joints[i].1,
                    body: String::new(),
                    qpos: i,
                    qvel: i,
                })
                .collect(),
            actuators: Vec::new(),
            sensors: (0..3)
                .map(|i| Sensor {
                    name: sensors[i].0.into(),
                    kind: sensors[i].1.into(),
                    address: i,
                    len: 1,
                })
                .collect(),
            keyframes: Vec::new(),
        };
        let signals = sensors.map(|(name, _)| Signal {
            sensor: name.into(),
            noise: 1.0,
        });
        let set = SignalSet::new(&layout, &signals).unwrap();
        let set = set.with_angles_of(&scene, &layout, &signals).unwrap();
        assert_eq!(set.angles(), [false, true, false]);
    }
}
