//! Checks of a backend against theory and against the contract of [`asid_core::simulator`].
//!
//! A [`Check`] is a value: its name, the capability bits it needs, a function from a backend to one
//! figure, the tolerance of that figure and the reason for the tolerance. A figure is a
//! *deviation*: from a closed-form solution, or a count of broken promises. Zero is thus perfect
//! for every check. Running a check gives a [`Row`]. A capability that an engine does not claim
//! also gives a row, and so does a known deviation.
//!
//! Two rules keep the suite honest.
//!
//! - A check looks at capability bits and never at an engine's name. Known deviations of an engine
//!   are in the table `deviations.toml`, with the allowed figure and the reason.
//! - A tolerance follows from the time step, the arithmetic or the softness that the scene asks
//!   for. It does not follow from what some engine happens to give.
//!
//! # What a capability asks for
//!
//! A check needs exactly the capabilities that it names, and its scene needs no other. An engine
//! that refuses whatever it does not claim therefore passes all remaining checks. The bits' own
//! meaning is in [`Capabilities`]. In addition:
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
//! An engine may refuse what it need not accept, and is then not asked about it: an inertia along
//! other axes than the body's, further kinds of sensors, dampers on a free joint, and masses as
//! parameters that it does not claim. What it accepts must be right. An engine fails if it claims
//! nothing that moves. It also fails if no check can test a claimed bit without bits that it does
//! not claim.
//!
//! Determinism, invalid calls, divergence and the rules of parameters are checked on every engine,
//! in a scene made of what it claims. An engine that does not claim `EXACT_SNAPSHOT` is never asked
//! to save, restore or copy a state.
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

/// All checks, family by family.
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

/// The families in their order: the name, which is the first part of its checks' names, and a
/// sentence.
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

/// Progress of a run of checks.
#[derive(Clone, Copy, Debug)]
pub enum Event<'a> {
    /// A check begins.
    Begins(&'a Check),
    /// A check has ended with this row.
    Ends(&'a Row),
}

/// Runs some checks on a backend, several at a time; calls `told` when each begins and ends.
///
/// The rows are in the order of the checks and do not depend on `threads`.
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

/// An engine must claim one of these for any motion to check.
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
