//! Readings of the sensors in a state.

use asid_core::layout::JointKind;
use nalgebra::{UnitQuaternion, Vector3};

use crate::compiled::Compiled;
use crate::coordinates::Motion;
use crate::sensor::{Reading, SensorSlot};
use crate::state::State;

impl SensorSlot {
    /// Reads it into `out`, which has the sensor's length.
    pub fn read(&self, state: &State, compiled: &Compiled, out: &mut [f64]) {
        match self {
            Self::Frame(reading, frame) => {
                let motion = state.motion(compiled, frame.body);
                read_at(*reading, &motion, &frame.position, &frame.rotation, out);
            }
            Self::Geom(reading, geom) => {
                let frame = &compiled.geom_frames[*geom];
                let motion = state.motion(compiled, frame.body);
                let position = state.structure.geoms[*geom].position;
                read_at(*reading, &motion, &position, &frame.rotation, out);
            }
            Self::Inertia(reading, body) => {
                let motion = state.motion(compiled, *body);
                let axes = compiled.masses.inertia(*body, &state.structure).axes;
                let rotation = motion.rotation * axes;
                let at = motion.center;
                read_frame(*reading, &at, &rotation, motion.linear, motion.angular, out);
            }
            Self::JointPosition(joint) | Self::JointVelocity(joint) => {
                let slot = &compiled.joints[*joint];
                let velocity = matches!(self, Self::JointVelocity(_));
                if slot.kind == JointKind::Ball {
                    let (q, rate) = state.ball(slot);
                    if velocity {
                        out.copy_from_slice(rate.as_slice());
                    } else {
                        out.copy_from_slice(&[q.w, q.i, q.j, q.k]);
                    }
                } else {
                    let (q, v) = state.scalar(slot);
                    out[0] = if velocity { v } else { q };
                }
            }
            Self::Clock => out[0] = state.time,
            Self::Unread(_) => out.fill(f64::NAN),
        }
    }
}

/// Reads a frame that is fixed to a moving body; `position` and `rotation` are in the body's frame.
fn read_at(
    reading: Reading,
    motion: &Motion,
    position: &Vector3<f64>,
    rotation: &UnitQuaternion<f64>,
    out: &mut [f64],
) {
    let at = motion.position + motion.rotation * position;
    let rotation = motion.rotation * rotation;
    read_frame(
        reading,
        &at,
        &rotation,
        motion.velocity_at(&at),
        motion.angular,
        out,
    );
}

fn read_frame(
    reading: Reading,
    position: &Vector3<f64>,
    rotation: &UnitQuaternion<f64>,
    velocity: Vector3<f64>,
    rate: Vector3<f64>,
    out: &mut [f64],
) {
    let vector = match reading {
        Reading::Orientation => {
            out.copy_from_slice(&[rotation.w, rotation.i, rotation.j, rotation.k]);
            return;
        }
        Reading::Position => *position,
        Reading::Axis(0) => rotation * Vector3::x(),
        Reading::Axis(1) => rotation * Vector3::y(),
        Reading::Axis(_) => rotation * Vector3::z(),
        Reading::Velocity => velocity,
        Reading::Rate => rate,
        Reading::OwnVelocity => rotation.inverse() * velocity,
        Reading::OwnRate => rotation.inverse() * rate,
    };
    out.copy_from_slice(vector.as_slice());
}
