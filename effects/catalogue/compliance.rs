//! Elasticity in series: a drive that moves its link through a spring.

use crate::{Acting, Acts, Effect, EffectParameter, Native, Reference, Site, Start};
use asid_core::{Capabilities, Result, Target};
use asid_mjcf::Plant;
use asid_mjcf::native::{NativeModel, Series};

use super::motor_side::{self, MotorSide};
use super::{at_least, values};

crate::register!(EffectEntry {
    name: "joint-compliance",
    about: "elasticity in series between a drive and its joint",
    make: || Box::new(Compliance),
});

/// Default damping ratio: pairs of steel gears have 0.03 to 0.17.
///
/// The values are those of R. Kasuba and J. W. Evans, "An extended model for determining dynamic
/// loads in spur gearing", J. Mech. Des. 103, 1981.
const LOSS: f64 = 0.03;

/// A spring of `compliance` between the drive's rotor and the joint: see [`super::motor_side`].
///
/// A damper in parallel with the spring damps the rotor's swing by `loss`, the damping ratio
/// against a fixed joint. The rotor has the joint's `armature` as its inertia, and the drive's
/// sensor sits on the rotor. A torque drive on a joint without `armature` is no site, since a
/// spring then changes nothing. A joint can have this effect or backlash, not both.
struct Compliance;

impl Effect for Compliance {
    fn acts(&self) -> Acts {
        Acts::Force
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        const {
            &[
                EffectParameter::new("compliance", "rad/(N m) or m/N", [0.0, 1.0], 0.0)
                    .starting(Start::Multiples(Reference::Give, &[0.01, 0.1, 1.0])),
                EffectParameter::new("loss", "1", [0.0, 1.0], LOSS).starting(Start::Given),
            ]
        }
    }

    fn sites(&self, plant: &Plant) -> Vec<String> {
        motor_side::sites(plant)
    }

    fn targets(&self, plant: &Plant, site: &str) -> Vec<Target> {
        motor_side::targets(plant, site)
    }

    fn needs(&self) -> Capabilities {
        Capabilities::JOINT_IMPEDANCE | Capabilities::LIVE_PARAMETERS
    }

    fn takes_drive(&self) -> bool {
        true
    }

    fn native(&self, site: &Site<'_>, document: &mut NativeModel<'_>) -> Result<Native> {
        let [compliance, loss] = values(site)?;
        if compliance == 0.0 {
            return Ok(Native::Whole);
        }
        let joint = document.joint(site.name)?;
        if joint.series.is_some() {
            return Ok(Native::LeftOut(
                "stands beside another transmission of the same joint".into(),
            ));
        }
        joint.series = Some(Series {
            gap: 0.0,
            compliance,
            loss,
        });
        Ok(Native::Nearly(format!(
            "is a second joint `{}_link` behind the drive's, so that qpos has one place more",
            site.name
        )))
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let [compliance, loss] = values(site)?;
        let compliance = at_least(site, "compliance", compliance, 0.0)?;
        let loss = at_least(site, "loss", loss, 0.0)?;
        Ok(Box::new(MotorSide::with_spring(site, compliance, loss)?))
    }
}
