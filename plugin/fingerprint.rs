//! What a plugin and this program must have in common, and what to do if they differ.
//!
//! The layout of Rust types is up to the compiler, so only the same compiler gives the same layout.
//! The sources of ASID's crates fix their own types. The sizes of all types that cross reveal a
//! dependency that was built with other features, such as serde_json's order-preserving maps.

/// Compiler, target and sources of this copy, one `name=value` a line, zero-terminated.
pub const TEXT: &str = concat!(
    "compiler=",
    env!("ASID_COMPILER"),
    "\ntarget=",
    env!("ASID_TARGET"),
    "\nasid=",
    env!("CARGO_PKG_VERSION"),
    "\nsources=",
    env!("ASID_SOURCES"),
    "\0"
);

/// Size and alignment of a type, in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct Probe {
    size: u32,
    align: u32,
}

macro_rules! probes {
    ($($type:ty),* $(,)?) => {
        /// The types that cross, by name.
        const NAMES: &[&str] = &[$(stringify!($type)),*];
        /// Their sizes in this copy of the crate.
        pub static PROBES: &[Probe] = &[$(Probe {
            size: size_of::<$type>() as u32,
            align: align_of::<$type>() as u32,
        }),*];
    };
}

probes!(
    toml::Value,
    toml::Table,
    toml::value::Datetime,
    serde_json::Value,
    serde_json::Map<String, serde_json::Value>,
    serde_json::Number,
    nalgebra::DMatrix<f64>,
    nalgebra::Vector3<f64>,
    nalgebra::UnitQuaternion<f64>,
    asid_core::Error,
    asid_core::Scene,
    asid_core::Layout,
    asid_core::Recording,
    asid_core::Parameter,
    asid_core::Target,
    asid_core::Streams,
    asid_core::signal::Signal,
    asid_core::Episode,
    asid_core::Posterior,
    asid_core::Problem<'static>,
    asid_core::Rollout<'static>,
    asid_core::Snapshot,
    asid_core::Status,
    asid_core::simulator::StepView<'static>,
    asid_core::task::Condition,
    asid_core::task::Coordinate,
    asid_core::task::ExplorationProtocol,
    asid_core::task::DownstreamProtocol,
    asid_core::task::Outcome,
    asid_core::task::TopView,
    asid_core::task::TrackedObject,
    asid_core::Difficulty,
    asid_core::explore::Explored<'static>,
    asid_core::identify::Identified,
    asid_core::solve::Solved<'static>,
    asid_effects::EffectParameter,
    asid_effects::Site<'static>,
    asid_mjcf::plant::Plant,
    asid_core::registry::TaskEntry,
    asid_effects::EffectEntry,
    asid_core::registry::ExplorerEntry,
);

/// What differs from the plugin's text `theirs` and what to do; `None` where nothing differs.
pub fn difference(theirs: &str) -> Option<String> {
    let ours = TEXT.trim_end_matches('\0');
    if theirs == ours {
        return None;
    }
    let of = |text: &str, key: &str| {
        text.lines()
            .filter_map(|l| l.split_once('='))
            .find(|(k, _)| *k == key)
            .map_or("unknown", |(_, value)| value)
            .to_owned()
    };
    let differs =
        |key| (of(theirs, key) != of(ours, key)).then(|| (of(theirs, key), of(ours, key)));
    if let Some((theirs, ours)) = differs("compiler") {
        return Some(format!(
            "was built by {theirs}, this asid by {ours}: rebuild the plugin with the compiler of this asid"
        ));
    }
    if let Some((theirs, ours)) = differs("target") {
        return Some(format!(
            "was built for {theirs}, this asid for {ours}: rebuild the plugin for the target of this asid"
        ));
    }
    let core = |text| format!("{} ({})", of(text, "asid"), of(text, "sources"));
    Some(format!(
        "was built from asid {}, this asid from {}: rebuild the plugin from the sources of this asid",
        core(theirs),
        core(ours)
    ))
}

/// The type that has another size in the plugin, as a message; `None` where none has.
pub fn other_layout(theirs: &[Probe]) -> Option<String> {
    if theirs.len() != PROBES.len() {
        return Some(format!(
            "tells the sizes of {} types where {} are needed: rebuild the plugin",
            theirs.len(),
            PROBES.len()
        ));
    }
    let i = theirs.iter().zip(PROBES).position(|(t, o)| t != o)?;
    Some(format!(
        "has {} bytes for {}, this asid has {}: a dependency is built with other features; \
         build the plugin and asid with the same ones",
        theirs[i].size, NAMES[i], PROBES[i].size
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_is_accepted_and_each_difference_is_named() {
        let ours = TEXT.trim_end_matches('\0');
        assert_eq!(difference(ours), None);
        let compiler = ours.replace(env!("ASID_COMPILER"), "rustc 1.0.0 (abc 2015-05-15)");
        let text = difference(&compiler).unwrap();
        assert!(
            text.starts_with("was built by rustc 1.0.0 (abc 2015-05-15)"),
            "{text}"
        );
        let sources = ours.replace(env!("ASID_SOURCES"), "0123456789abcdef");
        let text = difference(&sources).unwrap();
        assert!(
            text.contains("0123456789abcdef") && text.contains("rebuild"),
            "{text}"
        );
        assert!(difference("").unwrap().contains("unknown"));
    }

    #[test]
    fn another_size_names_the_type() {
        assert_eq!(other_layout(PROBES), None);
        let mut probes = PROBES.to_vec();
        probes[3].size += 8;
        let text = other_layout(&probes).unwrap();
        assert!(text.contains("serde_json::Value"), "{text}");
        assert!(other_layout(&probes[1..]).is_some());
    }
}
