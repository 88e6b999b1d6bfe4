//! Every kind of sensor that an engine accepts, on a frame that is rotated and moves.
//!
//! A kind that the engine refuses is not checked. An accepted kind must read in MJCF's frame:
//! `frame...` in the world, `gyro` and `velocimeter` in the site's own.

use asid_core::{Backend, Capabilities, Result};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::check::Measure::Taken;
use crate::check::{Check, Tolerance};
use crate::rig::{Rig, largest};

/// The checks of this file.
pub const CHECKS: &[Check] = &[
    Check {
        name: "frames/every-sensor-of-a-free-body",
        needs: Capabilities::FREE_BODIES,
        unit: "",
        tolerance: Tolerance::by_precision(1e-11, 1e-5),
        reason: "poses and velocities of a body, of its inertia and of a turned site, each kind that is taken, by hand: rounding at 3 m/s",
        measure: Taken(free),
    },
    Check {
        name: "frames/every-sensor-of-a-link",
        needs: Capabilities::ARTICULATION,
        unit: "",
        tolerance: Tolerance::by_precision(1e-11, 1e-5),
        reason: "as every-sensor-of-a-free-body, on a hinge that stands askew",
        measure: Taken(link),
    },
];

/// A frame in the world and its motion: velocity of its origin and angular velocity, both in the
/// world.
struct Moving {
    place: Vector3<f64>,
    attitude: UnitQuaternion<f64>,
    velocity: Vector3<f64>,
    rate: Vector3<f64>,
}

impl Moving {
    /// A frame that is fixed to this one.
    fn fixed(&self, place: Vector3<f64>, attitude: UnitQuaternion<f64>) -> Self {
        let arm = self.attitude * place;
        Self {
            place: self.place + arm,
            attitude: self.attitude * attitude,
            velocity: self.velocity + self.rate.cross(&arm),
            rate: self.rate,
        }
    }

    /// Expected reading of a sensor of this kind.
    fn reads(&self, kind: &str) -> Vec<f64> {
        let q = self.attitude;
        let own = |v: Vector3<f64>| q.inverse() * v;
        let vector = match kind {
            "framequat" => return vec![q.w, q.i, q.j, q.k],
            "framepos" => self.place,
            "framexaxis" => q * Vector3::x(),
            "frameyaxis" => q * Vector3::y(),
            "framezaxis" => q * Vector3::z(),
            "framelinvel" => self.velocity,
            "frameangvel" => self.rate,
            "velocimeter" => own(self.velocity),
            _ => own(self.rate),
        };
        vector.as_slice().to_vec()
    }
}

const FRAME: [&str; 7] = [
    "framepos",
    "framequat",
    "framexaxis",
    "frameyaxis",
    "framezaxis",
    "framelinvel",
    "frameangvel",
];

fn turn(w: f64, x: f64, y: f64, z: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
}

/// Readings of all accepted kinds of sensors, with the expected ones, on a body that moves in this
/// way.
///
/// The document has this text before and after the sensors.
fn readings(
    backend: &dyn Backend,
    joint: &str,
    place: &str,
    state: (&[f64], &[f64]),
    body: &Moving,
) -> Result<Option<f64>> {
    // Try a rotated inertia first; an engine may refuse it.
    let ways = [
        (r#" quat="0.6 0 0 0.8""#, turn(0.6, 0.0, 0.0, 0.8)),
        ("", UnitQuaternion::identity()),
    ];
    let document = |inertia: &str, sensor: &str| {
        format!(
            r#"<option gravity="0 0 0"/><worldbody><body name="b" {place}>{joint}
            <inertial pos=".1 .3 -.2"{inertia} mass="1" diaginertia=".1 .15 .2"/>
            <site name="s" pos=".5 -.4 .3" quat="0.28 0 0.96 0"/></body></worldbody>{sensor}"#
        )
    };
    let mut errors = Vec::new();
    for (inertia, axes) in ways {
        if Rig::new(backend, &document(inertia, ""), &[]).is_err() {
            continue;
        }
        let site = body.fixed(Vector3::new(0.5, -0.4, 0.3), turn(0.28, 0.0, 0.96, 0.0));
        let center = body.fixed(Vector3::new(0.1, 0.3, -0.2), axes);
        let upright = body.fixed(Vector3::zeros(), UnitQuaternion::identity());
        let own = ["gyro", "velocimeter"].map(|kind| (kind, r#"site="s""#, &site));
        let of = [
            ("site", "s", &site),
            ("body", "b", &center),
            ("xbody", "b", &upright),
        ];
        let frames = of.iter().flat_map(|(object, name, moving)| {
            FRAME.map(|kind| {
                (
                    kind,
                    format!(r#"objtype="{object}" objname="{name}""#),
                    *moving,
                )
            })
        });
        let all = own.map(|(kind, of, moving)| (kind, of.to_owned(), moving));
        for (kind, of, moving) in all.into_iter().chain(frames) {
            let sensor = format!(r#"<sensor><{kind} name="r" {of}/></sensor>"#);
            let Ok(mut rig) = Rig::new(backend, &document(inertia, &sensor), &["r"]) else {
                continue;
            };
            rig.place(state.0, state.1)?;
            let Ok(rows) = rig.read() else {
                continue;
            };
            let theory = moving.reads(kind);
            let sign = match kind {
                "framequat" if rows[0][0] * theory[0] < 0.0 => -1.0,
                _ => 1.0,
            };
            errors.extend(rows[0].iter().zip(&theory).map(|(a, b)| sign * a - b));
        }
        break;
    }
    Ok((!errors.is_empty()).then(|| largest(errors)))
}

fn free(backend: &dyn Backend) -> Result<Option<f64>> {
    let attitude = turn(0.6, 0.0, 0.64, 0.48);
    let (velocity, rate) = (Vector3::new(1.0, 2.0, -1.0), Vector3::new(0.5, -1.5, 2.0));
    let body = Moving {
        place: Vector3::new(1.0, -2.0, 3.0),
        attitude,
        velocity,
        rate: attitude * rate,
    };
    let q = [attitude.w, attitude.i, attitude.j, attitude.k];
    let qpos = [body.place.as_slice(), &q].concat();
    let qvel = [velocity.as_slice(), rate.as_slice()].concat();
    readings(
        backend,
        r#"<freejoint name="j"/>"#,
        "",
        (&qpos, &qvel),
        &body,
    )
}

fn link(backend: &dyn Backend) -> Result<Option<f64>> {
    let stands = turn(0.8, 0.0, 0.6, 0.0);
    let axis = Vector3::new(0.6, 0.0, 0.8);
    let body = Moving {
        place: Vector3::new(0.1, 0.2, 0.3),
        attitude: stands * UnitQuaternion::from_scaled_axis(axis * 0.7),
        velocity: Vector3::zeros(),
        rate: stands * axis * 2.5,
    };
    readings(
        backend,
        r#"<joint name="j" axis="0.6 0 0.8"/>"#,
        r#"pos="0.1 0.2 0.3" quat="0.8 0 0.6 0""#,
        (&[0.7], &[2.5]),
        &body,
    )
}
