//! Is an engine right? Checks of a backend against theory, and against the
//! contract of [`asid_core::simulator`].
//!
//! A [`Check`] is a value: its name, the capability bits it needs, a function
//! from a backend to one figure, the tolerance of that figure and the reason
//! for the tolerance. A figure is a *deviation*: from a closed-form solution, or
//! a count of broken promises, so that zero is perfect for every check. Running
//! a check gives a [`Row`], and rows are all there is to read: what an engine
//! does not claim is a row too, and so is what it is known to get wrong.
//!
//! Two rules keep the suite honest. A check looks at capability bits and never
//! at an engine's name; what one engine is known to miss stands in the table
//! `deviations.toml`, with the figure that is allowed and the reason. And a
//! tolerance follows from the time step, the arithmetic or the softness that
//! the scene asks for, not from what some engine happens to give.
//!
//! # What a capability asks for
//!
//! A check needs exactly the capabilities that it names, and its scene has nothing
//! that needs another: an engine that refuses whatever it does not claim passes
//! all that is left. Beside the bits' own meaning (see [`Capabilities`]):
//!
//! | claimed | sensors and parts of a document that its checks use |
//! |---|---|
//! | anything | `<key>`, `<inertial>`, geoms with `contype="0" conaffinity="0"` and their mass and inertia; the `option/gravity` parameters; `qpos.` and `qvel.` channels |
//! | `ARTICULATION` | hinges, slides and balls with `ref`; sensors `jointpos`, `jointvel`, and of sites `framepos`, `framequat`, `framelinvel`, `frameangvel` |
//! | `FREE_BODIES` | `<freejoint>`; sensors `framepos` and `framequat` of bodies (`body` and `xbody`) and `framepos` of sites, `framelinvel` of bodies |
//! | `ACTUATORS` | `motor`, `position` and `velocity` on hinges, with `gear`, `ctrlrange`, `forcerange`; parameters `kp`, `kv`, `gear`. Stiff servos ask for `integrator="implicitfast"` |
//! | `JOINT_IMPEDANCE` | `damping`, `stiffness` with `springref`, `armature`, and these as parameters |
//! | `JOINT_FRICTION`, `JOINT_LIMITS` | `frictionloss`, also as a parameter; `range` |
//! | `CONTACT` | planes, spheres, boxes, cylinders, capsules; `contype`, `conaffinity`, `priority`, `<exclude>`, `<pair>`; sliding friction, also as a parameter |
//! | `JOINT_ANCHORS` | `joint/…/pos`, `joint/…/axis`, `body/…/pos` |
//! | `MASS_PARAMETERS` | `geom/…/pos`, `geom/…/mass`, `body/…/mass`, `ipos`, `inertia` |
//!
//! What an engine need not take, it may refuse and is not asked about: an inertia along
//! other axes than the body's, further kinds of sensors, dampers on a free joint, masses as
//! parameters that it does not claim. What it takes must be right. An engine that claims
//! nothing that moves fails, and so does a claimed bit that no check can see without others.
//!
//! Snapshots, determinism, hostile calls, divergence and the rules of parameters are
//! asked of every engine, in a scene made of what it claims.
//!
//! ```no_run
//! # fn main() -> asid_core::Result<()> {
//! let entry = asid_core::registry::find::<asid_core::registry::BackendEntry>("mujoco")?;
//! let backend = (entry.make)()?;
//! let rows = asid_conformance::run(&*backend);
//! assert!(rows.iter().all(|row| !row.is_failure()), "{}", asid_conformance::table(&rows));
//! # Ok(())
//! # }
//! ```

mod actuators;
mod arrays;
mod check;
mod claims;
mod contact;
mod contact_parameters;
mod contact_rules;
mod deviations;
mod divergence;
mod dynamics;
mod effects;
mod equalities;
mod faults;
mod forces;
mod frames;
mod free_bodies;
mod friction;
mod hooks;
mod joints;
mod layout;
mod lifetime;
mod mechanism_parameters;
mod named;
mod pair;
mod parameters;
mod parts;
mod rig;
mod sensors;
mod state;
mod subject;

pub use check::{Check, Measure, Outcome, Row, Tolerance, table};

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use asid_core::{Backend, Capabilities};

/// Every check, family after family.
pub fn checks() -> impl Iterator<Item = &'static Check> {
    [
        dynamics::CHECKS,
        joints::CHECKS,
        equalities::CHECKS,
        contact::CHECKS,
        contact_rules::CHECKS,
        friction::CHECKS,
        actuators::CHECKS,
        arrays::CHECKS,
        frames::CHECKS,
        sensors::CHECKS,
        contact_parameters::CHECKS,
        mechanism_parameters::CHECKS,
        free_bodies::CHECKS,
        parameters::CHECKS,
        forces::CHECKS,
        effects::CHECKS,
        hooks::CHECKS,
        state::CHECKS,
        lifetime::CHECKS,
        divergence::CHECKS,
        faults::CHECKS,
        claims::CHECKS,
    ]
    .into_iter()
    .flatten()
}

/// What the checks of a family are about, in the order of families: its name, which is
/// the first part of its checks' names, and a sentence.
pub const FAMILIES: &[(&str, &str)] = &[
    (
        "dynamics",
        "Free motion and trees of joints against closed-form solutions.",
    ),
    (
        "joints",
        "Springs, dampers, dry friction, rotor inertia, limits and equalities of joints.",
    ),
    (
        "contact",
        "Contact along the normal: rest, weight, stacks, edges, collisions, and who meets whom.",
    ),
    (
        "friction",
        "Friction of contacts: sliding, rolling, spinning, and whose friction counts.",
    ),
    ("actuators", "Motors and servos, their gains and limits."),
    (
        "arrays",
        "Names and places in arrays: the layout, keyframes, quaternions, free joints, rows.",
    ),
    (
        "frames",
        "Frames and units of sensors against forward kinematics by hand.",
    ),
    (
        "parameters",
        "Each parameter by the amount that physics says, and the rules of parameters.",
    ),
    ("forces", "External wrenches."),
    (
        "effects",
        "The hook before each step, and what effects do there.",
    ),
    (
        "state",
        "Snapshots, determinism, batches and threads, to the bit.",
    ),
    (
        "divergence",
        "Simulations that leave the plausible range: reported, alone, and able to recover.",
    ),
    (
        "faults",
        "Calls that make no sense: an error each, and none changes anything.",
    ),
    (
        "claims",
        "What an engine does not claim, it refuses or does; it leaves nothing out silently.",
    ),
];

/// Runs every check on a backend.
#[must_use]
pub fn run(backend: &dyn Backend) -> Vec<Row> {
    let all: Vec<&Check> = checks().collect();
    run_checks(backend, &all, 1, &|_| {})
}

/// What is told while checks run.
#[derive(Clone, Copy, Debug)]
pub enum Event<'a> {
    /// A check begins.
    Begins(&'a Check),
    /// A check has its row.
    Ends(&'a Row),
}

/// Runs some checks on a backend, several at a time; `told` hears when each begins and ends.
/// Rows are in the order of the checks, and do not depend on `threads`.
pub fn run_checks(
    backend: &dyn Backend,
    checks: &[&Check],
    threads: usize,
    told: &(dyn Fn(Event<'_>) + Sync),
) -> Vec<Row> {
    let next = AtomicUsize::new(0);
    let rows: Vec<Mutex<Option<Row>>> = checks.iter().map(|_| Mutex::new(None)).collect();
    let work = || {
        while let Some((check, place)) = {
            let i = next.fetch_add(1, Ordering::Relaxed);
            checks.get(i).zip(rows.get(i))
        } {
            told(Event::Begins(check));
            let row = check.run(backend);
            told(Event::Ends(&row));
            if let Ok(mut place) = place.lock() {
                *place = Some(row);
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..threads.min(checks.len()) {
            scope.spawn(work);
        }
        work();
    });
    rows.into_iter()
        .filter_map(|row| row.into_inner().ok().flatten())
        .collect()
}

/// What an engine must be able to do for anything to be asked of it: something moves.
pub(crate) const MOVES: Capabilities = Capabilities::ARTICULATION.union(Capabilities::FREE_BODIES);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_check_has_a_family_a_reason_and_a_name_of_its_own() {
        let mut names = std::collections::HashSet::new();
        for check in checks() {
            assert!(names.insert(check.name), "{} is there twice", check.name);
            assert!(check.reason.len() > 10, "{} has no reason", check.name);
            let known = FAMILIES.iter().any(|(family, _)| *family == check.family());
            assert!(known, "{} is of no family", check.name);
        }
    }
}
