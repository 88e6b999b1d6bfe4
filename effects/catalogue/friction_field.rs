//! Sliding friction that varies with place, time, episode or direction.
//!
//! The sites and the coefficients that are scaled are those of `sliding-friction`
//! ([`super::contact_friction`]). The factor is computed before each step, for each body that
//! slides on the site, from its own motion.

use crate::{Acting, Acts, Confusion, Effect, EffectParameter, Site, Start};
use asid_core::nalgebra::Vector3;
use asid_core::simulator::StepView;
use asid_core::{Capabilities, Result, Target};
use asid_mjcf::Plant;

use super::contact_friction::{needs, partners, sites, targets};
use super::point::{BodyPoint, Motion};
use super::{at_least, values};

crate::register!(EffectEntry {
    name: "friction-patch",
    about: "sliding friction is another beyond a place",
    make: || Box::new(Field::Patch),
});

crate::register!(EffectEntry {
    name: "friction-drift",
    about: "sliding friction changes over time",
    make: || Box::new(Field::Drift),
});

crate::register!(EffectEntry {
    name: "friction-trend",
    about: "sliding friction changes from episode to episode",
    make: || Box::new(Field::Trend),
});

crate::register!(EffectEntry {
    name: "friction-anisotropy",
    about: "sliding friction differs by direction",
    make: || Box::new(Field::Anisotropy),
});

/// Half the width of the transition at the edge of a patch, m.
const EDGE: f64 = 0.002;

/// Speed below which the direction of sliding gradually loses its effect, m/s.
const SLOW: f64 = 0.001;

/// How the factor is found.
///
/// - `Patch`: `ratio` where the coordinate `axis` (0 is x, 1 is y of the world) of the sliding
///   body's frame is beyond `place`, 1 before it, with a smooth step of 4 mm between.
/// - `Drift`: `1 + per_second t`, at least 0, `t` since the episode began.
/// - `Trend`: `1 + per_episode n`, at least 0, `n` the number of the episode among all logs: wear,
///   wax, warmth.
/// - `Anisotropy`: `1 + cos_2 cos 2φ + sin_2 sin 2φ`, at least 0, `φ` the direction of the body's
///   velocity in the plane of x and y.
#[derive(Clone, Copy)]
enum Field {
    Patch,
    Drift,
    Trend,
    Anisotropy,
}

struct FieldAt {
    field: Field,
    values: [f64; 3],
    /// The bodies that slide on the site, each with its factor in this step.
    bodies: Vec<(BodyPoint, f64)>,
    /// Each column with the bodies whose smallest factor scales it.
    columns: Vec<(usize, Vec<usize>)>,
}

impl FieldAt {
    fn factor(&self, time: f64, motion: &Motion) -> f64 {
        let [first, second, third] = self.values;
        match self.field {
            Field::Patch => {
                let along = motion.place[usize::from(third > 0.5)];
                let x = ((along - second) / EDGE + 1.0).clamp(0.0, 2.0) / 2.0;
                1.0 + (first - 1.0) * x * x * (3.0 - 2.0 * x)
            }
            Field::Drift => (1.0 + first * time).max(0.0),
            Field::Trend => (1.0 + first).max(0.0),
            Field::Anisotropy => {
                let v: Vector3<f64> = motion.velocity;
                let all = v.x * v.x + v.y * v.y + SLOW * SLOW;
                let (cos, sin) = ((v.x * v.x - v.y * v.y) / all, 2.0 * v.x * v.y / all);
                (1.0 + first * cos + second * sin).max(0.0)
            }
        }
    }
}

impl Acting for FieldAt {
    fn before_step(&mut self, view: &mut StepView<'_>) {
        for i in 0..self.bodies.len() {
            let motion = self.bodies[i].0.motion(view.qpos, view.qvel);
            self.bodies[i].1 = self.factor(view.time, &motion);
        }
        for (column, bodies) in &self.columns {
            let factors = bodies.iter().map(|&b| self.bodies[b].1);
            view.parameters[*column] *= factors.fold(f64::INFINITY, f64::min);
        }
    }
}

/// The bodies that slide on a site of these effects, as indices in the layout.
#[must_use]
pub fn sliding_bodies(plant: &Plant, site: &str) -> Vec<usize> {
    let geoms = plant.geom(site).map(|g| partners(plant, g, 0));
    let mut bodies: Vec<usize> = geoms
        .unwrap_or_default()
        .into_iter()
        .map(|g| plant.bodies[plant.geoms[g].body].weld)
        .collect();
    bodies.dedup();
    bodies
}

/// For each target of a site, the sliding bodies whose friction it sets, as indices in `bodies`.
///
/// A partner's coefficient belongs to its own body. The site's coefficient belongs to the first
/// partner that takes it. Where no partner does, it belongs to all: their smallest factor then
/// keeps it from counting in any contact.
fn bodies_of_targets(plant: &Plant, site: &str, bodies: &[usize]) -> Vec<Vec<usize>> {
    let place = |geom: usize| {
        let body = plant.bodies[plant.geoms[geom].body].weld;
        bodies.iter().position(|&b| b == body)
    };
    let own = |name: &str| {
        let geom = plant.geom(name).ok()?;
        if name != site {
            return Some(vec![place(geom)?]);
        }
        let takes = |g: &usize| plant.dominant([geom, *g], 0) == geom;
        let first = partners(plant, geom, 0).into_iter().find(takes);
        first.map(|g| place(g).into_iter().collect())
    };
    let all = || (0..bodies.len()).collect();
    let targets = targets(plant, site, 0);
    targets
        .iter()
        .map(|t| own(&t.name).unwrap_or_else(all))
        .collect()
}

impl Effect for Field {
    fn mistaken_for(&self) -> &'static [Confusion] {
        match self {
            Self::Patch => &[Confusion {
                with: &["friction-anisotropy", "gravity-tilt", "friction-drift"],
                told_apart_by: "the same track in several directions, and again after a half turn",
            }],
            Self::Trend => &[Confusion {
                with: &["sliding-friction", "friction-drift", "supply-trend"],
                told_apart_by: "repeat the first episode after the last",
            }],
            _ => &[],
        }
    }

    fn counts_episodes(&self) -> bool {
        matches!(self, Self::Trend)
    }

    fn acts(&self) -> Acts {
        Acts::Model
    }

    fn steps(&self) -> bool {
        true
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        match self {
            Self::Patch => {
                const {
                    &[
                        EffectParameter::new("ratio", "1", [0.1, 10.0], 1.0),
                        EffectParameter::new("place", "m", [-10.0, 10.0], 0.0)
                            .starting(Start::Places(&[0.2, 0.35, 0.5, 0.65, 0.8])),
                        EffectParameter::new("axis", "1", [0.0, 1.0], 0.0)
                            .starting(Start::Choice(&[0.0, 1.0])),
                    ]
                }
            }
            Self::Drift => const { &[EffectParameter::new("per_second", "1/s", [-1.0, 5.0], 0.0)] },
            Self::Trend => {
                const {
                    &[EffectParameter::new(
                        "per_episode",
                        "1/episode",
                        [-0.5, 2.0],
                        0.0,
                    )]
                }
            }
            Self::Anisotropy => {
                const {
                    &[
                        EffectParameter::new("cos_2", "1", [-0.9, 0.9], 0.0),
                        EffectParameter::new("sin_2", "1", [-0.9, 0.9], 0.0),
                    ]
                }
            }
        }
    }

    fn sites(&self, plant: &Plant) -> Vec<String> {
        sites(plant, 0)
    }

    fn targets(&self, plant: &Plant, site: &str) -> Vec<Target> {
        targets(plant, site, 0)
    }

    fn needs(&self) -> Capabilities {
        needs(0) | Capabilities::LIVE_PARAMETERS
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let values = match self {
            Self::Patch => {
                let all: [f64; 3] = values(site)?;
                at_least(site, "ratio", all[0], 0.0)?;
                all
            }
            Self::Drift => {
                let [rate] = values(site)?;
                [rate, 0.0, 0.0]
            }
            Self::Trend => {
                let [rate] = values(site)?;
                [rate * site.episode as f64, 0.0, 0.0]
            }
            Self::Anisotropy => {
                let [cos, sin] = values(site)?;
                [cos, sin, 0.0]
            }
        };
        let bodies = sliding_bodies(site.plant, site.name);
        let of_targets = bodies_of_targets(site.plant, site.name, &bodies);
        let point = |&body: &usize| (BodyPoint::origin(site.plant, body), 1.0);
        Ok(Box::new(FieldAt {
            field: *self,
            values,
            bodies: bodies.iter().map(point).collect(),
            columns: site.columns.iter().copied().zip(of_targets).collect(),
        }))
    }
}
