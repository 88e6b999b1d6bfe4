//! Play between a drive and its load.

use crate::{Acting, Acts, Confusion, Effect, EffectParameter, Native, Reference, Site, Start};
use asid_core::{Capabilities, Result, Target};
use asid_mjcf::Plant;
use asid_mjcf::native::{NativeModel, Series};

use super::motor_side::{self, MotorSide};
use super::{at_least, values};

crate::register!(EffectEntry {
    name: "backlash",
    about: "play between a drive and its joint",
    make: || Box::new(Backlash),
});

/// The drive acts on a rotor that moves freely against the joint within a gap of `width`.
///
/// At the ends of the gap, which are rigid and do not bounce, it pushes the joint: see
/// [`super::motor_side`]. The rotor has the joint's `armature` as its inertia, and the drive's
/// sensor sits on it. A servo's rotor may have no inertia, and then follows the servo's law. A
/// torque drive on a joint without `armature` is no site. Under a load that never changes sign, the
/// joint is only offset by half a gap.
struct Backlash;

impl Effect for Backlash {
    fn mistaken_for(&self) -> &'static [Confusion] {
        &[Confusion {
            with: &["actuator-deadband", "joint-compliance"],
            told_apart_by: "small and large motions, about and away from a steady load",
        }]
    }

    fn acts(&self) -> Acts {
        Acts::Force
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        const {
            &[EffectParameter::new("width", "rad or m", [0.0, 1.0], 0.0)
                .starting(Start::Multiples(Reference::Travel, &[0.005, 0.02, 0.08]))]
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
        let [width] = values(site)?;
        let joint = document.joint(site.name)?;
        if joint.series.is_some() {
            return Ok(Native::LeftOut(
                "stands beside another transmission of the same joint".into(),
            ));
        }
        joint.series = Some(Series {
            gap: width,
            ..Series::default()
        });
        Ok(Native::Nearly(format!(
            "is a second joint `{}_link` behind the drive's, so that qpos has one place more",
            site.name
        )))
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let [width] = values(site)?;
        let width = at_least(site, "width", width, 0.0)?;
        Ok(Box::new(MotorSide::with_gap(site, width)?))
    }
}
