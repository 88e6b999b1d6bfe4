//! Dirt: the small deviations that every real machine has, all at once.

use rand::Rng;

use crate::anatomy::{Anatomy, JointKind};
use crate::cause::{Cause, Place, Values, geared_joints, moving_bodies};
use crate::causes;
use crate::random::normal;
use crate::simulate::Typical;
use crate::world::World;

/// Standard deviation of masses and of moments of inertia, as a share.
const MASS: f64 = 0.03;
/// Standard deviation of lengths, m.
const LENGTH: f64 = 0.001;
/// Standard deviation of axes, rad: half a degree.
const AXIS: f64 = 0.0087;
/// Standard deviation of a joint's friction, as a share of its friction.
const FRICTION: f64 = 0.1;
/// Range of the delay of commands, s.
const DELAY: [f64; 2] = [0.001, 0.002];
/// Range of the encoders' quantisation steps, in standard deviations of their noise.
const STEP: [f64; 2] = [0.5, 2.0];
/// Range of the twist of a drive under its typical force, in standard deviations of its sensor's
/// noise.
const TWIST: [f64; 2] = [0.3, 1.5];

/// One item of dirt, or one cause of a case.
#[derive(Clone)]
pub struct Item {
    /// Its cause.
    pub cause: &'static dyn Cause,
    /// Its site.
    pub site: String,
    /// Its size; signed if the cause has a sign.
    pub size: f64,
    /// Random numbers for everything but the size.
    pub draw: [f64; 4],
}

impl Item {
    /// Adds the item to a world.
    pub fn act(&self, machine: &Anatomy, typical: &Typical, world: &mut World) -> Values {
        let place = Place {
            machine,
            typical,
            site: &self.site,
            draw: self.draw,
        };
        self.cause.act(&place, self.size, world)
    }

    /// `NAME@SITE`, or the name alone if the site is the whole machine.
    #[must_use]
    pub fn label(&self) -> String {
        label(self.cause, &self.site)
    }
}

/// `NAME@SITE`, or the name alone if the site is the whole machine.
#[must_use]
pub fn label(cause: &dyn Cause, site: &str) -> String {
    if site.is_empty() {
        cause.name().to_owned()
    } else {
        format!("{}@{site}", cause.name())
    }
}

/// Draws the small deviations of a machine.
pub fn draw(machine: &Anatomy, typical: &Typical, random: &mut impl Rng) -> Vec<Item> {
    let mut items = Vec::new();
    let mut add = |name: &str, site: &str, size: f64, draw: [f64; 4]| {
        let cause = causes::named(name);
        if let Some(cause) = cause.filter(|_| size != 0.0) {
            items.push(Item {
                cause,
                site: site.to_owned(),
                size,
                draw,
            });
        }
    };
    let jointed = causes::named("geometry").map_or_else(Vec::new, |c| c.sites(machine));
    // With these draws a signed size increases the value.
    let up = [1.0; 4];
    for body in moving_bodies(machine) {
        add("mass", &body, MASS * normal(random), up);
        add("inertia", &body, MASS * normal(random), up);
        if !jointed.contains(&body) {
            continue;
        }
        for (deviation, kind) in [(LENGTH, 0.0), (AXIS, 1.0)] {
            let mut draws: [f64; 4] = std::array::from_fn(|_| random.random());
            draws[3] = kind;
            add("geometry", &body, deviation * normal(random).abs(), draws);
        }
    }
    for joint in machine.joints.iter().filter(|j| j.kind != JointKind::Free) {
        let viscous = FRICTION * joint.damping * normal(random);
        add("viscous-friction", &joint.name, viscous, up);
        let dry = FRICTION * joint.damping * typical.speed[joint.dof] * normal(random).abs();
        // These draws give no offset.
        add("coulomb-friction", &joint.name, dry, [0.0; 4]);
    }
    let delay = random.random_range(DELAY[0]..DELAY[1]);
    for drive in &machine.drives {
        add("actuator-delay", &drive.name, delay, up);
    }
    let geared = geared_joints(machine);
    if !geared.is_empty() {
        let joint = &geared[random.random_range(0..geared.len())];
        let j = machine.joint(joint).unwrap_or(0);
        let sensor = machine.sensors.iter().find(|s| s.kind == "jointpos");
        let force = typical.drive[machine.joints[j].dof].max(1e-3);
        let twist = random.random_range(TWIST[0]..TWIST[1]) * sensor.map_or(1e-3, |s| s.noise);
        add("joint-compliance", joint, twist / force, up);
    }
    for sensor in machine.sensors.iter().filter(|s| s.kind == "jointpos") {
        let step = random.random_range(STEP[0]..STEP[1]) * sensor.noise;
        add("sensor-quantization", &sensor.name, step, up);
    }
    items
}
