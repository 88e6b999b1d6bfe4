//! The causes, one file each.
//!
//! First come those of the catalogue in its order, then those with agreed names, last those of no
//! catalogue.

use crate::cause::Cause;

mod actuator_bias;
mod actuator_deadband;
mod actuator_delay;
mod actuator_gain;
mod actuator_hysteresis;
mod actuator_lag;
mod actuator_saturation;
mod armature;
mod backlash;
mod center_of_mass;
mod constant_force;
mod contact_restitution;
mod contact_stiffness;
mod coulomb_friction;
mod episode_offset;
mod friction_anisotropy;
mod friction_drift;
mod friction_patch;
mod friction_trend;
mod geometry;
mod gravity_tilt;
mod inertia;
mod joint_compliance;
mod joint_stiffness;
mod linear_drag;
mod load_friction;
mod magnus;
mod mass;
mod payload;
mod quadratic_drag;
mod rolling_friction;
mod sensor_bias;
mod sensor_delay;
mod sensor_drift;
mod sensor_filter;
mod sensor_quantization;
mod sensor_scale;
mod sensor_trend;
mod servo_damping;
mod servo_stiffness;
mod sliding_friction;
mod stribeck_friction;
mod supply_drift;
mod supply_trend;
mod torque_ripple;
mod torque_speed_limit;
mod torsional_friction;
mod unknown_dropouts;
mod unknown_eddy_brake;
mod unknown_encoder_eccentricity;
mod unknown_gust;
mod unknown_heat_fade;
mod unknown_hidden_absorber;
mod unknown_hidden_gyroscope;
mod unknown_hysteretic_spring;
mod unknown_magnet;
mod unknown_motor_crosstalk;
mod unknown_self_excitation;
mod unknown_shaker;
mod unknown_slew_limit;
mod unknown_soft_stop;
mod unknown_wind_zone;
mod viscous_friction;

/// All causes.
pub const ALL: &[&dyn Cause] = &[
    &actuator_delay::ActuatorDelay,
    &actuator_lag::ActuatorLag,
    &actuator_gain::ActuatorGain,
    &actuator_bias::ActuatorBias,
    &actuator_saturation::ActuatorSaturation,
    &actuator_deadband::ActuatorDeadband,
    &backlash::Backlash,
    &joint_compliance::JointCompliance,
    &viscous_friction::ViscousFriction,
    &coulomb_friction::CoulombFriction,
    &stribeck_friction::StribeckFriction,
    &load_friction::LoadFriction,
    &joint_stiffness::JointStiffness,
    &armature::Armature,
    &torque_ripple::TorqueRipple,
    &sensor_delay::SensorDelay,
    &sensor_filter::SensorFilter,
    &sensor_scale::SensorScale,
    &sensor_bias::SensorBias,
    &sensor_drift::SensorDrift,
    &sensor_quantization::SensorQuantization,
    &sliding_friction::SlidingFriction,
    &torsional_friction::TorsionalFriction,
    &rolling_friction::RollingFriction,
    &friction_patch::FrictionPatch,
    &friction_drift::FrictionDrift,
    &friction_anisotropy::FrictionAnisotropy,
    &contact_restitution::ContactRestitution,
    &contact_stiffness::ContactStiffness,
    &mass::Mass,
    &center_of_mass::CenterOfMass,
    &inertia::Inertia,
    &payload::Payload,
    &gravity_tilt::GravityTilt,
    &constant_force::ConstantForce,
    &linear_drag::LinearDrag,
    &quadratic_drag::QuadraticDrag,
    &magnus::Magnus,
    &actuator_hysteresis::ActuatorHysteresis,
    &servo_stiffness::ServoStiffness,
    &servo_damping::ServoDamping,
    &torque_speed_limit::TorqueSpeedLimit,
    &supply_drift::SupplyDrift,
    &supply_trend::SupplyTrend,
    &sensor_trend::SensorTrend,
    &friction_trend::FrictionTrend,
    &episode_offset::EpisodeOffset,
    &geometry::Geometry,
    &unknown_magnet::Magnet,
    &unknown_soft_stop::SoftStop,
    &unknown_eddy_brake::EddyBrake,
    &unknown_self_excitation::SelfExcitation,
    &unknown_hidden_absorber::HiddenAbsorber,
    &unknown_shaker::Shaker,
    &unknown_hysteretic_spring::HystereticSpring,
    &unknown_motor_crosstalk::MotorCrosstalk,
    &unknown_gust::Gust,
    &unknown_wind_zone::WindZone,
    &unknown_hidden_gyroscope::HiddenGyroscope,
    &unknown_heat_fade::HeatFade,
    &unknown_dropouts::Dropouts,
    &unknown_slew_limit::SlewLimit,
    &unknown_encoder_eccentricity::EncoderEccentricity,
];

/// The cause of that name.
#[must_use]
pub fn named(name: &str) -> Option<&'static dyn Cause> {
    ALL.iter().copied().find(|c| c.name() == name)
}
