//! Which machines and causes there are, their halves, and what a plan of 600 cases holds.

use std::collections::{BTreeMap, BTreeSet};

use asid_withheld::cause::Standing;
use asid_withheld::faults::Fault;
use asid_withheld::plan::{FACTORS, GAPS, Kind, Plan, Slot, Wanted, possible};
use asid_withheld::{Half, Result, causes, machines};

/// The machines of the training half, as in `docs/withheld.md`.
const TRAINING: [&str; 9] = [
    "servo",
    "belt-slide",
    "cart-pole",
    "arm2",
    "arm6",
    "bimanual",
    "gripper",
    "pushed-puck",
    "rolling-ball",
];
const TEST: [&str; 10] = [
    "geared-lift",
    "lid",
    "arm3",
    "arm7",
    "tendon-finger",
    "wheeled-base",
    "quadrotor",
    "hopper",
    "curling-stone",
    "free-flight",
];

/// The catalogue's names, from its guide and not from its code.
const CATALOGUE: [&str; 38] = [
    "actuator-delay",
    "actuator-lag",
    "actuator-gain",
    "actuator-bias",
    "actuator-saturation",
    "actuator-deadband",
    "backlash",
    "joint-compliance",
    "viscous-friction",
    "coulomb-friction",
    "stribeck-friction",
    "load-friction",
    "joint-stiffness",
    "torque-ripple",
    "armature",
    "mass",
    "center-of-mass",
    "inertia",
    "payload",
    "gravity-tilt",
    "constant-force",
    "linear-drag",
    "quadratic-drag",
    "magnus",
    "sliding-friction",
    "torsional-friction",
    "rolling-friction",
    "friction-patch",
    "friction-drift",
    "friction-anisotropy",
    "contact-restitution",
    "contact-stiffness",
    "sensor-delay",
    "sensor-filter",
    "sensor-bias",
    "sensor-scale",
    "sensor-drift",
    "sensor-quantization",
];

#[test]
fn the_split_is_by_kind_of_machine_and_as_written_down() {
    let names = |half| machines::of(half).map(|m| m.name).collect::<Vec<_>>();
    assert_eq!(names(Half::Training), TRAINING);
    assert_eq!(names(Half::Test), TEST);
    let all: BTreeSet<&str> = TRAINING.into_iter().chain(TEST).collect();
    assert_eq!(all.len(), TRAINING.len() + TEST.len());
    assert!(all.len() >= 16);
    let guide = include_str!("../../docs/withheld.md");
    for name in all {
        assert!(
            guide.contains(&format!("`{name}`")),
            "docs/withheld.md lacks {name}"
        );
    }
}

#[test]
fn each_machine_and_each_cause_has_a_file_of_its_own() {
    let here = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    for machine in machines::ALL {
        let file = here.join(format!("machines/{}.rs", machine.name.replace('-', "_")));
        let text = std::fs::read_to_string(&file).expect("a file");
        assert!(text.contains(&format!("name: \"{}\"", machine.name)));
    }
    let count = std::fs::read_dir(here.join("causes"))
        .expect("a folder")
        .count();
    assert_eq!(count, causes::ALL.len() + 1, "one file a cause, and mod.rs");
}

#[test]
fn the_causes_are_the_catalogue_and_at_least_ten_that_it_lacks() {
    let of = |standing| {
        let all = causes::ALL.iter().filter(move |c| c.standing() == standing);
        all.map(|c| c.name()).collect::<BTreeSet<_>>()
    };
    assert_eq!(of(Standing::Catalogue), CATALOGUE.into_iter().collect());
    assert!(of(Standing::Unknown).len() >= 10);
    assert!(
        of(Standing::Unknown)
            .iter()
            .all(|n| n.starts_with("unknown:"))
    );
}

#[test]
fn each_half_of_600_cases_keeps_its_quotas() -> Result<()> {
    for half in [Half::Training, Half::Test] {
        let plan = Plan::draw(half, 1, 600, &[])?;
        let count = |f: &dyn Fn(&asid_withheld::plan::Slot) -> bool| {
            plan.slots.iter().filter(|s| f(s)).count()
        };
        assert_eq!(count(&|s| s.dirty), 300);
        assert!(count(&|s| s.kind == Kind::None && !s.dirty) >= 150);
        assert!(count(&|s| s.kind == Kind::Unknown) >= 60);
        assert!(count(&|s| s.fault.is_some()) >= 90);
        assert!(count(&|s| s.wiring.is_some()) >= 40);
        assert!(count(&|s| s.little) >= 25);
        assert!(count(&|s| s.kind == Kind::Several) >= 50);
        assert!(count(&|s| s.kind == Kind::Group) >= 30);
        // Every cause that a machine of the half can have occurs, and in clean worlds at each gap.
        let mut levels: BTreeMap<&str, BTreeSet<usize>> = BTreeMap::new();
        for slot in &plan.slots {
            for cause in &slot.causes {
                levels.entry(cause.name()).or_default().insert(slot.level);
            }
        }
        for machine in &plan.machines {
            for cause in possible(machine, |_| true) {
                assert!(
                    levels.contains_key(cause.name()),
                    "{half:?}: no {}",
                    cause.name()
                );
            }
        }
        let aims: BTreeSet<u64> = plan.slots.iter().map(|s| s.aim(0) as u64).collect();
        assert!(aims.len() >= GAPS.len().max(FACTORS.len()));
    }
    Ok(())
}

#[test]
fn every_effect_of_the_catalogue_can_be_in_both_halves() -> Result<()> {
    for half in [Half::Training, Half::Test] {
        let plan = Plan::draw(half, 0, 1, &[])?;
        for cause in causes::ALL {
            let somewhere = plan.machines.iter().any(|m| !cause.sites(m).is_empty());
            assert!(somewhere, "{half:?}: no machine can have {}", cause.name());
        }
    }
    Ok(())
}

#[test]
fn a_set_for_one_question_has_only_its_cases() -> Result<()> {
    let wanted = Wanted {
        kinds: vec![Kind::Single, Kind::Group],
        causes: vec!["viscous-friction".into(), "backlash".into()],
        dirty: Some(false),
        size: 10.0,
        fault: None,
    };
    let plan = Plan::draw_wanted(Half::Training, (3, 40), &[], &wanted)?;
    assert_eq!(plan.slots.len(), 40);
    for slot in &plan.slots {
        assert!(matches!(slot.kind, Kind::Single | Kind::Group) && !slot.dirty);
        assert!(slot.aim(0) >= 10.0);
        let names: Vec<&str> = slot.causes.iter().map(|c| c.name()).collect();
        assert!(
            names == ["viscous-friction"] || names == ["backlash"],
            "{names:?}"
        );
    }
    let none = Wanted {
        kinds: vec![Kind::None],
        ..Wanted::default()
    };
    let plan = Plan::draw_wanted(Half::Test, (3, 50), &[], &none)?;
    assert!(plan.slots.iter().all(|s| s.causes.is_empty()));
    let wrong = |causes: &[&str], kinds: &[Kind]| {
        let wanted = Wanted {
            kinds: kinds.to_vec(),
            causes: causes.iter().map(|c| (*c).to_owned()).collect(),
            ..Wanted::default()
        };
        let plan = Plan::draw_wanted(Half::Test, (3, 5), &[], &wanted);
        plan.err().map(|e| e.to_string()).unwrap_or_default()
    };
    assert!(wrong(&["viscous"], &[]).starts_with("there is no cause `viscous`; there are "));
    assert_eq!(
        wrong(&["viscous-friction"], &[Kind::Unknown]),
        "no machine of the test half has such a case"
    );
    Ok(())
}

#[test]
fn the_same_worlds_have_another_fault() -> Result<()> {
    let plan = |fault| {
        let wanted = Wanted {
            fault,
            ..Wanted::default()
        };
        Plan::draw_wanted(Half::Training, (8, 60), &[], &wanted)
    };
    let dealt = plan(None)?;
    assert!(dealt.slots.iter().any(|s| s.fault.is_some()));
    for fault in Fault::all() {
        assert_eq!(Fault::named(fault.name()), Some(fault));
        let spoilt = plan(Some(fault))?;
        for (a, b) in dealt.slots.iter().zip(&spoilt.slots) {
            let names = |s: &Slot| s.causes.iter().map(|c| c.name()).collect::<Vec<_>>();
            assert_eq!(
                (a.machine, names(a), a.level),
                (b.machine, names(b), b.level)
            );
            let own = match (b.fault, b.wiring) {
                (None, None) => Fault::Nothing,
                (Some(log), None) => Fault::Log(log),
                (None, Some(wiring)) => Fault::Wiring(wiring),
                both => panic!("{both:?}"),
            };
            assert_eq!(own, fault);
        }
    }
    Ok(())
}

#[test]
fn a_kind_is_found_by_its_name_and_by_those_of_labels() {
    for kind in Kind::ALL {
        assert_eq!(Kind::named(kind.name()), Some(kind));
    }
    assert_eq!(Kind::named("pair"), Some(Kind::Several));
    assert_eq!(Kind::named("both"), None);
}
